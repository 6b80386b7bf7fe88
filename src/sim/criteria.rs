//! This module holds the bounds that every run must satisfy at every step.

use crate::plan::Plan;
use serde::Serialize;

/// Upper bounds that every run must satisfy at every step.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Criteria {
    /// Relative difference between the power of the loads and the dissipation.
    pub power: f64,
    /// Divergence of the velocity relative to the strain rate, L2 norm.
    pub divergence: f64,
    /// Potential energy lost plus work minus dissipated energy, over the dissipated energy, at the end
    /// of a run of at least [`ENERGY_STEPS`] steps.
    pub energy: f64,
    /// Number of solver corrections in a step, summed over its solutions.
    pub corrections: f64,
    /// Sum over cells of |volume of particles - area|, over the total area, relative to the share
    /// of one row of particles in a cell; incompressible scenes.
    pub misplaced: f64,
    /// Relative change of a material's projected area.
    pub drift: f64,
    /// Change of the volume of all particles, plus what has left, less what has entered, relative to
    /// the first volume; incompressible scenes.
    pub volume: f64,
    /// Largest deviation of a director's length from 1, `| |n| - 1 |`.
    pub director: f64,
    /// Number of particles outside the domain or inside a solid.
    pub outside: f64,
    /// Largest speed over the largest initial speed, or over a tenth of the scene's unit of speed
    /// if that is larger.
    pub growth: f64,
    /// Largest excess of a carried viscosity or density beyond its initial range, relative to the
    /// larger bound of that range; incompressible scenes.
    pub extrema: f64,
    /// Smallest factor between a value and its bound at which a trial passes; below it the margin
    /// is reported.
    pub margin: f64,
}

/// Share of the flowing grains, mean over a run, above which a run warns that they flow where the
/// law of friction alone is ill-posed.
pub const ILL_POSED: f64 = 0.05;

/// Number of steps after which the energy balance is checked: the energy of a few steps is
/// uncertain.
pub const ENERGY_STEPS: u64 = 10;
/// Largest energy error of an accurate run: a larger one causes a warning. That of [`CRITERIA`]
/// holds for coarse meshes.
pub const ACCURATE_ENERGY: f64 = 0.02;

/// The bounds of all trials. The bound of the drift holds for a coarse mesh, on which a row of
/// particles is a large part of an interface.
pub const CRITERIA: Criteria = Criteria {
    power: 1e-6,
    divergence: 1e-9,
    energy: 0.05,
    corrections: 40.0,
    misplaced: 1.0,
    drift: 0.05,
    volume: 1e-10,
    director: 1e-12,
    outside: 0.0,
    growth: 100.0,
    extrema: 0.05,
    margin: 2.0,
};

/// The bounds of generalised fluids. Their iteration ends at larger errors by design, with a divergence of
/// 1e-8, and may take 100 corrections in each of the two solutions of a step.
pub const FLOW_CURVES: Criteria =
    Criteria { power: 1e-2, divergence: 1e-7, corrections: 200.0, ..CRITERIA };

/// The bounds of scenes with blocks that move: a solution is repeated where cells beside them turn out not to
/// keep their volume, and particles that are pushed out of gaps narrower than a cell crowd beside them.
pub const MOVING: Criteria = Criteria { corrections: 200.0, misplaced: 2.0, ..CRITERIA };

impl Criteria {
    /// The bounds of a plan. The power of generalised fluids is as exact as the default of
    /// `accuracy.nonlinear_tolerance`.
    pub fn of(plan: &Plan) -> &'static Criteria {
        match (plan.effects.flow_curves, plan.moving.is_empty()) {
            (true, _) => &FLOW_CURVES,
            (false, false) => &MOVING,
            (false, true) => &CRITERIA,
        }
    }
}
