// The boxes of the page in somebody's own program.
import { grouped } from "./numbers";

/** What a snippet tells: how it gets the boxes, and what it should find. */
export interface Told {
  count: number;
  dim: 2 | 3;
  double: boolean;
  pairs: number;
  checksum: string;
  /** The seeded scene that they are, if they are one. */
  seeded: { scene: string; n: number; seed: number; frame: number } | undefined;
}

const cpp = ({ count, dim, double }: Told): string => `#include <jostle/jostle.hpp>

#include <cstdio>
#include <fstream>
#include <vector>

int main()
{
    std::vector<jostle::Aabb${dim}${double ? "d" : "f"}> boxes(${count});
    std::ifstream file("boxes.npy", std::ios::binary);
    file.seekg(128); // the array's header
    file.read(reinterpret_cast<char*>(boxes.data()), boxes.size() * sizeof boxes[0]);

    jostle::PairFinder finder;
    const jostle::PairBuffer& pairs = finder.find(boxes);
    std::printf("%llu pairs, checksum %016llx\\n", (unsigned long long)pairs.size(),
                (unsigned long long)jostle::pair_checksum(pairs));
}
`;

const python = (): string => `import numpy as np
import jostle

def checksum(pairs):  # of the pairs in any order, as the page tells it
    z = (pairs[:, 0].astype(np.uint64) << 32 | pairs[:, 1]) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ z >> 30) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ z >> 27) * np.uint64(0x94D049BB133111EB)
    return int((z ^ z >> 31).sum(dtype=np.uint64))

boxes = np.load("boxes.npy")
pairs = jostle.find_pairs(boxes)
print(f"{len(pairs)} pairs, checksum {checksum(pairs):016x}")
`;

function javascript({ dim, seeded }: Told): string {
  const steps = seeded?.frame ? `for (let k = 0; k < ${seeded.frame}; ++k) scene.step();\n` : "";
  const [first, boxes] = seeded
    ? [
        "// The same boxes from the same seed.\n" +
          `const scene = jostle.scene("${seeded.scene}", ${seeded.n}, ${seeded.seed});\n${steps}`,
        "scene.boxes",
      ]
    : [
        'const bytes = await (await fetch("boxes.npy")).arrayBuffer();\n' +
          'const { boxes } = readBoxes(bytes, "boxes.npy");\n',
        "boxes",
      ];
  return `import { load${seeded ? "" : ", readBoxes"} } from "jostle";

const jostle = await load();
${first}const finder = new jostle.PairFinder();
const pairs = finder.find(${boxes}, { dim: ${dim} });
console.log(\`\${pairs.length / 2} pairs, checksum \${finder.checksum}\`);
`;
}

function command({ seeded }: Told): string {
  // A bench reports its third frame.
  const scene =
    seeded?.frame === 3
      ? `jostle bench ${seeded.scene} -n ${seeded.n} --seed ${seeded.seed} --frames 1   # from the seed\n`
      : "";
  return `jostle pairs boxes.npy --stats\n${scene}`;
}

export const languages: Record<string, (told: Told) => string> = {
  "C++": cpp,
  Python: python,
  JavaScript: javascript,
  "Command line": command,
};

export function note({ count, pairs, checksum }: Told): string {
  return (
    `${grouped(count)} boxes, ${grouped(pairs)} pairs, checksum ${checksum}: ` +
    "this finds the same on any machine, on any number of threads."
  );
}
