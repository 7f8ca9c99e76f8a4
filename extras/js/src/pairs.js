// SPDX-License-Identifier: MIT
// The broad phase: PairFinder, findPairs and their like.

import {
  MemoryArray, Owned, array_like, describe, new_floats, numbers, options_of, size_of, space_of, type_of,
  whole,
} from "./core.js";
import { refuse } from "./error.js";
import * as C from "./structs.js";

const ENGINES = { grid: 0, chapter: 1, uniform: 2, brute: 3 };

/** The arguments of a search: (boxes, options) or (boxes, other, options), and what follows. */
export function search_arguments(given, more = 0) {
  const two = given.length - more > 2;
  const options = given[two ? 2 : 1];
  if (
    options === null ||
    typeof options !== "object" ||
    options instanceof MemoryArray ||
    ArrayBuffer.isView(options)
  )
    refuse(`options are ${describe(options)}: they must say dim, as { dim: 3 }`);
  if (two && given[1] === undefined) refuse("other is undefined: it must be Float32Array or Float64Array");
  return {
    boxes: given[0],
    other: two ? given[1] : undefined,
    options: options_of(options),
    rest: given.slice(two ? 3 : 2),
  };
}

/** Refuses what a call has no use for: ignored, it would look as if it had been done. */
function refuse_unused(options, call, sorts = false) {
  if ((options.engine ?? "grid") !== "grid") refuse(`${call} has the engine grid alone`);
  if (options.sort && !sorts) refuse(`${call} doesn't sort pairs`);
}

/** Boxes in the module's memory; of two sets the narrower numbers are widened, which is exact. */
function place_sets(core, boxes, other, dim) {
  if (dim !== 2 && dim !== 3) refuse(`dim is ${describe(dim)}: it must be 2 or 3`);
  if (other === undefined) return [core.rows(boxes, "boxes", 2 * dim)];
  const wide = type_of(boxes) !== type_of(other);
  const widened = (given) => {
    const numbers = given instanceof MemoryArray ? given.view : given;
    return wide && numbers instanceof Float32Array ? Float64Array.from(numbers) : given;
  };
  return [core.rows(widened(boxes), "boxes", 2 * dim), core.rows(widened(other), "other", 2 * dim)];
}

/** A jostle_filter, or 0 where nothing is filtered. */
function filter_of(core, options, layout, accept_pointer) {
  const members = {
    category: "category",
    mask: "mask",
    owner: "owner",
    categoryB: "category_b",
    maskB: "mask_b",
    ownerB: "owner_b",
  };
  let filter = 0;
  for (const [name, member] of Object.entries(members)) {
    if (options[name] === undefined) continue;
    if (layout[member] === undefined) refuse(`${name} is for searches between two sets`);
    const values = core.integers(options[name], name);
    filter ||= core.struct(layout);
    core.set_values(filter + layout[member], values);
  }
  if (options.ghosts !== undefined) {
    if (layout.ghosts === undefined) refuse("ghosts are for searches within one set of boxes");
    filter ||= core.struct(layout);
    core.data.setBigUint64(filter + layout.ghosts, BigInt(whole(options.ghosts, "ghosts")), true);
  }
  if (options.vertices !== undefined) {
    if (layout.vertices === undefined) refuse("vertices are for searches within one set of boxes");
    const { pointer, length } = core.integers(options.vertices, "vertices");
    if (length % 3 !== 0)
      refuse(`vertices has ${length} numbers: it must have three for each box`, "size_mismatch");
    filter ||= core.struct(layout);
    core.set_values(filter + layout.vertices, { pointer, count: length / 3 }, 12);
  }
  if (options.accept === undefined) return { filter, forget() {} };
  filter ||= core.struct(layout);
  const number = core.remember(options.accept);
  core.data.setUint32(filter + layout.accept, core.module[accept_pointer](), true);
  core.data.setUint32(filter + layout.context, number, true);
  return { filter, forget: () => core.forget(number) };
}

export class PairFinder extends Owned {
  #serial; // for callbacks, which run on this thread
  #last; // the finder that the last search ran on
  #own = { pointer: 0, room: 0 }; // memory for pairs that don't lie together
  #pairs = { pointer: 0, count: 0 };
  #stats; // of another engine

  constructor(core) {
    super(core, "_jostle_free", core.within(() => core.make("jostle_finder_new", core.options())));
  }

  #finder(calls_back) {
    const { core, pointer } = this; // it refuses if this was disposed of
    if (!calls_back || core.executor === core.serial) return pointer;
    this.#serial ??= new Owned(core, "_jostle_free",
      core.within(() => core.make("jostle_finder_new", core.options(core.serial))));
    return this.#serial.pointer;
  }
  want_idle(what) {
    super.want_idle(what, this.#serial ? [this.pointer, this.#serial.pointer] : [this.pointer]);
  }
  #free_serial() {
    this.#serial?.dispose();
    this.#serial = undefined;
  }

  find(...given) {
    const { boxes, other, options } = search_arguments(given);
    const core = this.core;
    const engine = ENGINES[options.engine ?? "grid"] ??
      refuse(`engine is ${describe(options.engine)}: it must be "grid", "chapter", "uniform" or "brute"`);
    core.within(() => {
      const sets = place_sets(core, boxes, other, options.dim);
      const [a, b] = sets;
      this.#pairs.count = 0;
      if (engine !== 0) {
        this.#find_by(engine, a, b, options);
        return;
      }
      const { filter, forget } = filter_of(core, options, C.jostle_filter, "_jostle_js_accept_pair_pointer");
      const finder = this.#finder(options.accept !== undefined);
      const blocks = core.struct(C.jostle_blocks);
      this.#last = finder;
      this.#stats = undefined;
      try {
        core.with_values(sets, options.dim, () =>
          core.call("jostle_finder_find", finder, space_of(options.dim, a.type), core.boxes(a, options.dim),
            b === undefined ? 0 : core.boxes(b, options.dim), filter, options.sort ? 1 : 0, blocks));
      } finally {
        forget();
      }
      this.#gather(blocks);
    });
    return this.pairs;
  }

  /** One array of the pairs: where they lie, if that is one block, else copied. */
  #gather(blocks) {
    const core = this.core;
    const count = core.u64(blocks + C.jostle_blocks.count);
    if (core.u64(blocks + C.jostle_blocks.block_count) === 1) {
      this.#pairs = {
        pointer: core.u32(core.u32(blocks + C.jostle_blocks.blocks) + C.jostle_block.items),
        count,
      };
      return;
    }
    this.#reserve(8 * count);
    if (count !== 0) core.call("jostle_blocks_copy", blocks, BigInt(count), this.#own.pointer);
    this.#pairs = { pointer: this.#own.pointer, count };
  }

  #reserve(bytes) {
    if (bytes <= this.#own.room) return;
    const room = Math.max(bytes + (bytes >> 2), 4096);
    this.#own.memory?.dispose();
    this.#own = { pointer: 0, room: 0 };
    const pointer = this.core.allocate(room);
    this.#own = { pointer, room, memory: new Owned(this.core, "_free", pointer) };
  }

  #find_by(engine, a, b, options) {
    const core = this.core;
    if (
      b !== undefined ||
      ["category", "mask", "owner", "ghosts", "vertices", "accept"].some(
        (name) => options[name] !== undefined,
      )
    )
      refuse("only the engine grid searches between two sets, or with a filter");
    const cell = options.cellSize ?? 0;
    if (!(cell >= 0 && cell < Infinity))
      refuse(`cellSize is ${describe(cell)}: it must be a length, or 0 for the longest edge`);
    const before = performance.now();
    const block = core.struct(C.jostle_block);
    core.with_values([a], options.dim, () =>
      core.call(
        "jostle_js_find",
        space_of(options.dim, a.type),
        a.pointer,
        a.count,
        engine,
        cell,
        core.executor,
        block,
      ),
    );
    const found = core.u32(block + C.jostle_block.items), count = core.u64(block + C.jostle_block.count);
    const ms = performance.now() - before;
    try {
      this.#reserve(8 * count);
      core.bytes.copyWithin(this.#own.pointer, found, found + 8 * count);
    } finally {
      core.module._free(found);
    }
    this.#pairs = { pointer: this.#own.pointer, count };
    this.#last = undefined;
    this.#stats = { objects: a.count, pairs: count, msTotal: ms };
    if (options.sort) sort_pairs(this.pairs);
  }

  get pairs() {
    this.pointer; // still there?
    return this.core.view("uint32", this.#pairs.pointer, 2 * this.#pairs.count);
  }

  get checksum() {
    return checksum(this.core, this.pairs);
  }

  get stats() {
    const { core, pointer } = this;
    return core.within(() => {
      const stats = core.struct(C.jostle_stats);
      if (this.#stats === undefined) core.call("jostle_finder_stats", this.#last ?? pointer, stats);
      return { ...core.read_stats(C.jostle_stats, stats), ...this.#stats };
    });
  }

  stream(...given) {
    const { boxes, other, options, rest: [sink] } = search_arguments(given, 1);
    refuse_unused(options, "stream()");
    const core = this.core;
    const number = core.remember(sink);
    this.#pairs.count = 0;
    try {
      return core.within(() => {
        const sets = place_sets(core, boxes, other, options.dim);
        const [a, b] = sets;
        const { filter, forget } = filter_of(
          core,
          options,
          C.jostle_filter,
          "_jostle_js_accept_pair_pointer",
        );
        const finder = this.#finder(true);
        this.#last = finder;
        this.#stats = undefined;
        const finished = core.scratch.take(4);
        try {
          core.with_values(sets, options.dim, () =>
            core.call(
              "jostle_finder_stream",
              finder,
              space_of(options.dim, a.type),
              core.boxes(a, options.dim),
              b === undefined ? 0 : core.boxes(b, options.dim),
              filter,
              core.module._jostle_js_take_pairs_pointer(),
              number,
              finished,
            ),
          );
        } finally {
          forget();
        }
        return core.u32(finished) === 1;
      });
    } finally {
      core.forget(number);
    }
  }

  scenes(boxes, offsets, given) {
    const core = this.core, options = options_of(given);
    refuse_unused(options, "findScenes()");
    return core.within(() => {
      const [a] = place_sets(core, boxes, undefined, options.dim);
      const places = Array.from(array_like(offsets, "offsets"), (each, i) => whole(each, `offsets[${i}]`));
      if (places.length === 0)
        refuse("offsets has no numbers: it must have one more than there are scenes", "size_mismatch");
      const table = core.ids(places, "offsets");
      const { filter, forget } = filter_of(
        core,
        options,
        C.jostle_scene_filter,
        "_jostle_js_accept_scene_pair_pointer",
      );
      const blocks = core.struct(C.jostle_blocks);
      this.#pairs.count = 0;
      try {
        core.with_values([a], options.dim, () =>
          core.call(
            "jostle_finder_find_scenes",
            this.#finder(options.accept !== undefined),
            space_of(options.dim, a.type),
            core.boxes(a, options.dim),
            table.pointer,
            BigInt(places.length - 1),
            filter,
            blocks,
          ),
        );
      } finally {
        forget();
      }
      const first = new Float64Array(places.length);
      const list = core.u32(blocks + C.jostle_blocks.blocks);
      for (let k = 0; k + 1 < places.length; ++k)
        first[k + 1] = first[k] + core.u64(list + k * C.jostle_block.sizeof + C.jostle_block.count);
      return new ScenePairs(core.copy_pairs(blocks), first);
    });
  }

  releaseMemory() {
    this.want_idle("changed");
    this.core.call("jostle_release_memory", this.pointer);
    this.#free_serial();
    this.#own.memory?.dispose();
    this.#last = undefined;
    this.#own = { pointer: 0, room: 0 };
    this.#pairs = { pointer: 0, count: 0 };
  }

  dispose() {
    if (this.disposed) return;
    this.want_idle("disposed of");
    this.#free_serial();
    this.#own.memory?.dispose();
    super.dispose();
  }
}

class ScenePairs {
  constructor(pairs, first) {
    this.pairs = pairs;
    this.first = first;
  }
  get length() {
    return this.first.length - 1;
  }
  of(scene) {
    whole(scene, "the scene", 0, this.length - 1);
    return this.pairs.subarray(2 * this.first[scene], 2 * this.first[scene + 1]);
  }
}

/** Ascending by (a, b). */
function sort_pairs(pairs) {
  const keys = new BigUint64Array(pairs.length / 2);
  for (let i = 0; i < keys.length; ++i) keys[i] = (BigInt(pairs[2 * i]) << 32n) | BigInt(pairs[2 * i + 1]);
  keys.sort();
  for (let i = 0; i < keys.length; ++i) {
    pairs[2 * i] = Number(keys[i] >> 32n);
    pairs[2 * i + 1] = Number(keys[i] & 0xffffffffn);
  }
}

export function checksum(core, pairs) {
  return core.within(() => {
    const out = core.scratch.take(8);
    core.call("jostle_pair_checksum", core.pairs(pairs).blocks, out);
    return core.data.getBigUint64(out, true).toString(16).padStart(16, "0");
  });
}

export function check_boxes(core, boxes, options) {
  const { dim } = options_of(options);
  core.within(() => {
    const [a] = place_sets(core, boxes, undefined, dim);
    core.with_values([a], dim, () =>
      core.call("jostle_boxes_check", space_of(dim, a.type), core.boxes(a, dim)),
    );
  });
}

export function find_periodic_pairs(core, finder, boxes, period, given) {
  const options = options_of(given);
  if (options.accept !== undefined && core.threads > 1)
    refuse("findPeriodicPairs with accept needs a module of one thread");
  refuse_unused(options, "findPeriodicPairs()", true);
  return core.within(() => {
    const { dim } = options;
    const [a] = place_sets(core, boxes, undefined, dim);
    const space = space_of(dim, a.type);
    const given = numbers(period, "period", dim);
    const lengths = new_floats(a.type, dim);
    lengths.set(given);
    for (let d = 0; d < dim; ++d)
      if (lengths[d] !== given[d] && !Number.isNaN(lengths[d]))
        refuse(
          `period[${d}] is ${given[d]}, which ${a.type} doesn't have: ` +
            `give ${lengths[d]}, or boxes of float64`,
        );
    const images = new Owned(
      core,
      "_jostle_free",
      core.make("jostle_images_new", space, core.options()),
    );
    try {
      core.with_values([a], dim, () =>
        core.call(
          "jostle_images_build",
          images.pointer,
          core.boxes(a, dim),
          core.place(lengths, "period", [a.type]).pointer,
        ),
      );
      const view = core.struct(C.jostle_images_view);
      core.call("jostle_images_view_read", images.pointer, view);
      const { filter, forget } = filter_of(core, options, C.jostle_filter, "_jostle_js_accept_pair_pointer");
      const wish = core.scratch.take(C.jostle_filter.sizeof);
      try {
        return core.with_results((results) => {
          core.data.setBigUint64(wish, BigInt(C.jostle_filter.sizeof), true);
          core.call("jostle_images_filter", images.pointer, filter, wish);
          // A callback of JavaScript's is called on this thread.
          core.call(
            "jostle_finder_take",
            finder,
            space,
            view + C.jostle_images_view.boxes,
            0,
            wish,
            options.sort ? 1 : 0,
            results,
          );
          const found = core.pairs_of_results(results);
          const count = core.u64(view + C.jostle_images_view.boxes + C.jostle_boxes.count);
          const origin = core.view("uint32", core.u32(view + C.jostle_images_view.origin), count);
          const shift = core.view(a.type, core.u32(view + C.jostle_images_view.shift), dim * count);
          const shifts = new_floats(a.type, (found.length / 2) * dim);
          for (let i = 0; i < found.length; i += 2) {
            const image = found[i + 1]; // the first of a pair is an original
            for (let d = 0; d < dim; ++d) shifts[(i / 2) * dim + d] = shift[dim * image + d];
            found[i + 1] = origin[image];
          }
          return { pairs: found, shifts };
        });
      } finally {
        forget();
      }
    } finally {
      images.dispose();
    }
  });
}

/** The engine's outermost grid, and the records in it: see jostle.d.ts. */
export function bricks(core, boxes, options) {
  const { dim } = options_of(options);
  return core.within(() => {
    const [a] = place_sets(core, boxes, undefined, dim);
    const view = core.with_values([a], dim, () =>
      core.make("jostle_js_bricks_new", space_of(dim, a.type), a.pointer, a.count),
    );
    try {
      const [count, records, sweepAxis] = [0, 4, 8].map((at) => core.u32(view + at));
      const axes = [...Array(dim).keys()];
      const array = (type, at, length) => core.view(type, core.u32(view + at), length).slice();
      const bytes = core.u32(view + 84), bounds = core.u32(view + 88);
      return {
        cells: axes.map((d) => core.u32(view + 12 + 4 * d)),
        origin: axes.map((d) => core.f64(view + 24 + 8 * d)),
        edge: axes.map((d) => core.f64(view + 48 + 8 * d)),
        sweepAxis,
        at: array("uint32", 72, dim * count),
        first: array("uint32", 76, count + 1),
        objects: array("uint32", 80, records),
        copies: core.bytes.slice(bytes, bytes + records),
        bounds: new Uint16Array(core.memory.buffer, bounds, 2 * dim * records).slice(),
        quanta: 16384,
      };
    } finally {
      core.module._jostle_js_bricks_free(view);
    }
  });
}
