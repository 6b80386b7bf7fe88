//! This module lets cells beside solids change their volume where their nodes cannot keep it.
//!
//! Where a solid leaves little room to another solid or to a side of the domain, or where a solid is
//! thinner than the mesh can show, the nodes of some cells can have fewer independent velocities than the
//! cells have conditions `div u = 0`. If a solid moves, a solution then exists only by chance; if all are at
//! rest, the pressures are not determined. The corrections leave a divergence in these cells. They get
//! a bulk viscosity instead, a large multiple of their viscosity:
//!
//! ```text
//! B u + C p = 0,    C = Mp / (BULK eta)
//! ```
//! The volume that this changes is of the size of the error of the velocity there, which a cell that
//! sees two walls cannot represent; particles keep their volumes in any case.

use super::quadrature::Quadrature;
use crate::space::mesh::Mesh;

/// Bulk viscosity of these cells in units of their viscosity.
const BULK: f64 = 1e3;

/// Relative addition to the diagonal of a matrix that is not positive definite by rounding.
const GUARD: f64 = 1e-12;

/// Divergence of a cell, relative to the largest, from which it is one of these cells.
const SHARE: f64 = 0.1;

/// Divergence, in units of the tolerance, up to which corrections that reduce it slowly go on.
const SMALL: f64 = 1e3;

/// Number of corrections that must reduce the divergence at least by the factor [`FALLS`]: where there is
/// no solution, it hardly changes; where thin fluid is in a gap, it may fall slowly.
const CORRECTIONS: usize = 12;
const FALLS: f64 = 0.99;

/// Divergences of the last corrections.
#[derive(Default)]
pub(super) struct Course {
    last: Vec<f64>,
    stalled: bool,
}

impl Course {
    /// Takes the next divergence; returns whether the corrections no longer reduce it.
    pub(super) fn stalls(&mut self, divergence: f64, tolerance: f64) -> bool {
        self.last.push(divergence);
        let before = self.last.len().checked_sub(CORRECTIONS + 1).map(|k| self.last[k]);
        let falls = before.is_none_or(|before| divergence <= FALLS * before);
        self.stalled = divergence > SMALL * tolerance && !falls;
        self.stalled
    }

    /// What the last call of [`Course::stalls`] returned.
    pub(super) fn has_stalled(&self) -> bool {
        self.stalled
    }
}

/// The cells that may change their volume.
#[derive(Clone, Debug, Default)]
pub struct Loose {
    /// By cell; empty if there are none.
    cells: Vec<bool>,
    /// Whether unknowns have turned out to be dependent.
    dependent: bool,
}

impl Loose {
    /// Whether a cell is among them.
    pub(super) fn contains(&self, cell: usize) -> bool {
        self.cells.get(cell).is_some_and(|&loose| loose)
    }

    /// Relative addition to the diagonal of the factored matrix where unknowns are not velocities.
    pub(super) fn guard(&self) -> f64 {
        if self.dependent { GUARD } else { 0.0 }
    }

    /// Declares that the velocities beside solids depend on fewer combinations of the unknowns than there are,
    /// as where solids leave little of several cells; returns whether that was not known.
    pub(super) fn declare_dependent(&mut self) -> bool {
        !std::mem::replace(&mut self.dependent, true)
    }

    /// Their number.
    pub(super) fn count(&self) -> usize {
        self.cells.iter().filter(|&&loose| loose).count()
    }

    /// Additional inverse bulk viscosity of a cell.
    pub(super) fn compliance(&self, mesh: &Mesh, quadrature: &Quadrature, cell: usize) -> f64 {
        if self.contains(cell) { 1.0 / (BULK * stiffness(mesh, quadrature, cell)) } else { 0.0 }
    }

    /// Adds the cells at solids with the largest divergences; returns whether there are any that were not
    /// among them.
    pub(super) fn add_largest(&mut self, mesh: &Mesh, divergence: &[[f64; 3]]) -> bool {
        let density = |cell: usize| divergence[cell][0].abs() / mesh.cell_volume(cell);
        let cells = (0..mesh.cells()).filter(|&c| !mesh.solid[c]);
        let largest = cells.clone().map(density).fold(0.0, f64::max);
        let beside = |cell: usize| mesh.block(cell).any(|c| mesh.part(c).is_some());
        self.cells.resize(mesh.cells(), false);
        let mut any = false;
        for cell in cells.filter(|&c| density(c) > SHARE * largest && beside(c)) {
            any |= !std::mem::replace(&mut self.cells[cell], true);
        }
        any
    }
}

/// Viscosity that resists the divergence of a cell. The unknowns of a cell with a solid in it are those
/// of its neighbours, of which the most viscous counts: with the cell's own viscosity, thin fluid beside
/// a solid and a heavy fluid takes too many corrections.
pub(super) fn stiffness(mesh: &Mesh, quadrature: &Quadrature, cell: usize) -> f64 {
    let own = quadrature.mean_viscosity[cell];
    if mesh.part(cell).is_none() {
        return own;
    }
    let near = mesh.block(cell).filter(|&c| !mesh.solid[c]);
    near.map(|c| quadrature.mean_viscosity[c]).fold(own, f64::max)
}
