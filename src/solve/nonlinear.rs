//! This module solves for the flow of generalised fluids, whose viscosity depends on the rates and
//! on the pressure, by Newton's method at fixed pressure.
//!
//! At fixed pressure of the laws, the flow is the minimum of a convex functional `F(u)` on the flows
//! without divergence (see [`flow_curve`](crate::laws::flow_curve)). Each iteration factors the
//! matrix with the derivatives of the stresses, computes one correction `du, dp`, and looks along
//! it for the minimum,
//!
//! ```text
//! s(a) = r(u + a du) . du = -dF/da,   s(0) = du . J du > 0
//! ```
//! The whole step is taken unless it goes too far (`s(1) < 0` and large), and also if `s(0) <= 0`, since it
//! then removes the divergence that an earlier flow had in cells of other shapes. Then the laws take the new
//! pressure. The iteration ends with the correction whose norm, that of the dissipated power,
//!
//! ```text
//! sqrt(s(0) / dissipation)        (Newton decrement, relative)
//! ```
//! is below the tolerance (or the first one after the laws have taken the pressure for the last
//! time), if the powers balance too: an estimate of the relative error before that correction. It does not
//! depend on units, on the mesh, or on the contrast of viscosities.

use super::last_flow::Iterate;
use super::problem::{Residual, Stokes, Work, add_scaled};
use super::quadrature::Quadrature;
use super::report::{Report, SolveError, Stopping};
use super::stokes::Loads;
use crate::plan::material::Material;
use crate::space::flow::Flow;
use crate::space::particles::Particles;
use crate::threads;
use std::time::Instant;

/// Largest number of iterations.
const MOST_ITERATIONS: u32 = 100;
/// Largest number of points at which the functional is evaluated along a correction.
const MOST_PROBES: u32 = 10;
/// A step is accepted if the slope of the functional has changed its sign by no more than this
/// share of its slope at the start.
const OVERSHOOT: f64 = 1.0;
/// Relative decrement up to which the laws take the pressure of each iterate. Before, the pressure of
/// material at rest, whose viscosity is large, is not known.
const NEAR: f64 = 0.1;
/// Share of the change of the pressure that the laws take from the second time on.
const RELAXED: f64 = 0.5;
/// Number of times from which on this share decreases as one over it, so that a pressure that goes round in a
/// cycle comes to rest.
const DAMPED_AFTER: f64 = 20.0;
/// Largest number of corrections that remove the divergence of a converged flow.
const MOST_PROJECTIONS: u32 = 20;
/// Divergence, relative to the strain rate, of a converged flow.
const DIVERGENCE: f64 = 1e-8;
/// Dissipation below this share of the scale of power is that of a scene at rest.
const REST: f64 = 1e-9;

/// Largest number of times that the laws take a new pressure in a step; from then on they keep it, so that
/// a pressure that alternates does not prevent convergence. With one time only, grains above a round
/// hole of 15 diameters stick and slip at a tenth of their rate.
const UPDATES: u32 = 8;
/// Tolerance of the flows of the softer materials from which a first flow starts.
const ROUGH: f64 = 0.1;
/// Factor between their largest viscosities.
const STAGE: f64 = 10.0;

/// The particles and materials that determine the laws.
#[derive(Clone, Copy)]
pub struct Matter<'a> {
    /// Particles, sorted by cell.
    pub particles: &'a Particles,
    /// Materials.
    pub materials: &'a [Material],
}

/// Adds a share of the change from `old` to `new`.
fn blend(old: &mut [[f64; 3]], share: f64, new: &[[f64; 3]]) {
    for (old, new) in old.as_flattened_mut().iter_mut().zip(new.as_flattened()) {
        *old += share * (new - *old);
    }
}

/// Materials whose largest viscosities rise from a little above the nominal ones by a factor of ten
/// each: their flows lead from that of the nominal viscosities to that of the materials. From the
/// former alone, the iteration is slow where material is at rest.
fn softer(materials: &[Material]) -> Vec<Vec<Material>> {
    let mut out = Vec::new();
    let mut factor = STAGE;
    loop {
        let mut softened = false;
        let stage = materials.iter().cloned().map(|mut m| {
            if let Some(curve) = &mut m.law.curve
                && factor * m.viscosity < curve.largest
            {
                curve.largest = factor * m.viscosity;
                softened = true;
            }
            m
        });
        let stage = stage.collect();
        if !softened {
            return out;
        }
        out.push(stage);
        factor *= STAGE;
    }
}

impl<const D: usize> Stokes<D> {
    /// Solves for the flow of generalised fluids. `flow` holds the initial guess if it is `known`;
    /// otherwise the flow of the nominal viscosities, with which `quadrature` was updated, leads to
    /// the solution. `quadrature` was updated with the same particles and materials.
    ///
    /// # Errors
    /// [`SolveError`] if a matrix is not positive definite, the iteration does not converge, or the
    /// solution is not finite.
    pub fn solve_nonlinear(
        &mut self,
        quadrature: &mut Quadrature,
        matter: Matter,
        loads: Loads<D>,
        stopping: Stopping,
        (flow, known): (&mut Flow<D>, bool),
    ) -> Result<Report, SolveError> {
        if known {
            // In a step, the pressure is extrapolated from earlier ones.
            return self.iterated(quadrature, matter, (loads, stopping, UPDATES), flow);
        }
        self.solve(quadrature, loads, stopping, flow)?;
        let rough = Stopping { nonlinear: ROUGH, ..stopping };
        let (mut iterations, mut corrections) = (0, 0);
        for materials in softer(matter.materials) {
            let softer = Matter { materials: &materials, ..matter };
            let report = self.iterated(quadrature, softer, (loads, rough, u32::MAX), flow)?;
            iterations += report.iterations;
            corrections += report.corrections;
        }
        let mut report = self.iterated(quadrature, matter, (loads, stopping, u32::MAX), flow)?;
        report.iterations += iterations;
        report.corrections += corrections;
        Ok(report)
    }

    /// Iterates from the flow. `most_updates`: largest number of times that the laws take the
    /// pressure of an iterate.
    fn iterated(
        &mut self,
        quadrature: &mut Quadrature,
        matter: Matter,
        (loads, stopping, most_updates): (Loads<D>, Stopping, u32),
        flow: &mut Flow<D>,
    ) -> Result<Report, SolveError> {
        let mut report = Report::default();
        loop {
            let mut work = std::mem::take(&mut self.work);
            let outcome = self.newton(
                quadrature,
                matter,
                (loads, stopping, most_updates),
                (flow, &mut report, &mut work),
            );
            let loosened = self.loosens(&outcome, DIVERGENCE, &work.residual);
            self.work = work;
            if !loosened {
                report.loose = self.loose.count();
                return outcome.map(|()| report);
            }
        }
    }

    fn newton(
        &mut self,
        quadrature: &mut Quadrature,
        matter: Matter,
        (loads, stopping, most_updates): (Loads<D>, Stopping, u32),
        (flow, report, work): (&mut Flow<D>, &mut Report, &mut Work<D>),
    ) -> Result<(), SolveError> {
        self.constraints.impose(&mut flow.velocity);
        let (mut along, mut pressure) = (Flow::default(), flow.pressure.clone());
        // Whether the last correction was computed with the pressure of its flow.
        let mut current = true;
        // Share of the last correction that was applied, and whether laws and residual are those of
        // the flow after it.
        let mut last: Option<(f64, bool)> = None;
        let mut updates = 0;
        loop {
            let clock = Instant::now();
            self.remove_null_space(flow);
            flow.continue_slopes(&self.mesh, loads.weight, &quadrature.mean_viscosity);
            let near = report.decrement.is_some_and(|d| d <= NEAR) && updates < most_updates;
            if near {
                // The pressure may alternate about the solution; the mean of two iterates does not.
                let share = match updates {
                    0 => 1.0,
                    n => RELAXED * (DAMPED_AFTER / f64::from(n)).min(1.0),
                };
                blend(&mut pressure, share, &flow.pressure);
                let Flow { velocity, pressure } = &*flow;
                quadrature.press(
                    share,
                    &self.mesh,
                    &Iterate { mesh: &self.mesh, velocity, pressure },
                );
                updates += 1;
            }
            if near || last.is_none_or(|(_, evaluated)| !evaluated) {
                self.relax(quadrature, matter, flow, &pressure);
                match last {
                    None => {
                        quadrature.align();
                        report.active_rotation = self.assemble(quadrature, loads.terms);
                    }
                    Some((share, _)) => quadrature.turn(share),
                }
                self.residual(quadrature, loads, flow, work);
            } else if let Some((share, _)) = last {
                quadrature.turn(share);
            }
            self.report(&work.residual, loads, flow, report)?;
            let converged = report.has_converged(stopping, quadrature.has_wall_friction());
            report.seconds.solve += clock.elapsed().as_secs_f64();
            if converged && current {
                return self.remove_divergence(quadrature, loads, (flow, report, work));
            }
            if report.iterations == MOST_ITERATIONS {
                let [x, y] = self.largest_residual(&work.residual);
                return Err(SolveError::Nonlinear {
                    iterations: report.iterations,
                    decrement: report.decrement.unwrap_or(f64::INFINITY),
                    x,
                    y,
                });
            }
            let clock = Instant::now();
            if last.is_some() {
                report.active_rotation = self.assemble(quadrature, loads.terms);
            }
            report.seconds.assemble += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            if self.factor.factorize(&self.matrices.blocks).is_err() {
                // Next to rounding, the matrix without the derivatives is the safer one.
                quadrature.softened = false;
                self.assemble(quadrature, loads.terms);
                let mut factored = self.factor.factorize(&self.matrices.blocks);
                if factored.is_err() && self.may_be_dependent() {
                    self.assemble(quadrature, loads.terms);
                    factored = self.factor.factorize(&self.matrices.blocks);
                }
                quadrature.softened = true;
                factored.map_err(|e| self.explain(e))?;
            }
            report.seconds.factor += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            self.correct(quadrature, work);
            report.corrections += 1;
            report.iterations += 1;
            current = near || updates == most_updates;
            let slope = self.slope(work);
            let power = report.dissipation.max(REST * report.power_scale);
            // Where nothing moves, no power tells the error.
            let decrement = if slope == 0.0 { 0.0 } else { (slope.abs() / power).sqrt() };
            report.decrement = Some(decrement);
            quadrature.keep_softening();
            let (share, evaluated) =
                self.search(quadrature, matter, loads, (flow, &pressure, &mut along), work, slope);
            last = Some((share, evaluated));
            add_scaled(&mut flow.velocity, share, &work.correction.velocity);
            add_scaled(&mut flow.pressure, share, &work.correction.pressure);
            report.seconds.solve += clock.elapsed().as_secs_f64();
        }
    }

    /// Removes the divergence that the last correction has left, by corrections with the last
    /// factor that keep the balance of forces.
    fn remove_divergence(
        &mut self,
        quadrature: &Quadrature,
        loads: Loads<D>,
        (flow, report, work): (&mut Flow<D>, &mut Report, &mut Work<D>),
    ) -> Result<(), SolveError> {
        let clock = Instant::now();
        let mut tried = 0;
        work.kept = 0;
        while report.divergence > DIVERGENCE {
            if tried == MOST_PROJECTIONS {
                return Err(self.stalled(&work.residual, report, f64::INFINITY));
            }
            tried += 1;
            work.residual.force.fill([0.0; D]);
            self.correct(quadrature, work);
            self.combine(work, true);
            self.apply(work, flow);
            report.corrections += 1;
            self.residual(quadrature, loads, flow, work);
            self.report(&work.residual, loads, flow, report)?;
        }
        report.seconds.solve += clock.elapsed().as_secs_f64();
        Ok(())
    }

    /// Evaluates the laws at the velocity of a flow and at a pressure.
    fn relax(
        &self,
        quadrature: &mut Quadrature,
        Matter { particles, materials }: Matter,
        flow: &Flow<D>,
        pressure: &[[f64; 3]],
    ) {
        let at = Iterate { mesh: &self.mesh, velocity: &flow.velocity, pressure };
        quadrature.reevaluate(&self.mesh, particles, materials, &at);
    }

    /// `r . du`, the power of the residual with the correction.
    fn slope(&self, work: &Work<D>) -> f64 {
        let (force, du) = (&work.residual.force, &work.correction.velocity);
        let relations = self.constraints.embedding();
        let [slope] = threads::sum(0..self.mesh.nodes(), |node| {
            let bound = |c: usize| relations.is_some_and(|r| r.binds(node, c));
            let free = (0..D).filter(|&c| !bound(c) && !self.constraints.is_fixed(node, c));
            [free.map(|c| force[node][c] * du[node][c]).sum()]
        });
        let Some(relations) = relations else { return slope };
        slope + work.residual.power_on_solids(relations, du)
    }

    /// Share of the correction to be applied, at most one, and whether laws and residual are those
    /// of the flow after it. `slope`: that at the start.
    fn search(
        &mut self,
        quadrature: &mut Quadrature,
        matter: Matter,
        loads: Loads<D>,
        (flow, pressure, along): (&Flow<D>, &[[f64; 3]], &mut Flow<D>),
        work: &mut Work<D>,
        slope: f64,
    ) -> (f64, bool) {
        // Ends of the interval that holds the minimum, with their slopes.
        let (mut low, mut high) = ([0.0, slope], None::<[f64; 2]>);
        let mut share = 1.0;
        for _ in 0..MOST_PROBES {
            along.copy_from(flow);
            add_scaled(&mut along.velocity, share, &work.correction.velocity);
            add_scaled(&mut along.pressure, share, &work.correction.pressure);
            self.relax(quadrature, matter, along, pressure);
            if self.matrices.rotation.iter().any(Option::is_some) {
                self.assemble(quadrature, loads.terms);
            }
            self.residual(quadrature, loads, along, work);
            let here = self.slope(work);
            let fits = here >= -OVERSHOOT * slope.abs()
                && (share == 1.0 || here <= OVERSHOOT * slope.abs());
            // Where the functional does not fall along it, the correction removes a divergence.
            if fits || slope <= 0.0 {
                return (share, true);
            }
            if here < 0.0 || here.is_nan() {
                high = Some([share, here]);
            } else {
                low = [share, here];
            }
            let Some(high) = high else { return (share, true) };
            let [a, b] = [low, high];
            // The secant, kept away from the ends of the interval.
            let secant = a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1]);
            let margin = 0.1 * (b[0] - a[0]);
            share = if secant.is_finite() {
                secant.clamp(a[0] + margin, b[0] - margin)
            } else {
                0.5 * (a[0] + b[0])
            };
        }
        (share, false)
    }

    /// Sets the norms and powers of a residual in the report.
    fn report(
        &self,
        residual: &Residual<D>,
        loads: Loads<D>,
        flow: &Flow<D>,
        report: &mut Report,
    ) -> Result<(), SolveError> {
        (report.residual, report.divergence, _, report.power_scale) =
            self.norms(residual, loads.nodal, flow);
        report.dissipation = residual.dissipation;
        report.restoring = residual.restoring;
        report.power_in = self.power_in(residual, loads.nodal, flow);
        if report.residual.is_finite() && report.divergence.is_finite() {
            Ok(())
        } else {
            Err(SolveError::NonFinite { corrections: report.corrections })
        }
    }
}
