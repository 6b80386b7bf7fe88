//! Checks the invariants of ARCHITECTURE.md on the source files.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules of the library, lowest layer first, and the modules that each may import.
const ROOMS: [(&str, &[&str]); 21] = [
    ("testing", &[]),
    ("threads", &[]),
    ("simd", &[]),
    ("laws", &[]),
    ("frame", &[]),
    ("scene", &[]),
    ("space", &["laws", "scene", "threads"]),
    ("plan", &["laws", "scene", "space"]),
    ("solve", &["laws", "scene", "space", "plan", "threads", "simd"]),
    ("motion", &["laws", "space", "plan", "threads", "simd"]),
    ("sim", &["laws", "frame", "scene", "space", "plan", "solve", "motion", "threads"]),
    ("cases", &["laws", "scene", "space", "plan", "solve", "sim"]),
    ("verify", &["scene", "plan", "sim", "cases"]),
    ("cost", &["scene", "space", "plan", "sim", "cases", "testing", "threads"]),
    ("record", &["frame", "scene", "space", "plan", "sim"]),
    ("stress", &["scene", "plan", "sim", "cases", "verify", "space", "threads"]),
    ("compare", &["frame", "scene", "plan", "record"]),
    ("export", &["frame", "compare"]),
    ("sweep", &["scene", "plan", "record", "testing", "simd"]),
    ("explorer", &["frame", "scene", "plan", "sim", "cost", "record", "stress"]),
    (
        "commands",
        &[
            "frame", "scene", "plan", "sim", "cases", "verify", "cost", "stress", "record",
            "compare", "explorer", "sweep", "export", "simd",
        ],
    ),
];

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

/// All Rust files of `src`, sorted.
fn all_sources() -> Vec<PathBuf> {
    let mut list = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut list);
    list.sort();
    list
}

/// Top-level module of a source file.
fn room(path: &Path) -> String {
    let below = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap();
    let first = below.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
    first.trim_end_matches(".rs").to_string()
}

/// Lines of code outside unit tests, with line numbers; without comment lines.
fn code(path: &Path) -> Vec<(usize, String)> {
    let text = fs::read_to_string(path).unwrap();
    text.lines()
        .take_while(|l| !l.starts_with("#[cfg(test)]"))
        .enumerate()
        .map(|(n, l)| (n + 1, l.to_string()))
        .filter(|(_, l)| !l.trim_start().starts_with("//"))
        .collect()
}

#[test]
fn imports_follow_the_layers() {
    let mut faults = Vec::new();
    for path in all_sources() {
        let room = room(&path);
        if room == "lib" || room == "main" {
            continue;
        }
        let (_, allowed) = ROOMS
            .iter()
            .find(|(name, _)| *name == room)
            .unwrap_or_else(|| panic!("{room} is not in the list of modules in tests/tidy.rs"));
        for (number, line) in code(&path) {
            for part in line.split("crate::").skip(1) {
                let used: String =
                    part.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if used != room && !used.is_empty() && !allowed.contains(&used.as_str()) {
                    faults.push(format!("{}:{number}: {room} imports {used}", path.display()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn only_the_recorder_uses_rerun() {
    for path in all_sources() {
        if path.to_string_lossy().contains("record/rerun_log") {
            continue;
        }
        for (number, line) in code(&path) {
            assert!(!line.contains("rerun::"), "{}:{number} uses rerun", path.display());
        }
    }
}

#[test]
fn nothing_unwraps_or_uses_unsafe_code() {
    // `simd.rs` calls functions compiled for an instruction set after checking the processor.
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
fn every_module_has_a_doc_comment() {
    for path in all_sources() {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(
            text.starts_with("//!") || name == "main.rs",
            "{} has no module doc comment",
            path.display()
        );
    }
}
