// SPDX-License-Identifier: MIT
import { Owned, options_of, space_of } from "./core.js";
import { refuse } from "./error.js";
import { Asked } from "./queries.js";
import * as C from "./structs.js";

const NONE = 2 ** 64; // what core.numbers makes of C's 2^64 - 1

function narrow_one(ids) {
  return ids.map((id) => (id === NONE ? -1 : id));
}
function narrow(ids) {
  return Uint32Array.from(ids);
}

/** Boxes that stay, and queries about them: see jostle.d.ts. */
export class BoxIndex extends Owned {
  #asked;

  constructor(core, options) {
    const { dim, type = "float32" } = options_of(options);
    const space = space_of(dim, type);
    super(
      core,
      "_jostle_free",
      core.within(() => core.make("jostle_index_new", space, core.options())),
    );
    this.dim = dim;
    this.type = type;
    this.#asked = new Asked(this, dim, type, {
      ids: narrow,
      one: narrow_one,
      none: NONE,
    });
  }

  #put(name, boxes, ids) {
    const core = this.core;
    this.want_idle("changed");
    core.within(() => {
      const rows = core.rows(boxes, "boxes", 2 * this.dim, this.type);
      const of = ids === undefined ? { pointer: 0, length: rows.count } : core.integers(ids, "ids");
      if (of.length !== rows.count)
        refuse(`there are ${of.length} ids and ${rows.count} boxes`, "size_mismatch");
      core.with_values([rows], this.dim, () =>
        core.call(name, this.pointer, of.pointer, core.boxes(rows, this.dim)),
      );
    });
  }
  build(boxes, ids) {
    this.#put("jostle_index_build", boxes, ids);
  }
  insert(boxes, ids) {
    this.#put("jostle_index_insert", boxes, ids);
  }
  move(boxes, ids) {
    this.#put("jostle_index_move", boxes, ids);
  }
  erase(ids) {
    this.want_idle("changed");
    this.core.within(() => {
      const of = this.core.integers(ids, "ids");
      this.core.call("jostle_index_erase", this.pointer, of.pointer, BigInt(of.length));
    });
  }
  clear() {
    this.want_idle("changed");
    this.core.call("jostle_clear", this.pointer);
  }
  releaseMemory() {
    this.want_idle("changed");
    this.core.call("jostle_release_memory", this.pointer);
  }
  get size() {
    return this.core.within(() => {
      const out = this.core.scratch.take(8);
      this.core.call("jostle_size", this.pointer, out);
      return this.core.u64(out);
    });
  }
  contains(ids) {
    const core = this.core;
    return core.within(() => {
      const of = core.integers(ids, "ids"), out = core.scratch.take(of.length);
      core.call("jostle_index_contains", this.pointer, of.pointer, BigInt(of.length), out);
      return core.bytes.slice(out, out + of.length);
    });
  }
  boxes(ids) {
    const core = this.core;
    return core.within(() => {
      const of = core.integers(ids, "ids");
      const numbers = 2 * this.dim * of.length;
      const out = core.scratch.take(numbers * (this.type === "float64" ? 8 : 4));
      core.call("jostle_index_boxes", this.pointer, of.pointer, BigInt(of.length), out);
      return core.view(this.type, out, numbers).slice();
    });
  }
  join(boxes) {
    const core = this.core;
    return core.with_results((results) => {
      const rows = core.rows(boxes, "boxes", 2 * this.dim, this.type);
      core.with_values([rows], this.dim, () =>
        core.call("jostle_query_join", this.pointer, core.boxes(rows, this.dim), 0, results),
      );
      return core.pairs_of_results(results);
    });
  }
  get stats() {
    const core = this.core;
    return core.within(() => {
      const stats = core.struct(C.jostle_index_stats);
      core.call("jostle_index_stats_read", this.pointer, stats);
      return core.read_stats(C.jostle_index_stats, stats);
    });
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
}
