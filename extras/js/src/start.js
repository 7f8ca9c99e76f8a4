// SPDX-License-Identifier: MIT
// Finds the module that this browser, or node, can run, and starts it.

import { Core, describe } from "./core.js";
import { JostleError, refuse } from "./error.js";

const PAGE = 65536;
export const INITIAL_MEMORY = 16 * 2 ** 20; // as the modules were linked with
export const MOST_MEMORY = 2 ** 31;
export const in_node =
  typeof process === "object" && typeof process.versions?.node === "string" && process.type !== "renderer";

// Addresses stand here in full, so that bundlers find the files.
const MODULES = {
  jostle: {
    glue: () => import("../dist/jostle.js"),
    wasm: () => new URL("../dist/jostle.wasm", import.meta.url),
  },
  "jostle-plain": {
    glue: () => import("../dist/jostle-plain.js"),
    wasm: () => new URL("../dist/jostle-plain.wasm", import.meta.url),
  },
  "jostle-pairs": {
    glue: () => import("../dist/jostle-pairs.js"),
    wasm: () => new URL("../dist/jostle-pairs.wasm", import.meta.url),
  },
  "jostle-surfaces": {
    glue: () => import("../dist/jostle-surfaces.js"),
    wasm: () => new URL("../dist/jostle-surfaces.wasm", import.meta.url),
  },
  "jostle-bush": {
    glue: () => import("../dist/jostle-bush.js"),
    wasm: () => new URL("../dist/jostle-bush.wasm", import.meta.url),
  },
  "jostle-2d": {
    glue: () => import("../dist/jostle-2d.js"),
    wasm: () => new URL("../dist/jostle-2d.wasm", import.meta.url),
  },
  "jostle-3d": {
    glue: () => import("../dist/jostle-3d.js"),
    wasm: () => new URL("../dist/jostle-3d.wasm", import.meta.url),
  },
  "jostle-threads": {
    glue: () => import("../dist/jostle-threads.js"),
    wasm: () => new URL("../dist/jostle-threads.wasm", import.meta.url),
  },
};

/**
 * Vite's development server bundles packages into a folder `.vite/deps` of node_modules, and leaves the files
 * beside their scripts where they were: there. Else undefined.
 */
const left_behind = /^(.*\/)\.vite\/deps[^/]*\//.exec(import.meta.url)?.[1];
/** The address of a file of dist/, in `left_behind` where there is such. */
function of_dist(file) {
  return new URL(`jostle/dist/${file}`, left_behind);
}

/** Whether modules with such a function are understood: the smallest module that has one. */
function understands(...code) {
  return WebAssembly.validate(Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0, ...code));
}
function detect() {
  // i32.const 0, i8x16.splat, i8x16.popcnt; and try, catch_all, end: modules with SIMD throw WebAssembly's
  // own exceptions.
  const simd =
    understands(1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11) &&
    understands(1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 8, 1, 6, 0, 6, 64, 25, 11, 11);
  // A shared memory, and i32.atomic.load of it.
  const shared =
    typeof SharedArrayBuffer === "function" &&
    globalThis.crossOriginIsolated !== false &&
    understands(
      1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 5, 4, 1, 3, 1, 1, 10, 11, 1, 9, 0, 65, 0, 254, 16, 2, 0, 26, 11,
    );
  return Object.freeze({ simd, threads: simd && shared });
}
export const support = detect();

/** node's own modules; bundlers must not look for them. */
export function of_node(name) {
  return import(/* webpackIgnore: true */ /* @vite-ignore */ "node:" + name);
}

async function compile(given) {
  const source = await given;
  if (source instanceof WebAssembly.Module) return source;
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return WebAssembly.compile(source);
  if (typeof Response === "function" && source instanceof Response) return compile_response(source);
  if (typeof source === "string" || source instanceof URL) {
    const base = in_node ? (await of_node("url")).pathToFileURL(process.cwd() + "/") : document_address();
    const url = new URL(source, base);
    if (in_node && url.protocol === "file:")
      return WebAssembly.compile(await (await of_node("fs/promises")).readFile(url));
    return compile_response(await fetch(url));
  }
  return refuse(`wasm is ${describe(source)}: it must be an address, bytes, a response or a compiled module`);
}
function document_address() {
  return globalThis.document?.baseURI ?? globalThis.location?.href;
}
async function compile_response(response) {
  if (!response.ok)
    refuse(
      `the module can't be loaded from ${response.url}: ` +
        `the answer is ${response.status} ${response.statusText}`,
    );
  const type = response.headers.get("content-type") ?? "";
  if (type.startsWith("text/html"))
    refuse(
      `the module can't be loaded from ${response.url}: a page came, as servers give for what they ` +
        "don't have; have the package's dist/*.wasm served, or say with the option wasm where they are",
    );
  // Many a plain server doesn't know the type; streaming wants it.
  return type.startsWith("application/wasm")
    ? WebAssembly.compileStreaming(response)
    : WebAssembly.compile(await response.arrayBuffer());
}

function new_memory(most, shared) {
  try {
    return new WebAssembly.Memory({
      initial: INITIAL_MEMORY / PAGE,
      maximum: Math.floor(most / PAGE),
      shared,
    });
  } catch (error) {
    return refuse(
      `out of memory: ${INITIAL_MEMORY} bytes to begin with were refused (${error.message})`,
      "out_of_memory",
    );
  }
}

/**
 * What makes workers for the module's threads. `failed` hears of one that can't begin, and says whether that
 * was in time; the module's own code would wait for it without end.
 */
async function worker_maker(failed) {
  if (!in_node)
    return () => {
      // In full, again for bundlers.
      const worker =
        left_behind === undefined
          ? new Worker(new URL("../dist/jostle-threads.worker.js", import.meta.url), {
              type: "module",
              name: "jostle",
            })
          : new Worker(of_dist("jostle-threads.worker.js"), { type: "module", name: "jostle" });
      worker.addEventListener("error", (event) => {
        // Browsers don't say why they refuse a file.
        const why = event.message || "jostle-threads.worker.js must be there, with the headers of the page";
        if (failed(why)) event.stopImmediatePropagation();
      });
      return worker;
    };
  const { Worker: NodeWorker } = await of_node("worker_threads");
  const here = import.meta.url; // so that bundlers don't find node's file: webpack would take it for a script
  return () => {
    const inside = new NodeWorker(new URL("./node_worker.js", here));
    const worker = { // as a browser's
      postMessage: (message) => inside.postMessage(message),
      terminate: () => inside.terminate(),
    };
    inside.on("message", (data) => {
      if (data.cmd === "loaded") inside.unref(); // a program may end although its threads wait for work
      worker.onmessage({ data });
    });
    inside.on("error", (error) => failed(error.message) || worker.onerror(error));
    return worker;
  };
}

/** The glue and the code of one of MODULES, from where `wasm` says. */
async function fetch_module(name, wasm) {
  const { glue, wasm: own } = MODULES[name];
  const beside = () => (left_behind === undefined ? own() : of_dist(`${name}.wasm`));
  const address = typeof wasm === "function" ? wasm(`${name}.wasm`) : (wasm ?? beside());
  const [{ default: create }, compiled] = await Promise.all([glue(), compile(address)]);
  return { file: name, create, compiled };
}

/**
 * The module that is wanted or, where it can't be compiled, the one without SIMD: what `support` tells is
 * learnt from small modules, and this one is the proof.
 */
async function understood_module(name, wasm) {
  try {
    return await fetch_module(name, wasm);
  } catch (error) {
    const given = wasm !== undefined && typeof wasm !== "function"; // and no other
    if (given || !(error instanceof WebAssembly.CompileError)) throw error;
    return fetch_module("jostle-plain", wasm);
  }
}

/** Starts one of MODULES, or jostle-plain where it must be. */
export async function start(name, { simd, wasm, threads = 1, maxMemory = MOST_MEMORY } = {}) {
  const plain = !(simd ?? support.simd);
  const { create, compiled, file } = await (simd === undefined && !plain
    ? understood_module(name, wasm)
    : fetch_module(plain ? "jostle-plain" : name, wasm));
  const count = file === "jostle-threads" ? threads : 1;
  const memory = new_memory(maxMemory, count > 1);
  let failed;
  const failure = new Promise((_, reject) => (failed = reject));
  const workers = [];
  let begun = false;
  const worker_failed = (why) => {
    if (!begun) failed(new JostleError(`a thread couldn't be started: ${why}`));
    return !begun;
  };
  const make_worker = count > 1 ? await worker_maker(worker_failed) : undefined;
  try {
    const started = create({
      wasmMemory: memory,
      workers: count - 1,
      makeWorker: () => {
        workers.push(make_worker());
        return workers.at(-1);
      },
      instantiateWasm: (imports, done) => {
        WebAssembly.instantiate(compiled, imports).then((instance) => done(instance, compiled), failed);
        return {};
      },
    });
    const core = new Core(await Promise.race([started, failure]), memory, count);
    begun = true;
    return core;
  } catch (error) {
    for (const worker of workers) worker.terminate();
    throw error;
  }
}
