//! This module holds the errors of a session.

use crate::record::plots::PlotError;
use crate::record::rerun_log::RecordError;
use crate::sim::SimError;

/// The reason why a session failed or was interrupted.
#[derive(Debug)]
pub enum SessionError {
    /// The simulation failed.
    Sim(SimError),
    /// A file, port, viewer or thread is not available.
    Environment(String),
    /// The user interrupted the run.
    Interrupted,
}

impl SessionError {
    /// The error in one line with its remedy, for the summary; `None` for an interrupt.
    pub fn describe(&self) -> Option<String> {
        match self {
            SessionError::Sim(e) => Some(format!("{e}; {}", e.remedy())),
            SessionError::Environment(text) => Some(text.clone()),
            SessionError::Interrupted => None,
        }
    }
}

impl From<SimError> for SessionError {
    fn from(e: SimError) -> Self {
        SessionError::Sim(e)
    }
}
impl From<RecordError> for SessionError {
    fn from(e: RecordError) -> Self {
        SessionError::Environment(e.to_string())
    }
}
impl From<PlotError> for SessionError {
    fn from(e: PlotError) -> Self {
        SessionError::Environment(e.to_string())
    }
}
