# SPDX-License-Identifier: MIT
"""The broad phase: find_pairs, PairFinder, find_periodic_pairs, iter_pairs, join, spatial_order."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Iterator

import numpy as np

from . import _arrays, _core
from ._errors import Error

Accept = Callable[[int, int], bool]


def _is_sorted(order: str) -> bool:
    if order not in ("canonical", "sorted"):
        raise Error(f"order is {order!r}: it must be 'canonical' or 'sorted'")
    return order == "sorted"


def _filter(category: Any, mask: Any, owner: Any, category_b: Any, mask_b: Any, owner_b: Any, ghosts: Any, vertices: Any,
            accept: Any) -> tuple[Any, Any, Any, Any, Any, Any, int, Any, Any]:
    return (_arrays.optional_integers(category, "category"), _arrays.optional_integers(mask, "mask"),
            _arrays.optional_integers(owner, "owner"), _arrays.optional_integers(category_b, "category_b"),
            _arrays.optional_integers(mask_b, "mask_b"), _arrays.optional_integers(owner_b, "owner_b"),
            _arrays.whole(ghosts, "ghosts"),
            None if vertices is None else _arrays.packed(vertices, "vertices", np.uint32), _arrays.function(accept, "accept"))


def _two(boxes: Any, other: Any) -> tuple[np.ndarray, np.ndarray | None]:
    a = _arrays.boxes(boxes)
    if other is None:
        return a, None
    b = _arrays.boxes(other, "other")
    if a.dtype != b.dtype:  # the wider of the two has both exactly
        wide = np.promote_types(a.dtype, b.dtype)
        a, b = a.astype(wide, copy=False), b.astype(wide, copy=False)
    return a, b


def find_pairs(boxes: Any, other: Any = None, *, category: Any = None, mask: Any = None, owner: Any = None,
               category_b: Any = None, mask_b: Any = None, owner_b: Any = None, ghosts: int = 0, vertices: Any = None,
               accept: Accept | None = None, order: str = "canonical", threads: int = 0) -> np.ndarray:
    """All pairs of touching boxes within `boxes`, or between `boxes` and `other`.

    boxes, other   (n, 2, d) or (n, 2 d) of float32 or float64, d 2 or 3, read in place
    category, mask one uint32 per box: a pair counts if each box's category has a bit in common with the other's mask
    owner          one uint32 per box: boxes of the same owner don't pair; 2**32 - 1 means no owner
    ..._b          the same for `other`
    ghosts         the last so many of `boxes` are ghosts, which meet the others and not each other: boxes of another process
    vertices       (n, 3) uint32 for `boxes`: those with a number in common don't pair, as triangles that share a vertex; 2**32 - 1 means none
    accept         called last with (a, b), on one thread; slow, since it is Python. An exception that it raises comes out of the call
    order          "canonical": by position in space, the same on every machine, the fastest. "sorted": ascending by (a, b)
    threads        0 for one per core

    Returns (m, 2) uint32: positions, a < b within one set.
    Cost: expected linear in boxes and pairs. Ctrl-C ends the call. A PairFinder keeps its memory from one search to the next.
    """
    a, b = _two(boxes, other)
    wish = _core.PairFilter(*_filter(category, mask, owner, category_b, mask_b, owner_b, ghosts, vertices, accept))
    return _core.find(a, b, wish, _is_sorted(order), _arrays.threads(threads, accept))


class PairFinder:
    """find_pairs for steps of a simulation: a finder keeps its memory from one search to the next.

        finder = jostle.PairFinder()
        for step in range(1000):
            pairs = finder.find(boxes)

    threads is as for find_pairs. Use a finder for one call at a time: another call meanwhile, by a callback or
    a thread, is an Error.
    """

    def __init__(self, *, threads: int = 0) -> None:
        self._finder = _core.PairFinder(_arrays.threads(threads))

    def find(self, boxes: Any, other: Any = None, *, category: Any = None, mask: Any = None, owner: Any = None,
             category_b: Any = None, mask_b: Any = None, owner_b: Any = None, ghosts: int = 0, vertices: Any = None,
             accept: Accept | None = None, order: str = "canonical") -> np.ndarray:
        """As find_pairs: (m, 2) uint32, which the caller owns."""
        a, b = _two(boxes, other)
        wish = _core.PairFilter(*_filter(category, mask, owner, category_b, mask_b, owner_b, ghosts, vertices, accept))
        return self._finder.find(a, b, wish, _is_sorted(order))

    def stats(self) -> dict[str, Any]:
        """What the last search did: objects, pairs, records, candidates, ties, bricks, nested_grids, bytes_reserved, and
        milliseconds: ms_total, ms_tune, ms_scatter, ms_sweep, ms_finish."""
        return self._finder.stats()

    def release_memory(self) -> None:
        """Gives back the memory that it keeps."""
        self._finder.release_memory()

    def __copy__(self) -> PairFinder:
        raise TypeError("a PairFinder can't be copied: make another one")

    def __repr__(self) -> str:
        last = self.stats()
        return f"PairFinder({last['pairs']} pairs of {last['objects']} boxes in the last search)"


def find_periodic_pairs(boxes: Any, period: Any, *, category: Any = None, mask: Any = None, owner: Any = None,
                        accept: Accept | None = None, order: str = "canonical", threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """The pairs in periodic space: what leaves on one side comes in on the other.

    period         its length along each axis, 0 for axes that aren't periodic. Boxes must be shorter than half of it, or infinite
                   in both directions, and lie within less than two periods

    The rest is as in find_pairs. Returns (m, 2) uint32 and (m, d) of the boxes' dtype: box pairs[i, 0] touches box pairs[i, 1] shifted
    by shifts[i]. Each pair comes once; across a border the second box is the one shifted down. Shifted bounds are rounded outwards.
    """
    a = _arrays.boxes(boxes)
    lengths = _arrays.rows(period, "period").astype(np.float64)
    if lengths.shape != (_arrays.dim_of(a),):
        raise Error(f"period has the shape {lengths.shape}: it must be ({_arrays.dim_of(a)},), a length along each axis")
    rounded = lengths.astype(a.dtype).astype(np.float64)
    if not np.array_equal(rounded, lengths, equal_nan=True):
        raise Error(f"period is {lengths.tolist()}, which {a.dtype} doesn't have: give {rounded.tolist()}, or boxes of float64")
    wish = _core.PairFilter(*_filter(category, mask, owner, None, None, None, 0, None, accept))
    return _core.find_periodic(a, lengths, wish, _is_sorted(order), _arrays.threads(threads, accept))


@dataclass(frozen=True)
class ScenePairs:
    """The pairs of many scenes: `found[k]` are those of scene k, (m, 2) uint32, numbered within the scene.

    pairs   those of all scenes, scene by scene
    first   (scenes + 1,) int64: those of scene k are pairs[first[k]:first[k + 1]]
    """

    pairs: np.ndarray
    first: np.ndarray

    def __len__(self) -> int:
        return len(self.first) - 1

    def __getitem__(self, scene: int) -> np.ndarray:
        if not -len(self) <= scene < len(self):
            raise IndexError(f"there is no scene {scene}: there are {len(self)}")
        scene %= len(self)
        return self.pairs[self.first[scene]:self.first[scene + 1]]


def find_scenes(boxes: Any, offsets: Any, *, category: Any = None, mask: Any = None, owner: Any = None,
                accept: Callable[[int, int, int], bool] | None = None,
                threads: int = 0) -> ScenePairs:
    """The pairs of many independent scenes, such as thousands of small simulations side by side.

    boxes          of all scenes, scene by scene, as for find_pairs
    offsets        (scenes + 1,) whole numbers: scene k is boxes[offsets[k]:offsets[k + 1]]. The first is 0, the last len(boxes)
    category, mask, owner   one uint32 per box of all scenes, as for find_pairs
    accept         called last with (scene, a, b), on one thread; slow, since it is Python
    threads        0 for one per core

    Each scene's pairs are those of find_pairs for its boxes, in the same order, whatever the number of threads.
    For positions among all boxes: found.pairs + np.repeat(offsets[:-1], np.diff(found.first))[:, None].
    Ctrl-C ends the call.
    """
    places = _arrays.packed(offsets, "offsets", np.uint64)
    return ScenePairs(*_core.find_scenes(
        _arrays.boxes(boxes), places, _arrays.optional_integers(category, "category"), _arrays.optional_integers(mask, "mask"),
        _arrays.optional_integers(owner, "owner"), _arrays.function(accept, "accept"),
        _arrays.threads(threads, accept)))


def iter_pairs(boxes: Any, other: Any = None, *, chunk: int = 1_000_000, category: Any = None, mask: Any = None,
               owner: Any = None, category_b: Any = None, mask_b: Any = None, owner_b: Any = None, ghosts: int = 0, vertices: Any = None,
               accept: Accept | None = None, threads: int = 0) -> Iterator[np.ndarray]:
    """The pairs that find_pairs finds, as arrays of `chunk` pairs (the last has fewer), for more pairs than memory holds.

    The search goes on in the background while you work on a chunk, and waits when four chunks haven't been fetched yet. Chunks come
    in no particular order, unless threads is 1: then they come in the canonical order. Don't change the boxes meanwhile. `accept` is
    called by the search, on its thread.
    """
    if _arrays.whole(chunk, "chunk", 2**63) < 1:
        raise Error(f"chunk is {chunk}: it must be at least 1")
    a, b = _two(boxes, other)
    stream = _core.PairStream(a, b, *_filter(category, mask, owner, category_b, mask_b, owner_b, ghosts, vertices, accept), chunk,
                              _arrays.threads(threads, accept))

    def each() -> Iterator[np.ndarray]:
        try:
            yield from stream
        finally:
            stream.close()

    return each()


def spatial_order(boxes: Any, *, threads: int = 0) -> np.ndarray:
    """An order of the boxes along space, (n,) uint32: boxes that lie near each other come near each other.

    boxes          as for find_pairs
    threads        0 for one per core

    With `order = jostle.spatial_order(boxes)`, boxes[order] and velocities[order] have neighbours in space as neighbours in memory,
    so that work on pairs is faster. Put everything in order that is numbered like the boxes, every hundred frames or so. Boxes in
    about the same place keep their order. The order is the same for any number of threads. It takes up to one and a
    half times as long as finding the pairs.
    """
    return _core.spatial_order(_arrays.boxes(boxes), _arrays.threads(threads))


def join(points: Any, radii: Any, other: Any = None, other_radii: Any = None, *, order: str = "canonical",
         threads: int = 0) -> np.ndarray:
    """Pairs of points no further apart than the sum of their radii: spheres that touch.

    points, other        (n, d) of float32 or float64
    radii, other_radii   one number for all, or one for each

    To find all points within r of each other, use the radius r / 2. Distances are compared by their squares in double.
    Returns (m, 2) uint32, as find_pairs.
    """
    def spheres(given: Any, reach: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
        centers = _arrays.floats(given, name)
        if centers.ndim != 2 or centers.shape[1] not in (2, 3):
            raise Error(f"{name} has the shape {centers.shape}: it must be (n, 2) or (n, 3)")
        lengths = _arrays.numbers(reach, f"the radii of {name}")
        if lengths.ndim > 1 or lengths.ndim == 1 and len(lengths) != len(centers):
            raise Error(f"the radii of {name} have the shape {lengths.shape}, and there are {len(centers)} points")
        if any(stride % centers.itemsize for stride in centers.strides):
            centers = np.ascontiguousarray(centers)
        return centers, np.ascontiguousarray(np.broadcast_to(lengths, len(centers)))

    a, radii_a = spheres(points, radii, "points")
    if other is None:
        return _core.join(a, None, radii_a, None, _is_sorted(order), _arrays.threads(threads))
    if other_radii is None:
        raise Error("other needs other_radii")
    b, radii_b = spheres(other, other_radii, "other")
    if a.dtype != b.dtype:
        wide = np.promote_types(a.dtype, b.dtype)
        a, b = a.astype(wide, copy=False), b.astype(wide, copy=False)
    return _core.join(a, b, radii_a, radii_b, _is_sorted(order), _arrays.threads(threads))
