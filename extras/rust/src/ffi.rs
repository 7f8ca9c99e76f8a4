// SPDX-License-Identifier: MIT
// Written by extras/rust/describe.py from extras/jostle.json.

//! The C interface as it is, `jostle.h`: for what the rest of the crate has no words for.
//!
//! Functions take pointers and return a status; what they want and what they promise is said in the header,
//! which comes with the crate (`cpp/include/jostle/jostle.h`).
#![allow(non_camel_case_types, missing_docs, clippy::all)]

use std::ffi::c_void;
use std::os::raw::c_char;

/// What a function returns. 1 to 99 are the codes of C++'s ErrorCode (error.hpp).
pub type jostle_status = i32;
pub const JOSTLE_OK: jostle_status = 0;
/// a bound of a box is NaN
pub const JOSTLE_NAN_COORDINATE: jostle_status = 1;
/// lo > hi on some axis
pub const JOSTLE_INVERTED_BOX: jostle_status = 2;
/// more objects than a 32-bit index can name, or sizes that overflow
pub const JOSTLE_TOO_MANY_OBJECTS: jostle_status = 3;
/// per-object arrays of different lengths, or too short an array
pub const JOSTLE_SIZE_MISMATCH: jostle_status = 4;
/// NULL, unaligned, or anything else that the comment forbids
pub const JOSTLE_INVALID_ARGUMENT: jostle_status = 5;
/// an id that names no object of the world
pub const JOSTLE_STALE_ID: jostle_status = 6;
/// cut short, altered, or of another kind of world
pub const JOSTLE_BAD_SNAPSHOT: jostle_status = 7;
/// a recording that can't be written
pub const JOSTLE_FILE_ERROR: jostle_status = 8;
pub const JOSTLE_OUT_OF_MEMORY: jostle_status = 100;
/// freed, of another kind, or no handle at all
pub const JOSTLE_BAD_HANDLE: jostle_status = 101;
/// a callback returned less than 0
pub const JOSTLE_CALLBACK_FAILED: jostle_status = 102;
/// a mistake of Jostle's own: please report it
pub const JOSTLE_INTERNAL_ERROR: jostle_status = 103;

/// How many coordinates a point has, and their type.
pub type jostle_space = i32;
/// 2 of float
pub const JOSTLE_2F: jostle_space = 1;
/// 3 of float
pub const JOSTLE_3F: jostle_space = 2;
/// 2 of double
pub const JOSTLE_2D: jostle_space = 3;
/// 3 of double
pub const JOSTLE_3D: jostle_space = 4;

/// The order of pairs: jostle::Order.
pub type jostle_order = i32;
/// by their place in space: the fastest
pub const JOSTLE_CANONICAL: jostle_order = 0;
/// ascending by (a, b)
pub const JOSTLE_SORTED: jostle_order = 1;

/// The instruction sets there are kernels for. Results are the same on all.
pub type jostle_instruction_set = i32;
/// of those that this machine can run
pub const JOSTLE_FASTEST: jostle_instruction_set = 0;
pub const JOSTLE_SCALAR: jostle_instruction_set = 1;
pub const JOSTLE_SSE4: jostle_instruction_set = 2;
pub const JOSTLE_AVX2: jostle_instruction_set = 3;
pub const JOSTLE_AVX512: jostle_instruction_set = 4;
pub const JOSTLE_NEON: jostle_instruction_set = 5;
pub const JOSTLE_WASM_SIMD: jostle_instruction_set = 6;

/// A kind of query (query.hpp, shape_query.hpp), and the numbers of one: see jostle_queries.
pub type jostle_query_kind = i32;
/// origin, direction, greatest fraction (INFINITY: no end): 2 dim + 1 numbers
pub const JOSTLE_RAY: jostle_query_kind = 1;
/// box, motion, greatest fraction: 3 dim + 1 numbers
pub const JOSTLE_SWEEP: jostle_query_kind = 2;
/// lo, hi: 2 dim numbers
pub const JOSTLE_BOX: jostle_query_kind = 3;
/// center, radius: dim + 1 numbers
pub const JOSTLE_SPHERE: jostle_query_kind = 4;
/// no numbers but a jostle_frustum
pub const JOSTLE_FRUSTUM: jostle_query_kind = 5;
/// point, greatest distance: dim + 1 numbers
pub const JOSTLE_NEAREST: jostle_query_kind = 6;
/// lo, hi, greatest distance: 2 dim + 1 numbers
pub const JOSTLE_NEAREST_TO_BOX: jostle_query_kind = 7;
/// a shape, and its displacement: dim numbers
pub const JOSTLE_SHAPE_SWEEP: jostle_query_kind = 8;
/// a shape that stays: no numbers
pub const JOSTLE_POSED_SHAPE: jostle_query_kind = 9;
/// a shape, and the greatest distance: 1 number, or none for any distance
pub const JOSTLE_NEAREST_TO_SHAPE: jostle_query_kind = 10;

/// Why a pair of a world ended: jostle::EndReason.
pub type jostle_end_reason = i32;
pub const JOSTLE_MOVED_APART: jostle_end_reason = 0;
pub const JOSTLE_REMOVED: jostle_end_reason = 1;
pub const JOSTLE_DISABLED: jostle_end_reason = 2;
pub const JOSTLE_FILTERED: jostle_end_reason = 3;

/// What a world draws of itself: jostle::DrawKind.
pub type jostle_draw_kind = i32;
pub const JOSTLE_DRAW_ACTIVE: jostle_draw_kind = 0;
pub const JOSTLE_DRAW_RESTING: jostle_draw_kind = 1;
pub const JOSTLE_DRAW_DISABLED: jostle_draw_kind = 2;
pub const JOSTLE_DRAW_BEGAN: jostle_draw_kind = 3;
pub const JOSTLE_DRAW_PERSISTED: jostle_draw_kind = 4;
pub const JOSTLE_DRAW_ENDED: jostle_draw_kind = 5;

/// The types of shapes; a user's own have types from 16 on: jostle::ShapeTypes.
pub type jostle_shape_type = i32;
pub const JOSTLE_SHAPE_SPHERE: jostle_shape_type = 0;
pub const JOSTLE_SHAPE_CAPSULE: jostle_shape_type = 1;
pub const JOSTLE_SHAPE_BOX: jostle_shape_type = 2;
pub const JOSTLE_SHAPE_CONVEX: jostle_shape_type = 3;
pub const JOSTLE_SHAPE_HALF_SPACE: jostle_shape_type = 4;
pub const JOSTLE_SHAPE_MESH: jostle_shape_type = 5;
pub const JOSTLE_SHAPE_HEIGHT_FIELD: jostle_shape_type = 6;
pub const JOSTLE_SHAPE_COMPOUND: jostle_shape_type = 7;
pub const JOSTLE_SHAPE_ROUNDED_BOX: jostle_shape_type = 8;
pub const JOSTLE_SHAPE_ROUNDED_HULL: jostle_shape_type = 9;
pub const JOSTLE_SHAPE_CYLINDER: jostle_shape_type = 10;
pub const JOSTLE_SHAPE_CONE: jostle_shape_type = 11;
/// in 2D an ellipse
pub const JOSTLE_SHAPE_ELLIPSOID: jostle_shape_type = 12;
pub const JOSTLE_SHAPE_FIRST_CUSTOM: jostle_shape_type = 16;

/// What a pair of a surface consists of.
pub type jostle_part_kind = i32;
/// the vertex, then the triangle's three
pub const JOSTLE_VERTEX_TRIANGLE: jostle_part_kind = 1;
/// the two ends of one, then those of the other
pub const JOSTLE_EDGE_EDGE: jostle_part_kind = 2;

/// The type of the numbers that jostle_sum_by_object adds up.
pub type jostle_number = i32;
pub const JOSTLE_FLOAT: jostle_number = 1;
pub const JOSTLE_DOUBLE: jostle_number = 2;
pub const JOSTLE_INT64: jostle_number = 3;

/// Names an object of a world: the index in the low 32 bits, the generation in the high ones. Always less
/// than 2^53, so that a double holds it exactly. 0 names nothing.
pub type jostle_id = u64;

/// where work runs
#[repr(C)]
pub struct jostle_executor {
    _private: [u8; 0],
}

/// what a call found, owned by the caller
#[repr(C)]
pub struct jostle_results {
    _private: [u8; 0],
}

/// jostle::PairFinder
#[repr(C)]
pub struct jostle_finder {
    _private: [u8; 0],
}

/// jostle::PeriodicImages
#[repr(C)]
pub struct jostle_images {
    _private: [u8; 0],
}

/// jostle::NeighborFinder
#[repr(C)]
pub struct jostle_neighbor_finder {
    _private: [u8; 0],
}

/// jostle::BoxIndex
#[repr(C)]
pub struct jostle_index {
    _private: [u8; 0],
}

/// jostle::World
#[repr(C)]
pub struct jostle_world {
    _private: [u8; 0],
}

/// jostle::PairSlots
#[repr(C)]
pub struct jostle_pair_slots {
    _private: [u8; 0],
}

/// jostle::Shape, with what it points to
#[repr(C)]
pub struct jostle_shape {
    _private: [u8; 0],
}

/// one shape per object
#[repr(C)]
pub struct jostle_shapes {
    _private: [u8; 0],
}

/// jostle::ContactFinder
#[repr(C)]
pub struct jostle_contact_finder {
    _private: [u8; 0],
}

/// jostle::ClosedMesh
#[repr(C)]
pub struct jostle_closed_mesh {
    _private: [u8; 0],
}

/// jostle::Surface
#[repr(C)]
pub struct jostle_surface {
    _private: [u8; 0],
}

/// jostle::SurfaceFinder
#[repr(C)]
pub struct jostle_surface_finder {
    _private: [u8; 0],
}

/// jostle::Recorder
#[repr(C)]
pub struct jostle_recorder {
    _private: [u8; 0],
}

/// Calls task(task_context, i) once for each i in \[0, count), in any order, on any threads, and returns after
/// the last. Tasks never fail.
pub type jostle_run_function = Option<unsafe extern "C" fn(context: *mut c_void, count: u32, task: Option<unsafe extern "C" fn(task_context: *mut c_void, i: u32)>, task_context: *mut c_void) -> i32>;

/// 1: the pair is wanted. 0: it isn't.
pub type jostle_accept_pair_function = Option<unsafe extern "C" fn(context: *mut c_void, a: u32, b: u32) -> i32>;

/// 1: the pair of that scene is wanted. 0: it isn't.
pub type jostle_accept_scene_pair_function = Option<unsafe extern "C" fn(context: *mut c_void, scene: u64, a: u32, b: u32) -> i32>;

/// Takes a piece of the result: jostle::PairChunk. 1: go on. 0: stop the search.
pub type jostle_sink_function = Option<unsafe extern "C" fn(context: *mut c_void, pairs: *const jostle_pair, count: u64, block: u64, part: u64) -> i32>;

/// Takes rows of a list: those of the points from `first` to first + rows - 1, which are rows 0 to rows - 1
/// of `list`. 1: go on. 0: stop.
pub type jostle_neighbor_sink_function = Option<unsafe extern "C" fn(context: *mut c_void, first: u64, rows: u64, list: *const jostle_neighbor_list) -> i32>;

/// 1: the object may be an answer to the query of this number. 0: not.
pub type jostle_accept_answer_function = Option<unsafe extern "C" fn(context: *mut c_void, query: u32, id: u64) -> i32>;

/// Takes an answer; `details` as of jostle_query_first, or NULL. 1: go on. 0: stop. Called on the calling
/// thread. Where answers have an order, nothing further than *bound, in the units of `at`, comes from then
/// on: it may be made less. Else `at` is 0 and `bound` NULL. May ask the same index or world.
pub type jostle_visit_answer_function = Option<unsafe extern "C" fn(context: *mut c_void, id: u64, at: f64, details: *const c_void, bound: *mut f64) -> i32>;

/// Takes two objects and the squared distance between their boxes. 1: go on. 0: stop. Called on the calling
/// thread. Nothing further than *bound comes from then on: it may be made less.
pub type jostle_visit_close_pair_function = Option<unsafe extern "C" fn(context: *mut c_void, a: u64, b: u64, at: f64, bound: *mut f64) -> i32>;

/// 1: the pair may begin. 0: not. Called in update() on its thread, in ascending order of the pairs.
pub type jostle_accept_object_pair_function = Option<unsafe extern "C" fn(context: *mut c_void, a: jostle_id, b: jostle_id) -> i32>;

/// A part of the picture: a box, 2 dim numbers, or a line from centre to centre, 2 dim numbers.
pub type jostle_draw_function = Option<unsafe extern "C" fn(context: *mut c_void, numbers: *const c_void, kind: jostle_draw_kind) -> i32>;

/// Takes a pair. 1: go on. 0: stop. Called on the calling thread.
pub type jostle_visit_pair_function = Option<unsafe extern "C" fn(context: *mut c_void, a: jostle_id, b: jostle_id) -> i32>;

/// A point of a user's own shape furthest in `direction`: dim doubles each. It never fails and depends on
/// `direction` alone.
pub type jostle_support_function = Option<unsafe extern "C" fn(context: *mut c_void, direction: *const f64, point: *mut f64)>;

/// Calls emit(emit_context, contact) for each contact, a jostle_contact_2d or _3d by the finder's space. It
/// never fails.
pub type jostle_pair_test_function = Option<unsafe extern "C" fn(context: *mut c_void, input: *const jostle_pair_test_input, emit: Option<unsafe extern "C" fn(emit_context: *mut c_void, contact: *const c_void)>, emit_context: *mut c_void)>;

/// Works on the items \[begin, end). 0: done.
pub type jostle_process_items_function = Option<unsafe extern "C" fn(context: *mut c_void, begin: u64, end: u64, work: jostle_work) -> i32>;

/// Works on some items of a result; the first of them is number `first`. 0: done.
pub type jostle_process_blocks_function = Option<unsafe extern "C" fn(context: *mut c_void, items: *const c_void, count: u64, first: u64, work: jostle_work) -> i32>;

/// What went wrong, in words.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_error {
    pub status: jostle_status,
    /// of the callback that failed; else 0
    pub callback_result: i32,
    /// the lowest object at fault; UINT64_MAX where none is
    pub index: u64,
    /// UTF-8, ends with a zero, cut short where it is longer
    pub message: [c_char; 496],
}

/// One value per object, `stride` bytes apart (any multiple of the value's size; also negative, or 0). `data`
/// NULL and `count` 0: not given.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_values {
    pub data: *const c_void,
    pub count: u64,
    pub stride: i64,
}

/// Boxes in the caller's memory, read in place: jostle::BoxView. lo\[axis] points to the first box's lower
/// bound on that axis, the next box's is `stride` bytes further on. Covers arrays of boxes, boxes inside
/// bigger structs, one array per coordinate. jostle_boxes_strided fills it in.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_boxes {
    /// the last is not used in 2D
    pub lo: [*const c_void; 3],
    pub hi: [*const c_void; 3],
    pub count: u64,
    pub stride: i64,
}

/// Two touching objects, by their positions in the input.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_pair {
    pub a: u32,
    pub b: u32,
}

/// Some items, one after another.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_block {
    pub items: *const c_void,
    pub count: u64,
}

/// All items of a result, in its order: pairs (jostle_pair) or contacts (jostle_contact_...). What is given
/// to a function as pairs may be one block of the caller's own.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_blocks {
    pub blocks: *const jostle_block,
    pub block_count: u64,
    /// of the items of all blocks
    pub count: u64,
    /// in bytes
    pub item_size: u64,
}

/// The answers to many queries. Those to query i are \[first\[i], first\[i + 1]) of `ids` and `at`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_lists {
    pub queries: u64,
    /// of all answers
    pub count: u64,
    /// queries + 1 of them
    pub first: *const u64,
    /// of an index each below 2^32; of a world a jostle_id
    pub ids: *const u64,
    /// as in jostle_hit; NULL where the queries have none
    pub at: *const f64,
    /// whether query i has more answers than were asked for
    pub more: *const u8,
}

/// An object found along a ray or sweep, or near something: jostle::Hit.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_hit {
    /// of an index: UINT64_MAX where there is none; of a world: 0
    pub id: u64,
    /// the fraction; of the nearest boxes the squared distance, of the nearest shapes the ///\< distance; a space of floats has it rounded to float
    pub at: f64,
}

/// Objects with a shape and a pose. A pose is a position and, in 3D, a quaternion x, y, z, w; in 2D cosine
/// and sine: 7 or 4 numbers of the space. Where a motion is wanted, linear and angular velocity follow: 13 or
/// 7 numbers.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_objects {
    pub shapes: *const jostle_shapes,
    pub poses: jostle_values,
}

/// The space inside some planes: jostle::Frustum. A plane is normal and offset: dim + 1 numbers.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_frustum {
    pub planes: *const c_void,
    pub count: u64,
}

/// Queries of one kind.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_queries {
    pub kind: jostle_query_kind,
    /// of the nearest kinds: how many are wanted of each query; 0, as in a struct of ///\< zeros: one (C++ and Python, where it isn't the default, find none)
    pub nearest: u32,
    /// numbers of the space, those of one query one after another. The stride is at ///\< least the size of a query, or that size and less than 0
    pub values: jostle_values,
    /// of the kinds that have a shape, one for each query, whose number they ///\< are; else NULL
    pub shapes: *const jostle_objects,
}

/// Where memory comes from. Both functions are called from several threads at a time and must not fail but by
/// returning NULL, which ends the call with JOSTLE_OUT_OF_MEMORY. They and `context` must outlive every
/// handle that was made with them.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_allocator {
    pub struct_size: u64,
    pub context: *mut c_void,
    pub allocate: Option<unsafe extern "C" fn(context: *mut c_void, size: u64, alignment: u64) -> *mut c_void>,
    pub deallocate: Option<unsafe extern "C" fn(context: *mut c_void, memory: *mut c_void, size: u64, alignment: u64)>,
}

/// What every handle that works can be made with: jostle::FinderOptions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_options {
    pub struct_size: u64,
    /// NULL: the default executor
    pub executor: *const jostle_executor,
    /// NULL: new and delete
    pub allocator: *const jostle_allocator,
    pub instruction_set: jostle_instruction_set,
    /// 1: a contact for each triangle, jostle::ContactOptions::all_points
    pub all_points: i32,
}

/// Which pairs are wanted: jostle::Filter and, between two sets, jostle::CrossFilter. The values are
/// uint32_t, one per object; those not given filter nothing. Members that end in _b are for the second set.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_filter {
    pub struct_size: u64,
    pub category: jostle_values,
    /// give both or neither
    pub mask: jostle_values,
    /// objects of one owner never pair; UINT32_MAX belongs to nobody
    pub owner: jostle_values,
    pub category_b: jostle_values,
    pub mask_b: jostle_values,
    pub owner_b: jostle_values,
    /// may be NULL
    pub accept: jostle_accept_pair_function,
    pub context: *mut c_void,
    /// the last so many boxes of one set meet the others, and not each other
    pub ghosts: u64,
    /// three uint32_t an object; with one in common, not UINT32_MAX, they don't pair
    pub vertices: jostle_values,
}

/// The same for many scenes: jostle::SceneFilter. One value for each box of all scenes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_scene_filter {
    pub struct_size: u64,
    pub category: jostle_values,
    /// give both or neither
    pub mask: jostle_values,
    pub owner: jostle_values,
    /// may be NULL
    pub accept: jostle_accept_scene_pair_function,
    pub context: *mut c_void,
}

/// What the last search did: jostle::Stats.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_stats {
    /// set by the caller; what the caller's struct doesn't have isn't written
    pub struct_size: u64,
    pub objects: u64,
    pub pairs: u64,
    pub records: u64,
    pub candidates: u64,
    pub ties: u64,
    pub bricks: u64,
    pub nested_grids: u64,
    pub bytes_reserved: u64,
    pub ms_total: f64,
    pub ms_tune: f64,
    pub ms_scatter: f64,
    pub ms_sweep: f64,
    pub ms_finish: f64,
}

/// What boxes and their images are. Everything is valid until the next build.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_images_view {
    /// the originals, then the images
    pub boxes: jostle_boxes,
    /// of which box each one is an image; an original is its own
    pub origin: *const u32,
    /// how far each one is from its origin: dim numbers
    pub shift: *const c_void,
    /// how many of the boxes are
    pub originals: u64,
}

/// What a search for neighbours is given. Numbers are those of the finder's space, side by side; of cutoff,
/// radii and table exactly one is given.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_neighbor_query {
    pub struct_size: u64,
    /// dim numbers each
    pub points: *const c_void,
    pub count: u64,
    /// a second set; NULL: neighbours are among the points
    pub others: *const c_void,
    pub other_count: u64,
    /// many systems: where the points of each begin, and the end; NULL: one system
    pub offsets: *const u64,
    /// one less than offsets
    pub system_count: u64,
    /// for all pairs; rounded to the space's numbers
    pub cutoff: f64,
    /// one for each point, of the second set as well: a pair's cutoff is their sum
    pub radii: *const c_void,
    pub radii_b: *const c_void,
    /// one for each point, below type_count
    pub types: *const u32,
    pub types_b: *const u32,
    /// of type_count * type_count cutoffs
    pub table: *const c_void,
    pub type_count: u64,
    /// dim vectors of dim numbers each
    pub cells: *const c_void,
    /// dim for each cell: 1 where space repeats itself along the vector
    pub repeats: *const i32,
    /// 0: open space; 1; of many systems also one for each
    pub cell_count: u64,
    /// 1: each pair once; not for two sets
    pub half: i32,
    pub shifts: i32,
    pub vectors: i32,
    /// 1 for each that the list is to have
    pub distances: i32,
    /// 0, or by how much further is looked and kept: NeighborOptions::skin
    pub skin: f64,
    /// 1: a pair's cutoff is the greater of its two radii, not their sum
    pub greater: i32,
}

/// The neighbours of point i are neighbors\[k], for k from offsets\[i] to offsets\[i + 1] - 1, ascending. Valid
/// until the finder's next call.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_neighbor_list {
    /// one more than points
    pub offsets: *const u64,
    pub neighbors: *const u32,
    pub count: u64,
    /// of the neighbour, in periods: dim numbers; NULL where not wanted
    pub shifts: *const i32,
    /// to the neighbour's image: dim numbers of the space; NULL where not wanted
    pub vectors: *const c_void,
    /// NULL where not wanted
    pub distances: *const c_void,
    /// 0 if a list that a skin had kept was enough
    pub searched: i32,
}

/// The asker, as an object of a filter. In a world category and mask filter nothing if both are UINT32_MAX,
/// and else both do: an object whose mask is 0 is then not found.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_asker {
    pub category: u32,
    pub mask: u32,
    /// objects of this owner aren't found; UINT32_MAX belongs to nobody
    pub owner: u32,
}

/// Which objects a query is about: jostle::QueryFilter and jostle::ObjectQueryFilter.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_query_filter {
    pub struct_size: u64,
    pub category: jostle_values,
    pub mask: jostle_values,
    /// uint32_t by id; of an index alone: a world knows its objects'
    pub owner: jostle_values,
    /// NULL: one whose category and mask have all bits, without owner
    pub asker: *const jostle_asker,
    /// an object that doesn't count; NULL: none; nor does a hit's id ///\< where there was none exclude any
    pub exclude: *const u64,
    /// may be NULL
    pub accept: jostle_accept_answer_function,
    pub context: *mut c_void,
    /// more than 1: so many filters lie here, one for each query, as far apart as ///\< struct_size says; the first one's count counts. 0 or 1: it serves all queries
    pub count: u64,
}

/// What an index is made of: jostle::IndexStats.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_index_stats {
    /// set by the caller
    pub struct_size: u64,
    pub objects: u64,
    pub pages: u64,
    pub leaves: u64,
    pub nodes: u64,
    pub depth: u64,
    pub bytes: u64,
    pub sorts: u64,
    pub splits: u64,
}

/// Whom an object pairs with: jostle::ObjectFilter. Begin with what objects have that are given none:
///     jostle_object_filter filter = JOSTLE_OBJECT_FILTER_DEFAULTS;
/// 0 is a value like any other: objects whose owner is 0 belong to one owner, and never pair.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_object_filter {
    pub category: u32,
    pub mask: u32,
    /// objects of one owner never pair; UINT32_MAX belongs to nobody
    pub owner: u32,
    /// 1: never pairs with static ones
    pub is_static: i32,
}

/// A category and mask that queries have: jostle::QueryLayer.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_query_layer {
    pub category: u32,
    pub mask: u32,
}

/// jostle::WorldOptions. `context` and what accept needs must outlive the world.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_world_options {
    pub struct_size: u64,
    /// may be NULL
    pub common: *const jostle_options,
    pub margin: f64,
    /// may be NULL
    pub accept: jostle_accept_object_pair_function,
    pub context: *mut c_void,
    /// queries with one of these have indexes of their own; may be NULL
    pub layers: *const jostle_query_layer,
    /// at most 8
    pub layer_count: u64,
}

/// What new objects are like: jostle::ObjectOptions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_object_options {
    pub struct_size: u64,
    /// NULL: pairs with all
    pub filter: *const jostle_object_filter,
    pub margin: f64,
    /// 1: keeps its id and box, touches nothing
    pub disabled: i32,
    /// the caller's own: see jostle_world_set_user_data
    pub user_data: u64,
    /// more than 1: so many options lie here, one for each box, as far apart as ///\< struct_size says; the first one's count counts. 0 or 1: these are all boxes'
    pub count: u64,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_id_pair {
    pub a: jostle_id,
    /// the index of a is less than that of b
    pub b: jostle_id,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_ended_pair {
    pub a: jostle_id,
    pub b: jostle_id,
    pub reason: jostle_end_reason,
    /// 0
    pub reserved: i32,
}

/// What the last update did, and what there is: jostle::WorldStats.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_world_stats {
    /// set by the caller
    pub struct_size: u64,
    pub objects: u64,
    pub resting: u64,
    pub active: u64,
    pub disabled: u64,
    pub refused: u64,
    pub commands: u64,
    pub dropped: u64,
    pub changed: u64,
    pub woken: u64,
    pub settled: u64,
    pub candidates: u64,
    pub false_positives: u64,
    pub listed: u64,
    pub began: u64,
    pub persisted: u64,
    pub ended: u64,
    pub bytes_reserved: u64,
    pub us_total: f64,
    pub us_apply: f64,
    pub us_active: f64,
    pub us_resting: f64,
    pub us_events: f64,
    pub us_index: f64,
    pub contested: u64,
}

/// What a shape is.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_shape_info {
    pub dim: i32,
    pub r#type: jostle_shape_type,
    pub radius: f64,
    pub size: [f64; 3],
    pub offset: f64,
    /// of a user's own shape; else NULL
    pub context: *mut c_void,
}

/// Where two objects touch: jostle::Contact. The normal is a unit vector from a to b: b moved along it by
/// `depth` comes out of a. A depth below 0 is a gap. A point is midway between the surfaces; from_a and
/// from_b are that one point, counted from the positions of a's and b's poses in world axes, so in the world
/// it is at pose_a + from_a. The deepest point is first. `feature` names what meets there and stays the same
/// from frame to frame.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_point_2f {
    pub from_a: [f32; 2],
    pub from_b: [f32; 2],
    pub depth: f32,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_2f {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f32; 2],
    pub count: u32,
    pub point: [jostle_contact_point_2f; 2],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_point_3f {
    pub from_a: [f32; 3],
    pub from_b: [f32; 3],
    pub depth: f32,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_3f {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f32; 3],
    pub count: u32,
    pub point: [jostle_contact_point_3f; 4],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_point_2d {
    pub from_a: [f64; 2],
    pub from_b: [f64; 2],
    pub depth: f64,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_2d {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f64; 2],
    pub count: u32,
    pub point: [jostle_contact_point_2d; 2],
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_point_3d {
    pub from_a: [f64; 3],
    pub from_b: [f64; 3],
    pub depth: f64,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_contact_3d {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f64; 3],
    pub count: u32,
    pub point: [jostle_contact_point_3d; 4],
}

/// What a user's own test is given: jostle::PairTestInput. Poses are position and rotation, counted from a's
/// position: 7 or 4 doubles.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_pair_test_input {
    pub shape_a: jostle_shape_info,
    pub shape_b: jostle_shape_info,
    pub pose_a: *const f64,
    pub pose_b: *const f64,
    pub margin: f64,
}

/// The deepest point of a contact: jostle::PointContact.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_point_contact_2f {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f32; 2],
    pub from_a: [f32; 2],
    pub from_b: [f32; 2],
    pub depth: f32,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_point_contact_3f {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f32; 3],
    pub from_a: [f32; 3],
    pub from_b: [f32; 3],
    pub depth: f32,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_point_contact_2d {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f64; 2],
    pub from_a: [f64; 2],
    pub from_b: [f64; 2],
    pub depth: f64,
    pub feature: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_point_contact_3d {
    pub pair: jostle_pair,
    pub part_a: u32,
    pub part_b: u32,
    pub normal: [f64; 3],
    pub from_a: [f64; 3],
    pub from_b: [f64; 3],
    pub depth: f64,
    pub feature: u32,
}

/// Where a ray, or a shape on its way, first meets another: jostle::CastHit. The fraction, of the ray's
/// direction or the displacement, is infinite where it doesn't. The normal points out of the shape that is
/// met. The point counts from the position of that shape's pose, in world axes: in the world it is at pose +
/// point.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_cast_hit_2f {
    pub fraction: f32,
    pub normal: [f32; 2],
    pub point: [f32; 2],
    pub part: u32,
    pub moving_part: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_cast_hit_3f {
    pub fraction: f32,
    pub normal: [f32; 3],
    pub point: [f32; 3],
    pub part: u32,
    pub moving_part: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_cast_hit_2d {
    pub fraction: f64,
    pub normal: [f64; 2],
    pub point: [f64; 2],
    pub part: u32,
    pub moving_part: u32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_cast_hit_3d {
    pub fraction: f64,
    pub normal: [f64; 3],
    pub point: [f64; 3],
    pub part: u32,
    pub moving_part: u32,
}

/// What a surface is made of: jostle::Surface.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_surface_parts {
    /// 3 vertices each
    pub triangles: *const u32,
    pub triangle_count: u64,
    /// 2 vertices each: those that are no triangle's; read back, those as well
    pub edges: *const u32,
    pub edge_count: u64,
    /// vertices of nothing else; read back, all that are of something
    pub points: *const u32,
    pub point_count: u64,
    /// 0: as many as are named
    pub vertices: u64,
}

/// jostle::SurfaceOptions. What is given has one element for each vertex; NULL: not given.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_surface_options {
    pub struct_size: u64,
    /// a number of the finder's space each
    pub thickness: *const c_void,
    /// positions at rest: 3 numbers each
    pub rest: *const c_void,
    /// parts of one body make no pair
    pub bodies: *const u32,
    /// asked about a vertex and a triangle
    pub accept_vertex_triangle: jostle_accept_pair_function,
    /// asked about two edges
    pub accept_edge_edge: jostle_accept_pair_function,
    /// of both
    pub context: *mut c_void,
    /// of impacts; 0: 1e-6
    pub tolerance: f64,
}

/// A vertex and a triangle, or two edges, that are near each other: jostle::NearParts.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_near_parts_3f {
    pub a: u32,
    pub b: u32,
    pub vertices: [u32; 4],
    pub weights: [f32; 4],
    pub normal: [f32; 3],
    pub distance: f32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_near_parts_3d {
    pub a: u32,
    pub b: u32,
    pub vertices: [u32; 4],
    pub weights: [f64; 4],
    pub normal: [f64; 3],
    pub distance: f64,
}

/// The same that meet, and when: jostle::PartImpact.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_part_impact_3f {
    pub a: u32,
    pub b: u32,
    pub vertices: [u32; 4],
    pub time: f32,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_part_impact_3d {
    pub a: u32,
    pub b: u32,
    pub vertices: [u32; 4],
    pub time: f64,
}

/// An edge that passes through a triangle, or touches it: jostle::Crossing.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_crossing {
    pub edge: u32,
    pub triangle: u32,
}

/// Blocks of jostle_near_parts_... of the space.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_near_surface {
    pub vertex_triangle: jostle_blocks,
    pub edge_edge: jostle_blocks,
}

/// Blocks of jostle_part_impact_... of the space.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_moving_surface {
    pub vertex_triangle: jostle_blocks,
    pub edge_edge: jostle_blocks,
    /// the least time; 1 where there are none
    pub safe_step: f64,
}

/// How work is cut: jostle::ProcessOptions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_process_options {
    pub struct_size: u64,
    /// NULL: the default executor
    pub executor: *const jostle_executor,
    /// 0: chosen by their number
    pub block_items: u64,
}

/// Where a callback stands: jostle::Work.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct jostle_work {
    pub slot: u32,
    pub block: u32,
}

extern "C" {
    /// The version of the library that runs.
    /// Errors    none but NULL.
    pub fn jostle_version(major: *mut u32, minor: *mut u32, patch: *mut u32, error: *mut jostle_error) -> jostle_status;
    /// The name of a status, such as "nan_coordinate". It lives for ever.
    pub fn jostle_status_name(status: jostle_status, name: *mut *const c_char, error: *mut jostle_error) -> jostle_status;
    /// The instruction sets that were compiled in and that this machine can run, fastest first. They live for
    /// ever.
    pub fn jostle_instruction_sets(sets: *mut *const jostle_instruction_set, count: *mut u64, error: *mut jostle_error) -> jostle_status;
    pub fn jostle_instruction_set_name(set: jostle_instruction_set, name: *mut *const c_char, error: *mut jostle_error) -> jostle_status;
    /// Gives back a handle of any kind, or does nothing with NULL.
    pub fn jostle_free(handle: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// How many objects an index or a world has, in a world as of the last update or jostle_world_apply; or how
    /// many shapes a jostle_shapes has.
    pub fn jostle_size(handle: *const c_void, size: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// Makes an index, a world or a jostle_shapes empty: a world becomes what it was when it was made.
    pub fn jostle_clear(handle: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// Gives back the working memory of a jostle_finder, jostle_neighbor_finder, jostle_surface_finder or
    /// jostle_index: what their last call handed out is gone, and so is what a neighbor finder's skin keeps.
    pub fn jostle_release_memory(handle: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// Everything on the calling thread.
    pub fn jostle_executor_serial(out: *mut *mut jostle_executor, error: *mut jostle_error) -> jostle_status;
    /// What calls use that are given none, with at most `threads` threads, 0 for all: oneTBB's, or threads of its
    /// own where the library was built without oneTBB.
    pub fn jostle_executor_default(threads: u32, out: *mut *mut jostle_executor, error: *mut jostle_error) -> jostle_status;
    /// A pool of its own; 0 for as many threads as the machine has cores.
    pub fn jostle_executor_threads(threads: u32, out: *mut *mut jostle_executor, error: *mut jostle_error) -> jostle_status;
    /// The host's own job system. `run` and `context` are kept until the executor is freed and nothing uses it.
    pub fn jostle_executor_callback(concurrency: u32, run: jostle_run_function, context: *mut c_void, out: *mut *mut jostle_executor, error: *mut jostle_error) -> jostle_status;
    pub fn jostle_executor_concurrency(executor: *const jostle_executor, threads: *mut u32, error: *mut jostle_error) -> jostle_status;
    /// Fails as every search would with these boxes, or does nothing. Cost: one pass.
    pub fn jostle_boxes_check(space: jostle_space, boxes: *const jostle_boxes, error: *mut jostle_error) -> jostle_status;
    /// An empty result, to be filled by a call and filled again by the next. What the functions below hand out is
    /// valid until then. Its memory is used again: a call like the one before allocates nothing. `options` may be
    /// NULL; its allocator alone counts.
    pub fn jostle_results_new(options: *const jostle_options, out: *mut *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// The pairs or contacts of a result.
    pub fn jostle_results_blocks(results: *const jostle_results, out: *mut jostle_blocks, error: *mut jostle_error) -> jostle_status;
    /// The lists of answers of a result.
    pub fn jostle_results_lists(results: *const jostle_results, out: *mut jostle_lists, error: *mut jostle_error) -> jostle_status;
    /// The bytes of a snapshot, or of a text (which a zero follows).
    pub fn jostle_results_bytes(results: *const jostle_results, bytes: *mut *const c_void, count: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// Copies all blocks into one array with room for `room` items.
    /// Errors    JOSTLE_SIZE_MISMATCH if that is too small.
    pub fn jostle_blocks_copy(blocks: *const jostle_blocks, room: u64, out: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// An order-independent fingerprint of pairs: jostle::pair_checksum.
    pub fn jostle_pair_checksum(pairs: *const jostle_blocks, checksum: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// `options` may be NULL. One finder serves boxes of every space.
    pub fn jostle_finder_new(options: *const jostle_options, out: *mut *mut jostle_finder, error: *mut jostle_error) -> jostle_status;
    /// All pairs among `a` or, if `b` isn't NULL, of one box of `a` and one of `b`. `filter` may be NULL. The
    /// pairs lie in the finder and are valid until its next call.
    /// Cost      expected linear in boxes and pairs.
    pub fn jostle_finder_find(finder: *mut jostle_finder, space: jostle_space, a: *const jostle_boxes, b: *const jostle_boxes, filter: *const jostle_filter, order: jostle_order, pairs: *mut jostle_blocks, error: *mut jostle_error) -> jostle_status;
    /// The same, and the caller owns the pairs.
    pub fn jostle_finder_take(finder: *mut jostle_finder, space: jostle_space, a: *const jostle_boxes, b: *const jostle_boxes, filter: *const jostle_filter, order: jostle_order, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// The pairs of many scenes that have nothing to do with each other: jostle::PairFinder::find_scenes.
    /// Scene k is the boxes from number offsets\[k] up to offsets\[k + 1]: there are scene_count + 1 offsets, the
    /// first 0 and the last the number of boxes. Block k of `pairs` has the pairs of scene k, and is empty if it
    /// has none; they are numbered within their scene. `filter` may be NULL. The pairs lie in the finder and are
    /// valid until its next call.
    /// Errors    for offsets and boxes, with their number.
    pub fn jostle_finder_find_scenes(finder: *mut jostle_finder, space: jostle_space, boxes: *const jostle_boxes, offsets: *const u64, scene_count: u64, filter: *const jostle_scene_filter, pairs: *mut jostle_blocks, error: *mut jostle_error) -> jostle_status;
    /// Hands the pairs to `sink` instead of storing them. `finished` becomes 0 if the sink stopped it, else 1.
    pub fn jostle_finder_stream(finder: *mut jostle_finder, space: jostle_space, a: *const jostle_boxes, b: *const jostle_boxes, filter: *const jostle_filter, sink: jostle_sink_function, context: *mut c_void, finished: *mut i32, error: *mut jostle_error) -> jostle_status;
    pub fn jostle_finder_stats(finder: *const jostle_finder, stats: *mut jostle_stats, error: *mut jostle_error) -> jostle_status;
    /// Once, without a finder. `b`, `filter` and `options` may be NULL.
    pub fn jostle_find_pairs(space: jostle_space, a: *const jostle_boxes, b: *const jostle_boxes, filter: *const jostle_filter, order: jostle_order, options: *const jostle_options, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// The definition: every box against every other, ascending by (a, b). For checking results.
    pub fn jostle_find_pairs_brute_force(space: jostle_space, a: *const jostle_boxes, b: *const jostle_boxes, filter: *const jostle_filter, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Writes an order of the boxes along space into `order`, one number per box: order\[k] is the position of the
    /// box that comes k-th. See jostle::spatial_order. `options` may be NULL.
    #[cfg(feature = "world")]
    pub fn jostle_spatial_order(space: jostle_space, boxes: *const jostle_boxes, options: *const jostle_options, order: *mut u32, error: *mut jostle_error) -> jostle_status;
    /// `options` may be NULL.
    pub fn jostle_images_new(space: jostle_space, options: *const jostle_options, out: *mut *mut jostle_images, error: *mut jostle_error) -> jostle_status;
    /// Copies the boxes and adds the images of those near an end of a periodic axis. `period`: its length along
    /// each axis, dim numbers, 0 where space doesn't repeat itself.
    /// Cost      two passes over the boxes and a copy of them.
    /// Errors    a box that is half a period long or longer, and not infinite both ways; one that reaches two
    ///           periods up from the lowest of all; a period that is negative, infinite or NaN.
    pub fn jostle_images_build(images: *mut jostle_images, boxes: *const jostle_boxes, period: *const c_void, error: *mut jostle_error) -> jostle_status;
    pub fn jostle_images_view_read(images: *const jostle_images, out: *mut jostle_images_view, error: *mut jostle_error) -> jostle_status;
    /// The filter that a search among the boxes of the view has to be given, so that each pair is found once.
    /// `out->owner_b` sees to that, so leave it as it is. `accept` and `context` may be set on `out`: that accept
    /// is called with numbers of the view's boxes, an original's and a greater one, which lead to the shift.
    /// `originals` may be NULL; its arrays have one value per original, and its accept is called with originals.
    /// What it points to must outlive the search. `out` is valid until the next build or filter.
    pub fn jostle_images_filter(images: *mut jostle_images, originals: *const jostle_filter, out: *mut jostle_filter, error: *mut jostle_error) -> jostle_status;
    /// `options` may be NULL.
    pub fn jostle_neighbor_finder_new(space: jostle_space, options: *const jostle_options, out: *mut *mut jostle_neighbor_finder, error: *mut jostle_error) -> jostle_status;
    /// For each point all points within a cutoff, with their images where space repeats itself; of many systems,
    /// within each. What exactly, where points may lie, and what is an error, says NeighborFinder in
    /// neighbors.hpp.
    pub fn jostle_neighbor_finder_find(finder: *mut jostle_neighbor_finder, query: *const jostle_neighbor_query, list: *mut jostle_neighbor_list, error: *mut jostle_error) -> jostle_status;
    /// Hands the list to `sink` in blocks of so many rows instead of storing all of it. Not for many systems, nor
    /// with a skin. `finished` becomes 0 if the sink stopped it, else 1.
    pub fn jostle_neighbor_finder_stream(finder: *mut jostle_neighbor_finder, query: *const jostle_neighbor_query, rows: u64, sink: jostle_neighbor_sink_function, context: *mut c_void, finished: *mut i32, error: *mut jostle_error) -> jostle_status;
    /// The least box around all, in a world around the bounds of all that aren't disabled: 2 dim numbers. `any`
    /// becomes 0 where there are none, else 1.
    #[cfg(feature = "world")]
    pub fn jostle_query_bounds(handle: *const c_void, any: *mut i32, r#box: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// Whether there is any answer, 1 or 0: any\[i].
    #[cfg(feature = "world")]
    pub fn jostle_query_any(handle: *const c_void, queries: *const jostle_queries, objects: *const jostle_objects, filter: *const jostle_query_filter, any: *mut u8, error: *mut jostle_error) -> jostle_status;
    /// How many there are: counts\[i].
    #[cfg(feature = "world")]
    pub fn jostle_query_count(handle: *const c_void, queries: *const jostle_queries, objects: *const jostle_objects, filter: *const jostle_query_filter, counts: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// What each query meets first, or is nearest to: hits\[i]. `details` may be NULL; of boxes it isn't used, of
    /// shapes details\[i] becomes a jostle_cast_hit_... of the space or, nearest to a shape, what
    /// jostle_contact_finder_distances gives, the asker being a. Its fraction, or distance, is infinite where
    /// there is nothing.
    #[cfg(feature = "world")]
    pub fn jostle_query_first(handle: *const c_void, queries: *const jostle_queries, objects: *const jostle_objects, filter: *const jostle_query_filter, hits: *mut jostle_hit, details: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// All answers, along rays and sweeps and near something ascending by (at, id), else by id; no more than
    /// max_results each: UINT64_MAX for all. The results have lists and, of casts and the nearest among shapes,
    /// the details of all lists as blocks.
    #[cfg(feature = "world")]
    pub fn jostle_query_all(handle: *const c_void, queries: *const jostle_queries, objects: *const jostle_objects, filter: *const jostle_query_filter, max_results: u64, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Hands the answers to one query to `visit`, each once, as they are found, in the order of jostle_query_all;
    /// those of regions in an order of its own. `finished` becomes 0 if it stopped that, else 1.
    #[cfg(feature = "world")]
    pub fn jostle_query_visit(handle: *const c_void, query: *const jostle_queries, objects: *const jostle_objects, filter: *const jostle_query_filter, visit: jostle_visit_answer_function, context: *mut c_void, finished: *mut i32, error: *mut jostle_error) -> jostle_status;
    /// The definition that answers go back to: for each query of boxes, all but JOSTLE_POSED_SHAPE and its like,
    /// whether this box answers it, 1 or 0, and its jostle_hit::at, 0 for regions. `box`: 2 dim numbers.
    #[cfg(feature = "world")]
    pub fn jostle_box_answers(space: jostle_space, queries: *const jostle_queries, r#box: *const c_void, answers: *mut u8, at: *mut f64, error: *mut jostle_error) -> jostle_status;
    /// All pairs of one of `boxes` and an object whose box it touches, ascending by (a, b): a is the position in
    /// `boxes`, b the object's id in an index, or its index in a world. One call at a time. `filter` may be NULL.
    #[cfg(feature = "world")]
    pub fn jostle_query_join(handle: *const c_void, boxes: *const jostle_boxes, filter: *const jostle_query_filter, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Hands over the pairs of objects no further apart than max_distance (it may be infinite): of two of this
    /// structure's if `other` is NULL or the same, else of one of this and one of the other of its kind. First
    /// come those at distance 0, then the others ascending by (at, a, b). In one world, pairs that filters
    /// forbid are left out, and pairs that touch and that `accept` refused; about pairs apart it hasn't been
    /// asked.
    /// `finished` becomes 0 if `visit` stopped that, else 1.
    #[cfg(feature = "world")]
    pub fn jostle_query_closest_pairs(handle: *const c_void, other: *const c_void, max_distance: f64, visit: jostle_visit_close_pair_function, context: *mut c_void, finished: *mut i32, error: *mut jostle_error) -> jostle_status;
    /// `options` may be NULL.
    #[cfg(feature = "world")]
    pub fn jostle_index_new(space: jostle_space, options: *const jostle_options, out: *mut *mut jostle_index, error: *mut jostle_error) -> jostle_status;
    /// Forgets everything and takes these boxes. Box i gets the id ids\[i] or, if `ids` is NULL, i. Below, too,
    /// there are as many ids as boxes.
    #[cfg(feature = "world")]
    pub fn jostle_index_build(index: *mut jostle_index, ids: *const u32, boxes: *const jostle_boxes, error: *mut jostle_error) -> jostle_status;
    /// No id may be in the index already, or twice in the call.
    #[cfg(feature = "world")]
    pub fn jostle_index_insert(index: *mut jostle_index, ids: *const u32, boxes: *const jostle_boxes, error: *mut jostle_error) -> jostle_status;
    /// Every id must be in the index, and once in the call.
    #[cfg(feature = "world")]
    pub fn jostle_index_erase(index: *mut jostle_index, ids: *const u32, count: u64, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_index_move(index: *mut jostle_index, ids: *const u32, boxes: *const jostle_boxes, error: *mut jostle_error) -> jostle_status;
    /// contains\[i] becomes 1 if ids\[i] is in the index, else 0.
    #[cfg(feature = "world")]
    pub fn jostle_index_contains(index: *const jostle_index, ids: *const u32, count: u64, contains: *mut u8, error: *mut jostle_error) -> jostle_status;
    /// The boxes of objects that are in the index: 2 dim numbers each.
    #[cfg(feature = "world")]
    pub fn jostle_index_boxes(index: *const jostle_index, ids: *const u32, count: u64, boxes: *mut c_void, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_index_stats_read(index: *const jostle_index, stats: *mut jostle_index_stats, error: *mut jostle_error) -> jostle_status;
    /// Hands over the pairs of objects whose boxes touch: of two of this index if `other` is NULL or this index,
    /// else of one of this and one of the other, in an order of the indexes' own. `at` is 0, and `bound` NULL.
    /// `finished` becomes 0 if `visit` stopped that, else 1.
    #[cfg(feature = "world")]
    pub fn jostle_index_pairs(index: *const jostle_index, other: *const jostle_index, visit: jostle_visit_close_pair_function, context: *mut c_void, finished: *mut i32, error: *mut jostle_error) -> jostle_status;
    /// `options` may be NULL.
    #[cfg(feature = "world")]
    pub fn jostle_world_new(space: jostle_space, options: *const jostle_world_options, out: *mut *mut jostle_world, error: *mut jostle_error) -> jostle_status;
    /// As many new objects as boxes. ids\[i] becomes that of box i, good at once. `options` may be NULL.
    #[cfg(feature = "world")]
    pub fn jostle_world_add(world: *mut jostle_world, boxes: *const jostle_boxes, options: *const jostle_object_options, ids: *mut jostle_id, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_world_remove(world: *mut jostle_world, ids: *const jostle_id, count: u64, error: *mut jostle_error) -> jostle_status;
    /// In the next update the pairs of each of these objects come in the list of those that began, as if they
    /// were new; with `others`, as many as ids and not NULL, only the pair of ids\[i] and others\[i]. `accept` is
    /// asked about them again, also about those that it refused.
    #[cfg(feature = "world")]
    pub fn jostle_world_report_again(world: *mut jostle_world, ids: *const jostle_id, others: *const jostle_id, count: u64, error: *mut jostle_error) -> jostle_status;
    /// New boxes, as many as ids. `displacements`, dim numbers each and one after another, may be NULL: during
    /// the coming step the boxes move that far, and touch what lies on their way.
    #[cfg(feature = "world")]
    pub fn jostle_world_move(world: *mut jostle_world, ids: *const jostle_id, boxes: *const jostle_boxes, displacements: *const c_void, sequence: u32, error: *mut jostle_error) -> jostle_status;
    /// New edge lengths, dim numbers each, the same centres.
    #[cfg(feature = "world")]
    pub fn jostle_world_resize(world: *mut jostle_world, ids: *const jostle_id, count: u64, sizes: *const c_void, sequence: u32, error: *mut jostle_error) -> jostle_status;
    /// A filter for each object.
    #[cfg(feature = "world")]
    pub fn jostle_world_set_filter(world: *mut jostle_world, ids: *const jostle_id, count: u64, filters: *const jostle_object_filter, sequence: u32, error: *mut jostle_error) -> jostle_status;
    /// A margin for each object, on top of the world's.
    #[cfg(feature = "world")]
    pub fn jostle_world_set_margin(world: *mut jostle_world, ids: *const jostle_id, count: u64, margins: *const f64, sequence: u32, error: *mut jostle_error) -> jostle_status;
    /// 1 or 0 for each object.
    #[cfg(feature = "world")]
    pub fn jostle_world_set_enabled(world: *mut jostle_world, ids: *const jostle_id, count: u64, enabled: *const u8, sequence: u32, error: *mut jostle_error) -> jostle_status;
    /// The caller's own 64 bits for each object. At once; any number of threads may set and read, at any time.
    #[cfg(feature = "world")]
    pub fn jostle_world_set_user_data(world: *mut jostle_world, ids: *const jostle_id, count: u64, data: *const u64, error: *mut jostle_error) -> jostle_status;
    /// Also of objects that the last update has removed.
    #[cfg(feature = "world")]
    pub fn jostle_world_user_data(world: *const jostle_world, ids: *const jostle_id, count: u64, data: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// Applies what was queued before and finds out what that did to the pairs.
    #[cfg(feature = "world")]
    pub fn jostle_world_update(world: *mut jostle_world, error: *mut jostle_error) -> jostle_status;
    /// Moves these objects and updates; the boxes are read in place. As many ids as boxes.
    #[cfg(feature = "world")]
    pub fn jostle_world_update_moves(world: *mut jostle_world, ids: *const jostle_id, boxes: *const jostle_boxes, error: *mut jostle_error) -> jostle_status;
    /// Shows what was queued before, ahead of the next update: to queries, jostle_world_touching, _pairs and
    /// all that can be asked about objects. The lists of the last update, and what the next one gives, stay the
    /// same.
    #[cfg(feature = "world")]
    pub fn jostle_world_apply(world: *mut jostle_world, error: *mut jostle_error) -> jostle_status;
    /// Those that touch now and didn't before, ascending by index.
    #[cfg(feature = "world")]
    pub fn jostle_world_began(world: *const jostle_world, pairs: *mut *const jostle_id_pair, count: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// Those that touched before and don't now, ascending by index, and why.
    #[cfg(feature = "world")]
    pub fn jostle_world_ended(world: *const jostle_world, pairs: *mut *const jostle_ended_pair, count: *mut u64, error: *mut jostle_error) -> jostle_status;
    /// Those that touched before and still do, and of which one object changed: jostle_pair by index.
    #[cfg(feature = "world")]
    pub fn jostle_world_persisted(world: *const jostle_world, pairs: *mut jostle_blocks, error: *mut jostle_error) -> jostle_status;
    /// Began and persisted as one list, by index: what jostle_contact_finder_find wants.
    #[cfg(feature = "world")]
    pub fn jostle_world_changed_pairs(world: *const jostle_world, pairs: *mut jostle_blocks, error: *mut jostle_error) -> jostle_status;
    /// All pairs that touch, by index, owned by the caller. Costs as much as finding them anew.
    #[cfg(feature = "world")]
    pub fn jostle_world_pairs(world: *const jostle_world, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Who each of these objects touches: lists of ids, ascending by index.
    #[cfg(feature = "world")]
    pub fn jostle_world_touching(world: *const jostle_world, ids: *const jostle_id, count: u64, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Hands the same pairs to `visit` one by one, in the same order, without memory for them. `finished` becomes
    /// 0 if it stopped that, else 1.
    #[cfg(feature = "world")]
    pub fn jostle_world_visit_pairs(world: *const jostle_world, visit: jostle_visit_pair_function, context: *mut c_void, finished: *mut i32, error: *mut jostle_error) -> jostle_status;
    /// Every index is less than this.
    #[cfg(feature = "world")]
    pub fn jostle_world_index_end(world: *const jostle_world, end: *mut u32, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_world_contains(world: *const jostle_world, ids: *const jostle_id, count: u64, contains: *mut u8, error: *mut jostle_error) -> jostle_status;
    /// The ids of the objects with these indices; 0 where there is none.
    #[cfg(feature = "world")]
    pub fn jostle_world_ids(world: *const jostle_world, indices: *const u32, count: u64, ids: *mut jostle_id, error: *mut jostle_error) -> jostle_status;
    /// As they were given: 2 dim numbers each.
    #[cfg(feature = "world")]
    pub fn jostle_world_boxes(world: *const jostle_world, ids: *const jostle_id, count: u64, boxes: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// As they are compared, margins and displacements included.
    #[cfg(feature = "world")]
    pub fn jostle_world_bounds(world: *const jostle_world, ids: *const jostle_id, count: u64, boxes: *mut c_void, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_world_filters(world: *const jostle_world, ids: *const jostle_id, count: u64, filters: *mut jostle_object_filter, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_world_enabled(world: *const jostle_world, ids: *const jostle_id, count: u64, enabled: *mut u8, error: *mut jostle_error) -> jostle_status;
    /// The world's and the object's own together.
    #[cfg(feature = "world")]
    pub fn jostle_world_margins(world: *const jostle_world, ids: *const jostle_id, count: u64, margins: *mut f64, error: *mut jostle_error) -> jostle_status;
    /// What the world is, as bytes: the same on every machine.
    #[cfg(feature = "world")]
    pub fn jostle_world_save(world: *const jostle_world, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// What the world is, as bytes, and from now on the base: what differs from it is recorded.
    #[cfg(feature = "world")]
    pub fn jostle_world_save_base(world: *mut jostle_world, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// How the world differs from its base, as bytes. Costs what differs; what rests costs nothing.
    #[cfg(feature = "world")]
    pub fn jostle_world_save_changes(world: *mut jostle_world, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Becomes the world whose changes these are, of the same base.
    #[cfg(feature = "world")]
    pub fn jostle_world_restore_changes(world: *mut jostle_world, changes: *const c_void, size: u64, error: *mut jostle_error) -> jostle_status;
    /// Becomes the world that was saved.
    #[cfg(feature = "world")]
    pub fn jostle_world_restore(world: *mut jostle_world, snapshot: *const c_void, size: u64, error: *mut jostle_error) -> jostle_status;
    /// Another world like this one, with the same accept and context.
    #[cfg(feature = "world")]
    pub fn jostle_world_fork(world: *const jostle_world, out: *mut *mut jostle_world, error: *mut jostle_error) -> jostle_status;
    /// Becomes a view of another world of the same space, to be asked while that one is updated. Commands and
    /// updates of a view fail, until jostle_clear() or jostle_world_restore() makes it a world again.
    #[cfg(feature = "world")]
    pub fn jostle_world_follow(world: *mut jostle_world, other: *const jostle_world, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_world_stats_read(world: *const jostle_world, stats: *mut jostle_world_stats, error: *mut jostle_error) -> jostle_status;
    /// What the world looks like, in words.
    #[cfg(feature = "world")]
    pub fn jostle_world_explain(world: *const jostle_world, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    /// Calls `box` for every object and `line` for every pair of the last update's lists, on the calling thread.
    /// Either may be NULL.
    #[cfg(feature = "world")]
    pub fn jostle_world_draw(world: *const jostle_world, r#box: jostle_draw_function, line: jostle_draw_function, context: *mut c_void, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_pair_slots_new(out: *mut *mut jostle_pair_slots, error: *mut jostle_error) -> jostle_status;
    /// Gives slots to pairs that begin, and takes back those of pairs that end: the lists of jostle_world_began
    /// and jostle_world_ended, after every update.
    #[cfg(feature = "world")]
    pub fn jostle_pair_slots_update(slots: *mut jostle_pair_slots, began: *const jostle_id_pair, began_count: u64, ended: *const jostle_ended_pair, ended_count: u64, error: *mut jostle_error) -> jostle_status;
    /// The slot of each pair that began, the one that each pair that ended had, and a number that every slot is
    /// less than. Valid until the next update or restore.
    #[cfg(feature = "world")]
    pub fn jostle_pair_slots_lists(slots: *const jostle_pair_slots, began: *mut *const u32, began_count: *mut u64, ended: *mut *const u32, ended_count: *mut u64, end: *mut u32, error: *mut jostle_error) -> jostle_status;
    /// Those of pairs of indices; UINT32_MAX for one that doesn't touch.
    #[cfg(feature = "world")]
    pub fn jostle_pair_slots_find(slots: *const jostle_pair_slots, pairs: *const jostle_pair, count: u64, found: *mut u32, error: *mut jostle_error) -> jostle_status;
    /// The pairs and their slots as bytes, to go back to together with the world.
    #[cfg(feature = "world")]
    pub fn jostle_pair_slots_save(slots: *const jostle_pair_slots, results: *mut jostle_results, error: *mut jostle_error) -> jostle_status;
    #[cfg(feature = "world")]
    pub fn jostle_pair_slots_restore(slots: *mut jostle_pair_slots, bytes: *const c_void, size: u64, error: *mut jostle_error) -> jostle_status;
    /// Work is cut into blocks of items, which the executor's threads take one after another: however uneven it
    /// is, all are busy until the end. jostle_work::slot is less than the executor's concurrency, and differs
    /// among calls at the same time: it selects scratch memory. `options` may be NULL.
    pub fn jostle_process_items(items: u64, process: jostle_process_items_function, context: *mut c_void, options: *const jostle_process_options, error: *mut jostle_error) -> jostle_status;
    /// Works on all pairs, or contacts, of a result.
    pub fn jostle_process_blocks(blocks: *const jostle_blocks, process: jostle_process_blocks_function, context: *mut c_void, options: *const jostle_process_options, error: *mut jostle_error) -> jostle_status;
    /// Adds up values by object on all cores, with the same bits on any number of them: jostle::Responses in one
    /// call. values\[i], `width` numbers (1 to 8), belongs to object objects\[i], which is less than object_count.
    /// sums\[object] becomes the sum of its values, 0 where it has none. Sums of int64_t wrap around. `options`
    /// may be NULL. Each call allocates its working memory.
    /// Errors    an object that is object_count or more; jostle_error::index is the lowest such i.
    pub fn jostle_sum_by_object(number: jostle_number, width: u32, objects: *const u32, values: *const c_void, count: u64, options: *const jostle_options, object_count: u32, sums: *mut c_void, error: *mut jostle_error) -> jostle_status;
    /// Begins a recording of boxes. `frames_per_second` may be 0; `description`, UTF-8, says where the boxes come
    /// from and may be NULL. A file of this name is replaced. jostle_free closes the file, if
    /// jostle_recorder_close hasn't, without telling what goes wrong then.
    pub fn jostle_recorder_new(space: jostle_space, path: *const c_char, frames_per_second: f64, description: *const c_char, out: *mut *mut jostle_recorder, error: *mut jostle_error) -> jostle_status;
    /// Writes a frame: any number of boxes.
    pub fn jostle_recorder_frame(recorder: *mut jostle_recorder, boxes: *const jostle_boxes, error: *mut jostle_error) -> jostle_status;
    /// Completes the file. There are no frames after it.
    pub fn jostle_recorder_close(recorder: *mut jostle_recorder, error: *mut jostle_error) -> jostle_status;
}
