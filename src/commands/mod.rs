//! This module is the command line, the top layer of the crate. No other module imports it.

mod check;
mod chosen;
mod columns;
mod compare;
mod cost;
mod cost_page;
mod doctor;
mod explore;
mod export;
mod figure;
mod film;
mod memory;
mod new;
mod plan;
mod presets;
mod reference;
mod repair;
mod report;
mod resume;
mod run;
mod stress;
mod sweep;
mod verify;

use crate::cases::CaseError;
use crate::record::folder::FolderError;
use crate::record::plots::PlotError;
use crate::record::replace::ReplaceError;
use crate::record::rerun_log::RecordError;
use crate::scene::{self, Scene, SceneError, SceneSource};
use crate::session::{SessionError, handle_file_size_limit, tell};
use crate::sim::SimError;
use crate::simd::{self, InstructionSet, Simd};
use crate::words::count;
use clap::{CommandFactory, Parser, Subcommand};
use std::path::Path;
use std::process::ExitCode;

/// Exit codes, as documented in `--help`.
mod code {
    /// The command line is wrong.
    pub const USAGE: u8 = 2;
    /// The scene is invalid.
    pub const SCENE: u8 = 3;
    /// A solution did not converge.
    pub const NOT_CONVERGED: u8 = 4;
    /// A value is not finite.
    pub const NON_FINITE: u8 = 5;
    /// A comparison differs or a check fails.
    pub const DIFFERS: u8 = 6;
    /// The program was interrupted.
    pub const INTERRUPTED: u8 = 130;
    /// A file, port or viewer cannot be used, or memory is too small.
    pub const ENVIRONMENT: u8 = 1;
}

const EXIT_CODES: &str = "\
Exit codes:
  0    success
  1    a file, folder, port or viewer cannot be used, or memory is too small
  2    usage error
  3    the scene is invalid
  4    not converged
  5    not finite
  6    a comparison differs or a check fails
  130  interrupted";

const EXAMPLES: &str = "\
Examples:
  grainscope run silo                                   discharge of a silo, recorded
  grainscope run presets/silo.toml --set alpha=5/3 --out runs/stiff
  grainscope run shear_alignment --save align.rrd --serve   save and watch at once
  grainscope compare runs/silo runs/stiff               two runs side by side, and their differences
  grainscope sweep silo --vary alpha=0,1/3,5/3 --repeat-seeds 3   many runs, one table
  grainscope plan silo                                  which effects are solved, and why
  grainscope presets show silo                          the scene as TOML";

/// Compute and explore the flow of grains with microstructure.
///
/// The program uses an implicit Material Point Method for fluids with an internal length (Cosserat)
/// and an orientation (director). Runs are recorded for the Rerun viewer.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Number of threads, by default one per processor; no result depends on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Instruction set of our own kernels, by default the best that the processor has; results of
    /// different sets differ in their last digits
    #[arg(long, global = true, value_name = "SET", value_parser = instruction_set)]
    simd: Option<InstructionSet>,
}

/// Reads the name of an instruction set.
fn instruction_set(name: &str) -> Result<InstructionSet, String> {
    let found = Simd::NAMES.iter().find(|named| named.0 == name);
    let names = || Simd::NAMES.iter().map(|named| named.0).collect::<Vec<_>>().join(", ");
    found.map(|named| named.1).ok_or_else(|| format!("expected one of {}", names()))
}

#[derive(Subcommand)]
enum Command {
    /// Run a scene: a preset or a TOML file
    Run(run::Args),
    /// Continue a run that stopped before its end, for any reason
    Resume(resume::Args),
    /// Change parameters while the fluid flows, in a page of your browser
    Explore(explore::Args),
    /// Print which effects of a scene are solved, and the time each takes
    Plan(plan::Args),
    /// Validate a scene without running it
    Check(check::Args),
    /// List the presets, or show one
    Presets(presets::Args),
    /// Measure the error of every case with a known solution, and print the results
    Verify(verify::Args),
    /// Run hostile scenes, and print a verdict for each
    Stress(stress::Args),
    /// Measure error and time of the accuracy settings of a scene
    Cost(cost::Args),
    /// Compare runs: values, curves, fields and scenes, and one recording side by side
    Compare(compare::Args),
    /// Export particles and fields: VTK files for ParaView, CSV or Parquet tables
    Export(export::Args),
    /// Write one page of runs that opens from a disk: the flow, curves, results, scene
    Report(report::Args),
    /// Draw the frames of runs: a film (.gif, .mp4) or images (.png)
    Film(film::Args),
    /// Run a scene for many values of its parameters, here or on a cluster
    Sweep(sweep::Args),
    /// Make a figure of the source paper or of grains: runs, plots, snapshots, recordings
    Figure(figure::Args),
    /// Close the recording or the files of a run that was killed
    Repair(repair::Args),
    /// Print versions, processor, memory, disk, viewer and ports, for a bug report
    Doctor(doctor::Args),
    /// Print the columns of the series with units and meanings, as Markdown
    Columns,
    /// Write a commented skeleton of a scene, to start from
    New(new::Args),
    /// Print the reference of scene files as Markdown: every key with unit, default, range, example
    Reference,
    /// Print the JSON schema of scene files
    Schema,
    /// Print completions for a shell
    Completions { shell: clap_complete::Shell },
    /// Print the manual page
    Man,
}

/// The failure of a command. It decides the message and the exit code.
#[derive(Debug)]
pub enum Failure {
    /// The scene is invalid.
    Scene(Box<SceneError>),
    /// The simulation failed.
    Sim(SimError),
    /// A file, folder, port or viewer cannot be used, or memory is too small; with the message.
    Environment(String),
    /// The command line is wrong; with the message.
    Usage(String),
    /// The user interrupted the command.
    Interrupted,
    /// A comparison differs or a check fails; with the message.
    Differs(String),
}

impl From<CaseError> for Failure {
    fn from(e: CaseError) -> Self {
        match e {
            CaseError::Scene(e) => e.into(),
            CaseError::Sim(e) => e.into(),
        }
    }
}
impl From<SceneError> for Failure {
    fn from(e: SceneError) -> Self {
        Failure::Scene(Box::new(e))
    }
}
impl From<SimError> for Failure {
    fn from(e: SimError) -> Self {
        Failure::Sim(e)
    }
}
impl From<SessionError> for Failure {
    fn from(e: SessionError) -> Self {
        match e {
            SessionError::Sim(e) => Failure::Sim(e),
            SessionError::Environment(text) | SessionError::Unfit(text) => {
                Failure::Environment(text)
            }
            SessionError::Interrupted => Failure::Interrupted,
        }
    }
}
impl From<RecordError> for Failure {
    fn from(e: RecordError) -> Self {
        Failure::Environment(e.to_string())
    }
}
impl From<PlotError> for Failure {
    fn from(e: PlotError) -> Self {
        Failure::Environment(e.to_string())
    }
}
impl From<ReplaceError> for Failure {
    fn from(e: ReplaceError) -> Self {
        Failure::Environment(e.to_string())
    }
}
impl From<FolderError> for Failure {
    fn from(e: FolderError) -> Self {
        Failure::Environment(e.to_string())
    }
}

impl Failure {
    /// The failure in one line; `None` for an interrupt and for failed checks.
    fn describe(&self) -> Option<String> {
        match self {
            Failure::Sim(e) => Some(format!("{e}; {}", e.remedy())),
            Failure::Environment(text) | Failure::Usage(text) => Some(text.clone()),
            Failure::Scene(e) => Some(e.one_line()),
            Failure::Interrupted | Failure::Differs(_) => None,
        }
    }

    fn code(&self) -> u8 {
        match self {
            Failure::Scene(_) => code::SCENE,
            Failure::Sim(SimError::Unfilled(_)) => code::SCENE,
            Failure::Sim(e) if e.is_non_finite() => code::NON_FINITE,
            Failure::Sim(_) => code::NOT_CONVERGED,
            Failure::Environment(_) => code::ENVIRONMENT,
            Failure::Usage(_) => code::USAGE,
            Failure::Interrupted => code::INTERRUPTED,
            Failure::Differs(_) => code::DIFFERS,
        }
    }

    fn print(self) {
        match self {
            // Without a position in the text miette's report would not name the file.
            Failure::Scene(e) if e.span().is_none() => {
                tell(format_args!("error: {}", e.headline()));
                if let Some(help) = e.remedy() {
                    tell(format_args!("  help: {help}"));
                }
                let others = e.others().iter().flat_map(SceneError::lines);
                others.for_each(|l| tell(format_args!("error: {l}")));
            }
            Failure::Scene(e) => tell(format_args!("{:?}", miette::Report::new(*e))),
            Failure::Sim(e) => tell(format_args!("error: {e}\n  help: {}", e.remedy())),
            Failure::Environment(text) | Failure::Usage(text) | Failure::Differs(text) => {
                tell(format_args!("error: {text}"))
            }
            Failure::Interrupted => {}
        }
    }
}

/// Reads the command line, runs the command and returns the exit code.
pub fn main() -> ExitCode {
    let Cli { command, threads, simd } = Cli::parse();
    handle_file_size_limit();
    let outcome =
        set_threads(threads).and_then(|()| set_simd(simd)).and_then(|()| run_command(command));
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let code = failure.code();
            failure.print();
            ExitCode::from(code)
        }
    }
}

/// Sets the number of threads of the global pool, if one is given.
fn set_threads(threads: Option<u16>) -> Result<(), Failure> {
    let Some(n) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n));
    pool.build_global()
        .map_err(|e| Failure::Environment(format!("cannot start {}: {e}", count(n, "thread"))))
}

/// Sets the instruction set from the option, or else from the environment variable.
fn set_simd(set: Option<InstructionSet>) -> Result<(), Failure> {
    let by_environment = || {
        let name = std::env::var(simd::VARIABLE).ok()?;
        let wrong = |e| Failure::Environment(format!("{} is `{name}`: {e}", simd::VARIABLE));
        Some(instruction_set(&name).map_err(wrong))
    };
    let Some(set) = set.map(Ok).or_else(by_environment).transpose()? else { return Ok(()) };
    Simd::limit(set).map_err(|best| {
        let (set, best) = (set.name(), best.name());
        Failure::Environment(format!("this processor has no {set}; its best set is {best}"))
    })
}

fn run_command(command: Command) -> Result<(), Failure> {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Resume(args) => resume::run(&args),
        Command::Repair(args) => repair::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Explore(args) => explore::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Check(args) => check::run(&args),
        Command::Presets(args) => presets::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Stress(args) => stress::run(&args),
        Command::Cost(args) => cost::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Film(args) => film::run(&args),
        Command::Sweep(args) => sweep::run(&args),
        Command::Figure(args) => figure::run(&args),
        Command::Columns => print(&columns::markdown()),
        Command::New(args) => new::run(&args),
        Command::Reference => print(&reference::markdown()),
        Command::Schema => print(&scene::json_schema()),
        Command::Completions { shell } => {
            let mut out = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "grainscope", &mut out);
            print(&String::from_utf8_lossy(&out))
        }
        Command::Man => {
            let mut out = Vec::new();
            match clap_mangen::Man::new(Cli::command()).render(&mut out) {
                Ok(()) => print(&String::from_utf8_lossy(&out)),
                Err(e) => Err(Failure::Environment(e.to_string())),
            }
        }
    }
}

/// Writes a text to stdout. A closed pipe is not an error.
fn print(text: &str) -> Result<(), Failure> {
    use std::io::Write;
    match writeln!(std::io::stdout(), "{}", text.trim_end()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Environment(format!("cannot write the output: {e}")))
        }
        _ => Ok(()),
    }
}

/// Finds a scene by preset name or path, and applies the `--set` options.
fn source(name: &str, sets: &[String]) -> Result<SceneSource, Failure> {
    Ok(find(name)?.0.with_sets(sets)?)
}

/// Finds a scene by preset name or path. The flag says whether it is a file.
fn find(name: &str) -> Result<(SceneSource, bool), Failure> {
    let path = Path::new(name);
    let is_path = path.extension().is_some() || name.contains(['/', '\\']) || path.is_file();
    let source = if is_path { scene::load(path)? } else { scene::presets::find(name)? };
    Ok((source, is_path))
}

/// Parses and plans the scene of a source. Errors have positions in the source.
fn resolve(source: &SceneSource) -> Result<(Scene, crate::plan::Plan), Failure> {
    let scene = scene::parse(source)?;
    let plan = crate::plan::resolve(&scene).map_err(|e| e.with_source(source))?;
    Ok((scene, plan))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_outputs_are_named_alike() {
        let mut count = 0;
        for command in Cli::command().get_subcommands() {
            for arg in command.get_arguments().filter(|a| a.get_long() == Some("out")) {
                assert_eq!(arg.get_short(), Some('o'), "{}", command.get_name());
                count += 1;
            }
            let other = command.get_arguments().find(|a| a.get_long() == Some("output"));
            assert!(other.is_none(), "{}", command.get_name());
        }
        assert_eq!(count, 9);
    }
}
