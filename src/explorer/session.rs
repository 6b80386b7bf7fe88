//! This module implements the session: the thread that owns the run and takes commands between
//! steps.

mod commands;
mod describe;

use super::knobs::{self, Knob, Stop, Switch};
use super::library::Library;
use super::live::Live;
use super::problem::Problem;
use super::protocol::{Answer, Command, Mode, News, SavedState};
use super::stage::{Pin, Stage};
use super::status::Status;
use crate::frame::Frame;
use crate::plan::Effect;
use crate::scene::SceneSource;
use crossbeam::channel::{Receiver, RecvTimeoutError};
use indexmap::IndexMap;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// A command and the channel for its answer.
pub struct Request {
    /// The command.
    pub command: Command,
    /// Channel for the answer.
    pub reply: oneshot::Sender<Answer>,
}

/// Minimum interval of published states while running.
const PUBLISH_EVERY: Duration = Duration::from_millis(100);
/// Interval at which a paused session checks whether it is to end.
const LOOK_UP: Duration = Duration::from_millis(200);
/// Time for which a replaced recording is still served, until pages have switched.
const FAREWELL: Duration = Duration::from_secs(5);
/// Number of replaced recordings that are served at most; each has threads and memory of its own.
const MOST_RETIRED: usize = 2;
/// Exponent of the growth of the solver time with the number of unknowns.
const SOLVER_GROWTH: f64 = 1.5;
/// Number of steps after which the step time is remembered.
const SETTLED: usize = 5;
/// Maximum length of the name of a pinned run (characters).
const MAX_PIN_NAME: usize = 48;
/// Maximum number of listed saved runs.
const MOST_SAVED: usize = 50;

/// The session.
pub struct Session {
    library: Library,
    out: PathBuf,
    commands: Receiver<Request>,
    status: Arc<Status>,
    interrupted: Arc<AtomicBool>,
    mode: Mode,
    /// Id of the scene in the library.
    scene: String,
    /// Value of `accuracy.cells` in the text of the scene.
    own_cells: u32,
    live: Option<Live>,
    problem: Option<Problem>,
    knobs: Vec<Knob>,
    switches: Vec<Switch>,
    dial: Vec<Stop>,
    effects: Vec<Effect>,
    /// Last nonzero value of each knob.
    last: IndexMap<String, String>,
    /// Step time (s) of each computation so far, by its identifier.
    measured: HashMap<String, f64>,
    pins: Vec<Pin>,
    saved: Vec<SavedState>,
    news: Option<News>,
    stage: Option<Stage>,
    retired: Vec<(Instant, Stage)>,
    /// Number of the last run, pin or recording.
    count: u64,
    published: Option<Instant>,
}

impl Session {
    /// A session without a scene.
    pub fn new(
        library: Library,
        out: PathBuf,
        commands: Receiver<Request>,
        status: Arc<Status>,
        interrupted: Arc<AtomicBool>,
    ) -> Session {
        Session {
            library,
            out,
            commands,
            status,
            interrupted,
            mode: Mode::Empty,
            scene: String::new(),
            own_cells: 1,
            live: None,
            problem: None,
            knobs: vec![],
            switches: vec![],
            dial: vec![],
            effects: vec![],
            last: IndexMap::new(),
            measured: HashMap::new(),
            pins: vec![],
            saved: vec![],
            news: None,
            stage: None,
            retired: vec![],
            count: 0,
            published: None,
        }
    }

    /// Opens the first scene.
    pub fn open(&mut self, source: SceneSource, file: bool, sets: &[String], paused: bool) {
        let id = self.library.give(&source, file);
        self.library.look();
        let mode = if paused { Mode::Paused } else { Mode::Running };
        let opened = source.with_sets(sets).map(|source| self.begin_scene(&id, source, mode));
        if let Err(e) = opened {
            self.problem = Some(Problem::of_scene(source.name(), &e, &source));
        }
        self.publish();
    }

    /// Takes commands and steps until it is told to end.
    pub fn serve(&mut self) {
        while !self.interrupted.load(Ordering::SeqCst) {
            let running = self.mode == Mode::Running;
            let wait = if running { Duration::ZERO } else { LOOK_UP };
            match self.commands.recv_timeout(wait) {
                Ok(Request { command: Command::Quit {}, reply }) => {
                    // If the page is gone it needs no answer, here and below.
                    let _ = reply.send(Answer::yes("grainscope ends"));
                    self.tell(true, "grainscope has ended; this page shows its last state");
                    self.publish();
                    std::thread::sleep(LOOK_UP);
                    break;
                }
                Ok(Request { command, reply }) => {
                    let asks = matches!(command, Command::Ask { .. });
                    let silent = asks || matches!(command, Command::List {});
                    let answer = self.obey(command);
                    if !silent {
                        self.tell(answer.accepted, &answer.message);
                    }
                    if !asks {
                        self.publish();
                    }
                    let _ = reply.send(answer);
                }
                Err(RecvTimeoutError::Timeout) if running => self.advance(),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.dismiss();
        }
        if let Some(stage) = self.stage.take() {
            stage.close(&self.status);
        }
    }

    fn tell(&mut self, good: bool, text: &str) {
        let number = self.news.as_ref().map_or(1, |n| n.number + 1);
        self.news = Some(News { number, good, text: text.into() });
    }

    fn number(&mut self) -> u64 {
        self.count += 1;
        self.count
    }

    fn obey(&mut self, command: Command) -> Answer {
        match command {
            Command::Load { scene } => return self.load(&scene),
            Command::List {} => {
                self.library.look();
                return Answer::yes("the list of scenes is up to date");
            }
            Command::Try { name, text } => return self.try_text(&name, text),
            Command::Unpin { name } => return self.unpin(&name),
            Command::Quit {} => return Answer::yes("grainscope ends"),
            _ => {}
        }
        let Some(live) = &mut self.live else {
            return Answer::no(
                "there is no run",
                "pick a scene, or correct the one that has errors",
            );
        };
        let step = live.drive.run.row().step;
        match command {
            Command::Run {} if self.mode.goes_on() => {
                live.paused();
                self.mode = Mode::Running;
                Answer::yes(format!("running from step {step}"))
            }
            Command::Run {} | Command::Restart {} => self.restart("from the beginning"),
            Command::Pause {} if self.mode.goes_on() => {
                self.stand(Mode::Paused);
                Answer::yes(format!("paused at step {step}"))
            }
            Command::Stop {} if self.mode.goes_on() => {
                self.stand(Mode::Stopped);
                Answer::yes(format!("ended at step {step}; save it, pin it, or restart"))
            }
            Command::Step {} if self.mode.goes_on() => {
                self.mode = Mode::Paused;
                live.paused();
                self.advance();
                self.stand(self.mode);
                match (&self.live, self.mode) {
                    (Some(live), Mode::Paused | Mode::Finished) => {
                        Answer::yes(format!("step {}", live.drive.run.row().step))
                    }
                    _ => Answer::no("the step could not be taken", "see the error above"),
                }
            }
            Command::Pause {} | Command::Stop {} | Command::Step {} => {
                Answer::no("the run has ended", "restart it")
            }
            Command::Set { key, value } => self.set(&key, &value),
            Command::Ask { key, value } => self.ask(&key, &value),
            Command::Pin { name } => self.pin(&name),
            Command::Save { name } => self.save(&name),
            Command::Load { .. }
            | Command::List {}
            | Command::Try { .. }
            | Command::Unpin { .. }
            | Command::Quit {} => Answer::no("this was answered above", ""),
        }
    }

    /// Takes a step and shows it.
    fn advance(&mut self) {
        let Some(live) = &mut self.live else { return };
        match live.step() {
            Ok(()) => {
                let frame = live.observe(self.mode != Mode::Running, &self.status);
                if live.drive.run.is_finished() {
                    self.mode = Mode::Finished;
                    self.tell(true, "the end of the scene is reached");
                }
                self.show(&frame);
            }
            Err(e) => {
                self.mode = Mode::Failed;
                self.problem = Some(Problem::of_run(&e));
                self.tell(false, &e.to_string());
            }
        }
        self.remember();
        let lately = self.published.is_some_and(|p| p.elapsed() < PUBLISH_EVERY);
        if self.mode != Mode::Running || !lately {
            self.publish();
        }
    }

    /// Pauses or ends the run, with a picture of the present instant.
    fn stand(&mut self, mode: Mode) {
        self.mode = mode;
        let Some(live) = &mut self.live else { return };
        live.paused();
        if let Some(frame) = live.look() {
            self.show(&frame);
        }
    }

    fn show(&mut self, frame: &Arc<Frame>) {
        if let Some(live) = self.live.as_ref().filter(|_| frame.snapshot.is_some()) {
            self.status.film(live.id, &live.info, live.frames.frames());
        }
        if self.stage.as_mut().is_some_and(|stage| !stage.show(frame)) {
            self.set_stage();
        }
    }

    /// Opens a recording of the present run and pins, and retires the previous one.
    fn set_stage(&mut self) {
        let number = self.number();
        let Some(live) = self.live.as_ref().filter(|_| cfg!(feature = "viewer")) else { return };
        match Stage::open(&self.pins, live, number, &self.status) {
            Ok(stage) => {
                if let Some(old) = self.stage.replace(stage) {
                    self.retired.push((Instant::now(), old));
                    self.dismiss();
                }
            }
            Err(e) => self.problem = Some(Problem::of_machine(e.to_string())),
        }
    }

    /// Closes retired recordings.
    fn dismiss(&mut self) {
        let due = |since: &Instant| since.elapsed() > FAREWELL;
        while self.retired.len() > MOST_RETIRED
            || self.retired.first().is_some_and(|(since, _)| due(since))
        {
            // Nobody looks at it, so its errors do not matter.
            let _ = self.retired.remove(0).1.close(&self.status);
        }
    }

    fn remember(&mut self) {
        if let Some(live) = &self.live
            && live.rows.len() > SETTLED
        {
            self.measured.insert(knobs::kind(&live.drive.plan), live.usual_step());
        }
    }

    /// Mode of a run that replaces the present one.
    fn mode_of_next(&self) -> Mode {
        if self.mode == Mode::Paused { Mode::Paused } else { Mode::Running }
    }
}
