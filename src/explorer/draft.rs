//! A scene and what the knobs say.

use crate::plan::{self, Plan};
use crate::scene::{self, Quantity, SceneError, SceneSource};
use indexmap::IndexMap;

/// Longest key and longest value that are read.
const MAX_KEY: usize = 200;
const MAX_VALUE: usize = 2000;

/// The text of a scene and the values of its knobs.
#[derive(Clone)]
pub struct Draft {
    source: SceneSource,
    values: IndexMap<String, String>,
}

impl Draft {
    pub fn new(source: SceneSource) -> Draft {
        Draft { source, values: IndexMap::new() }
    }

    /// With one knob turned.
    pub fn with(&self, key: &str, value: &str) -> Result<Draft, SceneError> {
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || key.len() > MAX_KEY || key.contains(['=', '\n', '\r']) {
            return Err(SceneError::new("this is not a key of a scene", "such as alpha"));
        }
        if value.is_empty() || value.len() > MAX_VALUE {
            return Err(SceneError::new(
                format!("there is no value for `{key}`, or too long a one"),
                "give a number such as 0.5, or an expression such as 5/3",
            ));
        }
        let mut draft = self.clone();
        draft.values.insert(key.into(), value.into());
        Ok(draft)
    }

    /// The text with the values in place.
    pub fn source(&self) -> Result<SceneSource, SceneError> {
        let sets: Vec<String> = self.values.iter().map(|(k, v)| format!("{k}={v}")).collect();
        self.source.with_sets(&sets)
    }

    pub fn plan(&self) -> Result<Plan, SceneError> {
        let source = self.source()?;
        plan::resolve(&scene::parse(&source)?).map_err(|e| e.with_source(&source))
    }

    /// What the knobs say, in a line; the first of them only where they are many.
    pub fn summary(&self) -> String {
        let list: Vec<String> =
            self.values.iter().map(|(k, v)| format!("{k} = {v}")).take(6).collect();
        list.join(", ")
    }
}

/// A value as a scene would have it: a number, or else an expression.
pub fn quantity(value: &str) -> Quantity {
    match value.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Quantity::number(number),
        _ => Quantity::expression(value.trim()),
    }
}
