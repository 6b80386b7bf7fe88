//! This module computes the inertial term: `rate integral rho u . u~` with the rate `a_0/dt` of the
//! backward differentiation in time, and the load of the earlier velocities.
//!
//! ```text
//! rho du/dt = rho (a_0 u - a_1 u_1 + a_2 u_2)/dt
//! ```
//! `u_1` and `u_2` are the velocities, one and two steps before, of the material that is at a point
//! now; [`sim::inertia`](crate::sim::inertia) finds them. The density is that of the weight, so a
//! body in free fall has exactly the acceleration of gravity. Matrix and load use the same points,
//! so a uniform motion stays uniform. The rotation has no inertia.

use super::CellTerm;
use crate::space::shape::NODES;

/// Mass matrix of a cell for one component of the velocity.
pub type Mass = [[f64; NODES]; NODES];

/// The inertia of all cells.
#[derive(Clone, Debug, Default)]
pub struct Inertia {
    /// `a_0/dt`.
    pub rate: f64,
    /// Mass matrix of each cell; empty without inertia.
    pub mass: Vec<Mass>,
}

impl Inertia {
    /// Mass of a cell.
    fn total(&self, cell: usize) -> f64 {
        self.mass[cell].as_flattened().iter().sum()
    }

    /// Viscosity that resists a flow which varies over the length `h` of a cell of the given volume
    /// as much as the inertia does, `rate rho h^2`; zero without inertia.
    pub fn resistance(&self, cell: usize, volume: f64, h: f64) -> f64 {
        if self.mass.is_empty() { 0.0 } else { self.rate * self.total(cell) / volume * h * h }
    }

    /// `u . M u` of a cell with the nodal velocities `u`.
    pub fn square(&self, cell: usize, u: &[[f64; 2]; NODES]) -> f64 {
        let mut sum = 0.0;
        for (row, ua) in self.mass[cell].iter().zip(u) {
            for (m, ub) in row.iter().zip(u) {
                sum += m * (ua[0] * ub[0] + ua[1] * ub[1]);
            }
        }
        sum
    }
}

impl CellTerm for Inertia {
    fn acts_on(&self, _cell: usize) -> bool {
        !self.mass.is_empty()
    }

    fn entry(&self, cell: usize, [a, b]: [usize; 2], [c, d]: [usize; 2]) -> f64 {
        if c == d { self.rate * self.mass[cell][a][b] } else { 0.0 }
    }

    fn force(
        &self,
        cell: usize,
        _nodes: &[usize; NODES],
        u: [[f64; 2]; NODES],
    ) -> ([[f64; 2]; NODES], f64) {
        let mut force = [[0.0; 2]; NODES];
        for (f, row) in force.iter_mut().zip(&self.mass[cell]) {
            for (m, u) in row.iter().zip(&u) {
                f[0] -= self.rate * m * u[0];
                f[1] -= self.rate * m * u[1];
            }
        }
        (force, self.rate * self.square(cell, &u))
    }
}
