// SPDX-License-Identifier: MIT
import { describe, options_of, whole } from "./core.js";
import { refuse } from "./error.js";
import { Module } from "./module.js";
import { INITIAL_MEMORY, MOST_MEMORY, in_node, of_node, start, support } from "./start.js";

let loading; // the module of findPairs
/** Finds pairs without a module of the caller's: see jostle.d.ts. */
export async function findPairs(...given) {
  loading ??= load({ only: "pairs" });
  loading.catch(() => (loading = undefined)); // the next call tries again
  return (await loading).findPairs(...given);
}

/** Loads the module: see jostle.d.ts. */
export async function load(options) {
  const { only, wasm, simd, threads = 1, maxMemory = MOST_MEMORY } = options_of(options);
  if (only !== undefined && !["pairs", "surfaces", "2d", "3d"].includes(only))
    refuse(
      `only is ${describe(only)}: it must be "pairs", "surfaces", "2d" or "3d", ` +
        "or left out for everything but surfaces",
    );
  if (simd !== undefined && typeof simd !== "boolean")
    refuse(`simd is ${describe(simd)}: it must be true or false, or left out for what there is`);
  whole(threads, "threads", 0, 1024);
  whole(maxMemory, "maxMemory", INITIAL_MEMORY, MOST_MEMORY);
  const plain = !(simd ?? support.simd);
  if (plain && simd === undefined && wasm !== undefined && typeof wasm !== "function")
    refuse(
      "this browser has no SIMD instructions, or no exceptions, in WebAssembly, and wasm is one module: " +
        "let it be a function from a file's name to its address, or give jostle-plain.wasm with simd: false",
    );
  if (threads > 1 && plain) refuse(`threads is ${threads}, and the module without SIMD has one`);
  if (threads > 1 && !support.threads)
    refuse(
      `threads is ${threads}, and there is no shared memory here: the page must be cross-origin isolated`,
    );
  const cores =
    globalThis.navigator?.hardwareConcurrency ?? (in_node ? (await of_node("os")).availableParallelism() : 1);
  const wanted = threads !== 0 ? threads : !plain && support.threads ? cores : 1;
  // No other module has surfaces, and this one has one thread.
  const threaded = wanted > 1 && only !== "surfaces";
  const name = threaded ? "jostle-threads" : only === undefined ? "jostle" : `jostle-${only}`;
  const module = new Module(await start(name, { simd, wasm, threads: threaded ? wanted : 1, maxMemory }));
  if (only === "surfaces" && module.Surface === undefined)
    refuse("surfaces need SIMD and exceptions in WebAssembly, and these aren't here, or unwanted");
  return module;
}
