//! Comparing runs: values at the end, curves, fields, and the scenes they are of.
//!
//! The first run is what the others are compared with. Runs of other resolutions, materials or
//! ends compare at the times they have in common.

mod curves;
mod fields;
mod member;
mod report;
mod scenes;
mod table;
mod tolerance;
mod view;

pub use member::{CompareError, Kind, Member, open_all};
pub use report::{markdown, terminal};
pub use tolerance::{Amount, Tolerance, Verdict};
pub use view::{plots, record};

use serde::Serialize;

/// Version of the comparison's format as JSON.
pub const SCHEMA: u32 = 1;

/// Times closer than this, relative to them, are the same.
const SAME_TIME: f64 = 1e-9;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    pub schema: u32,
    pub version: &'static str,
    pub runs: Vec<RunHead>,
    /// The time that values are compared at (s): the earliest end.
    pub time: f64,
    pub values: Vec<Value>,
    pub curves: Vec<CurveChange>,
    pub fields: Vec<fields::FieldChange>,
    /// Keys of the resolved scenes in which runs differ.
    pub scenes: Vec<scenes::Change>,
    pub tolerances: Vec<Verdict>,
    pub notes: Vec<String>,
    /// Files that were written.
    pub files: Vec<String>,
}

/// Who a run is.
#[derive(Clone, Debug, Serialize)]
pub struct RunHead {
    pub name: String,
    pub path: String,
    pub kind: Kind,
    pub scene: Option<String>,
    pub scene_hash: Option<String>,
    pub state_hash: Option<String>,
    /// Where it ends (s).
    pub end: f64,
    /// To the first run, by the hash of the state; absent if one has none.
    pub identical: Option<bool>,
}

/// One number of each run.
#[derive(Clone, Debug, Serialize)]
pub struct Value {
    pub key: String,
    pub unit: &'static str,
    pub values: Vec<Option<f64>>,
    /// Change from the first run over its magnitude; absent where there is nothing to divide by.
    pub relative: Vec<Option<f64>>,
}

/// How far a curve is from the first run's.
#[derive(Clone, Debug, Serialize)]
pub struct CurveChange {
    pub key: String,
    pub run: String,
    /// Largest distance over the largest magnitude of the first run's curve.
    pub largest: f64,
    /// Where (s).
    pub at: f64,
}

/// Compares all with the first one. Differences of fields come along: a recording shows them.
pub fn compare(members: &[Member], tolerances: &[Tolerance]) -> Result<Found, CompareError> {
    let mut notes: Vec<String> = members.iter().flat_map(|m| m.notes.clone()).collect();
    let time = members.iter().map(|m| m.end).fold(f64::INFINITY, f64::min);
    if let Some(longest) = members.iter().find(|m| later(m.end, time)) {
        notes.push(format!(
            "the runs end at different times; they are compared up to the earliest end, {} s ({} \
             goes on to {} s)",
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
        runs: members.iter().map(|m| m.head(&members[0])).collect(),
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

/// A comparison and the fields' differences that a recording shows.
pub struct Found {
    pub comparison: Comparison,
    differences: Vec<fields::Pair>,
}

fn later(a: f64, b: f64) -> bool {
    a > b + SAME_TIME * a.abs()
}

fn short(value: f64) -> String {
    crate::record::number::short(value)
}

/// Numbers of each run at a time they have in common.
fn values(members: &[Member], time: f64, notes: &mut Vec<String>) -> Vec<Value> {
    let at_time: Vec<_> = members.iter().map(|m| m.values_at(time)).collect();
    for (member, values) in members.iter().zip(&at_time) {
        if values.is_none() {
            notes.push(format!(
                "{} has numbers of its end only, {} s, which other runs do not reach: run them \
                 that far to compare values",
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
        Value { key: key.to_owned(), unit: table::unit(key), values, relative }
    });
    list.collect()
}

/// Relative change from `a` to `b`.
fn change(a: f64, b: f64) -> Option<f64> {
    if a == b {
        return Some(0.0);
    }
    let change = (b - a) / a.abs();
    change.is_finite().then_some(change)
}
