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

use crate::motion::advect::{self, Journeys};
use crate::motion::carrier::{Carrier, Currents};
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
    currents: Currents,
    /// Cells that a unit velocity of each node may cross per unit time.
    crossing_rates: Vec<[f64; 2]>,
    journeys: Journeys,
    flow: Flow<D>,
    /// The solution before; none at the start and after a sudden change.
    previous: Option<Before<D>>,
    /// Room for the solution before the next one.
    spare: Flow<D>,
    /// Velocities in the middle of a step, for points to move with.
    half: Vec<[f64; 2]>,
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
    /// Writes everything that the next step depends on, over what a run of the same plan wrote before.
    fn save(&self, state: &mut State);
    /// The same, on its own.
    fn state(&self) -> State {
        let mut state = State::default();
        self.save(&mut state);
        state
    }
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
            currents: Currents::new(&mesh, &plan.enclosure),
            crossing_rates: measure::crossing_rates(&mesh),
            journeys: Journeys::default(),
            flow: Flow::zero(&mesh),
            previous: None,
            spare: Flow::zero(&mesh),
            half: Vec::new(),
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
        sim.baseline = (0..sim.matter.materials.len()).map(|m| sim.projected_share(m)).collect();
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
        loop {
            self.attempted = dt;
            if dt.is_nan() || self.time + dt <= self.time {
                let dt = dt * self.plan.units.time;
                return Err(SimError::Step { step: self.step + 1, time: self.si_time(), dt });
            }
            extra += self.find_half_step_velocity(dt, &mut seconds)?;
            // A flow that has hardly begun says nothing about its own middle of the step.
            let crossed = dt * self.crossings(|node| self.half[node]);
            let most = self.plan.clock.courant;
            if crossed <= SURPRISE * most {
                break;
            }
            (dt, limiter) = (dt * (most / crossed), Limiter::Courant);
        }

        let phase = Instant::now();
        let plan = self.plan.clone();
        let parts = self.parts(dt);
        let Simulation { currents, half, matter, .. } = self;
        let compliant = |m: u8| matter.materials[usize::from(m)].compliance > 0.0;
        let part = dt / f64::from(parts);
        let carrier = Carrier::new(&plan.mesh, &plan.enclosure, currents, half, part);
        for _ in 0..parts {
            advect::advance(
                &carrier,
                &mut self.particles,
                &mut self.journeys,
                &plan.effects,
                compliant,
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
        let mut before = std::mem::take(&mut self.spare);
        before.copy_from(&self.flow);
        // After a sudden change the flow before says nothing about the one to come.
        let ahead = (!changed).then(|| self.ahead(self.expected_step(dt)));
        if let (Some(previous), false) = (&self.previous, changed) {
            self.flow.extrapolate(&previous.flow, dt / previous.dt);
        }
        let solved = self.solve(ahead.flatten().map(|t| (t, &before)), &mut seconds);
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

    /// Parts in which points go through a velocity frozen for `dt`: one as long as none crosses
    /// more than a cell, else parts of half a cell, for longer ways would crowd and thin out what a
    /// flow without divergence keeps apart.
    fn parts(&self, dt: f64) -> u32 {
        let crossed = dt * self.crossings(|node| self.half[node]);
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

    /// Finds the velocity in the middle of a step of `dt`; corrections spent on it.
    fn find_half_step_velocity(&mut self, dt: f64, seconds: &mut Phases) -> Result<u32, SimError> {
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

    /// Moves a copy of the particles half a step with the velocity in `half`, solves there, and leaves
    /// that velocity in `half`.
    fn solve_half_step(&mut self, dt: f64, seconds: &mut Phases) -> Result<u32, SimError> {
        let plan = self.plan.clone();
        let phase = Instant::now();
        let mut there = self.particles.clone();
        let parts = self.parts(0.5 * dt);
        let Simulation { currents, half, matter, journeys, .. } = self;
        let compliant = |m: u8| matter.materials[usize::from(m)].compliance > 0.0;
        let part = 0.5 * dt / f64::from(parts);
        let carrier = Carrier::new(&plan.mesh, &plan.enclosure, currents, half, part);
        let (effects, no_gauges, mut ignored) = (&plan.effects, &mut [], Count::default());
        for _ in 0..parts {
            advect::advance(
                &carrier,
                &mut there,
                journeys,
                effects,
                compliant,
                no_gauges,
                &mut ignored,
            );
        }
        self.population.control(&plan.mesh, &mut there, &mut ignored);
        seconds.motion += phase.elapsed().as_secs_f64();
        let here = std::mem::replace(&mut self.particles, there);
        let flow = self.flow.clone();
        // At the first step a mode must at worst turn round: half a step ahead, neither more nor
        // less, makes that the trapezoidal rule.
        let ahead = self.ahead(dt).map(|t| if self.previous.is_none() { 0.5 * dt } else { t });
        let solved = self.solve(ahead.map(|t| (t, &flow)), seconds);
        std::mem::replace(&mut self.flow, flow).translation(&mut self.half);
        self.particles = here;
        solved?;
        Ok(self.report.corrections)
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
        restoring: Option<(f64, &Flow<D>)>,
        seconds: &mut Phases,
    ) -> Result<(), SimError> {
        let plan = self.plan.clone();
        let phase = Instant::now();
        let (step, time) = (self.step, self.si_time());
        self.factors_of_points.clear();
        self.factors_of_points.extend_from_slice(self.quadrature.factors());
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

    fn update_restoring(&mut self, restoring: Option<(f64, &Flow<D>)>) {
        let Some((ahead, before)) = restoring else { return self.restoring.clear() };
        // First-order stepping has no other use for the velocity before.
        let still = self.plan.method.integrator == Integrator::Euler;
        let before = before.velocity.iter().map(|u| if still { [0.0; 2] } else { [u[0], u[1]] });
        let viscosities = self.matter.materials.iter().map(|m| m.viscosity);
        let ahead = Ahead {
            gravity: self.matter.gravity,
            time: ahead,
            weakest: viscosities.fold(f64::INFINITY, f64::min),
        };
        let mesh = &self.plan.mesh;
        self.restoring.update(mesh, &self.restoring_faces, &self.weight, ahead, before);
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
        self.add_gravity();
    }

    /// Adds `integral density g N`.
    fn add_gravity(&mut self) {
        let Simulation { plan, weight, quadrature, load, matter, .. } = self;
        let (mesh, g) = (&plan.mesh, matter.gravity);
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            let area = mesh.cell_area(cell);
            let mut mass = [0.0; 9];
            match plan.method.quadrature {
                Rule::Mixture | Rule::Laminate => mass = weight.nodal_masses(cell),
                Rule::Particles => quadrature.for_points(cell, |p, shape| {
                    for (mass, n) in mass.iter_mut().zip(&shape.n) {
                        *mass += p.weight * p.density * n;
                    }
                }),
            }
            for (node, mass) in mesh.cell_nodes(cell).into_iter().zip(mass) {
                load[node][0] += area * mass * g[0];
                load[node][1] += area * mass * g[1];
            }
        }
    }

    /// Adds `integral density a N` for an acceleration in SI units and coordinates.
    fn add_weight(&mut self, acceleration: impl Fn([f64; 2]) -> [f64; 2]) {
        let Simulation { plan, weight, quadrature, load, .. } = self;
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
                Rule::Mixture | Rule::Laminate => weight.for_points(cell, &mut add),
                Rule::Particles => quadrature.for_points(cell, |p, shape| {
                    add(p.weight * p.density, p.r, &shape.n);
                }),
            }
            for (node, force) in mesh.cell_nodes(cell).into_iter().zip(force) {
                load[node][0] += force[0];
                load[node][1] += force[1];
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
    fn save(&self, state: &mut State) {
        Simulation::save(self, state);
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
