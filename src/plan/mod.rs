//! This module turns a scene into a [`Plan`], which states what will be solved, and why.
//!
//! A plan is made once. All checks and defaults are applied while it is made, so later code does
//! not test whether an option is set: an effect that the scene does not need is absent (`None`, an
//! empty list) instead of being switched off by a zero. Numbers in a plan are in the plan's own
//! [`Units`], except where SI units are stated.

pub mod boundary;
mod change;
mod difference;
mod effect_kind;
mod effects;
mod forces;
pub mod loads;
pub mod material;
pub mod memory;
mod meshing;
mod moving;
mod reasons;
mod resolve;
pub mod slip;
pub mod sources;
pub mod units;
mod warning;

pub use boundary::{BoundaryPlan, Conditions, Piece, Side, WallLine};
pub use effect_kind::{EffectKind, EffectSet};
pub use effects::{Effect, EffectList, StepTime};
pub use forces::ForceGauge;
pub use moving::{Moving, Pose};
pub use resolve::resolve;
pub use slip::{Slip, SlipFace, SlipPoint, WallLaw};
pub use sources::{Entering, Source};
pub use units::Units;
pub use warning::Warning;

use crate::scene::{ColourBy, FieldFn, FieldName, Integrator, Quadrature, Scene};
use crate::space::constraints::PressurePoint;
use crate::space::mesh::Mesh;
use crate::space::outline::Outline;
use crate::space::seeding::Seeding;
use crate::space::segment::Line;
use crate::space::walls::Enclosure;
use material::Material;
use std::sync::Arc;

/// Largest number of materials in a scene.
pub const MAX_MATERIALS: usize = 16;

/// All data that a run needs, checked and with defaults applied.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The scene as read.
    pub scene: Scene,
    /// Point (m) relative to which positions are computed.
    pub origin: [f64; 2],
    /// Units of the plan.
    pub units: Units,
    /// The mesh.
    pub mesh: Arc<Mesh>,
    /// Walls as obstacles, and the ranges of the sides through which particles leave.
    pub enclosure: Enclosure,
    /// Boundary conditions.
    pub boundary: BoundaryPlan,
    /// Blocks that move.
    pub moving: Vec<Moving>,
    /// Where they are, and their velocities.
    pub poses: Vec<Pose>,
    /// Point at which the pressure is given, where the boundaries determine it only up to a
    /// constant; its mean is zero if no point is given.
    pub pressure_reference: Option<PressurePoint>,
    /// Materials and gravity at the start.
    pub state: Matter,
    /// Changes of `state` at given times or steps, in ascending order.
    pub changes: Vec<PlannedChange>,
    /// Regions that are filled with materials at the start, in order.
    pub regions: Vec<Region>,
    /// Initial fields of carried viscosity and density, one entry per material, SI.
    pub initial: Vec<InitialFields>,
    /// Velocity along x and y at the start, m/s; at rest if absent. Only with inertia.
    pub initial_velocity: Option<[FieldFn; 2]>,
    /// Force along x and y (N/m3) and couple (N m/m3) per volume, fixed in space, SI.
    pub body_force: Option<[FieldFn; 3]>,
    /// Acceleration along x and y, fixed in space (m/s2), SI; it acts on the density.
    pub acceleration: Option<[FieldFn; 2]>,
    /// Gauges.
    pub gauges: Vec<Gauge>,
    /// Gauges of forces.
    pub forces: Vec<ForceGauge>,
    /// Dye lines.
    pub tracers: Option<Tracers>,
    /// Segments whose particles are marked at the start.
    pub marks: Vec<Mark>,
    /// Settings that determine the accuracy.
    pub method: Method,
    /// Settings of the time stepping.
    pub clock: ClockPlan,
    /// Contents of the recording.
    pub content: FrameContent,
    /// Effects that are solved.
    pub effects: EffectSet,
    /// Warnings about the scene.
    pub warnings: Vec<Warning>,
}

/// Materials and gravity: the values that may change during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Matter {
    /// Materials, in the order of their indices.
    pub materials: Vec<Material>,
    /// Gravitational acceleration along x and y, in the plan's units.
    pub gravity: [f64; 2],
    /// Largest time step that keeps a stratified scene at rest, in the plan's units; `None` without
    /// gravity or with a single density.
    pub relaxation: Option<f64>,
}

impl Matter {
    /// Whether there is more than one density.
    pub fn is_stratified(&self) -> bool {
        let m = &self.materials;
        m.iter().any(|k| k.carries_density || k.density != m[0].density)
    }
}

/// A scheduled change of materials and gravity.
#[derive(Clone, Debug)]
pub struct PlannedChange {
    /// Time or step of the change.
    pub when: When,
    /// Materials and gravity after the change.
    pub state: Matter,
    /// Description of the change for the log.
    pub label: String,
}

/// Instant at which a change takes effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum When {
    /// With the solution at this time, in the plan's units.
    Time(f64),
    /// With the solution of this step.
    Step(u64),
}

/// A part of the domain (SI coordinates) and the material that fills it at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Index of the material.
    pub material: u8,
    /// Shape of the region.
    pub shape: Area,
    /// Initial directors of a layered material.
    pub director: Option<InitialDirector>,
}

/// A shape in SI coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum Area {
    /// The whole domain.
    Everywhere,
    /// An axis-aligned rectangle.
    Rectangle {
        /// Lower and upper end along x, m.
        x: [f64; 2],
        /// Lower and upper end along y, m.
        y: [f64; 2],
    },
    /// A circle.
    Circle {
        /// Coordinates of the centre, m.
        centre: [f64; 2],
        /// Radius, m.
        radius: f64,
    },
    /// A polygon, m.
    Polygon(Outline),
    /// The points where the function is above zero.
    Where(FieldFn),
}

impl Area {
    /// Whether the area contains a point (SI coordinates).
    pub fn contains(&self, [px, py]: [f64; 2]) -> bool {
        match self {
            Area::Everywhere => true,
            Area::Rectangle { x, y } => px >= x[0] && px < x[1] && py >= y[0] && py < y[1],
            Area::Circle { centre, radius } => {
                (px - centre[0]).powi(2) + (py - centre[1]).powi(2) < radius * radius
            }
            Area::Polygon(outline) => outline.contains([px, py]),
            Area::Where(f) => f.at(px, py) > 0.0,
        }
    }
}

/// Initial directors of a layered material.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialDirector {
    /// Angle between the director and the x axis, degrees, as a function of SI coordinates.
    Angle(FieldFn),
    /// Random directions.
    Random,
}

/// Initial fields of one material, as functions of SI coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialFields {
    /// Shear viscosity carried by the particles, Pa s.
    pub viscosity: Option<FieldFn>,
    /// Density carried by the particles, kg/m3.
    pub density: Option<FieldFn>,
}

/// A line that measures the volume of a material that crosses it, in the plan's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    /// Name of the gauge.
    pub name: String,
    /// The line; along a coordinate direction it lies on mesh lines.
    pub line: Line,
    /// +1 if crossing along the normal counts as positive, otherwise -1.
    pub sign: f64,
    /// Index of the material that is measured.
    pub material: u8,
}

/// Dye lines at the start, in the plan's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracers {
    /// Points of each line.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Largest distance between neighbouring points of a line.
    pub spacing: f64,
}

/// A segment whose particles are drawn in another colour, in the plan's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// One end.
    pub from: [f64; 2],
    /// The other end.
    pub to: [f64; 2],
    /// Largest distance of marked particles from the segment.
    pub half_width: f64,
}

/// Settings that determine the accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    /// Number and positions of the particles at the start.
    pub seeding: Seeding,
    /// Quadrature in cells.
    pub quadrature: Quadrature,
    /// Time integration scheme.
    pub integrator: Integrator,
    /// Fraction of the next step by which restoring loads are evaluated ahead while there is more
    /// than one density; `None` without gravity or if it is switched off.
    pub stabilisation: Option<f64>,
    /// Tolerance of the solver for the relative residual and the relative divergence.
    pub tolerance: f64,
    /// Tolerance of the iteration for generalised fluids.
    pub nonlinear_tolerance: f64,
    /// Largest number of corrections (iterations) of the solver.
    pub max_corrections: u32,
}

/// Time stepping, in the plan's units.
#[derive(Clone, Debug)]
pub struct ClockPlan {
    /// End time.
    pub end: f64,
    /// Largest time step.
    pub max_step: Option<f64>,
    /// Largest number of cells that the materials of interest cross in a step (Courant number).
    pub courant: f64,
    /// Largest error of the displacements of the materials of interest in a step, in cells.
    pub tolerance: f64,
    /// Largest strain of layered material in a step.
    pub strain: f64,
    /// Whether steps between two such times are equal as long as their limits allow it, so that
    /// matrices which depend on the step can be kept.
    pub equal: bool,
    /// Times that a step ends at exactly: frames, changes and the end, in ascending order.
    pub stops: Vec<f64>,
    /// Times of frames, in ascending order.
    pub frames: Vec<f64>,
}

/// Contents and appearance of the recording.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameContent {
    /// Quantity that colours the particles.
    pub colour_by: ColourBy,
    /// Largest number of particles per frame.
    pub max_particles: usize,
    /// Fields written on a grid in each frame.
    pub fields: Vec<FieldName>,
    /// Number of director strokes across the width of the domain.
    pub glyphs: u32,
    /// Colours (sRGB) of the materials, followed by the colour of marked particles.
    pub colours: Vec<[u8; 3]>,
}

impl ClockPlan {
    /// Limits of the step that are numbers: tolerance, Courant number and strain.
    pub fn limits(&self) -> [f64; 3] {
        [self.tolerance, self.courant, self.strain]
    }
}

impl Plan {
    /// Number of unknowns per node: 2, or 3 with rotation.
    pub fn unknowns_per_node(&self) -> usize {
        if self.effects.rotation { 3 } else { 2 }
    }

    /// Whether a material has friction.
    pub fn has_friction(&self) -> bool {
        self.halfway_inertial_number().is_some()
    }

    /// Largest of the inertial numbers at which the friction of a material is halfway between its
    /// limits, the end of the colour scale; `None` without friction.
    pub fn halfway_inertial_number(&self) -> Option<f64> {
        let of = |m: &Material| Some(m.law.curve.as_ref()?.friction()?.inertial_number);
        self.state.materials.iter().filter_map(of).reduce(f64::max)
    }

    /// Whether gravity or an acceleration acts on the materials.
    pub fn has_weight(&self) -> bool {
        self.effects.gravity || self.acceleration.is_some()
    }

    /// Whether the density of the materials matters: they have weight or inertia.
    pub fn has_mass(&self) -> bool {
        self.has_weight() || self.effects.inertia
    }

    /// Whether the energy of the particles and the work of loads determine the energy balance:
    /// gravity or inertia acts, gravity not along a periodic axis, and volumes are constant.
    pub fn energy_tells(&self) -> bool {
        let (mesh, g) = (&self.mesh, self.state.gravity);
        let along_seam = mesh.x.periodic() && g[0] != 0.0 || mesh.y.periodic() && g[1] != 0.0;
        let constant = !self.effects.volume_change;
        (self.effects.gravity || self.effects.inertia) && constant && !along_seam
    }

    /// Rule for the integration points of cells. Without weight and inertia, [`Quadrature::Sides`] is
    /// [`Quadrature::Laminate`].
    pub fn rule_of_cells(&self) -> Quadrature {
        match self.method.quadrature {
            Quadrature::Sides if !self.has_mass() && !self.effects.void => Quadrature::Laminate,
            rule => rule,
        }
    }

    /// Whether a frame is due at the given time, s. `count` is the number of frames up to the last
    /// call, and is updated.
    pub fn frame_is_due(&self, time: f64, count: &mut usize) -> bool {
        let now = time / self.units.time * (1.0 + 1e-12);
        let past = self.clock.frames.iter().take_while(|&&t| t <= now).count();
        let due = past > *count;
        *count = past.max(*count);
        due
    }

    /// A point (m, as in the scene) in the plan's units.
    pub fn internal(&self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| (p[c] - self.origin[c]) / self.units.length)
    }

    /// SI coordinates, m, relative to the origin, of a point given in the plan's units.
    pub fn si(&self, p: [f64; 2]) -> [f64; 2] {
        p.map(|c| c * self.units.length)
    }
}
