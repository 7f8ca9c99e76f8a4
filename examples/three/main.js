// 20,000 boxes that drift, in one InstancedMesh; those that touch another are red.
import { load } from "jostle";
import * as THREE from "three";

const jostle = await load({ only: "pairs" });
const count = 20_000, space = 60;
const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(60, innerWidth / innerHeight, 0.1, 500);
camera.position.z = 1.3 * space;
scene.add(new THREE.HemisphereLight(0xffffff, 0x334455, 3));
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);

const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(), new THREE.MeshLambertMaterial(), count);
const alone = new THREE.Color(0x4477aa), touching = new THREE.Color(0xee3322), matrix = new THREE.Matrix4();
for (let i = 0; i < count; ++i) mesh.setColorAt(i, alone); // makes instanceColor
scene.add(mesh);

const random = (length, size) => Float32Array.from({ length }, () => size * (Math.random() - 0.5));
const at = random(3 * count, space), speed = random(3 * count, 4);
const half = random(3 * count, 0.6).map((x) => 0.2 + Math.abs(x));
const boxes = jostle.array("float32", 6 * count); // in the module's memory: read in place
const finder = new jostle.PairFinder();

let before = performance.now();
function frame(now) {
  const seconds = Math.min(now - before, 50) / 1000, bounds = boxes.view;
  before = now;
  for (let k = 0; k < 3 * count; ++k) {
    at[k] += seconds * speed[k];
    if (Math.abs(at[k]) > space / 2) speed[k] = -Math.sign(at[k]) * Math.abs(speed[k]);
    const i = Math.floor(k / 3), d = k % 3;
    bounds[6 * i + d] = at[k] - half[k];
    bounds[6 * i + 3 + d] = at[k] + half[k];
  }
  const pairs = finder.find(boxes, { dim: 3 }); // a0, b0, a1, b1, ...

  for (let i = 0; i < count; ++i) {
    const [x, y, z] = half.subarray(3 * i, 3 * i + 3);
    mesh.setMatrixAt(i, matrix.makeScale(2 * x, 2 * y, 2 * z).setPosition(...at.subarray(3 * i, 3 * i + 3)));
    mesh.setColorAt(i, alone);
  }
  for (const i of pairs) mesh.setColorAt(i, touching);
  mesh.instanceMatrix.needsUpdate = mesh.instanceColor.needsUpdate = true;
  renderer.render(scene, camera);
  document.title = `${pairs.length / 2} pairs in ${finder.stats.msTotal.toFixed(2)} ms`;
}
renderer.setAnimationLoop(frame);
