// Draws boxes, pairs and bricks. It knows nothing of the engine.
import {
  Box3,
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CircleGeometry,
  Color,
  DataTexture,
  FloatType,
  Float32BufferAttribute,
  GLSL3,
  IcosahedronGeometry,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  InstancedInterleavedBuffer,
  InterleavedBufferAttribute,
  LineSegments,
  Mesh,
  NearestFilter,
  OctahedronGeometry,
  PerspectiveCamera,
  Plane,
  RawShaderMaterial,
  Raycaster,
  type Ray,
  RGFormat,
  RGIntegerFormat,
  Scene,
  Sphere,
  SphereGeometry,
  Vector2,
  Vector3,
  Vector4,
  UnsignedIntType,
  WebGLRenderer,
  type IUniform,
  type PixelFormat,
  type TextureDataType,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import {
  bodiesPerRow,
  boxesPerRow,
  clothSize,
  contactsPerRow,
  pairsPerRow,
  type Bodies,
  type BrickList,
  type Cloth,
  type Frame,
  type Inside,
} from "./messages";
import * as shaders from "./shaders";

/**
 * The three faces of each of some boxes that look at the camera: 4 corners and 2 triangles a face. See
 * shaders.ts.
 */
function faces(boxes: number): InstancedBufferGeometry {
  const corners: number[] = [];
  const axes: number[] = [];
  const triangles: number[] = [];
  for (let number = 0; number < 3 * boxes; ++number) {
    const face = number % 3;
    for (const [u, v] of [[0, 0], [1, 0], [1, 1], [0, 1]] as const) {
      const corner = [0, 0, 0];
      corner[face] = 1;
      corner[(face + 1) % 3] = u;
      corner[(face + 2) % 3] = v;
      corners.push(...corner);
      axes.push(face);
    }
    triangles.push(...[0, 1, 2, 0, 2, 3].map((corner) => 4 * number + corner));
  }
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(corners, 3));
  geometry.setAttribute("face", new Float32BufferAttribute(axes, 1));
  geometry.setIndex(triangles);
  geometry.instanceCount = 0;
  return geometry;
}

/** Has a texture with two numbers a texel show `numbers`, which fill whole rows. */
function upload(
  uniform: IUniform<DataTexture | null>,
  numbers: Float32Array<ArrayBuffer> | Uint32Array<ArrayBuffer>,
  width: number,
  format: PixelFormat,
  type: TextureDataType,
): void {
  const rows = numbers.length / (2 * width);
  let texture = uniform.value;
  if (texture?.image.height !== rows) {
    texture?.dispose();
    texture = uniform.value = new DataTexture(numbers, width, rows, format, type);
    texture.minFilter = texture.magFilter = NearestFilter;
    texture.generateMipmaps = false;
  }
  texture.image.data = numbers;
  texture.needsUpdate = true;
}

/** The twelve edges of a box. */
function edges(): InstancedBufferGeometry {
  const ends: number[] = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const [u, v] of [[0, 0], [1, 0], [0, 1], [1, 1]] as const)
      for (const along of [0, 1]) {
        const end = [0, 0, 0];
        end[axis] = along;
        end[(axis + 1) % 3] = u;
        end[(axis + 2) % 3] = v;
        ends.push(...end);
      }
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(ends, 3));
  geometry.instanceCount = 0;
  return geometry;
}

/** A shape of size 1, for as many bodies as there are. */
function solid(shape: BufferGeometry, kind: number): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  const { position, normal } = shape.attributes as {
    position: Float32BufferAttribute;
    normal: Float32BufferAttribute;
  };
  geometry.setAttribute("position", position);
  geometry.setAttribute("normal", normal);
  geometry.setAttribute("kind", new Float32BufferAttribute(new Float32Array(position.count).fill(kind), 1));
  geometry.setIndex(shape.index);
  geometry.instanceCount = 0;
  return geometry;
}

/** The ball and the floor of the cloth. */
function ground(): BufferGeometry[] {
  const shapes = [
    new SphereGeometry(clothSize.ball, 48, 32),
    new CircleGeometry(clothSize.side, 96).rotateX(-Math.PI / 2).translate(0, clothSize.floor - 0.01, 0),
  ];
  for (const shape of shapes) {
    const none = new Float32Array(shape.getAttribute("position").count).fill(-1);
    shape.setAttribute("nearness", new Float32BufferAttribute(none, 1));
  }
  return shapes;
}

/** A batch of needles: where they are thickest they are four pixels wide, a quarter of the way on. */
function needles(): InstancedBufferGeometry {
  const corners: number[] = [];
  const triangles: number[] = [];
  for (let k = 0; k < shaders.batch; ++k) {
    corners.push(0, 0, 0, 0.25, 2, 0, 1, 0, 0, 0.25, -2, 0);
    triangles.push(...[0, 1, 2, 0, 2, 3].map((corner) => 4 * k + corner));
  }
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(corners, 3));
  geometry.setIndex(triangles);
  geometry.instanceCount = 0;
  return geometry;
}

const palettes = {
  dark: {
    air: "#0b0e14",
    glass: "#5f8dff",
    shallow: "#ff4d3d",
    middle: "#ff9d2e",
    deep: "#fff0b8",
    one: "#4dffd2",
    partner: "#ffffff",
    few: "#3d6b8f",
    many: "#7df0ff",
    record: "#c9a2ff",
    solid: "#8394b8",
    contact: "#54ff9f",
  },
  light: {
    air: "#f4f5f7",
    glass: "#33507f",
    shallow: "#ff7a45",
    middle: "#f0431f",
    deep: "#a80f3a",
    one: "#00806a",
    partner: "#1f2a3d",
    few: "#9db4c9",
    many: "#005f8f",
    record: "#7a3fa8",
    solid: "#b9c4d6",
    contact: "#007a45",
  },
} as const;
export type Theme = keyof typeof palettes;

/** Whether a graphics card draws; without one the processor does, which is slow. */
function drawsFast(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && names ? String(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext(); // browsers allow few at a time
  return !/swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Pixels of the screen that are drawn for each of CSS: fewer where drawing is slow. */
const resolutions = [0.5, 0.75, 1, 1.5, 2];

export class View {
  /** Calls whoever wants to know which box was clicked, with the ray through the pixel. */
  onPick: (from: number[], direction: number[]) => void = () => {};
  onContext: (lost: boolean) => void = () => {};
  /** Tells where the glass box is that follows the pointer: lo and hi; undefined where there is none. */
  onProbe: (box: number[] | undefined) => void = () => {};
  /** Slowly goes round the scene. */
  turning = false;

  private readonly renderer: WebGLRenderer;
  private readonly camera = new PerspectiveCamera(38, 1, 0.1, 1000);
  private readonly controls: OrbitControls;
  private readonly scene = new Scene();
  private readonly uniforms: Record<string, IUniform> = {
    boxes: { value: null },
    boxCount: { value: 0 },
    pairs: { value: null },
    pairCount: { value: 0 },
    cut: { value: new Vector4(0, 0, 0, 1) },
    fog: { value: new Vector2(1, 2) },
    opacity: { value: 0.1 },
    poses: { value: null },
    contacts: { value: null },
    contactCount: { value: 0 },
    needle: { value: 1 },
    pixel: { value: new Vector2(1, 1) },
    chosen: { value: -1 },
    large: { value: 1 },
    probeLo: { value: new Vector3() },
    probeHi: { value: new Vector3() },
  };
  private readonly bodies: Mesh<InstancedBufferGeometry>;
  private readonly overlaps: Mesh<InstancedBufferGeometry>;
  private readonly chosen: Mesh<InstancedBufferGeometry>;
  private readonly probe: Mesh<InstancedBufferGeometry>;
  private readonly bricks: LineSegments<BufferGeometry>;
  private readonly solids: Mesh<InstancedBufferGeometry>[];
  private readonly cloth: Mesh<BufferGeometry>;
  /** What the cloth falls on. */
  private readonly ground: Mesh<BufferGeometry>[];
  private readonly needles: Mesh<InstancedBufferGeometry, RawShaderMaterial>;
  private readonly ball = new Sphere(new Vector3(), 1);
  private isFlat = false;
  /** The view is into a crowd, whose far side only blurs the near one. */
  private within = false;
  private dirty = true;
  private fence: WebGLSync | undefined;
  private drawnAt = 0;
  /** Whether the frame that was shown last has been drawn. */
  isShown = true;
  private resolution: number;
  private slow = 0;
  private brickCount = 0;

  constructor(private readonly canvas: HTMLCanvasElement) {
    const fast = drawsFast();
    this.renderer = new WebGLRenderer({ canvas, antialias: fast, powerPreference: "high-performance" });
    this.renderer.sortObjects = false;
    this.resolution = Math.max(1, Math.min(2, devicePixelRatio)) / (fast ? 1 : 2);
    this.bodies = new Mesh(faces(shaders.batch), this.material(shaders.bodies, true));
    this.overlaps = new Mesh(faces(shaders.batch), this.material(shaders.overlaps, false));
    this.chosen = new Mesh(faces(1), this.material(shaders.chosen, true));
    this.probe = new Mesh(faces(1), this.material(shaders.probe, true));
    this.bricks = new LineSegments<BufferGeometry>(edges(), this.material(shaders.bricks, true));
    const shapes = [new IcosahedronGeometry(1, 2), new BoxGeometry(2, 2, 2), new OctahedronGeometry(1)];
    shapes[0]!.setAttribute("normal", shapes[0]!.getAttribute("position")); // round
    this.solids = shapes.map(
      (shape, kind) => new Mesh(solid(shape, kind), this.material(shaders.solids, false)),
    );
    this.cloth = new Mesh(new BufferGeometry(), this.material(shaders.cloth, false));
    this.ground = ground().map((shape) => new Mesh(shape, this.material(shaders.cloth, false)));
    this.needles = new Mesh(needles(), this.material(shaders.needles, true));
    this.needles.material.depthTest = false;
    // What is solid comes first, so that glass before it can be drawn over it.
    for (const part of [
      this.overlaps,
      ...this.solids,
      ...this.ground,
      this.cloth,
      this.bodies,
      this.bricks,
      this.chosen,
      this.probe,
      this.needles,
    ]) {
      part.frustumCulled = false;
      this.scene.add(part);
    }
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.autoRotateSpeed = 0.6;
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.listen();
  }

  private material(shader: { vertex: string; fragment: string }, glass: boolean): RawShaderMaterial {
    return new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: shader.vertex,
      fragmentShader: shader.fragment,
      uniforms: this.uniforms,
      transparent: glass,
      depthWrite: !glass,
      side: 2,
    });
  }

  private listen(): void {
    const { canvas } = this;
    // three.js asks for the context back, and makes all that was in it anew.
    canvas.addEventListener("webglcontextlost", () => this.onContext(true));
    canvas.addEventListener("webglcontextrestored", () => {
      this.dirty = true;
      this.onContext(false);
    });
    let down: PointerEvent | undefined;
    canvas.addEventListener("pointerdown", (event) => {
      down = event;
      this.moveProbe(undefined);
    });
    canvas.addEventListener("pointerleave", () => this.moveProbe(undefined));
    canvas.addEventListener("pointermove", (event) => {
      if (event.pointerType === "mouse" && event.buttons === 0) this.moveProbe(this.inPicture(event));
    });
    canvas.addEventListener("pointerup", (event) => {
      if (down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 5) {
        const { x, y } = this.inPicture(event);
        this.pick(x, y);
      }
      down = undefined;
    });
    canvas.addEventListener("keydown", (event) => {
      const turns: Record<string, [number, number]> = {
        ArrowLeft: [-1, 0],
        ArrowRight: [1, 0],
        ArrowUp: [0, -1],
        ArrowDown: [0, 1],
      };
      const turn = turns[event.key];
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (turn) this.turn(turn[0] * 0.1, turn[1] * 0.1);
      else if (event.key === "+" || event.key === "=") this.zoom(0.9);
      else if (event.key === "-") this.zoom(1 / 0.9);
      else if (event.key === "Enter")
        this.pick(0, 0); // what lies in the middle
      else return;
      event.preventDefault();
    });
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  /** Where in the picture the pointer is: -1 to 1 from left to right, and from bottom to top. */
  private inPicture({ clientX, clientY }: PointerEvent): Vector2 {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return new Vector2(((clientX - left) / width) * 2 - 1, 1 - ((clientY - top) / height) * 2);
  }
  private through(point: Vector2): Ray {
    const caster = new Raycaster();
    caster.setFromCamera(point, this.camera);
    return caster.ray;
  }

  private pick(x: number, y: number): void {
    const { origin, direction } = this.through(new Vector2(x, y));
    this.onPick(origin.toArray(), direction.toArray());
  }

  /** Puts the glass box where the pointer is, some way into the crowd; takes it away without a point. */
  moveProbe(point: Vector2 | undefined): void {
    const was = this.probe.geometry.instanceCount;
    this.probe.geometry.instanceCount = 0;
    if (point !== undefined) {
      const { target } = this.controls;
      const { radius, center } = this.ball;
      const towards = this.camera.position.clone().sub(target).normalize();
      const plane = new Plane().setFromNormalAndCoplanarPoint(
        towards,
        center.clone().addScaledVector(towards, this.isFlat ? 0 : 0.45 * radius),
      );
      const middle = this.through(point).intersectPlane(plane, new Vector3());
      if (middle !== null && middle.distanceTo(center) < 1.1 * radius) {
        const half = new Vector3().setScalar(0.12 * radius);
        const { probeLo, probeHi } = this.uniforms;
        const lo = (probeLo!.value as Vector3).copy(middle).sub(half);
        const hi = (probeHi!.value as Vector3).copy(middle).add(half);
        this.probe.geometry.instanceCount = 1;
        this.dirty = true;
        return this.onProbe([...lo.toArray(), ...hi.toArray()]);
      }
    }
    if (was > 0) {
      this.dirty = true;
      this.onProbe(undefined);
    }
  }

  turn(around: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const flat = Math.hypot(offset.x, offset.z);
    const length = offset.length();
    const azimuth = Math.atan2(offset.x, offset.z) + around;
    const height = Math.min(Math.max(Math.atan2(offset.y, flat) - up, -1.5), 1.5);
    offset.set(Math.sin(azimuth) * Math.cos(height), Math.sin(height), Math.cos(azimuth) * Math.cos(height));
    this.camera.position.copy(this.controls.target).addScaledVector(offset, length);
    this.dirty = true;
  }

  zoom(factor: number): void {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.dirty = true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(this.resolution);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    (this.uniforms.pixel!.value as Vector2).set(2 / width, 2 / height);
    this.draw(performance.now()); // at once: a canvas of another size is empty
  }

  setTheme(theme: Theme): void {
    for (const [name, value] of Object.entries(palettes[theme]))
      // Colours are used as they are written.
      this.uniforms[name] = { value: new Color().setStyle(value).convertLinearToSRGB() };
    this.renderer.setClearColor(new Color().setStyle(palettes[theme].air), 1);
    this.dirty = true;
  }

  /** Looks at all of a new scene. */
  lookAt(frame: Frame): void {
    const bounds = new Box3(); // of the boxes' middles
    const all = new Box3(); // of what they fill
    const numbers = frame.boxes.subarray(0, 6 * frame.count);
    const least = new Vector3();
    const most = new Vector3();
    let area = 0;
    let depth = 0;
    for (let i = 0; i < numbers.length; i += 6) {
      least.fromArray(numbers, i);
      most.fromArray(numbers, i + 3);
      area += Math.max(0, (most.x - least.x) * (most.y - least.y)) || 0;
      depth = Math.max(depth, most.z - least.z);
      const finite = [...least, ...most].every(Number.isFinite);
      if (finite) all.expandByPoint(least).expandByPoint(most);
      const middle = least.add(most).multiplyScalar(0.5);
      if (finite) bounds.expandByPoint(middle);
    }
    if (bounds.isEmpty()) bounds.expandByPoint(new Vector3());
    depth += bounds.max.z - bounds.min.z;
    const edge = Math.sqrt(area / Math.max(frame.count, 1));
    this.uniforms.needle!.value = 0.6 * edge;
    bounds.expandByScalar(Number.isFinite(edge) ? Math.max(edge / 2, 1e-6) : 1);
    // Giants are framed, too, unless the others would be dots between them.
    const [inner, outer] = [bounds, all].map((box) => box.getSize(new Vector3()).length()) as [
      number,
      number,
    ];
    if (outer < 3 * inner) bounds.union(all);
    if (frame.bodies) bounds.expandByPoint(new Vector3(bounds.min.x, 0, bounds.min.z)); // they fall to here
    if (frame.cloth) {
      const { side, floor } = clothSize;
      const reach = 0.45 * side;
      bounds.set(new Vector3(-reach, floor - 0.3, -reach), new Vector3(reach, 1.2 * reach, reach));
    }
    bounds.getBoundingSphere(this.ball);
    this.uniforms.large!.value = 0.1 * this.ball.radius;
    const size = bounds.getSize(new Vector3());
    // So many boxes lie one behind another; together they should veil what is behind them, not hide it.
    const layers = area / Math.max(size.x * size.y, 1e-12);
    this.uniforms.opacity!.value = Math.min(0.4, Math.max(0.008, 0.4 / Math.max(layers, 1e-3)));

    const flat = depth < 0.01 * Math.max(size.x, size.y);
    this.isFlat = flat;
    const direction = flat ? new Vector3(0, 0, 1) : new Vector3(0.62, 0.42, 1).normalize();
    const { radius, center } = this.ball;
    const reach = Math.min(1, this.camera.aspect); // a narrow window wants more distance
    // What is turned leaves its corners empty; into a crowd one looks from near.
    this.within = !flat && frame.count > 5000 && !frame.bodies && !frame.cloth;
    const room = flat ? 1.05 : this.within ? 0.62 : frame.bodies || frame.cloth ? 0.75 : 0.92;
    const away = (room * radius) / Math.sin((this.camera.fov / 360) * Math.PI) / reach;
    // The scene stands above the figures, which lie over the lower part of the picture.
    this.controls.target.copy(center).setY(center.y - 0.1 * radius);
    this.camera.position.copy(this.controls.target).addScaledVector(direction, away);
    this.camera.near = radius / 500;
    this.camera.far = radius * 40;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.dirty = true;
  }

  /** Shows a frame; its buffers belong to the view until the next one. */
  show(frame: Frame): void {
    const { uniforms } = this;
    upload(uniforms.boxes!, frame.boxes, 3 * boxesPerRow, RGFormat, FloatType);
    upload(uniforms.pairs!, frame.pairs, pairsPerRow, RGIntegerFormat, UnsignedIntType);
    uniforms.boxCount!.value = frame.count;
    uniforms.pairCount!.value = frame.drawnPairs;
    this.bodies.geometry.instanceCount = frame.cloth ? 0 : Math.ceil(frame.count / shaders.batch);
    // What boxes have in common would hide where the bodies in them touch.
    this.overlaps.geometry.instanceCount =
      frame.bodies || frame.cloth ? 0 : Math.ceil(frame.drawnPairs / shaders.batch);
    this.showBodies(frame.bodies, frame.count);
    this.showCloth(frame.cloth);
    this.dirty = true;
    this.isShown = false;
  }

  private showBodies(bodies: Bodies | undefined, count: number): void {
    for (const { geometry } of this.solids) geometry.instanceCount = bodies ? count : 0;
    this.needles.geometry.instanceCount = Math.ceil((bodies?.contactCount ?? 0) / shaders.batch);
    this.uniforms.contactCount!.value = bodies?.contactCount ?? 0;
    if (!bodies) return;
    upload(this.uniforms.poses!, bodies.poses, 5 * bodiesPerRow, RGFormat, FloatType);
    upload(this.uniforms.contacts!, bodies.contacts, 4 * contactsPerRow, RGFormat, FloatType);
  }

  private showCloth(cloth: Cloth | undefined): void {
    for (const part of [this.cloth, ...this.ground]) part.visible = cloth !== undefined;
    if (!cloth) return;
    const { geometry } = this.cloth;
    if (geometry.getAttribute("nearness")?.count !== cloth.nearness.length) {
      geometry.dispose();
      geometry.setIndex(new BufferAttribute(cloth.triangles, 1));
      geometry.setAttribute("position", new BufferAttribute(cloth.positions, 3));
      geometry.setAttribute("nearness", new BufferAttribute(cloth.nearness, 1));
      geometry.deleteAttribute("normal");
    }
    for (const [name, numbers] of [["position", cloth.positions], ["nearness", cloth.nearness]] as const) {
      const attribute = geometry.getAttribute(name) as BufferAttribute;
      attribute.array.set(numbers);
      attribute.needsUpdate = true;
    }
    geometry.computeVertexNormals();
  }

  /** Shows bricks, those in `bright` brightly, and the records in one of them; none if there is no list. */
  showBricks(list: BrickList | undefined, bright: readonly number[] = [], inside?: Inside): void {
    const geometry = this.bricks.geometry as InstancedBufferGeometry;
    geometry.dispose();
    this.brickCount = list?.records.length ?? 0;
    geometry.instanceCount = this.brickCount + (inside?.records.length ?? 0);
    if (list) {
      const corners = new Float32Array(6 * geometry.instanceCount);
      corners.set(list.bounds);
      if (inside) corners.set(inside.bounds, list.bounds.length);
      const bounds = new InstancedInterleavedBuffer(corners, 6);
      geometry.setAttribute("lo", new InterleavedBufferAttribute(bounds, 3, 0));
      geometry.setAttribute("hi", new InterleavedBufferAttribute(bounds, 3, 3));
      const most = list.records.reduce((a, b) => Math.max(a, b), 1);
      const shares = new Float32Array(geometry.instanceCount);
      shares.set(Float32Array.from(list.records, (records) => records / most));
      for (const brick of bright) shares[brick] = 2;
      if (inside) {
        const { own, end } = inside;
        shares.fill(3, this.brickCount).fill(4, this.brickCount + own, this.brickCount + end);
        shares[this.brickCount + own] = 5;
      }
      geometry.setAttribute("share", new InstancedBufferAttribute(shares, 1));
    }
    this.dirty = true;
  }

  /** Shows one box and others that touch it; none without. */
  choose(boxes: readonly number[]): void {
    this.light(boxes, boxes[0] ?? -1);
  }
  /** Shows the boxes that the glass box touches. */
  touch(boxes: readonly number[]): void {
    this.light(boxes, -1);
  }
  private light(boxes: readonly number[], chosen: number): void {
    const geometry = this.chosen.geometry;
    geometry.dispose();
    geometry.instanceCount = boxes.length;
    if (boxes.length > 0)
      geometry.setAttribute("box", new InstancedBufferAttribute(Uint32Array.from(boxes), 1));
    this.uniforms.chosen!.value = chosen;
    this.dirty = true;
  }

  /** Hides what lies beyond a plane across an axis, at a part of the scene's extent; nothing at 1. */
  cutAt(axis: number, part: number): void {
    const cut = this.uniforms.cut!.value as Vector4;
    const { center, radius } = this.ball;
    if (part >= 1) cut.set(0, 0, 0, 1);
    else {
      cut.set(0, 0, 0, center.getComponent(axis) + (2 * part - 1) * radius * 0.62);
      cut.setComponent(axis, 1);
    }
    this.dirty = true;
  }

  /** Draws if anything has changed. To be called once for each refresh of the screen. */
  refresh(now: number): void {
    this.controls.autoRotate = this.turning;
    if (this.controls.update()) this.dirty = true;
    if (this.dirty && !this.isDrawing(now)) this.draw(now);
  }

  /** Whether what was drawn last isn't on the screen yet: more would only queue up behind it. */
  private isDrawing(now: number): boolean {
    if (this.fence === undefined) return false;
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    if (gl.clientWaitSync(this.fence, 0, 0) === gl.TIMEOUT_EXPIRED) return true;
    gl.deleteSync(this.fence);
    this.fence = undefined;
    this.adapt(now - this.drawnAt);
    return false;
  }

  /** Draws fewer pixels where drawing is slow. */
  private adapt(elapsed: number): void {
    this.slow = elapsed > 40 ? this.slow + 1 : Math.max(0, this.slow - 1);
    const at = resolutions.findIndex((resolution) => resolution >= this.resolution);
    if (this.slow < 8 || at === 0) return;
    this.resolution = resolutions[at - 1]!;
    this.slow = 0;
    this.resize();
  }

  private draw(now: number): void {
    this.dirty = false;
    this.isShown = true;
    const { radius } = this.ball;
    const away = this.camera.position.distanceTo(this.controls.target);
    (this.uniforms.fog!.value as Vector2).set(away - radius * 0.9, away + radius * (this.within ? 0.5 : 1.1));
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0) ?? undefined;
    gl.flush();
    this.drawnAt = now;
  }

  /**
   * What is drawn, for tests and for pictures: the numbers of boxes and pairs, and pixels for each of CSS.
   */
  get drawn(): Record<
    | "boxes"
    | "pairs"
    | "bricks"
    | "records"
    | "bodies"
    | "contacts"
    | "triangles"
    | "chosen"
    | "probes"
    | "resolution",
    number
  > {
    const { instanceCount } = this.bricks.geometry as InstancedBufferGeometry;
    return {
      boxes: this.uniforms.boxCount!.value as number,
      pairs: this.uniforms.pairCount!.value as number,
      bricks: this.brickCount,
      records: instanceCount - this.brickCount,
      bodies: this.solids[0]!.geometry.instanceCount,
      contacts: this.uniforms.contactCount!.value as number,
      triangles: this.cloth.visible ? (this.cloth.geometry.index?.count ?? 0) / 3 : 0,
      chosen: this.chosen.geometry.instanceCount,
      probes: this.probe.geometry.instanceCount,
      resolution: this.resolution,
    };
  }
}
