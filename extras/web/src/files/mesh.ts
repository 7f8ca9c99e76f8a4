// One box around each triangle of a mesh, read by three.js's loaders.
import { Mesh, Vector3, type Object3D } from "three";

import type { BoxFile } from "jostle";

async function load(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<Object3D> {
  if (/\.obj$/i.test(name)) {
    const { OBJLoader } = await import("three/addons/loaders/OBJLoader.js");
    return new OBJLoader().parse(new TextDecoder().decode(bytes));
  }
  const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
  return (await new GLTFLoader().parseAsync(bytes.buffer, "")).scene;
}

export async function readMesh(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<BoxFile> {
  let scene: Object3D;
  try {
    scene = await load(bytes, name);
  } catch (error) {
    throw new Error(
      `${name}: isn't a mesh that can be read: ${error instanceof Error ? error.message : error}`,
    );
  }
  scene.updateMatrixWorld(true);
  const numbers: number[] = [];
  const corner = new Vector3();
  scene.traverse((part) => {
    if (!(part instanceof Mesh)) return;
    const { index, attributes } = part.geometry;
    const positions = attributes.position;
    if (positions === undefined) return;
    const corners = index === null ? positions.count : index.count;
    for (let first = 0; first + 3 <= corners; first += 3) {
      const lo = [Infinity, Infinity, Infinity];
      const hi = [-Infinity, -Infinity, -Infinity];
      for (let i = first; i < first + 3; ++i) {
        corner
          .fromBufferAttribute(positions, index === null ? i : index.getX(i))
          .applyMatrix4(part.matrixWorld);
        corner.toArray().forEach((value, axis) => {
          lo[axis] = Math.min(lo[axis]!, value);
          hi[axis] = Math.max(hi[axis]!, value);
        });
      }
      numbers.push(...lo, ...hi); // six at a time
    }
  });
  if (numbers.length === 0) throw new Error(`${name}: has no triangles`);
  const boxes = Float32Array.from(numbers);
  return { dim: 3, frames: 1, boxes, ids: undefined, frame: () => boxes };
}
