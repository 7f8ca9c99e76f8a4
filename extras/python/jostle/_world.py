# SPDX-License-Identifier: MIT
"""Objects that live, move and rest."""
from __future__ import annotations

from typing import Any, Callable, Iterable, NamedTuple

import numpy as np

from . import _arrays, _core
from ._errors import Error
from ._lists import Answers, ClosePairs
from ._queries import WHAT_COUNTS, AcceptAnswer, Asker, Verbs, asking
from ._visits import Visit, first_pairs


def _filters(count: int, category: Any, mask: Any, owner: Any, is_static: Any) -> np.ndarray:
    """What objects pair with which, one row for each; given is one value for all, or one for each."""
    filters = np.empty((count, 4), np.uint32)
    for column, (name, value) in enumerate((("category", category), ("mask", mask), ("owner", owner))):
        filters[:, column] = _arrays.per_object(_arrays.integers(value, name, np.uint32), name, count)
    filters[:, 3] = _arrays.flags(is_static, "is_static", count)
    return filters


class EndedPairs(NamedTuple):
    """Pairs that no longer touch."""

    pairs: np.ndarray  #: (m, 2) uint64, ids
    reasons: np.ndarray  #: (m,) uint8: 0 moved apart, 1 removed, 2 disabled, 3 filtered


class World(Verbs):
    __doc__ = """Objects with ids, and the pairs between them: which pairs began, persist and ended.

        world = jostle.World(dim=3, dtype=np.float32)
        ids = world.add(boxes)            # (n,) uint64
        world.update()
        world.move(ids, new_boxes); world.update()
        world.began(), world.ended()

    Commands are queued and take effect, all at once, in the next update(). Ids are whole numbers; their low 32 bits are a small
    index, good for indexing arrays: jostle.World.index(ids).

    margin    every box is this much bigger on every side
    layers    [(category, mask), ...], at most 8: queries with one of these go by indexes of the objects that count alone, for few of many
    accept    accept(id_a, id_b) is asked once for each pair that would begin; such a world works on one thread
    threads   0 for one per core

    Of the commands, add, remove and move without displacements are queued for all objects or, where the call fails, for none; the
    others may then have been queued for the objects before the one at fault, or, without memory, for the first ones.

    Resting objects cost nothing. Several threads may give commands, at any time, and any number may ask; but not while another
    one calls update(), apply(), clear(), follow() or restores: that is an Error, on whichever side comes second. `accept` may ask. A world
    can be pickled, unless it has an `accept`.""" + WHAT_COUNTS

    def __init__(self, dim: int = 3, dtype: Any = np.float64, *, margin: float = 0.0,
                 accept: Callable[[int, int], bool] | None = None, threads: int = 0,
                 layers: Iterable[tuple[int, int]] = ()) -> None:
        self.dim, self.dtype = dim, np.dtype(dtype)
        if (self.dim, self.dtype) not in _arrays.SPACES:
            raise Error(f"a world is 2D or 3D, float32 or float64, not {self.dim}D {self.dtype}")
        self._threads, self._kept = _arrays.threads(threads, accept), [
            (_arrays.whole(category, "category"), _arrays.whole(mask, "mask")) for category, mask in layers]
        self._core = _core.World(_arrays.SPACES[self.dim, self.dtype], margin, _arrays.function(accept, "accept"), self._threads,
                                  self._kept)

    @staticmethod
    def index(ids: Any) -> np.ndarray:
        """The small indices in ids: (n,) uint32."""
        return (_arrays.ids(ids) & np.uint64(0xFFFFFFFF)).astype(np.uint32)

    # --- Commands ---

    def add(self, boxes: Any, *, category: Any = 1, mask: Any = 2**32 - 1, owner: Any = 2**32 - 1, is_static: Any = False,
            margin: Any = 0.0, enabled: Any = True) -> np.ndarray:
        """Adds objects and returns their ids, (n,) uint64, which are valid at once. Each of the other arguments is one value for
        all objects, or one for each."""
        given = self._boxes(boxes)
        of_all = all(_arrays.array(value).ndim == 0 for value in (category, mask, owner, is_static, margin, enabled))
        count = 1 if of_all or given.shape == (2, self.dim) else len(given)
        return self._core.add(given, _filters(count, category, mask, owner, is_static),
                              _arrays.per_object(_arrays.numbers(margin, "margin"), "margin", count), _arrays.flags(enabled, "enabled", count))

    def remove(self, ids: Any) -> None:
        """Removes these objects, or none of them if one doesn't exist."""
        self._core.remove(_arrays.ids(ids))

    def move(self, ids: Any, boxes: Any, displacements: Any = None, sequence: int = 0) -> None:
        """Sets new boxes, and how far they move in the coming step, (n, d): they also touch what lies in their path."""
        by = None if displacements is None else np.atleast_2d(_arrays.rows(displacements, "displacements", self.dtype))
        self._core.move(_arrays.ids(ids), self._boxes(boxes), by, _arrays.whole(sequence, "sequence"))

    def resize(self, ids: Any, sizes: Any, sequence: int = 0) -> None:
        """Sets new edge lengths, (n, d), about the same centres."""
        self._core.resize(_arrays.ids(ids), np.atleast_2d(_arrays.rows(sizes, "sizes", self.dtype)),
                           _arrays.whole(sequence, "sequence"))

    def set_filter(self, ids: Any, category: Any = 1, mask: Any = 2**32 - 1, owner: Any = 2**32 - 1, is_static: Any = False,
                   sequence: int = 0) -> None:
        """Sets what objects pair with which, as a whole: what isn't given becomes what it is by default, not what it was. Each argument
        is one number for all objects, or one for each."""
        of = _arrays.ids(ids)
        self._core.set_filter(of, _filters(len(of), category, mask, owner, is_static), _arrays.whole(sequence, "sequence"))

    def set_margin(self, ids: Any, margins: Any, sequence: int = 0) -> None:
        """Sets each object's own margin, in addition to the world's."""
        of = _arrays.ids(ids)
        each = _arrays.per_object(_arrays.numbers(margins, "margins"), "margins", len(of))
        self._core.set_margin(of, each, _arrays.whole(sequence, "sequence"))

    def set_enabled(self, ids: Any, enabled: Any, sequence: int = 0) -> None:
        """Disabled objects keep their id and box, and touch nothing."""
        of = _arrays.ids(ids)
        self._core.set_enabled(of, _arrays.flags(enabled, "enabled", len(of)), _arrays.whole(sequence, "sequence"))

    def set_user_data(self, ids: Any, data: Any) -> None:
        """Sets 64 bits of your own for each object; they take effect at once."""
        of = _arrays.ids(ids)
        self._core.set_user_data(of, _arrays.per_object(_arrays.integers(data, "data", np.uint64), "data", len(of)))

    def report_again(self, ids: Any) -> None:
        """Makes the pairs of these objects, or these pairs (m, 2), begin again in the next update if they still touch.
        `accept` is asked about them again, also about those that it refused."""
        of = _arrays.ids(ids)
        if of.ndim == 2:
            if of.shape[1] != 2:
                raise Error(f"ids has the shape {of.shape}: it must be (n,), or (m, 2) for pairs")
            self._core.report_again(np.ascontiguousarray(of[:, 0]), np.ascontiguousarray(of[:, 1]))
        else:
            self._core.report_again(of, None)

    def update(self, ids: Any = None, boxes: Any = None) -> None:
        """Applies queued commands and finds the pairs that began, persist and ended. With ids and boxes, moves those first."""
        if ids is None or boxes is None:
            if ids is not None or boxes is not None:
                raise Error(f"{'boxes' if ids is None else 'ids'} came without {'ids' if ids is None else 'boxes'}: give both, or none")
            self._core.update()
        else:
            self._core.update_moves(_arrays.ids(ids), self._boxes(boxes))

    def apply(self) -> None:
        """Makes queued commands visible before the next update: to queries, touching(), pairs() and everything that tells about
        objects. The lists of the last update stay, and the next update gives the same result as without this call."""
        self._core.apply()

    # --- Pairs, as of the last update ---

    def began(self) -> np.ndarray:
        """Pairs that touch now and didn't before: (m, 2) uint64, ids, ascending by index."""
        return self._core.began()

    def ended(self) -> EndedPairs:
        """Pairs that touched before and don't now, and why."""
        return EndedPairs(*self._core.ended())

    def persisted(self) -> np.ndarray:
        """Pairs that touched before and still do, and of which at least one object changed: (m, 2) uint32, by index."""
        return self._core.persisted()

    def changed_pairs(self) -> np.ndarray:
        """The pairs that began and those that persisted as one list, by index, as contacts() takes it."""
        return self._core.changed_pairs()

    def pairs(self) -> np.ndarray:
        """All pairs that touch, by index: (m, 2) uint32. Costs as much as a full search."""
        return self._core.pairs()

    def visit_pairs(self, visit: Visit, *, chunk: int = 4096) -> bool:
        """Calls visit(pairs, at) with all pairs that touch, `chunk` of them at a time, in memory for that many, ascending by index:
        (n, 2) uint64, ids; at is 0. visit returns None or True to go on, False to stop. Returns whether it was never stopped.
        visit may give commands and read the world; it must not update or restore it."""
        return self._core.visit_pairs(visit, chunk)

    def closest_pairs(self, count: int = 1, other: World | None = None, *, max_distance: float = np.inf) -> ClosePairs:
        """The `count` pairs of objects whose bounds are closest to each other, no further apart than max_distance: of this world's
        objects whose filters let them pair, or of one of this world's and one of another's, whatever their filters. Those that
        touch come first, the others ascending by (at, indices). Disabled objects don't count. Of this world's own, pairs that touch
        and that accept refused are left out; about pairs apart it hasn't been asked."""
        return first_pairs(count, np.uint64, lambda visit, chunk: self.visit_closest_pairs(
            visit, other, max_distance=max_distance, chunk=chunk))

    def visit_closest_pairs(self, visit: Visit, other: World | None = None, *, max_distance: float = np.inf,
                            chunk: int = 64) -> bool:
        """Calls visit(pairs, at) with pairs in the order of closest_pairs(), `chunk` of them at a time: see BoxIndex."""
        return self._core.visit_closest_pairs(None if other is None else self._other(other), max_distance, visit, chunk)

    def touching(self, ids: Any) -> Answers:
        """The objects that each of these objects touches, ascending by index."""
        first, found = self._core.touching(_arrays.ids(ids))
        return Answers(first, found, None, np.zeros(len(first) - 1, bool))

    def join(self, boxes: Any, *, asker: Asker | None = None, exclude: int | None = None,
             accept: AcceptAnswer | None = None) -> np.ndarray:
        """All pairs of one of `boxes` and an object that it touches: (m, 2) uint32, position and index."""
        return self._core.join(self._boxes(boxes), asking(asker, exclude, accept))

    # --- Objects, as of the last update ---

    def __len__(self) -> int:
        return self._core.size()

    def __contains__(self, id: int) -> bool:
        return bool(self.contains([id])[0])

    def index_end(self) -> int:
        """Every index is less than this."""
        return self._core.index_end()

    def contains(self, ids: Any) -> np.ndarray:
        """Which of these ids exist: (n,) bool."""
        return self._core.contains(_arrays.ids(ids)).astype(bool)

    def ids(self, indices: Any = None) -> np.ndarray:
        """The ids of these indices (0 where there is none), or of all objects: (n,) uint64."""
        if indices is None:
            all_ids = self._core.ids(np.arange(self.index_end(), dtype=np.uint32))
            return all_ids[all_ids != 0]
        return self._core.ids(_arrays.packed(indices, "indices", np.uint32))

    def boxes(self, ids: Any) -> np.ndarray:
        """The boxes as they were given: (n, 2, d)."""
        return self._core.boxes(_arrays.ids(ids))

    def bounds_of_all(self) -> np.ndarray | None:
        """The smallest box around all bounds, (2, d), except those of disabled objects; None if there are none."""
        return self._core.bounds_of_all()

    def bounds(self, ids: Any) -> np.ndarray:
        """The bounds that are compared, with margins and displacements: (n, 2, d)."""
        return self._core.bounds(_arrays.ids(ids))

    def filters(self, ids: Any) -> np.ndarray:
        """Category, mask, owner, is_static: (n, 4) uint32."""
        return self._core.filters(_arrays.ids(ids))

    def enabled(self, ids: Any) -> np.ndarray:
        """(n,) bool."""
        return self._core.enabled(_arrays.ids(ids)).astype(bool)

    def user_data(self, ids: Any) -> np.ndarray:
        """Your own 64 bits for each object, (n,) uint64; also for objects that the last update removed."""
        return self._core.user_data(_arrays.ids(ids))

    def margins(self, ids: Any) -> np.ndarray:
        """The sum of the world's margin and each object's own: (n,) float64."""
        return self._core.margins(_arrays.ids(ids))

    # --- Snapshots ---

    def save(self) -> bytes:
        """The world's state after the last update, as bytes that are the same on every machine."""
        return self._core.save()

    def restore(self, snapshot: bytes) -> None:
        """Makes this world the one that was saved."""
        self._core.restore(bytes(memoryview(snapshot)))

    def save_base(self) -> bytes:
        """Like save(), and makes this state the base: differences are recorded until the next save_base(), restore() or clear()."""
        return self._core.save_base()

    def save_changes(self) -> bytes:
        """How the world differs from its base, as bytes. The cost depends on what differs; resting objects cost nothing."""
        return self._core.save_changes()

    def restore_changes(self, changes: bytes) -> None:
        """Makes this world the one whose changes these are, like restore(). It keeps its base, which must be that of the changes."""
        self._core.restore_changes(bytes(memoryview(changes)))

    def clear(self) -> None:
        """Removes all objects. Ids from before then name other objects, or none."""
        self._core.clear()

    def fork(self) -> World:
        """Another world like this one."""
        other = World.__new__(World)
        other.dim, other.dtype, other._threads, other._core = self.dim, self.dtype, self._threads, self._core.fork()
        other._kept = self._kept
        return other

    __copy__ = fork

    def follow(self, other: World) -> None:
        """Makes this world a view of another one with the same dim and dtype: it answers queries as the other one does now, also while the
        other one is updated in another thread. Call it again to catch up; that costs what has changed. A view takes no commands
        until clear() or restore() makes it a world again."""
        self._core.follow(self._other(other))

    def __getstate__(self) -> tuple[int, str, int, bytes, list[tuple[int, int]]]:
        if self._core.accept is not None:
            raise Error("a world with an `accept` can't be pickled: functions aren't part of a snapshot. Use save() and restore()")
        return self.dim, self.dtype.str, self._threads, self.save(), self._kept

    def __setstate__(self, state: tuple[int, str, int, bytes, list[tuple[int, int]]]) -> None:
        World.__init__(self, state[0], np.dtype(state[1]), threads=state[2], layers=state[4])
        self.restore(state[3])

    # --- Seeing inside ---

    def stats(self) -> dict[str, float]:
        """What the last update did, and what there is."""
        return self._core.stats()

    def explain(self) -> str:
        """Explains the numbers of stats() in words."""
        return self._core.explain()

    def __repr__(self) -> str:
        stats = self.stats()
        return f"World({stats['objects']} objects, {stats['resting']} at rest, {self.dim}D {self.dtype})"

    def _repr_html_(self) -> str:
        return _arrays.table(repr(self), {name: value for name, value in self.stats().items() if not name.startswith("us_")})

    @staticmethod
    def _other(other: World) -> _core.World:
        if not isinstance(other, World):
            raise Error(f"other is of the type {type(other).__name__}: it must be a World")
        return other._core

    def _boxes(self, given: Any) -> np.ndarray:
        out = _arrays.boxes(given, dtype=self.dtype)
        if out.ndim == 2 and out.shape == (2, self.dim) or out.ndim == 1 and out.shape == (2 * self.dim,):
            out = out.reshape(1, 2, self.dim)  # one box
        return out


class PairSlots:
    """Small numbers for pairs, as long as they touch: for arrays of what belongs to pairs.

        slots = jostle.PairSlots()
        world.update(); slots.update(world.began(), world.ended())      # after every update
        impulses[slots.slots_of(world.changed_pairs())]

    A pair keeps its number, its slot, from the update in which it begins to the one in which it ends. A pair that begins gets the
    least that no pair had before the update. An update that was left out is an Error that names a pair.
    """

    def __init__(self) -> None:
        self._slots = _core.PairSlots()

    def update(self, began: Any, ended: EndedPairs) -> None:
        """Gives slots to pairs that begin, and takes back those of pairs that end."""
        self._slots.update(_arrays.id_pairs(began, "began"), _arrays.id_pairs(ended.pairs, "ended"))

    def began_slots(self) -> np.ndarray:
        """The slot of each pair that began in the last update, (m,) uint32."""
        return self._slots.began_slots()

    def ended_slots(self) -> np.ndarray:
        """The slot that each pair had that ended in the last update."""
        return self._slots.ended_slots()

    def slots_of(self, pairs: Any) -> np.ndarray:
        """The slots of these pairs, (m, 2), by index; 2**32 - 1 for a pair that doesn't touch: (m,) uint32."""
        return self._slots.slots_of(_arrays.pairs(pairs))

    def end(self) -> int:
        """Every slot is less than this."""
        return self._slots.end()

    def save(self) -> bytes:
        """The pairs and their slots, to go back to together with the world."""
        return self._slots.save()

    def restore(self, saved: bytes) -> None:
        """Makes these slots the ones that were saved."""
        self._slots.restore(bytes(memoryview(saved)))

    def __repr__(self) -> str:
        return f"PairSlots(below {self.end()})"
