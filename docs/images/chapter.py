#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""chapter.py [--check]: draws the pictures of docs/inside/chapter.md, or fails if they aren't what would be drawn.

chapter-cells.svg       figures 4.1 to 4.4: a grid, cells too small, cells too big, the southwest cell
chapter-responses.svg   figure 4.8: a row of responses for each processor, merged
chapter-ladder.svg      the ladder's times, from bench/results
"""
import json
import math
import pathlib
import sys

here = pathlib.Path(__file__).parent
results = here.parents[1] / "bench/results/epyc-zen3-2-cores/ladder.json"
blue, red, grey, ink = "#4477aa", "#cc6677", "#bbbbbb", "#222222"


def svg(width, height, *parts):
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
                      'font-family="sans-serif" font-size="12.5">',
                      f'<rect width="{width}" height="{height}" fill="white"/>', *parts, "</svg>"]) + "\n"


def rect(x, y, w, h, colour, fill="none", more=""):
    return f'<rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" fill="{fill}" stroke="{colour}"{more}/>'


def text(x, y, words, anchor="start", colour=ink):
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" fill="{colour}">{words}</text>'


def arrow(x1, y1, x2, y2, colour=ink):
    angle = math.atan2(y2 - y1, x2 - x1)
    tips = [(x2 - 8 * math.cos(angle + turn), y2 - 8 * math.sin(angle + turn)) for turn in (0.4, -0.4)]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in [tips[0], (x2, y2), tips[1]])
    return (f'<line x1="{x1:g}" y1="{y1:g}" x2="{x2:g}" y2="{y2:g}" stroke="{colour}"/>'
            f'<polygon points="{points}" fill="{colour}"/>')


def cells():
    """Four panels of 160, a grid of `count` cells in each."""
    parts = []
    size, gap, top = 160, 24, 16
    boxes = {
        0: [(12, 20, 26, 18), (34, 32, 24, 24), (96, 70, 28, 22), (112, 84, 30, 26), (60, 120, 20, 30)],
        1: [(12, 20, 46, 38), (42, 44, 54, 48), (90, 96, 50, 44)],
        2: [(14 + 23 * (i % 6), 14 + 24 * (i // 6) + 5 * (i % 3), 12, 12) for i in range(36)],
        3: [(52, 56, 34, 36), (24, 84, 34, 24)],
    }
    for panel, (title, count) in enumerate([("4.1  a grid", 4), ("4.2  cells too small", 10), ("4.3  cells too big", 2),
                                            ("4.4  the southwest cell", 4)]):
        left = 10 + panel * (size + gap)
        step = size / count
        if panel == 3: # the five cells of the upper box, whose min corner is in column 1, row 1
            for column, row in ((1, 1), (2, 1), (1, 2), (2, 2)):
                parts.append(rect(left + column * step, top + row * step, step, step, grey, "#dde8f3"))
            parts.append(rect(left + 0 * step, top + 2 * step, step, step, grey, "#f6dde0"))
        for i in range(count + 1):
            parts.append(f'<line x1="{left}" y1="{top + i * step:g}" x2="{left + size}" y2="{top + i * step:g}" stroke="{grey}"/>')
            parts.append(f'<line x1="{left + i * step:g}" y1="{top}" x2="{left + i * step:g}" y2="{top + size}" stroke="{grey}"/>')
        for index, (x, y, w, h) in enumerate(boxes[panel]):
            parts.append(rect(left + x, top + y, w, h, blue if panel != 3 or index == 0 else red, "none", ' stroke-width="1.6"'))
            parts.append(f'<circle cx="{left + x:g}" cy="{top + y:g}" r="2.4" fill="{ink}"/>')
        parts.append(text(left + size / 2, top + size + 20, title, "middle"))
    words = "dot: the corner that decides an object's cell; blue: the cells that the object probes, red: the southwest one"
    parts.append(text(10, top + size + 42, words))
    return svg(4 * size + 3 * gap + 20, top + size + 52, *parts)


def responses():
    parts, left, width, row = [], 160, 44, 26
    for processor in range(2):
        y = 34 + processor * 44
        parts.append(text(left - 12, y + 17, f"processor {processor + 1} writes", "end"))
        for thing in range(6):
            filled = (thing + processor) % 3 != 0
            parts.append(rect(left + thing * width, y, width - 6, row, blue if processor == 0 else red,
                              ("#dde8f3" if processor == 0 else "#f6dde0") if filled else "white"))
    parts.append(f'<line x1="20" y1="122" x2="440" y2="122" stroke="{ink}" stroke-dasharray="5 4"/>')
    parts.append(text(450, 126, "barrier"))
    for thing in range(6):
        x = left + thing * width + (width - 6) / 2
        parts.append(arrow(x, 106, x, 144))
        parts.append(rect(left + thing * width, 146, width - 6, row, ink, "#eeeeee"))
        parts.append(text(x, 22, f"{thing + 1}", "middle"))
    parts.append(text(left - 12, 22, "object", "end"))
    parts.append(text(left - 12, 163, "sum, by object", "end"))
    parts.append(f'<line x1="20" y1="184" x2="440" y2="184" stroke="{ink}" stroke-dasharray="5 4"/>')
    parts.append(text(450, 188, "barrier"))
    return svg(510, 200, *parts)


def ladder():
    """Milliseconds of each rung on one thread at three sizes, as bars on a logarithmic axis."""
    rows = [row for row in json.loads(results.read_text())
            if row["what"] == "find" and row["scene"] == "uniform" and row["threads"] == 1]
    sizes = sorted({row["n"] for row in rows})
    names = list(dict.fromkeys(row["rung"] for row in rows))
    left, right, top, bar = 150, 590, 30, 11
    least, most = 0.05, max(row["ms"] for row in rows) * 1.3

    def place(ms):
        return left + (right - left) * math.log(max(ms, least) / least) / math.log(most / least)

    parts, shades = [], ["#aaccee", "#77aadd", "#4477aa"]
    bottom = top + len(names) * (len(sizes) * bar + 12)
    power = math.ceil(math.log10(least))
    while 10 ** power <= most:
        x = place(10 ** power)
        parts.append(f'<line x1="{x:.1f}" y1="{top - 6}" x2="{x:.1f}" y2="{bottom}" stroke="#ddd"/>')
        label = f"{10 ** power:g} ms" if power < 3 else f"{10 ** (power - 3):,} s"
        if power != 6: # too near to the next one
            parts.append(text(round(x, 1), bottom + 16, label, "middle"))
        power += 1
    for index, name in enumerate(names):
        y = top + index * (len(sizes) * bar + 12)
        parts.append(text(left - 8, y + 20, f"{index + 1}  {name}", "end"))
        for k, n in enumerate(sizes):
            row = next(r for r in rows if r["rung"] == name and r["n"] == n)
            end = place(row["ms"])
            parts.append(f'<rect x="{left}" y="{y + k * bar}" width="{end - left:.1f}" height="{bar - 2}" fill="{shades[k]}"/>')
            ms = row["ms"]
            words = f"{ms / 1000:,.0f} s" if ms >= 9950 else f"{ms / 1000:.1f} s" if ms >= 995 else f"{ms:.3g} ms"
            words += " *" if row["searched"] < n else ""
            parts.append(f'<text x="{end + 4:.1f}" y="{y + k * bar + bar - 2}" font-size="10">{words}</text>')
    for k, n in enumerate(sizes):
        parts.append(f'<rect x="{left + k * 130}" y="6" width="10" height="10" fill="{shades[k]}"/>')
        parts.append(text(left + k * 130 + 15, 16, f"{n:,} boxes"))
    parts.append(text((left + right) / 2, bottom + 34, "one thread, logarithmic scale; * estimated from 20,000 of the searches", "middle"))
    return svg(right + 60, bottom + 44, *parts)


wrong = []
for name, draw in (("chapter-cells", cells), ("chapter-responses", responses), ("chapter-ladder", ladder)):
    file, drawn = here / f"{name}.svg", draw()
    if sys.argv[1:] != ["--check"]:
        file.write_text(drawn)
    elif not file.is_file() or file.read_text() != drawn:
        wrong.append(f"{file.name} isn't what would be drawn; run docs/images/chapter.py")
sys.exit("\n".join(wrong) or 0)
