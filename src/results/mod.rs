//! This module reads the results of runs from their folders, recordings or summaries, for
//! comparisons, exports and figures.

mod member;
mod summary;
pub mod table;

pub use member::{Kind, Member, open_all, open_each};

use crate::record::folder::FILES;
use crate::record::rerun_log::ReadError;
use crate::scene::SceneError;
use std::path::PathBuf;

/// Error of reading runs back.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The path does not exist.
    #[error("{}: there is no such file or folder; give a run's folder, a recording (.rrd) or a summary.json", .0.display())]
    Missing(PathBuf),
    /// The folder contains no run.
    #[error("{}: holds no run; expected {} in it", .0.display(), FILES[..4].join(", "))]
    NoRun(PathBuf),
    /// The file is neither a recording nor a summary.
    #[error("{}: is neither a recording (.rrd) nor a summary (.json)", .0.display())]
    Unknown(PathBuf),
    /// The content of a file is not valid.
    #[error("{}: {cause}", path.display())]
    Broken {
        /// Path of the file.
        path: PathBuf,
        /// Description of the error.
        cause: String,
    },
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] ReadError),
    /// The scene of the run is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The arguments are not valid.
    #[error("{0}")]
    Usage(String),
}

/// Relative difference up to which two times count as equal.
pub const SAME_TIME: f64 = 1e-9;

/// Whether time `a` is later than time `b` by more than rounding errors.
pub fn later(a: f64, b: f64) -> bool {
    a > b + SAME_TIME * a.abs()
}
