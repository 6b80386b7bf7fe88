//! Defines the trials of materials with nothing around them.

use super::Trial;
use super::trials::trial;
use crate::sim::Run;
use crate::verify::{Bound, Check};

const GROUP: &str = "voids";

/// A box of 2 x 1 m with nothing around a material, in gravity 1.
fn text(first: &str, law: &str, shape: &str, boundaries: &str) -> String {
    format!(
        "schema = 1\nname = \"void\"\nbackground = \"void\"\n{first}\ngravity = [0, -1]\n[domain]\n\
         x = [0, 2]\ny = [0, 1]\nlength_scale = 1\n[accuracy]\ncells = 12\n\
         placement = \"jittered\"\nnonlinear_tolerance = 3e-3\n\
         [time]\nend = 1e9\n[materials.mud]\ndensity = 1\n{law}\n[[regions]]\nmaterial = \"mud\"\n{shape}\n\
         [boundaries]\n{boundaries}\n"
    )
}

/// A column in the left corner.
const COLUMN: &str = "shape.rectangle = { x = [0, 0.8], y = [0, 0.7] }";
const ROUGH: &str = "left.kind = \"no_slip\"\nright.kind = \"no_slip\"\nbottom.kind = \"no_slip\"";
const NEWTON: &str = "shear_viscosity = 0.1";
const INERTIA: &str = "inertia = true";
const FRICTION: &str = "friction = { static = 0.38, dynamic = 0.64, grain_diameter = 0.02 }";

/// A check that nothing moves faster than `most`.
fn slower_than(most: f64) -> impl Fn(&dyn Run) -> Result<Vec<Check>, crate::cases::CaseError> {
    move |run| Ok(vec![Check::new("largest speed, m/s", run.row().max_speed, Bound::AtMost(most))])
}

/// Adds the trials.
pub(super) fn trials(out: &mut Vec<Trial>) {
    let mut add = |name: &str, text: String, steps: u64| {
        out.push(trial(GROUP, name.to_string(), text, steps).drifting());
    };
    add("a column slumps", text("", NEWTON, COLUMN, ROUGH), 150);
    add("a column slumps with inertia", text(INERTIA, NEWTON, COLUMN, ROUGH), 150);
    // Below a viscosity of 1e-2 the splash at the other side grows without bound.
    add("a column of thin fluid falls", text(INERTIA, "shear_viscosity = 2e-2", COLUMN, ""), 150);
    add("grains collapse", text(INERTIA, FRICTION, COLUMN, "bottom.kind = \"no_slip\""), 150);
    let cosserat = "shear_viscosity = 0.1\ncoupling_viscosity = 0.1\ninternal_length = 0.1";
    add("a Cosserat column slumps", text("", cosserat, COLUMN, ROUGH), 100);
    let layered = "shear_viscosity = 0.1\nlayer_viscosity = 1e-3";
    let turned = format!("{COLUMN}\ndirector = {{ angle_degrees = 40 }}");
    add("a layered column slumps", text("", layered, &turned, ROUGH), 100);
    let drop = "shape.circle = { centre = [0.9, 0.6], radius = 0.23 }";
    add("a drop falls on the floor", text(INERTIA, NEWTON, drop, ROUGH), 150);
    let debris = "shape.where = \"sin(23*x)*sin(31*y) > 0.3\"";
    add("debris falls", text(INERTIA, NEWTON, debris, ROUGH), 150);
    let open =
        "bottom.kind = \"no_slip\"\nbottom.parts = [{ from = 0.7, to = 1.3, kind = \"outflow\" }]";
    let full = "shape.rectangle = { x = [0, 2], y = [0, 0.8] }";
    add("grains leave through a slit", text(INERTIA, FRICTION, full, open), 150);
    for share in [0.02, 0.5, 0.98] {
        // A surface at this share of a cell, 1/12 m high.
        let level = format!("shape.where = \"y < {:?}\"", (5.0 + share) / 12.0);
        for (name, first) in [("", ""), (" with inertia", INERTIA)] {
            let name = format!("a level surface at {share} of a cell rests{name}");
            let rest = trial(GROUP, name, text(first, NEWTON, &level, ROUGH), 50);
            out.push(rest.expecting(slower_than(1e-8)));
        }
    }
    let clay = "shear_viscosity = 0.1\nyield_stress = 1\nlargest_viscosity = 1e4";
    let rests = trial(
        GROUP,
        "a yield stress stops everything".to_string(),
        text("", clay, COLUMN, ROUGH),
        50,
    );
    out.push(rests.expecting(slower_than(1e-4)));
}
