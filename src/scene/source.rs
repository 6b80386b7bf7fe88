//! The text of a scene and where it comes from.

use std::sync::Arc;

/// The text of a scene and the name of its source; cheap to clone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneSource {
    name: Arc<str>,
    text: Arc<str>,
}

impl SceneSource {
    /// A source with the given name and text.
    pub fn new(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Self {
        SceneSource { name: name.into(), text: text.into() }
    }

    /// The path of the file, or the name of the preset.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The TOML text.
    pub fn text(&self) -> &str {
        &self.text
    }
}
