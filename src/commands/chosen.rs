//! This module implements `run --accuracy` and `run --budget`: settings chosen from a cost table.

use super::{Failure, cost};
use crate::cost::measure::wall_of_a_step;
use crate::cost::report::{percent, seconds};
use crate::cost::{Entry, List};
use crate::record::summary::Purchase;
use crate::scene::SceneSource;
use crate::session::Budget;
use crate::sim::Run;
use std::time::Instant;

/// Reads an accuracy: `1%`, `0.3 %` or `0.01`.
pub fn accuracy(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.trim().strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(v) if v > 0.0 && v * unit < 1.0 => Ok(v * unit),
        _ => Err("give an error above 0 and below 100 %, such as 1% or 0.003".into()),
    }
}

/// Reads a time: `30s`, `500ms`, `2min`, `1.5h` or a number of seconds. Returns seconds.
pub fn budget(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let units = [("ms", 1e-3), ("min", 60.0), ("s", 1.0), ("h", 3600.0), ("", 1.0)];
    let found = units.iter().find_map(|(name, unit)| Some((text.strip_suffix(name)?, unit)));
    match found.map(|(number, unit)| (number.trim().parse::<f64>(), unit)) {
        Some((Ok(v), unit)) if v > 0.0 && v.is_finite() => Ok(v * unit),
        _ => Err("give a time such as 30s, 500ms, 2min or 1h".into()),
    }
}

/// Settings chosen from a cost table.
pub struct Chosen {
    /// The chosen entry of the table.
    pub entry: Entry,
    /// The table.
    list: List,
    /// Expected wall time, s.
    expected: f64,
    /// Time budget, s, if one was given.
    budget: Option<f64>,
}

/// Chooses settings and prints their expected error and time. Returns a failure if no settings
/// reach the accuracy or the budget, and `None` if neither is given.
pub fn choose(
    source: &SceneSource,
    accuracy: Option<f64>,
    budget: Option<f64>,
) -> Result<Option<Chosen>, Failure> {
    if accuracy.is_none() && budget.is_none() {
        return Ok(None);
    }
    let list = cost::to_buy_from(source)?;
    let slowdown = slowdown(source, &list)?;
    let expected = |e: &Entry| slowdown * list.expected_seconds(e);
    let entry = match (accuracy, budget) {
        (Some(wanted), _) => list.for_accuracy(wanted).map_err(|best| {
            let best = best.map_or("the table is empty".into(), |e| {
                format!(
                    "the best is {} in about {}: {}",
                    percent(e.promised),
                    seconds(expected(e)),
                    e.label
                )
            });
            let finer =
                if list.quick { "; `grainscope cost` without --quick may reach it" } else { "" };
            format!("an accuracy of {} is out of reach; {best}{finer}", percent(wanted))
        }),
        (None, wanted) => {
            let wanted = wanted.unwrap_or(f64::INFINITY);
            list.for_budget(wanted, slowdown).map_err(|fastest| {
                let fastest = fastest.map_or("the table is empty".into(), |e| {
                    format!(
                        "the fastest takes about {} for {}: {}",
                        seconds(expected(e)),
                        percent(e.promised),
                        e.label
                    )
                });
                format!("a budget of {} is too little; {fastest}", seconds(wanted))
            })
        }
    };
    let entry = entry.map_err(Failure::Usage)?.clone();
    eprintln!(
        "chosen settings: {}; expects {} within {} (limited by {}{}), in about {}",
        entry.label,
        list.quantity,
        percent(entry.promised),
        entry.limiting(),
        list.sampling.map_or(String::new(), |s| format!("; sampling {}", percent(s))),
        seconds(expected(&entry))
    );
    Ok(Some(Chosen { expected: expected(&entry), entry, list, budget }))
}

/// Time spent on measuring a few steps, s.
const PATIENCE: f64 = 0.5;

/// Wall time of a step now, divided by its processor time when the table was made. Other load on
/// the machine or a lower frequency increase it; more threads decrease it.
fn slowdown(source: &SceneSource, list: &List) -> Result<f64, Failure> {
    let Some(entry) = list.front().next() else { return Ok(1.0) };
    let (_, plan) = super::resolve(&source.with_sets(&entry.sets)?)?;
    let now = wall_of_a_step(std::sync::Arc::new(plan), PATIENCE)?;
    let then = list.step_seconds(entry);
    // Steps of runs that are dominated by the start are not representative.
    let known = now > 0.0 && then > 0.0 && entry.steps >= LEAST_STEPS;
    Ok(if known { now / then } else { 1.0 })
}

/// Smallest number of steps of an entry for which the time of a step is compared.
const LEAST_STEPS: u64 = 5;

impl Budget for Chosen {
    /// Whether one more step, as long as the last one, would exceed the budget. The time to close
    /// the files is not counted.
    fn is_spent(&self, clock: &Instant, step: f64) -> bool {
        self.budget.is_some_and(|b| clock.elapsed().as_secs_f64() + step > b)
    }

    /// Expected and actual results of a run, for the summary.
    fn receipt(&self, run: &dyn Run, wall: f64) -> Purchase {
        let gauges = run.plan().gauges.iter().zip(&run.row().gauges).enumerate();
        let bars = gauges.map(|(k, (plan, now))| {
            let line = self.list.gauges.get(k);
            let measured = self.entry.gauge_errors.get(k).copied();
            // The gauge whose error the table lists has the error of the entry.
            let error = match (line, measured) {
                (Some(l), Some(e)) if !l.priced => e + l.uncertainty,
                _ => self.entry.promised,
            };
            let sampling = line.map_or(0.0, |l| l.sampling);
            (plan.name.clone(), [error, sampling].map(|e| e * now.volume.abs()))
        });
        Purchase {
            settings: self.entry.label.clone(),
            sets: self.entry.sets.clone(),
            quantity: self.list.quantity.clone(),
            accuracy: self.entry.promised,
            sampling: self.list.sampling,
            expected_seconds: self.expected,
            seconds: wall,
            finished: run.is_finished(),
            bars: bars.collect(),
        }
    }
}

/// The chosen settings and their results, for the end of a run's report.
pub fn receipt_text(p: &Purchase) -> String {
    let mut out = format!(
        "  settings {}: {} within {}; expected {}, took {}\n",
        p.settings,
        p.quantity,
        percent(p.accuracy),
        seconds(p.expected_seconds),
        seconds(p.seconds)
    );
    if !p.finished {
        out += "  unfinished: the accuracy holds for a whole run only; use a larger budget or a \
                shorter time.end\n";
    }
    for (name, [error, sampling]) in &p.bars {
        out += &format!(
            "  gauge {name}: +- {error:.2e} m2 (discretisation) +- {sampling:.2e} m2 (sampling)\n"
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracies_and_budgets_are_parsed() {
        for (text, value) in [("1%", 0.01), ("0.3 %", 0.003), ("0.02", 0.02)] {
            assert!(accuracy(text).is_ok_and(|v| (v - value).abs() < 1e-15), "{text}");
        }
        for text in ["0", "-1%", "100%", "good", "nan"] {
            assert!(accuracy(text).is_err(), "{text}");
        }
        for (text, value) in
            [("30s", 30.0), ("500ms", 0.5), ("2min", 120.0), ("1h", 3600.0), ("7", 7.0)]
        {
            assert_eq!(budget(text), Ok(value), "{text}");
        }
        for text in ["0s", "soon", "-3s", "inf", "3 weeks"] {
            assert!(budget(text).is_err(), "{text}");
        }
    }
}
