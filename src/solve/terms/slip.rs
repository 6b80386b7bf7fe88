//! This module computes the friction at walls along which material slips.
//!
//! ```text
//! Navier   t = -(eta/b) s                         s = u - w
//! Coulomb  t = -mu N s/|s|  where it slides,  |t| <= mu N where it sticks
//!          N = max(0, p - tau_nn)
//! ```
//! along the wall, with the velocity `w` of the wall, the slip length `b`, the mean viscosity `eta` of the
//! cell, the coefficient of friction `mu`, and the normal stress `N` on the wall, from the pressure `p` and
//! the viscous normal stress `tau_nn` at the nearest integration point. In a shear flow beside a wall at
//! rest, Navier's law is `u = b du/dn`. C. L. M. H. Navier, "Memoire sur les lois du mouvement des fluides",
//! Mem. Acad. Sci. Inst. France 6 (1823) 389.
//!
//! As the viscosity of a material that yields, the resistance of a wall with friction is bounded: by the
//! largest viscosity over the size of the cell, `r_max`. At fixed `N` the friction is
//!
//! ```text
//! t = -r s,   r = mu N/m,   m = max(|s|, mu N/r_max)
//! ```
//! the derivative of a convex function of the slip. Its direction `q`, which is `s/m` at the solution, is an
//! unknown of its own, as those of the stresses in [`softening`](crate::solve::softening): the matrix has
//! `r (1 - x q s/|s|)` with `x = 1` where the material slides and 0 elsewhere.
//!
//! The integral over a face is exact for biquadratic velocities: three Gauss points.

use super::contact::{Beside, Contact};
use super::{CellFace, FaceTerm, Powers};
use crate::plan::slip::{SlipFace, WallLaw, tangent};
use crate::space::measure::FaceMeasure;
use crate::space::mesh::Mesh;
use crate::space::shape::{GAUSS_3, GAUSS_3_WEIGHTS, VALUES_AT_GAUSS};

/// Number of points of a face.
const POINTS: usize = 3;

/// Velocity and pressure at a point.
pub type AtPoint = ([f64; 2], f64);

/// The faces of cells along which material slips.
#[derive(Clone, Debug, Default)]
pub struct SlipFaces {
    faces: Vec<CellFace>,
    /// The same faces with their laws.
    walls: Vec<SlipFace>,
    /// Measure of each face.
    area: Vec<FaceMeasure>,
    contacts: Vec<[Contact; POINTS]>,
    /// Those of the last matrices, while a correction is applied.
    before: Vec<[Contact; POINTS]>,
    /// Whether a wall has friction.
    friction: bool,
}

impl SlipFaces {
    /// Faces without resistance; it follows from [`SlipFaces::evaluate`].
    pub fn new(mesh: &Mesh, walls: Vec<SlipFace>) -> Self {
        let faces = walls.iter().map(|w| CellFace { cell: w.cell, side: w.side }).collect();
        let area = walls.iter().map(|w| mesh.face(w.cell, w.side)).collect();
        let contacts = vec![[Contact::default(); POINTS]; walls.len()];
        let friction = walls.iter().any(|w| matches!(w.law, WallLaw::Friction { .. }));
        SlipFaces { faces, walls, area, contacts, before: vec![], friction }
    }

    /// Weights of the points of a face.
    fn weights(&self, face: usize) -> [f64; POINTS] {
        let area = &self.area[face];
        std::array::from_fn(|k| GAUSS_3_WEIGHTS[k] * area.thickness(GAUSS_3[k]))
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.walls.len()
    }

    /// A face.
    pub fn wall(&self, face: usize) -> &SlipFace {
        &self.walls[face]
    }

    /// Normal stresses on the wall at the points of a face with friction.
    pub fn normal_stresses(&self, face: usize) -> [f64; POINTS] {
        self.contacts[face].map(|c| c.pressing)
    }

    /// Whether a wall has friction, so that its resistance depends on the flow.
    pub fn has_friction(&self) -> bool {
        self.friction
    }

    /// Evaluates the law of a face; `flow`: velocity and pressure at its points, if a flow is known.
    pub fn evaluate(&mut self, face: usize, beside: &Beside, flow: Option<[AtPoint; POINTS]>) {
        let wall = &self.walls[face];
        let along = tangent(wall.side);
        for (k, contact) in self.contacts[face].iter_mut().enumerate() {
            let here = flow.map(|flow| {
                let (u, pressure) = flow[k];
                let moving = VALUES_AT_GAUSS[k].iter().zip(wall.wall).map(|(n, w)| n * w);
                (u[along] - moving.sum::<f64>(), pressure)
            });
            contact.evaluate(wall.law, beside, here);
        }
    }

    /// Takes a share of the change of the viscous normal stresses at the points of a face.
    pub fn press(&mut self, face: usize, share: f64, normal: [f64; POINTS]) {
        for (contact, normal) in self.contacts[face].iter_mut().zip(normal) {
            contact.press(share, normal);
        }
    }

    /// Gives the frictions the directions of the slip.
    pub fn align(&mut self) {
        self.contacts.as_flattened_mut().iter_mut().for_each(Contact::align);
    }

    /// Keeps the current contacts for [`SlipFaces::turn`].
    pub fn keep(&mut self) {
        self.before.clone_from(&self.contacts);
    }

    /// Advances the directions after the share `share` of a correction.
    pub fn turn(&mut self, share: f64) {
        let now = self.contacts.as_flattened_mut().iter_mut();
        for (contact, before) in now.zip(self.before.as_flattened()) {
            contact.turn(before, share);
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
        let points = self.contacts[face].iter().zip(self.weights(face)).zip(VALUES_AT_GAUSS);
        let sum: f64 = points.map(|((c, weight), n)| c.tangent() * weight * n[k] * n[l]).sum();
        self.area[face].area * sum
    }

    fn force(&self, face: usize, _nodes: [usize; 3], u: [[f64; 2]; 3]) -> ([[f64; 2]; 3], Powers) {
        let along = tangent(self.faces[face].side);
        let wall = &self.walls[face].wall;
        let (mut force, mut powers) = ([[0.0; 2]; 3], Powers::default());
        let points = self.contacts[face].iter().zip(self.weights(face)).zip(VALUES_AT_GAUSS);
        for ((contact, weight), n) in points {
            let at = |values: [f64; 3]| -> f64 { n.iter().zip(values).map(|(n, v)| n * v).sum() };
            let [moving, slip] = [at(*wall), at(u.map(|u| u[along])) - at(*wall)];
            let friction = self.area[face].area * weight * contact.resistance * slip;
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
            slip.evaluate(0, &Beside { viscosity: 2.0, ..Beside::default() }, None);
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

    /// At fixed normal stress the friction is the derivative of a convex function of the slip: it rises
    /// to `mu N` and stays there.
    #[test]
    fn friction_sticks_below_its_strength_and_slides_at_it() {
        let axis = || Axis::new(vec![0.0, 1.0], false);
        let mesh = Mesh::new(axis(), axis());
        let law = WallLaw::Friction { coefficient: 0.4 };
        let wall = SlipFace { cell: 0, side: 2, law, wall: [0.5; 3] };
        let mut slip = SlipFaces::new(&mesh, vec![wall]);
        slip.press(0, 1.0, [-1.0; 3]);
        let mut friction = |u: f64, pressure: f64| {
            let flow = Some([([u, 0.0], pressure); 3]);
            let beside = Beside { viscosity: 1.0, largest: 100.0, share: 1.0 };
            slip.evaluate(0, &beside, flow);
            slip.align();
            let force: f64 = slip.force(0, [0; 3], [[u, 0.0]; 3]).0.iter().map(|f| f[0]).sum();
            (force, slip.entry(0, [1, 1], [0, 0]))
        };
        // N = 1.5 + 1, so that it sticks up to a slip of 0.01.
        let (force, stick) = friction(0.505, 1.5);
        assert!((force + 0.5).abs() < 1e-12, "{force}");
        let (force, slide) = friction(0.7, 1.5);
        assert!((force + 1.0).abs() < 1e-12, "{force}");
        assert!(slide < 1e-3 * stick, "{slide} {stick}");
        let (force, _) = friction(-3.0, 1.5);
        assert!((force - 1.0).abs() < 1e-12, "{force}");
        // Nothing pulls the material onto the wall.
        assert_eq!(friction(2.0, -1.5).0, 0.0);
    }
}
