//! This module defines the materials that the solver uses: dimensionless and checked.

use crate::laws::Law;
use crate::space::particles::Particles;

/// A material with values in the plan's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name of the material.
    pub name: String,
    /// Shear viscosity eta; the largest one if particles carry their own.
    pub viscosity: f64,
    /// Particles carry their own viscosity.
    pub carries_viscosity: bool,
    /// Density; the largest one if particles carry their own.
    pub density: f64,
    /// Particles carry their own density.
    pub carries_density: bool,
    /// Micro-inertia j of the rotation; zero without.
    pub micro_inertia: f64,
    /// Constitutive law.
    pub law: Law,
    /// Whether the material fills the part of the domain outside all regions.
    pub background: bool,
}

impl Material {
    /// Density of particle `k`, which is of this material.
    pub fn density_of(&self, particles: &Particles, k: usize) -> f64 {
        match &particles.density {
            Some(carried) if self.carries_density => carried[k],
            _ => self.density,
        }
    }

    /// Whether the law depends on the flow, and neither law nor density on what particles carry.
    pub fn is_flowing(&self) -> bool {
        let depends = self.law.depends_on();
        depends.needs_flow() && !(depends.history || self.carries_viscosity || self.carries_density)
    }

    /// Whether the law and the density are the same for all particles, independent of their history
    /// and of the flow.
    pub fn is_uniform(&self) -> bool {
        !self.carries_viscosity && !self.carries_density && self.law.depends_on().is_none()
    }
}
