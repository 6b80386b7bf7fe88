//! Makes the runs of a figure, several at once.

use super::Args;
use crate::commands::{Failure, code, resolve};
use crate::plan::Plan;
use crate::record::folder::{self, FolderError, RunFolder};
use crate::record::text::duration;
use crate::scene::SceneSource;
use crate::session::{Interrupted, Options, Session, progress_bar, watch_interrupts};
use crate::sim::Run;
use crate::words::count;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Number of runs at once: more do not fit into the caches of small machines.
const AT_ONCE: usize = 2;

/// Number of units of the progress bar per run.
const PARTS: f64 = 1000.0;

/// A run of a figure.
pub(super) struct Job {
    /// Name of the run in the figure.
    pub(super) name: String,
    /// Plan of the run.
    pub(super) plan: Arc<Plan>,
    /// Path of the folder.
    pub(super) folder: PathBuf,
    /// The folder, until the run takes it.
    claimed: Mutex<Option<RunFolder>>,
}

impl Job {
    /// Makes plan and folder of a run: the folder `folder` in `out`.
    pub(super) fn new(
        source: &SceneSource,
        (name, folder, sets): (String, String, Vec<String>),
        (args, out): (&Args, &Path),
    ) -> Result<Job, Failure> {
        let (_, plan) = resolve(&source.with_sets(&sets)?)?;
        let claimed = folder::create(&folder, Some(&out.join(&folder)), args.force, None)?;
        let folder = claimed.path().to_owned();
        Ok(Job { name, plan: Arc::new(plan), folder, claimed: Mutex::new(Some(claimed)) })
    }
}

/// Lines that name the folders of the runs.
pub(super) fn list(jobs: &[Job]) -> String {
    let line = |job: &Job| {
        format!("wrote {} (recording, series, summary, scene, plots)\n", job.folder.display())
    };
    jobs.iter().map(line).collect()
}

/// Makes all runs, [`AT_ONCE`] in parallel. `watch` sees each run at its start and after each step,
/// with what it has gathered of this run before. Returns what it gathered of each run.
pub(super) fn run_all<T: Default + Send>(
    jobs: &[Job],
    watch: impl Fn(&mut T, &dyn Run) + Sync,
) -> Result<Vec<T>, Failure> {
    let interrupted = watch_interrupts(code::INTERRUPTED);
    let bar = progress_bar((PARTS * jobs.len() as f64) as u64, false);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Option<T>>> = Mutex::new(jobs.iter().map(|_| None).collect());
    let fault: Mutex<Option<Failure>> = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE.min(jobs.len()) {
            scope.spawn(|| {
                while let Some((k, job)) = take(&next, jobs) {
                    match make(job, &interrupted, &bar, &watch) {
                        Ok(gathered) => {
                            done.lock().unwrap_or_else(PoisonError::into_inner)[k] = Some(gathered);
                        }
                        Err(e) => {
                            // A fault ends the other runs after their current step. The first
                            // fault is reported.
                            interrupted.store(true, Ordering::SeqCst);
                            fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e);
                            return;
                        }
                    }
                }
            });
        }
    });
    bar.finish_and_clear();
    match fault.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(e) => Err(e),
        None => {
            let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
            Ok(done.into_iter().flatten().collect())
        }
    }
}

/// The next job, or `None` if all are taken.
fn take<'a>(next: &AtomicUsize, jobs: &'a [Job]) -> Option<(usize, &'a Job)> {
    let k = next.fetch_add(1, Ordering::SeqCst);
    Some((k, jobs.get(k)?))
}

/// Makes one run. Returns what `watch` gathered.
fn make<T: Default>(
    job: &Job,
    interrupted: &Interrupted,
    bar: &ProgressBar,
    watch: &impl Fn(&mut T, &dyn Run),
) -> Result<T, Failure> {
    let end = job.plan.clock.end * job.plan.units.time;
    let mut gathered = T::default();
    let mut counted = 0;
    let options = Options { quiet: true, ..Options::default() };
    let claimed = || {
        let claimed = job.claimed.lock().unwrap_or_else(PoisonError::into_inner).take();
        claimed.ok_or(FolderError::Taken(job.folder.clone()))
    };
    let session =
        Session::start::<Failure>(&options, &job.plan, interrupted.clone(), || Ok(claimed()?))?;
    let summary = session.go_silently(|run: &dyn Run| {
        watch(&mut gathered, run);
        let part = (PARTS * run.row().time / end) as u64;
        bar.inc(part.saturating_sub(counted));
        counted = counted.max(part);
    })?;
    let outflow = summary.gauges.values().next();
    let unit = job.plan.scene.domain.geometry.unit("m²");
    let outflow = outflow.map_or(String::new(), |g| format!(", outflow {:.3} {unit}", g.volume));
    let took = duration(summary.seconds.get("total").copied().unwrap_or_default());
    bar.suspend(|| eprintln!("{}: {} in {took}{outflow}", job.name, count(summary.steps, "step")));
    Ok(gathered)
}
