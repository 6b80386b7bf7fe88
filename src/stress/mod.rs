//! The stress battery: tests the stability of the method on extreme scenes.
//!
//! A [`Trial`] is an extreme scene with a number of steps and, where one is known, a limit with
//! which its result must agree. Every trial must satisfy the same fixed [`CRITERIA`] at every step;
//! its verdict says by how much it does.

mod grains;
mod page;
mod round;
mod run;
mod solids;
mod trials;
mod voids;

pub use page::{json, markdown, table};
pub use run::{keep, run_all};
pub use trials::all;

use crate::cases::CaseError;
use crate::scene::SceneSource;
use crate::sim::Run;
use crate::sim::criteria::CRITERIA;
use crate::verify::{Bound, Check};
use serde::Serialize;

/// Checks of a finished run against a known result.
pub type Expectation = Box<dyn Fn(&dyn Run) -> Result<Vec<Check>, CaseError> + Send + Sync>;

/// An extreme scene and its expected result.
pub struct Trial {
    /// Name of the group.
    pub group: &'static str,
    /// Name, unique within its group.
    pub name: String,
    /// Scene to run.
    pub scene: SceneSource,
    /// Largest number of steps; the scene may end earlier.
    pub steps: u64,
    /// True if drift and energy balance are not checked, because a material is smaller than a cell,
    /// changes its volume or leaves the domain.
    pub drifts: bool,
    /// Checks against a known result, if there is one.
    pub expect: Option<Expectation>,
    /// True if the trial is part of the quick battery.
    pub quick: bool,
}

/// Outcome of a trial.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Name of the group.
    pub group: &'static str,
    /// Name of the trial.
    pub name: String,
    /// Verdict over all checks.
    pub verdict: Verdict,
    /// Number of steps taken.
    pub steps: u64,
    /// The check closest to its bound, or the first failed one.
    pub tightest: Option<Check>,
    /// All checks; empty if the run failed.
    pub checks: Vec<Check>,
}

/// Verdict of a trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// All values are inside their bounds by at least a factor of [`Criteria::margin`].
    Pass,
    /// All values are inside their bounds, the closest one by this factor.
    Margin(f64),
    /// The trial failed, for this reason.
    Fail(String),
}

impl Verdict {
    /// True if the trial failed.
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

/// Verdict over some checks, and the check that determines it.
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

/// Factor by which a value could grow before it reaches its bound. `None` for lower bounds (rates
/// of convergence) and values of zero.
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
    fn the_tightest_check_determines_the_verdict() {
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
    fn trial_names_are_unique() {
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
