//! What pages and the session say to each other, as JSON.

use serde::{Deserialize, Serialize};

/// What a page asks for.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Command {
    Run {},
    Pause {},
    /// Take one step and stand.
    Step {},
    /// From the beginning, with the knobs as they stand.
    Restart {},
    /// End the run; what it brought stays.
    Stop {},
    /// Set a parameter (`alpha`) or any other key of the scene (`accuracy.cells`).
    Set {
        key: String,
        value: String,
    },
    /// What setting it would do.
    Ask {
        key: String,
        value: String,
    },
    /// Open a scene of the library, by its name there.
    Load {
        scene: String,
    },
    /// Keep the run as it is, to be shown beside others.
    Pin {
        name: String,
    },
    Unpin {
        name: String,
    },
    /// Write recording, scene, table and plots into a folder.
    Save {
        name: String,
    },
    /// End the program.
    Quit {},
}

/// What becomes of a command.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Answer {
    pub accepted: bool,
    pub message: String,
    /// What to do about a refusal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<String>,
    /// Whether the run starts again because of it.
    pub restarts: bool,
}

impl Answer {
    pub fn yes(message: impl Into<String>) -> Answer {
        Answer { accepted: true, message: message.into(), remedy: None, restarts: false }
    }

    pub fn no(message: impl Into<String>, remedy: impl Into<String>) -> Answer {
        let remedy = Some(remedy.into()).filter(|r: &String| !r.is_empty());
        Answer { accepted: false, message: message.into(), remedy, restarts: false }
    }

    pub fn restarting(self) -> Answer {
        Answer { restarts: true, ..self }
    }
}

/// What the run does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// There is no run: the scene has errors.
    Empty,
    Running,
    Paused,
    /// Ended by the user.
    Stopped,
    /// The scene's end is reached.
    Finished,
    Failed,
}

impl Mode {
    /// Whether steps can still be taken.
    pub fn goes_on(self) -> bool {
        matches!(self, Mode::Running | Mode::Paused)
    }
}

/// Everything a page shows, but for curves and pictures.
#[derive(Clone, Debug, Serialize)]
pub struct State<'a> {
    pub mode: Mode,
    pub scene: &'a str,
    pub title: &'a str,
    pub description: &'a str,
    pub problem: Option<&'a super::problem::Problem>,
    pub run: Option<RunState>,
    pub knobs: &'a [super::knobs::Knob],
    pub switches: Vec<SwitchState>,
    pub dial: Vec<DialState>,
    pub effects: &'a [crate::plan::Effect],
    pub warnings: Vec<String>,
    pub pins: Vec<PinState>,
    pub saved: Vec<SavedState>,
    pub scenes: &'a [super::library::Entry],
    pub folder: String,
    pub out: String,
    /// Where the viewer finds the recording.
    pub stream: Option<Stream>,
    /// What happened last, told once to every page.
    pub news: Option<News>,
}

/// The recording that the viewer shows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stream {
    pub url: String,
    pub recording: String,
}

#[derive(Clone, Debug, Serialize)]
pub struct News {
    pub number: u64,
    pub good: bool,
    pub text: String,
}

/// Numbers of the run.
#[derive(Clone, Debug, Serialize)]
pub struct RunState {
    /// Of its curves.
    pub id: u64,
    /// Points that its curves have.
    pub points: usize,
    pub step: u64,
    /// s
    pub time: f64,
    pub end: f64,
    pub dt: f64,
    pub limiter: &'static str,
    pub limited_by: &'static str,
    pub steps_per_second: Option<f64>,
    pub seconds_per_step: f64,
    pub particles: usize,
    pub cells: [usize; 2],
    pub unknowns: usize,
    pub lights: Vec<Light>,
    pub readings: Vec<Reading>,
    /// Seconds of a step by phase, a mean over the last steps.
    pub phases: Vec<(&'static str, f64)>,
    /// Changes while it went on.
    pub changes: Vec<Change>,
}

/// A number that must stay within a bound.
#[derive(Clone, Debug, Serialize)]
pub struct Light {
    pub name: &'static str,
    pub value: f64,
    pub bound: f64,
    pub good: bool,
    /// What it says.
    pub meaning: &'static str,
}

/// A number that is read off.
#[derive(Clone, Debug, Serialize)]
pub struct Reading {
    pub name: String,
    pub value: f64,
    pub unit: &'static str,
}

/// A change that took, or will take, effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    pub step: u64,
    /// s
    pub time: Option<f64>,
    pub label: String,
}

/// An effect that a parameter switches on and off.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchState {
    pub effect: &'static str,
    pub key: String,
    pub on: bool,
    /// Value that turns it over.
    pub other: String,
    pub cost: String,
}

/// A stop of the accuracy dial.
#[derive(Clone, Debug, Serialize)]
pub struct DialState {
    pub cells: u32,
    pub current: bool,
    pub unknowns: usize,
    pub seconds_per_step: Option<f64>,
    /// From the price list, relative.
    pub error: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
pub struct PinState {
    pub name: String,
    pub id: u64,
    pub points: usize,
    pub steps: u64,
    pub time: f64,
    /// What its knobs said, where they differ from the scene's defaults.
    pub values: String,
}

#[derive(Clone, Debug, Serialize)]
pub struct SavedState {
    pub name: String,
    pub steps: u64,
    pub state_hash: String,
    /// Repeats the run.
    pub command: String,
    /// Names and bytes.
    pub files: Vec<(String, u64)>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_and_others_refused() {
        let read = |text: &str| serde_json::from_str::<Command>(text);
        assert_eq!(read(r#"{"do":"run"}"#).expect("known"), Command::Run {});
        assert_eq!(
            read(r#"{"do":"set","key":"alpha","value":"5/3"}"#).expect("known"),
            Command::Set { key: "alpha".into(), value: "5/3".into() }
        );
        for text in [
            r#"{"do":"fly"}"#,
            r#"{"do":"set","key":"alpha"}"#,
            r#"{"do":"run","path":"/etc/passwd"}"#,
            r#"{"do":"load","scene":["a"]}"#,
            "[]",
            "",
        ] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
