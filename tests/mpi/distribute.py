#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""distribute.py JOSTLE: `jostle distribute` finds the pairs that `jostle bench` finds, and its rows have what they should."""
import json
import re
import subprocess
import sys


def rows_of(*words):
    result = subprocess.run([sys.argv[1], *words, "--json", "-"], capture_output=True, text=True, check=False)
    assert result.returncode == 0, f"{words}: {result.stderr}"
    return json.loads(result.stdout)


for scene, ranks in (("uniform", 2), ("resting", 3)):
    bench, = rows_of("bench", scene, "-n", "3000", "--frames", "2", "--threads", "1", "--seed", "7")
    rows = rows_of("distribute", scene, "-n", "3000", "--frames", "2", "--ranks", str(ranks), "--seed", "7")
    assert [row["system"] for row in rows] == ["jostle-mpi", "allgather", "slabs"], rows
    for row in rows:
        for field in ("scene", "n", "seed", "pairs", "checksum", "frames"):
            assert row[field] == bench[field], (field, row, bench)
        assert row["ranks"] == ranks and row["threads"] == 1 and row["bytes"] > 0 and row["median_ms"] > 0, row
    assert rows[0]["ghosts"] > 0 and rows[0]["imbalance"] >= 1, rows[0]
    divisions = rows[0]["divisions"]
    assert set(divisions) == {"times", "ms", "extra_ms", "partition_ms", "share"}, divisions
    assert divisions["times"] <= min(rows[0]["partitions"], 2), rows[0]
    assert set(rows[0]["stages"]) == {"stage", "partition", "search", "pairs", "wait"}, rows[0]
    # Messages are filled up to eight bytes.
    assert rows[0]["bytes"] == rows[0]["bytes"] // 8 * 8, rows[0]

counted = {(row["system"], row["ranks"]): row
           for row in rows_of("distribute", "uniform", "-n", "20000", "--predict", "1,8,64")}
assert counted["jostle-mpi-counted", 1]["ghosts"] == 0 and counted["slabs-counted", 1]["ghosts"] == 0
for ranks in (8, 64):
    ours, slabs = counted["jostle-mpi-counted", ranks], counted["slabs-counted", ranks]
    assert 0 < ours["ghosts"] < slabs["ghosts"] and 12 < ours["bytes_of_boxes"] / ours["ghosts"] < 18, (ours, slabs)
    assert 1 <= ours["imbalance"] < 1.5 and ours["most_neighbours"] < ranks, ours

result = subprocess.run([sys.argv[1], "distribute", "nowhere"], capture_output=True, text=True, check=False)
assert result.returncode == 2 and "nowhere" in result.stderr and "internal" not in result.stderr, result
help_text = subprocess.run([sys.argv[1], "distribute", "--help"], capture_output=True, text=True, check=True).stdout
examples = re.findall(r"^ *jostle distribute (\S+) -n", help_text, re.MULTILINE)
assert len(examples) == 2, help_text
for scene in examples:
    rows_of("distribute", scene, "-n", "1000", "--predict", "2")
print("the same pairs")
