//! This module resolves a scene whose blocks have moved, and refuses motions that are not solved for.

use super::values::Result;
use crate::plan::{Moving, Plan, Pose};
use crate::scene::{BoundaryKind, FieldFn, Scene, SceneError};

/// The plan of a scene with the blocks that move at other places.
///
/// # Errors
/// The flow is impossible with the blocks there.
pub(in crate::plan) fn posed(scene: &Scene, poses: &[Pose]) -> Result<Plan> {
    super::without_schedule(scene, Some(poses))
}

/// Refuses blocks that move in a scene with inertia or along a periodic direction.
pub(super) fn check(scene: &Scene, moving: &[Moving]) -> Result<()> {
    let Some(first) = moving.first() else { return Ok(()) };
    let place = |name: &str| {
        let index = scene.blocks.iter().position(|b| b.name == name).unwrap_or(0);
        format!("blocks[{index}].velocity")
    };
    if scene.inertia {
        return Err(SceneError::of_key(
            place(&first.name),
            format!("block `{}` moves in a scene with inertia", first.name),
            "remove `inertia`, or let the block rest: with inertia, blocks do not move yet",
        ));
    }
    let sides = [&scene.boundaries.left, &scene.boundaries.bottom];
    for (c, side) in sides.into_iter().enumerate() {
        let moves = |m: &&Moving| m.velocity[c].constant() != Some(0.0);
        if side.kind == Some(BoundaryKind::Periodic)
            && let Some(m) = moving.iter().find(moves)
        {
            let letter = ["x", "y"][c];
            return Err(SceneError::of_key(
                place(&m.name),
                format!("block `{}` moves along {letter}, where the domain is periodic", m.name),
                format!(
                    "let it move along the other direction, or give the sides along {letter} a kind"
                ),
            ));
        }
    }
    Ok(())
}

/// Whether a velocity is zero at all times.
pub(super) fn rests(velocity: &[FieldFn; 2]) -> bool {
    velocity.iter().all(|v| v.constant() == Some(0.0))
}
