//! This module leaves cells that nothing fills out of the discrete problem.

use super::multifrontal::Multifrontal;
use super::multifrontal::tree::Tree;
use super::problem::{Stokes, Work};
use crate::space::flow::Flow;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use std::sync::Arc;

impl<const D: usize> Stokes<D> {
    /// Leaves the cells that `is_empty` out of the problem: their nodes have no unknowns unless another cell
    /// has them too.
    pub fn leave_out(&mut self, mesh: &Mesh, is_empty: impl Fn(usize) -> bool) {
        let left_out = |cell: usize| mesh.solid[cell] || is_empty(cell);
        self.void = true;
        if (0..mesh.cells()).all(|cell| self.mesh.solid[cell] == left_out(cell)) {
            return;
        }
        let mut occupied = mesh.clone();
        occupied.solid.iter_mut().enumerate().for_each(|(cell, out)| *out = left_out(cell));
        self.incidence = Arc::new(Incidence::new(&occupied));
        let eliminates = |cell: usize| self.eliminated.get(cell).is_none_or(|&is| is);
        let all_eliminated = (0..mesh.cells()).all(|c| occupied.solid[c] || eliminates(c));
        if self.eliminated.is_empty() || !all_eliminated {
            // The elimination includes the cells around, so that it serves for the next steps too.
            let near =
                |cell: usize| !mesh.solid[cell] && mesh.block(cell).any(|c| !occupied.solid[c]);
            self.eliminated = (0..mesh.cells()).map(near).collect();
            let mut region = mesh.clone();
            let out = region.solid.iter_mut().zip(&self.eliminated);
            out.for_each(|(out, eliminated)| *out = !eliminated);
            self.factor = Multifrontal::new(Arc::new(Tree::new(&region)), mesh.cells());
        }
        self.mesh = Arc::new(occupied);
        // Vectors keep what they have for cells that are left out.
        self.work = Work::default();
    }

    /// The mesh of the problem, in which cells without material are solid.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Whether all cells of a node are left out.
    pub fn is_left_out(&self, node: usize) -> bool {
        self.incidence.of_node(node).next().is_none()
    }

    /// Sets the prescribed components to their values.
    pub fn impose(&self, velocity: &mut [[f64; D]]) {
        self.constraints.impose(velocity);
    }

    /// Subtracts what the equations leave undetermined. Beside a void the surface of the material determines
    /// the pressure.
    pub(super) fn remove_null_space(&self, flow: &mut Flow<D>) {
        if !self.void {
            self.constraints.remove_null_space(&self.mesh, flow);
        }
    }
}
