//! This module gives the rotation of cells with a solid in them its value on the outline, where that is
//! prescribed.
//!
//! As the velocity (see [`embedding`](super::embedding)), the rotation is a product of the distance `d` from the
//! solid and a bilinear function `q`, here relative to the value `W` on the solid:
//!
//! ```text
//! corner k     w_k = W + d_k q_k
//! other node   w_a = W + d_a mean of q over the corners beside it
//! ```

use super::mesh::Mesh;
use super::parts::Parts;
use super::relation::{BESIDE, NEAR};
use super::shape::NODES;

/// Matrix from the unknowns of the rotation of the nodes of a cell to their rotations.
pub type RotationMap = [[f64; NODES]; NODES];

const NONE: u32 = u32::MAX;

/// A node with a relation: its rotation is `offset` and the sum of `factor q_k` over some nodes `k`.
#[derive(Clone, Debug)]
struct Node {
    node: u32,
    terms: Vec<(u32, f64)>,
    offset: f64,
    /// Prescribed value of its own unknown; that of nodes without an own unknown is 0.
    given: Option<f64>,
}

/// Relations of the rotations of nodes.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    nodes: Vec<Node>,
    /// Index in `nodes` of each node of the mesh, or `NONE`.
    index: Vec<u32>,
}

impl Turning {
    /// The relations; `None` if no solid prescribes the rotation. `unit`: unit of the distances; `given`: the
    /// rotation of a node that other boundary conditions prescribe.
    pub(super) fn new(
        mesh: &Mesh,
        parts: &Parts,
        unit: f64,
        given: impl Fn(usize) -> Option<f64>,
    ) -> Option<Turning> {
        parts.solids.iter().find(|s| s.rotation.is_some())?;
        let mut out = Turning { nodes: vec![], index: vec![NONE; mesh.nodes()] };
        for (cell, part) in parts.all() {
            let nodes = mesh.cell_nodes(cell);
            let at = |a: usize| mesh.node_position(nodes[a]);
            let holds = |a: usize| parts.nearest(at(a)).is_some_and(|(s, _)| s.rotation.is_some());
            if !(0..NODES).any(holds) {
                continue;
            }
            for (a, &node) in nodes.iter().enumerate() {
                let Some((rotation, distance)) = nearest(parts, at(a)) else { continue };
                if out.index[node] == NONE {
                    out.index[node] = out.nodes.len() as u32;
                    let beside = BESIDE[a].iter().map(|&b| nodes[b] as u32);
                    let (beside, given) = (beside.collect::<Vec<_>>(), given(node));
                    out.nodes.push(relation(node, rotation, distance / unit, &beside, given));
                }
                if part.unresolved {
                    let held = &mut out.nodes[out.index[node] as usize];
                    held.terms.clear();
                    held.given = Some(0.0);
                }
            }
        }
        Some(out)
    }

    fn node(&self, node: usize) -> Option<&Node> {
        self.nodes.get(self.index[node] as usize)
    }

    /// Whether a node has a relation.
    pub(super) fn holds(&self, node: usize) -> bool {
        self.index[node] != NONE
    }

    /// Value of the unknown of a node, if it is not solved for.
    pub(super) fn known(&self, node: usize) -> Option<f64> {
        self.node(node)?.given
    }

    /// Map of a cell from its unknowns to its rotations; `None` if they are the same.
    pub(super) fn map_of(&self, nodes: [usize; NODES]) -> Option<RotationMap> {
        if !nodes.iter().any(|&n| self.holds(n)) {
            return None;
        }
        let mut map = [[0.0; NODES]; NODES];
        for (a, &node) in nodes.iter().enumerate() {
            let own = [(node as u32, 1.0)];
            let terms = self.node(node).map_or(&own[..], |n| &n.terms[..]);
            for (k, factor) in terms {
                if let Some(b) = nodes.iter().position(|n| n == &(*k as usize)) {
                    map[a][b] += factor;
                }
            }
        }
        Some(map)
    }

    /// Replaces changes of the unknowns of the nodes with relations by those of their rotations, component
    /// `c`.
    pub(super) fn expand<const D: usize>(&self, c: usize, velocity: &mut [[f64; D]]) {
        let of = |n: &Node| n.terms.iter().map(|(k, f)| f * velocity[*k as usize][c]).sum();
        let expanded: Vec<f64> = self.nodes.iter().map(of).collect();
        for (n, w) in self.nodes.iter().zip(expanded) {
            velocity[n.node as usize][c] = w;
        }
    }

    /// Replaces the couples on the rotations of the nodes with relations by those on their unknowns.
    pub(super) fn reduce<const D: usize>(&self, c: usize, force: &mut [[f64; D]]) {
        let take = |n: &Node| std::mem::take(&mut force[n.node as usize][c]);
        let before: Vec<f64> = self.nodes.iter().map(take).collect();
        for (n, m) in self.nodes.iter().zip(before) {
            n.terms.iter().for_each(|(k, f)| force[*k as usize][c] += f * m);
        }
    }

    /// Makes a rotation satisfy the relations; where it does, it does not change.
    pub(super) fn impose<const D: usize>(&self, c: usize, velocity: &mut [[f64; D]]) {
        for n in &self.nodes {
            let w = &mut velocity[n.node as usize][c];
            *w = n.unknown(*w - n.offset);
        }
        self.expand(c, velocity);
        for n in &self.nodes {
            velocity[n.node as usize][c] += n.offset;
        }
    }
}

impl Node {
    /// The unknown of the node for its rotation relative to that of the solid.
    fn unknown(&self, w: f64) -> f64 {
        let own = self.terms.iter().find(|(k, _)| *k == self.node);
        match (self.given, own) {
            (Some(q), _) => q,
            (None, Some((_, d))) if d.abs() > NEAR => w / d,
            _ => 0.0,
        }
    }
}

/// Rotation and signed distance of the nearest solid that prescribes the rotation.
fn nearest(parts: &Parts, p: [f64; 2]) -> Option<(f64, f64)> {
    let all = parts.solids.iter().filter_map(|s| Some((s.rotation?, s.outline.distance(p))));
    all.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The relation of a node at a distance from a solid; `beside`: corners beside it, for nodes that are not
/// corners.
fn relation(node: usize, offset: f64, d: f64, beside: &[u32], given: Option<f64>) -> Node {
    let own = node as u32;
    if beside.is_empty() {
        let value = |w: f64| if d.abs() > NEAR { (w - offset) / d } else { 0.0 };
        return Node { node: own, terms: vec![(own, d)], offset, given: given.map(value) };
    }
    let share = d / beside.len() as f64;
    let terms = beside.iter().map(|&k| (k, share)).collect();
    Node { node: own, terms, offset, given: Some(0.0) }
}
