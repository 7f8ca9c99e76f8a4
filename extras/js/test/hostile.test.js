// SPDX-License-Identifier: MIT
// What users get wrong: each mistake is a JostleError that says what and where, and leaves everything as it
// was.
import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";
import { pathToFileURL } from "node:url";

import { JostleError, load, poses, rays, support } from "jostle";
import { modules, random_boxes } from "./help.js";

/** A JostleError of this status and, where given, index and value; its message matches. */
function refuses(call, message, { status = "invalid_argument", index, value } = {}) {
  assert.throws(call, (error) => {
    assert.ok(error instanceof JostleError && error instanceof Error, `${error}`);
    assert.match(error.message, message);
    assert.equal(error.status, status);
    assert.equal(error.index, index);
    assert.deepEqual(error.value, value);
    return true;
  });
}

const good = new Float32Array([0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1]);

for (const [kind, loaded] of Object.entries(modules)) {
  test(`bad boxes are named, with their numbers: ${kind}`, async () => {
    const jostle = await loaded();
    const finder = new jostle.PairFinder();
    const nan = good.slice(), inverted = Float64Array.from(good);
    nan[10] = NaN;
    inverted[9] = -1;
    const of_nan = { status: "nan_coordinate", index: 1, value: [0, 0, 0, 1, NaN, 1] };
    for (const engine of ["grid", "chapter", "uniform", "brute"])
      refuses(() => finder.find(nan, { dim: 3, engine }), /NaN/, of_nan);
    assert.equal(finder.pairs.length, 0);
    refuses(() => jostle.findPairs(inverted, { dim: 3 }), /box 1/, {
      status: "inverted_box",
      index: 1,
      value: [0, 0, 0, -1, 1, 1],
    });
    refuses(() => jostle.findPairs(good, nan, { dim: 3 }), /NaN/, of_nan);
    refuses(() => jostle.findPairs(nan, good, { dim: 3 }), /NaN/, of_nan);
    refuses(() => jostle.checkBoxes(nan, { dim: 3 }), /NaN/, of_nan);
    refuses(() => jostle.bricks(nan, { dim: 3 }), /NaN/, of_nan);
    refuses(() => jostle.findScenes(nan, [0, 1, 2], { dim: 3 }), /NaN/, of_nan);
    refuses(() => finder.stream(nan, { dim: 3 }, () => {}), /NaN/, of_nan);
    const world = new jostle.World({ dim: 3 });
    refuses(() => world.add(nan), /NaN/, of_nan);
    world.update();
    assert.equal(world.size, 0);
    const index = new jostle.BoxIndex({ dim: 3 });
    refuses(() => index.build(nan), /NaN/, of_nan);
    assert.equal(index.size, 0);
    assert.deepEqual([...finder.find(good, { dim: 3 })], [0, 1]); // and it goes on
    for (const each of [finder, world, index]) each.dispose();
  });

  test(`callbacks may throw, and search themselves: ${kind}`, async () => {
    const jostle = await loaded();
    const boxes = random_boxes(600, 3, 1);
    const mine = new Error("mine");
    const thrower = () => { throw mine; };
    const is_mine = (error) => error === mine;
    const finder = new jostle.PairFinder();
    assert.throws(() => finder.find(boxes, { dim: 3, accept: thrower }), is_mine);
    assert.throws(() => finder.stream(boxes, { dim: 3 }, thrower), is_mine);
    assert.throws(() => jostle.findScenes(boxes, [0, 600], { dim: 3, accept: thrower }), is_mine);
    const inner = jostle.findPairs(boxes, { dim: 3 });
    let calls = 0;
    const found = jostle.findPairs(boxes, {
      dim: 3,
      accept: () => calls++ > 2 || jostle.findPairs(boxes, { dim: 3 }).length === inner.length,
    });
    assert.deepEqual(found, inner);
    refuses(
      () => finder.find(boxes, { dim: 3, accept: () => finder.find(boxes, { dim: 3, accept: () => true }) }),
      /call/,
    );
    assert.deepEqual(finder.find(boxes, { dim: 3 }).slice(), inner);
    finder.dispose();
  });
}

test("arguments of the wrong kind", async () => {
  const jostle = await modules.simd();
  const finder = new jostle.PairFinder();
  refuses(
    () => jostle.findPairs([0, 0, 1, 1], { dim: 2 }),
    /boxes is a Array: it must be Float32Array or Float64Array/,
  );
  refuses(() => jostle.findPairs(null, { dim: 2 }), /boxes is null/);
  refuses(() => jostle.findPairs(good), /options are undefined: they must say dim/);
  refuses(() => jostle.findPairs(good, {}), /dim is undefined: it must be 2 or 3/);
  refuses(() => jostle.findPairs(good, { dim: 4 }), /dim is 4/);
  refuses(
    () => jostle.findPairs(good.subarray(1), { dim: 3 }),
    /boxes has 11 numbers: it must be a multiple of 6/,
    { status: "size_mismatch" },
  );
  refuses(() => jostle.findPairs(good, { dim: 3, engine: "octree" }), /engine is "octree"/);
  refuses(() => jostle.findPairs(good, { dim: 3, engine: "uniform", cellSize: -1 }), /cellSize is -1/);
  refuses(
    () => jostle.findPairs(good, { dim: 3, engine: "brute", owner: Uint32Array.of(1, 2) }),
    /only the engine grid/,
  );
  refuses(() => jostle.findPairs(good, { dim: 3, owner: Uint32Array.of(1) }), /owner/, {
    status: "size_mismatch",
  });
  refuses(() => jostle.findPairs(good, { dim: 3, owner: [1, 2] }), /owner is a Array/);
  refuses(() => jostle.findPairs(good, { dim: 3, category: Uint32Array.of(1, 2) }), /mask/, {
    status: "size_mismatch",
  });
  const vertices = Uint32Array.of(1, 2, 3, 4, 5, 6);
  const five = vertices.subarray(1);
  refuses(() => jostle.findPairs(good, { dim: 3, vertices: five }), /vertices has 5 numbers/, {
    status: "size_mismatch",
  });
  refuses(() => jostle.findPairs(good, { dim: 3, vertices: vertices.subarray(3) }), /vertices/, {
    status: "size_mismatch",
  });
  refuses(() => jostle.findPairs(good, good, { dim: 3, vertices }), /within one set/);
  refuses(() => jostle.findScenes(good, [0, 2], { dim: 3, vertices }), /within one set of boxes/);
  refuses(() => jostle.findPairs(good, { dim: 3, vertices, engine: "brute" }), /only the engine grid/);
  refuses(() => jostle.findPairs(good, { dim: 3, accept: 5 }), /5 is no function/);
  refuses(() => finder.stream(good, { dim: 3 }), /undefined is no function/);
  refuses(() => finder.stream(good, { dim: 3 }, Object.create(null)), /a object is no function/);
  refuses(() => finder.stream(good, { dim: 3 }, Symbol("a")), /a Symbol is no function/);
  refuses(() => jostle.findScenes(good, [0, 3], { dim: 3 }), /offset/, { status: "size_mismatch", index: 1 });
  refuses(() => jostle.findScenes(good, [0, 0.5, 2], { dim: 3 }), /offsets\[1\] is 0.5/);
  refuses(() => jostle.findScenes(good, [], { dim: 3 }), /offsets has no numbers/, {
    status: "size_mismatch",
  });
  refuses(
    () => jostle.findPeriodicPairs(good, [10, 10, 0.1], { dim: 3 }),
    /period\[2\] is 0.1, which float32 doesn't have/,
  );
  refuses(() => jostle.findPeriodicPairs(good, [1, 0, 0], { dim: 3 }), /period/, { index: 0 });
  for (const period of [[10, 10], [10, 10, 0, 0]])
    refuses(
      () => jostle.findPeriodicPairs(good, period, { dim: 3 }),
      /period has . numbers: it must have 3/,
      { status: "size_mismatch" },
    );
  refuses(() => jostle.findPeriodicPairs(good, 10, { dim: 3 }), /period is 10: it must be an array/);
  refuses(() => jostle.findScenes(good, undefined, { dim: 3 }), /offsets is undefined: it must be an array/);
  refuses(() => jostle.checksum(Uint32Array.of(1)), /pairs has 1 numbers: it must be an even number/, {
    status: "size_mismatch",
  });
  refuses(() => jostle.array("int8", 3), /type is "int8"/);
  refuses(() => jostle.array("float32", -1), /length is -1/);
  refuses(() => jostle.scene("nowhere", 10), /nowhere/);
  refuses(() => jostle.scene("uniform", 10, -1), /seed is -1/);
  refuses(() => jostle.simulation({ scene: "nowhere" }), /nowhere is not a scene; choose spheres, boxes/);
  refuses(() => rays(good, good, { dim: 4 }), /dim is 4/);
  refuses(() => rays(good, Float32Array.of(1), { dim: 3 }), /origins and directions have 12 and 1 numbers/, {
    status: "size_mismatch",
  });
  refuses(() => poses(Float32Array.of(1, 2), { dim: 3 }), /positions has 2 numbers/, {
    status: "size_mismatch",
  });
  finder.dispose();
});

test("worlds, indexes and contacts", async () => {
  const jostle = await modules.simd();
  const world = new jostle.World({ dim: 3 });
  const ids = world.add(good);
  world.update();
  const stale = Float64Array.of(ids[0], 12345);
  refuses(() => world.move(stale, good), /12345/, { status: "stale_id", index: 12345 });
  refuses(() => world.remove(stale), /12345/, { status: "stale_id", index: 12345 });
  refuses(() => world.move(ids, good.subarray(6)), /there are 2 ids and 1 boxes/, {
    status: "size_mismatch",
  });
  refuses(() => world.remove(BigUint64Array.of(1n)), /ids is a BigUint64Array: it must be a Float64Array/);
  for (const wrong of [1n, -1, 0.5, NaN, 2 ** 53, "1", undefined])
    for (const call of [(of) => world.remove(of), (of) => jostle.indexOf(of)])
      refuses(() => call([ids[0], wrong]), /ids\[1\] is .*: it must be a whole number from 0 to 2\^53 - 1/, {
        status: "invalid_argument",
        index: 1,
      });
  refuses(() => world.add(Float64Array.from(good)), /boxes is a Float64Array: it must be Float32Array/);
  refuses(() => world.add(good, { category: -1 }), /category is -1/);
  refuses(() => world.add(good, { category: 2 ** 32 }), /category is 4294967296: .* from 0 to 4294967295/);
  refuses(() => world.add(good, [{}, { owner: 0.5 }]), /options\[1\]\.owner is 0\.5/);
  refuses(() => world.add(good, [{}, 7]), /options\[1\] are 7: they must be an object/);
  refuses(() => world.add(good, [{}, { margin: -1 }]), /margin -1 of new object 1/, { index: 1 });
  refuses(() => world.add(good, [{}]), /there are 2 boxes and 1 options/, { status: "size_mismatch" });
  refuses(() => world.restore(new Uint8Array(7)), /snapshot/, { status: "bad_snapshot" });
  refuses(() => world.all({}), /queries are a Object/);
  refuses(() => world.all({ boxes: good.subarray(1) }), /boxes has 11 numbers/, { status: "size_mismatch" });
  refuses(() => world.all({ nearest: new Float32Array(3), count: 1.5 }), /count is 1.5/);
  refuses(() => world.any({ nearest: new Float32Array(3) }), /nearest is no query of any\(\)/);
  refuses(
    () => world.first({ boxes: good }),
    /boxes is no query of first\(\): ask one of rays, sweeps, nearest, nearestToBoxes/,
  );
  world.update();
  assert.equal(world.pairs().length, 2); // as before
  refuses(() => new jostle.World({ dim: 3, margin: -1 }), /margin/);
  refuses(() => new jostle.World({}), /dim is undefined/);
  refuses(() => new jostle.BoxIndex({ dim: 3, type: "int8" }), /type is "int8"/);

  const index = new jostle.BoxIndex({ dim: 3 });
  index.build(good);
  refuses(() => index.insert(good.subarray(6), Uint32Array.of(1)), /1/, { index: 0 });
  refuses(() => index.erase(Uint32Array.of(0, 7)), /7/, { index: 1 });
  refuses(() => index.move(good, Uint32Array.of(0)), /there are 1 ids and 2 boxes/, {
    status: "size_mismatch",
  });
  assert.equal(index.size, 2);

  refuses(() => jostle.sphere(-1), /radius/);
  refuses(() => jostle.sphere("1"), /radius is "1"/);
  const mismatch = { status: "size_mismatch" };
  refuses(() => jostle.box([1]), /half has 1 numbers: it must have 2 or 3/, mismatch);
  refuses(() => jostle.halfSpace([1, 2, 3, 4]), /normal has 4 numbers: it must have 2 or 3/, mismatch);
  refuses(() => jostle.box(1), /half is 1: it must be an array of numbers/);
  refuses(() => jostle.box("123"), /half is "123": it must be an array of numbers/);
  refuses(() => jostle.box([1, "2", 3]), /half\[1\] is "2": it must be a number/);
  refuses(() => new jostle.Shapes([jostle.sphere(1)]), /options are a Array: they must be an object/);
  refuses(() => jostle.hull(new Float32Array(0), 3), /point/);
  refuses(
    () => jostle.compound([], new Float64Array(0)),
    /shapes are a Array: they must be a list of at least one/,
  );
  const shapes = new jostle.Shapes({ shapes: [jostle.sphere(1)] });
  refuses(() => shapes.add({}), /the shape is a Object/);
  refuses(() => shapes.set(4, jostle.sphere(1)), /none of number 4/, { index: 4 });
  const finder = new jostle.ContactFinder({ dim: 3 });
  const one = { shapes, poses: poses(new Float32Array(3), { dim: 3 }) };
  refuses(() => finder.find(one, Uint32Array.of(0, 1)), /pair 0 names objects 0 and 1/, { index: 1 });
  refuses(() => finder.find({ shapes, poses: new Float32Array(14) }, Uint32Array.of(0, 0)), /./, {
    status: "size_mismatch",
  });
  refuses(() => finder.find(one, Uint32Array.of(0, 0), { margin: "no" }), /margin is "no"/);
  refuses(() => jostle.bounds({}), /objects are a Object: they must be/);
  for (const each of [world, index, shapes, finder]) each.dispose();
});

test("null counts as left out, in place of options and of each of them", async () => {
  const jostle = await load(null);
  const boxes = Float32Array.from(good);
  const world = new jostle.World({ dim: 3, type: null, margin: null, accept: null });
  const ids = world.add(boxes, null);
  const index = new jostle.BoxIndex({ dim: 3, type: null });
  index.build(boxes);
  const shapes = new jostle.Shapes({ dim: null, shapes: [jostle.sphere(1), jostle.sphere(2)] });
  const two = { shapes, poses: poses(new Float32Array(6), { dim: 3, rotations: null }) };
  const moving = { shapes, poses: new Float32Array(26).fill(0.5) };
  const pair = Uint32Array.of(0, 1);
  const finder = new jostle.PairFinder(), contacts = new jostle.ContactFinder({ dim: 3, type: null });
  const line = [new Float32Array(3), new Float32Array(3).fill(1)];
  const near = { nearest: new Float32Array(3), count: null, maxDistance: null };
  const filter = { category: null, mask: null, owner: null };
  const sorted = { dim: 3, sort: null, accept: null, ...filter };
  const queried = { asker: null, exclude: null, accept: null };
  const in_order = { sequence: null };
  const calls = [ // of options, and the options there are
    [
      (options) => world.add(boxes, options).length,
      { margin: null, enabled: null, isStatic: null, ...filter },
    ],
    [(options) => world.move(ids, boxes, options), { displacements: null, ...in_order }],
    [(options) => world.resize(ids, new Float32Array(6).fill(2), options), in_order],
    [(options) => world.setFilter(ids, { isStatic: null, ...filter }, options), in_order],
    [(options) => world.setMargin(ids, 1, options), in_order],
    [(options) => world.setEnabled(ids, true, options), in_order],
    [(options) => (world.update(), world.join(boxes, options)), queried],
    [(options) => world.all({ boxes }, options).ids, { maxResults: null, ...queried }],
    [(options) => index.all(near, options).ids, { maxResults: null, ...filter, ...queried }],
    [(options) => index.visit({ boxes: boxes.subarray(6) }, () => {}, options), queried],
    [(options) => index.first(rays(...line, { dim: 3, maxFraction: null }), options), queried],
    [(options) => index.any({ boxes }, options), queried],
    [(options) => index.count({ boxes }, options), queried],
    [(options) => index.count({ boxes }, { asker: options }), filter],
    [(options) => contacts.find(two, pair, options), { b: null, margin: null }],
    [(options) => contacts.touching(two, pair, options), { b: null }],
    [(options) => contacts.distances(two, pair, options), { b: null, maxDistance: null }],
    [(options) => contacts.impacts(moving, pair, options), { b: null, tolerance: null }],
    [(options) => jostle.bounds(two, options), { margin: null }],
    [(options) => new jostle.Shapes(options).length, { dim: null, shapes: null }],
    [
      (options) => jostle.heightField(new Float64Array(9), 3, options).type,
      { spacingX: null, spacingZ: null, thickness: null },
    ],
    [(options) => jostle.scene("uniform", 9, 1, options).dim, { dim: null, type: null }],
    [(options) => jostle.simulation(options).bodies, { scene: null, bodies: null, seed: null }],
  ];
  for (const [call, options] of calls) {
    const expected = call(undefined);
    assert.deepEqual(call(null), expected, `${call}`);
    assert.deepEqual(call(Object.freeze(options)), expected, `${call}`);
  }
  const found = [0, 1];
  assert.deepEqual([...finder.find(boxes, { engine: null, ...sorted })], found);
  assert.deepEqual([...finder.find(boxes, { dim: 3, engine: "uniform", cellSize: null })], found);
  assert.equal(finder.stream(boxes, { engine: null, ...sorted }, () => {}), true);
  assert.deepEqual([...jostle.findScenes(boxes, [0, 2], sorted).pairs], found);
  assert.deepEqual([...jostle.findPeriodicPairs(boxes, [0, 0, 0], sorted).pairs], found);
  for (const call of [
    () => jostle.checkBoxes(boxes, null),
    () => jostle.bricks(boxes, null),
    () => jostle.findScenes(boxes, [0, 2], null),
    () => new jostle.World(null),
    () => new jostle.BoxIndex(null),
    () => new jostle.ContactFinder(null),
    () => poses(new Float32Array(3), null),
    () => rays(...line, null),
  ])
    refuses(call, /^dim is undefined/);
  refuses(() => world.setFilter(ids, null), /^filter is null/);
  const loaded = await load({ only: null, wasm: null, simd: null, threads: null, maxMemory: null });
  assert.equal(loaded.threads, 1);
});

test("what was disposed of, what is another module's, what memory has left behind", async () => {
  const jostle = await load(), other = await load();
  const finder = new jostle.PairFinder(),
    boxes = other.array("float32", 12),
    stale = jostle.array("float32", 12).view;
  boxes.view.set(good);
  assert.deepEqual([...other.findPairs(boxes, { dim: 3 })], [0, 1]);
  refuses(() => jostle.findPairs(boxes, { dim: 3 }), /boxes lies in the memory of another module/);
  const before = jostle.memoryBytes;
  jostle.array("float32", 20_000_000);
  assert.ok(jostle.memoryBytes > before);
  assert.equal(stale.length, 0);
  refuses(() => jostle.findPairs(stale, { dim: 3 }), /boxes is a view of memory that has grown since/);
  boxes.dispose();
  refuses(() => other.findPairs(boxes, { dim: 3 }), /was disposed of/, { status: "bad_handle" });
  finder.dispose();
  finder.dispose();
  assert.equal(finder.disposed, true);
  refuses(() => finder.find(good, { dim: 3 }), /this PairFinder was disposed of/, { status: "bad_handle" });
  // Empty because their memory is gone.
  const gone = new Float32Array(3);
  structuredClone(gone.buffer, { transfer: [gone.buffer] });
  for (const empty of [stale, gone]) {
    refuses(() => poses(empty, { dim: 3 }), /positions is a view of memory that has grown since/);
    refuses(() => rays(empty, new Float32Array(0), { dim: 3 }), /origins is a view of memory/);
    refuses(() => rays(new Float32Array(0), empty, { dim: 3 }), /directions is a view of memory/);
  }

  const simulation = other.simulation({ bodies: 3 }), scene = other.scene("uniform", 3);
  other.dispose();
  assert.equal(other.disposed, true);
  for (const use of [
    () => other.findPairs(good, { dim: 3 }),
    () => other.array("float32", 3),
    () => other.memoryBytes,
    () => other.sphere(1),
    () => new other.World({ dim: 3 }),
    () => simulation.poses,
    () => scene.boxes.view,
  ])
    refuses(use, /module .* was disposed of/, { status: "bad_handle" });
});

test("loading", async () => {
  const rejects = (options, message) =>
    assert.rejects(load(options), (error) => error instanceof JostleError && message.test(error.message));
  await rejects({ threads: -1 }, /threads is -1/);
  await rejects({ maxMemory: 1 }, /maxMemory is 1/);
  await rejects({ wasm: 5 }, /wasm is 5/);
  await rejects({ only: "worlds" }, /only is "worlds"/);
  await assert.rejects(load({ wasm: "./not-there.wasm" }), { code: "ENOENT" });
  await assert.rejects(load({ wasm: new Uint8Array(8) }), WebAssembly.CompileError);
  const page = new Response("<!doctype html>", { headers: { "content-type": "text/html; charset=utf-8" } });
  await rejects({ wasm: page }, /a page came, as servers give for what they don't have/);
  assert.deepEqual(support, { simd: true, threads: true });
  const pairs = await load({ only: "pairs" });
  assert.deepEqual([...pairs.findPairs(good, { dim: 3 })], [0, 1]);
  assert.throws(() => pairs.scene("uniform", 1000), /this module has pairs alone/);
  assert.equal(pairs.World, undefined);
  const bytes = readFileSync(new URL("./node_modules/jostle/dist/jostle.wasm", import.meta.url));
  for (const wasm of [
    bytes,
    await WebAssembly.compile(bytes),
    "./node_modules/jostle/dist/jostle.wasm",
    new Response(bytes),
    Promise.resolve(new Response(bytes, { headers: { "content-type": "application/wasm" } })),
  ])
    assert.deepEqual([...(await load({ wasm })).findPairs(good, { dim: 3 })], [0, 1]);
  const all = await load({ threads: 0 });
  assert.ok(all.threads >= 1);
  assert.deepEqual([...all.findPairs(good, { dim: 3 })], [0, 1]);
  all.dispose();
});

test("a thread that can't begin is an error of load()", async () => {
  const copy = mkdtempSync(join(tmpdir(), "jostle-"));
  cpSync(new URL("./node_modules/jostle", import.meta.url), copy, { recursive: true });
  rmSync(join(copy, "dist", "jostle-threads.worker.js")); // forgotten by whoever put the files on a server
  const broken = await import(pathToFileURL(join(copy, "src", "index.js")));
  await assert.rejects(broken.load({ threads: 3 }), (error) => {
    assert.ok(error instanceof broken.JostleError);
    assert.match(error.message, /^a thread couldn't be started: .*jostle-threads\.worker\.js/);
    return true;
  });
  const jostle = await broken.load();
  assert.deepEqual([...jostle.findPairs(good, { dim: 3 })], [0, 1]);
  rmSync(copy, { recursive: true });
});

test("calls in callbacks of calls end before the module's stack does", async () => {
  for (const loaded of Object.values(modules)) {
    const jostle = await loaded();
    const index = new jostle.BoxIndex({ dim: 3 });
    index.build(good);
    const nearest = { nearest: new Float32Array(3) };
    let deepest = 0;
    const ask = (depth, most) => {
      deepest = depth;
      index.visit(nearest, () => depth < most && ask(depth + 1, most));
    };
    ask(1, 32);
    assert.equal(deepest, 32);
    const decide = (depth) => {
      const world = new jostle.World({ dim: 3, accept: () => (decide(depth + 1), true) });
      world.add(good);
      world.update();
    };
    for (const endless of [() => ask(1, Infinity), () => decide(1)])
      refuses(endless, /^calls in callbacks of calls are 32 deep/);
    assert.deepEqual([...jostle.findPairs(good, { dim: 3 })], [0, 1]);
    index.dispose();
  }
});

for (const [kind, loaded] of Object.entries(modules)) {
  test(`what is in use is neither changed nor disposed of: ${kind}`, async () => {
    const jostle = await loaded();
    const boxes = random_boxes(20_000, 3, 1), few = random_boxes(10, 3, 2);
    const index = new jostle.BoxIndex({ dim: 3 });
    index.build(boxes);
    const all = new Float32Array([-1e3, -1e3, -1e3, 1e3, 1e3, 1e3]);
    let refused = 0;
    const meddle = () => {
      for (const change of [
        () => index.build(few),
        () => index.insert(few, Uint32Array.from(few, (_, i) => 50_000 + i).subarray(0, 10)),
        () => index.move(few, Uint32Array.from({ length: 10 }, (_, i) => i)),
        () => index.erase(new Uint32Array([0])),
        () => index.clear(),
        () => index.releaseMemory(),
      ])
        refuses(change, /this BoxIndex is in use: it can't be changed/);
      refuses(() => index.dispose(), /this BoxIndex is in use: it can't be disposed of/);
      refuses(() => jostle.dispose(), /this module is in use/);
      assert.equal(index.count({ boxes: all })[0], 20_000); // asking goes on
      ++refused;
      return false;
    };
    index.visit({ boxes: all }, meddle);
    index.any({ boxes: few.subarray(0, 6) }, { accept: meddle });
    assert.ok(refused >= 1);

    const finder = new jostle.PairFinder();
    const world = new jostle.World({
      dim: 3,
      accept: () => {
        refuses(() => world.dispose(), /this World is in use/);
        return true;
      },
    });
    world.add(few);
    world.update();
    const accept = () => {
      refuses(() => finder.dispose(), /this PairFinder is in use: it can't be disposed of/);
      refuses(() => finder.releaseMemory(), /this PairFinder is in use: it can't be changed/);
      return true;
    };
    const count = finder.find(boxes, { dim: 3 }).length;
    assert.ok(count > 0);
    assert.equal(finder.find(boxes, { dim: 3, accept }).length, count);
    finder.stream(boxes, { dim: 3 }, () => refuses(() => finder.dispose(), /in use/));
    for (const each of [index, finder, world, finder]) each.dispose();
    const gone = { status: "bad_handle" };
    for (const use of [
      () => finder.find(boxes, { dim: 3 }),
      () => finder.find(boxes, { dim: 3, accept: () => true }),
      () => finder.stream(boxes, { dim: 3 }, () => {}),
      () => finder.pairs,
      () => finder.stats,
    ])
      refuses(use, /this PairFinder was disposed of/, gone);
    const array = jostle.array("float32", 6);
    array.dispose();
    refuses(() => array.view, /this MemoryArray was disposed of/, gone);
    if (Symbol.dispose !== undefined) {
      const other = new jostle.PairFinder();
      other.find(few, { dim: 3, accept: () => true });
      other[Symbol.dispose]();
      assert.ok(other.disposed);
    }
  });

  test(`arguments that would mean something else are refused: ${kind}`, async () => {
    const jostle = await loaded();
    const world = new jostle.World({ dim: 3 });
    const ids = world.add(good);
    world.update();
    const index = new jostle.BoxIndex({ dim: 3 });
    index.build(good);
    for (const enabled of [[false, false], "no", new Int8Array(2), 0, 1, undefined])
      refuses(() => world.setEnabled(ids, enabled), /^enabled is .*: it must be true or false/);
    refuses(() => world.add(good, { enabled: 0 }), /^enabled is 0/);
    refuses(() => world.add(good, { isStatic: 1 }), /^isStatic is 1/);
    refuses(() => world.setFilter(ids, [{ category: 1 }, { category: 2 }]), /^filter is a Array/);
    refuses(() => world.update(undefined, good), /^boxes came without ids/);
    const two = { boxes: good, spheres: new Float32Array(4) };
    refuses(() => index.count(two), /^queries are boxes and spheres/);
    const promise = /^a callback returned a promise/;
    const later = async () => false;
    refuses(() => jostle.findPairs(good, { dim: 3, accept: later }), promise);
    const finder = new jostle.PairFinder();
    refuses(() => finder.stream(good, { dim: 3 }, later), promise);
    const near = { nearest: new Float32Array(3), count: 2 };
    const near_ray = rays(new Float32Array(3), new Float32Array([1, 0, 0]), { dim: 3 });
    for (const asked of [index, world]) {
      refuses(() => asked.visit({ boxes: good.subarray(6) }, later), promise);
      refuses(() => asked.visit(near, later), promise);
      refuses(() => asked.visit(near, () => NaN), /^visit returned NaN/);
    }
    refuses(() => world.join(good, { accept: 0 }), /^0 is no function/);
    for (const options of [5, [], false]) {
      if (!Array.isArray(options)) // which add takes
        refuses(() => world.add(good, options), /^options are .*: they must be an object/);
      refuses(() => new jostle.World(options), /^options are /);
      for (const asked of [index, world]) {
        refuses(() => asked.all({ boxes: good }, options), /^options are /);
        refuses(() => asked.first(near_ray, options), /^options are /);
        refuses(() => asked.any({ boxes: good }, { asker: options }), /^the options of asker are /);
      }
    }
    for (const exclude of [-1, 2 ** 53, 1n])
      refuses(() => world.any({ boxes: good }, { exclude }), /^exclude is .*: it must be a whole number/);

    // What isn't done isn't ignored either.
    const enemies = undefined;
    refuses(() => jostle.findPairs(good, enemies, { dim: 3 }), /^other is undefined/);
    refuses(() => finder.stream(good, enemies, { dim: 3 }, () => {}), /^other is undefined/);
    for (const [options, message] of [
      [{ dim: 3, sort: true }, / doesn't sort pairs$/],
      [{ dim: 3, engine: "brute" }, / has the engine grid alone$/],
    ]) {
      refuses(() => finder.stream(good, options, () => {}), message);
      refuses(() => jostle.findScenes(good, [0, 2], options), message);
      if (options.engine) refuses(() => jostle.findPeriodicPairs(good, [9, 9, 9], options), message);
    }
    finder.dispose();
    world.update();
    const origins = new Float32Array([9, 9, 9, -1, -1, -1]);
    const away = rays(origins, new Float32Array(6).fill(1), { dim: 3 });
    for (const asked of [index, world]) assert.deepEqual([...asked.first(away).at], [Infinity, 1]);
    assert.equal(world.pairs().length, 2);
    const began = new jostle.World({ dim: 3 });
    began.add(good);
    began.update();
    const pairs = began.began();
    jostle.array("float64", 4_000_000); // memory grows
    assert.deepEqual(pairs, began.began()); // a copy
    assert.equal(pairs.length, 2);
  });
}
