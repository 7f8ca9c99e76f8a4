// Makes the moving picture of the README from the page:
//   node extras/web/picture.mjs build/web/page build/ci/tool/jostle docs/images/page.webp
// from what extras/web/build wrote, with the time that the command `jostle` takes for the same frames of the
// same boxes while the picture is made. Needs chromium, and img2webp of Debian's package webp.
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";

import { chromium } from "playwright-core";
import { preview } from "vite";

const [folder, tool, out] = process.argv.slice(2).map((name) => path.resolve(name));
if (out === undefined) throw new Error("say what: node extras/web/picture.mjs DIR JOSTLE OUT.webp");
const here = import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname);
const [width, height, scene, n] = [1000, 525, "powerlaw", 100_000];
// The scene goes on for so many frames and back again, slowly where it turns, so that the picture has no
// seam. A bench leaves out the first frames.
const [pictures, ms, first, frames] = [48, 80, 3, 72];
const frameOf = (picture) =>
  first + Math.round(((frames - 1) * (1 - Math.cos((2 * Math.PI * picture) / pictures))) / 2);

const bench = ["bench", scene, "-n", n, "--seed", 1, "--threads", 1, "--frames", frames, "--json", "-"];
const [{ median_ms: time }] = JSON.parse(execFileSync(tool, bench.map(String)));

const server = await preview({
  configFile: false,
  root: here,
  build: { outDir: folder },
  preview: {
    host: "127.0.0.1",
    port: 0,
    headers: { "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp" },
  },
});
const scratch = mkdtempSync(path.join(tmpdir(), "jostle-picture-"));
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
try {
  const page = await browser.newPage({
    viewport: { width, height },
    deviceScaleFactor: 2,
    colorScheme: "dark",
  });
  page.setDefaultTimeout(300_000);
  // However slowly this machine draws, it is to draw all pixels: the page takes it for a graphics card, and
  // isn't told when it is done.
  await page.addInitScript(() => {
    const { prototype } = WebGL2RenderingContext;
    const { getParameter } = prototype;
    prototype.getParameter = function (name) {
      return name === 0x9246 ? "a graphics card" : getParameter.call(this, name);
    };
    prototype.fenceSync = () => null;
  });
  const { port } = server.httpServer.address();
  await page.goto(
    `http://127.0.0.1:${port}/#scene=${scene}&n=${n}&seed=1&frame=${first}&threads=1&paused=1`,
  );
  // Words stand beside the boxes.
  await page.addStyleTag({
    content: `aside, .hint, nav, .legend, .stage::before, .stage::after { display: none !important }
      .figures div:has(:is(#frame, #brute)) { display: none !important }
      main { display: grid; grid-template-columns: 1fr; height: 100% } .stage { height: 100% }
      canvas { position: absolute; left: 290px; width: calc(100% - 290px); outline: none !important }
      header { position: fixed; top: 34px; left: 38px; width: 300px; gap: 10px;
        flex-direction: column; align-items: start }
      header h1 { font-size: 27px } header .mark { width: 40px; height: 40px }
      .figures { left: 38px; bottom: 36px; gap: 24px; flex-direction: column; align-items: start }
      .figures div:has(#bodies) { order: -1 } .figures :is(dd, .main dd) { font-size: 46px }
      .figures dt { font-size: 17px }`,
  });
  await page.waitForFunction(() => window.jostle?.stats());
  await page.focus("canvas");
  await page.keyboard.press("-"); // further away
  const files = new Map();
  for (let frame = first; frame < first + frames; ++frame) {
    await page.waitForFunction((frame) => window.jostle.stats().frame === frame, frame);
    if (Array.from({ length: pictures }, (_, k) => frameOf(k)).includes(frame)) {
      await page.evaluate(
        async ([time, boxes]) => {
          for (let k = 0; k < 3; ++k) await new Promise(requestAnimationFrame); // until it is drawn
          const write = (id, text) => (document.getElementById(id).textContent = text);
          write("bodies", boxes.toLocaleString("en"));
          write("ms", `${time.toFixed(1)} ms`);
          write("ms-label", "to find them, on one core");
        },
        [time, n],
      );
      files.set(frame, path.join(scratch, `${frame}.png`));
      await page.screenshot({ path: files.get(frame), scale: "css" });
    }
    if (frame + 1 < first + frames) await page.keyboard.press(".");
  }
  const all = Array.from({ length: pictures }, (_, k) => files.get(frameOf(k)));
  const options = ["-loop", "0", "-lossy", "-q", "50", "-m", "6", "-d", String(ms)];
  execFileSync("img2webp", [...options, ...all, "-o", out]);
  console.log(`${out}: ${Math.round(statSync(out).size / 1000)} kB, ${time} ms`);
} finally {
  await browser.close();
  await server.close();
  rmSync(scratch, { recursive: true });
}
