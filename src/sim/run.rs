//! A run as everything outside of this module sees it: SI units, any number of unknowns.

use super::error::SimError;
use super::fault::Fault;
use super::row::Row;
use super::state::{State, StateError};
use crate::plan::{Plan, Warning};
use crate::solve::multifrontal::Effort;
use crate::space::flow::Flow;
use crate::space::particles::Particles;
use crate::space::population::Count;
use std::sync::Arc;

/// A run whose number of unknowns per node was decided by its plan.
pub trait Run: Send {
    /// Takes one step.
    fn step(&mut self) -> Result<(), SimError>;
    fn is_finished(&self) -> bool;
    /// Diagnostics of the current state.
    fn row(&self) -> &Row;
    fn plan(&self) -> &Plan;
    fn particles(&self) -> &Particles;
    /// Velocity and rotation (zero if none is solved), m/s and 1/s, at an SI point.
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3];
    /// Pa
    fn pressure_at(&self, p: [f64; 2]) -> f64;
    /// What the recording shows of the current state.
    fn snapshot(&self) -> crate::frame::Snapshot;
    /// SHA-256 over the bits of the particle state.
    fn state_hash(&self) -> String;
    /// Unknowns of the solver: velocity and rotation, pressure.
    fn unknowns(&self) -> [usize; 2];
    /// What the last factorisation took.
    fn factor_effort(&self) -> Effort;
    /// Lets the next factorisation compute all of the factor, changed or not: for measurements.
    fn forget_factor(&mut self);
    fn count(&self) -> Count;
    /// Warnings that arose while running.
    fn warnings(&self) -> Vec<Warning>;
    /// What happened in the last step: changes of matter.
    fn events(&self) -> &[String];
    /// How many of the plan's changes lie behind.
    fn changes_applied(&self) -> usize;
    /// Goes on with another plan, made by [`Plan::with_change`]: the two share all that lies behind.
    fn replan(&mut self, plan: Arc<Plan>);
    /// Writes everything that the next step depends on, over what a run of the same plan wrote before.
    fn save(&self, state: &mut State);
    /// The same, on its own.
    fn state(&self) -> State {
        let mut state = State::default();
        self.save(&mut state);
        state
    }
    /// Goes on from a state of a run of the same plan, to the last bit as that one would.
    fn restore(&mut self, state: &State) -> Result<(), StateError>;
    /// Steps may be no longer than this (s) until told otherwise.
    fn limit_step(&mut self, longest: Option<f64>);
    /// Length of the step that was taken or tried last, s.
    fn attempted_step(&self) -> f64;
    /// The first thing about the present state that cannot be.
    fn examine(&self) -> Result<(), Fault>;
}

/// Velocity and rotation (zero if none is solved) of a flow, m/s and 1/s, at an SI point.
pub fn velocity_at<const D: usize>(plan: &Plan, flow: &Flow<D>, p: [f64; 2]) -> [f64; 3] {
    let u = &plan.units;
    let v = flow.at(&plan.mesh, p.map(|c| c / u.length));
    let w = if D == 3 { v[D - 1] * u.rate() } else { 0.0 };
    [v[0] * u.velocity(), v[1] * u.velocity(), w]
}

/// Pressure of a flow, Pa, at an SI point.
pub fn pressure_at<const D: usize>(plan: &Plan, flow: &Flow<D>, p: [f64; 2]) -> f64 {
    let u = &plan.units;
    flow.pressure_at(&plan.mesh, p.map(|c| c / u.length)) * u.stress()
}
