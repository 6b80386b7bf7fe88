//! This module resolves `[time]` and the times of frames.

use super::values::{Result, positive};
use crate::plan::{ClockPlan, Units};
use crate::scene::{Scene, SceneError, Scope};

/// Largest number of frames.
const MOST_FRAMES: u32 = 1_000_000;

/// End time, limits of the time step, and times of frames.
pub(super) fn clock(scene: &Scene, scope: &Scope, units: &Units) -> Result<ClockPlan> {
    let t = &scene.time;
    let end = if t.steady { still(scene)? } else { positive(&t.end()?, scope, "time.end")? };
    let max_step = t.max_step.as_ref().map(|q| positive(q, scope, "time.max_step")).transpose()?;
    if !(t.courant > 0.0 && t.courant <= 50.0) {
        return Err(SceneError::of_key(
            "time.courant",
            format!("time.courant is {}", t.courant),
            "cells crossed per step: above 0, at most 50; 2 is usual",
        ));
    }
    if !(t.tolerance > 0.0 && t.tolerance <= 1.0) {
        return Err(SceneError::of_key(
            "time.tolerance",
            format!("time.tolerance is {}", t.tolerance),
            "displacement error per step in cells: above 0, at most 1; 0.1 is usual",
        ));
    }
    if !(t.strain > 0.0 && t.strain <= 10.0) {
        return Err(SceneError::of_key(
            "time.strain",
            format!("time.strain is {}", t.strain),
            "strain per step: above 0, at most 10; 0.25 is usual",
        ));
    }
    let r = &scene.recording;
    if r.frames > MOST_FRAMES {
        return Err(SceneError::of_key(
            "recording.frames",
            format!("recording.frames is {}", r.frames),
            format!("give 0 to {MOST_FRAMES}: every frame ends a step"),
        ));
    }
    let mut frames: Vec<f64> = if t.steady {
        vec![0.0]
    } else {
        (0..=r.frames).map(|k| end * f64::from(k) / f64::from(r.frames.max(1))).collect()
    };
    for q in r.times.iter().filter(|_| !t.steady) {
        let v = q.eval(scope)?;
        if !(0.0..=end * (1.0 + 1e-12)).contains(&v) {
            return Err(SceneError::at(
                q,
                format!("recording time {v} is outside the run"),
                format!("choose 0 to {end} s"),
            ));
        }
        frames.push(v.min(end));
    }
    frames.sort_by(f64::total_cmp);
    // Times whose difference is invisible are one frame.
    let least = end * 1e-6;
    frames.dedup_by(|b, a| *b - *a < least);
    let frames: Vec<f64> = frames.into_iter().map(|v| v / units.time).collect();
    let end = end / units.time;
    let mut stops: Vec<f64> = frames.iter().copied().filter(|&v| v > 0.0 && v < end).collect();
    if !t.steady {
        stops.push(end);
    }
    Ok(ClockPlan {
        end,
        max_step: max_step.map(|v| v / units.time),
        courant: t.courant,
        tolerance: t.tolerance,
        strain: t.strain,
        equal: scene.inertia,
        stops,
        frames,
    })
}

/// End time of a steady flow: zero.
fn still(scene: &Scene) -> Result<f64> {
    if scene.inertia {
        return Err(SceneError::of_key(
            "time.steady",
            "time.steady is true in a scene with inertia",
            "set inertia = false, or run to a time at which the flow is steady",
        ));
    }
    if !scene.schedule.is_empty() {
        return Err(SceneError::of_key(
            "time.steady",
            "time.steady is true in a scene with a [[schedule]]",
            "remove the [[schedule]]: no time passes",
        ));
    }
    Ok(0.0)
}
