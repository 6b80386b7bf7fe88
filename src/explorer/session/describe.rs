//! What the page is told: the state of the session, of the run and of its checks.

use super::super::knobs::{self, Stop, Switch};
use super::super::live::Live;
use super::super::protocol::{DialState, Light, Reading, RunState, State, SwitchState};
use super::*;
use crate::sim::clock::Limiter;
use crate::sim::criteria::{ACCURATE_ENERGY, Criteria, ENERGY_STEPS};
use std::time::Instant;

pub(super) fn milliseconds(seconds: f64) -> String {
    format!("{:.0} ms", 1e3 * seconds)
}

pub(super) fn run_state(live: &Live) -> RunState {
    let row = live.drive.run.row();
    let plan = &live.drive.plan;
    let sum = live.phases();
    let total = sum.total().max(f64::MIN_POSITIVE);
    let mut readings: Vec<Reading> = vec![];
    for (gauge, now) in plan.gauges.iter().zip(&row.gauges) {
        let name = |what: &str| format!("{} {what}", gauge.name);
        readings.push(Reading { name: name("rate"), value: now.rate, unit: "m²/s" });
        readings.push(Reading { name: name("volume"), value: now.volume, unit: "m²" });
    }
    if let Some(value) = row.mean_alignment {
        readings.push(Reading { name: "mean |n_x|".into(), value, unit: "" });
    }
    readings.push(Reading { name: "largest speed".into(), value: row.max_speed, unit: "m/s" });
    RunState {
        id: live.id,
        points: live.rows.len(),
        step: row.step,
        pictures: live.frames.pictures(),
        time: row.time,
        end: plan.clock.end * plan.units.time,
        dt: row.dt,
        limiter: row.dt_limiter.name(),
        limited_by: limited_by(row.dt_limiter),
        steps_per_second: live.steps_per_second(),
        seconds_per_step: live.usual_step(),
        particles: row.particles,
        cells: [plan.mesh.x.cells(), plan.mesh.y.cells()],
        round: plan.scene.domain.geometry.is_round(),
        unknowns: knobs::unknowns(plan),
        lights: lights(live),
        readings,
        phases: sum.list().map(|(name, s)| (name, s / total)).to_vec(),
        changes: live.changes.clone(),
    }
}

/// Diagnostics with the bounds of the stress tests.
pub(super) fn lights(live: &Live) -> Vec<Light> {
    let row = live.drive.run.row();
    let drift = row.drift.iter().map(|d| d.abs()).fold(0.0, f64::max);
    let light = |name, value: f64, bound: f64, meaning| Light {
        name,
        value,
        bound,
        // False for NaN.
        good: value <= bound,
        meaning,
    };
    // The divergence error grows with the tolerance of the solver.
    let criteria = Criteria::of(&live.drive.plan);
    let divergence = criteria.divergence.max(10.0 * live.drive.plan.method.tolerance);
    vec![
        light(
            "power balance",
            row.power_error,
            criteria.power,
            "relative difference of the power of all loads and the dissipation",
        ),
        light(
            "divergence",
            row.divergence_error,
            divergence,
            "divergence of the flow relative to its strain rate",
        ),
        light(
            "energy balance",
            if row.step < ENERGY_STEPS { 0.0 } else { row.energy_error.abs() },
            ACCURATE_ENERGY,
            "relative difference of the energy lost since the start and the energy dissipated",
        ),
        light(
            "volume error",
            drift,
            criteria.drift,
            "largest relative change of a material's projected area since the start",
        ),
        light(
            "corrections",
            f64::from(row.iterations),
            criteria.corrections,
            "corrections of the solver in this step",
        ),
    ]
}

pub(super) fn limited_by(limiter: Limiter) -> &'static str {
    match limiter {
        Limiter::Start => "no step was taken yet",
        Limiter::Courant => "cells crossed per step",
        Limiter::Strain => "strain of the layers",
        Limiter::MaxStep => "time.max_step",
        Limiter::Relaxation => "relaxation of the strata",
        Limiter::Growth => "growth of the step",
        Limiter::Stop => "the next frame or change",
        Limiter::Tolerance => "error of the displacements",
        Limiter::Guard => "a longer step that failed",
    }
}

impl Session {
    pub(super) fn publish(&mut self) {
        self.published = Some(Instant::now());
        let (title, description) = self.live.as_ref().map_or(("", ""), |l| {
            (l.drive.plan.scene.name.as_str(), l.drive.plan.scene.description.as_str())
        });
        let mut warnings = vec![];
        if let Some(live) = &self.live {
            warnings.extend(live.values.warnings.iter().map(ToString::to_string));
            warnings.extend(live.drive.run.warnings().iter().map(ToString::to_string));
        }
        let state = State {
            mode: self.mode,
            scene: &self.scene,
            title,
            description,
            problem: self.problem.as_ref(),
            run: self.live.as_ref().map(run_state),
            knobs: &self.knobs,
            switches: self.switches.iter().map(|s| self.switch_state(s)).collect(),
            dial: self.dial.iter().map(|s| self.dial_state(s)).collect(),
            effects: &self.effects,
            warnings,
            pins: self.pins.iter().map(|p| p.state.clone()).collect(),
            saved: self.saved.clone(),
            scenes: self.library.entries(),
            folder: self.library.folder().display().to_string(),
            out: self.out.display().to_string(),
            viewer: cfg!(feature = "viewer"),
            stream: self.stage.as_ref().map(|s| s.stream.clone()),
            news: self.news.clone(),
        };
        if let Some(run) = &state.run {
            self.status.set_pace(run.unknowns, run.seconds_per_step);
        }
        match serde_json::to_string(&state) {
            Ok(text) => self.status.publish(text),
            Err(e) => eprintln!("warning: the state cannot be sent to the page: {e}"),
        }
    }

    pub(super) fn switch_state(&self, s: &Switch) -> SwitchState {
        let measured = s.kinds.each_ref().map(|kind| self.measured.get(kind).copied());
        let cost = match (measured, &self.live) {
            ([Some(with), Some(without)], _) => {
                let percent = 100.0 * (1.0 - without / with);
                format!(
                    "{percent:.0} % of a step, measured: {} with, {} without",
                    milliseconds(with),
                    milliseconds(without)
                )
            }
            (_, Some(live)) if s.unknowns[0] > s.unknowns[1] => {
                let phases = live.phases();
                let solver = phases.assemble + phases.factor + phases.solve;
                let less = (s.unknowns[1] as f64 / s.unknowns[0] as f64).powf(SOLVER_GROWTH);
                // Solver time of a step with the effect, whether or not it is solved now.
                let with = if s.on { solver } else { solver / less };
                let share = with * (1.0 - less) / (phases.total() - solver + with);
                format!("about {:.0} % of a step, by its unknowns", 100.0 * share)
            }
            _ => "no unknowns of its own".into(),
        };
        SwitchState { effect: s.effect, key: s.key.clone(), on: s.on, other: s.other.clone(), cost }
    }

    pub(super) fn dial_state(&self, s: &Stop) -> DialState {
        let live = self.live.as_ref();
        let cells = live.map(|l| l.values.scene.accuracy.cells);
        let guess = || {
            let live = live.filter(|l| l.rows.len() > 1)?;
            let known = knobs::unknowns(&live.drive.plan);
            Some(knobs::step_time(live.usual_step(), known, s.unknowns))
        };
        DialState {
            cells: s.cells,
            current: cells == Some(s.cells),
            unknowns: s.unknowns,
            seconds_per_step: self.measured.get(&s.kind).copied().or_else(guess),
            error: s.error,
        }
    }
}
