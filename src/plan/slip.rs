//! This module defines walls along which material slips.

use super::{BoundaryPlan, Units};
use crate::scene::FieldFn;
use crate::space::mesh::Mesh;
use crate::space::outline_rule::OutlinePoint;
use crate::space::shape::{SIDE_NODES, side_normal};

/// How a wall resists material that slides along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WallLaw {
    /// Navier's law: traction `(eta/b) u` with the slip length `b`, m.
    Slip {
        /// Slip length, m (SI).
        length: f64,
    },
    /// Coulomb's law: traction up to `mu N` with the normal stress `N`.
    Friction {
        /// Coefficient of friction mu.
        coefficient: f64,
    },
}

/// A wall law with the velocity of the wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Slip {
    /// The law.
    pub law: WallLaw,
    /// Velocity of the wall along itself, m/s, as a function of SI coordinates; zero if absent.
    pub velocity: Option<FieldFn>,
}

/// A face of a cell that slides along a wall, in the plan's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipFace {
    /// The cell.
    pub cell: usize,
    /// Its side: left, right, bottom, top.
    pub side: usize,
    /// Law of the wall; a slip length is in the plan's units.
    pub law: WallLaw,
    /// Velocity of the wall along itself at the three nodes.
    pub wall: [f64; 3],
}

/// A point of the outline of a solid of any shape along which material slips, in the plan's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipPoint {
    /// The cell.
    pub cell: usize,
    /// Its place on the outline.
    pub at: OutlinePoint,
    /// Law of the solid; a slip length is in the plan's units.
    pub law: WallLaw,
    /// Velocity of the solid along the tangent.
    pub wall: f64,
}

impl SlipPoint {
    /// Unit tangent of the outline.
    pub fn tangent(&self) -> [f64; 2] {
        let [x, y] = self.at.normal;
        [-y, x]
    }
}

impl WallLaw {
    /// The law in the plan's units.
    fn scaled(self, units: &Units) -> WallLaw {
        match self {
            WallLaw::Slip { length } => WallLaw::Slip { length: length / units.length },
            law @ WallLaw::Friction { .. } => law,
        }
    }
}

impl BoundaryPlan {
    /// Whether a side, a wall or a block has friction, which depends on the pressure.
    pub fn has_wall_friction(&self) -> bool {
        let rubs = |law: &WallLaw| matches!(law, WallLaw::Friction { .. });
        let sides = self.pieces().filter_map(|(_, piece)| piece.conditions.slip.as_ref());
        let walls = self.walls.iter().filter_map(|w| w.slip.as_ref());
        sides.map(|s| &s.law).chain(walls).chain(self.solids.iter().flatten()).any(rubs)
    }

    /// The points of outlines along which material slips, in ascending order of their cells.
    pub fn slip_points(&self, mesh: &Mesh, units: &Units) -> Vec<SlipPoint> {
        if self.solids.iter().all(Option::is_none) {
            return vec![];
        }
        let of_cell = |cell: usize| {
            mesh.outline_points(cell).into_iter().filter_map(move |at| {
                let law = self.solids[at.solid]?.scaled(units);
                let velocity = mesh.parts()?.solids[at.solid].velocity;
                let mut out = SlipPoint { cell, at, law, wall: 0.0 };
                let t = out.tangent();
                out.wall = velocity[0] * t[0] + velocity[1] * t[1];
                Some(out)
            })
        };
        (0..mesh.cells()).flat_map(of_cell).collect()
    }

    /// The faces that slide along walls, in ascending order of their cells.
    pub fn slip_faces(&self, mesh: &Mesh, units: &Units) -> Vec<SlipFace> {
        let mut out = Vec::new();
        for (side, piece) in self.pieces() {
            let Some(Slip { law, velocity }) = &piece.conditions.slip else { continue };
            let cells = piece.segment.cells_at_side(mesh, side);
            out.extend(cells.filter(|&(_, cell)| !mesh.solid[cell]).map(|(_, cell)| {
                let nodes = mesh.cell_nodes(cell);
                let wall = SIDE_NODES[side].map(|a| {
                    let [x, y] = mesh.node_position(nodes[a]).map(|v| v * units.length);
                    velocity.as_ref().map_or(0.0, |f| f.at(x, y) / units.velocity())
                });
                SlipFace { cell, side, law: law.scaled(units), wall }
            }));
        }
        for line in &self.walls {
            let Some(law) = line.slip else { continue };
            for (cell, side) in line.segment.free_faces(mesh) {
                out.push(SlipFace { cell, side, law: law.scaled(units), wall: [0.0; 3] });
            }
        }
        out.sort_by_key(|f| (f.cell, f.side));
        out
    }
}

/// Component of the velocity along a side.
pub fn tangent(side: usize) -> usize {
    1 - side_normal(side)
}
