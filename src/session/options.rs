//! This module holds the options of a session: its output, its guard, and when it stops.

use crate::record::rerun_log::Sink;
use crate::sim::guard::Policy;
use crate::sim::state::{State, StateError};
use std::path::PathBuf;

/// Options for checkpoints and for steps that fail.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub struct Safety {
    /// Write a checkpoint every STEPS steps, for `grainscope resume`; the last two are kept
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u64).range(1..))]
    pub checkpoint_every: Option<u64>,
    /// What to do when a step fails [default: cut-dt]
    #[arg(long, value_name = "POLICY", value_enum)]
    pub on_fault: Option<OnFault>,
}

/// What to do when a step fails.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnFault {
    /// End the run at its last good state
    Stop,
    /// Repeat the step a few times with a shorter time step; then end the run
    CutDt,
    /// As cut-dt, but continue with a note if the state is inaccurate rather than impossible
    Continue,
}

impl Safety {
    /// The policy for steps that fail.
    pub fn policy(&self) -> Policy {
        match self.on_fault {
            None | Some(OnFault::CutDt) => Policy::CutStep,
            Some(OnFault::Stop) => Policy::Stop,
            Some(OnFault::Continue) => Policy::Continue,
        }
    }

    /// These options; options that are not given are taken from `before`.
    pub fn or(self, before: Safety) -> Safety {
        Safety {
            checkpoint_every: self.checkpoint_every.or(before.checkpoint_every),
            on_fault: self.on_fault.or(before.on_fault),
        }
    }

    /// Saves the options in a checkpoint's state.
    pub fn save(&self, state: &mut State) {
        let policy = match self.on_fault {
            None => 0,
            Some(OnFault::Stop) => 1,
            Some(OnFault::CutDt) => 2,
            Some(OnFault::Continue) => 3,
        };
        state.put_counts("session.safety", [self.checkpoint_every.unwrap_or(0), policy]);
    }

    /// Loads the options from a checkpoint's state.
    ///
    /// # Errors
    /// The state does not contain them.
    pub fn load(state: &State) -> Result<Safety, StateError> {
        let [every, policy] = state.tally("session.safety")?;
        let on_fault = match policy {
            1 => Some(OnFault::Stop),
            2 => Some(OnFault::CutDt),
            3 => Some(OnFault::Continue),
            _ => None,
        };
        Ok(Safety { checkpoint_every: (every > 0).then_some(every), on_fault })
    }
}

/// The file of a recording; viewers are separate options.
#[derive(Clone, Debug, Default)]
pub enum Recording {
    /// No recording.
    None,
    /// `recording.rrd` in the folder of the run.
    #[default]
    Folder,
    /// Another file.
    File(PathBuf),
}

/// Options of a session.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The file of the recording.
    pub recording: Recording,
    /// Viewers that receive the frames.
    pub viewers: Vec<Sink>,
    /// Checkpoints and the policy for failed steps.
    pub safety: Safety,
    /// Largest number of steps, counted from the start of the run.
    pub steps: Option<u64>,
    /// Whether to print no messages; messages of several concurrent runs would mix.
    pub quiet: bool,
}
