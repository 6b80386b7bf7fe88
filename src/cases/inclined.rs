//! This module holds cases of two layers, in simple and in pure shear, whose interface is inclined
//! to the mesh.
//!
//! The interface passes through the centre of the unit box at an angle to the x axis. With unit
//! vectors `t` along and `n` across it, and the distance `d` from it:
//!
//! ```text
//! simple shear   u = t d/eta_k,   shear stress 1 everywhere,   p = 0
//! pure shear     u = t s - n d (s along the interface),   p = -2 eta_k + const
//! ```

use super::{Case, Exact, Rates};
use crate::scene::SceneSource;

/// Parameters of the inclined cases.
#[derive(Clone, Copy, Debug)]
pub struct Inclined {
    /// Angle of the interface to the x axis, degrees.
    pub degrees: f64,
    /// Viscosity of the upper layer over the viscosity of the lower layer.
    pub contrast: f64,
}

impl Inclined {
    fn text(&self, boundaries: &str) -> String {
        let (s, c) = self.degrees.to_radians().sin_cos();
        format!(
            "schema = 1\nname = \"inclined\"\n[domain]\nx = [-0.5, 0.5]\ny = [-0.5, 0.5]\n\
             [accuracy]\nplacement = \"jittered\"\n[time]\nsteady = true\n[materials.lower]\n\
             shear_viscosity = 1\n[materials.upper]\nshear_viscosity = {:e}\n[[regions]]\n\
             material = \"lower\"\n[[regions]]\nmaterial = \"upper\"\n\
             shape.where = \"{c:?}*y > {s:?}*x\"\n[boundaries]\n{boundaries}",
            self.contrast
        )
    }
}

/// Simple shear along the interface. The exact traction is prescribed on the upper side, and the
/// exact velocity on the other sides.
pub fn inclined_shear(i: Inclined) -> Case {
    let (s, c) = i.degrees.to_radians().sin_cos();
    let soft = format!("({c:?}*y - {s:?}*x)");
    let speed = format!("({soft} * (({soft} > 0) / {:e} + ({soft} <= 0)))", i.contrast);
    // sigma = t n' + n t',  t = (c, s), n = (-s, c)
    let mut text = format!(
        "top = {{ kind = \"open\", traction_x = {:?}, traction_y = {:?} }}\n",
        c * c - s * s,
        2.0 * s * c
    );
    for side in ["left", "right", "bottom"] {
        text += &format!(
            "{side} = {{ velocity_x = \"{c:?} * {speed}\", velocity_y = \"{s:?} * {speed}\" }}\n"
        );
    }
    Case {
        name: "inclined_shear".into(),
        title: "two layers sheared along an inclined interface",
        source: "piecewise linear",
        scene: SceneSource::new("inclined_shear", i.text(&text)),
        exact: Exact {
            velocity: Box::new(move |x, y| {
                let d = c * y - s * x;
                let speed = if d > 0.0 { d / i.contrast } else { d };
                [c * speed, s * speed, 0.0]
            }),
            pressure: Box::new(|_, _| 0.0),
        },
        rates: Rates { velocity: 0.9, rotation: None, pressure: None },
    }
}

/// Stretching along the interface. The velocity is linear, and the pressure jumps at the interface.
pub fn inclined_pure_shear(i: Inclined) -> Case {
    let (s, c) = i.degrees.to_radians().sin_cos();
    // D = t t' - n n'
    let (a, b) = (c * c - s * s, 2.0 * s * c);
    let side =
        format!("{{ velocity_x = \"{a:?}*x + {b:?}*y\", velocity_y = \"{b:?}*x - {a:?}*y\" }}");
    let text: String =
        ["left", "right", "bottom", "top"].map(|name| format!("{name} = {side}\n")).concat();
    Case {
        name: "inclined_pure_shear".into(),
        title: "two layers stretched along an inclined interface",
        source: "piecewise linear",
        scene: SceneSource::new("inclined_pure_shear", i.text(&text)),
        exact: Exact {
            velocity: Box::new(move |x, y| [a * x + b * y, b * x - a * y, 0.0]),
            // The normal stress -p - 2 eta is continuous.
            pressure: Box::new(move |x, y| if c * y > s * x { -2.0 * i.contrast } else { -2.0 }),
        },
        rates: Rates { velocity: 0.9, rotation: None, pressure: None },
    }
}
