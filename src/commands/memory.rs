//! Whether the machine has the memory that a run will need.

use super::Failure;
use crate::plan::Plan;
use crate::plan::memory::{Memory, available, size};

/// Refuses a plan that this machine has no memory for.
pub fn afford(plan: &Plan) -> Result<(), Failure> {
    let needed = Memory::of(plan);
    match available() {
        Some(free) if needed.total() > free => Err(Failure::Environment(format!(
            "{} x {} cells need about {needed}, and this machine has {} left\n  help: lower \
             accuracy.cells or accuracy.particles_per_cell, or run it on a larger machine",
            plan.mesh.x.cells(),
            plan.mesh.y.cells(),
            size(free)
        ))),
        _ => Ok(()),
    }
}
