//! Integration points, and the stiffness of cells that an interface cuts.

use super::laminate::VelocityMatrix;
use crate::laws::point::PointLaw;

/// One integration point of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct IntegrationPoint {
    /// The law there.
    pub law: PointLaw,
    /// Density, of particles as integration points; Gauss points have theirs from `weight`.
    pub density: f64,
    /// Share of the cell's volume.
    pub weight: f64,
    /// Reference coordinates.
    pub r: [f64; 2],
}

/// Viscous stiffness of a cell cut by an interface.
#[derive(Clone)]
pub struct CutStiffness {
    /// On the velocities of the cell's nodes.
    pub matrix: VelocityMatrix,
    /// Share of the viscosity that the integration points still have.
    pub rest: f64,
}
