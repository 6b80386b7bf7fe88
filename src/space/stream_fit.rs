//! This module fits the streamfunction of cells with solids in them to the nodal velocities.

use super::mesh::Mesh;
use super::outline::Point;
use super::parts::{Part, Parts};
use super::shape::{NODES, Shape};
use super::stream::{Form, Stream, TERMS};
use nalgebra::{SMatrix, SVector};

/// Pieces of each side of a cell that the fluxes are integrated with.
const PIECES: usize = 24;
/// Weight of the velocities inside relative to that of the fluxes.
const INNER: f64 = 0.2;
/// Share of the largest entry that is added to the diagonal of the normal equations: coefficients that
/// a small part does not determine are small.
const RIDGE: f64 = 1e-9;
/// Smallest distance, in cells, that fluxes are weighted with.
const NEAREST: f64 = 0.05;

/// The streamfunction of a cell; `None` if no single wall crosses it.
pub fn fit(mesh: &Mesh, cell: usize, part: &Part, parts: &Parts) -> Option<Stream> {
    if part.unresolved {
        return None;
    }
    let [hx, hy] = mesh.cell_size(cell);
    let arc = arc(mesh, cell, parts)?;
    let solid = parts.nearest(mesh.cell_centre(cell))?.0;
    let centre = mesh.from_reference(cell, part.centroid());
    let mut stream = Stream {
        map: [[0.0; 2 * NODES]; TERMS],
        power: if solid.no_slip { 2 } else { 1 },
        velocity: solid.velocity,
        centre,
        size: 0.5 * (hx + hy),
    };
    let mut matrix = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut right = SMatrix::<f64, TERMS, { 2 * NODES }>::zeros();
    let mut add = |row: SVector<f64, TERMS>, value: &Form, weight: f64| {
        matrix += weight * row * row.transpose();
        for (j, v) in value.iter().enumerate() {
            right.set_column(j, &(right.column(j) + weight * v * row));
        }
    };
    for (p, psi) in &arc {
        let d = parts.nearest(*p)?.1;
        let row = stream.terms(*p) * d.powi(stream.power);
        let scale = d.max(NEAREST * stream.size).powi(stream.power - 1) * stream.size;
        add(row, psi, 1.0 / (scale * scale * arc.len() as f64));
    }
    for q in part.points.iter().filter(|q| q.weight > 0.0) {
        let p = mesh.from_reference(cell, q.r);
        let (solid, d) = parts.nearest(p)?;
        let [x, y] = stream.rows(p, d, solid.outline.normal(p));
        for (c, row) in [x, y].into_iter().enumerate() {
            let mut value = [0.0; 2 * NODES];
            value[NODES * c..][..NODES].copy_from_slice(&q.shape.n);
            add(row, &value, INNER * q.weight);
        }
    }
    let ridge = RIDGE * matrix.diagonal().max();
    for k in 0..TERMS {
        matrix[(k, k)] += ridge;
    }
    let solution = matrix.cholesky()?.solve(&right);
    for (k, form) in stream.map.iter_mut().enumerate() {
        for (j, v) in form.iter_mut().enumerate() {
            *v = solution[(k, j)];
        }
    }
    Some(stream)
}

/// Points of the sides of a cell that no solid covers, with the streamfunction there: zero where the
/// sides enter the solid. `None` unless the free sides are one line from wall to wall.
fn arc(mesh: &Mesh, cell: usize, parts: &Parts) -> Option<Vec<(Point, Form)>> {
    let [hx, hy] = mesh.cell_size(cell);
    let count = 4 * PIECES;
    // Counter-clockwise around the cell: the flux out of it is d psi along the way.
    let at = |k: f64| -> Point {
        let (side, t) = ((k / PIECES as f64) as usize % 4, (k / PIECES as f64).fract());
        let t = 2.0 * t - 1.0;
        [[t, -1.0], [1.0, t], [-t, 1.0], [-1.0, -t]][side]
    };
    let free = |k: usize| {
        let p = mesh.from_reference(cell, at((k % count) as f64 + 0.5));
        !parts.is_solid(p)
    };
    let starts: Vec<usize> = (0..count).filter(|&k| free(k) && !free(k + count - 1)).collect();
    let [start] = starts[..] else { return None };
    let length = (0..count).take_while(|k| free(start + k)).count();
    let mut sum = [0.0; 2 * NODES];
    let mut out = Vec::with_capacity(length + 1);
    for k in start..start + length {
        let (k, side) = (k % count, (k % count) / PIECES);
        let r = at(k as f64 + 0.5);
        let n = Shape::values(r);
        let (c, outwards) = [(1, -1.0), (0, 1.0), (1, 1.0), (0, -1.0)][side];
        let flux = outwards * [hy, hx][c] / PIECES as f64;
        let mut half = sum;
        for a in 0..NODES {
            half[NODES * c + a] += 0.5 * flux * n[a];
            sum[NODES * c + a] += flux * n[a];
        }
        out.push((mesh.from_reference(cell, r), half));
    }
    // The flux that is left by rounding and at the ends is spread over the way.
    for (k, (_, psi)) in out.iter_mut().enumerate() {
        let share = (k as f64 + 0.5) / length as f64;
        psi.iter_mut().zip(&sum).for_each(|(psi, sum)| *psi -= share * sum);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::super::outline::Outline;
    use super::super::parts::Solid;
    use super::*;

    #[test]
    fn a_flow_along_a_slanted_wall_is_found_again() {
        let axis = || Axis::new((0..=6).map(|k| f64::from(k) / 6.0).collect(), false);
        let corners = vec![[-1.0, -0.2], [2.0, 1.1], [2.0, -3.0], [-1.0, -3.0]];
        let outline = Outline::polygon(corners);
        let solid = Solid::at_rest("wall", outline.clone(), true);
        let mesh = Mesh::new(axis(), axis()).with_solids(vec![solid]);
        let parts = mesh.parts().unwrap();
        let along = [3.0 / 3.0f64.hypot(1.3), 1.3 / 3.0f64.hypot(1.3)];
        let exact = |p: Point| {
            let d = outline.distance(p);
            let speed = if outline.contains(p) { d } else { d * (1.0 - d) };
            along.map(|c| c * speed)
        };
        let mut count = 0;
        for (cell, part) in parts.all() {
            let Some(stream) = &part.stream else { continue };
            count += 1;
            let flow = stream
                .flow(&mesh.cell_nodes(cell).map(|n| exact(mesh.node_position(n))), &[1.0; NODES]);
            for q in &part.points {
                let p = mesh.from_reference(cell, q.r);
                let u = stream.velocity(&flow, p, (outline.distance(p), outline.normal(p)), 1.0);
                let e = exact(p);
                let error = (u[0] - e[0]).hypot(u[1] - e[1]);
                assert!(error < 2e-3, "{cell}: {u:?} {e:?}");
            }
        }
        assert!(count > 5, "{count}");
    }
}
