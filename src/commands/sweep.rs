//! This module implements `grainscope sweep`: many runs of one scene, on this machine or through
//! HyperQueue.

mod one;
mod results;

use super::{Failure, print};
use crate::record::text::duration;
use crate::session::{progress_bar, watch_interrupts};
use crate::sweep::{
    Case, Engine, Event, HyperQueue, Limits, List, Local, Spec, State, Store, SweepError, Work,
    preset_list, preset_source, read_file, similar,
};
use crate::words::count;
use one::one;
use results::collect;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Largest number of runs shown side by side unless they are named.
const MOST_SIDE_BY_SIDE: usize = 8;

/// Number of units of the progress bar.
const PARTS: f64 = 10_000.0;

const EXAMPLES: &str = "\
Examples:
  grainscope sweep fig3                                 the runs of Fig. 3 of the source paper
  grainscope sweep silo --vary alpha=0,1/3,5/3 --vary contrast=log:10..1e4:4 --repeat-seeds 3
  grainscope sweep silo --vary alpha=0..3 --vary aperture=0.5..2 --sample sobol:32
  grainscope sweep silo --vary alpha=0..3:7 --engine hq on a cluster, by workers of HyperQueue
  grainscope sweep collect sweeps/silo                  table, plots
  grainscope sweep list sweeps/silo --missing | parallel grainscope sweep case sweeps/silo";

/// Run a scene for many values of its parameters.
///
/// Finished cases are not run again: repeating the command runs the missing and failed cases.
/// SCENE is the name of a preset, a scene file, a built-in sweep (`grainscope sweep presets`) or a
/// sweep file.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// Scene or sweep to run
    #[arg(required = true)]
    scene: Option<String>,
    /// Values of a parameter or key: alpha=0,1/3,5/3 or alpha=0..1:5 or contrast=log:1e1..1e6:6
    #[arg(long, value_name = "NAME=VALUES")]
    vary: Vec<String>,
    /// Set a parameter (contrast=100) or any key (accuracy.cells=16) in all cases
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Sample all ranges without a count (alpha=0..1) with N points of a Sobol sequence
    #[arg(long, value_name = "sobol:N")]
    sample: Option<String>,
    /// Run every case with K seeds of its particles and random directors
    #[arg(long, value_name = "K")]
    repeat_seeds: Option<u32>,
    /// Folder of the sweep [default: sweeps/<name>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Engine that runs the cases
    #[arg(long, value_enum, default_value_t = EngineName::Local)]
    engine: EngineName,
    /// Largest number of cases at once [default: as many as cores and memory allow]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    jobs: Option<u32>,
    /// Number of cores of each case
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4096))]
    cores: u32,
    /// Use the coarse and short settings of the sweep, as a test
    #[arg(long)]
    quick: bool,
    /// Write no recordings
    #[arg(long)]
    no_recordings: bool,
    /// Write cases.json and print what would run, without running it
    #[arg(long)]
    dry_run: bool,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum EngineName {
    /// Processes on this machine
    Local,
    /// Tasks of a HyperQueue server, submitted with `hq` or the command in HQ_ENTRY
    Hq,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Collect all cases: one table, spread over seeds, plots, a recording side by side
    Collect {
        /// Folder of the sweep
        folder: PathBuf,
        /// Record these cases side by side (numbers or ids) [default: those of the first seed]
        #[arg(long, num_args = 0.., value_name = "CASE")]
        side_by_side: Option<Vec<String>>,
        /// Write report.html of the same cases: the flows side by side, curves, results
        #[arg(long)]
        report: bool,
    },
    /// Run one case, for job arrays of batch systems
    Case {
        /// Folder of the sweep
        folder: PathBuf,
        /// Number or id of the case
        case: String,
        /// End when the standard input ends
        #[arg(long, hide = true)]
        stop_with_input: bool,
    },
    /// List the cases
    List {
        /// Folder of the sweep
        folder: PathBuf,
        /// Print only the ids of cases that are not done, one per line
        #[arg(long)]
        missing: bool,
    },
    /// List the built-in sweeps, or print one
    Presets {
        /// Name of the sweep to print
        name: Option<String>,
    },
}

impl From<SweepError> for Failure {
    fn from(e: SweepError) -> Self {
        match e {
            SweepError::Scene(e) => e.into(),
            SweepError::Usage(text) => Failure::Usage(text),
            other => Failure::Environment(other.to_string()),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.command {
        None => sweep(args),
        Some(Command::Collect { folder, side_by_side, report }) => {
            let store = Store::new(folder);
            let (list, _) = store.read()?;
            collect(&store, &list, side_by_side.as_deref(), *report)
        }
        Some(Command::Case { folder, case, stop_with_input }) => {
            one(&Store::new(folder), case, *stop_with_input)
        }
        Some(Command::List { folder, missing }) => show_list(&Store::new(folder), *missing),
        Some(Command::Presets { name: None }) => {
            let lines =
                preset_list().into_iter().map(|(name, about)| format!("{name:<14} {about}"));
            print(&lines.collect::<Vec<_>>().join("\n"))
        }
        Some(Command::Presets { name: Some(name) }) => {
            let names = || preset_list().into_iter().map(|p| p.0).collect::<Vec<_>>().join(", ");
            let text = preset_source(name).ok_or_else(|| {
                Failure::Usage(format!("there is no sweep `{name}`; there are {}", names()))
            })?;
            print(text)
        }
    }
}

/// Reads the sweep that the command line specifies.
fn spec(args: &Args) -> Result<Spec, Failure> {
    let name = args.scene.clone().unwrap_or_default();
    let known = read_file(&name)?;
    if args.quick && known.is_none() {
        return Err(Failure::Usage(format!(
            "--quick: the scene {name} has no quick settings; use --set accuracy.cells=2, say"
        )));
    }
    let mut spec = known.unwrap_or_else(|| Spec {
        schema: 1,
        scene: name.clone(),
        repeat_seeds: 1,
        recordings: true,
        ..Spec::default()
    });
    if args.quick {
        spec = spec.quick();
    }
    let named = |v: &String| v.split('=').next().unwrap_or_default().trim().to_owned();
    // A `--vary` of the command line replaces that of the sweep for the same name.
    let anew: Vec<String> = args.vary.iter().map(named).collect();
    spec.vary.retain(|v| !anew.contains(&named(v)));
    spec.vary.extend(args.vary.clone());
    spec.set.extend(args.sets.clone());
    spec.sample = args.sample.clone().or(spec.sample);
    spec.repeat_seeds = args.repeat_seeds.unwrap_or(spec.repeat_seeds);
    spec.recordings &= !args.no_recordings;
    Ok(spec)
}

fn sweep(args: &Args) -> Result<(), Failure> {
    let clock = Instant::now();
    let mut spec = spec(args)?;
    let source = super::source(&spec.scene, &[]).map_err(|e| propose(e, &spec.scene))?;
    if spec.name.is_empty() {
        spec.name = crate::scene::parse(&source)?.name;
    }
    let list = List::new(&source, &spec)?;
    let out = args.out.clone().unwrap_or_else(|| Path::new("sweeps").join(&spec.name));
    let store = Store::new(&out);
    store.write(&list, &source)?;
    let open: Vec<&Case> =
        list.cases.iter().filter(|c| store.state(&c.id) != State::Done).collect();
    let (all, done) = (list.cases.len(), list.cases.len() - open.len());
    eprintln!("{}, {done} done before, in {}", count(all, "case"), out.display());
    let strangers = store.strangers(&list);
    if strangers > 0 {
        let runs = count(strangers, "finished run");
        eprintln!("note: {runs} of other lists in the folder: not used");
    }
    if args.dry_run {
        return print(&plan_text(&open, args));
    }
    let interrupted = watch_interrupts(super::code::INTERRUPTED);
    if !open.is_empty() {
        let engine = engine(args)?;
        drive(engine.as_ref(), &store, open, &interrupted)?;
    }
    if list.cases.iter().any(|c| store.state(&c.id) == State::Done) {
        collect(&store, &list, spec.side_by_side.then_some(&[][..]), false)?;
    }
    eprintln!("in {}", duration(clock.elapsed().as_secs_f64()));
    if interrupted.load(Ordering::SeqCst) {
        eprintln!("interrupted; finished cases are kept, and the same command continues");
        return Err(Failure::Interrupted);
    }
    verdict(&store, &list)
}

/// Suggests a sweep if an unknown scene name is similar to the name of a sweep.
fn propose(failure: Failure, name: &str) -> Failure {
    match (similar(name), failure) {
        (Some(sweep), Failure::Scene(e)) if e.span().is_none() => Failure::Usage(format!(
            "there is no scene and no sweep `{name}`\n  help: did you mean the sweep `{sweep}`? \
             `grainscope sweep presets` and `grainscope presets` list all names"
        )),
        (_, failure) => failure,
    }
}

/// Makes the engine that the command line names.
fn engine(args: &Args) -> Result<Box<dyn Engine>, Failure> {
    let program = std::env::current_exe().map_err(|e| {
        Failure::Environment(format!("cannot find the path of this program to start cases: {e}"))
    })?;
    let threads = args.cores as usize;
    Ok(match args.engine {
        EngineName::Local => {
            let limits = Limits::of_machine(args.jobs.map(|n| n as usize), threads);
            Box::new(Local { program, limits })
        }
        EngineName::Hq => Box::new(HyperQueue::new(program, threads)),
    })
}

/// Runs cases with one progress bar, and prints the result of each.
fn drive(
    engine: &dyn Engine,
    store: &Store,
    cases: Vec<&Case>,
    interrupted: &AtomicBool,
) -> Result<(), Failure> {
    let bar = progress_bar(PARTS as u64, true);
    let count = cases.len();
    let (mut done, mut failed) = (0, 0);
    let mut watch = |event: Event| match event {
        Event::Started(_) => {}
        Event::Progress { share, running } => {
            bar.set_position((PARTS * share) as u64);
            bar.set_message(format!("{running} running, {done} of {count} done, {failed} failed"));
        }
        Event::Ended(case, state) => {
            let end = match state {
                State::Done => {
                    done += 1;
                    "done".to_owned()
                }
                State::Failed(cause) => {
                    failed += 1;
                    format!("failed: {cause}")
                }
                State::Missing => "not run".to_owned(),
            };
            bar.suspend(|| eprintln!("{} {}: {end}", case.id, case.label()));
        }
    };
    let outcome = engine.run(&mut Work { store, cases, interrupted, watch: &mut watch });
    bar.finish_and_clear();
    Ok(outcome?)
}

/// Returns a failure if a case failed or is missing.
fn verdict(store: &Store, list: &List) -> Result<(), Failure> {
    let mut lines = vec![];
    for case in &list.cases {
        match store.state(&case.id) {
            State::Done => {}
            State::Failed(cause) => {
                lines.push(format!("  {} {}: {cause}", case.id, case.label()));
            }
            State::Missing => lines.push(format!("  {} {}: not run", case.id, case.label())),
        }
    }
    if lines.is_empty() {
        return Ok(());
    }
    Err(Failure::Differs(format!(
        "not done: {} of {}; the same command runs them again\n{}\n  help: the files of failed \
         runs are in {}",
        lines.len(),
        count(list.cases.len(), "case"),
        lines.join("\n"),
        store.root().join("failed").display()
    )))
}

/// Prints the cases, or the ids of those that are not done.
fn show_list(store: &Store, missing: bool) -> Result<(), Failure> {
    let (list, _) = store.read()?;
    let line = |case: &Case| {
        let state = store.state(&case.id);
        if missing {
            return (state != State::Done).then(|| case.id.clone());
        }
        let state = match state {
            State::Done => "done".to_owned(),
            State::Failed(cause) => format!("failed: {cause}"),
            State::Missing => "missing".to_owned(),
        };
        Some(format!("{:>5}  {}  {}  {state}", case.number, case.id, case.label()))
    };
    let lines: Vec<String> = list.cases.iter().filter_map(line).collect();
    if lines.is_empty() { Ok(()) } else { print(&lines.join("\n")) }
}

/// Lists the cases that would run, with their unknowns and memory.
fn plan_text(open: &[&Case], args: &Args) -> String {
    let mut lines: Vec<String> = open
        .iter()
        .map(|c| {
            format!(
                "{:>5}  {}  {}  ({} unknowns, at most {} MB)",
                c.number,
                c.id,
                c.label(),
                c.unknowns,
                c.memory / 1_000_000
            )
        })
        .collect();
    let limits = Limits::of_machine(args.jobs.map(|n| n as usize), args.cores as usize);
    let on = match args.engine {
        EngineName::Local => format!(
            "on this machine up to {} at once, {} each, in {} MB of memory",
            limits.jobs,
            count(limits.threads, "thread"),
            limits.memory / 1_000_000
        ),
        EngineName::Hq => format!("as tasks of HyperQueue, {} each", count(limits.threads, "core")),
    };
    lines.push(format!("{} would run, {on}", count(open.len(), "case")));
    lines.join("\n")
}
