//! Compares Cosserat Couette and Poiseuille flow and the coupled cell with their exact solutions.

use grainscope::internals::{Case, Fluid, couette, coupled_cell, poiseuille};

/// Fluid of all cases.
const FLUID: Fluid = Fluid { shear: 1.0, coupling: 1.0, internal_length: 0.3 };

/// Checks the convergence rates when the number of cells is doubled.
fn check_rates(case: &Case, coarse: u32) {
    let a = case.errors(coarse, &[]).unwrap();
    let b = case.errors(2 * coarse, &[]).unwrap();
    let rate = |a: f64, b: f64| (a / b).log2();
    let observed =
        [rate(a.velocity, b.velocity), rate(a.rotation, b.rotation), rate(a.pressure, b.pressure)];
    println!("{}: {a:?} -> {b:?}, rates {observed:.2?}", case.name);
    assert!(observed[0] >= case.rates.velocity, "{} velocity: {observed:?}", case.name);
    if let Some(expected) = case.rates.rotation {
        assert!(observed[1] >= expected, "{} rotation: {observed:?}", case.name);
    }
    if let Some(expected) = case.rates.pressure {
        assert!(observed[2] >= expected, "{} pressure: {observed:?}", case.name);
    }
}

#[test]
fn couette_converges_at_the_elements_order() {
    check_rates(&couette(FLUID, 1.0), 16);
}

#[test]
fn poiseuille_converges_at_the_elements_order() {
    check_rates(&poiseuille(FLUID, 1.0), 16);
}

#[test]
fn coupled_cell_converges_at_the_elements_order() {
    check_rates(&coupled_cell(FLUID, 1, 1), 16);
    check_rates(&coupled_cell(Fluid { coupling: 0.4, ..FLUID }, 1, 2), 16);
}

#[test]
fn couette_has_the_apparent_viscosity_of_theory() {
    // Values of linear theory to eleven digits.
    for (coupling, length, apparent) in [(1.0, 0.3, 1.3876032024), (0.5, 0.1, 1.0612713453)] {
        let fluid = Fluid { shear: 1.0, coupling, internal_length: length };
        let run = couette(fluid, 1.0).solve(48, &[]).unwrap();
        let speed = run.velocity_at([0.1, 0.5])[0] - run.velocity_at([0.1, -0.5])[0];
        assert!((1.0 / speed / apparent - 1.0).abs() < 1e-6, "{} {apparent}", 1.0 / speed);
    }
}

#[test]
fn poiseuille_has_the_discharge_of_theory() {
    let mut run = crate::preset("poiseuille_cosserat", &["accuracy.cells=24", "time.end=0.4"]);
    let rate = run.row().gauges[0].rate;
    // The gauge integrates with 8 samples per cell, at second order in the profile.
    assert!((rate / 0.04778428 - 1.0).abs() < 1e-4, "{rate}");
    crate::finish(run.as_mut(), |_| {});
    let volume = run.row().gauges[0].volume;
    assert!((volume / (0.4 * rate) - 1.0).abs() < 0.03, "{volume}");
}

#[test]
fn free_rotation_at_the_walls_gives_the_classical_solution() {
    let text = couette(FLUID, 1.0).scene.text().replace(", rotation = 0", "");
    let run = crate::scene(&text, &["accuracy.cells=5", "accuracy.placement=random"]);
    for y in [-0.43, -0.1, 0.22, 0.5] {
        let [u, v, w] = run.velocity_at([0.13, y]);
        assert!((u - y).abs() < 1e-10 && v.abs() < 1e-10 && (w + 0.5).abs() < 1e-10, "{u} {v} {w}");
    }
}

#[test]
fn infinite_internal_length_scales_all_velocities() {
    // R -> infinity between straight walls: velocities are multiplied by eta/(eta + eta_c).
    let fluid = Fluid { shear: 1.0, coupling: 3.0, internal_length: 1e4 };
    let run = couette(fluid, 1.0).solve(8, &[]).unwrap();
    for y in [-0.4, 0.1, 0.5] {
        assert!((run.velocity_at([0.1, y])[0] - y / 4.0).abs() < 1e-7);
    }
}
