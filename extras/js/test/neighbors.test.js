// SPDX-License-Identifier: MIT
// Neighbour lists beside the definition: all images of all points, each operation rounded by itself.
import assert from "node:assert/strict";
import test from "node:test";

import { load } from "jostle";
import { modules, spread } from "./help.js";

const jostle = await modules.simd();

/** Rows of { j, S, D, d } for each point: `cutoff_of(i, j)` in the points' numbers. */
function slow(points, others, cutoff_of, dim, vectors, repeats, reach) {
  const round = points instanceof Float32Array ? Math.fround : (x) => x;
  const same = others === points,
    axes = [...Array(dim).keys()];
  const shifts = axes.reduce(
    (all, d) =>
      all.flatMap((S) =>
        repeats[d] ? [...Array(2 * reach + 1).keys()].map((k) => [...S, k - reach]) : [[...S, 0]],
      ),
    [[]],
  );
  const shifted = shifts.map((S) =>
    axes.map((d) => {
      const along = axes.filter((k) => repeats[k]).map((k) => round(S[k] * vectors[dim * k + d]));
      return along.length === 0 ? 0 : along.reduce((sum, each) => round(sum + each));
    }),
  );
  return Array.from({ length: points.length / dim }, (_, i) => {
    const row = [];
    for (let j = 0; j < others.length / dim; ++j)
      shifts.forEach((S, k) => {
        if (same && i === j && S.every((each) => each === 0)) return;
        const D = axes.map((d) => round(round(others[dim * j + d] - points[dim * i + d]) + shifted[k][d]));
        const squared = D.map((each) => round(each * each)).reduce((sum, each) => round(sum + each));
        const c = cutoff_of(i, j);
        if (c > 0 && squared <= round(c * c)) row.push({ j, S, D, d: round(Math.sqrt(squared)) });
      });
    return row;
  });
}

function rows_of({ j, S, D, d, o }, dim) {
  const three = (all, k) => [...all.subarray(dim * k, dim * (k + 1))];
  return Array.from({ length: o.length - 1 }, (_, i) =>
    Array.from({ length: o[i + 1] - o[i] }, (_, k) => k + o[i]).map((k) => ({
      j: j[k],
      S: three(S, k).map((each) => each + 0),
      D: three(D, k),
      d: d[k],
    })),
  );
}
/** -0 and 0 are one number here. */
const plain = (rows) =>
  rows.map((row) => row.map(({ j, S, D, d }) => ({ j, S: S.map((s) => s + 0), D: D.map((x) => x + 0), d })));
function same_rows(found, wanted, dim) {
  assert.deepEqual(plain(rows_of(found, dim)), plain(wanted));
  const i = wanted.flatMap((row, i) => row.map(() => i));
  assert.deepEqual([...found.i], i);
}

const all = { quantities: "ijSDdo" };

for (const Array_ of [Float32Array, Float64Array])
  for (const dim of [2, 3])
    test(`all images, ${dim}D, ${Array_.name}`, () => {
      const round = Array_ === Float32Array ? Math.fround : (x) => x;
      for (let seed = 1; seed <= 25; ++seed) {
        const next = spread(seed),
          count = Math.floor(24 * next());
        const repeats = Array.from({ length: dim }, () => next() < 0.6);
        const edge = 2 + 2 * next(),
          skew = next() < 0.5 ? 0 : edge;
        const vectors = Array_.from({ length: dim * dim }, (_, k) =>
          Math.floor(k / dim) === k % dim ? edge : skew * (next() - 0.5) * 0.6,
        );
        const whole = seed % 3 === 0; // so that many are exactly at the cutoff
        const at = (length) =>
          Array_.from({ length }, () => (whole ? Math.floor(5 * next()) - 1 : 4 * next() - 1));
        const points = at(dim * count),
          cutoff = whole ? 2 : round(0.5 + 2 * next());
        const options = { dim, cell: vectors, periodic: repeats, ...all };
        const slowly = (others, cutoff_of) => slow(points, others, cutoff_of, dim, vectors, repeats, 7);
        const wanted = slowly(points, () => cutoff);
        const found = jostle.neighbors(points, cutoff, options);
        same_rows(found, wanted, dim);

        // Half: each pair from one side.
        const half = jostle.neighbors(points, cutoff, { ...options, full: false });
        const sides = rows_of(half, dim).flatMap((row, i) =>
          row.flatMap(({ j, S }) =>
            [
              [i, j, ...S],
              [j, i, ...S.map((s) => 0 - s)],
            ].map(String),
          ),
        );
        assert.deepEqual(
          sides.sort(),
          wanted.flatMap((row, i) => row.map(({ j, S }) => String([i, j, ...S]))).sort(),
        );

        // Two sets, cutoffs of points, of types.
        const others = at(dim * Math.floor(24 * next()));
        same_rows(
          jostle.neighbors(points, cutoff, { ...options, others }),
          slowly(others, () => cutoff),
          dim,
        );
        const radii = Array_.from({ length: count }, () => (whole ? Math.floor(3 * next()) : 1.5 * next()));
        radii.fill(1, 0, 1); // no search has cutoffs of 0 alone
        const radii_b = Array_.from({ length: others.length / dim }, () => next());
        same_rows(
          jostle.neighbors(points, radii, options),
          slowly(points, (i, j) => round(radii[i] + radii[j])),
          dim,
        );
        same_rows(
          jostle.neighbors(points, radii, { ...options, greater: true }),
          slowly(points, (i, j) => Math.max(radii[i], radii[j])),
          dim,
        );
        same_rows(
          jostle.neighbors(points, radii, { ...options, others, cutoffB: radii_b }),
          slowly(others, (i, j) => round(radii[i] + radii_b[j])),
          dim,
        );
        const types = Array.from({ length: count }, () => Math.floor(2 * next()));
        const table = [1.5, 2, 2, 0].map(round);
        same_rows(
          jostle.neighbors(points, table, { ...options, types }),
          slowly(points, (i, j) => table[2 * types[i] + types[j]]),
          dim,
        );
      }
    });

test("lengths of a cell, rows of it, and open space", () => {
  const points = new Float64Array([0.1, 0, 0, 4.9, 0, 0, 2.5, 3, 0]);
  const skewed = {
    dim: 3,
    cell: [
      [5, 0, 0],
      [2, 6, 0],
      [0, 0, 1],
    ],
    periodic: [true, true, false],
  };
  assert.deepEqual(jostle.neighbors(points, 1, { ...skewed, quantities: "ijS" }), {
    i: new Uint32Array([0, 1]),
    j: new Uint32Array([1, 0]),
    S: new Int32Array([-1, 0, 0, 1, 0, 0]),
  });
  const { d } = jostle.neighbors(points, 1, {
    dim: 3,
    cell: [5, 6, 1],
    periodic: [true, true, false],
    quantities: "d",
  });
  assert.deepEqual(
    [...d].map((each) => each.toFixed(6)),
    ["0.200000", "0.200000"],
  );
  assert.deepEqual(Object.keys(jostle.neighbors(points, 1, { dim: 3 })), ["i", "j"]);
  assert.equal(jostle.neighbors(points, 1, { dim: 3 }).j.length, 0);
  assert.equal(jostle.neighbors(new Float32Array(0), 1, { dim: 3, quantities: "o" }).o.length, 1);
  for (const cutoff of [1, []])
    assert.equal(jostle.neighbors(new Float32Array(0), cutoff, { dim: 2 }).j.length, 0);
});

test("many systems in a call are as each alone", () => {
  const next = spread(4),
    sizes = [7, 0, 12, 3],
    dim = 3;
  const systems = sizes.map((size) => Float32Array.from({ length: dim * size }, () => 4 * next()));
  const cells = sizes.map((_, k) => [3 + k, 0, 0, 1, 4, 0, 0, 0, 5]);
  const periodic = sizes.map((_, k) => [true, k % 2 === 0, false]);
  const points = Float32Array.from(systems.flatMap((each) => [...each]));
  const offsets = [0]; // where each begins
  for (const size of sizes) offsets.push(offsets.at(-1) + size);
  const found = jostle.neighbors(points, 1.5, { dim, offsets, cell: cells, periodic, ...all });
  const wanted = systems.flatMap((each, k) =>
    rows_of(jostle.neighbors(each, 1.5, { dim, cell: cells[k], periodic: periodic[k], ...all }), dim).map(
      (row) => row.map((one) => ({ ...one, j: one.j + offsets[k] })),
    ),
  );
  same_rows(found, wanted, dim);
  assert.ok(found.j.length > 20);
});

test("a finder keeps its list within a skin, and on threads it is the same", async () => {
  const threaded = await modules.threads();
  const next = spread(9),
    dim = 3,
    points = Float64Array.from({ length: 3 * 2000 }, () => 12 * next());
  const box = { cell: [12, 12, 12], periodic: true, ...all };
  const finder = new jostle.NeighborFinder({ dim, type: "float64", skin: 0.4 });
  const searched = [];
  for (let step = 0; step < 8; ++step) {
    const found = finder.find(points, 1, box);
    searched.push(finder.searched);
    for (const module of [jostle, threaded])
      assert.deepEqual(found, module.neighbors(points, 1, { dim, ...box }));
    for (let k = 0; k < points.length; ++k) points[k] += 0.1 * (next() - 0.5);
  }
  assert.equal(searched[0], true);
  assert.ok(searched.includes(false) && searched.slice(1).includes(true), searched.join());
  finder.releaseMemory();
  assert.ok(finder.find(points, 1, box).j.length > 0);
  assert.equal(finder.searched, true);
  finder.dispose();
  assert.throws(() => finder.find(points, 1), { status: "bad_handle" });
  assert.throws(() => finder.searched, { status: "bad_handle" });
});

test("points in the module's memory, and in modules of one space", async () => {
  const next = spread(2),
    points = Float32Array.from({ length: 300 }, () => 5 * next());
  const inside = jostle.array("float32", points.length);
  inside.view.set(points);
  for (const dim of [2, 3]) {
    const wanted = jostle.neighbors(points, 1, { dim, ...all });
    assert.deepEqual(jostle.neighbors(inside, 1, { dim, ...all }), wanted);
    const alone = await load({ only: `${dim}d` });
    assert.deepEqual(alone.neighbors(points, 1, { dim, ...all }), wanted);
  }
  const pairs = await load({ only: "pairs" });
  assert.throws(() => pairs.neighbors(points, 1, { dim: 3 }), /this module has pairs alone/);
});

test("bad input is refused by name", () => {
  const points = new Float64Array([0, 0, 0, 1, 0, 0]),
    more = { dim: 3 };
  const refused = (given, message, status) => {
    const [at, cutoff, options] = given;
    assert.throws(() => jostle.neighbors(at, cutoff, { ...more, ...options }), {
      name: "JostleError",
      message,
      ...status,
    });
  };
  refused([new Float64Array([0, NaN, 0]), 1], /NaN|nan/, { index: 0 });
  refused([new Float64Array(4), 1], /multiple of 3/);
  refused([[0, 0, 0], 1], /points is a Array/);
  refused([points, 0], /cutoff/);
  refused([points, -1], /cutoff/);
  refused([points, undefined], /cutoff is undefined/);
  refused([points, [1]], /cutoff has 1 numbers, and there are 2 points/);
  refused([points, 1, { dim: 4 }], /dim is 4/);
  refused([points, 1, { quantities: "ix" }], /quantities is "ix"/);
  refused([points, 1, { quantities: "" }], /quantities is ""/);
  refused([points, 1, { periodic: true }], /there is no cell/);
  refused([points, 1, { cell: [1, 2], periodic: true }], /cell has 2 numbers/);
  refused([points, 1, { cell: [1, "2", 3], periodic: true }], /cell\[1\] is "2"/);
  refused([points, 1, { cell: [1, 0, 3], periodic: true }], /axis|vector|cell/);
  refused([points, 1, { cell: [1, 1, 3], periodic: [true, 2, false] }], /periodic must be true or false/);
  refused([points, 1, { cell: [1, 1, 3], periodic: [true, true] }], /periodic has 2 values/);
  refused([points, 1, { cutoffB: [1] }], /there are no others/);
  refused([points, 1, { typesB: [1] }], /there are no others/);
  refused([points, 1, { others: points, full: false }], /two sets/);
  refused([points, [1, 1], { others: points }], /cutoffB, of the others, isn't given/);
  refused([points, 1, { others: points, cutoffB: [1, 1] }], /cutoff is one for all pairs/);
  refused(
    [points, 1, { types: [0, 0], others: points, typesB: [0, 0], offsets: [0, 2] }],
    /others are given/,
  );
  refused([points, [1, 1], { types: [0, 0] }], /cutoff has 2 numbers, and types are given/);
  refused([points, [1, 1, 1, 1], { types: [0, 2] }], /type|2/);
  refused([points, [1, 1, 1, 1], { types: [0, 0.5] }], /types is 0.5/);
  refused([points, [1, 1, 1, 1], { types: [0] }], /types has 1 numbers/);
  refused([points, 1, { offsets: [0, 3] }], /the last offset, number 1, is 3/);
  refused([points, 1, { offsets: [] }], /offsets has no numbers/);
  for (const skin of [-1, Infinity]) {
    const finder = new jostle.NeighborFinder({ dim: 3, type: "float64", skin });
    assert.throws(() => finder.find(points, 1), /skin/);
  }
  assert.throws(() => new jostle.NeighborFinder({ dim: 3, skin: "1" }), /skin is "1"/);
  assert.throws(() => new jostle.NeighborFinder({ dim: 3 }).find(points, 1), /points is a Float64Array/);
});
