//! This module computes the stress of the materials on walls.
//!
//! ```text
//! t = sigma n,   sigma_xx, sigma_yy = -p + s_m +- s_1,   sigma_xy, sigma_yx = s_2 -+ s_k/2
//! ```
//! Traction `t` on a wall with the unit normal `n` into the material: the pressure `p`, and of the viscous
//! stresses their mean `s_m`, the deviator `s_1 = (s_xx - s_yy)/2, s_2` and the skew part
//! `s_k = sigma_yx - sigma_xy`. The law is that at the nearest integration point, the rates are those on
//! the wall.

use super::last_flow::LastFlow;
use super::quadrature::Quadrature;
use super::wall_laws::pressed;
use crate::space::mesh::Mesh;

impl Quadrature {
    /// Traction of the material in a cell on a wall at the reference coordinates `r`, whose unit normal
    /// into the material is `n`. `known`: whether the flow determines the pressure of the cell; where it
    /// does not, the pressure is that of the cells beside it, continued.
    pub fn traction(
        &self,
        mesh: &Mesh,
        (cell, r): (usize, [f64; 2]),
        n: [f64; 2],
        (flow, known): (&dyn LastFlow, bool),
    ) -> Option<[f64; 2]> {
        let pressure = match mesh.part(cell).filter(|part| !known && !part.beside.is_empty()) {
            Some(part) => {
                let p = mesh.from_reference(cell, r);
                let at = |&c: &usize| flow.beside(c, mesh.to_near_reference(c, p));
                let sum: Option<f64> = part.beside.iter().map(|c| Some(at(c)?.1)).sum();
                sum? / part.beside.len() as f64
            }
            None => pressed(mesh, cell, r, flow)?.1,
        };
        let points = &self.points[self.start[cell] as usize..self.start[cell + 1] as usize];
        let away = |p: [f64; 2]| (r[0] - p[0]).hypot(r[1] - p[1]);
        let near = points.iter().filter(|p| p.weight > 0.0);
        let near = near.min_by(|a, b| away(a.r).total_cmp(&away(b.r)))?;
        let s = near.law.stress(&flow.at(cell, r)?.rates, 1.0);
        let mean = s.mean - pressure;
        let ([first, second], half) = (s.deviator, 0.5 * s.skew);
        Some([
            (mean + first) * n[0] + (second - half) * n[1],
            (second + half) * n[0] + (mean - first) * n[1],
        ])
    }
}
