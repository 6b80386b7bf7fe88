//! This module measures the steps of a scene with a moving interface, by phase, on one thread and
//! on two.

use super::machine::Machine;
use super::{Outcome, exponent, on_threads};
use grainscope::internals::Effort;
use grainscope::sim::phases::Phases;
use grainscope::{plan, scene, sim};
use std::fmt::Write;
use std::sync::Arc;

/// A scene of a dense disc that sinks through a less viscous fluid, with 16 particles per cell.
const DROP: &str = r#"
schema = 1
name = "drop"
gravity = [0, -1]
[domain]
x = [0, 1]
y = [0, 1]
[accuracy]
cells = 64
particles_per_cell = 16
[time]
end = 1e9
[materials.fluid]
density = 1
shear_viscosity = 1
[materials.drop]
density = 2
shear_viscosity = 1000
[[regions]]
material = "fluid"
[[regions]]
material = "drop"
shape.where = "(x - 0.5)^2 + (y - 0.6)^2 < 0.04"
[boundaries]
left.kind = "no_slip"
right.kind = "no_slip"
bottom.kind = "no_slip"
top.kind = "no_slip"
"#;

/// Settings that give both materials an internal length: three unknowns per node.
const WITH_ROTATION: [&str; 4] = [
    "materials.fluid.coupling_viscosity=1",
    "materials.fluid.internal_length=0.1",
    "materials.drop.coupling_viscosity=1000",
    "materials.drop.internal_length=0.1",
];

/// Number of measured steps.
const STEPS: usize = 5;
/// Meshes with more cells per side take one step only and are left out of the fit of the growth:
/// they show that such meshes fit into memory.
const LARGE: usize = 256;

/// The measurements of a mesh. Times are those of the fastest of some steps, s.
struct Measured {
    step: f64,
    /// Time of a step that factors everything again.
    full_step: f64,
    phases: Phases,
    solves: u32,
    particles: usize,
    effort: Effort,
}

/// Writes the section of steps for meshes of `n x n` cells.
pub fn report(page: &mut String, sizes: &[usize], machine: &Machine) -> Outcome<()> {
    writeln!(
        page,
        "## A step\n\n\
         A dense, 1000 times stiffer disc sinks in a box of n x n cells, 16 particles each. With \
         d = 3 both materials have an internal length. Times are milliseconds of the fastest of \
         {STEPS} steps (of one step beyond n = {LARGE}). *Step*: only changed cells are factored \
         again; *all*: all cells are. The bound counts the solves that were made and a \
         factorisation of all cells.\n\n\
         | n, d | solves | factor | solve | other | step | all | bound | step/bound | step, 2 \
         threads | factor MB | kept MB |\n|---|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    let mut growth = String::new();
    for d in [2, 3] {
        let (mut steps, mut fulls, mut memory) = (vec![], vec![], vec![]);
        for &n in sizes {
            let one = on_threads(1, || measure(n, d).map_err(|e| e.to_string()))??;
            let two = on_threads(2, || measure(n, d).map_err(|e| e.to_string()))??;
            let cells = (n * n) as f64;
            let bound = bound(&one, machine, cells, d as f64);
            let ms = |s: f64| format!("{:.1}", 1e3 * s);
            let mb = |entries: usize| format!("{:.0}", 8e-6 * entries as f64);
            let other = one.step - one.phases.factor - one.phases.solve;
            writeln!(
                page,
                "| {n}, {d} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.2}x | {} | {} |",
                one.solves,
                ms(one.phases.factor),
                ms(one.phases.solve),
                ms(other),
                ms(one.step),
                ms(one.full_step),
                ms(bound),
                one.step / bound,
                one.step / two.step,
                mb(one.effort.all_entries),
                mb(one.effort.kept_entries)
            )?;
            eprintln!("step {n}, {d} measured");
            if (64..=LARGE).contains(&n) {
                steps.push((cells, one.step));
                fulls.push((cells, one.full_step));
                memory.push((cells, (one.effort.all_entries + one.effort.kept_entries) as f64));
            }
        }
        if steps.len() > 1 {
            writeln!(
                growth,
                "d = {d}, N cells, from 64 x 64 to {LARGE} x {LARGE}: the time of a step grows as \
                 N^{:.2}, with all cells factored as N^{:.2}, the solver's memory as N^{:.2}.\n",
                exponent(&steps),
                exponent(&fulls),
                exponent(&memory)
            )?;
        }
    }
    writeln!(page, "\n{growth}")?;
    Ok(())
}

/// Lower bound of the time of a step, s; its formula is at the top of `benches/speed.rs`.
fn bound(m: &Measured, machine: &Machine, cells: f64, d: f64) -> f64 {
    let entries = m.effort.all_entries as f64;
    let factor = m.effort.all_flops / machine.product + 8.0 * entries / machine.copy;
    let solve = f64::from(m.solves) * 16.0 * entries / machine.read;
    let matrices = 8.0 * 36.0 * d * d * cells / machine.copy;
    factor + solve + matrices + 100.0 * m.particles as f64 / machine.copy
}

/// Runs the scene with `n x n` cells and `d` unknowns per node.
fn measure(n: usize, d: usize) -> Outcome<Measured> {
    let mut sets = vec![format!("accuracy.cells={n}")];
    if d == 3 {
        sets.extend(WITH_ROTATION.map(String::from));
    }
    let source = scene::SceneSource::new("drop.toml", DROP).with_sets(&sets)?;
    let plan = plan::resolve(&scene::parse(&source)?).map_err(|e| e.with_source(&source))?;
    let mut run = sim::start(Arc::new(plan))?;
    // The first two steps are not measured: the first solves twice, and the second has no regular
    // step before it.
    run.step()?;
    run.step()?;
    let steps = if n > LARGE { 1 } else { STEPS };
    let mut best: Option<Measured> = None;
    for _ in 0..steps {
        run.step()?;
        let row = run.row();
        if best.as_ref().is_none_or(|b| row.wall < b.step) {
            best = Some(Measured {
                step: row.wall,
                full_step: 0.0,
                phases: row.seconds,
                solves: row.iterations,
                particles: row.particles,
                effort: run.factor_effort(),
            });
        }
    }
    let mut best = best.ok_or("no step was taken")?;
    best.full_step = f64::INFINITY;
    for _ in 0..steps {
        run.forget_factor();
        run.step()?;
        best.full_step = best.full_step.min(run.row().wall);
    }
    Ok(best)
}
