//! Plans of a scene with other settings or an earlier end.

use super::CostError;
use crate::plan::{Plan, resolve};
use crate::scene::{Scene, SceneSource, Scope, parse};
use std::sync::Arc;

/// Relative errors below this value are rounding errors.
pub const ROUNDING: f64 = 1e-12;

/// Plans a scene source with `--set` assignments applied.
pub fn planned(source: &SceneSource, sets: &[String]) -> Result<Arc<Plan>, CostError> {
    let source = source.with_sets(sets)?;
    Ok(Arc::new(resolve(&parse(&source)?).map_err(|e| e.with_source(&source))?))
}

/// `--set` assignments that end a scene at a share of its time, and that end time in seconds.
/// Frames keep their interval.
pub fn shortened(scene: &Scene, share: f64) -> Result<(Vec<String>, f64), CostError> {
    let end = scene.time.end()?.eval(&Scope::new(scene)?)?;
    let frames = f64::from(scene.recording.frames);
    let kept = (frames * share).ceil().max(1.0);
    // A whole number of frame intervals, so that steps end at frame times as in the scene.
    let share = if frames > 1.0 { (kept / frames).min(1.0) } else { share };
    if share >= 1.0 {
        return Ok((vec![], end));
    }
    let sets = vec![
        format!("time.end={:e}", end * share),
        format!("recording.frames={kept}"),
        "recording.times=[]".into(),
    ];
    Ok((sets, end * share))
}
