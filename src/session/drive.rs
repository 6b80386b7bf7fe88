//! This module combines a run with its guard and the counts for its summary. All commands that take
//! guarded steps use it.

use crate::frame::{Frame, Snapshot};
use crate::plan::{Plan, Warning};
use crate::record::info;
use crate::record::summary::Tally;
use crate::sim::guard::{Guard, Policy};
use crate::sim::state::State;
use crate::sim::{Run, SimError, snapshot};
use std::sync::Arc;
use std::time::Instant;

/// A run with a guard and the counts for its summary.
pub struct Drive {
    /// Plan of the run.
    pub plan: Arc<Plan>,
    /// The run.
    pub run: Box<dyn Run>,
    /// Counts for the summary.
    pub tally: Tally,
    guard: Guard,
    /// Number of frames that were due so far.
    frames: usize,
}

impl Drive {
    /// Drives a run that is at a valid state.
    pub fn new(plan: Arc<Plan>, run: Box<dyn Run>, policy: Policy, tally: Tally) -> Drive {
        let guard = Guard::new(policy, run.as_ref());
        let mut drive = Drive { plan, run, tally, guard, frames: 0 };
        if drive.run.row().step > 0 {
            drive.frame_is_due();
        }
        drive
    }

    /// Examines the initial state.
    ///
    /// # Errors
    /// The state is invalid.
    pub fn begin(&self) -> Result<(), SimError> {
        self.guard.begin(self.run.as_ref())
    }

    /// Takes a step under the guard, and returns notes about faults and repetitions.
    ///
    /// # Errors
    /// The step failed and could not be repaired. The run is then at its last valid state.
    pub fn step(&mut self) -> Result<Vec<String>, SimError> {
        let clock = Instant::now();
        let notes = self.guard.step(self.run.as_mut())?;
        self.tally.around.guard += clock.elapsed().as_secs_f64() - self.run.row().wall;
        Ok(notes)
    }

    /// The last valid state.
    pub fn good(&self) -> &State {
        self.guard.good()
    }

    /// Whether a frame is due at the current time; if so, the frame is counted.
    pub fn frame_is_due(&mut self) -> bool {
        self.plan.frame_is_due(self.run.row().time, &mut self.frames)
    }

    /// Frame of the current step. `wall`: seconds spent computing so far.
    pub fn frame(&self, wall: f64, snapshot: Option<Snapshot>, mut notes: Vec<String>) -> Frame {
        let row = self.run.row();
        if row.step == 0 {
            notes.extend(self.tally.warnings.iter().cloned());
        }
        info::frame(&self.plan, row, wall, snapshot, notes)
    }
}

/// Frame that holds only a snapshot of the current state, without the values of a row.
pub fn snapshot_alone(run: &dyn Run, wall_s: f64, snapshot: Snapshot) -> Frame {
    let (step, time_s) = (run.row().step, run.row().time);
    Frame { step, time_s, wall_s, snapshot: Some(snapshot), ..Frame::default() }
}

/// Warnings of a plan as text.
pub fn warnings(plan: &Plan) -> Vec<String> {
    plan.warnings.iter().map(ToString::to_string).collect()
}

/// Warnings of a plan and of its initial state as text.
pub fn warnings_at_start(plan: &Plan, run: &dyn Run) -> Vec<String> {
    let mut all = warnings(plan);
    all.extend(run.warnings().iter().map(ToString::to_string));
    all
}

/// The warning that frames do not show every particle; `None` if they do.
pub fn thinned(plan: &Plan, run: &dyn Run) -> Option<String> {
    let (recorded, of) = (plan.content.max_particles, snapshot::drawn(plan, run.particles()).len());
    (of > recorded).then(|| Warning::ParticlesThinned { recorded, of }.to_string())
}
