//! This module computes which part of a cell each region fills, to rounding. The initial particles
//! represent these parts.
//!
//! Parallel lines sample a cell. The boundaries between regions on a line are computed exactly (for
//! rectangles and circles) or by bisection (for expressions), so the position of an interface is
//! accurate far below the particle spacing. The lines are parallel to `y` or to `x`, depending on
//! which direction crosses more boundaries.

use crate::plan::{Area, Plan};
use crate::space::shape::GAUSS_3;
use crate::space::shape::GAUSS_3_WEIGHTS;

/// Smaller fractions of a cell are rounding errors of coordinates.
const SLIVER: f64 = 1e-9;
/// Number of intervals per line at whose ends expressions are evaluated; smaller drops may be
/// missed.
const PROBES: usize = 12;
/// Number of intervals across a cell, with two lines each.
const PIECES: usize = 6;
/// Number of intervals across a cut cell: more, because boundaries may leave it through other
/// sides.
const FINE_PIECES: usize = 24;
/// Number of bisections of an interval of [`PROBES`], which give rounding accuracy.
const HALVINGS: usize = 50;
/// Two-point Gauss quadrature on `[0, 1]`.
const GAUSS_2: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

/// Index of the region at a point, or `None` in the background.
pub type Filling = Option<usize>;

/// A sample point of a cell, with the area that it represents.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Reference coordinates.
    pub r: [f64; 2],
    /// Fraction of the cell's area.
    pub share: f64,
    /// Region at the point.
    pub filling: Filling,
}

/// The last region that contains an SI point; later regions cover earlier ones.
pub fn filling(plan: &Plan, si: [f64; 2]) -> Filling {
    plan.regions.iter().rposition(|r| r.shape.contains(si))
}

/// Sample points of a cell; empty if a single region fills the cell.
pub fn samples(plan: &Plan, cell: usize) -> Vec<Sample> {
    let sampler = Sampler::new(plan, cell);
    if sampler.shapes.is_empty() {
        return Vec::new();
    }
    let [columns, rows] = [1, 0].map(|along| sampler.sweep(along, PIECES));
    if columns.is_uniform() && rows.is_uniform() {
        return Vec::new();
    }
    let along = usize::from(columns.crossings >= rows.crossings);
    sampler.sweep(along, FINE_PIECES).samples
}

/// A cell and the shapes that may have a boundary in it.
struct Sampler<'a> {
    plan: &'a Plan,
    /// SI coordinates of the sides of the cell, by axis.
    range: [[f64; 2]; 2],
    shapes: Vec<&'a Area>,
    /// Whether some of the shapes are expressions.
    probing: bool,
}

/// Samples on a set of parallel lines.
#[derive(Default)]
struct Sweep {
    samples: Vec<Sample>,
    /// Number of boundaries that the lines crossed.
    crossings: usize,
}

impl Sweep {
    fn is_uniform(&self) -> bool {
        self.crossings == 0 && self.samples.windows(2).all(|w| w[0].filling == w[1].filling)
    }
}

impl<'a> Sampler<'a> {
    fn new(plan: &'a Plan, cell: usize) -> Self {
        let (i, j) = plan.mesh.cell_ij(cell);
        let range = [(&plan.mesh.x, i), (&plan.mesh.y, j)]
            .map(|(axis, k)| [axis.lines()[k], axis.lines()[k + 1]].map(|c| c * plan.units.length));
        let shapes: Vec<_> =
            plan.regions.iter().map(|r| &r.shape).filter(|s| may_cut(s, range)).collect();
        let probing = shapes.iter().any(|s| matches!(s, Area::Where(_)));
        Sampler { plan, range, shapes, probing }
    }

    /// Samples lines parallel to axis `along`, two in each of `pieces` intervals of the other axis.
    /// Sides of shapes divide the intervals further.
    fn sweep(&self, along: usize, pieces: usize) -> Sweep {
        let across = 1 - along;
        let mut cuts: Vec<f64> = (0..=pieces).map(|k| k as f64 / pieces as f64).collect();
        for shape in &self.shapes {
            match shape {
                Area::Rectangle { x, y } => {
                    cuts.extend([x, y][across].map(|c| self.fraction(across, c)));
                }
                Area::Circle { centre, radius } => {
                    for c in [centre[across] - radius, centre[across] + radius] {
                        cuts.push(self.fraction(across, c));
                    }
                }
                Area::Polygon(outline) => {
                    cuts.extend(outline.line().iter().map(|p| self.fraction(across, p[across])));
                }
                Area::Everywhere | Area::Where(_) => {}
            }
        }
        tidy(&mut cuts);
        let mut out = Sweep::default();
        for piece in cuts.windows(2) {
            let width = piece[1] - piece[0];
            for g in GAUSS_2 {
                let at = piece[0] + g * width;
                let parts = self.line(along, at);
                out.crossings += parts.len() - 1;
                for ([from, to], filling) in parts {
                    for (x, w) in GAUSS_3.iter().zip(GAUSS_3_WEIGHTS) {
                        let t = 0.5 * (from + to) + 0.5 * (to - from) * x;
                        let mut r = [2.0 * at - 1.0; 2];
                        r[along] = 2.0 * t - 1.0;
                        let share = 0.5 * width * (to - from) * w;
                        out.samples.push(Sample { r, share, filling });
                    }
                }
            }
        }
        out
    }

    /// Intervals of a line with one filling, ascending, as fractions of the cell.
    fn line(&self, along: usize, at: f64) -> Vec<([f64; 2], Filling)> {
        let across = 1 - along;
        let c = self.coordinate(across, at);
        let mut cuts = vec![0.0, 1.0];
        for shape in &self.shapes {
            match shape {
                Area::Rectangle { x, y } => {
                    cuts.extend([x, y][along].map(|c| self.fraction(along, c)));
                }
                Area::Circle { centre, radius } => {
                    let half2 = radius * radius - (c - centre[across]).powi(2);
                    if half2 > 0.0 {
                        for s in [-1.0, 1.0] {
                            cuts.push(self.fraction(along, centre[along] + s * half2.sqrt()));
                        }
                    }
                }
                Area::Polygon(outline) => {
                    for edge in outline.line().windows(2) {
                        let [from, to] = [0, 1].map(|k| edge[k][across] - c);
                        if (from > 0.0) != (to > 0.0) {
                            let [a, b] = [edge[0][along], edge[1][along]];
                            cuts.push(self.fraction(along, a + (b - a) * from / (from - to)));
                        }
                    }
                }
                Area::Everywhere | Area::Where(_) => {}
            }
        }
        tidy(&mut cuts);
        let filling = |t: f64| {
            let mut p = [c; 2];
            p[along] = self.coordinate(along, t);
            filling(self.plan, p)
        };
        let mut parts: Vec<([f64; 2], Filling)> = Vec::new();
        let mut add = |from: f64, to: f64, filling| match parts.last_mut() {
            Some(last) if last.1 == filling => last.0[1] = to,
            _ => parts.push(([from, to], filling)),
        };
        for piece in cuts.windows(2) {
            let (start, length) = (piece[0], piece[1] - piece[0]);
            if !self.probing {
                add(start, piece[1], filling(start + 0.5 * length));
                continue;
            }
            // The first and last points are just inside the ends, to find boundaries at mesh lines.
            let probes = (PROBES as f64 * length).ceil().max(1.0) as usize;
            let probe =
                |k: usize| start + length * (k as f64 / probes as f64).clamp(SLIVER, 1.0 - SLIVER);
            let (mut before, mut since) = (filling(probe(0)), start);
            for k in 1..=probes {
                let here = filling(probe(k));
                if here == before {
                    continue;
                }
                let (mut low, mut high) = (probe(k - 1), probe(k));
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if filling(middle) == before { low = middle } else { high = middle }
                }
                add(since, high, before);
                (before, since) = (here, high);
            }
            add(since, piece[1], before);
        }
        parts
    }

    /// SI coordinate of a fraction of the cell along an axis.
    fn coordinate(&self, axis: usize, fraction: f64) -> f64 {
        let [from, to] = self.range[axis];
        from + fraction * (to - from)
    }

    /// Fraction of the cell at an SI coordinate along an axis.
    fn fraction(&self, axis: usize, coordinate: f64) -> f64 {
        let [from, to] = self.range[axis];
        (coordinate - from) / (to - from)
    }
}

/// Sorts cuts of `[0, 1]` and removes those outside the interval or too close together.
fn tidy(cuts: &mut Vec<f64>) {
    cuts.retain(|&c| c == 0.0 || c == 1.0 || (c > SLIVER && c < 1.0 - SLIVER));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|b, a| *b - *a < SLIVER);
}

/// Whether a shape may have a boundary inside a cell.
fn may_cut(shape: &Area, range: [[f64; 2]; 2]) -> bool {
    match shape {
        Area::Everywhere => false,
        Area::Where(_) => true,
        Area::Polygon(outline) => {
            let extent = outline.extent();
            (0..2).all(|a| extent[a][0] < range[a][1] && extent[a][1] > range[a][0])
        }
        Area::Rectangle { x, y } => {
            let sides = [x, y];
            let meets = |a: usize| sides[a][0] < range[a][1] && sides[a][1] > range[a][0];
            let covers = |a: usize| sides[a][0] <= range[a][0] && sides[a][1] >= range[a][1];
            meets(0) && meets(1) && !(covers(0) && covers(1))
        }
        Area::Circle { centre, radius } => {
            let (mut nearest, mut farthest) = (0.0, 0.0);
            for a in 0..2 {
                let [from, to] = range[a].map(|c| c - centre[a]);
                let inside = if from < 0.0 && to > 0.0 { 0.0 } else { from.abs().min(to.abs()) };
                nearest += inside * inside;
                farthest += from.abs().max(to.abs()).powi(2);
            }
            let r2 = radius * radius;
            nearest < r2 && r2 < farthest
        }
    }
}
