//! This module computes the friction at walls along which material slips.
//!
//! ```text
//! traction on the material   t = -(eta/b) (u - w)      (Navier)
//! ```
//! along the wall, with the slip length `b`, the velocity `w` of the wall and the mean viscosity `eta`
//! of the cell at the wall. In a shear flow beside a wall at rest, `u = b du/dn`. C. L. M. H. Navier,
//! "Memoire sur les lois du mouvement des fluides", Mem. Acad. Sci. Inst. France 6 (1823) 389.
//!
//! The integral over a face is exact for biquadratic velocities: three Gauss points.

use super::{CellFace, FaceTerm, Powers};
use crate::plan::slip::{SlipFace, WallLaw, tangent};
use crate::space::mesh::Mesh;
use crate::space::shape::{GAUSS_3_WEIGHTS, VALUES_AT_GAUSS, side_normal};

/// The faces of cells along which material slips.
#[derive(Clone, Debug, Default)]
pub struct SlipFaces {
    faces: Vec<CellFace>,
    /// The same faces with their laws.
    walls: Vec<SlipFace>,
    /// Area of each face.
    area: Vec<f64>,
    /// Force per area and velocity at the three points of each face.
    resistance: Vec<[f64; 3]>,
}

impl SlipFaces {
    /// Faces without resistance; it follows from [`SlipFaces::evaluate`].
    pub fn new(mesh: &Mesh, walls: Vec<SlipFace>) -> Self {
        let faces = walls.iter().map(|w| CellFace { cell: w.cell, side: w.side }).collect();
        let area = walls.iter().map(|w| mesh.face_area(w.cell, side_normal(w.side))).collect();
        let resistance = vec![[0.0; 3]; walls.len()];
        SlipFaces { faces, walls, area, resistance }
    }

    /// Evaluates the laws of the walls with the mean viscosities of the cells.
    pub fn evaluate(&mut self, viscosity: &[f64]) {
        for (wall, resistance) in self.walls.iter().zip(&mut self.resistance) {
            *resistance = match wall.law {
                WallLaw::Slip { length } => [viscosity[wall.cell] / length; 3],
            };
        }
    }
}

impl FaceTerm for SlipFaces {
    fn faces(&self) -> &[CellFace] {
        &self.faces
    }

    fn entry(&self, face: usize, [k, l]: [usize; 2], [c, d]: [usize; 2]) -> f64 {
        let along = tangent(self.faces[face].side);
        if c != along || d != along {
            return 0.0;
        }
        let points = self.resistance[face].iter().zip(GAUSS_3_WEIGHTS).zip(VALUES_AT_GAUSS);
        self.area[face] * points.map(|((r, weight), n)| r * weight * n[k] * n[l]).sum::<f64>()
    }

    fn force(&self, face: usize, _nodes: [usize; 3], u: [[f64; 2]; 3]) -> ([[f64; 2]; 3], Powers) {
        let along = tangent(self.faces[face].side);
        let wall = &self.walls[face].wall;
        let (mut force, mut powers) = ([[0.0; 2]; 3], Powers::default());
        let points = self.resistance[face].iter().zip(GAUSS_3_WEIGHTS).zip(VALUES_AT_GAUSS);
        for ((resistance, weight), n) in points {
            let at = |values: [f64; 3]| -> f64 { n.iter().zip(values).map(|(n, v)| n * v).sum() };
            let [moving, slip] = [at(*wall), at(u.map(|u| u[along])) - at(*wall)];
            let friction = self.area[face] * weight * resistance * slip;
            for (force, n) in force.iter_mut().zip(n) {
                force[along] -= friction * n;
            }
            powers.dissipated += friction * slip;
            powers.supplied -= friction * moving;
        }
        (force, powers)
    }

    fn drive(&self, face: usize) -> [[f64; 2]; 3] {
        self.force(face, [0; 3], [[0.0; 2]; 3]).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::mesh::Axis;

    #[test]
    fn the_power_taken_is_that_of_the_force_and_the_matrix_is_its_derivative() {
        let axis = |n: usize| Axis::new((0..=n).map(|k| k as f64 * 0.7).collect(), false);
        let mesh = Mesh::new(axis(2), axis(3));
        let law = WallLaw::Slip { length: 0.3 };
        for (cell, side) in [(0, 0), (1, 1), (0, 2), (5, 3)] {
            let wall = [0.2, -0.4, 1.1];
            let mut slip = SlipFaces::new(&mesh, vec![SlipFace { cell, side, law, wall }]);
            slip.evaluate(&[2.0; 6]);
            let u = [[0.3, 0.9], [-0.2, 0.5], [0.7, -0.1]];
            let (force, powers) = slip.force(0, [0; 3], u);
            let taken: f64 = (0..3).map(|k| -force[k][0] * u[k][0] - force[k][1] * u[k][1]).sum();
            let Powers { numerical, dissipated, supplied } = powers;
            assert!((taken - (numerical + dissipated - supplied)).abs() < 1e-14);
            assert!(dissipated > 0.0);
            for (k, c) in (0..3).flat_map(|k| [(k, 0), (k, 1)]) {
                let mut moved = u;
                moved[k][c] += 1.0;
                let (other, _) = slip.force(0, [0; 3], moved);
                for (l, d) in (0..3).flat_map(|l| [(l, 0), (l, 1)]) {
                    let entry = slip.entry(0, [l, k], [d, c]);
                    assert!((other[l][d] - force[l][d] + entry).abs() < 1e-13);
                }
            }
            // A uniform slip meets eta/b times the area.
            let uniform = slip.force(0, [0; 3], [[5.0; 2]; 3]).0;
            let still = slip.force(0, [0; 3], [[4.0; 2]; 3]).0;
            let sum: f64 =
                (0..3).map(|k| still[k][tangent(side)] - uniform[k][tangent(side)]).sum();
            assert!((sum - 2.0 / 0.3 * 0.7).abs() < 1e-12);
        }
    }
}
