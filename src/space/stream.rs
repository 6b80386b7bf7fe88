//! This module gives the velocity beside solids of any shape a streamfunction, with which points move.
//!
//! ```text
//! psi = d^m phi(x, y),   s u = (d psi/dy, -d psi/dx)
//! ```
//! relative to the velocity of the solid, with the thickness `s` of the domain (1 in the plane, `2 pi x`
//! around an axis), the distance `d` from the solid, `m = 2` where the velocity vanishes on it and 1 where it
//! slips, and a quadratic `phi`. Such a velocity has no divergence and never leads into the solid. The
//! velocity of the solver has no divergence in the mean of a cell only: where it leads towards a wall
//! or away from it with a velocity proportional to the distance, points accumulate or are missing.
//! `phi` is the least-squares fit of the fluxes through the sides of the cell and of the velocities
//! inside; it depends linearly on the nodal velocities, by a matrix that depends on the shape only.

use super::outline::Point;
use super::shape::NODES;
use nalgebra::SVector;

/// Number of coefficients of `phi`: `1, x, y, x^2, x y, y^2` from the centroid of the part, in cells.
pub const TERMS: usize = 6;
/// Linear form of the nodal velocities of a cell, `9 c + a` for component `c` of node `a`.
pub type Form = [f64; 2 * NODES];

/// The streamfunction of a cell with a solid in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream {
    /// Coefficients of `phi` as linear forms.
    pub(super) map: [Form; TERMS],
    /// Velocity of the solid.
    pub(super) velocity: Point,
    /// The power `m`.
    pub(super) power: i32,
    /// Centroid of the part, in the plan's units.
    pub(super) centre: Point,
    /// Mean size of the cell.
    pub(super) size: f64,
}

/// Coefficients of `phi` for the velocities of a step.
#[derive(Clone, Copy, Debug)]
pub struct StreamFlow(SVector<f64, TERMS>);

impl Stream {
    /// The coefficients for the nodal velocities of the cell, with the thicknesses of the domain at its
    /// nodes.
    pub fn flow(&self, nodal: &[[f64; 2]; NODES], thickness: &[f64; NODES]) -> StreamFlow {
        let of = |form: &Form| -> f64 {
            let relative = |j: usize| {
                thickness[j % NODES] * (nodal[j % NODES][j / NODES] - self.velocity[j / NODES])
            };
            form.iter().enumerate().map(|(j, f)| f * relative(j)).sum()
        };
        StreamFlow(SVector::from_fn(|k, _| of(&self.map[k])))
    }

    /// Velocity at a point with the distance `d` from the solid, along the unit normal `n`, where the
    /// domain has the given thickness.
    pub fn velocity(
        &self,
        flow: &StreamFlow,
        p: Point,
        (d, n): (f64, Point),
        thickness: f64,
    ) -> Point {
        let flux = self.rows(p, d.max(0.0), n).map(|row| row.dot(&flow.0));
        [0, 1].map(|c| flux[c] / thickness + self.velocity[c])
    }

    /// The terms of `phi` at a point.
    pub(super) fn terms(&self, p: Point) -> SVector<f64, TERMS> {
        let [x, y] = [0, 1].map(|c| (p[c] - self.centre[c]) / self.size);
        [1.0, x, y, x * x, x * y, y * y].into()
    }

    /// The velocities of the terms of `phi`.
    pub(super) fn rows(&self, p: Point, d: f64, n: Point) -> [SVector<f64, TERMS>; 2] {
        let [x, y] = [0, 1].map(|c| (p[c] - self.centre[c]) / self.size);
        let terms = self.terms(p);
        let s = 1.0 / self.size;
        let by_x: SVector<f64, TERMS> = [0.0, s, 0.0, 2.0 * s * x, s * y, 0.0].into();
        let by_y: SVector<f64, TERMS> = [0.0, 0.0, s, 0.0, s * x, 2.0 * s * y].into();
        let (m, all) = (f64::from(self.power), d.powi(self.power));
        let less = m * d.powi(self.power - 1);
        [less * n[1] * terms + all * by_y, -(less * n[0] * terms + all * by_x)]
    }
}
