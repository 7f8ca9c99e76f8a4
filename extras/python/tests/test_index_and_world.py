# SPDX-License-Identifier: MIT
"""BoxIndex and World: every function, against NumPy."""
import copy
import pickle
import threading

import numpy as np
import pytest

import jostle
from test_pairs import KINDS, by_definition, some_boxes, touch


def both(boxes):
    """An index and a world of the same boxes; the world's ids."""
    dim, dtype = boxes.shape[2], boxes.dtype
    world = jostle.World(dim, dtype)
    ids = world.add(boxes)
    world.update()
    return jostle.BoxIndex(boxes), world, ids


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_queries(dim, dtype):
    boxes = some_boxes(500, dim, dtype)
    index, world, ids = both(boxes)
    asked = some_boxes(20, dim, dtype, 9)
    hits = touch(asked, boxes)
    for q in (jostle.overlapping(asked), asked, asked.reshape(20, -1)):
        answers = index.all(q)
        assert len(answers) == 20 and all(np.array_equal(answers[i], np.flatnonzero(hits[i])) for i in range(20))
        assert np.array_equal(world.all(q).ids, ids[answers.ids])
    assert np.array_equal(index.count(asked), hits.sum(1)) and np.array_equal(index.any(asked), hits.any(1))
    assert np.array_equal(world.count(asked), hits.sum(1)) and np.array_equal(world.any(asked), hits.any(1))
    cut = index.all(asked, max_results=1)
    assert np.array_equal(np.diff(cut.first), np.minimum(hits.sum(1), 1)) and np.array_equal(cut.more, hits.sum(1) > 1)
    assert np.array_equal(answers.query_of(), np.nonzero(hits)[0])

    points = asked[:, 0].astype(np.float64)
    gaps = np.maximum(0, np.maximum(boxes[None, :, 0] - points[:, None], points[:, None] - boxes[None, :, 1]))
    squares = (gaps ** 2).sum(-1)
    near = index.all(jostle.nearest(points, 5))
    assert np.allclose(near.at.reshape(20, 5), np.sort(squares, axis=1)[:, :5], rtol=1e-5, atol=1e-9)
    assert np.array_equal(world.all(jostle.nearest(points, 5)).ids, ids[near.ids])
    inside = index.count(jostle.spheres(points, 0.2))
    assert np.array_equal(inside, (squares <= 0.04).sum(1)) or dtype == np.float32

    rays = jostle.rays(points - 1, np.ones(dim))
    first, every = index.first(rays), index.all(rays)
    none = np.diff(every.first) == 0
    assert np.array_equal(first.ids == -1, none)
    assert np.array_equal(first.ids[~none], every.ids[every.first[:-1][~none].astype(int)])
    assert np.array_equal(world.first(rays).ids, np.where(none, 0, ids[np.maximum(first.ids, 0)]))
    assert np.array_equal(index.count(rays), np.diff(every.first))
    moving = index.all(jostle.sweeps(asked, np.eye(dim)[:1], 0.5))
    assert all(set(answers[i]) <= set(moving[i]) for i in range(20))
    plane = np.zeros((1, dim + 1))
    plane[0, 0], plane[0, -1] = 1, -0.5  # x >= 0.5
    assert index.count(jostle.frustums([plane, np.empty((0, dim + 1))])).tolist() == [(boxes[:, 1, 0] >= dtype(0.5)).sum(), 500]


def test_query_filters():
    boxes = np.zeros((10, 2, 2))
    boxes[:, 1] = 1
    index, world, ids = both(boxes)
    everywhere = boxes[:1]
    assert index.count(everywhere, exclude=3)[0] == 9 and world.count(everywhere, exclude=int(ids[3]))[0] == 9
    category = np.arange(10, dtype=np.uint32)
    assert index.count(everywhere, category=category, mask=np.full(10, 1), asker=(1, 4))[0] == sum(i & 4 != 0 for i in range(10))
    assert index.count(everywhere, owner=np.arange(10) % 3, asker=(1, 1, 2))[0] == 7
    assert index.count(everywhere, accept=lambda query, id: id % 2 == 0)[0] == 5
    world.set_filter(ids[:4], category=8)
    world.update()
    assert world.count(everywhere, asker=(1, 8))[0] == 4
    # An id to exclude for each query: the asker itself.
    answers = index.all(boxes, exclude=np.arange(10))
    assert [sorted(answers[i]) for i in range(10)] == [[k for k in range(10) if k != i] for i in range(10)]
    assert world.all(boxes, exclude=ids)[3].tolist() == [id for id in ids if id != ids[3]]
    # -1 is what no object has, and what a query has that found none.
    assert index.count(everywhere, exclude=-1)[0] == 10 and world.count(everywhere, exclude=-1)[0] == 10
    assert index.count(boxes[:3], exclude=[-1, 2, -1]).tolist() == [10, 9, 10]
    assert world.count(boxes[:2], exclude=np.array([-1, int(ids[3])])).tolist() == [10, 9]
    assert index.count(boxes[:2], exclude=index.first(jostle.rays([[9, 9], [0.5, 0.5]], [1, 0])).ids).tolist() == [10, 9]
    assert "exclude" in jostle.BoxIndex.__doc__ and "exclude" in jostle.World.__doc__
    many = np.repeat(boxes, 500, axis=0)  # more than are asked at once
    assert (index.count(many, exclude=np.repeat(np.arange(10), 500), accept=lambda query, id: id == query // 500) == 0).all()
    with pytest.raises(jostle.Error, match="10 queries and 3 ids to exclude"):
        index.count(boxes, exclude=[1, 2, 3])
    with pytest.raises(jostle.Error, match="single id"):
        world.join(boxes, exclude=ids)
    with pytest.raises(ZeroDivisionError):
        index.any(everywhere, accept=lambda query, id: 1 / 0)
    with pytest.raises(KeyError):
        world.all(everywhere, accept=lambda query, id: {}[id])
    with pytest.raises(KeyError):
        world.join(everywhere, accept=lambda query, id: {}[id])


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_index_changes(dim, dtype):
    boxes, other = some_boxes(100, dim, dtype), some_boxes(100, dim, dtype, 2)
    index = jostle.BoxIndex(dim=dim, dtype=dtype)
    index.insert(np.arange(100) * 2, boxes)
    assert len(index) == 100 and 4 in index and 5 not in index
    assert np.array_equal(index.boxes([4, 8]), boxes[[2, 4]])
    index.move(np.arange(100) * 2, other)
    assert np.array_equal(index.boxes(np.arange(100) * 2), other)
    index.erase([0, 2])
    assert np.array_equal(index.contains([0, 2, 4]), [False, False, True])
    assert np.array_equal(index.join(boxes), [(a, 2 * b) for a, b in by_definition(boxes, other) if b > 1])
    assert index.stats()["objects"] == 98 and "98" in repr(index) and "98" in index._repr_html_()
    index.build(boxes)
    index.build(boxes, np.arange(100)[::-1])
    assert np.array_equal(index.boxes([99]), boxes[:1])
    for call, words in ((lambda: index.insert([5], boxes[:1]), "5"), (lambda: index.erase([200]), "200"),
                        (lambda: index.boxes([1, 200]), "200"), (lambda: index.insert([1, 2], boxes[:1]), "2")):
        with pytest.raises(ValueError, match=words):
            call()
    index.clear()
    index.release_memory()
    assert len(index) == 0


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_a_world_lives(dim, dtype):
    boxes, other = some_boxes(200, dim, dtype), some_boxes(200, dim, dtype, 2)
    world = jostle.World(dim, dtype)
    ids = world.add(boxes)
    assert len(world) == 0 and len(set(ids.tolist())) == 200
    world.update()
    assert len(world) == 200 and int(ids[3]) in world and world.index_end() == 200
    index = world.index(ids)
    assert np.array_equal(world.ids(index), ids) and np.array_equal(world.ids(), np.sort(ids))
    assert np.array_equal(world.boxes(ids), boxes)
    before, after = by_definition(boxes), by_definition(other)
    assert np.array_equal(world.pairs(), before) and np.array_equal(world.index(world.began().ravel()).reshape(-1, 2), before)
    assert np.array_equal(world.changed_pairs(), before)
    world.update(ids, other)
    old, new = set(map(tuple, before)), set(map(tuple, after))
    as_set = lambda pairs: set(map(tuple, world.index(pairs.ravel()).reshape(-1, 2)))
    assert as_set(world.began()) == new - old and as_set(world.ended().pairs) == old - new
    assert set(map(tuple, world.persisted())) == new & old and set(world.ended().reasons) == {0}
    assert np.array_equal(world.join(boxes), by_definition(boxes, other))

    world.move(ids, boxes)
    world.set_enabled(ids[:2], False)
    world.set_margin(ids[2:4], 0.5)
    world.resize(ids[5], [0.25] * dim)
    world.remove(ids[6:8])
    world.update()
    assert np.array_equal(world.enabled(ids[:3]), [False, False, True]) and np.array_equal(world.margins(ids[2:4]), [0.5, 0.5])
    assert np.allclose(np.diff(world.boxes(ids[5]), axis=1), 0.25, atol=1e-5)
    assert np.allclose(world.bounds(ids[2]) - world.boxes(ids[2]), np.array([[-0.5], [0.5]]), atol=1e-6)
    assert np.array_equal(world.contains(ids[5:8]), [True, False, False])
    assert {1, 2} <= set(world.ended().reasons)
    world.set_filter(ids[:2], category=[1, 2], mask=7, owner=9, is_static=True)
    world.move(ids[9], other[9])
    world.move(ids[10:12], other[10:12], np.full((2, dim), 1.0, dtype))
    world.update()
    assert world.filters(ids[:2]).tolist() == [[1, 7, 9, 1], [2, 7, 9, 1]]
    assert (world.bounds(ids[10]) - world.boxes(ids[10]))[0, 1, 0] > 0.9
    asleep = world.add(boxes[:2], margin=0.5, enabled=False)
    world.update()
    assert not world.enabled(asleep).any() and world.margins(asleep).tolist() == [0.5, 0.5]
    world.remove(asleep)
    world.update()
    assert world.stats()["objects"] == 198 and "198" in repr(world) and "198" in world._repr_html_() and world.explain()


@pytest.mark.parametrize("dim", (2, 3))
def test_objects_are_added_each_with_its_own_settings(dim):
    boxes = some_boxes(60, dim, np.float32)
    rng = np.random.default_rng(8)
    settings = dict(category=1 << rng.integers(0, 3, 60), mask=rng.integers(1, 8, 60), owner=rng.integers(0, 20, 60),
                    is_static=rng.random(60) < 0.2, margin=rng.random(60) * 4, enabled=rng.random(60) < 0.9)
    at_once, one_by_one, later = (jostle.World(dim, np.float32) for _ in range(3))
    ids = at_once.add(boxes, **settings)
    assert ids.shape == (60,)
    each = [one_by_one.add(box, **{name: value[i] for name, value in settings.items()}) for i, box in enumerate(boxes)]
    assert np.array_equal(np.concatenate(each), ids)
    assert np.array_equal(later.add(boxes), ids)
    later.set_filter(ids, *(settings[name] for name in ("category", "mask", "owner", "is_static")))
    later.set_margin(ids, settings["margin"])
    later.set_enabled(ids, settings["enabled"])
    for world in (at_once, one_by_one, later):
        world.update()
        assert np.array_equal(world.filters(ids), np.transpose(list(settings.values())[:4]))
        assert np.array_equal(world.enabled(ids), settings["enabled"])
        assert np.allclose(world.margins(ids), settings["margin"])
        assert len(world.began()) > 20 and np.array_equal(world.began(), at_once.began())
    # One for all and one for each, and a single box.
    some = at_once.add(boxes[:3], category=[1, 2, 4], mask=7)
    single = at_once.add(boxes[0], category=[2], owner=5)
    at_once.update()
    assert at_once.filters(some).tolist() == [[1, 7, 2**32 - 1, 0], [2, 7, 2**32 - 1, 0], [4, 7, 2**32 - 1, 0]]
    assert at_once.filters(single).tolist() == [[2, 2**32 - 1, 5, 0]] and len(single) == 1
    assert at_once.add(boxes[:0], category=[]).shape == (0,)


def test_a_world_is_pickled_forked_and_restored():
    boxes = some_boxes(100, 3, np.float32)
    _, world, ids = both(boxes)
    for other in (pickle.loads(pickle.dumps(world)), world.fork(), copy.copy(world)):
        assert np.array_equal(other.pairs(), world.pairs()) and np.array_equal(other.boxes(ids), boxes)
        other.remove(ids)
        other.update()
        assert len(other) == 0 and len(world) == 100
    saved = world.save()
    world.remove(ids)
    world.update()
    world.restore(saved)
    assert len(world) == 100
    for bad in (saved[:-1], b"", saved[:50] + bytes([saved[50] ^ 1]) + saved[51:]):
        with pytest.raises(jostle.Error) as raised:
            world.restore(bad)
        assert raised.value.status == "bad_snapshot" and len(world) == 100
    with pytest.raises(jostle.Error, match="accept"):
        pickle.dumps(jostle.World(accept=lambda a, b: True))


def test_a_world_goes_back_by_what_changed():
    boxes = some_boxes(1000, 3, np.float32)
    _, world, ids = both(boxes)
    world.update()  # in which all of them come to rest
    base = world.save_base()
    world.remove(ids[:3])
    world.update()
    changes, whole = world.save_changes(), world.save()
    assert len(changes) < len(whole) and base != whole
    world.remove(ids[3:9])
    world.update()
    world.restore_changes(changes)
    assert len(world) == 997 and world.save() == whole and world.save_changes() == changes
    other = jostle.World(dim=3, dtype=np.float32)
    with pytest.raises(jostle.Error, match="no base"):
        other.restore_changes(changes)
    other.restore(base)
    assert other.save_base() == base
    other.restore_changes(changes)
    assert other.save() == whole
    for bad in (changes[:-1], b"", changes[:50] + bytes([changes[50] ^ 1]) + changes[51:], whole):
        with pytest.raises(jostle.Error) as raised:
            world.restore_changes(bad)
        assert raised.value.status == "bad_snapshot" and world.save() == whole


def test_a_view_follows_a_world():
    boxes = some_boxes(1000, 3, np.float32)
    _, world, ids = both(boxes)
    view = jostle.World(dim=3, dtype=np.float32, threads=1)
    view.follow(world)
    before = view.pairs()
    assert len(view) == 1000 and (before == world.pairs()).all() and (view.boxes(ids) == boxes).all()
    world.remove(ids[:500])
    world.update()
    assert len(view) == 1000 and (view.pairs() == before).all()
    view.follow(world)
    assert len(view) == 500 and (view.pairs() == world.pairs()).all()
    for refused in (view.update, view.save, lambda: view.remove(ids[500:])):
        with pytest.raises(jostle.Error, match="is a view"):
            refused()
    with pytest.raises(jostle.Error, match="different spaces"):
        jostle.World(dim=2, dtype=np.float32).follow(world)
    with pytest.raises(jostle.Error, match="itself"):
        world.follow(world)
    view.clear()
    view.add(boxes[:3])
    view.update()
    assert len(view) == 3


def test_a_world_tells_again_and_is_cleared():
    boxes = some_boxes(200, 2, np.float64)
    _, world, ids = both(boxes)
    pairs = by_definition(boxes)
    touched = world.touching(ids)
    for i in range(200):
        expected = np.sort(np.concatenate([pairs[pairs[:, 0] == i, 1], pairs[pairs[:, 1] == i, 0]]))
        assert np.array_equal(world.index(touched[i]), expected)
    assert np.array_equal(world.bounds_of_all(), [boxes[:, 0].min(0), boxes[:, 1].max(0)])
    world.update()
    assert len(world.began()) == 0
    world.report_again(ids)
    world.update()
    assert len(world.began()) == len(pairs)
    world.report_again(world.began()[:3])
    world.update()
    assert len(world.began()) == 3
    world.clear()
    assert len(world) == 0 and world.bounds_of_all() is None and len(world.began()) == 0


def test_a_world_shows_what_is_queued():
    boxes = some_boxes(200, 2, np.float64)
    _, world, ids = both(boxes)
    world.update()
    world.remove(ids[:100])
    world.apply()
    assert len(world) == 100 and len(world.ended().pairs) == 0
    assert np.array_equal(world.pairs(), by_definition(boxes[100:]) + 100)
    world.update()
    pairs = by_definition(boxes)
    assert len(world.ended().pairs) == (pairs[:, 0] < 100).sum()


def test_a_world_keeps_what_belongs_to_objects_and_pairs():
    boxes = some_boxes(200, 2, np.float64)
    world, slots = jostle.World(2), jostle.PairSlots()
    ids = world.add(boxes)
    world.set_user_data(ids, np.arange(200) + 2**40)
    world.update()
    slots.update(world.began(), world.ended())
    pairs = len(world.began())
    assert pairs > 10 and slots.began_slots().tolist() == list(range(pairs)) and slots.end() == pairs
    assert repr(slots) == f"PairSlots(below {pairs})"
    for other in (world.fork(), pickle.loads(pickle.dumps(world))):
        assert np.array_equal(other.user_data(ids), np.arange(200) + 2**40)
    world.remove(ids[:100])
    world.update()
    ended = world.ended().pairs
    slots.update(world.began(), world.ended())
    assert len(slots.ended_slots()) == len(ended) > 0
    assert np.array_equal(world.user_data(ended[:, 0]), world.index(ended[:, 0]) + np.uint64(2**40))
    assert len(jostle.PairSlots().began_slots()) == 0


def test_a_world_with_layers_says_the_same():
    boxes = some_boxes(300, 3, np.float32)
    worlds = [jostle.World(3, np.float32), jostle.World(3, np.float32, layers=[(2**32 - 1, 2), (4, 1)])]
    worlds.append(pickle.loads(pickle.dumps(worlds[1])))
    for world in worlds:
        ids = world.add(boxes, category=1 << np.arange(300) % 3)
        world.update()
        world.move(ids[::7], boxes[::7] + np.float32(0.1))
        world.update()
    for asker in ((2**32 - 1, 2), (4, 1), (2, 4)):
        counted = [world.count(boxes, asker=asker) for world in worlds]
        assert np.array_equal(counted[0], counted[1]) and np.array_equal(counted[0], counted[2]) and counted[0].any()
    for layers, message in (([(1, 1)] * 9, "9 layers"), ([(2**32 - 1, 2**32 - 1)], "layer 0"), ([(2**32, 1)], "category is")):
        with pytest.raises(jostle.Error, match=message):
            jostle.World(3, layers=layers)


def test_a_world_asks():
    boxes = np.zeros((3, 2, 2))
    boxes[:, 1] = 1
    asked = []

    def accept(a, b):
        asked.append((a, b))
        if len(asked) > 3:
            raise LookupError("enough")
        return len(asked) != 2

    world = jostle.World(2, accept=accept, margin=0.5)
    ids = world.add(boxes)
    world.update()
    assert asked == [(ids[0], ids[1]), (ids[0], ids[2]), (ids[1], ids[2])] and len(world.began()) == 2
    fork = world.fork()
    world.add(boxes)
    with pytest.raises(LookupError, match="enough"):
        world.update()
    assert len(world) == 3  # as it was
    del world
    fork.add(boxes)
    with pytest.raises(LookupError):  # asks the same, although the first world is gone
        fork.update()


def test_commands_come_from_several_threads():
    world = jostle.World(2)
    ids = world.add(some_boxes(1000, 2, np.float64))
    world.update()
    moved = some_boxes(1000, 2, np.float64, 3)

    def move(k):
        for i in range(k, 1000, 4):
            world.move(ids[i], moved[i])

    threads = [threading.Thread(target=move, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    world.update()
    assert np.array_equal(world.boxes(ids), moved)


def test_mistakes_name_the_object():
    boxes = some_boxes(5, 3, np.float64)
    _, world, ids = both(boxes)
    with pytest.raises(IndexError) as raised:  # an id is an index, too
        world.boxes([int(ids[0]), 12345])
    assert isinstance(raised.value, ValueError) and raised.value.index == 1 and raised.value.status == "stale_id"
    assert isinstance(pickle.loads(pickle.dumps(raised.value)), jostle.StaleIdError)
    for call, words in ((lambda: world.add(boxes[:, :, :2]), "2D"), (lambda: world.move(ids, boxes[:3]), "5 elements"),
                        (lambda: world.add(boxes.astype(np.float32)[:, :, :1]), "shape"),
                        (lambda: world.set_margin(ids, [-1, 0, 0, 0, 0]), "-1"),
                        (lambda: jostle.World(4), "4D"), (lambda: jostle.World(2, np.int32), "int32"),
                        (lambda: jostle.World(3, np.float32).add(boxes), "rounded"),
                        (lambda: world.resize(ids, boxes[:, 0, :2]), "shape"),
                        (lambda: world.all(jostle.rays([[0, 0, 0]], [0, 0, 0])), "direction"),
                        (lambda: world.all(jostle.rays([[0, 0]], [1, 0, 0])), "shape"),
                        (lambda: world.first(boxes), "overlapping: this call takes rays, sweeps"),
                        (lambda: world.count(jostle.nearest([[0, 0, 0]])), "nearest: this call takes rays"),
                        (lambda: jostle.BoxIndex(boxes).any(jostle.nearest_to_boxes(boxes)), "nearest_to_boxes: this call"),
                        (lambda: jostle.nearest([[0, 0, 0]], -1), "count is -1"), (lambda: jostle.World(threads=-1), "threads is -1"),
                        (lambda: jostle.BoxIndex(boxes, threads=2**32), "threads is 4294967296"),
                        (lambda: world.all(jostle.rays(np.zeros((2, 3)), np.ones((3, 3)))), "2 and 3")):
        with pytest.raises(jostle.Error, match=words):
            call()
    with pytest.raises(IndexError):
        world.all(boxes)[5]
    assert len(world.pairs()) == len(by_definition(boxes))


def square_distances(a, b):
    """Of all boxes of a and all of b, in their own numbers."""
    gaps = np.maximum(0, np.maximum(b[None, :, 0] - a[:, None, 1], a[:, None, 0] - b[None, :, 1]))
    sums = np.zeros(gaps.shape[:2], a.dtype)
    for d in range(a.shape[2]):
        sums += gaps[:, :, d] * gaps[:, :, d]
    return sums.astype(np.float64)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_nearest_to_boxes(dim, dtype):
    boxes, asked = some_boxes(300, dim, dtype), some_boxes(20, dim, dtype, 9)
    index, world, ids = both(boxes)
    squares = square_distances(asked, boxes)
    near = index.all(jostle.nearest_to_boxes(asked, 5, 0.4))
    for i in range(20):
        order = np.lexsort((np.arange(300), squares[i]))[:5]
        order = order[squares[i][order] <= dtype(0.4) * dtype(0.4)]
        assert np.array_equal(near[i], order)
        assert np.array_equal(near.at[int(near.first[i]):int(near.first[i + 1])], squares[i][order])
    assert np.array_equal(world.all(jostle.nearest_to_boxes(asked, 5, 0.4)).ids, ids[near.ids])
    with pytest.raises(jostle.Error, match="nearest 1"):
        index.all(jostle.nearest_to_boxes(np.stack([boxes[0], boxes[0, ::-1] + np.array([[1], [0]], dtype)])))


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_visits(dim, dtype):
    boxes = some_boxes(400, dim, dtype)
    index, world, ids = both(boxes)
    middle = np.full((1, dim), 0.5)
    for q in (jostle.rays(middle - 1, np.ones(dim)), jostle.sweeps(boxes[:1], np.ones(dim), 9), jostle.nearest(middle, 50),
              jostle.nearest_to_boxes(boxes[5], 50)):
        every = index.all(q)
        assert len(every.ids) > 4
        for chunk in (1, 7, 1000):
            got, at, sizes = [], [], []

            def take(ids, where):
                assert ids.dtype == np.uint64 and ids.shape == where.shape
                got.extend(ids), at.extend(where), sizes.append(len(ids))

            assert index.visit(q, take, chunk=chunk) is True
            assert np.array_equal(got, every.ids) and np.array_equal(at, every.at)
            assert set(sizes[:-1]) <= {chunk} and 0 < sizes[-1] <= chunk
            got.clear(), at.clear()
            assert world.visit(q, take, chunk=chunk) and np.array_equal(got, ids[every.ids])
        # Stopped, and with a bound that gets lower.
        seen = []
        assert index.visit(q, lambda ids, at: bool(seen.append(ids[0]) or len(seen) < 3), chunk=1) is False
        assert np.array_equal(seen, every.ids[:3])
        assert index.visit(q, lambda ids, at: np.bool_(False), chunk=10**6) is False
        seen.clear()
        bound = every.at[3]
        assert index.visit(q, lambda ids, at: seen.extend(ids) or np.float64(bound), chunk=1) is True
        assert np.array_equal(seen, every.ids[every.at <= bound])
        seen.clear()
        assert index.visit(q, lambda ids, at: seen.extend(ids), exclude=int(every.ids[0])) and every.ids[0] not in seen
    region = boxes[7:8]
    seen = []
    assert index.visit(region, lambda ids, at: seen.extend(ids) or (at == 0).all(), chunk=3)
    assert np.array_equal(np.sort(seen), index.all(region).ids)
    everywhere = jostle.spheres(middle, 100)
    for on in (index, world):
        for call, error in ((lambda: on.visit(region, lambda ids, at: 0.5), "order"),
                            (lambda: on.visit(everywhere, lambda ids, at: 0.5, chunk=9), "order"),
                            (lambda: on.visit(jostle.nearest(middle, 9), lambda ids, at: float("nan")), "NaN"),
                            (lambda: on.visit(jostle.nearest(middle, 9), lambda ids, at: float("nan"), chunk=2), "NaN"),
                            (lambda: on.visit(boxes[:2], lambda ids, at: None), "2 queries"),
                            (lambda: on.visit(boxes[:0], lambda ids, at: None), "0 queries"),
                            (lambda: on.visit(region, lambda ids, at: None, chunk=0), "chunk"),
                            (lambda: on.visit_closest_pairs(lambda pairs, at: float("nan")), "NaN"),
                            (lambda: on.visit_pairs(lambda pairs, at: 1.5), "order"),
                            (lambda: on.closest_pairs(0), "count"),
                            (lambda: on.closest_pairs(max_distance=float("nan")), "max_distance|distance")):
            with pytest.raises(jostle.Error, match=error):
                call()
        for chunk in (1, 10**6):  # raised along the way, and for what is left at the end
            with pytest.raises(ZeroDivisionError):
                on.visit(everywhere, lambda ids, at: 1 / 0, chunk=chunk)
            with pytest.raises(ZeroDivisionError):
                on.visit_closest_pairs(lambda pairs, at: 1 / 0, chunk=chunk)
            with pytest.raises(ValueError, match="more"):
                on.visit_pairs(lambda pairs, at: "more", chunk=chunk)
            with pytest.raises(TypeError):
                on.visit(everywhere, "no function", chunk=chunk)


@pytest.mark.parametrize("dim,dtype", KINDS)
def test_pairs_and_closest_pairs(dim, dtype):
    boxes, others = some_boxes(150, dim, dtype), some_boxes(100, dim, dtype, 5)
    others = np.concatenate([others, others + dtype(3)])
    index, world, ids = both(boxes)
    other_index, other_world, other_ids = both(others)
    ascending = lambda pairs: pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    assert index.pairs().dtype == np.uint32 and np.array_equal(ascending(index.pairs()), by_definition(boxes))
    assert np.array_equal(ascending(index.pairs(other_index)), by_definition(boxes, others))
    parts = []
    assert world.visit_pairs(lambda pairs, at: parts.append(pairs), chunk=10)
    assert {len(part) for part in parts[:-1]} <= {10} and np.array_equal(world.index(np.concatenate(parts)), world.pairs())
    assert np.array_equal(np.concatenate(parts), ids[world.pairs()])
    assert not world.visit_pairs(lambda pairs, at: False) and not index.visit_pairs(lambda pairs, at: False)
    assert jostle.BoxIndex(dim=dim, dtype=dtype).pairs().shape == (0, 2)
    assert jostle.BoxIndex(boxes[:1]).closest_pairs().pairs.shape == (0, 2)

    for index_b, world_b, ids_b, of in ((None, None, ids, boxes), (other_index, other_world, other_ids, others)):
        squares = square_distances(boxes, of)
        a, b = np.nonzero(np.ones_like(squares))
        if index_b is None:
            a, b = a[a < b], b[a < b]
        at = squares[a, b]
        order = np.lexsort((b, a, at))
        expected, at = np.stack([a, b], 1)[order], at[order]
        touching = int((at == 0).sum())
        found = index.closest_pairs(touching + 50, index_b)
        assert isinstance(found, jostle.ClosePairs) and found.pairs.dtype == np.uint32
        assert np.array_equal(ascending(found.pairs[:touching]), ascending(expected[:touching]))
        assert np.array_equal(found.pairs[touching:], expected[touching:touching + 50])
        assert np.array_equal(found.at, at[:touching + 50])
        in_worlds = world.closest_pairs(touching + 50, world_b)
        assert np.array_equal(in_worlds.at, found.at) and in_worlds.pairs.dtype == np.uint64
        assert np.array_equal(in_worlds.pairs[touching:], np.stack([ids[found.pairs[touching:, 0]],
                                                                    ids_b[found.pairs[touching:, 1]]], 1))
        # All within a distance, and a bound that a visitor lowers.
        limit = float(np.sqrt(at[touching + 20]))
        within = index.closest_pairs(10**9, index_b, max_distance=limit)
        assert len(within.pairs) == (at <= np.float64(dtype(limit) * dtype(limit))).sum()
        seen = []
        bound = at[touching + 5]
        assert index.visit_closest_pairs(lambda pairs, at: seen.extend(at) or bound, index_b, chunk=1)
        assert np.array_equal(seen, at[at <= bound])
        assert not index.visit_closest_pairs(lambda pairs, at: False, index_b)
    world.set_filter(ids, mask=0)
    world.update()
    assert len(world.closest_pairs().at) == 0 and len(world.closest_pairs(1, other_world).at) == 1
    with pytest.raises(jostle.Error):
        index.closest_pairs(1, jostle.BoxIndex(dim=5 - dim, dtype=dtype))


def test_slots_of_pairs():
    boxes = some_boxes(200, 3, np.float64)
    world, slots, other = jostle.World(), jostle.PairSlots(), jostle.PairSlots()
    ids = world.add(boxes)
    world.update()
    began, none = world.began(), world.ended()
    slots.update(began, none)
    pairs = world.changed_pairs()
    assert len(pairs) > 3 and slots.slots_of(pairs).tolist() == slots.began_slots().tolist() == list(range(len(pairs)))
    apart = set(zip(*np.nonzero(~touch(boxes, boxes)))) - {(i, i) for i in range(200)}
    assert slots.slots_of([min(apart)]).tolist() == [2**32 - 1] and len(slots.slots_of([])) == 0
    other.restore(slots.save())
    world.move(ids[:100], boxes[:100] + 9)
    world.update()
    for each in (slots, other):
        each.update(world.began(), world.ended())
        assert len(each.ended_slots()) == len(world.ended().pairs) > 0 and each.end() > max(each.ended_slots())
    assert slots.save() == other.save() and np.array_equal(slots.began_slots(), other.began_slots())
    with pytest.raises(jostle.Error, match="never began"):
        slots.update([], world.ended())
    for pairs in ([1, 2, 3], [[1, 2, 3]]):
        with pytest.raises(jostle.Error, match="shape"):
            slots.slots_of(pairs)
        with pytest.raises(jostle.Error, match="began has the shape"):
            slots.update(pairs, none)
    with pytest.raises(jostle.Error, match="whole snapshot"):
        slots.restore(world.save())
    assert slots.save() == other.save()


def test_queries_asked_in_parts():
    boxes = some_boxes(60, 2, np.float64)
    index, world, ids = both(boxes)
    many = np.concatenate([some_boxes(10_000, 2, np.float64, seed) for seed in (1, 2, 3)])
    hits = touch(many, boxes)
    for on, names in ((index, np.arange(60)), (world, ids)):
        assert np.array_equal(on.count(many), hits.sum(1)) and np.array_equal(on.any(many), hits.any(1))
        answers = on.all(many, max_results=2)
        assert len(answers) == 30_000 and np.array_equal(answers.more, hits.sum(1) > 2)
        assert all(np.array_equal(answers[i], names[np.flatnonzero(hits[i])[:2]]) for i in range(0, 30_000, 331))
        lines = on.first(jostle.rays(many[:, 0], many[:, 1] - many[:, 0]))
        assert np.array_equal(lines.ids[20_000:], on.first(jostle.rays(many[20_000:, 0], (many[:, 1] - many[:, 0])[20_000:])).ids)
        near = on.all(jostle.nearest(many[:, 0], 2))
        assert near.at.shape == (60_000,) and np.array_equal(near[29_000], on.all(jostle.nearest(many[29_000:29_001, 0], 2))[0])
        told = set()
        on.any(many, accept=lambda query, id: told.add((query, id)))
        assert told == {(q, names[i]) for q, i in zip(*np.nonzero(hits))}  # queries count from the first of all
    many[25_000] = many[25_000, ::-1] + 1
    many[25_000, 1] -= 5
    for call in (index.any, index.count, index.all):
        with pytest.raises(jostle.Error, match="25000") as raised:
            call(many)
        assert raised.value.index == 25_000


def test_an_index_in_use_refuses_changes():
    boxes = some_boxes(20_000, 3, np.float64)
    index = jostle.BoxIndex(boxes)
    few = some_boxes(10, 3, np.float64)
    changes = (lambda: index.build(few), index.clear, index.release_memory, lambda: index.erase([0]), lambda: index.move([0], few[:1]),
               lambda: index.insert([30_000], few[:1]))
    refused = []

    def change(*_):
        for one in changes:
            with pytest.raises(jostle.Error, match="the index is in use"):
                one()
            refused.append(one)
        assert index.count(few).sum() > 0 and len(index.join(few)) > 0 and len(index) == 20_000  # asking goes on
        return False

    everything = [[0, 0, 0, 2, 2, 2]]
    index.visit(everything, change)
    index.any(everything, accept=change)
    index.visit_pairs(change)
    index.visit_closest_pairs(change, jostle.BoxIndex(few))
    jostle.BoxIndex(few).visit_closest_pairs(change, index)
    assert len(refused) == (4 + 20_000) * len(changes)
    for one in reversed(changes[2:5]):  # no longer in use
        one()
    assert len(index) == 19_999 and index.count(everything)[0] == 19_999


def elsewhere(function):
    """What the function returns or raises on another thread."""
    said = []

    def run():
        try:
            said.append(function())
        except jostle.Error as error:
            said.append(error)
    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    return said[0]


def reads_of(world, ids):
    everything = jostle.overlapping([[[0, 0, 0], [9, 9, 9]]])
    return (world.began, world.ended, world.persisted, world.changed_pairs, world.pairs, world.stats, world.explain, world.save, world.fork, lambda: world.boxes(ids), lambda: world.bounds(ids),
            lambda: world.filters(ids), lambda: world.touching(ids), lambda: len(world), lambda: world.contains(ids),
            lambda: world.all(everything), lambda: world.count(everything), lambda: world.any(everything),
            lambda: world.closest_pairs(2), lambda: jostle.World().closest_pairs(2, world), lambda: world.visit_pairs(lambda *_: False),
            lambda: world.visit(everything, lambda *_: False))


def test_a_world_that_is_updated_is_read_by_nobody_but_its_accept():
    asked, boxes = [], np.array([[[0, 0, 0], [1, 1, 1]]] * 2, float)

    def accept(*_):
        for read in reads_of(world, ids[:1]):
            assert not isinstance(read(), jostle.Error)
            assert "the world is in use" in str(elsewhere(read))
        for change in (world.update, world.apply, world.clear, lambda: world.restore(saved), lambda: world.update(ids, boxes)):
            assert "the world is in use" in str(elsewhere(change))
            with pytest.raises(jostle.Error, match="the world is in use"):
                change()
        assert "the world is in use" in str(elsewhere(lambda: jostle.World().follow(world)))
        elsewhere(lambda: world.move(ids[1], boxes[1] + 0.5))
        assert len(elsewhere(lambda: world.add(boxes + 50))) == 2
        elsewhere(lambda: world.set_user_data(ids[0], 7))
        assert elsewhere(lambda: world.user_data(ids[:1]))[0] == 7
        inner = jostle.World(accept=lambda *_: True)  # may be updated meanwhile, which is its own affair
        inner.add(boxes)
        inner.update()
        assert len(inner.began()) == 1 and "the world is in use" in str(elsewhere(world.pairs)) and len(world) == 2
        asked.append(1)
        return True
    world = jostle.World(accept=accept)
    saved = world.save()
    ids = world.add(boxes + 90)
    world.update(ids, boxes + [[[0]], [[20]]])  # apart, so that nothing is asked
    world.update(ids, boxes)
    assert asked == [1] and len(elsewhere(world.began)) == 1
    world.move(ids[1], boxes[1] + 20)
    world.update()
    assert len(world) == 4


def test_a_world_that_is_read_is_updated_by_nobody():
    boxes = some_boxes(200, 3, np.float64)
    world = jostle.World()
    ids = world.add(boxes)
    world.update()
    saved, seen = world.save(), []

    def change(*_):
        for one in (world.update, world.apply, world.clear, lambda: world.restore(saved), lambda: world.update(ids, boxes),
                    lambda: world.follow(jostle.World())):
            with pytest.raises(jostle.Error, match="the world is in use"):
                one()
            assert "the world is in use" in str(elsewhere(one))
        assert len(world.pairs()) == len(elsewhere(world.pairs)) > 0  # reading goes on
        world.move(ids[0], boxes[0])
        seen.append(1)
        return False
    world.visit_pairs(change)
    world.visit(jostle.overlapping(boxes[:1]), change)
    world.visit_closest_pairs(change)
    jostle.World().follow(world)
    assert len(seen) == 3
    world.update()
    with pytest.raises(jostle.Error, match="itself"):
        world.follow(world)


def test_shapes_in_use_refuse_changes():
    hull = jostle.hull(np.random.default_rng(1).normal(size=(30, 3)))
    shapes = jostle.Shapes.same(hull, 2000)
    poses = jostle.poses(np.random.default_rng(2).random((2000, 3)))
    pairs = np.stack(np.triu_indices(2000, 1), -1)[:200_000]
    expected = jostle.touching(shapes, poses, pairs)
    done, refused = threading.Event(), []

    def change():
        while not done.is_set():
            try:
                shapes.append(hull)
                shapes[0] = hull
                shapes.clear()
                shapes.append(hull, 2000)
            except jostle.Error as error:
                refused.append(str(error))
    thread = threading.Thread(target=change)
    thread.start()
    for _ in range(5):
        try:
            jostle.touching(shapes, poses, pairs)
        except jostle.Error as error:
            refused.append(str(error))
    done.set()
    thread.join()
    shapes.clear()
    shapes.append(hull, 2000)
    assert np.array_equal(jostle.touching(shapes, poses, pairs), expected)
    shapes.extend(shapes)
    assert len(shapes) == 4000


def test_functions_are_asked_on_the_thread_that_called():
    boxes = some_boxes(2000, 3, np.float64, size=0.3)
    caller, asked = threading.get_ident(), []

    def accept(*_):
        asked.append(threading.get_ident())
        return True
    index = jostle.BoxIndex(boxes, threads=4)
    world = jostle.World(3, accept=accept, threads=4)
    ids = world.add(boxes)
    world.update()
    assert len(world.began()) == len(jostle.find_pairs(boxes, accept=accept, threads=4))
    jostle.find_scenes(boxes, [0, 1000, 2000], accept=accept, threads=4)
    assert np.array_equal(index.count(boxes, accept=accept), index.count(boxes))
    other = jostle.World(3, threads=4)
    other.add(boxes)
    other.update()
    named = []

    def some(query, id):
        accept()
        named.append((query, id))
        return query % 3 != 0
    kept = other.join(boxes)
    assert np.array_equal(other.join(boxes, accept=some), kept[kept[:, 0] % 3 != 0])
    assert [query for query, _ in named] == sorted(kept[:, 0].tolist()) and set(asked) == {caller}
    streaming, many = set(), some_boxes(30_000, 3, np.float64, size=0.05)  # enough for several threads
    parts = list(jostle.iter_pairs(many, accept=lambda a, b: streaming.add(threading.get_ident()) or True, threads=4))
    assert sum(map(len, parts)) == len(jostle.find_pairs(many, accept=accept, threads=4))
    assert len(streaming) == 1 and set(asked) == {caller}  # the stream has one of its own


def test_a_world_that_its_function_knows_is_collected():
    import gc
    import weakref
    worlds = []

    def made():
        world = jostle.World(3, accept=lambda a, b: len(world) > 0)
        world.add(some_boxes(10, 3, np.float64))
        world.update()
        fork = world.fork()
        worlds.extend([weakref.ref(world), weakref.ref(fork)])
        return fork
    made()
    fork = made()
    gc.collect()
    assert [one() is None for one in worlds] == [True, True, False, False]  # the fork's function knows the world
    fork.add(some_boxes(3, 3, np.float64))
    fork.update()
    assert len(fork) == 13
    del fork
    gc.collect()
    assert all(one() is None for one in worlds)


def test_arguments_that_mean_something_else_are_refused():
    boxes = some_boxes(4, 3, np.float32)
    index, world, ids = both(boxes)
    mask = np.array([True, False, True, False])
    for wrong, says in (
            (lambda: world.update(boxes=boxes), "boxes came without ids"),
            (lambda: world.update(ids), "ids came without boxes"),
            (lambda: world.set_enabled(ids, 256), "enabled is 256"),
            (lambda: world.set_enabled(ids, 0.5), "enabled is 0.5"),
            (lambda: world.set_enabled(ids, [True, False]), "there are 4 objects"),
            (lambda: world.set_user_data(ids, 1.7), "data has the dtype float64"),
            (lambda: world.set_user_data(ids, -1), "data is -1"),
            (lambda: world.set_user_data(ids, [0, 1, 2, -3]), r"data\[3\] is -3"),
            (lambda: world.set_filter(ids, category=[1, 2]), "there are 4 objects"),
            (lambda: world.set_filter(ids, is_static=2), "is_static is 2"),
            (lambda: world.ids(mask), "as numpy.flatnonzero"),
            (lambda: index.boxes(mask), "as numpy.flatnonzero"),
            (lambda: world.add(boxes, category=-1), "category is -1"),
            (lambda: world.add(boxes, mask=2**32), "mask is 4294967296"),
            (lambda: world.add(boxes, enabled=2), "enabled is 2"),
            (lambda: world.add(boxes, category=[1, 2]), r"category has the shape \(2,\)"),
            (lambda: world.add(boxes, owner=[1, 2, 3, -1]), r"owner\[3\] is -1"),
            (lambda: jostle.find_pairs(boxes[:, 0], boxes[:, 1]), r"numpy.stack\(\[lo, hi\], axis=1\)"),
            (lambda: world.add(boxes, margin=[0, 1, 2]), r"margin has the shape \(3,\)"),
            (lambda: world.add(boxes, margin=[0, 1, -1, 0]), "margin -1 of new object 2"),
            (lambda: world.add(boxes[:1], margin=[np.nan]), "margin"),
            (lambda: world.move(ids, boxes, sequence=-1), "sequence is -1"),
            (lambda: world.report_again(np.stack([ids, ids, ids], axis=1)), r"ids has the shape \(4, 3\)"),
            (lambda: world.report_again(ids[:, None]), r"ids has the shape \(4, 1\)"),
            (lambda: world.follow(index), "other is of the type BoxIndex: it must be a World"),
            (lambda: world.closest_pairs(1, index), "other is of the type BoxIndex: it must be a World"),
            (lambda: index.pairs(world), "other is of the type World: it must be a BoxIndex"),
            (lambda: world.set_margin(ids, 1, sequence=1.5), "sequence is 1.5"),
            (lambda: index.all(boxes, max_results=-1), "max_results is -1"),
            (lambda: index.all(boxes[:, 0]), r"overlapping: boxes has the shape \(4, 3\): among boxes in 3D it must be \(n, 6\)"),
            (lambda: index.first(jostle.rays(boxes[:, 0, :2], [0, 0, 1])), r"rays: origins has the shape \(4, 2\)"),
            (lambda: index.all(jostle.spheres(boxes[:, 0], [1, 2, 3])), "spheres: centers, radii must have as many rows as each other, or one; they have 3 and 4"),
            (lambda: jostle.BoxIndex(boxes[:, 0]), r"points are boxes as numpy.stack"),
            (lambda: index.any(boxes, exclude=-2), "exclude is -2"),
            (lambda: index.any(boxes, exclude=[0, -2, 1, 1]), "exclude"),
            (lambda: index.any(boxes, asker=1), r"asker is 1: it must be \(category, mask\)"),
            (lambda: world.any(boxes, exclude=2**64), "exclude is 18446744073709551616"),
            (lambda: index.any(boxes, asker=(1,)), r"asker is \(1,\)"),
            (lambda: index.any(boxes, asker=(1, -1)), "asker is -1"),
            (lambda: jostle.World(accept=5), "accept is 5"),
            (lambda: jostle.find_pairs(boxes, accept=5), "accept is 5"),
            (lambda: index.count(boxes, accept=5), "accept is 5"),
            (lambda: jostle.World(threads=1025), "threads is 1025"),
            (lambda: jostle.touching(jostle.Shapes.spheres([1.0]), jostle.poses(np.zeros((1, 3))), [[0, 0], [0, -2]]),
             r"pairs\[1, 1\] is -2"),
            (lambda: index.count(boxes.astype(np.float64)), "would have to be rounded")):
        with pytest.raises(jostle.Error, match=says):
            wrong()
    world.update()
    assert len(world) == 4  # nothing was added where something was wrong
    for wrong in (lambda: world.restore(2**33), lambda: copy.copy(index)):
        with pytest.raises(TypeError):
            wrong()
    assert len(world) == 4 and world.enabled(ids).all()
    assert index.count(boxes.astype(np.float64).tolist()).tolist() == index.count(boxes).tolist()  # lists are of no size
    planes = np.array([[1.0, 0, 0, 0]])
    assert index.count(jostle.frustums(planes)).tolist() == [4] and len(index.count(jostle.frustums([]))) == 0

    with pytest.raises(jostle.Error, match="shapes is a list: it must be a Shapes"):
        jostle.contacts([jostle.sphere(1)], jostle.poses(np.zeros((1, 3))), [[0, 0]])
    unaligned = np.zeros(4, [("name", "u1"), ("margin", np.float64)])["margin"]
    for margins in (unaligned, unaligned[::-1].astype(">f8")):
        world.set_margin(ids, margins)
    away = jostle.rays([[9.0, 9, 9], [-1, -1, -1]], [[1.0, 1, 1]])
    for asked in (index, world):
        assert np.isinf(asked.first(away).at[0]) and asked.first(away).at[1] != 0

    shapes = jostle.Shapes.spheres([1.0, 2.0])
    shapes.repeats = True
    other = copy.copy(shapes)
    other.clear()
    assert len(shapes) == 2 and copy.copy(shapes).repeats and len(other) == 0
