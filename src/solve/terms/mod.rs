//! This module holds the terms of the balances of momentum and angular momentum. Each file states
//! one formula and computes its contribution to the matrix, the load and the power.
//!
//! | term | file | matrix | load |
//! |---|---|---|---|
//! | stresses of the materials | [`stress`], [`viscous`] | yes | |
//! | coupling beyond the shear viscosity | [`rotation`] | yes | |
//! | pressure and incompressibility | [`pressure`] | penalty | |
//! | weight of the materials | [`weight`] | | yes |
//! | inertia | [`inertia`] | yes | yes |
//! | restoring force of stable stratification | [`restoring`] | yes | yes |
//! | friction at walls along which material slips | [`slip`] | yes | yes |
//! | friction along outlines of solids | [`slip_outline`] | yes | yes |
//! | body forces and tractions fixed in space | [`plan::loads`](crate::plan::loads) | | yes |
//!
//! The first three exist in every cell and are called by name. [`Terms`] lists the terms that only
//! some scenes have; the friction at walls depends on the laws of the materials beside them and is part
//! of the [`quadrature`](crate::solve::quadrature).

pub mod contact;
pub mod inertia;
pub mod pressure;
pub mod restoring;
pub mod rotation;
pub mod slip;
pub mod slip_outline;
pub mod stress;
pub mod viscous;
pub mod weight;

use crate::plan::Plan;
use crate::space::shape::NODES;
use inertia::Inertia;
use restoring::Restoring;

/// Velocities and rotations of the nodes of a cell, or forces and couples on them.
pub type Motion = [[f64; 3]; NODES];

/// A symmetric positive term on whole cells that acts on velocities, and possibly on rotations.
pub trait CellTerm: Send + Sync {
    /// Whether the term contributes to a cell.
    fn acts_on(&self, cell: usize) -> bool;

    /// Number of components on which the term acts: the two velocities, or the rotation besides.
    fn components(&self) -> usize {
        2
    }

    /// Entry of the matrix of a cell for nodes `a`, `b` and components `c`, `d`.
    fn entry(&self, cell: usize, nodes: [usize; 2], components: [usize; 2]) -> f64;

    /// Forces and couples on the nodes of a cell with the velocities and rotations `u`, and the power
    /// that they take from the flow.
    fn force(&self, cell: usize, nodes: &[usize; NODES], u: &Motion) -> (Motion, f64);
}

/// A side of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellFace {
    /// The cell whose matrix receives the term.
    pub cell: usize,
    /// Index into [`SIDE_NODES`](crate::space::shape::SIDE_NODES): left, right, bottom, top.
    pub side: usize,
}

/// A symmetric positive term on faces that acts on velocities.
pub trait FaceTerm: Send + Sync {
    /// The faces on which the term acts, in ascending order of their cells.
    fn faces(&self) -> &[CellFace];

    /// Entry of the matrix for the `k`th and `l`th node of a face and components `c`, `d`; `face`
    /// is an index into [`FaceTerm::faces`].
    fn entry(&self, face: usize, nodes: [usize; 2], components: [usize; 2]) -> f64;

    /// Forces on the nodes of a face with the velocities `u`, and their powers.
    fn force(&self, face: usize, nodes: [usize; 3], u: [[f64; 2]; 3]) -> ([[f64; 2]; 3], Powers);

    /// Forces on the nodes of a face at rest that drive a flow.
    fn drive(&self, _face: usize) -> [[f64; 2]; 3] {
        [[0.0; 2]; 3]
    }
}

/// Powers of the forces on a face. What the forces take from the flow is the sum of the first two less
/// the third.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Powers {
    /// Power of a numerical term.
    pub numerical: f64,
    /// Dissipated power.
    pub dissipated: f64,
    /// Power of the motion of a wall.
    pub supplied: f64,
}

/// Terms that only some scenes have.
#[derive(Default)]
pub struct Terms {
    /// Restoring force of stable stratification at large steps.
    pub restoring: Restoring,
    /// Inertia of the materials.
    pub inertia: Inertia,
    /// Further terms on faces, constant during a run.
    faces: Vec<Box<dyn FaceTerm>>,
}

impl Terms {
    /// The terms that a plan needs.
    pub fn of(_plan: &Plan) -> Self {
        Terms::default()
    }

    /// All terms over cells.
    pub fn on_cells(&self) -> [&dyn CellTerm; 2] {
        [&self.restoring, &self.inertia]
    }

    /// Number that changes if the terms change in cells whose content is the same.
    pub fn stamp(&self) -> u64 {
        self.inertia.rate.to_bits()
    }

    /// All terms on faces.
    pub fn on_faces(&self) -> impl Iterator<Item = &dyn FaceTerm> {
        let restoring: &dyn FaceTerm = &self.restoring;
        std::iter::once(restoring).chain(self.faces.iter().map(|f| f.as_ref()))
    }
}
