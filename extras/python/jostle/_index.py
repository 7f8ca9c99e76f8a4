# SPDX-License-Identifier: MIT
"""An index of boxes, and queries about them."""
from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _core, _shape_queries
from ._errors import Error
from ._lists import Answers, ClosePairs, Hits, ShapeHits
from ._questions import ALL, LINES, NOT_NEAREST, AcceptAnswer, Asker, Exclude, Questions, asking, limit, question
from ._shape_queries import ShapeSweeps
from ._shapes import Shapes
from ._visits import Visit, all_pairs, first_pairs


class BoxIndex:
    """An index of boxes, each with an id (a whole number that the caller chooses; keep them dense), which answers queries.

        index = jostle.BoxIndex(boxes)                      # box i has the id i
        index.first(jostle.rays(origins, directions))       # what each ray meets first
        index.all(jostle.nearest(points, 8))                # the eight nearest of each point

    dim and dtype are those of the boxes unless given. Several threads may make queries at the same time; make changes one at a time. A change while a query goes on, in its callback or another thread, is an Error.
    """

    def __init__(self, boxes: Any = None, ids: Any = None, *, dim: int | None = None, dtype: Any = None,
                 threads: int = 0) -> None:
        given = None if boxes is None else _arrays.boxes(boxes, dtype=dtype)
        self.dim = dim if dim is not None else 3 if given is None else _arrays.dim_of(given)
        self.dtype = np.dtype(np.float64 if given is None and dtype is None else dtype if given is None else given.dtype)
        if (self.dim, self.dtype) not in _arrays.SPACES:
            raise Error(f"an index is 2D or 3D, float32 or float64, not {self.dim}D {self.dtype}")
        self._index = _core.BoxIndex(_arrays.SPACES[self.dim, self.dtype], _arrays.threads(threads))
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
              asker: Asker | None = None, exclude: Exclude = None, accept: AcceptAnswer | None = None) -> Hits:
        """What each ray or sweep hits first."""
        ids, at = self._index.first(question(questions, LINES)._packed(self.dim, self.dtype),
                                    asking(asker, exclude, accept, category, mask, owner))
        at[ids == ALL] = np.inf
        return Hits(ids.view(np.int64), at)

    def all(self, questions: Any, max_results: int | None = None, *, category: Any = None, mask: Any = None, owner: Any = None,
            asker: Asker | None = None, exclude: Exclude = None, accept: AcceptAnswer | None = None) -> Answers:
        """All results of each query. If you pass boxes instead of queries, the results are the objects that touch them."""
        first, ids, at, more = self._index.all(question(questions)._packed(self.dim, self.dtype),
                                               asking(asker, exclude, accept, category, mask, owner),
                                               limit(max_results))
        return Answers(first, ids, at, more.astype(bool))

    def any(self, questions: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
            exclude: Exclude = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """Whether each query has any result: (n,) bool."""
        return self._index.any(question(questions, NOT_NEAREST)._packed(self.dim, self.dtype),
                               asking(asker, exclude, accept, category, mask, owner)).astype(bool)

    def count(self, questions: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
              exclude: Exclude = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """How many results each query has: (n,) uint64."""
        return self._index.count(question(questions, NOT_NEAREST)._packed(self.dim, self.dtype),
                                 asking(asker, exclude, accept, category, mask, owner))

    def visit(self, questions: Any, visit: Visit, *, chunk: int = 64, category: Any = None, mask: Any = None, owner: Any = None,
              asker: Asker | None = None, exclude: int | None = None, accept: AcceptAnswer | None = None) -> bool:
        """Calls visit(ids, at) with the answers to one query as they are found, `chunk` of them at a time. Rays, sweeps and nearest
        come ascending by (at, id), as in all(); regions in the index's own order, with at 0. visit returns None or True to go on, False
        to stop, or (not for regions) a number that no later `at` may exceed. The search goes no further than the chunk that it is
        in. Returns whether it was never stopped. visit may make queries; it must not change the index."""
        return self._index.visit(question(questions)._packed(self.dim, self.dtype),
                                 asking(asker, exclude, accept, category, mask, owner), visit, chunk)

    # Pairs of objects: of two of this index's, each pair once, ids ascending; or of one of this index's and one of another's.

    def pairs(self, other: BoxIndex | None = None) -> np.ndarray:
        """All pairs whose boxes touch: (m, 2) uint32, ids, in the index's own order, which depends on the calls that were made.
        For many objects that move, find_pairs costs less."""
        return all_pairs(lambda visit, chunk: self.visit_pairs(visit, other, chunk=chunk))

    def closest_pairs(self, count: int = 1, other: BoxIndex | None = None, *, max_distance: float = np.inf) -> ClosePairs:
        """The `count` pairs whose boxes are closest to each other, no further apart than max_distance. Those that touch come first, in
        the index's own order, the others ascending by (at, ids)."""
        return first_pairs(count, np.uint32, lambda visit, chunk: self.visit_closest_pairs(
            visit, other, max_distance=max_distance, chunk=chunk))

    def visit_pairs(self, visit: Visit, other: BoxIndex | None = None, *, chunk: int = 4096) -> bool:
        """Calls visit(pairs, at) with what pairs() returns, `chunk` of them at a time, in memory for that many: at is 0. visit returns
        None or True to go on, False to stop. Returns whether it was never stopped."""
        return self._index.visit_pairs(self._other(other), visit, chunk)

    def visit_closest_pairs(self, visit: Visit, other: BoxIndex | None = None, *, max_distance: float = np.inf,
                            chunk: int = 64) -> bool:
        """Calls visit(pairs, at) with pairs in the order of closest_pairs(), `chunk` of them at a time. Besides None, True and False, as
        for visit(), it may return a squared distance that no later pair may exceed: the least that it has found between the
        shapes of a pair ends the search for the closest shapes. visit must not change the indexes."""
        return self._index.visit_closest_pairs(self._other(other), max_distance, visit, chunk)

    def _other(self, other: BoxIndex | None) -> _core.BoxIndex | None:
        if other is None:
            return None
        if not isinstance(other, BoxIndex):
            raise Error(f"other is of the type {type(other).__name__}: it must be a BoxIndex")
        return other._index

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
                                       limit(max_results),
                                       asking(asker, exclude, accept, category, mask, owner))

    def nearest_shapes(self, near: Shapes, near_poses: Any, shapes: Shapes, poses: Any, max_distances: Any = np.inf, *,
                       category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                       exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """The shape nearest to each of `near`, which needn't be in the index: a structured array of id, distance (infinite where
        none is within max_distances), normal, from_a, from_b; a is the shape of `near`."""
        return _shape_queries.nearest_shapes(self._index, self.dim, self.dtype, near, near_poses, shapes, poses, max_distances,
                                             asking(asker, exclude, accept, category, mask, owner))

    def __copy__(self) -> BoxIndex:
        raise TypeError("a BoxIndex can't be copied: build another one of the same boxes")

    def __repr__(self) -> str:
        return f"BoxIndex({len(self)} boxes, {self.dim}D {self.dtype})"

    def _repr_html_(self) -> str:
        return _arrays.table(repr(self), self.stats())
