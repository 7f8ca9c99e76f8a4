# SPDX-License-Identifier: MIT
"""Reads what `jostle bench --json` writes."""

import json
import sys

NUMBERS = ("n", "threads", "median_ms", "min_ms", "max_ms", "pairs")
# What a row measured; the rest of its fields say what came out.
KEY = ("system", "scene", "dim", "type", "n", "threads", "isa", "seed")


def fail(message):
    """The user's mistake: one line, exit 2."""
    print(f"{sys.argv[0].rsplit('/', 1)[-1]}: {message}", file=sys.stderr)
    sys.exit(2)


def read_rows(paths):
    """The rows of all files, as dicts; a row measured in several files counts as in the last."""
    rows = {}
    for path in paths:
        try:
            with open(path, encoding="utf-8") as file:
                content = json.load(file)
        except OSError as error:
            fail(f"{path}: {error.strerror}")
        except ValueError as error:
            fail(f"{path}: not JSON: {error}")
        if not isinstance(content, list):
            fail(f"{path}: wants an array of rows, as `jostle bench --json` writes")
        for number, row in enumerate(content, 1):
            if not isinstance(row, dict):
                fail(f"{path}: row {number} isn't an object")
            for field in ("system", "scene", "checksum"):
                if not isinstance(row.get(field), str):
                    fail(f'{path}: row {number} has no text "{field}"')
            for field in NUMBERS:
                if isinstance(row.get(field), bool) or not isinstance(row.get(field), (int, float)):
                    fail(f'{path}: row {number} has no number "{field}"')
            rows[key_of(row)] = row
    return list(rows.values())


def key_of(row):
    return tuple(row.get(field) for field in KEY)


def describe(row):
    extra = [str(row[field]) for field in ("dim", "type", "isa", "seed") if field in row]
    return f"{row['system']} {row['scene']} n={row['n']} threads={row['threads']} {' '.join(extra)}".strip()
