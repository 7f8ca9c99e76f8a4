// SPDX-License-Identifier: MIT
// NumPy's .npy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
import { one_frame, quoted, refuse_file, shortened } from "./file.js";

/** The header is a Python dictionary of exactly three entries, as repr() writes it. */
function parse_header(text, fail) {
  const damaged = () => fail("the NPY header is damaged; save the array again with numpy.save");
  const body = /^\s*\{(.*?),?\s*\}\s*$/s.exec(text)?.[1] ?? damaged();
  const found = new Map();
  // Keys and values; commas within a tuple don't separate entries.
  const entry = /\s*(['"])(\w+)\1\s*:\s*('[^']*'|"[^"]*"|\([^)]*\)|\[.*?\](?=\s*,\s*['"]|$)|\w+)\s*(,|$)/gsy;
  while (entry.lastIndex < body.length) {
    const [, , key, value] = entry.exec(body) ?? damaged();
    if (found.has(key)) damaged();
    found.set(key, value);
  }
  const [descr, order, shape] = ["descr", "fortran_order", "shape"].map((key) => found.get(key) ?? damaged());
  if (found.size !== 3) damaged();
  if (descr.startsWith("["))
    fail("is an array of records; save plain float32 or float64 numbers, of shape (n, 4) or (n, 6)");
  if (!/^['"]/.test(descr) || !/^(True|False)$/.test(order)) damaged();
  const numbers = /^\(((?:\s*\d{1,18}L?\s*,?)*)\)$/.exec(shape)?.[1] ?? damaged();
  return {
    descr: descr.slice(1, -1),
    fortran_order: order === "True",
    shape: Array.from(numbers.matchAll(/\d+/g), ([digits]) => Number(digits)),
  };
}

function python_tuple(values) {
  return `(${values.join(", ")}${values.length === 1 ? "," : ""})`;
}

export function read_npy(bytes, name) {
  const fail = (what) => refuse_file(name, what);
  const short = "ends inside the NPY header; save the array again with numpy.save";
  if (bytes.length < 8) fail(short);
  if (String.fromCharCode(...bytes.subarray(0, 6)) !== "\x93NUMPY")
    fail("doesn't start as an NPY file does; save it with numpy.save");
  const version = bytes[6];
  if (version < 1 || version > 3) fail(`is NPY version ${version}; versions 1, 2 and 3 are known`);
  const start = version === 1 ? 10 : 12;
  if (bytes.length < start) fail(short);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const length = version === 1 ? view.getUint16(8, true) : view.getUint32(8, true);
  if (length > 2 ** 20)
    fail("the NPY header is longer than a megabyte; save the array again with numpy.save");
  if (bytes.length < start + length) fail(short);
  const header = new TextDecoder("latin1").decode(bytes.subarray(start, start + length));
  const { descr, fortran_order, shape } = parse_header(header, fail);

  const flat = shape.length === 2 && (shape[1] === 4 || shape[1] === 6);
  const nested = shape.length === 3 && shape[1] === 2 && (shape[2] === 2 || shape[2] === 3);
  if (!flat && !nested)
    fail(
      `has shape ${shortened(python_tuple(shape))}; ` +
        "n boxes in d dimensions (2 or 3) are (n, 2, d) or (n, 2 * d), lo before hi",
    );
  if (!/^[<>=]f[48]$/.test(descr))
    fail(`has numbers of type ${quoted(descr)}; convert them with .astype('float32') or .astype('float64')`);
  const little = descr[0] !== ">";
  const size = descr[2] === "4" ? 4 : 8;
  const count = shape[0];
  if (count > 0xffffffff) fail("has more boxes than 32 bits can number; split it");
  const dim = flat ? shape[1] / 2 : shape[2];
  const wanted = count * 2 * dim * size;
  const left = bytes.length - start - length;
  if (left !== wanted)
    fail(
      `shape ${python_tuple(shape)} of ${descr} needs ${wanted} bytes and the file has ${left}; ` +
        (left < wanted ? "it is cut off, save it again" : "save one array per file"),
    );

  const boxes = new (size === 4 ? Float32Array : Float64Array)(count * 2 * dim);
  let at = start + length;
  const number = size === 4 ? () => view.getFloat32(at, little) : () => view.getFloat64(at, little);
  if (!fortran_order) for (let i = 0; i < boxes.length; ++i, at += size) boxes[i] = number();
  else
    // One coordinate of all boxes after another, the last index slowest: in an array of shape (n, 2, d) lo.x,
    // hi.x, lo.y, ..., in one of shape (n, 2 * d) lo.x, lo.y, ...
    for (let c = 0; c < 2 * dim; ++c) {
      const place = nested ? (c % 2) * dim + Math.floor(c / 2) : c;
      for (let box = 0; box < count; ++box, at += size) boxes[box * 2 * dim + place] = number();
    }
  return one_frame(dim, boxes);
}
