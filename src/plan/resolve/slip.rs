//! This module resolves the laws of walls that are written instead of their kind: `slip_length` and
//! `wall_friction`.

use super::values::{Result, positive};
use super::walls::SiSolid;
use crate::plan::slip::WallLaw;
use crate::scene::{GivenWall, Scene, SceneError, Scope};

/// Laws of the walls and blocks of a scene, in SI units, in their order.
pub(in crate::plan) struct Slips {
    pub(in crate::plan) walls: Vec<Option<WallLaw>>,
    pub(in crate::plan) blocks: Vec<Option<WallLaw>>,
}

impl Slips {
    pub(super) fn new(scene: &Scene, scope: &Scope) -> Result<Slips> {
        let walls = scene
            .walls
            .iter()
            .map(|w| wall_law(w.given(), w.kind.is_some(), &format!("wall `{}`", w.name), scope));
        let blocks = scene
            .blocks
            .iter()
            .map(|b| wall_law(b.given(), b.kind.is_some(), &format!("block `{}`", b.name), scope));
        Ok(Slips { walls: walls.collect::<Result<_>>()?, blocks: blocks.collect::<Result<_>>()? })
    }
}

/// The law of the wall called `name`, if one is written. `kind`: whether its kind is written too.
pub(super) fn wall_law(
    given: GivenWall,
    kind: bool,
    name: &str,
    scope: &Scope,
) -> Result<Option<WallLaw>> {
    let (key, q) = match (given.slip_length, given.wall_friction) {
        (None, None) => return Ok(None),
        (Some(_), Some(q)) => {
            return Err(SceneError::at(
                q,
                format!("{name} gives both slip_length and wall_friction"),
                "give one of them: the friction of a fluid grows with its slip, that of grains does not",
            ));
        }
        (Some(q), None) => ("slip_length", q),
        (None, Some(q)) => ("wall_friction", q),
    };
    if kind {
        return Err(SceneError::at(
            q,
            format!("{name} gives both kind and {key}"),
            format!(
                "give one of them: {key} says how a wall resists, kind = \"free_slip\" that it does not"
            ),
        ));
    }
    let value = positive(q, scope, &format!("{name}: {key}"))?;
    Ok(Some(match given.slip_length {
        Some(_) => WallLaw::Slip { length: value },
        None => WallLaw::Friction { coefficient: value },
    }))
}

impl Slips {
    /// Law of a solid of any shape.
    pub(in crate::plan) fn of(&self, solid: &SiSolid) -> Option<WallLaw> {
        if solid.wall { self.walls[solid.index] } else { self.blocks[solid.index] }
    }
}
