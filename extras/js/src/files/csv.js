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

const coordinates = ["lo_x", "lo_y", "lo_z", "hi_x", "hi_y", "hi_z"];
const advice =
  "the first line must name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z] and maybe id, in any order";

/** Of each coordinate the column, -1 where there is none; the last is that of ids. */
function read_header(rows) {
  if (!rows.next()) rows.fail(0, `the file is empty; ${advice}`);
  const names = [...coordinates, "id"];
  const columns = names.map(() => -1);
  rows.fields.forEach((field, column) => {
    const name = field.toLowerCase();
    const which = names.indexOf(name);
    if (which < 0) rows.fail(column, `column ${quoted(field)} is not known; ${advice}`);
    if (columns[which] >= 0) rows.fail(column, `column ${name} is there twice; remove one`);
    columns[which] = column;
  });
  const flat = columns[2] < 0 && columns[5] < 0;
  coordinates.forEach((name, which) => {
    if (columns[which] < 0 && (which % 3 !== 2 || !flat))
      rows.fail(rows.fields.length, `column ${name} is missing; ${advice}`);
  });
  return columns;
}

function number(rows, column, name, index) {
  const text = rows.fields[column];
  const fail = (what) => rows.fail(column, `${name} is ${what}`, index);
  if (text === "") fail("empty; write a number");
  const infinite = /^([+-]?)inf(inity)?$/i.exec(text);
  if (infinite) return infinite[1] === "-" ? -Infinity : Infinity;
  if (/^[+-]?nan$/i.test(text)) fail("NaN; every bound must be a number (inf is allowed)");
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text))
    fail(`${quoted(text)}, which is not a number; write one like -12.5, 1e-3 or inf`);
  const value = Number(text);
  if (!Number.isFinite(value))
    fail(`${quoted(text)}, which is more than a double can hold; write inf if it is meant to be unbounded`);
  return value;
}

export function read_csv(bytes, name) {
  if (bytes[0] === 0xff || bytes[0] === 0xfe)
    refuse_file(`${name}:1:1`, "the file is UTF-16 text; save it as UTF-8");
  const rows = new Rows(new TextDecoder().decode(bytes), name); // which leaves a byte order mark out
  const columns = read_header(rows);
  const count = rows.fields.length;
  const dim = columns[2] < 0 ? 2 : 3;
  const id_column = columns[6];
  const ids = new Map();
  const numbers = [];
  for (let index = 0; rows.next(); ++index) {
    const { fields } = rows;
    if (fields.length !== count)
      rows.fail(
        Math.min(fields.length, count),
        `the row has ${fields.length} fields and the header ${count}; give each column one value`,
        index,
      );
    const box = new Array(2 * dim);
    for (let axis = 0; axis < dim; ++axis) {
      const [lo, hi] = [columns[axis], columns[axis + 3]];
      const [least, most] = [coordinates[axis], coordinates[axis + 3]];
      box[axis] = number(rows, lo, least, index);
      box[axis + dim] = number(rows, hi, most, index);
      if (box[axis] > box[axis + dim])
        rows.fail(
          lo,
          `${least} = ${shortened(fields[lo])} is greater than ${most} = ${shortened(fields[hi])}; ` +
            "swap them or drop the box",
          index,
        );
    }
    if (id_column >= 0) {
      const id = fields[id_column];
      if (id === "") rows.fail(id_column, "id is empty; name the box, or leave the column out", index);
      const earlier = ids.get(id);
      if (earlier !== undefined)
        rows.fail(
          id_column,
          `id ${quoted(id)} already names box ${earlier} (the first is 0); ` +
            "make them differ, or leave the column out",
          index,
        );
      ids.set(id, index);
    }
    for (const value of box) numbers.push(value); // not ...box: there may be millions
  }
  return one_frame(dim, Float64Array.from(numbers), id_column >= 0 ? [...ids.keys()] : undefined);
}
