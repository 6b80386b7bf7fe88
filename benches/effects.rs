//! This benchmark measures the time of each effect as the ratio of a step of a scene with it to a
//! step of the same scene without it, taken alternately: `cargo bench --bench effects`. An effect
//! that is named but switched off must take no time: its ratio to a scene that never named it is 1
//! within noise. The ratio of a scene to itself shows the noise.

use grainscope::internals::info;
use grainscope::internals::timed;
use grainscope::internals::{Backpressure, Logger};
use grainscope::internals::{Pair, pair, without};
use grainscope::internals::{RerunLog, Sink};
use grainscope::plan::{EffectKind, Plan};
use grainscope::{plan, scene, sim};
use std::error::Error;
use std::sync::Arc;

/// Number of steps of each scene; medians are compared.
const STEPS: u32 = 15;

/// A scene of a fluid under a moving lid.
const LID: &str = r#"
schema = 1
name = "lid"
[domain]
x = [0, 1]
y = [0, 1]
[accuracy]
cells = 48
[time]
end = 10
[materials.fluid]
shear_viscosity = 1
density = 1
[[regions]]
material = "fluid"
[boundaries]
left.kind = "no_slip"
right.kind = "no_slip"
bottom.kind = "no_slip"
top = { kind = "no_slip", velocity_x = "16*x*x*(1-x)*(1-x)" }
"#;

/// The result of a measurement.
type Outcome<T> = Result<T, Box<dyn Error>>;

/// The scene of a text, or of the preset of this name, with settings.
fn source(text: &str, sets: &[&str]) -> Outcome<scene::SceneSource> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let source = if text.contains('\n') {
        scene::SceneSource::new("lid.toml", text)
    } else {
        scene::presets::find(text)?
    };
    Ok(source.with_sets(&sets)?)
}

/// The plan of a scene.
fn plan_of(source: &scene::SceneSource) -> Outcome<Arc<Plan>> {
    let plan = plan::resolve(&scene::parse(source)?).map_err(|e| e.with_source(source))?;
    Ok(Arc::new(plan))
}

/// Prints both times and their ratio.
fn print(what: &str, p: Pair) {
    println!(
        "  {what:<44} {:>8.2} ms {:>8.2} ms {:>7.3}",
        1e3 * p.with,
        1e3 * p.without,
        p.with / p.without
    );
}

/// Compares a preset with an effect and the same scene without it.
fn removed(text: &str, sets: &[&str], effect: EffectKind, what: &str) -> Outcome<()> {
    let with = source(text, sets)?;
    let other = without(&scene::parse(&with)?, effect).ok_or("the effect cannot be removed")?;
    print(what, pair(&plan_of(&with)?, &Arc::new(plan::resolve(&other)?), STEPS)?);
    Ok(())
}

/// Compares two scenes.
fn against(with: (&str, &[&str]), other: (&str, &[&str]), what: &str) -> Outcome<()> {
    let plan = |(text, sets)| source(text, sets).and_then(|s| plan_of(&s));
    print(what, pair(&plan(with)?, &plan(other)?, STEPS)?);
    Ok(())
}

/// Compares the time of a step with and without recording a frame, on the simulation's thread.
fn recording() -> Outcome<()> {
    let plan = plan_of(&source("silo", &[])?)?;
    let file = std::env::temp_dir().join(format!("grainscope-bench-{}.rrd", std::process::id()));
    let log = RerunLog::open(&info::run_info(&plan, "bench"), &[Sink::Save(file.clone())])?;
    let mut logger = Logger::start(log, Backpressure::Wait, std::sync::Arc::default())?;
    let mut run = sim::start(plan.clone())?;
    run.step()?;
    let (mut step, mut frame) = (0.0, 0.0);
    for _ in 0..STEPS {
        let (outcome, took) = timed(|| run.step());
        outcome?;
        step += took.cpu;
        let (sent, took) = timed(|| {
            let frame = info::frame(&plan, run.row(), 0.0, Some(run.snapshot()), vec![]);
            logger.send(frame)
        });
        sent.map_err(|_| "the logger ended")?;
        frame += took.cpu;
    }
    let (finished, _, busy) = logger.finish();
    finished?;
    std::fs::remove_file(&file)?;
    let n = f64::from(STEPS);
    print(
        "recording a frame every step (silo)",
        Pair { with: (step + frame) / n, without: step / n },
    );
    println!(
        "  {:<44} {:>8.2} ms per frame, on its own thread",
        "the logger",
        1e3 * busy.as_secs_f64() / n
    );
    Ok(())
}

fn main() -> Outcome<()> {
    let silo_plain = include_str!("../presets/silo.toml")
        .replace("coupling_viscosity = \"coupling * 1000\"\n", "")
        .replace("internal_length = \"alpha * aperture\"\n", "");
    let shear_plain = include_str!("../presets/shear_alignment.toml")
        .replace("layer_viscosity = \"eta_s\"\n", "")
        .replace("director = \"random\"\n", "")
        .replace("quantity = \"alignment\"\nfloor = 1e-3", "quantity = \"rms_speed\"\nfloor = 0");
    let two = LID.replace("[[regions]]\nmaterial = \"fluid\"\n", "")
        + "[materials.rest]\nshear_viscosity = 1\ndensity = 1\nbackground = true\n\
           [[regions]]\nmaterial = \"fluid\"\nshape.rectangle = { x = [0, 1], y = [0, 0.51] }\n";
    let named = LID.to_string() + "[materials.rest]\nshear_viscosity = 1\nbackground = true\n";

    let round_silo = include_str!("../presets/round_silo.toml");
    let stone =
        |shape: &str| format!("{LID}[[blocks]]\nname = \"stone\"\nkind = \"no_slip\"\n{shape}\n");
    let circle = stone("shape.circle = { centre = [0.5, 0.5], radius = 0.2 }");
    let square = stone("x = [0.325, 0.675]\ny = [0.325, 0.675]");
    let flat_silo = round_silo.replace("geometry = \"axisymmetric\"\n", "");

    println!("step with, step without (processor time, medians of {STEPS}), ratio");
    removed("silo", &[], EffectKind::Rotation, "Cosserat rotation (silo)")?;
    removed("shear_alignment", &[], EffectKind::Directors, "directors (shear_alignment)")?;
    against((&two, &[]), (LID, &[]), "a background that fills half (lid)")?;
    removed("silo", &[], EffectKind::Dye, "dye lines (silo)")?;
    removed("silo", &[], EffectKind::Gauges, "gauges (silo)")?;
    removed("silo", &[], EffectKind::Stabilisation, "stabilised stratification (silo)")?;
    against((LID, &["gravity[1]=-10"]), (LID, &[]), "gravity (lid)")?;
    against((round_silo, &[]), (&flat_silo, &[]), "around an axis (round_silo)")?;
    against((&circle, &[]), (&square, &[]), "a circle instead of a square (lid)")?;
    recording()?;

    println!("\nswitched off, never named: the ratio must be 1 within noise");
    against(("silo", &[]), ("silo", &[]), "the same scene twice (silo)")?;
    against(("silo", &["alpha=0"]), (&silo_plain, &[]), "Cosserat rotation (silo)")?;
    against(
        ("shear_alignment", &["eta_s=1000", "interest.quantity=rms_speed"]),
        (&shear_plain, &[]),
        "directors (shear_alignment)",
    )?;
    against((&named, &[]), (LID, &[]), "a background that fills nothing (lid)")?;
    against((LID, &["gravity[1]=0"]), (LID, &[]), "gravity (lid)")?;
    against((LID, &["dye.lines=[]"]), (LID, &[]), "dye lines (lid)")?;
    Ok(())
}
