//! This module finds the parts of cells that solids of any shape leave free, with integration
//! points in them.
//!
//! The free part of a cell is found on a grid of 8 x 8 squares, in which the outline is straight; for
//! straight walls it is exact. Nine of its points with positive weights integrate all biquadratic
//! functions exactly: Caratheodory's theorem lets one point after the other be dropped from a fine
//! rule.

use super::measure::CellMeasure;
use super::mesh::Mesh;
use super::outline::{Outline, Point};
use super::shape::{NODES, SIDE_NODES, Shape, side_normal};
use super::stream::Stream;
use std::sync::Arc;

/// Number of squares along a cell that its outline is found with.
const SQUARES: usize = 8;

/// Free fraction up to which a cell is solid.
const SOLID: f64 = 1e-7;

/// Fraction of a cell up to which solids in it are ignored, and distance from a solid, in cells, up
/// to which a node is on its outline.
const WHOLE: f64 = 1e-9;

/// Part of the side of a cell up to which what is given on it is taken as constant.
const NARROW: f64 = 0.05;

/// Distance, in cells, by which a point of a solid must lie inside of it, and outside of the
/// solid that the nodes see, for the solid to be thinner than the mesh can show.
const LOST: f64 = 0.02;

/// A solid of any shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Name of its wall or block.
    pub name: String,
    /// Its outline, in the plan's units.
    pub outline: Outline,
    /// Whether the tangential velocity is zero along it too.
    pub no_slip: bool,
}

/// An integration point of the free part of a cell.
#[derive(Clone, Copy, Debug)]
pub struct PartPoint {
    /// Share of the volume of the part.
    pub weight: f64,
    /// Reference coordinates in the cell.
    pub r: Point,
    /// Shape functions.
    pub shape: Shape,
}

impl PartialEq for PartPoint {
    fn eq(&self, o: &Self) -> bool {
        self.weight == o.weight && self.r == o.r
    }
}

/// The free part of a cell with a solid in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its share of the cell.
    pub fraction: f64,
    /// Its integration points.
    pub points: [PartPoint; 9],
    /// `integral q d/dx_c N_a` over the part for `q = 1, xi, eta`.
    pub divergence: [[[f64; NODES]; 2]; 3],
    /// Neighbours without solids, whose pressure has the slope of this one.
    pub beside: Vec<usize>,
    /// Streamfunction of the velocity in it, where a single wall crosses the cell.
    pub stream: Option<Box<Stream>>,
    /// Whether a solid in the cell is thinner than its nodes can show; the cell is then at rest.
    pub unresolved: bool,
}

/// The solids of any shape in a mesh, and the free parts of its cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// The solids.
    pub solids: Vec<Solid>,
    /// Free part of each cell with a solid in it; empty without solids.
    cells: Vec<Option<Box<Part>>>,
}

/// The parts of a mesh, shared by all that integrate over it.
pub type SharedParts = Option<Arc<Parts>>;

/// A point of a rule with its weight.
type Weighted = (Point, f64);

impl Parts {
    /// The free part of a cell, if there is a solid in it.
    pub fn of(&self, cell: usize) -> Option<&Part> {
        self.cells.get(cell)?.as_deref()
    }

    /// All parts, with their cells.
    pub fn all(&self) -> impl Iterator<Item = (usize, &Part)> {
        self.cells.iter().enumerate().filter_map(|(cell, part)| Some((cell, part.as_deref()?)))
    }

    /// Outlines of the solids.
    pub fn outlines(&self) -> impl Iterator<Item = &Outline> + Clone {
        self.solids.iter().map(|s| &s.outline)
    }

    /// Whether a point is inside of a solid.
    pub fn is_solid(&self, p: Point) -> bool {
        self.outlines().any(|o| o.contains(p))
    }

    /// The solid whose outline is nearest to a point, with the signed distance; positive outside of
    /// all.
    pub fn nearest(&self, p: Point) -> Option<(&Solid, f64)> {
        let all = self.solids.iter().map(|s| (s, s.outline.distance(p)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn distance(&self, p: Point) -> f64 {
        self.nearest(p).map_or(f64::INFINITY, |(_, d)| d)
    }
}

impl Mesh {
    /// The mesh with solids of any shape in it: marks the cells inside of them as solid and finds the
    /// free parts of those that they cut.
    pub fn with_solids(mut self, solids: Vec<Solid>) -> Mesh {
        if solids.is_empty() {
            return self;
        }
        let mut parts = Parts { solids, cells: vec![None; self.cells()] };
        for cell in 0..self.cells() {
            if self.solid[cell] {
                continue;
            }
            let [hx, hy] = self.cell_size(cell);
            let distance = parts.distance(self.cell_centre(cell));
            if distance > 0.51 * hx.hypot(hy) {
                continue;
            }
            if distance < -0.51 * hx.hypot(hy) {
                self.solid[cell] = true;
                continue;
            }
            let rule = rule(&self, cell, &parts);
            let fraction: f64 = rule.iter().map(|(_, w)| w).sum();
            let unresolved = is_lost(&self, cell, &parts);
            if fraction <= SOLID {
                self.solid[cell] = true;
            } else if fraction < 1.0 - WHOLE || unresolved {
                let measure = self.measure().of_cell(self.cell_size(cell));
                let part = Part::new(measure, fraction, rule, unresolved);
                parts.cells[cell] = Some(Box::new(part));
            }
        }
        let cut: Vec<usize> = parts.all().map(|(cell, _)| cell).collect();
        for cell in cut {
            let beside = self.free_neighbours(&parts, cell);
            let stream = parts.of(cell).and_then(|part| Stream::new(&self, cell, part, &parts));
            if let Some(part) = &mut parts.cells[cell] {
                (part.beside, part.stream) = (beside, stream.map(Box::new));
            }
        }
        self.parts = Some(Arc::new(parts));
        self
    }

    /// Rate at which the volume in the free part of a cell grows with the given nodal velocities,
    /// `integral div u`.
    pub fn volume_rate(&self, cell: usize, velocity: impl Fn(usize) -> Point) -> f64 {
        if self.solid[cell] {
            return 0.0;
        }
        let u = self.cell_nodes(cell).map(velocity);
        if let Some(part) = self.part(cell) {
            let [x, y] = &part.divergence[0];
            return (0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum();
        }
        const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
        let through = |side: usize| {
            let c = side_normal(side);
            let sign = if side.is_multiple_of(2) { -1.0 } else { 1.0 };
            let nodes = SIDE_NODES[side].iter().zip(SIMPSON);
            sign * self.face_area(cell, c) * nodes.map(|(&a, w)| w * u[a][c]).sum::<f64>()
        };
        (0..4).map(through).sum()
    }

    /// Value at a node of a side (normal along `normal`) of a velocity that is given along the side. At a
    /// node inside of a solid it is the continuation of the values beside the solid, of
    /// `velocity / distance` where the velocity vanishes on the solid.
    pub fn continued(&self, node: usize, normal: usize, value: impl Fn(Point) -> f64) -> f64 {
        let at = self.node_position(node);
        let Some(parts) = self.parts() else { return value(at) };
        let (solid, inside) = match parts.nearest(at) {
            Some((solid, d)) if d < 0.0 => (solid, d),
            _ => return value(at),
        };
        let (_, along) = self.axes(normal);
        let line = along.nearest_line(at[1 - normal]);
        let near = |line: usize| {
            let mut p = at;
            p[1 - normal] = *along.lines().get(line)?;
            let d = parts.distance(p);
            (d > 0.0).then_some((p, d))
        };
        let beside = [line.checked_sub(1).and_then(near), near(line + 1)];
        let Some((free, d)) = beside.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            return 0.0;
        };
        // The outline is at the fraction `t` of the way to the node, and one point is halfway there.
        let t = d / (d - inside);
        let halfway = [0, 1].map(|c| free[c] + 0.5 * t * (at[c] - free[c]));
        let scale = |d: f64| if solid.no_slip { d } else { 1.0 };
        let [first, second] =
            [(free, d), (halfway, parts.distance(halfway))].map(|(p, d)| value(p) / scale(d));
        let slope = if t > NARROW { (second - first) / (0.5 * t) } else { 0.0 };
        let start = if t > NARROW { first } else { second };
        (start + slope) * scale(inside)
    }

    /// A place in the free part of a cell: its centroid or the integration point nearest to it.
    pub fn free_place(&self, cell: usize, part: &Part) -> Point {
        let centroid = part.centroid();
        let is_free = |r: Point| !self.is_solid_in(cell, self.from_reference(cell, r));
        if is_free(centroid) {
            return self.from_reference(cell, centroid);
        }
        let away = |r: Point| (r[0] - centroid[0]).hypot(r[1] - centroid[1]);
        let points = part.points.iter().filter(|p| p.weight > 0.0).map(|p| p.r);
        let free = points.filter(|&r| is_free(r));
        let nearest = free.min_by(|&a, &b| away(a).total_cmp(&away(b)));
        self.from_reference(cell, nearest.unwrap_or(centroid))
    }

    /// Whether two neighbours share a face.
    fn share_face(&self, a: usize, b: usize) -> bool {
        let ((i, j), (k, l)) = (self.cell_ij(a), self.cell_ij(b));
        (i == k) != (j == l)
    }

    /// The neighbours of a cell without solids, those across a face if there are any.
    fn free_neighbours(&self, parts: &Parts, cell: usize) -> Vec<usize> {
        let free = |n: &usize| *n != cell && !self.solid[*n] && parts.of(*n).is_none();
        let all: Vec<usize> = self.block(cell).filter(free).collect();
        let faces: Vec<usize> = all.iter().copied().filter(|&n| self.share_face(cell, n)).collect();
        if faces.is_empty() { all } else { faces }
    }
}

/// Corners of the squares of a cell along one direction, in reference coordinates, from the side that
/// is farther from the middle of the domain: mirror images are treated alike.
fn grid(flipped: bool) -> [f64; SQUARES + 1] {
    std::array::from_fn(|k| {
        let t = 2.0 * k as f64 / SQUARES as f64 - 1.0;
        if flipped { -t } else { t }
    })
}

/// Two orbits of three points of a triangle, with the weight of a corner's opposite coordinates, that
/// integrate polynomials of degree 4: D. A. Dunavant, Int. J. Numer. Methods Eng. 21 (1985) 1129.
const DUNAVANT: [(f64, f64); 2] = [
    (0.445_948_490_915_964_9, 0.223_381_589_678_011_5),
    (0.091_576_213_509_770_7, 0.109_951_743_655_321_9),
];

/// A fine rule for the free part of a cell; the weights are shares of the cell.
fn rule(mesh: &Mesh, cell: usize, parts: &Parts) -> Vec<Weighted> {
    let centre = mesh.cell_centre(cell);
    let middle = [&mesh.x, &mesh.y].map(|axis| 0.5 * (axis.start() + axis.end()));
    let [x, y] = [0, 1].map(|c| grid(centre[c] > middle[c]));
    let distance = |r: Point| parts.distance(mesh.from_reference(cell, r));
    let mut out = Vec::new();
    let at: Vec<Vec<f64>> =
        x.iter().map(|&x| y.iter().map(|&y| distance([x, y])).collect()).collect();
    for i in 0..SQUARES {
        for j in 0..SQUARES {
            let corner = |a: usize, b: usize| ([x[i + a], y[j + b]], at[i + a][j + b]);
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            // The diagonal from the outer to the inner corner.
            for triangle in [[a, b, c], [a, c, d]] {
                add_triangle(&triangle, &mut out);
            }
        }
    }
    out
}

/// Adds a rule for the part of a triangle where a linear function is positive.
fn add_triangle(corners: &[(Point, f64); 3], out: &mut Vec<Weighted>) {
    let mut free: Vec<Point> = Vec::with_capacity(4);
    for k in 0..3 {
        let ((p, dp), (q, dq)) = (corners[k], corners[(k + 1) % 3]);
        if dp >= 0.0 {
            free.push(p);
        }
        if (dp >= 0.0) != (dq >= 0.0) {
            let t = dp / (dp - dq);
            free.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    for k in 1..free.len().saturating_sub(1) {
        let [a, b, c] = [free[0], free[k], free[k + 1]];
        let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if twice == 0.0 {
            continue;
        }
        for (near, weight) in DUNAVANT {
            for [p, q, r] in [[a, b, c], [b, c, a], [c, a, b]] {
                let at = |i: usize| (1.0 - 2.0 * near) * p[i] + near * (q[i] + r[i]);
                // The reference cell has the area 4.
                out.push(([at(0), at(1)], weight * twice.abs() / 8.0));
            }
        }
    }
}

/// Whether the nodes of a cell cannot show a solid in it: the biquadratic function with their
/// distances is positive where the solid is.
fn is_lost(mesh: &Mesh, cell: usize, parts: &Parts) -> bool {
    let at_nodes: [f64; NODES] = std::array::from_fn(|a| {
        let r = [(a % 3) as f64 - 1.0, (a / 3) as f64 - 1.0];
        parts.distance(mesh.from_reference(cell, r))
    });
    let [hx, hy] = mesh.cell_size(cell);
    let least = LOST * hx.min(hy);
    let steps = 2 * SQUARES;
    (0..=steps * (steps + 1)).any(|k| {
        let [x, y] = [k % (steps + 1), k / (steps + 1)];
        let r = [x, y].map(|k| 2.0 * k as f64 / steps as f64 - 1.0);
        let seen: f64 = Shape::values(r).iter().zip(&at_nodes).map(|(n, d)| n * d).sum();
        seen > least && parts.distance(mesh.from_reference(cell, r)) < -least
    })
}

impl Part {
    fn new(cell: CellMeasure, fraction: f64, rule: Vec<Weighted>, unresolved: bool) -> Part {
        // The slope of the pressure takes more than the biquadratic functions.
        let mut divergence = [[[0.0; NODES]; 2]; 3];
        for (r, weight) in &rule {
            let (volume, shape) = (cell.of_point(*weight), Shape::at(*r));
            for (row, q) in divergence.iter_mut().zip([1.0, r[0], r[1]]) {
                for a in 0..NODES {
                    row[0][a] += volume * q * shape.d_xi[a] * 2.0 / cell.size[0];
                    row[1][a] += volume * q * shape.d_eta[a] * 2.0 / cell.size[1];
                }
            }
        }
        let rule = reduced(rule);
        let mut points = [PartPoint { weight: 0.0, r: [0.0; 2], shape: Shape::at([0.0; 2]) }; 9];
        for (point, (r, weight)) in points.iter_mut().zip(rule) {
            *point = PartPoint { weight: weight / fraction, r, shape: Shape::at(r) };
        }
        Part { fraction, points, divergence, beside: vec![], stream: None, unresolved }
    }

    /// Centroid, in reference coordinates.
    pub fn centroid(&self) -> Point {
        [0, 1].map(|c| self.points.iter().map(|p| p.weight * p.r[c]).sum())
    }
}

/// Nine points of a rule, or fewer, with weights that integrate the biquadratic functions as the
/// whole rule does.
fn reduced(rule: Vec<Weighted>) -> Vec<Weighted> {
    let total: f64 = rule.iter().map(|(_, w)| w).sum();
    let centre = [0, 1].map(|c| rule.iter().map(|(r, w)| w * r[c]).sum::<f64>() / total);
    let spread = [0, 1].map(|c| {
        let square: f64 = rule.iter().map(|(r, w)| w * (r[c] - centre[c]).powi(2)).sum();
        (square / total).sqrt().max(f64::MIN_POSITIVE)
    });
    let moments = |r: &Point| -> [f64; NODES] {
        let [x, y] = [0, 1].map(|c| (r[c] - centre[c]) / spread[c]);
        std::array::from_fn(|k| x.powi((k % 3) as i32) * y.powi((k / 3) as i32))
    };
    let mut kept: Vec<Weighted> = Vec::with_capacity(NODES + 1);
    for point in rule {
        kept.push(point);
        if kept.len() <= NODES {
            continue;
        }
        let columns: [[f64; NODES]; NODES + 1] = std::array::from_fn(|k| moments(&kept[k].0));
        let along = null_vector(&columns);
        // The largest step along which all weights stay positive removes one point.
        let step = |k: usize| kept[k].1 / along[k];
        let gone = (0..kept.len())
            .filter(|&k| along[k] > 0.0)
            .min_by(|&a, &b| step(a).total_cmp(&step(b)));
        let Some(gone) = gone else { continue };
        let length = step(gone);
        for (point, along) in kept.iter_mut().zip(along) {
            point.1 = (point.1 - length * along).max(0.0);
        }
        kept.remove(gone);
    }
    kept
}

/// A vector that a matrix of nine rows, given by its ten columns, maps to zero; its largest entry is
/// one. Gaussian elimination with complete pivoting.
fn null_vector(columns: &[[f64; NODES]; NODES + 1]) -> [f64; NODES + 1] {
    let mut a = *columns;
    let mut order: [usize; NODES + 1] = std::array::from_fn(|k| k);
    let mut rank = 0;
    while rank < NODES {
        let mut best = (0.0, rank, rank);
        for k in rank..=NODES {
            for row in rank..NODES {
                let size = a[order[k]][row].abs();
                if size > best.0 {
                    best = (size, k, row);
                }
            }
        }
        let (size, k, row) = best;
        if size <= 1e-13 {
            break;
        }
        order.swap(rank, k);
        a.iter_mut().for_each(|column| column.swap(rank, row));
        for row in rank + 1..NODES {
            let factor = a[order[rank]][row] / a[order[rank]][rank];
            for &k in &order[rank..] {
                a[k][row] -= factor * a[k][rank];
            }
        }
        rank += 1;
    }
    let mut out = [0.0; NODES + 1];
    out[order[rank]] = 1.0;
    for row in (0..rank).rev() {
        let sum: f64 = order[row + 1..=rank].iter().map(|&k| a[k][row] * out[k]).sum();
        out[order[row]] = -sum / a[order[row]][row];
    }
    let largest = out.iter().fold(0.0, |a: f64, &b| if b.abs() > a.abs() { b } else { a });
    out.map(|v| v / largest)
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::*;

    fn mesh(n: usize) -> Mesh {
        let axis = || Axis::new((0..=n).map(|k| k as f64 / n as f64).collect(), false);
        Mesh::new(axis(), axis())
    }

    fn volume(mesh: &Mesh) -> f64 {
        (0..mesh.cells()).filter(|&c| !mesh.solid[c]).map(|c| mesh.cell_volume(c)).sum()
    }

    #[test]
    fn free_volumes_are_exact_for_straight_walls_and_of_second_order_for_circles() {
        let corners = vec![[0.1, -1.0], [0.73, 0.21], [0.3, 2.0], [-1.0, 0.4]];
        let triangle = Outline::polygon(vec![[-1.0, -0.2], [2.0, 0.7], [2.0, -3.0], [-1.0, -3.0]]);
        let solid = |outline: &Outline| Solid {
            name: "solid".into(),
            outline: outline.clone(),
            no_slip: true,
        };
        let below = |x: f64| -0.2 + 0.3 * (x + 1.0);
        for n in [1, 3, 7] {
            let m = mesh(n).with_solids(vec![solid(&triangle)]);
            let exact = 1.0 - 0.5 * (below(0.0) + below(1.0));
            assert!((volume(&m) - exact).abs() < 1e-13, "{n}: {} {exact}", volume(&m));
        }
        let _ = corners;
        let circle = Outline::Circle { centre: [0.52, 0.47], radius: 0.3 };
        let error = |n: usize| {
            (volume(&mesh(n).with_solids(vec![solid(&circle)])) - 1.0 + circle.area()).abs()
        };
        assert!(error(8) < 1e-4 && error(32) < 0.1 * error(8), "{} {}", error(8), error(32));
    }

    #[test]
    fn nine_positive_weights_integrate_biquadratic_functions() {
        let outline = Outline::Circle { centre: [0.4, 0.5], radius: 0.35 };
        let m = mesh(5).with_solids(vec![Solid { name: "solid".into(), outline, no_slip: true }]);
        let parts = m.parts().unwrap();
        assert!(parts.all().count() > 8);
        for (cell, part) in parts.all() {
            let fine = rule(&m, cell, parts);
            for k in 0..9 {
                let f = |r: &Point| r[0].powi(k % 3) * r[1].powi(k / 3);
                let exact: f64 = fine.iter().map(|(r, w)| w * f(r)).sum();
                let found: f64 =
                    part.points.iter().map(|p| part.fraction * p.weight * f(&p.r)).sum();
                assert!((exact - found).abs() < 1e-10, "{cell} {k}: {exact} {found}");
            }
            assert!(part.points.iter().all(|p| p.weight >= 0.0));
        }
    }
}
