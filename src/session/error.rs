//! This module holds the errors of a session.

use crate::record::checkpoint::CheckpointError;
use crate::record::folder::FolderError;
use crate::record::plots::PlotError;
use crate::record::rerun_log::RecordError;
use crate::record::series::TableError;
use crate::sim::SimError;

/// The reason why a session failed or was interrupted.
#[derive(Debug)]
pub enum SessionError {
    /// The simulation failed.
    Sim(SimError),
    /// A file, port, viewer or thread is not available.
    Environment(String),
    /// A checkpoint cannot be continued; an older one perhaps can.
    Unfit(String),
    /// The user interrupted the run.
    Interrupted,
}

impl SessionError {
    /// The error in one line with its remedy, for the summary; `None` for an interrupt.
    pub fn describe(&self) -> Option<String> {
        match self {
            SessionError::Sim(e) => Some(format!("{e}; {}", e.remedy())),
            SessionError::Environment(text) | SessionError::Unfit(text) => Some(text.clone()),
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
impl From<FolderError> for SessionError {
    fn from(e: FolderError) -> Self {
        SessionError::Environment(e.to_string())
    }
}
impl From<TableError> for SessionError {
    fn from(e: TableError) -> Self {
        match e {
            // Rows that are missing or damaged may come after an older checkpoint.
            TableError::Short { .. } | TableError::Row { .. } => SessionError::Unfit(e.to_string()),
            TableError::File { .. } => SessionError::Environment(e.to_string()),
        }
    }
}
impl From<CheckpointError> for SessionError {
    fn from(e: CheckpointError) -> Self {
        match e {
            CheckpointError::Refused { .. } => SessionError::Unfit(e.to_string()),
            CheckpointError::Read { .. } | CheckpointError::Write { .. } => {
                SessionError::Environment(e.to_string())
            }
        }
    }
}
impl From<PlotError> for SessionError {
    fn from(e: PlotError) -> Self {
        SessionError::Environment(e.to_string())
    }
}
