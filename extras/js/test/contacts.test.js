// SPDX-License-Identifier: MIT
import assert from "node:assert/strict";
import test from "node:test";

import { poses, rays } from "jostle";
import { modules, random } from "./help.js";

const near = (a, b, within = 1e-5) => assert.ok(Math.abs(a - b) <= within, `${a} is not ${b}`);

for (const [kind, loaded] of Object.entries(modules)) {
  test(`shapes that repeat serve for all configurations: ${kind}`, async () => {
    const jostle = await loaded();
    const links = [jostle.sphere(0.5), jostle.box([0.5, 0.4, 0.3]), jostle.capsule(0.5, 0.2)];
    const next = random(5), at = poses(Float64Array.from({ length: 36 }, () => next() * 2), { dim: 3 });
    const arm = { shapes: new jostle.Shapes({ shapes: links }), poses: at };
    const copies = { shapes: new jostle.Shapes({ shapes: [links, links, links, links].flat() }), poses: at };
    assert.equal(arm.shapes.repeats, false);
    assert.throws(() => jostle.bounds(arm), { status: "size_mismatch" });
    arm.shapes.repeats = true;
    assert.deepEqual(jostle.bounds(arm), jostle.bounds(copies));
    const pairs = Uint32Array.of(0, 1, 3, 4, 9, 11, 2, 11);
    const finder = new jostle.ContactFinder({ dim: 3, type: "float64" });
    assert.deepEqual(finder.distances(arm, pairs), finder.distances(copies, pairs));
    assert.throws(() => jostle.bounds({ ...arm, poses: at.subarray(7) }), { status: "size_mismatch" });
    assert.throws(() => (arm.shapes.repeats = 2), /repeats is 2/);
    arm.shapes.repeats = false;
    assert.throws(() => finder.distances(arm, pairs), { status: "size_mismatch" });
  });

  test(`spheres touch where they should: ${kind}`, async () => {
    const jostle = await loaded();
    const count = 200, next = random(3);
    const radii = Float64Array.from({ length: count }, () => 0.5 + next());
    const shapes = new jostle.Shapes();
    shapes.addSpheres(radii);
    const at = Float32Array.from({ length: 3 * count }, () => next() * 12);
    const objects = { shapes, poses: poses(at, { dim: 3 }) };
    const pairs = jostle.findPairs(jostle.bounds(objects), { dim: 3, sort: true });
    const finder = new jostle.ContactFinder({ dim: 3 });
    const gap = (a, b) =>
      Math.hypot(...[0, 1, 2].map((d) => at[3 * a + d] - at[3 * b + d])) - radii[a] - radii[b];
    const contacts = finder.find(objects, pairs);
    const expected = [];
    for (let k = 0; k < pairs.length; k += 2)
      if (gap(pairs[k], pairs[k + 1]) <= 0) expected.push(pairs[k], pairs[k + 1]);
    assert.ok(expected.length > 100);
    assert.deepEqual([...contacts.pairs], expected);
    assert.equal(contacts.length, expected.length / 2);
    for (let i = 0; i < contacts.length; ++i) {
      assert.equal(contacts.first[i + 1] - contacts.first[i], 1);
      const [a, b] = expected.slice(2 * i);
      near(contacts.depths[contacts.first[i]], -gap(a, b));
      const normal = contacts.normals.subarray(3 * i, 3 * i + 3);
      near(Math.hypot(...normal), 1);
      for (let d = 0; d < 3; ++d)
        near(normal[d] * (gap(a, b) + radii[a] + radii[b]), at[3 * b + d] - at[3 * a + d], 1e-4);
    }
    const touching = finder.touching(objects, pairs), far = finder.distances(objects, pairs);
    for (let k = 0; k < pairs.length / 2; ++k) {
      const between = gap(pairs[2 * k], pairs[2 * k + 1]);
      assert.equal(touching[k], between <= 0 ? 1 : 0);
      near(far.distances[k], between);
    }
    for (const each of [shapes, finder]) each.dispose();
  });
}

test("every kind of shape, one pair each", async () => {
  const jostle = await modules.simd();
  const cube = Float32Array.from({ length: 24 }, (_, i) => ((i / 3) >> (i % 3)) & 1 ? 1 : -1);
  const made = [
    jostle.sphere(1),
    jostle.capsule(1, 0.5),
    jostle.box([1, 1, 1]),
    jostle.roundedBox([1, 1, 1], 0.25),
    jostle.cylinder(1, 1),
    jostle.cone(1, 1),
    jostle.ellipsoid([1, 2, 3]),
    jostle.halfSpace([0, 1, 0], -5),
    jostle.hull(cube, 3),
    jostle.roundedHull(cube, 0.5, 3),
    jostle.mesh(Float32Array.of(-1, 0, -1, 1, 0, -1, 0, 0, 1), Uint32Array.of(0, 1, 2), 3),
    jostle.heightField(Float64Array.of(0, 0, 0, 0), 2),
    jostle.compound(
      [jostle.sphere(1), jostle.box([1, 1, 1])],
      Float64Array.of(0, 0, 0, 0, 0, 0, 1, 3, 0, 0, 0, 0, 0, 1),
    ),
  ];
  assert.deepEqual(
    made.map((shape) => shape.type),
    [
      "sphere",
      "capsule",
      "box",
      "rounded_box",
      "cylinder",
      "cone",
      "ellipsoid",
      "half_space",
      "convex",
      "rounded_hull",
      "mesh",
      "height_field",
      "compound",
    ],
  );
  // A small ball at each one's place, but for what has nothing there: half-spaces and height fields lie
  // below.
  const shapes = new jostle.Shapes({ shapes: [jostle.sphere(0.1), ...made] });
  assert.equal(shapes.length, made.length + 1);
  const objects = { shapes, poses: poses(new Float32Array(3 * (made.length + 1)), { dim: 3 }) };
  const pairs = Uint32Array.from({ length: 2 * made.length }, (_, i) => (i % 2 === 0 ? 0 : (i + 1) / 2));
  const finder = new jostle.ContactFinder({ dim: 3 });
  const touching = [...finder.touching(objects, pairs)];
  made.forEach((shape, i) => assert.equal(touching[i], shape.type === "half_space" ? 0 : 1, shape.type));
  const contacts = finder.find(objects, pairs, { margin: 0.01 });
  assert.ok(contacts.length >= made.length - 1);
  for (const array of [contacts.normals, contacts.depths, contacts.fromA])
    assert.ok(array.every(Number.isFinite));

  const flat = new jostle.Shapes({ dim: 2 });
  flat.addBoxes(Float64Array.of(1, 1, 1, 1));
  flat.set(1, jostle.sphere(0.5, 2));
  flat.add(jostle.ellipsoid([1, 2]), 2);
  assert.equal(flat.length, 4);
  const in_plane = new jostle.ContactFinder({ dim: 2, type: "float64" });
  const placed = {
    shapes: flat,
    poses: poses(Float64Array.of(0, 0, 1.25, 0, 9, 9, 20, 20), { dim: 2, rotations: [0, 1, 2, 3] }),
  };
  const one = in_plane.find(placed, Uint32Array.of(0, 1));
  near(one.depths[0], 0.25, 1e-12);
  near(one.normals[0], 1, 1e-12);
});

test("motion: impacts, rays and shapes that are cast", async () => {
  const jostle = await modules.simd();
  const shapes = new jostle.Shapes();
  shapes.addSpheres(Float64Array.of(1, 1));
  const finder = new jostle.ContactFinder({ dim: 3, type: "float64" });
  const still = { shapes, poses: poses(Float64Array.of(0, 0, 0, 10, 0, 0), { dim: 3 }) };
  const motions = new Float64Array(26);
  motions.set(still.poses.subarray(0, 7), 0);
  motions.set(still.poses.subarray(7), 13);
  motions[7] = 16; // half of the way of 8 in half of the time
  const impacts = finder.impacts({ shapes, poses: motions }, Uint32Array.of(0, 1), { tolerance: 1e-9 });
  near(impacts.times[0], 0.5, 1e-6);
  const { rays: line } = rays(Float64Array.of(-5, 0.6, 0), Float64Array.of(1, 0, 0), { dim: 3 });
  const hits = finder.rayCasts(line, still, Uint32Array.of(0, 0, 0, 1));
  near(hits.fractions[0], 4.2, 1e-12);
  near(hits.normals[1], 0.6, 1e-12);
  near(hits.fractions[1], 14.2, 1e-12);
  const cast = finder.shapeCasts(still, Float64Array.of(16, 0, 0, 0, 0, 0), still, Uint32Array.of(0, 1));
  near(cast.fractions[0], 0.5, 1e-9);
});

test("the simulation tells where its bodies are, what they are and where they touch", async () => {
  const jostle = await modules.simd();
  const simulation = jostle.simulation({ scene: "mixed", bodies: 90 });
  assert.equal(simulation.contacts().length, 0);
  for (let frame = 0; frame < 60; ++frame) simulation.step();
  const boxes = simulation.boxes.slice(), where = simulation.poses.slice();
  assert.deepEqual([boxes.length, where.length, simulation.velocities.length], [6 * 90, 7 * 90, 6 * 90]);
  const kinds = new Set();
  for (let i = 0; i < 90; ++i) {
    const kind = simulation.shapes[simulation.shapeOf[i]], size = simulation.sizes[i];
    kinds.add(kind);
    assert.ok(size > 0.29 && size < 0.51);
    for (let d = 0; d < 3; ++d) {
      const half = boxes[6 * i + 3 + d] - where[7 * i + d];
      assert.ok(half <= size * 1.7321 + 1e-4 && half > 0);
      if (kind === "sphere") near(half, size, 1e-4);
    }
    near(Math.hypot(...where.subarray(7 * i + 3, 7 * i + 7)), 1);
  }
  assert.equal(kinds.size, 3);
  const contacts = simulation.contacts();
  assert.ok(contacts.length > 20 && contacts.pairs.every((object) => object < 90 + 5));
  assert.ok(contacts.normals.every(Number.isFinite));
  assert.ok(
    simulation.pairs > 0 &&
      simulation.contactPoints > 0 &&
      simulation.energy > 0 &&
      simulation.times.contacts >= 0,
  );
  simulation.dispose();
});

test("margins, a second set, parts, and rotations of each", async () => {
  const jostle = await modules.simd();
  const shapes = new jostle.Shapes();
  shapes.addSpheres(Float64Array.of(1, 1));
  const finder = new jostle.ContactFinder({ dim: 3, type: "float64" });
  const at = (...positions) => ({ shapes, poses: poses(Float64Array.from(positions), { dim: 3 }) });
  const near_by = at(0, 0, 0, 2.5, 0, 0), far = at(6, 0, 0, 0, 9, 0), pair = Uint32Array.of(0, 1);
  assert.equal(finder.find(near_by, pair).length, 0);
  assert.equal(finder.find(near_by, pair, { margin: 1 }).length, 1);
  near(finder.distances(near_by, pair).distances[0], 0.5, 1e-12);
  near(finder.distances(near_by, pair, { b: far }).distances[0], 7, 1e-12);
  near(finder.distances(near_by, Uint32Array.of(1, 0), { b: far }).distances[0], 1.5, 1e-12);
  const tight = jostle.bounds(near_by);
  const wider = jostle.bounds(near_by, { margin: 0.5 });
  tight.forEach((bound, i) => near(wider[i], bound + (i % 6 < 3 ? -0.5 : 0.5), 1e-12));

  // Two balls in one shape: the ray from the right meets the second, whose part number is 1.
  const ball = jostle.sphere(1), turn = [0, 0, 0, 1];
  const two = new jostle.Shapes();
  two.add(jostle.compound([ball, ball], Float64Array.of(-3, 0, 0, ...turn, 3, 0, 0, ...turn)));
  two.add(ball);
  const placed = { shapes: two, poses: poses(Float64Array.of(0, 0, 0, 10, 0, 0), { dim: 3 }) };
  const { rays: line } = rays(Float64Array.of(9, 0, 0), Float64Array.of(-1, 0, 0), { dim: 3 });
  const hit = finder.rayCasts(line, placed, Uint32Array.of(0, 0));
  near(hit.fractions[0], 5, 1e-12);
  assert.deepEqual([hit.parts[0], hit.movingParts[0]], [1, 0]);
  const cast = finder.shapeCasts(placed, Float64Array.of(12, 0, 0, 0, 0, 0), placed, pair);
  near(cast.fractions[0], 5 / 12, 1e-9);
  assert.deepEqual([cast.parts[0], cast.movingParts[0]], [0, 1]);

  const ground = new jostle.Shapes({
    shapes: [jostle.heightField(new Float64Array(6), 3, { spacingX: 2, spacingZ: 5 })],
  });
  const box = jostle.bounds({ shapes: ground, poses: poses(Float64Array.of(0, 0, 0), { dim: 3 }) });
  near(box[3] - box[0], 4, 1e-12);
  near(box[5] - box[2], 5, 1e-12);
  const turned = poses(new Float64Array(6), { dim: 3, rotations: [1, 2, 3, 4, 5, 6, 7, 8] });
  assert.deepEqual([...turned], [0, 0, 0, 1, 2, 3, 4, 0, 0, 0, 5, 6, 7, 8]);
  for (const each of [shapes, two, ground, finder]) each.dispose();
});
