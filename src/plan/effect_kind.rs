//! This module names the effects that a scene may need, and says which of them are solved.

/// Effects that a scene may need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffectKind {
    /// Velocity and pressure.
    Flow,
    /// Cosserat rotation.
    Rotation,
    /// Directors of layered materials.
    Directors,
    /// Gravity.
    Gravity,
    /// Stabilisation of stable stratification at large steps.
    Stabilisation,
    /// Force and couple per volume, fixed in space.
    BodyForce,
    /// Acceleration fixed in space.
    Acceleration,
    /// Viscosity carried by particles.
    CarriedViscosity,
    /// Density carried by particles.
    CarriedDensity,
    /// Volume change (finite bulk viscosity).
    VolumeChange,
    /// Dye lines.
    Dye,
    /// Gauges.
    Gauges,
    /// Cells that contain several materials.
    CutCells,
    /// Nothing around the materials.
    Void,
    /// Viscosities that depend on the flow: friction, a yield stress or a flow index.
    FlowCurves,
    /// The zero of the pressure of a closed domain.
    PressureZero,
    /// Inertia.
    Inertia,
    /// Inertia of the rotation.
    MicroInertia,
    /// Slip along walls.
    Slip,
    /// Material that enters through sides and nozzles.
    Inflow,
    /// Solids of any shape, which cut through cells.
    Solids,
    /// Solids that move.
    Moving,
}

impl EffectKind {
    /// Name of the effect.
    pub fn name(self) -> &'static str {
        use EffectKind::*;
        match self {
            Flow => "velocity and pressure",
            Rotation => "Cosserat rotation",
            Directors => "directors",
            Gravity => "gravity",
            Stabilisation => "stabilised stratification",
            BodyForce => "fixed body force",
            Acceleration => "acceleration",
            CarriedViscosity => "carried viscosity",
            CarriedDensity => "carried density",
            VolumeChange => "volume change",
            Dye => "dye lines",
            Gauges => "gauges",
            CutCells => "cut cells",
            Void => "void around the materials",
            FlowCurves => "flow curves",
            PressureZero => "the zero of the pressure",
            Inertia => "inertia",
            MicroInertia => "inertia of the rotation",
            Slip => "slip at walls",
            Inflow => "inflow",
            Solids => "solids of any shape",
            Moving => "solids that move",
        }
    }
}

/// Effects that are solved: they decide which unknowns, particle columns and stages exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSet {
    /// The Cosserat rotation is an unknown.
    pub rotation: bool,
    /// Particles carry directors.
    pub directors: bool,
    /// Particles carry their own viscosity.
    pub carried_viscosity: bool,
    /// Particles carry their own density.
    pub carried_density: bool,
    /// Particle volumes follow the flow (finite bulk viscosity).
    pub volume_change: bool,
    /// Gravity acts on a material with density.
    pub gravity: bool,
    /// A law depends on the flow: friction, a yield stress or a power law.
    pub flow_curves: bool,
    /// Nothing is around the materials.
    pub void: bool,
    /// Inertia acts on the materials with density.
    pub inertia: bool,
    /// Inertia acts on the rotation too.
    pub micro_inertia: bool,
}
