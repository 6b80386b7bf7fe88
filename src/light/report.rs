//! This module writes reports: one page with the light view, curves and results of runs, which
//! opens from a disk without a server or network.

use super::reel::{Detail, Ranges, Reel};
use super::{BASE_STYLE, CANVAS, DRAWING, Description, STYLE, VIEW};
use crate::record::replace::{self, Kind, ReplaceError};
use crate::record::text::escape;
use crate::results::Member;
use crate::sim::row;
use crate::words::count;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use indexmap::IndexMap;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::Path;

const PAGE: &str = include_str!("../../assets/light/report.html");
const SCRIPT: &str = include_str!("../../assets/light/report.js");
const PLOTS: &str = include_str!("../../assets/explorer/plots.js");
const REPORT_STYLE: &str = include_str!("../../assets/light/report.css");

/// Largest number of points of a curve in a report.
const MOST_POINTS: usize = 2000;

/// Error of writing a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file is in the way, or the report cannot be written.
    #[error(transparent)]
    Replace(#[from] ReplaceError),
    /// A value cannot be encoded.
    #[error("the report cannot be encoded: {0}")]
    Encode(String),
}

/// The data inside a page.
#[derive(Serialize)]
struct Data {
    runs: Vec<Run>,
    /// Frame of the first run that is shown first.
    start: usize,
    /// Units of the columns.
    units: IndexMap<String, &'static str>,
    /// Commands that repeat the runs and the report.
    again: Vec<String>,
}

#[derive(Serialize)]
struct Run {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    description: Option<Description>,
    times: Vec<f64>,
    /// Compressed packed frames, in base 64.
    frames: Vec<String>,
    ranges: Ranges,
    #[serde(skip_serializing_if = "Option::is_none")]
    series: Option<Series>,
    /// Text of `summary.json`; `None` if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    summary: Option<String>,
    /// Values at the end.
    values: IndexMap<String, f64>,
    scene: Option<String>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Series {
    columns: Vec<String>,
    points: Vec<Vec<f64>>,
}

/// The page of runs; `command` is the command that makes it.
fn page(members: &[Member], detail: Detail, command: &str) -> Result<String, ReportError> {
    let encode = |e: &dyn std::fmt::Display| ReportError::Encode(e.to_string());
    let (mut runs, mut notes) = (vec![], vec![]);
    for member in members {
        let (run, note) = run(member, detail).map_err(|e| encode(&e))?;
        runs.push(run);
        notes.extend(note);
    }
    let geometry = members.first().map(Member::geometry).unwrap_or_default();
    let columns = runs.iter().filter_map(|r| r.series.as_ref()).flat_map(|s| &s.columns);
    let units = columns.filter_map(|c| Some((c.clone(), row::find(c)?.unit_in(geometry))));
    let units = units.filter(|(_, unit)| !unit.is_empty()).collect();
    let several = members.len() > 1;
    let mut again: Vec<String> = members
        .iter()
        .filter(|m| m.scene_toml.is_some())
        .map(|m| match several {
            true => {
                format!("grainscope run scene.toml --out {0}   # with the scene of {0}", m.name)
            }
            false => format!("grainscope run scene.toml --out {}", m.name),
        })
        .collect();
    again.push(command.to_string());
    let names: Vec<&str> = members.iter().map(|m| m.name.as_str()).collect();
    let start = runs.iter().find(|r| !r.frames.is_empty()).map_or(0, |r| r.frames.len() / 3);
    let about = members.iter().find_map(|m| m.info.as_ref()).map(|i| i.scene_toml.as_str());
    let data = Data { runs, start, units, again };
    // A tag inside a text must not end the element of the data.
    let data = serde_json::to_string(&data).map_err(|e| encode(&e))?.replace('<', "\\u003c");
    let script = [DRAWING[0], DRAWING[1], CANVAS, VIEW, PLOTS, SCRIPT].join("\n");
    let style = [BASE_STYLE, STYLE, REPORT_STYLE].join("\n");
    let hash = |text: &str| BASE64.encode(Sha256::digest(text));
    Ok(fill(
        PAGE,
        &[
            ("script_hash", &hash(&script)),
            ("style_hash", &hash(&style)),
            ("title", &escape(&names.join(", "))),
            ("description", &escape(&about.and_then(description).unwrap_or_default())),
            ("detail", &escape(&notes.join(" "))),
            ("style", &style),
            ("script", &script),
            ("data", &data),
        ],
    ))
}

/// Writes the page of runs to a file. Returns its size (bytes).
///
/// # Errors
/// A file of another kind is in the way, or a value cannot be encoded.
pub fn write(members: &[Member], detail: Detail, path: &Path) -> Result<u64, ReportError> {
    replace::may_replace(path, Kind::Page)?;
    let runs: Vec<String> = members.iter().map(|m| m.path.display().to_string()).collect();
    let command = format!("grainscope report {} -o {}", runs.join(" "), path.display());
    let page = page(members, detail, &command)?;
    replace::write(path, &page, Kind::Page)?;
    Ok(page.len() as u64)
}

/// The data of a run, and what is to be said about its frames.
fn run(member: &Member, detail: Detail) -> std::io::Result<(Run, Option<String>)> {
    let mut notes = member.notes.clone();
    let reel = Reel::of(member, detail).map_err(|e| notes.push(e.to_string())).ok();
    let note = reel.as_ref().map(|reel| about_frames(reel, &member.name));
    let mut run = Run {
        name: member.name.clone(),
        description: None,
        times: vec![],
        frames: vec![],
        ranges: Ranges::new(),
        series: member.table.as_ref().map(|t| series(&t.columns)),
        summary: member.summary_text().map(String::from),
        values: member.values_at(member.end).unwrap_or_default(),
        scene: member.scene_toml.clone(),
        notes,
    };
    if let Some(reel) = reel {
        for (time, packed) in &reel.frames {
            run.times.push(*time);
            let mut encoder = ZlibEncoder::new(vec![], Compression::best());
            encoder.write_all(packed)?;
            run.frames.push(BASE64.encode(encoder.finish()?));
        }
        run.ranges = reel.ranges;
        run.description = Some(reel.description);
    }
    Ok((run, note))
}

/// Says how the frames differ from the recording.
fn about_frames(reel: &Reel, name: &str) -> String {
    let step = reel.description.resolution();
    let particles = match reel.kept < reel.recorded {
        true => format!("{} of up to {}", reel.kept, count(reel.recorded, "particle")),
        false => count(reel.recorded, "particle"),
    };
    let frames = match reel.frames.len() < reel.pictures {
        true => format!("{} of {}", reel.frames.len(), count(reel.pictures, "frame")),
        false => count(reel.pictures, "frame"),
    };
    format!(
        "{name}: {frames} of the recording, {particles}; positions are rounded to 16 bits \
         ({step:.1e} m), values of fields to 12 bits."
    )
}

/// Columns and points, at most [`MOST_POINTS`] of them, with the last one.
fn series(columns: &IndexMap<String, Vec<f64>>) -> Series {
    let count = columns.values().map(Vec::len).max().unwrap_or(0);
    let every = count.div_ceil(MOST_POINTS).max(1);
    let kept = (0..count).filter(|k| k % every == 0 || k + 1 == count);
    let value = |c: &Vec<f64>, k: usize| c.get(k).copied().unwrap_or(f64::NAN);
    Series {
        columns: columns.keys().cloned().collect(),
        points: kept.map(|k| columns.values().map(|c| value(c, k)).collect()).collect(),
    }
}

/// The description in the text of a scene.
fn description(scene: &str) -> Option<String> {
    let table: toml::Table = scene.parse().ok()?;
    Some(table.get("description")?.as_str()?.to_string())
}

/// Replaces `{name}` by its text, once each.
fn fill(page: &str, parts: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = page;
    while let Some(at) = rest.find('{') {
        let name = rest[at + 1..].split('}').next().unwrap_or_default();
        out += &rest[..at];
        match parts.iter().find(|(key, _)| *key == name) {
            Some((_, text)) => {
                out += text;
                rest = &rest[at + name.len() + 2..];
            }
            None => {
                out.push('{');
                rest = &rest[at + 1..];
            }
        }
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_filled_once() {
        let page = fill("a {x} b {y} {z", &[("x", "{y}"), ("y", "1")]);
        assert_eq!(page, "a {y} b 1 {z");
    }

    #[test]
    fn long_series_keep_their_ends() {
        let columns = IndexMap::from([("time".to_string(), (0..5003).map(f64::from).collect())]);
        let series = series(&columns);
        assert!(series.points.len() <= MOST_POINTS + 1);
        assert_eq!(series.points[0], [0.0]);
        assert_eq!(series.points.last(), Some(&vec![5002.0]));
    }
}
