//! What pages read: the state as JSON, curves, saved files. Written by the session, read by the
//! server at any time.

use crate::frame::{Frame, RunInfo};
use crate::plan::Plan;
use crate::sim::row::Row;
use serde::Serialize;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// Numbers over time, a row per step.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Curves {
    pub columns: Vec<String>,
    pub points: Vec<Vec<f64>>,
}

/// A part of some curves.
#[derive(Debug, Serialize)]
pub struct Part {
    pub run: u64,
    pub from: usize,
    pub columns: Vec<String>,
    pub points: Vec<Vec<f64>>,
}

/// See the module.
pub struct Board {
    state: watch::Sender<Arc<str>>,
    curves: Mutex<HashMap<u64, Curves>>,
    files: Mutex<HashMap<(String, String), PathBuf>>,
    sketch: Mutex<Option<(RunInfo, Arc<Frame>)>>,
}

/// Most points of a sketch.
const SKETCH_POINTS: usize = 20_000;

/// A picture in few lines, for the time until the viewer is there.
#[derive(Debug, Serialize)]
pub struct Sketch {
    pub step: u64,
    /// Lower left and upper right corner, m.
    pub domain: [[f32; 2]; 2],
    pub walls: Vec<Vec<[f32; 2]>>,
    pub dye: Vec<Vec<[f32; 2]>>,
    /// Places of particles by material, with its colour.
    pub grains: Vec<([u8; 3], Vec<[f32; 2]>)>,
}

impl Board {
    pub fn new() -> Board {
        Board {
            state: watch::Sender::new("null".into()),
            curves: Mutex::default(),
            files: Mutex::default(),
            sketch: Mutex::default(),
        }
    }

    pub fn publish(&self, state: String) {
        self.state.send_replace(state.into());
    }

    pub fn watch(&self) -> watch::Receiver<Arc<str>> {
        self.state.subscribe()
    }

    /// Points of a run from one on.
    pub fn part(&self, run: u64, from: usize) -> Option<Part> {
        let all = lock(&self.curves);
        let curves = all.get(&run)?;
        let from = from.min(curves.points.len());
        let points = curves.points.get(from..).unwrap_or_default().to_vec();
        Some(Part { run, from, columns: curves.columns.clone(), points })
    }

    pub fn begin(&self, run: u64, columns: Vec<String>) {
        lock(&self.curves).insert(run, Curves { columns, points: vec![] });
    }

    pub fn add(&self, run: u64, point: Vec<f64>) {
        if let Some(curves) = lock(&self.curves).get_mut(&run) {
            curves.points.push(point);
        }
    }

    /// Keeps the curves of a run under another number.
    pub fn copy(&self, run: u64, to: u64) {
        let mut all = lock(&self.curves);
        if let Some(curves) = all.get(&run).cloned() {
            all.insert(to, curves);
        }
    }

    pub fn forget(&self, run: u64) {
        lock(&self.curves).remove(&run);
    }

    /// Keeps the last picture to make a sketch of.
    pub fn sketch(&self, info: &RunInfo, frame: Arc<Frame>) {
        *lock(&self.sketch) = Some((info.clone(), frame));
    }

    /// A sketch of the last picture.
    pub fn drawn(&self) -> Option<Sketch> {
        let (info, frame) = lock(&self.sketch).clone()?;
        let picture = frame.picture.as_ref()?;
        let particles = &picture.particles;
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
            dye: picture.dye_lines.clone(),
            grains,
        })
    }

    /// Lets pages fetch a file under a folder's name and its own.
    pub fn offer(&self, folder: &str, name: &str, path: PathBuf) {
        lock(&self.files).insert((folder.into(), name.into()), path);
    }

    pub fn file(&self, folder: &str, name: &str) -> Option<PathBuf> {
        lock(&self.files).get(&(folder.to_string(), name.to_string())).cloned()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Names of a plan's curves.
pub fn columns(plan: &Plan) -> Vec<String> {
    let mut list: Vec<String> =
        ["step", "time", "dt", "power_error", "volume_error", "max_speed", "dissipation"]
            .map(String::from)
            .to_vec();
    for g in &plan.gauges {
        list.push(format!("{} volume", g.name));
        list.push(format!("{} rate", g.name));
    }
    if plan.effects.directors {
        list.push("mean |n_x|".into());
    }
    list
}

/// A point of each curve; a number that is not one becomes null.
pub fn point(row: &Row) -> Vec<f64> {
    let mut list = vec![
        row.step as f64,
        row.time,
        row.dt,
        row.power_error,
        row.volume_error,
        row.max_speed,
        row.dissipation,
    ];
    list.extend(row.gauges.iter().flat_map(|g| [g.volume, g.rate]));
    list.extend(row.alignment);
    list
}
