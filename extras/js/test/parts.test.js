// SPDX-License-Identifier: MIT
// The modules that have one space alone do as the whole one does, and are small.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";
import { gzipSync } from "node:zlib";

import { load, poses } from "jostle";
import { modules, random, random_boxes } from "./help.js";

const most_bytes = { pairs: 120_000, surfaces: 165_000, bush: 85_000, "2d": 545_000, "3d": 685_000 };

test("what a page loads stays small", () => {
  for (const [part, most] of Object.entries(most_bytes)) {
    const bytes = readFileSync(new URL(`./node_modules/jostle/dist/jostle-${part}.wasm`, import.meta.url));
    const packed = gzipSync(bytes, { level: 9 }).length;
    assert.ok(packed <= most, `jostle-${part}.wasm takes ${packed} bytes`);
  }
});

test("bundlers find what browsers load, and no file of node's", () => {
  const source = readFileSync(new URL("./node_modules/jostle/src/start.js", import.meta.url), "utf8");
  const found = [...source.matchAll(/new URL\(\s*"([^"]+)",\s*import\.meta\.url/g)].map((match) => match[1]);
  assert.equal(found.length, 9); // the modules, and the threads' worker
  for (const file of found) assert.match(file, /^\.\.\/dist\/jostle[-\w]*\.(wasm|worker\.js)$/);
});

for (const [only, dim] of [["2d", 2], ["3d", 3]])
  test(`the module with ${only} alone answers as the whole one`, async () => {
    const [jostle, whole] = [await load({ only }), await modules.simd()];
    const boxes = random_boxes(400, dim, 5), moved = boxes.map((bound) => bound + 0.75);
    const same = (work) => assert.deepEqual(work(jostle), work(whole));
    for (const { name } of whole.scenes)
      same((module) => module.findPairs(module.scene(name, 500, 2, { dim }).boxes, { dim }));
    for (const engine of ["chapter", "uniform", "brute"])
      same((module) => module.findPairs(boxes, { dim, engine }));
    same((module) => module.findPeriodicPairs(boxes, new Array(dim).fill(100), { dim }));
    same((module) => module.bricks(boxes, { dim }));
    same((module) => {
      const world = new module.World({ dim });
      const ids = world.add(boxes);
      world.update();
      const first = world.began().slice();
      world.update(ids.subarray(0, 200), moved.subarray(0, 400 * dim));
      const { pairs, reasons } = world.ended();
      return [first, world.began().slice(), pairs.slice(), reasons.slice(), world.pairs(), world.save()];
    });
    same((module) => {
      const index = new module.BoxIndex({ dim });
      index.build(boxes);
      return [
        index.first({ rays: Float32Array.of(...new Array(dim).fill(-1), ...new Array(dim).fill(1), 100) }),
        index.all({ nearest: new Float32Array(dim), count: 9 }).of(0),
        index.join(moved),
      ];
    });
    same((module) => {
      const next = random(dim), count = 100;
      const shapes = new module.Shapes({ dim });
      shapes.addSpheres(Float64Array.from({ length: count / 2 }, () => 0.5 + next()));
      shapes.addBoxes(Float64Array.from({ length: (dim * count) / 2 }, () => 0.3 + next()));
      const at = Float32Array.from({ length: dim * count }, () => next() * (dim === 2 ? 16 : 8));
      const objects = { shapes, poses: poses(at, { dim }) };
      const pairs = module.findPairs(module.bounds(objects), { dim, sort: true });
      const found = new module.ContactFinder({ dim }).find(objects, pairs);
      assert.ok(found.length > 20);
      return found;
    });
    const alone = { message: /this module has [23]D in float32 alone/ };
    assert.throws(() => jostle.findPairs(new Float64Array(2 * dim), { dim }), alone);
    assert.throws(() => jostle.findPairs(new Float32Array(2 * (5 - dim)), { dim: 5 - dim }), alone);
    assert.throws(() => new jostle.World({ dim: 5 - dim }), alone);
    assert.throws(() => new jostle.BoxIndex({ dim, type: "float64" }), alone);
    assert.throws(() => new jostle.ContactFinder({ dim: 5 - dim }), alone);
    if (dim === 2) {
      assert.deepEqual(jostle.simulations, []);
      assert.throws(() => jostle.simulation(), /no simulations/);
    } else
      same((module) => {
        const simulation = module.simulation({ scene: "mixed", bodies: 200 });
        for (let frame = 0; frame < 30; ++frame) simulation.step();
        return simulation.hash;
      });
  });
