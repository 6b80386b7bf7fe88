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
//! transport-diffusion algorithm", Numer. Math. 38 (1982) 309. Where a material has a micro-inertia, its
//! rotation is traced in the same way.

use crate::motion::frozen_flow::{CellVelocities, Displacement, FrozenFlow};
use crate::plan::Plan;
use crate::plan::material::Material;
use crate::solve::density::Density;
use crate::solve::points::VOID_MASS;
use crate::solve::quadrature::Quadrature;
use crate::solve::terms::inertia::{Inertia as Term, Mass};
use crate::space::flow::{Flow, gradient, interpolate};
use crate::space::mesh::Mesh;
use crate::space::neighbours::Neighbours;
use crate::space::particles::Particles;
use crate::space::shape::{NODES, SUBPOINTS, Shape};
use crate::threads;

/// Largest number of cells per task.
const GRAIN: usize = 16;

/// A step: the velocity at its start and at its middle, and its length.
#[derive(Clone, Debug, Default)]
pub struct Past {
    /// Nodal velocities at the start.
    pub velocity: Vec<[f64; 2]>,
    /// Nodal rotations at the start; empty if they have no inertia.
    pub rotation: Vec<[f64; 1]>,
    /// Nodal velocities at the middle.
    pub half: Vec<[f64; 2]>,
    /// Length of the step, in the plan's units.
    pub dt: f64,
    /// Number of equal parts in which points were advected.
    pub parts: u32,
}

/// Accelerations of the material at the nodes.
#[derive(Clone, Debug)]
pub struct Acceleration {
    /// Acceleration.
    pub velocity: Vec<[f64; 2]>,
    /// Acceleration of the rotation; empty if it has no inertia.
    pub rotation: Vec<[f64; 1]>,
}

/// The steps from which the inertial force follows.
pub struct Inertia {
    /// Corrected velocities of the last two steps, backwards in time.
    backwards: [CellVelocities; 2],
    /// The last step, and the one before it.
    pub past: [Option<Past>; 2],
    /// Accelerations at the start of the first step; `None` later.
    pub acceleration: Option<Acceleration>,
    /// Contributions of the cells to the momentum.
    cells: Vec<Cell<2>>,
    /// Inertia of the rotation, if a material has a micro-inertia.
    turning: Option<Turning>,
    /// Density in units of the inertial density.
    pub density: f64,
}

/// Inertia of the rotation.
struct Turning {
    /// Density times micro-inertia.
    density: Density,
    /// Contributions of the cells to the angular momentum of the rotation.
    cells: Vec<Cell<1>>,
}

/// Mass matrix and load of a cell, for quantities with `C` components.
#[derive(Clone, Copy)]
struct Cell<const C: usize> {
    mass: Mass,
    load: [[f64; C]; NODES],
}

impl<const C: usize> Cell<C> {
    const EMPTY: Self = Cell { mass: [[0.0; NODES]; NODES], load: [[0.0; C]; NODES] };
}

/// Earlier nodal values of a quantity that the material carries, and its accelerations.
struct Earlier<'a, const C: usize> {
    last: &'a [[f64; C]],
    before: Option<&'a [[f64; C]]>,
    acceleration: Option<&'a [[f64; C]]>,
}

/// Material and integration points of an inertial force.
#[derive(Clone, Copy)]
pub struct Matter<'a> {
    /// The materials.
    pub materials: &'a [Material],
    /// Their particles.
    pub particles: &'a Particles,
    /// The integration points, evaluated with these particles.
    pub quadrature: &'a Quadrature,
}

impl Inertia {
    /// No past step; the velocity before the first one is zero.
    pub fn new(plan: &Plan) -> Self {
        let mesh = &plan.mesh;
        let backwards = [0, 1].map(|_| CellVelocities::new(mesh, &plan.enclosure, false));
        let turning = plan.effects.micro_inertia.then(|| {
            let neighbours = Neighbours::new(mesh, &plan.enclosure);
            let materials = plan.state.materials.len();
            let mut density = Density::new(mesh, neighbours, materials, true);
            density.per_mass = |material| material.micro_inertia;
            Turning { density, cells: vec![Cell::EMPTY; mesh.cells()] }
        });
        Inertia {
            backwards,
            past: [None, None],
            acceleration: None,
            cells: vec![Cell::EMPTY; mesh.cells()],
            turning,
            density: plan.units.density / plan.units.inertial_density(),
        }
    }

    /// Keeps the divergence of the velocity with which points are traced back in some cells.
    pub fn keep_divergence(&mut self, of: impl Fn(usize) -> bool) {
        self.backwards.iter_mut().for_each(|velocities| velocities.keep_divergence(&of));
    }

    /// Nodal rotations of a flow, if they have inertia.
    pub fn rotation_of<const D: usize>(&self, flow: &Flow<D>) -> Vec<[f64; 1]> {
        let turns = self.turning.is_some();
        flow.velocity.iter().filter(|_| turns).map(|u| [u[D - 1]]).collect()
    }

    /// A step of length `dt` in a number of parts from a flow, with the velocity `half` at its middle.
    pub fn past_of<const D: usize>(
        &self,
        flow: &Flow<D>,
        half: &[[f64; 2]],
        dt: f64,
        parts: u32,
    ) -> Past {
        let mut velocity = Vec::with_capacity(half.len());
        flow.translation(&mut velocity);
        Past { velocity, rotation: self.rotation_of(flow), half: half.to_vec(), dt, parts }
    }

    /// Enters a step from a flow with the nodal velocities `past.velocity`.
    pub fn enter(&mut self, past: Past) {
        let [last, before] = &mut self.past;
        *before = last.replace(past);
        if before.is_some() {
            self.acceleration = None;
        }
    }

    /// Ends the step to the first flow: it determines the accelerations if they are `regular`.
    pub fn begin<const D: usize>(&mut self, plan: &Plan, regular: bool, flow: &Flow<D>) {
        let [last, before] = &mut self.past;
        *before = None;
        let Some(impulse) = last.take().filter(|_| regular) else { return };
        let mesh = &*plan.mesh;
        let back = reversed(plan, &mut self.backwards[0], &impulse);
        let origin = |node: usize| {
            let at = mesh.wrap(mesh.node_position(node));
            trace(&back, impulse.parts, (mesh.locate(at), at))
        };
        let velocity = (0..mesh.nodes()).map(|node| {
            let (now, then) =
                (flow.velocity[node], interpolated(mesh, &impulse.velocity, origin(node)));
            [0, 1].map(|c| (now[c] - then[c]) / impulse.dt)
        });
        let rotation = (0..impulse.rotation.len()).map(|node| {
            let [then] = interpolated(mesh, &impulse.rotation, origin(node));
            [(flow.velocity[node][D - 1] - then) / impulse.dt]
        });
        let (velocity, rotation) = (velocity.collect(), rotation.collect());
        self.acceleration = Some(Acceleration { velocity, rotation });
    }

    /// Computes the mass matrices, and the load of velocities and rotations for a solution at the end
    /// of the last step.
    pub fn update<const D: usize>(
        &mut self,
        plan: &Plan,
        density: &Density,
        matter: Matter,
        term: &mut Term,
        load: &mut Vec<[f64; D]>,
    ) {
        let mesh = &*plan.mesh;
        let Inertia { backwards, past, acceleration, cells, turning, density: unit } = self;
        let [Some(last), before] = past else { return };
        let ratio = before.as_ref().map(|b| last.dt / b.dt);
        let rates = match (ratio, &acceleration) {
            (Some(r), _) => [(1.0 + 2.0 * r) / (1.0 + r), 1.0 + r, r * r / (1.0 + r)],
            (None, Some(_)) => [2.0, 2.0, 0.0],
            (None, None) => [1.0, 1.0, 0.0],
        };
        let [first, second] = backwards;
        let course = Course {
            mesh,
            last: (last, reversed(plan, first, last)),
            before: before.as_ref().map(|b| (b, reversed(plan, second, b))),
            rates,
            unit: *unit,
        };
        let earlier = Earlier {
            last: &last.velocity,
            before: before.as_ref().map(|b| &*b.velocity),
            acceleration: acceleration.as_ref().map(|a| &*a.velocity),
        };
        course.update(density, &earlier, cells);
        term.rate = rates[0] / last.dt;
        term.mass.clear();
        term.mass.extend(cells.iter().map(|c| c.mass));
        load.clear();
        load.resize(mesh.nodes(), [0.0; D]);
        add_up(mesh, cells, load, 0);
        if let Some(turning) = turning {
            let Matter { materials, particles, quadrature } = matter;
            turning.density.update(mesh, particles, materials, quadrature);
            let earlier = Earlier {
                last: &last.rotation,
                before: before.as_ref().map(|b| &*b.rotation),
                acceleration: acceleration.as_ref().map(|a| &*a.rotation),
            };
            course.update(&turning.density, &earlier, &mut turning.cells);
            term.turning.clear();
            term.turning.extend(turning.cells.iter().map(|c| c.mass));
            add_up(mesh, &turning.cells, load, D - 1);
        }
    }
}

/// Adds the loads of the cells to those of the nodes, from a component on.
fn add_up<const C: usize, const D: usize>(
    mesh: &Mesh,
    cells: &[Cell<C>],
    load: &mut [[f64; D]],
    from: usize,
) {
    for (cell, of) in cells.iter().enumerate() {
        for (node, f) in mesh.cell_nodes(cell).into_iter().zip(of.load) {
            for (c, f) in f.into_iter().enumerate() {
                load[node][from + c] += f;
            }
        }
    }
}

/// The last two steps, each with its flow backwards in time.
struct Course<'a> {
    mesh: &'a Mesh,
    last: (&'a Past, FrozenFlow<'a>),
    before: Option<(&'a Past, FrozenFlow<'a>)>,
    /// `a_0, a_1, a_2`.
    rates: [f64; 3],
    /// Density in units of the inertial density.
    unit: f64,
}

impl Course<'_> {
    /// Computes the mass matrices with a density, and the loads of what the material had.
    fn update<const C: usize>(
        &self,
        density: &Density,
        earlier: &Earlier<C>,
        cells: &mut [Cell<C>],
    ) {
        let Course { mesh, last: (last, last_flow), before, rates: [_, a1, a2], unit } = self;
        threads::for_each(cells, GRAIN, |cell, out| {
            *out = Cell::EMPTY;
            if mesh.solid[cell] || density.is_void(cell) {
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
            // In a cell that material fills in part, all of it has a little mass.
            let void = density.void_share(cell);
            let even = if void > 0.0 { VOID_MASS * void / (1.0 - void) } else { 0.0 };
            let mean = if void > 0.0 { density.mean(cell) } else { 0.0 };
            density.for_fine_points(cell, |point| {
                let Some(mut one) = origins.next() else { return };
                if last.parts > 1 {
                    one = trace(last_flow, last.parts - 1, one);
                }
                let mut carried = interpolated(mesh, earlier.last, one).map(|u| a1 * u);
                if let Some(acceleration) = earlier.acceleration {
                    let a = interpolated(mesh, acceleration, one);
                    (0..C).for_each(|c| carried[c] += last.dt * a[c]);
                }
                if let (Some((before, flow)), Some(values)) = (before, earlier.before) {
                    let two = trace(flow, before.parts, one);
                    let u = interpolated(mesh, values, two);
                    (0..C).for_each(|c| carried[c] -= a2 * u[c]);
                }
                let mut mass = unit * volume * point.mass;
                if void > 0.0 {
                    mass += unit * volume * even * mean / count as f64;
                }
                for a in 0..NODES {
                    let share = mass * point.n[a];
                    (0..C).for_each(|c| out.load[a][c] += share * carried[c] / last.dt);
                    for b in 0..NODES {
                        out.mass[a][b] += share * point.n[b];
                    }
                }
            });
        });
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
pub fn interpolated<const C: usize>(
    mesh: &Mesh,
    nodal: &[[f64; C]],
    (cell, at): (usize, [f64; 2]),
) -> [f64; C] {
    let r = mesh.to_reference(cell, at).map(|r| r.clamp(-1.0, 1.0));
    interpolate(&mesh.cell_nodes(cell).map(|n| nodal[n]), &Shape::values(r))
}

/// Twice the kinetic energy, `integral rho (u . u + j w^2)`; zero without inertia.
pub fn twice_kinetic<const D: usize>(mesh: &Mesh, term: &Term, flow: &Flow<D>) -> f64 {
    if term.mass.is_empty() {
        return 0.0;
    }
    let [sum] = threads::sum(0..mesh.cells(), |cell| {
        if mesh.solid[cell] {
            return [0.0];
        }
        let turns = |u: [f64; D]| if D == 3 { u[D - 1] } else { 0.0 };
        [term.square(cell, &flow.of_cell(mesh, cell).map(|u| [u[0], u[1], turns(u)]))]
    });
    sum
}

/// Spin `(v,x - u,y)/2` of nodal velocities at the nodes: the mean over the cells around each.
pub fn spins(mesh: &Mesh, velocity: &[[f64; 2]]) -> Vec<[f64; 1]> {
    let mut sums = vec![(0.0, 0.0); mesh.nodes()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let nodes = mesh.cell_nodes(cell);
        let nodal = nodes.map(|n| velocity[n]);
        for (a, node) in nodes.into_iter().enumerate() {
            let at = [(a % 3) as f64 - 1.0, (a / 3) as f64 - 1.0];
            let l = gradient(&nodal, &Shape::at(at), mesh.cell_size(cell));
            sums[node].0 += 0.5 * (l[(1, 0)] - l[(0, 1)]);
            sums[node].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| [if count > 0.0 { sum / count } else { 0.0 }]).collect()
}
