// SPDX-License-Identifier: MIT
// jostle/rbush and jostle/flatbush beside rbush and flatbush, in one run of node, in turn: the median of the
// rounds' processor times.
//
//     extras/js/build build/package && cd extras/js/bench && npm install
//     npm install --no-save ../../../build/package && node bush.js [rectangles]
import PeerFlatbush from "flatbush";
import PeerRBush from "rbush";
import { cpus } from "node:os";

import { Flatbush } from "jostle/flatbush";
import { RBush } from "jostle/rbush";

const ROUNDS = 9;
const count = Number(process.argv[2] ?? 100_000);

// As rbush's own benchmark has them: on average a hundredth of a percent of the area.
const side = 100,
  edge = 2;
const random_box = (edges) => {
  const minX = side * Math.random(),
    minY = side * Math.random();
  return { minX, minY, maxX: minX + edges * Math.random(), maxY: minY + edges * Math.random() };
};
const items = Array.from({ length: count }, () => random_box(edge));
const questions = (edges) => Array.from({ length: 10_000 }, () => random_box(edges));
const [small, large] = [questions(0.5), questions(10).slice(0, 1000)];
const shuffled = [...items.keys()].sort(() => Math.random() - 0.5);

const sides = { jostle: [RBush, Flatbush], peer: [PeerRBush, PeerFlatbush] };
const times = {};
let sum = 0; // so that nothing is left out
function timed(what, who, work) {
  const before = process.cpuUsage();
  const made = work();
  const { user, system } = process.cpuUsage(before);
  ((times[what] ??= {})[who] ??= []).push((user + system) / 1000);
  return made;
}

for (let round = 0; round < ROUNDS; ++round)
  for (const [who, [Tree, Index]] of Object.entries(sides)) {
    // A search of nothing, so that what is put off is in the time.
    const tree = timed("rbush: load", who, () => {
      const made = new Tree().load(items);
      made.collides({ minX: 0, minY: 0, maxX: 0, maxY: 0 });
      return made;
    });
    timed("rbush: 10,000 small searches", who, () =>
      small.forEach((box) => (sum += tree.search(box).length)),
    );
    timed("rbush: 1,000 large searches", who, () => large.forEach((box) => (sum += tree.search(box).length)));
    timed("rbush: 10,000 collides", who, () => small.forEach((box) => (sum += tree.collides(box) ? 1 : 0)));
    const moved = () => {
      for (let k = 0; k < 10_000; ++k) {
        const item = items[shuffled[k]];
        if (who === "peer") tree.remove(item);
        item.minX += 0.01;
        item.maxX += 0.01;
        if (who === "peer") tree.insert(item);
        else tree.update(item);
        if (k % 100 === 0) sum += tree.search(small[k]).length; // a hundred moves between questions
      }
    };
    timed("rbush: 10,000 moves, 100 searches between", who, moved);
    timed("rbush: 1,000 moves, each with a search", who, () => {
      for (let k = 0; k < 1000; ++k) {
        const item = items[shuffled[k]];
        if (who === "peer") tree.remove(item).insert(item);
        else tree.update(item);
        sum += tree.search(small[k]).length;
      }
    });
    timed("rbush: insert one by one", who, () => {
      const made = new Tree();
      for (const item of items) made.insert(item);
      sum += made.search(small[0]).length;
    });
    timed("rbush: remove 10,000", who, () => {
      for (let k = 0; k < 10_000; ++k) tree.remove(items[shuffled[k]]);
      sum += tree.search(small[0]).length;
    });

    const index = timed("flatbush: add, finish", who, () => {
      const made = new Index(count);
      for (const { minX, minY, maxX, maxY } of items) made.add(minX, minY, maxX, maxY);
      made.finish();
      return made;
    });
    const search = ({ minX, minY, maxX, maxY }) => (sum += index.search(minX, minY, maxX, maxY).length);
    timed("flatbush: 10,000 small searches", who, () => small.forEach(search));
    timed("flatbush: 1,000 large searches", who, () => large.forEach(search));
    timed("flatbush: 10,000 nearest", who, () =>
      small.forEach((box) => (sum += index.neighbors(box.minX, box.minY, 1)[0])),
    );
    timed("flatbush: 1,000 of 100 nearest", who, () =>
      large.forEach((box) => (sum += index.neighbors(box.minX, box.minY, 100)[0])),
    );
    tree.dispose?.();
    index.dispose?.();
  }

const median = (all) => all.toSorted((a, b) => a - b)[all.length >> 1];
console.log(`node ${process.version}, ${cpus()[0].model}, ${count} rectangles (${sum})\n`);
console.log("| what | jostle, ms | the package, ms | times |\n|---|---|---|---|");
for (const [what, { jostle, peer }] of Object.entries(times)) {
  const numbers = [median(jostle), median(peer), median(peer) / median(jostle)].map((x) => x.toFixed(1));
  console.log(`| ${[what, ...numbers].join(" | ")} |`);
}
