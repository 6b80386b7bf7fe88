//! This module switches the sources of a scene on and off.

use super::simulation::Simulation;
use crate::plan::Plan;
use crate::space::constraints::Constraints;

/// Times that differ by less than this share of the run are one, as in the plan's stops.
const TINY: f64 = 2e-9;

/// Which sources are on after a time, in the plan's units.
pub(super) fn on(plan: &Plan, time: f64) -> Vec<bool> {
    plan.boundary.sources.iter().map(|s| s.is_on(time, TINY * plan.clock.end)).collect()
}

/// Prescribed nodal values of a plan while the given sources are on.
pub(super) fn constraints<const D: usize>(plan: &Plan, on: &[bool]) -> Constraints<D> {
    let all = &plan.boundary.sources;
    let is_on = |s: &_| all.iter().zip(on).any(|(other, &on)| on && std::ptr::eq(other, s));
    let mut out = plan.boundary.constraints_with::<D>(&plan.mesh, &plan.units, is_on);
    out.refer(plan.pressure_reference);
    out
}

impl<const D: usize> Simulation<D> {
    /// Switches sources whose time has come, and returns whether there were any.
    pub(super) fn switch_sources(&mut self) -> bool {
        let on = on(&self.plan, self.time);
        let changes = on != self.sources_on;
        if changes {
            self.stokes.prescribe(constraints(&self.plan, &on));
            let names = self.plan.boundary.sources.iter().zip(self.sources_on.iter().zip(&on));
            for (source, (_, now)) in names.filter(|(_, (before, now))| before != now) {
                let word = if *now { "begins" } else { "ends" };
                self.events.push(format!("step {}: source `{}` {word}", self.step, source.name));
            }
            self.sources_on = on;
        }
        changes
    }
}
