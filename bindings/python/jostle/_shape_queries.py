# SPDX-License-Identifier: MIT
"""Rays, moving shapes and distances against all shapes of a BoxIndex or a World."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Iterator, NamedTuple

import numpy as np

from . import _arrays, _core
from ._errors import Error

if TYPE_CHECKING:
    from ._contacts import Shapes


class ShapeSweeps(NamedTuple):
    """Shapes that move by displacements (n, d) from where they are, without turning."""

    shapes: Shapes
    poses: Any
    displacements: Any


class ShapeHits:
    """A list of hits per question, nearest first: hits[i] is a structured array of id, fraction, normal, point, part,
    moving_part.

    hits   all of them, one list after the other
    first  list i is [first[i], first[i + 1])
    more   whether question i has more hits than max_results
    """

    def __init__(self, first: np.ndarray, hits: np.ndarray, more: np.ndarray) -> None:
        self.first, self.hits, self.more = first, hits, more

    def __len__(self) -> int:
        return len(self.first) - 1

    def __getitem__(self, i: int) -> np.ndarray:
        if not -len(self) <= i < len(self):
            raise IndexError(f"there are {len(self)} questions, and none of number {i}")
        i %= len(self)
        return self.hits[int(self.first[i]):int(self.first[i + 1])]

    def __iter__(self) -> Iterator[np.ndarray]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"ShapeHits({len(self)} questions, {len(self.hits)} hits)"


Asked = Any  # _core.BoxIndex or _core.World


def _casts(casts: Any, dim: int, dtype: np.dtype) -> tuple[Any, np.ndarray | None, np.ndarray]:
    if isinstance(casts, ShapeSweeps):
        ways = np.atleast_2d(_arrays.rows(casts.displacements, "displacements", dtype))
        return casts.shapes._shapes, _arrays.packed_poses(casts.poses, dtype), ways
    if getattr(casts, "_kind", None) != 1:
        raise Error("give rays, as jostle.rays makes them, or jostle.ShapeSweeps")
    return None, None, casts._numbers(dim, dtype)


def _with_ids(ids: np.ndarray, rows: np.ndarray, of_index: bool) -> np.ndarray:
    kind = np.dtype([("id", np.int64 if of_index else np.uint64)] +
                    [(name, *_field(rows.dtype[name])) for name in rows.dtype.names or ()])
    out = np.empty(len(rows), kind)
    out["id"] = ids.view(np.int64) if of_index else ids
    for name in rows.dtype.names or ():
        out[name] = rows[name]
    return out


def _field(kind: np.dtype) -> tuple[Any, ...]:
    return (kind,) if kind.subdtype is None else kind.subdtype


def first_hits(asked: Asked, dim: int, dtype: np.dtype, casts: Any, shapes: Shapes, poses: Any,
               asking: _core.AskFilter) -> np.ndarray:
    ids, hits = asked.first_hits(*_casts(casts, dim, dtype), shapes._shapes, _arrays.packed_poses(poses, dtype), asking,
                                 _arrays.hits_dtype(dim, dtype))
    return _with_ids(ids, hits, isinstance(asked, _core.BoxIndex))


def all_hits(asked: Asked, dim: int, dtype: np.dtype, casts: Any, shapes: Shapes, poses: Any, max_results: int,
             asking: _core.AskFilter) -> ShapeHits:
    first, ids, hits, more = asked.all_hits(*_casts(casts, dim, dtype), shapes._shapes, _arrays.packed_poses(poses, dtype), asking,
                                            max_results, _arrays.hits_dtype(dim, dtype))
    return ShapeHits(first, _with_ids(ids, hits, isinstance(asked, _core.BoxIndex)), more.astype(bool))


def nearest_shapes(asked: Asked, dim: int, dtype: np.dtype, near: Shapes, near_poses: Any, shapes: Shapes, poses: Any,
                   max_distances: Any, asking: _core.AskFilter) -> np.ndarray:
    askers = _arrays.packed_poses(near_poses, dtype)
    most = np.ascontiguousarray(np.broadcast_to(np.asarray(max_distances, np.float64), len(askers)))
    ids, rows = asked.nearest_shapes(near._shapes, askers, most, shapes._shapes, _arrays.packed_poses(poses, dtype), asking)
    named = rows.view(_arrays.rows_dtype(dim, dtype, ("distance", "normal", "point_a", "point_b"))).reshape(-1)
    return _with_ids(ids, named, isinstance(asked, _core.BoxIndex))
