//! This module puts solids of any shape into a mesh: finds the cells that are solid and the free parts
//! of those that are cut.

use super::free_rule::{SQUARES, Weighted, reduced, rule, side_rule};
use super::measure::CellMeasure;
use super::mesh::Mesh;
use super::outline::{Point, push_out, slide};
use super::parts::{Part, PartPoint, Parts, Solid};
use super::shape::{NODES, SIDE_NODES, Shape, side_end, side_normal};
use super::stream_fit::fit;
use std::sync::Arc;

/// Free fraction up to which a cell is solid.
const SOLID: f64 = 1e-7;

/// Fraction of a cell up to which solids in it are ignored.
const WHOLE: f64 = 1e-9;

/// Distance, in cells, of a solid from a side of a cell up to which it lies on the side, if solids move: a
/// little more than of a solid whose cell has no free part.
const ON_SIDE: f64 = 2.0 * SOLID;

/// Share of the side of a cell from which a solid that lies on it counts.
const TOUCHED: f64 = 1e-6;

/// Distance from an outline, relative to that of the node inside of the solid, up to which a point is on it.
const ON_OUTLINE: f64 = 1e-6;

/// Part of the side of a cell up to which what is given on it is taken as constant.
const NARROW: f64 = 0.05;

/// Distance, in cells, by which a point of a solid must lie inside of it, and outside of the
/// solid that the nodes see, for the solid to be thinner than the mesh can show.
const LOST: f64 = 0.02;

/// Part of a solid in a cell that may be lost. At corners a little of it always is; if cells were closed for
/// that, openings a few cells wide would be too (test `openings_between_polygons_are_open`).
const MOST_LOST: f64 = 1.0 / 3.0;

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
            let middle = [&self.x, &self.y].map(|axis| 0.5 * (axis.start() + axis.end()));
            let centre = self.cell_centre(cell);
            let flipped = [0, 1].map(|c| centre[c] > middle[c]);
            let distance = |r: Point| parts.distance(self.from_reference(cell, r));
            let measure = self.whole_measure(cell);
            let mut rule = rule(flipped, distance);
            rule.iter_mut().for_each(|(r, weight)| *weight = measure.share(*weight, r[0]));
            let fraction: f64 = rule.iter().map(|(_, w)| w).sum();
            let unresolved = is_lost(&self, cell, &parts);
            if fraction <= SOLID {
                self.solid[cell] = true;
                continue;
            }
            let cut = fraction < 1.0 - WHOLE || unresolved;
            if !cut && !parts.move_on() {
                continue;
            }
            // What lies on a side moves with its solid, so that the side is not free.
            let on_side = parts.move_on().then_some(ON_SIDE * hx.min(hy));
            let sides = std::array::from_fn(|side| side_rule(side, on_side, distance));
            let free = |rule: &Vec<Weighted>| rule.iter().map(|(_, w)| w).sum::<f64>();
            if cut || sides.iter().any(|rule| free(rule) < 1.0 - TOUCHED) {
                let part = part(measure, (fraction, rule), &sides, unresolved);
                parts.cells[cell] = Some(Box::new(part));
            }
        }
        let cut: Vec<usize> = parts.all().map(|(cell, _)| cell).collect();
        for cell in cut {
            let beside = self.free_neighbours(&parts, cell);
            let stream = parts.of(cell).and_then(|part| fit(&self, cell, part, &parts));
            let (swept, velocity) =
                if parts.move_on() { self.swept(&parts, cell) } else { Default::default() };
            if let Some(part) = &mut parts.cells[cell] {
                (part.beside, part.stream) = (beside, stream.map(Box::new));
                (part.swept, part.velocity) = (swept, velocity);
            }
        }
        self.parts = Some(Arc::new(parts));
        self
    }

    /// Volume that moving solids take from the free part of a cell per time, `sum of W . S` over the
    /// solids with velocity `W` and the integral `S` of the normal, away from the solid, over the outline
    /// inside of the cell. All `S` together are exactly the free areas of the sides with their normals:
    /// what rounding and corners leave belongs to the solid with most of the outline,
    /// whose velocity is the second value.
    fn swept(&self, parts: &Parts, cell: usize) -> (f64, Point) {
        let Some(part) = parts.of(cell) else { return Default::default() };
        let mut rest = [0, 1].map(|c| part.divergence[0][c].iter().sum::<f64>());
        let mut area = vec![0.0; parts.solids.len()];
        let mut swept = 0.0;
        for p in self.outline_points_of(parts, cell) {
            area[p.solid] += p.area;
            for c in 0..2 {
                rest[c] -= p.area * p.normal[c];
                swept += p.area * p.normal[c] * parts.solids[p.solid].velocity[c];
            }
        }
        let most = (0..area.len()).max_by(|&a, &b| area[a].total_cmp(&area[b]));
        let most = most.filter(|&k| area[k] > 0.0).map(|k| &parts.solids[k]);
        let nearest = || parts.nearest(self.cell_centre(cell)).map(|(solid, _)| solid);
        let velocity = most.or_else(nearest).map_or([0.0; 2], |solid| solid.velocity);
        (swept + rest[0] * velocity[0] + rest[1] * velocity[1], velocity)
    }

    /// Rate at which the volume in the free part of a cell grows with the given nodal velocities,
    /// `integral div u` and what solids take from it.
    pub fn volume_rate(&self, cell: usize, velocity: impl Fn(usize) -> Point) -> f64 {
        if self.solid[cell] {
            return 0.0;
        }
        let u = self.cell_nodes(cell).map(velocity);
        if let Some(part) = self.part(cell) {
            let [x, y] = &part.divergence[0];
            let through: f64 = (0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum();
            return through - part.swept;
        }
        const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
        let through = |side: usize| {
            let c = side_normal(side);
            let sign = side_end(side);
            let nodes = SIDE_NODES[side].iter().zip(SIMPSON);
            let face = self.face(cell, side);
            let along = [-1.0, 0.0, 1.0];
            let points = nodes.zip(along).map(|((&a, w), t)| face.of_point(w, t) * u[a][c]);
            sign * points.sum::<f64>()
        };
        (0..4).map(through).sum()
    }

    /// Value at a node of a side (normal along `normal`) of component `c` of a velocity that is given along
    /// the side. At a
    /// node inside of a solid it is the continuation of the values beside the solid, of
    /// `velocity / distance`, relative to the solid, where it vanishes on the solid.
    pub fn continued(
        &self,
        node: usize,
        (normal, c): (usize, usize),
        value: impl Fn(Point) -> f64,
    ) -> f64 {
        let at = self.node_position(node);
        let Some(parts) = self.parts() else { return value(at) };
        let (solid, inside) = match parts.nearest(at) {
            Some((solid, d)) if d < 0.0 => (solid, d),
            _ => return value(at),
        };
        let (_, along) = self.axes(normal);
        let line = along.nearest_line(at[1 - normal]);
        let reach = |line: usize| {
            let mut p = at;
            p[1 - normal] = *along.lines().get(line)?;
            Some((p, parts.distance(p)))
        };
        let below = |k: usize| line.checked_sub(k).and_then(reach);
        let above = |k: usize| reach(line + k);
        // A point on the outline does not tell how the velocity grows with the distance: the next one does.
        let near = |reach: &dyn Fn(usize) -> Option<(Point, f64)>| {
            let first = reach(1)?;
            let on_outline = first.1.abs() <= ON_OUTLINE * inside.abs();
            let near = if on_outline { reach(2)? } else { first };
            (near.1 > 0.0).then_some(near)
        };
        let beside = [near(&below), near(&above)];
        let Some((free, d)) = beside.into_iter().flatten().max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            return 0.0;
        };
        // The outline is at the fraction `t` of the way to the node, and one point is halfway there.
        let t = d / (d - inside);
        let halfway = [0, 1].map(|c| free[c] + 0.5 * t * (at[c] - free[c]));
        let scale = |d: f64| if solid.no_slip { d } else { 1.0 };
        let own = if solid.no_slip { solid.velocity[c] } else { 0.0 };
        let [first, second] = [(free, d), (halfway, parts.distance(halfway))]
            .map(|(p, d)| (value(p) - own) / scale(d));
        let slope = if t > NARROW { (second - first) / (0.5 * t) } else { 0.0 };
        let start = if t > NARROW { first } else { second };
        own + (start + slope) * scale(inside)
    }

    /// A place in the free part of a cell: its centroid or the integration point nearest to it; `None` if
    /// no such point is free, as in a sliver.
    pub fn free_place(&self, cell: usize, part: &Part) -> Option<Point> {
        let centroid = part.centroid();
        let is_free = |r: Point| {
            let p = self.from_reference(cell, r);
            !self.is_solid_in(cell, p) && self.locate(p) == cell
        };
        if is_free(centroid) {
            return Some(self.from_reference(cell, centroid));
        }
        let away = |r: Point| (r[0] - centroid[0]).hypot(r[1] - centroid[1]);
        let points = part.points.iter().filter(|p| p.weight > 0.0).map(|p| p.r);
        let free = points.filter(|&r| is_free(r));
        let nearest = free.min_by(|&a, &b| away(a).total_cmp(&away(b)));
        Some(self.from_reference(cell, nearest?))
    }

    /// A place near a point that is in the domain and not inside of a solid: the point itself, the nearest
    /// place outside of the solids, or the nearest of those that the cells around it have; `None` if
    /// everything is solid.
    pub fn nearest_free(&self, p: Point) -> Option<Point> {
        let Some(parts) = self.parts() else { return Some(p) };
        if self.holds(p) {
            return Some(p);
        }
        let outside = self.nearest_inside(self.wrap(push_out(parts.obstacles([0.0; 2]), p)));
        if self.holds(outside) {
            return Some(outside);
        }
        let middle = self.nearest_inside(self.wrap(p));
        let (i, j) = self.cell_ij(self.locate(middle));
        let place = |cell: usize| match self.part(cell) {
            _ if self.solid[cell] => None,
            Some(part) => self.free_place(cell, part),
            None => Some(self.cell_centre(cell)),
        };
        let away = |q: &Point| (q[0] - middle[0]).hypot(q[1] - middle[1]);
        let [nx, ny] = [self.x.cells(), self.y.cells()];
        (0..nx.max(ny)).find_map(|ring| {
            let near = |k: usize, n: usize| k.saturating_sub(ring)..(k + ring + 1).min(n);
            let on_ring = |k: usize, l: usize| k.abs_diff(i).max(l.abs_diff(j)) == ring;
            let cells = near(j, ny).flat_map(|l| near(i, nx).map(move |k| (k, l)));
            let places =
                cells.filter(|&(k, l)| on_ring(k, l)).filter_map(|(k, l)| place(self.cell(k, l)));
            places.min_by(|a, b| away(a).total_cmp(&away(b)))
        })
    }

    /// Whether no solid of any shape is between two points.
    pub fn sees(&self, a: Point, b: Point) -> bool {
        self.parts().is_none_or(|parts| slide(parts.obstacles([0.0; 2]), a, b).is_none())
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

/// Whether the nodes of a cell cannot show a solid in it: where the biquadratic function with their distances
/// is positive inside of the solid, much of the solid is lost, or the flow would pass through it from
/// one part of the cell that is free to another.
fn is_lost(mesh: &Mesh, cell: usize, parts: &Parts) -> bool {
    const STEPS: usize = 2 * SQUARES;
    const POINTS: usize = STEPS + 1;
    let at_nodes: [f64; NODES] = std::array::from_fn(|a| {
        let r = [(a % 3) as f64 - 1.0, (a / 3) as f64 - 1.0];
        parts.distance(mesh.from_reference(cell, r))
    });
    let [hx, hy] = mesh.cell_size(cell);
    let least = LOST * hx.min(hy);
    // For each point whether it is free, and whether it is lost.
    let point = |k: usize| {
        let r = [k % POINTS, k / POINTS].map(|k| 2.0 * k as f64 / STEPS as f64 - 1.0);
        let seen: f64 = Shape::values(r).iter().zip(&at_nodes).map(|(n, d)| n * d).sum();
        let distance = parts.distance(mesh.from_reference(cell, r));
        (distance > 0.0, distance < -least, seen > least)
    };
    let points: Vec<_> = (0..POINTS * POINTS).map(point).collect();
    let count = |of: &dyn Fn(&(bool, bool, bool)) -> bool| points.iter().filter(|p| of(p)).count();
    let lost = count(&|p| p.1 && p.2);
    if lost == 0 || lost as f64 > MOST_LOST * count(&|p| p.1) as f64 {
        return lost > 0;
    }
    let free: Vec<bool> = points.iter().map(|p| p.0).collect();
    let open: Vec<bool> = points.iter().map(|p| p.0 || p.1 && p.2).collect();
    let regions = connected::<POINTS>(&free);
    let joined = connected::<POINTS>(&open);
    let mut of_joined = vec![None; points.len()];
    (0..points.len())
        .filter(|&k| free[k])
        .any(|k| *of_joined[joined[k]].get_or_insert(regions[k]) != regions[k])
}

/// For each point of a square with `N` points along a side, the first point of the connected region of
/// points of the set that it is in.
fn connected<const N: usize>(set: &[bool]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..set.len()).collect();
    for start in 0..set.len() {
        if !set[start] || first[start] != start {
            continue;
        }
        let mut list = vec![start];
        while let Some(k) = list.pop() {
            let (x, y) = (k % N, k / N);
            let left = (x > 0).then(|| k - 1);
            let right = (x + 1 < N).then_some(k + 1);
            let below = (y > 0).then(|| k - N);
            let above = (y + 1 < N).then_some(k + N);
            for n in [left, right, below, above].into_iter().flatten() {
                if set[n] && n != start && first[n] == n {
                    first[n] = start;
                    list.push(n);
                }
            }
        }
    }
    first
}

/// The free part of a cell; `sides`: rules for the free parts of its sides.
fn part(
    cell: CellMeasure,
    (fraction, rule): (f64, Vec<Weighted>),
    sides: &[Vec<Weighted>; 4],
    unresolved: bool,
) -> Part {
    // The integral of `q dN_a/dx_c` over the part.
    let mut whole = [[[0.0; NODES]; 2]; 3];
    for (r, weight) in &rule {
        let (volume, shape) = (cell.of_share(*weight), Shape::at(*r));
        let per_radius = cell.per_radius(r[0]);
        for (row, q) in whole.iter_mut().zip(cell.pressure_basis(*r)) {
            if per_radius != 0.0 {
                for a in 0..NODES {
                    row[0][a] += volume * q * per_radius * shape.n[a];
                }
            }
            for a in 0..NODES {
                row[0][a] += volume * q * shape.d_xi[a] * 2.0 / cell.size[0];
                row[1][a] += volume * q * shape.d_eta[a] * 2.0 / cell.size[1];
            }
        }
    }
    let mut points = [PartPoint { weight: 0.0, r: [0.0; 2], shape: Shape::at([0.0; 2]) }; 9];
    for (point, (r, weight)) in points.iter_mut().zip(reduced(rule)) {
        *point = PartPoint { weight: weight / fraction, r, shape: Shape::at(r) };
    }
    let mut divergence = [[[0.0; NODES]; 2]; 3];
    for (side, rule) in sides.iter().enumerate() {
        let c = side_normal(side);
        let sign = side_end(side);
        for (r, weight) in rule {
            let area = sign * cell.of_side(side).of_point(*weight, r[1 - c]);
            let n = Shape::values(*r);
            for (row, q) in divergence.iter_mut().zip(cell.pressure_basis(*r)) {
                row[c].iter_mut().zip(n).for_each(|(entry, n)| *entry += area * q * n);
            }
        }
    }
    for p in &points {
        let volume = cell.of_share(p.weight * fraction);
        for c in 0..2 {
            let slope = 2.0 / cell.size[c];
            let row = divergence[1 + c][c].iter_mut();
            row.zip(p.shape.n).for_each(|(entry, n)| *entry -= volume * slope * n);
        }
    }
    let outline = std::array::from_fn(|q| {
        [0, 1].map(|c| std::array::from_fn(|a| whole[q][c][a] - divergence[q][c][a]))
    });
    Part {
        fraction,
        points,
        divergence,
        outline,
        swept: 0.0,
        velocity: [0.0; 2],
        beside: vec![],
        stream: None,
        unresolved,
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::super::outline::Outline;
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
        let triangle = Outline::polygon(vec![[-1.0, -0.2], [2.0, 0.7], [2.0, -3.0], [-1.0, -3.0]]);
        let solid = |outline: &Outline| Solid::at_rest("solid", outline.clone(), true);
        let below = |x: f64| -0.2 + 0.3 * (x + 1.0);
        for n in [1, 3, 7] {
            let m = mesh(n).with_solids(vec![solid(&triangle)]);
            let exact = 1.0 - 0.5 * (below(0.0) + below(1.0));
            assert!((volume(&m) - exact).abs() < 1e-13, "{n}: {} {exact}", volume(&m));
        }
        let circle = Outline::Circle { centre: [0.52, 0.47], radius: 0.3 };
        let error = |n: usize| {
            (volume(&mesh(n).with_solids(vec![solid(&circle)])) - 1.0 + circle.area()).abs()
        };
        assert!(error(8) < 1e-4 && error(32) < 0.1 * error(8), "{} {}", error(8), error(32));
    }

    #[test]
    fn nine_positive_weights_integrate_biquadratic_functions() {
        let outline = Outline::Circle { centre: [0.4, 0.5], radius: 0.35 };
        let m = mesh(5).with_solids(vec![Solid::at_rest("solid", outline, true)]);
        let parts = m.parts().unwrap();
        assert!(parts.all().count() > 8);
        for (cell, part) in parts.all() {
            let distance = |r: Point| parts.distance(m.from_reference(cell, r));
            let fine = rule(m.cell_centre(cell).map(|c| c > 0.5), distance);
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
