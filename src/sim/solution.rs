//! This module solves for the flow of a step: integration points, loads, velocity, rotation and
//! pressure.

use super::Integrator;
use super::error::SimError;
use super::inertia::{self, Past, spins, twice_kinetic};
use super::phases::Phases;
use super::simulation::Simulation;
use crate::solve::last_flow::{Iterate, LastFlow, NoFlow};
use crate::solve::nonlinear::Matter;
use crate::solve::report::{SolveError, Stopping};
use crate::solve::stokes::Loads;
use crate::solve::terms::CellTerm;
use crate::solve::terms::restoring::Ahead;
use crate::solve::terms::weight::{Masses, add_acceleration, add_gravity};
use crate::space::flow::Flow;
use std::time::Instant;

/// Length of the step from rest to the first flow with inertia, in units of time or of the run.
const IMPULSE: f64 = 1e-6;
impl<const D: usize> Simulation<D> {
    /// Solves for the flow at the current particle positions. `restoring`: the time ahead for which
    /// restoring loads are computed, and the previous flow.
    pub(super) fn solve(
        &mut self,
        restoring: Option<(f64, &Flow<D>)>,
        seconds: &mut Phases,
    ) -> Result<(), SimError> {
        let plan = self.plan.clone();
        let phase = Instant::now();
        let (step, time) = (self.step, self.si_time());
        self.factors_of_points.clear();
        self.factors_of_points.extend_from_slice(self.quadrature.composition().factors());
        let Flow { velocity, pressure } = &self.flow;
        let last = Iterate { mesh: &plan.mesh, velocity, pressure };
        let nonlinear = self.quadrature.has_wall_friction()
            || self.matter.materials.iter().any(|m| m.law.depends_on().needs_flow());
        let known = !nonlinear || velocity.as_flattened().iter().any(|&u| u != 0.0);
        let last: &dyn LastFlow = if known { &last } else { &NoFlow };
        self.quadrature.set_gravity(self.matter.gravity);
        self.quadrature
            .update(&plan.mesh, &self.particles, &self.matter.materials, self.version, last)
            .map_err(|mut source| {
                source.x *= plan.units.length;
                source.y *= plan.units.length;
                SimError::Empty { step, time, source }
            })?;
        self.leave_out_void()?;
        let background = self.plan.background();
        let entering = self.inflow.iter().flat_map(|i| i.cells_of_interest(background));
        self.interest.update(&plan.mesh, self.quadrature.composition(), background, entering);
        seconds.quadrature += phase.elapsed().as_secs_f64();
        let phase = Instant::now();
        self.update_load();
        self.update_restoring(restoring);
        self.update_inertia();
        seconds.weight += phase.elapsed().as_secs_f64();
        let stopping = Stopping::of(&plan.method);
        let weight = self.mean_weight();
        let loads = Loads { nodal: &self.load, terms: &self.terms, weight: &weight };
        let Simulation { stokes, quadrature, particles, matter, flow, .. } = self;
        let failed =
            |s: SolveError| SimError::Solve { step, time, source: s.scaled(plan.units.length) };
        let solved = if nonlinear {
            let matter = Matter { particles, materials: &matter.materials };
            stokes.solve_nonlinear(quadrature, matter, loads, stopping, (flow, known))
        } else {
            stokes.solve(quadrature, loads, stopping, flow)
        };
        self.report = solved.map_err(failed)?;
        if self.report.loose > 0 {
            let [solutions, cells] = self.loosened;
            self.loosened = [solutions + 1, cells.max(self.report.loose as u64)];
        }
        if !plan.forces.is_empty() {
            stokes.reactions(quadrature, loads, flow, &mut self.reactions);
        }
        self.separate_inertia();
        self.continue_into_void();
        seconds.assemble += self.report.seconds.assemble;
        seconds.factor += self.report.seconds.factor;
        seconds.solve += self.report.seconds.solve;
        Ok(())
    }

    fn update_restoring(&mut self, restoring: Option<(f64, &Flow<D>)>) {
        let Some((ahead, before)) = restoring else { return self.terms.restoring.clear() };
        // In first-order time stepping the restoring terms act on the velocity, not on its change.
        let still = self.plan.method.integrator == Integrator::Euler;
        let before = before.velocity.iter().map(|u| if still { [0.0; 2] } else { [u[0], u[1]] });
        let solved =
            self.matter.materials.iter().filter(|m| !(self.plan.effects.void && m.background));
        let viscosities = solved.map(|m| m.viscosity);
        let ahead = Ahead {
            gravity: self.matter.gravity,
            time: ahead,
            weakest: viscosities.fold(f64::INFINITY, f64::min),
        };
        let mesh = &self.plan.mesh;
        self.terms.restoring.update(mesh, &self.restoring_faces, &self.density, ahead, before);
    }

    /// With inertia, finds the first flow: the initial velocity without its divergence.
    ///
    /// The first flow is that after a step so short that only inertia and pressure act in it. If
    /// material or a side moves, it is solved for twice, so that acceleration and pressure are those of the
    /// flow and not those of the impulse that removes the divergence.
    pub(super) fn start_moving(&mut self, seconds: &mut Phases) -> Result<(), SimError> {
        let plan = self.plan.clone();
        let Some(inertia) = &mut self.inertia else { return Ok(()) };
        let mesh = &plan.mesh;
        let mut velocity = vec![[0.0; 2]; mesh.nodes()];
        if let Some(given) = &plan.initial_velocity {
            for (node, u) in velocity.iter_mut().enumerate() {
                let [x, y] = plan.si(mesh.node_position(node));
                *u = given.each_ref().map(|f| f.at(x, y) / plan.units.velocity());
            }
        }
        let half = vec![[0.0; 2]; mesh.nodes()];
        let dt = IMPULSE * plan.clock.end.min(1.0);
        // What moves as a rigid body at the start rotates with it.
        let rotation = if plan.effects.micro_inertia { spins(mesh, &velocity) } else { vec![] };
        inertia.enter(Past { velocity, rotation, half, dt, parts: 1 });
        if plan.initial_velocity.is_some() || self.stokes.is_driven() {
            self.solve(None, seconds)?;
            let mut velocity = Vec::new();
            self.flow.translation(&mut velocity);
            self.flow.pressure.fill([0.0; 3]);
            if let Some(inertia) = &mut self.inertia {
                let rotation = inertia.rotation_of(&self.flow);
                let past = Past { half: velocity.clone(), velocity, rotation, dt, parts: 1 };
                inertia.past = [Some(past), None];
            }
        }
        Ok(())
    }

    /// Adds the momentum of the last steps to the load.
    fn update_inertia(&mut self) {
        let plan = self.plan.clone();
        let Simulation {
            inertia,
            density,
            terms,
            momentum,
            load,
            particles,
            matter,
            quadrature,
            ..
        } = self;
        let Some(inertia) = inertia else { return };
        let matter = inertia::Matter { materials: &matter.materials, particles, quadrature };
        inertia.update(&plan, density, matter, &mut terms.inertia, momentum);
        for (load, momentum) in load.iter_mut().zip(momentum) {
            for c in 0..terms.inertia.components() {
                load[c] += momentum[c];
            }
        }
    }

    /// Separates the power of the inertia from those of the loads and of the stabilisation in the
    /// report, and the momentum from the load.
    fn separate_inertia(&mut self) {
        let Simulation { inertia, terms, momentum, load, flow, plan, report, .. } = self;
        if inertia.is_none() {
            return;
        }
        let nodes = load.iter_mut().zip(momentum).zip(&flow.velocity);
        let mut power = 0.0;
        for ((load, momentum), u) in nodes {
            for c in 0..terms.inertia.components() {
                load[c] -= momentum[c];
            }
            power += momentum[0] * u[0] + momentum[1] * u[1];
            for c in 2..terms.inertia.components() {
                power += momentum[c] * u[c];
            }
        }
        let taken = terms.inertia.rate * twice_kinetic(&plan.mesh, &terms.inertia, flow);
        report.power_in -= power;
        report.restoring -= taken;
        report.inertia = taken - power;
    }

    /// Weight per volume of each cell, if there are solids of any shape.
    fn mean_weight(&self) -> Vec<[f64; 2]> {
        let (plan, mesh) = (&self.plan, &self.plan.mesh);
        if mesh.parts().is_none() || !plan.has_mass() {
            return vec![];
        }
        let unit = plan.units.acceleration();
        let weight = |cell: usize| {
            let [x, y] = plan.si(mesh.cell_centre(cell));
            let further = plan.acceleration.as_ref();
            let further = further.map_or([0.0; 2], |a| a.each_ref().map(|a| a.at(x, y) / unit));
            [0, 1].map(|c| self.density.mean(cell) * (self.matter.gravity[c] + further[c]))
        };
        (0..mesh.cells()).map(weight).collect()
    }

    fn update_load(&mut self) {
        let plan = self.plan.clone();
        if !plan.has_mass() {
            return;
        }
        self.load.copy_from_slice(&self.fixed_load);
        let Simulation { density, quadrature, load, other_load, matter, .. } = self;
        density.update(&plan.mesh, &self.particles, &matter.materials, quadrature);
        let masses = Masses::of(plan.method.quadrature, density, quadrature);
        add_acceleration(&plan, masses, load);
        other_load.copy_from_slice(load);
        add_gravity(&plan, matter.gravity, masses, load);
    }
}
