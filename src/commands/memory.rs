//! Whether the machine has the memory that a run will need.

use super::Failure;
use crate::plan::Plan;
use crate::plan::memory::{Memory, size};
use sysinfo::System;

/// Bytes that this program may still take; `None` if nobody knows.
pub fn available() -> Option<f64> {
    let mut system = System::new();
    system.refresh_memory();
    let free = system.available_memory();
    // A container may have less than its machine.
    let limit = system.cgroup_limits().map(|l| l.free_memory);
    let least = limit.filter(|&l| l > 0).map_or(free, |l| l.min(free));
    (least > 0).then_some(least as f64)
}

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
