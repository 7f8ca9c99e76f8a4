# SPDX-License-Identifier: MIT
"""The collision manager of trimesh, on this library: the calls and answers of trimesh.collision (4), for any number of contacts.

    from jostle.trimesh import CollisionManager      # instead of: from trimesh.collision import CollisionManager

Neither trimesh nor FCL is imported: whatever has `vertices` and `faces` is a mesh. As in trimesh, a mesh that says `is_convex` is a
solid, and any other one is a surface: what lies wholly within it, without touching it, doesn't collide.
"""
from __future__ import annotations

import hashlib
import math
import weakref
from typing import Any, Callable, Hashable, Iterable, Sequence

import numpy as np

from . import _arrays
from ._contacts import ContactFinder
from ._core import Shape
from ._errors import Error, NoSuchObjectError
from ._index import BoxIndex
from ._pairs import find_pairs
from ._queries import nearest_to_shapes
from ._shapes import Shapes, hull, mesh as surface_of, poses as poses_of, sphere

__all__ = ["CollisionManager", "ContactData", "DistanceData", "scene_to_collision"]

_ALONE = "__external"  # what trimesh calls the mesh that isn't in the manager
_RIGID = 1e-6  # how far the products of a rotation's columns may be from what they should be: float32 is exact to 3e-7


# --- Meshes ---

class _Source:
    """A mesh as it was given."""

    def __init__(self, given: Any, solid: bool | None) -> None:
        if not (hasattr(given, "vertices") and hasattr(given, "faces")):
            raise Error(f"mesh is of the type {type(given).__name__}, which has no vertices and faces")
        self.vertices = np.array(_arrays.floats(given.vertices, "vertices", np.float64), np.float64, subok=False)
        self.faces = np.array(_arrays.packed(given.faces, "faces", np.uint32), subok=False)
        if self.faces.size == 0:
            raise Error("the mesh has no faces")
        for name, of in (("vertices", self.vertices), ("faces", self.faces)):
            if of.ndim != 2 or of.shape[1] != 3:
                raise Error(f"{name} has the shape {of.shape}: it must be (n, 3)")
        wrong = (self.faces >= len(self.vertices)).any(axis=1)
        if wrong.any():
            at = int(np.argmax(wrong))
            raise Error(f"faces[{at}] is {self.faces[at].tolist()}, and there are {len(self.vertices)} vertices", at)
        self.solid = bool(getattr(given, "is_convex", False)) if solid is None else solid
        told = hashlib.blake2b(self.vertices.tobytes(), digest_size=16)
        told.update(self.faces.tobytes())
        told.update(b"%d %d" % (len(self.vertices), self.solid))
        self.key = told.digest()


class _Body:
    """A mesh as it collides, perhaps stretched. Equal ones are one object, as long as somebody has it."""

    known: weakref.WeakValueDictionary[bytes, _Body] = weakref.WeakValueDictionary()

    def __init__(self, source: _Source, stretch: np.ndarray | None) -> None:
        self.source, self.stretch, self.solid = source, stretch, source.solid
        self._surface: Shape | None = None
        corners = self._vertices()[np.unique(source.faces)]
        self.shape = hull(corners) if self.solid else self.surface()
        low, high = corners.min(axis=0), corners.max(axis=0)
        center = low / 2 + high / 2
        radius = np.linalg.norm(corners - center, axis=1).max()
        #: The centre, half the size and the radius of what is around it: see _Objects._catch_up.
        self.around = np.r_[center, high / 2 - low / 2, radius]

    @classmethod
    def of(cls, source: _Source, stretch: np.ndarray | None) -> _Body:
        key = source.key + (b"" if stretch is None else stretch.tobytes())
        body = cls.known.get(key)
        if body is None:
            body = cls.known[key] = cls(source, stretch)
        return body

    def with_stretch(self, stretch: np.ndarray | None) -> _Body:
        same = stretch is self.stretch
        if not same and stretch is not None and self.stretch is not None:  # of a turned object, up to rounding
            same = bool(np.abs(stretch - self.stretch).max() <= 1e-13 * np.abs(stretch).max())
        return self if same else _Body.of(self.source, stretch)

    def _vertices(self) -> np.ndarray:
        return self.source.vertices if self.stretch is None else self.source.vertices @ self.stretch

    def surface(self) -> Shape:
        """Its faces, which have the numbers that they have in the mesh."""
        if self._surface is None:
            self._surface = surface_of(self._vertices(), self.source.faces)
        return self._surface

    def face_at(self, pose: np.ndarray, point: np.ndarray) -> int:
        """The face that is nearest to a point on the surface, which may be off it by rounding."""
        pair = Shapes([sphere(0), self.surface()])
        at = np.stack([np.r_[point, 0, 0, 0, 1], pose])
        size = float(np.ptp(self._vertices(), axis=0).max())
        margin = 1e-9 * size
        while True:
            found = _finder(0).find_points(pair, at, [(0, 1)], margin)
            if len(found):
                return int(found["part_b"][np.argmax(found["depth"])])
            margin = 8 * margin + 1e-300


def _about(who: str, why: Error) -> Error:
    return type(why)(f"{who}: {why}", why.index, why.status)


def _finder(threads: int) -> ContactFinder:
    return ContactFinder(3, np.float64, threads, all_points=True)


# --- Transforms ---

def _is_rigid(t: list[list[float]]) -> bool:
    """Whether these rows are a rotation and a translation. In plain numbers, since each of many objects is moved by a call."""
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = t
    return (abs(a * a + b * b + c * c - 1) < _RIGID and abs(d * d + e * e + f * f - 1) < _RIGID and abs(g * g + h * h + i * i - 1) < _RIGID
            and abs(a * d + b * e + c * f) < _RIGID and abs(a * g + b * h + c * i) < _RIGID and abs(d * g + e * h + f * i) < _RIGID
            and a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0 and math.isfinite(x + y + z)
            and last[0] == 0 and last[1] == 0 and last[2] == 0 and last[3] == 1)


def _split(transform: np.ndarray, who: str) -> tuple[np.ndarray, np.ndarray | None]:
    """A transform as a stretch of the mesh, if it has one, and a rigid transform after that. The stretch is that of the polar
    decomposition, which stays the same while the object turns. What mirrors is a stretch by negative numbers."""
    if _is_rigid(transform.tolist()):
        return transform, None
    if not np.isfinite(transform).all():
        row, column = np.argwhere(~np.isfinite(transform))[0]
        raise Error(f"{who}[{row}, {column}] is {transform[row, column]}: a transform has finite numbers")
    if (transform[3] != (0, 0, 0, 1)).any():
        raise Error(f"{who}[3] is {transform[3].tolist()}: the last row of a transform is 0, 0, 0, 1")
    u, sizes, v = np.linalg.svd(transform[:3, :3])
    turn, stretch = u @ v, (v.T * sizes) @ v  # rows are multiplied from the right, and the stretch is symmetric
    if np.linalg.det(turn) < 0:
        turn, stretch = -turn, -stretch
    rigid = transform.copy()
    rigid[:3, :3] = turn
    return rigid, np.ascontiguousarray(stretch)


def _transform(given: Any, who: str) -> np.ndarray:
    if given is None:
        return np.eye(4)
    t = given if type(given) is np.ndarray and given.dtype == np.float64 else np.asarray(_arrays.floats(given, who), np.float64)
    if t.shape != (4, 4):
        raise Error(f"{who} has the shape {t.shape}: it must be (4, 4)")
    return t


# --- Objects ---

class _Objects:
    """Named bodies with their transforms: of a manager, or the one mesh that a query is about. The lists and arrays may be longer
    than there are objects; what comes after them is what removed ones have left."""

    def __init__(self) -> None:
        self.names: list[Any] = []
        self.slots: dict[Any, int] = {}
        self.bodies: list[_Body] = []
        self.shapes = Shapes(dim=3)
        self._transforms = np.zeros((0, 4, 4))
        self._poses, self._boxes = np.zeros((0, 7)), np.zeros((0, 2, 3))
        self._around = np.zeros((0, 7))
        self._moved: set[int] = set()
        self._index: BoxIndex | None = None

    def __len__(self) -> int:
        return len(self.names)

    def put(self, name: Any, body: _Body, rigid: np.ndarray) -> None:
        """Adds an object, or replaces the one of this name."""
        slot = self.slots.get(name, len(self.names))
        if slot == len(self._transforms):
            grown = max(8, 2 * slot)
            self._transforms = np.concatenate([self._transforms, np.zeros((grown - slot, 4, 4))])
            self._poses = np.concatenate([self._poses, np.tile((0.0, 0, 0, 0, 0, 0, 1), (grown - slot, 1))])
            self._boxes = np.concatenate([self._boxes, np.zeros((grown - slot, 2, 3))])
            self._around = np.concatenate([self._around, np.zeros((grown - slot, 7))])
        if slot == len(self.shapes):
            self.shapes.append(body.shape)
        self.place(slot, body, rigid)
        if slot == len(self.names):
            self.names.append(name)
            self.slots[name] = slot

    def place(self, slot: int, body: _Body, rigid: np.ndarray) -> None:
        if slot == len(self.bodies) or body is not self.bodies[slot]:
            self.shapes[slot], self._around[slot] = body.shape, body.around
            self.bodies[slot:slot + 1] = [body]
        self._transforms[slot] = rigid
        self._moved.add(slot)

    def remove(self, slot: int) -> None:
        """The last object takes the place of this one."""
        last = len(self.names) - 1
        self.place(slot, self.bodies[last], self._transforms[last])
        del self.slots[self.names[slot]]
        if slot != last:
            self.names[slot] = self.names[last]
            self.slots[self.names[slot]] = slot
        self.names.pop()
        self.bodies.pop()
        self._moved.discard(last)
        self._index = None

    def _catch_up(self) -> None:
        if not self._moved:
            return
        moved = np.fromiter(self._moved, np.int64, len(self._moved))
        moved.sort()
        turn, at = self._transforms[moved, :3, :3], self._transforms[moved, :3, 3]
        # A box around the turned box and around the ball, which costs the same for any mesh. What is added covers rounding, and what
        # a rotation may be off by.
        center, half, radius = np.split(self._around[moved], (3, 6), axis=1)
        reach = np.minimum((np.abs(turn) @ half[:, :, None])[:, :, 0], radius)
        reach += 8 * _RIGID * (radius + np.abs(center).sum(axis=1, keepdims=True)) + 1e-14 * np.abs(at)
        middle = (turn @ center[:, :, None])[:, :, 0] + at
        boxes = np.stack([middle - reach, middle + reach], axis=1)
        poses = poses_of(at, turn)
        self._poses[moved], self._boxes[moved] = poses, boxes
        self._moved.clear()
        self._index = None

    def placed(self) -> tuple[Shapes, np.ndarray]:
        """Shapes and poses, as a ContactFinder takes them."""
        self._catch_up()
        return self.shapes, self._poses[:len(self.shapes)]

    def boxes(self) -> np.ndarray:
        self._catch_up()
        return self._boxes[:len(self)]

    def index(self) -> BoxIndex:
        self._catch_up()
        if self._index is None:
            self._index = BoxIndex(self.boxes())
        return self._index

    def solid(self) -> np.ndarray:
        return np.fromiter((body.solid for body in self.bodies), bool, len(self))


class _Pairs:
    """What contacts or distances are of: pairs of objects with the bodies and poses that they had."""

    def __init__(self, names: Sequence[tuple[Any, Any]], a: _Objects, b: _Objects, pairs: np.ndarray) -> None:
        self.names = names
        self._bodies = [(a.bodies[i], b.bodies[k]) for i, k in pairs.tolist()]
        self._poses = a.placed()[1][pairs[:, 0]], b.placed()[1][pairs[:, 1]]

    def positions(self, side: int) -> np.ndarray:
        return self._poses[side][:, :3]

    def is_solid(self, k: int, side: int) -> bool:
        return self._bodies[k][side].solid

    def face_at(self, k: int, side: int, point: np.ndarray) -> int:
        return self._bodies[k][side].face_at(self._poses[side][k], point)


def _side(names: tuple[Any, Any], name: Any) -> int:
    """Which of the two has this name; of two with the same the second, as in trimesh."""
    for side in (1, 0):
        if names[side] == name:
            return side
    raise KeyError(name)


class ContactData:
    """A point at which two objects touch.

    names   the two names: a set, as in trimesh
    normal  the unit direction in which the second object leaves the first; the first is the one that comes first in the names that
            the call returns, of a mesh and the manager's object the latter
    point   in the middle of the overlap
    depth   how deep they overlap along the normal there; below 0 it is a gap within the margin
    """

    __slots__ = ("_pairs", "_pair", "_faces", "normal", "point", "depth")

    def __init__(self, pairs: _Pairs, pair: int, faces: tuple[int, int], normal: np.ndarray, point: np.ndarray, depth: float) -> None:
        self._pairs, self._pair, self._faces = pairs, pair, faces
        self.normal, self.point, self.depth = normal, point, depth

    @property
    def names(self) -> set[Any]:
        return set(self._pairs.names[self._pair])

    def index(self, name: Any) -> int:
        """The face of the mesh of this name that touches."""
        side = _side(self._pairs.names[self._pair], name)
        if not self._pairs.is_solid(self._pair, side):
            return self._faces[side]
        return self._pairs.face_at(self._pair, side, self.point + (0.5 - side) * self.depth * self.normal)

    def __repr__(self) -> str:
        return f"ContactData({self.names}, depth={self.depth})"


class DistanceData:
    """How near two objects are to each other.

    names     the two names: a set, as in trimesh
    distance  below 0 for solids that overlap, by how deep; of surfaces that touch 0
    """

    __slots__ = ("_pairs", "_points", "distance")

    def __init__(self, pairs: _Pairs, points: tuple[np.ndarray, np.ndarray], distance: float) -> None:
        self._pairs, self._points, self.distance = pairs, points, distance

    @property
    def names(self) -> set[Any]:
        return set(self._pairs.names[0])

    def point(self, name: Any) -> np.ndarray:
        """The nearest point of the mesh of this name."""
        return self._points[_side(self._pairs.names[0], name)]

    def index(self, name: Any) -> int:
        """The face that this point is of."""
        side = _side(self._pairs.names[0], name)
        return self._pairs.face_at(0, side, self._points[side])

    def __repr__(self) -> str:
        return f"DistanceData({self.names}, distance={self.distance})"


# --- The manager ---

class CollisionManager:
    """Named meshes, and which of them collide: trimesh's calls and answers.

        manager = jostle.trimesh.CollisionManager()
        manager.add_object("table", table)                           # anything with vertices and faces
        manager.add_object("arm", arm, transform)                    # (4, 4); scale, shear and mirroring are applied to the mesh
        manager.in_collision_internal(return_names=True)             # (True, {("arm", "table")})

    solid    None: meshes that say is_convex are solids, the others surfaces, as in trimesh. True: all are solids, of which only the
             convex hull counts. False: all are surfaces
    threads  0 for one per core

    What trimesh hasn't: pairs to ignore, a `margin`, set_transforms and the *_each calls for many poses at once. Contacts come for all
    triangles that touch, without a limit. One thread at a time may use a manager.
    """

    def __init__(self, *, solid: bool | None = None, threads: int = 0) -> None:
        self._solid, self._threads = solid, _arrays.threads(threads)
        self._objects = _Objects()
        self._finder = _finder(self._threads)
        self._ignored: set[frozenset[Any]] = set()
        self._ignored_keys: np.ndarray | None = np.empty(0, np.uint64)  # None: to be made from the names
        self._asked: _Body | None = None  # the last mesh that wasn't ours: it often comes again

    def add_object(self, name: Hashable, mesh: Any, transform: Any = None) -> None:
        """Adds a mesh, or replaces the one of this name."""
        try:
            rigid, stretch = _split(_transform(transform, "transform"), "transform")
            body = _Body.of(_Source(mesh, self._solid), stretch)
        except Error as why:
            raise _about(f"object {name!r}", why) from None
        self._objects.put(name, body, rigid)
        self._ignored_keys = None

    def remove_object(self, name: Hashable) -> None:
        """Removes a mesh. Its pairs aren't ignored any longer."""
        self._objects.remove(self._slot(name))
        self._ignored = {pair for pair in self._ignored if name not in pair}
        self._ignored_keys = None

    def set_transform(self, name: Hashable, transform: Any) -> None:
        """Moves a mesh to where it is by this transform from where it was made."""
        self._objects.place(*self._move(name, transform))

    def set_transforms(self, names: Iterable[Hashable], transforms: Any) -> None:
        """Moves many meshes, by (n, 4, 4), or none of them if one can't be moved."""
        of = list(names)
        if len(of) != len(transforms):
            raise Error(f"there are {len(of)} names and {len(transforms)} transforms", None, "size_mismatch")
        moves = [self._move(name, given) for name, given in zip(of, transforms)]
        for slot, body, rigid in moves:
            self._objects.place(slot, body, rigid)

    def _move(self, name: Hashable, given: Any) -> tuple[int, _Body, np.ndarray]:
        slot = self._slot(name)
        try:
            rigid, stretch = _split(_transform(given, "transform"), "transform")
            return slot, self._objects.bodies[slot].with_stretch(stretch), rigid
        except Error as why:
            raise _about(f"object {name!r}", why) from None

    def __len__(self) -> int:
        return len(self._objects)

    def __contains__(self, name: Hashable) -> bool:
        return name in self._objects.slots

    def __repr__(self) -> str:
        return f"CollisionManager({len(self)} objects)"

    # --- Pairs to ignore ---

    def set_pair_ignored(self, name1: Hashable, name2: Hashable, ignored: bool = True) -> None:
        """Leaves a pair out of what *_internal finds, such as two links at their joint; or takes it in again."""
        for name in (name1, name2):
            self._slot(name)
        if name1 == name2:
            raise Error(f"{name1!r} is no pair with itself")
        (self._ignored.add if ignored else self._ignored.discard)(frozenset((name1, name2)))
        self._ignored_keys = None

    def is_pair_ignored(self, name1: Hashable, name2: Hashable) -> bool:
        return frozenset((name1, name2)) in self._ignored

    @property
    def ignored_pairs(self) -> set[tuple[Any, Any]]:
        """The names of the pairs, each in alphabetical order."""
        return {_sorted(*pair) for pair in self._ignored}

    def clear_ignored_pairs(self) -> None:
        self._ignored.clear()
        self._ignored_keys = None

    def _wanted(self, pairs: np.ndarray) -> np.ndarray:
        """Of pairs of this manager's objects those that aren't ignored."""
        if self._ignored_keys is None:
            slots = self._objects.slots
            of = [sorted(slots[name] for name in pair) for pair in self._ignored]
            self._ignored_keys = _keys(np.array(of, np.uint32).reshape(-1, 2))
        if not len(self._ignored_keys):
            return pairs
        return pairs[~np.isin(_keys(pairs), self._ignored_keys)]

    # --- Collisions ---

    def in_collision_single(self, mesh: Any, transform: Any = None, return_names: bool = False, return_data: bool = False, *,
                            margin: float = 0.0) -> Any:
        """Whether a mesh touches any object, or is nearer than a margin: a bool; with return_names also the set of those objects'
        names, with return_data also a list of ContactData."""
        return self._collide(self._alone(mesh, [transform], _ALONE), lambda a, b: a, return_names, return_data, margin)

    def in_collision_internal(self, return_names: bool = False, return_data: bool = False, *, margin: float = 0.0) -> Any:
        """Whether any two objects touch: as in_collision_single, but names are pairs, each in alphabetical order."""
        return self._collide(None, lambda a, b: (a, b), return_names, return_data, margin)

    def in_collision_other(self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False, *,
                           margin: float = 0.0) -> Any:
        """Whether any object touches one of another manager: names are pairs, the first of this manager."""
        return self._collide(_manager(other_manager)._objects, lambda a, b: (a, b), return_names, return_data, margin)

    def in_collision_each(self, mesh: Any, transforms: Any, *, margin: float = 0.0) -> np.ndarray:
        """Whether a mesh touches any object, for each of many transforms, (m, 4, 4): (m,) bool."""
        alone = self._alone(mesh, transforms)
        out = np.zeros(len(alone), bool)
        out[self._touching(alone, _margin(margin))[:, 1]] = True
        return out

    def _collide(self, others: _Objects | None, named: Callable[[Any, Any], Any], return_names: bool, return_data: bool,
                 margin: float) -> Any:
        margin = _margin(margin)
        if not (return_names or return_data) and margin == 0:
            pairs = self._candidates(others, margin)
            return bool(self._finder.first_touching(*self._with(others, pairs), offsets=[0, len(pairs)], **self._and(others))[0] >= 0)
        pairs = self._touching(others, margin)
        answer: list[Any] = [len(pairs) > 0]
        if return_names or return_data:
            ordered, names = self._names(others, pairs)
        if return_names:
            answer.append({named(*pair) for pair in names})
        if return_data:
            answer.append(self._contacts(others, ordered, names, margin))
        return answer[0] if len(answer) == 1 else tuple(answer)

    def _with(self, others: _Objects | None, pairs: np.ndarray) -> tuple[Shapes, np.ndarray, np.ndarray]:
        return *self._objects.placed(), pairs

    def _and(self, others: _Objects | None) -> dict[str, Any]:
        return {} if others is None else dict(zip(("shapes_b", "poses_b"), others.placed()))

    def _candidates(self, others: _Objects | None, margin: float) -> np.ndarray:
        """The pairs whose boxes are no further apart than the margin."""
        own = self._objects.boxes()
        if margin:
            by = np.array([[-0.5], [0.5]]) * margin
            own = np.nextafter(own + by, np.array([[-np.inf], [np.inf]]))
        if others is None:
            return self._wanted(find_pairs(own, order="sorted", threads=self._threads))
        theirs = others.boxes()
        if margin:
            theirs = np.nextafter(theirs + by, np.array([[-np.inf], [np.inf]]))
        return find_pairs(own, theirs, order="sorted", threads=self._threads)

    def _touching(self, others: _Objects | None, margin: float) -> np.ndarray:
        pairs = self._candidates(others, margin)
        given = self._with(others, pairs)
        if margin == 0:
            return pairs[self._finder.touching(*given, **self._and(others))]
        return pairs[self._finder.distances(*given, max_distance=margin, **self._and(others))["distance"] <= margin]

    def _names(self, others: _Objects | None, pairs: np.ndarray) -> tuple[np.ndarray, list[tuple[Any, Any]]]:
        """The names of pairs, and the pairs in the order of their names: one manager's own are in alphabetical order."""
        own = self._objects.names
        if others is not None:
            return pairs, [(own[i], others.names[k]) for i, k in pairs.tolist()]
        names = [(own[i], own[k]) for i, k in pairs.tolist()]
        ordered = [_sorted(*pair) for pair in names]
        turned = np.fromiter((a[0] is not b[0] for a, b in zip(names, ordered)), bool, len(names))
        pairs = pairs.copy()
        pairs[turned] = pairs[turned, ::-1]
        return pairs, ordered

    def _contacts(self, others: _Objects | None, pairs: np.ndarray, names: list[tuple[Any, Any]], margin: float) -> list[ContactData]:
        found = self._finder.find(*self._with(others, pairs), margin=margin, **self._and(others))
        of = _Pairs(names, self._objects, self._objects if others is None else others, pairs)
        first = {key: k for k, key in enumerate(_keys(pairs).tolist())}
        pair_of = np.fromiter((first[key] for key in _keys(found["pair"]).tolist()), np.int64, len(found))
        row, column = np.nonzero(np.arange(4) < found["count"][:, None])
        point = of.positions(0)[pair_of[row]] + found["point"]["from_a"][row, column]
        depth = found["point"]["depth"][row, column]
        return [ContactData(of, pair, faces, *where) for pair, faces, *where in zip(
            pair_of[row].tolist(), zip(found["part_a"][row].tolist(), found["part_b"][row].tolist()), found["normal"][row], point,
            depth.tolist())]

    # --- Distances ---

    def min_distance_single(self, mesh: Any, transform: Any = None, return_name: bool = False, return_data: bool = False) -> Any:
        """The least distance of a mesh to any object, infinite if there is none; with return_name also that object's name, with
        return_data also DistanceData."""
        return self._closest(self._alone(mesh, [transform], _ALONE), lambda a, b: a, return_name, return_data)

    def min_distance_internal(self, return_names: bool = False, return_data: bool = False) -> Any:
        """The least distance of any two objects; names are a pair, in alphabetical order."""
        return self._closest(None, lambda a, b: (a, b), return_names, return_data)

    def min_distance_other(self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False) -> Any:
        """The least distance of an object of this manager to one of another; the first name is of this manager."""
        return self._closest(_manager(other_manager)._objects, lambda a, b: (a, b), return_names, return_data)

    def min_distance_each(self, mesh: Any, transforms: Any) -> np.ndarray:
        """The least distance of a mesh to any object, for each of many transforms, (m, 4, 4): (m,) float64."""
        alone, own = self._alone(mesh, transforms), self._objects
        out = np.full(len(alone), np.inf)
        pairs = self._touching(alone, 0.0)
        np.minimum.at(out, pairs[:, 1], self._depths(alone, pairs))
        apart = np.flatnonzero(out == np.inf)
        shapes = Shapes([alone.bodies[k].shape for k in apart.tolist()], dim=3)
        out[apart] = own.index().first(nearest_to_shapes(shapes, alone.placed()[1][apart]), *own.placed())["distance"]
        return out

    def _depths(self, others: _Objects | None, pairs: np.ndarray) -> np.ndarray:
        """The distances of pairs that touch: of two solids below 0, else 0."""
        theirs = self._objects if others is None else others
        both = self._objects.solid()[pairs[:, 0]] & theirs.solid()[pairs[:, 1]]
        out = np.zeros(len(pairs))
        out[both] = np.minimum(self._finder.distances(*self._with(others, pairs[both]), **self._and(others))["distance"], 0)
        return out

    def _least(self, others: _Objects | None) -> tuple[float, np.ndarray]:
        """The least distance, and the pair that has it; infinite, and no pair, if there are no pairs."""
        best: list[Any] = [np.inf, np.empty((0, 2), np.uint32)]
        pairs = self._touching(others, 0.0)
        if len(pairs):
            depths = self._depths(others, pairs)
            k = int(np.argmin(depths))
            return float(depths[k]), pairs[k:k + 1]

        def look(near: np.ndarray, at: np.ndarray) -> Any:
            wanted = self._wanted(np.sort(near, axis=1)) if others is None else near
            rows, nearest = self._finder.least_distances(*self._with(others, wanted), offsets=[0, len(wanted)], max_distance=best[0],
                                                         **self._and(others))
            k = int(nearest[0])
            if k >= 0 and rows["distance"][0] < best[0]:
                best[:] = max(float(rows["distance"][0]), 0.0), wanted[k:k + 1]
            return None if best[0] == np.inf else best[0]**2

        self._objects.index().visit_closest_pairs(look, None if others is None else others.index())
        return best[0], best[1]

    def _closest(self, others: _Objects | None, named: Callable[[Any, Any], Any], return_names: bool, return_data: bool) -> Any:
        distance, pair = self._least(others)
        answer: list[Any] = [distance]
        ordered, names = self._names(others, pair)
        if return_names:
            answer.append(named(*names[0]) if names else None)
        if return_data:
            data = None
            if names:
                of = _Pairs(names, self._objects, self._objects if others is None else others, ordered)
                row = self._finder.distances(*self._with(others, ordered), **self._and(others))[0]
                data = DistanceData(of, (of.positions(0)[0] + row["from_a"], of.positions(1)[0] + row["from_b"]), distance)
            answer.append(data)
        return answer[0] if len(answer) == 1 else tuple(answer)

    # --- Queries ---

    def _slot(self, name: Hashable) -> int:
        slot = self._objects.slots.get(name)
        if slot is None:
            raise NoSuchObjectError(f"{name!r} not in collision manager!")
        return slot

    def _alone(self, mesh: Any, transforms: Any, named: Any = None) -> _Objects:
        """A mesh that isn't in the manager, at some transforms; with a name, at a single one."""
        source = _Source(mesh, self._solid)
        alone = _Objects()
        self._asked = None if self._asked is None or self._asked.source.key != source.key else self._asked
        for k, given in enumerate(transforms):
            who = "transform" if named is not None else f"transforms[{k}]"
            rigid, stretch = _split(_transform(given, who), who)
            self._asked = _Body.of(source, stretch) if self._asked is None else self._asked.with_stretch(stretch)
            alone.put(k if named is None else named, self._asked, rigid)
        return alone


def _sorted(a: Any, b: Any) -> tuple[Any, Any]:
    try:
        return (b, a) if b < a else (a, b)
    except TypeError:  # names that have no order
        return a, b


def _keys(pairs: np.ndarray) -> np.ndarray:
    return pairs[:, 0].astype(np.uint64) << np.uint64(32) | pairs[:, 1].astype(np.uint64)


def _margin(given: Any) -> float:
    margin = float(_arrays.numbers(given, "margin"))
    if not 0 <= margin < np.inf:
        raise Error(f"margin is {margin}: it must be a finite number, 0 or more")
    return margin


def _manager(given: Any) -> CollisionManager:
    if not isinstance(given, CollisionManager):
        raise Error(f"other_manager is of the type {type(given).__name__}: it must be a jostle.trimesh.CollisionManager")
    return given


def scene_to_collision(scene: Any) -> tuple[CollisionManager, dict[Any, Any]]:
    """A manager of all meshes of a trimesh.Scene, by the names of their nodes, and those names."""
    manager = CollisionManager()
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        manager.add_object(node, scene.geometry[geometry], transform)
    return manager, {node: node for node in scene.graph.nodes_geometry}
