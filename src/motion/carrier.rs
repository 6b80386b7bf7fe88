//! Transport of points through the velocity of the half step: second order in time.

use super::current::{Current, Points, TOGETHER, ways};
use crate::laws::director;
use crate::simd::Simd;
use crate::space::mesh::{INSIDE, Mesh};
use crate::space::walls::{Enclosure, Landing};
use crate::threads;
use nalgebra::Matrix2;

/// Cells that are worth a task of their own.
pub const CELL_GRAIN: usize = 64;

/// A velocity field frozen at the middle of a step, and the walls in it.
pub struct Carrier<'a> {
    pub mesh: &'a Mesh,
    pub enclosure: &'a Enclosure,
    pub dt: f64,
    /// Of every cell, at the middle of the step.
    currents: Vec<Current>,
    simd: Simd,
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
    /// The cell, where it is known to be that of the start.
    pub stays: Option<usize>,
}

/// The cell that points start from.
pub struct Home {
    cell: usize,
    centre: [f64; 2],
    /// Reference coordinates per length.
    per_length: [f64; 2],
}

impl Home {
    pub fn new(mesh: &Mesh, cell: usize) -> Self {
        let per_length = mesh.cell_size(cell).map(|h| 2.0 / h);
        Home { cell, centre: mesh.cell_centre(cell), per_length }
    }

    fn reference(&self, p: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| (p[c] - self.centre[c]) * self.per_length[c])
    }
}

impl<'a> Carrier<'a> {
    /// `velocity`: at the nodes, of the middle of the step.
    pub fn new(mesh: &'a Mesh, enclosure: &'a Enclosure, velocity: &[[f64; 2]], dt: f64) -> Self {
        let mut currents = vec![Current::default(); mesh.cells()];
        threads::for_each(&mut currents, CELL_GRAIN, |cell, current| {
            let nodal = mesh.cell_nodes(cell).map(|n| velocity[n]);
            *current = Current::new(&nodal, mesh.cell_size(cell));
        });
        Carrier { mesh, enclosure, dt, currents, simd: Simd::used() }
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
        let r = home.reference(goal);
        if r[0].abs() < INSIDE && r[1].abs() < INSIDE {
            return (self.currents[home.cell].at(r), (home.cell, r));
        }
        let place = match self.enclosure.follow(mesh, p, goal) {
            Landing::Free(q) | Landing::Held(q) => mesh.wrap(q),
            Landing::Left => p,
        };
        let cell = mesh.locate(place);
        let r = mesh.to_reference(cell, place);
        (self.currents[cell].at(r), (cell, r))
    }

    /// The classical fourth-order Runge-Kutta rule from `p` in its cell. The field is frozen at the
    /// middle of the step, so the order in time is that of the field; the high order in space
    /// keeps the distances of particles: a midpoint rule changes areas by `(dt |grad u|)^4 / 4`
    /// a step, this one by `(dt |grad u|)^6 / 72`.
    pub fn travel(&self, home: &Home, p: [f64; 2]) -> Journey {
        let dt = self.dt;
        let k1 = self.currents[home.cell].at(home.reference(p));
        let (k2, _) = self.stage(home, p, k1, 0.5 * dt);
        let (k3, middle) = self.stage(home, p, k2, 0.5 * dt);
        let (k4, _) = self.stage(home, p, k3, dt);
        let mean = |c: usize| (k1[c] + 2.0 * (k2[c] + k3[c]) + k4[c]) / 6.0;
        let goal = [p[0] + dt * mean(0), p[1] + dt * mean(1)];
        let r = home.reference(goal);
        if r[0].abs() < INSIDE && r[1].abs() < INSIDE {
            let stays = Some(home.cell);
            return Journey { to: goal, left: false, held: false, middle, stays };
        }
        let (to, left, held) = match self.enclosure.follow(self.mesh, p, goal) {
            Landing::Free(q) => (q, false, false),
            Landing::Held(q) => (q, false, true),
            Landing::Left => (goal, true, false),
        };
        Journey { to, left, held, middle, stays: None }
    }

    /// The ways of the points of one cell: those that stay inside it together, the others one by one.
    pub fn travel_all(
        &self,
        cell: usize,
        from: &[[f64; 2]],
        mut arrive: impl FnMut(usize, Journey),
    ) {
        let (home, dt) = (Home::new(self.mesh, cell), self.dt);
        for (at, points) in from.chunks(TOGETHER).enumerate() {
            let mut r: Points = [[0.0; TOGETHER]; 2];
            for (k, p) in points.iter().enumerate() {
                [r[0][k], r[1][k]] = home.reference(*p);
            }
            let step = home.per_length.map(|s| dt * s);
            let ways = ways(self.simd, &self.currents[cell], &r, step);
            for (k, &p) in points.iter().enumerate() {
                let journey = if ways.inside[k] {
                    let to = [0, 1].map(|c| p[c] + dt * ways.velocity[c][k]);
                    let middle = (cell, [ways.middle[0][k], ways.middle[1][k]]);
                    Journey { to, left: false, held: false, middle, stays: Some(cell) }
                } else {
                    self.travel(&home, p)
                };
                arrive(TOGETHER * at + k, journey);
            }
        }
    }

    /// Velocity gradient at the middle of a journey.
    pub fn gradient(&self, (cell, r): (usize, [f64; 2])) -> Matrix2<f64> {
        self.currents[cell].gradient(r, self.mesh.cell_size(cell))
    }

    /// A director after the step under a velocity gradient.
    pub fn turn(&self, n: [f64; 2], l: &Matrix2<f64>) -> [f64; 2] {
        director::advance(&n.into(), l, self.dt).into()
    }
}
