//! What the physics demands: exact solutions, rates, invariants, symmetry.

mod alignment;
mod dynamics;
mod effects;
mod exact;
mod laws;
mod order;
mod patch;
mod rest;
mod steps;
mod verification;

use grainscope::plan::resolve;
use grainscope::scene::{SceneSource, parse};
use grainscope::sim::{self, Run};
use std::sync::Arc;

/// A run of a scene text or preset, with `--set`s, at its first instant.
pub fn start(source: SceneSource, sets: &[&str]) -> Box<dyn Run> {
    let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
    let source = source.with_sets(&sets).unwrap_or_else(|e| panic!("{:?}", e.lines()));
    let scene = parse(&source).unwrap_or_else(|e| panic!("{:?}", e.lines()));
    let plan = resolve(&scene).unwrap_or_else(|e| panic!("{:?}", e.with_source(&source).lines()));
    sim::start(Arc::new(plan)).unwrap_or_else(|e| panic!("{e}"))
}

pub fn preset(name: &str, sets: &[&str]) -> Box<dyn Run> {
    start(grainscope::scene::presets::find(name).unwrap_or_else(|e| panic!("{e}")), sets)
}

pub fn scene(text: &str, sets: &[&str]) -> Box<dyn Run> {
    start(SceneSource::new("test", text), sets)
}

/// Steps to the end.
pub fn finish(run: &mut dyn Run, mut each: impl FnMut(&dyn Run)) {
    each(run);
    while !run.is_finished() {
        run.step().unwrap_or_else(|e| panic!("{e}"));
        each(run);
    }
}
