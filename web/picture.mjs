// Makes the moving picture of the README from the page: node web/picture.mjs DIR docs/images/page.webp
// DIR is what web/build wrote. Needs chromium, and img2webp of Debian's package webp.
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";

import { chromium } from "playwright-core";
import { preview } from "vite";

const [folder, out] = process.argv.slice(2).map((name) => path.resolve(name));
if (out === undefined) throw new Error("say what and where: node web/picture.mjs DIR OUT.webp");
const pictures = 40;
const [width, height] = [800, 500];

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
  const page = await browser.newPage({ viewport: { width, height }, deviceScaleFactor: 2, colorScheme: "dark" });
  await page.goto(`http://127.0.0.1:${server.httpServer.address().port}/#scene=uniform&n=20000&seed=1&paused=1`);
  await page.addStyleTag({
    content: `aside { display: none } main { display: grid; grid-template-columns: 1fr; height: 100% } .stage { height: 100% }
      header { position: fixed; top: 14px; left: 18px } .figures { left: 18px; bottom: 12px } canvas { outline: none !important }`,
  });
  await page.waitForFunction(() => window.jostle?.stats());
  await page.mouse.move(width / 2, height / 2);
  await page.mouse.down(); // turns the view, a little for each picture
  const files = [];
  for (let k = 0; k < pictures; ++k) {
    const { frame } = await page.evaluate(() => window.jostle.stats());
    await page.keyboard.press(".");
    await page.waitForFunction((frame) => window.jostle.stats().frame > frame, frame);
    await page.mouse.move(width / 2 + 3 * (k + 1), height / 2);
    await page.waitForTimeout(200);
    const file = path.join(scratch, `${String(k).padStart(3, "0")}.png`);
    await page.screenshot({ path: file, scale: "css" });
    files.push(file);
  }
  execFileSync("img2webp", ["-loop", "0", "-d", "66", "-lossy", "-q", "70", "-m", "6", ...files, "-o", out], { stdio: "inherit" });
  console.log(`${out}: ${Math.round(statSync(out).size / 1000)} kB`);
} finally {
  await browser.close();
  await server.close();
  rmSync(scratch, { recursive: true });
}
