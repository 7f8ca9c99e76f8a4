# SPDX-License-Identifier: MIT
"""Ctrl-C soon ends long calls, and leaves their objects unchanged."""
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import jostle

CROWD = """
import numpy as np, jostle
boxes = np.zeros((120_000, 2, 3)); boxes[:, 1] = 1   # all of them touch: 7 billion pairs
world, index = jostle.World(3), jostle.BoxIndex(boxes)
apart = np.arange(20_000.0)[:, None, None] * np.ones((1, 2, 3))
crowded, scenes = np.concatenate([apart, boxes]), np.append(np.arange(20_001), 140_000)   # one scene has all of it
grains = jostle.Surface(np.arange(120_000).reshape(-1, 3))
again = lambda: (len(world), len(index))
"""

SHAPES = """
import numpy as np, jostle
rng = np.random.default_rng(1)

def sphere(points):
    corners = rng.normal(size=(points, 3))
    return corners / np.linalg.norm(corners, axis=1, keepdims=True)

n = 2_000
poses = jostle.poses(rng.random((n, 3)) * 3)
shapes = jostle.Shapes.same(jostle.hull(sphere(60)), n)
motions = np.concatenate([poses, np.full((n, 6), 0.5)], axis=1)
pairs = np.stack(np.triu_indices(n, 1), axis=1).astype(np.uint32)    # 2 million, each of some microseconds
pairs = np.concatenate([pairs] * 10)
finder = jostle.ContactFinder(3, np.float64)

# Two surfaces that nearly touch, everywhere.
turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, 41)[:-1], np.linspace(0.1, np.pi - 0.1, 20), indexing="ij")
shell = np.stack([np.sin(rise) * np.cos(turn), np.cos(rise), np.sin(rise) * np.sin(turn)], axis=-1).reshape(-1, 3)
at = np.arange(800).reshape(40, 20)
beside = np.roll(at, -1, axis=0)
corners = [at[:, :-1], beside[:, :-1], at[:, 1:], at[:, 1:], beside[:, :-1], beside[:, 1:]]
triangles = np.stack(corners, axis=-1).reshape(-1, 3)
shells = jostle.Shapes([jostle.mesh(shell, triangles), jostle.mesh(shell * 1.001, triangles)])
still = jostle.poses(np.zeros((2, 3)))
same_pair = np.tile(np.array([[0, 1]], np.uint32), (100_000, 1))

many = 2_000_000
boxes = jostle.bounds(shapes, poses)
index, world = jostle.BoxIndex(boxes), jostle.World()
world.add(boxes)
world.update()
rays = jostle.rays(rng.random((many, 3)) * 3, rng.normal(size=(many, 3)), 10)
some = jostle.Shapes.same(jostle.hull(sphere(60)), many)
starts = jostle.poses(rng.random((many, 3)) * 3)
sweeps = jostle.shape_sweeps(some, starts, rng.normal(size=(many, 3)))
round_shapes = jostle.Shapes.same(jostle.hull(sphere(2_000)), n)
round_hull = jostle.Shapes.same(jostle.hull(sphere(2_000)), many)
cube = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T.astype(float)
sides = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
         [1, 5, 7], [1, 7, 3]]
solid = jostle.ClosedMesh(jostle.mesh(np.concatenate([cube + [2.0 * k, 0, 0] for k in range(500)]),
                                      np.concatenate([np.array(sides) + 8 * k for k in range(500)])))
points = rng.random((many, 3)) * [1000, 1, 1]
ball = sphere(60_000)
small = np.array([[0, 1]], np.uint32)
def again():
    return (finder.distances(shapes, poses, small), index.first(jostle.rays([[0, 0, 0]], [[1, 1, 1]])).ids, len(world.pairs()),
            solid.contains(points[:10]))
"""

NUMBERS = """
import numpy as np, jostle
objects, values = np.zeros(1_000_000_000, np.uint32), np.zeros(1_000_000_000, np.float32)
again = lambda: jostle.sum_by_object([0, 2], [1.0, 2.0], 3)
"""

LONG = """
before = again()
print("begun", flush=True)
try:
    {call}
except KeyboardInterrupt:
    assert all(np.array_equal(a, b) for a, b in zip(before, again()))    # it goes on
    print("interrupted")
"""

CALLS = {
    CROWD: """
jostle.find_pairs(boxes)
jostle.find_pairs(boxes, boxes, order="sorted")
jostle.find_periodic_pairs(boxes, [10, 0, 0])
jostle.find_scenes(crowded, scenes)
jostle.join(boxes[:, 0], 1)
jostle.neighbors(boxes[:, 0], 1)
jostle.NeighborFinder(skin=1).find(boxes[:, 0], 1, [8, 8, 8], True)
jostle.SurfaceFinder().near(grains, boxes[:, 0], 1)
for part in jostle.iter_pairs(boxes): pass
world.update(world.add(boxes), boxes)
index.join(boxes)
index.count(boxes, accept=None, exclude=0)
index.all(jostle.nearest(boxes[:, 0], 100))
index.pairs()
index.closest_pairs(10**9)
""",
    SHAPES: """
finder.find(shapes, poses, pairs)
finder.find_points(shapes, poses, pairs)
finder.touching(shapes, poses, pairs)
finder.distances(shapes, poses, pairs)
finder.impacts(shapes, motions, pairs)
finder.ray_casts(jostle.rays(np.zeros((n, 3)), np.ones((n, 3)), 10), shapes, poses, pairs)
finder.shape_casts(shapes, poses, np.ones((n, 3)), shapes, poses, pairs)
jostle.ContactFinder(3, np.float64, threads=1).distances(shapes, poses, pairs)
finder.first_touching(shells, still, same_pair, np.arange(len(same_pair) + 1))
finder.first_touching(shells, still, same_pair, [0, 0, len(same_pair)])
finder.least_distances(shapes, poses, pairs, np.arange(0, len(pairs) + 1, 10))
finder.least_distances(shells, still, same_pair, [0, 0, len(same_pair)])
index.first(rays, round_shapes, poses)
index.first(sweeps, shapes, poses)
index.all(rays, shapes, poses)
index.first(jostle.nearest_to_shapes(some, starts), shapes, poses)
world.first(rays, round_shapes, poses)
world.all(sweeps, shapes, poses)
world.first(jostle.nearest_to_shapes(some, starts), shapes, poses)
solid.contains(points)
solid.signed_distances(points)
solid.winding_numbers(points)
jostle.bounds(round_hull, starts)
jostle.hull(ball)
""",
    NUMBERS: """
jostle.sum_by_object(objects, values, 1)
""",
}


@pytest.mark.parametrize("before,call", [
    pytest.param(before, call, id=call) for before, calls in CALLS.items() for call in calls.strip().splitlines()])
def test_ctrl_c_ends_a_long_call(before, call):
    child = subprocess.Popen([sys.executable, "-c", before + LONG.format(call=call)], stdout=subprocess.PIPE, text=True,
                             preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
    assert child.stdout.readline() == "begun\n"
    time.sleep(0.1)
    # Seconds of the processor's: others may be at work on this machine.
    used = sum(map(int, open(f"/proc/{child.pid}/stat").read().rpartition(")")[2].split()[11:13])) / os.sysconf("SC_CLK_TCK")
    child.send_signal(signal.SIGINT)
    told = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = status
    assert told == "interrupted\n" and status == 0
    # To the end, each would take several. Sums are the slowest to stop: they look while they allocate, half a gigabyte at a time.
    assert usage.ru_utime + usage.ru_stime - used < 4


def seconds(call):
    begin = time.process_time()
    call()
    return time.process_time() - begin


def raise_enough(number, frame):
    raise TimeoutError("enough")


@pytest.fixture
def end_after():
    """Has a signal end a call after so many seconds."""
    def end(after, call):
        signal.setitimer(signal.ITIMER_REAL, after)
        with pytest.raises(TimeoutError, match="enough"):
            call()

    before = signal.signal(signal.SIGALRM, raise_enough)
    yield end
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def test_what_is_made_of_many_triangles_is_left_to_its_thread(end_after):
    n = 700
    at = np.arange(n * n, dtype=np.uint32).reshape(n, n)
    along, beside = np.roll(at, -1, axis=0), np.roll(at, -1, axis=1)
    corner = np.roll(along, -1, axis=1)
    around = np.linspace(0, 2 * np.pi, n, endpoint=False)
    u, v = np.meshgrid(around, around, indexing="ij")
    torus = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
    triangles = np.concatenate([np.stack([at, along, corner], -1).reshape(-1, 3), np.stack([at, corner, beside], -1).reshape(-1, 3)])
    made = []
    make = lambda: made.append(jostle.mesh(torus, triangles))
    whole = seconds(make)
    assert seconds(lambda: end_after(0.02, make)) < whole / 2
    close = lambda: made.append(jostle.ClosedMesh(made[0]))
    whole = seconds(close)
    assert seconds(lambda: end_after(0.02, close)) < whole / 2
    mesh, solid = made
    assert solid.contains([[3.0, 0, 0], [0, 0, 0]]).tolist() == [True, False] and len(jostle.Shapes([mesh])) == 1


def test_an_update_that_a_signal_ends_leaves_the_world_as_it_was(end_after):
    boxes = np.zeros((100_000, 2, 3))
    boxes[:, 1] = 1  # all of them touch: 5 billion pairs
    world = jostle.World(3)
    first = world.add(boxes[:2])
    world.update()
    ids = world.add(boxes)

    for update in (world.update, lambda: world.update(first, boxes[:2] + 0.5)):
        end_after(0.2, update)
        assert len(world) == 2 and np.array_equal(world.ids(), first) and np.array_equal(world.pairs(), [[0, 1]])
        assert np.array_equal(world.boxes(first), boxes[:2])
    world.remove(ids[2:])  # what was queued still is
    world.update()
    assert len(world) == 4 and len(world.began()) == 5 and np.array_equal(world.boxes(first), boxes[:2])
