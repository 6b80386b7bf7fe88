//! This module defines the format of scene files as Rust types.
//!
//! Every struct corresponds to one TOML table; unknown keys are refused. A [`Quantity`] is a number
//! or an arithmetic expression over the scene's parameters; a [`Field`] may also use the
//! coordinates `x` and `y` (SI units). The values are not checked here; `plan` checks them.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::SceneError;
use super::quantity::{Field, Quantity};

/// A scene file (`schema = 1`). All values are in SI units; x points to the right, y up.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of the scene format; 1.
    pub schema: u32,
    /// Name of the scene, used for the run folder and the recording. Letters, digits, `_`, `-`.
    pub name: String,
    /// Description of the scene in one line.
    #[serde(default)]
    pub description: String,
    /// Gravitational acceleration along x and y, m/s2.
    #[serde(default = "zero_pair")]
    pub gravity: [Quantity; 2],
    /// Whether inertia is solved; `false` (default): creeping flow.
    #[serde(default, skip_serializing_if = "is_false")]
    pub inertia: bool,
    /// Velocity at the start; only with inertia. Absent: at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial_velocity: Option<InitialVelocity>,
    /// Named numbers that expressions may use; `--set name=value` and the explorer change them.
    #[serde(default)]
    pub parameters: IndexMap<String, Parameter>,
    /// The rectangle that is meshed.
    pub domain: Domain,
    /// Settings of the mesh lines.
    #[serde(default)]
    pub mesh: Mesh,
    /// Settings that determine the accuracy.
    #[serde(default)]
    pub accuracy: Accuracy,
    /// End time and limits of the time step.
    pub time: Time,
    /// Materials by name.
    pub materials: IndexMap<String, Material>,
    /// Regions that are filled with materials at the start; where they overlap, the last one
    /// counts.
    pub regions: Vec<Region>,
    /// Boundary conditions at the four sides of the domain.
    #[serde(default)]
    pub boundaries: Boundaries,
    /// Thin walls inside the domain.
    #[serde(default)]
    pub walls: Vec<Wall>,
    /// Solid rectangles inside the domain.
    #[serde(default)]
    pub blocks: Vec<Block>,
    /// Pressure at a point, where the boundaries determine it only up to a constant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_reference: Option<PressureReference>,
    /// Force and couple per volume, fixed in space, in addition to gravity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_force: Option<BodyForce>,
    /// Acceleration fixed in space, in addition to gravity; it acts on the local density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration: Option<Acceleration>,
    /// Gauges that measure the volume of a material that crosses a segment.
    #[serde(default)]
    pub gauges: Vec<Gauge>,
    /// Dye lines and marked particles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dye: Option<Dye>,
    /// Quantity whose error is measured by `grainscope cost`. Default: the volume through the first
    /// gauge at the end; without gauges the velocity at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interest: Option<Interest>,
    /// Contents and appearance of the recording.
    #[serde(default)]
    pub recording: Recording,
    /// Changes of materials, gravity or parameters during the run.
    #[serde(default)]
    pub schedule: Vec<Change>,
}

/// A named number with its range, label and unit.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Value used if `value` is not given; may use the parameters defined above.
    pub default: Quantity,
    /// Value that `--set name=value` has set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Quantity>,
    /// Smallest allowed value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<Quantity>,
    /// Largest allowed value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<Quantity>,
    /// Label of the slider in the explorer; default: the name.
    #[serde(default)]
    pub label: String,
    /// Unit, for display only.
    #[serde(default)]
    pub unit: String,
}

/// The rectangle that is meshed.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Range along x, m: lower and upper end.
    pub x: [Quantity; 2],
    /// Range along y, m: lower and upper end.
    pub y: [Quantity; 2],
    /// Length that contains `accuracy.cells` cells, m; default: the shorter side of the domain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_scale: Option<Quantity>,
}

/// Mesh lines in addition to those that walls, apertures, blocks and gauges require.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Positions towards which cells become smaller. Absent: the ends of walls that face each other
    /// across a gap and the ends of openings in sides, by a factor of 12; `[]`: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grading: Option<Vec<Grading>>,
    /// Largest size ratio of neighbouring cells in graded parts.
    #[serde(default = "growth_default")]
    pub growth: f64,
    /// Additional x coordinates of mesh lines, m.
    #[serde(default)]
    pub lines_x: Vec<Quantity>,
    /// Additional y coordinates of mesh lines, m.
    #[serde(default)]
    pub lines_y: Vec<Quantity>,
}

/// A position towards which cells become smaller.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grading {
    /// Position towards which cells become smaller.
    pub towards: GradingTarget,
    /// Factor by which the cells there are smaller.
    pub factor: Quantity,
}

/// A position towards which the mesh is graded.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GradingTarget {
    /// The ends of inner walls that face each other across a gap, and the ends of openings in sides;
    /// if there are none, all free ends of walls.
    Apertures,
    /// All no-slip walls and sides, and sides with a given tangential velocity or rotation; a side
    /// counts if one of its parts is such.
    Walls,
    /// A coordinate x, m.
    X(Quantity),
    /// A coordinate y, m.
    Y(Quantity),
}

/// A material. It is a Cosserat material if it has a coupling viscosity and an internal length (or
/// couple viscosity) above zero, layered if it has a layer viscosity, and otherwise an isotropic
/// Stokes fluid.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Density, kg/m3; may depend on x and y, and is then carried by the particles.
    #[serde(default = "zero_field")]
    pub density: Field,
    /// Shear viscosity eta, Pa s; may depend on x and y, and is then carried by the particles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_viscosity: Option<Field>,
    /// Bulk viscosity B, Pa s; absent: incompressible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bulk_viscosity: Option<Quantity>,
    /// Coupling viscosity eta_c, Pa s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling_viscosity: Option<Quantity>,
    /// Internal length R, m, with M = 2 eta_c R^2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub internal_length: Option<Quantity>,
    /// Couple viscosity M, Pa s m2, instead of an internal length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub couple_viscosity: Option<Quantity>,
    /// Viscosity eta_s of shear along the layers, whose normal is the director, Pa s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer_viscosity: Option<Quantity>,
    /// Coupling viscosity over shear viscosity, eta_c/eta, instead of a coupling viscosity. Default
    /// 1 for a material with friction, a yield stress or a flow index and an internal length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling_ratio: Option<Quantity>,
    /// Viscosity of shear along the layers over shear viscosity, eta_s/eta, for a material with
    /// friction, a yield stress or a flow index.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer_ratio: Option<Quantity>,
    /// Friction of grains, tau = c + mu(I) p, instead of a viscosity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<Friction>,
    /// Cohesion c of grains with friction, Pa; default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cohesion: Option<Quantity>,
    /// Yield stress tau_y, Pa. With it or `flow_index` the material follows tau = tau_y + K g^n, and
    /// `shear_viscosity` is the consistency K, Pa s^n (Herschel and Bulkley); default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yield_stress: Option<Quantity>,
    /// Flow index n, 0.05 to 5; default 1, a Bingham fluid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flow_index: Option<Quantity>,
    /// Largest viscosity of a material with friction, a yield stress or a flow index, Pa s: that of
    /// material at rest. Default: 1e4 rho sqrt(g H^3) with the height H of its regions; with a yield
    /// stress at least 1e4 K.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_viscosity: Option<Quantity>,
    /// Smallest viscosity of such a material, Pa s: that of grains without pressure and cohesion.
    /// Default: the viscosity of the background, or 1e-8 of the largest without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub smallest_viscosity: Option<Quantity>,
    /// Contact parameters of grains from which the viscosities are computed, instead of giving
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub granular: Option<Granular>,
    /// Whether the material fills the part of the domain outside all regions; such a material
    /// carries no history and is not drawn.
    #[serde(default)]
    pub background: bool,
    /// Colour in pictures, `#rrggbb`; default: from a palette for colour-blind readers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<String>,
}

/// Friction of grains (Jop, Forterre and Pouliquen 2006): mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I)
/// with the inertial number I = d g sqrt(rho_s/p).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Coefficient of friction at rest, mu_s.
    #[serde(rename = "static")]
    pub at_rest: Quantity,
    /// Coefficient of friction at large rates, mu_2; default: that at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dynamic: Option<Quantity>,
    /// Inertial number I_0 at which the coefficient is halfway between the two.
    #[serde(default = "inertial_number_default")]
    pub inertial_number: Quantity,
    /// Diameter d of the grains, m.
    pub grain_diameter: Quantity,
    /// Density rho_s of the grain material, kg/m3; default: the density of the material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grain_density: Option<Quantity>,
}

/// Granular closure, equations (14)-(17) of Dufour, Muehlhaus and Moresi.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Granular {
    /// Porosity n, 0 to 1.
    pub porosity: Quantity,
    /// Coordination number k, contacts per grain.
    pub coordination: Quantity,
    /// Viscosity eta_n of a contact in the normal direction, Pa s.
    pub normal_dashpot: Quantity,
    /// Viscosity eta_m of a contact in the tangential direction, Pa s.
    pub tangential_dashpot: Quantity,
    /// `true` (default): incompressible; `false`: bulk viscosity B from equation (16).
    #[serde(default = "yes")]
    pub incompressible: bool,
}

/// A part of the domain and the material that fills it at the start.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the material.
    pub material: String,
    /// Shape of the region.
    #[serde(default)]
    pub shape: Shape,
    /// Initial directors; required for a layered material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub director: Option<Director>,
}

/// Shape of a region.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// The whole domain.
    #[default]
    Everywhere,
    /// An axis-aligned rectangle.
    Rectangle {
        /// Range along x, m: lower and upper end.
        x: [Quantity; 2],
        /// Range along y, m: lower and upper end.
        y: [Quantity; 2],
    },
    /// A circle.
    Circle {
        /// Coordinates x and y of the centre, m.
        centre: [Quantity; 2],
        /// Radius, m.
        radius: Quantity,
    },
    /// The points where the expression in x and y is above zero (comparisons give 1 or 0).
    Where(Field),
}

/// Initial directors of a layered material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Director {
    /// Angle between the layer normal and the x axis, degrees; may depend on x and y.
    AngleDegrees(Field),
    /// Random directions, uniformly distributed over all angles and evenly over neighbouring
    /// particles; seeded by `accuracy.seed`.
    Random,
}

/// Boundary conditions at the four sides of the domain.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundaries {
    /// Left side.
    #[serde(default)]
    pub left: Boundary,
    /// Right side.
    #[serde(default)]
    pub right: Boundary,
    /// Lower side.
    #[serde(default)]
    pub bottom: Boundary,
    /// Upper side.
    #[serde(default)]
    pub top: Boundary,
}

impl Boundaries {
    /// The four sides: left, right, bottom, top.
    pub fn sides(&self) -> [&Boundary; 4] {
        [&self.left, &self.right, &self.bottom, &self.top]
    }
}

/// Boundary conditions at a side of the domain: `kind` sets defaults that the other keys override.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundary {
    /// Kind of boundary condition.
    #[serde(default)]
    pub kind: BoundaryKind,
    /// Prescribed velocity along x, m/s; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_x: Option<Field>,
    /// Prescribed velocity along y, m/s; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_y: Option<Field>,
    /// Prescribed traction on the fluid along x, Pa; excludes `velocity_x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction_x: Option<Field>,
    /// Prescribed traction on the fluid along y, Pa; excludes `velocity_y`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction_y: Option<Field>,
    /// Prescribed Cosserat rotation rate, 1/s; absent: free (no couple).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Field>,
    /// Parts of the side with other conditions, such as openings; the rest of the side is as the
    /// keys above say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<BoundaryPart>,
}

/// A part of a side with its own boundary conditions: `kind` sets defaults that the other keys
/// override. Its ends become mesh lines. Where it meets the rest of the side, the conditions of
/// walls apply.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundaryPart {
    /// Coordinate of the lower or left end along the side, m: x at the bottom and top, y at the
    /// left and right.
    pub from: Quantity,
    /// Coordinate of the upper or right end along the side, m.
    pub to: Quantity,
    /// Kind of boundary condition; not `periodic`.
    pub kind: BoundaryKind,
    /// Prescribed velocity along x, m/s; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_x: Option<Field>,
    /// Prescribed velocity along y, m/s; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_y: Option<Field>,
    /// Prescribed traction on the fluid along x, Pa; excludes `velocity_x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction_x: Option<Field>,
    /// Prescribed traction on the fluid along y, Pa; excludes `velocity_y`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction_y: Option<Field>,
    /// Prescribed Cosserat rotation rate, 1/s; absent: free (no couple).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Field>,
}

/// Conditions that are written for a side or for a part of it.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a> {
    /// Kind of boundary condition.
    pub kind: BoundaryKind,
    /// Prescribed velocity along x and y.
    pub velocity: [Option<&'a Field>; 2],
    /// Prescribed traction along x and y.
    pub traction: [Option<&'a Field>; 2],
    /// Prescribed Cosserat rotation rate.
    pub rotation: Option<&'a Field>,
}

/// Implements `given` for types that have the keys of a side.
macro_rules! given {
    ($($type:ty),*) => {$(
        impl $type {
            /// The conditions that are written here.
            pub fn given(&self) -> Given<'_> {
                Given {
                    kind: self.kind,
                    velocity: [self.velocity_x.as_ref(), self.velocity_y.as_ref()],
                    traction: [self.traction_x.as_ref(), self.traction_y.as_ref()],
                    rotation: self.rotation.as_ref(),
                }
            }
        }
    )*};
}
given!(Boundary, BoundaryPart);

impl Boundary {
    /// The conditions of the side, followed by those of its parts.
    pub fn all_given(&self) -> impl Iterator<Item = Given<'_>> {
        std::iter::once(self.given()).chain(self.parts.iter().map(BoundaryPart::given))
    }
}

/// Kinds of boundary conditions at a side of the domain or a part of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoundaryKind {
    /// Zero normal velocity and zero tangential traction.
    #[default]
    FreeSlip,
    /// Zero velocity.
    NoSlip,
    /// Zero traction: fluid passes in any direction. What enters is the background.
    Open,
    /// Zero normal traction and zero tangential velocity: fluid passes along the normal, as from a
    /// slit into the open air. What enters is the background.
    Outflow,
    /// Joined to the opposite side, which must also be periodic.
    Periodic,
}

/// A thin wall along a mesh line between two points that have one coordinate in common.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Name of the wall.
    pub name: String,
    /// Coordinates x and y of one end, m.
    pub from: [Quantity; 2],
    /// Coordinates x and y of the other end, m.
    pub to: [Quantity; 2],
    /// Kind of boundary condition on both faces.
    #[serde(default)]
    pub kind: WallKind,
    /// Prescribed Cosserat rotation rate on the wall, 1/s; absent: free (no couple).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Quantity>,
}

/// Kinds of boundary conditions at walls and blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WallKind {
    /// Zero normal velocity and zero tangential traction.
    #[default]
    FreeSlip,
    /// Zero velocity.
    NoSlip,
}

/// A solid rectangle inside the domain.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Name of the block.
    pub name: String,
    /// Range along x, m: lower and upper end.
    pub x: [Quantity; 2],
    /// Range along y, m: lower and upper end.
    pub y: [Quantity; 2],
    /// Kind of boundary condition on its faces.
    #[serde(default)]
    pub kind: WallKind,
}

/// Velocity at the start of a scene with inertia. Its part with divergence is removed.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InitialVelocity {
    /// Velocity along x, m/s; may depend on x and y.
    #[serde(default = "zero_field")]
    pub x: Field,
    /// Velocity along y, m/s; may depend on x and y.
    #[serde(default = "zero_field")]
    pub y: Field,
}

/// Pressure at a point, where the boundaries determine it only up to a constant.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureReference {
    /// Coordinates x and y of the point, m.
    pub at: [Quantity; 2],
    /// Pressure at the point, Pa.
    #[serde(default = "zero")]
    pub value: Quantity,
}

/// Force and couple per volume, fixed in space.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyForce {
    /// Force per volume along x, N/m3; may depend on x and y.
    #[serde(default = "zero_field")]
    pub x: Field,
    /// Force per volume along y, N/m3; may depend on x and y.
    #[serde(default = "zero_field")]
    pub y: Field,
    /// Couple per volume, N m/m3, which acts on the Cosserat rotation; may depend on x and y.
    #[serde(default = "zero_field")]
    pub couple: Field,
}

/// Acceleration fixed in space.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Acceleration {
    /// Acceleration along x, m/s2; may depend on x and y.
    #[serde(default = "zero_field")]
    pub x: Field,
    /// Acceleration along y, m/s2; may depend on x and y.
    #[serde(default = "zero_field")]
    pub y: Field,
}

/// A segment along a mesh line that measures the volume of a material that crosses it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gauge {
    /// Name of the gauge.
    pub name: String,
    /// Coordinates x and y of one end, m.
    pub from: [Quantity; 2],
    /// Coordinates x and y of the other end, m.
    pub to: [Quantity; 2],
    /// Direction in which crossing counts as positive.
    pub direction: Direction,
    /// Name of the material that is measured.
    pub material: String,
}

/// Quantity whose error is measured, and how the error is measured.
///
/// The error is `|q - q_ref| / max(|q_ref|, floor)`, where `|.|` is the norm over the domain for a
/// field and the magnitude for a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Interest {
    /// Quantity whose error is measured.
    pub quantity: Interesting,
    /// Instant at which the quantity is evaluated.
    #[serde(default)]
    pub at: Moment,
    /// Norm used for fields.
    #[serde(default)]
    pub norm: Norm,
    /// Smallest reference value for the relative error, in the unit of the quantity.
    #[serde(default = "zero")]
    pub floor: Quantity,
}

/// Quantities whose error can be measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interesting {
    /// Volume that has crossed the gauge with this name, m2.
    Gauge(String),
    /// Rate at which volume crosses the gauge with this name, m2/s.
    Rate(String),
    /// Root-mean-square speed over the domain, m/s.
    RmsSpeed,
    /// Largest speed, m/s.
    MaxSpeed,
    /// Mean |n_x| of the directors.
    Alignment,
    /// Dissipated power, W/m.
    Dissipation,
    /// Velocity field, m/s.
    Velocity,
    /// Field of the Cosserat rotation rate, 1/s.
    Rotation,
    /// Pressure field, Pa; defined up to a constant if no side is open.
    Pressure,
}

/// Instant at which a quantity is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// Time of the first solution.
    Start,
    /// End of the run.
    #[default]
    End,
    /// Time of the largest magnitude during the run; not available for fields.
    Peak,
}

/// Norm of a field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Norm {
    /// Root mean square over the domain.
    #[default]
    L2,
    /// Largest magnitude in the domain.
    Max,
}

/// Directions along the coordinate axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Along negative x.
    Left,
    /// Along positive x.
    Right,
    /// Along negative y.
    Down,
    /// Along positive y.
    Up,
}

/// Passive lines that move with the flow, and particles that are marked at the start.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dye {
    /// Grid of dye lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<DyeGrid>,
    /// Single dye lines, each a list of points (x, y), m.
    #[serde(default)]
    pub lines: Vec<Vec<[Quantity; 2]>>,
    /// Segments; particles within `width/2` of one are drawn in another colour.
    #[serde(default)]
    pub marks: Vec<DyeMark>,
}

/// Dye lines at x = x0 + i spacing and y = y0 + j spacing inside a rectangle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DyeGrid {
    /// Range along x, m: x0 and upper end.
    pub x: [Quantity; 2],
    /// Range along y, m: y0 and upper end.
    pub y: [Quantity; 2],
    /// Distance between lines, m.
    pub spacing: Quantity,
}

/// Segment whose particles are marked at the start.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DyeMark {
    /// Coordinates x and y of one end, m.
    pub from: [Quantity; 2],
    /// Coordinates x and y of the other end, m.
    pub to: [Quantity; 2],
    /// Width of the marked strip, m.
    pub width: Quantity,
}

/// End time and limits of the time step.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// End time, s; required unless the flow is steady.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<Quantity>,
    /// Whether only the flow of the initial layout is solved, to its steady state: no material
    /// moves and no time passes, so the other keys of `[time]` are not used. Not with inertia.
    #[serde(default, skip_serializing_if = "is_false")]
    pub steady: bool,
    /// Largest time step, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_step: Option<Quantity>,
    /// Largest error of the displacements of the materials of interest (all but the background) in
    /// a step, in cells. It determines the step unless `courant`, `strain` or `max_step` demand a
    /// shorter one.
    #[serde(default = "step_tolerance_default")]
    pub tolerance: f64,
    /// Largest number of cells that the materials of interest cross in a step (Courant number);
    /// cells made smaller by grading count less.
    #[serde(default = "courant_default")]
    pub courant: f64,
    /// Largest strain of layered material in a step.
    #[serde(default = "strain_default")]
    pub strain: f64,
}

/// Settings that determine the accuracy.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Number of cells per `domain.length_scale`.
    pub cells: u32,
    /// Number of particles per cell at the start; a square number.
    pub particles_per_cell: u32,
    /// Positions of the particles at the start.
    pub placement: Placement,
    /// Quadrature in cells.
    pub quadrature: Quadrature,
    /// Time integration scheme.
    pub integrator: Integrator,
    /// Fraction of the next step by which the load of a stable stratification (heavy below light)
    /// is evaluated ahead, so that large steps do not oscillate: 0.6 to 1; 0 switches it off. It
    /// acts only in scenes with gravity and more than one density, and does not change the order in
    /// time.
    pub stabilisation: f64,
    /// Tolerance of the solver for the relative residual and the relative divergence.
    pub tolerance: f64,
    /// Tolerance of the iteration for materials with friction, a yield stress or a flow index: the
    /// estimated error of the flow relative to the flow, in the norm of the dissipated power.
    pub nonlinear_tolerance: f64,
    /// Largest number of corrections (iterations) before the solver reports no convergence.
    pub max_corrections: u32,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Positions of the particles at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// One particle at the centre of each subcell.
    Regular,
    /// One particle at a random position in each subcell.
    Jittered,
    /// Random positions in the cell.
    Random,
}

/// Quadrature in cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quadrature {
    /// Gauss points with the local harmonic mixture of the cell's particles.
    Mixture,
    /// Like `mixture`, but in cells that contain an interface of two materials, shear along the
    /// interface is in series and stretch along it in parallel.
    Laminate,
    /// Where materials of different weight share a cell, each has its own stiffness and weight on
    /// its side of a straight line, along which the velocity may have a kink. Elsewhere like
    /// `laminate`.
    Sides,
    /// Particles as the only integration points: the method of the source.
    Particles,
}

/// Time integration schemes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// One solution per step; the velocity at the half step is extrapolated from the last two.
    Extrapolated,
    /// Two solutions per step; the second one is at the half step.
    Midpoint,
    /// One solution per step, first order in time.
    Euler,
}

/// Contents and appearance of the recording.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Recording {
    /// Number of frames at equal intervals over the run, in addition to the first.
    pub frames: u32,
    /// Additional times of frames, s; the run steps to them exactly.
    pub times: Vec<Quantity>,
    /// Quantity that colours the particles.
    pub colour_by: ColourBy,
    /// Largest number of particles per frame. If there are more, only every k-th one is written,
    /// and the summary states this.
    pub max_particles: u32,
    /// Fields written on a grid in each frame.
    pub fields: Vec<FieldName>,
    /// Number of director strokes across the width of the domain.
    pub glyphs: u32,
}

/// Quantities that can colour the particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ColourBy {
    /// Material.
    Material,
    /// Speed, m/s.
    Speed,
    /// Cosserat rotation rate, 1/s.
    Rotation,
    /// Pressure, Pa.
    Pressure,
    /// Strain rate, 1/s.
    StrainRate,
    /// Shear viscosity, Pa s; with friction, a yield stress or a flow index that of the flow.
    Viscosity,
    /// Alignment |n_x| of the director.
    Alignment,
    /// Inertial number I = d g sqrt(rho_s/p) of grains with friction.
    InertialNumber,
    /// 1 where a material with friction, a yield stress or a flow index yields, 0 where its viscosity
    /// is the largest.
    Yielded,
}

/// Fields that can be recorded on a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FieldName {
    /// Speed, m/s.
    Speed,
    /// Cosserat rotation rate, 1/s.
    Rotation,
    /// Pressure, Pa.
    Pressure,
    /// Mean alignment |n_x| of the directors, with isolines.
    Alignment,
    /// Inertial number I = d g sqrt(rho_s/p) of grains with friction.
    InertialNumber,
    /// 1 where a material with friction, a yield stress or a flow index yields, 0 where its viscosity
    /// is the largest.
    Yielded,
}

/// A scheduled change of values, which takes effect at a time or with the solution of a step.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// Time of the change, s; excludes `step`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<Quantity>,
    /// Number of the step of the change; excludes `time`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<u64>,
    /// New values: parameters by name, other keys by path, for example
    /// `{ alpha = 0.5, "materials.grains.density" = 1e6, "gravity[1]" = -5 }`.
    pub set: IndexMap<String, Quantity>,
}

impl Default for Mesh {
    fn default() -> Self {
        Mesh { grading: None, growth: growth_default(), lines_x: vec![], lines_y: vec![] }
    }
}

impl Time {
    /// The end time: zero for a steady flow.
    ///
    /// # Errors
    /// [`SceneError`] if it is missing.
    pub fn end(&self) -> Result<Quantity, SceneError> {
        if self.steady {
            return Ok(Quantity::number(0.0));
        }
        self.end.clone().ok_or_else(|| {
            let remedy = "give the end in seconds, or steady = true for the flow of the start";
            SceneError::of_key("time", "time.end is missing", remedy)
        })
    }
}

impl Default for Accuracy {
    fn default() -> Self {
        Accuracy {
            cells: 32,
            particles_per_cell: 16,
            placement: Placement::Regular,
            quadrature: Quadrature::Sides,
            integrator: Integrator::Extrapolated,
            stabilisation: 0.75,
            tolerance: 1e-12,
            nonlinear_tolerance: 1e-2,
            max_corrections: 40,
            seed: 1,
        }
    }
}

impl Default for Recording {
    fn default() -> Self {
        Recording {
            frames: 100,
            times: vec![],
            colour_by: ColourBy::Material,
            max_particles: 40_000,
            fields: vec![FieldName::Speed, FieldName::Rotation, FieldName::Pressure],
            glyphs: 32,
        }
    }
}

fn zero_pair() -> [Quantity; 2] {
    [Quantity::number(0.0), Quantity::number(0.0)]
}
fn zero() -> Quantity {
    Quantity::number(0.0)
}
fn zero_field() -> Field {
    Field::number(0.0)
}
/// In the silo with a grading factor of 8 at the aperture, a growth of 1.6 needs a fifth fewer
/// cells than 1.3 and changes the initial discharge by 0.03 %.
fn growth_default() -> f64 {
    1.5
}
fn step_tolerance_default() -> f64 {
    0.1
}
fn courant_default() -> f64 {
    2.0
}
fn strain_default() -> f64 {
    0.25
}
fn inertial_number_default() -> Quantity {
    Quantity::number(0.279)
}
fn is_false(value: &bool) -> bool {
    !value
}
fn yes() -> bool {
    true
}
