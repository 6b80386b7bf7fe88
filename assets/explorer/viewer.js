// The Rerun viewer, and what the page around it may ask of it.
"use strict";

const TIMELINE = "sim_time"; // nanoseconds

let handle = null;
let shown = null; // the stream on screen
let wanted = null; // the stream asked for last
let now = null; // seconds that the run has come to
let beside = false; // whether other runs stand beside it
const set = new Set(); // where this page has put the time cursor
let arrived = false; // whether it has been there
let moved = false; // whether somebody else has moved it since

// The viewer tells its console about every shader; browsers keep all of that.
console.debug = () => {};

// The viewer takes the focus when it starts; it is to have it when somebody clicks into it.
const focus = HTMLElement.prototype.focus;
HTMLElement.prototype.focus = function (...options) {
  if (document.hasFocus()) focus.apply(this, options);
};

// And the keys of the page around it work there too.
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

// Brings the recording that is wanted to the front as soon as its first data are there, and then
// lets go of the one before.
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
      // Not there yet.
    }
    return;
  }
  if (shown) handle.remove_receiver(shown.url);
  shown = wanted;
  takeOver();
  parent.postMessage({ viewer: "showing", recording: shown.recording }, location.origin);
}

// Keeps the time cursor at the run's own instant, which those beside it may be far ahead of, until
// somebody moves it.
function keepPace() {
  const id = shown.recording;
  const range = handle.get_timeline_time_range(id, TIMELINE);
  if (!range || now === null) return;
  const at = Math.round(handle.get_time_for_timeline(id, TIMELINE) ?? -1);
  if (set.has(at)) arrived = true;
  else if (arrived) moved = true;
  const to = Math.min(Math.round(1e9 * now), Number(range.max));
  if (moved || set.has(to)) return;
  // What is set shows with one of the next pictures.
  set.add(to);
  handle.set_playing(id, false);
  handle.set_time_for_timeline(id, TIMELINE, to);
}

function takeOver() {
  [arrived, moved] = [false, false];
  set.clear();
}

window.show = (stream, time, others) => {
  [now, beside] = [time, others];
  if (wanted && wanted.url === stream.url) return;
  if (wanted && wanted.opened && wanted !== shown && handle) handle.remove_receiver(wanted.url);
  wanted = { ...stream };
};

// Follows the run again after the time cursor was moved.
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
