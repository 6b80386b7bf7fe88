//! Physics tests: exact solutions, convergence rates, invariants and symmetry.

mod alignment;
mod axisymmetric;
mod dynamics;
mod effects;
mod exact;
mod grains;
mod inertia;
mod inflow;
mod laws;
mod measure;
mod moving;
mod openings;
mod order;
mod patch;
mod rest;
mod slip;
mod solids;
mod sources;
mod steps;
mod verification;
mod void;

use grainscope::plan::resolve;
use grainscope::scene::{SceneSource, parse};
use grainscope::sim::{self, Run};
use std::sync::Arc;

/// Starts a run of a scene with `--set` assignments.
pub fn start(source: SceneSource, sets: &[&str]) -> Box<dyn Run> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let source = source.with_sets(&sets).unwrap_or_else(|e| panic!("{:?}", e.lines()));
    let scene = parse(&source).unwrap_or_else(|e| panic!("{:?}", e.lines()));
    let plan = resolve(&scene).unwrap_or_else(|e| panic!("{:?}", e.with_source(&source).lines()));
    sim::start(Arc::new(plan)).unwrap_or_else(|e| panic!("{e}"))
}

/// Starts a run of a preset with `--set` assignments.
pub fn preset(name: &str, sets: &[&str]) -> Box<dyn Run> {
    start(grainscope::scene::presets::find(name).unwrap_or_else(|e| panic!("{e}")), sets)
}

/// Starts a run of a scene text with `--set` assignments.
pub fn scene(text: &str, sets: &[&str]) -> Box<dyn Run> {
    start(SceneSource::new("test", text), sets)
}

/// Takes all steps to the end; `each` is called at the start and after each step.
pub fn finish(run: &mut dyn Run, mut each: impl FnMut(&dyn Run)) {
    each(run);
    while !run.is_finished() {
        run.step().unwrap_or_else(|e| panic!("{e}"));
        each(run);
    }
}

/// Volume of a material, m3 around an axis, m2 in the plane.
pub fn volume(run: &dyn Run, name: &str) -> f64 {
    let plan = run.plan();
    let m = plan.state.materials.iter().position(|m| m.name == name).unwrap();
    run.particles().volume_of(m) * plan.units.volume()
}
