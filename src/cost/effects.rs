//! Measures the share of each physical effect in the time of a step.
//!
//! If an effect can be removed from the scene, runs with and without it take steps alternately, and
//! the share is `1 - (step without)/(step with)`, medians of CPU time. An effect that drives the
//! flow cannot be removed; its share is that of its own phase of the step.

use super::measure::median;
use crate::plan::{EffectKind, EffectList, Plan, StepTime, resolve};
use crate::scene::Scene;
use crate::session::timed;
use crate::sim::phases::Phases;
use crate::sim::{self, Run, SimError};
use std::sync::Arc;

/// Median CPU times of a step with and without an effect, s.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Time of a step with the effect, s.
    pub with: f64,
    /// Time of a step without the effect, s.
    pub without: f64,
}

impl Pair {
    /// Share of the effect in a step that includes it.
    pub fn share(&self) -> f64 {
        1.0 - self.without / self.with
    }
}

/// The scene without an effect. `None` for effects that every scene has, that drive the flow, or
/// that belong to the material.
pub fn without(scene: &Scene, effect: EffectKind) -> Option<Scene> {
    let mut s = scene.clone();
    match effect {
        EffectKind::Rotation => {
            for m in s.materials.values_mut() {
                (m.internal_length, m.couple_viscosity) = (None, None);
                (m.layer_internal_length, m.micro_inertia) = (None, None);
            }
            let b = &mut s.boundaries;
            for side in [&mut b.left, &mut b.right, &mut b.bottom, &mut b.top] {
                side.rotation = None;
            }
            s.walls.iter_mut().for_each(|w| w.rotation = None);
            s.blocks.iter_mut().for_each(|b| b.rotation = None);
        }
        EffectKind::Directors => {
            for m in s.materials.values_mut() {
                (m.layer_viscosity, m.layer_internal_length) = (None, None);
            }
            s.regions.iter_mut().for_each(|r| r.director = None);
        }
        EffectKind::Stabilisation => s.accuracy.stabilisation = 0.0,
        EffectKind::VolumeChange => {
            for m in s.materials.values_mut() {
                m.bulk_viscosity = None;
                if let Some(g) = &mut m.granular {
                    g.incompressible = true;
                }
            }
        }
        EffectKind::Dye => s.dye = None,
        EffectKind::Gauges => s.gauges.clear(),
        EffectKind::BodyForce | EffectKind::Flow | EffectKind::Gravity => return None,
        EffectKind::Acceleration | EffectKind::CutCells => return None,
        EffectKind::CarriedViscosity | EffectKind::CarriedDensity => return None,
        EffectKind::FlowCurves | EffectKind::PressureZero | EffectKind::Inertia => return None,
        EffectKind::MicroInertia => {
            s.materials.values_mut().for_each(|m| m.micro_inertia = None);
        }
        EffectKind::Slip | EffectKind::Inflow => return None,
        EffectKind::Solids | EffectKind::Moving | EffectKind::Void => return None,
    }
    // The quantity of interest may have been removed with the effect.
    s.interest = None;
    Some(s)
}

/// A run whose steps are timed.
struct Timed {
    run: Box<dyn Run>,
    seconds: Vec<f64>,
    phases: Phases,
}

impl Timed {
    /// Starts a run and takes its first step, which solves twice and is not timed.
    fn start(plan: &Arc<Plan>) -> Result<Timed, SimError> {
        let mut run = sim::start(plan.clone())?;
        if !run.is_finished() {
            run.step()?;
        }
        Ok(Timed { run, seconds: vec![], phases: Phases::default() })
    }

    fn step(&mut self) -> Result<(), SimError> {
        let (outcome, took) = timed(|| self.run.step());
        outcome?;
        self.seconds.push(took.cpu);
        self.phases.add(&self.run.row().seconds);
        Ok(())
    }

    /// Median CPU time of a step, s; NaN if no step was timed.
    fn median(&self) -> f64 {
        median(self.seconds.clone()).unwrap_or(f64::NAN)
    }
}

/// Median step times of two plans, whose runs take steps alternately.
pub fn pair(with: &Arc<Plan>, without: &Arc<Plan>, steps: u32) -> Result<Pair, SimError> {
    let (mut a, mut b) = (Timed::start(with)?, Timed::start(without)?);
    for _ in 0..steps {
        if a.run.is_finished() || b.run.is_finished() {
            break;
        }
        a.step()?;
        b.step()?;
    }
    Ok(Pair { with: a.median(), without: b.median() })
}

/// Measures the shares of a plan's effects over `steps` steps of each run and stores them in
/// `list`. A share below the noise is zero; an effect that cannot be measured has no share.
pub fn measure(plan: &Arc<Plan>, list: &mut EffectList, steps: u32) -> Result<(), SimError> {
    let mut base = Timed::start(plan)?;
    while !base.run.is_finished() && base.seconds.len() < steps as usize {
        base.step()?;
    }
    if base.seconds.is_empty() {
        return Ok(());
    }
    let count = base.seconds.len() as f64;
    let phases = base.phases;
    let total = phases.total();
    for e in list.effects.iter_mut().filter(|e| e.solved) {
        e.share = match e.kind {
            EffectKind::Flow | EffectKind::CarriedDensity | EffectKind::CarriedViscosity => None,
            EffectKind::FlowCurves | EffectKind::PressureZero | EffectKind::Inertia => None,
            EffectKind::Slip | EffectKind::Inflow => None,
            EffectKind::Solids | EffectKind::Moving | EffectKind::Void => None,
            // Computed once, at the start.
            EffectKind::BodyForce => Some(0.0),
            EffectKind::Gravity | EffectKind::Acceleration => Some(phases.weight / total),
            EffectKind::Dye => Some(phases.dye / total),
            EffectKind::CutCells => Some((phases.quadrature + phases.assemble) / total),
            kind => share_of_pair(plan, kind, steps)?,
        };
    }
    list.step = Some(StepTime {
        steps: base.seconds.len() as u32,
        seconds: base.median(),
        phases: phases.list().map(|(name, s)| (name, s / count)).to_vec(),
    });
    Ok(())
}

/// Share of an effect, from runs with and without it; `None` if it cannot be removed.
fn share_of_pair(plan: &Arc<Plan>, kind: EffectKind, steps: u32) -> Result<Option<f64>, SimError> {
    let other = without(&plan.scene, kind).and_then(|scene| resolve(&scene).ok());
    let Some(other) = other.filter(|p| !p.describe().has(kind)) else { return Ok(None) };
    let share = pair(plan, &Arc::new(other), steps)?.share();
    Ok(share.is_finite().then_some(share.max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{parse, presets};

    #[test]
    fn removed_effects_are_not_solved() {
        for (name, _) in presets::list() {
            let scene = parse(&presets::find(name).expect("listed")).expect("valid");
            let list = resolve(&scene).expect("valid").describe();
            for e in list.effects.iter().filter(|e| e.solved) {
                let Some(other) = without(&scene, e.kind) else { continue };
                let other = resolve(&other).unwrap_or_else(|f| panic!("{name} {}: {f:?}", e.name));
                assert!(!other.describe().has(e.kind), "{name}: {}", e.name);
            }
        }
    }

    #[test]
    fn shares_are_between_zero_and_one() {
        let scene = parse(
            &presets::find("silo")
                .and_then(|s| s.with_sets(&["accuracy.cells=2".into()]))
                .expect("valid"),
        )
        .expect("valid");
        let plan = Arc::new(resolve(&scene).expect("valid"));
        let mut list = plan.describe();
        measure(&plan, &mut list, 2).expect("runs");
        for e in &list.effects {
            assert!(e.solved || e.share.is_none(), "{} is not solved", e.name);
            assert!(e.share.is_none_or(|s| (0.0..1.0).contains(&s)), "{}: {:?}", e.name, e.share);
        }
        assert!(list.effects.iter().any(|e| e.kind == EffectKind::Rotation && e.share.is_some()));
        assert!(list.step.is_some_and(|s| s.seconds > 0.0 && s.steps == 2));
    }
}
