//! This module implements `grainscope film`: the frames of runs as a film or as images.

use super::report::Amount;
use super::{Failure, print};
use crate::light::film::{FilmError, Look, Studio};
use crate::light::reel::{Reel, ReelError};
use crate::results;
use crate::session::progress_bar;
use crate::words::count;
use std::path::PathBuf;

/// Draw the frames of runs side by side: a film (.gif, .mp4) or numbered images (.png).
///
/// GIF and PNG need no other program; MP4 needs `ffmpeg`.
#[derive(clap::Args)]
pub struct Args {
    /// Folders of runs, or recordings; the first one has the times of the film
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Path of the film; flow.png writes flow_00000.png, flow_00001.png, ...
    #[arg(short, long = "out", alias = "output", value_name = "PATH")]
    output: PathBuf,
    /// Width (pixels)
    #[arg(long, value_name = "PIXELS", default_value_t = 720, value_parser = clap::value_parser!(u32).range(160..=4096))]
    width: u32,
    /// Height (pixels) [default: what the shape of the domain needs]
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(160..=4096))]
    height: Option<u32>,
    /// Frames per second
    #[arg(long, value_name = "N", default_value_t = 20.0, value_parser = frequency)]
    fps: f64,
    /// Colour of the particles: material, or the name of a field
    #[arg(long, value_name = "FIELD", default_value = "material")]
    colour: String,
    /// Show this field instead of the particles
    #[arg(long, value_name = "FIELD", conflicts_with = "colour")]
    field: Option<String>,
    /// Draw on a dark background
    #[arg(long)]
    dark: bool,
    /// Leave the dye lines out
    #[arg(long)]
    no_dye: bool,
    #[command(flatten)]
    amount: Amount,
}

fn frequency(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(fps) if (0.1..=100.0).contains(&fps) => Ok(fps),
        _ => Err("expected a number from 0.1 to 100".into()),
    }
}

impl From<FilmError> for Failure {
    fn from(e: FilmError) -> Self {
        match e {
            FilmError::Format(_) | FilmError::Size(..) => Failure::Usage(e.to_string()),
            other => Failure::Environment(other.to_string()),
        }
    }
}

impl From<ReelError> for Failure {
    fn from(e: ReelError) -> Self {
        Failure::Environment(e.to_string())
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let members = results::open_each(&args.runs)?;
    let reels: Vec<Reel> =
        members.iter().map(|m| Reel::of(m, args.amount.detail())).collect::<Result<_, _>>()?;
    for name in [Some(&args.colour), args.field.as_ref()].into_iter().flatten() {
        let fields: Vec<&str> =
            reels.iter().flat_map(|r| r.ranges.keys()).map(String::as_str).collect();
        if name != "material" && !fields.contains(&name.as_str()) {
            return Err(Failure::Usage(format!(
                "no field `{name}` was recorded; expected one of: material, {}",
                fields.join(", ")
            )));
        }
    }
    let look = Look {
        dark: args.dark,
        particles: args.field.is_none(),
        colour: args.colour.clone(),
        field: args.field.clone().unwrap_or_default(),
        dye: !args.no_dye,
    };
    let height = args.height.unwrap_or_else(|| usual_height(args.width, &reels));
    let studio = Studio::new(reels, &look, [args.width, height])?;
    let bar = progress_bar(studio.times.len() as u64, false);
    let files = studio.write(&args.output, args.fps, &mut |k| bar.set_position(k as u64 + 1));
    bar.finish_and_clear();
    let files = files?;
    print(&match files.as_slice() {
        [one] => format!("wrote {} to {}", count(studio.times.len(), "frame"), one.display()),
        [first, .., last] => format!("wrote {} to {}", first.display(), last.display()),
        [] => "there are no frames".into(),
    })
}

/// Height at which the domains of all runs, side by side, fill the width.
fn usual_height(width: u32, reels: &[Reel]) -> u32 {
    let shape = reels.first().map_or(1.0, |r| r.description.shape());
    let each = f64::from(width) / reels.len() as f64;
    (each * shape + 60.0).clamp(300.0, 1.4 * f64::from(width).max(400.0)).round() as u32 & !1
}
