//! This module defines what is counted of the particles of a run.

/// Numbers of events of particles, accumulated over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Count {
    /// Splits of a particle.
    pub splits: u64,
    /// Merges of two particles.
    pub merges: u64,
    /// Particles stopped at walls that their step would have crossed.
    pub held: u64,
    /// Particles that left through an open side.
    pub left: u64,
    /// Empty cells between materials that were refilled from a neighbour, except with the background.
    pub healed: u64,
    /// Volume per depth (in the plan's units) that entered through sides.
    pub volume_in: f64,
    /// Volume per depth (in the plan's units) that left through open sides.
    pub volume_out: f64,
    /// Energy that material has carried out of the domain less what it has brought in, in the plan's
    /// units.
    pub energy_out: f64,
}

/// A piece of material that crosses a side of the domain or the mouth of a nozzle.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Whether it enters.
    pub enters: bool,
    /// Index of its material.
    pub material: u8,
    /// Volume.
    pub volume: f64,
    /// Density that it carries, if particles carry densities.
    pub density: Option<f64>,
    /// Where it crosses.
    pub at: [f64; 2],
}
