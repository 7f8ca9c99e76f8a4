// Recordings of moving boxes, .jrec: version 1, which `jostle simulate --record` writes, is compressed,
// version 2, of jostle::Recorder, is plain. Both are described in scenes/recording.cpp and
// docs/guide/tool.md.
import { ZSTDDecoder } from "three/addons/libs/zstddec.module.js";

import { FileError, type Boxes, type Numbers } from "./boxes";

const fixedHeader = 40;
const longestDescription = 1 << 16;
const unclosed = 0xffffffffffffffffn;

/** A checksum over 64 bits in two halves: h = (h ^ x) * 0x100000001b3, from h = 0xcbf29ce484222325. */
class Sum {
  private low = 0x84222325;
  private high = 0xcbf29ce4;

  /** Takes up to 32 bits, and as many above them. */
  add(low: number, high = 0): void {
    const a = (this.low ^ low) >>> 0;
    const b = (this.high ^ high) >>> 0;
    // (b, a) * (0x100, 0x1b3), modulo 2^64.
    const product = (a & 0xffff) * 0x1b3;
    const upper = (a >>> 16) * 0x1b3 + Math.floor(product / 0x10000);
    this.low = ((upper & 0xffff) * 0x10000 + (product & 0xffff)) >>> 0;
    this.high = (Math.imul(b, 0x1b3) + Math.imul(a, 0x100) + Math.floor(upper / 0x10000)) >>> 0;
  }
  equals(view: DataView, at: number): boolean {
    return view.getUint32(at, true) === this.low && view.getUint32(at + 4, true) === this.high;
  }
}

class Recording implements Boxes {
  readonly dim: 2 | 3;
  readonly frames: number;
  private readonly view: DataView;
  private readonly plain: boolean;
  private readonly size: 4 | 8; // bytes of a coordinate
  private objects: number;
  private readonly first: number; // where frames begin
  // Where reading goes on.
  private at: number;
  private next = 0;
  private last: Numbers | undefined;
  private beforeLast: Numbers | undefined;

  constructor(
    private readonly bytes: Uint8Array<ArrayBuffer>,
    private readonly name: string,
    private readonly decoder: ZSTDDecoder,
  ) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
    const { view } = this;
    if (bytes.length < fixedHeader || String.fromCharCode(...bytes.subarray(0, 7)) !== "JOSTLRE")
      this.fail("is no recording of moving boxes (.jrec); give one");
    const version = bytes[7]!;
    if (version !== 1 && version !== 2)
      this.fail(
        `is a recording of version ${version} and this program reads versions 1 and 2; use a newer one`,
      );
    this.plain = version === 2;
    const description = view.getUint32(20, true);
    const altered = "was altered in its header; copy or record it again";
    if (description > longestDescription) this.fail(altered);
    const end = fixedHeader + description;
    if (bytes.length < end + 8) this.fail("is truncated: it ends inside the header; copy or record it again");
    const sum = new Sum();
    for (let i = 0; i < end; ++i) sum.add(bytes[i]!);
    const [dim, size] = [view.getUint32(8, true), view.getUint32(12, true)];
    if (!sum.equals(view, end) || (dim !== 2 && dim !== 3) || (size !== 4 && size !== 8)) this.fail(altered);
    this.dim = dim as 2 | 3;
    this.size = size as 4 | 8;
    this.objects = view.getUint32(16, true);
    this.first = this.at = end + 8;
    const frames = view.getBigUint64(24, true);
    this.frames = this.plain && frames === unclosed ? this.countFrames() : Number(frames);
    if (this.frames === 0) this.fail("has no frames; record it again");
  }

  private fail(what: string): never {
    throw new FileError(`${this.name}: ${what}`);
  }
  private failAltered(): never {
    this.fail(`was altered in frame ${this.next + 1} of ${this.frames}; copy or record it again`);
  }
  private require(size: number): void {
    if (this.at + size > this.bytes.length)
      this.fail(
        `is truncated: it ends inside frame ${this.next + 1} of ${this.frames}; copy or record it again`,
      );
  }

  /** Of a recorder that wasn't closed: the frames that are complete. */
  private countFrames(): number {
    let frames = 0;
    for (let at = this.first; at + 12 <= this.bytes.length; ) {
      const boxes = this.view.getUint32(at, true);
      at += 12 + boxes * 2 * this.dim * this.size;
      if (at > this.bytes.length) break;
      this.objects = Math.max(this.objects, boxes);
      ++frames;
    }
    return frames;
  }

  private numbers(length: number): Numbers {
    return this.size === 4 ? new Float32Array(length) : new Float64Array(length);
  }

  read(frame: number): Numbers {
    if (frame < this.next - 1 || this.last === undefined) {
      this.at = this.first;
      this.next = 0;
    }
    while (this.next <= frame) {
      const boxes = this.plain ? this.readPlain() : this.readPacked();
      [this.beforeLast, this.last] = [this.last, boxes];
      ++this.next;
    }
    return this.last!;
  }

  private readPlain(): Numbers {
    const { view, size } = this;
    this.require(4);
    const count = view.getUint32(this.at, true);
    if (count > this.objects) this.failAltered();
    const length = count * 2 * this.dim;
    this.require(4 + length * size + 8);
    this.at += 4;
    const sum = new Sum();
    sum.add(count);
    const boxes = this.numbers(length);
    for (let i = 0; i < length; ++i, this.at += size) {
      if (size === 4) {
        sum.add(view.getUint32(this.at, true));
        boxes[i] = view.getFloat32(this.at, true);
      } else {
        sum.add(view.getUint32(this.at, true), view.getUint32(this.at + 4, true));
        boxes[i] = view.getFloat64(this.at, true);
      }
    }
    if (!sum.equals(view, this.at)) this.failAltered();
    this.at += 8;
    return boxes;
  }

  /** Differences to what the two frames before let expect, as planes of bytes. */
  private readPacked(): Numbers {
    const { dim, objects, size } = this;
    this.require(4);
    const packed = this.view.getUint32(this.at, true);
    this.require(4 + packed);
    const unpacked = 4 + 2 * dim * size * objects;
    const planes = this.decoder.decode(this.bytes.subarray(this.at + 4, this.at + 4 + packed), unpacked);
    if (planes.length !== unpacked) this.failAltered(); // its checksum is wrong, or it isn't zstd's
    const { buffer, byteOffset } = planes;
    if (new DataView(buffer, byteOffset).getUint32(0, true) !== this.next) this.failAltered();
    this.at += 4 + packed;
    const boxes = this.numbers(2 * dim * objects);
    if (size === 4) this.unfold32(planes, boxes);
    else this.unfold64(planes, boxes);
    return boxes;
  }

  /** Goes through the coordinates in the order in which they are stored, with what is expected of each. */
  private eachExpected(
    boxes: Numbers,
    round: (value: number) => number,
    visit: (coordinate: number, object: number, expected: number) => number,
  ): void {
    const { dim, objects, next } = this;
    const finite = (expected: number, otherwise: number): number =>
      Number.isFinite(expected) ? expected : otherwise;
    for (let axis = 0; axis < dim; ++axis)
      for (let i = 0; i < objects; ++i) {
        const lo = 2 * dim * i + axis;
        const hi = lo + dim;
        let expected = 0;
        if (next === 1) expected = this.last![lo]!;
        if (next >= 2) {
          const now = this.last![lo]!;
          expected = finite(round(now + round(now - this.beforeLast![lo]!)), now);
        }
        boxes[lo] = visit(2 * axis, i, expected);
        // An upper bound moves as the lower one does, but for turning.
        expected =
          next === 0
            ? boxes[lo]!
            : finite(round(this.last![hi]! + round(boxes[lo]! - this.last![lo]!)), this.last![hi]!);
        boxes[hi] = visit(2 * axis + 1, i, expected);
      }
  }

  private unfold32(planes: Uint8Array, boxes: Numbers): void {
    const { objects } = this;
    const float = new Float32Array(1);
    const bits = new Uint32Array(float.buffer);
    this.eachExpected(boxes, Math.fround, (coordinate, i, expected) => {
      let at = 4 + coordinate * 4 * objects + i;
      let folded = planes[at]!;
      for (let shift = 8; shift < 32; shift += 8) folded |= planes[(at += objects)]! << shift;
      float[0] = expected;
      // Integers in the order of the numbers, so that near numbers have a small difference.
      const ordered = bits[0]! >>> 31 ? ~bits[0]! : bits[0]! | 0x80000000;
      const value = (ordered + ((folded >>> 1) ^ -(folded & 1))) | 0;
      bits[0] = value < 0 ? value & 0x7fffffff : ~value;
      return float[0];
    });
  }

  private unfold64(planes: Uint8Array, boxes: Numbers): void {
    const { objects } = this;
    const float = new Float64Array(1);
    const bits = new BigUint64Array(float.buffer);
    const sign = 1n << 63n;
    const all = 2n ** 64n - 1n;
    this.eachExpected(boxes, (value) => value, (coordinate, i, expected) => {
      let at = 4 + coordinate * 8 * objects + i;
      let folded = 0n;
      for (let shift = 0n; shift < 64n; shift += 8n, at += objects) folded |= BigInt(planes[at]!) << shift;
      float[0] = expected;
      const ordered = bits[0]! & sign ? ~bits[0]! & all : bits[0]! | sign;
      const value = (ordered + ((folded >> 1n) ^ (folded & 1n ? all : 0n))) & all;
      bits[0] = value & sign ? value & ~sign : ~value & all;
      return float[0];
    });
  }
}

export async function readRecording(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<Boxes> {
  const decoder = new ZSTDDecoder();
  await decoder.init();
  return new Recording(bytes, name, decoder);
}
