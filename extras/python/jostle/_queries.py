# SPDX-License-Identifier: MIT
"""Queries of boxes and of shapes, and the verbs that run them."""
from __future__ import annotations

from typing import Any, Callable, Sequence, Union

import numpy as np

from . import _arrays, _core
from ._errors import Error
from ._lists import Answers, Hits, ShapeAnswers
from ._shapes import Shapes
from ._visits import Visit

ALL = 2**64 - 1


class Queries:
    """Many queries of one kind: of boxes, made by rays, sweeps, overlapping, spheres, frustums, nearest or nearest_to_boxes, or of shapes,
    made by rays, shape_sweeps, posed_shapes or nearest_to_shapes.

    Their numbers are rounded to the dtype of the boxes when they are used, but not those of overlapping(), which must have it: an
    array of float64 isn't taken by an index or world of float32. One row, or one number, applies to all queries.
    """

    def __init__(self, kind: int, columns: Sequence[Any], planes: Sequence[Any] = (), count: int = 1,
                 shapes: Shapes | None = None, poses: Any = None) -> None:
        self._kind, self._columns, self._planes, self._count = kind, columns, planes, count
        self._shapes, self._poses = shapes, poses

    def _numbers(self, dim: int, dtype: np.dtype) -> np.ndarray:
        """One row for each query."""
        if self._kind in (5, 9):
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

    def _packed(self, dim: int, dtype: np.dtype) -> _core.Queries:
        planes = [np.ascontiguousarray(_arrays.floats(one, "planes").astype(dtype)) for one in self._planes]
        numbers = self._numbers(dim, dtype)
        poses = None if self._shapes is None else _arrays.packed_poses(self._poses, dtype)
        if poses is not None and self._kind != 9 and len(numbers) == 1 != len(poses):
            numbers = np.ascontiguousarray(np.broadcast_to(numbers, (len(poses), numbers.shape[1])))
        return _core.Queries(self._kind, numbers, _arrays.SPACES[dim, dtype], planes, self._count,
                             None if self._shapes is None else self._shapes._shapes, poses)

    def _widths(self, dim: int) -> tuple[int, ...]:
        return {1: (dim, dim, 1), 2: (2 * dim, dim, 1), 3: (2 * dim,), 4: (dim, 1), 6: (dim, 1), 7: (2 * dim, 1), 8: (dim,), 10: (1,)}[self._kind]


def rays(origins: Any, directions: Any, max_fraction: Any = np.inf) -> Queries:
    """The points origin + f * direction for 0 <= f <= max_fraction: (n, d), (n, d) or (d,), (n,) or one number."""
    return Queries(1, (origins, directions, max_fraction))


def sweeps(boxes: Any, motions: Any, max_fraction: Any = 1.0) -> Queries:
    """Boxes that move by f * motion for 0 <= f <= max_fraction."""
    return Queries(2, (boxes, motions, max_fraction))


def overlapping(boxes: Any) -> Queries:
    """Finds what touches each of these boxes."""
    return Queries(3, (boxes,))


def spheres(centers: Any, radii: Any) -> Queries:
    """Finds what is no further than the radius from each centre."""
    return Queries(4, (centers, radii))


def frustums(planes: Sequence[Any]) -> Queries:
    """Regions bounded by planes: each is an array (k, d + 1) of normals and offsets; inside is where normal . p + offset >= 0.
    A single such array is one region."""
    if isinstance(planes, (list, tuple)):
        return Queries(5, (), planes)
    given = _arrays.array(planes)
    return Queries(5, (), [given] if given.ndim == 2 else list(given) if given.ndim else list(planes))


def nearest(points: Any, count: int = 1, max_distance: Any = np.inf) -> Queries:
    """The `count` boxes that are nearest to each point; none for 0."""
    return Queries(6, (points, max_distance), count=_arrays.whole(count, "count"))


def nearest_to_boxes(boxes: Any, count: int = 1, max_distance: Any = np.inf) -> Queries:
    """The `count` boxes that are nearest to each of these boxes; one that touches it is at distance 0."""
    return Queries(7, (boxes, max_distance), count=_arrays.whole(count, "count"))


def shape_sweeps(shapes: Shapes, poses: Any, displacements: Any) -> Queries:
    """Shapes that move from their poses by displacements (n, d), without rotating. To end earlier, scale the displacement."""
    return Queries(8, (displacements,), shapes=_shapes_of(shapes), poses=poses)


def posed_shapes(shapes: Shapes, poses: Any) -> Queries:
    """Finds what touches each of these shapes, which needn't be in the index or world."""
    return Queries(9, (), shapes=_shapes_of(shapes), poses=poses)


def nearest_to_shapes(shapes: Shapes, poses: Any, count: int = 1, max_distance: Any = np.inf) -> Queries:
    """The `count` shapes that are nearest to each of these."""
    return Queries(10, (max_distance,), count=_arrays.whole(count, "count"), shapes=_shapes_of(shapes), poses=poses)


def _shapes_of(shapes: Any) -> Shapes:
    if not isinstance(shapes, Shapes):
        raise Error(f"shapes is of the type {type(shapes).__name__}: it must be a Shapes, as jostle.Shapes([...]) makes of a list")
    return shapes


Asker = Sequence[int]
AcceptAnswer = Callable[[int, int], bool]
Exclude = Union[int, Sequence[int], np.ndarray, None]  # one id for all queries, or one for each


def asking(asker: Asker | None, exclude: Any, accept: AcceptAnswer | None, category: Any = None, mask: Any = None,
           owner: Any = None) -> _core.AskFilter:
    if asker is not None:
        of = asker if isinstance(asker, (list, tuple)) else np.atleast_1d(_arrays.integers(asker, "asker", np.uint32)).tolist()
        numbers: list[Any] = list(of)
        if len(numbers) not in (2, 3):
            raise Error(f"asker is {asker!r}: it must be (category, mask) or (category, mask, owner)")
        asker = tuple(_arrays.whole(one, "asker") for one in (*numbers, 2**32 - 1)[:3])
    one = exclude is None or _arrays.array(exclude).ndim == 0
    return _core.AskFilter(_arrays.optional_integers(category, "category"), _arrays.optional_integers(mask, "mask"),
                           _arrays.optional_integers(owner, "owner"), asker,
                           None if not one else _excluded(exclude),
                           None if one else _excluded_each(exclude),
                           _arrays.function(accept, "accept"))


def _excluded(exclude: Any) -> int | None:
    return None if exclude is None or exclude == -1 else _arrays.whole(exclude, "exclude", 2**64)


def _excluded_each(exclude: Any) -> np.ndarray:
    """Ids as uint64; -1, which is no object's, becomes the greatest number, which isn't either."""
    given = _arrays.array(exclude)
    if given.dtype.kind != "i":
        return _arrays.packed(exclude, "exclude", np.uint64)
    ids = _arrays.packed(np.where(given == -1, 0, given), "exclude", np.uint64)
    return np.where(given == -1, np.uint64(ALL), ids)


def limit(max_results: int | None) -> int:
    return ALL if max_results is None else _arrays.whole(max_results, "max_results", 2**64)


PARTS = {1: ("origins", "directions", "max_fraction"), 2: ("boxes", "motions", "max_fraction"), 3: ("boxes",),
         4: ("centers", "radii"), 6: ("points", "max_distance"), 7: ("boxes", "max_distance"), 8: ("displacements",),
         10: ("max_distance",)}
KINDS = {1: "rays", 2: "sweeps", 3: "overlapping", 4: "spheres", 5: "frustums", 6: "nearest", 7: "nearest_to_boxes",
         8: "shape_sweeps", 9: "posed_shapes", 10: "nearest_to_shapes"}
OF_BOXES, OF_SHAPES = (1, 2, 3, 4, 5, 6, 7), (1, 8, 9, 10)
LINES, NEAREST, NOT_NEAREST = (1, 2, 8), (6, 7, 10), (1, 2, 3, 4, 5, 8, 9)


WHAT_COUNTS = """

    The verbs any, count, first, all and visit ask about boxes or, with `shapes` and `poses`, which have a row for every id (of a world,
    every index of an id), about the shapes in the boxes. Which objects count:

    exclude   an id that doesn't, or one for each query; -1 is none
    asker     (category, mask) or (category, mask, owner); all bits and no owner if it isn't given, so that `owner` alone excludes none
    category, mask, owner   one uint32 per id, of an index alone, since a world knows its objects' filters: an object counts if its
              category is in the asker's mask, the asker's category in its mask, and the owners differ
    accept    accept(query, id) is asked last, about what may be an answer
    """


class Verbs:
    __doc__ = "The queries of a BoxIndex and a World." + WHAT_COUNTS

    dim: int
    dtype: np.dtype
    _core: Any

    def _ids(self, ids: np.ndarray) -> np.ndarray:
        return ids.view(np.int64) if isinstance(self._core, _core.BoxIndex) else ids

    def _call(self, verb: str, queries: Any, kinds: Sequence[int], shapes: Shapes | None, poses: Any, asking: _core.AskFilter,
              *more: Any) -> Any:
        given = queries if isinstance(queries, Queries) else overlapping(queries)
        takes = [kind for kind in (OF_BOXES if shapes is None else OF_SHAPES) if kind in kinds]
        if given._kind not in takes:
            raise Error(f"the queries are of the kind {KINDS[given._kind]}: this call takes "
                        f"{', '.join(KINDS[kind] for kind in takes)}{'' if shapes is None else ' of shapes'}"
                        f"{'' if shapes is None or given._kind not in (3, 4) else '; for boxes or spheres, posed_shapes of jostle.box or sphere'}")
        if (shapes is None) != (poses is None):
            raise Error("give shapes and poses, or neither")
        target = (None, None) if shapes is None else (_shapes_of(shapes)._shapes, _arrays.packed_poses(poses, self.dtype))
        return getattr(self._core, verb)(given._packed(self.dim, self.dtype), asking, *target, *more)

    def _details(self, queries: Any, shapes: Shapes | None) -> np.dtype | None:
        kind = queries._kind if isinstance(queries, Queries) else 3
        if shapes is None or kind == 9:
            return None
        if kind == 10:
            return _arrays.rows_dtype(self.dim, self.dtype, ("distance", "normal", "from_a", "from_b"))
        return _arrays.hits_dtype(self.dim, self.dtype)

    def _with_ids(self, ids: np.ndarray, details: np.ndarray) -> np.ndarray:
        fields = [(name, *_field(details.dtype[name])) for name in details.dtype.names or ()]
        out = np.empty(len(ids), np.dtype([("id", ids.dtype), *fields]))
        out["id"] = ids
        for name, *_ in fields:
            out[name] = details[name]
        return out

    def any(self, queries: Any, shapes: Shapes | None = None, poses: Any = None, *, category: Any = None, mask: Any = None,
            owner: Any = None, asker: Asker | None = None, exclude: Exclude = None, accept: AcceptAnswer | None = None) -> np.ndarray:
        """Whether each query has any answer: (n,) bool. Boxes instead of queries find what overlaps them, here and below."""
        return self._call("any", queries, NOT_NEAREST, shapes, poses, asking(asker, exclude, accept, category, mask, owner)).astype(bool)

    def count(self, queries: Any, shapes: Shapes | None = None, poses: Any = None, *, category: Any = None, mask: Any = None,
              owner: Any = None, asker: Asker | None = None, exclude: Exclude = None,
              accept: AcceptAnswer | None = None) -> np.ndarray:
        """How many answers each query has: (n,) uint64."""
        return self._call("count", queries, NOT_NEAREST, shapes, poses, asking(asker, exclude, accept, category, mask, owner))

    def first(self, queries: Queries, shapes: Shapes | None = None, poses: Any = None, *, category: Any = None, mask: Any = None,
              owner: Any = None, asker: Asker | None = None, exclude: Exclude = None, accept: AcceptAnswer | None = None) -> Any:
        """What each ray or sweep hits first, or what is nearest. Of boxes Hits. Of shapes a structured array of id, fraction, normal, point
        (relative to the object's position), part and moving_part; of nearest_to_shapes id, distance, normal, from_a and from_b, where a
        is the shape of the query. Where there is nothing, the id is -1, of a world 0, and fraction or distance is infinite: ask for that
        before you use an id as an index."""
        ids, at, details = self._call("first", queries, LINES + NEAREST, shapes, poses,
                                      asking(asker, exclude, accept, category, mask, owner), self._details(queries, shapes))
        ids = self._ids(ids)
        if details is not None:
            return self._with_ids(ids, details)
        at[ids == (-1 if ids.dtype == np.int64 else 0)] = np.inf
        return Hits(ids, at)

    def all(self, queries: Any, shapes: Shapes | None = None, poses: Any = None, *, max_results: int | None = None,
            category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None, exclude: Exclude = None,
            accept: AcceptAnswer | None = None) -> Any:
        """All answers of each query, nearest first where they have an order, else ascending by id: Answers, or of shapes along rays,
        sweeps and nearest ShapeAnswers."""
        first, ids, at, more, details = self._call(
            "all", queries, tuple(KINDS), shapes, poses, asking(asker, exclude, accept, category, mask, owner), limit(max_results),
            self._details(queries, shapes))
        if details is not None:
            return ShapeAnswers(first, self._with_ids(self._ids(ids), details), more.astype(bool))
        return Answers(first, ids, at, more.astype(bool))

    def visit(self, queries: Any, visit: Visit, shapes: Shapes | None = None, poses: Any = None, *, chunk: int = 64,
              category: Any = None, mask: Any = None, owner: Any = None, asker: Asker | None = None, exclude: int | None = None,
              accept: AcceptAnswer | None = None) -> bool:
        """Calls visit(ids, at) with the answers to one query as they are found, `chunk` of them at a time, in the order of all();
        regions in an order of the index's own, with at 0. Of shapes `at` is the fraction or the distance. visit returns None or True to go on, False to stop, or (where answers have an
        order) a number that no later `at` may exceed, 0 as well. The search goes no further than the chunk that it is in: chunk=1
        stops soonest. Returns whether it was
        never stopped. visit may make queries, and give commands to a world; it must not change an index, or update a world."""
        return self._call("visit", queries, tuple(KINDS), shapes, poses, asking(asker, exclude, accept, category, mask, owner), visit,
                          chunk)


def _field(kind: np.dtype) -> tuple[Any, ...]:
    return (kind,) if kind.subdtype is None else kind.subdtype
