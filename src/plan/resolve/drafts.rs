//! This module finds openings through which the weight of the background drives a draft.

use super::materials::SiMatter;
use crate::plan::boundary::{Piece, place_of};
use crate::plan::{BoundaryPlan, Warning};
use crate::scene::Scene;

/// A warning for each opening that extends along gravity and holds no pressure, while the background has
/// weight: what is outside would not carry the background, which falls out below and in above.
pub(super) fn drafts(
    scene: &Scene,
    si: &SiMatter,
    domain: [[f64; 2]; 2],
    boundary: &BoundaryPlan,
) -> Vec<Warning> {
    let background = |name: &str| scene.materials.get(name).is_some_and(|m| m.background);
    let Some(air) = si.materials.iter().find(|m| m.density > 0.0 && background(&m.name)) else {
        return vec![];
    };
    let holds_nothing = |(side, piece): &(usize, &Piece)| {
        let normal = side / 2;
        let given = &piece.conditions;
        let pressure = given.traction[normal].as_ref();
        piece.open
            && si.gravity[1 - normal] != 0.0
            && given.velocity[normal].is_none()
            && pressure.is_none_or(|f| f.constant() == Some(0.0))
    };
    let warning = |(side, piece): (usize, &Piece)| {
        let along = 1 - side / 2;
        let (gravity, axis) = (si.gravity[along], ["x", "y"][along]);
        let [low, high] = domain[along];
        let depth =
            if gravity < 0.0 { format!("({high} - {axis})") } else { format!("({axis} - {low})") };
        let sign = if side.is_multiple_of(2) { "" } else { "-" };
        let key = ["traction_x", "traction_y"][side / 2];
        Warning::Draft {
            place: place_of(side, piece),
            material: air.name.clone(),
            remedy: format!("{key} = \"{sign}{} * {depth}\"", air.density * gravity.abs()),
        }
    };
    boundary.pieces().filter(holds_nothing).map(warning).collect()
}
