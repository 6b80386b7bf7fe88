//! Choosing the time step, by named limiters.

use crate::plan::ClockPlan;
use crate::space::mesh::Mesh;
use serde::Serialize;

/// What set the size of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limiter {
    /// No step was taken: row 0.
    Start,
    /// `time.courant`: cells crossed.
    Courant,
    /// `time.strain`: strain of layered material.
    Strain,
    /// `time.max_step`
    MaxStep,
    /// Many times the relaxation time of the stratification.
    Relaxation,
    /// Steps grow by no more than a half each.
    Growth,
    /// A frame, a scheduled change or the end had to be met.
    Stop,
    /// The step was cut because a longer one failed.
    Guard,
}

impl Limiter {
    /// All limiters; states of runs number them by their place here: new ones go to the end.
    pub const ALL: [Limiter; 8] = [
        Limiter::Start,
        Limiter::Courant,
        Limiter::Strain,
        Limiter::MaxStep,
        Limiter::Relaxation,
        Limiter::Growth,
        Limiter::Stop,
        Limiter::Guard,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Limiter::Start => "start",
            Limiter::Courant => "courant",
            Limiter::Strain => "strain",
            Limiter::MaxStep => "max_step",
            Limiter::Relaxation => "relaxation",
            Limiter::Growth => "growth",
            Limiter::Stop => "stop",
            Limiter::Guard => "guard",
        }
    }
}

/// What the flow and its matter say about the step.
#[derive(Clone, Copy, Debug)]
pub struct Speeds {
    /// Largest number of cells crossed per unit time.
    pub crossings: f64,
    /// Largest strain rate of layered material.
    pub strain_rate: f64,
    /// Longest step that the stratification stands.
    pub relaxation: Option<f64>,
}

/// Growth of the step from one to the next: extrapolation of the velocity needs similar steps.
const GROWTH: f64 = 1.5;

/// The next step from `time`, after one of `previous`.
pub fn next_step(
    clock: &ClockPlan,
    time: f64,
    previous: Option<f64>,
    speeds: Speeds,
) -> (f64, Limiter) {
    let stop = clock.stops.iter().copied().find(|&s| s > time * (1.0 + 1e-14)).unwrap_or(clock.end);
    let remaining = stop - time;
    let mut best = (clock.end, Limiter::Stop);
    let mut limit = |dt: f64, name| {
        if dt < best.0 {
            best = (dt, name);
        }
    };
    limit(clock.courant / speeds.crossings, Limiter::Courant);
    limit(clock.strain / speeds.strain_rate, Limiter::Strain);
    if let Some(dt) = clock.max_step {
        limit(dt, Limiter::MaxStep);
    }
    if let Some(dt) = speeds.relaxation {
        limit(dt, Limiter::Relaxation);
    }
    if let Some(dt) = previous {
        limit(GROWTH * dt, Limiter::Growth);
    }
    let (dt, name) = best;
    if dt >= remaining {
        (remaining, Limiter::Stop)
    } else if dt > 0.5 * remaining {
        // Two equal steps instead of one full and one tiny.
        (0.5 * remaining, name)
    } else {
        (dt, name)
    }
}

/// A particle may cross this many cells that grading made small for one usual cell: their rows
/// reach across the domain and know nothing of the flow far from what they are for. On the silo,
/// lips graded by 8, outflow at 0.7 ms was 4.077 in steps of four small cells (half a usual one)
/// and 4.078 in steps of two, which are half as many again.
const GRADED_ALLOWANCE: f64 = 8.0;

/// What a unit velocity of each node crosses per unit time, in the smallest of its cells as they
/// count; nothing where all are solid.
pub fn crossing_rates(mesh: &Mesh) -> Vec<[f64; 2]> {
    let usual =
        [&mesh.x, &mesh.y].map(|axis| (0..axis.cells()).map(|k| axis.size(k)).fold(0.0, f64::max));
    let mut rates = vec![[0.0_f64; 2]; mesh.nodes()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let counted = mesh.cell_size(cell).map(|h| h * GRADED_ALLOWANCE);
        for node in mesh.cell_nodes(cell) {
            for c in 0..2 {
                rates[node][c] = rates[node][c].max(1.0 / counted[c].min(usual[c]));
            }
        }
    }
    rates
}
