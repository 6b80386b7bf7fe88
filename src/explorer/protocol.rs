//! This module defines the JSON messages between pages and the session.

use serde::{Deserialize, Serialize};

/// Command of a page.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Command {
    /// Continue a paused run, or start an ended one again.
    Run {},
    /// Pause the run.
    Pause {},
    /// Take one step and pause.
    Step {},
    /// Start again from the beginning, with the present values.
    Restart {},
    /// End the run and keep its results.
    Stop {},
    /// Set a parameter (`alpha`) or any other key of the scene (`accuracy.cells`).
    Set {
        /// Key in the scene.
        key: String,
        /// Number or expression.
        value: String,
    },
    /// Ask for the effect of setting a key, without setting it.
    Ask {
        /// Key in the scene.
        key: String,
        /// Number or expression.
        value: String,
    },
    /// Open a scene of the library.
    Load {
        /// Id of the scene in the library.
        scene: String,
    },
    /// Read the folder of scenes again.
    List {},
    /// Run a text as a scene. What the page has set before is forgotten.
    Try {
        /// Name of the scene's file, for messages.
        name: String,
        /// The text.
        text: String,
    },
    /// Keep a copy of the run, to be shown beside others.
    Pin {
        /// Name of the pinned run.
        name: String,
    },
    /// Remove a pinned run.
    Unpin {
        /// Name of the pinned run.
        name: String,
    },
    /// Write recording, scene, table and plots into a folder.
    Save {
        /// Name of the folder.
        name: String,
    },
    /// End the program.
    Quit {},
}

/// Answer to a command.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Answer {
    /// Whether the command was accepted.
    pub accepted: bool,
    /// Effect of the command, or reason of the refusal.
    pub message: String,
    /// What to do about a refusal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remedy: Option<String>,
    /// Whether the command restarts the run.
    pub restarts: bool,
}

impl Answer {
    /// An acceptance.
    pub fn yes(message: impl Into<String>) -> Answer {
        Answer { accepted: true, message: message.into(), remedy: None, restarts: false }
    }

    /// A refusal. An empty `remedy` is left out.
    pub fn no(message: impl Into<String>, remedy: impl Into<String>) -> Answer {
        let remedy = Some(remedy.into()).filter(|r: &String| !r.is_empty());
        Answer { accepted: false, message: message.into(), remedy, restarts: false }
    }

    /// The answer of a command that restarts the run.
    pub fn restarting(self) -> Answer {
        Answer { restarts: true, ..self }
    }
}

/// State of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// There is no run: the scene has errors.
    Empty,
    /// Steps are being taken.
    Running,
    /// No steps are taken until the user continues the run.
    Paused,
    /// Ended by the user.
    Stopped,
    /// The end time of the scene is reached.
    Finished,
    /// A step failed.
    Failed,
}

impl Mode {
    /// Whether further steps can be taken.
    pub fn goes_on(self) -> bool {
        matches!(self, Mode::Running | Mode::Paused)
    }
}

/// Everything that a page shows, except curves and pictures.
#[derive(Clone, Debug, Serialize)]
pub struct State<'a> {
    /// State of the run.
    pub mode: Mode,
    /// Id of the scene in the library, or of the edited text: `text:<name>`.
    pub scene: &'a str,
    /// Name of the scene.
    pub title: &'a str,
    /// Description of the scene.
    pub description: &'a str,
    /// Errors of the scene, the run or the recording.
    pub problem: Option<&'a super::problem::Problem>,
    /// Diagnostics of the run; `None` if there is no run.
    pub run: Option<RunState>,
    /// Numbers of the scene that can be set.
    pub knobs: &'a [super::knobs::Knob],
    /// Effects that can be switched on and off.
    pub switches: Vec<SwitchState>,
    /// Positions of the accuracy dial.
    pub dial: Vec<DialState>,
    /// All effects, and why they are solved or not.
    pub effects: &'a [crate::plan::Effect],
    /// Warnings of the plan and the run.
    pub warnings: Vec<String>,
    /// Pinned runs.
    pub pins: Vec<PinState>,
    /// Saved runs, newest first.
    pub saved: Vec<SavedState>,
    /// Scenes of the library.
    pub scenes: &'a [super::library::Entry],
    /// Folder of the scenes.
    pub folder: String,
    /// Folder for saved runs.
    pub out: String,
    /// Whether this program contains the Rerun viewer.
    pub viewer: bool,
    /// The recording that the viewer shows.
    pub stream: Option<Stream>,
    /// The latest event, which each page shows once.
    pub news: Option<News>,
}

/// The recording that the viewer shows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stream {
    /// Address of the data.
    pub url: String,
    /// Identifier of the recording.
    pub recording: String,
}

/// An event shown as a notification.
#[derive(Clone, Debug, Serialize)]
pub struct News {
    /// Number of the event, from 1.
    pub number: u64,
    /// Whether it is a success.
    pub good: bool,
    /// Text of the notification.
    pub text: String,
}

/// Diagnostics of the run.
#[derive(Clone, Debug, Serialize)]
pub struct RunState {
    /// Number of the run, which identifies its curves.
    pub id: u64,
    /// Number of points of its curves.
    pub points: usize,
    /// Number of the present step.
    pub step: u64,
    /// Number of frames that have a picture, and step and time (s) of the last one.
    pub pictures: (usize, u64, f64),
    /// Simulated time (s).
    pub time: f64,
    /// End time of the scene (s).
    pub end: f64,
    /// Length of the last step (s).
    pub dt: f64,
    /// Short name of the criterion that limited the step.
    pub limiter: &'static str,
    /// Description of the criterion that limited the step.
    pub limited_by: &'static str,
    /// Steps per second of the last steps; `None` if unknown.
    pub steps_per_second: Option<f64>,
    /// Median computing time of the last steps (s).
    pub seconds_per_step: f64,
    /// Number of particles.
    pub particles: usize,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Whether the flow is round: volumes are in m3, powers in W.
    pub round: bool,
    /// Number of unknowns: velocity, rotation and pressure.
    pub unknowns: usize,
    /// Diagnostics with bounds.
    pub lights: Vec<Light>,
    /// Results without bounds.
    pub readings: Vec<Reading>,
    /// Fraction of the time of a step by phase, a mean over the last steps.
    pub phases: Vec<(&'static str, f64)>,
    /// Changes of the scene during the run.
    pub changes: Vec<Change>,
}

/// A diagnostic that must stay within a bound.
#[derive(Clone, Debug, Serialize)]
pub struct Light {
    /// Name of the diagnostic.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its upper bound.
    pub bound: f64,
    /// Whether the value is within the bound.
    pub good: bool,
    /// Definition of the diagnostic.
    pub meaning: &'static str,
}

/// A result of the run.
#[derive(Clone, Debug, Serialize)]
pub struct Reading {
    /// Name of the quantity.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit; empty for pure numbers.
    pub unit: &'static str,
}

/// A change of the scene that has taken effect or will.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Step with which it takes effect.
    pub step: u64,
    /// Time at which it took effect (s); `None` before.
    pub time: Option<f64>,
    /// Description of the change.
    pub label: String,
}

/// An effect that a parameter switches on and off.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchState {
    /// Name of the effect.
    pub effect: &'static str,
    /// Key of the parameter.
    pub key: String,
    /// Whether the effect is solved.
    pub on: bool,
    /// Value of the parameter that switches the effect.
    pub other: String,
    /// Computing time of the effect, in words.
    pub cost: String,
}

/// A position of the accuracy dial.
#[derive(Clone, Debug, Serialize)]
pub struct DialState {
    /// Value of `accuracy.cells`.
    pub cells: u32,
    /// Whether it is the present position.
    pub current: bool,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Computing time per step (s), measured or estimated; `None` if unknown.
    pub seconds_per_step: Option<f64>,
    /// Relative error from the cost table of the scene; `None` if there is none.
    pub error: Option<f64>,
}

/// A pinned run.
#[derive(Clone, Debug, Serialize)]
pub struct PinState {
    /// Name of the pinned run.
    pub name: String,
    /// Number that identifies its curves.
    pub id: u64,
    /// Number of points of its curves.
    pub points: usize,
    /// Number of steps.
    pub steps: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Values set on the page.
    pub values: String,
}

/// A saved run.
#[derive(Clone, Debug, Serialize)]
pub struct SavedState {
    /// Name of the folder.
    pub name: String,
    /// Number of steps.
    pub steps: u64,
    /// SHA-256 of the final state, hexadecimal.
    pub state_hash: String,
    /// Command that repeats the run.
    pub command: String,
    /// Names and sizes (bytes) of the files.
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
