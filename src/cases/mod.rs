//! This module holds cases with exact solutions. A case combines a scene, its exact fields and the
//! expected orders of convergence. Tests and commands measure all cases with the same functions.

pub mod axisymmetric;
mod bending;
mod cosserat;
mod flow_curves;
mod inclined;
pub mod inertia;
mod layers;
mod measure;
mod of_scene;
pub mod rayleigh_taylor;
mod reference;
mod slip;
mod small;
mod solcx;
pub mod solids;
mod solkz;
mod solvi;
mod vortex;

pub use bending::{CoupleWave, Layered, couple_wave, layered_channel};
pub use cosserat::{Fluid, couette, coupled_cell, poiseuille};
pub use flow_curves::{Channel, Unidirectional, bagnold, channel, chute};
pub use inclined::{Inclined, inclined_pure_shear, inclined_shear};
pub use layers::{Wave, layer_stack, layered_cell};
pub use measure::{CaseError, Errors, plan_of, start};
pub use of_scene::exact_of;
pub use slip::slip_cell;
pub use small::Small;
pub use solcx::{Drive, SolCx, solcx};
pub use solkz::solkz;
pub use solvi::solvi;
pub use vortex::{steady_vortex, steady_vortex_without_particles};

use crate::scene::SceneSource;

/// An exact solution, as functions of a point in SI units.
pub struct Exact {
    /// Velocity and rotation `u, v, w` (m/s, m/s, 1/s).
    pub velocity: Box<dyn Fn(f64, f64) -> [f64; 3] + Send + Sync>,
    /// Pressure, Pa; up to a constant if the domain is closed.
    pub pressure: Box<dyn Fn(f64, f64) -> f64 + Send + Sync>,
}

/// Smallest expected orders of convergence.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// Order of the velocity error.
    pub velocity: f64,
    /// Order of the rotation error; `None` if it is not tested.
    pub rotation: Option<f64>,
    /// Order of the pressure error; `None` if it is not tested.
    pub pressure: Option<f64>,
}

/// A scene whose initial flow is known exactly.
pub struct Case {
    /// Name of the case.
    pub name: String,
    /// Short description of the flow.
    pub title: &'static str,
    /// Source of the exact solution.
    pub source: &'static str,
    /// The scene; its `accuracy.cells` is overwritten.
    pub scene: SceneSource,
    /// The exact solution.
    pub exact: Exact,
    /// Expected orders of convergence.
    pub rates: Rates,
}
