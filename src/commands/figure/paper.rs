//! Makes the figures of the source paper: snapshots of runs at given times, and the runs side by side.

use super::Args;
use super::runs::{self, Job};
use crate::commands::{Failure, compare as comparison, source};
use crate::compare;
use crate::frame::Snapshot;
use crate::record::figure_page::{Row, Sheet, sheet};
use crate::record::info;
use crate::record::number::short;
use crate::record::rerun_log::Sink;
use crate::scene::presets;
use crate::sim::Run;
use crate::sweep;
use std::path::{Path, PathBuf};

/// Definition of a figure.
pub(super) struct Figure {
    /// Name of the figure and of its folder.
    pub(super) name: &'static str,
    /// Name of the preset that is run.
    preset: &'static str,
    /// Title of the sheet of snapshots.
    title: &'static str,
    /// Name of the sweep that gives the runs, and symbol of the quantity that it varies; `None` for
    /// a single run.
    sweep: Option<(&'static str, &'static str)>,
    /// Label of the single run.
    single: &'static str,
    /// Settings of all runs.
    sets: &'static [&'static str],
    /// Additional settings with `--quick`.
    quick: &'static [&'static str],
    /// Times of the snapshots, s.
    times: &'static [f64],
    /// File name of the sheet of snapshots.
    sheet: &'static str,
}

/// Figs. 1 and 3 of the source: R/a from 0 to 10/3, with snapshots at the times of Fig. 1.
pub(super) const SILO: Figure = Figure {
    name: "silo",
    preset: "silo",
    title: "Discharge of a silo for five internal lengths R, aperture a",
    sweep: Some(("fig3", "R/a")),
    single: "",
    sets: &[],
    quick: &[],
    times: &[0.0, 4.75e-4, 1.42e-3, 2.85e-3, 3.8e-3],
    sheet: "snapshots",
};

/// Fig. 4 of the source. At the three times the dyed line is sheared by about a half, two, and many
/// times the height.
pub(super) const ALIGNMENT: Figure = Figure {
    name: "alignment",
    preset: "shear_alignment",
    title: "Texture in shear: dyed line, directors and isovalues of mean |n_x|",
    sweep: None,
    single: "R/H = 0.2",
    sets: &["time.end=0.5", "recording.frames=50", "recording.times=[0.05, 0.15, 0.5]"],
    quick: &["accuracy.cells=16", "recording.frames=10"],
    times: &[0.05, 0.15, 0.5],
    sheet: "isovalues",
};

/// Makes the figure in the folder `out`. Returns the text to print.
pub(super) fn make(figure: &Figure, args: &Args, out: &Path) -> Result<String, Failure> {
    let jobs = jobs(figure, args, out)?;
    let pictures = runs::run_all(&jobs, |pictures: &mut Vec<Snapshot>, run: &dyn Run| {
        let due = figure.times.get(pictures.len());
        if due.is_some_and(|&t| run.row().time >= t * (1.0 - 1e-9)) {
            pictures.push(run.snapshot());
        }
    })?;
    let stem = |name: &str| out.join(format!("{}_{name}", figure.name));
    let reached = pictures.iter().map(Vec::len).min().unwrap_or(0);
    let times = figure.times.iter().take(reached);
    let columns = times.map(|t| format!("t = {} s", short(*t))).collect();
    let rows = jobs.iter().zip(pictures).map(|(job, pictures)| Row {
        name: job.name.clone(),
        info: info::run_info(&job.plan, &job.name),
        pictures,
    });
    sheet(
        &stem(figure.sheet),
        &Sheet { title: figure.title.into(), columns, rows: rows.collect() },
    )?;
    let mut said = String::new();
    if jobs.len() > 1 {
        said = side_by_side(&jobs, &out.join(format!("{}.rrd", figure.name)))?;
    }
    Ok(said + &super::files(&stem(figure.sheet)) + &runs::list(&jobs))
}

/// Makes plans and folders of all runs. Errors are reported before anything is computed.
fn jobs(figure: &Figure, args: &Args, out: &Path) -> Result<Vec<Job>, Failure> {
    let source = presets::find(figure.preset)?;
    let quick: &[&str] = if args.quick { figure.quick } else { &[] };
    let mut jobs = vec![];
    for (name, folder, sets) in cases(figure, args.quick)? {
        let own = figure.sets.iter().chain(quick).map(|s| s.to_string());
        let sets = own.chain(sets).collect();
        jobs.push(Job::new(&source, (name, folder, sets), (args, out))?);
    }
    Ok(jobs)
}

/// Names, folders and settings of the runs, taken from the sweep of the figure.
fn cases(figure: &Figure, quick: bool) -> Result<Vec<(String, String, Vec<String>)>, Failure> {
    let Some((sweep, symbol)) = figure.sweep else {
        return Ok(vec![(figure.single.into(), "run".into(), vec![])]);
    };
    let missing = || Failure::Environment(format!("the sweep {sweep} is not part of the program"));
    let spec = sweep::read_file(sweep)?.ok_or_else(missing)?;
    let spec = if quick { spec.quick() } else { spec };
    let list = sweep::List::new(&source(&spec.scene, &[])?, &spec)?;
    let named = |case: &sweep::Case| {
        let (name, value) = case.values.first().ok_or_else(missing)?;
        let folder = format!("{name}_{}", value.replace('/', "_"));
        Ok((format!("{symbol} = {value}"), folder, case.sets.clone()))
    };
    list.cases.iter().map(named).collect()
}

/// Compares all runs with the first one, and writes the recording. Returns the text to print.
fn side_by_side(jobs: &[Job], path: &Path) -> Result<String, Failure> {
    let folders: Vec<PathBuf> = jobs.iter().map(|job| job.folder.clone()).collect();
    let mut members = crate::results::open_all(&folders)?;
    for (member, job) in members.iter_mut().zip(jobs) {
        member.rename(&job.name);
    }
    let found = compare::compare(&members, &[])?;
    let (found, _) = comparison::write(found, &members, path, &[Sink::Save(path.to_owned())])?;
    Ok(compare::terminal(&found))
}
