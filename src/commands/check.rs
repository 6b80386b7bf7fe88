//! This module implements `grainscope check`: it validates a scene without running it.

use super::{Failure, print, tell};
use crate::sim;

/// Validate a scene without running it.
#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let source = super::source(&args.scene, &args.sets)?;
    let (scene, plan) = super::resolve(&source)?;
    // This is only a warning, because another machine may have more memory.
    if let Err(Failure::Environment(text)) = super::memory::afford(&plan) {
        tell(format_args!("warning: {text}"));
    }
    let (_, empty) = sim::initial::particles(&plan).map_err(sim::SimError::from)?;
    for w in plan.warnings.iter().chain(&sim::empty_regions(&plan, empty)) {
        eprintln!("warning: {w}");
    }
    print(&format!("{}: ok ({})", source.name(), scene.name))
}
