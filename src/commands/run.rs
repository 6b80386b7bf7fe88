//! This module implements `grainscope run`: it runs a scene and writes a recording, tables and
//! plots.

use super::chosen;
use super::{Failure, memory, print};
use crate::light::reel::Detail;
use crate::light::report as page;
use crate::record::folder::{self, Loaded};
use crate::record::rerun_log::Sink;
use crate::record::summary::Ending;
use crate::record::text::duration;
use crate::results::Member;
use crate::scene::{Quantity, Scene, SceneSource, Scope, scene_hash};
use crate::session::{
    Budget, Ended, Options, Recording, Safety, Session, tell, wait_for_interrupt, watch_interrupts,
};
use crate::words::count;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Run a scene: a preset or a TOML file.
#[derive(clap::Args)]
pub struct Args {
    /// Preset name or path of a TOML file
    scene: String,
    /// Set a parameter (alpha=5/3) or any key (accuracy.cells=16)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Use the fastest settings of the `grainscope cost` table that reach this accuracy (1%, 0.003)
    #[arg(long, value_name = "ERROR", value_parser = chosen::accuracy)]
    accuracy: Option<f64>,
    /// Use the most accurate settings that finish within this time (30s, 2min), and stop after it
    #[arg(long, value_name = "TIME", value_parser = chosen::budget, conflicts_with = "accuracy")]
    budget: Option<f64>,
    /// Folder of the run [default: runs/<scene name>, numbered if taken]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Overwrite a run that is already in the folder
    #[arg(long)]
    force: bool,
    /// Stop after N steps
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Stop at this time (s), at most the scene's time.end
    #[arg(long, value_name = "T", conflicts_with_all = ["accuracy", "budget"])]
    until: Option<String>,
    /// Write the recording to this path instead of the folder
    #[arg(long, value_name = "PATH", conflicts_with = "no_recording")]
    save: Option<PathBuf>,
    /// Write no recording
    #[arg(long)]
    no_recording: bool,
    /// Serve the viewer from this process on 127.0.0.1, while running and after
    #[arg(long)]
    serve: bool,
    /// Port of the served page; 0 takes any free one
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// Send to a running viewer (rerun+http://127.0.0.1:9876/proxy)
    #[arg(long, value_name = "URL")]
    connect: Option<String>,
    /// Start the `rerun` viewer found on the PATH
    #[arg(long)]
    spawn: bool,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    safety: Safety,
}

/// What a run prints at its end.
#[derive(clap::Args, Clone, Copy)]
pub struct Output {
    /// Print the summary as JSON on stdout
    #[arg(long)]
    pub json: bool,
    /// Print seconds per phase at the end
    #[arg(long)]
    pub profile: bool,
    /// Write report.html into the folder at the end: the flow, curves, results, scene
    #[arg(long)]
    pub report: bool,
}

impl Args {
    fn options(&self) -> Options {
        let mut viewers = Vec::new();
        if self.serve {
            viewers.push(Sink::Serve { port: self.port });
        }
        viewers.extend(self.connect.clone().map(Sink::Connect));
        viewers.extend(self.spawn.then_some(Sink::Spawn));
        let recording = match &self.save {
            _ if self.no_recording => Recording::None,
            Some(path) => Recording::File(path.clone()),
            None => Recording::Folder,
        };
        Options { recording, viewers, safety: self.safety, steps: self.steps, quiet: false }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (loaded, file) = super::find(&args.scene)?;
    let source = loaded.with_sets(&args.sets)?;
    let chosen = chosen::choose(&source, args.accuracy, args.budget)?;
    let source = chosen.as_ref().map_or(Ok(source.clone()), |b| source.with_sets(&b.entry.sets))?;
    let (scene, plan) = match &args.until {
        None => super::resolve(&source)?,
        Some(text) => {
            let scene = shorten(&source, text)?;
            let plan = crate::plan::resolve(&scene).map_err(|e| e.with_source(&source))?;
            (scene, plan)
        }
    };
    let interrupted = watch_interrupts(super::code::INTERRUPTED);
    let plan = Arc::new(plan);
    memory::afford(&plan)?;
    let unchanged =
        crate::scene::parse(&loaded).is_ok_and(|s| scene_hash(&s) == scene_hash(&scene));
    let session = Session::start(&args.options(), &plan, interrupted, || {
        let loaded = file.then(|| Loaded { path: Path::new(&args.scene), unchanged });
        let out = args.out.as_deref();
        folder::create(&scene.name, out, args.force, loaded).map_err(Failure::from)
    })?;
    let budget = chosen.map(|b| Box::new(b) as Box<dyn Budget>);
    close(session.with_budget(budget).go()?, args.output)
}

/// Prints what there is, and serves the viewer until interrupted.
pub fn close(ended: Ended, output: Output) -> Result<(), Failure> {
    if output.json {
        print(&ended.json)?;
    } else {
        print(&report(&ended, output.profile))?;
    }
    let reported = if output.report { write_report(&ended) } else { Ok(()) };
    if let (Some(served), None) = (&ended.served, &ended.failure) {
        tell(format_args!("still serving {} (Ctrl-C ends)", served.url()));
        wait_for_interrupt(&ended.interrupted);
    }
    match ended.failure {
        Some(failure) => Err(failure.into()),
        None => {
            reported?;
            Ok(ended.plotted?)
        }
    }
}

/// Writes the report of a run into its folder.
fn write_report(ended: &Ended) -> Result<(), Failure> {
    let folder = Path::new(&ended.summary.folder);
    let path = folder.join("report.html");
    let bytes = page::write(&[Member::open(folder)?], Detail::default(), &path)?;
    tell(format_args!("wrote {} ({:.1} MB)", path.display(), bytes as f64 / 1e6));
    Ok(())
}

/// The scene with an earlier end. The interval between frames is unchanged.
fn shorten(source: &SceneSource, text: &str) -> Result<Scene, Failure> {
    let mut scene = crate::scene::parse(source)?;
    let scope = Scope::new(&scene).map_err(|e| e.with_source(source))?;
    let until = Quantity::expression(text).eval(&scope).map_err(|e| {
        Failure::Usage(format!("--until {text}: {}; give a time in seconds", e.message()))
    })?;
    let end = scene.time.end().and_then(|q| q.eval(&scope)).map_err(|e| e.with_source(source))?;
    if !(until > 0.0 && until <= end) {
        return Err(Failure::Usage(format!(
            "--until {until}: the scene runs from 0 to {end} s; use --set time.end={until} to run \
             longer"
        )));
    }
    let frames = f64::from(scene.recording.frames);
    scene.recording.frames = (frames * until / end).ceil() as u32;
    let mut kept = Vec::new();
    for q in scene.recording.times {
        if q.eval(&scope).map_err(|e| e.with_source(source))? <= until {
            kept.push(q);
        }
    }
    scene.recording.times = kept;
    scene.time.end = Some(Quantity::number(until));
    Ok(scene)
}

/// The text printed at the end of a run.
fn report(ended: &Ended, profile: bool) -> String {
    let s = &ended.summary;
    let round = s.geometry.is_round();
    let ending = match s.ending {
        Ending::Finished => "finished",
        Ending::StepLimit => "stopped at the step limit",
        Ending::BudgetSpent => "stopped at the time budget",
        Ending::Interrupted => "interrupted",
        Ending::Failed => "failed",
    };
    let mut out = format!(
        "{} {ending}: {} to t = {:.4e} s in {}\n",
        s.scene,
        count(s.steps, "step"),
        s.time,
        duration(ended.wall)
    );
    for (name, g) in &s.gauges {
        let (volume, rate) = if round { ("m3", "m3/s") } else { ("m2", "m2/s") };
        out +=
            &format!("  gauge {name}: volume {:.4} {volume}, rate {:.4e} {rate}", g.volume, g.rate);
        if g.refilled != 0.0 {
            out += &format!(
                ", and {:.1e} {volume} carried across by refilling empty cells",
                g.refilled
            );
        }
        out.push('\n');
    }
    for (name, f) in &s.forces {
        out += &if round {
            format!("  gauge {name}: force {:.4e} N along the axis\n", f.y)
        } else {
            let [x, y, torque] = [f.x, f.y, f.torque];
            format!("  gauge {name}: force ({x:.4e}, {y:.4e}) N/m, torque {torque:.4e} N\n")
        };
    }
    if let Some(p) = &s.purchase {
        out += &chosen::receipt_text(p);
    }
    let drift = s.volume_drift.values().map(|d| d.abs()).fold(0.0, f64::max);
    out += &format!(
        "  balances: power {:.1e}, energy {}, divergence {:.1e}, volume drift {drift:.1e}\n",
        s.balances.power_error,
        s.balances.energy_error.map_or("-".into(), |e| format!("{:.1e}", e.abs())),
        s.balances.divergence_error
    );
    if profile {
        for (name, seconds) in &s.seconds {
            out +=
                &format!("  {name:<20} {seconds:>9.3} s {:>5.1} %\n", 100.0 * seconds / ended.wall);
        }
    }
    out += &format!("  folder: {}\n", s.folder);
    if let (Some(step), true) = (ended.kept, s.ending != Ending::Finished) {
        let folder = &s.folder;
        out += &format!("  state of step {step} saved: grainscope resume {folder} continues\n");
    }
    if let Some((path, bytes)) = &ended.recorded {
        out += &format!("  recording: {} ({:.1} MB)\n", path.display(), *bytes as f64 / 1e6);
    }
    out
}
