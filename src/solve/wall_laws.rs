//! This module evaluates the laws of walls together with those of the materials beside them.

use super::last_flow::LastFlow;
use super::quadrature::Quadrature;
use super::terms::contact::Beside;
use super::terms::slip::SlipFaces;
use super::terms::slip_outline::SlipOutlines;
use crate::composition::EmptyCell;
use crate::plan::material::Material;
use crate::plan::{BoundaryPlan, SlipFace, SlipPoint, Units};
use crate::space::constraints::FixedSides;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_3, side_normal};

/// Largest resistance of a wall to slip, in units of that of a linear material over the size of a
/// cell: where the wall has friction, such a material sticks to it below that slip.
const STICKING: f64 = 1e4;

impl Quadrature {
    /// Declares the sides of each cell on which the velocity is prescribed.
    pub fn bind_walls(&mut self, fixed: impl Fn(usize) -> FixedSides) {
        let sides = self.walls.sides.iter_mut().enumerate();
        sides.for_each(|(cell, sides)| *sides = fixed(cell));
    }

    /// Sets the current gravity, in the plan's units.
    pub fn set_gravity(&mut self, gravity: [f64; 2]) {
        self.walls.gravity = gravity;
    }

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
        self.press(1.0, mesh, flow);
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
            let here = if rubs { pressed(mesh, cell, at.r, flow) } else { None };
            self.slip_outlines.evaluate(k, &beside, here);
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
    pub(super) fn press(&mut self, share: f64, mesh: &Mesh, flow: &dyn LastFlow) {
        self.press_outlines(share, mesh, flow);
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

    /// Takes the viscous normal stresses along outlines from a flow: the mean over the free part of the
    /// cell, and, the smaller it is the more, over the cells beside it.
    fn press_outlines(&mut self, share: f64, mesh: &Mesh, flow: &dyn LastFlow) {
        if !self.slip_outlines.has_friction() {
            return;
        }
        let mut last: Option<(usize, [f64; 3])> = None;
        for k in 0..self.slip_outlines.points().len() {
            let SlipPoint { cell, at, .. } = self.slip_outlines.points()[k];
            let mean = match last {
                Some((known, mean)) if known == cell => mean,
                _ => blended(mesh, cell, |c| Some(self.mean_stress(c, flow))).unwrap_or_default(),
            };
            last = Some((cell, mean));
            let ([x, y], [mean, first, second]) = (at.normal, mean);
            let stress = mean + (x * x - y * y) * first + 2.0 * x * y * second;
            self.slip_outlines.press(k, share, stress);
        }
    }

    /// Mean of the viscous stresses in a cell: the mean stress and the deviator.
    fn mean_stress(&self, cell: usize, flow: &dyn LastFlow) -> [f64; 3] {
        let points = &self.points[self.start[cell] as usize..self.start[cell + 1] as usize];
        let mut sum = [0.0; 3];
        for p in points.iter().filter(|p| p.weight > 0.0) {
            let Some(here) = flow.at(cell, p.r) else { continue };
            let s = p.law.stress(&here.rates, p.weight);
            sum = [sum[0] + s.mean, sum[1] + s.deviator[0], sum[2] + s.deviator[1]];
        }
        sum
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

/// Velocity and pressure of a flow at a point of an outline. The pressure of a sliver hardly acts on the
/// flow and is known the less, the smaller it is: there it is that of the cells beside it, continued.
pub(super) fn pressed(
    mesh: &Mesh,
    cell: usize,
    r: [f64; 2],
    flow: &dyn LastFlow,
) -> Option<([f64; 2], f64)> {
    let (u, _) = flow.beside(cell, r)?;
    let p = mesh.from_reference(cell, r);
    let at = |c: usize| {
        let r = if c == cell { r } else { mesh.to_near_reference(c, p) };
        flow.beside(c, r).map(|(_, pressure)| [pressure])
    };
    blended(mesh, cell, at).map(|[pressure]| (u, pressure))
}

/// A quantity in the free part of a cell, weighted with its share of the cell, and in the cells beside it,
/// with the rest.
fn blended<const N: usize>(
    mesh: &Mesh,
    cell: usize,
    of: impl Fn(usize) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let own = of(cell)?;
    let Some(part) = mesh.part(cell).filter(|part| !part.beside.is_empty()) else {
        return Some(own);
    };
    let mut out = own.map(|v| part.fraction * v);
    for &near in &part.beside {
        let weight = (1.0 - part.fraction) / part.beside.len() as f64;
        out.iter_mut().zip(of(near)?).for_each(|(out, v)| *out += weight * v);
    }
    Some(out)
}
