// Starts the explorer, and offers it to programs that drive pages.

import init, { act, controls, outcome, pixels, script, seen, show } from "./explorer.js";
import { compiled } from "./program.js";

const message = document.getElementById("message");

/** Says why there is nothing to see. */
function fail(error) {
  message.textContent = `The explorer does not run here: ${error?.message ?? error}`;
  message.hidden = false;
}

/** Whether a processor draws the window, which then takes it from the workers. */
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Asks for no more of WebGL than the window needs, before the window does: it smooths edges itself,
 *  and samples would take a processor twice the time. */
function prepare(canvas) {
  canvas.getContext("webgl2", { antialias: false, depth: false, stencil: false });
}

try {
  const module = await compiled();
  const program = await init({ module_or_path: module });
  prepare(document.getElementById("explorer"));
  await show("explorer", module, drawnBySoftware());
  message.hidden = true;
  globalThis.deepshadow = {
    act,
    controls: () => JSON.parse(controls()),
    memory: () => program.memory.buffer.byteLength,
    outcome: () => JSON.parse(outcome()),
    pixels,
    script,
    seen: () => JSON.parse(seen()),
  };
} catch (error) {
  fail(error);
}
