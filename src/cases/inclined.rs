//! Two layers whose interface crosses the cells at an angle, in uniform stress.
//!
//! The interface goes through the middle of the unit box, at `angle` to the x axis; with the
//! unit vectors `t` along and `n` across it and `d` the distance from it:
//!
//! ```text
//! simple shear   u = t d/eta_k,   shear stress 1 everywhere,   p = 0
//! pure shear     u = t s - n d (s along the interface),   p = -2 eta_k + const
//! ```

use super::{Case, Exact, Rates};
use crate::scene::SceneSource;

/// Parameters of the cases.
#[derive(Clone, Copy, Debug)]
pub struct Inclined {
    pub degrees: f64,
    /// Viscosity of the upper layer over that of the lower one.
    pub contrast: f64,
}

impl Inclined {
    fn text(&self, boundaries: &str) -> String {
        let (s, c) = self.degrees.to_radians().sin_cos();
        format!(
            "schema = 1\nname = \"inclined\"\n[domain]\nx = [-0.5, 0.5]\ny = [-0.5, 0.5]\n\
             [accuracy]\nplacement = \"jittered\"\n[time]\nend = 1\n[materials.lower]\n\
             shear_viscosity = 1\n[materials.upper]\nshear_viscosity = {:e}\n[[regions]]\n\
             material = \"lower\"\n[[regions]]\nmaterial = \"upper\"\n\
             shape.where = \"{c:?}*y > {s:?}*x\"\n[boundaries]\n{boundaries}",
            self.contrast
        )
    }
}

/// Simple shear along the interface. The upper side has the exact traction, the others the exact
/// velocity.
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

/// Stretching along the interface: the velocity is linear, the pressure jumps.
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
