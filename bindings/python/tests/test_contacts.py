# SPDX-License-Identifier: MIT
"""Shapes, contacts, distances, impacts, sums."""
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
                        (lambda: jostle.compound([], np.zeros((0, 7))), "one"), (lambda: jostle.poses(np.zeros(3)), "shape"),
                        (lambda: jostle.bounds(shapes, poses[:1]), "shapes"), (lambda: jostle.bounds(shapes, poses, -1), "-1"),
                        (lambda: jostle.sum_by_object([5], [1.0], 5), "5"),
                        (lambda: jostle.sum_by_object([1], [[1.0] * 9], 5), "9"),
                        (lambda: jostle.Shapes([jostle.sphere(1), jostle.sphere(1, 2)]), "3D")):
        with pytest.raises(jostle.Error, match=words):
            call()
    with pytest.raises(IndexError):
        shapes[2] = jostle.sphere(1)
