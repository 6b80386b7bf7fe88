//! What accuracy costs: a price list of a scene.
//!
//! The settings that buy accuracy ([`knobs`]) are varied one at a time around the scene's own, then
//! together where a model of error and time says that it pays:
//!
//! ```text
//! error(settings) ~ sum over knobs of C_k h_k^p_k       time(settings) ~ product of ratios
//! ```
//! Every candidate is run ([`measure`]), its error is taken against an exact solution or a
//! self-made reference ([`mod@reference`]), and what no other candidate beats in both error and time
//! is the front ([`front`]). [`effects`] prices what a scene calls for. [`list`] is what is printed, kept and bought from.

mod coarse;
pub mod effects;
pub mod front;
pub mod knobs;
pub mod list;
pub mod measure;
pub mod reference;
pub mod report;
mod survey;

pub use list::{Entry, List, Machine};
pub use survey::{Effort, price};

use crate::scene::SceneError;
use crate::sim::SimError;

/// Why there is no price list.
#[derive(Debug, thiserror::Error)]
pub enum CostError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error("{0}")]
    Useless(String),
}
