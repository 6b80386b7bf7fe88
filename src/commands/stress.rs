//! This module implements `grainscope stress`: hostile scenes, with a verdict for each.

use super::{Failure, print};
use crate::record::replace::{self, Kind};
use crate::stress::{self, Outcome, Trial};
use crate::words::count;
use std::path::PathBuf;

/// Run hostile scenes and check each against fixed criteria.
///
/// Prints one table as Markdown. If a trial fails, the exit code is 6, and its scene and the reason
/// are saved.
#[derive(clap::Args)]
pub struct Args {
    /// Run only trials whose group or name contains one of these texts (in upper or lower case)
    #[arg(value_name = "NAME-FILTER")]
    filters: Vec<String>,
    /// Run the short trials only, in less than a minute
    #[arg(long)]
    quick: bool,
    /// Print criteria and outcomes as JSON
    #[arg(long)]
    json: bool,
    /// Write FOLDER/stress.md; only when all trials are run
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["quick", "filters"])]
    write: Option<PathBuf>,
    /// Folder for the scenes of failing trials
    #[arg(long, value_name = "DIR", default_value = "stress-failures")]
    keep: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let filters: Vec<String> = args.filters.iter().map(|f| f.to_lowercase()).collect();
    let wanted = |t: &Trial| {
        let title = format!("{}: {}", t.group, t.name).to_lowercase();
        (t.quick || !args.quick)
            && (filters.is_empty() || filters.iter().any(|f| title.contains(f)))
    };
    let trials: Vec<Trial> = stress::all()?.into_iter().filter(wanted).collect();
    if trials.is_empty() {
        return Err(Failure::Usage(format!("no trial matches {:?}", args.filters.join(", "))));
    }
    let outcomes = stress::run_all(&trials, |done, o| {
        eprintln!("{done}/{} {}: {}: {}", trials.len(), o.group, o.name, o.verdict);
    });
    if args.json {
        print(&stress::json(&outcomes).map_err(|e| Failure::Environment(e.to_string()))?)?;
    } else {
        print(&stress::table(&outcomes).markdown())?;
    }
    if let Some(folder) = &args.write {
        let file = folder.join("stress.md");
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::Environment(format!("{}: {e}", folder.display())))?;
        replace::write(&file, stress::markdown(&outcomes), Kind::Page)?;
    }
    conclude(args, &trials, &outcomes)
}

/// Saves failed trials and reports them.
fn conclude(args: &Args, trials: &[Trial], outcomes: &[Outcome]) -> Result<(), Failure> {
    let mut lines = Vec::new();
    for (trial, o) in trials.iter().zip(outcomes).filter(|(_, o)| o.verdict.is_failure()) {
        let place = stress::keep(&args.keep, trial, o)
            .map_err(|e| Failure::Environment(format!("{}: {e}", args.keep.display())))?;
        lines.push(format!("\n  {}: {}: {}\n    {}", o.group, o.name, o.verdict, place.display()));
    }
    if lines.is_empty() {
        eprintln!("{}, none failed", count(outcomes.len(), "trial"));
        return Ok(());
    }
    let head = format!("failed: {} of {}", lines.len(), count(outcomes.len(), "trial"));
    Err(Failure::Differs(head + &lines.concat()))
}
