//! What is wrong with a scene or a run, as the page shows it.

use crate::scene::{SceneError, SceneSource};
use crate::sim::SimError;
use serde::Serialize;

/// A fault with the lines it points at.
#[derive(Clone, Debug, Serialize)]
pub struct Problem {
    pub title: String,
    pub faults: Vec<Fault>,
    /// The scene of the library that it is about, to try it again.
    pub scene: Option<String>,
}

/// One thing that is wrong.
#[derive(Clone, Debug, Serialize)]
pub struct Fault {
    /// With file, line and column where they are known.
    pub message: String,
    pub remedy: Option<String>,
    /// Number and text of the line.
    pub line: Option<(usize, String)>,
}

/// Longest line that is shown.
const MAX_LINE: usize = 200;

impl Problem {
    /// Of a scene that cannot be run.
    pub fn of_scene(name: &str, error: &SceneError, source: &SceneSource) -> Problem {
        let error = error.clone().with_source(source);
        let all = std::iter::once(&error).chain(error.others());
        let faults = all.map(|e| Fault {
            message: e.headline(),
            remedy: e.remedy().map(String::from),
            line: e.span().and_then(|span| line_at(source.text(), span.start)),
        });
        Problem { title: format!("{name} cannot be run"), faults: faults.collect(), scene: None }
    }

    /// Of a run that cannot start or go on.
    pub fn of_run(error: &SimError) -> Problem {
        let fault =
            Fault { message: error.to_string(), remedy: Some(error.remedy().into()), line: None };
        Problem { title: "The run cannot go on".into(), faults: vec![fault], scene: None }
    }

    /// Of anything else.
    pub fn of_machine(message: String) -> Problem {
        let fault = Fault { message, remedy: None, line: None };
        Problem {
            title: "Something outside of the run is in the way".into(),
            faults: vec![fault],
            scene: None,
        }
    }
}

/// Number and text of the line that a byte lies in.
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
