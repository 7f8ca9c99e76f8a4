# SPDX-License-Identifier: MIT
"""Whatever carries the numbers of an argument, the answer is that for a plain array: every argument of every function."""
import inspect

import numpy as np
import pytest

import jostle

N, DIM = 12, 3
RNG = np.random.default_rng(5)
LO = RNG.integers(0, 12, (N, DIM)) / 4
BOXES = np.stack([LO, LO + RNG.integers(1, 8, (N, DIM)) / 4], axis=1)
POSES = np.concatenate([LO, np.tile([0, 0, 0, 1], (N, 1))], axis=1)
MOTIONS = np.concatenate([POSES, RNG.integers(-4, 4, (N, 6)) / 4], axis=1)
ALL_PAIRS = np.array([(a, b) for b in range(N) for a in range(b)], np.uint32)
GROUPS = np.array([0, 1, 1, 20, 40, len(ALL_PAIRS)], np.uint64)
MASKS = {"category": 1 << RNG.integers(0, 3, N).astype(np.uint32), "mask": RNG.integers(1, 8, N).astype(np.uint32),
         "owner": RNG.integers(0, 4, N).astype(np.uint32)}
VERTICES = RNG.integers(0, 9, (N, 3)).astype(np.uint32)
MASKS_B = {name + "_b": values[::-1].copy() for name, values in MASKS.items()}
SPHERES = jostle.Shapes.spheres(np.full(N, 0.6))
CUBE = np.array([[x, y, z] for x in (0.0, 1) for y in (0, 1) for z in (0, 1)])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 4], [0, 4, 2], [1, 2, 4]])
PLANES = np.array([[1.0, 0, 0, -1], [0, 1, 0, -0.5]])


class Bare:
    """An object that has no more than what it is given."""

    def __init__(self, **of):
        self.__dict__.update(of)


class WithArray(Bare):
    def __array__(self, dtype=None, copy=None):
        return self.numbers if dtype is None else self.numbers.astype(dtype)


class WithDlpack(Bare):
    def __dlpack__(self, **how):
        return self.numbers.__dlpack__(**how)

    def __dlpack_device__(self):
        return self.numbers.__dlpack_device__()


def interface(a):
    return Bare(__array_interface__=a.__array_interface__, kept=a)


def dlpack(a):
    return WithDlpack(numbers=a.astype(np.uint8) if a.dtype == bool else a)


def strided(a):
    out = np.zeros([3 * n for n in a.shape] if a.ndim else [1], a.dtype)
    where = tuple(slice(1, 3 * n, 3) for n in a.shape) if a.ndim else 0
    out[where] = a
    return out[where] if a.ndim else out.reshape(())


def misaligned(a):
    out = np.empty(a.nbytes + 1, np.uint8)[1:].view(a.dtype).reshape(a.shape)
    out[...] = a
    return out


def field(a):
    """A column of packed records: no stride is a multiple of the number's size."""
    rows = np.zeros(a.shape, [("before", np.uint8), ("it", a.dtype)])
    rows["it"] = a
    return rows["it"]


def nested(a, kind):
    return kind(nested(one, kind) for one in a) if a.ndim else a.item()


def locked(a):
    out = a.copy()
    out.flags.writeable = False
    return out


def swapped(a):
    return a.astype(a.dtype.newbyteorder(">"))


CARRIERS = {
    "big-endian": swapped, "strided": strided, "reversed": lambda a: a[::-1].copy()[::-1] if a.ndim else a, "columns": lambda a: a.copy("F"),
    "misaligned": misaligned, "field": field, "read-only": locked, "memoryview": lambda a: memoryview(a.copy()),
    "strided memoryview": lambda a: memoryview(strided(a)), "big-endian memoryview": lambda a: memoryview(swapped(a)),
    "interface": interface, "big-endian interface": lambda a: interface(swapped(a)), "strided interface": lambda a: interface(strided(a)),
    "__array__": lambda a: WithArray(numbers=a), "dlpack": dlpack, "strided dlpack": lambda a: dlpack(strided(a)),
    "list": lambda a: nested(a, list), "tuple": lambda a: nested(a, tuple),
    "list of arrays": lambda a: list(a) if a.ndim else a, "list of dlpack": lambda a: [dlpack(np.asarray(one)) for one in a] if a.ndim else dlpack(a),
    "list of memoryviews": lambda a: [memoryview(one) for one in np.ascontiguousarray(a)] if a.ndim > 1 else a,
}
WEAK = ("list", "tuple")  # they don't say which type they are of


def world_of(dtype, command):
    """What a world tells after a command about its objects."""
    world = jostle.World(DIM, dtype)
    ids = world.add(BOXES.astype(dtype))
    world.update()
    told = command(world, ids)
    if isinstance(told, (np.ndarray, jostle.Answers, tuple)):
        return told
    world.update()
    kept = world.ids()
    return [world.pairs(), world.began(), world.boxes(kept), world.bounds(kept), world.filters(kept), world.margins(kept),
            world.enabled(kept), world.user_data(kept)]


def queries(dtype):
    """Queries, each with how they are asked."""
    index = jostle.BoxIndex(BOXES.astype(dtype))
    few, each, to = BOXES[:5].astype(dtype), np.arange(5) / 4, np.ones((5, DIM)) / 2
    ask = lambda q: index.all(q)
    yield "rays", dict(origins=few[:, 0] - 1, directions=to, max_fraction=np.full(5, 9.0)), lambda **a: ask(jostle.rays(**a))
    yield "rays", dict(origins=few[:, 0] - 1, directions=to[0], max_fraction=np.array(8)), lambda **a: ask(jostle.rays(**a))
    yield "sweeps", dict(boxes=few, motions=to, max_fraction=each), lambda **a: ask(jostle.sweeps(**a))
    yield "overlapping", dict(boxes=few), lambda **a: ask(jostle.overlapping(**a))
    yield "overlapping", dict(boxes=few[0]), lambda **a: ask(jostle.overlapping(**a))
    yield "overlapping", dict(boxes=few.reshape(5, -1)), lambda **a: ask(jostle.overlapping(**a))
    yield "spheres", dict(centers=few[:, 0], radii=each), lambda **a: ask(jostle.spheres(**a))
    yield "spheres", dict(centers=few[:, 0], radii=np.array(2)), lambda **a: ask(jostle.spheres(**a))
    yield "nearest", dict(points=few[:, 0], max_distance=each), lambda **a: ask(jostle.nearest(count=3, **a))
    yield "nearest_to_boxes", dict(boxes=few, max_distance=each), lambda **a: ask(jostle.nearest_to_boxes(count=3, **a))
    yield "frustums", dict(planes=PLANES), lambda planes: ask(jostle.frustums(planes if not isinstance(planes, (list, tuple)) else [planes]))
    yield "frustums", dict(planes=np.stack([PLANES, PLANES])), lambda **a: ask(jostle.frustums(**a))


def pairs(dtype):
    boxes, other = BOXES.astype(dtype), BOXES[::-1].astype(dtype)
    points, radii = boxes[:, 0], np.arange(N) / 4
    both = dict(boxes=boxes, other=other, **MASKS, **MASKS_B)
    yield "find_pairs", both, lambda **a: jostle.find_pairs(**a)
    yield "find_pairs", dict(boxes=boxes, vertices=VERTICES, **MASKS), lambda **a: jostle.find_pairs(**a)
    yield "PairFinder.find", both, lambda **a: jostle.PairFinder().find(**a)
    yield "PairFinder.find", dict(boxes=boxes, vertices=VERTICES), lambda **a: jostle.PairFinder().find(**a)
    yield "iter_pairs", dict(boxes=boxes, vertices=VERTICES), lambda **a: np.concatenate(
        [*jostle.iter_pairs(threads=1, **a), np.empty((0, 2), np.uint32)])
    yield "iter_pairs", both, lambda **a: np.concatenate([*jostle.iter_pairs(threads=1, **a), np.empty((0, 2), np.uint32)])
    yield "find_periodic_pairs", dict(boxes=boxes, period=np.array([4.0, 0, 8]), **MASKS), lambda **a: jostle.find_periodic_pairs(**a)
    yield "find_scenes", dict(boxes=boxes, offsets=np.array([0, 5, 5, N], np.uint64), **MASKS), lambda **a: jostle.find_scenes(**a).pairs
    yield "spatial_order", dict(boxes=boxes), lambda **a: jostle.spatial_order(**a)
    yield "join", dict(points=points, radii=radii, other=other[:, 0], other_radii=radii), lambda **a: jostle.join(**a)
    yield "join", dict(points=points, radii=np.array(1)), lambda **a: jostle.join(**a)
    yield "join", dict(points=points, radii=radii.astype(np.float32)), lambda **a: jostle.join(**a)


def neighbors(dtype):
    points, others, cell = LO.astype(dtype), LO[::-1].astype(dtype) + dtype(0.25), np.array([[4, 0, 0], [1, 4, 0], [0, 0, 3.5]])
    radii, types, table = np.arange(N) / 8, np.arange(N, dtype=np.uint32) % 2, np.array([[1, 0.5], [0.5, 1.5]])
    space, flags = dict(cell=cell, periodic=np.array([True, False, True])), np.arange(9).reshape(3, 3) % 2 == 0
    cells = np.stack([cell, 2 * cell, cell + np.eye(3)])
    finder = jostle.NeighborFinder(threads=1)

    def streamed(points, cutoff, **more):
        blocks = []
        finder.stream(points, cutoff, lambda *block: blocks.append(block), rows=5, **more)
        return [array for block in blocks for array in block]

    for name, find in (("neighbors", jostle.neighbors), ("NeighborFinder.find", finder.find), ("NeighborFinder.stream", streamed)):
        call = lambda find=find, **a: find(**a, quantities="ijSDdo")
        yield name, dict(points=points, cutoff=np.array(1.5), **space), call
        yield name, dict(points=points, cutoff=radii, cell=np.array([4, 4, 4.0]), periodic=np.array(True)), call
        yield name, dict(points=points, cutoff=radii, others=others, cutoff_b=radii, **space), call
        yield name, dict(points=points, cutoff=table, types=types, **space), call
        yield name, dict(points=points, cutoff=table, types=types, others=others, types_b=1 - types), call
        if find != streamed:
            yield name, dict(points=points, cutoff=np.array(1.5), offsets=np.array([0, 5, 5, N], np.uint64), cell=cells,
                             periodic=flags), call
        of_kinds = lambda find=find, **a: find(points, {(0, 1): 1.5, (0, 0): 1}, quantities="ij", **a)
        yield name, dict(types=types), of_kinds
        yield name, dict(types=types, others=others, types_b=types), of_kinds


def surfaces(dtype):
    triangles, edges, points = np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]]), np.array([[9, 10]]), np.array([11])
    surface, finder = jostle.Surface(triangles, edges, points), jostle.SurfaceFinder(threads=1)
    yield "Surface.__init__", dict(triangles=triangles, edges=edges, points=points), lambda **a: jostle.Surface(**a).edges
    at, bodies = LO.astype(dtype), np.arange(N) // 3
    options = dict(thickness=np.full(N, dtype(0.25)), rest=2 * at + dtype(1), bodies=bodies)
    yield "SurfaceFinder.near", dict(positions=at, **options), lambda **a: finder.near(surface, distance=2, **a)
    yield "SurfaceFinder.moving", dict(start=at, end=at[::-1], **options), lambda **a: finder.moving(surface, **a)
    yield "SurfaceFinder.crossings", dict(positions=at, bodies=bodies), lambda **a: finder.crossings(surface, **a)
    corners = RNG.integers(0, 12, (5, 4, 3)) / 4
    for name in ("vertex_triangle", "edge_edge"):
        yield f"{name}_impact", dict(start=corners, end=corners[::-1]), lambda name=name, **a: getattr(jostle, f"{name}_impact")(**a)
        yield f"{name}_distance", dict(positions=corners), lambda name=name, **a: getattr(jostle, f"{name}_distance")(**a)


def indexes(dtype):
    boxes, ids = BOXES.astype(dtype), np.arange(N, dtype=np.uint32)[::-1] * 2
    again = {name: np.repeat(values, 2) for name, values in MASKS.items()}
    asker = np.array([3, 5, 1], np.uint32)

    def made(change):
        index = jostle.BoxIndex(boxes, ids)
        change(index)
        return index.all(boxes)

    def asked(method):
        index = jostle.BoxIndex(boxes, ids)
        return lambda **a: getattr(index, method)(jostle.rays([[-1, -1, -1]], [1, 1, 1]) if method == "first" else boxes, **a)

    yield "BoxIndex.__init__", dict(boxes=boxes, ids=ids), lambda **a: jostle.BoxIndex(**a, dtype=dtype).all(boxes)
    yield "BoxIndex.build", dict(boxes=boxes, ids=ids + 1), lambda **a: made(lambda index: index.build(**a))
    yield "BoxIndex.insert", dict(boxes=boxes, ids=ids + 1), lambda **a: made(lambda index: index.insert(**a))
    yield "BoxIndex.move", dict(boxes=boxes + 1, ids=ids), lambda **a: made(lambda index: index.move(**a))
    yield "BoxIndex.erase", dict(ids=ids[3:7]), lambda **a: made(lambda index: index.erase(**a))
    yield "BoxIndex.contains", dict(ids=ids // 2), lambda **a: jostle.BoxIndex(boxes, ids).contains(**a)
    yield "BoxIndex.boxes", dict(ids=ids), lambda **a: jostle.BoxIndex(boxes, ids).boxes(**a)
    yield "BoxIndex.join", dict(boxes=boxes), lambda **a: jostle.BoxIndex(boxes, ids).join(**a)
    for method in ("all", "any", "count"):
        yield f"BoxIndex.{method}", dict(**again, asker=asker, exclude=ids.astype(np.uint64)), asked(method)
        yield f"BoxIndex.{method}", dict(queries=boxes), lambda queries, method=method: getattr(jostle.BoxIndex(boxes), method)(queries)
    yield "BoxIndex.first", dict(**again, asker=asker[:2], exclude=np.array(ids[3])), asked("first")
    found = []
    yield "BoxIndex.visit", dict(**again, asker=asker, exclude=np.array(ids[3])), lambda **a: (
        found.clear(), jostle.BoxIndex(boxes, ids).visit(boxes[:1], lambda ids, at: found.append(ids), **a), np.concatenate(found))[-1]
    rays, index = jostle.rays([[-1.0, -1, -1]], [1, 1, 1]), jostle.BoxIndex(boxes)
    poses, masks = POSES.astype(dtype), dict(**MASKS, asker=asker, exclude=np.array(3))
    for method in ("any", "count", "first"):
        yield f"BoxIndex.{method}", dict(poses=poses, **masks), lambda method=method, **a: getattr(index, method)(rays, SPHERES, **a)
    yield "BoxIndex.all", dict(poses=poses, **masks), lambda **a: index.all(rays, SPHERES, **a).values
    yield "BoxIndex.visit", dict(poses=poses, **masks), lambda **a: (
        found.clear(), index.visit(rays, lambda ids, at: found.append(ids), SPHERES, **a), np.concatenate(found))[-1]
    yield "shape_sweeps", dict(poses=poses, displacements=np.ones((N, DIM), dtype)), lambda **a: index.all(
        jostle.shape_sweeps(SPHERES, **a), SPHERES, poses).values
    yield "posed_shapes", dict(poses=poses), lambda **a: index.all(jostle.posed_shapes(SPHERES, **a), SPHERES, poses)
    yield "nearest_to_shapes", dict(poses=poses + 1, max_distance=np.arange(N) / 4), lambda **a: index.first(
        jostle.nearest_to_shapes(SPHERES, **a), SPHERES, poses)


def worlds(dtype):
    boxes, to = BOXES.astype(dtype), np.ones((N, DIM), dtype) / 2
    settings = dict(**MASKS, is_static=RNG.random(N) < 0.3)
    probe = jostle.World(DIM, dtype)
    ids = probe.add(boxes)
    probe.update()
    do = lambda call: lambda **a: world_of(dtype, lambda world, _: call(world, **a))
    more = dict(**settings, margin=np.arange(N) / 4, enabled=RNG.random(N) < 0.7)
    yield "World.add", dict(boxes=boxes, **more), do(lambda world, **a: (world.add(**a), None)[1])
    yield "World.add", dict(boxes=boxes, **{name: value[3] for name, value in more.items()}), do(lambda world, **a: (world.add(**a), None)[1])
    yield "World.add", dict(boxes=boxes[0]), do(lambda world, **a: (world.add(**a), None)[1])
    yield "World.index", dict(ids=ids), lambda **a: jostle.World.index(**a)
    yield "World.remove", dict(ids=ids[2:5]), do(lambda world, **a: world.remove(**a))
    yield "World.move", dict(ids=ids, boxes=boxes + 1, displacements=to), do(lambda world, **a: world.move(**a))
    yield "World.resize", dict(ids=ids, sizes=to), do(lambda world, **a: world.resize(**a))
    yield "World.set_filter", dict(ids=ids, **settings), do(lambda world, **a: world.set_filter(**a))
    yield "World.set_margin", dict(ids=ids, margins=np.arange(N) / 4), do(lambda world, **a: world.set_margin(**a))
    yield "World.set_enabled", dict(ids=ids, enabled=np.arange(N) % 3 == 1), do(lambda world, **a: world.set_enabled(**a))
    yield "World.set_user_data", dict(ids=ids, data=np.arange(N, dtype=np.uint64) << np.uint64(60)), do(lambda world, **a: world.set_user_data(**a))
    yield "World.report_again", dict(ids=ids[2:5]), do(lambda world, **a: world.report_again(**a))
    yield "World.report_again", dict(ids=probe.began()[:4]), do(lambda world, **a: world.report_again(**a))
    yield "World.update", dict(ids=ids, boxes=boxes + 1), do(lambda world, **a: world.update(**a))
    slots = jostle.PairSlots()
    slots.update(probe.began(), probe.ended())
    yield "PairSlots.slots_of", dict(pairs=ALL_PAIRS), lambda **a: slots.slots_of(**a)
    yield "PairSlots.update", dict(began=probe.began()), lambda **a: (slots.update(**a, ended=jostle.EndedPairs([], [])), slots.began_slots())[1]
    yield "World.touching", dict(ids=ids[::2]), do(lambda world, **a: world.touching(**a))
    yield "World.ids", dict(indices=np.arange(3, 7, dtype=np.uint32)), do(lambda world, **a: world.ids(**a))
    for name in ("contains", "boxes", "bounds", "filters", "enabled", "user_data", "margins"):
        yield f"World.{name}", dict(ids=ids[3:9]), do(lambda world, name=name, **a: getattr(world, name)(**a))
    asker = np.array([3, 5], np.uint32)
    for method in ("all", "any", "count"):
        yield f"World.{method}", dict(asker=asker, exclude=ids), lambda method=method, **a: getattr(probe, method)(boxes, **a)
        yield f"World.{method}", dict(queries=boxes), lambda queries, method=method: getattr(probe, method)(queries)
    rays, poses = jostle.rays([[-1.0, -1, -1]], [1, 1, 1]), POSES.astype(dtype)
    one = dict(asker=asker, exclude=np.array(ids[3]))
    found = []
    yield "World.first", one, lambda **a: probe.first(rays, **a)
    yield "World.visit", one, lambda **a: (found.clear(), probe.visit(boxes[:1], lambda ids, at: found.append(ids), **a), np.concatenate(found))[-1]
    yield "World.join", dict(boxes=boxes, **one), lambda **a: probe.join(**a)
    for method in ("any", "count", "first"):
        yield f"World.{method}", dict(poses=poses, **one), lambda method=method, **a: getattr(probe, method)(rays, SPHERES, **a)
    yield "World.all", dict(poses=poses, **one), lambda **a: probe.all(rays, SPHERES, **a).values
    yield "World.visit", dict(poses=poses, **one), lambda **a: (
        found.clear(), probe.visit(rays, lambda ids, at: found.append(ids), SPHERES, **a), np.concatenate(found))[-1]


def shapes(dtype):
    def seen(shape):
        return jostle.bounds(jostle.Shapes([shape]), [[0.0, 0, 0, 0, 0, 0, 1]])

    yield "box", dict(half=np.array([1, 2, 3.0])), lambda **a: seen(jostle.box(**a))
    yield "rounded_box", dict(half=np.array([1, 2, 3.0])), lambda **a: seen(jostle.rounded_box(radius=1, **a))
    yield "ellipsoid", dict(half=np.array([1, 2, 3.0])), lambda **a: seen(jostle.ellipsoid(**a))
    yield "half_space", dict(normal=np.array([0, 2, 0.0])), lambda **a: seen(jostle.half_space(**a))
    yield "hull", dict(points=CUBE.astype(dtype)), lambda **a: seen(jostle.hull(**a))
    yield "rounded_hull", dict(points=CUBE.astype(dtype)), lambda **a: seen(jostle.rounded_hull(radius=1, **a))
    yield "mesh", dict(vertices=CUBE.astype(dtype), elements=TETRAHEDRON), lambda **a: seen(jostle.mesh(**a))
    yield "height_field", dict(heights=np.arange(12.0).reshape(3, 4) / 4), lambda **a: seen(jostle.height_field(**a))
    yield "compound", dict(poses=POSES[:2]), lambda **a: seen(jostle.compound([jostle.sphere(1), jostle.box([1, 2, 3])], **a))
    yield "Shapes.spheres", dict(radii=np.arange(1.0, 13)), lambda **a: jostle.bounds(jostle.Shapes.spheres(**a), POSES)
    yield "Shapes.capsules", dict(half_lengths=np.arange(1.0, 13), radii=np.arange(2.0, 14)), lambda **a: jostle.bounds(
        jostle.Shapes.capsules(**a), POSES)
    yield "Shapes.boxes", dict(halves=LO + 1), lambda **a: jostle.bounds(jostle.Shapes.boxes(**a), POSES)
    turns = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])
    yield "poses", dict(positions=LO.astype(dtype), rotations=np.tile([0, 0, 0.6, 0.8], (N, 1))), lambda **a: jostle.poses(**a)
    yield "poses", dict(positions=LO.astype(dtype), rotations=turns), lambda **a: jostle.poses(**a)
    yield "poses", dict(positions=LO[:, :2].astype(dtype), rotations=np.arange(N) / 4), lambda **a: jostle.poses(**a)
    yield "motions", dict(starts=POSES.astype(dtype), ends=POSES[::-1].astype(dtype)), lambda **a: jostle.motions(**a)
    solid = jostle.ClosedMesh(jostle.mesh(CUBE, TETRAHEDRON))
    inside = dict(points=LO.astype(dtype) / 4, pose=POSES[0].astype(dtype))
    yield "ClosedMesh.contains", inside, lambda **a: solid.contains(**a)
    yield "ClosedMesh.signed_distances", inside, lambda **a: solid.signed_distances(**a)
    yield "ClosedMesh.winding_numbers", dict(points=LO / 4), lambda **a: solid.winding_numbers(**a)


def contacts(dtype):
    poses, motions, finder = POSES.astype(dtype), MOTIONS.astype(dtype), jostle.ContactFinder(DIM, dtype)
    one, two = dict(poses=poses, pairs=ALL_PAIRS), dict(poses=poses, pairs=ALL_PAIRS, poses_b=poses[::-1])
    moving = dict(motions=motions, pairs=ALL_PAIRS, motions_b=motions[::-1])
    rays = jostle.rays(LO - 1, np.ones(DIM))
    casts = dict(moving_poses=poses[::-1], displacements=np.ones((N, DIM), dtype), poses=poses, pairs=ALL_PAIRS)
    for name in ("find", "find_points", "touching", "distances", "first_touching", "least_distances"):
        given = dict(two, offsets=GROUPS) if name in ("first_touching", "least_distances") else two
        yield f"ContactFinder.{name}", given, lambda name=name, **a: getattr(finder, name)(SPHERES, shapes_b=SPHERES, **a)
    yield "ContactFinder.impacts", moving, lambda **a: finder.impacts(SPHERES, shapes_b=SPHERES, **a)
    yield "ContactFinder.ray_casts", one, lambda **a: finder.ray_casts(rays, SPHERES, **a)
    yield "ContactFinder.shape_casts", casts, lambda **a: finder.shape_casts(SPHERES, shapes=SPHERES, **a)
    for name in ("contacts", "touching", "distances"):
        yield name, two, lambda name=name, **a: getattr(jostle, name)(SPHERES, shapes_b=SPHERES, **a)
    yield "impacts", moving, lambda **a: jostle.impacts(SPHERES, shapes_b=SPHERES, **a)
    yield "ray_casts", one, lambda **a: jostle.ray_casts(rays, SPHERES, **a)
    yield "shape_casts", casts, lambda **a: jostle.shape_casts(SPHERES, shapes=SPHERES, **a)
    yield "bounds", dict(poses=poses), lambda **a: jostle.bounds(SPHERES, **a)
    objects = np.arange(20, dtype=np.uint32) % 5
    for values in (np.arange(20, dtype=dtype), np.arange(60, dtype=dtype).reshape(20, 3), np.arange(20) - 9):
        yield "sum_by_object", dict(objects=objects, values=values), lambda **a: jostle.sum_by_object(count=5, **a)


ROOMS = (queries, pairs, neighbors, surfaces, indexes, worlds, shapes, contacts)


def parts_of(answer):
    """The arrays in an answer, without their types: lists are of no type."""
    if isinstance(answer, jostle.Answers):
        return parts_of([answer.first, answer.ids, answer.at, answer.more])
    if isinstance(answer, (tuple, list)):
        return [part for one in answer for part in parts_of(one)]
    out = np.asarray(answer)
    if out.dtype.names:
        return [part for name in out.dtype.names for part in parts_of(out[name])]
    return [] if answer is None else [out.tolist()]


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.__name__)
def test_whatever_carries_them_the_numbers_are_the_same(room, dtype):
    for name, arguments, call in room(dtype):
        arguments = {key: np.asarray(value) for key, value in arguments.items()}
        expected = parts_of(call(**arguments))
        sized = name.startswith(("World", "BoxIndex.", "ContactFinder"))  # what it makes of a list doesn't depend on the list
        for carrier, carry in CARRIERS.items():
            if dtype == np.float32 and carrier in WEAK and not sized:
                continue
            carried = {key: carry(value) for key, value in arguments.items()}
            for key in arguments:
                got = call(**{**arguments, key: carried[key]})
                assert parts_of(got) == expected, (name, key, carrier)
            assert parts_of(call(**carried)) == expected, (name, carrier)


# What isn't an array: shapes, numbers, functions, and other objects of the package.
NO_ARRAYS = ("visit", "shapes", "near", "moving", "accept", "dtype", "casts", "boxes_array", "shape", "other_world")


def test_the_table_has_every_argument_that_may_be_an_array():
    wanted, there = set(), set()
    for room in ROOMS:
        for name, arguments, _ in room(np.float64):
            there |= {(name, key) for key in arguments}
    for name, function in vars(jostle).items():
        if name.startswith("_") or inspect.ismodule(function):
            continue
        of = [(name, function)] if not inspect.isclass(function) else [
            (f"{name}.{method}", getattr(function, method)) for method in dir(function) if not method.startswith("_") or method == "__init__"]
        for full, one in of:
            if not inspect.isfunction(one) and not inspect.ismethod(one):
                continue
            for key, parameter in inspect.signature(one).parameters.items():
                kind = str(parameter.annotation)
                if kind in ("Any", "Sequence[Any]", "Exclude", "Asker | None") and key not in NO_ARRAYS:
                    wanted.add((full, key))
    drawn = {("plot", "boxes"), ("plot", "pairs"), ("plot", "ax")}
    # first() and visit() take no boxes or one; a world refuses its objects' filters.
    other = {(f"{name}.{verb}", "queries") for name in ("BoxIndex", "World") for verb in ("first", "visit")}
    other |= {(f"World.{verb}", key) for verb in ("any", "count", "first", "all", "visit") for key in ("category", "mask", "owner")}
    assert {one for one in wanted - there - drawn - other if not one[0].startswith("Queries.")} == set()


def test_whole_numbers_are_taken_as_they_are_or_refused():
    layout = [[0, 0, 2, 2], [2, 1, 3, 3], [4, 0, 5, 1]]
    for dtype in (np.uint8, np.int16, np.uint32, np.int64, np.uint64):
        assert jostle.find_pairs(np.array(layout, dtype)).tolist() == [[0, 1]], dtype
    far = np.array(layout, np.int64) + 2**53 - 5
    assert jostle.find_pairs(far).tolist() == [[0, 1]]
    assert jostle.find_pairs(np.array([[-2**63, 0, 2**62, 2**60]] * 2)).tolist() == [[0, 1]]
    # The greatest of each dtype are those whose rounded value isn't in it any more.
    for dtype, number, to in ((np.int64, 2**53 + 1, np.float64), (np.int64, -2**53 - 1, np.float64), (np.int64, 2**63 - 1, np.float64),
                              (np.uint64, 2**64 - 1, np.float64), (np.int32, 2**24 + 1, np.float32), (np.int32, 2**31 - 1, np.float32),
                              (np.uint32, 2**32 - 1, np.float32)):
        boxes = np.array([[0, 0, 1, 1], [0, 0, 1, 1]], dtype)
        boxes[1, 0 if number < 0 else 3] = number
        world = jostle.World(2, to)
        with pytest.raises(jostle.Error, match=rf"boxes\[1, [03]\] is {number}, which {to.__name__} can't hold exactly") as error:
            world.add(boxes)
        assert error.value.index == 1
    with pytest.raises(jostle.Error, match="dtype bool"):
        jostle.find_pairs(np.zeros((2, 4), bool))


def test_rectangles_that_share_area_are_those_whose_upper_bounds_may_be_lowered():
    """What docs/start/rectangles.md says of a layout in which most only touch."""
    rng = np.random.default_rng(6)
    lower = rng.integers(0, 60, (400, 2)) + 2**40
    layout = np.concatenate([lower, lower + rng.integers(1, 8, (400, 2))], axis=1)
    for boxes in (layout, layout.astype(np.float64) * 0.1, (layout - 2**40).astype(np.float32) * np.float32(0.3)):
        floats = boxes if boxes.dtype.kind == "f" else boxes.astype(float)
        inside = np.concatenate([floats[:, :2], np.nextafter(floats[:, 2:], floats.dtype.type(-np.inf))], axis=1)
        common = np.minimum(boxes[:, None, 2:], boxes[None, :, 2:]) - np.maximum(boxes[:, None, :2], boxes[None, :, :2])
        for given, wanted in ((boxes, (common >= 0).all(axis=2)), (inside, (common > 0).all(axis=2))):
            assert jostle.find_pairs(given, order="sorted").tolist() == np.argwhere(np.triu(wanted, 1)).tolist()
        assert (common > 0).all(axis=2).sum() < (common >= 0).all(axis=2).sum()


def test_numbers_that_are_none_are_refused_and_great_ones_kept():
    boxes = BOXES
    world = jostle.World()
    ids = world.add(boxes)
    world.update()
    great = [2**64 - 1, 0, 2**63, *range(N - 3)]
    world.set_user_data(ids, great)
    assert world.user_data(ids).tolist() == great
    assert world.all(boxes, exclude=[2**64 - 1, 1, *ids[2:].tolist()]).ids.size > 0
    for call, words in ((lambda: world.set_margin(ids, "1"), "margins has the dtype"), (lambda: world.set_margin(ids, None), "margins has"),
                        (lambda: jostle.join(LO, ["1"] * N), "the radii of points have|the radii of points has"),
                        (lambda: jostle.poses(LO, ["1", "2", "3", "4"]), "rotations has the dtype"),
                        (lambda: world.set_user_data(ids, [2**64, *range(N - 1)]), "data"),
                        (lambda: world.set_user_data(ids, [2**63, -1, *range(N - 2)]), "data"),
                        (lambda: world.set_user_data(ids, [0.5] * N), "data has the dtype float64"),
                        (lambda: jostle.find_pairs(dlpack_on_a_gpu()), "can't read an argument")):
        with pytest.raises(jostle.Error, match=words):
            call()


def dlpack_on_a_gpu():
    class Refuses:
        def __dlpack__(self, **how):
            raise BufferError("it lies in a GPU's memory")

        def __dlpack_device__(self):
            return (2, 0)

    return Refuses()
