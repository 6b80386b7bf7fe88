//! What is allowed but worth knowing, with remedies.

use std::fmt;

/// A warning; the text says what to do about it.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Inertia would matter for these numbers, and is not solved.
    Inertia { reynolds: f64 },
    /// A dense fluid in one that is far thinner.
    ThinFluid { dense: String, thin: String, ratio: f64 },
    /// Layers that resist shear more than the matrix.
    StiffLayers { material: String, ratio: f64 },
    /// A coupling viscosity without an internal length, or the other way round.
    NoInternalLength { material: String },
    /// A rotation is prescribed but no material has one.
    RotationUnused { place: String },
    /// Directors given for a material that has no layers.
    DirectorUnused { material: String },
    /// A material that fills nothing.
    MaterialUnused { material: String },
    /// More particles than are written per frame.
    ParticlesThinned { every: usize },
    /// Dye lines stopped being refined.
    DyeCoarse { points: usize },
    /// Cells that had lost all particles were refilled.
    CellsHealed { count: u64 },
    /// A side has a given velocity through it.
    ThroughFlow { place: String },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Inertia { reynolds } => write!(
                f,
                "inertia is not solved, but these numbers have a Reynolds number of {reynolds:.1e}: \
                 read the result as the creeping flow of a scaled, more viscous scene"
            ),
            Warning::ThinFluid { dense, thin, ratio } => write!(
                f,
                "`{dense}` is {ratio:.0e} times as viscous as the lighter `{thin}`: drops of it that \
                 come loose fall far faster than it flows, and steps become as short; with a \
                 ratio of 1e3 or 1e4 it flows much alike"
            ),
            Warning::StiffLayers { material, ratio } => write!(
                f,
                "material `{material}`: layer_viscosity is {ratio:.3} times shear_viscosity; \
                 layers usually shear more easily, so check that the two are not swapped"
            ),
            Warning::NoInternalLength { material } => write!(
                f,
                "material `{material}` has only one of coupling_viscosity and internal_length: no \
                 rotation is solved for it; give both above zero, or neither"
            ),
            Warning::RotationUnused { place } => write!(
                f,
                "{place} prescribes a rotation, but no material of the scene has one: ignored; \
                 give a material coupling_viscosity and internal_length"
            ),
            Warning::DirectorUnused { material } => write!(
                f,
                "directors are given for `{material}`, whose layers make no difference: ignored; \
                 give it a layer_viscosity other than its shear_viscosity"
            ),
            Warning::MaterialUnused { material } => {
                write!(
                    f,
                    "material `{material}` fills nothing and is left out; give it a region that \
                     no later one covers, or remove it"
                )
            }
            Warning::ParticlesThinned { every } => write!(
                f,
                "every {every}th particle is recorded; raise recording.max_particles for more"
            ),
            Warning::DyeCoarse { points } => write!(
                f,
                "dye lines reached {points} points and are refined no further; use fewer lines"
            ),
            Warning::CellsHealed { count } => write!(
                f,
                "{count} cells lost all their particles and were refilled from neighbours; \
                 lower time.courant or raise accuracy.particles_per_cell"
            ),
            Warning::ThroughFlow { place } => write!(
                f,
                "{place} prescribes a velocity through it: particles leave with the flow, but what \
                 flows in brings none, and those near it are split to fill in; read long runs \
                 with care, or use periodic sides"
            ),
        }
    }
}
