# SPDX-License-Identifier: MIT
"""Surface and SurfaceFinder against the definition in NumPy, over all pairs; and the questions about single pairs."""
import gc
import threading

import numpy as np
import pytest

import jostle

DTYPES = (np.float32, np.float64)


def segment_point(a, b, p):
    """The nearest point to p on the segments, and their ends' weights."""
    way = b - a
    length = (way * way).sum(-1)
    t = np.where(length > 0, ((p - a) * way).sum(-1) / np.where(length > 0, length, 1), 0).clip(0, 1)
    return a + t[..., None] * way


def triangle_distance(p, a, b, c):
    """Of points and triangles that aren't flat: of the foot on the plane where that is inside, and of the sides."""
    sides = [np.linalg.norm(segment_point(x, y, p) - p, axis=-1) for x, y in ((a, b), (b, c), (c, a))]
    u, v, w = b - a, c - a, p - a
    uu, uv, vv, wu, wv = ((x * y).sum(-1) for x, y in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    s, t = np.linalg.solve(np.stack([np.stack([uu, uv], -1), np.stack([uv, vv], -1)], -2), np.stack([wu, wv], -1)[..., None])[..., 0].T
    foot = a + s[:, None] * u + t[:, None] * v
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    return np.minimum(np.min(sides, axis=0), np.where(inside, np.linalg.norm(foot - p, axis=-1), np.inf))


def edge_distance(a, b, c, d):
    """Of edges that aren't parallel: of the lines' nearest points where both are inside, and of all ends."""
    ends = [np.linalg.norm(segment_point(x, y, p) - p, axis=-1) for x, y, p in ((a, b, c), (a, b, d), (c, d, a), (c, d, b))]
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, wu, wv = ((x * y).sum(-1) for x, y in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    det = uu * vv - uv * uv
    s, t = (uv * wv - vv * wu) / det, (uu * wv - uv * wu) / det
    inside = (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    gap = np.linalg.norm(a + s[:, None] * u - c - t[:, None] * v, axis=-1)
    return np.minimum(np.min(ends, axis=0), np.where(inside, gap, np.inf))


def all_pairs(surface):
    """(pair, vertices) of each kind, those that share a vertex left out."""
    out = []
    for firsts, seconds, ordered in ((surface.points[:, None], surface.triangles, False), (surface.edges, surface.edges, True)):
        a, b = np.meshgrid(np.arange(len(firsts)), np.arange(len(seconds)), indexing="ij")
        a, b = a.ravel(), b.ravel()
        vertices = np.concatenate([firsts[a], seconds[b]], axis=1)
        n = firsts.shape[1]
        apart = (vertices[:, :n, None] != vertices[:, None, n:]).all((1, 2)) & (not ordered or a < b)
        numbers = np.stack([a if ordered else firsts[a, 0], b], axis=1)
        out.append((numbers[apart], vertices[apart]))
    return out


def some_surface(rng, n=40):
    triangles = np.array([rng.choice(n - 3, 3, replace=False) for _ in range(n)])
    return jostle.Surface(triangles, edges=[[n - 3, n - 2]], points=[n - 1])


def as_set(pairs):
    out = {tuple(map(int, pair)) for pair in pairs}
    assert len(out) == len(pairs)
    return out


def test_a_surface_has_each_edge_once_and_hands_out_its_own_memory():
    surface = jostle.Surface([[0, 1, 2], [2, 1, 3]], edges=[[5, 4]], points=[7], vertices=9)
    assert surface.vertices == 9
    assert surface.triangles.tolist() == [[0, 1, 2], [2, 1, 3]]
    assert surface.edges.tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3], [4, 5]]
    assert surface.points.tolist() == [0, 1, 2, 3, 4, 5, 7]
    assert repr(surface) == "Surface(2 triangles, 6 edges, 9 vertices)"
    assert jostle.Surface([[0, 1, 2]]).vertices == 3
    edges = surface.edges
    assert edges.__array_interface__["data"] == surface.edges.__array_interface__["data"]
    with pytest.raises(ValueError, match="read-only"):
        edges[0] = 3
    del surface
    gc.collect()
    assert edges.tolist()[5] == [4, 5]


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("seed", range(6))
def test_near_is_what_is_near(seed, dtype):
    rng = np.random.default_rng(seed)
    surface, finder = some_surface(rng), jostle.SurfaceFinder(threads=1 + seed % 2)
    at = (rng.random((40, 3)) * 2).astype(dtype)
    thickness = (rng.random(40) / 8).astype(dtype)
    bodies, rest = rng.integers(0, 3, 40), (rng.random((40, 3)) * 2).astype(dtype)
    for options in ({}, {"thickness": thickness}, {"bodies": bodies}, {"rest": rest}, {"thickness": thickness, "bodies": bodies, "rest": rest}):
        near = finder.near(surface, at, 0.25, **options)
        for found, (numbers, vertices), first in zip(near, all_pairs(surface), (1, 2)):
            of = triangle_distance if first == 1 else edge_distance
            distance = of(*(at.astype(float)[vertices[:, k]] for k in range(4)))
            reach = np.full(len(numbers), float(dtype(0.25)))
            if "thickness" in options:
                thick = thickness.astype(float)[vertices]
                reach += thick[:, :first].max(1) + thick[:, first:].max(1)
            kept = np.abs(distance - reach) > 1e-9  # too close to tell
            assert kept.all()
            kept = distance <= reach
            if "bodies" in options:
                kept &= bodies[vertices[:, 0]] != bodies[vertices[:, first]]
            if "rest" in options:
                kept &= of(*(rest.astype(float)[vertices[:, k]] for k in range(4))) > reach
            assert 0 < kept.sum() < len(kept)
            assert as_set(found["pair"]) == as_set(numbers[kept])
            by_pair = {tuple(map(int, pair)): (corners, far) for pair, corners, far in zip(numbers, vertices, distance)}
            small = 1e-5 if dtype is np.float32 else 1e-12
            for one in found:
                corners, far = by_pair[tuple(map(int, one["pair"]))]
                assert one["vertices"].tolist() == corners.tolist()
                assert abs(one["distance"] - far) < small
                places = one["weights"][:, None] * at[corners]
                gap = places[first:].sum(0) - places[:first].sum(0)
                assert abs(np.linalg.norm(gap) - far) < small and np.abs(gap - one["normal"] * far).max() < small
                assert abs(one["weights"][:first].sum() - 1) < small and abs(one["weights"][first:].sum() - 1) < small


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("seed", range(4))
def test_moving_is_never_late(seed, dtype):
    rng = np.random.default_rng(seed)
    surface, finder = some_surface(rng, 24), jostle.SurfaceFinder()
    start, end = (rng.random((2, 24, 3)) * 3).astype(dtype)
    moving = finder.moving(surface, start, end, 0.125)
    steps = np.linspace(0, 1, 401)
    wide = start.astype(float), end.astype(float)
    firsts = [1.0]
    for found, (numbers, vertices), of in zip(moving, all_pairs(surface), (triangle_distance, edge_distance)):
        at = wide[0] + steps[:, None, None] * (wide[1] - wide[0])
        distance = np.array([of(*(now[vertices[:, k]] for k in range(4))) for now in at])
        inside = distance <= 0.125
        first = np.where(inside.any(0), steps[inside.argmax(0)], np.inf)
        assert as_set(found["pair"]) >= as_set(numbers[inside.any(0)])  # between two steps there may be more
        assert len(found) < inside.any(0).sum() * 1.2 + 5
        times = {tuple(map(int, pair)): time for pair, time in zip(found["pair"], found["time"])}
        for pair, corners, sampled in zip(numbers, vertices, first):
            time = times.get(tuple(map(int, pair)), np.inf)
            assert time <= sampled
            if time < np.inf:
                now = wide[0] + float(time) * (wide[1] - wide[0])
                assert of(*(now[corners[None, k]] for k in range(4)))[0] < 0.125 + 1e-5
                firsts.append(float(time))
        single = jostle.vertex_triangle_impact if of is triangle_distance else jostle.edge_edge_impact
        alone = single(wide[0][vertices], wide[1][vertices], 0.125)
        assert {tuple(map(int, pair)) for pair in numbers[np.isfinite(alone)]} == as_set(found["pair"])
    assert moving.safe_step == min(firsts)
    apart = finder.moving(surface, start, end, 0.125, bodies=np.zeros(24, int))
    assert len(apart.vertex_triangle) == len(apart.edge_edge) == 0 and apart.safe_step == 1


def test_crossings_are_edges_through_triangles():
    surface = jostle.Surface([[0, 1, 2], [3, 4, 5]])
    at = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 1.0]])
    finder = jostle.SurfaceFinder()
    found = finder.crossings(surface, at)
    through = [i for i, edge in enumerate(surface.edges.tolist()) if edge == [3, 4]]
    assert [through[0], 0] in found.tolist() and found.dtype == np.uint32
    assert len(finder.crossings(surface, at, bodies=[0] * 6)) == 0
    assert len(finder.crossings(surface, at + np.array([[0, 0, 0]] * 3 + [[0, 0, 5]] * 3))) == 0


def test_single_pairs():
    rng = np.random.default_rng(3)
    start, end = rng.random((2, 300, 4, 3))
    for kind, impact, distance, of in ((1, jostle.vertex_triangle_impact, jostle.vertex_triangle_distance, triangle_distance),
                                       (2, jostle.edge_edge_impact, jostle.edge_edge_distance, edge_distance)):
        found = distance(start)
        assert np.abs(found["distance"] - of(*(start[:, k] for k in range(4)))).max() < 1e-12
        gap = (found["weights"][..., None] * start * np.array([-1] * kind + [1] * (4 - kind))[:, None]).sum(1)
        assert np.abs(gap - found["normal"] * found["distance"][:, None]).max() < 1e-12
        times = impact(start, end, 0.0625)
        assert times.dtype == float and 20 < np.isfinite(times).sum() < 280
        assert ((times >= 0) & (times <= 1))[np.isfinite(times)].all()
        one = impact(start[7], end[7], 0.0625)
        assert np.isscalar(one) and one == times[7]
        assert (impact(start.reshape(3, 100, 4, 3), end.reshape(3, 100, 4, 3), 0.0625) == times.reshape(3, 100)).all()
        assert distance(start[7]).shape == () and distance(start[7])["distance"] == found["distance"][7]
        assert impact([], []).shape == (0,) and distance([]).shape == (0,)
        with pytest.raises(jostle.Error, match="it must be .n, 4, 3."):
            impact(start[:, :3], end[:, :3])
        with pytest.raises(jostle.Error, match="each vertex has one place in both"):
            impact(start, end[:5])
        with pytest.raises(jostle.Error, match="tolerance is 0"):
            impact(start, end, tolerance=0)
        with pytest.raises(jostle.Error, match="distance"):
            impact(start, end, -1)
        start[40, 2, 1] = np.nan
        with pytest.raises(jostle.Error) as error:
            impact(start, end)
        assert error.value.index == 40
        start[40, 2, 1] = 0


def test_mistakes_are_named():
    surface, finder = jostle.Surface([[0, 1, 2]]), jostle.SurfaceFinder()
    at = np.eye(3)
    for call, words in (
            (lambda: jostle.Surface([[0, 1, 1]]), "triangle 0 has vertex 1 twice"),
            (lambda: jostle.Surface([[0, 1, 3]], vertices=3), "triangle 0 has vertex 3 of 3"),
            (lambda: jostle.Surface([[0, 1, -1]]), r"triangles\[0, 2\] is -1"),
            (lambda: jostle.Surface([0, 1, 2]), "triangles has the shape"),
            (lambda: jostle.Surface([], edges=[[0, 1, 2]]), "edges has the shape"),
            (lambda: jostle.Surface([], points=[[0]]), "points has the shape"),
            (lambda: jostle.Surface([[0, 1, 2]], vertices=-1), "vertices is -1"),
            (lambda: finder.near([[0, 1, 2]], at, 1), "surface is a list: it must be a Surface"),
            (lambda: finder.near(surface, at[:2], 1), "2 positions|3 vertices"),
            (lambda: finder.near(surface, at[:, :2], 1), "positions has the shape"),
            (lambda: finder.near(surface, at, -1), "the distance is -1"),
            (lambda: finder.near(surface, at * np.nan, 1), "position"),
            (lambda: finder.near(surface, at, 1, thickness=[1.0]), r"thickness has the shape \(1,\): it must be \(3,\)"),
            (lambda: finder.near(surface, at, 1, thickness=[1.0, -1, 1]), "thickness of vertex 1 is -1"),
            (lambda: finder.near(surface, at, 1, bodies=[1, 2]), r"bodies has the shape \(2,\)"),
            (lambda: finder.near(surface, at, 1, rest=at[:2]), r"rest has the shape \(2, 3\): it must be \(3, 3\)"),
            (lambda: finder.near(surface, at.astype(np.float32), 1, rest=at), "would have to be rounded"),
            (lambda: finder.moving(surface, at, at[:2]), "each vertex has one place in both"),
            (lambda: finder.moving(surface, at, at, tolerance=2), "the tolerance is 2"),
            (lambda: finder.crossings(surface, at[:1]), "vertices")):
        with pytest.raises(jostle.Error, match=words):
            call()
    with pytest.raises(TypeError, match="can't be copied"):
        __import__("copy").copy(finder)
    assert len(finder.near(surface, at, 1).edge_edge) == 0
    assert finder.moving(surface, at.astype(np.float32), at, 1).vertex_triangle["time"].dtype == np.float64


def test_results_outlive_the_finder_and_its_next_search():
    rng = np.random.default_rng(1)
    surface, at = some_surface(rng), rng.random((40, 3))
    finder = jostle.SurfaceFinder()
    near = finder.near(surface, at, 0.25)
    before = near.edge_edge.tobytes()
    finder.near(surface, at + rng.random((40, 3)), 0.5)
    finder.release_memory()
    del finder
    gc.collect()
    assert near.edge_edge.tobytes() == before


def test_one_finder_takes_positions_of_both_types():
    rng = np.random.default_rng(4)
    surface, at, finder = some_surface(rng), rng.random((40, 3)), jostle.SurfaceFinder()
    for dtype in (*DTYPES, *DTYPES):
        near, alone = (each.near(surface, at.astype(dtype), 0.25) for each in (finder, jostle.SurfaceFinder()))
        assert near.vertex_triangle["weights"].dtype == dtype
        assert near.vertex_triangle.tobytes() == alone.vertex_triangle.tobytes() and len(near.edge_edge) > 0


def test_a_finder_is_for_one_call_at_a_time():
    rng = np.random.default_rng(2)
    surface, at, finder = some_surface(rng, 400), rng.random((400, 3)), jostle.SurfaceFinder(threads=1)
    told = []

    def search():
        try:
            finder.near(surface, at, 0.3)
        except jostle.Error as error:
            told.append(str(error))

    for _ in range(50):
        threads = [threading.Thread(target=search) for _ in range(4)]
        for one in threads:
            one.start()
        for one in threads:
            one.join()
        if told:
            break
    assert told and "surface finder" in told[0]
