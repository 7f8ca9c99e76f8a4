#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""coverage.py [BUILD]   says which lines of src/ and include/ no test has run in a build with the preset coverage

BUILD is build/coverage if not given. Templates and inlined functions are compiled many times: a line has run if any copy of it
has. Of a line's branches, those count that the compiler made in the copy of which most were taken; those taken by exceptions
don't count.
"""
import collections
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

PROJECT = pathlib.Path(__file__).resolve().parent.parent


def counts_of(file, build):
    told = subprocess.run(["gcov", "--branch-probabilities", "--json-format", "--stdout", str(file)], cwd=build,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True).stdout
    return [json.loads(line) for line in told.splitlines() if line.startswith(b"{")]


def main():
    build = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else PROJECT / "build" / "coverage").resolve()
    lines = collections.Counter()
    branches = collections.defaultdict(dict)  # by line: by their number, how often each was taken
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for documents in pool.map(lambda file: counts_of(file, build), build.rglob("*.gcda")):
            for document in documents:
                for file in document["files"]:
                    path = pathlib.Path(os.path.normpath(build / file["file"]))
                    name = path.relative_to(PROJECT).as_posix() if path.is_relative_to(PROJECT) else ""
                    if not name.startswith(("src/", "include/")):
                        continue
                    for line in file["lines"]:
                        place = name, line["line_number"]
                        lines[place] += line["count"]
                        taken = [branch["count"] for branch in line["branches"] if not branch["throw"]]
                        if len(taken) > 1:
                            before = branches[place].get(len(taken), [0] * len(taken))
                            branches[place][len(taken)] = [a + b for a, b in zip(before, taken)]
    if not lines:
        sys.exit(f"{build} has no counts: cmake --preset coverage && cmake --build --preset coverage && ctest --preset coverage")
    never = collections.defaultdict(list)
    for (name, line), count in sorted(lines.items()):
        if count == 0:
            never[name].append(line)
    for name, numbers in never.items():
        text = (PROJECT / name).read_text(encoding="utf-8").split("\n")
        print(name)
        for number in numbers:
            print(f"{number:6} {text[number - 1].strip()}")
    best = [max(copies.values(), key=lambda taken: (sum(map(bool, taken)) / len(taken), len(taken))) for copies in branches.values()]
    ran, all_ways = sum(map(bool, lines.values())), sum(all(taken) for taken in best)
    there, taken = sum(map(len, best)), sum(sum(map(bool, each)) for each in best)
    print(f"lines: {ran} of {len(lines)}, {100 * ran / len(lines):.1f} %\n"
          f"lines with branches that went all ways: {all_ways} of {len(best)}, {100 * all_ways / len(best):.1f} %\n"
          f"branches: {taken} of {there}, {100 * taken / there:.1f} %")


if __name__ == "__main__":
    main()
