// The explorer's page, as programs drive it.

import { spawnSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { listen } from "./browser.mjs";

/** How long anything may take on a busy machine, in milliseconds. */
const PATIENCE = 120_000;

/** Opens the page, and waits until it runs. */
export async function open(context, address, size) {
  const heard = await listen(context, address, size);
  await heard.page.waitForFunction(() => globalThis.deepshadow?.seen(), null, { timeout: PATIENCE });
  return new Explorer(heard);
}

export class Explorer {
  constructor({ page, requests, errors }) {
    Object.assign(this, { page, requests, errors });
  }

  /** What is seen. */
  seen() {
    return this.page.evaluate(() => deepshadow.seen());
  }

  /** Waits until something is so. */
  async until(is, argument) {
    await this.page.waitForFunction(is, argument, { timeout: PATIENCE, polling: 20 });
    return this.seen();
  }

  /** Waits until everything is drawn as `render` draws it. */
  async rest() {
    // What was just done is noticed at the next frames.
    await this.page.evaluate(() => new Promise((done) => setTimeout(done, 60)));
    return this.until(() => {
      const seen = deepshadow.seen();
      return seen?.is_at_rest && !seen.is_writing && !seen.runs_script;
    });
  }

  /** Runs a script to its end, and returns what it has measured. */
  async script(text) {
    const why = await this.page.evaluate((text) => deepshadow.script(text), text);
    if (why) {
      throw new Error(why);
    }
    await this.until(() => deepshadow.outcome());
    const outcome = await this.page.evaluate(() => deepshadow.outcome());
    if (outcome.error) {
      throw new Error(outcome.error);
    }
    return outcome;
  }

  /** The controls with a name, and a role if one is given. */
  async controls(label, role) {
    const all = await this.page.evaluate(() => deepshadow.controls());
    return all.filter((one) => one.label === label && (!role || one.role === role));
  }

  /** One control; it may take a frame until it is there. */
  async control(label, role) {
    for (let turn = 0; turn < 100; turn += 1) {
      const found = await this.controls(label, role);
      if (found.length > 0) {
        return found.at(-1);
      }
      await this.page.waitForTimeout(50);
    }
    throw new Error(`there is no ${role ?? "control"} '${label}'`);
  }

  /** Gives a control a value, or presses it. A box that the window lays out anew meanwhile may miss
   *  that, so it is asked whether it has changed. */
  async act(label, role, value) {
    const before = await this.control(label, role);
    for (let turn = 0; turn < 5; turn += 1) {
      const { id } = await this.control(label, role);
      const done = await this.page.evaluate(([id, value]) => deepshadow.act(id, value), [id, value]);
      if (!done) {
        throw new Error(`${label} is gone`);
      }
      await this.page.waitForTimeout(200);
      if (role !== "CheckBox") {
        return;
      }
      await this.controls(label, role);
      await this.page.waitForTimeout(200);
      const [now] = await this.controls(label, role);
      if (now?.value !== before.value) {
        return;
      }
    }
    throw new Error(`${label} stays ${before.value}`);
  }

  /** All controls, as a frame shows them that is drawn now. */
  async fresh() {
    await this.page.evaluate(() => deepshadow.controls());
    await this.page.waitForTimeout(150);
    return this.page.evaluate(() => deepshadow.controls());
  }

  /** Clicks on a control. */
  async click({ place: [left, top, right, bottom] }) {
    await this.page.mouse.click((left + right) / 2, (top + bottom) / 2);
  }

  /** Chooses an item of a list, which takes some frames to open. */
  async choose(list, item) {
    const known = new Set((await this.fresh()).map((one) => one.id));
    await this.click(await this.control(list, "ComboBox"));
    for (let turn = 0; turn < 50; turn += 1) {
      const items = await this.fresh();
      const found = items.find((one) => one.label === item && !known.has(one.id));
      if (found) {
        await this.click(found);
        await this.page.waitForTimeout(200);
        return;
      }
    }
    throw new Error(`no ${item} in ${list}`);
  }

  /** The picture's width, height and bytes. */
  async pixels() {
    const [width, height, bytes] = await this.page.evaluate(() => {
      const [width, height, bytes] = deepshadow.pixels();
      let text = "";
      for (let at = 0; at < bytes.length; at += 32768) {
        text += String.fromCharCode(...bytes.subarray(at, at + 32768));
      }
      return [width, height, btoa(text)];
    });
    return { width, height, bytes: Buffer.from(bytes, "base64") };
  }

  /** What the browser saves while something is done. */
  async saved(work) {
    const [download] = await Promise.all([this.page.waitForEvent("download"), work()]);
    const folder = mkdtempSync(join(tmpdir(), "saved-"));
    const path = join(folder, download.suggestedFilename());
    await download.saveAs(path);
    return path;
  }

  /** The scene file that repeats the picture. */
  saveScene() {
    return this.saved(() => this.script("scene scene.toml"));
  }

  /** The pixels of a PNG file, by the browser. */
  async decoded(path) {
    const [width, height, bytes] = await this.page.evaluate(async (text) => {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      const options = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
      const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }), options);
      const canvas = new OffscreenCanvas(image.width, image.height);
      const drawing = canvas.getContext("2d");
      drawing.drawImage(image, 0, 0);
      const { data } = drawing.getImageData(0, 0, image.width, image.height);
      let out = "";
      for (let at = 0; at < data.length; at += 32768) {
        out += String.fromCharCode(...data.subarray(at, at + 32768));
      }
      return [image.width, image.height, btoa(out)];
    }, readFileSync(path).toString("base64"));
    return { width, height, bytes: Buffer.from(bytes, "base64") };
  }

  /** The largest difference of any channel to what the program draws of the same scene, whose files
   *  are in `folder`, on one of its backends. */
  async differenceToProgram(folder, backend = "cpu") {
    const scene = join(folder, "seen.toml");
    copyFileSync(await this.saveScene(), scene);
    const own = await this.pixels();
    const output = join(mkdtempSync(join(tmpdir(), "rendered-")), "native.png");
    const program = process.env.DEEPSHADOW;
    const ran = spawnSync(program, ["render", scene, "--backend", backend, "-o", output]);
    if (ran.status !== 0) {
      throw new Error(ran.stderr.toString());
    }
    return difference(own, await this.decoded(output));
  }
}

/** The largest difference of any channel. */
export function difference(a, b) {
  if (a.width !== b.width || a.height !== b.height) {
    throw new Error(`${a.width} x ${a.height} is not ${b.width} x ${b.height}`);
  }
  let largest = 0;
  for (let at = 0; at < a.bytes.length; at += 1) {
    largest = Math.max(largest, Math.abs(a.bytes[at] - b.bytes[at]));
  }
  return largest;
}

/** Drops files on the page. */
export async function drop(explorer, files) {
  const given = files.map(([name, bytes]) => [name, bytes.toString("base64")]);
  await explorer.page.evaluate((given) => {
    const data = new DataTransfer();
    for (const [name, text] of given) {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      data.items.add(new File([bytes], name));
    }
    const canvas = document.getElementById("explorer");
    const about = { dataTransfer: data, bubbles: true, cancelable: true };
    canvas.dispatchEvent(new DragEvent("dragover", about));
    canvas.dispatchEvent(new DragEvent("drop", about));
  }, given);
}
