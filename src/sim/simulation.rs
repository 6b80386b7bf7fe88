//! One run at one instant, and its set-up.

use super::clock::{self, Limiter};
use super::error::SimError;
use super::initial;
use super::phases::Phases;
use super::row::Row;
use crate::motion::advect::Displacements;
use crate::motion::frozen_flow::CellVelocities;
use crate::motion::gauges::Counter;
use crate::motion::tracers::DyeLines;
use crate::plan::{Matter, Plan};
use crate::solve::density::Density;
use crate::solve::quadrature::Quadrature;
use crate::solve::report::Report;
use crate::solve::stokes::Stokes;
use crate::solve::terms::Terms;
use crate::space::flow::Flow;
use crate::space::neighbours::{Face, Neighbours, open_faces};
use crate::space::particles::Particles;
use crate::space::population::{Count, Population};
use std::sync::Arc;
use std::time::Instant;

/// A run at one instant. `D` is 2, or 3 with Cosserat rotation; see [`start`] for the choice.
pub struct Simulation<const D: usize> {
    pub(super) plan: Arc<Plan>,
    pub(super) stokes: Stokes<D>,
    pub(super) quadrature: Quadrature,
    /// Of [`Quadrature::factors`]: those that its points were made with.
    pub(super) factors_of_points: Vec<f64>,
    pub(super) density: Density,
    pub(super) terms: Terms,
    /// Those that restoring terms may lie on; none where no scene calls for them.
    pub(super) restoring_faces: Vec<Face>,
    pub(super) particles: Particles,
    pub(super) velocities: CellVelocities,
    /// Cells that a unit velocity of each node may cross per unit time.
    pub(super) crossing_rates: Vec<[f64; 2]>,
    pub(super) displacements: Displacements,
    pub(super) flow: Flow<D>,
    /// The solution before; none at the start and after a sudden change.
    pub(super) previous: Option<Before<D>>,
    /// Room for the solution before the next one.
    pub(super) spare: Flow<D>,
    /// Velocities in the middle of a step, for points to move with.
    pub(super) half: Vec<[f64; 2]>,
    /// Nodal forces that do not change: tractions and fixed body forces.
    pub(super) fixed_load: Vec<[f64; D]>,
    pub(super) load: Vec<[f64; D]>,
    /// The load without gravity's.
    pub(super) other_load: Vec<[f64; D]>,
    pub(super) matter: Matter,
    /// Counts changes of matter, so that constant element matrices know when to change.
    pub(super) version: u32,
    pub(super) next_change: usize,
    pub(super) population: Population,
    pub(super) gauges: Vec<Counter>,
    pub(super) dye: Option<DyeLines>,
    pub(super) count: Count,
    pub(super) time: f64,
    pub(super) step: u64,
    /// Projected areas over particle volumes at the start.
    pub(super) baseline: Vec<f64>,
    pub(super) last_other_power: f64,
    pub(super) row: Row,
    pub(super) report: Report,
    pub(super) events: Vec<String>,
    /// No step may be longer (SI); see [`Run::limit_step`].
    pub(super) longest: Option<f64>,
    /// The step that is being taken, or was.
    pub(super) attempted: f64,
}

/// The solution before the current one, and the step between them.
#[derive(Clone)]
pub(super) struct Before<const D: usize> {
    pub(super) flow: Flow<D>,
    pub(super) dt: f64,
}

impl<const D: usize> Simulation<D> {
    pub fn new(plan: Arc<Plan>) -> Result<Self, SimError> {
        let clock = Instant::now();
        let mesh = plan.mesh.clone();
        let constraints = plan.boundary.constraints::<D>(&mesh, &plan.units);
        let stokes = Stokes::new(mesh.clone(), constraints);
        let population = Population::new(&mesh, &plan.enclosure, plan.method.seeding);
        let particles = initial::particles(&plan)?;
        let fixed_load = plan.fixed_loads::<D>();
        let mut sim = Simulation {
            quadrature: Quadrature::new(&mesh, plan.method.quadrature, plan.state.materials.len()),
            terms: Terms::of(&plan),
            restoring_faces: if plan.method.stabilisation.is_some() {
                open_faces(&mesh, &plan.enclosure)
            } else {
                Vec::new()
            },
            density: Density::new(
                &mesh,
                Neighbours::new(&mesh, &plan.enclosure),
                plan.state.materials.len(),
            ),
            velocities: CellVelocities::new(&mesh, &plan.enclosure),
            crossing_rates: clock::crossing_rates(&mesh),
            displacements: Displacements::default(),
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
            row: Row::empty(plan.state.materials.len()),
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
}
