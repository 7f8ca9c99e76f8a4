// SPDX-License-Identifier: MIT
// jostle/rbush beside a list that is gone through, and beside rbush itself where npm has it.
import assert from "node:assert/strict";
import test from "node:test";

import DefaultRBush, { RBush } from "jostle/rbush";
import { spread } from "./help.js";

const peer = await import("rbush").then(
  (all) => all.default,
  () => undefined,
);
const without_peer = peer === undefined && "rbush isn't installed";

/** The definition. */
class Slow {
  items = [];
  load(items) {
    this.items.push(...items);
  }
  insert(item) {
    this.items.push(item);
  }
  remove(item) {
    const at = this.items.indexOf(item);
    if (at >= 0) this.items.splice(at, 1);
  }
  search(box) {
    return this.items.filter(
      (item) =>
        item.minX <= box.maxX && box.minX <= item.maxX && item.minY <= box.maxY && box.minY <= item.maxY,
    );
  }
}
const ids = (items) => items.map((item) => item.id).sort((a, b) => a - b);

let last_id = 0;
const boxes_of = {
  random(next) {
    const minX = 100 * next(),
      minY = 100 * next();
    return { minX, minY, maxX: minX + 3 * next(), maxY: minY + 3 * next() };
  },
  points(next) {
    const minX = Math.floor(8 * next()),
      minY = Math.floor(8 * next()); // many in one place
    return { minX, minY, maxX: minX, maxY: minY };
  },
  hostile(next) {
    const all = [-Infinity, -1e308, -1, -5e-324, -0, 0, 5e-324, 1, 1 + 2 ** -52, 1e308, Infinity];
    const two = () => [0, 0].map(() => all[Math.floor(all.length * next())]).sort((a, b) => a - b);
    const [[minX, maxX], [minY, maxY]] = [two(), two()];
    return { minX, minY, maxX, maxY };
  },
};
const item_of = (kind, next) => ({ ...boxes_of[kind](next), id: ++last_id });

for (const kind of Object.keys(boxes_of))
  for (const Peer of [undefined, peer])
    test(
      `the answers of ${Peer ? "rbush" : "a list"}: ${kind}`,
      { skip: Peer === peer && without_peer },
      () => {
        for (let seed = 1; seed <= 30; ++seed) {
          const next = spread(seed),
            tree = new RBush(),
            slow = Peer ? new Peer() : new Slow();
          const there = [];
          const steps = 1 + Math.floor(60 * next());
          for (let step = 0; step < steps; ++step) {
            const what = next();
            if (what < 0.2) {
              const items = Array.from({ length: Math.floor(100 * next() ** 3) }, () => item_of(kind, next));
              assert.equal(tree.load(items), tree);
              slow.load(items);
              there.push(...items);
            } else if (what < 0.4) {
              const item = next() < 0.1 && there.length ? there[0] : item_of(kind, next);
              assert.equal(tree.insert(item), tree);
              slow.insert(item);
              there.push(item);
            } else if (what < 0.6) {
              const at = Math.floor(there.length * next());
              const item = there.length && next() < 0.9 ? there.splice(at, 1)[0] : item_of(kind, next);
              assert.equal(tree.remove(item), tree);
              slow.remove(item);
            } else if (what < 0.75 && there.length) {
              const item = there[Math.floor(there.length * next())];
              if (there.indexOf(item) !== there.lastIndexOf(item)) continue;
              slow.remove(item);
              Object.assign(item, boxes_of[kind](next));
              assert.equal(tree.update(item), tree);
              slow.insert(item);
            }
            if (next() < 0.5) continue; // so that several changes are applied at once
            const box = boxes_of[kind](next),
              found = tree.search(box);
            assert.deepEqual(ids(found), ids(slow.search(box)));
            assert.equal(tree.collides(box), found.length !== 0);
            assert.deepEqual(ids(tree.all()), ids(there));
          }
          tree.dispose();
        }
      },
    );

test("what rbush's own page says runs with one changed line", () => {
  for (const Tree of [DefaultRBush, RBush, peer].filter(Boolean)) {
    let tree = new Tree(16);
    const item = { minX: 20, minY: 40, maxX: 30, maxY: 50, foo: "bar" };
    tree.insert(item);
    tree.remove(item);
    assert.deepEqual(tree.all(), []);
    tree.insert({ ...item, id: 7 });
    const itemCopy = { ...item, id: 7 };
    tree.remove(itemCopy);
    assert.equal(tree.all().length, 1);
    tree.remove(itemCopy, (a, b) => {
      return a.id === b.id;
    });
    assert.deepEqual(tree.all(), []);
    tree.insert(item);
    tree.clear();
    assert.deepEqual(tree.all(), []);

    class MyRBush extends Tree {
      toBBox([x, y]) {
        return { minX: x, minY: y, maxX: x, maxY: y };
      }
      compareMinX(a, b) {
        return a.x - b.x;
      }
      compareMinY(a, b) {
        return a.y - b.y;
      }
    }
    const points = new MyRBush();
    points.insert([20, 50]);
    assert.deepEqual(points.search({ minX: 0, minY: 0, maxX: 20, maxY: 50 }), [[20, 50]]);
    points.remove([20, 50], (a, b) => a[0] === b[0] && a[1] === b[1]);
    assert.deepEqual(points.all(), []);

    const [item1, item2] = [item, { minX: 41, minY: 21, maxX: 41, maxY: 21 }];
    tree.load([item1, item2]);
    assert.deepEqual(tree.search({ minX: 40, minY: 20, maxX: 80, maxY: 70 }), [item2]);
    assert.equal(tree.all().length, 2);
    assert.equal(tree.collides({ minX: 40, minY: 20, maxX: 80, maxY: 70 }), true);
    assert.equal(tree.collides({ minX: 42, minY: 20, maxX: 80, maxY: 70 }), false);

    const treeData = JSON.parse(JSON.stringify(tree.toJSON()));
    tree = new Tree(9).fromJSON(treeData);
    assert.deepEqual(tree.search({ minX: 40, minY: 20, maxX: 80, maxY: 70 }), [item2]);
  }
});

test("trees go to rbush as JSON, and come from it", { skip: without_peer }, () => {
  const next = spread(5),
    items = Array.from({ length: 500 }, () => item_of("random", next));
  const everywhere = { minX: -1, minY: -1, maxX: 200, maxY: 200 },
    some = { minX: 20, minY: 30, maxX: 50, maxY: 50 };
  const theirs = new peer().load(items),
    ours = new RBush().load(items);
  const pass_on = (from, To) => new To().fromJSON(JSON.parse(JSON.stringify(from)));
  for (const [from, To] of [
    [theirs, RBush],
    [ours, peer],
    [ours, RBush],
  ]) {
    const tree = pass_on(from, To);
    for (const box of [everywhere, some]) assert.deepEqual(ids(tree.search(box)), ids(theirs.search(box)));
    tree.insert({ ...some, id: 0 });
    assert.deepEqual(ids(tree.search(some))[0], 0);
  }
  assert.deepEqual(pass_on(new peer(), RBush).all(), []);
  assert.deepEqual(pass_on(new RBush(), peer).all(), []);
});

test("an item may be there several times", () => {
  const item = { minX: 0, minY: 0, maxX: 1, maxY: 1 },
    tree = new RBush().load([item, item]);
  tree.insert(item);
  for (let left = 3; left > 0; --left) {
    assert.equal(tree.search(item).length, left);
    tree.remove(item);
  }
  assert.equal(tree.collides(item), false);
  tree.remove(item);
  assert.equal(tree.insert(item).search(item).length, 1);
});

test("an item is found to be removed although it has moved", () => {
  const item = { minX: 0, minY: 0, maxX: 1, maxY: 1 },
    tree = new RBush().insert(item);
  Object.assign(item, { minX: 5, maxX: 6 });
  assert.deepEqual(tree.all(), [item]);
  assert.deepEqual(tree.remove(item).all(), []);
  assert.equal(tree.collides({ minX: 0, minY: 0, maxX: 9, maxY: 9 }), false);
});

test("bad boxes are refused by name, and nothing is taken", () => {
  const good = { minX: 0, minY: 0, maxX: 1, maxY: 1 };
  const tree = new RBush().load([good]);
  const bad = [
    [
      { ...good, minY: NaN },
      { status: "nan_coordinate", message: /item 1 has minY = NaN/ },
    ],
    [
      { minX: 0, minY: 0, maxX: 1 },
      { status: "invalid_argument", message: /item 1 has maxY = undefined/ },
    ],
    [{ ...good, maxX: "3" }, { message: /item 1 has maxX = "3": it must be a number/ }],
    [
      { ...good, maxY: -1 },
      { status: "inverted_box", message: /item 1 has minY = 0, greater than maxY = -1/ },
    ],
    [undefined, { message: /item 1 has undefined for its box/ }],
    [7, { message: /item 1 has 7 for its box/ }],
  ];
  for (const [item, error] of bad) {
    assert.throws(() => tree.load([good, item]), { name: "JostleError", index: 1, ...error });
    assert.throws(() => tree.fromJSON({ children: [good, item], leaf: true }), {
      name: "JostleError",
      ...error,
    });
    assert.deepEqual(tree.all(), [good]);
    assert.equal(tree.search(good).length, 1);
  }
  assert.throws(() => tree.fromJSON({ children: [{}] }), /is no node of a tree/);
  assert.throws(() => tree.update({ ...good }), /isn't in the tree/);
  Object.assign(good, { minX: 2 });
  assert.throws(() => tree.update(good), { status: "inverted_box" });
  assert.equal(tree.collides({ minX: 0, minY: 0, maxX: 0, maxY: 0 }), true); // where it was
  for (const call of ["search", "collides"]) {
    assert.throws(() => tree[call]({ minX: NaN, minY: 0, maxX: 1, maxY: 1 }), { status: "nan_coordinate" });
    assert.throws(() => tree[call]({ minX: 0, minY: 0, maxX: 1 }), { status: "nan_coordinate" });
    assert.throws(() => tree[call]({ minX: 3, minY: 0, maxX: 1, maxY: 1 }), { status: "inverted_box" });
    assert.throws(() => tree[call](), { name: "JostleError", message: /the box is undefined/ });
  }
  for (const nothing of [undefined, null, []])
    assert.equal(tree.load(nothing).insert(null).remove(null), tree);
  tree.dispose();
  assert.throws(() => tree.search(good), { status: "bad_handle" });
});

test("a thrown error of the caller's comes out, and a callback may ask", () => {
  const good = { minX: 0, minY: 0, maxX: 1, maxY: 1 },
    tree = new RBush().load([good, { ...good }]);
  assert.throws(
    () =>
      tree.remove({ ...good }, () => {
        throw new RangeError("mine");
      }),
    RangeError,
  );
  let asked = 0;
  tree.remove({ ...good }, (_, other) => (asked += tree.search(other).length) > 2);
  assert.equal(asked, 4);
  assert.equal(tree.all().length, 1);
});
