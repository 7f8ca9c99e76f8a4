// Boxes as comma-separated values: RFC 4180, and also spaces around fields, blank lines, any line ends, a
// byte order mark.
import { FileError, quoted, shortened, type Boxes } from "./boxes";

/** One row at a time. */
class Rows {
  fields: string[] = [];
  private line = 1;
  private rowLine = 1;
  private at = 0;

  constructor(private readonly text: string, private readonly name: string) {}

  /** `what` goes wrong in a field of this row, counted from 0. */
  fail(field: number, what: string): never {
    throw new FileError(`${this.name}:${this.rowLine}:${field + 1}: ${what}`);
  }

  /** Goes to the next row that isn't blank; false at the end. */
  next(): boolean {
    while (this.at < this.text.length) if (this.readRow()) return true;
    return false;
  }

  private readRow(): boolean {
    const { text } = this;
    this.fields = [];
    this.rowLine = this.line;
    let hadQuotes = false;
    for (;;) {
      this.skipSpaces();
      if (text[this.at] === '"') {
        hadQuotes = true;
        this.fields.push(this.readQuoted());
      } else {
        const begin = this.at;
        while (!this.atFieldEnd()) ++this.at;
        this.fields.push(text.slice(begin, this.at).replace(/[ \t]+$/, ""));
      }
      const end = text[this.at++];
      if (end === ",") continue;
      if (end === "\r" && text[this.at] === "\n") ++this.at;
      ++this.line;
      return hadQuotes || this.fields.length > 1 || this.fields[0] !== "";
    }
  }

  private readQuoted(): string {
    let value = "";
    for (++this.at; ; ++this.at) {
      let c = this.text[this.at];
      if (c === undefined) this.fail(this.fields.length, 'the quote is never closed; add the missing "');
      if (c === '"') {
        c = this.text[++this.at];
        if (c !== '"') break; // "" stands for one "
      }
      if (c === "\n") ++this.line;
      value += c;
    }
    this.skipSpaces();
    if (!this.atFieldEnd())
      this.fail(this.fields.length, "text follows a closing quote; put a comma there, or double the quote");
    return value;
  }

  private skipSpaces(): void {
    while (this.text[this.at] === " " || this.text[this.at] === "\t") ++this.at;
  }
  private atFieldEnd(): boolean {
    const c = this.text[this.at];
    return c === undefined || c === "," || c === "\n" || c === "\r";
  }
}

const coordinates = ["lo_x", "lo_y", "lo_z", "hi_x", "hi_y", "hi_z"];
const advice =
  "the first line must name the columns: lo_x,lo_y[,lo_z],hi_x,hi_y[,hi_z] and maybe id, in any order";

/** Of each coordinate the column, -1 where there is none; the last is that of ids. */
function readHeader(rows: Rows): number[] {
  if (!rows.next()) rows.fail(0, `the file is empty; ${advice}`);
  const names = [...coordinates, "id"];
  const columns = names.map(() => -1);
  rows.fields.forEach((field, column) => {
    const name = field.toLowerCase();
    const which = names.indexOf(name);
    if (which < 0) rows.fail(column, `column ${quoted(field)} is not known; ${advice}`);
    if (columns[which]! >= 0) rows.fail(column, `column ${name} is there twice; remove one`);
    columns[which] = column;
  });
  const flat = columns[2]! < 0 && columns[5]! < 0;
  coordinates.forEach((name, which) => {
    if (columns[which]! < 0 && (which % 3 !== 2 || !flat))
      rows.fail(rows.fields.length, `column ${name} is missing; ${advice}`);
  });
  return columns;
}

function number(rows: Rows, column: number, name: string): number {
  const text = rows.fields[column]!;
  if (text === "") rows.fail(column, `${name} is empty; write a number`);
  const infinite = /^([+-]?)inf(inity)?$/i.exec(text);
  if (infinite) return infinite[1] === "-" ? -Infinity : Infinity;
  if (/^[+-]?nan$/i.test(text))
    rows.fail(column, `${name} is NaN; every bound must be a number (inf is allowed)`);
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text))
    rows.fail(column, `${name} is ${quoted(text)}, which is not a number; write one like -12.5, 1e-3 or inf`);
  const value = Number(text);
  if (!Number.isFinite(value))
    rows.fail(
      column,
      `${name} is ${quoted(text)}, which is more than a double can hold; ` +
        "write inf if it is meant to be unbounded",
    );
  return value;
}

export function readCsv(bytes: Uint8Array, name: string): Boxes {
  if (bytes[0] === 0xff || bytes[0] === 0xfe)
    throw new FileError(`${name}:1:1: the file is UTF-16 text; save it as UTF-8`);
  const rows = new Rows(new TextDecoder().decode(bytes), name); // which leaves a byte order mark out
  const columns = readHeader(rows);
  const count = rows.fields.length;
  const dim = columns[2]! < 0 ? 2 : 3;
  const axes = Array.from({ length: dim }, (_, axis) => axis);
  const ids = new Map<string, number>();
  const numbers: number[] = [];
  while (rows.next()) {
    const { fields } = rows;
    if (fields.length !== count)
      rows.fail(
        Math.min(fields.length, count),
        `the row has ${fields.length} fields and the header ${count}; give each column one value`,
      );
    const box = new Array<number>(2 * dim);
    for (const axis of axes) {
      const [lo, hi] = [columns[axis]!, columns[axis + 3]!];
      const [least, most] = [coordinates[axis]!, coordinates[axis + 3]!];
      box[axis] = number(rows, lo, least);
      box[axis + dim] = number(rows, hi, most);
      if (box[axis]! > box[axis + dim]!)
        rows.fail(
          lo,
          `${least} = ${shortened(fields[lo]!)} is greater than ${most} = ${shortened(fields[hi]!)}; ` +
            "swap them or drop the box",
        );
    }
    const column = columns[6]!;
    if (column >= 0) {
      const id = fields[column]!;
      if (id === "") rows.fail(column, "id is empty; name the box, or leave the column out");
      const earlier = ids.get(id);
      if (earlier !== undefined)
        rows.fail(
          column,
          `id ${quoted(id)} already names box ${earlier} (the first is 0); ` +
            "make them differ, or leave the column out",
        );
      ids.set(id, ids.size);
    }
    for (const value of box) numbers.push(value); // not ...box: there may be millions
  }
  const boxes = Float64Array.from(numbers);
  return { dim, frames: 1, read: () => boxes };
}
