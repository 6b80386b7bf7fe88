//! This module finds the momentum that the material at a point had in the last two steps.
//!
//! The points of the weight are traced back along the flow through the last two steps, and the
//! velocities `u_1` and `u_2` there are those of the solutions at these times (semi-Lagrangian). In
//!
//! ```text
//! rho du/dt = rho (a_0 u - a_1 u_1 + a_2 u_2)/dt,   r = dt/dt_before
//! a_0 = (1 + 2 r)/(1 + r),   a_1 = 1 + r,   a_2 = r^2/(1 + r)
//! ```
//! (backward differentiation of second order on steps of different lengths) the flow at the end of
//! a step balances the forces there, so stiff material is damped as it should be. The first step
//! takes the mean of the accelerations at its ends, `rho (2 u - 2 u_1 - dt du_1/dt)/dt`. After a
//! sudden change of the materials, a step is of first order, `rho (u - u_1)/dt`. The velocities are
//! biquadratic and are tested against the shape functions, which is third order in space, and no
//! particle carries momentum: splits, merges and refills cannot change it. O. Pironneau, "On the
//! transport-diffusion algorithm", Numer. Math. 38 (1982) 309.

use crate::motion::frozen_flow::{CellVelocities, Displacement, FrozenFlow};
use crate::plan::Plan;
use crate::solve::density::Density;
use crate::solve::terms::inertia::{Inertia as Term, Mass};
use crate::space::flow::{Flow, interpolate};
use crate::space::mesh::Mesh;
use crate::space::shape::{NODES, SUBPOINTS, Shape};
use crate::threads;

/// Largest number of cells per task.
const GRAIN: usize = 16;

/// A step: the velocity at its start and at its middle, and its length.
#[derive(Clone, Debug, Default)]
pub struct Past {
    /// Nodal velocities at the start.
    pub velocity: Vec<[f64; 2]>,
    /// Nodal velocities at the middle.
    pub half: Vec<[f64; 2]>,
    /// Length of the step, in the plan's units.
    pub dt: f64,
    /// Number of equal parts in which points were advected.
    pub parts: u32,
}

/// The steps from which the inertial force follows.
pub struct Inertia {
    /// Corrected velocities of the last two steps, backwards in time.
    backwards: [CellVelocities; 2],
    /// The last step, and the one before it.
    pub past: [Option<Past>; 2],
    /// Accelerations of the material at the nodes, at the start of the first step; `None` later.
    pub acceleration: Option<Vec<[f64; 2]>>,
    /// Contributions of the cells.
    cells: Vec<Cell>,
    /// Density in units of the inertial density.
    pub density: f64,
}

/// Mass matrix and load of a cell.
#[derive(Clone, Copy)]
struct Cell {
    mass: Mass,
    load: [[f64; 2]; NODES],
}

impl Inertia {
    /// No past step; the velocity before the first one is zero.
    pub fn new(plan: &Plan) -> Self {
        let mesh = &plan.mesh;
        let backwards = [0, 1].map(|_| CellVelocities::new(mesh, &plan.enclosure, false));
        let empty = Cell { mass: [[0.0; NODES]; NODES], load: [[0.0; 2]; NODES] };
        Inertia {
            backwards,
            past: [None, None],
            acceleration: None,
            cells: vec![empty; mesh.cells()],
            density: plan.units.density / plan.units.inertial_density(),
        }
    }

    /// Enters a step from a flow with the nodal velocities `past.velocity`.
    pub fn enter(&mut self, past: Past) {
        let [last, before] = &mut self.past;
        *before = last.replace(past);
        if before.is_some() {
            self.acceleration = None;
        }
    }

    /// Ends the step to the first flow, whose nodal velocities are `velocity`: it determines the
    /// accelerations if they are `regular`.
    pub fn begin(&mut self, plan: &Plan, regular: bool, velocity: impl Fn(usize) -> [f64; 2]) {
        let [last, before] = &mut self.past;
        *before = None;
        let Some(impulse) = last.take().filter(|_| regular) else { return };
        let mesh = &*plan.mesh;
        let back = reversed(plan, &mut self.backwards[0], &impulse);
        let acceleration = (0..mesh.nodes()).map(|node| {
            let at = mesh.wrap(mesh.node_position(node));
            let from = trace(&back, impulse.parts, (mesh.locate(at), at));
            let (now, then) = (velocity(node), interpolated(mesh, &impulse.velocity, from));
            [0, 1].map(|c| (now[c] - then[c]) / impulse.dt)
        });
        self.acceleration = Some(acceleration.collect());
    }

    /// Computes the mass matrices and the load for a solution at the end of the last step.
    pub fn update(
        &mut self,
        plan: &Plan,
        density: &Density,
        term: &mut Term,
        load: &mut Vec<[f64; 2]>,
    ) {
        let mesh = &*plan.mesh;
        let Inertia { backwards, past: [last, before], acceleration, cells, density: unit } = self;
        let Some(last) = last.as_ref() else { return };
        let ratio = before.as_ref().map(|b| last.dt / b.dt);
        let [a0, a1, a2] = match (ratio, &acceleration) {
            (Some(r), _) => [(1.0 + 2.0 * r) / (1.0 + r), 1.0 + r, r * r / (1.0 + r)],
            (None, Some(_)) => [2.0, 2.0, 0.0],
            (None, None) => [1.0, 1.0, 0.0],
        };
        let acceleration = acceleration.as_deref();
        let [first, second] = backwards;
        let last_flow = reversed(plan, first, last);
        let before_flow = before.as_ref().map(|b| (b, reversed(plan, second, b)));
        threads::for_each(cells, GRAIN, |cell, out| {
            *out = Cell { mass: [[0.0; NODES]; NODES], load: [[0.0; 2]; NODES] };
            if mesh.solid[cell] {
                return;
            }
            let volume = mesh.cell_volume(cell);
            let (mut from, mut count) = ([[0.0; 2]; SUBPOINTS], 0);
            density.for_fine_points(cell, |point| {
                from[count] = mesh.from_reference(cell, point.r);
                count += 1;
            });
            let mut origins = from.map(|at| (cell, at));
            last_flow.travel_all(cell, &from[..count], |q, way| origins[q] = end(mesh, &way));
            let mut origins = origins.into_iter();
            density.for_fine_points(cell, |point| {
                let Some(mut one) = origins.next() else { return };
                if last.parts > 1 {
                    one = trace(&last_flow, last.parts - 1, one);
                }
                let mut carried = interpolated(mesh, &last.velocity, one).map(|u| a1 * u);
                if let Some(acceleration) = acceleration {
                    let a = interpolated(mesh, acceleration, one);
                    carried = [carried[0] + last.dt * a[0], carried[1] + last.dt * a[1]];
                }
                if let Some((before, flow)) = &before_flow {
                    let two = trace(flow, before.parts, one);
                    let u = interpolated(mesh, &before.velocity, two);
                    carried = [carried[0] - a2 * u[0], carried[1] - a2 * u[1]];
                }
                let mass = *unit * volume * point.mass;
                for a in 0..NODES {
                    let share = mass * point.n[a];
                    out.load[a][0] += share * carried[0] / last.dt;
                    out.load[a][1] += share * carried[1] / last.dt;
                    for b in 0..NODES {
                        out.mass[a][b] += share * point.n[b];
                    }
                }
            });
        });
        term.rate = a0 / last.dt;
        term.mass.clear();
        term.mass.extend(cells.iter().map(|c| c.mass));
        load.clear();
        load.resize(mesh.nodes(), [0.0; 2]);
        for (cell, Cell { load: of_cell, .. }) in cells.iter().enumerate() {
            for (node, f) in mesh.cell_nodes(cell).into_iter().zip(of_cell) {
                load[node][0] += f[0];
                load[node][1] += f[1];
            }
        }
    }
}

/// The flow of a part of a step, backwards in time.
fn reversed<'a>(plan: &'a Plan, room: &'a mut CellVelocities, step: &Past) -> FrozenFlow<'a> {
    let back: Vec<[f64; 2]> = step.half.iter().map(|u| [-u[0], -u[1]]).collect();
    let part = step.dt / f64::from(step.parts);
    FrozenFlow::new(&plan.mesh, &plan.enclosure, room, &back, &|_, _| None, part)
}

/// The cell and the position to which a flow carries a point in a number of parts.
fn trace(flow: &FrozenFlow, parts: u32, mut point: (usize, [f64; 2])) -> (usize, [f64; 2]) {
    for _ in 0..parts {
        point = end(flow.mesh, &flow.travel(&flow.home(point.0), point.1));
    }
    point
}

/// The cell and the position at the end of a path. A path that leaves the domain ends at its side.
fn end(mesh: &Mesh, way: &Displacement) -> (usize, [f64; 2]) {
    if way.left {
        let at = mesh.wrap(mesh.nearest_inside(way.to));
        return (mesh.locate(at), at);
    }
    let at = mesh.wrap(way.to);
    (way.cell.unwrap_or_else(|| mesh.locate(at)), at)
}

/// Nodal values interpolated at a point of a cell.
pub fn interpolated(mesh: &Mesh, nodal: &[[f64; 2]], (cell, at): (usize, [f64; 2])) -> [f64; 2] {
    let r = mesh.to_reference(cell, at).map(|r| r.clamp(-1.0, 1.0));
    interpolate(&mesh.cell_nodes(cell).map(|n| nodal[n]), &Shape::values(r))
}

/// Twice the kinetic energy, `integral rho u . u`; zero without inertia.
pub fn twice_kinetic<const D: usize>(mesh: &Mesh, term: &Term, flow: &Flow<D>) -> f64 {
    if term.mass.is_empty() {
        return 0.0;
    }
    let [sum] = threads::sum(0..mesh.cells(), |cell| {
        if mesh.solid[cell] {
            return [0.0];
        }
        [term.square(cell, &flow.of_cell(mesh, cell).map(|u| [u[0], u[1]]))]
    });
    sum
}
