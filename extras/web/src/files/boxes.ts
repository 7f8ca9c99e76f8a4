// Files of boxes: those that the package reads, and meshes. What can't be read is refused with the words of
// `jostle pairs`, which reads the same formats.
import { readBoxes, type BoxFile } from "jostle";

/** Reads a file; its name's extension says what it is. */
export async function openBoxes(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<BoxFile> {
  const extension = /\.[^.]*$/.exec(name)?.[0].toLowerCase();
  switch (extension) {
    case ".csv":
    case ".npy":
    case ".jrec":
      return readBoxes(bytes, name);
    case ".obj":
    case ".glb":
      return (await import("./mesh")).readMesh(bytes, name);
    default: {
      const why = extension ? `can't read ${extension} files` : "the name has no extension";
      throw new Error(`${name}: ${why}; give .jrec, .csv, .npy, .obj or .glb`);
    }
  }
}
