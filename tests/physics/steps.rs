//! Tests large time steps of stable stratified fluids, and growth rates of unstable ones.

use crate::scene;
use grainscope::internals::{Undulation, growth_ratio};
use grainscope::sim::Run;

/// A heavy fluid below a light one in a unit box, with a cosine-shaped interface.
fn sloshing(viscosity: f64, amplitude: f64, sets: &[&str]) -> Box<dyn Run> {
    let text = format!(
        "schema = 1\nname = \"slosh\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = 16\n[time]\nend = 1e12\n[recording]\nframes = 1\n\
         [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
         [materials.light]\nshear_viscosity = {viscosity}\n\
         [[regions]]\nmaterial = \"light\"\n[[regions]]\nmaterial = \"heavy\"\n\
         shape.where = \"y < 0.5 + {amplitude}*cos(pi*x)\"\n"
    );
    scene(&text, sets)
}

/// Relaxation time of the first mode of the interface, s.
fn relaxation(run: &dyn Run, amplitude: f64) -> f64 {
    -amplitude / run.velocity_at([0.0, 0.5])[1]
}

#[test]
fn a_disturbed_level_comes_to_rest_at_any_step() {
    let amplitude = 0.1;
    let late = |sets: &[&str]| {
        let courant = ["time.courant=0.5", "time.tolerance=1"];
        let mut run = sloshing(1.0, amplitude, &[sets, &courant].concat());
        let (tau, first) = (relaxation(run.as_ref(), amplitude), run.row().max_speed);
        let (mut longest, mut latest, mut rise) = (0.0f64, 0.0f64, 0.0f64);
        for step in 0..30 {
            let before = run.row().potential_energy;
            run.step().unwrap();
            let row = run.row();
            longest = longest.max(row.dt / tau);
            rise = rise.max(row.potential_energy - before);
            if step > 20 {
                latest = latest.max(row.max_speed / first);
            }
            assert!(row.power_error < 1e-6, "{}", row.power_error);
        }
        println!("{sets:?}: steps up to {longest} tau, late speed {latest:e}, rise {rise:e}");
        [longest, latest, rise]
    };
    // Only the Courant number and the energy limit the step.
    let [longest, latest, rise] = late(&[]);
    assert!(longest > 30.0 && latest < 0.05 && rise < 1e-9, "{longest} {latest} {rise}");
    // Without stabilisation it oscillates, which costs energy, until the energy shortens the steps.
    let [shorter, latest, rise] = late(&["accuracy.stabilisation=0"]);
    assert!(shorter < longest && latest < 0.05 && rise > 1e-6, "{shorter} {latest} {rise}");
}

#[test]
fn a_level_at_rest_stays_at_rest_at_any_step() {
    let mut run = sloshing(1e-3, 0.0, &["time.max_step=1e9"]);
    for _ in 0..5 {
        run.step().unwrap();
        assert!(run.row().max_speed < 1e-12, "{}", run.row().max_speed);
    }
}

/// Velocities of a disturbed stratified fluid after most of the disturbance has decayed in `steps`
/// steps.
fn settled(steps: u32, sets: &[&str]) -> Vec<f64> {
    let text = format!(
        "schema = 1\nname = \"strata\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = 8\n[time]\nend = 100\nmax_step = \"100/{steps}\"\ncourant = 50\ntolerance = 1\n\
         [recording]\nframes = 1\n[materials.a]\nshear_viscosity = 1\n\
         density = \"1-y+0.1*cos(pi*x)*sin(pi*y)\"\n[[regions]]\nmaterial = \"a\"\n"
    );
    let mut run = scene(&text, sets);
    while !run.is_finished() {
        run.step().unwrap();
    }
    assert_eq!(run.row().step, u64::from(steps));
    let places = (0..49).map(|k| [f64::from(k % 7), f64::from(k / 7)].map(|c| (c + 0.5) / 7.0));
    places.flat_map(|p| run.velocity_at(p)[..2].to_vec()).collect()
}

#[test]
fn stabilised_steps_are_second_order_and_no_less_accurate() {
    let reference = settled(256, &["accuracy.integrator=midpoint", "accuracy.stabilisation=0"]);
    let error = |steps: u32, sets: &[&str]| {
        let sum: f64 =
            settled(steps, sets).iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / reference.iter().map(|b| b * b).sum::<f64>()).sqrt()
    };
    let [coarse, fine] = [16, 32].map(|steps| error(steps, &[]));
    let plain = error(32, &["accuracy.stabilisation=0"]);
    println!("stabilised {coarse:e} {fine:e}, not stabilised {plain:e}");
    assert!((coarse / fine).log2() > 1.8, "{coarse:e} {fine:e}");
    assert!(fine < plain, "{fine:e} {plain:e}");
}

#[test]
fn small_undulations_grow_at_the_rate_of_linear_theory() {
    // The amplitude is at most a hundredth of a cell. The interface cuts cells at 64 cells and lies
    // on a mesh line at 50. At 32 cells, with cut cells, the error is up to 1.4 %.
    for (cells, amplitude, viscosities) in
        [(64, 1e-4, &[0.1, 1.0, 10.0, 100.0][..]), (50, 2e-5, &[0.01, 0.1, 1.0, 10.0, 100.0])]
    {
        for wavelength in [0.5, 1.8284, 3.0] {
            for &viscosity in viscosities {
                let u = Undulation { wavelength, viscosity, amplitude };
                let ratio = growth_ratio(u, cells, &[]).unwrap();
                println!("{cells} cells, wavelength {wavelength}, viscosity {viscosity}: {ratio}");
                assert!((ratio - 1.0).abs() < 0.01, "{cells}, {wavelength}, {viscosity}: {ratio}");
            }
        }
    }
}

/// A drop that falls in a background much thinner than itself.
fn falling(sets: &[&str]) -> Box<dyn Run> {
    let text = "schema = 1\nname = \"drop\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
                [accuracy]\ncells = 12\n[time]\nend = 8\n[recording]\nframes = 1\n\
                [materials.drop]\ndensity = 1\nshear_viscosity = 1\n\
                [materials.air]\nshear_viscosity = 0.02\nbackground = true\n[[regions]]\n\
                material = \"drop\"\nshape.circle = { centre = [0.45, 0.6], radius = 0.22 }\n";
    scene(text, sets)
}

#[test]
fn the_tolerance_of_a_step_bounds_the_error_of_the_displacements() {
    let centre = |sets: &[&str]| {
        let mut run = falling(sets);
        while !run.is_finished() {
            run.step().unwrap();
        }
        let p = run.particles();
        let drop = (0..p.len()).filter(|&k| p.material[k] == 0);
        let (volume, moment) = drop
            .fold((0.0, 0.0), |(v, m), k| (v + p.volume[k], m + p.volume[k] * p.position[k][1]));
        (moment / volume, run.row().step)
    };
    let (reference, _) = centre(&["time.tolerance=1", "time.max_step=0.05"]);
    let [coarse, fine] = ["time.tolerance=0.3", "time.tolerance=0.01"].map(|t| centre(&[t]));
    println!("{reference} {coarse:?} {fine:?}");
    assert!(fine.1 > 2 * coarse.1, "{coarse:?} {fine:?}");
    // In units of length; a cell is 1/12.
    assert!((fine.0 - reference).abs() < 1e-3, "{reference} {fine:?}");
    assert!((coarse.0 - reference).abs() < 2e-2, "{reference} {coarse:?}");
}
