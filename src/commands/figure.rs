//! This module implements `grainscope figure`: the figures of the source paper and those of grains, one
//! command each.

mod bands;
mod discharge;
mod paper;
mod round_silo;
mod runs;

use super::{Failure, print};
use crate::record::text::duration;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Make a figure of the source paper or of grains: runs, plots, snapshots, recordings.
#[derive(clap::Args)]
pub struct Args {
    /// Figure to make
    figure: Name,
    /// Use coarse meshes and few frames, as a test: seconds instead of minutes
    #[arg(long)]
    quick: bool,
    /// Folder of the output [default: figures/<name>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Overwrite runs that are already in the folder
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Name {
    /// Figs. 1 and 3: discharge of a silo for five internal lengths
    Silo,
    /// Fig. 4: alignment of texture in shear
    Alignment,
    /// Level and discharge rate of an hour-glass and of a water clock
    Hourglass,
    /// Discharge rate of grains against the aperture (Beverloo's law)
    Beverloo,
    /// Discharge rate of grains from a round hole against its diameter
    #[value(name = "round_beverloo")]
    RoundBeverloo,
    /// Width of a shear band of grains against the mesh size, with and without internal length
    Bands,
    /// Discharge of a round and of a plane silo against the internal length
    #[value(name = "round_silo")]
    RoundSilo,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let name = match args.figure {
        Name::Silo => paper::SILO.name,
        Name::Alignment => paper::ALIGNMENT.name,
        Name::Hourglass => "hourglass",
        Name::Beverloo => "beverloo",
        Name::RoundBeverloo => "round_beverloo",
        Name::Bands => "bands",
        Name::RoundSilo => "round_silo",
    };
    let out = args.out.clone().unwrap_or_else(|| Path::new("figures").join(name));
    let clock = Instant::now();
    let said = match args.figure {
        Name::Silo => paper::make(&paper::SILO, args, &out),
        Name::Alignment => paper::make(&paper::ALIGNMENT, args, &out),
        Name::Hourglass => discharge::hourglass(args, &out),
        Name::Beverloo => discharge::beverloo(&discharge::SLIT, args, &out),
        Name::RoundBeverloo => discharge::beverloo(&discharge::HOLE, args, &out),
        Name::Bands => bands::make(args, &out),
        Name::RoundSilo => round_silo::make(args, &out),
    }?;
    print(&format!("{said}in {}", duration(clock.elapsed().as_secs_f64())))
}

/// Lines that name the two files of a picture.
fn files(stem: &Path) -> String {
    [".svg", ".png"].map(|suffix| format!("wrote {}{suffix}\n", stem.display())).concat()
}
