//! This module holds cases of layers that bend: layered Cosserat fluids with an internal length of their
//! layers.

use super::{Case, Exact, Fluid, Rates, poiseuille};
use crate::scene::SceneSource;
use std::f64::consts::PI;

/// A layered Cosserat fluid.
#[derive(Clone, Copy, Debug)]
pub struct Layered {
    /// Shear viscosity eta, Pa s.
    pub shear: f64,
    /// Viscosity eta_s of shear along the layers, Pa s.
    pub layer: f64,
    /// Coupling viscosity eta_c, Pa s.
    pub coupling: f64,
    /// Internal length R across the layers, m.
    pub internal_length: f64,
    /// Internal length R_l along the layers, m.
    pub layer_internal_length: f64,
}

impl Layered {
    fn toml(&self, director: f64) -> String {
        format!(
            "[materials.fluid]\nshear_viscosity = {:?}\nlayer_viscosity = {:?}\n\
             coupling_viscosity = {:?}\ninternal_length = {:?}\nlayer_internal_length = {:?}\n\
             [[regions]]\nmaterial = \"fluid\"\ndirector.angle_degrees = {director:?}\n",
            self.shear, self.layer, self.coupling, self.internal_length, self.layer_internal_length
        )
    }

    /// The isotropic fluid with the same plane channel flow.
    pub fn in_channel(&self, across: bool) -> Fluid {
        let internal_length =
            if across { self.layer_internal_length } else { self.internal_length };
        Fluid { shear: self.layer, coupling: self.coupling, internal_length }
    }
}

/// Plane Poiseuille flow of a layered fluid whose layers lie along the channel or, if `across`, across
/// it. The flow shears along the layers or across them, both with the viscosity `eta_s`, and its
/// rotation varies only across the channel. So its equations are those of the isotropic fluid with the
/// shear viscosity `eta_s`, the same coupling viscosity, and the internal length
///
/// ```text
/// R    layers along the channel: t.grad w = 0
/// R_l  layers across the channel: grad w = (t.grad w) t
/// ```
/// whose exact flow is that of [`poiseuille`]. Layers across the channel turn with the flow, so the
/// solution holds only at the start.
pub fn layered_channel(fluid: Layered, across: bool, g: f64) -> Case {
    let plain = poiseuille(fluid.in_channel(across), g);
    let director = if across { 0.0 } else { 90.0 };
    let text = plain.scene.text().replace(&fluid.in_channel(across).toml(), &fluid.toml(director));
    Case {
        name: if across { "channel_across" } else { "channel_along" }.into(),
        title: "plane Poiseuille flow of a layered Cosserat fluid",
        scene: SceneSource::new("layered_channel", text),
        ..plain
    }
}

/// A wave of body couples in a periodic unit box filled with layers of one direction.
#[derive(Clone, Copy, Debug)]
pub struct CoupleWave {
    /// Numbers of waves along x and y.
    pub waves: [u32; 2],
    /// Angle from the direction of the wave to the director, degrees.
    pub director: f64,
}

/// The body couple `c = sin(K e.x)` in a periodic unit box, with the unit vectors `e` along the wave and
/// `f` at right angles, and a director at the angle `th` from `e`:
///
/// ```text
/// w = b sin(K e.x)   u = -(a/K) f cos(K e.x)   p = (eta - eta_s) sin 2th cos 2th a sin(K e.x)
/// a = 2 eta_c b/(eta_f + eta_c)   b = 1/[4 eta_c eta_f/(eta_f + eta_c) + 2 eta_c R_f^2 K^2]
/// eta_f = eta_s + (eta - eta_s) sin^2 2th   R_f^2 = R^2 cos^2 th + R_l^2 sin^2 th
/// ```
/// The answer depends only on `K` and `th`: it turns with the wave and the layers. The directors turn
/// with the flow, so the solution holds only at the start.
pub fn couple_wave(fluid: Layered, wave: CoupleWave) -> Case {
    let [m, n] = wave.waves.map(f64::from);
    let (k, angle) = (2.0 * PI * m.hypot(n), n.atan2(m));
    let (s, c) = (2.0 * wave.director.to_radians()).sin_cos();
    let (eta_c, de) = (fluid.coupling, fluid.shear - fluid.layer);
    let eta_f = fluid.layer + de * s * s;
    let [across, along] = [fluid.internal_length, fluid.layer_internal_length].map(|r| r * r);
    let r2 = 0.5 * (across * (1.0 + c) + along * (1.0 - c));
    let b = 1.0 / (4.0 * eta_c * eta_f / (eta_f + eta_c) + 2.0 * eta_c * r2 * k * k);
    let a = 2.0 * eta_c * b / (eta_f + eta_c);
    let (sin, cos) = angle.sin_cos();
    let phase = move |x: f64, y: f64| k * (cos * x + sin * y);
    Case {
        name: "couple_wave".into(),
        title: "couples on bending layers in a periodic box",
        source: "manufactured",
        scene: SceneSource::new(
            "couple_wave",
            format!(
                "schema = 1\nname = \"case\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nend = 1\n{}\
                 [body_force]\ncouple = \"sin(2*pi*({m:?}*x + {n:?}*y))\"\n[boundaries]\n\
                 left.kind = \"periodic\"\nright.kind = \"periodic\"\nbottom.kind = \"periodic\"\n\
                 top.kind = \"periodic\"\n",
                fluid.toml(angle.to_degrees() + wave.director)
            ),
        ),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let (sine, cosine) = phase(x, y).sin_cos();
                let u = -a / k * cosine;
                [-sin * u, cos * u, b * sine]
            }),
            pressure: Box::new(move |x, y| de * s * c * a * phase(x, y).sin()),
        },
        rates: Rates { velocity: 2.9, rotation: Some(2.9), pressure: Some(1.9) },
    }
}
