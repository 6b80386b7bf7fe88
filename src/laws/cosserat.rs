//! Cosserat measures and the isotropic Cosserat fluid, equations (1)-(13).
//!
//! ```text
//! gamma_xx = u,x   gamma_yy = v,y   gamma_xy = u,y + w   gamma_yx = v,x - w
//! kappa_x = w,x    kappa_y = w,y
//! sigma_xx = (B + eta) gamma_xx + (B - eta) gamma_yy
//! sigma_xy = (eta + eta_c) gamma_xy + (eta - eta_c) gamma_yx
//! mu_j = M kappa_j,  M = 2 eta_c R^2
//! ```
//! (13) is printed with `D - tr(D)`; the deviator is the two-dimensional `D - tr(D)/2 I`.

use nalgebra::{Matrix2, Matrix4, Vector4};

/// Cosserat deformation rates `(gamma_xx, gamma_yy, gamma_xy, gamma_yx)`, 1/s, of a velocity
/// gradient `l` (`l[(i, j)] = u_i,j`) and a rotation rate `w`; equations (1)-(6).
///
/// Exactly zero for a rigid rotation with `w = (v,x - u,y)/2`.
pub fn measures(l: &Matrix2<f64>, w: f64) -> Vector4<f64> {
    Vector4::new(l[(0, 0)], l[(1, 1)], l[(0, 1)] + w, l[(1, 0)] - w)
}

/// Spin of the continuum, `(v,x - u,y)/2`, 1/s.
pub fn spin(l: &Matrix2<f64>) -> f64 {
    0.5 * (l[(1, 0)] - l[(0, 1)])
}

/// Viscosity matrix of the isotropic Cosserat fluid, Pa s; equations (10)-(13) with a finite
/// bulk viscosity `b`. Acts on [`measures`].
pub fn viscosity(eta: f64, eta_c: f64, b: f64) -> Matrix4<f64> {
    #[rustfmt::skip]
    let c = Matrix4::new(
        b + eta, b - eta, 0.0, 0.0,
        b - eta, b + eta, 0.0, 0.0,
        0.0, 0.0, eta + eta_c, eta - eta_c,
        0.0, 0.0, eta - eta_c, eta + eta_c,
    );
    c
}

/// Couple viscosity `M = 2 eta_c R^2`, Pa s m2, of an internal length `r`; equation (12).
pub fn couple_viscosity(eta_c: f64, r: f64) -> f64 {
    2.0 * eta_c * r * r
}
