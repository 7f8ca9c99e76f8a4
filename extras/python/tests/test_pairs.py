# SPDX-License-Identifier: MIT
"""find_pairs, iter_pairs, join: against the definition, on whatever holds numbers."""
import array
import os
import threading
import time

import numpy as np
import pytest

import jostle

KINDS = [(dim, dtype) for dim in (2, 3) for dtype in (np.float32, np.float64)]


def some_boxes(n, dim, dtype, seed=1, size=0.2):
    rng = np.random.default_rng(seed)
    boxes = rng.random((n, 2, dim)).astype(dtype)
    boxes[:, 1] = boxes[:, 0] + (rng.random((n, dim)) * size).astype(dtype)
    return boxes


def touch(a, b):
    return ((a[:, None, 0] <= b[None, :, 1]) & (b[None, :, 0] <= a[:, None, 1])).all(-1)


def by_definition(a, b=None):
    found = np.argwhere(np.triu(touch(a, a), 1) if b is None else touch(a, b))
    return found.astype(np.uint32)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_finds_what_the_definition_says_at_any_stride(dim, dtype):
    boxes = some_boxes(400, dim, dtype)
    expected = by_definition(boxes)
    assert len(expected) > 100
    wide = np.full((900, 3, dim + 3), np.nan, dtype)
    wide[:800:2, :2, 2:2 + dim] = boxes
    backwards = boxes[::-1]
    shapes = {"rows": boxes.reshape(400, -1), "fortran": np.asfortranarray(boxes), "inside": wide[:800:2, :2, 2:2 + dim],
              "columns": np.ascontiguousarray(boxes.reshape(400, -1).T).T}
    for name, given in shapes.items():
        found = jostle.find_pairs(given, order="sorted")
        assert found.dtype == np.uint32 and found.flags.owndata and np.array_equal(found, expected), name
    assert np.array_equal(np.sort(399 - jostle.find_pairs(backwards), axis=1)[:, 0].sum(), expected[:, 0].sum())
    swapped = boxes.astype(boxes.dtype.newbyteorder())
    assert np.array_equal(jostle.find_pairs(swapped, order="sorted"), expected)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_scenes_are_each_what_find_pairs_says(dim, dtype):
    sizes = [0, 40, 1, 300, 0, 64, 64, 5_000, 7]
    boxes = np.concatenate([some_boxes(n, dim, dtype, k) for k, n in enumerate(sizes)])
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    owner = np.arange(len(boxes)) // 5
    plain = jostle.find_scenes(boxes, offsets)
    wish = dict(owner=owner, accept=lambda scene, a, b: (scene + a + b) % 3 != 0)
    filtered = jostle.find_scenes(boxes, offsets.tolist(), threads=2, **wish)
    numbers = np.arange(len(boxes))
    category, mask = (1 << numbers % 3).astype(np.uint32), (numbers * 5 % 7 + 1).astype(np.uint32)
    masked = jostle.find_scenes(boxes, offsets, category=category, mask=mask)
    assert len(plain) == len(filtered) == len(sizes)
    for k, (begin, end) in enumerate(zip(offsets[:-1], offsets[1:])):
        expected = jostle.find_pairs(boxes[begin:end])
        assert np.array_equal(plain[k], expected)
        keep = [owner[begin + a] != owner[begin + b] and (k + int(a) + int(b)) % 3 != 0 for a, b in expected]
        assert np.array_equal(filtered[k], expected[np.array(keep, bool)])
        a, b = begin + expected.T.astype(np.int64)
        assert np.array_equal(masked[k], expected[(category[a] & mask[b] != 0) & (category[b] & mask[a] != 0)])
    assert plain[-1] is not None and len(plain.pairs) == plain.first[-1] > 1000
    everywhere = plain.pairs + np.repeat(offsets[:-1], np.diff(plain.first))[:, None]
    assert touch_each(boxes, everywhere)
    with pytest.raises(IndexError):
        plain[len(sizes)]


def touch_each(boxes, pairs):
    a, b = boxes[pairs[:, 0]], boxes[pairs[:, 1]]
    return ((a[:, 0] <= b[:, 1]) & (b[:, 0] <= a[:, 1])).all()


def test_wrong_offsets_are_named():
    boxes = some_boxes(10, 3, np.float64)
    for offsets, index in (([0, 5, 4, 10], 2), ([1, 10], 0), ([0, 9], 1), ([0, -1, 10], 1)):
        with pytest.raises(jostle.Error) as error:
            jostle.find_scenes(boxes, offsets)
        assert error.value.index == index
    with pytest.raises(jostle.Error):
        jostle.find_scenes(boxes, [])
    with pytest.raises(ZeroDivisionError):
        jostle.find_scenes(some_boxes(10, 3, np.float64, size=1), [0, 10], accept=lambda *_: 1 // 0)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_spatial_order(dim, dtype):
    boxes = some_boxes(3000, dim, dtype)
    order = jostle.spatial_order(boxes)
    assert order.dtype == np.uint32 and np.array_equal(np.sort(order), np.arange(3000))
    assert np.array_equal(order, jostle.spatial_order(boxes, threads=1))

    def way(of):
        return np.abs(np.diff(of[:, 0], axis=0)).sum()

    assert way(boxes[order]) < 0.4 * way(boxes)
    # The pairs are the same ones, by other names.
    pairs = np.sort(order[jostle.find_pairs(boxes[order])], axis=1)
    assert np.array_equal(pairs[np.lexsort(pairs.T[::-1])], jostle.find_pairs(boxes, order="sorted"))
    assert len(jostle.spatial_order([])) == 0
    boxes[7, 1, 0] = np.nan
    with pytest.raises(jostle.Error) as error:
        jostle.spatial_order(boxes)
    assert error.value.index == 7


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_two_sets(dim, dtype):
    a, b = some_boxes(300, dim, dtype, 1), some_boxes(200, dim, dtype, 2)
    assert np.array_equal(jostle.find_pairs(a, b, order="sorted"), by_definition(a, b))
    if dtype == np.float32:  # the wider type has both
        assert np.array_equal(jostle.find_pairs(a, b.astype(np.float64), order="sorted"), by_definition(a, b))


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_pairs_of_periodic_space(dim, dtype):
    boxes = np.round(some_boxes(150, dim, dtype) * 64) / 64  # so that shifts are exact
    period = np.ones(dim)
    period[-1] = 0
    pairs, shifts = jostle.find_periodic_pairs(boxes, period, order="sorted", threads=2)
    assert pairs.dtype == np.uint32 and shifts.dtype == dtype and shifts.shape == (len(pairs), dim)
    got = {(int(a), int(b), *shift) for (a, b), shift in zip(pairs, shifts.tolist())}
    expected = {(int(a), int(b), *[0.0] * dim) for a, b in by_definition(boxes)}
    for steps in np.ndindex(*[3 if p else 1 for p in period]):
        shift = (np.array(steps) - (period != 0)) * period
        if tuple(shift) < (0.0,) * dim:
            for a, b in by_definition(boxes, boxes + shift.astype(dtype)):
                expected.add((int(a), int(b), *shift.tolist()))
    assert got == expected and len(got) == len(pairs) and np.any(shifts != 0)
    owner = np.zeros(150, np.uint32)
    assert len(jostle.find_periodic_pairs(boxes, period, owner=owner)[0]) == 0
    some, _ = jostle.find_periodic_pairs(boxes, period, accept=lambda a, b: (a + b) % 2 == 0)
    assert 0 < len(some) == sum((a + b) % 2 == 0 for a, b, *_ in expected)
    with pytest.raises(jostle.Error, match="shorter than half") as caught:
        jostle.find_periodic_pairs(boxes, period / 8)
    assert caught.value.index is not None
    with pytest.raises(jostle.Error, match="period"):
        jostle.find_periodic_pairs(boxes, np.ones(dim + 1))
    if dtype == np.float32:
        with pytest.raises(jostle.Error, match="float64"):
            jostle.find_periodic_pairs(boxes, np.full(dim, 0.1))


def test_nothing_is_copied_on_the_way_in():
    big = some_boxes(200_000, 3, np.float32, size=0.001)
    view = big[::2]
    before = view.__array_interface__["data"]
    from jostle import _arrays
    assert _arrays.boxes(view) is view and _arrays.boxes(view).__array_interface__["data"] == before


def test_the_same_answer_on_any_number_of_threads():
    boxes = some_boxes(60_000, 3, np.float64, size=0.02)
    first = jostle.find_pairs(boxes, threads=1)
    for threads in (0, 2, 5):
        assert np.array_equal(jostle.find_pairs(boxes, threads=threads), first)


class Interface:
    def __init__(self, held):
        self.held = held
        self.__array_interface__ = held.__array_interface__


class Dlpack:
    def __init__(self, held):
        self.held = held

    def __dlpack__(self, **arguments):
        return self.held.__dlpack__()

    def __dlpack_device__(self):
        return self.held.__dlpack_device__()


def test_whatever_holds_numbers_will_do():
    boxes = some_boxes(100, 3, np.float64)
    expected = by_definition(boxes)
    flat = array.array("d", boxes.ravel())
    for given in (boxes.tolist(), Interface(boxes), Dlpack(boxes), memoryview(boxes),
                  np.frombuffer(flat).reshape(100, 6), memoryview(flat).cast("B").cast("d", (100, 6))):
        assert np.array_equal(jostle.find_pairs(given, order="sorted"), expected)
    assert np.array_equal(jostle.find_pairs([[0, 0, 1, 1], [1, 1, 2, 2]]), [[0, 1]])
    assert jostle.find_pairs([]).shape == (0, 2)
    assert jostle.find_pairs(np.empty((0, 4))).shape == (0, 2)


def test_filters():
    boxes = some_boxes(300, 2, np.float64)
    pairs = by_definition(boxes)
    rng = np.random.default_rng(3)
    category, mask = rng.integers(0, 4, 300, np.uint32), rng.integers(0, 4, 300, np.uint32)
    owner = rng.integers(0, 3, 300).astype(np.int64)
    a, b = pairs.T
    met = (category[a] & mask[b] != 0) & (category[b] & mask[a] != 0)
    assert np.array_equal(jostle.find_pairs(boxes, category=category, mask=mask, order="sorted"), pairs[met])
    assert np.array_equal(jostle.find_pairs(boxes, owner=owner, order="sorted"), pairs[owner[a] != owner[b]])
    doubled = np.repeat(owner.astype(np.uint32), 2)[::2]  # strided
    assert np.array_equal(jostle.find_pairs(boxes, owner=doubled, order="sorted"), pairs[owner[a] != owner[b]])
    assert np.array_equal(jostle.find_pairs(boxes, accept=lambda i, k: (i + k) % 2 == 0, order="sorted"),
                          pairs[(a + b) % 2 == 0])
    for ghosts in (0, 1, 120, 300):
        for given in (jostle.find_pairs(boxes, ghosts=ghosts, order="sorted"),
                      jostle.PairFinder().find(boxes, ghosts=ghosts, order="sorted"),
                      np.array(sorted(map(tuple, np.concatenate([np.empty((0, 2), np.uint32), *jostle.iter_pairs(boxes, ghosts=ghosts)]))),
                               np.uint32).reshape(-1, 2)):
            assert np.array_equal(given, pairs[a < 300 - ghosts])
    vertices = rng.integers(0, 20, (300, 3), np.uint32)
    vertices[::7, 1] = 2**32 - 1
    shared = ((vertices[a][:, :, None] == vertices[b][:, None, :]) & (vertices[a] != 2**32 - 1)[:, :, None]).any(axis=(1, 2))
    assert np.array_equal(jostle.find_pairs(boxes, vertices=vertices, order="sorted"), pairs[~shared])
    crossed = by_definition(boxes, boxes)
    assert np.array_equal(jostle.find_pairs(boxes, boxes, owner=owner, owner_b=owner, order="sorted"),
                          crossed[owner[crossed[:, 0]] != owner[crossed[:, 1]]])


class Mine(Exception):
    pass


@pytest.mark.parametrize("n", [300, 30_000])  # on the calling thread, and on one of its own
def test_what_accept_raises_comes_out(n):
    boxes = some_boxes(n, 2, np.float64, size=0.01)

    def accept(a, b):
        raise Mine(a)

    with pytest.raises(Mine):
        jostle.find_pairs(boxes, accept=accept)
    with pytest.raises(Mine):
        list(jostle.iter_pairs(boxes, accept=accept))
    assert len(jostle.find_pairs(boxes)) > 0


def test_chunks():
    boxes = some_boxes(5_000, 3, np.float32)
    whole = jostle.find_pairs(boxes)
    parts = list(jostle.iter_pairs(boxes, chunk=1000, threads=1))
    assert all(len(part) == 1000 for part in parts[:-1]) and np.array_equal(np.concatenate(parts), whole)
    some = np.concatenate(list(jostle.iter_pairs(boxes, chunk=777)))
    assert np.array_equal(some[np.lexsort(some.T[::-1])], jostle.find_pairs(boxes, order="sorted"))
    for part in jostle.iter_pairs(boxes, chunk=10):  # given up halfway
        break
    stream = jostle.iter_pairs(boxes, chunk=10)
    next(stream)
    del stream
    with pytest.raises(jostle.Error, match="box 7"):
        bad = boxes.copy()
        bad[7, 0, 0] = np.nan
        list(jostle.iter_pairs(bad))
    assert list(jostle.iter_pairs([])) == []


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_join(dim, dtype):
    rng = np.random.default_rng(4)
    points = rng.random((400, dim)).astype(dtype)
    radii = rng.random(400) * 0.05
    near = lambda p, q, r, s: ((p[:, None].astype(float) - q[None]) ** 2).sum(-1) <= (r[:, None] + s[None]) ** 2
    expected = np.argwhere(np.triu(near(points, points, radii, radii), 1))
    assert len(expected) > 10
    assert np.array_equal(jostle.join(points, radii, order="sorted"), expected)
    other = rng.random((100, dim)).astype(dtype)
    assert np.array_equal(jostle.join(points, radii, other, 0.02, order="sorted"),
                          np.argwhere(near(points, other, radii, np.full(100, 0.02))))
    on_a_line = np.arange(10.0)[:, None] * np.ones(2)
    on_a_line[:, 1] = 0
    assert len(jostle.join(on_a_line, 0.5)) == 9  # touching counts
    with pytest.raises(jostle.Error, match=r"points\[3\]") as raised:
        jostle.join(points[:4], [1, 1, 1, -1])
    assert raised.value.index == 3


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_bad_boxes_are_refused_by_name(dim, dtype):
    boxes = some_boxes(300, dim, dtype, size=0.3)
    boxes[17, 1, dim - 1] = np.nan
    boxes[30] = boxes[30, ::-1]
    for call in (lambda: jostle.find_pairs(boxes), lambda: jostle.find_scenes(boxes, [0, 300]), lambda: jostle.spatial_order(boxes),
                 lambda: list(jostle.iter_pairs(boxes)), lambda: jostle.BoxIndex(boxes), lambda: jostle.BoxIndex().build(boxes)):
        with pytest.raises(jostle.Error):
            call()


@pytest.mark.parametrize("call,words,index", [
    (lambda: jostle.find_pairs(np.zeros((3, 5))), "(3, 5)", None),
    (lambda: jostle.find_pairs(np.zeros((3, 2, 4))), "(3, 2, 4)", None),
    (lambda: jostle.find_pairs(np.zeros(())), "shape ()", None),
    (lambda: jostle.find_pairs(np.zeros((3, 6), np.float16)), "float16", None),
    (lambda: jostle.find_pairs(np.zeros((3, 6), complex)), "complex128", None),
    (lambda: jostle.find_pairs(np.array([[None] * 6])), "object", None),
    (lambda: jostle.find_pairs([[0, 0, 1, 1], [0, 0, 1, np.nan]]), "box 1", 1),
    (lambda: jostle.find_pairs([[0, 0, 1, 1], [2, 0, 1, 1]]), "box 1", 1),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), np.zeros((3, 6))), "2D", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), owner=[1, 2]), "2", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), owner=[1, -2, 3]), "owner[1] is -2", 1),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), owner=[1.5, 2, 3]), "whole", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), owner_b=[1, 2, 3]), "second", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), ghosts=4), "ghosts is 4 for 3", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), np.zeros((3, 4)), ghosts=1), "ghosts or vertices", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), vertices=[[1, 2]] * 3), "shape (3, 2)", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), vertices=[[1, 2, 3]]), "vertices has 1", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), order="random"), "random", None),
    (lambda: jostle.iter_pairs(np.zeros((3, 4)), chunk=0), "chunk", None),
    (lambda: jostle.iter_pairs(np.zeros((3, 4)), chunk=1.5), "chunk is 1.5", None),
    (lambda: jostle.BoxIndex(np.zeros((3, 4))).closest_pairs(1.5), "count is 1.5", None),
    (lambda: jostle.find_periodic_pairs(np.zeros((3, 4)), 5.0), "period has the shape (1,): it must be (2,)", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), accept=lambda a, b: np.zeros(2)), "accept returned array([0., 0.])", None),
    (lambda: jostle.find_pairs(np.zeros((3, 4)), threads=-1), "threads is -1", None),
    (lambda: jostle.find_pairs("boxes.csv"), "from str: it must be an array", None),
    (lambda: jostle.find_pairs(None), "from NoneType", None),
])
def test_mistakes_are_said(call, words, index):
    with pytest.raises(ValueError) as raised:
        call()
    assert words in str(raised.value)
    assert isinstance(raised.value, jostle.Error) and raised.value.index == index


def test_the_lock_is_released():
    boxes = some_boxes(400_000, 3, np.float64, size=0.01)
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    clock = threading.Thread(target=tick)
    clock.start()
    try:
        begin = time.perf_counter()
        found = [None] * 2

        def find(k):
            found[k] = jostle.find_pairs(boxes)

        threads = [threading.Thread(target=find, args=(k,)) for k in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        end = time.perf_counter()
    finally:
        done.set()
        clock.join()
    assert np.array_equal(found[0], found[1])
    inside = [tick for tick in ticks if begin < tick < end]
    assert len(inside) > 3  # Python went on meanwhile


def test_a_finder_searches_again():
    finder = jostle.PairFinder(threads=2)
    assert finder.stats()["objects"] == 0 and len(finder.find([])) == 0
    for seed, (dim, dtype) in enumerate(KINDS):
        boxes, others = some_boxes(3000, dim, dtype, seed), some_boxes(500, dim, dtype, 90 + seed)
        assert np.array_equal(finder.find(boxes), jostle.find_pairs(boxes))
        assert finder.stats()["objects"] == 3000 and finder.stats()["pairs"] == len(jostle.find_pairs(boxes))
        assert np.array_equal(finder.find(boxes, others, order="sorted"), by_definition(boxes, others))
        even = finder.find(boxes, accept=lambda a, b: (a + b) % 2 == 0)
        found = jostle.find_pairs(boxes)
        assert np.array_equal(even, found[found.sum(1) % 2 == 0]) and finder.stats()["pairs"] == len(even)
    kept = finder.find(boxes)
    finder.find(others)
    assert np.array_equal(kept, jostle.find_pairs(boxes))  # the caller's own
    assert repr(finder) == f"PairFinder({len(jostle.find_pairs(others))} pairs of 500 boxes in the last search)"
    reserved = finder.stats()["bytes_reserved"]
    finder.release_memory()
    assert reserved > 0 and np.array_equal(finder.find(boxes), kept)

    def again(a, b):
        for call in (lambda: finder.find(others), finder.stats, finder.release_memory):
            with pytest.raises(jostle.Error, match="the pair finder is in use"):
                call()
        return True
    assert np.array_equal(finder.find(boxes[:50], accept=again), jostle.find_pairs(boxes[:50]))
    with pytest.raises(jostle.Error, match="box 1"):
        finder.find(np.array([[0, 0, 1, 1], [np.nan, 0, 1, 1], [1, 1, 2, 2]]))
