#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""soak.py SERIES.csv "WORDS": draws soak.svg from what tests/soak wrote: times of updates above, memory below."""
import csv
import math
import pathlib
import sys

with open(sys.argv[1]) as file:
    rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
left, right = 70, 520
end = rows[-1]["seconds"]
svg = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 730 420" font-family="sans-serif" font-size="12.5">',
       '<rect width="730" height="420" fill="white"/>']


def plot(top, bottom, unit, logarithmic, lines):
    values = [row[name] for row in rows for name, _, _ in lines]
    if logarithmic:
        least, most = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        ticks = [10.0 ** k for k in range(least, most + 1)]
        height = lambda value: (math.log10(value) - least) / (most - least)
    else:
        step = 10 ** math.floor(math.log10(max(values)))
        ticks = [step * k for k in range(math.ceil(max(values) / step) + 1)]
        height = lambda value: value / ticks[-1]
    y = lambda value: bottom - (bottom - top) * height(value)
    x = lambda row: left + (right - left) * row["seconds"] / end
    for tick in ticks:
        svg.append(f'<line x1="{left}" y1="{y(tick):.1f}" x2="{right}" y2="{y(tick):.1f}" stroke="#ddd"/>'
                   f'<text x="{left - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick:g} {unit}</text>')
    free = top
    for name, words, colour in sorted(lines, key=lambda line: y(rows[-1][line[0]])):
        points = " ".join(f"{x(row):.1f},{y(row[name]):.1f}" for row in rows)
        svg.append(f'<polyline fill="none" stroke="{colour}" stroke-width="1.5" points="{points}"/>')
        at = max(y(rows[-1][name]), free)
        free = at + 17 # no word is higher than this: words don't run into each other
        svg.append(f'<line x1="{right + 3}" y1="{y(rows[-1][name]):.1f}" x2="{right + 22}" y2="{at:.1f}" stroke="{colour}"/>'
                   f'<text x="{right + 26}" y="{at + 4:.1f}">{words}</text>')


plot(20, 210, "ms", True, [("worst_ms", "the worst update", "#cc6677"), ("rare_ms", "one in 1,000 is slower", "#ddaa33"),
                           ("undisturbed_rare_ms", "the same, no core taken", "#117733"),
                           ("median_ms", "one in 2 is slower", "#4477aa")])
plot(250, 370, "MB", False, [("process_mb", "the process", "#999999"), ("world_mb", "the worlds", "#4477aa")])
svg.append(f'<text x="{left}" y="392" text-anchor="middle">0</text>'
           f'<text x="{right}" y="392" text-anchor="middle">{end / 60:.0f} min</text>'
           f'<text x="{(left + right) / 2}" y="410" text-anchor="middle">{" ".join(sys.argv[2:])}</text>')
(pathlib.Path(__file__).parent / "soak.svg").write_text("\n".join([*svg, "</svg>"]) + "\n")
