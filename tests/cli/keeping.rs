//! Tests that no file is lost: of an earlier run, of the user, of a damaged recording; and that one
//! process at a time writes into a folder.

use super::*;
use grainscope::frame::{Frame, RunInfo, Scalar};
use grainscope::internals::{RerunLog, Sink};
use std::collections::BTreeMap;
use std::net::TcpListener;
use std::time::{Duration, Instant};

/// A short run; the output folder follows.
const RUN: [&str; 9] = [
    "run",
    "couette_cosserat",
    "--set",
    "accuracy.cells=4",
    "--steps",
    "6",
    "--checkpoint-every",
    "2",
    "--out",
];

fn arguments<'a>(out: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    [&RUN[..], &[out], rest].concat()
}

/// All files below a folder, with their contents.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            all.extend(contents(&path));
        } else {
            all.insert(path.clone(), std::fs::read(&path).expect("a file"));
        }
    }
    all
}

#[test]
fn a_run_that_cannot_start_leaves_the_earlier_one_as_it_was() {
    let here = TempFolder::new();
    here.grainscope(&arguments("run", &[])).exits(0);
    here.grainscope(&arguments("other", &["--save", "kept.rrd"])).exits(0);
    let before = contents(&here.path("."));
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    let busy = ["--force", "--serve", "--port", &port];
    here.grainscope(&arguments("run", &busy)).exits(1).complains(&["cannot be used"]);
    let saved = [&busy[..], &["--save", "kept.rrd"]].concat();
    here.grainscope(&arguments("other", &saved)).exits(1).complains(&["cannot be used"]);
    here.grainscope(&arguments("other", &["--force", "--save", "missing/x.rrd"])).exits(1);
    assert!(contents(&here.path(".")) == before);
    // Without a fault the run is replaced, and nothing else remains.
    here.grainscope(&arguments("run", &["--force"])).exits(0);
    let names = |all: &BTreeMap<PathBuf, _>| all.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&contents(&here.path("."))), names(&before));
}

/// A full disk in the middle of the run.
#[cfg(target_os = "linux")]
#[test]
fn a_run_whose_disk_is_full_leaves_the_earlier_one_as_it_was() {
    let here = TempFolder::new();
    here.grainscope(&arguments("run", &["--save", "kept.rrd"])).exits(0);
    let before = contents(&here.path("."));
    let full = ["--force", "--no-recording", "--save", "/dev/full"];
    here.grainscope(&arguments("run", &[full[0], full[2], full[3]]))
        .exits(1)
        .complains(&["No space left"]);
    assert!(contents(&here.path(".")) == before);
}

#[test]
fn the_scene_that_is_run_is_never_written() {
    let here = TempFolder::new();
    let preset = &preset_files().into_iter().find(|p| p.0 == "couette_cosserat").expect("there").1;
    let mine = format!("# my comment\n{preset}");
    here.write("scene.toml", &mine);
    let run = ["run", "scene.toml", "--steps", "1", "--out", "."];
    let force = [&run[..], &["--force"]].concat();
    here.grainscope(&run).exits(0);
    here.grainscope(&run).exits(1).complains(&["already holds a run"]);
    here.grainscope(&force).exits(0);
    assert_eq!(here.read("scene.toml"), mine);
    let other = [&force[..], &["--set", "accuracy.cells=4"]].concat();
    here.grainscope(&other).exits(1).complains(&["scene.toml", "left as it is", "--out"]);
    assert_eq!(here.read("scene.toml"), mine);
    // A scene of the user in the folder of another run.
    let foreign = ["run", "couette_cosserat", "--steps", "1", "--out", ".", "--force"];
    here.grainscope(&foreign).exits(1).complains(&["scene.toml", "left as it is"]);
    assert_eq!(here.read("scene.toml"), mine);
    assert!(here.has("series.csv"));
}

#[test]
fn files_of_the_user_are_not_replaced() {
    let here = TempFolder::new();
    here.grainscope(&arguments("a", &[])).exits(0);
    here.grainscope(&arguments("b", &["--set", "accuracy.seed=2"])).exits(0);
    let mine = "a letter of mine";
    let keeps = |file: &str, command: &[&str]| {
        here.write(file, mine);
        here.grainscope(command).exits(1).complains(&["is left as it is"]);
        assert_eq!(here.read(file), mine, "{command:?}");
    };
    keeps("notes.rrd", &arguments("c", &["--save", "notes.rrd"]));
    assert!(!here.has("c"));
    keeps("notes.rrd", &["compare", "a", "b", "-o", "notes.rrd"]);
    std::fs::create_dir(here.path("out")).expect("a folder");
    keeps("out/frames.csv", &["export", "a", "--format", "csv", "--out", "out"]);
    let sweep = ["sweep", "couette_cosserat", "--vary", "accuracy.seed=1,2", "--dry-run"];
    keeps("out/scene.toml", &[&sweep[..], &["--out", "out"]].concat());
    std::fs::create_dir(here.path("tables")).expect("a folder");
    let sweep = ["sweep", "couette_cosserat", "--vary", "accuracy.cells=4,5", "--out", "tables"];
    keeps("tables/table.csv", &sweep);
    for name in ["recording.rrd", "summary.json", "series.csv", "outflow.png"] {
        let folder = format!("with_{name}");
        std::fs::create_dir(here.path(&folder)).expect("a folder");
        keeps(&format!("{folder}/{name}"), &arguments(&folder, &["--force"]));
    }
}

#[test]
fn a_resume_that_fails_for_another_reason_says_so_and_changes_nothing() {
    let here = TempFolder::new();
    here.grainscope(&arguments("run", &[])).exits(0);
    let before = contents(&here.path("run"));
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    let said = here.grainscope(&["resume", "run", "--serve", "--port", &port]).exits(1);
    assert!(!said.err.contains("checkpoint") && !said.err.contains("--force"), "{}", said.err);
    said.complains(&["cannot be used"]);
    assert!(contents(&here.path("run")) == before);
    // A folder in the place of the table.
    std::fs::rename(here.path("run/series.csv"), here.path("table")).expect("moved");
    std::fs::create_dir(here.path("run/series.csv")).expect("a folder");
    let said = here.grainscope(&["resume", "run"]).exits(1);
    assert!(!said.err.contains("--force"), "{}", said.err);
    std::fs::remove_dir(here.path("run/series.csv")).expect("removed");
    std::fs::rename(here.path("table"), here.path("run/series.csv")).expect("moved");
    // A recording that the checkpoint names, but that is something else.
    here.write("run/recording.rrd", "a letter");
    here.grainscope(&["resume", "run"]).exits(1).complains(&["is left as it is"]);
    std::fs::write(here.path("run/recording.rrd"), &before[&here.path("run/recording.rrd")])
        .expect("written");
    assert!(contents(&here.path("run")) == before);
    here.grainscope(&["resume", "run", "--steps", "8"]).exits(0);
    assert_eq!(Table::read(&here.read("run/series.csv")).rows.len(), 9);
}

#[test]
fn one_process_writes_into_a_folder() {
    let here = TempFolder::new();
    let scene = ["run", "couette_cosserat", "--set", "accuracy.cells=4", "--steps", "40"];
    // Runs without a name that start at once.
    let runs: Vec<Child> = (0..4).map(|_| here.start(&scene)).collect();
    for run in runs {
        let said = Said::new(&scene, run.wait_with_output().expect("an end"));
        said.exits(0);
    }
    for name in ["", "-2", "-3", "-4"] {
        let folder = format!("runs/couette_cosserat{name}");
        assert_eq!(Table::read(&here.read(&format!("{folder}/series.csv"))).rows.len(), 41);
        let place = here.path(&format!("{folder}/recording.rrd"));
        assert_eq!(recording::steps(&recording::recording(&place)).len(), 41);
        assert!(!here.has(&format!("{folder}/.grainscope.lock")));
    }
    // Two resumes of one run: one continues, the other names it.
    here.grainscope(&arguments("run", &[])).exits(0);
    let resume = ["resume", "run", "--steps", "2000"];
    let first = here.start(&resume);
    let clock = Instant::now();
    while !here.has("run/.grainscope.lock") {
        assert!(clock.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(100));
    let id = format!("process {}", first.id());
    here.grainscope(&resume).exits(1).complains(&["in use by", &id]);
    here.grainscope(&arguments("run", &["--force"])).exits(1).complains(&["in use by", &id]);
    here.grainscope(&["repair", "run"]).exits(1).complains(&["in use by", &id]);
    Said::new(&resume, first.wait_with_output().expect("an end")).exits(0);
    let rows = Table::read(&here.read("run/series.csv")).rows.len();
    let store = recording::recording(&here.path("run/recording.rrd"));
    assert_eq!(recording::steps(&store).len(), rows);
}

#[test]
fn names_from_files_do_not_lead_out_of_the_folder() {
    let here = TempFolder::new();
    let sweep = ["sweep", "couette_cosserat", "--vary", "accuracy.seed=1,2", "--dry-run"];
    here.grainscope(&[&sweep[..], &["--out", "in/sweep"]].concat()).exits(0);
    std::fs::create_dir_all(here.path("precious")).expect("a folder");
    here.write("precious/letter", "dear");
    let list = here.read("in/sweep/cases.json");
    let id = here.json("in/sweep/cases.json")["cases"][0]["id"].clone();
    let id = id.as_str().expect("text");
    for name in ["../../../precious", "..", "/precious", "a b", ""] {
        here.write("in/sweep/cases.json", list.replace(id, name));
        here.grainscope(&["sweep", "case", "in/sweep", name]).complains(&["cases.json"]);
        here.grainscope(&["sweep", "collect", "in/sweep"]).complains(&["cases.json"]);
        assert_eq!(here.read("precious/letter"), "dear");
    }
    // A folder of the user in the place of a case.
    here.write("in/sweep/cases.json", &list);
    std::fs::create_dir_all(here.path(&format!("in/sweep/running/{id}"))).expect("a folder");
    here.write(&format!("in/sweep/running/{id}/letter"), "dear");
    here.grainscope(&["sweep", "case", "in/sweep", id]).exits(1).complains(&["left as it is"]);
    assert_eq!(here.read(&format!("in/sweep/running/{id}/letter")), "dear");
}

/// A recording with many small messages.
fn long_recording(path: &Path) {
    let info = RunInfo { name: "run".into(), recording_id: "id".into(), ..RunInfo::default() };
    let mut log = RerunLog::open(&info, &[Sink::Save(path.to_owned())]).expect("a recording");
    for step in 0..200 {
        let mut frame = Frame { step, time_s: step as f64, ..Frame::default() };
        frame.scalars.push(Scalar::new(format!("curve_{}", step / 20), step as f64));
        log.frame(&frame).expect("a frame");
        if step % 20 == 19 {
            log.settle().expect("settled");
        }
    }
    log.finish().expect("an end");
}

#[test]
fn a_damaged_recording_loses_only_the_damaged_part() {
    let here = TempFolder::new();
    let path = here.path("x.rrd");
    long_recording(&path);
    let whole = std::fs::read(&path).expect("a file");
    let steps = |path: &Path| recording::steps(&recording::recording(path)).len();
    assert_eq!(steps(&path), 200);
    let mut fewest = 200;
    for (k, share) in [0.2, 0.3, 0.4, 0.5, 0.6, 0.9].into_iter().enumerate() {
        let name = format!("damaged{k}.rrd");
        let mut bytes = whole.clone();
        let at = (share * bytes.len() as f64) as usize;
        bytes[at..at + 60].fill(0xff);
        here.write(&name, &bytes);
        let said = here.grainscope(&["repair", &name]).exits(0);
        let said = said.prints(&["repaired"]);
        let kept = steps(&here.path(&name));
        assert!((150..=200).contains(&kept), "{kept}: {}", said.out);
        fewest = fewest.min(kept);
        if kept < 200 {
            let original = here.path(&format!("{name}.damaged-1"));
            assert_eq!(std::fs::read(original).expect("kept"), bytes);
            said.prints(&["lost: ", "the original is kept as"]);
        }
        here.grainscope(&["repair", &name]).exits(0).prints(&["is complete"]);
    }
    assert!(fewest < 200, "no place with values was damaged");
}

#[test]
fn a_damaged_table_loses_only_the_damaged_rows() {
    let here = TempFolder::new();
    here.grainscope(&arguments("run", &["--no-recording"])).exits(0);
    let table = here.read("run/series.csv");
    let damaged = table.replacen("\n3,", "\n3,\u{1},", 1);
    here.write("run/series.csv", &damaged);
    here.grainscope(&["repair", "run"]).exits(0).prints(&["6 rows", "lost: 1 damaged row;"]);
    assert_eq!(here.read("run/series.csv.damaged"), damaged);
    assert_eq!(Table::read(&here.read("run/series.csv")).rows.len(), 6);
}

/// A recording to a pipe that nobody reads: the disk hangs.
#[cfg(target_os = "linux")]
#[test]
fn one_signal_ends_a_run_whose_disk_hangs() {
    let here = TempFolder::new();
    let made = Command::new("mkfifo").arg(here.path("pipe")).status().expect("mkfifo");
    assert!(made.success());
    // The pipe is open but is not read.
    let path = here.path("pipe");
    let reader = std::fs::File::options().read(true).write(true).open(&path).expect("a pipe");
    let run = ["run", "silo", "--set", "accuracy.cells=2", "--set", "recording.frames=4000"];
    let run = [&run[..], &["--checkpoint-every", "1", "--save", "pipe", "--out", "run"]].concat();
    let mut child = here.start(&run);
    std::thread::sleep(Duration::from_secs(4));
    assert!(child.try_wait().expect("known").is_none(), "it did not hang");
    let clock = Instant::now();
    let signal = Command::new("kill").arg(child.id().to_string()).status().expect("kill");
    assert!(signal.success());
    child.wait().expect("an end");
    assert!(clock.elapsed() < Duration::from_secs(10), "{:?}", clock.elapsed());
    drop(reader);
}
