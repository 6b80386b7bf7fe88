//! What a run will need of the machine's memory, and whether it is there.

use super::Failure;
use crate::plan::Plan;
use sysinfo::System;

/// Measured at 128 x 128 cells with two unknowns a node: the factor, and what the factorisation
/// keeps on the way. Both grow as `n log n` under nested dissection.
const SOLVER_BYTES: f64 = (96e6 + 250e6) / (16_384.0 * 14.0);
/// As much more with rotation: `(3/2)^2` entries, less what has no rotation.
const ROTATION: f64 = 2.2;
/// Integration points, element matrices and vectors of a cell.
const CELL_BYTES: f64 = 6e3;
/// Columns of a particle: as it is, half a step ahead, and at the last good state.
const PARTICLE_BYTES: f64 = 3.0 * 80.0;
/// The program itself, recording and plots.
const BASE: f64 = 100e6;

/// Bytes that a run needs, about.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    solver: f64,
    cells: f64,
    particles: f64,
}

impl Memory {
    pub fn of(plan: &Plan) -> Memory {
        let n = plan.mesh.cells() as f64;
        let rotation = if plan.effects.rotation { ROTATION } else { 1.0 };
        Memory {
            solver: SOLVER_BYTES * n * n.log2().max(1.0) * rotation,
            cells: CELL_BYTES * n,
            particles: PARTICLE_BYTES * n * plan.method.seeding.count() as f64,
        }
    }

    fn total(&self) -> f64 {
        BASE + self.solver + self.cells + self.particles
    }
}

impl std::fmt::Display for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} of memory (solver {}, cells {}, particles {})",
            size(self.total()),
            size(self.solver),
            size(self.cells),
            size(self.particles)
        )
    }
}

/// Bytes, in words.
pub fn size(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

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
