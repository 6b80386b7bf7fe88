//! This module defines the boundary conditions of the solver: prescribed nodal values, and the null
//! spaces of the problem.

use super::embedding::{self, Embedding};
use super::flow::Flow;
use super::mesh::Mesh;
use super::shape::{GAUSS_3X3, NODES, SIDE_NODES, side_normal};

/// The sides of a cell, in the order of [`SIDE_NODES`], on all nodes of which the velocity is
/// prescribed.
#[derive(Clone, Copy, Debug, Default)]
pub struct FixedSides {
    /// One of its components.
    pub any: [bool; 4],
    /// The component along the side.
    pub along: [bool; 4],
}

/// What the rules of mixture need to know of the walls.
#[derive(Clone, Debug)]
pub struct Walls {
    /// Sides of each cell on which the velocity is prescribed.
    pub sides: Vec<FixedSides>,
    /// Current gravity, in the plan's units.
    pub gravity: [f64; 2],
}

impl Walls {
    /// No walls and no gravity.
    pub fn free(cells: usize) -> Self {
        Walls { sides: vec![FixedSides::default(); cells], gravity: [0.0; 2] }
    }

    /// Whether a side of a cell is a rough wall on which material may lie: the velocity along it is
    /// prescribed, and gravity does not pull away from it.
    pub fn carries(&self, cell: usize, side: usize) -> bool {
        let down = self.gravity[side_normal(side)];
        let outward = if side % 2 == 1 { down } else { -down };
        let rounding = 1e-9 * self.gravity[0].hypot(self.gravity[1]);
        self.sides[cell].along[side] && outward >= -rounding
    }
}

/// Prescribed values of nodal unknowns, and the null spaces that remain.
#[derive(Clone, Debug)]
pub struct Constraints<const D: usize> {
    fixed: Vec<[bool; D]>,
    value: Vec<[f64; D]>,
    /// Directions (x, y) of free rigid translation: one node is fixed, then the mean is subtracted.
    free_translation: [bool; 2],
    /// Whether no boundary lets fluid out, so that the pressure is determined up to a constant.
    closed: bool,
    /// Point at which the pressure is given if it is determined only up to a constant; its mean is
    /// zero if no point is given.
    reference: Option<PressurePoint>,
    /// Relations of the nodes of cells with solids of any shape.
    embedding: Option<Box<Embedding>>,
}

/// A given pressure at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressurePoint {
    /// The point, in the plan's units.
    pub at: [f64; 2],
    /// Pressure, in the plan's units.
    pub value: f64,
}

impl<const D: usize> Constraints<D> {
    /// No constraints on the nodes of a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        Constraints {
            fixed: vec![[false; D]; mesh.nodes()],
            value: vec![[0.0; D]; mesh.nodes()],
            free_translation: [false; 2],
            closed: false,
            reference: None,
            embedding: None,
        }
    }

    /// Adds the conditions on the solids of any shape in the mesh. Other conditions must be
    /// prescribed before.
    pub fn embed(&mut self, mesh: &Mesh) {
        let Some(parts) = mesh.parts() else { return };
        let given = |node, c| if c < D { self.fixed_value(node, c) } else { None };
        let relations = Embedding::new(mesh, parts, given);
        for (node, c, value) in embedding::aligned(mesh, parts, |node| relations.holds(node)) {
            if c < D {
                self.fix(node, c, value);
            }
        }
        for node in relations.nodes() {
            for c in (0..D).filter(|&c| relations.binds(node, c)) {
                let known = relations.known(node, c);
                self.fixed[node][c] = known.is_some();
                self.value[node][c] = known.unwrap_or(0.0);
            }
        }
        self.embedding = Some(Box::new(relations));
    }

    /// The relations of the nodes of cells with solids of any shape, if there are any. Prescribed
    /// values of such nodes are those of their unknowns.
    pub fn embedding(&self) -> Option<&Embedding> {
        self.embedding.as_deref()
    }

    /// Prescribes component `c` of a node, unless an earlier call has prescribed it.
    pub fn fix(&mut self, node: usize, c: usize, value: f64) {
        if !self.fixed[node][c] {
            self.fixed[node][c] = true;
            self.value[node][c] = value;
        }
    }
    /// Whether component `c` of a node is prescribed.
    pub fn is_fixed(&self, node: usize, c: usize) -> bool {
        self.fixed[node][c]
    }
    /// Prescribed value of component `c` of a node, if any.
    pub fn fixed_value(&self, node: usize, c: usize) -> Option<f64> {
        self.fixed[node][c].then_some(self.value[node][c])
    }

    /// Whether a velocity other than zero is prescribed.
    pub fn is_driven(&self) -> bool {
        let moves =
            |(fixed, value): (&[bool; D], &[f64; D])| (0..2).any(|c| fixed[c] && value[c] != 0.0);
        self.fixed.iter().zip(&self.value).any(moves)
    }

    /// The sides of a cell on which the velocity is prescribed.
    pub fn fixed_sides(&self, mesh: &Mesh, cell: usize) -> FixedSides {
        let nodes = mesh.cell_nodes(cell);
        let fixed = |s: usize, c| SIDE_NODES[s].iter().all(|&a| self.is_fixed(nodes[a], c));
        FixedSides {
            any: std::array::from_fn(|s| (0..2).any(|c| fixed(s, c))),
            along: std::array::from_fn(|s| fixed(s, 1 - side_normal(s))),
        }
    }

    /// Declares a free rigid translation along `c`; its mean velocity will be zero.
    pub fn free_translation(&mut self, mesh: &Mesh, c: usize) {
        let node = (0..mesh.cells())
            .find(|&cell| !mesh.solid[cell])
            .map_or(0, |cell| mesh.cell_nodes(cell)[0]);
        self.fix(node, c, 0.0);
        self.free_translation[c] = true;
    }
    /// Declares that the pressure is determined only up to a constant; its mean will be zero.
    pub fn close(&mut self) {
        self.closed = true;
    }

    /// Gives the pressure at a point, if it is determined only up to a constant.
    pub fn refer(&mut self, reference: Option<PressurePoint>) {
        self.reference = reference;
    }

    /// Sets the prescribed components to their values.
    pub fn impose(&self, velocity: &mut [[f64; D]]) {
        let relations = self.embedding.as_deref();
        for (node, u) in velocity.iter_mut().enumerate() {
            let (fixed, value) = (&self.fixed[node], &self.value[node]);
            for c in 0..D {
                if fixed[c] && !relations.is_some_and(|r| r.binds(node, c)) {
                    u[c] = value[c];
                }
            }
        }
        if let Some(relations) = relations {
            relations.impose(velocity);
        }
    }

    /// Subtracts the mean velocity along free translations, and determines the constant of the
    /// pressure if there is one.
    pub fn remove_null_space(&self, mesh: &Mesh, flow: &mut Flow<D>) {
        let cells = || (0..mesh.cells()).filter(|&c| !mesh.solid[c]);
        let area: f64 = cells().map(|c| mesh.cell_volume(c)).sum();
        for c in (0..2).filter(|&c| self.free_translation[c]) {
            let mut mean = 0.0;
            for cell in cells() {
                let u = flow.of_cell(mesh, cell);
                let measure = mesh.cell_measure(cell);
                let at = |n: &[f64; NODES]| (0..NODES).map(|a| n[a] * u[a][c]).sum::<f64>();
                let points = GAUSS_3X3.iter();
                let inside: f64 =
                    points.map(|g| measure.share(g.weight, g.r[0]) * at(&g.shape.n)).sum();
                mean += inside * measure.volume() / area;
            }
            flow.velocity.iter_mut().for_each(|u| u[c] -= mean);
        }
        if let (true, Some(PressurePoint { at, value })) = (self.closed, self.reference) {
            let shift = value - flow.pressure_at(mesh, at);
            cells().for_each(|c| flow.pressure[c][0] += shift);
        } else if self.closed {
            let mean: f64 =
                cells().map(|c| flow.pressure[c][0] * mesh.cell_volume(c)).sum::<f64>() / area;
            cells().for_each(|c| flow.pressure[c][0] -= mean);
        }
    }
}
