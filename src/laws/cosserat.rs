//! This module gives the law of the rotation of an isotropic Cosserat fluid, equations (10)-(12).
//!
//! ```text
//! sigma_yx - sigma_xy = 4 eta_c (o - w),   o = (v,x - u,y)/2
//! mu_j = M w,j,   M = 2 eta_c R^2
//! ```
//! `eta_c` is the coupling viscosity (Pa s), `M` the couple viscosity (Pa s m2) and `R` the
//! internal length (m). The symmetric part of the stress is that of the classical fluid. The layers
//! of a layered material may have an internal length of their own; see [`layered`](super::layered).

/// Viscosities of the rotation of a Cosserat material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cosserat {
    /// Coupling viscosity eta_c, Pa s.
    pub coupling: f64,
    /// Couple viscosity M, Pa s m2; in a layered material that of rotations which vary across the
    /// layers.
    pub couple: f64,
    /// Couple viscosity M_l of rotations which vary along the layers, Pa s m2; M if isotropic.
    pub layer_couple: f64,
}

impl Cosserat {
    /// An isotropic rotation with the coupling viscosity `eta_c` and the couple viscosity `M`.
    pub fn isotropic(coupling: f64, couple: f64) -> Self {
        Cosserat { coupling, couple, layer_couple: couple }
    }

    /// Couple viscosity `M_l - M` of the bending of the layers, Pa s m2; zero if isotropic.
    pub fn bending(&self) -> f64 {
        self.layer_couple - self.couple
    }
}

/// Couple viscosity `M = 2 eta_c R^2`, Pa s m2, of an internal length `r`; equation (12).
pub fn couple_viscosity(eta_c: f64, r: f64) -> f64 {
    2.0 * eta_c * r * r
}
