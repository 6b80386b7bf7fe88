//! Commands of the page that change the run, pins and saved runs.

use super::super::draft::Draft;
use super::super::knobs::{self};
use super::super::live::{ChangeEffect, Live};
use super::super::problem::Problem;
use super::super::protocol::{Answer, Mode, PinState};
use super::super::save;
use super::super::stage::{MOST_PINS, Pin};
use super::*;
use crate::plan::memory::{self, TooLarge};
use crate::scene::{SceneError, SceneSource};

impl Session {
    pub(super) fn load(&mut self, scene: &str) -> Answer {
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

    /// Starts the text of the editor as a scene.
    pub(super) fn try_text(&mut self, name: &str, text: String) -> Answer {
        self.library.look();
        let mode = self.mode_of_next();
        let source = SceneSource::new(name, text);
        match self.begin_scene(&format!("text:{name}"), source, mode) {
            Ok(()) => Answer::yes(format!("runs {name} as it is written")).restarting(),
            Err(e) => Answer::no(e.headline(), e.remedy().unwrap_or("see the errors in the text")),
        }
    }

    /// Starts a scene. If it has errors, the present run is kept.
    pub(super) fn begin_scene(
        &mut self,
        id: &str,
        source: SceneSource,
        mode: Mode,
    ) -> Result<(), SceneError> {
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
    pub(super) fn begin(
        &mut self,
        draft: Draft,
        plan: crate::plan::Plan,
        mode: Mode,
    ) -> Result<(), SceneError> {
        memory::afford(&plan).map_err(|e| {
            self.problem = Some(Problem::of_machine(e.to_string()));
            SceneError::of_key("accuracy.cells", e.to_string(), TooLarge::REMEDY)
        })?;
        let id = self.number();
        let live = Live::start(id, draft, plan, &self.status).map_err(|e| {
            self.problem = Some(Problem::of_run(&e));
            SceneError::new(e.to_string(), e.remedy())
        })?;
        self.problem = None;
        self.mode = mode;
        if let Some(old) = self.live.replace(live) {
            self.status.forget(old.id);
        }
        let Some(live) = &mut self.live else { return Ok(()) };
        live.observe(true, &self.status);
        self.status.film(live.id, &live.info, live.frames.frames());
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
    pub(super) fn examine(&mut self) {
        let Some(live) = &self.live else { return };
        self.knobs = knobs::knobs(&live.draft, &live.values);
        self.note_values();
        let Some(live) = &self.live else { return };
        self.switches = knobs::switches(&live.draft, &live.values, &self.knobs, &self.last);
        self.dial = knobs::dial(&live.draft, &live.values, self.own_cells);
    }

    pub(super) fn note_values(&mut self) {
        for knob in self.knobs.iter().filter(|k| k.value != 0.0) {
            self.last.insert(knob.key.clone(), knob.value.to_string());
        }
    }

    pub(super) fn restart(&mut self, why: &str) -> Answer {
        let Some(live) = &self.live else { return Answer::no("there is no run", "pick a scene") };
        let mode = self.mode_of_next();
        let draft = live.draft.clone();
        let begun = draft.plan().and_then(|plan| self.begin(draft, plan, mode));
        match begun {
            Ok(()) => Answer::yes(format!("restarted: {why}")).restarting(),
            Err(e) => Answer::no(e.headline(), e.remedy().unwrap_or_default()),
        }
    }

    pub(super) fn set(&mut self, key: &str, value: &str) -> Answer {
        let Some(live) = &mut self.live else { return Answer::no("there is no run", "") };
        let said = format!("{} = {}", key.trim(), value.trim());
        match live.turn(key, value) {
            Err(e) => Answer::no(e.message(), e.remedy().unwrap_or_default()),
            Ok((draft, values, ChangeEffect::Live(plan, step))) if self.mode.goes_on() => {
                live.go_on(draft, values, *plan, step);
                knobs::refresh(&mut self.knobs, &live.values);
                self.note_values();
                Answer::yes(format!("{said} takes effect with step {step}"))
            }
            Ok((draft, values, turn)) => {
                let why = match turn {
                    ChangeEffect::Restart(why) => why,
                    ChangeEffect::Live(..) => "the run had ended".into(),
                };
                let mode = self.mode_of_next();
                match self.begin(draft, values, mode) {
                    Ok(()) => Answer::yes(format!("{said}; restarted: {why}")).restarting(),
                    Err(e) => Answer::no(e.headline(), e.remedy().unwrap_or_default()),
                }
            }
        }
    }

    pub(super) fn ask(&self, key: &str, value: &str) -> Answer {
        let Some(live) = &self.live else { return Answer::no("there is no run", "") };
        match live.turn(key, value) {
            Err(e) => Answer::no(e.message(), e.remedy().unwrap_or_default()),
            Ok((_, _, ChangeEffect::Live(_, step))) if self.mode.goes_on() => {
                Answer::yes(format!("takes effect with step {step}"))
            }
            Ok((_, _, ChangeEffect::Live(..))) => Answer::yes("starts a new run").restarting(),
            Ok((_, _, ChangeEffect::Restart(why))) => {
                Answer::yes(format!("restarts: {why}")).restarting()
            }
        }
    }

    pub(super) fn pin(&mut self, name: &str) -> Answer {
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
        self.status.copy(live.id, id);
        self.status.film(id, &info, live.frames.frames());
        self.pins.push(Pin { state, info, frames: live.frames.clone() });
        self.set_stage();
        Answer::yes(format!("pinned as `{name}`; the next run is shown beside it"))
    }

    pub(super) fn unpin(&mut self, name: &str) -> Answer {
        let Some(at) = self.pins.iter().position(|p| p.state.name == name) else {
            return Answer::no(format!("there is no pin `{name}`"), "");
        };
        let pin = self.pins.remove(at);
        self.status.forget(pin.state.id);
        self.set_stage();
        Answer::yes(format!("unpinned `{name}`"))
    }

    pub(super) fn save(&mut self, name: &str) -> Answer {
        if self.mode == Mode::Running {
            // The saved state is the state shown.
            self.stand(Mode::Paused);
        }
        let Some(live) = &mut self.live else { return Answer::no("there is no run", "") };
        live.look();
        match save::keep(live, self.mode, &self.out, name.trim()) {
            Err(e) => Answer::no(e.to_string(), ""),
            Ok((folder, saved)) => {
                for (file, _) in &saved.files {
                    self.status.offer(&saved.name, file, folder.join(file));
                }
                let message = format!("saved in {}", folder.display());
                self.saved.insert(0, saved);
                self.saved.truncate(MOST_SAVED);
                Answer::yes(message)
            }
        }
    }
}
