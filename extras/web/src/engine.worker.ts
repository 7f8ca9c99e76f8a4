// The engine's side of the page: it runs beside the page, so that the page never waits for it.
import * as Comlink from "comlink";
import { load, support, type BoxIndex, type Jostle, type JostleSurfaces, type PairFinder } from "jostle";

import { boxesPerRow, clothScene, mostPairsDrawn, pairsPerRow } from "./messages";
import type {
  BrickList,
  BruteForce,
  Buffers,
  Frame,
  Loaded,
  Path,
  RaceEngine,
  RaceOutcome,
  SceneChoice,
  Touched,
} from "./messages";
import { openBoxes } from "./files/boxes";
import { arrayOf, tableOf } from "./files/save";
import { pathOf } from "./path";
import { ClothSource, FileSource, LiveSource, openScene, type Source } from "./sources";

/** So often the first frame of something is searched: a first search is slow, and no number to start with. */
const firstSearches = 9;
/** So many boxes brute force is run on; what it takes for more follows from how many tests it makes. */
const mostForBruteForce = 20_000;

const noBuffers: Buffers = { boxes: new Float32Array(0), pairs: new Uint32Array(0) };

export class Engine {
  private jostle: Jostle | undefined;
  /** The module with surfaces, from when the first cloth is opened. */
  private surfaces: Promise<JostleSurfaces> | undefined;
  private finder: PairFinder | undefined;
  private source: Source | undefined;
  private index: BoxIndex | undefined;
  private showsBodies = false;
  private indexed = false; // the index holds the present boxes
  /** What brute force takes for a test, where that is known, by the number of axes. */
  private msPerTest: (number | undefined)[] = [];
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
      if (!support.simd)
        throw new Error("this page wants SIMD in WebAssembly, which browsers have since 2023", {
          cause: error,
        });
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
        ...(support.simd
          ? [{ name: clothScene, summary: "a cloth over a ball and itself", simulated: true }]
          : []),
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

  private loadSurfaces(): Promise<JostleSurfaces> {
    this.surfaces ??= load({ only: "surfaces" });
    this.surfaces.catch(() => (this.surfaces = undefined)); // the next call tries again
    return this.surfaces;
  }

  async open(choice: SceneChoice): Promise<Frame> {
    const surfaces = choice.scene === clothScene ? await this.loadSurfaces() : undefined;
    this.close();
    this.origin = [0, 0, 0];
    this.source = surfaces ? new ClothSource(surfaces, choice) : openScene(this.loaded, choice);
    this.source.go(choice.frame);
    return this.find(noBuffers, firstSearches);
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
    return this.find(noBuffers, firstSearches);
  }

  /** Shows the boxes of a program that is running, and tells what it calls them. */
  async openLive(address: string): Promise<{ frame: Frame; title: string }> {
    const source = await LiveSource.open(address);
    this.close();
    this.source = source;
    this.origin = middle(source);
    return { frame: this.find(noBuffers, firstSearches), title: source.title };
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
    return this.find(noBuffers, firstSearches);
  }

  /**
   * Finds the pairs of the present frame, several times if its time is to be that of a warm search: told is
   * the one of median length. For a quarter of a second at most.
   */
  private find(buffers: Buffers, searches = 1): Frame {
    const { source, finder } = this;
    if (source === undefined || finder === undefined) throw new Error("There is no scene.");
    this.indexed = false;
    const begin = performance.now();
    let pairs = finder.find(source.boxes, { dim: source.dim });
    const all = [finder.stats];
    while (all.length < searches && performance.now() - begin < 250) {
      pairs = finder.find(source.boxes, { dim: source.dim });
      all.push(finder.stats);
    }
    const stats = all.sort((a, b) => a.msTotal - b.msTotal)[all.length >> 1]!;
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
    const cloth = source.cloth?.();
    const frame: Frame = {
      bodies,
      cloth,
      boxes,
      count,
      pairs: forPairs,
      drawnPairs,
      pairCount: stats.pairs,
      checksum,
      frame: source.frame,
      frames: source.frames,
      ended: source.ended === true,
      ms: cloth?.ms ?? stats.msTotal,
      stages: { tune: stats.msTune, scatter: stats.msScatter, sweep: stats.msSweep, finish: stats.msFinish },
      records: stats.records,
      bricks: stats.bricks,
      candidates: stats.candidates,
      threads: this.loaded.threads,
      origin: this.origin,
      dim: source.dim,
      double: source.numbers instanceof Float64Array,
    };
    const own = bodies
      ? [bodies.poses.buffer, bodies.contacts.buffer]
      : cloth
        ? [cloth.positions.buffer, cloth.triangles.buffer, cloth.nearness.buffer]
        : [];
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
    const { dim } = this.present();
    const { index, numbers } = this.upToDate();
    const start = from.map((value, axis) => value + this.origin[axis]!);
    if (dim === 2) {
      // Boxes in a plane: the ray meets it in a point.
      const t = direction[2] === 0 ? 0 : -start[2]! / direction[2]!;
      const point = [start[0]! + t * direction[0]!, start[1]! + t * direction[1]!];
      const hits = index.all({ boxes: numbers.of(point[0]!, point[1]!, point[0]!, point[1]!) });
      return hits.length > 0 && hits.of(0).length > 0 ? hits.of(0)[0]! : -1;
    }
    const values = [...start, ...direction, 1e30];
    return Number(index.first({ rays: numbers.from(values) }).ids[0]);
  }

  /** The boxes that a box in drawn coordinates touches, and how long it took to ask for them. */
  touching(box: readonly number[]): Touched {
    const { dim } = this.present();
    const { index, numbers } = this.upToDate();
    const bounds = [0, 3].flatMap((side) =>
      box.slice(side, side + dim).map((value, k) => value + this.origin[k]!),
    );
    const boxes = numbers.from(bounds);
    const begin = performance.now();
    const answers = index.all({ boxes });
    const ms = performance.now() - begin;
    return { boxes: answers.length > 0 ? Array.from(answers.of(0), Number) : [], ms };
  }

  /** The index of the present boxes, and the kind of numbers that it takes. */
  private upToDate(): { index: BoxIndex; numbers: typeof Float32Array | typeof Float64Array } {
    const { boxes, numbers, dim } = this.present();
    const type = numbers instanceof Float32Array ? "float32" : "float64";
    if (this.index?.dim !== dim || this.index.type !== type) {
      this.index?.dispose();
      this.index = new this.loaded.BoxIndex({ dim, type });
      this.indexed = false;
    }
    if (!this.indexed) this.index.build(boxes);
    this.indexed = true;
    return { index: this.index, numbers: type === "float32" ? Float32Array : Float64Array };
  }

  /** How long brute force takes for the present boxes: measured, unless they are too many to wait for. */
  bruteForce(): BruteForce {
    const { boxes, numbers, dim } = this.present();
    const count = numbers.length / (2 * dim);
    const tests = (n: number): number => Math.max(1, (n * (n - 1)) / 2);
    const measured = count <= mostForBruteForce;
    const known = this.msPerTest[dim];
    if (!measured && known !== undefined) return { ms: known * tests(count), measured };
    const part = measured ? boxes : numbers.slice(0, 2 * dim * mostForBruteForce);
    const begin = performance.now();
    this.loaded.findPairs(part, { dim, engine: "brute" });
    const ms = performance.now() - begin;
    if (count >= mostForBruteForce) this.msPerTest[dim] = ms / tests(mostForBruteForce);
    return { ms: measured ? ms : this.msPerTest[dim]! * tests(count), measured };
  }

  /** The present boxes as a NumPy array, or their pairs as a table, to be saved. */
  saved(what: "boxes" | "pairs"): Blob {
    const source = this.present();
    return what === "boxes" ? arrayOf(source.numbers, source.dim) : tableOf(this.finder!.pairs, source.ids);
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
