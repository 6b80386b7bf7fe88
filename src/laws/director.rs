//! Evolution of the director, equation (18): `dn/dt = -L^T n + (n.D n) n`.
//!
//! The director is the normal of a material line, so `n ~ F^-T N`. A step with a constant
//! velocity gradient is mapped exactly, `F = exp(L dt)`, and renormalised: unconditionally
//! stable, and `|n| = 1` to rounding.

use nalgebra::{Matrix2, Vector2};

/// `exp(a)` of a 2x2 matrix in closed form (Cayley-Hamilton).
///
/// With `t = tr(a)/2` and `q^2 = t^2 - det(a)`: `e^t [cosh(q) I + sinh(q)/q (a - t I)]`, the
/// hyperbolic functions becoming trigonometric where `q^2 < 0`.
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

/// Average of directors as axes: the eigenvector of the largest eigenvalue of a weighted sum of
/// `n n^T`, given as `(xx, yy, xy)`.
pub fn axis(xx: f64, yy: f64, xy: f64) -> Vector2<f64> {
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    Vector2::new(angle.cos(), angle.sin())
}
