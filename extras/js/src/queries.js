// SPDX-License-Identifier: MIT
// Queries of boxes and of shapes, as a BoxIndex and a World answer them.

import {
  array_like, describe, new_floats, options_of, refuse_detached, size_of, space_of, whole,
} from "./core.js";
import { cast_hits_at, distances_at } from "./details.js";
import { refuse } from "./error.js";
import { place_objects } from "./shapes.js";
import * as C from "./structs.js";

const KINDS = {
  rays: 1, sweeps: 2, boxes: 3, spheres: 4, frustums: 5, nearest: 6, nearestToBoxes: 7, shapeSweeps: 8,
  posedShapes: 9, nearestToShapes: 10,
};
const OF_BOXES = ["rays", "sweeps", "boxes", "spheres", "frustums", "nearest", "nearestToBoxes"];
const OF_SHAPES = ["rays", "shapeSweeps", "posedShapes", "nearestToShapes"];
const NEAREST = ["nearest", "nearestToBoxes", "nearestToShapes"];
const REGIONS = ["boxes", "spheres", "frustums", "posedShapes"]; // whose answers have no order
const ALL = 2n ** 64n - 1n;

function takes(call, name, of_shapes) {
  if (!(of_shapes ? OF_SHAPES : OF_BOXES).includes(name)) return false;
  if (call === "first") return !REGIONS.includes(name);
  return call === "all" || call === "visit" || !NEAREST.includes(name);
}

/** Numbers of each query of a kind in C, of which the nearest are given all but the last. */
function width_of(kind, dim) {
  return [0, 2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, 0, dim + 1, 2 * dim + 1, dim, 0, 1][kind];
}

/** Queries in the module's memory: a jostle_queries, what they are called, and how many they are. */
function place_queries(core, queries, dim, type, call, of_shapes) {
  const [name, other] =
    queries === null || typeof queries !== "object"
      ? []
      : Object.keys(KINDS).filter((each) => queries[each] !== undefined);
  if (other !== undefined) refuse(`queries are ${name} and ${other}: they must be of one kind`);
  if (name === undefined)
    refuse(
      `queries are ${describe(queries)}: they must be { rays } or { boxes } or another kind of query`,
    );
  if (!takes(call, name, of_shapes))
    refuse(
      `${name} is no query of ${call}()${of_shapes ? " with objects" : ""}: ask one of ` +
        Object.keys(KINDS).filter((each) => takes(call, each, of_shapes)).join(", "),
    );
  const kind = KINDS[name], width = width_of(kind, dim);
  const at = core.struct(C.jostle_queries);
  core.data.setInt32(at + C.jostle_queries.kind, kind, true);
  const set = (values, size) => core.set_values(at + C.jostle_queries.values, { ...values, stride: size });
  let shapes, count, none = false; // whether it asks for the 0 nearest, which C can't
  if (kind >= KINDS.shapeSweeps) {
    const given = queries[name];
    shapes = place_objects(core, given, type);
    if (shapes.dim !== dim) refuse(`the shapes are ${shapes.dim}D, and the boxes are ${dim}D`);
    count = shapes.rows.count;
    core.data.setUint32(at + C.jostle_queries.shapes, shapes.pointer, true);
    if (name === "shapeSweeps")
      set(core.rows(given.displacements, "displacements", dim, type), width * size_of(type));
  } else if (name === "frustums") {
    const frustums = place_frustums(core, queries.frustums, dim, type);
    count = frustums.count;
    set(frustums, C.jostle_frustum.sizeof);
  } else if (!NEAREST.includes(name)) {
    const rows = core.rows(queries[name], name, width, type);
    count = rows.count;
    set(rows, width * size_of(type));
  }
  if (NEAREST.includes(name)) {
    none = whole(queries.count ?? 1, "count") === 0;
    core.data.setUint32(at + C.jostle_queries.nearest, queries.count ?? 1, true);
    const most = queries.maxDistance ?? Infinity;
    if (typeof most !== "number") refuse(`maxDistance is ${describe(most)}: it must be a number`);
    const given = width - 1;
    const rows = given === 0 ? { count } : core.rows(queries[name], name, given, type);
    count = rows.count;
    const pointer = core.scratch.take(count * width * size_of(type));
    const into = core.view(type, pointer, count * width);
    const from = given === 0 ? [] : core.view(type, rows.pointer, count * given);
    for (let i = 0; i < count; ++i) {
      for (let d = 0; d < given; ++d) into[i * width + d] = from[i * given + d];
      into[i * width + given] = most;
    }
    set({ pointer, count }, width * size_of(type));
  }
  return { at, name, count, shapes, none };
}

/** Calls inside(queries) with each of them alone. */
function one_by_one(core, all, dim, inside) {
  const { at, shapes } = all, one = core.struct(C.jostle_queries);
  core.bytes.copyWithin(one, at, at + C.jostle_queries.sizeof);
  const values = one + C.jostle_queries.values;
  const first = core.u32(values + C.jostle_values.data);
  const has_values = core.u64(values + C.jostle_values.count) !== 0;
  const stride = core.u64(values + C.jostle_values.stride);
  const its_shape = shapes && core.make("jostle_shapes_new", dim);
  try {
    for (let i = 0; i < all.count; ++i) {
      if (has_values) {
        core.data.setUint32(values + C.jostle_values.data, first + i * stride, true);
        core.data.setBigUint64(values + C.jostle_values.count, 1n, true);
      }
      if (shapes !== undefined) {
        const of = core.u32(shapes.pointer + C.jostle_objects.shapes);
        core.call("jostle_clear", its_shape);
        core.call("jostle_shapes_add_from", its_shape, of, BigInt(i % shapes.length), 1n);
        core.data.setUint32(one + C.jostle_queries.shapes, shapes.alone(its_shape, i), true);
      }
      inside({ ...all, at: one, count: 1 });
    }
  } finally {
    if (its_shape !== undefined) core.module._jostle_free(its_shape, 0);
  }
}

function place_frustums(core, frustums, dim, type) {
  if (!Array.isArray(frustums))
    refuse(`frustums are ${describe(frustums)}: they must be a list of arrays of planes`);
  const pointer = core.scratch.take(C.jostle_frustum.sizeof * frustums.length);
  frustums.forEach((planes, i) => {
    const rows = core.rows(planes, `frustums[${i}]`, dim + 1, type);
    core.data.setUint32(pointer + i * C.jostle_frustum.sizeof + C.jostle_frustum.planes, rows.pointer, true);
    core.data.setBigUint64(
      pointer + i * C.jostle_frustum.sizeof + C.jostle_frustum.count,
      BigInt(rows.count),
      true,
    );
  });
  return { pointer, count: frustums.length };
}

/** A jostle_query_filter, or 0. */
export function query_filter(core, options, accept) {
  const { asker, exclude } = options;
  if (asker === undefined && exclude === undefined && accept === undefined) return 0;
  const filter = core.struct(C.jostle_query_filter);
  for (const name of ["category", "mask", "owner"])
    if (options[name] !== undefined)
      core.set_values(filter + C.jostle_query_filter[name], core.integers(options[name], name));
  if (asker !== undefined) {
    const { category = 1, mask = 0xffffffff, owner = 0xffffffff } = options_of(asker, "the options of asker");
    const at = core.scratch.take(C.jostle_asker.sizeof);
    core.data.setUint32(at + C.jostle_asker.category, whole(category, "asker.category"), true);
    core.data.setUint32(at + C.jostle_asker.mask, whole(mask, "asker.mask"), true);
    core.data.setUint32(at + C.jostle_asker.owner, whole(owner, "asker.owner"), true);
    core.data.setUint32(filter + C.jostle_query_filter.asker, at, true);
  }
  if (exclude !== undefined) {
    const at = core.scratch.take(8);
    core.data.setBigUint64(at, BigInt(whole(exclude, "exclude", 0, Number.MAX_SAFE_INTEGER)), true);
    core.data.setUint32(filter + C.jostle_query_filter.exclude, at, true);
  }
  if (accept !== undefined) {
    core.data.setUint32(
      filter + C.jostle_query_filter.accept,
      core.module._jostle_js_accept_answer_pointer(),
      true,
    );
    core.data.setUint32(filter + C.jostle_query_filter.context, accept, true);
  }
  return filter;
}

/** What an index and a world answer alike. */
export class Asked {
  constructor(owner, dim, type, { ids, one, none }) {
    this.owner = owner; // the index or world
    this.dim = dim;
    this.type = type;
    this.narrow = ids; // from ids as core.numbers gives them to those that the caller sees
    this.one = one; // the same where there may be none
    this.none = none; // the id of no answer
  }

  /**
   * Calls inside(queries, objects, filter) with all queries at once or, where a callback is asked and there
   * are threads that it must not be called on, with one after the other.
   */
  ask(call, given, chosen, inside) {
    const core = this.owner.core, options = options_of(chosen);
    return core.within(() => {
      const { accept, objects } = options;
      const of_shapes = objects !== undefined;
      const queries = place_queries(core, given, this.dim, this.type, call, of_shapes);
      const target = of_shapes ? place_objects(core, objects, this.type) : { pointer: 0, dim: this.dim };
      if (target.dim !== this.dim) refuse(`the shapes are ${target.dim}D, and the boxes are ${this.dim}D`);
      if (call === "visit" && queries.count !== 1)
        refuse(`there are ${queries.count} queries: visit() takes one`, "size_mismatch");
      let first = 0;
      if (accept !== undefined && typeof accept !== "function")
        refuse(`accept is ${describe(accept)}: it must be a function`);
      const number = accept && core.remember((query, id) => accept(first + query, id));
      try {
        const filter = query_filter(core, options, number);
        if (accept === undefined || core.threads === 1 || queries.count === 0)
          return [inside(queries, target.pointer, filter)];
        const parts = [];
        one_by_one(core, queries, this.dim, (one) => {
          parts.push(inside(one, target.pointer, filter));
          ++first;
        });
        return parts;
      } finally {
        if (number !== undefined) core.forget(number);
      }
    });
  }

  /** How the details of these queries are read, or undefined where they have none. */
  #details(name, objects) {
    if (objects === 0 || name === "posedShapes") return undefined;
    const of = name === "nearestToShapes" ? distances_at : cast_hits_at;
    return of(this.owner.core, this.dim, this.type);
  }

  first(given, options) {
    const core = this.owner.core;
    const parts = this.ask("first", given, options, ({ at, name, count }, objects, filter) => {
      const hits = core.scratch.take(count * C.jostle_hit.sizeof);
      const details = this.#details(name, objects);
      const room = details === undefined ? 0 : core.scratch.take(count * details.size);
      core.call("jostle_query_first", this.owner.pointer, at, objects, filter, hits, room);
      const ids = core.numbers(hits + C.jostle_hit.id, count, C.jostle_hit.sizeof);
      const where = new Float64Array(count), data = core.data;
      for (let i = 0; i < count; ++i) {
        where[i] =
          ids[i] === this.none
            ? Infinity
            : data.getFloat64(hits + i * C.jostle_hit.sizeof + C.jostle_hit.at, true);
      }
      return { ids, at: where, ...details?.read(room, count) };
    });
    const { ids, ...more } = joined_objects(parts);
    return { ids: this.one(ids), ...more };
  }

  all(given, options) {
    const core = this.owner.core;
    const { maxResults } = options_of(options);
    const most =
      maxResults === undefined || maxResults === Infinity ? ALL : BigInt(whole(maxResults, "maxResults"));
    const parts = this.ask("all", given, options, ({ at, name, none }, objects, filter) =>
      core.with_results((results) => {
        core.call("jostle_query_all", this.owner.pointer, at, objects, filter, none ? 0n : most, results);
        const lists = core.lists_of_results(results, !REGIONS.includes(name));
        const details = this.#details(name, objects);
        if (details === undefined) return lists;
        const blocks = core.struct(C.jostle_blocks);
        core.call("jostle_results_blocks", results, blocks);
        const count = core.u64(blocks + C.jostle_blocks.count); // in one block, if there are any
        const items = count && core.u32(core.u32(blocks + C.jostle_blocks.blocks) + C.jostle_block.items);
        return { ...lists, details: details.read(items, count) };
      }));
    return this.answers(parts);
  }

  answers(parts) {
    if (parts.length === 1) {
      const { first, ids, at, more, details } = parts[0];
      return new Answers(first, this.narrow(ids), at, more, details);
    }
    const first = [0];
    for (const part of parts) first.push(first.at(-1) + part.first[1]);
    return new Answers(
      Float64Array.from(first),
      this.narrow(joined_members(Float64Array, parts, "ids")),
      parts[0].at === undefined ? undefined : joined_members(Float64Array, parts, "at"),
      joined_members(Uint8Array, parts, "more"),
      parts[0].details && joined_objects(parts.map((part) => part.details)),
    );
  }

  visit(given, visit, options) {
    const core = this.owner.core;
    if (typeof visit !== "function") refuse(`visit is ${describe(visit)}: it must be a function`);
    const [finished] = this.ask("visit", given, options, ({ at, none }, objects, filter) => {
      if (none) return true;
      const number = core.remember(visit);
      try {
        const out = core.scratch.take(4);
        const visitor = core.module._jostle_js_visit_answer_pointer();
        core.call("jostle_query_visit", this.owner.pointer, at, objects, filter, visitor, number, out);
        return core.u32(out) !== 0;
      } finally {
        core.forget(number);
      }
    });
    return finished;
  }

  any(given, options) {
    const core = this.owner.core;
    return joined(Uint8Array, this.ask("any", given, options, ({ at, count }, objects, filter) => {
      const any = core.scratch.take(count);
      core.call("jostle_query_any", this.owner.pointer, at, objects, filter, any);
      return core.bytes.slice(any, any + count);
    }));
  }

  count(given, options) {
    const core = this.owner.core;
    return joined(Float64Array, this.ask("count", given, options, ({ at, count }, objects, filter) => {
      const counts = core.scratch.take(8 * count);
      core.call("jostle_query_count", this.owner.pointer, at, objects, filter, counts);
      return core.numbers(counts, count);
    }));
  }
}

function joined(Array, parts) {
  if (parts.length === 1) return parts[0];
  const all = new Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

function joined_members(Array, parts, member) {
  return joined(
    Array,
    parts.map((part) => part[member]),
  );
}

/** Objects whose members are arrays, as one. */
function joined_objects(parts) {
  if (parts.length === 1) return parts[0];
  return Object.fromEntries(
    Object.entries(parts[0]).map(([member, of]) => [member, joined_members(of.constructor, parts, member)]),
  );
}

export class Answers {
  constructor(first, ids, at, more, details) {
    this.first = first;
    this.ids = ids;
    this.at = at;
    this.more = more;
    this.details = details;
  }
  get length() {
    return this.first.length - 1;
  }
  of(query) {
    whole(query, "the query", 0, this.length - 1);
    return this.ids.subarray(this.first[query], this.first[query + 1]);
  }
}

/** Packs rays: see jostle.d.ts. */
export function rays(origins, directions, options) {
  const { dim, maxFraction = Infinity } = options_of(options);
  space_of(dim, "float64");
  const Array = origins?.constructor;
  if ((Array !== Float32Array && Array !== Float64Array) || directions?.constructor !== Array)
    refuse(
      `origins and directions are ${describe(origins)} and ${describe(directions)}: ` +
        "they must both be Float32Array or Float64Array",
    );
  refuse_detached(origins, "origins");
  refuse_detached(directions, "directions");
  if (origins.length % dim !== 0 || directions.length !== origins.length)
    refuse(
      `origins and directions have ${origins.length} and ${directions.length} numbers: ` +
        `they must have ${dim} for each ray`,
      "size_mismatch",
    );
  const count = origins.length / dim, width = 2 * dim + 1;
  const each = typeof maxFraction !== "number";
  if (each && array_like(maxFraction, "maxFraction").length !== count)
    refuse(`maxFraction has ${maxFraction.length} numbers, and there are ${count} rays`, "size_mismatch");
  const packed = new_floats(Array === Float64Array ? "float64" : "float32", count * width);
  for (let i = 0; i < count; ++i) {
    for (let d = 0; d < dim; ++d) {
      packed[i * width + d] = origins[i * dim + d];
      packed[i * width + dim + d] = directions[i * dim + d];
    }
    packed[i * width + 2 * dim] = each ? maxFraction[i] : maxFraction;
  }
  return { rays: packed };
}
