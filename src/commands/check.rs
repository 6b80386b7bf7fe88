//! `grainscope check`: validate a scene and do nothing else.

use super::{Failure, print, tell};
use crate::sim;

#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let source = super::source(&args.scene, &args.sets)?;
    let (scene, plan) = super::resolve(&source)?;
    // Another machine may have the memory.
    if let Err(Failure::Environment(text)) = super::memory::afford(&plan) {
        tell(format_args!("warning: {text}"));
    }
    sim::initial::particles(&plan).map_err(sim::SimError::from)?;
    for w in &plan.warnings {
        eprintln!("warning: {w}");
    }
    print(&format!("{}: ok ({})", source.name(), scene.name))
}
