// SPDX-License-Identifier: MIT
// What the pages say runs: every block marked js, after what a reader would have at hand.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import test from "node:test";

const prelude =
  'import { JostleError, endReasons, load, poses, rays, support } from "jostle";\n' +
  "const jostle = await load();\n";

for (const page of process.env.JOSTLE_PAGES.split(":"))
  test(`the code of ${page.split("/").slice(-3).join("/")}`, async () => {
    const blocks = [...readFileSync(page, "utf8").matchAll(/^```js\n(.*?)^```/gms)].map((found) => found[1]);
    assert.ok(blocks.length > 0);
    for (const [i, block] of blocks.entries()) {
      const file = new URL(`./block-${page.length}-${i}.mjs`, import.meta.url);
      writeFileSync(file, block.includes("import ") ? block : prelude + block);
      await import(file);
    }
  });
