//! This module defines the discrete problem on one mesh and the vectors used to solve it.

use super::element::Nodal;
use super::loose::Loose;
use super::matrices::Matrices;
use super::multifrontal::Multifrontal;
use super::quadrature::Quadrature;
use super::report::Stopping;
use super::terms::Terms;
use crate::simd::Simd;
use crate::space::constraints::Constraints;
use crate::space::embedding::Embedding;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use crate::space::shape::NODES;
use crate::threads;
use std::sync::Arc;

/// Largest number of cells per task.
pub(super) const CELL_GRAIN: usize = 128;
/// Largest number of nodes per task.
pub(super) const NODE_GRAIN: usize = 2048;

/// The discrete problem on one mesh: boundary conditions, element matrices, factor.
pub struct Stokes<const D: usize> {
    /// The mesh.
    pub(super) mesh: Arc<Mesh>,
    /// Incidence of cells and nodes.
    pub(super) incidence: Arc<Incidence>,
    /// Boundary conditions.
    pub(super) constraints: Constraints<D>,
    /// Element matrices.
    pub(super) matrices: Matrices<D>,
    /// Sparse factor of the skeleton matrix.
    pub(super) factor: Multifrontal<D>,
    /// Diagonal of the matrix without augmentation, by node.
    pub(super) diagonal: Vec<[f64; D]>,
    /// Inverse of `diagonal`.
    pub(super) inverse_diagonal: Vec<[f64; D]>,
    /// Instruction set of the kernels.
    pub(super) simd: Simd,
    /// Vectors of the corrections.
    pub(super) work: Work<D>,
    /// Cells that may change their volume.
    pub(super) loose: Loose,
    /// Whether a void is around the materials; its cells are solid in the mesh of the problem.
    pub(super) void: bool,
    /// Cells of the elimination beside a void: those of the problem and some around them, whose matrices are
    /// zero.
    pub(super) eliminated: Vec<bool>,
}

/// Loads that drive a solution.
#[derive(Clone, Copy)]
pub struct Loads<'a, const D: usize> {
    /// Force (and couple) at each node.
    pub nodal: &'a [[f64; D]],
    /// Terms that only some scenes have.
    pub terms: &'a Terms,
    /// Weight per volume of each cell; it is used only where solids of any shape are.
    pub weight: &'a [[f64; 2]],
}

/// Inputs of a solution.
pub(super) struct Given<'a, const D: usize> {
    /// Integration points with their laws.
    pub(super) quadrature: &'a Quadrature,
    /// Loads.
    pub(super) loads: Loads<'a, D>,
    /// Stopping criteria.
    pub(super) stopping: Stopping,
}

/// Vectors of the corrections, reused from one solution to the next.
#[derive(Default)]
pub(super) struct Work<const D: usize> {
    /// Residual of the current flow.
    pub(super) residual: Residual<D>,
    /// Contribution of each cell to its nodes.
    pub(super) shares: Vec<Share<D>>,
    /// Right-hand side and solution on the skeleton.
    pub(super) skeleton: Vec<f64>,
    /// The current correction.
    pub(super) correction: Correction<D>,
    /// Corrections of this solution, with orthonormal divergences; the first `kept` are valid.
    pub(super) directions: Vec<Correction<D>>,
    /// Number of valid `directions`.
    pub(super) kept: usize,
}

/// Contribution of a cell to the forces on its nodes and to the sums over all cells.
#[derive(Clone, Copy)]
pub(super) struct Share<const D: usize> {
    /// Forces on the nodes of the cell.
    pub(super) force: Nodal<D>,
    /// Divergence against the pressures `1, xi, eta`.
    pub(super) divergence: [f64; 3],
    /// Terms of the sums over cells.
    pub(super) sums: [f64; SUMS],
}

/// Number of sums over cells in a [`Residual`].
pub(super) const SUMS: usize = 8;

impl<const D: usize> Default for Share<D> {
    fn default() -> Self {
        Share { force: [[0.0; D]; NODES], divergence: [0.0; 3], sums: [0.0; SUMS] }
    }
}

/// Residuals of a flow, with powers and norms that are computed with them.
#[derive(Default)]
pub(super) struct Residual<const D: usize> {
    /// `f - K u + B' p`, including constrained rows; for nodes with relations that on their unknowns.
    pub(super) force: Vec<[f64; D]>,
    /// The same for the velocities of the nodes with relations, in the order of
    /// [`Embedding::nodes`](crate::space::embedding::Embedding::nodes).
    pub(super) on_solids: Vec<[f64; D]>,
    /// `B u + C p`.
    pub(super) divergence: Vec<[f64; 3]>,
    /// Viscous dissipation.
    pub(super) dissipation: f64,
    /// Power of the terms that only some scenes have.
    pub(super) restoring: f64,
    /// Power of the motion of walls along which material slips, and of the pressure on what moving solids
    /// take from cells.
    pub(super) supplied: f64,
    /// Square of the forces of moving walls along which material slips and of moving solids, in the norm
    /// of the residual, summed face by face and cell by cell.
    pub(super) drive: f64,
    /// `integral D:D`.
    pub(super) strain: f64,
    /// Square of the L2 norm of the projected divergence.
    pub(super) divergence_norm: f64,
    /// `||B' p||^2_{1/D}`, summed cell by cell.
    pub(super) pressure_norm: f64,
    /// `||W^-1 p||^2`: the divergence for which the penalty would give this pressure.
    pub(super) penalty_norm: f64,
    /// `integral p^2`.
    pub(super) pressure_square: f64,
    /// Power of the pressures that are given in cells with solids in them.
    pub(super) continued: f64,
    /// Largest mean viscosity of a cell.
    pub(super) stiffest: f64,
}

impl<const D: usize> Residual<D> {
    /// Power of the residual at the nodes with relations with the velocities `u`.
    pub(super) fn power_on_solids(&self, relations: &Embedding, u: &[[f64; D]]) -> f64 {
        let nodes = relations.nodes().zip(&self.on_solids);
        let of = |(node, f): (usize, &[f64; D])| {
            let bound = (2..D).filter(|&c| relations.binds(node, c));
            f[0] * u[node][0] + f[1] * u[node][1] + bound.map(|c| f[c] * u[node][c]).sum::<f64>()
        };
        nodes.map(of).sum()
    }
}

/// A change of velocity (and rotation) and pressure.
#[derive(Clone, Default)]
pub(super) struct Correction<const D: usize> {
    /// Change `du` of velocity (and rotation), by node.
    pub(super) velocity: Vec<[f64; D]>,
    /// Change `dp` of the pressure, by cell.
    pub(super) pressure: Vec<[f64; 3]>,
    /// `B du + C dp`.
    pub(super) divergence: Vec<[f64; 3]>,
}

impl<const D: usize> Correction<D> {
    /// Adds `factor` times another correction.
    pub(super) fn add_scaled(&mut self, factor: f64, o: &Correction<D>) {
        add_scaled(&mut self.velocity, factor, &o.velocity);
        add_scaled(&mut self.pressure, factor, &o.pressure);
        add_scaled(&mut self.divergence, factor, &o.divergence);
    }

    /// Multiplies the correction by `factor`.
    pub(super) fn scale(&mut self, factor: f64) {
        fn scale<const N: usize>(a: &mut [[f64; N]], factor: f64) {
            threads::for_each(a, NODE_GRAIN, |_, a| a.iter_mut().for_each(|v| *v *= factor));
        }
        scale(&mut self.velocity, factor);
        scale(&mut self.pressure, factor);
        scale(&mut self.divergence, factor);
    }
}

/// `a += factor b`.
pub(super) fn add_scaled<const N: usize>(a: &mut [[f64; N]], factor: f64, b: &[[f64; N]]) {
    threads::for_each(a, NODE_GRAIN, |k, a| {
        for c in 0..N {
            a[c] += factor * b[k][c];
        }
    });
}
