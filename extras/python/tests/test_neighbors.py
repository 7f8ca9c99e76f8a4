# SPDX-License-Identifier: MIT
"""neighbors and NeighborFinder: against the definition, over all images, and against SciPy's cKDTree in open space."""
import contextlib
import gc
import itertools
import threading

import numpy as np
import pytest

import jostle

KINDS = [(dim, dtype) for dim in (2, 3) for dtype in (np.float32, np.float64)]


def by_definition(points, cutoff, cell, periodic, others=None):
    """{(i, j, S...)}, each operation in the points' own numbers; cutoff(i, j) is a matrix."""
    dim, dtype = points.shape[1], points.dtype
    to = points if others is None else others
    cell = np.asarray(cell, dtype)
    on = [k for k in range(dim) if periodic[k]]
    reach = [0] * dim
    if on and len(points) and len(to):
        away = (to[None] - points[:, None]).reshape(-1, dim).astype(float)
        ways = np.linalg.pinv(cell[on].astype(float))  # of lengths along the vectors: columns
        for column, k in enumerate(on):
            most = np.abs(away @ ways[:, column]).max() + np.linalg.norm(ways[:, column]) * float(cutoff.max())
            reach[k] = int(most) + 1
    found = set()
    for shift in itertools.product(*(range(-n, n + 1) for n in reach)):
        by = np.zeros(dim, dtype)
        for n, k in enumerate(on):
            term = dtype.type(shift[k]) * cell[k]
            by = term if n == 0 else by + term
        d = (to[None] - points[:, None]) + by if on else to[None] - points[:, None]
        square = d * d
        total = square[..., 0] + square[..., 1]
        total = total + square[..., 2] if dim == 3 else total
        near = (total <= cutoff * cutoff) & (cutoff > 0)
        if others is None and not any(shift):
            np.fill_diagonal(near, False)
        found |= {(int(i), int(j), *shift) for i, j in np.argwhere(near)}
    return found


def as_set(i, j, shifts):
    listed = [(int(a), int(b), *(int(n) for n in s)) for a, b, s in zip(i, j, shifts)]
    assert listed == sorted(set(listed))  # the order that the documentation states
    return set(listed)


def some_cell(rng, dim, dtype, size):
    cell = np.eye(dim) * size * rng.uniform(0.5, 1.5, dim)
    cell += rng.uniform(-0.4, 0.4, (dim, dim)) * size
    return cell.astype(dtype)


def some_points(rng, n, dim, dtype, size):
    points = rng.uniform(-size, 2 * size, (n, dim))
    if rng.random() < 0.5:  # ties
        points = np.round(points * 2) / 2
    return points.astype(dtype)


def cutoffs(value, n, m, dtype):
    return np.full((n, m), value, dtype)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_finds_what_the_definition_says_in_any_cell(dim, dtype):
    rng = np.random.default_rng(dim + np.dtype(dtype).itemsize)
    some = 0
    for case in range(60):
        size, reach = rng.choice([1.0, 4, 8]), dtype(rng.choice([0.5, 1, 2.25]))
        points, cell = some_points(rng, int(rng.integers(0, 25)), dim, dtype, size), some_cell(rng, dim, dtype, size)
        periodic = rng.random(dim) < 0.6
        n = len(points)
        expected = by_definition(points, cutoffs(reach, n, n, dtype), cell, periodic)
        i, j, shifts, away, d, first = jostle.neighbors(points, reach, cell, periodic, quantities="ijSDdo")
        assert as_set(i, j, shifts) == expected, case
        some += len(expected)
        assert (i.dtype, j.dtype, shifts.dtype, first.dtype) == (np.uint32, np.uint32, np.int32, np.int64)
        assert away.dtype == d.dtype == dtype and shifts.shape == away.shape == (len(i), dim)
        assert np.array_equal(np.repeat(np.arange(n), np.diff(first)), i)
        np.testing.assert_allclose(away, points[j] - points[i] + shifts @ (cell * periodic[:, None]), atol=1e-5 * size)
        np.testing.assert_allclose(d, np.linalg.norm(away, axis=1), rtol=1e-6)
        half = as_set(*jostle.neighbors(points, reach, cell, periodic, full=False, quantities="ijS", threads=2))
        back = {(b, a, *(-s for s in shift)) for a, b, *shift in half}
        assert all(a <= b for a, b, *_ in half) and half | back == expected and not half & back
    assert some > 1000


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_radii_types_and_two_sets(dim, dtype):
    rng = np.random.default_rng(7)
    cell, periodic = some_cell(rng, dim, dtype, 3), [True] * (dim - 1) + [False]
    a, b = some_points(rng, 40, dim, dtype, 3), some_points(rng, 30, dim, dtype, 3)
    radii, radii_b = rng.uniform(0, 1.2, 40).astype(dtype), rng.uniform(0, 1.2, 30).astype(dtype)
    kinds, kinds_b = rng.choice(["H", "C", "O"], 40), rng.choice(["C", "N"], 30)
    table = {("H", "C"): 1.1, ("C", "C"): 1.5, ("O", "N"): 2.0, ("H", "H"): 0.75, ("C", "H"): 1.1}
    of_types = lambda s, t: np.array([[table.get((x, y), table.get((y, x), 0)) for y in t] for x in s], dtype)
    for others, given, expected in (
            (None, dict(cutoff=1.5), cutoffs(dtype(1.5), 40, 40, dtype)),
            (None, dict(cutoff=radii), radii[:, None] + radii[None]),
            (None, dict(cutoff=table, types=kinds), of_types(kinds, kinds)),
            (b, dict(cutoff=1.5), cutoffs(dtype(1.5), 40, 30, dtype)),
            (b, dict(cutoff=radii, cutoff_b=radii_b), radii[:, None] + radii_b[None]),
            (None, dict(cutoff=radii, greater=True), np.maximum(radii[:, None], radii[None])),
            (b, dict(cutoff=radii, cutoff_b=radii_b, greater=True), np.maximum(radii[:, None], radii_b[None])),
            (b, dict(cutoff=table, types=kinds, types_b=kinds_b), of_types(kinds, kinds_b))):
        found = as_set(*jostle.neighbors(a, cell=cell, periodic=periodic, others=others, quantities="ijS", **given))
        assert found and found == by_definition(a, expected, cell, periodic, others), given
    number = {"H": 0, "C": 1, "O": 2, "N": 3}
    by_number = of_types(list(number), list(number))
    for others, types in ((None, {}), (b, dict(types_b=[number[k] for k in kinds_b]))):
        i, j = jostle.neighbors(a, by_number, cell, periodic, others=others, types=[number[k] for k in kinds], **types)
        also = jostle.neighbors(a, table, cell, periodic, others=others, types=kinds, types_b=None if others is None else kinds_b)
        assert len(i) and np.array_equal(i, also[0]) and np.array_equal(j, also[1])
    # Points of the wider numbers, where a set has other ones.
    if dtype == np.float32:
        wide = jostle.neighbors(a, 1.5, others=b.astype(np.float64), quantities="d")
        assert wide.dtype == np.float64 and np.array_equal(wide, jostle.neighbors(a.astype(np.float64), 1.5, others=b, quantities="d"))


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_each_of_many_systems_is_what_it_is_alone(dim, dtype):
    rng = np.random.default_rng(8)
    systems = [some_points(rng, n, dim, dtype, 3) for n in (15, 0, 25, 1, 60)]
    cells = np.stack([some_cell(rng, dim, dtype, 3) for _ in systems])
    periodic = rng.random((5, dim)) < 0.6
    first = np.cumsum([0] + [len(one) for one in systems])
    radii = rng.uniform(0.3, 0.9, first[-1])
    one_cell, one_flag = cells[0], periodic[0]
    for cell, flags, cutoff in ((cells, periodic, 1.5), (cells, True, 1.5), (one_cell, periodic, radii), (one_cell, one_flag, radii),
                                (np.full(dim, 3.0), True, 1.5)):
        alone = []
        for k, points in enumerate(systems):
            i, j, s = jostle.neighbors(points, cutoff if np.isscalar(cutoff) else cutoff[first[k]:first[k + 1]],
                                       cell[k] if cell.ndim == 3 else cell, flags[k] if np.ndim(flags) == 2 else flags, quantities="ijS")
            alone.append((i + first[k], j + first[k], s))
        expected = [np.concatenate(each) for each in zip(*alone)]
        assert len(expected[0]) > 10
        for points, offsets in ((systems, None), (tuple(systems), None), (np.concatenate(systems), first)):
            found = jostle.neighbors(points, cutoff, cell, flags, offsets=offsets, quantities="ijS", threads=2)
            assert all(np.array_equal(x, y) for x, y in zip(found, expected))
    i, j = jostle.neighbors(systems, 1.0)
    assert np.array_equal(np.searchsorted(first, i, "right"), np.searchsorted(first, j, "right"))


def test_equals_ckdtree_in_open_and_in_rectangular_space():
    spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(9).random((3000, 3))
    for size in (None, [1.0, 1, 1]):
        pairs = spatial.cKDTree(points, boxsize=size).query_pairs(0.08, output_type="ndarray")
        i, j = jostle.neighbors(points, 0.08, size, size is not None, full=False)
        pairs = pairs[np.lexsort(pairs.T[::-1])]
        assert len(i) > 3000 and np.array_equal(np.column_stack([i, j]), pairs)


def test_quantities_come_in_the_order_of_their_letters():
    points = np.random.default_rng(1).random((50, 3))
    j, i = jostle.neighbors(points, 0.3, quantities="ji")
    assert np.array_equal(jostle.neighbors(points, 0.3)[0], i) and np.array_equal(jostle.neighbors(points, 0.3, quantities="j"), j)
    a, d, b = jostle.neighbors(points, 0.3, quantities="jdj")
    assert np.array_equal(a, j) and a is b and len(d) == len(j) > 100
    o, j = jostle.neighbors(points, 0.3, quantities="oj")
    assert all(np.array_equal(j[o[k]:o[k + 1]], j[i == k]) or k for k in range(50)) and o[-1] == len(j) and len(o) == 51
    for quantities, shapes in (("ijSDdo", [(0,), (0,), (0, 3), (0, 3), (0,), (1,)]),):
        for empty in ([], np.empty((0, 3))):
            assert [one.shape for one in jostle.neighbors(empty, 1, quantities=quantities)] == shapes
            for greater in (False, True):
                assert [one.shape for one in jostle.neighbors(empty, [], greater=greater, quantities=quantities)] == shapes
            assert [one.shape for one in jostle.neighbors(empty, {("H", "H"): 1}, types=[], quantities=quantities)] == shapes
    assert [one.shape for one in jostle.neighbors(points, 0.3, others=points[:0], quantities="So")] == [(0, 3), (51,)]


def test_an_array_outlives_the_others_until_it_is_collected():
    points = np.random.default_rng(2).random((2000, 3))
    expected = [one.tobytes() for one in jostle.neighbors(points, 0.1, quantities="jSDdo")]
    for k in range(5):
        kept = jostle.neighbors(points, 0.1, quantities="jSDdo")[k]
        gc.collect()
        more = jostle.neighbors(points + 1, 0.1, quantities="jSDdo")
        assert kept.tobytes() == expected[k] and not kept.flags.owndata and type(kept.base).__name__ == "PyCapsule"
        kept[:] = 7
        assert more[k].tobytes() != kept.tobytes() and kept.flags.writeable and kept.flags.c_contiguous
        view = kept[3:5]
        del kept, more
        gc.collect()
        assert (view == 7).all()


def test_a_finder_keeps_what_a_skin_allows():
    rng = np.random.default_rng(3)
    points, cell = rng.random((400, 3)) * 4, np.eye(3) * 4 + 0.3
    finder = jostle.NeighborFinder(skin=0.4, threads=1)
    searches = 0
    for step in range(12):
        mine = finder.find(points, 0.8, cell, True, quantities="ijSd")
        searches += finder.searched
        assert all(np.array_equal(x, y) for x, y in zip(mine, jostle.neighbors(points, 0.8, cell, True, quantities="ijSd")))
        assert all(one.flags.owndata for one in mine)
        points = points + rng.uniform(-0.03, 0.03, points.shape)
    assert 1 < searches < 7
    kept = finder.find(points, 0.8, cell, True)
    before = [one.copy() for one in kept]
    finder.find(points, 0.8, cell, True)
    assert not finder.searched
    finder.release_memory()
    finder.find(points * 0.5, 0.8, cell, True)
    assert finder.searched and all(np.array_equal(x, y) for x, y in zip(kept, before))
    # Points of another kind, and a finder without a skin.
    for plain in (finder, jostle.NeighborFinder()):
        for dim, dtype in KINDS:
            flat = points[:, :dim].astype(dtype)
            assert np.array_equal(plain.find(flat, 0.2, quantities="j"), jostle.neighbors(flat, 0.2, quantities="j"))
    with pytest.raises(TypeError, match="can't be copied"):
        finder.__copy__()


@pytest.mark.parametrize("arguments,message,index", [
    (dict(points=[[0.0, 0, 0], [0, np.nan, 0]]), "point", 1),
    (dict(points=[0.0, 1, 2]), r"points has the shape \(3,\)", None),
    (dict(points=[["a", "b", "c"]]), "points has the dtype", None),
    (dict(cutoff=-1), "cutoff is -1", None),
    (dict(cutoff=0), "cutoff is 0", None),
    (dict(cutoff=np.inf), "inf", None),
    (dict(cutoff=[1.0]), r"cutoff has the shape \(1,\): it must be one number", None),
    (dict(cutoff=[1.0, -2]), "-2", 1),
    (dict(greater=True), "the greater one may count, and there are none", None),
    (dict(cutoff_b=[1.0, 2]), "cutoff_b is given, and there are no others", None),
    (dict(types_b=[1, 2]), "types_b is given, and there are no others", None),
    (dict(cutoff={(0, 0): 1}), "types isn't given", None),
    (dict(cutoff={(0, 0): 1}, types=[0]), r"types has the shape \(1,\), and there are 2 points", None),
    (dict(cutoff={0: 1}, types=[0, 0]), "cutoff has the key 0", None),
    (dict(cutoff={(0, 0): -1}, types=[0, 0]), r"cutoff\[\(0, 0\)\] is -1", None),
    (dict(cutoff={(0, 1): 1, (1, 0): 2}, types=[0, 0]), r"cutoff\[\(1, 0\)\] is 2.0, and cutoff\[\(0, 1\)\] is 1", None),
    (dict(cutoff=[1.0, 2], types=[0, 0]), r"cutoff has the shape \(2,\), and types is given", None),
    (dict(cutoff=[[1.0]], types=[0, 1]), "1", 1),
    (dict(cutoff=[[1.0]], types=[0, 0], others=[[0.0, 0, 0]]), "types_b isn't given", None),
    (dict(cutoff=[[1.0]], types=[0, 0], types_b=[0], cutoff_b=1, others=[[0.0, 0, 0]]), "cutoff_b is given", None),
    (dict(others=[[0.0, 0]]), "others", None),
    (dict(others=[[0.0, 0, 0]], full=False), "half lists are for one set", None),
    (dict(others=[[0.0, 0, 0]], offsets=[0, 2]), "others is given, and there are many systems", None),
    (dict(periodic=True), "periodic is True, and there is no cell", None),
    (dict(periodic=2, cell=[1, 1, 1]), "periodic is 2: it must be True or False", None),
    (dict(periodic=[True], cell=[1, 1, 1]), r"periodic has the shape \(1,\)", None),
    (dict(cell=[1.0, 1]), r"cell has the shape \(2,\)", None),
    (dict(cell=np.ones((1, 3, 3))), r"cell has the shape \(1, 3, 3\)", None),
    (dict(cell=np.zeros((3, 3)), periodic=[False, False, True]), "vector", None),
    (dict(cell=[[1, 0, 0], [1, 0, 0], [0, 0, 1]], periodic=True), "", None),
    (dict(cell=[1e-9, 1, 1], periodic=True), "500", None),
    (dict(offsets=[0, 3]), "the last offset, number 1, is 3", 1),
    (dict(offsets=[]), "offsets is empty", None),
    (dict(points=[[[0.0, 0, 0]], [[0.0, 0, 0]]], offsets=[0, 2]), "points is a list of systems already", None),
    (dict(points=[[[0.0, 0, 0]], [[0.0, np.nan, 0]]]), "system 1", 1),
    (dict(quantities="ijx"), "quantities is 'ijx'", None),
    (dict(quantities=""), "quantities is ''", None),
    (dict(threads=-1), "threads is -1", None),
])
def test_mistakes_are_named(arguments, message, index):
    with pytest.raises(jostle.Error, match=message) as error:
        jostle.neighbors(**{**dict(points=[[0.0, 0, 0], [0.5, 0, 0]], cutoff=1.0), **arguments})
    assert error.value.index == index
    finder = jostle.NeighborFinder(skin=0.1)
    before = finder.find([[0.0, 0, 0], [0.5, 0, 0]], 1.0)
    if "threads" not in arguments:
        with pytest.raises(jostle.Error, match=message if "offset" not in message and "system" not in message else ""):
            finder.find(**{**dict(points=[[0.0, 0, 0], [0.5, 0, 0]], cutoff=1.0), **arguments})
    again = finder.find([[0.0, 0, 0], [0.5, 0, 0]], 1.0)
    assert not finder.searched and all(np.array_equal(x, y) for x, y in zip(before, again))


def test_a_finder_refuses_a_wrong_skin_and_many_systems_with_one():
    for skin in (-1.0, np.inf, np.nan):
        with pytest.raises(jostle.Error, match="the skin is"):
            jostle.NeighborFinder(skin=skin).find([[0.0, 0, 0]], 1.0)
    with pytest.raises(jostle.Error, match="a skin is for one system"):
        jostle.NeighborFinder(skin=0.1).find([[[0.0, 0, 0]], [[0.0, 0, 0]]], 1.0)


def test_a_finder_is_for_one_call_at_a_time():
    finder, points = jostle.NeighborFinder(threads=1), np.random.default_rng(4).random((100_000, 3))
    expected = jostle.neighbors(points, 0.03)
    refused = 0
    for _ in range(10):
        found = []

        def find():
            with contextlib.suppress(jostle.Error):  # where the calls below were first
                found.append(finder.find(points, 0.03))

        thread = threading.Thread(target=find)
        thread.start()
        while thread.is_alive() and not refused:
            for call in (lambda: finder.find([[0.0, 0, 0]], 1.0), finder.release_memory):
                try:
                    call()
                except jostle.Error as error:
                    assert "the neighbor finder is in use" in str(error)
                    refused += 1
        thread.join()
        if refused and found:
            break
    assert refused and all(np.array_equal(x, y) for x, y in zip(found[0], expected))


@pytest.mark.parametrize("dim", [2, 3])
def test_blocks_of_a_stream_are_the_list(dim):
    rng = np.random.default_rng(dim)
    points, others = rng.random((300, dim)), rng.random((170, dim))
    finder = jostle.NeighborFinder()
    for more in (dict(), dict(full=False), dict(cell=[1.0] * dim, periodic=True), dict(others=others)):
        i, j, S, D, d, o = finder.find(points, 0.15, quantities="ijSDdo", **more)
        for rows in (1, 7, 299, 300, 10**6):
            blocks, ends = [], [0]

            def take(first, offsets, *columns):
                assert first == ends[-1] and offsets[0] == 0 and offsets[-1] == len(columns[0]) and len(offsets) <= rows + 1
                assert (offsets + sum(len(block[0]) for block in blocks)).tolist() == o[first:first + len(offsets)].tolist()
                ends.append(first + len(offsets) - 1)
                blocks.append(columns)

            assert finder.stream(points, 0.15, take, rows=rows, quantities="oijSDd", **more) is True
            assert ends[-1] == 300
            for whole, parts in zip((i, j, S, D, d), zip(*blocks)):
                joined = np.concatenate(parts)
                assert joined.dtype == whole.dtype and joined.tobytes() == whole.tobytes()


def test_a_stream_can_be_stopped_and_can_fail():
    points = np.random.default_rng(1).random((50, 3))
    finder, seen = jostle.NeighborFinder(), []

    def stop(first, i, j):
        seen.append(first)
        return np.bool_(len(seen) < 3)

    assert finder.stream(points, 0.5, stop, rows=4) is False and seen == [0, 4, 8]

    def fail(first, i, j):
        raise KeyError(first)

    with pytest.raises(KeyError, match="0"):
        finder.stream(points, 0.5, fail)
    with pytest.raises(jostle.Error, match="in use|goes on|another"):
        finder.stream(points, 0.5, lambda first, i, j: finder.find(points, 0.5))
    with pytest.raises(jostle.Error, match="visit returned 'yes': it must return None, True or False"):
        finder.stream(points, 0.5, lambda first, i, j: "yes")
    with pytest.raises(jostle.Error, match="visit is None"):
        finder.stream(points, 0.5, None)
    with pytest.raises(jostle.Error, match="rows is 0: it must be at least 1"):
        finder.stream(points, 0.5, stop, rows=0)
    with pytest.raises(jostle.Error, match="skin"):
        jostle.NeighborFinder(skin=0.1).stream(points, 0.5, stop)
    assert len(finder.find(points, 0.5)[0]) > 0
