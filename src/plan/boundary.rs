//! Boundary conditions of a scene, and the constraints and loads they become.

use super::Units;
use crate::scene::FieldFn;
use crate::space::constraints::Constraints;
use crate::space::mesh::Mesh;
use crate::space::shape::{GAUSS_5, NODES, Shape};

/// What a side of the domain prescribes; SI values and coordinates.
#[derive(Clone, Debug, Default)]
pub struct Side {
    pub periodic: bool,
    pub velocity: [Option<FieldFn>; 2],
    pub traction: [Option<FieldFn>; 2],
    pub rotation: Option<FieldFn>,
}

/// A wall along a mesh line, by node numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct WallLine {
    /// 0: vertical, the normal is x; 1: horizontal.
    pub normal: usize,
    /// Node number along the normal.
    pub line: usize,
    /// First and last node along the wall.
    pub from: usize,
    pub to: usize,
    pub no_slip: bool,
    /// SI, 1/s.
    pub rotation: Option<f64>,
}

/// All boundary conditions.
#[derive(Clone, Debug, Default)]
pub struct BoundaryPlan {
    /// left, right, bottom, top
    pub sides: [Side; 4],
    pub walls: Vec<WallLine>,
    /// Directions in which nothing holds the scene.
    pub free_translation: [bool; 2],
    /// The pressure is known up to a constant.
    pub closed: bool,
}

/// Names of the sides, in the order of [`BoundaryPlan::sides`].
pub const SIDES: [&str; 4] = ["left", "right", "bottom", "top"];

/// Normal direction of a side.
pub fn side_normal(side: usize) -> usize {
    side / 2
}

/// Nodes of a side.
fn side_nodes(mesh: &Mesh, side: usize) -> Vec<usize> {
    let (ni, nj) = (mesh.x.nodes(), mesh.y.nodes());
    match side {
        0 => (0..nj).map(|j| mesh.node(0, j)).collect(),
        1 => (0..nj).map(|j| mesh.node(ni - 1, j)).collect(),
        2 => (0..ni).map(|i| mesh.node(i, 0)).collect(),
        _ => (0..ni).map(|i| mesh.node(i, nj - 1)).collect(),
    }
}

impl WallLine {
    fn nodes<'a>(&'a self, mesh: &'a Mesh) -> impl Iterator<Item = usize> + 'a {
        // A wall may end on the seam of a periodic axis.
        (self.from..=self.to).map(|k| match self.normal {
            0 => mesh.node(self.line, k % mesh.y.nodes()),
            _ => mesh.node(k % mesh.x.nodes(), self.line),
        })
    }
}

impl BoundaryPlan {
    /// Given nodal values. Where boundaries meet, normal velocities win over tangential ones.
    pub fn constraints<const D: usize>(&self, mesh: &Mesh, units: &Units) -> Constraints<D> {
        let mut out = Constraints::new(mesh);
        for pass in 0..2 {
            for (s, side) in self.sides.iter().enumerate().filter(|(_, s)| !s.periodic) {
                let c = if pass == 0 { side_normal(s) } else { 1 - side_normal(s) };
                if let Some(f) = &side.velocity[c] {
                    for node in side_nodes(mesh, s) {
                        out.fix(node, c, self.at_node(mesh, units, f, node) / units.velocity());
                    }
                }
            }
            for wall in &self.walls {
                if pass == 0 || wall.no_slip {
                    let c = if pass == 0 { wall.normal } else { 1 - wall.normal };
                    wall.nodes(mesh).for_each(|node| out.fix(node, c, 0.0));
                }
            }
        }
        if D == 3 {
            for (s, side) in self.sides.iter().enumerate() {
                if let Some(f) = &side.rotation {
                    for node in side_nodes(mesh, s) {
                        out.fix(node, 2, self.at_node(mesh, units, f, node) / units.rate());
                    }
                }
            }
            for wall in &self.walls {
                if let Some(w) = wall.rotation {
                    wall.nodes(mesh).for_each(|node| out.fix(node, 2, w / units.rate()));
                }
            }
        }
        for c in 0..2 {
            if self.free_translation[c] {
                out.free_translation(mesh, c);
            }
        }
        if self.closed {
            out.close();
        }
        out
    }

    fn at_node(&self, mesh: &Mesh, units: &Units, f: &FieldFn, node: usize) -> f64 {
        let [x, y] = mesh.node_position(node);
        f.at(x * units.length, y * units.length)
    }

    /// Adds the nodal forces of given tractions.
    pub fn add_tractions<const D: usize>(&self, mesh: &Mesh, units: &Units, load: &mut [[f64; D]]) {
        for (s, side) in self.sides.iter().enumerate() {
            let normal = side_normal(s);
            let edge = if s % 2 == 0 { -1.0 } else { 1.0 };
            let along = if normal == 0 { &mesh.y } else { &mesh.x };
            for c in 0..2 {
                let Some(f) = &side.traction[c] else { continue };
                for k in 0..along.cells() {
                    let across = if normal == 0 { mesh.x.cells() } else { mesh.y.cells() };
                    let m = if s % 2 == 0 { 0 } else { across - 1 };
                    let cell = if normal == 0 { mesh.cell(m, k) } else { mesh.cell(k, m) };
                    if mesh.solid[cell] {
                        continue;
                    }
                    let nodes = mesh.cell_nodes(cell);
                    for (t, weight) in GAUSS_5 {
                        let r = if normal == 0 { [edge, t] } else { [t, edge] };
                        let p = mesh.from_reference(cell, r).map(|v| v * units.length);
                        let n = Shape::values(r);
                        let force = weight * along.size(k) * f.at(p[0], p[1]) / units.stress();
                        for a in 0..NODES {
                            load[nodes[a]][c] += force * n[a];
                        }
                    }
                }
            }
        }
    }

    /// Net outflow through the sides' given normal velocities, and the sum of its magnitudes.
    pub fn net_outflow<const D: usize>(&self, mesh: &Mesh, given: &Constraints<D>) -> (f64, f64) {
        const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
        let (mut net, mut total) = (0.0, 0.0);
        for (s, side) in self.sides.iter().enumerate().filter(|(_, s)| !s.periodic) {
            let normal = side_normal(s);
            if side.velocity[normal].is_none() {
                continue;
            }
            let sign = if s % 2 == 0 { -1.0 } else { 1.0 };
            let axis = if normal == 0 { &mesh.y } else { &mesh.x };
            let nodes = side_nodes(mesh, s);
            for k in 0..axis.cells() {
                for (a, weight) in SIMPSON.iter().enumerate() {
                    let node = nodes[axis.cell_node(k, a)];
                    let v = given.fixed_value(node, normal).unwrap_or(0.0);
                    net += sign * weight * axis.size(k) * v;
                    total += weight * axis.size(k) * v.abs();
                }
            }
        }
        (net, total)
    }
}

/// Nodal forces of a force and couple per volume fixed in space (SI), integrated by 5 x 5 Gauss
/// points.
pub fn add_body_force<const D: usize>(
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
                let volume = wx * wy * mesh.cell_area(cell);
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
