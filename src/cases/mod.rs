//! Cases with exact solutions: a scene, its exact fields and the rates expected of it, in one
//! place, measured by one harness.

mod cosserat;
pub mod rayleigh_taylor;

pub use cosserat::{Fluid, couette, coupled_cell, poiseuille};

use crate::plan::resolve;
use crate::scene::{SceneError, SceneSource, parse};
use crate::sim::{self, Run, SimError};
use crate::space::shape::GAUSS_5;
use std::sync::Arc;

/// An exact solution at an SI point.
pub struct Exact {
    /// `u, v, w`
    pub velocity: Box<dyn Fn(f64, f64) -> [f64; 3]>,
    pub pressure: Box<dyn Fn(f64, f64) -> f64>,
}

/// Orders of convergence that the elements promise.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    pub velocity: f64,
    pub rotation: Option<f64>,
    pub pressure: Option<f64>,
}

/// A scene whose first instant is known exactly.
pub struct Case {
    pub name: &'static str,
    /// Scene text; `accuracy.cells` is overwritten.
    pub toml: String,
    pub exact: Exact,
    pub rates: Rates,
}

/// Relative errors in the L2 norm (absolute where the exact field vanishes).
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    pub velocity: f64,
    pub rotation: f64,
    pub pressure: f64,
}

/// Why a case could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Sim(#[from] SimError),
}

impl Case {
    /// Solves the first instant at a resolution.
    pub fn solve(&self, cells: u32, sets: &[&str]) -> Result<Box<dyn Run>, CaseError> {
        let mut all = vec![format!("accuracy.cells={cells}")];
        all.extend(sets.iter().map(|s| s.to_string()));
        let source = SceneSource::new(self.name, self.toml.as_str()).with_sets(&all)?;
        let plan = resolve(&parse(&source)?).map_err(|e| e.with_source(&source))?;
        Ok(sim::start(Arc::new(plan))?)
    }

    /// Errors of that solution, by 5 x 5 Gauss points in each cell.
    pub fn errors(&self, cells: u32, sets: &[&str]) -> Result<Errors, CaseError> {
        let run = self.solve(cells, sets)?;
        let plan = run.plan();
        let mesh = &plan.mesh;
        // Sums of squares: error and exact, of velocity, rotation, pressure.
        let mut sums = [[0.0; 2]; 3];
        let mut add = |k: usize, weight: f64, error: f64, exact: f64| {
            sums[k][0] += weight * error * error;
            sums[k][1] += weight * exact * exact;
        };
        for cell in 0..mesh.cells() {
            for (eta, wy) in GAUSS_5 {
                for (xi, wx) in GAUSS_5 {
                    let p = plan.si(mesh.from_reference(cell, [xi, eta]));
                    let weight = wx * wy * mesh.cell_area(cell);
                    let (u, e) = (run.velocity_at(p), (self.exact.velocity)(p[0], p[1]));
                    add(0, weight, u[0] - e[0], e[0]);
                    add(0, weight, u[1] - e[1], e[1]);
                    add(1, weight, u[2] - e[2], e[2]);
                    let (q, e) = (run.pressure_at(p), (self.exact.pressure)(p[0], p[1]));
                    add(2, weight, q - e, e);
                }
            }
        }
        let relative = |[error, exact]: [f64; 2]| {
            if exact > 0.0 { (error / exact).sqrt() } else { error.sqrt() }
        };
        let [velocity, rotation, pressure] = sums.map(relative);
        Ok(Errors { velocity, rotation, pressure })
    }
}
