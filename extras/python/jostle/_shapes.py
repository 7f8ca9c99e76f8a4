# SPDX-License-Identifier: MIT
"""Shapes and poses."""
from __future__ import annotations

from typing import Any, Sequence

import numpy as np

from . import _arrays, _core
from ._errors import Error

Shape = _core.Shape


def sphere(radius: float, dim: int = 3) -> Shape:
    """All points within `radius`; in 2D a circle."""
    return _core.sphere(dim, radius)


def capsule(half_length: float, radius: float, dim: int = 3) -> Shape:
    """All points within `radius` of the segment from -half_length to half_length on the y axis."""
    return _core.capsule(dim, half_length, radius)


def box(half: Any) -> Shape:
    """All points with |x| <= half[0] and so on: 2 or 3 numbers."""
    return _core.box(_arrays.rows(half, "half", np.float64), 0)


def rounded_box(half: Any, radius: float) -> Shape:
    """All points within `radius` of box(half)."""
    return _core.box(_arrays.rows(half, "half", np.float64), radius)


def cylinder(half_length: float, radius: float) -> Shape:
    """All points within `radius` of the y axis, from -half_length to half_length."""
    return _core.cylinder(half_length, radius)


def cone(half_length: float, radius: float) -> Shape:
    """From a disc of `radius` at y = -half_length to its tip at y = half_length."""
    return _core.cone(half_length, radius)


def ellipsoid(half: Any) -> Shape:
    """An ellipsoid with semi-axes `half`: 3 numbers, or 2 numbers for an ellipse in 2D."""
    return _core.ellipsoid(_arrays.rows(half, "half", np.float64))


def half_space(normal: Any, offset: float = 0.0) -> Shape:
    """The points p with normal . p <= offset * |normal|: everything below a plane."""
    return _core.half_space(_arrays.rows(normal, "normal", np.float64), offset)


def hull(points: Any) -> Shape:
    """The convex hull of points (n, d). hull.vertices() and hull.faces() return the result; a mesh has them, too."""
    given = _arrays.rows(points, "points")
    return _core.hull(_space(given, "points", given.shape[-1] if given.ndim else 0), given, 0)


def rounded_hull(points: Any, radius: float) -> Shape:
    """All points within `radius` of hull(points)."""
    given = _arrays.rows(points, "points")
    return _core.hull(_space(given, "points", given.shape[-1] if given.ndim else 0), given, radius)


def mesh(vertices: Any, elements: Any, weld: float = 0.0) -> Shape:
    """A surface: vertices (n, 3) and triangles (m, 3), or in 2D (n, 2) and segments (m, 2).

    Vertices at the same place count as one. Those within `weld` of an earlier one are moved to it."""
    given = _arrays.rows(vertices, "vertices")
    return _core.mesh(_space(given, "vertices", given.shape[-1] if given.ndim else 0), given,
                      _arrays.packed(elements, "elements", np.uint32), weld)


def height_field(heights: Any, spacing_x: float = 1.0, spacing_z: float = 1.0, thickness: float = 0.0) -> Shape:
    """Terrain: heights (rows, columns) along y, over the x-z plane, solid below."""
    return _core.height_field(_arrays.rows(heights, "heights", np.float64), spacing_x, spacing_z, thickness)


def compound(shapes: Sequence[Shape], poses: Any) -> Shape:
    """Several shapes that move as one, each with its pose."""
    children = [_shape(shape, i) for i, shape in enumerate(shapes)]
    if not children:
        raise Error("a compound needs at least one shape")
    return _core.compound(children[0].dim, children, np.atleast_2d(_arrays.rows(poses, "poses", np.float64)))


def _space(given: np.ndarray, name: str, dim: int) -> int:
    if (dim, given.dtype) not in _arrays.SPACES:
        raise Error(f"{name} has the shape {given.shape}: it must be (n, 2) or (n, 3)")
    return _arrays.SPACES[dim, given.dtype]


def _shape(given: Any, i: int) -> Shape:
    if not isinstance(given, Shape):
        raise Error(f"shapes[{i}] is of the type {type(given).__name__}: it must be a Shape, as jostle.sphere and others make them", i)
    return given


class Shapes:
    """One shape per object, at the object's position.

        shapes = jostle.Shapes.spheres(radii)
        shapes = jostle.Shapes([jostle.sphere(1), jostle.box([1, 2, 3])])
        shapes = jostle.Shapes.same(hull, 1000)
    """

    def __init__(self, shapes: Sequence[Shape] = (), dim: int | None = None) -> None:
        if dim is None:
            dim = _shape(shapes[0], 0).dim if len(shapes) else 3
        self._shapes = _core.Shapes(dim)
        self.extend(shapes)

    @classmethod
    def same(cls, shape: Shape, count: int) -> Shapes:
        """`count` objects of one shape."""
        made = cls(dim=shape.dim)
        made.append(shape, count)
        return made

    @classmethod
    def spheres(cls, radii: Any, dim: int = 3) -> Shapes:
        made = cls(dim=dim)
        made._shapes.add_spheres(_arrays.rows(radii, "radii", np.float64))
        return made

    @classmethod
    def capsules(cls, half_lengths: Any, radii: Any, dim: int = 3) -> Shapes:
        made = cls(dim=dim)
        made._shapes.add_capsules(_arrays.rows(half_lengths, "half_lengths", np.float64),
                                  _arrays.rows(radii, "radii", np.float64))
        return made

    @classmethod
    def boxes(cls, halves: Any) -> Shapes:
        given = _arrays.rows(halves, "halves", np.float64)
        made = cls(dim=given.shape[-1] if given.ndim == 2 else 3)
        made._shapes.add_boxes(given)
        return made

    @property
    def dim(self) -> int:
        return self._shapes.dim

    @property
    def repeats(self) -> bool:
        """Whether the shapes serve for a whole multiple of len(self) poses, over and over: object i has shape i % len(self). So the
        shapes of a robot's links serve for any number of its configurations. At first they don't."""
        return self._shapes.repeats

    @repeats.setter
    def repeats(self, wish: bool) -> None:
        self._shapes.repeats = bool(wish)

    def append(self, shape: Shape, count: int = 1) -> None:
        """Adds an object, or several of the same shape."""
        if count < 0:
            raise Error(f"count is {count}")
        self._shapes.add(shape, count)

    def extend(self, shapes: Sequence[Shape] | Shapes) -> None:
        """Adds an object for each of these shapes."""
        if isinstance(shapes, Shapes):
            return self._shapes.add_from(shapes._shapes)
        added = _core.Shapes(self.dim)  # all of them, or none if one can't be added
        for i, shape in enumerate(shapes):
            added.add(_shape(shape, i), 1)
        self._shapes.add_from(added)

    def clear(self) -> None:
        self._shapes.clear()

    def __copy__(self) -> Shapes:
        other = Shapes(dim=self.dim)
        other.extend(self)
        other.repeats = self.repeats
        return other

    def __setitem__(self, i: int, shape: Shape) -> None:
        if not -len(self) <= i < len(self):
            raise IndexError(f"there are {len(self)} shapes, and none of number {i}")
        self._shapes.set(i % len(self), shape)

    def __len__(self) -> int:
        return self._shapes.size()

    def __repr__(self) -> str:
        return f"Shapes({len(self)}, {self.dim}D)"


def poses(positions: Any, rotations: Any = None) -> np.ndarray:
    """Poses from positions (n, d) and rotations: in 3D quaternions x, y, z, w, (n, 4) or (4,), or matrices, (n, 3, 3) or (3, 3); in 2D
    angles, (n,) or one."""
    at = _arrays.floats(positions, "positions")
    if at.ndim != 2 or at.shape[1] not in (2, 3):
        raise Error(f"positions has the shape {at.shape}: it must be (n, 2) or (n, 3); of transforms (n, 4, 4) give positions [:, :3, 3] "
                    "and rotations [:, :3, :3]")
    flat = at.shape[1] == 2
    out = np.zeros((len(at), 4 if flat else 7), at.dtype)
    out[:, :at.shape[1]] = at
    if rotations is None:
        rotations = 0.0 if flat else (0, 0, 0, 1)
    turns = _arrays.numbers(rotations, "rotations")
    kinds: list[tuple[int, ...]] = [()] if flat else [(4,), (3, 3)]
    if turns.shape not in [shape for one in kinds for shape in (one, (1, *one), (len(at), *one))]:  # NumPy would stretch others to fit
        wanted = ", ".join(str(shape) for one in kinds for shape in (one, (len(at), *one)))
        raise Error(f"rotations has the shape {turns.shape}, and there are {len(at)} positions in {at.shape[1]}D: it must be one of "
                    f"{wanted}", None, "size_mismatch")
    if flat:
        out[:, 2], out[:, 3] = np.cos(turns), np.sin(turns)
    else:
        out[:, 3:] = _quaternions(turns) if turns.shape[-1] == 3 else turns
    return out


def _quaternions(matrices: np.ndarray) -> np.ndarray:
    """Unit quaternions of rotation matrices (..., 3, 3)."""
    m = matrices.reshape(-1, 3, 3)
    with np.errstate(invalid="ignore", over="ignore"):
        drift = np.abs(m @ m.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0)
        good = (drift < 1e-3) & (np.linalg.det(m) > 0)  # and no NaN
    if not good.all():
        at = int(np.argmin(good))
        raise Error(f"rotations[{at}] is no rotation: its columns must be unit vectors at right angles, and its determinant 1", at)
    # Four times the products of the quaternion's numbers: the row with the greatest square loses no digits.
    x, y, z = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    products = np.empty((len(m), 4, 4))
    for i, square in enumerate((1 + x - y - z, 1 - x + y - z, 1 - x - y + z, 1 + x + y + z)):
        products[:, i, i] = square
    for i, j, product in ((0, 1, m[:, 1, 0] + m[:, 0, 1]), (0, 2, m[:, 2, 0] + m[:, 0, 2]), (1, 2, m[:, 2, 1] + m[:, 1, 2]),
                          (0, 3, m[:, 2, 1] - m[:, 1, 2]), (1, 3, m[:, 0, 2] - m[:, 2, 0]), (2, 3, m[:, 1, 0] - m[:, 0, 1])):
        products[:, i, j] = products[:, j, i] = product
    best = products[np.arange(len(m)), np.diagonal(products, axis1=1, axis2=2).argmax(axis=1)]
    return (best / np.linalg.norm(best, axis=1, keepdims=True)).reshape(*matrices.shape[:-2], 4)


def motions(starts: Any, ends: Any) -> np.ndarray:
    """The motions from poses to others, for ContactFinder.impacts: each object goes straight on, and turns at an even rate about the one
    axis and the shorter way that lead there. A half turn may go either way. Poses are rows, as jostle.poses makes them."""
    a, b = _arrays.floats(starts, "starts"), _arrays.floats(ends, "ends")
    if a.ndim != 2 or a.shape[1] not in (4, 7) or a.shape != b.shape:
        raise Error(f"starts has the shape {a.shape} and ends {b.shape}: both must be (n, 7), or (n, 4) in 2D", None, "size_mismatch")
    number = np.result_type(a, b)
    a, b = a.astype(np.float64), b.astype(np.float64)
    if a.shape[1] == 4:
        (c, s), (u, v) = a[:, 2:].T, b[:, 2:].T
        return np.column_stack([a, b[:, :2] - a[:, :2], np.arctan2(c * v - s * u, c * u + s * v)]).astype(number)
    from_, to = a[:, 3:], b[:, 3:]
    w = (from_ * to).sum(axis=1)
    axis = from_[:, 3:] * to[:, :3] - to[:, 3:] * from_[:, :3] - np.cross(to[:, :3], from_[:, :3])
    length = np.linalg.norm(axis, axis=1)
    scale = np.divide(2 * np.arctan2(length, np.abs(w)), length, out=np.zeros_like(length), where=length > 0)
    return np.column_stack([a, b[:, :3] - a[:, :3], axis * (np.where(w < 0, -1, 1) * scale)[:, None]]).astype(number)
