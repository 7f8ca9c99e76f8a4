/* SPDX-License-Identifier: MIT */
#ifndef JOSTLE_JOSTLE_H
#define JOSTLE_JOSTLE_H

/// Jostle for C and for every language that can call C: which boxes touch, and what follows from it. C99;
/// part of the library itself. docs/guide/c.md begins with a whole program;
/// docs/decisions/021-a-c-interface.md has the reasons. What things mean stands in the C++ headers beside
/// this one: each part names its own.
///
/// One rule for all functions, so that a binding can be generated (extras/jostle.json is this header as
/// JSON):
///
/// Name      jostle_OBJECT_VERB, with the object as the first parameter. Then what is read, then options,
///           then what is written, and last `jostle_error *error`. A parameter `void *handle` takes
///           handles of several kinds.
/// Status    every function returns JOSTLE_OK or why not. `error`, if it isn't NULL, is told the same in
///           words. After a failure the object is as it was, results of the call are empty or not to be used,
///           and what `out` points to is as it was. No C++ exception ever leaves a function.
/// Pointers  to const are read, others are written. None may be NULL unless the comment says so; an array of
///           no elements may. Nothing is kept beyond the call unless the comment says so.
/// Handles   are made by ..._new (shapes and executors by their kinds) and given back by jostle_free. Each
///           knows its kind: a handle of another kind, and one of the last 1024 that were freed, is
///           JOSTLE_BAD_HANDLE. What a handle was made with (an executor, a shape) lives as
///           long as it needs it: the order of freeing doesn't matter. A callback may neither free nor change
///           a handle that the call around it was given: that is an error, on every thread of its executor.
///           Commands to a world and work for an executor are no such changes.
/// Options   structs that begin with `struct_size` are set to zero, then struct_size to their sizeof. Zero is
///           the default of each member, and NULL in place of the struct is all defaults. A later version may
///           add members at the end; programs compiled before run on. Structs without struct_size never
///           change.
/// Space     a `jostle_space` says how many coordinates there are and of which type. Pointers to void are
///           arrays of such numbers, float or double, aligned as those are. A box is 2 dim numbers: lo, then
///           hi.
/// Threads   as the C++ object of the same name. Different handles may be used by different threads.
/// Callbacks get `context` as their first parameter and return an int32_t; less than 0 means that they
///           failed: the call ends with JOSTLE_CALLBACK_FAILED and the number in
///           jostle_error::callback_result. They are called from several threads at a time unless the comment
///           says otherwise; a serial executor (jostle_executor_serial) keeps them on the calling thread.

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && defined(JOSTLE_SHARED) && defined(JOSTLE_BUILDING)
#define JOSTLE_C_API __declspec(dllexport)
#elif defined(_WIN32) && defined(JOSTLE_SHARED)
#define JOSTLE_C_API __declspec(dllimport)
#elif defined(__GNUC__) && defined(JOSTLE_BUILDING)
#define JOSTLE_C_API __attribute__((visibility("default")))
#else
#define JOSTLE_C_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---------------------------------------------------------------------------------------------------------
// Constants: their types are of fixed width, since an enum's isn't the same with every compiler
// ---------------------------------------------------------------------------------------------------------

/// What a function returns. 1 to 99 are the codes of C++'s ErrorCode (error.hpp).
typedef int32_t jostle_status;
enum
{
    JOSTLE_OK = 0,
    JOSTLE_NAN_COORDINATE = 1,   ///< a bound of a box is NaN
    JOSTLE_INVERTED_BOX = 2,     ///< lo > hi on some axis
    JOSTLE_TOO_MANY_OBJECTS = 3, ///< more objects than a 32-bit index can name, or sizes that overflow
    JOSTLE_SIZE_MISMATCH = 4,    ///< per-object arrays of different lengths, or too short an array
    JOSTLE_INVALID_ARGUMENT = 5, ///< NULL, unaligned, or anything else that the comment forbids
    JOSTLE_STALE_ID = 6,         ///< an id that names no object of the world
    JOSTLE_BAD_SNAPSHOT = 7,     ///< cut short, altered, or of another kind of world
    JOSTLE_FILE_ERROR = 8,       ///< a recording that can't be written
    JOSTLE_OUT_OF_MEMORY = 100,
    JOSTLE_BAD_HANDLE = 101,      ///< freed, of another kind, or no handle at all
    JOSTLE_CALLBACK_FAILED = 102, ///< a callback returned less than 0
    JOSTLE_INTERNAL_ERROR = 103   ///< a mistake of Jostle's own: please report it
};

/// How many coordinates a point has, and their type.
typedef int32_t jostle_space;
enum
{
    JOSTLE_2F = 1, ///< 2 of float
    JOSTLE_3F = 2, ///< 3 of float
    JOSTLE_2D = 3, ///< 2 of double
    JOSTLE_3D = 4  ///< 3 of double
};

/// The order of pairs: jostle::Order.
typedef int32_t jostle_order;
enum
{
    JOSTLE_CANONICAL = 0, ///< by their place in space: the fastest
    JOSTLE_SORTED = 1     ///< ascending by (a, b)
};

/// The instruction sets there are kernels for. Results are the same on all.
typedef int32_t jostle_instruction_set;
enum
{
    JOSTLE_FASTEST = 0, ///< of those that this machine can run
    JOSTLE_SCALAR = 1,
    JOSTLE_SSE4 = 2,
    JOSTLE_AVX2 = 3,
    JOSTLE_AVX512 = 4,
    JOSTLE_NEON = 5,
    JOSTLE_WASM_SIMD = 6
};

/// A kind of query (query.hpp, shape_query.hpp), and the numbers of one: see jostle_queries.
typedef int32_t jostle_query_kind;
enum
{
    JOSTLE_RAY = 1,            ///< origin, direction, greatest fraction (INFINITY: no end): 2 dim + 1 numbers
    JOSTLE_SWEEP = 2,          ///< box, motion, greatest fraction: 3 dim + 1 numbers
    JOSTLE_BOX = 3,            ///< lo, hi: 2 dim numbers
    JOSTLE_SPHERE = 4,         ///< center, radius: dim + 1 numbers
    JOSTLE_FRUSTUM = 5,        ///< no numbers but a jostle_frustum
    JOSTLE_NEAREST = 6,        ///< point, greatest distance: dim + 1 numbers
    JOSTLE_NEAREST_TO_BOX = 7, ///< lo, hi, greatest distance: 2 dim + 1 numbers
    JOSTLE_SHAPE_SWEEP = 8,    ///< a shape, and its displacement: dim numbers
    JOSTLE_POSED_SHAPE = 9,    ///< a shape that stays: no numbers
    JOSTLE_NEAREST_TO_SHAPE = 10 ///< a shape, and the greatest distance: 1 number, or none for any distance
};

/// Why a pair of a world ended: jostle::EndReason.
typedef int32_t jostle_end_reason;
enum
{
    JOSTLE_MOVED_APART = 0,
    JOSTLE_REMOVED = 1,
    JOSTLE_DISABLED = 2,
    JOSTLE_FILTERED = 3
};

/// What a world draws of itself: jostle::DrawKind.
typedef int32_t jostle_draw_kind;
enum
{
    JOSTLE_DRAW_ACTIVE = 0,
    JOSTLE_DRAW_RESTING = 1,
    JOSTLE_DRAW_DISABLED = 2,
    JOSTLE_DRAW_BEGAN = 3,
    JOSTLE_DRAW_PERSISTED = 4,
    JOSTLE_DRAW_ENDED = 5
};

/// The types of shapes; a user's own have types from 16 on: jostle::ShapeTypes.
typedef int32_t jostle_shape_type;
enum
{
    JOSTLE_SHAPE_SPHERE = 0,
    JOSTLE_SHAPE_CAPSULE = 1,
    JOSTLE_SHAPE_BOX = 2,
    JOSTLE_SHAPE_CONVEX = 3,
    JOSTLE_SHAPE_HALF_SPACE = 4,
    JOSTLE_SHAPE_MESH = 5,
    JOSTLE_SHAPE_HEIGHT_FIELD = 6,
    JOSTLE_SHAPE_COMPOUND = 7,
    JOSTLE_SHAPE_ROUNDED_BOX = 8,
    JOSTLE_SHAPE_ROUNDED_HULL = 9,
    JOSTLE_SHAPE_CYLINDER = 10,
    JOSTLE_SHAPE_CONE = 11,
    JOSTLE_SHAPE_ELLIPSOID = 12, ///< in 2D an ellipse
    JOSTLE_SHAPE_FIRST_CUSTOM = 16
};

/// What a pair of a surface consists of.
typedef int32_t jostle_part_kind;
enum
{
    JOSTLE_VERTEX_TRIANGLE = 1, ///< the vertex, then the triangle's three
    JOSTLE_EDGE_EDGE = 2        ///< the two ends of one, then those of the other
};

/// The type of the numbers that jostle_sum_by_object adds up.
typedef int32_t jostle_number;
enum
{
    JOSTLE_FLOAT = 1,
    JOSTLE_DOUBLE = 2,
    JOSTLE_INT64 = 3
};

// ---------------------------------------------------------------------------------------------------------
// Handles: and what passes by value
// ---------------------------------------------------------------------------------------------------------

typedef struct jostle_executor jostle_executor;               ///< where work runs
typedef struct jostle_results jostle_results;                 ///< what a call found, owned by the caller
typedef struct jostle_finder jostle_finder;                   ///< jostle::PairFinder
typedef struct jostle_images jostle_images;                   ///< jostle::PeriodicImages
typedef struct jostle_neighbor_finder jostle_neighbor_finder; ///< jostle::NeighborFinder
typedef struct jostle_index jostle_index;                     ///< jostle::BoxIndex
typedef struct jostle_world jostle_world;                     ///< jostle::World
typedef struct jostle_pair_slots jostle_pair_slots;           ///< jostle::PairSlots
typedef struct jostle_shape jostle_shape;                     ///< jostle::Shape, with what it points to
typedef struct jostle_shapes jostle_shapes;                   ///< one shape per object
typedef struct jostle_contact_finder jostle_contact_finder;   ///< jostle::ContactFinder
typedef struct jostle_closed_mesh jostle_closed_mesh;         ///< jostle::ClosedMesh
typedef struct jostle_surface jostle_surface;                 ///< jostle::Surface
typedef struct jostle_surface_finder jostle_surface_finder;   ///< jostle::SurfaceFinder
typedef struct jostle_recorder jostle_recorder;               ///< jostle::Recorder

/// Names an object of a world: the index in the low 32 bits, the generation in the high ones. Always less
/// than 2^53, so that a double holds it exactly. 0 names nothing.
typedef uint64_t jostle_id;

/// What went wrong, in words.
typedef struct jostle_error
{
    jostle_status status;
    int32_t callback_result; ///< of the callback that failed; else 0
    uint64_t index;          ///< the lowest object at fault; UINT64_MAX where none is
    char message[496];       ///< UTF-8, ends with a zero, cut short where it is longer
} jostle_error;

/// One value per object, `stride` bytes apart (any multiple of the value's size; also negative, or 0). `data`
/// NULL and `count` 0: not given.
typedef struct jostle_values
{
    const void* data;
    uint64_t count;
    int64_t stride;
} jostle_values;

/// Boxes in the caller's memory, read in place: jostle::BoxView. lo[axis] points to the first box's lower
/// bound on that axis, the next box's is `stride` bytes further on. Covers arrays of boxes, boxes inside
/// bigger structs, one array per coordinate. jostle_boxes_strided fills it in.
typedef struct jostle_boxes
{
    const void* lo[3]; ///< the last is not used in 2D
    const void* hi[3];
    uint64_t count;
    int64_t stride;
} jostle_boxes;

/// Two touching objects, by their positions in the input.
typedef struct jostle_pair
{
    uint32_t a, b;
} jostle_pair;

/// Some items, one after another.
typedef struct jostle_block
{
    const void* items;
    uint64_t count;
} jostle_block;

/// All items of a result, in its order: pairs (jostle_pair) or contacts (jostle_contact_...). What is given
/// to a function as pairs may be one block of the caller's own.
typedef struct jostle_blocks
{
    const jostle_block* blocks;
    uint64_t block_count;
    uint64_t count;     ///< of the items of all blocks
    uint64_t item_size; ///< in bytes
} jostle_blocks;

/// The answers to many queries. Those to query i are [first[i], first[i + 1]) of `ids` and `at`.
typedef struct jostle_lists
{
    uint64_t queries;
    uint64_t count;        ///< of all answers
    const uint64_t* first; ///< queries + 1 of them
    const uint64_t* ids;   ///< of an index each below 2^32; of a world a jostle_id
    const double* at;      ///< as in jostle_hit; NULL where the queries have none
    const uint8_t* more;   ///< whether query i has more answers than were asked for
} jostle_lists;

/// An object found along a ray or sweep, or near something: jostle::Hit.
typedef struct jostle_hit
{
    uint64_t id; ///< of an index: UINT64_MAX where there is none; of a world: 0
    double at;   ///< the fraction; of the nearest boxes the squared distance, of the nearest shapes the
                 ///< distance; a space of floats has it rounded to float
} jostle_hit;

/// Objects with a shape and a pose. A pose is a position and, in 3D, a quaternion x, y, z, w; in 2D cosine
/// and sine: 7 or 4 numbers of the space. Where a motion is wanted, linear and angular velocity follow: 13 or
/// 7 numbers.
typedef struct jostle_objects
{
    const jostle_shapes* shapes;
    jostle_values poses;
} jostle_objects;

/// The space inside some planes: jostle::Frustum. A plane is normal and offset: dim + 1 numbers.
typedef struct jostle_frustum
{
    const void* planes;
    uint64_t count;
} jostle_frustum;

/// Queries of one kind.
typedef struct jostle_queries
{
    jostle_query_kind kind;
    uint32_t nearest;     ///< of the nearest kinds: how many are wanted of each query; 0, as in a struct of
                          ///< zeros: one (C++ and Python, where it isn't the default, find none)
    jostle_values values; ///< numbers of the space, those of one query one after another. The stride is at
                          ///< least the size of a query, or that size and less than 0
    const jostle_objects* shapes; ///< of the kinds that have a shape, one for each query, whose number they
                                  ///< are; else NULL
} jostle_queries;

/// The version of the library that runs.
/// Errors    none but NULL.
JOSTLE_C_API jostle_status jostle_version(uint32_t* major, uint32_t* minor, uint32_t* patch,
                                          jostle_error* error);

/// The name of a status, such as "nan_coordinate". It lives for ever.
JOSTLE_C_API jostle_status jostle_status_name(jostle_status status, const char** name, jostle_error* error);

/// The instruction sets that were compiled in and that this machine can run, fastest first. They live for
/// ever.
JOSTLE_C_API jostle_status jostle_instruction_sets(const jostle_instruction_set** sets, uint64_t* count,
                                                   jostle_error* error);
JOSTLE_C_API jostle_status jostle_instruction_set_name(jostle_instruction_set set, const char** name,
                                                       jostle_error* error);

/// Gives back a handle of any kind, or does nothing with NULL.
JOSTLE_C_API jostle_status jostle_free(void* handle, jostle_error* error);
/// How many objects an index or a world has, in a world as of the last update or jostle_world_apply; or how
/// many shapes a jostle_shapes has.
JOSTLE_C_API jostle_status jostle_size(const void* handle, uint64_t* size, jostle_error* error);
/// Makes an index, a world or a jostle_shapes empty: a world becomes what it was when it was made.
JOSTLE_C_API jostle_status jostle_clear(void* handle, jostle_error* error);
/// Gives back the working memory of a jostle_finder, jostle_neighbor_finder, jostle_surface_finder or
/// jostle_index: what their last call handed out is gone, and so is what a neighbor finder's skin keeps.
JOSTLE_C_API jostle_status jostle_release_memory(void* handle, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Threads and memory: executor.hpp
// ---------------------------------------------------------------------------------------------------------

/// Calls task(task_context, i) once for each i in [0, count), in any order, on any threads, and returns after
/// the last. Tasks never fail.
typedef int32_t (*jostle_run_function)(void* context, uint32_t count,
                                       void (*task)(void* task_context, uint32_t i), void* task_context);

/// Everything on the calling thread.
JOSTLE_C_API jostle_status jostle_executor_serial(jostle_executor** out, jostle_error* error);
/// What calls use that are given none, with at most `threads` threads, 0 for all: oneTBB's, or threads of its
/// own where the library was built without oneTBB.
JOSTLE_C_API jostle_status jostle_executor_default(uint32_t threads, jostle_executor** out,
                                                   jostle_error* error);
/// A pool of its own; 0 for as many threads as the machine has cores.
JOSTLE_C_API jostle_status jostle_executor_threads(uint32_t threads, jostle_executor** out,
                                                   jostle_error* error);
/// The host's own job system. `run` and `context` are kept until the executor is freed and nothing uses it.
JOSTLE_C_API jostle_status jostle_executor_callback(uint32_t concurrency, jostle_run_function run,
                                                    void* context, jostle_executor** out,
                                                    jostle_error* error);
JOSTLE_C_API jostle_status jostle_executor_concurrency(const jostle_executor* executor, uint32_t* threads,
                                                       jostle_error* error);

/// Where memory comes from. Both functions are called from several threads at a time and must not fail but by
/// returning NULL, which ends the call with JOSTLE_OUT_OF_MEMORY. They and `context` must outlive every
/// handle that was made with them.
typedef struct jostle_allocator
{
    uint64_t struct_size;
    void* context;
    void* (*allocate)(void* context, uint64_t size, uint64_t alignment);
    void (*deallocate)(void* context, void* memory, uint64_t size, uint64_t alignment);
} jostle_allocator;

/// What every handle that works can be made with: jostle::FinderOptions.
typedef struct jostle_options
{
    uint64_t struct_size;
    const jostle_executor* executor;   ///< NULL: the default executor
    const jostle_allocator* allocator; ///< NULL: new and delete
    jostle_instruction_set instruction_set;
    int32_t all_points; ///< 1: a contact for each triangle, jostle::ContactOptions::all_points
} jostle_options;

// ---------------------------------------------------------------------------------------------------------
// Boxes: box.hpp
// ---------------------------------------------------------------------------------------------------------

#ifdef __cplusplus
#define JOSTLE_BYTES(pointer) static_cast<const char*>(pointer)
#else
#define JOSTLE_BYTES(pointer) ((const char*)(pointer))
#endif
/// Boxes inside structs: `lo` and `hi` point to the dim consecutive coordinates of the first box, the next
/// box's are `stride` bytes further on. For packed boxes hi is lo + dim numbers and stride 2 dim numbers.
/// Can't fail: whoever is given the boxes checks them. Other languages fill the struct in themselves.
static inline jostle_boxes jostle_boxes_strided(jostle_space space, const void* lo, const void* hi,
                                                uint64_t count, int64_t stride)
{
    jostle_boxes boxes = {{NULL, NULL, NULL}, {NULL, NULL, NULL}, 0, 0};
    const int axes = space == JOSTLE_2F || space == JOSTLE_2D ? 2 : 3;
    const int bytes = space == JOSTLE_2D || space == JOSTLE_3D ? 8 : 4; /* of a number */
    int d;
    for (d = 0; d < axes; ++d) {
        if (lo != NULL) boxes.lo[d] = JOSTLE_BYTES(lo) + d * bytes;
        if (hi != NULL) boxes.hi[d] = JOSTLE_BYTES(hi) + d * bytes;
    }
    boxes.count = count;
    boxes.stride = stride;
    return boxes;
}
#undef JOSTLE_BYTES
/// Fails as every search would with these boxes, or does nothing. Cost: one pass.
JOSTLE_C_API jostle_status jostle_boxes_check(jostle_space space, const jostle_boxes* boxes,
                                              jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Results
// ---------------------------------------------------------------------------------------------------------

/// An empty result, to be filled by a call and filled again by the next. What the functions below hand out is
/// valid until then. Its memory is used again: a call like the one before allocates nothing. `options` may be
/// NULL; its allocator alone counts.
JOSTLE_C_API jostle_status jostle_results_new(const jostle_options* options, jostle_results** out,
                                              jostle_error* error);
/// The pairs or contacts of a result.
JOSTLE_C_API jostle_status jostle_results_blocks(const jostle_results* results, jostle_blocks* out,
                                                 jostle_error* error);
/// The lists of answers of a result.
JOSTLE_C_API jostle_status jostle_results_lists(const jostle_results* results, jostle_lists* out,
                                                jostle_error* error);
/// The bytes of a snapshot, or of a text (which a zero follows).
JOSTLE_C_API jostle_status jostle_results_bytes(const jostle_results* results, const void** bytes,
                                                uint64_t* count, jostle_error* error);
/// Copies all blocks into one array with room for `room` items.
/// Errors    JOSTLE_SIZE_MISMATCH if that is too small.
JOSTLE_C_API jostle_status jostle_blocks_copy(const jostle_blocks* blocks, uint64_t room, void* out,
                                              jostle_error* error);
/// An order-independent fingerprint of pairs: jostle::pair_checksum.
JOSTLE_C_API jostle_status jostle_pair_checksum(const jostle_blocks* pairs, uint64_t* checksum,
                                                jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Pairs: find_pairs.hpp
// ---------------------------------------------------------------------------------------------------------

/// 1: the pair is wanted. 0: it isn't.
typedef int32_t (*jostle_accept_pair_function)(void* context, uint32_t a, uint32_t b);

/// Which pairs are wanted: jostle::Filter and, between two sets, jostle::CrossFilter. The values are
/// uint32_t, one per object; those not given filter nothing. Members that end in _b are for the second set.
typedef struct jostle_filter
{
    uint64_t struct_size;
    jostle_values category, mask; ///< give both or neither
    jostle_values owner;          ///< objects of one owner never pair; UINT32_MAX belongs to nobody
    jostle_values category_b, mask_b;
    jostle_values owner_b;
    jostle_accept_pair_function accept; ///< may be NULL
    void* context;
    uint64_t ghosts;        ///< the last so many boxes of one set meet the others, and not each other
    jostle_values vertices; ///< three uint32_t an object; with one in common, not UINT32_MAX, they don't pair
} jostle_filter;

/// 1: the pair of that scene is wanted. 0: it isn't.
typedef int32_t (*jostle_accept_scene_pair_function)(void* context, uint64_t scene, uint32_t a, uint32_t b);

/// The same for many scenes: jostle::SceneFilter. One value for each box of all scenes.
typedef struct jostle_scene_filter
{
    uint64_t struct_size;
    jostle_values category, mask; ///< give both or neither
    jostle_values owner;
    jostle_accept_scene_pair_function accept; ///< may be NULL
    void* context;
} jostle_scene_filter;

/// What the last search did: jostle::Stats.
typedef struct jostle_stats
{
    uint64_t struct_size; ///< set by the caller; what the caller's struct doesn't have isn't written
    uint64_t objects, pairs, records, candidates, ties, bricks, nested_grids, bytes_reserved;
    double ms_total, ms_tune, ms_scatter, ms_sweep, ms_finish;
} jostle_stats;

/// Takes a piece of the result: jostle::PairChunk. 1: go on. 0: stop the search.
typedef int32_t (*jostle_sink_function)(void* context, const jostle_pair* pairs, uint64_t count,
                                        uint64_t block, uint64_t part);

/// `options` may be NULL. One finder serves boxes of every space.
JOSTLE_C_API jostle_status jostle_finder_new(const jostle_options* options, jostle_finder** out,
                                             jostle_error* error);
/// All pairs among `a` or, if `b` isn't NULL, of one box of `a` and one of `b`. `filter` may be NULL. The
/// pairs lie in the finder and are valid until its next call.
/// Cost      expected linear in boxes and pairs.
JOSTLE_C_API jostle_status jostle_finder_find(jostle_finder* finder, jostle_space space,
                                              const jostle_boxes* a, const jostle_boxes* b,
                                              const jostle_filter* filter, jostle_order order,
                                              jostle_blocks* pairs, jostle_error* error);
/// The same, and the caller owns the pairs.
JOSTLE_C_API jostle_status jostle_finder_take(jostle_finder* finder, jostle_space space,
                                              const jostle_boxes* a, const jostle_boxes* b,
                                              const jostle_filter* filter, jostle_order order,
                                              jostle_results* results, jostle_error* error);
/// The pairs of many scenes that have nothing to do with each other: jostle::PairFinder::find_scenes.
/// Scene k is the boxes from number offsets[k] up to offsets[k + 1]: there are scene_count + 1 offsets, the
/// first 0 and the last the number of boxes. Block k of `pairs` has the pairs of scene k, and is empty if it
/// has none; they are numbered within their scene. `filter` may be NULL. The pairs lie in the finder and are
/// valid until its next call.
/// Errors    for offsets and boxes, with their number.
JOSTLE_C_API jostle_status jostle_finder_find_scenes(jostle_finder* finder, jostle_space space,
                                                     const jostle_boxes* boxes, const uint64_t* offsets,
                                                     uint64_t scene_count, const jostle_scene_filter* filter,
                                                     jostle_blocks* pairs, jostle_error* error);
/// Hands the pairs to `sink` instead of storing them. `finished` becomes 0 if the sink stopped it, else 1.
JOSTLE_C_API jostle_status jostle_finder_stream(jostle_finder* finder, jostle_space space,
                                                const jostle_boxes* a, const jostle_boxes* b,
                                                const jostle_filter* filter, jostle_sink_function sink,
                                                void* context, int32_t* finished, jostle_error* error);
JOSTLE_C_API jostle_status jostle_finder_stats(const jostle_finder* finder, jostle_stats* stats,
                                               jostle_error* error);

/// Once, without a finder. `b`, `filter` and `options` may be NULL.
JOSTLE_C_API jostle_status jostle_find_pairs(jostle_space space, const jostle_boxes* a, const jostle_boxes* b,
                                             const jostle_filter* filter, jostle_order order,
                                             const jostle_options* options, jostle_results* results,
                                             jostle_error* error);
/// The definition: every box against every other, ascending by (a, b). For checking results.
JOSTLE_C_API jostle_status jostle_find_pairs_brute_force(jostle_space space, const jostle_boxes* a,
                                                         const jostle_boxes* b, const jostle_filter* filter,
                                                         jostle_results* results, jostle_error* error);

/// Writes an order of the boxes along space into `order`, one number per box: order[k] is the position of the
/// box that comes k-th. See jostle::spatial_order. `options` may be NULL.
JOSTLE_C_API jostle_status jostle_spatial_order(jostle_space space, const jostle_boxes* boxes,
                                                const jostle_options* options, uint32_t* order,
                                                jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Periodic space: periodic.hpp
// ---------------------------------------------------------------------------------------------------------

/// What boxes and their images are. Everything is valid until the next build.
typedef struct jostle_images_view
{
    jostle_boxes boxes;     ///< the originals, then the images
    const uint32_t* origin; ///< of which box each one is an image; an original is its own
    const void* shift;      ///< how far each one is from its origin: dim numbers
    uint64_t originals;     ///< how many of the boxes are
} jostle_images_view;

/// `options` may be NULL.
JOSTLE_C_API jostle_status jostle_images_new(jostle_space space, const jostle_options* options,
                                             jostle_images** out, jostle_error* error);
/// Copies the boxes and adds the images of those near an end of a periodic axis. `period`: its length along
/// each axis, dim numbers, 0 where space doesn't repeat itself.
/// Cost      two passes over the boxes and a copy of them.
/// Errors    a box that is half a period long or longer, and not infinite both ways; one that reaches two
///           periods up from the lowest of all; a period that is negative, infinite or NaN.
JOSTLE_C_API jostle_status jostle_images_build(jostle_images* images, const jostle_boxes* boxes,
                                               const void* period, jostle_error* error);
JOSTLE_C_API jostle_status jostle_images_view_read(const jostle_images* images, jostle_images_view* out,
                                                   jostle_error* error);
/// The filter that a search among the boxes of the view has to be given, so that each pair is found once.
/// `out->owner_b` sees to that, so leave it as it is. `accept` and `context` may be set on `out`: that accept
/// is called with numbers of the view's boxes, an original's and a greater one, which lead to the shift.
/// `originals` may be NULL; its arrays have one value per original, and its accept is called with originals.
/// What it points to must outlive the search. `out` is valid until the next build or filter.
JOSTLE_C_API jostle_status jostle_images_filter(jostle_images* images, const jostle_filter* originals,
                                                jostle_filter* out, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Neighbor lists: neighbors.hpp
// ---------------------------------------------------------------------------------------------------------

/// What a search for neighbours is given. Numbers are those of the finder's space, side by side; of cutoff,
/// radii and table exactly one is given.
typedef struct jostle_neighbor_query
{
    uint64_t struct_size;
    const void* points; ///< dim numbers each
    uint64_t count;
    const void* others; ///< a second set; NULL: neighbours are among the points
    uint64_t other_count;
    const uint64_t* offsets; ///< many systems: where the points of each begin, and the end; NULL: one system
    uint64_t system_count;   ///< one less than offsets
    double cutoff;           ///< for all pairs; rounded to the space's numbers
    const void* radii;       ///< one for each point, of the second set as well: a pair's cutoff is their sum
    const void* radii_b;
    const uint32_t* types; ///< one for each point, below type_count
    const uint32_t* types_b;
    const void* table; ///< of type_count * type_count cutoffs
    uint64_t type_count;
    const void* cells;                  ///< dim vectors of dim numbers each
    const int32_t* repeats;             ///< dim for each cell: 1 where space repeats itself along the vector
    uint64_t cell_count;                ///< 0: open space; 1; of many systems also one for each
    int32_t half;                       ///< 1: each pair once; not for two sets
    int32_t shifts, vectors, distances; ///< 1 for each that the list is to have
    double skin;     ///< 0, or by how much further is looked and kept: NeighborOptions::skin
    int32_t greater; ///< 1: a pair's cutoff is the greater of its two radii, not their sum
} jostle_neighbor_query;

/// The neighbours of point i are neighbors[k], for k from offsets[i] to offsets[i + 1] - 1, ascending. Valid
/// until the finder's next call.
typedef struct jostle_neighbor_list
{
    const uint64_t* offsets; ///< one more than points
    const uint32_t* neighbors;
    uint64_t count;
    const int32_t* shifts; ///< of the neighbour, in periods: dim numbers; NULL where not wanted
    const void* vectors;   ///< to the neighbour's image: dim numbers of the space; NULL where not wanted
    const void* distances; ///< NULL where not wanted
    int32_t searched;      ///< 0 if a list that a skin had kept was enough
} jostle_neighbor_list;

/// `options` may be NULL.
JOSTLE_C_API jostle_status jostle_neighbor_finder_new(jostle_space space, const jostle_options* options,
                                                      jostle_neighbor_finder** out, jostle_error* error);
/// For each point all points within a cutoff, with their images where space repeats itself; of many systems,
/// within each. What exactly, where points may lie, and what is an error, says NeighborFinder in
/// neighbors.hpp.
JOSTLE_C_API jostle_status jostle_neighbor_finder_find(jostle_neighbor_finder* finder,
                                                       const jostle_neighbor_query* query,
                                                       jostle_neighbor_list* list, jostle_error* error);
/// Takes rows of a list: those of the points from `first` to first + rows - 1, which are rows 0 to rows - 1
/// of `list`. 1: go on. 0: stop.
typedef int32_t (*jostle_neighbor_sink_function)(void* context, uint64_t first, uint64_t rows,
                                                 const jostle_neighbor_list* list);
/// Hands the list to `sink` in blocks of so many rows instead of storing all of it. Not for many systems, nor
/// with a skin. `finished` becomes 0 if the sink stopped it, else 1.
JOSTLE_C_API jostle_status jostle_neighbor_finder_stream(jostle_neighbor_finder* finder,
                                                         const jostle_neighbor_query* query, uint64_t rows,
                                                         jostle_neighbor_sink_function sink, void* context,
                                                         int32_t* finished, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Queries: about the boxes in an index or a world, and the shapes in them (queries.hpp, shape_query.hpp)
// ---------------------------------------------------------------------------------------------------------

/// 1: the object may be an answer to the query of this number. 0: not.
typedef int32_t (*jostle_accept_answer_function)(void* context, uint32_t query, uint64_t id);

/// The asker, as an object of a filter. In a world category and mask filter nothing if both are UINT32_MAX,
/// and else both do: an object whose mask is 0 is then not found.
typedef struct jostle_asker
{
    uint32_t category, mask;
    uint32_t owner; ///< objects of this owner aren't found; UINT32_MAX belongs to nobody
} jostle_asker;

/// Which objects a query is about: jostle::QueryFilter and jostle::ObjectQueryFilter.
typedef struct jostle_query_filter
{
    uint64_t struct_size;
    jostle_values category, mask, owner;  ///< uint32_t by id; of an index alone: a world knows its objects'
    const jostle_asker* asker;            ///< NULL: one whose category and mask have all bits, without owner
    const uint64_t* exclude;              ///< an object that doesn't count; NULL: none; nor does a hit's id
                                          ///< where there was none exclude any
    jostle_accept_answer_function accept; ///< may be NULL
    void* context;
    uint64_t count; ///< more than 1: so many filters lie here, one for each query, as far apart as
                    ///< struct_size says; the first one's count counts. 0 or 1: it serves all queries
} jostle_query_filter;

// `handle` is a jostle_index or a jostle_world; a world answers as of the last update or jostle_world_apply.

/// The least box around all, in a world around the bounds of all that aren't disabled: 2 dim numbers. `any`
/// becomes 0 where there are none, else 1.
JOSTLE_C_API jostle_status jostle_query_bounds(const void* handle, int32_t* any, void* box,
                                               jostle_error* error);

// Boxes and shapes are asked about by five verbs. `objects` is NULL where boxes are asked about; or it has a
// shape and a pose for every id of the index, or every index of an id of the world, and the shapes in the
// boxes are. Of boxes any, count, all and visit take JOSTLE_RAY to JOSTLE_FRUSTUM, first takes JOSTLE_RAY and
// JOSTLE_SWEEP; of shapes any, count, all and visit take JOSTLE_RAY, JOSTLE_SHAPE_SWEEP and
// JOSTLE_POSED_SHAPE, first takes the first two. first, all and visit take the nearest kinds, too, those to
// shapes with objects. One query is answered on the calling thread, more on the executor. `filter` may be
// NULL. Errors are those of C++'s jostle::Queries.

/// Whether there is any answer, 1 or 0: any[i].
JOSTLE_C_API jostle_status jostle_query_any(const void* handle, const jostle_queries* queries,
                                            const jostle_objects* objects, const jostle_query_filter* filter,
                                            uint8_t* any, jostle_error* error);
/// How many there are: counts[i].
JOSTLE_C_API jostle_status jostle_query_count(const void* handle, const jostle_queries* queries,
                                              const jostle_objects* objects,
                                              const jostle_query_filter* filter, uint64_t* counts,
                                              jostle_error* error);
/// What each query meets first, or is nearest to: hits[i]. `details` may be NULL; of boxes it isn't used, of
/// shapes details[i] becomes a jostle_cast_hit_... of the space or, nearest to a shape, what
/// jostle_contact_finder_distances gives, the asker being a. Its fraction, or distance, is infinite where
/// there is nothing.
JOSTLE_C_API jostle_status jostle_query_first(const void* handle, const jostle_queries* queries,
                                              const jostle_objects* objects,
                                              const jostle_query_filter* filter, jostle_hit* hits,
                                              void* details, jostle_error* error);
/// All answers, along rays and sweeps and near something ascending by (at, id), else by id; no more than
/// max_results each: UINT64_MAX for all. The results have lists and, of casts and the nearest among shapes,
/// the details of all lists as blocks.
JOSTLE_C_API jostle_status jostle_query_all(const void* handle, const jostle_queries* queries,
                                            const jostle_objects* objects, const jostle_query_filter* filter,
                                            uint64_t max_results, jostle_results* results,
                                            jostle_error* error);
/// Takes an answer; `details` as of jostle_query_first, or NULL. 1: go on. 0: stop. Called on the calling
/// thread. Where answers have an order, nothing further than *bound, in the units of `at`, comes from then
/// on: it may be made less. Else `at` is 0 and `bound` NULL. May ask the same index or world.
typedef int32_t (*jostle_visit_answer_function)(void* context, uint64_t id, double at, const void* details,
                                                double* bound);
/// Hands the answers to one query to `visit`, each once, as they are found, in the order of jostle_query_all;
/// those of regions in an order of its own. `finished` becomes 0 if it stopped that, else 1.
JOSTLE_C_API jostle_status jostle_query_visit(const void* handle, const jostle_queries* query,
                                              const jostle_objects* objects,
                                              const jostle_query_filter* filter,
                                              jostle_visit_answer_function visit, void* context,
                                              int32_t* finished, jostle_error* error);
/// The definition that answers go back to: for each query of boxes, all but JOSTLE_POSED_SHAPE and its like,
/// whether this box answers it, 1 or 0, and its jostle_hit::at, 0 for regions. `box`: 2 dim numbers.
JOSTLE_C_API jostle_status jostle_box_answers(jostle_space space, const jostle_queries* queries,
                                              const void* box, uint8_t* answers, double* at,
                                              jostle_error* error);

/// All pairs of one of `boxes` and an object whose box it touches, ascending by (a, b): a is the position in
/// `boxes`, b the object's id in an index, or its index in a world. One call at a time. `filter` may be NULL.
JOSTLE_C_API jostle_status jostle_query_join(const void* handle, const jostle_boxes* boxes,
                                             const jostle_query_filter* filter, jostle_results* results,
                                             jostle_error* error);
/// Takes two objects and the squared distance between their boxes. 1: go on. 0: stop. Called on the calling
/// thread. Nothing further than *bound comes from then on: it may be made less.
typedef int32_t (*jostle_visit_close_pair_function)(void* context, uint64_t a, uint64_t b, double at,
                                                    double* bound);
/// Hands over the pairs of objects no further apart than max_distance (it may be infinite): of two of this
/// structure's if `other` is NULL or the same, else of one of this and one of the other of its kind. First
/// come those at distance 0, then the others ascending by (at, a, b). In one world, pairs that filters
/// forbid are left out, and pairs that touch and that `accept` refused; about pairs apart it hasn't been
/// asked.
/// `finished` becomes 0 if `visit` stopped that, else 1.
JOSTLE_C_API jostle_status jostle_query_closest_pairs(const void* handle, const void* other,
                                                      double max_distance,
                                                      jostle_visit_close_pair_function visit, void* context,
                                                      int32_t* finished, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Indexes: of boxes that stay (box_index.hpp)
// ---------------------------------------------------------------------------------------------------------

/// What an index is made of: jostle::IndexStats.
typedef struct jostle_index_stats
{
    uint64_t struct_size; ///< set by the caller
    uint64_t objects, pages, leaves, nodes, depth, bytes, sorts, splits;
} jostle_index_stats;

/// `options` may be NULL.
JOSTLE_C_API jostle_status jostle_index_new(jostle_space space, const jostle_options* options,
                                            jostle_index** out, jostle_error* error);
/// Forgets everything and takes these boxes. Box i gets the id ids[i] or, if `ids` is NULL, i. Below, too,
/// there are as many ids as boxes.
JOSTLE_C_API jostle_status jostle_index_build(jostle_index* index, const uint32_t* ids,
                                              const jostle_boxes* boxes, jostle_error* error);
/// No id may be in the index already, or twice in the call.
JOSTLE_C_API jostle_status jostle_index_insert(jostle_index* index, const uint32_t* ids,
                                               const jostle_boxes* boxes, jostle_error* error);
/// Every id must be in the index, and once in the call.
JOSTLE_C_API jostle_status jostle_index_erase(jostle_index* index, const uint32_t* ids, uint64_t count,
                                              jostle_error* error);
JOSTLE_C_API jostle_status jostle_index_move(jostle_index* index, const uint32_t* ids,
                                             const jostle_boxes* boxes, jostle_error* error);
/// contains[i] becomes 1 if ids[i] is in the index, else 0.
JOSTLE_C_API jostle_status jostle_index_contains(const jostle_index* index, const uint32_t* ids,
                                                 uint64_t count, uint8_t* contains, jostle_error* error);
/// The boxes of objects that are in the index: 2 dim numbers each.
JOSTLE_C_API jostle_status jostle_index_boxes(const jostle_index* index, const uint32_t* ids, uint64_t count,
                                              void* boxes, jostle_error* error);
JOSTLE_C_API jostle_status jostle_index_stats_read(const jostle_index* index, jostle_index_stats* stats,
                                                   jostle_error* error);

/// Hands over the pairs of objects whose boxes touch: of two of this index if `other` is NULL or this index,
/// else of one of this and one of the other, in an order of the indexes' own. `at` is 0, and `bound` NULL.
/// `finished` becomes 0 if `visit` stopped that, else 1.
JOSTLE_C_API jostle_status jostle_index_pairs(const jostle_index* index, const jostle_index* other,
                                              jostle_visit_close_pair_function visit, void* context,
                                              int32_t* finished, jostle_error* error);
// ---------------------------------------------------------------------------------------------------------
// Worlds: of objects that live, move and rest, and the pairs between them (world.hpp)
// ---------------------------------------------------------------------------------------------------------

/// Whom an object pairs with: jostle::ObjectFilter. Begin with what objects have that are given none:
///     jostle_object_filter filter = JOSTLE_OBJECT_FILTER_DEFAULTS;
/// 0 is a value like any other: objects whose owner is 0 belong to one owner, and never pair.
typedef struct jostle_object_filter
{
    uint32_t category;
    uint32_t mask;
    uint32_t owner;    ///< objects of one owner never pair; UINT32_MAX belongs to nobody
    int32_t is_static; ///< 1: never pairs with static ones
} jostle_object_filter;
#define JOSTLE_OBJECT_FILTER_DEFAULTS {1, UINT32_MAX, UINT32_MAX, 0}

/// 1: the pair may begin. 0: not. Called in update() on its thread, in ascending order of the pairs.
typedef int32_t (*jostle_accept_object_pair_function)(void* context, jostle_id a, jostle_id b);

/// A category and mask that queries have: jostle::QueryLayer.
typedef struct jostle_query_layer
{
    uint32_t category;
    uint32_t mask;
} jostle_query_layer;

/// jostle::WorldOptions. `context` and what accept needs must outlive the world.
typedef struct jostle_world_options
{
    uint64_t struct_size;
    const jostle_options* common; ///< may be NULL
    double margin;
    jostle_accept_object_pair_function accept; ///< may be NULL
    void* context;
    const jostle_query_layer* layers; ///< queries with one of these have indexes of their own; may be NULL
    uint64_t layer_count;             ///< at most 8
} jostle_world_options;

/// What new objects are like: jostle::ObjectOptions.
typedef struct jostle_object_options
{
    uint64_t struct_size;
    const jostle_object_filter* filter; ///< NULL: pairs with all
    double margin;
    int32_t disabled;   ///< 1: keeps its id and box, touches nothing
    uint64_t user_data; ///< the caller's own: see jostle_world_set_user_data
    uint64_t count;     ///< more than 1: so many options lie here, one for each box, as far apart as
                        ///< struct_size says; the first one's count counts. 0 or 1: these are all boxes'
} jostle_object_options;

typedef struct jostle_id_pair
{
    jostle_id a, b; ///< the index of a is less than that of b
} jostle_id_pair;

typedef struct jostle_ended_pair
{
    jostle_id a, b;
    jostle_end_reason reason;
    int32_t reserved; ///< 0
} jostle_ended_pair;

/// What the last update did, and what there is: jostle::WorldStats.
typedef struct jostle_world_stats
{
    uint64_t struct_size; ///< set by the caller
    uint64_t objects, resting, active, disabled, refused;
    uint64_t commands, dropped, changed, woken, settled, candidates, false_positives, listed, began,
        persisted, ended;
    uint64_t bytes_reserved;
    double us_total, us_apply, us_active, us_resting, us_events, us_index;
    uint64_t contested;
} jostle_world_stats;

/// A part of the picture: a box, 2 dim numbers, or a line from centre to centre, 2 dim numbers.
typedef int32_t (*jostle_draw_function)(void* context, const void* numbers, jostle_draw_kind kind);

/// `options` may be NULL.
JOSTLE_C_API jostle_status jostle_world_new(jostle_space space, const jostle_world_options* options,
                                            jostle_world** out, jostle_error* error);

// Commands: queued, from any thread at any time; they take effect in the next update. Each is for many
// objects; one is a count of 1. Of equal commands of several threads for one object the greatest `sequence`
// wins. jostle_world_add, _remove and _move without displacements are all or nothing. The others, where
// element i is at fault (jostle_error::index), have queued the commands before it.

/// As many new objects as boxes. ids[i] becomes that of box i, good at once. `options` may be NULL.
JOSTLE_C_API jostle_status jostle_world_add(jostle_world* world, const jostle_boxes* boxes,
                                            const jostle_object_options* options, jostle_id* ids,
                                            jostle_error* error);
JOSTLE_C_API jostle_status jostle_world_remove(jostle_world* world, const jostle_id* ids, uint64_t count,
                                               jostle_error* error);
/// In the next update the pairs of each of these objects come in the list of those that began, as if they
/// were new; with `others`, as many as ids and not NULL, only the pair of ids[i] and others[i]. `accept` is
/// asked about them again, also about those that it refused.
JOSTLE_C_API jostle_status jostle_world_report_again(jostle_world* world, const jostle_id* ids,
                                                     const jostle_id* others, uint64_t count,
                                                     jostle_error* error);
/// New boxes, as many as ids. `displacements`, dim numbers each and one after another, may be NULL: during
/// the coming step the boxes move that far, and touch what lies on their way.
JOSTLE_C_API jostle_status jostle_world_move(jostle_world* world, const jostle_id* ids,
                                             const jostle_boxes* boxes, const void* displacements,
                                             uint32_t sequence, jostle_error* error);
/// New edge lengths, dim numbers each, the same centres.
JOSTLE_C_API jostle_status jostle_world_resize(jostle_world* world, const jostle_id* ids, uint64_t count,
                                               const void* sizes, uint32_t sequence, jostle_error* error);
/// A filter for each object.
JOSTLE_C_API jostle_status jostle_world_set_filter(jostle_world* world, const jostle_id* ids, uint64_t count,
                                                   const jostle_object_filter* filters, uint32_t sequence,
                                                   jostle_error* error);
/// A margin for each object, on top of the world's.
JOSTLE_C_API jostle_status jostle_world_set_margin(jostle_world* world, const jostle_id* ids, uint64_t count,
                                                   const double* margins, uint32_t sequence,
                                                   jostle_error* error);
/// 1 or 0 for each object.
JOSTLE_C_API jostle_status jostle_world_set_enabled(jostle_world* world, const jostle_id* ids, uint64_t count,
                                                    const uint8_t* enabled, uint32_t sequence,
                                                    jostle_error* error);

/// The caller's own 64 bits for each object. At once; any number of threads may set and read, at any time.
JOSTLE_C_API jostle_status jostle_world_set_user_data(jostle_world* world, const jostle_id* ids,
                                                      uint64_t count, const uint64_t* data,
                                                      jostle_error* error);
/// Also of objects that the last update has removed.
JOSTLE_C_API jostle_status jostle_world_user_data(const jostle_world* world, const jostle_id* ids,
                                                  uint64_t count, uint64_t* data, jostle_error* error);

/// Applies what was queued before and finds out what that did to the pairs.
JOSTLE_C_API jostle_status jostle_world_update(jostle_world* world, jostle_error* error);
/// Moves these objects and updates; the boxes are read in place. As many ids as boxes.
JOSTLE_C_API jostle_status jostle_world_update_moves(jostle_world* world, const jostle_id* ids,
                                                     const jostle_boxes* boxes, jostle_error* error);
/// Shows what was queued before, ahead of the next update: to queries, jostle_world_touching, _pairs and
/// all that can be asked about objects. The lists of the last update, and what the next one gives, stay the
/// same.
JOSTLE_C_API jostle_status jostle_world_apply(jostle_world* world, jostle_error* error);

// The pairs, as of the last update and valid until the next.

/// Those that touch now and didn't before, ascending by index.
JOSTLE_C_API jostle_status jostle_world_began(const jostle_world* world, const jostle_id_pair** pairs,
                                              uint64_t* count, jostle_error* error);
/// Those that touched before and don't now, ascending by index, and why.
JOSTLE_C_API jostle_status jostle_world_ended(const jostle_world* world, const jostle_ended_pair** pairs,
                                              uint64_t* count, jostle_error* error);
/// Those that touched before and still do, and of which one object changed: jostle_pair by index.
JOSTLE_C_API jostle_status jostle_world_persisted(const jostle_world* world, jostle_blocks* pairs,
                                                  jostle_error* error);
/// Began and persisted as one list, by index: what jostle_contact_finder_find wants.
JOSTLE_C_API jostle_status jostle_world_changed_pairs(const jostle_world* world, jostle_blocks* pairs,
                                                      jostle_error* error);

/// All pairs that touch, by index, owned by the caller. Costs as much as finding them anew.
JOSTLE_C_API jostle_status jostle_world_pairs(const jostle_world* world, jostle_results* results,
                                              jostle_error* error);
/// Who each of these objects touches: lists of ids, ascending by index.
JOSTLE_C_API jostle_status jostle_world_touching(const jostle_world* world, const jostle_id* ids,
                                                 uint64_t count, jostle_results* results,
                                                 jostle_error* error);

/// Takes a pair. 1: go on. 0: stop. Called on the calling thread.
typedef int32_t (*jostle_visit_pair_function)(void* context, jostle_id a, jostle_id b);
/// Hands the same pairs to `visit` one by one, in the same order, without memory for them. `finished` becomes
/// 0 if it stopped that, else 1.
JOSTLE_C_API jostle_status jostle_world_visit_pairs(const jostle_world* world,
                                                    jostle_visit_pair_function visit, void* context,
                                                    int32_t* finished, jostle_error* error);

// The objects, as of the last update or jostle_world_apply.

/// Every index is less than this.
JOSTLE_C_API jostle_status jostle_world_index_end(const jostle_world* world, uint32_t* end,
                                                  jostle_error* error);
JOSTLE_C_API jostle_status jostle_world_contains(const jostle_world* world, const jostle_id* ids,
                                                 uint64_t count, uint8_t* contains, jostle_error* error);
/// The ids of the objects with these indices; 0 where there is none.
JOSTLE_C_API jostle_status jostle_world_ids(const jostle_world* world, const uint32_t* indices,
                                            uint64_t count, jostle_id* ids, jostle_error* error);
/// As they were given: 2 dim numbers each.
JOSTLE_C_API jostle_status jostle_world_boxes(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                              void* boxes, jostle_error* error);
/// As they are compared, margins and displacements included.
JOSTLE_C_API jostle_status jostle_world_bounds(const jostle_world* world, const jostle_id* ids,
                                               uint64_t count, void* boxes, jostle_error* error);
JOSTLE_C_API jostle_status jostle_world_filters(const jostle_world* world, const jostle_id* ids,
                                                uint64_t count, jostle_object_filter* filters,
                                                jostle_error* error);
JOSTLE_C_API jostle_status jostle_world_enabled(const jostle_world* world, const jostle_id* ids,
                                                uint64_t count, uint8_t* enabled, jostle_error* error);
/// The world's and the object's own together.
JOSTLE_C_API jostle_status jostle_world_margins(const jostle_world* world, const jostle_id* ids,
                                                uint64_t count, double* margins, jostle_error* error);

/// What the world is, as bytes: the same on every machine.
JOSTLE_C_API jostle_status jostle_world_save(const jostle_world* world, jostle_results* results,
                                             jostle_error* error);
/// What the world is, as bytes, and from now on the base: what differs from it is recorded.
JOSTLE_C_API jostle_status jostle_world_save_base(jostle_world* world, jostle_results* results,
                                                  jostle_error* error);
/// How the world differs from its base, as bytes. Costs what differs; what rests costs nothing.
JOSTLE_C_API jostle_status jostle_world_save_changes(jostle_world* world, jostle_results* results,
                                                     jostle_error* error);
/// Becomes the world whose changes these are, of the same base.
JOSTLE_C_API jostle_status jostle_world_restore_changes(jostle_world* world, const void* changes,
                                                        uint64_t size, jostle_error* error);
/// Becomes the world that was saved.
JOSTLE_C_API jostle_status jostle_world_restore(jostle_world* world, const void* snapshot, uint64_t size,
                                                jostle_error* error);
/// Another world like this one, with the same accept and context.
JOSTLE_C_API jostle_status jostle_world_fork(const jostle_world* world, jostle_world** out,
                                             jostle_error* error);
/// Becomes a view of another world of the same space, to be asked while that one is updated. Commands and
/// updates of a view fail, until jostle_clear() or jostle_world_restore() makes it a world again.
JOSTLE_C_API jostle_status jostle_world_follow(jostle_world* world, const jostle_world* other,
                                               jostle_error* error);

JOSTLE_C_API jostle_status jostle_world_stats_read(const jostle_world* world, jostle_world_stats* stats,
                                                   jostle_error* error);
/// What the world looks like, in words.
JOSTLE_C_API jostle_status jostle_world_explain(const jostle_world* world, jostle_results* results,
                                                jostle_error* error);
/// Calls `box` for every object and `line` for every pair of the last update's lists, on the calling thread.
/// Either may be NULL.
JOSTLE_C_API jostle_status jostle_world_draw(const jostle_world* world, jostle_draw_function box,
                                             jostle_draw_function line, void* context, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Slots of pairs: pair_slots.hpp
// ---------------------------------------------------------------------------------------------------------

JOSTLE_C_API jostle_status jostle_pair_slots_new(jostle_pair_slots** out, jostle_error* error);
/// Gives slots to pairs that begin, and takes back those of pairs that end: the lists of jostle_world_began
/// and jostle_world_ended, after every update.
JOSTLE_C_API jostle_status jostle_pair_slots_update(jostle_pair_slots* slots, const jostle_id_pair* began,
                                                    uint64_t began_count, const jostle_ended_pair* ended,
                                                    uint64_t ended_count, jostle_error* error);
/// The slot of each pair that began, the one that each pair that ended had, and a number that every slot is
/// less than. Valid until the next update or restore.
JOSTLE_C_API jostle_status jostle_pair_slots_lists(const jostle_pair_slots* slots, const uint32_t** began,
                                                   uint64_t* began_count, const uint32_t** ended,
                                                   uint64_t* ended_count, uint32_t* end, jostle_error* error);
/// Those of pairs of indices; UINT32_MAX for one that doesn't touch.
JOSTLE_C_API jostle_status jostle_pair_slots_find(const jostle_pair_slots* slots, const jostle_pair* pairs,
                                                  uint64_t count, uint32_t* found, jostle_error* error);
/// The pairs and their slots as bytes, to go back to together with the world.
JOSTLE_C_API jostle_status jostle_pair_slots_save(const jostle_pair_slots* slots, jostle_results* results,
                                                  jostle_error* error);
JOSTLE_C_API jostle_status jostle_pair_slots_restore(jostle_pair_slots* slots, const void* bytes,
                                                     uint64_t size, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Shapes: shapes.hpp. Numbers of shapes are double whatever the space. `dim` is 2 or 3.
// ---------------------------------------------------------------------------------------------------------

/// A point of a user's own shape furthest in `direction`: dim doubles each. It never fails and depends on
/// `direction` alone.
typedef void (*jostle_support_function)(void* context, const double* direction, double* point);

/// What a shape is.
typedef struct jostle_shape_info
{
    int32_t dim;
    jostle_shape_type type;
    double radius;
    double size[3];
    double offset;
    void* context; ///< of a user's own shape; else NULL
} jostle_shape_info;

/// In 2D a circle.
JOSTLE_C_API jostle_status jostle_shape_sphere(int32_t dim, double radius, jostle_shape** out,
                                               jostle_error* error);
/// All points within `radius` of a segment along the local y axis.
JOSTLE_C_API jostle_status jostle_shape_capsule(int32_t dim, double half_length, double radius,
                                                jostle_shape** out, jostle_error* error);
/// All points within `radius`, which may be 0, of a box. Half its edges: dim numbers.
JOSTLE_C_API jostle_status jostle_shape_box(int32_t dim, const double* half, double radius,
                                            jostle_shape** out, jostle_error* error);
/// All points within `radius` of the y axis from -half_length to +half_length, in 3D.
JOSTLE_C_API jostle_status jostle_shape_cylinder(double half_length, double radius, jostle_shape** out,
                                                 jostle_error* error);
/// From a disc of `radius` at y = -half_length to its tip at y = +half_length, in 3D.
JOSTLE_C_API jostle_status jostle_shape_cone(double half_length, double radius, jostle_shape** out,
                                             jostle_error* error);
/// An ellipsoid, in 2D an ellipse, with the semi-axes `half`: dim numbers.
JOSTLE_C_API jostle_status jostle_shape_ellipsoid(int32_t dim, const double* half, jostle_shape** out,
                                                  jostle_error* error);
/// Everything below a plane: the points p with normal . p <= offset * |normal|. The normal has dim numbers.
JOSTLE_C_API jostle_status jostle_shape_half_space(int32_t dim, const double* normal, double offset,
                                                   jostle_shape** out, jostle_error* error);
/// All points within `radius`, which may be 0, of the convex hull of points: dim numbers of the space each,
/// one after another.
JOSTLE_C_API jostle_status jostle_shape_hull(jostle_space space, const void* points, uint64_t count,
                                             double radius, jostle_shape** out, jostle_error* error);
/// Triangles or, in 2D, segments: dim indices each. Vertices within `weld`, which may be 0, of an earlier one
/// are moved to it: jostle::Mesh.
JOSTLE_C_API jostle_status jostle_shape_mesh(jostle_space space, const void* vertices, uint64_t vertex_count,
                                             const uint32_t* elements, uint64_t element_count, double weld,
                                             jostle_shape** out, jostle_error* error);
/// Terrain: columns x rows heights, row by row, at x = column * spacing_x and z = row * spacing_z;
/// jostle::HeightGrid. The ground is solid from there down to `thickness` below the lowest height. `space` is
/// JOSTLE_3F or JOSTLE_3D.
JOSTLE_C_API jostle_status jostle_shape_height_field(jostle_space space, const void* heights,
                                                     uint32_t columns, uint32_t rows, double spacing_x,
                                                     double spacing_z, double thickness, jostle_shape** out,
                                                     jostle_error* error);
/// Several shapes that move as one. Their poses are dim + 4 (3D) or dim + 2 (2D) doubles each.
JOSTLE_C_API jostle_status jostle_shape_compound(int32_t dim, const jostle_shape* const* children,
                                                 const double* poses, uint64_t count, jostle_shape** out,
                                                 jostle_error* error);
/// A user's own shape, of a type from JOSTLE_SHAPE_FIRST_CUSTOM on, within `radius` of its origin. `support`
/// may be NULL: then it meets what jostle_contact_finder_add_test says. `context` must outlive it.
JOSTLE_C_API jostle_status jostle_shape_custom(int32_t dim, jostle_shape_type type, double radius,
                                               jostle_support_function support, void* context,
                                               jostle_shape** out, jostle_error* error);
JOSTLE_C_API jostle_status jostle_shape_info_read(const jostle_shape* shape, jostle_shape_info* info,
                                                  jostle_error* error);
/// The corners of a hull, the vertices of a mesh: dim doubles each; valid while the shape is.
JOSTLE_C_API jostle_status jostle_shape_vertices(const jostle_shape* shape, const double** vertices,
                                                 uint64_t* count, jostle_error* error);
/// The faces of a hull (edges in 2D), the elements of a mesh.
JOSTLE_C_API jostle_status jostle_shape_face_count(const jostle_shape* shape, uint64_t* count,
                                                   jostle_error* error);
/// The corners of one face of a hull in 3D, counterclockwise seen from outside, or of one element of a mesh,
/// as numbers of vertices; valid while the shape is.
JOSTLE_C_API jostle_status jostle_shape_face(const jostle_shape* shape, uint64_t face,
                                             const uint32_t** corners, uint64_t* count, jostle_error* error);

/// A list with one shape per object. It may be read by several threads, and changed by one.
JOSTLE_C_API jostle_status jostle_shapes_new(int32_t dim, jostle_shapes** out, jostle_error* error);
/// Appends the same shape for `count` objects.
JOSTLE_C_API jostle_status jostle_shapes_add(jostle_shapes* shapes, const jostle_shape* shape, uint64_t count,
                                             jostle_error* error);
/// Appends a sphere for each radius, a capsule for each half length and radius, a box for each dim half
/// edges.
JOSTLE_C_API jostle_status jostle_shapes_add_spheres(jostle_shapes* shapes, const double* radii,
                                                     uint64_t count, jostle_error* error);
JOSTLE_C_API jostle_status jostle_shapes_add_capsules(jostle_shapes* shapes, const double* half_lengths,
                                                      const double* radii, uint64_t count,
                                                      jostle_error* error);
JOSTLE_C_API jostle_status jostle_shapes_add_boxes(jostle_shapes* shapes, const double* halves,
                                                   uint64_t count, jostle_error* error);
/// Appends `count` shapes of another list, or of the same one, beginning with shape `first`.
JOSTLE_C_API jostle_status jostle_shapes_add_from(jostle_shapes* shapes, const jostle_shapes* from,
                                                  uint64_t first, uint64_t count, jostle_error* error);
/// Gives one object another shape.
JOSTLE_C_API jostle_status jostle_shapes_set(jostle_shapes* shapes, uint64_t object,
                                             const jostle_shape* shape, jostle_error* error);
/// Whether the list serves for a whole multiple of its size of poses, over and over: object i has shape
/// i % size. So the shapes of a robot's links serve for any number of its configurations. At first it
/// doesn't.
JOSTLE_C_API jostle_status jostle_shapes_set_repeats(jostle_shapes* shapes, int32_t repeats,
                                                     jostle_error* error);

/// The tightest box around each object, rounded outwards, with `margin` added: 2 dim numbers each. `executor`
/// may be NULL: the calling thread.
JOSTLE_C_API jostle_status jostle_bounds(jostle_space space, const jostle_objects* objects, double margin,
                                         jostle_executor* executor, void* boxes, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Contacts: and distances, impacts, casts (contact.hpp, cast.hpp)
// ---------------------------------------------------------------------------------------------------------

/// Where two objects touch: jostle::Contact. The normal is a unit vector from a to b: b moved along it by
/// `depth` comes out of a. A depth below 0 is a gap. A point is midway between the surfaces; from_a and
/// from_b are that one point, counted from the positions of a's and b's poses in world axes, so in the world
/// it is at pose_a + from_a. The deepest point is first. `feature` names what meets there and stays the same
/// from frame to frame.
typedef struct jostle_contact_point_2f
{
    float from_a[2], from_b[2], depth;
    uint32_t feature;
} jostle_contact_point_2f;
typedef struct jostle_contact_2f
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    float normal[2];
    uint32_t count;
    jostle_contact_point_2f point[2];
} jostle_contact_2f;
typedef struct jostle_contact_point_3f
{
    float from_a[3], from_b[3], depth;
    uint32_t feature;
} jostle_contact_point_3f;
typedef struct jostle_contact_3f
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    float normal[3];
    uint32_t count;
    jostle_contact_point_3f point[4];
} jostle_contact_3f;
typedef struct jostle_contact_point_2d
{
    double from_a[2], from_b[2], depth;
    uint32_t feature;
} jostle_contact_point_2d;
typedef struct jostle_contact_2d
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    double normal[2];
    uint32_t count;
    jostle_contact_point_2d point[2];
} jostle_contact_2d;
typedef struct jostle_contact_point_3d
{
    double from_a[3], from_b[3], depth;
    uint32_t feature;
} jostle_contact_point_3d;
typedef struct jostle_contact_3d
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    double normal[3];
    uint32_t count;
    jostle_contact_point_3d point[4];
} jostle_contact_3d;

/// What a user's own test is given: jostle::PairTestInput. Poses are position and rotation, counted from a's
/// position: 7 or 4 doubles.
typedef struct jostle_pair_test_input
{
    jostle_shape_info shape_a, shape_b;
    const double *pose_a, *pose_b;
    double margin;
} jostle_pair_test_input;

/// Calls emit(emit_context, contact) for each contact, a jostle_contact_2d or _3d by the finder's space. It
/// never fails.
typedef void (*jostle_pair_test_function)(void* context, const jostle_pair_test_input* input,
                                          void (*emit)(void* emit_context, const void* contact),
                                          void* emit_context);

/// `options` may be NULL.
JOSTLE_C_API jostle_status jostle_contact_finder_new(jostle_space space, const jostle_options* options,
                                                     jostle_contact_finder** out, jostle_error* error);
/// A user's own test for the shapes of two types. `context` must outlive the finder.
JOSTLE_C_API jostle_status jostle_contact_finder_add_test(jostle_contact_finder* finder,
                                                          jostle_shape_type type_a, jostle_shape_type type_b,
                                                          jostle_pair_test_function test, void* context,
                                                          jostle_error* error);

// Below, pairs are among the objects `a` or, if `b` isn't NULL, of one of `a` and one of `b`. Results are in
// the order of the pairs. Lengths are rounded to the numbers of the space.

/// All contacts of shapes that touch or have a gap of up to `margin`. They lie in the finder and are valid
/// until its next call.
JOSTLE_C_API jostle_status jostle_contact_finder_find(jostle_contact_finder* finder, const jostle_objects* a,
                                                      const jostle_objects* b, const jostle_blocks* pairs,
                                                      double margin, jostle_blocks* contacts,
                                                      jostle_error* error);
/// The deepest point of a contact: jostle::PointContact.
typedef struct jostle_point_contact_2f
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    float normal[2], from_a[2], from_b[2], depth;
    uint32_t feature;
} jostle_point_contact_2f;
typedef struct jostle_point_contact_3f
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    float normal[3], from_a[3], from_b[3], depth;
    uint32_t feature;
} jostle_point_contact_3f;
typedef struct jostle_point_contact_2d
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    double normal[2], from_a[2], from_b[2], depth;
    uint32_t feature;
} jostle_point_contact_2d;
typedef struct jostle_point_contact_3d
{
    jostle_pair pair;
    uint32_t part_a, part_b;
    double normal[3], from_a[3], from_b[3], depth;
    uint32_t feature;
} jostle_point_contact_3d;
/// The same contacts, of each the deepest point alone: jostle_point_contact_... of the space.
JOSTLE_C_API jostle_status jostle_contact_finder_find_points(jostle_contact_finder* finder,
                                                             const jostle_objects* a, const jostle_objects* b,
                                                             const jostle_blocks* pairs, double margin,
                                                             jostle_blocks* contacts, jostle_error* error);
/// Whether the shapes of each pair touch: 1 or 0.
JOSTLE_C_API jostle_status jostle_contact_finder_touching(jostle_contact_finder* finder,
                                                          const jostle_objects* a, const jostle_objects* b,
                                                          const jostle_blocks* pairs, uint8_t* touching,
                                                          jostle_error* error);
/// Distance, normal, from_a, from_b: 3 dim + 1 numbers of the space each. The distance is infinite where it
/// is more than max_distance; below 0 it is how far b has to move along the normal, a unit vector from a to
/// b, to come out of a. from_a leads from the position of a's pose to the nearest point of a, from_b from b's
/// to b's, in world axes.
JOSTLE_C_API jostle_status jostle_contact_finder_distances(jostle_contact_finder* finder,
                                                           const jostle_objects* a, const jostle_objects* b,
                                                           const jostle_blocks* pairs, double max_distance,
                                                           void* distances, jostle_error* error);
/// Of each group of pairs the number of the first that touches, or UINT64_MAX. Group g is pairs
/// offsets[g] to offsets[g + 1] - 1; there are groups + 1 offsets, and `groups` answers.
JOSTLE_C_API jostle_status jostle_contact_finder_first_touching(jostle_contact_finder* finder,
                                                                const jostle_objects* a,
                                                                const jostle_objects* b,
                                                                const jostle_blocks* pairs,
                                                                const uint64_t* offsets, uint64_t groups,
                                                                uint64_t* first, jostle_error* error);
/// Of each group of pairs the least distance, as jostle_contact_finder_distances gives it, and the number of
/// the pair that has it, or UINT64_MAX. Groups are as for first_touching.
JOSTLE_C_API jostle_status jostle_contact_finder_least_distances(
    jostle_contact_finder* finder, const jostle_objects* a, const jostle_objects* b,
    const jostle_blocks* pairs, const uint64_t* offsets, uint64_t groups, double max_distance,
    void* distances, uint64_t* nearest, jostle_error* error);
/// Time, normal, from_a, from_b: 3 dim + 1 numbers of the space each. The time is from 0 to 1, and infinite
/// where there is no impact. The normal is a unit vector from a to b; from_a and from_b lead to the point
/// from where a's and b's poses are at that time. The objects have motions in place of poses.
JOSTLE_C_API jostle_status jostle_contact_finder_impacts(jostle_contact_finder* finder,
                                                         const jostle_objects* a, const jostle_objects* b,
                                                         const jostle_blocks* pairs, double tolerance,
                                                         void* impacts, jostle_error* error);

/// Where a ray, or a shape on its way, first meets another: jostle::CastHit. The fraction, of the ray's
/// direction or the displacement, is infinite where it doesn't. The normal points out of the shape that is
/// met. The point counts from the position of that shape's pose, in world axes: in the world it is at pose +
/// point.
typedef struct jostle_cast_hit_2f
{
    float fraction, normal[2], point[2];
    uint32_t part, moving_part;
} jostle_cast_hit_2f;
typedef struct jostle_cast_hit_3f
{
    float fraction, normal[3], point[3];
    uint32_t part, moving_part;
} jostle_cast_hit_3f;
typedef struct jostle_cast_hit_2d
{
    double fraction, normal[2], point[2];
    uint32_t part, moving_part;
} jostle_cast_hit_2d;
typedef struct jostle_cast_hit_3d
{
    double fraction, normal[3], point[3];
    uint32_t part, moving_part;
} jostle_cast_hit_3d;

/// Where ray pair.a first meets object pair.b, one jostle_cast_hit_... of the space for each pair. A ray is
/// origin, direction and greatest fraction: 2 dim + 1 numbers.
JOSTLE_C_API jostle_status jostle_contact_finder_ray_casts(jostle_contact_finder* finder,
                                                           const jostle_values* rays,
                                                           const jostle_objects* objects,
                                                           const jostle_blocks* pairs, void* hits,
                                                           jostle_error* error);
/// Where object pair.a of `moving`, moved by its displacement (dim numbers), first touches object pair.b.
JOSTLE_C_API jostle_status jostle_contact_finder_shape_casts(
    jostle_contact_finder* finder, const jostle_objects* moving, const jostle_values* displacements,
    const jostle_objects* objects, const jostle_blocks* pairs, void* hits, jostle_error* error);

// One pair at a time, with the same bits. Poses and motions are numbers of the space.

JOSTLE_C_API jostle_status jostle_touching(jostle_space space, const jostle_shape* a, const void* pose_a,
                                           const jostle_shape* b, const void* pose_b, int32_t* touching,
                                           jostle_error* error);
JOSTLE_C_API jostle_status jostle_contacts(jostle_space space, const jostle_shape* a, const void* pose_a,
                                           const jostle_shape* b, const void* pose_b, double margin,
                                           jostle_results* results, jostle_error* error);
/// As one element of jostle_contact_finder_distances.
JOSTLE_C_API jostle_status jostle_distance(jostle_space space, const jostle_shape* a, const void* pose_a,
                                           const jostle_shape* b, const void* pose_b, double max_distance,
                                           void* distance, jostle_error* error);
/// As one element of jostle_contact_finder_impacts.
JOSTLE_C_API jostle_status jostle_time_of_impact(jostle_space space, const jostle_shape* a,
                                                 const void* motion_a, const jostle_shape* b,
                                                 const void* motion_b, double tolerance, void* impact,
                                                 jostle_error* error);
/// As one element of jostle_contact_finder_ray_casts.
JOSTLE_C_API jostle_status jostle_cast_ray(jostle_space space, const jostle_shape* shape, const void* pose,
                                           const void* ray, void* hit, jostle_error* error);
/// As one element of jostle_contact_finder_shape_casts.
JOSTLE_C_API jostle_status jostle_cast_shape(jostle_space space, const jostle_shape* moving, const void* pose,
                                             const void* displacement, const jostle_shape* shape,
                                             const void* shape_pose, void* hit, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Closed meshes: what is inside of them, in 3D (closed_mesh.hpp)
// ---------------------------------------------------------------------------------------------------------

/// `mesh` is a mesh in 3D without holes.
/// Errors    JOSTLE_INVALID_ARGUMENT that names the first side of a triangle without another one.
JOSTLE_C_API jostle_status jostle_closed_mesh_new(const jostle_shape* mesh, jostle_closed_mesh** out,
                                                  jostle_error* error);
/// How often the surface winds around points in the mesh's own axes, 3 doubles each: numbers[i].
JOSTLE_C_API jostle_status jostle_closed_mesh_winding_numbers(const jostle_closed_mesh* mesh,
                                                              const double* points, uint64_t count,
                                                              int32_t* numbers, jostle_error* error);
// Below, `space` is JOSTLE_3F or JOSTLE_3D; `pose` is one, 7 numbers, and NULL where the mesh's own axes are
// the world's; points are 3 numbers each. `executor` may be NULL: the calling thread.

/// Whether each point lies inside, 1 or 0: inside[i].
JOSTLE_C_API jostle_status jostle_closed_mesh_contains(const jostle_closed_mesh* mesh, jostle_space space,
                                                       const void* pose, const jostle_values* points,
                                                       const jostle_executor* executor, uint8_t* inside,
                                                       jostle_error* error);
/// Signed distance, normal, nearest point from the position of the pose: 7 numbers of the space each.
JOSTLE_C_API jostle_status jostle_closed_mesh_signed_distances(const jostle_closed_mesh* mesh,
                                                               jostle_space space, const void* pose,
                                                               const jostle_values* points,
                                                               const jostle_executor* executor,
                                                               void* distances, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Surfaces that bend: in 3D (surface.hpp)
// ---------------------------------------------------------------------------------------------------------

/// What a surface is made of: jostle::Surface.
typedef struct jostle_surface_parts
{
    const uint32_t* triangles; ///< 3 vertices each
    uint64_t triangle_count;
    const uint32_t* edges; ///< 2 vertices each: those that are no triangle's; read back, those as well
    uint64_t edge_count;
    const uint32_t* points; ///< vertices of nothing else; read back, all that are of something
    uint64_t point_count;
    uint64_t vertices; ///< 0: as many as are named
} jostle_surface_parts;

JOSTLE_C_API jostle_status jostle_surface_new(const jostle_surface_parts* parts, jostle_surface** out,
                                              jostle_error* error);
/// With the edges by whose numbers results name them. Valid as long as the surface.
JOSTLE_C_API jostle_status jostle_surface_parts_read(const jostle_surface* surface,
                                                     jostle_surface_parts* parts, jostle_error* error);

/// jostle::SurfaceOptions. What is given has one element for each vertex; NULL: not given.
typedef struct jostle_surface_options
{
    uint64_t struct_size;
    const void* thickness;                              ///< a number of the finder's space each
    const void* rest;                                   ///< positions at rest: 3 numbers each
    const uint32_t* bodies;                             ///< parts of one body make no pair
    jostle_accept_pair_function accept_vertex_triangle; ///< asked about a vertex and a triangle
    jostle_accept_pair_function accept_edge_edge;       ///< asked about two edges
    void* context;                                      ///< of both
    double tolerance;                                   ///< of impacts; 0: 1e-6
} jostle_surface_options;

/// A vertex and a triangle, or two edges, that are near each other: jostle::NearParts.
typedef struct jostle_near_parts_3f
{
    uint32_t a, b, vertices[4];
    float weights[4], normal[3], distance;
} jostle_near_parts_3f;
typedef struct jostle_near_parts_3d
{
    uint32_t a, b, vertices[4];
    double weights[4], normal[3], distance;
} jostle_near_parts_3d;
/// The same that meet, and when: jostle::PartImpact.
typedef struct jostle_part_impact_3f
{
    uint32_t a, b, vertices[4];
    float time;
} jostle_part_impact_3f;
typedef struct jostle_part_impact_3d
{
    uint32_t a, b, vertices[4];
    double time;
} jostle_part_impact_3d;
/// An edge that passes through a triangle, or touches it: jostle::Crossing.
typedef struct jostle_crossing
{
    uint32_t edge, triangle;
} jostle_crossing;

/// Blocks of jostle_near_parts_... of the space.
typedef struct jostle_near_surface
{
    jostle_blocks vertex_triangle, edge_edge;
} jostle_near_surface;
/// Blocks of jostle_part_impact_... of the space.
typedef struct jostle_moving_surface
{
    jostle_blocks vertex_triangle, edge_edge;
    double safe_step; ///< the least time; 1 where there are none
} jostle_moving_surface;

/// `space` is JOSTLE_3F or JOSTLE_3D; `options` may be NULL.
JOSTLE_C_API jostle_status jostle_surface_finder_new(jostle_space space, const jostle_options* options,
                                                     jostle_surface_finder** out, jostle_error* error);
// Positions are `count` times 3 numbers of the space, one for each vertex. `options` may be NULL. What is
// found lies in the finder, and is valid until the next call of the same function.

JOSTLE_C_API jostle_status jostle_surface_finder_near(jostle_surface_finder* finder,
                                                      const jostle_surface* surface, const void* positions,
                                                      uint64_t count, double distance,
                                                      const jostle_surface_options* options,
                                                      jostle_near_surface* found, jostle_error* error);
/// Vertices move straight from `from` to `to`, arrays of the same length.
JOSTLE_C_API jostle_status jostle_surface_finder_moving(jostle_surface_finder* finder,
                                                        const jostle_surface* surface, const void* from,
                                                        const void* to, uint64_t count, double distance,
                                                        const jostle_surface_options* options,
                                                        jostle_moving_surface* found, jostle_error* error);
/// Of jostle_crossing.
JOSTLE_C_API jostle_status jostle_surface_finder_crossings(jostle_surface_finder* finder,
                                                           const jostle_surface* surface,
                                                           const void* positions, uint64_t count,
                                                           const jostle_surface_options* options,
                                                           jostle_blocks* crossings, jostle_error* error);

/// Many pairs of a broad phase of one's own: `count` times four vertices, 12 numbers, at rest or where they
/// move from and to. times[i] is that of vertex_triangle_impact or edge_edge_impact, INFINITY where there is
/// none. `tolerance` 0 is 1e-6.
/// Errors    jostle_error::index is the pair at fault; the times before it are written.
JOSTLE_C_API jostle_status jostle_part_impacts(jostle_part_kind kind, const double* from, const double* to,
                                               uint64_t count, double distance, double tolerance,
                                               double* times, jostle_error* error);
/// vertex_triangle_distance or edge_edge_distance: distance, 4 weights, normal; 8 numbers each.
JOSTLE_C_API jostle_status jostle_part_distances(jostle_part_kind kind, const double* positions,
                                                 uint64_t count, double* distances, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Work on pairs: process.hpp, responses.hpp
// ---------------------------------------------------------------------------------------------------------

/// How work is cut: jostle::ProcessOptions.
typedef struct jostle_process_options
{
    uint64_t struct_size;
    const jostle_executor* executor; ///< NULL: the default executor
    uint64_t block_items;            ///< 0: chosen by their number
} jostle_process_options;

/// Where a callback stands: jostle::Work.
typedef struct jostle_work
{
    uint32_t slot;
    uint32_t block;
} jostle_work;

/// Works on the items [begin, end). 0: done.
typedef int32_t (*jostle_process_items_function)(void* context, uint64_t begin, uint64_t end,
                                                 jostle_work work);
/// Works on some items of a result; the first of them is number `first`. 0: done.
typedef int32_t (*jostle_process_blocks_function)(void* context, const void* items, uint64_t count,
                                                  uint64_t first, jostle_work work);

/// Work is cut into blocks of items, which the executor's threads take one after another: however uneven it
/// is, all are busy until the end. jostle_work::slot is less than the executor's concurrency, and differs
/// among calls at the same time: it selects scratch memory. `options` may be NULL.
JOSTLE_C_API jostle_status jostle_process_items(uint64_t items, jostle_process_items_function process,
                                                void* context, const jostle_process_options* options,
                                                jostle_error* error);
/// Works on all pairs, or contacts, of a result.
JOSTLE_C_API jostle_status jostle_process_blocks(const jostle_blocks* blocks,
                                                 jostle_process_blocks_function process, void* context,
                                                 const jostle_process_options* options, jostle_error* error);

/// Adds up values by object on all cores, with the same bits on any number of them: jostle::Responses in one
/// call. values[i], `width` numbers (1 to 8), belongs to object objects[i], which is less than object_count.
/// sums[object] becomes the sum of its values, 0 where it has none. Sums of int64_t wrap around. `options`
/// may be NULL. Each call allocates its working memory.
/// Errors    an object that is object_count or more; jostle_error::index is the lowest such i.
JOSTLE_C_API jostle_status jostle_sum_by_object(jostle_number number, uint32_t width, const uint32_t* objects,
                                                const void* values, uint64_t count,
                                                const jostle_options* options, uint32_t object_count,
                                                void* sums, jostle_error* error);

// ---------------------------------------------------------------------------------------------------------
// Recorder: of a program's boxes, for `jostle compare` (recorder.hpp)
// ---------------------------------------------------------------------------------------------------------

/// Begins a recording of boxes. `frames_per_second` may be 0; `description`, UTF-8, says where the boxes come
/// from and may be NULL. A file of this name is replaced. jostle_free closes the file, if
/// jostle_recorder_close hasn't, without telling what goes wrong then.
JOSTLE_C_API jostle_status jostle_recorder_new(jostle_space space, const char* path, double frames_per_second,
                                               const char* description, jostle_recorder** out,
                                               jostle_error* error);
/// Writes a frame: any number of boxes.
JOSTLE_C_API jostle_status jostle_recorder_frame(jostle_recorder* recorder, const jostle_boxes* boxes,
                                                 jostle_error* error);
/// Completes the file. There are no frames after it.
JOSTLE_C_API jostle_status jostle_recorder_close(jostle_recorder* recorder, jostle_error* error);

#ifdef __cplusplus
}
#endif

#endif
