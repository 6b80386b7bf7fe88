//! This module estimates the memory that a run needs, and reads how much memory is available.

use crate::plan::Plan;
use sysinfo::System;

/// Memory of the stored factor and updates, bytes per cell and per doubling of the number of cells,
/// with two unknowns per node: 860 at 128 x 128 cells, 950 at 256 x 256
/// (`cargo bench --bench speed` prints both), more for larger meshes.
const SOLVER_BYTES: f64 = 1150.0;
/// Factor on [`SOLVER_BYTES`] with rotation: `(3/2)^2` times as many entries.
const ROTATION: f64 = 2.25;
/// Memory of the integration points, element matrices and vectors of a cell, bytes.
const CELL_BYTES: f64 = 6e3;
/// Memory of the columns of a particle, bytes: the current state, the state half a step ahead, and
/// the last valid state.
const PARTICLE_BYTES: f64 = 3.0 * 80.0;
/// Memory of the program itself, the recording and the plots, bytes.
const BASE: f64 = 80e6;

/// Estimate of the memory that a run needs, bytes. Boxes of 64 x 64 to 512 x 512 cells with 16
/// particles per cell took 0.6 to 0.95 of it.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    solver: f64,
    cells: f64,
    particles: f64,
}

impl Memory {
    /// Estimates the memory that a run of this plan needs.
    pub fn of(plan: &Plan) -> Memory {
        let n = plan.mesh.cells() as f64;
        let rotation = if plan.effects.rotation { ROTATION } else { 1.0 };
        Memory {
            solver: SOLVER_BYTES * n * n.log2().max(1.0) * rotation,
            cells: CELL_BYTES * n,
            particles: PARTICLE_BYTES * n * plan.method.seeding.count() as f64,
        }
    }

    /// Total memory, bytes.
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

/// A number of bytes as text, in MB or GB.
pub fn size(bytes: f64) -> String {
    if bytes < 1e9 { format!("{:.0} MB", bytes / 1e6) } else { format!("{:.1} GB", bytes / 1e9) }
}

/// Memory that this program may still allocate, bytes; `None` if unknown.
pub fn available() -> Option<f64> {
    let mut system = System::new();
    system.refresh_memory();
    let free = system.available_memory();
    // A container may have less memory than its machine. Its file cache is released on demand, so
    // only the memory held by programs counts.
    let limit = system.cgroup_limits().map(|l| l.total_memory.saturating_sub(l.rss));
    let own = [("Max address space", "VmSize:"), ("Max data size", "VmData:")];
    let own = own.into_iter().filter_map(|(limit, used)| left_by_limit(limit, used));
    let least = limit.filter(|&l| l > 0).into_iter().chain(own).fold(free, u64::min);
    (least > 0).then_some(least as f64)
}

/// Bytes that a limit of this process (`ulimit`) leaves; `None` without a limit, or where the system
/// does not tell.
fn left_by_limit(limit: &str, used: &str) -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|l| l.strip_prefix(limit))?;
    let most: u64 = line.split_whitespace().next()?.parse().ok()?;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix(used))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    // At least a byte: zero would mean unknown.
    Some(most.saturating_sub(1024 * kilobytes).max(1))
}

/// A run that needs more memory than there is.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{cells} cells need about {needed}, and this machine has {} left", size(*.free))]
pub struct TooLarge {
    cells: String,
    needed: Memory,
    free: f64,
}

impl TooLarge {
    /// What the user can do.
    pub const REMEDY: &str =
        "lower accuracy.cells or accuracy.particles_per_cell, or use a larger machine";
}

/// Checks that there is enough memory for a run of a plan.
///
/// # Errors
/// There is not.
pub fn afford(plan: &Plan) -> Result<(), TooLarge> {
    let needed = Memory::of(plan);
    match available() {
        Some(free) if needed.total() > free => {
            let cells = format!("{} x {}", plan.mesh.x.cells(), plan.mesh.y.cells());
            Err(TooLarge { cells, needed, free })
        }
        _ => Ok(()),
    }
}
