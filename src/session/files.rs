//! This module runs a plan and writes its series, recording and checkpoints.

use super::drive::{self, Drive};
use super::error::SessionError;
use super::interrupts::{Interrupted, tell};
use super::options::{Options, Recording, Safety};
use super::past::{self, Past};
use crate::plan::Plan;
use crate::record::checkpoint;
use crate::record::folder::{self, RunFolder};
use crate::record::info;
use crate::record::logger::{Backpressure, Logger, Traffic};
use crate::record::rerun_log::{RerunLog, Sink};
use crate::record::series::SeriesWriter;
use crate::record::summary::{Ending, Purchase, Tally};
use crate::scene::{scene_hash, to_toml};
use crate::sim::state::{State, StateError};
use crate::sim::{self, Run};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// A limit on the wall time of a run.
pub trait Budget: Send {
    /// Whether a further step, as long as the last one (s), would exceed the budget.
    fn is_spent(&self, clock: &Instant, last_step: f64) -> bool;
    /// The expected and the actual cost of the run. `wall`: wall time of the run, s.
    fn receipt(&self, run: &dyn Run, wall: f64) -> Purchase;
}

/// A run with all its output files.
pub struct Session {
    pub(super) drive: Drive,
    pub(super) folder: RunFolder,
    pub(super) series: SeriesWriter,
    /// Path of the recording, if any.
    pub(super) recording: Option<PathBuf>,
    pub(super) logger: Option<Logger>,
    /// Start time of this part of the run.
    clock: Instant,
    /// Totals of the earlier parts of the run: wall time (s), frames, and time of the logger (s).
    pub(super) before: (f64, Traffic, f64),
    safety: Safety,
    scene_hash: String,
    /// Step of the last checkpoint.
    pub(super) kept: Option<u64>,
    /// Flag that an interrupt sets.
    pub(super) interrupted: Interrupted,
    /// Whether the initial state has been written.
    begun: bool,
    /// Largest number of steps.
    steps: Option<u64>,
    pub(super) quiet: bool,
    /// Limit on the wall time, if any.
    pub(super) budget: Option<Box<dyn Budget>>,
}

impl Session {
    /// Starts the run of a plan in the folder that `prepare` creates. The simulation starts before
    /// the folder is created, so a scene that cannot start leaves no folder.
    ///
    /// # Errors
    /// The simulation, the folder or a viewer cannot be started.
    pub fn start<E: From<SessionError>>(
        options: &Options,
        plan: &Arc<Plan>,
        interrupted: Interrupted,
        prepare: impl FnOnce() -> Result<RunFolder, E>,
    ) -> Result<Session, E> {
        let clock = Instant::now();
        let run = sim::start(plan.clone()).map_err(SessionError::from)?;
        Ok(Session::open(options, plan, run, prepare()?, clock, interrupted)?)
    }

    fn open(
        options: &Options,
        plan: &Arc<Plan>,
        run: Box<dyn Run>,
        mut claimed: RunFolder,
        clock: Instant,
        interrupted: Interrupted,
    ) -> Result<Session, SessionError> {
        let folder = claimed.path().to_owned();
        let recording = match &options.recording {
            Recording::None => None,
            Recording::Folder => Some(folder.join("recording.rrd")),
            Recording::File(path) => {
                claimed.set_aside(path)?;
                Some(path.clone())
            }
        };
        let (logger, warnings) = start_logger(
            options,
            plan,
            run.as_ref(),
            (&folder, recording.as_deref()),
            drive::warnings_at_start(plan, run.as_ref()),
            &interrupted,
        )?;
        if !claimed.has_own_scene() {
            let path = folder.join(folder::SCENE);
            std::fs::write(&path, to_toml(&plan.scene)).map_err(|e| cannot(&path, e))?;
        }
        let series_file = folder.join("series.csv");
        let series =
            SeriesWriter::create(&series_file, plan).map_err(|e| cannot(&series_file, e))?;
        claimed.begin();
        let mut tally = Tally::new(warnings);
        tally.around.set_up = clock.elapsed().as_secs_f64() - run.row().seconds.total();
        Ok(Session {
            scene_hash: scene_hash(&plan.scene),
            drive: Drive::new(plan.clone(), run, options.safety.policy(), tally),
            safety: options.safety,
            kept: None,
            folder: claimed,
            series,
            recording,
            logger,
            clock,
            before: (0.0, Traffic::default(), 0.0),
            interrupted,
            begun: false,
            steps: options.steps,
            quiet: options.quiet,
            budget: None,
        })
    }

    /// Resumes the run of a folder from a state. The table and the recording continue after the
    /// step of the state; they are changed only when nothing else can fail.
    ///
    /// # Errors
    /// The state does not fit the plan or the table ([`SessionError::Unfit`]), or a file or viewer
    /// is not available.
    pub fn reopen(
        options: &Options,
        plan: &Arc<Plan>,
        claimed: &mut Option<RunFolder>,
        state: &State,
        interrupted: Interrupted,
    ) -> Result<Session, SessionError> {
        let unfit = |e: StateError| SessionError::Unfit(e.to_string());
        let folder = match claimed {
            Some(folder) => folder.path().to_owned(),
            None => return Err(SessionError::Environment("the folder is not claimed".into())),
        };
        let mut run = sim::start(plan.clone())?;
        run.restore(state).map_err(unfit)?;
        let row = run.row().clone();
        let mut past = Past::load(state, &folder).map_err(unfit)?;
        past.warnings.extend(past.made_otherwise());
        let path = folder.join("series.csv");
        let mut series = SeriesWriter::resume(&path, plan, &row)?;
        let (logger, warnings) = start_logger(
            options,
            plan,
            run.as_ref(),
            (&folder, past.recording.as_deref()),
            past.warnings,
            &interrupted,
        )?;
        series.cut(&row).map_err(|e| cannot(&path, e))?;
        let folder = claimed
            .take()
            .ok_or_else(|| SessionError::Environment("the folder is not claimed".into()))?;
        let safety = options.safety.or(past.safety);
        let tally = Tally { warnings, ..past.tally };
        Ok(Session {
            scene_hash: scene_hash(&plan.scene),
            drive: Drive::new(plan.clone(), run, safety.policy(), tally),
            safety,
            kept: Some(row.step),
            folder,
            series,
            recording: past.recording,
            logger,
            clock: Instant::now(),
            before: past.before,
            interrupted,
            begun: true,
            steps: options.steps,
            quiet: options.quiet,
            budget: None,
        })
    }

    /// Sets the limit on the wall time of the run.
    pub fn with_budget(self, budget: Option<Box<dyn Budget>>) -> Session {
        Session { budget, ..self }
    }

    /// Wall time of the run without the pauses between its parts, s.
    pub(super) fn wall(&self) -> f64 {
        self.before.0 + self.clock.elapsed().as_secs_f64()
    }

    /// Frame counts of the whole run, and the time of the logger (s).
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

    /// Flushes table and recording to the disk, then writes the last valid state.
    fn checkpoint(&mut self) -> Result<(), SessionError> {
        if let Some(logger) = &mut self.logger
            && logger.settle().is_err()
        {
            return Err(ended_early());
        }
        let table = self.folder.path().join("series.csv");
        self.series.settle().map_err(|e| cannot(&table, e))?;
        self.keep_state()
    }

    /// Writes the last valid state as a checkpoint.
    fn keep_state(&mut self) -> Result<(), SessionError> {
        let step = self.drive.run.row().step;
        let mut state = self.drive.good().clone();
        Past {
            tally: self.drive.tally.clone(),
            before: (self.wall(), self.traffic().0, self.traffic().1),
            recording: self.recording.clone(),
            warnings: self.drive.tally.warnings.clone(),
            safety: self.safety,
            made_by: past::this_program(),
        }
        .save(&mut state, self.folder.path());
        checkpoint::write(self.folder.path(), step, &state, &self.scene_hash)
            .map_err(|e| SessionError::Environment(e.to_string()))?;
        self.kept = Some(step);
        Ok(())
    }

    /// Takes all steps, and records the final state. `watch` is called at the start and after every
    /// step.
    pub(super) fn compute(&mut self, watch: impl FnMut(&dyn Run)) -> Result<Ending, SessionError> {
        let outcome = self.steps(watch);
        self.keep_the_end(&outcome);
        // A run that ends between two frames still shows where it ended.
        if let (Ok(Ending::StepLimit | Ending::Interrupted | Ending::BudgetSpent), true) =
            (&outcome, self.logger.is_some())
        {
            let run = self.drive.run.as_ref();
            let frame = drive::snapshot_alone(run, self.wall(), run.snapshot());
            if let Some(logger) = &mut self.logger {
                // If the logger has ended, closing it returns the cause.
                let _ = logger.send(frame);
            }
        }
        outcome
    }

    /// Writes the last valid state of a run that stops before its end time, for
    /// `grainscope resume`.
    fn keep_the_end(&mut self, outcome: &Result<Ending, SessionError>) {
        let wanted = match outcome {
            Ok(Ending::Finished) => false,
            Ok(_) => !self.quiet,
            Err(_) => true,
        };
        if !wanted || self.kept == Some(self.drive.run.row().step) {
            return;
        }
        // The recording or the table may be what failed; the state alone is still useful.
        if let Err(e) = self.checkpoint().or_else(|_| self.keep_state())
            && let Some(e) = e.describe()
        {
            self.note(format!("the last state could not be saved: {e}"));
        }
    }

    /// Prints a warning and adds it to the summary.
    fn note(&mut self, warning: String) {
        if !self.quiet {
            tell(format_args!("warning: {warning}"));
        }
        self.drive.tally.warnings.push(warning);
    }

    fn steps(&mut self, mut watch: impl FnMut(&dyn Run)) -> Result<Ending, SessionError> {
        self.drive.begin()?;
        if !self.begun {
            self.observe(vec![])?;
            self.begun = true;
        }
        watch(self.drive.run.as_ref());
        while !self.drive.run.is_finished() {
            if self.interrupted.load(Ordering::SeqCst) {
                return Ok(Ending::Interrupted);
            }
            let (step, last) = (self.drive.run.row().step, self.drive.run.row().wall);
            if self.steps.is_some_and(|n| step >= n) {
                return Ok(Ending::StepLimit);
            }
            if self.budget.as_ref().is_some_and(|b| b.is_spent(&self.clock, last)) {
                return Ok(Ending::BudgetSpent);
            }
            let faults = self.drive.step()?;
            let mut events = self.drive.run.events().to_vec();
            for fault in faults {
                self.note(fault.clone());
                events.push(fault);
            }
            self.observe(events)?;
            watch(self.drive.run.as_ref());
            let step = self.drive.run.row().step;
            if self.safety.checkpoint_every.is_some_and(|n| step.is_multiple_of(n)) {
                let clock = Instant::now();
                self.checkpoint()?;
                self.drive.tally.around.writing += clock.elapsed().as_secs_f64();
            }
        }
        Ok(Ending::Finished)
    }

    /// Writes the current row to the table, and a frame to the recording.
    fn observe(&mut self, notes: Vec<String>) -> Result<(), SessionError> {
        let clock = Instant::now();
        let table = self.folder.path().join("series.csv");
        let row = self.drive.run.row();
        self.series.write(row).map_err(|e| cannot(&table, e))?;
        self.drive.tally.add(row);
        if self.logger.is_none() {
            return Ok(());
        }
        let due = self.drive.frame_is_due();
        let snapshot = due.then(|| self.drive.run.snapshot());
        let frame = self.drive.frame(self.wall(), snapshot, notes);
        self.drive.tally.around.writing += clock.elapsed().as_secs_f64();
        let sent = self.logger.as_mut().map(|logger| logger.send(frame));
        if let Some(Err(_)) = sent { Err(ended_early()) } else { Ok(()) }
    }
}

fn cannot(path: &Path, e: std::io::Error) -> SessionError {
    SessionError::Environment(format!("cannot write {}: {e}", path.display()))
}

fn ended_early() -> SessionError {
    SessionError::Environment("the recording ended early".into())
}

/// Starts the logger of a run at its current step. Returns the logger, if any, and the warnings so
/// far.
fn start_logger(
    options: &Options,
    plan: &Plan,
    run: &dyn Run,
    (folder, recording): (&Path, Option<&Path>),
    mut warnings: Vec<String>,
    interrupted: &Interrupted,
) -> Result<(Option<Logger>, Vec<String>), SessionError> {
    let mut sinks: Vec<Sink> = recording.map(|p| Sink::Save(p.to_path_buf())).into_iter().collect();
    sinks.extend(options.viewers.iter().cloned());
    let name = folder.file_name().map_or(plan.scene.name.clone(), |n| n.to_string_lossy().into());
    let step = run.row().step;
    if !sinks.is_empty() && step == 0 {
        warnings.extend(drive::thinned(plan, run));
    }
    for w in warnings.iter().filter(|_| !options.quiet) {
        tell(format_args!("warning: {w}"));
    }
    if sinks.is_empty() {
        return Ok((None, warnings));
    }
    let about = info::run_info(plan, &name);
    let mut last_step = None;
    let log = if step == 0 {
        RerunLog::open(&about, &sinks)?
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
    let mut logger = Logger::start(log, policy, interrupted.clone()).map_err(|e| {
        SessionError::Environment(format!("the logger thread cannot be started: {e}"))
    })?;
    if step > 0 && last_step != Some(step) {
        // The recording does not contain this step.
        let wall = run.row().wall;
        let frame = info::frame(plan, run.row(), wall, Some(run.snapshot()), vec![]);
        logger.send(frame).map_err(|_| ended_early())?;
    }
    Ok((Some(logger), warnings))
}
