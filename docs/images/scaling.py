#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""scaling.py [--check]: draws scaling.svg from bench/results, or fails if it isn't what would be drawn."""
import json
import math
import pathlib
import sys

here = pathlib.Path(__file__).parent
rows = json.loads((here.parents[1] / "bench/results/epyc-zen5-2-cores/peers-3d.json").read_text())
lines = [("embree", 1, "Embree 3.13, one thread", "#cc6677"), ("jostle", 1, "Jostle, one thread", "#4477aa"),
         ("jostle", 2, "Jostle, two threads", "#77aadd"), ("floor", 1, "read, sort, write: no system", "#999999")]
left, right, top, bottom = 70, 490, 20, 290
least, most = 0.005, 1000 # ms


def place(n, ms):
    x = left + (right - left) * (math.log10(n) - 3) / 3
    y = bottom - (bottom - top) * math.log10(ms / least) / math.log10(most / least)
    return f"{x:.1f}", f"{y:.1f}"


svg = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 730 340" font-family="sans-serif" font-size="12.5">',
       '<rect width="730" height="340" fill="white"/>']
for ms in (0.01, 0.1, 1, 10, 100, 1000):
    _, y = place(1000, ms)
    svg += [f'<line x1="{left}" y1="{y}" x2="{right}" y2="{y}" stroke="#ddd"/>',
            f'<text x="{left - 8}" y="{float(y) + 4:.1f}" text-anchor="end">{ms:g} ms</text>']
for n in (1000, 10_000, 100_000, 1_000_000):
    x, _ = place(n, 1)
    svg += [f'<line x1="{x}" y1="{top}" x2="{x}" y2="{bottom}" stroke="#ddd"/>',
            f'<text x="{x}" y="{bottom + 18}" text-anchor="middle">{n:,}</text>']
svg.append(f'<text x="{(left + right) / 2}" y="{bottom + 38}" text-anchor="middle">boxes that all move (uniform, 3D, float), on an AMD EPYC (Zen 5)</text>')
free = top # no word is higher than this: words don't run into each other
for system, threads, words, colour in lines:
    found = sorted((row["n"], row["median_ms"]) for row in rows
                   if (row["system"], row["scene"], row["threads"]) == (system, "uniform", threads))
    points = [place(*each) for each in found]
    svg.append(f'<polyline fill="none" stroke="{colour}" stroke-width="2" points="{" ".join(",".join(p) for p in points)}"/>')
    svg += [f'<circle cx="{x}" cy="{y}" r="3" fill="{colour}"/>' for x, y in points]
    y = max(float(points[-1][1]), free)
    free = y + 17
    svg += [f'<line x1="{right + 3}" y1="{points[-1][1]}" x2="{right + 22}" y2="{y:.1f}" stroke="{colour}"/>',
            f'<text x="{right + 26}" y="{y + 4:.1f}">{words}</text>']
drawn = "\n".join([*svg, "</svg>"]) + "\n"
if sys.argv[1:] == ["--check"]:
    if (here / "scaling.svg").read_text() != drawn:
        sys.exit("docs/images/scaling.svg isn't what bench/results says; draw it again by docs/images/scaling.py")
else:
    (here / "scaling.svg").write_text(drawn)
