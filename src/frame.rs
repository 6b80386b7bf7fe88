//! What is shown of a simulation: immutable snapshots, in SI units, y up.
//!
//! Nothing here knows how it is drawn. [`RunInfo`] says what does not change
//! during a run, a [`Frame`] what one step brought.

/// What one step brought. Most steps bring scalars only.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Number of the step, from 0.
    pub step: u64,
    /// Simulated time (s).
    pub time_s: f64,
    /// Time spent computing so far (s).
    pub wall_s: f64,
    /// What is drawn in space; `None` leaves the last picture standing.
    pub picture: Option<Picture>,
    /// Numbers for the plots.
    pub scalars: Vec<Scalar>,
    /// Lines for the log.
    pub warnings: Vec<String>,
}

/// Everything drawn in space at one instant. What is empty here is wiped off.
#[derive(Debug, Clone, Default)]
pub struct Picture {
    /// The grains.
    pub particles: ParticleSnapshot,
    /// Polylines of dyed material (m).
    pub dye_lines: Vec<Vec<[f32; 2]>>,
    /// Headless strokes of the director, from end to end (m).
    pub glyphs: Vec<[[f32; 2]; 2]>,
    /// Values on regular grids.
    pub fields: Vec<GridField>,
    /// Arrows upon one of the fields.
    pub arrows: Option<Arrows>,
    /// Level lines.
    pub isolines: Vec<Isoline>,
}

/// Particles at one instant. Their number may change from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct ParticleSnapshot {
    /// Positions (m).
    pub positions: Vec<[f32; 2]>,
    /// Material of each particle: an index into [`RunInfo::materials`].
    pub class: Vec<u16>,
    /// What colours the particles; `None` colours them by material.
    pub scalar: Option<ParticleScalar>,
}

/// One number per particle, and the scale it is read on.
#[derive(Debug, Clone)]
pub struct ParticleScalar {
    /// The scale; [`RunInfo::particle_quantity`] names it.
    pub range: [f32; 2],
    /// One value per particle.
    pub values: Vec<f32>,
}

/// Values on a regular grid of cells.
#[derive(Debug, Clone)]
pub struct GridField {
    /// Which of [`RunInfo::fields`] this is, by name.
    pub name: String,
    /// Lower left corner of the first cell (m).
    pub origin: [f32; 2],
    /// Size of a cell (m).
    pub cell: [f32; 2],
    /// Number of cells along x.
    pub nx: usize,
    /// Number of cells along y.
    pub ny: usize,
    /// `nx * ny` values, row 0 at the lowest y; NaN where there is nothing.
    pub values: Vec<f32>,
    /// Values at the two ends of the colour scale.
    pub range: [f32; 2],
}

/// Vectors at points, drawn upon a field.
#[derive(Debug, Clone)]
pub struct Arrows {
    /// Name of the field.
    pub field: String,
    /// Where they start (m).
    pub origins: Vec<[f32; 2]>,
    /// As drawn: lengths are those of the picture, proportional to the vectors.
    pub vectors: Vec<[f32; 2]>,
}

/// Lines of one level of one field.
#[derive(Debug, Clone)]
pub struct Isoline {
    /// Name of the quantity. If it is one of [`RunInfo::fields`], the lines
    /// are drawn upon that field, else upon the flow.
    pub field: String,
    /// The level, in the unit of the field.
    pub level: f32,
    /// Polylines (m).
    pub strips: Vec<Vec<[f32; 2]>>,
}

/// One number of one step.
#[derive(Debug, Clone)]
pub struct Scalar {
    /// Where it belongs, such as `gauges/outflow/volume`.
    pub path: String,
    /// The value, in the unit of its [`Series`].
    pub value: f64,
}

impl Scalar {
    /// A number and where it belongs.
    pub fn new(path: impl Into<String>, value: f64) -> Self {
        Self { path: path.into(), value }
    }
}

/// What does not change during a run.
#[derive(Debug, Clone, Default)]
pub struct RunInfo {
    /// Short name; entities live under `runs/<name>`.
    pub name: String,
    /// Identity of the recording. Recordings that share it merge in a viewer.
    pub recording_id: String,
    /// What is looked at.
    pub domain: Rect,
    /// Walls and obstacles.
    pub walls: Vec<Outline>,
    /// Lines through which flow is measured.
    pub gauges: Vec<Outline>,
    /// Materials, in the order of the class numbers.
    pub materials: Vec<Material>,
    /// Radius at which particles are drawn (m).
    pub particle_radius: f32,
    /// What [`ParticleSnapshot::scalar`] is, if this run has it.
    pub particle_quantity: Option<Quantity>,
    /// Fields that pictures may carry; each has a view.
    pub fields: Vec<Quantity>,
    /// Plots against time; each has a view.
    pub plots: Vec<Plot>,
    /// The resolved scene, as TOML.
    pub scene_toml: String,
    /// What is solved and why, as Markdown.
    pub plan_markdown: String,
}

/// An upright rectangle (m).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rect {
    /// Lower left corner.
    pub min: [f32; 2],
    /// Upper right corner.
    pub max: [f32; 2],
}

impl Rect {
    /// Width and height.
    pub fn size(&self) -> [f32; 2] {
        [self.max[0] - self.min[0], self.max[1] - self.min[1]]
    }
}

/// A named polyline.
#[derive(Debug, Clone)]
pub struct Outline {
    /// Shown beside gauges, and on hovering over walls.
    pub name: String,
    /// Its corners (m).
    pub points: Vec<[f32; 2]>,
}

/// A material and the colour it is drawn in.
#[derive(Debug, Clone)]
pub struct Material {
    /// Its name.
    pub name: String,
    /// Its colour (sRGB).
    pub rgb: [u8; 3],
    /// Its particles are in the pictures: it belongs into the legend.
    pub drawn: bool,
}

/// A quantity that is shown by colour.
#[derive(Debug, Clone)]
pub struct Quantity {
    /// Its name, such as `speed`.
    pub name: String,
    /// Its unit, such as `m/s`; empty for pure numbers.
    pub unit: String,
    /// Whether its sign matters: then zero is white, and the scale symmetric.
    pub signed: bool,
}

impl Quantity {
    /// Name and unit, as a title.
    pub fn title(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{} ({})", self.name, self.unit)
        }
    }
}

/// Curves that share a plot.
#[derive(Debug, Clone)]
pub struct Plot {
    /// Title, with the unit if the curves share one.
    pub title: String,
    /// The curves.
    pub series: Vec<Series>,
    /// Whether the decimal logarithm of the magnitude is drawn.
    pub log10: bool,
}

/// A curve over time.
#[derive(Debug, Clone)]
pub struct Series {
    /// The [`Scalar::path`] it collects.
    pub path: String,
    /// Its name in the legend, with the unit.
    pub name: String,
}

impl Series {
    /// A curve of the numbers at `path`.
    pub fn new(path: impl Into<String>, name: impl Into<String>) -> Self {
        Self { path: path.into(), name: name.into() }
    }
}
