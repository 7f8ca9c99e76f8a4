# SPDX-License-Identifier: MIT
"""The neighbour lists of ASE, found by this library: the calls and the results of ase.neighborlist (3.22), in a fraction of the time.

    from jostle.ase import NeighborList, neighbor_list      # instead of: from ase.neighborlist import ...

ASE isn't imported: whatever has `positions`, `cell`, `pbc` and `numbers` will do. As in ASE, a pair counts where its distance is
below its cutoff, and not where it equals it, as neighbors() has it. Lists come sorted by i, then by j and shift.
"""
from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import Error
from ._neighbors import neighbors

__all__ = ["NeighborList", "neighbor_list"]

_BELOW = 1 - 2.0**-51  # lowers a cutoff, or the rounded sum of two radii, by one last place at least


def _space(atoms: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return (np.array(atoms.positions, np.float64), np.array(atoms.cell, np.float64),
            np.array(np.broadcast_to(np.asarray(atoms.pbc, bool), 3)))


def _by_number(cutoff: dict[Any, Any], atoms: Any) -> dict[tuple[int, int], float]:
    """The cutoffs of pairs of elements that are there, by their numbers; keys may also be symbols."""
    numbers = np.asarray(atoms.numbers).tolist()
    known = {number: number for number in numbers}
    if any(isinstance(kind, str) for pair in cutoff for kind in pair):
        known.update(zip(atoms.get_chemical_symbols(), numbers))
    table = {}
    for (s, t), length in cutoff.items():
        if s in known and t in known:
            table[min(known[s], known[t]), max(known[s], known[t])] = float(length)  # of two the last, as in ASE
    return table


def _with_themselves(found: dict[str, np.ndarray], own: np.ndarray) -> dict[str, np.ndarray]:
    """A list with each atom of `own` as its own neighbour, before its others."""
    order = np.argsort(np.concatenate([own, found["i"]]), kind="stable")
    return {letter: np.concatenate([own if letter in "ij" else np.zeros((len(own), *values.shape[1:]), values.dtype), values])[order]
            for letter, values in found.items()}


def neighbor_list(quantities: str, a: Any, cutoff: Any, self_interaction: bool = False, max_nbins: float = 1e6, *,
                  threads: int = 0) -> Any:
    """As ase.neighborlist.neighbor_list: all neighbours of all atoms, each pair from both sides.

    quantities        letters of what is returned: i and j, the atoms, S, the shift, D, the vector, d, the distance
    a                 the atoms
    cutoff            one for all pairs; one for each atom, of which a pair's cutoff is the sum; or {(element, element): cutoff}, by
                      symbol or number
    self_interaction  lists each atom as its own neighbour as well
    max_nbins         isn't needed, and not read
    threads           0 for one per core

    Whole numbers are int64, as in ASE.
    """
    if set(quantities) - set("ijSDd"):
        raise Error(f"quantities is {quantities!r}: it must be some of the letters i, j, S, D, d")
    positions, cell, pbc = _space(a)
    letters = "".join(dict.fromkeys("i" + quantities))
    if isinstance(cutoff, dict):
        table = _by_number(cutoff, a)
        reach: Any = {pair: length * _BELOW for pair, length in table.items()}
        own = np.array([table.get((number, number), 0.0) for number in np.asarray(a.numbers).tolist()])
        more = dict(types=a.numbers)
        some = any(length > 0 for length in table.values())
    else:
        reach = np.asarray(cutoff, np.float64) * _BELOW
        own = np.broadcast_to(reach, len(positions))
        more, some = {}, bool((reach != 0).any())
    if some:
        found = neighbors(positions, reach, cell, pbc, quantities=letters + "i", threads=threads, **more)
    else:  # ASE finds none then
        found = neighbors(positions[:0], 1.0, quantities=letters + "i")
    by_letter = {letter: values.astype(np.int64) if letter in "ijS" else values for letter, values in zip(letters, found)}
    if self_interaction:
        by_letter = _with_themselves(by_letter, np.flatnonzero(own > 0))
    told = tuple(by_letter[letter] for letter in quantities)
    return told[0] if len(told) == 1 else told


class NeighborList:
    """As ase.neighborlist.NeighborList: a list that is made again when an atom has moved further than the skin.

        nl = jostle.ase.NeighborList([1.5] * len(atoms), self_interaction=False, bothways=True)
        nl.update(atoms)
        indices, offsets = nl.get_neighbors(0)

    cutoffs           a radius for each atom: of a pair's, with the skin, the sum counts
    skin              by how much each radius is enlarged, and how far an atom may move
    sorted            isn't needed: neighbours ascend. With `bothways`, ASE's default then lists a pair twice for its lower atom
                      and not for the other; here it is listed for both all the same
    self_interaction  lists each atom as its own neighbour as well
    bothways          lists each pair for both of its atoms; else once, for the lower one
    primitive         isn't needed, and not read
    threads           0 for one per core
    """

    def __init__(self, cutoffs: Any, skin: float = 0.3, sorted: bool = False, self_interaction: bool = True,
                 bothways: bool = False, primitive: Any = None, *, threads: int = 0) -> None:
        self.cutoffs = np.asarray(cutoffs, np.float64) + skin
        self.skin, self.sorted, self.self_interaction, self.bothways = skin, sorted, self_interaction, bothways
        self.nupdates, self._threads = 0, threads
        self._space: tuple[np.ndarray, np.ndarray, np.ndarray]  # of the last list

    def update(self, atoms: Any) -> bool:
        """Makes the list again if needed, and returns whether it did."""
        space = _space(atoms)
        if self.nupdates and len(space[0]) == len(self._space[0]) and all(map(np.array_equal, space[1:], self._space[1:])):
            moved = ((space[0] - self._space[0])**2).sum(axis=1)
            if moved.max(initial=0) <= self.skin**2:
                return False
        positions, cell, pbc = space
        if self.cutoffs.shape != (len(positions),):
            raise Error(f"cutoffs has the shape {self.cutoffs.shape}, and there are {len(positions)} atoms", None, "size_mismatch")
        if (self.cutoffs != 0).any():
            i, j, shifts, first = neighbors(positions, self.cutoffs * _BELOW, cell, pbc, full=self.bothways, quantities="ijSo",
                                            threads=self._threads)
        else:
            i, j, shifts = neighbors(positions[:0], 1.0, quantities="ijS")
            first = np.zeros(len(positions) + 1, np.int64)
        found = {"i": i, "j": j.astype(np.int64), "S": shifts.astype(np.int64)}
        sides = 2 if self.bothways else 1
        self.nneighbors, self.npbcneighbors = len(j) // sides, int(shifts.any(axis=1).sum()) // sides
        if self.self_interaction:
            own = np.flatnonzero(self.cutoffs > 0)
            found = _with_themselves(found, own)
            first = first + np.searchsorted(own, np.arange(len(first)))
            self.nneighbors += len(own)
        self._found, self._first, self._space = found, first, space
        self.nupdates += 1
        return True

    def _want_update(self) -> None:
        if not self.nupdates:
            raise RuntimeError("Must call update(atoms) on your neighborlist first!")

    def get_neighbors(self, a: int) -> tuple[np.ndarray, np.ndarray]:
        """The neighbours of atom `a`, and their shifts: neighbour k is at positions[indices[k]] + offsets[k] @ cell."""
        self._want_update()
        a = range(len(self.cutoffs))[a]
        row = slice(self._first[a], self._first[a + 1])
        return self._found["j"][row], self._found["S"][row]

    def get_connectivity_matrix(self, sparse: bool = True) -> Any:
        """1 where the atom of the row has that of the column as a neighbour: a matrix of SciPy, or of NumPy."""
        self._want_update()
        rows, columns = np.unique(np.stack([self._found["i"], self._found["j"]]).astype(np.int64), axis=1)
        shape = (len(self.cutoffs), len(self.cutoffs))
        if sparse:
            from scipy.sparse import coo_matrix
            return coo_matrix((np.ones(len(rows), np.int8), (rows, columns)), shape).todok()
        matrix = np.zeros(shape, np.int8)
        matrix[rows, columns] = 1
        return matrix

    @property
    def nl(self) -> NeighborList:
        """What ASE's functions ask for the list."""
        return self
