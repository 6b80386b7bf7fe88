//! Cases with exact solutions: a scene, its exact fields and the rates expected of it, in one
//! place, measured by one harness that the tests and the commands share.

mod cosserat;
mod inclined;
mod layers;
mod measure;
mod of_scene;
pub mod rayleigh_taylor;
mod reference;
mod small;
mod solcx;
mod solkz;
mod solvi;
mod vortex;

pub use cosserat::{Fluid, couette, coupled_cell, poiseuille};
pub use inclined::{Inclined, inclined_pure_shear, inclined_shear};
pub use layers::{Wave, layer_stack, layered_cell};
pub use measure::{CaseError, Errors, plan_of, start};
pub use of_scene::exact_of;
pub use small::Small;
pub use solcx::{Drive, SolCx, solcx};
pub use solkz::solkz;
pub use solvi::solvi;
pub use vortex::{steady_vortex, steady_vortex_without_particles};

use crate::scene::SceneSource;

/// An exact solution at an SI point.
pub struct Exact {
    /// `u, v, w`
    pub velocity: Box<dyn Fn(f64, f64) -> [f64; 3] + Send + Sync>,
    /// Up to a constant where the domain is closed.
    pub pressure: Box<dyn Fn(f64, f64) -> f64 + Send + Sync>,
}

/// Orders of convergence that are expected.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    pub velocity: f64,
    pub rotation: Option<f64>,
    pub pressure: Option<f64>,
}

/// A scene whose flow at an instant is known exactly.
pub struct Case {
    pub name: String,
    /// What flows, in a few words.
    pub title: &'static str,
    /// Where the solution comes from.
    pub source: &'static str,
    /// `accuracy.cells` is overwritten.
    pub scene: SceneSource,
    pub exact: Exact,
    pub rates: Rates,
}
