// What the page and its worker tell each other.

/**
 * How many boxes, and pairs, stand in a row of the textures that they are drawn from; buffers hold whole
 * rows.
 */
export const boxesPerRow = 1024;
export const pairsPerRow = 1024;
export const bodiesPerRow = 256;
export const contactsPerRow = 256;
/** No more pairs than this are drawn; all are counted. */
export const mostPairsDrawn = 1 << 21;

/** A seeded scene: the boxes of `jostle bench SCENE -n N --seed SEED`, or the bodies of `jostle simulate`. */
export interface SceneChoice {
  scene: string;
  n: number;
  seed: number;
  /** The biggest box's edge over the smallest one's, where 1 leaves the scene's boxes as they are. */
  ratio: number;
  /** Edges in per cent of the scene's. */
  size: number;
  /** The frame to begin with. */
  frame: number;
}

/** The scene that is no boxes, but for those around its triangles. */
export const clothScene = "cloth";
/** How large it is, the ball about the origin under it, and the height of the floor. */
export const clothSize = { side: 1.6, ball: 0.3, floor: -0.4 } as const;

export interface SceneName {
  name: string;
  summary: string;
  simulated: boolean;
}

export interface Loaded {
  scenes: SceneName[];
  threads: number;
  mostThreads: number;
  /** Why there is one thread, although more were wanted. */
  refused: string | undefined;
  instructionSet: string;
  version: string;
}

export interface StageTimes {
  tune: number;
  scatter: number;
  sweep: number;
  finish: number;
}

/** Memory that travels to the worker and back, so that a steady frame allocates none. */
export interface Buffers {
  boxes: Float32Array<ArrayBuffer>;
  pairs: Uint32Array<ArrayBuffer>;
}

/** One frame: boxes, the pairs that touch, and what finding them took. */
export interface Frame extends Buffers {
  /** `boxes` has 6 numbers for each of these (lo, then hi), and zeros up to whole rows. */
  count: number;
  /** `pairs` has two numbers for each of these, and room for more, up to whole rows. */
  drawnPairs: number;
  pairs: Uint32Array<ArrayBuffer>;
  pairCount: number;
  checksum: string;
  frame: number;
  frames: number | undefined; // of a recording
  /** No frame follows: the sender has ended. */
  ended: boolean;
  ms: number;
  stages: StageTimes;
  records: number;
  bricks: number;
  candidates: number;
  threads: number;
  /** Of falling bodies, if they are to be shown. */
  bodies: Bodies | undefined;
  /** Of the cloth: then the boxes are those around its triangles, and aren't drawn. */
  cloth: Cloth | undefined;
  /** Added to drawn coordinates it gives the user's. */
  origin: [number, number, number];
  dim: 2 | 3;
  /** The boxes are searched in double precision. */
  double: boolean;
}

/** Bodies as they are, and where they touch; zeros up to whole rows. */
export interface Bodies {
  /**
   * Position, rotation as a quaternion x, y, z, w, size, and what it is (0 sphere, 1 cube, 2 octahedron): 10
   * numbers with one to spare.
   */
  poses: Float32Array<ArrayBuffer>;
  /** Of each point of contact its place and normal, with two numbers to spare: 8. */
  contacts: Float32Array<ArrayBuffer>;
  contactCount: number;
}

/** A cloth, and what of it is near itself. */
export interface Cloth {
  /** Three numbers for each vertex. */
  positions: Float32Array<ArrayBuffer>;
  triangles: Uint32Array<ArrayBuffer>;
  /** For each vertex 0 to 1: where the cloth is near itself, and how much so. */
  nearness: Float32Array<ArrayBuffer>;
  /** How many pairs of parts are near, and what finding them took. */
  near: number;
  ms: number;
  /** Edges that pass through triangles, of all steps of this frame. */
  crossings: number;
}

/** The bricks that have records: 6 numbers each. */
export interface BrickList {
  bounds: Float32Array<ArrayBuffer>;
  records: Uint32Array<ArrayBuffer>;
}

/** How one box went through the engine. */
export interface Path {
  box: number;
  /** What the file calls it, or "Box" and its number. */
  name: string;
  /** Places in a BrickList. */
  bricks: number[];
  partners: Partner[];
  /** The brick in which the box begins. */
  inside: Inside | undefined;
}
/**
 * The records of one brick, as they are stored: in the order of their lower bounds along the axis that is
 * swept.
 */
export interface Inside {
  /** A place in a BrickList. */
  brick: number;
  /** 0, 1 or 2. */
  sweepAxis: number;
  quanta: number;
  records: BrickRecord[];
  /** The box's record; it is compared with those behind it, up to `end`, which begin before it ends. */
  own: number;
  end: number;
  /** What the records say, drawn as boxes are. */
  bounds: Float32Array<ArrayBuffer>;
}
export interface BrickRecord {
  box: number;
  /** In quanta from the brick's start, for each axis. */
  lo: number[];
  hi: number[];
  /** One bit per axis: the box began in a lower brick there. */
  copies: number;
}
export interface Partner {
  box: number;
  name: string;
  /** How far the boxes overlap on each axis. */
  overlap: number[];
  /**
   * The brick that reports the pair: a place in a BrickList; -1 where there are so few boxes that no brick is
   * needed.
   */
  owner: number;
}

/** Which boxes the visitor's own touches. */
export interface Touched {
  boxes: number[];
  ms: number;
}

/** What brute force takes for the present boxes. */
export interface BruteForce {
  ms: number;
  /** Or reckoned from what fewer boxes took. */
  measured: boolean;
}

export type RaceEngine = "grid" | "chapter" | "uniform" | "brute";
export interface RaceOutcome {
  /** Undefined if the engine was left out, because it would have taken too long. */
  result: { ms: number; pairs: number; checksum: string } | undefined;
  /** About how many pairs of boxes it tests, where that is known. */
  tests: number;
}
