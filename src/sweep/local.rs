//! This module implements the local engine, which runs as many processes of this program as cores
//! and memory allow.

use super::{Case, Engine, Event, State, SweepError, Work, environment};
use crate::plan::memory::available;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Interval at which child processes are checked.
const POLL: Duration = Duration::from_millis(50);
/// Interval at which the progress is read from the folders.
const REPORT: Duration = Duration::from_millis(500);
/// Time that interrupted processes have to finish their step.
const PATIENCE: Duration = Duration::from_secs(7);
/// Fraction of the free memory that cases may use.
const MEMORY_SHARE: f64 = 0.8;
/// Number of words kept from the error output of a failed process.
const LAST_WORDS: usize = 400;

/// Resource limits of a sweep on one machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Maximum number of concurrent cases.
    pub jobs: usize,
    /// Threads per case.
    pub threads: usize,
    /// Memory for all running cases (bytes).
    pub memory: u64,
}

impl Limits {
    /// Limits of this machine: all cores, and 80 % of the free memory.
    pub fn of_machine(jobs: Option<usize>, threads: usize) -> Limits {
        let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
        let ours = available().unwrap_or(f64::INFINITY);
        Limits {
            jobs: jobs.unwrap_or((cores / threads.max(1)).max(1)),
            threads,
            memory: (MEMORY_SHARE * ours) as u64,
        }
    }

    /// Whether another case fits beside the running ones. A single case always does.
    fn admits(&self, running: &[u64], next: u64) -> bool {
        let taken: u64 = running.iter().sum();
        running.is_empty() || running.len() < self.jobs && taken + next <= self.memory
    }
}

/// Engine that runs cases on this machine.
pub struct Local {
    /// Path of this program.
    pub program: PathBuf,
    /// Limits of cores and memory.
    pub limits: Limits,
}

struct Running<'a> {
    case: &'a Case,
    child: Child,
}

impl Engine for Local {
    fn run(&self, work: &mut Work) -> Result<(), SweepError> {
        let cases = work.cases.clone();
        let mut waiting = cases.iter().copied();
        let mut next = waiting.next();
        let mut running: Vec<Running> = vec![];
        let mut ended = 0;
        let mut told = Instant::now();
        while !running.is_empty() || next.is_some() {
            if work.is_interrupted() {
                stop(&mut running);
                return Ok(());
            }
            let taken: Vec<u64> = running.iter().map(|r| r.case.memory).collect();
            if let Some(case) = next.filter(|case| self.limits.admits(&taken, case.memory)) {
                running.push(self.start(work, case)?);
                (work.watch)(Event::Started(case));
                next = waiting.next();
                continue;
            }
            let mut k = 0;
            while k < running.len() {
                match running[k].child.try_wait() {
                    Ok(None) => k += 1,
                    Ok(Some(status)) => {
                        let Running { case, child } = running.swap_remove(k);
                        ended += 1;
                        settle(work, case, status, child)?;
                    }
                    Err(e) => {
                        stop(&mut running);
                        return Err(SweepError::Engine(format!(
                            "cannot wait for the process of a case: {e}"
                        )));
                    }
                }
            }
            if told.elapsed() > REPORT {
                told = Instant::now();
                let begun: f64 = running.iter().map(|r| work.store.progress(r.case)).sum();
                let share = (ended as f64 + begun) / cases.len().max(1) as f64;
                (work.watch)(Event::Progress { share, running: running.len() });
            }
            std::thread::sleep(POLL);
        }
        Ok(())
    }
}

impl Local {
    fn start<'a>(&self, work: &Work, case: &'a Case) -> Result<Running<'a>, SweepError> {
        let mut command = Command::new(&self.program);
        command
            .args(["sweep", "case", "--stop-with-input"])
            .arg(work.store.root())
            .arg(&case.id)
            .envs(environment(self.limits.threads))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        // Ctrl-C reaches only this process, which then stops the others.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn().map_err(|e| {
            SweepError::Engine(format!("cannot start {}: {e}", self.program.display()))
        })?;
        Ok(Running { case, child })
    }
}

/// Determines the state of a case whose process has ended.
fn settle(
    work: &mut Work,
    case: &Case,
    status: ExitStatus,
    mut child: Child,
) -> Result<(), SweepError> {
    if !status.success() && work.store.state(&case.id) == State::Missing {
        let mut words = vec![];
        if let Some(mut stderr) = child.stderr.take() {
            // The output of the process is additional information only.
            let _ = std::io::Read::read_to_end(&mut stderr, &mut words);
        }
        let words = String::from_utf8_lossy(&words);
        let words: Vec<&str> = words.split_whitespace().collect();
        let last = words[words.len().saturating_sub(LAST_WORDS)..].join(" ");
        work.store.blame(
            &case.id,
            format!("its process ended with {status}; {last}").trim_end_matches("; "),
        )?;
    }
    (work.watch)(Event::Ended(case, work.store.state(&case.id)));
    Ok(())
}

/// Lets processes finish their step; those that take too long are killed.
fn stop(running: &mut [Running]) {
    // A case ends when its standard input is closed.
    running.iter_mut().for_each(|r| drop(r.child.stdin.take()));
    let start = Instant::now();
    for r in running {
        while start.elapsed() < PATIENCE && matches!(r.child.try_wait(), Ok(None)) {
            std::thread::sleep(POLL);
        }
        // Killing a process that has ended fails, which is ignored.
        let _ = r.child.kill();
        let _ = r.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_and_cores_limit_what_runs_at_once() {
        let limits = Limits { jobs: 3, threads: 1, memory: 100 };
        assert!(limits.admits(&[], 1000), "a large case runs alone");
        assert!(limits.admits(&[50], 50) && !limits.admits(&[50], 51));
        assert!(limits.admits(&[1, 1], 1) && !limits.admits(&[1, 1, 1], 1));
        let all = Limits::of_machine(None, 1);
        assert!(all.jobs >= 1 && all.memory > 1_000_000);
        assert_eq!(Limits::of_machine(None, 1 << 20).jobs, 1);
    }
}
