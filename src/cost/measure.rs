//! Running a candidate: what it finds and what it takes.

use crate::plan::Plan;
use crate::scene::{Interest, Interesting, Moment, Norm, Quantity, Scene, SceneError, Scope};
use crate::sim::row::{Phases, Row};
use crate::sim::{self, Run, SimError};
use crate::threads;
use std::sync::Arc;
use std::time::Instant;

/// Points along a side at which fields are compared: a prime, so that hardly any lies on a mesh
/// line, where the pressure jumps.
const SIDE: usize = 61;

/// What is measured of a run.
#[derive(Clone, Debug)]
pub struct Target {
    pub quantity: Interesting,
    pub at: Moment,
    pub norm: Norm,
    /// SI
    pub floor: f64,
}

impl Target {
    /// What the scene declares, or the volume through its first gauge, or its velocity.
    pub fn of(scene: &Scene) -> Result<Target, SceneError> {
        let interest = scene.interest.clone().unwrap_or_else(|| Interest {
            quantity: match scene.gauges.first() {
                Some(g) => Interesting::Gauge(g.name.clone()),
                None => Interesting::Velocity,
            },
            at: Moment::End,
            norm: Norm::L2,
            floor: Quantity::number(0.0),
        });
        let floor = interest.floor.eval(&Scope::new(scene)?)?;
        Ok(Target { quantity: interest.quantity, at: interest.at, norm: interest.norm, floor })
    }

    pub fn is_field(&self) -> bool {
        use Interesting::{Pressure, Rotation, Velocity};
        matches!(self.quantity, Velocity | Rotation | Pressure)
    }

    /// In words: `volume through "outflow" at the end`.
    pub fn title(&self) -> String {
        let what = match &self.quantity {
            Interesting::Gauge(name) => format!("volume through `{name}`"),
            Interesting::Rate(name) => format!("rate through `{name}`"),
            Interesting::RmsSpeed => "rms speed".into(),
            Interesting::MaxSpeed => "largest speed".into(),
            Interesting::Alignment => "mean alignment |n_x|".into(),
            Interesting::Dissipation => "dissipation".into(),
            Interesting::Velocity => "velocity field".into(),
            Interesting::Rotation => "rotation field".into(),
            Interesting::Pressure => "pressure field".into(),
        };
        let when = match self.at {
            Moment::Start => "at the start",
            Moment::End => "at the end",
            Moment::Peak => "at its peak",
        };
        format!("{what} {when}")
    }

    /// The norm in words.
    pub fn norm_title(&self) -> &'static str {
        match (self.is_field(), self.norm) {
            (false, _) => "relative difference",
            (true, Norm::L2) => "relative L2 norm",
            (true, Norm::Max) => "relative largest difference",
        }
    }

    /// The number a row holds; zero for a field.
    pub fn scalar(&self, plan: &Plan, row: &Row) -> f64 {
        let gauge = |name: &str| plan.gauges.iter().position(|g| g.name == name);
        match &self.quantity {
            Interesting::Gauge(name) => gauge(name).map_or(0.0, |k| row.gauges[k].volume),
            Interesting::Rate(name) => gauge(name).map_or(0.0, |k| row.gauges[k].rate),
            Interesting::RmsSpeed => row.rms_speed,
            Interesting::MaxSpeed => row.max_speed,
            Interesting::Alignment => row.alignment.unwrap_or(0.0),
            Interesting::Dissipation => row.dissipation,
            Interesting::Velocity | Interesting::Rotation | Interesting::Pressure => 0.0,
        }
    }

    /// The quantity at the current instant: one number, or a field's values at the common points.
    pub fn read(&self, run: &dyn Run) -> Vec<f64> {
        let plan = run.plan();
        if !self.is_field() {
            return vec![self.scalar(plan, run.row())];
        }
        self.field(plan, |p| (run.velocity_at(p), run.pressure_at(p)))
    }

    /// A field's values at the common points, from velocity with rotation, and pressure.
    pub fn field(&self, plan: &Plan, at: impl Fn([f64; 2]) -> ([f64; 3], f64)) -> Vec<f64> {
        let mut values = Vec::with_capacity(2 * SIDE * SIDE);
        for p in points(plan) {
            let (v, pressure) = at(p);
            match self.quantity {
                Interesting::Rotation => values.push(v[2]),
                Interesting::Pressure => values.push(pressure),
                _ => values.extend([v[0], v[1]]),
            }
        }
        for v in &mut values {
            // Inside solids there is no field.
            if !v.is_finite() {
                *v = 0.0;
            }
        }
        if self.quantity == Interesting::Pressure && plan.boundary.closed {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter_mut().for_each(|v| *v -= mean);
        }
        values
    }

    /// The norm of values or of their difference to others.
    pub fn size(&self, values: impl Iterator<Item = f64>) -> f64 {
        match self.norm {
            Norm::Max => values.fold(0.0, |m: f64, v| m.max(v.abs())),
            Norm::L2 => {
                let (sum, n) = values.fold((0.0, 0usize), |(s, n), v| (s + v * v, n + 1));
                (sum / n.max(1) as f64).sqrt()
            }
        }
    }

    /// `|a - b| / scale`
    pub fn distance(&self, a: &[f64], b: &[f64], scale: f64) -> f64 {
        let size = self.size(a.iter().zip(b).map(|(a, b)| a - b));
        if scale > 0.0 { size / scale } else { size }
    }
}

/// SI points common to all candidates.
fn points(plan: &Plan) -> impl Iterator<Item = [f64; 2]> {
    let l = plan.units.length;
    let axis = |a: &crate::space::mesh::Axis| (a.start() * l, (a.end() - a.start()) * l);
    let ((x0, w), (y0, h)) = (axis(&plan.mesh.x), axis(&plan.mesh.y));
    let share = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    (0..SIDE * SIDE).map(move |k| [x0 + w * share(k % SIDE), y0 + h * share(k / SIDE)])
}

/// What a run found and took.
#[derive(Clone, Debug)]
pub struct Sample {
    pub value: Vec<f64>,
    /// Volumes that the gauges have counted.
    pub gauges: Vec<f64>,
    pub took: Took,
    pub phases: Phases,
    pub steps: u64,
    pub unknowns: usize,
    pub particles: usize,
}

/// Seconds of processor and wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Took {
    pub cpu: f64,
    pub wall: f64,
}

impl Took {
    fn add(&mut self, o: Took) {
        self.cpu += o.cpu;
        self.wall += o.wall;
    }
}

/// Seconds that this thread has spent on a processor: what others do on the machine does not
/// count. `None` where the system does not tell.
pub fn thread_seconds() -> Option<f64> {
    // The kernel brings its account up to date when a thread yields, else with its tick of some
    // milliseconds.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let ns: f64 = text.split_whitespace().next()?.parse().ok()?;
    (ns > 0.0).then_some(ns * 1e-9)
}

/// Runs something on this thread alone and says what it took; without a clock of the processor its
/// time is the wall's.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Took) {
    let (wall, cpu) = (Instant::now(), thread_seconds());
    let result = threads::alone(work);
    let wall = wall.elapsed().as_secs_f64();
    let cpu = match (cpu, thread_seconds()) {
        (Some(before), Some(after)) => after - before,
        _ => wall,
    };
    (result, Took { cpu, wall })
}

/// Runs a plan until its target is known. `watch` sees each instant and the time taken so far,
/// which does not count what `watch` does itself.
pub fn run(
    plan: Arc<Plan>,
    target: &Target,
    mut watch: impl FnMut(&dyn Run, Took),
) -> Result<Sample, SimError> {
    let (run, mut took) = timed(|| sim::start(plan.clone()));
    let mut run = run?;
    let mut phases = run.row().seconds;
    let mut peak = target.scalar(&plan, run.row());
    watch(run.as_ref(), took);
    while target.at != Moment::Start && !run.is_finished() {
        let (outcome, step) = timed(|| run.step());
        outcome?;
        took.add(step);
        phases.add(&run.row().seconds);
        let now = target.scalar(&plan, run.row());
        if now.abs() > peak.abs() {
            peak = now;
        }
        watch(run.as_ref(), took);
    }
    let value = if target.at == Moment::Peak { vec![peak] } else { target.read(run.as_ref()) };
    let row = run.row();
    Ok(Sample {
        value,
        gauges: row.gauges.iter().map(|g| g.volume).collect(),
        took,
        phases,
        steps: row.step,
        unknowns: run.unknowns().iter().sum(),
        particles: row.particles,
    })
}

/// The upper median, `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Seconds of the wall that a step takes on all threads, judged from a few.
pub fn wall_of_a_step(plan: Arc<Plan>, patience: f64) -> Result<f64, SimError> {
    let clock = Instant::now();
    let mut run = sim::start(plan)?;
    let mut seconds = vec![];
    while !run.is_finished()
        && (seconds.len() < 3
            || seconds.len() < PILOT_STEPS as usize && clock.elapsed().as_secs_f64() < patience)
    {
        run.step()?;
        seconds.push(run.row().wall);
    }
    Ok(median(seconds).unwrap_or(0.0))
}

/// What a whole run would take, judged from its first steps.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// Seconds of set-up and first solution, of a processor.
    pub start: f64,
    pub step: f64,
    pub steps: f64,
}

/// Most steps of a pilot.
const PILOT_STEPS: u32 = 12;

impl Pilot {
    /// Takes steps until `patience` seconds are over.
    pub fn run(plan: Arc<Plan>, patience: f64) -> Result<Pilot, SimError> {
        let clock = Instant::now();
        let (run, start) = timed(|| sim::start(plan.clone()));
        let mut run = run?;
        let end = plan.clock.end * plan.units.time;
        let (mut cpu, mut count) = (vec![], 0);
        while !run.is_finished()
            && (count < 3 || count < PILOT_STEPS && clock.elapsed().as_secs_f64() < patience)
        {
            let (outcome, took) = timed(|| run.step());
            outcome?;
            cpu.push(took.cpu);
            count += 1;
        }
        let row = run.row();
        let left = if row.dt > 0.0 { (end - row.time) / row.dt } else { 0.0 };
        // The first step solves twice; the median does not see it.
        let step = median(cpu).unwrap_or(0.0);
        Ok(Pilot { start: start.cpu, step, steps: f64::from(count) + left.max(0.0) })
    }

    /// Seconds of the whole run.
    pub fn whole(&self) -> f64 {
        self.start + self.step * (self.steps + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn norms() {
        let mut t =
            Target { quantity: Interesting::Velocity, at: Moment::End, norm: Norm::L2, floor: 0.0 };
        assert!((t.distance(&[3.0, 0.0], &[0.0, 4.0], 2.0) - 12.5f64.sqrt() / 2.0).abs() < 1e-15);
        t.norm = Norm::Max;
        assert_eq!(t.distance(&[3.0, 0.0], &[0.0, 4.0], 2.0), 2.0);
        assert_eq!(t.distance(&[3.0], &[1.0], 0.0), 2.0, "absolute where there is no scale");
    }

    #[test]
    fn scenes_that_say_nothing_have_a_default() {
        let scene = |text: &str| {
            let s = crate::scene::presets::find(text).expect("listed");
            crate::scene::parse(&s).expect("valid")
        };
        let mut silo = scene("silo");
        silo.interest = None;
        let target = Target::of(&silo).expect("valid");
        assert_eq!(target.quantity, Interesting::Gauge("outflow".into()));
        let mut solcx = scene("solcx");
        solcx.interest = None;
        assert_eq!(Target::of(&solcx).expect("valid").quantity, Interesting::Velocity);
    }
}
