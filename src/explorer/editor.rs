//! This module answers the scene editor of the page: it opens scenes, checks texts while they are
//! typed, moves what is dragged in the picture, and writes files.
//!
//! It works beside the session, so no answer waits for a step. Files are written only into the folder
//! of the command line, under names without separators, never through links, and only if they are as
//! the page has read them.

mod drag;

use super::draft::Draft;
use super::knobs;
use super::library::Library;
use super::problem::Problem;
use super::protocol::Answer;
use super::status::Status;
use crate::light::Description;
use crate::light::pack::{MOST_PARTICLES, pack};
use crate::plan::{self, Plan, memory};
use crate::record::info::run_info;
use crate::record::replace;
use crate::scene::{SceneSource, content_hash, is_folder_name};
use crate::sim::snapshot;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use drag::Handle;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Largest text of a scene that the page may send (bytes, as JSON).
pub const MAX_SCENE: usize = 256 * 1024;
/// Texts whose initial state would have more particles get no picture of their particles.
const MOST_SEEDED: usize = 2_000_000;

/// A request of the editor.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Edit {
    /// Check a text, and describe what it makes.
    Check {
        /// Name of the file, for messages.
        name: String,
        /// The text.
        text: String,
    },
    /// Move a wall, gauge, block, region or the domain in a text.
    Drag {
        /// The text.
        text: String,
        /// What is moved.
        handle: drag::Place,
    },
    /// Write a text to a file of the folder.
    Write {
        /// Name of the file, with `.toml`.
        name: String,
        /// The text.
        text: String,
        /// Version of the file that the page has read; `None` for a new file.
        version: Option<String>,
    },
}

/// An opened scene.
#[derive(Debug, Serialize)]
pub struct Opened {
    /// Name of the preset or file.
    name: String,
    text: String,
    /// Version of the file; `None` if it is not a file of the folder.
    version: Option<String>,
}

/// The answer to a request.
#[derive(Debug, Default, Serialize)]
pub struct Edited {
    /// Whether the request was accepted, and why or what was done.
    #[serde(skip_serializing_if = "Option::is_none")]
    answer: Option<Answer>,
    /// The text after a drag.
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<String>,
    /// Version of a written file.
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<String>,
    /// Errors of a checked text.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<Problem>,
    /// What a checked text without errors makes.
    #[serde(skip_serializing_if = "Option::is_none")]
    draft: Option<Made>,
}

impl From<Answer> for Edited {
    fn from(answer: Answer) -> Edited {
        Edited { answer: Some(answer), ..Edited::default() }
    }
}

/// What a text makes.
#[derive(Debug, Serialize)]
struct Made {
    description: Description,
    /// Packed picture of the initial state, in base 64.
    frame: String,
    handles: Vec<Handle>,
    cells: [usize; 2],
    unknowns: usize,
    /// Expected step time (s), from that of the run; `None` if it is unknown.
    seconds_per_step: Option<f64>,
    effects: Vec<plan::Effect>,
    warnings: Vec<String>,
}

/// The scenes that a page edits.
pub struct Desk {
    folder: PathBuf,
    library: Mutex<Library>,
}

impl Desk {
    /// A desk for the scenes of a folder and the scene of the command line.
    pub fn new(folder: PathBuf, given: &SceneSource, from_file: bool) -> Desk {
        let mut library = Library::new(folder.clone());
        library.give(given, from_file);
        Desk { folder, library: Mutex::new(library) }
    }

    /// Reads a scene of the library.
    pub fn open(&self, id: &str) -> Option<Opened> {
        let library = self.library.lock().unwrap_or_else(PoisonError::into_inner);
        let source = library.find(id).ok()?;
        let name = id.split_once(':').map_or(id, |p| p.1);
        let version = id.strip_prefix("file:").map(|_| content_hash(source.text()));
        Some(Opened { name: name.into(), text: source.text().into(), version })
    }

    /// Answers a request.
    pub fn obey(&self, edit: Edit, status: &Status) -> Edited {
        match edit {
            Edit::Check { name, text } => check(&SceneSource::new(name, text), status),
            Edit::Drag { text, handle } => match drag::moved(&text, &handle) {
                Ok((text, said)) => Edited { text: Some(text), ..Answer::yes(said).into() },
                Err(refusal) => refusal.into(),
            },
            Edit::Write { name, text, version } => {
                match self.write(&name, &text, version.as_deref()) {
                    Ok(version) => {
                        let said = format!("saved {}", self.folder.join(&name).display());
                        Edited { version: Some(version), ..Answer::yes(said).into() }
                    }
                    Err(refusal) => refusal.into(),
                }
            }
        }
    }

    /// Writes a file if it is as the page has read it; returns its version.
    fn write(&self, name: &str, text: &str, known: Option<&str>) -> Result<String, Answer> {
        let stem = name.strip_suffix(".toml").unwrap_or_default();
        if !is_folder_name(stem) {
            return Err(Answer::no(
                format!("`{name}` is not a name for a scene"),
                "use letters, digits, - and _, and end it with .toml: my_silo.toml",
            ));
        }
        let path = self.folder.join(name);
        match std::fs::symlink_metadata(&path) {
            Ok(about) if !about.is_file() => {
                return Err(Answer::no(
                    format!("{} is a link or a folder: it is left as it is", path.display()),
                    "choose another name",
                ));
            }
            Ok(_) => self.unchanged(&path, known)?,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(Answer::no(format!("{}: {e}", path.display()), "")),
        }
        // The file was checked above; between check and writing it is not locked.
        replace::write(&path, text, replace::Kind::Checked)
            .map_err(|e| Answer::no(e.to_string(), "choose another folder with --dir"))?;
        Ok(content_hash(text))
    }

    /// Refuses to overwrite a file that differs from what the page has read.
    fn unchanged(&self, path: &Path, known: Option<&str>) -> Result<(), Answer> {
        let Some(known) = known else {
            return Err(Answer::no(
                format!("there is a file {} already", path.display()),
                "choose another name, or open that file first",
            ));
        };
        let now = std::fs::read(path)
            .map_err(|e| Answer::no(format!("{} cannot be read: {e}", path.display()), ""))?;
        match content_hash(&now) == known {
            true => Ok(()),
            false => Err(Answer::no(
                format!("{} was changed by another program since it was opened", path.display()),
                "save under another name, or open the file again",
            )),
        }
    }
}

/// Checks a text: its errors, or what it makes.
fn check(source: &SceneSource, status: &Status) -> Edited {
    let problem = match Draft::new(source.clone()).plan() {
        Err(e) => Problem::of_scene(source.name(), &e, source),
        Ok(plan) => match made(&plan, status) {
            Ok(made) => return Edited { draft: Some(made), ..Edited::default() },
            Err(cause) => Problem::of_machine(cause),
        },
    };
    Edited { problem: Some(problem), ..Edited::default() }
}

fn made(plan: &Plan, status: &Status) -> Result<Made, String> {
    memory::afford(plan).map_err(|e| e.to_string())?;
    let info = run_info(plan, &plan.scene.name);
    let seeded = plan.mesh.cells() * plan.method.seeding.side.pow(2);
    let picture = match seeded <= MOST_SEEDED {
        true => snapshot::initial(plan).map_err(|e| e.to_string())?,
        false => crate::frame::Snapshot::default(),
    };
    let unknowns = knobs::unknowns(plan);
    Ok(Made {
        description: Description::new(&info),
        frame: BASE64.encode(pack(&picture, &info, MOST_PARTICLES)),
        handles: drag::handles(&plan.scene),
        cells: [plan.mesh.x.cells(), plan.mesh.y.cells()],
        unknowns,
        seconds_per_step: status.expected_step(unknowns),
        effects: plan.describe().effects,
        warnings: plan.warnings.iter().map(ToString::to_string).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use crate::testing::TempFolder;

    fn desk(folder: &Path) -> Desk {
        Desk::new(folder.to_owned(), &scene::presets::find("silo").expect("a preset"), false)
    }

    #[test]
    fn only_unchanged_files_of_the_folder_are_written() {
        let folder = TempFolder::new().expect("a folder");
        let inside = folder.path().join("inside");
        std::fs::create_dir(&inside).expect("a folder");
        let desk = desk(&inside);
        let first = desk.write("mine.toml", "a = 1", None).expect("a new file");
        assert!(desk.write("mine.toml", "a = 2", None).is_err());
        let second = desk.write("mine.toml", "a = 2", Some(&first)).expect("its own file");
        std::fs::write(inside.join("mine.toml"), "a = 3").expect("written");
        assert!(desk.write("mine.toml", "a = 4", Some(&second)).is_err());
        assert_eq!(std::fs::read_to_string(inside.join("mine.toml")).expect("a file"), "a = 3");
        for name in ["../x.toml", "a/b.toml", "/tmp/x.toml", ".toml", "x", "..", "a\\b.toml", ""] {
            assert!(desk.write(name, "", None).is_err(), "{name}");
        }
        #[cfg(unix)]
        {
            let outside = folder.path().join("secret.toml");
            std::fs::write(&outside, "kept").expect("written");
            std::os::unix::fs::symlink("../secret.toml", inside.join("link.toml")).expect("a link");
            let known = content_hash(b"kept");
            assert!(desk.write("link.toml", "lost", Some(&known)).is_err());
            assert_eq!(std::fs::read_to_string(&outside).expect("a file"), "kept");
        }
    }

    #[test]
    fn a_text_gets_its_errors_or_its_picture() {
        let status = Status::new(String::new());
        let silo = scene::presets::find("silo").expect("a preset");
        let good = check(&silo.with_sets(&["accuracy.cells=2".into()]).expect("set"), &status);
        let draft = good.draft.expect("no errors");
        assert!(draft.unknowns > 1000 && !draft.frame.is_empty());
        assert!(draft.handles.iter().any(|h| h.name == "outflow"));
        let bad = SceneSource::new("x.toml", silo.text().replace("gravity", "gravty"));
        let problem = check(&bad, &status).problem.expect("an error");
        assert!(problem.faults[0].line.is_some());
    }
}
