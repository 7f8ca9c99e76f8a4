// SPDX-License-Identifier: MIT
// What the readers of files share: their complaints are those of `jostle pairs`, and begin with the file's
// name.
import { refuse } from "../error.js";

/** What a file says, fit to be shown: control characters escaped, the end left out if it is long. */
export function quoted(text) {
  return `"${shortened(text)}"`;
}
export function shortened(text) {
  const short = text.length > 40 ? `${text.slice(0, 40)}...` : text;
  return short.replace(/[\0-\x1f\x7f-\x9f]/g, (c) => `\\x${c.charCodeAt(0).toString(16).padStart(2, "0")}`);
}

export function refuse_file(name, what, index, value) {
  refuse(`${name}: ${what}`, "bad_file", index, value);
}

/** A file of one frame. */
export function one_frame(dim, boxes, ids) {
  return { dim, frames: 1, boxes, ids, frame: () => boxes };
}
