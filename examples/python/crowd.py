# SPDX-License-Identifier: MIT
"""Neighbours in a crowd: who is within two metres of whom, frame by frame."""
import numpy as np

import jostle

rng = np.random.default_rng(3)
at = rng.random((5000, 2)) * 300
heading = rng.random(5000) * 2 * np.pi
for frame in range(20):
    i, apart, d = jostle.neighbors(at, 2.0, quantities="iDd")  # each pair from both sides
    away = jostle.sum_by_object(i, -apart / np.maximum(d, 1e-9)[:, None], len(at))
    at = at + 0.1 * (np.column_stack([np.cos(heading), np.sin(heading)]) + away)
print(f"{len(at)} people, {len(i) // 2} pairs within two metres")
assert len(i) > 200
