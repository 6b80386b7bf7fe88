//! This module measures the time of work, and takes the steps of a run without a guard.

use crate::sim::{Run, SimError};
use crate::threads;
use std::ops::ControlFlow;
use std::time::Instant;

/// CPU time and wall-clock time of some work.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Took {
    /// CPU time, s.
    pub cpu: f64,
    /// Wall-clock time, s.
    pub wall: f64,
}

impl Took {
    /// Adds the time of other work.
    pub fn add(&mut self, o: Took) {
        self.cpu += o.cpu;
        self.wall += o.wall;
    }
}

/// CPU time of this thread, s; it does not depend on other programs. `None` if the system does not
/// report it.
pub fn thread_seconds() -> Option<f64> {
    // The kernel updates the value when a thread yields, otherwise at its tick of some
    // milliseconds.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let ns: f64 = text.split_whitespace().next()?.parse().ok()?;
    (ns > 0.0).then_some(ns * 1e-9)
}

/// Runs `work` on this thread alone and measures its time. If the system reports no CPU time, the
/// wall-clock time is used for both.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Took) {
    let (wall, cpu) = (Instant::now(), thread_seconds());
    let result = threads::alone(work);
    let wall = wall.elapsed().as_secs_f64();
    let cpu = match (cpu, thread_seconds()) {
        (Some(before), Some(after)) => after - before,
        _ => wall,
    };
    (result, Took { cpu, wall })
}

/// Takes steps without a guard until the end of a run or until `watch` returns `Break`. `watch` is
/// called after every step with the time of the step on this thread alone.
///
/// # Errors
/// A step failed.
pub fn march(
    run: &mut dyn Run,
    mut watch: impl FnMut(&dyn Run, Took) -> ControlFlow<()>,
) -> Result<(), SimError> {
    while !run.is_finished() {
        let (outcome, took) = timed(|| run.step());
        outcome?;
        if watch(run, took).is_break() {
            break;
        }
    }
    Ok(())
}
