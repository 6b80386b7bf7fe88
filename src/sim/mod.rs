//! One run: the algorithm of a step, start to end.
//!
//! ```text
//! choose dt                    named limiters
//! velocity of the half step    extrapolated from two solutions, or solved for
//! move particles, dye          Runge-Kutta in the frozen field; walls hold, gauges count
//! turn directors               exact map of the step's velocity gradient
//! control the population       no cell empty or overfull
//! integration points           what each cell's particles say: shares, interface, fields
//! weight, restoring loads      density of each cell; stable strata ahead of time
//! solve                        velocity, rotation, pressure
//! ```

pub mod clock;
mod examine;
pub mod guard;
pub mod initial;
mod measure;
pub mod picture;
pub mod row;
mod sampling;
pub mod state;

use crate::motion::advect;
use crate::motion::carrier::Carrier;
use crate::motion::gauges::Counter;
use crate::motion::tracers::DyeLines;
use crate::plan::boundary::add_body_force;
use crate::plan::{Matter, Plan, Warning, When};
use crate::scene::{Integrator, Quadrature as Rule};
use crate::solve::buoyancy::{Ahead, Restoring};
use crate::solve::multifrontal::Effort;
use crate::solve::quadrature::{EmptyCell, Quadrature};
use crate::solve::stokes::{Loads, Report, SolveError, Stokes, Stopping};
use crate::solve::weight::Weight;
use crate::space::flow::Flow;
use crate::space::neighbours::{Face, Neighbours, open_faces};
use crate::space::particles::Particles;
use crate::space::population::{Count, Population};
use clock::{Limiter, next_step};
pub use examine::{Fault, Place};
use initial::Unfilled;
pub use measure::empty_row;
use row::{Phases, Row};
use state::{State, StateError};
use std::sync::Arc;
use std::time::Instant;

/// Why a run cannot start or go on.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    #[error(transparent)]
    Unfilled(#[from] Unfilled),
    #[error("step {step}, t = {time:.6e} s: {source}")]
    Empty { step: u64, time: f64, source: EmptyCell },
    #[error("step {step}, t = {time:.6e} s: {source}")]
    Solve { step: u64, time: f64, source: SolveError },
    #[error("step {step}, t = {time:.6e} s: the time step has become {dt:.1e} s")]
    Step { step: u64, time: f64, dt: f64 },
    /// The step was taken, but its result cannot be.
    #[error("step {step}, t = {time:.6e} s: {fault}")]
    Fault { step: u64, time: f64, fault: Fault },
    /// Shorter steps do not help either.
    #[error("{source}; the {}", tried(*.cuts))]
    Cut {
        cuts: u32,
        #[source]
        source: Box<SimError>,
    },
}

/// What was tried before a run was given up.
fn tried(cuts: u32) -> String {
    format!("step was taken again {cuts} times, ever shorter, and failed each time")
}

impl SimError {
    /// The field went to infinity or not-a-number.
    pub fn is_non_finite(&self) -> bool {
        match self {
            SimError::Solve { source: SolveError::NonFinite { .. }, .. } => true,
            SimError::Fault { fault, .. } => fault.is_non_finite(),
            SimError::Cut { source, .. } => source.is_non_finite(),
            _ => false,
        }
    }

    /// What the user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            SimError::Unfilled(_) => "see the message",
            SimError::Empty { .. } => {
                "lower time.courant, raise accuracy.particles_per_cell, or give the scene a \
                 background material"
            }
            SimError::Solve { source: SolveError::Stalled { .. }, .. } => {
                "raise accuracy.max_corrections or accuracy.tolerance, or lower the contrast"
            }
            SimError::Solve { source: SolveError::Factor { .. }, .. } => {
                "likely cause: too few integration points (accuracy.quadrature = \"particles\" \
                 with few particles per cell) or a contrast beyond 1e10; use \"mixture\""
            }
            SimError::Solve { source: SolveError::NonFinite { .. }, .. } => {
                "likely cause: an expression that is undefined at some particle, or a contrast \
                 beyond what double precision carries"
            }
            SimError::Step { .. } => {
                "likely cause: a speed that grows without bound; look at the last frames, and \
                 lower accuracy.cells or the contrast"
            }
            SimError::Fault { fault, .. } => fault.remedy(),
            SimError::Cut { source, .. } => source.remedy(),
        }
    }
}

/// A step is taken again, shorter, if its middle crosses this many times the cells it may.
const SURPRISE: f64 = 4.0;

/// A run at one instant. `D` is 2, or 3 with Cosserat rotation; see [`start`] for the choice.
pub struct Simulation<const D: usize> {
    plan: Arc<Plan>,
    stokes: Stokes<D>,
    quadrature: Quadrature,
    /// Of [`Quadrature::factors`]: those that its points were made with.
    factors_of_points: Vec<f64>,
    weight: Weight,
    restoring: Restoring,
    /// Those that restoring terms may lie on; none where no scene calls for them.
    restoring_faces: Vec<Face>,
    particles: Particles,
    flow: Flow<D>,
    /// The solution before; none at the start and after a sudden change.
    previous: Option<Before<D>>,
    /// Nodal forces that do not change: tractions and fixed body forces.
    fixed_load: Vec<[f64; D]>,
    load: Vec<[f64; D]>,
    /// The load without gravity's.
    other_load: Vec<[f64; D]>,
    matter: Matter,
    /// Counts changes of matter, so that constant element matrices know when to change.
    version: u32,
    next_change: usize,
    population: Population,
    gauges: Vec<Counter>,
    dye: Option<DyeLines>,
    count: Count,
    time: f64,
    step: u64,
    /// Projected areas over particle volumes at the start.
    baseline: Vec<f64>,
    last_other_power: f64,
    row: Row,
    report: Report,
    events: Vec<String>,
    /// No step may be longer (SI); see [`Run::limit_step`].
    longest: Option<f64>,
    /// The step that is being taken, or was.
    attempted: f64,
}

/// A run whose number of unknowns per node was decided by its plan.
pub trait Run: Send {
    /// Takes one step.
    fn step(&mut self) -> Result<(), SimError>;
    fn is_finished(&self) -> bool;
    /// Diagnostics of the current state.
    fn row(&self) -> &Row;
    fn plan(&self) -> &Plan;
    fn particles(&self) -> &Particles;
    /// Velocity and rotation (zero if none is solved), m/s and 1/s, at an SI point.
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3];
    /// Pa
    fn pressure_at(&self, p: [f64; 2]) -> f64;
    /// What the recording shows of the current state.
    fn picture(&self) -> crate::frame::Picture;
    /// SHA-256 over the bits of the particle state.
    fn state_hash(&self) -> String;
    /// Unknowns of the solver: velocity and rotation, pressure.
    fn unknowns(&self) -> [usize; 2];
    /// What the last factorisation took.
    fn factor_effort(&self) -> Effort;
    /// Lets the next factorisation compute all of the factor, changed or not: for measurements.
    fn forget_factor(&mut self);
    fn count(&self) -> Count;
    /// Warnings that arose while running.
    fn warnings(&self) -> Vec<Warning>;
    /// What happened in the last step: changes of matter.
    fn events(&self) -> &[String];
    /// How many of the plan's changes lie behind.
    fn changes_applied(&self) -> usize;
    /// Goes on with another plan, made by [`Plan::with_change`]: the two share all that lies behind.
    fn replan(&mut self, plan: Arc<Plan>);
    /// Everything that the next step depends on.
    fn state(&self) -> State;
    /// Goes on from a state of a run of the same plan, to the last bit as that one would.
    fn restore(&mut self, state: &State) -> Result<(), StateError>;
    /// Steps may be no longer than this (s) until told otherwise.
    fn limit_step(&mut self, longest: Option<f64>);
    /// Length of the step that was taken or tried last, s.
    fn attempted_step(&self) -> f64;
    /// The first thing about the present state that cannot be.
    fn examine(&self) -> Result<(), Fault>;
}

/// The solution before the current one, and the step between them.
#[derive(Clone)]
struct Before<const D: usize> {
    flow: Flow<D>,
    dt: f64,
}

/// Velocity and rotation (zero if none is solved) of a flow, m/s and 1/s, at an SI point.
pub fn velocity_at<const D: usize>(plan: &Plan, flow: &Flow<D>, p: [f64; 2]) -> [f64; 3] {
    let u = &plan.units;
    let v = flow.at(&plan.mesh, p.map(|c| c / u.length));
    let w = if D == 3 { v[D - 1] * u.rate() } else { 0.0 };
    [v[0] * u.velocity(), v[1] * u.velocity(), w]
}

/// Pressure of a flow, Pa, at an SI point.
pub fn pressure_at<const D: usize>(plan: &Plan, flow: &Flow<D>, p: [f64; 2]) -> f64 {
    let u = &plan.units;
    flow.pressure_at(&plan.mesh, p.map(|c| c / u.length)) * u.stress()
}

/// Sets a plan up and solves its first instant.
pub fn start(plan: Arc<Plan>) -> Result<Box<dyn Run>, SimError> {
    if plan.effects.rotation {
        Ok(Box::new(Simulation::<3>::new(plan)?))
    } else {
        Ok(Box::new(Simulation::<2>::new(plan)?))
    }
}

impl<const D: usize> Simulation<D> {
    pub fn new(plan: Arc<Plan>) -> Result<Self, SimError> {
        let clock = Instant::now();
        let mesh = plan.mesh.clone();
        let constraints = plan.boundary.constraints::<D>(&mesh, &plan.units);
        let stokes = Stokes::new(mesh.clone(), constraints);
        let population = Population::new(&mesh, &plan.enclosure, plan.method.seeding);
        let particles = initial::particles(&plan)?;
        let mut fixed_load = vec![[0.0; D]; mesh.nodes()];
        plan.boundary.add_tractions(&mesh, &plan.units, &mut fixed_load);
        if let Some(f) = &plan.body_force {
            add_body_force(&mesh, &plan.units, f, &mut fixed_load);
        }
        let mut sim = Simulation {
            quadrature: Quadrature::new(&mesh, plan.method.quadrature, plan.state.materials.len()),
            restoring: Restoring::default(),
            restoring_faces: if plan.method.stabilisation.is_some() {
                open_faces(&mesh, &plan.enclosure)
            } else {
                Vec::new()
            },
            weight: Weight::new(
                &mesh,
                Neighbours::new(&mesh, &plan.enclosure),
                plan.state.materials.len(),
            ),
            flow: Flow::zero(&mesh),
            previous: None,
            load: fixed_load.clone(),
            other_load: fixed_load.clone(),
            fixed_load,
            matter: plan.state.clone(),
            version: 0,
            next_change: 0,
            population,
            gauges: plan.gauges.iter().cloned().map(Counter::new).collect(),
            dye: plan.tracers.as_ref().map(DyeLines::new),
            count: Count::default(),
            time: 0.0,
            step: 0,
            baseline: vec![],
            last_other_power: 0.0,
            row: measure::empty_row(&plan),
            report: Report::default(),
            events: vec![],
            longest: None,
            attempted: 0.0,
            factors_of_points: vec![],
            particles,
            stokes,
            plan,
        };
        sim.apply_changes();
        let mut seconds = Phases::default();
        sim.solve(None, &mut seconds)?;
        sim.baseline = sim.projected_shares();
        sim.measure(0.0, Limiter::Start, seconds, sim.report.corrections, clock);
        Ok(sim)
    }

    pub fn flow(&self) -> &Flow<D> {
        &self.flow
    }
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Takes one step.
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
        let mut extra = 0;
        let half = loop {
            self.attempted = dt;
            if dt.is_nan() || self.time + dt <= self.time {
                let dt = dt * self.plan.units.time;
                return Err(SimError::Step { step: self.step + 1, time: self.si_time(), dt });
            }
            let (half, corrections) = self.half_step_velocity(dt, &mut seconds)?;
            extra += corrections;
            // A flow that has hardly begun says nothing about its own middle of the step.
            let crossed = dt * self.crossings(|node| half[node]);
            let most = self.plan.clock.courant;
            if crossed <= SURPRISE * most {
                break half;
            }
            (dt, limiter) = (dt * (most / crossed), Limiter::Courant);
        };

        let phase = Instant::now();
        let plan = self.plan.clone();
        let compliant = self.compliant();
        let parts = self.parts(&half, dt);
        let carrier = Carrier::new(&plan.mesh, &plan.enclosure, &half, dt / f64::from(parts));
        for _ in 0..parts {
            advect::advance(
                &carrier,
                &mut self.particles,
                &plan.effects,
                &compliant,
                &mut self.gauges,
                &mut self.count,
            );
            if let Some(dye) = &mut self.dye {
                let phase = Instant::now();
                dye.advance(&carrier);
                seconds.dye += phase.elapsed().as_secs_f64();
            }
        }
        seconds.motion += phase.elapsed().as_secs_f64() - seconds.dye;
        let phase = Instant::now();
        self.population.control(&plan.mesh, &mut self.particles, &mut self.count);
        seconds.population += phase.elapsed().as_secs_f64();

        self.time = if limiter == Limiter::Stop { self.next_stop() } else { self.time + dt };
        self.step += 1;
        let changed = self.apply_changes();
        let before = self.flow.clone();
        // After a sudden change the flow before says nothing about the one to come.
        let ahead = (!changed).then(|| self.ahead(self.expected_step(dt)));
        if let (Some(previous), false) = (&self.previous, changed) {
            self.flow.extrapolate(&previous.flow, dt / previous.dt);
        }
        self.solve(ahead.flatten().map(|t| (t, before.translation())), &mut seconds)?;
        self.previous = (!changed).then_some(Before { flow: before, dt });
        self.measure(dt, limiter, seconds, extra + self.report.corrections, clock);
        Ok(())
    }

    /// Materials whose particles change their volume.
    fn compliant(&self) -> Vec<bool> {
        self.matter.materials.iter().map(|m| m.compliance > 0.0).collect()
    }

    /// Parts in which points go through a velocity frozen for `dt`: one as long as none crosses
    /// more than a cell, else parts of half a cell, for longer ways would crowd and thin out what a
    /// flow without divergence keeps apart.
    fn parts(&self, velocity: &[[f64; 2]], dt: f64) -> u32 {
        let crossed = dt * self.crossings(|node| velocity[node]);
        if crossed > 1.0 { (2.0 * crossed).ceil().min(1e4) as u32 } else { 1 }
    }

    fn si_time(&self) -> f64 {
        self.time * self.plan.units.time
    }

    fn next_stop(&self) -> f64 {
        let clock = &self.plan.clock;
        let later = |&&s: &&f64| s > self.time * (1.0 + 1e-14);
        clock.stops.iter().find(later).copied().unwrap_or(clock.end)
    }

    /// Velocity in the middle of a step of `dt`, and corrections spent on it.
    fn half_step_velocity(
        &mut self,
        dt: f64,
        seconds: &mut Phases,
    ) -> Result<(Vec<[f64; 2]>, u32), SimError> {
        let now = self.flow.translation();
        match (self.plan.method.integrator, &self.previous) {
            (Integrator::Euler, _) => Ok((now, 0)),
            (Integrator::Extrapolated, Some(before)) => {
                let f = 0.5 * dt / before.dt;
                let half = now
                    .iter()
                    .zip(&before.flow.velocity)
                    .map(|(u, b)| [u[0] + f * (u[0] - b[0]), u[1] + f * (u[1] - b[1])])
                    .collect();
                Ok((half, 0))
            }
            (Integrator::Extrapolated | Integrator::Midpoint, _) => {
                self.solve_half_step(dt, now, seconds)
            }
        }
    }

    /// Moves a copy of the particles half a step and solves there.
    fn solve_half_step(
        &mut self,
        dt: f64,
        now: Vec<[f64; 2]>,
        seconds: &mut Phases,
    ) -> Result<(Vec<[f64; 2]>, u32), SimError> {
        let plan = self.plan.clone();
        let phase = Instant::now();
        let mut ahead = self.particles.clone();
        let compliant = self.compliant();
        let parts = self.parts(&now, 0.5 * dt);
        let carrier = Carrier::new(&plan.mesh, &plan.enclosure, &now, 0.5 * dt / f64::from(parts));
        let mut ignored = Count::default();
        for _ in 0..parts {
            advect::advance(&carrier, &mut ahead, &plan.effects, &compliant, &mut [], &mut ignored);
        }
        self.population.control(&plan.mesh, &mut ahead, &mut ignored);
        seconds.motion += phase.elapsed().as_secs_f64();
        let here = std::mem::replace(&mut self.particles, ahead);
        let flow = self.flow.clone();
        // At the first step a mode must at worst turn round: half a step ahead, neither more nor
        // less, makes that the trapezoidal rule.
        let ahead = self.ahead(dt).map(|t| if self.previous.is_none() { 0.5 * dt } else { t });
        let solved = self.solve(ahead.map(|t| (t, now)), seconds);
        let half = std::mem::replace(&mut self.flow, flow).translation();
        self.particles = here;
        solved?;
        Ok((half, self.report.corrections))
    }

    /// Applies the changes of matter that are due; whether there were any.
    fn apply_changes(&mut self) -> bool {
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
            // A change of gravity does work on everything at once.
            let jump = self.potential_energy() - before;
            self.row.work += jump * self.plan.units.energy();
            self.events.push(format!("step {}: {}", self.step, change.label));
            self.version += 1;
            self.next_change += 1;
            any = true;
        }
        any
    }

    /// How far ahead restoring loads are taken, for a step of `dt`.
    fn ahead(&self, dt: f64) -> Option<f64> {
        let share = self.plan.method.stabilisation.filter(|_| self.matter.is_stratified());
        share.map(|share| share * dt)
    }

    /// The step to come, as far as the flow before and the step before can tell.
    fn expected_step(&self, dt: f64) -> f64 {
        let (next, _) = next_step(&self.plan.clock, self.time, Some(dt), self.speeds());
        if next > 0.0 { next } else { dt }
    }

    /// Solves for the flow of the particles where they are. `restoring`: how far ahead restoring
    /// loads are taken, and the velocity before.
    fn solve(
        &mut self,
        restoring: Option<(f64, Vec<[f64; 2]>)>,
        seconds: &mut Phases,
    ) -> Result<(), SimError> {
        let plan = self.plan.clone();
        let phase = Instant::now();
        let (step, time) = (self.step, self.si_time());
        self.factors_of_points = self.quadrature.factors().to_vec();
        self.quadrature
            .update(&plan.mesh, &self.particles, &self.matter.materials, self.version)
            .map_err(|mut source| {
            source.x *= plan.units.length;
            source.y *= plan.units.length;
            SimError::Empty { step, time, source }
        })?;
        seconds.quadrature += phase.elapsed().as_secs_f64();
        let phase = Instant::now();
        self.update_load();
        self.update_restoring(restoring);
        seconds.weight += phase.elapsed().as_secs_f64();
        let stopping = Stopping {
            tolerance: plan.method.tolerance,
            max_corrections: plan.method.max_corrections,
        };
        let loads = Loads { nodal: &self.load, restoring: &self.restoring };
        self.report =
            self.stokes.solve(&self.quadrature, loads, stopping, &mut self.flow).map_err(
                |source| SimError::Solve { step, time, source: source.scaled(plan.units.length) },
            )?;
        seconds.assemble += self.report.seconds.assemble;
        seconds.factor += self.report.seconds.factor;
        seconds.solve += self.report.seconds.solve;
        Ok(())
    }

    fn update_restoring(&mut self, restoring: Option<(f64, Vec<[f64; 2]>)>) {
        match restoring {
            Some((ahead, before)) => {
                // First-order stepping has no other use for the velocity before.
                let before = match self.plan.method.integrator {
                    Integrator::Euler => vec![[0.0; 2]; before.len()],
                    Integrator::Extrapolated | Integrator::Midpoint => before,
                };
                let (means, slopes) = (self.weight.means(), self.weight.slopes());
                let viscosities = self.matter.materials.iter().map(|m| m.viscosity);
                let ahead = Ahead {
                    gravity: self.matter.gravity,
                    time: ahead,
                    weakest: viscosities.fold(f64::INFINITY, f64::min),
                };
                let mesh = &self.plan.mesh;
                let density = (means.as_slice(), slopes.as_slice());
                self.restoring.update(mesh, &self.restoring_faces, density, ahead, before);
            }
            None => self.restoring.clear(),
        }
    }

    fn update_load(&mut self) {
        let plan = self.plan.clone();
        if !plan.effects.gravity && plan.acceleration.is_none() {
            return;
        }
        self.load.copy_from_slice(&self.fixed_load);
        let mesh = &plan.mesh;
        self.weight.update(mesh, &self.particles, &self.matter.materials, &self.quadrature);
        if let Some(acceleration) = &plan.acceleration {
            self.add_weight(|[x, y]| acceleration.each_ref().map(|a| a.at(x, y)));
        }
        self.other_load.copy_from_slice(&self.load);
        let g = self.matter.gravity.map(|g| g * plan.units.acceleration());
        self.add_weight(|_| g);
    }

    /// Adds `integral density a N` for an acceleration in SI units and coordinates.
    fn add_weight(&mut self, acceleration: impl Fn([f64; 2]) -> [f64; 2]) {
        let plan = self.plan.clone();
        let (mesh, unit) = (&plan.mesh, plan.units.acceleration());
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            let area = mesh.cell_area(cell);
            let mut force = [[0.0; 2]; 9];
            let mut add = |mass: f64, r: [f64; 2], n: &[f64; 9]| {
                let a = acceleration(plan.si(mesh.from_reference(cell, r)));
                for (force, n) in force.iter_mut().zip(n) {
                    force[0] += area * mass * n * a[0] / unit;
                    force[1] += area * mass * n * a[1] / unit;
                }
            };
            match plan.method.quadrature {
                Rule::Mixture | Rule::Laminate => self.weight.for_points(cell, &mut add),
                Rule::Particles => self.quadrature.for_points(cell, |p, shape| {
                    add(p.weight * p.density, p.r, &shape.n);
                }),
            }
            for (a, node) in mesh.cell_nodes(cell).into_iter().enumerate() {
                self.load[node][0] += force[a][0];
                self.load[node][1] += force[a][1];
            }
        }
    }
}

impl<const D: usize> Run for Simulation<D> {
    fn step(&mut self) -> Result<(), SimError> {
        self.advance()
    }
    fn is_finished(&self) -> bool {
        self.time >= self.plan.clock.end * (1.0 - 1e-12)
    }
    fn row(&self) -> &Row {
        &self.row
    }
    fn plan(&self) -> &Plan {
        &self.plan
    }
    fn particles(&self) -> &Particles {
        &self.particles
    }
    fn velocity_at(&self, p: [f64; 2]) -> [f64; 3] {
        velocity_at(&self.plan, &self.flow, p)
    }
    fn pressure_at(&self, p: [f64; 2]) -> f64 {
        pressure_at(&self.plan, &self.flow, p)
    }
    fn picture(&self) -> crate::frame::Picture {
        self.draw()
    }
    fn state_hash(&self) -> String {
        measure::hash(&self.particles)
    }
    fn unknowns(&self) -> [usize; 2] {
        [self.stokes.unknowns(), 3 * self.plan.mesh.cells()]
    }
    fn factor_effort(&self) -> Effort {
        self.stokes.effort()
    }
    fn forget_factor(&mut self) {
        self.stokes.forget_factor();
    }
    fn count(&self) -> Count {
        self.count
    }
    fn warnings(&self) -> Vec<Warning> {
        let mut list = Vec::new();
        if self.count.healed > 0 {
            list.push(Warning::CellsHealed { count: self.count.healed });
        }
        if let Some(dye) = self.dye.as_ref().filter(|d| d.is_full()) {
            list.push(Warning::DyeCoarse { points: dye.points() });
        }
        list
    }
    fn events(&self) -> &[String] {
        &self.events
    }
    fn changes_applied(&self) -> usize {
        self.next_change
    }
    fn replan(&mut self, plan: Arc<Plan>) {
        self.plan = plan;
    }
    fn state(&self) -> State {
        self.save()
    }
    fn restore(&mut self, state: &State) -> Result<(), StateError> {
        self.load(state)
    }
    fn limit_step(&mut self, longest: Option<f64>) {
        self.longest = longest;
    }
    fn attempted_step(&self) -> f64 {
        self.attempted * self.plan.units.time
    }
    fn examine(&self) -> Result<(), Fault> {
        self.find_fault()
    }
}
