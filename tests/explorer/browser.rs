//! Tests of the page in a browser.

use super::Explorer;
use super::webdriver::{Browser, ENTER, RIGHT, TAB};
use serde_json::json;
use std::path::Path;

/// A run long enough for browsers that render without a graphics card.
const SMALL: [&str; 6] = ["silo", "--set", "accuracy.cells=2", "--set", "time.end=1", "--paused"];
/// Colour of the grains.
const GRAINS: [u8; 3] = [230, 159, 0];
/// JavaScript expression of the step that the page shows.
const STEP: &str = "Number(document.querySelector('#numbers dd').textContent)";

/// Outflow rate that the page shows.
fn rate(browser: &Browser) -> f64 {
    let text = browser.text("#numbers");
    let after = text.split("outflow rate").nth(1).expect("a rate");
    let number = after.split_whitespace().next().expect("a number");
    number.parse().unwrap_or_else(|_| panic!("{number} in {text}"))
}

/// Replaces the text of an input element.
fn type_into(browser: &Browser, css: &str, text: &str) {
    let field = browser.find(css);
    field.clear();
    field.write(text);
}

/// Waits until the viewer shows the current recording of the session.
fn viewer_shows(browser: &Browser) {
    browser.wait_for(
        "picture",
        "state && state.stream && document.body.dataset.showing === state.stream.recording",
    );
}

#[test]
fn a_first_session() {
    let Some(browser) = Browser::start([1280, 720], false) else { return };
    let broken = "schema = 1\nname = \"broken\"\ngravty = [0, -10]\n";
    let explorer = Explorer::beside(&[("broken.toml", broken)], &SMALL);
    browser.go(&explorer.url);

    // The page draws the flow itself; two steps are taken with the keyboard.
    browser.wait_for("flow", "light.shown !== null");
    browser.wait_for("knobs", "state.knobs.length > 0");
    for step in 1..=2 {
        browser.press("s");
        browser.wait_for("step", &format!("{STEP} === {step}"));
    }

    // A larger internal length reduces the outflow. The page states the effect of the change before
    // it is made.
    let before = rate(&browser);
    type_into(&browser, "#knob-alpha", "2");
    browser.wait_for(
        "forecast",
        "document.querySelector('[data-knob=alpha] .says').textContent.startsWith('takes effect')",
    );
    browser.find("#knob-alpha").write(ENTER);
    browser.wait_for("change", "state.run.changes.length === 1");
    browser.find("#step").click();
    browser.wait_for("step", &format!("{STEP} === 3"));
    let after = rate(&browser);
    assert!(after < 0.97 * before, "{before} {after}");

    // The run starts and pauses; the Rerun viewer is chosen and draws the flow.
    browser.script("document.activeElement.blur()", &[]);
    browser.press(" ");
    browser.wait_for("sixth step", &format!("{STEP} >= 6"));
    browser.wait_for("curves", "document.querySelectorAll('#plots path.curve').length === 3");
    browser.press(" ");
    browser.wait_for("pause", "state.mode === 'paused'");
    browser.find("#view-rerun").click();
    viewer_shows(&browser);
    let clock = std::time::Instant::now();
    loop {
        let (colours, shares) = browser.colours("#viewer", &[GRAINS]);
        if colours > 100 && shares[0] > 0.005 {
            break;
        }
        assert!(clock.elapsed() < super::PATIENCE, "{colours} colours, {shares:?} grains");
    }

    // The run is pinned. Switching rotation off starts a second run beside it.
    type_into(&browser, "#pin-name", "stiff");
    browser.find("#pin button").click();
    browser.wait_for("pin", "state.pins.length === 1");
    assert!(browser.text("#pins").contains("stiff"));
    browser.find("[data-effect='Cosserat rotation']").click();
    browser.wait_for("restart", &format!("{STEP} === 0 && !state.switches[0].on"));
    assert!(browser.text("#toast").contains("restarted"), "{}", browser.text("#toast"));
    browser.find("#run").click();
    browser.wait_for("third step", &format!("{STEP} >= 3"));
    viewer_shows(&browser);
    browser.wait_for(
        "second curve",
        "document.querySelectorAll('#plots .plot:first-child path.curve').length === 2",
    );

    // A scene with errors shows their location and a remedy; the run is kept.
    browser.script(
        "const s = document.getElementById('scene'); s.value = 'file:broken.toml'; s.onchange({ target: s })",
        &[],
    );
    browser.wait_for("problem", "!document.getElementById('problem').hidden");
    let problem = browser.text("#problem");
    for part in ["broken.toml:3", "gravty = [0, -10]", "did you mean `gravity`"] {
        assert!(problem.contains(part), "no {part:?} in {problem}");
    }
    assert_eq!(explorer.state()["title"], json!("silo"));

    // Another scene is loaded.
    browser.script(
        "const s = document.getElementById('scene'); s.value = 'preset:layer_stack'; s.onchange({ target: s })",
        &[],
    );
    browser.wait_for(
        "other scene",
        "state.title === 'layer_stack' && document.getElementById('problem').hidden",
    );
    viewer_shows(&browser);

    // The silo is loaded again and saved with a scene that reproduces it.
    browser.script(
        "const s = document.getElementById('scene'); s.value = 'preset:silo'; s.onchange({ target: s })",
        &[],
    );
    browser.wait_for("silo", "state.title === 'silo'");
    explorer.set("accuracy.cells", "2");
    explorer.tell(json!({ "do": "run" }));
    browser.wait_for("third step", &format!("state.run.cells[0] < 40 && {STEP} >= 3"));
    explorer.set("alpha", "1");
    browser.wait_for("sixth step", &format!("{STEP} >= 6"));
    type_into(&browser, "#save-name", "mine");
    browser.find("#save button").click();
    browser.wait_for("saved run", "state.saved.length === 1");
    assert!(browser.text("#saved").contains("recording.rrd"));
    explorer.repeats_headless("again-mine");
}

/// Expression of the number of recorded frames between the one shown and the latest.
const BEHIND: &str = "light.runs[0].steps.length - 1 - light.shown";

#[test]
fn the_light_view_follows_the_run() {
    let Some(browser) = Browser::start([1280, 720], false) else { return };
    let explorer = Explorer::open(&["silo", "--set", "accuracy.cells=3", "--paused"]);
    browser.go(&explorer.url);
    browser.wait_for("flow", "light.shown !== null");
    // The Rerun viewer is not loaded: this browser has no graphics card.
    assert_eq!(browser.script("return document.getElementById('viewer').src", &[]), json!(""));
    let (colours, shares) = browser.colours("#light canvas", &[GRAINS]);
    assert!(colours > 20 && shares[0] > 0.05, "{colours} colours, {shares:?} grains");
    // Each step is shown before the next one is taken.
    for frame in 1..=5 {
        explorer.tell(json!({ "do": "step" }));
        browser.wait_for("the frame of this step", &format!("light.shown === {frame}"));
    }
    // The picture moves while the run goes on, and ends at the last frame.
    explorer.tell(json!({ "do": "run" }));
    let mut shown = std::collections::BTreeSet::new();
    loop {
        let now = browser.script("return [light.shown, state.mode]", &[]);
        shown.insert(now[0].as_i64().expect("a number"));
        if now[1] != json!("running") && now[1] != json!("paused") {
            break;
        }
    }
    assert!(shown.len() > 5, "only the frames {shown:?} were shown");
    browser.wait_for("last frame", &format!("{BEHIND} === 0"));
    // An earlier frame is shown until the latest one is asked for.
    browser.script("light.slider.value = 3; light.slider.oninput()", &[]);
    browser.wait_for("fourth frame", "light.shown === 3");
    assert!(browser.text("#light .light-time").contains("ms"));
    // Fields are shown with a colour bar; the pointer reads values.
    browser.script("light.field.value = 'speed'; light.field.onchange()", &[]);
    browser.wait_for("field", "light.look.field === 'speed' && !light.busy");
    let (colours, _) = browser.colours("#light canvas", &[]);
    assert!(colours > 150, "{colours} colours");
    browser
        .script("light.hover(...light.panels[0].place.frame.slice(0, 2).map((v) => v + 50))", &[]);
    let tip = browser.text("#light .light-tip");
    assert!(tip.contains("speed") && tip.contains("m/s") && tip.contains("x "), "{tip}");
    browser.script("light.zoom(4, 400, 200); light.fit()", &[]);
    // Pinned runs are beside the run, at its time.
    explorer.tell(json!({ "do": "pin", "name": "before" }));
    browser.wait_for("pin", "light.panels.length === 2");
    assert_eq!(
        browser.script("return light.panels[0].time === light.panels[1].time", &[]),
        json!(true)
    );
}

#[test]
#[ignore = "measures the time of a picture"]
fn time_of_drawing_twenty_thousand_particles() {
    let Some(browser) = Browser::start([1280, 720], false) else { return };
    let explorer = Explorer::open(&["silo", "--paused"]);
    browser.go(&explorer.url);
    browser.wait_for("flow", "light.shown !== null");
    // The best of some rounds: the machine does other things, too.
    let script = "let best = Infinity; for (let n = 0; n < 12; n++) {
          const start = performance.now(); for (let k = 0; k < 5; k++) light.draw();
          light.surface.pen.getImageData(0, 0, 1, 1);
          best = Math.min(best, (performance.now() - start) / 5); }
        return [best, light.panels[0].frame.count]";
    let found = browser.script(script, &[]);
    println!(
        "a picture of {} particles is drawn in {:.1} ms",
        found[1],
        found[0].as_f64().expect("a time")
    );
}

#[test]
fn a_scene_is_written_run_and_saved_in_the_page() {
    let Some(browser) = Browser::start([1280, 720], false) else { return };
    let explorer = Explorer::open(&["silo", "--set", "accuracy.cells=2", "--paused"]);
    browser.go(&explorer.url);
    browser.wait_for("state", "state && state.knobs.length > 0");
    browser.find("#edit").click();
    browser.wait_for("draft", "scene.draft && scene.view.shown !== null");
    let typed = |from: &str, to: &str| {
        let script =
            "scene.editor.setText(scene.editor.text().replace(arguments[0], arguments[1]), true)";
        browser.script(script, &[json!(from), json!(to)]);
    };
    // An error is underlined while it is typed, with its line.
    typed("gravity", "gravty");
    browser.wait_for("fault", "document.querySelector('#editor .cm-lintRange-error')");
    assert!(browser.text("#editor-says").contains("did you mean `gravity`"));
    typed("gravty", "gravity");
    typed("cells = 6", "cells = 2");
    browser.wait_for(
        "no fault",
        "document.getElementById('editor-says').textContent.includes('unknowns')",
    );
    assert!(browser.text("#editor-says").contains("per step"));
    // A dragged outlet changes its numbers in the text; comments stay.
    let drag = "const at = (x) => scene.draft.handles.find((h) => h.name === 'outflow' && x);
        const handle = at(1); move(handle, [handle.points[0], [0.8, handle.points[1][1]]])";
    browser.script(drag, &[]);
    browser.wait_for("drag", "scene.editor.text().includes('to = [0.8, \"3*aperture\"]')");
    assert_eq!(
        browser.script("return scene.editor.text().startsWith('# Discharge')", &[]),
        json!(true)
    );
    browser.wait_for(
        "handle",
        "scene.draft.handles.find((h) => h.name === 'outflow').points[1][0] === 0.8",
    );
    // The outlet is made wider, run, and saved under a new name.
    typed("[parameters.aperture]\ndefault = 1", "[parameters.aperture]\ndefault = 1.25");
    browser.wait_for("wider", "scene.draft.description.domain[1][0] === 3.75");
    browser.find("#editor-run").click();
    browser.wait_for("run", "state.scene === 'text:my_silo.toml' && state.run.step === 0");
    browser.find("#editor-save").click();
    browser.wait_for("file", "scene.savedName === 'my_silo.toml'");
    let written = std::fs::read_to_string(explorer.path("my_silo.toml")).expect("the file");
    assert!(written.contains("default = 1.25") && written.contains("to = [0.8,"));
    browser.wait_for("list", "state.scenes.some((s) => s.id === 'file:my_silo.toml')");
    // A change by another program is not overwritten.
    std::fs::write(explorer.path("my_silo.toml"), "# by hand\n").expect("written");
    browser.find("#editor-save").click();
    browser.wait_for(
        "refusal",
        "document.getElementById('toast').textContent.includes('changed by another program')",
    );
    assert_eq!(
        std::fs::read_to_string(explorer.path("my_silo.toml")).expect("a file"),
        "# by hand\n"
    );
}

#[test]
fn two_tabs_show_the_same_run_and_can_be_closed() {
    let Some(browser) = Browser::start([1280, 720], false) else { return };
    // A run that cannot end during the test, however slow the browser is.
    let scene = ["silo", "--set", "accuracy.cells=2", "--set", "time.courant=0.01", "--paused"];
    let explorer = Explorer::open(&scene);
    browser.go(&explorer.url);
    browser.wait_for("state", "state && state.knobs.length > 0");
    let first = browser.window();
    let second = browser.open_window(&explorer.url);
    browser.wait_for("state", "state && state.knobs.length > 0");
    browser.find("#step").click();
    browser.wait_for("step", &format!("{STEP} === 1"));
    browser.switch(&first);
    browser.wait_for("step in the other tab", &format!("{STEP} === 1"));
    browser.find("#run").click();
    browser.wait_for("run", "state.mode === 'running'");
    browser.switch(&second);
    browser.wait_for("run in the other tab", "state.mode === 'running'");
    browser.close_window();
    browser.switch(&first);
    browser.go("about:blank");
    let step = explorer.state()["run"]["step"].as_u64();
    explorer.wait_for("steps without a page", |s| s["run"]["step"].as_u64() > step.map(|n| n + 2));
}

#[test]
fn controls_have_names_fit_and_work_by_keyboard() {
    for (size, dark) in [([1280, 720], false), ([1920, 1080], true)] {
        let Some(browser) = Browser::start(size, dark) else { return };
        let explorer = Explorer::open(&["silo", "--set", "accuracy.cells=2", "--paused"]);
        browser.go(&explorer.url);
        browser.wait_for("controls", "state && state.dial.length > 0 && state.switches.length > 0");
        let nameless = browser.script(
            "return [...document.querySelectorAll('button, input, select, iframe, svg, [role=group]')]
               .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.title
                 || (e.labels && [...e.labels].some((l) => l.textContent.trim()))))
               .map((e) => e.outerHTML)",
            &[],
        );
        assert_eq!(nameless, json!([]));
        let wide = browser.script(
            "const cut = [...document.querySelectorAll('aside *, header *')].filter((e) =>
               e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.outerHTML);
             return [document.documentElement.scrollWidth <= innerWidth,
               document.documentElement.scrollHeight <= innerHeight, cut]",
            &[],
        );
        assert_eq!(wide, json!([true, true, []]));
        let scheme = "matchMedia('(prefers-color-scheme: dark)').matches";
        assert_eq!(browser.script(&format!("return {scheme}"), &[]), json!(dark));
        // Every control can be reached and changed with the keyboard.
        let reached = (0..90)
            .map(|_| {
                browser.press(TAB);
                browser
                    .script("return document.activeElement.id || document.activeElement.type", &[])
            })
            .collect::<Vec<_>>();
        for id in ["scene", "run", "step", "restart", "stop", "knob-alpha", "range", "pin-name"] {
            assert!(reached.contains(&json!(id)), "{id} in {reached:?}");
        }
        browser.script("document.querySelector('[data-knob=alpha] [type=range]').focus()", &[]);
        let alpha = "state.knobs[0].value";
        let before = browser.script(&format!("return {alpha}"), &[]).as_f64().expect("a number");
        browser.press(RIGHT);
        browser.wait_for("change", &format!("{alpha} > {before}"));
    }
}

#[test]
fn page_and_report_are_accessible_on_all_widths() {
    for dark in [false, true] {
        let Some(browser) = Browser::start([1280, 800], dark) else { return };
        let explorer = Explorer::open(&SMALL);
        explorer.steps(3);
        explorer.tell(json!({ "do": "pin", "name": "first" }));
        explorer.tell(json!({ "do": "save", "name": "kept" }));
        let widths = if dark { &[390, 1280][..] } else { &[360, 390, 1280, 1920, 2560] };
        for &width in widths {
            let size = [width, 800];
            browser.resize(size);
            let what = |page: &str| format!("{page} of {size:?}, dark: {dark}");
            browser.go(&explorer.url);
            browser.wait_for("flow", "light.shown !== null && state.dial.length > 0");
            browser.is_accessible(&what("page"));
            browser.find("#edit").click();
            browser.wait_for("draft", "scene.draft && scene.view.shown !== null");
            browser.is_accessible(&what("editor"));
            browser.go(&format!("file://{}", explorer.path("runs/kept/report.html").display()));
            browser.wait_for("report", "light.shown !== null");
            browser.is_accessible(&what("report"));
        }
    }
}

#[test]
fn a_report_opens_from_the_disk_and_shows_the_summary() {
    let Some(browser) = Browser::start([1280, 800], false) else { return };
    let explorer = Explorer::open(&SMALL);
    explorer.steps(6);
    explorer.tell(json!({ "do": "save", "name": "kept" }));
    browser.go(&format!("file://{}", explorer.path("runs/kept/report.html").display()));
    browser.wait_for("report", "light.shown !== null");
    let summary = std::fs::read_to_string(explorer.path("runs/kept/summary.json")).expect("a file");
    let same =
        "return JSON.stringify(data.runs[0].summary) === JSON.stringify(JSON.parse(arguments[0]))";
    assert_eq!(browser.script(same, &[json!(summary)]), json!(true));
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    // Every number of the summary is in a table, with all its digits in the title.
    let shown = browser
        .script("return [...document.querySelectorAll('#tables td')].map((c) => c.title)", &[]);
    for key in ["max_speed", "rms_speed"] {
        let number = summary[key].as_f64().expect("a number");
        let all = shown.as_array().expect("a list").iter();
        let close = |v: f64| (v - number).abs() <= 1e-12 * number.abs();
        assert!(all.filter_map(|t| t.as_str()?.parse().ok()).any(close), "{key}");
    }
    // All frames can be played, and the memory stays small.
    let play = "const done = arguments[0]; (async () => { for (let k = 0; k < light.runs[0].times.length; k++) {
          light.go(k); while (light.shown !== k || light.busy) await new Promise((r) => setTimeout(r, 5)); }
        done([light.shown + 1, performance.memory ? performance.memory.usedJSHeapSize : 0]); })()";
    let played = browser.later(play, &[]);
    assert_eq!(played[0], json!(7));
    assert!(played[1].as_f64().expect("bytes") < 300e6, "{played}");
    let (colours, shares) = browser.colours("#light canvas", &[GRAINS]);
    assert!(colours > 20 && shares[0] > 0.03, "{colours} colours, {shares:?} grains");
}

/// Makes the pictures of the documentation: `assets/explorer/screenshots.sh`.
#[test]
#[ignore = "makes pictures"]
fn pictures() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/explorer/pictures");
    std::fs::create_dir_all(&folder).expect("a folder");
    let save = |browser: &Browser, name: &str| {
        // Software rendering is slow and lags far behind the run.
        std::thread::sleep(std::time::Duration::from_secs(100));
        std::fs::write(folder.join(name), browser.snapshot()).expect("a file");
    };
    let cells = ["silo", "--set", "accuracy.cells=4"];
    let scene = "schema = 1\nname = \"broken\"\ngravty = [0, -10]\n";
    for (size, dark, end) in [([1280, 720], false, "light"), ([1920, 1080], true, "dark")] {
        let Some(browser) = Browser::start(size, dark) else { return };
        let explorer = Explorer::beside(&[("broken.toml", scene)], &cells);
        browser.go(&explorer.url);
        browser.wait_for("flow", "state && state.run.time > 1.42e-3");
        explorer.ask(json!({ "do": "pause" }));
        browser.find("#view-rerun").click();
        viewer_shows(&browser);
        save(&browser, &format!("run-{end}.png"));
        explorer.tell(json!({ "do": "pin", "name": "alpha = 1/3" }));
        explorer.set("alpha", "10/3");
        explorer.tell(json!({ "do": "restart" }));
        explorer.tell(json!({ "do": "run" }));
        browser.wait_for("flow", "state.run.step > 0 && state.run.time > 1.3e-3");
        explorer.ask(json!({ "do": "pause" }));
        viewer_shows(&browser);
        save(&browser, &format!("beside-{end}.png"));
        explorer.tell(json!({ "do": "save", "name": "silo" }));
        browser.script("document.querySelector('aside').scrollTop = 1e6", &[]);
        save(&browser, &format!("saved-{end}.png"));
        explorer.ask(json!({ "do": "load", "scene": "file:broken.toml" }));
        browser.script("document.querySelector('aside').scrollTop = 0", &[]);
        save(&browser, &format!("broken-{end}.png"));
        explorer.tell(json!({ "do": "load", "scene": "preset:shear_alignment" }));
        explorer.tell(json!({ "do": "run" }));
        browser.wait_for("flow", "state.title === 'shear_alignment' && state.run.time > 0.25");
        explorer.ask(json!({ "do": "pause" }));
        viewer_shows(&browser);
        save(&browser, &format!("alignment-{end}.png"));
    }
}
