//! This module holds the data that pages read: state as JSON, curves, frames and saved files. The
//! session writes it, and the server can read it at any time.

use super::knobs::step_time;
use crate::frame::{Frame, RunInfo};
use crate::light::Description;
use crate::light::pack::{MOST_PARTICLES, pack};
use crate::plan::Plan;
use crate::sim::row::{Place, Row, places};
use crate::web::stream::Stream;
use serde::Serialize;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// Diagnostics over time, with one point per step.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Curves {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Values of all columns at each step.
    pub points: Vec<Vec<f64>>,
}

/// Part of the curves of a run.
#[derive(Debug, Serialize)]
pub struct Part {
    /// Number of the run.
    pub run: u64,
    /// Index of the first point.
    pub from: usize,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Values of all columns at each step from `from` on.
    pub points: Vec<Vec<f64>>,
}

/// Data shared between the session and the server.
pub struct Status {
    state: watch::Sender<Arc<str>>,
    curves: Mutex<HashMap<u64, Curves>>,
    files: Mutex<HashMap<(String, String), PathBuf>>,
    films: Mutex<HashMap<u64, Film>>,
    /// Number of unknowns and step time (s) of the run.
    pace: Mutex<Option<(usize, f64)>>,
    /// Address of the streams, to which their names are appended.
    streams_at: String,
    streams: Mutex<HashMap<String, Arc<Stream>>>,
}

/// The frames of a run that have pictures.
struct Film {
    info: Arc<RunInfo>,
    frames: Vec<Arc<Frame>>,
}

/// What the light view gets of a run.
#[derive(Debug, Serialize)]
pub struct Listing {
    /// Number of the run.
    pub id: u64,
    /// Constant data of the run.
    pub description: Description,
    /// Steps of the frames that have pictures.
    pub steps: Vec<u64>,
    /// Their times (s).
    pub times: Vec<f64>,
}

impl Status {
    /// An empty status; `streams_at` is the address of the streams.
    pub fn new(streams_at: String) -> Status {
        Status {
            state: watch::Sender::new("null".into()),
            curves: Mutex::default(),
            files: Mutex::default(),
            films: Mutex::default(),
            pace: Mutex::default(),
            streams_at,
            streams: Mutex::default(),
        }
    }

    /// Publishes the state, as JSON.
    pub fn publish(&self, state: String) {
        self.state.send_replace(state.into());
    }

    /// A receiver of the current state and its changes.
    pub fn watch(&self) -> watch::Receiver<Arc<str>> {
        self.state.subscribe()
    }

    /// Points of a run from index `from` on; `None` if the run is unknown.
    pub fn part(&self, run: u64, from: usize) -> Option<Part> {
        let all = lock(&self.curves);
        let curves = all.get(&run)?;
        let from = from.min(curves.points.len());
        let points = curves.points.get(from..).unwrap_or_default().to_vec();
        Some(Part { run, from, columns: curves.columns.clone(), points })
    }

    /// Starts the curves of a run.
    pub fn begin(&self, run: u64, columns: Vec<String>) {
        lock(&self.curves).insert(run, Curves { columns, points: vec![] });
    }

    /// Appends a point to the curves of a run.
    pub fn add(&self, run: u64, point: Vec<f64>) {
        if let Some(curves) = lock(&self.curves).get_mut(&run) {
            curves.points.push(point);
        }
    }

    /// Copies the curves of a run to the number `to`.
    pub fn copy(&self, run: u64, to: u64) {
        let mut all = lock(&self.curves);
        if let Some(curves) = all.get(&run).cloned() {
            all.insert(to, curves);
        }
    }

    /// Removes the curves and frames of a run.
    pub fn forget(&self, run: u64) {
        lock(&self.films).remove(&run);
        lock(&self.curves).remove(&run);
    }

    /// Publishes the frames of a run, of which only those with pictures are kept.
    pub fn film(&self, run: u64, info: &RunInfo, frames: &[Arc<Frame>]) {
        let drawn = frames.iter().filter(|f| f.snapshot.is_some()).cloned().collect();
        let mut films = lock(&self.films);
        let film = films
            .entry(run)
            .or_insert_with(|| Film { info: Arc::new(info.clone()), frames: vec![] });
        film.frames = drawn;
    }

    /// What the light view gets of a run; `None` if the run is unknown.
    pub fn listing(&self, run: u64) -> Option<Listing> {
        let films = lock(&self.films);
        let film = films.get(&run)?;
        Some(Listing {
            id: run,
            description: Description::new(&film.info),
            steps: film.frames.iter().map(|f| f.step).collect(),
            times: film.frames.iter().map(|f| f.time_s).collect(),
        })
    }

    /// The packed picture of a step, thinned; `None` if there is none.
    pub fn picture(&self, run: u64, step: u64) -> Option<Vec<u8>> {
        let (info, frame) = {
            let films = lock(&self.films);
            let film = films.get(&run)?;
            let frame = film.frames.iter().rev().find(|f| f.step == step)?;
            (film.info.clone(), frame.clone())
        };
        Some(pack(frame.snapshot.as_ref()?, &info, MOST_PARTICLES))
    }

    /// Notes the number of unknowns and the step time (s) of the run.
    pub fn set_pace(&self, unknowns: usize, seconds_per_step: f64) {
        *lock(&self.pace) = Some((unknowns, seconds_per_step));
    }

    /// Expected step time (s) of a scene with this number of unknowns; `None` if no run was timed.
    pub fn expected_step(&self, unknowns: usize) -> Option<f64> {
        let (known, seconds) = (*lock(&self.pace))?;
        let expected = step_time(seconds, known, unknowns);
        expected.is_finite().then_some(expected)
    }

    /// Makes a stream available to the viewer, and returns its address.
    pub fn show(&self, name: &str, stream: Arc<Stream>) -> String {
        lock(&self.streams).insert(name.into(), stream);
        format!("{}{name}", self.streams_at)
    }

    /// Removes a stream.
    pub fn hide(&self, name: &str) {
        lock(&self.streams).remove(name);
    }

    /// A stream that was made available.
    pub fn stream(&self, name: &str) -> Option<Arc<Stream>> {
        lock(&self.streams).get(name).cloned()
    }

    /// Makes a file available to pages, under a folder name and a file name.
    pub fn offer(&self, folder: &str, name: &str, path: PathBuf) {
        lock(&self.files).insert((folder.into(), name.into()), path);
    }

    /// Path of a file that was made available.
    pub fn file(&self, folder: &str, name: &str) -> Option<PathBuf> {
        lock(&self.files).get(&(folder.to_string(), name.to_string())).cloned()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Column names of the curves of a plan.
pub fn columns(plan: &Plan) -> Vec<String> {
    live(plan).map(|p| p.live_name).collect()
}

/// Values of all columns at one step. JSON has null for values that are not finite.
pub fn point(plan: &Plan, row: &Row) -> Vec<f64> {
    live(plan).map(|p| p.number(row)).collect()
}

fn live(plan: &Plan) -> impl Iterator<Item = Place> {
    places(plan).into_iter().filter(|p| p.column.live)
}
