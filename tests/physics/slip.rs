//! Slip along walls: plane flows whose exact velocities are linear or quadratic.

use crate::{finish, scene};
use grainscope::sim::Run;

/// A channel from y = 0 to 1, periodic along x.
const CHANNEL: &str = r#"schema = 1
name = "channel"
[parameters]
b = { default = 0.3 }
[domain]
x = [0, 1]
y = [0, 1]
[accuracy]
cells = 4
[time]
steady = true
[materials.fluid]
shear_viscosity = 2
[[regions]]
material = "fluid"
[boundaries]
left.kind = "periodic"
right.kind = "periodic"
"#;

/// The largest difference between the velocity of a run and `exact(y)` along x.
fn error(run: &dyn Run, range: [f64; 2], exact: impl Fn(f64) -> f64) -> f64 {
    let at = |k: i32| [0.37, 0.618].map(|s| (f64::from(k) * s) % 1.0);
    (0..50).map(at).fold(0.0, |worst: f64, [x, s]| {
        let y = range[0] + s * (range[1] - range[0]);
        let [u, v, _] = run.velocity_at([x, y]);
        worst.max((u - exact(y)).abs()).max(v.abs())
    })
}

#[test]
fn couette_flow_with_slip_is_linear() {
    // The lower wall is at rest, the upper one moves with the speed 3.
    let text = format!(
        "{CHANNEL}bottom.kind = \"no_slip\"\ntop = {{ slip_length = \"b\", velocity_x = 3 }}\n"
    );
    for b in [1e-6, 0.3, 1.0, 1e6] {
        let run = scene(&text, &[&format!("b={b}")]);
        let worst = error(run.as_ref(), [0.0, 1.0], |y| 3.0 * y / (1.0 + b));
        assert!(worst < 1e-10, "{b}: {worst}");
        // The shear stress 2 * 3/(1 + b) moves with the wall; a part is dissipated at the wall.
        let power = 18.0 / (1.0 + b);
        assert!((run.row().power_in / power - 1.0).abs() < 1e-8, "{b}");
        assert!((run.row().dissipation / power - 1.0).abs() < 1e-8, "{b}");
    }
}

#[test]
fn poiseuille_flow_with_slip_is_quadratic() {
    let force = "[body_force]\nx = 5\n";
    let text = format!("{CHANNEL}bottom.slip_length = \"b\"\ntop.slip_length = \"2*b\"\n{force}");
    // u = G/(2 eta) (-y^2 + c y + d),  d = b c,  -1 + c + d = 2 b (2 - c)
    let run = scene(&text, &[]);
    let b = 0.3;
    let c = (1.0 + 4.0 * b) / (1.0 + 3.0 * b);
    let exact = |y: f64| 5.0 / 4.0 * (-y * y + c * y + b * c);
    let worst = error(run.as_ref(), [0.0, 1.0], exact);
    assert!(worst < 1e-10, "{worst}");
    assert!(run.row().power_error < 1e-9);
}

#[test]
fn thin_walls_resist_as_sides_do() {
    let force = "[body_force]\nx = 5\n";
    let b = 0.3;
    // Both faces of a thin wall rub: between two channels of equal flow, each takes its share. The
    // walls at the sides slip too.
    let walls = "bottom.slip_length = \"b\"\ntop.slip_length = \"b\"\n\
                 [[walls]]\nname = \"middle\"\nfrom = [0, 0.5]\nto = [1, 0.5]\nslip_length = \"b\"\n";
    let run = scene(&format!("{CHANNEL}{walls}{force}"), &[]);
    let half = |y: f64| 5.0 / 4.0 * (y * (0.5 - y) + 0.5 * b);
    let exact = |y: f64| half(if y < 0.5 { y } else { y - 0.5 });
    let worst = error(run.as_ref(), [0.0, 1.0], exact);
    assert!(worst < 1e-10, "{worst}");
}

#[test]
fn the_fluid_at_the_wall_determines_the_resistance() {
    // A thin fluid below a thick one; the wall is the upper one. The shear stress is t.
    let text = format!(
        "{CHANNEL}bottom = {{ kind = \"no_slip\" }}\ntop = {{ slip_length = \"b\", velocity_x = 3 }}\n\
         [materials.thick]\nshear_viscosity = 8\n[[regions]]\nmaterial = \"thick\"\n\
         shape.rectangle = {{ x = [0, 1], y = [0.5, 1] }}\n"
    );
    let run = scene(&text, &[]);
    let t = 3.0 / (0.5 / 2.0 + 0.5 / 8.0 + 0.3 / 8.0);
    let exact = |y: f64| if y < 0.5 { t * y / 2.0 } else { t * (0.25 + (y - 0.5) / 8.0) };
    let worst = error(run.as_ref(), [0.0, 1.0], exact);
    assert!(worst < 1e-10, "{worst}");
}

#[test]
fn a_part_of_a_side_may_slip() {
    let whole = format!("{CHANNEL}bottom.kind = \"no_slip\"\ntop.slip_length = \"b\"\n");
    let parts = format!(
        "{CHANNEL}bottom.kind = \"no_slip\"\n[[boundaries.top.parts]]\nfrom = 0\nto = 0.5\n\
         slip_length = \"b\"\n[[boundaries.top.parts]]\nfrom = 0.5\nto = 1\nslip_length = \"b\"\n"
    );
    let force = "[body_force]\nx = 5\n";
    let [whole, parts] = [whole, parts].map(|text| scene(&format!("{text}{force}"), &[]));
    for k in 0..20 {
        let p = [0.37, 0.618].map(|s| (f64::from(k) * s) % 1.0);
        assert!((whole.velocity_at(p)[0] - parts.velocity_at(p)[0]).abs() < 1e-10);
    }
    assert!(whole.row().max_speed > 0.1);
}

#[test]
fn blocks_slip_between_rest_and_free_slip() {
    let with = |wall: &str| {
        let text = format!(
            "{CHANNEL}bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n[body_force]\nx = 5\n\
             [[blocks]]\nname = \"step\"\nx = [0.25, 0.75]\ny = [0.25, 0.5]\n{wall}\n"
        );
        scene(&text, &[])
    };
    let apart = |a: &dyn Run, b: &dyn Run| {
        let at = |k: i32| [0.37, 0.618].map(|s| (f64::from(k) * s) % 1.0);
        (0..50).map(at).fold(0.0, |worst: f64, p| {
            let (u, v) = (a.velocity_at(p), b.velocity_at(p));
            worst.max((u[0] - v[0]).hypot(u[1] - v[1]))
        })
    };
    let [rough, smooth] = ["kind = \"no_slip\"", "kind = \"free_slip\""].map(with);
    let [short, long] = ["slip_length = 1e-7", "slip_length = 1e7"].map(with);
    assert!(apart(rough.as_ref(), short.as_ref()) < 1e-6);
    assert!(apart(smooth.as_ref(), long.as_ref()) < 1e-6);
    let middle = with("slip_length = 0.2");
    let flow = [&rough, &middle, &smooth].map(|run| run.row().rms_speed);
    assert!(flow[0] < flow[1] && flow[1] < flow[2], "{flow:?}");
}

/// A column of unit width with friction at its walls, whose base descends.
const COLUMN: &str = r#"schema = 1
name = "column"
gravity = [0, -10]
[parameters]
wall = { default = 0.5 }
[domain]
x = [0, 1]
y = [0, 6]
[accuracy]
cells = 8
nonlinear_tolerance = 1e-3
[time]
steady = true
[materials.fill]
density = 1000
LAW
[[regions]]
material = "fill"
[boundaries]
left.wall_friction = "wall"
right.wall_friction = "wall"
bottom.velocity_y = -0.1
top.kind = "open"
"#;

/// Pressure at depth in a column of unit width with the weight 1e4 Pa/m (Janssen 1895).
fn janssen(depth: f64, wall: f64) -> f64 {
    1e4 / (2.0 * wall) * (1.0 - (-2.0 * wall * depth).exp())
}

/// Mean of the pressures at both walls of the column between two heights.
fn at_the_walls(run: &dyn Run, [low, high]: [f64; 2]) -> f64 {
    let n = 40;
    let at = |k: i32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(n);
    let both = |y: f64| run.pressure_at([1e-9, y]) + run.pressure_at([1.0 - 1e-9, y]);
    (0..n).map(|k| 0.5 * both(at(k))).sum::<f64>() / f64::from(n)
}

#[test]
fn the_stress_on_the_walls_of_a_deep_column_saturates() {
    for (law, wall) in [
        ("shear_viscosity = 1e4", 0.5),
        ("friction = { static = 0.8, grain_diameter = 1e-3 }", 0.5),
    ] {
        let run = scene(&COLUMN.replace("LAW", law), &[&format!("wall={wall}")]);
        let deep = at_the_walls(run.as_ref(), [0.75, 2.0]);
        let last = 1e4 / (2.0 * wall);
        // Viscous: 9976 of 10000; grains: within 1.1 %.
        assert!((deep / last - 1.0).abs() < 0.03, "{law}, {wall}: {deep} {last}");
        for k in 0..8 {
            let y = 1.25 + 0.5 * f64::from(k);
            let p = run.pressure_at([0.5, y]);
            let expected = janssen(6.0 - y, wall);
            assert!((p / expected - 1.0).abs() < 0.04, "{law}, {y}: {p} {expected}");
        }
        let v = run.velocity_at([0.0, 3.0])[1];
        assert!(v < -0.01, "the walls slip: {v}");
    }
}

#[test]
fn a_column_that_descends_keeps_the_stress_on_its_walls() {
    let text = COLUMN.replace("steady = true", "end = 4").replace("[0, 6]", "[0, 4]");
    let text = text.replace("LAW", "friction = { static = 0.8, grain_diameter = 1e-3 }");
    let mut run = scene(&text, &["accuracy.cells=6", "recording.frames=8"]);
    finish(run.as_mut(), |run| {
        let deep = at_the_walls(run, [0.75, 1.5]);
        let expected = janssen(4.0 - 1.125, 0.5);
        let row = run.row();
        assert!((deep / expected - 1.0).abs() < 0.04, "t = {}: {deep} {expected}", row.time);
        // The base descends by 0.4; as much enters at the top as leaves.
        assert!((row.volume_in - 0.1 * row.time).abs() < 1e-3, "{}", row.volume_in);
        assert!(row.power_error < 2e-5, "{}", row.power_error);
    });
    assert!((run.row().volume_out - 0.4).abs() < 0.03, "{}", run.row().volume_out);
}

#[test]
fn a_moving_wall_with_friction_slides_at_its_strength_and_sticks_below_it() {
    // The fluid has the viscosity 2, the wall moves with the speed 3 and presses with p.
    let text = format!(
        "{CHANNEL}bottom.kind = \"no_slip\"\ntop = {{ wall_friction = 0.4, velocity_x = 3 }}\n\
         [pressure_reference]\nat = [0.5, 0.5]\nvalue = \"pressure\"\n\
         [parameters.pressure]\ndefault = 1\n"
    );
    for (pressure, tolerance) in
        [(1.0, 1e-6), (10.0, 1e-6), (14.9, 1e-6), (15.2, 1e-3), (100.0, 1e-3)]
    {
        let run =
            scene(&text, &[&format!("pressure={pressure}"), "accuracy.nonlinear_tolerance=1e-8"]);
        let stress = f64::min(0.4 * pressure, 2.0 * 3.0);
        let worst = error(run.as_ref(), [0.0, 1.0], |y| stress / 2.0 * y);
        assert!(worst < tolerance * stress, "{pressure}: {worst}");
        assert!((run.row().power_in / (3.0 * stress) - 1.0).abs() < 1e-2);
        assert!(run.row().power_error < 1e-6);
    }
}
