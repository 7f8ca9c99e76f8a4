// SPDX-License-Identifier: MIT
import {
  Owned, array_like, describe, new_floats, number, options_of, refuse_detached, size_of, space_of, type_of,
  whole,
} from "./core.js";
import { refuse } from "./error.js";
import * as C from "./structs.js";

/** One collision shape: see jostle.d.ts. */
export class Shape extends Owned {
  constructor(core, pointer) {
    super(core, "_jostle_free", pointer);
    const [dim, type] = core.within(() => {
      const info = core.struct(C.jostle_shape_info);
      core.call("jostle_shape_info_read", pointer, info);
      return [core.u32(info + C.jostle_shape_info.dim), core.u32(info + C.jostle_shape_info.type)];
    });
    this.dim = dim;
    this.type = C.jostle_shape_type[type];
  }
}

function checked_dim(dim) {
  space_of(dim, "float64");
  return dim;
}

/** The functions that make shapes, of a module. */
export function shape_makers(core) {
  const made = (name, ...parameters) => new Shape(core, core.make(name, ...parameters));
  const of_axes = (name, what, given, ...more) =>
    core.within(() => {
      const numbers = core.doubles(given, what);
      return made(name, numbers.count, numbers.pointer, ...more);
    });
  const of_points = (name, points, dim, ...more) =>
    core.within(() => {
      checked_dim(dim);
      const rows = core.rows(points, "points", dim);
      return made(name, space_of(dim, rows.type), rows.pointer, BigInt(rows.count), ...more);
    });
  return {
    sphere: (radius, dim = 3) => made("jostle_shape_sphere", checked_dim(dim), number(radius, "radius")),
    capsule: (halfLength, radius, dim = 3) =>
      made(
        "jostle_shape_capsule",
        checked_dim(dim),
        number(halfLength, "halfLength"),
        number(radius, "radius"),
      ),
    box: (half) => of_axes("jostle_shape_box", "half", half, 0),
    roundedBox: (half, radius) =>
      of_axes("jostle_shape_box", "half", half, number(radius, "radius")),
    cylinder: (halfLength, radius) =>
      made("jostle_shape_cylinder", number(halfLength, "halfLength"), number(radius, "radius")),
    cone: (halfLength, radius) =>
      made("jostle_shape_cone", number(halfLength, "halfLength"), number(radius, "radius")),
    ellipsoid: (half) => of_axes("jostle_shape_ellipsoid", "half", half),
    halfSpace: (normal, offset = 0) =>
      of_axes("jostle_shape_half_space", "normal", normal, number(offset, "offset")),
    hull: (points, dim) => of_points("jostle_shape_hull", points, dim, 0),
    roundedHull: (points, radius, dim) =>
      of_points("jostle_shape_hull", points, dim, number(radius, "radius")),
    mesh: (vertices, elements, dim) =>
      core.within(() => {
        checked_dim(dim);
        const rows = core.rows(vertices, "vertices", dim),
          corners = core.rows(elements, "elements", dim, "uint32");
        return made(
          "jostle_shape_mesh",
          space_of(dim, rows.type),
          rows.pointer,
          BigInt(rows.count),
          corners.pointer,
          BigInt(corners.count),
          0,
        );
      }),
    heightField: (heights, columns, options) =>
      core.within(() => {
        const { spacingX = 1, spacingZ = 1, thickness = 0 } = options_of(options);
        const rows = core.rows(heights, "heights", whole(columns, "columns", 1));
        return made(
          "jostle_shape_height_field",
          space_of(3, rows.type),
          rows.pointer,
          columns,
          rows.count,
          number(spacingX, "spacingX"),
          number(spacingZ, "spacingZ"),
          number(thickness, "thickness"),
        );
      }),
    compound: (shapes, poses) =>
      core.within(() => {
        if (!Array.isArray(shapes) || shapes.length === 0 || !shapes.every((shape) => shape instanceof Shape))
          refuse(`shapes are ${describe(shapes)}: they must be a list of at least one shape`);
        const { dim } = shapes[0];
        const rows = core.rows(poses, "poses", dim === 3 ? 7 : 4, "float64");
        if (rows.count !== shapes.length)
          refuse(`there are ${shapes.length} shapes and ${rows.count} poses`, "size_mismatch");
        const children = core.scratch.take(4 * shapes.length);
        shapes.forEach((shape, i) => core.data.setUint32(children + 4 * i, shape.pointer, true));
        return made("jostle_shape_compound", dim, children, rows.pointer, BigInt(shapes.length));
      }),
  };
}

/** One shape for each object: see jostle.d.ts. */
export class Shapes extends Owned {
  constructor(core, options) {
    const { dim, shapes = [] } = options_of(options);
    if (!Array.isArray(shapes))
      refuse(`shapes are ${describe(shapes)}: they must be a list, such as [jostle.sphere(1)]`);
    const of = checked_dim(dim ?? shapes[0]?.dim ?? 3);
    super(core, "_jostle_free", core.make("jostle_shapes_new", of));
    this.dim = of;
    for (const shape of shapes) this.add(shape);
  }
  get length() {
    return this.core.within(() => {
      const out = this.core.scratch.take(8);
      this.core.call("jostle_size", this.pointer, out);
      return this.core.u64(out);
    });
  }
  add(shape, count = 1) {
    this.core.call("jostle_shapes_add", this.pointer, shape_pointer(shape), BigInt(whole(count, "count")));
  }
  addSpheres(radii) {
    this.core.within(() => {
      const rows = this.core.rows(radii, "radii", 1, "float64");
      this.core.call("jostle_shapes_add_spheres", this.pointer, rows.pointer, BigInt(rows.count));
    });
  }
  addCapsules(halfLengths, radii) {
    this.core.within(() => {
      const a = this.core.rows(halfLengths, "halfLengths", 1, "float64"),
        b = this.core.rows(radii, "radii", 1, "float64");
      if (a.count !== b.count)
        refuse(`there are ${a.count} halfLengths and ${b.count} radii`, "size_mismatch");
      this.core.call("jostle_shapes_add_capsules", this.pointer, a.pointer, b.pointer, BigInt(a.count));
    });
  }
  addBoxes(halves) {
    this.core.within(() => {
      const rows = this.core.rows(halves, "halves", this.dim, "float64");
      this.core.call("jostle_shapes_add_boxes", this.pointer, rows.pointer, BigInt(rows.count));
    });
  }
  set(object, shape) {
    this.core.call("jostle_shapes_set", this.pointer, BigInt(whole(object, "object")), shape_pointer(shape));
  }
  clear() {
    this.core.call("jostle_clear", this.pointer);
  }
  #repeats = false;
  get repeats() {
    return this.#repeats;
  }
  set repeats(wish) {
    if (typeof wish !== "boolean") refuse(`repeats is ${describe(wish)}: it must be true or false`);
    this.core.call("jostle_shapes_set_repeats", this.pointer, wish ? 1 : 0);
    this.#repeats = wish;
  }
}

function shape_pointer(shape) {
  if (!(shape instanceof Shape))
    refuse(
      `the shape is ${describe(shape)}: it must be made by sphere(), box() or another of Jostle's functions`,
    );
  return shape.pointer;
}

/** A jostle_objects, and the rows of their poses. */
export function place_objects(core, objects, type, moving = false) {
  if (!(objects?.shapes instanceof Shapes))
    refuse(`objects are ${describe(objects)}: they must be { shapes, poses }`);
  const { dim } = objects.shapes;
  const width = (dim === 3 ? 7 : 4) + (moving ? (dim === 3 ? 6 : 3) : 0);
  const rows = core.rows(objects.poses, moving ? "motions" : "poses", width, type);
  const at = core.struct(C.jostle_objects);
  core.data.setUint32(at + C.jostle_objects.shapes, objects.shapes.pointer, true);
  const stride = width * size_of(rows.type);
  core.set_values(at + C.jostle_objects.poses, { ...rows, stride });
  const one = core.struct(C.jostle_objects);
  /** A jostle_objects of object i alone, with these shapes; until the next call. */
  const alone = (its_shapes, i) => {
    core.data.setUint32(one + C.jostle_objects.shapes, its_shapes, true);
    core.set_values(one + C.jostle_objects.poses, { pointer: rows.pointer + i * stride, count: 1, stride });
    return one;
  };
  return { pointer: at, rows, dim, length: objects.shapes.length, alone };
}

/** The tightest box around each object: see jostle.d.ts. */
export function bounds(core, objects, options) {
  const { margin = 0 } = options_of(options);
  return core.within(() => {
    const placed = place_objects(core, objects);
    const { rows, dim } = placed;
    const size = objects.shapes.length;
    const fits = objects.shapes.repeats && size > 0 && rows.count % size === 0;
    if (rows.count !== size && !fits)
      refuse(`there are ${size} shapes and ${rows.count} poses`, "size_mismatch");
    const out = core.scratch.take(2 * dim * rows.count * size_of(rows.type));
    core.call(
      "jostle_bounds",
      space_of(dim, rows.type),
      placed.pointer,
      number(margin, "margin"),
      core.executor,
      out,
    );
    return core.view(rows.type, out, 2 * dim * rows.count).slice();
  });
}

/** Packs poses: see jostle.d.ts. */
export function poses(positions, options) {
  const { dim, rotations } = options_of(options);
  checked_dim(dim);
  if (!(positions instanceof Float32Array || positions instanceof Float64Array))
    refuse(`positions are ${describe(positions)}: they must be a Float32Array or a Float64Array`);
  refuse_detached(positions, "positions");
  if (positions.length % dim !== 0)
    refuse(`positions has ${positions.length} numbers: it must be a multiple of ${dim}`, "size_mismatch");
  const count = positions.length / dim, turn = dim === 3 ? 4 : 1, width = dim === 3 ? 7 : 4;
  if (rotations !== undefined && array_like(rotations, "rotations").length !== count * turn)
    refuse(
      `rotations has ${rotations.length} numbers: it must have ${turn} for each of ${count} positions`,
      "size_mismatch",
    );
  const packed = new_floats(type_of(positions), count * width);
  for (let i = 0; i < count; ++i) {
    for (let d = 0; d < dim; ++d) packed[i * width + d] = positions[i * dim + d];
    if (dim === 2) {
      packed[i * width + 2] = Math.cos(rotations?.[i] ?? 0);
      packed[i * width + 3] = Math.sin(rotations?.[i] ?? 0);
    } else if (rotations === undefined) packed[i * width + 6] = 1;
    else for (let c = 0; c < 4; ++c) packed[i * width + 3 + c] = rotations[4 * i + c];
  }
  return packed;
}
