//! This module defines integration points and the stiffness of cells cut by an interface.

use super::element::{Matrix, PointShape};
use super::laminate::VelocityMatrix;
use super::sides::{Kinked, Sides};
use crate::laws::Softening;
use crate::laws::point::PointLaw;
use crate::space::measure::CellMeasure;
use crate::space::shape::{GAUSS_3X3, GAUSS_6X6, NODES, Shape};

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
}

impl CutStiffness {
    /// Kink of the velocity of the cell, if it has one.
    pub fn kinked(&self) -> Option<&Kinked> {
        self.sides.as_ref()?.kinked.as_ref()
    }
}

/// Points of a cell that share a rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Point of [`GAUSS_3X3`].
    Gauss(u8),
    /// Point of [`GAUSS_6X6`].
    Fine(u8),
}

impl Place {
    /// Shape functions at the point.
    fn shape(self) -> &'static Shape {
        match self {
            Place::Gauss(g) => &GAUSS_3X3[usize::from(g)].shape,
            Place::Fine(g) => &GAUSS_6X6[usize::from(g)].shape,
        }
    }
}

/// The derivative of the viscosity of a generalised fluid at a point of a cell.
#[derive(Clone, Copy, Debug)]
pub struct SofteningPoint {
    /// The point.
    pub place: Place,
    /// Share of the volume of the cell.
    pub weight: f64,
    /// The derivative of the stress.
    pub softening: Softening,
}

impl SofteningPoint {
    /// Adds `factor e e^T` to the matrix of the cell, in the blocks of components on and below the
    /// diagonal.
    pub fn add_stiffness<const D: usize>(&self, k: &mut Matrix, cell: CellMeasure) {
        let s = PointShape::new(self.place.shape(), cell.size);
        let Softening { factor, direction: e } = &self.softening;
        let factor = factor * cell.of_point(self.weight);
        // The power of the stress `e` with the rates of each unknown.
        let (xx, yy) = (e.mean + e.deviator[0], e.mean - e.deviator[0]);
        let (xy, yx) = (e.deviator[1] - 0.5 * e.skew, e.deviator[1] + 0.5 * e.skew);
        let mut row = [[0.0; NODES]; 3];
        for a in 0..NODES {
            row[0][a] = xx * s.gx[a] + xy * s.gy[a];
            row[1][a] = yx * s.gx[a] + yy * s.gy[a];
            if D == 3 {
                row[2][a] = e.couple[0] * s.gx[a] + e.couple[1] * s.gy[a] - e.skew * s.n[a];
            }
        }
        for c in 0..D {
            for a in 0..NODES {
                let left = factor * row[c][a];
                for (d, right) in row.iter().enumerate().take(c + 1) {
                    for b in 0..NODES {
                        k[NODES * c + a][NODES * d + b] += left * right[b];
                    }
                }
            }
        }
    }
}
