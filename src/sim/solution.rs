//! This module solves for the flow of a step: integration points, loads, velocity, rotation and
//! pressure.

use super::Integrator;
use super::error::SimError;
use super::phases::Phases;
use super::simulation::Simulation;
use crate::solve::report::Stopping;
use crate::solve::stokes::Loads;
use crate::solve::terms::restoring::Ahead;
use crate::solve::terms::weight::{Masses, add_acceleration, add_gravity};
use crate::space::flow::Flow;
use std::time::Instant;

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
        let last = (&*plan.mesh, &self.flow);
        self.quadrature
            .update(&plan.mesh, &self.particles, &self.matter.materials, self.version, &last)
            .map_err(|mut source| {
                source.x *= plan.units.length;
                source.y *= plan.units.length;
                SimError::Empty { step, time, source }
            })?;
        let background = self.plan.background();
        self.interest.update(&plan.mesh, self.quadrature.composition(), background);
        seconds.quadrature += phase.elapsed().as_secs_f64();
        let phase = Instant::now();
        self.update_load();
        self.update_restoring(restoring);
        seconds.weight += phase.elapsed().as_secs_f64();
        let stopping = Stopping {
            tolerance: plan.method.tolerance,
            max_corrections: plan.method.max_corrections,
        };
        let loads = Loads { nodal: &self.load, terms: &self.terms };
        self.report =
            self.stokes.solve(&self.quadrature, loads, stopping, &mut self.flow).map_err(
                |source| SimError::Solve { step, time, source: source.scaled(plan.units.length) },
            )?;
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
        let viscosities = self.matter.materials.iter().map(|m| m.viscosity);
        let ahead = Ahead {
            gravity: self.matter.gravity,
            time: ahead,
            weakest: viscosities.fold(f64::INFINITY, f64::min),
        };
        let mesh = &self.plan.mesh;
        self.terms.restoring.update(mesh, &self.restoring_faces, &self.density, ahead, before);
    }

    fn update_load(&mut self) {
        let plan = self.plan.clone();
        if !plan.has_weight() {
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
