//! This module implements `grainscope compare`: runs side by side, in numbers and in one recording.

use super::{Failure, print};
use crate::compare::{self, Comparison, Tolerance};
use crate::light::reel::Detail;
use crate::light::report;
use crate::record::replace::{Aside, Kind, beside, may_replace};
use crate::record::rerun_log::{Served, Sink};
use crate::results::{self, Member, ResultsError};
use crate::session::{wait_for_interrupt, watch_interrupts};
use std::path::{Path, PathBuf};

/// Compare runs: values, curves, fields and scenes, and one recording side by side.
///
/// A run is given as the folder that `run` wrote, as one of its files, as a recording (.rrd) or as
/// a summary (.json). All are compared with the first one.
#[derive(clap::Args)]
pub struct Args {
    /// Folders of runs, recordings or summaries
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Path of the recording; plots go to its folder [default: comparisons/<names>/compare.rrd]
    #[arg(short, long = "out", alias = "output", value_name = "PATH")]
    output: Option<PathBuf>,
    /// Write no recording and no plots
    #[arg(long, conflicts_with_all = ["output", "serve", "open"])]
    no_output: bool,
    /// Exit with 6 if a value differs by more from that of the first run: outflow_volume=1%, or
    /// =1e-3 in its unit; may be repeated
    #[arg(long = "tolerance", value_name = "KEY=AMOUNT")]
    tolerances: Vec<Tolerance>,
    /// Write report.html beside the recording: the flows side by side, curves, results
    #[arg(long, conflicts_with = "no_output")]
    report: bool,
    /// Print the comparison as JSON
    #[arg(long)]
    json: bool,
    /// Serve the viewer with the recording on 127.0.0.1 until interrupted
    #[arg(long)]
    serve: bool,
    /// Port of the served page; 0 takes any free one
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Serve the viewer and open it in the browser
    #[arg(long)]
    open: bool,
}

impl From<ResultsError> for Failure {
    fn from(e: ResultsError) -> Self {
        match e {
            ResultsError::Scene(e) => e.into(),
            ResultsError::Usage(text) => Failure::Usage(text),
            other => Failure::Environment(other.to_string()),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let members = results::open_all(&args.runs)?;
    let found = compare::compare(&members, &args.tolerances)?;
    let (comparison, served) = if args.no_output {
        (found.comparison, None)
    } else {
        let path = args.output.clone().unwrap_or_else(|| default_output(&members));
        let mut sinks = vec![Sink::Save(path.clone())];
        if args.serve || args.open {
            sinks.push(Sink::Serve { port: args.port });
        }
        let (mut comparison, served) = write(found, &members, &path, &sinks)?;
        if args.report {
            let page = path.with_file_name("report.html");
            report::write(&members, Detail::default(), &page)?;
            comparison.files.push(page.display().to_string());
        }
        (comparison, served)
    };
    for note in &comparison.notes {
        eprintln!("note: {note}");
    }
    if args.json {
        let json = serde_json::to_string_pretty(&comparison)
            .map_err(|e| Failure::Environment(e.to_string()))?;
        print(&json)?;
    } else {
        print(&compare::terminal(&comparison))?;
    }
    if let Some(served) = served {
        show(&served, args.open);
    }
    match comparison.tolerances.iter().find(|v| !v.within) {
        Some(outside) => Err(Failure::Differs(outside.text.clone())),
        None => Ok(()),
    }
}

/// Writes the recording and the plots. Returns the comparison with the names of the files, and the
/// served viewer if there is one.
pub(super) fn write(
    found: compare::Found,
    members: &[Member],
    path: &Path,
    sinks: &[Sink],
) -> Result<(Comparison, Option<Served>), Failure> {
    let recorded = members.iter().filter(|m| m.recorded.is_some()).count() > 1;
    let plotted = members.iter().filter(|m| m.table.is_some()).count() > 1;
    if let Some(folder) = path.parent().filter(|_| recorded || plotted) {
        std::fs::create_dir_all(folder).map_err(|e| {
            Failure::Environment(format!("cannot make the folder {}: {e}", folder.display()))
        })?;
    }
    // The earlier recording is kept until the new one is complete.
    let mut aside = Aside::default();
    may_replace(path, Kind::Recording)?;
    if recorded && path.is_file() {
        aside.take(path, &beside(path, ".replaced"))?;
    }
    let (mut comparison, finished) = compare::record(found, members, sinks)?;
    aside.discard();
    let mut files = vec![];
    let mut served = None;
    if let Some(finished) = finished {
        files.extend(finished.saved.into_iter().map(|s| s.path));
        served = finished.served;
    }
    files.extend(compare::plots(&path.with_extension(""), members)?);
    comparison.files = files.iter().map(|f| f.display().to_string()).collect();
    Ok((comparison, served))
}

/// Default path of the recording: one folder per set of runs, overwritten by the next comparison.
fn default_output(members: &[Member]) -> PathBuf {
    const LONGEST: usize = 80;
    let names: Vec<String> = members
        .iter()
        .map(|m| m.name.replace(|c: char| !c.is_alphanumeric() && !"-_.".contains(c), "_"))
        .collect();
    let folder: String = names.join("-vs-").chars().take(LONGEST).collect();
    Path::new("comparisons").join(folder).join("compare.rrd")
}

/// Prints the address of the viewer, and waits for an interrupt.
fn show(served: &Served, open: bool) {
    let url = served.url();
    eprintln!("viewer: {url} (Ctrl-C ends)");
    if open && let Err(e) = webbrowser::open(url) {
        eprintln!("warning: no browser could be opened ({e}); open the link yourself");
    }
    wait_for_interrupt(&watch_interrupts(super::code::INTERRUPTED));
}
