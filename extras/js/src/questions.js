// SPDX-License-Identifier: MIT
// Questions about boxes, as a BoxIndex and a World answer them.

import {
  array_like, describe, new_floats, options_of, refuse_detached, size_of, space_of, whole,
} from "./core.js";
import { refuse } from "./error.js";
import * as C from "./structs.js";

const KINDS = { rays: 1, sweeps: 2, boxes: 3, spheres: 4, frustums: 5, nearest: 6, nearestToBoxes: 7 };
const REGIONS = ["rays", "sweeps", "boxes", "spheres", "frustums"];
const CALLS = {
  first: ["rays", "sweeps"],
  all: Object.keys(KINDS),
  any: REGIONS,
  count: REGIONS,
  visit: Object.keys(KINDS),
};
const REGIONS_ALONE = [KINDS.boxes, KINDS.spheres, KINDS.frustums]; // whose answers have no order
const ALL = 2n ** 64n - 1n;

/** Numbers of each question of a kind. */
function width_of(kind, dim) {
  return [0, 2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, 0, dim, 2 * dim][kind];
}

/** Questions in the module's memory: { kind, pointer, count, size } of one. */
function place_questions(core, questions, dim, type, call) {
  const [name, other] =
    questions === null || typeof questions !== "object"
      ? []
      : Object.keys(KINDS).filter((each) => questions[each] !== undefined);
  if (other !== undefined) refuse(`questions are ${name} and ${other}: they must be of one kind`);
  if (name === undefined)
    refuse(
      `questions are ${describe(questions)}: they must be { rays } or { boxes } or another kind of question`,
    );
  if (!CALLS[call].includes(name))
    refuse(`${name} is no question of ${call}(): ask one of ${CALLS[call].join(", ")}`);
  const kind = KINDS[name];
  if (name === "frustums") return place_frustums(core, questions.frustums, dim, type);
  const rows = core.rows(questions[name], name, width_of(kind, dim), type);
  if (kind < KINDS.nearest)
    return { kind, pointer: rows.pointer, count: rows.count, size: width_of(kind, dim) * size_of(type) };
  const layout =
    C[`jostle_nearest_${kind === KINDS.nearest ? "" : "to_box_"}${dim}${type === "float64" ? "d" : "f"}`];
  const wanted = whole(questions.count ?? 1, "count");
  const most = questions.maxDistance ?? Infinity;
  if (typeof most !== "number") refuse(`maxDistance is ${describe(most)}: it must be a number`);
  const pointer = core.scratch.take(layout.sizeof * rows.count);
  const width = width_of(kind, dim) * size_of(type);
  const { bytes, data } = core;
  for (let i = 0; i < rows.count; ++i) {
    const at = pointer + i * layout.sizeof;
    bytes.copyWithin(at, rows.pointer + i * width, rows.pointer + (i + 1) * width);
    data.setUint32(at + layout.count, wanted, true);
    if (type === "float64") data.setFloat64(at + layout.max_distance, most, true);
    else data.setFloat32(at + layout.max_distance, most, true);
  }
  return { kind, pointer, count: rows.count, size: layout.sizeof };
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
  return { kind: KINDS.frustums, pointer, count: frustums.length, size: C.jostle_frustum.sizeof };
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
    if (typeof exclude !== "bigint") whole(exclude, "exclude");
    else if (BigInt.asUintN(64, exclude) !== exclude) refuse(`exclude is ${exclude}: it must be an id`);
    core.data.setBigUint64(at, BigInt(exclude), true);
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

/** What an index and a world answer alike: `names` are the functions' that do so. */
export class Asked {
  constructor(owner, names, dim, type, { ids, id, one, none }) {
    this.owner = owner; // the index or world
    this.names = names;
    this.dim = dim;
    this.type = type;
    this.narrow = ids; // from 64-bit ids to those that the caller sees
    this.id = id; // the same of one
    this.one = one; // the same where there may be none
    this.none = none; // the id of no answer
  }

  /**
   * Calls inside(questions, filter) with all questions at once or, where a callback is asked and there are
   * threads that it must not be called on, with one after the other. `done(question)` tells the number of the
   * first.
   */
  ask(call, given, chosen, inside) {
    const core = this.owner.core, options = options_of(chosen);
    return core.within(() => {
      const questions = place_questions(core, given, this.dim, this.type, call);
      if (call === "visit" && questions.count !== 1)
        refuse(`there are ${questions.count} questions: visit() takes one`, "size_mismatch");
      let first = 0;
      const { accept } = options;
      if (accept !== undefined && typeof accept !== "function")
        refuse(`accept is ${describe(accept)}: it must be a function`);
      const number = accept && core.remember((question, id) => accept(first + question, this.id(id)));
      try {
        const filter = query_filter(core, options, number);
        if (accept === undefined || core.threads === 1 || questions.count === 0)
          return [inside(questions, filter)];
        const parts = [];
        for (; first < questions.count; ++first)
          parts.push(
            inside({ ...questions, pointer: questions.pointer + first * questions.size, count: 1 }, filter),
          );
        return parts;
      } finally {
        if (number !== undefined) core.forget(number);
      }
    });
  }

  first(given, options) {
    const core = this.owner.core;
    const parts = this.ask("first", given, options, ({ kind, pointer, count }, filter) => {
      const hits = core.scratch.take(count * C.jostle_hit.sizeof);
      core.call(this.names.first, this.owner.pointer, kind, pointer, BigInt(count), filter, hits);
      const ids = new BigUint64Array(count), at = new Float64Array(count);
      const data = core.data;
      for (let i = 0; i < count; ++i) {
        ids[i] = data.getBigUint64(hits + i * C.jostle_hit.sizeof + C.jostle_hit.id, true);
        at[i] =
          ids[i] === this.none
            ? Infinity
            : data.getFloat64(hits + i * C.jostle_hit.sizeof + C.jostle_hit.at, true);
      }
      return { ids, at };
    });
    return {
      ids: this.one(joined_members(BigUint64Array, parts, "ids")),
      at: joined_members(Float64Array, parts, "at"),
    };
  }

  all(given, options) {
    const core = this.owner.core;
    const { maxResults } = options_of(options);
    const most =
      maxResults === undefined || maxResults === Infinity ? ALL : BigInt(whole(maxResults, "maxResults"));
    const parts = this.ask("all", given, options, ({ kind, pointer, count }, filter) =>
      core.with_results((results) => {
        core.call(this.names.all, this.owner.pointer, kind, pointer, BigInt(count), filter, most, results);
        return core.lists_of_results(results, !REGIONS_ALONE.includes(kind));
      }));
    return this.answers(parts);
  }

  answers(parts) {
    if (parts.length === 1)
      return new Answers(parts[0].first, this.narrow(parts[0].ids), parts[0].at, parts[0].more);
    const first = [0];
    for (const part of parts) first.push(first.at(-1) + part.first[1]);
    return new Answers(
      Float64Array.from(first),
      this.narrow(joined_members(BigUint64Array, parts, "ids")),
      parts[0].at === undefined ? undefined : joined_members(Float64Array, parts, "at"),
      joined_members(Uint8Array, parts, "more"),
    );
  }

  visit(given, visit, options) {
    const core = this.owner.core;
    if (typeof visit !== "function") refuse(`visit is ${describe(visit)}: it must be a function`);
    const [finished] = this.ask("visit", given, options, ({ kind, pointer }, filter) => {
      const number = core.remember((id, at) => visit(this.id(id), at));
      try {
        const out = core.scratch.take(4);
        const visitor = core.module._jostle_js_visit_answer_pointer();
        core.call(this.names.visit, this.owner.pointer, kind, pointer, filter, visitor, number, out);
        return core.u32(out) !== 0;
      } finally {
        core.forget(number);
      }
    });
    return finished;
  }

  any(given, options) {
    const core = this.owner.core;
    return joined(Uint8Array, this.ask("any", given, options, ({ kind, pointer, count }, filter) => {
      const any = core.scratch.take(count);
      core.call(this.names.any, this.owner.pointer, kind, pointer, BigInt(count), filter, any);
      return core.bytes.slice(any, any + count);
    }));
  }

  count(given, options) {
    const core = this.owner.core;
    return joined(Float64Array, this.ask("count", given, options, ({ kind, pointer, count }, filter) => {
      const counts = core.scratch.take(8 * count);
      core.call(this.names.count, this.owner.pointer, kind, pointer, BigInt(count), filter, counts);
      return Float64Array.from(new BigUint64Array(core.memory.buffer, counts, count), Number);
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

export class Answers {
  constructor(first, ids, at, more) {
    this.first = first;
    this.ids = ids;
    this.at = at;
    this.more = more;
  }
  get length() {
    return this.first.length - 1;
  }
  of(question) {
    whole(question, "the question", 0, this.length - 1);
    return this.ids.subarray(this.first[question], this.first[question + 1]);
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
