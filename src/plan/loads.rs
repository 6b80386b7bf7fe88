//! This module computes the loads that are constant during a run: `integral t . u~` of tractions on
//! the sides, and `integral f . u~ + c w~` of body forces and couples fixed in space.

use super::boundary::BoundaryPlan;
use super::{Plan, Units};
use crate::scene::FieldFn;
use crate::space::mesh::Mesh;
use crate::space::shape::side_normal;
use crate::space::shape::{GAUSS_5, NODES, Shape};

impl Plan {
    /// Nodal forces (and couples) of the tractions and the body force of the plan.
    pub fn fixed_loads<const D: usize>(&self) -> Vec<[f64; D]> {
        fixed_loads(&self.boundary, self.body_force.as_ref(), &self.mesh, &self.units)
    }
}

/// Nodal forces (and couples) of tractions, and of a force and couple per volume (SI).
pub fn fixed_loads<const D: usize>(
    boundary: &BoundaryPlan,
    body_force: Option<&[FieldFn; 3]>,
    mesh: &Mesh,
    units: &Units,
) -> Vec<[f64; D]> {
    let mut load = vec![[0.0; D]; mesh.nodes()];
    add_tractions(boundary, mesh, units, &mut load);
    if let Some(f) = body_force {
        add_body_force(mesh, units, f, &mut load);
    }
    load
}

/// Adds the nodal forces of prescribed tractions, integrated with 5 Gauss points per face.
fn add_tractions<const D: usize>(
    boundary: &BoundaryPlan,
    mesh: &Mesh,
    units: &Units,
    load: &mut [[f64; D]],
) {
    for (s, piece) in boundary.pieces() {
        let normal = side_normal(s);
        let edge = if s % 2 == 0 { -1.0 } else { 1.0 };
        for c in 0..2 {
            let Some(f) = &piece.conditions.traction[c] else { continue };
            for (_, cell) in piece.segment.cells_at_side(mesh, s) {
                if mesh.solid[cell] {
                    continue;
                }
                let nodes = mesh.cell_nodes(cell);
                let place = |t: f64| if normal == 0 { [edge, t] } else { [t, edge] };
                // The part of a face that a solid covers is not loaded.
                let free = |t: f64| !mesh.is_solid_in(cell, mesh.from_reference(cell, place(t)));
                let covered = mesh.part(cell).is_some();
                let fine = (0..if covered { PIECES } else { 0 })
                    .map(|k| ((2 * k + 1) as f64 / PIECES as f64 - 1.0, 1.0 / PIECES as f64))
                    .filter(|&(t, _)| free(t));
                let whole = GAUSS_5.into_iter().filter(|_| !covered);
                for (t, weight) in whole.chain(fine) {
                    let r = place(t);
                    let p = mesh.from_reference(cell, r).map(|v| v * units.length);
                    let n = Shape::values(r);
                    let area = mesh.face(cell, s).of_point(weight, t);
                    let force = area * f.at(p[0], p[1]) / units.stress();
                    for a in 0..NODES {
                        load[nodes[a]][c] += force * n[a];
                    }
                }
            }
        }
    }
}

/// Number of pieces of a face that a solid may cover.
const PIECES: usize = 64;

/// Adds the nodal forces of a force and couple per volume, integrated with 5 x 5 Gauss points, or
/// with the points of the part of the cell that solids leave free.
fn add_body_force<const D: usize>(
    mesh: &Mesh,
    units: &Units,
    force: &[FieldFn; 3],
    load: &mut [[f64; D]],
) {
    let scale = [units.force_density(), units.force_density(), units.stress()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let nodes = mesh.cell_nodes(cell);
        let measure = mesh.cell_measure(cell);
        let mut add = |r: [f64; 2], share: f64| {
            let p = mesh.from_reference(cell, r).map(|v| v * units.length);
            let n = Shape::values(r);
            let volume = measure.of_share(share);
            for c in 0..D {
                let f = volume * force[c].at(p[0], p[1]) / scale[c];
                for a in 0..NODES {
                    load[nodes[a]][c] += f * n[a];
                }
            }
        };
        if let Some(part) = mesh.part(cell) {
            part.points.iter().for_each(|p| add(p.r, p.weight));
            continue;
        }
        for (eta, wy) in GAUSS_5 {
            for (xi, wx) in GAUSS_5 {
                add([xi, eta], measure.share(wx * wy, xi));
            }
        }
    }
}
