//! This module defines the linear law at one integration point, the derivative of the stress with
//! respect to the rates.
//!
//! At given rates and pressure every material has the power per volume
//!
//! ```text
//! d.S d + beta tr(D)^2 + 4 eta_c (omega - w)^2 + grad w.(M I + N) grad w,   d = (D_xx - D_yy, 2 D_xy)
//! ```
//! plus `-p div u`. An isotropic fluid has `S = eta I` and `N = 0`. With `beta = eta` the first two terms are
//! `2 eta D:D`, the form used for incompressible materials. A material with a finite bulk viscosity
//! has `beta = 0`; its bulk viscosity enters through the pressure.
//!
//! Around an axis the power has besides
//!
//! ```text
//! c (D_tt - tr(D)/3)^2 + (M + tr N) (w/x)^2,   c = 3 eta
//! ```
//! and `(2/3) beta tr(D)^2` takes the place of `beta tr(D)^2`. With `beta = eta` an isotropic fluid has
//! `2 eta D:D` again, with `beta = 0` it has `2 eta D':D'` with the deviator in three dimensions. The hoop direction lies in the layers of a layered material: `eta` is the viscosity of
//! stretching.

use super::rates::{Rates, Stress};

/// Symmetric 2x2 matrix `[[a, c], [c, b]]` on the deviatoric rates (Pa s) or the curvature rates
/// (Pa s m2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sym2 {
    /// First diagonal entry.
    pub a: f64,
    /// Second diagonal entry.
    pub b: f64,
    /// Off-diagonal entry.
    pub c: f64,
}

impl Sym2 {
    /// The identity matrix times `eta`.
    pub fn isotropic(eta: f64) -> Self {
        Sym2 { a: eta, b: eta, c: 0.0 }
    }

    /// Adds `f` times the matrix `o`.
    pub fn add_scaled(&mut self, f: f64, o: &Sym2) {
        self.a += f * o.a;
        self.b += f * o.b;
        self.c += f * o.c;
    }

    /// Inverse; the matrix must be positive definite.
    pub fn inverse(&self) -> Self {
        let det = self.a * self.b - self.c * self.c;
        Sym2 { a: self.b / det, b: self.a / det, c: -self.c / det }
    }

    /// Mean of the eigenvalues.
    pub fn mean(&self) -> f64 {
        0.5 * (self.a + self.b)
    }

    /// Product with a vector, `S d`.
    #[inline(always)]
    pub fn times(&self, d: [f64; 2]) -> [f64; 2] {
        [self.a * d[0] + self.c * d[1], self.c * d[0] + self.b * d[1]]
    }

    /// Quadratic form `d.S d`.
    #[inline(always)]
    pub fn quadratic(&self, d: [f64; 2]) -> f64 {
        self.a * d[0] * d[0] + self.b * d[1] * d[1] + 2.0 * self.c * d[0] * d[1]
    }
}

/// Coefficients of the power at one integration point; the module documentation defines them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointLaw {
    /// Deviatoric viscosity matrix S, Pa s.
    pub shear: Sym2,
    /// Viscosity beta of the dilation term, Pa s.
    pub dilation: f64,
    /// Coupling viscosity eta_c, Pa s.
    pub coupling: f64,
    /// Couple viscosity M, Pa s m2.
    pub couple: f64,
    /// Couple viscosity matrix N of the bending of layers, Pa s m2; see
    /// [`layered`](super::layered). `M I + N` is positive semi-definite.
    pub bending: Sym2,
    /// Viscosity c of the hoop deviator, Pa s; of no effect in the plane.
    pub hoop: f64,
}

impl PointLaw {
    /// The law with its deviatoric and dilation viscosities multiplied by `f`, and with its
    /// coupling and couple viscosities unchanged.
    pub fn with_viscosity_scaled(&self, f: f64) -> Self {
        let mut shear = Sym2::default();
        shear.add_scaled(f, &self.shear);
        PointLaw { shear, dilation: f * self.dilation, hoop: f * self.hoop, ..*self }
    }

    /// The law with all its viscosities multiplied by `f`.
    pub fn scaled(&self, f: f64) -> Self {
        let [coupling, couple] = [self.coupling, self.couple].map(|v| f * v);
        let mut bending = Sym2::default();
        bending.add_scaled(f, &self.bending);
        PointLaw { coupling, couple, bending, ..self.with_viscosity_scaled(f) }
    }

    /// Coupling viscosity minus the mean shear viscosity, Pa s; zero if this is negative.
    pub fn excess_coupling(&self) -> f64 {
        (self.coupling - self.shear.mean()).max(0.0)
    }

    /// The law with its coupling viscosity limited to the mean shear viscosity.
    pub fn without_excess(&self) -> Self {
        PointLaw { coupling: self.coupling - self.excess_coupling(), ..*self }
    }

    /// Viscosity, Pa s, that rotation adds to a flow that varies over the length `h`, m: the
    /// coupling viscosity if the rotation is too stiff to follow the flow, `M/h^2` if it follows
    /// it, with the larger couple viscosity of a layered material.
    pub fn turning_viscosity(&self, h: f64) -> f64 {
        let follow = (self.couple + (self.bending.a + self.bending.b).max(0.0)) / (h * h);
        if follow > 0.0 { self.coupling * follow / (self.coupling + follow) } else { 0.0 }
    }

    /// Stresses at the rates `r`, multiplied by the volume of the point.
    #[inline(always)]
    pub fn stress(&self, r: &Rates, volume: f64) -> Stress {
        let bending = self.bending.times(r.kappa);
        Stress {
            deviator: [
                volume * (self.shear.a * r.d[0] + self.shear.c * r.d[1]),
                volume * (self.shear.c * r.d[0] + self.shear.b * r.d[1]),
            ],
            mean: volume * self.dilation * (r.trace - r.third),
            skew: volume * 4.0 * self.coupling * r.relative_spin,
            couple: [0, 1].map(|c| volume * self.couple * r.kappa[c] + volume * bending[c]),
            hoop: volume * self.hoop * r.hoop,
            hoop_couple: volume * self.hoop_couple() * r.hoop_kappa,
        }
    }

    /// Couple viscosity of the hoop curvature, Pa s m2.
    #[inline(always)]
    fn hoop_couple(&self) -> f64 {
        self.couple + self.bending.a + self.bending.b
    }

    /// Power per volume at the rates `r`, without the power of the pressure.
    #[inline(always)]
    pub fn power(&self, r: &Rates) -> f64 {
        self.power_in_plane(r) + self.power_around_axis(r)
    }

    /// Part of the power of the hoop deviator and the hoop curvature.
    #[inline(always)]
    pub fn power_around_axis(&self, r: &Rates) -> f64 {
        self.hoop * r.hoop * r.hoop + self.hoop_couple() * r.hoop_kappa * r.hoop_kappa
    }

    /// Part of the power of all other rates.
    #[inline(always)]
    pub fn power_in_plane(&self, r: &Rates) -> f64 {
        self.shear.quadratic(r.d)
            + self.dilation * r.trace * (r.trace - r.third)
            + 4.0 * self.coupling * r.relative_spin * r.relative_spin
            + self.couple * (r.kappa[0] * r.kappa[0] + r.kappa[1] * r.kappa[1])
            + self.bending.quadratic(r.kappa)
    }
}
