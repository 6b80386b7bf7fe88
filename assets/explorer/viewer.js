// The Rerun viewer, and what the page around it may ask of it.
"use strict";

let handle = null;
let shown = null; // the stream on screen
let wanted = null; // the stream asked for last

// The viewer tells its console about every shader; browsers keep all of that.
console.debug = () => {};

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
  if (!wanted || (shown && shown.url === wanted.url)) return;
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
  parent.postMessage({ viewer: "showing", recording: shown.recording }, location.origin);
}

window.show = (stream) => {
  if (wanted && wanted.url === stream.url) return;
  if (wanted && wanted.opened && wanted !== shown && handle) handle.remove_receiver(wanted.url);
  wanted = { ...stream };
};

// Follows the newest instant again after the time cursor was moved.
window.goLive = () => {
  const id = handle && handle.get_active_recording_id();
  if (!id) return;
  const line = handle.get_active_timeline(id);
  const range = line && handle.get_timeline_time_range(id, line);
  if (range) handle.set_time_for_timeline(id, line, range.max);
  handle.set_playing(id, true);
};

start().catch((e) => parent.postMessage({ viewer: "failed", why: String(e) }, location.origin));
