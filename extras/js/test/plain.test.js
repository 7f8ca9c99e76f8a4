// SPDX-License-Identifier: MIT
// Where there is no SIMD in WebAssembly, or its modules can't be compiled, there is a module without. That it
// finds the same as the others is seen to by golden.test.js and all the rest.
import assert from "node:assert/strict";
import { cpSync } from "node:fs";
import test from "node:test";

// A copy that has learnt what there is, and then one that is told that there is nothing.
const copy = new URL("./able/", import.meta.url);
cpSync(new URL("./node_modules/jostle/", import.meta.url), copy, { recursive: true });
const able = await import(new URL("src/index.js", copy));
const validate = WebAssembly.validate;
WebAssembly.validate = () => false;
const { load, support } = await import("jostle");
WebAssembly.validate = validate;
const { random_boxes, slow_pairs } = await import("./help.js");

function finds_pairs(jostle) {
  const boxes = random_boxes(300, 2, 1);
  assert.deepEqual([...jostle.findPairs(boxes, { dim: 2, sort: true })], slow_pairs(boxes, 2));
}
const is_plain = (jostle) => assert.deepEqual([jostle.instructionSet, jostle.threads], ["scalar", 1]);

test("a browser that doesn't understand SIMD gets the module without", async () => {
  assert.deepEqual(support, { simd: false, threads: false });
  for (const options of [{}, { threads: 0 }, { only: "2d" }, { only: "pairs" }, { simd: false }]) {
    const jostle = await load(options);
    is_plain(jostle);
    finds_pairs(jostle);
  }
});

test("what can't be had without SIMD is refused with words", async () => {
  await assert.rejects(load({ threads: 2 }), {
    name: "JostleError",
    message: "threads is 2, and the module without SIMD has one",
  });
  await assert.rejects(
    load({ wasm: new Uint8Array(8) }),
    /no SIMD instructions.* jostle-plain\.wasm with simd: false/,
  );
  await assert.rejects(load({ simd: "no" }), /simd is "no": it must be true or false/);
});

test("a module with SIMD that can't be compiled is replaced, whatever small modules said", async () => {
  assert.deepEqual(able.support, { simd: true, threads: true });
  const compile = WebAssembly.compile;
  const after_refusal = async (options) => {
    let refused = 0;
    WebAssembly.compile = (bytes) => {
      if (refused++ > 0) return compile.call(WebAssembly, bytes);
      throw new WebAssembly.CompileError("invalid opcode 0xfd");
    };
    try {
      return await able.load(options);
    } finally {
      WebAssembly.compile = compile;
    }
  };
  for (const options of [{}, { threads: 2 }, { only: "3d" }]) {
    const jostle = await after_refusal(options);
    is_plain(jostle);
    finds_pairs(jostle);
  }
  // Who insists on a module is told why it isn't to be had.
  await assert.rejects(after_refusal({ simd: true }), /invalid opcode 0xfd/);
  const own = new URL("./node_modules/jostle/dist/jostle.wasm", import.meta.url);
  await assert.rejects(after_refusal({ wasm: own }), /invalid opcode 0xfd/);
  assert.equal((await able.load({ simd: true })).instructionSet, "wasm_simd");
});

test("wasm may be a function, which is asked for the file that is needed", async () => {
  const asked = [];
  const wasm = (file) => {
    asked.push(file);
    return new URL(`./node_modules/jostle/dist/${file}`, import.meta.url);
  };
  for (const options of [{}, { only: "2d" }, { threads: 2 }, { simd: false }])
    finds_pairs(await able.load({ ...options, wasm }));
  finds_pairs(await load({ wasm }));
  const modules = ["jostle", "jostle-2d", "jostle-threads", "jostle-plain", "jostle-plain"];
  assert.deepEqual(
    asked,
    modules.map((name) => `${name}.wasm`),
  );
});
