// The page in a browser: it draws what the program draws, hands and controls work, and nothing leaves
// the machine. `web/test` says how to run this.

import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { browse, serve } from "./browser.mjs";
import { difference, drop, open } from "./explorer.mjs";

const SMALL = "set image.width 160\nset image.height 120\nwait";
const pictures = process.env.PICTURES;
let server;
let browser;

before(async () => {
  server = await serve(process.env.PAGE);
  browser = await browse({ gpu: false });
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
  }
});

after(async () => {
  await browser?.close();
  server?.close();
});

/** Runs a test on a page of its own, on which nothing may go wrong. */
function on(name, work, { address = "", size, errors = [] } = {}) {
  test(name, { timeout: 600_000 }, async () => {
    const explorer = await open(browser.context, server.address + address, size);
    try {
      await work(explorer);
      assert.deepEqual(explorer.errors, errors);
      const own = explorer.requests.filter((url) => {
        return url.startsWith(server.address) || /^(data|blob):/.test(url);
      });
      assert.deepEqual(own, explorer.requests, "requests that leave the page");
      assert.ok(explorer.requests.length >= 5);
    } finally {
      await explorer.page.close();
    }
  });
}

/** A file of NumPy's with a ball. */
function ball(n = 24) {
  const header = `{'descr': '<f4', 'fortran_order': False, 'shape': (${n}, ${n}, ${n}), }`;
  const padded = header.padEnd(117, " ") + "\n";
  const head = Buffer.alloc(10);
  head.write("\x93NUMPY", "latin1");
  head.writeUInt8(1, 6);
  head.writeUInt16LE(padded.length, 8);
  const values = new Float32Array(n ** 3);
  const middle = (n - 1) / 2;
  for (let i = 0; i < values.length; i += 1) {
    const at = [i % n, Math.floor(i / n) % n, Math.floor(i / n / n)];
    const away = Math.hypot(...at.map((c) => c - middle)) / middle;
    values[i] = Math.max(0, 1 - away);
  }
  return Buffer.concat([head, Buffer.from(padded, "latin1"), Buffer.from(values.buffer)]);
}

on("an example is drawn as the program draws it", async (explorer) => {
  const seen = await explorer.rest();
  assert.equal(seen.input, "bucky");
  assert.ok(seen.device.startsWith("cpu"), seen.device);
  await explorer.until(() => {
    return deepshadow.seen()?.messages.some(([text]) => text.includes("by the processor"));
  });
  assert.ok((await explorer.differenceToProgram(tmpdir())) <= 1);
  if (pictures) {
    await explorer.page.screenshot({ path: join(pictures, "1280x720.png") });
  }
});

on("the picture is seen pixel by pixel, where its place is", async (explorer) => {
  const { page } = explorer;
  await explorer.rest();
  const place = () => page.evaluate(() => {
    const canvas = document.getElementById("picture");
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [left, top, width, height].map((length) => length * devicePixelRatio);
  });
  const check = async () => {
    const own = await explorer.pixels();
    const [left, top, width, height] = await place();
    assert.deepEqual([width, height].map(Math.round), [own.width, own.height]);
    assert.ok([left, top].every((length) => Math.abs(length - Math.round(length)) < 0.02));
    const path = join(mkdtempSync(join(tmpdir(), "seen-")), "page.png");
    await page.screenshot({ path, scale: "device" });
    const shot = await explorer.decoded(path);
    // Its lower half may have messages and the ball over it.
    for (let y = 0; y < own.height >> 1; y += 1) {
      const from = 4 * ((Math.round(top) + y) * shot.width + Math.round(left));
      const seen = shot.bytes.subarray(from, from + 4 * own.width);
      const row = own.bytes.subarray(4 * y * own.width, 4 * (y + 1) * own.width);
      assert.ok(seen.equals(row), `row ${y}`);
    }
  };
  await check();
  await page.setViewportSize({ width: 911, height: 603 });
  await page.waitForTimeout(500);
  await explorer.rest();
  assert.ok((await explorer.pixels()).width < 520);
  await check();
});

on("clouds come from the same noise", async (explorer) => {
  await explorer.rest();
  await explorer.script(`open clouds\n${SMALL}`);
  const seen = await explorer.rest();
  assert.equal(seen.input, "clouds");
  assert.ok((await explorer.differenceToProgram(tmpdir())) <= 1);
});

on("controls change the picture as they change the program's", async (explorer) => {
  await explorer.rest();
  await explorer.script(SMALL);
  const before = await explorer.pixels();
  await explorer.act("Picture", "Button").catch(() => explorer.script("section Picture"));
  await explorer.act("density scale", "Slider", 6);
  await explorer.rest();
  const after = await explorer.pixels();
  assert.ok(difference(before, after) > 8, "a slider changes the picture");
  assert.ok((await explorer.differenceToProgram(tmpdir())) <= 1);
  const file = (await explorer.seen()).file;
  assert.ok(Math.abs(file.volume.density_scale - 6) < 0.1, JSON.stringify(file));
});

on("a drag is answered at once and turns the camera, or the light", async (explorer) => {
  await explorer.rest();
  const turned = await explorer.script("drag camera 0.3 0.1 24\ndrag light 0.3 0.1 24\nwait");
  assert.equal(turned.answers.length, 48);
  const mouse = explorer.page.mouse;
  const camera = (await explorer.seen()).file.camera.position;
  await mouse.move(900, 350);
  await mouse.down();
  await mouse.move(980, 360, { steps: 6 });
  await mouse.up();
  const dragged = await explorer.rest();
  assert.notDeepEqual(dragged.file.camera.position, camera);
  const light = dragged.file.light.direction;
  await explorer.page.keyboard.down("Shift");
  await mouse.move(900, 350);
  await mouse.down();
  await mouse.move(980, 360, { steps: 6 });
  await mouse.up();
  await explorer.page.keyboard.up("Shift");
  const lit = await explorer.rest();
  assert.notDeepEqual(lit.file.light.direction, light);
  assert.deepEqual(lit.file.camera.position, dragged.file.camera.position);
  assert.ok((await explorer.differenceToProgram(tmpdir())) <= 1);
});

on("one finger orbits, two pan and zoom, and the light has a switch", async (explorer) => {
  await explorer.rest();
  await explorer.script("panels off\nwait");
  const touch = await explorer.page.context().newCDPSession(explorer.page);
  const fingers = (type, points) => {
    const touchPoints = points.map(([x, y], id) => ({ x, y, id }));
    return touch.send("Input.dispatchTouchEvent", { type, touchPoints });
  };
  const gesture = async (from, to) => {
    await fingers("touchStart", from);
    for (let step = 1; step <= 8; step += 1) {
      const between = from.map((start, finger) => start.map((c, axis) => {
        return c + ((to[finger][axis] - c) * step) / 8;
      }));
      await fingers("touchMove", between);
      await explorer.page.waitForTimeout(30);
    }
    await fingers("touchEnd", []);
    return (await explorer.rest()).file;
  };
  const start = await gesture([[200, 400]], [[200, 440]]);
  const away = ({ camera }) => Math.hypot(...camera.position.map((c, i) => c - camera.target[i]));
  const orbited = await gesture([[200, 400]], [[280, 420]]);
  assert.notDeepEqual(orbited.camera.position, start.camera.position);
  assert.deepEqual(orbited.camera.target, start.camera.target);
  assert.ok(Math.abs(away(orbited) - away(start)) < 1e-9);
  const zoomed = await gesture([[150, 400], [250, 400]], [[100, 400], [300, 400]]);
  const factor = away(orbited) / away(zoomed);
  assert.ok(factor > 1.6 && factor < 2.4, `${factor}`);
  const panned = await gesture([[150, 400], [250, 400]], [[200, 450], [300, 450]]);
  assert.notDeepEqual(panned.camera.target, zoomed.camera.target);
  assert.ok(Math.abs(away(panned) - away(zoomed)) < 0.05 * away(zoomed));
  await explorer.act("Light", "Button").catch(() => explorer.page.keyboard.press("l"));
  assert.ok((await explorer.seen()).holds_light);
  const lit = await gesture([[200, 400]], [[280, 420]]);
  assert.deepEqual(lit.camera.position, panned.camera.position);
  assert.notDeepEqual(lit.light?.direction, panned.light?.direction);
  if (pictures) {
    await explorer.page.screenshot({ path: join(pictures, "390x844.png") });
  }
}, { size: { width: 390, height: 844 } });

on("files are dropped and chosen, with what they name", async (explorer) => {
  await explorer.rest();
  const scene = "[volume]\npath = 'ball.npy'\ndensity_scale = 0.4\n[image]\nwidth = 120\nheight = 90\n";
  await drop(explorer, [["ball.npy", ball()], ["scene.toml", Buffer.from(scene)]]);
  await explorer.until(() => deepshadow.seen()?.input === "scene.toml");
  const seen = await explorer.rest();
  assert.deepEqual(seen.size, [120, 90]);
  // The program reads the file beside the scene.
  const folder = mkdtempSync(join(tmpdir(), "ball-"));
  writeFileSync(join(folder, "ball.npy"), ball());
  assert.ok((await explorer.differenceToProgram(folder)) <= 1);
  // A header and its data, by the chooser.
  const raw = Buffer.alloc(16 ** 3, 100);
  const header = "ObjectType = Image\nNDims = 3\nDimSize = 16 16 16\nElementType = MET_UCHAR\n"
    + "ElementDataFile = data.raw\n";
  const chooser = explorer.page.waitForEvent("filechooser");
  await explorer.click(await explorer.control("Open…"));
  const given = [["data.raw", raw], ["cube.mhd", Buffer.from(header)]];
  await (await chooser).setFiles(given.map(([name, buffer]) => {
    return { name, mimeType: "application/octet-stream", buffer };
  }));
  await explorer.until(() => deepshadow.seen()?.input === "cube.mhd");
  await explorer.rest();
  const messages = (await explorer.seen()).messages;
  assert.deepEqual(messages.filter(([, wrong]) => wrong), []);
});

on("a hostile file gets its line, and what was open stays", async (explorer) => {
  await explorer.rest();
  const npy = ball();
  const huge = Buffer.from(npy);
  huge.write("'shape': (9999, 9999, 9999)".padEnd(30), 10 + npy.subarray(10).indexOf("'shape'"));
  const hostile = [
    ["cut.npy", npy.subarray(0, 200)],
    ["huge.npy", huge],
    ["nothing.vdb", Buffer.alloc(0)],
    ["noise.vdb", Buffer.from(Array.from({ length: 4096 }, (_, i) => (i * 131) % 251))],
    ["what.xyz", Buffer.from("nothing that anybody knows")],
    ["scene.toml", Buffer.from("[volume]\npath = 'missing.vdb'\n")],
    ["wrong.toml", Buffer.from("[volume]\nthickness = 3\n")],
  ];
  for (const [name, bytes] of hostile) {
    await drop(explorer, [[name, bytes]]);
    await explorer.until(() => deepshadow.seen()?.messages.some(([, wrong]) => wrong));
    const seen = await explorer.rest();
    const wrong = seen.messages.filter(([, wrong]) => wrong).map(([text]) => text);
    assert.ok(wrong.every((text) => !text.includes("\n") && text.length < 300), wrong.join());
    assert.equal(seen.input, "bucky", name);
    while ((await explorer.seen()).messages.some(([, wrong]) => wrong)) {
      await explorer.act("dismiss");
    }
  }
  await explorer.script("drag camera 0.1 0 2\nwait");
});

on("the address keeps what is seen", async (explorer) => {
  await explorer.rest();
  await explorer.script(`${SMALL}\ndrag camera 0.2 0.1 2\nset shadow.map "nested"\nwait`);
  const file = (await explorer.seen()).file;
  const pixels = await explorer.pixels();
  await explorer.until(() => location.hash.length > 10);
  await explorer.page.waitForTimeout(1500);
  const address = explorer.page.url();
  const again = await open(browser.context, address);
  await again.until(() => deepshadow.seen()?.file?.shadow?.map === "nested");
  assert.deepEqual((await again.rest()).file, file);
  assert.equal(difference(await again.pixels(), pixels), 0);
  assert.deepEqual(again.errors, []);
  await again.page.close();
});

on("a damaged address says so", async (explorer) => {
  const seen = await explorer.until(() => deepshadow.seen()?.messages.length > 0);
  assert.ok(seen.messages.some(([text]) => text.includes("damaged")), JSON.stringify(seen));
}, { address: "#bm90aGluZw" });

on("an address of a file asks for that file", async (explorer) => {
  const seen = await explorer.until(() => deepshadow.seen()?.messages.length > 0);
  assert.ok(seen.messages.some(([text]) => text.includes("ball.npy")), JSON.stringify(seen));
  await drop(explorer, [["ball.npy", ball()]]);
  await explorer.until(() => deepshadow.seen()?.file?.shadow?.map === "nested");
  await explorer.rest();
}, {
  address: `#${Buffer.from(
    "input = 'ball.npy'\n[scene.volume]\npath = 'ball.npy'\n[scene.shadow]\nmap = 'nested'\n",
  ).toString("base64url")}`,
});

on("picture, scene and command come out", async (explorer) => {
  await explorer.rest();
  await explorer.script(SMALL);
  const png = await explorer.saved(() => explorer.script("picture shown.png"));
  assert.equal(difference(await explorer.decoded(png), await explorer.pixels()), 0);
  const exr = await explorer.saved(() => explorer.script("picture shown.exr"));
  assert.equal(readFileSync(exr).readUInt32LE(0), 20000630);
  const scene = readFileSync(await explorer.saveScene(), "utf8");
  assert.match(scene, /preset = "bucky"/);
  await explorer.script("section Out");
  await explorer.control("copy command", "Button");
});

on("a worker that ends is replaced, and says why", async (explorer) => {
  await explorer.rest();
  for (const worker of explorer.page.workers()) {
    await worker.evaluate(() => {
      Promise.reject(new Error("no memory is left"));
    });
  }
  const seen = await explorer.until(() => deepshadow.seen()?.messages.some(([, wrong]) => wrong));
  const wrong = seen.messages.filter(([, wrong]) => wrong).map(([text]) => text);
  assert.ok(wrong.every((text) => text.includes("no memory is left")), wrong.join());
  await explorer.script(`${SMALL}\ndrag camera 0.2 0 2\nwait`).catch(() => {});
  while ((await explorer.seen()).messages.some(([, wrong]) => wrong)) {
    await explorer.act("dismiss");
  }
  await explorer.script(`${SMALL}\ndrag camera 0.2 0 2\nwait`);
  assert.ok((await explorer.differenceToProgram(tmpdir())) <= 1);
  // The browser tells of it too.
  assert.ok(explorer.errors.every((error) => error.includes("no memory is left")));
  explorer.errors.length = 0;
});

on("memory does not grow", async (explorer) => {
  await explorer.rest();
  const memory = async () => {
    const own = await explorer.page.evaluate(() => deepshadow.memory());
    const workers = explorer.page.workers().map((one) => one.evaluate(() => self.memory()));
    return [own, ...(await Promise.all(workers))];
  };
  const turns = "drag camera 2 0.2 120\nwait\ndrag light 1 0.2 80\nwait";
  // A whole picture comes while the one before is still shown: the most that there ever is.
  await explorer.script(turns);
  await explorer.script(turns);
  const before = await memory();
  await explorer.script(turns);
  assert.deepEqual(await memory(), before);
});
