//! The folder of a run.

use std::path::{Path, PathBuf};

/// Why a run has no folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    #[error("the folder {} already holds a run; --force overwrites it", .0.display())]
    Taken(PathBuf),
    #[error("the folder {} cannot be written: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
}

/// Files that a run writes; `--force` removes these and nothing else.
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

/// Most numbered siblings tried before giving up.
const MOST: u32 = 100_000;

/// Makes the folder of a run: `out` as given, which must not hold a run unless `force`; else
/// `runs/<name>`, or `runs/<name>-2`, `-3`, ... if taken.
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

/// Makes the folder of a run, `<parent>/<name>`, or `<name>-2`, `-3`, ... if taken.
pub fn create_below(parent: &Path, name: &str) -> Result<PathBuf, FolderError> {
    let wanted = parent.join(name);
    let numbered = (2..MOST).map(|k| parent.join(format!("{name}-{k}")));
    let free = std::iter::once(wanted.clone()).chain(numbered).find(|path| !holds_run(path));
    make(&free.ok_or(FolderError::Taken(wanted))?, false)
}

/// Takes back what a run that could not start has left: a recording, and the folder if empty.
pub fn abandon(folder: &Path) {
    // Best effort: the fault that is being reported matters more.
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
    // Find out now, not after an hour, whether files can be made here.
    let probe = folder.join(".grainscope-probe");
    std::fs::write(&probe, b"").map_err(fault)?;
    std::fs::remove_file(&probe).map_err(fault)?;
    Ok(folder.to_path_buf())
}
