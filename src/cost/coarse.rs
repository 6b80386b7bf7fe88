//! Estimates the effect of shortening runs, from runs on two coarse meshes to the scene's end.

use super::CostError;
use super::knobs::cells_near;
use super::list::Growth;
use super::measure::{Pilot, Sample, Target, run};
use super::planning::{ROUNDING, planned};
use crate::scene::{Scene, SceneSource};

/// Numbers of cells of the two meshes, relative to that of the scene.
const COARSE: [f64; 2] = [1.0 / 3.0, 0.5];

/// Wall-clock time of a pilot run, s.
const PATIENCE: f64 = 0.3;

/// Two coarse runs to the end of the scene.
pub struct Coarse {
    /// `accuracy.cells` of the two runs, coarse to fine.
    pub cells: [u32; 2],
    ends: [Sample; 2],
    /// CPU time of the finer run, divided by the time extrapolated from its first steps. Time steps
    /// grow or shrink during a run, similarly on fine and coarse meshes.
    pub forecast: f64,
}

impl Coarse {
    /// Runs both. `None` if they are expected to take more than `most` seconds, or if one fails.
    pub fn run(
        source: &SceneSource,
        scene: &Scene,
        target: &Target,
        pilot: &Pilot,
        most: f64,
    ) -> Result<Option<Coarse>, CostError> {
        let cells = COARSE.map(|f| cells_near(scene.accuracy.cells, f));
        // The time grows with the square of the cells per side, and with the number of steps.
        let guess: f64 = COARSE.iter().map(|f| f.powf(2.5)).sum::<f64>() * pilot.whole();
        if cells[0] == cells[1] || guess > most {
            return Ok(None);
        }
        let mut ends = vec![];
        for n in cells {
            let plan = planned(source, &[format!("accuracy.cells={n}")])?;
            match run(plan.clone(), target, |_, _| {}) {
                Ok(sample) => ends.push((sample, plan)),
                Err(_) => return Ok(None),
            }
        }
        let Some((fine, plan)) = ends.pop() else { return Ok(None) };
        let Some((rough, _)) = ends.pop() else { return Ok(None) };
        let forecast = fine.took.cpu / Pilot::run(plan, PATIENCE)?.whole().max(1e-9);
        Ok(Some(Coarse { cells, ends: [rough, fine], forecast }))
    }

    /// Growth of the error from an earlier end to the scene's end, and the ratio of CPU times of
    /// these two runs. `near` holds the same runs to the earlier end.
    pub fn beyond(&self, near: [&Sample; 2], target: &Target) -> (Growth, f64) {
        let difference = |[a, b]: [&Sample; 2]| {
            let scale = target.size(b.value.iter().copied()).max(target.floor);
            target.distance(&a.value, &b.value, scale)
        };
        let (before, after) = (difference(near), difference(self.ends.each_ref()));
        let factor = if before > ROUNDING { after / before } else { 1.0 };
        let ratio = self.ends[1].took.cpu / near[1].took.cpu.max(1e-9);
        (Growth { factor, cells: self.cells }, ratio)
    }
}
