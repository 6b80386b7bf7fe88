//! The discrete problem on one mesh, and the vectors that its solution works with.

use super::element::Nodal;
use super::matrices::Matrices;
use super::multifrontal::Multifrontal;
use super::quadrature::Quadrature;
use super::report::Stopping;
use super::terms::Terms;
use crate::simd::Simd;
use crate::space::constraints::Constraints;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use crate::space::shape::NODES;
use crate::threads;
use std::sync::Arc;

/// Cells, and nodes, that are worth a task of their own.
pub(super) const CELL_GRAIN: usize = 128;
pub(super) const NODE_GRAIN: usize = 2048;

/// The discrete problem on one mesh: boundary conditions, element matrices, factor.
pub struct Stokes<const D: usize> {
    pub(super) mesh: Arc<Mesh>,
    pub(super) incidence: Arc<Incidence>,
    pub(super) constraints: Constraints<D>,
    pub(super) matrices: Matrices<D>,
    pub(super) factor: Multifrontal<D>,
    /// Unaugmented diagonal, per node, and one over it.
    pub(super) diagonal: Vec<[f64; D]>,
    pub(super) inverse_diagonal: Vec<[f64; D]>,
    pub(super) simd: Simd,
    pub(super) work: Work<D>,
}

/// What drives a solution.
#[derive(Clone, Copy)]
pub struct Loads<'a, const D: usize> {
    /// Force (and couple) at each node.
    pub nodal: &'a [[f64; D]],
    pub terms: &'a Terms,
}

/// What a solution is asked for.
pub(super) struct Given<'a, const D: usize> {
    pub(super) quadrature: &'a Quadrature,
    pub(super) loads: Loads<'a, D>,
    pub(super) stopping: Stopping,
}

/// Vectors of the corrections, kept from one solution to the next.
#[derive(Default)]
pub(super) struct Work<const D: usize> {
    pub(super) residual: Residual<D>,
    /// What each cell has for its nodes.
    pub(super) shares: Vec<Share<D>>,
    /// Right-hand side and solution on the skeleton.
    pub(super) skeleton: Vec<f64>,
    pub(super) correction: Correction<D>,
    /// Corrections of this solution, of orthonormal divergence; the first `kept` are valid.
    pub(super) directions: Vec<Correction<D>>,
    pub(super) kept: usize,
}

/// What a cell adds to the forces on its nodes, and to sums over all cells.
#[derive(Clone, Copy)]
pub(super) struct Share<const D: usize> {
    pub(super) force: Nodal<D>,
    pub(super) divergence: [f64; 3],
    pub(super) sums: [f64; SUMS],
}

/// Sums over cells in a [`Residual`].
pub(super) const SUMS: usize = 7;

impl<const D: usize> Default for Share<D> {
    fn default() -> Self {
        Share { force: [[0.0; D]; NODES], divergence: [0.0; 3], sums: [0.0; SUMS] }
    }
}

/// Residuals of a state, and powers that come with them.
#[derive(Default)]
pub(super) struct Residual<const D: usize> {
    /// `f - K u + B' p`, constrained rows included.
    pub(super) force: Vec<[f64; D]>,
    /// `B u + C p`
    pub(super) divergence: Vec<[f64; 3]>,
    pub(super) dissipation: f64,
    pub(super) restoring: f64,
    pub(super) strain: f64,
    pub(super) divergence_norm: f64,
    /// `||B' p||^2_{1/D}`, cell by cell.
    pub(super) pressure_norm: f64,
    /// `||W^-1 p||^2`, the divergence that would make such a pressure.
    pub(super) penalty_norm: f64,
    /// `integral p^2`
    pub(super) pressure_square: f64,
    /// Largest mean viscosity of a cell.
    pub(super) stiffest: f64,
}

/// A change of velocity (and rotation) and pressure.
#[derive(Clone, Default)]
pub(super) struct Correction<const D: usize> {
    pub(super) velocity: Vec<[f64; D]>,
    pub(super) pressure: Vec<[f64; 3]>,
    /// `B du + C dp`
    pub(super) divergence: Vec<[f64; 3]>,
}

impl<const D: usize> Correction<D> {
    pub(super) fn add_scaled(&mut self, factor: f64, o: &Correction<D>) {
        add_scaled(&mut self.velocity, factor, &o.velocity);
        add_scaled(&mut self.pressure, factor, &o.pressure);
        add_scaled(&mut self.divergence, factor, &o.divergence);
    }

    pub(super) fn scale(&mut self, factor: f64) {
        fn scale<const N: usize>(a: &mut [[f64; N]], factor: f64) {
            threads::for_each(a, NODE_GRAIN, |_, a| a.iter_mut().for_each(|v| *v *= factor));
        }
        scale(&mut self.velocity, factor);
        scale(&mut self.pressure, factor);
        scale(&mut self.divergence, factor);
    }
}

/// `a += factor b`
pub(super) fn add_scaled<const N: usize>(a: &mut [[f64; N]], factor: f64, b: &[[f64; N]]) {
    threads::for_each(a, NODE_GRAIN, |k, a| {
        for c in 0..N {
            a[c] += factor * b[k][c];
        }
    });
}
