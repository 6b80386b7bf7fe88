//! How a solution went, when it stops, and why there may be none.

use super::multifrontal::NotPositiveDefinite;

/// Powers below this share of [`Report::power_scale`] are rounding: the scene is at rest.
const REST: f64 = 1e-6;
/// When the corrections stop.
#[derive(Clone, Copy, Debug)]
pub struct Stopping {
    /// On the scaled residual and on the relative divergence.
    pub tolerance: f64,
    pub max_corrections: u32,
}

/// How a solution went.
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    pub corrections: u32,
    /// `||r||_{1/D} / (||f||_{1/D} + ||sqrt(D) u||)`, `D = diag K`.
    pub residual: f64,
    /// L2 norm of the projected divergence over that of the strain rate.
    pub divergence: f64,
    /// Power of loads and of moving boundaries.
    pub power_in: f64,
    /// Viscous dissipation.
    pub dissipation: f64,
    /// Power that the restoring terms of [`super::buoyancy`] take from the flow; numerical.
    pub restoring: f64,
    /// A scale for powers that rounding alone makes: `||f||^2_{1/D}`, the power the loads would
    /// have on a mesh of one element, `integral p^2/eta`, what the pressure would have if it strained
    /// the stiffest fluid, and a little of `||sqrt(D) u||^2`.
    pub power_scale: f64,
    /// Rotation unknowns that some Cosserat material acts on.
    pub active_rotation: usize,
    pub seconds: Seconds,
}

impl Report {
    /// What is left of the powers, over the largest of them.
    pub fn power_error(&self) -> f64 {
        let larger = [self.power_in, self.dissipation, self.restoring, REST * self.power_scale];
        let larger = larger.iter().fold(0.0, |a: f64, p| a.max(p.abs()));
        let difference = (self.power_in - self.dissipation - self.restoring).abs();
        if larger > 0.0 { difference / larger } else { 0.0 }
    }
}

/// Wall seconds of the parts of a solution.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    pub assemble: f64,
    pub factor: f64,
    pub solve: f64,
}

/// Why there is no solution.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    #[error("{source}, at ({x:.4e}, {y:.4e}), unknown {component}")]
    Factor { source: NotPositiveDefinite, x: f64, y: f64, component: &'static str },
    #[error(
        "no convergence in {corrections} corrections: residual {residual:.1e}, \
         divergence {divergence:.1e}; the worst is at ({x:.4e}, {y:.4e})"
    )]
    Stalled { corrections: u32, residual: f64, divergence: f64, x: f64, y: f64 },
    #[error("the solution is not finite after {corrections} corrections")]
    NonFinite { corrections: u32 },
}

impl SolveError {
    /// The same with coordinates in units of `length`.
    pub fn scaled(mut self, length: f64) -> Self {
        match &mut self {
            SolveError::Factor { x, y, .. } | SolveError::Stalled { x, y, .. } => {
                *x *= length;
                *y *= length;
            }
            SolveError::NonFinite { .. } => {}
        }
        self
    }
}
