//! This module implements `grainscope explore`: a page to change parameters while the fluid flows.

use super::Failure;
use crate::explorer::{Explorer, ExplorerError, Settings};
use crate::session::watch_interrupts;
use std::path::PathBuf;

/// Change parameters while the fluid flows, in a page of your browser.
///
/// This process serves the page to this machine only, under an address with a random token. Closing
/// the page does not end the run; Ctrl-C, or "Quit" in the page, does.
#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    #[arg(default_value = "silo")]
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Open the page in the browser
    #[arg(long)]
    open: bool,
    /// Start paused, before the first step
    #[arg(long)]
    paused: bool,
    /// Port of the page; 0 takes any free one
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Folder whose scenes are offered beside the presets
    #[arg(long, value_name = "DIR", default_value = ".")]
    dir: PathBuf,
    /// Folder of saved runs
    #[arg(short, long, value_name = "DIR", default_value = "runs")]
    out: PathBuf,
}

impl From<ExplorerError> for Failure {
    fn from(e: ExplorerError) -> Self {
        Failure::Environment(e.to_string())
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (scene, from_file) = super::find(&args.scene)?;
    // The first interrupt waits for the end of the step, a second one does not.
    let interrupted = watch_interrupts(0);
    let explorer = Explorer::open(Settings {
        scene,
        from_file,
        sets: args.sets.clone(),
        folder: args.dir.clone(),
        out: args.out.clone(),
        port: args.port,
        paused: args.paused,
        interrupted,
    })?;
    super::print(&explorer.url)?;
    eprintln!("open this address in a browser; Ctrl-C ends the program");
    if args.open
        && let Err(e) = webbrowser::open(&explorer.url)
    {
        eprintln!("warning: no browser could be opened: {e}");
    }
    explorer.wait();
    Ok(())
}
