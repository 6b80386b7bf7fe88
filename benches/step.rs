//! Seconds per step and phase, and each phase's ratio to the factorisation of the same run:
//! `cargo bench`. The machine's own speed cancels in the ratios; the seconds are for orientation.

use grainscope::sim::row::Phases;
use grainscope::{plan, scene, sim};
use std::sync::Arc;

/// Mean phases of a few steps of a preset.
fn measure(
    preset: &str,
    sets: &[&str],
    steps: u32,
) -> Result<(String, Phases), Box<dyn std::error::Error>> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let source = scene::presets::find(preset)?.with_sets(&sets)?;
    let plan = plan::resolve(&scene::parse(&source)?).map_err(|e| e.with_source(&source))?;
    let label = format!(
        "{preset} {} x {} cells, {} unknowns a node",
        plan.mesh.x.cells(),
        plan.mesh.y.cells(),
        plan.unknowns_per_node()
    );
    let mut run = sim::start(Arc::new(plan))?;
    // The first step solves twice: it is not counted.
    run.step()?;
    let mut sum = Phases::default();
    for _ in 0..steps {
        run.step()?;
        sum.add(&run.row().seconds);
    }
    Ok((label, sum))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    const STEPS: u32 = 8;
    let cases: [(&str, &[&str]); 5] = [
        ("silo", &["accuracy.cells=4"]),
        ("silo", &["accuracy.cells=8", "alpha=0"]),
        ("silo", &["accuracy.cells=8"]),
        ("shear_alignment", &["internal_length=0"]),
        ("shear_alignment", &[]),
    ];
    for (preset, sets) in cases {
        let (label, sum) = measure(preset, sets, STEPS)?;
        let step = sum.total() / f64::from(STEPS);
        println!("{label}: {:.1} ms a step", 1e3 * step);
        for (name, seconds) in sum.list() {
            println!(
                "  {name:<12} {:>8.2} ms  {:>6.2} of the factorisation",
                1e3 * seconds / f64::from(STEPS),
                seconds / sum.factor
            );
        }
    }
    Ok(())
}
