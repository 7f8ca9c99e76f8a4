#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""rooms.py --check finds what it is for."""

import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PROJECT = HERE.parent.parent
PARTS = ("src", "include", "bench", "tool", "extras", "examples", "docs/images",
         "tests/rooms")


def check(change):
    """What --check says of a copy of the project that `change` was made to."""
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder)
        for part in PARTS:
            # The Rust crate has a link to src/.
            shutil.copytree(PROJECT / part, copy / part, symlinks=True, ignore=shutil.ignore_patterns("node_modules"))
        change(copy)
        run = subprocess.run([sys.executable, "-B", copy / "tests" / "rooms" / "rooms.py", "--check"],
                             capture_output=True, text=True)
        return run.returncode, run.stdout


def add(file, line):
    def change(copy):
        path = copy / file
        path.parent.mkdir(exist_ok=True)
        path.write_text(line + "\n" + (path.read_text() if path.exists() else ""))
    return change


def redraw(change):
    def both(copy):
        change(copy)
        subprocess.run([sys.executable, "-B", copy / "tests" / "rooms" / "rooms.py", "--draw"], check=True)
    return both


CASES = [
    (lambda copy: None, 0, "no circle"),
    (add("src/base/box.hpp", '#include "engine/engine.hpp"'), 1, "base may not include engine"),
    (add("include/jostle/box.hpp", '#include "base/box.hpp"'), 1, "jostle may not include base"),
    (add("examples/filters.cpp", '#include "base/box.hpp"'), 1, "examples may not include base"),
    (add("src/index/tree/pool.hpp", '#include "index/tree/tree.hpp"'), 1, "files include each other in a circle"),
    (add("include/jostle/version.hpp", "#include <jostle/jostle.hpp>"), 1, "files include each other in a circle"),
    (add("src/narrow/convex/gjk.hpp", '#include "narrow/parts/part.hpp"'), 1, "convex comes before parts"),
    (add("src/world/objects/ids.hpp", '#include "world/update/arena.hpp"'), 1, "objects comes before update"),
    (add("src/world/update/in_runs.hpp", '#include "world/implementation.hpp"'), 1, "update comes before world"),
    (add("src/world/implementation.hpp", '#include "world/saved/snapshot_bytes.hpp"'), 1, "world comes before saved"),
    (add("src/index/nodes/key.hpp", '#include "index/tree/pool.hpp"'), 1, "nodes comes before tree"),
    (add("src/index/queries/check.hpp", '#include "index/box_index_access.hpp"'), 1, "queries comes before index"),
    (add("src/narrow/attic/old.hpp", ""), 1, "src/narrow/attic/old.hpp is in a folder that"),
    (add("src/attic/old.hpp", ""), 1, "src/attic/old.hpp is in a room that"),
    (add("src/loose.hpp", ""), 1, "no room"),
    (add("src/engine/slot.hpp", "inline thread_local int depth = 0;"), 1, "slot.hpp has a thread_local variable"),
    (add("src/engine/slot.hpp", "// not thread_local"), 0, "no circle"),
    (add("docs/images/rooms.svg", ""), 1, "out of date"),
    (redraw(add("docs/images/rooms.svg", "")), 0, "no circle"),
]

failed = 0
for change, expected, text in CASES:
    code, said = check(change)
    if code != expected or text not in said:
        print(f"expected {expected} and '{text}', got {code}: {said}")
        failed += 1
sys.exit(1 if failed else 0)
