// SPDX-License-Identifier: MIT
// What programs know as the package rbush: see rbush.d.ts.

import { Bush, check_rectangle } from "./bush.js";
import { describe } from "./core.js";
import { refuse } from "./error.js";

export class RBush {
  #bush = new Bush();
  #items = []; // by number; undefined where there is none
  #spare = []; // the numbers of none
  #numbers; // from an item to its number: made when one is first removed or updated
  #earlier = new Map(); // from a number to that of the same item, inserted before

  all() {
    return this.#items.filter((item) => item !== undefined);
  }

  search(bbox) {
    const { minX, minY, maxX, maxY } = wanted(bbox);
    return this.#bush.search(minX, minY, maxX, maxY, this.#items);
  }
  collides(bbox) {
    const { minX, minY, maxX, maxY } = wanted(bbox);
    return this.#bush.any(minX, minY, maxX, maxY);
  }

  load(items) {
    if (items && items.length) this.#add(items, this.#rectangles(items));
    return this;
  }
  insert(item) {
    if (item) this.#add([item], this.#rectangles([item]));
    return this;
  }
  clear() {
    this.#bush.clear();
    this.#items = [];
    this.#spare = [];
    this.#numbers = undefined;
    this.#earlier.clear();
    return this;
  }

  remove(item, equals) {
    if (!item) return this;
    let gone = item;
    if (equals) {
      const { minX, minY, maxX, maxY } = wanted(this.toBBox(item));
      gone = this.search({ minX, minY, maxX, maxY }).find((other) => equals(item, other));
    }
    const number = this.#number_of(gone);
    if (number === undefined) return this;
    this.#bush.drop(number);
    this.#spare.push(number);
    this.#items[number] = undefined;
    if (this.#earlier.has(number)) {
      this.#numbers.set(gone, this.#earlier.get(number));
      this.#earlier.delete(number);
    } else {
      this.#numbers.delete(gone);
    }
    return this;
  }
  update(item) {
    const number = this.#number_of(item);
    if (number === undefined) refuse(`update: ${describe(item)} isn't in the tree`);
    const { minX, minY, maxX, maxY } = this.toBBox(item);
    check_rectangle(minX, minY, maxX, maxY, "the item");
    this.#bush.put(number, minX, minY, maxX, maxY);
    return this;
  }

  toBBox(item) {
    return item;
  }
  compareMinX(a, b) {
    return a.minX - b.minX;
  }
  compareMinY(a, b) {
    return a.minY - b.minY;
  }

  /** A tree of one leaf, as rbush itself has them. */
  toJSON() {
    const children = this.all();
    const node = {
      children,
      height: 1,
      leaf: true,
      minX: Infinity,
      minY: Infinity,
      maxX: -Infinity,
      maxY: -Infinity,
    };
    for (const item of children) {
      const { minX, minY, maxX, maxY } = this.toBBox(item);
      node.minX = Math.min(node.minX, minX);
      node.minY = Math.min(node.minY, minY);
      node.maxX = Math.max(node.maxX, maxX);
      node.maxY = Math.max(node.maxY, maxY);
    }
    return node;
  }
  /** Any tree of rbush's. */
  fromJSON(data) {
    const items = [],
      nodes = [data];
    while (nodes.length !== 0) {
      const node = nodes.pop();
      if (!Array.isArray(node?.children)) refuse(`fromJSON: ${describe(node)} is no node of a tree`);
      for (const child of node.children) (node.leaf ? items : nodes).push(child);
    }
    const rectangles = this.#rectangles(items);
    this.clear();
    this.#add(items, rectangles);
    return this;
  }

  dispose() {
    this.#bush.dispose();
  }

  /** Four numbers for each item: all are known to be right before the first is taken. */
  #rectangles(items) {
    const all = new Float64Array(4 * items.length);
    for (let i = 0; i < items.length; ++i) {
      const bbox = this.toBBox(items[i]);
      if (bbox === null || typeof bbox !== "object")
        refuse(`item ${i} has ${describe(bbox)} for its box`, "invalid_argument", i);
      const { minX, minY, maxX, maxY } = bbox;
      check_rectangle(minX, minY, maxX, maxY, "item", i);
      all[4 * i] = minX;
      all[4 * i + 1] = minY;
      all[4 * i + 2] = maxX;
      all[4 * i + 3] = maxY;
    }
    return all;
  }
  #add(items, rectangles) {
    if (this.#items.length === 0) {
      this.#bush.load(rectangles);
      this.#items = Array.from(items);
      this.#numbers = undefined;
      return;
    }
    for (let i = 0; i < items.length; ++i) {
      const number = this.#spare.pop() ?? this.#items.length, at = 4 * i;
      this.#bush.put(number, rectangles[at], rectangles[at + 1], rectangles[at + 2], rectangles[at + 3]);
      this.#items[number] = items[i];
      if (this.#numbers !== undefined) this.#name(items[i], number);
    }
  }
  #name(item, number) {
    const before = this.#numbers.get(item);
    if (before !== undefined) this.#earlier.set(number, before);
    this.#numbers.set(item, number);
  }
  #number_of(item) {
    if (this.#numbers === undefined) {
      const numbers = (this.#numbers = new Map()), items = this.#items;
      let named = 0;
      for (let number = 0; number < items.length; ++number)
        if (items[number] !== undefined) numbers.set(items[number], (++named, number));
      if (numbers.size !== named) { // some are there twice, which hardly any program does
        numbers.clear();
        items.forEach((each, number) => each !== undefined && this.#name(each, number));
      }
    }
    return this.#numbers.get(item);
  }
}
export default RBush;

function wanted(bbox) {
  if (bbox === null || typeof bbox !== "object")
    refuse(`the box is ${describe(bbox)}: it must have minX, ...`);
  return bbox;
}
