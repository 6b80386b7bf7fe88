//! This module implements `grainscope report`: one page of runs that opens without a server.

use super::{Failure, print};
use crate::light::pack::MOST_PARTICLES;
use crate::light::reel::{Detail, MOST_FRAMES};
use crate::light::report::{self, ReportError};
use crate::results;
use std::path::PathBuf;

/// Write one page of one or more runs: the flow, curves, results, scene. It opens without a network.
///
/// A run is given as the folder that `run` wrote, as one of its files, or as a recording (.rrd).
#[derive(clap::Args)]
pub struct Args {
    /// Folders of runs, or recordings
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Path of the page [default: report.html in the folder of a single run, else ./report.html]
    #[arg(short, long = "out", alias = "output", value_name = "PATH")]
    output: Option<PathBuf>,
    #[command(flatten)]
    detail: Amount,
}

/// How much of the recordings a report or film shows.
#[derive(clap::Args, Clone, Copy)]
pub struct Amount {
    /// Largest number of frames of a run; more are evenly thinned
    #[arg(long, value_name = "N", default_value_t = MOST_FRAMES as u32, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Largest number of particles in a frame; more are evenly thinned
    #[arg(long, value_name = "N", default_value_t = MOST_PARTICLES as u32, value_parser = clap::value_parser!(u32).range(1..))]
    particles: u32,
}

impl Amount {
    /// The detail of the packed frames.
    pub fn detail(self) -> Detail {
        let (frames, particles) = (self.frames as usize, self.particles as usize);
        Detail { frames, particles, ..Detail::default() }
    }
}

impl From<ReportError> for Failure {
    fn from(e: ReportError) -> Self {
        Failure::Environment(e.to_string())
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let members = results::open_each(&args.runs)?;
    let path = args.output.clone().unwrap_or_else(|| match args.runs.as_slice() {
        [one] if one.is_dir() => one.join("report.html"),
        _ => PathBuf::from("report.html"),
    });
    let bytes = report::write(&members, args.detail.detail(), &path)?;
    for note in members.iter().flat_map(|m| &m.notes) {
        eprintln!("note: {note}");
    }
    print(&format!("wrote {} ({:.1} MB)", path.display(), bytes as f64 / 1e6))
}
