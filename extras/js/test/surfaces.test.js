// SPDX-License-Identifier: MIT
// Surfaces beside the definition: every vertex and triangle, every two edges, by distances of their own.
import assert from "node:assert/strict";
import test from "node:test";

import { load } from "jostle";
import { modules, spread } from "./help.js";

const jostle = await load({ only: "surfaces" });

const minus = (a, b) => a.map((x, k) => x - b[k]);
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const along = (a, b, part) => a.map((x, k) => x + (b[k] - x) * part);
const length = (a) => Math.hypot(...a);
const clamped = (x) => Math.min(1, Math.max(0, x));

/** Of a point and an edge. */
function edge_distance(p, a, b) {
  const way = minus(b, a);
  return length(minus(p, along(a, b, clamped(dot(minus(p, a), way) / dot(way, way)))));
}
function vertex_triangle(p, a, b, c) {
  const normal = cross(minus(b, a), minus(c, a));
  const inside = [[a, b], [b, c], [c, a]].every(([from, to]) =>
    dot(cross(minus(to, from), minus(p, from)), normal) >= 0);
  if (inside) return Math.abs(dot(minus(p, a), normal)) / length(normal);
  return Math.min(edge_distance(p, a, b), edge_distance(p, b, c), edge_distance(p, c, a));
}
/** Where neither end is nearest, their lines are, and these have a common normal. */
function edge_edge(a, b, c, d) {
  const [u, v, w] = [minus(b, a), minus(d, c), minus(a, c)];
  const normal = cross(u, v), area = dot(normal, normal);
  const s = dot(cross(v, w), normal) / area, t = dot(cross(u, w), normal) / area;
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return Math.abs(dot(w, normal)) / Math.sqrt(area);
  return Math.min(
    edge_distance(a, c, d), edge_distance(b, c, d), edge_distance(c, a, b), edge_distance(d, a, b));
}
/** Which side of a triangle's plane a point is on. */
const side = (a, b, c, p) => Math.sign(dot(cross(minus(b, a), minus(c, a)), minus(p, a)));
function passes(p, q, a, b, c) {
  const turns = [[a, b], [b, c], [c, a]].map(([from, to]) => side(p, q, from, to));
  return side(a, b, c, p) !== side(a, b, c, q) && turns.every((turn) => turn === turns[0]);
}

/** Triangles of all kinds, some of which share vertices, a loose edge and a loose point. */
function soup(seed) {
  const next = spread(seed), count = 36;
  const of = (width, rows) =>
    Uint32Array.from(
      Array.from({ length: rows }, () => {
        const all = new Set();
        while (all.size < width) all.add(Math.floor(next() * count));
        return [...all];
      }).flat(),
    );
  const parts = { triangles: of(3, 16), edges: of(2, 3), points: of(1, 2), vertices: count };
  const positions = Float64Array.from({ length: 3 * count }, () => Math.fround(2 * next()));
  const moved = positions.map((x) => Math.fround(x + next() - 0.5));
  return { parts, positions, moved };
}
/** Both kinds of pairs that have no vertex in common: [a, b], and the four vertices. */
function all_pairs(surface) {
  const rows = (list, width) =>
    Array.from({ length: list.length / width }, (_, k) => [...list.slice(width * k, width * k + width)]);
  const [triangles, edges] = [rows(surface.triangles, 3), rows(surface.edges, 2)];
  const apart = ({ vertices }) => new Set(vertices).size === 4;
  return {
    vertexTriangle: [...surface.points]
      .flatMap((v) => triangles.map((corners, t) => ({ key: `${v} ${t}`, vertices: [v, ...corners] })))
      .filter(apart),
    edgeEdge: edges
      .flatMap((a, i) =>
        edges.slice(i + 1).map((b, j) => ({ key: `${i} ${i + 1 + j}`, vertices: [...a, ...b] })))
      .filter(apart),
    edges,
    triangles,
  };
}
const distance_of = { vertexTriangle: vertex_triangle, edgeEdge: edge_edge };
const places = (positions, vertices) => vertices.map((v) => [...positions.slice(3 * v, 3 * v + 3)]);

for (const type of ["float32", "float64"])
  test(`near, moving and crossings as the definition has them, ${type}`, () => {
    const [Array_, slack] = type === "float32" ? [Float32Array, 1e-5] : [Float64Array, 1e-11];
    const finder = new jostle.SurfaceFinder({ type });
    let met = 0, crossed = 0;
    for (let seed = 1; seed <= 8; ++seed) {
      const { parts, positions, moved } = soup(seed);
      const surface = new jostle.Surface(parts);
      assert.equal(surface.vertices, 36);
      assert.deepEqual(surface.triangles, parts.triangles);
      const keys = (list) => Array.from({ length: list.length / 2 }, (_, k) =>
        [list[2 * k], list[2 * k + 1]].sort((a, b) => a - b).join(" "));
      assert.ok(keys(parts.edges).every((key) => keys(surface.edges).includes(key)));
      assert.ok(parts.points.every((point) => surface.points.includes(point)));
      const all = all_pairs(surface), at = Array_.from(positions), to = Array_.from(moved);
      const near = finder.near(surface, at, 0.125);
      const moving = finder.moving(surface, at, to, 0.0625);
      const times = [];
      for (const kind of ["vertexTriangle", "edgeEdge"]) {
        const distance = (positions, vertices) => distance_of[kind](...places(positions, vertices));
        const wanted = all[kind].filter(({ vertices }) => distance(positions, vertices) <= 0.125);
        const { length: count, parts, vertices, weights, normals, distances } = near[kind];
        const found = Array.from({ length: count }, (_, k) => `${parts[2 * k]} ${parts[2 * k + 1]}`);
        assert.deepEqual([...found].sort(), wanted.map(({ key }) => key).sort());
        const by_key = new Map(wanted.map((pair) => [pair.key, pair]));
        found.forEach((key, k) => {
          const pair = by_key.get(key), of_first = kind === "edgeEdge" ? 2 : 1;
          assert.deepEqual([...vertices.slice(4 * k, 4 * k + 4)], pair.vertices);
          assert.ok(Math.abs(distances[k] - distance(positions, pair.vertices)) < slack);
          // The nearest points are that far apart, along the normal.
          const way = [0, 0, 0];
          places(positions, pair.vertices).forEach((place, i) =>
            place.forEach((x, axis) => (way[axis] += (i < of_first ? -1 : 1) * weights[4 * k + i] * x)));
          way.forEach((x, axis) => assert.ok(Math.abs(x - distances[k] * normals[3 * k + axis]) < slack));
        });

        const impacts = moving[kind], met_at = new Map();
        for (let k = 0; k < impacts.length; ++k)
          met_at.set(`${impacts.parts[2 * k]} ${impacts.parts[2 * k + 1]}`, impacts.times[k]);
        assert.equal(met_at.size, impacts.length);
        times.push(...impacts.times);
        for (const { key, vertices } of all[kind]) {
          const [begin, end] = [places(positions, vertices), places(moved, vertices)];
          const then = (part) => distance_of[kind](...begin.map((place, k) => along(place, end[k], part)));
          const time = met_at.get(key) ?? 1.0001;
          // Apart until then, and there within the distance.
          for (let k = 0; k < 16 && k / 16 < time - 1e-6; ++k)
            assert.ok(then(k / 16) > 0.0625, `${key} at ${k / 16}`);
          if (time <= 1) assert.ok(then(time) < 0.0625 + 1e-6, `${key} at ${time}`);
        }
        met += impacts.length;
      }
      assert.equal(moving.safeStep, Math.min(1, ...times));

      const crossings = finder.crossings(surface, at);
      const wanted = all.edges.flatMap((edge, e) =>
        all.triangles.flatMap((corners, t) =>
          new Set([...edge, ...corners]).size === 5 &&
          passes(...places(positions, edge), ...places(positions, corners)) ? [`${e} ${t}`] : []));
      const found = Array.from({ length: crossings.length / 2 }, (_, k) =>
        `${crossings[2 * k]} ${crossings[2 * k + 1]}`);
      assert.deepEqual(found.sort(), wanted.sort());
      crossed += found.length;
      surface.dispose();
    }
    assert.ok(met > 500 && crossed > 20, `${met} met, ${crossed} crossed`);
    finder.releaseMemory();
    finder.dispose();
  });

test("thickness, rest and bodies", () => {
  // Two triangles that face each other, 0.5 apart.
  const triangles = Uint32Array.of(0, 1, 2, 3, 4, 5);
  const surface = new jostle.Surface({ triangles });
  const at = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5, 1, 0, 0.5, 0, 1, 0.5);
  const finder = new jostle.SurfaceFinder();
  const count = (...given) => finder.near(surface, at, ...given).vertexTriangle.length;
  assert.equal(count(0.25), 0);
  assert.equal(count(0.5), 6);
  assert.equal(count(0.25, { thickness: new Float32Array(6).fill(0.125) }), 6);
  assert.equal(count(0.25, { thickness: Float32Array.of(0.25, 0, 0, 0, 0, 0) }), 4); // of 0, and of 3 others
  assert.equal(count(0.5, { rest: at }), 0);
  assert.equal(count(0.5, { bodies: new Uint32Array(6) }), 0);
  assert.equal(count(0.5, { bodies: Uint32Array.of(0, 0, 0, 1, 1, 1) }), 6);
  const through = at.map((x, k) => (k > 8 && k % 3 === 2 ? -x : x));
  const meets = (part, ...given) => {
    const { safeStep } = finder.moving(surface, at, through, ...given);
    assert.ok(safeStep <= part && safeStep > part - 1e-6, `${safeStep}`); // never late
  };
  meets(0.5);
  meets(0.25, 0.25);
  const options = { bodies: new Uint32Array(6), tolerance: 1e-3 };
  assert.equal(finder.moving(surface, at, through, 0, options).safeStep, 1);
  // Flat triangles in one plane touch each other, which counts.
  const flat = at.map((x, k) => (k % 3 === 2 ? 0 : x));
  assert.ok(finder.crossings(surface, flat).length > 0);
  assert.equal(finder.crossings(surface, flat, { bodies: new Uint32Array(6) }).length, 0);
});

test("arrays in the module's memory are read in place", () => {
  const surface = new jostle.Surface({ triangles: Uint32Array.of(0, 1, 2, 3, 4, 5) });
  const positions = jostle.array("float64", 18);
  positions.view.set([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5, 1, 0, 0.5, 0, 1, 0.5]);
  const finder = new jostle.SurfaceFinder({ type: "float64" });
  const copied = finder.near(surface, positions.view.slice(), 0.75);
  assert.deepEqual(finder.near(surface, positions, 0.75), copied);
  assert.ok(copied.edgeEdge.length > 0);
});

test("mistakes are named, and change nothing", () => {
  const triangles = Uint32Array.of(0, 1, 2, 3, 4, 5);
  const surface = new jostle.Surface({ triangles }), finder = new jostle.SurfaceFinder();
  const at = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5, 1, 0, 0.5, 0, 1, 0.5);
  const before = finder.near(surface, at, 1);
  for (const [wrong, message] of [
    [() => new jostle.Surface({ triangles: triangles.slice(1) }), /triangles has 5 numbers.*multiple of 3/],
    [() => new jostle.Surface({ triangles: [0, 1, 2] }), /triangles is a Array: it must be Uint32Array/],
    [() => new jostle.Surface({ triangles: Uint32Array.of(0, 1, 1) }), /triangle 0/],
    [() => new jostle.Surface({ triangles, vertices: 5 }), /triangle 1/],
    [() => new jostle.Surface({ triangles, vertices: -1 }), /vertices is -1/],
    [() => new jostle.Surface([0, 1, 2]), /parts are a Array: they must be an object/],
    [() => new jostle.SurfaceFinder({ type: "uint32" }), /type is "uint32"/],
    [() => finder.near({}, at, 1), /surface is a Object: it must be a Surface/],
    [() => finder.near(surface, Float64Array.from(at), 1), /positions is a Float64Array/],
    [() => finder.near(surface, at.slice(3), 1), /5.*6/],
    [() => finder.near(surface, at, -1), /distance/],
    [() => finder.near(surface, at, "far"), /distance is "far": it must be a number/],
    [() => finder.near(surface, at.map((x, k) => (k === 4 ? NaN : x)), 1), /vertex 1|positions\[1\]/],
    [() => finder.near(surface, at, 1, { thickness: new Float32Array(5) }), /thickness has 5 .* 6 vertices/],
    [() => finder.near(surface, at, 1, { bodies: new Float32Array(6) }), /bodies is a Float32Array/],
    [() => finder.moving(surface, at, at.slice(3)), /from has 6 positions, and to has 5/],
    [() => finder.moving(surface, at, at, 0, { tolerance: -1 }), /tolerance/],
  ])
    assert.throws(wrong, { name: "JostleError", message });
  assert.deepEqual(finder.near(surface, at, 1), before);
  surface.dispose();
  assert.throws(() => finder.near(surface, at, 1), /this Surface was disposed of/);
});

test("other modules have no surfaces, and this one has pairs as well", async () => {
  assert.equal((await modules.simd()).SurfaceFinder, undefined);
  const boxes = Float32Array.of(0, 0, 0, 2, 2, 2, 1, 1, 1, 3, 3, 3);
  assert.deepEqual(jostle.findPairs(boxes, { dim: 3 }), Uint32Array.of(0, 1));
  assert.throws(() => jostle.scene("uniform", 10), /this module has pairs and surfaces alone/);
  await assert.rejects(load({ only: "surfaces", simd: false }), /surfaces need SIMD/);
  const other = await load({ only: "surfaces", threads: 0 });
  assert.equal(other.threads, 1);
  const surface = new other.Surface({ triangles: Uint32Array.of(0, 1, 2) });
  const finder = new jostle.SurfaceFinder();
  assert.throws(() => finder.near(surface, new Float32Array(9), 1), /surface belongs to another module/);
});
