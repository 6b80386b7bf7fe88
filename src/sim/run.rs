//! This module holds the interface of a run, in SI units and for any number of unknowns per node.

use super::error::SimError;
use super::fault::Fault;
use super::row::Row;
use super::state::{State, StateError};
use crate::plan::{Plan, Warning};
use crate::solve::multifrontal::Effort;
use crate::space::count::Count;
use crate::space::flow::Flow;
use crate::space::particles::Particles;
use std::sync::Arc;

/// A run; its plan determines the number of unknowns per node.
pub trait Run: Send {
    /// Takes one step.
    ///
    /// # Errors
    /// The step failed; the state may then be invalid until [`Run::restore`].
    fn step(&mut self) -> Result<(), SimError>;
    /// Whether the end time is reached.
    fn is_finished(&self) -> bool;
    /// Diagnostics of the current state.
    fn row(&self) -> &Row;
    /// The plan of the run.
    fn plan(&self) -> &Plan;
    /// The particles, in the plan's units.
    fn particles(&self) -> &Particles;
    /// Velocity and rotation (zero if none is solved), m/s and 1/s, at an SI point.
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3];
    /// Pressure, Pa, at an SI point.
    fn pressure_at(&self, p: [f64; 2]) -> f64;
    /// The snapshot of the current state for the recording.
    fn snapshot(&self) -> crate::frame::Snapshot;
    /// SHA-256 hash of the bits of the particle data, in hexadecimal.
    fn state_hash(&self) -> String;
    /// Number of unknowns of the solver: of velocity and rotation, and of pressure.
    fn unknowns(&self) -> [usize; 2];
    /// Work of the last factorisation.
    fn factor_effort(&self) -> Effort;
    /// Makes the next factorisation recompute the whole factor, for measurements.
    fn forget_factor(&mut self);
    /// Numbers of particle events since the start.
    fn count(&self) -> Count;
    /// Warnings that arose during the run.
    fn warnings(&self) -> Vec<Warning>;
    /// Descriptions of the scheduled changes that were applied in the last step.
    fn events(&self) -> &[String];
    /// Number of scheduled changes that were applied so far.
    fn changes_applied(&self) -> usize;
    /// Continues with another plan, made by [`Plan::with_change`]. It must agree with the old plan
    /// up to the current time.
    fn replan(&mut self, plan: Arc<Plan>);
    /// Saves all quantities on which the next step depends. Columns that a run of the same plan
    /// saved before are overwritten.
    fn save(&self, state: &mut State);
    /// A new state with all quantities on which the next step depends.
    fn state(&self) -> State {
        let mut state = State::default();
        self.save(&mut state);
        state
    }
    /// Restores the state of a run of the same plan. The next steps are then equal to the last bit.
    ///
    /// # Errors
    /// The state does not fit the plan.
    fn restore(&mut self, state: &State) -> Result<(), StateError>;
    /// Sets the largest length of the next steps, s; `None` removes the limit.
    fn limit_step(&mut self, longest: Option<f64>);
    /// Length of the last step, successful or not, s.
    fn attempted_step(&self) -> f64;
    /// Checks the current state.
    ///
    /// # Errors
    /// The first fault that was found.
    fn examine(&self) -> Result<(), Fault>;
}

/// Velocity and rotation (zero if none is solved) of a flow, m/s and 1/s, at an SI point.
pub fn velocity_at<const D: usize>(plan: &Plan, flow: &Flow<D>, p: [f64; 2]) -> [f64; 3] {
    let u = &plan.units;
    let v = flow.at(&plan.mesh, plan.internal(p));
    let w = if D == 3 { v[D - 1] * u.rate() } else { 0.0 };
    [v[0] * u.velocity(), v[1] * u.velocity(), w]
}

/// Pressure of a flow, Pa, at an SI point.
pub fn pressure_at<const D: usize>(plan: &Plan, flow: &Flow<D>, p: [f64; 2]) -> f64 {
    let u = &plan.units;
    flow.pressure_at(&plan.mesh, plan.internal(p)) * u.stress()
}
