// Makes the moving picture of the README from the page: node extras/web/picture.mjs DIR docs/images/page.webp
// DIR is what extras/web/build wrote. Needs chromium, and img2webp of Debian's package webp.
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";

import { chromium } from "playwright-core";
import { preview } from "vite";

const [folder, out] = process.argv.slice(2).map((name) => path.resolve(name));
if (out === undefined) throw new Error("say what and where: node extras/web/picture.mjs DIR OUT.webp");
const pictures = 24; // forward, and then back again, so that it has no end
const [width, height] = [800, 420];

const server = await preview({
  configFile: false,
  root: import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname),
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
  // Twice the pixels, since a processor that draws leaves half of them out.
  const page = await browser.newPage({
    viewport: { width, height },
    deviceScaleFactor: 2,
    colorScheme: "dark",
  });
  await page.goto(
    `http://127.0.0.1:${server.httpServer.address().port}/#scene=uniform&n=1200&seed=1&paused=1`,
  );
  // Words stand beside the boxes. Times are those of whatever machine makes the picture, and left out.
  await page.addStyleTag({
    content: `aside, .hint, nav, .stage::before, .stage::after { display: none !important }
      .figures div:has(#ms, #brute, #frame) { display: none !important }
      main { display: grid; grid-template-columns: 1fr; height: 100% } .stage { height: 100% }
      canvas { position: absolute; left: 200px; width: calc(100% - 200px); outline: none !important }
      header { position: fixed; top: 22px; left: 26px; width: 210px; gap: 8px;
        flex-direction: column; align-items: start }
      .figures { left: 26px; bottom: 22px; flex-direction: column; align-items: start }
      .figures .main dd { font-size: 40px }
      header .legend { margin-top: 8px }`,
  });
  await page.waitForFunction(() => window.jostle?.stats());
  await page.focus("canvas");
  for (let k = 0; k < 2; ++k) await page.keyboard.press("+"); // nearer
  const [x, y] = [width / 2, height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down(); // turns the view, a little for each picture
  const files = [];
  for (let k = 0; k < pictures; ++k) {
    const { frame } = await page.evaluate(() => window.jostle.stats());
    await page.keyboard.press(".");
    await page.waitForFunction((frame) => window.jostle.stats().frame > frame, frame);
    await page.mouse.move(x + 2 * (k + 1), y);
    await page.waitForTimeout(300);
    const file = path.join(scratch, `${String(k).padStart(3, "0")}.png`);
    await page.screenshot({ path: file, scale: "css" });
    files.push(file);
  }
  const round = [...files, ...files.slice(1, -1).reverse()];
  execFileSync("img2webp", ["-loop", "0", "-d", "80", "-lossy", "-q", "60", "-m", "6", ...round, "-o", out], {
    stdio: "inherit",
  });
  console.log(`${out}: ${Math.round(statSync(out).size / 1000)} kB`);
} finally {
  await browser.close();
  await server.close();
  rmSync(scratch, { recursive: true });
}
