// A server for a folder, and a browser that looks at it. It knows nothing of the explorer.

import { spawnSync } from "node:child_process";
import { createServer } from "node:http";
import { mkdtempSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, normalize } from "node:path";

import { chromium } from "playwright-core";

const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm" };

/** Serves `folder` under a path, as any server does. */
export async function serve(folder, under = "/some/where/") {
  const server = createServer((request, answer) => {
    const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
    const name = normalize(path.slice(under.length) || "index.html");
    try {
      if (!path.startsWith(under) || name.startsWith("..")) {
        throw new Error("elsewhere");
      }
      const file = join(folder, name);
      statSync(file);
      answer.setHeader("content-type", TYPES[name.split(".").pop()] ?? "application/octet-stream");
      answer.end(readFileSync(file));
    } catch {
      answer.statusCode = 404;
      answer.end();
    }
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  const address = `http://127.0.0.1:${server.address().port}${under}`;
  return { address, close: () => server.close() };
}

/** The browser's program. */
function program() {
  const names = [process.env.CHROMIUM, "chromium", "chromium-browser", "google-chrome"];
  const found = names.filter(Boolean).find((name) => {
    return spawnSync("sh", ["-c", `command -v "${name}"`]).status === 0;
  });
  if (!found) {
    throw new Error("these tests need Chromium: apt-get install chromium, or set CHROMIUM");
  }
  return spawnSync("sh", ["-c", `command -v "${found}"`]).stdout.toString().trim();
}

/** A browser without a window, with WebGPU by software if `gpu` says so. */
export async function browse({ gpu }) {
  const webgpu = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"];
  const folder = mkdtempSync(join(tmpdir(), "browser-"));
  const context = await chromium.launchPersistentContext(folder, {
    executablePath: program(),
    headless: true,
    acceptDownloads: true,
    viewport: { width: 1280, height: 720 },
    args: [
      "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync", "--ignore-gpu-blocklist",
      "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
      ...(gpu ? webgpu : ["--disable-features=WebGPU", "--disable-webgpu"]),
    ],
  });
  const close = async () => {
    await context.close();
    rmSync(folder, { recursive: true, force: true });
  };
  return { context, close };
}

/** A page that hears all requests and all that goes wrong. */
export async function listen(context, address, size) {
  const page = await context.newPage();
  if (size) {
    await page.setViewportSize(size);
  }
  const requests = [];
  const errors = [];
  page.on("request", (request) => requests.push(request.url()));
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => {
    if (message.type() === "error") {
      errors.push(message.text());
    }
  });
  await page.goto(address);
  return { page, requests, errors };
}
