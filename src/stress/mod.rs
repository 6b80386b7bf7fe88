//! Hard cases: does it stay stable?
//!
//! A [`Trial`] is a hostile scene, a number of steps and, where one is known, the limit its result
//! must agree with. Every trial is held to the same fixed [`CRITERIA`] at every step; its verdict
//! is how far it stays inside them.

mod page;
mod run;
mod trials;

pub use page::{json, markdown, table};
pub use run::{keep, run_all};
pub use trials::all;

use crate::cases::CaseError;
use crate::scene::SceneSource;
use crate::sim::Run;
use crate::verify::{Bound, Check};
use serde::Serialize;

/// What every run must keep at every step.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Criteria {
    /// Relative difference of the power of loads and dissipation.
    pub power: f64,
    /// Relative divergence.
    pub divergence: f64,
    /// Corrections of a step, all its solutions together.
    pub corrections: f64,
    /// Share of the volume that lies in the wrong cell (sum of |volume of particles - area|), over
    /// that of a row of particles in a cell; incompressible scenes.
    pub misplaced: f64,
    /// Relative change of a material's projected area.
    pub drift: f64,
    /// Relative change of the volume of all particles of a closed, incompressible scene.
    pub volume: f64,
    /// `| |n| - 1 |`
    pub director: f64,
    /// Particles out of the domain or inside a solid.
    pub outside: f64,
    /// Largest speed over that of the first instant, or over a tenth of the scene's own unit of
    /// speed where that is larger.
    pub growth: f64,
    /// Farthest that a carried viscosity or density goes beyond its first extrema, relative to the
    /// larger; incompressible scenes.
    pub extrema: f64,
    /// A trial passes this factor inside its bounds; nearer than that its margin is told.
    pub margin: f64,
}

/// The bounds. Drift is that of a coarse mesh, where a row of particles is a large part of a rim.
pub const CRITERIA: Criteria = Criteria {
    power: 1e-6,
    divergence: 1e-9,
    corrections: 40.0,
    misplaced: 1.0,
    drift: 0.05,
    volume: 1e-10,
    director: 1e-12,
    outside: 0.0,
    growth: 100.0,
    extrema: 0.05,
    margin: 2.0,
};

/// Compares what a run came to with what is known.
pub type Expectation = Box<dyn Fn(&dyn Run) -> Result<Vec<Check>, CaseError> + Send + Sync>;

/// A hostile scene.
pub struct Trial {
    pub group: &'static str,
    pub name: String,
    pub scene: SceneSource,
    /// The scene's end may come first.
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
    /// Steps that were taken.
    pub steps: u64,
    /// The check nearest to its bound, or the first that failed.
    pub tightest: Option<Check>,
    pub checks: Vec<Check>,
}

/// The result of a trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Everything at least a factor of [`Criteria::margin`] inside its bounds.
    Pass,
    /// Inside, by this factor.
    Margin(f64),
    Fail(String),
}

impl Verdict {
    pub fn is_failure(&self) -> bool {
        matches!(self, Verdict::Fail(_))
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Verdict::Pass => write!(f, "pass"),
            Verdict::Margin(m) => write!(f, "margin {m:.1}"),
            Verdict::Fail(reason) => write!(f, "fail: {reason}"),
        }
    }
}

/// Verdict over some checks, and the one that it hangs on.
pub fn judge(checks: &[Check]) -> (Verdict, Option<Check>) {
    if let Some(c) = checks.iter().find(|c| !c.passed) {
        let reason = format!("{} is {:.2e}, must be {}", c.what, c.value, c.bound);
        return (Verdict::Fail(reason), Some(c.clone()));
    }
    let tightest =
        checks.iter().filter_map(|c| Some((margin(c)?, c))).min_by(|a, b| a.0.total_cmp(&b.0));
    match tightest {
        Some((m, c)) if m < CRITERIA.margin => (Verdict::Margin(m), Some(c.clone())),
        other => (Verdict::Pass, other.map(|(_, c)| c.clone())),
    }
}

/// How many times a value could grow before it meets its bound. Lower bounds (rates of
/// convergence) and values of zero have no such factor.
fn margin(c: &Check) -> Option<f64> {
    let (most, value) = match c.bound {
        Bound::AtMost(most) => (most, c.value),
        Bound::Within(aim, off) => (off, (c.value - aim).abs()),
        Bound::AtLeast(_) => return None,
    };
    (value > 0.0).then(|| most / value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn verdicts_hang_on_the_nearest_bound() {
        let check = |value, most| Check::new("it", value, Bound::AtMost(most));
        let (verdict, tightest) = judge(&[check(0.0, 0.0), check(1e-3, 1.0), check(1.0, 1.5)]);
        assert_eq!(verdict, Verdict::Margin(1.5));
        assert_eq!(tightest.expect("one").value, 1.0);
        assert_eq!(judge(&[check(0.1, 1.0)]).0, Verdict::Pass);
        assert_eq!(
            judge(&[Check::new("it", 1.1, Bound::Within(1.0, 0.15))]).0.to_string(),
            "margin 1.5"
        );
        assert!(judge(&[check(0.1, 1.0), check(f64::NAN, 1.0)]).0.is_failure());
        assert!(judge(&[check(1.0, 0.0)]).0.is_failure());
    }

    #[test]
    fn trials_have_names_of_their_own() {
        let all = all().expect("valid scenes");
        let names: HashSet<_> = all.iter().map(|t| (t.group, t.name.as_str())).collect();
        assert_eq!(names.len(), all.len());
        assert!(all.len() > 100);
        assert!(all.iter().filter(|t| t.quick).count() > 20);
    }

    #[test]
    fn the_page_in_the_docs_lists_every_trial() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/stress.md");
        let page = std::fs::read_to_string(page).expect("docs/stress.md");
        for trial in all().expect("valid scenes") {
            let row = format!("| {} | {} |", trial.group, trial.name);
            assert!(page.contains(&row), "{row} is missing: grainscope stress --write docs");
        }
    }
}
