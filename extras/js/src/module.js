// SPDX-License-Identifier: MIT
import { BoxIndex } from "./box_index.js";
import { ContactFinder } from "./contacts.js";
import { MemoryArray, describe, wanted_ids, whole } from "./core.js";
import { refuse } from "./error.js";
import { NeighborFinder, neighbors } from "./neighbors.js";
import { PairFinder, bricks, check_boxes, checksum, find_periodic_pairs } from "./pairs.js";
import { Scene, Simulation, scene_list, simulation_list } from "./scenes.js";
import { Shapes, bounds, shape_makers } from "./shapes.js";
import { Surface, SurfaceFinder } from "./surfaces.js";
import { PairSlots, World } from "./world.js";

/** A loaded module: everything of Jostle's that needs its memory. See jostle.d.ts. */
export class Module {
  #core;
  #spare = []; // finders of findPairs

  constructor(core) {
    this.#core = core;
    this.threads = core.threads;
    [this.version, this.instructionSet] = core.within(() => {
      const out = core.scratch.take(16);
      core.call("jostle_version", out, out + 4, out + 8);
      const version = [0, 4, 8].map((at) => core.u32(out + at)).join(".");
      core.call("jostle_instruction_sets", out, out + 8);
      core.call("jostle_instruction_set_name", core.u32(core.u32(out)), out);
      return [version, core.string(core.u32(out))];
    });
    this.scenes = scene_list(core);
    this.PairFinder = bound(core, PairFinder);
    if (core.module._jostle_surface_new !== undefined) {
      this.Surface = bound(core, Surface);
      this.SurfaceFinder = bound(core, SurfaceFinder);
    }
    if (core.module._jostle_world_new === undefined) return; // it has pairs alone, or surfaces as well
    this.simulations = simulation_list(core);
    this.NeighborFinder = bound(core, NeighborFinder);
    this.BoxIndex = bound(core, BoxIndex);
    this.World = bound(core, World);
    this.PairSlots = bound(core, PairSlots);
    this.ContactFinder = bound(core, ContactFinder);
    this.Shapes = bound(core, Shapes);
    Object.assign(this, shape_makers(core));
  }

  get memoryBytes() {
    this.#core.want_open();
    return this.#core.memory.buffer.byteLength;
  }
  get disposed() {
    return this.#core.closed;
  }
  dispose() {
    this.#core.close();
  }

  array(type, length) {
    if (type !== "float32" && type !== "float64" && type !== "uint32")
      refuse(`type is ${describe(type)}: it must be "float32", "float64" or "uint32"`);
    return new MemoryArray(this.#core, type, whole(length, "length"));
  }

  /** A finder for the duration of a call: callbacks may search, too. */
  #with_finder(inside) {
    const finder = this.#spare.pop() ?? new PairFinder(this.#core);
    try {
      return inside(finder);
    } finally {
      this.#spare.push(finder);
    }
  }
  findPairs(...given) {
    return this.#with_finder((finder) => finder.find(...given).slice());
  }
  findPeriodicPairs(boxes, period, options) {
    return this.#with_finder((finder) =>
      find_periodic_pairs(this.#core, finder.pointer, boxes, period, options),
    );
  }
  findScenes(boxes, offsets, options) {
    return this.#with_finder((finder) => finder.scenes(boxes, offsets, options));
  }
  checkBoxes(boxes, options) {
    check_boxes(this.#core, boxes, options);
  }
  checksum(pairs) {
    return checksum(this.#core, pairs);
  }
  bricks(boxes, options) {
    return bricks(this.#core, boxes, options);
  }

  scene(name, length, seed, options) {
    return new Scene(this.#core, name, length, seed, options);
  }
  simulation(options) {
    if (this.simulations?.length === 0) refuse("this module has no simulations: they are of 3D");
    return new Simulation(this.#core, options);
  }
  neighbors(points, cutoff, options) {
    return neighbors(this.#core, points, cutoff, options);
  }
  bounds(objects, options) {
    return bounds(this.#core, objects, options);
  }
  indexOf(ids) {
    return Uint32Array.from(wanted_ids(ids)); // which keeps the lower 32 bits
  }
}
if (Symbol.dispose)
  Object.defineProperty(Module.prototype, Symbol.dispose, { value: Module.prototype.dispose });

/** A class whose objects are of this module. */
function bound(core, Class) {
  const Bound = class extends Class {
    constructor(options) {
      super(core, options);
    }
  };
  Object.defineProperty(Bound, "name", { value: Class.name });
  return Bound;
}
