// The page with WebGPU, which software imitates here. The program needs a Vulkan driver, of which
// software is enough (mesa-vulkan-drivers).

import assert from "node:assert/strict";
import { tmpdir } from "node:os";
import { after, before, test } from "node:test";

import { browse, serve } from "./browser.mjs";
import { open } from "./explorer.mjs";

let server;
let browser;

before(async () => {
  server = await serve(process.env.PAGE);
  browser = await browse({ gpu: true });
});

after(async () => {
  await browser?.close();
  server?.close();
});

test("WebGPU draws what the program draws", { timeout: 900_000 }, async () => {
  const explorer = await open(browser.context, server.address);
  await explorer.rest();
  await explorer.script("set image.width 160\nset image.height 120\nwait\ndevice gpu\nwait");
  const seen = await explorer.until(() => deepshadow.seen()?.device?.startsWith("gpu"));
  assert.ok(seen.device.startsWith("gpu"), seen.device);
  await explorer.rest();
  assert.ok((await explorer.differenceToProgram(tmpdir(), "gpu")) <= 1);
  // Pictures that move are drawn by it too.
  const moved = await explorer.script("drag camera 0.2 0.1 6\ndrag light 0.2 0.1 6\nwait");
  assert.equal(moved.answers.length, 12);
  assert.ok(moved.device.startsWith("gpu"), moved.device);
  assert.ok((await explorer.differenceToProgram(tmpdir(), "gpu")) <= 1);
  assert.deepEqual(explorer.errors, []);
  await explorer.page.close();
});
