// SPDX-License-Identifier: MIT
// What a page loads: a table for the package's README.
//
//     node extras/js/sizes.js PACKAGE     the folder that extras/js/build has made
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { brotliCompressSync, constants, gzipSync } from "node:zlib";

const folder = process.argv[2];
const uses = [
  ['`findPairs`, `load({ only: "pairs" })`', "index", "jostle-pairs"],
  ['`load({ only: "surfaces" })`', "index", "jostle-surfaces"],
  ["`jostle/rbush`", "rbush", "jostle-bush"],
  ["`jostle/flatbush`", "flatbush", "jostle-bush"],
  ['`load({ only: "2d" })`', "index", "jostle-2d"],
  ['`load({ only: "3d" })`', "index", "jostle-3d"],
  ["`load()`", "index", "jostle"],
];

/** A script, and those that it imports before it runs. */
function scripts(file, found = new Set()) {
  if (found.has(file)) return found;
  found.add(file);
  const text = readFileSync(file, "utf8");
  for (const [, name] of text.matchAll(/from "(\.[^"]+)"/g)) scripts(join(file, "..", name), found);
  return found;
}
const brotli = (bytes) => brotliCompressSync(bytes, { params: { [constants.BROTLI_PARAM_QUALITY]: 11 } });
/** Kilobytes of these files, each packed by itself, as servers do. */
function packed(files, pack) {
  return (files.map((file) => pack(readFileSync(file)).length).reduce((a, b) => a + b, 0) / 1000).toFixed(0);
}

console.log("| you use | brotli | gzip | of which scripts |\n|---|---|---|---|");
for (const [use, entry, module] of uses) {
  const own = [...scripts(join(folder, "src", `${entry}.js`)), join(folder, "dist", `${module}.js`)];
  const all = [...own, join(folder, "dist", `${module}.wasm`)];
  const kilobytes = [packed(all, brotli), packed(all, gzipSync), packed(own, gzipSync)];
  console.log(`| ${[use, ...kilobytes.map((each) => `${each} kB`)].join(" | ")} |`);
}
