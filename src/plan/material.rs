//! Materials as the solver knows them: dimensionless, checked, effects decided.

use crate::laws::layered;
use crate::laws::point::{PointLaw, Sym2};
use nalgebra::Vector2;

/// A material in the plan's units.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    pub name: String,
    /// eta; the largest one where particles carry their own.
    pub viscosity: f64,
    /// Particles carry their own viscosity.
    pub carries_viscosity: bool,
    pub density: f64,
    /// Particles carry their own density.
    pub carries_density: bool,
    /// 1/B; zero when incompressible.
    pub compliance: f64,
    pub rotation: Option<CosseratLaw>,
    /// eta_s of a layered material.
    pub layer_viscosity: Option<f64>,
    pub background: bool,
}

/// Couple stresses of a Cosserat material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CosseratLaw {
    /// eta_c
    pub coupling: f64,
    /// M
    pub couple: f64,
}

impl Material {
    /// One law and density for all its particles, whatever their history.
    pub fn is_uniform(&self) -> bool {
        !self.carries_viscosity && !self.carries_density && self.layer_viscosity.is_none()
    }

    /// Law at a point where the viscosity is `eta` and the director tensor of its particles is
    /// `texture` (ignored unless layered).
    pub fn law(&self, eta: f64, texture: &Texture) -> PointLaw {
        let mut shear = Sym2::isotropic(eta);
        if let Some(eta_s) = self.layer_viscosity {
            let de = eta - eta_s;
            shear.add_scaled(-de, &texture.projector());
        }
        let rotation = self.rotation.unwrap_or(CosseratLaw { coupling: 0.0, couple: 0.0 });
        PointLaw {
            shear,
            dilation: if self.compliance == 0.0 { eta } else { 0.0 },
            coupling: rotation.coupling,
            couple: rotation.couple,
        }
    }
}

/// Weighted mean of `m m^T`, `m = (sin 2th, -cos 2th)`, over directors; round axes, so `n` and
/// `-n` agree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texture {
    weight: f64,
    ss: f64,
    sc: f64,
}

impl Texture {
    pub fn add(&mut self, weight: f64, n: [f64; 2]) {
        let (s, c) = layered::double_angle(&Vector2::new(n[0], n[1]));
        self.weight += weight;
        self.ss += weight * s * s;
        self.sc += weight * s * c;
    }

    fn projector(&self) -> Sym2 {
        if self.weight == 0.0 {
            return Sym2::default();
        }
        let ss = self.ss / self.weight;
        Sym2 { a: ss, b: 1.0 - ss, c: -self.sc / self.weight }
    }
}
