// SPDX-License-Identifier: MIT
// Seeded scenes, and the simulation of falling bodies.

import { MemoryArray, Owned, describe, options_of, space_of, whole } from "./core.js";
import { split_contacts } from "./contacts.js";
import { refuse } from "./error.js";
import * as C from "./structs.js";

/** What scenes there are. */
export function scene_list(core) {
  return list(core, "_jostle_js_scene_info", (info) => ({
    pairsPerObject: core.f64(info + 16),
    hostile: core.u32(info + 24) !== 0,
  }));
}
export function simulation_list(core) {
  return list(core, "_jostle_js_simulation_info", () => ({}));
}
/** None where the module lacks them. */
function list(core, name, more) {
  if (core.module[name] === undefined) return Object.freeze([]);
  return core.within(() => {
    const info = core.scratch.take(32);
    const found = [];
    for (let i = 0; i < core.module[name](i, info); ++i)
      found.push(
        Object.freeze({
          name: core.text(core.u32(info), core.u32(info + 4)),
          summary: core.text(core.u32(info + 8), core.u32(info + 12)),
          ...more(info),
        }),
      );
    return Object.freeze(found);
  });
}

function seed_of(seed) {
  if (typeof seed === "bigint" && seed >= 0n && seed < 2n ** 64n) return seed;
  if (!Number.isSafeInteger(seed) || seed < 0) refuse(`seed is ${describe(seed)}: it must be a whole number`);
  return BigInt(seed);
}

/** Seeded boxes that move: see jostle.d.ts. */
export class Scene extends Owned {
  constructor(core, name, length, seed = 1, options) {
    const { dim = 3, type = "float32" } = options_of(options);
    const space = space_of(dim, type);
    super(core, "_jostle_js_scene_free", core.within(() => {
      const text = core.utf8(name);
      return core.make(
        "jostle_js_scene_new",
        space,
        text.pointer,
        text.size,
        whole(length, "length"),
        seed_of(seed),
      );
    }));
    this.info = scene_list(core).find((info) => info.name === name);
    this.dim = dim;
    this.length = length;
    this.frame = 0;
    this.boxes = new MemoryArray(
      core,
      type,
      2 * dim * length,
      this,
      ({ pointer }) => core.module._jostle_js_scene_boxes(pointer) >>> 0,
    );
  }
  step() {
    this.core.call("jostle_js_scene_step", this.pointer);
    ++this.frame;
  }
}

const SHAPES = ["sphere", "cube", "octahedron"];
const SHAPE_OF = { 0: 0, 2: 1, 3: 2 }; // by jostle_shape_type

/** Falling bodies: see jostle.d.ts. */
export class Simulation extends Owned {
  constructor(core, options) {
    const { scene = "spheres", bodies = 1000, seed = 1 } = options_of(options);
    super(core, "_jostle_js_simulation_free", core.within(() => {
      const text = core.utf8(scene);
      return core.make(
        "jostle_js_simulation_new",
        text.pointer,
        text.size,
        whole(bodies, "bodies"),
        seed_of(seed),
        core.executor,
      );
    }));
    this.frame = 0;
    this.bodies = bodies;
    this.shapes = SHAPES;
    core.within(() => {
      const types = core.scratch.take(bodies), sizes = core.scratch.take(4 * bodies);
      core.module._jostle_js_simulation_shapes(this.pointer, types, sizes);
      this.shapeOf = core.bytes.slice(types, types + bodies).map((type) => SHAPE_OF[type]);
      this.sizes = core.view("float32", sizes, bodies).slice();
    });
  }
  step() {
    this.core.call("jostle_js_simulation_step", this.pointer);
    ++this.frame;
  }
  #read(inside) {
    return this.core.within(() => {
      const numbers = this.core.scratch.take(96);
      this.core.module._jostle_js_simulation_read(this.pointer, numbers);
      return inside(numbers);
    });
  }
  #number(i) {
    return this.#read((numbers) => this.core.f64(numbers + 8 * i));
  }
  get pairs() {
    return this.#number(1);
  }
  get contactPoints() {
    return this.#number(2);
  }
  get energy() {
    return this.#number(4);
  }
  get deepest() {
    return this.#number(5);
  }
  get times() {
    return this.#read((numbers) => {
      const [boxes, pairs, contacts, responses, motion] = [6, 7, 8, 9, 10].map((i) =>
        this.core.f64(numbers + 8 * i),
      );
      return { boxes, pairs, contacts, responses, motion };
    });
  }
  get hash() {
    return this.#read((numbers) =>
      this.core.data
        .getBigUint64(numbers + 88, true)
        .toString(16)
        .padStart(16, "0"),
    );
  }
  get boxes() {
    return this.core.view(
      "float32",
      this.core.make("jostle_js_simulation_boxes", this.pointer),
      6 * this.bodies,
    );
  }
  get poses() {
    const { core, pointer } = this;
    return core.view("float32", core.module._jostle_js_simulation_poses(pointer) >>> 0, 7 * this.bodies);
  }
  get velocities() {
    return this.core.within(() => {
      const out = this.core.scratch.take(24 * this.bodies);
      this.core.module._jostle_js_simulation_velocities(this.pointer, out);
      return this.core.view("float32", out, 6 * this.bodies).slice();
    });
  }
  contacts() {
    return this.core.within(() => {
      const blocks = this.core.struct(C.jostle_blocks);
      this.core.call("jostle_js_simulation_contacts", this.pointer, blocks);
      return split_contacts(this.core, 3, "float32", blocks);
    });
  }
}
