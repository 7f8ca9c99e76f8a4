// SPDX-License-Identifier: MIT
import { Owned, number, options_of, size_of, space_of } from "./core.js";
import { cast_hits_at, distances_at } from "./details.js";
import { refuse } from "./error.js";
import { place_objects } from "./shapes.js";
import * as C from "./structs.js";

/** The contacts of blocks, number by number. */
export function split_contacts(core, dim, type, blocks) {
  const space = space_of(dim, type);
  const contacts = core.u64(blocks + C.jostle_blocks.count);
  const points = core.module._jostle_js_contact_points(space, blocks) >>> 0;
  const size = size_of(type);
  const arrays = {
    // in the order of the module's SplitContacts
    pairs: ["uint32", 2 * contacts],
    parts: ["uint32", 2 * contacts],
    normals: [type, dim * contacts],
    first: ["uint32", contacts + 1],
    fromA: [type, dim * points],
    fromB: [type, dim * points],
    depths: [type, points],
    features: ["uint32", points],
  };
  const places = Object.values(arrays).map(([kind, length]) =>
    core.scratch.take(length * (kind === type ? size : 4)),
  );
  const into = core.scratch.take(4 * places.length);
  places.forEach((place, i) => core.data.setUint32(into + 4 * i, place, true));
  core.module._jostle_js_split_contacts(space, blocks, into);
  const split = { length: contacts };
  Object.entries(arrays).forEach(
    ([name, [kind, length]], i) => (split[name] = core.view(kind, places[i], length).slice()),
  );
  return split;
}

/** From pairs to contacts: see jostle.d.ts. */
export class ContactFinder extends Owned {
  constructor(core, options) {
    const { dim, type = "float32", allPoints = false } = options_of(options);
    const space = space_of(dim, type);
    super(
      core,
      "_jostle_free",
      core.within(() => {
        const given = core.options();
        core.data.setInt32(given + C.jostle_options.all_points, allPoints ? 1 : 0, true);
        return core.make("jostle_contact_finder_new", space, given);
      }),
    );
    this.dim = dim;
    this.type = type;
  }

  #objects(given, moving) {
    const placed = place_objects(this.core, given, this.type, moving);
    if (placed.dim !== this.dim) refuse(`the shapes are ${placed.dim}D, and the finder is ${this.dim}D`);
    return placed.pointer;
  }

  find(a, pairs, options) {
    const { b, margin = 0 } = options_of(options);
    const core = this.core;
    return core.within(() => {
      const out = core.struct(C.jostle_blocks);
      core.call(
        "jostle_contact_finder_find",
        this.pointer,
        this.#objects(a),
        b === undefined ? 0 : this.#objects(b),
        core.pairs(pairs).blocks,
        number(margin, "margin"),
        out,
      );
      return split_contacts(core, this.dim, this.type, out);
    });
  }

  touching(a, pairs, options) {
    const { b } = options_of(options);
    const core = this.core;
    return core.within(() => {
      const { blocks, count } = core.pairs(pairs);
      const out = core.scratch.take(count);
      core.call(
        "jostle_contact_finder_touching",
        this.pointer,
        this.#objects(a),
        b === undefined ? 0 : this.#objects(b),
        blocks,
        out,
      );
      return core.bytes.slice(out, out + count);
    });
  }

  /** See distances_at(). */
  #rows(name, a, pairs, b, limit, moving, first) {
    const { core, dim, type } = this;
    return core.within(() => {
      const { blocks, count } = core.pairs(pairs);
      const { size, read } = distances_at(core, dim, type, first);
      const out = core.scratch.take(count * size);
      core.call(
        name,
        this.pointer,
        this.#objects(a, moving),
        b === undefined ? 0 : this.#objects(b, moving),
        blocks,
        limit,
        out,
      );
      return read(out, count);
    });
  }
  distances(a, pairs, options) {
    const { b, maxDistance = Infinity } = options_of(options);
    const limit = number(maxDistance, "maxDistance");
    return this.#rows("jostle_contact_finder_distances", a, pairs, b, limit, false, "distances");
  }
  impacts(a, pairs, options) {
    const { b, tolerance = 1e-3 } = options_of(options);
    const limit = number(tolerance, "tolerance");
    return this.#rows("jostle_contact_finder_impacts", a, pairs, b, limit, true, "times");
  }

  rayCasts(rays, objects, pairs) {
    const { core, dim, type } = this;
    return core.within(() => {
      const { blocks, count } = core.pairs(pairs);
      const hits = cast_hits_at(core, dim, type);
      const out = core.scratch.take(count * hits.size);
      const rows = core.rows(rays, "rays", 2 * dim + 1, type);
      core.call(
        "jostle_contact_finder_ray_casts",
        this.pointer,
        core.values(rows, 2 * dim + 1),
        this.#objects(objects),
        blocks,
        out,
      );
      return hits.read(out, count);
    });
  }
  shapeCasts(moving, displacements, objects, pairs) {
    const { core, dim, type } = this;
    return core.within(() => {
      const { blocks, count } = core.pairs(pairs);
      const hits = cast_hits_at(core, dim, type);
      const out = core.scratch.take(count * hits.size);
      const ways = core.values(core.rows(displacements, "displacements", dim, type), dim);
      core.call(
        "jostle_contact_finder_shape_casts",
        this.pointer,
        this.#objects(moving),
        ways,
        this.#objects(objects),
        blocks,
        out,
      );
      return hits.read(out, count);
    });
  }
}
