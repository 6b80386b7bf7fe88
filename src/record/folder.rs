//! This module creates and checks the output folder of a run.

use std::path::{Path, PathBuf};

/// Error of creating the folder of a run.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds files of another run.
    #[error("the folder {} already holds a run; --force overwrites it", .0.display())]
    Taken(PathBuf),
    /// The folder cannot be written.
    #[error("the folder {} cannot be written: {source}", path.display())]
    Write {
        /// Path of the folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

/// Files that a run writes. `--force` removes these and the checkpoints, and nothing else.
pub const FILES: [&str; 10] = [
    "recording.rrd",
    "series.csv",
    "summary.json",
    "scene.toml",
    "outflow.svg",
    "outflow.png",
    "diagnostics.svg",
    "diagnostics.png",
    "alignment.svg",
    "alignment.png",
];

/// Upper bound of the number that is appended to a taken name.
const MOST: u32 = 100_000;

/// Creates the folder of a run: `out` if given, which must not hold a run unless `force` is set;
/// otherwise `runs/<name>`, or `runs/<name>-2`, `-3`, ... if that is taken.
pub fn create(name: &str, out: Option<&Path>, force: bool) -> Result<PathBuf, FolderError> {
    let runs = Path::new("runs");
    let wanted = out.map_or_else(|| runs.join(name), Path::to_path_buf);
    if force || !holds_run(&wanted) {
        return make(&wanted, force);
    }
    if out.is_some() {
        return Err(FolderError::Taken(wanted));
    }
    create_below(runs, name)
}

/// Creates the folder of a run: `<parent>/<name>`, or `<name>-2`, `-3`, ... if that is taken.
pub fn create_below(parent: &Path, name: &str) -> Result<PathBuf, FolderError> {
    let wanted = parent.join(name);
    let numbered = (2..MOST).map(|k| parent.join(format!("{name}-{k}")));
    let free = std::iter::once(wanted.clone()).chain(numbered).find(|path| !holds_run(path));
    make(&free.ok_or(FolderError::Taken(wanted))?, false)
}

/// Removes the recording of a run that could not start, and its folder if it is then empty.
pub fn abandon(folder: &Path) {
    // Errors are ignored: the error that is being reported matters more.
    let _ = std::fs::remove_file(folder.join("recording.rrd"));
    let _ = std::fs::remove_dir(folder);
}

fn holds_run(folder: &Path) -> bool {
    FILES.iter().any(|f| folder.join(f).exists())
}

fn make(folder: &Path, force: bool) -> Result<PathBuf, FolderError> {
    let fault = |source| FolderError::Write { path: folder.to_path_buf(), source };
    std::fs::create_dir_all(folder).map_err(fault)?;
    if force {
        for file in FILES {
            match std::fs::remove_file(folder.join(file)) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(fault(e)),
                _ => {}
            }
        }
        for (_, path) in super::checkpoint::list(folder) {
            std::fs::remove_file(path).map_err(fault)?;
        }
    }
    // Test now, not after an hour, whether files can be created here.
    let probe = folder.join(".grainscope-probe");
    std::fs::write(&probe, b"").map_err(fault)?;
    std::fs::remove_file(&probe).map_err(fault)?;
    Ok(folder.to_path_buf())
}
