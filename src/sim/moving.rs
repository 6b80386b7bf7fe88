//! This module moves the solids of a run: it places them, makes everything anew that depends on where they
//! are, and moves out of them what they have swept.
//!
//! In a step from `a` to `b` the velocity that advects points is that of the middle, where the solids have
//! the mean displacement of both ends and the mean velocity `(D(b) - D(a))/(b - a)`. So the volume that
//! flows out in a step is exactly what the solids sweep. At its end they have their displacement and
//! velocity there.

use super::clock;
use super::error::SimError;
use super::reach::Reach;
use super::simulation::Simulation;
use crate::motion::frozen_flow::CellVelocities;
use crate::motion::inflow::Inflow;
use crate::plan::{Plan, Pose};
use crate::scene::Quadrature as Rule;
use crate::solve::density::Density;
use crate::solve::quadrature::Quadrature;
use crate::solve::stokes::Stokes;
use crate::space::mesh::Mesh;
use crate::space::neighbours::{Neighbours, joined, open_faces};
use crate::space::particles::Particles;
use crate::space::population::Population;
use crate::space::shape::side_point;
use std::sync::Arc;

/// Largest displacement of a solid in a step, in cells.
const LARGEST_SWEEP: f64 = 0.5;

/// Part of the face of a cell up to which it is closed: through narrower gaps nothing is solved for.
const CLOSED: f64 = 0.1;

/// Number of points of a face at which it is tested.
const SAMPLES: usize = 40;

/// Imbalance of what flows into a closed part of the domain, relative to what solids sweep there, that
/// slivers beside solids may have.
const BALANCED: f64 = 0.25;

/// Volume of a part of the domain, in cells, below which it is such a sliver.
const SLIVER: f64 = 0.5;

/// Places of the solids in a step.
pub(super) struct Course {
    /// In its middle.
    pub(super) middle: Vec<Pose>,
    /// At its end.
    pub(super) end: Vec<Pose>,
}

impl<const D: usize> Simulation<D> {
    /// Whether solids move.
    pub(super) fn has_moving_solids(&self) -> bool {
        !self.plan.moving.is_empty()
    }

    /// Places of the solids in a step of length `dt`.
    pub(super) fn course(&self, dt: f64) -> Course {
        let unit = self.plan.units.time;
        let [from, to] = [self.time * unit, (self.time + dt) * unit];
        let mut out = Course { middle: vec![], end: vec![] };
        for (moving, at) in self.plan.moving.iter().zip(&self.standing) {
            let way = moving.displacement(from, to);
            let by = |share: f64| [0, 1].map(|c| at.displacement[c] + share * way[c]);
            let mean = way.map(|w| w / (to - from));
            out.middle.push(Pose { displacement: by(0.5), velocity: mean });
            out.end.push(Pose { displacement: by(1.0), velocity: moving.velocity_at(to) });
        }
        out
    }

    /// The length of a step, at most `dt`, in which no solid moves farther than a step allows.
    pub(super) fn swept_step(&self, mut dt: f64) -> f64 {
        let mesh = &self.plan.mesh;
        let size = |n: usize, length: f64| length / n as f64 * self.plan.units.length;
        let cell = size(mesh.x.cells(), mesh.x.length()).min(size(mesh.y.cells(), mesh.y.length()));
        let too_far = |dt: f64| {
            let course = self.course(dt);
            let mut ways = course.end.iter().zip(&self.standing).map(|(end, at)| {
                let [x, y] = [0, 1].map(|c| end.displacement[c] - at.displacement[c]);
                x.hypot(y)
            });
            ways.any(|way| way > LARGEST_SWEEP * cell)
        };
        while too_far(dt) {
            dt *= 0.5;
        }
        dt
    }

    /// Places the solids, and makes everything anew that depends on where they are.
    ///
    /// # Errors
    /// The flow is impossible with the solids there.
    pub(super) fn pose(&mut self, poses: &[Pose]) -> Result<(), SimError> {
        if self.plan.poses == poses {
            return Ok(());
        }
        let (step, time) = (self.step, self.si_time());
        let posed = self.plan.posed(poses);
        let plan =
            posed.map_err(|source| SimError::Blocks { step, time, source: Box::new(source) })?;
        let plan = Arc::new(plan);
        if let Some([x, y]) = trapped(&plan, &self.sources_on) {
            return Err(SimError::Trapped { step, time, x, y });
        }
        let before = std::mem::replace(&mut self.plan, plan.clone());
        let mesh = &plan.mesh;
        let constraints = plan.constraints_while::<D>(&self.sources_on);
        let factors = self.quadrature.composition().factors().to_vec();
        let materials = plan.state.materials.len();
        self.quadrature = Quadrature::new(mesh, plan.rule_of_cells(), materials);
        self.quadrature.bind_walls(|cell| constraints.fixed_sides(mesh, cell));
        self.quadrature.bind_slip(mesh, &plan.boundary, &plan.units);
        self.quadrature.composition_mut().set_factors(&factors);
        self.stokes = Stokes::new(mesh.clone(), constraints);
        let neighbours = Neighbours::new(mesh, &plan.enclosure);
        self.density = Density::new(mesh, neighbours, materials, plan.effects.inertia);
        let kinked = plan.rule_of_cells() == Rule::Sides;
        self.velocities = CellVelocities::new(mesh, &plan.enclosure, kinked);
        if plan.method.stabilisation.is_some() {
            self.restoring_faces = open_faces(mesh, &plan.enclosure);
        }
        self.crossing_rates = clock::crossing_rates(mesh);
        self.population =
            Population::new(mesh, &plan.enclosure, plan.method.seeding, plan.around());
        self.inflow = Inflow::new(&plan);
        self.fixed_load = plan.fixed_loads::<D>();
        self.load.clone_from(&self.fixed_load);
        self.other_load.clone_from(&self.fixed_load);
        self.reach = Reach::of(&plan);
        self.fill_pressures(&before.mesh);
        Ok(())
    }

    /// Replaces the plan by one that has the same blocks, and keeps them where they are.
    pub(super) fn change_plan(&mut self, plan: Arc<Plan>) {
        let Plan { mesh, boundary, enclosure, forces, poses, .. } = &*self.plan;
        self.plan = if self.has_moving_solids() {
            Arc::new(Plan {
                mesh: mesh.clone(),
                boundary: boundary.clone(),
                enclosure: enclosure.clone(),
                forces: forces.clone(),
                poses: poses.clone(),
                ..(*plan).clone()
            })
        } else {
            plan
        };
    }

    /// Gives cells that were solid the mean pressure of their neighbours, as a first guess.
    fn fill_pressures(&mut self, before: &Mesh) {
        let mesh = self.plan.mesh.clone();
        for cell in (0..mesh.cells()).filter(|&c| before.solid[c] && !mesh.solid[c]) {
            let known = mesh.block(cell).filter(|&c| !before.solid[c]);
            let known: Vec<f64> = known.map(|c| self.flow.pressure[c][0]).collect();
            let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
            self.flow.pressure[cell] = [mean, 0.0, 0.0];
        }
    }

    /// Ends the motion of a step of length `dt` to the time `end`: places the solids where they are then.
    /// Returns the plan with them there.
    pub(super) fn arrive(
        &mut self,
        plan: Arc<Plan>,
        dt: f64,
        end: f64,
    ) -> Result<Arc<Plan>, SimError> {
        if plan.moving.is_empty() {
            return Ok(plan);
        }
        let mut poses = self.course(dt).end;
        let time = end * plan.units.time;
        for (pose, moving) in poses.iter_mut().zip(&plan.moving) {
            pose.velocity = moving.velocity_at(time);
        }
        self.pose(&poses)?;
        self.standing = poses;
        self.clear_solids();
        Ok(self.plan.clone())
    }

    /// [`Simulation::crossings_of_interest`] of the nodes that are not beside solids that move, whose
    /// velocities jump when a solid passes.
    pub(super) fn crossings_apart(&self, velocity: impl Fn(usize) -> [f64; 2]) -> f64 {
        self.crossings(velocity, |node| self.interest.contains(node) && !self.reach.beside(node))
    }

    /// Moves particles and dye that are inside of a solid to the nearest place outside, and sorts the
    /// particles.
    pub(super) fn clear_solids(&mut self) {
        let mesh = self.plan.mesh.clone();
        clear(&mesh, &mut self.particles);
        for p in self.dye.iter_mut().flat_map(|dye| dye.lines.iter_mut().flatten()) {
            let inside = mesh.wrap(*p);
            if !mesh.holds(inside) {
                *p = mesh.nearest_free(inside).unwrap_or(*p);
            }
        }
    }
}

/// Moves particles that are inside of a solid to the nearest place outside, and sorts them.
pub(super) fn clear(mesh: &Mesh, particles: &mut Particles) {
    if mesh.parts().is_none() {
        return;
    }
    for cell in (0..mesh.cells()).filter(|&c| mesh.solid[c] || mesh.part(c).is_some()) {
        for p in particles.of_cell(cell) {
            let place = &mut particles.position[p];
            *place = mesh.nearest_free(*place).unwrap_or(*place);
        }
    }
    particles.sort(mesh);
}

/// A place, m, in a part of the domain out of which nothing can flow and whose volume solids change.
fn trapped(plan: &Plan, sources_on: &[bool]) -> Option<[f64; 2]> {
    let mesh = &plan.mesh;
    mesh.parts().filter(|parts| parts.move_on())?;
    if plan.effects.volume_change {
        return None;
    }
    let neighbours = Neighbours::new(mesh, &plan.enclosure);
    let mut velocity = vec![[0.0; 2]; mesh.nodes()];
    plan.constraints_while::<2>(sources_on).impose(&mut velocity);
    let opens = open_cells(plan);
    let mut seen = mesh.solid.clone();
    for first in 0..mesh.cells() {
        if seen[first] {
            continue;
        }
        let list = joined(first, &mut seen, |cell| {
            let opens = move |&c: &usize| is_open(mesh, cell, side_towards(mesh, cell, c));
            neighbours.of(cell).filter(opens)
        });
        if list.iter().any(|&c| opens[c]) {
            continue;
        }
        let sum = |of: &dyn Fn(usize) -> f64| list.iter().map(|&c| of(c)).sum::<f64>();
        let free = |c: usize| mesh.part(c).map_or(1.0, |part| part.fraction);
        let swept = sum(&|c| mesh.part(c).map_or(0.0, |part| part.swept.abs()));
        let net = sum(&|c| mesh.volume_rate(c, |node| velocity[node]));
        if net.abs() > BALANCED * swept && swept > 0.0 && sum(&free) > SLIVER {
            let mean = |k: usize| sum(&|c| free(c) * mesh.cell_centre(c)[k]) / sum(&free);
            return Some(plan.si([mean(0), mean(1)]));
        }
    }
    None
}

/// The side of a cell (left, right, bottom, top) beyond which a neighbour is, perhaps across a seam.
fn side_towards(mesh: &Mesh, cell: usize, other: usize) -> usize {
    let ((i, j), (k, l)) = (mesh.cell_ij(cell), mesh.cell_ij(other));
    let (c, from, to) = if i == k { (1, j, l) } else { (0, i, k) };
    2 * c + usize::from(to == from + 1 || to + 1 < from)
}

/// Whether solids leave a side of a cell open.
fn is_open(mesh: &Mesh, cell: usize, side: usize) -> bool {
    let Some(parts) = mesh.parts() else { return true };
    let is_free = |k: &usize| {
        let t = 2.0 * (*k as f64 + 0.5) / SAMPLES as f64 - 1.0;
        !parts.is_solid(mesh.from_reference(cell, side_point(side, t)))
    };
    mesh.part(cell).is_none()
        || (0..SAMPLES).filter(is_free).count() as f64 > CLOSED * SAMPLES as f64
}

/// Cells at a side through which material may flow out.
fn open_cells(plan: &Plan) -> Vec<bool> {
    let mesh = &plan.mesh;
    let mut open = vec![false; mesh.cells()];
    for (side, piece) in plan.boundary.pieces() {
        if piece.conditions.velocity[piece.segment.normal].is_none() {
            let cells = piece.segment.cells_at_side(mesh, side).map(|(_, cell)| cell);
            cells.filter(|&c| is_open(mesh, c, side)).for_each(|c| open[c] = true);
        }
    }
    open
}
