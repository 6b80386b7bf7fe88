//! This module implements `grainscope export`: it converts the frames of a recording for other
//! programs.

use super::{Failure, print};
use crate::export::{self, ExportError, Format};
use crate::words::count;
use std::path::PathBuf;

/// Export particles and fields of every frame, for ParaView or as tables.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of a run, or a recording
    run: PathBuf,
    /// vtu: VTK files and .pvd series that ParaView opens; csv: tables; parquet: tables for data
    /// frames, with the series
    #[arg(long, value_enum)]
    format: FormatName,
    /// Folder of the output [default: <folder of the run>/<format>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FormatName {
    Vtu,
    Csv,
    Parquet,
}

impl From<ExportError> for Failure {
    fn from(e: ExportError) -> Self {
        match e {
            ExportError::Run(e) => e.into(),
            other => Failure::Environment(other.to_string()),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let frames = export::read(&args.run)?;
    let (format, name) = match args.format {
        FormatName::Vtu => (Format::Vtu, "vtu"),
        FormatName::Csv => (Format::Csv, "csv"),
        FormatName::Parquet => (Format::Parquet, "parquet"),
    };
    let beside = if args.run.is_dir() { Some(args.run.as_path()) } else { args.run.parent() };
    let folder = args.out.clone().unwrap_or_else(|| beside.unwrap_or(&args.run).join(name));
    let files = export::write(&frames, format, &folder)?;
    print(&format!(
        "wrote {} of {} to {}",
        count(files, "file"),
        count(frames.instants.len(), "frame"),
        folder.display()
    ))
}
