//! Tests of runs that are killed at a random time or stopped by a signal.

use super::*;
use rand::{Rng, SeedableRng};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Number from an environment variable, or `usual` if it is not set. Long tests (`.ci/run --long`)
/// set larger numbers.
pub fn effort(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().expect("a number"))
}

/// Random numbers with the seed `GRAINSCOPE_SEED`.
pub fn random() -> rand_pcg::Pcg64Mcg {
    rand_pcg::Pcg64Mcg::seed_from_u64(effort("GRAINSCOPE_SEED", 1))
}

/// A run of the silo with some steps, pictures and checkpoints; the output folder follows.
const RUN: [&str; 11] = [
    "run",
    "silo",
    "--set",
    "accuracy.cells=2",
    "--set",
    "recording.frames=400",
    "--until",
    "1e-4",
    "--checkpoint-every",
    "2",
    "--out",
];

fn arguments(out: &str) -> Vec<&str> {
    [&RUN[..], &[out]].concat()
}

/// Starts the program and kills it after a time. False if it had already ended.
fn killed(here: &TempFolder, arguments: &[&str], after: Duration) -> bool {
    let mut child = here
        .command(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(after);
    let running = child.try_wait().expect("known").is_none();
    // SIGKILL
    let _ = child.kill();
    child.wait().expect("an end");
    running
}

/// Checks that all rows of the table are complete, and returns their number.
fn whole_rows(here: &TempFolder, out: &str) -> usize {
    let path = format!("{out}/series.csv");
    if !here.has(&path) || here.read(&path).is_empty() {
        return 0;
    }
    let table = Table::read(&here.read(&path));
    let steps: Vec<String> = (0..table.rows.len()).map(|k| k.to_string()).collect();
    assert_eq!(table.text("step"), steps);
    steps.len()
}

/// Checks that the recording can be read and has no gap, and returns its number of steps.
fn opens(here: &TempFolder, out: &str) -> usize {
    let file = format!("{out}/recording.rrd");
    if !here.has(&file) || std::fs::metadata(here.path(&file)).expect("a file").len() < 100 {
        // Killed while the file was created: nothing had been recorded.
        assert!(whole_rows(here, out) < 2);
        return 0;
    }
    // A truncated file can be read by the viewer and its SDKs; after a repair by all tools.
    let copy = format!("{out}.rrd");
    std::fs::copy(here.path(&file), here.path(&copy)).expect("a copy");
    here.grainscope(&["repair", &copy]).exits(0);
    here.grainscope(&["repair", &copy]).exits(0).prints(&["is complete"]);
    let (store, blueprints) = recording::begun_recording(&here.path(&copy));
    let steps = recording::steps(&store);
    // The layout is recorded before the first step.
    assert!(blueprints == 1 || steps.is_empty(), "{blueprints} blueprints, {steps:?}");
    assert_eq!(steps, (0..steps.len() as i64).collect::<Vec<_>>());
    steps.len()
}

#[test]
fn killed_at_any_moment_nothing_is_lost() {
    let here = TempFolder::new();
    let clock = Instant::now();
    here.grainscope(&arguments("whole")).exits(0);
    let usual = clock.elapsed();
    let whole = Table::read(&here.read("whole/series.csv"));
    let hash = here.json("whole/summary.json")["state_hash"].clone();
    let (mut random, wanted) = (random(), effort("GRAINSCOPE_KILLS", 10));
    let moment = |random: &mut rand_pcg::Pcg64Mcg| usual.mul_f64(random.random_range(0.0..1.0));
    let (mut kills, mut resumed, mut restarted) = (0, 0, 0);
    for k in 0.. {
        if kills >= wanted {
            break;
        }
        let out = format!("run{k}");
        kills += u64::from(killed(&here, &arguments(&out), moment(&mut random)));
        // Half of the runs are killed again after they are resumed.
        loop {
            whole_rows(&here, &out);
            opens(&here, &out);
            if kills >= wanted || random.random_bool(0.5) {
                break;
            }
            kills += u64::from(killed(&here, &["resume", &out], moment(&mut random)));
        }
        let said = here.grainscope(&["resume", &out]);
        if said.code == Some(0) {
            resumed += 1;
        } else {
            // Killed before the first checkpoint: the run must be started again.
            let checkpoints = here.path(&out).join("checkpoints");
            let any = std::fs::read_dir(checkpoints).into_iter().flatten().flatten();
            let whole = any.filter(|e| e.path().extension().is_some_and(|e| e == "state")).count();
            assert_eq!(whole, 0, "{}", said.err);
            restarted += 1;
            here.grainscope(&[&arguments(&out)[..], &["--force"]].concat()).exits(0);
        }
        assert_eq!(here.json(&format!("{out}/summary.json"))["state_hash"], hash);
        let table = Table::read(&here.read(&format!("{out}/series.csv")));
        assert_eq!(table.without("wall"), whole.without("wall"));
        assert_eq!(opens(&here, &out), whole.rows.len());
        std::fs::remove_dir_all(here.path(&out)).expect("removed");
    }
    println!("{kills} kills: {resumed} runs resumed, {restarted} restarted, all ended with {hash}");
}

/// A silo whose steps are long compared with the time that a thread waits for a processor, and whose
/// end is far away.
const LONG: [&str; 9] = [
    "run",
    "silo",
    "--set",
    "accuracy.cells=6",
    "--set",
    "recording.frames=400",
    "--checkpoint-every",
    "2",
    "--out",
];

#[cfg(unix)]
#[test]
fn told_to_end_a_run_ends_within_a_step() {
    let here = TempFolder::new();
    for signal in ["INT", "TERM", "HUP"] {
        let run = [&LONG[..], &[signal]].concat();
        let child = here.start(&run);
        let rows = || here.has(&format!("{signal}/series.csv")).then(|| whole_rows(&here, signal));
        let patience = Instant::now();
        while rows().is_none_or(|rows| rows < 4) {
            assert!(patience.elapsed() < Duration::from_secs(120), "no steps are taken");
            std::thread::sleep(Duration::from_millis(5));
        }
        let id = child.id().to_string();
        let signal_arg = format!("-{signal}");
        assert!(Command::new("kill").args([&signal_arg, &id]).status().expect("kill").success());
        let at_least = rows().expect("rows");
        let said = Said::new(&run, child.wait_with_output().expect("an end")).exits(130);
        said.prints(&["silo interrupted", &format!("grainscope resume {signal} continues")]);
        // The current step is finished; one more may be taken before the signal is delivered.
        let reached = rows().expect("rows");
        assert!(reached <= at_least + 2);
        // Rows begin with step 0.
        let steps = (reached + 2).to_string();
        here.grainscope(&["resume", signal, "--steps", &steps]).exits(0);
        let whole = format!("{signal}-whole");
        here.grainscope(&[&LONG[..], &[&whole, "--steps", &steps]].concat()).exits(0);
        let hash = |run: &str| here.json(&format!("{run}/summary.json"))["state_hash"].clone();
        assert_eq!(hash(signal), hash(&whole));
    }
}
