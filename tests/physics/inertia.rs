//! Inertia: uniform motion, resumed runs, and the limit of creeping flow. Motions that are known
//! exactly are those of `verify`.

use crate::{finish, scene};
use grainscope::sim::Run;

/// A heavy drop and light fluid that move together through a periodic box.
const UNIFORM: &str = r#"schema = 1
name = "uniform"
inertia = true
[domain]
x = [0, 1]
y = [0, 1]
[accuracy]
cells = 8
[time]
end = 0.5
max_step = 0.05
tolerance = 1
courant = 10
[materials.light]
density = 0.1
shear_viscosity = 0.01
[materials.heavy]
density = 1
shear_viscosity = 0.1
[[regions]]
material = "light"
[[regions]]
material = "heavy"
shape.circle = { centre = [0.4, 0.5], radius = 0.22 }
[initial_velocity]
x = 1
y = 0.5
[boundaries]
left.kind = "periodic"
right.kind = "periodic"
bottom.kind = "periodic"
top.kind = "periodic"
"#;

#[test]
fn a_uniform_motion_stays_uniform() {
    let mut run = scene(UNIFORM, &[]);
    finish(run.as_mut(), |run| {
        for k in 0..20 {
            let at = [0.618, 0.37].map(|s| (k as f64 * s) % 1.0);
            let [u, v, _] = run.velocity_at(at);
            let off = (u - 1.0).abs().max((v - 0.5).abs());
            assert!(off < 1e-10, "t = {}, {at:?}: {u} {v}", run.row().time);
        }
    });
}

#[test]
fn a_resumed_run_equals_the_uninterrupted_one() {
    // Gravity stirs the fluids.
    let sets = [
        "gravity=[0.3,-1]",
        "boundaries.bottom.kind=\"no_slip\"",
        "boundaries.top.kind=\"no_slip\"",
    ];
    let mut whole = scene(UNIFORM, &sets);
    for _ in 0..3 {
        whole.step().unwrap();
    }
    let state = whole.state();
    let mut resumed = scene(UNIFORM, &sets);
    resumed.restore(&state).unwrap();
    for _ in 0..3 {
        whole.step().unwrap();
        resumed.step().unwrap();
    }
    assert_eq!(whole.state_hash(), resumed.state_hash());
    for at in [[0.4, 0.5], [0.1, 0.9], [0.7, 0.3]] {
        assert_eq!(whole.velocity_at(at), resumed.velocity_at(at));
    }
    assert_eq!(whole.row().kinetic_energy, resumed.row().kinetic_energy);
}

#[test]
fn a_flow_without_inertia_has_no_momentum() {
    let text = UNIFORM
        .replace("inertia = true\n", "gravity = [0, -1]\n")
        .replace("[initial_velocity]\nx = 1\ny = 0.5\n", "")
        .replace("bottom.kind = \"periodic\"", "bottom.kind = \"no_slip\"")
        .replace("top.kind = \"periodic\"", "top.kind = \"no_slip\"");
    let creeping = scene(&text, &[]);
    assert_eq!(creeping.row().kinetic_energy, 0.0);
    // Very stiff fluids with inertia creep after a short step.
    let stiff = ["materials.light.shear_viscosity=1e4", "materials.heavy.shear_viscosity=1e4"];
    let mut slow = scene(&text.replace("gravity =", "inertia = true\ngravity ="), &stiff);
    let creeping = scene(&text, &stiff);
    let speed = |run: &dyn Run| run.velocity_at([0.4, 0.5])[1];
    slow.step().unwrap();
    slow.step().unwrap();
    let [a, b] = [speed(&*slow), speed(&*creeping)];
    assert!(b < 0.0 && (a / b - 1.0).abs() < 1e-2, "{a} {b}");
}

/// Water that is pushed through a box above a lighter fluid.
const PUSHED: &str = r#"schema = 1
name = "pushed"
inertia = true
gravity = [0, -1]
[domain]
x = [0, 1]
y = [0, 2]
[accuracy]
cells = 8
[time]
end = 1
[materials.water]
density = 1
shear_viscosity = 0.01
[materials.light]
density = 0.1
shear_viscosity = 0.01
background = true
[[regions]]
material = "water"
shape.where = "y > 1"
[boundaries]
top = { velocity_x = 0, velocity_y = -1, inflow = "water" }
"#;

#[test]
fn the_energy_that_crosses_the_sides_is_counted() {
    // A plug of both fluids: no dissipation, and every energy is known.
    let mut run = scene(&format!("{PUSHED}bottom.kind = \"open\"\n"), &["time.end=0.75"]);
    finish(run.as_mut(), |_| ());
    let row = run.row();
    let t = row.time;
    // Water enters at y = 2 and light fluid leaves at y = 0, both at unit speed; densities of potential
    // energy are relative to the light fluid.
    let out = 0.5 * 0.1 * t - t * (0.9 * 2.0 + 0.5);
    assert!((row.energy_out - out).abs() < 0.02 * out.abs(), "{} {out}", row.energy_out);
    assert!((row.kinetic_energy - 0.5 * (1.1 + 0.9 * t)).abs() < 1e-2, "{}", row.kinetic_energy);
    assert!(row.dissipated < 1e-12 && row.energy_error.abs() < 2e-3, "{}", row.energy_error);
}

#[test]
fn a_flow_that_a_side_sets_in_motion_starts_smoothly() {
    let slit = "[boundaries.bottom]\nkind = \"no_slip\"\n[[boundaries.bottom.parts]]\nfrom = 0.25\n\
                to = 0.75\nkind = \"outflow\"\n";
    for cells in ["8", "16"] {
        let mut run = scene(&format!("{PUSHED}{slit}"), &[&format!("accuracy.cells={cells}")]);
        // The flow of the impulse is fast at the lips of the slit, and the fluid there is slow at once.
        let first = run.row().max_speed;
        finish(run.as_mut(), |run| {
            let row = run.row();
            assert!(
                row.step == 0 || row.max_speed < 0.5 * first,
                "{}: {}",
                row.step,
                row.max_speed
            );
        });
        assert!(run.row().energy_error.abs() < 0.02, "{cells}: {}", run.row().energy_error);
    }
}

/// A Cosserat fluid in a periodic box that a couple sets turning.
const TURNING: &str = r#"schema = 1
name = "turning"
inertia = true
[domain]
x = [0, 1]
y = [0, 1]
[accuracy]
cells = 4
[time]
end = 1
max_step = 0.05
tolerance = 1
courant = 10
[materials.grains]
density = 2
shear_viscosity = 0.1
coupling_viscosity = 0.05
internal_length = 0.1
micro_inertia = 0.1
[[regions]]
material = "grains"
[body_force]
couple = 0.3
[boundaries]
left.kind = "periodic"
right.kind = "periodic"
bottom.kind = "periodic"
top.kind = "periodic"
"#;

#[test]
fn a_couple_turns_grains_with_inertia_gradually() {
    // rho j dw/dt = c - 4 eta_c w, with a uniform rotation that moves nothing.
    let at = |run: &dyn Run| run.velocity_at([0.3, 0.6]);
    let errors = [0.05, 0.025].map(|step| {
        let mut run = scene(TURNING, &["recording.frames=1", &format!("time.max_step={step}")]);
        assert!(at(&*run)[2].abs() < 1e-5);
        finish(run.as_mut(), |run| {
            let [u, v, w] = at(run);
            assert!(u.hypot(v) < 1e-10, "{u} {v}");
            assert!((run.row().kinetic_energy - 0.1 * w * w).abs() < 1e-10 * w * w);
        });
        assert!(run.row().energy_error.abs() < 5e-3, "{}", run.row().energy_error);
        let exact = 0.3 / 0.2 * (1.0 - (-0.2 * run.row().time / 0.2).exp());
        (at(&*run)[2] / exact - 1.0).abs()
    });
    assert!(errors[1] < 2e-4 && errors[0] / errors[1] > 3.5, "{errors:?}");
}

#[test]
fn a_rotation_without_inertia_follows_at_once() {
    let rotation = |sets: &[&str]| {
        let mut run = scene(TURNING, sets);
        (0..5).for_each(|_| run.step().unwrap());
        (run.velocity_at([0.3, 0.6])[2], run.state_hash())
    };
    let (none, hash) = rotation(&["materials.grains.micro_inertia=0"]);
    assert!((none / 1.5 - 1.0).abs() < 1e-10, "{none}");
    let without = TURNING.replace("micro_inertia = 0.1\n", "");
    let mut run = scene(&without, &[]);
    (0..5).for_each(|_| run.step().unwrap());
    assert_eq!((run.velocity_at([0.3, 0.6])[2], run.state_hash()), (none, hash));
    // Steps are far longer than the relaxation time of the light grains.
    let (light, _) = rotation(&["materials.grains.micro_inertia=1e-6"]);
    assert!((light / none - 1.0).abs() < 1e-3, "{light}");
}

#[test]
fn a_resumed_run_of_turning_grains_equals_the_uninterrupted_one() {
    for before in [0, 3] {
        let mut whole = scene(TURNING, &[]);
        (0..before).for_each(|_| whole.step().unwrap());
        let mut resumed = scene(TURNING, &[]);
        resumed.restore(&whole.state()).unwrap();
        for run in [&mut whole, &mut resumed] {
            (0..3).for_each(|_| run.step().unwrap());
        }
        let at = [0.3, 0.6];
        assert_eq!(whole.velocity_at(at), resumed.velocity_at(at), "{before}");
    }
}

#[test]
fn what_starts_as_a_rigid_body_turns_with_it() {
    let sets = ["materials.grains.micro_inertia=10"];
    let text =
        TURNING.replace("periodic", "no_slip").replace("[body_force]\ncouple = 0.3\n", "").replace(
            "[boundaries]",
            "[initial_velocity]\nx = \"-(y - 0.5)\"\ny = \"x - 0.5\"\n[boundaries]",
        );
    let run = scene(&text, &sets);
    let [_, _, w] = run.velocity_at([0.4, 0.55]);
    assert!((w - 1.0).abs() < 0.02, "{w}");
}
