//! Twenty thousand steps: memory stays where it is. Part of the long tier (`.ci/run --long`).

use super::*;
use grainscope::record::plots::{Axis, Curve, PlotSpec, line_plot};
use std::process::Stdio;
use std::time::Duration;

const STEPS: usize = 20_000;

/// Resident memory of a process, MB.
fn resident(id: u32) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = text.lines().find(|l| l.starts_with("VmRSS"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kb| kb / 1e3)
}

#[test]
#[ignore = "takes minutes: .ci/run --long"]
fn memory_stays_where_it_is() {
    let here = TempFolder::new();
    let limit = format!("time.max_step={}", 1.0 / STEPS as f64);
    let scene = std::fs::read_to_string(format!(
        "{}/presets/shear_alignment.toml",
        env!("CARGO_MANIFEST_DIR")
    ));
    here.write("soak.toml", scene.expect("a preset"));
    let run = [
        "run",
        "soak.toml",
        "--set",
        "accuracy.cells=4",
        "--set",
        &limit,
        "--set",
        "time.end=2",
        "--set",
        "recording.times=[]",
        "--set",
        "recording.frames=100",
        "--checkpoint-every",
        "500",
        "--steps",
        "20000",
        "--out",
        "soak",
    ];
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
        let rows = std::fs::read_to_string(here.path("soak/series.csv"))
            .map_or(0, |t| t.lines().count().saturating_sub(2));
        points.extend(resident(child.id()).filter(|_| rows > 0).map(|mb| (rows as f64, mb)));
        std::thread::sleep(Duration::from_millis(500));
    };
    assert!(status.success());
    assert_eq!(here.json("soak/summary.json")["steps"], STEPS);
    let at = |share: f64| {
        let from = (share * STEPS as f64) as usize;
        let near: Vec<f64> = points
            .iter()
            .filter(|p| (p.0 - from as f64).abs() < 0.05 * STEPS as f64)
            .map(|p| p.1)
            .collect();
        near.iter().sum::<f64>() / near.len() as f64
    };
    let (early, late) = (at(0.15), at(0.95));
    println!("{STEPS} steps: {early:.1} MB at 15 %, {late:.1} MB at 95 %");
    if let Some(folder) = std::env::var_os("GRAINSCOPE_FIGURES") {
        let stem = PathBuf::from(folder).join("soak");
        let plot = PlotSpec {
            title: format!("resident memory over {STEPS} steps"),
            x: Axis::new("step", ""),
            y: Axis::new("memory", "MB"),
            curves: vec![Curve { name: "resident".into(), points, marks: false }],
        };
        line_plot(&stem, &plot).expect("a plot");
    }
    // Rows of the series are kept for the plots: some hundred bytes a step.
    assert!(late < early + 20.0, "{early} MB, then {late} MB");
}
