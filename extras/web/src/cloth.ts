// A cloth that falls over a ball and onto itself, as examples/cloth.cpp has it: position-based dynamics. What
// is near is pushed apart, and no vertex moves further than until something meets: so no edge ever passes
// through a triangle.
import type { JostleSurfaces, NearParts, PartImpacts, Surface, SurfaceFinder } from "jostle";

import { clothSize, type Cloth } from "./messages";

const { ball, floor } = clothSize;
const dt = 1 / 120;
const stepsAFrame = 2;
const solverRounds = 6;
const stoppingRounds = 4;
const friction = 0.2;
/** After so many frames it lies still, and is hung up again. */
const lifetime = 480;

export class FallingCloth {
  readonly triangles: Uint32Array<ArrayBuffer>;
  readonly surface: Surface;
  positions: Float64Array;
  frame = 0;
  /** Of all steps of the last frame. */
  crossings = 0;
  /** What of the cloth is near itself, and what finding that took. */
  near: { vertexTriangle: NearParts; edgeEdge: NearParts };
  ms = 0;

  private readonly finder: SurfaceFinder;
  private readonly hanging: Float64Array;
  private readonly speeds: Float64Array;
  private next: Float64Array;
  /** Each two vertices, how far apart they are at rest, and how much of what is missing they move. */
  private readonly ends: Uint32Array;
  private readonly lengths: Float64Array;
  private readonly stiffness: Float64Array;
  private readonly thickness: number;

  /** With about so many triangles. Another seed hangs it up elsewhere above the ball. */
  constructor(jostle: JostleSurfaces, triangles: number, seed: number) {
    const n = Math.max(2, Math.round(Math.sqrt(triangles / 2)) + 1); // vertices along each side
    const edge = clothSize.side / (n - 1);
    this.thickness = 0.12 * edge;
    const part = (k: number): number => (seed * k) % 1;
    const turn = 2 * Math.PI * part(0.3819660113);
    const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
    this.hanging = new Float64Array(3 * n * n);
    const corners: number[] = [];
    const springs: [number, number, number, number][] = [];
    for (let y = 0; y < n; ++y)
      for (let x = 0; x < n; ++x) {
        const k = y * n + x;
        const u = x * edge - (0.4 + 0.15 * part(0.6180339887)) * clothSize.side;
        const v = y * edge - (0.4 + 0.15 * part(0.7548776662)) * clothSize.side;
        this.hanging.set([u * cos - v * sin, ball + 0.3 + 0.05 * u, u * sin + v * cos], 3 * k);
        if (x + 1 < n) springs.push([k, k + 1, edge, 1]);
        if (y + 1 < n) springs.push([k, k + n, edge, 1]);
        if (x + 1 === n || y + 1 === n) continue;
        // Diagonals give way, and only keep it from folding sharply.
        springs.push([k, k + n + 1, edge * Math.SQRT2, 0.3], [k + 1, k + n, edge * Math.SQRT2, 0.3]);
        corners.push(k, k + n, k + 1, k + 1, k + n, k + n + 1);
      }
    this.triangles = Uint32Array.from(corners);
    this.ends = Uint32Array.from(springs.flatMap(([a, b]) => [a, b]));
    this.lengths = Float64Array.from(springs, ([, , length]) => length);
    this.stiffness = Float64Array.from(springs, ([, , , part]) => part);
    this.positions = this.hanging.slice();
    this.next = this.hanging.slice();
    this.speeds = new Float64Array(3 * n * n);
    this.surface = new jostle.Surface({ triangles: this.triangles });
    this.finder = new jostle.SurfaceFinder({ type: "float64" });
    this.near = this.findNear();
  }

  dispose(): void {
    this.finder.dispose();
    this.surface.dispose();
  }

  step(): void {
    if (++this.frame % lifetime === 0) {
      this.positions.set(this.hanging);
      this.speeds.fill(0);
      this.near = this.findNear();
    }
    this.crossings = 0;
    for (let step = 0; step < stepsAFrame; ++step) this.move();
  }

  /** How near the cloth is to itself at each vertex: 0 where it isn't, 1 where it touches. */
  nearness(): Float32Array<ArrayBuffer> {
    const all = new Float32Array(this.positions.length / 3);
    for (const { length, vertices, weights, distances } of [this.near.vertexTriangle, this.near.edgeEdge])
      for (let pair = 0; pair < length; ++pair)
        for (let k = 4 * pair; k < 4 * pair + 4; ++k)
          if (weights[k]! > 0)
            all[vertices[k]!] = Math.max(all[vertices[k]!]!, 1 - distances[pair]! / this.reach);
    return all;
  }

  private get reach(): number {
    return 1.5 * this.thickness;
  }
  private findNear(): { vertexTriangle: NearParts; edgeEdge: NearParts } {
    const begin = performance.now();
    const found = this.finder.near(this.surface, this.positions, this.reach);
    this.ms = performance.now() - begin;
    return found;
  }

  private move(): void {
    const { positions: at, next, speeds, finder, surface, near } = this;
    for (let k = 0; k < at.length; ++k) {
      speeds[k] = (speeds[k]! - (k % 3 === 1 ? 9.81 * dt : 0)) * 0.998;
      next[k] = at[k]! + speeds[k]! * dt;
    }
    for (let round = 0; round < solverRounds; ++round) {
      this.pullSprings();
      this.separate(near.vertexTriangle, 1);
      this.separate(near.edgeEdge, 2);
      this.keepOutside();
    }
    for (let round = 0; ; ++round) {
      // Stop what would meet; in the end everything, at the safe step.
      const moving = finder.moving(surface, at, next);
      if (moving.safeStep === 1) break;
      const last = round === stoppingRounds;
      const parts = new Float64Array(at.length / 3).fill(last ? 0.8 * moving.safeStep : 1);
      for (const pairs of [moving.vertexTriangle, moving.edgeEdge]) stopAt(pairs, parts);
      for (let k = 0; k < at.length; ++k)
        next[k] = at[k]! + (next[k]! - at[k]!) * parts[Math.floor(k / 3)]!;
      if (last) break;
    }
    for (let k = 0; k < at.length; ++k) speeds[k] = (next[k]! - at[k]!) / dt;
    [this.positions, this.next] = [next, at];
    this.near = this.findNear();
    this.crossings += finder.crossings(surface, next).length / 2;
  }

  private pullSprings(): void {
    const { ends, lengths, stiffness, next } = this;
    for (let spring = 0; spring < lengths.length; ++spring) {
      const a = 3 * ends[2 * spring]!;
      const b = 3 * ends[2 * spring + 1]!;
      const [x, y, z] = [next[b]! - next[a]!, next[b + 1]! - next[a + 1]!, next[b + 2]! - next[a + 2]!];
      const length = Math.sqrt(x * x + y * y + z * z);
      const push = (0.5 * stiffness[spring]! * (length - lengths[spring]!)) / (length + 1e-12);
      next[a]! += x * push;
      next[a + 1]! += y * push;
      next[a + 2]! += z * push;
      next[b]! -= x * push;
      next[b + 1]! -= y * push;
      next[b + 2]! -= z * push;
    }
  }

  /** Pushes the parts of pairs that are nearer than the cloth is thick, each vertex by its weight. */
  private separate({ length, vertices, weights, normals }: NearParts, ofFirst: number): void {
    const { next, thickness } = this;
    for (let pair = 0; pair < length; ++pair) {
      let squares = 0;
      let gap = 0;
      for (let k = 0; k < 4; ++k) {
        const weight = weights[4 * pair + k]!;
        const v = 3 * vertices[4 * pair + k]!;
        squares += weight * weight;
        for (let axis = 0; axis < 3; ++axis)
          gap += (k < ofFirst ? -weight : weight) * next[v + axis]! * normals[3 * pair + axis]!;
      }
      const push = Math.max(0, thickness - gap) / squares;
      for (let k = 0; k < 4; ++k) {
        const weight = weights[4 * pair + k]!;
        const v = 3 * vertices[4 * pair + k]!;
        for (let axis = 0; axis < 3; ++axis)
          next[v + axis]! += (k < ofFirst ? -push : push) * weight * normals[3 * pair + axis]!;
      }
    }
  }

  /** Out of the ball and the floor, which also hold back what slides along them. */
  private keepOutside(): void {
    const { positions: at, next, thickness } = this;
    const height = (v: number): number => Math.hypot(next[v]!, next[v + 1]!, next[v + 2]!);
    for (let v = 0; v < next.length; v += 3) {
      if (height(v) >= ball + thickness && next[v + 1]! >= floor) continue;
      for (let axis = 0; axis < 3; ++axis) next[v + axis]! += friction * (at[v + axis]! - next[v + axis]!);
      const out = Math.max(1, (ball + thickness) / height(v));
      for (let axis = 0; axis < 3; ++axis) next[v + axis]! *= out;
      next[v + 1] = Math.max(next[v + 1]!, floor);
    }
  }

  /** What is drawn. */
  drawn(): Cloth {
    return {
      positions: Float32Array.from(this.positions),
      triangles: this.triangles.slice(),
      nearness: this.nearness(),
      near: this.near.vertexTriangle.length + this.near.edgeEdge.length,
      crossings: this.crossings,
      ms: this.ms,
    };
  }
}

/** No vertex of a pair that meets goes further than nearly to there. */
function stopAt({ vertices, times }: PartImpacts, parts: Float64Array): void {
  for (let k = 0; k < vertices.length; ++k)
    parts[vertices[k]!] = Math.min(parts[vertices[k]!]!, 0.8 * times[k >> 2]!);
}
