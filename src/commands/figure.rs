//! This module implements `grainscope figure`: the figures of the source paper, one command each.

use super::{Failure, compare as comparison, print};
use crate::compare;
use crate::frame::Snapshot;
use crate::plan::Plan;
use crate::record::figure_page::{Row, Sheet, sheet};
use crate::record::folder::{self, FolderError, RunFolder};
use crate::record::info;
use crate::record::number::short;
use crate::record::rerun_log::Sink;
use crate::record::text::duration;
use crate::scene::presets;
use crate::session::{Interrupted, Options, Session, progress_bar, watch_interrupts};
use crate::sim::Run;
use crate::sweep;
use crate::words::count;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Number of runs at once: more do not fit into the caches of small machines.
const AT_ONCE: usize = 2;

/// Number of units of the progress bar per run.
const PARTS: f64 = 1000.0;

/// Make a figure of the source paper: runs, plots, snapshots, and a recording side by side.
#[derive(clap::Args)]
pub struct Args {
    /// Figure to make
    figure: Name,
    /// Use coarse meshes and few frames, as a test: seconds instead of minutes
    #[arg(long)]
    quick: bool,
    /// Folder of the output [default: figures/<name>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Overwrite runs that are already in the folder
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Name {
    /// Figs. 1 and 3: discharge of a silo for five internal lengths
    Silo,
    /// Fig. 4: alignment of texture in shear
    Alignment,
}

/// Definition of a figure.
struct Figure {
    /// Name of the figure and of its folder.
    name: &'static str,
    /// Name of the preset that is run.
    preset: &'static str,
    /// Title of the sheet of snapshots.
    title: &'static str,
    /// Name of the sweep that gives the runs, and symbol of the quantity that it varies; `None` for
    /// a single run.
    sweep: Option<(&'static str, &'static str)>,
    /// Label of the single run.
    single: &'static str,
    /// Settings of all runs.
    sets: &'static [&'static str],
    /// Additional settings with `--quick`.
    quick: &'static [&'static str],
    /// Times of the snapshots, s.
    times: &'static [f64],
    /// File name of the sheet of snapshots.
    sheet: &'static str,
}

/// Figs. 1 and 3 of the source: R/a from 0 to 10/3, with snapshots at the times of Fig. 1.
const SILO: Figure = Figure {
    name: "silo",
    preset: "silo",
    title: "Discharge of a silo for five internal lengths R, aperture a",
    sweep: Some(("fig3", "R/a")),
    single: "",
    sets: &[],
    quick: &[],
    times: &[0.0, 4.75e-4, 1.42e-3, 2.85e-3, 3.8e-3],
    sheet: "snapshots",
};

/// Fig. 4 of the source. At the three times the dyed line is sheared by about a half, two, and many
/// times the height.
const ALIGNMENT: Figure = Figure {
    name: "alignment",
    preset: "shear_alignment",
    title: "Texture in shear: dyed line, directors and isovalues of mean |n_x|",
    sweep: None,
    single: "R/H = 0.2",
    sets: &["time.end=0.5", "recording.frames=50", "recording.times=[0.05, 0.15, 0.5]"],
    quick: &["accuracy.cells=16", "recording.frames=10"],
    times: &[0.05, 0.15, 0.5],
    sheet: "isovalues",
};

impl Name {
    fn figure(self) -> &'static Figure {
        match self {
            Name::Silo => &SILO,
            Name::Alignment => &ALIGNMENT,
        }
    }
}

/// A run of the figure.
struct Job {
    name: String,
    plan: Arc<Plan>,
    /// Path of the folder.
    folder: PathBuf,
    /// The folder, until the run takes it.
    claimed: Mutex<Option<RunFolder>>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let figure = args.figure.figure();
    let out = args.out.clone().unwrap_or_else(|| Path::new("figures").join(figure.name));
    let jobs = jobs(figure, args, &out)?;
    let clock = Instant::now();
    let pictures = run_all(figure, &jobs)?;
    let stem = |name: &str| out.join(format!("{}_{name}", figure.name));
    let reached = pictures.iter().map(Vec::len).min().unwrap_or(0);
    let times = figure.times.iter().take(reached);
    let columns = times.map(|t| format!("t = {} s", short(*t))).collect();
    let rows = jobs.iter().zip(pictures).map(|(job, pictures)| Row {
        name: job.name.clone(),
        info: info::run_info(&job.plan, &job.name),
        pictures,
    });
    sheet(
        &stem(figure.sheet),
        &Sheet { title: figure.title.into(), columns, rows: rows.collect() },
    )?;
    let mut said = String::new();
    if jobs.len() > 1 {
        said = side_by_side(&jobs, &out.join(format!("{}.rrd", figure.name)))?;
    }
    for suffix in [".svg", ".png"] {
        said += &format!("wrote {}{suffix}\n", stem(figure.sheet).display());
    }
    for job in &jobs {
        said +=
            &format!("wrote {} (recording, series, summary, scene, plots)\n", job.folder.display());
    }
    print(&format!("{said}in {}", duration(clock.elapsed().as_secs_f64())))
}

/// Makes plans and folders of all runs. Errors are reported before anything is computed.
fn jobs(figure: &Figure, args: &Args, out: &Path) -> Result<Vec<Job>, Failure> {
    let source = presets::find(figure.preset)?;
    let quick: &[&str] = if args.quick { figure.quick } else { &[] };
    let mut jobs = vec![];
    for (name, folder, sets) in cases(figure, args.quick)? {
        let own = figure.sets.iter().chain(quick).map(|s| s.to_string());
        let (_, plan) = super::resolve(&source.with_sets(&own.chain(sets).collect::<Vec<_>>())?)?;
        let claimed = folder::create(&folder, Some(&out.join(&folder)), args.force, None)?;
        let folder = claimed.path().to_owned();
        jobs.push(Job { name, plan: Arc::new(plan), folder, claimed: Mutex::new(Some(claimed)) });
    }
    Ok(jobs)
}

/// Names, folders and settings of the runs, taken from the sweep of the figure.
fn cases(figure: &Figure, quick: bool) -> Result<Vec<(String, String, Vec<String>)>, Failure> {
    let Some((sweep, symbol)) = figure.sweep else {
        return Ok(vec![(figure.single.into(), "run".into(), vec![])]);
    };
    let missing = || Failure::Environment(format!("the sweep {sweep} is not part of the program"));
    let spec = sweep::read_file(sweep)?.ok_or_else(missing)?;
    let spec = if quick { spec.quick() } else { spec };
    let list = sweep::List::new(&super::source(&spec.scene, &[])?, &spec)?;
    let named = |case: &sweep::Case| {
        let (name, value) = case.values.first().ok_or_else(missing)?;
        let folder = format!("{name}_{}", value.replace('/', "_"));
        Ok((format!("{symbol} = {value}"), folder, case.sets.clone()))
    };
    list.cases.iter().map(named).collect()
}

/// Makes all runs, [`AT_ONCE`] in parallel. Returns the frames of each run at the times of the
/// figure.
fn run_all(figure: &Figure, jobs: &[Job]) -> Result<Vec<Vec<Snapshot>>, Failure> {
    let interrupted = watch_interrupts(super::code::INTERRUPTED);
    let bar = progress_bar((PARTS * jobs.len() as f64) as u64, false);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Option<Vec<Snapshot>>>> = Mutex::new(jobs.iter().map(|_| None).collect());
    let fault: Mutex<Option<Failure>> = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE.min(jobs.len()) {
            scope.spawn(|| {
                while let Some((k, job)) = take(&next, jobs) {
                    match make(figure, job, &interrupted, &bar) {
                        Ok(pictures) => {
                            done.lock().unwrap_or_else(PoisonError::into_inner)[k] = Some(pictures);
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

/// Makes one run. Returns its frames at the times of the figure.
fn make(
    figure: &Figure,
    job: &Job,
    interrupted: &Interrupted,
    bar: &ProgressBar,
) -> Result<Vec<Snapshot>, Failure> {
    let end = job.plan.clock.end * job.plan.units.time;
    let mut pictures = vec![];
    let mut counted = 0;
    let options = Options { quiet: true, ..Options::default() };
    let claimed = || {
        let claimed = job.claimed.lock().unwrap_or_else(PoisonError::into_inner).take();
        claimed.ok_or(FolderError::Taken(job.folder.clone()))
    };
    let session =
        Session::start::<Failure>(&options, &job.plan, interrupted.clone(), || Ok(claimed()?))?;
    let summary = session.go_silently(|run: &dyn Run| {
        let time = run.row().time;
        let due = figure.times.get(pictures.len());
        if due.is_some_and(|&t| time >= t * (1.0 - 1e-9)) {
            pictures.push(run.snapshot());
        }
        let part = (PARTS * time / end) as u64;
        bar.inc(part.saturating_sub(counted));
        counted = counted.max(part);
    })?;
    let outflow = summary.gauges.values().next();
    let outflow = outflow.map_or(String::new(), |g| format!(", outflow {:.3} m2", g.volume));
    let took = duration(summary.seconds.get("total").copied().unwrap_or_default());
    bar.suspend(|| eprintln!("{}: {} in {took}{outflow}", job.name, count(summary.steps, "step")));
    Ok(pictures)
}

/// Compares all runs with the first one, and writes the recording. Returns the text to print.
fn side_by_side(jobs: &[Job], path: &Path) -> Result<String, Failure> {
    let folders: Vec<PathBuf> = jobs.iter().map(|job| job.folder.clone()).collect();
    let mut members = crate::results::open_all(&folders)?;
    for (member, job) in members.iter_mut().zip(jobs) {
        member.rename(&job.name);
    }
    let found = compare::compare(&members, &[])?;
    let (found, _) = comparison::write(found, &members, path, &[Sink::Save(path.to_owned())])?;
    Ok(compare::terminal(&found))
}
