//! Defines the trials of grains: friction, yield stress, cohesion, and inertia, at their limits.

use super::Trial;
use super::trials::trial;
use crate::cases::{CaseError, start};
use crate::scene::SceneSource;
use crate::sim::Run;
use crate::verify::{Bound, Check};

const GROUP: &str = "grains";

/// Friction of the trials that have no other.
const FRICTION: &str = "friction = { static = 0.38, dynamic = 0.64, inertial_number = 0.279, \
                        grain_diameter = 0.02 }";

/// A box of 2 x 1 m with a rough floor and air of the given density; heights are in m, so that the
/// weight of a layer of 1 m is 1 Pa.
fn vessel(law: &str, shape: &str, air: f64, more: &str) -> String {
    format!(
        "schema = 1\nname = \"grains\"\ninertia = true\ngravity = [0, -1]\n[domain]\nx = [0, 2]\n\
         y = [0, 1]\nlength_scale = 1\n[accuracy]\ncells = 12\nplacement = \"jittered\"\n[time]\n\
         end = 1e9\n[materials.grains]\ndensity = 1\n{law}\nlargest_viscosity = {CAP:e}\n\
         smallest_viscosity = 1e-3\n[materials.air]\ndensity = {air:e}\nshear_viscosity = 1e-3\n\
         background = true\n[[regions]]\nmaterial = \"grains\"\n{shape}\n[boundaries]\n{more}\n"
    )
}

/// Largest viscosity of the vessels, Pa s.
const CAP: f64 = 1e4;
/// Boundaries of a vessel that is open above.
const OPEN: &str = "bottom.kind = \"no_slip\"\ntop.kind = \"open\"";
/// Tangent of the angle of a slope that rests: 10 degrees.
const SLOPE: f64 = 0.176;
/// A column beside air.
const COLUMN: &str = "shape.rectangle = { x = [0, 0.8], y = [0, 0.7] }";

/// Largest speed of particles of the grains, m/s.
fn speed_of_grains(run: &dyn Run) -> f64 {
    let particles = run.particles();
    let grains = (0..particles.len()).filter(|&p| particles.material[p] == 0);
    grains.fold(0.0, |most: f64, p| {
        let [u, v, _] = run.velocity_at(run.plan().si(particles.position[p]));
        most.max(u.hypot(v))
    })
}

/// A check that a slope rests: of the energy that levelling would release, it loses at most a twentieth.
fn keeps_its_slope(scene: SceneSource) -> impl Fn(&dyn Run) -> Result<Vec<Check>, CaseError> {
    move |run| {
        let lost = start(&scene)?.row().potential_energy - run.row().potential_energy;
        // The surface y = SLOPE (x - 1) over 0 < x < 2.
        let share = lost / (SLOPE * SLOPE / 3.0);
        Ok(vec![Check::new("share of the energy of the slope", share, Bound::AtMost(0.05))])
    }
}

/// A check that the grains are at rest: they creep at most as fast as a fluid of the largest
/// viscosity does under their weight, `rho g H^2/eta` with the height `H`.
fn rests(height: f64) -> impl Fn(&dyn Run) -> Result<Vec<Check>, CaseError> {
    move |run| {
        let creep = height * height / CAP;
        Ok(vec![Check::new("speed of the grains, m/s", speed_of_grains(run), Bound::AtMost(creep))])
    }
}

/// Adds the trials.
pub(super) fn trials(out: &mut Vec<Trial>) {
    let walls = "left.kind = \"no_slip\"\nright.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n\
                 top.kind = \"open\"";
    for (steps, quick) in [(200, true), (10_000, false)] {
        let rest = |name: &str, shape: &str| {
            let text = vessel(FRICTION, shape, 1e-3, walls)
                .replace("end = 1e9", "end = 1e9\nmax_step = 0.02");
            let mut rest = trial(GROUP, format!("{name} rests, {steps} steps"), text, steps);
            rest.quick = quick;
            rest
        };
        let level = rest("a level bin", "shape.rectangle = { x = [0, 2], y = [0, 0.53] }");
        out.push(level.expecting(rests(0.53)));
        let slope = format!("shape.where = \"y < 0.5 + {SLOPE}*(x - 1)\"");
        let slope = rest("a slope of 10 degrees", &slope).drifting();
        let scene = slope.scene.clone();
        out.push(slope.expecting(keeps_its_slope(scene)));
    }
    let collapse = |out: &mut Vec<Trial>, name: String, law: &str, air: f64| {
        out.push(trial(GROUP, name, vessel(law, COLUMN, air, OPEN), 150).drifting());
    };
    for (name, from, to) in [
        ("friction 0", "static = 0.38, dynamic = 0.64", "static = 0, dynamic = 0"),
        ("friction 2", "static = 0.38, dynamic = 0.64", "static = 2, dynamic = 2"),
        ("diameter 0", "grain_diameter = 0.02", "grain_diameter = 0"),
        ("diameter 1 m", "grain_diameter = 0.02", "grain_diameter = 1"),
    ] {
        collapse(out, format!("a column collapses, {name}"), &FRICTION.replace(from, to), 1e-3);
    }
    let cosserat = format!("{FRICTION}\ninternal_length = 0.1");
    collapse(out, "a column collapses, internal length 0.1 m".into(), &cosserat, 1e-3);
    for ratio in [1e4, 1e6] {
        let name = format!("a column collapses, density ratio {ratio:e}");
        collapse(out, name, FRICTION, 1.0 / ratio);
    }
    let clay = "shear_viscosity = 1\nyield_stress = 1";
    let text = vessel(clay, COLUMN, 1e-3, OPEN);
    out.push(trial(GROUP, "a yield stress stops everything", text, 100).expecting(rests(0.7)));
    let hung = format!("{FRICTION}\ncohesion = 2");
    let text = vessel(
        &hung,
        "shape.rectangle = { x = [0.5, 1.5], y = [0.4, 1] }",
        1e-3,
        "top.kind = \"no_slip\"\nleft.kind = \"open\"\nright.kind = \"open\"",
    );
    out.push(trial(GROUP, "a block hangs by cohesion", text, 100).expecting(rests(0.6)));
    for power in [-8, -5, -2, 0, 1] {
        out.push(sheared(power));
    }
}

/// Plane shear under a pressure of 1 Pa with the inertial number `I = 10^power`; the shear stress must
/// be `mu(I)`.
fn sheared(power: i32) -> Trial {
    let inertial = 10f64.powi(power);
    // I = d g/sqrt(p/rho) with d = 0.02 m, a height of 1 m and a density of 1 kg/m3.
    let speed = inertial / 0.02;
    let text = format!(
        "schema = 1\nname = \"sheared\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\ncells = 6\n\
         placement = \"jittered\"\n[time]\nend = {:e}\n[materials.grains]\ndensity = 1\n{FRICTION}\n\
         largest_viscosity = 1e12\nsmallest_viscosity = 1e-12\n[[regions]]\n\
         material = \"grains\"\n[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
         bottom.kind = \"no_slip\"\n\
         top = {{ kind = \"open\", velocity_x = {speed:e}, traction_y = -1 }}\n",
        1e9 / speed
    );
    trial(GROUP, format!("plane shear at I = 1e{power}"), text, 10).drifting().expecting(
        move |run| {
            let friction = run.row().dissipation / speed;
            let law = 0.38 + 0.26 / (1.0 + 0.279 / inertial);
            Ok(vec![Check::new(
                "shear stress over pressure",
                friction,
                Bound::Within(law, 1e-3 * law),
            )])
        },
    )
}
