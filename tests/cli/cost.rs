//! Tests of `grainscope cost`, and of runs that use its tables.

use super::*;

/// A scene that takes a fraction of a second: two fluids overturn in a small box.
const TINY: &str = "schema = 1\nname = \"tiny\"\ngravity = [0, -1]\n\
    [domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\ncells = 4\nparticles_per_cell = 9\n\
    [time]\nend = 4\nmax_step = 1\n\
    [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
    [materials.light]\nshear_viscosity = 1\n\
    [[regions]]\nmaterial = \"heavy\"\n[[regions]]\nmaterial = \"light\"\n\
    shape.where = \"y < 0.4 + 0.1 * cos(pi * x)\"\n\
    [interest]\nquantity = \"rms_speed\"\n[recording]\nframes = 2\n";

/// Runs the program with a separate cache folder.
fn grainscope(here: &TempFolder, arguments: &[&str]) -> Said {
    let mut command = here.command(arguments);
    command.env("XDG_CACHE_HOME", here.path("cache"));
    Said::new(arguments, command.output().expect("the program starts"))
}

#[test]
fn a_cost_table_is_made_stored_and_used() {
    let here = TempFolder::new();
    here.write("tiny.toml", TINY);
    let said = grainscope(&here, &["cost", "tiny.toml", "--quick", "--out", "list"]).exits(0);
    said.prints(&["tiny: rms speed at the end, quick", "costs", "limited by", "own reference"])
        .prints(&["cells (`accuracy.cells`)", "noise of", "next halving", "whole runs"]);
    for file in ["cost.csv", "cost.json", "cost.md", "cost.svg", "cost.png", "race.rrd"] {
        assert!(here.has(&format!("list/{file}")), "{file}");
    }
    let table = here.read("list/cost.csv");
    let rows = table.lines().count();
    // On a busy machine some candidates are left out, and the table says so.
    let skipped = here.json("list/cost.json")["skipped"].as_array().map_or(0, Vec::len);
    assert!(rows + skipped > 8 && table.starts_with("front,settings,error"), "{table}");
    let list = here.json("list/cost.json");
    let entries = list["entries"].as_array().expect("entries");
    assert_eq!(entries.len(), rows - 1);
    let front: Vec<&Value> = (list["front"].as_array().expect("a front").iter())
        .map(|i| &entries[i.as_u64().expect("an index") as usize])
        .collect();
    let promised: Vec<f64> = front.iter().filter_map(|e| e["promised"].as_f64()).collect();
    assert!(promised.windows(2).all(|w| w[1] < w[0]), "{promised:?}");

    // The table is stored: a second call prints exactly the same.
    let again = ["cost", "tiny.toml", "--quick", "--json", "--no-recording", "--out", "again"];
    let again = grainscope(&here, &again).exits(0).complains(&["kept from before"]);
    assert_eq!(again.json(), list);
    assert!(!here.has("again/race.rrd"));

    // The fastest settings of the required accuracy.
    let loose = format!("{}", promised[0] * 1.01);
    let run = ["run", "tiny.toml", "--accuracy", &loose, "--no-recording", "--out", "bought"];
    grainscope(&here, &run)
        .exits(0)
        .complains(&["chosen settings:", "expects rms speed at the end within"])
        .prints(&["expected", "took"]);
    let summary = here.json("bought/summary.json");
    assert_eq!(summary["purchase"]["sets"], front[0]["sets"]);
    let scene = here.read("bought/scene.toml");
    for set in front[0]["sets"].as_array().expect("sets") {
        let set = set.as_str().expect("text");
        if let Some(cells) = set.strip_prefix("accuracy.cells=") {
            assert!(scene.contains(&format!("cells = {cells}\n")), "{scene}");
        }
    }

    // The most accurate settings within the time.
    let run = ["run", "tiny.toml", "--budget", "1h", "--no-recording", "--out", "rich"];
    grainscope(&here, &run).exits(0);
    let best = front.last().expect("a front");
    assert_eq!(here.json("rich/summary.json")["purchase"]["sets"], best["sets"]);

    // Accuracies and times that cannot be reached.
    grainscope(&here, &["run", "tiny.toml", "--accuracy", "1e-9"])
        .exits(2)
        .complains(&["out of reach", "the best is"]);
    grainscope(&here, &["run", "tiny.toml", "--budget", "0.001ms"])
        .exits(2)
        .complains(&["too little", "the fastest takes"]);
    assert!(!here.has("runs"));
}

#[test]
fn exact_solutions_are_used_if_they_exist() {
    let here = TempFolder::new();
    let sets = ["--set", "accuracy.cells=8", "--no-recording", "--out", "list", "--write", "docs"];
    let said = grainscope(&here, &[&["cost", "solcx", "--quick"], &sets[..]].concat()).exits(0);
    said.prints(&["against the exact solution", "the first solution"]);
    assert_eq!(here.json("list/cost.json")["reference"]["kind"], "exact");
    let page = here.read("docs/cost.md");
    assert!(page.contains("<!-- scene: solcx -->"), "{page}");
    for (name, _) in preset_files() {
        assert!(page.contains(&format!("| {name} | ")), "{name}");
    }
}

#[test]
fn the_page_lists_every_preset_and_every_knob() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cost.md");
    let page = std::fs::read_to_string(path).expect("docs/cost.md");
    for (name, _) in preset_files() {
        assert!(page.contains(&format!("| {name} | ")), "{name} is missing in docs/cost.md");
    }
    for (name, keys, _) in grainscope::internals::KNOBS {
        assert!(page.contains(&format!("| {name} | `{keys}` |")), "{name} is missing");
    }
}

#[test]
fn contradicting_options_are_refused() {
    let here = TempFolder::new();
    for (arguments, complaint) in [
        (&["--accuracy", "1%", "--budget", "3s"] as &[_], "cannot be used with"),
        (&["--accuracy", "1%", "--until", "1"], "cannot be used with"),
        (&["--accuracy", "great"], "such as 1%"),
        (&["--budget", "soon"], "such as 30s"),
    ] {
        here.grainscope(&[&["run", "silo"], arguments].concat()).exits(2).complains(&[complaint]);
    }
}

#[test]
fn an_interest_in_a_missing_quantity_is_refused() {
    let here = TempFolder::new();
    here.grainscope(&["check", "hydrostatic", "--set", "interest.quantity=alignment"])
        .exits(3)
        .complains(&["nothing has directors"]);
    let set = "interest.quantity={ gauge = \"outflo\" }";
    here.grainscope(&["check", "silo", "--set", set])
        .exits(3)
        .complains(&["did you mean `outflow`?"]);
    here.grainscope(&[
        "check",
        "silo",
        "--set",
        "interest.quantity=velocity",
        "--set",
        "interest.at=peak",
    ])
    .exits(3)
    .complains(&["a field has no peak"]);
}
