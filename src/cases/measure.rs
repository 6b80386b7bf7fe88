//! This module solves a case and measures its errors.

use super::{Case, Exact};
use crate::plan::{Plan, resolve};
use crate::scene::{SceneError, SceneSource, parse};
use crate::sim::{self, Run, SimError};
use crate::space::flow::Flow;
use crate::space::shape::GAUSS_5;
use serde::Serialize;
use std::sync::Arc;

/// Relative errors in the L2 norm (absolute if the exact field is zero).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Error of the velocity.
    pub velocity: f64,
    /// Error of the rotation.
    pub rotation: f64,
    /// Error of the pressure.
    pub pressure: f64,
}

/// Why a case could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The scene is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The simulation failed.
    #[error(transparent)]
    Sim(#[from] SimError),
}

/// The plan of a scene.
///
/// # Errors
/// The scene is invalid; the error refers to its text.
pub fn plan_of(source: &SceneSource) -> Result<Plan, CaseError> {
    Ok(resolve(&parse(source)?).map_err(|e| e.with_source(source))?)
}

/// Starts a run of a scene and solves for its initial flow.
///
/// # Errors
/// The scene is invalid, or the initial flow cannot be solved for.
pub fn start(source: &SceneSource) -> Result<Box<dyn Run>, CaseError> {
    Ok(sim::start(Arc::new(plan_of(source)?))?)
}

impl Case {
    /// The plan with `cells` as `accuracy.cells` and further assignments `sets` (`name=value`).
    ///
    /// # Errors
    /// The scene is invalid.
    pub fn plan(&self, cells: u32, sets: &[&str]) -> Result<Plan, CaseError> {
        let mut all = vec![format!("accuracy.cells={cells}")];
        all.extend(sets.iter().map(|s| s.to_string()));
        let source = self.scene.with_sets(&all)?;
        plan_of(&source)
    }

    /// Solves for the initial flow; for the arguments see [`Case::plan`].
    ///
    /// # Errors
    /// The scene is invalid, or the initial flow cannot be solved for.
    pub fn solve(&self, cells: u32, sets: &[&str]) -> Result<Box<dyn Run>, CaseError> {
        Ok(sim::start(Arc::new(self.plan(cells, sets)?))?)
    }

    /// Errors of the initial flow; for the arguments see [`Case::plan`].
    ///
    /// # Errors
    /// The scene is invalid, or the initial flow cannot be solved for.
    pub fn errors(&self, cells: u32, sets: &[&str]) -> Result<Errors, CaseError> {
        Ok(Errors::of(self.solve(cells, sets)?.as_ref(), &self.exact))
    }

    /// Errors at the end of the run; for the arguments see [`Case::plan`].
    ///
    /// # Errors
    /// The scene is invalid, or a step failed.
    pub fn errors_at_end(&self, cells: u32, sets: &[&str]) -> Result<Errors, CaseError> {
        let mut run = self.solve(cells, sets)?;
        while !run.is_finished() {
            run.step()?;
        }
        Ok(Errors::of(run.as_ref(), &self.exact))
    }
}

/// A computed flow that can be evaluated at SI points.
pub trait Fields {
    /// The plan of the flow.
    fn plan(&self) -> &Plan;
    /// Velocity and rotation (m/s, m/s, 1/s) at an SI point.
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3];
    /// Pressure, Pa, at an SI point.
    fn pressure_at(&self, p: [f64; 2]) -> f64;
}

impl Fields for dyn Run {
    fn plan(&self) -> &Plan {
        Run::plan(self)
    }
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3] {
        Run::velocity_at(self, p)
    }
    fn pressure_at(&self, p: [f64; 2]) -> f64 {
        Run::pressure_at(self, p)
    }
}

/// A flow that was computed from a plan without a run.
pub(super) struct Solved<'a, const D: usize> {
    /// The plan.
    pub plan: &'a Plan,
    /// The flow, in the plan's units.
    pub flow: Flow<D>,
}

impl<const D: usize> Fields for Solved<'_, D> {
    fn plan(&self) -> &Plan {
        self.plan
    }
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3] {
        sim::velocity_at(self.plan, &self.flow, p)
    }
    fn pressure_at(&self, p: [f64; 2]) -> f64 {
        sim::pressure_at(self.plan, &self.flow, p)
    }
}

impl Errors {
    /// Errors of the current flow, integrated with 5 x 5 Gauss points per cell. If the pressure is
    /// determined only up to a constant, its mean is ignored.
    pub fn of<F: Fields + ?Sized>(run: &F, exact: &Exact) -> Errors {
        let plan = run.plan();
        let mesh = &plan.mesh;
        // Sums of squares of the error and the exact value, for velocity, rotation, pressure.
        let mut sums = [[0.0; 2]; 3];
        // Sums of weight, pressure error, exact pressure.
        let mut means = [0.0; 3];
        let mut add = |k: usize, weight: f64, error: f64, exact: f64| {
            sums[k][0] += weight * error * error;
            sums[k][1] += weight * exact * exact;
        };
        let mut at = |cell: usize, r: [f64; 2], share: f64| {
            let p = plan.si(mesh.from_reference(cell, r));
            let weight = share * mesh.cell_volume(cell);
            let (u, e) = (run.velocity_at(p), (exact.velocity)(p[0], p[1]));
            add(0, weight, u[0] - e[0], e[0]);
            add(0, weight, u[1] - e[1], e[1]);
            add(1, weight, u[2] - e[2], e[2]);
            let (q, e) = (run.pressure_at(p), (exact.pressure)(p[0], p[1]));
            add(2, weight, q - e, e);
            means[0] += weight;
            means[1] += weight * (q - e);
            means[2] += weight * e;
        };
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            if let Some(part) = mesh.part(cell) {
                part.points.iter().for_each(|p| at(cell, p.r, p.weight));
                continue;
            }
            for (eta, wy) in GAUSS_5 {
                for (xi, wx) in GAUSS_5 {
                    at(cell, [xi, eta], mesh.whole_measure(cell).share(wx * wy, xi));
                }
            }
        }
        if plan.boundary.closed {
            for k in 0..2 {
                sums[2][k] = (sums[2][k] - means[k + 1] * means[k + 1] / means[0]).max(0.0);
            }
        }
        let relative = |[error, exact]: [f64; 2]| {
            if exact > 0.0 { (error / exact).sqrt() } else { error.sqrt() }
        };
        let [velocity, rotation, pressure] = sums.map(relative);
        Errors { velocity, rotation, pressure }
    }
}
