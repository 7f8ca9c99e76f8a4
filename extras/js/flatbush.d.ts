// SPDX-License-Identifier: MIT
/**
 * Rectangles that stay, by number: what programs know as the package flatbush, answered by a `BoxIndex` of
 * Jostle's.
 *
 *     import { Flatbush } from "jostle/flatbush"; // instead of: import Flatbush from "flatbush";
 *
 * It differs from flatbush in this:
 *
 * Order  `search` gives ascending numbers. Neighbors that are equally far away
 *        come by their number.
 * Errors A rectangle with NaN, or whose lower bound is above the upper one, is a `JostleError` that names the
 *        item, as such a rectangle is to `search` and `collides`. A point to `neighbors` must be finite.
 *        Infinite bounds are fine.
 * Zero   neighbors are none if `maxResults` is 0; flatbush gives all.
 */
export type TypedArrayConstructor =
  | Int8ArrayConstructor
  | Uint8ArrayConstructor
  | Uint8ClampedArrayConstructor
  | Int16ArrayConstructor
  | Uint16ArrayConstructor
  | Int32ArrayConstructor
  | Uint32ArrayConstructor
  | Float32ArrayConstructor
  | Float64ArrayConstructor;

export class Flatbush {
  /**
   * For so many rectangles, whose bounds are kept as `ArrayType` has them. `nodeSize` has an effect on `data`
   * alone.
   */
  constructor(
    numItems: number,
    nodeSize?: number,
    ArrayType?: TypedArrayConstructor,
    ArrayBufferType?: ArrayBufferConstructor | SharedArrayBufferConstructor,
  );
  /** From `data` of this class or of flatbush's. The index is rebuilt. */
  static from(data: ArrayBuffer | SharedArrayBuffer, byteOffset?: number): Flatbush;

  /** Returns the number of the rectangle: 0, 1, ... */
  add(minX: number, minY: number, maxX?: number, maxY?: number): number;
  /** Call this when all are added, before any query. */
  finish(): void;

  /** The numbers of what touches the rectangle, of which the filter may keep some. */
  search(
    minX: number,
    minY: number,
    maxX: number,
    maxY: number,
    filter?: (index: number, x0: number, y0: number, x1: number, y1: number) => unknown,
  ): number[];
  /** Whether there are any. */
  collides(
    minX: number,
    minY: number,
    maxX: number,
    maxY: number,
    filter?: (index: number, x0: number, y0: number, x1: number, y1: number) => unknown,
  ): boolean;
  /** The nearest to a point, by distance. */
  neighbors(
    x: number,
    y: number,
    maxResults?: number,
    maxDistance?: number,
    filter?: (index: number) => unknown,
  ): number[];

  /** In flatbush's format, version 3, which flatbush reads, too. Made when first read. */
  readonly data: ArrayBuffer | SharedArrayBuffer;
  readonly numItems: number;
  readonly nodeSize: number;
  readonly ArrayType: TypedArrayConstructor;
  readonly IndexArrayType: Uint16ArrayConstructor | Uint32ArrayConstructor;
  /** The bounds of all that was added. */
  readonly minX: number;
  readonly minY: number;
  readonly maxX: number;
  readonly maxY: number;

  /** Gives the memory back at once. What is forgotten is freed by the garbage collector. */
  dispose(): void;
}
export default Flatbush;
