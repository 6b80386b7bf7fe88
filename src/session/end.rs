//! This module ends a session: it closes the recording and writes the plots and the summary.

use super::error::SessionError;
use super::files::Session;
use super::interrupts::{Interrupted, progress_bar, tell};
use crate::record::rerun_log::Served;
use crate::record::run_plots::plots_of_run;
use crate::record::series;
use crate::record::summary::{Ending, Summary};
use crate::sim::Run;
use crossbeam::channel::bounded;
use std::path::PathBuf;

/// Results of a session after all files are closed.
pub struct Ended {
    /// The summary.
    pub summary: Summary,
    /// The summary as written to `summary.json`.
    pub json: String,
    /// Path and size (bytes) of the recording.
    pub recorded: Option<(PathBuf, u64)>,
    /// The viewer that this process serves.
    pub served: Option<Served>,
    /// The error or interrupt that ended the run, if any.
    pub failure: Option<SessionError>,
    /// Outcome of writing the plots.
    pub plotted: Result<(), SessionError>,
    /// Step of the last checkpoint.
    pub kept: Option<u64>,
    /// Wall time of the whole run (s).
    pub wall: f64,
    /// Flag that an interrupt sets.
    pub interrupted: Interrupted,
}

impl Session {
    /// Runs on a separate thread while this thread shows the progress; then closes all files.
    ///
    /// # Errors
    /// The thread cannot be started, or the summary cannot be written.
    pub fn go(mut self) -> Result<Ended, SessionError> {
        let end = self.drive.plan.clock.end * self.drive.plan.units.time;
        let (sender, receiver) = bounded::<(u64, f64)>(1);
        let thread = std::thread::Builder::new()
            .name("simulation".into())
            .spawn(move || {
                let outcome = self.compute(|run| {
                    // The display may miss steps; it never delays the simulation.
                    let _ = sender.try_send((run.row().step, run.row().time));
                });
                (self, outcome)
            })
            .map_err(|e| {
                SessionError::Environment(format!("the simulation thread cannot be started: {e}"))
            })?;
        let bar = progress_bar(10_000, true);
        for (step, time) in receiver {
            bar.set_position((1e4 * time / end) as u64);
            bar.set_message(format!("step {step}, t = {time:.3e} of {end:.3e} s"));
        }
        bar.finish_and_clear();
        match thread.join() {
            Ok((session, outcome)) => session.end(outcome),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }

    /// Runs on this thread, then closes all files. `watch` is called at the start and after every
    /// step.
    ///
    /// # Errors
    /// The run failed, or a file could not be written.
    pub fn go_silently(mut self, watch: impl FnMut(&dyn Run)) -> Result<Summary, SessionError> {
        let outcome = self.compute(watch);
        let ended = self.end(outcome)?;
        ended.plotted?;
        ended.failure.map_or(Ok(ended.summary), Err)
    }

    /// Closes the recording and writes the plots and the summary.
    fn end(mut self, outcome: Result<Ending, SessionError>) -> Result<Ended, SessionError> {
        let mut served = None;
        let mut recorded = None;
        let mut fault = None;
        if let Some(logger) = self.logger.take() {
            let (result, traffic, busy) = logger.finish();
            self.drive.tally.traffic = self.before.1.and(traffic);
            self.drive.tally.logger_seconds = self.before.2 + busy.as_secs_f64();
            match result {
                Ok(done) => {
                    for notice in done.notices.iter().filter(|_| !self.quiet) {
                        tell(format_args!("warning: {notice}"));
                    }
                    self.drive.tally.warnings.extend(done.notices);
                    recorded = done.saved.first().map(|s| (s.path.clone(), s.bytes));
                    served = done.served;
                }
                // The cause of an early end, or an error at the very end.
                Err(e) => fault = Some(SessionError::from(e)),
            }
        }
        self.drive.tally.wall = self.wall();
        for w in self.drive.run.warnings().iter().map(ToString::to_string) {
            // Those of the initial state were told at the start.
            if self.drive.tally.warnings.contains(&w) {
                continue;
            }
            if !self.quiet {
                tell(format_args!("warning: {w}"));
            }
            self.drive.tally.warnings.push(w);
        }
        let ending = match &outcome {
            Ok(e) => *e,
            Err(_) => Ending::Failed,
        };
        let (run, tally) = (self.drive.run.as_ref(), &self.drive.tally);
        let mut summary = Summary::new(
            run,
            tally,
            ending,
            self.folder.path().display().to_string(),
            self.recording.as_ref().map(|p| p.display().to_string()),
        );
        summary.purchase = self.budget.as_ref().map(|b| b.receipt(run, tally.wall));
        let failure = match (outcome, fault) {
            (_, Some(e)) => Some(e),
            (Err(e), None) => Some(e),
            (Ok(Ending::Interrupted), None) => Some(SessionError::Interrupted),
            (Ok(_), None) => None,
        };
        if let Some(w) = summary.energy_warning(self.drive.plan.method.quadrature) {
            if !self.quiet {
                tell(format_args!("warning: {w}"));
            }
            summary.warnings.push(w);
        }
        summary.error = failure.as_ref().and_then(SessionError::describe);
        // Of a run that a fault of the machine has ended, only a checkpoint is worth more than the
        // earlier run that it was to replace.
        let fault = matches!(failure, Some(SessionError::Environment(_)));
        let restore = fault && self.folder.replaces() && self.kept.is_none_or(|step| step == 0);
        let written = summary.write(self.folder.path()).map_err(SessionError::Environment);
        let plotted = if written.is_ok() { self.plot() } else { Ok(()) };
        if restore {
            tell("what this run was to replace is left as it was");
        } else if let Some(place) = self.folder.settle(!fault && written.is_ok()) {
            tell(format_args!("the earlier run is kept in {}", place.display()));
        }
        let json = written?;
        let (kept, wall, interrupted) = (self.kept, tally.wall, self.interrupted);
        Ok(Ended { summary, json, recorded, served, failure, plotted, kept, wall, interrupted })
    }

    /// Plots the table. Rows are read from the file and not kept during the run, so memory use does
    /// not grow with the number of steps.
    fn plot(&self) -> Result<(), SessionError> {
        let plan = &self.drive.plan;
        let rows = series::rows(&self.folder.path().join("series.csv"), plan)
            .map_err(|e| SessionError::Environment(e.to_string()))?;
        Ok(plots_of_run(self.folder.path(), plan, &rows)?)
    }
}
