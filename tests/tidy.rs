//! Checks the invariants of ARCHITECTURE.md on the source files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of the library, lowest layer first, and the modules that each may import.
const MODULES: [(&str, &[&str]); 27] = [
    ("testing", &[]),
    ("words", &[]),
    ("threads", &[]),
    ("simd", &[]),
    ("laws", &[]),
    ("frame", &[]),
    ("web", &[]),
    ("scene", &["words"]),
    ("space", &["laws", "scene", "threads"]),
    ("composition", &["laws", "space", "threads"]),
    ("plan", &["laws", "scene", "space", "words"]),
    ("solve", &["laws", "scene", "space", "composition", "plan", "threads", "simd", "words"]),
    ("motion", &["laws", "space", "plan", "threads", "simd"]),
    (
        "sim",
        &[
            "laws",
            "frame",
            "scene",
            "space",
            "composition",
            "plan",
            "solve",
            "motion",
            "threads",
            "words",
        ],
    ),
    ("cases", &["laws", "scene", "space", "plan", "solve", "sim"]),
    ("verify", &["scene", "plan", "sim", "cases"]),
    ("record", &["frame", "scene", "space", "plan", "sim", "web", "words"]),
    ("session", &["frame", "scene", "plan", "sim", "record", "threads", "simd"]),
    ("cost", &["scene", "space", "plan", "sim", "cases", "session", "testing", "threads", "words"]),
    ("stress", &["scene", "plan", "sim", "cases", "verify", "session", "space", "threads"]),
    ("results", &["frame", "scene", "plan", "sim", "record", "words"]),
    ("compare", &["frame", "scene", "plan", "record", "results"]),
    ("export", &["frame", "record", "results"]),
    ("light", &["frame", "sim", "record", "results", "words"]),
    ("sweep", &["scene", "plan", "sim", "record", "testing", "simd", "words"]),
    (
        "explorer",
        &["frame", "scene", "plan", "sim", "cost", "record", "results", "session", "light", "web"],
    ),
    (
        "commands",
        &[
            "frame", "scene", "plan", "sim", "cases", "verify", "cost", "stress", "record",
            "session", "results", "compare", "explorer", "sweep", "export", "light", "simd",
            "words",
        ],
    ),
];

/// What `composition`, which knows no constitutive law, may import from `laws`.
const COMPOSITION_FROM_LAWS: &str = "laws::director";

/// Largest number of lines of a source file without its inline tests.
const LONGEST: usize = 400;

/// Files that are tables of data: scenes and entries, one after the other.
const TABLES: [&str; 3] = ["scene/types.rs", "sim/row.rs", "stress/trials.rs"];

/// Adds all Rust files below a folder to a list.
fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All Rust files of `src`, sorted.
fn all_sources() -> Vec<PathBuf> {
    let mut list = Vec::new();
    sources(&root(), &mut list);
    list.sort();
    list
}

/// Path of a source file below `src`.
fn below(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/")
}

/// Module path of a source file: `solve::terms` for `solve/terms/mod.rs`.
fn module(path: &Path) -> String {
    let text = below(path);
    let text = text.trim_end_matches(".rs").trim_end_matches("/mod");
    text.replace('/', "::")
}

/// Top-level module of a source file.
fn top(path: &Path) -> String {
    module(path).split("::").next().unwrap().to_string()
}

/// Lines of code outside tests, with their numbers.
fn code(path: &Path) -> Vec<(usize, String)> {
    let text = fs::read_to_string(path).unwrap();
    text.lines()
        .take_while(|l| !l.starts_with("#[cfg(test)]"))
        .enumerate()
        .map(|(n, l)| (n + 1, l.to_string()))
        .filter(|(_, l)| !l.trim_start().starts_with("//"))
        .collect()
}

/// Splits `a::{b, c::{d, e}}` into `a::b`, `a::c::d`, `a::c::e`.
fn expand(text: &str) -> Vec<String> {
    let text = text.trim();
    let Some(open) = text.find('{') else {
        let path = text.split(" as ").next().unwrap_or_default();
        return vec![path.trim().trim_end_matches("::self").to_string()];
    };
    let prefix = &text[..open];
    let inside = &text[open + 1..text.rfind('}').unwrap_or(text.len())];
    let (mut parts, mut depth, mut start) = (Vec::new(), 0, 0);
    for (k, c) in inside.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&inside[start..k]);
                start = k + 1;
            }
            _ => {}
        }
    }
    parts.push(&inside[start..]);
    let parts = parts.into_iter().filter(|p| !p.trim().is_empty());
    parts.flat_map(|p| expand(&format!("{prefix}{}", p.trim()))).collect()
}

/// Paths below the crate that a file names: its `use` items, groups expanded, `super` and `self`
/// resolved, and `crate::` paths in the text. Re-exports of a module's own children are left out.
fn imports(path: &Path) -> Vec<(usize, String)> {
    let own = module(path);
    let parent = |m: &str| m.rsplit_once("::").map_or(String::new(), |(p, _)| p.to_string());
    let is_folder = path.file_name().is_some_and(|n| n == "mod.rs");
    let mut found = Vec::new();
    let lines = code(path);
    let mut k = 0;
    while k < lines.len() {
        let (number, line) = &lines[k];
        let start = line.trim_start();
        let item = ["use ", "pub use ", "pub(crate) use ", "pub(super) use "]
            .iter()
            .find_map(|word| start.strip_prefix(word));
        if let Some(first) = item {
            let mut text = first.to_string();
            while !text.contains(';') && k + 1 < lines.len() {
                k += 1;
                text += lines[k].1.trim();
            }
            let reexport = !start.starts_with("use ");
            for used in expand(text.split(';').next().unwrap()) {
                let mut base = if is_folder { own.clone() } else { parent(&own) };
                let full = if let Some(rest) = used.strip_prefix("crate::") {
                    rest.to_string()
                } else if used.starts_with("super::") || used.starts_with("self::") {
                    let mut rest = used.as_str();
                    if is_folder && rest.starts_with("super::") {
                        base = parent(&base);
                        rest = &rest[7..];
                    } else if rest.starts_with("self::") {
                        rest = &rest[6..];
                    } else {
                        rest = &rest[7..];
                    }
                    while let Some(more) = rest.strip_prefix("super::") {
                        (base, rest) = (parent(&base), more);
                    }
                    if base.is_empty() { rest.into() } else { format!("{base}::{rest}") }
                } else if is_folder && !reexport {
                    // A path that starts with a child's name.
                    format!("{own}::{used}")
                } else {
                    continue;
                };
                found.push((*number, full));
            }
        } else {
            for part in line.split("crate::").skip(1) {
                let end = part.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
                found.push((*number, part[..end.unwrap_or(part.len())].to_string()));
            }
        }
        k += 1;
    }
    found
}

#[test]
fn imports_follow_the_layers() {
    let mut faults = Vec::new();
    for path in all_sources() {
        let own = top(&path);
        if ["lib", "main", "internals"].contains(&own.as_str()) {
            continue;
        }
        let (_, allowed) = MODULES
            .iter()
            .find(|(name, _)| *name == own)
            .unwrap_or_else(|| panic!("the module {own} is missing in the list of this test"));
        for (number, used) in imports(&path) {
            let first = used.split("::").next().unwrap();
            let known = MODULES.iter().any(|(name, _)| *name == first);
            let law =
                own == "composition" && first == "laws" && !used.starts_with(COMPOSITION_FROM_LAWS);
            if known && first != own && !allowed.contains(&first) || law {
                faults.push(format!("{}:{number}: {own} imports {used}", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let modules: BTreeSet<String> = all_sources().iter().map(|p| module(p)).collect();
    let mut edges: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in all_sources() {
        let own = module(&path);
        for (_, used) in imports(&path) {
            // The file that holds the item: the longest module path that starts it.
            let parts: Vec<&str> = used.split("::").collect();
            let file = (1..=parts.len())
                .rev()
                .map(|n| parts[..n].join("::"))
                .find(|m| modules.contains(m));
            // A folder's own file holds types that its children use; it is no circle that it
            // declares them.
            let Some(file) = file.filter(|f| *f != own && !own.starts_with(&format!("{f}::")))
            else {
                continue;
            };
            edges.entry(own.clone()).or_default().insert(file);
        }
    }
    // Files from which nothing is imported, or only such, are taken away; circles remain.
    loop {
        let free: Vec<String> = edges
            .iter()
            .filter(|(_, to)| to.iter().all(|t| !edges.contains_key(t)))
            .map(|(from, _)| from.clone())
            .collect();
        if free.is_empty() {
            break;
        }
        free.iter().for_each(|f| {
            edges.remove(f);
        });
    }
    // What only imports from circles is no part of one.
    loop {
        let used: BTreeSet<&String> = edges.values().flatten().collect();
        let unused: Vec<String> =
            edges.keys().filter(|from| !used.contains(from)).cloned().collect();
        if unused.is_empty() {
            break;
        }
        unused.iter().for_each(|f| {
            edges.remove(f);
        });
    }
    let list: Vec<String> = edges
        .iter()
        .map(|(from, to)| {
            let to: Vec<&str> =
                to.iter().filter(|t| edges.contains_key(*t)).map(String::as_str).collect();
            format!("{from} imports {}", to.join(", "))
        })
        .collect();
    assert!(list.is_empty(), "circles:\n{}", list.join("\n"));
}

#[test]
fn files_are_short() {
    let long: Vec<String> = all_sources()
        .iter()
        .filter(|p| !TABLES.contains(&below(p).as_str()))
        .filter_map(|path| {
            let text = fs::read_to_string(path).unwrap();
            let lines = text.lines().take_while(|l| !l.starts_with("#[cfg(test)]")).count();
            (lines > LONGEST).then(|| format!("{}: {lines} lines", path.display()))
        })
        .collect();
    assert!(long.is_empty(), "more than {LONGEST} lines without tests:\n{}", long.join("\n"));
}

#[test]
fn only_the_recorder_names_rerun() {
    for path in all_sources() {
        if path.to_string_lossy().contains("record/rerun_log") {
            continue;
        }
        for (number, line) in code(&path) {
            assert!(!line.contains("rerun::"), "{}:{number} names rerun", path.display());
        }
    }
}

#[test]
fn there_is_no_unwrap_and_no_unsafe_code() {
    // The only unsafe code: calls of kernels compiled for an instruction set that the processor
    // supports.
    let simd = Path::new("src/simd.rs");
    for path in all_sources() {
        for (number, line) in code(&path) {
            for word in [".unwrap()", ".expect(", "unsafe ", "todo!", "unimplemented!", "dbg!"] {
                if word == "unsafe " && path.ends_with(simd) {
                    continue;
                }
                assert!(!line.contains(word), "{}:{number}: {word}", path.display());
            }
        }
    }
}

#[test]
fn every_file_starts_with_its_documentation() {
    for path in all_sources() {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(
            text.starts_with("//!") || name == "main.rs",
            "{} has no module documentation",
            path.display()
        );
    }
}
