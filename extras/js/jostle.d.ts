// SPDX-License-Identifier: MIT
/**
 * Jostle: which of a million moving objects touch, exactly, this frame.
 *
 *     import { load } from "jostle";
 *     const jostle = await load();
 *     const boxes = new Float32Array([0, 0, 2, 2,  1, 1, 3, 3,  5, 5, 6, 6]);  // lower bounds, then upper
 *     jostle.findPairs(boxes, { dim: 2 });                                      // Uint32Array [0, 1]
 *
 * Boxes  are one flat array: for each box `dim` lower bounds, then `dim` upper ones. A Float32Array or a
 *        Float64Array says which numbers they are. Boxes are closed, so that touching counts.
 * Order  is the same on every machine and any number of threads.
 * Memory An array that lies in the module's memory (see `array`) is read in place, others are copied into it.
 *        What a call returns belongs to the caller, unless its comment says that it is a view. Objects with
 *        `dispose()` hold memory of the module: dispose of them, or leave it to the garbage collector.
 * Null   instead of options, or of any one of them, counts as left out.
 * Errors Every mistake is a `JostleError` that names the object, and leaves everything unchanged.
 */

/** What was wrong with the data that a call was given. */
export class JostleError extends Error {
  /** The lowest object at fault; undefined where no single object is. */
  readonly index: number | undefined;
  /**
   * "nan_coordinate", "inverted_box", "size_mismatch", "invalid_argument", "stale_id", "bad_snapshot",
   * "bad_file", "out_of_memory", ...
   */
  readonly status: string;
  /** What was given there: the box's numbers for a bad box; undefined where no single value is at fault. */
  readonly value: number | number[] | string | undefined;
  constructor(message: string, status?: string, index?: number, value?: number | number[] | string);
}

export interface LoadOptions {
  /**
   * A smaller module: "2d" or "3d" has everything in float32 and that many dimensions, without the
   * simulations, which are of 3D; "pairs" has what JostlePairs has. Where there are to be threads, and where
   * there is no SIMD, it is the whole one. "surfaces" has what JostleSurfaces has, and the whole one has not:
   * on one thread, with SIMD or an error.
   */
  only?: "pairs" | "surfaces" | "2d" | "3d";
  /**
   * The module, where it doesn't lie beside the package's own files: its bytes, its address, a response, or a
   * compiled module. It must be the one that the other options ask for: jostle.wasm, jostle-threads.wasm,
   * that of `only`, such as jostle-3d.wasm, or with `simd: false` jostle-plain.wasm. A function is given such
   * a name.
   */
  wasm?: ModuleSource | ((file: string) => ModuleSource);
  /**
   * false: the module without SIMD, which gives the same answers, in about twice the time, on one thread.
   * true: one with SIMD or an error. Left out, the one that this browser understands; `instructionSet` says
   * which it is.
   */
  simd?: boolean;
  /**
   * 1 by default. More need a page that is cross-origin isolated (`support.threads` says); 0 for one per
   * core.
   */
  threads?: number;
  /** The most memory that the module may take, in bytes. By default 2 GB. */
  maxMemory?: number;
}

/** Where a module's code comes from. */
export type ModuleSource =
  URL | string | ArrayBuffer | Uint8Array | WebAssembly.Module | Response | PromiseLike<Response>;

/** What this browser, or node, has. */
export const support: {
  /** SIMD instructions, and exceptions: what every module but jostle-plain.wasm needs. */
  readonly simd: boolean;
  /** Shared memory: more than one thread. */
  readonly threads: boolean;
};

/** Boxes that were read from a file. */
export interface BoxFile {
  readonly dim: Dimension;
  /** Of a recording; else 1. */
  readonly frames: number;
  /** The boxes of the first frame, as the file has them: float64 from CSV, else what is in it. */
  readonly boxes: FloatArray;
  /** What a table's column `id` calls the boxes; undefined where there is none. */
  readonly ids: readonly string[] | undefined;
  /** The boxes of a frame, counted from 0. Going through them in order is the fastest. */
  frame(number: number): FloatArray;
}
/**
 * Reads boxes from what is in a file; its name's extension says what it is:
 *
 * .csv   a table, whose first line may name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z], or xmin, minx
 *        and their like, or x,y[,z],w,h[,d] with sizes, and maybe id
 * .npy   an array of NumPy's, float32 or float64, of shape (n, 2, dim) or (n, 2 * dim)
 * .jrec  a recording, of `jostle simulate --record` or of a program with `jostle::Recorder`
 *
 * A JostleError with the status "bad_file" begins with the name, of a table also with the line and the
 * column; it has the box as `index` and the text that stands there as `value`. NaN and inverted boxes are
 * refused in tables; in other files a search refuses them, or `checkBoxes`.
 */
export function readBoxes(content: ArrayBuffer | ArrayBufferView | string, name: string): BoxFile;

/** Loads the module. Modules are independent: each has memory and threads of its own. */
export function load(options: LoadOptions & { only: "pairs" }): Promise<JostlePairs>;
export function load(options: LoadOptions & { only: "surfaces" }): Promise<JostleSurfaces>;
export function load(options?: LoadOptions & { only?: "2d" | "3d" }): Promise<Jostle>;

/**
 * All pairs among boxes, or of one of `boxes` and one of `other`, as the method of the same name finds them:
 * by a module with pairs alone, which the first call loads.
 *
 *     import { findPairs } from "jostle";
 *     await findPairs(boxes, { dim: 2 });     // Uint32Array [0, 1]: the numbers of the boxes
 */
export function findPairs(boxes: Floats, options: FindOptions): Promise<Uint32Array>;
export function findPairs(boxes: Floats, other: Floats, options: FindOptions): Promise<Uint32Array>;

export type Dimension = 2 | 3;
export type NumberType = "float32" | "float64";
export type FloatArray = Float32Array | Float64Array;
/** Numbers to read: an array of the caller's own, or one in the module's memory. */
export type Floats = FloatArray | MemoryArray<FloatArray>;
/** One uint32 for each object. */
export type Integers = Uint32Array | MemoryArray<Uint32Array>;
/** Ids of a world's objects, as World.add() returns them. */
export type Ids = Float64Array | readonly number[];

declare global {
  // What a program may do without: TypeScript has it in its library "dom", and node's types have some of it.
  interface Response {}
  interface URL {}
  namespace WebAssembly {
    interface Module {}
  }
  interface SymbolConstructor {
    /** As TypeScript has it from 5.2 on, for `using`. */
    readonly dispose: unique symbol;
  }
}

/**
 * What gives its memory back: `using finder = new jostle.PairFinder()` does so, too, where there is
 * Symbol.dispose.
 */
export interface Disposable {
  /** Gives all memory back. Any later use is a JostleError; disposing again does nothing. */
  dispose(): void;
  /** The same, where there is Symbol.dispose. */
  [Symbol.dispose](): void;
  readonly disposed: boolean;
}

/**
 * An array in the module's own memory, for input that is written in place, frame after frame.
 *
 *     const boxes = jostle.array("float32", 6 * 500_000);
 *     boxes.view[0] = 1;                          // take `view` again after every call of Jostle
 *     finder.find(boxes, { dim: 3 });             // no copy
 */
export interface MemoryArray<A extends ArrayBufferView = FloatArray> extends Disposable {
  /**
   * The numbers. When memory grows, earlier views have no elements any more: take `view` again, it costs
   * nothing. Keep the array as long as its views: they don't keep it from being collected, and then show
   * memory that others use.
   */
  readonly view: A;
  readonly length: number;
}

// --- Pairs -----------------------------------------------------------------------------------------------

/** Which pairs are wanted; what isn't given filters nothing. */
export interface Filter {
  /**
   * Bit sets, one per box: a pair counts if each box's category has a bit in common with the other's mask.
   */
  category?: Integers;
  mask?: Integers;
  /** Boxes of one owner don't pair; 2**32 - 1 means no owner. */
  owner?: Integers;
  /** The same for the second set. */
  categoryB?: Integers;
  maskB?: Integers;
  ownerB?: Integers;
  /**
   * Three numbers a box, 2**32 - 1 where it has fewer: boxes of one set with one in common don't pair, as
   * triangles that share a vertex.
   */
  vertices?: Integers;
  /** The last so many boxes of one set are ghosts, which meet the others and not each other. */
  ghosts?: number;
  /**
   * Asked last, for each pair that the rest lets through. With several threads the search runs on one if this
   * is given.
   */
  accept?: (a: number, b: number) => boolean;
}

/** How pairs are handed over as they are found. */
export interface StreamOptions extends Filter {
  /** 2 or 3. */
  dim: Dimension;
}

export interface FindOptions extends StreamOptions {
  /** Pairs ascending by (a, b). Else they come by their place in space, which is the fastest. */
  sort?: boolean;
  /**
   * What finds them. "grid" is the library's own engine. "chapter" is the hierarchical hash grid that it grew
   * out of, "uniform" the same with one cell size (`cellSize`, by default the longest edge of all), "brute"
   * tests every box against every other. The other engines are for comparison: within one set, and without
   * filters; their order is their own.
   */
  engine?: Engine;
  /** The edge of the cells of "uniform". */
  cellSize?: number;
}
export type Engine = "grid" | "chapter" | "uniform" | "brute";

/** In space that repeats itself there is one set of boxes. */
export interface PeriodicOptions
  extends Pick<FindOptions, "dim" | "sort" | "category" | "mask" | "owner" | "vertices" | "accept"> {}

/** Of many scenes: numbers of boxes are those within their scene, except in the filter's arrays. */
export interface ScenesOptions
  extends Pick<FindOptions, "dim" | "category" | "mask" | "owner"> {
  accept?: (scene: number, a: number, b: number) => boolean;
}

/** What a search did. Times are in milliseconds. */
export interface FindStats {
  objects: number;
  pairs: number;
  /** Copies of boxes that were stored in bricks. */
  records: number;
  /** Pairs of records whose bounds were compared. */
  candidates: number;
  /** Candidates that only the user's numbers could decide. */
  ties: number;
  bricks: number;
  nestedGrids: number;
  bytesReserved: number;
  msTotal: number;
  /**
   * Stages: choosing the grid, sorting boxes into bricks, finding pairs in bricks, putting the result in
   * order.
   */
  msTune: number;
  msScatter: number;
  msSweep: number;
  msFinish: number;
}

/**
 * The broad phase, frame after frame. It keeps its working memory, so that a steady frame allocates nothing.
 */
export interface PairFinder extends Disposable {
  /**
   * All pairs among `boxes`, or of one of `boxes` and one of `other`: a0, b0, a1, b1, ...
   * The result is a view of the module's memory, valid until the next call of anything of Jostle's: `slice()`
   * it to keep it.
   */
  find(boxes: Floats, options: FindOptions): Uint32Array;
  find(boxes: Floats, other: Floats, options: FindOptions): Uint32Array;
  /** The pairs of the last search, as a view that is valid now. */
  readonly pairs: Uint32Array;
  /**
   * The order-independent fingerprint of the last search's pairs, as `jostle bench` prints it: 16 hexadecimal
   * digits.
   */
  readonly checksum: string;
  readonly stats: FindStats;
  /**
   * Hands the pairs over as they are found, so that any number of them fits: `pairs` is a view for the
   * duration of the call. Return false to stop. Returns whether it went to the end. On one thread, in the
   * order of `find`.
   */
  stream(boxes: Floats, options: StreamOptions, sink: (pairs: Uint32Array) => boolean | void): boolean;
  stream(
    boxes: Floats,
    other: Floats,
    options: StreamOptions,
    sink: (pairs: Uint32Array) => boolean | void,
  ): boolean;
  /** Gives working memory back; it is taken again when it is needed. */
  releaseMemory(): void;
}

/** The pairs of many scenes: those of scene k are `scenePairs.of(k)`, numbered within the scene. */
export interface ScenePairs {
  readonly pairs: Uint32Array;
  /** Those of scene k are numbers first[k] to first[k + 1] - 1 of `pairs`, each two numbers. */
  readonly first: Float64Array;
  readonly length: number;
  of(scene: number): Uint32Array;
}

/**
 * The grid of bricks that the engine chooses for boxes, and what it stores in it. See docs/inside/engine.md.
 */
export interface Bricks {
  /** How many bricks there are along each of the user's axes. */
  readonly cells: number[];
  /**
   * Where the first brick begins, and how long a brick is, along each of the user's axes. Border bricks reach
   * on to infinity.
   */
  readonly origin: number[];
  readonly edge: number[];
  /** The axis along which bricks are swept. */
  readonly sweepAxis: number;
  /**
   * The brick with records number k has the place at[dim * k], ... in the grid, counted along the user's
   * axes.
   */
  readonly at: Uint32Array;
  /** Its records are numbers first[k] to first[k + 1] - 1. */
  readonly first: Uint32Array;
  /** Of each record, in the order in which they were stored: the box that it is of. */
  readonly objects: Uint32Array;
  /** Of each record, one bit per axis of the user's: the box began in a lower brick there. */
  readonly copies: Uint8Array;
  /**
   * Of each record, for each of the user's axes: lower and upper bound in quanta, 0 to 16384 from the brick's
   * start.
   */
  readonly bounds: Uint16Array;
  /** How many quanta a brick's edge has. */
  readonly quanta: number;
}

// --- Scenes, falling bodies ------------------------------------------------------------------------------

export interface SceneInfo {
  readonly name: string;
  readonly summary: string;
  /** What the scene's world is sized for; 0 where it has no such aim. */
  readonly pairsPerObject: number;
  /** Made to break or slow an engine down. */
  readonly hostile: boolean;
}

export interface SceneOptions {
  dim?: Dimension;
  type?: NumberType;
}

/** Seeded boxes that move: the same bits as those of `jostle bench NAME -n N --seed S`. */
export interface Scene extends Disposable {
  readonly info: SceneInfo;
  readonly length: number;
  readonly dim: Dimension;
  /** The boxes of the present frame, in the module's memory: read in place by every search. */
  readonly boxes: MemoryArray<FloatArray>;
  readonly frame: number;
  /** On to the next frame. */
  step(): void;
}

export interface SimulationInfo {
  readonly name: string;
  readonly summary: string;
}

export interface SimulationOptions {
  scene?: string;
  bodies?: number;
  seed?: number | bigint;
}

/**
 * Falling bodies through the whole library: what `jostle simulate` runs. Metres, seconds, 60 frames a second.
 */
export interface Simulation extends Disposable {
  step(): void;
  readonly frame: number;
  readonly bodies: number;
  /** Pairs of boxes of the last step, and points of contact that pushed or rubbed. */
  readonly pairs: number;
  readonly contactPoints: number;
  readonly energy: number;
  readonly deepest: number;
  /** Of poses and velocities, bit by bit, as `jostle simulate` prints it: 16 hexadecimal digits. */
  readonly hash: string;
  /** Milliseconds of the last step's stages. */
  readonly times: { boxes: number; pairs: number; contacts: number; responses: number; motion: number };
  /** The bodies' boxes: 6 numbers each. A view, valid until the next call of anything of Jostle's. */
  readonly boxes: Float32Array;
  /** Position x, y, z and rotation as a quaternion x, y, z, w: 7 numbers a body. A view, as `boxes`. */
  readonly poses: Float32Array;
  /** Linear and angular velocity: 6 numbers a body. A copy. */
  readonly velocities: Float32Array;
  /** What each body is. Floor and walls are no bodies. */
  readonly shapes: SimulationShape[];
  /** Of each body, which of `shapes` it is. */
  readonly shapeOf: Uint8Array;
  /**
   * Of each body: the radius of a sphere, half the edge of a cube, the distance of an octahedron's corners
   * from its centre.
   */
  readonly sizes: Float32Array;
  /** The contacts of the last step; objects from `bodies` on are floor and walls. */
  contacts(): Contacts;
}
export type SimulationShape = "sphere" | "cube" | "octahedron";

// --- Neighbor lists --------------------------------------------------------------------------------------

/** Arrays of any kind. */
export type Rows<T> = ArrayLike<T> | ArrayLike<ArrayLike<T>> | ArrayLike<ArrayLike<ArrayLike<T>>>;

export interface NeighborOptions {
  /** Lengths, or a vector in each row; of many systems also such rows for each. Left out, space is open. */
  cell?: Rows<number>;
  /** Whether space repeats itself along the cell's vectors: one for all, or one for each. */
  periodic?: boolean | Rows<boolean | number>;
  /** By default true. false: each pair once, in the row of its lower point; not with `others`. */
  full?: boolean;
  /** Which members of Neighbors are wanted. By default "ij". */
  quantities?: string;
  /** A second set: the neighbours are among these. */
  others?: Floats;
  /** One for each of the others, where cutoff is one for each point. */
  cutoffB?: Floats | ArrayLike<number>;
  /** Of cutoffs of points a pair's is the greater, not the sum. */
  greater?: boolean;
  /** One whole number for each point: cutoff is a table then, one for each pair of types. */
  types?: ArrayLike<number>;
  typesB?: ArrayLike<number>;
  /**
   * Many systems in one array: where the points of each begin, and the end. All points are numbered in a row.
   */
  offsets?: ArrayLike<number>;
}

/** The requested quantities; each is the caller's. */
export interface Neighbors {
  /** The point, ascending, and its neighbour. */
  i: Uint32Array;
  j: Uint32Array;
  /** By how many of the cell's vectors the neighbour's image is shifted: `dim` numbers each. */
  S: Int32Array;
  /** From the point to that image: `dim` numbers each, of the points' type. */
  D: FloatArray;
  /** The length of that. */
  d: FloatArray;
  /** The neighbours of point i are j[o[i]] to j[o[i + 1] - 1], so that `i` isn't needed. */
  o: Float64Array;
}

/** Neighbour lists for steps of a simulation: a finder keeps its memory. */
export interface NeighborFinder extends Disposable {
  readonly dim: Dimension;
  readonly type: NumberType;
  /** As `neighbors`. */
  find(points: Floats, cutoff: number | Floats | ArrayLike<number>, options?: NeighborOptions): Neighbors;
  /**
   * False if the last call found the list that the skin had kept to be enough: with a skin, a search looks
   * that much further, and later calls choose from what it found while no point has moved half as far.
   */
  readonly searched: boolean;
  releaseMemory(): void;
}

// --- Surfaces that bend ----------------------------------------------------------------------------------

/**
 * What a surface is made of. Triangles may be given in any orientation, share edges in any number and need
 * not be connected; `edges` and `points` are for what belongs to no triangle, such as hair and grains.
 */
export interface SurfaceParts {
  /** Three vertices each. */
  triangles?: Integers;
  /** Two vertices each. */
  edges?: Integers;
  points?: Integers;
  /** How many there are; left out, as many as are named. */
  vertices?: number;
}

/** Which vertices make triangles and edges: what stays the same while a surface bends. */
export interface Surface extends Disposable {
  /** How many positions a call takes. */
  readonly vertices: number;
  /** As given. This, `edges` and `points` are new arrays each time. */
  readonly triangles: Uint32Array;
  /** Each once, the triangles' sides included: two vertices, the lower one first, ascending. */
  readonly edges: Uint32Array;
  /** The vertices that some triangle, edge or point names, ascending. */
  readonly points: Uint32Array;
}

export interface SurfaceOptions {
  /** One for each vertex. A pair is near within the distance and the sum of its parts' thicknesses. */
  thickness?: Floats;
  /** Three numbers for each vertex, the surface at rest: pairs that are near there are left out. */
  rest?: Floats;
  /** One for each vertex: parts of one body make no pair. */
  bodies?: Integers;
}

/** Pairs of a vertex and a triangle, or of two edges, that have no vertex in common. */
export interface SurfacePairs {
  readonly length: number;
  /** Two for each pair: the vertex and the number of the triangle, or the numbers of two edges. */
  readonly parts: Uint32Array;
  /** The four vertices of each pair: of both parts, in their order. */
  readonly vertices: Uint32Array;
}
/** Pairs that are near, in numbers of the finder's type. */
export interface NearParts extends SurfacePairs {
  /**
   * Four for each pair. The nearest points are the sums of these times the vertices: of a vertex and a
   * triangle the first is 1 and the others add up to 1; of two edges the first two add up to 1, and the
   * others.
   */
  readonly weights: FloatArray;
  /** Three for each pair: unit, from the vertex or first edge to the other part. */
  readonly normals: FloatArray;
  readonly distances: FloatArray;
}
/** Pairs that meet, and when: in [0, 1], never late. */
export interface PartImpacts extends SurfacePairs {
  readonly times: FloatArray;
}

/** Finds what of a surface is near itself. Keep it: it keeps its memory. What it returns is the caller's. */
export interface SurfaceFinder extends Disposable {
  /** That of the positions, three for each vertex. Everything is decided in double precision. */
  readonly type: NumberType;
  /** All pairs within `distance` of each other. */
  near(
    surface: Surface,
    positions: Floats,
    distance: number,
    options?: SurfaceOptions,
  ): { vertexTriangle: NearParts; edgeEdge: NearParts };
  /**
   * All pairs that come within `distance`, by default 0, while vertices move straight from `from` to `to`.
   * Until `safeStep`, the least of the times or 1, nothing does. `tolerance` is by default 1e-6.
   */
  moving(
    surface: Surface,
    from: Floats,
    to: Floats,
    distance?: number,
    options?: SurfaceOptions & { tolerance?: number },
  ): { vertexTriangle: PartImpacts; edgeEdge: PartImpacts; safeStep: number };
  /**
   * The edges that pass through triangles or touch them, decided exactly: numbers of an edge and a triangle,
   * two each. None: the surface doesn't cross itself.
   */
  crossings(surface: Surface, positions: Floats, options?: { bodies?: Integers }): Uint32Array;
  releaseMemory(): void;
}

// --- Queries ---------------------------------------------------------------------------------------------

/**
 * Many queries of one kind, in the numbers of the index's or world's boxes, one after another in an array:
 *
 * rays         origin, direction, greatest fraction: 2 dim + 1 numbers; see `rays()`
 * sweeps       a box, its motion, the greatest fraction: 3 dim + 1 numbers
 * boxes        what touches each of these boxes: 2 dim numbers
 * spheres      center and radius: dim + 1 numbers
 * frustums     for each an array of planes: normal and offset, dim + 1 numbers; inside is where
 *              normal . p + offset >= 0
 * nearest      points: dim numbers; the `count` boxes nearest to each, no further than maxDistance
 * nearestToBoxes  the same for boxes: 2 dim numbers
 *
 * Of shapes, where `objects` are given: rays, and
 * shapeSweeps  shapes that move from their poses by displacements, dim numbers each
 * posedShapes  what touches each of these shapes
 * nearestToShapes  the `count` shapes nearest to each of these, no further than maxDistance
 */
export type Queries =
  | { rays: Floats }
  | { sweeps: Floats }
  | { boxes: Floats }
  | { spheres: Floats }
  | { frustums: FloatArray[] }
  | { nearest: Floats; count?: number; maxDistance?: number }
  | { nearestToBoxes: Floats; count?: number; maxDistance?: number }
  | { shapeSweeps: Objects & { displacements: Floats } }
  | { posedShapes: Objects }
  | { nearestToShapes: Objects; count?: number; maxDistance?: number };

/** Which objects a query is about. */
export interface QueryFilter {
  /** The asker, as an object of a filter. */
  asker?: { category?: number; mask?: number; owner?: number };
  /** An object that doesn't count. */
  exclude?: number;
  accept?: (query: number, id: number) => boolean;
  /**
   * Shape and pose of each object, by id, of a world by the low 32 bits of the id: then the query is about
   * the shapes in the boxes.
   */
  objects?: Objects;
}
export interface IndexQueryFilter extends QueryFilter {
  /** One uint32 by id. They count where `asker` is given. */
  category?: Integers;
  mask?: Integers;
  owner?: Integers;
}

/** One answer for each query. */
export interface Hits {
  /** Where there is none, of an index -1, of a world 0. */
  readonly ids: Float64Array;
  /**
   * The least fraction at which the box or shape is touched; the squared distance of the nearest boxes, the
   * distance of the nearest shapes; infinite where there is none.
   */
  readonly at: Float64Array;
}

/** A list of answers for each query. */
export interface Answers<IdArray> {
  readonly length: number;
  /** Those to query i are numbers first[i] to first[i + 1] - 1 of `ids`, `at`. */
  readonly first: Float64Array;
  readonly ids: IdArray;
  /** As of Hits; of regions and posedShapes undefined. */
  readonly at: Float64Array | undefined;
  /** Of shapes along rays and sweeps, and of the nearest shapes: one for each of `ids`. */
  readonly details: CastHits | Distances | undefined;
  /** 1 where there are more answers than maxResults. */
  readonly more: Uint8Array;
  /** The ids of one query's answers: a view of `ids`. */
  of(query: number): IdArray;
}

/** What an index and a world answer alike. */
export interface Verbs<IdArray, F> {
  /** The first object along each ray or sweep, or the nearest. Of shapes it has their details as well. */
  first(queries: Queries, filter?: F): Hits & Partial<CastHits & Distances>;
  /**
   * All answers, or no more than maxResults to each: rays, sweeps, nearest ascending by (at, id), others by
   * id.
   */
  all(queries: Queries, options?: F & { maxResults?: number }): Answers<IdArray>;
  /**
   * Hands the answers to one query over as they are found: along rays and sweeps and to the nearest
   * ascending by (at, id). False stops; a number says that nothing further than that is wanted. Returns
   * whether all answers were handed over.
   */
  visit(query: Queries, visit: (id: number, at: number) => boolean | number | void, filter?: F): boolean;
  /** Whether there is any: 1 or 0. Not for the nearest. */
  any(queries: Queries, filter?: F): Uint8Array;
  /** How many there are. Not for the nearest. */
  count(queries: Queries, filter?: F): Float64Array;
}

export interface IndexOptions {
  dim: Dimension;
  type?: NumberType;
}

/**
 * Boxes that stay, and queries about them. An id is a number of the caller's own; by default the position.
 */
export interface BoxIndex extends Disposable, Verbs<Uint32Array, IndexQueryFilter> {
  readonly dim: Dimension;
  readonly type: NumberType;
  readonly size: number;
  /** Forgets everything and takes these boxes. */
  build(boxes: Floats, ids?: Integers): void;
  insert(boxes: Floats, ids: Integers): void;
  move(boxes: Floats, ids: Integers): void;
  erase(ids: Integers): void;
  clear(): void;
  contains(ids: Integers): Uint8Array;
  boxes(ids: Integers): FloatArray;
  /** All pairs of one of `boxes` and an object that it touches, ascending: position in `boxes`, id. */
  join(boxes: Floats): Uint32Array;
  readonly stats: {
    objects: number;
    pages: number;
    leaves: number;
    nodes: number;
    depth: number;
    bytes: number;
    sorts: number;
    splits: number;
  };
  releaseMemory(): void;
}

// --- World -----------------------------------------------------------------------------------------------

export interface WorldOptions {
  dim: Dimension;
  type?: NumberType;
  /** Every box is this much bigger on every side. */
  margin?: number;
  /**
   * Categories and masks that queries have, at most 8: each gets indexes of the objects that count alone. For
   * queries about few of many objects.
   */
  layers?: { category?: number; mask?: number }[];
  /** Asked once for each pair that would begin. */
  accept?: (a: number, b: number) => boolean;
}

export interface ObjectFilter {
  /** By default 1. */
  category?: number;
  /** By default all bits. */
  mask?: number;
  /** By default none. */
  owner?: number;
  isStatic?: boolean;
}

export interface AddOptions extends ObjectFilter {
  margin?: number;
  /** By default true. A disabled object keeps its id and box, and touches nothing. */
  enabled?: boolean;
}

export interface EndedPairs {
  /** a0, b0, a1, b1, ... as ids. */
  readonly pairs: Float64Array;
  /** Why: see `endReasons`. */
  readonly reasons: Uint8Array;
}
/** endReasons[reason]: "moved_apart", "removed", "disabled", "filtered". */
export const endReasons: readonly string[];

/** What the last update did. Times are in microseconds. */
export interface WorldStats {
  objects: number;
  resting: number;
  active: number;
  disabled: number;
  refused: number;
  commands: number;
  dropped: number;
  changed: number;
  woken: number;
  settled: number;
  candidates: number;
  falsePositives: number;
  listed: number;
  began: number;
  persisted: number;
  ended: number;
  bytesReserved: number;
  usTotal: number;
  usApply: number;
  usActive: number;
  usResting: number;
  usEvents: number;
  usIndex: number;
  contested: number;
}

/**
 * Objects that live, move and rest, and the pairs between them. Commands take effect in the next update.
 * An id is a whole number below 2^53, and no object's is 0. Its low 32 bits are a small index, good for
 * arrays (`jostle.indexOf(ids)`). Objects at rest cost nothing.
 */
export interface World extends Disposable, Verbs<Float64Array, QueryFilter> {
  readonly dim: Dimension;
  readonly type: NumberType;
  readonly size: number;
  /** Every index is less than this. */
  readonly indexEnd: number;

  /** As many new objects as boxes; their ids are good at once. Options of all, or an array of each one's. */
  add(boxes: Floats, options?: AddOptions | readonly AddOptions[]): Float64Array;
  /** Removes these objects, or none of them if one doesn't exist. */
  remove(ids: Ids): void;
  /**
   * New boxes; with displacements, `dim` numbers each, they touch what lies on their way in the coming step.
   */
  move(ids: Ids, boxes: Floats, options?: { displacements?: Floats; sequence?: number }): void;
  /** New edge lengths, `dim` numbers each, about the same centres. */
  resize(ids: Ids, sizes: Floats, options?: { sequence?: number }): void;
  setFilter(ids: Ids, filter: ObjectFilter, options?: { sequence?: number }): void;
  setMargin(ids: Ids, margin: number | Float64Array, options?: { sequence?: number }): void;
  setEnabled(ids: Ids, enabled: boolean | Uint8Array, options?: { sequence?: number }): void;
  /** 64 bits of the caller's own for each object, at once. */
  setUserData(ids: Ids, data: BigUint64Array): void;
  userData(ids: Ids): BigUint64Array;
  /**
   * In the next update the pairs of these objects, or the pairs of ids[i] and others[i], begin again if they
   * still touch. `accept` is asked about them again, also about those that it refused.
   */
  reportAgain(ids: Ids, others?: Ids): void;

  /**
   * Applies what was queued and finds out what that did to the pairs; with ids and boxes, moves those first.
   */
  update(): void;
  update(ids: Ids, boxes: Floats): void;
  /** Shows what was queued to queries, ahead of the next update. */
  apply(): void;

  /** Pairs that touch now and didn't before: ids a0, b0, a1, b1, ... ascending by index. */
  began(): Float64Array;
  /** Pairs that touched before and don't now, and why. */
  ended(): EndedPairs;
  /** Pairs that touched before and still do, and of which one object changed: by index. */
  persisted(): Uint32Array;
  /** Began and persisted as one list, by index: what ContactFinder.find wants. */
  changedPairs(): Uint32Array;
  /** All pairs that touch, by index. Costs as much as a search. */
  pairs(): Uint32Array;
  /** Who each of these objects touches, ascending by index. */
  touching(ids: Ids): Answers<Float64Array>;
  /** All pairs of one of `boxes` and an object that it touches: position in `boxes`, the object's index. */
  join(boxes: Floats, filter?: QueryFilter): Uint32Array;

  contains(ids: Ids): Uint8Array;
  /** The ids of these indices, 0 where there is none; without indices those of all objects. */
  ids(indices?: Integers): Float64Array;
  /** As they were given, and as they are compared. */
  boxes(ids: Ids): FloatArray;
  bounds(ids: Ids): FloatArray;
  /** The least box around all bounds; undefined if there are none. */
  boundsOfAll(): FloatArray | undefined;
  filters(ids: Ids): Required<ObjectFilter>[];
  enabled(ids: Ids): Uint8Array;
  margins(ids: Ids): Float64Array;

  /** The world as bytes, the same on every machine. */
  save(): Uint8Array;
  restore(snapshot: Uint8Array): void;
  /** Differences to a base: see docs/guide/world.md. */
  saveBase(): Uint8Array;
  saveChanges(): Uint8Array;
  restoreChanges(changes: Uint8Array): void;
  clear(): void;
  fork(): World;

  readonly stats: WorldStats;
  /** The numbers of `stats` in words. */
  explain(): string;
}

/**
 * Small numbers for pairs, as long as they touch: for arrays of what belongs to pairs. A pair that begins
 * gets the least that no pair had before the update; an update that was left out is an error.
 */
export interface PairSlots extends Disposable {
  /** What a world's began() and ended() tell, after every update. */
  update(began: Ids, ended: EndedPairs): void;
  /** The slot of each pair that began in the last update, and the one that each pair that ended had. */
  beganSlots(): Uint32Array;
  endedSlots(): Uint32Array;
  /** Those of pairs by index, such as changedPairs(); 2 ** 32 - 1 for one that doesn't touch. */
  slotsOf(pairs: Integers): Uint32Array;
  /** Every slot is less than this. */
  readonly end: number;
  /** The pairs and their slots, to go back to together with the world. */
  save(): Uint8Array;
  restore(slots: Uint8Array): void;
}

// --- Shapes, contacts ------------------------------------------------------------------------------------

/** One collision shape; it doesn't change. */
export interface Shape extends Disposable {
  readonly dim: Dimension;
  readonly type: string;
}

/** One shape for each object. */
export interface Shapes extends Disposable {
  readonly dim: Dimension;
  readonly length: number;
  add(shape: Shape, count?: number): void;
  addSpheres(radii: Float64Array): void;
  addCapsules(halfLengths: Float64Array, radii: Float64Array): void;
  /** Half the edges: `dim` numbers each. */
  addBoxes(halves: Float64Array): void;
  set(object: number, shape: Shape): void;
  clear(): void;
  /**
   * Whether the shapes serve for a whole multiple of `length` poses, over and over: object i has shape
   * i % length. So the shapes of a robot's links serve for any number of its configurations. At first false.
   */
  repeats: boolean;
}

/**
 * Contacts, number by number; all are copies. Contact i is of the pair pairs[2i], pairs[2i + 1], and has the
 * points first[i] to first[i + 1] - 1. A normal points from a to b; points are relative to the position of a,
 * and of b.
 */
export interface Contacts {
  readonly length: number;
  readonly pairs: Uint32Array;
  /** The part of a compound, or the triangle of a mesh: two for each contact. */
  readonly parts: Uint32Array;
  readonly normals: FloatArray;
  readonly first: Uint32Array;
  readonly fromA: FloatArray;
  readonly fromB: FloatArray;
  readonly depths: FloatArray;
  readonly features: Uint32Array;
}

/** One row for each pair; infinite if beyond the given distance. */
export interface Distances {
  readonly distances: FloatArray;
  readonly normals: FloatArray;
  readonly fromA: FloatArray;
  readonly fromB: FloatArray;
}
export interface Impacts {
  /** Infinite where there is none. */
  readonly times: FloatArray;
  readonly normals: FloatArray;
  readonly fromA: FloatArray;
  readonly fromB: FloatArray;
}
/** One for each pair: infinite fractions where there is no hit. */
export interface CastHits {
  readonly fractions: FloatArray;
  readonly normals: FloatArray;
  readonly points: FloatArray;
  readonly parts: Uint32Array;
  readonly movingParts: Uint32Array;
}

/**
 * Objects with a shape and a pose: position and quaternion x, y, z, w (7 numbers); in 2D position, cosine,
 * sine (4 numbers).
 */
export interface Objects {
  shapes: Shapes;
  poses: Floats;
}

/**
 * From pairs to contacts, frame after frame. Pairs are among the objects `a`, or of one of `a` and one of
 * `b`. What it returns is in the order of the pairs.
 */
export interface ContactFinder extends Disposable {
  readonly dim: Dimension;
  readonly type: NumberType;
  /** All contacts of shapes that touch or have a gap of up to `margin`. */
  find(a: Objects, pairs: Integers, options?: { b?: Objects; margin?: number }): Contacts;
  /** Whether the shapes of each pair touch: 1 or 0. */
  touching(a: Objects, pairs: Integers, options?: { b?: Objects }): Uint8Array;
  distances(a: Objects, pairs: Integers, options?: { b?: Objects; maxDistance?: number }): Distances;
  /**
   * When moving shapes first touch: instead of poses motions, which have linear and angular velocity as well
   * (13 or 7 numbers).
   */
  impacts(a: Objects, pairs: Integers, options?: { b?: Objects; tolerance?: number }): Impacts;
  /** Where ray pairs[2i] first meets object pairs[2i + 1]. */
  rayCasts(rays: Floats, objects: Objects, pairs: Integers): CastHits;
  /** Where object pairs[2i] of `moving`, moved by its displacement, first touches object pairs[2i + 1]. */
  shapeCasts(moving: Objects, displacements: Floats, objects: Objects, pairs: Integers): CastHits;
}

// --- The module ------------------------------------------------------------------------------------------

/** What a module has that was loaded with `only: "pairs"`. It has the engine "grid" alone. */
export interface JostlePairs extends Disposable {
  readonly version: string;
  /** How many threads searches run on. */
  readonly threads: number;
  /** "scalar" is the module without SIMD. */
  readonly instructionSet: "wasm_simd" | "scalar";
  /** Its memory, in bytes, as it is now: it grows and never shrinks. */
  readonly memoryBytes: number;

  /** An array in the module's memory, of so many numbers, all 0. */
  array(type: "float32", length: number): MemoryArray<Float32Array>;
  array(type: "float64", length: number): MemoryArray<Float64Array>;
  array(type: "uint32", length: number): MemoryArray<Uint32Array>;

  /** All pairs among `boxes`, or of one of `boxes` and one of `other`: a0, b0, a1, b1, ... */
  findPairs(boxes: Floats, options: FindOptions): Uint32Array;
  findPairs(boxes: Floats, other: Floats, options: FindOptions): Uint32Array;
  /** The pairs in space that repeats itself: `period` is its length along each axis, 0 where it doesn't. */
  findPeriodicPairs(
    boxes: Floats,
    period: ArrayLike<number>,
    options: PeriodicOptions,
  ): { pairs: Uint32Array; shifts: FloatArray };
  /** The pairs of many independent scenes: scene k is the boxes from offsets[k] up to offsets[k + 1]. */
  findScenes(boxes: Floats, offsets: ArrayLike<number>, options: ScenesOptions): ScenePairs;
  /** Throws the error that every search throws for these boxes, or does nothing. */
  checkBoxes(boxes: Floats, options: { dim: Dimension }): void;
  /** The order-independent fingerprint of pairs, as `jostle bench` prints it: 16 hexadecimal digits. */
  checksum(pairs: Integers): string;
  readonly PairFinder: new () => PairFinder;
}

export interface JostleSurfaces extends JostlePairs {
  readonly Surface: new (parts: SurfaceParts) => Surface;
  readonly SurfaceFinder: new (options?: { type?: NumberType }) => SurfaceFinder;
}

export interface Jostle extends JostlePairs {
  /**
   * The engine's outermost grid for these boxes. (Up to 128 boxes are searched without: every box against
   * every other.)
   */
  bricks(boxes: Floats, options: { dim: Dimension }): Bricks;

  readonly scenes: readonly SceneInfo[];
  scene(name: string, length: number, seed?: number | bigint, options?: SceneOptions): Scene;
  readonly simulations: readonly SimulationInfo[];
  simulation(options?: SimulationOptions): Simulation;

  /**
   * For each point all points within a cutoff, with all of their images where space repeats itself: those at
   * |D|^2 <= cutoff^2 in the points' numbers, to which cell and cutoffs are rounded. A point isn't its own
   * neighbour; its images may be. Rows ascend by j, then by S. `cutoff` is one number for all pairs; one for
   * each point, of which a pair's is the sum; or with `types` a table.
   */
  neighbors(
    points: Floats,
    cutoff: number | Floats | ArrayLike<number>,
    options: NeighborOptions & { dim: Dimension },
  ): Neighbors;
  readonly NeighborFinder: new (
    options: { dim: Dimension; type?: NumberType; skin?: number },
  ) => NeighborFinder;
  readonly BoxIndex: new (options: IndexOptions) => BoxIndex;
  readonly World: new (options: WorldOptions) => World;
  readonly PairSlots: new () => PairSlots;
  /**
   * With allPoints a surface has a contact for each triangle or segment that touches; otherwise those of a
   * body whose normals are within 5 degrees are one.
   */
  readonly ContactFinder: new (
    options: { dim: Dimension; type?: NumberType; allPoints?: boolean },
  ) => ContactFinder;
  readonly Shapes: new (options?: { dim?: Dimension; shapes?: Shape[] }) => Shapes;

  sphere(radius: number, dim?: Dimension): Shape;
  capsule(halfLength: number, radius: number, dim?: Dimension): Shape;
  /** Half the edges: 2 or 3 numbers. */
  box(half: ArrayLike<number>): Shape;
  roundedBox(half: ArrayLike<number>, radius: number): Shape;
  cylinder(halfLength: number, radius: number): Shape;
  cone(halfLength: number, radius: number): Shape;
  ellipsoid(half: ArrayLike<number>): Shape;
  halfSpace(normal: ArrayLike<number>, offset?: number): Shape;
  hull(points: FloatArray, dim: Dimension): Shape;
  roundedHull(points: FloatArray, radius: number, dim: Dimension): Shape;
  mesh(vertices: FloatArray, elements: Uint32Array, dim: Dimension): Shape;
  heightField(
    heights: Float64Array,
    columns: number,
    options?: { spacingX?: number; spacingZ?: number; thickness?: number },
  ): Shape;
  compound(shapes: Shape[], poses: Float64Array): Shape;
  /** The tightest box around each object, rounded outwards, with `margin` added. */
  bounds(objects: Objects, options?: { margin?: number }): FloatArray;

  /** The small indices in ids. */
  indexOf(ids: Ids): Uint32Array;
}

/**
 * Packs rays: origins and directions, `dim` numbers each, and how far they go, one number for all or one for
 * each.
 */
export function rays(
  origins: FloatArray,
  directions: FloatArray,
  options: { dim: Dimension; maxFraction?: number | ArrayLike<number> },
): { rays: FloatArray };
/** Packs poses: positions, and in 3D quaternions x, y, z, w, in 2D angles. Without rotations none turns. */
export function poses(
  positions: FloatArray,
  options: { dim: Dimension; rotations?: ArrayLike<number> },
): FloatArray;
