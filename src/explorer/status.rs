//! This module holds the data that pages read: state as JSON, curves, a sketch and saved files. The
//! session writes it, and the server can read it at any time.

use crate::frame::{Frame, RunInfo};
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
    sketch: Mutex<Option<(RunInfo, Arc<Frame>)>>,
    /// Address of the streams, to which their names are appended.
    streams_at: String,
    streams: Mutex<HashMap<String, Arc<Stream>>>,
}

/// Maximum number of particles in a sketch.
const SKETCH_POINTS: usize = 20_000;

/// A simplified snapshot, shown until the viewer has loaded.
#[derive(Debug, Serialize)]
pub struct Sketch {
    /// Number of the step.
    pub step: u64,
    /// Lower left and upper right corner of the domain (m).
    pub domain: [[f32; 2]; 2],
    /// Polylines of the walls (m).
    pub walls: Vec<Vec<[f32; 2]>>,
    /// Polylines of the dye (m).
    pub dye: Vec<Vec<[f32; 2]>>,
    /// Colour and particle positions (m) of each material.
    pub grains: Vec<([u8; 3], Vec<[f32; 2]>)>,
}

impl Status {
    /// An empty status; `streams_at` is the address of the streams.
    pub fn new(streams_at: String) -> Status {
        Status {
            state: watch::Sender::new("null".into()),
            curves: Mutex::default(),
            files: Mutex::default(),
            sketch: Mutex::default(),
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

    /// Removes the curves of a run.
    pub fn forget(&self, run: u64) {
        lock(&self.curves).remove(&run);
    }

    /// Keeps the last snapshot, from which the sketch is made.
    pub fn sketch(&self, info: &RunInfo, frame: Arc<Frame>) {
        *lock(&self.sketch) = Some((info.clone(), frame));
    }

    /// The sketch of the last snapshot; `None` if there is no snapshot.
    pub fn drawn(&self) -> Option<Sketch> {
        let (info, frame) = lock(&self.sketch).clone()?;
        let snapshot = frame.snapshot.as_ref()?;
        let particles = &snapshot.particles;
        let every = particles.positions.len().div_ceil(SKETCH_POINTS).max(1);
        let mut grains: Vec<_> = info.materials.iter().map(|m| (m.rgb, vec![])).collect();
        let both = particles.positions.iter().zip(&particles.class).step_by(every);
        for (place, class) in both {
            if let Some((_, places)) = grains.get_mut(usize::from(*class)) {
                places.push(*place);
            }
        }
        Some(Sketch {
            step: frame.step,
            domain: [info.domain.min, info.domain.max],
            walls: info.walls.into_iter().map(|w| w.points).collect(),
            dye: snapshot.dye_lines.clone(),
            grains,
        })
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
