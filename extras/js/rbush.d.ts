// SPDX-License-Identifier: MIT
/**
 * Rectangles of objects that come, go and move: what programs know as the package rbush, answered by a
 * `BoxIndex` of Jostle's.
 *
 *     import { RBush } from "jostle/rbush";       // instead of: import RBush from "rbush";
 *
 * It differs from rbush in this:
 *
 * Order  of answers is its own, the same on every machine. rbush's is another.
 * Errors A box with NaN or without a bound, or whose lower bound is above the upper one, is a `JostleError`
 *        that names the item, and nothing is taken; so is such a box to `search` and `collides`. rbush takes
 *        it, and loses items by it. Infinite bounds are fine in both.
 * remove finds an item by what it is (===), also if its box has changed since.
 * Tuning `maxEntries`, `compareMinX` and `compareMinY` have no effect.
 *
 * Changes are applied by the next query: many at once cost much less than one by one.
 */
export interface BBox {
  minX: number;
  minY: number;
  maxX: number;
  maxY: number;
}

export class RBush<T = BBox> {
  constructor(maxEntries?: number);
  /** Adds an item, or all of an array. The same item may be in it several times. */
  insert(item: T): this;
  load(items: readonly T[]): this;
  /**
   * Removes an item, if it is there. With `equals` one that touches the item's box and for which
   * equals(item, other) holds.
   */
  remove(item: T, equals?: (a: T, b: T) => boolean): this;
  /** Reads the box of an item again, after it has moved. An item that isn't there is a `JostleError`. */
  update(item: T): this;
  clear(): this;

  /** The items whose boxes touch `bbox`. */
  search(bbox: BBox): T[];
  /** Whether there are any. */
  collides(bbox: BBox): boolean;
  all(): T[];

  /** To be overridden where items have no minX, minY, maxX and maxY of their own. */
  toBBox(item: T): BBox;
  compareMinX(a: T, b: T): number;
  compareMinY(a: T, b: T): number;

  /** A tree that rbush reads, too; and any tree of rbush's or of this class. */
  toJSON(): BBox & { children: T[]; height: number; leaf: boolean };
  fromJSON(data: object): this;

  /** Gives the memory back at once. What is forgotten is freed by the garbage collector. */
  dispose(): void;
}
export default RBush;
