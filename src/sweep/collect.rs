//! This module collects the results of all cases: tables, the spread over seeds, and plots.

use super::{Case, List, PlotSpec, State, Store, SweepError};
use crate::record::number::short;
use crate::record::plots::{Axis, Curve, PlotError, PlotSpec as Plot, spread_plot};
use crate::record::replace::{self, Kind};
use crate::scene::Geometry;
use crate::sim::row::find;
use indexmap::IndexMap;
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Columns that describe the run itself, not its results.
const ABOUT: [&str; 6] = ["steps", "particles", "cells", "unknowns", "seconds", "peak_memory"];

/// Columns that are plotted by default, if present.
const WORTH_PLOTTING: [&str; 4] =
    ["outflow_volume", "outflow_mean_rate", "mean_alignment", "rms_speed"];

/// A case with its results.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The case.
    pub case: Case,
    /// State of the case.
    pub state: State,
    /// Results by column, in SI units; empty unless the case is done.
    pub found: IndexMap<String, f64>,
}

/// All cases with the same values and different seeds.
#[derive(Clone, Debug)]
pub struct Group {
    /// Values of the varied parameters, as they are set.
    pub values: IndexMap<String, String>,
    /// Values that are numbers.
    pub numbers: IndexMap<String, f64>,
    /// Number of finished runs.
    pub runs: usize,
    /// Mean and deviation of each result, by column.
    pub found: IndexMap<String, Spread>,
}

/// Mean and standard deviation of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean over the runs.
    pub mean: f64,
    /// Standard deviation over the runs (n - 1 in the denominator); `None` for a single run.
    pub deviation: Option<f64>,
}

/// Results of a sweep.
#[derive(Clone, Debug)]
pub struct Collection {
    /// Names of the varied parameters.
    pub parameters: Vec<String>,
    /// All cases, in the order of the list.
    pub entries: Vec<Entry>,
    /// Cases grouped by equal values.
    pub groups: Vec<Group>,
    /// Names of the result columns, in the order of display.
    pub columns: Vec<String>,
    /// Geometry of the runs, on which units depend.
    pub geometry: Geometry,
}

impl Spread {
    fn of(values: &[f64]) -> Spread {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Spread { mean, deviation: (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()) }
    }

    /// Formats as `mean ± deviation`.
    pub fn text(&self) -> String {
        let mean = short(self.mean);
        self.deviation.map_or(mean.clone(), |d| format!("{mean} ± {}", short(d)))
    }
}

impl Collection {
    /// Reads the results of all cases.
    pub fn new(store: &Store, list: &List) -> Result<Collection, SweepError> {
        let mut entries = vec![];
        let mut geometry = Geometry::Plane;
        for case in &list.cases {
            let state = store.state(&case.id);
            let found = match state {
                State::Done => {
                    let summary = summary(store, &case.id)?;
                    geometry = Geometry::deserialize(&summary["geometry"]).unwrap_or(geometry);
                    results(store, &case.id, &summary)
                }
                _ => IndexMap::new(),
            };
            entries.push(Entry { case: case.clone(), state, found });
        }
        let mut columns: Vec<String> = vec![];
        for name in entries.iter().flat_map(|e| e.found.keys()) {
            if !columns.contains(name) {
                columns.push(name.clone());
            }
        }
        let groups = groups(&entries);
        Ok(Collection { parameters: list.parameters.clone(), entries, groups, columns, geometry })
    }

    /// Number of finished cases.
    pub fn done(&self) -> usize {
        self.entries.iter().filter(|e| e.state == State::Done).count()
    }

    /// Writes `table.csv`, with a row for each case, and `spread.csv`, with a row for each set of
    /// values. Returns their paths.
    pub fn write_tables(&self, folder: &Path) -> Result<Vec<PathBuf>, SweepError> {
        let number = |v: Option<&f64>| v.map_or(String::new(), f64::to_string);
        let mut rows = vec![];
        let head = ["number", "id", "state", "seed"].map(String::from).into_iter();
        let parameters = self.parameters.iter().cloned();
        let columns = self.columns.iter().cloned();
        rows.push(head.chain(parameters.clone()).chain(columns).chain(["cause".into()]).collect());
        for e in &self.entries {
            let (state, cause) = match &e.state {
                State::Done => ("done", String::new()),
                State::Failed(cause) => ("failed", cause.clone()),
                State::Missing => ("missing", String::new()),
            };
            let seed = e.case.seed.map_or(String::new(), |s| s.to_string());
            let mut row = vec![e.case.number.to_string(), e.case.id.clone(), state.into(), seed];
            row.extend(self.parameters.iter().map(|p| value(&e.case.values, &e.case.numbers, p)));
            row.extend(self.columns.iter().map(|c| number(e.found.get(c))));
            row.push(cause);
            rows.push(row);
        }
        let table = folder.join("table.csv");
        write_csv(&table, &rows)?;
        let with_deviation = |c: &String| [c.clone(), format!("{c}.deviation")];
        let mut rows: Vec<Vec<String>> = vec![
            parameters
                .chain(["runs".into()])
                .chain(self.columns.iter().flat_map(with_deviation))
                .collect(),
        ];
        for g in &self.groups {
            let mut row: Vec<String> =
                self.parameters.iter().map(|p| value(&g.values, &g.numbers, p)).collect();
            row.push(g.runs.to_string());
            for c in &self.columns {
                let spread = g.found.get(c);
                row.push(number(spread.map(|s| &s.mean)));
                row.push(number(spread.and_then(|s| s.deviation.as_ref())));
            }
            rows.push(row);
        }
        let spread = folder.join("spread.csv");
        write_csv(&spread, &rows)?;
        Ok(vec![table, spread])
    }

    /// Draws the plots in `asked`, or if it is empty default plots against each parameter. Returns
    /// the paths of the files without extension.
    pub fn plot(&self, folder: &Path, asked: &[PlotSpec]) -> Result<Vec<PathBuf>, PlotError> {
        let chosen = if asked.is_empty() { self.default_plots() } else { asked.to_vec() };
        let mut stems = vec![];
        for plot in &chosen {
            let (spec, bars) = self.curves(plot);
            if spec.curves.iter().all(|c| c.points.is_empty()) {
                continue;
            }
            let stem = folder.join(file_name(&format!("{}-against-{}", plot.y, plot.x)));
            spread_plot(&stem, &spec, &bars)?;
            stems.push(stem);
        }
        Ok(stems)
    }

    fn default_plots(&self) -> Vec<PlotSpec> {
        let mut plots = vec![];
        for x in &self.parameters {
            let mut values: Vec<f64> =
                self.groups.iter().filter_map(|g| g.numbers.get(x).copied()).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            if values.len() < 2 {
                continue;
            }
            // Values over more than two decades get a logarithmic axis.
            let log_x = values[0] > 0.0 && values[values.len() - 1] > 100.0 * values[0];
            let worth = WORTH_PLOTTING.iter().filter(|y| self.columns.iter().any(|c| c == *y));
            plots.extend(worth.map(|y| PlotSpec {
                x: x.clone(),
                y: y.to_string(),
                log_x,
                ..PlotSpec::default()
            }));
        }
        plots
    }

    /// The plot, with a curve for each combination of the other parameters, and the deviation over
    /// seeds at its points.
    fn curves(&self, plot: &PlotSpec) -> (Plot, Vec<Vec<f64>>) {
        let mut found: IndexMap<String, Vec<(f64, f64, f64)>> = IndexMap::new();
        for g in &self.groups {
            let number = |name: &str| {
                let found = g.found.get(name).map(|s| s.mean);
                g.numbers.get(name).copied().or(found)
            };
            let (Some(x), Some(y)) = (number(&plot.x), number(&plot.y)) else { continue };
            let bar = g.found.get(&plot.y).and_then(|s| s.deviation).unwrap_or(0.0);
            let others = g.values.iter().filter(|(name, _)| **name != plot.x);
            // Against a result instead of a parameter, all points form one curve.
            let name: Vec<String> = match self.parameters.contains(&plot.x) {
                true => others.map(|(n, v)| format!("{n} = {v}")).collect(),
                false => vec![],
            };
            found.entry(name.join(", ")).or_default().push((x, y, bar));
        }
        let mut bars = vec![];
        let curves = found.into_iter().map(|(name, mut points)| {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            bars.push(points.iter().map(|p| p.2).collect());
            let points = points.iter().map(|p| (p.0, p.1)).collect();
            Curve { name, points, marks: true }
        });
        let curves = curves.collect();
        let axis = |name: &str, log: bool| {
            let axis = Axis::new(name.replace('_', " "), self.geometry.unit(unit(name)));
            if log { axis.log() } else { axis }
        };
        let seeds = self.groups.iter().map(|g| g.runs).max().unwrap_or(0);
        let about = match seeds {
            0 | 1 => String::new(),
            n => format!("; bars: standard deviation over {n} seeds"),
        };
        let title = match plot.title.is_empty() {
            true => format!("{} against {}{about}", plot.y.replace('_', " "), plot.x),
            false => format!("{}{about}", plot.title),
        };
        let spec =
            Plot { title, x: axis(&plot.x, plot.log_x), y: axis(&plot.y, plot.log_y), curves };
        (spec, bars)
    }

    /// The table for the terminal: the main results for each set of values.
    pub fn terminal(&self) -> String {
        const MOST: usize = 40;
        let shown: Vec<&String> = self
            .columns
            .iter()
            .filter(|c| WORTH_PLOTTING.contains(&c.as_str()) || *c == "seconds")
            .collect();
        let head = self.parameters.iter().chain(shown.iter().copied()).cloned().collect();
        let mut rows: Vec<Vec<String>> = vec![head];
        for g in self.groups.iter().filter(|g| g.runs > 0).take(MOST) {
            let values = self.parameters.iter().map(|p| g.values.get(p).cloned());
            let found = shown.iter().map(|c| g.found.get(*c).map(Spread::text));
            rows.push(values.chain(found).map(Option::unwrap_or_default).collect());
        }
        let columns = rows[0].len();
        let wide = |k: usize| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(wide).collect();
        let line = |row: &Vec<String>| {
            let cells = row
                .iter()
                .zip(&widths)
                .map(|(cell, w)| format!("{}{cell}", " ".repeat(w - cell.chars().count())));
            cells.collect::<Vec<_>>().join("  ")
        };
        let mut text = rows.iter().map(line).collect::<Vec<_>>().join("\n");
        if self.groups.len() > MOST {
            text += &format!("\n... {} more in spread.csv", self.groups.len() - MOST);
        }
        text
    }
}

/// A parameter as a number, if it is one: the table is for other programs.
fn value(values: &IndexMap<String, String>, numbers: &IndexMap<String, f64>, name: &str) -> String {
    let text = values.get(name).cloned().unwrap_or_default();
    numbers.get(name).map_or(text, f64::to_string)
}

fn groups(entries: &[Entry]) -> Vec<Group> {
    let mut members: IndexMap<Vec<String>, Vec<&Entry>> = IndexMap::new();
    for e in entries {
        members.entry(e.case.values.values().cloned().collect()).or_default().push(e);
    }
    let group = |all: Vec<&Entry>| {
        let mut values: IndexMap<String, Vec<f64>> = IndexMap::new();
        for (name, value) in all.iter().flat_map(|e| &e.found) {
            values.entry(name.clone()).or_default().push(*value);
        }
        Group {
            values: all[0].case.values.clone(),
            numbers: all[0].case.numbers.clone(),
            runs: all.iter().filter(|e| e.state == State::Done).count(),
            found: values.into_iter().map(|(name, v)| (name, Spread::of(&v))).collect(),
        }
    };
    members.into_values().map(group).collect()
}

/// Summary of a finished case.
fn summary(store: &Store, id: &str) -> Result<Value, SweepError> {
    let path = store.done(id).join("summary.json");
    let text = std::fs::read_to_string(&path).map_err(SweepError::file("read", &path))?;
    serde_json::from_str(&text)
        .map_err(|e| SweepError::Broken { path, cause: format!("is not a summary: {e}") })
}

/// Results of a finished case, by the column names of the series and of comparisons.
fn results(store: &Store, id: &str, summary: &Value) -> IndexMap<String, f64> {
    let mut found = IndexMap::new();
    let mut put = |name: String, value: Option<f64>| found.extend(value.map(|v| (name, v)));
    let time = summary["time"].as_f64();
    let gauges = summary["gauges"].as_object();
    for (name, gauge) in gauges.into_iter().flatten() {
        let several = gauges.is_some_and(|g| g.len() > 1);
        let prefix = if several { format!("{name}.") } else { String::new() };
        let volume = gauge["volume"].as_f64();
        let rate = time.filter(|t| *t > 0.0).zip(volume).map(|(t, v)| v / t);
        put(format!("{prefix}outflow_volume"), volume);
        put(format!("{prefix}outflow_rate"), gauge["rate"].as_f64());
        put(format!("{prefix}outflow_mean_rate"), rate);
    }
    for name in ["mean_alignment", "max_speed", "rms_speed"] {
        put(name.into(), summary[name].as_f64());
    }
    put("time".into(), time);
    for part in ["balances", "volume_drift"] {
        for (name, value) in summary[part].as_object().into_iter().flatten() {
            let name = if part == "volume_drift" { format!("{name}.{part}") } else { name.clone() };
            put(name, value.as_f64());
        }
    }
    let cells = summary["cells"].as_array().and_then(|c| Some(c[0].as_f64()? * c[1].as_f64()?));
    let seconds = summary["seconds"]["total"].as_f64();
    let steps = summary["steps"].as_f64();
    let memory = store.note(&store.done(id)).peak_memory.map(|b| b as f64);
    let recording = store.done(id).join("recording.rrd").metadata().ok().map(|m| m.len() as f64);
    let frames = summary["frames"]["sent"].as_f64();
    let about = [
        steps,
        summary["particles"].as_f64(),
        cells,
        summary["unknowns"]["total"].as_f64(),
        seconds,
        memory,
    ];
    ABOUT.into_iter().zip(about).for_each(|(name, value)| put(name.into(), value));
    let per_step = seconds.zip(steps.filter(|s| *s > 0.0)).map(|(t, n)| t / n);
    put("seconds_per_step".into(), per_step);
    put("recording_bytes".into(), recording);
    put("frames".into(), frames);
    found
}

fn unit(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or(name) {
        "outflow_mean_rate" => unit("outflow_rate"),
        "seconds" | "seconds_per_step" => "s",
        "peak_memory" | "recording_bytes" => "B",
        _ => find(name).map_or("", |c| c.unit),
    }
}

fn file_name(text: &str) -> String {
    text.replace(|c: char| !c.is_alphanumeric() && !"-_.".contains(c), "_")
}

fn write_csv(path: &Path, rows: &[Vec<String>]) -> Result<(), SweepError> {
    let fault = |cause: String| SweepError::Broken { path: path.to_owned(), cause };
    let mut writer = csv::Writer::from_writer(vec![]);
    rows.iter().try_for_each(|row| writer.write_record(row)).map_err(|e| fault(e.to_string()))?;
    let text = writer.into_inner().map_err(|e| fault(e.to_string()))?;
    let first = rows.first().and_then(|header| header.first()).map_or("", String::as_str);
    Ok(replace::write(path, text, Kind::Table(first))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_the_deviation_about_the_mean() {
        let spread = Spread::of(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(spread.mean, 2.5);
        assert!((spread.deviation.expect("four runs") - (5f64 / 3.0).sqrt()).abs() < 1e-15);
        assert_eq!(Spread::of(&[7.0]), Spread { mean: 7.0, deviation: None });
    }
}
