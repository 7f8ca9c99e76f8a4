// SPDX-License-Identifier: MIT
// Rectangles by number, and queries about them: what jostle/rbush and jostle/flatbush are made with. Their
// constructors can't wait for a module, so that it is loaded with them.

import { Owned, describe } from "./core.js";
import { refuse } from "./error.js";
import { start } from "./start.js";

const core = await start("jostle-bush");
const { module, memory } = core;
const BOUNDS = ["minX", "minY", "maxX", "maxY"];

/** Refuses a rectangle, of an item of this number if there is one, that could never be found. */
export function check_rectangle(minX, minY, maxX, maxY, what, number) {
  if (
    minX <= maxX && minY <= maxY && typeof minX === "number" && typeof minY === "number" &&
    typeof maxX === "number" && typeof maxY === "number"
  )
    return;
  const bounds = [minX, minY, maxX, maxY], name = number === undefined ? what : `${what} ${number}`;
  bounds.forEach((bound, i) => {
    if (typeof bound !== "number" || Number.isNaN(bound))
      refuse(
        `${name} has ${BOUNDS[i]} = ${describe(bound)}: it must be a number`,
        Number.isNaN(bound) ? "nan_coordinate" : "invalid_argument",
        number,
        bounds,
      );
  });
  const axis = minX <= maxX ? 1 : 0;
  refuse(
    `${name} has ${BOUNDS[axis]} = ${bounds[axis]}, greater than ${BOUNDS[axis + 2]} = ${bounds[axis + 2]}`,
    "inverted_box",
    number,
    bounds,
  );
}

export class Bush extends Owned {
  #words = new Uint32Array(0);

  constructor() {
    super(core, "_jostle_js_bush_free", core.make("jostle_js_bush_new"));
  }

  /** All of memory, as it is now. */
  get #memory() {
    if (this.#words.buffer !== memory.buffer) this.#words = new Uint32Array(memory.buffer);
    return this.#words;
  }

  /** The rectangle must have been checked. */
  put(number, minX, minY, maxX, maxY) {
    const status = module._jostle_js_bush_put(this.pointer, number, minX, minY, maxX, maxY, core.error);
    if (status !== 0) core.fail(status);
  }
  /** Forgets all, and takes these: four numbers each, which must have been checked. */
  load(rectangles) {
    core.call("jostle_js_bush_load", this.pointer, rectangles.length / 4);
    const at = this.#memory[(this.pointer >> 2) + 2];
    new Float64Array(memory.buffer, at, rectangles.length).set(rectangles);
  }
  drop(number) {
    const status = module._jostle_js_bush_drop(this.pointer, number, core.error);
    if (status !== 0) core.fail(status);
  }
  clear() {
    module._jostle_js_bush_clear(this.pointer);
  }

  /** The numbers of the rectangles that touch this one, ascending; with `items`, these by their numbers. */
  search(minX, minY, maxX, maxY, items) {
    const status = module._jostle_js_bush_search(this.pointer, minX, minY, maxX, maxY, core.error);
    if (status !== 0) core.fail(status);
    return this.#answers(items);
  }
  /** All numbers, those of rectangles that are near each other together. */
  order() {
    const status = module._jostle_js_bush_order(this.pointer, core.error);
    if (status !== 0) core.fail(status);
    return this.#answers();
  }
  any(minX, minY, maxX, maxY) {
    const status = module._jostle_js_bush_any(this.pointer, minX, minY, maxX, maxY, core.error);
    if (status !== 0) core.fail(status);
    return this.#memory[this.pointer >> 2] !== 0;
  }
  /** The numbers of the nearest, by their distance and number. */
  nearest(x, y, count, maxDistance) {
    const status = module._jostle_js_bush_nearest(this.pointer, x, y, count, maxDistance, core.error);
    if (status !== 0) core.fail(status);
    return this.#answers();
  }

  #answers(items) {
    const words = this.#memory, view = this.pointer >> 2;
    const first = words[view + 1] >> 2, end = first + words[view], found = [];
    if (items === undefined) for (let i = first; i < end; ++i) found.push(words[i]);
    else for (let i = first; i < end; ++i) found.push(items[words[i]]);
    return found;
  }
}
