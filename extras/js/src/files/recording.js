// SPDX-License-Identifier: MIT
// Recordings of moving boxes, .jrec: version 1, which `jostle simulate --record` writes, is compressed,
// version 2, of jostle::Recorder, is plain. Both are described in tool/scenes/recording.cpp and
// docs/guide/tool.md.
import { describe } from "../core.js";
import { refuse } from "../error.js";
import { refuse_file } from "./file.js";
import { unpack } from "./zstd.js";

const fixed_header = 40;
const longest_description = 1 << 16;
const unclosed = 0xffffffffffffffffn;

/** A checksum over 64 bits in two halves: h = (h ^ x) * 0x100000001b3, from h = 0xcbf29ce484222325. */
class Sum {
  #low = 0x84222325;
  #high = 0xcbf29ce4;

  /** Takes up to 32 bits, and as many above them. */
  add(low, high = 0) {
    const a = (this.#low ^ low) >>> 0;
    const b = (this.#high ^ high) >>> 0;
    // (b, a) * (0x100, 0x1b3), modulo 2^64.
    const product = (a & 0xffff) * 0x1b3;
    const upper = (a >>> 16) * 0x1b3 + Math.floor(product / 0x10000);
    this.#low = ((upper & 0xffff) * 0x10000 + (product & 0xffff)) >>> 0;
    this.#high = (Math.imul(b, 0x1b3) + Math.imul(a, 0x100) + Math.floor(upper / 0x10000)) >>> 0;
  }
  equals(view, at) {
    return view.getUint32(at, true) === this.#low && view.getUint32(at + 4, true) === this.#high;
  }
}

class Recording {
  ids = undefined;
  #bytes;
  #name;
  #view;
  #plain;
  #size; // bytes of a coordinate
  #objects;
  #first; // where frames begin
  // Where reading goes on.
  #at;
  #next = 0;
  #last;
  #before_last;

  constructor(bytes, name) {
    this.#bytes = bytes;
    this.#name = name;
    const view = (this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length));
    if (bytes.length < fixed_header || String.fromCharCode(...bytes.subarray(0, 7)) !== "JOSTLRE")
      this.#fail("is no recording of moving boxes (.jrec); give one");
    const version = bytes[7];
    if (version !== 1 && version !== 2)
      this.#fail(
        `is a recording of version ${version} and this program reads versions 1 and 2; use a newer one`,
      );
    this.#plain = version === 2;
    const description = view.getUint32(20, true);
    const altered = "was altered in its header; copy or record it again";
    if (description > longest_description) this.#fail(altered);
    const end = fixed_header + description;
    if (bytes.length < end + 8)
      this.#fail("is truncated: it ends inside the header; copy or record it again");
    const sum = new Sum();
    for (let i = 0; i < end; ++i) sum.add(bytes[i]);
    this.dim = view.getUint32(8, true);
    this.#size = view.getUint32(12, true);
    if (!sum.equals(view, end) || ![2, 3].includes(this.dim) || ![4, 8].includes(this.#size))
      this.#fail(altered);
    this.#objects = view.getUint32(16, true);
    this.#first = this.#at = end + 8;
    const frames = view.getBigUint64(24, true);
    this.frames = this.#plain && frames === unclosed ? this.#count_frames() : Number(frames);
    if (this.frames === 0) this.#fail("has no frames; record it again");
    this.frame(0);
  }

  get boxes() {
    return this.frame(0);
  }

  frame(number = 0) {
    if (!Number.isInteger(number) || number < 0 || number >= this.frames)
      refuse(`frame is ${describe(number)}: it must be a whole number below ${this.frames}`);
    if (number < this.#next - 1 || this.#last === undefined) {
      this.#at = this.#first;
      this.#next = 0;
    }
    while (this.#next <= number) {
      const boxes = this.#plain ? this.#read_plain() : this.#read_packed();
      [this.#before_last, this.#last] = [this.#last, boxes];
      ++this.#next;
    }
    return this.#last.slice(); // the caller may write into it
  }

  #fail(what) {
    refuse_file(this.#name, what);
  }
  #fail_altered() {
    this.#fail(`was altered in frame ${this.#next + 1} of ${this.frames}; copy or record it again`);
  }
  #require(size) {
    if (this.#at + size > this.#bytes.length)
      this.#fail(
        `is truncated: it ends inside frame ${this.#next + 1} of ${this.frames}; copy or record it again`,
      );
  }

  /** Of a recorder that wasn't closed: the frames that are complete. */
  #count_frames() {
    let frames = 0;
    for (let at = this.#first; at + 12 <= this.#bytes.length; ) {
      const boxes = this.#view.getUint32(at, true);
      at += 12 + boxes * 2 * this.dim * this.#size;
      if (at > this.#bytes.length) break;
      this.#objects = Math.max(this.#objects, boxes);
      ++frames;
    }
    return frames;
  }

  #numbers(length) {
    return this.#size === 4 ? new Float32Array(length) : new Float64Array(length);
  }

  #read_plain() {
    const view = this.#view, size = this.#size;
    this.#require(4);
    const count = view.getUint32(this.#at, true);
    if (count > this.#objects) this.#fail_altered();
    const length = count * 2 * this.dim;
    this.#require(4 + length * size + 8);
    let at = this.#at + 4;
    const sum = new Sum();
    sum.add(count);
    const boxes = this.#numbers(length);
    for (let i = 0; i < length; ++i, at += size) {
      if (size === 4) {
        sum.add(view.getUint32(at, true));
        boxes[i] = view.getFloat32(at, true);
      } else {
        sum.add(view.getUint32(at, true), view.getUint32(at + 4, true));
        boxes[i] = view.getFloat64(at, true);
      }
    }
    if (!sum.equals(view, at)) this.#fail_altered();
    this.#at = at + 8;
    return boxes;
  }

  /** Differences to what the two frames before let expect, as planes of bytes. */
  #read_packed() {
    this.#require(4);
    const packed = this.#view.getUint32(this.#at, true);
    this.#require(4 + packed);
    const length = 2 * this.dim * this.#objects;
    const from = this.#at + 4;
    const planes = unpack(this.#bytes.subarray(from, from + packed), 4 + length * this.#size);
    if (planes === undefined || new DataView(planes.buffer).getUint32(0, true) !== this.#next)
      this.#fail_altered();
    const boxes = this.#numbers(length);
    if (this.#size === 4) this.#unfold32(planes, boxes);
    else this.#unfold64(planes, boxes);
    this.#at = from + packed;
    return boxes;
  }

  /** Goes through the coordinates in the order in which they are stored, with what is expected of each. */
  #each_expected(boxes, round, visit) {
    const { dim } = this;
    const objects = this.#objects, next = this.#next, last = this.#last, before_last = this.#before_last;
    const finite = (expected, otherwise) => (Number.isFinite(expected) ? expected : otherwise);
    for (let axis = 0; axis < dim; ++axis)
      for (let i = 0; i < objects; ++i) {
        const lo = 2 * dim * i + axis;
        const hi = lo + dim;
        let expected = 0;
        if (next === 1) expected = last[lo];
        if (next >= 2) expected = finite(round(last[lo] + round(last[lo] - before_last[lo])), last[lo]);
        boxes[lo] = visit(2 * axis, i, expected);
        // An upper bound moves as the lower one does, but for turning.
        expected = next === 0 ? boxes[lo] : finite(round(last[hi] + round(boxes[lo] - last[lo])), last[hi]);
        boxes[hi] = visit(2 * axis + 1, i, expected);
      }
  }

  #unfold32(planes, boxes) {
    const objects = this.#objects;
    const float = new Float32Array(1);
    const bits = new Uint32Array(float.buffer);
    this.#each_expected(boxes, Math.fround, (coordinate, i, expected) => {
      let at = 4 + coordinate * 4 * objects + i;
      let folded = planes[at];
      for (let shift = 8; shift < 32; shift += 8) folded |= planes[(at += objects)] << shift;
      float[0] = expected;
      // Integers in the order of the numbers, so that near numbers have a small difference.
      const ordered = bits[0] >>> 31 ? ~bits[0] : bits[0] | 0x80000000;
      const value = (ordered + ((folded >>> 1) ^ -(folded & 1))) | 0;
      bits[0] = value < 0 ? value & 0x7fffffff : ~value;
      return float[0];
    });
  }

  #unfold64(planes, boxes) {
    const objects = this.#objects;
    const float = new Float64Array(1);
    const bits = new BigUint64Array(float.buffer);
    const sign = 1n << 63n;
    const all = 2n ** 64n - 1n;
    const same = (value) => value;
    this.#each_expected(boxes, same, (coordinate, i, expected) => {
      let at = 4 + coordinate * 8 * objects + i;
      let folded = 0n;
      for (let shift = 0n; shift < 64n; shift += 8n, at += objects) folded |= BigInt(planes[at]) << shift;
      float[0] = expected;
      const ordered = bits[0] & sign ? ~bits[0] & all : bits[0] | sign;
      const value = (ordered + ((folded >> 1n) ^ (folded & 1n ? all : 0n))) & all;
      bits[0] = value & sign ? value & ~sign : ~value & all;
      return float[0];
    });
  }
}

export function read_recording(bytes, name) {
  return new Recording(bytes, name);
}
