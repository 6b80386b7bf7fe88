//! Inclusions smaller than a cell, in pure shear at the rate 1: what they add to the dissipation.
//!
//! With viscosity `eta` around and `lambda eta` inside, strain rate `D:D = 2`:
//!
//! ```text
//! sheet of area A stretched along itself   P = 4 eta (1 - A) + 4 lambda eta A      (exact)
//! drop of area A << 1                      P = 4 eta [1 + 2 A (lambda - 1)/(lambda + 1)]
//! ```
//! The second is the dilute limit of a disc in two dimensions.

use super::{CaseError, start};
use crate::scene::SceneSource;

/// A scene whose excess of dissipation over the pure matrix is known.
pub struct Small {
    scene: SceneSource,
    /// Dissipation without the inclusion, and what it adds, for `eta = 1`.
    matrix: f64,
    excess: f64,
}

impl Small {
    /// A sheet through the middle of a unit box at an angle to the x axis.
    pub fn sheet(degrees: f64, thickness: f64, contrast: f64) -> Self {
        let (s, c) = degrees.to_radians().sin_cos();
        let area = thickness / c;
        // Off the middle by an odd share of a cell, so that no mesh line is met.
        let shape = format!("abs({c:?}*y - {s:?}*x - 0.0137) < {:?}", 0.5 * thickness);
        Small {
            scene: scene(&shape, [c * c - s * s, 2.0 * s * c], contrast),
            matrix: 4.0 * (1.0 - area),
            excess: 4.0 * contrast * area,
        }
    }

    /// A drop near the middle of a unit box.
    pub fn drop(radius: f64, contrast: f64) -> Self {
        let shape = format!("(x - 0.0137)^2 + (y + 0.0091)^2 < {:?}", radius * radius);
        let area = std::f64::consts::PI * radius * radius;
        Small {
            scene: scene(&shape, [1.0, 0.0], contrast),
            matrix: 4.0,
            excess: 8.0 * area * (contrast - 1.0) / (contrast + 1.0),
        }
    }

    /// Share of the true excess of dissipation that is computed.
    pub fn strength(&self, cells: u32, sets: &[&str]) -> Result<f64, CaseError> {
        let mut all = vec![format!("accuracy.cells={cells}")];
        all.extend(sets.iter().map(ToString::to_string));
        let source = self.scene.with_sets(&all)?;
        let run = start(&source)?;
        Ok((run.row().dissipation - self.matrix) / self.excess)
    }
}

/// Unit box whose sides move as pure shear with `D = [[a, b], [b, -a]]`.
fn scene(shape: &str, [a, b]: [f64; 2], contrast: f64) -> SceneSource {
    let side =
        format!("{{ velocity_x = \"{a:?}*x + {b:?}*y\", velocity_y = \"{b:?}*x - {a:?}*y\" }}");
    let sides =
        ["left", "right", "bottom", "top"].map(|name| format!("{name} = {side}\n")).concat();
    let text = format!(
        "schema = 1\nname = \"small\"\n[domain]\nx = [-0.5, 0.5]\ny = [-0.5, 0.5]\n[accuracy]\n\
         placement = \"jittered\"\n[time]\nend = 1\n[materials.around]\nshear_viscosity = 1\n\
         [materials.inside]\nshear_viscosity = {contrast:e}\n[[regions]]\nmaterial = \"around\"\n\
         [[regions]]\nmaterial = \"inside\"\nshape.where = \"{shape}\"\n[boundaries]\n{sides}"
    );
    SceneSource::new("small", text)
}
