//! This module computes the inertial terms: `rate integral rho u . u~` with the rate `a_0/dt` of the
//! backward differentiation in time, and the load of the earlier velocities; for the rotation of
//! materials with a micro-inertia `j`, `rate integral rho j w w~`.
//!
//! ```text
//! rho du/dt = rho (a_0 u - a_1 u_1 + a_2 u_2)/dt
//! rho j dw/dt = rho j (a_0 w - a_1 w_1 + a_2 w_2)/dt
//! ```
//! `u_1` and `u_2` are the velocities, one and two steps before, of the material that is at a point
//! now; [`sim::inertia`](crate::sim::inertia) finds them. The density is that of the weight, so a
//! body in free fall has exactly the acceleration of gravity. Matrix and load use the same points,
//! so a uniform motion stays uniform. The micro-inertia is the moment of inertia of the rotating grains
//! per mass (A. C. Eringen, "Theory of micropolar fluids", J. Math. Mech. 16 (1966) 1); without it the
//! rotation has no inertia.

use super::{CellTerm, Motion};
use crate::space::shape::NODES;

/// Mass matrix of a cell for one component of the velocity, or for the rotation.
pub type Mass = [[f64; NODES]; NODES];

/// The inertia of all cells.
#[derive(Clone, Debug, Default)]
pub struct Inertia {
    /// `a_0/dt`.
    pub rate: f64,
    /// Mass matrix of each cell; empty without inertia.
    pub mass: Vec<Mass>,
    /// The same of the rotation, with the density `rho j`; empty without micro-inertia.
    pub turning: Vec<Mass>,
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

    /// Twice the kinetic energy of a cell, `u . M u` and for the rotation `w . M_j w`, with the nodal
    /// velocities and rotations `u`.
    pub fn square(&self, cell: usize, u: &Motion) -> f64 {
        let mut sum = 0.0;
        for (row, ua) in self.mass[cell].iter().zip(u) {
            for (m, ub) in row.iter().zip(u) {
                sum += m * (ua[0] * ub[0] + ua[1] * ub[1]);
            }
        }
        for (row, ua) in self.turning.get(cell).into_iter().flatten().zip(u) {
            sum += row.iter().zip(u).map(|(m, ub)| m * ua[2] * ub[2]).sum::<f64>();
        }
        sum
    }
}

impl CellTerm for Inertia {
    fn acts_on(&self, _cell: usize) -> bool {
        !self.mass.is_empty()
    }

    fn components(&self) -> usize {
        if self.turning.is_empty() { 2 } else { 3 }
    }

    fn entry(&self, cell: usize, [a, b]: [usize; 2], [c, d]: [usize; 2]) -> f64 {
        match [c, d] {
            [2, 2] => self.rate * self.turning[cell][a][b],
            _ if c == d => self.rate * self.mass[cell][a][b],
            _ => 0.0,
        }
    }

    fn force(&self, cell: usize, _nodes: &[usize; NODES], u: &Motion) -> (Motion, f64) {
        let mut force = [[0.0; 3]; NODES];
        for (f, row) in force.iter_mut().zip(&self.mass[cell]) {
            for (m, u) in row.iter().zip(u) {
                f[0] -= self.rate * m * u[0];
                f[1] -= self.rate * m * u[1];
            }
        }
        for (f, row) in force.iter_mut().zip(self.turning.get(cell).into_iter().flatten()) {
            f[2] -= self.rate * row.iter().zip(u).map(|(m, u)| m * u[2]).sum::<f64>();
        }
        (force, self.rate * self.square(cell, u))
    }
}
