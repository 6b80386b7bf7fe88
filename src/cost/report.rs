//! Formats a cost table as Markdown for the terminal and the documentation.

use super::knobs::KNOBS;
use super::list::{Entry, List};
use super::reference::Kind;

/// Largest number of dominated settings shown.
const SHOWN: usize = 8;

/// A relative error in percent, such as `0.30 %`.
pub fn percent(error: f64) -> String {
    let p = 100.0 * error;
    if p == 0.0 {
        "0 %".into()
    } else if p >= 10.0 {
        format!("{p:.0} %")
    } else if p >= 1.0 {
        format!("{p:.1} %")
    } else if p >= 1e-3 {
        let digits = (1 - p.log10().floor() as i32).max(0) as usize;
        format!("{p:.digits$} %")
    } else {
        format!("{p:.0e} %")
    }
}

/// A time with a suitable unit, such as `50 ms`, `0.90 s`, `2.2 min` or `2.0 h`.
pub fn seconds(s: f64) -> String {
    if s < 1e-3 {
        format!("{:.2} ms", 1e3 * s)
    } else if s < 0.1 {
        format!("{:.0} ms", 1e3 * s)
    } else if s < 9.95 {
        format!("{s:.2} s")
    } else if s < 100.0 {
        format!("{s:.0} s")
    } else if s < 6000.0 {
        format!("{:.1} min", s / 60.0)
    } else {
        format!("{:.1} h", s / 3600.0)
    }
}

/// The machine on which a table was measured, and its timing noise.
pub fn provenance(list: &List) -> String {
    let m = &list.machine;
    let pinned = m.pinned.as_ref().map_or("not pinned".into(), |p| format!("pinned to CPU {p}"));
    let clock = if m.cpu_clock { "" } else { "; no CPU clock: all times are wall-clock times" };
    format!(
        "{} x {}, {pinned}; one run at a time; noise of {} equal runs: {} of CPU time, {} of \
         wall-clock time (slowest over fastest, minus 1){clock}",
        m.processors,
        m.processor,
        list.noise.repeats,
        percent(list.noise.cpu),
        percent(list.noise.wall)
    )
}

/// Description of the reference.
pub fn reference(list: &List) -> String {
    let r = &list.reference;
    let value = r.value.map_or(String::new(), |v| format!(" {v:.6e}"));
    let rate = r.rate.map_or(String::new(), |p| format!(", observed rate {p:.2}"));
    match r.kind {
        Kind::Exact => "the exact solution".into(),
        Kind::Extrapolated => format!(
            "own reference{value}, from three resolutions of every knob, extrapolated \
             (Richardson{rate}), uncertain by {}",
            percent(r.uncertainty)
        ),
        Kind::Finest => format!(
            "own reference{value}, the finest of three resolutions of every knob, which do not \
             converge at a plausible rate{rate}: uncertain by {}",
            percent(r.uncertainty)
        ),
    }
}

/// One-line summary, such as `1.0 % costs 0.90 s, 0.30 % costs 6.00 s`.
pub fn slogan(list: &List) -> String {
    let words: Vec<String> =
        list.front().map(|e| format!("{} costs {}", percent(e.promised), seconds(e.cpu))).collect();
    words.join(", ")
}

/// Description of the measured runs and of the growth of the error after them.
fn horizon(list: &List) -> String {
    let [short, full] = list.horizon;
    if short == 0.0 {
        format!("the first solution; a whole run takes {:.3} times as long", list.whole_run)
    } else if short < full {
        let growth = match &list.growth {
            Some(g) => format!(
                "its error is {:.2} times as large (difference of two meshes of {} and {} cells at \
                 the end over that at this time; {})",
                g.factor,
                g.cells[0],
                g.cells[1],
                if g.factor > 1.0 { "accuracies include it" } else { "accuracies exclude it" }
            ),
            None => "its error is assumed to be the same".into(),
        };
        format!(
            "runs shortened to t = {short:.4e} of {full:.4e} s; a whole run takes about {:.1} times \
             as long, and {growth}",
            list.whole_run
        )
    } else {
        format!("whole runs, to t = {full:.4e} s")
    }
}

/// Shares of the knobs in the error of an entry, from 5 % on.
fn split(entry: &Entry) -> String {
    let total: f64 = entry.split.iter().map(|s| s.1).sum();
    if total <= 0.0 {
        return "no measurable error".into();
    }
    let parts: Vec<String> = entry
        .split
        .iter()
        .filter(|s| s.1 >= 0.05 * total)
        .map(|(name, add)| format!("{name} {:.0} %", 100.0 * add / total))
        .collect();
    parts.join(", ")
}

/// A Markdown table whose columns are padded, so that it is readable in a terminal.
fn table(header: &[&str], rows: Vec<Vec<String>>) -> String {
    let mut all: Vec<Vec<String>> = vec![header.iter().map(ToString::to_string).collect()];
    all.extend(rows);
    let width = |c: usize| all.iter().map(|r| r[c].chars().count()).max().unwrap_or(3).max(3);
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let mut out = String::new();
    for (n, row) in all.iter().enumerate() {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(c, w)| format!("{c:<w$}", w = *w)).collect();
        out += &format!("| {} |\n", cells.join(" | "));
        if n == 0 {
            let rule: Vec<String> = widths.iter().map(|w| "-".repeat(*w)).collect();
            out += &format!("|-{}-|\n", rule.join("-|-"));
        }
    }
    out
}

/// The cost table as Markdown.
pub fn markdown(list: &List) -> String {
    let effort = if list.quick { ", quick" } else { "" };
    let mut out = format!("## {}: {}{effort}\n\n", list.scene, list.quantity);
    out += &format!("- error: {}", list.norm);
    if list.floor > 0.0 {
        out += &format!(", relative to at least {:e} (SI)", list.floor);
    }
    out += &format!(", against {}\n", reference(list));
    out += &format!(
        "- sampling error (other placements, seeds): {}\n",
        list.sampling.map_or("not measured, for lack of time".into(), percent)
    );
    out += &format!("- measured: {}\n", horizon(list));
    out += &format!("- machine: {}\n", provenance(list));
    out += &format!("- made in {}\n\n**{}**\n\n", seconds(list.made_in), slogan(list));
    let row = |e: &Entry| {
        let lucky = if e.lucky { " *" } else { "" };
        vec![
            percent(e.promised),
            format!("{}{lucky}", percent(e.error)),
            seconds(e.cpu),
            seconds(e.wall),
            e.repeats.to_string(),
            e.label.clone(),
            e.limiting().to_string(),
            split(e),
            e.next_halving.map_or("?".into(), |s| format!("+{}", seconds(s))),
        ]
    };
    out += &table(
        &[
            "accuracy",
            "measured",
            "CPU",
            "wall",
            "runs",
            "settings",
            "limited by",
            "error split",
            "next halving",
        ],
        list.front().map(row).collect(),
    );
    out += "\nThe accuracy is an error bound. Against an exact solution it is the measured error; \
            otherwise at least the root of the sum of squares of the contributions of the knobs, \
            plus the uncertainty of the reference. A star marks measured errors that are small \
            because contributions of several knobs cancel. CPU and wall are the smallest times of \
            the runs.\n";
    out += &knobs(list);
    out += &nobody(list);
    for (what, lines) in [("Failed", &list.failed), ("Left out for lack of time", &list.skipped)] {
        if !lines.is_empty() {
            out += &format!("\n{what}: {}.\n", lines.join("; "));
        }
    }
    out
}

/// Table of the error contributions of the knobs, and the observed convergence rates.
fn knobs(list: &List) -> String {
    let rows = list
        .knobs
        .iter()
        .map(|k| {
            let rate = match (k.rate, k.misfit) {
                (Some(p), Some(m)) if m > 2.0 => format!("{p:.1} (irregular)"),
                (Some(p), _) => format!("{p:.1}"),
                _ => "-".into(),
            };
            let adds: Vec<String> =
                k.adds.iter().map(|(l, a)| format!("{l}: {}", percent(*a))).collect();
            let keys = KNOBS.iter().find(|n| n.0 == k.name).map_or("", |n| n.1);
            vec![format!("{} (`{keys}`)", k.name), rate, adds.join("; ")]
        })
        .collect();
    format!("\n{}", table(&["knob", "rate", "adds to the error, other knobs unchanged"], rows))
}

/// Table of dominated settings, each with settings that are at least as accurate and no slower.
fn nobody(list: &List) -> String {
    let all = list.dominated();
    let rows: Vec<Vec<String>> = all
        .iter()
        .filter_map(|e| {
            let better = list.better(e)?;
            Some(vec![
                e.label.clone(),
                percent(e.promised),
                seconds(e.cpu),
                format!(
                    "{} for {}: {}",
                    percent(better.promised),
                    seconds(better.cpu),
                    better.label
                ),
            ])
        })
        .take(SHOWN)
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let shown = if all.len() > rows.len() {
        format!("{} of {} shown, slowest first", rows.len(), all.len())
    } else {
        "all shown".into()
    };
    format!(
        "\nDominated settings ({shown}):\n\n{}",
        table(&["settings", "accuracy", "CPU", "better"], rows)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::list::tests::list;

    #[test]
    fn errors_and_times_are_short() {
        let said = [0.5, 0.0123, 0.003, 1.2e-5, 1e-7, 0.0].map(percent);
        assert_eq!(said, ["50 %", "1.2 %", "0.30 %", "0.0012 %", "1e-5 %", "0 %"]);
        let said = [0.0005, 0.05, 0.9, 12.3, 130.0, 7200.0].map(seconds);
        assert_eq!(said, ["0.50 ms", "50 ms", "0.90 s", "12 s", "2.2 min", "2.0 h"]);
    }

    #[test]
    fn the_report_is_complete() {
        let text = markdown(&list());
        for part in [
            "5.0 % costs 0.20 s, 1.0 % costs 1.00 s, 0.10 % costs 8.00 s",
            "uncertain by 0.010 %",
            "observed rate 2.00",
            "limited by",
            "Dominated settings",
            "1.0 % for 1.00 s: base",
            "runs shortened",
            "noise of 3 equal runs",
        ] {
            assert!(text.contains(part), "{part:?} is missing in\n{text}");
        }
    }
}
