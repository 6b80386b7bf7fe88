//! Measures the accuracy and the CPU time of a scene for many settings: a cost table.
//!
//! The settings that affect accuracy ([`knobs`]) are varied one at a time around those of the
//! scene, then in combinations that a model of error and time predicts to be efficient:
//!
//! ```text
//! error(settings) ~ sum over knobs of C_k h_k^p_k       time(settings) ~ product of ratios
//! ```
//! Every candidate is run ([`measure`]). Its error is measured against an exact solution or a
//! computed reference ([`mod@reference`]). Candidates that no other candidate beats in both error
//! and time form the Pareto front ([`pareto`]). [`effects`] measures the time that each effect
//! takes. [`list`] holds the table that is printed, stored on disk and used to choose settings.

mod coarse;
pub mod effects;
pub mod effort;
pub mod knobs;
pub mod list;
pub mod measure;
pub mod pareto;
pub mod planning;
mod reference;
pub mod report;
mod survey;

pub use effort::Effort;
pub use list::{Entry, List, Machine};
pub use survey::price;

use crate::scene::SceneError;
use crate::sim::SimError;

/// The reasons why no cost table can be made.
#[derive(Debug, thiserror::Error)]
pub enum CostError {
    /// The scene is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A simulation failed.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The scene's own settings or the reference cannot be run; the text says why.
    #[error("{0}")]
    Useless(String),
}
