// SPDX-License-Identifier: MIT
// The same answers, in the same order, as the library gives on every other platform:
// tests/platforms/golden/table.txt, by way of the package; and the checksums that `jostle bench` prints on
// this machine.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";

import { Hash, modules } from "./help.js";

const table = new Map(
  readFileSync(process.env.JOSTLE_GOLDEN, "utf8")
    .trim()
    .split("\n")
    .map((line) => line.split(" ")),
);

/** As hash_of_pairs there. */
function hash_of_pairs(jostle, finder, name, options) {
  const hash = new Hash();
  const scene = jostle.scene(name, 1000, 1, options);
  for (let frame = 0; frame < 2; ++frame, scene.step()) {
    const pairs = finder.find(scene.boxes, { dim: options.dim });
    hash.add(pairs.length / 2);
    for (const number of pairs) hash.add(number);
  }
  scene.dispose();
  return hash.value;
}

/** As hash_of_events there. */
function hash_of_events(jostle, name) {
  const hash = new Hash();
  const world = new jostle.World({ dim: 3 });
  const scene = jostle.scene(name, 300);
  const ids = new Float64Array(300);
  const index = (id) => id % 2 ** 32, generation = (id) => Math.floor(id / 2 ** 32);
  for (let frame = 0; frame < 12; ++frame) {
    const boxes = scene.boxes.view.slice();
    const there = (i) => world.contains(ids.subarray(i, i + 1))[0] === 1;
    for (let i = 0; i < 300; ++i) {
      const box = boxes.subarray(6 * i, 6 * i + 6), id = ids.subarray(i, i + 1);
      if (frame === 0 || (i % 7 === 0 && i % 5 === frame % 5 && !there(i)))
        ids[i] = world.add(box, { category: 1 << i % 3, mask: i % 4 === 0 ? 3 : 7, owner: i >> 1 })[0];
      else if (i % 7 === 0 && i % 11 === frame && there(i)) world.remove(id);
      else if (i % 3 === 0 && there(i)) world.move(id, box);
    }
    world.update();
    const began = world.began().slice(), ended = world.ended(), persisted = world.persisted();
    hash.add(began.length / 2, ended.reasons.length, persisted.length / 2);
    for (let k = 0; k < began.length; ++k) hash.add(index(began[k]), generation(began[k]));
    ended.reasons.forEach((reason, k) =>
      hash.add(index(ended.pairs[2 * k]), index(ended.pairs[2 * k + 1]), reason),
    );
    for (const number of persisted) hash.add(number);
    scene.step();
  }
  hash.add_bytes(world.save());
  world.dispose();
  scene.dispose();
  return hash.value;
}

for (const [kind, loaded] of Object.entries(modules)) {
  test(`pairs, events and motion are those of every platform: ${kind}`, async () => {
    const jostle = await loaded();
    const finder = new jostle.PairFinder();
    let rows = 0;
    const check = (what, hash) => {
      assert.equal(hash, table.get(what), what);
      ++rows;
    };
    for (const { name, hostile } of jostle.scenes) {
      check(`pairs_3f_${name}`, hash_of_pairs(jostle, finder, name, { dim: 3, type: "float32" }));
      check(`pairs_2d_${name}`, hash_of_pairs(jostle, finder, name, { dim: 2, type: "float64" }));
      if (!hostile) check(`events_${name}`, hash_of_events(jostle, name));
    }
    for (const { name } of jostle.simulations) {
      const simulation = jostle.simulation({ scene: name, bodies: 60 });
      for (let frame = 0; frame < 60; ++frame) simulation.step();
      check(`bodies_${name}`, simulation.hash.replace(/^0+/, ""));
      simulation.dispose();
    }
    assert.equal(rows, table.size);
  });
}

test("checksums are those of the command", async () => {
  const jostle = await modules.simd();
  const file = join(mkdtempSync(join(tmpdir(), "jostle-")), "bench.json");
  const names = jostle.scenes.filter(({ hostile }) => !hostile).map(({ name }) => name);
  execFileSync(process.env.JOSTLE_COMMAND, [
    "bench",
    ...names,
    "-n",
    "5000",
    "--seed",
    "7",
    "--frames",
    "1",
    "--threads",
    "1",
    "--json",
    file,
  ]);
  const rows = JSON.parse(readFileSync(file, "utf8"));
  assert.equal(rows.length, names.length);
  const finder = new jostle.PairFinder();
  for (const row of rows) {
    const scene = jostle.scene(row.scene, 5000, 7);
    for (let frame = 0; frame < 3; ++frame) scene.step(); // the command counts frames after three
    assert.equal(finder.find(scene.boxes, { dim: 3 }).length, 2 * row.pairs, row.scene);
    assert.equal(finder.checksum, row.checksum, row.scene);
    scene.dispose();
  }
});
