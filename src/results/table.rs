//! This module reads the series of a run: columns of values against time.

use crate::record::rerun_log::Sample;
use crate::scene::Geometry;
use crate::sim::row::{COLUMNS, Column, PER_FORCE, PER_GAUGE, PER_MATERIAL, Rank, find};
use crate::words::count;
use indexmap::IndexMap;
use std::collections::BTreeMap;

/// Columns of numbers by name, one value per step. One column is `time`.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Columns by name; all have the same length.
    pub columns: IndexMap<String, Vec<f64>>,
}

/// A recorded curve that has a sample at every step.
const CLOCK: &str = "diagnostics/power_in";

/// Column of the computing time so far (s). The series itself has seconds per step.
pub const SECONDS: &str = "seconds";

impl Table {
    /// Parses `series.csv`. An incomplete last row is ignored.
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
                    "line {} has {} for {}",
                    number + 2,
                    count(cells.len(), "value"),
                    count(names.len(), "column")
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
        columns.retain(|name, _| find(name).is_none_or(|c| c.rank != Rank::Never));
        Ok(Table { columns })
    }

    /// The series in a recording, with the column names of `series.csv`.
    pub fn of_recording(curves: &BTreeMap<String, Vec<Sample>>) -> Option<Table> {
        let gauges = curves.keys().filter(|path| path.ends_with("/volume")).count();
        let times: Vec<f64> = curves.get(CLOCK)?.iter().map(|s| s.time_s).collect();
        let mut columns: IndexMap<String, Vec<f64>> = IndexMap::new();
        columns.insert("time".into(), times.clone());
        for (path, samples) in curves {
            // `dt` has no value in the first row, and the seconds by phase are of little interest.
            if let Some(name) = column(path, gauges)
                && samples.len() == times.len()
            {
                columns.insert(name, samples.iter().map(|s| s.value).collect());
            }
        }
        let walls = curves[CLOCK].iter().map(|s| s.wall_s).collect();
        columns.insert(SECONDS.into(), walls);
        (!times.is_empty()).then_some(Table { columns })
    }

    /// Times of the rows (s).
    pub fn times(&self) -> &[f64] {
        self.columns.get("time").map_or(&[], Vec::as_slice)
    }

    /// Time of the last row (s).
    pub fn end(&self) -> f64 {
        self.times().last().copied().unwrap_or(0.0)
    }

    /// The value of a column at a time, interpolated between steps; `None` beyond the end.
    pub fn at(&self, column: &[f64], time: f64) -> Option<f64> {
        interpolate(self.times(), column, time)
    }

    /// Points (time, value) of a column.
    pub fn points(&self, name: &str) -> Option<Vec<(f64, f64)>> {
        let column = self.columns.get(name)?;
        Some(self.times().iter().copied().zip(column.iter().copied()).collect())
    }
}

/// Interpolates a column linearly in time.
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
    // Integers that do not change, and values at exact times, are kept exactly.
    if time == t0 || v0 == v1 { Some(v0) } else { Some(v0 + (v1 - v0) * (time - t0) / (t1 - t0)) }
}

/// The name in `series.csv` of a recorded scalar.
fn column(path: &str, gauges: usize) -> Option<String> {
    let in_family = |family: &'static [Column], name: &str| family.iter().find(|c| c.path == name);
    let parts: Vec<&str> = path.split('/').collect();
    match parts.as_slice() {
        ["gauges", gauge, what] => {
            let name = in_family(&PER_GAUGE, what)?.name;
            Some(if gauges > 1 { format!("{gauge}.{name}") } else { name.into() })
        }
        ["forces", gauge, what] => Some(format!("{gauge}.{}", in_family(&PER_FORCE, what)?.name)),
        [family, material] if in_family(&PER_MATERIAL, family).is_some() => {
            Some(format!("{material}.{}", in_family(&PER_MATERIAL, family)?.name))
        }
        _ => in_family(COLUMNS, path).map(|c| c.name.into()),
    }
}

/// Rank of the end time among the compared values.
const END: usize = 9;

/// Rank of a column in listings; the main results come first.
pub fn importance(key: &str) -> usize {
    match (key, find(key).map(|c| c.rank)) {
        ("end", _) => END,
        (SECONDS, _) => usize::from(u8::MAX),
        (_, Some(Rank::Compared(rank) | Rank::Value(rank))) => usize::from(rank),
        _ => usize::from(u8::MAX) - 1,
    }
}

/// Whether the curves of a column are compared; errors, drifts and counts are not.
pub fn has_curve(key: &str) -> bool {
    matches!(find(key).map(|c| c.rank), Some(Rank::Compared(_)))
}

/// Unit of a column of runs with a geometry; empty for pure numbers.
pub fn unit(key: &str, geometry: Geometry) -> &'static str {
    match key {
        "end" | SECONDS => "s",
        _ => find(key).map_or("", |c| c.unit_in(geometry)),
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
    fn invalid_series_are_rejected() {
        for text in ["", "a,b\n1,2\n", "step,time\n", "step,time\n1\n"] {
            assert!(Table::parse(text).is_err(), "{text:?}");
        }
    }
}
