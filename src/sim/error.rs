//! Why a run cannot start or continue, and what the user can do about it.

use super::fault::Fault;
use super::initial::Unfilled;
use crate::composition::EmptyCell;
use crate::solve::report::SolveError;

/// Why a run cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    #[error(transparent)]
    Unfilled(#[from] Unfilled),
    #[error("step {step}, t = {time:.6e} s: {source}")]
    Empty { step: u64, time: f64, source: EmptyCell },
    #[error("step {step}, t = {time:.6e} s: {source}")]
    Solve { step: u64, time: f64, source: SolveError },
    #[error("step {step}, t = {time:.6e} s: the time step has become {dt:.1e} s")]
    Step { step: u64, time: f64, dt: f64 },
    /// The step was taken, but its result cannot be.
    #[error("step {step}, t = {time:.6e} s: {fault}")]
    Fault { step: u64, time: f64, fault: Fault },
    /// Shorter steps do not help either.
    #[error("{source}; the {}", tried(*.cuts))]
    Cut {
        cuts: u32,
        #[source]
        source: Box<SimError>,
    },
}

/// What was tried before a run was given up.
fn tried(cuts: u32) -> String {
    format!("step was taken again {cuts} times, ever shorter, and failed each time")
}

impl SimError {
    /// The field went to infinity or not-a-number.
    pub fn is_non_finite(&self) -> bool {
        match self {
            SimError::Solve { source: SolveError::NonFinite { .. }, .. } => true,
            SimError::Fault { fault, .. } => fault.is_non_finite(),
            SimError::Cut { source, .. } => source.is_non_finite(),
            _ => false,
        }
    }

    /// What the user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            SimError::Unfilled(_) => "see the message",
            SimError::Empty { .. } => {
                "lower time.courant, raise accuracy.particles_per_cell, or give the scene a \
                 background material"
            }
            SimError::Solve { source: SolveError::Stalled { .. }, .. } => {
                "raise accuracy.max_corrections or accuracy.tolerance, or lower the contrast"
            }
            SimError::Solve { source: SolveError::Factor { .. }, .. } => {
                "likely cause: too few integration points (accuracy.quadrature = \"particles\" \
                 with few particles per cell) or a contrast beyond 1e10; use \"mixture\""
            }
            SimError::Solve { source: SolveError::NonFinite { .. }, .. } => {
                "likely cause: an expression that is undefined at some particle, or a contrast \
                 beyond what double precision carries"
            }
            SimError::Step { .. } => {
                "likely cause: a speed that grows without bound; look at the last frames, and \
                 lower accuracy.cells or the contrast"
            }
            SimError::Fault { fault, .. } => fault.remedy(),
            SimError::Cut { source, .. } => source.remedy(),
        }
    }
}
