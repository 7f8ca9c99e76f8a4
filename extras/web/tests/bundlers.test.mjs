// The package in a stranger's project, with today's bundlers, in development and built: node --test
//   JOSTLE_PACKAGE  the folder with the package's tarball, from npm pack
//   JOSTLE_SCRATCH  a folder to work in; npm installs what bundlers/package.json names
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { cpSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import path from "node:path";
import { after, before, test } from "node:test";

import { chromium } from "playwright-core";

const { JOSTLE_PACKAGE: packed, JOSTLE_SCRATCH: scratch } = process.env;
const project = path.join(scratch ?? "", "bundlers");
const isolated = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
};
const skip = packed === undefined || scratch === undefined;
let browser;

before(async () => {
  if (skip) return;
  rmSync(project, { recursive: true, force: true });
  cpSync(path.join(import.meta.dirname, "bundlers"), project, { recursive: true });
  const npm = (...what) =>
    execFileSync("npm", [...what, "--no-audit", "--no-fund", "--loglevel=error"], {
      cwd: project,
      stdio: "inherit",
    });
  npm("install");
  const tarball = readdirSync(packed).find((name) => /^jostle-.*\.tgz$/.test(name));
  npm("install", "--no-save", path.resolve(packed, tarball));
  browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
});
after(async () => browser?.close());

const run = (...command) => execFileSync("npx", command, { cwd: project, stdio: "pipe" });

/** What the project's page at an address comes to. */
async function titleOf(address) {
  const page = await browser.newPage();
  const wrong = [];
  page.on("pageerror", (error) => wrong.push(error.message));
  try {
    await page.goto(address);
    const told = () => document.title !== "…";
    await page.waitForFunction(told, undefined, { timeout: 60_000 }).catch(() => {});
    return wrong.length > 0 ? wrong.join("; ") : await page.title();
  } finally {
    await page.close();
  }
}

const types = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".mjs": "text/javascript",
  ".wasm": "application/wasm",
};

/** What a folder comes to on a plain web server. */
async function served(folder, headers) {
  const server = createServer((request, response) => {
    const name = path.join(folder, decodeURIComponent(new URL(request.url, "http://x").pathname));
    const file = name.endsWith("/") ? `${name}index.html` : name;
    try {
      const content = readFileSync(file);
      response
        .writeHead(200, { ...headers, "Content-Type": types[path.extname(file)] ?? "text/plain" })
        .end(content);
    } catch {
      response.writeHead(404, headers).end();
    }
  });
  server.listen(0, "127.0.0.1");
  await once(server, "listening");
  try {
    return await titleOf(`http://127.0.0.1:${server.address().port}/`);
  } finally {
    server.close();
  }
}

/** What the development server of the vite in this folder comes to. */
async function developed(home, ...options) {
  const vite = path.join(home, "node_modules", "vite", "bin", "vite.js");
  const address = ["--host", "127.0.0.1", "--port", "0"];
  const server = spawn(process.execPath, [vite, ...address, ...options], { cwd: project });
  try {
    const address = await new Promise((found, failed) => {
      let said = "";
      for (const stream of [server.stdout, server.stderr])
        stream.on("data", (text) => {
          said += text;
          const local = /http:\/\/127\.0\.0\.1:\d+\//.exec(said.replace(/\x1b\[\d*m/g, ""));
          if (local) found(local[0]);
        });
      server.on("exit", () => failed(new Error(said)));
    });
    return await titleOf(address);
  } finally {
    server.kill();
  }
}

const alone = "pairs 0,1, threads 1";
const threaded = "pairs 0,1, threads 2";

// The page's own vite is older, and of those that move a package's scripts away from the modules beside them.
for (const [name, home] of [["vite", project], ["vite 6", path.join(import.meta.dirname, "..")]])
  test(`${name}, in development`, { skip, timeout: 180_000 }, async () => {
    assert.equal(await developed(home), alone);
    assert.equal(await developed(home, "--config", "isolated.config.js"), threaded);
  });

test("vite, built", { skip, timeout: 180_000 }, async () => {
  run("vite", "build", "--outDir", "from-vite");
  assert.equal(await served(path.join(project, "from-vite"), {}), alone);
  assert.equal(await served(path.join(project, "from-vite"), isolated), threaded);
});

for (const mode of ["development", "production"])
  test(`webpack, ${mode}`, { skip, timeout: 180_000 }, async () => {
    const folder = path.join(project, `from-webpack-${mode}`);
    run("webpack", "--mode", mode, "--entry", "./main.js", "--output-path", folder);
    cpSync(path.join(project, "index.html"), path.join(folder, "index.html"));
    assert.equal(await served(folder, {}), alone);
    assert.equal(await served(folder, isolated), threaded);
  });
