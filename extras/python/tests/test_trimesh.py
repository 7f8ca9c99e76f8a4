# SPDX-License-Identifier: MIT
"""The collision manager of trimesh against all triangles with all, and against what trimesh answers."""
import itertools
import types

import numpy as np
import pytest

import jostle
from jostle.trimesh import CollisionManager, scene_to_collision


class Mesh:
    """All that a mesh needs to have; trimesh's have is_convex as well."""

    def __init__(self, vertices, faces, is_convex=None):
        self.vertices, self.faces = np.asarray(vertices, float), np.asarray(faces)
        if is_convex is not None:
            self.is_convex = is_convex


def box(size=1.0, is_convex=None):
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * size
    return Mesh(corners, [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
                          [1, 5, 7], [1, 7, 3]], is_convex)


def soup(rng, count=6, needles=True):
    """Triangles of any kind: some share corners, some of those are in one plane, some may be needles or points."""
    vertices = rng.normal(size=(rng.integers(3, 9), 3))
    if rng.random() < 0.3:
        vertices[:, 2] = 0
    if rng.random() < 0.3:
        vertices = vertices.round()
    return Mesh(vertices, [rng.choice(len(vertices), 3, replace=needles) for _ in range(count)])


def at(*position, turn=np.eye(3)):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn, position or (0, 0, 0)
    return out


def turn(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


# --- The definition: all triangles with all ---

def triangles(mesh, transform):
    return (mesh.vertices @ transform[:3, :3].T + transform[:3, 3])[mesh.faces]


def between_segments(p, q, r, s):
    """The distance of p-q and r-s: that of one of the ends, or of the inner points that are nearest where the lines cross."""
    def of_point(x, a, b):
        along = b - a
        t = np.clip(((x - a) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-300), 0, 1)
        return np.linalg.norm(a + t[..., None] * along - x, axis=-1)

    best = np.minimum.reduce([of_point(p, r, s), of_point(q, r, s), of_point(r, p, q), of_point(s, p, q)])
    d, e, w = q - p, s - r, p - r
    a, b, c, f, g = (d * d).sum(-1), (d * e).sum(-1), (e * e).sum(-1), (d * w).sum(-1), (e * w).sum(-1)
    det = a * c - b * b
    inner = det > 1e-12 * a * c
    safe = np.where(inner, det, 1)
    t, u = (b * g - c * f) / safe, (a * g - b * f) / safe
    inner &= (t > 0) & (t < 1) & (u > 0) & (u < 1)
    apart = np.linalg.norm(w + t[..., None] * d - u[..., None] * e, axis=-1)
    return np.where(inner, np.minimum(best, apart), best)


def to_faces(point, faces):
    """The distance of a point to the inside of triangles; infinite where it is nearest to an edge."""
    a, b, c = (faces[..., k, :] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=-1)
    inside = length > 1e-12
    for p, q in ((a, b), (b, c), (c, a)):
        inside = inside & ((np.cross(q - p, point - p) * normal).sum(-1) >= 0)
    return np.where(inside, np.abs(((point - a) * normal).sum(-1)) / np.where(length > 0, length, 1), np.inf)


def crossing(p, q, faces):
    """Whether segments go through the inside of triangles."""
    a, b, c = (faces[..., k, :] for k in range(3))
    normal = np.cross(b - a, c - a)
    x, y = ((p - a) * normal).sum(-1), ((q - a) * normal).sum(-1)
    through = x * y < 0
    t = x / np.where(through, x - y, 1)
    return through & (to_faces(p + t[..., None] * (q - p), faces) < 1e-9)


def distance_of(one, other):
    """The least distance of triangles (n, 3, 3) and (m, 3, 3)."""
    a, b = one[:, None], other[None]
    best = np.inf
    for i in range(3):
        p, q = a[..., i, :], a[..., (i + 1) % 3, :]
        r, s = b[..., i, :], b[..., (i + 1) % 3, :]
        for k in range(3):
            best = min(best, between_segments(p, q, b[..., k, :], b[..., (k + 1) % 3, :]).min())
        best = min(best, to_faces(p, b).min(), to_faces(r, a).min())
        if crossing(p, q, np.broadcast_to(b, (len(one), len(other), 3, 3))).any() or crossing(
                r, s, np.broadcast_to(a, (len(one), len(other), 3, 3))).any():
            return 0.0
    return best


class Slow:
    """The manager by the definition, for surfaces."""

    def __init__(self):
        self.placed = {}

    def distances(self, other=None):
        pairs = (itertools.combinations(sorted(self.placed), 2) if other is None else
                 itertools.product(sorted(self.placed), sorted(other.placed)))
        theirs = self.placed if other is None else other.placed
        return {(a, b): distance_of(triangles(*self.placed[a]), triangles(*theirs[b])) for a, b in pairs}


def known(distances, touch, limit=0.0):
    """Whether these are the pairs that are no further apart, except where rounding decides."""
    near = {pair for pair, d in distances.items() if d < limit - 1e-9 or d == 0}
    maybe = {pair for pair, d in distances.items() if d <= limit + 1e-9}
    return near <= touch <= maybe


@pytest.mark.parametrize("seed", range(6))
def test_random_calls_answer_as_all_triangles_do(seed):
    rng = np.random.default_rng(seed)
    manager, slow, others, slow_others = CollisionManager(), Slow(), CollisionManager(), Slow()
    needles = seed % 2 == 0
    meshes = [soup(rng, needles=needles) for _ in range(5)]

    def place():
        t = at(*rng.normal(size=3) * 2, turn=turn(rng))
        if rng.random() < 0.3:  # scaled, sheared, mirrored
            t[:3, :3] = rng.normal(size=(3, 3)) * rng.choice([0.2, 1], size=3)
        return t

    for k in range(3):
        mesh, t = meshes[k], place()
        others.add_object(f"x{k}", mesh, t)
        slow_others.placed[f"x{k}"] = mesh, t
    for step in range(16):
        name, mesh, t = f"o{rng.integers(9)}", meshes[rng.integers(5)], place()
        if name not in slow.placed or rng.random() < 0.3:
            manager.add_object(name, mesh, t)
            slow.placed[name] = mesh, t
        elif rng.random() < 0.3:
            manager.remove_object(name)
            del slow.placed[name]
        else:
            manager.set_transform(name, t)
            slow.placed[name] = slow.placed[name][0], t
        if step % 3:
            continue
        assert len(manager) == len(slow.placed) and all(name in manager for name in slow.placed)
        single, single_at = meshes[0], place()
        alone = Slow()
        alone.placed["single"] = single, single_at
        for distances, collide, nearest in (
                (slow.distances(), manager.in_collision_internal, manager.min_distance_internal),
                (slow.distances(slow_others), lambda *more, **named: manager.in_collision_other(others, *more, **named),
                 lambda *more: manager.min_distance_other(others, *more)),
                ({(a, "single"): d for (a, _), d in slow.distances(alone).items()},
                 lambda *more, **named: manager.in_collision_single(single, single_at, *more, **named),
                 lambda *more: manager.min_distance_single(single, single_at, *more))):
            for limit in (0.0, 0.5):
                touches, names, data = collide(True, True, margin=limit)
                found = {(name, "single") if isinstance(name, str) else name for name in names}
                assert known(distances, found, limit)
                assert touches is bool(found) and collide(margin=limit) is touches
                told = {frozenset("single" if name == "__external" else name for name in one.names) for one in data}
                assert told == set(map(frozenset, found))
            least, pair, near = nearest(True, True)
            if distances:
                assert least == pytest.approx(min(distances.values()), abs=1e-9)
                pair = (pair, "single") if isinstance(pair, str) else pair
                assert distances[pair] == pytest.approx(least, abs=1e-9)
                assert near.distance == least == nearest()
            else:
                assert least == np.inf and pair is None and near is None
        transforms = [single_at] + [place() for _ in range(5)]
        assert manager.in_collision_each(single, transforms).tolist() == [manager.in_collision_single(single, t) for t in transforms]
        assert np.allclose(manager.min_distance_each(single, transforms),
                           [manager.min_distance_single(single, t) for t in transforms], atol=1e-12)


@pytest.mark.parametrize("seed", range(2))
def test_points_faces_and_normals_are_where_the_meshes_are(seed):
    rng = np.random.default_rng(seed)
    for solid in (False, True):
        manager, placed = CollisionManager(), {}
        for k in range(12):
            mesh, t = box(is_convex=solid), at(*rng.random(3) * 2.5, turn=turn(rng))
            if k % 3 == 0:
                t[:3, :3] *= [1, 2, 0.5]
            name = f"o{rng.integers(1000)}_{k}"
            manager.add_object(name, mesh, t)
            placed[name] = mesh, t
        touches, pairs, data = manager.in_collision_internal(True, True)
        assert touches and len(data) >= len(pairs)
        for one in data[::1 + len(data) // 30]:
            a, b = sorted(one.names)
            assert (a, b) in pairs and np.linalg.norm(one.normal) == pytest.approx(1)
            for name, side in ((a, 0.5), (b, -0.5)):
                triangle = triangles(*placed[name])[[one.index(name)]]
                assert distance_of(triangle, np.tile(one.point + side * one.depth * one.normal, (1, 3, 1))) < 1e-5
            with pytest.raises(KeyError):
                one.index("nobody")
        if solid:  # moving the second along the normal by the depth parts them
            a, b = sorted(data[0].names)
            deepest = max(one.depth for one in data if one.names == {a, b})
            mesh, t = placed[b]
            away = t.copy()
            away[:3, 3] += data[0].normal * (deepest + 1e-9)
            apart = CollisionManager()
            apart.add_object(a, *placed[a])
            assert apart.in_collision_single(mesh, t) and not apart.in_collision_single(mesh, away)
        distance, name, near = manager.min_distance_single(box(), at(9, 0, 0), True, True)
        assert near.names == {name, "__external"}
        assert np.linalg.norm(near.point(name) - near.point("__external")) == pytest.approx(distance)
        for which, (mesh, t) in ((name, placed[name]), ("__external", (box(), at(9, 0, 0)))):
            assert distance_of(triangles(mesh, t)[[near.index(which)]], np.tile(near.point(which), (1, 3, 1))) < 1e-6


def test_answers_have_the_form_that_trimesh_gives_them():
    cube, manager = box(), CollisionManager()
    manager.add_object("cube0", cube)
    manager.add_object("cube1", cube, at(5, 0, 0))
    assert manager.in_collision_single(cube) is True and manager.in_collision_internal() is False
    assert manager.in_collision_single(cube, at(5, 0, 0), return_names=True) == (True, {"cube1"})
    assert manager.in_collision_single(cube, at(-5, 0, 0), True, True) == (False, set(), [])
    touches, data = manager.in_collision_single(cube, return_data=True)
    assert touches and all(one.names == {"cube0", "__external"} for one in data)
    manager.add_object("cube2", cube, at(-5, 0, 0))
    assert manager.in_collision_internal(True, True) == (False, set(), [])
    manager.set_transform("cube2", at(4.5, 0, 0))
    assert manager.in_collision_internal(return_names=True) == (True, {("cube1", "cube2")})
    other = CollisionManager()
    other.add_object("cube0", cube)
    assert manager.in_collision_other(other, return_names=True) == (True, {("cube0", "cube0")})
    assert other.in_collision_other(manager, True)[1] == {("cube0", "cube0")}
    assert manager.min_distance_single(cube, at(0, 0, 3), return_name=True) == (2.0, "cube0")
    distance, names, near = manager.min_distance_internal(True, True)
    assert (distance, names) == (0.0, ("cube1", "cube2")) and near.names == {"cube1", "cube2"}
    manager.remove_object("cube2")
    distance, names, near = manager.min_distance_internal(return_names=True, return_data=True)
    assert (distance, names) == (4.0, ("cube0", "cube1"))
    assert near.point("cube0")[0] == 0.5 and near.point("cube1")[0] == 4.5 and near.distance == 4
    assert manager.min_distance_other(other, True) == (0.0, ("cube0", "cube0"))
    assert CollisionManager().min_distance_internal(True, True) == (np.inf, None, None)
    assert CollisionManager().min_distance_single(cube) == np.inf and CollisionManager().in_collision_single(cube) is False
    assert CollisionManager().min_distance_each(cube, [at()]).tolist() == [np.inf]
    assert CollisionManager().in_collision_internal(True, True) == (False, set(), [])


def test_names_may_be_anything_that_can_be_a_key():
    manager = CollisionManager()
    for name in (3, "b", ("c", 1), None):
        manager.add_object(name, box())
    assert {frozenset(map(str, pair)) for pair in manager.in_collision_internal(True)[1]} == {
        frozenset(map(str, pair)) for pair in itertools.combinations((3, "b", ("c", 1), None), 2)}


def test_convex_meshes_are_solids_as_in_trimesh_unless_asked_otherwise():
    def inside(outer, inner, **how):
        manager = CollisionManager(**how)
        manager.add_object("outer", box(3, outer))
        return manager.in_collision_single(box(1, inner))

    assert not inside(None, None) and not inside(False, False)
    assert inside(True, False) and inside(True, True) and inside(False, True) is False
    assert inside(None, None, solid=True) and not inside(True, True, solid=False)
    manager = CollisionManager()
    manager.add_object("solid", box(3, True))
    manager.add_object("surface", box(3), at(9, 0, 0))
    assert manager.min_distance_single(box(1, True), return_name=True) == (-2.0, "solid")
    assert manager.min_distance_single(box(1), return_name=True) == (0.0, "solid")
    assert manager.min_distance_single(box(1), at(9, 0, 0), return_name=True) == (pytest.approx(1), "surface")
    np.testing.assert_allclose(manager.min_distance_each(box(1, True), [at(), at(9, 0, 0), at(3, 0, 0), at(7.5, 0, 0)]),
                               [-2, 1, 1, 0], atol=1e-12)
    manager.add_object("deeper", box(3, True), at(0.5, 0, 0))
    manager.add_object("solid too", box(3, True), at(0.25, 0, 0))
    assert manager.min_distance_internal(True)[0] == -2.75


def test_a_transform_acts_as_on_the_vertices():
    rng = np.random.default_rng(3)
    mesh, spare = box(), box()
    linear = {"turned": turn(rng), "float32": turn(rng).astype(np.float32), "scaled": 0.001 * turn(rng), "stretched": np.diag([1, 2, 3]) @ turn(rng),
              "sheared": turn(rng) + [[0, 0.7, 0], [0, 0, 0], [0, 0, 0]], "mirrored": np.diag([1, 1, -1]) @ turn(rng),
              "flat": np.diag([1, 1, 0]) @ turn(rng), "inside out": -np.eye(3)}
    for what, matrix in linear.items():
        t = at(0.3, -0.2, 1.5, turn=matrix)
        baked = Mesh(mesh.vertices @ t[:3, :3].T + t[:3, 3], mesh.faces)
        for first in (False, True):  # at once, and by a later call
            manager, plain = CollisionManager(), CollisionManager()
            manager.add_object("it", mesh, t if first else None)
            manager.set_transform("it", t)
            plain.add_object("it", baked)
            for where in (at(2, 0, 0), at(0, 0, 3), at(-1, -1, -1, turn=turn(rng))):
                assert manager.min_distance_single(spare, where) == pytest.approx(plain.min_distance_single(spare, where), abs=2e-6), what


def test_an_object_that_turns_keeps_its_stretched_mesh():
    rng = np.random.default_rng(4)
    manager = CollisionManager()
    scale = np.diag([1.0, 2, 3])
    manager.add_object("it", box(), at(turn=scale))
    body = manager._objects.bodies[0]
    for _ in range(5):
        manager.set_transform("it", at(turn=turn(rng) @ scale))
        assert manager._objects.bodies[0] is body
    manager.set_transform("it", at())
    assert manager._objects.bodies[0].stretch is None
    manager.add_object("equal", box())
    assert manager._objects.bodies[0] is manager._objects.bodies[1]


def test_a_mesh_may_be_changed_after_it_was_added():
    mesh, manager = box(), CollisionManager()
    manager.add_object("it", mesh)
    mesh.vertices += 100
    manager.set_transform("it", at(turn=2 * np.eye(3)))
    assert manager.in_collision_single(box(), at(1.4, 0, 0)) and not manager.in_collision_single(box(), at(100, 100, 100))


def test_ignored_pairs_are_left_out_of_what_is_within():
    manager = CollisionManager()
    for name, x in (("a", 0), ("b", 0.9), ("c", 1.8), ("far", 4)):
        manager.add_object(name, box(), at(x, 0, 0))
    manager.set_pair_ignored("b", "a")
    assert manager.is_pair_ignored("a", "b") and manager.ignored_pairs == {("a", "b")}
    assert manager.in_collision_internal(True) == (True, {("b", "c")})
    assert all(one.names == {"b", "c"} for one in manager.in_collision_internal(return_data=True)[1])
    manager.set_pair_ignored("b", "c")
    assert manager.in_collision_internal() is False
    assert manager.min_distance_internal(True) == (pytest.approx(0.8), ("a", "c"))
    manager.add_object("0", box(), at(0.5, 0, 0))
    manager.remove_object("0")  # slots change
    manager.add_object("b", box(), at(0.9, 0, 0))  # the same name
    assert manager.in_collision_internal() is False
    manager.set_pair_ignored("a", "b", False)
    assert manager.in_collision_internal(True)[1] == {("a", "b")}
    manager.clear_ignored_pairs()
    assert manager.in_collision_internal(True)[1] == {("a", "b"), ("b", "c")} and manager.ignored_pairs == set()
    manager.set_pair_ignored("a", "b")
    manager.remove_object("a")
    manager.add_object("a", box())
    assert ("a", "b") in manager.in_collision_internal(True)[1]


def test_a_margin_lets_objects_collide_that_are_near():
    manager, other = CollisionManager(), CollisionManager()
    manager.add_object("a", box())
    manager.add_object("b", box(), at(1.4, 0, 0))
    other.add_object("c", box(), at(-1.4, 0, 0))
    for margin, near in ((0.39, False), (0.41, True)):
        assert manager.in_collision_internal(True, margin=margin) == (near, {("a", "b")} if near else set())
        assert manager.in_collision_other(other, True, margin=margin) == (near, {("a", "c")} if near else set())
        assert manager.in_collision_single(box(), at(0, 0, 1.4), True, margin=margin) == (near, {"a"} if near else set())
        assert manager.in_collision_each(box(), [at(0, 0, 1.4), at(0, 9, 0)], margin=margin).tolist() == [near, False]
    data = manager.in_collision_internal(return_data=True, margin=0.41)[1]
    assert all(one.depth == pytest.approx(-0.4) for one in data) and data[0].normal == pytest.approx([1, 0, 0])


def test_the_nearest_pair_may_have_boxes_further_apart_than_others():
    def triangle(*corners):
        return Mesh(corners, [[0, 1, 2]])

    point = triangle((0, 0, 0), (0, 0, 1e-3), (0, 1e-3, 0))
    slope = triangle((1, 0.5, 0), (0.9, 2, 0), (2, 0.9, 0))  # 1.118 from the point, its box 1.03
    manager, other = CollisionManager(), CollisionManager()
    manager.add_object("point", point)
    manager.add_object("far", point, at(50, 0, 0))
    for k in range(70):  # more than are looked at together
        other.add_object(k, slope, at(0, 1e-6 * k, 0))
    other.add_object("farther", point, at(50, 0, 1.101))
    assert manager.min_distance_other(other, True) == (pytest.approx(1.1), ("far", "farther"))


def test_contacts_have_no_limit():
    n = 40
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    corner = np.arange((n + 1)**2).reshape(n + 1, n + 1)
    a, b, c, d = corner[:-1, :-1].ravel(), corner[1:, :-1].ravel(), corner[1:, 1:].ravel(), corner[:-1, 1:].ravel()
    sheet = Mesh(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    manager = CollisionManager()
    manager.add_object("sheet", sheet)
    touches, data = manager.in_collision_single(sheet, return_data=True)
    # Every two triangles that share a corner touch: each has 3 corners of about 6 triangles.
    assert touches and len({(one.index("sheet"), one.index("__external")) for one in data}) > 13 * len(sheet.faces) * 0.9


def test_many_moves_are_made_together_or_not_at_all():
    manager = CollisionManager()
    for k in range(3):
        manager.add_object(k, box(), at(3 * k, 0, 0))
    manager.set_transforms([0, 1], [at(0, 0, 9), at(0, 0, 9)])
    assert manager.in_collision_internal(True) == (True, {(0, 1)})
    bad = at()
    bad[1, 3] = np.nan
    with pytest.raises(jostle.Error, match=r"object 1: transform\[1, 3\] is nan"):
        manager.set_transforms([0, 1], [at(6, 0, 0), bad])
    assert manager.in_collision_internal(True) == (True, {(0, 1)})
    with pytest.raises(jostle.Error, match="2 names and 1 transforms"):
        manager.set_transforms([0, 1], [at()])


def test_mistakes_name_the_object_and_the_value():
    manager = CollisionManager()
    manager.add_object("good", box())
    before = manager.in_collision_single(box(), at(0.9, 0, 0), True)
    for call, message in (
            (lambda: manager.remove_object("no"), "'no' not in collision manager!"),
            (lambda: manager.set_transform("no", at()), "'no' not in collision manager!"),
            (lambda: manager.set_pair_ignored("good", "no"), "'no' not in collision manager!"),
            (lambda: manager.set_pair_ignored("good", "good"), "'good' is no pair with itself"),
            (lambda: manager.set_transform("good", np.eye(3)), r"object 'good': transform has the shape \(3, 3\)"),
            (lambda: manager.set_transform("good", at(np.inf, 0, 0)), r"object 'good': transform\[0, 3\] is inf"),
            (lambda: manager.set_transform("good", at(turn=np.full((3, 3), np.nan))), r"object 'good': transform\[0, 0\] is nan"),
            (lambda: manager.set_transform("good", np.ones((4, 4))), r"transform\[3\] is \[1.0, 1.0, 1.0, 1.0\]: the last row"),
            (lambda: manager.set_transform("good", "here"), "object 'good': transform has the dtype"),
            (lambda: manager.add_object("new", Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))), "object 'new': the mesh has no faces"),
            (lambda: manager.add_object("new", Mesh(np.zeros((2, 3)), [[0, 1, 2]])), r"object 'new': faces\[0\] is \[0, 1, 2\], and there are 2 ve"),
            (lambda: manager.add_object("new", Mesh(np.zeros((3, 3)), [[0, 1, -1]])), r"object 'new': faces\[0, 2\] is -1"),
            (lambda: manager.add_object("new", Mesh(np.zeros((4, 3)), [[0, 1, 2, 3]])), r"faces has the shape \(1, 4\)"),
            (lambda: manager.add_object("new", Mesh(np.zeros((4, 2)), [[0, 1, 2]])), r"vertices has the shape \(4, 2\)"),
            (lambda: manager.add_object("new", Mesh([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]])), r"object 'new': .*nan"),
            (lambda: manager.add_object("new", 7), "object 'new': mesh is of the type int, which has no vertices"),
            (lambda: manager.in_collision_single(box(), np.zeros(4)), r"transform has the shape \(4,\)"),
            (lambda: manager.in_collision_single(box(), margin=-1), "margin is -1.0"),
            (lambda: manager.in_collision_internal(margin=np.inf), "margin is inf"),
            (lambda: manager.in_collision_each(box(), [at(), at(np.nan, 0, 0)]), r"transforms\[1\]\[0, 3\] is nan"),
            (lambda: manager.in_collision_other({}), "other_manager is of the type dict"),
            (lambda: manager.min_distance_other(None), "other_manager is of the type NoneType")):
        with pytest.raises(ValueError, match=message) as told:
            call()
        assert isinstance(told.value, jostle.Error)
        assert manager.in_collision_single(box(), at(0.9, 0, 0), True) == before and len(manager) == 1 and "new" not in manager
    for unhashable in ([], {}):
        with pytest.raises(TypeError):
            manager.add_object(unhashable, box())
        assert len(manager) == 1


def test_a_scene_becomes_a_manager():
    table, cup = box(2), box(0.5)
    graph = {"table": (at(), "box"), "cup 1": (at(0, 0, 1.2), "small"), "cup 2": (at(0, 0, 4), "small")}

    class Graph:
        nodes_geometry = list(graph)

        def __getitem__(self, node):
            return graph[node]

    manager, objects = scene_to_collision(types.SimpleNamespace(graph=Graph(), geometry={"box": table, "small": cup}))
    assert set(objects) == set(graph) and manager.in_collision_internal(True) == (True, {("cup 1", "table")})


def test_the_same_on_any_number_of_threads():
    rng = np.random.default_rng(5)
    meshes, places = [soup(rng, 30) for _ in range(40)], [at(*rng.normal(size=3) * 3, turn=turn(rng)) for _ in range(40)]
    told = []
    for threads in (1, 2, 5):
        manager = CollisionManager(threads=threads)
        for k, (mesh, t) in enumerate(zip(meshes, places)):
            manager.add_object(k, mesh, t)
        touches, names, data = manager.in_collision_internal(True, True)
        told.append((names, [(one.names, one.point.tobytes(), one.normal.tobytes(), one.depth) for one in data]))
    assert told[0] == told[1] == told[2] and len(told[0][0]) > 10
