//! Openings in the sides of the domain: balances, symmetry, an exact solution, and particles that
//! leave only through openings.

use crate::{scene, volume};
use grainscope::sim::Run;

/// A box whose fluid leaves through a slit in the floor; the top is open.
const SLIT: &str = r#"schema = 1
name = "slit"
gravity = [0, -10]
[domain]
x = [-1, 1]
y = [0, 2]
[accuracy]
cells = 8
particles_per_cell = 9
[time]
end = 30
max_step = 0.5
[materials.fluid]
density = 1000
shear_viscosity = 1e4
[materials.air]
shear_viscosity = 10
background = true
[[regions]]
material = "fluid"
shape.rectangle = { x = [-1, 1], y = [0, "level"] }
[parameters.level]
default = 1.6
[boundaries]
left.kind = "no_slip"
right.kind = "no_slip"
top.kind = "open"
[boundaries.bottom]
kind = "no_slip"
[[boundaries.bottom.parts]]
from = -0.3
to = 0.3
kind = "outflow"
[[gauges]]
name = "slit"
from = [-0.3, 0]
to = [0.3, 0]
direction = "down"
material = "fluid"
[[gauges]]
name = "air_out"
from = [-0.3, 0]
to = [0.3, 0]
direction = "down"
material = "air"
[[gauges]]
name = "air_in"
from = [-1, 2]
to = [1, 2]
direction = "down"
material = "air"
"#;

/// Integral of a component of the velocity along a line with a given other coordinate, exact for
/// the elements.
pub fn flux(run: &dyn Run, c: usize, at: f64, [from, to]: [f64; 2]) -> f64 {
    let plan = run.plan();
    let lines = if c == 0 { plan.mesh.y.lines() } else { plan.mesh.x.lines() };
    let value = |s: f64| run.velocity_at(if c == 0 { [at, s] } else { [s, at] })[c];
    lines
        .windows(2)
        .map(|l| [l[0], l[1]].map(|v| v * plan.units.length))
        .filter(|l| l[0] > from - 1e-9 && l[1] < to + 1e-9)
        .map(|[a, b]| {
            let tiny = 1e-12 * (b - a);
            (b - a) / 6.0 * (value(a + tiny) + 4.0 * value(0.5 * (a + b)) + value(b - tiny))
        })
        .sum()
}

#[test]
fn what_flows_in_at_the_top_flows_out_of_the_slit() {
    for level in ["level=2", "level=1.6"] {
        let run = scene(SLIT, &[level]);
        let [slit, top] = [flux(&*run, 1, 0.0, [-0.3, 0.3]), flux(&*run, 1, 2.0, [-1.0, 1.0])];
        assert!(slit < -0.01, "the fluid falls: {slit}");
        assert!((slit - top).abs() < 1e-9 * slit.abs(), "{level}: {slit} {top}");
        let floor = [flux(&*run, 1, 0.0, [-1.0, -0.3]), flux(&*run, 1, 0.0, [0.3, 1.0])];
        assert!(
            floor.iter().all(|f| f.abs() < 1e-14),
            "the rest of the floor is a wall: {floor:?}"
        );
        for x in [-0.3, -0.1, 0.0, 0.2, 0.3] {
            assert!(run.velocity_at([x, 0.0])[0].abs() < 1e-14, "the stream leaves vertically");
        }
        for x in [-0.3, 0.3] {
            assert!(run.velocity_at([x, 0.0])[1].abs() < 1e-14, "the lips belong to the walls");
        }
        let rate = run.row().gauges[0].rate;
        assert!((rate + slit).abs() < 0.01 * rate, "the gauge reads {rate}, the flux is {slit}");
    }
}

#[test]
fn particles_leave_only_through_the_slit_and_the_background_takes_their_place() {
    // Later the surface reaches the slit.
    let mut run = scene(SLIT, &["accuracy.cells=6", "time.end=20"]);
    let start = [volume(&*run, "fluid"), volume(&*run, "air")];
    // Of the 100 steps.
    let mut mean = 0.0;
    while !run.is_finished() {
        run.step().unwrap();
        let [fluid, air] = [volume(&*run, "fluid"), volume(&*run, "air")];
        let [slit, air_out, air_in] = [0, 1, 2].map(|k| run.row().gauges[k].volume);
        assert!((start[0] - slit - fluid).abs() < 1e-11, "{fluid} {slit}");
        assert!((start[1] + air_in - air_out - air).abs() < 1e-11, "{air} {air_in} {air_out}");
        // The particles fill the domain up to a row of them at the slit: the difference is at most that of ten
        // particles, 0.031, and does not grow.
        let particle = 1.0 / (6.0 * 6.0 * 9.0);
        let excess = fluid + air - 4.0;
        assert!(excess.abs() < 12.0 * particle, "{fluid} {air}");
        mean += excess / 100.0;
    }
    assert!(mean.abs() < 3e-3, "{mean}");
    let slit = run.row().gauges[0].volume;
    let plan = run.plan();
    let air = plan.background().unwrap();
    let particles = run.particles();
    let low = |p: &[f64; 2]| p[1] * plan.units.length < 0.3;
    let mut below = particles.position.iter().zip(&particles.material).filter(|(p, _)| low(p));
    assert!(below.all(|(_, &m)| m != air), "no air comes in from below");
    assert_eq!(run.row().gauges[1].volume, 0.0, "no air passes the slit");
    assert!(slit > 1.0, "a third of the fluid has left: {slit}");
    assert!(run.count().left > 300);
}

#[test]
fn a_turned_or_mirrored_opening_gives_the_turned_or_mirrored_flow() {
    // Fluid is pushed in through a part of one side, and leaves through a part of the next side.
    let turned = |sides: [&str; 2], ranges: [[f64; 2]; 2], push: &str| {
        let [[a, b], [c, d]] = ranges;
        let text = format!(
            "schema = 1\nname = \"turned\"\n[domain]\nx = [-1, 1]\ny = [-1, 1]\n\
             [accuracy]\ncells = 8\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 3\n\
             coupling_viscosity = 2\ninternal_length = 0.2\n\
             [[regions]]\nmaterial = \"fluid\"\n[boundaries]\n\
             left.kind = \"no_slip\"\nright.kind = \"no_slip\"\n\
             bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n\
             [[boundaries.{}.parts]]\nfrom = {a}\nto = {b}\nkind = \"open\"\n{push}\n\
             [[boundaries.{}.parts]]\nfrom = {c}\nto = {d}\nkind = \"outflow\"\n",
            sides[0], sides[1]
        );
        scene(&text, &[])
    };
    let plain = turned(["left", "bottom"], [[-0.5, 0.1], [0.2, 0.7]], "traction_x = 5");
    let mirrored = turned(["right", "bottom"], [[-0.5, 0.1], [-0.7, -0.2]], "traction_x = -5");
    let quarter = turned(["bottom", "right"], [[-0.1, 0.5], [0.2, 0.7]], "traction_y = 5");
    let mut largest: f64 = 0.0;
    for k in 0..40 {
        let [x, y] = [0.618, 0.37].map(|s| 1.96 * ((k as f64 * s) % 1.0) - 0.98);
        let [u, v, w] = plain.velocity_at([x, y]);
        largest = largest.max(u.hypot(v));
        let close = |run: &dyn Run, p: [f64; 2], exact: [f64; 3]| {
            let found = run.velocity_at(p);
            for c in 0..3 {
                assert!((found[c] - exact[c]).abs() < 1e-10, "{p:?}: {found:?} {exact:?}");
            }
        };
        close(&*mirrored, [-x, y], [-u, v, -w]);
        close(&*quarter, [-y, x], [-v, u, w]);
    }
    assert!(largest > 0.01, "{largest}");
}

#[test]
fn poiseuille_flow_between_a_pressure_and_an_outflow_is_exact() {
    let text = "schema = 1\nname = \"channel\"\n[domain]\nx = [0, 3]\ny = [0, 1]\n\
                [accuracy]\ncells = 5\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 2\n\
                [[regions]]\nmaterial = \"fluid\"\n[boundaries]\nbottom.kind = \"no_slip\"\n\
                top.kind = \"no_slip\"\nleft = { kind = \"outflow\", traction_x = 12 }\n\
                right.kind = \"outflow\"\n";
    let part = text.replace(
        "right.kind = \"outflow\"\n",
        "[[boundaries.right.parts]]\nfrom = 0\nto = 1\nkind = \"outflow\"\n",
    );
    for text in [text, &part] {
        let run = scene(text, &[]);
        for k in 0..40 {
            let (x, y) = (3.0 * ((k as f64 * 0.618) % 1.0), (k as f64 * 0.37) % 1.0);
            let exact = 12.0 / 3.0 / (2.0 * 2.0) * y * (1.0 - y);
            let [u, v, _] = run.velocity_at([x, y]);
            assert!((u - exact).abs() < 1e-10 && v.abs() < 1e-10, "({x}, {y}): {u} {v}, {exact}");
            assert!((run.pressure_at([x, y]) - (12.0 - 4.0 * x)).abs() < 1e-8);
        }
    }
}

#[test]
fn where_a_moving_part_meets_the_rest_the_wall_at_rest_wins() {
    // Both ends alike, whatever the order along the side; the lid is also the mirror image of itself.
    let text = "schema = 1\nname = \"lid\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
                [accuracy]\ncells = 8\n[time]\nend = 1\n[materials.fluid]\nshear_viscosity = 2\n\
                [[regions]]\nmaterial = \"fluid\"\n[boundaries]\nleft.kind = \"no_slip\"\n\
                right.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n[boundaries.top]\nkind = \"no_slip\"\n\
                [[boundaries.top.parts]]\nfrom = 0.25\nto = 0.75\nkind = \"no_slip\"\nvelocity_x = 1\n";
    let run = scene(text, &[]);
    for x in [0.1, 0.25, 0.75, 0.9] {
        assert_eq!(run.velocity_at([x, 1.0])[0], 0.0, "{x}");
    }
    assert!((run.velocity_at([0.5, 1.0])[0] - 1.0).abs() < 1e-12);
    for (x, y) in [(0.1, 0.9), (0.3, 0.6), (0.4, 0.2)] {
        let [u, v, _] = run.velocity_at([x, y]);
        let [mirrored_u, mirrored_v, _] = run.velocity_at([1.0 - x, y]);
        assert!((u - mirrored_u).abs() < 1e-11 && (v + mirrored_v).abs() < 1e-11);
    }
}
