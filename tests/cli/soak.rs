//! Long test (`.ci/run --long`): memory does not grow over 20,000 steps.

use super::*;
use grainscope::internals::{Curve, PlotAxis as Axis, PlotSpec, line_plot};
use std::process::Stdio;
use std::time::Duration;

/// Number of steps.
const STEPS: usize = 20_000;

/// Resident memory of a process, MB.
fn resident(id: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = text.lines().find(|l| l.starts_with("VmRSS"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kb| kb / 1e3)
}

/// Runs the scene, and returns pairs of step and resident memory (MB).
fn soak(here: &TempFolder, out: &str, more: &[&str]) -> Vec<(f64, f64)> {
    let limit = format!("time.max_step={}", 1.0 / STEPS as f64);
    let steps = STEPS.to_string();
    let sets =
        ["accuracy.cells=4", &limit, "time.end=2", "recording.times=[]", "recording.frames=100"];
    let mut run = vec!["run", "soak.toml", "--checkpoint-every", "500", "--steps", &steps];
    run.extend(sets.iter().flat_map(|set| ["--set", set]));
    run.extend(["--out", out]);
    run.extend(more);
    let mut child = here
        .command(&run)
        .stdout(Stdio::null())
        .stderr(Stdio::inherit())
        .spawn()
        .expect("the program starts");
    let mut points = Vec::new();
    let status = loop {
        if let Some(status) = child.try_wait().expect("known") {
            break status;
        }
        let rows = std::fs::read_to_string(here.path(out).join("series.csv"))
            .map_or(0, |t| t.lines().count().saturating_sub(2));
        // Not after the last step, when the table is read for the plots.
        let computing = rows > 0 && rows < STEPS;
        points.extend(resident(child.id()).filter(|_| computing).map(|mb| (rows as f64, mb)));
        std::thread::sleep(Duration::from_millis(250));
    };
    assert!(status.success());
    assert_eq!(here.json(&format!("{out}/summary.json"))["steps"], STEPS);
    points
}

#[test]
#[ignore = "takes minutes: .ci/run --long"]
fn memory_stays_where_it_is() {
    let here = TempFolder::new();
    let path = format!("{}/presets/shear_alignment.toml", env!("CARGO_MANIFEST_DIR"));
    here.write("soak.toml", std::fs::read_to_string(path).expect("a preset"));
    // The index at the end of a recording lists all its parts: some hundred bytes per step.
    let runs = [("computing", &["--no-recording"][..], 0.5), ("recording too", &[], 15.0)];
    let mut curves = Vec::new();
    for (k, (name, more, most)) in runs.into_iter().enumerate() {
        let points = soak(&here, &format!("soak{k}"), more);
        let at = |share: f64| {
            let from = share * STEPS as f64;
            let near = points.iter().filter(|p| (p.0 - from).abs() < 0.05 * STEPS as f64);
            let near: Vec<f64> = near.map(|p| p.1).collect();
            near.iter().sum::<f64>() / near.len() as f64
        };
        let (early, late) = (at(0.15), at(0.95));
        println!("{name}, {STEPS} steps: {early:.1} MB at 15 %, {late:.1} MB at 95 %");
        assert!(late < early + most, "{name}: {early} MB, then {late} MB");
        curves.push(Curve { name: name.into(), points, marks: false });
    }
    if let Some(folder) = std::env::var_os("GRAINSCOPE_FIGURES") {
        let stem = PathBuf::from(folder).join("soak");
        let plot = PlotSpec {
            title: format!("resident memory over {STEPS} steps"),
            x: Axis::new("step", ""),
            y: Axis::new("memory", "MB"),
            curves,
        };
        line_plot(&stem, &plot).expect("a plot");
    }
}
