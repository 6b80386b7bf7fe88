//! This module defines the report of a solution, the stopping criteria and the errors.

use super::multifrontal::NotPositiveDefinite;
use crate::plan::Method;
use crate::words::count;

/// Powers below this fraction of [`Report::power_scale`] are rounding errors of a scene at rest.
const REST: f64 = 1e-6;

/// Largest error of the balance of powers of a converged flow of generalised fluids, in units of the
/// tolerance.
const POWER: f64 = 0.5;
/// Decrement, in units of the tolerance, at which the balance is not asked for.
const SURE: f64 = 0.1;
/// The error of the balance along walls with friction, whatever the decrement. It does not tell whether friction
/// holds a body that hardly deforms: in a deep column of grains that descends, the decrement reaches 1e-2
/// with errors of 1e-2.
const FRICTION_POWER: f64 = 1e-3;
/// The same at the smallest tolerances.
const ROUNDING: f64 = 1e-9;

/// Stopping criteria of the corrections.
#[derive(Clone, Copy, Debug)]
pub struct Stopping {
    /// Tolerance on the scaled residual and on the relative divergence.
    pub tolerance: f64,
    /// Tolerance of the iteration for generalised fluids; see [`Report::decrement`].
    pub nonlinear: f64,
    /// Largest number of corrections.
    pub max_corrections: u32,
}

impl Stopping {
    /// The criteria of a plan.
    pub fn of(method: &Method) -> Self {
        Stopping {
            tolerance: method.tolerance,
            nonlinear: method.nonlinear_tolerance,
            max_corrections: method.max_corrections,
        }
    }
}

/// Report of a solution; powers are in the plan's units.
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    /// Number of corrections.
    pub corrections: u32,
    /// Number of iterations for generalised fluids; zero for linear laws.
    pub iterations: u32,
    /// Relative Newton decrement of the last iteration, an estimate of the relative error before
    /// it; see [`nonlinear`](super::nonlinear). `None` for linear laws.
    pub decrement: Option<f64>,
    /// Scaled residual `||r||_{1/D} / (||f||_{1/D} + ||sqrt(D) u||)`, `D = diag K`, with a small
    /// share of the forces of the pressure added to the denominator.
    pub residual: f64,
    /// L2 norm of the projected divergence over that of the strain rate, with small terms added to
    /// the denominator for rest and rigid rotation.
    pub divergence: f64,
    /// Power of loads and of moving boundaries.
    pub power_in: f64,
    /// Viscous dissipation.
    pub dissipation: f64,
    /// Numerical power that the terms of [`restoring`](super::terms::restoring) take from the flow.
    pub restoring: f64,
    /// Power that goes into kinetic energy; zero without inertia.
    pub inertia: f64,
    /// Scale of the rounding errors of powers: the sum of `||f||^2_{1/D}`, the power of the loads
    /// on a mesh of one element; of `integral p^2/eta`, the power of the pressure if it strained
    /// the stiffest fluid; and of a small share of `||sqrt(D) u||^2`.
    pub power_scale: f64,
    /// Number of rotation unknowns that some Cosserat material acts on.
    pub active_rotation: usize,
    /// Number of cells beside solids whose volume the flow does not keep; see
    /// [`loose`](super::loose).
    pub loose: usize,
    /// Wall time of the parts of the solution.
    pub seconds: Seconds,
}

impl Report {
    /// Imbalance of the powers relative to the largest of them, or to a millionth of the power
    /// scale if that is larger.
    pub fn power_error(&self) -> f64 {
        let powers = [self.power_in, self.dissipation, self.restoring, self.inertia];
        self.imbalance(powers.iter().fold(0.0, |a: f64, p| a.max(p.abs())))
    }

    /// Imbalance of the powers relative to a power, or to a millionth of the power scale if that is larger.
    fn imbalance(&self, power: f64) -> f64 {
        let larger = power.max(REST * self.power_scale);
        let difference = (self.power_in - self.dissipation - self.restoring - self.inertia).abs();
        if larger > 0.0 { difference / larger } else { 0.0 }
    }

    /// Whether the iteration for generalised fluids has converged. With inertia, the momentum is a load, whose
    /// power may be far larger than the dissipation, to which errors are relative here.
    pub(super) fn has_converged(&self, stopping: Stopping, wall_friction: bool) -> bool {
        let tolerance = stopping.nonlinear;
        let Some(decrement) = self.decrement.filter(|d| *d <= tolerance) else { return false };
        let balanced = self.imbalance(self.dissipation) <= POWER * tolerance;
        let rubs = (FRICTION_POWER * tolerance).max(ROUNDING);
        (balanced || decrement <= SURE * tolerance)
            && (!wall_friction || self.power_error() <= rubs)
    }
}

/// Wall time of the parts of a solution, s.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Time for the element matrices, s.
    pub assemble: f64,
    /// Time for the factorisation, s.
    pub factor: f64,
    /// Time for the corrections, s.
    pub solve: f64,
}

/// Reasons why there is no solution.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The matrix is not positive definite.
    #[error("{source}, at ({x:.4e}, {y:.4e}), unknown {component}")]
    Factor {
        /// Error of the factorisation.
        source: NotPositiveDefinite,
        /// Coordinate x of the node.
        x: f64,
        /// Coordinate y of the node.
        y: f64,
        /// Name of the unknown: `u`, `v` or `w`.
        component: &'static str,
    },
    /// The corrections did not converge.
    #[error(
        "no convergence in {}: residual {residual:.1e}, divergence {divergence:.1e}; the largest \
         error is at ({x:.4e}, {y:.4e})",
        count(.corrections, "correction")
    )]
    Stalled {
        /// Number of corrections.
        corrections: u32,
        /// Scaled residual; see [`Report::residual`].
        residual: f64,
        /// Relative divergence; see [`Report::divergence`].
        divergence: f64,
        /// Coordinate x of the largest error.
        x: f64,
        /// Coordinate y of the largest error.
        y: f64,
    },
    /// The iteration for generalised fluids did not converge.
    #[error(
        "no convergence in {} of the flow curves: relative error about {decrement:.1e}; the \
         largest residual is at ({x:.4e}, {y:.4e})",
        count(.iterations, "iteration")
    )]
    Nonlinear {
        /// Number of iterations.
        iterations: u32,
        /// Estimated relative error; see [`Report::decrement`].
        decrement: f64,
        /// Coordinate x of the largest residual.
        x: f64,
        /// Coordinate y of the largest residual.
        y: f64,
    },
    /// The residual is infinite or not a number.
    #[error("the solution is not finite after {}", count(.corrections, "correction"))]
    NonFinite {
        /// Number of corrections.
        corrections: u32,
    },
}

impl SolveError {
    /// The error with its coordinates multiplied by `length`.
    pub fn scaled(mut self, length: f64) -> Self {
        match &mut self {
            SolveError::Factor { x, y, .. }
            | SolveError::Stalled { x, y, .. }
            | SolveError::Nonlinear { x, y, .. } => {
                *x *= length;
                *y *= length;
            }
            SolveError::NonFinite { .. } => {}
        }
        self
    }
}
