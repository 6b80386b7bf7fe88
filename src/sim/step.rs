//! This module takes one step of a run.

use super::Integrator;
use super::clock::{Limiter, next_step};
use super::error::SimError;
use super::moving;
use super::phases::Phases;
use super::simulation::{Before, Simulation};
use crate::motion::advect;
use crate::motion::frozen_flow::FrozenFlow;
use crate::plan::When;
use crate::space::count::Count;
use crate::space::flow::Flow;
use std::time::Instant;

/// A step is shortened if the half-step velocity exceeds its Courant limit by this factor.
const SURPRISE: f64 = 4.0;

/// Largest displacement in the first step, whose error is not known in advance, that is due to the
/// change of the velocity in half the step, in units of the tolerance. A longer step is shortened.
const FIRST_CHANGE: f64 = 2.5;
/// Largest number of times that the first step is shortened for this reason.
const FIRST_ATTEMPTS: u32 = 3;

/// Largest factors by which the step of a given error rises and falls from one step to the next.
const LARGEST_RISE: f64 = 1.25;
/// See [`LARGEST_RISE`].
const LARGEST_FALL: f64 = 0.5;

impl<const D: usize> Simulation<D> {
    /// Takes one step.
    ///
    /// # Errors
    /// The time step is too short, a cell is empty, or the solver failed.
    pub fn advance(&mut self) -> Result<(), SimError> {
        let clock = Instant::now();
        let mut seconds = Phases::default();
        let speeds = self.speeds();
        let (mut dt, mut limiter) =
            next_step(&self.plan.clock, self.time, self.previous.as_ref().map(|p| p.dt), speeds);
        if let Some(longest) = self.longest.map(|dt| dt / self.plan.units.time)
            && dt > longest
        {
            (dt, limiter) = (longest, Limiter::Guard);
        }
        if self.has_moving_solids() {
            let swept = self.swept_step(dt);
            if swept < dt {
                (dt, limiter) = (swept, Limiter::Courant);
            }
        }
        let (mut extra, mut shortened) = (0, 0);
        loop {
            self.attempted = dt;
            if dt.is_nan() || self.time + dt <= self.time {
                let dt = dt * self.plan.units.time;
                return Err(SimError::Step { step: self.step + 1, time: self.si_time(), dt });
            }
            extra += self.find_half_step_velocity(dt, &mut seconds)?;
            // At the start of a flow, the half-step velocity can be much larger than the current
            // one.
            let crossed = dt * self.crossings_of_interest(|node| self.half[node]);
            let most = self.plan.clock.courant;
            if crossed > SURPRISE * most {
                (dt, limiter) = (dt * (most / crossed), Limiter::Courant);
                continue;
            }
            if self.tolerated.is_some() || shortened == FIRST_ATTEMPTS {
                break;
            }
            let most = FIRST_CHANGE * self.plan.clock.tolerance;
            let change = self.first_change(dt);
            if change <= most {
                break;
            }
            shortened += 1;
            (dt, limiter) = (dt * most / change, Limiter::Tolerance);
        }

        let phase = Instant::now();
        let plan = self.plan.clone();
        let parts = self.parts(dt);
        let Simulation { velocities, half, matter, quadrature, inertia, .. } = self;
        let compliant = |m: u8| matter.materials[usize::from(m)].law.compliance > 0.0;
        let part = dt / f64::from(parts);
        if let Some(inertia) = inertia {
            inertia.enter(inertia.past_of(&self.flow, half, dt, parts));
        }
        let mut frozen_flow = {
            let kinks = quadrature.kinks();
            FrozenFlow::new(&plan.mesh, &plan.enclosure, velocities, half, &kinks, part)
        };
        if !plan.moving.is_empty() {
            // The solids are where they are in the middle of the step.
            frozen_flow.start = -0.5 * dt;
        }
        for _ in 0..parts {
            advect::advance(
                &frozen_flow,
                &mut self.particles,
                &mut self.displacements,
                &plan.effects,
                compliant,
                &mut self.gauges,
                (&mut self.count, &mut self.crossings),
            );
            if let Some(inflow) = &self.inflow {
                inflow.enter(
                    &plan,
                    (&*self.half, part),
                    &mut self.particles,
                    &mut self.gauges,
                    &mut self.crossings,
                );
            }
            if let Some(dye) = &mut self.dye {
                let phase = Instant::now();
                dye.advance(&frozen_flow);
                seconds.dye += phase.elapsed().as_secs_f64();
            }
            frozen_flow.start += part;
        }
        self.count_crossings();
        seconds.motion += phase.elapsed().as_secs_f64() - seconds.dye;
        let phase = Instant::now();
        let end = if limiter == Limiter::Stop { self.next_stop() } else { self.time + dt };
        let plan = self.arrive(plan, dt, end)?;
        self.population.control(&plan.mesh, &mut self.particles, &mut self.count);
        for refill in &self.population.refills {
            self.gauges.iter_mut().for_each(|g| g.refill(&plan.mesh, refill));
        }
        seconds.population += phase.elapsed().as_secs_f64();

        self.time = end;
        self.step += 1;
        let changed = self.apply_changes();
        let mut before = std::mem::take(&mut self.spare);
        before.copy_from(&self.flow);
        // After a sudden change, the previous flow does not predict the next one.
        let ahead = (!changed).then(|| self.ahead(self.expected_step(dt)));
        if let (Some(previous), false) = (&self.previous, changed) {
            self.flow.extrapolate(&previous.flow, dt / previous.dt);
        }
        if let (Some(inertia), true) = (&mut self.inertia, changed) {
            inertia.past[1] = None;
        }
        let solved = self.solve(ahead.flatten().map(|t| (t, &before)), &mut seconds);
        // The step after a sudden change is chosen as the first one.
        self.tolerated = (!changed).then(|| self.tolerated_step(&before, dt));
        let older = self.previous.take();
        if changed {
            self.spare = before;
        } else {
            self.previous = Some(Before { flow: before, dt });
            self.spare = older.map(|o| o.flow).unwrap_or_default();
        }
        solved?;
        self.measure(dt, limiter, seconds, extra + self.report.corrections, clock);
        Ok(())
    }

    /// Number of substeps in which points are advected through a velocity frozen for `dt`: one if
    /// no point crosses more than a cell; otherwise each substep crosses at most half a cell.
    /// Longer substeps would make the particle density uneven although the flow is divergence-free.
    fn parts(&self, dt: f64) -> u32 {
        let crossed = dt * self.crossings(|node| self.half[node], |_| true);
        if crossed > 1.0 { (2.0 * crossed).ceil().min(1e4) as u32 } else { 1 }
    }

    /// Current time, s.
    pub(super) fn si_time(&self) -> f64 {
        self.time * self.plan.units.time
    }

    /// The next time at which a step must end, in the plan's units.
    fn next_stop(&self) -> f64 {
        let clock = &self.plan.clock;
        let later = |&&s: &&f64| s > self.time * (1.0 + 1e-14);
        clock.stops.iter().find(later).copied().unwrap_or(clock.end)
    }

    /// Computes the velocity at the middle of a step of length `dt`, stores it in `half`, and
    /// returns the number of solver corrections.
    fn find_half_step_velocity(&mut self, dt: f64, seconds: &mut Phases) -> Result<u32, SimError> {
        if self.has_moving_solids() {
            return self.solve_half_step(dt, seconds);
        }
        self.flow.translation(&mut self.half);
        match (self.plan.method.integrator, &self.previous) {
            (Integrator::Euler, _) => Ok(0),
            (Integrator::Extrapolated, Some(before)) => {
                let f = 0.5 * dt / before.dt;
                for (u, b) in self.half.iter_mut().zip(&before.flow.velocity) {
                    *u = [u[0] + f * (u[0] - b[0]), u[1] + f * (u[1] - b[1])];
                }
                Ok(0)
            }
            (Integrator::Extrapolated | Integrator::Midpoint, _) => {
                self.solve_half_step(dt, seconds)
            }
        }
    }

    /// Advects a copy of the particles by half a step with the velocity in `half`, solves for the
    /// flow at these positions, and stores its velocity in `half`. Returns the number of solver
    /// corrections.
    fn solve_half_step(&mut self, dt: f64, seconds: &mut Phases) -> Result<u32, SimError> {
        let course = self.course(dt);
        self.pose(&self.standing.clone())?;
        self.flow.translation(&mut self.half);
        let plan = self.plan.clone();
        let phase = Instant::now();
        let mut there = self.particles.clone();
        let parts = self.parts(0.5 * dt);
        let Simulation { velocities, half, matter, displacements, quadrature, inflow, .. } = self;
        let compliant = |m: u8| matter.materials[usize::from(m)].law.compliance > 0.0;
        let part = 0.5 * dt / f64::from(parts);
        let mut frozen_flow = {
            let kinks = quadrature.kinks();
            FrozenFlow::new(&plan.mesh, &plan.enclosure, velocities, half, &kinks, part)
        };
        let (effects, no_gauges, mut ignored) = (&plan.effects, &mut [], Count::default());
        let mut crossings = Vec::new();
        for _ in 0..parts {
            advect::advance(
                &frozen_flow,
                &mut there,
                displacements,
                effects,
                compliant,
                no_gauges,
                (&mut ignored, &mut crossings),
            );
            if let Some(inflow) = inflow {
                inflow.enter(&plan, (half, part), &mut there, no_gauges, &mut crossings);
            }
            frozen_flow.start += part;
        }
        if self.has_moving_solids() {
            self.pose(&course.middle)?;
            moving::clear(&self.plan.mesh, &mut there);
        }
        let mesh = self.plan.mesh.clone();
        self.population.control(&mesh, &mut there, &mut ignored);
        seconds.motion += phase.elapsed().as_secs_f64();
        let here = std::mem::replace(&mut self.particles, there);
        let flow = self.flow.clone();
        // To the middle of the step, the first order in time suffices.
        let steps = self.inertia.as_mut().map(|inertia| {
            let only = inertia.past_of(&flow, &self.half, 0.5 * dt, parts);
            std::mem::replace(&mut inertia.past, [Some(only), None])
        });
        // In the first step a mode may at most change its sign. With exactly half a step ahead, the
        // method is the trapezoidal rule.
        let ahead = self.ahead(dt).map(|t| if self.previous.is_none() { 0.5 * dt } else { t });
        let solved = self.solve(ahead.map(|t| (t, &flow)), seconds);
        std::mem::replace(&mut self.flow, flow).translation(&mut self.half);
        self.particles = here;
        if let (Some(inertia), Some(steps)) = (&mut self.inertia, steps) {
            inertia.past = steps;
        }
        solved?;
        Ok(self.report.corrections)
    }

    /// Displacement in a first step of length `dt` that is due to the change of the velocity in half
    /// the step, in cells.
    fn first_change(&self, dt: f64) -> f64 {
        let now = |node: usize, c: usize| self.flow.velocity[node][c];
        let change = |node: usize| [0, 1].map(|c| self.half[node][c] - now(node, c));
        dt * self.crossings_apart(change)
    }

    /// Length of the next step, after a step of length `dt` from the flow `before`, at which the
    /// displacement error reaches its tolerance.
    ///
    /// The displacement of the step was `dt` times the velocity in `half`, which was extrapolated
    /// from earlier flows. The flow at the end of the step gives the trapezoidal rule,
    ///
    /// ```text
    /// error = max over nodes of  dt |u_half - (u_before + u_now)/2| / h  =  O(dt^k)
    /// next  = dt (tolerance/error)^(1/k),   k = 3 (2 in first-order time stepping)
    /// ```
    fn tolerated_step(&self, before: &Flow<D>, dt: f64) -> f64 {
        let error = dt
            * self.crossings_apart(|node| {
                let (u, v) = (before.velocity[node], self.flow.velocity[node]);
                [0, 1].map(|c| self.half[node][c] - 0.5 * (u[c] + v[c]))
            });
        let order = if self.plan.method.integrator == Integrator::Euler { 2.0 } else { 3.0 };
        let next = dt * (self.plan.clock.tolerance / error).powf(1.0 / order);
        let longest = LARGEST_RISE * self.tolerated.unwrap_or(dt).max(dt);
        next.clamp(LARGEST_FALL * dt, longest)
    }

    /// Applies the scheduled changes that are due, switches sources, and returns whether anything
    /// changed.
    pub(super) fn apply_changes(&mut self) -> bool {
        self.events.clear();
        let mut any = false;
        let plan = self.plan.clone();
        while let Some(change) = plan.changes.get(self.next_change) {
            let due = match change.when {
                When::Time(t) => t <= self.time * (1.0 + 1e-14),
                When::Step(s) => s <= self.step,
            };
            if !due {
                break;
            }
            let before = self.potential_energy();
            self.matter = change.state.clone();
            // A change of gravity changes the potential energy of all particles at once.
            let jump = self.potential_energy() - before;
            self.row.work += jump * self.plan.units.energy();
            self.events.push(format!("step {}: {}", self.step, change.label));
            self.version += 1;
            self.next_change += 1;
            any = true;
        }
        self.switch_sources() || any
    }

    /// Time ahead for which restoring loads are computed, for a step of length `dt`; `None` without
    /// stabilisation or stratification.
    fn ahead(&self, dt: f64) -> Option<f64> {
        let share = self.plan.method.stabilisation.filter(|_| self.matter.is_stratified());
        share.map(|share| share * dt)
    }

    /// Expected length of the next step, from the current flow and the last step length `dt`.
    fn expected_step(&self, dt: f64) -> f64 {
        let (next, _) = next_step(&self.plan.clock, self.time, Some(dt), self.speeds());
        if next > 0.0 { next } else { dt }
    }
}
