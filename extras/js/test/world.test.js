// SPDX-License-Identifier: MIT
import assert from "node:assert/strict";
import test from "node:test";

import { endReasons } from "jostle";
import { modules, random, random_boxes, slow_pairs } from "./help.js";

const pairs_of = (numbers) => {
  const pairs = [];
  for (let i = 0; i < numbers.length; i += 2)
    pairs.push(`${numbers[i] % 2 ** 32} ${numbers[i + 1] % 2 ** 32}`);
  return pairs;
};

for (const [kind, loaded] of Object.entries(modules)) {
  test(`one options for each new box are those of as many adds: ${kind}`, async () => {
    const jostle = await loaded();
    const count = 60, boxes = random_boxes(count, 3, 3), next = random(7);
    const options = Array.from({ length: count }, () => ({
      category: 1 << Math.floor(3 * next()),
      mask: Math.floor(8 * next()),
      owner: Math.floor(20 * next()),
      isStatic: next() < 0.3,
      margin: next(),
      enabled: next() < 0.8,
    }));
    const many = new jostle.World({ dim: 3 }), one = new jostle.World({ dim: 3 });
    assert.deepEqual(
      many.add(boxes, options),
      Float64Array.from(options, (of, i) => one.add(boxes.subarray(6 * i, 6 * i + 6), of)[0]),
    );
    assert.equal(many.add(boxes.subarray(0, 0), []).length, 0);
    many.update();
    one.update();
    assert.ok(one.pairs().length > 20);
    assert.deepEqual(many.save(), one.save());
    many.dispose();
    one.dispose();
  });

  test(`events are what changes from one frame's pairs to the next: ${kind}`, async () => {
    const jostle = await loaded();
    for (const [dim, type, Array] of [[2, "float32", Float32Array], [3, "float64", Float64Array]]) {
      const count = 120, next = random(dim);
      const world = new jostle.World({ dim, type });
      let boxes = random_boxes(count, dim, 4, { Array });
      const ids = world.add(boxes);
      let before = new Set();
      for (let frame = 0; frame < 10; ++frame) {
        if (frame > 0) {
          const moved = [];
          for (let i = 0; i < count; ++i) if (next() < 0.3) moved.push(i);
          for (const i of moved)
            for (let d = 0; d < dim; ++d) {
              const by = next() - 0.5;
              boxes[2 * dim * i + d] += by;
              boxes[2 * dim * i + dim + d] += by;
            }
          boxes = Array.from(boxes, (bound) => (bound === 0 ? 0 : bound));
          const part = new Array(2 * dim * moved.length);
          moved.forEach((i, k) => part.set(boxes.subarray(2 * dim * i, 2 * dim * (i + 1)), 2 * dim * k));
          const of = Float64Array.from(moved, (i) => ids[i]);
          if (frame % 2 === 0) world.update(of, part);
          else {
            world.move(of, part);
            world.update();
          }
        } else world.update();
        const now = new Set(pairs_of(slow_pairs(boxes, dim)));
        const began = pairs_of(world.began()), ended = world.ended();
        assert.deepEqual(new Set(began), new Set([...now].filter((pair) => !before.has(pair))));
        assert.deepEqual(
          new Set(pairs_of(ended.pairs)),
          new Set([...before].filter((pair) => !now.has(pair))),
        );
        assert.ok([...ended.reasons].every((reason) => endReasons[reason] === "moved_apart"));
        assert.deepEqual(new Set(pairs_of(world.pairs())), now);
        assert.ok(pairs_of(world.persisted()).every((pair) => before.has(pair) && now.has(pair)));
        assert.equal(world.changedPairs().length, world.persisted().length + 2 * began.length);
        before = now;
      }
      world.dispose();
    }
  });

  test(`a world of one object each: ${kind}`, async () => {
    const jostle = await loaded();
    const world = new jostle.World({ dim: 2, margin: 0.25 });
    const [a, b, c] = world.add(new Float32Array([0, 0, 1, 1, 1.4, 0, 2, 1, 8, 8, 9, 9]), {
      category: 2,
      mask: 6,
    });
    const of = (...ids) => Float64Array.from(ids);
    world.update();
    assert.deepEqual([...world.began()], [a, b]); // 0.4 apart, and each a quarter wider
    assert.equal(world.size, 3);
    assert.equal(world.indexEnd, 3);
    assert.deepEqual([...world.ids()], [a, b, c]);
    assert.deepEqual([...jostle.indexOf(of(a, b, c))], [0, 1, 2]);
    assert.deepEqual([...world.boxes(of(b))], [...new Float32Array([1.4, 0, 2, 1])]);
    assert.deepEqual([...world.bounds(of(c))], [7.75, 7.75, 9.25, 9.25]);
    assert.deepEqual([...world.boundsOfAll()], [-0.25, -0.25, 9.25, 9.25]);
    assert.deepEqual(world.filters(of(a)), [{ category: 2, mask: 6, owner: 0xffffffff, isStatic: false }]);
    assert.deepEqual([...world.margins(of(a))], [0.25]);
    assert.deepEqual([...world.touching(of(a, c)).of(0)], [b]);
    world.setUserData(of(a, b), BigUint64Array.of(7n, 2n ** 64n - 1n));
    assert.deepEqual([...world.userData(of(b, a))], [2n ** 64n - 1n, 7n]);

    world.setEnabled(of(b), false);
    world.update();
    assert.deepEqual(world.ended(), {
      pairs: of(a, b),
      reasons: Uint8Array.of(endReasons.indexOf("disabled")),
    });
    assert.deepEqual([...world.enabled(of(a, b))], [1, 0]);
    world.setEnabled(of(b), true);
    world.setFilter(of(b), { category: 8 });
    world.update();
    assert.equal(world.began().length, 0);
    world.setFilter(of(b), { category: 4, mask: 2 });
    world.update();
    assert.deepEqual([...world.began()], [a, b]);
    world.reportAgain(of(a));
    world.update();
    assert.deepEqual([...world.began()], [a, b]);
    world.resize(of(b), new Float32Array([0.1, 0.1]));
    world.setMargin(of(a), new Float64Array([0.125]));
    world.update();
    assert.equal(endReasons[world.ended().reasons[0]], "moved_apart");
    world.move(of(c), new Float32Array([8, 0, 9, 1]), { displacements: new Float32Array([-7, 0]) });
    world.update();
    assert.equal(world.began().length, 4); // it passes both
    world.move(of(c), new Float32Array([8, 8, 9, 9]));
    world.remove(of(a));
    world.update();
    assert.equal(world.size, 2);
    assert.deepEqual([...world.contains(of(a, b))], [0, 1]);
    assert.match(world.explain(), /\w/);
    assert.deepEqual([world.stats.objects, world.stats.ended], [2, 2]);
    world.dispose();
  });
}

test("snapshots, differences, forks", async () => {
  const jostle = await modules.simd();
  const world = new jostle.World({ dim: 3 });
  const ids = world.add(random_boxes(200, 3, 8));
  world.update();
  const saved = world.save();
  const other = new jostle.World({ dim: 3 });
  other.restore(saved);
  assert.deepEqual(other.save(), saved);
  assert.deepEqual(other.pairs(), world.pairs());
  const fork = world.fork();
  world.saveBase();
  world.move(ids.subarray(0, 50), random_boxes(50, 3, 9));
  world.update();
  assert.notDeepEqual(world.pairs(), other.pairs());
  const changes = world.saveChanges();
  const after = world.pairs();
  world.clear();
  world.restore(saved);
  world.saveBase();
  world.restoreChanges(changes);
  assert.deepEqual(world.pairs(), after);
  assert.deepEqual(fork.pairs(), other.pairs());
  for (const each of [world, other, fork]) each.dispose();
});

test("accept decides, forks ask it as well, and what it throws comes out of the call", async () => {
  for (const loaded of Object.values(modules)) {
    const jostle = await loaded();
    const asked = [];
    const world = new jostle.World({ dim: 2, accept: (a, b) => (asked.push([a, b]), b % 2 ** 32 !== 2) });
    const boxes = new Float32Array([0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1]);
    const fork = world.fork();
    world.dispose(); // the fork still asks
    const ids = fork.add(boxes);
    const two = (pair) => pair.map((id) => id % 2 ** 32);
    fork.update();
    assert.deepEqual(asked.map(two), [[0, 1], [0, 2], [1, 2]]);
    fork.dispose();
    const failing = new jostle.World({ dim: 2, accept: () => { throw new RangeError("mine"); } });
    failing.add(boxes);
    assert.throws(() => failing.update(), (error) => error instanceof RangeError && error.message === "mine");
    failing.dispose();
    assert.equal(ids.length, 3);
  }
});

test("what some objects are told is theirs alone", async () => {
  for (const loaded of Object.values(modules)) {
    const jostle = await loaded();
    const world = new jostle.World({ dim: 2 });
    const slots = new jostle.PairSlots(), other = new jostle.PairSlots();
    const of = (...ids) => Float64Array.from(ids);
    assert.equal(world.boundsOfAll(), undefined);
    const [a, b, c] = world.add(new Float32Array([0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1]));
    const [d] = world.add(new Float32Array([0, 0, 1, 1]), { enabled: false, isStatic: true });
    world.update();
    assert.deepEqual([...world.began()], [a, b, a, c, b, c]);
    slots.update(world.began(), world.ended());
    assert.deepEqual([...slots.beganSlots()], [0, 1, 2]);
    assert.deepEqual([...slots.slotsOf(Uint32Array.of(2, 1, 0, 3))], [2, 2 ** 32 - 1]);
    other.restore(slots.save());
    assert.deepEqual([...world.enabled(of(a, d))], [1, 0]);
    assert.deepEqual(world.filters(of(a, d)).map((filter) => filter.isStatic), [false, true]);
    world.setEnabled(of(a), Uint8Array.of(0));
    world.update();
    assert.deepEqual([...world.ended().pairs], [a, b, a, c]);
    for (const each of [slots, other]) {
      each.update(world.began(), world.ended());
      assert.deepEqual([...each.endedSlots()], [0, 1]);
      assert.deepEqual([each.beganSlots().length, each.end], [0, 3]);
      assert.throws(() => each.update(world.began(), world.ended()), /never began/);
      each.dispose();
    }
    world.setEnabled(of(a, d), Uint8Array.of(0, 1));
    world.update();
    assert.deepEqual([...world.enabled(of(a, d))], [0, 1]);
    assert.deepEqual([...world.began()], [b, d, c, d]);
    world.reportAgain(of(b), of(c));
    world.update();
    assert.deepEqual([...world.began()], [b, c]); // and not b and d
    world.remove(of(a));
    world.update();
    assert.deepEqual([...world.ids()], [b, c, d]);
    assert.deepEqual([...world.ids(Uint32Array.of(0, 1))], [0, b]);
    world.dispose();
  }
});

test("the command with the greatest sequence wins, whatever it says", async () => {
  const jostle = await modules.simd();
  const world = new jostle.World({ dim: 2 });
  const ids = world.add(new Float32Array(8));
  const one = ids.subarray(0, 1), other = ids.subarray(1);
  const low = new Float32Array([1, 1, 2, 2]), high = new Float32Array([5, 5, 6, 6]);
  world.move(one, low, { sequence: 2 });
  world.move(one, high, { sequence: 1 });
  world.move(other, high, { sequence: 2 });
  world.move(other, low, { sequence: 1 });
  world.update();
  assert.deepEqual([...world.boxes(ids)], [...low, ...high]);
  world.dispose();
});

test("worlds with layers say the same", async () => {
  const jostle = await modules.simd();
  const boxes = random_boxes(300, 2, 6), layers = [{ mask: 2 }, { category: 4, mask: 1 }];
  const counts = [{}, { layers }].map((options) => {
    const world = new jostle.World({ dim: 2, ...options });
    world.add(boxes, { category: 2 });
    world.update();
    const asked = layers.map((asker) => [...world.count({ boxes }, { asker })]);
    world.dispose();
    return asked;
  });
  assert.deepEqual(counts[0], counts[1]);
  assert.ok(counts[0][0].every((count) => count > 0));
  for (const [wrong, message] of [
    [Array(9).fill({ mask: 1 }), /9 layers/],
    [[{}], /layer 0 has all bits/],
    [[{ mask: -1 }], /layers\[0\].mask is -1/],
    ["all", /it must be an array/],
  ])
    assert.throws(() => new jostle.World({ dim: 2, layers: wrong }), message);
});

test("what the statistics of worlds tell", async () => {
  const jostle = await modules.simd();
  const world = new jostle.World({ dim: 2 });
  world.add(random_boxes(400, 2, 6));
  world.update();
  const { stats } = world;
  world.dispose();
  const parts = stats.usApply + stats.usActive + stats.usResting + stats.usEvents + stats.usIndex;
  assert.ok(stats.usTotal > 0 && stats.usTotal < 1e8 && parts <= stats.usTotal * 1.01);
});
