//! Nozzles inside the domain: exact volumes, symmetry, times, and free paths.

use crate::{finish, scene, volume};

/// A nozzle above the middle of a box of air with open sides.
const SPOUT: &str = r#"schema = 1
name = "spout"
gravity = [0, -10]
[domain]
x = [-1, 1]
y = [0, 1]
[accuracy]
cells = 12
[time]
end = 0.5
[materials.syrup]
density = 100
shear_viscosity = 100
[materials.air]
shear_viscosity = 1
background = true
[[regions]]
material = "syrup"
shape.rectangle = { x = [-0.25, 0.25], y = [0.65, 0.75] }
[boundaries]
bottom.kind = "no_slip"
left.kind = "open"
right.kind = "open"
top.kind = "open"
[[sources]]
name = "spout"
from = [-0.25, 0.75]
to = [0.25, 0.75]
material = "syrup"
speed = 0.8
to_time = 0.3
"#;

#[test]
fn a_nozzle_adds_its_volume_to_rounding_and_stops() {
    let mut run = scene(SPOUT, &[]);
    let first = ["syrup", "air"].map(|m| volume(run.as_ref(), m));
    let mut seen = [false; 2];
    finish(run.as_mut(), |run| {
        let row = run.row();
        let [syrup, air] = ["syrup", "air"].map(|m| volume(run, m));
        let poured = 0.5 * 0.8 * row.time.min(0.3);
        assert!((syrup - first[0] - poured).abs() < 1e-12, "t = {}: {syrup} {poured}", row.time);
        let balance = first[0] + first[1] + row.volume_in - row.volume_out - syrup - air;
        assert!(balance.abs() < 1e-12, "t = {}: {balance}", row.time);
        // The mouth pushes with the given speed as long as it is on.
        let below = run.velocity_at([0.0, 0.75 - 1e-9])[1];
        let on = row.time < 0.3 - 1e-9;
        seen[usize::from(on)] = true;
        assert!((below + if on { 0.8 } else { 0.0 }).abs() < 1e-6, "t = {}: {below}", row.time);
        let filled = 2.0 - 0.5 / 12.0;
        assert!(((syrup + air) / filled - 1.0).abs() < 0.02, "{syrup} {air} {filled}");
    });
    assert_eq!(seen, [true; 2]);
}

#[test]
fn a_nozzle_turned_by_a_quarter_gives_the_turned_flow() {
    let down = scene(SPOUT, &["gravity=[0, 0]", "domain.y=[-1, 1]", "accuracy.cells=16"]);
    let sets = [
        "gravity=[0, 0]",
        "domain.y=[-1, 1]",
        "accuracy.cells=16",
        "boundaries.bottom.kind=open",
        "boundaries.left.kind=no_slip",
        "sources[0].from=[0.75, -0.25]",
        "sources[0].to=[0.75, 0.25]",
        "regions[0].shape.rectangle={ x = [0.65, 0.75], y = [-0.25, 0.25] }",
    ];
    let left = scene(SPOUT, &sets);
    let up = [
        "gravity=[0, 0]",
        "domain.y=[-1, 1]",
        "accuracy.cells=16",
        "boundaries.bottom.kind=open",
        "boundaries.top.kind=no_slip",
        "sources[0].from=[-0.25, -0.75]",
        "sources[0].to=[0.25, -0.75]",
        "sources[0].direction=up",
        "regions[0].shape.rectangle={ x = [-0.25, 0.25], y = [-0.75, -0.65] }",
    ];
    let up = scene(SPOUT, &up);
    let mut largest = 0.0_f64;
    for k in 0..60 {
        let [x, y] = [0.618, 0.37].map(|s| 1.96 * ((k as f64 * s) % 1.0) - 0.98);
        let [u, v, _] = down.velocity_at([x, y]);
        largest = largest.max(v.abs());
        let [a, b, _] = left.velocity_at([y, x]);
        assert!((a - v).abs() < 1e-9 && (b - u).abs() < 1e-9, "({x}, {y}): {u} {v} {a} {b}");
        let [a, b, _] = up.velocity_at([x, -y]);
        assert!((a - u).abs() < 1e-9 && (b + v).abs() < 1e-9, "({x}, {y}): {u} {v} {a} {b}");
    }
    assert!(largest > 0.5, "{largest}");
}

#[test]
fn a_nozzle_that_starts_later_is_a_wall_until_then() {
    let sets = ["sources[0].from_time=0.2", "gravity=[0, 0]", "time.end=0.4", "recording.frames=3"];
    let mut run = scene(SPOUT, &sets);
    let first = volume(run.as_ref(), "syrup");
    let mut stops = vec![];
    finish(run.as_mut(), |run| {
        let row = run.row();
        stops.push(row.time);
        let poured = 0.4 * (row.time.min(0.3) - 0.2).max(0.0);
        assert!((volume(run, "syrup") - first - poured).abs() < 1e-12, "t = {}", row.time);
    });
    for time in [0.2, 0.3] {
        assert!(stops.iter().any(|t| (t - time).abs() < 1e-12), "{stops:?}");
    }
}
