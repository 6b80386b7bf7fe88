//! This module implements `grainscope repair`: it closes the files of a killed run.

use super::{Failure, print};
use crate::record::rerun_log::repair;
use std::path::{Path, PathBuf};

/// Close the recording or the files of a run that was killed.
///
/// A recording without its end keeps all complete messages and gets an end; a table keeps its
/// complete rows. Complete files are not changed. (`grainscope resume` repairs by itself.)
#[derive(clap::Args)]
pub struct Args {
    /// A recording (.rrd), or the folder of a run
    path: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut told = Vec::new();
    if args.path.is_dir() {
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
    let (kept, saved) = repair(path).map_err(|e| Failure::Environment(e.to_string()))?;
    let steps = kept.last_step.map_or("no step".into(), |step| format!("steps 0 to {step}"));
    let path = path.display();
    Ok(match saved {
        None => format!("{path}: is complete, {steps}"),
        Some(saved) => {
            format!("{path}: repaired, {steps}, {:.1} MB", saved.bytes as f64 / 1e6)
        }
    })
}

/// Cuts a table after its last complete row. Returns the text to print.
fn mend_table(path: &Path) -> Result<String, Failure> {
    let fault = |e: std::io::Error| Failure::Environment(format!("{}: {e}", path.display()));
    let bytes = std::fs::read(path).map_err(fault)?;
    let whole = bytes.iter().rposition(|&b| b == b'\n').map_or(0, |k| k + 1);
    let rows = bytes[..whole].iter().filter(|&&b| b == b'\n').count().saturating_sub(1);
    let path_shown = path.display();
    if whole == bytes.len() {
        return Ok(format!("{path_shown}: is complete, {rows} rows"));
    }
    let file = std::fs::File::options().write(true).open(path).map_err(fault)?;
    file.set_len(whole as u64).and_then(|()| file.sync_all()).map_err(fault)?;
    Ok(format!("{path_shown}: repaired, {rows} rows"))
}
