//! This module checks whether the machine has enough memory for a run.

use super::Failure;
use crate::plan::Plan;
use crate::plan::memory::{Memory, available, size};

/// Returns a failure if the plan needs more memory than is available.
pub fn afford(plan: &Plan) -> Result<(), Failure> {
    let needed = Memory::of(plan);
    match available() {
        Some(free) if needed.total() > free => Err(Failure::Environment(format!(
            "{} x {} cells need about {needed}, and this machine has {} left\n  help: lower \
             accuracy.cells or accuracy.particles_per_cell, or use a larger machine",
            plan.mesh.x.cells(),
            plan.mesh.y.cells(),
            size(free)
        ))),
        _ => Ok(()),
    }
}
