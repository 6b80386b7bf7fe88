//! This module holds the data of a run at its current time, and creates them from a plan.

use super::clock::{self, Limiter};
use super::error::SimError;
use super::inertia::Inertia;
use super::initial;
use super::interest::Interest;
use super::phases::Phases;
use super::reach::Reach;
use super::row::Row;
use crate::composition::fill::Fill;
use crate::motion::advect::Displacements;
use crate::motion::frozen_flow::CellVelocities;
use crate::motion::gauges::Counter;
use crate::motion::inflow::Inflow;
use crate::motion::tracers::DyeLines;
use crate::plan::{Matter, Plan, Pose, Warning};
use crate::scene::Quadrature as Rule;
use crate::solve::density::Density;
use crate::solve::quadrature::Quadrature;
use crate::solve::report::Report;
use crate::solve::stokes::Stokes;
use crate::solve::terms::Terms;
use crate::space::count::{Count, Crossing};
use crate::space::flow::Flow;
use crate::space::neighbours::{Face, Neighbours, open_faces};
use crate::space::particles::Particles;
use crate::space::population::Population;
use std::sync::Arc;
use std::time::Instant;

/// A run at its current time, in the plan's units. `D` is the number of unknowns per node, 2
/// velocities or 3 with Cosserat rotation; [`start`](super::start) chooses it.
pub struct Simulation<const D: usize> {
    pub(super) plan: Arc<Plan>,
    /// Places of the blocks that move at the current time.
    pub(super) standing: Vec<Pose>,
    /// Nodes at and in the solids that move; empty without any.
    pub(super) reach: Reach,
    pub(super) stokes: Stokes<D>,
    pub(super) quadrature: Quadrature,
    /// Volume factors of the materials with which the current integration points were made.
    pub(super) factors_of_points: Vec<f64>,
    pub(super) density: Density,
    pub(super) terms: Terms,
    /// Faces on which restoring terms may act; empty without stabilisation.
    pub(super) restoring_faces: Vec<Face>,
    pub(super) particles: Particles,
    pub(super) velocities: CellVelocities,
    /// Nodes whose motion determines the time step.
    pub(super) interest: Interest,
    /// Step at which the displacement error reaches its tolerance, in the plan's units; `None`
    /// before the first step.
    pub(super) tolerated: Option<f64>,
    /// Cells that a unit velocity at each node crosses per unit time, by direction.
    pub(super) crossing_rates: Vec<[f64; 2]>,
    pub(super) displacements: Displacements,
    pub(super) flow: Flow<D>,
    /// The previous solution; `None` at the start and after a scheduled change.
    pub(super) previous: Option<Before<D>>,
    /// Buffer for the next previous solution.
    pub(super) spare: Flow<D>,
    /// Nodal velocities at the middle of the step, with which points are advected.
    pub(super) half: Vec<[f64; 2]>,
    /// Constant nodal forces: tractions and body forces fixed in space.
    pub(super) fixed_load: Vec<[f64; D]>,
    /// Nodal forces of the current solution.
    pub(super) load: Vec<[f64; D]>,
    /// Momentum of the last steps, if inertia is solved.
    pub(super) inertia: Option<Inertia>,
    /// Nodal forces of the momentum of the last steps; empty without inertia.
    pub(super) momentum: Vec<[f64; D]>,
    /// Nodal forces without gravity.
    pub(super) other_load: Vec<[f64; D]>,
    /// Current materials and gravity.
    pub(super) matter: Matter,
    /// Number of changes of matter so far; constant element matrices are recomputed when it
    /// changes.
    pub(super) version: u32,
    /// Index of the next scheduled change.
    pub(super) next_change: usize,
    pub(super) population: Population,
    /// Which of the plan's sources are on.
    pub(super) sources_on: Vec<bool>,
    /// Faces through which material enters, if there are any.
    pub(super) inflow: Option<Inflow>,
    pub(super) gauges: Vec<Counter>,
    pub(super) dye: Option<DyeLines>,
    pub(super) count: Count,
    /// Current time, in the plan's units.
    pub(super) time: f64,
    /// Number of steps taken.
    pub(super) step: u64,
    /// Projected area over particle volume of each material at the start.
    pub(super) baseline: Vec<f64>,
    /// Power of all loads except gravity at the last row, W/m.
    pub(super) last_other_power: f64,
    /// Energy lost and energy dissipated in the last steps, J/m, later steps weighted more.
    pub(super) recent_energy: [f64; 2],
    /// Time integrals of volumes, in the plan's units: of the grains that flow at an inertial number
    /// outside the well-posed range and have no internal length, and of all grains that flow.
    pub(super) flowed: [f64; 2],
    /// Number of solutions with cells that did not keep their volume, and the largest number of such
    /// cells.
    pub(super) loosened: [u64; 2],
    /// Place (m) and time (s) at which material enclosed a void first.
    pub(super) trapped_void: Option<[f64; 3]>,
    /// Potential energy at the start, J/m.
    pub(super) first_energy: f64,
    /// What has crossed the sides and is not yet counted.
    pub(super) crossings: Vec<Crossing>,
    pub(super) row: Row,
    pub(super) report: Report,
    /// Forces of the materials on the supports, by node; empty without gauges of forces.
    pub(super) reactions: Vec<[f64; D]>,
    pub(super) events: Vec<String>,
    /// Warnings about the initial state.
    pub(super) notes: Vec<Warning>,
    /// Largest step, s; see [`Run::limit_step`](super::Run::limit_step).
    pub(super) longest: Option<f64>,
    /// Length of the current or last step, in the plan's units.
    pub(super) attempted: f64,
}

/// The previous solution, and the length of the step from it to the current one.
#[derive(Clone)]
pub(super) struct Before<const D: usize> {
    pub(super) flow: Flow<D>,
    pub(super) dt: f64,
}

impl<const D: usize> Simulation<D> {
    /// Creates the initial particles of a plan and solves for the initial flow.
    ///
    /// # Errors
    /// A part of the scene has no material, or the initial flow cannot be solved for.
    pub fn new(plan: Arc<Plan>) -> Result<Self, SimError> {
        let clock = Instant::now();
        let mesh = plan.mesh.clone();
        let sources_on = plan.sources_on(0.0);
        let constraints = plan.constraints_while::<D>(&sources_on);
        let mut quadrature =
            Quadrature::new(&mesh, plan.rule_of_cells(), plan.state.materials.len());
        quadrature.bind_walls(|cell| constraints.fixed_sides(&mesh, cell));
        quadrature.bind_slip(&mesh, &plan.boundary, &plan.units);
        if let Some(void) = plan.void() {
            let fill = Fill::new(usize::from(void), plan.effects.inertia, mesh.cells());
            quadrature.composition_mut().leave_void(fill);
        }
        let stokes = Stokes::new(mesh.clone(), constraints);
        let population =
            Population::new(&mesh, &plan.enclosure, plan.method.seeding, plan.around());
        let (particles, empty) = initial::particles(&plan)?;
        let fixed_load = plan.fixed_loads::<D>();
        let mut sim = Simulation {
            quadrature,
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
                plan.effects.inertia,
            ),
            velocities: CellVelocities::new(
                &mesh,
                &plan.enclosure,
                plan.rule_of_cells() == Rule::Sides,
            ),
            interest: Interest::default(),
            tolerated: None,
            crossing_rates: clock::crossing_rates(&mesh),
            displacements: Displacements::default(),
            flow: Flow::zero(&mesh),
            previous: None,
            spare: Flow::zero(&mesh),
            half: Vec::new(),
            load: fixed_load.clone(),
            other_load: fixed_load.clone(),
            inertia: plan.effects.inertia.then(|| Inertia::new(&plan)),
            momentum: vec![],
            fixed_load,
            matter: plan.state.clone(),
            version: 0,
            next_change: 0,
            population,
            inflow: Inflow::new(&plan),
            sources_on,
            gauges: plan.gauges.iter().cloned().map(Counter::new).collect(),
            dye: plan.tracers.as_ref().map(DyeLines::new),
            count: Count::default(),
            time: 0.0,
            step: 0,
            baseline: vec![],
            last_other_power: 0.0,
            flowed: [0.0; 2],
            loosened: [0; 2],
            trapped_void: None,
            first_energy: 0.0,
            crossings: Vec::new(),
            recent_energy: [0.0; 2],
            row: Row::empty(plan.state.materials.len()),
            report: Report::default(),
            reactions: vec![],
            events: vec![],
            notes: vec![],
            longest: None,
            attempted: 0.0,
            factors_of_points: vec![],
            standing: plan.poses.clone(),
            reach: Reach::of(&plan),
            particles,
            stokes,
            plan,
        };
        sim.apply_changes();
        let mut seconds = Phases::default();
        sim.start_moving(&mut seconds)?;
        sim.solve(None, &mut seconds)?;
        if let Some(inertia) = &mut sim.inertia {
            // A flow that sides set in motion at once has unbounded accelerations beside them: the first
            // step does not use them.
            let regular = !sim.stokes.is_driven();
            inertia.begin(&sim.plan, regular, &sim.flow);
        }
        sim.baseline = (0..sim.matter.materials.len()).map(|m| sim.projected_share(m)).collect();
        sim.notes = sim.initial_notes(empty);
        sim.measure(0.0, Limiter::Start, seconds, sim.report.corrections, clock);
        Ok(sim)
    }

    /// The current velocity, rotation and pressure, in the plan's units.
    pub fn flow(&self) -> &Flow<D> {
        &self.flow
    }
    /// The report of the last solution.
    pub fn report(&self) -> &Report {
        &self.report
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSource;
    use crate::{plan, scene};

    /// Grains in a column of unit width, whose base descends: where they slide along the walls
    /// everywhere, the friction bears their weight, and the normal stress on the walls is
    /// `rho g L/(2 mu_w)` (Janssen 1895), although the pressure differs from it.
    #[test]
    fn the_normal_stress_on_the_walls_of_a_deep_column_saturates() {
        let text = "schema = 1\nname = \"column\"\ngravity = [0, -10]\n[domain]\nx = [0, 1]\n\
                    y = [0, 6]\n[accuracy]\ncells = 8\n[time]\nsteady = true\n[materials.grains]\n\
                    density = 1000\nfriction = { static = 0.8, grain_diameter = 1e-3 }\n[[regions]]\n\
                    material = \"grains\"\n[boundaries]\nleft.wall_friction = MU\n\
                    right.wall_friction = MU\nbottom.velocity_y = -0.1\ntop.kind = \"open\"\n";
        for mu in [0.4, 0.5, 0.7] {
            let source = SceneSource::new("column", text.replace("MU", &mu.to_string()));
            let plan = plan::resolve(&scene::parse(&source).expect("valid")).expect("valid");
            let sim = Simulation::<2>::new(Arc::new(plan)).expect("solved");
            let (mesh, slip) = (&sim.plan.mesh, sim.quadrature.slip());
            let unit = [sim.plan.units.length, sim.plan.units.stress()];
            let last = 1e4 / (2.0 * mu);
            let mut rows = vec![];
            for face in 0..slip.len() {
                let y = mesh.cell_centre(slip.wall(face).cell)[1] * unit[0];
                let normal = slip.normal_stresses(face).map(|n| n * unit[1]);
                let mean = (5.0 * (normal[0] + normal[2]) + 8.0 * normal[1]) / 18.0;
                rows.push((y, mean));
            }
            let between = |low: f64, high: f64| {
                let own: Vec<f64> =
                    rows.iter().filter(|r| r.0 > low && r.0 < high).map(|r| r.1).collect();
                own.iter().sum::<f64>() / own.len() as f64
            };
            // 0.981, 0.994 and 0.998 of the limit.
            let deep = between(0.75, 1.75);
            assert!((deep / last - 1.0).abs() < 0.03, "{mu}: {deep} {last}");
            // With the normal stress equal across the column it follows
            // `rho g L/(2 mu_w) (1 - exp(-2 mu_w z/L))` with the depth `z`; found within 1.5 %.
            for k in 0..8 {
                let (low, high) = (0.75 + 0.5 * f64::from(k), 1.25 + 0.5 * f64::from(k));
                let janssen = last * (1.0 - (-2.0 * mu * (5.75 - low)).exp());
                let found = between(low, high);
                assert!((found / janssen - 1.0).abs() < 0.02, "{mu}, {low}: {found} {janssen}");
            }
        }
    }
}
