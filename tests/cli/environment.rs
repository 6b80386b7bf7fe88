//! Tests with real failures of disks, folders, permissions, pipes, viewers and ports.

use super::*;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Longest time to wait for anything.
const PATIENCE: Duration = Duration::from_secs(120);

/// A run of the silo that takes some seconds; the output folder follows.
const RUN: [&str; 9] = [
    "run",
    "silo",
    "--set",
    "accuracy.cells=3",
    "--set",
    "recording.frames=400",
    "--until",
    "2e-4",
    "--out",
];

fn arguments<'a>(out: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    [&RUN[..], &[out], rest].concat()
}

fn is_root() -> bool {
    let said = Command::new("id").arg("-u").output();
    said.is_ok_and(|o| o.stdout.starts_with(b"0"))
}

/// True if a program can be run and succeeds.
fn works(program: &str, arguments: &[&str]) -> bool {
    Command::new(program).args(arguments).stderr(Stdio::null()).status().is_ok_and(|s| s.success())
}

/// Waits until a run has written some rows.
fn wait_for_rows(here: &TempFolder, out: &str, rows: usize) {
    let clock = Instant::now();
    let count = || {
        std::fs::read_to_string(here.path(out).join("series.csv"))
            .map_or(0, |t| t.lines().count().saturating_sub(1))
    };
    while count() < rows {
        assert!(clock.elapsed() < PATIENCE, "no steps are taken");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A small file system, unmounted when dropped.
struct Disk(PathBuf);

impl Disk {
    /// Mounts a file system; `None` without the rights to do so.
    fn mount(path: PathBuf, size: &str) -> Option<Disk> {
        std::fs::create_dir(&path).expect("a folder");
        let target = path.to_string_lossy().into_owned();
        let options = format!("size={size}");
        let mounted =
            is_root() && works("mount", &["-t", "tmpfs", "-o", &options, "tmpfs", &target]);
        mounted.then_some(Disk(path))
    }

    fn resize(&self, size: &str) {
        let options = format!("remount,size={size}");
        assert!(works("mount", &["-o", &options, &self.0.to_string_lossy()]));
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = works("umount", &["-l", &self.0.to_string_lossy()]);
    }
}

#[test]
fn a_full_disk_is_named_and_the_run_goes_on_when_there_is_room() {
    let here = TempFolder::new();
    let Some(disk) = Disk::mount(here.path("disk"), "4m") else {
        eprintln!("skipped: no disk can be mounted here (needs root)");
        return;
    };
    here.grainscope(&arguments("whole", &[])).exits(0);
    let run = arguments("disk/run", &["--checkpoint-every", "2"]);
    let said = here.grainscope(&run).exits(1);
    said.complains(&["No space left on device", "disk/run"]);
    // Existing rows are complete.
    let rows = Table::read(&here.read("disk/run/series.csv")).rows.len();
    assert!(rows > 2, "{rows}");
    disk.resize("100m");
    let said = here.grainscope(&["resume", "disk/run"]).exits(0);
    said.complains(&["continuing after step"]);
    let hash = |run: &str| here.json(&format!("{run}/summary.json"))["state_hash"].clone();
    assert_eq!(hash("disk/run"), hash("whole"));
    let table = |run: &str| Table::read(&here.read(&format!("{run}/series.csv")));
    let (whole, run) = (table("whole"), table("disk/run"));
    assert_eq!(whole.without("wall"), run.without("wall"));
    let store = recording::recording(&here.path("disk/run/recording.rrd"));
    assert_eq!(recording::steps(&store).len(), run.rows.len());
}

#[test]
fn a_deleted_output_folder_is_named() {
    let here = TempFolder::new();
    // It ends with the fault: its own end is far away.
    let run =
        ["run", "silo", "--set", "accuracy.cells=3", "--checkpoint-every", "2", "--out", "gone"];
    let child = here.start(&run);
    wait_for_rows(&here, "gone", 2);
    // Repeated, because the program may create files in the folder meanwhile.
    let clock = Instant::now();
    while std::fs::remove_dir_all(here.path("gone")).is_err() && here.has("gone") {
        assert!(clock.elapsed() < PATIENCE);
    }
    let said = Said::new(&run, child.wait_with_output().expect("an end")).exits(1);
    said.complains(&["gone/", "No such file or directory"]);
    assert!(!here.has("gone"), "the folder was created again");
}

#[test]
fn missing_permissions_are_named() {
    let user = ["--reuid=65534", "--regid=65534", "--clear-groups"];
    let program = env!("CARGO_BIN_EXE_grainscope");
    if !is_root() || !works("setpriv", &[&user[..], &[program, "--version"]].concat()) {
        eprintln!("skipped: cannot change the user (needs root and setpriv)");
        return;
    }
    let here = TempFolder::new();
    std::fs::create_dir(here.path("mine")).expect("a folder");
    let run = arguments("mine/run", &[]);
    let said = Command::new("setpriv")
        .args(user)
        .arg(program)
        .args(&run)
        .current_dir(here.path("."))
        .env("NO_COLOR", "1")
        .output()
        .expect("starts");
    let said = Said::new(&run, said).exits(1);
    said.complains(&["mine/run", "cannot be written", "Permission denied"]);
}

#[test]
fn closed_output_pipes_are_not_an_error() {
    let here = TempFolder::new();
    // Both pipes are closed before anything is printed.
    let mut child = here.start(&arguments("run", &["--steps", "2"]));
    drop((child.stdout.take(), child.stderr.take()));
    assert_eq!(child.wait().expect("an end").code(), Some(0));
    assert_eq!(here.json("run/summary.json")["steps"], 2);
    // An error keeps its exit code.
    let mut child = here
        .command(&["run", "nonsense"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stderr.take());
    assert_eq!(child.wait().expect("an end").code(), Some(3));
}

/// A process that receives recordings as a viewer does.
struct Viewer {
    program: Child,
    port: u16,
}

/// Environment variable with the port of a viewer.
const VIEWER_PORT: &str = "GRAINSCOPE_TEST_VIEWER";

/// Not a test of its own: the process of a [`Viewer`] runs it.
#[test]
#[ignore = "it serves as a viewer for other tests"]
fn viewer_process() {
    let Some(port) = std::env::var(VIEWER_PORT).ok().and_then(|p| p.parse().ok()) else { return };
    let options = rerun::external::re_grpc_server::ServerOptions::default();
    let server = rerun::grpc_server::GrpcServerSink::new("127.0.0.1", port, options);
    std::thread::sleep(PATIENCE);
    drop(server);
}

impl Viewer {
    fn start() -> Viewer {
        let free = TcpListener::bind("127.0.0.1:0").expect("a port");
        let port = free.local_addr().expect("an address").port();
        drop(free);
        let program = Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "environment::viewer_process", "--ignored"])
            .env(VIEWER_PORT, port.to_string())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let clock = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(clock.elapsed() < PATIENCE);
            std::thread::sleep(Duration::from_millis(20));
        }
        Viewer { program, port }
    }

    fn kill(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.kill();
    }
}

fn address(port: u16) -> String {
    format!("rerun+http://127.0.0.1:{port}/proxy")
}

/// A proxy to a viewer that passes on `rate` bytes per second, and at most `most` bytes in total.
/// Returns its port.
fn slow_line(viewer: &Viewer, rate: f64, most: usize) -> u16 {
    let pass = |mut from: TcpStream, mut to: TcpStream, rate: f64, most: usize| {
        std::thread::spawn(move || {
            let (mut bytes, mut passed) = ([0; 2048], 0);
            while passed < most {
                let Ok(n @ 1..) = from.read(&mut bytes) else { return };
                passed += n;
                std::thread::sleep(Duration::from_secs_f64(n as f64 / rate));
                if to.write_all(&bytes[..n]).is_err() {
                    return;
                }
            }
            // The connection stays open, but nothing more is read.
            std::thread::sleep(PATIENCE);
        });
    };
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let far = viewer.port;
    std::thread::spawn(move || {
        for near in listener.incoming().flatten() {
            let Ok(far) = TcpStream::connect(("127.0.0.1", far)) else { return };
            let (Ok(a), Ok(b)) = (near.try_clone(), far.try_clone()) else { return };
            pass(a, b, rate, most);
            pass(far, near, f64::INFINITY, usize::MAX);
        }
    });
    port
}

/// Checks that the recording of a run contains every step of its table.
fn recorded_whole(here: &TempFolder, run: &str) {
    let rows = Table::read(&here.read(&format!("{run}/series.csv"))).rows.len();
    let store = recording::recording(&here.path(&format!("{run}/recording.rrd")));
    assert_eq!(recording::steps(&store).len(), rows);
}

#[test]
fn a_viewer_that_dies_or_sticks_does_not_take_the_run_with_it() {
    let here = TempFolder::new();
    let mut viewer = Viewer::start();
    let hash = |run: &str| here.json(&format!("{run}/summary.json"))["state_hash"].clone();
    here.grainscope(&arguments("whole", &["--no-recording"])).exits(0);
    // The viewer stops reading after some pictures.
    let port = slow_line(&viewer, f64::INFINITY, 400_000);
    let said = here.grainscope(&arguments("stuck", &["--connect", &address(port)])).exits(0);
    said.complains(&["warning: the viewer at rerun+http://127.0.0.1"]);
    assert_eq!(hash("stuck"), hash("whole"));
    recorded_whole(&here, "stuck");
    // The viewer is killed.
    let url = address(viewer.port);
    let run = arguments("run", &["--connect", &url]);
    let child = here.start(&run);
    wait_for_rows(&here, "run", 2);
    viewer.kill();
    let said = Said::new(&run, child.wait_with_output().expect("an end")).exits(0);
    said.complains(&["warning: the viewer at rerun+http://127.0.0.1"]);
    assert_eq!(hash("run"), hash("whole"));
    recorded_whole(&here, "run");
}

/// If a run is recorded, a slow viewer causes no loss. If it is only watched, the oldest pictures
/// are dropped and counted.
#[test]
fn a_slow_viewer_loses_only_what_may_be_lost() {
    let here = TempFolder::new();
    let viewer = Viewer::start();
    // Many small pictures, made faster than they can be shown.
    let scene = ["run", "couette_cosserat", "--set", "accuracy.cells=8"];
    let pace = ["--set", "time.max_step=2e-4", "--set", "recording.frames=100000"];
    let watch = |out: &str, more: &[&str]| {
        let run = [&scene[..], &pace, &["--steps", "2000", "--out", out], more].concat();
        let said = here.grainscope(&run);
        (said.code == Some(0)).then(|| here.json(&format!("{out}/summary.json")))
    };
    let alone = watch("alone", &["--no-recording"]).expect("a run");
    // The required rate depends on the present speed of this machine.
    let mut told = Vec::new();
    for (k, rate) in [8e6, 4e6, 2e6, 1e6, 5e5, 2.5e5].into_iter().enumerate() {
        let url = address(slow_line(&viewer, rate, usize::MAX));
        let out = format!("kept{k}");
        let kept = watch(&out, &["--connect", &url]).expect("a run");
        // A viewer that is too slow is disconnected; without a recording the run then ends.
        let watched = watch(&format!("watched{k}"), &["--no-recording", "--connect", &url]);
        recorded_whole(&here, &out);
        assert_eq!(kept["frames"]["dropped"], 0);
        for summary in watched.iter().chain([&kept]) {
            assert_eq!(summary["state_hash"], alone["state_hash"]);
            assert!(summary["frames"]["sent"].as_u64() > Some(2000));
        }
        let some = |summary: &Value, what: &str| summary["frames"][what].as_u64() > Some(0);
        if let Some(watched) = &watched {
            assert!(!some(watched, "waits"), "a viewer that only watches delayed the run");
            told.push((rate, kept["frames"].to_string(), watched["frames"].to_string()));
            if some(&kept, "waits") && some(watched, "dropped") {
                println!("{told:#?}");
                return;
            }
        }
    }
    panic!("no connection was slow enough: {told:#?}");
}

#[test]
fn a_port_that_is_taken_is_named() {
    let here = TempFolder::new();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    let run = arguments("run", &["--serve", "--port", &port]);
    let said = here.grainscope(&run).exits(1);
    said.complains(&[&format!("port {port} of this machine cannot be used"), "any free port"]);
    assert!(!here.has("run"));
}

#[test]
fn a_run_is_the_same_however_it_is_watched() {
    let here = TempFolder::new();
    let steps = ["--steps", "6"];
    // Options that must not change the result.
    let ways: [&[&str]; 9] = [
        &[],
        &[],
        &["--threads", "1"],
        &["--threads", "2"],
        &["--threads", "4"],
        &["--no-recording"],
        &["--checkpoint-every", "1"],
        &["--on-fault", "stop", "--profile"],
        &["--save", "elsewhere.rrd", "--json"],
    ];
    let mut states = Vec::new();
    for (k, way) in ways.iter().enumerate() {
        let out = format!("run{k}");
        here.grainscope(&arguments(&out, &[&steps[..], way].concat())).exits(0);
        states.push(here.json(&format!("{out}/summary.json"))["state_hash"].clone());
    }
    states.dedup();
    assert_eq!(states.len(), 1, "{states:?}");
}

/// Instruction sets differ only by rounding, so that gauges agree.
#[test]
fn instruction_sets_agree_on_gauges() {
    let here = TempFolder::new();
    let best = here.grainscope(&["doctor", "--json"]).exits(0).json()["vectors"].clone();
    let sets: Vec<&str> = ["portable", "avx2", "avx512"]
        .into_iter()
        .filter(|set| here.grainscope(&["--simd", set, "doctor"]).code == Some(0))
        .collect();
    assert!(sets.iter().any(|set| best == *set), "{best} is not among {sets:?}");
    let mut hashes = Vec::new();
    let mut gauges: Vec<Vec<Vec<f64>>> = Vec::new();
    for set in &sets {
        // The first run is set by the option, the second by the environment variable.
        here.grainscope(&arguments(set, &["--simd", set])).exits(0);
        let other = format!("{set}-again");
        let again = arguments(&other, &["--no-recording"]);
        let ended = here.command(&again).env("GRAINSCOPE_SIMD", set).output().expect("starts");
        assert!(ended.status.success());
        let hash = |run: &str| here.json(&format!("{run}/summary.json"))["state_hash"].clone();
        assert_eq!(hash(set), hash(&other), "{set}");
        hashes.push(hash(set));
        let table = Table::read(&here.read(&format!("{set}/series.csv")));
        gauges.push(["time", "outflow_rate", "outflow_volume"].map(|c| table.numbers(c)).into());
    }
    for (set, columns) in sets.iter().zip(&gauges) {
        for (one, other) in columns.iter().zip(&gauges[0]) {
            assert_eq!(one.len(), other.len(), "{set}");
            let largest = other.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            let apart = one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{set}: {:.1e} of {largest:.3e}", apart / largest);
            assert!(apart <= 1e-9 * largest, "{set}: {apart} of {largest}");
        }
    }
    // The states must differ in rounding; otherwise the option has no effect.
    if sets.len() > 1 {
        hashes.dedup();
        assert!(hashes.len() > 1, "the option has no effect");
    }
    here.grainscope(&["--simd", "mmx", "doctor"]).exits(2).complains(&["portable"]);
}

#[test]
fn a_scene_that_the_machine_has_no_memory_for_is_refused() {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let total = text.lines().find(|l| l.starts_with("MemTotal")).map_or("", |l| &l[9..]);
    let kib: f64 = total.trim().trim_end_matches(" kB").parse().unwrap_or(f64::INFINITY);
    if kib > 64e6 {
        eprintln!("skipped: this machine has enough memory, or does not report it");
        return;
    }
    let here = TempFolder::new();
    let huge = ["couette_cosserat", "--set", "accuracy.cells=990"];
    for command in ["plan", "run"] {
        let said = here.grainscope(&[&[command], &huge[..]].concat()).exits(1);
        said.complains(&["cells need about", "GB of memory", "this machine has", "lower accuracy"]);
    }
    assert!(!here.has("runs"));
    here.grainscope(&["plan", "silo", "--no-measure"]).exits(0).complains(&["a run needs about"]);
}

#[test]
fn doctor_reports_all_facts_for_a_bug_report() {
    let here = TempFolder::new();
    let facts = here.grainscope(&["doctor", "--json"]).exits(0).json();
    let keys = [
        "grainscope",
        "recordings",
        "checkpoints",
        "system",
        "processor",
        "features",
        "vectors",
        "threads",
        "memory",
        "disk",
        "folder",
        "viewer",
        "ports",
    ];
    for key in keys {
        assert!(facts[key].as_str().is_some_and(|v| !v.is_empty()), "{key}: {facts}");
    }
    assert_eq!(facts["grainscope"], env!("CARGO_PKG_VERSION"));
    here.grainscope(&["doctor"]).exits(0).prints(&["threads", "can be written"]);
}
