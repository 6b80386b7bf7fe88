//! This module finds tables of a scene that are written as lists of tables, `[[time]]` instead of
//! `[time]`: serde would read the list as the values of the table in the order of its keys.

use super::SceneError;
use serde_json::Value;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Errors of the tables in `root` that are written as lists. `schema`: the JSON schema of scenes.
pub fn tables_as_lists(text: &str, root: &DeTable, schema: &Value) -> Vec<SceneError> {
    let mut finder = Finder { text, schema, errors: vec![] };
    finder.search_table(root, schema, "");
    finder.errors
}

/// What a part of the JSON schema `schema` refers to; `None` if it is no reference.
pub fn referred<'a>(schema: &'a Value, part: &Value) -> Option<&'a Value> {
    schema.pointer(part["$ref"].as_str()?.strip_prefix('#')?)
}

struct Finder<'a> {
    text: &'a str,
    schema: &'a Value,
    errors: Vec<SceneError>,
}

impl<'a> Finder<'a> {
    fn search_table(&mut self, table: &DeTable, schema: &'a Value, path: &str) {
        for (key, value) in table {
            let key = key.get_ref();
            let found = self.forms(schema).into_iter().find_map(|form| {
                form["properties"]
                    .get(key.as_ref())
                    .or_else(|| form.get("additionalProperties").filter(|s| s.is_object()))
            });
            if let Some(found) = found {
                let dot = if path.is_empty() { "" } else { "." };
                self.search(value, found, &format!("{path}{dot}{key}"));
            }
        }
    }

    fn search(&mut self, value: &Spanned<DeValue>, schema: &'a Value, path: &str) {
        match value.get_ref() {
            DeValue::Table(table) => self.search_table(table, schema, path),
            DeValue::Array(list) => {
                let forms = self.forms(schema);
                let has = |kind: &str| forms.iter().find(|form| form["type"] == kind);
                if let Some(items) = has("array").map(|form| &form["items"]) {
                    list.iter().for_each(|value| self.search(value, items, path));
                } else if let Some(form) = has("object") {
                    let first = list.first().map_or(value.span(), Spanned::span);
                    let header = self.text.get(first.clone()).is_some_and(|t| t.starts_with("[["));
                    let at = if header { first } else { value.span() };
                    let named = form.get("additionalProperties").is_some_and(Value::is_object);
                    let remedy = match (header, named) {
                        (true, true) => format!("write `[{path}.NAME]` instead of `[[{path}]]`"),
                        (true, false) => format!("write `[{path}]` instead of `[[{path}]]`"),
                        (false, _) => "write { ... } instead of [...]".to_owned(),
                    };
                    let message = format!("a list in `{path}`");
                    let help = format!("expected a table: {remedy}");
                    let error = SceneError::at(&at, message, help);
                    self.errors.push(error.with_label("this list"));
                }
            }
            _ => (),
        }
    }

    /// The forms that a value may have: the schema itself, or the alternatives that it lists.
    fn forms(&self, schema: &'a Value) -> Vec<&'a Value> {
        let schema = referred(self.schema, schema).unwrap_or(schema);
        let listed = ["anyOf", "oneOf"].into_iter().filter_map(|k| schema[k].as_array()).flatten();
        let mut forms: Vec<_> = listed.flat_map(|s| self.forms(s)).collect();
        forms.push(schema);
        forms
    }
}
