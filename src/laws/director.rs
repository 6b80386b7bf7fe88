//! This module advances directors in time and computes their means.
//!
//! Equation (18) for the evolution is `dn/dt = -L^T n + (n.D n) n`.
//!
//! The director is the normal of a material line, so `n ~ F^-T N`. A step with a constant
//! velocity gradient is integrated exactly, `F = exp(L dt)`, and the result is normalised. The
//! step is unconditionally stable, and `|n| = 1` to rounding.

use super::point::Sym2;
use nalgebra::{Matrix2, Vector2};

/// Exponential `exp(a)` of a 2x2 matrix in closed form (Cayley-Hamilton).
///
/// With `t = tr(a)/2` and `q^2 = t^2 - det(a)` it is `e^t [cosh(q) I + sinh(q)/q (a - t I)]`.
/// Where `q^2 < 0`, the hyperbolic functions become trigonometric functions.
pub fn exponential(a: &Matrix2<f64>) -> Matrix2<f64> {
    let t = 0.5 * a.trace();
    let b = a - Matrix2::identity() * t;
    // For the traceless b, b^2 = -det(b) I.
    let q2 = -b.determinant();
    let (c, s) = if q2.abs() < 1e-8 {
        (1.0 + q2 / 2.0 + q2 * q2 / 24.0, 1.0 + q2 / 6.0 + q2 * q2 / 120.0)
    } else if q2 > 0.0 {
        let q = q2.sqrt();
        (q.cosh(), q.sinh() / q)
    } else {
        let q = (-q2).sqrt();
        (q.cos(), q.sin() / q)
    };
    (Matrix2::identity() * c + b * s) * t.exp()
}

/// The director after a time `dt` under the constant velocity gradient `l`.
pub fn advance(n: &Vector2<f64>, l: &Matrix2<f64>, dt: f64) -> Vector2<f64> {
    let turned = exponential(&(-l.transpose() * dt)) * n;
    let norm = turned.norm();
    if norm > 0.0 && norm.is_finite() { turned / norm } else { *n }
}

/// Mean of directors regardless of their sign: the unit eigenvector of the largest eigenvalue of a
/// weighted sum of `n n^T` with the components `xx`, `yy` and `xy`.
pub fn axis(xx: f64, yy: f64, xy: f64) -> Vector2<f64> {
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    Vector2::new(angle.cos(), angle.sin())
}

/// `(sin 2th, cos 2th)` of a unit director.
pub fn double_angle([nx, ny]: [f64; 2]) -> (f64, f64) {
    (2.0 * nx * ny, nx * nx - ny * ny)
}

/// Weighted means of `m m^T`, `m = (sin 2th, -cos 2th)`, and of `t t^T`, `t = (-sin th, cos th)`,
/// over directors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation {
    weight: f64,
    ss: f64,
    sc: f64,
    s: f64,
    c: f64,
}

impl Orientation {
    /// The orientation of a single director.
    pub fn of(n: [f64; 2]) -> Self {
        let mut out = Orientation::default();
        out.add(1.0, n);
        out
    }

    /// Adds a director with a weight.
    pub fn add(&mut self, weight: f64, n: [f64; 2]) {
        let (s, c) = double_angle(n);
        self.weight += weight;
        self.ss += weight * s * s;
        self.sc += weight * s * c;
        self.s += weight * s;
        self.c += weight * c;
    }

    /// The mean of `m m^T`; zero without directors.
    pub fn projector(&self) -> Sym2 {
        if self.weight == 0.0 {
            return Sym2::default();
        }
        let ss = self.ss / self.weight;
        Sym2 { a: ss, b: 1.0 - ss, c: -self.sc / self.weight }
    }

    /// The mean of `t t^T`, `t` the unit vector along the layers; zero without directors.
    pub fn along(&self) -> Sym2 {
        if self.weight == 0.0 {
            return Sym2::default();
        }
        let [s, c] = [self.s, self.c].map(|v| 0.5 * v / self.weight);
        Sym2 { a: 0.5 - c, b: 0.5 + c, c: -s }
    }
}
