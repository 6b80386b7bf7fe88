//! This module runs sweeps: many runs (cases) of one scene with varied parameters.
//!
//! A case is a fully resolved scene; its id is the hash of that scene. Each case is an ordinary run
//! folder. It is written in a temporary place and moved to its final place when finished, so a
//! folder there is always complete. Whether a case is done is decided from the folders alone: the
//! engine, the machine and the number of attempts may differ between two starts of a sweep.

pub mod collect;
mod hq;
mod list;
mod local;
mod spec;
mod store;
mod vary;

pub use hq::HyperQueue;
pub use list::{Case, List};
pub use local::{Limits, Local};
pub use spec::{PlotSpec, Spec, preset_list, preset_source, read_file, similar};
pub use store::{State, Store};
pub use vary::Sample;

use crate::record::replace::ReplaceError;
use crate::scene::SceneError;
use crate::simd::{self, Simd};
use indexmap::IndexMap;
use std::path::PathBuf;

/// Error that stops a sweep. The failure of a case is not such an error.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The arguments are not valid.
    #[error("{0}")]
    Usage(String),
    /// A file operation failed.
    #[error("cannot {what} {}: {source}", path.display())]
    File {
        /// The operation, such as `write`.
        what: &'static str,
        /// Path of the file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content of a file is not valid.
    #[error("{}: {cause}", path.display())]
    Broken {
        /// Path of the file.
        path: PathBuf,
        /// Description of the error.
        cause: String,
    },
    /// A file is in the way.
    #[error(transparent)]
    Replace(#[from] ReplaceError),
    /// The engine failed.
    #[error("{0}")]
    Engine(String),
}

impl SweepError {
    fn file<'a>(
        what: &'static str,
        path: &'a std::path::Path,
    ) -> impl FnOnce(std::io::Error) -> SweepError + 'a {
        move |source| SweepError::File { what, path: path.to_owned(), source }
    }
}

/// Progress message of an engine.
#[derive(Clone, Debug, PartialEq)]
pub enum Event<'a> {
    /// A case has started.
    Started(&'a Case),
    /// A case has ended, with this state.
    Ended(&'a Case, State),
    /// Overall progress.
    Progress {
        /// Completed fraction of all cases, 0 to 1.
        share: f64,
        /// Number of cases that are running.
        running: usize,
    },
}

/// Input of an engine.
pub struct Work<'a> {
    /// Folder of the sweep.
    pub store: &'a Store,
    /// Cases to be run.
    pub cases: Vec<&'a Case>,
    /// Set from outside to stop the sweep.
    pub interrupted: &'a std::sync::atomic::AtomicBool,
    /// Receiver of progress messages.
    pub watch: &'a mut dyn FnMut(Event),
}

impl Work<'_> {
    fn is_interrupted(&self) -> bool {
        self.interrupted.load(std::sync::atomic::Ordering::SeqCst)
    }
}

/// An engine that runs cases. The state of the cases is in the store.
pub trait Engine {
    /// Runs all cases of `work`. Returns when all have ended or the sweep was interrupted.
    fn run(&self, work: &mut Work) -> Result<(), SweepError>;
}

/// Environment variables of the process of a case: the number of threads, and the instruction set
/// if it is limited in this process.
fn environment(threads: usize) -> IndexMap<&'static str, String> {
    let threads = Some(("RAYON_NUM_THREADS", threads.to_string()));
    let set = Simd::limited().map(|set| (simd::VARIABLE, set.name().to_owned()));
    threads.into_iter().chain(set).collect()
}
