# SPDX-License-Identifier: MIT
"""An index of boxes, and queries about them."""
from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _core
from ._errors import Error
from ._lists import ClosePairs
from ._queries import WHAT_COUNTS, Verbs
from ._visits import Visit, all_pairs, first_pairs


class BoxIndex(Verbs):
    __doc__ = """An index of boxes, each with an id (a whole number that the caller chooses; keep them dense), which answers queries.

        index = jostle.BoxIndex(boxes)                      # box i has the id i
        index.first(jostle.rays(origins, directions))       # what each ray meets first
        index.all(jostle.nearest(points, 8))                # the eight nearest of each point

    dim and dtype are those of the boxes unless given. Several threads may make queries at the same time; make changes one at a time. A change while a query goes on, in its callback or another thread, is an Error.""" + WHAT_COUNTS

    def __init__(self, boxes: Any = None, ids: Any = None, *, dim: int | None = None, dtype: Any = None,
                 threads: int = 0) -> None:
        given = None if boxes is None else _arrays.boxes(boxes, dtype=dtype)
        self.dim = dim if dim is not None else 3 if given is None else _arrays.dim_of(given)
        self.dtype = np.dtype(np.float64 if given is None and dtype is None else dtype if given is None else given.dtype)
        if (self.dim, self.dtype) not in _arrays.SPACES:
            raise Error(f"an index is 2D or 3D, float32 or float64, not {self.dim}D {self.dtype}")
        self._core = _core.BoxIndex(_arrays.SPACES[self.dim, self.dtype], _arrays.threads(threads))
        if given is not None:
            self._core.build(None if ids is None else _arrays.packed(ids, "ids", np.uint32), given)

    def build(self, boxes: Any, ids: Any = None) -> None:
        """Removes everything and adds these boxes: box i gets ids[i], or i."""
        self._core.build(None if ids is None else _arrays.packed(ids, "ids", np.uint32),
                          _arrays.boxes(boxes, dtype=self.dtype))

    def insert(self, ids: Any, boxes: Any) -> None:
        """Adds objects. No id may exist already, or be given twice."""
        self._core.insert(_arrays.packed(ids, "ids", np.uint32), _arrays.boxes(boxes, dtype=self.dtype))

    def move(self, ids: Any, boxes: Any) -> None:
        """Gives objects new boxes."""
        self._core.move(_arrays.packed(ids, "ids", np.uint32), _arrays.boxes(boxes, dtype=self.dtype))

    def erase(self, ids: Any) -> None:
        """Removes objects."""
        self._core.erase(_arrays.packed(ids, "ids", np.uint32))

    def clear(self) -> None:
        """Removes all objects."""
        self._core.clear()

    def release_memory(self) -> None:
        """Gives back memory that isn't needed now."""
        self._core.release_memory()

    def __len__(self) -> int:
        return self._core.size()

    def __contains__(self, id: int) -> bool:
        return bool(self.contains([id])[0])

    def contains(self, ids: Any) -> np.ndarray:
        """Which of these ids exist: (n,) bool."""
        return self._core.contains(_arrays.packed(ids, "ids", np.uint32)).astype(bool)

    def boxes(self, ids: Any) -> np.ndarray:
        """The boxes of these ids: (n, 2, d)."""
        return self._core.boxes(_arrays.packed(ids, "ids", np.uint32))

    def stats(self) -> dict[str, int]:
        """What it is made of: objects, pages, leaves, nodes, depth, bytes, sorts, splits."""
        return self._core.stats()

    def join(self, boxes: Any) -> np.ndarray:
        """All pairs of one of `boxes` and an object that it touches: (m, 2) uint32, position and id, ascending."""
        return self._core.join(_arrays.boxes(boxes, dtype=self.dtype))

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
        return self._core.visit_pairs(self._other(other), visit, chunk)

    def visit_closest_pairs(self, visit: Visit, other: BoxIndex | None = None, *, max_distance: float = np.inf,
                            chunk: int = 64) -> bool:
        """Calls visit(pairs, at) with pairs in the order of closest_pairs(), `chunk` of them at a time. Besides None, True and False, as
        for visit(), it may return a squared distance that no later pair may exceed: the least that it has found between the
        shapes of a pair ends the search for the closest shapes. visit must not change the indexes."""
        return self._core.visit_closest_pairs(self._other(other), max_distance, visit, chunk)

    def _other(self, other: BoxIndex | None) -> _core.BoxIndex | None:
        if other is None:
            return None
        if not isinstance(other, BoxIndex):
            raise Error(f"other is of the type {type(other).__name__}: it must be a BoxIndex")
        return other._core

    def __copy__(self) -> BoxIndex:
        raise TypeError("a BoxIndex can't be copied: build another one of the same boxes")

    def __repr__(self) -> str:
        return f"BoxIndex({len(self)} boxes, {self.dim}D {self.dtype})"

    def _repr_html_(self) -> str:
        return _arrays.table(repr(self), self.stats())
