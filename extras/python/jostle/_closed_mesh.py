# SPDX-License-Identifier: MIT
"""Inside and outside of closed meshes."""
from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _core

HERE = (0, 0, 0, 0, 0, 0, 1)


class ClosedMesh:
    """A mesh of triangles that has an inside. If the mesh has a hole, an Error names an edge with only one triangle.

        solid = jostle.ClosedMesh(jostle.mesh(vertices, triangles))
        solid.contains(points)                          # (n,) bool; points on the surface are inside
        solid.signed_distances(points)["distance"]      # below 0 inside

    `pose` says where the mesh is: a row of 7 numbers, as jostle.poses makes them. Vertices at the same place count as one.
    """

    def __init__(self, mesh: _core.Shape, threads: int = 0) -> None:
        self._mesh, self._threads = _core.ClosedMesh(mesh), _arrays.threads(threads)

    def contains(self, points: Any, pose: Any = None) -> np.ndarray:
        """Whether each of the points (n, 3) lies inside: (n,) bool. The answer is exact, whatever the triangles look like."""
        return self._mesh.contains(*self._given(points, pose), self._threads).astype(bool)

    def signed_distances(self, points: Any, pose: Any = None) -> np.ndarray:
        """How far the points are from the surface: a structured array of distance (below 0 inside), normal (the direction in
        which the distance grows) and point (the nearest point of the surface, relative to the mesh's position)."""
        at, given = self._given(points, pose)
        rows = self._mesh.signed_distances(at, given, self._threads)
        return rows.view(_arrays.rows_dtype(3, given.dtype, ("distance", "normal", "point"))).reshape(-1)

    def winding_numbers(self, points: Any) -> np.ndarray:
        """How often the surface winds around each of the points (n, 3) in the mesh's own axes: (n,) int32."""
        return self._mesh.winding_numbers(np.atleast_2d(_arrays.rows(points, "points", np.float64)))

    def _given(self, points: Any, pose: Any) -> tuple[np.ndarray, np.ndarray]:
        given = np.atleast_2d(_arrays.rows(points, "points"))
        at = np.asarray(HERE, given.dtype) if pose is None else _arrays.rows(pose, "pose", given.dtype)
        return at.reshape(1, -1), given

    def __repr__(self) -> str:
        return "ClosedMesh()"
