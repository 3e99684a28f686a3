// Every control of the page sets its key, and the picture is then what the program draws of the scene.

import assert from "node:assert/strict";
import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { browse, serve } from "./browser.mjs";
import { drop, open } from "./explorer.mjs";

/** High enough for all panels. */
const TALL = { width: 760, height: 2600 };
let server;
let browser;

before(async () => {
  server = await serve(process.env.PAGE);
  browser = await browse({ gpu: false });
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** The address of a scene. */
function address(input, scene) {
  const text = `input = '${input}'\n${scene}[scene.image]\nwidth = 120\nheight = 80\n`;
  return `#${Buffer.from(text).toString("base64url")}`;
}

/** A page with all panels open. */
async function panels(hash) {
  const explorer = await open(browser.context, server.address + hash, TALL);
  await explorer.rest();
  await explorer.script("section Picture\nsection Looking into it\nsection Out");
  await explorer.rest();
  return explorer;
}

/** A key of a scene file. */
function key(file, path) {
  return path.split(".").reduce((value, name) => {
    const one = Array.isArray(value) && Number.isNaN(Number(name)) ? value[0] : value;
    return one?.[name];
  }, file);
}

/** Uses controls one after another. */
async function use(explorer, rows, folder = tmpdir()) {
  for (const [role, label, value, path, expected = value] of rows) {
    if (role === "ComboBox") {
      await explorer.choose(label, value);
    } else {
      await explorer.act(label, role, value);
    }
    const seen = await explorer.rest();
    assert.deepEqual(seen.messages.filter(([, wrong]) => wrong), [], label);
    if (path) {
      const found = key(seen.file, path);
      const near = typeof expected === "number" && typeof found === "number"
        && Math.abs(found - expected) <= 0.02 * Math.max(Math.abs(expected), 0.02);
      const same = JSON.stringify(found ?? null) === JSON.stringify(expected ?? null);
      assert.ok(near || same, `${label}: ${found}`);
    }
    const off = await explorer.differenceToProgram(folder);
    assert.ok(off <= 1, `${label}: ${off}`);
  }
}

function on(name, hash, work) {
  test(name, { timeout: 900_000 }, async () => {
    const explorer = await panels(hash);
    try {
      await work(explorer);
      assert.deepEqual(explorer.errors, []);
    } finally {
      await explorer.page.close();
    }
  });
}

const BOX = address("box", "[scene.volume]\npreset = 'box'\n");

on("sliders set their keys", BOX, (explorer) => use(explorer, [
  ["Slider", "density scale", 3, "volume.density_scale"],
  ["Slider", "phase (g)", 0.5, "volume.phase_g"],
  ["Slider", "octaves", 3, "shadow.octaves"],
  ["Slider", "map size", 96, "shadow.size"],
  ["Slider", "quality", 2, "shadow.quality"],
  ["Slider", "light steps", 64, "shadow.steps"],
  ["Slider", "tolerance", 0.05, "shadow.tolerance"],
  ["Slider", "samples", 2, "image.samples"],
  ["Slider", "picture tolerance", 0.01, "image.tolerance"],
  ["Slider", "camera steps", 2, "shadow.view_steps"],
  ["Slider", "field of view", 50, "camera.fov_y_degrees"],
  ["Slider", "ground height", -0.4, "ground.height"],
  ["Slider", "ground albedo", 0.5, "ground.albedo"],
]));

on("names and switches are chosen", BOX, (explorer) => use(explorer, [
  ["ComboBox", "filter", "pcf5", "shadow.filter"],
  ["ComboBox", "slices", "planes", "shadow.slices"],
  ["CheckBox", "links between texels", undefined, "shadow.links", false],
  ["Button", "reset filter", undefined, "shadow.filter", undefined],
  ["ComboBox", "tone curve", "agx", "image.tonemap"],
  ["Slider", "exposure", 1, "image.exposure", 2],
  ["CheckBox", "auto", undefined, "image.exposure", "auto"],
  ["CheckBox", "ground", undefined, "ground.enabled", false],
  ["ComboBox", "projection", "orthographic", "camera.kind"],
  ["Slider", "view height", 4, "camera.height"],
  ["ComboBox", "preset", "rods", "volume.preset"],
]));

on("kinds of map are chosen", BOX, (explorer) => use(explorer, [
  ["ComboBox", "map", "nested", "shadow.map"],
  ["ComboBox", "map", "visibility", "shadow.map"],
  ["ComboBox", "map", "fourier", "shadow.map", "fourier:7"],
  ["Slider", "numbers a texel", 9, "shadow.map", "fourier:9"],
  ["ComboBox", "map", "threshold", "shadow.map"],
  ["SpinButton", "threshold 2", 0.4, "shadow.thresholds", [0.1, 0.4, 0.9]],
  ["ComboBox", "lookup", "paper", "shadow.lookup"],
  ["ComboBox", "crossing", "bucket", "shadow.crossing"],
  ["ComboBox", "shading", "paper", "shadow.shading"],
  ["Slider", "light samples", 20, "shadow.light_samples"],
  ["ComboBox", "shading", "physical", "shadow.shading"],
]));

on("lights are added and changed", BOX, (explorer) => use(explorer, [
  ["Slider", "light strength", 2, null],
  ["Slider", "ambient", 0.5, null],
  ["Slider", "background", 0.25, null],
  ["ComboBox", "light kind", "spot", "light.kind"],
  ["Slider", "cone", 20, "light.cone_degrees"],
  ["Slider", "cone softness", 0.5, "light.cone_softness"],
  ["ComboBox", "light kind", "directional", "light.kind"],
  ["SpinButton", "light direction x", 0.5, "light.direction.0"],
  ["Button", "add", undefined, null],
  ["Button", "remove", undefined, null],
]));

on("media are edited", BOX, (explorer) => use(explorer, [
  ["ComboBox", "transfer function", "fire", "volume.transfer.name"],
  ["CheckBox", "steep places only", undefined, null],
  ["Slider", "steepness", 0.5, "volume.transfer.gradient", [[0, 0], [0.5, 1]]],
  ["CheckBox", "emission", undefined, null],
  ["ComboBox", "emission colours", "viridis", "volume.emission.colors"],
  ["Slider", "emission radiance", 2, "volume.emission.radiance"],
  ["ComboBox", "transfer function", "none", "volume.transfer", null],
  ["CheckBox", "clip box", undefined, "volume.clip", [[0, 0, 0], [1, 1, 1]]],
  ["Slider", "clip x to", 0.5, "volume.clip", [[0, 0, 0], [0.5, 1, 1]]],
  ["SpinButton", "window to", 0.5, null],
  ["SpinButton", "picture width", 64, "image.width"],
]));

on("hair and meshes are set", BOX, async (explorer) => {
  const folder = mkdtempSync(join(tmpdir(), "surfaces-"));
  const mesh = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 1 2 3\nf 1 3 4\n";
  const hair = Buffer.alloc(160 + 2 * 4 * 16);
  hair.writeFloatLE(4, 0);
  [2, 4, 160].forEach((word, index) => hair.writeUInt32LE(word, 4 + 4 * index));
  for (let point = 0; point < 8; point += 1) {
    const [strand, along] = [Math.floor(point / 4), point % 4];
    const at = [0.3 * strand, 0.3 + 0.2 * along, 0.1 * along, 1];
    at.forEach((c, axis) => hair.writeFloatLE(c, 160 + 16 * point + 4 * axis));
  }
  const scene = "[mesh]\npath = 'plane.obj'\n[hair]\npath = 'two.tfx'\nthickness = 0.1\n"
    + "[image]\nwidth = 120\nheight = 80\n";
  const files = [["plane.obj", Buffer.from(mesh)], ["two.tfx", hair]];
  files.forEach(([name, bytes]) => writeFileSync(join(folder, name), bytes));
  await drop(explorer, [...files, ["scene.toml", Buffer.from(scene)]]);
  await explorer.until(() => deepshadow.seen()?.input === "scene.toml");
  await explorer.rest();
  await use(explorer, [
    ["Slider", "mesh opacity", 0.5, "mesh.opacity"],
    ["Slider", "hair opacity", 0.25, "hair.opacity"],
    ["Slider", "hair thickness", 0.2, "hair.thickness"],
    ["Slider", "hair highlight", 0.8, "hair.specular"],
    ["Slider", "hair shininess", 100, "hair.shininess"],
    ["Slider", "bias", 0.05, null],
    ["CheckBox", "coverage of strands", undefined, "shadow.coverage", false],
    ["CheckBox", "hair casts shadows", undefined, "hair.casts", false],
    ["CheckBox", "mesh receives shadows", undefined, "mesh.receives", false],
  ], folder);
});

on("it is looked into", BOX, async (explorer) => {
  await explorer.act("difference to the truth", "CheckBox");
  const seen = await explorer.until(() => {
    const seen = deepshadow.seen();
    return seen?.difference && !seen.looks_into_something;
  });
  assert.ok(seen.difference[0] > 0 && seen.difference[1] < 0.2, `${seen.difference}`);
  await explorer.act("map and curves", "CheckBox");
  await explorer.act("all kinds of map", "CheckBox");
  await explorer.page.mouse.move(600, 1300);
  await explorer.until(() => deepshadow.seen()?.curves >= 14);
  await explorer.choose("map shows", "depth at 50 %");
  await explorer.until(() => !deepshadow.seen()?.looks_into_something);
  // Another map size would have all of them built again.
  await explorer.act("all kinds of map", "CheckBox");
  await explorer.act("compare with these settings", "Button");
  await explorer.choose("map", "peeling");
  await explorer.until(() => !deepshadow.seen()?.looks_into_something);
  await explorer.act("wiper", "Slider", 0.25);
  await explorer.act("end", "Button");
  const before = (await explorer.rest()).file.camera;
  await explorer.act("look from the light", "Button");
  // A page at rest may not have heard of it yet.
  await explorer.until(() => deepshadow.seen()?.file.camera?.position);
  const { camera } = (await explorer.rest()).file;
  assert.equal(camera.position.length, 3);
  assert.notDeepEqual(camera, before);
  await explorer.choose("device", "cpu");
  await explorer.act("moving picture", "Slider", 50);
  await explorer.rest();
});

on("a sequence is played", BOX, async (explorer) => {
  const raw = (value) => Buffer.alloc(8 ** 3, value);
  const frames = [1, 2, 3].map((frame) => [`smoke_000${frame}.raw`, raw(60 * frame)]);
  const scene = "[volume]\npath = 'smoke_####.raw'\ndims = [8, 8, 8]\ntype = 'u8'\n";
  await drop(explorer, [...frames, ["scene.toml", Buffer.from(scene)]]);
  await explorer.until(() => deepshadow.seen()?.input === "scene.toml");
  assert.equal((await explorer.rest()).frame, 1);
  await explorer.act("frame", "Slider", 3);
  assert.equal((await explorer.rest()).frame, 3);
  await explorer.act("play", "Button");
  await explorer.until(() => deepshadow.seen()?.frame === 2);
  await explorer.act("pause", "Button");
});
