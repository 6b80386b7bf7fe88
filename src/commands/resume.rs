//! This module implements `grainscope resume`: it continues a run that stopped before its end.

use super::run::{Output, close};
use super::{Failure, print};
use crate::record::checkpoint;
use crate::record::folder::RunFolder;
use crate::record::replace::{Kind, may_replace};
use crate::record::rerun_log::Sink;
use crate::scene::{self, scene_hash};
use crate::session::{Options, Safety, Session, SessionError, tell, watch_interrupts};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Continue a run that stopped before its end, for any reason.
///
/// The run continues from its newest valid checkpoint: its state is bitwise identical to that of an
/// uninterrupted run, and table and recording continue without a gap.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of the run
    folder: PathBuf,
    /// Stop after N steps, counted from the start of the run
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Serve the viewer from this process on 127.0.0.1, while running and after
    #[arg(long)]
    serve: bool,
    /// Port of the served page; 0 takes any free one
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    #[command(flatten)]
    safety: Safety,
    #[command(flatten)]
    output: Output,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let folder = &args.folder;
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(Failure::Environment(format!("{folder}: there is no such folder of a run")));
    }
    if is_finished(folder) {
        return finished(folder);
    }
    let source = scene::load(folder.join("scene.toml"))?;
    let (scene, plan) = super::resolve(&source)?;
    super::memory::afford(&plan)?;
    let (plan, hash) = (Arc::new(plan), scene_hash(&scene));
    let interrupted = watch_interrupts(super::code::INTERRUPTED);
    let viewers = args.serve.then_some(Sink::Serve { port: args.port });
    let options = Options {
        viewers: viewers.into_iter().collect(),
        safety: args.safety,
        steps: args.steps,
        ..Options::default()
    };
    let mut claimed = Some(RunFolder::claim(folder)?);
    if is_finished(folder) {
        return finished(folder);
    }
    let mut faults = Vec::new();
    for (step, path) in checkpoint::list(folder) {
        let opened = checkpoint::read(&path, &hash).map_err(SessionError::from).and_then(|state| {
            Session::reopen(&options, &plan, &mut claimed, &state, interrupted.clone())
        });
        match opened {
            Ok(session) => {
                for fault in &faults {
                    tell(format_args!("warning: {fault}; using the previous checkpoint"));
                }
                tell(format_args!("continuing after step {step}"));
                // The old summary describes the earlier part of the run.
                let summary = folder.join("summary.json");
                if may_replace(&summary, Kind::Json("state_hash")).is_ok() {
                    let _ = std::fs::remove_file(summary);
                }
                return close(session.go()?, args.output);
            }
            Err(SessionError::Unfit(text)) => faults.push(text),
            Err(other) => return Err(other.into()),
        }
    }
    let reasons: String = faults.iter().map(|f| format!("\n  {f}")).collect();
    let folder = folder.display();
    Err(Failure::Environment(format!(
        "{folder}: there is no checkpoint to continue from{reasons}\n  help: `grainscope run \
         {folder}/scene.toml --out {folder} --force` starts again; --checkpoint-every saves \
         checkpoints during a run"
    )))
}

fn finished(folder: &Path) -> Result<(), Failure> {
    print(&format!("{}: the run is finished; there is nothing to continue", folder.display()))
}

/// Whether the summary in the folder says that the run is finished.
fn is_finished(folder: &Path) -> bool {
    let summary = std::fs::read_to_string(folder.join("summary.json")).ok();
    let summary = summary.and_then(|t| serde_json::from_str::<serde_json::Value>(&t).ok());
    summary.is_some_and(|s| s["ending"] == "finished")
}
