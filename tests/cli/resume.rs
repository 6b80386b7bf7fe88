//! Tests of runs that are stopped early and resumed.

use super::*;
use std::collections::BTreeMap;

/// A coarse run of the silo, which takes a fraction of a second.
const SILO: [&str; 5] = ["run", "silo", "--set", "accuracy.cells=3", "--set"];
const FRAMES: &str = "recording.frames=400";

fn silo<'a>(out: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    [&SILO[..], &[FRAMES, "--out", out], rest].concat()
}

/// File names of the checkpoints of a run, sorted.
fn checkpoints(here: &TempFolder, run: &str) -> Vec<String> {
    let folder = here.path(run).join("checkpoints");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Steps at which each entity of a recording has data, sorted.
fn rows(path: &Path) -> BTreeMap<String, Vec<i64>> {
    let store = recording::recording(path);
    let step = rerun::external::re_log_types::TimelineName::from("step");
    let mut all: BTreeMap<String, Vec<i64>> = BTreeMap::new();
    for chunk in store.iter_physical_chunks() {
        let Some(times) = chunk.timelines().get(&step) else { continue };
        let steps = all.entry(chunk.entity_path().to_string()).or_default();
        steps.extend(times.times_raw());
    }
    all.values_mut().for_each(|steps| steps.sort_unstable());
    // Isolines are cleared when they vanish, which depends on earlier pictures.
    all.retain(|path, _| !path.ends_with("isolines") && !path.ends_with("log"));
    all
}

/// Checks that two runs have the same table, except for their times, and the same final state.
#[track_caller]
fn same(here: &TempFolder, a: &str, b: &str) {
    let hash = |run: &str| here.json(&format!("{run}/summary.json"))["state_hash"].clone();
    let table = |run: &str| Table::read(&here.read(&format!("{run}/series.csv")));
    let (first, second) = (table(a), table(b));
    assert_eq!(first.without("wall"), second.without("wall"), "{a} {b}");
    assert_eq!(hash(a), hash(b), "{a} {b}");
}

#[test]
fn every_preset_goes_on_to_the_last_bit() {
    let here = TempFolder::new();
    for (name, _) in preset_files() {
        let coarse = if name.starts_with("silo") { "accuracy.cells=3" } else { "accuracy.cells=4" };
        let run = |out: &str, steps: &str| {
            let run = ["run", &name, "--set", coarse, "--no-recording", "--out", out];
            here.grainscope(&[&run[..], &["--steps", steps]].concat()).exits(0)
        };
        let (whole, parts) = (format!("{name}-whole"), format!("{name}-parts"));
        run(&whole, "8");
        run(&parts, "3").prints(&[&format!("grainscope resume {parts} continues")]);
        // Twice, because a resumed run can be resumed again.
        here.grainscope(&["resume", &parts, "--steps", "5"]).exits(0);
        let said = here.grainscope(&["resume", &parts, "--steps", "8"]).exits(0);
        said.complains(&["continuing after step 5"]);
        same(&here, &whole, &parts);
    }
}

#[test]
fn all_integrators_and_scheduled_changes_resume_bit_for_bit() {
    let here = TempFolder::new();
    let change = "[[schedule]]\nstep = 3\nset = { alpha = 0.1 }\n";
    let (source, _) = preset_files().into_iter().find(|(n, _)| n == "silo").expect("silo");
    let text = preset_files().into_iter().find(|(n, _)| *n == source).expect("silo").1;
    here.write("changed.toml", text + change);
    for integrator in ["midpoint", "euler", "extrapolated"] {
        let integrator_set = format!("accuracy.integrator={integrator}");
        let run = |out: &str, steps: &str| {
            let run = ["run", "changed.toml", "--set", "accuracy.cells=3", "--no-recording"];
            let rest = ["--set", &integrator_set, "--out", out, "--steps", steps];
            here.grainscope(&[&run[..], &rest].concat()).exits(0)
        };
        let (whole, parts) = (format!("{integrator}-whole"), format!("{integrator}-parts"));
        run(&whole, "6");
        for (k, steps) in ["2", "3", "4", "6"].into_iter().enumerate() {
            if k == 0 {
                run(&parts, steps);
            } else {
                here.grainscope(&["resume", &parts, "--steps", steps]).exits(0);
            }
        }
        same(&here, &whole, &parts);
    }
}

#[test]
fn table_and_recording_resume_without_gaps_or_duplicates() {
    let here = TempFolder::new();
    here.grainscope(&silo("whole", &["--until", "8e-5"])).exits(0);
    here.grainscope(&silo("parts", &["--until", "8e-5", "--steps", "5"])).exits(0);
    here.grainscope(&["resume", "parts"]).exits(0).prints(&["finished"]);
    same(&here, "whole", "parts");
    let (whole, parts) =
        (rows(&here.path("whole/recording.rrd")), rows(&here.path("parts/recording.rrd")));
    let curve = "/runs/whole/diagnostics/power_in";
    assert!(whole[curve].len() > 8, "{:?}", whole[curve]);
    for (entity, mut steps) in parts {
        let same = entity.replace("/runs/parts/", "/runs/whole/");
        // The state at the end of the first part was drawn, although no picture was due.
        let due = &whole[&same];
        steps.retain(|step| due.contains(step) || *step != 5);
        steps.dedup_by(|a, b| a == b && *a == 5 && entity.contains("world/"));
        assert_eq!(&steps, due, "{entity}");
    }
    let said = here.grainscope(&["resume", "parts"]).exits(0);
    said.prints(&["the run is finished; there is nothing to continue"]);
}

#[test]
fn two_checkpoints_are_kept_and_a_damaged_one_is_skipped() {
    let here = TempFolder::new();
    let rest = ["--until", "8e-5", "--checkpoint-every", "2"];
    here.grainscope(&silo("whole", &rest)).exits(0);
    here.grainscope(&silo("run", &[&rest[..], &["--steps", "7"]].concat())).exits(0);
    assert_eq!(checkpoints(&here, "run"), ["step-0000000006.state", "step-0000000007.state"]);
    let path = here.path("run/checkpoints/step-0000000007.state");
    let good = std::fs::read(&path).expect("a checkpoint");

    // One bit is changed.
    let mut bytes = good.clone();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&path, &bytes).expect("written");
    let said = here.grainscope(&["resume", "run", "--steps", "8"]).exits(0);
    said.complains(&[
        "step-0000000007.state: is damaged",
        "using the previous checkpoint",
        "continuing after step 6",
    ]);
    // All checkpoints are truncated.
    for name in checkpoints(&here, "run") {
        let path = here.path("run/checkpoints").join(name);
        let bytes = std::fs::read(&path).expect("a checkpoint");
        std::fs::write(&path, &bytes[..bytes.len() - 1]).expect("written");
    }
    let refused = here.grainscope(&["resume", "run"]).exits(1);
    refused.complains(&["there is no checkpoint to continue from", "is damaged", "--force"]);

    // The checkpoint of another scene.
    std::fs::remove_dir_all(here.path("run/checkpoints")).expect("removed");
    std::fs::create_dir(here.path("run/checkpoints")).expect("a folder");
    std::fs::write(&path, &good).expect("written");
    let scene = here.read("run/scene.toml");
    here.write("run/scene.toml", scene.replacen("default = ", "default = 1e-3 + 0", 0) + "\n");
    here.grainscope(&["resume", "run", "--steps", "7"]).exits(0);
    let other = scene.replace("cells = 3", "cells = 4");
    assert_ne!(other, scene);
    here.write("run/scene.toml", &other);
    let refused = here.grainscope(&["resume", "run"]).exits(1);
    refused.complains(&["belongs to another scene than scene.toml"]);
    here.write("run/scene.toml", &scene);
    here.grainscope(&["resume", "run"]).exits(0);
    same(&here, "whole", "run");

    // --force deletes the existing files.
    here.grainscope(&silo("run", &["--force", "--steps", "1"])).exits(0);
    assert_eq!(checkpoints(&here, "run"), ["step-0000000001.state"]);
}

#[test]
fn resume_errors_give_the_reason() {
    let here = TempFolder::new();
    here.grainscope(&["resume", "nowhere"]).exits(1).complains(&["no such folder"]);
    std::fs::create_dir(here.path("empty")).expect("a folder");
    here.grainscope(&["resume", "empty"]).exits(3).complains(&["empty/scene.toml"]);
}

#[test]
fn a_failed_run_leaves_its_last_good_state() {
    let here = TempFolder::new();
    let (_, text) = preset_files().into_iter().find(|(n, _)| n == "silo").expect("silo");
    let fatal = "\n[[schedule]]\nstep = 4\nset = { \"gravity[1]\" = -1e300 }\n";
    here.write("fatal.toml", text + fatal);
    let run = ["run", "fatal.toml", "--set", "accuracy.cells=3", "--out"];
    for policy in ["stop", "cut-dt", "continue"] {
        let said = here.grainscope(&[&run[..], &[policy, "--on-fault", policy]].concat()).exits(5);
        let said = said.complains(&[
            "step 4, t = ",
            "the load is",
            "not finite",
            "at a node of cell",
            "likely",
        ]);
        if policy != "stop" {
            said.complains(&["repeated 4 times"]);
        }
        let table = Table::read(&here.read(&format!("{policy}/series.csv")));
        assert_eq!(table.text("step").last(), Some(&"3"));
        assert!(!here.read(&format!("{policy}/series.csv")).contains("NaN"));
        assert_eq!(checkpoints(&here, policy), ["step-0000000003.state"]);
        let summary = here.json(&format!("{policy}/summary.json"));
        assert_eq!((&summary["ending"], &summary["steps"]), (&"failed".into(), &3.into()));
        // It can be resumed, and fails again.
        here.grainscope(&["resume", policy]).exits(5).complains(&["continuing after step 3"]);
    }
}
