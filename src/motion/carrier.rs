//! Transport of points through the velocity of the half step: second order in time.

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
    /// End of the step, not wrapped around periodic sides.
    pub to: [f64; 2],
    /// It left the domain through an open side.
    pub left: bool,
    /// A wall held it back.
    pub held: bool,
    /// Cell and reference coordinates of its middle.
    pub middle: (usize, [f64; 2]),
}

/// A cell with its nodal velocities: most journeys stay in it, and touch no wall there.
pub struct Home {
    cell: usize,
    nodal: [[f64; 2]; 9],
}

impl Carrier<'_> {
    pub fn home(&self, cell: usize) -> Home {
        Home { cell, nodal: self.nodal(cell) }
    }

    fn nodal(&self, cell: usize) -> [[f64; 2]; 9] {
        self.mesh.cell_nodes(cell).map(|n| self.velocity[n])
    }

    /// Velocity at a place reached from `p`, walls and periodic sides respected, and where it
    /// is; where the way leaves the domain, that of the start.
    fn stage(
        &self,
        home: &Home,
        p: [f64; 2],
        u: [f64; 2],
        dt: f64,
    ) -> ([f64; 2], (usize, [f64; 2])) {
        let mesh = self.mesh;
        let goal = [p[0] + dt * u[0], p[1] + dt * u[1]];
        let r = mesh.to_reference(home.cell, goal);
        if r[0].abs() < 1.0 && r[1].abs() < 1.0 {
            return (interpolate(&home.nodal, &Shape::values(r)), (home.cell, r));
        }
        let place = match self.enclosure.follow(mesh, p, goal) {
            Landing::Free(q) | Landing::Held(q) => mesh.wrap(q),
            Landing::Left => p,
        };
        let cell = mesh.locate(place);
        let r = mesh.to_reference(cell, place);
        (interpolate(&self.nodal(cell), &Shape::values(r)), (cell, r))
    }

    /// The classical fourth-order Runge-Kutta rule from `p` in its cell. The field is frozen at the
    /// middle of the step, so the order in time is that of the field; the high order in space
    /// keeps the distances of particles: a midpoint rule changes areas by `(dt |grad u|)^4 / 4`
    /// a step, this one by `(dt |grad u|)^6 / 72`.
    pub fn travel(&self, home: &Home, p: [f64; 2]) -> Journey {
        let dt = self.dt;
        let r = self.mesh.to_reference(home.cell, p);
        let k1 = interpolate(&home.nodal, &Shape::values(r));
        let (k2, _) = self.stage(home, p, k1, 0.5 * dt);
        let (k3, middle) = self.stage(home, p, k2, 0.5 * dt);
        let (k4, _) = self.stage(home, p, k3, dt);
        let mean = |c: usize| (k1[c] + 2.0 * (k2[c] + k3[c]) + k4[c]) / 6.0;
        let goal = [p[0] + dt * mean(0), p[1] + dt * mean(1)];
        let r = self.mesh.to_reference(home.cell, goal);
        if r[0].abs() < 1.0 && r[1].abs() < 1.0 {
            return Journey { to: goal, left: false, held: false, middle };
        }
        let (to, left, held) = match self.enclosure.follow(self.mesh, p, goal) {
            Landing::Free(q) => (q, false, false),
            Landing::Held(q) => (q, false, true),
            Landing::Left => (goal, true, false),
        };
        Journey { to, left, held, middle }
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
