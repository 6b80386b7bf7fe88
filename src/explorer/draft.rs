//! This module combines the text of a scene with the values set on the page.

use crate::plan::{self, Plan};
use crate::scene::{self, Quantity, SceneError, SceneSource};
use indexmap::IndexMap;

/// Maximum length of a key (bytes).
const MAX_KEY: usize = 200;
/// Maximum length of a value (bytes).
const MAX_VALUE: usize = 2000;

/// The text of a scene and the values set by its knobs.
#[derive(Clone)]
pub struct Draft {
    source: SceneSource,
    values: IndexMap<String, String>,
}

impl Draft {
    /// A scene without changes.
    pub fn new(source: SceneSource) -> Draft {
        Draft { source, values: IndexMap::new() }
    }

    /// The draft with `key` set to `value`.
    pub fn with(&self, key: &str, value: &str) -> Result<Draft, SceneError> {
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || key.len() > MAX_KEY || key.contains(['=', '\n', '\r']) {
            return Err(SceneError::new(
                "this is not a key of a scene",
                "give a key such as alpha",
            ));
        }
        if value.is_empty() || value.len() > MAX_VALUE {
            return Err(SceneError::new(
                format!("there is no value for `{key}`, or it is too long"),
                "give a number such as 0.5, or an expression such as 5/3",
            ));
        }
        let mut draft = self.clone();
        draft.values.insert(key.into(), value.into());
        Ok(draft)
    }

    /// The text of the scene with the values set.
    pub fn source(&self) -> Result<SceneSource, SceneError> {
        let sets: Vec<String> = self.values.iter().map(|(k, v)| format!("{k}={v}")).collect();
        self.source.with_sets(&sets)
    }

    /// Resolves the plan of the scene with the values set.
    pub fn plan(&self) -> Result<Plan, SceneError> {
        let source = self.source()?;
        plan::resolve(&scene::parse(&source)?).map_err(|e| e.with_source(&source))
    }

    /// The first six values that are set, in one line.
    pub fn summary(&self) -> String {
        let list: Vec<String> =
            self.values.iter().map(|(k, v)| format!("{k} = {v}")).take(6).collect();
        list.join(", ")
    }
}

/// Parses a value of a scene: a number, or else an expression.
pub fn quantity(value: &str) -> Quantity {
    match value.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Quantity::number(number),
        _ => Quantity::expression(value.trim()),
    }
}
