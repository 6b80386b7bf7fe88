//! This module implements `grainscope repair`: it closes the files of a killed run.

use super::{Failure, print};
use crate::record::folder::RunFolder;
use crate::record::replace::{self, Kind, beside};
use crate::record::rerun_log::{Repaired, repair};
use crate::words::count;
use std::path::{Path, PathBuf};

/// Close the recording or the files of a run that was killed.
///
/// A recording without its end keeps all complete messages and gets an end; a table keeps its
/// complete rows. Damaged parts are left out; the original is then kept beside the repaired file,
/// and what was lost is told. Complete files are not changed. (`grainscope resume` repairs by
/// itself.)
#[derive(clap::Args)]
pub struct Args {
    /// A recording (.rrd), or the folder of a run
    path: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut told = Vec::new();
    if args.path.is_dir() {
        let _claimed = RunFolder::claim(&args.path)?;
        let (recording, table) = (args.path.join("recording.rrd"), args.path.join("series.csv"));
        if recording.exists() {
            told.push(mend_recording(&recording)?);
        }
        if table.exists() {
            told.push(mend_table(&table)?);
        }
        if told.is_empty() {
            let folder = args.path.display();
            return Err(Failure::Environment(format!("{folder}: is not the folder of a run")));
        }
    } else {
        told.push(mend_recording(&args.path)?);
    }
    print(&told.join("\n"))
}

/// Repairs a recording. Returns the text to print.
fn mend_recording(path: &Path) -> Result<String, Failure> {
    let Repaired { kept, damage, saved, original } =
        repair(path).map_err(|e| Failure::Environment(e.to_string()))?;
    let steps = kept.last_step.map_or("no step".into(), |step| format!("steps 0 to {step}"));
    let pictures = count(kept.pictures.len(), "frame");
    let path = path.display();
    let Some(saved) = saved else {
        return Ok(format!("{path}: is complete, {steps}, {pictures}"));
    };
    let size = saved.bytes as f64 / 1e6;
    let mut told = format!("{path}: repaired, {steps}, {pictures}, {size:.1} MB");
    if let Some(original) = original {
        let missing = kept.last_step.map_or(0, |last| (last + 1) as usize - kept.rows.len());
        told += &format!(
            "; lost: {} in {}, and with them all values of {}; the original is kept as {}",
            count(damage.bytes, "byte"),
            count(damage.places, "damaged place"),
            count(missing, "step"),
            original.display()
        );
    }
    Ok(told)
}

/// Removes damaged rows from a table. Returns the text to print.
fn mend_table(path: &Path) -> Result<String, Failure> {
    let fault = |e: std::io::Error| Failure::Environment(format!("{}: {e}", path.display()));
    let text = std::fs::read(path).map_err(fault)?;
    let text = String::from_utf8_lossy(&text);
    let whole = text.rfind('\n').map_or(0, |k| k + 1);
    let mut lines = text[..whole].lines();
    let header = lines.next().unwrap_or_default();
    let (rows, damaged): (Vec<&str>, Vec<&str>) = lines.partition(|line| is_row(line, header));
    let shown = path.display();
    if damaged.is_empty() && whole == text.len() {
        return Ok(format!("{shown}: is complete, {}", count(rows.len(), "row")));
    }
    if damaged.is_empty() {
        // An incomplete last row, as a killed run leaves it.
        let file = std::fs::File::options().write(true).open(path).map_err(fault)?;
        file.set_len(whole as u64).and_then(|()| file.sync_all()).map_err(fault)?;
        return Ok(format!("{shown}: repaired, {}", count(rows.len(), "row")));
    }
    let original = beside(path, ".damaged");
    if original.exists() {
        return Err(Failure::Environment(format!(
            "{}: is in the way; it holds the original of an earlier repair: move it away",
            original.display()
        )));
    }
    std::fs::rename(path, &original).map_err(fault)?;
    let table: String =
        std::iter::once(&header).chain(&rows).map(|line| format!("{line}\n")).collect();
    replace::write(path, table, Kind::Checked)?;
    Ok(format!(
        "{shown}: repaired, {}; lost: {}; the original is kept as {}",
        count(rows.len(), "row"),
        count(damaged.len(), "damaged row"),
        original.display()
    ))
}

/// Whether a line of a table has a value in every column of the header. The first column is a
/// number.
fn is_row(line: &str, header: &str) -> bool {
    let values: Vec<&str> = line.split(',').collect();
    let plain = |v: &&str| !v.is_empty() && v.chars().all(|c| c.is_ascii_graphic());
    values.len() == header.split(',').count()
        && values.iter().all(plain)
        && values[0].parse::<u64>().is_ok()
}
