//! Controls a browser over WebDriver, if chromedriver and Chromium are installed.

use super::http;
use super::{PATIENCE, TempFolder};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// JSON key of element ids in WebDriver.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";

/// WebDriver code of the Enter key.
pub const ENTER: &str = "\u{e007}";
/// WebDriver code of the Tab key.
pub const TAB: &str = "\u{e004}";
/// WebDriver code of the right arrow key.
pub const RIGHT: &str = "\u{e014}";

/// Browsers need much computing time, so that tests take turns with them.
static TURN: Mutex<()> = Mutex::new(());

/// A browser session.
pub struct Browser {
    _turn: MutexGuard<'static, ()>,
    driver: Child,
    port: u16,
    session: String,
    _profile: TempFolder,
}

impl Drop for Browser {
    fn drop(&mut self) {
        http::request(self.port, "DELETE", &format!("/session/{}", self.session), &[], b"");
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// An element of a page.
pub struct Element<'a> {
    browser: &'a Browser,
    id: String,
}

impl Browser {
    /// Starts a browser with a page of the given size. If that is impossible, it prints a message and
    /// returns `None`, and fails in CI.
    pub fn start([width, height]: [u32; 2], dark: bool) -> Option<Browser> {
        let skipped = |why: &str| {
            let message = format!("{why}; install chromium and chromium-driver to test the page");
            assert!(std::env::var("CI").as_deref() != Ok("true"), "{message}");
            eprintln!("SKIPPED: {message}");
            None
        };
        let name = std::env::var("CHROMEDRIVER").unwrap_or("chromedriver".into());
        let driver =
            Command::new(name).arg("--port=0").stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let Ok(mut driver) = driver else { return skipped("there is no chromedriver") };
        let out = driver.stdout.take().expect("piped");
        let port = BufReader::new(out).lines().map_while(Result::ok).find_map(|line| {
            line.split_once("successfully on port ")?.1.trim_end_matches('.').parse().ok()
        });
        let Some(port) = port else { return skipped("chromedriver does not start") };
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let profile = TempFolder::new().expect("a folder");
        let mut arguments = vec![
            "--headless=new".to_string(),
            "--no-sandbox".into(),
            "--use-gl=angle".into(),
            "--use-angle=swiftshader".into(),
            "--enable-unsafe-swiftshader".into(),
            "--disable-background-networking".into(),
            "--disable-component-update".into(),
            "--disable-sync".into(),
            "--no-first-run".into(),
            "--hide-scrollbars".into(),
            format!("--window-size={width},{height}"),
            format!("--user-data-dir={}", profile.path().display()),
        ];
        if dark {
            arguments.push("--blink-settings=preferredColorScheme=0".into());
        }
        let wanted = json!({ "capabilities": { "alwaysMatch": {
            "goog:chromeOptions": { "args": arguments },
            "unhandledPromptBehavior": "accept",
        } } });
        let reply = http::request(port, "POST", "/session", &[], wanted.to_string().as_bytes());
        let Some(session) = reply.json()["value"]["sessionId"].as_str().map(String::from) else {
            let _ = driver.kill();
            return skipped(&format!("no browser can be started: {}", reply.text()));
        };
        let browser = Browser { _turn: turn, driver, port, session, _profile: profile };
        // Rendering without a graphics card delays scripts.
        let most = PATIENCE.as_millis() as u64;
        browser.command("POST", "/timeouts", json!({ "script": most, "pageLoad": most }));
        // The window is enlarged by its frame, so that the page has the requested size.
        let size = browser.script("return [innerWidth, innerHeight]", &[]);
        let lack = |k: usize, wanted: u32| {
            u64::from(wanted) - size[k].as_u64().unwrap_or(0).min(u64::from(wanted))
        };
        let (dx, dy) = (lack(0, width), lack(1, height));
        let rect = json!({ "width": u64::from(width) + dx, "height": u64::from(height) + dy });
        browser.command("POST", "/window/rect", rect);
        Some(browser)
    }

    /// Sends a WebDriver command, and returns the value.
    #[track_caller]
    fn command(&self, method: &str, path: &str, body: Value) -> Value {
        let path = format!("/session/{}{path}", self.session);
        let text = if method == "GET" { String::new() } else { body.to_string() };
        let reply = http::request(self.port, method, &path, &[], text.as_bytes());
        let value = reply.json()["value"].clone();
        assert!(value["error"].is_null(), "{path}: {value}");
        value
    }

    /// Opens a URL.
    pub fn go(&self, url: &str) {
        self.command("POST", "/url", json!({ "url": url }));
    }

    /// Runs a script in the page, and returns its value.
    #[track_caller]
    pub fn script(&self, script: &str, arguments: &[Value]) -> Value {
        self.command("POST", "/execute/sync", json!({ "script": script, "args": arguments }))
    }

    /// Sets the size of the page (CSS pixels); narrow pages are those of phones.
    #[track_caller]
    pub fn resize(&self, [width, height]: [u32; 2]) {
        let phone = width < 500;
        let params =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone });
        let order = json!({ "cmd": "Emulation.setDeviceMetricsOverride", "params": params });
        self.command("POST", "/goog/cdp/execute", order);
    }

    /// Checks the accessibility of the page with axe-core, and that nothing is wider than it.
    #[track_caller]
    pub fn is_accessible(&self, what: &str) {
        self.script(include_str!("axe/axe.min.js"), &[]);
        let script = "const done = arguments[0]; axe.run(document, { resultTypes: ['violations'], \
            rules: { 'region': { enabled: false } } }).then((r) => done(r.violations.map((v) => \
            [v.id, v.help, v.nodes.slice(0, 3).map((n) => n.html.slice(0, 160))])), (e) => done(String(e)))";
        let faults = self.later(script, &[]);
        assert_eq!(faults, json!([]), "{what}");
        let wide = self.script("return [document.documentElement.scrollWidth, innerWidth]", &[]);
        let [needed, width] = [0, 1].map(|k| wide[k].as_u64().expect("a width"));
        assert!(needed <= width, "{what}: {needed} pixels of {width}");
    }

    /// Runs a script that returns its value by calling its last argument.
    #[track_caller]
    pub fn later(&self, script: &str, arguments: &[Value]) -> Value {
        self.command("POST", "/execute/async", json!({ "script": script, "args": arguments }))
    }

    /// The first element that matches a CSS selector.
    #[track_caller]
    pub fn find(&self, css: &str) -> Element<'_> {
        let found =
            self.command("POST", "/element", json!({ "using": "css selector", "value": css }));
        let id = found[ELEMENT].as_str().expect("an element").into();
        Element { browser: self, id }
    }

    /// Types into the element that has the focus.
    pub fn press(&self, keys: &str) {
        let actions: Vec<Value> = keys
            .chars()
            .flat_map(|k| {
                ["keyDown", "keyUp"].map(|t| json!({ "type": t, "value": k.to_string() }))
            })
            .collect();
        let body = json!({ "actions": [{ "type": "key", "id": "keys", "actions": actions }] });
        self.command("POST", "/actions", body);
    }

    /// Visible text of an element; empty if there is none.
    pub fn text(&self, css: &str) -> String {
        let script = "const e = document.querySelector(arguments[0]); return e ? e.innerText : ''";
        self.script(script, &[json!(css)]).as_str().unwrap_or_default().into()
    }

    /// Waits until a JavaScript condition holds, and returns its value.
    #[track_caller]
    pub fn wait_for(&self, what: &str, condition: &str) -> Value {
        let clock = Instant::now();
        loop {
            // Parts of the page may be missing while it loads or restarts.
            let script = format!(
                "try {{ return {condition} }} catch (e) {{ return {{ missing: String(e) }} }}"
            );
            let value = self.script(&script, &[]);
            if value != json!(false) && !value.is_null() && value["missing"].is_null() {
                return value;
            }
            if clock.elapsed() > PATIENCE {
                let focus =
                    self.script("return document.activeElement.outerHTML.slice(0, 80)", &[]);
                let page = self.text("main");
                panic!("no {what}: {condition} is {value}; focus on {focus}\n{page}");
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Opens a page in a new tab, switches to it, and returns its handle.
    pub fn open_window(&self, url: &str) -> String {
        let window = self.command("POST", "/window/new", json!({ "type": "tab" }));
        let handle = window["handle"].as_str().expect("a window").to_string();
        self.switch(&handle);
        self.go(url);
        handle
    }

    /// Handle of the current window.
    pub fn window(&self) -> String {
        self.command("GET", "/window", json!({})).as_str().expect("a window").into()
    }

    /// Switches to a window.
    pub fn switch(&self, window: &str) {
        self.command("POST", "/window", json!({ "handle": window }));
    }

    /// Closes the current window.
    pub fn close_window(&self) {
        self.command("DELETE", "/window", json!({}));
    }

    /// Screenshot of the page as PNG.
    pub fn snapshot(&self) -> Vec<u8> {
        decoded(self.command("GET", "/screenshot", json!({})).as_str().unwrap_or_default())
    }

    /// Number of different colours of an element, and the shares of its pixels that are within a
    /// tenth of each wanted colour.
    pub fn colours(&self, css: &str, wanted: &[[u8; 3]]) -> (usize, Vec<f64>) {
        let path = format!("/element/{}/screenshot", self.find(css).id);
        let png = self.command("GET", &path, json!({}));
        let script = "const [png, wanted, done] = arguments; const image = new Image();
            image.onload = () => {
              const canvas = document.createElement('canvas');
              [canvas.width, canvas.height] = [image.width, image.height];
              const pen = canvas.getContext('2d'); pen.drawImage(image, 0, 0);
              const data = pen.getImageData(0, 0, image.width, image.height).data;
              const all = new Set(), counts = wanted.map(() => 0);
              for (let k = 0; k < data.length; k += 4) {
                all.add((data[k] << 16) | (data[k + 1] << 8) | data[k + 2]);
                wanted.forEach((w, i) => {
                  if ([0, 1, 2].every((c) => Math.abs(data[k + c] - w[c]) < 26)) counts[i]++;
                });
              }
              done([all.size, counts.map((n) => 4 * n / data.length)]);
            };
            image.src = 'data:image/png;base64,' + png;";
        let found = self.later(script, &[png, json!(wanted)]);
        let shares = found[1].as_array().expect("shares").iter();
        let count = found[0].as_u64().unwrap_or(0);
        (count as usize, shares.map(|s| s.as_f64().unwrap_or(0.0)).collect())
    }
}

impl Element<'_> {
    /// Clicks the element.
    #[track_caller]
    pub fn click(&self) {
        self.browser.command("POST", &format!("/element/{}/click", self.id), json!({}));
    }

    /// Clears the text of an input element.
    #[track_caller]
    pub fn clear(&self) {
        self.browser.command("POST", &format!("/element/{}/clear", self.id), json!({}));
    }

    /// Types text into the element.
    #[track_caller]
    pub fn write(&self, text: &str) {
        let path = format!("/element/{}/value", self.id);
        self.browser.command("POST", &path, json!({ "text": text }));
    }
}

/// Decodes base64.
fn decoded(base64: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u8> = base64.bytes().filter(|c| *c != b'=').map(digit).collect();
    let mut out = vec![];
    for four in digits.chunks(4) {
        let bits =
            four.iter().fold(0u32, |all, d| all << 6 | u32::from(*d)) << (6 * (4 - four.len()));
        out.extend(&bits.to_be_bytes()[1..four.len()]);
    }
    out
}
