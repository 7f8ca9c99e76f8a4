// The way of a box through the engine: from input to bricks, and from bricks to pairs.
import type { Bricks, Jostle } from "jostle";

import type { BrickList, Inside, Path, Partner } from "./messages";
import { grouped } from "./numbers";
import type { Source } from "./sources";

/**
 * The bricks that have records, drawn about `origin`, and, where a box is given, its way. `pairs` are those
 * of the last search.
 */
export function pathOf(
  jostle: Jostle,
  source: Source,
  origin: readonly number[],
  box: number | undefined,
  pairs: Uint32Array,
): { path: Path | undefined; list: BrickList } {
  // Before bricks are asked for: what a search found lies in the module's memory.
  const partners: number[] = [];
  if (box !== undefined)
    for (let i = 0; i < pairs.length; i += 2) {
      if (pairs[i] === box) partners.push(pairs[i + 1]!);
      if (pairs[i + 1] === box) partners.push(pairs[i]!);
    }
  partners.sort((a, b) => a - b);

  const { dim } = source;
  const bricks = jostle.bricks(source.boxes, { dim });
  const count = bricks.first.length - 1;
  const bounds = new Float32Array(6 * count);
  const records = new Uint32Array(count);
  for (let k = 0; k < count; ++k) {
    records[k] = bricks.first[k + 1]! - bricks.first[k]!;
    for (let axis = 0; axis < dim; ++axis) {
      const from = bricks.origin[axis]! + bricks.at[dim * k + axis]! * bricks.edge[axis]! - origin[axis]!;
      bounds[6 * k + axis] = from;
      bounds[6 * k + 3 + axis] = from + bricks.edge[axis]!;
    }
  }
  const list: BrickList = { bounds, records };
  if (box === undefined) return { path: undefined, list };

  // Which bricks hold each box of interest, and on which axes it began in a lower one.
  const wanted = new Set([box, ...partners]);
  const copies = new Map<number, Map<number, number>>();
  for (let k = 0; k < count; ++k)
    for (let r = bricks.first[k]!; r < bricks.first[k + 1]!; ++r) {
      const object = bricks.objects[r]!;
      if (!wanted.has(object)) continue;
      let of = copies.get(object);
      if (of === undefined) copies.set(object, (of = new Map()));
      of.set(k, bricks.copies[r]!);
    }
  const mine = copies.get(box) ?? new Map<number, number>();
  const { numbers } = source;
  const partner = (other: number): Partner => {
    const overlap: number[] = [];
    for (let axis = 0; axis < dim; ++axis) {
      const a = 2 * dim * box + axis;
      const b = 2 * dim * other + axis;
      overlap.push(Math.min(numbers[a + dim]!, numbers[b + dim]!) - Math.max(numbers[a]!, numbers[b]!));
    }
    // Of the bricks that both lie in, one has no axis on which both began earlier: it owns the pair.
    let owner = -1;
    for (const [k, flags] of copies.get(other) ?? [])
      if (mine.has(k) && (flags & mine.get(k)!) === 0) owner = k;
    return { box: other, name: nameOf(source, other), overlap, owner };
  };
  // The box begins in one of its bricks: there it is no copy on any axis.
  let home: number | undefined;
  for (const [k, flags] of mine) if (flags === 0) home = k;
  const inside =
    home === undefined
      ? undefined
      : insideOf(bricks, home, box, dim, list.bounds.subarray(6 * home, 6 * home + 6));
  const path = {
    box,
    name: nameOf(source, box),
    bricks: [...mine.keys()],
    partners: partners.map(partner),
    inside,
  };
  return { path, list };
}

function nameOf({ ids }: Source, box: number): string {
  return ids?.[box] ?? `Box ${grouped(box)}`;
}

/** The records of the brick in which a box begins, and which is drawn at `drawn`. */
function insideOf(bricks: Bricks, brick: number, box: number, dim: number, drawn: Float32Array): Inside {
  const { sweepAxis, quanta } = bricks;
  const records = [];
  for (let r = bricks.first[brick]!; r < bricks.first[brick + 1]!; ++r) {
    const bounds = [...bricks.bounds.subarray(2 * dim * r, 2 * dim * r + 2 * dim)];
    const [lo, hi] = [0, 1].map((side) => bounds.filter((_, k) => k % 2 === side)) as [number[], number[]];
    records.push({ box: bricks.objects[r]!, lo, hi, copies: bricks.copies[r]! });
  }
  records.sort((a, b) => a.lo[sweepAxis]! - b.lo[sweepAxis]! || a.box - b.box);
  const own = records.findIndex((record) => record.box === box);
  let end = own + 1;
  while (end < records.length && records[end]!.lo[sweepAxis]! <= records[own]!.hi[sweepAxis]!) ++end;
  const bounds = new Float32Array(6 * records.length);
  records.forEach(({ lo, hi }, r) => {
    for (let axis = 0; axis < dim; ++axis) {
      const from = drawn[axis]!;
      const quantum = (drawn[axis + 3]! - from) / quanta;
      bounds[6 * r + axis] = from + lo[axis]! * quantum;
      bounds[6 * r + 3 + axis] = from + hi[axis]! * quantum;
    }
  });
  return { brick, sweepAxis, quanta, records, own, end, bounds };
}
