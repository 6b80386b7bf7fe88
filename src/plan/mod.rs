//! From what a scene says to what will be solved, and why.
//!
//! A [`Plan`] is made once; every check and every default happens on the way to it, and after it
//! nobody asks whether an option is set: an effect that the scene does not call for is absent
//! (`None`, an empty list), not switched off by a zero. Everything numerical in a plan is in the
//! plan's own [`Units`].

pub mod boundary;
mod change;
mod effects;
pub mod material;
pub mod memory;
mod meshing;
mod resolve;
pub mod units;
mod warning;

pub use boundary::{BoundaryPlan, Side, WallLine};
pub use effects::{Effect, EffectKind, EffectList, StepTime};
pub use resolve::{MAX_MATERIALS, resolve};
pub use units::Units;
pub use warning::Warning;

use crate::scene::{ColourBy, FieldFn, FieldName, Integrator, Quadrature, Scene};
use crate::space::mesh::Mesh;
use crate::space::seeding::Seeding;
use crate::space::walls::Enclosure;
use material::Material;
use std::sync::Arc;

/// Everything a run needs, checked and decided.
#[derive(Clone, Debug)]
pub struct Plan {
    pub scene: Scene,
    pub units: Units,
    pub mesh: Arc<Mesh>,
    pub enclosure: Enclosure,
    pub boundary: BoundaryPlan,
    pub state: Matter,
    /// `state` from given times or steps on, ascending.
    pub changes: Vec<PlannedChange>,
    pub regions: Vec<Region>,
    /// Initial fields of materials that carry their own viscosity or density, SI.
    pub initial: Vec<InitialFields>,
    /// Force and couple per volume fixed in space, SI.
    pub body_force: Option<[FieldFn; 3]>,
    /// Acceleration fixed in space, SI; acts on the density.
    pub acceleration: Option<[FieldFn; 2]>,
    pub gauges: Vec<Gauge>,
    pub tracers: Option<Tracers>,
    pub marks: Vec<Mark>,
    pub method: Method,
    pub clock: ClockPlan,
    pub picture: Picture,
    pub effects: EffectSet,
    pub warnings: Vec<Warning>,
}

/// What may change while a run goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct Matter {
    pub materials: Vec<Material>,
    pub gravity: [f64; 2],
    /// Largest step that leaves a stratified scene at rest where it is; `None` where nothing could
    /// restore anything.
    pub relaxation: Option<f64>,
}

impl Matter {
    /// Whether there is more than one density.
    pub fn is_stratified(&self) -> bool {
        let m = &self.materials;
        m.iter().any(|k| k.carries_density || k.density != m[0].density)
    }
}

/// A change of matter.
#[derive(Clone, Debug)]
pub struct PlannedChange {
    pub when: When,
    pub state: Matter,
    /// For the log.
    pub label: String,
}

/// When a change takes effect: with the solution at this time, or of this step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum When {
    Time(f64),
    Step(u64),
}

/// Which unknowns, columns and stages exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectSet {
    /// Cosserat rotation is an unknown.
    pub rotation: bool,
    /// Particles carry directors.
    pub directors: bool,
    pub carried_viscosity: bool,
    pub carried_density: bool,
    /// Particle volumes follow the flow (finite bulk viscosity).
    pub volume_change: bool,
    pub gravity: bool,
}

/// A part of the domain and the material that fills it at first (SI shapes).
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    pub material: u8,
    pub shape: Area,
    pub director: Option<InitialDirector>,
}

/// A shape in SI coordinates.
#[derive(Clone, Debug, PartialEq)]
pub enum Area {
    Everywhere,
    Rectangle { x: [f64; 2], y: [f64; 2] },
    Circle { centre: [f64; 2], radius: f64 },
    Where(FieldFn),
}

impl Area {
    pub fn contains(&self, [px, py]: [f64; 2]) -> bool {
        match self {
            Area::Everywhere => true,
            Area::Rectangle { x, y } => px >= x[0] && px < x[1] && py >= y[0] && py < y[1],
            Area::Circle { centre, radius } => {
                (px - centre[0]).powi(2) + (py - centre[1]).powi(2) < radius * radius
            }
            Area::Where(f) => f.at(px, py) > 0.0,
        }
    }
}

/// Directors at the start.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialDirector {
    /// Degrees, SI coordinates.
    Angle(FieldFn),
    Random,
}

/// Fields of one material at the start, SI values and coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialFields {
    pub viscosity: Option<FieldFn>,
    pub density: Option<FieldFn>,
}

/// A segment along a mesh line that counts a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    pub name: String,
    /// 0: the segment is vertical (normal along x); 1: horizontal.
    pub normal: usize,
    pub at: f64,
    pub from: f64,
    pub to: f64,
    /// +1 or -1 along the normal.
    pub sign: f64,
    pub material: u8,
}

/// Passive lines, in the plan's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracers {
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Points of a line come no farther apart than this.
    pub spacing: f64,
}

/// A segment whose particles are drawn in another colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    pub from: [f64; 2],
    pub to: [f64; 2],
    pub half_width: f64,
}

/// Settings that buy accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    pub seeding: Seeding,
    pub quadrature: Quadrature,
    pub integrator: Integrator,
    /// Share of the next step by which restoring loads are taken ahead while there is more than one
    /// density; `None` without gravity, or where it was switched off.
    pub stabilisation: Option<f64>,
    pub tolerance: f64,
    pub max_corrections: u32,
}

/// Time stepping, in the plan's units.
#[derive(Clone, Debug)]
pub struct ClockPlan {
    pub end: f64,
    pub max_step: Option<f64>,
    pub courant: f64,
    pub strain: f64,
    /// Times met exactly: frames and changes, ascending, the end included.
    pub stops: Vec<f64>,
    /// Times of frames, ascending.
    pub frames: Vec<f64>,
}

/// What the recording shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub colour_by: ColourBy,
    pub max_particles: usize,
    pub fields: Vec<FieldName>,
    pub glyphs: u32,
    /// Of the materials, then of marked particles.
    pub colours: Vec<[u8; 3]>,
}

impl Plan {
    /// Unknowns per node: 2, or 3 with rotation.
    pub fn unknowns_per_node(&self) -> usize {
        if self.effects.rotation { 3 } else { 2 }
    }

    /// Index of the material that fills what regions leave free.
    pub fn background(&self) -> Option<u8> {
        self.state.materials.iter().position(|m| m.background).map(|m| m as u8)
    }

    /// Whether a frame is due at a time (s), given how many were; counts on.
    pub fn frame_is_due(&self, time: f64, count: &mut usize) -> bool {
        let now = time / self.units.time * (1.0 + 1e-12);
        let past = self.clock.frames.iter().take_while(|&&t| t <= now).count();
        let due = past > *count;
        *count = past.max(*count);
        due
    }

    /// SI coordinates of a point.
    pub fn si(&self, p: [f64; 2]) -> [f64; 2] {
        p.map(|c| c * self.units.length)
    }
}
