//! Slip along walls: plane flows whose exact velocities are linear or quadratic.

use crate::scene;
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
