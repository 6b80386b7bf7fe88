//! This module computes the friction along the outlines of solids that cut through cells.
//!
//! The law is that of [`slip`](super::slip); the integral is over the outline inside of a cell, with the
//! velocity of the cell along the unit tangent `t` there,
//!
//! ```text
//! force on node a, component c:   -integral r (u . t - w) t_c N_a
//! ```
//! The normal velocity on the outline vanishes by the relations of the nodes
//! ([`embedding`](crate::space::embedding)).

use super::Powers;
use super::contact::{Beside, Contact};
use super::slip::AtPoint;
use crate::plan::slip::{SlipPoint, WallLaw};
use crate::solve::element::Matrix;
use crate::space::shape::{NODES, Shape};
use std::ops::Range;

/// Points along outlines at which material slips.
#[derive(Clone, Debug, Default)]
pub struct SlipOutlines {
    /// In ascending order of their cells.
    points: Vec<SlipPoint>,
    shapes: Vec<[f64; NODES]>,
    contacts: Vec<Contact>,
    /// Those of the last matrices, while a correction is applied.
    before: Vec<Contact>,
    /// The cells that have points.
    cells: Vec<usize>,
    friction: bool,
}

impl SlipOutlines {
    /// Points without resistance; it follows from [`SlipOutlines::evaluate`].
    pub fn new(points: Vec<SlipPoint>) -> Self {
        let mut cells: Vec<usize> = points.iter().map(|p| p.cell).collect();
        cells.dedup();
        SlipOutlines {
            shapes: points.iter().map(|p| Shape::values(p.at.r)).collect(),
            contacts: vec![Contact::default(); points.len()],
            before: vec![],
            cells,
            friction: points.iter().any(|p| matches!(p.law, WallLaw::Friction { .. })),
            points,
        }
    }

    /// The points.
    pub fn points(&self) -> &[SlipPoint] {
        &self.points
    }

    /// The cells that have points, in ascending order.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }

    /// Whether an outline has friction, so that its resistance depends on the flow.
    pub fn has_friction(&self) -> bool {
        self.friction
    }

    /// Evaluates the law of a point; `flow`: velocity and pressure there, if a flow is known.
    pub fn evaluate(&mut self, k: usize, beside: &Beside, flow: Option<AtPoint>) {
        let point = &self.points[k];
        let [t, u] = [point.tangent(), flow.map_or([0.0; 2], |(u, _)| u)];
        let slip = u[0] * t[0] + u[1] * t[1] - point.wall;
        self.contacts[k].evaluate(point.law, beside, flow.map(|(_, pressure)| (slip, pressure)));
    }

    /// Takes a share of the change of the viscous normal stress at a point.
    pub fn press(&mut self, k: usize, share: f64, normal: f64) {
        self.contacts[k].press(share, normal);
    }

    /// Gives the frictions the directions of the slip.
    pub fn align(&mut self) {
        self.contacts.iter_mut().for_each(Contact::align);
    }

    /// Keeps the current contacts for [`SlipOutlines::turn`].
    pub fn keep(&mut self) {
        self.before.clone_from(&self.contacts);
    }

    /// Advances the directions after the share `share` of a correction.
    pub fn turn(&mut self, share: f64) {
        for (contact, before) in self.contacts.iter_mut().zip(&self.before) {
            contact.turn(before, share);
        }
    }

    /// The points of a cell.
    fn of(&self, cell: usize) -> Range<usize> {
        let first = self.points.partition_point(|p| p.cell < cell);
        first..first + self.points[first..].iter().take_while(|p| p.cell == cell).count()
    }

    /// Adds the stiffness to the matrix of a cell, in the blocks of components on and below the diagonal.
    pub fn add_stiffness(&self, cell: usize, k: &mut Matrix) {
        for index in self.of(cell) {
            let (t, n) = (self.points[index].tangent(), &self.shapes[index]);
            let resistance = self.points[index].at.area * self.contacts[index].tangent();
            for [c, d] in [[0, 0], [1, 0], [1, 1]] {
                for a in 0..NODES {
                    for b in 0..NODES {
                        k[NODES * c + a][NODES * d + b] += resistance * t[c] * t[d] * n[a] * n[b];
                    }
                }
            }
        }
    }

    /// Forces on the nodes of a cell with the velocities `u`, and their powers.
    pub fn force(&self, cell: usize, u: [[f64; 2]; NODES]) -> ([[f64; 2]; NODES], Powers) {
        let (mut force, mut powers) = ([[0.0; 2]; NODES], Powers::default());
        for index in self.of(cell) {
            let (point, n) = (&self.points[index], &self.shapes[index]);
            let t = point.tangent();
            let along: f64 = (0..NODES).map(|a| n[a] * (u[a][0] * t[0] + u[a][1] * t[1])).sum();
            let slip = along - point.wall;
            let friction = point.at.area * self.contacts[index].resistance * slip;
            for a in 0..NODES {
                force[a][0] -= friction * t[0] * n[a];
                force[a][1] -= friction * t[1] * n[a];
            }
            powers.dissipated += friction * slip;
            powers.supplied -= friction * point.wall;
        }
        (force, powers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::element::LOCAL;
    use crate::space::outline_rule::OutlinePoint;

    #[test]
    fn the_power_taken_is_that_of_the_force_and_the_matrix_is_its_derivative() {
        let points = (0..3).map(|k| {
            let (sin, cos) = (0.7 + 0.2 * f64::from(k)).sin_cos();
            let r = [0.3 * f64::from(k) - 0.4, 0.5 - 0.2 * f64::from(k)];
            let at = OutlinePoint { solid: 0, r, area: 0.3, normal: [cos, sin], along: 0.0 };
            SlipPoint { cell: 4, at, law: WallLaw::Slip { length: 0.3 }, wall: 0.7 }
        });
        let mut slip = SlipOutlines::new(points.collect());
        for k in 0..3 {
            slip.evaluate(k, &Beside { viscosity: 2.0, ..Beside::default() }, None);
        }
        let u = std::array::from_fn(|a| [(a as f64).sin(), (3.0 * a as f64).cos()]);
        let (force, powers) = slip.force(4, u);
        let taken: f64 = force.iter().zip(u).map(|(f, u)| -f[0] * u[0] - f[1] * u[1]).sum();
        let Powers { numerical, dissipated, supplied } = powers;
        assert!((taken - (numerical + dissipated - supplied)).abs() < 1e-14);
        assert!(dissipated > 0.0);
        let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
        slip.add_stiffness(4, &mut k);
        for (a, c) in (0..NODES).flat_map(|a| [(a, 0), (a, 1)]) {
            let mut moved = u;
            moved[a][c] += 1.0;
            let (other, _) = slip.force(4, moved);
            for (b, d) in (0..NODES).flat_map(|b| [(b, 0), (b, 1)]).filter(|&(_, d)| d >= c) {
                let entry = k[NODES * d + b][NODES * c + a];
                assert!((other[b][d] - force[b][d] + entry).abs() < 1e-13);
            }
        }
    }
}
