# SPDX-License-Identifier: MIT
"""Neighbours in a crowd: who is within two metres of whom, frame by frame."""
import numpy as np

import jostle

rng = np.random.default_rng(3)
at = rng.random((5000, 2)) * 300
heading = rng.random(5000) * 2 * np.pi
for frame in range(20):
    pairs = jostle.join(at, 1.0)  # spheres of one metre each that touch
    a, b = pairs.T
    apart = at[b] - at[a]
    apart /= np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-9)
    away = jostle.sum_by_object(np.concatenate([a, b]), np.concatenate([-apart, apart]), len(at))
    at = at + 0.1 * (np.column_stack([np.cos(heading), np.sin(heading)]) + away)
print(f"{len(at)} people, {len(pairs)} pairs within two metres")
assert len(pairs) > 100
