//! This module implements `grainscope plan`: which effects are solved, why, and the time each
//! takes.

use super::memory;
use super::{Failure, print, tell};
use crate::cost::effects;
use crate::plan::memory::Memory;
use crate::record::text::plan_text;
use std::sync::Arc;

/// Number of measured steps of each run.
const STEPS: u32 = 4;

/// Print which effects of a scene are solved, and the time each takes.
#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Do not measure the time of each effect
    #[arg(long)]
    no_measure: bool,
    /// Print the plan as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let source = super::source(&args.scene, &args.sets)?;
    let (_, plan) = super::resolve(&source)?;
    let plan = Arc::new(plan);
    let mut list = plan.describe();
    let memory = Memory::of(&plan);
    if !args.no_measure {
        memory::afford(&plan)?;
        eprintln!("taking some steps to measure the time of each effect (--no-measure skips this)");
        effects::measure(&plan, &mut list, STEPS)?;
    }
    tell(format_args!("a run needs about {memory}"));
    if args.json {
        let text =
            serde_json::to_string_pretty(&list).map_err(|e| Failure::Environment(e.to_string()))?;
        print(&text)
    } else {
        print(&plan_text(&list))
    }
}
