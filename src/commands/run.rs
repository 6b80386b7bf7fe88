//! This module implements `grainscope run`: it runs a scene and writes a recording, tables and
//! plots.

use super::purchase::{self, Bought};
use super::safety::Safety;
use super::{Failure, memory, print, resume, tell};
use crate::frame::Frame;
use crate::plan::Plan;
use crate::record::checkpoint;
use crate::record::logger::{Backpressure, Logger, Traffic};
use crate::record::rerun_log::{RerunLog, Served, Sink};
use crate::record::run_plots::plots_of_run;
use crate::record::series::{self, SeriesWriter};
use crate::record::summary::{Around, Ending, Summary, Tally};
use crate::record::text::duration;
use crate::record::{folder, info};
use crate::scene::{Quantity, Scene, SceneSource, Scope, scene_hash, to_toml};
use crate::sim::guard::Guard;
use crate::sim::state::{State, StateError, load_phases, save_phases};
use crate::sim::{self, Run, SimError, picture};
use crossbeam::channel::bounded;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Run a scene: a preset or a TOML file.
#[derive(clap::Args, Default)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Use the fastest settings of the `grainscope cost` table that reach this accuracy (1%, 0.003)
    #[arg(long, value_name = "ERROR", value_parser = purchase::accuracy)]
    accuracy: Option<f64>,
    /// Use the most accurate settings that finish within this time (30s, 2min), and stop after it
    #[arg(long, value_name = "TIME", value_parser = purchase::budget, conflicts_with = "accuracy")]
    budget: Option<f64>,
    /// Folder of the run [default: runs/<scene name>, numbered if taken]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Overwrite a run that is already in the folder
    #[arg(long)]
    force: bool,
    /// Stop after N steps
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Stop at this time (s), at most the scene's time.end
    #[arg(long, value_name = "T", conflicts_with_all = ["accuracy", "budget"])]
    until: Option<String>,
    /// Write the recording to this path instead of the folder
    #[arg(long, value_name = "PATH", conflicts_with = "no_recording")]
    save: Option<PathBuf>,
    /// Write no recording
    #[arg(long)]
    no_recording: bool,
    /// Serve the viewer from this process on 127.0.0.1, while running and after
    #[arg(long)]
    serve: bool,
    /// Port of the served page; 0 takes any free one
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Send to a running viewer (rerun+http://127.0.0.1:9876/proxy)
    #[arg(long, value_name = "URL")]
    connect: Option<String>,
    /// Start the `rerun` viewer found on the PATH
    #[arg(long)]
    spawn: bool,
    /// Print the summary as JSON on stdout
    #[arg(long)]
    json: bool,
    /// Print seconds per phase at the end
    #[arg(long)]
    profile: bool,
    #[command(flatten)]
    safety: Safety,
    /// Print no messages: those of several runs at once would mix.
    #[arg(skip)]
    quiet: bool,
}

impl Args {
    /// The arguments of a resumed run.
    pub(super) fn resumed(args: &resume::Args) -> Args {
        Args {
            steps: args.steps,
            serve: args.serve,
            port: args.port,
            safety: args.safety,
            json: args.json,
            profile: args.profile,
            ..Args::default()
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let source = super::source(&args.scene, &args.sets)?;
    let bought = purchase::buy(&source, args.accuracy, args.budget)?;
    let source = bought.as_ref().map_or(Ok(source.clone()), |b| source.with_sets(&b.entry.sets))?;
    let (scene, plan) = match &args.until {
        None => super::resolve(&source)?,
        Some(text) => {
            let scene = shorten(&source, text)?;
            let plan = crate::plan::resolve(&scene).map_err(|e| e.with_source(&source))?;
            (scene, plan)
        }
    };
    let interrupted = Arc::new(AtomicBool::new(false));
    watch_interrupts(&interrupted);
    let plan = Arc::new(plan);
    memory::afford(&plan)?;
    // This fills the cells and solves once, so scenes that cannot start leave no folder.
    let clock = Instant::now();
    let run = sim::start(plan.clone())?;
    let folder = folder::create(&scene.name, args.out.as_deref(), args.force)?;
    let mut session = Session::open(args, &plan, run, folder, clock, interrupted)?;
    session.bought = bought;
    session.go()
}

/// Runs a plan into a folder as `run` does, without messages. `watch` is called at the start and
/// after every step.
pub(super) fn into_folder(
    plan: &Arc<Plan>,
    folder: PathBuf,
    recorded: bool,
    interrupted: &Arc<AtomicBool>,
    watch: impl FnMut(&dyn Run),
) -> Result<Summary, Failure> {
    let clock = Instant::now();
    let run = sim::start(plan.clone())?;
    let args = Args { quiet: true, no_recording: !recorded, ..Args::default() };
    let mut session = Session::open(&args, plan, run, folder, clock, interrupted.clone())?;
    let outcome = session.compute(watch);
    let ended = session.end(outcome)?;
    ended.plotted?;
    ended.failure.map_or(Ok(ended.summary), Err)
}

/// The scene with an earlier end. The interval between frames is unchanged.
fn shorten(source: &SceneSource, text: &str) -> Result<Scene, Failure> {
    let mut scene = crate::scene::parse(source)?;
    let scope = Scope::new(&scene).map_err(|e| e.with_source(source))?;
    let until = Quantity::expression(text).eval(&scope).map_err(|e| {
        Failure::Usage(format!("--until {text}: {}; give a time in seconds", e.message()))
    })?;
    let end = scene.time.end.eval(&scope).map_err(|e| e.with_source(source))?;
    if !(until > 0.0 && until <= end) {
        return Err(Failure::Usage(format!(
            "--until {until}: the scene runs from 0 to {end} s; use --set time.end={until} to run \
             longer"
        )));
    }
    let frames = f64::from(scene.recording.frames);
    scene.recording.frames = (frames * until / end).ceil() as u32;
    let mut kept = Vec::new();
    for q in scene.recording.times {
        if q.eval(&scope).map_err(|e| e.with_source(source))? <= until {
            kept.push(q);
        }
    }
    scene.recording.times = kept;
    scene.time.end = Quantity::number(until);
    Ok(scene)
}

/// Handles interrupts: the first ends the run after its step, a second ends the program.
pub(super) fn watch_interrupts(flag: &Arc<AtomicBool>) {
    let flag = flag.clone();
    let watching = ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(super::code::INTERRUPTED));
        }
    });
    if let Err(e) = watching {
        tell(format_args!("warning: interrupts end the program at once: {e}"));
    }
}

/// A run with all its output.
pub(super) struct Session {
    plan: Arc<Plan>,
    run: Box<dyn Run>,
    folder: PathBuf,
    series: SeriesWriter,
    /// Path of the recording.
    recording: Option<PathBuf>,
    logger: Option<Logger>,
    /// Start of this part of the run.
    clock: Instant,
    /// Totals of the earlier parts of the run: wall time (s), frames, and time of the logger (s).
    before: (f64, Traffic, f64),
    guard: Guard,
    safety: Safety,
    scene_hash: String,
    /// Step of the last checkpoint.
    kept: Option<u64>,
    /// Set by an interrupt.
    interrupted: Arc<AtomicBool>,
    tally: Tally,
    /// Whether the initial state has been written.
    begun: bool,
    /// Index of the next frame.
    next_frame: usize,
    /// Largest number of steps.
    steps: Option<u64>,
    json: bool,
    profile: bool,
    quiet: bool,
    bought: Option<Bought>,
}

/// The result of a run after all files are closed.
struct Ended {
    summary: Summary,
    /// The summary as written to the file.
    json: String,
    /// Path of the recording, and its size in bytes.
    recorded: Option<(PathBuf, u64)>,
    served: Option<Served>,
    failure: Option<Failure>,
    plotted: Result<(), Failure>,
}

impl Session {
    /// Opens the output of a new run.
    fn open(
        args: &Args,
        plan: &Arc<Plan>,
        run: Box<dyn Run>,
        folder: PathBuf,
        clock: Instant,
        interrupted: Arc<AtomicBool>,
    ) -> Result<Session, Failure> {
        let recording = (!args.no_recording)
            .then(|| args.save.clone().unwrap_or_else(|| folder.join("recording.rrd")));
        let warnings: Vec<String> = plan.warnings.iter().map(ToString::to_string).collect();
        let (logger, warnings) =
            start_logger(args, plan, run.as_ref(), (&folder, recording.as_deref()), warnings)?;
        let scene_file = folder.join("scene.toml");
        std::fs::write(&scene_file, to_toml(&plan.scene)).map_err(|e| cannot(&scene_file, e))?;
        let series_file = folder.join("series.csv");
        let series =
            SeriesWriter::create(&series_file, plan).map_err(|e| cannot(&series_file, e))?;
        let mut tally = Tally::new(run.row(), warnings);
        tally.around.set_up = clock.elapsed().as_secs_f64() - run.row().seconds.total();
        Ok(Session {
            plan: plan.clone(),
            guard: Guard::new(args.safety.policy(), run.as_ref()),
            safety: args.safety,
            scene_hash: scene_hash(&plan.scene),
            kept: None,
            tally,
            run,
            folder,
            series,
            recording,
            logger,
            clock,
            before: (0.0, Traffic::default(), 0.0),
            interrupted,
            begun: false,
            next_frame: 0,
            steps: args.steps,
            json: args.json,
            profile: args.profile,
            quiet: args.quiet,
            bought: None,
        })
    }

    /// Continues the run of a folder from a state: the table continues after the row of that state,
    /// the recording after its step.
    pub(super) fn reopen(
        args: &Args,
        plan: &Arc<Plan>,
        mut run: Box<dyn Run>,
        folder: PathBuf,
        state: &State,
        interrupted: Arc<AtomicBool>,
    ) -> Result<Session, Failure> {
        let unfit = |e: StateError| Failure::Environment(e.to_string());
        run.restore(state).map_err(unfit)?;
        let row = run.row().clone();
        let past = Past::load(state, &folder).map_err(unfit)?;
        let series = SeriesWriter::resume(&folder.join("series.csv"), plan, &row)
            .map_err(|e| Failure::Environment(e.to_string()))?;
        let (logger, warnings) = start_logger(
            args,
            plan,
            run.as_ref(),
            (&folder, past.recording.as_deref()),
            past.warnings,
        )?;
        let mut next_frame = 0;
        plan.frame_is_due(row.time, &mut next_frame);
        let safety = args.safety.or(past.safety);
        Ok(Session {
            plan: plan.clone(),
            guard: Guard::new(safety.policy(), run.as_ref()),
            safety,
            scene_hash: scene_hash(&plan.scene),
            kept: Some(row.step),
            tally: Tally { warnings, ..past.tally },
            run,
            folder,
            series,
            recording: past.recording,
            logger,
            clock: Instant::now(),
            before: past.before,
            interrupted,
            begun: true,
            next_frame,
            steps: args.steps,
            json: args.json,
            profile: args.profile,
            quiet: args.quiet,
            bought: None,
        })
    }

    /// Wall time of all parts of the run, s, without the pauses between them.
    fn wall(&self) -> f64 {
        self.before.0 + self.clock.elapsed().as_secs_f64()
    }

    /// Counts of the frames of all parts of the run, and the logger's time for them, s.
    fn traffic(&self) -> (Traffic, f64) {
        let (_, frames, busy) = self.before;
        match &self.logger {
            Some(logger) => {
                let (now, spent) = logger.traffic();
                (frames.and(now), busy + spent.as_secs_f64())
            }
            None => (frames, busy),
        }
    }

    /// Syncs table and recording to disk, then writes the last good state.
    fn checkpoint(&mut self) -> Result<(), Failure> {
        if let Some(logger) = &mut self.logger
            && logger.settle().is_err()
        {
            return Err(ended_early());
        }
        let table = self.folder.join("series.csv");
        self.series.settle().map_err(|e| cannot(&table, e))?;
        self.keep_state()
    }

    /// Writes the last good state as a checkpoint.
    fn keep_state(&mut self) -> Result<(), Failure> {
        let step = self.run.row().step;
        let mut state = self.guard.good().clone();
        Past {
            tally: self.tally.clone(),
            before: (self.wall(), self.traffic().0, self.traffic().1),
            recording: self.recording.clone(),
            warnings: self.tally.warnings.clone(),
            safety: self.safety,
        }
        .save(&mut state, &self.folder);
        checkpoint::write(&self.folder, step, &state, &self.scene_hash)
            .map_err(|e| Failure::Environment(e.to_string()))?;
        self.kept = Some(step);
        Ok(())
    }

    /// Runs on a separate thread while this one shows progress; then closes all files.
    pub(super) fn go(mut self) -> Result<(), Failure> {
        let end = self.plan.clock.end * self.plan.units.time;
        let (sender, receiver) = bounded::<(u64, f64)>(1);
        let thread = std::thread::Builder::new()
            .name("simulation".into())
            .spawn(move || {
                let outcome = self.compute(|run| {
                    // The display may miss steps; it never blocks the simulation.
                    let _ = sender.try_send((run.row().step, run.row().time));
                });
                (self, outcome)
            })
            .map_err(|e| {
                Failure::Environment(format!("the simulation thread cannot be started: {e}"))
            })?;
        let bar =
            ProgressBar::with_draw_target(Some(10_000), ProgressDrawTarget::stderr_with_hz(8));
        if let Ok(style) = ProgressStyle::with_template(
            "{bar:30} {percent:>3} %  {msg}  {elapsed} of about {duration}",
        ) {
            bar.set_style(style);
        }
        for (step, time) in receiver {
            bar.set_position((1e4 * time / end) as u64);
            bar.set_message(format!("step {step}, t = {time:.3e} of {end:.3e} s"));
        }
        bar.finish_and_clear();
        match thread.join() {
            Ok((session, outcome)) => session.close(outcome),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    /// Takes the steps, then saves the last state and frame of a run that stopped early.
    fn compute(&mut self, watch: impl FnMut(&dyn Run)) -> Result<Ending, Failure> {
        let outcome = self.steps(watch);
        self.keep_the_end(&outcome);
        // A run that stops between two frames also records its last state.
        if let (Ok(Ending::StepLimit | Ending::Interrupted | Ending::BudgetSpent), Some(logger)) =
            (&outcome, &mut self.logger)
        {
            let row = self.run.row();
            let (step, time_s, wall_s) =
                (row.step, row.time, self.before.0 + self.clock.elapsed().as_secs_f64());
            let picture = Some(self.run.picture());
            let frame = Frame { step, time_s, wall_s, picture, ..Frame::default() };
            // A logger that has ended reports its error when it is closed.
            let _ = logger.send(frame);
        }
        outcome
    }

    /// Saves the last good state of a run that stopped before its end, to be examined or resumed.
    fn keep_the_end(&mut self, outcome: &Result<Ending, Failure>) {
        let wanted = match outcome {
            Ok(Ending::Finished) => false,
            Ok(_) => !self.quiet,
            Err(_) => true,
        };
        if !wanted || self.kept == Some(self.run.row().step) {
            return;
        }
        // Recording or table may have failed: then the state alone is saved.
        if let Err(e) = self.checkpoint().or_else(|_| self.keep_state())
            && let Some(e) = describe(&e)
        {
            self.note(format!("the last state is not saved: {e}"));
        }
    }

    /// Prints a warning and adds it to the summary.
    fn note(&mut self, warning: String) {
        if !self.quiet {
            tell(format_args!("warning: {warning}"));
        }
        self.tally.warnings.push(warning);
    }

    /// Takes steps until the run ends, for any reason.
    fn steps(&mut self, mut watch: impl FnMut(&dyn Run)) -> Result<Ending, Failure> {
        self.guard.begin(self.run.as_ref())?;
        if !self.begun {
            self.observe(vec![])?;
            self.begun = true;
        }
        watch(self.run.as_ref());
        while !self.run.is_finished() {
            if self.interrupted.load(Ordering::SeqCst) {
                return Ok(Ending::Interrupted);
            }
            if self.steps.is_some_and(|n| self.run.row().step >= n) {
                return Ok(Ending::StepLimit);
            }
            if self.bought.as_ref().is_some_and(|b| b.is_spent(&self.clock, self.run.row().wall)) {
                return Ok(Ending::BudgetSpent);
            }
            let clock = Instant::now();
            let faults = self.guard.step(self.run.as_mut())?;
            self.tally.around.guard += clock.elapsed().as_secs_f64() - self.run.row().wall;
            let mut events = self.run.events().to_vec();
            for fault in faults {
                self.note(fault.clone());
                events.push(fault);
            }
            self.observe(events)?;
            watch(self.run.as_ref());
            let step = self.run.row().step;
            if self.safety.checkpoint_every.is_some_and(|n| step.is_multiple_of(n)) {
                let clock = Instant::now();
                self.checkpoint()?;
                self.tally.around.writing += clock.elapsed().as_secs_f64();
            }
        }
        Ok(Ending::Finished)
    }

    /// Writes the current state to table and recording.
    fn observe(&mut self, mut notes: Vec<String>) -> Result<(), Failure> {
        let clock = Instant::now();
        let row = self.run.row().clone();
        let table = self.folder.join("series.csv");
        self.series.write(&row).map_err(|e| cannot(&table, e))?;
        self.tally.add(&row);
        if let Some(logger) = &mut self.logger {
            let due = self.plan.frame_is_due(row.time, &mut self.next_frame);
            if row.step == 0 {
                notes.extend(self.tally.warnings.iter().cloned());
            }
            let picture = due.then(|| self.run.picture());
            let wall = self.before.0 + self.clock.elapsed().as_secs_f64();
            let frame: Frame = info::frame(&self.plan, &row, wall, picture, notes);
            self.tally.around.writing += clock.elapsed().as_secs_f64();
            if logger.send(frame).is_err() {
                return Err(ended_early());
            }
        }
        Ok(())
    }

    /// Closes all files, prints the report, and keeps serving the viewer if there is one.
    fn close(mut self, outcome: Result<Ending, Failure>) -> Result<(), Failure> {
        let ended = self.end(outcome)?;
        if self.json {
            print(&ended.json)?;
        } else {
            print(&self.report(&ended.summary, ended.recorded))?;
        }
        if let (Some(served), None) = (&ended.served, &ended.failure) {
            tell(format_args!("still serving {} (Ctrl-C ends)", served.url()));
            while !self.interrupted.load(Ordering::SeqCst) {
                std::thread::sleep(std::time::Duration::from_millis(100));
            }
        }
        ended.failure.map_or(ended.plotted, Err)
    }

    /// Closes the recording, and writes plots and summary.
    fn end(&mut self, outcome: Result<Ending, Failure>) -> Result<Ended, Failure> {
        let mut served = None;
        let mut recorded = None;
        let mut fault = None;
        if let Some(logger) = self.logger.take() {
            let (result, traffic, busy) = logger.finish();
            self.tally.traffic = self.before.1.and(traffic);
            self.tally.logger_seconds = self.before.2 + busy.as_secs_f64();
            match result {
                Ok(done) => {
                    for notice in done.notices.iter().filter(|_| !self.quiet) {
                        tell(format_args!("warning: {notice}"));
                    }
                    self.tally.warnings.extend(done.notices);
                    recorded = done.saved.first().map(|s| (s.path.clone(), s.bytes));
                    served = done.served;
                }
                // This is the cause of an early end, or an error while closing.
                Err(e) => fault = Some(Failure::from(e)),
            }
        }
        self.tally.wall = self.wall();
        for w in self.run.warnings() {
            if !self.quiet {
                tell(format_args!("warning: {w}"));
            }
            self.tally.warnings.push(w.to_string());
        }
        let ending = match &outcome {
            Ok(e) => *e,
            Err(_) => Ending::Failed,
        };
        let mut summary = Summary::new(
            self.run.as_ref(),
            &self.tally,
            ending,
            self.folder.display().to_string(),
            self.recording.as_ref().map(|p| p.display().to_string()),
        );
        summary.purchase =
            self.bought.as_ref().map(|b| b.receipt(self.run.as_ref(), self.tally.wall));
        let failure = match (outcome, fault) {
            (_, Some(e)) => Some(e),
            (Err(e), None) => Some(e),
            (Ok(Ending::Interrupted), None) => Some(Failure::Interrupted),
            (Ok(_), None) => None,
        };
        summary.error = failure.as_ref().and_then(describe);
        let json = serde_json::to_string_pretty(&summary)
            .map_err(|e| Failure::Environment(e.to_string()))?;
        let path = self.folder.join("summary.json");
        std::fs::write(&path, format!("{json}\n"))
            .map_err(|e| Failure::Environment(format!("cannot write {}: {e}", path.display())))?;
        let plotted = self.plot();
        Ok(Ended { summary, json, recorded, served, failure, plotted })
    }

    /// Plots the table. Rows are read from the file, not kept in memory, so that memory does not
    /// grow with the number of steps.
    fn plot(&self) -> Result<(), Failure> {
        let rows = series::rows(&self.folder.join("series.csv"), &self.plan)
            .map_err(|e| Failure::Environment(e.to_string()))?;
        Ok(plots_of_run(&self.folder, &self.plan, &rows)?)
    }

    /// The text printed at the end of a run.
    fn report(&self, s: &Summary, recorded: Option<(PathBuf, u64)>) -> String {
        let ending = match s.ending {
            Ending::Finished => "finished",
            Ending::StepLimit => "stopped at the step limit",
            Ending::BudgetSpent => "stopped at the time budget",
            Ending::Interrupted => "interrupted",
            Ending::Failed => "failed",
        };
        let mut out = format!(
            "{} {ending}: {} steps to t = {:.4e} s in {}\n",
            s.scene,
            s.steps,
            s.time,
            duration(self.tally.wall)
        );
        for (name, g) in &s.gauges {
            out +=
                &format!("  gauge {name}: volume {:.4} m2, rate {:.4e} m2/s\n", g.volume, g.rate);
        }
        if let Some(p) = &s.purchase {
            out += &purchase::receipt_text(p);
        }
        let drift = s.volume_drift.values().map(|d| d.abs()).fold(0.0, f64::max);
        out += &format!(
            "  balances: power {:.1e}, energy {}, divergence {:.1e}, volume drift {drift:.1e}\n",
            s.balances.power_error,
            s.balances.energy_error.map_or("-".into(), |e| format!("{:.1e}", e.abs())),
            s.balances.divergence_error
        );
        if self.profile {
            for (name, seconds) in &s.seconds {
                out += &format!(
                    "  {name:<20} {seconds:>9.3} s {:>5.1} %\n",
                    100.0 * seconds / self.tally.wall
                );
            }
        }
        out += &format!("  folder: {}\n", self.folder.display());
        if let (Some(step), true) = (self.kept, s.ending != Ending::Finished) {
            let folder = self.folder.display();
            out += &format!("  state of step {step} saved: grainscope resume {folder} continues\n");
        }
        if let Some((path, bytes)) = recorded {
            out += &format!("  recording: {} ({:.1} MB)\n", path.display(), bytes as f64 / 1e6);
        }
        out
    }
}

/// The failure to write a file.
fn cannot(path: &Path, e: std::io::Error) -> Failure {
    Failure::Environment(format!("cannot write {}: {e}", path.display()))
}

/// The failure of a recording that ended before the run.
fn ended_early() -> Failure {
    Failure::Environment("the recording ended early".into())
}

/// Starts the logger of a new or resumed run. Returns it with all warnings so far.
fn start_logger(
    args: &Args,
    plan: &Plan,
    run: &dyn Run,
    (folder, recording): (&Path, Option<&Path>),
    mut warnings: Vec<String>,
) -> Result<(Option<Logger>, Vec<String>), Failure> {
    let mut sinks: Vec<Sink> = recording.map(|p| Sink::Save(p.to_path_buf())).into_iter().collect();
    if args.serve {
        sinks.push(Sink::Serve { web_port: args.port, grpc_port: 0 });
    }
    sinks.extend(args.connect.clone().map(Sink::Connect));
    sinks.extend(args.spawn.then_some(Sink::Spawn));
    let name = folder.file_name().map_or(plan.scene.name.clone(), |n| n.to_string_lossy().into());
    let step = run.row().step;
    let every = picture::thinning(plan, picture::drawn(plan, run.particles()).len());
    if every > 1 && !sinks.is_empty() && step == 0 {
        warnings.push(crate::plan::Warning::ParticlesThinned { every }.to_string());
    }
    for w in warnings.iter().filter(|_| !args.quiet) {
        tell(format_args!("warning: {w}"));
    }
    if sinks.is_empty() {
        return Ok((None, warnings));
    }
    let about = info::run_info(plan, &name);
    let mut last_step = None;
    let log = if step == 0 {
        RerunLog::open(&about, &sinks).inspect_err(|_| folder::abandon(folder))?
    } else {
        let resumed = RerunLog::resume(&about, &sinks, step)?;
        if let Some(notice) = resumed.notice {
            tell(format_args!("warning: {notice}"));
            warnings.push(notice);
        }
        last_step = resumed.last_step;
        resumed.log
    };
    if let Some(url) = log.url() {
        tell(format_args!("viewer: {url}"));
    }
    let policy = if recording.is_some() { Backpressure::Wait } else { Backpressure::DropOldest };
    let mut logger = Logger::start(log, policy)
        .map_err(|e| Failure::Environment(format!("the logger thread cannot be started: {e}")))?;
    if step > 0 && last_step != Some(step) {
        // The recording ended before this step.
        let wall = run.row().wall;
        let frame = info::frame(plan, run.row(), wall, Some(run.picture()), vec![]);
        logger.send(frame).map_err(|_| ended_early())?;
    }
    Ok((Some(logger), warnings))
}

/// The data of a checkpoint besides the state of the simulation.
struct Past {
    tally: Tally,
    /// Wall time (s), frames, and time of the logger (s).
    before: (f64, Traffic, f64),
    recording: Option<PathBuf>,
    warnings: Vec<String>,
    safety: Safety,
}

impl Past {
    fn save(&self, state: &mut State, folder: &Path) {
        save_phases("session.phases", &self.tally.phases, state);
        let (wall, traffic, busy) = self.before;
        let t = &self.tally;
        state.put_floats(
            "session.numbers",
            [
                wall,
                t.largest_power_error,
                t.largest_divergence,
                t.first_energy,
                traffic.waited.as_secs_f64(),
                busy,
                t.around.set_up,
                t.around.guard,
                t.around.writing,
            ],
        );
        state.put_counts("session.frames", [traffic.frames, traffic.drops, traffic.waits]);
        self.safety.save(state);
        if let Some(recording) = &self.recording {
            // The folder of a run may be moved, so paths inside it are saved as relative paths.
            let inside = recording.strip_prefix(folder).map(Path::to_path_buf);
            let path = inside.or_else(|_| std::path::absolute(recording));
            let path = path.unwrap_or_else(|_| recording.clone());
            state.put_bytes("session.recording", path.to_string_lossy().bytes());
        }
        state.put_bytes("session.warnings", self.warnings.join("\n").bytes());
        state.put_bytes("session.program", env!("CARGO_PKG_VERSION").bytes());
    }

    fn load(state: &State, folder: &Path) -> Result<Past, StateError> {
        let [wall, power, divergence, energy, waited, busy, set_up, guard, writing] =
            state.numbers("session.numbers")?;
        let [frames, drops, waits] = state.tally("session.frames")?;
        let waited = Duration::try_from_secs_f64(waited).unwrap_or_default();
        let traffic = Traffic { frames, drops, waits, waited };
        let recording = match state.try_bytes("session.recording") {
            Some(_) => Some(folder.join(state.text("session.recording")?)),
            None => None,
        };
        Ok(Past {
            tally: Tally {
                phases: load_phases("session.phases", state)?,
                wall,
                largest_power_error: power,
                largest_divergence: divergence,
                first_energy: energy,
                traffic,
                logger_seconds: busy,
                around: Around { set_up, guard, writing },
                warnings: vec![],
            },
            before: (wall, traffic, busy),
            recording,
            warnings: state.text("session.warnings")?.lines().map(String::from).collect(),
            safety: Safety::load(state)?,
        })
    }
}

/// The message of a failure in one line, for the summary.
pub(super) fn describe(f: &Failure) -> Option<String> {
    match f {
        Failure::Sim(e) => Some(format!("{e}; {}", SimError::remedy(e))),
        Failure::Environment(text) | Failure::Usage(text) => Some(text.clone()),
        Failure::Scene(e) => Some(e.one_line()),
        Failure::Interrupted | Failure::Differs(_) => None,
    }
}
