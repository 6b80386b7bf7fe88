//! This module gives the viscosity of layered (director) materials, equations (18)-(20).
//!
//! ```text
//! sigma = 2 eta D' - 2 (eta - eta_s) A:D' - p I
//! A_ijkl = (n_i n_k d_lj + n_j n_k d_il + n_i n_l d_kj + n_j n_l d_ik)/2 - 2 n_i n_j n_k n_l
//! ```
//! The director `n = (cos th, sin th)` is the normal of the layers. The viscosity depends only on
//! `s = sin 2th` and `c = cos 2th`, so `n` and `-n` give the same result. On the deviatoric rates
//! `(D_xx - D_yy, 2 D_xy)` the law is
//!
//! ```text
//! S = eta I - (eta - eta_s) m m^T,   m = (sin 2th, -cos 2th)
//! ```
//! The eigenvalues of `S` are `eta` and `eta_s`. If several directors contribute to a point, the
//! mean of `m m^T` is used.
//!
//! Layers that bend have a couple viscosity of their own: with the unit vector `t = (-sin th, cos th)`
//! along the layers, the internal length `R` across and `R_l` along the layers, the couple stress is
//!
//! ```text
//! mu = [M I + (M_l - M) t t^T] grad w,   M = 2 eta_c R^2,   M_l = 2 eta_c R_l^2
//! ```
//! Bent layers have a rotation that varies along them. If several directors contribute to a point,
//! the mean of `t t^T` is used.

use super::director::Orientation;
use super::point::Sym2;

/// Viscosity matrix `S` of a layered fluid on the deviatoric rates, Pa s.
pub fn shear(eta: f64, eta_s: f64, orientation: &Orientation) -> Sym2 {
    let mut shear = Sym2::isotropic(eta);
    let de = eta - eta_s;
    shear.add_scaled(-de, &orientation.projector());
    shear
}

/// Couple viscosity matrix `(M_l - M) t t^T` of the bending of layers, Pa s m2; `difference` is
/// `M_l - M`.
pub fn bending(difference: f64, orientation: &Orientation) -> Sym2 {
    let mut bending = Sym2::default();
    if difference != 0.0 {
        bending.add_scaled(difference, &orientation.along());
    }
    bending
}
