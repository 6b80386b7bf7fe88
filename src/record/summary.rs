//! `summary.json`: what a run was and how it ended.

use super::logger::Traffic;
use crate::scene::scene_hash;
use crate::sim::Run;
use crate::sim::row::{GaugeRow, Phases, Row};
use indexmap::IndexMap;
use serde::Serialize;

/// Version of the summary's format.
pub const SCHEMA: u32 = 1;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    Finished,
    /// `--steps` was reached.
    StepLimit,
    /// `--budget` was spent.
    BudgetSpent,
    Interrupted,
    Failed,
}

/// Everything in `summary.json`; SI units.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    pub schema: u32,
    pub version: &'static str,
    pub scene: String,
    pub scene_hash: String,
    /// SHA-256 over the bits of the final particle state.
    pub state_hash: String,
    pub folder: String,
    pub ending: Ending,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    pub steps: u64,
    pub time: f64,
    pub max_speed: f64,
    pub rms_speed: f64,
    pub particles: usize,
    pub cells: [usize; 2],
    pub unknowns: Unknowns,
    pub gauges: IndexMap<String, GaugeRow>,
    pub volume_drift: IndexMap<String, f64>,
    /// Volume mean of |n_x| over layered particles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_alignment: Option<f64>,
    pub balances: Balances,
    pub population: IndexMap<&'static str, u64>,
    pub seconds: IndexMap<&'static str, f64>,
    pub frames: FrameCounts,
    pub recording: Option<String>,
    pub warnings: Vec<String>,
    /// What `--accuracy` or `--budget` bought.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub purchase: Option<Purchase>,
}

/// Settings bought from a price list, what was expected of them and what came.
#[derive(Clone, Debug, Serialize)]
pub struct Purchase {
    pub settings: String,
    pub sets: Vec<String>,
    pub quantity: String,
    /// Relative, of the discretisation.
    pub accuracy: f64,
    /// Relative; absent if it was not seen.
    pub sampling: Option<f64>,
    pub expected_seconds: f64,
    pub seconds: f64,
    /// Whether the run reached its end; before it, nothing is promised.
    pub finished: bool,
    /// Error bars of the gauges' volumes, m2: discretisation, sampling.
    pub bars: IndexMap<String, [f64; 2]>,
}

#[derive(Clone, Debug, Serialize)]
pub struct Unknowns {
    pub velocity_and_rotation: usize,
    pub pressure: usize,
    pub active_rotation: usize,
    pub total: usize,
}

/// How well what must hold held.
#[derive(Clone, Debug, Serialize)]
pub struct Balances {
    /// Largest over the run.
    pub power_error: f64,
    /// Largest over the run.
    pub divergence_error: f64,
    /// At the end.
    pub volume_error: f64,
    pub director_error: f64,
    /// Potential energy lost plus work done by other loads, less what was dissipated, over the
    /// latter: sees quadrature, advection and time stepping. Absent where particles' potential
    /// energy does not tell: gravity along a periodic axis, open sides.
    pub energy_error: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
pub struct FrameCounts {
    pub sent: u64,
    pub dropped: u64,
    pub waits: u64,
    pub waited_seconds: f64,
    pub logger_seconds: f64,
}

/// What the loop around a run kept count of.
#[derive(Clone, Debug)]
pub struct Tally {
    pub phases: Phases,
    pub wall: f64,
    pub largest_power_error: f64,
    pub largest_divergence: f64,
    pub first_energy: f64,
    pub traffic: Traffic,
    pub logger_seconds: f64,
    pub around: Around,
    pub warnings: Vec<String>,
}

/// Wall seconds around the steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Around {
    /// Filling cells, analysis of the mesh.
    pub set_up: f64,
    /// Examining steps and keeping the last good state.
    pub guard: f64,
    /// Rows, pictures, checkpoints.
    pub writing: f64,
}

impl Tally {
    /// Of a run that stands at its first instant.
    pub fn new(first: &Row, warnings: Vec<String>) -> Tally {
        Tally {
            phases: Phases::default(),
            wall: 0.0,
            largest_power_error: 0.0,
            largest_divergence: 0.0,
            first_energy: first.potential_energy,
            traffic: Traffic::default(),
            logger_seconds: 0.0,
            around: Around::default(),
            warnings,
        }
    }

    /// Counts a step in.
    pub fn add(&mut self, row: &Row) {
        self.phases.add(&row.seconds);
        self.largest_power_error = self.largest_power_error.max(row.power_error);
        self.largest_divergence = self.largest_divergence.max(row.divergence_error);
    }
}

impl Summary {
    pub fn new(
        run: &dyn Run,
        tally: &Tally,
        ending: Ending,
        folder: String,
        recording: Option<String>,
    ) -> Summary {
        let plan = run.plan();
        let row = run.row();
        let [velocity, pressure] = run.unknowns();
        let count = run.count();
        let mut seconds: IndexMap<&str, f64> = tally.phases.list().into_iter().collect();
        seconds.insert("waiting_for_logger", tally.traffic.waited.as_secs_f64());
        seconds.insert("set_up", tally.around.set_up);
        seconds.insert("guard", tally.around.guard);
        seconds.insert("writing", tally.around.writing);
        let known: f64 = seconds.values().sum();
        seconds.insert("other", (tally.wall - known).max(0.0));
        seconds.insert("total", tally.wall);
        let (mesh, g) = (&plan.mesh, plan.state.gravity);
        let along_seam = mesh.x.periodic() && g[0] != 0.0 || mesh.y.periodic() && g[1] != 0.0;
        let energy_tells = !along_seam && !plan.enclosure.open.contains(&true);
        let lost = tally.first_energy - row.potential_energy + row.work;
        Summary {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            scene: plan.scene.name.clone(),
            scene_hash: scene_hash(&plan.scene),
            state_hash: run.state_hash(),
            folder,
            ending,
            error: None,
            steps: row.step,
            time: row.time,
            max_speed: row.max_speed,
            rms_speed: row.rms_speed,
            particles: row.particles,
            cells: [plan.mesh.x.cells(), plan.mesh.y.cells()],
            unknowns: Unknowns {
                velocity_and_rotation: velocity,
                pressure,
                active_rotation: row.active_rotation,
                total: velocity + pressure,
            },
            gauges: plan
                .gauges
                .iter()
                .map(|g| g.name.clone())
                .zip(row.gauges.iter().cloned())
                .collect(),
            volume_drift: plan
                .state
                .materials
                .iter()
                .map(|m| m.name.clone())
                .zip(row.drift.iter().copied())
                .collect(),
            mean_alignment: row.alignment,
            balances: Balances {
                power_error: tally.largest_power_error,
                divergence_error: tally.largest_divergence,
                volume_error: row.volume_error,
                director_error: row.director_error,
                energy_error: energy_tells.then(|| {
                    // Less than this share of the energy there is, is rounding: the scene is at rest.
                    let scale = row.dissipated.max(1e-6 * tally.first_energy.abs());
                    if scale > 0.0 { (lost - row.dissipated) / scale } else { 0.0 }
                }),
            },
            population: [
                ("splits", count.splits),
                ("merges", count.merges),
                ("held_at_walls", count.held),
                ("left_through_open_sides", count.left),
                ("healed_cells", count.healed),
            ]
            .into_iter()
            .collect(),
            seconds,
            frames: FrameCounts {
                sent: tally.traffic.frames,
                dropped: tally.traffic.drops,
                waits: tally.traffic.waits,
                waited_seconds: tally.traffic.waited.as_secs_f64(),
                logger_seconds: tally.logger_seconds,
            },
            recording,
            warnings: tally.warnings.clone(),
            purchase: None,
        }
    }
}
