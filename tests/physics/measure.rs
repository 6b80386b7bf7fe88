//! The measure of integration: a slab of depth 2 has twice the forces, powers and volumes of the plane,
//! and the same flow.

use grainscope::internals::{Measure, Mesh};
use grainscope::sim::Run;
use grainscope::{plan, scene, sim};
use std::sync::Arc;

fn run(name: &str, sets: &[&str], measure: Measure, steps: usize) -> Box<dyn Run> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let source = scene::presets::find(name).unwrap().with_sets(&sets).unwrap();
    let mut plan = plan::resolve(&scene::parse(&source).unwrap()).unwrap();
    plan.mesh = Arc::new(Mesh::clone(&plan.mesh).with_measure(measure));
    let mut run = sim::start(Arc::new(plan)).unwrap();
    (0..steps).for_each(|_| run.step().unwrap());
    run
}

#[test]
fn a_slab_of_depth_two_has_twice_the_forces_and_the_same_flow() {
    for (name, sets, point) in [
        ("silo", &["accuracy.cells=3", "alpha=1"][..], [0.1, 3.2]),
        ("shear_alignment", &["accuracy.cells=6"], [0.4, 0.7]),
        ("layer_stack", &["accuracy.cells=8"], [0.3, 0.6]),
    ] {
        let plane = run(name, sets, Measure::PLANE, 3);
        let slab = run(name, sets, Measure::slab(2.0), 3);
        let (a, b) = (plane.row(), slab.row());
        let same = |what: &str, x: f64, y: f64, scale: f64| {
            assert!((x - y).abs() <= 1e-9 * scale.abs(), "{name}: {what}: {x} {y}");
        };
        same("time", a.time, b.time, a.time);
        let (u, v) = (plane.velocity_at(point), slab.velocity_at(point));
        for c in 0..2 {
            same("velocity", u[c], v[c], a.max_speed);
        }
        let stress = a.dissipation / a.max_speed;
        same("pressure", plane.pressure_at(point), slab.pressure_at(point), stress.max(1e6));
        for (what, x, y) in [
            ("loads", a.power_in, b.power_in),
            ("dissipation", a.dissipation, b.dissipation),
            ("potential energy", a.potential_energy, b.potential_energy),
            ("dissipated energy", a.dissipated, b.dissipated),
        ] {
            same(what, 2.0 * x, y, 2.0 * x);
        }
        for (x, y) in a.gauges.iter().zip(&b.gauges) {
            same("volume", 2.0 * x.volume, y.volume, 2.0 * x.volume);
            same("rate", 2.0 * x.rate, y.rate, 2.0 * x.rate);
        }
        assert!(b.power_error < 1e-8 && b.divergence_error < 1e-8);
    }
}
