//! This module holds the case of a layered fluid driven by a body force in a box, and the case of a
//! resolved stack of layers, whose limit it is (sections 2.3-2.4 of Dufour, Muehlhaus and Moresi).
//!
//! The unit box has free slip and layers along x. With the streamfunction
//! `psi = (A/ky) sin kx x sin ky y` and the force
//! `F (ky sin kx x cos ky y, -kx cos kx x sin ky y)/ky`:
//!
//! ```text
//! A = F (kx^2 + ky^2) / (4 eta kx^2 ky^2 + eta_s (kx^2 - ky^2)^2)
//! ```
//! where `eta` and `eta_s` are the arithmetic and the harmonic mean of the viscosities of the
//! stack.

use super::{Case, Exact, Rates};
use crate::scene::{SceneError, SceneSource, presets};
use std::f64::consts::PI;

/// Numbers of half waves of the flow in x and y. If they are equal, the layers are not sheared.
#[derive(Clone, Copy, Debug)]
pub struct Wave {
    /// Half waves along x.
    pub x: u32,
    /// Half waves along y.
    pub y: u32,
}

impl Wave {
    /// Wave numbers `kx`, `ky`.
    fn numbers(self) -> [f64; 2] {
        [f64::from(self.x) * PI, f64::from(self.y) * PI]
    }

    /// Expressions of the force along x and y, with `F = ky`.
    fn force(self) -> [String; 2] {
        let [kx, ky] = self.numbers();
        [
            format!("{ky:?} * sin({kx:?}*x) * cos({ky:?}*y)"),
            format!("-{kx:?} * cos({kx:?}*x) * sin({ky:?}*y)"),
        ]
    }

    /// The exact solution of the layered law.
    fn exact(self, contrast: f64) -> Exact {
        let [kx, ky] = self.numbers();
        let (eta, eta_s) = (0.5 * (1.0 + contrast), 2.0 / (1.0 + 1.0 / contrast));
        let difference = kx * kx - ky * ky;
        let a =
            (kx * kx + ky * ky) / (4.0 * eta * kx * kx * ky * ky + eta_s * difference * difference);
        let p = -ky / kx * (1.0 - a * (2.0 * eta * kx * kx - eta_s * difference));
        Exact {
            velocity: Box::new(move |x, y| {
                let ((sx, cx), (sy, cy)) = ((kx * x).sin_cos(), (ky * y).sin_cos());
                [a * ky * sx * cy, -a * kx * cx * sy, 0.0]
            }),
            pressure: Box::new(move |x, y| p * (kx * x).cos() * (ky * y).cos()),
        }
    }
}

/// The stack with `pairs` pairs of layers, whose viscosities differ by the factor `contrast`. Its
/// difference from the exact solution is the error of the layered law.
///
/// # Errors
/// The preset does not accept the parameters.
pub fn layer_stack(wave: Wave, pairs: u32, contrast: f64) -> Result<Case, SceneError> {
    let [x, y] = wave.force();
    let sets = [
        format!("pairs={pairs}"),
        format!("contrast={contrast:e}"),
        format!("body_force.x={x}"),
        format!("body_force.y={y}"),
    ];
    Ok(Case {
        name: "layer_stack".into(),
        title: "resolved stack of hard and soft layers against the layered law",
        source: "Dufour, Muehlhaus and Moresi, sections 2.3-2.4",
        scene: presets::find("layer_stack")?.with_sets(&sets)?,
        exact: wave.exact(contrast),
        rates: Rates { velocity: 0.9, rotation: None, pressure: None },
    })
}

/// The same box filled with one layered fluid; `contrast` as for [`layer_stack`].
pub fn layered_cell(wave: Wave, contrast: f64) -> Case {
    let [x, y] = wave.force();
    let text = format!(
        "schema = 1\nname = \"layered_cell\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[time]\nend = 1\n\
         [materials.fluid]\nshear_viscosity = {:?}\nlayer_viscosity = {:?}\n[[regions]]\n\
         material = \"fluid\"\ndirector.angle_degrees = 90\n[body_force]\nx = \"{x}\"\ny = \"{y}\"\n",
        0.5 * (1.0 + contrast),
        2.0 / (1.0 + 1.0 / contrast)
    );
    Case {
        name: "layered_cell".into(),
        title: "stirred box of layered fluid",
        source: "manufactured",
        scene: SceneSource::new("layered_cell", text),
        exact: wave.exact(contrast),
        rates: Rates { velocity: 2.9, rotation: None, pressure: Some(1.9) },
    }
}
