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
    #[schemars(extend("x-unit" = "1", "x-range" = "= 1", "examples" = [1]))]
    pub schema: u32,
    /// Name of the scene, used for the run folder and the recording. Letters, digits, `_`, `-`.
    #[schemars(extend("x-range" = "1 to 100 letters, digits, `_`, `-`", "examples" = ["silo"]))]
    pub name: String,
    /// Description of the scene in one line.
    #[serde(default)]
    #[schemars(extend("examples" = ["Discharge of a silo"]))]
    pub description: String,
    /// Gravitational acceleration along x and y.
    #[serde(default = "zero_pair")]
    #[schemars(extend("x-unit" = "m/s2", "x-range" = "any", "examples" = [[0, -9.81]]))]
    pub gravity: [Quantity; 2],
    /// Whether inertia is solved; `false`: creeping flow.
    #[serde(default, skip_serializing_if = "is_false")]
    #[schemars(extend("x-default" = "`false`", "examples" = [true]))]
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
    /// What is around the materials: `"void"`, nothing. The material with `background = true` is then not
    /// solved for, and may be left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-default" = "the material with `background = true`",
        "examples" = ["void"]
    ))]
    pub background: Option<Background>,
    /// Regions that are filled with materials at the start; where they overlap, the last one
    /// counts.
    #[serde(default)]
    pub regions: Vec<Region>,
    /// Boundary conditions at the four sides of the domain.
    #[serde(default)]
    pub boundaries: Boundaries,
    /// Thin walls inside the domain.
    #[serde(default)]
    pub walls: Vec<Wall>,
    /// Solids inside the domain.
    #[serde(default)]
    pub blocks: Vec<Block>,
    /// Nozzles inside the domain that push material in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sources: Vec<Source>,
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

/// What is around the materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// Nothing: no unknowns, no particles, no traction on the surface of the materials.
    Void,
}

/// A named number with its range, label and unit.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Value used if `value` is not given; may use the parameters defined above.
    #[schemars(extend(
        "x-unit" = "that of the parameter",
        "x-range" = "`min` to `max`",
        "examples" = [0.5]
    ))]
    pub default: Quantity,
    /// Value that `--set name=value` has set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "that of the parameter",
        "x-range" = "`min` to `max`",
        "x-default" = "`default`",
        "examples" = ["5/3"]
    ))]
    pub value: Option<Quantity>,
    /// Smallest allowed value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "that of the parameter",
        "x-range" = "≤ `max`",
        "x-default" = "no limit",
        "examples" = [0]
    ))]
    pub min: Option<Quantity>,
    /// Largest allowed value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "that of the parameter",
        "x-range" = "≥ `min`",
        "x-default" = "no limit",
        "examples" = [100]
    ))]
    pub max: Option<Quantity>,
    /// Label of the slider in the explorer.
    #[serde(default)]
    #[schemars(extend("x-default" = "the name", "examples" = ["width of the outlet"]))]
    pub label: String,
    /// Unit, for display only.
    #[serde(default)]
    #[schemars(extend("examples" = ["m"]))]
    pub unit: String,
}

/// Geometry of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// A plane flow: everything is per metre of depth.
    #[default]
    Plane,
    /// A round flow: x is the distance from the axis, y the position along it. A left side at 0 is the
    /// axis.
    Axisymmetric,
}

impl Geometry {
    /// Whether the flow is round.
    pub fn is_round(self) -> bool {
        self == Geometry::Axisymmetric
    }

    /// The unit of a quantity of a run, from that in the plane, where volumes, forces, powers and energies
    /// are per metre of depth.
    pub fn unit(self, in_plane: &'static str) -> &'static str {
        match (self, in_plane) {
            (Geometry::Plane, unit) => unit,
            (_, "m²") => "m³",
            (_, "m²/s") => "m³/s",
            (_, "N/m") => "N",
            (_, "W/m") => "W",
            (_, "J/m") => "J",
            (_, unit) => unit,
        }
    }
}

fn is_plane(geometry: &Geometry) -> bool {
    *geometry == Geometry::Plane
}

/// The rectangle that is meshed.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// `"plane"`: a plane flow, per metre of depth. `"axisymmetric"`: a round flow, in which x is the
    /// distance from the axis and y the position along it; a left side at x = 0 is the axis.
    #[serde(default, skip_serializing_if = "is_plane")]
    #[schemars(extend("x-default" = "`\"plane\"`", "examples" = ["axisymmetric"]))]
    pub geometry: Geometry,
    /// Range along x: lower and upper end.
    #[schemars(extend("x-unit" = "m", "x-range" = "ascending", "examples" = [[0, 2]]))]
    pub x: [Quantity; 2],
    /// Range along y: lower and upper end.
    #[schemars(extend("x-unit" = "m", "x-range" = "ascending", "examples" = [[0, "height"]]))]
    pub y: [Quantity; 2],
    /// Length that contains `accuracy.cells` cells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "> 0",
        "x-default" = "the shorter side of the domain",
        "examples" = [0.5]
    ))]
    pub length_scale: Option<Quantity>,
}

/// Mesh lines in addition to those that walls, apertures, blocks and gauges require.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Positions towards which cells become smaller. Absent: the ends of walls that face each other
    /// across a gap and the ends of openings in sides, by a factor of 12; `[]`: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-default" = "12 towards apertures",
        "examples" = [[{ "towards": "walls", "factor": 4 }]]
    ))]
    pub grading: Option<Vec<Grading>>,
    /// Largest size ratio of neighbouring cells in graded parts.
    #[serde(default = "growth_default")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 1, ≤ 2", "examples" = [1.3]))]
    pub growth: f64,
    /// Additional x coordinates of mesh lines.
    #[serde(default)]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain",
        "examples" = [[0.25, "aperture/2"]]
    ))]
    pub lines_x: Vec<Quantity>,
    /// Additional y coordinates of mesh lines.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m", "x-range" = "in the domain", "examples" = [[0.5]]))]
    pub lines_y: Vec<Quantity>,
}

/// A position towards which cells become smaller.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grading {
    /// Position towards which cells become smaller.
    #[schemars(extend("examples" = ["walls"]))]
    pub towards: GradingTarget,
    /// Factor by which the cells there are smaller.
    #[schemars(extend("x-unit" = "1", "x-range" = "1 to 1000", "examples" = [8]))]
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
    /// The corners of blocks around which material may flow.
    Corners,
    /// A coordinate x.
    X(
        /// Coordinate x.
        #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [0.5]))]
        Quantity,
    ),
    /// A coordinate y.
    Y(
        /// Coordinate y.
        #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [0.5]))]
        Quantity,
    ),
}

/// A material. It is a Cosserat material if it has a coupling viscosity and an internal length (or
/// couple viscosity) above zero, layered if it has a layer viscosity, and otherwise an isotropic
/// Stokes fluid.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Density; may depend on x and y, and is then carried by the particles.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "kg/m3", "x-range" = "≥ 0", "examples" = [1600]))]
    pub density: Field,
    /// Shear viscosity eta; may depend on x and y, and is then carried by the particles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s",
        "x-range" = "> 0",
        "x-default" = "from `friction` or `granular`",
        "examples" = ["100 * exp(-2*y)"]
    ))]
    pub shear_viscosity: Option<Field>,
    /// Bulk viscosity B.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s",
        "x-range" = "> 0",
        "x-default" = "incompressible",
        "examples" = [1e4]
    ))]
    pub bulk_viscosity: Option<Quantity>,
    /// Coupling viscosity eta_c.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s",
        "x-range" = "≥ 0",
        "x-default" = "`0`",
        "examples" = [50]
    ))]
    pub coupling_viscosity: Option<Quantity>,
    /// Internal length R, with M = 2 eta_c R^2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "≥ 0",
        "x-default" = "no rotation",
        "examples" = [0.02]
    ))]
    pub internal_length: Option<Quantity>,
    /// Internal length R_l of the bending of layers, for a layered material with an internal length
    /// R, which may be zero: the couple stress is 2 eta_c (R^2 1 + (R_l^2 - R^2) t t) grad w, t the unit
    /// vector along the layers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "≥ 0",
        "x-default" = "`internal_length`",
        "examples" = [0.05]
    ))]
    pub layer_internal_length: Option<Quantity>,
    /// Couple viscosity M, instead of an internal length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s m2",
        "x-range" = "≥ 0",
        "x-default" = "from `internal_length`",
        "examples" = [0.1]
    ))]
    pub couple_viscosity: Option<Quantity>,
    /// Micro-inertia j of the rotation in a scene with inertia, rho j dw/dt: the moment of inertia of the
    /// rotating grains per mass, d^2/8 for discs and d^2/10 for spheres of the diameter d.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m2",
        "x-range" = "≥ 0",
        "x-default" = "the rotation has no inertia",
        "examples" = [1e-6]
    ))]
    pub micro_inertia: Option<Quantity>,
    /// Viscosity eta_s of shear along the layers, whose normal is the director.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s",
        "x-range" = "> 0",
        "x-default" = "no layers",
        "examples" = [1]
    ))]
    pub layer_viscosity: Option<Quantity>,
    /// Coupling viscosity over shear viscosity, eta_c/eta, instead of a coupling viscosity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "≥ 0",
        "x-default" = "from `coupling_viscosity`; with a flow curve and an internal length 1",
        "examples" = [0.5]
    ))]
    pub coupling_ratio: Option<Quantity>,
    /// Viscosity of shear along the layers over shear viscosity, eta_s/eta, for a material with
    /// friction, a yield stress or a flow index.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "> 0",
        "x-default" = "no layers",
        "examples" = [0.1]
    ))]
    pub layer_ratio: Option<Quantity>,
    /// Friction of grains, tau = c + mu(I) p, instead of a viscosity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-default" = "none",
        "examples" = [{ "static": 0.38, "dynamic": 0.64, "grain_diameter": 1e-3 }]
    ))]
    pub friction: Option<Friction>,
    /// Cohesion c of grains with friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "Pa", "x-range" = "≥ 0", "x-default" = "`0`", "examples" = [20]))]
    pub cohesion: Option<Quantity>,
    /// Yield stress tau_y. With it or `flow_index` the material follows tau = tau_y + K g^n, and
    /// `shear_viscosity` is the consistency K, Pa s^n (Herschel and Bulkley).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "Pa", "x-range" = "≥ 0", "x-default" = "`0`", "examples" = [50]))]
    pub yield_stress: Option<Quantity>,
    /// Flow index n; 1: a Bingham fluid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "0.05 to 5",
        "x-default" = "`1`",
        "examples" = [0.5]
    ))]
    pub flow_index: Option<Quantity>,
    /// Largest viscosity of a material with friction, a yield stress or a flow index: that of
    /// material at rest. Its default depends on the height H of its regions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s",
        "x-range" = "> 0",
        "x-default" = "1e4 rho sqrt(g H^3); with a yield stress at least 1e4 K",
        "examples" = [1e6]
    ))]
    pub largest_viscosity: Option<Quantity>,
    /// Smallest viscosity of such a material: that of grains without pressure and cohesion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa s",
        "x-range" = "> 0; ≤ `largest_viscosity`",
        "x-default" = "that of the background, or 1e-8 of the largest",
        "examples" = [0.1]
    ))]
    pub smallest_viscosity: Option<Quantity>,
    /// Contact parameters of grains from which the viscosities are computed, instead of giving
    /// them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-default" = "none",
        "examples" = [{ "porosity": 0.4, "coordination": 6, "normal_dashpot": 10, "tangential_dashpot": 5 }]
    ))]
    pub granular: Option<Granular>,
    /// Whether the material fills the part of the domain outside all regions; such a material
    /// carries no history and is not drawn.
    #[serde(default)]
    #[schemars(extend("examples" = [true]))]
    pub background: bool,
    /// Colour in pictures, `#rrggbb`. The palette is one for colour-blind readers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "six hexadecimal digits",
        "x-default" = "from a palette",
        "examples" = ["#e69f00"]
    ))]
    pub colour: Option<String>,
}

/// Friction of grains (Jop, Forterre and Pouliquen 2006): mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I)
/// with the inertial number I = d g sqrt(rho_s/p).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Coefficient of friction at rest, mu_s.
    #[serde(rename = "static")]
    #[schemars(extend("x-unit" = "1", "x-range" = "≥ 0", "examples" = [0.38]))]
    pub at_rest: Quantity,
    /// Coefficient of friction at large rates, mu_2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "≥ 0; ≥ `static`",
        "x-default" = "`static`",
        "examples" = [0.64]
    ))]
    pub dynamic: Option<Quantity>,
    /// Inertial number I_0 at which the coefficient is halfway between the two.
    #[serde(default = "inertial_number_default")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0", "examples" = [0.279]))]
    pub inertial_number: Quantity,
    /// Diameter d of the grains.
    #[schemars(extend("x-unit" = "m", "x-range" = "≥ 0", "examples" = [1e-3]))]
    pub grain_diameter: Quantity,
    /// Density rho_s of the grain material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "kg/m3",
        "x-range" = "> 0",
        "x-default" = "`density`",
        "examples" = [2500]
    ))]
    pub grain_density: Option<Quantity>,
}

/// Granular closure, equations (14)-(17) of Dufour, Muehlhaus and Moresi.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Granular {
    /// Porosity n.
    #[schemars(extend("x-unit" = "1", "x-range" = "≥ 0, < 1", "examples" = [0.4]))]
    pub porosity: Quantity,
    /// Coordination number k, contacts per grain.
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0", "examples" = [6]))]
    pub coordination: Quantity,
    /// Viscosity eta_n of a contact in the normal direction.
    #[schemars(extend("x-unit" = "Pa s", "x-range" = "> 0", "examples" = [10]))]
    pub normal_dashpot: Quantity,
    /// Viscosity eta_m of a contact in the tangential direction.
    #[schemars(extend("x-unit" = "Pa s", "x-range" = "≥ 0", "examples" = [5]))]
    pub tangential_dashpot: Quantity,
    /// `true`: incompressible; `false`: bulk viscosity B from equation (16).
    #[serde(default = "yes")]
    #[schemars(extend("examples" = [false]))]
    pub incompressible: bool,
}

/// A part of the domain and the material that fills it at the start.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the material.
    #[schemars(extend("x-range" = "a material", "examples" = ["sand"]))]
    pub material: String,
    /// Shape of the region.
    #[serde(default)]
    #[schemars(extend("examples" = [{ "circle": { "centre": [0, 1], "radius": 0.3 } }]))]
    pub shape: Shape,
    /// Initial directors; required for a layered material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "none", "examples" = [{ "angle_degrees": 45 }]))]
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
    #[schemars(extend("examples" = [{ "x": [0, 1], "y": [0, 0.5] }]))]
    Rectangle {
        /// Range along x: lower and upper end.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "in the domain; ascending",
            "examples" = [[0, 1]]
        ))]
        x: [Quantity; 2],
        /// Range along y: lower and upper end.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "in the domain; ascending",
            "examples" = [[0, "height/2"]]
        ))]
        y: [Quantity; 2],
    },
    /// A polygon: its corners, in order, each as `[x, y]`.
    Polygon(
        /// Corners in the order of the outline.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "three or more; the outline must not cross itself",
            "examples" = [[[0, 0], [1, 0], [0.5, 1]]]
        ))]
        Vec<[Quantity; 2]>,
    ),
    /// A circle.
    #[schemars(extend("examples" = [{ "centre": [0.5, 0.5], "radius": 0.25 }]))]
    Circle {
        /// Coordinates x and y of the centre.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "any; the circle must touch the domain",
            "examples" = [[0.5, 0.5]]
        ))]
        centre: [Quantity; 2],
        /// Radius.
        #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "examples" = [0.25]))]
        radius: Quantity,
    },
    /// The points where the expression in x and y is above zero (comparisons give 1 or 0).
    Where(
        /// Above zero inside the region; comparisons give 1 or 0.
        #[schemars(extend(
            "x-unit" = "1",
            "x-range" = "any",
            "examples" = ["y < 0.5 + 0.1*cos(pi*x)"]
        ))]
        Field,
    ),
}

/// Initial directors of a layered material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Director {
    /// Angle between the layer normal and the x axis; may depend on x and y.
    AngleDegrees(
        /// Angle between the layer normal and the x axis; may depend on x and y.
        #[schemars(extend("x-unit" = "degrees", "x-range" = "any", "examples" = ["90*x"]))]
        Field,
    ),
    /// Random directions, uniformly distributed over all angles and evenly over neighbouring
    /// particles; seeded by `accuracy.seed`.
    Random,
}

/// Directors of a layered material that enters through a side.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InflowDirector {
    /// Angle between the layer normal and the x axis; may depend on x and y.
    #[schemars(extend("x-unit" = "degrees", "x-range" = "any", "examples" = ["90*y"]))]
    pub angle_degrees: Field,
}

/// Boundary conditions at the four sides of the domain.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boundaries {
    /// Left side.
    #[serde(default)]
    #[schemars(extend(
        "x-default" = "`{ kind = \"free_slip\" }`",
        "examples" = [{ "kind": "no_slip" }]
    ))]
    pub left: Boundary,
    /// Right side.
    #[serde(default)]
    #[schemars(extend(
        "x-default" = "`{ kind = \"free_slip\" }`",
        "examples" = [{ "kind": "no_slip" }]
    ))]
    pub right: Boundary,
    /// Lower side.
    #[serde(default)]
    #[schemars(extend(
        "x-default" = "`{ kind = \"free_slip\" }`",
        "examples" = [{ "kind": "no_slip" }]
    ))]
    pub bottom: Boundary,
    /// Upper side.
    #[serde(default)]
    #[schemars(extend(
        "x-default" = "`{ kind = \"free_slip\" }`",
        "examples" = [{ "kind": "no_slip" }]
    ))]
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "`\"free_slip\"`", "examples" = ["no_slip"]))]
    pub kind: Option<BoundaryKind>,
    /// Slip length b of Navier's law, instead of `kind`: zero normal velocity, and the velocity along
    /// the wall, relative to it, is b times its derivative across; the traction is (eta/b) u.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.01]))]
    pub slip_length: Option<Quantity>,
    /// Coefficient of friction mu_w of Coulomb's law, instead of `kind`: zero normal velocity, and a
    /// traction along the wall of mu_w times the normal stress on it where material slides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.3]))]
    pub wall_friction: Option<Quantity>,
    /// Prescribed velocity along x; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m/s",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = [0.1]
    ))]
    pub velocity_x: Option<Field>,
    /// Prescribed velocity along y; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m/s",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = ["0.1 * (1 - x^2)"]
    ))]
    pub velocity_y: Option<Field>,
    /// Prescribed traction on the fluid along x; excludes `velocity_x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = [0]
    ))]
    pub traction_x: Option<Field>,
    /// Prescribed traction on the fluid along y; excludes `velocity_y`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = [-1e3]
    ))]
    pub traction_y: Option<Field>,
    /// Prescribed Cosserat rotation rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1/s",
        "x-range" = "any",
        "x-default" = "free (no couple)",
        "examples" = [0]
    ))]
    pub rotation: Option<Field>,
    /// Name of the material that enters where the side lets material in: where the normal velocity
    /// is given and points inwards, or where nothing holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "a material",
        "x-default" = "the background, or the only material",
        "examples" = ["sand"]
    ))]
    pub inflow: Option<String>,
    /// Directors of the material that enters; required for a layered material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "none", "examples" = [{ "angle_degrees": 45 }]))]
    pub inflow_director: Option<InflowDirector>,
    /// Parts of the side with other conditions, such as openings; the rest of the side is as the
    /// keys above say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend(
        "x-default" = "none",
        "examples" = [[{ "from": 0.2, "to": 0.4, "kind": "outflow" }]]
    ))]
    pub parts: Vec<BoundaryPart>,
}

/// A part of a side with its own boundary conditions: `kind` sets defaults that the other keys
/// override. Its ends become mesh lines. Where it meets the rest of the side, the conditions of
/// walls apply.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundaryPart {
    /// Coordinate of the lower or left end along the side: x at the bottom and top, y at the
    /// left and right.
    #[schemars(extend("x-unit" = "m", "x-range" = "on the side; < `to`", "examples" = [0.2]))]
    pub from: Quantity,
    /// Coordinate of the upper or right end along the side.
    #[schemars(extend("x-unit" = "m", "x-range" = "on the side; > `from`", "examples" = [0.4]))]
    pub to: Quantity,
    /// Kind of boundary condition; not `periodic`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "required, or `slip_length`, or `wall_friction`", "examples" = ["outflow"]))]
    pub kind: Option<BoundaryKind>,
    /// Slip length b of Navier's law, instead of `kind`: zero normal velocity, and the velocity along
    /// the wall, relative to it, is b times its derivative across; the traction is (eta/b) u.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.01]))]
    pub slip_length: Option<Quantity>,
    /// Coefficient of friction mu_w of Coulomb's law, instead of `kind`: zero normal velocity, and a
    /// traction along the wall of mu_w times the normal stress on it where material slides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.3]))]
    pub wall_friction: Option<Quantity>,
    /// Prescribed velocity along x; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m/s",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = [0.1]
    ))]
    pub velocity_x: Option<Field>,
    /// Prescribed velocity along y; may depend on x and y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m/s",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = ["0.1 * (1 - x^2)"]
    ))]
    pub velocity_y: Option<Field>,
    /// Prescribed traction on the fluid along x; excludes `velocity_x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = [0]
    ))]
    pub traction_x: Option<Field>,
    /// Prescribed traction on the fluid along y; excludes `velocity_y`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "Pa",
        "x-range" = "any",
        "x-default" = "by `kind`",
        "examples" = [-1e3]
    ))]
    pub traction_y: Option<Field>,
    /// Prescribed Cosserat rotation rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1/s",
        "x-range" = "any",
        "x-default" = "free (no couple)",
        "examples" = [0]
    ))]
    pub rotation: Option<Field>,
    /// Name of the material that enters where the side lets material in: where the normal velocity
    /// is given and points inwards, or where nothing holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "a material",
        "x-default" = "the background, or the only material",
        "examples" = ["sand"]
    ))]
    pub inflow: Option<String>,
    /// Directors of the material that enters; required for a layered material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "none", "examples" = [{ "angle_degrees": 45 }]))]
    pub inflow_director: Option<InflowDirector>,
}

/// The law of a wall that is written instead of its kind.
#[derive(Clone, Copy, Debug, Default)]
pub struct GivenWall<'a> {
    /// Slip length.
    pub slip_length: Option<&'a Quantity>,
    /// Coefficient of friction.
    pub wall_friction: Option<&'a Quantity>,
}

/// Implements `given` for types that have the keys of a wall.
macro_rules! given_wall {
    ($($type:ty),*) => {$(
        impl $type {
            /// The law of the wall that is written here.
            pub fn given(&self) -> GivenWall<'_> {
                GivenWall {
                    slip_length: self.slip_length.as_ref(),
                    wall_friction: self.wall_friction.as_ref(),
                }
            }
        }
    )*};
}
given_wall!(Wall, Block);

/// Conditions that are written for a side or for a part of it.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a> {
    /// Kind of boundary condition.
    pub kind: Option<BoundaryKind>,
    /// Law of the wall, instead of a kind.
    pub wall: GivenWall<'a>,
    /// Prescribed velocity along x and y.
    pub velocity: [Option<&'a Field>; 2],
    /// Prescribed traction along x and y.
    pub traction: [Option<&'a Field>; 2],
    /// Prescribed Cosserat rotation rate.
    pub rotation: Option<&'a Field>,
    /// Name of the material that enters.
    pub inflow: Option<&'a str>,
    /// Its directors.
    pub inflow_director: Option<&'a InflowDirector>,
}

/// Implements `given` for types that have the keys of a side.
macro_rules! given {
    ($($type:ty),*) => {$(
        impl $type {
            /// The conditions that are written here.
            pub fn given(&self) -> Given<'_> {
                Given {
                    kind: self.kind,
                    wall: GivenWall {
                        slip_length: self.slip_length.as_ref(),
                        wall_friction: self.wall_friction.as_ref(),
                    },
                    velocity: [self.velocity_x.as_ref(), self.velocity_y.as_ref()],
                    traction: [self.traction_x.as_ref(), self.traction_y.as_ref()],
                    rotation: self.rotation.as_ref(),
                    inflow: self.inflow.as_deref(),
                    inflow_director: self.inflow_director.as_ref(),
                }
            }
        }
    )*};
}
given!(Boundary, BoundaryPart);

impl Given<'_> {
    /// The kind, or its default.
    pub fn kind(&self) -> BoundaryKind {
        self.kind.unwrap_or_default()
    }
}

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
    /// Zero traction: fluid passes in any direction. What enters is `inflow`.
    Open,
    /// Zero normal traction and zero tangential velocity: fluid passes along the normal, as from a
    /// slit into the open air. What enters is `inflow`.
    Outflow,
    /// Joined to the opposite side, which must also be periodic.
    Periodic,
}

/// A thin wall along a mesh line between two points that have one coordinate in common.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Name of the wall.
    #[schemars(extend("examples" = ["floor"]))]
    pub name: String,
    /// Coordinates x and y of one end.
    #[schemars(extend("x-unit" = "m", "x-range" = "in the domain", "examples" = [[0, 0.5]]))]
    pub from: [Quantity; 2],
    /// Coordinates x and y of the other end.
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain; `x` or `y` as in `from`, or any with `thickness`",
        "examples" = [["aperture", 0.5]]
    ))]
    pub to: [Quantity; 2],
    /// Thickness of the wall. Walls that are not along x or y need one; with it, a wall is a solid that
    /// may cut through cells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "> 0",
        "x-default" = "none: along a mesh line",
        "examples" = [0.05]
    ))]
    pub thickness: Option<Quantity>,
    /// Kind of boundary condition on both faces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "`\"free_slip\"`", "examples" = ["no_slip"]))]
    pub kind: Option<WallKind>,
    /// Slip length b of Navier's law, instead of `kind`: zero normal velocity, and the velocity along
    /// the wall, relative to it, is b times its derivative across; the traction is (eta/b) u.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.01]))]
    pub slip_length: Option<Quantity>,
    /// Coefficient of friction mu_w of Coulomb's law, instead of `kind`: zero normal velocity, and a
    /// traction along the wall of mu_w times the normal stress on it where material slides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.3]))]
    pub wall_friction: Option<Quantity>,
    /// Prescribed Cosserat rotation rate on the wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1/s",
        "x-range" = "any",
        "x-default" = "free (no couple)",
        "examples" = [0]
    ))]
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

/// Shape of a solid.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolidShape {
    /// An axis-aligned rectangle.
    #[schemars(extend("examples" = [{ "x": [0, 1], "y": [0, 0.5] }]))]
    Rectangle {
        /// Range along x: lower and upper end.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "in the domain; ascending",
            "examples" = [[0, 1]]
        ))]
        x: [Quantity; 2],
        /// Range along y: lower and upper end.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "in the domain; ascending",
            "examples" = [[0, "height/2"]]
        ))]
        y: [Quantity; 2],
    },
    /// A polygon: its corners, in order, each as `[x, y]`.
    Polygon(
        /// Corners in the order of the outline.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "three or more; the outline must not cross itself",
            "examples" = [[[0, 0], [1, 0], [0.5, 1]]]
        ))]
        Vec<[Quantity; 2]>,
    ),
    /// A circle.
    #[schemars(extend("examples" = [{ "centre": [0.5, 0.5], "radius": 0.25 }]))]
    Circle {
        /// Coordinates x and y of the centre.
        #[schemars(extend(
            "x-unit" = "m",
            "x-range" = "any; the circle must touch the domain",
            "examples" = [[0.5, 0.5]]
        ))]
        centre: [Quantity; 2],
        /// Radius.
        #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "examples" = [0.25]))]
        radius: Quantity,
    },
}

/// A solid inside the domain: a rectangle along mesh lines (`x` and `y`) or any shape.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// Name of the block.
    #[schemars(extend("examples" = ["step"]))]
    pub name: String,
    /// Range along x: lower and upper end. Needs `y`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain; ascending",
        "x-default" = "given by `shape`",
        "examples" = [[0, 0.5]]
    ))]
    pub x: Option<[Quantity; 2]>,
    /// Range along y: lower and upper end. Needs `x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain; ascending",
        "x-default" = "given by `shape`",
        "examples" = [[0, 0.25]]
    ))]
    pub y: Option<[Quantity; 2]>,
    /// Shape of the solid, instead of `x` and `y`: `rectangle`, `polygon` or `circle`. It may cut
    /// through cells and reach out of the domain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "touching the domain",
        "x-default" = "given by `x` and `y`",
        "examples" = [{ "polygon": [[0, 0], [0.5, 0], [0, 0.5]] }]
    ))]
    pub shape: Option<SolidShape>,
    /// Velocity along x and y with which the block moves through the mesh, without turning: numbers, or
    /// expressions of the parameters and of the time `t` in s, such as `"0.1*(t > 2)"`. A block that moves
    /// may reach out of the domain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m/s", "x-range" = "any", "x-default" = "at rest", "examples" = [[0, "0.1*(t > 2)"]]))]
    pub velocity: Option<[Quantity; 2]>,
    /// Kind of boundary condition on its faces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "`\"free_slip\"`", "examples" = ["no_slip"]))]
    pub kind: Option<WallKind>,
    /// Slip length b of Navier's law, instead of `kind`: zero normal velocity, and the velocity along
    /// the wall, relative to it, is b times its derivative across; the traction is (eta/b) u.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.01]))]
    pub slip_length: Option<Quantity>,
    /// Coefficient of friction mu_w of Coulomb's law, instead of `kind`: zero normal velocity, and a
    /// traction along the wall of mu_w times the normal stress on it where material slides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0", "x-default" = "by `kind`", "examples" = [0.3]))]
    pub wall_friction: Option<Quantity>,
    /// Prescribed Cosserat rotation rate on its outline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1/s",
        "x-range" = "any",
        "x-default" = "free (no couple)",
        "examples" = [0]
    ))]
    pub rotation: Option<Quantity>,
}

/// A nozzle: a solid block, one cell thick, that pushes material in through one of its faces. An
/// incompressible fluid must be able to leave the domain elsewhere.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Name of the source.
    #[schemars(extend("examples" = ["spout"]))]
    pub name: String,
    /// Coordinates x and y of one end of the mouth of the nozzle.
    #[schemars(extend("x-unit" = "m", "x-range" = "in the domain", "examples" = [[0.75, 0.75]]))]
    pub from: [Quantity; 2],
    /// Coordinates x and y of the other end of the mouth.
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain; `x` or `y` as in `from`",
        "examples" = [[1, 0.75]]
    ))]
    pub to: [Quantity; 2],
    /// Name of the material that enters.
    #[schemars(extend("x-range" = "a material", "examples" = ["sand"]))]
    pub material: String,
    /// Speed with which it enters, the same along the mouth.
    #[schemars(extend("x-unit" = "m/s", "x-range" = "> 0", "examples" = [0.5]))]
    pub speed: Quantity,
    /// Direction in which it enters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "across the mouth",
        "x-default" = "`\"down\"` or `\"left\"`",
        "examples" = ["down"]
    ))]
    pub direction: Option<Direction>,
    /// Directors of the material; required for a layered material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "none", "examples" = [{ "angle_degrees": 45 }]))]
    pub director: Option<InflowDirector>,
    /// Time at which the source begins.
    #[serde(default = "zero")]
    #[schemars(extend("x-unit" = "s", "x-range" = "≥ 0", "examples" = [0.5]))]
    pub from_time: Quantity,
    /// Time at which the source ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "s",
        "x-range" = "> `from_time`",
        "x-default" = "never",
        "examples" = [4]
    ))]
    pub to_time: Option<Quantity>,
}

/// Velocity at the start of a scene with inertia. Its part with divergence is removed.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InitialVelocity {
    /// Velocity along x; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "m/s", "x-range" = "any", "examples" = ["sin(pi*x) * cos(pi*y)"]))]
    pub x: Field,
    /// Velocity along y; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend(
        "x-unit" = "m/s",
        "x-range" = "any",
        "examples" = ["-cos(pi*x) * sin(pi*y)"]
    ))]
    pub y: Field,
}

/// Pressure at a point, where the boundaries determine it only up to a constant.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureReference {
    /// Coordinates x and y of the point.
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain; outside blocks",
        "examples" = [[0.5, 1]]
    ))]
    pub at: [Quantity; 2],
    /// Pressure at the point.
    #[serde(default = "zero")]
    #[schemars(extend("x-unit" = "Pa", "x-range" = "any", "examples" = [1e5]))]
    pub value: Quantity,
}

/// Force and couple per volume, fixed in space.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyForce {
    /// Force per volume along x; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "N/m3", "x-range" = "any", "examples" = ["100*sin(pi*y)"]))]
    pub x: Field,
    /// Force per volume along y; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "N/m3", "x-range" = "any", "examples" = [-50]))]
    pub y: Field,
    /// Couple per volume, which acts on the Cosserat rotation; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "N m/m3", "x-range" = "any", "examples" = [2]))]
    pub couple: Field,
}

/// Acceleration fixed in space.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Acceleration {
    /// Acceleration along x; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "m/s2", "x-range" = "any", "examples" = ["4*x"]))]
    pub x: Field,
    /// Acceleration along y; may depend on x and y.
    #[serde(default = "zero_field")]
    #[schemars(extend("x-unit" = "m/s2", "x-range" = "any", "examples" = [-9.81]))]
    pub y: Field,
}

/// A line that measures the volume of a material that crosses it. Horizontal and vertical lines are mesh
/// lines; other lines may cross cells.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gauge {
    /// Name of the gauge.
    #[schemars(extend("examples" = ["outlet"]))]
    pub name: String,
    /// Coordinates x and y of one end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain",
        "x-default" = "none, with `on`",
        "examples" = [[0.9, 0.5]]
    ))]
    pub from: Option<[Quantity; 2]>,
    /// Coordinates x and y of the other end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "in the domain",
        "x-default" = "none, with `on`",
        "examples" = [[1.1, 0.5]]
    ))]
    pub to: Option<[Quantity; 2]>,
    /// Direction in which crossing counts as positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "across the line",
        "x-default" = "none, with `on`",
        "examples" = ["down"]
    ))]
    pub direction: Option<Direction>,
    /// Name of the material that is measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "a material",
        "x-default" = "none, with `on`",
        "examples" = ["sand"]
    ))]
    pub material: Option<String>,
    /// Side, wall or block whose force from all materials is measured, instead of a flow across a
    /// segment: `left`, `right`, `bottom`, `top` or a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-range" = "a side, a wall or a block",
        "x-default" = "none: a flow is measured",
        "examples" = ["step"]
    ))]
    pub on: Option<String>,
}

/// Quantity whose error is measured, and how the error is measured.
///
/// The error is `|q - q_ref| / max(|q_ref|, floor)`, where `|.|` is the norm over the domain for a
/// field and the magnitude for a number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Interest {
    /// Quantity whose error is measured.
    #[schemars(extend("examples" = [{ "gauge": "outlet" }]))]
    pub quantity: Interesting,
    /// Instant at which the quantity is evaluated.
    #[serde(default)]
    #[schemars(extend("examples" = ["end"]))]
    pub at: Moment,
    /// Norm used for fields.
    #[serde(default)]
    #[schemars(extend("examples" = ["max"]))]
    pub norm: Norm,
    /// Smallest reference value for the relative error.
    #[serde(default = "zero")]
    #[schemars(extend("x-unit" = "that of the quantity", "x-range" = "any", "examples" = [1e-3]))]
    pub floor: Quantity,
}

/// Quantities whose error can be measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Interesting {
    /// Volume that has crossed the gauge with this name, m2.
    Gauge(
        /// Name of the gauge whose volume is meant.
        #[schemars(extend("x-range" = "a gauge", "examples" = ["outlet"]))]
        String,
    ),
    /// Rate at which volume crosses the gauge with this name, m2/s.
    Rate(
        /// Name of the gauge whose rate is meant.
        #[schemars(extend("x-range" = "a gauge", "examples" = ["outlet"]))]
        String,
    ),
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
    #[schemars(extend(
        "x-default" = "none",
        "examples" = [{ "x": [0, 1], "y": [0, 1], "spacing": 0.1 }]
    ))]
    pub grid: Option<DyeGrid>,
    /// Single dye lines, each a list of points (x, y).
    #[serde(default)]
    #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [[[[0, 0.5], [1, 0.5]]]]))]
    pub lines: Vec<Vec<[Quantity; 2]>>,
    /// Segments; particles within `width/2` of one are drawn in another colour.
    #[serde(default)]
    #[schemars(extend("examples" = [[{ "from": [0, 0], "to": [1, 0], "width": 0.05 }]]))]
    pub marks: Vec<DyeMark>,
}

/// Dye lines at x = x0 + i spacing and y = y0 + j spacing inside a rectangle.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DyeGrid {
    /// Range along x: lower and upper end.
    #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [[0, 2]]))]
    pub x: [Quantity; 2],
    /// Range along y: lower and upper end.
    #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [[0, 1]]))]
    pub y: [Quantity; 2],
    /// Distance between lines.
    #[schemars(extend(
        "x-unit" = "m",
        "x-range" = "> 0; at most 1000 lines each way",
        "examples" = [0.1]
    ))]
    pub spacing: Quantity,
}

/// Segment whose particles are marked at the start.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DyeMark {
    /// Coordinates x and y of one end.
    #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [[0, 0.5]]))]
    pub from: [Quantity; 2],
    /// Coordinates x and y of the other end.
    #[schemars(extend("x-unit" = "m", "x-range" = "any", "examples" = [[1, 0.5]]))]
    pub to: [Quantity; 2],
    /// Width of the marked strip.
    #[schemars(extend("x-unit" = "m", "x-range" = "> 0", "examples" = [0.05]))]
    pub width: Quantity,
}

/// End time and limits of the time step.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// End time; required unless the flow is steady.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "s",
        "x-range" = "> 0",
        "x-default" = "required unless `steady`",
        "examples" = [10]
    ))]
    pub end: Option<Quantity>,
    /// Whether only the flow of the initial layout is solved, to its steady state: no material
    /// moves and no time passes, so the other keys of `[time]` are not used. Not with inertia.
    #[serde(default, skip_serializing_if = "is_false")]
    #[schemars(extend("x-default" = "`false`", "examples" = [true]))]
    pub steady: bool,
    /// Largest time step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "s",
        "x-range" = "> 0",
        "x-default" = "no limit",
        "examples" = [0.05]
    ))]
    pub max_step: Option<Quantity>,
    /// Largest error of the displacements of the materials of interest (all but the background) in
    /// a step. It determines the step unless `courant`, `strain` or `max_step` demand a
    /// shorter one.
    #[serde(default = "step_tolerance_default")]
    #[schemars(extend("x-unit" = "cells", "x-range" = "> 0, ≤ 1", "examples" = [0.05]))]
    pub tolerance: f64,
    /// Largest number of cells that the materials of interest cross in a step (Courant number);
    /// cells made smaller by grading count less.
    #[serde(default = "courant_default")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0, ≤ 50", "examples" = [1]))]
    pub courant: f64,
    /// Largest strain of layered material in a step.
    #[serde(default = "strain_default")]
    #[schemars(extend("x-unit" = "1", "x-range" = "> 0, ≤ 10", "examples" = [0.1]))]
    pub strain: f64,
}

/// Settings that determine the accuracy.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Number of cells per `domain.length_scale`.
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "≥ 1; at most 4096 along a side, 1000000 in all",
        "examples" = [64]
    ))]
    pub cells: u32,
    /// Number of particles per cell at the start.
    #[schemars(extend("x-unit" = "1", "x-range" = "1 to 1024; a square", "examples" = [25]))]
    pub particles_per_cell: u32,
    /// Positions of the particles at the start.
    #[schemars(extend("examples" = ["jittered"]))]
    pub placement: Placement,
    /// Quadrature in cells.
    #[schemars(extend("examples" = ["laminate"]))]
    pub quadrature: Quadrature,
    /// Time integration scheme.
    #[schemars(extend("examples" = ["midpoint"]))]
    pub integrator: Integrator,
    /// Fraction of the next step by which the load of a stable stratification (heavy below light)
    /// is evaluated ahead, so that large steps do not oscillate: 0.6 to 1; 0 switches it off. It
    /// acts only in scenes with gravity and more than one density, and does not change the order in
    /// time.
    #[schemars(extend(
        "x-unit" = "steps",
        "x-range" = "0 to 2",
        "examples" = [1]
    ))]
    pub stabilisation: f64,
    /// Tolerance of the solver for the relative residual and the relative divergence.
    #[schemars(extend("x-unit" = "1", "x-range" = "1e-14 to 1e-2", "examples" = [1e-10]))]
    pub tolerance: f64,
    /// Tolerance of the iteration for materials with friction, a yield stress or a flow index: the
    /// estimated error of the flow relative to the flow, in the norm of the dissipated power.
    #[schemars(extend("x-unit" = "1", "x-range" = "1e-10 to 0.1", "examples" = [1e-4]))]
    pub nonlinear_tolerance: f64,
    /// Largest number of corrections (iterations) before the solver reports no convergence.
    #[schemars(extend("x-unit" = "1", "x-range" = "1 to 10000", "examples" = [100]))]
    pub max_corrections: u32,
    /// Seed of the random numbers.
    #[schemars(extend("x-unit" = "1", "x-range" = "≥ 0", "examples" = [2]))]
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
    #[schemars(extend("x-unit" = "1", "x-range" = "0 to 1000000", "examples" = [50]))]
    pub frames: u32,
    /// Additional times of frames; the run steps to them exactly.
    #[schemars(extend(
        "x-unit" = "s",
        "x-range" = "≥ 0; ≤ `time.end`",
        "examples" = [[0.5, "2*period"]]
    ))]
    pub times: Vec<Quantity>,
    /// Quantity that colours the particles.
    #[schemars(extend("examples" = ["speed"]))]
    pub colour_by: ColourBy,
    /// Largest number of particles per frame. If there are more, so many of them are written, evenly
    /// chosen, and the summary states this.
    #[schemars(extend("x-unit" = "1", "x-range" = "≥ 0", "examples" = [100000]))]
    pub max_particles: u32,
    /// Fields written on a grid in each frame.
    #[schemars(extend("examples" = [["speed", "pressure"]]))]
    pub fields: Vec<FieldName>,
    /// Number of director strokes across the width of the domain.
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "≥ 0; at most 2000 along the longer side",
        "examples" = [48]
    ))]
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
    /// Time of the change; excludes `step`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "s",
        "x-range" = "ascending",
        "x-default" = "none",
        "examples" = [0.5]
    ))]
    pub time: Option<Quantity>,
    /// Number of the step of the change; excludes `time`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend(
        "x-unit" = "1",
        "x-range" = "≥ 0; ascending",
        "x-default" = "none",
        "examples" = [100]
    ))]
    pub step: Option<u64>,
    /// New values: parameters by name, other keys by path, for example
    /// `{ alpha = 0.5, "materials.grains.density" = 1e6, "gravity[1]" = -5 }`.
    #[schemars(extend(
        "x-unit" = "as the key",
        "x-range" = "as the key",
        "examples" = [{ "alpha": 0.5, "gravity[1]": -5 }]
    ))]
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
/// In the default silo, a growth of 1.75 needs 11 % fewer cells than 1.5 and 28 % fewer than 1.3, and the initial
/// discharge is 0.02 and 0.04 % smaller.
fn growth_default() -> f64 {
    1.75
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
