//! This module reads the text of a scene into a [`Scene`] and writes a [`Scene`] as text.

use std::collections::HashSet;
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;
use std::sync::LazyLock;

use serde::Deserialize;
use sha2::{Digest, Sha256};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{MAX_ERRORS, SceneError, closest, suggestion};
use super::headers::tables_as_lists;
use super::source::SceneSource;
use super::types::Scene;
use crate::words::count;

/// The version of the scene format that this program reads.
pub const SCHEMA: u32 = 1;

/// Size of the largest scene file, bytes.
const MAX_BYTES: usize = 1 << 20;
/// Size of the largest text in which more than the first syntax error is searched for, bytes.
const MAX_RECOVER: usize = 1 << 16;

/// The JSON schema of scene files.
pub static JSON_SCHEMA: LazyLock<serde_json::Value> =
    LazyLock::new(|| schemars::schema_for!(Scene).to_value());

/// Reads a scene file without parsing it. Directories and files that are too large, empty or not
/// UTF-8 are refused.
pub fn load(path: impl AsRef<Path>) -> Result<SceneSource, SceneError> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let fault = |what: &str, help: &str| SceneError::new(format!("{name}: {what}"), help);
    let unreadable = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => fault(
            "there is no such file",
            "give the path of a scene file (TOML) or a preset's name",
        ),
        _ => fault(&format!("cannot be read: {e}"), "check the file and its permissions"),
    };
    if path.is_dir() {
        return Err(fault("is a directory", "give the path of a scene file (TOML) in it"));
    }
    let mut bytes = vec![];
    let file = File::open(path).map_err(unreadable)?;
    file.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() > MAX_BYTES {
        let help = "a scene is a TOML text of some kilobytes; is this another kind of file?";
        return Err(fault("is larger than 1 MiB, the most a scene may have", help));
    }
    let text = String::from_utf8(bytes).map_err(|e| {
        let at = e.utf8_error().valid_up_to();
        let line = 1 + e.as_bytes().iter().take(at).filter(|&&b| b == b'\n').count();
        let what = format!("is not UTF-8 text: byte {at}, in line {line}");
        fault(&what, "a scene is a TOML text; save it as UTF-8")
    })?;
    if text.trim().is_empty() {
        return Err(fault("is empty", "start from a preset, or with `schema = 1`"));
    }
    Ok(SceneSource::new(name, text))
}

/// Parses a scene; independent errors are reported together.
pub fn parse(source: &SceneSource) -> Result<Scene, SceneError> {
    read(source).map_err(|error| error.with_source(source))
}

fn read(source: &SceneSource) -> Result<Scene, SceneError> {
    let mut root = table(source)?;
    check_schema(&root)?;
    SceneError::join(tables_as_lists(source.text(), root.get_ref(), &JSON_SCHEMA))?;
    let mut errors: Vec<SceneError> = vec![];
    loop {
        match Scene::deserialize(toml::Deserializer::from(root.clone())) {
            Ok(scene) => {
                let written = toml::Table::try_from(&scene).map_err(|e| {
                    let help = "whole numbers go up to 9223372036854775807";
                    SceneError::new(format!("a value does not fit into TOML: {e}"), help)
                })?;
                unread_in_table(root.get_ref(), &written, &mut errors);
                SceneError::join(errors)?;
                return Ok(scene);
            }
            Err(e) => {
                errors.push(translate(&e));
                // Replace a mistyped word by the word that was meant, and continue.
                let mut words = quoted(e.message());
                let meant = closest(words.next().unwrap_or_default(), words);
                let repaired = e.span().is_some_and(|s| repair(root.get_mut(), &s, meant));
                let unknown = e.message().starts_with("unknown field")
                    || e.message().starts_with("unknown variant") && meant.is_some();
                if !(unknown && repaired && errors.len() < MAX_ERRORS) {
                    SceneError::join(std::mem::take(&mut errors))?;
                }
            }
        }
    }
}

/// Reports lists that are longer than expected: serde ignores the surplus values.
fn unread_in_table(table: &DeTable, read: &toml::Table, errors: &mut Vec<SceneError>) {
    for (key, value) in table {
        if let Some(read) = read.get(key.get_ref().as_ref()) {
            unread(value, read, errors);
        }
    }
}

fn unread(value: &Spanned<DeValue>, read: &toml::Value, errors: &mut Vec<SceneError>) {
    match (value.get_ref(), read) {
        (DeValue::Table(table), toml::Value::Table(read)) => unread_in_table(table, read, errors),
        (DeValue::Array(array), toml::Value::Array(read)) => {
            if array.len() != read.len() {
                let message = format!("a list of {}", count(array.len(), "value"));
                let help = format!("expected {}", count(read.len(), "value"));
                errors.push(SceneError::at(&value.span(), message, help).with_label("this list"));
            }
            for (value, read) in array.iter().zip(read) {
                unread(value, read, errors);
            }
        }
        _ => (),
    }
}

/// The TOML text as a table, or its syntax errors, at most one per line.
pub(super) fn table(source: &SceneSource) -> Result<Spanned<DeTable<'_>>, SceneError> {
    let text = source.text();
    let first = match DeTable::parse(text) {
        Ok(table) => return Ok(table),
        Err(first) => first,
    };
    let mut error = syntax(&first);
    if text.len() <= MAX_RECOVER {
        let (_, mut all) = DeTable::parse_recoverable(text);
        let line = |e: &toml::de::Error| {
            let start = text.floor_char_boundary(e.span().map_or(0, |span| span.start));
            text[..start].matches('\n').count()
        };
        let mut lines = HashSet::new();
        all.sort_by_key(|e| e.span().map(|span| span.start));
        let one_a_line = all.iter().take(100).filter(|e| lines.insert(line(e)));
        error = SceneError::join(one_a_line.take(MAX_ERRORS).map(syntax)).err().unwrap_or(error);
    }
    Err(error.with_source(source))
}

fn syntax(e: &toml::de::Error) -> SceneError {
    let help = match e.message() {
        m if m.starts_with("duplicate key") => "remove one of the two",
        m if m.contains("string values must be quoted") => {
            "put words and expressions in quotes: \"2 * alpha\""
        }
        m if m.contains("recurs") => "a scene needs no such deep nesting",
        _ => "check the TOML syntax: key = value, [table], [[list]], \"text\"",
    };
    SceneError::at(&e.span(), format!("not TOML: {}", e.message()), help)
}

fn check_schema(root: &Spanned<DeTable>) -> Result<(), SceneError> {
    let help = format!("this version reads `schema = {SCHEMA}`");
    let Some(schema) = root.get_ref().get("schema") else {
        let message = format!("the scene does not say `schema = {SCHEMA}`");
        let help = "add it as the first line: it is the version of the scene format";
        return Err(SceneError::at(&(0..0), message, help).with_label("belongs here"));
    };
    match schema.get_ref() {
        DeValue::Integer(i) if i.to_string() == SCHEMA.to_string() => Ok(()),
        DeValue::Integer(i) => {
            let message = format!("schema {i} is not known");
            Err(SceneError::at(&schema.span(), message, help))
        }
        _ => Err(SceneError::at(&schema.span(), "`schema` is not a whole number", help)),
    }
}

/// Replaces the key or string at `span` by `meant`. If `meant` is `None`, a key is removed. Returns
/// whether something was changed.
fn repair(table: &mut DeTable, span: &Range<usize>, meant: Option<&str>) -> bool {
    let key = table.keys().find(|key| key.span() == *span).map(|key| key.get_ref().to_string());
    let Some(key) = key else {
        return table.iter_mut().any(|(_, value)| repair_in(value, span, meant));
    };
    let value = table.remove(key.as_str());
    if let (Some(value), Some(meant)) = (value, meant)
        && !table.contains_key(meant)
    {
        table.insert(Spanned::new(span.clone(), meant.to_owned().into()), value);
    }
    true
}

fn repair_in(value: &mut Spanned<DeValue>, span: &Range<usize>, meant: Option<&str>) -> bool {
    let found = value.span() == *span;
    match (value.get_mut(), meant) {
        (DeValue::Table(table), _) => repair(table, span, meant),
        (DeValue::Array(array), _) => array.iter_mut().any(|v| repair_in(v, span, meant)),
        (DeValue::String(text), Some(meant)) if found => {
            *text = meant.to_owned().into();
            true
        }
        _ => false,
    }
}

/// The words of a message that are in backticks.
fn quoted(message: &str) -> impl Iterator<Item = &str> {
    message.split('`').skip(1).step_by(2)
}

/// Label of an unknown key.
const NO_KEY: &str = "not a key of this table";

/// Translates a message of serde into the terms of scene files.
fn translate(e: &toml::de::Error) -> SceneError {
    let said = e.message();
    let shown = e.to_string();
    let table = shown.lines().find_map(|line| line.strip_prefix("in `")?.strip_suffix('`'));
    let within = table.map(|t| format!(" in `{t}`")).unwrap_or_default();
    let mut words = quoted(said);
    let name = words.next().unwrap_or_default();
    let known: Vec<_> = words.collect();
    let (message, help, label) = if said.starts_with("unknown field") {
        // The path ends with the key itself.
        let parent = table.and_then(|t| t.strip_suffix(name)?.strip_suffix('.'));
        let within = parent.map(|t| format!(" in `{t}`")).unwrap_or_default();
        let help = suggestion(name, "keys are", &known);
        let label = if parent.is_some() { NO_KEY } else { "not a key of a scene" };
        (format!("unknown key `{name}`{within}"), help, label)
    } else if said.starts_with("unknown variant") {
        let help = suggestion(name, "choices are", &known);
        (format!("unknown choice `{name}`{within}"), help, "not a choice")
    } else if said.starts_with("missing field") {
        let help = format!("add `{name} = ...`");
        (format!("key `{name}` is missing{within}"), help, "belongs into this table")
    } else if let Some((keys, known)) = said
        .strip_prefix("unexpected keys in table: ")
        .and_then(|rest| rest.split_once(", available keys: "))
    {
        let known: Vec<_> = known.split(", ").collect();
        let key = keys.split(", ").next().unwrap_or_default();
        let help = suggestion(key, "keys are", &known);
        (format!("unknown key `{key}`{within}"), help, NO_KEY)
    } else if said.starts_with("wanted exactly 1 element") {
        let help = "give exactly one of the choices".to_owned();
        (format!("a choice is needed{within}"), help, "not one choice")
    } else if let Some((found, wanted)) = said.rsplit_once(", expected ") {
        let found = found.replacen("invalid type: ", "", 1).replacen("invalid value: ", "", 1);
        let (shown, label) = match found.as_str() {
            "map" => ("a table", "this table"),
            "sequence" => ("a list", "this list"),
            other => (other, "this value"),
        };
        let header = table.unwrap_or("...");
        let remedy = match (found.as_str(), wanted) {
            ("map", "a sequence") => format!(": write `[[{header}]]` instead of `[{header}]`"),
            _ => String::new(),
        };
        (format!("{shown}{within}"), format!("expected {}{remedy}", plain(wanted)), label)
    } else {
        (format!("{said}{within}"), String::new(), "here")
    };
    SceneError::at(&e.span(), message, help).with_label(label)
}

/// Describes a Rust type in plain words.
fn plain(wanted: &str) -> String {
    match wanted {
        "u32" | "u64" | "usize" => "a whole number, 0 or more".into(),
        "f64" => "a number".into(),
        "a map" => "a table".into(),
        "a sequence" => "a list: [..., ...]".into(),
        "a boolean" => "true or false".into(),
        _ => match wanted.split_once(' ') {
            Some(("struct", name)) => format!("a table ({})", name.to_lowercase()),
            Some(("enum", name)) => format!("a choice ({})", name.to_lowercase()),
            _ => wanted.into(),
        },
    }
}

/// The scene as TOML with every default written out; [`parse`] reads it back to an equal scene.
pub fn to_toml(scene: &Scene) -> String {
    // Cannot fail for a scene that was parsed.
    toml::to_string(scene).unwrap_or_else(|e| format!("# not a scene: {e}\n"))
}

/// Identifier of a scene's content: the SHA-256 hash of [`to_toml`], in hexadecimal digits.
pub fn scene_hash(scene: &Scene) -> String {
    content_hash(to_toml(scene))
}

/// SHA-256 hash of a content, in hexadecimal digits.
pub fn content_hash(content: impl AsRef<[u8]>) -> String {
    Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether a name can be that of a single folder everywhere: 1 to 100 letters, digits, `_` and `-`.
pub fn is_folder_name(name: &str) -> bool {
    let ordinary = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (1..=100).contains(&name.len()) && name.chars().all(ordinary)
}

/// The JSON schema of scene files, for editors.
pub fn json_schema() -> String {
    format!("{:#}\n", *JSON_SCHEMA)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scope, presets};
    use crate::session::{thread_seconds, timed};
    use std::fs;

    fn silo() -> SceneSource {
        presets::find("silo").expect("listed")
    }

    /// The silo with pieces of its text replaced.
    fn with(pieces: &[(&str, &str)]) -> String {
        let edit = |text: String, (from, to): &(&str, &str)| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        };
        pieces.iter().fold(silo().text().to_owned(), edit)
    }

    fn lines(text: &str) -> Vec<String> {
        let source = SceneSource::new("s.toml", text);
        let scene = parse(&source);
        let error = scene.and_then(|s| Scope::new(&s).map_err(|e| e.with_source(&source)));
        error.map(|_| vec![]).unwrap_or_else(|e| e.lines())
    }

    /// `file:line:column: ` of the end of a text.
    fn place(before: &str) -> String {
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        format!("s.toml:{}:{column}: ", before.matches('\n').count() + 1)
    }

    /// Columns: text of the silo, its replacement, position of the error in the replacement,
    /// message, help.
    const FAULTS: &str = r#"
        density = 1e6 | dnsity = 1 | dnsity | unknown key `dnsity` | did you mean `density`?
        "down" | "dwn" | "dwn" | unknown choice `dwn` | did you mean `down`?
        density = 1e6 | density = true | true | boolean `true` | a number or an expression
        density = 1e6 | density = nan | nan | NaN is not finite | a finite number
        name = "outflow" | | no place | key `name` is missing in | add `name
        [0, -10] | [0] | [0] | invalid length 1 in `gravity` | an array of length 2
        [0, -10] | [0, 1, 2] | [0 | a list of 3 values | expected 2 values
        ["-aperture/2" | [1, "-aperture/2" | [ | a list of 3 values | expected 2 values
        cells = 6 | cells = -8 | -8 | integer `-8` | a whole number, 0 or more
        cells = 6 | cells = 1.5 | 1.5 | floating point `1.5` | a whole number
        shape.rectangle.x | shape.circle.x | shape | a choice is needed | exactly one
        shape.rectangle.x | shape.rectangle.z | z | unknown key `z` | `x`, `y`
        schema = 1 | schema = 2 | 2 | schema 2 is not known | reads `schema = 1`
        schema = 1 | schema = "1" | "1" | not a whole number | reads `schema = 1`
        schema = 1 | # | no place | does not say `schema = 1` | as the first line
        [[gauges]] | [gauges] | [gauges | a table in `gauges` | write `[[gauges]]` instead of `[gauges]`
        gravity | schema = 1\ngravity | schema | duplicate key | remove one
        [time] | [[time]] | [[time]] | a list in `time` | write `[time]` instead of `[[time]]`
        schema = 1 | schema = 1\nmesh = [1] | [1] | a list in `mesh` | expected a table
        [materials.grains] | [[materials]] | [[m | in `materials` | write `[materials.NAME]`
        [materials.grains] | [[materials.grains]] | [[m | in `materials.grains` | write `[materials.grains]`
        [time] | [time | no place | not TOML | TOML syntax
        parameters.coupling | parameters.alpha | alpha | duplicate key | remove one
        cells = 6 | cells = many | many | must be quoted | in quotes
        "1/3" | "1/zz" | zz | unknown name `zz` | known names are
        "1/3" | "1/0" | "1/0" | not finite: it is inf | division by zero
        "1/3" | 101 | 101 | `alpha` is 101, outside its range: 0 to 100 | choose
        min = 0 | min = 200 | 200 | its min 200 is above its max 100 | swap
        parameters.alpha | parameters.sqrt | no place | this name is a function | rename
        parameters.alpha | parameters.x | no place | this name is a coordinate | rename
        parameters.alpha | parameters.pi | no place | a function or constant | rename
        parameters.alpha | parameters.a-b | no place | cannot be used in expressions | rename
    "#;

    #[test]
    fn says_what_is_wrong_and_where() {
        for row in FAULTS.trim().lines() {
            let cells: Vec<_> = row.split('|').map(|c| c.trim().replace("\\n", "\n")).collect();
            let [from, to, at, message, help] = cells.as_slice() else { panic!("{row}") };
            let found = lines(&with(&[(from, to)]));
            let first = found.first().unwrap_or_else(|| panic!("{row}: no error"));
            assert!(first.contains(message) && first.contains(help), "{row}: {first}");
            if let Some((lead, _)) = to.split_once(at.as_str()) {
                let before = silo().text().split(from).next().unwrap_or_default().to_owned();
                assert!(first.starts_with(&place(&(before + lead))), "{row}: {first}");
            }
        }
    }

    #[test]
    fn reports_several_errors_at_once() {
        let text = with(&[
            ("density = 1e6", "dnsity = 1e6"),
            ("cells = 6", "cels = 6"),
            ("spacing", "spacng"),
            ("[time]", "[time]\nqqq = 1"),
            ("\"down\"", "\"dwn\""),
        ]);
        let found = lines(&text);
        assert_eq!(found.len(), 5, "{found:#?}");
        let found = lines(&with(&[("min = 0", "min = 7"), ("default = 7", "default = \"z\"")]));
        assert_eq!(found.len(), 2, "{found:#?}");
        let found = lines("schema = 1\na = b\nc = d\n[\n");
        assert_eq!(found.len(), 3, "{found:#?}");
        assert!(found[1].starts_with("s.toml:3:5: "), "{found:#?}");
    }

    #[test]
    fn every_default_is_written_and_reads_back() {
        let more = "
            [[blocks]]\nname = \"b\"\nx = [0, 1]\ny = [0, \"1+1\"]
            [body_force]\ncouple = \"x*y\"
            [[dye.marks]]\nfrom = [0, 0]\nto = [1, 1]\nwidth = 0.1
            [[schedule]]\nstep = 3\nset = { alpha = 0.5, \"gravity[1]\" = -5 }
            [[regions]]\nmaterial = \"grains\"\nshape.circle = { centre = [0, 1], radius = 2 }
            director = \"random\"
            [[regions]]\nmaterial = \"grains\"\nshape.where = \"x > y\"
            director.angle_degrees = \"90*x\"
            [[regions]]\nmaterial = \"grains\"\nshape = \"everywhere\"
            [[mesh.grading]]\ntowards.x = \"aperture\"\nfactor = 3
            [materials.granular]\ncolour = \"#112233\"
            granular = { porosity = 0.5, coordination = 4, normal_dashpot = 1, tangential_dashpot = 1 }
        ";
        let lines_of_dye = ("[dye.grid]", "[dye]\nlines = [[[0, 1], [1, \"1\"]]]\n[dye.grid]");
        let text = with(&[lines_of_dye]) + more;
        let scene =
            parse(&SceneSource::new("s.toml", text)).unwrap_or_else(|e| panic!("{:?}", e.lines()));
        let written = to_toml(&scene);
        let again = parse(&SceneSource::new("again", &*written)).expect("reads back");
        assert_eq!(to_toml(&again), written);
        assert_eq!(scene_hash(&again), scene_hash(&scene));
        assert_eq!(scene_hash(&scene).len(), 64);
        for default in ["tolerance = ", "courant = ", "frames = 100", "incompressible = true"] {
            assert!(written.contains(default), "{default}");
        }
        let other = silo().with_sets(&["alpha=1".into()]).and_then(|s| parse(&s)).expect("valid");
        assert_ne!(scene_hash(&other), scene_hash(&scene));
    }

    #[test]
    fn parameters_use_those_above() {
        let text = with(&[("default = 7", "default = \"6 + 3*alpha\"")]);
        let scene = parse(&SceneSource::new("s.toml", text)).expect("valid");
        assert_eq!(Scope::new(&scene).ok().and_then(|s| s.get("fill_height")), Some(7.0));
        let half = |name: &str| (name == "alpha").then_some(0.5);
        let scope = Scope::with_overrides(&scene, half).expect("in range");
        assert_eq!(scope.get("fill_height"), Some(7.5));
        assert!(Scope::with_overrides(&scene, |_| Some(f64::NAN)).is_err());
        let below = with(&[("\"1/3\"", "\"aperture/3\"")]);
        assert!(lines(&below)[0].contains("unknown name `aperture`"), "{:?}", lines(&below));
    }

    #[test]
    fn files_that_are_not_scenes_are_refused() {
        let folder = crate::testing::TempFolder::new().expect("temporary folder");
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).expect("writes");
            path
        };
        let big: Vec<u8> =
            (0..10_000_000u32).map(|i| (i.wrapping_mul(2654435761) >> 24) as u8).collect();
        let clock = thread_seconds();
        for (path, message) in [
            (folder.path().join("none.toml"), "there is no such file"),
            (folder.path().to_owned(), "is a directory"),
            (file("empty.toml", b" \n"), "is empty"),
            (file("latin.toml", b"a = 1\nb = \"\xe9\""), "is not UTF-8 text: byte 11, in line 2"),
            (file("big.toml", &big), "larger than 1 MiB"),
            ("/dev/zero".into(), "larger than 1 MiB"),
        ] {
            let error = load(&path).expect_err(message);
            assert!(error.one_line().contains(message), "{}", error.one_line());
            assert!(error.remedy().is_some() && error.message().contains(&*path.to_string_lossy()));
        }
        assert!(clock.is_none_or(|before| thread_seconds().is_none_or(|now| now - before < 2.0)));
        let path = file("silo.toml", format!("\u{feff}{}", silo().text()).as_bytes());
        let source = load(&path).expect("a scene");
        assert_eq!(source.name(), path.to_string_lossy());
        assert!(parse(&source).is_ok());
    }

    #[test]
    fn deep_nesting_is_refused() {
        for text in [
            "[".repeat(100_000),
            format!("a = {}", "[".repeat(100_000)),
            format!("a = {}", "[\n".repeat(100_000)),
            format!("a = {}", "{a=".repeat(100_000)),
            format!("{}a = 1", "a.".repeat(100_000)),
            format!("[{}a]", "a.".repeat(100_000)),
            "[[a]]\n".repeat(100_000),
            "a = \n".repeat(100_000),
        ] {
            let source = SceneSource::new("s.toml", text);
            let ((), took) = timed(|| {
                let error = parse(&source).expect_err("no scene");
                let refused = source.with_sets(&["name=a".into()]).is_err();
                assert!(refused || source.text().starts_with("[[a"));
                assert!(error.lines().iter().all(|line| line.len() < 2000));
            });
            assert!(took.cpu < 2.0, "{took:?}");
        }
    }

    #[test]
    fn many_errors_are_cut_short() {
        let rows = (0..20_000).map(|i| format!("[parameters.p{i}]\ndefault = \"q{i}\"\n"));
        let text = rows.collect::<String>() + "[domain]";
        let (found, took) = timed(|| lines(&with(&[("[domain]", &text)])));
        assert_eq!(found.len(), MAX_ERRORS, "{found:#?}");
        assert!(took.cpu < 5.0, "{took:?}");
    }

    #[test]
    fn garbage_never_panics() {
        let mut state = 7u64;
        let mut random = |n: usize| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize % n
        };
        let pieces =
            ["[", "]", "{", "}", "=", "\"", "\n", ".", ",", "1e999", "é", "\u{1b}", "nan", "x"];
        for _ in 0..600 {
            let mut text: Vec<char> = silo().text().chars().collect();
            for _ in 0..=random(6) {
                let at = random(text.len().max(1));
                match random(3) {
                    0 => _ = text.drain(at..(at + random(40)).min(text.len())),
                    1 => text.splice(at..at, pieces[random(pieces.len())].chars()).for_each(drop),
                    _ => text.truncate(at.max(1)),
                }
            }
            let source = SceneSource::new("s.toml", text.into_iter().collect::<String>());
            if let Err(error) = parse(&source).and_then(|scene| Scope::new(&scene)) {
                let error = error.with_source(&source);
                assert!(error.lines().iter().all(|line| line.starts_with("s.toml")), "{error:?}");
                assert!(!format!("{:?}", miette::Report::new(error)).is_empty());
            }
            _ = source.with_sets(&["alpha=1".into(), "walls[0].kind=no_slip".into()]);
        }
    }
}
