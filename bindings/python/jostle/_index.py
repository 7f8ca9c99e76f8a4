# SPDX-License-Identifier: MIT
"""An index of boxes, and queries about them."""
from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _core, _shape_queries
from ._errors import Error
from ._lists import Answers, Hits, ShapeHits
from ._questions import ALL, AcceptAnswer, Asker, Questions, asking, question
from ._shape_queries import ShapeSweeps
from ._shapes import Shapes


class BoxIndex:
    """An index of boxes, each with an id (a whole number that the caller chooses; keep them dense), which answers queries.

        index = jostle.BoxIndex(boxes)                      # box i has the id i
        index.first(jostle.rays(origins, directions))       # what each ray meets first
        index.all(jostle.nearest(points, 8))                # the eight nearest of each point

    dim and dtype are those of the boxes unless given. Several threads may make queries at the same time; make changes one at a time.
    """

    def __init__(self, boxes: Any = None, ids: Any = None, *, dim: int | None = None, dtype: Any = None,
                 threads: int = 0) -> None:
        given = None if boxes is None else _arrays.boxes(boxes, dtype=dtype)
        self.dim = dim if dim is not None else 3 if given is None else _arrays.dim_of(given)
        self.dtype = np.dtype(np.float64 if given is None and dtype is None else dtype if given is None else given.dtype)
        if (self.dim, self.dtype) not in _arrays.SPACES:
            raise Error(f"an index is 2D or 3D, float32 or float64, not {self.dim}D {self.dtype}")
        self._index = _core.BoxIndex(_arrays.SPACES[self.dim, self.dtype], threads)
        if given is not None:
            self._index.build(None if ids is None else _arrays.packed(ids, "ids", np.uint32), given)

    def build(self, boxes: Any, ids: Any = None) -> None:
        """Removes everything and adds these boxes: box i gets ids[i], or i."""
        self._index.build(None if ids is None else _arrays.packed(ids, "ids", np.uint32),
                          _arrays.boxes(boxes, dtype=self.dtype))

    def insert(self, ids: Any, boxes: Any) -> None:
        """Adds objects. No id may exist already, or be given twice."""
        self._index.insert(_arrays.packed(ids, "ids", np.uint32), _arrays.boxes(boxes, dtype=self.dtype))

    def move(self, ids: Any, boxes: Any) -> None:
        """Gives objects new boxes."""
        self._index.move(_arrays.packed(ids, "ids", np.uint32), _arrays.boxes(boxes, dtype=self.dtype))

    def erase(self, ids: Any) -> None:
        """Removes objects."""
        self._index.erase(_arrays.packed(ids, "ids", np.uint32))

    def clear(self) -> None:
        """Removes all objects."""
        self._index.clear()

    def release_memory(self) -> None:
        """Gives back memory that isn't needed now."""
        self._index.release_memory()

    def __len__(self) -> int:
        return self._index.size()

    def __contains__(self, id: int) -> bool:
        return bool(self.contains([id])[0])

    def contains(self, ids: Any) -> np.ndarray:
        """Which of these ids exist: (n,) bool."""
        return self._index.contains(_arrays.packed(ids, "ids", np.uint32)).astype(bool)

    def boxes(self, ids: Any) -> np.ndarray:
        """The boxes of these ids: (n, 2, d)."""
        return self._index.boxes(_arrays.packed(ids, "ids", np.uint32))

    def stats(self) -> dict[str, int]:
        """What it is made of: objects, pages, leaves, nodes, depth, bytes, sorts, splits."""
        return self._index.stats()

    def join(self, boxes: Any) -> np.ndarray:
        """All pairs of one of `boxes` and an object that it touches: (m, 2) uint32, position and id, ascending."""
        return self._index.join(_arrays.boxes(boxes, dtype=self.dtype))

    # What counts: category, mask and owner are one uint32 per id; `asker` is (category, mask) or (category, mask, owner).

    def first(self, questions: Questions, *, category: Any = None, mask: Any = None, owner: Any = None,
              asker: Asker | None = None, exclude: int | None = None, accept: AcceptAnswer | None = None) -> Hits:
        """What each ray or sweep hits first."""
        ids, at = self._index.first(question(questions)._packed(self.dim, self.dtype),
                                    asking(asker, exclude, accept, category, mask, owner))
        return Hits(ids.view(np.int64), at)

    def all(self, questions: Any, max_results: int | None = None, *, category: Any = None, mask: Any = None, owner: Any = None,
            asker: Asker | None = None, exclude: int | None = None, accept: AcceptAnswer | None = None) -> Answers:
        """All results of each query. If you pass boxes instead of queries, the results are the objects that touch them."""
        first, ids, at, more = self._index.all(question(questions)._packed(self.dim, self.dtype),
                                               asking(asker, exclude, accept, category, mask, owner),
                                               ALL if max_results is None else max_results)
        return Answers(first, ids, at, more.astype(bool))

    def any(self, questions: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
            exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """Whether each query has any result: (n,) bool."""
        return self._index.any(question(questions)._packed(self.dim, self.dtype),
                               asking(asker, exclude, accept, category, mask, owner)).astype(bool)

    def count(self, questions: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
              exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """How many results each query has: (n,) uint64."""
        return self._index.count(question(questions)._packed(self.dim, self.dtype),
                                 asking(asker, exclude, accept, category, mask, owner))

    # Against shapes: `shapes` and `poses` have a row for every id, and each shape lies in its box.

    def first_hits(self, casts: Questions | ShapeSweeps, shapes: Shapes, poses: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                   exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """The shape that each ray, or each moving shape, hits first: a structured array of id (-1 where there is
        none), fraction (infinite there), normal, point (relative to the object's position), part, moving_part."""
        return _shape_queries.first_hits(self._index, self.dim, self.dtype, casts, shapes, poses,
                                         asking(asker, exclude, accept, category, mask, owner))

    def all_hits(self, casts: Questions | ShapeSweeps, shapes: Shapes, poses: Any, max_results: int | None = None, *,
                 category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                 exclude: int | None = None, accept: AcceptAnswer | None = None) -> ShapeHits:
        """All shapes that each of them hits, nearest first."""
        return _shape_queries.all_hits(self._index, self.dim, self.dtype, casts, shapes, poses,
                                       ALL if max_results is None else max_results,
                                       asking(asker, exclude, accept, category, mask, owner))

    def nearest_shapes(self, near: Shapes, near_poses: Any, shapes: Shapes, poses: Any, max_distances: Any = np.inf, *,
                       category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                       exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """The shape nearest to each of `near`, which needn't be in the index: a structured array of id, distance (infinite where
        none is within max_distances), normal, point_a, point_b; a is the shape of `near`."""
        return _shape_queries.nearest_shapes(self._index, self.dim, self.dtype, near, near_poses, shapes, poses, max_distances,
                                             asking(asker, exclude, accept, category, mask, owner))

    def __repr__(self) -> str:
        return f"BoxIndex({len(self)} boxes, {self.dim}D {self.dtype})"

    def _repr_html_(self) -> str:
        return _arrays.table(repr(self), self.stats())
