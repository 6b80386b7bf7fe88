//! Runs trials and stores the scenes of failed ones.

use super::{Outcome, Trial, Verdict, judge};
use crate::cases::{CaseError, plan_of};
use crate::session::march;
use crate::sim::criteria::{Criteria, ENERGY_STEPS};
use crate::sim::{self, Run};
use crate::threads;
use crate::verify::{Bound, Check};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Smallest reference speed for the growth of speed, in units of the scene.
const LEAST_SPEED: f64 = 0.1;

/// Initial values, with which later ones are compared.
struct First {
    /// Volume of all particles.
    volume: f64,
    /// Reference speed, m/s.
    speed: f64,
    /// Smallest and largest carried viscosity and density.
    extrema: [Option<[f64; 2]>; 2],
}

/// Smallest and largest value of a list.
fn range(column: &Option<Vec<f64>>) -> Option<[f64; 2]> {
    let fold = |r: [f64; 2], v: &f64| [r[0].min(*v), r[1].max(*v)];
    column.as_ref().map(|c| c.iter().fold([f64::INFINITY, f64::NEG_INFINITY], fold))
}

impl First {
    fn new(run: &dyn Run) -> Self {
        let p = run.particles();
        First {
            volume: p.volume.iter().sum(),
            speed: run.row().max_speed.max(LEAST_SPEED * run.plan().units.velocity()),
            extrema: [range(&p.viscosity), range(&p.density)],
        }
    }
}

/// Largest value of each criterion so far, as in [`Criteria`](super::Criteria).
#[derive(Default)]
struct Worst {
    power: f64,
    divergence: f64,
    energy: f64,
    corrections: f64,
    misplaced: f64,
    drift: f64,
    volume: f64,
    director: f64,
    outside: f64,
    growth: f64,
    extrema: f64,
}

/// Sets `worst` to the larger of both; NaN is kept.
fn raise(worst: &mut f64, value: f64) {
    if !worst.is_nan() && (value > *worst || value.is_nan()) {
        *worst = value;
    }
}

impl Worst {
    /// Updates all values from the current state of a run.
    fn observe(&mut self, run: &dyn Run, first: &First) {
        let (row, plan, particles) = (run.row(), run.plan(), run.particles());
        raise(&mut self.power, row.power_error);
        raise(&mut self.divergence, row.divergence_error);
        raise(&mut self.corrections, f64::from(row.iterations));
        raise(&mut self.director, row.director_error);
        row.drift.iter().for_each(|d| raise(&mut self.drift, d.abs()));
        raise(&mut self.growth, row.max_speed / first.speed);
        if !plan.effects.volume_change {
            raise(&mut self.misplaced, misplaced_volume(run));
            let volume: f64 = particles.volume.iter().sum();
            let kept = volume + run.count().volume_out - run.count().volume_in;
            raise(&mut self.volume, (kept - first.volume).abs() / first.volume);
        }
        raise(&mut self.outside, misplaced(run) as f64);
        if plan.effects.volume_change {
            return;
        }
        let now = [range(&particles.viscosity), range(&particles.density)];
        for (now, first) in now.into_iter().zip(first.extrema) {
            if let (Some(now), Some(first)) = (now, first) {
                let beyond = (first[0] - now[0]).max(now[1] - first[1]);
                raise(&mut self.extrema, beyond / first[0].abs().max(first[1].abs()));
            }
        }
    }

    /// Checks of all values; without that of the drift if `drifts`.
    fn checks(&self, drifts: bool, c: &Criteria) -> Vec<Check> {
        let mut out = vec![
            ("power balance", self.power, c.power),
            ("divergence", self.divergence, c.divergence),
            ("energy balance", self.energy, c.energy),
            ("corrections", self.corrections, c.corrections),
            ("volume of cells", self.misplaced, c.misplaced),
            ("volume of particles", self.volume, c.volume),
            ("length of directors", self.director, c.director),
            ("particles outside", self.outside, c.outside),
            ("growth of speed", self.growth, c.growth),
            ("carried values", self.extrema, c.extrema),
        ];
        if !drifts {
            out.push(("drift of projected area", self.drift, c.drift));
        }
        out.into_iter().map(|(what, v, most)| Check::new(what, v, Bound::AtMost(most))).collect()
    }
}

/// Sum over cells of |volume of particles - area|, over the total area, relative to the share of
/// one row of particles in a cell. With a void, cells may lack volume: twice the sum of what is too much in
/// some, over the volume of the particles.
fn misplaced_volume(run: &dyn Run) -> f64 {
    let (mesh, particles) = (&run.plan().mesh, run.particles());
    let (mut wrong, mut all) = (0.0, 0.0);
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let volume: f64 = particles.of_cell(cell).map(|p| particles.volume[p]).sum();
        let excess = volume - mesh.cell_volume(cell);
        if run.plan().void().is_some() {
            wrong += 2.0 * excess.max(0.0);
            all += volume;
        } else {
            wrong += excess.abs();
            all += mesh.cell_volume(cell);
        }
    }
    wrong / all * run.plan().method.seeding.side as f64
}

/// Number of particles outside the domain, inside a solid, or with a position that is not finite.
fn misplaced(run: &dyn Run) -> usize {
    let mesh = &run.plan().mesh;
    run.particles().position.iter().filter(|&&p| !mesh.holds(p)).count()
}

impl Trial {
    /// Runs the trial. A scene that cannot be run is a failure with a reason.
    pub fn run(&self) -> Outcome {
        let mut steps = 0;
        // A panic in one trial must not stop the others.
        let attempt = catch_unwind(AssertUnwindSafe(|| self.attempt(&mut steps)));
        let failed = |reason: String| (Verdict::Fail(reason), None);
        let (checks, (verdict, tightest)) = match attempt {
            Ok(Ok(checks)) => {
                let judged = judge(&checks);
                (checks, judged)
            }
            Ok(Err(e)) => (vec![], failed(e.to_string().replace('\n', " "))),
            Err(_) => (vec![], failed("the program panicked".into())),
        };
        let (group, name) = (self.group, self.name.clone());
        Outcome { group, name, verdict, steps, tightest, checks }
    }

    /// Runs the trial and returns its checks; `steps` counts the steps taken.
    fn attempt(&self, steps: &mut u64) -> Result<Vec<Check>, CaseError> {
        let plan = plan_of(&self.scene)?;
        let mut run = sim::start(Arc::new(plan))?;
        let first = First::new(run.as_ref());
        let mut worst = Worst::default();
        worst.observe(run.as_ref(), &first);
        if self.steps > 0 {
            march(run.as_mut(), |run, _| {
                *steps += 1;
                worst.observe(run, &first);
                if *steps < self.steps { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            })?;
        }
        let row = run.row();
        if !self.drifts && row.step >= ENERGY_STEPS {
            raise(&mut worst.energy, row.energy_error.abs());
        }
        let mut checks = worst.checks(self.drifts, Criteria::of(run.plan()));
        if let Some(expect) = &self.expect {
            checks.extend(expect(run.as_ref())?);
        }
        Ok(checks)
    }
}

/// Runs trials on all processors. Outcomes are in the order of the trials; `announce` is called
/// with the number of finished trials and each outcome.
pub fn run_all(trials: &[Trial], announce: impl Fn(usize, &Outcome) + Sync) -> Vec<Outcome> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(trial) = trials.get(index) else { return };
            let outcome = threads::alone(|| trial.run());
            let mut done = done.lock().unwrap_or_else(|e| e.into_inner());
            announce(done.len() + 1, &outcome);
            done.push((index, outcome));
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, |n| n.get()).min(trials.len());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(work);
        }
    });
    let mut done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    done.sort_by_key(|d| d.0);
    done.into_iter().map(|d| d.1).collect()
}

/// Writes the scene of a failed trial and the reason to a new folder below `folder`, and returns
/// that folder.
pub fn keep(folder: &Path, trial: &Trial, outcome: &Outcome) -> std::io::Result<PathBuf> {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    let words = format!("{} {}", trial.group, trial.name).to_lowercase();
    let name: Vec<String> = words.split(' ').map(|w| w.chars().map(plain).collect()).collect();
    let place = folder.join(name.join("_"));
    std::fs::create_dir_all(&place)?;
    std::fs::write(place.join("scene.toml"), trial.scene.text())?;
    let mut text = format!(
        "{}: {}\n{}\n\ngrainscope run scene.toml --steps {}\n\n",
        trial.group, trial.name, outcome.verdict, trial.steps
    );
    for c in &outcome.checks {
        text += &format!("{}: {:.3e}, must be {}\n", c.what, c.value, c.bound);
    }
    std::fs::write(place.join("reason.txt"), text)?;
    Ok(place)
}

#[cfg(test)]
mod tests {
    use super::super::trials::trial;
    use super::*;
    use crate::scene;
    use crate::testing::TempFolder;

    const DROP: &str = "schema = 1\nname = \"drop\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\n\
                        y = [0, 1]\n[accuracy]\ncells = 4\n[time]\nend = 1\n[materials.a]\n\
                        shear_viscosity = 1\ndensity = 1\n[[regions]]\nmaterial = \"a\"\n";

    #[test]
    fn a_failed_trial_has_a_reason_and_keeps_its_scene() {
        let never = |_: &dyn Run| Ok(vec![Check::new("speed", 1.0, Bound::AtMost(0.5))]);
        let bad = trial("bad", "too fast: 1/2", DROP.into(), 1).expecting(never);
        let outcome = bad.run();
        assert_eq!(outcome.verdict.to_string(), "fail: speed is 1.00e0, must be at most 0.5");
        let here = TempFolder::new().expect("a folder");
        let place = keep(here.path(), &bad, &outcome).expect("written");
        let kept = scene::load(place.join("scene.toml")).expect("there");
        plan_of(&kept).expect("a scene that can be run");
        let reason = std::fs::read_to_string(place.join("reason.txt")).expect("there");
        assert!(reason.contains("fail: speed") && reason.contains("--steps 1"), "{reason}");
    }

    #[test]
    fn a_solve_that_does_not_converge_fails_with_a_reason() {
        let text = DROP.replace("cells = 4", "cells = 4\nmax_corrections = 1\ntolerance = 1e-14")
            + "shape.where = \"x < 0.3\"\n[materials.b]\nshear_viscosity = 1e-7\nbackground = true\n";
        let outcome = trial("bad", "one correction", text, 1).run();
        assert!(outcome.verdict.to_string().contains("no convergence"), "{}", outcome.verdict);
        assert_eq!(outcome.steps, 0);
    }

    #[test]
    fn outcomes_keep_the_order_of_trials() {
        let list = ["a", "b", "c"].map(|name| trial("rest", name, DROP.into(), 1));
        let outcomes = run_all(&list, |_, _| ());
        assert_eq!(outcomes.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["a", "b", "c"]);
        assert!(outcomes.iter().all(|o| !o.verdict.is_failure()), "{outcomes:?}");
    }
}
