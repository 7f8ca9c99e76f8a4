# SPDX-License-Identifier: MIT
"""Shapes, contacts, distances, impacts, sums."""
import threading

import numpy as np
import pytest

import jostle
from test_pairs import KINDS


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_spheres(dim, dtype):
    rng = np.random.default_rng(5)
    centers, radii = rng.random((300, dim)).astype(dtype), rng.random(300) * 0.1
    shapes, poses = jostle.Shapes.spheres(radii, dim), jostle.poses(centers)
    boxes = jostle.bounds(shapes, poses)
    assert boxes.dtype == dtype and boxes.shape == (300, 2, dim)
    assert np.allclose(boxes[:, 0], centers - radii[:, None], atol=1e-5)
    pairs = jostle.find_pairs(boxes, order="sorted")
    a, b = pairs.T
    apart = np.linalg.norm(centers[a].astype(float) - centers[b], axis=1) - radii[a] - radii[b]
    touching = jostle.touching(shapes, poses, pairs)
    clear = abs(apart) > 1e-5
    assert np.array_equal(touching[clear], apart[clear] < 0) and touching.any()
    contacts = jostle.contacts(shapes, poses, pairs)
    assert np.array_equal(contacts["pair"], pairs[touching]) and (contacts["count"] == 1).all()
    assert np.allclose(contacts["point"]["depth"][:, 0], -apart[touching], atol=1e-5)
    assert (contacts["point"]["depth"][:, 1:] == 0).all()  # no garbage
    points = jostle.ContactFinder(dim, dtype).find_points(shapes, poses, pairs)
    for name in ("pair", "part_a", "part_b", "normal"):
        assert np.array_equal(points[name], contacts[name])
    for name in ("from_a", "from_b", "depth", "feature"):
        assert np.array_equal(points[name], contacts["point"][name][:, 0])
    distances = jostle.distances(shapes, poses, pairs)
    assert np.allclose(distances["distance"], apart, atol=1e-5)
    assert np.isinf(jostle.distances(shapes, poses, pairs, 0)["distance"][apart > 1e-5]).all()
    two = jostle.contacts(shapes, poses, pairs, shapes_b=shapes, poses_b=poses)
    assert np.array_equal(two, contacts)
    finder = jostle.ContactFinder(dim, dtype)
    wide = np.zeros((300, poses.shape[1] + 3), dtype)
    wide[:, :-3] = poses
    assert np.array_equal(finder.find(shapes, wide[:, :-3], pairs), contacts)
    assert np.array_equal(finder.find(shapes, poses, pairs.astype(np.int64)), contacts)


def test_shapes_of_all_kinds():
    cube = jostle.hull(np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T.astype(np.float32))
    assert len(cube.vertices()) == 8 and [len(face) for face in cube.faces()] == [4] * 6
    ground = jostle.height_field(np.zeros((10, 10)))
    triangle = jostle.mesh(np.eye(3), [[0, 1, 2]])
    assert np.array_equal(triangle.vertices(), np.eye(3)) and [face.tolist() for face in triangle.faces()] == [[0, 1, 2]]
    both = jostle.compound([jostle.sphere(1), cube], jostle.poses(np.array([[0.0, 0, 0], [2, 0, 0]])))
    shapes = jostle.Shapes([ground, cube, triangle, jostle.capsule(1, 0.5), jostle.box([1, 2, 3]), both])
    shapes.append(jostle.half_space([0, 1, 0]), 2)
    shapes.extend([cube])
    shapes[0] = cube
    shapes[-1] = jostle.sphere(0.5)
    assert len(shapes) == 9 and "9" in repr(shapes)
    del cube, both, ground, triangle  # the list keeps what it needs
    poses = jostle.poses(np.zeros((9, 3)))
    pairs = np.array([(i, k) for i in range(6) for k in range(i + 1, 6)])
    assert jostle.touching(shapes, poses, pairs).all()
    poses[8, 0] = 1.5
    assert jostle.contacts(shapes, poses, [(5, 8)], 0.01)["part_a"].tolist() == [0, 1]  # with both children
    flat = jostle.Shapes([jostle.box([1, 1]), jostle.mesh([[0.0, 0], [1, 0]], [[0, 1]])])
    assert flat.dim == 2 and jostle.touching(flat, jostle.poses(np.zeros((2, 2)), [0, 0.5]), [(0, 1)])[0]
    assert jostle.box([1, 2, 3]).info() == (2, 0.0, [1.0, 2.0, 3.0], 0.0)
    assert len(jostle.Shapes.capsules([1, 2], [1, 1])) == 2 and len(jostle.Shapes.boxes(np.ones((4, 2)))) == 4
    shapes.clear()
    assert len(shapes) == 0


def test_impacts():
    shapes = jostle.Shapes.same(jostle.sphere(0.5), 2)
    motions = np.zeros((2, 13))
    motions[:, 6] = 1
    motions[1, 0], motions[1, 7] = 5, -8
    impact = jostle.impacts(shapes, motions, [(0, 1)])
    assert abs(impact["time"][0] - 0.5) < 1e-3 and np.allclose(impact["normal"][0], [1, 0, 0])
    motions[1, 7] = 8
    assert np.isinf(jostle.impacts(shapes, motions, [(0, 1)])["time"][0])


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_casts(dim, dtype):
    rng = np.random.default_rng(8)
    poses = jostle.poses((rng.random((50, dim)) * 10).astype(dtype))
    shapes = jostle.Shapes.same(jostle.sphere(0.5, dim), 50)
    origins = (rng.random((20, dim)) * 10).astype(dtype)
    rays = jostle.rays(origins, np.ones(dim, dtype))
    pairs = [(ray, ball) for ray in range(20) for ball in range(50)]
    hits = jostle.ray_casts(rays, shapes, poses, pairs)
    assert hits["fraction"].dtype == dtype and 0 < np.isfinite(hits["fraction"]).sum() < len(pairs)
    for (ray, ball), hit in zip(pairs, hits):
        off = origins[ray].astype(float) - poses[ball, :dim]
        b, c = off.sum() / dim, (off @ off - 0.25) / dim
        exact = 0 if c <= 0 else -b - np.sqrt(max(b * b - c, 0)) if b < 0 and b * b >= c else np.inf
        if abs(b * b - c) > 1e-4 and abs(c) > 1e-4:
            assert np.isinf(exact) == np.isinf(hit["fraction"])
            if np.isfinite(exact):
                assert abs(hit["fraction"] - exact) < 1e-3
    # The same balls fly as points, and as balls they come sooner.
    movers = jostle.Shapes.same(jostle.sphere(0, dim), 20)
    starts, way = jostle.poses(origins), np.full((20, dim), 30, dtype)
    moved = jostle.shape_casts(movers, starts, way, shapes, poses, pairs)
    assert np.allclose(moved["fraction"] * 30, hits["fraction"], atol=1e-3)
    fat = jostle.shape_casts(jostle.Shapes.same(jostle.box([0.2] * dim), 20), starts, way, shapes, poses, pairs)
    assert (fat["fraction"] <= moved["fraction"]).all() and (fat["fraction"] < moved["fraction"]).any()
    with pytest.raises(jostle.Error, match="rays"):
        jostle.ray_casts(origins, shapes, poses, pairs)
    with pytest.raises(jostle.Error, match="ray 0"):
        jostle.ray_casts(jostle.rays(origins, np.zeros(dim, dtype)), shapes, poses, pairs)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_queries_of_all_shapes(dim, dtype):
    rng = np.random.default_rng(12)
    poses = jostle.poses((rng.random((60, dim)) * 10).astype(dtype))
    shapes = jostle.Shapes.spheres(rng.random(60), dim)
    boxes = jostle.bounds(shapes, poses)
    index, world = jostle.BoxIndex(boxes), jostle.World(dim=dim, dtype=dtype)
    ids = world.add(boxes)
    world.update()
    pairs = [(query, ball) for query in range(30) for ball in range(60)]
    origins = (rng.random((30, dim)) * 10).astype(dtype)
    rays = jostle.rays(origins, rng.random((30, dim)).astype(dtype) - 0.5)
    movers = jostle.Shapes.same(jostle.box([0.1] * dim), 30)
    moves = (movers, jostle.poses(origins), np.full((30, dim), 2, dtype))
    sweeps = jostle.shape_sweeps(*moves)
    for casts, every in ((rays, jostle.ray_casts(rays, shapes, poses, pairs)),
                         (sweeps, jostle.shape_casts(*moves, shapes, poses, pairs))):
        fractions = every["fraction"].reshape(30, 60)
        first, of_world = index.first(casts, shapes, poses), world.first(casts, shapes, poses)
        assert first["normal"].shape == (30, dim) and first["fraction"].dtype == dtype
        assert np.array_equal(first["fraction"], fractions.min(axis=1)) and np.isfinite(first["fraction"]).any()
        assert np.array_equal(first["id"], np.where(np.isfinite(fractions.min(axis=1)), fractions.argmin(axis=1), -1))
        assert np.array_equal(of_world["point"], first["point"])
        assert np.array_equal(of_world["id"], np.where(first["id"] < 0, 0, ids[first["id"]]))
        hits = index.all(casts, shapes, poses)
        assert len(hits) == 30 and not hits.more.any()
        for i, found in enumerate(hits):
            order = np.lexsort((np.arange(60), fractions[i]))[:np.isfinite(fractions[i]).sum()]
            assert np.array_equal(found["id"], order) and np.array_equal(found["fraction"], fractions[i][order])
        few = world.all(casts, shapes, poses, max_results=1)
        assert np.array_equal(few.more, [len(found) > 1 for found in hits])
        assert np.array_equal(world.count(casts, shapes, poses), [len(found) for found in hits])
        assert np.array_equal(index.any(casts, shapes, poses), [len(found) > 0 for found in hits])
        odd = index.first(casts, shapes, poses, accept=lambda query, ball: ball % 2 == 1)
        assert np.array_equal(odd["fraction"], fractions[:, 1::2].min(axis=1))
    points = jostle.Shapes.same(jostle.sphere(0, dim), 30)
    starts = jostle.poses(origins)
    every = jostle.distances(points, starts, pairs, shapes_b=shapes, poses_b=poses)["distance"].reshape(30, 60)
    nearest = index.first(jostle.nearest_to_shapes(points, starts), shapes, poses)
    assert np.array_equal(nearest["distance"], every.min(axis=1)) and np.array_equal(nearest["id"], every.argmin(axis=1))
    near = world.first(jostle.nearest_to_shapes(points, starts, max_distance=0.1), shapes, poses, exclude=int(ids[nearest["id"][0]]))
    assert np.array_equal(near["id"] == 0, np.where(np.arange(60) == nearest["id"][0], np.inf, every).min(axis=1) > dtype(0.1))
    three = index.all(jostle.nearest_to_shapes(points, starts, 3, np.full(30, np.inf)), shapes, poses)
    assert np.array_equal(three.values["distance"].reshape(30, 3), np.sort(every, axis=1)[:, :3])
    seen = []
    assert index.visit(jostle.nearest_to_shapes(jostle.Shapes.same(jostle.sphere(0, dim), 1), starts[:1], 3), lambda ids, at: seen.extend(zip(ids, at)),
                       shapes, poses)
    assert seen == [(one["id"], one["distance"]) for one in three[0]]
    # Shapes that stay touch what is at no distance.
    some = jostle.posed_shapes(movers, starts)
    boxes_apart = jostle.distances(movers, starts, pairs, shapes_b=shapes, poses_b=poses)["distance"].reshape(30, 60)
    touched = index.all(some, shapes, poses)
    assert touched.at is None and [sorted(one) for one in touched] == [np.nonzero(row <= 0)[0].tolist() for row in boxes_apart]
    assert np.array_equal(world.count(some, shapes, poses), (boxes_apart <= 0).sum(axis=1))
    with pytest.raises(jostle.Error, match="kind overlapping: this call takes rays, shape_sweeps, nearest_to_shapes of shapes"):
        index.first(boxes, shapes, poses)
    with pytest.raises(jostle.Error, match="kind shape_sweeps: this call takes rays, sweeps, nearest, nearest_to_boxes"):
        index.first(sweeps)
    with pytest.raises(jostle.Error, match="shapes and poses, or neither"):
        index.any(rays, shapes)
    with pytest.raises(jostle.Error, match="type list: it must be a Shapes"):
        jostle.posed_shapes([1], starts)
    with pytest.raises(jostle.Error, match="query 0: a ray"):
        index.first(jostle.rays(origins, np.zeros(dim, dtype)), shapes, poses)
    with pytest.raises(jostle.Error, match="30 poses and 3 displacements"):
        index.first(jostle.shape_sweeps(movers, jostle.poses(origins), np.ones((3, dim), dtype)), shapes, poses)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_groups_have_the_answers_of_loops_and_mistakes_are_refused(dtype):
    rng = np.random.default_rng(8)
    shapes = jostle.Shapes([jostle.sphere(0.5), jostle.box([0.5, 0.4, 0.3]), jostle.capsule(0.5, 0.2)] * 20)
    poses = jostle.poses((rng.random((60, 3)) * 6).astype(dtype))
    pairs = [(a, b) for a in range(59) for b in range(a + 1, 60)]
    offsets = [0, 10, 10, 400, len(pairs)]
    finder = jostle.ContactFinder(3, dtype)
    touch, distance = finder.touching(shapes, poses, pairs), finder.distances(shapes, poses, pairs, 1)
    first = finder.first_touching(shapes, poses, pairs, offsets)
    least, nearest = finder.least_distances(shapes, poses, pairs, offsets, 1)
    for group, (begin, end) in enumerate(zip(offsets, offsets[1:])):
        touching = np.flatnonzero(touch[begin:end])
        assert first[group] == (begin + touching[0] if len(touching) else -1)
        if begin == end or np.isinf(distance["distance"][begin:end]).all():
            assert nearest[group] == -1 and np.isinf(least["distance"][group])
        else:
            assert nearest[group] == begin + distance["distance"][begin:end].argmin()
            assert least[group] == distance[nearest[group]]
    with pytest.raises(jostle.Error, match="offset 2 is 4, less than the 5"):
        finder.first_touching(shapes, poses, pairs, [0, 5, 4, len(pairs)])
    with pytest.raises(ValueError, match=r"offsets has the shape \(0,\)"):
        finder.first_touching(shapes, poses, pairs, [])
    with pytest.raises(ValueError, match=r"offsets has the shape \(1, 2\)"):
        finder.least_distances(shapes, poses, pairs, [[0, len(pairs)]])


def test_meshes_join_where_they_coincide():
    corners = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 1], [0, 0, 0], [1, 0, 1], [1, 0, 0]], float)
    ball, pose = jostle.sphere(0.5), jostle.poses([[0.3, 0.45, 0.5]])
    finder = jostle.ContactFinder()
    for shift, weld, found in ((0, 0, 1), (0.001, 0, 2), (0.001, 0.002, 1)):
        shifted = corners + np.repeat([[0, 0, 0], [shift, 0, -shift]], 3, axis=0)
        shapes = jostle.Shapes([jostle.mesh(shifted, [[0, 1, 2], [3, 4, 5]], weld=weld), ball])
        poses = np.concatenate([jostle.poses([[0.0, 0, 0]]), pose])
        assert len(finder.find(shapes, poses, [[0, 1]])) == found
    with pytest.raises(jostle.Error, match="weld of a mesh is -1"):
        jostle.mesh(corners, [[0, 1, 2]], weld=-1)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_closed_meshes(dtype):
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], dtype)
    sides = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    solid = jostle.ClosedMesh(jostle.mesh(corners, sides))
    points = (np.random.default_rng(13).random((2000, 3)) * 6 - 1).astype(dtype)
    inside = (points >= 0).all(axis=1) & (points.astype(float).sum(axis=1) <= 4)
    assert np.array_equal(solid.contains(points), inside) and 0 < inside.sum() < 2000
    away = solid.signed_distances(points)
    assert away["distance"].dtype == dtype and np.array_equal(away["distance"] <= 0, inside)
    assert np.allclose(points - away["normal"] * away["distance"][:, None], away["point"], atol=1e-5)
    moved = solid.signed_distances(points + dtype(1), jostle.poses(np.ones((1, 3), dtype)))
    assert np.allclose(moved["distance"], away["distance"], atol=1e-5)
    assert solid.winding_numbers([[1, 1, 1], [9, 9, 9]]).tolist() == [1, 0]
    with pytest.raises(jostle.Error) as raised:
        solid.winding_numbers([[1, 1, 1], [9, np.nan, 9]])
    assert raised.value.index == 1
    with pytest.raises(jostle.Error, match="triangle 0 between the vertices 0 and 2"):
        jostle.ClosedMesh(jostle.mesh(corners, sides[:3]))
    with pytest.raises(jostle.Error, match="point 1"):
        solid.contains(np.array([[0, 0, 0], [np.nan, 0, 0]], dtype))


def test_round_shapes():
    floor = jostle.half_space([0, 1, 0])
    for shape, count in ((jostle.cylinder(1, 0.5), 4), (jostle.cone(1, 0.5), 4), (jostle.ellipsoid([2, 1, 3]), 1),
                         (jostle.rounded_box([1, 0.75, 1], 0.25), 4)):
        contact = jostle.contacts(jostle.Shapes([floor, shape]), jostle.poses([[0, 0, 0], [0, 0.99, 0]]), [(0, 1)])[0]
        assert contact["count"] == count and abs(contact["point"]["depth"][0] - 0.01) < 1e-9
    round_hull = jostle.rounded_hull([[0, 0], [1, 0], [0, 1]], 0.5)
    box = jostle.bounds(jostle.Shapes([round_hull, jostle.ellipsoid([1, 2])]), jostle.poses(np.zeros((2, 2))))
    assert np.allclose(box, [[[-0.5, -0.5], [1.5, 1.5]], [[-1, -2], [1, 2]]])


def test_sums_are_exact_and_the_same_on_any_number_of_threads():
    rng = np.random.default_rng(6)
    objects = rng.integers(0, 100, 200_000)
    for dtype in (np.float32, np.float64, np.int64):
        values = (rng.random((200_000, 3)) * 1000).astype(dtype)
        one = jostle.sum_by_object(objects, values, 100, threads=1)
        assert all(np.array_equal(one, jostle.sum_by_object(objects, values, 100, threads=n)) for n in (0, 3))
        expected = np.stack([np.bincount(objects, values[:, k].astype(float), 100) for k in range(3)], axis=1)
        assert np.allclose(one, expected, rtol=1e-3) and one.dtype == dtype
    assert jostle.sum_by_object([0, 2, 2], [1, 2, 3], 4).tolist() == [1, 0, 5, 0]
    assert jostle.sum_by_object([0, 0], np.array([2**63 - 2, 1], np.uint64), 1).tolist() == [2**63 - 1]
    with pytest.raises(jostle.Error, match=r"values\[1\] is 9223372036854775808"):
        jostle.sum_by_object([0, 0], np.array([1, 2**63], np.uint64), 1)


def test_many_are_added_up_in_parts(monkeypatch):
    monkeypatch.setattr(jostle._contacts, "_PART", 1000)
    objects, values = np.arange(2500) % 7, np.arange(2500)
    assert jostle.sum_by_object(objects, values, 7).tolist() == [int(values[objects == i].sum()) for i in range(7)]
    for few, many in ((values[:2000], objects), (values, objects[:2000])):
        with pytest.raises(jostle.Error, match="2000"):
            jostle.sum_by_object(many, few, 7)
    objects[2222] = 7
    with pytest.raises(jostle.Error, match=r"objects\[2222\] is 7, and there are 7 objects") as raised:
        jostle.sum_by_object(objects, values, 7)
    assert raised.value.index == 2222


def test_mistakes_name_the_object():
    shapes, poses = jostle.Shapes.spheres([1, 1]), jostle.poses(np.zeros((2, 3)))
    with pytest.raises(IndexError) as raised:
        jostle.contacts(shapes, poses, [(0, 1), (0, 2)])
    assert raised.value.index == 1 and isinstance(raised.value, jostle.Error)
    bad = poses.copy()
    bad[1, 0] = np.nan
    for call, words in ((lambda: jostle.contacts(shapes, bad, [(0, 1)]), "nan|NaN"), (lambda: jostle.sphere(-1), "-1"),
                        (lambda: jostle.Shapes.spheres([1, -2]), "-2"), (lambda: jostle.contacts(shapes, poses[:, :6], [(0, 1)]), "6"),
                        (lambda: jostle.contacts(shapes, poses, [(0, 1)], -1), "-1"),
                        (lambda: jostle.contacts(shapes, poses, [(0, 1, 2)]), "shape"),
                        (lambda: jostle.contacts(shapes, poses[:1], [(0, 1)]), "1"),
                        (lambda: jostle.contacts(shapes, poses, [(0, 1)], shapes_b=shapes), "second"),
                        (lambda: jostle.hull(np.zeros((3, 4))), "shape"), (lambda: jostle.mesh(np.eye(3), [[0, 1, 3]]), "3"),
                        (lambda: jostle.compound([], np.zeros((0, 7))), "one"), (lambda: jostle.compound("s", poses[:1]), r"shapes\[0\] is of the type str"),
                        (lambda: jostle.poses(np.zeros(3)), "shape"),
                        (lambda: jostle.bounds(shapes, poses[:1]), "shapes"), (lambda: jostle.bounds(shapes, poses, -1), "-1"),
                        (lambda: jostle.sum_by_object([5], [1.0], 5), "5"),
                        (lambda: jostle.sum_by_object([1], [[1.0] * 9], 5), "9"),
                        (lambda: jostle.Shapes([jostle.sphere(1), 2]), r"shapes\[1\] is of the type int"), (lambda: jostle.Shapes([2]), r"shapes\[0\]"),
                        (lambda: jostle.sum_by_object([1], [1.0], -5), "count is -5"),
                        (lambda: jostle.poses(np.zeros((2, 3)), 0.5), r"rotations has the shape \(\)"),
                        (lambda: jostle.poses(np.zeros((2, 3)), [[0.5], [0.5]]), r"rotations has the shape \(2, 1\)"),
                        (lambda: jostle.poses(np.zeros((3, 2)), [0.5, 1]), r"rotations has the shape \(2,\)"),
                        (lambda: jostle.poses(np.zeros((2, 4, 4))), r"of transforms \(n, 4, 4\) give positions \[:, :3, 3\]"),
                        (lambda: jostle.poses(np.zeros((2, 3)), np.zeros((2, 2, 2))), r"one of \(4,\), \(2, 4\), \(3, 3\), \(2, 3, 3\)"),
                        (lambda: jostle.motions(poses, poses[:1]), r"starts has the shape \(2, 7\) and ends \(1, 7\)"),
                        (lambda: jostle.motions(poses[:, :6], poses[:, :6]), r"starts has the shape \(2, 6\)"),
                        (lambda: jostle.touching(shapes, poses[0], [(0, 1)]), r"poses has the shape \(7,\)"),
                        (lambda: jostle.hull([1.0, 2, 3]), r"must be \(n, 3\)"),
                        (lambda: jostle.BoxIndex(jostle.bounds(shapes, poses)).first(jostle.nearest_to_shapes(shapes, poses, 1, [1, 2, 3]), shapes, poses),
                         "2 poses and 3 distances"),
                        (lambda: jostle.Shapes([jostle.sphere(1), jostle.sphere(1, 2)]), "3D")):
        with pytest.raises(jostle.Error, match=words):
            call()
    with pytest.raises(IndexError):
        shapes[2] = jostle.sphere(1)


def turned(q, v):
    """v (n, 3) turned by unit quaternions (n, 4), by the definition q v q*."""
    across = 2 * np.cross(q[:, :3], v)
    return v + q[:, 3:] * across + np.cross(q[:, :3], across)


def random_quaternions(rng, count):
    q = rng.normal(size=(count, 4))
    q[:8] = np.vstack([np.eye(4), [0, 0, 1, 1], [1, 0, 0, -1], [1, 1, 1, 1], [0, 1, 1, 0]])  # no, half and quarter turns
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def test_poses_of_rotation_matrices():
    rng = np.random.default_rng(11)
    q = random_quaternions(rng, 500)
    matrices = np.stack([turned(q, np.tile(column, (500, 1))) for column in np.eye(3)], axis=2)
    made = jostle.poses(np.zeros((500, 3)), matrices)[:, 3:]
    assert np.allclose(np.abs((made * q).sum(axis=1)), 1, atol=1e-14)  # the same but for the sign, which makes no difference
    assert np.allclose(np.linalg.norm(made, axis=1), 1)
    assert np.array_equal(jostle.poses(np.zeros((3, 3)), matrices[9])[:, 3:], made[[9, 9, 9]])  # one for all
    assert jostle.poses(np.zeros((500, 3), np.float32), matrices.astype(np.float32)).dtype == np.float32
    assert jostle.poses(np.zeros((0, 3)), np.zeros((0, 3, 3))).shape == (0, 7)
    for spoilt in (-np.eye(3), 1.01 * np.eye(3), np.diag([1, 1, -1.0]), np.zeros((3, 3)), np.full((3, 3), np.nan), np.diag([np.inf, 1, 1])):
        given = matrices.copy()
        given[7] = spoilt
        with pytest.raises(jostle.Error, match=r"rotations\[7\] is no rotation") as raised:
            jostle.poses(np.zeros((500, 3)), given)
        assert raised.value.index == 7


def test_motions_lead_from_pose_to_pose():
    rng = np.random.default_rng(12)
    a, b = random_quaternions(rng, 400), random_quaternions(rng, 400)[::-1].copy()
    b[100:150] = a[100:150]                    # no turn
    b[150:200] = -a[150:200]                   # nor here
    b[200:250] += 1e-9 * rng.normal(size=(50, 4))
    starts, ends = jostle.poses(rng.normal(size=(400, 3)), a), jostle.poses(rng.normal(size=(400, 3)), 3 * b)  # of any length
    made = jostle.motions(starts, ends)
    assert made.shape == (400, 13) and np.array_equal(made[:, :7], starts)
    assert np.allclose(made[:, :3] + made[:, 7:10], ends[:, :3])
    angle = np.linalg.norm(made[:, 10:], axis=1)
    assert angle.max() <= np.pi + 1e-12 and (angle[100:200] < 1e-7).all()
    half = np.column_stack([np.divide(made[:, 10:], angle[:, None], out=np.zeros((400, 3)), where=angle[:, None] > 0)
                            * np.sin(angle / 2)[:, None], np.cos(angle / 2)])
    for v in np.eye(3):
        v = np.tile(v, (400, 1))
        assert np.allclose(turned(half, turned(a, v)), turned(b / np.linalg.norm(b, axis=1, keepdims=True), v), atol=1e-7)
    flat = jostle.motions(jostle.poses([[0.0, 0]] * 3, [0.5, 3, -3]), jostle.poses([[1.0, 2]] * 3, [1, -3, 3]))
    assert np.allclose(flat[:, 4:], [[1, 2, 0.5], [1, 2, 2 * np.pi - 6], [1, 2, 6 - 2 * np.pi]])  # the shorter way
    assert jostle.motions(starts.astype(np.float32), ends.astype(np.float32)).dtype == np.float32
    # A blade that turns on the spot by a quarter hits a ball beside it halfway.
    shapes = jostle.Shapes([jostle.box([1, 0.01, 0.01]), jostle.sphere(0.01)])
    quarter = [0, 0, np.sqrt(0.5), np.sqrt(0.5)]
    here, there = jostle.poses([[0.0, 0, 0], [0.6, 0.6, 0]]), jostle.poses([[0.0, 0, 0], [0.6, 0.6, 0]], [quarter, [0, 0, 0, 1]])
    assert abs(jostle.impacts(shapes, jostle.motions(here, there), [(0, 1)])["time"][0] - 0.5) < 0.02


@pytest.mark.parametrize("count", [4, 300_000])  # the second one is asked in parts
def test_shapes_that_repeat_serve_for_all_configurations(count):
    rng = np.random.default_rng(9)
    links = [jostle.sphere(0.5), jostle.box([0.5, 0.4, 0.3]), jostle.capsule(0.5, 0.2)]
    arm, copies = jostle.Shapes(links), jostle.Shapes(links * count)
    poses = jostle.poses(rng.random((3 * count, 3)) * 2)
    pairs = [(3 * k + i, 3 * k + j) for k in range(4) for i in range(3) for j in range(i)]
    assert not arm.repeats
    with pytest.raises(jostle.Error, match=f"{3 * count} rows, and there are 3 shapes"):
        jostle.bounds(arm, poses)
    arm.repeats = True
    assert arm.repeats and len(arm) == 3
    assert np.array_equal(jostle.bounds(arm, poses), jostle.bounds(copies, poses))
    with pytest.raises(jostle.Error, match="there are 3 shapes"):
        jostle.bounds(arm, poses[1:])
    with pytest.raises(jostle.NoSuchObjectError, match=f"names object {3 * count}, and there are {3 * count}"):
        jostle.touching(arm, poses, [(0, 3 * count)])
    with pytest.raises(jostle.Error, match=r"poses has the shape \(4, 4, 4\)"):  # not that there are only 4
        jostle.touching(arm, np.zeros((4, 4, 4)), [(0, 5)])
    finder = jostle.ContactFinder(3, np.float64)
    assert np.array_equal(finder.touching(arm, poses, pairs), finder.touching(copies, poses, pairs))
    assert np.array_equal(finder.distances(arm, poses, pairs), finder.distances(copies, poses, pairs))
    index = jostle.BoxIndex(jostle.bounds(copies, poses)[:12])
    moved, whole = poses[:12] + [3, 0, 0, 0, 0, 0, 0], jostle.Shapes(links * 4)
    assert np.array_equal(index.first(jostle.nearest_to_shapes(arm, moved), arm, poses[:12]),
                          index.first(jostle.nearest_to_shapes(whole, moved), whole, poses[:12]))
    arm.repeats = False
    with pytest.raises(jostle.Error):
        finder.touching(arm, poses, pairs)


def test_a_contact_finder_in_use_refuses_another_call():
    centers = np.random.default_rng(1).random((12_000, 3)) * 13
    shapes, poses = jostle.Shapes.spheres(np.full(len(centers), 0.5)), jostle.poses(centers)
    pairs = jostle.find_pairs(jostle.bounds(shapes, poses))
    finder, few = jostle.ContactFinder(3), pairs[:500]
    done, right, refused = threading.Event(), [0, 0], []

    def ask(which, all_pairs):
        for find, expected in zip((finder.find, finder.find_points), which):
            try:
                assert np.array_equal(find(shapes, poses, all_pairs)["pair"], expected)
                right[len(all_pairs) > 500] += 1
            except jostle.Error as error:
                refused.append(str(error))

    def answers(of):
        return [find(shapes, poses, of)["pair"] for find in (finder.find, finder.find_points)]

    def ask_on():
        while not done.is_set():
            ask(of_few, few)
    of_all, of_few = answers(pairs), answers(few)
    thread = threading.Thread(target=ask_on)
    thread.start()
    wrong = []
    try:
        for _ in range(60):
            ask(of_all, pairs)
    except AssertionError as error:
        wrong.append(error)
    done.set()
    thread.join()
    assert not wrong and right[0] > 0
    assert all("the contact finder is in use by another call" in each for each in refused), set(refused)
    finder.find(shapes, poses, few), finder.touching(shapes, poses, few)  # no longer in use
