//! This module evaluates the laws of walls together with those of the materials beside them.

use super::last_flow::LastFlow;
use super::quadrature::Quadrature;
use super::terms::contact::Beside;
use super::terms::slip::SlipFaces;
use super::terms::slip_outline::SlipOutlines;
use crate::composition::EmptyCell;
use crate::plan::material::Material;
use crate::plan::{BoundaryPlan, SlipFace, SlipPoint, Units};
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_3, side_normal};

/// Largest resistance of a wall to slip, in units of that of a linear material over the size of a
/// cell: where the wall has friction, such a material sticks to it below that slip.
const STICKING: f64 = 1e4;

impl Quadrature {
    /// Declares the faces and the points of outlines along which material slips.
    pub fn bind_slip(&mut self, mesh: &Mesh, boundary: &BoundaryPlan, units: &Units) {
        self.slip = SlipFaces::new(mesh, boundary.slip_faces(mesh, units));
        self.slip_outlines = SlipOutlines::new(boundary.slip_points(mesh, units));
        for face in 0..self.slip.len() {
            let cell = self.slip.wall(face).cell;
            let viscosity = self.mean_viscosity[cell];
            self.slip.evaluate(face, &Beside { viscosity, ..Beside::default() }, None);
        }
    }

    /// Walls along which material slips.
    pub fn slip(&self) -> &SlipFaces {
        &self.slip
    }

    /// Outlines along which material slips.
    pub fn slip_outlines(&self) -> &SlipOutlines {
        &self.slip_outlines
    }

    /// Whether a wall has friction, so that its resistance depends on the flow.
    pub fn has_wall_friction(&self) -> bool {
        self.slip.has_friction() || self.slip_outlines.has_friction()
    }

    /// Computes the integration points for the current particles and a flow, and the laws of the walls.
    ///
    /// # Errors
    /// A cell contains no particles.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        version: u32,
        flow: &dyn LastFlow,
    ) -> Result<(), EmptyCell> {
        self.update_cells(mesh, particles, materials, version, flow)?;
        self.press(1.0, flow);
        self.evaluate_walls(mesh, materials, flow);
        Ok(())
    }

    /// Evaluates the laws that depend on the flow again, with another iterate and otherwise the
    /// arguments of the last [`Quadrature::update`].
    pub fn reevaluate(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        flow: &dyn LastFlow,
    ) {
        self.reevaluate_cells(mesh, particles, materials, flow);
        self.evaluate_walls(mesh, materials, flow);
    }

    fn evaluate_walls(&mut self, mesh: &Mesh, materials: &[Material], flow: &dyn LastFlow) {
        for face in 0..self.slip.len() {
            let SlipFace { cell, side, .. } = *self.slip.wall(face);
            let size = mesh.cell_size(cell)[side_normal(side)];
            let beside = self.beside(cell, materials, (self.slip.has_friction(), size));
            let at = GAUSS_3.map(|t| {
                let rubs = self.slip.has_friction();
                rubs.then(|| flow.beside(cell, on_side(side, t, 1.0))).flatten()
            });
            let flow = if let [Some(a), Some(b), Some(c)] = at { Some([a, b, c]) } else { None };
            self.slip.evaluate(face, &beside, flow);
        }
        let rubs = self.slip_outlines.has_friction();
        for k in 0..self.slip_outlines.points().len() {
            let SlipPoint { cell, at, .. } = self.slip_outlines.points()[k];
            let [hx, hy] = mesh.cell_size(cell);
            let size = hx * at.normal[0].abs() + hy * at.normal[1].abs();
            let beside = self.beside(cell, materials, (rubs, size));
            self.slip_outlines.evaluate(k, &beside, flow.beside(cell, at.r).filter(|_| rubs));
        }
    }

    /// What is beside a wall in a cell whose size across the wall is `size`; `rubs`: whether there may be
    /// friction.
    fn beside(&self, cell: usize, materials: &[Material], (rubs, size): (bool, f64)) -> Beside {
        let mut beside = Beside { viscosity: self.mean_viscosity[cell], ..Beside::default() };
        for (m, material) in materials.iter().enumerate().filter(|(_, m)| rubs && !m.background) {
            let share = self.composition.fraction(cell, m);
            let linear = STICKING * material.viscosity;
            let largest = material.law.curve.as_ref().map_or(linear, |c| c.largest);
            beside.largest += share * largest / size;
            beside.share += share;
        }
        beside
    }

    /// Takes the viscous normal stresses at the walls from a flow; `share`: share of their change that
    /// is taken.
    pub(super) fn press(&mut self, share: f64, flow: &dyn LastFlow) {
        self.press_outlines(share, flow);
        if !self.slip.has_friction() {
            return;
        }
        for face in 0..self.slip.len() {
            let SlipFace { cell, side, .. } = *self.slip.wall(face);
            let first = self.start[cell] as usize;
            let points = &self.points[first..self.start[cell + 1] as usize];
            let mut stress = [0.0; 3];
            // Particles as integration points lie anywhere: the normal stress is then the pressure.
            if points.len() == 9 {
                for (k, stress) in stress.iter_mut().enumerate() {
                    let r = on_side(side, GAUSS_3[k], GAUSS_3[2]);
                    let near = if side_normal(side) == 0 {
                        3 * k + 2 * (side % 2)
                    } else {
                        6 * (side % 2) + k
                    };
                    if let Some(here) = flow.at(cell, r) {
                        let s = points[near].law.stress(&here.rates, 1.0);
                        let sign = if side_normal(side) == 0 { 1.0 } else { -1.0 };
                        *stress = s.mean + sign * s.deviator[0];
                    }
                }
            }
            self.slip.press(face, share, stress);
        }
    }

    /// Takes the viscous normal stresses along outlines from a flow, each at the nearest integration point.
    fn press_outlines(&mut self, share: f64, flow: &dyn LastFlow) {
        if !self.slip_outlines.has_friction() {
            return;
        }
        for k in 0..self.slip_outlines.points().len() {
            let SlipPoint { cell, at, .. } = self.slip_outlines.points()[k];
            let points = &self.points[self.start[cell] as usize..self.start[cell + 1] as usize];
            let away = |r: [f64; 2]| (r[0] - at.r[0]).hypot(r[1] - at.r[1]);
            let near = points.iter().filter(|p| p.weight > 0.0);
            let near = near.min_by(|a, b| away(a.r).total_cmp(&away(b.r)));
            let stress = near.and_then(|p| {
                let s = p.law.stress(&flow.at(cell, p.r)?.rates, 1.0);
                let [x, y] = at.normal;
                Some(s.mean + (x * x - y * y) * s.deviator[0] + 2.0 * x * y * s.deviator[1])
            });
            self.slip_outlines.press(k, share, stress.unwrap_or(0.0));
        }
    }

    /// Aligns the directions of stresses and frictions with the rates and the slip.
    pub fn align(&mut self) {
        self.align_cells();
        self.slip.align();
        self.slip_outlines.align();
    }

    /// Keeps the current derivatives for [`Quadrature::turn`]; the laws must be evaluated again before
    /// it.
    pub fn keep_softening(&mut self) {
        self.keep_softening_of_cells();
        self.slip.keep();
        self.slip_outlines.keep();
    }

    /// Advances the directions of stresses and frictions after the share `share` of a correction.
    pub fn turn(&mut self, share: f64) {
        self.turn_cells(share);
        self.slip.turn(share);
        self.slip_outlines.turn(share);
    }
}

/// Reference coordinates of the point at `t` along a side, at the distance `away` from the centre.
fn on_side(side: usize, t: f64, away: f64) -> [f64; 2] {
    let edge = if side.is_multiple_of(2) { -away } else { away };
    if side_normal(side) == 0 { [edge, t] } else { [t, edge] }
}
