//! From one run to a thousand: cases with names that last, and engines that run what is missing.
//!
//! A case is a scene with everything resolved; its id is the hash of that scene. Every case is an
//! ordinary run folder, made beside its place and moved there when it is finished, so what is there
//! is whole. Whether a case is done is read from the folders alone: engines, machines and tries may
//! change between two starts of a sweep.

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
pub use store::{Attempt, State, Store};
pub use vary::{Sample, values_of};

use crate::scene::SceneError;
use crate::simd::{self, Simd};
use indexmap::IndexMap;
use std::path::PathBuf;

/// Why a sweep cannot go on; a case that fails is none of these.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{0}")]
    Usage(String),
    #[error("cannot {what} {}: {source}", path.display())]
    File { what: &'static str, path: PathBuf, source: std::io::Error },
    #[error("{}: {cause}", path.display())]
    Broken { path: PathBuf, cause: String },
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

/// What an engine tells while it works.
#[derive(Clone, Debug, PartialEq)]
pub enum Event<'a> {
    /// A case has started.
    Started(&'a Case),
    /// A case has ended, one way or the other.
    Ended(&'a Case, State),
    /// Share of everything that was asked for, and cases that run now.
    Progress { share: f64, running: usize },
}

/// What an engine runs cases with.
pub struct Work<'a> {
    pub store: &'a Store,
    /// What is to be run.
    pub cases: Vec<&'a Case>,
    /// Set from outside when everything is to end.
    pub interrupted: &'a std::sync::atomic::AtomicBool,
    pub watch: &'a mut dyn FnMut(Event),
}

impl Work<'_> {
    fn is_interrupted(&self) -> bool {
        self.interrupted.load(std::sync::atomic::Ordering::SeqCst)
    }
}

/// Something that runs cases. What has become of them is in the store.
pub trait Engine {
    fn run(&self, work: &mut Work) -> Result<(), SweepError>;
}

/// What a case's program is told by its environment: the threads that it may take, and the instruction
/// set if ours is limited.
fn environment(threads: usize) -> IndexMap<&'static str, String> {
    let threads = Some(("RAYON_NUM_THREADS", threads.to_string()));
    let set = Simd::limited().map(|set| (simd::VARIABLE, set.name().to_owned()));
    threads.into_iter().chain(set).collect()
}
