//! This module manages the folder of a sweep and the state of its cases.
//!
//! ```text
//! cases.json scene.toml     cases to be run, and their scene
//! cases/<id>                finished runs, moved here by a single rename
//! failed/<id>               files of a failed run, with the cause
//! running/<id>              unfinished runs, each under a lock
//! ```

use super::{Case, List, SweepError};
use crate::record::checkpoint;
use crate::record::folder::{self, NOTE};
use crate::record::replace::{self, Kind, ReplaceError};
use crate::scene::{SceneSource, is_folder_name};
use serde::{Deserialize, Serialize};
use std::fs::{self, File, TryLockError};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Kind of the list of cases.
const LIST: Kind<'static> = Kind::Json("cases");

/// The folder of a sweep.
#[derive(Clone, Debug)]
pub struct Store {
    root: PathBuf,
}

/// State of a case.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// The run is finished.
    Done,
    /// The run failed, with this cause.
    Failed(String),
    /// The run has not ended, or not started.
    Missing,
}

/// Information about a case that is not in the summary of its run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Note {
    /// Id of the case.
    pub id: String,
    /// Cause of the failure, if it failed.
    #[serde(default)]
    pub cause: Option<String>,
    /// Peak memory of its process (bytes); `None` where the system does not report it.
    #[serde(default)]
    pub peak_memory: Option<u64>,
}

impl Store {
    /// The store in the folder `root`.
    pub fn new(root: &Path) -> Store {
        Store { root: root.to_owned() }
    }

    /// Path of the folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Folder of a finished case.
    pub fn done(&self, id: &str) -> PathBuf {
        self.root.join("cases").join(id)
    }

    /// Folder of a failed case.
    pub fn failed(&self, id: &str) -> PathBuf {
        self.root.join("failed").join(id)
    }

    fn running(&self, id: &str) -> PathBuf {
        self.root.join("running").join(id)
    }

    /// Writes the list of cases and the scene of the sweep.
    pub fn write(&self, list: &List, source: &SceneSource) -> Result<(), SweepError> {
        fs::create_dir_all(&self.root).map_err(SweepError::file("make", &self.root))?;
        let json = serde_json::to_string_pretty(list)
            .map_err(|e| SweepError::Broken { path: self.cases(), cause: e.to_string() })?;
        // A scene beside a list of cases is that of the sweep; any other is the user's.
        let before = fs::read_to_string(self.scene()).ok();
        if before.as_deref() != Some(source.text()) {
            if before.is_some() && !self.cases().exists() {
                let what = "the scene of a sweep";
                return Err(ReplaceError::Foreign { path: self.scene(), what }.into());
            }
            replace::write(&self.scene(), source.text(), Kind::Checked)?;
        }
        Ok(replace::write(&self.cases(), format!("{json}\n"), LIST)?)
    }

    /// Reads the list of cases and the scene of the sweep.
    pub fn read(&self) -> Result<(List, SceneSource), SweepError> {
        let path = self.cases();
        if !path.is_file() {
            return Err(SweepError::Usage(format!(
                "{}: holds no sweep; expected a folder with {}, as `grainscope sweep <scene> --vary \
                 ... --out DIR` writes it",
                self.root.display(),
                self.cases().file_name().unwrap_or_default().to_string_lossy()
            )));
        }
        let text = fs::read_to_string(&path).map_err(SweepError::file("read", &path))?;
        let list: List = serde_json::from_str(&text).map_err(|e| SweepError::Broken {
            path: path.clone(),
            cause: format!("is not a list of cases: {e}"),
        })?;
        check_names(&list).map_err(|cause| SweepError::Broken { path, cause })?;
        let scene = self.scene();
        let text = fs::read_to_string(&scene).map_err(SweepError::file("read", &scene))?;
        Ok((list, SceneSource::new(scene.display().to_string(), text)))
    }

    fn cases(&self) -> PathBuf {
        self.root.join("cases.json")
    }

    fn scene(&self) -> PathBuf {
        self.root.join("scene.toml")
    }

    /// State of a case, read from the folders.
    pub fn state(&self, id: &str) -> State {
        if self.done(id).join("summary.json").is_file() {
            State::Done
        } else if self.failed(id).is_dir() {
            let cause = self.note(&self.failed(id)).cause;
            State::Failed(cause.unwrap_or_else(|| "its cause was not recorded".into()))
        } else {
            State::Missing
        }
    }

    /// Reads the note in the folder of a case.
    pub fn note(&self, folder: &Path) -> Note {
        let text = fs::read_to_string(folder.join(NOTE)).unwrap_or_default();
        serde_json::from_str(&text).unwrap_or_default()
    }

    /// Number of finished runs that are not in the list.
    pub fn strangers(&self, list: &List) -> usize {
        let Ok(entries) = fs::read_dir(self.root.join("cases")) else { return 0 };
        let name = |e: std::io::Result<fs::DirEntry>| e.ok()?.file_name().into_string().ok();
        entries.filter_map(name).filter(|n| list.cases.iter().all(|c| c.id != *n)).count()
    }

    /// Starts a case. If another process is running it, waits for that process; `None` if the case
    /// is then finished.
    pub fn begin(&self, id: &str) -> Result<Option<Attempt>, SweepError> {
        if self.state(id) == State::Done {
            return Ok(None);
        }
        let running = self.root.join("running");
        fs::create_dir_all(&running).map_err(SweepError::file("make", &running))?;
        let path = running.join(format!("{id}.lock"));
        let lock = File::create(&path).map_err(SweepError::file("write", &path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                eprintln!("another process is running case {id}; waiting for it");
                lock.lock().map_err(SweepError::file("lock", &path))?;
            }
            // A file system without locks. The lock only prevents running a case twice.
            Err(TryLockError::Error(e)) => {
                eprintln!("warning: {} cannot be locked: {e}", path.display())
            }
        }
        if self.state(id) == State::Done {
            // The other process has finished the case.
            let _ = fs::remove_file(&path);
            return Ok(None);
        }
        let folder = self.running(id);
        remove(&folder)?;
        fs::create_dir_all(&folder).map_err(SweepError::file("make", &folder))?;
        Ok(Some(Attempt { store: self.clone(), id: id.to_owned(), folder, _lock: lock }))
    }

    /// Records the failure of a case whose process ended without recording a cause.
    pub fn blame(&self, id: &str, cause: &str) -> Result<(), SweepError> {
        let (from, to) = (self.running(id), self.failed(id));
        fs::create_dir_all(&from).map_err(SweepError::file("make", &from))?;
        self.shelve(id, &from, &to, Some(cause), None)
    }

    /// Computed fraction of a case, 0 to 1, by the last row of its series.
    pub fn progress(&self, case: &Case) -> f64 {
        match self.state(&case.id) {
            State::Done | State::Failed(_) => 1.0,
            State::Missing => {
                let time = last_time(&self.running(&case.id).join("series.csv"));
                if case.end > 0.0 { (time.unwrap_or(0.0) / case.end).clamp(0.0, 1.0) } else { 0.0 }
            }
        }
    }

    fn shelve(
        &self,
        id: &str,
        from: &Path,
        to: &Path,
        cause: Option<&str>,
        peak_memory: Option<u64>,
    ) -> Result<(), SweepError> {
        let note = Note { id: id.to_owned(), cause: cause.map(String::from), peak_memory };
        let json = serde_json::to_string_pretty(&note).unwrap_or_default();
        let path = from.join(NOTE);
        fs::write(&path, format!("{json}\n")).map_err(SweepError::file("write", &path))?;
        correct_paths(from, to);
        if let Some(parent) = to.parent() {
            fs::create_dir_all(parent).map_err(SweepError::file("make", parent))?;
        }
        remove(to)?;
        fs::rename(from, to).map_err(SweepError::file("move a run to", to))
    }
}

/// A case that this process alone is running.
pub struct Attempt {
    store: Store,
    id: String,
    folder: PathBuf,
    _lock: File,
}

impl Attempt {
    /// Folder in which the run is written.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Moves the finished run to its final place.
    pub fn finish(self) -> Result<(), SweepError> {
        let to = self.store.done(&self.id);
        self.store.shelve(&self.id, &self.folder, &to, None, peak_memory())?;
        remove(&self.store.failed(&self.id))?;
        self.unlock();
        Ok(())
    }

    /// Keeps the files of the failed run and records the cause.
    pub fn fail(self, cause: &str) -> Result<(), SweepError> {
        let to = self.store.failed(&self.id);
        self.store.shelve(&self.id, &self.folder, &to, Some(cause), peak_memory())?;
        self.unlock();
        Ok(())
    }

    /// Discards the run.
    pub fn abandon(self) {
        // Errors are ignored: the next attempt removes the folder first.
        let _ = remove(&self.folder);
        self.unlock();
    }

    fn unlock(self) {
        // A lock file that remains can be locked again.
        let _ = fs::remove_file(self.store.root.join("running").join(format!("{}.lock", self.id)));
    }
}

/// Peak memory of this process (bytes); `None` where the system does not report it.
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}

/// Corrects the paths in the summary after the run was moved.
fn correct_paths(from: &Path, to: &Path) {
    let path = from.join("summary.json");
    let Ok(text) = fs::read_to_string(&path) else { return };
    let Ok(mut summary) = serde_json::from_str::<serde_json::Value>(&text) else { return };
    for key in ["folder", "recording"] {
        let Some(serde_json::Value::String(place)) = summary.get_mut(key) else { continue };
        if let Ok(below) = Path::new(place).strip_prefix(from) {
            let moved = if below.as_os_str().is_empty() { to.to_owned() } else { to.join(below) };
            *place = moved.display().to_string();
        }
    }
    let json = serde_json::to_string_pretty(&summary).unwrap_or(text);
    // If this fails, only two paths in the old summary are wrong.
    let _ = fs::write(&path, format!("{json}\n"));
}

/// Checks the names in a list: they become names of folders.
fn check_names(list: &List) -> Result<(), String> {
    let names = list.cases.iter().map(|c| &c.id).chain(Some(&list.spec.name));
    match names.into_iter().find(|name| !is_folder_name(name)) {
        Some(name) => Err(format!(
            "the name {name:?} is not one that grainscope gives: expected letters, digits, `_` and \
             `-`; make the list again with `grainscope sweep`"
        )),
        None => Ok(()),
    }
}

/// Removes the folder of a case if everything in it was written by this program.
fn remove(folder: &Path) -> Result<(), SweepError> {
    let strange =
        |path: PathBuf| SweepError::from(ReplaceError::Foreign { path, what: "part of a case" });
    if fs::symlink_metadata(folder).is_ok_and(|m| !m.is_dir()) {
        return Err(strange(folder.to_owned()));
    }
    if let Some(path) = folder::strange_entry(folder) {
        return Err(strange(path));
    }
    checkpoint::only_ours(folder)?;
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
            Err(SweepError::file("remove", folder)(e))
        }
        _ => Ok(()),
    }
}

/// Time in the last complete row of a series (s).
fn last_time(path: &Path) -> Option<f64> {
    const TAIL: u64 = 4096;
    let mut file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL))).ok()?;
    let mut bytes = vec![];
    file.read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let whole = &text[..text.rfind('\n')?];
    whole.lines().last()?.split(',').nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempFolder;

    #[test]
    fn only_complete_cases_appear() {
        let here = TempFolder::new().expect("a folder");
        let store = Store::new(here.path());
        let attempt = store.begin("a").expect("begins").expect("not done");
        let written = attempt.folder().join("summary.json");
        let place = attempt.folder().join("recording.rrd").display().to_string();
        fs::write(&written, serde_json::json!({ "recording": place }).to_string()).expect("a file");
        fs::write(attempt.folder().join("series.csv"), "step,time\n0,0\n1,0.5\n2,0.7")
            .expect("a file");
        assert_eq!(last_time(&attempt.folder().join("series.csv")), Some(0.5));
        assert_eq!(store.state("a"), State::Missing);
        attempt.finish().expect("moved");
        assert_eq!(store.state("a"), State::Done);
        let summary = fs::read_to_string(store.done("a").join("summary.json")).expect("there");
        assert!(summary.contains(&store.done("a").join("recording.rrd").display().to_string()));
        assert!(store.begin("a").expect("asks").is_none());
        assert_eq!(fs::read_dir(here.path().join("running")).expect("there").count(), 0);
    }

    #[test]
    fn failures_keep_their_cause_until_a_run_succeeds() {
        let here = TempFolder::new().expect("a folder");
        let store = Store::new(here.path());
        store.begin("a").expect("begins").expect("not done").fail("too stiff").expect("moved");
        assert_eq!(store.state("a"), State::Failed("too stiff".into()));
        let attempt = store.begin("a").expect("begins").expect("not done");
        fs::write(attempt.folder().join("summary.json"), "{}").expect("a file");
        attempt.finish().expect("moved");
        assert_eq!(store.state("a"), State::Done);
        assert!(!store.failed("a").exists());
        store.blame("b", "killed").expect("written");
        assert_eq!(store.state("b"), State::Failed("killed".into()));
    }

    #[test]
    fn a_case_is_never_run_twice_at_once() {
        let here = TempFolder::new().expect("a folder");
        let store = Store::new(here.path());
        let first = store.begin("a").expect("begins").expect("not done");
        let second = {
            let store = store.clone();
            std::thread::spawn(move || store.begin("a").expect("asks").is_none())
        };
        std::thread::sleep(std::time::Duration::from_millis(100));
        assert!(!second.is_finished());
        fs::write(first.folder().join("summary.json"), "{}").expect("a file");
        first.finish().expect("moved");
        assert!(second.join().expect("no panic"), "it was done twice");
    }
}
