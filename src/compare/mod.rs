//! This module compares runs: values at the end, curves, fields and scenes.
//!
//! The first run is the reference. Runs of other resolutions, materials or end times are compared
//! at the times that all of them have.

mod curves;
mod fields;
mod report;
mod scenes;
mod tolerance;
mod view;

pub use report::terminal;
pub use tolerance::{Tolerance, Verdict};
pub use view::{plots, record};

use crate::results::{Kind, Member, ResultsError, later, table};
use crate::scene::Geometry;
use serde::Serialize;

/// Version of the JSON format of a comparison.
pub const SCHEMA: u32 = 1;

/// Result of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Version of the format: [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub version: &'static str,
    /// The compared runs; the first is the reference.
    pub runs: Vec<RunHead>,
    /// Time at which values are compared (s): the earliest end of a run.
    pub time: f64,
    /// Values of all runs at `time`.
    pub values: Vec<Value>,
    /// Distances of the curves from those of the first run.
    pub curves: Vec<CurveChange>,
    /// Distances of the fields from those of the first run.
    pub fields: Vec<fields::FieldChange>,
    /// Keys whose values differ between the resolved scenes.
    pub scenes: Vec<scenes::Change>,
    /// Results of the tolerance checks.
    pub tolerances: Vec<Verdict>,
    /// Messages for the user.
    pub notes: Vec<String>,
    /// Paths of the files that were written.
    pub files: Vec<String>,
}

/// Identity of a compared run.
#[derive(Clone, Debug, Serialize)]
pub struct RunHead {
    /// Name of the run in the comparison.
    pub name: String,
    /// Path of its folder or file.
    pub path: String,
    /// Kind of data that is available.
    pub kind: Kind,
    /// Name of the scene; `None` if unknown.
    pub scene: Option<String>,
    /// SHA-256 of the resolved scene, hexadecimal; `None` if unknown.
    pub scene_hash: Option<String>,
    /// SHA-256 of the final state, hexadecimal; `None` if unknown.
    pub state_hash: Option<String>,
    /// Simulated time at the end (s).
    pub end: f64,
    /// Whether the final state is that of the first run; `None` if a hash is unknown.
    pub identical: Option<bool>,
}

impl RunHead {
    /// Identity of a run; `first` is the reference run.
    fn new(run: &Member, first: &Member) -> RunHead {
        let (scene, scene_hash) = run.scene().unzip();
        RunHead {
            name: run.name.clone(),
            path: run.path.display().to_string(),
            kind: run.kind,
            scene,
            scene_hash,
            state_hash: run.state_hash().map(String::from),
            end: run.end,
            identical: run.state_hash().zip(first.state_hash()).map(|(a, b)| a == b),
        }
    }
}

/// One quantity of all runs.
#[derive(Clone, Debug, Serialize)]
pub struct Value {
    /// Name of the quantity.
    pub key: String,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// Value of each run; `None` where it is unknown.
    pub values: Vec<Option<f64>>,
    /// Change from the first run, relative to the magnitude there; `None` where that is zero or
    /// unknown.
    pub relative: Vec<Option<f64>>,
}

/// Distance of a curve from that of the first run.
#[derive(Clone, Debug, Serialize)]
pub struct CurveChange {
    /// Name of the column.
    pub key: String,
    /// Name of the run.
    pub run: String,
    /// Largest distance over time, relative to the largest magnitude of the first run's curve.
    pub largest: f64,
    /// Time of the largest distance (s).
    pub at: f64,
}

/// Compares all runs with the first one. The result includes the field differences for a recording.
pub fn compare(members: &[Member], tolerances: &[Tolerance]) -> Result<Found, ResultsError> {
    let mut notes: Vec<String> = members.iter().flat_map(|m| m.notes.clone()).collect();
    let time = members.iter().map(|m| m.end).fold(f64::INFINITY, f64::min);
    if let Some(longest) = members.iter().find(|m| later(m.end, time)) {
        notes.push(format!(
            "the runs end at different times; they are compared up to the earliest end, {} s ({} \
             continues to {} s)",
            short(time),
            longest.name,
            short(longest.end)
        ));
    }
    let values = values(members, time, &mut notes);
    let differences = fields::differences(members, time, &mut notes);
    let tolerances = tolerance::judge(tolerances, members, &values)?;
    let comparison = Comparison {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        runs: members.iter().map(|m| RunHead::new(m, &members[0])).collect(),
        time,
        values,
        curves: curves::changes(members, time),
        fields: differences.iter().flat_map(|d| d.changes.clone()).collect(),
        scenes: scenes::changes(members),
        tolerances,
        notes,
        files: vec![],
    };
    Ok(Found { comparison, differences })
}

/// A comparison, and the field differences for a recording.
pub struct Found {
    /// Result of the comparison.
    pub comparison: Comparison,
    differences: Vec<fields::Pair>,
}

fn short(value: f64) -> String {
    crate::record::number::short(value)
}

/// Values of all runs at a common time.
fn values(members: &[Member], time: f64, notes: &mut Vec<String>) -> Vec<Value> {
    let at_time: Vec<_> = members.iter().map(|m| m.values_at(time)).collect();
    let geometry = members.first().map_or(Geometry::Plane, Member::geometry);
    for (member, values) in members.iter().zip(&at_time) {
        if values.is_none() {
            notes.push(format!(
                "{} has values only at its end, {} s, which other runs do not reach: run them to \
                 this time to compare values",
                member.name,
                short(member.end)
            ));
        }
    }
    let mut keys: Vec<&str> = vec![];
    for key in at_time.iter().flatten().flat_map(|values| values.keys()) {
        if !keys.contains(&key.as_str()) {
            keys.push(key);
        }
    }
    keys.sort_by_key(|key| table::importance(key));
    let list = keys.into_iter().map(|key| {
        let values: Vec<Option<f64>> = at_time
            .iter()
            .map(|values| values.as_ref().and_then(|v| v.get(key)).copied())
            .collect();
        let first = values.first().copied().flatten();
        let relative = values.iter().map(|&v| change(first?, v?)).collect();
        Value { key: key.to_owned(), unit: table::unit(key, geometry), values, relative }
    });
    list.collect()
}

/// Relative change from `a` to `b`; `None` if it is not finite.
fn change(a: f64, b: f64) -> Option<f64> {
    if a == b {
        return Some(0.0);
    }
    let change = (b - a) / a.abs();
    change.is_finite().then_some(change)
}
