//! Compares Cosserat Couette and Poiseuille flow, the coupled cell and bending layers with their exact
//! solutions.

use grainscope::internals::{
    Case, CoupleWave, Fluid, Layered, couette, couple_wave, coupled_cell, layered_channel,
    poiseuille,
};

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

/// Layers that bend.
const LAYERS: Layered = Layered {
    shear: 1.0,
    layer: 0.5,
    coupling: 0.5,
    internal_length: 0.1,
    layer_internal_length: 0.3,
};

#[test]
fn layers_in_a_channel_flow_as_the_isotropic_fluid_of_their_direction() {
    for across in [false, true] {
        let layered = layered_channel(LAYERS, across, 1.0).solve(16, &[]).unwrap();
        let plain = poiseuille(LAYERS.in_channel(across), 1.0).solve(16, &[]).unwrap();
        for y in [-0.47, -0.3, 0.01, 0.25, 0.4] {
            let [a, b] = [&layered, &plain].map(|run| run.velocity_at([0.1, y]));
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() < 1e-10, "{across} {y}: {a:?} {b:?}");
            }
        }
    }
    // The bending length matters across the channel only.
    let discharge = |across, layer_internal_length| {
        let fluid = Layered { layer_internal_length, ..LAYERS };
        layered_channel(fluid, across, 1.0).solve(16, &[]).unwrap().velocity_at([0.1, 0.0])[0]
    };
    assert!((discharge(false, 0.3) / discharge(false, 3.0) - 1.0).abs() < 1e-10);
    assert!(discharge(true, 0.3) > 1.1 * discharge(true, 3.0));
}

#[test]
fn bending_layers_converge_at_the_elements_order() {
    for across in [false, true] {
        check_rates(&layered_channel(LAYERS, across, 1.0), 16);
    }
    // More coupling than shear viscosity, oblique to mesh and layers.
    let fluid = Layered { coupling: 3.0, ..LAYERS };
    check_rates(&couple_wave(fluid, CoupleWave { waves: [2, 1], director: 35.0 }), 16);
}

#[test]
fn the_power_of_bending_turns_with_the_layers() {
    let power = |fluid: Layered, waves, director| {
        let case = couple_wave(fluid, CoupleWave { waves, director });
        case.solve(48, &[]).unwrap().row().dissipation
    };
    let only_along = Layered { internal_length: 0.0, ..LAYERS };
    let only_across = Layered { layer_internal_length: 0.0, ..LAYERS };
    for fluid in [LAYERS, only_along, only_across] {
        for director in [0.0, 50.0, 90.0] {
            let expected = power(fluid, [5, 0], director);
            for waves in [[3, 4], [0, 5], [4, 3]] {
                let found = power(fluid, waves, director);
                assert!(
                    (found / expected - 1.0).abs() < 4e-3,
                    "{waves:?} {director} {found} {expected}"
                );
            }
        }
    }
    // The wave bends layers along it, but not those across it.
    let [along, across] = [90.0, 0.0].map(|director| power(LAYERS, [5, 0], director));
    let [stiff_along, stiff_across] = [90.0, 0.0]
        .map(|director| power(Layered { layer_internal_length: 0.6, ..LAYERS }, [5, 0], director));
    assert!(stiff_along < 0.5 * along && (stiff_across / across - 1.0).abs() < 1e-6);
}
