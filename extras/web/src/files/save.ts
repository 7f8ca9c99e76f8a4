// What the page writes: in the formats of `jostle pairs`.

/** Boxes as a NumPy array of shape (n, 2, dim). */
export function arrayOf(numbers: Float32Array | Float64Array, dim: number): Blob {
  const type = numbers instanceof Float32Array ? "<f4" : "<f8";
  const shape = `(${numbers.length / (2 * dim)}, 2, ${dim})`;
  const header = `{'descr': '${type}', 'fortran_order': False, 'shape': ${shape}, }`.padEnd(117) + "\n";
  const magic = Uint8Array.of(0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59, 1, 0, header.length, 0); // version 1
  return new Blob([magic, header, numbers.slice()]); // 128 bytes, and the numbers
}

/** Pairs as a table; boxes are called by the ids of their file or, without, by their numbers. */
export function tableOf(pairs: Uint32Array, ids: readonly string[] | undefined): Blob {
  const names = ids?.map((id) => (/[",\r\n]|^[ \t]|[ \t]$/.test(id) ? `"${id.replaceAll('"', '""')}"` : id));
  const name = (box: number): string => names?.[box] ?? String(box);
  const parts = ["a,b\n"];
  const perPart = 20_000; // a string can't hold them all
  for (let from = 0; from < pairs.length; from += perPart) {
    let part = "";
    const to = Math.min(from + perPart, pairs.length);
    for (let i = from; i < to; i += 2) part += `${name(pairs[i]!)},${name(pairs[i + 1]!)}\n`;
    parts.push(part);
  }
  return new Blob(parts, { type: "text/csv" });
}
