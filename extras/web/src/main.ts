// The page: controls, the address, and the turn of frames between engine and view.
import * as Comlink from "comlink";

import type { Engine } from "./engine.worker";
import { clothScene, type Buffers, type Frame, type Loaded, type SceneName } from "./messages";
import { grouped, milliseconds, partOf, roundAt } from "./numbers";
import { element, Figures, Race, raceEngines, showPath } from "./panel";
import { samples } from "./samples";
import { languages, note, type Told } from "./snippets";
import { besidePage, formatState, isSimulated, limits, most, parseState, type State } from "./state";
import { View, type Theme } from "./view";

/** Where documentation and source are, if whoever built the page has said so: see extras/web/build. */
const links = { docs: import.meta.env.VITE_DOCS, source: import.meta.env.VITE_SOURCE } as Record<
  string,
  string
>;
/** So long after a scene has begun, brute force is tried on it. */
const raceAfter = 1500;

const status = (text: string): void => void (element("status").textContent = text);

function message(text: string): void {
  element("message").textContent = text;
  element("message").hidden = text === "";
}

/** What was found in a frame. */
function found({ cloth, pairCount }: Frame): string {
  return cloth
    ? `${grouped(cloth.near)} pairs are near each other, and there are ${grouped(cloth.crossings)} crossings.`
    : `${grouped(pairCount)} pairs touch.`;
}

function words(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

class Page {
  private readonly engine: Comlink.Remote<Engine>;
  private readonly view: View | undefined;
  private readonly figures = new Figures();
  private state!: State;
  private loaded!: Loaded;
  private frame: Frame | undefined;
  /** The name of what is shown in place of the scene: a file, or a program that is running. */
  private file: string | undefined;
  private spare: Buffers = { boxes: new Float32Array(0), pairs: new Uint32Array(0) };
  /** What the engine is asked is done one after another. */
  private turn: Promise<unknown> = Promise.resolve();
  private stepping = false;
  private stepped = 0;
  private chosen: number | undefined;
  private showsBricks = false;
  private showsBodies = true;
  private explained = 0;
  /** The visitor's box, and whether the engine is asked about it. */
  private probe: number[] | undefined;
  private probing = false;
  private racing = 0;
  private theme: Theme;
  private readonly stillness = matchMedia("(prefers-reduced-motion: reduce)");

  constructor() {
    const worker = new Worker(new URL("./engine.worker.ts", import.meta.url), {
      type: "module",
      name: "engine",
    });
    worker.addEventListener("error", (event) => {
      const why = event.message || "its files are missing";
      message(`The engine couldn't be started: ${why}. Reload the page to try again.`);
    });
    this.engine = Comlink.wrap<Engine>(worker);
    this.view = this.makeView();
    this.theme = matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
    this.applyTheme();
  }

  private makeView(): View | undefined {
    try {
      const view = new View(element<HTMLCanvasElement>("canvas"));
      view.onPick = (from, direction) => void this.pick(from, direction);
      view.onProbe = (box) => {
        this.probe = box;
        void this.touch();
      };
      view.onContext = (lost) =>
        message(
          lost
            ? "The graphics card was taken away from this page. The engine goes on; " +
                "the picture comes back by itself."
            : "",
        );
      return view;
    } catch {
      message(
        "This browser doesn't draw with WebGL 2. The engine runs all the same; only the picture is missing.",
      );
      return undefined;
    }
  }

  async start(): Promise<void> {
    // Whatever the address says of threads, the first module is loaded with them.
    this.state = parseState(location.hash, []);
    this.loaded = await this.engine.load(this.state.threads);
    this.state = this.read();
    if (this.stillness.matches) this.state.paused = true;
    this.fillControls();
    this.listen();
    await this.engine.showBodies(this.showsBodies);
    await this.open();
    if (this.stillness.matches)
      status("Paused, because your system asks for less motion. Press Play to see it move.");
    requestAnimationFrame((now) => this.tick(now));
  }

  private read(): State {
    return parseState(
      location.hash,
      this.loaded.scenes.map(({ name }) => name),
    );
  }

  /** Runs `work` when the engine has done what it was asked before. */
  private inTurn<Result>(work: () => Promise<Result>): Promise<Result> {
    const result = this.turn.then(work);
    this.turn = result.catch(() => {});
    return result;
  }

  // --- Frames -------------------------------------------------------------------------------------------

  /** Shows what the state says. */
  private async open(): Promise<void> {
    message("");
    const { file, live, frame } = this.state;
    if (file === undefined && live === undefined) return this.openScene();
    try {
      if (live !== undefined) {
        const opened = await this.inTurn(() => this.engine.openLive(besidePage(live)));
        this.file = opened.title;
        this.begin(opened.frame);
      } else if (file !== undefined) {
        const name = file.split("/").pop()!;
        status(`Reading ${name}.`);
        const response = await fetch(besidePage(file));
        if (!response.ok) throw new Error(`${name}: this page's server has no such file.`);
        await this.openBytes(new Uint8Array(await response.arrayBuffer()), name);
        if (frame > 0) this.show(await this.inTurn(() => this.engine.go(frame)));
      }
    } catch (error) {
      this.state.file = this.state.live = undefined;
      if (this.frame === undefined) await this.openScene();
      message(words(error));
    }
  }

  private async openBytes(bytes: Uint8Array<ArrayBuffer>, name: string): Promise<void> {
    const frame = await this.inTurn(() =>
      this.engine.openFile(Comlink.transfer(bytes, [bytes.buffer]), name),
    );
    this.file = name;
    this.begin(frame);
  }

  private async openScene(): Promise<void> {
    const { scene, n, seed, ratio, size, frame } = this.state;
    status(`Making ${grouped(n)} boxes.`);
    const last = this.frame;
    try {
      const opened = await this.inTurn(() => this.engine.open({ scene, n, seed, ratio, size, frame }));
      this.file = undefined;
      this.begin(opened);
    } catch (error) {
      message(`${grouped(n)} boxes of '${scene}' couldn't be made: ${words(error)}`);
      if (last === undefined || last.count >= n) return;
      // What could be made before can be made again.
      this.state = { ...this.state, n: last.count, frame: 0 };
      this.showControls();
      const again = await this.inTurn(() =>
        this.engine.open({ scene, n: last.count, seed, ratio, size, frame: 0 }),
      );
      this.begin(again);
    }
  }

  /** The first frame of something new. */
  private begin(frame: Frame): void {
    this.chosen = undefined;
    this.view?.choose([]);
    showPath(undefined, frame);
    element("race-result").replaceChildren();
    this.figures.restart();
    this.view?.lookAt(frame);
    this.show(frame);
    this.showControls();
    clearTimeout(this.racing);
    if (!frame.cloth) this.racing = window.setTimeout(() => void this.tryBruteForce(), raceAfter);
    const timeline = (frame.frames ?? 1) > 1;
    element("timeline").hidden = !timeline;
    if (timeline) element<HTMLInputElement>("time").max = String(frame.frames! - 1);
    status(`${grouped(frame.count)} ${frame.cloth ? "triangles" : "boxes"}, ${found(frame)}`);
  }

  private show(frame: Frame): void {
    if (this.frame) this.spare = { boxes: this.frame.boxes, pairs: this.frame.pairs };
    this.frame = frame;
    this.view?.show(frame);
    this.figures.show(frame, performance.now());
    if (this.probe) void this.touch();
    if (frame.frames !== undefined) {
      element<HTMLInputElement>("time").value = String(frame.frame);
      element("time-shown").textContent = grouped(frame.frame);
    }
  }

  private async step(): Promise<void> {
    if (this.stepping || this.frame === undefined) return;
    this.stepping = true;
    const { spare } = this;
    this.spare = { boxes: new Float32Array(0), pairs: new Uint32Array(0) };
    try {
      const buffers = [spare.boxes.buffer, spare.pairs.buffer];
      this.show(await this.inTurn(() => this.engine.step(Comlink.transfer(spare, buffers))));
      if (this.state.paused) this.figures.write(this.frame); // it was under way when somebody pressed Pause
      if (this.frame.ended && !this.state.paused) {
        this.pause(true);
        status(`It has ended, with frame ${grouped(this.frame.frame)}.`);
      }
    } catch (error) {
      this.pause(true);
      message(`The next frame couldn't be found: ${words(error)}`);
    } finally {
      this.stepping = false;
    }
  }

  private tick(now: number): void {
    requestAnimationFrame((next) => this.tick(next));
    if (this.view) {
      this.view.turning = !this.state.paused && !this.stillness.matches && this.chosen === undefined;
      this.view.refresh(now);
    }
    const interval = 1000 / this.state.motion;
    // Screens refresh at their own times: what is due within some milliseconds is due now.
    const ready = !this.state.paused && !this.stepping && this.view?.isShown !== false;
    if (ready && now - this.stepped >= interval - 4) {
      this.stepped = Math.max(this.stepped + interval, now - interval);
      void this.step();
    }
    if ((this.chosen !== undefined || this.showsBricks) && !this.state.paused && now - this.explained > 250) {
      this.explained = now;
      void this.explain();
    }
  }

  // --- What somebody asks -------------------------------------------------------------------------------

  private async pick(from: number[], direction: number[]): Promise<void> {
    if (this.frame?.cloth) return;
    const box = await this.inTurn(() => this.engine.pick(from, direction));
    this.choose(box < 0 ? undefined : box);
  }

  /** Lights what the visitor's box touches. */
  private async touch(): Promise<void> {
    if (this.probing || this.chosen !== undefined || this.frame?.cloth) return;
    this.probing = true;
    const { probe } = this;
    try {
      const { boxes, ms } = probe
        ? await this.inTurn(() => this.engine.touching(probe))
        : { boxes: [], ms: 0 };
      if (this.chosen === undefined) this.view?.touch(boxes);
      element("hint").textContent = probe
        ? `Your box touches ${grouped(boxes.length)} of them, found in ${milliseconds(ms)} ms.`
        : "Click a box to see why it touches what it touches.";
    } finally {
      this.probing = false;
    }
    if (probe !== this.probe) void this.touch(); // it has moved meanwhile
  }

  private choose(box: number | undefined): void {
    this.chosen = box;
    this.view?.moveProbe(undefined);
    if (box === undefined && this.frame) {
      this.view?.choose([]);
      showPath(undefined, this.frame);
    }
    void this.explain();
  }

  /** Shows bricks, and the way of the box that was chosen. */
  private async explain(): Promise<void> {
    const { chosen } = this;
    if (this.frame === undefined) return;
    if (chosen === undefined) {
      const shown = this.showsBricks && this.frame.cloth === undefined;
      this.view?.showBricks(shown ? await this.inTurn(() => this.engine.bricks()) : undefined);
      return;
    }
    const { path, list } = await this.inTurn(() => this.engine.path(chosen));
    if (chosen !== this.chosen) return; // somebody was faster
    this.view?.choose([chosen, ...path.partners.map(({ box }) => box)]);
    // Alone the bricks of the box are shown, unless all are.
    const { bricks, inside } = path;
    this.view?.showBricks(
      this.showsBricks ? list : only(list, bricks),
      this.showsBricks ? bricks : allOf(bricks),
      inside,
    );
    showPath(path, this.frame);
    element("let-go").addEventListener("click", () => this.choose(undefined));
  }

  /** What brute force takes, beside the engine's time. */
  private async tryBruteForce(): Promise<void> {
    const asked = this.racing;
    const brute = await this.inTurn(() => this.engine.bruteForce());
    if (asked === this.racing) this.figures.showBruteForce(brute);
  }

  private async race(): Promise<void> {
    const button = element<HTMLButtonElement>("race");
    button.disabled = true;
    const wasPaused = this.state.paused;
    this.pause(true);
    const race = new Race();
    try {
      for (const engine of raceEngines) {
        button.textContent = "Running…";
        race.add(engine, await this.inTurn(() => this.engine.race(engine)));
      }
    } catch (error) {
      message(`The race was broken off: ${words(error)}`);
    }
    button.textContent = "Race again";
    button.disabled = false;
    this.pause(wasPaused);
  }

  /** Opens a file that was dropped or chosen. */
  private async openFile(file: File): Promise<void> {
    message("");
    try {
      await this.openBytes(new Uint8Array(await file.arrayBuffer()), file.name);
      this.state = { ...this.state, file: undefined, live: undefined };
      this.showControls();
    } catch (error) {
      message(words(error));
    }
  }

  private async save(what: "boxes" | "pairs"): Promise<void> {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(await this.inTurn(() => this.engine.saved(what)));
    link.download = what === "boxes" ? "boxes.npy" : "pairs.csv";
    link.click();
    URL.revokeObjectURL(link.href);
  }

  /** Shows how a program finds the pairs of this frame. */
  private showCode(language: string): void {
    const { frame, file, state } = this;
    if (frame === undefined) return;
    const { scene, n, seed, ratio, size } = state;
    const asItIs = file === undefined && ratio === 1 && size === 100 && !isSimulated(scene);
    const told: Told = {
      count: frame.count,
      dim: frame.dim,
      double: frame.double,
      pairs: frame.pairCount,
      checksum: frame.checksum,
      seeded: asItIs ? { scene, n, seed, frame: frame.frame } : undefined,
    };
    element("code-note").textContent = note(told);
    element("code-text").textContent = languages[language]!(told);
    for (const button of element("languages").querySelectorAll("button"))
      button.ariaPressed = String(button.textContent === language);
  }

  // --- Controls -----------------------------------------------------------------------------------------

  private fillControls(): void {
    const option = (value: string, text: string): HTMLOptionElement => new Option(text, value);
    const group = (label: string, scenes: SceneName[]): HTMLOptGroupElement => {
      const made = document.createElement("optgroup");
      made.label = label;
      made.append(...scenes.map(({ name, summary }) => option(name, summary)));
      return made;
    };
    const { scenes, threads, mostThreads, refused, instructionSet, version } = this.loaded;
    element("scene").replaceChildren(
      group("Drifting boxes", scenes.filter(({ simulated }) => !simulated)),
      group("Simulations", scenes.filter(({ simulated }) => simulated)),
    );
    const counts = [...new Set([1, 2, 4, 8, 16, mostThreads].filter((count) => count <= mostThreads))];
    element("threads").replaceChildren(...counts.map((count) => option(String(count), String(count))));
    element<HTMLSelectElement>("threads").value = String(threads);
    element<HTMLSelectElement>("threads").disabled = mostThreads === 1;
    const note = element("threads-note");
    note.textContent =
      instructionSet === "scalar"
        ? "Without SIMD, which this browser's WebAssembly hasn't, and on one thread: " +
          "searches take about twice as long. The pairs are the same."
        : crossOriginIsolated
          ? refused === undefined ? "" : `One thread: ${refused}.`
          : "One thread: this page's server doesn't isolate it from other origins, " +
            "which browsers want for more.";
    note.hidden = note.textContent === "";
    for (const [id, address] of Object.entries(links)) {
      element<HTMLAnchorElement>(id).hidden = !address;
      if (address) element<HTMLAnchorElement>(id).href = address;
    }
    const simd = instructionSet === "scalar" ? "without SIMD" : "with SIMD";
    element("about").textContent = 
      `Jostle ${version}, a library for C++, C, Python and JavaScript, here in WebAssembly ${simd}. ` +
      "It finds the same pairs, to the last one, as on any other machine.";
  }

  /** Has the controls and the address show the state. */
  private showControls(): void {
    const { scene, n, ratio, motion, paused } = this.state;
    const select = element<HTMLSelectElement>("scene");
    select.querySelector("[data-file]")?.remove();
    if (this.file !== undefined) {
      const own = new Option(this.file, "");
      own.dataset.file = "";
      select.prepend(own);
      select.value = "";
    } else {
      select.value = scene;
    }
    const simulated = this.file === undefined && isSimulated(scene);
    const cloth = simulated && scene === clothScene;
    document.body.classList.toggle("cloth", cloth);
    element("bodies-row").hidden = !simulated || cloth;
    // A file of one frame stands still, and no file can be shuffled.
    element("moves").hidden = this.file !== undefined && this.frame?.frames === 1;
    element("again").hidden = this.file !== undefined;
    const range = (id: string, part: number, text: string, off: boolean): void => {
      const input = element<HTMLInputElement>(id);
      input.value = String(Math.round(part * Number(input.max)));
      input.disabled = off;
      input.setAttribute("aria-valuetext", text);
      element(`${id}-shown`).textContent = text;
    };
    const bodies = this.file === undefined ? n : (this.frame?.count ?? 0);
    range("n", partOf(bodies, ...limits.n), grouped(bodies), this.file !== undefined);
    range("ratio", partOf(ratio, ...limits.ratio), ratio === 1 ? "as in the scene" : `1 : ${grouped(ratio)}`,
      this.file !== undefined || simulated);
    element<HTMLInputElement>("motion").value = String(motion);
    element("motion-shown").textContent = String(motion);
    element("pause").textContent = paused ? "Play" : "Pause";
    history.replaceState(
      null,
      "",
      this.hasAddress ? formatState(this.state) : location.pathname + location.search,
    );
  }
  /** Whether an address leads to what is shown: not to a file that was dropped. */
  private get hasAddress(): boolean {
    return this.file === undefined || this.state.file !== undefined || this.state.live !== undefined;
  }

  private pause(paused: boolean): void {
    if (this.state.paused === paused) return;
    this.state.paused = paused;
    // A link to a scene at rest shows the very frame.
    this.state.frame = paused && this.hasAddress ? (this.frame?.frame ?? 0) : 0;
    this.showControls();
    if (this.frame) this.figures.write(this.frame);
    if (paused && this.frame)
      status(`Paused at frame ${grouped(this.frame.frame)}: ${found(this.frame)}`);
    void this.explain();
  }

  private async stepOnce(): Promise<void> {
    this.pause(true);
    await this.step();
    this.state.frame = this.hasAddress ? (this.frame?.frame ?? 0) : 0;
    this.showControls();
    if (this.frame) {
      this.figures.write(this.frame);
      status(`Frame ${grouped(this.frame.frame)}: ${found(this.frame)}`);
    }
    await this.explain();
  }

  private async change(to: Partial<State>): Promise<void> {
    const next = { ...this.state, file: undefined, live: undefined, frame: 0, ...to };
    this.state = { ...next, n: Math.min(next.n, most(next.scene)) };
    this.file = undefined;
    this.showControls();
    await this.open();
  }

  private async changeThreads(threads: number): Promise<void> {
    this.state.threads = threads;
    this.loaded = await this.inTurn(() => this.engine.load(threads));
    this.fillControls();
    const { file, live } = this.state;
    await this.change({ file, live, frame: this.frame?.frame ?? 0 });
  }

  private applyTheme(): void {
    document.documentElement.dataset.theme = this.theme;
    element("theme").textContent = this.theme === "dark" ? "Light colours" : "Dark colours";
    this.view?.setTheme(this.theme);
  }

  private listen(): void {
    const on = (id: string, event: string, work: (input: HTMLInputElement) => void): void =>
      element(id).addEventListener(event, () => work(element<HTMLInputElement>(id)));
    const part = (input: HTMLInputElement): number => Number(input.value) / Number(input.max);

    on("pause", "click", () => this.pause(!this.state.paused));
    on("step", "click", () => void this.stepOnce());
    on("again", "click", () => void this.change({ seed: (this.state.seed % (2 ** 32 - 1)) + 1 }));
    on("scene", "change", ({ value }) => {
      // Of falling bodies so many that one sees each of them, and a cloth of which one frame takes little.
      const few = value === clothScene ? 4000 : isSimulated(value) ? 1000 : Infinity;
      const n = Math.min(this.state.n, few);
      void this.change({ scene: value, n });
    });
    on(
      "n",
      "input",
      (input) => (element("n-shown").textContent = grouped(roundAt(part(input), ...limits.n))),
    );
    on("n", "change", (input) => void this.change({ n: roundAt(part(input), ...limits.n) }));
    on(
      "ratio",
      "input",
      (input) =>
        (element("ratio-shown").textContent = `1 : ${grouped(roundAt(part(input), ...limits.ratio))}`),
    );
    on("ratio", "change", (input) => void this.change({ ratio: roundAt(part(input), ...limits.ratio) }));
    on("motion", "input", ({ value }) => {
      this.state.motion = Number(value);
      this.showControls();
    });
    on("threads", "change", ({ value }) => void this.changeThreads(Number(value)));
    on("show-bodies", "change", ({ checked }) => {
      this.showsBodies = checked;
      void this.inTurn(async () => {
        await this.engine.showBodies(checked);
        this.show(await this.engine.again());
      });
    });
    on("show-bricks", "change", ({ checked }) => {
      this.showsBricks = checked;
      void this.explain();
    });
    const cut = (): void =>
      this.view?.cutAt(
        Number(element<HTMLSelectElement>("cut-axis").value),
        part(element<HTMLInputElement>("cut")),
      );
    on("cut", "input", cut);
    on("cut-axis", "change", cut);
    on("race", "click", () => void this.race());
    on("message", "click", () => message(""));
    on("theme", "click", () => {
      this.theme = this.theme === "dark" ? "light" : "dark";
      this.applyTheme();
    });
    on("code", "click", () => {
      this.pause(true); // so that the code is of what is seen
      void this.inTurn(async () => {}).then(() => {
        this.showCode("C++");
        element<HTMLDialogElement>("code-dialog").showModal();
      });
    });
    on("code-close", "click", () => element<HTMLDialogElement>("code-dialog").close());
    on("code-boxes", "click", () => void this.save("boxes"));
    on("copy", "click", (button) => {
      void navigator.clipboard.writeText(element("code-text").textContent ?? "").then(
        () => (button.textContent = "Copied"),
        () => (button.textContent = "Not allowed here"),
      );
      setTimeout(() => (button.textContent = "Copy"), 1500);
    });
    for (const language of Object.keys(languages)) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = language;
      button.addEventListener("click", () => this.showCode(language));
      element("languages").append(button);
    }
    for (const [name, { file, table }] of Object.entries(samples)) {
      const button = document.createElement("button");
      button.type = "button";
      button.className = "link";
      button.textContent = name;
      button.addEventListener("click", () => void this.openFile(new File([table()], file)));
      element("samples").append(element("samples").children.length > 0 ? ", " : "", button);
    }
    on("save-pairs", "click", () => void this.save("pairs"));
    on("save-boxes", "click", () => void this.save("boxes"));
    on("file", "change", (input) => {
      const file = input.files?.[0];
      if (file) void this.openFile(file);
      input.value = ""; // so that the same file can be chosen again
    });
    on("time", "input", ({ value }) => {
      this.pause(true);
      void this.inTurn(() => this.engine.go(Number(value))).then((frame) => {
        this.show(frame);
        this.figures.write(frame);
        return this.explain();
      });
    });
    window.addEventListener("hashchange", () => {
      const next = this.read();
      if (formatState(next) !== formatState(this.state)) void this.change(next);
    });
    window.addEventListener("keydown", (event) => {
      const { target } = event;
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (element<HTMLDialogElement>("code-dialog").open) return;
      const takesKeys = target instanceof HTMLElement && target.matches("a, button, input, select, textarea");
      if (event.key === " " && !takesKeys) this.pause(!this.state.paused);
      else if (event.key === "." && !takesKeys) void this.stepOnce();
      else if (event.key === "Escape" && !element("message").hidden) message("");
      else if (event.key === "Escape" && this.chosen !== undefined) this.choose(undefined);
      else return;
      event.preventDefault();
    });
    this.listenForDrops();
    window.addEventListener("paste", ({ clipboardData }) => {
      const text = clipboardData?.getData("text/plain");
      // What spreadsheets copy has tabs between its fields.
      const table = text?.includes(",") ? text : text?.replaceAll("\t", ",");
      const file = clipboardData?.files[0] ?? (table ? new File([table], "pasted.csv") : undefined);
      if (file) void this.openFile(file);
    });
  }

  private listenForDrops(): void {
    const hint = element("drop");
    window.addEventListener("dragover", (event) => {
      event.preventDefault();
      hint.hidden = false;
    });
    window.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) hint.hidden = true; // it left the window
    });
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      hint.hidden = true;
      const file = event.dataTransfer?.files[0];
      if (file) void this.openFile(file);
    });
  }

  /** The page's numbers, for scripts; undefined until the first frame. */
  stats(): object | undefined {
    const { frame, state } = this;
    if (frame === undefined) return undefined;
    return {
      scene: this.file ?? state.scene,
      n: frame.count,
      seed: state.seed,
      ratio: state.ratio,
      frame: frame.frame,
      pairs: frame.pairCount,
      near: frame.cloth?.near,
      crossings: frame.cloth?.crossings,
      checksum: frame.checksum,
      ms: frame.ms,
      threads: frame.threads,
      instructionSet: this.loaded.instructionSet,
      paused: state.paused,
      chosen: this.chosen,
      drawn: this.view?.drawn,
    };
  }
}

type List = Awaited<ReturnType<Engine["bricks"]>>;
/** Some bricks of a list. */
function only(list: List, bricks: readonly number[]): List {
  return {
    bounds: Float32Array.from(bricks.flatMap((brick) => [...list.bounds.subarray(6 * brick, 6 * brick + 6)])),
    records: Uint32Array.from(bricks, (brick) => list.records[brick]!),
  };
}
function allOf(bricks: readonly number[]): number[] {
  return bricks.map((_, k) => k);
}

declare global {
  interface Window {
    jostle: { stats: () => object | undefined };
  }
}

const page = new Page();
window.jostle = { stats: () => page.stats() };
page.start().catch((error: unknown) => message(`The engine couldn't be started: ${words(error)}`));
