//! The series of a run: columns against time.

use crate::record::rerun_log::Sample;
use indexmap::IndexMap;
use std::collections::BTreeMap;

/// Columns of numbers by name, one value a step; `time` is one of them.
#[derive(Clone, Debug, Default)]
pub struct Table {
    pub columns: IndexMap<String, Vec<f64>>,
}

/// Columns that say nothing of the flow: they are neither compared nor plotted.
const BOOKKEEPING: [&str; 4] = ["dt_limiter", "splits", "merges", "held"];

/// Seconds computed so far; the series has seconds per step.
pub const SECONDS: &str = "seconds";

impl Table {
    /// Reads `series.csv`. A last row that is cut is left out.
    pub fn parse(text: &str) -> Result<Table, String> {
        let mut lines = text.split_inclusive('\n').filter(|l| l.ends_with('\n')).map(str::trim_end);
        let names: Vec<&str> = lines.next().ok_or("it is empty")?.split(',').collect();
        if !names.contains(&"time") {
            return Err("its first line names no column `time`".into());
        }
        let mut columns: IndexMap<String, Vec<f64>> =
            names.iter().map(|n| (n.to_string(), vec![])).collect();
        for (number, line) in lines.enumerate() {
            let cells: Vec<&str> = line.split(',').collect();
            if cells.len() != names.len() {
                return Err(format!(
                    "line {} has {} values for {} columns",
                    number + 2,
                    cells.len(),
                    names.len()
                ));
            }
            for (column, cell) in columns.values_mut().zip(cells) {
                column.push(cell.parse().unwrap_or(f64::NAN));
            }
        }
        if columns["time"].is_empty() {
            return Err("it has no row".into());
        }
        if let Some(steps) = columns.shift_remove("wall") {
            let sums = steps.iter().scan(0.0, |sum, s| {
                *sum += s;
                Some(*sum)
            });
            columns.insert(SECONDS.into(), sums.collect());
        }
        columns.retain(|name, _| !BOOKKEEPING.contains(&name.as_str()));
        Ok(Table { columns })
    }

    /// The series that a recording holds, its columns named as those of `series.csv`.
    pub fn of_recording(curves: &BTreeMap<String, Vec<Sample>>) -> Option<Table> {
        let gauges = curves.keys().filter(|path| path.ends_with("/volume")).count();
        let times: Vec<f64> =
            curves.get("diagnostics/power_in")?.iter().map(|s| s.time_s).collect();
        let mut columns: IndexMap<String, Vec<f64>> = IndexMap::new();
        columns.insert("time".into(), times.clone());
        for (path, samples) in curves {
            // The time step has no value at the first row; seconds by phase say little.
            if let Some(name) = column(path, gauges)
                && samples.len() == times.len()
            {
                columns.insert(name, samples.iter().map(|s| s.value).collect());
            }
        }
        let walls = curves["diagnostics/power_in"].iter().map(|s| s.wall_s).collect();
        columns.insert(SECONDS.into(), walls);
        (!times.is_empty()).then_some(Table { columns })
    }

    pub fn times(&self) -> &[f64] {
        self.columns.get("time").map_or(&[], Vec::as_slice)
    }

    /// Where the series ends (s).
    pub fn end(&self) -> f64 {
        self.times().last().copied().unwrap_or(0.0)
    }

    /// A column at a time, by interpolation between steps; `None` beyond the end.
    pub fn at(&self, column: &[f64], time: f64) -> Option<f64> {
        interpolate(self.times(), column, time)
    }

    /// Points of a column.
    pub fn points(&self, name: &str) -> Option<Vec<(f64, f64)>> {
        let column = self.columns.get(name)?;
        Some(self.times().iter().copied().zip(column.iter().copied()).collect())
    }
}

/// A column between rows.
fn interpolate(times: &[f64], values: &[f64], time: f64) -> Option<f64> {
    let (last_time, last) = (*times.last()?, *values.last()?);
    if (time - last_time).abs() <= super::SAME_TIME * last_time.abs() {
        return Some(last);
    }
    let after = times.partition_point(|&t| t <= time);
    if after == 0 || after >= times.len() {
        return None;
    }
    let (t0, t1) = (times[after - 1], times[after]);
    let (v0, v1) = (values[after - 1], *values.get(after)?);
    // Whole numbers and exact hits stay what they are.
    if time == t0 || v0 == v1 { Some(v0) } else { Some(v0 + (v1 - v0) * (time - t0) / (t1 - t0)) }
}

/// The column of the series that a recorded scalar is.
fn column(path: &str, gauges: usize) -> Option<String> {
    let parts: Vec<&str> = path.split('/').collect();
    Some(match parts.as_slice() {
        ["gauges", gauge, what] if gauges > 1 => format!("{gauge}.outflow_{what}"),
        ["gauges", _, what] => format!("outflow_{what}"),
        ["diagnostics", name] => name.to_string(),
        ["texture", "alignment"] => "mean_alignment".into(),
        ["volume_drift", material] => format!("{material}.volume_drift"),
        _ => return None,
    })
}

/// The rank of a column for a reader: what runs are made for comes first.
pub fn importance(key: &str) -> usize {
    const ORDER: [&str; 12] = [
        "outflow_volume",
        "outflow_rate",
        "mean_alignment",
        "max_speed",
        "rms_speed",
        "dissipation",
        "dissipated",
        "potential_energy",
        "volume_drift",
        "end",
        "step",
        "particles",
    ];
    let name = key.rsplit('.').next().unwrap_or(key);
    let last = if key == SECONDS { ORDER.len() + 1 } else { ORDER.len() };
    ORDER.iter().position(|o| *o == name).unwrap_or(last)
}

/// The unit of a column.
pub fn unit(key: &str) -> &'static str {
    match key.rsplit('.').next().unwrap_or(key) {
        "time" | "end" | "dt" | SECONDS => "s",
        "outflow_volume" => "m²",
        "outflow_rate" => "m²/s",
        "max_speed" | "rms_speed" => "m/s",
        "power_in" | "dissipation" | "stabilisation" => "W/m",
        "potential_energy" | "work" | "dissipated" => "J/m",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_is_read_and_interpolated() {
        let text = "step,time,wall,outflow_volume\n0,0,0.5,0\n1,1,0.5,2\n2,2,1,3\n3,3,1";
        let table = Table::parse(text).expect("a series");
        assert_eq!(table.end(), 2.0);
        let at = |name: &str, time| table.at(&table.columns[name], time);
        assert_eq!(at("outflow_volume", 0.5), Some(1.0));
        assert_eq!(at("outflow_volume", 2.0), Some(3.0));
        assert_eq!(at("outflow_volume", 2.5), None);
        assert_eq!(at(SECONDS, 2.0), Some(2.0));
    }

    #[test]
    fn what_is_no_series_is_told() {
        for text in ["", "a,b\n1,2\n", "step,time\n", "step,time\n1\n"] {
            assert!(Table::parse(text).is_err(), "{text:?}");
        }
    }
}
