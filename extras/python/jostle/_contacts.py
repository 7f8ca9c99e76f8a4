# SPDX-License-Identifier: MIT
"""Where shapes touch, and other queries about pairs of shapes."""
from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _core
from ._errors import Error, NoSuchObjectError
from ._queries import Queries
from ._shapes import Shapes

def _dtype(dim: int, number: Any) -> np.dtype:
    vector = (number, (dim,))
    point = np.dtype([("from_a", *vector), ("from_b", *vector), ("depth", number), ("feature", np.uint32)], align=True)
    return np.dtype([("pair", np.uint32, (2,)), ("part_a", np.uint32), ("part_b", np.uint32), ("normal", *vector),
                     ("count", np.uint32), ("point", point, (4 if dim == 3 else 2,))], align=True)


CONTACTS = {(dim, np.dtype(number)): _dtype(dim, number) for dim in (2, 3) for number in (np.float32, np.float64)}


def _want_shapes(given: Any) -> None:
    if not isinstance(given, Shapes):
        raise Error(f"shapes is a {type(given).__name__}: it must be a Shapes, as jostle.Shapes([...]) makes of a list")


class ContactFinder:
    """Finds where the objects of pairs touch.

        pairs = jostle.find_pairs(jostle.bounds(shapes, poses))
        contacts = jostle.ContactFinder(3, np.float64).find(shapes, poses, pairs)

    A pose is a row of 7 numbers in 3D (position, quaternion x, y, z, w), of 4 in 2D (position, cosine, sine): jostle.poses makes
    them. A motion has 6 (3) more: the displacement and the rotation of the whole motion. Pairs are (m, 2), positions in the shapes;
    with a second set (shapes_b, poses_b) the second column refers to that set.

    It keeps its working memory, so use the same one again and again, but only for one call at a time: a second one, from another
    thread, is an Error. The functions contacts, touching, distances and impacts do the same for a single call.

    all_points   gives a contact for each triangle or segment of a surface that touches, with all of its points; otherwise those of
                 a body whose normals are within 5 degrees are one contact, of the triangle that is deepest
    """

    def __init__(self, dim: int = 3, dtype: Any = np.float64, threads: int = 0, *, all_points: bool = False) -> None:
        self.dim, self.dtype = dim, np.dtype(dtype)
        if (self.dim, self.dtype) not in _arrays.SPACES:
            raise Error(f"a contact finder is 2D or 3D, float32 or float64, not {self.dim}D {self.dtype}")
        self._finder = _core.ContactFinder(_arrays.SPACES[self.dim, self.dtype], bool(all_points), _arrays.threads(threads))

    def _given(self, shapes: Shapes, rows: Any, pairs: Any, shapes_b: Shapes | None,
               rows_b: Any) -> tuple[Any, np.ndarray, Any, np.ndarray | None, np.ndarray]:
        _want_shapes(shapes)
        if shapes_b is not None:
            _want_shapes(shapes_b)
        a, b = self._rows(rows), None if rows_b is None else self._rows(rows_b)
        named = _arrays.pairs(pairs)
        if named.ndim == 2 and named.shape[1] == 2:
            for column, (of, placed) in enumerate(((shapes, a), (shapes, a) if shapes_b is None else (shapes_b, b))):
                if of.repeats and placed is not None:
                    if placed.ndim != 2 or placed.shape[1] not in ((4, 7) if self.dim == 2 else (7, 13)):
                        break  # neither poses nor motions, as the call below will say
                    many = len(placed)
                else:
                    many = len(of)
                if len(named) and named[:, column].max() >= many:
                    at = int(np.argmax(named[:, column] >= many))
                    raise NoSuchObjectError(f"pairs[{at}] names object {named[at, column]}, and there are {many}", at)
        return shapes._shapes, a, None if shapes_b is None else shapes_b._shapes, b, named

    def _rows(self, rows: Any) -> np.ndarray:
        return _arrays.packed_poses(rows, self.dtype)

    def find(self, shapes: Shapes, poses: Any, pairs: Any, margin: float = 0.0, shapes_b: Shapes | None = None,
             poses_b: Any = None) -> np.ndarray:
        """All contacts of shapes that touch or have a gap of up to `margin`, in the order of the pairs.

        A structured array: pair (2,), part_a, part_b, normal (d,), count, and point (4,) or in 2D (2,) with from_a, from_b (d,),
        depth, feature, of which the first `count` are set and the others zero.
        """
        return self._finder.find(*self._given(shapes, poses, pairs, shapes_b, poses_b), margin, CONTACTS[self.dim, self.dtype])

    def find_points(self, shapes: Shapes, poses: Any, pairs: Any, margin: float = 0.0, shapes_b: Shapes | None = None,
                    poses_b: Any = None) -> np.ndarray:
        """The same contacts, but only the deepest point of each, in a third of the memory: pair (2,), part_a, part_b, normal (d,),
        from_a, from_b (d,), depth, feature."""
        vector = (self.dtype, (self.dim,))
        kind = np.dtype([("pair", np.uint32, (2,)), ("part_a", np.uint32), ("part_b", np.uint32), ("normal", *vector),
                         ("from_a", *vector), ("from_b", *vector), ("depth", self.dtype), ("feature", np.uint32)], align=True)
        return self._finder.find_points(*self._given(shapes, poses, pairs, shapes_b, poses_b), margin, kind)

    def touching(self, shapes: Shapes, poses: Any, pairs: Any, shapes_b: Shapes | None = None,
                 poses_b: Any = None) -> np.ndarray:
        """Whether the shapes of each pair touch: (m,) bool."""
        return self._finder.touching(*self._given(shapes, poses, pairs, shapes_b, poses_b)).astype(bool)

    def distances(self, shapes: Shapes, poses: Any, pairs: Any, max_distance: float = np.inf, shapes_b: Shapes | None = None,
                  poses_b: Any = None) -> np.ndarray:
        """The signed distance of each pair, infinite above max_distance: a structured array of distance, normal (from a to b),
        from_a, from_b, each relative to its own object's position."""
        rows = self._finder.rows(*self._given(shapes, poses, pairs, shapes_b, poses_b), max_distance, False)
        names = ("distance", "normal", "from_a", "from_b")
        return rows.view(_arrays.rows_dtype(self.dim, self.dtype, names)).reshape(-1)

    def first_touching(self, shapes: Shapes, poses: Any, pairs: Any, offsets: Any, shapes_b: Shapes | None = None,
                       poses_b: Any = None) -> np.ndarray:
        """Of each group of pairs the number of the first that touches, or -1: (g,) int64. Group k is pairs[offsets[k]:offsets[k + 1]],
        such as those of one configuration of a robot. What comes after the first in a group isn't tested."""
        given = self._given(shapes, poses, pairs, shapes_b, poses_b)
        return self._finder.groups(*given, _arrays.packed(offsets, "offsets", np.uint64), None)[0].view(np.int64)

    def least_distances(self, shapes: Shapes, poses: Any, pairs: Any, offsets: Any, max_distance: float = np.inf,
                        shapes_b: Shapes | None = None, poses_b: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Of each group of pairs the least distance, as distances() gives it, and the number of the pair that has it, or -1 where
        none is within max_distance: (g,) int64. Groups are as for first_touching."""
        given = self._given(shapes, poses, pairs, shapes_b, poses_b)
        numbers, rows = self._finder.groups(*given, _arrays.packed(offsets, "offsets", np.uint64), float(max_distance))
        names = ("distance", "normal", "from_a", "from_b")
        return rows.view(_arrays.rows_dtype(self.dim, self.dtype, names)).reshape(-1), numbers.view(np.int64)

    def impacts(self, shapes: Shapes, motions: Any, pairs: Any, tolerance: float = 1e-3, shapes_b: Shapes | None = None,
                motions_b: Any = None) -> np.ndarray:
        """When and where the objects of each pair first touch, infinite where they don't: a structured array of time, normal,
        from_a, from_b."""
        rows = self._finder.rows(*self._given(shapes, motions, pairs, shapes_b, motions_b), tolerance, True)
        return rows.view(_arrays.rows_dtype(self.dim, self.dtype, ("time", "normal", "from_a", "from_b"))).reshape(-1)

    def ray_casts(self, rays: Queries, shapes: Shapes, poses: Any, pairs: Any) -> np.ndarray:
        """Where the rays (jostle.rays) hit shapes: pairs (m, 2) are of a ray and an object, such as those of BoxIndex.join.

        A structured array of fraction (infinite if a ray misses), normal (out of the surface), point (on the surface, relative
        to the object's position) and part (the triangle or child that is hit). A ray that begins in a solid hits it at 0.
        """
        if not isinstance(rays, Queries) or rays._kind != 1:
            raise Error("ray_casts wants rays, as jostle.rays makes them")
        hits = self._finder.casts(None, None, rays._numbers(self.dim, self.dtype), shapes._shapes, self._rows(poses),
                                  _arrays.pairs(pairs), _arrays.hits_dtype(self.dim, self.dtype))
        return hits

    def shape_casts(self, moving: Shapes, moving_poses: Any, displacements: Any, shapes: Shapes, poses: Any,
                    pairs: Any) -> np.ndarray:
        """Where shapes that move by displacements (n, d), without rotating, first touch resting ones: pairs (m, 2) are of
        one that moves and one that rests.

        As ray_casts; moving_part is the triangle or child of the shape that moves.
        """
        ways = _arrays.rows(displacements, "displacements", self.dtype)
        return self._finder.casts(moving._shapes, self._rows(moving_poses), ways, shapes._shapes, self._rows(poses),
                                  _arrays.pairs(pairs), _arrays.hits_dtype(self.dim, self.dtype))


def _finder(shapes: Shapes, rows: Any, rows_b: Any, all_points: bool = False) -> ContactFinder:
    _want_shapes(shapes)
    given = [_arrays.floats(x, "poses") for x in (rows, rows_b) if x is not None]
    return ContactFinder(shapes.dim, np.result_type(*(x.dtype for x in given)), all_points=all_points)


def contacts(shapes: Shapes, poses: Any, pairs: Any, margin: float = 0.0, shapes_b: Shapes | None = None,
             poses_b: Any = None, *, all_points: bool = False) -> np.ndarray:
    """ContactFinder.find for a single call."""
    return _finder(shapes, poses, poses_b, all_points).find(shapes, poses, pairs, margin, shapes_b, poses_b)


def touching(shapes: Shapes, poses: Any, pairs: Any, shapes_b: Shapes | None = None, poses_b: Any = None) -> np.ndarray:
    """ContactFinder.touching for a single call."""
    return _finder(shapes, poses, poses_b).touching(shapes, poses, pairs, shapes_b, poses_b)


def distances(shapes: Shapes, poses: Any, pairs: Any, max_distance: float = np.inf, shapes_b: Shapes | None = None,
              poses_b: Any = None) -> np.ndarray:
    """ContactFinder.distances for a single call: a structured array of the same fields, each point relative to its own object's
    position."""
    return _finder(shapes, poses, poses_b).distances(shapes, poses, pairs, max_distance, shapes_b, poses_b)


def impacts(shapes: Shapes, motions: Any, pairs: Any, tolerance: float = 1e-3, shapes_b: Shapes | None = None,
            motions_b: Any = None) -> np.ndarray:
    """ContactFinder.impacts for a single call."""
    return _finder(shapes, motions, motions_b).impacts(shapes, motions, pairs, tolerance, shapes_b, motions_b)


def ray_casts(rays: Queries, shapes: Shapes, poses: Any, pairs: Any) -> np.ndarray:
    """ContactFinder.ray_casts for a single call."""
    return _finder(shapes, poses, None).ray_casts(rays, shapes, poses, pairs)


def shape_casts(moving: Shapes, moving_poses: Any, displacements: Any, shapes: Shapes, poses: Any, pairs: Any) -> np.ndarray:
    """ContactFinder.shape_casts for a single call."""
    return _finder(shapes, poses, moving_poses).shape_casts(moving, moving_poses, displacements, shapes, poses, pairs)


def bounds(shapes: Shapes, poses: Any, margin: float = 0.0) -> np.ndarray:
    """The tightest box around each object, rounded outwards: (n, 2, d)."""
    given = ContactFinder._rows(_finder(shapes, poses, None), poses)
    if given.ndim != 2:
        raise Error(f"poses has the shape {given.shape}, and there are {len(shapes)} shapes", None, "size_mismatch")
    return _core.bounds(_arrays.SPACES[shapes.dim, given.dtype], shapes._shapes, given, margin)


_PART = 1 << 25


def sum_by_object(objects: Any, values: Any, count: int, threads: int = 0) -> np.ndarray:
    """Adds up values per object: row i of the result is the sum of values[k] over all k with objects[k] == i.

    objects  (m,) whole numbers below `count`
    values   (m,) or (m, k) of float32, float64 or int64, k up to 8

    It runs on all cores, and the result is bit for bit the same for any number of them. Returns (count,) or (count, k).
    """
    given = _arrays.floats(values, "values") if _arrays.is_weak(values) else _arrays.array(values)
    if given.dtype.kind in "iu":
        given = _arrays.integers(given, "values", np.int64)
    flat = given.ndim == 1
    rows = np.ascontiguousarray(given[:, None] if flat else given)
    of, count, threads = _arrays.packed(objects, "objects", np.uint32), _arrays.whole(count, "count"), _arrays.threads(threads)
    # In parts, between which Python looks for Ctrl-C. They are of one size: the bits depend on nothing else.
    sums = _core.sum_by_object(of[:_PART], rows[:_PART], count, threads)
    try:
        for first in range(_PART, max(len(of), len(rows)), _PART):
            more = _core.sum_by_object(of[first:first + _PART], rows[first:first + _PART], count, threads)
            with np.errstate(all="ignore"):
                sums += more
    except Error:
        _core.sum_by_object(of, rows, count, threads)  # the same, with the number among all
        raise
    return sums[:, 0] if flat else sums
