//! This module finds the nodes at which a side, wall or solid carries the forces of the material.

use super::Units;
use super::boundary::{BoundaryPlan, SIDES};
use super::resolve::walls::Walls;
use super::slip::tangent;
use crate::space::embedding::aligned;
use crate::space::mesh::Mesh;
use crate::space::segment::Segment;
use crate::space::shape::SIDE_NODES;

/// A gauge of the force of the materials on a side, a wall or a block.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceGauge {
    /// Name of the gauge.
    pub name: String,
    /// What carries the force: a side, a wall or a block.
    pub on: String,
    /// Its faces along mesh lines, in the plan's units.
    pub faces: Vec<Segment>,
    /// Index of the solid of any shape, if it is one.
    pub solid: Option<usize>,
    /// Nodes, with the components of the force that it carries there.
    pub nodes: Vec<(usize, [bool; 2])>,
    /// The point that the torque refers to, in the plan's units: the middle of its extent.
    pub about: [f64; 2],
}

/// A support of the scene.
struct Support {
    name: String,
    /// Its faces along mesh lines.
    faces: Vec<Segment>,
    /// Range of x and y.
    extent: [[f64; 2]; 2],
}

/// Extent of segments.
fn extent(faces: &[Segment]) -> [[f64; 2]; 2] {
    let start = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    faces.iter().flat_map(Segment::ends).fold(start, |[x, y], p| {
        [[x[0].min(p[0]), x[1].max(p[0])], [y[0].min(p[1]), y[1].max(p[1])]]
    })
}

/// Names of everything that carries forces, in the order in which nodes are assigned.
pub(super) fn names(walls: &Walls) -> Vec<String> {
    let solids = walls.solids.iter().map(|s| s.name.clone());
    let blocks = walls.blocks.iter().map(|b| b.name.clone());
    let lines = walls.walls.iter().map(|w| w.name.clone());
    solids.chain(blocks).chain(lines).chain(SIDES.map(String::from)).collect()
}

/// The gauges of forces `(name, on)`; every `on` is among the [`names`].
///
/// Where supports meet, a node belongs to a solid of any shape before a block, wall or side. At the
/// corner of two sides the component along x belongs to the vertical one, that along y to the other.
pub(super) fn force_gauges(
    wanted: &[(String, String)],
    (walls, boundary): (&Walls, &BoundaryPlan),
    mesh: &Mesh,
    units: &Units,
) -> Vec<ForceGauge> {
    let length = units.length;
    if wanted.is_empty() {
        return vec![];
    }
    let on_mesh = |s: &Segment| s.on_mesh(mesh, length);
    let mut supports: Vec<Support> = walls
        .solids
        .iter()
        .map(|s| Support {
            name: s.name.clone(),
            faces: vec![],
            extent: s.outline.in_units(length).extent(),
        })
        .collect();
    let solids = supports.len();
    let mut add = |name: &str, faces: Vec<Segment>| {
        supports.push(Support { name: name.into(), extent: extent(&faces), faces });
    };
    for b in &walls.blocks {
        let side = |normal: usize, end: usize| {
            let [from, to] = b.range[1 - normal];
            on_mesh(&Segment { normal, at: b.range[normal][end], from, to })
        };
        add(&b.name, vec![side(0, 0), side(0, 1), side(1, 0), side(1, 1)]);
    }
    walls.walls.iter().for_each(|w| add(&w.name, vec![on_mesh(&w.segment)]));
    for (side, name) in boundary.sides.iter().zip(SIDES) {
        add(name, side.pieces.iter().map(|p| p.segment).collect());
    }
    // Thin walls carry what presses on them, also where a solid lies behind them, such as a gate.
    let mut on_wall = vec![[false; 2]; mesh.nodes()];
    for wall in &walls.walls {
        let segment = on_mesh(&wall.segment);
        segment.nodes(mesh).for_each(|node| on_wall[node][segment.normal] = true);
    }
    // The support of each node by component; the first one that claims it.
    let mut owner = vec![[usize::MAX; 2]; mesh.nodes()];
    let given = boundary.constraints::<2>(mesh, units);
    if let (Some(parts), Some(relations)) = (mesh.parts(), given.embedding()) {
        let along_lines = aligned(mesh, parts, |node| relations.holds(node));
        let sites = relations.nodes().chain(along_lines.into_iter().map(|(node, ..)| node));
        for node in sites {
            let behind = |c: usize| on_wall[node][c] && !relations.holds(node);
            if let Some((solid, _)) = parts.nearest(mesh.node_position(node)) {
                let index = supports[..solids].iter().position(|s| s.name == solid.name);
                let index = index.unwrap_or(usize::MAX);
                (0..2).filter(|&c| !behind(c)).for_each(|c| owner[node][c] = index);
            }
        }
    }
    // Nodes that slide along walls bear friction although their velocity is not given.
    let mut slides = vec![[false; 2]; mesh.nodes()];
    for face in boundary.slip_faces(mesh, units) {
        let nodes = mesh.cell_nodes(face.cell);
        SIDE_NODES[face.side].iter().for_each(|&a| slides[nodes[a]][tangent(face.side)] = true);
    }
    // First the normal components, so that those of corners belong to the face they press on.
    for normal_first in [true, false] {
        for (k, support) in supports.iter().enumerate() {
            for face in &support.faces {
                let c = if normal_first { face.normal } else { 1 - face.normal };
                for node in face.nodes(mesh).filter(|&n| given.is_fixed(n, c) || slides[n][c]) {
                    if owner[node][c] == usize::MAX {
                        owner[node][c] = k;
                    }
                }
            }
        }
    }
    let gauge = |(name, on): &(String, String)| {
        let k = supports.iter().position(|s| s.name == *on)?;
        let carries = |node: usize| {
            let of = owner[node].map(|o| o == k);
            (of != [false; 2]).then_some((node, of))
        };
        let about = supports[k].extent.map(|[low, high]| 0.5 * (low + high));
        let nodes = (0..mesh.nodes()).filter_map(carries).collect();
        let (faces, solid) = (supports[k].faces.clone(), (k < solids).then_some(k));
        Some(ForceGauge { name: name.clone(), on: on.clone(), faces, solid, nodes, about })
    };
    wanted.iter().filter_map(gauge).collect()
}
