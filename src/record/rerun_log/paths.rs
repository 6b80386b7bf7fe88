//! This module names the entities of a run.

use super::RUNS;
use rerun::{EntityPath, EntityPathPart};

/// Entity paths of one run.
pub(super) struct Paths {
    pub(super) root: EntityPath,
}

impl Paths {
    pub(super) fn new(name: &str) -> Self {
        Self::below(RUNS, name)
    }

    pub(super) fn below(folder: &str, name: &str) -> Self {
        let parts = [folder, name].map(|part| EntityPathPart::new(part.to_owned()));
        Self { root: EntityPath::new(parts.to_vec()) }
    }

    /// The entity at a path below the run; parts are separated by slashes.
    pub(super) fn at(&self, path: &str) -> EntityPath {
        let parts = path.split('/').filter(|part| !part.is_empty());
        let parts = parts.map(|part| EntityPathPart::new(part.to_owned()));
        self.root.join(&EntityPath::new(parts.collect()))
    }

    pub(super) fn field(&self, name: &str) -> EntityPath {
        let part = EntityPathPart::new(name.to_owned());
        self.at("world/fields").join(&EntityPath::new(vec![part]))
    }

    pub(super) fn curve(&self, path: &str, log10: bool) -> EntityPath {
        if log10 { self.at(&format!("{path}/log10")) } else { self.at(path) }
    }
}
