//! This module gives access to the data that the evaluation of a cell fills: integration points,
//! stiffness of a cut, means and volume fractions.

use super::points::{CutStiffness, IntegrationPoint, Place};
use super::softening::SofteningPoint;
use crate::laws::Softening;
use crate::threads::Divisible;

/// Mutable data of consecutive cells.
pub struct CellsMut<'a> {
    /// Number of materials.
    pub materials: usize,
    /// Integration points, nine per cell.
    pub points: &'a mut [IntegrationPoint],
    /// Stiffness of each cut cell.
    pub cut: &'a mut [Option<Box<CutStiffness>>],
    /// Mean viscosity of each cell.
    pub mean_viscosity: &'a mut [f64],
    /// Mean inverse bulk viscosity of each cell.
    pub compliance: &'a mut [f64],
    /// Volume fractions, by cell and material.
    pub fractions: &'a mut [f64],
    /// Derivatives of the viscosities, by cell; empty if no law depends on the flow.
    pub softening: &'a mut [Vec<SofteningPoint>],
}

/// Mutable data of one cell.
pub struct CellMut<'a> {
    /// Integration points.
    pub points: &'a mut [IntegrationPoint],
    /// Stiffness of the cut, if the cell is cut.
    pub cut: &'a mut Option<Box<CutStiffness>>,
    /// Mean viscosity.
    pub mean_viscosity: &'a mut f64,
    /// Mean inverse bulk viscosity.
    pub compliance: &'a mut f64,
    /// Volume fraction of each material.
    pub fractions: &'a mut [f64],
    /// Derivatives of the viscosities; `None` if no law depends on the flow.
    pub softening: Option<&'a mut Vec<SofteningPoint>>,
}

impl CellMut<'_> {
    /// Adds the derivative of the viscosity of a material at a point, if there is one.
    pub fn soften(&mut self, place: Place, weight: f64, softening: Option<Softening>) {
        if let (Some(list), Some(softening)) = (&mut self.softening, softening) {
            list.push(SofteningPoint { place, weight, softening });
        }
    }
}

impl Divisible for CellsMut<'_> {
    fn cut(self, at: usize) -> (Self, Self) {
        let materials = self.materials;
        let (p0, p1) = self.points.split_at_mut(9 * at);
        let (k0, k1) = self.cut.split_at_mut(at);
        let (v0, v1) = self.mean_viscosity.split_at_mut(at);
        let (c0, c1) = self.compliance.split_at_mut(at);
        let (f0, f1) = self.fractions.split_at_mut(materials * at);
        let at = at.min(self.softening.len());
        let (s0, s1) = self.softening.split_at_mut(at);
        let part = |points, cut, mean_viscosity, compliance, fractions, softening| CellsMut {
            materials,
            points,
            cut,
            mean_viscosity,
            compliance,
            fractions,
            softening,
        };
        (part(p0, k0, v0, c0, f0, s0), part(p1, k1, v1, c1, f1, s1))
    }
}

impl CellsMut<'_> {
    /// Data of the `k`th of these cells.
    pub fn cell(&mut self, k: usize) -> CellMut<'_> {
        CellMut {
            points: &mut self.points[9 * k..9 * k + 9],
            cut: &mut self.cut[k],
            mean_viscosity: &mut self.mean_viscosity[k],
            compliance: &mut self.compliance[k],
            fractions: &mut self.fractions[k * self.materials..][..self.materials],
            softening: self.softening.get_mut(k),
        }
    }
}
