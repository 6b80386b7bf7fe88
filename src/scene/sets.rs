//! This module implements `--set`, which changes single values in the text of a scene and leaves
//! the rest of the text unchanged.

use std::ops::Range;

use toml_edit::{Document, DocumentMut, InlineTable, Item, Table, Value};

use super::error::{SceneError, suggestion};
use super::load::table;
use super::source::SceneSource;
use crate::words::count;

/// The keys of a scene with which a path may start.
const KEYS: [&str; 26] = [
    "schema",
    "name",
    "description",
    "gravity",
    "inertia",
    "initial_velocity",
    "parameters",
    "domain",
    "mesh",
    "accuracy",
    "time",
    "materials",
    "background",
    "regions",
    "boundaries",
    "walls",
    "blocks",
    "sources",
    "pressure_reference",
    "body_force",
    "acceleration",
    "gauges",
    "dye",
    "interest",
    "recording",
    "schedule",
];

/// Largest number of keys in a path; the format has fewer levels.
const MAX_STEPS: usize = 12;

/// One part of a path such as `walls[1].kind`.
#[derive(Debug, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

impl SceneSource {
    /// The scene with `name=value` or `path.to.key=value` applied in order.
    ///
    /// A name without dots is a parameter, whose `value` is set. The value is read as TOML if it is
    /// valid TOML (number, boolean, array, quoted string, inline table), otherwise as a string: an
    /// expression or the name of a choice. The comments and the order of the text are kept.
    pub fn with_sets(&self, sets: &[String]) -> Result<SceneSource, SceneError> {
        if sets.is_empty() {
            return Ok(self.clone());
        }
        let mut document: DocumentMut =
            self.text().parse().map_err(|e: toml_edit::TomlError| {
                let plain = || SceneError::at(&e.span(), e.message(), "").with_source(self);
                table(self).err().unwrap_or_else(plain)
            })?;
        let mut source = self.clone();
        let mut errors = vec![];
        for set in sets {
            match apply(document.as_item_mut(), set) {
                Ok(steps) => {
                    let text = document.to_string();
                    let value = span_of(&text, &steps);
                    source = source.after_set(set, text, value);
                }
                Err((message, help)) => {
                    errors.push(SceneError::new(format!("--set {set}: {message}"), help));
                }
            }
        }
        SceneError::join(errors)?;
        Ok(source)
    }
}

/// Message and help.
type Fault = (String, String);

fn fault<T>(message: impl Into<String>, help: impl Into<String>) -> Result<T, Fault> {
    Err((message.into(), help.into()))
}

/// Byte range of the key and value at a path.
fn span_of(text: &str, steps: &[Step]) -> Option<Range<usize>> {
    let document = Document::parse(text).ok()?;
    let mut item = document.as_item();
    let mut key = None;
    for step in steps {
        (key, item) = match step {
            Step::Key(name) => {
                let (key, inner) = item.as_table_like()?.get_key_value(name)?;
                (key.span(), inner)
            }
            Step::Index(index) => (None, item.get(*index)?),
        };
    }
    let value = item.span()?;
    Some(key.map_or(value.start, |key| key.start.min(value.start))..value.end)
}

/// Applies an argument and returns the path of the value that it has set.
fn apply(root: &mut Item, set: &str) -> Result<Vec<Step>, Fault> {
    const FORMS: &str = "write name=value or path.to.key=value, such as alpha=0.5, gravity[1]=-5 \
                         or walls[0].kind=no_slip";
    let Some((path, value)) = set.split_once('=') else {
        return fault("there is no `=`", FORMS);
    };
    let value = value.trim();
    if value.is_empty() {
        return fault("there is no value after `=`", FORMS);
    }
    let Some(mut steps) = read_path(path.trim()) else {
        return fault(format!("`{path}` is not a path"), FORMS);
    };
    let parameters = names(root, "parameters");
    if let [Step::Key(name)] = steps.as_slice() {
        if parameters.contains(name) {
            let value = Step::Key("value".into());
            steps = vec![Step::Key("parameters".into()), Step::Key(name.clone()), value];
        } else if !KEYS.contains(&name.as_str()) {
            let known: Vec<_> = parameters.iter().map(String::as_str).collect();
            let help = suggestion(name, "parameters are", &known);
            return fault(format!("there is no parameter `{name}`"), help);
        }
    }
    if let [Step::Key(first), ..] = steps.as_slice()
        && !KEYS.contains(&first.as_str())
    {
        let help = suggestion(first, "a path starts with", &KEYS);
        return fault(format!("a scene has no key `{first}`"), help);
    }
    if let [Step::Key(map), Step::Key(name), ..] = steps.as_slice()
        && ["parameters", "materials"].contains(&map.as_str())
    {
        let known = names(root, map);
        if !known.contains(name) {
            let known: Vec<_> = known.iter().map(String::as_str).collect();
            let help = suggestion(name, &format!("{map} are"), &known);
            return fault(format!("there is no `{name}` in {map}"), help);
        }
    }
    if let [Step::Key(gravity), Step::Index(_)] = steps.as_slice()
        && gravity == "gravity"
        && let Some(root) = root.as_table_like_mut()
        && !root.contains_key("gravity")
    {
        root.insert("gravity", Item::Value([0.0, 0.0].into_iter().collect()));
    }
    write(root, &steps, value)?;
    Ok(steps)
}

/// The keys of a table of the scene.
fn names(root: &Item, table: &str) -> Vec<String> {
    let table = root.get(table).and_then(Item::as_table_like);
    table.map(|t| t.iter().map(|(name, _)| name.to_owned()).collect()).unwrap_or_default()
}

/// Follows the path, creates missing tables, and writes the value.
fn write(root: &mut Item, steps: &[Step], text: &str) -> Result<(), Fault> {
    let mut item = root;
    let mut walked = String::new();
    for (i, step) in steps.iter().enumerate() {
        let kind = item.type_name();
        let last = i + 1 == steps.len();
        match step {
            Step::Key(key) => {
                let inline = item.is_inline_table();
                let Some(table) = item.as_table_like_mut() else {
                    let help = format!("`{key}` cannot be set in it");
                    return fault(format!("`{walked}` is not a table but: {kind}"), help);
                };
                if last && !table.contains_key(key) {
                    table.insert(key, Item::Value(read_value(text)));
                    return Ok(());
                }
                if !table.contains_key(key) {
                    if let Some(Step::Index(_)) = steps.get(i + 1) {
                        let help = "add it to the scene, or set the whole list";
                        return fault(format!("the scene has no list `{key}`"), help);
                    }
                    let new = if inline {
                        Item::Value(InlineTable::new().into())
                    } else {
                        Item::Table(Table::new())
                    };
                    table.insert(key, new);
                }
                walked.push_str(if i > 0 { "." } else { "" });
                walked.push_str(key);
            }
            Step::Index(_) if !item.is_array() && !item.is_array_of_tables() => {
                return fault(format!("`{walked}` is not a list but: {kind}"), "leave out `[...]`");
            }
            Step::Index(index) => walked.push_str(&format!("[{index}]")),
        }
        let length = item.as_array().map(|a| a.len());
        let length = length.or(item.as_array_of_tables().map(|a| a.len())).unwrap_or(0);
        let next = match step {
            Step::Key(key) => item.get_mut(key.as_str()),
            Step::Index(index) => item.get_mut(*index),
        };
        let Some(next) = next else {
            let help = format!("it has {}, counted from 0", count(length, "element"));
            return fault(format!("there is no `{walked}`"), help);
        };
        item = next;
    }
    match item.as_value_mut() {
        Some(old) => {
            let mut new = read_value(text);
            *new.decor_mut() = old.decor().clone();
            *old = new;
            Ok(())
        }
        None => fault(format!("`{walked}` is a table"), "name one of the keys in it"),
    }
}

/// The text as a TOML value if it is valid TOML (but no date or time), otherwise as a string.
fn read_value(text: &str) -> Value {
    match text.parse::<Value>() {
        Ok(mut value) if !value.is_datetime() => {
            value.decor_mut().clear();
            value
        }
        _ => text.into(),
    }
}

/// Reads a path: keys joined by dots, each with any number of indices; keys may be quoted.
fn read_path(path: &str) -> Option<Vec<Step>> {
    let mut steps = vec![];
    let mut rest = path;
    loop {
        let key = if let Some(quoted) = rest.strip_prefix('"') {
            let (key, after) = quoted.split_once('"')?;
            rest = after;
            key
        } else {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            let (key, after) = rest.split_at(rest.find(|c| !plain(c)).unwrap_or(rest.len()));
            rest = after;
            key
        };
        if key.is_empty() {
            return None;
        }
        if steps.len() >= MAX_STEPS {
            return None;
        }
        steps.push(Step::Key(key.into()));
        while let Some(index) = rest.strip_prefix('[') {
            let (index, after) = index.split_once(']')?;
            steps.push(Step::Index(index.trim().parse().ok()?));
            rest = after;
        }
        match rest.strip_prefix('.') {
            Some(after) => rest = after,
            None if rest.is_empty() => return Some(steps),
            None => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scope, parse, presets};

    fn set(sets: &[&str]) -> Result<SceneSource, SceneError> {
        let sets: Vec<_> = sets.iter().map(|s| (*s).to_owned()).collect();
        presets::find("silo").expect("listed").with_sets(&sets)
    }

    #[test]
    fn sets_parameters() {
        let scene = parse(&set(&["alpha=0.5", "contrast = 2*50"]).expect("valid")).expect("valid");
        let scope = Scope::new(&scene).expect("valid");
        assert_eq!(scope.get("alpha"), Some(0.5));
        assert_eq!(scope.get("contrast"), Some(100.0));
    }

    #[test]
    fn keeps_the_rest_of_the_text() {
        let before = presets::find("silo").expect("listed");
        let after = set(&["alpha=5/3"]).expect("valid");
        let new: Vec<_> = after.text().lines().filter(|l| !before.text().contains(l)).collect();
        assert_eq!(new, ["value = \"5/3\""]);
        assert_eq!(after.text().lines().count(), before.text().lines().count() + 1);
        assert_eq!(set(&["alpha=5/3", "alpha=1"]).ok(), set(&["alpha=1"]).ok());
        assert_eq!(set(&[]).ok(), Some(before));
    }

    #[test]
    fn sets_paths() {
        let sets = [
            "gravity[1]=-5",
            "regions[0].material=background",
            "walls[1].kind=no_slip",
            "accuracy.cells=16",
            "boundaries.left.kind=no_slip",
            "time.end=1e-3",
            "recording.times=[1e-4, \"2e-4\"]",
            "materials.grains.density=1e3 * (1 + x^2)",
            "regions[0].shape.rectangle.x[0]=-aperture",
            "description=\"another one\"",
            "parameters.alpha.max=200",
            "accuracy.placement=jittered",
            "mesh.lines_x=[0.25]",
        ];
        let scene = parse(&set(&sets).expect("valid")).expect("valid");
        let scope = Scope::new(&scene).expect("valid");
        assert_eq!(scene.gravity[1].eval(&scope).ok(), Some(-5.0));
        assert_eq!(scene.regions[0].material, "background");
        assert_eq!(scene.walls[1].kind, Some(crate::scene::WallKind::NoSlip));
        assert_eq!(scene.boundaries.left.kind, Some(crate::scene::BoundaryKind::NoSlip));
        assert_eq!(scene.accuracy.cells, 16);
        assert_eq!(scene.recording.times.len(), 2);
        assert_eq!(scene.description, "another one");
        let density = scene.materials["grains"].density.compile(&scope).expect("valid");
        assert_eq!(density.at(2.0, 0.0), 5e3);
        assert_eq!(scene.mesh.lines_x.len(), 1);
    }

    #[test]
    fn sets_a_part_of_gravity_that_is_not_given() {
        let source = SceneSource::new("s.toml", "schema = 1\n[time]\nend = 1\n");
        let text = source.with_sets(&["gravity[1]=-5".into()]).expect("valid");
        assert_eq!(text.text(), "schema = 1\ngravity = [0.0, -5]\n[time]\nend = 1\n");
    }

    #[test]
    fn says_what_is_wrong() {
        for (text, message, help) in [
            ("alhpa=1", "there is no parameter `alhpa`", "did you mean `alpha`? parameters are"),
            ("alpha", "there is no `=`", "name=value"),
            ("alpha=", "no value after `=`", "name=value"),
            ("=3", "is not a path", "name=value"),
            ("a..b=3", "is not a path", "name=value"),
            ("walls[x].kind=1", "is not a path", "name=value"),
            ("wals[0].kind=no_slip", "no key `wals`", "did you mean `walls`?"),
            ("walls[9].kind=no_slip", "there is no `walls[9]`", "it has 4 elements"),
            ("materials.grain.density=3", "no `grain` in materials", "did you mean `grains`?"),
            ("parameters.alhpa.value=3", "no `alhpa` in parameters", "did you mean `alpha`?"),
            ("accuracy.cells.x=3", "`accuracy.cells` is not a table but: integer", ""),
            ("name[0]=3", "`name` is not a list but: string", ""),
            ("domain=3", "`domain` is a table", "name one of the keys"),
            ("blocks[0].kind=no_slip", "no list `blocks`", "add it"),
        ] {
            let error = set(&[text]).expect_err(text);
            assert!(error.message().contains(message), "{text}: {}", error.one_line());
            assert!(error.message().starts_with(&format!("--set {text}")));
            assert!(error.remedy().is_none_or(|h| h.contains(help)), "{}", error.one_line());
        }
        assert_eq!(set(&["b=1", "c=1", "alpha=1"]).expect_err("two").lines().len(), 2);
        let outside = set(&["alpha=101"]).and_then(|s| {
            parse(&s).and_then(|scene| Scope::new(&scene).map_err(|e| e.with_source(&s)))
        });
        let said = outside.expect_err("outside its range").one_line();
        assert!(said.starts_with("--set alpha=101: parameter `alpha` is 101"), "{said}");
        let typo = set(&["accuracy.cels=3"]).and_then(|s| parse(&s)).expect_err("unknown");
        assert!(typo.one_line().contains("did you mean `cells`?"), "{}", typo.one_line());
        assert!(typo.one_line().starts_with("--set accuracy.cels=3: "), "{}", typo.one_line());
        // Other errors are at the lines of the file.
        let silo = presets::find("silo").expect("listed");
        let text = silo.text().replacen("cells = 6", "cells = -6", 1);
        let lines = |s: &SceneSource| parse(s).expect_err("negative").lines();
        let faulty = SceneSource::new("silo", text);
        let sets = ["alpha=0.5".to_string(), "mesh.growth=1.3".into()];
        assert_eq!(lines(&faulty.with_sets(&sets).expect("valid")), lines(&faulty));
    }

    #[test]
    fn keys_are_those_of_the_format() {
        let schema: serde_json::Value =
            serde_json::from_str(&crate::scene::json_schema()).expect("valid");
        let properties = schema["properties"].as_object().expect("an object");
        assert_eq!(properties.keys().map(String::as_str).collect::<Vec<_>>(), KEYS);
    }

    #[test]
    fn hostile_sets_never_panic() {
        let deep = format!("alpha={}", "[".repeat(100_000));
        let long = format!("{}=1", "a.".repeat(10_000) + "a");
        let boundary = format!("boundaries.{}=1", "a.".repeat(10_000) + "a");
        for text in
            [&*deep, &long, &boundary, "gravity[99999999999999999999]=1", "\"a=1", "gravity[-1]=1"]
        {
            if let Ok(source) = set(&[text]) {
                assert!(parse(&source).and_then(|scene| Scope::new(&scene)).is_err());
            }
        }
    }
}
