//! Refuses scenes whose problem has no unique solution.

use super::values::Result;
use crate::plan::loads::fixed_loads;
use crate::plan::{BoundaryPlan, EffectSet, Units};
use crate::scene::{FieldFn, Quantity, Scene, SceneError, Scope};
use crate::space::mesh::Mesh;

/// Refuses scenes with a net load along a free rigid translation, and scenes that may rotate
/// rigidly.
pub(super) fn check_null_spaces(
    scene: &Scene,
    boundary: &BoundaryPlan,
    mesh: &Mesh,
    units: &Units,
    effects: &EffectSet,
    body_force: Option<&[FieldFn; 3]>,
) -> Result<()> {
    let free = boundary.free_translation;
    if free == [false; 2] {
        return Ok(());
    }
    if free == [true; 2] && !mesh.x.periodic() && !mesh.y.periodic() {
        return Err(SceneError::of_key(
            "boundaries",
            "nothing holds the scene: every side is open",
            "give some boundary a velocity, or make sides periodic",
        ));
    }
    let load = fixed_loads::<2>(boundary, body_force, mesh, units);
    for c in (0..2).filter(|&c| free[c]) {
        let name = ["x", "y"][c];
        let total: f64 = load.iter().map(|f| f[c].abs()).sum();
        let net: f64 = load.iter().map(|f| f[c]).sum();
        let gravity =
            if effects.gravity { scene.gravity[c].clone() } else { Quantity::number(0.0) };
        let pulled = effects.gravity && gravity.eval(&Scope::new(scene)?)? != 0.0;
        if pulled || net.abs() > 1e-9 * total {
            return Err(SceneError::at(
                &gravity,
                format!("nothing holds the scene along {name}, and a net force acts there"),
                format!(
                    "there is no steady solution: balance the loads, or hold a side \
                     (velocity_{name})"
                ),
            ));
        }
    }
    Ok(())
}
