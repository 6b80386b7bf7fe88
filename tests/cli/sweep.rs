//! Tests of sweeps: lists of cases, cases that are run again, tables, HyperQueue; and of exports.

use super::*;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// A sweep whose runs take a fraction of a second.
const SMALL: [&str; 8] = [
    "sweep",
    "silo",
    "--set",
    "accuracy.cells=2",
    "--set",
    "time.end=1e-4",
    "--set",
    "recording.times=[]",
];

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    SMALL.iter().copied().chain(more.iter().copied()).collect()
}

/// Hash of the final state of each case, by case id.
fn hashes(here: &TempFolder, sweep: &str) -> std::collections::BTreeMap<String, String> {
    let list = here.json(&format!("{sweep}/cases.json"));
    let cases = list["cases"].as_array().expect("cases");
    let one = |case: &Value| {
        let id = case["id"].as_str().expect("an id").to_owned();
        let summary = here.json(&format!("{sweep}/cases/{id}/summary.json"));
        (id, summary["state_hash"].as_str().expect("a hash").to_owned())
    };
    cases.iter().map(one).collect()
}

/// Ids of all cases, in order.
fn ids(here: &TempFolder, sweep: &str) -> Vec<String> {
    let list = here.json(&format!("{sweep}/cases.json"));
    let cases = list["cases"].as_array().expect("cases");
    cases.iter().map(|c| c["id"].as_str().expect("an id").to_owned()).collect()
}

#[test]
fn a_sweep_leaves_runs_tables_and_plots_and_runs_again_only_what_is_missing() {
    let here = TempFolder::new();
    let arguments = small(&["--vary", "alpha=0,5/3", "--repeat-seeds", "2", "--out", "s"]);
    let said = here.grainscope(&arguments).exits(0).prints(&["done: 4 of 4 cases"]);
    assert!(said.err.contains("4 cases, 0 done before"), "{}", said.err);
    let table = Table::read(&here.read("s/table.csv"));
    assert_eq!(table.text("state"), ["done"; 4]);
    assert_eq!(table.numbers("seed"), [1.0, 2.0, 1.0, 2.0]);
    assert_eq!(table.numbers("alpha"), [0.0, 0.0, 5.0 / 3.0, 5.0 / 3.0]);
    let volumes = table.numbers("outflow_volume");
    assert!(volumes[0] != volumes[1], "seeds change nothing");
    assert!(volumes[0] > volumes[2], "{volumes:?}");
    assert!(table.numbers("peak_memory").iter().all(|m| *m > 1e6));
    let spread = Table::read(&here.read("s/spread.csv"));
    assert_eq!(spread.numbers("runs"), [2.0, 2.0]);
    let mean = spread.numbers("outflow_volume")[0];
    assert!((mean - 0.5 * (volumes[0] + volumes[1])).abs() < 1e-12);
    let half = 0.5 * (volumes[0] - volumes[1]).abs();
    let deviation = spread.numbers("outflow_volume.deviation")[0];
    assert!((deviation - half * 2f64.sqrt()).abs() < 1e-12, "{deviation} {half}");
    assert!(here.has("s/outflow_volume-against-alpha.png"));
    for id in ids(&here, "s") {
        let folder = format!("s/cases/{id}");
        for file in ["recording.rrd", "series.csv", "scene.toml", "outflow.svg", "case.json"] {
            assert!(here.has(&format!("{folder}/{file}")), "{folder}/{file}");
        }
        let summary = here.json(&format!("{folder}/summary.json"));
        assert_eq!(summary["folder"], folder.as_str());
        assert!(summary["scene_hash"].as_str().is_some_and(|h| h.starts_with(&id)));
    }
    assert_eq!(std::fs::read_dir(here.path("s/running")).expect("there").count(), 0);

    // A deleted case is run again, with the same bits; the others are not.
    let before = hashes(&here, "s");
    let lost = ids(&here, "s").remove(2);
    let kept = ids(&here, "s").remove(0);
    let written = |id: &str| {
        let file = here.path(&format!("s/cases/{id}/series.csv"));
        file.metadata().and_then(|m| m.modified()).expect("a file")
    };
    let when = written(&kept);
    std::fs::remove_dir_all(here.path(&format!("s/cases/{lost}"))).expect("removed");
    let said = here.grainscope(&arguments).exits(0);
    assert!(said.err.contains("4 cases, 3 done before") && said.err.contains(&lost));
    assert!(!said.err.contains(&kept), "{}", said.err);
    assert_eq!(when, written(&kept));
    assert_eq!(before, hashes(&here, "s"));

    // A longer list keeps existing cases; side-by-side recordings are made on request.
    let wider = small(&["--vary", "alpha=5/3,0,1", "--repeat-seeds", "2", "--out", "s"]);
    let said = here.grainscope(&wider).exits(0);
    assert!(said.err.contains("6 cases, 4 done before"), "{}", said.err);
    here.grainscope(&["sweep", "collect", "s", "--side-by-side", "1", "3"])
        .exits(0)
        .prints(&["side_by_side.rrd"]);
    assert!(here.has("s/side_by_side_outflow.png"));
}

#[test]
fn failed_cases_do_not_stop_a_sweep_and_are_run_again() {
    let here = TempFolder::new();
    // Without a background nothing fills the space outside the grains; a run fails at its start.
    let arguments = small(&[
        "--vary",
        "materials.background.background=false,true",
        "--out",
        "s",
        "--no-recordings",
    ]);
    let said = here.grainscope(&arguments).exits(6);
    let said =
        said.complains(&["not done: 1 of 2 cases", "background.background = false:", "s/failed"]);
    assert!(said.out.contains("done: 1 of 2 cases"), "{}", said.out);
    let table = Table::read(&here.read("s/table.csv").replace(", ", " "));
    assert_eq!(table.text("state"), ["failed", "done"]);
    assert!(!table.text("cause")[0].is_empty());
    let failed = ids(&here, "s").remove(0);
    assert!(here.json(&format!("s/failed/{failed}/case.json"))["cause"].is_string());
    let again = here.grainscope(&arguments).exits(6);
    assert!(again.err.contains("2 cases, 1 done before"), "{}", again.err);
}

#[test]
fn invalid_values_are_refused_with_the_right_syntax() {
    let here = TempFolder::new();
    for (more, code, parts) in [
        (&["--vary", "alhpa=0,1"][..], 3, &["--vary alhpa=0", "did you mean `alpha`?"][..]),
        (&["--vary", "alpha=0..1"], 2, &["has no number of values", "--sample sobol:64"]),
        (&["--vary", "alpha=0..1:x"], 2, &["invalid count", "0..1:5"]),
        (&["--vary", "alpha=0,200"], 3, &["case alpha=200", "outside its range: 0 to 100"]),
        (&["--vary", "alpha"], 2, &["there is no `=`", "name=a,b,c"]),
        (&["--vary", "alpha=0..1", "--sample", "grid:3"], 2, &["sobol:N"]),
        (&["--quick"], 2, &["--quick: the scene silo has no quick settings"]),
    ] {
        here.grainscope(&small(more)).exits(code).complains(parts);
    }
    assert!(!here.has("sweeps"), "a refused sweep leaves nothing");
    here.grainscope(&["sweep", "fig33"]).exits(2).complains(&["did you mean the sweep `fig3`?"]);
    here.grainscope(&["sweep", "collect", "."]).exits(2).complains(&["holds no sweep"]);
    here.grainscope(&["sweep", "presets"]).exits(0).prints(&["fig3", "discharge", "texture"]);
    here.grainscope(&["sweep", "presets", "fig3"]).exits(0).prints(&["alpha=0,1/3,2/3,5/3,10/3"]);
}

#[test]
fn a_dry_run_lists_cases_and_single_cases_can_be_run() {
    let here = TempFolder::new();
    let sampled = small(&[
        "--vary",
        "alpha=0..2",
        "--vary",
        "contrast=log:10..1000",
        "--sample",
        "sobol:3",
        "--out",
        "s",
        "--dry-run",
    ]);
    here.grainscope(&sampled).exits(0).prints(&["3 cases would run", "unknowns"]);
    let missing = here.grainscope(&["sweep", "list", "s", "--missing"]).exits(0);
    let listed: Vec<&str> = missing.out.lines().collect();
    assert_eq!(listed, ids(&here, "s"));
    here.grainscope(&["sweep", "case", "s", "2"]).exits(0);
    assert!(here.has(&format!("s/cases/{}/summary.json", listed[1])));
    here.grainscope(&["sweep", "list", "s"]).exits(0).prints(&["done", "missing"]);
    here.grainscope(&["sweep", "case", "s", "4"]).exits(2).complains(&["from 1 to 3"]);
    // A finished case is not run again.
    let file = here.path(&format!("s/cases/{}/series.csv", listed[1]));
    let when = || file.metadata().and_then(|m| m.modified()).expect("a file");
    let before = when();
    here.grainscope(&["sweep", "case", "s", listed[1]]).exits(0);
    assert_eq!(before, when());
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_finished_cases_and_leaves_no_process() {
    let here = TempFolder::new();
    let arguments =
        ["sweep", "silo", "--vary", "accuracy.cells=2,16", "--out", "s", "--no-recordings"];
    let all = [&arguments[..], &["--set", "time.end=1e-3", "--set", "recording.times=[]"]].concat();
    let mut child = here.command(&all).stderr(Stdio::null()).spawn().expect("starts");
    let first = || ids(&here, "s").remove(0);
    until("the first case is done", || {
        here.has("s/cases.json") && here.has(&format!("s/cases/{}/summary.json", first()))
    });
    let second = ids(&here, "s").remove(1);
    until("the second one runs", || here.has(&format!("s/running/{second}/series.csv")));
    interrupt(&child);
    assert_eq!(child.wait().expect("ends").code(), Some(130));
    assert!(here.has(&format!("s/cases/{}/summary.json", first())));
    assert!(!here.has(&format!("s/running/{second}")) && !here.has(&format!("s/failed/{second}")));
    assert!(here.read("s/table.csv").contains("missing"));
}

#[cfg(unix)]
fn interrupt(child: &Child) {
    signal("-INT", child);
}

#[cfg(unix)]
fn signal(name: &str, child: &Child) {
    Command::new("kill").args([name, &child.id().to_string()]).status().expect("a signal is sent");
}

/// Waits until a condition holds.
#[track_caller]
fn until(what: &str, mut is: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is() {
        assert!(start.elapsed() < Duration::from_secs(120), "never: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A Python that has a module; prints a message and returns `None` if there is none.
fn python_with(module: &str) -> Option<String> {
    let named = std::env::var("GRAINSCOPE_PYTHON").ok();
    let mut candidates = named.into_iter().chain(["python3".to_owned()]);
    let has = |python: &String| {
        let probe = Command::new(python).args(["-c", &format!("import {module}")]).output();
        probe.is_ok_and(|o| o.status.success())
    };
    let found = candidates.find(has);
    if found.is_none() {
        println!("skipped: no Python with {module} (pip install {module}; GRAINSCOPE_PYTHON)");
    }
    found
}

/// A HyperQueue server or worker, killed at the end of the test.
struct HyperQueue(Child);

impl Drop for HyperQueue {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A HyperQueue cluster on this machine.
struct Cluster<'a> {
    here: &'a TempFolder,
    python: String,
}

impl Cluster<'_> {
    fn driver() -> String {
        concat!(env!("CARGO_MANIFEST_DIR"), "/assets/hyperqueue/hq.py").to_owned()
    }

    fn start(&self, arguments: &[&str]) -> HyperQueue {
        let child = Command::new(&self.python)
            .arg(Self::driver())
            .args(arguments)
            .env("HQ_SERVER_DIR", self.here.path("hq-server"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Python starts");
        let mut started = HyperQueue(child);
        let out = started.0.stdout.take().expect("piped");
        let mut lines = std::io::BufRead::lines(std::io::BufReader::new(out));
        let ready = lines.find(|l| l.as_ref().is_ok_and(|l| l.starts_with("HyperQueue ")));
        assert!(ready.is_some(), "HyperQueue does not start: {arguments:?}");
        started
    }

    fn server(&self) -> HyperQueue {
        self.start(&["server", "start"])
    }

    fn worker(&self) -> HyperQueue {
        self.start(&["worker", "start", "--cpus", "1"])
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = self.here.command(arguments);
        command
            .env("HQ_ENTRY", format!("{} {}", self.python, Self::driver()))
            .env("HQ_SERVER_DIR", self.here.path("hq-server"));
        command
    }

    fn sweep(&self, arguments: &[&str]) -> Said {
        Said::new(arguments, self.command(arguments).output().expect("the program starts"))
    }
}

#[test]
fn hyperqueue_gives_the_same_states_as_local_runs() {
    let here = TempFolder::new();
    let entry = |value: &str| {
        let mut command = here.command(&small(&["--vary", "alpha=0,1", "--engine", "hq"]));
        command.env("HQ_ENTRY", value);
        Said::new(&["sweep"], command.output().expect("the program starts"))
    };
    entry("no-such-hq").exits(1).complains(&["cannot start `no-such-hq`", "HQ_ENTRY"]);
    let Some(python) = python_with("hyperqueue") else { return };
    let cluster = Cluster { here: &here, python };
    let arguments = ["--vary", "alpha=0,1", "--engine", "hq", "--out", "hq", "--no-recordings"];
    cluster.sweep(&small(&arguments)).exits(1).complains(&["start a server and workers first"]);
    let _server = cluster.server();
    let _worker = cluster.worker();
    cluster.sweep(&small(&arguments)).exits(0).prints(&["done: 2 of 2 cases"]);
    let local = ["--vary", "alpha=0,1", "--out", "local", "--no-recordings"];
    here.grainscope(&small(&local)).exits(0);
    assert_eq!(hashes(&here, "hq"), hashes(&here, "local"));
}

/// Long test: a worker is killed during a case, and the server is killed and started again.
#[cfg(unix)]
#[test]
#[ignore = "some minutes; needs the Python package hyperqueue"]
fn a_sweep_survives_the_death_of_workers_and_servers() {
    let here = TempFolder::new();
    let Some(python) = python_with("hyperqueue") else { return };
    let cluster = Cluster { here: &here, python };
    let vary = ["--vary", "alpha=0,1/3,5/3", "--vary", "accuracy.cells=2,8", "--no-recordings"];
    let set = ["--set", "time.end=4e-4", "--set", "recording.times=[]"];
    let base = [&["sweep", "silo"], &vary[..], &set[..]].concat();
    let hq = [&base[..], &["--engine", "hq", "--out", "hq"]].concat();
    let server = cluster.server();
    let mut workers = vec![cluster.worker(), cluster.worker()];
    let mut child = cluster.command(&hq).stderr(Stdio::null()).spawn().expect("starts");
    let running = || {
        let list = std::fs::read_dir(here.path("hq/running"));
        let is_run = |e: std::io::Result<std::fs::DirEntry>| {
            e.is_ok_and(|e| e.path().join("series.csv").is_file())
        };
        list.map_or(0, |l| l.filter_map(|e| is_run(e).then_some(())).count())
    };
    until("both workers run a case", || running() == 2);
    // A worker is killed in the middle of a case.
    signal("-KILL", &workers.remove(0).0);
    let done = || {
        let list = std::fs::read_dir(here.path("hq/cases"));
        list.map_or(0, Iterator::count)
    };
    until("another case is done", || done() >= 3);
    signal("-KILL", &server.0);
    // Without a server the sweep ends and reports missing cases.
    assert_eq!(child.wait().expect("ends").code(), Some(6));
    let before = done();
    assert!((3..6).contains(&before), "{before} of 6 done");
    drop((server, workers));
    let _server = cluster.server();
    let _workers = [cluster.worker(), cluster.worker()];
    let said = cluster.sweep(&hq).exits(0).prints(&["done: 6 of 6 cases"]);
    assert!(!said.err.contains("6 cases, 0 done before"), "{}", said.err);
    here.grainscope(&[&base[..], &["--out", "local"]].concat()).exits(0);
    assert_eq!(hashes(&here, "hq"), hashes(&here, "local"));
}

#[test]
fn recordings_are_exported_for_other_programs() {
    let here = TempFolder::new();
    let run = ["run", "silo", "--set", "accuracy.cells=2", "--out", "r", "--until", "3e-4"];
    here.grainscope(&[&run[..], &["--set", "recording.frames=40"]].concat()).exits(0);
    here.grainscope(&["export", "r", "--format", "vtu"]).exits(0).prints(&["r/vtu"]);
    here.grainscope(&["export", "r/recording.rrd", "--format", "csv", "--out", "t"]).exits(0);
    let frames = Table::read(&here.read("t/frames.csv")).numbers("time");
    let last = frames.len() - 1;
    assert!(last > 1 && frames[0] == 0.0 && (frames[last] - 3e-4).abs() < 1e-9, "{frames:?}");
    let particles = Table::read(&here.read(&format!("t/particles_{last:05}.csv")));
    assert!(particles.text("material").iter().all(|m| ["grains", "marked"].contains(m)));
    // Particles that have left the silo are below its bottom at y = 3.
    let below = |name: &str| {
        let table = Table::read(&here.read(name));
        table.numbers("y").iter().filter(|y| **y < 2.99).count()
    };
    assert_eq!(below("t/particles_00000.csv"), 0);
    assert!(below(&format!("t/particles_{last:05}.csv")) > 10);
    let fields = Table::read(&here.read(&format!("t/fields_{last:05}.csv")));
    let speeds = fields.numbers("speed");
    let fastest = speeds.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let summary = here.json("r/summary.json");
    let most = summary["max_speed"].as_f64().expect("a speed");
    assert!((0.5 * most..1.5 * most).contains(&fastest), "{fastest} of {most}");

    let series = here.read("r/vtu/fields.pvd");
    assert_eq!(series.matches("<DataSet ").count(), frames.len());
    assert!(series.contains(&format!("fields_{last:05}.vtu")));
    let text = here.read(&format!("r/vtu/particles_{last:05}.vtu"));
    let count = particles.rows.len();
    assert!(text.contains(&format!("NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\"")));
    for name in ["material", "Points", "connectivity", "offsets", "types"] {
        assert!(text.contains(&format!("Name=\"{name}\"")), "{name}");
    }
    for (open, close) in [("<DataArray ", "</DataArray>"), ("<VTKFile ", "</VTKFile>")] {
        assert_eq!(text.matches(open).count(), text.matches(close).count());
    }
    let Some(python) = python_with("meshio") else { return };
    let script = format!(
        "import meshio, json\n\
         p = meshio.read('r/vtu/particles_{last:05}.vtu')\n\
         f = meshio.read('r/vtu/fields_{last:05}.vtu')\n\
         v = f.cell_data['speed'][0]\n\
         print(json.dumps([len(p.points), float(p.points[:,1].sum()), f.cells[0].type, len(v), \
         float(v[v == v].max()), int(p.point_data['material'].max())]))"
    );
    let said = here.command(&[]).get_current_dir().map(|folder| {
        Command::new(python).args(["-c", &script]).current_dir(folder).output().expect("Python")
    });
    let said = said.expect("a folder");
    let found: Value = serde_json::from_slice(&said.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&said.stderr)));
    assert_eq!(found[0], count);
    let sum: f64 = particles.numbers("y").iter().sum();
    assert!((found[1].as_f64().expect("a sum") - sum).abs() < 1e-3 * sum);
    assert_eq!(found[2], "quad");
    assert_eq!(found[3], speeds.len());
    assert!((found[4].as_f64().expect("a speed") - fastest).abs() < 1e-6 * fastest);
}

#[test]
fn export_errors_give_the_reason() {
    let here = TempFolder::new();
    here.grainscope(&["export", "none", "--format", "vtu"]).exits(1).complains(&["no such file"]);
    let run = ["run", "silo", "--set", "accuracy.cells=2", "--steps", "1", "--out", "r"];
    here.grainscope(&[&run[..], &["--no-recording"]].concat()).exits(0);
    here.grainscope(&["export", "r", "--format", "csv"]).exits(1).complains(&["--no-recording"]);
}
