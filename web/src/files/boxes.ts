// Files of boxes. What can't be read is refused with the words of `jostle pairs`, which reads the same
// formats.

export type Numbers = Float32Array<ArrayBuffer> | Float64Array<ArrayBuffer>;

/** The boxes of a file, in its own dimension and precision. */
export interface Boxes {
  readonly dim: 2 | 3;
  /** 1 but for recordings. */
  readonly frames: number;
  /**
   * For each box of a frame `dim` lower bounds, then `dim` upper ones. Frames are cheap to read one after
   * another.
   */
  read(frame: number): Numbers;
}

/** What is wrong with a file, beginning with its name. */
export class FileError extends Error {}

/** What a file says, fit to be shown: control characters escaped, the end left out if it is long. */
export function quoted(text: string): string {
  return `"${shortened(text)}"`;
}
export function shortened(text: string): string {
  const short = text.length > 40 ? `${text.slice(0, 40)}...` : text;
  return short.replace(/[\0-\x1f\x7f-\x9f]/g, (c) => `\\x${c.charCodeAt(0).toString(16).padStart(2, "0")}`);
}

/** Reads a file; its name's extension says what it is. Throws a FileError. */
export async function readBoxes(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<Boxes> {
  const extension = /\.[^.]*$/.exec(name)?.[0].toLowerCase();
  switch (extension) {
    case ".csv":
      return (await import("./csv")).readCsv(bytes, name);
    case ".npy":
      return (await import("./npy")).readNpy(bytes, name);
    case ".jrec":
      return (await import("./recording")).readRecording(bytes, name);
    case ".obj":
    case ".glb":
      return (await import("./mesh")).readMesh(bytes, name);
    default:
      throw new FileError(
        `${name}: ${extension ? `can't read ${extension} files` : "the name has no extension"}; ` +
          "give .jrec, .csv, .npy, .obj or .glb",
      );
  }
}
