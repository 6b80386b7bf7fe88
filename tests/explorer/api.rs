//! Tests of commands and answers over HTTP, and of refused requests.

use super::http::request;
use super::{Explorer, PATIENCE, program};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// A silo that takes some milliseconds per step.
const SMALL: [&str; 4] = ["silo", "--set", "accuracy.cells=2", "--paused"];

/// Command that sets a key.
fn set(key: &str, value: &str) -> Value {
    json!({ "do": "set", "key": key, "value": value })
}

#[test]
fn changes_between_steps_are_reproduced_bit_for_bit() {
    let explorer = Explorer::open(&SMALL);
    explorer.steps(3);
    assert!(explorer.set("alpha", "2").ends_with("takes effect with step 4"));
    explorer.steps(1);
    // Several changes between two steps; one of them is overridden.
    explorer.set("gravity[1]", "-30");
    explorer.set("contrast", "100");
    explorer.set("gravity[1]", "-5");
    explorer.steps(2);
    explorer.set("alpha", "5/3");
    explorer.steps(1);
    explorer.set("materials.grains.density", "2e6");
    explorer.steps(2);
    let state = explorer.state();
    let steps: Vec<_> = state["run"]["changes"].as_array().expect("a list").iter().collect();
    assert_eq!(steps.len(), 4, "{steps:?}");
    assert!(steps.iter().all(|c| c["time"].is_number()), "{steps:?}");
    explorer.repeats_headless("kept");
    let scene = std::fs::read_to_string(explorer.path("runs/kept/scene.toml")).expect("a scene");
    assert_eq!(scene.matches("[[schedule]]").count(), 4, "{scene}");
    // A change that waits for a step that is not taken has no effect on the saved run.
    explorer.set("alpha", "0.01");
    explorer.repeats_headless("waiting");
    // The waiting change takes effect with the next step.
    explorer.steps(1);
    explorer.repeats_headless("after");
}

#[test]
fn changes_while_running_are_reproduced_bit_for_bit() {
    let explorer = Explorer::open(&["silo", "--set", "accuracy.cells=2"]);
    for (step, alpha) in [(3, "1"), (6, "10"), (9, "0.1")] {
        explorer.wait_for("step", |s| s["run"]["step"].as_u64() >= Some(step));
        explorer.set("alpha", alpha);
    }
    explorer.wait_for("step", |s| s["run"]["step"].as_u64() >= Some(14));
    explorer.repeats_headless("kept");
}

#[test]
fn changes_of_other_scenes_are_reproduced() {
    // A scene with directors, and stratified scenes, in which gravity limits the step.
    for (scene, key, values) in [
        ("shear_alignment", "materials.layers.layer_viscosity", ["0.05", "0.2"]),
        ("rayleigh_taylor", "gravity[1]", ["-20", "5"]),
        ("hydrostatic", "gravity[1]", ["-20", "-5"]),
    ] {
        let explorer = Explorer::open(&[scene, "--set", "accuracy.cells=8", "--paused"]);
        explorer.steps(2);
        for value in values {
            let key = match explorer.ask(set(key, value)) {
                answer if answer["accepted"] == json!(true) => key,
                answer => panic!("{scene}: {answer}"),
            };
            assert!(!key.is_empty());
            explorer.steps(2);
        }
        explorer.repeats_headless("kept");
    }
}

#[test]
fn changes_are_ordered_among_scheduled_ones() {
    let silo = program().args(["presets", "show", "silo"]).output().expect("starts");
    let silo = String::from_utf8(silo.stdout).expect("text");
    let scene = format!(
        "{silo}\n[[schedule]]\ntime = 2e-5\nset = {{ contrast = 500 }}\n\n\
         [[schedule]]\ntime = 8e-5\nset = {{ contrast = 100 }}\n"
    );
    let explorer = Explorer::beside(
        &[("mine.toml", &scene)],
        &["mine.toml", "--set", "accuracy.cells=2", "--paused"],
    );
    while explorer.state()["run"]["time"].as_f64() < Some(4e-5) {
        explorer.steps(1);
    }
    explorer.set("alpha", "3");
    while explorer.state()["run"]["time"].as_f64() < Some(1e-4) {
        explorer.steps(1);
    }
    let state = explorer.state();
    let labels: Vec<_> = state["run"]["changes"].as_array().expect("a list").iter().collect();
    let labels: Vec<_> = labels.iter().map(|c| c["label"].as_str().expect("text")).collect();
    assert_eq!(labels, ["contrast = 500", "alpha = 3", "contrast = 100"]);
    explorer.repeats_headless("kept");
}

#[test]
fn the_effect_of_a_change_is_stated_before_and_after() {
    let explorer = Explorer::open(&SMALL);
    explorer.steps(2);
    for (key, value, says) in [
        ("alpha", "0.5", "takes effect with step 3"),
        ("alpha", "0", "restarts: it changes the set of solved effects"),
        ("accuracy.cells", "3", "restarts: it changes the mesh"),
        ("aperture", "1.1", "restarts: it changes the mesh"),
        ("fill_height", "6", "restarts: it changes the initial regions"),
        ("accuracy.tolerance", "1e-8", "restarts: it changes the accuracy"),
        ("time.end", "5e-3", "restarts: it changes the times of the run"),
        ("boundaries.top.kind", "open", "restarts: it changes the boundaries"),
    ] {
        let answer = explorer.ask(json!({ "do": "ask", "key": key, "value": value }));
        assert_eq!(answer["message"], json!(says), "{key}");
        assert_eq!(answer["restarts"], json!(says.starts_with("restarts")), "{key}");
    }
    assert_eq!(explorer.state()["run"]["step"], json!(2), "a question changed the run");
    for (key, value, says) in [
        ("alpha", "-1", "min"),
        ("alpha", "much", "unknown name"),
        ("alpah", "1", "there is no parameter"),
        ("alpha", "", "no value"),
        ("", "1", "not a key"),
        ("schema", "7", "schema"),
    ] {
        let answer = explorer.ask(set(key, value));
        assert_eq!(answer["accepted"], json!(false), "{key}: {answer}");
        let all = answer.to_string();
        assert!(all.contains(says), "{key}: {all}");
        assert!(answer["remedy"].is_string(), "{key}: {all}");
    }
    assert_eq!(explorer.state()["run"]["step"], json!(2), "a refused command changed the run");
    let said = explorer.set("alpha", "0");
    assert_eq!(said, "alpha = 0; restarted: it changes the set of solved effects");
    let state = explorer.state();
    assert_eq!(state["run"]["step"], json!(0));
    assert_eq!(state["mode"], json!("paused"));
    let rotation = state["effects"].as_array().expect("a list").iter();
    let rotation = rotation.clone().find(|e| e["name"] == json!("Cosserat rotation"));
    assert_eq!(rotation.expect("told")["solved"], json!(false));
    // The switch offers the previous value.
    let switch = state["switches"][0].clone();
    assert_eq!((&switch["key"], &switch["on"]), (&json!("alpha"), &json!(false)));
    explorer.set("alpha", switch["other"].as_str().expect("text"));
    assert_eq!(explorer.state()["switches"][0]["on"], json!(true));
}

#[test]
fn more_internal_length_slows_the_discharge() {
    let explorer = Explorer::open(&SMALL);
    let rate = || explorer.state()["run"]["readings"][0]["value"].as_f64().expect("a number");
    explorer.steps(2);
    let before = rate();
    explorer.set("alpha", "1");
    explorer.steps(1);
    assert!(rate() < 0.99 * before, "{before} {}", rate());
}

#[test]
fn run_pause_step_stop_and_restart() {
    let explorer = Explorer::open(&SMALL);
    assert_eq!(explorer.state()["mode"], json!("paused"));
    assert_eq!(explorer.tell(json!({ "do": "step" })), "step 1");
    explorer.tell(json!({ "do": "run" }));
    explorer.wait_for("step 4", |s| s["run"]["step"].as_u64() >= Some(4));
    explorer.tell(json!({ "do": "pause" }));
    let step = explorer.state()["run"]["step"].clone();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(explorer.state()["run"]["step"], step, "a paused run took steps");
    explorer.tell(json!({ "do": "stop" }));
    assert_eq!(explorer.state()["mode"], json!("stopped"));
    assert_eq!(explorer.ask(json!({ "do": "step" }))["accepted"], json!(false));
    let id = explorer.state()["run"]["id"].clone();
    explorer.tell(json!({ "do": "restart" }));
    explorer.wait_for("a new run", |s| s["run"]["id"] != id && s["mode"] != json!("stopped"));
}

#[test]
fn pins_keep_earlier_runs() {
    let explorer = Explorer::open(&SMALL);
    explorer.steps(3);
    explorer.tell(json!({ "do": "pin", "name": "soft" }));
    let again = explorer.ask(json!({ "do": "pin", "name": "soft" }));
    assert_eq!(again["accepted"], json!(false));
    let before = explorer.state()["stream"].clone();
    explorer.set("alpha", "0");
    let state = explorer.state();
    assert_ne!(state["stream"], before, "the recording is the same");
    let pin = state["pins"][0].clone();
    assert_eq!((&pin["name"], &pin["steps"]), (&json!("soft"), &json!(3)));
    let curves = explorer.get(&format!("api/curves?run={}&from=1", pin["id"])).json();
    assert_eq!(curves["points"].as_array().map(Vec::len), Some(3));
    assert_eq!(
        curves["points"][0].as_array().map(Vec::len),
        curves["columns"].as_array().map(Vec::len)
    );
    explorer.tell(json!({ "do": "unpin", "name": "soft" }));
    assert_eq!(explorer.state()["pins"], json!([]));
    assert_eq!(explorer.get(&format!("api/curves?run={}", pin["id"])).code, 404);
}

#[test]
fn saved_files_can_be_fetched_and_nothing_else() {
    let explorer = Explorer::open(&SMALL);
    explorer.steps(2);
    explorer.tell(json!({ "do": "save", "name": "kept" }));
    explorer.tell(json!({ "do": "save", "name": "kept" }));
    let saved = explorer.state()["saved"].clone();
    assert_eq!((&saved[0]["name"], &saved[1]["name"]), (&json!("kept-2"), &json!("kept")));
    let recording = explorer.get("api/saved/kept/recording.rrd");
    assert_eq!((recording.code, recording.body.get(..3)), (200, Some(b"RRF".as_slice())));
    for name in ["scene.toml", "series.csv", "summary.json", "outflow.svg", "diagnostics.png"] {
        let file = explorer.get(&format!("api/saved/kept/{name}"));
        let there = std::fs::read(explorer.path("runs/kept").join(name)).expect("a file");
        assert_eq!((file.code, file.body), (200, there), "{name}");
    }
    for path in [
        "api/saved/kept/..%2f..%2fmine.toml",
        "api/saved/../../../etc/passwd",
        "api/saved/%2e%2e/%2e%2e",
        "api/saved/kept/%2fetc%2fpasswd",
        "api/saved/other/scene.toml",
        "../../../../etc/passwd",
    ] {
        let code = explorer.get(path).code;
        assert!(code == 404 || code == 403 || code == 400, "{path}: {code}");
    }
    for name in ["../up", "/tmp/up", "a/b", "", "..", "con fusion"] {
        let answer = explorer.ask(json!({ "do": "save", "name": name }));
        assert_eq!(answer["accepted"], json!(false), "{name}");
    }
    for scene in ["../secret.toml", "file:../secret.toml", "/etc/passwd", "file:/etc/passwd"] {
        let answer = explorer.ask(json!({ "do": "load", "scene": scene }));
        assert_eq!(answer["accepted"], json!(false), "{scene}");
        assert!(!answer.to_string().contains("root:"), "{answer}");
    }
}

#[test]
fn strangers_are_refused() {
    let explorer = Explorer::open(&SMALL);
    let (port, page) = (explorer.port(), explorer.below(""));
    let state = explorer.below("api/state");
    let code = |path: &str, headers: &[(&str, &str)]| request(port, "GET", path, headers, b"").code;
    assert_eq!(code(&page, &[]), 200);
    assert_eq!(code(&page, &[("Host", &format!("localhost:{port}"))]), 200);
    let own = format!("http://127.0.0.1:{port}");
    assert_eq!(code(&state, &[("Origin", &own)]), 200);
    // Without the token, or with half of it.
    for path in ["/", "/api/state", "/0123456789abcdef0123456789abcdef/api/state", &state[2..]] {
        let path = if path.starts_with('/') { path.to_string() } else { format!("/{path}") };
        assert_eq!(code(&path, &[]), 403, "{path}");
    }
    // Foreign host names that may resolve to this machine, and origins of other sites.
    for host in ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1.evil.example", ""] {
        assert_eq!(code(&state, &[("Host", host)]), 403, "{host}");
    }
    for origin in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"] {
        assert_eq!(code(&state, &[("Origin", origin)]), 403, "{origin}");
    }
    let post = |headers: &[(&str, &str)], body: &[u8]| {
        request(port, "POST", &explorer.below("api/command"), headers, body).code
    };
    let json = ("Content-Type", "application/json");
    let run = br#"{"do":"run"}"#;
    assert_eq!(post(&[json, ("Origin", "http://evil.example")], run), 403);
    assert_eq!(post(&[("Content-Type", "text/plain")], run), 415);
    assert_eq!(post(&[], run), 415);
    assert_eq!(post(&[json], b"{"), 400);
    assert_eq!(post(&[json], br#"{"do":"exec","path":"/bin/sh"}"#), 400);
    assert_eq!(post(&[json], &vec![b' '; 1 << 20]), 413);
    assert_eq!(explorer.state()["mode"], json!("paused"), "a refused command changed the run");
    let long = "x".repeat(1 << 20);
    let refused = code(&state, &[("X-Long", &long)]);
    assert_eq!(refused, 431);
    assert_eq!(code(&page, &[]), 200, "the server no longer answers");
    let head = request(port, "GET", &page, &[], b"").head.to_ascii_lowercase();
    for header in ["content-security-policy: default-src 'none'", "x-content-type-options: nosniff"]
    {
        assert!(head.contains(header), "{head}");
    }
}

/// Clients that send an incomplete request are disconnected and do not block others.
#[test]
fn clients_that_take_too_long_are_cut_off() {
    let explorer = Explorer::open(&SMALL);
    let (port, page) = (explorer.port(), explorer.below(""));
    let command = explorer.below("api/command");
    let body = format!(
        "POST {command} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: application/json\r\n\
         Content-Length: 100\r\n\r\n{{"
    );
    let slow: Vec<TcpStream> = ["GET / HTT", &body]
        .iter()
        .map(|said| {
            let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
            stream.write_all(said.as_bytes()).expect("sent");
            stream.set_read_timeout(Some(Duration::from_secs(30))).expect("a timeout");
            stream
        })
        .collect();
    assert_eq!(request(port, "GET", &page, &[], b"").code, 200, "slow clients block others");
    for mut stream in slow {
        let mut answer = Vec::new();
        // The server closes the connection, with or without an answer, before the timeout.
        stream.read_to_end(&mut answer).expect("an end");
        let answer = String::from_utf8_lossy(&answer);
        assert!(answer.is_empty() || answer.contains(" 408 "), "{answer}");
    }
}

#[test]
fn errors_of_a_scene_are_located_and_the_run_is_kept() {
    let explorer = Explorer::beside(
        &[
            ("broken.toml", "schema = 1\nname = \"broken\"\ngravty = [0, -10]\n"),
            ("notes.toml", "a = 1\n"),
        ],
        &SMALL,
    );
    explorer.steps(1);
    let scenes = explorer.state()["scenes"].to_string();
    assert!(scenes.contains("file:broken.toml"), "{scenes}");
    assert!(!scenes.contains("notes.toml"), "{scenes}");
    let answer = explorer.ask(json!({ "do": "load", "scene": "file:broken.toml" }));
    assert_eq!(answer["accepted"], json!(false));
    let state = explorer.state();
    let fault = state["problem"]["faults"][0].clone();
    assert!(fault["message"].as_str().expect("text").contains("broken.toml:3"), "{fault}");
    assert_eq!(fault["line"], json!([3, "gravty = [0, -10]"]));
    assert!(fault["remedy"].as_str().expect("text").contains("gravity"), "{fault}");
    assert_eq!((&state["title"], &state["run"]["step"]), (&json!("silo"), &json!(1)));
    // After a correction the scene can be loaded.
    let scene = program().args(["presets", "show", "solcx"]).output().expect("starts").stdout;
    std::fs::write(explorer.path("broken.toml"), scene).expect("written");
    explorer.tell(json!({ "do": "load", "scene": "file:broken.toml" }));
    let state = explorer.state();
    assert_eq!((&state["title"], &state["problem"]), (&json!("solcx"), &Value::Null));
}

#[test]
fn starts_with_an_invalid_scene_and_without_a_run() {
    let broken = [("broken.toml", "schema = 1\nname = 3\n")];
    let explorer = Explorer::beside(&broken, &["broken.toml"]);
    let state = explorer.state();
    assert_eq!(state["mode"], json!("empty"));
    assert!(state["problem"].to_string().contains("broken.toml:2"), "{state}");
    assert_eq!(explorer.ask(json!({ "do": "step" }))["accepted"], json!(false));
    explorer.tell(json!({ "do": "load", "scene": "preset:solcx" }));
    assert_eq!(explorer.state()["title"], json!("solcx"));
}

#[test]
fn quits_when_asked() {
    let mut explorer = Explorer::open(&SMALL);
    explorer.tell(json!({ "do": "quit" }));
    let clock = Instant::now();
    loop {
        if let Some(status) = explorer.child.try_wait().expect("known") {
            assert!(status.success());
            break;
        }
        assert!(clock.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_taken_port_and_an_unknown_scene_are_refused() {
    let explorer = Explorer::open(&SMALL);
    let port = explorer.port().to_string();
    let said = explorer.grainscope(&["explore", "silo", "--port", &port]);
    assert_eq!(said.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&said.stderr).contains("0 takes any free port"));
    let said = explorer.grainscope(&["explore", "silos"]);
    assert_eq!(said.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&said.stderr).contains("did you mean `silo`"));
}

/// Strangers that hold connections open do not keep the page from its user.
#[test]
fn silent_strangers_do_not_block_the_page() {
    let explorer = Explorer::open(&SMALL);
    let (port, page) = (explorer.port(), explorer.below(""));
    let silent: Vec<TcpStream> =
        (0..400).map(|_| TcpStream::connect(("127.0.0.1", port)).expect("a connection")).collect();
    for _ in 0..3 {
        let clock = Instant::now();
        assert_eq!(request(port, "GET", &page, &[], b"").code, 200);
        assert!(clock.elapsed() < Duration::from_secs(1), "{:?}", clock.elapsed());
    }
    drop(silent);
}

/// The data of the recording are private.
#[test]
fn the_stream_of_the_viewer_is_guarded() {
    let explorer = Explorer::open(&SMALL);
    let stream = explorer.wait_for("a stream", |s| !s["stream"].is_null())["stream"]["url"].clone();
    let url = stream.as_str().expect("text").trim_start_matches("http://127.0.0.1:");
    let (port, path) = url.split_once('/').expect("a path");
    let (port, path): (u16, _) = (port.parse().expect("a port"), format!("/{path}"));
    let refused = |path: &str, headers: &[(&str, &str)]| {
        assert_eq!(request(port, "GET", path, headers, b"").code, 403, "{path} {headers:?}");
    };
    refused(&path, &[("Host", "evil.example")]);
    refused(&path, &[("Origin", "http://localhost:1")]);
    refused("/stream/1.rrd", &[]);
    assert_eq!(request(port, "POST", &path, &[], b"x").code, 405);
    // The page of the other port may read it.
    let origin = format!("http://127.0.0.1:{}", explorer.port());
    let mut client = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
    client.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
    write!(client, "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: {origin}\r\n\r\n")
        .expect("sent");
    let (mut bytes, mut part) = (vec![], [0; 1 << 14]);
    while !bytes.windows(4).any(|w| w == b"RRF2") {
        let n = client.read(&mut part).expect("data");
        assert!(n > 0, "the stream ended");
        bytes.extend(&part[..n]);
    }
    let head = String::from_utf8_lossy(&bytes).to_ascii_lowercase();
    assert!(head.contains(&format!("access-control-allow-origin: {origin}")), "{head}");
}

/// Numbers of threads and of kilobytes of a process.
#[cfg(target_os = "linux")]
fn size_of(process: u32) -> (u64, u64) {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).expect("a status");
    let number = |key: &str| -> u64 {
        let line = text.lines().find(|l| l.starts_with(key)).expect("a line");
        line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number")
    };
    (number("Threads:"), number("VmRSS:"))
}

/// Restarts, pins and loaded scenes leave no threads and no memory behind.
#[cfg(target_os = "linux")]
#[test]
fn what_was_replaced_is_freed() {
    let tiny = ["couette_cosserat", "--paused", "--set", "accuracy.cells=4"];
    let explorer = Explorer::open(&tiny);
    let round = |times: usize| {
        for _ in 0..times {
            explorer.tell(json!({ "do": "restart" }));
            explorer.tell(json!({ "do": "pin", "name": "kept" }));
            let pins = explorer.state()["pins"].clone();
            let name = pins[0]["name"].as_str().expect("a pin").to_string();
            explorer.tell(json!({ "do": "unpin", "name": name }));
        }
        // Replaced recordings are served for some seconds.
        std::thread::sleep(Duration::from_secs(6));
        explorer.tell(json!({ "do": "restart" }));
        std::thread::sleep(Duration::from_secs(1));
        size_of(explorer.child.id())
    };
    let (threads, memory) = round(50);
    let (threads_later, memory_later) = round(200);
    assert!(threads_later <= threads + 8, "{threads} threads, then {threads_later}");
    assert!(memory_later < memory + 40_000, "{memory} kB, then {memory_later} kB");
}

/// Values that would need more than the machine has are refused, and the run goes on.
#[test]
fn values_that_are_too_large_are_refused() {
    let explorer = Explorer::open(&SMALL);
    for (key, value) in [
        ("recording.frames", "4294967295"),
        ("accuracy.cells", "4294967295"),
        ("accuracy.particles_per_cell", "4294967295"),
        ("recording.glyphs", "4294967295"),
        ("recording.frames", "1e300"),
        ("dye.grid.spacing", "1e-12"),
    ] {
        for verb in ["ask", "set"] {
            let answer = explorer.ask(json!({ "do": verb, "key": key, "value": value }));
            assert_eq!(answer["accepted"], json!(false), "{key} = {value}: {answer}");
        }
    }
    explorer.steps(1);
    assert_eq!(explorer.state()["run"]["step"], json!(1));
}
