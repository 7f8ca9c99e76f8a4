// SPDX-License-Identifier: MIT
import { Owned, describe, number, options_of, refuse_detached, size_of, space_of, whole } from "./core.js";
import { refuse } from "./error.js";
import { Asked, query_filter } from "./queries.js";
import * as C from "./structs.js";

const same = (ids) => ids;

export const endReasons = Object.freeze(Object.values(C.jostle_end_reason));

/** Objects that live, move and rest, and the pairs between them: see jostle.d.ts. */
export class World extends Owned {
  #asked;
  #accept; // { number, worlds }: shared with the worlds that were forked from this one
  #function; // which these ask, and each of them holds

  constructor(core, given, forked = undefined) {
    const options = options_of(given);
    const { dim, type = "float32" } = options;
    const space = space_of(dim, type);
    let { pointer, accept, asked } = forked ?? {};
    if (forked === undefined) {
      asked = options.accept;
      accept = asked === undefined ? undefined : { number: core.remember(asked, true), worlds: 0 };
      try {
        pointer = make_world(core, space, options, accept);
      } catch (error) {
        if (accept !== undefined) core.forget(accept.number);
        throw error;
      }
    }
    if (accept !== undefined) ++accept.worlds;
    super(
      core,
      "_jostle_free",
      pointer,
      accept && (() => --accept.worlds === 0 && core.forget(accept.number)),
    );
    this.dim = dim;
    this.type = type;
    this.#accept = accept;
    this.#function = asked;
    this.#asked = new Asked(this, dim, type, { ids: same, one: same, none: 0 });
  }

  dispose() {
    super.dispose();
    this.#function = undefined;
  }

  // --- Commands ---

  #rows(given, what, width) {
    return this.core.rows(given, what, width, this.type);
  }
  /** Ids, and as many rows. */
  #with(ids, given, what, width) {
    const of = this.core.ids(ids), rows = this.#rows(given, what, width);
    if (of.count !== rows.count)
      refuse(`there are ${of.count} ids and ${rows.count} ${what}`, "size_mismatch");
    return [of, rows];
  }

  add(boxes, given) {
    const core = this.core;
    return core.within(() => {
      const rows = this.#rows(boxes, "boxes", 2 * this.dim);
      const each = Array.isArray(given);
      if (each && given.length !== rows.count)
        refuse(`there are ${rows.count} boxes and ${given.length} options`, "size_mismatch");
      const all = each ? given : [given], size = C.jostle_object_options.sizeof;
      const made = core.scratch.take(size * all.length),
        filters = core.scratch.take(C.jostle_object_filter.sizeof * all.length);
      core.bytes.fill(0, made, made + size * all.length);
      all.forEach((of, i) => {
        const filter = filters + i * C.jostle_object_filter.sizeof;
        write_options(core, made + i * size, filter, of, each ? `options[${i}]` : undefined);
      });
      if (each) core.data.setBigUint64(made + C.jostle_object_options.count, BigInt(all.length), true);
      const ids = core.scratch.take(8 * rows.count);
      core.with_values([rows], this.dim, () =>
        core.call(
          "jostle_world_add",
          this.pointer,
          core.boxes(rows, this.dim),
          all.length === 0 ? 0 : made,
          ids,
        ),
      );
      return core.numbers(ids, rows.count);
    });
  }
  remove(ids) {
    this.core.within(() => {
      const of = this.core.ids(ids);
      this.core.call("jostle_world_remove", this.pointer, of.pointer, BigInt(of.count));
    });
  }
  move(ids, boxes, options) {
    const { displacements, sequence } = options_of(options);
    const core = this.core;
    core.within(() => {
      const [of, rows] = this.#with(ids, boxes, "boxes", 2 * this.dim);
      const by =
        displacements === undefined
          ? { pointer: 0, count: of.count }
          : this.#rows(displacements, "displacements", this.dim);
      if (by.count !== of.count)
        refuse(`there are ${of.count} ids and ${by.count} displacements`, "size_mismatch");
      core.with_values([rows], this.dim, () =>
        core.call(
          "jostle_world_move",
          this.pointer,
          of.pointer,
          core.boxes(rows, this.dim),
          by.pointer,
          order(sequence),
        ),
      );
    });
  }
  resize(ids, sizes, options) {
    const { sequence } = options_of(options);
    this.core.within(() => {
      const [of, rows] = this.#with(ids, sizes, "sizes", this.dim);
      this.core.call(
        "jostle_world_resize",
        this.pointer,
        of.pointer,
        BigInt(of.count),
        rows.pointer,
        order(sequence),
      );
    });
  }
  setFilter(ids, filter, options) {
    const { sequence } = options_of(options);
    const core = this.core;
    core.within(() => {
      const of = core.ids(ids),
        size = C.jostle_object_filter.sizeof,
        filters = core.scratch.take(size * of.count);
      if (filter === null || typeof filter !== "object" || typeof filter.length === "number")
        refuse(`filter is ${describe(filter)}: it must be an object, the same for all ids`);
      const chosen = options_of(filter);
      for (let i = 0; i < of.count; ++i) write_filter(core, filters + i * size, chosen);
      core.call(
        "jostle_world_set_filter",
        this.pointer,
        of.pointer,
        BigInt(of.count),
        filters,
        order(sequence),
      );
    });
  }
  /** One value for all objects, or an array with one for each. */
  #each(ids, given, Array, what) {
    const of = this.core.ids(ids);
    const values = given instanceof Array ? given : new Array(of.count).fill(given);
    if (values.length !== of.count)
      refuse(`there are ${of.count} ids and ${values.length} ${what}`, "size_mismatch");
    const pointer = this.core.scratch.take(values.byteLength);
    this.core.bytes.set(new Uint8Array(values.buffer, values.byteOffset, values.byteLength), pointer);
    return [of, pointer];
  }
  setMargin(ids, margin, options) {
    const { sequence } = options_of(options);
    this.core.within(() => {
      if (!(margin instanceof Float64Array)) number(margin, "margin");
      const [of, margins] = this.#each(ids, margin, Float64Array, "margins");
      this.core.call(
        "jostle_world_set_margin",
        this.pointer,
        of.pointer,
        BigInt(of.count),
        margins,
        order(sequence),
      );
    });
  }
  setEnabled(ids, enabled, options) {
    const { sequence } = options_of(options);
    this.core.within(() => {
      const given = enabled instanceof Uint8Array ? enabled : flag(enabled, "enabled") ? 1 : 0;
      const [of, each] = this.#each(ids, given, Uint8Array, "values");
      this.core.call(
        "jostle_world_set_enabled",
        this.pointer,
        of.pointer,
        BigInt(of.count),
        each,
        order(sequence),
      );
    });
  }
  setUserData(ids, data) {
    this.core.within(() => {
      const of = this.core.ids(ids), values = this.core.wide(data, "data");
      if (of.count !== values.count)
        refuse(`there are ${of.count} ids and ${values.count} values`, "size_mismatch");
      this.core.call(
        "jostle_world_set_user_data",
        this.pointer,
        of.pointer,
        BigInt(of.count),
        values.pointer,
      );
    });
  }
  userData(ids) {
    return this.core.within(() => {
      const of = this.core.ids(ids), out = this.core.scratch.take(8 * of.count);
      this.core.call("jostle_world_user_data", this.pointer, of.pointer, BigInt(of.count), out);
      return new BigUint64Array(this.core.memory.buffer, out, of.count).slice();
    });
  }
  reportAgain(ids, others) {
    this.core.within(() => {
      const of = this.core.ids(ids),
        with_ = others === undefined ? { pointer: 0, count: of.count } : this.core.ids(others, "others");
      if (of.count !== with_.count)
        refuse(`there are ${of.count} ids and ${with_.count} others`, "size_mismatch");
      this.core.call("jostle_world_report_again", this.pointer, of.pointer, with_.pointer, BigInt(of.count));
    });
  }

  update(ids, boxes) {
    const core = this.core;
    if (ids === undefined) {
      if (boxes !== undefined) refuse("boxes came without ids: give both, or none");
      core.call("jostle_world_update", this.pointer);
      return;
    }
    core.within(() => {
      const [of, rows] = this.#with(ids, boxes, "boxes", 2 * this.dim);
      core.with_values([rows], this.dim, () =>
        core.call("jostle_world_update_moves", this.pointer, of.pointer, core.boxes(rows, this.dim)));
    });
  }
  apply() {
    this.core.call("jostle_world_apply", this.pointer);
  }

  // --- Pairs ---

  /** The array that a function tells: its address and length. */
  #list(name) {
    const core = this.core;
    return core.within(() => {
      const out = core.scratch.take(16);
      core.call(name, this.pointer, out, out + 8);
      return [core.u32(out), core.u64(out + 8)];
    });
  }
  began() {
    const [pointer, count] = this.#list("jostle_world_began");
    return this.core.numbers(pointer, 2 * count);
  }
  ended() {
    const [pointer, count] = this.#list("jostle_world_ended");
    const pairs = new Float64Array(2 * count), reasons = new Uint8Array(count);
    const rows = this.core.numbers(pointer, 3 * count); // a, b, reason
    for (let i = 0; i < count; ++i) {
      pairs[2 * i] = rows[3 * i];
      pairs[2 * i + 1] = rows[3 * i + 1];
      reasons[i] = rows[3 * i + 2];
    }
    return { pairs, reasons };
  }
  #blocks(name) {
    const core = this.core;
    return core.within(() => {
      const blocks = core.scratch.take(C.jostle_blocks.sizeof);
      core.call(name, this.pointer, blocks);
      return core.copy_pairs(blocks);
    });
  }
  persisted() {
    return this.#blocks("jostle_world_persisted");
  }
  changedPairs() {
    return this.#blocks("jostle_world_changed_pairs");
  }
  pairs() {
    const core = this.core;
    return core.with_results((results) => {
      core.call("jostle_world_pairs", this.pointer, results);
      return core.pairs_of_results(results);
    });
  }
  touching(ids) {
    const core = this.core;
    return core.with_results((results) => {
      const of = core.ids(ids);
      core.call("jostle_world_touching", this.pointer, of.pointer, BigInt(of.count), results);
      return this.#asked.answers([core.lists_of_results(results, false)]);
    });
  }
  join(boxes, given) {
    const core = this.core, options = options_of(given);
    const accept = options.accept === undefined ? undefined : core.remember(options.accept);
    try {
      return core.with_results((results) => {
        const rows = this.#rows(boxes, "boxes", 2 * this.dim);
        if (accept !== undefined && core.threads > 1) refuse("join with accept needs a module of one thread");
        core.with_values([rows], this.dim, () =>
          core.call(
            "jostle_query_join",
            this.pointer,
            core.boxes(rows, this.dim),
            query_filter(core, options, accept),
            results,
          ),
        );
        return core.pairs_of_results(results);
      });
    } finally {
      if (accept !== undefined) core.forget(accept);
    }
  }

  first(queries, options) {
    return this.#asked.first(queries, options);
  }
  all(queries, options) {
    return this.#asked.all(queries, options);
  }
  visit(query, visit, options) {
    return this.#asked.visit(query, visit, options);
  }
  any(queries, options) {
    return this.#asked.any(queries, options);
  }
  count(queries, options) {
    return this.#asked.count(queries, options);
  }

  // --- Objects ---

  #number(name, kind) {
    return this.core.within(() => {
      const out = this.core.scratch.take(8);
      this.core.call(name, this.pointer, out);
      return this.core[kind](out);
    });
  }
  get size() {
    return this.#number("jostle_size", "u64");
  }
  get indexEnd() {
    return this.#number("jostle_world_index_end", "u32");
  }
  /** What a function tells of each object: `size` bytes. */
  #of(name, ids, size) {
    const of = this.core.ids(ids), out = this.core.scratch.take(size * of.count);
    this.core.call(name, this.pointer, of.pointer, BigInt(of.count), out);
    return [out, of.count];
  }
  contains(ids) {
    return this.core.within(() => {
      const [out, count] = this.#of("jostle_world_contains", ids, 1);
      return this.core.bytes.slice(out, out + count);
    });
  }
  enabled(ids) {
    return this.core.within(() => {
      const [out, count] = this.#of("jostle_world_enabled", ids, 1);
      return this.core.bytes.slice(out, out + count);
    });
  }
  ids(indices) {
    const core = this.core;
    const given = indices ?? Uint32Array.from({ length: this.indexEnd }, (_, i) => i);
    const found = core.within(() => {
      const of = core.integers(given, "indices"), out = core.scratch.take(8 * of.length);
      core.call("jostle_world_ids", this.pointer, of.pointer, BigInt(of.length), out);
      return core.numbers(out, of.length);
    });
    return indices === undefined ? found.filter((id) => id !== 0) : found;
  }
  #boxes(name, ids) {
    return this.core.within(() => {
      const [out, count] = this.#of(name, ids, 2 * this.dim * size_of(this.type));
      return this.core.view(this.type, out, 2 * this.dim * count).slice();
    });
  }
  boxes(ids) {
    return this.#boxes("jostle_world_boxes", ids);
  }
  bounds(ids) {
    return this.#boxes("jostle_world_bounds", ids);
  }
  boundsOfAll() {
    const core = this.core;
    return core.within(() => {
      const any = core.scratch.take(4), box = core.scratch.take(2 * this.dim * size_of(this.type));
      core.call("jostle_query_bounds", this.pointer, any, box);
      return core.u32(any) === 0 ? undefined : core.view(this.type, box, 2 * this.dim).slice();
    });
  }
  filters(ids) {
    const { core } = this, at = C.jostle_object_filter;
    return core.within(() => {
      const [out, count] = this.#of("jostle_world_filters", ids, at.sizeof);
      return Array.from({ length: count }, (_, i) => {
        const filter = out + i * at.sizeof;
        return {
          category: core.u32(filter + at.category),
          mask: core.u32(filter + at.mask),
          owner: core.u32(filter + at.owner),
          isStatic: core.u32(filter + at.is_static) !== 0,
        };
      });
    });
  }
  margins(ids) {
    return this.core.within(() => {
      const [out, count] = this.#of("jostle_world_margins", ids, 8);
      return this.core.view("float64", out, count).slice();
    });
  }

  // --- Snapshots ---

  save() {
    return saved(this, "jostle_world_save");
  }
  restore(snapshot) {
    restore(this, "jostle_world_restore", snapshot, "the snapshot");
  }
  saveBase() {
    return saved(this, "jostle_world_save_base");
  }
  saveChanges() {
    return saved(this, "jostle_world_save_changes");
  }
  restoreChanges(changes) {
    restore(this, "jostle_world_restore_changes", changes, "the snapshot");
  }
  clear() {
    this.core.call("jostle_clear", this.pointer);
  }
  fork() {
    const pointer = this.core.make("jostle_world_fork", this.pointer);
    const forked = { pointer, accept: this.#accept, asked: this.#function };
    return new World(this.core, { dim: this.dim, type: this.type }, forked);
  }

  get stats() {
    const core = this.core;
    return core.within(() => {
      const stats = core.struct(C.jostle_world_stats);
      core.call("jostle_world_stats_read", this.pointer, stats);
      return core.read_stats(C.jostle_world_stats, stats);
    });
  }
  explain() {
    return new TextDecoder().decode(saved(this, "jostle_world_explain"));
  }
}

/** Small numbers for pairs, as long as they touch: see jostle.d.ts. */
export class PairSlots extends Owned {
  constructor(core) {
    super(core, "_jostle_free", core.make("jostle_pair_slots_new"));
  }
  update(began, ended) {
    const core = this.core;
    core.within(() => {
      const begin = id_pairs(core, began, "began");
      const finish = id_pairs(core, options_of(ended).pairs, "ended.pairs");
      const size = C.jostle_ended_pair.sizeof, rows = core.scratch.take(size * finish.count);
      for (let i = 0; i < finish.count; ++i) { // why they ended doesn't matter
        core.bytes.copyWithin(rows + size * i, finish.pointer + 16 * i, finish.pointer + 16 * (i + 1));
        core.bytes.fill(0, rows + size * i + 16, rows + size * (i + 1));
      }
      core.call(
        "jostle_pair_slots_update",
        this.pointer,
        begin.pointer,
        BigInt(begin.count),
        rows,
        BigInt(finish.count),
      );
    });
  }
  #lists() {
    const core = this.core;
    return core.within(() => {
      const out = core.scratch.take(40);
      const at = [0, 8, 16, 24, 32].map((offset) => out + offset);
      core.call("jostle_pair_slots_lists", this.pointer, ...at);
      const list = (k) => core.view("uint32", core.u32(at[k]), core.u64(at[k + 1])).slice();
      return { began: list(0), ended: list(2), end: core.u32(at[4]) };
    });
  }
  beganSlots() {
    return this.#lists().began;
  }
  endedSlots() {
    return this.#lists().ended;
  }
  get end() {
    return this.#lists().end;
  }
  slotsOf(pairs) {
    const core = this.core;
    return core.within(() => {
      const { blocks, count } = core.pairs(pairs), found = core.scratch.take(4 * count);
      const block = core.u32(blocks + C.jostle_blocks.blocks);
      const items = core.u32(block + C.jostle_block.items);
      core.call("jostle_pair_slots_find", this.pointer, items, BigInt(count), found);
      return core.view("uint32", found, count).slice();
    });
  }
  save() {
    return saved(this, "jostle_pair_slots_save");
  }
  restore(slots) {
    restore(this, "jostle_pair_slots_restore", slots, "slots");
  }
}

function id_pairs(core, given, what) {
  const { pointer, count } = core.ids(given, what);
  if (count % 2 !== 0) refuse(`${what} has ${count} ids: it must be an even number`, "size_mismatch");
  return { pointer, count: count / 2 };
}

function saved(owned, name) {
  const core = owned.core;
  return core.with_results((results) => {
    core.call(name, owned.pointer, results);
    return core.bytes_of_results(results);
  });
}
function restore(owned, name, bytes, what) {
  const core = owned.core;
  if (!(bytes instanceof Uint8Array)) refuse(`${what} is ${describe(bytes)}: it must be a Uint8Array`);
  refuse_detached(bytes, what);
  core.within(() => {
    const pointer = core.scratch.take(bytes.length);
    core.bytes.set(bytes, pointer);
    core.call(name, owned.pointer, pointer, BigInt(bytes.length));
  });
}

function make_world(core, space, options, accept) {
  return core.within(() => {
    const layers = options.layers ?? [];
    if (!Array.isArray(layers)) refuse(`layers is ${describe(layers)}: it must be an array`);
    const made = core.struct(C.jostle_world_options), common = core.options();
    const pointer = core.scratch.take(8 * layers.length);
    const { data } = core, at = C.jostle_world_options;
    data.setUint32(made + at.common, common, true);
    data.setFloat64(made + at.margin, number(options.margin ?? 0, "margin"), true);
    layers.forEach((layer, k) => {
      const { category, mask } = options_of(layer);
      data.setUint32(pointer + 8 * k, whole(category ?? 0xffffffff, `layers[${k}].category`), true);
      data.setUint32(pointer + 8 * k + 4, whole(mask ?? 0xffffffff, `layers[${k}].mask`), true);
    });
    data.setUint32(made + at.layers, pointer, true);
    data.setBigUint64(made + at.layer_count, BigInt(layers.length), true);
    if (accept !== undefined) {
      data.setUint32(made + at.accept, core.module._jostle_js_accept_objects_pointer(), true);
      data.setUint32(made + at.context, accept.number, true);
    }
    return core.make("jostle_world_new", space, made);
  });
}

function flag(given, what) {
  if (typeof given !== "boolean") refuse(`${what} is ${describe(given)}: it must be true or false`);
  return given;
}
function order(sequence = 0) {
  return whole(sequence, "sequence");
}
/** What new objects are like, into zeros. `where`: what the caller calls these options. */
function write_options(core, at, filter, given, where) {
  const options = options_of(given, where), of = where === undefined ? "" : `${where}.`;
  const to = C.jostle_object_options;
  write_filter(core, filter, options, of);
  core.data.setBigUint64(at + to.struct_size, BigInt(to.sizeof), true);
  core.data.setUint32(at + to.filter, filter, true);
  core.data.setFloat64(at + to.margin, number(options.margin ?? 0, `${of}margin`), true);
  core.data.setInt32(at + to.disabled, flag(options.enabled ?? true, `${of}enabled`) ? 0 : 1, true);
}
function write_filter(core, at, options, of = "") {
  const { category = 1, mask = 0xffffffff, owner = 0xffffffff, isStatic = false } = options;
  core.data.setUint32(at + C.jostle_object_filter.category, whole(category, `${of}category`), true);
  core.data.setUint32(at + C.jostle_object_filter.mask, whole(mask, `${of}mask`), true);
  core.data.setUint32(at + C.jostle_object_filter.owner, whole(owner, `${of}owner`), true);
  core.data.setInt32(at + C.jostle_object_filter.is_static, flag(isStatic, `${of}isStatic`) ? 1 : 0, true);
}
