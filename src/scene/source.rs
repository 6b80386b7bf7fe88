//! This module holds the text of a scene and says where each part of it comes from.

use std::ops::Range;
use std::sync::Arc;

/// The text of a scene and the name of its source; cheap to clone.
///
/// Two sources are equal if they have the same name and text.
#[derive(Clone, Debug)]
pub struct SceneSource {
    name: Arc<str>,
    text: Arc<str>,
    /// The text without what `--set` has changed.
    file: Arc<str>,
    sets: Arc<[Set]>,
}

/// A `--set` argument and what it has changed.
#[derive(Clone, Debug)]
struct Set {
    argument: String,
    /// Key and value in the text after this argument.
    value: Option<Range<usize>>,
    /// The lines that differ, before and after this argument.
    lines: [Range<usize>; 2],
}

/// Where a part of a text comes from.
#[derive(Debug, PartialEq)]
pub(super) enum Origin<'a> {
    /// A byte range of the file.
    File(Range<usize>),
    /// This `--set` argument.
    Set(&'a str),
}

impl PartialEq for SceneSource {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.text == other.text
    }
}

impl Eq for SceneSource {}

impl SceneSource {
    /// A source with the given name and text.
    pub fn new(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Self {
        let text = text.into();
        SceneSource { name: name.into(), file: text.clone(), text, sets: Arc::new([]) }
    }

    /// The path of the file, or the name of the preset.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The TOML text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The TOML text without what `--set` has changed.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The source after a `--set` argument; `value` is the range of its key and value in the new
    /// text.
    pub(super) fn after_set(
        &self,
        argument: &str,
        text: String,
        value: Option<Range<usize>>,
    ) -> SceneSource {
        let lines = different_lines(&self.text, &text);
        let set = Set { argument: argument.into(), value, lines };
        let sets = self.sets.iter().cloned().chain([set]).collect();
        SceneSource { text: text.into(), sets, ..self.clone() }
    }

    /// Where a byte range of the text comes from.
    pub(super) fn origin(&self, mut span: Range<usize>) -> Origin<'_> {
        for set in self.sets.iter().rev() {
            let [before, after] = &set.lines;
            let meets =
                |r: &Range<usize>| span.start < r.end && r.start < span.end.max(span.start + 1);
            let is_new = before.is_empty() && after.contains(&span.start);
            if is_new || set.value.as_ref().is_some_and(meets) {
                return Origin::Set(&set.argument);
            }
            let moved = |at: usize| match at {
                _ if at >= after.end => at - after.end + before.end,
                _ => at.min(before.end.max(after.start)),
            };
            span = moved(span.start)..moved(span.end);
        }
        Origin::File(span)
    }
}

/// Byte ranges of the lines in which two texts differ.
fn different_lines(before: &str, after: &str) -> [Range<usize>; 2] {
    let pairs = before.split_inclusive('\n').zip(after.split_inclusive('\n'));
    let start: usize = pairs.take_while(|(a, b)| a == b).map(|(a, _)| a.len()).sum();
    let [a, b] = [&before[start..], &after[start..]];
    let pairs = a.split_inclusive('\n').rev().zip(b.split_inclusive('\n').rev());
    let end: usize = pairs.take_while(|(a, b)| a == b).map(|(a, _)| a.len()).sum();
    [start..before.len() - end, start..after.len() - end]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_from_the_file_or_from_an_argument() {
        let source = SceneSource::new("s.toml", "name = 1\ngravity = 2\nmesh = 3\n");
        let sets = ["gravity=[20]".to_string(), "time.end=4".into()];
        let source = source.with_sets(&sets).expect("valid");
        let at = |part: &str| {
            let start = source.text().find(part).expect("in the text");
            source.origin(start..start + part.len())
        };
        assert_eq!(at("name = 1"), Origin::File(0..8));
        assert_eq!(at("20"), Origin::Set("gravity=[20]"));
        assert_eq!(at("gravity = "), Origin::Set("gravity=[20]"));
        assert_eq!(at("3"), Origin::File(28..29));
        assert_eq!(at("[time]"), Origin::Set("time.end=4"));
        assert_eq!(at("4"), Origin::Set("time.end=4"));
        assert_eq!(source.file(), "name = 1\ngravity = 2\nmesh = 3\n");
    }
}
