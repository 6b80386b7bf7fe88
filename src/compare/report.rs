//! This module formats a comparison: for the terminal, and as Markdown for the panels of a
//! recording.

use super::{Comparison, short};
use crate::record::number::trim_zeros;
use crate::record::text::duration;
use crate::results::table;

/// Maximum number of rows that the terminal shows of a table.
const MOST_CHANGES: usize = 40;

/// Length above which the terminal truncates cells (characters).
const LONGEST_CELL: usize = 40;

/// Columns that describe the numerical method, not the flow.
const TECHNICAL: [&str; 9] = [
    "power_in",
    "power_error",
    "divergence_error",
    "volume_error",
    "director_error",
    "iterations",
    "stabilisation",
    "active_rotation",
    "work",
];

/// A table before layout.
struct Grid {
    title: String,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// Formats a comparison for the terminal.
pub fn terminal(c: &Comparison) -> String {
    let mut out = String::new();
    for run in &c.runs {
        let scene = run.scene.as_deref().unwrap_or("unknown scene");
        out += &format!("{}: {scene} to {} s, {}\n", run.name, short(run.end), run.path);
    }
    for line in identities(c) {
        out += &format!("{line}\n");
    }
    for grid in grids(c) {
        out += &format!("\n{}\n", grid.title);
        let all: Vec<Vec<String>> = std::iter::once(&grid.head)
            .chain(&grid.rows)
            .map(|row| row.iter().map(|cell| cut(cell)).collect())
            .collect();
        let widths: Vec<usize> = (0..grid.head.len())
            .map(|k| all.iter().map(|row| row[k].chars().count()).max().unwrap_or(0))
            .collect();
        for row in all.iter().take(MOST_CHANGES + 1) {
            let cells = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}"));
            out += &format!("  {}\n", cells.collect::<Vec<_>>().join("  ").trim_end());
        }
        if all.len() > MOST_CHANGES + 1 {
            out += &format!("  and {} more; --json has all\n", all.len() - MOST_CHANGES - 1);
        }
    }
    if !c.tolerances.is_empty() {
        out += "\ntolerances\n";
        for verdict in &c.tolerances {
            out += &format!(
                "  {:<8} {}\n",
                if verdict.within { "within" } else { "OUTSIDE" },
                verdict.text
            );
        }
    }
    if !c.files.is_empty() {
        out += "\n";
    }
    for file in &c.files {
        out += &format!("wrote {file}\n");
    }
    out
}

/// Panels for the recording: title and Markdown of each.
pub fn markdown(c: &Comparison) -> [(&'static str, String); 2] {
    let escaped = |cell: &String| cell.replace('|', "\\|");
    let table = |grid: &Grid| {
        let line = |cells: &[String]| {
            format!("| {} |\n", cells.iter().map(escaped).collect::<Vec<_>>().join(" | "))
        };
        let mut out = format!("**{}**\n\n{}", grid.title, line(&grid.head));
        out += &format!("|{}\n", "---|".repeat(grid.head.len()));
        out += &grid.rows.iter().map(|row| line(row)).collect::<String>();
        out + "\n"
    };
    let said: String =
        identities(c).iter().chain(&c.notes).map(|line| format!("- {line}\n")).collect();
    let mut numbers = String::new();
    let mut scenes = String::new();
    for grid in grids(c) {
        if grid.title.starts_with(SCENES) {
            scenes += &table(&grid);
        } else {
            numbers += &table(&grid);
        }
    }
    if scenes.is_empty() {
        scenes = "The scenes that are known do not differ.\n".into();
    }
    [("Values", format!("{said}\n{numbers}")), ("Scenes", scenes)]
}

/// Statements about which runs have the same final state or scene as the first.
fn identities(c: &Comparison) -> Vec<String> {
    let first = &c.runs[0];
    let mut lines = vec![];
    for run in &c.runs[1..] {
        let same_scene = run.scene_hash.is_some() && run.scene_hash == first.scene_hash;
        match run.identical {
            Some(true) => lines.push(format!(
                "{} is identical to {}: the state at the end is the same to the last bit",
                run.name, first.name
            )),
            Some(false) if same_scene => lines.push(format!(
                "{} has the same scene as {}, but another final state: was it run with another \
                version of the program, or to another end time?",
                run.name, first.name
            )),
            _ => {}
        }
    }
    lines
}

const SCENES: &str = "scenes";

fn grids(c: &Comparison) -> Vec<Grid> {
    let runs = |first: &[&str]| -> Vec<String> {
        first.iter().map(|s| s.to_string()).chain(c.runs.iter().map(|r| r.name.clone())).collect()
    };
    let mut list = vec![Grid {
        title: format!(
            "values at t = {} s, and their change from {}",
            short(c.time),
            c.runs[0].name
        ),
        head: runs(&["value", "unit"]),
        rows: c.values.iter().filter(|v| !is_technical(&v.key)).map(value_row).collect(),
    }];
    if !c.curves.is_empty() || !c.fields.is_empty() {
        list.push(distances(c));
    }
    if !c.scenes.is_empty() {
        list.push(Grid {
            title: format!("{SCENES} differ in"),
            head: runs(&["key"]),
            rows: c
                .scenes
                .iter()
                .map(|change| {
                    let values = change.values.iter().map(|v| v.clone().unwrap_or("-".into()));
                    std::iter::once(change.key.clone()).chain(values).collect()
                })
                .collect(),
        });
    }
    list
}

/// A table with a row for each curve and field, and a column for each run but the first.
fn distances(c: &Comparison) -> Grid {
    let mut found: Vec<(String, &str, f64, f64)> = vec![];
    for change in c.curves.iter().filter(|c| !is_technical(&c.key)) {
        found.push((change.key.clone(), &change.run, change.largest, change.at));
    }
    for change in &c.fields {
        let name = format!("field of {}", change.field);
        found.push((name, &change.run, change.largest, change.at));
    }
    let mut names: Vec<&String> = vec![];
    for (name, ..) in &found {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let others = || c.runs.iter().skip(1).map(|run| run.name.as_str());
    let cell = |name: &String, run: &str| {
        let one = found.iter().find(|(n, r, ..)| n == name && *r == run);
        one.map_or("-".to_owned(), |(_, _, largest, at)| match largest {
            0.0 => "=".to_owned(),
            _ => format!("{} at {} s", percent(*largest), short(*at)),
        })
    };
    Grid {
        title:
            "largest difference over time (curves: relative to the largest value; fields: relative RMS)"
                .into(),
        head: std::iter::once("of").chain(others()).map(String::from).collect(),
        rows: names
            .into_iter()
            .map(|name| {
                std::iter::once(name.clone()).chain(others().map(|run| cell(name, run))).collect()
            })
            .collect(),
    }
}

fn is_technical(key: &str) -> bool {
    TECHNICAL.contains(&key)
}

fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}

fn value_row(value: &super::Value) -> Vec<String> {
    let cells = value.values.iter().zip(&value.relative).enumerate().map(|(k, (v, relative))| {
        let Some(v) = v else { return "-".to_owned() };
        let text = if value.key == table::SECONDS { duration(*v) } else { number(*v) };
        match relative {
            // Relative changes of quantities that should be zero are meaningless.
            _ if k == 0 || value.key.ends_with("_drift") => text,
            Some(0.0) => format!("{text} (=)"),
            Some(r) => {
                format!("{text} ({}{} %)", if *r > 0.0 { "+" } else { "−" }, short(100.0 * r.abs()))
            }
            None => text,
        }
    });
    let unit = if value.key == table::SECONDS { "" } else { value.unit };
    [value.key.clone(), unit.to_owned()].into_iter().chain(cells).collect()
}

/// Truncates text that is too long for a cell.
fn cut(cell: &str) -> String {
    if cell.chars().count() <= LONGEST_CELL {
        return cell.to_owned();
    }
    cell.chars().take(LONGEST_CELL - 1).chain(['…']).collect()
}

/// Formats with five significant digits; integers are written in full.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e9 {
        // Adding zero removes the sign of a negative zero.
        return (value + 0.0).to_string();
    }
    let exponent = value.abs().log10().floor();
    if (-3.0..6.0).contains(&exponent) {
        let decimals = (4.0 - exponent).max(0.0) as usize;
        trim_zeros(&format!("{value:.decimals$}")).to_owned()
    } else {
        format!("{value:.4e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_cells_are_readable() {
        for (value, text) in [
            (13.086480435634256, "13.086"),
            (0.0038, "0.0038"),
            (221.0, "221"),
            (-0.0, "0"),
            (1e10, "1.0000e10"),
            (2.61125678e10 + 0.5, "2.6113e10"),
            (-4.21e-5, "-4.2100e-5"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!(cut("short"), "short");
        assert_eq!(cut(&"long ".repeat(20)).chars().count(), LONGEST_CELL);
    }
}
