#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Generates Jostle as two files, compiles them and runs strangers with them.

    check.py PART FOLDER --compiler C++ [--flag FLAG...] [--run EMULATOR...] [--transitions]

What the stranger prints is what tests/platforms/golden/table.txt has about the part. No warning is let pass.
"""

import argparse
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parent.parent
KINDS = {"pairs": ("pairs_",), "world": ("pairs_", "events_"), "all": ("pairs_", "events_", "bodies_")}
WARNINGS = ("-Wall", "-Wextra", "-Werror")


def run(*command, **options):
    print(" ".join(map(str, command)), flush=True)
    return subprocess.run(list(map(str, command)), check=True, text=True, **options)


def write_folder_of_headers(folder, part):
    """A folder where each of Jostle's headers is the generated one, for sources that include them by name."""
    (folder / "jostle").mkdir(parents=True, exist_ok=True)
    for header in (PROJECT / "include" / "jostle").glob("*.h*"):
        generated = "jostle.h" if header.suffix == ".h" else f"jostle_{part}.hpp"
        (folder / "jostle" / header.name).write_text(f'#include "../../{generated}"\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=KINDS)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--compiler", default="c++")
    parser.add_argument("--flag", action="append", default=[])
    parser.add_argument("--link", action="append", default=[])
    parser.add_argument("--run", action="append", default=[])
    parser.add_argument("--transitions", action="store_true", help="look at calls between AVX and SSE as well")
    given = parser.parse_args()
    folder, part, flags = given.folder, given.part, given.flag
    run(sys.executable, "-B", PROJECT / "packaging" / "amalgamate", part, "--to", folder)
    headers = folder / "headers"
    write_folder_of_headers(headers, part)

    def compile_file(source, *options):
        target = folder / f"{source.parent.name}_{source.stem}.o"
        run(given.compiler, "-std=c++20", "-O2", *WARNINGS, *flags, *options, "-c", source, "-o", target)
        return target

    generated = compile_file(folder / f"jostle_{part}.cpp")
    # The stranger's own code: numbers that it computes are to be the same from every compiler, too.
    includes = ("-I", headers, "-I", HERE.parent / "platforms", "-I", PROJECT, "-ffp-contract=off")
    sources = [HERE / "stranger.cpp", PROJECT / "tool" / "scenes" / "scenes.cpp"]
    objects = [generated, *(compile_file(source, *includes, f'-DJOSTLE_HEADER="{folder}/jostle_{part}.hpp"')
                            for source in sources)]
    if part == "all":
        objects += [compile_file(source, *includes, "-I", PROJECT / "src", "-Wno-psabi")
                    for source in sorted((PROJECT / "tool" / "simulation").glob("*.cpp"))]
    ending = {"em++": ".js", "mingw": ".exe"}
    stranger = folder / ("stranger" + "".join(each for kind, each in ending.items() if kind in given.compiler))
    run(given.compiler, *flags, *objects, "-o", stranger, *given.link)
    printed = run(*given.run, stranger, stdout=subprocess.PIPE).stdout.split("\n")
    table = (HERE.parent / "platforms" / "golden" / "table.txt").read_text().split("\n")
    expected = [line for line in table if line.startswith(KINDS[part])]
    if [line.strip() for line in printed if line] != expected:
        sys.exit("\n".join(["these lines aren't those of the table:", *sorted(set(printed) - set(expected))]))
    print(f"\n{len(expected)} lines as in the table")
    if given.transitions:
        run(sys.executable, "-B", HERE.parent / "kernels" / "transitions.py", stranger)
    if part == "all":
        in_c = folder / "stranger_in_c.o"
        run("cc", "-std=c99", "-pedantic", *WARNINGS, "-I", headers, "-c",
            HERE.parent / "consume" / "project_c" / "stranger.c", "-o", in_c)
        without = compile_file(HERE / "without_exceptions.cpp", "-fno-exceptions", "-fno-rtti", "-I", folder)
        for each in (in_c, without):
            run(given.compiler, each, generated, "-o", folder / each.stem, *given.link)
            run(folder / each.stem)


if __name__ == "__main__":
    main()
