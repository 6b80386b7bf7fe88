//! This module implements the session: the thread that owns the run and takes commands between
//! steps.

use super::board::Board;
use super::draft::Draft;
use super::keep;
use super::knobs::{self, Knob, Stop, Switch};
use super::library::Library;
use super::live::{Live, Turn};
use super::problem::Problem;
use super::protocol::{
    Answer, Command, DialState, Light, Mode, News, PinState, Reading, RunState, SavedState, State,
    SwitchState,
};
use super::stage::{MOST_PINS, Pin, Stage};
use crate::frame::Frame;
use crate::plan::Effect;
use crate::scene::{SceneError, SceneSource};
use crate::sim::clock::Limiter;
use crate::sim::criteria::CRITERIA;
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
/// Exponent of the growth of the step time with the number of unknowns, between those of assembly
/// and factorisation.
const STEP_GROWTH: f64 = 1.3;
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
    board: Arc<Board>,
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
        board: Arc<Board>,
        interrupted: Arc<AtomicBool>,
    ) -> Session {
        Session {
            library,
            out,
            commands,
            board,
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
                    let answer = self.obey(command);
                    if !asks {
                        self.tell(answer.accepted, &answer.message);
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
            stage.close();
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
            Command::Load { .. } | Command::Unpin { .. } | Command::Quit {} => {
                Answer::no("this was answered above", "")
            }
        }
    }

    /// Takes a step and shows it.
    fn advance(&mut self) {
        let Some(live) = &mut self.live else { return };
        match live.step() {
            Ok(()) => {
                let frame = live.observe(self.mode != Mode::Running, &self.board);
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
        if let Some(live) = self.live.as_ref().filter(|_| frame.picture.is_some()) {
            self.board.sketch(&live.info, frame.clone());
        }
        if self.stage.as_mut().is_some_and(|stage| !stage.show(frame)) {
            self.set_stage();
        }
    }

    /// Opens a recording of the present run and pins, and retires the previous one.
    fn set_stage(&mut self) {
        let number = self.number();
        let Some(live) = &self.live else { return };
        match Stage::open(&self.pins, live, number) {
            Ok(stage) => {
                if let Some(old) = self.stage.replace(stage) {
                    self.retired.push((Instant::now(), old));
                }
            }
            Err(e) => self.problem = Some(Problem::of_machine(e.to_string())),
        }
    }

    /// Closes retired recordings.
    fn dismiss(&mut self) {
        let due = |since: &Instant| since.elapsed() > FAREWELL;
        while self.retired.first().is_some_and(|(since, _)| due(since)) {
            // Nobody looks at it, so its errors do not matter.
            let _ = self.retired.remove(0).1.close();
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

    fn load(&mut self, scene: &str) -> Answer {
        self.library.look();
        let mode = self.mode_of_next();
        let refused = |e: &SceneError| {
            Answer::no(e.headline(), e.remedy().unwrap_or("see the error messages above"))
        };
        match self.library.find(scene) {
            Ok(source) => match self.begin_scene(scene, source.clone(), mode) {
                Ok(()) => Answer::yes(format!("opened {}", source.name())).restarting(),
                Err(e) => refused(&e),
            },
            Err(e) => {
                let source = SceneSource::new(scene, "");
                self.problem = Some(Problem::of_scene(scene, &e, &source));
                refused(&e)
            }
        }
    }

    /// Starts a scene. If it has errors, the present run is kept.
    fn begin_scene(&mut self, id: &str, source: SceneSource, mode: Mode) -> Result<(), SceneError> {
        let draft = Draft::new(source.clone());
        let plan = match draft.plan() {
            Ok(plan) => plan,
            Err(e) => {
                let problem = Problem::of_scene(source.name(), &e, &source);
                self.problem = Some(Problem { scene: Some(id.into()), ..problem });
                return Err(e.with_source(&source));
            }
        };
        self.own_cells = plan.scene.accuracy.cells;
        self.scene = id.into();
        self.last.clear();
        self.begin(draft, plan, mode)
    }

    /// Starts a run that replaces the present one.
    fn begin(
        &mut self,
        draft: Draft,
        plan: crate::plan::Plan,
        mode: Mode,
    ) -> Result<(), SceneError> {
        let id = self.number();
        let live = Live::start(id, draft, plan, &self.board).map_err(|e| {
            self.problem = Some(Problem::of_run(&e));
            SceneError::new(e.to_string(), e.remedy())
        })?;
        self.problem = None;
        self.mode = mode;
        if let Some(old) = self.live.replace(live) {
            self.board.forget(old.id);
        }
        let Some(live) = &mut self.live else { return Ok(()) };
        let frame = live.observe(true, &self.board);
        self.board.sketch(&live.info, frame);
        // The first picture is shown before the knobs are examined.
        self.knobs.clear();
        self.switches.clear();
        self.dial.clear();
        self.effects = live.drive.plan.describe().effects;
        self.set_stage();
        self.publish();
        self.examine();
        Ok(())
    }

    /// Determines the effects of the knobs.
    fn examine(&mut self) {
        let Some(live) = &self.live else { return };
        self.knobs = knobs::knobs(&live.draft, &live.values);
        self.note_values();
        let Some(live) = &self.live else { return };
        self.switches = knobs::switches(&live.draft, &live.values, &self.knobs, &self.last);
        self.dial = knobs::dial(&live.draft, &live.values, self.own_cells);
    }

    fn note_values(&mut self) {
        for knob in self.knobs.iter().filter(|k| k.value != 0.0) {
            self.last.insert(knob.key.clone(), knob.value.to_string());
        }
    }

    fn restart(&mut self, why: &str) -> Answer {
        let Some(live) = &self.live else { return Answer::no("there is no run", "pick a scene") };
        let mode = self.mode_of_next();
        let draft = live.draft.clone();
        let begun = draft.plan().and_then(|plan| self.begin(draft, plan, mode));
        match begun {
            Ok(()) => Answer::yes(format!("restarted: {why}")).restarting(),
            Err(e) => Answer::no(e.headline(), e.remedy().unwrap_or_default()),
        }
    }

    fn set(&mut self, key: &str, value: &str) -> Answer {
        let Some(live) = &mut self.live else { return Answer::no("there is no run", "") };
        let said = format!("{} = {}", key.trim(), value.trim());
        match live.turn(key, value) {
            Err(e) => Answer::no(e.message(), e.remedy().unwrap_or_default()),
            Ok((draft, values, Turn::Live(plan, step))) if self.mode.goes_on() => {
                live.go_on(draft, values, *plan, step);
                knobs::refresh(&mut self.knobs, &live.values);
                self.note_values();
                Answer::yes(format!("{said} takes effect with step {step}"))
            }
            Ok((draft, values, turn)) => {
                let why = match turn {
                    Turn::Restart(why) => why,
                    Turn::Live(..) => "the run had ended".into(),
                };
                let mode = self.mode_of_next();
                match self.begin(draft, values, mode) {
                    Ok(()) => Answer::yes(format!("{said}; restarted: {why}")).restarting(),
                    Err(e) => Answer::no(e.headline(), e.remedy().unwrap_or_default()),
                }
            }
        }
    }

    fn ask(&self, key: &str, value: &str) -> Answer {
        let Some(live) = &self.live else { return Answer::no("there is no run", "") };
        match live.turn(key, value) {
            Err(e) => Answer::no(e.message(), e.remedy().unwrap_or_default()),
            Ok((_, _, Turn::Live(_, step))) if self.mode.goes_on() => {
                Answer::yes(format!("takes effect with step {step}"))
            }
            Ok((_, _, Turn::Live(..))) => Answer::yes("starts a new run").restarting(),
            Ok((_, _, Turn::Restart(why))) => Answer::yes(format!("restarts: {why}")).restarting(),
        }
    }

    fn pin(&mut self, name: &str) -> Answer {
        let name: String = name.trim().chars().filter(|c| !c.is_control()).collect();
        if name.is_empty() || name.chars().count() > MAX_PIN_NAME {
            return Answer::no("a pin needs a name", "give it 1 to 48 letters");
        }
        if self.pins.iter().any(|p| p.state.name == name) {
            return Answer::no(format!("there is a pin `{name}` already"), "choose another name");
        }
        if self.pins.len() == MOST_PINS {
            return Answer::no(
                format!("{MOST_PINS} runs are pinned already"),
                "unpin one: each keeps its pictures in memory",
            );
        }
        let id = self.number();
        let Some(live) = &mut self.live else { return Answer::no("there is no run", "") };
        live.look();
        let mut info = live.info.clone();
        info.name = name.clone();
        let row = live.drive.run.row();
        let values = live.draft.summary();
        let state = PinState {
            name: name.clone(),
            id,
            points: live.rows.len(),
            steps: row.step,
            time: row.time,
            values,
        };
        self.board.copy(live.id, id);
        self.pins.push(Pin { state, info, film: live.film.clone() });
        self.set_stage();
        Answer::yes(format!("pinned as `{name}`; the next run is shown beside it"))
    }

    fn unpin(&mut self, name: &str) -> Answer {
        let Some(at) = self.pins.iter().position(|p| p.state.name == name) else {
            return Answer::no(format!("there is no pin `{name}`"), "");
        };
        let pin = self.pins.remove(at);
        self.board.forget(pin.state.id);
        self.set_stage();
        Answer::yes(format!("unpinned `{name}`"))
    }

    fn save(&mut self, name: &str) -> Answer {
        if self.mode == Mode::Running {
            // The saved state is the state shown.
            self.stand(Mode::Paused);
        }
        let Some(live) = &mut self.live else { return Answer::no("there is no run", "") };
        live.look();
        match keep::keep(live, self.mode, &self.out, name.trim()) {
            Err(e) => Answer::no(e.to_string(), ""),
            Ok((folder, saved)) => {
                for (file, _) in &saved.files {
                    self.board.offer(&saved.name, file, folder.join(file));
                }
                let message = format!("saved in {}", folder.display());
                self.saved.insert(0, saved);
                self.saved.truncate(MOST_SAVED);
                Answer::yes(message)
            }
        }
    }

    fn publish(&mut self) {
        self.published = Some(Instant::now());
        let (title, description) = self.live.as_ref().map_or(("", ""), |l| {
            (l.drive.plan.scene.name.as_str(), l.drive.plan.scene.description.as_str())
        });
        let mut warnings = vec![];
        if let Some(live) = &self.live {
            warnings.extend(live.values.warnings.iter().map(ToString::to_string));
            warnings.extend(live.drive.run.warnings().iter().map(ToString::to_string));
        }
        let state = State {
            mode: self.mode,
            scene: &self.scene,
            title,
            description,
            problem: self.problem.as_ref(),
            run: self.live.as_ref().map(run_state),
            knobs: &self.knobs,
            switches: self.switches.iter().map(|s| self.switch_state(s)).collect(),
            dial: self.dial.iter().map(|s| self.dial_state(s)).collect(),
            effects: &self.effects,
            warnings,
            pins: self.pins.iter().map(|p| p.state.clone()).collect(),
            saved: self.saved.clone(),
            scenes: self.library.entries(),
            folder: self.library.folder().display().to_string(),
            out: self.out.display().to_string(),
            stream: self.stage.as_ref().map(|s| s.stream.clone()),
            news: self.news.clone(),
        };
        match serde_json::to_string(&state) {
            Ok(text) => self.board.publish(text),
            Err(e) => eprintln!("warning: the state cannot be sent to the page: {e}"),
        }
    }

    fn switch_state(&self, s: &Switch) -> SwitchState {
        let measured = s.kinds.each_ref().map(|kind| self.measured.get(kind).copied());
        let cost = match (measured, &self.live) {
            ([Some(with), Some(without)], _) => {
                let percent = 100.0 * (1.0 - without / with);
                format!(
                    "{percent:.0} % of a step, measured: {} with, {} without",
                    milliseconds(with),
                    milliseconds(without)
                )
            }
            (_, Some(live)) if s.unknowns[0] > s.unknowns[1] => {
                let phases = live.phases();
                let solver = phases.assemble + phases.factor + phases.solve;
                let less = (s.unknowns[1] as f64 / s.unknowns[0] as f64).powf(SOLVER_GROWTH);
                // Solver time of a step with the effect, whether or not it is solved now.
                let with = if s.on { solver } else { solver / less };
                let share = with * (1.0 - less) / (phases.total() - solver + with);
                format!("about {:.0} % of a step, by its unknowns", 100.0 * share)
            }
            _ => "no unknowns of its own".into(),
        };
        SwitchState { effect: s.effect, key: s.key.clone(), on: s.on, other: s.other.clone(), cost }
    }

    fn dial_state(&self, s: &Stop) -> DialState {
        let live = self.live.as_ref();
        let cells = live.map(|l| l.values.scene.accuracy.cells);
        let guess = || {
            let live = live.filter(|l| l.rows.len() > 1)?;
            let ratio = s.unknowns as f64 / knobs::unknowns(&live.drive.plan) as f64;
            Some(live.usual_step() * ratio.powf(STEP_GROWTH))
        };
        DialState {
            cells: s.cells,
            current: cells == Some(s.cells),
            unknowns: s.unknowns,
            seconds_per_step: self.measured.get(&s.kind).copied().or_else(guess),
            error: s.error,
        }
    }
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.0} ms", 1e3 * seconds)
}

fn run_state(live: &Live) -> RunState {
    let row = live.drive.run.row();
    let plan = &live.drive.plan;
    let sum = live.phases();
    let total = sum.total().max(f64::MIN_POSITIVE);
    let mut readings: Vec<Reading> = vec![];
    for (gauge, now) in plan.gauges.iter().zip(&row.gauges) {
        let name = |what: &str| format!("{} {what}", gauge.name);
        readings.push(Reading { name: name("rate"), value: now.rate, unit: "m²/s" });
        readings.push(Reading { name: name("volume"), value: now.volume, unit: "m²" });
    }
    if let Some(value) = row.mean_alignment {
        readings.push(Reading { name: "mean |n_x|".into(), value, unit: "" });
    }
    readings.push(Reading { name: "largest speed".into(), value: row.max_speed, unit: "m/s" });
    RunState {
        id: live.id,
        points: live.rows.len(),
        step: row.step,
        time: row.time,
        end: plan.clock.end * plan.units.time,
        dt: row.dt,
        limiter: row.dt_limiter.name(),
        limited_by: limited_by(row.dt_limiter),
        steps_per_second: live.steps_per_second(),
        seconds_per_step: live.usual_step(),
        particles: row.particles,
        cells: [plan.mesh.x.cells(), plan.mesh.y.cells()],
        unknowns: knobs::unknowns(plan),
        lights: lights(live),
        readings,
        phases: sum.list().map(|(name, s)| (name, s / total)).to_vec(),
        changes: live.changes.clone(),
    }
}

/// Diagnostics with the bounds of the stress tests.
fn lights(live: &Live) -> Vec<Light> {
    let row = live.drive.run.row();
    let drift = row.drift.iter().map(|d| d.abs()).fold(0.0, f64::max);
    let light = |name, value: f64, bound: f64, meaning| Light {
        name,
        value,
        bound,
        // False for NaN.
        good: value <= bound,
        meaning,
    };
    // The divergence error grows with the tolerance of the solver.
    let divergence = CRITERIA.divergence.max(10.0 * live.drive.plan.method.tolerance);
    vec![
        light(
            "power balance",
            row.power_error,
            CRITERIA.power,
            "relative difference of the power of all loads and the dissipation",
        ),
        light(
            "divergence",
            row.divergence_error,
            divergence,
            "divergence of the flow relative to its strain rate",
        ),
        light(
            "volume error",
            drift,
            CRITERIA.drift,
            "largest relative change of a material's projected area since the start",
        ),
        light(
            "corrections",
            f64::from(row.iterations),
            CRITERIA.corrections,
            "corrections of the solver in this step",
        ),
    ]
}

fn limited_by(limiter: Limiter) -> &'static str {
    match limiter {
        Limiter::Start => "no step was taken yet",
        Limiter::Courant => "cells crossed per step",
        Limiter::Strain => "strain of the layers",
        Limiter::MaxStep => "time.max_step",
        Limiter::Relaxation => "relaxation of the strata",
        Limiter::Growth => "growth of the step",
        Limiter::Stop => "the next frame or change",
        Limiter::Guard => "a longer step that failed",
    }
}
