# SPDX-License-Identifier: MIT
"""Interference and clearance of an assembly: which parts, each a triangle mesh, cut into which, and which are too near each other."""
import numpy as np

import jostle


def tube(radius: float, length: float, sides: int = 24) -> tuple[np.ndarray, np.ndarray]:
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(angle) * radius, np.sin(angle) * radius], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, length)])
    k = np.arange(sides)
    after = (k + 1) % sides
    return vertices, np.concatenate([np.column_stack([k, after, k + sides]), np.column_stack([after, after + sides, k + sides])])


# A shaft in a sleeve with play, a pin that is too thick for its sleeve, and one that is far away.
parts = {"sleeve": tube(1.0, 4), "shaft": tube(0.9, 6), "thick pin": tube(1.05, 2), "spare": tube(1.0, 4)}
places = np.array([[0, 0, 0], [0.02, 0, -1], [0.1, 0, 1], [9, 0, 0]], float)
shapes = jostle.Shapes([jostle.mesh(*part) for part in parts.values()])
poses = jostle.poses(places)
clearance = 0.1
pairs = jostle.find_pairs(jostle.bounds(shapes, poses, clearance / 2), order="sorted")  # boxes that are no further apart
cut = jostle.touching(shapes, poses, pairs)
gaps = jostle.distances(shapes, poses, pairs, max_distance=clearance)["distance"]  # infinite beyond
names = list(parts)
told = []
for (a, b), touches, gap in zip(pairs, cut, gaps):
    how = "interfere" if touches else f"are {gap:.3f} apart" if gap < clearance else "fit"
    told.append((names[a], names[b], how))
    print(*told[-1][:2], how)
assert told == [("sleeve", "shaft", "are 0.079 apart"), ("sleeve", "thick pin", "interfere"), ("shaft", "thick pin", "are 0.069 apart")]
