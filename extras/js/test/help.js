// SPDX-License-Identifier: MIT
// What the tests share: the package as it was installed, and slow twins.
import { load } from "jostle";

/** The modules there are, each loaded once. */
export const modules = {
  simd: () => (loaded.simd ??= load()),
  plain: () => (loaded.plain ??= load({ simd: false })),
  threads: () => (loaded.threads ??= load({ threads: 3 })),
};
const loaded = {};

/** Numbers in [0, 1), the same in every run. */
export function random(seed) {
  let state = seed >>> 0 || 1;
  return () => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return (state >>> 0) / 2 ** 32;
  };
}

/** The same for small seeds, of which the first numbers would all be near 0. */
export function spread(seed) {
  return random(Math.imul(seed, 0x9e3779b1));
}

export function random_boxes(
  count,
  dim,
  seed,
  { Array = Float32Array, world = Math.cbrt(count) * 2, whole = false } = {},
) {
  const next = random(seed);
  const boxes = new Array(2 * dim * count);
  for (let i = 0; i < count; ++i)
    for (let d = 0; d < dim; ++d) {
      const lo = next() * world,
        edge = next() * 3;
      boxes[2 * dim * i + d] = whole ? Math.floor(lo) : lo;
      boxes[2 * dim * i + dim + d] = boxes[2 * dim * i + d] + (whole ? Math.floor(edge) : edge);
    }
  return boxes;
}

export function overlaps(boxes, i, others, j, dim) {
  for (let d = 0; d < dim; ++d)
    if (
      boxes[2 * dim * i + d] > others[2 * dim * j + dim + d] ||
      others[2 * dim * j + d] > boxes[2 * dim * i + dim + d]
    )
      return false;
  return true;
}

/** The definition: all pairs ascending, as text. */
export function slow_pairs(boxes, dim, wanted = () => true) {
  const pairs = [];
  const count = boxes.length / (2 * dim);
  for (let i = 0; i < count; ++i)
    for (let j = i + 1; j < count; ++j)
      if (overlaps(boxes, i, boxes, j, dim) && wanted(i, j)) pairs.push(i, j);
  return pairs;
}
export function slow_pairs_between(boxes, others, dim, wanted = () => true) {
  const pairs = [];
  for (let i = 0; i < boxes.length / (2 * dim); ++i)
    for (let j = 0; j < others.length / (2 * dim); ++j)
      if (overlaps(boxes, i, others, j, dim) && wanted(i, j)) pairs.push(i, j);
  return pairs;
}

/** FNV-1a over 64-bit numbers, their lowest byte first: as tests/platforms/platforms_test.cpp has it. */
export class Hash {
  #low = 0x84222325;
  #high = 0xcbf29ce4;
  #byte(byte) {
    const low = (this.#low ^ byte) >>> 0;
    // times 2^40 + 0x1b3, 16 bits at a time
    const a = (low & 0xffff) * 0x1b3, b = (low >>> 16) * 0x1b3 + (a >>> 16);
    this.#high = (Math.imul(this.#high, 0x1b3) + Math.floor(b / 65536) + (low << 8)) >>> 0;
    this.#low = (((b & 0xffff) << 16) | (a & 0xffff)) >>> 0;
  }
  add(...numbers) {
    for (const number of numbers) {
      let rest = number;
      for (let byte = 0; byte < 8; ++byte) {
        this.#byte(rest & 0xff);
        rest = Math.floor(rest / 256);
      }
    }
  }
  add_bytes(bytes) {
    for (const byte of bytes) this.add(byte);
  }
  get value() {
    return ((BigInt(this.#high) << 32n) | BigInt(this.#low)).toString(16);
  }
}
