//! This module implements `grainscope presets`: it lists the built-in scenes or prints one.

use super::{Failure, print};
use crate::scene::presets;

/// List the presets, or show one.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
}

#[derive(clap::Subcommand)]
enum Action {
    /// Print a preset's TOML
    Show {
        /// Name of the preset
        name: String,
    },
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.action {
        Some(Action::Show { name }) => print(presets::find(name)?.text()),
        None => {
            let lines: Vec<String> = presets::list()
                .into_iter()
                .map(|(name, description)| format!("{name:<20} {description}"))
                .collect();
            print(&lines.join("\n"))
        }
    }
}
