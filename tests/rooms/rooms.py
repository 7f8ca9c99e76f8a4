#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Which room includes which.

    tests/rooms/rooms.py --check   fails for an arrow that isn't allowed, for a circle, for an old picture, and for a
                                   variable of threads out of its place
    tests/rooms/rooms.py --draw    draws docs/images/rooms.svg again
    tests/rooms/rooms.py --dot     writes the graph in Graphviz's language, with how many includes each arrow has

A room is a folder of src/, or one beside it: OUTSIDE has these. Its arrows are the includes of its files.
"""

import argparse
import pathlib
import re
import sys

PROJECT = pathlib.Path(__file__).resolve().parent.parent.parent
PICTURE = PROJECT / "docs" / "images" / "rooms.svg"

# What each room may include, in the order in which data flows; a new arrow is a decision and goes here.
ALLOWED = {
    "jostle": [],  # include/jostle: the interface, which includes nothing else
    "base": ["jostle"],
    "simd": ["jostle"],
    "process": ["base", "jostle"],
    "engine": ["base", "simd", "jostle"],
    "pairs": ["engine", "base", "simd", "jostle"],
    "neighbors": ["base", "simd", "jostle"],
    "index": ["base", "simd", "jostle"],
    "world": ["pairs", "index", "base", "jostle"],
    "narrow": ["base", "simd", "jostle"],
    "surfaces": ["narrow", "pairs", "simd", "base", "jostle"],
    "chapter": ["base", "jostle"],
    "c_api": ["base", "jostle"],
    "system": [],
    "scenes": ["system", "jostle"],
    "simulation": ["scenes", "base", "simd", "jostle"],
    "bench": ["scenes", "system", "jostle"],
    "recorder": ["scenes", "jostle"],
    "tool": ["scenes", "simulation", "bench", "system", "jostle"],
    "examples": ["jostle"],
    "bullet": ["scenes", "jostle"],
    "fcl": ["scenes", "jostle"],
    "mpi": ["scenes", "jostle"],
}
# Rooms in folders: each folder may include itself and those before it. What lies beside the folders comes first, or where
# the room's own name stands.
FOLDERS = {
    "index": ["nodes", "kernels", "tree", "queries", "index"],
    "narrow": ["shapes", "kernels", "convex", "parts", "interface"],
    "world": ["objects", "update", "kept", "world", "queries", "saved"],
}
# Where the rooms beside src/ lie; one may lie in another.
OUTSIDE = {"bench": "bench", "tool": "tool", "system": "tool/system", "scenes": "tool/scenes", "simulation": "tool/simulation",
           "recorder": "tool/data", "examples": "examples", "bullet": "extras/bullet", "fcl": "extras/fcl", "mpi": "extras/mpi"}
# The one file with variables of threads: it says why.
PER_THREAD = PROJECT / "src" / "base" / "per_thread.hpp"
THREAD_LOCAL = re.compile(r"^(?!\s*//).*\bthread_local\b", re.MULTILINE)
INCLUDE = re.compile(r'^\s*#\s*(?:include|define\s+HWY_TARGET_INCLUDE)\s*[<"]([^">]+)[">]', re.MULTILINE)


def sources():
    """All files of the rooms, and the room of each."""
    rooms = {}
    for folder in sorted((PROJECT / "src").iterdir()):
        if folder.is_dir():
            rooms.update((file, folder.name) for file in sorted(folder.rglob("*.[ch]pp")))
        elif folder.suffix in (".hpp", ".cpp"):
            rooms[folder] = "no room"
    rooms.update((file, "jostle") for file in sorted((PROJECT / "include" / "jostle").glob("*.h*")))
    for name, place in sorted(OUTSIDE.items(), key=lambda room: len(room[1])):  # the inner ones have the last word
        rooms.update((file, name) for file in sorted((PROJECT / place).rglob("*.[ch]pp")))
    return rooms


def included(file, rooms):
    """The files of the project that a file includes."""
    for name in INCLUDE.findall(file.read_text()):
        for root in (file.parent, PROJECT / "src", PROJECT / "include", PROJECT):
            target = (root / name).resolve()
            if target in rooms:
                if target != file:  # a file that is compiled once per instruction set names itself
                    yield target
                break


def circle(edges):
    """Some circle of a graph, as a list of nodes, or None."""
    done, way = set(), []

    def visit(node):
        if node in done:
            return None
        if node in way:
            return way[way.index(node):] + [node]
        way.append(node)
        for following in sorted(edges.get(node, ())):
            found = visit(following)
            if found:
                return found
        way.pop()
        done.add(node)
        return None

    for start in sorted(edges):
        found = visit(start)
        if found:
            return found
    return None


def read():
    rooms = sources()
    files = {file: set(included(file, rooms)) for file in rooms}
    arrows = {}  # (from, to): the includes
    for file, targets in files.items():
        for target in targets:
            if rooms[file] != rooms[target]:
                arrows.setdefault((rooms[file], rooms[target]), []).append((file, target))
    return rooms, files, arrows


def level(file, order):
    """Where the folder of a file stands among those of its room."""
    folder = file.parent.name
    return order.index(folder) + 1 if folder in order else 0


def faults(rooms, files, arrows):
    name = lambda file: str(file.relative_to(PROJECT))
    for file, room in rooms.items():
        if room not in ALLOWED:
            yield f"{name(file)} is in a room that {name(pathlib.Path(__file__).resolve())} doesn't know: {room}"
    for (start, end), includes in sorted(arrows.items()):
        if end not in ALLOWED.get(start, ()):
            file, target = min(includes)
            yield (f"{start} may not include {end}, but {name(file)} includes {name(target)}"
                   + (f" and {len(includes) - 1} more do" if len(includes) > 1 else ""))
    for file in sorted(files):
        order = FOLDERS.get(rooms[file], ())
        for target in sorted(files[file]):
            if order and rooms[target] == rooms[file] and level(file, order) < level(target, order):
                yield f"{file.parent.name} comes before {target.parent.name}, but {name(file)} includes {name(target)}"
        if order and file.parent.name not in (*order, rooms[file]):
            yield f"{name(file)} is in a folder that {name(pathlib.Path(__file__).resolve())} doesn't know"
    for file in sorted(rooms):
        if PROJECT / "src" in file.parents and file != PER_THREAD and THREAD_LOCAL.search(file.read_text()):
            yield f"{name(file)} has a thread_local variable: {name(PER_THREAD)} is for these"
    found = circle({start: set(ends) for start, ends in ALLOWED.items()})
    if found:
        yield "the allowed arrows go in a circle: " + " -> ".join(found)
    found = circle(files)
    if found:
        yield "files include each other in a circle: " + " -> ".join(map(name, found))
    if not PICTURE.exists() or PICTURE.read_text() != picture(arrows):
        yield f"{name(PICTURE)} is out of date: run tests/rooms/rooms.py --draw"


def needed(arrows):
    """The arrows without those that follow from others."""
    edges = {}
    for start, end in arrows:
        edges.setdefault(start, set()).add(end)

    def reaches(start, end, without):
        seen, way = set(), [start]
        while way:
            room = way.pop()
            for step in edges.get(room, ()):
                if (room, step) != without and step not in seen:
                    seen.add(step)
                    way.append(step)
        return end in seen

    return sorted(arrow for arrow in arrows if not reaches(*arrow, arrow))


def picture(arrows):
    """Rooms as boxes, in rows: each above all that it includes. Arrows that follow from others are left out."""
    nodes = {room for arrow in arrows for room in arrow}
    ends = {room: {end for start, end in arrows if start == room} for room in nodes}

    def height(room, above=()):
        if room in above:
            return 0  # a circle is reported elsewhere
        return 1 + max((height(end, above + (room,)) for end in ends[room]), default=-1)

    rows = {}
    for room in sorted(nodes, key=lambda room: (list(ALLOWED).index(room) if room in ALLOWED else 99, room)):
        rows.setdefault(height(room), []).append(room)
    step_x, step_y, box = 116, 84, (96, 30)
    width = step_x * max(map(len, rows.values()), default=0) + 40 # rows are moved by 18 to either side
    top = max(rows, default=0)
    at = {}
    for row, here in rows.items():
        for k, room in enumerate(here):
            x = width / 2 + (k - (len(here) - 1) / 2) * step_x + (18 if row % 2 else -18)
            at[room] = (x, 30 + (top - row) * step_y)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{60 + top * step_y}" '
           f'viewBox="0 0 {width} {60 + top * step_y}" font-family="sans-serif" font-size="14">',
           '<style>text{fill:#222}rect{fill:#eef3fb;stroke:#4a6fa5}line{stroke:#888}'
           '@media (prefers-color-scheme:dark){text{fill:#ddd}rect{fill:#22304a;stroke:#8fb0e0}}</style>',
           '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" '
           'orient="auto"><path d="M0 0 8 4 0 8z" fill="#888"/></marker></defs>']
    for start, end in needed(arrows):
        (x0, y0), (x1, y1) = at[start], at[end]
        out.append(f'<line x1="{x0:g}" y1="{y0 + box[1] / 2:g}" x2="{x1:g}" y2="{y1 - box[1] / 2:g}" '
                   'marker-end="url(#tip)"/>')
    for room, (x, y) in at.items():
        label = "include/jostle" if room == "jostle" else room
        out.append(f'<rect x="{x - box[0] / 2:g}" y="{y - box[1] / 2:g}" width="{box[0]}" height="{box[1]}" rx="4"/>'
                   f'<text x="{x:g}" y="{y + 5:g}" text-anchor="middle">{label}</text>')
    return "\n".join(out) + "\n</svg>\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choice = parser.add_mutually_exclusive_group(required=True)
    for option in ("--check", "--draw", "--dot"):
        choice.add_argument(option, action="store_true")
    given = parser.parse_args()
    rooms, files, arrows = read()
    if given.draw:
        PICTURE.write_text(picture(arrows))
    elif given.dot:
        print("digraph rooms {")
        for (start, end), includes in sorted(arrows.items()):
            print(f'    "{start}" -> "{end}" [label={len(includes)}];')
        print("}")
    else:
        found = list(faults(rooms, files, arrows))
        print("\n".join(found) if found else f"{len(files)} files in {len(set(rooms.values()))} rooms, "
              f"{len(arrows)} arrows, no circle")
        return 1 if found else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
