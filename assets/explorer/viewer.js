// This file starts the Rerun viewer and handles the requests of the page around it.
"use strict";

const TIMELINE = "sim_time"; // nanoseconds

let handle = null;
let shown = null; // the stream that is displayed
let wanted = null; // the stream that was requested last
let now = null; // current time of the run, seconds
let beside = false; // whether other runs are displayed beside it
const set = new Set(); // times to which this page has set the time cursor
let arrived = false; // whether the cursor has reached one of them
let moved = false; // whether the user has moved the cursor since

// The viewer logs every shader to the console, and browsers keep all messages: debug output is off.
console.debug = () => {};

// The viewer takes the focus when it starts. It may have the focus only after a click into it.
const focus = HTMLElement.prototype.focus;
HTMLElement.prototype.focus = function (...options) {
  if (document.hasFocus()) focus.apply(this, options);
};

// The keyboard shortcuts of the page around the viewer also work inside it.
window.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || !" srxpl".includes(event.key)) return;
  event.stopImmediatePropagation();
  event.preventDefault();
  parent.postMessage({ viewer: "key", key: event.key }, location.origin);
}, true);

async function start() {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  await wasm_bindgen({ module_or_path: "re_viewer_bg.wasm" });
  const viewer = new wasm_bindgen.WebHandle({
    hide_welcome_screen: true,
    panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden" },
    enable_history: false,
    notebook: false,
    persist: false,
    theme: dark ? "dark" : "light",
  });
  await viewer.start(document.getElementById("flow"));
  handle = viewer;
  parent.postMessage({ viewer: "ready" }, location.origin);
  setInterval(follow, 150);
}

// Displays the requested recording as soon as its first data have arrived, and then closes the
// previous one.
function follow() {
  if (handle.has_panicked()) {
    parent.postMessage({ viewer: "failed", why: String(handle.panic_message()) }, location.origin);
    return;
  }
  if (!wanted) return;
  if (shown && shown.url === wanted.url) {
    if (beside && !moved) keepPace();
    return;
  }
  if (wanted.opened !== true) {
    wanted.opened = true;
    handle.add_receiver(wanted.url);
    return;
  }
  if (handle.get_active_recording_id() !== wanted.recording) {
    try {
      handle.set_active_recording_id(wanted.recording);
    } catch (_) {
      // The recording has not arrived yet.
    }
    return;
  }
  if (shown) handle.remove_receiver(shown.url);
  shown = wanted;
  takeOver();
  parent.postMessage({ viewer: "showing", recording: shown.recording }, location.origin);
}

// Keeps the time cursor at the current time of the run until the user moves it. Runs beside it may
// be far ahead.
function keepPace() {
  const id = shown.recording;
  const range = handle.get_timeline_time_range(id, TIMELINE);
  if (!range || now === null) return;
  const at = Math.round(handle.get_time_for_timeline(id, TIMELINE) ?? -1);
  if (set.has(at)) arrived = true;
  else if (arrived) moved = true;
  const to = Math.min(Math.round(1e9 * now), Number(range.max));
  if (moved || set.has(to)) return;
  // The new time takes effect with one of the next frames of the viewer.
  set.add(to);
  handle.set_playing(id, false);
  handle.set_time_for_timeline(id, TIMELINE, to);
}

// Forgets the earlier positions of the time cursor, so that it follows the run.
function takeOver() {
  [arrived, moved] = [false, false];
  set.clear();
}

// Requests a stream; `time` is the current time of the run, `others` whether runs are beside it.
window.show = (stream, time, others) => {
  [now, beside] = [time, others];
  if (wanted && wanted.url === stream.url) return;
  if (wanted && wanted.opened && wanted !== shown && handle) handle.remove_receiver(wanted.url);
  wanted = { ...stream };
};

// Makes the time cursor follow the run again after the user has moved it.
window.goLive = () => {
  if (!shown) return;
  const range = handle.get_timeline_time_range(shown.recording, TIMELINE);
  if (!range) return;
  takeOver();
  if (beside) return;
  handle.set_time_for_timeline(shown.recording, TIMELINE, Number(range.max));
  handle.set_playing(shown.recording, true);
};

start().catch((e) => parent.postMessage({ viewer: "failed", why: String(e) }, location.origin));
