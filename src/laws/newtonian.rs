//! This module gives the law of the isotropic viscous fluid, equation (13): `sigma' = 2 eta D'`.
//!
//! `eta` is the shear viscosity (Pa s) and `D'` the deviatoric strain rate; the deviator is the
//! two-dimensional `D - tr(D)/2 I`. Equation (13) is printed with `D - tr(D)`.

use super::point::Sym2;

/// Viscosity matrix `S = eta I` of an isotropic fluid on the deviatoric rates, Pa s.
pub fn shear(eta: f64) -> Sym2 {
    Sym2::isotropic(eta)
}
