//! This module writes and reads `series.csv`: one row per step, in SI units.

use crate::plan::Plan;
use crate::sim::row::{ForceRow, GaugeRow, Place, Row, places};
use crate::words::count;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Writer of `series.csv`. Each row is flushed, so a killed run leaves complete rows.
pub struct SeriesWriter {
    out: File,
    /// Length of the complete rows (bytes).
    length: u64,
    /// Number of these rows.
    rows: u64,
    places: Vec<Place>,
}

/// Column names of the series of a plan.
pub fn columns(plan: &Plan) -> Vec<String> {
    places(plan).into_iter().map(|p| p.name).collect()
}

impl SeriesWriter {
    /// Creates the table and writes its header.
    pub fn create(path: &Path, plan: &Plan) -> std::io::Result<Self> {
        let mut series =
            SeriesWriter { out: File::create(path)?, length: 0, rows: 0, places: places(plan) };
        series.append(&format!("{}\n", columns(plan).join(",")))?;
        Ok(series)
    }

    /// Opens a table to continue it after `row`. Nothing is changed before [`SeriesWriter::cut`].
    pub fn resume(path: &Path, plan: &Plan, row: &Row) -> Result<Self, TableError> {
        let step = row.step;
        let fault = |source| TableError::File { path: path.to_path_buf(), source };
        let (rows, length) = read(path, plan, step)?;
        if (rows.len() as u64) < step {
            let path = path.to_path_buf();
            return Err(TableError::Short { path, rows: rows.len(), step });
        }
        let out = File::options().write(true).open(path).map_err(fault)?;
        Ok(SeriesWriter { out, length, rows: rows.len() as u64, places: places(plan) })
    }

    /// Removes the rows of steps after `row` from a table that is continued; `row` itself is written
    /// if the table lacks it.
    pub fn cut(&mut self, row: &Row) -> std::io::Result<()> {
        self.out.set_len(self.length)?;
        self.out.seek(SeekFrom::End(0))?;
        if self.rows == row.step { self.write(row) } else { Ok(()) }
    }

    /// Appends a line completely or not at all.
    fn append(&mut self, line: &str) -> std::io::Result<()> {
        if let Err(e) = self.out.write_all(line.as_bytes()) {
            // A full disk may have accepted part of the line.
            self.out.set_len(self.length)?;
            return Err(e);
        }
        self.length += line.len() as u64;
        Ok(())
    }

    /// Flushes the table to the disk.
    pub fn settle(&mut self) -> std::io::Result<()> {
        self.out.sync_data()
    }

    /// Appends the row of a step.
    pub fn write(&mut self, row: &Row) -> std::io::Result<()> {
        let mut line = String::new();
        for place in &self.places {
            if !line.is_empty() {
                line.push(',');
            }
            line += &place.text(row);
        }
        line.push('\n');
        self.append(&line)
    }
}

/// Reads all complete rows of the table of a run.
pub fn rows(path: &Path, plan: &Plan) -> Result<Vec<Row>, TableError> {
    read(path, plan, u64::MAX).map(|read| read.0)
}

/// Reads the rows of a table up to step `until`; also returns their length in bytes.
fn read(path: &Path, plan: &Plan, until: u64) -> Result<(Vec<Row>, u64), TableError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| TableError::File { path: path.to_path_buf(), source })?;
    whole_rows(&text, plan, until).map_err(|(line, what)| TableError::Row {
        path: path.to_path_buf(),
        line,
        what,
    })
}

/// Error of reading or continuing a table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Path of the table.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A line is not a row of this table.
    #[error("{}: line {line}: {what}", path.display())]
    Row {
        /// Path of the table.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// Description of the error.
        what: String,
    },
    /// Rows before the step to continue from are missing.
    #[error(
        "{}: has only {}; the rows before step {step} are missing", path.display(),
        count(.rows, "complete row")
    )]
    Short {
        /// Path of the table.
        path: PathBuf,
        /// Number of complete rows.
        rows: usize,
        /// Step to continue from.
        step: u64,
    },
}

/// Parses the rows of a table up to step `until`; also returns their length in bytes. An incomplete
/// last line is ignored. The error is the line number and a description.
fn whole_rows(text: &str, plan: &Plan, until: u64) -> Result<(Vec<Row>, u64), (usize, String)> {
    let places = places(plan);
    let names: Vec<&str> = places.iter().map(|p| p.name.as_str()).collect();
    let mut lines = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    let header = lines.next().unwrap_or_default();
    if header.trim_end() != names.join(",") {
        return Err((1, "the columns do not match the scene of this run".into()));
    }
    let (mut rows, mut length) = (Vec::new(), header.len() as u64);
    for (k, line) in lines.enumerate() {
        if k as u64 > until {
            break;
        }
        let row = parse(line.trim_end(), &places, plan).map_err(|what| (k + 2, what))?;
        if row.step != k as u64 {
            return Err((
                k + 2,
                format!("this is the row of step {}; step {k} was expected", row.step),
            ));
        }
        rows.push(row);
        length += line.len() as u64;
    }
    Ok((rows, length))
}

/// Parses one row. The table does not contain the seconds of the phases.
fn parse(line: &str, places: &[Place], plan: &Plan) -> Result<Row, String> {
    let values: Vec<&str> = line.split(',').collect();
    if values.len() != places.len() {
        return Err(format!("{}; expected: {}", count(values.len(), "value"), places.len()));
    }
    let mut row = Row::empty(plan.state.materials.len());
    row.gauges = plan.gauges.iter().map(|_| GaugeRow::default()).collect();
    row.forces = plan.forces.iter().map(|_| ForceRow::default()).collect();
    places.iter().zip(&values).try_for_each(|(place, text)| place.set(&mut row, text))?;
    Ok(row)
}
