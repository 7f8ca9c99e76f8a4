// Numbers as people read them.

export function grouped(value: number): string {
  return Math.round(value).toLocaleString("en-US");
}

/** Three digits that count. */
export function milliseconds(ms: number): string {
  return ms >= 100 ? grouped(ms) : ms >= 10 ? ms.toFixed(1) : ms.toFixed(2);
}

/** As long as people would say it takes: 0.40 ms, 1.8 s, 4 min, 2.5 h. */
export function duration(ms: number): string {
  if (ms < 1000) return `${milliseconds(ms)} ms`;
  for (const [length, name] of [[3.6e6, "h"], [60_000, "min"], [1000, "s"]] as const)
    if (ms >= 2 * length || length === 1000) return `${Number((ms / length).toPrecision(2))} ${name}`;
  return "";
}

/** 12.5 billion, 199.99 million, 4,950. */
export function inWords(value: number): string {
  for (const [size, name] of [[1e12, "trillion"], [1e9, "billion"], [1e6, "million"]] as const)
    if (value >= size) return `${Number((value / size).toPrecision(3))} ${name}`;
  return grouped(value);
}

const steps = [1, 1.5, 2, 3, 4, 5, 6, 8];

/** The round number at a place of a slider from `least` to `most`, evenly in the logarithm. */
export function roundAt(part: number, least: number, most: number): number {
  const wanted = least * (most / least) ** part;
  const power = 10 ** Math.floor(Math.log10(wanted) + 1e-9);
  const all = [...steps.map((step) => step * power), 10 * power].filter((value) => value <= most);
  return all.reduce((best, value) =>
    Math.abs(Math.log(value / wanted)) < Math.abs(Math.log(best / wanted)) ? value : best,
  );
}

/** Where a number stands on such a slider, from 0 to 1. */
export function partOf(value: number, least: number, most: number): number {
  return Math.min(1, Math.max(0, Math.log(value / least) / Math.log(most / least)));
}
