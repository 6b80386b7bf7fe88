//! Second-order transport of points through the velocity of the half step.

use crate::laws::director;
use crate::space::flow::{gradient, interpolate};
use crate::space::mesh::Mesh;
use crate::space::shape::Shape;
use crate::space::walls::{Enclosure, Landing};
use nalgebra::Matrix2;

/// A velocity field frozen at the middle of a step, and the walls in it.
pub struct Carrier<'a> {
    pub mesh: &'a Mesh,
    pub enclosure: &'a Enclosure,
    /// Velocity at the nodes, of the middle of the step.
    pub velocity: &'a [[f64; 2]],
    pub dt: f64,
}

/// Where a point goes in a step.
pub struct Journey {
    /// End of the step, not wrapped around periodic sides; `None` if it left the domain.
    pub to: Option<[f64; 2]>,
    /// A wall held it back.
    pub held: bool,
    /// Cell and reference coordinates of its middle.
    pub middle: (usize, [f64; 2]),
}

impl Carrier<'_> {
    fn nodal(&self, cell: usize) -> [[f64; 2]; 9] {
        self.mesh.cell_nodes(cell).map(|n| self.velocity[n])
    }

    /// Explicit midpoint rule from `p` in `cell`.
    pub fn travel(&self, cell: usize, p: [f64; 2]) -> Journey {
        let (mesh, dt) = (self.mesh, self.dt);
        let u = interpolate(&self.nodal(cell), &Shape::values(mesh.to_reference(cell, p)));
        let half = [p[0] + 0.5 * dt * u[0], p[1] + 0.5 * dt * u[1]];
        let middle = match self.enclosure.follow(mesh, p, half) {
            Landing::Free(q) | Landing::Held(q) => mesh.wrap(q),
            // It will leave; its velocity on the way out is the one it has here.
            Landing::Left => p,
        };
        let middle_cell = mesh.locate(middle);
        let r = mesh.to_reference(middle_cell, middle);
        let u = interpolate(&self.nodal(middle_cell), &Shape::values(r));
        let to = [p[0] + dt * u[0], p[1] + dt * u[1]];
        let (to, held) = match self.enclosure.follow(mesh, p, to) {
            Landing::Free(q) => (Some(q), false),
            Landing::Held(q) => (Some(q), true),
            Landing::Left => (None, false),
        };
        Journey { to, held, middle: (middle_cell, r) }
    }

    /// Velocity gradient at the middle of a journey.
    pub fn gradient(&self, (cell, r): (usize, [f64; 2])) -> Matrix2<f64> {
        gradient(&self.nodal(cell), &Shape::at(r), self.mesh.cell_size(cell))
    }

    /// A director after the step under a velocity gradient.
    pub fn turn(&self, n: [f64; 2], l: &Matrix2<f64>) -> [f64; 2] {
        director::advance(&n.into(), l, self.dt).into()
    }
}
