# SPDX-License-Identifier: MIT
"""What the package is to answer, written to be obviously right: every box against every other one, in NumPy.

All numbers are small multiples of powers of two, so that nothing is rounded, in float32 neither.
"""
import copy
import dataclasses

import numpy as np

NONE = 2**32 - 1
#: How many there are of anything: none, and beside powers of two and the parts of 4, 4 + 32 and so on in which much is asked.
SIZES = (0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 35, 36, 37, 63, 64, 65, 67, 68, 69, 127, 128, 129, 291, 292, 293)
KINDS = ("rays", "sweeps", "overlapping", "spheres", "frustums", "nearest", "nearest_to_boxes")


def size(rng, most=300):
    return int(rng.choice([n for n in SIZES if n <= most]))


def some_boxes(rng, n, dim, dtype=np.float64, extent=12):
    lo = rng.integers(-4 * extent, 4 * extent, (n, dim)) / 4
    return np.stack([lo, lo + rng.integers(0, 20, (n, dim)) / 4], axis=1).astype(dtype)


def overlap(a, b):
    """(n, m): which boxes of a touch which of b."""
    return ((a[:, None, 0] <= b[None, :, 1]) & (b[None, :, 0] <= a[:, None, 1])).all(-1)


def agree(category_a, mask_a, owner_a, category_b, mask_b, owner_b):
    """Whether filters let objects pair; all may be arrays."""
    return ((category_a & mask_b) != 0) & ((category_b & mask_a) != 0) & ((owner_a != owner_b) | (owner_a == NONE))


class Asked:
    """Queries of one kind with all that filters them, and what they find among boxes."""

    def __init__(self, rng, dim, kind, boxes, ids):
        self.kind, self.n = kind, size(rng, 70)
        n, whole = self.n, lambda least, most, *shape: rng.integers(least, most, shape) / 4
        self.boxes, self.points = some_boxes(rng, n, dim, extent=14), whole(-50, 50, n, dim)
        self.ways = rng.choice([-4.0, -1, -0.5, 0, 1, 2, 8], (n, dim))
        self.ways[(self.ways == 0).all(axis=1), 0] = 1
        self.most = rng.choice([0.25, 1, 2, 4, 16, np.inf], n)
        self.radii, self.count = whole(0, 40, n), int(rng.integers(0, 12))
        self.planes = [np.concatenate([rng.choice([-1.0, 0, 1], (k, dim)), whole(-30, 60, k, 1)], axis=1) for k in rng.integers(1, 4, n)]
        for planes in self.planes:
            planes[(planes[:, :dim] == 0).all(axis=1), 0] = 1
        self.asker = None if rng.random() < 0.3 else tuple(int(x) for x in (rng.integers(1, 8), rng.integers(1, 8), rng.choice([0, 1, NONE])))
        self.exclude = None
        if len(ids) and rng.random() < 0.6:
            self.exclude = int(rng.choice(ids)) if rng.random() < 0.5 else rng.choice(ids, n)
        self.salt = None if rng.random() < 0.6 else int(rng.integers(0, 5))
        self.limit = None if kind.startswith("nearest") or rng.random() < 0.5 else int(rng.integers(0, 5))

    def queries(self, jostle, dtype):
        make = getattr(jostle, self.kind)
        return {"rays": lambda: make(self.points, self.ways, self.most), "sweeps": lambda: make(self.boxes, self.ways, self.most),
                "overlapping": lambda: make(self.boxes.astype(dtype)), "spheres": lambda: make(self.points, self.radii),
                "frustums": lambda: make(self.planes), "nearest": lambda: make(self.points, self.count, self.radii),
                "nearest_to_boxes": lambda: make(self.boxes, self.count, self.radii)}[self.kind]()

    def filters(self):
        accept = None if self.salt is None else (lambda query, id: self.accepts(query, id))
        return dict(asker=self.asker, exclude=self.exclude, accept=accept)

    def accepts(self, query, id):
        return (query * 7 + int(id) * 3 + self.salt) % 4 != 0

    def _at(self, boxes):
        """(n, m): where each query finds each box; NaN where it doesn't."""
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.kind in ("rays", "sweeps"):
                lo, hi = boxes[None, :, 0], boxes[None, :, 1]
                first, last = (self.points, self.points) if self.kind == "rays" else (self.boxes[:, 0], self.boxes[:, 1])
                way = self.ways[:, None]
                a, b = (lo - last[:, None]) / way, (hi - first[:, None]) / way
                still = (way == 0) & (lo <= last[:, None]) & (first[:, None] <= hi)
                enter = np.where(way == 0, np.where(still, -np.inf, np.inf), np.minimum(a, b)).max(-1, initial=0)
                leave = np.minimum(np.where(way == 0, np.where(still, np.inf, -np.inf), np.maximum(a, b)).min(-1), self.most[:, None])
                return np.where(enter <= leave, enter, np.nan)
            if self.kind == "overlapping":
                return np.where(overlap(self.boxes, boxes), 0, np.nan)
            if self.kind == "frustums":
                out = np.zeros((self.n, len(boxes)))
                for q, planes in enumerate(self.planes):
                    normal, offset = planes[:, None, :-1], planes[:, None, -1]
                    furthest = np.where(normal > 0, boxes[None, :, 1], boxes[None, :, 0])
                    out[q] = np.where(((normal * furthest).sum(-1) + offset >= 0).all(0), 0, np.nan)
                return out
            lo, hi = (self.boxes[:, 0], self.boxes[:, 1]) if self.kind == "nearest_to_boxes" else (self.points, self.points)
            gaps = np.maximum(np.maximum(boxes[None, :, 0] - hi[:, None], lo[:, None] - boxes[None, :, 1]), 0)
            squares = (gaps ** 2).sum(-1)
            return np.where(squares <= self.radii[:, None] ** 2, 0 if self.kind == "spheres" else squares, np.nan)

    def expected(self, ids, boxes, category, mask, owner):
        """Of each query its answers, (id, at), in order."""
        counts = np.ones((self.n, len(ids)), bool)
        if self.asker is not None:
            counts &= agree(*self.asker, category, mask, owner)[None]
        if self.exclude is not None:
            counts &= ids[None] != np.broadcast_to(np.asarray(self.exclude, np.uint64), self.n)[:, None]
        at = np.where(counts, self._at(boxes), np.nan)
        order = ids & np.uint64(NONE)
        out = []
        for q in range(self.n):
            found = [(at[q, i], order[i], i) for i in np.flatnonzero(~np.isnan(at[q]))]
            found = [(int(ids[i]), float(a)) for a, _, i in sorted(found) if self.salt is None or self.accepts(q, ids[i])]
            out.append(found[:self.count] if self.kind.startswith("nearest") else found)
        return out

    def only(self, q):
        """The query number q alone."""
        one = copy.copy(self)
        one.n, one.planes = 1, self.planes[q:q + 1]
        for name in ("boxes", "points", "ways", "most", "radii"):
            setattr(one, name, getattr(self, name)[q:q + 1])
        if isinstance(self.exclude, np.ndarray):
            one.exclude = int(self.exclude[q])
        return one

    def check_visit(self, jostle, asked, expected, chunk, **columns):
        told, sizes = [], []

        def visit(ids, at):
            sizes.append(len(ids))
            told.extend(zip(ids.tolist(), at.tolist()))

        assert asked.visit(self.queries(jostle, asked.dtype), visit, chunk=chunk, **self.filters(), **columns)
        is_region = self.kind in ("overlapping", "spheres", "frustums")
        assert (sorted(told) == sorted(expected[0]) if is_region else told == expected[0]), self.kind
        assert all(one == chunk for one in sizes[:-1])

    def check(self, jostle, asked, ids, boxes, filters, **columns):
        """Whether an index or world, `asked`, says what is expected, to each of its functions."""
        expected = self.expected(ids, boxes, *filters)
        if self.n:
            one = self.only(self.n // 2)
            one.check_visit(jostle, asked, one.expected(ids, boxes, *filters), self.count + 1, **columns)
        queries, filters = self.queries(jostle, asked.dtype), {**self.filters(), **columns}
        found = asked.all(queries, max_results=self.limit, **filters)
        assert len(found) == self.n
        assert (found.at is None) == (self.kind in ("overlapping", "spheres", "frustums"))
        at = np.zeros(len(found.ids)) if found.at is None else found.at
        for q, whole in enumerate(expected):
            got = list(zip(found[q].tolist(), at[found.first[q]:found.first[q + 1]].tolist()))
            if self.limit is None:
                assert got == whole, (self.kind, q)
            else:
                assert len(got) == min(self.limit, len(whole)) and set(got) <= set(whole) and found.more[q] == (len(whole) > self.limit)
        if not self.kind.startswith("nearest"):
            assert asked.count(queries, **filters).tolist() == [len(one) for one in expected], self.kind
            assert asked.any(queries, **filters).tolist() == [len(one) > 0 for one in expected], self.kind
        if self.kind in ("rays", "sweeps"):
            hits = asked.first(queries, **filters)
            nothing = (-1 if hits.ids.dtype == np.int64 else 0, np.inf)
            assert list(zip(hits.ids.tolist(), hits.at.tolist())) == [one[0] if one else nothing for one in expected]


@dataclasses.dataclass
class Thing:
    id: int
    box: np.ndarray
    way: np.ndarray
    margin: float
    filter: tuple  # category, mask, owner, is_static
    enabled: bool
    data: int = 0

    def bounds(self, margin):
        lo, hi = self.box
        return np.stack([np.minimum(lo, lo + self.way), np.maximum(hi, hi + self.way)]) + np.array([[-1], [1]]) * (margin + self.margin)

    def is_like(self, other, margin):
        return (self.id, self.filter, self.enabled) == (other.id, other.filter, other.enabled) and np.array_equal(
            self.bounds(margin), other.bounds(margin))


class Model:
    """A world: commands change `things`, which the next update sees; what is asked sees `seen` and `pairs`."""

    def __init__(self, dim, margin, accepts=None):
        self.dim, self.margin, self.accepts = dim, margin, accepts  # accepts(id, id), or None
        self.things, self.last = {}, {}              # by index
        self.touching, self.accepted = set(), set()  # pairs by index, as of the last update
        self.began, self.ended, self.persisted = [], [], []
        self.forget_wishes()
        self.seen, self.pairs = {}, set()

    def forget_wishes(self):
        self.filter_was_set, self.again, self.again_pairs, self.named_first = set(), set(), set(), set()

    def __deepcopy__(self, memo):
        other = Model(self.dim, self.margin, self.accepts)
        for name, value in vars(self).items():
            if name != "accepts":
                setattr(other, name, copy.deepcopy(value, memo))
        return other

    def arrays(self, things):
        """Ids, bounds, category, mask, owner of what is there."""
        there = [things[i] for i in sorted(things) if things[i].enabled]
        filters = np.array([one.filter for one in there], np.int64).reshape(-1, 4)
        bounds = np.array([one.bounds(self.margin) for one in there]).reshape(len(there), 2, self.dim)
        return np.array([one.id for one in there], np.uint64), bounds, filters

    def _now(self):
        ids, bounds, filters = self.arrays(self.things)
        index = (ids & np.uint64(NONE)).astype(int)
        if len(ids) < 2:
            return set()
        columns = [(filters[:, None, k], filters[None, :, k]) for k in range(4)]
        ok = overlap(bounds, bounds) & agree(*[a for a, _ in columns[:3]], *[b for _, b in columns[:3]])
        ok &= ~((columns[3][0] != 0) & (columns[3][1] != 0))
        return {(index[i], index[j]) for i, j in np.argwhere(np.triu(ok, 1))}

    def _judge(self, ask):
        """Pairs that touch, and of those the ones that accept took; pairs that begin."""
        now, accepted, began = self._now(), set(), []
        for i, j in sorted(now):
            a, b = self.things[i].id, self.things[j].id
            same = (i, j) in self.touching and self.last[i].id == a and self.last[j].id == b
            before = is_accepted = same and (i, j) in self.accepted
            tell = same and (i in self.again or j in self.again or (i, j) in self.again_pairs)
            if not same or tell or i in self.filter_was_set or j in self.filter_was_set:
                is_accepted = ask(a, b)
            if is_accepted:
                accepted.add((i, j))
                if not before or tell:
                    began.append((a, b))
        return now, accepted, began

    def _changed(self, i):
        if i in self.again or i in self.named_first:
            return True
        if i not in self.last or i not in self.things or not self.things[i].is_like(self.last[i], self.margin):
            return True
        return self.accepts is not None and i in self.filter_was_set

    def _reason(self, i, j):
        a, b = self.things.get(i), self.things.get(j)
        if a is None or b is None or a.id != self.last[i].id or b.id != self.last[j].id:
            return 1
        if not (a.enabled and b.enabled):
            return 2
        return 3 if overlap(a.bounds(self.margin)[None], b.bounds(self.margin)[None])[0, 0] else 0

    def update(self):
        now, accepted, self.began = self._judge(self.accepts or (lambda a, b: True))
        told = set(self.began)
        self.persisted = [(i, j) for i, j in sorted(accepted) if (self.things[i].id, self.things[j].id) not in told
                          and (self._changed(i) or self._changed(j))]
        self.ended = [(self.last[i].id, self.last[j].id, self._reason(i, j)) for i, j in sorted(self.accepted)
                      if self._reason(i, j) == 1 or (i, j) not in accepted]
        self.touching, self.accepted, self.last = now, accepted, copy.deepcopy(self.things)
        self.forget_wishes()
        self.seen, self.pairs = self.last, set(accepted)

    def apply(self):
        self.pairs = self._judge(lambda a, b: True)[1]
        self.seen = copy.deepcopy(self.things)

    def go_back_to(self, saved):
        """As the world that was saved, without lists and without what was queued."""
        for name, value in vars(copy.deepcopy(saved)).items():
            if name != "accepts":
                setattr(self, name, value)
        self.things, self.pairs, self.seen = copy.deepcopy(self.last), set(self.accepted), self.last
        self.began, self.ended, self.persisted = [], [], []
        self.forget_wishes()

    def pair_ids(self, pairs):
        return [(self.seen[i].id, self.seen[j].id) for i, j in sorted(pairs)]
