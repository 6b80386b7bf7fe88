//! What a run will need of a machine's memory, estimated beforehand, and what there is.

use crate::plan::Plan;
use sysinfo::System;

/// Factor and updates that are kept, per cell and doubling of the mesh, with two unknowns a node: 860
/// at 128 x 128 cells, 950 at 256 x 256 (`cargo bench --bench speed` prints both), more beyond.
const SOLVER_BYTES: f64 = 1150.0;
/// As much more with rotation: `(3/2)^2` entries.
const ROTATION: f64 = 2.25;
/// Integration points, element matrices and vectors of a cell.
const CELL_BYTES: f64 = 6e3;
/// Columns of a particle: as it is, half a step ahead, and at the last good state.
const PARTICLE_BYTES: f64 = 3.0 * 80.0;
/// The program itself, recording and plots.
const BASE: f64 = 80e6;

/// Bytes that a run needs, about: boxes of 64 x 64 to 512 x 512 cells with 16 particles each took 0.6 to
/// 0.95 of it.
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

    /// All of it.
    pub fn total(&self) -> f64 {
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
    // A container may have less than its machine. What its file cache holds is given back when asked
    // for: only what programs hold counts.
    let limit = system.cgroup_limits().map(|l| l.total_memory.saturating_sub(l.rss));
    let least = limit.filter(|&l| l > 0).map_or(free, |l| l.min(free));
    (least > 0).then_some(least as f64)
}
