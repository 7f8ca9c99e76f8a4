// What the address remembers: #scene=uniform&n=20000&seed=1, or #file=data/mine.jrec
import { clothScene } from "./messages";

export interface State {
  /**
   * A file beside the page that is shown in place of the scene, or where frames of a running simulation come
   * from.
   */
  file: string | undefined;
  live: string | undefined;
  scene: string;
  n: number;
  seed: number;
  ratio: number;
  /** The boxes' edges in per cent of the scene's. */
  size: number;
  /** 0: as many as there are. */
  threads: number;
  /** Frames a second. */
  motion: number;
  paused: boolean;
  /** The frame that a paused scene stands at, or that a running one begins with. */
  frame: number;
}

export const limits = { n: [1000, 1_000_000], ratio: [1, 1000], size: [10, 200], motion: [5, 60] } as const;

/** Whether a scene's bodies have sizes of their own, and one wants to see each of them. */
export const isSimulated = (scene: string): boolean =>
  scene === clothScene || scene.startsWith("falling-");
/** How many boxes, bodies or triangles a scene has at most. */
export const most = (scene: string): number => (scene === clothScene ? 20_000 : limits.n[1]);

/** What an address means that leaves something out. */
export const plain: State = {
  file: undefined,
  live: undefined,
  scene: "uniform",
  n: 20_000,
  seed: 1,
  ratio: 1,
  size: 100,
  threads: 0,
  motion: 60,
  paused: false,
  frame: 0,
};
/** Without an address: smaller boxes, so that one can see into the crowd. */
export const opening = "#scene=uniform&n=20000&seed=1&size=50";

function whole(text: string | null, fallback: number, least: number, most: number): number {
  if (text === null || !/^\d{1,15}$/.test(text)) return fallback;
  return Math.min(Math.max(Number(text), least), most);
}

/** What an address says; where it says nothing, or nonsense, the state is the plain one. */
export function parseState(hash: string, scenes: readonly string[]): State {
  const fields = new URLSearchParams((hash || opening).replace(/^#/, ""));
  const named = fields.get("scene") ?? plain.scene;
  const scene = scenes.includes(named) ? named : plain.scene;
  return {
    file: fields.get("file") || undefined,
    live: fields.get("live") || undefined,
    scene,
    n: whole(fields.get("n"), plain.n, 1, most(scene)),
    seed: whole(fields.get("seed"), plain.seed, 0, 2 ** 32 - 1),
    ratio: whole(fields.get("ratio"), plain.ratio, ...limits.ratio),
    size: whole(fields.get("size"), plain.size, ...limits.size),
    threads: whole(fields.get("threads"), plain.threads, 0, 64),
    motion: whole(fields.get("motion"), plain.motion, ...limits.motion),
    paused: fields.get("paused") === "1",
    frame: whole(fields.get("frame"), plain.frame, 0, 100_000),
  };
}

/** The address of a state. What is plain is left out, but for what a scene is made of. */
export function formatState(state: State): string {
  const { file, live } = state;
  const shown = { scene: state.scene, n: String(state.n), seed: String(state.seed) };
  const fields = new URLSearchParams(file !== undefined ? { file } : live !== undefined ? { live } : shown);
  for (const name of ["ratio", "size", "threads", "motion", "frame"] as const)
    if (state[name] !== plain[name]) fields.set(name, String(state[name]));
  if (state.paused) fields.set("paused", "1");
  return "#" + fields.toString();
}

/** Where a file lies that the address names: beside the page, whatever it says, and nowhere else. */
export function besidePage(path: string): string {
  const encoded = path.split("/").map(encodeURIComponent).join("/");
  return new URL(`./${encoded}`, document.baseURI).href;
}
