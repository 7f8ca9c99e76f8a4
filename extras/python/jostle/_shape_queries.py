# SPDX-License-Identifier: MIT
"""Queries by rays, moving shapes and distances against all shapes of a BoxIndex or a World."""
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _core
from ._errors import Error
from ._lists import ShapeHits
from ._questions import Questions
from ._shapes import Shapes


class ShapeSweeps(NamedTuple):
    """Shapes that move by displacements (n, d) from their poses, without rotating."""

    shapes: Shapes
    poses: Any
    displacements: Any


Asked = Any  # _core.BoxIndex or _core.World


def _casts(casts: Any, dim: int, dtype: np.dtype) -> tuple[Any, np.ndarray | None, np.ndarray]:
    if isinstance(casts, ShapeSweeps):
        ways = np.atleast_2d(_arrays.rows(casts.displacements, "displacements", dtype))
        return casts.shapes._shapes, _arrays.packed_poses(casts.poses, dtype), ways
    if not isinstance(casts, Questions) or casts._kind != 1:
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
    most = _arrays.per_object(_arrays.numbers(max_distances, "max_distances"), "max_distances", len(askers))
    ids, rows = asked.nearest_shapes(near._shapes, askers, most, shapes._shapes, _arrays.packed_poses(poses, dtype), asking)
    named = rows.view(_arrays.rows_dtype(dim, dtype, ("distance", "normal", "from_a", "from_b"))).reshape(-1)
    return _with_ids(ids, named, isinstance(asked, _core.BoxIndex))
