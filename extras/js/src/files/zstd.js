// SPDX-License-Identifier: MIT
// Unpacks Zstandard (RFC 8878): one frame, without a dictionary, whose size is known. Browsers have nothing
// of their own for it.

class Damaged extends Error {}
function damaged() {
  throw new Damaged();
}
const highest_bit = (value) => 31 - Math.clz32(value);

/** Bits that were written forwards and are read from the last one back. Before the first there are zeros. */
class Backwards {
  constructor(bytes) {
    if (bytes.length === 0 || bytes.at(-1) === 0) damaged();
    this.bytes = bytes;
    this.left = 8 * (bytes.length - 1) + highest_bit(bytes.at(-1)); // the last bit that is set marks the end
  }
  /** Up to 25 bits that begin `count` bits back. */
  peek(count) {
    const { bytes } = this;
    const begin = this.left - count;
    const from = Math.max(begin, 0), at = from >>> 3;
    const word = bytes[at] | (bytes[at + 1] << 8) | (bytes[at + 2] << 16) | (bytes[at + 3] << 24);
    const wanted = this.left - from;
    return wanted <= 0 ? 0 : ((word >>> (from & 7)) & ((1 << wanted) - 1)) << (from - begin);
  }
  read(count) {
    if (count > 16) {
      const high = this.read(count - 16);
      return high * 65536 + this.read(16);
    }
    const value = this.peek(count);
    this.left -= count;
    return value;
  }
}

/** A table of finite state entropy: for each state its symbol, and how the next one is made. */
function table_of(frequencies, log) {
  const size = 1 << log;
  const table = {
    log,
    symbol: new Uint8Array(size),
    bits: new Uint8Array(size),
    base: new Uint16Array(size),
  };
  const next = frequencies.map((frequency) => Math.abs(frequency));
  let high = size;
  frequencies.forEach((frequency, symbol) => {
    if (frequency === -1) table.symbol[--high] = symbol;
  });
  const step = (size >> 1) + (size >> 3) + 3;
  let place = 0;
  frequencies.forEach((frequency, symbol) => {
    for (let i = 0; i < frequency; ++i) {
      table.symbol[place] = symbol;
      do place = (place + step) & (size - 1);
      while (place >= high);
    }
  });
  for (let state = 0; state < size; ++state) {
    const count = next[table.symbol[state]]++;
    table.bits[state] = log - highest_bit(count);
    table.base[state] = (count << table.bits[state]) - size;
  }
  return table;
}
/** Reads such a table at `at`; returns it, and where it ends. */
function read_table(bytes, at, most_log, most_symbols) {
  let bit = 8 * at;
  const read = (count) => {
    let value = 0;
    for (let i = 0; i < count; ++i, ++bit) value |= ((bytes[bit >>> 3] >>> (bit & 7)) & 1) << i;
    if (bit > 8 * bytes.length) damaged();
    return value;
  };
  const log = 5 + read(4);
  if (log > most_log) damaged();
  const frequencies = [];
  let left = 1 << log;
  while (left > 0) {
    // Values that can't be reached any more make the smaller ones a bit shorter.
    const bits = highest_bit(left + 1);
    const short = (1 << (bits + 1)) - 2 - left;
    let value = read(bits);
    if (value >= short && read(1) === 1) value += (1 << bits) - short;
    const frequency = value - 1;
    left -= Math.abs(frequency);
    frequencies.push(frequency);
    if (frequency === 0)
      for (let zeros = 3; zeros === 3; ) {
        zeros = read(2);
        for (let i = 0; i < zeros; ++i) frequencies.push(0);
      }
    if (frequencies.length > most_symbols) damaged();
  }
  if (left !== 0) damaged();
  return { table: table_of(frequencies, log), end: (bit + 7) >>> 3 };
}

/** A table of Huffman codes: for each `most` bits the symbol that they begin with, and how many it takes. */
function read_huffman(bytes, at) {
  const head = bytes[at++];
  const weights = [];
  let end;
  if (head >= 128) {
    const count = head - 127;
    end = at + ((count + 1) >>> 1);
    if (end > bytes.length) damaged();
    for (let i = 0; i < count; ++i)
      weights.push(i % 2 === 0 ? bytes[at + (i >> 1)] >>> 4 : bytes[at + (i >> 1)] & 15);
  } else {
    end = at + head;
    if (end > bytes.length) damaged();
    const packed = bytes.subarray(at, end);
    const { table, end: begin } = read_table(packed, 0, 6, 13);
    const stream = new Backwards(packed.subarray(begin));
    // Two states take turns; when the bits of one are used up the other has the last word.
    const states = [stream.read(table.log), stream.read(table.log)];
    if (stream.left < 0) damaged();
    for (let turn = 0; ; turn ^= 1) {
      weights.push(table.symbol[states[turn]]);
      states[turn] = table.base[states[turn]] + stream.read(table.bits[states[turn]]);
      if (stream.left < 0) {
        weights.push(table.symbol[states[turn ^ 1]]);
        break;
      }
      if (weights.length > 255) damaged();
    }
  }
  const sum = weights.reduce((total, weight) => total + (weight === 0 ? 0 : 1 << (weight - 1)), 0);
  if (sum === 0 || weights.length > 255) damaged();
  // What is missing to a power of two is the last one.
  const most = highest_bit(sum) + 1, missing = (1 << most) - sum;
  if (most > 11 || (missing & (missing - 1)) !== 0) damaged();
  weights.push(highest_bit(missing) + 1);
  const table = { most, symbol: new Uint8Array(1 << most), bits: new Uint8Array(1 << most) };
  let place = 0;
  for (let weight = 1; weight <= most; ++weight)
    weights.forEach((each, symbol) => {
      if (each !== weight) return;
      const size = 1 << (weight - 1);
      table.symbol.fill(symbol, place, place + size);
      table.bits.fill(most + 1 - weight, place, place + size);
      place += size;
    });
  if (place !== 1 << most) damaged(); // a weight was too great
  return { table, end };
}
function read_symbols({ most, symbol, bits }, bytes, out) {
  const stream = new Backwards(bytes);
  for (let i = 0; i < out.length; ++i) {
    const code = stream.peek(most);
    out[i] = symbol[code];
    stream.left -= bits[code];
    if (stream.left < 0) damaged();
  }
  if (stream.left !== 0) damaged();
}

// What codes of lengths stand for: a least value, and how many bits to add to it.
function codes(plain, first, bits) {
  const base = Array.from({ length: plain }, (_, i) => first + i);
  const extra = base.map(() => 0);
  for (const each of bits) {
    base.push(base.at(-1) + (1 << extra.at(-1)));
    extra.push(each);
  }
  return { base, extra };
}
const literal_codes = codes(16, 0, [1, 1, 1, 1, 2, 2, 3, 3, 4, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
const match_codes = codes(32, 3, [1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
const times = (count, value) => new Array(count).fill(value);
const usual_tables = {
  literals: table_of(
    [4, 3, ...times(11, 2), 1, 1, 1, ...times(9, 2), 3, 2, ...times(5, 1), ...times(4, -1)],
    6,
  ),
  offsets: table_of([...times(6, 1), 2, 2, 2, ...times(15, 1), ...times(5, -1)], 5),
  matches: table_of([1, 4, 3, ...times(6, 2), ...times(37, 1), ...times(7, -1)], 6),
};

/** What one block tells the next. */
class Frame {
  #out;
  #size;
  #at = 0;
  #huffman;
  #tables = {};
  #offsets = [1, 4, 8];

  constructor(size, packed) {
    this.#size = size;
    // A few bytes can claim to hold gigabytes: memory is asked for as it is needed.
    this.#out = new Uint8Array(Math.min(size, 2 ** 20 + 8 * packed));
  }
  #room(count) {
    const end = this.#at + count;
    if (end > this.#size) damaged();
    if (end <= this.#out.length) return;
    const more = new Uint8Array(Math.min(this.#size, Math.max(end, 2 * this.#out.length)));
    more.set(this.#out);
    this.#out = more;
  }
  copy(bytes) {
    this.#room(bytes.length);
    this.#out.set(bytes, this.#at);
    this.#at += bytes.length;
  }
  fill(byte, count) {
    this.#room(count);
    this.#out.fill(byte, this.#at, this.#at + count);
    this.#at += count;
  }
  finish() {
    if (this.#at !== this.#size) damaged();
    return this.#out;
  }

  unpack(block) {
    const { literals, end } = this.#read_literals(block);
    let at = end;
    let count = block[at++];
    if (count >= 128)
      count = count < 255 ? ((count - 128) << 8) + block[at++] : block[at++] + (block[at++] << 8) + 0x7f00;
    if (!(count >= 0)) damaged(); // the block has ended
    if (count === 0) {
      if (at !== block.length) damaged();
      return this.copy(literals);
    }
    const modes = block[at++];
    for (const [name, shift, log, symbols] of [
      ["literals", 6, 9, 36],
      ["offsets", 4, 8, 32],
      ["matches", 2, 9, 53],
    ])
      switch ((modes >>> shift) & 3) {
        case 0:
          this.#tables[name] = usual_tables[name];
          break;
        case 1: {
          const symbol = block[at++];
          if (!(symbol < symbols)) damaged();
          this.#tables[name] = { log: 0, symbol: [symbol], bits: [0], base: [0] };
          break;
        }
        case 2: {
          const { table, end: next } = read_table(block, at, log, symbols);
          this.#tables[name] = table;
          at = next;
          break;
        }
        default: // that of the block before
          if (this.#tables[name] === undefined) damaged();
      }
    this.#run(literals, count, new Backwards(block.subarray(at)));
  }

  #read_literals(block) {
    const type = block[0] & 3, format = (block[0] >>> 2) & 3;
    const word = (size) => {
      if (size > block.length) damaged();
      let value = 0;
      for (let i = size - 1; i >= 0; --i) value = value * 256 + block[i];
      return Math.floor(value / 16);
    };
    if (type < 2) {
      const head = [1, 2, 1, 3][format];
      const size = head === 1 ? block[0] >>> 3 : word(head);
      const end = head + (type === 0 ? size : 1);
      if (end > block.length) damaged();
      if (type === 0) return { literals: block.subarray(head, end), end };
      if (size > 2 ** 17) damaged();
      return { literals: new Uint8Array(size).fill(block[head]), end };
    }
    const [head, bits] = [[3, 10], [3, 10], [4, 14], [5, 18]][format];
    const sizes = word(head);
    const size = sizes % (1 << bits), end = head + (Math.floor(sizes / (1 << bits)) % (1 << bits));
    if (end > block.length || size > 2 ** 17) damaged();
    let at = head;
    if (type === 2) ({ table: this.#huffman, end: at } = read_huffman(block.subarray(0, end), at));
    else if (this.#huffman === undefined) damaged();
    const literals = new Uint8Array(size);
    if (format === 0) read_symbols(this.#huffman, block.subarray(at, end), literals);
    else {
      if (at + 6 > end) damaged();
      const each = (size + 3) >> 2;
      let from = at + 6;
      for (let stream = 0; stream < 4; ++stream) {
        const to = stream < 3 ? from + block[at + 2 * stream] + (block[at + 2 * stream + 1] << 8) : end;
        if (to > end) damaged();
        const out = literals.subarray(stream * each, stream < 3 ? (stream + 1) * each : size);
        read_symbols(this.#huffman, block.subarray(from, to), out);
        from = to;
      }
    }
    return { literals, end };
  }

  /** Each sequence is some literals, and then something that was there before. */
  #run(literals, count, stream) {
    const tables = this.#tables;
    let literal = stream.read(tables.literals.log);
    let offset = stream.read(tables.offsets.log);
    let match = stream.read(tables.matches.log);
    let taken = 0;
    for (let i = 0; i < count; ++i) {
      const bits = tables.offsets.symbol[offset];
      const match_code = tables.matches.symbol[match], literal_code = tables.literals.symbol[literal];
      const far = 2 ** bits + stream.read(bits);
      const length = match_codes.base[match_code] + stream.read(match_codes.extra[match_code]);
      const plain = literal_codes.base[literal_code] + stream.read(literal_codes.extra[literal_code]);
      const distance = this.#distance(far, plain);
      if (i + 1 < count) {
        literal = tables.literals.base[literal] + stream.read(tables.literals.bits[literal]);
        match = tables.matches.base[match] + stream.read(tables.matches.bits[match]);
        offset = tables.offsets.base[offset] + stream.read(tables.offsets.bits[offset]);
      }
      if (stream.left < 0 || taken + plain > literals.length) damaged();
      this.#room(plain + length);
      const out = this.#out;
      let to = this.#at;
      for (const end = to + plain; to < end; ++to, ++taken) out[to] = literals[taken];
      if (!(distance > 0 && distance <= to)) damaged();
      for (const end = to + length; to < end; ++to) out[to] = out[to - distance]; // they may overlap
      this.#at = to;
    }
    if (stream.left !== 0) damaged();
    this.copy(literals.subarray(taken));
  }
  /** How far back a sequence reaches: small numbers stand for distances of the sequences before. */
  #distance(far, plain) {
    const last = this.#offsets;
    if (far > 3) this.#offsets = [far - 3, last[0], last[1]];
    else {
      const which = plain === 0 ? far : far - 1;
      const distance = which < 3 ? last[which] : last[0] - 1;
      if (which !== 0) this.#offsets = [distance, last[0], which === 1 ? last[2] : last[1]];
    }
    return this.#offsets[0];
  }
}

// XXH64, whose 64-bit numbers are held as two of 32.
class Wide {
  constructor(high, low) {
    this.high = high | 0;
    this.low = low | 0;
  }
  add({ high, low }) {
    const sum = (this.low >>> 0) + (low >>> 0);
    this.high = (this.high + high + (sum > 0xffffffff ? 1 : 0)) | 0;
    this.low = sum | 0;
    return this;
  }
  xor({ high, low }) {
    this.high ^= high;
    this.low ^= low;
    return this;
  }
  times({ high, low }) {
    const [a, b, c, d] = [this.low >>> 16, this.low & 0xffff, low >>> 16, low & 0xffff];
    const middle = a * d + ((b * d) >>> 16); // the upper half of the product of the lower halves, in parts
    const other = b * c + (middle & 0xffff);
    const carried = a * c + Math.floor(middle / 65536) + Math.floor(other / 65536);
    this.high = (Math.imul(this.high, low) + Math.imul(this.low, high) + carried) | 0;
    this.low = Math.imul(this.low, low);
    return this;
  }
  rotate(count) {
    if (count >= 32) [this.high, this.low] = [this.low, this.high];
    const by = count & 31;
    if (by === 0) return this;
    const { high, low } = this;
    this.high = (high << by) | (low >>> (32 - by));
    this.low = (low << by) | (high >>> (32 - by));
    return this;
  }
  shift_xor(count) {
    const by = count & 31;
    return this.xor(
      count >= 32
        ? { high: 0, low: this.high >>> by }
        : { high: this.high >>> by, low: (this.low >>> by) | (this.high << (32 - by)) },
    );
  }
}
const primes = [
  [0x9e3779b1, 0x85ebca87], [0xc2b2ae3d, 0x27d4eb4f], [0x165667b1, 0x9e3779f9], [0x85ebca77, 0xc2b2ae63],
  [0x27d4eb2f, 0x165667c5],
].map(([high, low]) => new Wide(high, low));
const wide = (value) => new Wide(value.high, value.low);

/** The lower half of XXH64. */
function checksum(bytes) {
  const [p1, p2, p3, p4, p5] = primes;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const number = new Wide(0, 0);
  const at_64 = (at) => {
    number.low = view.getInt32(at, true);
    number.high = view.getInt32(at + 4, true);
    return number;
  };
  let at = 0;
  let sum;
  if (bytes.length >= 32) {
    const minus_p1 = new Wide(~p1.high, -p1.low);
    const lanes = [wide(p1).add(p2), wide(p2), new Wide(0, 0), minus_p1];
    for (; at + 32 <= bytes.length; at += 32)
      for (let lane = 0; lane < 4; ++lane)
        lanes[lane]
          .add(at_64(at + 8 * lane).times(p2))
          .rotate(31)
          .times(p1);
    sum = new Wide(0, 0);
    [1, 7, 12, 18].forEach((count, lane) => sum.add(wide(lanes[lane]).rotate(count)));
    for (const lane of lanes) sum.xor(lane.times(p2).rotate(31).times(p1)).times(p1).add(p4);
  } else sum = wide(p5);
  sum.add({ high: Math.floor(bytes.length / 2 ** 32), low: bytes.length | 0 });
  for (; at + 8 <= bytes.length; at += 8)
    sum.xor(at_64(at).times(p2).rotate(31).times(p1)).rotate(27).times(p1).add(p4);
  if (at + 4 <= bytes.length) {
    sum.xor(new Wide(0, view.getInt32(at, true)).times(p1)).rotate(23).times(p2).add(p3);
    at += 4;
  }
  for (; at < bytes.length; ++at) sum.xor(new Wide(0, bytes[at]).times(p5)).rotate(11).times(p1);
  sum.shift_xor(33).times(p2).shift_xor(29).times(p3).shift_xor(32);
  return sum.low >>> 0;
}

function unpack_frame(bytes, size) {
  let at = 0;
  const number = (count) => {
    if (at + count > bytes.length) damaged();
    let value = 0;
    for (let i = count - 1; i >= 0; --i) value = value * 256 + bytes[at + i];
    at += count;
    return value;
  };
  if (number(4) !== 0xfd2fb528) damaged();
  const head = number(1);
  const whole = (head & 32) !== 0;
  if ((head & 8) !== 0) damaged(); // it means nothing yet
  if (!whole) number(1); // how far sequences reach back: as far as there is something here
  if (number([0, 1, 2, 4][head & 3]) !== 0) damaged(); // a dictionary
  const told = head >>> 6;
  if (told !== 0 || whole) {
    const own = number([1, 2, 4, 8][told]) + (told === 1 ? 256 : 0);
    if (own !== size) damaged();
  }
  const frame = new Frame(size, bytes.length);
  for (let last = false; !last; ) {
    const block = number(3);
    last = (block & 1) !== 0;
    const type = (block >>> 1) & 3, count = block >>> 3;
    if (type === 3) damaged();
    if (type === 1) frame.fill(number(1), count);
    else {
      if (at + count > bytes.length) damaged();
      const content = bytes.subarray(at, at + count);
      if (type === 0) frame.copy(content);
      else frame.unpack(content);
      at += count;
    }
  }
  const out = frame.finish();
  if ((head & 4) !== 0 && number(4) !== checksum(out)) damaged();
  if (at !== bytes.length) damaged();
  return out;
}

/** The `size` bytes that were packed into a frame; undefined if it isn't whole. */
export function unpack(bytes, size) {
  try {
    return unpack_frame(bytes, size);
  } catch (error) {
    if (error instanceof Damaged) return undefined;
    throw error;
  }
}
