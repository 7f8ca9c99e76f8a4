// SPDX-License-Identifier: MIT
import { describe } from "./core.js";
import { refuse } from "./error.js";
import { read_csv } from "./files/csv.js";
import { refuse_file } from "./files/file.js";
import { read_npy } from "./files/npy.js";
import { read_recording } from "./files/recording.js";

const encoder = new TextEncoder();
const READERS = { ".csv": read_csv, ".npy": read_npy, ".jrec": read_recording };

/** Boxes from a file's content: see jostle.d.ts. */
export function readBoxes(content, name) {
  if (typeof name !== "string")
    refuse(`name is ${describe(name)}: it must be the file's, such as "boxes.csv"`);
  const extension = /\.[^.]*$/.exec(name)?.[0].toLowerCase();
  const read = READERS[extension];
  if (read === undefined) {
    const why = extension ? `can't read ${extension} files` : "the name has no extension";
    refuse_file(name, `${why}; give .csv, .npy or .jrec`);
  }
  return read(bytes_of(content), name);
}

function viewed(buffer, ...range) {
  try {
    return new Uint8Array(buffer, ...range);
  } catch {
    return refuse("content was transferred, and is empty now");
  }
}
function bytes_of(content) {
  if (typeof content === "string") return encoder.encode(content);
  if (content instanceof ArrayBuffer) return viewed(content);
  if (ArrayBuffer.isView(content)) {
    const bytes = viewed(content.buffer, content.byteOffset, content.byteLength);
    return content.buffer instanceof ArrayBuffer ? bytes : bytes.slice(); // shared text can't be decoded
  }
  return refuse(`content is ${describe(content)}: it must be an ArrayBuffer, a Uint8Array or text`);
}
