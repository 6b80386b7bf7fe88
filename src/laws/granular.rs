//! This module computes the viscosities of a grain assembly from its contacts, equations
//! (14)-(17).
//!
//! ```text
//! eta   = (1-n) k (eta_n + eta_m) / (4 pi)
//! eta_c = (1-n) k eta_m / (2 pi)
//! B     = (1-n) k eta_n / (2 pi)
//! ```
//! Equation (16) is printed with `eta_m`. Isotropic compression moves contacts only along their
//! normals, so `eta_n` is meant, as in the elastic model from which the equation derives.

use std::f64::consts::PI;

/// Porosity, coordination number and contact dashpots of a grain assembly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contacts {
    /// Porosity n, the volume fraction of voids, 0 to 1.
    pub porosity: f64,
    /// Coordination number k, contacts per grain.
    pub coordination: f64,
    /// Viscosity eta_n of a contact in the normal direction, Pa s.
    pub normal_dashpot: f64,
    /// Viscosity eta_m of a contact in the tangential direction, Pa s.
    pub tangential_dashpot: f64,
}

/// Macroscopic viscosities, Pa s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viscosities {
    /// Shear viscosity eta, Pa s.
    pub shear: f64,
    /// Coupling viscosity eta_c, Pa s.
    pub coupling: f64,
    /// Bulk viscosity B, Pa s.
    pub bulk: f64,
}

/// Macroscopic viscosities of a grain assembly, equations (14)-(16).
pub fn viscosities(c: &Contacts) -> Viscosities {
    let density = (1.0 - c.porosity) * c.coordination;
    Viscosities {
        shear: density * (c.normal_dashpot + c.tangential_dashpot) / (4.0 * PI),
        coupling: density * c.tangential_dashpot / (2.0 * PI),
        bulk: density * c.normal_dashpot / (2.0 * PI),
    }
}
