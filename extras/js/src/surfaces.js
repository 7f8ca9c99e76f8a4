// SPDX-License-Identifier: MIT
// Surfaces that bend: see jostle.d.ts.

import { Owned, describe, new_floats, number, options_of, space_of, whole } from "./core.js";
import { refuse } from "./error.js";
import * as C from "./structs.js";

// Of the arrays that a list of pairs is handed out as: the struct's member, and how many numbers it has.
const PARTS = { parts: ["a", 2, "uint32"], vertices: ["vertices", 4, "uint32"] };
const NEAR = { ...PARTS, weights: ["weights", 4], normals: ["normal", 3], distances: ["distance", 1] };
const IMPACTS = { ...PARTS, times: ["time", 1] };
const NEAR_LAYOUTS = { float32: C.jostle_near_parts_3f, float64: C.jostle_near_parts_3d };
const IMPACT_LAYOUTS = { float32: C.jostle_part_impact_3f, float64: C.jostle_part_impact_3d };

/** The structs of blocks, member by member. */
function split(core, blocks, type, layout, members) {
  const length = core.u64(blocks + C.jostle_blocks.count);
  const found = { length };
  for (const [name, [member, width, kind = type]] of Object.entries(members)) {
    const all = kind === "uint32" ? new Uint32Array(width * length) : new_floats(kind, width * length);
    const size = all.BYTES_PER_ELEMENT, step = layout.sizeof / size;
    let at = 0;
    for (const { pointer, count } of core.blocks_at(blocks)) {
      const numbers = core.view(kind, pointer, step * count);
      for (let from = layout[member] / size; from < numbers.length; from += step, at += width)
        for (let k = 0; k < width; ++k) all[at + k] = numbers[from + k];
    }
    found[name] = all;
  }
  return found;
}

/** What is the same while a surface bends: see jostle.d.ts. */
export class Surface extends Owned {
  constructor(core, parts) {
    const { triangles, edges, points, vertices = 0 } = options_of(parts, "parts");
    super(
      core,
      "_jostle_free",
      core.within(() => {
        const given = core.struct(C.jostle_surface_parts), layout = C.jostle_surface_parts;
        const place = (list, name, width, count) => {
          if (list === undefined) return;
          const placed = core.integers(list, name);
          if (placed.length % width !== 0)
            refuse(
              `${name} has ${placed.length} numbers: it must be a multiple of ${width}`,
              "size_mismatch",
            );
          core.data.setUint32(given + layout[name], placed.pointer, true);
          core.data.setBigUint64(given + layout[count], BigInt(placed.length / width), true);
        };
        place(triangles, "triangles", 3, "triangle_count");
        place(edges, "edges", 2, "edge_count");
        place(points, "points", 1, "point_count");
        core.data.setBigUint64(given + layout.vertices, BigInt(whole(vertices, "vertices")), true);
        return core.make("jostle_surface_new", given);
      }),
    );
  }

  /** Reads from the surface's own jostle_surface_parts. */
  #read(inside) {
    const { core, pointer } = this;
    return core.within(() => {
      const parts = core.struct(C.jostle_surface_parts);
      core.call("jostle_surface_parts_read", pointer, parts);
      return inside((member) => parts + C.jostle_surface_parts[member]);
    });
  }
  #list(name, count, width) {
    const { core } = this;
    return this.#read((at) => core.view("uint32", core.u32(at(name)), width * core.u64(at(count))).slice());
  }
  get vertices() {
    return this.#read((at) => this.core.u64(at("vertices")));
  }
  get triangles() {
    return this.#list("triangles", "triangle_count", 3);
  }
  get edges() {
    return this.#list("edges", "edge_count", 2);
  }
  get points() {
    return this.#list("points", "point_count", 1);
  }
}

/** Finds what of a surface is near itself, meets itself or crosses itself: see jostle.d.ts. */
export class SurfaceFinder extends Owned {
  constructor(core, options) {
    const { type = "float32" } = options_of(options);
    const space = space_of(3, type);
    super(
      core,
      "_jostle_free",
      core.within(() => core.make("jostle_surface_finder_new", space, core.options())),
    );
    this.type = type;
  }

  #surface(surface) {
    if (!(surface instanceof Surface)) refuse(`surface is ${describe(surface)}: it must be a Surface`);
    if (surface.core !== this.core) refuse("surface belongs to another module");
    return surface.pointer;
  }
  #positions(given, name) {
    return this.core.rows(given, name, 3, this.type);
  }
  /** A jostle_surface_options. */
  #options(given, surface) {
    const { core, type } = this, layout = C.jostle_surface_options;
    const { thickness, rest, bodies, tolerance = 0 } = options_of(given);
    const options = core.struct(layout);
    const one_each = (list, name, width, types) => {
      if (list === undefined) return;
      const { pointer, length } = core.place(list, name, types);
      if (length !== width * surface.vertices)
        refuse(
          `${name} has ${length} numbers: it must have ${width} for each of ${surface.vertices} vertices`,
          "size_mismatch",
        );
      core.data.setUint32(options + layout[name], pointer, true);
    };
    one_each(thickness, "thickness", 1, [type]);
    one_each(rest, "rest", 3, [type]);
    one_each(bodies, "bodies", 1, ["uint32"]);
    core.data.setFloat64(options + layout.tolerance, number(tolerance, "tolerance"), true);
    return options;
  }

  near(surface, positions, distance, given) {
    const { core, type } = this;
    return core.within(() => {
      const of = this.#surface(surface), at = this.#positions(positions, "positions");
      const found = core.struct(C.jostle_near_surface);
      core.call(
        "jostle_surface_finder_near",
        this.pointer,
        of,
        at.pointer,
        BigInt(at.count),
        number(distance, "distance"),
        this.#options(given, surface),
        found,
      );
      const list = (member) =>
        split(core, found + C.jostle_near_surface[member], type, NEAR_LAYOUTS[type], NEAR);
      return { vertexTriangle: list("vertex_triangle"), edgeEdge: list("edge_edge") };
    });
  }

  moving(surface, from, to, distance = 0, given) {
    const { core, type } = this;
    return core.within(() => {
      const of = this.#surface(surface);
      const begin = this.#positions(from, "from"), end = this.#positions(to, "to");
      if (begin.count !== end.count)
        refuse(`from has ${begin.count} positions, and to has ${end.count}`, "size_mismatch");
      const found = core.struct(C.jostle_moving_surface);
      core.call(
        "jostle_surface_finder_moving",
        this.pointer,
        of,
        begin.pointer,
        end.pointer,
        BigInt(begin.count),
        number(distance, "distance"),
        this.#options(given, surface),
        found,
      );
      const list = (member) =>
        split(core, found + C.jostle_moving_surface[member], type, IMPACT_LAYOUTS[type], IMPACTS);
      return {
        vertexTriangle: list("vertex_triangle"),
        edgeEdge: list("edge_edge"),
        safeStep: core.f64(found + C.jostle_moving_surface.safe_step),
      };
    });
  }

  crossings(surface, positions, given) {
    const { core } = this;
    return core.within(() => {
      const of = this.#surface(surface), at = this.#positions(positions, "positions");
      const found = core.struct(C.jostle_blocks);
      core.call(
        "jostle_surface_finder_crossings",
        this.pointer,
        of,
        at.pointer,
        BigInt(at.count),
        this.#options(given, surface),
        found,
      );
      return core.copy_pairs(found); // an edge and a triangle each
    });
  }

  releaseMemory() {
    this.core.call("jostle_release_memory", this.pointer);
  }
}
