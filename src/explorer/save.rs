//! This module saves a run of the explorer in a folder with the files of `grainscope run`.

use super::live::Live;
use super::protocol::{Mode, SavedState};
use crate::light::reel::Detail;
use crate::light::report::{self, ReportError};
use crate::record::folder::{self, FolderError};
use crate::record::plots::PlotError;
use crate::record::rerun_log::{RecordError, RerunLog, Sink};
use crate::record::run_plots::plots_of_run;
use crate::record::series::SeriesWriter;
use crate::record::summary::{Ending, Summary, Tally};
use crate::results::{Member, ResultsError};
use crate::scene::{is_folder_name, to_toml};
use std::path::{Path, PathBuf};

/// Maximum length of a folder name (characters).
const MAX_NAME: usize = 64;

/// Error of saving a run.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The name is not a valid folder name.
    #[error("{0:?} is not a valid folder name: use 1 to 64 letters, digits, `_` and `-`")]
    Name(String),
    /// The folder cannot be created.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The summary cannot be written.
    #[error("{0}")]
    Summary(String),
    /// The recording cannot be written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A plot cannot be written.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The files cannot be read back for the report.
    #[error(transparent)]
    Read(#[from] ResultsError),
    /// The report cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// A file cannot be written.
    #[error("{} cannot be written: {source}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// Checks that a name is a plain folder name, which cannot lead out of the parent folder.
pub fn checked(name: &str) -> Result<&str, SaveError> {
    if name.len() > MAX_NAME || !is_folder_name(name) {
        return Err(SaveError::Name(name.chars().take(MAX_NAME).collect()));
    }
    Ok(name)
}

/// Saves a run in a new folder below `out`. If the name is taken, a number is appended.
pub fn keep(
    live: &Live,
    mode: Mode,
    out: &Path,
    name: &str,
) -> Result<(PathBuf, SavedState), SaveError> {
    let mut claimed = folder::create_below(out, checked(name)?)?;
    let folder = claimed.path().to_owned();
    let at = |name: &str| folder.join(name);
    let write = |name: &str, text: String| {
        let path = at(name);
        std::fs::write(&path, text).map_err(|source| SaveError::Write { path, source })
    };
    write("scene.toml", to_toml(&live.drive.plan.scene))?;
    let table = at("series.csv");
    SeriesWriter::create(&table, &live.drive.plan)
        .and_then(|mut series| live.rows.iter().try_for_each(|row| series.write(row)))
        .map_err(|source| SaveError::Write { path: table, source })?;
    let recording = at("recording.rrd");
    let folder_name = folder.file_name().map(|n| n.to_string_lossy().into_owned());
    let mut info = live.info.clone();
    info.name = folder_name.clone().unwrap_or(info.name);
    // The schedule has changed since the start of the run.
    info.scene_toml = to_toml(&live.drive.plan.scene);
    let mut log = RerunLog::open(&info, &[Sink::Save(recording.clone())])?;
    live.frames.frames().iter().try_for_each(|frame| log.frame(frame))?;
    log.finish()?;
    let mut tally = Tally { wall: live.seconds(), ..live.drive.tally.clone() };
    tally.warnings.extend(live.drive.run.warnings().iter().map(ToString::to_string));
    let ending = match mode {
        Mode::Finished => Ending::Finished,
        Mode::Failed => Ending::Failed,
        _ => Ending::Interrupted,
    };
    let summary = Summary::new(
        live.drive.run.as_ref(),
        &tally,
        ending,
        folder.display().to_string(),
        Some(recording.display().to_string()),
    );
    summary.write(&folder).map_err(SaveError::Summary)?;
    plots_of_run(&folder, &live.drive.plan, &live.rows)?;
    let page = at("report.html");
    report::write(&[Member::open(&folder)?], Detail::default(), &page)?;
    claimed.settle(true);
    let files = folder::FILES.iter().filter_map(|name| {
        let size = std::fs::metadata(at(name)).ok()?.len();
        Some((name.to_string(), size))
    });
    let scene = at("scene.toml");
    let saved = SavedState {
        name: folder_name.unwrap_or_default(),
        steps: summary.steps,
        state_hash: summary.state_hash,
        command: format!("grainscope run {} --steps {}", scene.display(), summary.steps),
        files: files.collect(),
    };
    Ok((folder, saved))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_folder_names_are_accepted() {
        for name in ["a", "silo-2", "my_run", "5"] {
            assert!(checked(name).is_ok(), "{name}");
        }
        for name in ["", ".", "..", "../a", "a/b", "a\\b", "a b", "C:", "a\0", "ä", &"a".repeat(65)]
        {
            assert!(checked(name).is_err(), "{name}");
        }
    }
}
