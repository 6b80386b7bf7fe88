// This file starts the Rerun viewer and opens the recording of this server.
"use strict";

// The viewer logs every shader to the console, and browsers keep all messages: debug output is off.
console.debug = () => {};

async function start() {
  await wasm_bindgen({ module_or_path: "re_viewer_bg.wasm" });
  const viewer = new wasm_bindgen.WebHandle({
    hide_welcome_screen: true,
    enable_history: false,
    notebook: false,
    persist: false,
  });
  await viewer.start(document.getElementById("flow"));
  document.getElementById("state").hidden = true;
  viewer.add_receiver(new URL("recording.rrd", location).href);
}

start().catch((e) => {
  const state = document.getElementById("state");
  state.hidden = false;
  state.textContent = `The viewer failed: ${e}`;
});
