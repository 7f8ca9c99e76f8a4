// SPDX-License-Identifier: MIT
// Boxes as comma-separated values: RFC 4180, and also spaces around fields, blank lines, any line ends, a
// byte order mark.
import { one_frame, quoted, refuse_file, shortened } from "./file.js";

/** One row at a time. */
class Rows {
  fields = [];
  #text;
  #name;
  #line = 1;
  #row_line = 1;
  #at = 0;

  constructor(text, name) {
    this.#text = text;
    this.#name = name;
  }

  /** `what` goes wrong in a field of this row, counted from 0; it is of the box `index`. */
  fail(field, what, index) {
    refuse_file(`${this.#name}:${this.#row_line}:${field + 1}`, what, index, this.fields[field]);
  }

  /** Goes to the next row that isn't blank; false at the end. */
  next() {
    while (this.#at < this.#text.length) if (this.#read_row()) return true;
    this.fields = [];
    return false;
  }

  #read_row() {
    const text = this.#text;
    this.fields = [];
    this.#row_line = this.#line;
    let had_quotes = false;
    for (;;) {
      this.#skip_spaces();
      if (text[this.#at] === '"') {
        had_quotes = true;
        this.fields.push(this.#read_quoted());
      } else {
        const begin = this.#at;
        while (!this.#at_field_end()) ++this.#at;
        this.fields.push(text.slice(begin, this.#at).replace(/[ \t]+$/, ""));
      }
      const end = text[this.#at++];
      if (end === ",") continue;
      if (end === "\r" && text[this.#at] === "\n") ++this.#at;
      ++this.#line;
      return had_quotes || this.fields.length > 1 || this.fields[0] !== "";
    }
  }

  #read_quoted() {
    let value = "";
    for (++this.#at; ; ++this.#at) {
      let c = this.#text[this.#at];
      if (c === undefined) this.fail(this.fields.length, 'the quote is never closed; add the missing "');
      if (c === '"') {
        c = this.#text[++this.#at];
        if (c !== '"') break; // "" stands for one "
      }
      if (c === "\n") ++this.#line;
      value += c;
    }
    this.#skip_spaces();
    if (!this.#at_field_end())
      this.fail(this.fields.length, "text follows a closing quote; put a comma there, or double the quote");
    return value;
  }

  #skip_spaces() {
    while (this.#text[this.#at] === " " || this.#text[this.#at] === "\t") ++this.#at;
  }
  #at_field_end() {
    const c = this.#text[this.#at];
    return c === undefined || c === "," || c === "\n" || c === "\r";
  }
}

const advice =
  "the first line may name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z], or xmin,..., or " +
  "x,y[,z],w,h[,d], " +
  "and maybe id, in any order; without names there are 4 or 6 columns in the first of these orders";

/** What a column has of a box. An axis has two: LO, and HI or what has to be added to it. */
const [LO, HI, EXTENT] = [0, 1, 2];
const BOUNDS = [LO, HI, EXTENT];
const AXES = "xyz";

function own_name(bound, axis) {
  return bound === EXTENT ? "whd"[axis] : (bound === LO ? "lo_" : "hi_") + AXES[axis];
}
/** Our own names, and those that spreadsheets, GeoPandas and detectors of images write. */
function is_name(name, bound, axis) {
  if (name === own_name(bound, axis)) return true;
  if (bound === EXTENT) return false;
  const [end, a] = [bound === LO ? "min" : "max", AXES[axis]];
  const others = [end + a, a + end, `${end}_${a}`, `${a}_${end}`];
  return others.includes(name) || (bound === LO && name === a);
}

/** The number that a text is; undefined if it is none. */
function parse(text) {
  const infinite = /^([+-]?)inf(inity)?$/i.exec(text);
  if (infinite) return infinite[1] === "-" ? -Infinity : Infinity;
  if (/^[+-]?nan$/i.test(text)) return NaN;
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) ? Number(text) : undefined;
}

/** Which column has what: `of[bound][axis]` has its place and its name as the file has it. */
function read_header(rows) {
  if (!rows.next()) rows.fail(0, `the file is empty; ${advice}`);
  const { fields } = rows;
  const of = BOUNDS.map(() => [undefined, undefined, undefined]);
  const header = { of, id: undefined, columns: fields.length, named: true, dim: 2 };
  if (fields.every((field) => parse(field) !== undefined)) {
    header.named = false; // the first line is a box
    if (header.columns !== 4 && header.columns !== 6)
      rows.fail(
        0,
        `there is no line with names, and ${header.columns} ` +
          `column${header.columns === 1 ? "" : "s"}; ${advice}`,
      );
    header.dim = header.columns / 2;
    fields.forEach((_, place) => {
      const [bound, axis] = [place < header.dim ? LO : HI, place % header.dim];
      of[bound][axis] = { place, name: own_name(bound, axis) };
    });
    return header;
  }
  fields.forEach((field, place) => {
    const name = field.replace(/[A-Z]/g, (letter) => letter.toLowerCase());
    const twice = (earlier) =>
      earlier !== undefined && rows.fail(place, `column ${name} is there twice; remove one`);
    if (name === "id") {
      twice(header.id);
      header.id = place;
      return;
    }
    const bound = BOUNDS.find((one) => [0, 1, 2].some((axis) => is_name(name, one, axis)));
    if (bound === undefined) rows.fail(place, `column ${quoted(field)} is not known; ${advice}`);
    const axis = [0, 1, 2].find((one) => is_name(name, bound, one));
    twice(of[bound][axis]);
    of[bound][axis] = { place, name };
  });
  if (BOUNDS.some((bound) => of[bound][2] !== undefined)) header.dim = 3;
  for (const bound of [LO, HI])
    for (let axis = 0; axis < header.dim; ++axis) {
      const [here, size] = [of[bound][axis], of[EXTENT][axis]];
      if (bound === HI && size && here)
        rows.fail(
          Math.max(here.place, size.place),
          `columns ${here.name} and ${size.name} say the same; remove one`,
        );
      if (!here && !(bound === HI && size))
        rows.fail(header.columns, `column ${own_name(bound, axis)} is missing; ${advice}`);
    }
  return header;
}

function number(rows, { place, name }, index) {
  const text = rows.fields[place];
  const fail = (what) => rows.fail(place, `${name} is ${what}`, index);
  if (text === "") fail("empty; write a number");
  const value = parse(text);
  if (value === undefined)
    fail(`${quoted(text)}, which is not a number; write one like -12.5, 1e-3 or inf`);
  if (Math.abs(value) === Infinity && /\d/.test(text))
    fail(`${quoted(text)}, which is more than a double can hold; write inf if it is meant to be unbounded`);
  if (Number.isNaN(value)) fail("NaN; every bound must be a number (inf is allowed)");
  return value;
}

/** The bounds of a box along one axis. */
function read_bounds(rows, { of }, axis, index) {
  const low = of[LO][axis];
  const size = of[EXTENT][axis];
  const high = size ?? of[HI][axis];
  const [from, other] = [number(rows, low, index), number(rows, high, index)];
  const text = ({ place, name }) => `${name} = ${shortened(rows.fields[place])}`;
  if (size === undefined) {
    if (from > other)
      rows.fail(low.place, `${text(low)} is greater than ${text(high)}; swap them or drop the box`, index);
    return [from, other];
  }
  if (other < 0)
    rows.fail(high.place, `${text(high)} is below 0; a box begins at ${low.name} and has this size`, index);
  const to = from + other;
  if (Number.isNaN(to) || (!Number.isFinite(to) && Number.isFinite(from) && Number.isFinite(other)))
    rows.fail(
      high.place,
      `${low.name} + ${high.name} is no number that a double can hold; ` +
        `write the upper bound as hi_${AXES[axis]}`,
      index,
    );
  return [from, to];
}

export function read_csv(bytes, name) {
  if (bytes[0] === 0xff || bytes[0] === 0xfe)
    refuse_file(`${name}:1:1`, "the file is UTF-16 text; save it as UTF-8");
  const rows = new Rows(new TextDecoder().decode(bytes), name); // which leaves a byte order mark out
  const header = read_header(rows);
  const { dim, columns } = header;
  const ids = new Map();
  const numbers = [];
  for (let index = 0; (index === 0 && !header.named) || rows.next(); ++index) {
    const { fields } = rows;
    if (fields.length !== columns)
      rows.fail(
        Math.min(fields.length, columns),
        `the row has ${fields.length} fields and the ${header.named ? "header" : "first"} ${columns}; ` +
          "give each column one value",
        index,
      );
    const box = new Array(2 * dim);
    for (let axis = 0; axis < dim; ++axis)
      [box[axis], box[axis + dim]] = read_bounds(rows, header, axis, index);
    if (header.id !== undefined) {
      const id = fields[header.id];
      if (id === "") rows.fail(header.id, "id is empty; name the box, or leave the column out", index);
      const earlier = ids.get(id);
      if (earlier !== undefined)
        rows.fail(
          header.id,
          `id ${quoted(id)} already names box ${earlier} (the first is 0); ` +
            "make them differ, or leave the column out",
          index,
        );
      ids.set(id, index);
    }
    for (const value of box) numbers.push(value); // not ...box: there may be millions
  }
  return one_frame(dim, Float64Array.from(numbers), header.id !== undefined ? [...ids.keys()] : undefined);
}
