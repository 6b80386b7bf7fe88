//! This module makes integration rules along the outlines of solids, cell by cell.
//!
//! Each edge of a polygon, and each arc of a circle between the lines of the mesh, is divided into equal
//! pieces with three Gauss points each. An outline along a mesh line belongs to the cell on its free side.

use super::mesh::Mesh;
use super::outline::{Outline, Point, edges};
use super::parts::Parts;
use super::shape::{GAUSS_3, GAUSS_3_WEIGHTS};
use std::f64::consts::TAU;

/// Number of pieces of an edge in a cell: another solid may cover some of them.
const PIECES: usize = 4;

/// Distance, in cells, below which an outline is on a mesh line.
const ON_LINE: f64 = 1e-9;

/// Distance, in cells, from the outline at which a point beside it must be free.
const BESIDE: f64 = 1e-6;

/// A point of a rule along an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlinePoint {
    /// Index of the solid.
    pub solid: usize,
    /// Reference coordinates in the cell.
    pub r: Point,
    /// Area that the point stands for, in the plan's units.
    pub area: f64,
    /// Unit normal, away from the solid.
    pub normal: Point,
    /// Length along the outline from its first corner (of a circle: from the right), in the plan's units.
    pub along: f64,
}

impl Mesh {
    /// Points along the outlines of solids of any shape in a cell, where the fluid touches them.
    pub fn outline_points(&self, cell: usize) -> Vec<OutlinePoint> {
        self.parts().map_or_else(Vec::new, |parts| self.outline_points_of(parts, cell))
    }

    /// The same for given solids.
    pub(super) fn outline_points_of(&self, parts: &Parts, cell: usize) -> Vec<OutlinePoint> {
        let mut out = Vec::new();
        if self.solid[cell] {
            return out;
        }
        let [hx, hy] = self.cell_size(cell);
        let reach = 0.5 * hx.hypot(hy) * (1.0 + ON_LINE);
        let centre = self.cell_centre(cell);
        for (solid, outline) in parts.outlines().enumerate() {
            if outline.distance(centre).abs() > reach {
                continue;
            }
            let add = |p: Point, normal: Point, length: f64, along: f64| {
                let beside = [0, 1].map(|c| p[c] + BESIDE * hx.min(hy) * normal[c]);
                if !parts.is_solid(beside) {
                    let (r, area) = (self.to_reference(cell, p), length * self.thickness(p));
                    let r = r.map(|c| c.clamp(-1.0, 1.0));
                    out.push(OutlinePoint { solid, r, area, normal, along });
                }
            };
            match outline {
                Outline::Polygon(corners) => along_edges(corners, self.sides_of(cell), add),
                Outline::Circle { centre, radius } => {
                    along_arcs((*centre, *radius), self.sides_of(cell), add);
                }
            }
        }
        out
    }

    /// Ranges of x and y of a cell.
    fn sides_of(&self, cell: usize) -> [[f64; 2]; 2] {
        let (i, j) = self.cell_ij(cell);
        [(&self.x, i), (&self.y, j)].map(|(axis, k)| [axis.lines()[k], axis.lines()[k + 1]])
    }
}

/// Calls `add` with the points of the edges of a polygon in a rectangle.
fn along_edges(
    corners: &[Point],
    sides: [[f64; 2]; 2],
    mut add: impl FnMut(Point, Point, f64, f64),
) {
    let mut before = 0.0;
    for [a, b] in edges(corners) {
        let way = [b[0] - a[0], b[1] - a[1]];
        let length = way[0].hypot(way[1]);
        let normal = [way[1] / length, -way[0] / length];
        if let Some([from, to]) = inside(a, b, normal, sides) {
            let piece = (to - from) / PIECES as f64;
            for k in 0..PIECES {
                for (g, w) in GAUSS_3.iter().zip(GAUSS_3_WEIGHTS) {
                    let t = from + piece * (k as f64 + 0.5 + 0.5 * g);
                    let p = [0, 1].map(|c| a[c] + t * way[c]);
                    add(p, normal, w * piece * length, before + t * length);
                }
            }
        }
        before += length;
    }
}

/// The part of an edge from `a` to `b` in a rectangle, as a range of the fraction of the way.
fn inside(a: Point, b: Point, normal: Point, sides: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for c in 0..2 {
        let [low, high] = sides[c];
        let near = ON_LINE * (high - low);
        if (a[c] - b[c]).abs() <= near {
            // The edge runs along a mesh line or between two.
            let on = |line: f64| (a[c] - line).abs() <= near;
            let free_side = (on(low) && normal[c] > 0.0) || (on(high) && normal[c] < 0.0);
            let between = a[c] > low && a[c] < high && !on(low) && !on(high);
            if !(free_side || between) {
                return None;
            }
            continue;
        }
        let [s, t] = [low, high].map(|line| (line - a[c]) / (b[c] - a[c]));
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    (to > from).then_some([from, to])
}

/// Calls `add` with the points of the arcs of a circle in a rectangle.
fn along_arcs(
    (centre, radius): (Point, f64),
    sides: [[f64; 2]; 2],
    mut add: impl FnMut(Point, Point, f64, f64),
) {
    let mut ends = vec![0.0, TAU];
    for c in 0..2 {
        for line in sides[c] {
            let cosine = (line - centre[c]) / radius;
            if cosine.abs() < 1.0 {
                let angle = cosine.acos();
                let both = if c == 0 {
                    [angle, TAU - angle]
                } else {
                    [0.25 * TAU - angle, 0.25 * TAU + angle]
                };
                ends.extend(both.map(|a| a.rem_euclid(TAU)));
            }
        }
    }
    ends.sort_by(f64::total_cmp);
    let at = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        ([centre[0] + radius * cos, centre[1] + radius * sin], [cos, sin])
    };
    for ends in ends.windows(2) {
        let piece = (ends[1] - ends[0]) / PIECES as f64;
        let (middle, _) = at(0.5 * (ends[0] + ends[1]));
        if piece <= 0.0 || (0..2).any(|c| middle[c] <= sides[c][0] || middle[c] >= sides[c][1]) {
            continue;
        }
        for k in 0..PIECES {
            for (g, w) in GAUSS_3.iter().zip(GAUSS_3_WEIGHTS) {
                let angle = ends[0] + piece * (k as f64 + 0.5 + 0.5 * g);
                let (p, normal) = at(angle);
                add(p, normal, w * piece * radius, angle * radius);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::super::parts::Solid;
    use super::*;

    fn mesh(n: usize, outlines: &[Outline]) -> Mesh {
        let axis = || Axis::new((0..=n).map(|k| k as f64 / n as f64).collect(), false);
        let solids = outlines.iter().map(|o| Solid::at_rest("solid", o.clone(), true));
        Mesh::new(axis(), axis()).with_solids(solids.collect())
    }

    fn length(mesh: &Mesh) -> f64 {
        (0..mesh.cells()).flat_map(|c| mesh.outline_points(c)).map(|p| p.area).sum()
    }

    #[test]
    fn the_pieces_make_up_the_outline() {
        let triangle = Outline::polygon(vec![[0.2, 0.3], [0.9, 0.35], [0.4, 0.8]]);
        let exact = [[0.7, 0.05], [-0.5, 0.45], [-0.2, -0.5]].map(|v: [f64; 2]| v[0].hypot(v[1]));
        let circle = Outline::Circle { centre: [0.52, 0.47], radius: 0.3 };
        // Edges along mesh lines count once.
        let square = Outline::polygon(vec![[0.25, 0.25], [0.75, 0.25], [0.75, 0.5], [0.25, 0.5]]);
        for n in [1, 4, 7, 16] {
            let sum = length(&mesh(n, std::slice::from_ref(&triangle)));
            assert!((sum - exact.iter().sum::<f64>()).abs() < 1e-12, "{n}: {sum}");
            let sum = length(&mesh(n, std::slice::from_ref(&circle)));
            assert!((sum - 0.3 * TAU).abs() < 1e-12, "{n}: {sum}");
            let sum = length(&mesh(n, std::slice::from_ref(&square)));
            assert!((sum - 1.5).abs() < 1e-12, "{n}: {sum}");
        }
    }

    #[test]
    fn only_what_fluid_touches_counts() {
        // Two triangles share the diagonal of a square; a third reaches out of the domain.
        let lower = Outline::polygon(vec![[0.2, 0.2], [0.6, 0.2], [0.6, 0.6]]);
        let upper = Outline::polygon(vec![[0.2, 0.2], [0.6, 0.6], [0.2, 0.6]]);
        let outer = Outline::polygon(vec![[-1.0, 0.9], [2.0, 0.9], [2.0, 3.0]]);
        let sum = length(&mesh(5, &[lower, upper, outer.clone()]));
        assert!((sum - 1.6 - 1.0).abs() < 1e-12, "{sum}");
    }
}
