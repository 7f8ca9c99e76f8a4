# SPDX-License-Identifier: MIT
"""Random commands and queries with every feature at once, each answer against model.py."""
import copy
import time

import numpy as np
import pytest

import jostle
from model import KINDS, NONE, Asked, Model, Thing, overlap, agree, size, some_boxes


class Stream:
    """A world that has everything, the model of it, and the other worlds that it meets."""

    def __init__(self, seed):
        self.rng = rng = np.random.default_rng(seed)
        self.dim, self.dtype = int(rng.integers(2, 4)), (np.float32, np.float64)[rng.integers(0, 2)]
        self.has_accept, self.mood = bool(rng.random() < 0.7), 0
        margin = float(rng.choice([0, 0.25]))
        self.world = jostle.World(self.dim, self.dtype, margin=margin, accept=self.asked if self.has_accept else None)
        self.model = Model(self.dim, margin, self.accepts if self.has_accept else None)
        # A second one that is asked together with it, and is updated while the first one's accept is asked.
        self.inner = jostle.World(self.dim, self.dtype, accept=self.asked_by_inner)
        self.inner_model = Model(self.dim, 0.0, self.accepts)
        self.nests = 0
        self.view, self.viewed = jostle.World(self.dim, self.dtype, threads=1), None
        self.snapshots, self.base = [], None
        self.most = 70

    # --- accept ---

    def accepts(self, a, b):
        return (int(a) * 5 + int(b) * 3 + self.mood) % 4 != 0

    def asked(self, a, b):
        if self.nests > 0 and self.rng.random() < 0.3:
            self.nests -= 1
            self.change(self.inner, self.inner_model, 5)
            self.inner.update()
            self.inner_model.update()
        self.world.contains([a, b])  # it may be read, also after another one's update
        return self.accepts(a, b)

    def asked_by_inner(self, a, b):
        len(self.inner)
        return self.accepts(a, b)

    # --- Commands, to a world and its model ---

    def boxes(self, n):
        return some_boxes(self.rng, n, self.dim, self.dtype)

    def some(self, model, most=None):
        """Things, in any order."""
        there = list(model.things.values())
        n = min(size(self.rng, most or self.most), len(there))
        return [there[i] for i in self.rng.permutation(len(there))[:n]]

    def columns(self, n):
        rng = self.rng
        out = dict(category=1 << rng.integers(0, 3, n), mask=rng.integers(1, 8, n), owner=rng.choice([0, 1, NONE, NONE], n),
                   is_static=rng.random(n) < 0.2)
        return {name: value[:1].repeat(n) if rng.random() < 0.3 else value for name, value in out.items()}

    def given(self, values):
        """One for each, or one for all, where they are the same."""
        same = len(values) and (values == values[0]).all()
        return values[0] if same and self.rng.random() < 0.9 else values

    def add(self, world, model):
        n = size(self.rng, max(1, self.most - len(model.things)))
        boxes, columns, data = self.boxes(n), self.columns(n), self.rng.integers(0, 2**63, n).astype(np.uint64)
        margins, enabled = self.rng.integers(0, 3, n) / 4, self.rng.random(n) < 0.8
        if self.rng.random() < 0.4:  # the same for all
            margins, enabled = margins[:1].repeat(n), enabled[:1].repeat(n)
            columns = {name: value[:1].repeat(n) for name, value in columns.items()}
        given = {name: self.given(value) for name, value in dict(**columns, margin=margins, enabled=enabled).items()}
        ids = world.add(boxes, **given)
        world.set_user_data(ids, data)
        filters = np.transpose(list(columns.values()))
        for i, id in enumerate(ids.tolist()):
            model.things[id & NONE] = Thing(id, boxes[i].astype(np.float64), np.zeros(self.dim), margins[i],
                                            tuple(int(x) for x in filters[i]), bool(enabled[i]), int(data[i]))
            model.filter_was_set.add(id & NONE)

    def command(self, world, model, most):
        rng, things = self.rng, self.some(model, most)
        ids, n = np.array([one.id for one in things], np.uint64), len(things)
        what = rng.integers(0, 10)
        if what == 0 or len(model.things) < 3:
            self.add(world, model)
        elif what == 1 and len(model.things) > 20:
            world.remove(ids)
            for one in things:
                del model.things[one.id & NONE]
        elif what in (1, 2, 3):
            boxes, ways = self.boxes(n), np.zeros((n, self.dim))
            if rng.random() < 0.5:  # a little way
                boxes = np.array([one.box for one in things]).reshape(n, 2, self.dim) + rng.integers(-1, 2, (n, 1, self.dim)) / 4
                boxes = boxes.astype(self.dtype)
            if rng.random() < 0.3:
                ways = rng.integers(-8, 9, (n, self.dim)) / 4
                world.move(ids, boxes, ways.astype(self.dtype))
            else:
                world.move(ids, boxes)
            for one, box, way in zip(things, boxes, ways):
                one.box, one.way = box.astype(np.float64), way
        elif what == 4:
            sizes = rng.integers(0, 16, (n, self.dim)) / 4
            world.resize(ids, sizes.astype(self.dtype))
            for one, each in zip(things, sizes):
                centre = one.box.mean(0)
                one.box = np.stack([centre - each / 2, centre + each / 2])
        elif what == 5:
            columns = self.columns(n)
            world.set_filter(ids, **{name: self.given(value) for name, value in columns.items()})
            for one, each in zip(things, np.transpose(list(columns.values()))):
                one.filter = tuple(int(x) for x in each)
                model.filter_was_set.add(one.id & NONE)
        elif what == 6:
            margins = rng.integers(0, 3, n) / 4
            world.set_margin(ids, self.given(margins))
            for one, each in zip(things, margins):
                one.margin = each
        elif what == 7:
            enabled = rng.random(n) < 0.6
            world.set_enabled(ids, self.given(enabled))
            for one, each in zip(things, enabled):
                one.enabled = bool(each)
        elif what == 8:
            world.report_again(ids)
            model.again |= {one.id & NONE for one in things}
        else:
            couples = [(a, b) for a, b in zip(things[::2], things[1::2])]
            world.report_again(np.array([(a.id, b.id) for a, b in couples], np.uint64).reshape(-1, 2))
            model.again_pairs |= {tuple(sorted((a.id & NONE, b.id & NONE))) for a, b in couples}
            model.named_first |= {a.id & NONE for a, _ in couples}

    def change(self, world, model, most):
        for _ in range(self.rng.integers(1, 4)):
            self.command(world, model, most)

    def update(self, world, model):
        self.mood = int(self.rng.integers(0, 4))
        if self.rng.random() < 0.3 and model.things:
            things = self.some(model)
            boxes = self.boxes(len(things))
            world.update(np.array([one.id for one in things], np.uint64), boxes)
            for one, box in zip(things, boxes):
                one.box, one.way = box.astype(np.float64), np.zeros(self.dim)
        else:
            world.update()
        model.update()

    # --- What they say ---

    def check_lists(self, world, model):
        assert world.began().tolist() == [list(pair) for pair in model.began]
        ended = world.ended()
        assert [(*pair, reason) for pair, reason in zip(ended.pairs.tolist(), ended.reasons.tolist())] == model.ended
        assert world.persisted().tolist() == [list(pair) for pair in model.persisted]

    def check_objects(self, world, seen, model, has_data=True):
        ids = np.array([seen[i].id for i in sorted(seen)], np.uint64)
        assert world.ids().tolist() == ids.tolist() and len(world) == len(seen)
        if not len(ids):
            return
        things = [seen[i] for i in sorted(seen)]
        assert np.array_equal(world.boxes(ids), [one.box for one in things])
        assert np.array_equal(world.bounds(ids), [one.bounds(model.margin) for one in things])
        assert world.filters(ids).tolist() == [list(one.filter) for one in things]
        assert world.enabled(ids).tolist() == [one.enabled for one in things]
        assert world.margins(ids).tolist() == [one.margin + model.margin for one in things]
        if has_data:
            assert world.user_data(ids).tolist() == [one.data for one in things]

    def check_pairs(self, world, seen, pairs):
        assert world.pairs().tolist() == [list(pair) for pair in sorted(pairs)]
        ids = [seen[i].id for i in sorted(seen)][:size(self.rng, 70)]
        near = world.touching(np.array(ids, np.uint64))
        for id, found in zip(ids, near):
            i = id & NONE
            assert found.tolist() == [seen[k].id for k in sorted({b for a, b in pairs if a == i} | {a for a, b in pairs if b == i})]
        told = []
        world.visit_pairs(lambda some, at: told.extend(some.tolist()), chunk=int(self.rng.choice([1, 2, 3, 64])))
        assert told == [[seen[i].id, seen[j].id] for i, j in sorted(pairs)]

    def check_queries(self, world, seen, pairs, model):
        ids, bounds, filters = model.arrays(seen)
        kind = KINDS[self.rng.integers(0, len(KINDS))]
        asked = Asked(self.rng, self.dim, kind, bounds, ids)
        asked.check(jostle, world, ids, bounds, filters.T[:3])
        boxes = self.boxes(size(self.rng, 70))
        wish = dict(asker=asked.asker)
        found = np.argwhere(overlap(boxes, bounds))
        if asked.asker is not None:
            found = found[agree(*asked.asker, *filters.T[:3])[found[:, 1]]]
        if asked.salt is not None:
            wish["accept"] = asked.filters()["accept"]
            found = found[[asked.accepts(q, ids[i]) for q, i in found]] if len(found) else found
        expected = [[int(q), int(ids[i]) & NONE] for q, i in found]
        assert sorted(world.join(boxes, **wish).tolist()) == sorted(expected)
        self.check_closest(world, None, ids, bounds, filters, pairs, seen)

    def check_closest(self, world, other, ids, bounds, filters, pairs, seen, theirs=None):
        """The squared distances, since pairs that touch come in any order."""
        ids_b, bounds_b = (ids, bounds) if theirs is None else theirs
        gaps = np.maximum(np.maximum(bounds_b[None, :, 0] - bounds[:, None, 1], bounds[:, None, 0] - bounds_b[None, :, 1]), 0)
        squares = (gaps ** 2).sum(-1)
        if theirs is None:
            columns = [(filters[:, None, k], filters[None, :, k]) for k in range(4)]
            ok = agree(*[a for a, _ in columns[:3]], *[b for _, b in columns[:3]]) & ~((columns[3][0] != 0) & (columns[3][1] != 0))
            index = ids & np.uint64(NONE)
            for i, j in np.argwhere(ok & (squares == 0)):
                ok[i, j] = tuple(sorted((int(index[i]), int(index[j])))) in pairs
            ok = np.triu(ok, 1)
        else:
            ok = np.ones_like(squares, bool)
        most, count = float(self.rng.choice([0, 1, 4, np.inf])), max(1, size(self.rng, 40))
        expected = np.sort(squares[ok & (squares <= most ** 2)])[:count]
        found = world.closest_pairs(count, other, max_distance=most)
        assert found.at.tolist() == expected.tolist()
        place_a, place_b = ({int(id): k for k, id in enumerate(each)} for each in (ids, ids_b))
        for (a, b), at in zip(found.pairs.tolist(), found.at):
            i, j = place_a[a], place_b[b]
            assert squares[i, j] == at and (ok[i, j] or ok[j, i])
        assert len(set(map(tuple, found.pairs.tolist()))) == len(found.pairs)

    def check(self):
        model, rng = self.model, self.rng
        self.check_lists(self.world, model)
        self.check_objects(self.world, model.seen, model)
        self.check_pairs(self.world, model.seen, model.pairs)
        self.check_queries(self.world, model.seen, model.pairs, model)
        ids, bounds, _ = model.arrays(model.seen)
        theirs = self.inner_model.arrays(self.inner_model.seen)[:2]
        if len(ids) and len(theirs[0]):
            self.check_closest(self.world, self.inner, ids, bounds, None, None, None, theirs)
        self.check_lists(self.inner, self.inner_model)
        if self.viewed is not None:
            seen, pairs, margin = self.viewed
            of = Model(self.dim, margin)
            self.check_objects(self.view, seen, of, has_data=False)
            self.check_pairs(self.view, seen, pairs)
            self.check_queries(self.view, seen, pairs, of)
            assert len(self.view.began()) == len(self.view.ended().pairs) == len(self.view.persisted()) == 0
        if rng.random() < 0.2 and not self.has_accept:
            fork = self.world.fork()
            assert fork.save() == self.world.save()

    # --- Turns ---

    def turn(self):
        rng, world, model = self.rng, self.world, self.model
        what = rng.integers(0, 20)
        if what < 8:
            self.change(world, model, self.most)
        elif what < 13:
            self.nests = int(rng.integers(0, 4)) if self.has_accept else 0
            self.update(world, model)
            self.nests = 0
        elif what == 13:
            world.apply()
            model.apply()
        elif what == 14:
            self.change(self.inner, self.inner_model, 20)
            self.update(self.inner, self.inner_model)
        elif what == 15:
            self.view.follow(world)
            self.viewed = (copy.deepcopy(model.seen), set(model.pairs), model.margin)
        elif what == 16:
            self.snapshots = self.snapshots[-3:] + [(world.save(), copy.deepcopy(model))]
        elif what == 17:
            self.base = (world.save_base(), [])
        elif what == 18 and self.base is not None:
            changes = world.save_changes()
            self.base[1].append((changes, copy.deepcopy(model)))
        elif what == 19 and rng.random() < 0.5:
            kinds = [(world.restore, one) for one in self.snapshots]
            if self.base is not None:
                kinds += [(world.restore_changes, one) for one in self.base[1]]
            if kinds:
                back, (saved, then) = kinds[rng.integers(0, len(kinds))]
                back(saved)
                model.go_back_to(then)
                if back == world.restore:
                    self.base = None
        self.check()


@pytest.mark.parametrize("seed", range(14))
def test_a_world_says_what_the_model_says(seed):
    stream = Stream(seed)
    for _ in range(45):
        stream.turn()


@pytest.mark.parametrize("seed", range(6))
def test_an_index_says_what_the_model_says(seed):
    rng = np.random.default_rng(seed)
    dim, dtype = int(rng.integers(2, 4)), (np.float32, np.float64)[rng.integers(0, 2)]
    index, there = jostle.BoxIndex(dim=dim, dtype=dtype), {}
    for turn in range(25):
        known = rng.permutation(sorted(there))[:size(rng)].astype(np.uint32)
        if turn % 3 == 0 or not there:
            new = np.setdiff1d(rng.permutation(400)[:size(rng)], sorted(there)).astype(np.uint32)
            boxes = some_boxes(rng, len(new), dim, dtype)
            index.insert(new, boxes)
            there.update(zip(new.tolist(), boxes))
        elif turn % 3 == 1:
            boxes = some_boxes(rng, len(known), dim, dtype)
            index.move(known, boxes)
            there.update(zip(known.tolist(), boxes))
        elif len(there) > 150:
            index.erase(known)
            for id in known.tolist():
                del there[id]
        ids = np.array(sorted(there), np.uint64)
        boxes = np.array([there[int(id)] for id in ids], np.float64).reshape(len(ids), 2, dim)
        columns = dict(category=1 << rng.integers(0, 3, 400), mask=rng.integers(1, 8, 400), owner=rng.choice([0, 1, NONE], 400))
        for kind in KINDS:
            asked = Asked(rng, dim, kind, boxes, ids)
            asked.check(jostle, index, ids, boxes, [value[ids] for value in columns.values()], **columns)
        assert sorted(map(sorted, index.pairs().tolist())) == [[int(ids[i]), int(ids[j])] for i, j in np.argwhere(np.triu(overlap(boxes, boxes), 1))]
        other = some_boxes(rng, size(rng), dim, dtype)
        assert index.join(other).tolist() == [[i, int(ids[j])] for i, j in np.argwhere(overlap(other, boxes))]


def pair_filters(rng, n, names):
    wish = dict(category=1 << rng.integers(0, 3, n), mask=rng.integers(1, 8, n), owner=rng.choice([0, 1, NONE], n))
    return {name: wish[name] for name in names}


def let_pair(a, b, n, m):
    """(n, m): which pairs the filters let pass, of columns that may be missing."""
    def full(wish, count, name, value):
        return np.asarray(wish.get(name, np.full(count, value)), np.int64)

    columns = [full(a, n, name, value)[:, None] for name, value in (("category", NONE), ("mask", NONE), ("owner", NONE))]
    others = [full(b, m, name, value)[None] for name, value in (("category", NONE), ("mask", NONE), ("owner", NONE))]
    return agree(*columns, *others)


@pytest.mark.parametrize("seed", range(40))
def test_pairs_are_those_of_the_model(seed):
    """find_pairs, a finder that is used again, the stream and scenes, all filtered in every way."""
    rng = np.random.default_rng(seed)
    dim, dtype = int(rng.integers(2, 4)), (np.float32, np.float64)[rng.integers(0, 2)]
    finder = jostle.PairFinder()
    for _ in range(6):
        n, m, salt = size(rng), size(rng), int(rng.integers(0, 4))
        names = [("category", "mask", "owner"), ("category", "mask"), ("owner",), ()][rng.integers(0, 4)]
        a, b = some_boxes(rng, n, dim, dtype), some_boxes(rng, m, dim, dtype)
        wish, of_b = pair_filters(rng, n, names), pair_filters(rng, m, names)
        accept = None if rng.random() < 0.5 else lambda i, j, salt=salt: (i * 3 + j + salt) % 4 != 0
        takes = lambda found: [[int(i), int(j)] for i, j in found if accept is None or accept(int(i), int(j))]
        within = takes(np.argwhere(np.triu(overlap(a, a) & let_pair(wish, wish, n, n), 1)))
        between = takes(np.argwhere(overlap(a, b) & let_pair(wish, of_b, n, m)))
        renamed = {name + "_b": value for name, value in of_b.items()}
        for other, more, expected in ((None, {}, within), (b, renamed, between)):
            given = dict(**wish, **more, accept=accept)
            assert jostle.find_pairs(a, other, order="sorted", **given).tolist() == expected
            found = finder.find(a, other, **given)
            assert sorted(found.tolist()) == expected
            chunk = int(rng.choice([1, 2, 3, 7, 64, max(1, len(expected)), len(expected) + 1]))
            parts = list(jostle.iter_pairs(a, other, chunk=chunk, threads=int(rng.integers(1, 3)), **given))
            assert [len(part) for part in parts[:-1]] == [chunk] * max(len(parts) - 1, 0)
            assert sorted(pair for part in parts for pair in part.tolist()) == expected
        cuts = np.sort(rng.integers(0, n + 1, size(rng, 9)))
        offsets = np.concatenate([[0], cuts, [n]])
        scenes = jostle.find_scenes(a, offsets, **wish, accept=None if accept is None else lambda scene, i, j: accept(i, j))
        assert len(scenes) == len(offsets) - 1
        for k, (first, last) in enumerate(zip(offsets[:-1], offsets[1:])):
            part, some = a[first:last], {name: value[first:last] for name, value in wish.items()}
            ok = overlap(part, part) & let_pair(some, some, len(part), len(part))
            assert sorted(scenes[k].tolist()) == takes(np.argwhere(np.triu(ok, 1)))


@pytest.mark.parametrize("seed", range(40))
def test_groups_are_the_least_of_what_each_pair_is(seed):
    """Groups of pairs are asked about in parts that end anywhere, and begin with shapes that lie in each other."""
    rng = np.random.default_rng(seed)
    dim, dtype, n = int(rng.integers(2, 4)), (np.float32, np.float64)[rng.integers(0, 2)], int(rng.integers(2, 60))
    radii = rng.integers(1, 9, n) / 4
    shapes = jostle.Shapes.spheres(radii, dim=dim) if seed % 2 else jostle.Shapes([
        jostle.sphere(r, dim=dim) if i % 2 else jostle.box([r] * dim) for i, r in enumerate(radii)])
    poses = jostle.poses(rng.integers(-16, 17, (n, dim)).astype(dtype) / 4)
    finder = jostle.ContactFinder(dim, dtype)
    for _ in range(4):
        m = size(rng)
        pairs = rng.integers(0, n, (m, 2))
        pairs = pairs[pairs[:, 0] != pairs[:, 1]]
        m = len(pairs)
        offsets = np.concatenate([[0], np.sort(rng.integers(0, m + 1, size(rng, 9))), [m]])
        most = float(rng.choice([0, 0.5, 3, np.inf]))
        each, touch = finder.distances(shapes, poses, pairs, most), finder.touching(shapes, poses, pairs)
        first = finder.first_touching(shapes, poses, pairs, offsets)
        rows, numbers = finder.least_distances(shapes, poses, pairs, offsets, most)
        for g, (a, b) in enumerate(zip(offsets[:-1], offsets[1:])):
            hits = np.flatnonzero(touch[a:b])
            assert first[g] == (a + hits[0] if len(hits) else -1)
            least = each["distance"][a:b].min(initial=np.inf)
            assert rows["distance"][g] == least
            if np.isfinite(least):
                assert a <= numbers[g] < b and each[numbers[g]] == rows[g]
                assert numbers[g] == a + np.argmax(each["distance"][a:b] == least)
            else:
                assert numbers[g] == -1


def test_a_world_is_updated_inside_anothers_accept():
    """Three deep, each asked again about itself after those inside it were updated."""
    boxes = np.zeros((6, 2, 2))
    boxes[:, 1] = 1
    worlds, asked = [], []

    def accept_of(depth):
        def accept(a, b):
            asked.append(depth)
            if depth < 2:
                inside = worlds[depth + 1]
                inside.report_again(inside.ids())
                inside.update()
                assert len(inside.began()) == 15
            world = worlds[depth]
            world.contains([a, b])  # each is lent to its own accept
            with pytest.raises(jostle.Error, match="in use"):
                world.update()
            return True
        return accept

    for depth in range(3):
        worlds.append(jostle.World(2, accept=accept_of(depth)))
    for world in reversed(worlds):
        world.add(boxes)
        world.update()
        assert len(world.began()) == 15
    with pytest.raises(jostle.Error, match="in use"):
        worlds[0].count(boxes[:1], accept=lambda query, id: worlds[0].update())
    assert [asked.count(depth) for depth in range(3)] == [15, 15 + 15**2, 15 + 15**2 + 15**3]


def memory_now():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


@pytest.mark.parametrize("chunk", (1000, 4095, 4096, 4097))
def test_a_stream_that_nobody_fetches_from_takes_no_memory(chunk):
    """The search waits when four chunks haven't been fetched. All pairs would take 256 MB."""
    n = 8000
    boxes = np.zeros((n, 2, 3), np.float32)
    boxes[:, 1] = 1
    for chunks in jostle.iter_pairs(boxes[:200], chunk=chunk):
        pass
    before = memory_now()
    stream = jostle.iter_pairs(boxes, chunk=chunk, threads=2)
    found = [next(stream)]
    most = 0
    for _ in range(20):
        time.sleep(0.01)
        found.append(next(stream))
        most = max(most, memory_now() - before)
    stream.close()
    assert all(len(one) == chunk for one in found) and most < 60e6
