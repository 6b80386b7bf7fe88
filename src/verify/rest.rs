//! Verifies that stratified fluids stay at rest, and that disturbed levels relax at large time
//! steps.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::{SceneSource, presets};

/// Values of `accuracy.placement`.
const PLACEMENTS: [&str; 3] = ["regular", "jittered", "random"];

/// Verifies fluids at rest and their relaxation.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Fluids at rest, and relaxation",
        about: "*At rest*: largest speed after a step, over rho g a^2/eta of the heavy fluid, in \
                a closed box (`hydrostatic`, viscosity contrast 1000) with the level inside a \
                cell, and for a density that decreases smoothly. If gravity is oblique to the \
                mesh, the pressure element cannot represent the hydrostatic pressure exactly; this \
                speed must fall at second order. The leading particle-in-cell code retains about \
                1e-5 of its flow speed when converged tightly, and 4e-3 at its defaults. *Large \
                steps*: a cosine-shaped level relaxes; tau is its relaxation time. Restoring loads \
                include part of their change over the next step (`accuracy.stabilisation`; Kaus et \
                al. 2010)."
            .into(),
        ..Section::default()
    };
    at_rest(effort, &mut out)?;
    oblique(effort, &mut out)?;
    relaxation(&mut out)?;
    Ok(out)
}

/// Speeds of fluids at rest for several placements.
fn at_rest(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = Table::new("At rest", &["scene", "cells", "regular", "jittered", "random"]);
    let mut worst: f64 = 0.0;
    for &cells in effort.take(&[16, 32]) {
        for level in ["0.51", "0.5137"] {
            let mut row = vec![format!("level at {level}"), cells.to_string()];
            for placement in PLACEMENTS {
                let sets = [
                    format!("accuracy.cells={cells}"),
                    format!("level={level}"),
                    format!("accuracy.placement={placement}"),
                ];
                let mut run = start(&presets::find("hydrostatic")?.with_sets(&sets)?)?;
                run.step()?;
                let speed = run.row().max_speed / 100.0;
                worst = worst.max(speed);
                row.push(number(speed));
            }
            table.rows.push(row);
        }
        let mut row = vec!["exponential strata".into(), cells.to_string()];
        for placement in PLACEMENTS {
            let material = "[materials.a]\ndensity = \"1000*exp(-3*y)\"\nshear_viscosity = 100\n\
                            [[regions]]\nmaterial = \"a\"\n";
            let mut run = start(&resting("[0, -10]", cells, placement, material))?;
            run.step()?;
            let speed = run.row().max_speed / 100.0;
            worst = worst.max(speed);
            row.push(number(speed));
        }
        table.rows.push(row);
    }
    out.tables.push(table);
    out.check("largest speed at rest", worst, Bound::AtMost(1e-6));
    Ok(())
}

/// A unit box at rest; `rest` holds its materials and regions.
fn resting(gravity: &str, cells: u32, placement: &str, rest: &str) -> SceneSource {
    let text = format!(
        "schema = 1\nname = \"rest\"\ngravity = {gravity}\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = {cells}\nplacement = \"{placement}\"\n[time]\nend = 1\n{rest}"
    );
    SceneSource::new("rest", text)
}

/// Speeds at rest under gravity oblique to the mesh, and their order.
fn oblique(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let level = "[materials.a]\ndensity = 1000\nshear_viscosity = 100\n\
                 [materials.b]\nshear_viscosity = 100\nbackground = true\n\
                 [[regions]]\nmaterial = \"a\"\n\
                 shape.where = \"0.6*(x-0.5) - 0.8*(y-0.5137) > 0\"\n";
    let strata = "[materials.a]\ndensity = \"1000*exp(2*(0.6*x-0.8*y))\"\nshear_viscosity = 100\n\
                  [[regions]]\nmaterial = \"a\"\n";
    let mut table =
        Table::new("Gravity oblique to the mesh", &["scene", "16", "32", "64", "order"]);
    for (name, rest, least) in [("level", level, 1.8), ("strata", strata, 2.5)] {
        let mut speeds = vec![];
        for &cells in effort.take(&[16, 64, 32]) {
            let speed =
                start(&resting("[6, -8]", cells, "jittered", rest))?.row().max_speed / 100.0;
            speeds.push((cells, speed));
        }
        speeds.sort_by_key(|s| s.0);
        let (Some(first), Some(last)) = (speeds.first(), speeds.last()) else { continue };
        let order = super::rate(*first, *last);
        let mut row = vec![name.to_string()];
        for cells in [16, 32, 64] {
            let known = speeds.iter().find(|s| s.0 == cells);
            row.push(known.map_or(String::new(), |s| number(s.1)));
        }
        row.push(format!("{order:.2}"));
        table.rows.push(row);
        out.check(format!("oblique {name}: order of the speed"), order, Bound::AtLeast(least));
    }
    out.tables.push(table);
    Ok(())
}

/// Relaxation of a disturbed level with and without stabilisation.
fn relaxation(out: &mut Section) -> Result<(), CaseError> {
    const AMPLITUDE: f64 = 0.1;
    let text = format!(
        "schema = 1\nname = \"slosh\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = 16\n[time]\nend = 1e12\n[recording]\nframes = 1\n\
         [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n[materials.light]\n\
         shear_viscosity = 1\n[[regions]]\nmaterial = \"light\"\n[[regions]]\n\
         material = \"heavy\"\nshape.where = \"y < 0.5 + {AMPLITUDE}*cos(pi*x)\"\n"
    );
    let mut table = Table::new(
        "Relaxation of a level in 30 steps limited only by a Courant number of 0.5",
        &["stabilisation", "longest step / tau", "speed of the last 10 steps / first"],
    );
    let mut figure = Figure {
        name: "sloshing".into(),
        title: "Relaxation of a disturbed level, steps limited only by the Courant number".into(),
        x: "step",
        y: "largest speed / first",
        logarithmic: false,
        curves: vec![],
    };
    for (name, value) in [("0.75 (default)", 0.75), ("0 (off)", 0.0)] {
        let sets = [
            format!("accuracy.stabilisation={value}"),
            "time.courant=0.5".into(),
            "time.tolerance=1".into(),
        ];
        let mut run = start(&SceneSource::new("slosh", text.as_str()).with_sets(&sets)?)?;
        let tau = -AMPLITUDE / run.velocity_at([0.0, 0.5])[1];
        let first = run.row().max_speed;
        let (mut longest, mut late) = (0.0f64, 0.0f64);
        let mut curve = vec![(0.0, 1.0)];
        for step in 1..=30 {
            run.step()?;
            longest = longest.max(run.row().dt / tau);
            let speed = run.row().max_speed / first;
            curve.push((f64::from(step), speed));
            if step > 20 {
                late = late.max(speed);
            }
        }
        table.rows.push(vec![name.into(), number(longest), number(late)]);
        figure.curves.push((format!("stabilisation {name}"), curve));
        if value > 0.0 {
            out.check("stabilised: longest step / tau", longest, Bound::AtLeast(30.0));
            out.check("stabilised: speed of the last 10 steps / first", late, Bound::AtMost(0.05));
        }
    }
    out.tables.push(table);
    out.figures.push(figure);
    Ok(())
}
