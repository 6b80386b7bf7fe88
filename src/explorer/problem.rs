//! This module describes errors of scenes and runs for the page.

use crate::scene::{SceneError, SceneSource};
use crate::sim::SimError;
use serde::Serialize;

/// An error shown on the page.
#[derive(Clone, Debug, Serialize)]
pub struct Problem {
    /// Heading.
    pub title: String,
    /// The individual errors.
    pub faults: Vec<Fault>,
    /// Id of the scene in the library, with which the page can load it again.
    pub scene: Option<String>,
}

/// One error.
#[derive(Clone, Debug, Serialize)]
pub struct Fault {
    /// Message, with file, line and column where they are known.
    pub message: String,
    /// What to do about the error.
    pub remedy: Option<String>,
    /// Number (from 1) and text of the line.
    pub line: Option<(usize, String)>,
}

/// Maximum length of a shown line (characters).
const MAX_LINE: usize = 200;

impl Problem {
    /// The errors of a scene.
    pub fn of_scene(name: &str, error: &SceneError, source: &SceneSource) -> Problem {
        let error = error.clone().with_source(source);
        let all = std::iter::once(&error).chain(error.others());
        let faults = all.map(|e| Fault {
            message: e.headline(),
            remedy: e.remedy().map(String::from),
            line: e.span().and_then(|span| line_at(source.file(), span.start)),
        });
        Problem { title: format!("{name} cannot be run"), faults: faults.collect(), scene: None }
    }

    /// The error of a run that cannot start or continue.
    pub fn of_run(error: &SimError) -> Problem {
        let fault =
            Fault { message: error.to_string(), remedy: Some(error.remedy().into()), line: None };
        Problem { title: "The run cannot continue".into(), faults: vec![fault], scene: None }
    }

    /// An error outside the run, such as a failed recording.
    pub fn of_machine(message: String) -> Problem {
        let fault = Fault { message, remedy: None, line: None };
        Problem { title: "An error outside the run".into(), faults: vec![fault], scene: None }
    }
}

/// Number (from 1) and text of the line that contains a byte.
fn line_at(text: &str, byte: usize) -> Option<(usize, String)> {
    let before = text.get(..byte)?;
    let number = before.matches('\n').count();
    let line = text.lines().nth(number)?;
    Some((number + 1, line.chars().filter(|c| !c.is_control()).take(MAX_LINE).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found() {
        assert_eq!(line_at("a\nbc\nd", 3), Some((2, "bc".into())));
        assert_eq!(line_at("a\nbc\nd", 0), Some((1, "a".into())));
        assert_eq!(line_at("a", 9), None);
    }
}
