//! This module lists the scenes that a page can open: presets, and the files of one folder.

use crate::scene::{self, SceneError, SceneSource, presets};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Maximum number of listed files.
const MAX_FILES: usize = 200;

/// A scene that a page can open.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Entry {
    /// Unique id, which pages send in commands.
    pub id: String,
    /// Name of the preset or the file.
    pub name: String,
    /// Description of the scene.
    pub description: String,
    /// Whether it is a preset.
    pub preset: bool,
}

/// The list of scenes. Pages send ids of entries, never paths.
pub struct Library {
    folder: PathBuf,
    /// The scene of the command line, if it is outside the folder.
    given: Option<PathBuf>,
    entries: Vec<Entry>,
}

impl Library {
    /// The presets and the scenes in `folder`. The list is empty until [`Library::look`].
    pub fn new(folder: PathBuf) -> Library {
        Library { folder, given: None, entries: vec![] }
    }

    /// Folder of the listed files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// All entries of the list.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Adds the scene of the command line; returns its id.
    pub fn give(&mut self, source: &SceneSource, from_file: bool) -> String {
        if !from_file {
            return preset_id(source.name());
        }
        let path = PathBuf::from(source.name());
        let inside = path.file_name().map(|name| self.folder.join(name));
        let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => false,
        };
        if let (Some(inside), Some(name)) = (inside, path.file_name())
            && same(&inside, &path)
        {
            return file_id(&name.to_string_lossy());
        }
        self.given = Some(path);
        given_id(source.name())
    }

    /// Reads the folder again.
    pub fn look(&mut self) {
        let presets = presets::list().into_iter().map(|(name, description)| Entry {
            id: preset_id(name),
            name: name.into(),
            description,
            preset: true,
        });
        let file = |id: String, path: &Path, name: String| {
            let source = scene::load(path).ok()?;
            // Not every TOML file is a scene. A scene with errors is listed too.
            let like_a_scene = ["schema", "[materials", "[domain"];
            if !like_a_scene.iter().any(|word| source.text().contains(word)) {
                return None;
            }
            let description = scene::parse(&source).map(|s| s.description).unwrap_or_default();
            Some(Entry { id, name, description, preset: false })
        };
        let given = self.given.iter().filter_map(|path| {
            let name = path.display().to_string();
            file(given_id(&name), path, name.clone())
        });
        let inside = files(&self.folder);
        let inside = inside
            .iter()
            .filter_map(|name| file(file_id(name), &self.folder.join(name), name.clone()));
        self.entries = presets.chain(given).chain(inside).collect();
    }

    /// Reads the text of a scene from its file.
    pub fn find(&self, id: &str) -> Result<SceneSource, SceneError> {
        let unknown = || {
            SceneError::new(
                "there is no such scene in the list",
                "pick one of the presets or of the files in the folder",
            )
        };
        if let Some(name) = id.strip_prefix("preset:") {
            return presets::find(name);
        }
        if let Some(path) = self.given.as_ref().filter(|p| given_id(&p.display().to_string()) == id)
        {
            return scene::load(path);
        }
        // The name must be one listed in the folder, so no file outside can be read.
        let name = files(&self.folder).into_iter().find(|name| file_id(name) == id);
        let name = name.ok_or_else(unknown)?;
        // Messages name the file as the user would.
        let here = self.folder == Path::new(".");
        scene::load(if here { PathBuf::from(name) } else { self.folder.join(name) })
    }
}

fn preset_id(name: &str) -> String {
    format!("preset:{name}")
}
fn file_id(name: &str) -> String {
    format!("file:{name}")
}
fn given_id(path: &str) -> String {
    format!("given:{path}")
}

/// Names of the TOML files of a folder, without links to files outside.
fn files(folder: &Path) -> Vec<String> {
    let Ok(home) = folder.canonicalize() else { return vec![] };
    let Ok(found) = std::fs::read_dir(folder) else { return vec![] };
    let mut names: Vec<String> = found
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_str()?.to_string();
            let inside = path.canonicalize().ok()?.parent()? == home;
            (inside && path.is_file() && name.ends_with(".toml")).then_some(name)
        })
        .collect();
    names.sort();
    names.truncate(MAX_FILES);
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempFolder;

    #[test]
    fn no_id_gives_access_outside_the_folder() {
        let folder = TempFolder::new().expect("a folder");
        let inside = folder.path().join("inside");
        std::fs::create_dir(&inside).expect("a folder");
        let scene = presets::find("solcx").expect("a preset");
        std::fs::write(folder.path().join("secret.toml"), scene.text()).expect("written");
        std::fs::write(inside.join("mine.toml"), scene.text()).expect("written");
        std::fs::write(inside.join("notes.toml"), "colour = 1").expect("written");
        #[cfg(unix)]
        std::os::unix::fs::symlink("../secret.toml", inside.join("link.toml")).expect("a link");
        let mut library = Library::new(inside);
        library.look();
        let own: Vec<_> = library.entries().iter().filter(|e| !e.preset).collect();
        assert_eq!(own.len(), 1, "{own:?}");
        assert!(library.find("file:mine.toml").is_ok());
        for id in [
            "file:../secret.toml",
            "file:link.toml",
            "file:/etc/passwd",
            "given:../secret.toml",
            "preset:../silo",
            "mine.toml",
            "",
        ] {
            assert!(library.find(id).is_err(), "{id}");
        }
    }
}
