// Where boxes come from: seeded scenes, simulations, files.
import type { Floats, Jostle, MemoryArray, Scene, Simulation } from "jostle";

import type { Boxes, Numbers } from "./files/boxes";
import { sizeFactors, resize } from "./sizes";
import type { SceneChoice } from "./messages";

/** Boxes that move. */
export interface Source {
  /** Those of the present frame, to search. */
  readonly boxes: Floats;
  readonly numbers: Float32Array | Float64Array;
  readonly dim: 2 | 3;
  readonly frame: number;
  /** How many frames there are; undefined if it goes on for ever. */
  readonly frames: number | undefined;
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

  constructor(jostle: Jostle, private readonly scene: Scene, seed: number, ratio: number) {
    super();
    this.factors = sizeFactors(scene.length, seed, ratio);
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

/** Falling bodies. Their boxes are copied: the simulation hands out a view that doesn't outlive the next call. */
class SimulationSource extends Endless implements Source {
  readonly boxes: MemoryArray<Float32Array>;

  constructor(jostle: Jostle, private readonly simulation: Simulation) {
    super();
    this.boxes = jostle.array("float32", 6 * simulation.bodies);
    this.boxes.view.set(simulation.boxes);
  }
  get numbers(): Float32Array {
    return this.boxes.view;
  }
  get frame(): number {
    return this.simulation.frame;
  }
  step(): void {
    this.simulation.step();
    this.boxes.view.set(this.simulation.boxes);
  }
  dispose(): void {
    this.simulation.dispose();
    this.boxes.dispose();
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
    return choice.ratio > 1 ? new ResizedSource(jostle, scene, seed, choice.ratio) : new SceneSource(scene);
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

  numbers: Numbers;

  constructor(private readonly file: Boxes) {
    this.dim = file.dim;
    this.frames = file.frames;
    this.numbers = file.read(0);
  }
  get boxes(): Floats {
    return this.numbers;
  }
  step(): void {
    if (this.frames > 1) this.go((this.frame + 1) % this.frames);
  }
  go(frame: number): void {
    const wanted = Math.min(Math.max(frame, 0), this.frames - 1);
    this.numbers = this.file.read(wanted);
    this.frame = wanted;
  }
  dispose(): void {}
}
