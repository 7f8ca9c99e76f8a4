# SPDX-License-Identifier: MIT
"""Atoms with ASE: copper that vibrates, with ASE's neighbour lists and with Jostle's. One line differs; the energies don't."""
import time

try:
    import ase
except ImportError:
    raise SystemExit("this example needs ASE (Debian: python3-ase)")
import ase.build
import ase.calculators.emt
import ase.neighborlist
import ase.units
import numpy as np
from ase.md.velocitydistribution import MaxwellBoltzmannDistribution
from ase.md.verlet import VelocityVerlet

import jostle.ase


def energies(neighbor_list_class):
    ase.calculators.emt.NeighborList = neighbor_list_class  # the line: EMT takes the list that it finds by this name
    atoms = ase.build.bulk("Cu", cubic=True) * (3, 3, 3)
    atoms.set_cell(atoms.cell.array @ [[1, 0.05, 0], [0, 1, 0.03], [0, 0, 1]], scale_atoms=True)  # skewed
    atoms.calc = ase.calculators.emt.EMT()
    MaxwellBoltzmannDistribution(atoms, temperature_K=600, rng=np.random.RandomState(1))
    molecular_dynamics = VelocityVerlet(atoms, 4 * ase.units.fs)
    told = []
    molecular_dynamics.attach(lambda: told.append((atoms.get_potential_energy(), atoms.get_kinetic_energy())))
    molecular_dynamics.run(15)
    return np.array(told), atoms


theirs, _ = energies(ase.neighborlist.NeighborList)
ours, atoms = energies(jostle.ase.NeighborList)
np.testing.assert_allclose(ours, theirs, rtol=1e-9)
total = ours.sum(axis=1)
assert np.ptp(total) < 0.01 * np.ptp(ours[:, 0])

begin = time.perf_counter()
expected = ase.neighborlist.neighbor_list("ijd", atoms, 6.0)
between = time.perf_counter()
found = jostle.ase.neighbor_list("ijd", atoms, 6.0)
end = time.perf_counter()
assert sorted(zip(found[0], found[1], found[2].round(9))) == sorted(zip(expected[0], expected[1], expected[2].round(9)))
print(f"{len(atoms)} atoms, total energy {total[-1]:.6f} eV with either list; {len(found[0])} neighbours within 6 A: "
      f"ASE {1e3 * (between - begin):.0f} ms, Jostle {1e3 * (end - between):.1f} ms")
