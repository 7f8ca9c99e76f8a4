# SPDX-License-Identifier: MIT
"""The package without memory: whichever allocation fails, and on whichever thread, the call raises MemoryError, what it was asked of
is unchanged, nothing is lost, and the same call with memory has the same result as one that never failed.

starve.cpp must be preloaded: package.py does it. Only C++'s operator new fails, from which all memory of the library and of the
compiled part comes. malloc doesn't, on which Python, NumPy, the C++ runtime and most of oneTBB live. Each call is made with memory
before, so that oneTBB has its threads: what it does without memory for them isn't the package's to say.
"""
import ctypes
import itertools
import pickle
import time
import types

import numpy as np
import pytest

import jostle

starved = ctypes.CDLL(None)
starved.starve_begin.argtypes = (ctypes.c_uint64, ctypes.c_uint64)
starved.starve_begin.restype = None
starved.starve_end.restype = ctypes.c_uint64
starved.starve_blocks.restype = ctypes.c_int64
NEVER = 2**64 - 1

# The C interface, on which the package stands, keeps the last 1024 handles that were freed, to know them if they are used again.
for _ in range(1024):
    jostle.sphere(1)


def plain(value):
    """A result as something that == compares: arrays as their bytes, since rows have padding that is nobody's."""
    if isinstance(value, np.ndarray):
        if value.dtype.names:
            return tuple((name, plain(np.ascontiguousarray(value[name]))) for name in value.dtype.names)
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, (tuple, list)):
        return tuple(plain(each) for each in value)
    if isinstance(value, dict):
        return tuple((key, plain(each)) for key, each in value.items())
    if isinstance(value, jostle.Answers):
        return plain((value.first, value.ids, value.at, value.more))
    if isinstance(value, jostle.ShapeAnswers):
        return plain((value.first, value.values, value.more))
    if isinstance(value, jostle.ScenePairs):
        return plain((value.pairs, value.first))
    if isinstance(value, jostle.Shape):
        return value.dim, plain(jostle.bounds(jostle.Shapes.same(value, 1), places(1)))
    if isinstance(value, jostle.World):
        return known_of_world(value)
    if isinstance(value, jostle.BoxIndex):
        return known_of_index(value)
    if isinstance(value, jostle.Shapes):
        return len(value), plain(jostle.bounds(value, places(len(value))))
    assert value is None or isinstance(value, (bool, int, float, str, bytes, np.generic)), type(value)
    return value


def known_of_world(world):
    return (world.save(), plain(world.began()), plain(world.ended()), plain(world.persisted()), plain(world.pairs()),
            plain(world.all(everywhere)))


def known_of_index(index):
    ids = np.flatnonzero(index.contains(np.arange(300)))
    return len(index), plain(ids), plain(index.boxes(ids)), plain(index.pairs()), plain(index.all(everywhere))


def none_lost(before):
    """Whether no more blocks of memory are out than before. A thread that has just ended may still be giving back its own."""
    for _ in range(400):
        if starved.starve_blocks() <= before:
            return True
        time.sleep(0.005)
    return False


def nothing(made):
    return None


def starve(make, call, known=nothing, later=nothing, in_parts=False):
    """Calls call(make()) with each allocation failing in turn; returns how often that ended the call. known(made) is what an object
    says of itself, and later(made) what it does after the call. Where one allocation fails alone, the call is repeated. Where
    all that follow fail as well, it is given up, and the object goes on as if there had been no such call; but for calls that
    do what they are asked for `in_parts`, and may have done some of it."""
    def sound(call):
        made = make()
        before = plain(known(made))
        return before, plain(call(made)), plain(known(made)), plain(later(made))

    before, answer, after, end = sound(call)
    end_without = sound(nothing)[3]
    assert sound(call) == (before, answer, after, end), "it isn't the same each time, even with memory"
    failures = 0
    for and_all_after in (False, True):
        for k in itertools.count():
            what = f"allocation {k}{' and all after' if and_all_after else ''}"
            out = starved.starve_blocks()
            made = make()
            told, failed = None, False
            starved.starve_begin(k, NEVER if and_all_after else k + 1)
            try:
                told = call(made)
            except MemoryError:
                failed = True
            finally:
                allocations = starved.starve_end()
            if failed:
                failures += 1
                assert plain(known(made)) == before, f"{what}: the object isn't as it was"
            if failed and and_all_after:
                end_of_this = plain(later(made))
                assert in_parts or end_of_this == end_without, f"{what}: something is left of the call"
            else:
                assert plain(call(made) if failed else told) == answer, f"{what}: another result"
                assert plain(known(made)) == after, f"{what}: the object isn't as it should be"
                assert plain(later(made)) == end, f"{what}: it goes on in another way"
            del made, told
            assert none_lost(out), f"{what}: {starved.starve_blocks() - out} blocks are lost"
            if allocations <= k:
                break
    return failures


# --- What calls are about: small, since each call is made once for each of its allocations ---

random = np.random.default_rng(1)


def boxes_of(count, dim=3, dtype=np.float64, size=0.3):
    lo = random.random((count, dim))
    return np.stack([lo, lo + size * random.random((count, dim))], 1).astype(dtype)


def places(count, size=2.0):
    return jostle.poses(np.random.default_rng(2).random((count, 3)) * size)


boxes, others, moved = boxes_of(60), boxes_of(40), boxes_of(60)
many = boxes_of(20_000, size=0.02)
everywhere = jostle.overlapping(np.array([[[-9.0] * 3, [9.0] * 3]]))
some = np.arange(10)
each = np.arange(60, dtype=np.uint32)
QUERIES = {
    "rays": jostle.rays(others[:5, 0] - 1, np.ones(3)),
    "sweeps": jostle.sweeps(others[:5], np.ones(3)),
    "overlapping": jostle.overlapping(others[:5]),
    "spheres": jostle.spheres(others[:5, 0], 0.3),
    "frustums": jostle.frustums([np.array([[1.0, 0, 0, -0.5]]), np.array([[0.0, 1, 0, -0.5], [0, 0, 1, -0.5]])]),
    "nearest": jostle.nearest(others[:5, 0], 3),
    "nearest_to_boxes": jostle.nearest_to_boxes(others[:5], 3),
}
corners = np.array(list(itertools.product((-0.3, 0.3), repeat=3)))
cloud = np.concatenate([corners, np.random.default_rng(3).uniform(-0.3, 0.3, (1000, 3))])  # more than a thread makes at once
triangles = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
             [1, 5, 7], [1, 7, 3]]
cube = jostle.mesh(corners, triangles)
heights = np.random.default_rng(4).random((4, 5))
solid = jostle.hull(corners)
zoo = [solid, cube, jostle.sphere(0.3), jostle.box([0.3, 0.2, 0.1]), jostle.capsule(0.2, 0.2), jostle.cylinder(0.2, 0.2),
       jostle.cone(0.3, 0.2), jostle.ellipsoid([0.3, 0.2, 0.1]), jostle.height_field(heights, 0.2, 0.2),
       jostle.compound([solid, jostle.sphere(0.2)], jostle.poses([[0.0, 0, 0], [0.3, 0, 0]])),
       jostle.rounded_box([0.2, 0.2, 0.2], 0.1), jostle.rounded_hull(corners, 0.1)]
shapes, at = jostle.Shapes(zoo), places(len(zoo), 1)
shape_boxes = jostle.bounds(shapes, at)
ways = np.concatenate([at, np.random.default_rng(5).uniform(-1, 1, (len(zoo), 6))], 1)
pairs = np.array(list(itertools.combinations(range(len(zoo)), 2)), np.uint32)
groups = np.arange(0, len(pairs) + 1, 6)
movers, from_where = jostle.Shapes([solid, cube]), jostle.poses([[-2.0, 0, 0], [-2, 1, 0]])
lines = jostle.rays([[-2.0, 0.5, 0.5], [0.5, -2, 0.5]], [[1.0, 0, 0], [0, 1, 0]])
pairs_of_two = np.array(list(itertools.product(range(2), range(len(zoo)))), np.uint32)


def stream(**more):
    return sorted(tuple(pair) for part in jostle.iter_pairs(boxes, chunk=50, **more) for pair in part.tolist())


def raised(call):
    """What it raises, other than MemoryError. Not the whole message: one that ends early had no memory for the rest."""
    try:
        call()
    except (IndexError, TypeError, jostle.Error) as error:
        return type(error).__name__, getattr(error, "index", None), getattr(error, "status", None)
    return None


def seen(visit, *given, **more):
    parts = []
    visit(*given, lambda ids, found: parts.append((ids.copy(), found.copy())), **more)
    return parts


def meshes_of_trimesh():
    """A manager that is made, moved and asked."""
    mesh = types.SimpleNamespace(vertices=corners, faces=triangles)
    manager = jostle.trimesh.CollisionManager(threads=1)
    for k in range(4):
        manager.add_object(str(k), mesh, np.eye(4) + 0.2 * k * np.eye(4, k=3))
    manager.set_transform("1", np.eye(4) + 2 * np.eye(4, k=3))
    manager.remove_object("2")
    touches, names, data = manager.in_collision_internal(True, True)
    return (touches, sorted(names), [one.point for one in data], manager.min_distance_single(mesh, np.eye(4) + 9 * np.eye(4, k=3)),
            manager.min_distance_internal(), manager.in_collision_each(mesh, [np.eye(4)]))


CALLS = {
    # Pairs of boxes.
    "find_pairs": lambda: jostle.find_pairs(boxes, threads=1),
    "PairFinder": lambda: jostle.PairFinder(threads=2).find(boxes, accept=lambda a, b: (a + b) % 2 == 0),
    "find_pairs, two threads": lambda: jostle.find_pairs(boxes, threads=2),
    "find_pairs, oneTBB": lambda: jostle.find_pairs(boxes),
    "find_pairs of many, oneTBB": lambda: jostle.find_pairs(many),
    "find_pairs of many, three threads": lambda: jostle.find_pairs(many, threads=3),
    "find_pairs, 2D, float": lambda: jostle.find_pairs(boxes[:, :, :2].astype(np.float32), threads=1),
    "find_pairs, sorted": lambda: jostle.find_pairs(boxes, order="sorted", threads=1),
    "find_pairs, two sets": lambda: jostle.find_pairs(boxes, others, threads=1),
    "find_pairs, filtered": lambda: jostle.find_pairs(boxes, category=each, mask=each + 1, owner=each // 4, threads=1),
    "find_pairs, accepted": lambda: jostle.find_pairs(boxes, accept=lambda a, b: (a + b) % 2 == 0, threads=1),
    "find_pairs, accept raises": lambda: raised(lambda: jostle.find_pairs(boxes, accept=lambda a, b: [][a], threads=1)),
    "find_pairs, a mistake": lambda: raised(lambda: jostle.find_pairs([[1.0, 1, 0, 0]], threads=1)),
    "find_pairs, no boxes": lambda: raised(lambda: jostle.find_pairs(boxes[:, :, 0])),
    "find_periodic_pairs": lambda: jostle.find_periodic_pairs(boxes, [1.5, 0, 1.5], threads=1),
    "find_scenes": lambda: jostle.find_scenes(boxes, [0, 20, 20, 60], threads=1),
    "find_scenes, accepted": lambda: jostle.find_scenes(boxes, [0, 20, 60], accept=lambda scene, a, b: a > 3, threads=1),
    "iter_pairs": lambda: stream(threads=1),
    "iter_pairs, two threads": lambda: stream(threads=2),
    "iter_pairs, two sets": lambda: stream(other=others, threads=1),
    "iter_pairs, accepted": lambda: stream(accept=lambda a, b: (a + b) % 2 == 0, threads=1),
    "spatial_order": lambda: jostle.spatial_order(boxes, threads=1),
    "join": lambda: jostle.join(boxes[:, 0], 0.1, threads=1),
    "join, two sets": lambda: jostle.join(boxes[:, 0], 0.1, others[:, 0], 0.1, threads=1),
    # Neighbours.
    "neighbors": lambda: jostle.neighbors(boxes[:, 0], 0.3, threads=1),
    "neighbors, everything": lambda: jostle.neighbors(boxes[:, 0], 0.3, [1.0, 1, 1], True, quantities="ijSDdo", threads=1),
    "neighbors, two threads": lambda: jostle.neighbors(boxes[:, 0], each / 100, quantities="jo", threads=2),
    "neighbors, two sets": lambda: jostle.neighbors(boxes[:, 0], 0.3, others=others[:, 0], threads=1),
    "neighbors, systems": lambda: jostle.neighbors([boxes[:20, 0], boxes[20:, 0]], 0.3, [1.0, 1, 1], [True, True, False], threads=1),
    "neighbors, none": lambda: jostle.neighbors(boxes[:1, 0], 0.3, quantities="ijSDdo", threads=1),
    "neighbors, a mistake": lambda: raised(lambda: jostle.neighbors(boxes[:, 0], -1, threads=1)),
    # Surfaces.
    "Surface": lambda: jostle.Surface(triangles, edges=[[1, 9]], points=[11]).edges,
    "Surface, a mistake": lambda: raised(lambda: jostle.Surface([[0, 1, 1]])),
    "vertex_triangle_impact": lambda: jostle.vertex_triangle_impact(boxes[:40].reshape(-1, 4, 3), boxes[20:].reshape(-1, 4, 3)),
    "edge_edge_distance": lambda: jostle.edge_edge_distance(boxes[:40].reshape(-1, 4, 3)),
    "edge_edge_impact, a mistake": lambda: raised(lambda: jostle.edge_edge_impact([[[0.0, 0, 0]] * 4], [[[1.0, 0, 0]] * 4], -1)),
    # Shapes.
    "sphere": lambda: jostle.sphere(1),
    "sphere, a mistake": lambda: raised(lambda: jostle.sphere("large")),
    "hull": lambda: jostle.hull(corners),
    "hull of many points": lambda: jostle.hull(cloud),
    "rounded_hull": lambda: jostle.rounded_hull(corners, 0.1),
    "mesh": lambda: jostle.mesh(corners, triangles),
    "height_field": lambda: jostle.height_field(heights),
    "compound": lambda: jostle.compound([solid, zoo[2]], at[:2]),
    "info": lambda: (solid.info(), solid.vertices(), solid.faces()),
    "Shapes": lambda: jostle.Shapes(zoo),
    "Shapes.same": lambda: jostle.Shapes.same(solid, 5),
    "Shapes.spheres": lambda: jostle.Shapes.spheres(np.ones(9)),
    "Shapes.capsules": lambda: jostle.Shapes.capsules(np.ones(9), np.ones(9)),
    "Shapes.boxes": lambda: jostle.Shapes.boxes(np.ones((9, 3))),
    "bounds": lambda: jostle.bounds(shapes, at),
    # Pairs of shapes.
    "contacts": lambda: jostle.contacts(shapes, at, pairs),
    "contacts, two sets": lambda: jostle.contacts(shapes, at, pairs, 0.1, shapes, at),
    "touching": lambda: jostle.touching(shapes, at, pairs),
    "distances": lambda: jostle.distances(shapes, at, pairs, 0.2),
    "impacts": lambda: jostle.impacts(shapes, ways, pairs),
    "ray_casts": lambda: jostle.ray_casts(lines, shapes, at, pairs_of_two),
    "shape_casts": lambda: jostle.shape_casts(movers, from_where, [[3.0, 0, 0], [3, 0, 0]], shapes, at, pairs_of_two),
    "trimesh": meshes_of_trimesh,
    # Responses.
    "sum_by_object": lambda: jostle.sum_by_object(np.arange(500) % 7, np.ones((500, 3)), 7, threads=1),
    "sum_by_object, two threads": lambda: jostle.sum_by_object(np.arange(9000) % 7, np.arange(9000), 7, threads=2),
    # Objects that are made.
    "World": lambda: jostle.World(threads=1),
    "World that asks": lambda: jostle.World(accept=lambda a, b: True, threads=1),
    "BoxIndex": lambda: jostle.BoxIndex(boxes, threads=1),
}


def new_world(**more):
    world = jostle.World(threads=1, **more)
    world.set_user_data(world.add(boxes), each)
    return world


def world_at_work():
    """With objects that moved, and commands that are queued."""
    world = new_world()
    world.update()
    world.move(world.ids()[20:40], moved[20:40])
    world.update()
    world.move(world.ids()[30:50], boxes[30:50])
    world.remove(world.ids()[:3])
    return world


def changed_world():
    """With a base, which it has left."""
    world = new_world()
    world.update()
    world.save_base()
    world.move(world.ids()[20:40], moved[20:40])
    world.update()
    return world


def rolled_back():
    """A world that has gone on since its changes were saved."""
    world = changed_world()
    changes = world.save_changes()
    world.move(world.ids()[30:50], moved[30:50])
    world.update()
    return world, changes


def snapshot():
    return world_at_work(), new_world().save()


def view():
    return jostle.World(threads=1), world_at_work()


def with_slots():
    world, slots = new_world(), jostle.PairSlots()
    world.update()
    slots.update(world.began(), world.ended())
    world.move(world.ids()[20:40], moved[20:40])
    world.update()
    return world, slots


def slots_of(made):
    world, slots = made
    return slots.save(), slots.began_slots(), slots.ended_slots(), slots.slots_of(world.pairs()), slots.end()


def tell(made):
    made[1].update(made[0].began(), made[0].ended())


WORLD_CALLS = {
    "update": lambda world: world.update(),
    "apply": lambda world: world.apply(),
    "update of moves": lambda world: world.update(world.ids()[10:50], moved[10:50]),
    "add": lambda world: world.add(others),
    "remove": lambda world: world.remove(world.ids()[20:40]),
    "move": lambda world: world.move(world.ids()[20:], moved[20:]),
    "move by": lambda world: world.move(world.ids()[20:], moved[20:], np.ones((40, 3))),
    "resize": lambda world: world.resize(world.ids()[20:], np.full((40, 3), 0.2)),
    "set_filter": lambda world: world.set_filter(world.ids()[20:], 2, 3),
    "set_margin": lambda world: world.set_margin(world.ids()[20:], 0.1),
    "set_enabled": lambda world: world.set_enabled(world.ids()[20:40], False),
    "set_user_data": lambda world: world.set_user_data(world.ids()[20:], 7),
    "report_again": lambda world: world.report_again(world.ids()[20:]),
    "clear": lambda world: world.clear(),
    "what it says": lambda world: (world.ids(), world.boxes(world.ids()), world.bounds(world.ids()), world.filters(world.ids()),
                                   world.enabled(world.ids()), world.user_data(world.ids()), world.margins(world.ids()),
                                   world.bounds_of_all(), len(world), world.index_end()),
    "lists": lambda world: (world.began(), world.ended(), world.persisted(), world.changed_pairs()),
    "pairs": lambda world: world.pairs(),
    "touching": lambda world: world.touching(world.ids()),
    "explain": lambda world: len(world.explain()) > 0,
    "save": lambda world: world.save(),
    "save_base": lambda world: world.save_base(),
    "fork": lambda world: world.fork(),
    "pickle": lambda world: pickle.loads(pickle.dumps(world)),
    "visit": lambda world: seen(world.visit, others[:1], chunk=2),
    "visit, which raises": lambda world: raised(lambda: world.visit(others[:1], lambda ids, at: [][0])),
    "visit_pairs": lambda world: seen(world.visit_pairs, chunk=7),
    "closest_pairs": lambda world: world.closest_pairs(200),
    "visit_closest_pairs": lambda world: seen(world.visit_closest_pairs, chunk=7, max_distance=0.1),
    "join": lambda world: world.join(others),
    "join, accepted": lambda world: world.join(others, accept=lambda position, index: index % 2 == 0),
    "all, accepted": lambda world: world.all(others[:5], asker=(3, 3), accept=lambda query, id: id % 2 == 0),
    "all, excluding": lambda world: world.all(others[:5], exclude=world.ids()[:5]),
}


def index_of_boxes():
    index = jostle.BoxIndex(boxes, threads=1)
    index.move(some, moved[:10])
    return index


INDEX_CALLS = {
    "build": lambda index: index.build(moved),
    "insert": lambda index: index.insert(np.arange(100, 140), others),
    "move": lambda index: index.move(each[20:], moved[20:]),
    "erase": lambda index: index.erase(each[20:40]),
    "clear": lambda index: index.clear(),
    "release_memory": lambda index: index.release_memory(),
    "what it says": lambda index: (index.contains(some), index.boxes(some), len(index), 3 in index),
    "pairs": lambda index: index.pairs(),
    "pairs of two": lambda index: index.pairs(jostle.BoxIndex(others, threads=1)),
    "closest_pairs": lambda index: index.closest_pairs(200),
    "closest_pairs of two": lambda index: index.closest_pairs(50, jostle.BoxIndex(others, threads=1)),
    "visit": lambda index: seen(index.visit, others[:1], chunk=2),
    "visit_pairs": lambda index: seen(index.visit_pairs, chunk=7),
    "visit_closest_pairs": lambda index: seen(index.visit_closest_pairs, chunk=7, max_distance=0.1),
    "join": lambda index: index.join(others),
    "all, accepted": lambda index: index.all(others[:5], category=each, mask=each + 1, owner=each, asker=(3, 3),
                                             accept=lambda query, id: id % 2 == 0),
    "all, excluding": lambda index: index.all(others[:5], exclude=some[:5]),
}
SHAPE_CALLS = {
    "first, rays": lambda of: of.first(lines, shapes, at),
    "first, moving": lambda of: of.first(jostle.shape_sweeps(movers, from_where, [[3.0, 0, 0], [3, 0, 0]]), shapes, at),
    "first, nearest": lambda of: of.first(jostle.nearest_to_shapes(movers, from_where), shapes, at),
    "all, rays": lambda of: of.all(lines, shapes, at),
    "all, moving": lambda of: of.all(jostle.shape_sweeps(movers, from_where, [[3.0, 0, 0], [3, 0, 0]]), shapes, at),
    "all, staying": lambda of: of.all(jostle.posed_shapes(movers, from_where), shapes, at),
    "all, nearest": lambda of: of.all(jostle.nearest_to_shapes(movers, from_where, 2), shapes, at),
    "any, count": lambda of: (of.any(lines, shapes, at), of.count(jostle.posed_shapes(movers, from_where), shapes, at)),
}
FINDER_CALLS = {
    "find": lambda finder: finder.find(shapes, at, pairs, 0.1),
    "find_points": lambda finder: finder.find_points(shapes, at, pairs, 0.1),
    "touching": lambda finder: finder.touching(shapes, at, pairs),
    "distances": lambda finder: finder.distances(shapes, at, pairs),
    "impacts": lambda finder: finder.impacts(shapes, ways, pairs),
    "first_touching": lambda finder: finder.first_touching(shapes, at, pairs, groups),
    "least_distances": lambda finder: finder.least_distances(shapes, at, pairs, groups, 0.2),
}
LISTS = {
    "append": lambda of: of.append(cube, 20),
    "extend": lambda of: of.extend([jostle.sphere(0.1)] + zoo),
    "extend by another": lambda of: of.extend(shapes),
    "set": lambda of: of.__setitem__(3, cube),
    "clear": lambda of: of.clear(),
}
MESH_CALLS = {
    "contains": lambda mesh: mesh.contains(others[:, 0]),
    "signed_distances": lambda mesh: mesh.signed_distances(others[:, 0]),
    "winding_numbers": lambda mesh: mesh.winding_numbers(others[:, 0]),
}


def cases(calls):
    return pytest.mark.parametrize("call", calls.values(), ids=calls.keys())


@cases(CALLS)
def test_of_no_object(call):
    assert starve(lambda: None, lambda made: call()) > 0


@pytest.mark.parametrize("skin", [0, 0.1])
def test_neighbor_finder(skin):
    def make():
        finder = jostle.NeighborFinder(skin=skin, threads=1)
        finder.find(boxes[:5, 0], 0.3)
        return finder

    def find(finder):
        return finder.find(boxes[:, 0], 0.3, [1.0, 1, 1], True, quantities="ijSDdo")

    assert starve(make, find, later=find) > 0


def test_neighbor_stream():
    def stream(finder):
        parts = []
        finder.stream(boxes[:, 0], 0.3, lambda *block: parts.append(block), [1.0, 1, 1], True, rows=17, quantities="ijSDdo")
        return parts

    assert starve(lambda: jostle.NeighborFinder(threads=1), stream, later=stream) > 0


@pytest.mark.parametrize("verb", ("near", "moving", "crossings"))
def test_surface_finder(verb):
    surface = jostle.Surface(np.arange(60).reshape(20, 3))

    def make():
        finder = jostle.SurfaceFinder(threads=1)
        finder.near(jostle.Surface([[0, 1, 2]]), boxes[:3, 0], 0.3)
        return finder

    def find(finder):
        if verb == "near":
            return tuple(finder.near(surface, boxes[:60, 0], 0.3, thickness=np.full(60, 0.01)))
        if verb == "moving":
            return tuple(finder.moving(surface, boxes[:60, 0], moved[:, 0], 0.1))
        return finder.crossings(surface, boxes[:60, 0])

    assert starve(make, find, later=find) > 0


def next_update(world):
    world.update()
    return known_of_world(world)


@pytest.mark.parametrize("name", WORLD_CALLS)
def test_world(name):
    # These queue a command for each object, as they say; repeated, they queue the same ones again.
    in_parts = name in ("move by", "resize", "set_filter", "set_margin", "set_enabled", "report_again")
    assert starve(world_at_work, WORLD_CALLS[name], known_of_world, next_update, in_parts) > 0


@pytest.mark.parametrize("accept", [lambda a, b: (a + b) % 2 == 0, lambda a, b: [][0]])
def test_world_that_asks(accept):
    assert starve(lambda: new_world(accept=accept), lambda world: raised(lambda: world.update()), lambda world: world.save()) > 0


def test_world_on_two_threads():
    def make():
        world = jostle.World(threads=2)
        world.add(boxes)
        return world

    assert starve(make, lambda world: world.update(), known_of_world, next_update) > 0


@pytest.mark.parametrize("kind", QUERIES)
@pytest.mark.parametrize("make", [world_at_work, index_of_boxes])
def test_queries(make, kind):
    asked = QUERIES[kind]
    known = known_of_index if make == index_of_boxes else known_of_world
    assert starve(make, lambda of: of.all(asked), known) > 0
    if not kind.startswith("nearest"):
        assert starve(make, lambda of: (of.any(asked), of.count(asked)), known) > 0
    if kind in ("rays", "sweeps"):
        assert starve(make, lambda of: of.first(asked), known) > 0


def test_snapshots():
    def restore(made):
        made[0].restore(made[1])

    assert starve(snapshot, restore, lambda made: known_of_world(made[0]), lambda made: next_update(made[0])) > 0

    assert starve(changed_world, lambda world: world.save_changes(), known_of_world) > 0
    assert starve(rolled_back, lambda made: made[0].restore_changes(made[1]), lambda made: known_of_world(made[0]),
                  lambda made: next_update(made[0])) > 0


def test_views():
    def known(made):
        return plain(made[0].ids()), plain(made[0].boxes(made[0].ids())), plain(made[0].all(everywhere))

    def follow_again(made):
        made[1].update()
        made[0].follow(made[1])
        return known(made)

    assert starve(view, lambda made: made[0].follow(made[1]), known, follow_again) > 0


def test_pair_slots():
    assert starve(with_slots, tell, slots_of, slots_of) > 0


@cases(INDEX_CALLS)
def test_index(call):
    assert starve(index_of_boxes, call, known_of_index) > 0


def index_of_shapes():
    return jostle.BoxIndex(shape_boxes, threads=1)


def world_of_shapes():
    world = jostle.World(threads=1)
    world.add(shape_boxes)
    world.update()
    return world


@cases(SHAPE_CALLS)
@pytest.mark.parametrize("make", [world_of_shapes, index_of_shapes])
def test_shapes_of(make, call):
    assert starve(make, call) > 0


@cases(FINDER_CALLS)
def test_contact_finder(call):
    assert starve(lambda: jostle.ContactFinder(threads=1), call, later=FINDER_CALLS["distances"]) > 0


@cases(MESH_CALLS)
def test_closed_mesh(call):
    assert starve(lambda: jostle.ClosedMesh(cube, threads=1), call, later=MESH_CALLS["contains"]) > 0


def test_closed_mesh_is_made():
    assert starve(lambda: None, lambda made: jostle.ClosedMesh(cube).contains(others[:, 0])) > 0


@cases(LISTS)
def test_lists_of_shapes(call):
    assert starve(lambda: jostle.Shapes(zoo[:6]), call, lambda made: made) > 0
