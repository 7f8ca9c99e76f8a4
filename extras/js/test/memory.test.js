// SPDX-License-Identifier: MIT
// Memory is given back: what is disposed of at once, what is forgotten by the garbage collector; and a
// refused growth is an error.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { setFlagsFromString } from "node:v8";
import { runInNewContext } from "node:vm";

import { load } from "jostle";
import { random_boxes } from "./help.js";

setFlagsFromString("--expose-gc");
const collect = runInNewContext("gc");

/** Everything that holds memory, once. */
function use_everything(jostle, boxes) {
  const ids = Uint32Array.from({ length: boxes.length / 6 }, (_, i) => i);
  const finder = new jostle.PairFinder();
  finder.find(boxes, { dim: 3 });
  const index = new jostle.BoxIndex({ dim: 3 });
  index.build(boxes, ids);
  index.all({ boxes });
  const world = new jostle.World({ dim: 3, accept: () => world.dim === 3 }); // it knows the world
  world.add(boxes);
  world.update();
  const fork = world.fork();
  const shapes = new jostle.Shapes();
  const ball = jostle.sphere(1);
  shapes.add(ball, 1000);
  const contacts = new jostle.ContactFinder({ dim: 3 });
  const scene = jostle.scene("uniform", 5000);
  const simulation = jostle.simulation({ bodies: 200 });
  simulation.step();
  const array = jostle.array("float64", 100_000);
  jostle.bricks(boxes, { dim: 3 });
  finder.find(boxes, { dim: 3, engine: "chapter" });
  return [finder, index, world, fork, shapes, ball, contacts, scene, simulation, array];
}

test("what is disposed of is used again", async () => {
  const jostle = await load();
  const boxes = random_boxes(5000, 3, 1);
  let bytes;
  for (let round = 0; round < 40; ++round) {
    for (const each of use_everything(jostle, boxes)) each.dispose();
    if (round === 4) bytes = jostle.memoryBytes;
  }
  assert.equal(jostle.memoryBytes, bytes);
});

test("what is forgotten is used again", async () => {
  const jostle = await load();
  const boxes = random_boxes(5000, 3, 1);
  let bytes;
  for (let round = 0; round < 40; ++round) {
    use_everything(jostle, boxes);
    collect();
    await new Promise((done) => setTimeout(done, 5)); // finalizers run between tasks
    if (round === 9) bytes = jostle.memoryBytes;
  }
  assert.ok(jostle.memoryBytes <= 1.5 * bytes, `${bytes} bytes became ${jostle.memoryBytes}`);
});

test("what was disposed of isn't freed once more when it is forgotten", async () => {
  const jostle = await load();
  const filled = (value) => {
    const array = jostle.array("uint32", 1000);
    array.view.fill(value);
    return array;
  };
  const many = (first) => Array.from({ length: 50 }, (_, i) => filled(first + i));
  for (const each of many(0)) each.dispose();
  const kept = many(100); // where those were
  await new Promise((done) => setTimeout(done, 5));
  collect();
  await new Promise((done) => setTimeout(done, 50));
  const more = many(200);
  for (const [first, arrays] of [[100, kept], [200, more]])
    arrays.forEach((array, i) => assert.ok(array.view.every((value) => value === first + i)));
});

test("a world's accept is forgotten with the last world that asks it", async () => {
  const jostle = await load();
  const made = () => {
    const accept = () => true;
    const world = new jostle.World({ dim: 2, accept }), fork = world.fork();
    world.dispose();
    return [fork, new WeakRef(accept)];
  };
  const [fork, accept] = made();
  const later = async () => {
    await new Promise((done) => setTimeout(done, 5));
    collect();
    return accept.deref();
  };
  assert.equal(typeof (await later()), "function");
  fork.dispose();
  assert.equal(await later(), undefined);
});

test("threads end with their module", async () => {
  process.report.excludeNetwork = true;
  const workers = () => process.report.getReport().workers.length;
  const before = workers();
  const jostle = await load({ threads: 3 });
  assert.equal(workers(), before + 2);
  jostle.dispose();
  for (let tries = 0; workers() > before && tries < 100; ++tries)
    await new Promise((done) => setTimeout(done, 50));
  assert.equal(workers(), before);
});

test("failures leak nothing", async () => {
  const jostle = await load();
  const bad = random_boxes(20_000, 3, 1);
  bad[60_000] = NaN;
  let bytes;
  for (let round = 0; round < 200; ++round) {
    assert.throws(() => jostle.findPairs(bad, { dim: 3 }), { status: "nan_coordinate", index: 10_000 });
    assert.throws(() => new jostle.World({ dim: 3, margin: -1, accept: () => true }), {
      status: "invalid_argument",
    });
    if (round === 9) bytes = jostle.memoryBytes;
  }
  assert.equal(jostle.memoryBytes, bytes);
});

test("memory that is refused is an error, and the module goes on", async () => {
  for (const options of [{}, { threads: 2 }]) {
    const jostle = await load({ ...options, maxMemory: 32 * 2 ** 20 });
    const good = new Float32Array([0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1]);
    assert.throws(() => jostle.array("float64", 100_000_000), {
      name: "JostleError",
      status: "out_of_memory",
    });
    assert.throws(() => jostle.findPairs(new Float32Array(60_000_000), { dim: 3 }), {
      status: "out_of_memory",
    });
    const scene = jostle.scene("identical", 3000); // 4,498,500 pairs: 36 MB
    assert.throws(() => jostle.findPairs(scene.boxes, { dim: 3 }), { status: "out_of_memory" });
    assert.throws(() => jostle.scene("uniform", 10_000_000), { status: "out_of_memory" });
    assert.ok(jostle.memoryBytes <= 32 * 2 ** 20);
    assert.deepEqual([...jostle.findPairs(good, { dim: 3 })], [0, 1]);
    jostle.dispose();
  }
});

test("the types name what there is", async () => {
  const jostle = await load();
  const types = readFileSync(new URL("./node_modules/jostle/jostle.d.ts", import.meta.url), "utf8");
  const boxes = random_boxes(10, 3, 1);
  const world = new jostle.World({ dim: 3 }),
    finder = new jostle.PairFinder(),
    index = new jostle.BoxIndex({ dim: 3 });
  const scene = jostle.scene("uniform", 10), simulation = jostle.simulation({ bodies: 3 });
  const shapes = new jostle.Shapes({ shapes: [jostle.sphere(1)] });
  index.build(boxes);
  finder.find(boxes, { dim: 3 });
  const made = {
    Jostle: jostle,
    World: world,
    PairSlots: new jostle.PairSlots(),
    PairFinder: finder,
    BoxIndex: index,
    Scene: scene,
    Simulation: simulation,
    Shapes: shapes,
    Shape: jostle.sphere(1),
    ContactFinder: new jostle.ContactFinder({ dim: 3 }),
    MemoryArray: scene.boxes,
    FindStats: finder.stats,
    WorldStats: world.stats,
    Bricks: jostle.bricks(boxes, { dim: 3 }),
    SceneInfo: scene.info,
    SimulationInfo: jostle.simulations[0],
    Contacts: simulation.contacts(),
    Hits: index.first({ rays: new Float32Array(7).fill(1) }),
    Answers: index.all({ boxes }),
    EndedPairs: world.ended(),
    ScenePairs: jostle.findScenes(boxes, [0, 10], { dim: 3 }),
  };
  const members_of = (name) => {
    const [, parents, body] =
      new RegExp(`^export interface ${name}\\b([^{]*)\\{\\n(.*?)^\\}`, "ms").exec(types) ?? assert.fail(name);
    const plain = body.replace(/\/\*\*.*?\*\//gs, "").replace(/\{[^{}\n]*\}/g, "{}");
    const own = [...plain.matchAll(/(?:^  |; )(?:readonly )?(\w+)[(:<?]/gm)].map((found) => found[1]);
    return [
      ...own,
      ...[...parents.matchAll(/\b(Disposable|JostlePairs)\b/g)].flatMap((parent) => members_of(parent[1])),
    ];
  };
  for (const [name, value] of Object.entries(made)) {
    const members = members_of(name);
    assert.ok(members.length > 0, name);
    for (const member of members) assert.ok(member in value, `${name}.${member}`);
    const known = new Set([
      ...members,
      "core",
      "type",
      "pointer",
      "first",
      "all",
      "any",
      "count",
      "owner",
      "reserved",
    ]);
    for (const member of Object.keys(value)) assert.ok(known.has(member), `${name}.${member} has no type`);
  }
});
