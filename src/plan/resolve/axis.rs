//! Checks the keys of an axisymmetric scene.

use super::values::Result;
use crate::plan::boundary::Side;
use crate::scene::{BoundaryKind, FieldFn, Scene, SceneError, Scope};

/// Whether the left side of the domain is the axis.
pub(super) fn is_axis(scene: &Scene, x: [f64; 2]) -> bool {
    scene.domain.geometry.is_round() && x[0] == 0.0
}

/// Refuses what an axisymmetric flow cannot have. `x`: range of the radius, m.
pub(super) fn check(scene: &Scene, x: [f64; 2], gravity: [f64; 2]) -> Result<()> {
    if !scene.domain.geometry.is_round() {
        return Ok(());
    }
    if x[0] < 0.0 {
        return Err(SceneError::at(
            &scene.domain.x[0],
            format!("domain.x begins at {}, but x is the distance from the axis", x[0]),
            "begin at 0, the axis, or above it for a ring; pictures show the mirror image too",
        ));
    }
    if gravity[0] != 0.0 {
        return Err(SceneError::at(
            &scene.gravity[0],
            format!(
                "gravity[0] is {}, but a round flow has no direction along the radius",
                gravity[0]
            ),
            "gravity acts along the axis: gravity = [0, -9.81]",
        ));
    }
    let sides = scene.boundaries.sides();
    if sides[..2].iter().any(|b| b.kind == Some(BoundaryKind::Periodic)) {
        return Err(SceneError::of_key(
            "boundaries.left.kind",
            "the radius cannot be periodic",
            "only bottom and top of an axisymmetric domain can be; give left and right another kind",
        ));
    }
    let left = sides[0];
    let given = left.given();
    let values = given.velocity.into_iter().chain(given.traction).chain([given.rotation]).flatten();
    let written = left.kind.is_some() || left.slip_length.is_some() || left.wall_friction.is_some();
    if is_axis(scene, x) && (written || values.count() > 0 || !left.parts.is_empty()) {
        return Err(SceneError::of_key(
            "boundaries.left",
            "boundaries.left is given, but the left side is the axis",
            "remove the table: at the axis the flow is smooth",
        ));
    }
    Ok(())
}

/// Refuses blocks that move along the radius: a round block would have to change its size.
pub(super) fn check_moving(scene: &Scene, scope: &Scope) -> Result<()> {
    for block in &scene.blocks {
        let Some([x, _]) = &block.velocity else { continue };
        let rests = matches!(x.in_time(scope)?, FieldFn::Constant(v) if v == 0.0);
        if scene.domain.geometry.is_round() && !rests {
            return Err(SceneError::at(
                x,
                format!("block `{}` moves along the radius", block.name),
                "a round block moves along the axis only: velocity = [0, <speed>]",
            ));
        }
    }
    Ok(())
}

/// Sets the conditions at the axis: no radial velocity and no rotation.
pub(super) fn hold(side: &mut Side, rotation: bool) {
    for piece in &mut side.pieces {
        piece.conditions.velocity[0] = Some(FieldFn::Constant(0.0));
        piece.conditions.rotation = rotation.then_some(FieldFn::Constant(0.0));
    }
}
