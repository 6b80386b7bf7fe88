//! This module defines the immutable snapshots of a simulation that are recorded and displayed, in
//! SI units, y up.
//!
//! Snapshots do not depend on how they are drawn. [`RunInfo`] holds what is constant during a run;
//! a [`Frame`] holds the results of one step.

pub mod thinning;

/// Results of one step. Most steps have scalars only.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Number of the step, from 0.
    pub step: u64,
    /// Simulated time (s).
    pub time_s: f64,
    /// Wall-clock time of the computation so far (s).
    pub wall_s: f64,
    /// Everything drawn in space; `None` keeps the previous snapshot.
    pub snapshot: Option<Snapshot>,
    /// Values for the plots against time.
    pub scalars: Vec<Scalar>,
    /// Messages for the log, one line each.
    pub warnings: Vec<String>,
}

/// Everything drawn in space at one instant. An empty list clears what was drawn before.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// The particles.
    pub particles: ParticleSnapshot,
    /// Dye lines as polylines (m).
    pub dye_lines: Vec<Vec<[f32; 2]>>,
    /// Director strokes, each given by its two end points (m).
    pub glyphs: Vec<[[f32; 2]; 2]>,
    /// Fields on regular grids.
    pub fields: Vec<GridField>,
    /// Arrows drawn on one of the fields.
    pub arrows: Option<Arrows>,
    /// Isolines of fields.
    pub isolines: Vec<Isoline>,
    /// Stresses along surfaces whose forces are measured.
    pub stresses: Vec<SurfaceStress>,
    /// Closed outlines of the solids that move (m).
    pub moving: Vec<Vec<[f32; 2]>>,
    /// Circles about the axis of a round flow on which the material rotates.
    pub rings: Vec<Ring>,
}

/// Circle about the axis of a round flow, with the Cosserat rotation of the material on it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ring {
    /// Distance from the axis, and height (m).
    pub at: [f32; 2],
    /// Rotation (1/s) about the direction of the circle; positive from x to y.
    pub rotation: f32,
}

/// Stresses of the materials along the surface of a side, a wall or a block.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceStress {
    /// Name of the gauge of its force.
    pub name: String,
    /// Places on it, in the order of their position along it.
    pub points: Vec<SurfacePoint>,
}

/// Stress of the materials at a place on a surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SurfacePoint {
    /// Position along the surface (m).
    pub along: f32,
    /// Position (m).
    pub at: [f32; 2],
    /// Unit normal into the material.
    pub normal: [f32; 2],
    /// Normal stress on the surface (Pa); positive where the material presses on it.
    pub pressing: f32,
    /// Shear stress on the surface (Pa), along the normal turned counter-clockwise by a right angle.
    pub shear: f32,
}

impl SurfacePoint {
    /// Force per area on the surface (Pa).
    pub fn traction(&self) -> [f32; 2] {
        let [x, y] = self.normal;
        [-self.pressing * x - self.shear * y, -self.pressing * y + self.shear * x]
    }
}

/// Particles at one instant. Their number may differ between pictures.
#[derive(Debug, Clone, Default)]
pub struct ParticleSnapshot {
    /// Positions (m).
    pub positions: Vec<[f32; 2]>,
    /// Material of each particle: an index into [`RunInfo::materials`].
    pub class: Vec<u16>,
    /// Radius at which each particle is drawn (m): that of a disc of the volume it carries.
    pub radii: Vec<f32>,
    /// Quantity that colours the particles; `None` colours them by material.
    pub scalar: Option<ParticleScalar>,
}

/// One value per particle, and its colour scale.
#[derive(Debug, Clone)]
pub struct ParticleScalar {
    /// Values at the two ends of the colour scale, in the unit of [`RunInfo::particle_quantity`].
    pub range: [f32; 2],
    /// One value per particle.
    pub values: Vec<f32>,
}

/// Values on a regular grid of cells.
#[derive(Debug, Clone)]
pub struct GridField {
    /// Name of the field in [`RunInfo::fields`].
    pub name: String,
    /// Lower left corner of the first cell (m).
    pub origin: [f32; 2],
    /// Size of a cell (m).
    pub cell: [f32; 2],
    /// Number of cells along x.
    pub nx: usize,
    /// Number of cells along y.
    pub ny: usize,
    /// `nx * ny` values, row 0 at the lowest y; NaN where there is no value.
    pub values: Vec<f32>,
    /// Values at the two ends of the colour scale.
    pub range: [f32; 2],
}

/// Smallest and largest finite value; `None` if there is none.
pub fn extent(values: &[f32]) -> Option<[f32; 2]> {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    Some([finite().reduce(f32::min)?, finite().reduce(f32::max)?])
}

impl GridField {
    /// Centre of a cell (m), by the number of its value.
    pub fn centre(&self, k: usize) -> [f32; 2] {
        let at = |c: usize, i: usize| self.origin[c] + (i as f32 + 0.5) * self.cell[c];
        [at(0, k % self.nx), at(1, k / self.nx)]
    }

    /// The rectangle that the cells fill.
    pub fn rect(&self) -> Rect {
        let [x, y] = self.origin;
        let [dx, dy] = self.cell;
        Rect { min: [x, y], max: [x + dx * self.nx as f32, y + dy * self.ny as f32] }
    }

    /// The value at a point (m) by bilinear interpolation between cell centres; NaN outside the
    /// grid and where cells without a value have more than half of the weight.
    pub fn at(&self, point: [f32; 2]) -> f32 {
        let rect = self.rect();
        let outside = |c: usize| {
            let room = 1e-3 * self.cell[c];
            point[c] < rect.min[c] - room || point[c] > rect.max[c] + room
        };
        if self.nx * self.ny == 0 || outside(0) || outside(1) {
            return f32::NAN;
        }
        self.between(self.place(0, point[0]), self.place(1, point[1]))
    }

    /// Index of the cell centre before a coordinate, and the position of the coordinate between it
    /// and the next centre, 0 to 1.
    fn place(&self, c: usize, x: f32) -> (usize, f32) {
        let n = [self.nx, self.ny][c];
        let t = ((x - self.origin[c]) / self.cell[c] - 0.5).clamp(0.0, (n - 1) as f32);
        let i = (t as usize).min(n.saturating_sub(2));
        (i, t - i as f32)
    }

    fn between(&self, (i, s): (usize, f32), (j, t): (usize, f32)) -> f32 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (di, dj, weight) in [
            (0, 0, (1.0 - s) * (1.0 - t)),
            (1, 0, s * (1.0 - t)),
            (0, 1, (1.0 - s) * t),
            (1, 1, s * t),
        ] {
            let (i, j) = ((i + di).min(self.nx - 1), (j + dj).min(self.ny - 1));
            let value = self.values[j * self.nx + i];
            if value.is_finite() {
                sum += weight * value;
                total += weight;
            }
        }
        if total >= 0.5 { sum / total } else { f32::NAN }
    }

    /// The field interpolated to another grid of `nx` times `ny` cells that fill `rect`.
    pub fn on(&self, rect: Rect, nx: usize, ny: usize) -> GridField {
        let size = rect.size();
        let cell = [size[0] / nx.max(1) as f32, size[1] / ny.max(1) as f32];
        let centre = |c: usize, k: usize| rect.min[c] + (k as f32 + 0.5) * cell[c];
        let inside = |k: usize| {
            let (low, high) = (self.rect().min[k], self.rect().max[k]);
            rect.min[k] >= low && rect.max[k] <= high
        };
        let values = if self.nx * self.ny > 0 && inside(0) && inside(1) {
            let columns: Vec<_> = (0..nx).map(|i| self.place(0, centre(0, i))).collect();
            let row = |j: usize| {
                let row = self.place(1, centre(1, j));
                columns.iter().map(move |&column| self.between(column, row))
            };
            (0..ny).flat_map(row).collect()
        } else {
            (0..nx * ny).map(|k| self.at([centre(0, k % nx), centre(1, k / nx)])).collect()
        };
        GridField {
            name: self.name.clone(),
            origin: rect.min,
            cell,
            nx,
            ny,
            values,
            range: self.range,
        }
    }
}

/// Vectors at points, drawn on a field.
#[derive(Debug, Clone)]
pub struct Arrows {
    /// Name of the field.
    pub field: String,
    /// Start points (m).
    pub origins: Vec<[f32; 2]>,
    /// Vectors as drawn (m): their drawn lengths are proportional to the quantity.
    pub vectors: Vec<[f32; 2]>,
}

/// Isoline of one field at one level.
#[derive(Debug, Clone)]
pub struct Isoline {
    /// Name of the quantity. If it is one of [`RunInfo::fields`], the lines are drawn on that
    /// field, otherwise on the flow.
    pub field: String,
    /// The level, in the unit of the field.
    pub level: f32,
    /// Polylines (m).
    pub strips: Vec<Vec<[f32; 2]>>,
}

/// One scalar result of one step.
#[derive(Debug, Clone)]
pub struct Scalar {
    /// Path in the recording, such as `gauges/outflow/volume`.
    pub path: String,
    /// The value, in the unit of its [`Series`].
    pub value: f64,
}

impl Scalar {
    /// A value and its path in the recording.
    pub fn new(path: impl Into<String>, value: f64) -> Self {
        Self { path: path.into(), value }
    }
}

/// Everything that is constant during a run.
#[derive(Debug, Clone, Default)]
pub struct RunInfo {
    /// Short name of the run; its entities have paths below `runs/<name>`.
    pub name: String,
    /// Identifier of the recording. A viewer merges recordings with the same identifier.
    pub recording_id: String,
    /// The domain of the simulation (m).
    pub domain: Rect,
    /// Whether the flow is round: x is the distance from the axis.
    pub round: bool,
    /// Walls, sides of blocks and sides of the domain.
    pub walls: Vec<Outline>,
    /// Gauges: lines through which the flow is measured.
    pub gauges: Vec<Outline>,
    /// Materials, in the order of [`ParticleSnapshot::class`].
    pub materials: Vec<Material>,
    /// Half the distance of particles at the start (m): the radius at which particles without a
    /// radius of their own are drawn.
    pub particle_radius: f32,
    /// Quantity of [`ParticleSnapshot::scalar`], if this run records it.
    pub particle_quantity: Option<Quantity>,
    /// Fields that pictures may contain; each has a view.
    pub fields: Vec<Quantity>,
    /// Plots against time; each has a view.
    pub plots: Vec<Plot>,
    /// The resolved scene, as TOML.
    pub scene_toml: String,
    /// List of the solved effects with reasons, as Markdown.
    pub plan_markdown: String,
}

/// An axis-aligned rectangle (m).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rect {
    /// Lower left corner (m).
    pub min: [f32; 2],
    /// Upper right corner (m).
    pub max: [f32; 2],
}

impl Rect {
    /// Width and height (m).
    pub fn size(&self) -> [f32; 2] {
        [self.max[0] - self.min[0], self.max[1] - self.min[1]]
    }

    /// The smallest rectangle that contains both.
    pub fn around(self, other: Rect) -> Rect {
        let pick = |c: usize| (self.min[c].min(other.min[c]), self.max[c].max(other.max[c]));
        let ((x0, x1), (y0, y1)) = (pick(0), pick(1));
        Rect { min: [x0, y0], max: [x1, y1] }
    }

    /// Intersection of both; `None` if it has no area.
    pub fn common(self, other: Rect) -> Option<Rect> {
        let pick = |c: usize| (self.min[c].max(other.min[c]), self.max[c].min(other.max[c]));
        let ((x0, x1), (y0, y1)) = (pick(0), pick(1));
        (x0 < x1 && y0 < y1).then_some(Rect { min: [x0, y0], max: [x1, y1] })
    }
}

/// A named polyline.
#[derive(Debug, Clone)]
pub struct Outline {
    /// Name, shown beside gauges and when the pointer is on a wall.
    pub name: String,
    /// Points of the polyline (m).
    pub points: Vec<[f32; 2]>,
}

/// A material and its colour.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name of the material.
    pub name: String,
    /// Colour (sRGB).
    pub rgb: [u8; 3],
    /// Whether its particles are drawn; if so, the legend lists it.
    pub drawn: bool,
}

/// A quantity that is shown by colour.
#[derive(Debug, Clone)]
pub struct Quantity {
    /// Name, such as `speed`.
    pub name: String,
    /// Unit, such as `m/s`; empty for dimensionless quantities.
    pub unit: String,
    /// Whether the sign matters; if so, zero is white and the colour scale symmetric.
    pub signed: bool,
    /// Ends of the colour scale, if they do not follow the values.
    pub ends: Option<[f32; 2]>,
}

impl Quantity {
    /// Title made of the name and the unit.
    pub fn title(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{} ({})", self.name, self.unit)
        }
    }
}

/// A plot against time with one or more curves.
#[derive(Debug, Clone)]
pub struct Plot {
    /// Title, with the unit if the curves share one.
    pub title: String,
    /// The curves.
    pub series: Vec<Series>,
    /// Whether the decimal logarithm of the magnitude is drawn.
    pub log10: bool,
}

/// A curve against time.
#[derive(Debug, Clone)]
pub struct Series {
    /// [`Scalar::path`] of the values.
    pub path: String,
    /// Name in the legend, with the unit.
    pub name: String,
}

impl Series {
    /// A curve of the values at `path`, with its name in the legend.
    pub fn new(path: impl Into<String>, name: impl Into<String>) -> Self {
        Self { path: path.into(), name: name.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(nx: usize, ny: usize) -> GridField {
        let cell = [2.0 / nx as f32, 1.0 / ny as f32];
        let value = |k: usize| {
            let (i, j) = (k % nx, k / nx);
            3.0 * (i as f32 + 0.5) * cell[0] - (j as f32 + 0.5) * cell[1]
        };
        GridField {
            name: "plane".into(),
            origin: [0.0, 0.0],
            cell,
            nx,
            ny,
            values: (0..nx * ny).map(value).collect(),
            range: [0.0, 1.0],
        }
    }

    #[test]
    fn a_plane_is_the_same_on_other_grids() {
        let fine = plane(40, 30);
        let coarse = fine.on(fine.rect(), 7, 5);
        for (a, b) in coarse.values.iter().zip(&plane(7, 5).values) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
    }

    #[test]
    fn interpolation_without_enough_values_gives_nan() {
        let mut field = plane(4, 4);
        field.values[0] = f32::NAN;
        assert!(field.at([0.25, 0.125]).is_nan());
        assert!(field.at([0.9, 0.3]).is_finite());
        assert!(field.at([-0.1, 0.3]).is_nan());
    }
}
