// The page in Chromium, on a screen's and on a phone's size: node --test extras/web/tests
//   JOSTLE_PAGE    the folder that extras/web/build wrote
//   JOSTLE_TOOL    the command jostle, whose answers the page's are compared with
//   JOSTLE_SOURCE  the project
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { once } from "node:events";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";

import axe from "axe-core";
import pixelmatch from "pixelmatch";
import { chromium } from "playwright-core";
import { PNG } from "pngjs";
import { preview } from "vite";

const { JOSTLE_PAGE: folder, JOSTLE_TOOL: tool, JOSTLE_SOURCE: source } = process.env;
const web = path.join(source, "extras", "web");
const scratch = path.join(tmpdir(), `jostle-page-${process.pid}`);
const isolated = {
  "Cross-Origin-Opener-Policy": "same-origin",
  "Cross-Origin-Embedder-Policy": "require-corp",
};
const desktop = { viewport: { width: 1100, height: 700 } };
const phone = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 1, hasTouch: true, isMobile: true };

let browser;
let servers;

/** Serves the page; returns its address. */
async function serve(headers) {
  const server = await preview({
    configFile: false,
    root: web,
    logLevel: "error",
    build: { outDir: folder },
    preview: { host: "127.0.0.1", port: 0, headers },
  });
  return { server, address: `http://127.0.0.1:${server.httpServer.address().port}/` };
}

before(async () => {
  mkdirSync(scratch, { recursive: true });
  servers = { isolated: await serve(isolated), plain: await serve({}) };
  browser = await chromium.launch({
    executablePath: "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
  });
});
after(async () => {
  await browser?.close();
  for (const { server } of Object.values(servers ?? {})) await server.close();
});

/** Opens the page, hands it to `work`, and sees that it had no error and asked nobody else for anything. */
async function onPage(
  hash,
  { server = "isolated", prepare, expectErrors = false, ...options } = desktop,
  work,
) {
  const context = await browser.newContext({
    reducedMotion: "no-preference",
    colorScheme: "dark",
    ...options,
  });
  const page = await context.newPage();
  page.setDefaultTimeout(120_000); // machines that test have other work, too
  const wrong = [];
  const { address } = servers[server] ?? { address: server };
  page.on("pageerror", (error) => wrong.push(error.message));
  page.on("console", (entry) => entry.type() === "error" && wrong.push(entry.text()));
  page.on("request", (request) => {
    if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(address))
      wrong.push(`asked for ${request.url()}`);
  });
  page.on("requestfailed", (request) => wrong.push(`didn't get ${request.url()}`));
  try {
    await prepare?.(page);
    await page.goto(address + hash);
    await page.waitForFunction(() => window.jostle?.stats());
    await work(page);
    if (!expectErrors) assert.deepEqual(wrong, []);
  } finally {
    await context.close();
  }
}

const stats = (page) => page.evaluate(() => window.jostle.stats());
const still = (scene, n, seed, frame = 3) => `#scene=${scene}&n=${n}&seed=${seed}&frame=${frame}&paused=1`;
const shown = (page, id) => page.locator(`#${id}`);

/** What the native command finds in the third frame of a scene: that is the one that it reports. */
function natively(scene, n, seed) {
  const file = path.join(scratch, `${scene}.json`);
  execFileSync(
    tool,
    ["bench", scene, "-n", String(n), "--seed", String(seed), "--frames", "1", "--json", file],
    {
      stdio: ["ignore", "ignore", "inherit"],
    },
  );
  const rows = JSON.parse(readFileSync(file, "utf8"));
  const { pairs, checksum } = rows[0];
  return { pairs, checksum };
}

test("opens on 20,000 bodies that move, and tells their numbers", async () => {
  await onPage("", desktop, async (page) => {
    const first = await stats(page);
    assert.equal(first.scene, "uniform");
    assert.equal(first.n, 20_000);
    assert.equal(first.seed, 1);
    assert.ok(first.pairs > 4000 && first.ms > 0);
    await page.waitForFunction(() => window.jostle.stats().frame >= 2);
    const later = await stats(page);
    assert.notEqual(later.checksum, first.checksum);
    assert.equal(later.drawn.boxes, 20_000);
    assert.ok(later.drawn.pairs > 4000);
    assert.match(await shown(page, "pairs").textContent(), /^\d,\d\d\d$/);
    assert.match(await shown(page, "ms").textContent(), /^[\d.]+ ms$/);
    assert.equal(new URL(page.url()).hash, "#scene=uniform&n=20000&seed=1&size=50");
    await page.waitForFunction(() => / m?s$/.test(document.getElementById("brute").textContent));
    assert.match(await shown(page, "brute-label").textContent(), /^by brute force: [\d,.]+x$/);
  });
});

for (const [scene, n, seed] of [
  ["uniform", 20_000, 1],
  ["powerlaw", 3000, 7],
  ["clustered", 5000, 4_000_000_000],
])
  test(`finds the native command's pairs: ${scene}, ${n}, on one thread and on several`, async () => {
    const expected = natively(scene, n, seed);
    await onPage(still(scene, n, seed), { server: "plain" }, async (page) => {
      const { pairs, checksum, threads, frame } = await stats(page);
      assert.deepEqual({ pairs, checksum, threads, frame }, { ...expected, threads: 1, frame: 3 });
    });
    await onPage(still(scene, n, seed) + "&threads=2", { server: "isolated" }, async (page) => {
      const { pairs, checksum, threads, frame } = await stats(page);
      assert.deepEqual({ pairs, checksum, threads, frame }, { ...expected, threads: 2, frame: 3 });
    });
  });

test("goes on to another scene, number, size and seed; the address follows, and leads back", async () => {
  await onPage(still("uniform", 2000, 1, 0), desktop, async (page) => {
    const before = await stats(page);
    await shown(page, "scene").selectOption("mixed");
    await page.waitForFunction(() => window.jostle.stats().scene === "mixed");
    await shown(page, "n").focus();
    await page.keyboard.press("Home");
    await page.waitForFunction(() => window.jostle.stats().n === 1000);
    await shown(page, "ratio").focus();
    await page.keyboard.press("End");
    await page.waitForFunction(() => window.jostle.stats().ratio === 1000);
    const ordinary = await stats(page);
    await shown(page, "again").click();
    await page.waitForFunction(() => window.jostle.stats().seed === 2);
    const other = await stats(page);
    assert.notEqual(other.checksum, ordinary.checksum);
    assert.equal(new URL(page.url()).hash, "#scene=mixed&n=1000&seed=2&ratio=1000&paused=1");
    await page.evaluate((hash) => (location.hash = hash), still("uniform", 2000, 1, 0));
    await page.waitForFunction((checksum) => window.jostle.stats().checksum === checksum, before.checksum);
  });
});

test("nonsense in the address opens what can be opened", async () => {
  await onPage("#scene=nothing&n=many&seed=-1&motion=1e9&paused=1", desktop, async (page) => {
    const { scene, n, seed } = await stats(page);
    assert.deepEqual({ scene, n, seed }, { scene: "uniform", n: 20_000, seed: 1 });
  });
});

test("brute force is measured, and reckoned for more boxes than one waits for", async () => {
  await onPage(still("uniform", 2000, 1), desktop, async (page) => {
    await page.waitForFunction(() => /^[\d.]+ ms$/.test(document.getElementById("brute").textContent));
    await page.evaluate((hash) => (location.hash = hash), still("uniform", 200_000, 1, 0));
    await page.waitForFunction(() =>
      /^about [\d.]+ (s|min)$/.test(document.getElementById("brute").textContent),
    );
  });
});

test("the glass box under the mouse lights what it touches", async () => {
  await onPage(still("uniform", 5000, 1, 0), desktop, async (page) => {
    const { x, y, width, height } = await page.locator("canvas").boundingBox();
    await page.mouse.move(x + width / 2, y + height / 2);
    await page.waitForFunction(
      () => window.jostle.stats().drawn.probes === 1 && window.jostle.stats().drawn.chosen > 0,
    );
    await page.waitForFunction(() =>
      document
        .getElementById("hint")
        .textContent.startsWith(`Your box touches ${window.jostle.stats().drawn.chosen} of`),
    );
    await page.mouse.move(x + width + 40, y + height / 2); // beside the picture
    await page.waitForFunction(
      () => window.jostle.stats().drawn.probes === 0 && window.jostle.stats().drawn.chosen === 0,
    );
    await page.mouse.click(x + width / 2, y + height / 2); // a box that is selected comes first
    await page.waitForFunction(() => window.jostle.stats().chosen !== undefined);
    await page.mouse.move(x + width / 2 + 9, y + height / 2);
    await page.waitForTimeout(300);
    const { chosen } = await stats(page);
    assert.match(
      await shown(page, "chosen").textContent(),
      new RegExp(`^Box ${chosen.toLocaleString("en-US")} `),
    );
  });
});

test("boxes and pairs are saved, and the code of the scene finds the same", async () => {
  const saved = async (page, id) => {
    const [download] = await Promise.all([page.waitForEvent("download"), shown(page, id).click()]);
    return readFileSync(await download.path());
  };
  const lines = (text) => text.toString().trim().split("\n").sort();
  await onPage("#scene=uniform&n=2000&seed=5&size=150&frame=3&paused=1", desktop, async (page) => {
    const { pairs, checksum } = await stats(page);
    const boxes = await saved(page, "save-boxes");
    assert.deepEqual(ofFile("boxes.npy", boxes), { n: 2000, pairs, checksum });
    const table = execFileSync(tool, ["pairs", path.join(scratch, "boxes.npy")]);
    assert.deepEqual(lines(await saved(page, "save-pairs")), lines(table));
    await shown(page, "code").click();
    assert.match(
      await shown(page, "code-note").textContent(),
      new RegExp(`^2,000 boxes, .* checksum ${checksum}`),
    );
    for (const [language, words] of [
      ["C++", "std::vector<jostle::Aabb3f> boxes(2000);"],
      ["Python", 'np.load("boxes.npy")'],
      ["JavaScript", 'readBoxes(bytes, "boxes.npy")'],
      ["Command line", "jostle pairs boxes.npy --stats"],
    ]) {
      await page.locator("#languages button", { hasText: language }).click();
      assert.ok((await shown(page, "code-text").textContent()).includes(words), language);
    }
    await page.keyboard.press("Escape");
  });
  await onPage(still("powerlaw", 1000, 4), desktop, async (page) => {
    await shown(page, "code").click();
    await page.locator("#languages button", { hasText: "JavaScript" }).click();
    const code = await shown(page, "code-text").textContent();
    assert.ok(code.includes('jostle.scene("powerlaw", 1000, 4)') && code.includes("k < 3;"));
  });
});

test("samples: names of boxes, whose pairs are saved with them; what stands still has no Pause", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    for (const [name, file, n] of [
      ["a chip layout", "chip.csv", 1771],
      ["a crowd", "crowd.csv", 3000],
      ["an assembly", "assembly.csv", 312],
    ]) {
      await page.locator("#samples button", { hasText: name }).click();
      await page.waitForFunction((file) => window.jostle.stats().scene === file, file);
      const { n: count, pairs } = await stats(page);
      assert.equal(count, n);
      assert.ok(pairs > 50, name);
      assert.equal(await shown(page, "moves").isVisible(), false);
    }
    await page.locator("canvas").press("Enter");
    await page.waitForFunction(() => !document.getElementById("chosen").hidden);
    assert.match(await shown(page, "chosen").textContent(), /^(pipe|bolt|post) \d+ from/);
    const [download] = await Promise.all([page.waitForEvent("download"), shown(page, "save-pairs").click()]);
    assert.match(
      readFileSync(await download.path(), "utf8"),
      /^a,b\n(pipe|bolt|post) \d+,(pipe|bolt|post) \d+\n/,
    );
  });
});

/** Has the page read a file, from its name and bytes. */
const choose = (page, name, bytes) =>
  page.setInputFiles("#file", { name, mimeType: "application/octet-stream", buffer: Buffer.from(bytes) });

/** What `jostle pairs` says of a file: its numbers, or its complaint. */
function ofFile(name, bytes, ...options) {
  const file = path.join(scratch, name);
  if (bytes) writeFileSync(file, bytes);
  try {
    const said = execFileSync(tool, ["pairs", bytes ? name : bytesOf(name), ...options, "--stats"], {
      cwd: scratch,
      stdio: "pipe",
    });
    const { objects, pairs, checksum } = JSON.parse(said);
    return { n: objects, pairs, checksum };
  } catch (error) {
    return error.stderr.toString();
  }
}
const bytesOf = (name) => path.join(source, "tool", "data", name);

test("files: a recording, a table, an array and a mesh show the native command's pairs", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    const same = async (name, expected, frame) => {
      await page.waitForFunction(
        ([name, frame]) =>
          window.jostle.stats().scene === name &&
          (frame === undefined || window.jostle.stats().frame === frame),
        [name, frame],
      );
      const { n, pairs, checksum } = await stats(page);
      assert.deepEqual({ n, pairs, checksum }, expected, name);
    };
    await choose(page, "tumble.jrec", readFileSync(bytesOf("tumble.jrec")));
    await same("tumble.jrec", ofFile("tumble.jrec"));
    await shown(page, "time").evaluate((slider) => {
      slider.value = "100";
      slider.dispatchEvent(new Event("input"));
    });
    await same("tumble.jrec", ofFile("tumble.jrec", undefined, "--frame", "100"), 100);

    const table = "id,lo_x,lo_y,hi_x,hi_y\na,0,0,2,1\nb,2,1,3,3\nc,9,9,9,9\n";
    await choose(page, "boxes.csv", table);
    await same("boxes.csv", ofFile("boxes.csv", table));
    assert.equal(await shown(page, "n-shown").textContent(), "3");

    const header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2, 3), }".padEnd(117) + "\n";
    const numbers = Float64Array.of(1e9, 0, 0, 1e9 + 1, 1, 1, 1e9 + 1, 1, 1, 1e9 + 2, 2, 2);
    const array = Buffer.concat([
      Buffer.from("\x93NUMPY\x01\x00", "latin1"),
      Buffer.of(header.length, 0),
      Buffer.from(header),
      Buffer.from(numbers.buffer),
    ]);
    await choose(page, "boxes.npy", array);
    await same("boxes.npy", ofFile("boxes.npy", array));

    const mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nf 1 2 3\nf 1 3 4\n";
    const data = await page.evaluateHandle((text) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([text], "mesh.obj"));
      return transfer;
    }, mesh);
    await page.dispatchEvent("canvas", "drop", { dataTransfer: data });
    await same("mesh.obj", ofFile("mesh.obj", mesh));
  });
});

test("files that can't be read get the native command's complaint, and the scene stays", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    const before = await stats(page);
    for (const [name, bytes] of [
      ["bad.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n3,0,2,1\n"],
      ["bad.npy", "\x93NUMPY\x01\x00"],
      ["bad.jrec", "this is no recording, however long it is, and it goes on and on"],
    ]) {
      await choose(page, name, bytes);
      const complaint = ofFile(name, bytes).replace(/^jostle( pairs)?: /, "").trim();
      await page.waitForFunction(
        (name) => document.getElementById("message").textContent.includes(name),
        name,
      );
      assert.equal(await shown(page, "message").textContent(), complaint);
      assert.deepEqual(await stats(page), before);
    }
    await choose(page, "bad.glb", "glTF, or so it says");
    await page.waitForFunction(() => document.getElementById("message").textContent.startsWith("bad.glb: "));
    assert.deepEqual(await stats(page), before);
    await page.keyboard.press("Escape");
    assert.equal(await shown(page, "message").isVisible(), false);
  });
});

/**
 * Has the command serve the page, hands on its address and what follows it, and ends the command as Ctrl-C
 * does.
 */
async function served(command, work) {
  const program = spawn(tool, [...command, "--page", folder], { cwd: scratch });
  const ended = once(program, "exit");
  const address = await new Promise((found, failed) => {
    let said = "";
    for (const stream of [program.stdout, program.stderr])
      stream.on("data", (text) => {
        said += text;
        const [, server, hash] = /(http:\/\/[^#\s]*)(#\S*)/.exec(said) ?? [];
        if (hash) found({ server, hash });
      });
    program.on("exit", () => failed(new Error(said)));
  });
  try {
    await work(address);
  } finally {
    program.kill("SIGINT");
    assert.deepEqual(await ended, [0, null]);
  }
}

test("jostle replay opens a recording, at the frame that the address names", async () => {
  await served(["replay", bytesOf("tumble.jrec")], async ({ server, hash }) => {
    for (const frame of [0, 100])
      await onPage(`${hash}&frame=${frame}&paused=1`, { ...desktop, server }, async (page) => {
        await page.waitForFunction((frame) => window.jostle.stats().frame === frame, frame);
        const { scene, n, pairs, checksum } = await stats(page);
        const expected = ofFile("tumble.jrec", undefined, "--frame", String(frame));
        assert.deepEqual({ scene, n, pairs, checksum }, { scene: "tumble.jrec", ...expected });
        assert.equal(await page.evaluate(() => crossOriginIsolated), true);
        await shown(page, "step").click();
        await page.waitForFunction((frame) => window.jostle.stats().frame === frame + 1, frame);
        assert.equal(new URL(page.url()).hash, `#file=data%2Ftumble.jrec&frame=${frame + 1}&paused=1`);
      });
  });
});

test("jostle simulate --watch shows the simulation while it runs, to its last frame", async () => {
  const simulate = [
    "simulate",
    "--scene",
    "mixed",
    "-n",
    "500",
    "--frames",
    "90",
    "--record",
    "watched.jrec",
    "--watch",
  ];
  await served(simulate, async ({ server, hash }) => {
    await onPage(hash, { ...desktop, server }, async (page) => {
      await page.waitForFunction(() => window.jostle.stats().frame === 90 && window.jostle.stats().paused);
      const { scene, n, pairs, checksum } = await stats(page);
      assert.equal(scene, "jostle simulate --scene mixed -n 500 --seed 1");
      const file = path.join(scratch, "watched.jrec");
      const expected = JSON.parse(execFileSync(tool, ["pairs", file, "--frame", "90", "--stats"]));
      assert.deepEqual(
        { n, pairs, checksum },
        { n: 500, pairs: expected.pairs, checksum: expected.checksum },
      );
    });
  });
});

test("an address whose file or program is gone: words, and the scene", async () => {
  await served(["replay", bytesOf("tumble.jrec")], async ({ server }) => {
    for (const [hash, words] of [
      ["#file=data/gone.jrec", "gone.jrec: this page's server has no such file."],
      ["#file=//example.org/x.csv", "x.csv: this page's server has no such file."],
      ["#live=live", "the program that this page showed has ended."],
    ])
      await onPage(`${hash}&n=1000&paused=1`, { ...desktop, server, expectErrors: true }, async (page) => {
        await page.waitForFunction(
          (words) => document.getElementById("message").textContent === words,
          words,
        );
        assert.equal((await stats(page)).scene, "uniform");
      });
  });
});

test("a table that is pasted is read, or complained of", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    const paste = (text) =>
      page.evaluate((text) => {
        const clipboardData = new DataTransfer();
        clipboardData.setData("text/plain", text);
        window.dispatchEvent(new ClipboardEvent("paste", { clipboardData }));
      }, text);
    const words = () => shown(page, "message").textContent();
    const before = await stats(page);
    await paste("lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n1,zero,2,2\n");
    await page.waitForFunction(() => !document.getElementById("message").hidden);
    const complaint = /^pasted.csv:3:2: lo_y is "zero", which is not a number; write one like/;
    assert.match(await words(), complaint);
    assert.deepEqual(await stats(page), before);
    const all = ["0 0 1 1", "1 1 2 2", "2 2 3 3"];
    for (const [rows, separator] of [[all.slice(1), ","], [all, "\t"]]) {
      await paste(["lo_x lo_y hi_x hi_y", ...rows, ""].join("\n").replaceAll(" ", separator));
      await page.waitForFunction((n) => window.jostle.stats().n === n, rows.length);
      const { scene, pairs } = await stats(page);
      assert.deepEqual([await words(), scene, pairs], ["", "pasted.csv", rows.length - 1]);
    }
  });
});

test("boxes in a plane are looked at straight on", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    await page.addStyleTag({
      content: "header, .figures, .stage::before, .stage::after { display: none !important }",
    });
    await choose(page, "flat.csv", "lo_x,lo_y,hi_x,hi_y\n0,0,1,1\n");
    await page.waitForFunction(() => window.jostle.stats().scene === "flat.csv");
    await page.waitForTimeout(500);
    const { width, height, data } = PNG.sync.read(await page.locator("canvas").screenshot());
    const brightness = (x, y) => [0, 1, 2].reduce((sum, c) => sum + data[4 * (y * width + x) + c], 0);
    /** Where, from above, a column of the picture meets the box. */
    const top = (part) => {
      const x = Math.round(part * width);
      for (let y = 1; y < height; ++y) if (Math.abs(brightness(x, y) - brightness(x, 0)) > 20) return y;
      return Infinity;
    };
    const [left, right] = [top(0.4), top(0.6)];
    assert.ok(left > 0.05 * height && left < 0.4 * height, `${left} of ${height}`);
    assert.ok(Math.abs(left - right) <= 2, `${left}, ${right}`);
  });
});

test("without SIMD in WebAssembly the page finds the same pairs, and says what that costs", async () => {
  const prepare = (page) =>
    page.route(/engine\.worker.*\.js$/, async (route) => {
      const response = await route.fetch();
      const refuse = "WebAssembly.validate = () => false;";
      await route.fulfill({ response, body: refuse + (await response.text()) });
    });
  for (const server of ["plain", "isolated"])
    await onPage(still("powerlaw", 3000, 7), { ...desktop, prepare, server }, async (page) => {
      const { pairs, checksum, threads, instructionSet } = await stats(page);
      const expected = { ...natively("powerlaw", 3000, 7), threads: 1, instructionSet: "scalar" };
      assert.deepEqual({ pairs, checksum, threads, instructionSet }, expected);
      assert.match(await shown(page, "threads-note").textContent(), /^Without SIMD/);
      assert.equal(await shown(page, "threads").isDisabled(), true);
    });
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    assert.equal((await stats(page)).instructionSet, "wasm_simd");
    assert.equal(await shown(page, "threads-note").isVisible(), false);
  });
});

test("where threads can't begin one does it all, and the page says why", async () => {
  // Requests of the engine's own workers aren't routed: they are led astray where they are made.
  const prepare = (page) =>
    page.route(/engine\.worker.*\.js$/, async (route) => {
      const response = await route.fetch();
      const astray =
        "const One = Worker; globalThis.Worker = class extends One { constructor() { super('data:,%'); } };";
      await route.fulfill({ response, body: astray + (await response.text()) });
    });
  const options = { ...desktop, prepare, expectErrors: true };
  await onPage(still("powerlaw", 3000, 7) + "&threads=2", options, async (page) => {
    const { pairs, checksum, threads } = await stats(page);
    assert.deepEqual({ pairs, checksum, threads }, { ...natively("powerlaw", 3000, 7), threads: 1 });
    const note = await shown(page, "threads-note").textContent();
    assert.match(note, /^One thread: a thread couldn't be started/);
    assert.equal(await shown(page, "threads").isDisabled(), true);
  });
});

test("the keyboard alone does everything", async () => {
  await onPage(still("uniform", 2000, 1, 0), desktop, async (page) => {
    for (const id of ["code", "canvas"]) {
      await page.keyboard.press("Tab");
      assert.equal(await page.evaluate(() => document.activeElement.id), id);
    }
    const picture = async () => (await page.locator("canvas").screenshot()).toString("base64");
    const before = await picture();
    await page.keyboard.press("ArrowLeft");
    await page.keyboard.press("+");
    await page.waitForTimeout(300);
    assert.notEqual(await picture(), before);
    await page.keyboard.press(".");
    await page.waitForFunction(() => window.jostle.stats().frame === 1);
    await page.keyboard.press("Enter");
    await page.waitForFunction(() => window.jostle.stats().chosen !== undefined);
    await page.waitForFunction(
      () => window.jostle.stats().drawn.chosen >= 1 && window.jostle.stats().drawn.bricks >= 1,
    );
    assert.match(
      await shown(page, "chosen").textContent(),
      /^Box [\d,]+ from \(.*\) to \(.*\)\. It (lies in one|reaches into)/,
    );
    await page.keyboard.press("Escape");
    await page.waitForFunction(() => window.jostle.stats().chosen === undefined);
    await page.keyboard.press("Space");
    await page.waitForFunction(() => !window.jostle.stats().paused && window.jostle.stats().frame > 2);
    await page.keyboard.press("Space");
    assert.equal((await stats(page)).paused, true);
    const reached = new Set();
    for (let k = 0; k < 32; ++k) {
      await page.keyboard.press("Tab");
      reached.add(await page.evaluate(() => document.activeElement.id));
    }
    const controls = await page.locator("aside :is(button, input, select):enabled").evaluateAll((all) =>
      all.filter((one) => one.offsetParent !== null).map((one) => one.id),
    );
    for (const id of controls) assert.ok(reached.has(id), `Tab doesn't reach '${id}'`);
  });
});

test("a picked box touches as many as the pairs say, each pair has one brick that reports it", async () => {
  await onPage(still("dense", 3000, 1, 0), desktop, async (page) => {
    await page.locator("canvas").click();
    await page.waitForFunction(
      () => window.jostle.stats().chosen !== undefined && window.jostle.stats().drawn.chosen > 0,
    );
    const { chosen, drawn } = await stats(page);
    const text = await shown(page, "chosen").textContent();
    assert.ok(text.startsWith(`Box ${chosen.toLocaleString("en-US")} from`));
    const rows = await page.locator("#chosen li").allTextContents();
    assert.equal(rows.length, drawn.chosen - 1);
    for (const row of rows)
      assert.match(row, /they share [\d.]+ × [\d.]+ × [\d.]+, least along [xyz]; brick \d+ reports it/);
    // The records of its brick: as many bars and rows as are said, one of them its own, and its bounds are
    // quantised outwards.
    const begins = /in brick \d+, which holds (\d+) records, .* here ([\d,]+|one), of which (\d+|none) touch/;
    const told = begins.exec(text);
    assert.ok(told, text);
    assert.equal(drawn.records, Number(told[1]));
    assert.equal(await page.locator("#chosen .records tr").count(), Number(told[1]) + 1);
    assert.match(
      await page.locator("#chosen .records tr.own").textContent(),
      new RegExp(`^${chosen}\\d+ – `),
    );
    const bars = (name) => page.locator(`#chosen rect.${name}`).count();
    assert.equal(await bars("own"), 1);
    const compared = told[2] === "one" ? 1 : Number(told[2]);
    assert.equal((await bars("compared")) + (await bars("touches")), Math.min(compared, 49));
    await page.locator("#chosen summary").click();
    assert.equal(await page.locator("#chosen .records").isVisible(), true);
    await shown(page, "let-go").click();
    await page.waitForFunction(() => window.jostle.stats().drawn.chosen === 0);
  });
});

test("bricks, cut and race", async () => {
  await onPage(still("uniform", 3000, 1, 0), desktop, async (page) => {
    await shown(page, "show-bricks").check();
    await page.waitForFunction(() => window.jostle.stats().drawn.bricks > 1);
    const whole = await page.locator("canvas").screenshot();
    await shown(page, "cut").focus();
    for (let k = 0; k < 5; ++k) await page.keyboard.press("PageDown");
    await page.waitForTimeout(300);
    assert.notEqual((await page.locator("canvas").screenshot()).toString("base64"), whole.toString("base64"));
    await shown(page, "race").click();
    await page.locator("#race-result .verdict").waitFor();
    const { pairs } = await stats(page);
    assert.equal(
      await page.locator("#race-result .verdict").textContent(),
      `All that ran found the same ${pairs.toLocaleString("en-US")} pairs.`,
    );
    assert.equal(await page.locator("#race-result .bar").count(), 4);
  });
});

test("falling bodies fall", async () => {
  await onPage("#scene=falling-spheres&n=1000&seed=1", desktop, async (page) => {
    await page.waitForFunction(() => window.jostle.stats().frame > 5 && window.jostle.stats().pairs > 0);
    assert.equal((await stats(page)).n, 1000);
  });
});

test("falling bodies are drawn with their contacts, or as boxes alone", async () => {
  for (const kind of ["spheres", "boxes", "mixed"])
    await onPage(`#scene=falling-${kind}&n=1000&seed=1&frame=60&paused=1`, desktop, async (page) => {
      const { drawn } = await stats(page);
      assert.equal(drawn.bodies, 1000);
      assert.ok(drawn.contacts > 100);
      assert.equal(await shown(page, "contacts").textContent(), drawn.contacts.toLocaleString("en-US"));
      const picture = async () => (await page.locator("canvas").screenshot()).toString("base64");
      const before = await picture();
      await shown(page, "show-bodies").uncheck();
      await page.waitForFunction(
        () => window.jostle.stats().drawn.bodies === 0 && window.jostle.stats().drawn.contacts === 0,
      );
      await page.waitForTimeout(300);
      assert.notEqual(await picture(), before);
      assert.equal(await shown(page, "contacts").isVisible(), false);
    });
  await onPage(still("uniform", 1000, 1), desktop, async (page) =>
    assert.equal(await shown(page, "show-bodies").isVisible(), false),
  );
});

test("a cloth falls onto a ball and itself, without a crossing, and makes way for boxes again", async () => {
  await onPage("#scene=cloth&n=1000&seed=1&frame=150&paused=1", desktop, async (page) => {
    const { n, near, crossings, drawn, frame, ms } = await stats(page);
    assert.equal(n, 968); // 22 squares along each side
    assert.ok(near > 100, `${near} pairs are near each other`);
    assert.deepEqual([crossings, frame, drawn.triangles], [0, 150, n]);
    assert.ok(ms > 0);
    const text = (id) => shown(page, id).textContent();
    assert.deepEqual(
      [await text("pairs"), await text("crossings"), await text("bodies")],
      [near.toLocaleString("en-US"), "0", "968"],
    );
    for (const id of ["brute", "race", "show-bricks", "code"])
      assert.equal(await shown(page, id).isVisible(), false, id);
    const picture = async () => (await page.locator("canvas").screenshot()).toString("base64");
    const before = await picture();
    await shown(page, "step").click();
    await page.waitForFunction(() => window.jostle.stats().frame === 151);
    await page.waitForTimeout(300);
    assert.notEqual(await picture(), before);
    await page.locator("canvas").press("Enter"); // a cloth has no boxes to be selected
    await page.evaluate((hash) => (location.hash = hash), still("uniform", 1000, 1));
    await page.waitForFunction(() => window.jostle.stats().n === 1000);
    const { drawn: boxes, chosen, near: none } = await stats(page);
    assert.deepEqual([boxes.triangles, boxes.boxes, chosen, none], [0, 1000, undefined, undefined]);
    assert.equal(await shown(page, "race").isVisible(), true);
    // Chosen where many boxes are, it has no more triangles than a frame has time for.
    await page.evaluate((hash) => (location.hash = hash), still("cloth", 100_000, 1, 0));
    await page.waitForFunction(() => window.jostle.stats().n === 20_000);
    assert.equal((await stats(page)).scene, "cloth");
    assert.equal(new URL(page.url()).hash, "#scene=cloth&n=20000&seed=1&paused=1");
  });
});

test("phone: nothing is wider than the screen, controls fit fingers, a touch picks", async () => {
  await onPage(still("uniform", 2000, 1), phone, async (page) => {
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    const small = await page
      .locator("button:visible, select:visible")
      .evaluateAll((all) =>
        all.filter((one) => one.getBoundingClientRect().height < 44).map((one) => one.id),
      );
    assert.deepEqual(small, []);
    // A complaint lies over what is written there, until it is closed.
    await choose(page, "bad.csv", "lo_x,lo_y,hi_x\n");
    await shown(page, "message").waitFor();
    const covers = await shown(page, "message").evaluate((message) => {
      document.querySelector("header").style.pointerEvents = "auto"; // else it would never be hit
      const { left, top, width, height } = message.getBoundingClientRect();
      const parts = [[0.3, 0.1], [0.5, 0.3], [0.9, 0.9]];
      const points = parts.map(([x, y]) => [left + x * width, top + y * height]);
      return points.every(([x, y]) => document.elementFromPoint(x, y) === message);
    });
    assert.ok(covers);
    await shown(page, "message").tap();
    assert.equal(await shown(page, "message").isVisible(), false);
    await page.touchscreen.tap(195, 260);
    await page.waitForFunction(() => window.jostle.stats().chosen !== undefined);
  });
});

test("a phone on its side: controls beside the picture, which has figures on it alone", async () => {
  for (const [width, height] of [[740, 360], [568, 320]])
    await onPage(still("uniform", 2000, 1), { ...phone, viewport: { width, height } }, async (page) => {
      const [picture, first, last] = await Promise.all(
        ["canvas", "pause", "again"].map((id) => shown(page, id).boundingBox()),
      );
      assert.equal(picture.height, height);
      assert.ok(first.x > picture.width && last.x + last.width < width);
      assert.equal(await shown(page, "legend").isVisible(), false);
    });
});

test("follows the window's size", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    for (const [width, height] of [[1400, 500], [500, 900], [800, 600]]) {
      await page.setViewportSize({ width, height });
      await page.waitForFunction(() => {
        const canvas = document.getElementById("canvas");
        return canvas.width === Math.floor(canvas.clientWidth * window.jostle.stats().drawn.resolution);
      });
      const reaches = await page.evaluate(() => {
        const { scrollWidth, scrollHeight } = document.documentElement;
        return { aside: scrollWidth > innerWidth, down: scrollHeight > innerHeight };
      });
      // On a narrow screen the controls are below the picture, else beside it.
      assert.deepEqual(reaches, { aside: false, down: width <= 760 }, `${width} x ${height}`);
    }
  });
});

test("less motion: rests until somebody presses Play", async () => {
  await onPage("#scene=uniform&n=1000&seed=1", { ...desktop, reducedMotion: "reduce" }, async (page) => {
    await page.waitForTimeout(500);
    const { frame, paused } = await stats(page);
    assert.deepEqual({ frame, paused }, { frame: 0, paused: true });
    await shown(page, "pause").click();
    await page.waitForFunction(() => window.jostle.stats().frame > 0);
  });
});

test("a graphics card that is taken away: words, and the picture comes back", async () => {
  await onPage(still("uniform", 1000, 1), desktop, async (page) => {
    await page.evaluate(() => {
      window.extension = document
        .getElementById("canvas")
        .getContext("webgl2")
        .getExtension("WEBGL_lose_context");
      window.extension.loseContext();
    });
    await page.waitForFunction(() =>
      document.getElementById("message").textContent.includes("graphics card"),
    );
    await shown(page, "step").click(); // the engine goes on
    await page.waitForFunction(() => window.jostle.stats().frame === 4);
    await page.evaluate(() => window.extension.restoreContext());
    await page.waitForFunction(() => document.getElementById("message").hidden);
    await page.waitForTimeout(500);
    const { data } = PNG.sync.read(await page.locator("canvas").screenshot());
    const colours = new Set(new Uint32Array(data.buffer, data.byteOffset, data.length / 4));
    assert.ok(colours.size > 1000, `the picture didn't come back: it has ${colours.size} colours`);
  });
});

test("memory that the browser refuses: words, and the scene before", async () => {
  const prepare = (page) =>
    page.route(/engine\.worker.*\.js$/, async (route) => {
      const response = await route.fetch();
      const refuse = "WebAssembly.Memory.prototype.grow = () => { throw new RangeError('refused'); };";
      await route.fulfill({ response, body: refuse + (await response.text()) });
    });
  await onPage(still("uniform", 1000, 1), { ...desktop, prepare, server: "plain" }, async (page) => {
    const before = await stats(page);
    await shown(page, "n").focus();
    await page.keyboard.press("End");
    await page.waitForFunction(() =>
      /couldn't be made: .*memory/i.test(document.getElementById("message").textContent),
    );
    await page.waitForFunction((n) => window.jostle.stats().n === n, before.n);
    await shown(page, "step").click();
    await page.waitForFunction(() => window.jostle.stats().frame === 1);
  });
});

for (const colorScheme of ["dark", "light"])
  for (const [name, size] of Object.entries({ desktop, phone }))
    test(`everybody can use it: axe-core finds nothing wrong, ${colorScheme}, ${name}`, async () => {
      await onPage(still("uniform", 1000, 1, 0), { ...size, colorScheme }, async (page) => {
        await page.locator("canvas").press("Enter");
        await page.waitForFunction(() => window.jostle.stats().chosen !== undefined);
        await page.evaluate(axe.source);
        const looked = async () => {
          const { violations } = await page.evaluate(() => axe.run());
          assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html)}`), []);
        };
        await looked();
        await shown(page, "code").click();
        await shown(page, "code-text").waitFor();
        await looked();
      });
    });

// Pictures of the view alone: text is drawn in whatever fonts there are. To take them again:
// JOSTLE_TAKE_PICTURES=1.
for (const colorScheme of ["dark", "light"])
  test(`looks as it did: ${colorScheme}`, async () => {
    const file = path.join(web, "tests", `${colorScheme}.png`);
    await onPage(
      still("uniform", 1000, 1),
      { viewport: { width: 900, height: 480 }, colorScheme },
      async (page) => {
        await page.addStyleTag({
          content: "header, .figures, .stage::before, .stage::after { display: none !important }",
        });
        await page.waitForTimeout(500);
        const picture = await page.locator("canvas").screenshot();
        if (process.env.JOSTLE_TAKE_PICTURES) writeFileSync(file, picture);
        const [is, was] = [PNG.sync.read(picture), PNG.sync.read(readFileSync(file))];
        assert.deepEqual([is.width, is.height], [was.width, was.height]);
        const different = pixelmatch(is.data, was.data, null, is.width, is.height, { threshold: 0.15 });
        if (different > 0.01 * is.width * is.height) {
          writeFileSync(path.join(scratch, `${colorScheme}.png`), picture);
          assert.fail(`${different} pixels differ from ${file}; the picture is in ${scratch}`);
        }
      },
    );
  });
