//! This module holds the errors of a run, and what the user can do about them.

use super::fault::Fault;
use super::initial::Unfilled;
use crate::composition::EmptyCell;
use crate::scene::SceneError;
use crate::solve::report::SolveError;
use crate::words::count;

/// Why a run cannot start or continue.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// A point of the domain has no material.
    #[error(transparent)]
    Unfilled(#[from] Unfilled),
    /// A cell has no particles and no background material.
    #[error("step {step}, t = {time:.6e} s: {source}")]
    Empty {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// The cell.
        source: EmptyCell,
    },
    /// The solver failed.
    #[error("step {step}, t = {time:.6e} s: {source}")]
    Solve {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Error of the solver.
        source: SolveError,
    },
    /// The time step is too short to advance the time, or not a number.
    #[error("step {step}, t = {time:.6e} s: the time step has become {dt:.1e} s")]
    Step {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Time step, s.
        dt: f64,
    },
    /// The step was taken, but the new state is invalid.
    #[error("step {step}, t = {time:.6e} s: {fault}")]
    Fault {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// The fault of the state.
        fault: Fault,
    },
    /// The blocks that move make the flow impossible.
    #[error("step {step}, t = {time:.6e} s: {}", source.headline())]
    Blocks {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// What is wrong, with the remedy.
        source: Box<SceneError>,
    },
    /// A block that moves closes a part of the domain whose volume it changes.
    #[error(
        "step {step}, t = {time:.6e} s: a block that moves encloses incompressible material near x = \
         {x:.4e}, y = {y:.4e} and changes the volume there"
    )]
    Trapped {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Coordinate x, m.
        x: f64,
        /// Coordinate y, m.
        y: f64,
    },
    /// Beside a void, material that nothing holds has no creeping flow.
    #[error(
        "step {step}, t = {time:.6e} s: nothing holds the material near x = {x:.4e}, y = {y:.4e}, and \
         nothing is around it"
    )]
    Falls {
        /// Number of the step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Coordinate x, m.
        x: f64,
        /// Coordinate y, m.
        y: f64,
    },
    /// The step failed with every shorter length that was tried.
    #[error("{source}; the {}", tried(*.cuts))]
    Cut {
        /// Number of repetitions.
        cuts: u32,
        /// Error of the last repetition.
        #[source]
        source: Box<SimError>,
    },
}

/// Describes the repetitions of a step before the run ended.
fn tried(cuts: u32) -> String {
    format!("step was repeated {}, each time shorter, and failed every time", count(cuts, "time"))
}

impl SimError {
    /// Whether a value became infinite or not a number.
    pub fn is_non_finite(&self) -> bool {
        match self {
            SimError::Solve { source: SolveError::NonFinite { .. }, .. } => true,
            SimError::Fault { fault, .. } => fault.is_non_finite(),
            SimError::Cut { source, .. } => source.is_non_finite(),
            _ => false,
        }
    }

    /// What the user can do about the error.
    pub fn remedy(&self) -> &str {
        match self {
            SimError::Unfilled(_) => {
                "extend a region, or give a material `background = true`: a flow without inertia needs a \
                 material everywhere"
            }
            SimError::Empty { .. } => {
                "lower time.courant, raise accuracy.particles_per_cell, or give the scene a \
                 background material"
            }
            SimError::Solve { source: SolveError::Stalled { .. }, .. } => {
                "raise accuracy.max_corrections or accuracy.tolerance, or lower the contrast; between \
                 solids, of which one moves, leave a gap of two cells or more, or raise accuracy.cells"
            }
            SimError::Solve { source: SolveError::Nonlinear { .. }, .. } => {
                "likely cause: a step that changes the flow too much (lower time.tolerance), or a \
                 large range of viscosities (lower largest_viscosity, raise smallest_viscosity); \
                 or raise accuracy.nonlinear_tolerance"
            }
            SimError::Solve { source: SolveError::Factor { .. }, .. } => {
                "likely cause: too few integration points (accuracy.quadrature = \"particles\" \
                 with few particles per cell) or a contrast beyond 1e10; use \"mixture\""
            }
            SimError::Solve { source: SolveError::NonFinite { .. }, .. } => {
                "likely cause: an expression that is undefined at some particle, or a contrast \
                 beyond double precision"
            }
            SimError::Step { .. } => {
                "likely cause: a speed that grows without bound; look at the last frames, and \
                 lower accuracy.cells or the contrast"
            }
            SimError::Blocks { source, .. } => {
                source.remedy().unwrap_or("change the block's velocity")
            }
            SimError::Trapped { .. } => {
                "stop the block before it closes (velocity = \"v*(t < t_end)\"), leave an opening, or give \
                 the material a bulk_viscosity"
            }
            SimError::Falls { .. } => {
                "without inertia it would fall at any speed: set `inertia = true`, let it touch a side along \
                 which the velocity is given, or surround it with a material that has `background = true`"
            }
            SimError::Fault { fault, .. } => fault.remedy(),
            SimError::Cut { source, .. } => source.remedy(),
        }
    }
}
