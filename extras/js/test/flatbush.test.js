// SPDX-License-Identifier: MIT
// jostle/flatbush beside a list that is gone through, and beside flatbush itself where npm has it.
import assert from "node:assert/strict";
import test from "node:test";

import DefaultFlatbush, { Flatbush } from "jostle/flatbush";
import { spread } from "./help.js";

const peer = await import("flatbush").then(
  (all) => all.default,
  () => undefined,
);
const skip = peer === undefined && "flatbush isn't installed";

const rectangles_of = {
  random(next) {
    const x = 100 * next(),
      y = 100 * next();
    return [x, y, x + 3 * next(), y + 3 * next()];
  },
  points(next) {
    const x = Math.floor(8 * next()),
      y = Math.floor(8 * next()); // many in one place
    return [x, y, x, y];
  },
  hostile(next) {
    const all = [-Infinity, -1e308, -1, -5e-324, -0, 0, 5e-324, 1, 1 + 2 ** -52, 1e308, Infinity];
    const two = () => [0, 0].map(() => all[Math.floor(all.length * next())]).sort((a, b) => a - b);
    const [x, y] = [two(), two()];
    return [x[0], y[0], x[1], y[1]];
  },
};
const touch = (a, b) => a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3];
const ascending = (found) => [...found].sort((a, b) => a - b);
function squared_distance([x, y], box) {
  const dx = Math.max(box[0] - x, x - box[2], 0),
    dy = Math.max(box[1] - y, y - box[3], 0);
  return dx * dx + dy * dy;
}
function made(Index, all, ...more) {
  const index = new Index(all.length, ...more);
  all.forEach((box, i) => assert.equal(index.add(...box), i));
  index.finish();
  return index;
}

for (const kind of Object.keys(rectangles_of))
  test(`finds what a list says: ${kind}`, () => {
    for (let seed = 1; seed <= 40; ++seed) {
      const next = spread(seed);
      const all = Array.from({ length: 1 + Math.floor(400 * next() ** 3) }, () => rectangles_of[kind](next));
      const index = made(Flatbush, all);
      for (let k = 0; k < 10; ++k) {
        const box = rectangles_of[kind](next);
        const wanted = all.flatMap((each, i) => (touch(each, box) ? [i] : []));
        assert.deepEqual(index.search(...box), wanted);
        assert.equal(index.collides(...box), wanted.length !== 0);
        const odd = (i, ...bounds) => (assert.deepEqual(bounds, all[i]), i % 2 === 1);
        assert.deepEqual(index.search(...box, odd), wanted.filter((i) => i % 2 === 1));
        assert.equal(
          index.collides(...box, odd),
          wanted.some((i) => i % 2 === 1),
        );

        const point = box.slice(0, 2).map((x) => (Number.isFinite(x) ? x : 2));
        const order = all
          .map((each, i) => ({ i, at: squared_distance(point, each) }))
          .sort((a, b) => (a.at === b.at ? a.i - b.i : a.at - b.at));
        const within = (most, least = 0) =>
          order.filter(({ i, at }) => at <= most * most && i >= least).map(({ i }) => i);
        assert.deepEqual(index.neighbors(...point), within(Infinity));
        assert.deepEqual(index.neighbors(...point, 5), within(Infinity).slice(0, 5));
        assert.deepEqual(index.neighbors(...point, Infinity, 7), within(7));
        const asked = new Set();
        const high = (i) => (assert.ok(!asked.has(i)), asked.add(i), i >= all.length / 2);
        assert.deepEqual(index.neighbors(...point, 3, 20, high), within(20, all.length / 2).slice(0, 3));
      }
      index.dispose();
    }
  });

test("finds what flatbush finds, for all types of numbers", { skip }, () => {
  const types = [
    Int8Array,
    Uint8Array,
    Uint8ClampedArray,
    Int16Array,
    Uint16Array,
    Int32Array,
    Uint32Array,
    Float32Array,
    Float64Array,
  ];
  for (const ArrayType of types)
    for (const count of [1, 15, 16, 17, 300, 5000]) {
      const next = spread(count),
        all = Array.from({ length: count }, () => rectangles_of.random(next));
      const ours = made(Flatbush, all, 16, ArrayType),
        theirs = made(peer, all, 16, ArrayType);
      for (const name of ["minX", "minY", "maxX", "maxY"])
        // flatbush takes these before it rounds
        assert.ok(Math.abs(ours[name] - theirs[name]) < 1);
      assert.deepEqual(
        [ours.numItems, ours.nodeSize, ours.IndexArrayType],
        [count, 16, theirs.IndexArrayType],
      );
      for (let k = 0; k < 20; ++k) {
        const box = rectangles_of.random(next),
          [x, y] = box;
        assert.deepEqual(ascending(ours.search(...box)), ascending(theirs.search(...box)));
        assert.equal(ours.collides(...box), theirs.collides(...box));
        const far = (index) =>
          index.neighbors(x, y, 20, 30).map((i) =>
            squared_distance(
              [x, y],
              all[i].map((b) => new ArrayType([b])[0]),
            ),
          );
        assert.deepEqual(far(ours), far(theirs));
      }
    }
});

test("what flatbush's own page says runs with one changed line", () => {
  for (const Index of [DefaultFlatbush, Flatbush, peer].filter(Boolean)) {
    const next = spread(3),
      items = Array.from({ length: 1000 }, () => {
        const [minX, minY, maxX, maxY] = rectangles_of.random(next);
        return { minX, minY, maxX, maxY, foo: next() < 0.5 ? "bar" : "" };
      });
    const index = new Index(1000);
    for (const p of items) {
      index.add(p.minX, p.minY, p.maxX, p.maxY);
    }
    index.finish();
    const found = index.search(10, 10, 20, 20).map((i) => items[i]);
    assert.ok(found.length > 5 && found.every((p) => p.minX <= 20 && p.maxY >= 10));
    assert.equal(index.neighbors(10, 10, 5).length, 5);
    const bars = index.search(10, 10, 20, 20, (i) => items[i].foo === "bar");
    assert.equal(bars.length, found.filter((p) => p.foo === "bar").length);
    let told = 0;
    index.search(10, 10, 20, 20, (i, x0, y0, x1, y1) => {
      told += items[i].minX === x0 && items[i].maxY === y1 && y0 <= y1 && x0 <= x1;
    });
    assert.equal(told, found.length);
    assert.equal(
      index.collides(10, 10, 20, 20, () => false),
      false,
    );
    const again = Index.from(structuredClone(index.data, { transfer: [index.data] }));
    assert.equal(again.search(10, 10, 20, 20).length, found.length);
  }
});

test("data goes to flatbush and comes from it", { skip }, () => {
  for (const [ArrayType, Buffer] of [
    [Float64Array, ArrayBuffer],
    [Float32Array, SharedArrayBuffer],
    [Int16Array, ArrayBuffer],
  ])
    for (const [count, nodeSize] of [
      [1, 16],
      [16, 16],
      [17, 2],
      [300, 5],
      [20_000, 16],
    ]) {
      const next = spread(count),
        all = Array.from({ length: count }, () => rectangles_of.random(next));
      const theirs = made(peer, all, nodeSize, ArrayType, Buffer),
        ours = made(Flatbush, all, nodeSize, ArrayType, Buffer);
      assert.ok(ours.data instanceof Buffer);
      assert.equal(ours.data.byteLength, theirs.data.byteLength);
      const shifted = new Buffer(ours.data.byteLength + 16);
      new Uint8Array(shifted).set(new Uint8Array(theirs.data), 16);
      const copies = [
        Flatbush.from(theirs.data),
        peer.from(ours.data),
        Flatbush.from(ours.data),
        Flatbush.from(shifted, 16),
      ];
      for (let k = 0; k < 20; ++k) {
        const box = rectangles_of.random(next);
        for (const copy of copies)
          assert.deepEqual(ascending(copy.search(...box)), ascending(theirs.search(...box)));
      }
    }
});

test("bad input is refused by name", () => {
  const index = new Flatbush(2);
  assert.throws(() => index.search(0, 0, 1, 1), /this index isn't finished/);
  assert.throws(() => index.data, /this index isn't finished/);
  assert.throws(() => index.add(NaN, 0), {
    status: "nan_coordinate",
    index: 0,
    message: /item 0 has minX = NaN/,
  });
  assert.equal(index.add(3, 4), 0);
  assert.throws(() => index.add(5, 0, 4, 1), {
    status: "inverted_box",
    index: 1,
    message: /item 1 has minX = 5, greater/,
  });
  assert.throws(() => index.finish(), /finish: 1 items were added, and 2 announced/);
  assert.equal(index.add(Infinity, Infinity), 1);
  assert.throws(() => index.add(0, 0), /there are 2 items already/);
  index.finish();
  assert.deepEqual(index.search(3, 4, 3, 4), [0]);
  assert.throws(() => index.search(0, NaN, 1, 1), { status: "nan_coordinate" });
  assert.throws(() => index.collides(0, 2, 1, 1), { status: "inverted_box" });
  for (const wrong of [
    [NaN, 0],
    [Infinity, 0],
    [0, 0, 1.5],
    [0, 0, -1],
    [0, 0, 1, NaN],
    [0, 0, 1, -1],
  ])
    assert.throws(() => index.neighbors(...wrong), { name: "JostleError" });
  assert.deepEqual(index.neighbors(0, 0, 0), []);
  assert.deepEqual(index.neighbors(0, 0, 5, 1e200), [0, 1]);
  for (const wrong of [0, -1, 1.5, NaN, undefined]) assert.throws(() => new Flatbush(wrong), /numItems/);
  assert.throws(() => new Flatbush(1, 16, Array), /it must be a typed array/);

  const { data } = index,
    cut = data.slice(0, data.byteLength - 1),
    other = data.slice(),
    twice = data.slice();
  new Uint8Array(other)[1] = 0x28; // version 2
  new Uint16Array(twice, twice.byteLength - 6, 3).fill(0); // item 0 two times
  for (const [wrong, message] of [
    [undefined, /it must be an ArrayBuffer/],
    [new Uint8Array(8), /it must be an ArrayBuffer/],
    [new ArrayBuffer(4), /they are no flatbush/],
    [cut, /2 items take/],
    [other, /version 3/],
    [twice, /no item 1/],
  ])
    assert.throws(() => Flatbush.from(wrong), { name: "JostleError", message });
  assert.throws(() => Flatbush.from(data, 4), /a multiple of 8/);
  index.dispose();
  assert.throws(() => index.search(0, 0, 1, 1), { status: "bad_handle" });
});

test("a filter may ask the same index", () => {
  const next = spread(8),
    all = Array.from({ length: 50 }, () => rectangles_of.random(next));
  const index = made(Flatbush, all);
  const busy = (i, ...box) => index.search(...(box.length ? box : all[i])).includes(i);
  assert.equal(index.search(0, 0, 200, 200, busy).length, 50);
  assert.equal(index.neighbors(0, 0, 9, Infinity, busy).length, 9);
});
