//! This module switches the sources of a scene on and off.

use super::simulation::Simulation;

impl<const D: usize> Simulation<D> {
    /// Switches sources whose time has come, and returns whether there were any.
    pub(super) fn switch_sources(&mut self) -> bool {
        let on = self.plan.sources_on(self.time);
        let changes = on != self.sources_on;
        if changes {
            self.stokes.prescribe(self.plan.constraints_while(&on));
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
