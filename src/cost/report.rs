//! A price list in words, for the terminal and for the docs.

use super::knobs::KNOBS;
use super::list::{Entry, List};
use super::reference::Kind;

/// Dominated settings shown at most.
const SHOWN: usize = 8;

/// An error as people say it: `0.3 %`.
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

/// Seconds as people say them.
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

/// Where a list was measured, and how noisy it was there.
pub fn provenance(list: &List) -> String {
    let m = &list.machine;
    let pinned = m.pinned.as_ref().map_or("not pinned".into(), |p| format!("pinned to CPU {p}"));
    let clock = if m.cpu_clock { "" } else { "; no processor clock: seconds are the wall's" };
    format!(
        "{} x {}, {pinned}; one run at a time; noise of {} equal runs: {} of processor time, {} of \
         wall time (slowest over fastest, less 1){clock}",
        m.processors,
        m.processor,
        list.noise.repeats,
        percent(list.noise.cpu),
        percent(list.noise.wall)
    )
}

/// What errors are measured against, in words.
pub fn reference(list: &List) -> String {
    let r = &list.reference;
    let value = r.value.map_or(String::new(), |v| format!(" {v:.6e}"));
    let rate = r.rate.map_or(String::new(), |p| format!(", observed rate {p:.2}"));
    match r.kind {
        Kind::Exact => "the exact solution".into(),
        Kind::Extrapolated => format!(
            "own reference{value}, finer in every knob and extrapolated (Richardson{rate}), \
             uncertain by {}",
            percent(r.uncertainty)
        ),
        Kind::Finest => format!(
            "own reference{value}, finer in every knob; its rungs do not converge regularly{rate}: \
             uncertain by {}",
            percent(r.uncertainty)
        ),
    }
}

/// `1.0 % costs 0.9 s, 0.30 % costs 6.0 s`
pub fn slogan(list: &List) -> String {
    let words: Vec<String> =
        list.front().map(|e| format!("{} costs {}", percent(e.promised), seconds(e.cpu))).collect();
    words.join(", ")
}

fn horizon(list: &List) -> String {
    let [short, full] = list.horizon;
    if short == 0.0 {
        format!("the first solution; a whole run takes {:.3} times as long", list.whole_run)
    } else if short < full {
        let growth = match &list.growth {
            Some(g) => format!(
                "its error is {:.2} times as large (two meshes of {} and {} cells at the end and at \
                 that time{})",
                g.factor,
                g.cells[0],
                g.cells[1],
                if g.factor > 1.0 { "; promises count it" } else { "; promises do not" }
            ),
            None => "its error is taken to be the same".into(),
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

/// Share of the limiting knob, and of the next one.
fn split(entry: &Entry) -> String {
    let total: f64 = entry.split.iter().map(|s| s.1).sum();
    if total <= 0.0 {
        return "nothing to see".into();
    }
    let parts: Vec<String> = entry
        .split
        .iter()
        .filter(|s| s.1 >= 0.05 * total)
        .map(|(name, add)| format!("{name} {:.0} %", 100.0 * add / total))
        .collect();
    parts.join(", ")
}

/// Rows of cells under a header, as Markdown that also reads well in a terminal.
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

/// The list as Markdown.
pub fn markdown(list: &List) -> String {
    let effort = if list.quick { ", quick" } else { "" };
    let mut out = format!("## {}: {}{effort}\n\n", list.scene, list.quantity);
    out += &format!("- error: {}", list.norm);
    if list.floor > 0.0 {
        out += &format!(", to no less than {:e} (SI)", list.floor);
    }
    out += &format!(", against {}\n", reference(list));
    out += &format!(
        "- sampling (other placements, seeds): {}\n",
        list.sampling.map_or("not seen in the time".into(), percent)
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
            "of",
            "settings",
            "limited by",
            "error split",
            "next halving",
        ],
        list.front().map(row).collect(),
    );
    out += "\nAccuracy is what is promised: against an exact solution the measured error; else no less \
            than the root of the sum of squares of what the knobs add, plus the reference's \
            uncertainty. A star marks measured errors that are small because those of several knobs \
            cancel.\n";
    out += &knobs(list);
    out += &nobody(list);
    for (what, lines) in [("Failed", &list.failed), ("Left out to keep the time", &list.skipped)] {
        if !lines.is_empty() {
            out += &format!("\n{what}: {}.\n", lines.join("; "));
        }
    }
    out
}

/// What each knob adds, and the observed rates.
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
    format!("\n{}", table(&["knob", "rate", "adds to the error, others as the scene says"], rows))
}

/// What nobody should buy.
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
        format!("{} of {} shown, dearest first", rows.len(), all.len())
    } else {
        "all shown".into()
    };
    format!(
        "\nNobody should buy ({shown}):\n\n{}",
        table(&["settings", "accuracy", "CPU", "because there is"], rows)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::list::tests::list;

    #[test]
    fn errors_and_seconds_are_short() {
        let said = [0.5, 0.0123, 0.003, 1.2e-5, 1e-7, 0.0].map(percent);
        assert_eq!(said, ["50 %", "1.2 %", "0.30 %", "0.0012 %", "1e-5 %", "0 %"]);
        let said = [0.0005, 0.05, 0.9, 12.3, 130.0, 7200.0].map(seconds);
        assert_eq!(said, ["0.50 ms", "50 ms", "0.90 s", "12 s", "2.2 min", "2.0 h"]);
    }

    #[test]
    fn says_everything() {
        let text = markdown(&list());
        for part in [
            "5.0 % costs 0.20 s, 1.0 % costs 1.00 s, 0.10 % costs 8.00 s",
            "uncertain by 0.010 %",
            "observed rate 2.00",
            "limited by",
            "Nobody should buy",
            "1.0 % for 1.00 s: base",
            "runs shortened",
            "noise of 3 equal runs",
        ] {
            assert!(text.contains(part), "{part:?} is missing in\n{text}");
        }
    }
}
