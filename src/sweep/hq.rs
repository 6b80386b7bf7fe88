//! This module implements the engine `hq`, which runs cases as tasks of a HyperQueue server.
//!
//! One job file with a task for each case is written and submitted with `hq job submit-file`; then
//! `hq job wait` is watched. The job has no `max_fails`: a task that fails does not cancel the
//! others.

use super::{Case, Engine, Event, State, SweepError, Work, environment};
use crate::words::count;
use indexmap::IndexMap;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Environment variable with the command to use instead of `hq`; words are separated by blanks.
const ENTRY: &str = "HQ_ENTRY";
/// Interval at which the folders are checked.
const POLL: Duration = Duration::from_millis(500);
/// Number of times that the worker of a task may crash before the task counts as failed.
const CRASH_LIMIT: u32 = 20;
/// HyperQueue's unit of memory (bytes).
const MIB: u64 = 1 << 20;

/// Engine that submits cases to a HyperQueue server.
pub struct HyperQueue {
    /// Path of this program on the workers.
    pub program: PathBuf,
    /// Cores per case.
    pub threads: usize,
    entry: Vec<String>,
}

#[derive(Serialize)]
struct Job<'a> {
    name: &'a str,
    task: Vec<Task>,
}

#[derive(Serialize)]
struct Task {
    id: usize,
    command: Vec<String>,
    cwd: PathBuf,
    stdout: PathBuf,
    stderr: PathBuf,
    env: IndexMap<&'static str, String>,
    crash_limit: u32,
    request: Vec<Request>,
}

#[derive(Serialize)]
struct Request {
    resources: IndexMap<&'static str, String>,
}

impl HyperQueue {
    /// An engine that uses the command in `HQ_ENTRY`, or else `hq`.
    pub fn new(program: PathBuf, threads: usize) -> HyperQueue {
        let named = std::env::var(ENTRY).unwrap_or_default();
        let words = match Path::new(&named).is_file() {
            true => vec![named],
            false => named.split_whitespace().map(String::from).collect(),
        };
        let entry = if words.is_empty() { vec!["hq".into()] } else { words };
        HyperQueue { program, threads, entry }
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.entry[0]);
        command.args(&self.entry[1..]).args(arguments).stdin(Stdio::null());
        command
    }

    fn entry(&self) -> String {
        self.entry.join(" ")
    }

    fn cannot_start(&self, e: std::io::Error) -> SweepError {
        SweepError::Engine(format!(
            "cannot start `{}`: {e}\n  help: put HyperQueue's hq on the PATH, or name it in {ENTRY}; \
             docs/sweeps.md has a driver for the Python package",
            self.entry()
        ))
    }

    /// The text of the job file.
    fn job(&self, name: &str, root: &Path, cases: &[&Case]) -> Result<String, String> {
        let task = |case: &&Case| Task {
            id: case.number,
            command: [self.program.to_string_lossy(), "sweep".into(), "case".into()]
                .into_iter()
                .map(String::from)
                .chain([root.to_string_lossy().into_owned(), case.id.clone()])
                .collect(),
            cwd: root.to_owned(),
            stdout: root.join("hq").join(format!("{}.out", case.id)),
            stderr: root.join("hq").join(format!("{}.err", case.id)),
            env: environment(self.threads),
            crash_limit: CRASH_LIMIT,
            request: vec![Request {
                resources: [
                    ("cpus", self.threads.to_string()),
                    ("mem", case.memory.div_ceil(MIB).to_string()),
                ]
                .into_iter()
                .collect(),
            }],
        };
        let job = Job { name, task: cases.iter().map(task).collect() };
        toml::to_string(&job).map_err(|e| e.to_string())
    }

    /// Submits the job file and returns the number of the job.
    fn submit(&self, file: &Path) -> Result<String, SweepError> {
        let path = file.to_string_lossy();
        let said = self
            .command(&["--output-mode=quiet", "job", "submit-file", &path])
            .output()
            .map_err(|e| self.cannot_start(e))?;
        let (out, err) =
            (String::from_utf8_lossy(&said.stdout), String::from_utf8_lossy(&said.stderr));
        let number = out.split_whitespace().find(|w| w.chars().all(|c| c.is_ascii_digit()));
        match number {
            Some(number) if said.status.success() => Ok(number.to_owned()),
            _ => Err(SweepError::Engine(format!(
                "`{} job submit-file {path}` failed: {}\n  help: start a server and workers first: \
                 `hq server start`, `hq worker start`; see docs/sweeps.md",
                self.entry(),
                format!("{err} {out}").trim()
            ))),
        }
    }
}

impl Engine for HyperQueue {
    fn run(&self, work: &mut Work) -> Result<(), SweepError> {
        let root = std::path::absolute(work.store.root())
            .map_err(SweepError::file("find", work.store.root()))?;
        let folder = root.join("hq");
        std::fs::create_dir_all(&folder).map_err(SweepError::file("make", &folder))?;
        let file = folder.join("job.toml");
        let name = root.file_name().map_or("sweep".into(), |n| n.to_string_lossy());
        let text = self
            .job(&name, &root, &work.cases)
            .map_err(|cause| SweepError::Broken { path: file.clone(), cause })?;
        std::fs::write(&file, text).map_err(SweepError::file("write", &file))?;
        let job = self.submit(&file)?;
        eprintln!("submitted job {job} with {}", count(work.cases.len(), "task"));
        let mut waiting = self
            .command(&["--output-mode=quiet", "job", "wait", &job])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| self.cannot_start(e))?;
        let mut open = work.cases.clone();
        loop {
            if work.is_interrupted() {
                let _ = waiting.kill();
                let _ = waiting.wait();
                eprintln!(
                    "job {job} continues on the server; `{} job cancel {job}` ends it; the same \
                     sweep started again uses the cases that it has finished",
                    self.entry()
                );
                return Ok(());
            }
            // Checked first: cases that end after this are found below.
            let over = !matches!(waiting.try_wait(), Ok(None));
            report(work, &mut open);
            if over {
                for case in open {
                    (work.watch)(Event::Ended(case, State::Missing));
                }
                return Ok(());
            }
            std::thread::sleep(POLL);
        }
    }
}

/// Reports cases that have ended, and the overall progress.
fn report<'a>(work: &mut Work<'a>, open: &mut Vec<&'a Case>) {
    open.retain(|case| {
        let state = work.store.state(&case.id);
        if state == State::Missing {
            return true;
        }
        (work.watch)(Event::Ended(case, state));
        false
    });
    let shares: Vec<f64> = open.iter().map(|case| work.store.progress(case)).collect();
    let running = shares.iter().filter(|s| **s > 0.0).count();
    let (all, ended) = (work.cases.len().max(1), work.cases.len() - open.len());
    let share = (ended as f64 + shares.iter().sum::<f64>()) / all as f64;
    (work.watch)(Event::Progress { share, running });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_task_does_not_cancel_the_job() {
        let entry = vec!["hq".into()];
        let hq = HyperQueue { program: "/bin/grainscope".into(), threads: 2, entry };
        let case = Case {
            id: "0123456789ab".into(),
            number: 7,
            values: IndexMap::new(),
            numbers: IndexMap::new(),
            seed: None,
            sets: vec![],
            end: 1.0,
            unknowns: 1,
            memory: 100_000_000,
        };
        let text = hq.job("s", Path::new("/data/s"), &[&case]).expect("TOML");
        let job: toml::Table = toml::from_str(&text).expect("TOML");
        assert!(!job.contains_key("max_fails"), "{text}");
        let task = &job["task"][0];
        let words: Vec<&str> =
            task["command"].as_array().expect("words").iter().filter_map(|w| w.as_str()).collect();
        assert_eq!(words, ["/bin/grainscope", "sweep", "case", "/data/s", "0123456789ab"]);
        assert_eq!(task["id"].as_integer(), Some(7));
        let resources = &task["request"][0]["resources"];
        assert_eq!(resources["cpus"].as_str(), Some("2"));
        assert_eq!(resources["mem"].as_str(), Some("96"));
    }
}
