# SPDX-License-Identifier: MIT
"""Neighbour lists: neighbors, NeighborFinder."""
from __future__ import annotations

from typing import Any, Callable

import numpy as np

from . import _arrays, _core
from ._errors import Error

LETTERS = "ijSDdo"


def _points(given: Any, name: str) -> np.ndarray:
    out = _arrays.rows(given, name)
    if out.size == 0 and out.ndim == 1:  # an empty list
        out = out.reshape(0, 3)
    if out.ndim != 2 or out.shape[1] not in (2, 3):
        raise Error(f"{name} has the shape {out.shape}: it must be (n, 2) or (n, 3)")
    return out


def _systems(points: Any) -> tuple[Any, np.ndarray | None]:
    """The points of a list of systems in a row, and where each begins."""
    if not isinstance(points, (list, tuple)) or not points or _arrays.array(points[0]).ndim != 2:
        return points, None
    each = [_points(one, f"points[{k}]") for k, one in enumerate(points)]
    return np.concatenate(each), np.cumsum([0] + [len(one) for one in each]).astype(np.uint64)


def _cells(cell: Any, periodic: Any, dim: int, dtype: np.dtype, systems: int | None) -> tuple[np.ndarray | None, np.ndarray | None]:
    """(k, dim, dim) vectors and (k, dim) flags, k being 1 or the number of systems; or nothing for open space."""
    each = "" if systems is None else f" or ({systems}, {dim}) for the {systems} systems,"
    repeats = _arrays.array(periodic)
    if repeats.dtype.kind not in "biu" or repeats.size and not np.isin(repeats, (0, 1)).all():
        raise Error(f"periodic is {periodic!r}: it must be True or False, or one of these for each axis")
    if repeats.shape not in ((), (dim,)) and (systems is None or repeats.shape != (systems, dim)):
        raise Error(f"periodic has the shape {repeats.shape}: it must be one for all axes, or ({dim},),{each} one for each axis")
    if cell is None:
        if repeats.any():
            raise Error(f"periodic is {periodic!r}, and there is no cell")
        return None, None
    vectors = _arrays.floats(cell, "cell")
    if vectors.shape == (dim,):
        vectors = np.diag(vectors)
    if vectors.shape != (dim, dim) and (systems is None or vectors.shape != (systems, dim, dim)):
        raise Error(f"cell has the shape {vectors.shape}: it must be ({dim},), lengths, or ({dim}, {dim}), a vector in each row"
                    + ("" if systems is None else f", or ({systems}, {dim}, {dim}), such rows for each system"))
    count = systems if systems is not None and (vectors.ndim == 3 or repeats.ndim == 2) else 1
    return (np.ascontiguousarray(np.broadcast_to(vectors, (count, dim, dim)), dtype),
            np.ascontiguousarray(np.broadcast_to(repeats, (count, dim)), np.int32))


def _labels(given: Any, name: str, count: int) -> list[Any]:
    out = _arrays.array(given)
    if out.shape != (count,):
        raise Error(f"{name} has the shape {out.shape}, and there are {count} points")
    return out.tolist()


def _table(cutoff: dict[Any, Any], labels: list[Any]) -> tuple[np.ndarray, dict[Any, int]]:
    """Cutoffs by numbers, and the numbers of the labels that there are."""
    number = {label: k for k, label in enumerate(dict.fromkeys(labels))}
    table = np.zeros((len(number), len(number)))
    given: dict[tuple[Any, Any], float] = {}
    for key, value in cutoff.items():
        if not isinstance(key, tuple) or len(key) != 2:
            raise Error(f"cutoff has the key {key!r}: it must be a pair of types")
        s, t = key
        length = float(_arrays.numbers(value, f"cutoff[{key!r}]"))
        if not length >= 0:
            raise Error(f"cutoff[{key!r}] is {length}: it must be at least 0")
        if given.setdefault((t, s), length) != length:
            raise Error(f"cutoff[{key!r}] is {length}, and cutoff[{(t, s)!r}] is {given[t, s]}: give one of them, or both alike")
        given[s, t] = length
        if s in number and t in number:
            table[number[s], number[t]] = table[number[t], number[s]] = length
    return table, number


Maybe = np.ndarray | None


def _of_types(cutoff: Any, types: list[Any], names: list[str], counts: list[int]) -> tuple[np.ndarray, list[np.ndarray]]:
    """A table of cutoffs, and the numbers of the types of each set."""
    for kinds, name in zip(types, names):
        if kinds is None:
            raise Error(f"cutoff is for pairs of types, and {name} isn't given")
    if isinstance(cutoff, dict):
        labels = [_labels(*each) for each in zip(types, names, counts)]
        table, number = _table(cutoff, [label for some in labels for label in some])
        return table, [np.array([number[label] for label in some], np.uint32) for some in labels]
    table = _arrays.numbers(cutoff, "cutoff")
    if table.ndim != 2 or table.shape[0] != table.shape[1]:
        raise Error(f"cutoff has the shape {table.shape}, and types is given: it must be (k, k), one for each pair of types")
    return table, [_arrays.packed(kinds, name, np.uint32) for kinds, name in zip(types, names)]


def _radii(lengths: list[Any], names: list[str], counts: list[int]) -> list[np.ndarray]:
    """Those of each set."""
    out = [_arrays.numbers(each, name) for each, name in zip(lengths, names)]
    for each, name, count in zip(out, names, counts):
        if each.shape != (count,):
            raise Error(f"{name} has the shape {each.shape}: it must be one number for all pairs, or ({count},), one for each point, of "
                        "which a pair's cutoff is the sum", None, "size_mismatch")
    return out


def _query(points: Any, cutoff: Any, cell: Any, periodic: Any, others: Any, cutoff_b: Any, greater: bool, types: Any,
           types_b: Any, offsets: Any) -> _core.NeighborQuery:
    points, places = _systems(points)
    if offsets is not None:
        if places is not None:
            raise Error("offsets is given, and points is a list of systems already")
        places = _arrays.packed(offsets, "offsets", np.uint64)
    sets = [_points(points, "points")]
    if others is not None:
        if places is not None:
            raise Error("others is given, and there are many systems: these have one set each")
        sets.append(_points(others, "others"))
    elif cutoff_b is not None or types_b is not None:
        raise Error(f"{'types_b' if cutoff_b is None else 'cutoff_b'} is given, and there are no others")
    dtype = np.result_type(*sets)  # the wider of the two has both exactly
    sets, counts = [one.astype(dtype, copy=False) for one in sets], [len(one) for one in sets]

    value, table = 1.0, None
    radii: list[np.ndarray] = []
    numbers: list[np.ndarray] = []
    if types is not None or isinstance(cutoff, dict):
        if cutoff_b is not None:
            raise Error("cutoff_b is given, and cutoff is for pairs of types: these are those of both sets")
        table, numbers = _of_types(cutoff, [types, types_b], ["types", "types_b"][:len(sets)], counts)
    elif cutoff_b is not None or _arrays.numbers(cutoff, "cutoff").ndim:
        radii = _radii([cutoff, cutoff_b if cutoff_b is not None else cutoff], ["cutoff", "cutoff_b"][:len(sets)], counts)
    else:
        value = float(_arrays.numbers(cutoff, "cutoff"))
    if min(counts):
        value = 0.0 if radii or numbers else value
    else:  # none has neighbours, and C would take arrays without elements for none
        radii, table, numbers, greater = [], None, [], False

    def one_each(arrays: list[np.ndarray], of: Any) -> list[Maybe]:
        return [np.ascontiguousarray(one, of) for one in arrays] + [None] * (2 - len(arrays))

    dim = sets[0].shape[1]
    systems = None if places is None or places.ndim != 1 else len(places) - 1
    cells, repeats = _cells(cell, periodic, dim, dtype, systems)
    radii_a, radii_b = one_each(radii, dtype)
    numbers_a, numbers_b = one_each(numbers, np.uint32)
    return _core.NeighborQuery(_arrays.SPACES[dim, dtype], sets[0], sets[1] if len(sets) > 1 else None, places, value, radii_a,
                               radii_b, bool(greater), numbers_a, numbers_b,
                               None if table is None else np.ascontiguousarray(table, dtype), cells, repeats)


def _letters(quantities: str) -> str:
    if not isinstance(quantities, str) or not quantities or set(quantities) - set(LETTERS):
        raise Error(f"quantities is {quantities!r}: it must be some of the letters {', '.join(LETTERS)}")
    return "".join(dict.fromkeys(quantities))


def _in_order(quantities: str, found: tuple[np.ndarray, ...]) -> Any:
    """One array, or a tuple of those that the letters stand for."""
    by_letter = dict(zip(_letters(quantities), found))
    return found[0] if len(quantities) == 1 else tuple(by_letter[letter] for letter in quantities)


def neighbors(points: Any, cutoff: Any, cell: Any = None, periodic: Any = False, *, full: bool = True, quantities: str = "ij",
              others: Any = None, cutoff_b: Any = None, greater: bool = False, types: Any = None, types_b: Any = None,
              offsets: Any = None, threads: int = 0) -> Any:
    """Neighbour lists: for each point all points within a cutoff, with all of their images where space repeats itself.

        i, j = jostle.neighbors(points, 0.1)
        i, j, S, d = jostle.neighbors(atoms.positions, 6.0, atoms.cell, atoms.pbc, quantities="ijSd")

    points      (n, 2) or (n, 3) of float32 or float64; they may lie outside of the cell. Many systems: a list of such arrays
    cutoff      one number for all pairs; (n,), one for each point, of which a pair's cutoff is the sum; with `types`, (k, k)
                or {(type, type): cutoff}, where pairs that it doesn't name are none
    cell        (d,), lengths, or (d, d), a vector in each row; None: space doesn't repeat itself. Of many systems also (systems, d, d)
    periodic    whether it does along the cell's vectors: one for all, or (d,). Of many systems also (systems, d)
    full        False: each pair once, in the row of its lower point; not with `others`
    quantities  what is returned, in this order. One letter: an array. More: a tuple of arrays
        i, j    (m,) uint32: the point, ascending, and its neighbour
        S       (m, d) int32: by how many of the cell's vectors the neighbour's image is shifted
        D       (m, d) of the points' dtype, from the point to that image: points[j] - points[i] + S @ cell
        d       (m,), its length
        o       (n + 1,) int64: the neighbours of point i are j[o[i]:o[i + 1]], so that `i` isn't needed
    others      a second set: the neighbours are among these
    cutoff_b    one for each of the others, where cutoff is one for each point
    greater     True: of cutoffs of points a pair's is the greater, not the sum: who sees is seen
    types       one for each point: numbers below k for a table, anything for a dict; `types_b` those of the others
    offsets     many systems in one array: (systems + 1,), system k has the points from offsets[k] to offsets[k + 1] - 1. All points
                are numbered in a row, in the list as well
    threads     0 for one per core

    Neighbours are those at |D|^2 <= cutoff^2 in the points' dtype, to which cell and cutoffs are rounded: neighbors.hpp says it
    exactly. A point isn't its own neighbour; its images may be. Rows ascend by j, then by S. The arrays are the library's own
    memory, without a copy. Ctrl-C ends the call. A NeighborFinder keeps its memory, and a list for several steps.
    """
    wish = _query(points, cutoff, cell, periodic, others, cutoff_b, greater, types, types_b, offsets)
    return _in_order(quantities, _core.neighbors(wish, bool(full), _letters(quantities), _arrays.threads(threads)))


class NeighborFinder:
    """neighbors for steps of a simulation: a finder keeps its memory from one search to the next.

        finder = jostle.NeighborFinder(skin=0.3)
        for step in range(1000):
            i, j, D = finder.find(points, 6.0, cell, True, quantities="ijD")

    skin        if above 0, a search looks this much further than the cutoff and keeps what it finds. Later calls choose from that, and
                don't search, while no point has moved half as far and nothing else has changed. The lists are the same as without.
                Not for many systems
    threads     0 for one per core

    Use a finder for one call at a time: another call meanwhile, by a thread, is an Error.
    """

    def __init__(self, *, skin: float = 0.0, threads: int = 0) -> None:
        self._finder = _core.NeighborFinder(float(skin), _arrays.threads(threads))

    def find(self, points: Any, cutoff: Any, cell: Any = None, periodic: Any = False, *, full: bool = True, quantities: str = "ij",
             others: Any = None, cutoff_b: Any = None, greater: bool = False, types: Any = None, types_b: Any = None,
             offsets: Any = None) -> Any:
        """As neighbors: arrays which the caller owns, copied from the finder's."""
        wish = _query(points, cutoff, cell, periodic, others, cutoff_b, greater, types, types_b, offsets)
        return _in_order(quantities, self._finder.find(wish, bool(full), _letters(quantities)))

    def stream(self, points: Any, cutoff: Any, visit: Callable[..., Any], cell: Any = None, periodic: Any = False, *,
               rows: int = 65536, full: bool = True, quantities: str = "ij", others: Any = None, cutoff_b: Any = None,
               greater: bool = False, types: Any = None, types_b: Any = None) -> bool:
        """Hands over the list that find() returns in blocks, for one that memory doesn't hold: calls visit(first, *arrays) with the
        neighbours of the points from `first` on, `rows` points at a time. `o` counts within the block, `i` and `j` are as in find().
        visit returns None or True to go on, False to stop. Returns whether it was never stopped. Not with a skin, nor for many
        systems. Blocks of fewer than a tenth of the points take longer, unless points near to each other have numbers near to each
        other: see spatial_order."""
        if _arrays.whole(rows, "rows", 2**63) < 1:
            raise Error(f"rows is {rows}: it must be at least 1")
        if not callable(visit):
            raise Error(f"visit is {visit!r}: it must be a function")
        wish = _query(points, cutoff, cell, periodic, others, cutoff_b, greater, types, types_b, None)
        letters = _letters(quantities)

        def take(first: int, found: tuple[np.ndarray, ...]) -> Any:
            by_letter = dict(zip(letters, found))
            return visit(first, *(by_letter[letter] for letter in quantities))

        return self._finder.stream(wish, bool(full), letters, rows, take)

    @property
    def searched(self) -> bool:
        """False if the last call found the list that the skin had kept to be enough."""
        return self._finder.searched()

    def release_memory(self) -> None:
        """Gives back the memory that it keeps, and what the skin has kept."""
        self._finder.release_memory()

    def __copy__(self) -> NeighborFinder:
        raise TypeError("a NeighborFinder can't be copied: make another one")
