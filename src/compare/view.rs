//! This module draws the curves of all runs in common plots, and records the runs side by side.

use super::{Comparison, Found, fields, report};
use crate::frame::RunInfo;
use crate::record::plots::{Axis, Curve, PlotError, PlotSpec, line_plot, panels_plot};
use crate::record::rerun_log::{Difference, Finished, RecordError, RecordedRun, SideBySide, Sink};
use crate::results::{Kind, Member, later, table};
use crate::scene::Geometry;
use std::path::{Path, PathBuf};

/// Name of a figure; title, column and axis name of each of its panels.
type Figure = (String, Vec<(String, String, &'static str)>);

/// Writes the plots to `<stem>_<name>.svg` and `.png`; returns the paths of the files.
pub fn plots(stem: &Path, members: &[Member]) -> Result<Vec<PathBuf>, PlotError> {
    let tables = || members.iter().filter_map(|m| Some((m, m.table.as_ref()?)));
    if tables().count() < 2 {
        return Ok(vec![]);
    }
    let mut written = vec![];
    let geometry = members.first().map_or(Geometry::Plane, Member::geometry);
    for (name, panels) in figures(members) {
        let specs: Vec<PlotSpec> = panels
            .into_iter()
            .map(|(title, column, axis)| PlotSpec {
                title,
                x: Axis::new("time", "s"),
                y: match column.ends_with("_error") {
                    true => Axis::new(axis, table::unit(&column, geometry)).log(),
                    false => Axis::new(axis, table::unit(&column, geometry)),
                },
                curves: tables()
                    .filter_map(|(member, table)| {
                        let points = table.points(&column)?;
                        Some(Curve { name: member.name.clone(), points, marks: false })
                    })
                    .collect(),
            })
            .collect();
        let mut path = stem.as_os_str().to_owned();
        path.push(format!("_{name}"));
        let path = PathBuf::from(path);
        match specs.as_slice() {
            [one] => line_plot(&path, one)?,
            several => panels_plot(&path, several)?,
        }
        for suffix in [".svg", ".png"] {
            let mut file = path.clone().into_os_string();
            file.push(suffix);
            written.push(PathBuf::from(file));
        }
    }
    Ok(written)
}

fn figures(members: &[Member]) -> Vec<Figure> {
    let mut columns: Vec<&str> = vec![];
    for key in members.iter().filter_map(|m| m.table.as_ref()).flat_map(|t| t.columns.keys()) {
        if !columns.contains(&key.as_str()) {
            columns.push(key);
        }
    }
    let panel = |title: &str, column: &str, axis| (title.to_owned(), column.to_owned(), axis);
    let mut list: Vec<Figure> = vec![];
    for column in columns.iter().filter(|c| c.ends_with("outflow_volume")) {
        let gauge = column.strip_suffix("outflow_volume").unwrap_or_default();
        let of = gauge.strip_suffix('.').map_or(String::new(), |g| format!(" through {g}"));
        list.push((
            format!("{}outflow", gauge.replace('.', "_")),
            vec![
                panel(&format!("outflow volume{of}"), column, "outflow volume"),
                panel("outflow rate", &format!("{gauge}outflow_rate"), "outflow rate"),
            ],
        ));
    }
    if columns.contains(&"mean_alignment") {
        let one = panel("alignment of the directors", "mean_alignment", "mean |n_x|");
        list.push(("alignment".into(), vec![one]));
    }
    let flow = [
        panel("largest speed", "max_speed", "largest speed"),
        panel("dissipation", "dissipation", "dissipation"),
    ];
    list.push((
        "flow".into(),
        flow.into_iter().filter(|f| columns.contains(&f.1.as_str())).collect(),
    ));
    list.push((
        "diagnostics".into(),
        vec![
            panel("power balance", "power_error", "relative error"),
            panel("divergence", "divergence_error", "relative error"),
            panel("volume of particles in cells", "volume_error", "relative error"),
        ],
    ));
    list
}

/// Records the runs side by side; `None` if fewer than two runs have recordings.
pub fn record(
    found: Found,
    members: &[Member],
    sinks: &[Sink],
) -> Result<(Comparison, Option<Finished>), RecordError> {
    let Found { mut comparison, differences } = found;
    let lanes: Vec<RecordedRun> = members
        .iter()
        .filter_map(|m| Some(RecordedRun { info: m.info.clone()?, recorded: m.recorded.as_ref()? }))
        .collect();
    if lanes.len() < 2 {
        // A comparison with a summary alone is not expected to have pictures.
        if members.iter().all(|m| m.kind != Kind::Summary) {
            comparison.notes.push(
                "fewer than two of the runs have a recording: there is nothing to show side by \
                 side"
                    .into(),
            );
        }
        return Ok((comparison, None));
    }
    let pairs: Vec<Difference> = differences
        .into_iter()
        .map(|pair| {
            let first = members[pair.runs[0]].info.as_ref();
            Difference {
                info: RunInfo {
                    name: fields::title(members, pair.runs),
                    domain: pair.domain,
                    walls: first.map(|info| info.walls.clone()).unwrap_or_default(),
                    fields: pair.quantities,
                    ..Default::default()
                },
                frames: pair.frames,
                ends: pair
                    .runs
                    .iter()
                    .any(|&k| later(members[k].end, comparison.time))
                    .then_some(comparison.time),
            }
        })
        .collect();
    let names: Vec<&str> = lanes.iter().map(|lane| lane.info.name.as_str()).collect();
    let title = names.join(" | ");
    let ids: Vec<&str> = lanes.iter().map(|lane| lane.info.recording_id.as_str()).collect();
    let side_by_side = SideBySide {
        id: &format!("compare-{}", ids.join("-")),
        title: &title,
        texts: &report::markdown(&comparison),
    };
    let finished = side_by_side.write(&lanes, &pairs, sinks)?;
    Ok((comparison, Some(finished)))
}
