// Makes the picture of the README from the page: node extras/web/picture.mjs DIR docs/images/page.webp
// DIR is what extras/web/build wrote. Needs chromium, and cwebp of Debian's package webp.
// Times are those of bench/results: the same boxes on a quiet machine, which the one that draws needn't be.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";

import { chromium } from "playwright-core";
import { preview } from "vite";

const [folder, out] = process.argv.slice(2).map((name) => path.resolve(name));
if (out === undefined) throw new Error("say what and where: node extras/web/picture.mjs DIR OUT.webp");
const here = import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname);
const [width, height, scene, n] = [800, 420, "powerlaw", 100_000];

const measured = JSON.parse(
  readFileSync(path.join(here, "../../bench/results/epyc-zen5-2-cores/peers-3d.json"), "utf8"),
).filter((row) => row.scene === scene && row.n === n && row.threads === 1 && row.system !== "floor");
const times = measured.map(({ system, median_ms }) => [system, median_ms]).sort((a, b) => a[1] - b[1]);
if (times[0]?.[0] !== "jostle" || times.length < 2)
  throw new Error("nothing to compare with, or lost: choose another scene");

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
  // Four times the pixels, since a processor that draws may leave half of them out: the picture has twice.
  const page = await browser.newPage({
    viewport: { width, height },
    deviceScaleFactor: 4,
    colorScheme: "dark",
  });
  await page.goto(
    `http://127.0.0.1:${server.httpServer.address().port}/#scene=${scene}&n=${n}&seed=1&paused=1`,
  );
  // Words stand beside the boxes.
  await page.addStyleTag({
    content: `aside, .hint, nav, .legend, .stage::before, .stage::after { display: none !important }
      .figures div:has(#frame) { display: none !important }
      main { display: grid; grid-template-columns: 1fr; height: 100% } .stage { height: 100% }
      canvas { position: absolute; left: 230px; width: calc(100% - 230px); outline: none !important }
      header { position: fixed; top: 26px; left: 30px; width: 250px; gap: 8px;
        flex-direction: column; align-items: start }
      .figures { left: 30px; bottom: 26px; gap: 14px; flex-direction: column; align-items: start }
      .figures div:has(#bodies) { order: -1 } .figures :is(dd, .main dd) { font-size: 34px }`,
  });
  await page.waitForFunction(() => window.jostle?.stats(), undefined, { timeout: 120_000 });
  await page.focus("canvas");
  await page.keyboard.press("-"); // further away
  await page.waitForTimeout(10_000); // until all of it is drawn
  await page.evaluate(
    ([[, ms], [other, otherMs], boxes]) => {
      const write = (id, text) => (document.getElementById(id).textContent = text);
      write("bodies", boxes.toLocaleString("en"));
      write("ms-label", "with Jostle, on one core");
      write("ms", `${ms.toFixed(1)} ms`);
      write("brute-label", `with ${other[0].toUpperCase()}${other.slice(1)}, on one core`);
      write("brute", `${otherMs.toFixed(0)} ms`);
    },
    [...times.slice(0, 2), n],
  );
  const file = path.join(scratch, "page.png");
  await page.screenshot({ path: file, timeout: 120_000 });
  execFileSync("cwebp", ["-quiet", "-q", "70", "-m", "6", "-resize", `${2 * width}`, "0", file, "-o", out]);
  console.log(`${out}: ${Math.round(statSync(out).size / 1000)} kB`);
} finally {
  await browser.close();
  await server.close();
  rmSync(scratch, { recursive: true });
}
