# SPDX-License-Identifier: MIT
"""Interference check of an assembly: which parts, each a triangle mesh, cut into which."""
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
pairs = jostle.find_pairs(jostle.bounds(shapes, poses), order="sorted")
cut = jostle.touching(shapes, poses, pairs)
names = list(parts)
for (a, b), touches in zip(pairs, cut):
    print(f"{names[a]} and {names[b]}: {'interfere' if touches else 'fit'}")
assert [(names[a], names[b]) for a, b in pairs[cut]] == [("sleeve", "thick pin")]
