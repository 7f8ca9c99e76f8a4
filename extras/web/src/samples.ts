// Three tables of boxes to try, as they come from other programs.
import { randomNumbers } from "./sizes";

/** Pipes and brackets in a frame, some of which were put where others are. */
function assembly(): string {
  const random = randomNumbers(1);
  const rows = ["id,lo_x,lo_y,lo_z,hi_x,hi_y,hi_z"];
  const add = (name: string, lo: number[], size: number[]): void =>
    void rows.push([name, ...lo, ...lo.map((from, k) => from + size[k]!)].map(String).join(","));
  for (let k = 0; k < 12; ++k) add(`post ${k + 1}`, [(k % 4) * 400, 0, (k >> 2) * 400], [20, 900, 20]);
  for (let k = 0; k < 60; ++k) {
    const size = [30, 30, 30];
    size[k % 3] = 300 + Math.floor(700 * random());
    add(
      `pipe ${k + 1}`,
      size.map((edge, axis) => Math.floor(random() * ([1220, 900, 820][axis]! - edge))),
      size,
    );
  }
  for (let k = 0; k < 240; ++k)
    add(
      `bolt ${k + 1}`,
      [1200, 880, 800].map((most) => Math.floor(most * random())),
      [14, 14, 24],
    );
  return rows.join("\n");
}

/** Rows of cells in a plane, and wires across them, with corners and sizes. */
function chip(): string {
  const random = randomNumbers(2);
  const rows = ["id,x,y,w,h"];
  for (let row = 0; row < 40; ++row)
    for (let x = 0, k = 0; x < 900; ++k) {
      const w = 4 + Math.floor(16 * random());
      if (random() < 0.8) rows.push(`cell ${row}.${k},${x},${row * 22},${w},12`);
      x += w + 2 + Math.floor(9 * random());
    }
  for (let k = 0; k < 120; ++k)
    rows.push(
      `wire ${k},${[900, 500].map((most) => Math.floor(most * random()))},2,${Math.floor(360 * random())}`,
    );
  return rows.join("\n");
}

/** People on a square, denser towards its middle: nobody has a name, columns are called as GeoPandas does. */
function crowd(): string {
  const random = randomNumbers(3);
  const rows = ["minx,miny,maxx,maxy"];
  for (let k = 0; k < 3000; ++k) {
    const [angle, far] = [2 * Math.PI * random(), 50 * Math.sqrt(random()) * (0.4 + 0.6 * random())];
    const [x, y] = [far * Math.cos(angle), far * Math.sin(angle)].map((place) => place.toFixed(2));
    rows.push(`${x},${y},${(Number(x) + 0.55).toFixed(2)},${(Number(y) + 0.55).toFixed(2)}`);
  }
  return rows.join("\n");
}

export const samples: Record<string, { file: string; table: () => string }> = {
  "an assembly": { file: "assembly.csv", table: assembly },
  "a chip layout": { file: "chip.csv", table: chip },
  "a crowd": { file: "crowd.csv", table: crowd },
};
