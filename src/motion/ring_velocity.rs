//! This module gives the velocity of a cell around an axis for the motion of points.
//!
//! As in [`cell_velocity`](super::cell_velocity), the divergence is exactly what the pressure sees of it:
//! its projection on `1, xi, eta`. With the relative thickness `s = 1 + t xi` (see
//! [`measure`](crate::space::measure)), `U = s u` and `V = s v` have in the plane the divergence
//!
//! ```text
//! dU/dx + dV/dy = s div u,   div u = du/dx + u/x + dv/dy
//! ```
//! The excess `E = s (div u - projection)` is removed by parts. With `E = E_0(xi) + eta E_1(xi) +
//! (eta^2 - 1/3) E_2(xi)` in the coordinates of the cell and `I f` the integral of `f` from the left side,
//!
//! ```text
//! U -= I E_0 + a eta I E_1 + b (eta^2 - 1/3) I(E_2 - m s)
//! V += (1 - a) E_1 (1 - eta^2)/2 + [m s + (1 - b)(E_2 - m s)] eta (1 - eta^2)/3,   m: mean of E_2
//! ```
//! which changes no flux through the sides. The shares `a` and `b` are those of the plane. At the axis
//! `E` is zero, so `U` and `V` are divisible by `s` there.

use super::cell_velocity::{AtPoints, BOW, Points, TOGETHER, Ways, biquadratic, ways};
use crate::simd::{dispatch, multiply_add};
use crate::space::measure::CellMeasure;
use crate::space::shape::NODES;
use nalgebra::Matrix2;

/// Coefficients of `eta^j xi^i`, row `j`, column `i`.
type Table<const J: usize, const I: usize> = [[f64; I]; J];

/// Velocity of a cell: two polynomials, over the thickness `1 + slope xi`.
#[derive(Clone, Copy, Debug, Default)]
pub struct RingVelocity {
    u: Table<3, 5>,
    v: Table<4, 4>,
    slope: f64,
}

/// Product of a polynomial in `xi` with the thickness `1 + tilt xi`.
fn thick<const N: usize>(c: &[f64], tilt: f64) -> [f64; N] {
    let mut out = [0.0; N];
    for (i, c) in c.iter().enumerate() {
        out[i] += c;
        out[i + 1] += tilt * c;
    }
    out
}

/// Quotient of a polynomial that is divisible by `1 + xi`.
fn divided<const N: usize>(c: &[f64; N]) -> [f64; N] {
    let mut out = [0.0; N];
    for i in (1..N).rev() {
        let above = if i < N - 1 { out[i] } else { 0.0 };
        out[i - 1] = c[i] - above;
    }
    out
}

/// Mean of a polynomial over the cell.
fn mean(c: &[f64; 4]) -> f64 {
    c[0] + c[2] / 3.0
}

/// Integral of a polynomial from the left side.
fn integral(c: &[f64; 4]) -> [f64; 5] {
    let mut out = [0.0; 5];
    for i in 0..4 {
        out[i + 1] = c[i] / (i + 1) as f64;
    }
    // The value at xi = -1 is zero.
    out[0] = out[1] - out[2] + out[3] - out[4];
    out
}

/// Removes from `u` and `v`, multiplied by the thickness, the divergence that the pressure does not
/// see; `ratio` is the square of the ratio of the sizes along x and y.
fn correct(u: &mut Table<3, 5>, v: &mut Table<4, 4>, tilt: f64, ratio: f64) {
    let mut excess = [[0.0; 4]; 3];
    for j in 0..3 {
        for i in 0..4 {
            excess[j][i] += (i + 1) as f64 * u[j][i + 1];
            if j < 2 {
                excess[j][i] += (j + 1) as f64 * v[j + 1][i];
            }
        }
    }
    // Rows of 1, eta and eta^2 - 1/3.
    for i in 0..4 {
        excess[0][i] += excess[2][i] / 3.0;
    }
    let moment = |c: &[f64; 4]| c[1] / 3.0 + c[3] / 5.0;
    let square = 1.0 / 3.0 - tilt * tilt / 9.0;
    let seen = mean(&excess[0]);
    let along = (moment(&excess[0]) - tilt / 3.0 * seen) / square;
    let across = mean(&excess[1]);
    let target = [
        thick::<4>(&[seen - along * tilt / 3.0, along, 0.0], tilt),
        thick::<4>(&[across, 0.0, 0.0], tilt),
    ];
    for (row, target) in excess.iter_mut().zip(target) {
        row.iter_mut().zip(target).for_each(|(e, t)| *e -= t);
    }
    let uniform = thick::<4>(&[mean(&excess[2]), 0.0, 0.0], tilt);
    let mut rest = excess[2];
    rest.iter_mut().zip(uniform).for_each(|(e, m)| *e -= m);
    let (a, b) = (1.0 / (1.0 + ratio), BOW / (ratio + BOW));
    let [first, second, third] = [&excess[0], &excess[1], &rest].map(integral);
    for i in 0..5 {
        u[0][i] -= first[i] - b * third[i] / 3.0;
        u[1][i] -= a * second[i];
        u[2][i] -= b * third[i];
    }
    for i in 0..4 {
        let (even, odd) =
            ((1.0 - a) * excess[1][i] / 2.0, (uniform[i] + (1.0 - b) * rest[i]) / 3.0);
        v[0][i] += even;
        v[1][i] += odd;
        v[2][i] -= even;
        v[3][i] -= odd;
    }
}

/// Value and derivatives along `xi` and `eta` of a polynomial.
fn expanded<const J: usize, const I: usize>(
    c: &Table<J, I>,
    [xi, eta]: [f64; 2],
) -> (f64, [f64; 2]) {
    let (mut value, mut along, mut across) = (0.0, 0.0, 0.0);
    for row in c.iter().rev() {
        let (mut p, mut d) = (0.0, 0.0);
        for &k in row.iter().rev() {
            d = d * xi + p;
            p = p * xi + k;
        }
        across = across * eta + value;
        value = value * eta + p;
        along = along * eta + d;
    }
    (value, [along, across])
}

impl RingVelocity {
    /// The velocity of a cell with the given nodal velocities; without `corrected` it is their
    /// interpolation.
    pub fn new(nodal: &[[f64; 2]; NODES], cell: CellMeasure, corrected: bool) -> Self {
        let ([hx, hy], tilt) = (cell.size, cell.tilt());
        let of_u = biquadratic(|i, j| nodal[3 * j + i][0] * 0.5 * hy);
        let of_v = biquadratic(|i, j| nodal[3 * j + i][1] * 0.5 * hx);
        let mut out = RingVelocity { slope: tilt, ..RingVelocity::default() };
        for j in 0..3 {
            out.u[j] = thick(&of_u[j][..3], tilt);
            out.v[j] = thick(&of_v[j][..3], tilt);
        }
        if corrected {
            correct(&mut out.u, &mut out.v, tilt, (hx / hy).powi(2));
        }
        if tilt >= 1.0 - 1e-12 {
            out.u = out.u.each_ref().map(divided);
            out.v = out.v.each_ref().map(divided);
            out.slope = 0.0;
        }
        out.u.as_flattened_mut().iter_mut().for_each(|c| *c *= 2.0 / hy);
        out.v.as_flattened_mut().iter_mut().for_each(|c| *c *= 2.0 / hx);
        out
    }

    /// Velocity at reference coordinates.
    pub fn at(&self, r: [f64; 2]) -> [f64; 2] {
        let s = 1.0 + self.slope * r[0];
        [expanded(&self.u, r).0 / s, expanded(&self.v, r).0 / s]
    }

    /// Velocity gradient in the plane of the mesh.
    pub fn gradient(&self, r: [f64; 2], [hx, hy]: [f64; 2]) -> Matrix2<f64> {
        let s = 1.0 + self.slope * r[0];
        let rows = [expanded(&self.u, r), expanded(&self.v, r)].map(|(value, [along, across])| {
            let along = (along - self.slope * value / s) / s;
            [along * 2.0 / hx, across / s * 2.0 / hy]
        });
        Matrix2::new(rows[0][0], rows[0][1], rows[1][0], rows[1][1])
    }
}

dispatch! {
    /// Traces points as [`trace_points`](super::cell_velocity::trace_points) does.
    pub fn trace_points(current: &RingVelocity, r: &Points, step: [f64; 2]) -> Ways = ways_kernel
}

#[inline(always)]
fn ways_kernel<const LENGTH: usize, const FMA: bool>(
    current: &RingVelocity,
    r: &Points,
    step: [f64; 2],
) -> Ways {
    ways::<FMA, _>(current, r, step)
}

impl AtPoints for RingVelocity {
    #[inline(always)]
    fn at_points<const FMA: bool>(&self, r: &Points) -> Points {
        let mut out = [values::<FMA, 3, 5>(&self.u, r), values::<FMA, 4, 4>(&self.v, r)];
        for component in &mut out {
            for p in 0..TOGETHER {
                component[p] /= multiply_add::<FMA>(self.slope, r[0][p], 1.0);
            }
        }
        out
    }
}

#[inline(always)]
fn values<const FMA: bool, const J: usize, const I: usize>(
    c: &Table<J, I>,
    [xi, eta]: &Points,
) -> [f64; TOGETHER] {
    let mut sum = [0.0; TOGETHER];
    for row in c.iter().rev() {
        let mut inner = [0.0; TOGETHER];
        for k in row.iter().rev() {
            for p in 0..TOGETHER {
                inner[p] = multiply_add::<FMA>(inner[p], xi[p], *k);
            }
        }
        for p in 0..TOGETHER {
            sum[p] = multiply_add::<FMA>(sum[p], eta[p], inner[p]);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::flow::interpolate;
    use crate::space::measure::Measure;
    use crate::space::shape::{GAUSS_6X6, Shape};

    const SIZE: [f64; 2] = [0.3, 0.7];

    /// A cell away from the axis and one at it, with arbitrary velocities that are possible there.
    fn cells() -> [(CellMeasure, [[f64; 2]; NODES]); 2] {
        [0.5, 0.15].map(|x| {
            let nodal = std::array::from_fn(|k| {
                let on_axis = x == 0.15 && k % 3 == 0;
                let u = if on_axis { 0.0 } else { (7.3 * k as f64 + 1.0).sin() };
                [u, (3.9 * k as f64).cos()]
            });
            (Measure::RING.of_cell(SIZE, x), nodal)
        })
    }

    fn divergence(flow: &RingVelocity, cell: CellMeasure, r: [f64; 2]) -> f64 {
        flow.gradient(r, SIZE).trace() + flow.at(r)[0] * cell.per_radius(r[0])
    }

    #[test]
    fn the_divergence_left_is_what_the_pressure_sees() {
        for (cell, nodal) in cells() {
            let flow = RingVelocity::new(&nodal, cell, true);
            let plain = RingVelocity::new(&nodal, cell, false);
            let mut seen = [0.0; 3];
            for g in GAUSS_6X6.iter() {
                let div = divergence(&plain, cell, g.r) * cell.share(g.weight, g.r[0]);
                let (q, square) = (cell.pressure_basis(g.r), cell.pressure_squares());
                for k in 0..3 {
                    seen[k] += div * q[k] / square[k];
                }
            }
            for r in [[0.0, 0.0], [0.3, -0.8], [-0.95, 0.4], [1.0, 1.0]] {
                let q = cell.pressure_basis(r);
                let expected: f64 = (0..3).map(|k| seen[k] * q[k]).sum();
                let div = divergence(&flow, cell, r);
                assert!((div - expected).abs() < 1e-12, "{r:?}: {div} {expected}");
            }
        }
    }

    #[test]
    fn fluxes_through_sides_are_those_of_the_nodes() {
        for (cell, nodal) in cells() {
            let flow = RingVelocity::new(&nodal, cell, true);
            for t in [-0.9, -0.6, 0.1, 0.8] {
                for edge in [-1.0, 1.0] {
                    for (r, c) in [([edge, t], 0), ([t, edge], 1)] {
                        let expected = interpolate(&nodal, &Shape::values(r))[c];
                        let found = flow.at(r)[c];
                        assert!((found - expected).abs() < 1e-13, "{r:?} {found} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn points_together_have_the_velocities_of_single_points() {
        for (cell, nodal) in cells() {
            let flow = RingVelocity::new(&nodal, cell, true);
            let places: Points = std::array::from_fn(|c| {
                std::array::from_fn(|p| 0.9 * ((3 * p + 5 * c) as f64).sin())
            });
            let found = flow.at_points::<false>(&places);
            for p in 0..TOGETHER {
                let one = flow.at([places[0][p], places[1][p]]);
                assert!((0..2).all(|c| (one[c] - found[c][p]).abs() < 1e-14));
            }
        }
    }

    #[test]
    fn flows_without_divergence_stay() {
        // u = -x/2 + x z, v = z - z^2, and a rigid motion along the axis
        for x in [0.5, 0.15] {
            let cell = Measure::RING.of_cell(SIZE, x);
            let at = |x: f64, z: f64| [-0.5 * x + x * z, 0.3 + z - z * z];
            let place = |r: [f64; 2]| [x + 0.5 * SIZE[0] * r[0], 0.5 * SIZE[1] * r[1]];
            let nodal = std::array::from_fn(|k| {
                let [x, z] = place([(k % 3) as f64 - 1.0, (k / 3) as f64 - 1.0]);
                at(x, z)
            });
            let flow = RingVelocity::new(&nodal, cell, true);
            for r in [[0.0, 0.0], [0.3, -0.8], [-0.95, 0.4]] {
                let ([x, z], found) = (place(r), flow.at(r));
                let expected = at(x, z);
                assert!((0..2).all(|c| (found[c] - expected[c]).abs() < 1e-13), "{r:?}");
            }
        }
    }
}
