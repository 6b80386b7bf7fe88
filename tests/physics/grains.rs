//! Friction and yield stress: rest below the yield stress, and scenes without flow curves. The exact
//! flows are those of `verify`.

use crate::scene;

/// A block in thin air on a rough floor.
const BLOCK: &str = r#"schema = 1
name = "block"
gravity = [0, -1]
[domain]
x = [0, 2]
y = [0, 1]
length_scale = 1
[accuracy]
cells = 8
[time]
end = 1
max_step = 0.1
[materials.clay]
density = 1
shear_viscosity = 1
yield_stress = "strength"
largest_viscosity = 1e4
smallest_viscosity = 1e-3
[materials.air]
shear_viscosity = 1e-2
background = true
[[regions]]
material = "clay"
shape.rectangle = { x = [0, 1], y = [0, 0.5] }
[parameters.strength]
default = 1
[boundaries]
bottom.kind = "no_slip"
top.kind = "open"
"#;

#[test]
fn a_block_below_its_yield_stress_stays_at_rest() {
    // Weight over four: the stress at the foot of the block is at most rho g H = 0.5.
    let [strong, weak] = ["strength=1", "strength=0.02"].map(|s| scene(BLOCK, &[s]));
    let corner = |run: &dyn grainscope::sim::Run| run.velocity_at([0.95, 0.2])[0].abs();
    // Creep of the largest viscosity: rho g H^2/eta = 2.5e-5.
    assert!(corner(&*strong) < 2.5e-5, "{}", corner(&*strong));
    assert!(corner(&*weak) > 1e-3, "{}", corner(&*weak));
}

#[test]
fn a_yield_stress_of_zero_is_a_plain_fluid() {
    let plain = BLOCK.replace(
        "yield_stress = \"strength\"\nlargest_viscosity = 1e4\nsmallest_viscosity = 1e-3\n",
        "",
    );
    let [plain, curve] = [scene(&plain, &[]), scene(BLOCK, &["strength=0"])];
    for at in [[0.9, 0.2], [0.5, 0.4], [1.2, 0.1]] {
        let [a, b] = [&plain, &curve].map(|run| run.velocity_at(at));
        for c in 0..2 {
            assert!((a[c] - b[c]).abs() < 1e-6 * plain.row().max_speed, "{at:?}: {a:?} {b:?}");
        }
    }
    assert_eq!(plain.row().nonlinear_iterations, 0);
}
