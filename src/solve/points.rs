//! This module defines integration points and the stiffness of cells cut by an interface.

use super::filled::Filled;
use super::laminate::VelocityMatrix;
use super::sides::{Kinked, Sides};
use crate::laws::point::PointLaw;
use crate::space::shape::{GAUSS_3X3, GAUSS_6X6, Shape};

/// Part of the viscosities that cells with a solid of any shape in them have everywhere, inside of
/// the solid too, so that their matrix is definite however little is left of them. Between 1e-8
/// and 1e-4 the flow is the same to four digits.
pub const INSIDE_SOLIDS: f64 = 1e-6;

/// Viscosities of a void in the cells that a material fills in part, relative to those of the material:
/// they determine the velocities of nodes beside slivers. With 1e-6 such nodes are ten times faster; the
/// power of a surface of slope 0.4 is the same to 3e-4 (that of 1e-3 differs by 5e-4).
pub const VOID: f64 = 1e-4;

/// Density of the void in these cells for inertia, not for the weight, relative to that of the material:
/// without it, nodes beside slivers were up to 30 times too fast in long steps.
pub const VOID_MASS: f64 = 1e-3;

/// One integration point of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct IntegrationPoint {
    /// Law at the point.
    pub law: PointLaw,
    /// Density, if particles or fields give the integration points; for the Gauss points of mixed
    /// cells see [`density`](super::density).
    pub density: f64,
    /// Share of the volume of the cell.
    pub weight: f64,
    /// Reference coordinates.
    pub r: [f64; 2],
}

/// Viscous stiffness of a cell cut by an interface.
#[derive(Clone)]
pub struct CutStiffness {
    /// Stiffness matrix on the velocities of the cell's nodes.
    pub matrix: VelocityMatrix,
    /// Fraction of the viscosity that remains at the integration points.
    pub rest: f64,
    /// Line with a separate stiffness and weight of the material on each side; `None` if the cell
    /// is a laminate.
    pub sides: Option<Sides>,
    /// Divergence of the filled part of a cell with a void in it.
    pub filled: Option<Filled>,
}

impl CutStiffness {
    /// Kink of the velocity of the cell, if it has one.
    pub fn kinked(&self) -> Option<&Kinked> {
        self.sides.as_ref()?.kinked.as_ref()
    }
}

/// Points of a cell that share a rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Point of [`GAUSS_3X3`].
    Gauss(u8),
    /// Point of [`GAUSS_6X6`].
    Fine(u8),
    /// Reference coordinates of a point of a cell with a solid in it.
    At([f64; 2]),
}

impl Place {
    /// Reference coordinates of the point.
    pub fn r(self) -> [f64; 2] {
        match self {
            Place::Gauss(g) => GAUSS_3X3[usize::from(g)].r,
            Place::Fine(g) => GAUSS_6X6[usize::from(g)].r,
            Place::At(r) => r,
        }
    }

    /// Shape functions at the point.
    pub fn shape(self) -> Shape {
        match self {
            Place::Gauss(g) => GAUSS_3X3[usize::from(g)].shape,
            Place::Fine(g) => GAUSS_6X6[usize::from(g)].shape,
            Place::At(r) => Shape::at(r),
        }
    }
}
