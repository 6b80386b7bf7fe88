//! This module resolves the rotation of a material: its internal lengths or its couple viscosity, and its
//! micro-inertia.

use super::values::{Result, not_negative};
use crate::laws::cosserat::{Cosserat, couple_viscosity};
use crate::plan::Warning;
use crate::scene::{self, Quantity, Scene, SceneError, Scope};

/// The rotation of a material with the coupling viscosity `coupling`; `None` if it is classical.
pub(super) fn rotation(
    (name, m): (&str, &scene::Material),
    scope: &Scope,
    coupling: f64,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Cosserat>> {
    let couple = match (&m.internal_length, &m.couple_viscosity) {
        (Some(r), None) => couple_viscosity(coupling, not_negative(r, scope, "internal_length")?),
        (None, Some(q)) => not_negative(q, scope, "couple_viscosity")?,
        (None, None) => 0.0,
        (Some(q), Some(_)) => {
            return Err(SceneError::at(
                q,
                format!("material `{name}` has both internal_length and couple_viscosity"),
                "give one of them: couple_viscosity = 2 coupling_viscosity internal_length^2",
            ));
        }
    };
    let layer_couple = match &m.layer_internal_length {
        Some(q) => {
            needs_layers((name, m), q)?;
            couple_viscosity(coupling, not_negative(q, scope, "layer_internal_length")?)
        }
        None => couple,
    };
    let length_alone = coupling == 0.0
        && m.internal_length.is_some()
        && m.coupling_viscosity.is_none()
        && m.coupling_ratio.is_none();
    if length_alone || coupling > 0.0 && couple == 0.0 && m.internal_length.is_none() {
        warnings.push(Warning::NoInternalLength { material: name.into() });
    }
    let resists = coupling > 0.0 && couple.max(layer_couple) > 0.0;
    Ok(resists.then_some(Cosserat { coupling, couple, layer_couple }))
}

/// Micro-inertia of a material, m2; zero without. It needs inertia, and a rotation (`rotates`).
pub(super) fn micro_inertia(
    (name, m): (&str, &scene::Material),
    (scene, scope): (&Scene, &Scope),
    rotates: bool,
) -> Result<f64> {
    let Some(q) = &m.micro_inertia else { return Ok(0.0) };
    let j = not_negative(q, scope, "micro_inertia")?;
    let refuse = |lacks: &str, remedy: &str| {
        let message = format!("material `{name}` has micro_inertia but {lacks}");
        Err(SceneError::at(q, message, remedy))
    };
    if !scene.inertia {
        return refuse("the scene has no inertia", "set `inertia = true`, or remove micro_inertia");
    }
    if !rotates && j > 0.0 {
        return refuse(
            "no rotation",
            "give the material internal_length and coupling_viscosity (with a flow curve: \
             coupling_ratio), or remove micro_inertia",
        );
    }
    Ok(j)
}

/// Refuses an internal length `q` of the layers without layers or without an internal length.
fn needs_layers((name, m): (&str, &scene::Material), q: &Quantity) -> Result<()> {
    let refuse = |lacks: &str, remedy: &str| {
        let message = format!("material `{name}` has layer_internal_length but no {lacks}");
        Err(SceneError::at(q, message, remedy))
    };
    if m.internal_length.is_none() {
        return refuse(
            "internal_length",
            "give internal_length = <m>, that of rotations which vary across the layers; it may be 0",
        );
    }
    if m.layer_viscosity.is_none() && m.layer_ratio.is_none() {
        return refuse(
            "layers",
            "give layer_viscosity (with a flow curve: layer_ratio), which may equal the shear \
             viscosity, and directors, or remove the key",
        );
    }
    Ok(())
}
