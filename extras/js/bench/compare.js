// SPDX-License-Identifier: MIT
// What finding pairs takes in node beside what people use in JavaScript today: the same moving boxes, in one
// run.
//
//     extras/js/build build/package && cd extras/js/bench && npm install
//     npm install --no-save ../../../build/package && node compare.js [boxes...]
//
// Each frame all boxes move, and each system is given the new boxes and asked for all pairs: the time
// includes what it takes to tell it of them. Each frame is done by all systems in turn, on one thread each;
// the median of the frames' processor times counts, so that other programs on the machine matter little. All
// have to find the same pairs, except the physics engines, which round centre and half edges to float, and
// make boxes wider so that they needn't be told of small motions: they may miss one pair in a thousand, and
// find more.
import RAPIER from "@dimforge/rapier3d-simd-compat";
import { System } from "detect-collisions";
import Flatbush from "flatbush";
import initialise_jolt from "jolt-physics/wasm-compat";
import RBush from "rbush";
import { cpus } from "node:os";

import { load } from "jostle";

const FRAMES = 7;
const PATIENCE = 4000; // milliseconds: a system that takes longer for a frame isn't measured for more boxes

/**
 * A system: start(boxes, dim) takes the first frame's boxes, find(boxes) moves to the next one's and returns
 * the number of pairs.
 */
async function jostle_system() {
  const jostle = await load();
  const finder = new jostle.PairFinder();
  let dim;
  return {
    start: (boxes, d) => (dim = d),
    find: (boxes) => finder.find(boxes, { dim }).length / 2, // boxes of the caller's: they are copied in
  };
}

function flatbush_system() {
  return {
    start() {},
    find(boxes) {
      const count = boxes.length / 4;
      const tree = new Flatbush(count, 16, Float32Array);
      for (let i = 0; i < count; ++i)
        tree.add(boxes[4 * i], boxes[4 * i + 1], boxes[4 * i + 2], boxes[4 * i + 3]);
      tree.finish();
      let pairs = 0;
      for (let i = 0; i < count; ++i)
        tree.search(boxes[4 * i], boxes[4 * i + 1], boxes[4 * i + 2], boxes[4 * i + 3], (j) => {
          if (i < j) ++pairs;
          return false;
        });
      return pairs;
    },
  };
}

function rbush_system() {
  return {
    start() {},
    find(boxes) {
      const items = [];
      for (let i = 0; i < boxes.length; i += 4)
        items.push({ minX: boxes[i], minY: boxes[i + 1], maxX: boxes[i + 2], maxY: boxes[i + 3], i });
      const tree = new RBush().load(items);
      let pairs = 0;
      for (const item of items) for (const other of tree.search(item)) if (item.i < other.i) ++pairs;
      return pairs;
    },
  };
}

function detect_collisions_system() {
  let system, bodies;
  return {
    start(boxes) {
      system = new System();
      bodies = [];
      for (let i = 0; i < boxes.length; i += 4) {
        const body = system.createBox(
          { x: boxes[i], y: boxes[i + 1] },
          boxes[i + 2] - boxes[i],
          boxes[i + 3] - boxes[i + 1],
        );
        body.number = i / 4;
        bodies.push(body);
      }
    },
    find(boxes) {
      for (let i = 0; i < bodies.length; ++i)
        bodies[i].setPosition(boxes[4 * i], boxes[4 * i + 1]); // updates the tree
      let pairs = 0;
      system.checkAll(({ a, b }) => {
        if (a.number < b.number) ++pairs; // it tells each pair from both sides
      });
      return pairs;
    },
  };
}

const centre = (boxes, i, d) => (boxes[6 * i + d] + boxes[6 * i + 3 + d]) / 2;
const half = (boxes, i, d) => (boxes[6 * i + 3 + d] - boxes[6 * i + d]) / 2;

async function rapier_system() {
  await RAPIER.init();
  let world, colliders;
  return {
    start(boxes) {
      world?.free();
      world = new RAPIER.World({ x: 0, y: 0, z: 0 });
      colliders = [];
      for (let i = 0; i < boxes.length / 6; ++i)
        colliders.push(
          world.createCollider(
            RAPIER.ColliderDesc.cuboid(
              half(boxes, i, 0),
              half(boxes, i, 1),
              half(boxes, i, 2),
            ).setTranslation(centre(boxes, i, 0), centre(boxes, i, 1), centre(boxes, i, 2)),
          ),
        );
    },
    find(boxes) {
      for (let i = 0; i < colliders.length; ++i)
        colliders[i].setTranslation({
          x: centre(boxes, i, 0),
          y: centre(boxes, i, 1),
          z: centre(boxes, i, 2),
        });
      world.step(); // updates the broad phase
      let pairs = 0;
      for (let i = 0; i < colliders.length; ++i) {
        const mine = colliders[i].handle;
        world.collidersWithAabbIntersectingAabb(
          { x: centre(boxes, i, 0), y: centre(boxes, i, 1), z: centre(boxes, i, 2) },
          { x: half(boxes, i, 0), y: half(boxes, i, 1), z: half(boxes, i, 2) },
          (other) => {
            if (mine !== other.handle) ++pairs;
            return true;
          },
        );
      }
      return pairs / 2;
    },
  };
}

async function jolt_system() {
  const Jolt = await initialise_jolt();
  let jolt, bodies;
  return {
    start(boxes) {
      if (jolt) Jolt.destroy(jolt);
      const settings = new Jolt.JoltSettings();
      settings.mMaxBodies = boxes.length / 6 + 1;
      settings.mMaxBodyPairs = settings.mMaxContactConstraints = 1024;
      settings.mMaxWorkerThreads = 1;
      const filter = new Jolt.ObjectLayerPairFilterTable(1),
        layers = new Jolt.BroadPhaseLayerInterfaceTable(1, 1);
      layers.MapObjectToBroadPhaseLayer(0, new Jolt.BroadPhaseLayer(0));
      settings.mObjectLayerPairFilter = filter;
      settings.mBroadPhaseLayerInterface = layers;
      settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(
        layers,
        1,
        filter,
        1,
      );
      jolt = new Jolt.JoltInterface(settings);
      Jolt.destroy(settings);
      const to = jolt.GetPhysicsSystem().GetBodyInterface();
      bodies = [];
      const still = new Jolt.Quat(0, 0, 0, 1);
      for (let i = 0; i < boxes.length / 6; ++i) {
        const size = new Jolt.Vec3(half(boxes, i, 0), half(boxes, i, 1), half(boxes, i, 2));
        const at = new Jolt.RVec3(centre(boxes, i, 0), centre(boxes, i, 1), centre(boxes, i, 2));
        const made = new Jolt.BodyCreationSettings(
          new Jolt.BoxShape(size, 0),
          at,
          still,
          Jolt.EMotionType_Kinematic,
          0,
        );
        const body = to.CreateBody(made);
        bodies.push(body.GetID());
        to.AddBody(body.GetID(), Jolt.EActivation_DontActivate);
        for (const each of [size, at, made]) Jolt.destroy(each);
      }
      Jolt.destroy(still);
      jolt.GetPhysicsSystem().OptimizeBroadPhase();
    },
    find(boxes) {
      const physics = jolt.GetPhysicsSystem(), to = physics.GetBodyInterface();
      const at = new Jolt.RVec3(0, 0, 0);
      for (let i = 0; i < bodies.length; ++i) {
        at.Set(centre(boxes, i, 0), centre(boxes, i, 1), centre(boxes, i, 2));
        to.SetPosition(bodies[i], at, Jolt.EActivation_DontActivate);
      }
      Jolt.destroy(at);
      physics.OptimizeBroadPhase();
      let found = 0;
      const collector = new Jolt.CollideShapeBodyCollectorJS();
      collector.Reset = () => {};
      collector.AddHit = () => void ++found;
      const all = new Jolt.BroadPhaseLayerFilter(), every = new Jolt.ObjectLayerFilter();
      const box = new Jolt.AABox(), query = physics.GetBroadPhaseQuery();
      for (let i = 0; i < bodies.length; ++i) {
        box.mMin.Set(boxes[6 * i], boxes[6 * i + 1], boxes[6 * i + 2]);
        box.mMax.Set(boxes[6 * i + 3], boxes[6 * i + 4], boxes[6 * i + 5]);
        query.CollideAABox(box, collector, all, every);
      }
      for (const each of [box, all, every, collector]) Jolt.destroy(each);
      return (found - bodies.length) / 2; // each box finds itself, and each pair is found twice
    },
  };
}

function median(times) {
  const sorted = [...times].sort((a, b) => a - b);
  return sorted[sorted.length >> 1];
}

const counts = process.argv.length > 2 ? process.argv.slice(2).map(Number) : [1000, 10_000, 100_000];
const scenes = await load();
const systems = {
  2: {
    jostle: await jostle_system(),
    flatbush: flatbush_system(),
    rbush: rbush_system(),
    "detect-collisions": detect_collisions_system(),
  },
  3: { jostle: await jostle_system(), rapier: await rapier_system(), "jolt-physics": await jolt_system() },
};
console.log(`node ${process.version}, ${cpus()[0].model}, ${cpus().length} cores\n`);
console.log("| boxes | pairs | system | processor ms a frame | times |\n|---|---|---|---|---|");
for (const dim of [2, 3])
  for (const count of counts) {
    const times = {}, found = {};
    const scene = scenes.scene("uniform", count, 1, { dim });
    for (const system of Object.values(systems[dim])) system.start(scene.boxes.view.slice(), dim);
    for (let frame = 0; frame < FRAMES + 1; ++frame, scene.step()) {
      const boxes = scene.boxes.view.slice();
      for (const [name, system] of Object.entries(systems[dim])) {
        const before = process.cpuUsage();
        const pairs = system.find(boxes);
        const { user, system: kernel } = process.cpuUsage(before);
        if (frame > 0) (times[name] ??= []).push((user + kernel) / 1000); // the first frame warms up
        (found[name] ??= []).push(pairs);
      }
    }
    for (const [name, each] of Object.entries(found))
      each.forEach((pairs, frame) => {
        const right = found.jostle[frame], engine = /rapier|jolt-/.test(name);
        if (engine ? pairs < 0.999 * right || pairs > 1.5 * right : pairs !== right)
          throw new Error(`${name} found ${pairs} pairs of ${count} boxes in ${dim}D, jostle ${right}`);
      });
    const ours = median(times.jostle);
    for (const [name, each] of Object.entries(times)) {
      const ms = median(each);
      const pairs = found[name].at(-1).toLocaleString("en");
      const boxes = `${count.toLocaleString("en")} in ${dim}D`;
      const cells = [boxes, pairs, name, ms.toFixed(2), (ms / ours).toFixed(1)];
      console.log(`| ${cells.join(" | ")} |`);
      if (ms > PATIENCE) delete systems[dim][name];
    }
    scene.dispose();
  }
