//! This module measures the contribution of inclusions smaller than a cell to the dissipation, in
//! pure shear at the rate 1.
//!
//! With viscosity `eta` outside and `lambda eta` inside, and the strain rate `D:D = 2`:
//!
//! ```text
//! sheet of area A stretched along itself   P = 4 eta (1 - A) + 4 lambda eta A      (exact)
//! drop of area A << 1                      P = 4 eta [1 + 2 A (lambda - 1)/(lambda + 1)]
//! ```
//! The formula of the drop is the dilute limit for a disc in two dimensions.

use super::{CaseError, start};
use crate::scene::SceneSource;

/// A scene with a small inclusion whose contribution to the dissipation is known.
pub struct Small {
    scene: SceneSource,
    /// Dissipation outside a sheet, or without a drop, for `eta = 1`.
    matrix: f64,
    /// Dissipation inside a sheet, or added by a drop, for `eta = 1`.
    excess: f64,
}

impl Small {
    /// A sheet near the centre of a unit box, at an angle to the x axis.
    pub fn sheet(degrees: f64, thickness: f64, contrast: f64) -> Self {
        let (s, c) = degrees.to_radians().sin_cos();
        let area = thickness / c;
        // Shifted from the centre so that it does not coincide with a mesh line.
        let shape = format!("abs({c:?}*y - {s:?}*x - 0.0137) < {:?}", 0.5 * thickness);
        Small {
            scene: scene(&shape, [c * c - s * s, 2.0 * s * c], contrast),
            matrix: 4.0 * (1.0 - area),
            excess: 4.0 * contrast * area,
        }
    }

    /// A drop near the centre of a unit box.
    pub fn drop(radius: f64, contrast: f64) -> Self {
        let shape = format!("(x - 0.0137)^2 + (y + 0.0091)^2 < {:?}", radius * radius);
        let area = std::f64::consts::PI * radius * radius;
        Small {
            scene: scene(&shape, [1.0, 0.0], contrast),
            matrix: 4.0,
            excess: 8.0 * area * (contrast - 1.0) / (contrast + 1.0),
        }
    }

    /// Computed contribution of the inclusion to the dissipation over the exact one. `sets`:
    /// further assignments `name=value`.
    ///
    /// # Errors
    /// The scene is invalid, or the flow cannot be solved for.
    pub fn strength(&self, cells: u32, sets: &[&str]) -> Result<f64, CaseError> {
        let mut all = vec![format!("accuracy.cells={cells}")];
        all.extend(sets.iter().map(ToString::to_string));
        let source = self.scene.with_sets(&all)?;
        let run = start(&source)?;
        Ok((run.row().dissipation - self.matrix) / self.excess)
    }
}

/// Scene of a unit box with the velocity of pure shear, `D = [[a, b], [b, -a]]`, on its sides.
fn scene(shape: &str, [a, b]: [f64; 2], contrast: f64) -> SceneSource {
    let side =
        format!("{{ velocity_x = \"{a:?}*x + {b:?}*y\", velocity_y = \"{b:?}*x - {a:?}*y\" }}");
    let sides =
        ["left", "right", "bottom", "top"].map(|name| format!("{name} = {side}\n")).concat();
    let text = format!(
        "schema = 1\nname = \"small\"\n[domain]\nx = [-0.5, 0.5]\ny = [-0.5, 0.5]\n[accuracy]\n\
         placement = \"jittered\"\n[time]\nsteady = true\n[materials.around]\nshear_viscosity = 1\n\
         [materials.inside]\nshear_viscosity = {contrast:e}\n[[regions]]\nmaterial = \"around\"\n\
         [[regions]]\nmaterial = \"inside\"\nshape.where = \"{shape}\"\n[boundaries]\n{sides}"
    );
    SceneSource::new("small", text)
}
