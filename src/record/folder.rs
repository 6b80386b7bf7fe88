//! This module claims the folder of a run: one process at a time writes into it.

mod lock;

use super::checkpoint;
use super::replace::{Aside, Kind, ReplaceError, beside, may_replace};
use lock::Lock;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Error of claiming the folder of a run.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The folder holds files of another run.
    #[error("the folder {} already holds a run; --force overwrites it", .0.display())]
    Taken(PathBuf),
    /// Another process writes into the folder.
    #[error(
        "the folder {} is in use by {holder}; wait for its end, or choose another folder",
        path.display()
    )]
    Busy {
        /// Path of the folder.
        path: PathBuf,
        /// The process that uses it.
        holder: String,
    },
    /// The scene file of the folder is the one that is run, but the run changes it.
    #[error(
        "{} is the scene that is run, and the options change it: it is left as it is; choose \
         another folder with --out", .0.display()
    )]
    OwnScene(PathBuf),
    /// The folder cannot be written.
    #[error("the folder {} cannot be written: {source}", path.display())]
    Write {
        /// Path of the folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A file is in the way.
    #[error(transparent)]
    Replace(#[from] ReplaceError),
}

/// Name of the scene file of a run.
pub const SCENE: &str = "scene.toml";

/// Name of the file that a sweep adds to the folder of a case, with what the summary does not hold.
pub const NOTE: &str = "case.json";

/// Files that a run writes. `--force` replaces these and the checkpoints, and nothing else.
pub const FILES: [&str; 11] = [
    "recording.rrd",
    "series.csv",
    "summary.json",
    SCENE,
    "outflow.svg",
    "outflow.png",
    "diagnostics.svg",
    "diagnostics.png",
    "alignment.svg",
    "alignment.png",
    "report.html",
];

/// Upper bound of the number that is appended to a taken name.
const MOST: u32 = 100_000;

/// Start of the names of subfolders with files that are being replaced.
const ASIDE: &str = ".replaced";

/// Largest number of such subfolders.
const MOST_ASIDE: u32 = 100;

/// The scene file that is run.
#[derive(Clone, Copy, Debug)]
pub struct Loaded<'a> {
    /// Path of the file.
    pub path: &'a Path,
    /// Whether its content is the scene that is run, without any changes.
    pub unchanged: bool,
}

/// The folder of a run, which only this process writes. Until [`RunFolder::settle`], the files of
/// an earlier run are kept aside; they come back when this value is dropped.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Whether this process made the folder.
    made: bool,
    /// Whether the scene file in the folder is the one that was loaded.
    own_scene: bool,
    /// Whether files that exist when this value is dropped belong to a run that did not begin.
    fresh: bool,
    aside: Aside,
    lock: Lock,
}

/// Claims the folder of a run: `out` if given, which must not hold a run unless `force` is set;
/// otherwise `runs/<name>`, or `runs/<name>-2`, `-3`, ... if that is taken. The `loaded` file is
/// never written.
///
/// # Errors
/// The folder is taken, in use or cannot be written, or holds a file of someone else.
pub fn create(
    name: &str,
    out: Option<&Path>,
    force: bool,
    loaded: Option<Loaded>,
) -> Result<RunFolder, FolderError> {
    let Some(out) = out else {
        let wanted = Path::new("runs").join(name);
        return match force {
            true => RunFolder::replace(&wanted, loaded),
            false => create_below(Path::new("runs"), name),
        };
    };
    if force {
        return RunFolder::replace(out, loaded);
    }
    let mut folder = RunFolder::claim(out)?;
    folder.own_scene = is_same(&out.join(SCENE), loaded)?;
    if folder.holds_run() { Err(FolderError::Taken(out.to_owned())) } else { Ok(folder.fresh()) }
}

/// Claims the folder of a run: `<parent>/<name>`, or `<name>-2`, `-3`, ... if that is taken.
///
/// # Errors
/// The folder cannot be written, or there is no free name.
pub fn create_below(parent: &Path, name: &str) -> Result<RunFolder, FolderError> {
    let wanted = parent.join(name);
    let numbered = (2..MOST).map(|k| parent.join(format!("{name}-{k}")));
    for path in std::iter::once(wanted.clone()).chain(numbered) {
        match RunFolder::claim(&path) {
            Ok(folder) if !folder.holds_run() => return Ok(folder.fresh()),
            // Another process uses it, or it holds a run.
            Ok(_) | Err(FolderError::Busy { .. }) => {}
            Err(e) => return Err(e),
        }
    }
    Err(FolderError::Taken(wanted))
}

/// Whether a path is that of the loaded file.
fn is_same(path: &Path, loaded: Option<Loaded>) -> Result<bool, FolderError> {
    let Some(loaded) = loaded else { return Ok(false) };
    let same = match (path.canonicalize(), loaded.path.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    };
    if same && !loaded.unchanged { Err(FolderError::OwnScene(path.to_owned())) } else { Ok(same) }
}

impl RunFolder {
    /// Claims a folder with whatever it holds; it is made if it does not exist.
    ///
    /// # Errors
    /// The folder is in use or cannot be written.
    pub fn claim(path: &Path) -> Result<RunFolder, FolderError> {
        let fault = |source| FolderError::Write { path: path.to_path_buf(), source };
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(fault)?;
        }
        let made = match fs::create_dir(path) {
            Ok(()) => true,
            Err(e) if e.kind() == ErrorKind::AlreadyExists => false,
            Err(e) => return Err(fault(e)),
        };
        let lock = Lock::take(path)?;
        Ok(RunFolder {
            path: path.to_owned(),
            made,
            own_scene: false,
            fresh: false,
            aside: Aside::default(),
            lock,
        })
    }

    /// Claims a folder and moves the files of an earlier run in it aside.
    fn replace(path: &Path, loaded: Option<Loaded>) -> Result<RunFolder, FolderError> {
        let mut folder = RunFolder::claim(path)?;
        folder.own_scene = is_same(&path.join(SCENE), loaded)?;
        let files: Vec<&str> = folder.files().filter(|f| path.join(f).exists()).collect();
        let checkpoints = path.join(checkpoint::FOLDER);
        let run = path.join("series.csv").exists() || !checkpoint::list(path).is_empty();
        for name in &files {
            may_replace(&path.join(name), kind(name))?;
            if *name == SCENE && !(run && is_bare(&path.join(name))) {
                let path = path.join(name);
                return Err(ReplaceError::Foreign { path, what: "the scene of a run" }.into());
            }
        }
        checkpoint::only_ours(path)?;
        if files.is_empty() && !checkpoints.exists() {
            return Ok(folder.fresh());
        }
        let aside = folder.free_aside()?;
        for name in files {
            folder.aside.take(&path.join(name), &aside.join(name))?;
        }
        folder.aside.take(&checkpoints, &aside.join(checkpoint::FOLDER))?;
        Ok(folder.fresh())
    }

    /// Makes a subfolder for files that are moved aside.
    fn free_aside(&self) -> Result<PathBuf, FolderError> {
        let mut last = None;
        for k in 1..MOST_ASIDE {
            let aside = self.path.join(format!("{ASIDE}-{k}"));
            match fs::create_dir(&aside) {
                Ok(()) => return Ok(aside),
                Err(e) => last = Some(e),
            }
        }
        let source = last.unwrap_or_else(|| ErrorKind::AlreadyExists.into());
        Err(FolderError::Write { path: self.path.clone(), source })
    }

    /// From now on, files of a run in the folder are those of a run that has not begun, and are
    /// removed if it does not begin.
    fn fresh(mut self) -> RunFolder {
        self.fresh = true;
        self
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the scene file in the folder is the one that was loaded, and is not written.
    pub fn has_own_scene(&self) -> bool {
        self.own_scene
    }

    /// Moves a recording outside the folder aside, which the run replaces.
    ///
    /// # Errors
    /// The file is not a recording, or cannot be moved.
    pub fn set_aside(&mut self, recording: &Path) -> Result<(), FolderError> {
        may_replace(recording, Kind::Recording)?;
        if fs::metadata(recording).is_ok_and(|m| m.is_file()) {
            self.aside.take(recording, &beside(recording, ASIDE))?;
        }
        Ok(())
    }

    /// The files of a run except the scene that was loaded.
    fn files(&self) -> impl Iterator<Item = &'static str> + use<> {
        let own_scene = self.own_scene;
        FILES.into_iter().filter(move |f| !(own_scene && *f == SCENE))
    }

    /// Whether the folder holds a run.
    fn holds_run(&self) -> bool {
        self.files().any(|f| self.path.join(f).exists())
    }

    /// All files of the run are open. From now on they are kept, unless they are to replace an
    /// earlier run.
    pub fn begin(&mut self) {
        self.fresh = self.replaces();
    }

    /// The run has ended and is kept. The earlier run is removed if the new one has `replaced` it;
    /// otherwise its place is returned.
    pub fn settle(&mut self, replaced: bool) -> Option<PathBuf> {
        self.fresh = false;
        if !replaced {
            return self.aside.leave();
        }
        self.aside.discard();
        // Also those that a killed process has left.
        for k in 1..MOST_ASIDE {
            let aside = self.path.join(format!("{ASIDE}-{k}"));
            if strange_entry(&aside).is_none() {
                let _ = fs::remove_dir_all(aside);
            }
        }
        None
    }

    /// Whether an earlier run was moved aside.
    pub fn replaces(&self) -> bool {
        !self.aside.is_empty()
    }
}

impl Drop for RunFolder {
    /// Removes the files of a run that did not begin, and puts back those of the earlier one. Errors
    /// are ignored: the error that is being reported matters more.
    fn drop(&mut self) {
        if !self.fresh {
            return;
        }
        for file in self.files() {
            let _ = fs::remove_file(self.path.join(file));
        }
        let aside = self.replaces();
        self.aside.put_back();
        if aside {
            for k in 1..MOST_ASIDE {
                // Only an empty folder is removed.
                let _ = fs::remove_dir(self.path.join(format!("{ASIDE}-{k}")));
            }
        }
        if self.made {
            self.lock.release();
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// Whether a file or folder with this name, in the folder of a run, was made by this program.
fn is_ours(name: &str) -> bool {
    FILES.contains(&name)
        || name == NOTE
        || name == checkpoint::FOLDER
        || name == lock::LOCK
        || name.starts_with(ASIDE)
        || name.ends_with(".part")
}

/// A file or folder in a folder that this program did not make; `None` if there is none.
pub fn strange_entry(folder: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut strange = entries.filter(|e| !e.file_name().to_str().is_some_and(is_ours));
    strange.next().map(|e| e.path())
}

/// Kind of a file of a run.
fn kind(name: &str) -> Kind<'static> {
    match name.rsplit('.').next() {
        Some("rrd") => Kind::Recording,
        Some("csv") => Kind::Table("step,time"),
        Some("json") => Kind::Json("state_hash"),
        Some("svg") => Kind::Svg,
        Some("png") => Kind::Png,
        // The scene is checked separately.
        _ => Kind::Checked,
    }
}

/// Whether a scene file has no comments, as those that runs write.
fn is_bare(scene: &Path) -> bool {
    fs::read_to_string(scene).is_ok_and(|text| !text.lines().any(has_comment))
}

/// Whether a line of TOML has a comment: a `#` outside of strings, such as those of colours.
fn has_comment(line: &str) -> bool {
    let mut quote = None;
    let mut escaped = false;
    for c in line.chars() {
        match (quote, c) {
            (None, '#') => return true,
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), _) if c == q && !escaped => quote = None,
            _ => {}
        }
        escaped = quote == Some('"') && c == '\\' && !escaped;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempFolder;

    #[test]
    fn comments_are_told_from_colours() {
        for line in ["colour = \"#e69f00\"", "name = 'a # b'", "a = \"\\\"#\"", ""] {
            assert!(!has_comment(line), "{line}");
        }
        for line in ["# note", "colour = \"#e69f00\" # orange", "a = 1 # b"] {
            assert!(has_comment(line), "{line}");
        }
    }

    #[test]
    fn a_folder_has_one_writer() {
        let here = TempFolder::new().expect("a folder");
        let threads: Vec<_> = (0..8)
            .map(|_| {
                let parent = here.path().to_owned();
                std::thread::spawn(move || {
                    let folder = create_below(&parent, "silo").expect("a folder");
                    fs::write(folder.path().join("series.csv"), "step,time\n").expect("written");
                    std::thread::sleep(std::time::Duration::from_millis(20));
                    let mut folder = folder;
                    folder.settle(true);
                    folder.path().to_owned()
                })
            })
            .collect();
        let mut paths: Vec<_> = threads.into_iter().map(|t| t.join().expect("no panic")).collect();
        paths.sort();
        paths.dedup();
        assert_eq!(paths.len(), 8);
        let names = fs::read_dir(here.path().join("silo")).expect("there").count();
        assert_eq!(names, 1, "the lock is removed");
        let held = RunFolder::claim(&paths[0]).expect("free");
        let error = RunFolder::claim(&paths[0]).expect_err("in use").to_string();
        assert!(error.contains(&format!("process {}", std::process::id())), "{error}");
        drop(held);
        assert!(RunFolder::claim(&paths[0]).is_ok());
    }

    #[test]
    fn an_earlier_run_comes_back_if_the_new_one_does_not_begin() {
        let here = TempFolder::new().expect("a folder");
        let at = |name: &str| here.path().join(name);
        let fill = |text: &str| {
            for name in FILES {
                let content = match kind(name) {
                    Kind::Recording => format!("RRF2{text}"),
                    Kind::Json(_) => format!("{{\"state_hash\": \"{text}\"}}"),
                    Kind::Svg => format!("<svg>{text}"),
                    Kind::Png => format!("\u{89}PNG{text}"),
                    _ if name == SCENE => format!("name = \"{text}\""),
                    _ => format!("step,time\n{text}"),
                };
                let bytes: Vec<u8> = match kind(name) {
                    Kind::Png => [b"\x89PNG", text.as_bytes()].concat(),
                    _ => content.into_bytes(),
                };
                fs::write(at(name), bytes).expect("written");
            }
        };
        let holds = |text: &str| {
            FILES.iter().all(|name| {
                String::from_utf8_lossy(&fs::read(at(name)).unwrap_or_default()).contains(text)
            })
        };
        fill("old");
        let folder = create("x", Some(here.path()), true, None).expect("replaced");
        assert!(FILES.iter().all(|name| !at(name).exists()));
        fill("new");
        drop(folder);
        assert!(holds("old"));
        let mut folder = create("x", Some(here.path()), true, None).expect("replaced");
        fill("new");
        folder.settle(true);
        drop(folder);
        assert!(holds("new"));
        assert_eq!(fs::read_dir(here.path()).expect("there").count(), FILES.len());
        // Files of the user are left as they are.
        for (name, text) in [
            ("recording.rrd", "notes"),
            ("series.csv", "a,b\n"),
            ("summary.json", "{}"),
            (SCENE, "# mine\nname = \"x\""),
        ] {
            fill("new");
            fs::write(at(name), text).expect("written");
            let refused = create("x", Some(here.path()), true, None).expect_err("foreign");
            assert!(refused.to_string().contains(name), "{refused}");
            assert_eq!(fs::read_to_string(at(name)).expect("there"), text);
        }
        fill("new");
        let loaded = |unchanged| Some(Loaded { path: Box::leak(Box::new(at(SCENE))), unchanged });
        let refused = create("x", Some(here.path()), true, loaded(false));
        assert!(matches!(refused, Err(FolderError::OwnScene(_))));
        let kept = create("x", Some(here.path()), true, loaded(true)).expect("replaced");
        assert!(kept.has_own_scene() && at(SCENE).exists() && !at("series.csv").exists());
    }
}
