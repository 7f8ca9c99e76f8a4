# SPDX-License-Identifier: MIT
"""DEM particles: spheres that fall onto a floor and push each other away. Pairs, contacts and sums over arrays; no loop over
particles anywhere."""
import numpy as np

import jostle

rng = np.random.default_rng(2)
n, radius, step = 500, 0.5, 0.004
grid = np.stack(np.meshgrid(range(5), range(20), range(5), indexing="ij"), axis=-1).reshape(-1, 3)
at = grid * 1.1 + 0.7 + rng.random((n, 3)) * 0.05
speed = np.zeros((n, 3))
shapes = jostle.Shapes.spheres(np.full(n, radius))
finder = jostle.ContactFinder(3, np.float64)

for frame in range(250):
    poses = jostle.poses(at)
    contacts = finder.find(shapes, poses, jostle.find_pairs(jostle.bounds(shapes, poses)))
    a, b = contacts["pair"].T
    approach = ((speed[b] - speed[a]) * contacts["normal"]).sum(axis=1)
    push = np.maximum(0, 3000 * contacts["point"]["depth"][:, 0] - 15 * approach)[:, None] * contacts["normal"]
    force = jostle.sum_by_object(np.concatenate([a, b]), np.concatenate([-push, push]), n)
    force[:, 1] += 3000 * np.maximum(0, radius - at[:, 1]) - 15 * np.where(at[:, 1] < radius, speed[:, 1], 0)  # the floor
    wall = np.maximum(0, radius - at[:, [0, 2]]) - np.maximum(0, at[:, [0, 2]] - (6 - radius))
    force[:, [0, 2]] += 3000 * wall
    speed = 0.999 * speed + step * (force + [0, -9.81, 0])
    at = at + step * speed

print(f"{n} particles, {len(contacts)} contacts, the highest at {at[:, 1].max():.1f}")
assert at[:, 1].min() > -0.5 and np.isfinite(at).all() and len(contacts) > 100
