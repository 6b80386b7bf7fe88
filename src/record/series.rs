//! `series.csv`: one row a step, SI units.

use crate::plan::Plan;
use crate::sim::clock::Limiter;
use crate::sim::empty_row;
use crate::sim::row::{GaugeRow, Row};
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The table in the making; each row is flushed, so a killed run leaves whole rows.
pub struct SeriesWriter {
    out: File,
    /// Bytes of whole rows.
    length: u64,
    /// There is a column of the mean alignment.
    alignment: bool,
}

/// Names of the columns of a plan's series.
pub fn columns(plan: &Plan) -> Vec<String> {
    let mut list: Vec<String> = [
        "step",
        "time",
        "dt",
        "dt_limiter",
        "wall",
        "power_in",
        "dissipation",
        "power_error",
        "divergence_error",
        "volume_error",
        "iterations",
        "particles",
    ]
    .map(String::from)
    .to_vec();
    for g in &plan.gauges {
        let prefix = if plan.gauges.len() > 1 { format!("{}.", g.name) } else { String::new() };
        list.push(format!("{prefix}outflow_volume"));
        list.push(format!("{prefix}outflow_rate"));
    }
    list.extend(
        [
            "max_speed",
            "rms_speed",
            "stabilisation",
            "potential_energy",
            "work",
            "dissipated",
            "director_error",
            "active_rotation",
            "splits",
            "merges",
            "held",
        ]
        .map(String::from),
    );
    if plan.effects.directors {
        list.push("mean_alignment".into());
    }
    list.extend(plan.state.materials.iter().map(|m| format!("{}.volume_drift", m.name)));
    list
}

impl SeriesWriter {
    pub fn create(path: &Path, plan: &Plan) -> std::io::Result<Self> {
        let mut series =
            SeriesWriter { out: File::create(path)?, length: 0, alignment: plan.effects.directors };
        series.append(&format!("{}\n", columns(plan).join(",")))?;
        Ok(series)
    }

    /// Goes on with a table after a row: what it holds of later steps is dropped. The row itself may
    /// be missing: it is known.
    pub fn resume(path: &Path, plan: &Plan, row: &Row) -> Result<Self, TableError> {
        let step = row.step;
        let fault = |source| TableError::File { path: path.to_path_buf(), source };
        let (rows, length) = read(path, plan, step)?;
        if (rows.len() as u64) < step {
            let path = path.to_path_buf();
            return Err(TableError::Short { path, rows: rows.len(), step });
        }
        let mut out = File::options().write(true).open(path).map_err(fault)?;
        out.set_len(length).map_err(fault)?;
        out.seek(SeekFrom::End(0)).map_err(fault)?;
        let mut series = SeriesWriter { out, length, alignment: plan.effects.directors };
        if rows.len() as u64 == step {
            series.write(row).map_err(fault)?;
        }
        Ok(series)
    }

    /// Adds a line, all of it or nothing.
    fn append(&mut self, line: &str) -> std::io::Result<()> {
        if let Err(e) = self.out.write_all(line.as_bytes()) {
            // A full disk may have taken a part.
            self.out.set_len(self.length)?;
            return Err(e);
        }
        self.length += line.len() as u64;
        Ok(())
    }

    /// Brings the table to the disk.
    pub fn settle(&mut self) -> std::io::Result<()> {
        self.out.sync_data()
    }

    pub fn write(&mut self, row: &Row) -> std::io::Result<()> {
        let mut line = format!(
            "{},{},{},{},{:.6},{},{},{:e},{:e},{:e},{},{}",
            row.step,
            row.time,
            row.dt,
            row.dt_limiter.name(),
            row.wall,
            row.power_in,
            row.dissipation,
            row.power_error,
            row.divergence_error,
            row.volume_error,
            row.iterations,
            row.particles
        );
        for g in &row.gauges {
            line += &format!(",{},{}", g.volume, g.rate);
        }
        line += &format!(
            ",{},{},{:e},{},{},{},{:e},{},{},{},{}",
            row.max_speed,
            row.rms_speed,
            row.stabilisation,
            row.potential_energy,
            row.work,
            row.dissipated,
            row.director_error,
            row.active_rotation,
            row.splits,
            row.merges,
            row.held
        );
        if self.alignment {
            line += &format!(",{}", row.alignment.unwrap_or(f64::NAN));
        }
        for d in &row.drift {
            line += &format!(",{d:e}");
        }
        line.push('\n');
        self.append(&line)
    }
}

/// The rows of a run's table.
pub fn rows(path: &Path, plan: &Plan) -> Result<Vec<Row>, TableError> {
    read(path, plan, u64::MAX).map(|read| read.0)
}

/// Rows of a table up to a step, and the bytes that they take.
fn read(path: &Path, plan: &Plan, until: u64) -> Result<(Vec<Row>, u64), TableError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| TableError::File { path: path.to_path_buf(), source })?;
    whole_rows(&text, plan, until).map_err(|(line, what)| TableError::Row {
        path: path.to_path_buf(),
        line,
        what,
    })
}

/// Why a table cannot be read or taken up again.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: std::io::Error },
    #[error("{}: line {line}: {what}", path.display())]
    Row { path: PathBuf, line: usize, what: String },
    #[error("{}: holds {rows} whole rows, and lacks those before step {step}", path.display())]
    Short { path: PathBuf, rows: usize, step: u64 },
}

/// Rows of a table up to a step, and the bytes that they take. What is wrong, and in which line,
/// if it is no such table; a last line that is cut does not count.
fn whole_rows(text: &str, plan: &Plan, until: u64) -> Result<(Vec<Row>, u64), (usize, String)> {
    let names = columns(plan);
    let mut lines = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    let header = lines.next().unwrap_or_default();
    if header.trim_end() != names.join(",") {
        return Err((1, "the columns are not those of this run".into()));
    }
    let (mut rows, mut length) = (Vec::new(), header.len() as u64);
    for (k, line) in lines.enumerate() {
        if k as u64 > until {
            break;
        }
        let row = parse(line.trim_end(), &names, plan).map_err(|what| (k + 2, what))?;
        if row.step != k as u64 {
            return Err((k + 2, format!("is the row of step {}, where {k} belongs", row.step)));
        }
        rows.push(row);
        length += line.len() as u64;
    }
    Ok((rows, length))
}

/// A row of the table; phases are not in it.
fn parse(line: &str, names: &[String], plan: &Plan) -> Result<Row, String> {
    let values: Vec<&str> = line.split(',').collect();
    if values.len() != names.len() {
        return Err(format!("{} values, where {} belong", values.len(), names.len()));
    }
    let mut row = empty_row(plan);
    row.gauges = plan.gauges.iter().map(|_| GaugeRow { volume: 0.0, rate: 0.0 }).collect();
    let (mut gauges, mut drifts) = (0, 0);
    for (name, &text) in names.iter().zip(&values) {
        let number = || text.parse::<f64>().map_err(|_| format!("{name}: `{text}` is no number"));
        let count = || text.parse::<u64>().map_err(|_| format!("{name}: `{text}` is no count"));
        match name.as_str() {
            "step" => row.step = count()?,
            "time" => row.time = number()?,
            "dt" => row.dt = number()?,
            "dt_limiter" => {
                let limiter = Limiter::ALL.into_iter().find(|l| l.name() == text);
                row.dt_limiter = limiter.ok_or_else(|| format!("{name}: no limiter `{text}`"))?;
            }
            "wall" => row.wall = number()?,
            "power_in" => row.power_in = number()?,
            "dissipation" => row.dissipation = number()?,
            "power_error" => row.power_error = number()?,
            "divergence_error" => row.divergence_error = number()?,
            "volume_error" => row.volume_error = number()?,
            "iterations" => row.iterations = count()? as u32,
            "particles" => row.particles = count()? as usize,
            "max_speed" => row.max_speed = number()?,
            "rms_speed" => row.rms_speed = number()?,
            "stabilisation" => row.stabilisation = number()?,
            "potential_energy" => row.potential_energy = number()?,
            "work" => row.work = number()?,
            "dissipated" => row.dissipated = number()?,
            "director_error" => row.director_error = number()?,
            "active_rotation" => row.active_rotation = count()? as usize,
            "splits" => row.splits = count()?,
            "merges" => row.merges = count()?,
            "held" => row.held = count()?,
            "mean_alignment" => row.alignment = Some(number()?).filter(|a| !a.is_nan()),
            other if other.ends_with("outflow_volume") => row.gauges[gauges].volume = number()?,
            other if other.ends_with("outflow_rate") => {
                row.gauges[gauges].rate = number()?;
                gauges += 1;
            }
            _ => {
                row.drift[drifts] = number()?;
                drifts += 1;
            }
        }
    }
    Ok(row)
}
