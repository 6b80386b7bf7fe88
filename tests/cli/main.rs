//! Tests of the command-line program: exit codes, printed text and written files.

mod commands;
mod compare;
mod cost;
mod environment;
mod grains;
mod hostile;
mod keeping;
mod killed;
mod light;
mod recording;
mod refusals;
mod resume;
mod runs;
mod soak;
mod stress;
mod sweep;
mod tutorial;

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// A temporary folder, deleted at the end of the test.
struct TempFolder(grainscope::internals::TempFolder);

impl TempFolder {
    fn new() -> Self {
        TempFolder(grainscope::internals::TempFolder::new().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).expect("a file");
    }

    fn read(&self, name: &str) -> String {
        let path = self.path(name);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).expect("JSON")
    }

    fn has(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    /// A command that runs the program in this folder.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_grainscope"));
        command.args(arguments).current_dir(self.0.path()).env("NO_COLOR", "1");
        command
    }

    /// Starts the program in this folder; its output can be read at its end.
    fn start(&self, arguments: &[&str]) -> Child {
        let mut command = self.command(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().expect("the program starts")
    }

    /// Runs the program in this folder to its end.
    fn grainscope(&self, arguments: &[&str]) -> Said {
        let output = self.command(arguments).output().expect("the program starts");
        Said::new(arguments, output)
    }
}

/// Exit code and output of the program.
struct Said {
    arguments: String,
    code: Option<i32>,
    out: String,
    err: String,
}

impl Said {
    fn new(arguments: &[&str], output: Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        Said {
            arguments: arguments.join(" "),
            code: output.status.code(),
            out: text(&output.stdout),
            err: text(&output.stderr),
        }
    }

    /// Checks the exit code.
    #[track_caller]
    fn exits(self, code: i32) -> Self {
        let Said { arguments, out, err, .. } = &self;
        assert_eq!(self.code, Some(code), "`{arguments}`\nstdout: {out}\nstderr: {err}");
        assert!(!err.contains("panicked"), "`{arguments}`: {err}");
        self
    }

    /// Checks that stderr contains all parts, ignoring line breaks.
    #[track_caller]
    fn complains(self, parts: &[&str]) -> Self {
        let said = flat(&self.err);
        for part in parts {
            assert!(said.contains(part), "`{}`: no {part:?} in\n{}", self.arguments, self.err);
        }
        self
    }

    /// Checks that stdout contains all parts.
    #[track_caller]
    fn prints(self, parts: &[&str]) -> Self {
        for part in parts {
            let Said { arguments, out, .. } = &self;
            assert!(out.contains(part), "`{arguments}`: no {part:?} in\n{out}");
        }
        self
    }

    /// Standard output as JSON.
    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_str(&self.out)
            .unwrap_or_else(|e| panic!("`{}`: {e} in\n{}", self.arguments, self.out))
    }
}

/// The text without line breaks and without the frame of an error message.
fn flat(text: &str) -> String {
    text.replace(['│', '×'], " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Names of the presets, and the contents of their files.
fn preset_files() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("presets");
    let mut list: Vec<_> = std::fs::read_dir(folder)
        .expect("presets/")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .map(|path| {
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read_to_string(&path).expect("a preset"))
        })
        .collect();
    list.sort();
    assert!(!list.is_empty());
    list
}

/// A table with a header.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads a CSV file; every row must be complete.
    #[track_caller]
    fn read(text: &str) -> Self {
        assert!(text.ends_with('\n'), "the last row is cut: {text:?}");
        let mut lines = text.lines().map(|l| l.split(',').map(String::from).collect::<Vec<_>>());
        let columns = lines.next().expect("a header");
        let rows: Vec<_> = lines.collect();
        for row in &rows {
            assert_eq!(row.len(), columns.len(), "{row:?}");
        }
        Table { columns, rows }
    }

    /// A column as text.
    fn text(&self, name: &str) -> Vec<&str> {
        let at = self.columns.iter().position(|c| c == name);
        let at = at.unwrap_or_else(|| panic!("no column {name} in {:?}", self.columns));
        self.rows.iter().map(|row| row[at].as_str()).collect()
    }

    /// A column as numbers.
    fn numbers(&self, name: &str) -> Vec<f64> {
        self.text(name).iter().map(|v| v.parse().expect("a number")).collect()
    }

    /// All rows without one column.
    fn without(&self, name: &str) -> Vec<Vec<&str>> {
        let kept = self.columns.iter().enumerate().filter(|(_, c)| *c != name);
        let kept: Vec<usize> = kept.map(|(i, _)| i).collect();
        self.rows.iter().map(|row| kept.iter().map(|&i| row[i].as_str()).collect()).collect()
    }
}
