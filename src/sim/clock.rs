//! This module chooses the time step as the smallest of several named limits.

use crate::plan::ClockPlan;
use crate::space::mesh::Mesh;
use serde::Serialize;

/// The limit that determined the length of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limiter {
    /// No step: the row of the initial state.
    Start,
    /// `time.courant`: number of cells crossed.
    Courant,
    /// `time.strain`: strain of layered material.
    Strain,
    /// `time.max_step`: largest step.
    MaxStep,
    /// A multiple of the relaxation time of the stratification.
    Relaxation,
    /// A step may be at most twice as long as the previous one.
    Growth,
    /// The time of a frame, of a scheduled change or of the end.
    Stop,
    /// The step was shortened because a longer one failed.
    Guard,
    /// `time.tolerance`: error of the displacements of the materials of interest.
    Tolerance,
}

impl Limiter {
    /// All limiters. Saved states contain their index here, so new ones must be appended.
    pub const ALL: [Limiter; 9] = [
        Limiter::Start,
        Limiter::Courant,
        Limiter::Strain,
        Limiter::MaxStep,
        Limiter::Relaxation,
        Limiter::Growth,
        Limiter::Stop,
        Limiter::Guard,
        Limiter::Tolerance,
    ];

    /// Name in `series.csv`.
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
            Limiter::Tolerance => "tolerance",
        }
    }
}

/// Quantities of the flow and the materials that limit the step, in the plan's units.
#[derive(Clone, Copy, Debug)]
pub struct Speeds {
    /// Largest number of cells that the materials of interest cross per unit time.
    pub crossings: f64,
    /// Step at which the displacement error reaches its tolerance; `None` if it is not known.
    pub tolerated: Option<f64>,
    /// Largest strain rate of layered material.
    pub strain_rate: f64,
    /// Largest step for a stable stratification; `None` if there is none.
    pub relaxation: Option<f64>,
}

/// Largest ratio of consecutive steps; the extrapolation of the velocity needs similar steps. After
/// two halves of an interval between frames, the next interval can be one step.
const GROWTH: f64 = 2.0;

/// Share of the Courant number that limits the first step.
const FIRST: f64 = 0.25;

/// Length and limiter of the step that starts at `time`; `previous`: length of the previous step.
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
    // The error of the first step is not known in advance.
    let courant = match speeds.tolerated {
        Some(_) => clock.courant,
        None => FIRST * clock.courant,
    };
    limit(courant / speeds.crossings, Limiter::Courant);
    limit(clock.strain / speeds.strain_rate, Limiter::Strain);
    if let Some(dt) = speeds.tolerated {
        limit(dt, Limiter::Tolerance);
    }
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
    if clock.equal {
        return equal_step(dt, remaining, previous, name);
    }
    if dt >= remaining * (1.0 - 1e-9) {
        (remaining, Limiter::Stop)
    } else if dt > 0.5 * remaining {
        // Two equal steps instead of a full and a very short one.
        (0.5 * remaining, name)
    } else {
        (dt, name)
    }
}

/// Smallest step, in units of its limit, that is kept from one step to the next.
const KEPT: f64 = 0.8;

/// The longest of equal steps up to a stop that is at most `dt`; the length of the previous step as
/// long as it fits.
fn equal_step(dt: f64, remaining: f64, previous: Option<f64>, name: Limiter) -> (f64, Limiter) {
    let last = |step: f64| if step >= remaining * (1.0 - 1e-9) { Limiter::Stop } else { name };
    if let Some(kept) =
        previous.filter(|p| *p <= dt * (1.0 + 1e-9) && *p >= KEPT * dt.min(remaining))
    {
        let steps = remaining / kept;
        if (steps - steps.round()).abs() < 1e-6 {
            return (kept, last(kept));
        }
    }
    let step = remaining / (remaining / dt * (1.0 - 1e-12)).ceil().max(1.0);
    (step, last(step))
}

/// Number of cells refined by grading that count as one crossed cell, up to the size of the largest
/// cell: rows of refined cells extend across the domain, also to where the flow needs no
/// refinement. In the silo with lips graded by 8, the outflow at 0.7 ms was 4.077 with steps of
/// four small cells (half a usual cell) and 4.078 with steps of two, which needed half as many
/// steps again.
const GRADED_ALLOWANCE: f64 = 8.0;

/// Number of cells that a unit velocity at each node crosses per unit time, by direction, for the
/// smallest cell at the node (see `GRADED_ALLOWANCE`); zero if all its cells are solid.
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
