//! This module lists the nodes at and in solids that move.

use crate::plan::Plan;

/// Nodes at and in the solids of a scene with solids that move.
#[derive(Clone, Debug, Default)]
pub(super) struct Reach {
    inside: Vec<bool>,
    beside: Vec<bool>,
}

impl Reach {
    /// The nodes; none without solids that move.
    pub(super) fn of(plan: &Plan) -> Reach {
        let mesh = &plan.mesh;
        let Some(parts) = mesh.parts().filter(|_| !plan.moving.is_empty()) else {
            return Reach::default();
        };
        let moves = |name: &str| plan.moving.iter().any(|m| m.name == name);
        let beside = |node: usize| {
            let p = mesh.node_position(node);
            let [hx, hy] = mesh.cell_size(mesh.locate(p));
            let mut solids = parts.solids.iter().filter(|s| moves(&s.name));
            solids.any(|s| s.outline.distance(p) < 1.5 * hx.hypot(hy))
        };
        let inside = |node: usize| parts.is_solid(mesh.node_position(node));
        Reach {
            inside: (0..mesh.nodes()).map(inside).collect(),
            beside: (0..mesh.nodes()).map(beside).collect(),
        }
    }

    /// Whether a node is inside of a solid: nothing moves with its velocity.
    pub(super) fn inside(&self, node: usize) -> bool {
        self.inside.get(node).is_some_and(|&inside| inside)
    }

    /// Whether a node is in a solid that moves or near it.
    pub(super) fn beside(&self, node: usize) -> bool {
        self.beside.get(node).is_some_and(|&beside| beside)
    }
}
