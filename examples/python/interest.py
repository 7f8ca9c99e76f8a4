# SPDX-License-Identifier: MIT
"""Interest management: each player is told of what comes into view and of what leaves it, and of nothing else."""
import numpy as np

import jostle

rng = np.random.default_rng(4)
PLAYER, THING = 1, 2
world = jostle.World(2, np.float32)
square = lambda centers, half: np.stack([centers - half, centers + half], axis=1).astype(np.float32)
player_at, thing_at = rng.random((200, 2)) * 1000, rng.random((5000, 2)) * 1000
players = world.add(square(player_at, 40), category=PLAYER, mask=THING)  # what a player sees is a box
things = world.add(square(thing_at, 0.5), category=THING, mask=PLAYER)
world.update()
entered = left = 0
for frame in range(30):
    player_at = player_at + rng.normal(0, 3, player_at.shape)
    world.update(players, square(player_at, 40))
    entered, left = entered + len(world.began()), left + len(world.ended().pairs)
print(f"{entered} things came into view, {left} left; {len(world.pairs())} are seen now")
assert entered > 1000 and left > 1000
