// The engine's side of the page: it runs beside the page, so that the page never waits for it.
import * as Comlink from "comlink";
import { load, support, type BoxIndex, type Jostle, type PairFinder } from "jostle";

import { boxesPerRow, mostPairsDrawn, pairsPerRow } from "./messages";
import type {
  BrickList,
  Buffers,
  Frame,
  Loaded,
  Path,
  RaceEngine,
  RaceOutcome,
  SceneChoice,
} from "./messages";
import { openBoxes } from "./files/boxes";
import { pathOf } from "./path";
import { FileSource, LiveSource, openScene, type Source } from "./sources";

const noBuffers: Buffers = { boxes: new Float32Array(0), pairs: new Uint32Array(0) };

export class Engine {
  private jostle: Jostle | undefined;
  private finder: PairFinder | undefined;
  private source: Source | undefined;
  private index: BoxIndex | undefined;
  private showsBodies = false;
  private indexed = false; // the index holds the present boxes
  /** Of the file's boxes: what is subtracted before they are drawn in single precision. */
  private origin: [number, number, number] = [0, 0, 0];

  /** Loads the module; again for another number of threads. 0 means all there are. */
  async load(threads: number): Promise<Loaded> {
    let mostThreads = support.threads ? navigator.hardwareConcurrency : 1;
    const wanted = threads === 0 ? mostThreads : Math.min(threads, mostThreads);
    this.close();
    this.finder?.dispose();
    this.index?.dispose();
    this.index = undefined;
    let refused: string | undefined;
    const jostle = await load({ threads: wanted }).catch((error: unknown) => {
      if (wanted === 1) throw error;
      // Of servers that send the page's headers with the page alone, say.
      refused = error instanceof Error ? error.message : String(error);
      mostThreads = 1;
      return load();
    });
    this.jostle = jostle;
    this.finder = new jostle.PairFinder();
    return {
      scenes: [
        ...jostle.scenes
          .filter((scene) => !scene.hostile)
          .map(({ name, summary }) => ({ name, summary, simulated: false })),
        ...jostle.simulations.map(({ name, summary }) => ({
          name: `falling-${name}`,
          summary,
          simulated: true,
        })),
      ],
      threads: jostle.threads,
      mostThreads: jostle.instructionSet === "scalar" ? 1 : mostThreads,
      refused,
      instructionSet: jostle.instructionSet,
      version: jostle.version,
    };
  }

  private get loaded(): Jostle {
    if (this.jostle === undefined) throw new Error("The engine isn't loaded yet.");
    return this.jostle;
  }

  private close(): void {
    this.source?.dispose();
    this.source = undefined;
    this.indexed = false;
  }

  open(choice: SceneChoice): Frame {
    this.close();
    this.origin = [0, 0, 0];
    this.source = openScene(this.loaded, choice);
    this.source.go(choice.frame);
    return this.find(noBuffers);
  }

  /** Opens a file's boxes. If it can't be read, the scene stays as it was. */
  async openFile(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<Frame> {
    const jostle = this.loaded;
    const source = new FileSource(await openBoxes(bytes, name));
    try {
      jostle.checkBoxes(source.boxes, { dim: source.dim });
    } catch (error) {
      throw new Error(`${name}: ${error instanceof Error ? error.message : error}`);
    }
    this.close();
    this.source = source;
    this.origin = middle(source);
    return this.find(noBuffers);
  }

  /** Shows the boxes of a program that is running, and tells what it calls them. */
  async openLive(address: string): Promise<{ frame: Frame; title: string }> {
    const source = await LiveSource.open(address);
    this.close();
    this.source = source;
    this.origin = middle(source);
    return { frame: this.find(noBuffers), title: source.title };
  }

  /** Whether frames of falling bodies are to tell what falls, from the next one on. */
  showBodies(shown: boolean): void {
    this.showsBodies = shown;
  }

  step(buffers: Buffers): Frame {
    this.source?.step();
    return this.find(buffers);
  }

  /** The present frame again, for who wants to see more of it. */
  again(): Frame {
    return this.find(noBuffers);
  }

  /** To a frame of a recording. */
  go(frame: number): Frame {
    this.source?.go(frame);
    return this.find(noBuffers);
  }

  /** Finds the pairs of the present frame. */
  private find(buffers: Buffers): Frame {
    const { source, finder } = this;
    if (source === undefined || finder === undefined) throw new Error("There is no scene.");
    this.indexed = false;
    const pairs = finder.find(source.boxes, { dim: source.dim });
    const stats = finder.stats;
    const count = source.numbers.length / (2 * source.dim);
    const drawnPairs = Math.min(stats.pairs, mostPairsDrawn);
    const rows = Math.max(1, Math.ceil(count / boxesPerRow));
    // With some room, since the next frame may have more.
    const pairRows = Math.ceil((1.25 * drawnPairs + 1) / pairsPerRow);
    const forPairs =
      buffers.pairs.length >= 2 * drawnPairs && buffers.pairs.length > 0
        ? buffers.pairs
        : new Uint32Array(2 * pairRows * pairsPerRow);
    forPairs.set(pairs.subarray(0, 2 * drawnPairs));
    const checksum = finder.checksum;
    const exactly = 6 * rows * boxesPerRow;
    const boxes = buffers.boxes.length === exactly ? buffers.boxes : new Float32Array(exactly);
    draw(source, this.origin, boxes);
    const bodies = this.showsBodies ? source.bodies?.() : undefined;
    const frame: Frame = {
      bodies,
      boxes,
      count,
      pairs: forPairs,
      drawnPairs,
      pairCount: stats.pairs,
      checksum,
      frame: source.frame,
      frames: source.frames,
      ended: source.ended === true,
      ms: stats.msTotal,
      stages: { tune: stats.msTune, scatter: stats.msScatter, sweep: stats.msSweep, finish: stats.msFinish },
      records: stats.records,
      bricks: stats.bricks,
      candidates: stats.candidates,
      threads: this.loaded.threads,
      origin: this.origin,
    };
    const own = bodies ? [bodies.poses.buffer, bodies.contacts.buffer] : [];
    return Comlink.transfer(frame, [boxes.buffer, forPairs.buffer, ...own]);
  }

  /** The bricks of the present boxes that have records, drawn as boxes are. */
  bricks(): BrickList {
    const { list } = pathOf(this.loaded, this.present(), this.origin, undefined, new Uint32Array(0));
    return Comlink.transfer(list, [list.bounds.buffer, list.records.buffer]);
  }

  /** How a box of the present frame went through the engine, and whom it touches. */
  path(box: number): { path: Path; list: BrickList } {
    const source = this.present();
    const { path, list } = pathOf(this.loaded, source, this.origin, box, this.finder!.pairs);
    return Comlink.transfer({ path: path!, list }, [list.bounds.buffer, list.records.buffer]);
  }

  /** The first box along a ray in drawn coordinates, by the library's own index; -1 if there is none. */
  pick(from: number[], direction: number[]): number {
    const source = this.present();
    const { dim } = source;
    const type = source.numbers instanceof Float32Array ? "float32" : "float64";
    if (this.index?.dim !== dim || this.index.type !== type) {
      this.index?.dispose();
      this.index = new this.loaded.BoxIndex({ dim, type });
      this.indexed = false;
    }
    if (!this.indexed) this.index.build(source.boxes);
    this.indexed = true;
    const start = from.map((value, axis) => value + this.origin[axis]!);
    if (dim === 2) {
      // Boxes in a plane: the ray meets it in a point.
      const t = direction[2] === 0 ? 0 : -start[2]! / direction[2]!;
      const point = [start[0]! + t * direction[0]!, start[1]! + t * direction[1]!];
      const numbers = type === "float32" ? Float32Array : Float64Array;
      const hits = this.index.all({ boxes: numbers.of(point[0]!, point[1]!, point[0]!, point[1]!) });
      return hits.length > 0 && hits.of(0).length > 0 ? hits.of(0)[0]! : -1;
    }
    const values = [...start, ...direction, 1e30];
    const ray = type === "float32" ? Float32Array.from(values) : Float64Array.from(values);
    return Number(this.index.first({ rays: ray }).ids[0]);
  }

  /**
   * Finds the pairs of the present boxes another way, once, unless that would take much longer than people
   * wait.
   */
  race(engine: RaceEngine): RaceOutcome {
    const source = this.present();
    const tests = expectedTests(source, engine);
    if (tests > 2e9) return { result: undefined, tests };
    const begin = performance.now();
    const pairs = this.loaded.findPairs(source.boxes, { dim: source.dim, engine });
    const ms = performance.now() - begin;
    return { result: { ms, pairs: pairs.length / 2, checksum: this.loaded.checksum(pairs) }, tests };
  }

  private present(): Source {
    if (this.source === undefined) throw new Error("There is no scene.");
    return this.source;
  }
}

interface Extent {
  lo: number;
  hi: number;
  /** The longest edge. */
  longest: number;
}

/** Where the boxes lie along an axis, infinite bounds left out. */
function extent({ numbers, dim }: Source, axis: number): Extent {
  const all = { lo: Infinity, hi: -Infinity, longest: 0 };
  for (let i = axis; i < numbers.length; i += 2 * dim) {
    const lo = numbers[i]!;
    const hi = numbers[i + dim]!;
    if (Number.isFinite(lo)) all.lo = Math.min(all.lo, lo);
    if (Number.isFinite(hi)) all.hi = Math.max(all.hi, hi);
    all.longest = Math.max(all.longest, hi - lo);
  }
  return all;
}

/** About how many pairs of boxes an engine tests if they are evenly spread. */
function expectedTests(source: Source, engine: RaceEngine): number {
  const n = source.numbers.length / (2 * source.dim);
  let tests = (n * n) / 2;
  if (engine === "grid" || engine === "chapter") return 0; // never many
  if (engine === "brute") return tests;
  const axes = Array.from({ length: source.dim }, (_, axis) => extent(source, axis));
  const cell = Math.max(...axes.map(({ longest }) => longest)); // holds the largest box
  for (const { lo, hi } of axes) tests *= Math.min(1, (3 * cell) / Math.max(hi - lo, Number.MIN_VALUE));
  return tests;
}

/** About the middle of the boxes: coordinates far from 0 lose their last digits in single precision. */
function middle(source: Source): [number, number, number] {
  const at = (axis: number): number => {
    if (axis >= source.dim) return 0;
    const { lo, hi } = extent(source, axis);
    return lo <= hi ? (lo + hi) / 2 : 0;
  };
  return [at(0), at(1), at(2)];
}

/** Writes boxes as they are drawn: three axes, single precision, about the origin. */
function draw(source: Source, origin: readonly number[], to: Float32Array): void {
  const { numbers, dim } = source;
  if (dim === 3 && numbers instanceof Float32Array && origin.every((value) => value === 0)) {
    to.set(numbers);
    to.fill(0, numbers.length);
    return;
  }
  let at = 0;
  for (let i = 0; i < numbers.length; i += dim)
    for (let axis = 0; axis < 3; ++axis) to[at++] = axis < dim ? numbers[i + axis]! - origin[axis]! : 0;
  to.fill(0, at);
}

Comlink.expose(new Engine());
