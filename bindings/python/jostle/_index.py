# SPDX-License-Identifier: MIT
"""Boxes that stay, and questions about them."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Iterator, NamedTuple, Sequence

import numpy as np

from . import _arrays, _core, _shape_queries
from ._errors import Error
from ._shape_queries import ShapeHits, ShapeSweeps

if TYPE_CHECKING:
    from ._contacts import Shapes

ALL = 2**64 - 1


class Questions:
    """Many questions of one kind: made by rays, sweeps, overlapping, spheres, frustums and nearest.

    Where they are asked their numbers are rounded to the dtype of the boxes. One row, or one number, stands for all.
    """

    def __init__(self, kind: int, columns: Sequence[Any], planes: Sequence[Any] = (), count: int = 1) -> None:
        self._kind, self._columns, self._planes, self._count = kind, columns, planes, count

    def _numbers(self, dim: int, dtype: np.dtype) -> np.ndarray:
        """One row for each question."""
        if self._planes:
            return np.empty((0, 0), dtype)
        parts = []
        for column, width in zip(self._columns, self._widths(dim)):
            part = _arrays.floats(np.array(column, np.float64) if np.isscalar(column) else column, "a question").astype(dtype)
            if width == 1 and part.ndim < 2:
                part = part.reshape(-1, 1)
            elif part.ndim == 3 or part.ndim == 2 and part.shape == (2, dim) and width == 2 * dim:
                part = part.reshape(-1, width) if part.shape[-2:] == (2, dim) else part
            elif part.ndim == 1:
                part = part.reshape(1, -1)
            if part.ndim != 2 or part.shape[1] != width:
                raise Error(f"a part of the questions has the shape {part.shape}: it must be (n, {width})")
            parts.append(part)
        n = 0 if any(len(part) == 0 for part in parts) else max(len(part) for part in parts)
        wrong = [len(part) for part in parts if len(part) not in (1, n)]
        if wrong:
            raise Error(f"the parts of the questions have {wrong[0]} and {n} rows", None, "size_mismatch")
        full = [np.broadcast_to(part, (n, part.shape[1])) for part in parts]
        return np.ascontiguousarray(np.concatenate(full, axis=1))

    def _packed(self, dim: int, dtype: np.dtype) -> _core.Questions:
        planes = [np.ascontiguousarray(_arrays.floats(one, "planes").astype(dtype)) for one in self._planes]
        return _core.Questions(self._kind, self._numbers(dim, dtype), _arrays.SPACES[dim, dtype], planes, self._count)

    def _widths(self, dim: int) -> tuple[int, ...]:
        return {1: (dim, dim, 1), 2: (2 * dim, dim, 1), 3: (2 * dim,), 4: (dim, 1), 6: (dim, 1)}[self._kind]


def rays(origins: Any, directions: Any, max_fraction: Any = np.inf) -> Questions:
    """The points origin + f * direction for 0 <= f <= max_fraction: (n, d), (n, d) or (d,), (n,) or one number."""
    return Questions(1, (origins, directions, max_fraction))


def sweeps(boxes: Any, motions: Any, max_fraction: Any = 1.0) -> Questions:
    """Boxes that move by f * motion for 0 <= f <= max_fraction."""
    return Questions(2, (boxes, motions, max_fraction))


def overlapping(boxes: Any) -> Questions:
    """What touches each of these boxes."""
    return Questions(3, (boxes,))


def spheres(centers: Any, radii: Any) -> Questions:
    """What is no further than the radius from the centre."""
    return Questions(4, (centers, radii))


def frustums(planes: Sequence[Any]) -> Questions:
    """The spaces inside planes: each an array (k, d + 1) of normal and offset, inside where normal . p + offset >= 0."""
    return Questions(5, (), list(planes))


def nearest(points: Any, count: int = 1, max_distance: Any = np.inf) -> Questions:
    """The `count` boxes that are nearest to each point."""
    return Questions(6, (points, max_distance), count=count)


class Hits(NamedTuple):
    """One answer per question."""

    ids: np.ndarray  #: of an index int64, -1 where there is none; of a world uint64, 0 where there is none
    at: np.ndarray  #: float64: the least fraction at which the box is touched


class Answers:
    """A list of answers per question: answers[i] are the ids of question i, ascending as the question says.

    ids    all of them, one list after the other
    at     for rays and sweeps the fraction, for nearest the squared distance; else None
    first  list i is [first[i], first[i + 1])
    more   whether question i has more answers than max_results
    """

    def __init__(self, first: np.ndarray, ids: np.ndarray, at: np.ndarray | None, more: np.ndarray) -> None:
        self.first, self.ids, self.at, self.more = first, ids, at, more

    def __len__(self) -> int:
        return len(self.first) - 1

    def __getitem__(self, i: int) -> np.ndarray:
        if not -len(self) <= i < len(self):
            raise IndexError(f"there are {len(self)} questions, and none of number {i}")
        i %= len(self)
        return self.ids[int(self.first[i]):int(self.first[i + 1])]

    def __iter__(self) -> Iterator[np.ndarray]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"Answers({len(self)} questions, {len(self.ids)} answers)"

    def question_of(self) -> np.ndarray:
        """The question of each answer, for grouping."""
        return np.repeat(np.arange(len(self)), np.diff(self.first.astype(np.int64)))


Asker = Sequence[int]
AcceptAnswer = Callable[[int, int], bool]


def _asking(asker: Asker | None, exclude: int | None, accept: AcceptAnswer | None, category: Any = None, mask: Any = None,
            owner: Any = None) -> _core.AskFilter:
    if asker is not None and len(asker) == 2:
        asker = (*asker, 2**32 - 1)
    return _core.AskFilter(_arrays.optional_integers(category, "category"), _arrays.optional_integers(mask, "mask"),
                           _arrays.optional_integers(owner, "owner"), asker, exclude, accept)


def _question(asked: Any) -> Questions:
    return asked if isinstance(asked, Questions) else overlapping(asked)


class BoxIndex:
    """Boxes that stay, each with an id (a whole number that the caller chooses; keep them dense), and questions about them.

        index = jostle.BoxIndex(boxes)                      # box i has the id i
        index.first(jostle.rays(origins, directions))       # what each ray meets first
        index.all(jostle.nearest(points, 8))                # the eight nearest of each point

    dim and dtype are those of the boxes, or given. Questions may be asked from several threads at a time; changes one at a time.
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
        """Forgets everything and takes these boxes: box i gets ids[i], or i."""
        self._index.build(None if ids is None else _arrays.packed(ids, "ids", np.uint32),
                          _arrays.boxes(boxes, dtype=self.dtype))

    def insert(self, ids: Any, boxes: Any) -> None:
        """Adds objects. No id may be there already, or twice."""
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
        """Which of these ids are there: (n,) bool."""
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
        """What each ray or sweep meets first."""
        ids, at = self._index.first(_question(questions)._packed(self.dim, self.dtype),
                                    _asking(asker, exclude, accept, category, mask, owner))
        return Hits(ids.view(np.int64), at)

    def all(self, questions: Any, max_results: int | None = None, *, category: Any = None, mask: Any = None, owner: Any = None,
            asker: Asker | None = None, exclude: int | None = None, accept: AcceptAnswer | None = None) -> Answers:
        """Everything that answers, of each question. Boxes in place of questions ask what touches them."""
        first, ids, at, more = self._index.all(_question(questions)._packed(self.dim, self.dtype),
                                               _asking(asker, exclude, accept, category, mask, owner),
                                               ALL if max_results is None else max_results)
        return Answers(first, ids, at, more.astype(bool))

    def any(self, questions: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
            exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """Whether anything answers: (n,) bool."""
        return self._index.any(_question(questions)._packed(self.dim, self.dtype),
                               _asking(asker, exclude, accept, category, mask, owner)).astype(bool)

    def count(self, questions: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
              exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """How many answer: (n,) uint64."""
        return self._index.count(_question(questions)._packed(self.dim, self.dtype),
                                 _asking(asker, exclude, accept, category, mask, owner))

    # Against shapes: `shapes` and `poses` have a row for every id, and each shape lies in its box.

    def first_hits(self, casts: Questions | ShapeSweeps, shapes: Shapes, poses: Any, *, category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                   exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """The shape that each ray, or each shape that moves, meets first: a structured array of id (-1 where there is
        none), fraction (infinite there), normal, point, from the object's position, part, moving_part."""
        return _shape_queries.first_hits(self._index, self.dim, self.dtype, casts, shapes, poses,
                                         _asking(asker, exclude, accept, category, mask, owner))

    def all_hits(self, casts: Questions | ShapeSweeps, shapes: Shapes, poses: Any, max_results: int | None = None, *,
                 category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                 exclude: int | None = None, accept: AcceptAnswer | None = None) -> ShapeHits:
        """All shapes that each of them meets, nearest first."""
        return _shape_queries.all_hits(self._index, self.dim, self.dtype, casts, shapes, poses,
                                       ALL if max_results is None else max_results,
                                       _asking(asker, exclude, accept, category, mask, owner))

    def nearest_shapes(self, near: Shapes, near_poses: Any, shapes: Shapes, poses: Any, max_distances: Any = np.inf, *,
                       category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None,
                       exclude: int | None = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """The shape nearest to each of `near`, which needn't be in here: a structured array of id, distance (infinite where
        none is within max_distances), normal, point_a, point_b; a is the one of `near`."""
        return _shape_queries.nearest_shapes(self._index, self.dim, self.dtype, near, near_poses, shapes, poses, max_distances,
                                             _asking(asker, exclude, accept, category, mask, owner))

    def __repr__(self) -> str:
        return f"BoxIndex({len(self)} boxes, {self.dim}D {self.dtype})"

    def _repr_html_(self) -> str:
        return _table(repr(self), self.stats())


def _table(title: str, values: dict[str, Any]) -> str:
    lines = "".join(f"<tr><th>{name}</th><td style='text-align:right'>{value:,}</td></tr>" for name, value in values.items()
                    if value)
    return f"<table><caption>{title}</caption>{lines}</table>"
