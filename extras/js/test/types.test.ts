// SPDX-License-Identifier: MIT
// Compiled, not run: a program that uses the types as their comments say.
import { endReasons, JostleError, load, poses, rays, readBoxes, support } from "jostle";
import type {
  Answers,
  BoxFile,
  Bricks,
  Contacts,
  FindOptions,
  Jostle,
  MemoryArray,
  NearParts,
  PairFinder,
  World,
} from "jostle";
import { Flatbush } from "jostle/flatbush";
import { RBush } from "jostle/rbush";
import type { BBox } from "jostle/rbush";

async function game(): Promise<void> {
  const jostle: Jostle = await load({
    threads: support.threads ? 0 : 1,
    wasm: new URL("jostle.wasm", "https://example.org/"),
  });
  const boxes: MemoryArray<Float32Array> = jostle.array("float32", 6 * 1000);
  const finder: PairFinder = new jostle.PairFinder();
  const options: FindOptions = {
    dim: 3,
    sort: true,
    owner: new Uint32Array(1000),
    accept: (a, b) => a + b > 3,
  };
  const pairs: Uint32Array = finder.find(boxes, options);
  finder.find(boxes, new Float64Array(12), { dim: 3, engine: "chapter" });
  const scenes = jostle.findScenes(boxes, [0, 1000], { dim: 3, accept: (scene, a, b) => scene + a < b });
  const went_on: boolean = finder.stream(boxes, { dim: 3 }, (some) => some.length < 10);
  const ms: number = finder.stats.msSweep + finder.stats.msTotal;

  const world: World = new jostle.World({ dim: 3, margin: 0.1, accept: (a, b) => a < b });
  const ids: Float64Array = world.add(boxes, { category: 2, enabled: true });
  world.move(ids, boxes, { displacements: new Float32Array(3000) });
  world.remove([ids[0]]);
  world.update();
  const began: Float64Array = world.began();
  const reason: string = endReasons[world.ended().reasons[0]];
  const hits = world.first(rays(new Float32Array(3), new Float32Array(3), { dim: 3 }), { exclude: ids[0] });
  const id: number = hits.ids[0];

  const index = new jostle.BoxIndex({ dim: 3, type: "float64" });
  const near: Answers<Uint32Array> = index.all(
    { nearest: new Float64Array(3), count: 8 },
    { maxResults: Infinity },
  );
  const none: boolean = index.first({ rays: new Float64Array(7) }).ids[0] === -1;

  const cell = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  const { i, o } = jostle.neighbors(new Float64Array(6), 1, { dim: 3, cell, periodic: true });
  const edges: Uint32Array = i;
  const steps = new jostle.NeighborFinder({ dim: 3, skin: 0.3 });
  const starts: Float64Array = steps.find(boxes, [1, 2], { quantities: "o" }).o;
  const tree = new RBush<BBox & { name: string }>().load([{ minX: 0, minY: 0, maxX: 1, maxY: 1, name: "a" }]);
  const names: string[] = tree.search({ minX: 0, minY: 0, maxX: 1, maxY: 1 }).map((item) => item.name);
  class Points extends RBush<[number, number]> {
    toBBox([x, y]: [number, number]) {
      return { minX: x, minY: y, maxX: x, maxY: y };
    }
  }
  new Points().insert([1, 2]).remove([1, 2], (a, b) => a[0] === b[0]);
  const flat = new Flatbush(1, 16, Float32Array);
  flat.add(0, 0);
  flat.finish();
  const found: number[] = Flatbush.from(flat.data).search(0, 0, 1, 1, (index, x0) => index > x0);
  console.log(o, edges, starts, names, found, flat.neighbors(0, 0, 1));

  const surfaces = await load({ only: "surfaces" });
  const cloth = new surfaces.Surface({ triangles: Uint32Array.of(0, 1, 2), points: Uint32Array.of(3) });
  const bending = new surfaces.SurfaceFinder({ type: "float64" });
  const parts: NearParts = bending.near(cloth, new Float64Array(12), 1, { bodies: cloth.points }).edgeEdge;
  const { safeStep, vertexTriangle } = bending.moving(cloth, boxes, boxes, 0, { tolerance: 1e-3 });
  // @ts-expect-error: it has no worlds
  new surfaces.World({ dim: 3 });
  console.log(parts.normals, safeStep * vertexTriangle.times[0], bending.crossings(cloth, boxes)[0]);

  const shapes = new jostle.Shapes({ shapes: [jostle.sphere(1), jostle.box([1, 2, 3])] });
  const contacts: Contacts = new jostle.ContactFinder({ dim: 3 }).find(
    { shapes, poses: poses(new Float32Array(6), { dim: 3 }) },
    pairs,
  );
  const bricks: Bricks = jostle.bricks(boxes, { dim: 3 });
  const scene = jostle.scene("uniform", 1000, 7n);
  scene.step();
  console.log(
    went_on,
    ms,
    began,
    reason,
    id,
    near.of(0),
    none,
    contacts.first,
    bricks.cells,
    jostle.simulation({ bodies: 3 }).poses,
    scenes.length,
    jostle.findPeriodicPairs(boxes, [9, 9, 0], { dim: 3, sort: true }).shifts,
  );

  try {
    jostle.findPairs(new Float32Array(5), { dim: 2 });
  } catch (error) {
    if (error instanceof JostleError) console.log(error.index, error.status, error.value);
  }
  const file: BoxFile = readBoxes(new Uint8Array(100), "boxes.csv");
  const frames = Array.from({ length: file.frames }, (_, k) =>
    jostle.findPairs(file.frame(k), { dim: file.dim }),
  );
  console.log(frames, file.ids?.[0], readBoxes("lo_x,lo_y,hi_x,hi_y", "none.csv").boxes.length);
  finder[Symbol.dispose]();
  jostle.dispose();
}

async function mistakes(jostle: Jostle): Promise<void> {
  const flat: Jostle = await load({ only: "2d", simd: false, wasm: (file) => `https://example.org/${file}` });
  const few = await load({ only: "pairs" });
  few.findPairs(new Float32Array(4), { dim: 2 });
  // @ts-expect-error: it has pairs alone
  new few.World({ dim: 2 });
  // @ts-expect-error: boxes are typed arrays
  jostle.findPairs([0, 0, 1, 1], { dim: 2 });
  // @ts-expect-error: dim is missing
  jostle.findPairs(new Float32Array(4), {});
  // @ts-expect-error: there is no fourth dimension
  jostle.findPairs(new Float32Array(4), { dim: 4 });
  new jostle.World({ dim: 2 }).remove([1, 2]);
  // @ts-expect-error: ids are plain numbers
  new jostle.World({ dim: 2 }).remove(BigUint64Array.of(1n));
  // @ts-expect-error: a query of no kind
  new jostle.BoxIndex({ dim: 2 }).any({ circles: new Float32Array(3) });
  // @ts-expect-error: pairs that are handed over as they are found aren't sorted
  new jostle.PairFinder().stream(new Float32Array(4), { dim: 2, sort: true }, () => {});
  // @ts-expect-error: not an engine
  jostle.findPairs(new Float32Array(4), { dim: 2, engine: "octree" });
}
void game;
void mistakes;
