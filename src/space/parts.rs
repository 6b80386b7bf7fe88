//! This module defines solids of any shape, and the parts of cells that they leave free.

use super::outline::{Obstacle, Outline, Point};
use super::shape::{NODES, Shape};
use super::stream::Stream;
use std::sync::Arc;

/// A solid of any shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Name of its wall or block.
    pub name: String,
    /// Its outline, in the plan's units.
    pub outline: Outline,
    /// Whether the tangential velocity is that of the solid along it too.
    pub no_slip: bool,
    /// Velocity, in the plan's units.
    pub velocity: Point,
    /// Prescribed Cosserat rotation rate on its outline, in the plan's units; `None`: no couple.
    pub rotation: Option<f64>,
}

impl Solid {
    /// A solid at rest.
    pub fn at_rest(name: impl Into<String>, outline: Outline, no_slip: bool) -> Solid {
        Solid { name: name.into(), outline, no_slip, velocity: [0.0; 2], rotation: None }
    }

    /// Whether it moves.
    pub fn moves(&self) -> bool {
        self.velocity != [0.0; 2]
    }
}

/// An integration point of the free part of a cell.
#[derive(Clone, Copy, Debug)]
pub struct PartPoint {
    /// Share of the volume of the part.
    pub weight: f64,
    /// Reference coordinates in the cell.
    pub r: Point,
    /// Shape functions.
    pub shape: Shape,
}

impl PartialEq for PartPoint {
    fn eq(&self, o: &Self) -> bool {
        self.weight == o.weight && self.r == o.r
    }
}

/// The free part of a cell with a solid in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its share of the cell.
    pub fraction: f64,
    /// Its integration points.
    pub points: [PartPoint; 9],
    /// Divergence matrix for `q = 1, xi, eta` without the flow through the outline: the integral of
    /// `q N_a n_c` over the free parts of the sides, less that of `N_a dq/dx_c` over the part.
    pub divergence: [[[f64; NODES]; 2]; 3],
    /// Integral of `q N_a n_c` over the outline, with its normal `n` into the solid: the force of the
    /// pressure on the solid.
    pub outline: [[[f64; NODES]; 2]; 3],
    /// Volume that moving solids take from it per time.
    pub swept: f64,
    /// Velocity of the solid that has most of the outline in it.
    pub velocity: Point,
    /// Neighbours without solids, whose pressure has the slope of this one.
    pub beside: Vec<usize>,
    /// Streamfunction of the velocity in it, where a single wall crosses the cell.
    pub stream: Option<Box<Stream>>,
    /// Whether a solid in the cell is thinner than its nodes can show; the cell is then at rest.
    pub unresolved: bool,
}

/// The solids of any shape in a mesh, and the free parts of its cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// The solids.
    pub solids: Vec<Solid>,
    /// Free part of each cell with a solid in it; empty without solids.
    pub(super) cells: Vec<Option<Box<Part>>>,
}

/// The parts of a mesh, shared by all that integrate over it.
pub type SharedParts = Option<Arc<Parts>>;

impl Parts {
    /// The free part of a cell, if there is a solid in it.
    pub fn of(&self, cell: usize) -> Option<&Part> {
        self.cells.get(cell)?.as_deref()
    }

    /// All parts, with their cells.
    pub fn all(&self) -> impl Iterator<Item = (usize, &Part)> {
        self.cells.iter().enumerate().filter_map(|(cell, part)| Some((cell, part.as_deref()?)))
    }

    /// Outlines of the solids.
    pub fn outlines(&self) -> impl Iterator<Item = &Outline> + Clone {
        self.solids.iter().map(|s| &s.outline)
    }

    /// Outlines with their displacements at two times after that of the outlines.
    pub fn obstacles(&self, times: [f64; 2]) -> impl Iterator<Item = Obstacle<'_>> + Clone {
        self.solids.iter().map(move |s| Obstacle {
            outline: &s.outline,
            displaced: times.map(|t| s.velocity.map(|v| t * v)),
        })
    }

    /// Whether a solid moves.
    pub fn move_on(&self) -> bool {
        self.solids.iter().any(Solid::moves)
    }

    /// Whether a point is inside of a solid.
    pub fn is_solid(&self, p: Point) -> bool {
        self.outlines().any(|o| o.contains(p))
    }

    /// The solid whose outline is nearest to a point, with the signed distance; positive outside of
    /// all.
    pub fn nearest(&self, p: Point) -> Option<(&Solid, f64)> {
        let all = self.solids.iter().map(|s| (s, s.outline.distance(p)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Signed distance from the nearest solid; positive outside of all.
    pub fn distance(&self, p: Point) -> f64 {
        self.nearest(p).map_or(f64::INFINITY, |(_, d)| d)
    }
}
impl Part {
    /// Centroid, in reference coordinates.
    pub fn centroid(&self) -> Point {
        [0, 1].map(|c| self.points.iter().map(|p| p.weight * p.r[c]).sum())
    }
}
