//! Tests of comparisons: printed results, written files, and tolerances for CI.

use super::*;
use rerun::external::re_chunk_store::ChunkStore;
use std::collections::BTreeSet;

/// A short and coarse run of the silo.
const SHORT: [&str; 8] = [
    "run",
    "silo",
    "--set",
    "accuracy.cells=2",
    "--set",
    "time.end=1e-4",
    "--set",
    "recording.times=[5e-5]",
];

fn short_run(here: &TempFolder, out: &str, more: &[&str]) {
    let arguments = [&SHORT, more, &["--set", "recording.frames=4", "--out", out]].concat();
    here.grainscope(&arguments).exits(0);
}

/// Two runs: `a`, and `b` with additional arguments.
fn two(more: &[&str]) -> TempFolder {
    let here = TempFolder::new();
    short_run(&here, "a", &[]);
    short_run(&here, "b", more);
    here
}

fn compare(here: &TempFolder, arguments: &[&str]) -> Said {
    here.grainscope(&[&["compare"], arguments].concat())
}

fn entities(store: &ChunkStore) -> Vec<String> {
    store.all_entities_sorted().iter().map(ToString::to_string).collect()
}

#[test]
fn the_same_scene_run_twice_is_identical() {
    let here = two(&[]);
    let found = compare(&here, &["a", "b", "--json", "--tolerance", "outflow_volume=0%"]).exits(0);
    let found = found.json();
    assert_eq!(found["runs"][1]["identical"], true);
    assert_eq!(found["runs"][0]["state_hash"], found["runs"][1]["state_hash"]);
    assert!(found["curves"].as_array().is_some_and(|c| !c.is_empty()));
    assert!(found["curves"].as_array().expect("curves").iter().all(|c| c["largest"] == 0.0));
    assert!(found["fields"].as_array().is_some_and(|f| f.len() == 3));
    assert!(found["fields"].as_array().expect("fields").iter().all(|f| f["largest"] == 0.0));
    assert_eq!(found["scenes"], serde_json::json!([]));
    compare(&here, &["a", "b", "--no-output"]).exits(0).prints(&[
        "b is identical to a",
        "outflow_volume",
        "(=)",
    ]);
    assert!(here.has("comparisons/a-vs-b/compare.rrd"));
}

#[test]
fn tolerances_are_checked_and_differences_are_named() {
    let here = two(&["--set", "alpha=5/3"]);
    let near = ["a", "b", "--no-output", "--tolerance", "outflow_volume=50%"];
    compare(&here, &near).exits(0).prints(&["within", "parameters.alpha.value", "1/3", "5/3"]);
    let far = [&near[..], &["--tolerance", "max_speed=1e-6", "--tolerance", "end=0"]].concat();
    let said = compare(&here, &far).exits(6).complains(&["max_speed of b", "of a", "1e-6"]);
    said.prints(&["OUTSIDE", "end of b"]);
    let json = compare(&here, &[&far[..], &["--json"]].concat()).exits(6).json();
    let within: Vec<_> = json["tolerances"].as_array().expect("a list").iter().collect();
    assert_eq!(within.len(), 3);
    assert_eq!(within.iter().map(|t| t["within"] == true).collect::<Vec<_>>(), [true, false, true]);
    assert_eq!(json["scenes"][0]["key"], "parameters.alpha.value");
    assert_eq!(json["schema"], 1);
}

#[test]
fn the_recording_holds_all_runs_under_their_names() {
    let here = two(&["--set", "alpha=0"]);
    compare(&here, &["a", "b", "-o", "out/both.rrd"]).exits(0).prints(&["wrote out/both.rrd"]);
    let store = recording::recording(&here.path("out/both.rrd"));
    let entities = entities(&store);
    for entity in [
        "/runs/a/world/particles",
        "/runs/b/world/particles",
        "/runs/a/gauges/outflow/volume",
        "/runs/b/gauges/outflow/volume",
        "/runs/a/scene",
        "/comparison/Values",
        "/comparison/Scenes",
    ] {
        assert!(entities.iter().any(|e| e == entity), "{entity} is missing in {entities:#?}");
    }
    // With alpha = 0 there is no rotation; fields that both runs have are subtracted.
    let differences: BTreeSet<&str> = entities
        .iter()
        .filter(|e| e.starts_with("/differences/") && e.ends_with("/image"))
        .filter_map(|e| e.rsplit('/').nth(1))
        .collect();
    assert_eq!(differences, BTreeSet::from(["pressure", "speed"]));
    // The time cursor moves all runs, by simulation time and by wall-clock time.
    let first = recording::steps(&recording::recording(&here.path("a/recording.rrd")));
    assert!(first.iter().all(|step| recording::steps(&store).contains(step)));
    let wall = rerun::external::re_log_types::TimelineName::from("wall_time");
    assert!(store.time_range(&wall).is_some());
    for plot in ["outflow", "flow", "diagnostics"] {
        for suffix in ["svg", "png"] {
            assert!(here.has(&format!("out/both_{plot}.{suffix}")), "{plot}.{suffix}");
        }
    }
    assert!(here.read("out/both_outflow.svg").contains("outflow volume"));
}

#[test]
fn runs_of_other_resolution_and_end_time_can_be_compared() {
    let here = two(&["--set", "accuracy.cells=3", "--set", "time.end=8e-5"]);
    let said = compare(&here, &["a", "b", "--json", "--no-output"]).exits(0);
    let json = said.json();
    assert_eq!(json["time"], 8e-5);
    let said = said.complains(&["end at different times", "8e-5"]);
    let row = |key: &str| {
        let values = json["values"].as_array().expect("values");
        values.iter().find(|v| v["key"] == key).unwrap_or_else(|| panic!("{key} in {}", said.out))
    };
    let change = row("outflow_volume")["relative"][1].as_f64().expect("a change");
    assert!(change != 0.0 && change.abs() < 0.1, "{change}");
    assert_eq!(row("end")["values"], serde_json::json!([1e-4, 8e-5]));
    assert!(json["fields"].as_array().is_some_and(|f| f.len() == 3));
    assert!(json["scenes"].to_string().contains("accuracy.cells"));
}

#[test]
fn a_recording_without_its_folder_can_be_compared() {
    let here = two(&["--set", "alpha=5/3"]);
    std::fs::copy(here.path("b/recording.rrd"), here.path("lone.rrd")).expect("a copy");
    let lone = compare(&here, &["a", "lone.rrd", "--json", "--no-output"]).exits(0).json();
    let folder = compare(&here, &["a", "b", "--json", "--no-output"]).exits(0).json();
    assert_eq!(lone["runs"][1]["kind"], "recording");
    for key in ["outflow_volume", "max_speed", "dissipation", "grains.volume_drift"] {
        let of = |json: &Value| {
            let values = json["values"].as_array().expect("values").clone();
            values.into_iter().find(|v| v["key"] == key).map(|v| v["values"].clone())
        };
        assert!(of(&lone).is_some(), "{key}");
        assert_eq!(of(&lone), of(&folder), "{key}");
    }
    assert_eq!(lone["scenes"], folder["scenes"]);
    assert_eq!(lone["fields"][0]["largest"], folder["fields"][0]["largest"]);
}

#[test]
fn a_stored_summary_can_be_used_in_ci() {
    let here = two(&[]);
    std::fs::copy(here.path("a/summary.json"), here.path("golden.json")).expect("a copy");
    let check = ["golden.json", "b", "--tolerance", "outflow_volume=1%"];
    compare(&here, &check).exits(0).prints(&["b is identical to golden", "within"]);
    assert!(!here.has("comparisons"), "a single run needs no comparison folder");
    short_run(&here, "c", &["--set", "alpha=5/3"]);
    let check = ["golden.json", "c", "--tolerance", "outflow_volume=1%"];
    compare(&here, &check).exits(6).complains(&["outflow_volume of c", "of golden", "1 %"]);
    // A run that stops too early cannot be compared and is outside the tolerance.
    short_run(&here, "d", &["--steps", "1"]);
    let check = ["golden.json", "d", "--tolerance", "outflow_volume=1%"];
    compare(&here, &check).exits(6).complains(&["cannot be compared", "did not finish"]);
}

#[test]
fn runs_that_cannot_be_compared_are_refused() {
    let here = TempFolder::new();
    short_run(&here, "a", &[]);
    here.write("empty.rrd", "");
    here.write("text.rrd", "no recording at all, but a text of some length");
    here.write("list.json", "[1, 2]");
    here.write("notes.txt", "notes");
    std::fs::create_dir(here.path("folder")).expect("a folder");
    let whole = std::fs::read(here.path("a/recording.rrd")).expect("the recording");
    here.write("head.rrd", &whole[..40]);
    for (runs, code, parts) in [
        (vec!["a"], 2, vec!["one run alone"]),
        (vec!["a", "./a/summary.json"], 2, vec!["the same run"]),
        (vec!["a", "nowhere"], 1, vec!["nowhere", "no such file or folder"]),
        (vec!["a", "folder"], 1, vec!["folder: holds no run", "series.csv"]),
        (vec!["a", "empty.rrd"], 1, vec!["empty.rrd", "not a readable recording"]),
        (vec!["a", "text.rrd"], 1, vec!["text.rrd", "not a readable recording"]),
        (vec!["a", "head.rrd"], 1, vec!["head.rrd", "not a readable recording"]),
        (vec!["a", "list.json"], 1, vec!["list.json", "not the summary"]),
        (vec!["a", "notes.txt"], 1, vec!["notes.txt", ".rrd"]),
    ] {
        compare(&here, &runs).exits(code).complains(&parts);
    }
    short_run(&here, "b", &[]);
    let unknown = ["a", "b", "--tolerance", "outflow_volum=1%"];
    compare(&here, &unknown).exits(2).complains(&["did you mean outflow_volume?", "max_speed"]);
    let wrong = ["a", "b", "--tolerance", "outflow_volume=little"];
    compare(&here, &wrong).exits(2).complains(&["not a number", "KEY=1%"]);
    compare(&here, &["a", "b", "-o", "both.rrd"]).exits(0);
    compare(&here, &["a", "both.rrd"]).exits(1).complains(&["2 runs side by side"]);
}

#[test]
fn a_truncated_recording_is_compared_up_to_its_end() {
    let here = two(&[]);
    let whole = std::fs::read(here.path("b/recording.rrd")).expect("the recording");
    here.write("cut.rrd", &whole[..whole.len() * 3 / 4]);
    compare(&here, &["a", "cut.rrd", "-o", "both.rrd"]).exits(0).complains(&["is cut"]);
    // In a run folder the numbers are read from the table.
    here.write("b/recording.rrd", &whole[..whole.len() / 2]);
    compare(&here, &["a", "b", "--tolerance", "outflow_volume=0%"]).exits(0);
}

#[test]
fn figures_of_grains_are_made_by_one_command() {
    let here = TempFolder::new();
    let made = |name: &str, files: &[&str]| {
        let said = here.grainscope(&["figure", name, "--quick", "--out", name]).exits(0);
        for file in files {
            assert!(here.has(&format!("{name}/{file}")), "{file}");
        }
        said.out
    };
    // The number behind the last occurrence of a text.
    let number = |text: &str, before: &str| -> f64 {
        let rest = &text[text.rfind(before).unwrap_or_else(|| panic!("{before}: {text}"))..];
        let rest = rest[before.len()..].trim_start();
        let end = rest.find(|c: char| !"+-.e".contains(c) && !c.is_ascii_digit());
        rest[..end.unwrap_or(rest.len())].parse().unwrap_or_else(|e| panic!("{e}: {text}"))
    };
    // Grains leave at a constant rate, a fluid does not.
    let said = made("hourglass", &["hourglass_discharge.svg", "clepsydra/summary.json"]);
    let [grains, water] = ["grains: ", "water: "].map(|name| {
        let line = said.lines().find(|line| line.starts_with(name));
        number(line.unwrap_or_else(|| panic!("{said}")), "ratio ")
    });
    assert!((grains - 1.0).abs() < 0.06 && water < 0.92, "{said}");
    let said = made("beverloo", &["beverloo_rates.png", "aperture_0.9/summary.json"]);
    assert!((number(&said, "plain exponent ") - 1.5).abs() < 0.1, "{said}");
    assert!(number(&said, "W0 is ").abs() < 2.0, "{said}");
    // The width of a band depends on the mesh unless the grains have an internal length.
    let said = made("bands", &["bands_width.svg", "bands_width.png", "bands.toml"]);
    let change =
        |r: &str| number(&said, &format!("R = {r} m: from 16 to 32 cells the width changes by "));
    assert!(change("0.0625").abs() < 3.0 && change("0") < -20.0, "{said}");
    here.write("bands/bands.toml", "schema = 1");
    here.grainscope(&["figure", "bands", "--quick", "--out", "bands"])
        .exits(1)
        .complains(&["--force"]);
}

#[test]
fn figures_are_made_by_one_command() {
    let here = TempFolder::new();
    here.grainscope(&["figure", "alignment", "--quick", "--out", "fig"]).exits(0);
    for file in ["alignment_isovalues.svg", "alignment_isovalues.png", "run/recording.rrd"] {
        assert!(here.has(&format!("fig/{file}")), "{file}");
    }
    assert!(here.read("fig/alignment_isovalues.svg").contains("t = 0.15 s"));
    // Existing runs are not overwritten.
    here.grainscope(&["figure", "alignment", "--quick", "--out", "fig"])
        .exits(1)
        .complains(&["--force"]);
    let said = here.grainscope(&["figure", "silo", "--quick", "--out", "silo"]).exits(0);
    said.prints(&["R/a = 10/3", "outflow_volume"]);
    for file in ["silo.rrd", "silo_snapshots.svg", "silo_outflow.png", "alpha_5_3/summary.json"] {
        assert!(here.has(&format!("silo/{file}")), "{file}");
    }
    let volume = |alpha: &str| {
        here.json(&format!("silo/alpha_{alpha}/summary.json"))["gauges"]["outflow"]["volume"]
            .as_f64()
            .expect("a volume")
    };
    // The discharge is slower for a larger internal length.
    let [zero, third, two_thirds, five_thirds] = ["0", "1_3", "2_3", "5_3"].map(volume);
    assert!(zero > third && third > two_thirds && two_thirds > five_thirds);
    let entities = entities(&recording::recording(&here.path("silo/silo.rrd")));
    let runs: BTreeSet<&str> = entities
        .iter()
        .filter_map(|e| e.strip_prefix("/runs/"))
        .filter_map(|e| e.split("/world").next())
        .filter(|name| !name.contains("/diag"))
        .collect();
    assert!(runs.len() >= 5, "{runs:?}");
}

/// Blocks of shell commands in a page.
fn recipes(page: &str) -> Vec<String> {
    let blocks = page.split("```sh\n").skip(1);
    blocks.filter_map(|rest| Some(rest.split_once("```")?.0.to_owned())).collect()
}

#[cfg(unix)]
#[test]
fn the_recipe_for_ci_works_as_it_is_written() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/ci.md");
    let page = std::fs::read_to_string(page).expect("docs/ci.md");
    let recipes = recipes(&page);
    assert_eq!(recipes.len(), 2);
    let here = TempFolder::new();
    let program = Path::new(env!("CARGO_BIN_EXE_grainscope")).parent().expect("a folder");
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let shell = |script: &str| {
        let mut shell = Command::new("sh");
        shell.args(["-e", "-c", script]).current_dir(here.path("")).env("PATH", &path);
        let output = shell.output().expect("a shell");
        Said::new(&[script], output)
    };
    shell(&recipes[0]).exits(0);
    shell(&recipes[1]).exits(0);
    assert!(here.has("silo.rrd"));
    assert_eq!(here.json("comparison.json")["runs"][1]["identical"], true);
    // A changed scene is detected.
    let changed = recipes[1].replace("run silo", "run silo --force --set alpha=5/3");
    shell(&changed).exits(6).complains(&["outflow_volume of ci", "of silo", "1 %"]);
    assert_eq!(here.json("comparison.json")["tolerances"][0]["within"], false);
}
