//! `grainscope plan`: which effects are solved, and why.

use super::{Failure, print};
use crate::record::text::plan_text;

#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let source = super::source(&args.scene, &args.sets)?;
    let (_, plan) = super::resolve(&source)?;
    let list = plan.describe();
    if args.json {
        let text =
            serde_json::to_string_pretty(&list).map_err(|e| Failure::Environment(e.to_string()))?;
        print(&text)
    } else {
        print(&plan_text(&list))
    }
}
