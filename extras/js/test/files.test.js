// SPDX-License-Identifier: MIT
// Boxes from files: what `jostle pairs` finds in the same files, and what it complains of.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import test from "node:test";

import { JostleError, readBoxes } from "jostle";
import { modules, random, random_boxes } from "./help.js";

const folder = mkdtempSync(join(tmpdir(), "jostle-"));
const command = (...words) => execFileSync(process.env.JOSTLE_COMMAND, words, { cwd: folder, stdio: "pipe" });

/** What the command says of a file: how many boxes and pairs it has, or its complaint. */
function natively(name, bytes, ...options) {
  writeFileSync(join(folder, name), bytes);
  try {
    const { objects, pairs, checksum } = JSON.parse(command("pairs", name, ...options, "--stats"));
    return { objects, pairs, checksum };
  } catch (error) {
    return error.stderr.toString().replace(/^jostle( pairs)?: /, "").trim();
  }
}
async function here(name, bytes, frame = 0) {
  const jostle = await modules.simd();
  const file = readBoxes(bytes, name), { dim } = file;
  const boxes = frame === 0 ? file.boxes : file.frame(frame);
  const pairs = jostle.findPairs(boxes, { dim });
  return { objects: boxes.length / (2 * dim), pairs: pairs.length / 2, checksum: jostle.checksum(pairs) };
}
const text = (string) => new TextEncoder().encode(string);
const latin = (string) => Uint8Array.from(string, (c) => c.charCodeAt(0));

function complaint(bytes, name) {
  let found;
  assert.throws(
    () => readBoxes(bytes, name),
    (error) => (found = error) instanceof JostleError && error.status === "bad_file",
  );
  return found;
}

// --- Tables ---

test("tables give the command's pairs", async () => {
  const rows = Array.from(random_boxes(300, 3, 4, { Array: Float64Array }));
  const lines = Array.from({ length: 300 }, (_, i) => `${rows.slice(6 * i, 6 * i + 6)}`);
  for (const table of [
    "lo_x,lo_y,hi_x,hi_y\n0,0,2,1\n2,1,3,3\n9,9,9,9\n",
    '\ufeff ID , "lo_x",hi_x,hi_y,LO_Y\r\n\r\n"a ""b""",0, 2 ,1e0,0\r\n' +
      "b,+1.5,inf,3.,-.5\rc,-Infinity,-INF,1,1",
    `lo_x,lo_y,lo_z,hi_x,hi_y,hi_z\n${lines.join("\n")}`,
    "lo_x,lo_y,hi_x,hi_y\n",
    "minx,miny,maxx,maxy\n0,0,2,1\n2,1,3,3\n",
    "xmax,Y_MIN,x_min,ymax\n2,0,0,1\n3,1,2,3\n",
    "id,x,y,w,h\na,0,0,2,1\nb,2,1,0,inf\n",
    "x,y,z,hi_x,h,d\n0,0,0,2,1,1\n2,1,1,3,3,3\n",
    "0,0,2,1\n2,1,3,3\n",
    " 0,0,0,2,1,1\n2,1,inf,3,3,inf",
  ])
    assert.deepEqual(await here("boxes.csv", text(table)), natively("boxes.csv", text(table)));
  assert.deepEqual(
    [...readBoxes("lo_x,hi_x,lo_y,hi_y,id\n1,2,3,4,x\n5,6,7,8,y", "a.CSV").boxes],
    [1, 3, 2, 4, 5, 7, 6, 8],
  );
  assert.deepEqual(readBoxes("lo_x,hi_x,lo_y,hi_y,id\n1,2,3,4,x\n5,6,7,8,y", "a.csv").ids, ["x", "y"]);
});

test("tables that are wrong get the command's complaints, which name line, column and value", () => {
  const head = "lo_x,lo_y,hi_x,hi_y,id\n";
  for (const [table, index, value] of [
    ["", undefined, undefined],
    ["\n\n", undefined, undefined],
    ["lo_x,lo_y,hi_x\n", undefined, undefined],
    ["lo_x,lo_y,lo_y,hi_x,hi_y\n", undefined, "lo_y"],
    ["lo_x,lo_y,hi_x,hi_y,colour\n", undefined, "colour"],
    ["1,2,3\n", undefined, "1"],
    ["7\n", undefined, "7"],
    ["0,0,1,1\n0,0,1\n", 1, undefined],
    ["0,0,nan,1\n", 0, "nan"],
    ["x,y,w\n", undefined, undefined],
    ["x,minx,y,w,h\n", undefined, "minx"],
    ["x,y,hi_x,w,h\n", undefined, "w"],
    ["x,y,w,h\n0,0,1,1\n0,0,1,-2\n", 1, "-2"],
    ["x,y,w,h\n0,-inf,1,inf\n", 0, "inf"],
    ["xmin,w,y,h\n1e308,1e308,0,1\n", 0, "1e308"],
    ["minx,miny,maxx,maxy\n3,0,2,1\n", 0, "3"],
    [`${head}0,0,1,1,a\n3,0,2,1,b\n`, 1, "3"],
    [`${head}0,0,1,1,a\n\n0,0,1\n`, 1, undefined],
    [`${head}0,0,1,1,a,7\n`, 0, "7"],
    [`${head}0,0,1,1,"a\nb"\n3,0,2,1,b\n`, 1, "3"],
    [`${head}0,,1,1,a\n`, 0, ""],
    [`${head}0,nan,1,1,a\n`, 0, "nan"],
    [`${head}0,0x10,1,1,a\n`, 0, "0x10"],
    [`${head}0,1 2,1,1,a\n`, 0, "1 2"],
    [`${head}0,1e999,1,1,a\n`, 0, "1e999"],
    [`${head}0,0,1,1,a\n0,0,1,1,a\n`, 1, "a"],
    [`${head}0,0,1,1,\n`, 0, ""],
    [`${head}0,0,1,1,"a\n`, undefined, undefined],
    [`${head}0,0,1,1,"a" b\n`, undefined, undefined],
    [`${head}0,0,1,1,a\n0,0,1,\u0001${"x".repeat(60)},b\n`, 1, `\u0001${"x".repeat(60)}`],
  ]) {
    const error = complaint(table, "bad.csv");
    assert.equal(error.message, natively("bad.csv", text(table)));
    assert.match(error.message, /^bad\.csv:\d+:\d+: /);
    assert.deepEqual([error.index, error.value], [index, value], table);
  }
  const wide = Uint8Array.of(0xff, 0xfe, 65, 0);
  assert.equal(complaint(wide, "bad.csv").message, natively("bad.csv", wide));
});

// --- Arrays ---

function npy(header, numbers, version = 1) {
  const padded = header.padEnd(117) + "\n";
  const length = Array.from({ length: version === 1 ? 2 : 4 }, (_, i) => (padded.length >> (8 * i)) & 255);
  const bytes = new Uint8Array(numbers.buffer);
  const start = [...latin("\x93NUMPY"), version, 0, ...length];
  const file = new Uint8Array(start.length + padded.length + bytes.length);
  file.set(start);
  file.set(latin(padded), start.length);
  file.set(bytes, start.length + padded.length);
  return file;
}
const head = (descr, shape, order = "False") =>
  `{'descr': '${descr}', 'fortran_order': ${order}, 'shape': ${shape}, }`;

test("arrays give the command's pairs, whatever their type, order and version", async () => {
  for (const dim of [2, 3])
    for (const [type, Array] of [
      ["f4", Float32Array],
      ["f8", Float64Array],
    ]) {
      const boxes = random_boxes(40, dim, dim, { Array });
      const size = Array.BYTES_PER_ELEMENT;
      const swapped = boxes.slice();
      const bytes = new Uint8Array(swapped.buffer);
      for (let at = 0; at < bytes.length; at += size) bytes.subarray(at, at + size).reverse();
      const column = (i, c) => boxes[2 * dim * i + c];
      const turned = Array.from({ length: boxes.length }, (_, k) => column(k % 40, Math.floor(k / 40)));
      const nested = Array.from({ length: boxes.length }, (_, k) => {
        const c = Math.floor(k / 40);
        return column(k % 40, (c % 2) * dim + Math.floor(c / 2));
      });
      const [flat, deep] = [`(40, ${2 * dim})`, `(40, 2, ${dim})`];
      for (const file of [
        npy(head(`<${type}`, flat), boxes),
        npy(head(`<${type}`, deep), boxes, 2),
        npy(head(`>${type}`, flat), swapped, 3),
        npy(head(`<${type}`, flat, "True"), turned),
        npy(head(`<${type}`, deep, "True"), nested),
      ]) {
        assert.deepEqual(readBoxes(file, "boxes.npy").boxes, boxes);
        assert.deepEqual(await here("boxes.npy", file), natively("boxes.npy", file));
      }
      // Bytes in the middle of others, as node hands them out.
      const inside = new Uint8Array(5000);
      const file = npy(head(`<${type}`, flat), boxes);
      inside.set(file, 33);
      assert.deepEqual(readBoxes(inside.subarray(33, 33 + file.length), "boxes.npy").boxes, boxes);
      assert.deepEqual(readBoxes(file.buffer, "boxes.npy").boxes, boxes);
    }
});

test("arrays that are wrong get the command's complaints", () => {
  const two = new Float32Array(8);
  const file = npy(head("<f4", "(2, 4)"), two);
  const bad = [
    latin("\x93NUMPY\x01\x00"),
    latin("not an array of NumPy's"),
    npy(head("<f4", "(2, 4)"), two, 4),
  ];
  for (const [descr, shape] of [
    ["<f4", "(8,)"],
    ["<f4", "(2, 5)"],
    ["<i4", "(2, 4)"],
    ["<f4", "(3, 4)"],
    ["<f4", "(1, 4)"],
  ])
    bad.push(npy(head(descr, shape), two));
  bad.push(npy("{'descr': '<f4', 'shape': (2, 4)}", two), npy("nonsense", two), file.subarray(0, 100));
  bad.push(npy("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (2, 4), }", two));
  for (const bytes of bad) assert.equal(complaint(bytes, "bad.npy").message, natively("bad.npy", bytes));
});

// A parser that goes back and tries every way to read them doesn't return.
test("headers of arrays that are damaged late, or are long, are read once", () => {
  const two = new Float32Array(8);
  const spaces = " ".repeat(2 ** 20 - 300);
  for (const header of [
    head("<f4", `(${"1".repeat(28)}x, 4)`),
    head("<f4", `(${"1".repeat(18)} ${"1".repeat(18)} ${"1".repeat(18)}x, 4)`),
    head("<f4", "(2 4)"),
    head("<f4", "(2,, 4)"),
    head("<f4", "(2, 4)") + "x",
    head("<f4", "2, 4"),
    head("<f4", "(2, 4)", "Maybe"),
    head("<f4", "(2, 4)").replace("shape", "toString"),
    head("<f4", "(2, 4)").replace("'descr'", "'descr': '<f4', 'descr'"),
    "{'descr': '<f4",
    `${head("<f4", "(2, 4)")}${spaces}x`,
    `{${spaces}x`,
    `{'descr': '<f4',${spaces}x`,
    `{'descr': ${"[".repeat(1000)}`,
  ]) {
    const file = npy(header, two, 3);
    assert.equal(complaint(file, "bad.npy").message, natively("bad.npy", file), header.slice(0, 100));
  }
  for (const header of [
    `${head("<f4", "(2, 4)")}${spaces}`,
    `{${spaces}'shape':(2L,\n4L,),"fortran_order" :False,\t'descr': "<f4"}`,
    `{'descr': '<f4', 'fortran_order': False, 'shape': (2${spaces},4)}`,
  ])
    assert.deepEqual(readBoxes(npy(header, two, 3), "boxes.npy").boxes, two);
});

// --- Recordings ---

test("a simulation's recording: the command's pairs in every frame asked for, in any order", async () => {
  for (const [scene, bodies] of [["spheres", 1], ["mixed", 40], ["boxes", 3000]]) {
    command("simulate", "--scene", scene, "-n", String(bodies), "--frames", "12", "--record", "falling.jrec");
    const bytes = readFileSync(join(folder, "falling.jrec"));
    const file = readBoxes(bytes, "falling.jrec");
    assert.deepEqual([file.dim, file.frames], [3, 13]);
    for (const frame of [0, 12, 3, 4, 0, 7]) {
      const expected = natively("falling.jrec", bytes, "--frame", String(frame));
      assert.deepEqual(await here("falling.jrec", bytes, frame), expected);
      const once = file.frame(frame);
      assert.deepEqual(once, readBoxes(bytes, "falling.jrec").frame(frame));
      once.fill(7); // it is the caller's
    }
    assert.deepEqual(file.boxes, file.frame(0));
    for (const frame of [-1, 13, 0.5, "1"])
      assert.throws(() => file.frame(frame), {
        name: "JostleError",
        message: /frame is .*: it must be .* below 13/,
      });
  }
});

const integer = (value, bytes) =>
  Array.from({ length: bytes }, (_, i) => Number((BigInt(value) >> BigInt(8 * i)) & 255n));
const sum_of = (numbers) =>
  numbers.reduce(
    (sum, each) => ((sum ^ BigInt(each)) * 0x100000001b3n) & (2n ** 64n - 1n),
    0xcbf29ce484222325n,
  );
function recording(version, dim, size, objects, frames, count = frames.length) {
  const bytes = [
    ...latin("JOSTLRE"),
    version,
    ...integer(dim, 4),
    ...integer(size, 4),
    ...integer(objects, 4),
  ];
  bytes.push(...integer(0, 4), ...integer(count, 8), ...integer(0, 8));
  bytes.push(...integer(sum_of(bytes), 8));
  return Uint8Array.from([bytes, ...frames].flat());
}
const bits_of = (boxes) =>
  boxes instanceof Float32Array ? new Uint32Array(boxes.buffer) : new BigUint64Array(boxes.buffer);

/** A frame as jostle::Recorder writes it. */
function plain_frame(boxes, dim) {
  const count = boxes.length / (2 * dim);
  const bits = Array.from(bits_of(boxes));
  const each = boxes.BYTES_PER_ELEMENT;
  return [
    ...integer(count, 4),
    ...bits.flatMap((bit) => integer(bit, each)),
    ...integer(sum_of([count, ...bits]), 8),
  ];
}
test("a recorder's recording, closed or not", async () => {
  for (const dim of [2, 3])
    for (const Array of [Float32Array, Float64Array]) {
      const all = [3, 50, 0, 20].map((count) => random_boxes(count, dim, count + 1, { Array }));
      const frames = all.map((boxes) => plain_frame(boxes, dim));
      for (const count of [4, 2n ** 64n - 1n]) {
        const bytes = recording(2, dim, Array.BYTES_PER_ELEMENT, 50, frames, count);
        const file = readBoxes(bytes, "recorded.jrec");
        assert.equal(file.frames, 4);
        for (const frame of [1, 0, 3, 2]) {
          assert.deepEqual(file.frame(frame), all[frame]);
          const expected = natively("recorded.jrec", bytes, "--frame", String(frame));
          assert.deepEqual(await here("recorded.jrec", bytes, frame), expected);
        }
      }
      const cut = recording(2, dim, Array.BYTES_PER_ELEMENT, 50, frames, 2n ** 64n - 1n).subarray(0, -1);
      assert.equal(readBoxes(cut, "cut.jrec").frames, 3);
    }
});

/**
 * A frame of version 1 whose bytes are wrapped rather than packed; `last` and `before` are the frames before.
 */
function packed_frame(number, boxes, dim, last, before) {
  const Array = boxes.constructor, size = Array.BYTES_PER_ELEMENT, objects = boxes.length / (2 * dim);
  const all = 2n ** BigInt(8 * size) - 1n, sign = 1n << BigInt(8 * size - 1);
  const ordered = (value) => {
    const bits = BigInt(bits_of(Array.of(value))[0]);
    return bits & sign ? ~bits & all : bits | sign;
  };
  const round = (value) => Array.of(value)[0];
  const content = [...integer(number, 4)];
  for (let axis = 0; axis < dim; ++axis)
    for (const side of [0, dim]) {
      const folded = [];
      for (let i = 0; i < objects; ++i) {
        const lo = 2 * dim * i + axis, hi = lo + dim, at = lo + side;
        let expected = number === 0 ? (side === 0 ? 0 : boxes[lo]) : last[at];
        const steps = side === 0 ? number > 1 && [last[lo], before[lo]] : number > 0 && [boxes[lo], last[lo]];
        const moved = steps ? round(expected + round(steps[0] - steps[1])) : NaN;
        if (Number.isFinite(moved)) expected = moved;
        const difference = (ordered(boxes[at]) - ordered(expected)) & all;
        folded.push(difference & sign ? ((~difference & all) << 1n) | 1n : (difference << 1n) & all);
      }
      for (let byte = 0; byte < size; ++byte)
        content.push(...folded.map((each) => integer(each, size)[byte]));
    }
  const frame = [
    ...integer(0xfd2fb528, 4),
    0xa0,
    ...integer(content.length, 4),
    ...integer((content.length << 3) | 1, 3),
  ];
  return [...integer(frame.length + content.length, 4), ...frame, ...content];
}
test("compressed recordings of every dimension and type", async () => {
  for (const dim of [2, 3])
    for (const Array of [Float32Array, Float64Array]) {
      const next = random(9), all = [];
      for (let frame = 0; frame < 5; ++frame) {
        const boxes = random_boxes(30, dim, 3, { Array }).map((bound) => bound - frame * next() * 1e-3);
        for (let i = 0; i < boxes.length; i += 2 * dim) boxes[i] = Math.min(boxes[i], boxes[i + dim]);
        [boxes[0], boxes[dim]] = frame % 2 ? [-Infinity, Infinity] : [-0, 0];
        all.push(boxes);
      }
      for (const boxes of all)
        for (let i = 0; i < boxes.length; i += 2 * dim)
          for (let axis = 0; axis < dim; ++axis)
            if (boxes[i + axis] > boxes[i + dim + axis]) boxes[i + axis] = boxes[i + dim + axis];
      const frames = all.map((boxes, k) => packed_frame(k, boxes, dim, all[k - 1], all[k - 2]));
      const bytes = recording(1, dim, Array.BYTES_PER_ELEMENT, 30, frames);
      const file = readBoxes(bytes, "packed.jrec");
      for (const frame of [0, 1, 2, 3, 4, 2]) {
        assert.deepEqual(file.frame(frame), all[frame]);
        const expected = natively("packed.jrec", bytes, "--frame", String(frame));
        assert.deepEqual(await here("packed.jrec", bytes, frame), expected);
      }
    }
});

test("recordings that were cut or altered get the command's complaints, wherever that is", () => {
  command("simulate", "--scene", "mixed", "-n", "20", "--frames", "3", "--record", "small.jrec");
  const packed = readFileSync(join(folder, "small.jrec"));
  const boxes = random_boxes(4, 2, 1);
  const plain = recording(2, 2, 4, 4, [plain_frame(boxes, 2), plain_frame(boxes, 2)]);
  /** Its last frame, or the complaint. */
  const outcome = (bytes) => {
    try {
      const file = readBoxes(bytes, "bad.jrec");
      return file.frame(file.frames - 1);
    } catch (error) {
      assert.ok(error instanceof JostleError && error.status === "bad_file", error);
      return error.message;
    }
  };
  for (const [bytes, frame] of [[packed, "3"], [plain, "1"]]) {
    const whole = outcome(bytes);
    let refused = 0;
    for (let at = 0; at < bytes.length; ++at) {
      const altered = Uint8Array.from(bytes);
      altered[at] ^= 1 << at % 8;
      const said = outcome(altered);
      if (typeof said === "string") ++refused;
      else assert.deepEqual(said, whole, `byte ${at}`); // Zstandard has a few bits without a meaning
      if (typeof said === "string" && at % 97 === 0)
        assert.equal(said, natively("bad.jrec", altered, "--frame", frame), `byte ${at}`);
      if (at % 7 === 0) assert.equal(typeof outcome(bytes.subarray(0, at)), "string");
    }
    assert.ok(refused >= bytes.length - 12, `${refused} of ${bytes.length}`);
  }
  assert.equal(outcome(new Uint8Array(0)), "bad.jrec: is no recording of moving boxes (.jrec); give one");
});

test("content and names of the wrong kind", () => {
  const refuses = (content, name, message) =>
    assert.throws(() => readBoxes(content, name), { name: "JostleError", message });
  refuses([1, 2], "a.csv", "content is a Array: it must be an ArrayBuffer, a Uint8Array or text");
  refuses(undefined, "a.csv", /content is undefined/);
  const gone = new Uint8Array(3);
  structuredClone(gone.buffer, { transfer: [gone.buffer] });
  for (const content of [gone, gone.buffer]) refuses(content, "a.csv", /^content was transferred/);
  const table = text("lo_x,lo_y,hi_x,hi_y\n0,1,2,3\n");
  const shared = new Uint8Array(new SharedArrayBuffer(table.length));
  shared.set(table);
  assert.deepEqual([...readBoxes(shared, "a.csv").boxes], [0, 1, 2, 3]);
  refuses("lo_x", undefined, 'name is undefined: it must be the file\'s, such as "boxes.csv"');
  refuses("lo_x", "boxes", "boxes: the name has no extension; give .csv, .npy or .jrec");
  refuses("v 0 0 0", "mesh.obj", "mesh.obj: can't read .obj files; give .csv, .npy or .jrec");
});
