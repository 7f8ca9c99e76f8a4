// Where boxes come from: seeded scenes, simulations, files.
import { readBoxes } from "jostle";
import type {
  BoxFile,
  FloatArray,
  Floats,
  Jostle,
  JostleSurfaces,
  MemoryArray,
  Scene,
  Simulation,
} from "jostle";

import { FallingCloth } from "./cloth";
import { sizeFactors, resize } from "./sizes";
import { bodiesPerRow, contactsPerRow, type Bodies, type Cloth, type SceneChoice } from "./messages";

const wholeRows = (count: number, perRow: number): number => Math.max(1, Math.ceil(count / perRow)) * perRow;

/** Boxes that move. */
export interface Source {
  /** Those of the present frame, to search. */
  readonly boxes: Floats;
  readonly numbers: Float32Array | Float64Array;
  readonly dim: 2 | 3;
  readonly frame: number;
  /** What a file calls the boxes. */
  readonly ids?: readonly string[] | undefined;
  /** How many frames there are; undefined if it goes on for ever. */
  readonly frames: number | undefined;
  /** What falls, and where it touches; undefined where there are boxes alone. */
  bodies?(): Bodies;
  cloth?(): Cloth;
  /** Of frames from elsewhere: there will be no more. */
  readonly ended?: boolean;
  step(): void;
  go(frame: number): void;
  dispose(): void;
}

abstract class Endless {
  abstract readonly frame: number;
  readonly dim = 3;
  readonly frames = undefined;
  abstract step(): void;
  /** Forward only: a scene is made anew to go back. */
  go(frame: number): void {
    while (this.frame < frame) this.step();
  }
}

class SceneSource extends Endless implements Source {
  constructor(private readonly scene: Scene) {
    super();
  }
  get boxes(): Floats {
    return this.scene.boxes;
  }
  get numbers(): Float32Array {
    return this.scene.boxes.view as Float32Array;
  }
  get frame(): number {
    return this.scene.frame;
  }
  step(): void {
    this.scene.step();
  }
  dispose(): void {
    this.scene.dispose();
  }
}

/** A scene whose boxes have got other sizes. */
class ResizedSource extends Endless implements Source {
  private readonly factors: Float32Array;
  private readonly resized: MemoryArray<Float32Array>;

  constructor(jostle: Jostle, private readonly scene: Scene, { seed, ratio, size }: SceneChoice) {
    super();
    this.factors = sizeFactors(scene.length, seed, ratio).map((factor) => (factor * size) / 100);
    this.resized = jostle.array("float32", 6 * scene.length);
    this.update();
  }
  private update(): void {
    resize(this.scene.boxes.view as Float32Array, this.factors, this.resized.view);
  }
  get boxes(): Floats {
    return this.resized;
  }
  get numbers(): Float32Array {
    return this.resized.view;
  }
  get frame(): number {
    return this.scene.frame;
  }
  step(): void {
    this.scene.step();
    this.update();
  }
  dispose(): void {
    this.scene.dispose();
    this.resized.dispose();
  }
}

/**
 * Falling bodies. Their boxes are copied: the simulation hands out a view that doesn't outlive the next call.
 */
class SimulationSource extends Endless implements Source {
  readonly boxes: MemoryArray<Float32Array>;
  /** As the last step found them: boxes and contacts are of these. */
  private readonly poses: Float32Array;

  constructor(jostle: Jostle, private readonly simulation: Simulation) {
    super();
    this.boxes = jostle.array("float32", 6 * simulation.bodies);
    this.boxes.view.set(simulation.boxes);
    this.poses = simulation.poses.slice();
  }
  get numbers(): Float32Array {
    return this.boxes.view;
  }
  get frame(): number {
    return this.simulation.frame;
  }
  step(): void {
    this.poses.set(this.simulation.poses);
    this.simulation.step();
    this.boxes.view.set(this.simulation.boxes);
  }
  bodies(): Bodies {
    const { simulation, poses: from } = this;
    const { bodies, sizes, shapeOf } = simulation;
    const poses = new Float32Array(10 * wholeRows(bodies, bodiesPerRow));
    for (let body = 0; body < bodies; ++body) {
      poses.set(from.subarray(7 * body, 7 * body + 7), 10 * body);
      poses[10 * body + 7] = sizes[body]!;
      poses[10 * body + 8] = shapeOf[body]!;
    }
    // Contacts are also of what will touch within the frame; shown is what does.
    const { length, pairs, normals, first, fromA, depths } = simulation.contacts();
    const contacts = new Float32Array(8 * wholeRows(depths.length, contactsPerRow));
    let contactCount = 0;
    for (let contact = 0; contact < length; ++contact) {
      const a = pairs[2 * contact]!;
      for (let point = first[contact]!; point < first[contact + 1]!; ++point) {
        if (depths[point]! < 0) continue;
        const at = 8 * contactCount++;
        for (let axis = 0; axis < 3; ++axis) {
          contacts[at + axis] = from[7 * a + axis]! + fromA[3 * point + axis]!;
          contacts[at + 3 + axis] = normals[3 * contact + axis]!;
        }
      }
    }
    return { poses, contacts, contactCount };
  }
  dispose(): void {
    this.simulation.dispose();
    this.boxes.dispose();
  }
}

/** The cloth, and a box around each of its triangles. */
export class ClothSource extends Endless implements Source {
  readonly numbers: Float32Array;
  private readonly falling: FallingCloth;

  constructor(jostle: JostleSurfaces, { n, seed }: SceneChoice) {
    super();
    this.falling = new FallingCloth(jostle, n, seed);
    this.numbers = new Float32Array(2 * this.falling.triangles.length);
    this.update();
  }
  private update(): void {
    const { triangles, positions } = this.falling;
    for (let k = 0; k < triangles.length; k += 3)
      for (let axis = 0; axis < 3; ++axis) {
        const at = (corner: number): number => positions[3 * triangles[k + corner]! + axis]!;
        this.numbers[2 * k + axis] = Math.min(at(0), at(1), at(2));
        this.numbers[2 * k + 3 + axis] = Math.max(at(0), at(1), at(2));
      }
  }
  get boxes(): Floats {
    return this.numbers;
  }
  get frame(): number {
    return this.falling.frame;
  }
  step(): void {
    this.falling.step();
    this.update();
  }
  cloth(): Cloth {
    return this.falling.drawn();
  }
  dispose(): void {
    this.falling.dispose();
  }
}

export function openScene(jostle: Jostle, choice: SceneChoice): Source {
  const { n, seed } = choice;
  const simulated = choice.scene.startsWith("falling-");
  if (simulated) {
    const scene = choice.scene.slice("falling-".length);
    return new SimulationSource(jostle, jostle.simulation({ scene, bodies: n, seed }));
  }
  const scene = jostle.scene(choice.scene, n, seed);
  try {
    const asItIs = choice.ratio === 1 && choice.size === 100;
    return asItIs ? new SceneSource(scene) : new ResizedSource(jostle, scene, choice);
  } catch (error) {
    scene.dispose(); // no memory for its sizes
    throw error;
  }
}

/** A file of boxes; a recording has several frames, and begins again after the last. */
export class FileSource implements Source {
  readonly dim;
  readonly frames;
  frame = 0;

  numbers: FloatArray;

  readonly ids;

  constructor(private readonly file: BoxFile) {
    this.ids = file.ids;
    this.dim = file.dim;
    this.frames = file.frames;
    this.numbers = file.boxes;
  }
  get boxes(): Floats {
    return this.numbers;
  }
  step(): void {
    if (this.frames > 1) this.go((this.frame + 1) % this.frames);
  }
  go(frame: number): void {
    const wanted = Math.min(Math.max(frame, 0), this.frames - 1);
    this.numbers = this.file.frame(wanted);
    this.frame = wanted;
  }
  dispose(): void {}
}

/**
 * Frames that another program sends while it makes them: the newest of them, as `jostle simulate --watch`
 * serves it.
 */
export class LiveSource implements Source {
  readonly dim;
  readonly frames = undefined;
  readonly title;
  numbers: FloatArray;
  frame;
  ended = false;
  private next: { numbers: FloatArray; frame: number } | undefined;
  private failed: unknown;
  private readonly leaving = new AbortController();

  private constructor(private readonly address: string, first: Response, boxes: BoxFile) {
    this.dim = boxes.dim;
    this.numbers = boxes.boxes;
    this.frame = frameOf(first);
    this.title = first.headers.get("Jostle-Title") ?? "live";
    void this.ask();
  }
  static async open(address: string): Promise<LiveSource> {
    const response = await fetch(address).catch(() => undefined);
    if (response?.status !== 200) throw new Error(gone);
    return new LiveSource(address, response, await boxesOf(response));
  }
  /** Asks for the frame after the present one, which waits here until it is wanted. */
  private async ask(): Promise<void> {
    try {
      while (this.next === undefined && !this.ended) {
        const response = await fetch(`${this.address}?after=${this.frame}`, { signal: this.leaving.signal });
        if (response.status === 200)
          this.next = { numbers: (await boxesOf(response)).boxes, frame: frameOf(response) };
        else if (response.status === 204) this.ended = response.headers.has("Jostle-Ended");
        else throw new Error(gone);
      }
    } catch (error) {
      this.failed = error instanceof TypeError ? new Error(gone) : error;
    }
  }
  get boxes(): Floats {
    return this.numbers;
  }
  step(): void {
    if (this.next !== undefined) {
      ({ numbers: this.numbers, frame: this.frame } = this.next);
      this.next = undefined;
      void this.ask();
    } else if (this.failed !== undefined) throw this.failed;
  }
  go(): void {}
  dispose(): void {
    this.leaving.abort();
  }
}
const gone = "the program that this page showed has ended.";
const frameOf = (response: Response): number => Number(response.headers.get("Jostle-Frame"));
async function boxesOf(response: Response): Promise<BoxFile> {
  return readBoxes(new Uint8Array(await response.arrayBuffer()), "frame.npy");
}
