//! This module defines errors in scene files, with their position in the file and a remedy.

use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, NamedSource, SourceSpan};
use thiserror::Error;

use super::keys::span_of;
use super::source::{Origin, SceneSource};

/// Largest number of errors reported at once.
pub(super) const MAX_ERRORS: usize = 8;
/// Longest message that is shown, bytes; longer messages (from hostile input) are cut.
const MAX_MESSAGE: usize = 600;
/// Longest source line that is shown, bytes; errors in longer lines only name the position.
const MAX_LINE: usize = 400;

/// An error in a scene: message, position and remedy.
///
/// It is created where the fault is found. [`SceneError::with_source`] adds file name and text, so
/// that `miette` shows the line and [`SceneError::one_line`] names it.
#[derive(Clone, Debug, Diagnostic, Error)]
#[error("{message}")]
pub struct SceneError {
    message: Box<str>,
    #[help]
    help: Option<Box<str>>,
    label: Box<str>,
    #[label("{label}")]
    span: Option<SourceSpan>,
    #[source_code]
    text: Option<Arc<NamedSource<String>>>,
    site: Box<Site>,
    #[related]
    related: Vec<SceneError>,
}

/// Where the fault is, as far as it is known.
#[derive(Clone, Debug)]
enum Site {
    Unknown,
    /// A key of the scene.
    Key(Box<str>),
    /// `file` or `file:line:column`.
    Place(Box<str>),
    /// A `--set` argument, which the message names.
    Argument,
}

/// Something that an error can point at: a value of the scene or a byte range of its text.
pub trait Place {
    /// Byte range in the source text; `None` for values that come from no text.
    fn place(&self) -> Option<Range<usize>>;
}

impl Place for Range<usize> {
    fn place(&self) -> Option<Range<usize>> {
        Some(self.clone())
    }
}

impl<P: Place> Place for Option<P> {
    fn place(&self) -> Option<Range<usize>> {
        self.as_ref().and_then(P::place)
    }
}

impl SceneError {
    /// An error without a position.
    pub fn new(message: impl AsRef<str>, help: impl AsRef<str>) -> Self {
        Self::at(&None::<Range<usize>>, message, help)
    }

    /// An error at a key such as `accuracy.cells` or `gauges[1].material`.
    pub fn of_key(key: impl AsRef<str>, message: impl AsRef<str>, help: impl AsRef<str>) -> Self {
        SceneError { site: Box::new(Site::Key(key.as_ref().into())), ..Self::new(message, help) }
    }

    /// An error at a value or a byte range; an empty `help` is omitted.
    pub fn at(place: &impl Place, message: impl AsRef<str>, help: impl AsRef<str>) -> Self {
        let help = help.as_ref();
        SceneError {
            message: printable(message.as_ref()).into(),
            help: (!help.is_empty()).then(|| printable(help).into()),
            label: "here".into(),
            span: place.place().map(SourceSpan::from),
            text: None,
            site: Box::new(Site::Unknown),
            related: vec![],
        }
    }

    /// Sets the words beside the underlined text.
    pub fn with_label(mut self, label: impl AsRef<str>) -> Self {
        self.label = printable(label.as_ref()).into();
        self
    }

    /// Adds file name and text to this error and to all related errors that have none yet.
    pub fn with_source(mut self, source: &SceneSource) -> Self {
        if !matches!(*self.site, Site::Place(_) | Site::Argument) {
            self.locate(source);
        }
        self.related = self.related.into_iter().map(|e| e.with_source(source)).collect();
        self
    }

    fn locate(&mut self, source: &SceneSource) {
        let name = printable(source.name());
        if let (None, Site::Key(key)) = (self.span, &*self.site) {
            self.span = span_of(source.text(), key).map(SourceSpan::from);
        }
        let span = match self.span().map(|span| source.origin(span)) {
            None => {
                *self.site = Site::Place(name.into());
                return;
            }
            Some(Origin::Set(argument)) => {
                self.message = printable(&format!("--set {argument}: {}", self.message)).into();
                self.span = None;
                *self.site = Site::Argument;
                return;
            }
            Some(Origin::File(span)) => SourceSpan::from(span),
        };
        let text = source.file();
        let start = text.floor_char_boundary(span.offset());
        let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        // Only the first line of a span over several lines is marked.
        let end = text.floor_char_boundary(span.offset().saturating_add(span.len()));
        self.span = Some((start..end.clamp(start, line_end)).into());
        let line = text[..start].matches('\n').count();
        let column = 1 + text[line_start..start].chars().count();
        let place = format!("{name}:{}:{column}", line + 1);
        let near = text.lines().skip(line.saturating_sub(1)).take(3);
        if near.map(str::len).all(|length| length <= MAX_LINE) {
            self.text = Some(Arc::new(NamedSource::new(&name, without_controls(text))));
        } else {
            let help = self.help.take().map(|help| format!("{help}; ")).unwrap_or_default();
            self.help = Some(format!("{help}at {place}").into());
        }
        *self.site = Site::Place(place.into());
    }

    /// Returns the first of several errors, with the next few as related errors; `Ok` if there are
    /// none.
    pub fn join(errors: impl IntoIterator<Item = SceneError>) -> Result<(), SceneError> {
        let mut errors = errors.into_iter();
        let Some(mut first) = errors.next() else {
            return Ok(());
        };
        first.related.extend(errors.take(MAX_ERRORS - 1));
        Err(first)
    }

    /// The message that says what is wrong.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The remedy, if there is one.
    pub fn remedy(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Byte range in the source text that the error points at.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.map(|s| s.offset()..s.offset() + s.len())
    }

    /// The other errors found at the same time.
    pub fn others(&self) -> &[SceneError] {
        &self.related
    }

    /// `file:line:column: message`, as far as they are known.
    pub fn headline(&self) -> String {
        let place = match &*self.site {
            Site::Place(place) => format!("{place}: "),
            Site::Key(_) | Site::Unknown | Site::Argument => String::new(),
        };
        format!("{place}{}", self.message).replace('\n', " ")
    }

    /// `file:line:column: message (help)`, without the related errors.
    pub fn one_line(&self) -> String {
        let help = self.help.as_deref().map_or(String::new(), |help| format!(" ({help})"));
        format!("{}{help}", self.headline()).replace('\n', " ")
    }

    /// This error and the related ones, one line each.
    pub fn lines(&self) -> Vec<String> {
        let related = self.related.iter().flat_map(SceneError::lines);
        std::iter::once(self.one_line()).chain(related).collect()
    }
}

/// The candidates that may be meant by a mistyped name: those that contain it or that it contains;
/// if there are none, the most similar one, if it is similar enough.
fn near<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    /// Shorter names are contained in too many others.
    const SHORTEST: usize = 3;
    if name.len() > 100 {
        return vec![];
    }
    let lower = name.to_lowercase();
    let candidates: Vec<(&str, String)> =
        candidates.into_iter().map(|c| (c, c.to_lowercase())).collect();
    let parts = candidates.iter().filter(|(_, c)| {
        lower.len().min(c.len()) >= SHORTEST && (c.contains(&lower) || lower.contains(c))
    });
    let parts: Vec<&str> = parts.map(|(c, _)| *c).collect();
    if !parts.is_empty() {
        return parts;
    }
    let like = candidates.iter().map(|(c, low)| (*c, strsim::jaro_winkler(&lower, low)));
    let best = like.filter(|(_, l)| *l > 0.78).max_by(|a, b| a.1.total_cmp(&b.1));
    best.into_iter().map(|(c, _)| c).collect()
}

/// The candidate that is most likely meant by a mistyped name; `None` if no candidate is similar
/// enough.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    near(name, candidates).into_iter().next()
}

/// The text `did you mean ...? <what>: ...`, as far as it applies.
pub(super) fn suggestion(name: &str, what: &str, candidates: &[&str]) -> String {
    let near: Vec<_> =
        near(name, candidates.iter().copied()).iter().take(4).map(|c| format!("`{c}`")).collect();
    let mut text = match near.as_slice() {
        [] => String::new(),
        [one] => format!("did you mean {one}? "),
        [first @ .., last] => format!("did you mean {} or {last}? ", first.join(", ")),
    };
    if candidates.is_empty() {
        text.push_str(&format!("{what}: none"));
    } else {
        let shown: Vec<_> = candidates.iter().take(24).map(|c| format!("`{c}`")).collect();
        let more = if shown.len() < candidates.len() { ", ..." } else { "" };
        text.push_str(&format!("{what}: {}{more}", shown.join(", ")));
    }
    text
}

/// The text with control characters masked, and shortened to at most [`MAX_MESSAGE`] bytes.
fn printable(text: &str) -> String {
    let shown = text.get(..text.floor_char_boundary(MAX_MESSAGE)).unwrap_or_default();
    let ellipsis = if shown.len() < text.len() { "..." } else { "" };
    without_controls(shown) + ellipsis
}

/// Replaces ASCII control characters byte by byte, so that a file cannot steer the terminal.
fn without_controls(text: &str) -> String {
    let mask = |c: char| c.is_ascii_control() && c != '\n' && c != '\t' && c != '\r';
    text.replace(mask, "?")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> SceneSource {
        SceneSource::new("s.toml", text)
    }

    fn draw(error: &SceneError) -> String {
        let mut out = String::new();
        let theme = miette::GraphicalTheme::unicode_nocolor();
        let handler = miette::GraphicalReportHandler::new_themed(theme);
        handler.render_report(&mut out, error).expect("writes to a string");
        out
    }

    #[test]
    fn shows_file_line_and_column() {
        let error = SceneError::at(&(7..8), "bad value", "use 3").with_source(&source("a=1\nbé=2"));
        assert_eq!(error.one_line(), "s.toml:2:3: bad value (use 3)");
        let drawn = draw(&error);
        assert!(drawn.contains("s.toml:2:") && drawn.contains("bé=2"), "{drawn}");
        assert!(drawn.contains("use 3"), "{drawn}");
    }

    #[test]
    fn survives_spans_that_do_not_fit() {
        for span in [3..90, 90..95, 1..2, 0..0, usize::MAX - 1..usize::MAX] {
            let error = SceneError::at(&span, "bad", "").with_source(&source("é"));
            draw(&error);
            assert!(error.one_line().starts_with("s.toml:1:"), "{}", error.one_line());
        }
    }

    #[test]
    fn joins_errors() {
        assert!(SceneError::join([]).is_ok());
        let both = [SceneError::at(&(0..1), "one", ""), SceneError::at(&(4..5), "two", "")];
        let error = SceneError::join(both).expect_err("two").with_source(&source("a=1\nb=2"));
        assert_eq!(error.lines(), ["s.toml:1:1: one", "s.toml:2:1: two"]);
        assert!(draw(&error).contains("s.toml:2:1"));
    }

    #[test]
    fn masks_and_cuts_hostile_text() {
        let text = "\u{1b}[2J".repeat(1000);
        let error = SceneError::at(&(0..4), &text, "").with_source(&source(&text));
        assert!(!draw(&error).contains('\u{1b}'));
        assert!(draw(&error).len() < 2000);
        assert!(draw(&error).contains("s.toml:1:1"));
    }

    #[test]
    fn finds_the_closest_name() {
        let names = ["density", "shear_viscosity", "colour"];
        assert_eq!(closest("dnsity", names), Some("density"));
        assert_eq!(closest("Colour", names), Some("colour"));
        assert_eq!(closest("zzz", names), None);
        let keys = ["density", "shear_viscosity", "bulk_viscosity", "layer_viscosity"];
        let said = suggestion("viscosity", "keys are", &keys);
        let meant =
            "did you mean `shear_viscosity`, `bulk_viscosity` or `layer_viscosity`? keys are";
        assert!(said.starts_with(meant), "{said}");
        assert!(suggestion("bulk_viscosity_1", "", &keys).starts_with("did you mean `bulk_visco"));
    }
}
