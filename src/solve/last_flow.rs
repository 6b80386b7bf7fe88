//! This module gives the flow of the last iterate at the points at which laws are evaluated.

use super::element::{PointShape, rates};
use crate::laws::LocalFlow;
use crate::space::flow::interpolate;
use crate::space::mesh::Mesh;
use crate::space::shape::Shape;

/// Flow of the last iterate, for laws that depend on it.
pub trait LastFlow: Sync {
    /// Rates and pressure at the reference coordinates `r` of a cell, in the plan's units; `None`
    /// if no flow is known.
    fn at(&self, cell: usize, r: [f64; 2]) -> Option<LocalFlow>;

    /// Velocity and pressure at the reference coordinates `r` of a cell, in the plan's units; `None`
    /// if no flow is known.
    fn beside(&self, cell: usize, r: [f64; 2]) -> Option<([f64; 2], f64)>;
}

/// No flow is known.
pub struct NoFlow;

impl LastFlow for NoFlow {
    fn at(&self, _cell: usize, _r: [f64; 2]) -> Option<LocalFlow> {
        None
    }

    fn beside(&self, _cell: usize, _r: [f64; 2]) -> Option<([f64; 2], f64)> {
        None
    }
}

/// An iterate; its velocity and its pressure may be those of two flows.
pub struct Iterate<'a, const D: usize> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Velocity (and rotation) by node.
    pub velocity: &'a [[f64; D]],
    /// Pressure by cell.
    pub pressure: &'a [[f64; 3]],
}

impl<const D: usize> Iterate<'_, D> {
    fn pressure_at(&self, cell: usize, r: [f64; 2]) -> f64 {
        let basis = self.mesh.whole_measure(cell).pressure_basis(r);
        self.pressure[cell].iter().zip(basis).map(|(p, q)| p * q).sum()
    }
}

impl<const D: usize> LastFlow for Iterate<'_, D> {
    fn at(&self, cell: usize, r: [f64; 2]) -> Option<LocalFlow> {
        let shape = PointShape::new(&Shape::at(r), self.mesh.whole_measure(cell), r[0]);
        let nodal = self.mesh.cell_nodes(cell).map(|n| self.velocity[n]);
        Some(LocalFlow { rates: rates(&shape, &nodal), pressure: self.pressure_at(cell, r) })
    }

    fn beside(&self, cell: usize, r: [f64; 2]) -> Option<([f64; 2], f64)> {
        let nodal = self.mesh.cell_nodes(cell).map(|n| [self.velocity[n][0], self.velocity[n][1]]);
        Some((interpolate(&nodal, &Shape::values(r)), self.pressure_at(cell, r)))
    }
}
