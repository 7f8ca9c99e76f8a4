// SPDX-License-Identifier: MIT
// What programs know as the package flatbush: see flatbush.d.ts.

import { Bush, check_rectangle } from "./bush.js";
import { describe, whole } from "./core.js";
import { refuse } from "./error.js";

// In the order of the numbers that flatbush's data has for them.
const ARRAYS = [
  Int8Array, Uint8Array, Uint8ClampedArray, Int16Array, Uint16Array, Int32Array, Uint32Array, Float32Array,
  Float64Array,
];
const MAGIC = 0xfb, VERSION = 3;

export class Flatbush {
  #bush = new Bush();
  #added = 0;
  #finished = false;
  #boxes;
  #Buffer;
  #data;

  constructor(numItems, nodeSize = 16, ArrayType = Float64Array, ArrayBufferType = ArrayBuffer) {
    if (!ARRAYS.includes(ArrayType)) refuse(`ArrayType is ${describe(ArrayType)}: it must be a typed array`);
    this.numItems = whole(+numItems, "numItems", 1);
    this.nodeSize = Math.min(Math.max(+nodeSize, 2), 65535);
    this.ArrayType = ArrayType;
    this.#Buffer = ArrayBufferType;
    this.#boxes = new ArrayType(4 * this.numItems);
    this.minX = this.minY = Infinity;
    this.maxX = this.maxY = -Infinity;
  }

  add(minX, minY, maxX = minX, maxY = minY) {
    const number = this.#added, boxes = this.#boxes, at = 4 * number;
    if (number === this.numItems) refuse(`add: there are ${number} items already, as many as were announced`);
    boxes[at] = minX; // as ArrayType has them from here on
    boxes[at + 1] = minY;
    boxes[at + 2] = maxX;
    boxes[at + 3] = maxY;
    check_rectangle(boxes[at], boxes[at + 1], boxes[at + 2], boxes[at + 3], "item", number);
    if (boxes[at] < this.minX) this.minX = boxes[at];
    if (boxes[at + 1] < this.minY) this.minY = boxes[at + 1];
    if (boxes[at + 2] > this.maxX) this.maxX = boxes[at + 2];
    if (boxes[at + 3] > this.maxY) this.maxY = boxes[at + 3];
    return this.#added++;
  }
  finish() {
    if (this.#added !== this.numItems)
      refuse(`finish: ${this.#added} items were added, and ${this.numItems} announced`);
    this.#bush.load(this.#boxes);
    this.#bush.any(0, 0, 0, 0); // the index is made before the first query
    this.#finished = true;
  }

  search(minX, minY, maxX, maxY, filter) {
    this.#want_finished();
    const found = this.#bush.search(minX, minY, maxX, maxY);
    return filter === undefined
      ? found
      : found.filter((number) => filter(number, ...this.#rectangle(number)));
  }
  collides(minX, minY, maxX, maxY, filter) {
    this.#want_finished();
    if (filter !== undefined)
      return this.#bush
        .search(minX, minY, maxX, maxY)
        .some((number) => filter(number, ...this.#rectangle(number)));
    return this.#bush.any(minX, minY, maxX, maxY);
  }
  neighbors(x, y, maxResults = Infinity, maxDistance = Infinity, filter) {
    this.#want_finished();
    if (maxResults !== Infinity) whole(maxResults, "maxResults");
    const most = Math.min(maxResults, this.numItems), found = [];
    // Squares that overflow are infinite, and nothing is further than that.
    const distance = maxDistance * maxDistance === Infinity ? Infinity : maxDistance;
    if (filter === undefined) return this.#bush.nearest(x, y, most, distance);
    let wanted = most, seen = 0;
    while (found.length < most) {
      const nearest = this.#bush.nearest(x, y, Math.min(wanted, this.numItems), distance);
      // The nearest are ahead in the longer list, too.
      for (const number of nearest.slice(seen))
        if (found.length < most && filter(number)) found.push(number);
      if (nearest.length < wanted) break;
      seen = wanted;
      wanted *= 2;
    }
    return found;
  }

  /** In flatbush's own format, of which jostle reads the items alone. */
  get data() {
    this.#want_finished();
    this.#data ??= this.#written();
    return this.#data;
  }
  /** From what flatbush or this class has written. */
  static from(data, byteOffset = 0) {
    if (
      !(data instanceof ArrayBuffer) &&
      !(typeof SharedArrayBuffer === "function" && data instanceof SharedArrayBuffer)
    )
      refuse(`data is ${describe(data)}: it must be an ArrayBuffer or SharedArrayBuffer`);
    if (byteOffset % 8 !== 0) refuse(`byteOffset is ${describe(byteOffset)}: it must be a multiple of 8`);
    if (data.byteLength < byteOffset + 8)
      refuse(`data has ${data.byteLength} bytes: they are no flatbush`, "bad_file");
    const head = new DataView(data, byteOffset, 8),
      ArrayType = ARRAYS[head.getUint8(1) & 15];
    if (head.getUint8(0) !== MAGIC || head.getUint8(1) >> 4 !== VERSION || ArrayType === undefined)
      refuse(`data is not in version ${VERSION} of flatbush's format`, "bad_file");
    const count = head.getUint32(4, true);
    const made = new Flatbush(count, head.getUint16(2, true), ArrayType, data.constructor);
    const places = levels(count, made.nodeSize).at(-1),
      Indices = index_array(places);
    const size = 8 + 4 * places * ArrayType.BYTES_PER_ELEMENT + places * Indices.BYTES_PER_ELEMENT;
    if (data.byteLength < byteOffset + size)
      refuse(`data has ${data.byteLength - byteOffset} bytes: ${count} items take ${size}`, "bad_file");
    const boxes = new ArrayType(data, byteOffset + 8, 4 * places);
    const indices = new Indices(data, byteOffset + 8 + boxes.byteLength, places);
    const at = new Uint32Array(count).fill(places);
    for (let place = 0; place < count; ++place) at[indices[place]] = place;
    for (let number = 0; number < count; ++number) {
      if (at[number] === places) refuse(`data has no item ${number}`, "bad_file", number);
      made.add(...boxes.subarray(4 * at[number], 4 * at[number] + 4));
    }
    made.finish();
    return made;
  }

  get IndexArrayType() {
    return index_array(levels(this.numItems, this.nodeSize).at(-1));
  }
  dispose() {
    this.#bush.dispose();
  }

  #want_finished() {
    if (!this.#finished) refuse("this index isn't finished: call finish()");
  }
  #rectangle(number) {
    return this.#boxes.subarray(4 * number, 4 * number + 4);
  }

  /** Head, boxes of the items and of the nodes, level by level, then what each of them is of. */
  #written() {
    const { numItems, nodeSize, ArrayType } = this;
    const ends = levels(numItems, nodeSize),
      places = ends.at(-1),
      Indices = index_array(places);
    const floats = 4 * places * ArrayType.BYTES_PER_ELEMENT;
    const data = new this.#Buffer(8 + floats + places * Indices.BYTES_PER_ELEMENT);
    const head = new DataView(data);
    head.setUint8(0, MAGIC);
    head.setUint8(1, (VERSION << 4) + ARRAYS.indexOf(ArrayType));
    head.setUint16(2, nodeSize, true);
    head.setUint32(4, numItems, true);
    const boxes = new ArrayType(data, 8, 4 * places),
      indices = new Indices(data, 8 + floats, places);
    this.#bush.order().forEach((number, place) => {
      boxes.set(this.#rectangle(number), 4 * place);
      indices[place] = number;
    });
    for (let level = 0, at = numItems; level + 1 < ends.length; ++level)
      for (let first = level === 0 ? 0 : ends[level - 1]; first < ends[level]; first += nodeSize, ++at) {
        const children = boxes.subarray(4 * first, 4 * Math.min(first + nodeSize, ends[level]));
        const node = boxes.subarray(4 * at, 4 * at + 4);
        node.set(children.subarray(0, 4));
        for (let i = 4; i < children.length; i += 4) {
          node[0] = Math.min(node[0], children[i]);
          node[1] = Math.min(node[1], children[i + 1]);
          node[2] = Math.max(node[2], children[i + 2]);
          node[3] = Math.max(node[3], children[i + 3]);
        }
        indices[at] = 4 * first; // where its first child's box begins
      }
    return data;
  }
}
export default Flatbush;

/** Where each level ends, in boxes: the items, their nodes, and so on up to one. */
function levels(count, nodeSize) {
  const ends = [count];
  for (let nodes = count; ends.length === 1 || nodes > 1;) {
    nodes = Math.ceil(nodes / nodeSize);
    ends.push(ends.at(-1) + nodes);
  }
  return ends;
}
function index_array(places) {
  return places < 16384 ? Uint16Array : Uint32Array;
}
