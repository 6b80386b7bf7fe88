//! Tests of the files that a run writes, their folder, and how a run ends.

use super::*;
use std::time::{Duration, Instant};

const HEADER: &str = "step,time,dt,dt_limiter,wall,power_in,dissipation,power_error,\
                      divergence_error,volume_error,iterations,particles";

/// Simple shear with a scheduled change of the viscosity.
const SHEAR: &str = r#"
schema = 1
name = "shear"

[parameters.eta]
default = 2

[parameters.length]
default = 0.2

[domain]
x = [0, 1]
y = [0, 1]

[accuracy]
cells = 3
particles_per_cell = 4

[time]
end = 1
max_step = 0.25

[materials.fluid]
shear_viscosity = "eta"
coupling_viscosity = 1
internal_length = "length"

[[regions]]
material = "fluid"

[boundaries]
left.kind = "periodic"
right.kind = "periodic"
bottom.kind = "no_slip"
top.traction_x = 1

[recording]
frames = 2

[[schedule]]
time = 0.5
set = { eta = 1 }
"#;

#[test]
fn every_preset_runs_and_leaves_its_files() {
    let here = TempFolder::new();
    for (name, text) in preset_files() {
        let coarse = if name.starts_with("silo") { "accuracy.cells=3" } else { "accuracy.cells=4" };
        let short = "time.courant=0.5";
        let run = ["run", &name, "--set", coarse, "--set", short, "--steps", "2"];
        here.grainscope(&run).exits(0).prints(&["2 steps", &format!("folder: runs/{name}")]);
        let file = |file: &str| format!("runs/{name}/{file}");

        let text_of_series = here.read(&file("series.csv"));
        assert!(text_of_series.starts_with(HEADER), "{name}: {text_of_series}");
        let series = Table::read(&text_of_series);
        assert_eq!(series.text("step"), ["0", "1", "2"], "{name}");
        assert_eq!(series.numbers("time")[0], 0.0);
        assert!(series.numbers("dt")[1..].iter().all(|&dt| dt > 0.0));
        for column in ["divergence_error", "volume_error"] {
            assert!(series.numbers(column).iter().all(|e| (0.0..0.1).contains(e)), "{name}");
        }

        let gauge = text.contains("[[gauges]]");
        for plot in ["diagnostics.svg", "diagnostics.png", "outflow.svg", "outflow.png"] {
            let there = here.has(&file(plot));
            assert_eq!(there, gauge || plot.starts_with("diagnostics"), "{name}: {plot}");
        }
        assert!(here.read(&file("diagnostics.svg")).contains("<svg"));
        for there in ["scene.toml", "recording.rrd"] {
            assert!(here.has(&file(there)), "{name}: {there}");
        }

        let summary = here.json(&file("summary.json"));
        assert_eq!(summary["schema"], 1);
        assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(summary["scene"], *name);
        assert_eq!(summary["folder"], format!("runs/{name}"));
        assert_eq!((&summary["ending"], &summary["steps"]), (&"step_limit".into(), &2.into()));
        for hash in ["scene_hash", "state_hash"] {
            assert!(summary[hash].as_str().is_some_and(|h| h.len() == 64), "{name}: {hash}");
        }
        for column in ["time", "max_speed", "particles"] {
            let last = series.numbers(column)[2];
            let said = summary[column].as_f64().expect("a number");
            // Two parsers of numbers may differ in the last digit.
            assert!((said - last).abs() <= 1e-14 * last.abs(), "{name}: {column} {said} {last}");
        }
        assert!(summary["unknowns"]["total"].as_u64() > Some(50));
        assert!(summary["warnings"].is_array());
        assert_eq!(summary["gauges"].as_object().is_some_and(|g| !g.is_empty()), gauge);

        let seconds = summary["seconds"].as_object().expect("seconds");
        let total = seconds["total"].as_f64().expect("a number");
        let parts = seconds.iter().filter(|(phase, _)| *phase != "total");
        let sum: f64 = parts.map(|(_, s)| s.as_f64().expect("a number")).sum();
        assert!(seconds.contains_key("other") && (sum - total).abs() < 0.01 * total, "{name}");
    }
}

#[test]
fn a_run_is_repeated_by_its_scene_file() {
    let here = TempFolder::new();
    let run =
        ["run", "silo_pencils", "--steps", "3", "--set", "accuracy.cells=3", "--no-recording"];
    for out in ["a", "b"] {
        here.grainscope(&[&run, &["--out", out, "--set", "alpha=0.5"][..]].concat()).exits(0);
    }
    let again = ["run", "a/scene.toml", "--steps", "3", "--no-recording", "--out", "c"];
    here.grainscope(&again).exits(0);
    let series = ["a", "b", "c"].map(|f| Table::read(&here.read(&format!("{f}/series.csv"))));
    let summary = ["a", "b", "c"].map(|f| here.json(&format!("{f}/summary.json")));
    for k in [1, 2] {
        assert_eq!(series[k].without("wall"), series[0].without("wall"));
        assert_eq!(summary[k]["state_hash"], summary[0]["state_hash"]);
        assert_eq!(summary[k]["scene_hash"], summary[0]["scene_hash"]);
    }
    assert_eq!(here.read("a/scene.toml"), here.read("c/scene.toml"));
    let other =
        [&run[..4], &["--set", "accuracy.cells=3", "--no-recording", "--out", "d"]].concat();
    here.grainscope(&other).exits(0);
    assert_ne!(here.json("d/summary.json")["state_hash"], summary[0]["state_hash"]);
}

#[test]
fn with_json_stdout_contains_only_json() {
    let here = TempFolder::new();
    here.write("shear.toml", SHEAR);
    let run = ["run", "shear.toml", "--json", "--steps", "2", "--no-recording"];
    let said = here.grainscope(&run).exits(0);
    assert_eq!(said.json(), here.json("runs/shear/summary.json"));
    let profile = ["run", "shear.toml", "--profile", "--steps", "2", "--no-recording"];
    here.grainscope(&profile).exits(0).prints(&["assemble", "factor", "other", "total"]);
}

#[test]
fn a_recording_is_written_to_the_requested_file() {
    let here = TempFolder::new();
    here.write("shear.toml", SHEAR);
    let run = |rest: &[&str]| here.grainscope(&[&["run", "shear.toml"], rest].concat()).exits(0);
    run(&["--out", "none", "--no-recording"]);
    assert!(!here.has("none/recording.rrd") && here.has("none/summary.json"));
    assert!(here.json("none/summary.json")["recording"].is_null());
    run(&["--out", "saved", "--save", "elsewhere.rrd"]).prints(&["recording: elsewhere.rrd"]);
    assert!(here.has("elsewhere.rrd") && !here.has("saved/recording.rrd"));
    assert_eq!(here.json("saved/summary.json")["recording"], "elsewhere.rrd");
}

#[test]
fn runs_do_not_overwrite_each_other() {
    let here = TempFolder::new();
    here.write("shear.toml", SHEAR);
    let run = |rest: &[&str]| {
        let base = ["run", "shear.toml", "--steps", "1", "--no-recording"];
        here.grainscope(&[&base, rest].concat())
    };
    run(&[]).exits(0).prints(&["folder: runs/shear\n"]);
    run(&[]).exits(0).prints(&["folder: runs/shear-2\n"]);
    run(&[]).exits(0).prints(&["folder: runs/shear-3\n"]);

    here.write("runs/shear/notes.txt", "mine");
    let before = here.read("runs/shear/summary.json");
    let refused = run(&["--out", "runs/shear"]).exits(1);
    refused.complains(&["runs/shear already holds a run", "--force"]);
    assert_eq!(here.read("runs/shear/summary.json"), before);

    run(&["--out", "runs/shear", "--force", "--set", "eta=3"]).exits(0);
    assert_ne!(here.read("runs/shear/summary.json"), before);
    assert_eq!(here.read("runs/shear/notes.txt"), "mine");

    // An existing folder without a run is used.
    std::fs::create_dir(here.path("mine")).expect("a folder");
    here.write("mine/notes.txt", "mine");
    run(&["--out", "mine"]).exits(0);
}

#[test]
fn a_run_that_cannot_start_leaves_no_files() {
    let here = TempFolder::new();
    here.write("shear.toml", SHEAR);
    for (rest, complaint) in [
        (["--save", "no/such/folder/x.rrd"], "no/such/folder/x.rrd cannot be written"),
        (["--save", "/dev/full"], "No space left"),
        (["--connect", "nonsense"], "nonsense"),
        (["--connect", "rerun+http://127.0.0.1:1/proxy"], "127.0.0.1:1/proxy does not answer"),
    ] {
        let base = ["run", "shear.toml", "--out", "out"];
        here.grainscope(&[&base, &rest[..]].concat()).exits(1).complains(&[complaint]);
        assert!(!here.has("out"), "{rest:?}");
    }
    here.write("file", "");
    let run = ["run", "shear.toml", "--out", "file/sub"];
    here.grainscope(&run).exits(1).complains(&["file/sub", "cannot be written"]);
}

#[test]
fn without_an_internal_length_no_rotation_is_solved() {
    let here = TempFolder::new();
    for (alpha, rotates) in [("alpha=0", false), ("alpha=1/3", true)] {
        let run = ["run", "silo", "--set", "accuracy.cells=2", "--steps", "1", "--no-recording"];
        let rest = ["--json", "--set", alpha];
        let summary = here.grainscope(&[&run[..], &rest].concat()).exits(0).json();
        let active = summary["unknowns"]["active_rotation"].as_u64();
        assert_eq!(active > Some(0), rotates, "{alpha}: {active:?}");
    }
}

#[test]
fn a_schedule_changes_the_flow_at_its_time() {
    let here = TempFolder::new();
    // Without internal length the speed at the top is traction * height / viscosity.
    here.write("shear.toml", SHEAR);
    let run = ["run", "shear.toml", "--set", "length=0", "--no-recording"];
    here.grainscope(&run).exits(0);
    let series = Table::read(&here.read("runs/shear/series.csv"));
    let (times, speeds) = (series.numbers("time"), series.numbers("max_speed"));
    assert!(times.contains(&0.5) && times.last() == Some(&1.0), "{times:?}");
    for (time, speed) in times.iter().zip(speeds) {
        let expected = if *time < 0.5 { 0.5 } else { 1.0 };
        assert!((speed - expected).abs() < 1e-9, "t = {time}: {speed}");
    }
}

#[test]
fn a_schedule_cannot_change_effects_mesh_or_loads() {
    let here = TempFolder::new();
    for (set, complaints) in [
        ("{ length = 0 }", ["schedule[0]", "solved effects", "a new run"]),
        (
            "{ \"accuracy.cells\" = 5 }",
            ["`accuracy.cells` cannot be scheduled", "schedule[0]", "`gravity[0]`"],
        ),
        ("{ eta = -1 }", ["shear_viscosity is -1", "`fluid`", "above zero"]),
    ] {
        here.write("shear.toml", SHEAR.replace("{ eta = 1 }", set));
        here.grainscope(&["run", "shear.toml"]).exits(3).complains(&complaints);
    }
    here.write("shear.toml", SHEAR.replace("y = [0, 1]", "y = [0, \"eta\"]"));
    let moved = here.grainscope(&["check", "shear.toml"]).exits(3);
    moved.complains(&["schedule[0]", "changes the mesh", "a new run"]);
    // A load that depends on the changed parameter is refused.
    here.write("shear.toml", SHEAR.replace("traction_x = 1", "traction_x = \"eta/2\""));
    let loaded = here.grainscope(&["check", "shear.toml"]).exits(3);
    loaded.complains(&["schedule[0]", "loads", "a new run"]);
}

#[test]
fn until_sets_the_end_time() {
    let here = TempFolder::new();
    here.write("shear.toml", SHEAR);
    let run = ["run", "shear.toml", "--until", "1/4", "--no-recording", "--json"];
    let summary = here.grainscope(&run).exits(0).json();
    assert_eq!(summary["time"], 0.25);
    assert_eq!(summary["ending"], "finished");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_complete_files() {
    let here = TempFolder::new();
    let run = ["run", "silo", "--set", "accuracy.cells=8", "--out", "out"];
    let child = here.start(&run);
    let rows =
        || std::fs::read_to_string(here.path("out/series.csv")).map_or(0, |t| t.lines().count());
    let patience = Instant::now();
    while rows() < 4 {
        assert!(patience.elapsed() < Duration::from_secs(60), "no steps are taken");
        std::thread::sleep(Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
    let said = Said::new(&run, child.wait_with_output().expect("an end")).exits(130);
    said.prints(&["silo interrupted", "folder: out"]);

    let series = Table::read(&here.read("out/series.csv"));
    let summary = here.json("out/summary.json");
    assert_eq!(summary["ending"], "interrupted");
    let steps = summary["steps"].as_u64().expect("a number") as usize;
    assert_eq!(series.rows.len(), steps + 1);
    assert!(here.has("out/diagnostics.svg"));
    let store = recording::recording(&here.path("out/recording.rrd"));
    assert_eq!(recording::steps(&store).last(), Some(&(steps as i64)));
}
