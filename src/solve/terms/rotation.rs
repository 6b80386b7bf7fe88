//! This module computes the part of the coupling viscosity that exceeds the shear viscosity,
//! without locking.
//!
//! As `eta_c -> infinity` at fixed `M` (the couple-stress limit) the rotation must follow the spin,
//! `o = w`. The spin of a biquadratic velocity and a biquadratic rotation lie in different function
//! spaces, and nine points impose more conditions than both can satisfy: on the coupled cell, the
//! velocity then converges at second order instead of third. Therefore the excess of `eta_c` over
//! `eta` acts only on the best linear approximation, in the coordinates of the cell, of the
//! relative spin `s = o - w`,
//!
//! ```text
//! 4 integral e Ps Ps~,   e = max(0, eta_c - eta),   P: weighted by e on 1, xi, eta
//! ```
//! as the pressure acts only on the linear part of the divergence. The rest of `eta_c` acts at
//! every point. Fluids with `eta_c <= eta` have no excess. The error is that of
//! `e (s - Ps)(s~ - Ps~)`, of fourth order where `s` is smooth. A weak point of a cut cell has a
//! small weight in `P`.

use crate::solve::element::{LOCAL, Matrix, Nodal, PointShape};
use crate::solve::quadrature::Quadrature;
use crate::space::measure::CellMeasure;
use crate::space::shape::NODES;
use std::cell::RefCell;

/// Smallest fraction of the squared norm of a function that must remain after orthogonalisation;
/// less is rounding. Also the smallest fraction of the coupling viscosity that counts as an excess.
const LEAST_PART: f64 = 1e-10;

/// Projected coupling of a cell: `sum_k b_k b_k'`.
#[derive(Default)]
pub struct RotationModes {
    /// The vectors `b_k`.
    modes: [[f64; LOCAL]; 3],
    /// Number of vectors.
    count: usize,
}

/// Working memory for computing modes, one per thread.
#[derive(Default)]
struct Room {
    /// Points with an excess.
    points: Vec<Point>,
    /// Orthonormal functions, by point.
    basis: [Vec<f64>; 3],
}

thread_local! {
    static ROOM: RefCell<Room> = RefCell::default();
}

/// An integration point: its weight `4 e` times the volume, the functions `1, xi, eta`, and the
/// relative spin `s` of unit values of the unknowns.
struct Point {
    weight: f64,
    linear: [f64; 3],
    spin: [f64; LOCAL],
}

impl RotationModes {
    /// Computes the modes of a cell with rotation; `None` if no point has an excess.
    pub fn new(quadrature: &Quadrature, cell: usize, measure: CellMeasure) -> Option<Self> {
        let volume = measure.volume();
        ROOM.with_borrow_mut(|Room { points, basis }| {
            points.clear();
            quadrature.for_points(cell, |p, shape| {
                let excess = p.law.excess_coupling();
                // An excess of the order of rounding is ignored.
                if excess > LEAST_PART * p.law.coupling {
                    let s = PointShape::new(shape, measure, p.r[0]);
                    let mut spin = [0.0; LOCAL];
                    for a in 0..NODES {
                        spin[a] = -0.5 * s.gy[a];
                        spin[NODES + a] = 0.5 * s.gx[a];
                        spin[2 * NODES + a] = -s.n[a];
                    }
                    let weight = 4.0 * excess * p.weight * volume;
                    points.push(Point { weight, linear: [1.0, p.r[0], p.r[1]], spin });
                }
            });
            (!points.is_empty()).then(|| RotationModes::of(points, basis))
        })
    }

    /// Computes the modes of these points; `basis` is working memory.
    fn of(points: &[Point], basis: &mut [Vec<f64>; 3]) -> Self {
        let product = |a: &[f64], b: &[f64]| -> f64 {
            points.iter().zip(a.iter().zip(b)).map(|(p, (a, b))| p.weight * a * b).sum()
        };
        let mut out = RotationModes::default();
        for k in 0..3 {
            let (known, rest) = basis.split_at_mut(out.count);
            let f = &mut rest[0];
            f.clear();
            f.extend(points.iter().map(|p| p.linear[k]));
            let before = product(f, f);
            // Twice, because the first pass leaves rounding errors of the parts it removes.
            for q in known.iter().chain(&*known) {
                let along = product(q, f);
                f.iter_mut().zip(q).for_each(|(f, q)| *f -= along * q);
            }
            let norm = product(f, f);
            if norm > LEAST_PART * before {
                f.iter_mut().for_each(|f| *f /= norm.sqrt());
                let mode = &mut out.modes[out.count];
                for (p, q) in points.iter().zip(&*f) {
                    for i in 0..LOCAL {
                        mode[i] += p.weight * q * p.spin[i];
                    }
                }
                out.count += 1;
            }
        }
        out
    }

    /// The valid vectors.
    fn modes(&self) -> &[[f64; LOCAL]] {
        &self.modes[..self.count]
    }

    /// Adds the coupling to an element matrix, in the blocks of components on and below the
    /// diagonal.
    pub fn add_stiffness(&self, k: &mut Matrix) {
        for b in self.modes() {
            for i in 0..LOCAL {
                for j in 0..NODES * (i / NODES + 1) {
                    k[i][j] += b[i] * b[j];
                }
            }
        }
    }

    /// Adds the coupling to the nodal forces and returns its power.
    pub fn add_force<const D: usize>(&self, u: &Nodal<D>, force: &mut Nodal<D>) -> f64 {
        let mut power = 0.0;
        for b in self.modes() {
            let along: f64 = (0..NODES * D).map(|i| b[i] * u[i % NODES][i / NODES]).sum();
            power += along * along;
            for i in 0..NODES * D {
                force[i % NODES][i / NODES] += along * b[i];
            }
        }
        power
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::measure::Measure;
    use crate::space::shape::GAUSS_3X3;

    const SIZE: [f64; 2] = [0.7, 1.3];

    fn points(weight: impl Fn(usize) -> f64) -> Vec<Point> {
        let point = |(g, p): (usize, &crate::space::shape::GaussPoint)| {
            let s = PointShape::new(&p.shape, Measure::PLANE.of_cell(SIZE, 0.0), p.r[0]);
            let mut spin = [0.0; LOCAL];
            for a in 0..NODES {
                spin[a] = -0.5 * s.gy[a];
                spin[NODES + a] = 0.5 * s.gx[a];
                spin[2 * NODES + a] = -s.n[a];
            }
            Point { weight: weight(g), linear: [1.0, p.r[0], p.r[1]], spin }
        };
        GAUSS_3X3.iter().enumerate().map(point).collect()
    }

    #[test]
    fn a_linear_relative_spin_keeps_all_its_power() {
        let points = points(|g| 0.3 + 0.1 * g as f64);
        let modes = RotationModes::of(&points, &mut Default::default());
        // u = -y^2, w = 0.4 x: spin y, relative spin y - 0.4 x
        let u: Nodal<3> = std::array::from_fn(|a| {
            let (x, y) = ((a % 3) as f64 * 0.5 * SIZE[0], (a / 3) as f64 * 0.5 * SIZE[1]);
            [-y * y, 0.0, 0.4 * x]
        });
        let spin =
            |p: &Point| -> f64 { (0..LOCAL).map(|i| p.spin[i] * u[i % NODES][i / NODES]).sum() };
        let expected: f64 = points.iter().map(|p| p.weight * spin(p).powi(2)).sum();
        let mut force = [[0.0; 3]; NODES];
        let power = modes.add_force(&u, &mut force);
        assert!((power - expected).abs() < 1e-13 * expected, "{power} {expected}");
        let by_force: f64 =
            (0..NODES * 3).map(|i| force[i % NODES][i / NODES] * u[i % NODES][i / NODES]).sum();
        assert!((by_force - power).abs() < 1e-13 * power);
    }

    #[test]
    fn points_without_weight_leave_fewer_functions() {
        // One column of points does not determine slopes along x.
        let column = points(|_| 1.0).into_iter().skip(1).step_by(3).collect::<Vec<_>>();
        let count = |points: &[Point]| RotationModes::of(points, &mut Default::default()).count;
        assert_eq!(count(&column), 2);
        assert_eq!(count(&column[..1]), 1);
        assert_eq!(count(&points(|g| 10f64.powi(-(g as i32)))), 3);
    }
}
