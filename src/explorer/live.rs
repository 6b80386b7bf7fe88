//! This module holds the run of the explorer with its frames, rows and changes.

use super::draft::{Draft, quantity};
use super::frame_buffer::FrameBuffer;
use super::protocol::Change;
use super::status::{self, Status};
use crate::frame::{Frame, RunInfo};
use crate::plan::{Plan, When};
use crate::record::info;
use crate::record::summary::Tally;
use crate::scene::SceneError;
use crate::session::{self, Drive};
use crate::sim::guard::Policy;
use crate::sim::phases::Phases;
use crate::sim::row::Row;
use crate::sim::{self, SimError};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Minimum interval of pictures while running.
const PICTURE_EVERY: Duration = Duration::from_millis(150);
/// Maximum fraction of the time that is spent on drawing.
const PICTURE_SHARE: f64 = 0.2;
/// Number of steps for means.
const MEAN_OVER: usize = 20;

/// Effect of changing a value.
pub enum ChangeEffect {
    /// It takes effect in the run, with this plan and from this step on.
    Live(Box<Plan>, u64),
    /// It needs a new run, for this reason.
    Restart(String),
}

/// The run of the explorer with its data.
pub struct Live {
    /// Number of the run.
    pub id: u64,
    /// Scene and values set on the page.
    pub draft: Draft,
    /// Plan of the draft, which a new run would have.
    pub values: Plan,
    /// The guarded run.
    pub drive: Drive,
    /// Messages of the guard about the last step.
    faults: Vec<String>,
    /// Constant part of its recording.
    pub info: RunInfo,
    /// Its frames.
    pub frames: FrameBuffer,
    /// Its diagnostics, one row per step.
    pub rows: Vec<Row>,
    /// Changes of the scene during the run.
    pub changes: Vec<Change>,
    /// Computing time of all steps so far.
    computing: Duration,
    drawn: Option<Instant>,
    drawing: Duration,
    /// End times of the last steps.
    ends: VecDeque<Instant>,
}

impl Live {
    /// Starts a run and solves its first instant.
    pub fn start(id: u64, draft: Draft, plan: Plan, status: &Status) -> Result<Live, SimError> {
        let plan = Arc::new(plan);
        let clock = Instant::now();
        let run = sim::start(plan.clone())?;
        let mut warnings = session::warnings(&plan);
        warnings.extend(session::thinned(&plan, run.as_ref()));
        let tally = Tally::new(warnings);
        status.begin(id, status::columns(&plan));
        let mut info = info::run_info(&plan, &plan.scene.name);
        info.recording_id = format!("{}-{id}", info.recording_id);
        Ok(Live {
            id,
            draft,
            values: Plan::clone(&plan),
            info,
            frames: FrameBuffer::default(),
            rows: vec![],
            changes: vec![],
            computing: clock.elapsed(),
            drawn: None,
            drawing: Duration::ZERO,
            ends: VecDeque::new(),
            faults: vec![],
            drive: Drive::new(plan, run, Policy::default(), tally),
        })
    }

    /// Takes a step. Its events are in the events of the run.
    pub fn step(&mut self) -> Result<(), SimError> {
        let clock = Instant::now();
        self.faults = self.drive.step()?;
        self.computing += clock.elapsed();
        if self.ends.len() > MEAN_OVER {
            self.ends.pop_front();
        }
        self.ends.push_back(Instant::now());
        let (step, time) = (self.drive.run.row().step, self.drive.run.row().time);
        for change in self.changes.iter_mut().filter(|c| c.step == step) {
            change.time = Some(time);
        }
        // Changes of the scene's own schedule are listed when they happen.
        for event in self.drive.run.events() {
            let label = event.split_once(": ").map_or(event.as_str(), |e| e.1).to_string();
            if !self.changes.iter().any(|c| c.step == step) {
                self.changes.push(Change { step, time: Some(time), label });
            }
        }
        Ok(())
    }

    /// Records the present instant. `draw` requests a snapshot, however recent the last one is.
    pub fn observe(&mut self, draw: bool, status: &Status) -> Arc<Frame> {
        let row = self.drive.run.row().clone();
        self.drive.tally.add(&row);
        let mut notes = self.drive.run.events().to_vec();
        notes.append(&mut self.faults);
        let wanted = self.drive.frame_is_due();
        let draw = draw || wanted || self.drive.run.is_finished() || self.picture_is_due();
        let snapshot = draw.then(|| self.draw());
        let frame = Arc::new(self.drive.frame(self.seconds(), snapshot, notes));
        self.frames.push(frame.clone(), wanted);
        status.add(self.id, status::point(&self.drive.plan, &row));
        self.rows.push(row);
        frame
    }

    /// Adds a picture of the present instant, unless the last frame has one.
    pub fn look(&mut self) -> Option<Arc<Frame>> {
        if self.frames.ends_in_a_picture() {
            return None;
        }
        let snapshot = self.draw();
        let run = self.drive.run.as_ref();
        let frame = Arc::new(session::snapshot_alone(run, self.seconds(), snapshot));
        self.frames.push(frame.clone(), false);
        Some(frame)
    }

    fn draw(&mut self) -> crate::frame::Snapshot {
        let clock = Instant::now();
        let snapshot = self.drive.run.snapshot();
        self.drawing = clock.elapsed();
        self.drawn = Some(Instant::now());
        snapshot
    }

    fn picture_is_due(&self) -> bool {
        let pause = PICTURE_EVERY.max(self.drawing.div_f64(PICTURE_SHARE));
        self.drawn.is_none_or(|last| last.elapsed() >= pause)
    }

    /// The draft with `key` set to `value`, its plan, and the effect of the change.
    pub fn turn(&self, key: &str, value: &str) -> Result<(Draft, Plan, ChangeEffect), SceneError> {
        let draft = self.draft.with(key, value)?;
        let values = draft.plan()?;
        if let Some(what) = self.values.beyond_matter(&values) {
            return Ok((draft, values, ChangeEffect::Restart(format!("it changes {what}"))));
        }
        let step = self.drive.run.row().step + 1;
        let set = [(key.trim().to_string(), quantity(value))].into_iter().collect();
        let turn = match self.drive.plan.with_change(self.drive.run.changes_applied(), step, &set) {
            Ok(plan) => ChangeEffect::Live(Box::new(plan), step),
            Err(e) => ChangeEffect::Restart(e.message().to_string()),
        };
        Ok((draft, values, turn))
    }

    /// Continues with another plan, made by [`Live::turn`].
    pub fn go_on(&mut self, draft: Draft, values: Plan, plan: Plan, step: u64) {
        self.draft = draft;
        self.values = values;
        self.drive.plan = Arc::new(plan);
        self.drive.run.replan(self.drive.plan.clone());
        self.changes.retain(|c| c.step < step);
        let entry = self.drive.plan.changes.iter().find(|c| c.when == When::Step(step));
        let label = entry.map_or(String::new(), |c| c.label.clone());
        self.changes.push(Change { step, time: None, label });
    }

    /// Restarts the measurement of the rate: a pause does not count as slow.
    pub fn paused(&mut self) {
        self.ends.clear();
    }

    /// Steps per second over the last steps; `None` if unknown.
    pub fn steps_per_second(&self) -> Option<f64> {
        let (first, last) = (self.ends.front()?, self.ends.back()?);
        let span = last.duration_since(*first).as_secs_f64();
        (self.ends.len() > 1 && span > 0.0).then(|| (self.ends.len() - 1) as f64 / span)
    }

    /// The last rows. Row 0 includes the set-up and is used only if it is the only one.
    fn last(&self) -> &[Row] {
        let from = self.rows.len().saturating_sub(MEAN_OVER).max(1);
        self.rows.get(from..).filter(|r| !r.is_empty()).unwrap_or(&self.rows)
    }

    /// Seconds by phase, summed over the last steps.
    pub fn phases(&self) -> Phases {
        let mut sum = Phases::default();
        self.last().iter().for_each(|r| sum.add(&r.seconds));
        sum
    }

    /// Median computing time of the last steps (s).
    pub fn usual_step(&self) -> f64 {
        let mut walls: Vec<f64> = self.last().iter().map(|r| r.wall).collect();
        walls.sort_by(f64::total_cmp);
        walls.get(walls.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Computing time of all steps so far (s).
    pub fn seconds(&self) -> f64 {
        self.computing.as_secs_f64()
    }
}
