//! This module defines warnings about a scene or a run, with remedies.

use std::fmt;

/// A warning; its text includes the remedy.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Inertia would matter for this Reynolds number but is not solved.
    Inertia {
        /// Reynolds number.
        reynolds: f64,
    },
    /// A dense fluid lies in a lighter one that is far less viscous.
    ThinFluid {
        /// Name of the denser material.
        dense: String,
        /// Name of the less viscous material.
        thin: String,
        /// Ratio of the viscosities.
        ratio: f64,
    },
    /// The layer viscosity exceeds the shear viscosity.
    StiffLayers {
        /// Name of the material.
        material: String,
        /// Layer viscosity over shear viscosity.
        ratio: f64,
    },
    /// A material has a coupling viscosity but no internal length, or the other way round.
    NoInternalLength {
        /// Name of the material.
        material: String,
    },
    /// A rotation is prescribed, but no material has a rotation.
    RotationUnused {
        /// Side of the domain, as its key in the scene.
        place: String,
    },
    /// Directors are given for a material that is not layered.
    DirectorUnused {
        /// Name of the material.
        material: String,
    },
    /// A material fills no part of the domain.
    MaterialUnused {
        /// Name of the material.
        material: String,
    },
    /// There are more particles than are written per frame.
    ParticlesThinned {
        /// Number of particles that are written.
        recorded: usize,
        /// Number of particles that could be drawn.
        of: usize,
    },
    /// Dye lines are no longer refined.
    DyeCoarse {
        /// Number of points at which refinement stopped.
        points: usize,
    },
    /// Cells that had lost all their particles were refilled.
    CellsHealed {
        /// Number of cells.
        count: u64,
    },
    /// The domain is far from zero.
    FarDomain {
        /// Its lower left corner, m.
        corner: [f64; 2],
    },
    /// Grains without an internal length flow at inertial numbers at which the equations are
    /// ill-posed.
    IllPosed {
        /// Share of the flowing volume, mean over the run.
        share: f64,
    },
    /// A gap beside a solid of any shape is narrower than the mesh can show.
    NarrowGap {
        /// Names of the solids, or of a solid and a side.
        between: [String; 2],
        /// A place beside it, m.
        at: [f64; 2],
        /// Its width, m.
        width: f64,
        /// Size of the cells there, m.
        cell: f64,
    },
    /// A void is enclosed by material, where a background would keep its volume.
    TrappedVoid {
        /// A place in it, m.
        at: [f64; 2],
        /// When it was found first, s.
        time: f64,
    },
    /// Cells beside solids did not keep their volume.
    LooseCells {
        /// Number of solutions with such cells.
        solutions: u64,
        /// Largest number of such cells in one of them.
        cells: u64,
    },
    /// The weight of the background drives a flow through an opening.
    Draft {
        /// The opening, as its key in the scene.
        place: String,
        /// Name of the background.
        material: String,
        /// Key and value that give the pressure of the background at rest.
        remedy: String,
    },
    /// Regions are too small to contain a particle.
    RegionsEmpty {
        /// Indices of the regions.
        regions: Vec<usize>,
    },
    /// A denser material rests exactly level on a lighter one.
    UnstableRest,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::Inertia { reynolds } => write!(
                f,
                "inertia is not solved, but these numbers have a Reynolds number of {reynolds:.1e}: \
                 read the result as the creeping flow of a scaled, more viscous scene, or set \
                 inertia = true"
            ),
            Warning::ThinFluid { dense, thin, ratio } => write!(
                f,
                "`{dense}` is {ratio:.0e} times as viscous as the lighter `{thin}`: detached \
                 drops of it fall much faster than it flows; a ratio of 1e3 or 1e4 gives a \
                 similar flow in less time"
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
                "directors are given for `{material}`, whose layers have no effect: ignored; \
                 give it a layer_viscosity other than its shear_viscosity"
            ),
            Warning::MaterialUnused { material } => {
                write!(
                    f,
                    "material `{material}` fills nothing and is left out; give it a region that \
                     no later one covers, or remove it"
                )
            }
            Warning::ParticlesThinned { recorded, of } => write!(
                f,
                "{recorded} of {of} particles are recorded; raise recording.max_particles for more"
            ),
            Warning::DyeCoarse { points } => write!(
                f,
                "dye lines reached {points} points and are refined no further; use fewer lines"
            ),
            Warning::CellsHealed { count } => write!(
                f,
                "{} refilled from neighbours; lower time.courant or raise \
                 accuracy.particles_per_cell",
                match count {
                    1 => "1 cell lost all its particles and was".into(),
                    n => format!("{n} cells lost all their particles and were"),
                }
            ),
            Warning::FarDomain { corner: [x, y] } => write!(
                f,
                "the domain is far from zero: positions are computed, recorded and exported \
                 relative to its lower left corner ({x}, {y}) m"
            ),
            Warning::NarrowGap { between: [a, b], at: [x, y], width, cell } => write!(
                f,
                "the gap between `{a}` and `{b}` near ({x:.4}, {y:.4}) is {width:.3e} m wide, {:.1} of a cell: \
                 the flow through it is uncertain, or it is closed; raise accuracy.cells, or make them touch",
                width / cell,
            ),
            Warning::TrappedVoid { at: [x, y], time } => write!(
                f,
                "material encloses a void near ({x:.4}, {y:.4}) m at t = {time:.4e} s: it can collapse, where air \
                 would keep its volume; give a material `background = true` if the air matters"
            ),
            Warning::LooseCells { solutions, cells } => write!(
                f,
                "in {}, up to {} beside solids did not keep the volume: leave gaps of two cells or more \
                 between solids, above all beside those that move, or raise accuracy.cells",
                crate::words::count(*solutions, "solution"),
                crate::words::count(*cells, "cell"),
            ),
            Warning::IllPosed { share } => write!(
                f,
                "{:.0} % of the flowing grains (mean over the run) had inertial numbers at which \
                 the law of friction alone is ill-posed: bands and small waves there depend on the \
                 mesh; give the grains internal_length and coupling_ratio",
                100.0 * share
            ),
            Warning::Draft { place, material, remedy } => write!(
                f,
                "`{material}` has weight, but at {place} its pressure is zero at all heights: it \
                 falls out below and comes in above; close this opening, or give the pressure of \
                 `{material}` at rest: {remedy}"
            ),
            Warning::RegionsEmpty { regions } => {
                let list: Vec<String> = regions.iter().map(|k| format!("regions[{k}]")).collect();
                write!(
                    f,
                    "{} holds no particle: it is smaller than their spacing; enlarge it, raise \
                     accuracy.cells, or remove it",
                    list.join(", ")
                )
            }
            Warning::UnstableRest => write!(
                f,
                "a denser material lies level on a lighter one: this is an exact equilibrium, and \
                 nothing moves although it is unstable; perturb it, for instance by a region with \
                 shape.where = \"y < 0.5 + 0.01*cos(pi*x)\""
            ),
        }
    }
}
