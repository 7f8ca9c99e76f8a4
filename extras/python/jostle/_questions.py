# SPDX-License-Identifier: MIT
"""Queries about boxes."""
from __future__ import annotations

from typing import Any, Callable, Sequence, Union

import numpy as np

from . import _arrays, _core
from ._errors import Error

ALL = 2**64 - 1


class Questions:
    """Many queries of one kind, made by rays, sweeps, overlapping, spheres, frustums, nearest or nearest_to_boxes.

    Their numbers are rounded to the dtype of the boxes when they are used, but not those of overlapping(), which must have it: an
    array of float64 isn't taken by an index or world of float32. One row, or one number, applies to all queries.
    """

    def __init__(self, kind: int, columns: Sequence[Any], planes: Sequence[Any] = (), count: int = 1) -> None:
        self._kind, self._columns, self._planes, self._count = kind, columns, planes, count

    def _numbers(self, dim: int, dtype: np.dtype) -> np.ndarray:
        """One row for each query."""
        if self._kind == 5:
            return np.empty((0, 0), dtype)
        parts = []
        for name, column, width in zip(PARTS[self._kind], self._columns, self._widths(dim)):
            if width == 1:
                part = _arrays.numbers(column, name).astype(dtype)
            else:
                part = _arrays.floats(column, name, dtype if self._kind == 3 else None).astype(dtype, copy=False)
            shape = part.shape
            if width == 1 and part.ndim < 2:
                part = part.reshape(-1, 1)
            elif part.ndim == 3 or part.ndim == 2 and part.shape == (2, dim) and width == 2 * dim:
                part = part.reshape(-1, width) if part.shape[-2:] == (2, dim) else part
            elif part.ndim == 1:
                part = part.reshape(1, -1)
            if part.ndim != 2 or part.shape[1] != width:
                raise Error(f"{KINDS[self._kind]}: {name} has the shape {shape}: among boxes in {dim}D it must be (n, {width})")
            parts.append(part)
        n = 0 if any(len(part) == 0 for part in parts) else max(len(part) for part in parts)
        wrong = [len(part) for part in parts if len(part) not in (1, n)]
        if wrong:
            raise Error(f"{KINDS[self._kind]}: {', '.join(PARTS[self._kind])} must have as many rows as each other, or one; they have {wrong[0]} "
                        f"and {n}", None, "size_mismatch")
        full = [np.broadcast_to(part, (n, part.shape[1])) for part in parts]
        return np.ascontiguousarray(np.concatenate(full, axis=1))

    def _packed(self, dim: int, dtype: np.dtype) -> _core.Questions:
        planes = [np.ascontiguousarray(_arrays.floats(one, "planes").astype(dtype)) for one in self._planes]
        return _core.Questions(self._kind, self._numbers(dim, dtype), _arrays.SPACES[dim, dtype], planes, self._count)

    def _widths(self, dim: int) -> tuple[int, ...]:
        return {1: (dim, dim, 1), 2: (2 * dim, dim, 1), 3: (2 * dim,), 4: (dim, 1), 6: (dim, 1), 7: (2 * dim, 1)}[self._kind]


def rays(origins: Any, directions: Any, max_fraction: Any = np.inf) -> Questions:
    """The points origin + f * direction for 0 <= f <= max_fraction: (n, d), (n, d) or (d,), (n,) or one number."""
    return Questions(1, (origins, directions, max_fraction))


def sweeps(boxes: Any, motions: Any, max_fraction: Any = 1.0) -> Questions:
    """Boxes that move by f * motion for 0 <= f <= max_fraction."""
    return Questions(2, (boxes, motions, max_fraction))


def overlapping(boxes: Any) -> Questions:
    """Finds what touches each of these boxes."""
    return Questions(3, (boxes,))


def spheres(centers: Any, radii: Any) -> Questions:
    """Finds what is no further than the radius from each centre."""
    return Questions(4, (centers, radii))


def frustums(planes: Sequence[Any]) -> Questions:
    """Regions bounded by planes: each is an array (k, d + 1) of normals and offsets; inside is where normal . p + offset >= 0.
    A single such array is one region."""
    if isinstance(planes, (list, tuple)):
        return Questions(5, (), planes)
    given = _arrays.array(planes)
    return Questions(5, (), [given] if given.ndim == 2 else list(given) if given.ndim else list(planes))


def nearest(points: Any, count: int = 1, max_distance: Any = np.inf) -> Questions:
    """The `count` boxes that are nearest to each point."""
    return Questions(6, (points, max_distance), count=_arrays.whole(count, "count"))


def nearest_to_boxes(boxes: Any, count: int = 1, max_distance: Any = np.inf) -> Questions:
    """The `count` boxes that are nearest to each of these boxes; one that touches it is at distance 0."""
    return Questions(7, (boxes, max_distance), count=_arrays.whole(count, "count"))


Asker = Sequence[int]
AcceptAnswer = Callable[[int, int], bool]
Exclude = Union[int, Sequence[int], np.ndarray, None]  # one id for all queries, or one for each


def asking(asker: Asker | None, exclude: Any, accept: AcceptAnswer | None, category: Any = None, mask: Any = None,
           owner: Any = None) -> _core.AskFilter:
    if asker is not None:
        numbers: list[Any] = list(asker) if isinstance(asker, (list, tuple)) else _arrays.integers(asker, "asker", np.uint32).tolist()
        if len(numbers) not in (2, 3):
            raise Error(f"asker is {asker!r}: it must be (category, mask) or (category, mask, owner)")
        asker = tuple(_arrays.whole(one, "asker") for one in (*numbers, 2**32 - 1)[:3])
    one = exclude is None or _arrays.array(exclude).ndim == 0
    return _core.AskFilter(_arrays.optional_integers(category, "category"), _arrays.optional_integers(mask, "mask"),
                           _arrays.optional_integers(owner, "owner"), asker,
                           None if exclude is None or not one else _arrays.whole(exclude, "exclude", 2**64),
                           None if one else _arrays.packed(exclude, "exclude", np.uint64),
                           _arrays.function(accept, "accept"))


def limit(max_results: int | None) -> int:
    return ALL if max_results is None else _arrays.whole(max_results, "max_results", 2**64)


PARTS = {1: ("origins", "directions", "max_fraction"), 2: ("boxes", "motions", "max_fraction"), 3: ("boxes",),
         4: ("centers", "radii"), 6: ("points", "max_distance"), 7: ("boxes", "max_distance")}
KINDS = {1: "rays", 2: "sweeps", 3: "overlapping", 4: "spheres", 5: "frustums", 6: "nearest", 7: "nearest_to_boxes"}
LINES = (1, 2)
NOT_NEAREST = (1, 2, 3, 4, 5)


def question(asked: Any, takes: Sequence[int] = tuple(KINDS)) -> Questions:
    """The queries, or those for what overlaps boxes; they must be of one of the kinds."""
    given = asked if isinstance(asked, Questions) else overlapping(asked)
    if given._kind not in takes:
        raise Error(f"the queries are of the kind {KINDS[given._kind]}: this call takes {', '.join(KINDS[kind] for kind in takes)}")
    return given
