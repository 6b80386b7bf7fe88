//! This module lists the differences between resolved scenes.

use super::Member;
use indexmap::IndexMap;
use serde::Serialize;

/// A key whose value differs between scenes.
#[derive(Clone, Debug, Serialize)]
pub struct Change {
    /// Full path of the key, such as `materials.grains.density`.
    pub key: String,
    /// Value in each scene, as TOML; `None` where the scene lacks the key or is unknown.
    pub values: Vec<Option<String>>,
}

/// Keys whose values differ between the known scenes, in the order of the first scene that has
/// them.
pub fn changes(members: &[Member]) -> Vec<Change> {
    let flat: Vec<Option<IndexMap<String, String>>> = members
        .iter()
        .map(|m| Some(flatten(&m.scene_toml.as_ref()?.parse::<toml::Table>().ok()?)))
        .collect();
    let mut keys: Vec<&String> = vec![];
    for key in flat.iter().flatten().flat_map(IndexMap::keys) {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    keys.into_iter()
        .filter_map(|key| {
            let values: Vec<Option<String>> =
                flat.iter().map(|flat| value(flat.as_ref()?, key)).collect();
            let mut known = flat.iter().zip(&values).filter(|(f, _)| f.is_some()).map(|(_, v)| v);
            let first = known.next()?;
            known.any(|v| v != first).then_some(Change { key: key.clone(), values })
        })
        .collect()
}

/// The value of a key. A parameter that is not set has its default value.
fn value(flat: &IndexMap<String, String>, key: &str) -> Option<String> {
    let default = || {
        let parameter = key.strip_prefix("parameters.")?.strip_suffix(".value")?;
        flat.get(&format!("parameters.{parameter}.default"))
    };
    flat.get(key).or_else(default).cloned()
}

/// All values of a table by their full paths.
fn flatten(table: &toml::Table) -> IndexMap<String, String> {
    fn walk(path: String, value: &toml::Value, out: &mut IndexMap<String, String>) {
        let below =
            |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        match value {
            toml::Value::Table(table) => {
                table.iter().for_each(|(key, value)| walk(below(key), value, out));
            }
            toml::Value::Array(list) if list.iter().any(toml::Value::is_table) => {
                for (i, value) in list.iter().enumerate() {
                    walk(format!("{path}[{i}]"), value, out);
                }
            }
            toml::Value::String(text) => _ = out.insert(path, text.clone()),
            other => _ = out.insert(path, other.to_string()),
        }
    }
    let mut out = IndexMap::new();
    walk(String::new(), &toml::Value::Table(table.clone()), &mut out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_flattened() {
        let table: toml::Table =
            "a = 1\n[b]\nc = \"x/2\"\n[[d]]\nx = [0, 1]\n[[d]]\nx = 3".parse().expect("TOML");
        let flat = flatten(&table);
        let pairs: Vec<_> = flat.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
        assert_eq!(pairs, [("a", "1"), ("b.c", "x/2"), ("d[0].x", "[0, 1]"), ("d[1].x", "3")]);
    }

    #[test]
    fn an_unset_parameter_has_its_default() {
        let flat = flatten(&"[parameters.alpha]\ndefault = \"1/3\"".parse().expect("TOML"));
        assert_eq!(value(&flat, "parameters.alpha.value").as_deref(), Some("1/3"));
        assert_eq!(value(&flat, "parameters.beta.value"), None);
    }
}
