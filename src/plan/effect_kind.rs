//! This module names the effects that a scene may need.

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
