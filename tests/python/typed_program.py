# SPDX-License-Identifier: MIT
"""What a type checker knows of the package: this is checked, not run."""
import numpy as np

import jostle


def use(boxes: np.ndarray) -> int:
    pairs: np.ndarray = jostle.find_pairs(boxes, order="sorted")
    for part in jostle.iter_pairs(boxes, chunk=1000):
        part.sum()
    i, j = jostle.neighbors(boxes[:, 0], 1.0, periodic=False)
    searched: bool = jostle.NeighborFinder(skin=0.1).searched
    jostle.neighbors(boxes[:, 0], 1.0, half=True)  # type: ignore[call-arg]
    cloth = jostle.Surface([[0, 1, 2], [3, 4, 5]], points=[7])
    near: jostle.NearSurface = jostle.SurfaceFinder().near(cloth, boxes[:8, 0], 0.1)
    near.vertex_triangle["distance"].min()
    safe: float = jostle.SurfaceFinder(threads=1).moving(cloth, boxes[:8, 0], boxes[:8, 1]).safe_step
    jostle.SurfaceFinder().crossings(cloth, boxes[:8, 0], rest=boxes)  # type: ignore[call-arg]
    listed: jostle.ase.NeighborList = jostle.ase.NeighborList([1.0], self_interaction=False)
    world = jostle.World(3, np.float32)
    ids: np.ndarray = world.add(boxes)
    world.update(ids, boxes)
    reasons: np.ndarray = world.ended().reasons
    other: jostle.World = world.fork()
    hits: jostle.Hits = jostle.BoxIndex(boxes).first(jostle.rays([[0, 0, 0]], [1, 0, 0]))
    close: jostle.ClosePairs = jostle.BoxIndex(boxes).closest_pairs(3, max_distance=2)
    stopped: bool = world.visit(jostle.nearest_to_boxes(boxes, 5), lambda ids, at: at[-1] < 3)
    world.visit("everything")  # type: ignore[call-arg]
    shapes: jostle.Shapes = jostle.Shapes.same(jostle.sphere(1.0), 5)
    try:
        jostle.contacts(shapes, jostle.poses(boxes[:, 0]), pairs)
    except jostle.Error as error:
        index: int | None = error.index
        return index or 0
    jostle.find_pairs(boxes, accept=lambda a, b: a < b)
    jostle.find_pairs(boxes, ordered=True)  # type: ignore[call-arg]
    world.save().frobnicate()  # type: ignore[attr-defined]
    return len(other) + len(hits.ids) + len(reasons) + len(close.at) + stopped + searched + len(i) + listed.nupdates
