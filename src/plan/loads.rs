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
                for (t, weight) in GAUSS_5 {
                    let r = if normal == 0 { [edge, t] } else { [t, edge] };
                    let p = mesh.from_reference(cell, r).map(|v| v * units.length);
                    let n = Shape::values(r);
                    let force =
                        weight * mesh.face_area(cell, normal) * f.at(p[0], p[1]) / units.stress();
                    for a in 0..NODES {
                        load[nodes[a]][c] += force * n[a];
                    }
                }
            }
        }
    }
}

/// Adds the nodal forces of a force and couple per volume, integrated with 5 x 5 Gauss points.
fn add_body_force<const D: usize>(
    mesh: &Mesh,
    units: &Units,
    force: &[FieldFn; 3],
    load: &mut [[f64; D]],
) {
    let scale = [units.force_density(), units.force_density(), units.stress()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let nodes = mesh.cell_nodes(cell);
        for (eta, wy) in GAUSS_5 {
            for (xi, wx) in GAUSS_5 {
                let p = mesh.from_reference(cell, [xi, eta]).map(|v| v * units.length);
                let n = Shape::values([xi, eta]);
                let volume = wx * wy * mesh.cell_volume(cell);
                for c in 0..D {
                    let f = volume * force[c].at(p[0], p[1]) / scale[c];
                    for a in 0..NODES {
                        load[nodes[a]][c] += f * n[a];
                    }
                }
            }
        }
    }
}
