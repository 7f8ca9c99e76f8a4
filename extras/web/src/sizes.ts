// Boxes of very different sizes, made from those of a scene.

/** splitmix32, so that the same seed gives the same sizes everywhere. */
export function randomNumbers(seed: number): () => number {
  let state = seed | 0;
  return () => {
    state = (state + 0x9e3779b9) | 0;
    let z = state ^ (state >>> 16);
    z = Math.imul(z, 0x21f0aaad);
    z ^= z >>> 15;
    z = Math.imul(z, 0x735a2d97);
    return ((z ^ (z >>> 15)) >>> 0) / 2 ** 32;
  };
}

/**
 * What each box's edges are multiplied by, so that the largest factor is about `ratio` times the smallest.
 * Small boxes are the most common; the mean volume stays, so that the scene is about as full as before.
 */
export function sizeFactors(count: number, seed: number, ratio: number): Float32Array {
  if (ratio <= 1) return new Float32Array(count).fill(1);
  const exponent = 2.5; // of the density of edges
  const tail = 1 - ratio ** (1 - exponent);
  const random = randomNumbers(seed);
  const factors = Float32Array.from({ length: count }, () => (1 - random() * tail) ** (1 / (1 - exponent)));
  const volume = factors.reduce((sum, factor) => sum + factor ** 3, 0);
  const shrink = Math.cbrt(count / Math.max(volume, 1));
  return factors.map((factor) => factor * shrink);
}

/**
 * Writes boxes (lo x, y, z, hi x, y, z) whose edges are those of `from` times their factors, about the same
 * centres.
 */
export function resize(from: Float32Array, factors: Float32Array, to: Float32Array): void {
  for (let box = 0, at = 0; box < factors.length; ++box, at += 6)
    for (let axis = at; axis < at + 3; ++axis) {
      const centre = (from[axis]! + from[axis + 3]!) / 2;
      const half = ((from[axis + 3]! - from[axis]!) / 2) * factors[box]!;
      to[axis] = centre - half;
      to[axis + 3] = centre + half;
    }
}
