// SPDX-License-Identifier: MIT
// NumPy's .npy: https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html
import { one_frame, quoted, refuse_file, shortened } from "./file.js";

/** The header is a Python dictionary of exactly three entries, as repr() writes it. */
function parse_header(text, fail) {
  let at = 0;
  const damaged = () => fail("the NPY header is damaged; save the array again with numpy.save");
  const skip_spaces = () => {
    while (at < text.length && " \t\r\n".includes(text[at])) ++at;
  };
  const accept = (c) => {
    skip_spaces();
    if (text[at] !== c) return false;
    ++at;
    return true;
  };
  const expect = (c) => accept(c) || damaged();
  const string = () => {
    const mark = accept("'") ? "'" : '"';
    if (mark === '"') expect('"');
    const end = text.indexOf(mark, at);
    if (end < 0) damaged();
    const found = text.slice(at, end);
    at = end + 1;
    return found;
  };
  const boolean = () => {
    skip_spaces();
    const word = ["False", "True"].find((each) => text.startsWith(each, at)) ?? damaged();
    at += word.length;
    return word === "True";
  };
  const tuple = () => {
    const values = [];
    expect("(");
    while (!accept(")")) {
      skip_spaces();
      const first = at;
      while (at < text.length && text[at] >= "0" && text[at] <= "9") ++at;
      if (at === first || at - first > 18) damaged();
      values.push(Number(text.slice(first, at)));
      if (text[at] === "L") ++at; // Python 2 wrote 3L
      if (!accept(",")) {
        expect(")");
        break;
      }
    }
    return values;
  };
  const descr = () => {
    skip_spaces();
    if (text[at] === "[")
      fail("is an array of records; save plain float32 or float64 numbers, of shape (n, 4) or (n, 6)");
    return string();
  };

  const value = { descr, fortran_order: boolean, shape: tuple };
  const found = {};
  expect("{");
  while (!accept("}")) {
    const key = string();
    expect(":");
    if (!Object.hasOwn(value, key) || Object.hasOwn(found, key)) damaged();
    found[key] = value[key]();
    if (!accept(",")) {
      expect("}");
      break;
    }
  }
  skip_spaces();
  if (at !== text.length || Object.keys(found).length !== 3) damaged();
  return found;
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
