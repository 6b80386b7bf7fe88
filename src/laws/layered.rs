//! Layered (director) viscosity, equations (18)-(20).
//!
//! ```text
//! sigma = 2 eta D' - 2 (eta - eta_s) A:D' - p I
//! A_ijkl = (n_i n_k d_lj + n_j n_k d_il + n_i n_l d_kj + n_j n_l d_ik)/2 - 2 n_i n_j n_k n_l
//! ```
//! With the director `n = (cos th, sin th)`, the normal of the layers, only `s = sin 2th` and
//! `c = cos 2th` enter: `n` and `-n` are the same.

use nalgebra::{Matrix2, Matrix4, Vector2};

/// `(sin 2th, cos 2th)` of a unit director.
pub fn double_angle(n: &Vector2<f64>) -> (f64, f64) {
    (2.0 * n.x * n.y, n.x * n.x - n.y * n.y)
}

/// What layers add to the isotropic viscosity matrix on
/// `(gamma_xx, gamma_yy, gamma_xy, gamma_yx)`, Pa s.
pub fn correction(eta: f64, eta_s: f64, n: &Vector2<f64>) -> Matrix4<f64> {
    let (s, c) = double_angle(n);
    let de = eta - eta_s;
    #[rustfmt::skip]
    let k = Matrix4::new(
        -de * s * s,  de * s * s,  de * s * c,  de * s * c,
         de * s * s, -de * s * s, -de * s * c, -de * s * c,
         de * s * c, -de * s * c, -de * c * c, -de * c * c,
         de * s * c, -de * s * c, -de * c * c, -de * c * c,
    );
    k
}

/// The same law on the two deviatoric rates `(D_xx - D_yy, 2 D_xy)`, giving the stresses
/// `((sigma_xx - sigma_yy)/2, (sigma_xy + sigma_yx)/2)`, Pa s:
///
/// ```text
/// S = eta I - (eta - eta_s) m m^T,   m = (sin 2th, -cos 2th)
/// ```
/// Its eigenvalues are `eta` and `eta_s`.
pub fn deviatoric(eta: f64, eta_s: f64, n: &Vector2<f64>) -> Matrix2<f64> {
    let (s, c) = double_angle(n);
    let m = Vector2::new(s, -c);
    Matrix2::identity() * eta - m * m.transpose() * (eta - eta_s)
}
