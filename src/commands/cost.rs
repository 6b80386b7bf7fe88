//! This module implements `grainscope cost`: error and time of settings on this machine.

use super::{Failure, print};
use crate::cost::measure::{self, Target};
use crate::cost::{self, CostError, Effort, List, Machine, list, report};
use crate::frame::{Plot, Scalar, Series};
use crate::record::info;
use crate::record::plots::{Axis, Curve, PlotSpec, line_plot};
use crate::record::replace::{self, Kind, MARK};
use crate::record::rerun_log::{Race, RecordError};
use crate::scene::{SceneSource, parse, scene_hash};
use std::path::{Path, PathBuf};

/// Measure error and time of the accuracy settings of a scene.
///
/// The command varies the settings that affect accuracy, measures error and time of each, and
/// prints those that no other setting beats in both. `run --accuracy` and `run --budget` choose
/// from this table.
#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Use shortened runs and few combinations, in less than two minutes
    #[arg(long)]
    quick: bool,
    /// Measure again, even if a table of this scene, program and machine is stored
    #[arg(long)]
    fresh: bool,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
    /// Folder of tables, plots and recording [default: costs/<scene name>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write no recording
    #[arg(long)]
    no_recording: bool,
    /// Write the table into the page FOLDER/cost.md, replacing an older one of this scene
    #[arg(long, value_name = "FOLDER")]
    write: Option<PathBuf>,
}

impl From<CostError> for Failure {
    fn from(e: CostError) -> Self {
        match e {
            CostError::Scene(e) => e.into(),
            CostError::Sim(e) => e.into(),
            CostError::Useless(text) => Failure::Usage(text),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let source = super::source(&args.scene, &args.sets)?;
    let (scene, _) = super::resolve(&source)?;
    let effort = if args.quick { Effort::Quick } else { Effort::Full };
    let kept = if args.fresh { None } else { kept(&source, effort)? };
    let list = match kept {
        Some(list) => {
            eprintln!("this table was kept from before; --fresh measures again");
            list
        }
        None => made(&source, effort)?,
    };
    let folder = args.out.clone().unwrap_or_else(|| Path::new("costs").join(&scene.name));
    write(&folder, &list)?;
    if !args.no_recording {
        race(&source, &list, &folder.join("race.rrd"))?;
    }
    if let Some(docs) = &args.write {
        super::cost_page::write(docs, &list)?;
    }
    if args.json {
        print(&json(&list)?)
    } else {
        print(&format!("{}\nfolder: {}", report::markdown(&list), folder.display()))
    }
}

/// The table as JSON.
fn json(list: &List) -> Result<String, Failure> {
    serde_json::to_string_pretty(list).map_err(|e| Failure::Environment(e.to_string()))
}

/// The file in which a table is stored; `None` if there is no home folder.
fn file(source: &SceneSource, effort: Effort) -> Result<Option<PathBuf>, Failure> {
    let scene = parse(source)?;
    let name = list::file_name(&scene.name, &scene_hash(&scene), effort == Effort::Quick);
    Ok(list::folder().map(|folder| folder.join(name)))
}

/// The stored table of a scene, if there is one.
fn kept(source: &SceneSource, effort: Effort) -> Result<Option<List>, Failure> {
    Ok(list::kept(&parse(source)?, effort == Effort::Quick))
}

/// Makes a table and stores it.
fn made(source: &SceneSource, effort: Effort) -> Result<List, Failure> {
    let mut machine = Machine::here();
    let pin = Pin::new();
    machine.pinned = pin.as_ref().map(|p| p.processor.clone());
    let list = cost::price(source, effort, machine, &mut |line| eprintln!("{line}"))?;
    drop(pin);
    if let Some(path) = file(source, effort)? {
        // A table that cannot be stored can still be used.
        if let Err(e) = list::store(&path, &list) {
            eprintln!("warning: the table cannot be stored in {}: {e}", path.display());
        }
    }
    Ok(list)
}

/// The table to choose settings from: a stored full one, else a stored quick one, else a new quick
/// one.
pub fn to_buy_from(source: &SceneSource) -> Result<List, Failure> {
    for effort in [Effort::Full, Effort::Quick] {
        if let Some(list) = kept(source, effort)? {
            return Ok(list);
        }
    }
    eprintln!("there is no cost table of this scene, program and machine yet: making a quick one");
    let list = made(source, Effort::Quick)?;
    eprintln!("made in {}", report::seconds(list.made_in));
    Ok(list)
}

/// Pins this thread to one processor while runs are measured, since moving between processors
/// empties caches. It uses the system tool `taskset`; without that tool the thread is not pinned.
struct Pin {
    /// Id of the thread.
    thread: String,
    /// Processors allowed before.
    before: String,
    /// Processor to which the thread is pinned.
    processor: String,
}

impl Pin {
    fn new() -> Option<Pin> {
        let status = std::fs::read_to_string("/proc/thread-self/status").ok()?;
        let field = |name: &str| {
            let line = status.lines().find(|l| l.starts_with(name))?;
            Some(line.split_once(':')?.1.trim().to_string())
        };
        let (thread, before) = (field("Pid")?, field("Cpus_allowed_list")?);
        // The last processor is used: the first one handles most interrupts.
        let processor = before.rsplit([',', '-']).next()?.to_string();
        let pin = Pin { thread, before, processor };
        pin.hold(&pin.processor).then_some(pin)
    }

    fn hold(&self, processors: &str) -> bool {
        let mut tool = std::process::Command::new("taskset");
        tool.args(["-c", "-p", processors, &self.thread]);
        tool.output().is_ok_and(|o| o.status.success())
    }
}

impl Drop for Pin {
    fn drop(&mut self) {
        self.hold(&self.before);
    }
}

/// Writes the table in all formats, and its plot.
fn write(folder: &Path, list: &List) -> Result<(), Failure> {
    let cannot = |path: &Path, e: std::io::Error| {
        Failure::Environment(format!("cannot write {}: {e}", path.display()))
    };
    std::fs::create_dir_all(folder).map_err(|e| cannot(folder, e))?;
    let page = format!("{MARK} cost`; do not edit.\n\n{}", report::markdown(list));
    for (name, text, kind) in [
        ("cost.csv", list.csv(), Kind::Table("front,settings")),
        ("cost.json", json(list)? + "\n", Kind::Json("schema")),
        ("cost.md", page, Kind::Page),
    ] {
        replace::write(&folder.join(name), text, kind)?;
    }
    line_plot(&folder.join("cost"), &plot(list))?;
    Ok(())
}

/// Work-precision plot: relative error against processor time.
fn plot(list: &List) -> PlotSpec {
    let points = |entries: Vec<&cost::Entry>| -> Vec<(f64, f64)> {
        entries.into_iter().map(|e| (e.cpu, e.promised)).collect()
    };
    // These points have no order: gaps prevent lines between them.
    let apart = |entries: Vec<&cost::Entry>| -> Vec<(f64, f64)> {
        points(entries).into_iter().flat_map(|p| [p, (f64::NAN, f64::NAN)]).collect()
    };
    let curve = |name: &str, points| Curve { name: name.into(), points, marks: true };
    let mut curves = vec![
        curve("best settings", points(list.front().collect())),
        curve("dominated", apart(list.dominated())),
        curve("settings of the scene", points(list.entries.iter().take(1).collect())),
    ];
    if list.reference.uncertainty > 0.0 {
        let seconds = list.entries.iter().map(|e| e.cpu);
        let ends = [seconds.clone().fold(f64::INFINITY, f64::min), seconds.fold(0.0, f64::max)];
        let line = ends.map(|s| (s, list.reference.uncertainty)).to_vec();
        let name = "uncertainty of the reference".into();
        curves.push(Curve { name, points: line, marks: false });
    }
    PlotSpec {
        title: format!("{}: {}", list.scene, list.quantity),
        x: Axis::new("processor time", "s").log(),
        y: Axis::new("relative error", "").log(),
        curves,
    }
}

/// Largest number of runs side by side: more are too small to see.
const LANES: usize = 4;

/// Largest number of frames of a run.
const PICTURES: u64 = 60;

/// Runs some of the best settings again and records them side by side, each frame at the time at
/// which it was computed.
fn race(source: &SceneSource, list: &List, path: &Path) -> Result<(), Failure> {
    let source = source.with_sets(&list.shortened)?;
    let target = Target::of(&parse(&source)?)?;
    let front: Vec<&cost::Entry> = list.front().collect();
    let mut lanes = vec![];
    for entry in cost::pareto::spread(&front, LANES) {
        let source = source.with_sets(&entry.sets)?;
        let (_, plan) = super::resolve(&source)?;
        let accuracy = report::percent(entry.promised);
        let mut run = info::run_info(&plan, &format!("{accuracy}: {}", entry.label));
        let quantity = list.quantity.clone();
        run.plots = vec![Plot {
            title: format!("{quantity} against seconds computed"),
            series: vec![Series::new("race/value", accuracy)],
            log10: false,
        }];
        lanes.push((run, std::sync::Arc::new(plan), entry.steps));
    }
    let infos: Vec<_> = lanes.iter().map(|l| l.0.clone()).collect();
    let mut race = Race::open(&infos, &format!("{}: cost of accuracy", list.scene), path)?;
    for (k, (_, plan, steps)) in lanes.iter().enumerate() {
        let every = steps.div_ceil(PICTURES).max(1);
        let mut fault: Option<RecordError> = None;
        measure::run(plan.clone(), &target, |run, took| {
            let row = run.row();
            let shown = row.step % every == 0 || run.is_finished();
            let frame = crate::frame::Frame {
                step: row.step,
                time_s: row.time,
                wall_s: took.wall,
                snapshot: shown.then(|| run.snapshot()),
                scalars: vec![Scalar::new("race/value", target.scalar(plan, row))],
                warnings: vec![],
            };
            if fault.is_none() {
                fault = race.frame(k, &frame).err();
            }
        })?;
        if let Some(fault) = fault {
            return Err(fault.into());
        }
    }
    race.finish()?;
    Ok(())
}
