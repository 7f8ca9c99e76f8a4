// SPDX-License-Identifier: MIT
import assert from "node:assert/strict";
import test from "node:test";

import { findPairs, load } from "jostle";
import { modules, random, random_boxes, slow_pairs, slow_pairs_between } from "./help.js";

const sorted = { sort: true };

for (const [kind, loaded] of Object.entries(modules)) {
  test(`finds what the definition finds: ${kind}`, async () => {
    const jostle = await loaded();
    for (const dim of [2, 3])
      for (const Array of [Float32Array, Float64Array])
        for (const count of [0, 1, 2, 100, 700]) {
          const boxes = random_boxes(count, dim, count + dim, { Array, whole: count === 100 });
          const others = random_boxes(count >> 1, dim, 3 * count + dim, { Array });
          const what = `${count} boxes in ${dim}D, ${Array.name}`;
          assert.deepEqual([...jostle.findPairs(boxes, { dim, ...sorted })], slow_pairs(boxes, dim), what);
          assert.deepEqual(
            [...jostle.findPairs(boxes, others, { dim, ...sorted })],
            slow_pairs_between(boxes, others, dim),
            what,
          );
          for (const engine of ["chapter", "uniform", "brute"])
            assert.deepEqual(
              [...jostle.findPairs(boxes, { dim, engine, ...sorted })],
              slow_pairs(boxes, dim),
              `${what}, ${engine}`,
            );
        }
  });

  test(`filters: ${kind}`, async () => {
    const jostle = await loaded();
    const boxes = random_boxes(400, 3, 5), next = random(9);
    const column = (most) => Uint32Array.from({ length: 400 }, () => Math.floor(next() * most));
    const category = column(8),
      mask = column(8),
      owner = column(20).map((each) => (each === 0 ? 0xffffffff : each));
    const agree = (i, j) => (category[i] & mask[j]) !== 0 && (category[j] & mask[i]) !== 0;
    const strangers = (i, j) => owner[i] !== owner[j] || owner[i] === 0xffffffff;
    const found = (options) => [...jostle.findPairs(boxes, { dim: 3, sort: true, ...options })];
    assert.deepEqual(found({ category, mask }), slow_pairs(boxes, 3, agree));
    assert.deepEqual(found({ owner }), slow_pairs(boxes, 3, strangers));
    assert.deepEqual(found({ category, mask, owner, accept: (a, b) => (a + b) % 3 !== 0 }),
      slow_pairs(boxes, 3, (i, j) => agree(i, j) && strangers(i, j) && (i + j) % 3 !== 0));
    const vertices = Uint32Array.from({ length: 1200 }, () => (next() < 0.2 ? 0xffffffff : next() * 100));
    const of = (i) => vertices.subarray(3 * i, 3 * i + 3);
    const apart = (i, j) => !of(i).some((each) => each !== 0xffffffff && of(j).includes(each));
    assert.deepEqual(found({ vertices }), slow_pairs(boxes, 3, apart));
    assert.ok(found({ vertices }).length < found({}).length);
    assert.deepEqual(found({ vertices, ghosts: 100, owner }),
      slow_pairs(boxes, 3, (i, j) => apart(i, j) && strangers(i, j) && (i < 300 || j < 300)));
    const periodic = jostle.findPeriodicPairs(boxes, [100, 0, 0], { dim: 3, sort: true, vertices });
    assert.deepEqual([...periodic.pairs], slow_pairs(boxes, 3, apart));
    const others = random_boxes(300, 3, 6);
    const between = jostle.findPairs(boxes, others, {
      dim: 3,
      sort: true,
      category,
      mask,
      categoryB: category.subarray(0, 300),
      maskB: mask.subarray(0, 300),
    });
    assert.deepEqual([...between], slow_pairs_between(boxes, others, 3, agree));
  });

  test(`streams what find finds: ${kind}`, async () => {
    const jostle = await loaded();
    const scene = jostle.scene("clustered", 20_000);
    const finder = new jostle.PairFinder();
    const whole = finder.find(scene.boxes, { dim: 3 }).slice();
    const parts = [];
    assert.equal(finder.stream(scene.boxes, { dim: 3 }, (pairs) => void parts.push(...pairs)), true);
    assert.deepEqual(Uint32Array.from(parts), whole);
    assert.equal(finder.stats.pairs, whole.length / 2);
    const fresh = new jostle.PairFinder();
    fresh.stream(scene.boxes, { dim: 3 }, () => true);
    assert.equal(fresh.stats.pairs, whole.length / 2);
    fresh.dispose();
    let calls = 0;
    assert.equal(finder.stream(scene.boxes, { dim: 3 }, () => ++calls < 2), false);
    assert.equal(calls, 2);
    scene.dispose();
    finder.dispose();
  });
}

test("the module with pairs alone finds the same", async () => {
  const [jostle, whole] = [await load({ only: "pairs" }), await modules.simd()];
  for (const { name } of whole.scenes) {
    const boxes = whole.scene(name, 500, 2).boxes.view.slice();
    assert.deepEqual(jostle.findPairs(boxes, { dim: 3 }), whole.findPairs(boxes, { dim: 3 }), name);
  }
  const boxes = random_boxes(300, 2, 4);
  assert.deepEqual(jostle.findPairs(boxes, { dim: 2 }), whole.findPairs(boxes, { dim: 2 }));
  assert.deepEqual(jostle.scenes, []);
  for (const beyond of [
    () => jostle.bricks(boxes, { dim: 2 }),
    () => jostle.scene("uniform", 10),
    () => jostle.findPairs(boxes, { dim: 2, engine: "brute" }),
  ])
    assert.throws(beyond, /this module has pairs alone/);
  assert.throws(() => jostle.findPairs(new Float32Array([0, 0, NaN, 0]), { dim: 2 }), {
    status: "nan_coordinate",
    index: 0,
  });
});

test("findPairs needs no module of the caller's, and no word but the boxes'", async () => {
  const boxes = random_boxes(200, 2, 4), others = random_boxes(100, 2, 5);
  const found = findPairs(boxes, { dim: 2, sort: true }); // at once, and again before it is there
  assert.deepEqual([...(await findPairs(boxes, { dim: 2, sort: true }))], slow_pairs(boxes, 2));
  assert.deepEqual([...(await found)], slow_pairs(boxes, 2));
  const between = await findPairs(boxes, others, { dim: 2, sort: true });
  assert.deepEqual([...between], slow_pairs_between(boxes, others, 2));
  await assert.rejects(findPairs(boxes, { dim: 4 }), { name: "JostleError", message: /dim is 4/ });
});

test("memory of the module's is read in place, and a steady frame takes no more of it", async () => {
  const jostle = await modules.simd();
  const count = 50_000;
  const boxes = jostle.array("float32", 6 * count);
  const scene = jostle.scene("uniform", count);
  const finder = new jostle.PairFinder();
  let bytes;
  for (let frame = 0; frame < 8; ++frame, scene.step()) {
    boxes.view.set(scene.boxes.view);
    const pairs = finder.find(boxes, { dim: 3 });
    assert.equal(pairs.buffer.byteLength, jostle.memoryBytes); // a view
    if (frame === 4) bytes = jostle.memoryBytes;
    assert.equal(jostle.checksum(jostle.findPairs(scene.boxes, { dim: 3 })), finder.checksum);
  }
  assert.equal(jostle.memoryBytes, bytes);
  for (const each of [boxes, scene, finder]) each.dispose();
});

test("statistics tell of the last search", async () => {
  const jostle = await modules.simd();
  const finder = new jostle.PairFinder();
  const scene = jostle.scene("uniform", 30_000);
  const pairs = finder.find(scene.boxes, { dim: 3 }).length / 2;
  const stats = finder.stats;
  assert.equal(stats.objects, 30_000);
  assert.equal(stats.pairs, pairs);
  assert.ok(
    stats.records >= 30_000 && stats.candidates > pairs && stats.bricks > 1 && stats.bytesReserved > 0,
  );
  assert.ok(
    stats.msTotal > 0 &&
      stats.msTune + stats.msScatter + stats.msSweep + stats.msFinish <= stats.msTotal * 1.01,
  );
  finder.find(scene.boxes, { dim: 3, engine: "chapter" });
  assert.deepEqual([finder.stats.objects, finder.stats.pairs, finder.stats.bricks], [30_000, pairs, 0]);
  assert.equal(finder.checksum, jostle.checksum(jostle.findPairs(scene.boxes, { dim: 3 })));
});

test("of two sets the narrower numbers are widened, which is exact", async () => {
  const jostle = await modules.simd();
  const narrow = Float32Array.of(0, 0, 1, 1, 5, 5, 6, 6);
  const wide = Float64Array.of(1 + 1e-12, 0, 2, 2, 6, 6, 7, 7); // the first is just beside
  assert.deepEqual([...jostle.findPairs(narrow, wide, { dim: 2 })], [1, 1]);
  assert.deepEqual([...jostle.findPairs(wide, narrow, { dim: 2 })], [1, 1]);
  const placed = jostle.array("float32", 8);
  placed.view.set(narrow);
  assert.deepEqual([...jostle.findPairs(placed, wide, { dim: 2 })], [1, 1]);
  placed.dispose();
});

test("a checksum has 16 digits, also where it begins with zeros", async () => {
  const jostle = await modules.simd();
  const sums = Array.from({ length: 200 }, (_, i) => jostle.checksum(Uint32Array.of(i, i + 1)));
  assert.ok(sums.every((sum) => /^[0-9a-f]{16}$/.test(sum)) && sums.some((sum) => sum.startsWith("0")));
});

test("many scenes", async () => {
  for (const loaded of Object.values(modules)) {
    const jostle = await loaded();
    const boxes = random_boxes(300, 2, 12), offsets = [0, 40, 40, 170, 300];
    const found = jostle.findScenes(boxes, offsets, { dim: 2 });
    assert.equal(found.length, 4);
    for (let k = 0; k < 4; ++k)
      assert.deepEqual(
        found.of(k),
        jostle.findPairs(boxes.slice(4 * offsets[k], 4 * offsets[k + 1]), { dim: 2 }),
      );
    const odd = jostle.findScenes(boxes, offsets, {
      dim: 2,
      accept: (scene, a, b) => (scene + a + b) % 2 === 1,
    });
    const all = [...Array(4).keys()].map((k) => [...odd.of(k)]);
    assert.deepEqual(all, [...Array(4).keys()].map((k) => {
      const pairs = [...found.of(k)];
      return pairs.filter((_, i) => (k + pairs[i & ~1] + pairs[i | 1]) % 2 === 1);
    }));
  }
});

test("space that repeats itself", async () => {
  const jostle = await modules.simd();
  // The second reaches over the end of x.
  const boxes = new Float64Array([0.1, 4, 1, 5, 9, 4, 10.2, 5, 4, 4, 5, 5]);
  const { pairs, shifts } = jostle.findPeriodicPairs(boxes, [10, 0], { dim: 2 });
  assert.deepEqual([...pairs], [0, 1]);
  assert.deepEqual([...shifts], [-10, 0]);
  const scene = random_boxes(200, 3, 77, { world: 20 });
  const found = jostle.findPeriodicPairs(scene, [20, 20, 0], { dim: 3 });
  const expected = [];
  for (let x = -20; x <= 20; x += 20)
    for (let y = -20; y <= 20; y += 20) {
      const moved = scene.map((bound, i) => bound + [x, y, 0][i % 3]);
      for (let i = 0; i < 200; ++i)
        for (let j = i + 1; j < 200; ++j) {
          let touch = true;
          for (let d = 0; d < 3; ++d)
            touch &&= scene[6 * i + d] <= moved[6 * j + 3 + d] && moved[6 * j + d] <= scene[6 * i + 3 + d];
          if (touch) expected.push(`${i} ${j}`);
        }
    }
  const text = [];
  for (let k = 0; k < found.pairs.length; k += 2)
    text.push(
      found.pairs
        .slice(k, k + 2)
        .sort()
        .join(" "),
    );
  assert.deepEqual(text.sort(), expected.sort());
});

test("bricks: boxes lie in all that they touch, pairs in the one that owns them", async () => {
  const jostle = await modules.simd();
  for (const dim of [2, 3])
    for (const name of ["uniform", "mixed", "flat"]) {
      const scene = jostle.scene(name, 5000, 3, { dim });
      const finder = new jostle.PairFinder();
      const wanted = new Set();
      const pairs = finder.find(scene.boxes, { dim, sort: true });
      for (let k = 0; k < pairs.length; k += 2) wanted.add(pairs[k] * 65536 + pairs[k + 1]);
      const { nestedGrids, records } = finder.stats;
      const bricks = jostle.bricks(scene.boxes, { dim });
      if (nestedGrids === 0) assert.equal(bricks.objects.length, records, name);
      assert.equal(bricks.first.at(-1), bricks.objects.length);
      assert.equal(bricks.at.length, dim * (bricks.first.length - 1));
      const boxes = scene.boxes.view.slice();
      const owned = new Set();
      for (let brick = 0; brick + 1 < bricks.first.length; ++brick) {
        const place = bricks.at.subarray(dim * brick, dim * brick + dim);
        for (let d = 0; d < dim; ++d) assert.ok(place[d] < bricks.cells[d]);
        for (let r = bricks.first[brick]; r < bricks.first[brick + 1]; ++r) {
          const object = bricks.objects[r];
          for (let d = 0; d < dim; ++d) {
            const [lo, hi] = bricks.bounds.subarray(2 * (dim * r + d));
            assert.ok(lo <= hi && hi <= bricks.quanta);
            const start = bricks.origin[d] + place[d] * bricks.edge[d],
              quantum = bricks.edge[d] / bricks.quanta;
            const copy = (bricks.copies[r] >> d) & 1;
            // Inside the grid, bounds in quanta are those of the box.
            const low = boxes[2 * dim * object + d];
            if (!copy && low > bricks.origin[d] && place[d] + 1 < bricks.cells[d] && quantum > 0)
              assert.ok(
                Math.abs(start + lo * quantum - low) <= 2 * quantum,
                `${name} ${dim}D: box ${object}`,
              );
            if (copy) assert.equal(lo, 0);
          }
          for (let s = bricks.first[brick]; s < r; ++s) {
            const [a, b] = [bricks.objects[s], object].sort((x, y) => x - y);
            if ((bricks.copies[s] & bricks.copies[r]) !== 0 || !wanted.has(a * 65536 + b)) continue;
            assert.ok(!owned.has(a * 65536 + b), "two bricks own a pair");
            owned.add(a * 65536 + b);
          }
        }
      }
      assert.equal(owned.size, wanted.size, `${name} ${dim}D`);
      scene.dispose();
      finder.dispose();
    }
});
