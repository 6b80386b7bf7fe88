//! Runs a candidate and measures its result and its time.

use crate::plan::Plan;
use crate::scene::{Interest, Interesting, Moment, Norm, Quantity, Scene, SceneError, Scope};
use crate::session::{Took, march, timed};
use crate::sim::phases::Phases;
use crate::sim::row::Row;
use crate::sim::{self, Run, SimError};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Number of points along a side at which fields are compared. It is prime, so that hardly any
/// point lies on a mesh line, where the pressure jumps.
const SIDE: usize = 61;

/// The quantity of interest of a run, and the norm of its error.
#[derive(Clone, Debug)]
pub struct Target {
    /// Quantity whose error is measured.
    pub quantity: Interesting,
    /// Time at which it is measured.
    pub at: Moment,
    /// Norm of differences between fields.
    pub norm: Norm,
    /// Smallest scale of relative errors, SI units.
    pub floor: f64,
}

impl Target {
    /// The interest that the scene declares; by default the volume through its first gauge, or its
    /// velocity field.
    pub fn of(scene: &Scene) -> Result<Target, SceneError> {
        let interest = scene.interest.clone().unwrap_or_else(|| Interest {
            quantity: match scene.gauges.iter().find(|g| g.on.is_none()) {
                Some(g) => Interesting::Gauge(g.name.clone()),
                None => Interesting::Velocity,
            },
            at: Moment::End,
            norm: Norm::L2,
            floor: Quantity::number(0.0),
        });
        let floor = interest.floor.eval(&Scope::new(scene)?)?;
        let (mut quantity, mut at) = (interest.quantity, interest.at);
        if scene.time.steady {
            // No time passes, so no volume.
            at = Moment::Start;
            if let Interesting::Gauge(name) = quantity {
                quantity = Interesting::Rate(name);
            }
        }
        Ok(Target { quantity, at, norm: interest.norm, floor })
    }

    /// True for a field, false for a single number.
    pub fn is_field(&self) -> bool {
        use Interesting::{Pressure, Rotation, Velocity};
        matches!(self.quantity, Velocity | Rotation | Pressure)
    }

    /// Description, such as ``volume through `outflow` at the end``.
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

    /// Description of the norm.
    pub fn norm_title(&self) -> &'static str {
        match (self.is_field(), self.norm) {
            (false, _) => "relative difference",
            (true, Norm::L2) => "relative L2 norm",
            (true, Norm::Max) => "relative largest difference",
        }
    }

    /// Value of the quantity in a row, SI units; zero for a field.
    pub fn scalar(&self, plan: &Plan, row: &Row) -> f64 {
        let gauge = |name: &str| plan.gauges.iter().position(|g| g.name == name);
        match &self.quantity {
            Interesting::Gauge(name) => gauge(name).map_or(0.0, |k| row.gauges[k].volume),
            Interesting::Rate(name) => gauge(name).map_or(0.0, |k| row.gauges[k].rate),
            Interesting::RmsSpeed => row.rms_speed,
            Interesting::MaxSpeed => row.max_speed,
            Interesting::Alignment => row.mean_alignment.unwrap_or(0.0),
            Interesting::Dissipation => row.dissipation,
            Interesting::Velocity | Interesting::Rotation | Interesting::Pressure => 0.0,
        }
    }

    /// Value of the quantity at the current time: one number, or a field at the sample points.
    pub fn read(&self, run: &dyn Run) -> Vec<f64> {
        let plan = run.plan();
        if !self.is_field() {
            return vec![self.scalar(plan, run.row())];
        }
        self.field(plan, |p| (run.velocity_at(p), run.pressure_at(p)))
    }

    /// Values of the field at the sample points. `at` gives velocity with rotation, and pressure.
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
            // Fields are not defined inside solids.
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

    /// Norm of a list of values.
    pub fn size(&self, values: impl Iterator<Item = f64>) -> f64 {
        match self.norm {
            Norm::Max => values.fold(0.0, |m: f64, v| m.max(v.abs())),
            Norm::L2 => {
                let (sum, n) = values.fold((0.0, 0usize), |(s, n), v| (s + v * v, n + 1));
                (sum / n.max(1) as f64).sqrt()
            }
        }
    }

    /// `|a - b| / scale`; `|a - b|` if the scale is zero.
    pub fn distance(&self, a: &[f64], b: &[f64], scale: f64) -> f64 {
        let size = self.size(a.iter().zip(b).map(|(a, b)| a - b));
        if scale > 0.0 { size / scale } else { size }
    }
}

/// Sample points common to all candidates, m.
fn points(plan: &Plan) -> impl Iterator<Item = [f64; 2]> {
    let l = plan.units.length;
    let axis = |a: &crate::space::mesh::Axis| (a.start() * l, (a.end() - a.start()) * l);
    let ((x0, w), (y0, h)) = (axis(&plan.mesh.x), axis(&plan.mesh.y));
    let share = |i: usize| (i as f64 + 0.5) / SIDE as f64;
    (0..SIDE * SIDE).map(move |k| [x0 + w * share(k % SIDE), y0 + h * share(k / SIDE)])
}

/// Result and time of a run.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Quantity of interest: one number, or a field at the sample points; SI units.
    pub value: Vec<f64>,
    /// Volume through each gauge, SI units.
    pub gauges: Vec<f64>,
    /// Time of the run.
    pub took: Took,
    /// Wall-clock time of each phase, s.
    pub phases: Phases,
    /// Number of steps.
    pub steps: u64,
    /// Number of unknowns of a solution.
    pub unknowns: usize,
    /// Number of particles at the end.
    pub particles: usize,
}

/// Runs a plan until its target is known. `watch` is called at the start and after each step with
/// the time taken so far, which excludes the time of `watch`.
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
    if target.at != Moment::Start {
        march(run.as_mut(), |run, step| {
            took.add(step);
            phases.add(&run.row().seconds);
            let now = target.scalar(&plan, run.row());
            if now.abs() > peak.abs() {
                peak = now;
            }
            watch(run, took);
            ControlFlow::Continue(())
        })?;
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

/// The upper median; `None` for an empty list.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Median wall-clock time of the first steps on all threads, s. At least three steps are taken, and
/// more until `patience` seconds have passed.
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

/// Time of a whole run, extrapolated from its first steps.
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// CPU time of the set-up and the first solution, s.
    pub start: f64,
    /// Median CPU time of a step, s.
    pub step: f64,
    /// Expected number of steps of the whole run.
    pub steps: f64,
}

/// Largest number of steps of a pilot run.
const PILOT_STEPS: u32 = 12;

impl Pilot {
    /// Takes at least three steps, and more until `patience` seconds of wall-clock time have
    /// passed.
    pub fn run(plan: Arc<Plan>, patience: f64) -> Result<Pilot, SimError> {
        let clock = Instant::now();
        let (run, start) = timed(|| sim::start(plan.clone()));
        let mut run = run?;
        let end = plan.clock.end * plan.units.time;
        let mut cpu = vec![];
        if !run.is_finished() {
            march(run.as_mut(), |_, took| {
                cpu.push(took.cpu);
                let patient = clock.elapsed().as_secs_f64() < patience;
                let go_on = cpu.len() < 3 || cpu.len() < PILOT_STEPS as usize && patient;
                if go_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            })?;
        }
        let count = cpu.len() as u32;
        let row = run.row();
        let left = if row.dt > 0.0 { (end - row.time) / row.dt } else { 0.0 };
        // The first step solves twice; the median ignores it.
        let step = median(cpu).unwrap_or(0.0);
        Ok(Pilot { start: start.cpu, step, steps: f64::from(count) + left.max(0.0) })
    }

    /// CPU time of the whole run, s.
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
        assert_eq!(t.distance(&[3.0], &[1.0], 0.0), 2.0, "absolute without a scale");
    }

    #[test]
    fn scenes_without_an_interest_have_a_default() {
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
