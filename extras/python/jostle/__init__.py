# SPDX-License-Identifier: MIT
"""Jostle: collision detection. It finds exactly which boxes touch, on all cores, and answers what follows from that.

    import jostle, numpy as np
    boxes = np.random.random((1000, 2, 3)); boxes[:, 1] = boxes[:, 0] + 0.05
    pairs = jostle.find_pairs(boxes)          # (m, 2) uint32

Boxes are arrays of shape (n, 2, d) or (n, 2 d), d = 2 or 3, float32 or float64: lower bounds, then upper ones. They are read
in place, strided or not. Whole numbers become float64, and are refused where that would round them. All sources of numbers are
accepted: NumPy, the buffer protocol, __array_interface__, DLPack, lists.

Boxes are closed, so touching counts, and they are compared in their own dtype, without missing or extra pairs. The answer and its
order depend on the boxes alone, not on threads or machine. Python's global lock is released while the library works.

Mistakes raise `Error`, a ValueError, with the object's `index`; for ids that don't exist it is an IndexError as well. A call that
failed changes nothing, unless its documentation says otherwise.
"""
from __future__ import annotations

import warnings as _warnings

from . import ase, trimesh
from ._closed_mesh import ClosedMesh
from ._contacts import (ContactFinder, bounds, contacts, distances, impacts, ray_casts, shape_casts, sum_by_object,
                        touching)
from ._core import instruction_sets, version
from ._errors import Error, NoSuchObjectError, StaleIdError
from ._index import BoxIndex
from ._lists import Answers, ClosePairs, Hits, ShapeAnswers
from ._neighbors import NeighborFinder, neighbors
from ._pairs import PairFinder, ScenePairs, find_pairs, find_periodic_pairs, find_scenes, iter_pairs, join, spatial_order
from ._plot import plot
from ._queries import (Queries, frustums, nearest, nearest_to_boxes, nearest_to_shapes, overlapping, posed_shapes, rays, shape_sweeps,
                       spheres, sweeps)
from ._shapes import (Shape, Shapes, box, capsule, compound, cone, cylinder, ellipsoid, half_space, height_field, hull, mesh,
                      motions, poses, rounded_box, rounded_hull, sphere)
from ._surfaces import (MovingSurface, NearSurface, Surface, SurfaceFinder, edge_edge_distance, edge_edge_impact, vertex_triangle_distance,
                        vertex_triangle_impact)
from ._world import EndedPairs, PairSlots, World

__version__ = version()
if list(instruction_sets()) == ["scalar"]:  # pip shows nothing of what the build says
    _warnings.warn("jostle works without SIMD, several times as slow: it was built without Google Highway (Debian: "
                   "libhwy-dev), or this processor has nothing of the kind", RuntimeWarning, stacklevel=2)
__all__ = ["Answers", "BoxIndex", "ClosePairs", "ClosedMesh", "ContactFinder", "EndedPairs", "Error", "Hits", "MovingSurface", "NearSurface", "NeighborFinder",
           "NoSuchObjectError",
           "PairFinder", "PairSlots", "Queries", "ScenePairs", "Shape", "ShapeAnswers",
           "Shapes", "StaleIdError", "Surface", "SurfaceFinder", "World", "ase", "bounds", "box", "capsule",
           "compound", "cone", "contacts", "cylinder", "distances", "edge_edge_distance", "edge_edge_impact", "ellipsoid", "find_pairs",
           "find_periodic_pairs", "find_scenes", "frustums", "half_space", "height_field", "hull", "impacts",
           "instruction_sets", "iter_pairs", "join", "mesh", "motions", "nearest", "nearest_to_boxes",
           "nearest_to_shapes", "neighbors", "overlapping", "plot", "posed_shapes",
           "poses", "ray_casts", "rays", "rounded_box", "rounded_hull", "shape_casts", "shape_sweeps", "spatial_order", "sphere", "spheres",
           "sum_by_object", "sweeps", "touching", "trimesh", "version", "vertex_triangle_distance", "vertex_triangle_impact"]
