#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""coverage.py [BUILD]   says which lines and branches of src/ and include/ no test has run in a build with the preset coverage

BUILD is build/coverage if not given. Counts are clang's, of the source: each condition is a branch with two sides, true and
false, also where && and || join some. Templates and inlined functions are compiled many times: a line has run, and a side of a
branch was taken, if that is so in any copy. A condition that is a constant in one copy isn't a branch there.
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

PROJECT = pathlib.Path(__file__).resolve().parent.parent


def programs_of(build):
    """All that the build has linked and that isn't CMake's."""
    for path in sorted(build.rglob("*")):
        if path.is_file() and os.access(path, os.X_OK) and "CMakeFiles" not in path.parts:
            with path.open("rb") as file:
                if file.read(4) == b"\x7fELF":
                    yield path


def counts_of(program, profile):
    """What llvm-cov tells of each file; nothing of what has no counts."""
    told = subprocess.run(["llvm-cov-19", "export", program, "--instr-profile", profile, "--skip-functions", "--skip-expansions",
                           "--num-threads=1", PROJECT / "src", PROJECT / "include"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False).stdout
    return json.loads(told)["data"][0]["files"] if told else []


def count_lines(segments, lines, name):
    """Adds to lines, by name and number, how often each line ran: as llvm-cov shows it. A segment is where another count begins."""
    by_line = collections.defaultdict(list)
    for line, _, count, has_count, is_entry, is_gap in segments:
        by_line[line].append((count, has_count, is_entry, is_gap))
    wrapped = None  # the segment that reaches into a line from those before
    for line in range(segments[0][0], segments[-1][0] + 1) if segments else ():
        here = by_line.get(line, [])
        begun = [count for count, has_count, is_entry, is_gap in here if has_count and is_entry and not is_gap]
        skipped = bool(here) and not here[0][1] and here[0][2]
        if (not skipped and (wrapped and wrapped[1] or begun)) or any(has_count and is_entry for _, has_count, is_entry, _ in here):
            lines[name, line] += max([wrapped[0] if wrapped else 0, *begun])
        if here:
            wrapped = here[-1]


def main():
    build = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else PROJECT / "build" / "coverage").resolve()
    raw = sorted((build / "counts").glob("*.profraw"))
    if not raw:
        sys.exit(f"{build} has no counts: cmake --preset coverage && cmake --build --preset coverage && ctest --preset coverage")
    profile = build / "counts" / "all.profdata"
    subprocess.run(["llvm-profdata-19", "merge", "--failure-mode=all", "-o", profile, *raw], check=True)
    lines = collections.Counter()
    branches = collections.defaultdict(lambda: [0, 0])  # by name and place: how often it was true and false
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for files in pool.map(lambda program: counts_of(program, profile), programs_of(build)):
            for file in files:
                path = pathlib.Path(os.path.normpath(build / file["filename"]))
                name = path.relative_to(PROJECT).as_posix() if path.is_relative_to(PROJECT) else ""
                if not name.startswith(("src/", "include/")):
                    continue
                count_lines(file["segments"], lines, name)
                for line, column, to_line, to_column, true, false, *_ in file["branches"]:
                    sides = branches[name, line, column, to_line, to_column]
                    sides[0] += true
                    sides[1] += false
    never = collections.defaultdict(list)
    for (name, line), count in lines.items():
        if count == 0:
            never[name].append((line, 0, "never run"))
    for (name, line, column, to_line, to_column), (true, false) in branches.items():
        if lines[name, line] != 0 and not (true and false):  # of a line that hasn't run, that is told already
            text = (PROJECT / name).read_text(encoding="utf-8").split("\n")[line - 1]
            condition = text[column - 1:to_column - 1 if to_line == line else None]
            never[name].append((line, column, f"never {'true' if not true else 'false'}: {condition}" if true or false else
                                f"never asked: {condition}"))
    for name, places in sorted(never.items(), key=lambda found: (-len(found[1]), found[0])):
        text = (PROJECT / name).read_text(encoding="utf-8").split("\n")
        print(f"{name}: {len(places)}")
        for line, _, what in sorted(places):
            print(f"{line:6} {what:40} | {text[line - 1].strip()}")
    ran, sides = sum(map(bool, lines.values())), [side for both in branches.values() for side in both]
    print(f"lines: {ran} of {len(lines)}, {100 * ran / len(lines):.1f} %\n"
          f"branches: {sum(map(bool, sides))} of {len(sides)}, {100 * sum(map(bool, sides)) / len(sides):.1f} %")


if __name__ == "__main__":
    main()
