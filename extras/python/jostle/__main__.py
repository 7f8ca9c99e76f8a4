# SPDX-License-Identifier: MIT
"""python -m jostle FILE [-o OUT] [--stats]: the touching pairs of a file of boxes, as `jostle pairs` finds them.

FILE is CSV with the columns lo_x, lo_y, hi_x, hi_y (and lo_z, hi_z, and id), with names like xmin or minx, with sizes as x, y, w, h,
or without a line of names; or `-` for such from stdin, or a .npy array of shape (n, 2, d) or (n, 2 d). OUT ends in .csv, .npy or
.jsonl; without it the pairs go to stdout.
"""
from __future__ import annotations

import argparse
import csv
import io
import json
import os
import pathlib
import re
import sys
import tempfile
import time
from typing import Any

import numpy as np

import jostle
from jostle._tables import read_csv


def read(name: str) -> tuple[np.ndarray, list[str] | None]:
    if name.endswith(".npy"):
        return np.load(name, allow_pickle=False), None
    if name == "-":
        return read_csv(sys.stdin.read(), "stdin")
    return read_csv(pathlib.Path(name).read_text(encoding="utf-8"), name)


def is_whole(name: str) -> bool:
    return re.fullmatch(r"-?(0|[1-9]\d{0,14})", name) is not None and name != "-0"


def write(pairs: np.ndarray, ids: list[str] | None, out: Any, kind: str) -> None:
    if kind == "npy":
        if ids is not None:
            if not all(re.fullmatch(r"0|[1-9]\d{0,9}", name) and int(name) < 2**32 for name in ids):
                raise jostle.Error("ids must be whole numbers up to 4294967295 for .npy")
            pairs = np.array([int(name) for name in ids], np.uint32)[pairs].reshape(-1, 2)
        np.save(out, pairs)
        return
    text = io.TextIOWrapper(out, encoding="utf-8", newline="\n", write_through=True)
    if kind == "jsonl":
        names: list[Any] = list(range(int(pairs.max()) + 1 if len(pairs) else 0)) if ids is None else list(ids)
        if ids is not None and all(map(is_whole, ids)):
            names = [int(name) for name in ids]
        text.writelines(json.dumps({"a": names[a], "b": names[b]}, separators=(",", ":"), ensure_ascii=False) + "\n"
                        for a, b in pairs.tolist())
    else:
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["a", "b"])
        writer.writerows(pairs.tolist() if ids is None else ([ids[a], ids[b]] for a, b in pairs.tolist()))
    text.flush()
    text.detach()


def write_file(pairs: np.ndarray, ids: list[str] | None, name: str) -> None:
    """Complete or not at all."""
    kind = name.rpartition(".")[2].replace("ndjson", "jsonl")
    if kind not in ("csv", "npy", "jsonl"):
        raise jostle.Error(f"{name}: a file of pairs ends in .csv, .npy or .jsonl")
    handle, part = tempfile.mkstemp(prefix=pathlib.Path(name).name + ".", suffix=".part", dir=pathlib.Path(name).parent)
    try:
        with os.fdopen(handle, "wb") as out:
            write(pairs, ids, out, kind)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(part, 0o666 & ~mask)
        os.replace(part, name)
    except BaseException:
        os.unlink(part)
        raise


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m jostle", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", metavar="FILE")
    parser.add_argument("-o", metavar="OUT", dest="out")
    parser.add_argument("--stats", action="store_true", help="one JSON object on stdout")
    parser.add_argument("--version", action="version", version=jostle.__version__)
    given = parser.parse_args(arguments)
    try:
        started = time.perf_counter()
        boxes, ids = read(given.file)
        found_from = time.perf_counter()
        pairs = jostle.find_pairs(boxes, order="sorted")
        written_from = time.perf_counter()
        if given.out:
            write_file(pairs, ids, given.out)
        elif not given.stats:
            write(pairs, ids, sys.stdout.buffer, "csv")
        if given.stats:
            ms = {"read": found_from - started, "find": written_from - found_from, "write": time.perf_counter() - written_from}
            print(json.dumps({"objects": len(boxes), "pairs": len(pairs),
                              "ms": {name: round(1000 * seconds, 3) for name, seconds in ms.items()}}))
    except (OSError, ValueError, EOFError, csv.Error) as wrong:
        told = isinstance(wrong, OSError) or getattr(wrong, "status", "") == "bad_file"  # which file
        named = "" if told else f"{given.file}: "
        print(f"jostle: {named}{wrong}", file=sys.stderr)
        return 2  # as the command jostle does; 1 would be our fault
    return 0


if __name__ == "__main__":
    sys.exit(main())
