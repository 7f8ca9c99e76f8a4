// SPDX-License-Identifier: MIT
import assert from "node:assert/strict";
import test from "node:test";

import { load, poses, rays } from "jostle";
import { modules, overlaps, random, random_boxes } from "./help.js";

/** Where a ray enters a box: the definition, in doubles. */
function enters(ray, box, dim) {
  let from = 0, to = ray[2 * dim];
  for (let d = 0; d < dim; ++d) {
    const [o, way] = [ray[d], ray[dim + d]];
    if (way === 0) {
      if (o < box[d] || o > box[dim + d]) return undefined;
      continue;
    }
    const [near, far] = [(box[d] - o) / way, (box[dim + d] - o) / way].sort((x, y) => x - y);
    from = Math.max(from, near);
    to = Math.min(to, far);
  }
  return from <= to ? from : undefined;
}
function squared_distance(point, box, dim) {
  let sum = 0;
  for (let d = 0; d < dim; ++d) sum += Math.max(box[d] - point[d], 0, point[d] - box[dim + d]) ** 2;
  return sum;
}

function squared_gap(a, b, dim) {
  let sum = 0;
  for (let d = 0; d < dim; ++d) sum += Math.max(b[d] - a[dim + d], 0, a[d] - b[dim + d]) ** 2;
  return sum;
}

for (const [kind, loaded] of Object.entries(modules)) {
  test(`an index and a world answer as the definition does: ${kind}`, async () => {
    const jostle = await loaded();
    for (const [dim, type, Floats] of [
      [2, "float64", Float64Array],
      [3, "float64", Float64Array],
      [2, "float32", Float32Array],
      [3, "float32", Float32Array],
    ]) {
      const count = 300, asked = 40;
      const same = (a, b) => Math.abs(a - b) < (type === "float64" ? 1e-9 : 1e-4);
      const boxes = random_boxes(count, dim, 21, { Array: Floats });
      const box = (i) => boxes.subarray(2 * dim * i, 2 * dim * (i + 1));
      const index = new jostle.BoxIndex({ dim, type });
      index.build(boxes);
      const world = new jostle.World({ dim, type });
      const ids = world.add(boxes);
      world.update();

      const regions = random_boxes(asked, dim, 22, { Array: Floats, world: 12 });
      const expected = (i) => [...Array(count).keys()].filter((j) => overlaps(regions, i, boxes, j, dim));
      const all = index.all({ boxes: regions }), of_world = world.all({ boxes: regions });
      const counts = index.count({ boxes: regions }), any = world.any({ boxes: regions });
      assert.equal(all.length, asked);
      assert.equal(all.at, undefined);
      for (let i = 0; i < asked; ++i) {
        assert.deepEqual([...all.of(i)], expected(i));
        assert.deepEqual([...jostle.indexOf(of_world.of(i))], expected(i));
        assert.equal(counts[i], expected(i).length);
        assert.equal(any[i], expected(i).length > 0 ? 1 : 0);
      }
      for (const asked of [index, world]) {
        const region = { boxes: regions.subarray(0, 2 * dim) },
          near = { nearest: regions.subarray(0, dim), count: 20 };
        const visited = [];
        assert.equal(
          asked.visit(region, (id) => void visited.push(id % 2 ** 32)),
          true,
        );
        assert.deepEqual(visited.sort((a, b) => a - b), expected(0));
        const in_order = asked.all(near), seen = [], at = [];
        assert.equal(asked.visit(near, (id, distance) => seen.push(id) < 0 || at.push(distance) < 5), false);
        assert.deepEqual(seen, [...in_order.of(0)].slice(0, 5));
        assert.deepEqual(at, [...in_order.at.subarray(0, 5)]);
        const within = in_order.at[3], closer = [];
        assert.equal(asked.visit(near, (id, distance) => (closer.push(distance), within)), true);
        assert.deepEqual(closer, [...in_order.at.filter((distance) => distance <= within)]);
        const even = [];
        asked.visit(region, (id) => void even.push(id), { accept: (_, id) => Number(id) % 2 === 0 });
        assert.equal(even.length, expected(0).filter((i) => i % 2 === 0).length);
        assert.throws(() => asked.visit(region, () => { throw new Error("enough"); }), { message: "enough" });
        assert.throws(
          () => asked.visit({ boxes: regions }, () => true),
          /there are 40 queries: visit\(\) takes one/,
        );
        assert.throws(() => asked.visit(region, 5), /visit is 5: it must be a function/);
      }
      const few = index.all({ boxes: regions }, { maxResults: 2 });
      for (let i = 0; i < asked; ++i) {
        assert.deepEqual([...few.of(i)], expected(i).slice(0, 2));
        assert.equal(few.more[i], expected(i).length > 2 ? 1 : 0);
      }
      const joined = index.join(regions), flat = [];
      for (let i = 0; i < asked; ++i) for (const j of expected(i)) flat.push(i, j);
      assert.deepEqual([...joined], flat);
      assert.deepEqual([...world.join(regions)], flat);

      const next = random(23);
      const from = Floats.from({ length: dim * asked }, () => next() * 30 - 10);
      const along = Floats.from({ length: dim * asked }, () => next() - 0.5);
      const lines = rays(from, along, { dim, maxFraction: 60 });
      const hits = index.first(lines), hits_of_world = world.first(lines);
      const every = index.all(lines);
      for (let i = 0; i < asked; ++i) {
        const ray = lines.rays.subarray((2 * dim + 1) * i);
        const met = [...Array(count).keys()]
          .map((j) => [enters(ray, box(j), dim), j])
          .filter(([at]) => at !== undefined);
        met.sort((x, y) => x[0] - y[0] || x[1] - y[1]);
        assert.equal(every.of(i).length, met.length);
        if (met.length === 0) {
          assert.equal(hits.ids[i], -1);
          assert.equal(hits_of_world.ids[i], 0);
          continue;
        }
        assert.ok(same(hits.at[i], met[0][0]));
        assert.ok(met.some(([at, j]) => j === hits.ids[i] && same(at, met[0][0])));
        assert.equal(hits_of_world.ids[i], ids[hits.ids[i]]);
      }

      const near = index.all({ nearest: from, count: 5, maxDistance: 6 });
      const near_boxes = world.all({ nearestToBoxes: regions, count: 3 });
      for (let i = 0; i < asked; ++i) {
        const point = from.subarray(dim * i);
        const far = [...Array(count).keys()]
          .map((j) => squared_distance(point, box(j), dim))
          .filter((at) => at <= 36)
          .sort((x, y) => x - y);
        const found = near.at.subarray(near.first[i], near.first[i + 1]);
        assert.equal(found.length, Math.min(5, far.length));
        found.forEach((at, k) => assert.ok(same(at, far[k])));
        const region = regions.subarray(2 * dim * i);
        const gaps = [...Array(count).keys()].map((j) => squared_gap(region, box(j), dim));
        gaps.sort((x, y) => x - y);
        for (let k = 0; k < 3; ++k) assert.ok(same(near_boxes.at[near_boxes.first[i] + k], gaps[k]));
      }

      const balls = new Floats(asked * (dim + 1)), planes = [];
      for (let i = 0; i < asked; ++i) {
        balls.set(from.subarray(dim * i, dim * i + dim), (dim + 1) * i);
        balls[(dim + 1) * i + dim] = 4;
        const normal = [...Array(dim)].map((_, d) => (d === 0 ? 1 : 0));
        planes.push(Floats.of(...normal, -from[dim * i])); // x >= the point's
      }
      const in_balls = index.count({ spheres: balls }), ahead = index.count({ frustums: planes });

      // A box that is swept touches what lies in its first place, in its last one or between them.
      const sweeps = new Floats(asked * (3 * dim + 1)), axis = dim - 1;
      for (let i = 0; i < asked; ++i) {
        sweeps.set(regions.subarray(2 * dim * i, 2 * dim * (i + 1)), (3 * dim + 1) * i);
        sweeps[(3 * dim + 1) * i + 2 * dim + axis] = 2;
        sweeps[(3 * dim + 1) * i + 3 * dim] = 2.5; // 5 far along the last axis
      }
      const met_first = index.first({ sweeps }), met_all = world.all({ sweeps });
      const swept = regions.map((bound, k) => (k % (2 * dim) === 2 * dim - 1 ? bound + 5 : bound));

      for (let i = 0; i < asked; ++i) {
        const point = from.subarray(dim * i);
        assert.equal(
          in_balls[i],
          [...Array(count).keys()].filter((j) => squared_distance(point, box(j), dim) <= 16).length,
        );
        const met = [...Array(count).keys()].filter((j) => overlaps(swept, i, boxes, j, dim));
        assert.deepEqual(new Set(jostle.indexOf(met_all.of(i))), new Set(met));
        const way = (j) => Math.max(0, box(j)[axis] - regions[2 * dim * (i + 1) - 1]) / 2;
        assert.ok(same(met_first.at[i], Math.min(...met.map(way))) || met.length === 0);
        assert.equal(met_first.ids[i] < 0, met.length === 0);
        assert.equal(ahead[i], [...Array(count).keys()].filter((j) => box(j)[dim] >= point[0]).length);
      }
      for (const each of [index, world]) each.dispose();
    }
  });

  test(`what a query is about: ${kind}`, async () => {
    const jostle = await loaded();
    const boxes = new Float32Array([0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 5, 5, 6, 6]);
    const index = new jostle.BoxIndex({ dim: 2 });
    index.build(boxes, Uint32Array.of(10, 20, 30, 40));
    const regions = new Float32Array([0, 0, 9, 9, 0, 0, 1, 1]);
    const lists = (options) => {
      const answers = index.all({ boxes: regions }, options);
      return [...Array(answers.length).keys()].map((i) => [...answers.of(i)]);
    };
    assert.deepEqual(lists({}), [[10, 20, 30, 40], [10, 20, 30]]);
    assert.deepEqual(lists({ exclude: 20 }), [[10, 30, 40], [10, 30]]);
    const calls = [];
    assert.deepEqual(lists({ accept: (query, id) => (calls.push(`${query} ${id}`), id !== 10) }), [
      [20, 30, 40],
      [20, 30],
    ]);
    assert.deepEqual(calls.sort(), ["0 10", "0 20", "0 30", "0 40", "1 10", "1 20", "1 30"]);
    const category = new Uint32Array(41).fill(1), mask = new Uint32Array(41).fill(1);
    category[30] = 2;
    assert.deepEqual(lists({ asker: { category: 1, mask: 1 }, category, mask }), [[10, 20, 40], [10, 20]]);
    const owner = new Uint32Array(41).fill(7);
    owner[20] = 5;
    assert.deepEqual(lists({ asker: { owner: 5 }, owner }), [[10, 30, 40], [10, 30]]);
    assert.throws(
      () =>
        lists({
          accept: () => {
            throw new TypeError("mine");
          },
        }),
      { name: "TypeError", message: "mine" },
    );
    // Where there are no answers to a query there are no distances, but they aren't missing.
    const points = new Float32Array([0, 0, 90, 90]), along = new Float32Array(4).fill(1);
    const lines = rays(points, along, { dim: 2, maxFraction: 1 });
    for (const accept of [undefined, () => true]) {
      const found = [{ nearest: points, maxDistance: 1 }, lines].map((asked) => index.all(asked, { accept }));
      for (const answers of found) assert.deepEqual([...answers.at], [0, 0, 0].slice(0, answers.first[1]));
      for (const none of [{ nearest: points, count: 0 }, { rays: new Float32Array(0) }]) {
        assert.deepEqual(index.all(none, { accept }).at, new Float64Array(0));
        assert.equal(index.all({ boxes: new Float32Array(0) }, { accept }).at, undefined);
      }
    }
    assert.deepEqual([...index.contains(Uint32Array.of(10, 11))], [1, 0]);
    index.move(new Float32Array([7, 7, 8, 8]), Uint32Array.of(10));
    assert.deepEqual([...index.boxes(Uint32Array.of(10))], [7, 7, 8, 8]);
    index.erase(Uint32Array.of(40));
    index.insert(new Float32Array([0, 0, 0, 0]), Uint32Array.of(1));
    assert.deepEqual(lists({}), [[1, 10, 20, 30], [1, 20, 30]]);
    assert.equal(index.size, 4);
    assert.equal(index.stats.objects, 4);
    index.clear();
    assert.equal(index.size, 0);
    index.dispose();

    const world = new jostle.World({ dim: 2 });
    const ids = world.add(boxes);
    world.update();
    const found = world.all({ boxes: regions }, { exclude: ids[0], accept: (query, id) => id !== ids[1] });
    assert.deepEqual([...found.of(0)], [ids[2], ids[3]]);
    assert.deepEqual([...world.join(regions, { exclude: ids[1] })], [0, 0, 0, 2, 0, 3, 1, 0, 1, 2]);
    // Objects have filters of their own.
    world.setFilter(ids.subarray(0, 1), { category: 2 });
    world.setFilter(ids.subarray(1, 2), { mask: 4 });
    world.setFilter(ids.subarray(2, 3), { owner: 9 });
    world.update();
    const asks = (asker) => [...jostle.indexOf(world.all({ boxes: regions }, { asker }).of(0))];
    assert.deepEqual(asks({}), [0, 2, 3]); // its category is 1
    assert.deepEqual(asks({ category: 4 }), [0, 1, 2, 3]);
    assert.deepEqual(asks({ category: 4, mask: 1 }), [1, 2, 3]);
    assert.deepEqual(asks({ category: 4, owner: 9 }), [0, 1, 3]);
    if (jostle.threads === 1)
      assert.deepEqual(
        [...world.join(regions, { accept: (query, id) => query === 1 && id !== ids[0] })],
        [1, 1, 1, 2],
      );
    world.dispose();
  });
}

for (const [kind, loaded] of Object.entries(modules))
  test(`shapes are asked about as pairs of them are: ${kind}`, async () => {
    const jostle = await loaded();
    const next = random(77), count = 40, asked = 6;
    for (const dim of [2, 3]) {
      const place = (n) => poses(Float32Array.from({ length: dim * n }, () => 4 * next()), { dim });
      const make = (n, size) => new jostle.Shapes({
        shapes: Array.from({ length: n }, () => jostle.sphere(size * (0.5 + next()), dim)),
      });
      const objects = { shapes: make(count, 0.4), poses: place(count) };
      const askers = { shapes: make(asked, 0.2), poses: place(asked) };
      const ways = Float32Array.from({ length: dim * asked }, () => 6 * next() - 3);
      const from = Float32Array.from({ length: dim * asked }, () => 4 * next());
      const lines = rays(from, ways, { dim, maxFraction: 1 });
      const boxes = jostle.bounds(objects);
      const index = new jostle.BoxIndex({ dim }), world = new jostle.World({ dim });
      index.build(boxes);
      const ids = world.add(boxes);
      world.update();
      const finder = new jostle.ContactFinder({ dim });
      const pairs = Uint32Array.from({ length: 2 * asked * count }, (_, i) =>
        i % 2 === 0 ? Math.floor(i / 2 / count) : (i - 1) / 2 % count,
      );
      // The definition: each asker against each object, in the order of (where, id).
      const in_order = (where) => Array.from({ length: asked }, (_, i) =>
        Array.from({ length: count }, (_, id) => ({ id, at: where[i * count + id] }))
          .filter(({ at }) => at !== Infinity)
          .sort((a, b) => a.at - b.at || a.id - b.id),
      );
      const casts = finder.rayCasts(lines.rays, objects, pairs);
      const moves = finder.shapeCasts(askers, ways, objects, pairs);
      const near = finder.distances(askers, pairs, { b: objects });
      const touching = finder.touching(askers, pairs, { b: objects });
      for (const [queries, of, where] of [
        [lines, casts, casts.fractions],
        [{ shapeSweeps: { ...askers, displacements: ways } }, moves, moves.fractions],
        [{ nearestToShapes: askers, count: 3 }, near, near.distances],
      ]) {
        const most = queries.count ?? Infinity;
        const expected = in_order(where).map((each) => each.slice(0, most));
        const all = index.all(queries, { objects });
        const first = world.first(queries, { objects });
        for (let i = 0; i < asked; ++i) {
          assert.deepEqual([...all.of(i)], expected[i].map(({ id }) => id));
          const begin = all.first[i], end = all.first[i + 1];
          assert.deepEqual([...all.at.subarray(begin, end)], expected[i].map(({ at }) => at));
          for (let k = begin; k < end; ++k) {
            const pair = i * count + all.ids[k];
            for (let d = 0; d < dim; ++d)
              assert.equal(all.details.normals[dim * k + d], of.normals[dim * pair + d]);
          }
          assert.equal(first.ids[i], expected[i].length === 0 ? 0 : ids[expected[i][0].id]);
          if (expected[i].length !== 0)
            assert.equal(first.normals[dim * i], of.normals[dim * (i * count + expected[i][0].id)]);
        }
        if (queries.nearestToShapes === undefined)
          assert.deepEqual([...world.count(queries, { objects })], expected.map((each) => each.length));
        // One after another, where a callback is asked on this thread.
        const odd = index.first(queries, { objects, accept: (query, id) => id % 2 === 1 && query < asked });
        in_order(where).forEach((each, i) =>
          assert.equal(odd.ids[i], each.find(({ id }) => id % 2 === 1)?.id ?? -1),
        );
      }
      const touched = index.all({ posedShapes: askers }, { objects });
      const any = world.any({ posedShapes: askers }, { objects });
      assert.equal(touched.at, undefined);
      assert.equal(touched.details, undefined);
      for (let i = 0; i < asked; ++i) {
        const expected = [...Array(count).keys()].filter((id) => touching[i * count + id] === 1);
        assert.deepEqual([...touched.of(i)], expected);
        assert.equal(any[i], expected.length === 0 ? 0 : 1);
      }
      const one = { shapes: make(1, 0.2), poses: place(1) }, seen = [];
      const note = (id, at) => void seen.push([id, at]);
      assert.ok(index.visit({ nearestToShapes: one, count: 4 }, note, { objects }));
      const four = index.all({ nearestToShapes: one, count: 4 }, { objects });
      assert.deepEqual(seen, [...four.ids].map((id, k) => [id, four.at[k]]));

      assert.throws(
        () => index.all({ posedShapes: askers }),
        /posedShapes is no query of all\(\): ask one of rays/,
      );
      assert.throws(
        () => index.any({ boxes }, { objects }),
        /boxes is no query of any\(\) with objects: ask one of rays, shapeSweeps, posedShapes/,
      );
      assert.throws(
        () => index.first({ shapeSweeps: { ...askers, displacements: ways.subarray(dim) } }, { objects }),
        /6 shapes, 6 poses and 5 values/,
      );
      assert.throws(() => index.first(lines, { objects: [] }), /objects are/);
      for (const each of [index, world, finder, objects.shapes, askers.shapes, one.shapes]) each.dispose();
    }
  });

test("the very first query of a module has no answers", async () => {
  for (const options of [{}, { threads: 2 }])
    for (const asked of [{ nearest: new Float32Array(2) }, { rays: Float32Array.of(0, 0, 1, 1, 1) }]) {
      const jostle = await load(options);
      const { at } = new jostle.BoxIndex({ dim: 2 }).all(asked, { accept: () => false });
      assert.deepEqual(at, new Float64Array(0)); // and not undefined
      jostle.dispose();
    }
});

test("rays are packed one after the other, each with its own end", () => {
  const from = Float32Array.of(0, 0, 1, 1), along = Float32Array.of(1, 0, 0, 1);
  const packed = (options) => [...rays(from, along, { dim: 2, ...options }).rays];
  assert.deepEqual(packed({ maxFraction: [3, 4] }), [0, 0, 1, 0, 3, 1, 1, 0, 1, 4]);
  assert.deepEqual(packed({ maxFraction: 2 }), [0, 0, 1, 0, 2, 1, 1, 0, 1, 2]);
  assert.deepEqual(packed({}), [0, 0, 1, 0, Infinity, 1, 1, 0, 1, Infinity]);
});
