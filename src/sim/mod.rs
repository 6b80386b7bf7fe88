//! This module simulates one run. A step consists of these parts:
//!
//! ```text
//! choose dt                    the smallest of several named limits
//! half-step velocity           extrapolated from two solutions, or solved for
//! advect particles, dye        Runge-Kutta in the frozen field, with walls and gauges
//! rotate directors             exact solution for the velocity gradient of the step
//! resample particles           keeps the number of particles per cell within bounds
//! momentum                     velocities of the material in the last two steps; with inertia
//! integration points           fractions, interface and fields from the particles of each cell
//! weight, restoring loads      density of each cell; implicit terms for stable stratification
//! solve                        velocity, rotation, pressure
//! ```

pub mod clock;
pub mod criteria;
mod error;
mod examine;
mod exchange;
mod fault;
pub mod guard;
pub mod inertia;
pub mod initial;
mod interest;
mod measure;
mod moving;
mod notes;
pub mod phases;
mod reach;
pub mod row;
mod run;
mod sampling;
mod saving;
mod simulation;
pub mod snapshot;
mod solution;
mod sources;
pub mod state;
mod step;
mod void;
mod yielding;

pub use error::SimError;
pub use fault::{Fault, Place};
pub use notes::empty_regions;
pub use run::{Run, pressure_at, velocity_at};
pub use simulation::Simulation;

use crate::plan::{Plan, Warning};
use crate::scene::Integrator;
use crate::solve::multifrontal::Effort;
use crate::space::count::Count;
use crate::space::particles::Particles;
use criteria::ILL_POSED;
use row::Row;
use state::{State, StateError};
use std::sync::Arc;

/// Starts the run of a plan and solves for the initial flow.
///
/// # Errors
/// A part of the scene has no material, or the initial flow cannot be solved for.
pub fn start(plan: Arc<Plan>) -> Result<Box<dyn Run>, SimError> {
    if plan.effects.rotation {
        Ok(Box::new(Simulation::<3>::new(plan)?))
    } else {
        Ok(Box::new(Simulation::<2>::new(plan)?))
    }
}

impl<const D: usize> Run for Simulation<D> {
    fn step(&mut self) -> Result<(), SimError> {
        self.advance()
    }
    fn is_finished(&self) -> bool {
        self.time >= self.plan.clock.end * (1.0 - 1e-12)
    }
    fn row(&self) -> &Row {
        &self.row
    }
    fn plan(&self) -> &Plan {
        &self.plan
    }
    fn particles(&self) -> &Particles {
        &self.particles
    }
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3] {
        velocity_at(&self.plan, &self.flow, p)
    }
    fn pressure_at(&self, p: [f64; 2]) -> f64 {
        pressure_at(&self.plan, &self.flow, p)
    }
    fn snapshot(&self) -> crate::frame::Snapshot {
        self.draw()
    }
    fn state_hash(&self) -> String {
        measure::hash(&self.particles)
    }
    fn unknowns(&self) -> [usize; 2] {
        [self.stokes.unknowns(), 3 * self.plan.mesh.cells()]
    }
    fn factor_effort(&self) -> Effort {
        self.stokes.effort()
    }
    fn forget_factor(&mut self) {
        self.stokes.forget_factor();
    }
    fn count(&self) -> Count {
        self.count
    }
    fn warnings(&self) -> Vec<Warning> {
        let mut list = self.notes.clone();
        if self.count.healed > 0 {
            list.push(Warning::CellsHealed { count: self.count.healed });
        }
        if let Some(dye) = self.dye.as_ref().filter(|d| d.is_full()) {
            list.push(Warning::DyeCoarse { points: dye.points() });
        }
        let [solutions, cells] = self.loosened;
        if solutions > 0 && self.step > 0 {
            list.push(Warning::LooseCells { solutions, cells });
        }
        if let Some([x, y, time]) = self.trapped_void {
            list.push(Warning::TrappedVoid { at: [x, y], time });
        }
        let [ill_posed, flowed] = self.flowed;
        if ill_posed > ILL_POSED * flowed {
            list.push(Warning::IllPosed { share: ill_posed / flowed });
        }
        list
    }
    fn events(&self) -> &[String] {
        &self.events
    }
    fn changes_applied(&self) -> usize {
        self.next_change
    }
    fn replan(&mut self, plan: Arc<Plan>) {
        self.change_plan(plan);
    }
    fn save(&self, state: &mut State) {
        Simulation::save(self, state);
    }
    fn restore(&mut self, state: &State) -> Result<(), StateError> {
        self.load(state)
    }
    fn limit_step(&mut self, longest: Option<f64>) {
        self.longest = longest;
    }
    fn attempted_step(&self) -> f64 {
        self.attempted * self.plan.units.time
    }
    fn examine(&self) -> Result<(), Fault> {
        self.find_fault()
    }
}
