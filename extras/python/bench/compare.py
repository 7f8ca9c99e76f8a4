#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What find_pairs, join and BoxIndex take beside what people use in Python today, on the same data, in one run.

    apt install python3-scipy python3-shapely python3-rtree; python3 compare.py [--threads N]

Each takes the least time of some repetitions; all of them have to find the same number of pairs. What is counted is all that it
takes from arrays to an array of pairs, building a tree included.
"""
import argparse
import time

import numpy as np
import rtree.index
import shapely.geometry
import shapely.strtree
from scipy.spatial import cKDTree

import jostle


def least(call, seconds=3.0):
    """The least time of as many calls as fit into so many seconds, and what the last one returned."""
    best, spent = np.inf, 0.0
    while spent < seconds:
        begin = time.perf_counter()
        result = call()
        took = time.perf_counter() - begin
        best, spent = min(best, took), spent + took
    return best, result


def with_rtree(boxes):
    n, _, dim = boxes.shape
    properties = rtree.index.Property(dimension=dim)
    rows = boxes.reshape(n, -1).tolist()
    tree = rtree.index.Index(((i, row, None) for i, row in enumerate(rows)), properties=properties)
    return [(i, k) for i, row in enumerate(rows) for k in tree.intersection(row) if i < k]


def with_strtree(boxes):
    shapes = [shapely.geometry.box(*row) for row in boxes.reshape(len(boxes), -1).tolist()]
    number = {id(shape): i for i, shape in enumerate(shapes)}
    tree = shapely.strtree.STRtree(shapes)
    return [(i, k) for i, shape in enumerate(shapes) for k in (number[id(found)] for found in tree.query(shape)) if i < k]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=0, help="of Jostle's; the others have one")
    threads = parser.parse_args().threads
    rng = np.random.default_rng(1)
    print("| work | pairs | jostle | other | times |\n|---|---|---|---|---|")

    def row(work, count, ours, name, others):
        print(f"| {work} | {count:,} | {1000 * ours:,.1f} ms | {name} {1000 * others:,.0f} ms | {others / ours:.0f}x |", flush=True)

    for n, dim, radius in ((1_000_000, 3, 0.006), (1_000_000, 2, 0.0008), (100_000, 3, 0.02)):
        points = rng.random((n, dim))
        others, expected = least(lambda: cKDTree(points).query_pairs(radius, output_type="ndarray"))
        ours, found = least(lambda: jostle.join(points, radius / 2, threads=threads))
        assert abs(len(found) - len(expected)) <= 2, (len(found), len(expected))  # r against r/2 + r/2, rounded
        row(f"{n:,} points in {dim}D, pairs within a distance", len(found), ours, "SciPy `cKDTree.query_pairs`", others)
    for n, dim, size, peer, name in ((100_000, 2, 0.004, with_strtree, "shapely 1.8 `STRtree`"), (100_000, 2, 0.004, with_rtree, "Rtree"),
                                     (100_000, 3, 0.02, with_rtree, "Rtree")):
        boxes = rng.random((n, 2, dim))
        boxes[:, 1] = boxes[:, 0] + rng.random((n, dim)) * size
        others, expected = least(lambda: peer(boxes), 0.1)
        ours, found = least(lambda: jostle.find_pairs(boxes, threads=threads))
        assert len(found) == len(expected)
        row(f"{n:,} boxes in {dim}D, pairs that touch", len(found), ours, name, others)
    points, asked = rng.random((200_000, 3)), rng.random((200_000, 3))
    boxes = np.stack([points, points], axis=1)
    others, (distances, _) = least(lambda: cKDTree(points).query(asked, 8))
    ours, answers = least(lambda: jostle.BoxIndex(boxes, threads=threads).all(jostle.nearest(asked, 8)))
    assert np.allclose(answers.at.reshape(-1, 8), distances ** 2)
    row("200,000 points, the 8 nearest of 200,000 places", len(answers.ids), ours, "SciPy `cKDTree.query`", others)


if __name__ == "__main__":
    main()
