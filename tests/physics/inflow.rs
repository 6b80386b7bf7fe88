//! Material that enters through the sides of the domain: exact balances, the shape of what enters,
//! the values it carries, and its momentum.

use crate::openings::flux;
use crate::{finish, scene, volume};
use grainscope::sim::Run;

/// Sand is pushed into a channel filled with air, through the left side or a part of it; the right
/// side is open. Gauges count both materials at both ends.
const CHANNEL: &str = r#"schema = 1
name = "channel"
[parameters]
speed = { default = 1 }
[domain]
x = [0, 4]
y = [0, 1]
[accuracy]
cells = 8
[time]
end = 1
[materials.sand]
density = 2
shear_viscosity = 10
[materials.air]
shear_viscosity = 1
background = true
[[regions]]
material = "sand"
shape.rectangle = { x = [0, 0.5], y = [0, 1] }
[boundaries]
left = { kind = "no_slip", inflow = "sand", velocity_x = "speed" }
right.kind = "open"
[[gauges]]
name = "sand_in"
from = [0, 0]
to = [0, 1]
direction = "right"
material = "sand"
[[gauges]]
name = "air_in"
from = [0, 0]
to = [0, 1]
direction = "right"
material = "air"
[[gauges]]
name = "sand_out"
from = [4, 0]
to = [4, 1]
direction = "right"
material = "sand"
[[gauges]]
name = "air_out"
from = [4, 0]
to = [4, 1]
direction = "right"
material = "air"
"#;

/// Volumes of sand and air inside, m2.
fn inside(run: &dyn Run) -> [f64; 2] {
    ["sand", "air"].map(|name| volume(run, name))
}

fn gauge(run: &dyn Run, name: &str) -> f64 {
    let k = run.plan().gauges.iter().position(|g| g.name == name).unwrap();
    run.row().gauges[k].volume
}

/// Largest error of the balances of both materials in a run, and of the volume that has entered
/// relative to `rate` times the time.
fn balance(run: &mut dyn Run, rate: f64) -> [f64; 2] {
    let first = inside(run);
    let mut errors = [0.0_f64; 2];
    finish(run, |run| {
        let [sand, air] = inside(run);
        let of = |name: &str| gauge(run, name);
        let sand = first[0] + of("sand_in") - of("sand_out") - sand;
        let air = first[1] + of("air_in") - of("air_out") - air;
        errors[0] = errors[0].max(sand.abs()).max(air.abs());
        errors[1] = errors[1].max((of("sand_in") - rate * run.row().time).abs());
    });
    errors
}

#[test]
fn what_is_pushed_in_is_inside_or_has_left() {
    // A plug, a fast plug in long steps, a parabola beside walls at rest, and a part of a side.
    let parabola = "boundaries.left.velocity_x=\"6*y*(1-y)\"";
    let part = "boundaries.left={ kind = \"no_slip\", parts = [{ from = 0.25, to = 0.75, \
                kind = \"no_slip\", velocity_x = 2, inflow = \"sand\" }] }";
    let walls = ["boundaries.bottom.kind=no_slip", "boundaries.top.kind=no_slip"];
    for (sets, rate) in [
        (vec![], Some(1.0)),
        (vec!["speed=5", "time.courant=20", "time.tolerance=1", "recording.frames=0"], Some(5.0)),
        (vec![parabola, walls[0], walls[1]], Some(1.0)),
        (vec![part], None),
    ] {
        let mut run = scene(CHANNEL, &sets);
        // The ends of the part are at rest as the walls beside it are.
        let rate = rate.unwrap_or_else(|| flux(run.as_ref(), 0, 0.0, [0.25, 0.75]));
        let [balance, entered] = balance(run.as_mut(), rate);
        assert!(balance < 1e-12 * 4.0, "{sets:?}: {balance}");
        assert!(entered < 1e-12 * rate, "{sets:?}: {entered}");
        let total: f64 = inside(run.as_ref()).iter().sum();
        assert!((total - 4.0).abs() < 0.04, "the domain stays filled: {total}");
    }
}

#[test]
fn the_front_of_a_plug_moves_with_the_inflow() {
    let mut run = scene(CHANNEL, &["time.end=2.5"]);
    finish(run.as_mut(), |run| {
        let plan = run.plan();
        let front = 0.5 + run.row().time;
        let (mut sum, mut volume) = (0.0, 0.0);
        let mut largest = 0.0_f64;
        let p = run.particles();
        for k in (0..p.len()).filter(|&k| p.material[k] == 0) {
            let x = p.position[k][0] * plan.units.length;
            (sum, volume) = (sum + p.volume[k] * x, volume + p.volume[k]);
            largest = largest.max(p.volume[k]);
        }
        let centre = sum / volume;
        assert!((centre - 0.5 * front).abs() < 1e-12, "{centre} {front}");
        let usual = 1.0 / 64.0 / 16.0 / plan.units.volume();
        assert!(largest < 1.0001 * usual, "{largest} {usual}");
        assert!(run.row().volume_error < 0.2);
    });
}

#[test]
fn what_enters_carries_the_values_of_the_side() {
    let sets = [
        "boundaries.left.inflow_director={ angle_degrees = \"90*y\" }",
        "regions[0].director={ angle_degrees = 0 }",
        "materials.sand.layer_viscosity=5",
        "materials.sand.density=\"1 + y\"",
        "materials.sand.shear_viscosity=\"10*exp(-y)\"",
        "time.end=0.7",
        "regions[0].shape.rectangle.x=[0, 0.0625]",
    ];
    let mut run = scene(CHANNEL, &sets);
    finish(run.as_mut(), |_| {});
    let (plan, p) = (run.plan(), run.particles());
    let mut seen = 0;
    for k in (0..p.len()).filter(|&k| p.material[k] == 0) {
        let [x, y] = p.position[k].map(|c| c * plan.units.length);
        if x > 0.6 {
            continue;
        }
        seen += 1;
        let density = p.density.as_ref().unwrap()[k] * plan.units.density;
        let viscosity = p.viscosity.as_ref().unwrap()[k] * plan.units.viscosity;
        assert!((density - 1.0 - y).abs() < 0.03, "{y}: {density}");
        assert!((viscosity / (10.0 * (-y).exp()) - 1.0).abs() < 0.03, "{y}: {viscosity}");
        // The plug does not turn them.
        let [nx, ny] = p.director.as_ref().unwrap()[k];
        let angle = (ny / nx).atan().to_degrees();
        assert!((angle - 90.0 * y).abs() < 2.0, "{y}: {angle}");
    }
    assert!(seen > 300, "{seen}");
}

/// Flow towards a wall: `u = x, v = -y` is an exact steady flow at any viscosity.
const STAGNATION: &str = r#"schema = 1
name = "stagnation"
inertia = true
[domain]
x = [0, 1]
y = [0, 1]
[accuracy]
cells = 8
[time]
end = 1
max_step = 0.05
tolerance = 1
courant = 10
[recording]
frames = 0
[materials.fluid]
density = 1
shear_viscosity = 0.01
[[regions]]
material = "fluid"
[initial_velocity]
x = "x"
y = "-y"
[boundaries]
top = { velocity_x = "x", velocity_y = "-y" }
right = { velocity_x = "x", velocity_y = "-y" }
"#;

#[test]
fn what_enters_has_the_momentum_of_the_given_velocity() {
    let errors = [0.1, 0.05, 0.025].map(|step| {
        let mut run = scene(STAGNATION, &[&format!("time.max_step={step}")]);
        finish(run.as_mut(), |_| {});
        let mut error = 0.0_f64;
        for k in 0..200 {
            let [x, y] = [0.618, 0.37].map(|s| (k as f64 * s) % 1.0);
            let [u, v, _] = run.velocity_at([x, y]);
            error = error.max((u - x).hypot(v + y));
        }
        error
    });
    // 8.4e-4, 1.2e-4, 2.4e-5: second order in the step.
    assert!(errors[0] < 1e-3 && errors[1] < errors[0] / 3.0, "{errors:?}");
    assert!(errors[2] < errors[1] / 3.0, "{errors:?}");
}

/// Water is pushed through a part of a side into air. The mesh is graded towards the ends of the part,
/// so that a step crosses several of its cells.
#[test]
fn a_jet_keeps_its_speed_and_fills_the_cells_that_it_crosses() {
    let text = "schema = 1\nname = \"jet\"\ninertia = true\n[domain]\nx = [0, 2]\ny = [0, 1]\n\
                [accuracy]\ncells = 12\n[time]\nend = 0.8\nmax_step = 0.03\n[recording]\nframes = 1\n\
                [materials.water]\ndensity = 1000\nshear_viscosity = 1\n[materials.air]\ndensity = 1\n\
                shear_viscosity = 0.02\nbackground = true\n[[regions]]\nmaterial = \"air\"\n\
                [boundaries]\nright.kind = \"open\"\ntop.kind = \"open\"\nbottom.kind = \"open\"\n\
                left.kind = \"no_slip\"\n[[boundaries.left.parts]]\nfrom = 0.375\nto = 0.625\n\
                kind = \"no_slip\"\nvelocity_x = 1\ninflow = \"water\"\n";
    let mut run = scene(text, &[]);
    let rate = flux(run.as_ref(), 0, 0.0, [0.375, 0.625]);
    finish(run.as_mut(), |_| {});
    let plan = run.plan();
    let water = plan.state.materials.iter().position(|m| m.name == "water").unwrap();
    let p = run.particles();
    let own = (0..p.len()).filter(|&k| usize::from(p.material[k]) == water);
    let (mut sum, mut volume) = (0.0, 0.0);
    for k in own {
        sum += p.volume[k] * p.position[k][0] * plan.units.length;
        volume += p.volume[k];
    }
    assert!((volume * plan.units.volume() - 0.8 * rate).abs() < 1e-12);
    let centre = sum / volume;
    assert!((centre - 0.4).abs() < 0.02, "{centre}");
    assert_eq!(run.count().healed, 0);
}
