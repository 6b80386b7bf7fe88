//! What a case needs: an estimate of its memory, for engines that fill machines.

use crate::plan::Plan;

/// Program, recording and tables.
const BASE: f64 = 64e6;
/// Of a particle with all its columns, and twice: they are sorted by copying.
const PER_PARTICLE: f64 = 300.0;
/// Of the mesh and the assembled matrix, for a row of one unknown of velocity or rotation.
const PER_UNKNOWN: f64 = 700.0;
/// Entries of the Cholesky factor are this many per unknown and doubling of the mesh.
const FILL: f64 = 11.0;

/// Bytes that a run of the plan takes at most. The constants come from runs of `silo`,
/// `shear_alignment` and `solcx` with 4,000 to 480,000 unknowns, which took 0.4 to 0.9 of it
/// (`docs/scaling.md` has the table and its command).
pub fn memory(plan: &Plan) -> u64 {
    let unknowns = (plan.unknowns_per_node() * plan.mesh.nodes()) as f64;
    let particles = (plan.method.seeding.count() * plan.mesh.cells()) as f64;
    let factor = 8.0 * FILL * unknowns * (plan.mesh.nodes() as f64).log2();
    (BASE + PER_PARTICLE * particles + PER_UNKNOWN * unknowns + factor) as u64
}
