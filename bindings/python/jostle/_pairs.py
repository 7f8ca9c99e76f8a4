# SPDX-License-Identifier: MIT
"""The broad phase: find_pairs, iter_pairs, join."""
from __future__ import annotations

from typing import Any, Callable, Iterator

import numpy as np

from . import _arrays, _core
from ._errors import Error

Accept = Callable[[int, int], bool]


def _is_sorted(order: str) -> bool:
    if order not in ("canonical", "sorted"):
        raise Error(f"order is {order!r}: it must be 'canonical' or 'sorted'")
    return order == "sorted"


def _filter(category: Any, mask: Any, owner: Any, category_b: Any, mask_b: Any, owner_b: Any, accept: Any) -> tuple[
        Any, Any, Any, Any, Any, Any, Any]:
    return (_arrays.optional_integers(category, "category"), _arrays.optional_integers(mask, "mask"),
            _arrays.optional_integers(owner, "owner"), _arrays.optional_integers(category_b, "category_b"),
            _arrays.optional_integers(mask_b, "mask_b"), _arrays.optional_integers(owner_b, "owner_b"), accept)


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
               category_b: Any = None, mask_b: Any = None, owner_b: Any = None, accept: Accept | None = None,
               order: str = "canonical", threads: int = 0) -> np.ndarray:
    """All pairs of touching boxes, or of one of `boxes` and one of `other`.

    boxes, other   (n, 2, d) or (n, 2 d) of float32 or float64, d 2 or 3, read in place
    category, mask one uint32 per box: a pair counts if each one's category meets the other's mask
    owner          one uint32 per box: those of one owner don't pair; 2**32 - 1 is nobody
    ..._b          the same for `other`
    accept         called last with (a, b); slow, since it is Python. What it raises comes out of the call
    order          "canonical": by place, the same on every machine, the fastest. "sorted": ascending by (a, b)
    threads        0 for one per core

    Returns (m, 2) uint32: positions, a < b within one set.
    Cost: expected linear in boxes and pairs. Ctrl-C ends the call.
    """
    a, b = _two(boxes, other)
    wish = _core.PairFilter(*_filter(category, mask, owner, category_b, mask_b, owner_b, accept))
    return _core.find(a, b, wish, _is_sorted(order), threads)


def iter_pairs(boxes: Any, other: Any = None, *, chunk: int = 1_000_000, category: Any = None, mask: Any = None,
               owner: Any = None, category_b: Any = None, mask_b: Any = None, owner_b: Any = None,
               accept: Accept | None = None, threads: int = 0) -> Iterator[np.ndarray]:
    """The pairs that find_pairs finds, as arrays of `chunk` pairs (the last has fewer), for more pairs than memory holds.

    The search goes on in the background while a chunk is worked on, and waits where four are not fetched yet. Chunks come in
    no particular order unless threads is 1: then it is the canonical one. Don't change the boxes meanwhile.
    """
    if chunk < 1:
        raise Error(f"chunk is {chunk}: it must be at least 1")
    a, b = _two(boxes, other)
    stream = _core.PairStream(a, b, *_filter(category, mask, owner, category_b, mask_b, owner_b, accept), chunk, threads)

    def each() -> Iterator[np.ndarray]:
        try:
            yield from stream
        finally:
            stream.close()

    return each()


def join(points: Any, radii: Any, other: Any = None, other_radii: Any = None, *, order: str = "canonical",
         threads: int = 0) -> np.ndarray:
    """Pairs of points no further apart than the sum of their radii: spheres that touch.

    points, other        (n, d) of float32 or float64
    radii, other_radii   one number for all, or one for each

    For all points within r of each other the radii are r / 2. Distances are compared by their squares in double.
    Returns (m, 2) uint32, as find_pairs.
    """
    def spheres(given: Any, reach: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
        centers = _arrays.floats(given, name)
        if centers.ndim != 2 or centers.shape[1] not in (2, 3):
            raise Error(f"{name} has the shape {centers.shape}: it must be (n, 2) or (n, 3)")
        lengths = np.asarray(reach, np.float64)
        if lengths.ndim > 1 or lengths.ndim == 1 and len(lengths) != len(centers):
            raise Error(f"the radii of {name} have the shape {lengths.shape}, and there are {len(centers)} points")
        if any(stride % centers.itemsize for stride in centers.strides):
            centers = np.ascontiguousarray(centers)
        return centers, np.ascontiguousarray(np.broadcast_to(lengths, len(centers)))

    a, radii_a = spheres(points, radii, "points")
    if other is None:
        return _core.join(a, None, radii_a, None, _is_sorted(order), threads)
    if other_radii is None:
        raise Error("other needs other_radii")
    b, radii_b = spheres(other, other_radii, "other")
    if a.dtype != b.dtype:
        wide = np.promote_types(a.dtype, b.dtype)
        a, b = a.astype(wide, copy=False), b.astype(wide, copy=False)
    return _core.join(a, b, radii_a, radii_b, _is_sorted(order), threads)
