// What the page says in words, numbers and bars.
import type { BrickRecord, BruteForce, Frame, Inside, Path, RaceEngine, RaceOutcome } from "./messages";
import { duration, grouped, inWords, milliseconds } from "./numbers";

/** The element of index.html with this id. */
export function element<E extends HTMLElement = HTMLElement>(id: string): E {
  const found = document.getElementById(id);
  if (found === null) throw new Error(`index.html has no element '${id}'`);
  return found as E;
}

function make(tag: string, className: string, ...content: (Node | string)[]): HTMLElement {
  const made = document.createElement(tag);
  if (className) made.className = className;
  made.append(...content);
  return made;
}

/** A bar with its name and value. */
class Bar {
  readonly root: HTMLElement;
  private readonly value = make("span", "value");
  private readonly fill = make("div", "fill");

  constructor(name: string, tone?: string) {
    if (tone) this.fill.style.setProperty("--tone", tone);
    this.fill.style.transform = "scaleX(0)";
    const track = make("div", "track", this.fill);
    track.ariaHidden = "true";
    this.root = make("div", "bar", make("span", "", name), this.value, track);
  }
  show(part: number, text: string): void {
    this.fill.style.transform = `scaleX(${Math.min(1, Math.max(0, part)).toFixed(4)})`;
    this.value.textContent = text;
  }
}

const stageNames = {
  tune: "choose a grid of bricks",
  scatter: "sort boxes into bricks",
  sweep: "find pairs in bricks",
  finish: "put pairs in order",
} as const;
type Stage = keyof typeof stageNames;
const stageList = Object.keys(stageNames) as Stage[];

/** So many of the last searches a time is the median of. */
const remembered = 9;

/** The figures of the last frame. Times are medians of the last frames, so that they can be read. */
export class Figures {
  private readonly bars: Record<Stage, Bar>;
  private readonly last: Pick<Frame, "ms" | "stages">[] = [];
  private brute: BruteForce | undefined;
  private lastWritten = -Infinity;

  constructor() {
    const bar = (stage: Stage, k: number): Bar => {
      const made = new Bar(stageNames[stage], `var(--stage-${k + 1})`);
      element("stages").append(made.root);
      return made;
    };
    this.bars = Object.fromEntries(stageList.map((stage, k) => [stage, bar(stage, k)])) as Record<Stage, Bar>;
  }

  /** Begins again: the last times belong to another scene. */
  restart(): void {
    this.last.length = 0;
    this.lastWritten = -Infinity;
    this.showBruteForce(undefined);
  }

  /** What brute force takes; undefined while nobody knows. */
  showBruteForce(brute: BruteForce | undefined): void {
    this.brute = brute;
    const about = brute?.measured === false ? "about " : "";
    element("brute").textContent = brute === undefined ? "…" : about + duration(brute.ms);
    this.compare();
  }
  private compare(): void {
    const { brute } = this;
    const own = this.median(({ ms }) => ms);
    const factor = brute && own > 0 ? brute.ms / own : 0;
    // So near to each other are times of few boxes that a factor says nothing.
    const times =
      factor >= 2 ? `: ${factor >= 10 ? grouped(Number(factor.toPrecision(2))) : factor.toFixed(1)}x` : "";
    element("brute-label").textContent = `by brute force${times}`;
  }
  private median(of: (frame: Pick<Frame, "ms" | "stages">) => number): number {
    return this.last.map(of).sort((a, b) => a - b)[this.last.length >> 1] ?? 0;
  }

  show(frame: Frame, now: number): void {
    this.last.push({ ms: frame.ms, stages: frame.stages });
    if (this.last.length > remembered) this.last.shift();
    if (now - this.lastWritten < 100) return; // faster than that nobody reads
    this.lastWritten = now;
    this.write(frame);
  }

  write(frame: Frame): void {
    const { cloth } = frame;
    element("pairs").textContent = grouped(cloth?.near ?? frame.pairCount);
    element("crossings").textContent = grouped(cloth?.crossings ?? 0);
    element("ms").textContent = duration(this.median(({ ms }) => ms));
    this.compare();
    element("bodies").textContent = grouped(frame.count);
    element("contacts-figure").hidden = frame.bodies === undefined;
    element("contacts").textContent = grouped(frame.bodies?.contactCount ?? 0);
    element("legend").textContent = cloth
      ? "Lit: where the cloth is near itself. A crossing: an edge that passes through a triangle."
      : frame.bodies === undefined
        ? "Blue glass: the boxes. Lit: what two of them have in common."
        : "Blue glass: a box around each body. Green needles: where two bodies touch.";
    const threads = frame.threads === 1 || cloth ? "one thread" : `${frame.threads} threads`;
    element("ms-label").textContent = `with Jostle, on ${threads}`;
    element("frame").textContent =
      frame.frames === undefined
        ? grouped(frame.frame)
        : `${grouped(frame.frame + 1)} of ${grouped(frame.frames)}`;
    const times = stageList.map((stage) => this.median(({ stages }) => stages[stage]));
    const longest = Math.max(...times, 1e-9);
    stageList.forEach((stage, k) =>
      this.bars[stage].show(times[k]! / longest, `${milliseconds(times[k]!)} ms`),
    );
    element("work").textContent =
      frame.bricks === 0
        ? "So few boxes are compared at once: no bricks are needed."
        : `${grouped(frame.records)} records of 16 bytes in ${grouped(frame.bricks)} bricks; ` +
          `${grouped(frame.candidates)} candidates compared, ` +
          `of ${inWords((frame.count * (frame.count - 1)) / 2)}.`;
  }
}

const axes = ["x", "y", "z"];

/** A box's way through the engine, and why it touches what it touches. */
export function showPath(path: Path | undefined, frame: Frame): void {
  const root = element("chosen");
  root.hidden = path === undefined;
  if (path === undefined) return root.replaceChildren();
  const { box, name, bricks, partners } = path;
  const numbers = Array.from(
    frame.boxes.subarray(6 * box, 6 * box + 6),
    (value, k) => value + frame.origin[k % 3]!,
  );
  const corner = (from: number): string =>
    `(${numbers
      .slice(from, from + 3)
      .map((value) => value.toFixed(2))
      .join(", ")})`;
  const close = make("button", "", "Deselect") as HTMLButtonElement;
  close.type = "button";
  close.id = "let-go";
  const stored =
    bricks.length === 0
      ? "With so few boxes no brick is needed."
      : bricks.length === 1
        ? `It lies in one brick, and is stored there as a record of 16 bytes.`
        : `It reaches into ${bricks.length} bricks, and is stored in each as a record of 16 bytes.`;
  const list = make("ul", "");
  list.tabIndex = 0;
  list.setAttribute("aria-label", "Boxes that it touches");
  for (const partner of partners.slice(0, 200)) {
    const least = partner.overlap.indexOf(Math.min(...partner.overlap));
    const overlap = partner.overlap.map((part) => part.toFixed(2)).join(" × ");
    const reported = partner.owner >= 0 ? `; brick ${grouped(partner.owner)} reports it` : "";
    const text = `${partner.name}: they share ${overlap}, least along ${axes[least]}${reported}.`;
    list.append(make("li", "", text));
  }
  const wasOpen = root.querySelector("details")?.open ?? false; // it is made anew while boxes move
  root.replaceChildren(
    make("p", "", make("strong", "", name), ` from ${corner(0)} to ${corner(3)}. ${stored}`),
    make(
      "p",
      "",
      partners.length === 0
        ? "It touches nothing: every other box is apart from it along at least one axis."
        : `It touches ${partners.length === 1 ? "one box" : `${grouped(partners.length)} boxes`}, ` +
            "because they overlap along every axis. Where both lie in several bricks, " +
            "the one in which the later of the two begins reports the pair, and no other.",
    ),
    ...(partners.length > 0 ? [list] : []),
    ...(path.inside ? [brickOf(path.inside, new Set(partners.map((partner) => partner.box)))] : []),
    make("p", "", close),
  );
  const details = root.querySelector("details");
  if (details) details.open = wasOpen;
}

/** What the brick in which a box begins holds, and with which of its records the box's is compared. */
function brickOf(inside: Inside, partners: ReadonlySet<number>): HTMLElement {
  const { records, sweepAxis, quanta, brick, own, end } = inside;
  const axis = axes[sweepAxis]!;
  const touching = records.slice(own + 1, end).filter(({ box }) => partners.has(box)).length;
  // Some that aren't compared stand before and behind; where many are, the middle of them is left out of the
  // picture.
  const shown = records
    .map((record, r) => ({ record, r }))
    .slice(Math.max(0, own - 6), Math.min(end + 6, own + 50));
  const from = Math.min(...shown.map(({ record }) => record.lo[sweepAxis]!));
  const to = Math.max(...shown.map(({ record }) => record.hi[sweepAxis]!));
  const [width, rowHeight] = [300, 5];
  const svg = (tag: string, attributes: Record<string, string | number>): SVGElement => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
    return made;
  };
  const picture = svg("svg", {
    viewBox: `0 0 ${width} ${rowHeight * shown.length}`,
    role: "img",
    "aria-label": `Records of brick ${brick} along ${axis}, in the order in which they are swept`,
  });
  const at = (quantum: number): number => Math.round((width * (quantum - from)) / Math.max(to - from, 1));
  shown.forEach(({ record, r }, row) => {
    const x = at(record.lo[sweepAxis]!);
    const compared = r > own && r < end;
    const name = r === own ? "own" : !compared ? "apart" : partners.has(record.box) ? "touches" : "compared";
    const bar = {
      x,
      width: Math.max(2, at(record.hi[sweepAxis]!) - x),
      y: row * rowHeight,
      height: rowHeight - 1,
    };
    picture.append(svg("rect", { ...bar, class: name }));
  });
  const key = (name: string, text: string): HTMLElement => make("span", `key ${name}`, text);
  const compared = end - own - 1;
  const held = records.length === 1 ? "this record alone" : `${grouped(records.length)} records`;
  const verb = touching === 1 ? "touches" : "touch";
  const how = touching === 0 ? "none touches" : `${grouped(touching)} ${verb}`;
  return make(
    "div",
    "brick",
    make(
      "p",
      "",
      `It begins in brick ${grouped(brick)}, which holds ${held}, sorted along ${axis}. ` +
        "A record is compared with those behind it that begin before it ends: " +
        `here ${compared === 1 ? "one" : grouped(compared)}, of which ${how} it. ` +
        "Each bar is a record, from where it begins to where it ends:",
    ),
    picture,
    make(
      "p",
      "keys",
      key("own", "this box"),
      key("touches", "touches it"),
      key("compared", "only compared"),
      key("apart", "not compared"),
    ),
    recordTable(records.slice(0, 500), records[own]!, quanta),
  );
}

/** Records as they are stored. */
function recordTable(records: readonly BrickRecord[], own: BrickRecord, quanta: number): HTMLElement {
  const row = (tag: string, cells: string[], name = ""): HTMLElement =>
    make("tr", name, ...cells.map((text) => make(tag, "", text)));
  const used = axes.slice(0, own.lo.length);
  const table = make("table", "", row("th", ["box", ...used]));
  for (const record of records) {
    const cells = used.map((_, k) => {
      const lo = (record.copies >> k) & 1 ? "…" : record.lo[k];
      return `${lo} – ${record.hi[k]! >= quanta ? "…" : record.hi[k]}`;
    });
    table.append(row("td", [String(record.box), ...cells], record === own ? "own" : ""));
  }
  const scroller = make("div", "records", table);
  scroller.tabIndex = 0;
  scroller.role = "region";
  scroller.ariaLabel = "Records of the brick";
  return make(
    "details",
    "",
    make(
      "summary",
      "",
      `What the records say, in ${grouped(quanta)}ths of the brick's edge; … goes on outside`,
    ),
    scroller,
  );
}

const engineNames: Record<RaceEngine, string> = {
  grid: "Jostle",
  chapter: "the thesis chapter's hash grid",
  uniform: "uniform grid",
  brute: "brute force",
};
export const raceEngines = Object.keys(engineNames) as RaceEngine[];

/** The race, result by result. */
export class Race {
  private readonly outcomes = new Map<RaceEngine, RaceOutcome>();

  add(engine: RaceEngine, outcome: RaceOutcome): void {
    this.outcomes.set(engine, outcome);
    const longest = Math.max(...this.finished().map(({ ms }) => ms));
    const own = this.outcomes.get("grid")?.result?.ms ?? 0;
    const bars = [...this.outcomes].map(([name, { result, tests }]) => {
      const bar = new Bar(engineNames[name], name === "grid" ? "var(--accent)" : "var(--glass)");
      if (result === undefined) bar.show(1, `left out: ${inWords(tests)} tests`);
      else {
        const beside = name !== "grid" && own > 0 ? `, ${multiple(result.ms / own)}` : "";
        bar.show(result.ms / longest, `${milliseconds(result.ms)} ms${beside}`);
      }
      return bar.root;
    });
    if (this.outcomes.size === raceEngines.length) bars.push(make("p", "verdict", this.verdict()));
    element("race-result").replaceChildren(...bars);
  }

  private finished(): NonNullable<RaceOutcome["result"]>[] {
    return [...this.outcomes.values()].flatMap(({ result }) => (result ? [result] : []));
  }

  private verdict(): string {
    const [first, ...others] = this.finished();
    if (first === undefined) return "Nobody finished.";
    return others.every(({ pairs, checksum }) => pairs === first.pairs && checksum === first.checksum)
      ? `All that ran found the same ${grouped(first.pairs)} pairs.`
      : "They found different pairs. That is a mistake: please report it, with this page's address.";
  }
}

function multiple(factor: number): string {
  return `${factor >= 10 ? grouped(factor) : factor.toFixed(1)} times as long`;
}
