// SPDX-License-Identifier: MIT
// What is known of casts and distances besides ids, as arrays.

import { new_floats, size_of } from "./core.js";
import * as C from "./structs.js";

/** Reads jostle_cast_hit_...s: { size of one in bytes, read(pointer, count) }. */
export function cast_hits_at(core, dim, type) {
  const layout = C[`jostle_cast_hit_${dim}${type === "float64" ? "d" : "f"}`];
  const read = (out, count) => {
    const numbers = core.view(type, out, (count * layout.sizeof) / size_of(type));
    const whole = core.view("uint32", out, (count * layout.sizeof) / 4);
    const column = (to, from, member, length, size) => {
      for (let i = 0; i < count; ++i)
        for (let d = 0; d < length; ++d)
          to[i * length + d] = from[(i * layout.sizeof + layout[member]) / size + d];
      return to;
    };
    const floats = (member, length) =>
      column(new_floats(type, count * length), numbers, member, length, size_of(type));
    const integers = (member) => column(new Uint32Array(count), whole, member, 1, 4);
    return {
      fractions: floats("fraction", 1),
      normals: floats("normal", dim),
      points: floats("point", dim),
      parts: integers("part"),
      movingParts: integers("moving_part"),
    };
  };
  return { size: layout.sizeof, read };
}

/** The same of rows of a number, called `first`, a normal and two vectors. */
export function distances_at(core, dim, type, first = "distances") {
  const width = 3 * dim + 1;
  const read = (out, count) => {
    const rows = core.view(type, out, count * width);
    const column = (from, length) => {
      const numbers = new_floats(type, count * length);
      for (let i = 0; i < count; ++i)
        for (let d = 0; d < length; ++d) numbers[i * length + d] = rows[i * width + from + d];
      return numbers;
    };
    return {
      [first]: column(0, 1),
      normals: column(1, dim),
      fromA: column(1 + dim, dim),
      fromB: column(1 + 2 * dim, dim),
    };
  };
  return { size: width * size_of(type), read };
}
