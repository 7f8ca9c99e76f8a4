// SPDX-License-Identifier: MIT
// The way into the module: its memory, its functions, their arguments and errors. Everything else is built on
// this.

import { JostleError, refuse } from "./error.js";
import * as C from "./structs.js";

const NONE = 2n ** 64n - 1n;
const FLOATS = { float32: Float32Array, float64: Float64Array };
const ARRAYS = { ...FLOATS, uint32: Uint32Array };
/**
 * How deep calls may lie in one another's callbacks. A world's update takes the most of the module's stack of
 * 1 MB, 8 kB of it; where that ends there is other memory.
 */
const MOST_CALLS = 32;
const decoder = new TextDecoder();
const encoder = new TextEncoder();

/** Frees what objects hold that were left to the garbage collector. */
const abandoned = new FinalizationRegistry(({ core, free, pointer, after }) => {
  core.free(free, pointer);
  after?.();
});

/**
 * An object of the module's, and how to free it; `after` is called when that is done, and must not hold the
 * object.
 */
export class Owned {
  #pointer;
  #free;
  #after;

  constructor(core, free, pointer, after) {
    this.core = core;
    this.#pointer = pointer;
    this.#free = free;
    this.#after = after;
    abandoned.register(this, { core, free, pointer, after }, this);
  }

  get pointer() {
    if (this.#pointer === 0) refuse(`this ${this.constructor.name} was disposed of`, "bad_handle");
    this.core.want_open();
    return this.#pointer;
  }

  get disposed() {
    return this.#pointer === 0 || this.core.closed;
  }

  /** Refuses what may not happen in a callback of a call of this object's own. */
  want_idle(what, pointers = [this.pointer]) {
    if (pointers.some((each) => this.core.in_use(each)))
      refuse(`this ${this.constructor.name} is in use: it can't be ${what} in a callback of its own`);
  }

  dispose() {
    if (this.disposed) return;
    this.want_idle("disposed of");
    const pointer = this.#pointer;
    this.#pointer = 0;
    abandoned.unregister(this);
    this.core.free(this.#free, pointer);
    this.#after?.();
  }
}
if (Symbol.dispose)
  Object.defineProperty(Owned.prototype, Symbol.dispose, {
    value() {
      this.dispose(); // whatever the class makes of it
    },
  });

/** The memory itself, which errors call what users have. */
const Allocated = class MemoryArray extends Owned {};

/**
 * An array in the module's memory: see jostle.d.ts. `owner` is kept, where the memory is another object's.
 */
export class MemoryArray {
  #owned;
  #owner;
  #where;

  constructor(core, type, length, owner, where) {
    this.core = core;
    this.type = type;
    this.length = length;
    this.#owner = owner;
    this.#where = where;
    if (owner === undefined) {
      const bytes = length * ARRAYS[type].BYTES_PER_ELEMENT;
      const pointer = core.allocate(bytes);
      core.bytes.fill(0, pointer, pointer + bytes);
      this.#owned = new Allocated(core, "_free", pointer);
    }
  }

  get pointer() {
    return this.#owner === undefined ? this.#owned.pointer : this.#where(this.#owner);
  }

  get view() {
    return this.core.view(this.type, this.pointer, this.length);
  }

  get disposed() {
    return (this.#owned ?? this.#owner).disposed;
  }

  dispose() {
    this.#owned?.dispose(); // another's memory is freed with its owner
  }
}
if (Symbol.dispose)
  Object.defineProperty(MemoryArray.prototype, Symbol.dispose, {
    value() {
      this.dispose(); // whatever the class makes of it
    },
  });

/** Memory for the arguments of a call: taken in order, given back all at once, kept for the next call. */
class Scratch {
  #blocks = []; // of { pointer, size }
  #block = 0;
  #used = 0;

  constructor(core) {
    this.core = core;
  }

  take(size) {
    const bytes = Math.ceil(size / 16) * 16;
    while (this.#block < this.#blocks.length) {
      const block = this.#blocks[this.#block];
      if (this.#used + bytes <= block.size) {
        this.#used += bytes;
        return block.pointer + this.#used - bytes;
      }
      ++this.#block;
      this.#used = 0;
    }
    const room = Math.max(bytes, 65536);
    this.#blocks.push({ pointer: this.core.allocate(room), size: room });
    this.#used = bytes;
    return this.#blocks.at(-1).pointer;
  }

  mark() {
    return { block: this.#block, used: this.#used };
  }

  release({ block, used }) {
    this.#block = block;
    this.#used = used;
    if (block !== 0 || used !== 0 || this.#blocks.length < 2) return;
    // One block for what several were needed for: the next such call finds it there.
    const size = this.#blocks.reduce((sum, each) => sum + each.size, 0);
    for (const each of this.#blocks) this.core.module._free(each.pointer);
    this.#blocks = [];
    const pointer = this.core.module._malloc(size);
    if (pointer !== 0) this.#blocks.push({ pointer: pointer >>> 0, size });
  }
}

export class Core {
  #buffer = null;
  #functions = new Map();
  #next_function = 1;
  #spare_results = [];
  #thrown; // by a callback: { error }
  #running = []; // the calls that haven't returned: what each was given first, which is its object

  constructor(module, memory, threads) {
    this.module = module;
    this.memory = memory;
    this.closed = false;
    this.scratch = new Scratch(this);
    this.#refresh();
    this.error = this.allocate(C.jostle_error.sizeof);
    this.threads = threads;
    module.callbacks = this.#callbacks();
    this.serial = this.make("jostle_executor_serial");
    this.executor = threads === 1 ? this.serial : this.make("jostle_executor_threads", threads);
  }

  /** Ends the threads. Nothing of the module's can be used afterwards. */
  close() {
    if (this.closed) return;
    if (this.#running.length !== 0)
      refuse("this module is in use: it can't be disposed of in a callback of its own");
    this.closed = true;
    this.module.PThread?.terminateAllThreads();
    this.module = this.memory = undefined;
  }

  // --- Memory ---

  #refresh() {
    this.#buffer = this.memory.buffer;
    this.bytes_ = new Uint8Array(this.#buffer);
    this.data_ = new DataView(this.#buffer);
  }
  /** All of memory, as it is now: when it grows, views of before have no elements any more. */
  get bytes() {
    if (this.#buffer !== this.memory.buffer) this.#refresh();
    return this.bytes_;
  }
  get data() {
    if (this.#buffer !== this.memory.buffer) this.#refresh();
    return this.data_;
  }
  view(type, pointer, length) {
    return new ARRAYS[type](this.memory.buffer, pointer, length);
  }
  /** Numbers of 64 bits, `step` bytes apart, as a new array: exact up to 2^53, and so are all ids. */
  numbers(pointer, length, step = 8) {
    const words = this.view("uint32", pointer, (step / 4) * length), all = new Float64Array(length);
    for (let i = 0, at = 0; i < length; ++i, at += step / 4) all[i] = words[at] + 2 ** 32 * words[at + 1];
    return all;
  }
  u32(pointer) {
    return this.data.getUint32(pointer, true);
  }
  u64(pointer) {
    return Number(this.data.getBigUint64(pointer, true));
  }
  f64(pointer) {
    return this.data.getFloat64(pointer, true);
  }
  text(pointer, size) {
    return decoder.decode(this.bytes.slice(pointer, pointer + size)); // a shared array can't be decoded
  }
  string(pointer) {
    return this.text(pointer, this.bytes.indexOf(0, pointer) - pointer);
  }

  /** Refuses what needs a module that was disposed of. */
  want_open() {
    if (this.closed) refuse("the module that this belongs to was disposed of", "bad_handle");
  }
  allocate(size) {
    this.want_open();
    const pointer = size < 2 ** 31 ? this.module._malloc(Math.max(size, 1)) >>> 0 : 0;
    if (pointer === 0) refuse(`out of memory: ${size} bytes more were refused`, "out_of_memory");
    return pointer;
  }
  free(name, pointer) {
    if (this.closed) return;
    if (name === "_free" || name.startsWith("_jostle_js_")) this.module[name](pointer);
    else this.module[name](pointer, 0);
  }

  // --- Calls ---

  /** Runs a call with scratch memory of its own. */
  within(inside) {
    this.want_open();
    const mark = this.scratch.mark();
    try {
      return inside();
    } finally {
      this.scratch.release(mark);
    }
  }

  /** Calls a function that returns a status; its last parameter is the error. Throws what went wrong. */
  call(name, ...parameters) {
    const called = this.module["_" + name];
    if (called === undefined) {
      const more = this.module._jostle_surface_new === undefined ? "alone" : "and surfaces alone";
      refuse(`this module has pairs ${more}: load it without \`only\``);
    }
    if (this.#running.length === MOST_CALLS)
      refuse(`calls in callbacks of calls are ${MOST_CALLS} deep: more don't fit on the module's stack`);
    let status;
    this.#running.push(parameters[0]);
    try {
      status = called(...parameters, this.error);
    } finally {
      this.#running.pop();
    }
    if (status !== 0) this.fail(status);
  }
  /** Whether a call of the object at this place hasn't returned: then this is in a callback of it. */
  in_use(pointer) {
    return this.#running.includes(pointer);
  }

  /** The new object that a function hands out. */
  make(name, ...parameters) {
    return this.within(() => {
      const out = this.scratch.take(8);
      this.call(name, ...parameters, out);
      return this.u32(out);
    });
  }

  /** Throws what went wrong in a call that returned this status. */
  fail(status) {
    if (this.#thrown) {
      const { error } = this.#thrown;
      this.#thrown = undefined;
      throw error;
    }
    const index = this.data.getBigUint64(this.error + C.jostle_error.index, true);
    throw new JostleError(
      this.string(this.error + C.jostle_error.message),
      C.jostle_status[status] ?? `status ${status}`,
      index === NONE ? undefined : Number(index),
    );
  }

  // --- Callbacks ---

  #callbacks() {
    const guarded = (inside) => {
      try {
        return inside();
      } catch (error) {
        this.#thrown ??= { error };
        return -1;
      }
    };
    const of = (number) => this.#functions.get(number).deref();
    const at_once = (said) => {
      if (typeof said?.then === "function") refuse("a callback returned a promise: it must answer at once");
      return said;
    };
    const truth = (said) => (at_once(said) ? 1 : 0);
    return {
      acceptPair: (number, a, b) => guarded(() => truth(of(number)(a >>> 0, b >>> 0))),
      acceptScenePair: (number, scene, a, b) =>
        guarded(() => truth(of(number)(scene >>> 0, a >>> 0, b >>> 0))),
      takePairs: (number, pairs, count) =>
        guarded(() => (at_once(of(number)(this.view("uint32", pairs >>> 0, 2 * count))) === false ? 0 : 1)),
      acceptAnswer: (number, query, id) =>
        guarded(() => truth(of(number)(query >>> 0, Number(id)))),
      visitAnswer: (number, id, at, bound) =>
        guarded(() => {
          const said = at_once(of(number)(Number(id), at));
          if (Number.isNaN(said)) refuse("visit returned NaN: it must be a distance, true or false");
          // Regions have no order, and so no bound.
          if (typeof said === "number" && bound !== 0)
            this.data.setFloat64(bound >>> 0, Math.min(said, this.f64(bound >>> 0)), true);
          return said === false ? 0 : 1;
        }),
      acceptObjects: (number, a, b) =>
        guarded(() => truth(of(number)(Number(a), Number(b)))),
    };
  }
  /**
   * A number by which the module calls a function, until it is forgotten. A `weak` one must be held by whose
   * calls ask it: it may know that object, which would never be collected if it were held here.
   */
  remember(given, weak = false) {
    if (typeof given !== "function") refuse(`${describe(given)} is no function`);
    const number = this.#next_function++;
    this.#functions.set(number, weak ? new WeakRef(given) : { deref: () => given });
    return number;
  }
  forget(number) {
    this.#functions.delete(number);
  }

  // --- Arguments ---

  /** Copies an array into scratch memory, or finds it in the module's. */
  place(given, what, types) {
    if (given instanceof MemoryArray) {
      if (given.core !== this) refuse(`${what} lies in the memory of another module`);
      if (!types.includes(given.type))
        refuse(`${what} has numbers of type ${given.type}: it must be ${types.join(" or ")}`);
      return { pointer: given.pointer, length: given.length, type: given.type };
    }
    const type = types.find((each) => given instanceof ARRAYS[each]);
    if (type === undefined)
      refuse(
        `${what} is ${describe(given)}: it must be ${types.map((each) => ARRAYS[each].name).join(" or ")}`,
      );
    refuse_detached(given, what);
    if (given.buffer === this.memory.buffer) return { pointer: given.byteOffset, length: given.length, type };
    const pointer = this.scratch.take(given.byteLength);
    this.view(type, pointer, given.length).set(given);
    return { pointer, length: given.length, type };
  }
  /** Rows of `width` numbers each. */
  rows(given, what, width, type) {
    const placed = this.place(given, what, type === undefined ? ["float32", "float64"] : [type]);
    if (placed.length % width !== 0)
      refuse(`${what} has ${placed.length} numbers: it must be a multiple of ${width}`, "size_mismatch");
    return { ...placed, count: placed.length / width };
  }
  integers(given, what) {
    return this.place(given, what, ["uint32"]);
  }
  /** Ids of a world's objects, or other whole numbers, as C's of 64 bits. */
  ids(given, what = "ids") {
    const count = wanted_ids(given, what).length, pointer = this.scratch.take(8 * count);
    const words = this.view("uint32", pointer, 2 * count);
    for (let i = 0; i < count; ++i) {
      words[2 * i] = given[i]; // the lower 32 bits
      words[2 * i + 1] = given[i] / 2 ** 32;
    }
    return { pointer, count };
  }
  /** All 64 bits of a caller's own numbers. */
  wide(given, what) {
    if (!(given instanceof BigUint64Array))
      refuse(`${what} is ${describe(given)}: it must be a BigUint64Array`);
    refuse_detached(given, what);
    const pointer = this.scratch.take(given.byteLength);
    new BigUint64Array(this.memory.buffer, pointer, given.length).set(given);
    return { pointer, count: given.length };
  }
  /** Doubles from a list of numbers, as many as there are dimensions. */
  doubles(given, what) {
    const all = numbers(given, what, 2, 3);
    return { pointer: this.place(all, what, ["float64"]).pointer, count: all.length };
  }
  utf8(text) {
    const bytes = encoder.encode(typeof text === "string" ? text : describe(text));
    const pointer = this.scratch.take(bytes.length);
    this.bytes.set(bytes, pointer);
    return { pointer, size: bytes.length };
  }
  /** A struct of zeros, with its size where it begins with that. */
  struct(layout) {
    const pointer = this.scratch.take(layout.sizeof);
    this.bytes.fill(0, pointer, pointer + layout.sizeof);
    if (layout.struct_size !== undefined) this.data.setBigUint64(pointer, BigInt(layout.sizeof), true);
    return pointer;
  }
  options(executor = this.executor) {
    const options = this.struct(C.jostle_options);
    this.data.setUint32(options + C.jostle_options.executor, executor, true);
    return options;
  }
  set_values(at, values, size = 4) {
    const data = this.data;
    data.setUint32(at + C.jostle_values.data, values.pointer, true);
    data.setBigUint64(at + C.jostle_values.count, BigInt(values.count ?? values.length), true);
    data.setBigInt64(at + C.jostle_values.stride, BigInt(values.stride ?? size), true);
  }
  /** A jostle_values for rows of `width` numbers. */
  values(rows, width) {
    const at = this.struct(C.jostle_values);
    this.set_values(at, { ...rows, stride: width * size_of(rows.type) });
    return at;
  }
  /** A jostle_boxes for packed boxes. */
  boxes(rows, dim) {
    const at = this.struct(C.jostle_boxes);
    const size = size_of(rows.type);
    for (let d = 0; d < dim; ++d) {
      this.data.setUint32(at + C.jostle_boxes.lo + 4 * d, rows.pointer + d * size, true);
      this.data.setUint32(at + C.jostle_boxes.hi + 4 * d, rows.pointer + (dim + d) * size, true);
    }
    this.data.setBigUint64(at + C.jostle_boxes.count, BigInt(rows.count), true);
    this.data.setBigInt64(at + C.jostle_boxes.stride, BigInt(2 * dim * size), true);
    return at;
  }
  /** A jostle_blocks of one block of pairs. */
  pairs(given, what = "pairs") {
    const placed = this.integers(given, what);
    if (placed.length % 2 !== 0)
      refuse(`${what} has ${placed.length} numbers: it must be an even number`, "size_mismatch");
    const block = this.struct(C.jostle_block);
    this.data.setUint32(block + C.jostle_block.items, placed.pointer, true);
    this.data.setBigUint64(block + C.jostle_block.count, BigInt(placed.length / 2), true);
    const blocks = this.struct(C.jostle_blocks);
    this.data.setUint32(blocks + C.jostle_blocks.blocks, block, true);
    for (const [member, value] of [
      ["block_count", 1n],
      ["count", BigInt(placed.length / 2)],
      ["item_size", 8n],
    ])
      this.data.setBigUint64(blocks + C.jostle_blocks[member], value, true);
    return { blocks, count: placed.length / 2 };
  }

  /** Names the numbers of the box that an error is about. */
  with_values(sets, dim, inside) {
    try {
      return inside();
    } catch (error) {
      if (
        !(error instanceof JostleError) ||
        (error.status !== "nan_coordinate" && error.status !== "inverted_box")
      )
        throw error;
      for (const rows of sets) {
        if (error.index >= rows.count) continue;
        const box = Array.from(
          this.view(rows.type, rows.pointer + error.index * 2 * dim * size_of(rows.type), 2 * dim),
        );
        if (box.every((bound, i) => i >= dim || bound <= box[dim + i])) continue; // it is the other set's
        error.value = box;
        break;
      }
      throw error;
    }
  }

  // --- Results ---

  /** A results handle for the duration of a call. */
  with_results(inside) {
    return this.within(() => {
      const results = this.#spare_results.pop() ?? this.make("jostle_results_new", 0);
      try {
        return inside(results);
      } finally {
        this.#spare_results.push(results);
      }
    });
  }
  /** Where the items of each block lie, and how many they are. */
  *blocks_at(blocks) {
    const table = this.u32(blocks + C.jostle_blocks.blocks);
    for (let b = 0; b < this.u64(blocks + C.jostle_blocks.block_count); ++b) {
      const block = table + b * C.jostle_block.sizeof;
      yield {
        pointer: this.u32(block + C.jostle_block.items),
        count: this.u64(block + C.jostle_block.count),
      };
    }
  }
  /** All pairs of blocks as one new array. */
  copy_pairs(blocks) {
    const all = new Uint32Array(2 * this.u64(blocks + C.jostle_blocks.count));
    let at = 0;
    for (const { pointer, count } of this.blocks_at(blocks)) {
      all.set(this.view("uint32", pointer, 2 * count), at);
      at += 2 * count;
    }
    return all;
  }
  pairs_of_results(results) {
    const blocks = this.scratch.take(C.jostle_blocks.sizeof);
    this.call("jostle_results_blocks", results, blocks);
    return this.copy_pairs(blocks);
  }
  bytes_of_results(results) {
    const out = this.scratch.take(16);
    this.call("jostle_results_bytes", results, out, out + 8);
    const pointer = this.u32(out);
    return this.bytes.slice(pointer, pointer + this.u64(out + 8));
  }
  /** The lists of a result; `at` where answers have an order. */
  lists_of_results(results, ordered) {
    const lists = this.scratch.take(C.jostle_lists.sizeof);
    this.call("jostle_results_lists", results, lists);
    const queries = this.u64(lists + C.jostle_lists.queries),
      count = this.u64(lists + C.jostle_lists.count);
    const numbers = (member, length) => this.numbers(this.u32(lists + C.jostle_lists[member]), length);
    const at = this.u32(lists + C.jostle_lists.at), more = this.u32(lists + C.jostle_lists.more);
    return {
      first: numbers("first", queries + 1),
      ids: numbers("ids", count),
      at: ordered ? this.view("float64", at, count).slice() : undefined,
      more: more === 0 ? new Uint8Array(queries) : this.bytes.slice(more, more + queries),
    };
  }
  /**
   * Reads the members of a struct of numbers, under JavaScript's names: those that begin with ms_ or us_ are
   * doubles.
   */
  read_stats(layout, pointer) {
    const stats = {};
    for (const [member, offset] of Object.entries(layout)) {
      if (member === "sizeof" || member === "struct_size") continue;
      const name = member.replace(/_(\w)/g, (_, letter) => letter.toUpperCase());
      stats[name] = /^[mu]s_/.test(member) ? this.f64(pointer + offset) : this.u64(pointer + offset);
    }
    return stats;
  }
}

export function size_of(type) {
  return type === "float64" ? 8 : 4;
}

/** jostle_space */
export function space_of(dim, type) {
  if (dim !== 2 && dim !== 3) refuse(`dim is ${describe(dim)}: it must be 2 or 3`);
  if (!(type in FLOATS)) refuse(`type is ${describe(type)}: it must be "float32" or "float64"`);
  return (dim === 3 ? 2 : 1) + (type === "float64" ? 2 : 0);
}
export function new_floats(type, length) {
  return new FLOATS[type](length);
}

export function type_of(given) {
  if (given instanceof MemoryArray) return given.type;
  return given instanceof Float64Array ? "float64" : "float32";
}

/** What a wrong argument is, in a few words. */
export function describe(given) {
  if (
    given === null ||
    given === undefined ||
    typeof given === "number" ||
    typeof given === "boolean" ||
    typeof given === "bigint"
  )
    return String(given);
  if (typeof given === "string") return JSON.stringify(given.slice(0, 40));
  return `a ${given.constructor?.name ?? typeof given}`;
}

const none_chosen = Object.freeze({});

/**
 * What a caller chose, undefined where that is null: many programs have null for what they leave out. What is
 * no object, or an array, is refused: all options would be taken for left out.
 */
export function options_of(given, what = "options") {
  if (given === undefined || given === null) return none_chosen;
  if (typeof given !== "object" || typeof given.length === "number")
    refuse(`${what} are ${describe(given)}: they must be an object`);
  // A target of its own: a proxy of frozen options would have to say null.
  return new Proxy(none_chosen, { get: (_, name) => given[name] ?? undefined });
}

export function number(given, what) {
  if (typeof given !== "number") refuse(`${what} is ${describe(given)}: it must be a number`);
  return given;
}

/** What a caller has as an array of any kind. */
export function array_like(given, what) {
  if (given === null || typeof given !== "object" || !Number.isInteger(given.length) || given.length < 0)
    refuse(`${what} is ${describe(given)}: it must be an array of numbers`);
  return given;
}

/** From `least` to `most` numbers of the caller's, as doubles. */
export function numbers(given, what, least, most = least) {
  const { length } = array_like(given, what);
  if (length < least || length > most)
    refuse(
      `${what} has ${length} numbers: it must have ${least === most ? least : `${least} or ${most}`}`,
      "size_mismatch",
    );
  return Float64Array.from({ length }, (_, i) => number(given[i], `${what}[${i}]`));
}

/** Whole numbers of the caller's, such as ids of a world's objects. */
export function wanted_ids(given, what = "ids") {
  if (!(given instanceof Float64Array) && !Array.isArray(given))
    refuse(`${what} is ${describe(given)}: it must be a Float64Array or an array of numbers`);
  refuse_detached(given, what);
  for (let i = 0; i < given.length; ++i)
    if (!Number.isSafeInteger(given[i]) || given[i] < 0)
      refuse(
        `${what}[${i}] is ${describe(given[i])}: it must be a whole number from 0 to 2^53 - 1`,
        "invalid_argument",
        i,
      );
  return given;
}

/** A count or a number of the caller's that must be whole. */
export function whole(given, what, least = 0, most = 2 ** 32 - 1) {
  if (!Number.isInteger(given) || given < least || given > most)
    refuse(`${what} is ${describe(given)}: it must be a whole number from ${least} to ${most}`);
  return given;
}

/** Refuses an array that is empty because its memory is gone. */
export function refuse_detached(given, what) {
  if (given.length !== 0) return;
  try {
    new Uint8Array(given.buffer);
  } catch {
    refuse(
      `${what} is a view of memory that has grown since, or was transferred, and is empty now: take it again`,
    );
  }
}
