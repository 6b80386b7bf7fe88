//! What shortened runs leave out, seen on two coarse meshes that run to the end as well.

use super::CostError;
use super::knobs::cells_near;
use super::list::Growth;
use super::measure::{Pilot, Sample, Target, run};
use super::survey::{ROUNDING, planned};
use crate::scene::{Scene, SceneSource};

/// Cells of the meshes, relative to the scene's own.
const COARSE: [f64; 2] = [1.0 / 3.0, 0.5];

/// Seconds of a pilot.
const PATIENCE: f64 = 0.3;

/// Two coarse runs to the end of the scene.
pub struct Coarse {
    pub cells: [u32; 2],
    ends: [Sample; 2],
    /// Seconds that the finer one took, over those that its first steps forecast: steps grow or
    /// shrink as a run goes on, on fine meshes much as on coarse ones.
    pub forecast: f64,
}

impl Coarse {
    /// Runs them; `None` if that is forecast to take more than `most` seconds, or if one fails.
    pub fn run(
        source: &SceneSource,
        scene: &Scene,
        target: &Target,
        pilot: &Pilot,
        most: f64,
    ) -> Result<Option<Coarse>, CostError> {
        let cells = COARSE.map(|f| cells_near(scene.accuracy.cells, f));
        // Cells count to the power two, and once more for the steps.
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

    /// How the error grows from an earlier end to the scene's, and how many times longer a run to
    /// there takes; `near` holds the same runs to the earlier end.
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
