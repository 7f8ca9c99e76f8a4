# SPDX-License-Identifier: MIT
"""jostle.ase: as sets what ase.neighborlist says, and in its calculators."""
import itertools
import subprocess
import sys

import numpy as np
import pytest

import jostle
from jostle.ase import NeighborList, neighbor_list

ase = pytest.importorskip("ase")
import ase.build  # noqa: E402
from ase import neighborlist as theirs  # noqa: E402

ALL_PBC = list(itertools.product((False, True), repeat=3))


def some_atoms(rng, pbc, n=None):
    size = rng.choice([2.0, 4, 7])
    cell = np.diag(rng.uniform(0.7, 1.4, 3)) * size
    if rng.random() < 0.7:  # triclinic
        cell = cell + rng.uniform(-0.35, 0.35, (3, 3)) * size
    count = int(rng.integers(1, 14)) if n is None else n
    return ase.Atoms(rng.choice(["H", "C", "O"], count), rng.uniform(-size, 2 * size, (count, 3)), cell=cell, pbc=pbc)


def as_set(i, j, shifts):
    listed = [(int(a), int(b), *map(int, s)) for a, b, s in zip(i, j, shifts)]
    assert len(set(listed)) == len(listed)
    return set(listed)


def lists_of(nl, count):
    """(i, j, S) in the direction in which j is not below i; of two that are opposite each other one."""
    found = set()
    for i in range(count):
        for j, shift in zip(*nl.get_neighbors(i)):
            back = tuple(int(-s) for s in shift)
            found.add(min((i, int(j), *map(int, shift)), (int(j), i, *back)))
    return found


@pytest.mark.parametrize("pbc", ALL_PBC)
def test_neighbor_list_is_that_of_ase(pbc):
    rng = np.random.default_rng(sum(2**k for k in range(3) if pbc[k]))
    some = 0
    for case in range(25):
        atoms = some_atoms(rng, pbc)
        radii = rng.uniform(0.2, 1.7, len(atoms))
        for cutoff in (1.7, 3.1, radii, radii.tolist(), {("H", "H"): 1.1, ("C", "H"): 2.5, ("O", "O"): 1.9},
                       {(1, 1): 1.1, ("C", 1): 2.5, (8, 8): 3.3, ("O", "Fe"): 3.0}):
            for own in (False, True):
                mine = neighbor_list("ijS", atoms, cutoff, own)
                other = theirs.neighbor_list("ijS", atoms, np.asarray(cutoff) if isinstance(cutoff, list) else cutoff, own)
                assert as_set(*mine) == as_set(*other), (case, cutoff)
                some += len(mine[0])
                assert (np.diff(mine[0]) >= 0).all() and [one.dtype for one in mine] == [one.dtype for one in other]
        d, i, D, j, S = neighbor_list("diDjS", atoms, 2.5)
        np.testing.assert_allclose(D, atoms.positions[j] - atoms.positions[i] + S @ atoms.cell.array, atol=1e-12)
        np.testing.assert_allclose(d, np.linalg.norm(D, axis=1), atol=1e-12)
    assert some > 1000


@pytest.mark.parametrize("pbc", ALL_PBC)
@pytest.mark.parametrize("primitive", (theirs.PrimitiveNeighborList, theirs.NewPrimitiveNeighborList))
def test_neighborlist_is_that_of_ase(pbc, primitive):
    rng = np.random.default_rng(sum(2**k for k in range(3) if pbc[k]))
    some = 0
    for case in range(8):
        atoms = some_atoms(rng, pbc)
        radii = rng.uniform(0.2, 1.2, len(atoms))
        for bothways, own in itertools.product((False, True), repeat=2):
            wish = dict(skin=0.2, sorted=bool(case % 2), self_interaction=own, bothways=bothways)
            mine, other = NeighborList(radii, **wish), theirs.NeighborList(radii, primitive=primitive, **wish)
            walk = atoms.copy()
            for step in range(6):
                assert mine.update(walk) == other.update(walk) and mine.nupdates == other.nupdates
                found = lists_of(mine, len(walk))
                assert found == lists_of(other, len(walk)), (case, wish)
                some += len(found)
                listed = [(i, int(j), *map(int, s)) for i in range(len(walk)) for j, s in zip(*mine.get_neighbors(i))]
                assert len(set(listed)) == len(listed) == len(found) * (2 if bothways else 1) - (own and bothways) * len(walk)
                assert all(one.dtype == np.int64 for one in mine.get_neighbors(0))
                if primitive is theirs.PrimitiveNeighborList:
                    assert (mine.nneighbors, mine.npbcneighbors) == (other.nneighbors, other.npbcneighbors)
                if bothways and not (wish["sorted"] and primitive is theirs.PrimitiveNeighborList):  # then it has pairs once, but twice
                    expected = other.get_connectivity_matrix(sparse=False)
                    for matrix in (mine.get_connectivity_matrix(False), mine.get_connectivity_matrix().toarray(),
                                   theirs.get_connectivity_matrix(mine.nl, sparse=False)):
                        assert matrix.dtype == np.int8 and np.array_equal(matrix, expected)
                walk.positions += rng.uniform(-0.07, 0.07, walk.positions.shape)
                if step == 3:
                    walk.set_cell(walk.cell.array * 1.01)
            assert 2 <= mine.nupdates < 6
    assert some > 300


def test_a_distance_that_is_the_cutoff_is_none():
    for step in (1.0, 0.1, 3.6, 1 / 3):
        cubic = ase.Atoms("X4", np.arange(4)[:, None] * [step, 0, 0], cell=[4 * step] * 3, pbc=True)
        for atoms in (cubic, cubic.repeat((1, 2, 2))):
            for cutoff in (step, np.full(len(atoms), step / 2), {("X", "X"): step}):
                assert len(neighbor_list("i", atoms, cutoff)) == 0
            assert len(neighbor_list("i", atoms, step * (1 + 1e-12))) >= 2 * len(atoms)
    line = ase.Atoms("X2", [[0, 0, 0], [1, 0, 0]])
    for a in (1e-3, 0.1, 1 / 3, 0.5, 0.9):
        assert len(neighbor_list("i", line, [a, 1 - a])) == len(theirs.neighbor_list("i", line, np.array([a, 1 - a]))) == 0


def test_atoms_without_neighbours_and_no_atoms():
    atoms = ase.Atoms("HC", [[0, 0, 0], [0.1, 0, 0]])
    for cutoff in (0, 0.0, [0, 0], {}, {("O", "O"): 3}, {("H", "C"): 0}):
        assert [one.shape for one in neighbor_list("ijSDd", atoms, cutoff)] == [(0,), (0,), (0, 3), (0, 3), (0,)]
    nl = NeighborList([0, 0], skin=0, self_interaction=False)
    assert nl.update(atoms) and not nl.update(atoms) and len(nl.get_neighbors(1)[0]) == 0
    none = atoms[:0]
    assert len(neighbor_list("i", none, 2.0)) == 0 and len(neighbor_list("i", none, [])) == 0
    empty = NeighborList([])
    assert empty.update(none) and not empty.update(none)


def test_mistakes_are_named():
    atoms = ase.Atoms("HC", [[0, 0, 0], [0.1, 0, 0]])
    with pytest.raises(ValueError, match="quantities is 'ix'"):
        neighbor_list("ix", atoms, 1.0)
    with pytest.raises(jostle.Error, match=r"cutoffs has the shape \(3,\), and there are 2 atoms"):
        NeighborList([1.0, 1, 1]).update(atoms)
    with pytest.raises(jostle.Error, match="cutoff"):
        neighbor_list("i", atoms, -1.0)
    with pytest.raises(RuntimeError, match="Must call update"):
        NeighborList([1.0, 1]).get_neighbors(0)
    with pytest.raises(RuntimeError, match="Must call update"):
        NeighborList([1.0, 1]).get_connectivity_matrix()
    nl = NeighborList([1.0, 1])
    nl.update(atoms)
    assert np.array_equal(nl.get_neighbors(-2)[0], nl.get_neighbors(0)[0])
    with pytest.raises(IndexError):
        nl.get_neighbors(2)
    with pytest.raises(jostle.Error):
        nl.update(ase.Atoms("HC", [[0, 0, 0], [np.nan, 0, 0]]))
    assert nl.nupdates == 1 and not nl.update(atoms)


@pytest.mark.parametrize("pbc", (True, False, (True, False, True)))
def test_calculators_of_ase_have_the_same_energies_and_forces(monkeypatch, pbc):
    from ase.calculators import emt, lj, morse

    atoms = ase.build.bulk("Cu", cubic=True) * (2, 3, 2)
    atoms.set_cell(atoms.cell.array @ [[1, 0.1, 0], [0, 1, 0], [0, 0.05, 1]], scale_atoms=True)
    atoms.pbc = pbc
    atoms.rattle(0.1, seed=1)

    def told(calculator):
        atoms.calc = calculator
        return np.concatenate([[atoms.get_potential_energy()], atoms.get_forces().ravel()])

    make = (emt.EMT, lambda: lj.LennardJones(sigma=2.3, epsilon=0.4, rc=5.5), lambda: morse.MorsePotential(r0=2.6, epsilon=0.3))
    expected = [told(one()) for one in make]
    for module in (emt, lj):
        monkeypatch.setattr(module, "NeighborList", NeighborList)
    monkeypatch.setattr(morse, "neighbor_list", neighbor_list)
    for one, numbers in zip(make, expected):
        np.testing.assert_allclose(told(one()), numbers, rtol=1e-9, atol=1e-9)


def test_ase_is_not_imported():
    code = """
import sys, types, numpy as np, jostle.ase
atoms = types.SimpleNamespace(positions=[[0, 0, 0], [0.5, 0, 0]], cell=np.eye(3), pbc=True, numbers=[1, 6])
assert len(jostle.ase.neighbor_list("i", atoms, 0.6)) == 4 and len(jostle.ase.neighbor_list("i", atoms, {(1, 6): 0.6})) == 4
assert jostle.ase.NeighborList([1, 1]).update(atoms)
assert "ase" not in sys.modules and "scipy" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)
