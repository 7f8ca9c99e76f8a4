# SPDX-License-Identifier: MIT
"""Surfaces that bend, such as cloth: Surface, SurfaceFinder, and the same about single pairs."""
from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _core
from ._errors import Error

VERTEX_TRIANGLE, EDGE_EDGE = 1, 2  # as in jostle.h


def _dtype(*of: Any) -> np.dtype:
    return np.dtype([("pair", np.uint32, (2,)), ("vertices", np.uint32, (4,)), *of], align=True)


NUMBERS = (np.dtype(np.float32), np.dtype(np.float64))
NEAR = {number: _dtype(("weights", number, (4,)), ("normal", number, (3,)), ("distance", number)) for number in NUMBERS}
IMPACT = {number: _dtype(("time", number)) for number in NUMBERS}
DISTANCE = np.dtype([("distance", np.float64), ("weights", np.float64, (4,)), ("normal", np.float64, (3,))])


class NearSurface(NamedTuple):
    """Pairs that are near. Each is a structured array: pair (2,), vertices (4,), weights (4,), normal (3,), distance."""

    vertex_triangle: np.ndarray  #: pair: the number of the vertex and that of the triangle
    edge_edge: np.ndarray  #: pair: two numbers of Surface.edges, the lower first


class MovingSurface(NamedTuple):
    """Pairs that meet. Each is a structured array: pair (2,), vertices (4,), time."""

    vertex_triangle: np.ndarray  #: as in NearSurface
    edge_edge: np.ndarray  #: as in NearSurface
    safe_step: float  #: the least time, 1 where there are none: until then nothing comes within the distance


class Surface:
    """Which vertices make triangles and edges: what stays the same while a surface bends.

        cloth = jostle.Surface(triangles)

    triangles   (n, 3) vertices, in any orientation, several bodies as well
    edges       (n, 2), those that belong to no triangle, such as hair
    points      (n,), the vertices that belong to nothing else, such as grains
    vertices    how many positions there are; None: as many as are named
    """

    def __init__(self, triangles: Any, edges: Any = None, points: Any = None, vertices: int | None = None) -> None:
        def rows(given: Any, name: str, width: int) -> np.ndarray:
            out = _arrays.packed([] if given is None else given, name, np.uint32)
            return out.reshape(0, width) if out.size == 0 else out

        self._surface = _core.Surface(rows(triangles, "triangles", 3), rows(edges, "edges", 2),
                                      _arrays.packed([] if points is None else points, "points", np.uint32),
                                      0 if vertices is None else _arrays.whole(vertices, "vertices"))

    @property
    def vertices(self) -> int:
        """How many positions a call takes."""
        return self._surface.vertices()

    @property
    def triangles(self) -> np.ndarray:
        """(n, 3) uint32, as given; read-only, without a copy."""
        return self._surface.triangles()

    @property
    def edges(self) -> np.ndarray:
        """(n, 2) uint32: each once, the triangles' sides included, ascending, the lower vertex first; read-only, without a copy."""
        return self._surface.edges()

    @property
    def points(self) -> np.ndarray:
        """(n,) uint32: the vertices that some triangle, edge or point names, ascending; read-only, without a copy."""
        return self._surface.points()

    def __repr__(self) -> str:
        return f"Surface({len(self.triangles)} triangles, {len(self.edges)} edges, {self.vertices} vertices)"


class SurfaceFinder:
    """Finds what of a surface is near itself, when moving vertices meet, and which edges pass through triangles.

        finder = jostle.SurfaceFinder()
        vertex_triangle, edge_edge = finder.near(cloth, positions, 2e-3)
        safe = finder.moving(cloth, positions, next_positions, 1e-3).safe_step

    A pair is a vertex and a triangle, or two edges, that have no vertex in common. `vertices` are its four, and the nearest points
    the sums of `weights` times them: of a vertex and a triangle the first is 1 and the others add up to 1; of two edges the first
    two add up to 1, and so do the others. Weights are exactly 0 for vertices of which the nearest feature has none. `normal` is
    unit, from the vertex or first edge to the other part.

    positions   (n, 3) of float32 or float64, one for each vertex; all is decided in float64. They must be finite, within 1e30
    thickness   (n,): a pair is near if it is within `distance` and the sum of its parts' thicknesses, each its vertices' greatest
    rest        (n, 3): pairs that are near there are left out
    bodies      (n,) whole numbers: pairs of one body are left out
    threads     0 for one per core

    Arrays are the caller's: copied once from the finder's memory, which it keeps. Use a finder for one call at a time: another call
    meanwhile, by a thread, is an Error. surface.hpp states order, errors and cost.
    """

    def __init__(self, *, threads: int = 0) -> None:
        self._finder = _core.SurfaceFinder(_arrays.threads(threads))

    def near(self, surface: Surface, positions: Any, distance: float, *, thickness: Any = None, rest: Any = None,
             bodies: Any = None) -> NearSurface:
        """All pairs within `distance` of each other."""
        at = _positions(positions, "positions")
        found = self._finder.near(_of(surface), at, float(distance), *_options(at.dtype, thickness, rest, bodies), NEAR[at.dtype])
        return NearSurface(*found)

    def moving(self, surface: Surface, start: Any, end: Any, distance: float = 0.0, *, thickness: Any = None, rest: Any = None,
               bodies: Any = None, tolerance: float = 1e-6) -> MovingSurface:
        """All pairs that come within `distance` while each vertex moves straight from `start` to `end`, with the first time in
        [0, 1]. Never late; `tolerance` is that of vertex_triangle_impact."""
        at, to = _positions(start, "start"), _positions(end, "end")
        dtype = np.result_type(at, to)  # the wider of the two has both exactly
        at, to = at.astype(dtype, copy=False), to.astype(dtype, copy=False)
        if at.shape != to.shape:
            raise Error(f"start has the shape {at.shape}, and end {to.shape}: each vertex has one place in both", None, "size_mismatch")
        found = self._finder.moving(_of(surface), at, to, float(distance), *_options(dtype, thickness, rest, bodies),
                                    _tolerance(tolerance), IMPACT[dtype])
        return MovingSurface(*found)

    def crossings(self, surface: Surface, positions: Any, *, bodies: Any = None) -> np.ndarray:
        """The edges that have a point in common with a triangle but no vertex, decided exactly: (m, 2) uint32, the numbers of edge
        and triangle. None: the surface doesn't cross itself."""
        at = _positions(positions, "positions")
        return self._finder.crossings(_of(surface), at, _options(at.dtype, None, None, bodies)[2])

    def release_memory(self) -> None:
        """Gives back the memory that it keeps."""
        self._finder.release_memory()

    def __copy__(self) -> SurfaceFinder:
        raise TypeError("a SurfaceFinder can't be copied: make another one")


def _of(surface: Surface) -> _core.Surface:
    if not isinstance(surface, Surface):
        raise Error(f"surface is a {type(surface).__name__}: it must be a Surface, as jostle.Surface(triangles) is")
    return surface._surface


def _positions(given: Any, name: str, dtype: Any = None) -> np.ndarray:
    out = _arrays.rows(given, name, dtype)
    if out.size == 0 and out.ndim == 1:  # an empty list
        out = out.reshape(0, 3)
    if out.ndim != 2 or out.shape[1] != 3:
        raise Error(f"{name} has the shape {out.shape}: it must be (n, 3)")
    return out


def _options(dtype: Any, thickness: Any, rest: Any, bodies: Any) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray | None]:
    return (None if thickness is None else _arrays.rows(thickness, "thickness", dtype),
            None if rest is None else _positions(rest, "rest", dtype),
            None if bodies is None else _arrays.packed(bodies, "bodies", np.uint32))


def _tolerance(given: float) -> float:
    if not 0 < given <= 1:
        raise Error(f"the tolerance is {given}; give one above 0, up to 1")
    return float(given)


def _corners(given: Any, name: str) -> tuple[np.ndarray, tuple[int, ...]]:
    """Rows of 12 numbers, and the shape that what is said of each has."""
    out = np.ascontiguousarray(_arrays.floats(given, name, np.float64))
    if out.size == 0 and out.ndim == 1:  # an empty list
        out = out.reshape(0, 4, 3)
    if out.ndim < 2 or out.shape[-2:] != (4, 3):
        raise Error(f"{name} has the shape {out.shape}: it must be (n, 4, 3), or (4, 3) for one pair")
    return out.reshape(-1, 12), out.shape[:-2]


def _impacts(kind: int, start: Any, end: Any, distance: float, tolerance: float) -> Any:
    (begin, shape), (to, other) = _corners(start, "start"), _corners(end, "end")
    if shape != other:
        raise Error(f"start is of {shape} pairs, and end of {other}: each vertex has one place in both", None, "size_mismatch")
    return _core.part_impacts(kind, begin, to, float(distance), _tolerance(tolerance)).reshape(shape)[()]


def _distances(kind: int, positions: Any) -> Any:
    corners, shape = _corners(positions, "positions")
    return _core.part_distances(kind, corners).view(DISTANCE).reshape(shape)


def vertex_triangle_impact(start: Any, end: Any, distance: float = 0.0, tolerance: float = 1e-6) -> Any:
    """The first times at which vertices come within `distance` of triangles: (n,) float64 in [0, 1], infinite where they don't.

    start, end  (n, 4, 3) places from and to which the vertex, then the triangle's corners, move straight; (4, 3) for one pair,
                whose time is one number

    Never late, rounding included. Early by rounding only, as a rule; where that takes very long, by `tolerance` times the size at
    most. An Error's `index` is the pair at fault.
    """
    return _impacts(VERTEX_TRIANGLE, start, end, distance, tolerance)


def edge_edge_impact(start: Any, end: Any, distance: float = 0.0, tolerance: float = 1e-6) -> Any:
    """As vertex_triangle_impact, of two edges: the ends of one, then those of the other."""
    return _impacts(EDGE_EDGE, start, end, distance, tolerance)


def vertex_triangle_distance(positions: Any) -> np.ndarray:
    """The distances of vertices and triangles, (n, 4, 3), the vertex first: a structured array of distance, weights (4,) and
    normal (3,), as SurfaceFinder has them. Of one pair, (4, 3), it has no dimensions."""
    return _distances(VERTEX_TRIANGLE, positions)


def edge_edge_distance(positions: Any) -> np.ndarray:
    """As vertex_triangle_distance, of two edges: the ends of one, then those of the other."""
    return _distances(EDGE_EDGE, positions)
