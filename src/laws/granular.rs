//! Viscosities of a grain assembly from its contacts, equations (14)-(17).
//!
//! ```text
//! eta   = (1-n) k (eta_n + eta_m) / (4 pi)
//! eta_c = (1-n) k eta_m / (2 pi)
//! B     = (1-n) k eta_n / (2 pi)
//! ```
//! (16) is printed with `eta_m`; isotropic compression moves contacts only along their normals,
//! so `eta_n` is meant, as in the elastic model it derives from.

use std::f64::consts::PI;

/// Porosity, contacts and contact dashpots of a grain assembly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contacts {
    /// n, 0 to 1.
    pub porosity: f64,
    /// k, contacts per grain.
    pub coordination: f64,
    /// eta_n, Pa s.
    pub normal_dashpot: f64,
    /// eta_m, Pa s.
    pub tangential_dashpot: f64,
}

/// Macroscopic viscosities, Pa s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viscosities {
    /// eta
    pub shear: f64,
    /// eta_c
    pub coupling: f64,
    /// B
    pub bulk: f64,
}

/// Equations (14)-(16).
pub fn viscosities(c: &Contacts) -> Viscosities {
    let density = (1.0 - c.porosity) * c.coordination;
    Viscosities {
        shear: density * (c.normal_dashpot + c.tangential_dashpot) / (4.0 * PI),
        coupling: density * c.tangential_dashpot / (2.0 * PI),
        bulk: density * c.normal_dashpot / (2.0 * PI),
    }
}
