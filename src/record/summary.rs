//! This module builds `summary.json`: the settings, results and diagnostics of a run.

use super::logger::Traffic;
use super::replace::{self, Kind};
use crate::scene::{Geometry, Quadrature, scene_hash};
use crate::sim::Run;
use crate::sim::criteria::{ACCURATE_ENERGY, ENERGY_STEPS};
use crate::sim::phases::Phases;
use crate::sim::row::{ForceRow, GaugeRow, Row};
use indexmap::IndexMap;
use serde::Serialize;
use std::path::Path;

/// Version of the format of `summary.json`.
pub const SCHEMA: u32 = 1;

/// Reason for the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The end time of the scene was reached.
    Finished,
    /// The limit of `--steps` was reached.
    StepLimit,
    /// The time of `--budget` was used up.
    BudgetSpent,
    /// The run was interrupted by a signal or by the user.
    Interrupted,
    /// The run stopped with an error.
    Failed,
}

/// Content of `summary.json`, in SI units.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Version of the format: [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// Geometry of the scene: round flows have volumes in m3, forces in N, powers in W.
    pub geometry: Geometry,
    /// SHA-256 of the resolved scene, hexadecimal.
    pub scene_hash: String,
    /// SHA-256 of the bits of the final particle state, hexadecimal.
    pub state_hash: String,
    /// Folder of the run.
    pub folder: String,
    /// Reason for the end of the run.
    pub ending: Ending,
    /// Error message of a failed run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Number of steps.
    pub steps: u64,
    /// Simulated time at the end (s).
    pub time: f64,
    /// Largest speed at the end (m/s).
    pub max_speed: f64,
    /// Root mean square speed at the end (m/s).
    pub rms_speed: f64,
    /// Number of particles at the end.
    pub particles: usize,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Number of unknowns.
    pub unknowns: Unknowns,
    /// Outflow volume and rate at the end, by gauge.
    pub gauges: IndexMap<String, GaugeRow>,
    /// Forces on sides, walls and blocks at the end, by the names of their gauges.
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    pub forces: IndexMap<String, ForceRow>,
    /// Relative change of the projected area since the start, by material.
    pub volume_drift: IndexMap<String, f64>,
    /// Volume mean of |n_x| over particles with layers; absent without directors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_alignment: Option<f64>,
    /// Share of the flowing grains at the end whose inertial number lies outside the well-posed
    /// range; absent without friction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ill_posed_share: Option<f64>,
    /// Errors of the balances.
    pub balances: Balances,
    /// Counts of splits, merges, particles held at walls or lost through open sides, and healed
    /// cells.
    pub population: IndexMap<&'static str, u64>,
    /// Wall-clock seconds by phase of the program.
    pub seconds: IndexMap<&'static str, f64>,
    /// Counts and waiting times of the logger.
    pub frames: FrameCounts,
    /// Path of the recording; absent if there is none.
    pub recording: Option<String>,
    /// Warnings of the run.
    pub warnings: Vec<String>,
    /// Settings chosen by `--accuracy` or `--budget`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub purchase: Option<Purchase>,
}

/// Settings chosen from a cost table, with their expected and actual accuracy and time.
#[derive(Clone, Debug, Serialize)]
pub struct Purchase {
    /// Settings, as text.
    pub settings: String,
    /// Settings, in the form of `--set`.
    pub sets: Vec<String>,
    /// Quantity whose error is measured.
    pub quantity: String,
    /// Expected relative error of the discretisation.
    pub accuracy: f64,
    /// Relative spread over particle placements and seeds; absent if it was not measured.
    pub sampling: Option<f64>,
    /// Expected wall-clock time (s).
    pub expected_seconds: f64,
    /// Actual wall-clock time (s).
    pub seconds: f64,
    /// Whether the run reached its end. The expected accuracy applies only then.
    pub finished: bool,
    /// Error bars of the outflow volume of each gauge (m²): discretisation, sampling.
    pub bars: IndexMap<String, [f64; 2]>,
}

/// Number of unknowns of a solve.
#[derive(Clone, Debug, Serialize)]
pub struct Unknowns {
    /// Velocity and rotation unknowns.
    pub velocity_and_rotation: usize,
    /// Pressure unknowns.
    pub pressure: usize,
    /// Rotation unknowns that a Cosserat material acts on.
    pub active_rotation: usize,
    /// Velocity, rotation and pressure unknowns together.
    pub total: usize,
}

/// Relative errors of the balances.
#[derive(Clone, Debug, Serialize)]
pub struct Balances {
    /// Largest error of the power balance over the run.
    pub power_error: f64,
    /// Largest error of the divergence over the run.
    pub divergence_error: f64,
    /// Volume error at the end.
    pub volume_error: f64,
    /// Largest `| |n| - 1 |` at the end.
    pub director_error: f64,
    /// (Potential energy lost plus work of other loads minus dissipated energy) over the dissipated
    /// energy. This error contains those of quadrature, advection and time stepping. It is absent
    /// where the potential energy of particles does not determine the balance: gravity along a
    /// periodic axis, open sides.
    pub energy_error: Option<f64>,
}

/// Counts and waiting times of the logger.
#[derive(Clone, Debug, Serialize)]
pub struct FrameCounts {
    /// Frames sent to the logger.
    pub sent: u64,
    /// Frames dropped because the logger was behind.
    pub dropped: u64,
    /// Frames that had to wait for the logger.
    pub waits: u64,
    /// Time that the simulation waited for the logger (s).
    pub waited_seconds: f64,
    /// Time that the logger was busy (s).
    pub logger_seconds: f64,
}

/// Totals and maxima collected by the loop around a run.
#[derive(Clone, Debug)]
pub struct Tally {
    /// Wall-clock seconds by phase, summed over the steps.
    pub phases: Phases,
    /// Wall-clock time of the whole run (s).
    pub wall: f64,
    /// Largest relative error of the power balance.
    pub largest_power_error: f64,
    /// Largest relative error of the divergence.
    pub largest_divergence: f64,
    /// Frames sent, dropped and delayed.
    pub traffic: Traffic,
    /// Time that the logger was busy (s).
    pub logger_seconds: f64,
    /// Wall-clock seconds outside the steps.
    pub around: Around,
    /// Warnings of the run.
    pub warnings: Vec<String>,
}

/// Wall-clock seconds outside the steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Around {
    /// Particle seeding and mesh analysis.
    pub set_up: f64,
    /// Checks of each step and copies of the last valid state.
    pub guard: f64,
    /// Output of rows, pictures and checkpoints.
    pub writing: f64,
}

impl Tally {
    /// The tally of a run at its first instant.
    pub fn new(warnings: Vec<String>) -> Tally {
        Tally {
            phases: Phases::default(),
            wall: 0.0,
            largest_power_error: 0.0,
            largest_divergence: 0.0,
            traffic: Traffic::default(),
            logger_seconds: 0.0,
            around: Around::default(),
            warnings,
        }
    }

    /// Adds a step.
    pub fn add(&mut self, row: &Row) {
        self.phases.add(&row.seconds);
        self.largest_power_error = self.largest_power_error.max(row.power_error);
        self.largest_divergence = self.largest_divergence.max(row.divergence_error);
    }
}

impl Summary {
    /// The warning that the energy lost is not the energy dissipated, with the likely cause for the
    /// quadrature rule of the run; `None` if the two agree.
    pub fn energy_warning(&self, rule: Quadrature) -> Option<String> {
        let error = self.balances.energy_error.filter(|e| e.abs() > ACCURATE_ENERGY)?;
        if self.steps < ENERGY_STEPS {
            return None;
        }
        let remedy = match rule {
            Quadrature::Sides => "raise accuracy.cells or lower time.tolerance",
            Quadrature::Laminate | Quadrature::Mixture | Quadrature::Particles => {
                "if a heavy material has a sloping surface under a thinner fluid, set \
                 accuracy.quadrature = \"sides\"; otherwise raise accuracy.cells or lower \
                 time.tolerance"
            }
        };
        let percent = 100.0 * error.abs();
        Some(format!(
            "the energy lost differs from the energy dissipated by {percent:.0} % of the latter: the \
             flow is less accurate than that; {remedy}"
        ))
    }

    /// Writes `summary.json` into a folder, and returns its text.
    ///
    /// # Errors
    /// A sentence with the path and the cause.
    pub fn write(&self, folder: &Path) -> Result<String, String> {
        let json = serde_json::to_string_pretty(self).map_err(|e| e.to_string())?;
        let path = folder.join("summary.json");
        replace::write(&path, format!("{json}\n"), Kind::Json("state_hash"))
            .map_err(|e| e.to_string())?;
        Ok(json)
    }

    /// The summary of a run in its present state.
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
        Summary {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            scene: plan.scene.name.clone(),
            geometry: plan.scene.domain.geometry,
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
            forces: plan
                .forces
                .iter()
                .map(|g| g.name.clone())
                .zip(row.forces.iter().copied())
                .collect(),
            volume_drift: plan
                .state
                .materials
                .iter()
                .map(|m| m.name.clone())
                .zip(row.drift.iter().copied())
                .collect(),
            mean_alignment: row.mean_alignment,
            ill_posed_share: plan.has_friction().then_some(row.ill_posed_share),
            balances: Balances {
                power_error: tally.largest_power_error,
                divergence_error: tally.largest_divergence,
                volume_error: row.volume_error,
                director_error: row.director_error,
                energy_error: plan.energy_tells().then_some(row.energy_error),
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
