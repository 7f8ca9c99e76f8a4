// SPDX-License-Identifier: MIT
// Neighbour lists: see jostle.d.ts.

import {
  Owned,
  array_like,
  describe,
  new_floats,
  number,
  options_of,
  space_of,
  type_of,
  whole,
} from "./core.js";
import { refuse } from "./error.js";
import * as C from "./structs.js";

const LETTERS = "ijSDdo";

function letters_of(quantities) {
  if (
    typeof quantities !== "string" ||
    quantities === "" ||
    [...quantities].some((each) => !LETTERS.includes(each))
  )
    refuse(
      `quantities is ${describe(quantities)}: it must be some of the letters ${[...LETTERS].join(", ")}`,
    );
  return quantities;
}

/** Numbers of the caller's in the space's own. */
function floats(core, given, type) {
  const all = new_floats(type, given.length);
  all.set(given);
  return core.place(all, "numbers", [type]).pointer;
}
/** One number for each of `count` points. */
function one_each(given, name, count) {
  const all = array_like(given?.view ?? given, name);
  if (all.length !== count)
    refuse(`${name} has ${all.length} numbers, and there are ${count} points`, "size_mismatch");
  return all;
}

/** The numbers of arrays in arrays. */
function flat(given, name) {
  return Array.from(array_like(given, name), (each) =>
    typeof each === "object" && each !== null ? flat(each, name) : each,
  ).flat();
}

/** The vectors and flags of no, one, or of each system's cell. */
function cells_of(cell, periodic, dim, systems) {
  const flags = typeof periodic === "boolean" ? [periodic] : flat(periodic, "periodic");
  const each = systems === undefined ? "" : `, or ${systems * dim}`;
  if (flags.some((flag) => flag !== true && flag !== false && flag !== 0 && flag !== 1))
    refuse("periodic must be true or false, or one of these for each axis");
  if (typeof periodic !== "boolean" && flags.length !== dim && flags.length !== systems * dim)
    refuse(`periodic has ${flags.length} values: it must have ${dim}${each}`, "size_mismatch");
  if (cell === undefined) {
    if (flags.some(Boolean)) refuse("periodic is given, and there is no cell");
    return { count: 0 };
  }
  let vectors = flat(cell, "cell").map((each, i) => number(each, `cell[${i}]`));
  if (vectors.length === dim)
    vectors = vectors.flatMap((length, axis) =>
      Array.from({ length: dim }, (_, d) => (d === axis ? length : 0)),
    );
  const square = dim * dim;
  if (vectors.length !== square && vectors.length !== systems * square)
    refuse(
      `cell has ${vectors.length} numbers: it must have ${dim}, lengths, or ${square}, a vector in each row` +
        (systems === undefined ? "" : `, or ${systems * square}, such rows for each system`),
      "size_mismatch",
    );
  const count = Math.max(vectors.length / square, flags.length / dim, 1);
  const repeated = (all, length) => Array.from({ length }, (_, i) => all[i % all.length]);
  return {
    count,
    vectors: repeated(vectors, count * square),
    repeats: repeated(flags.map(Number), count * dim),
  };
}

/** A jostle_neighbor_query. */
function place_query(core, points, cutoff, options, dim, type, skin) {
  const at = core.struct(C.jostle_neighbor_query);
  const set = (member, value) => core.data.setUint32(at + C.jostle_neighbor_query[member], value, true);
  const set_count = (member, value) =>
    core.data.setBigUint64(at + C.jostle_neighbor_query[member], BigInt(value), true);
  const set_double = (member, value) =>
    core.data.setFloat64(at + C.jostle_neighbor_query[member], value, true);

  const rows = core.rows(points, "points", dim, type);
  set("points", rows.pointer);
  set_count("count", rows.count);
  const { others, cutoffB, types, typesB, offsets, greater = false, full = true } = options;
  const counts = [rows.count];
  if (others !== undefined) {
    if (offsets !== undefined)
      refuse("others are given, and there are many systems: these have one set each");
    const more = core.rows(others, "others", dim, type);
    set("others", more.pointer);
    set_count("other_count", more.count);
    counts.push(more.count);
  } else {
    if (cutoffB !== undefined) refuse("cutoffB is given, and there are no others");
    if (typesB !== undefined) refuse("typesB is given, and there are no others");
  }
  let systems;
  if (offsets !== undefined) {
    const places = Array.from(array_like(offsets, "offsets"), (each, i) => whole(each, `offsets[${i}]`));
    if (places.length === 0)
      refuse("offsets has no numbers: it must have one more than there are systems", "size_mismatch");
    systems = places.length - 1;
    set("offsets", core.ids(places, "offsets").pointer);
    set_count("system_count", systems);
  }

  const nobody = Math.min(...counts) === 0; // C would take lists of no numbers for none
  const two = others !== undefined;
  if (types !== undefined) {
    if (cutoffB !== undefined)
      refuse("cutoffB is given, and cutoff is for pairs of types: these are of both sets");
    const table = array_like(cutoff?.view ?? cutoff, "cutoff"),
      kinds = Math.sqrt(table.length);
    if (!Number.isInteger(kinds))
      refuse(
        `cutoff has ${table.length} numbers, and types are given: it must have one for each pair of types`,
      );
    if (two && typesB === undefined) refuse("types are given, and typesB isn't");
    const all = [
      [types, "types"],
      [typesB, "typesB"],
    ].slice(0, counts.length);
    const placed = all.map(([given, name], k) =>
      core.integers(
        Uint32Array.from(one_each(given, name, counts[k]), (each) => whole(each, name)),
        name,
      ),
    );
    if (!nobody) {
      set("types", placed[0].pointer);
      if (two) set("types_b", placed[1].pointer);
      set("table", floats(core, table, type));
      set_count("type_count", kinds);
    }
  } else if (typeof cutoff !== "number") {
    if (two && cutoffB === undefined)
      refuse("cutoff is one for each point, and cutoffB, of the others, isn't given");
    const radii = floats(core, one_each(cutoff, "cutoff", counts[0]), type);
    const radii_b = two && floats(core, one_each(cutoffB, "cutoffB", counts[1]), type);
    if (!nobody) {
      set("radii", radii);
      if (two) set("radii_b", radii_b);
    }
  } else {
    if (cutoffB !== undefined) refuse("cutoffB is given, and cutoff is one for all pairs");
    set_double("cutoff", cutoff);
  }
  if (nobody && (types !== undefined || typeof cutoff !== "number")) set_double("cutoff", 1);
  if (!nobody) set("greater", greater ? 1 : 0);

  const cells = cells_of(options.cell, options.periodic ?? false, dim, systems);
  if (cells.count !== 0) {
    set("cells", floats(core, cells.vectors, type));
    set("repeats", core.integers(Uint32Array.from(cells.repeats), "periodic").pointer);
    set_count("cell_count", cells.count);
  }
  if (two && options.full === false) refuse("full is false, and there are two sets: these have full lists");
  set("half", full ? 0 : 1);
  set_double("skin", skin);
  return at;
}

export class NeighborFinder extends Owned {
  #skin;
  #searched = true;

  constructor(core, options) {
    const { dim, type = "float32", skin = 0 } = options_of(options);
    const space = space_of(dim, type);
    number(skin, "skin");
    super(
      core,
      "_jostle_free",
      core.within(() => core.make("jostle_neighbor_finder_new", space, core.options())),
    );
    this.dim = dim;
    this.type = type;
    this.#skin = skin;
  }

  find(points, cutoff, given) {
    const { core, dim, type } = this,
      options = options_of(given);
    const quantities = letters_of(options.quantities ?? "ij");
    return core.within(() => {
      const query = place_query(core, points, cutoff, options, dim, type, this.#skin);
      for (const [letter, member] of [
        ["S", "shifts"],
        ["D", "vectors"],
        ["d", "distances"],
      ])
        core.data.setInt32(
          query + C.jostle_neighbor_query[member],
          quantities.includes(letter) ? 1 : 0,
          true,
        );
      const list = core.struct(C.jostle_neighbor_list);
      core.call("jostle_neighbor_finder_find", this.pointer, query, list);
      const at = (member) => core.u32(list + C.jostle_neighbor_list[member]);
      this.#searched = at("searched") !== 0;
      const rows = core.u64(query + C.jostle_neighbor_query.count),
        count = core.u64(list + C.jostle_neighbor_list.count);
      const offsets = new BigUint64Array(core.memory.buffer, at("offsets"), rows + 1);
      const copied = (kind, member, length) =>
        count === 0 ? core.view(kind, 0, 0).slice() : core.view(kind, at(member), length).slice();
      const readers = {
        i: () => {
          const sources = new Uint32Array(count);
          for (let i = 0, k = 0; i < rows; ++i)
            for (const end = Number(offsets[i + 1]); k < end; ++k) sources[k] = i;
          return sources;
        },
        j: () => copied("uint32", "neighbors", count),
        S: () => new Int32Array(copied("uint32", "shifts", dim * count).buffer),
        D: () => copied(type, "vectors", dim * count),
        d: () => copied(type, "distances", count),
        o: () => Float64Array.from(offsets, Number),
      };
      return Object.fromEntries([...quantities].map((letter) => [letter, readers[letter]()]));
    });
  }
  /** Whether the last call searched. */
  get searched() {
    this.pointer; // still there?
    return this.#searched;
  }
  releaseMemory() {
    this.core.call("jostle_release_memory", this.pointer);
  }
}

export function neighbors(core, points, cutoff, given) {
  const finder = new NeighborFinder(core, { dim: options_of(given).dim, type: type_of(points) });
  try {
    return finder.find(points, cutoff, given);
  } finally {
    finder.dispose();
  }
}
