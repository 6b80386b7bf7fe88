//! Defines the trials of round flows: what happens at and near the axis.

use super::Trial;
use super::trials::trial;
use crate::cases::CaseError;
use crate::scene::{SceneSource, presets};
use crate::verify::{Bound, Check};

const GROUP: &str = "axis of round flows";

/// A vessel of unit radius and height with heavy fluid in a thin one.
fn vessel(contrast: f64, heavy: &str, more: &str) -> String {
    format!(
        "schema = 1\nname = \"round\"\ngravity = [0, -1]\n[domain]\ngeometry = \"axisymmetric\"\n\
         x = [0, 1]\ny = [0, 1]\n[accuracy]\ncells = 12\nplacement = \"jittered\"\n[time]\nend = 1e9\n{more}\
         [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
         [materials.thin]\nshear_viscosity = {:e}\nbackground = true\n\
         [[regions]]\nmaterial = \"heavy\"\n{heavy}\n",
        1.0 / contrast
    )
}

/// Adds the trials.
pub(super) fn trials(out: &mut Vec<Trial>) -> Result<(), CaseError> {
    for contrast in [1.0, 1e3, 1e6] {
        let level = "shape.rectangle = { x = [0, 1], y = [0, 0.53] }";
        let text = vessel(contrast, level, "[boundaries]\nright.kind = \"no_slip\"\n");
        out.push(
            trial(GROUP, format!("a level rests, contrast {contrast:e}"), text, 40).expecting(
                |run| Ok(vec![Check::new("speed", run.row().max_speed, Bound::AtMost(1e-6))]),
            ),
        );
    }
    let shapes = [
        ("a drop falls on the axis", "shape.circle = { centre = [0, 0.6], radius = 0.2 }"),
        ("a ring falls", "shape.circle = { centre = [0.5, 0.6], radius = 0.15 }"),
        (
            "a thread thinner than a cell falls",
            "shape.rectangle = { x = [0, 0.06], y = [0.2, 0.8] }",
        ),
        ("a hole thinner than a cell closes", "shape.where = \"x > 0.06 && y < 0.5\""),
    ];
    for (name, shape) in shapes {
        for contrast in [1e-3, 1e3, 1e6] {
            let text = vessel(contrast, shape, "");
            out.push(trial(GROUP, format!("{name}, contrast {contrast:e}"), text, 60).drifting());
        }
    }
    let hanging = "shape.where = \"y > 0.8 || (x < 0.25 && y > 0.45)\"";
    let text = vessel(1e4, hanging, "[boundaries]\ntop.kind = \"no_slip\"\n");
    out.push(trial(GROUP, "a drop hangs and pinches", text, 200).drifting());
    let drop = "shape.circle = { centre = [0, 0.6], radius = 0.2 }";
    let text = vessel(10.0, drop, "").replace("end = 1e9", "end = 1e9\ncourant = 5");
    out.push(trial(GROUP, "5 cells a step", text, 40));
    for (name, sets) in [
        ("a round silo, R = 1e6 a", "materials.grains.internal_length=1e6"),
        ("a round silo, contrast 1e6", "contrast=1e6"),
        ("a round silo, coupling 1000", "coupling=1000"),
    ] {
        let mut silo = trial(GROUP, name, String::new(), 30);
        let all = ["accuracy.cells=4".to_string(), sets.into()];
        silo.scene = presets::find("round_silo")?.with_sets(&all)?;
        out.push(silo);
    }
    // A uniform extension: it is exact for any mesh and any positions of the particles.
    let text = "schema = 1\nname = \"extension\"\n[domain]\ngeometry = \"axisymmetric\"\nx = [0, 1]\n\
                y = [0, 1]\n[accuracy]\ncells = 7\nplacement = \"random\"\n[mesh]\n\
                grading = [{ towards.x = 0, factor = 8 }, { towards.y = 0.3, factor = 5 }]\n\
                [time]\nend = 0.5\n[materials.fluid]\nshear_viscosity = 1\n[[regions]]\n\
                material = \"fluid\"\n[boundaries]\n\
                right = { velocity_x = -0.5, velocity_y = \"y\", inflow = \"fluid\" }\n\
                bottom = { velocity_x = \"-x/2\", velocity_y = 0 }\n\
                top = { velocity_x = \"-x/2\", velocity_y = 1 }\n";
    out.push(extension(text));
    Ok(())
}

/// A flow that must be `u = -x/2`, `v = y` everywhere.
fn extension(text: &str) -> Trial {
    let name = "uniform extension on a graded mesh with random particles";
    let mut out = trial(GROUP, name, String::new(), 40).drifting();
    out.scene = SceneSource::new(name, text);
    out.expecting(|run| {
        let mut worst = 0.0f64;
        for k in 0..400 {
            let [x, y] = [(f64::from(k % 20) + 0.3) / 20.0, (f64::from(k / 20) + 0.6) / 20.0];
            let u = run.velocity_at([x, y]);
            worst = worst.max((u[0] + 0.5 * x).abs()).max((u[1] - y).abs());
        }
        Ok(vec![Check::new("velocity error", worst, Bound::AtMost(1e-11))])
    })
}
