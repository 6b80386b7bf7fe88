//! Tests of the explorer over HTTP, and in a browser if one is installed.

mod api;
mod browser;
mod http;
mod webdriver;

use grainscope::internals::TempFolder;
use http::Reply;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Longest time to wait for anything; test machines may be slow.
const PATIENCE: Duration = Duration::from_secs(180);

/// An explorer running in a temporary folder; both are removed when dropped.
struct Explorer {
    folder: TempFolder,
    child: Child,
    url: String,
}

impl Drop for Explorer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Explorer {
    /// Starts an explorer.
    fn open(arguments: &[&str]) -> Explorer {
        Self::beside(&[], arguments)
    }

    /// Starts an explorer with files in its folder.
    fn beside(files: &[(&str, &str)], arguments: &[&str]) -> Explorer {
        let folder = TempFolder::new().expect("a folder");
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).expect("a file");
        }
        let mut child = program()
            .arg("explore")
            .args(arguments)
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        let out = child.stdout.take().expect("piped");
        BufReader::new(out).read_line(&mut line).expect("a line");
        let url = line.trim().to_string();
        assert!(url.starts_with("http://127.0.0.1:"), "{url:?}");
        let explorer = Explorer { folder, child, url };
        explorer.wait_for("a run or a problem", |s| !s["run"].is_null() || !s["problem"].is_null());
        explorer
    }

    /// Path of a file in the folder.
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Port of the server.
    fn port(&self) -> u16 {
        let rest = self.url.trim_start_matches("http://127.0.0.1:");
        rest.split('/').next().and_then(|p| p.parse().ok()).expect("a port")
    }

    /// The URL path `/<token>/` followed by `path`.
    fn below(&self, path: &str) -> String {
        let token = self.url.trim_end_matches('/').rsplit('/').next().expect("a token");
        format!("/{token}/{path}")
    }

    /// Sends a GET request.
    fn get(&self, path: &str) -> Reply {
        http::request(self.port(), "GET", &self.below(path), &[], b"")
    }

    /// State of the session.
    fn state(&self) -> Value {
        self.get("api/state").json()
    }

    /// Sends a command and returns the answer.
    fn ask(&self, command: Value) -> Value {
        let body = command.to_string();
        let kind = [("Content-Type", "application/json")];
        http::request(self.port(), "POST", &self.below("api/command"), &kind, body.as_bytes())
            .json()
    }

    /// Sends a command that must be accepted, and returns the message.
    #[track_caller]
    fn tell(&self, command: Value) -> String {
        let answer = self.ask(command.clone());
        assert_eq!(answer["accepted"], json!(true), "{command}: {answer}");
        answer["message"].as_str().expect("a message").into()
    }

    /// Sets a key of the scene, and returns the message.
    #[track_caller]
    fn set(&self, key: &str, value: &str) -> String {
        self.tell(json!({ "do": "set", "key": key, "value": value }))
    }

    /// Takes `n` steps.
    fn steps(&self, n: usize) {
        for _ in 0..n {
            self.tell(json!({ "do": "step" }));
        }
    }

    /// Waits until the state satisfies a condition, and returns the state.
    #[track_caller]
    fn wait_for(&self, what: &str, done: impl Fn(&Value) -> bool) -> Value {
        let clock = Instant::now();
        loop {
            let state = self.state();
            if done(&state) {
                return state;
            }
            assert!(clock.elapsed() < PATIENCE, "no {what} in {state}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Runs the program in the explorer's folder.
    fn grainscope(&self, arguments: &[&str]) -> Output {
        program().args(arguments).current_dir(self.folder.path()).output().expect("starts")
    }

    /// Saves the run, repeats it without the explorer, and compares the final states.
    #[track_caller]
    fn repeats_headless(&self, name: &str) {
        self.tell(json!({ "do": "save", "name": name }));
        let saved = self.state()["saved"][0].clone();
        assert_eq!(saved["name"], json!(name));
        let (scene, steps) = (format!("runs/{name}/scene.toml"), saved["steps"].to_string());
        let run = ["run", &scene, "--steps", &steps, "--no-recording", "--out", "again", "--force"];
        let again = self.grainscope(&run);
        let error = String::from_utf8_lossy(&again.stderr);
        assert!(again.status.success(), "{error}");
        let read = |path: &str| -> Value {
            let text = std::fs::read_to_string(self.path(path)).expect("a summary");
            serde_json::from_str(&text).expect("JSON")
        };
        let (here, there) =
            (read(&format!("runs/{name}/summary.json")), read("again/summary.json"));
        assert_eq!(here["state_hash"], saved["state_hash"]);
        for key in ["state_hash", "scene_hash", "steps", "time", "gauges", "max_speed"] {
            assert_eq!(here[key], there[key], "{key} of {scene}");
        }
    }
}

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grainscope"));
    command.env("NO_COLOR", "1");
    command
}
