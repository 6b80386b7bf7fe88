//! Hard cases: does it stay stable?
//!
//! A [`Trial`] is a hostile scene, a number of steps and, where one is known, the limit its result
//! must agree with. Every trial is held to the same fixed [`CRITERIA`]; its verdict is how far it
//! stays inside them.

mod trials;

pub use trials::all;

use crate::cases::CaseError;
use crate::plan::resolve;
use crate::scene::{SceneSource, parse};
use crate::sim::{self, Run};
use crate::verify::{Bound, Check};
use serde::Serialize;
use std::sync::Arc;

/// What every run must keep at every step.
pub struct Criteria {
    /// Relative difference of the power of loads and dissipation.
    pub power: f64,
    /// Relative divergence.
    pub divergence: f64,
    /// Corrections of a solution.
    pub corrections: u32,
    /// `| |n| - 1 |`
    pub director: f64,
    /// Relative change of a material's projected area.
    pub drift: f64,
    /// Volume of the particles of a closed, incompressible scene, relative.
    pub volume: f64,
}

/// The bounds. Drift is that of a coarse mesh, where a row of particles is a large part of a rim.
pub const CRITERIA: Criteria = Criteria {
    power: 1e-7,
    divergence: 1e-9,
    corrections: 20,
    director: 1e-12,
    drift: 0.03,
    volume: 1e-12,
};

/// Compares what a run came to with what is known.
pub type Expectation = Box<dyn Fn(&dyn Run) -> Result<Vec<Check>, CaseError> + Send + Sync>;

/// A hostile scene.
pub struct Trial {
    pub group: &'static str,
    pub name: String,
    pub scene: SceneSource,
    pub steps: u64,
    /// Drift does not say anything here: a material of less than a cell, or one that leaves.
    pub drifts: bool,
    pub expect: Option<Expectation>,
    /// Part of the quick battery.
    pub quick: bool,
}

/// How a trial went.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    pub group: &'static str,
    pub name: String,
    pub verdict: Verdict,
    pub steps: u64,
    pub checks: Vec<Check>,
}

/// The result of a trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Everything at least a factor of ten inside its bounds.
    Pass,
    /// Inside, by this factor.
    Margin(f64),
    Fail(String),
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Verdict::Pass => write!(f, "pass"),
            Verdict::Margin(m) => write!(f, "margin {m:.1}"),
            Verdict::Fail(reason) => write!(f, "FAIL: {reason}"),
        }
    }
}

/// The largest value each criterion has had.
#[derive(Default)]
struct Worst {
    power: f64,
    divergence: f64,
    corrections: u32,
    director: f64,
    drift: f64,
    volume: f64,
    outside: usize,
}

impl Worst {
    fn observe(&mut self, run: &dyn Run, first_volume: f64) {
        let row = run.row();
        self.power = self.power.max(row.power_error);
        self.divergence = self.divergence.max(row.divergence_error);
        self.corrections = self.corrections.max(row.iterations);
        self.director = self.director.max(row.director_error);
        self.drift = row.drift.iter().fold(self.drift, |a, d| a.max(d.abs()));
        let plan = run.plan();
        let particles = run.particles();
        if !plan.effects.volume_change && run.count().left == 0 {
            let volume: f64 = particles.volume.iter().sum();
            self.volume = self.volume.max((volume / first_volume - 1.0).abs());
        }
        let mesh = &plan.mesh;
        let misplaced = |p: &&[f64; 2]| {
            let outside = |v: f64, axis: &crate::space::mesh::Axis| v < axis.start() || v > axis.end();
            let place = mesh.locate(**p);
            outside(p[0], &mesh.x) || outside(p[1], &mesh.y) || mesh.solid[place]
        };
        self.outside = self.outside.max(particles.position.iter().filter(misplaced).count());
    }

    fn checks(&self, drifts: bool) -> Vec<Check> {
        let c = &CRITERIA;
        let mut out = vec![
            Check::new("power balance", self.power, Bound::AtMost(c.power)),
            Check::new("divergence", self.divergence, Bound::AtMost(c.divergence)),
            Check::new(
                "corrections",
                f64::from(self.corrections),
                Bound::AtMost(f64::from(c.corrections)),
            ),
            Check::new("length of directors", self.director, Bound::AtMost(c.director)),
            Check::new("volume of particles", self.volume, Bound::AtMost(c.volume)),
            Check::new("particles outside", self.outside as f64, Bound::AtMost(0.0)),
        ];
        if !drifts {
            out.push(Check::new("drift of projected area", self.drift, Bound::AtMost(c.drift)));
        }
        out
    }
}

impl Trial {
    /// Runs it; what cannot be run has failed, with the reason.
    pub fn run(&self) -> Outcome {
        let (checks, steps, error) = match self.attempt() {
            Ok((checks, steps)) => (checks, steps, None),
            Err(e) => (vec![], 0, Some(e.to_string())),
        };
        let verdict = match error {
            Some(reason) => Verdict::Fail(reason),
            None => judge(&checks),
        };
        Outcome { group: self.group, name: self.name.clone(), verdict, steps, checks }
    }

    fn attempt(&self) -> Result<(Vec<Check>, u64), CaseError> {
        let plan =
            resolve(&parse(&self.scene)?).map_err(|e| e.with_source(&self.scene))?;
        let mut run = sim::start(Arc::new(plan))?;
        let volume: f64 = run.particles().volume.iter().sum();
        let mut worst = Worst::default();
        worst.observe(run.as_ref(), volume);
        while run.row().step < self.steps && !run.is_finished() {
            run.step()?;
            worst.observe(run.as_ref(), volume);
        }
        let mut checks = worst.checks(self.drifts);
        if let Some(expect) = &self.expect {
            checks.extend(expect(run.as_ref())?);
        }
        Ok((checks, run.row().step))
    }
}

/// Iterations are small whole numbers and expectations have bounds of their own: only what has an
/// upper bound of rounding counts for the margin.
fn judge(checks: &[Check]) -> Verdict {
    if let Some(c) = checks.iter().find(|c| !c.passed) {
        return Verdict::Fail(format!("{} is {:.2e}, must be {}", c.what, c.value, c.bound));
    }
    let margin = checks
        .iter()
        .filter_map(|c| match c.bound {
            Bound::AtMost(most) if c.value > 0.0 => Some(most / c.value),
            _ => None,
        })
        .fold(f64::INFINITY, f64::min);
    if margin >= 10.0 { Verdict::Pass } else { Verdict::Margin(margin) }
}
