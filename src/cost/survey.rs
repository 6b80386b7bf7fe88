//! Makes a cost table: chooses which runs are made, in which order, and when to stop.

mod combine;

use super::CostError;
use super::coarse::Coarse;
use super::effort::{Effort, Limits};
use super::knobs::{Design, rung};
use super::list::{GaugeLine, Growth, List, Machine, Noise, ReferenceLine, SCHEMA};
use super::measure::{Pilot, Sample, Target, run};
use super::planning::{planned, shortened};
use super::reference::Reference;
use crate::cases::exact_of;
use crate::plan::Plan;
use crate::scene::{Interesting, Moment, Placement, Scene, SceneSource, Scope, parse};
use crate::words::count;
use std::time::Instant;

/// CPU and wall-clock time of each run, s.
type Times = Vec<[f64; 2]>;

/// CPU times, s, and how often shorter runs are repeated: short runs are noisier and cheap.
const REPEATS: [(f64, usize); 3] = [(0.1, 5), (0.4, 3), (1.0, 2)];

/// Random seeds whose spread is the sampling error.
const SEEDS: [u64; 3] = [11, 12, 13];

/// Runs that take less than this multiple of [`Limits::base`] are shortened less.
const LONG: f64 = 20.0;

/// Smallest number of steps of a shortened run.
const LEAST_STEPS: f64 = 6.0;

/// Share of the total time that may be spent on coarse runs to the end of the scene.
const COARSE_SHARE: f64 = 0.25;

/// A candidate that was run.
struct Ran {
    /// Index of the level of each knob.
    settings: Vec<usize>,
    sample: Sample,
    repeats: usize,
}

/// State of a survey: everything needed while a table is made.
struct Survey<'a> {
    source: SceneSource,
    target: Target,
    limits: Limits,
    design: Design,
    clock: Instant,
    say: &'a mut dyn FnMut(&str),
    ran: Vec<Ran>,
    failed: Vec<String>,
    skipped: Vec<String>,
    /// Growth of the error from the horizon to the end of the scene.
    growth: Option<Growth>,
}

/// Makes the cost table of a scene. `say` receives progress messages.
pub fn price(
    source: &SceneSource,
    effort: Effort,
    machine: Machine,
    say: &mut dyn FnMut(&str),
) -> Result<List, CostError> {
    let clock = Instant::now();
    let scene = parse(source)?;
    let plan = planned(source, &[])?;
    let target = Target::of(&scene).map_err(|e| e.with_source(source))?;
    let mut limits = effort.limits();
    let full = scene.time.end()?.eval(&Scope::new(&scene)?)?;
    let pilot = Pilot::run(plan.clone(), 0.5 * limits.base)?;
    let coarse = if target.at != Moment::Start && pilot.whole() > limits.base {
        Coarse::run(source, &scene, &target, &pilot, COARSE_SHARE * limits.total)?
    } else {
        None
    };
    let whole_seconds = coarse.as_ref().map_or(1.0, |c| c.forecast) * pilot.whole();
    if whole_seconds < LONG * limits.base {
        // No coarse runs to the end are needed; their time is used for a longer horizon.
        limits.base *= 2.0;
    }
    let mut horizon = full;
    let mut short = source.clone();
    let mut cuts = vec![];
    if target.at != Moment::Start && whole_seconds > limits.base {
        let share = (limits.base - pilot.start) / (whole_seconds - pilot.start);
        // With fewer steps the start would dominate the time.
        let least = LEAST_STEPS / pilot.steps.max(LEAST_STEPS);
        let (sets, end) = shortened(&scene, share.max(least))?;
        short = source.with_sets(&sets)?;
        horizon = end;
        cuts = sets;
    }
    let exact = exact_of(&scene).filter(|_| target.is_field());
    let factors = if exact.is_some() { limits.factors_exact } else { limits.factors };
    let design = Design::new(&scene, &plan, target.at, factors)?;
    say(&format!(
        "{}: {}; {}; a whole run takes about {:.1} s of CPU time",
        scene.name,
        target.title(),
        count(design.knobs.len(), "knob"),
        whole_seconds
    ));
    let mut survey = Survey {
        source: short,
        target,
        limits,
        design,
        clock,
        say,
        ran: vec![],
        failed: vec![],
        skipped: vec![],
        growth: None,
    };
    let noise = survey.base()?;
    let base = survey.ran[0].sample.clone();
    let mut gauges = vec![];
    let whole = match &coarse {
        Some(coarse) if horizon < full => survey.beyond(coarse)?,
        _ => None,
    };
    survey.growth = whole.map(|w| w.0);
    let reference = match exact {
        Some(exact) => {
            let at = |p: [f64; 2]| ((exact.velocity)(p[0], p[1]), (exact.pressure)(p[0], p[1]));
            Reference::exact(survey.target.field(&plan, at), &survey.target)
        }
        None => survey.ladder(&scene, &base, &mut gauges)?,
    };
    let (sampling, gauge_sampling) = survey.sampling(&scene, &plan, &reference)?;
    // Runs that vary a single knob leave time for combinations, which are the main result.
    let total = survey.limits.total;
    survey.limits.total = 0.75 * total;
    survey.one_by_one()?;
    survey.limits.total = total;
    for _ in 0..survey.limits.rounds {
        survey.combine(&reference)?;
    }
    let whole_run = match (whole, survey.target.at) {
        (Some((_, ratio)), _) => ratio,
        (None, Moment::End | Moment::Peak) if horizon == full => 1.0,
        _ => whole_seconds / base.took.cpu.max(1e-9),
    };
    let names = plan.gauges.iter().map(|g| g.name.clone());
    let gauge_lines = names
        .enumerate()
        .map(|(k, name)| GaugeLine {
            priced: survey.target.quantity == Interesting::Gauge(name.clone()),
            name,
            uncertainty: gauges.get(k).map_or(0.0, |r: &Reference| r.uncertainty),
            sampling: gauge_sampling.get(k).copied().unwrap_or(0.0),
        })
        .collect();
    let (knobs, entries, front) = survey.entries(&reference, &gauges);
    Ok(List {
        schema: SCHEMA,
        scene: scene.name.clone(),
        version: env!("CARGO_PKG_VERSION").into(),
        quick: effort == Effort::Quick,
        machine,
        quantity: survey.target.title(),
        norm: survey.target.norm_title().into(),
        floor: survey.target.floor,
        horizon: [if survey.target.at == Moment::Start { 0.0 } else { horizon }, full],
        shortened: cuts,
        reference: ReferenceLine {
            kind: reference.kind,
            value: (!survey.target.is_field()).then(|| reference.value[0]),
            uncertainty: reference.uncertainty,
            rate: reference.rate,
        },
        noise,
        sampling,
        gauges: gauge_lines,
        knobs,
        entries,
        front,
        failed: survey.failed,
        skipped: survey.skipped,
        whole_run,
        growth: survey.growth,
        made_in: clock.elapsed().as_secs_f64(),
    })
}

impl Survey<'_> {
    fn elapsed(&self) -> f64 {
        self.clock.elapsed().as_secs_f64()
    }

    /// Runs once. A failed run is recorded and gives `None`; an invalid scene is an error.
    fn sample(&mut self, label: &str, sets: &[String]) -> Result<Option<Sample>, CostError> {
        let plan = planned(&self.source, sets)?;
        match run(plan, &self.target, |_, _| {}) {
            Ok(sample) => Ok(Some(sample)),
            Err(e) => {
                (self.say)(&format!("  {label}: {e}"));
                self.failed.push(format!("{label}: {e}"));
                Ok(None)
            }
        }
    }

    /// Runs at least `least` times, and more often if runs are short. Returns the fastest run and
    /// the times of all runs.
    fn best_of(
        &mut self,
        label: &str,
        sets: &[String],
        least: usize,
    ) -> Result<Option<(Sample, Times)>, CostError> {
        let Some(mut best) = self.sample(label, sets)? else { return Ok(None) };
        let mut took = vec![[best.took.cpu, best.took.wall]];
        let more = REPEATS.iter().find(|(s, _)| best.took.cpu < *s).map_or(1, |r| r.1).max(least);
        while took.len() < more {
            let Some(again) = self.sample(label, sets)? else { break };
            took.push([again.took.cpu, again.took.wall]);
            best.took.wall = best.took.wall.min(again.took.wall);
            if again.took.cpu < best.took.cpu {
                best.took.cpu = again.took.cpu;
                best.phases = again.phases;
            }
        }
        (self.say)(&format!(
            "  {label}: {:.3} s of CPU time, best of {}",
            best.took.cpu,
            took.len()
        ));
        Ok(Some((best, took)))
    }

    /// Runs the scene's own settings often enough to measure the timing noise of the machine.
    fn base(&mut self) -> Result<Noise, CostError> {
        let settings = self.design.base();
        let label = self.design.label(&settings);
        let Some((sample, took)) = self.best_of(&label, &[], 3)? else {
            let why = self.failed.join("; ");
            return Err(CostError::Useless(format!(
                "the scene does not run with its own settings, so there is nothing to vary: {why}"
            )));
        };
        let spread = |k: usize| {
            let [low, high] = took
                .iter()
                .map(|t| t[k])
                .fold([f64::INFINITY, 0.0], |[l, h], t| [f64::min(l, t), f64::max(h, t)]);
            high / low.max(1e-9) - 1.0
        };
        let noise = Noise { cpu: spread(0), wall: spread(1), repeats: took.len() };
        self.ran.push(Ran { settings, sample, repeats: took.len() });
        Ok(noise)
    }

    /// Growth of the error between the horizon and the end of the scene, and the ratio of the times
    /// of whole and shortened runs, both from coarse runs.
    fn beyond(&mut self, coarse: &Coarse) -> Result<Option<(Growth, f64)>, CostError> {
        let mut near = vec![];
        for n in coarse.cells {
            near.extend(self.sample(&format!("cells {n}"), &[format!("accuracy.cells={n}")])?);
        }
        let [rough, fine] = &near[..] else { return Ok(None) };
        Ok(Some(coarse.beyond([rough, fine], &self.target)))
    }

    /// Computes a reference without an exact solution, from a coarser and a finer resolution beside
    /// the scene's own.
    fn ladder(
        &mut self,
        scene: &Scene,
        base: &Sample,
        gauges: &mut Vec<Reference>,
    ) -> Result<Reference, CostError> {
        let ratio = self.limits.ratio;
        let mut rungs = vec![];
        for (label, ratio) in [("coarse resolution", 1.0 / ratio), ("reference", ratio)] {
            let sets = rung(scene, ratio, self.target.at)?;
            (self.say)(&format!("  {label}: {}", sets.join(" ")));
            let Some(sample) = self.sample(label, &sets)? else {
                let why = self.failed.join("; ");
                return Err(CostError::Useless(format!("the reference cannot be computed: {why}")));
            };
            (self.say)(&format!("  {label}: {:.3} s of CPU time", sample.took.cpu));
            rungs.push(sample);
        }
        let counter = Target { quantity: Interesting::MaxSpeed, ..self.target.clone() };
        for k in 0..base.gauges.len() {
            let [q0, q1, q2] = [&rungs[0], base, &rungs[1]].map(|s| [s.gauges[k]]);
            gauges.push(Reference::ladder([&q0, &q1, &q2], ratio, &counter));
        }
        let values = [&rungs[0].value[..], &base.value, &rungs[1].value];
        Ok(Reference::ladder(values, ratio, &self.target))
    }

    /// True if there is time for a run of `seconds` of wall-clock time; records runs that are left
    /// out.
    fn allows(&mut self, label: &str, seconds: f64) -> bool {
        let fits = self.elapsed() + seconds < self.limits.total;
        if !fits {
            self.skipped.push(label.to_string());
        }
        fits
    }

    /// Runs a candidate unless it has been run or would take too long. `guess` is its expected
    /// wall-clock time, s.
    fn candidate(&mut self, settings: Vec<usize>, guess: f64) -> Result<(), CostError> {
        if self.ran.iter().any(|r| r.settings == settings) {
            return Ok(());
        }
        let label = self.design.label(&settings);
        if !self.allows(&label, guess) {
            return Ok(());
        }
        let sets = self.design.sets(&settings);
        if let Some((sample, took)) = self.best_of(&label, &sets, 1)? {
            self.ran.push(Ran { settings, sample, repeats: took.len() });
        }
        Ok(())
    }

    /// Varies each knob alone around the scene's own settings: first knobs with sizes, from the
    /// cheapest, then choices.
    fn one_by_one(&mut self) -> Result<(), CostError> {
        let base = self.ran[0].sample.took.wall;
        let mut list = vec![];
        for (k, knob) in self.design.knobs.iter().enumerate() {
            for (l, level) in knob.levels.iter().enumerate() {
                // The time grows with the square of the cells per side, and with the number of
                // steps.
                let guess = base * level.size.map_or(1.5, |h| h.powf(-2.5).clamp(0.1, 30.0));
                list.push((self.design.one(k, l), guess, level.size.is_none()));
            }
        }
        list.sort_by(|a, b| a.2.cmp(&b.2).then(a.1.total_cmp(&b.1)));
        list.into_iter().try_for_each(|(settings, guess, _)| self.candidate(settings, guess))
    }

    /// Relative standard deviation over other particle placements and random directors, of the
    /// quantity and of each gauge. `None` if there was no time for two runs.
    fn sampling(
        &mut self,
        scene: &Scene,
        plan: &Plan,
        reference: &Reference,
    ) -> Result<(Option<f64>, Vec<f64>), CostError> {
        let e = &plan.effects;
        if plan.state.materials.len() < 2
            && !(e.directors || e.carried_viscosity || e.carried_density)
        {
            // All particles are identical, so their positions make no difference.
            return Ok((Some(0.0), vec![]));
        }
        let mut found: Vec<Sample> = vec![];
        for seed in SEEDS {
            let mut sets = vec![format!("accuracy.seed={seed}")];
            if scene.accuracy.placement == Placement::Regular {
                sets.push("accuracy.placement=jittered".into());
            }
            let guess = 1.2 * self.ran[0].sample.took.wall;
            let label = format!("seed {seed}");
            if self.allows(&label, guess)
                && let Some(sample) = self.sample(&label, &sets)?
            {
                found.push(sample);
            }
        }
        if found.len() < 2 {
            return Ok((None, vec![]));
        }
        let n = found.len() as f64;
        // Standard deviation about the mean, in the norm of the quantity.
        let spread = |read: &dyn Fn(&Sample) -> Vec<f64>, scale: f64| {
            let values: Vec<Vec<f64>> = found.iter().map(read).collect();
            let mean: Vec<f64> = (0..values[0].len())
                .map(|i| values.iter().map(|v| v[i]).sum::<f64>() / n)
                .collect();
            let squares: f64 =
                values.iter().map(|v| self.target.distance(v, &mean, scale).powi(2)).sum();
            (squares / (n - 1.0)).sqrt()
        };
        let all = spread(&|s| s.value.clone(), reference.scale);
        let gauges = (0..found[0].gauges.len())
            .map(|k| spread(&|s| vec![s.gauges[k]], found[0].gauges[k].abs()))
            .collect();
        (self.say)(&format!("  sampling: {:.2e} over {}", all, count(found.len(), "seed")));
        Ok((Some(all), gauges))
    }
}
