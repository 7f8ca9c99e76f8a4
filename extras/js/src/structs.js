// SPDX-License-Identifier: MIT
// Written by extras/js/describe.py: sizes of structs, and offsets of their members.

export const jostle_error = { sizeof: 512, status: 0, callback_result: 4, index: 8, message: 16 };
export const jostle_values = { sizeof: 24, data: 0, count: 8, stride: 16 };
export const jostle_boxes = { sizeof: 40, lo: 0, hi: 12, count: 24, stride: 32 };
export const jostle_pair = { sizeof: 8, a: 0, b: 4 };
export const jostle_block = { sizeof: 16, items: 0, count: 8 };
export const jostle_blocks = { sizeof: 32, blocks: 0, block_count: 8, count: 16, item_size: 24 };
export const jostle_lists = { sizeof: 32, queries: 0, count: 8, first: 16, ids: 20, at: 24, more: 28 };
export const jostle_hit = { sizeof: 16, id: 0, at: 8 };
export const jostle_objects = { sizeof: 32, shapes: 0, poses: 8 };
export const jostle_frustum = { sizeof: 16, planes: 0, count: 8 };
export const jostle_queries = { sizeof: 40, kind: 0, nearest: 4, values: 8, shapes: 32 };
export const jostle_allocator = { sizeof: 24, struct_size: 0, context: 8, allocate: 12, deallocate: 16 };
export const jostle_options = {
  sizeof: 24, struct_size: 0, executor: 8, allocator: 12, instruction_set: 16, all_points: 20,
};
export const jostle_filter = {
  sizeof: 192, struct_size: 0, category: 8, mask: 32, owner: 56, category_b: 80, mask_b: 104, owner_b: 128,
  accept: 152, context: 156, ghosts: 160, vertices: 168,
};
export const jostle_scene_filter = {
  sizeof: 88, struct_size: 0, category: 8, mask: 32, owner: 56, accept: 80, context: 84,
};
export const jostle_stats = {
  sizeof: 112, struct_size: 0, objects: 8, pairs: 16, records: 24, candidates: 32, ties: 40, bricks: 48,
  nested_grids: 56, bytes_reserved: 64, ms_total: 72, ms_tune: 80, ms_scatter: 88, ms_sweep: 96,
  ms_finish: 104,
};
export const jostle_images_view = { sizeof: 56, boxes: 0, origin: 40, shift: 44, originals: 48 };
export const jostle_neighbor_query = {
  sizeof: 144, struct_size: 0, points: 8, count: 16, others: 24, other_count: 32, offsets: 40,
  system_count: 48, cutoff: 56, radii: 64, radii_b: 68, types: 72, types_b: 76, table: 80, type_count: 88,
  cells: 96, repeats: 100, cell_count: 104, half: 112, shifts: 116, vectors: 120, distances: 124, skin: 128,
  greater: 136,
};
export const jostle_neighbor_list = {
  sizeof: 32, offsets: 0, neighbors: 4, count: 8, shifts: 16, vectors: 20, distances: 24, searched: 28,
};
export const jostle_asker = { sizeof: 12, category: 0, mask: 4, owner: 8 };
export const jostle_query_filter = {
  sizeof: 104, struct_size: 0, category: 8, mask: 32, owner: 56, asker: 80, exclude: 84, accept: 88,
  context: 92, count: 96,
};
export const jostle_index_stats = {
  sizeof: 72, struct_size: 0, objects: 8, pages: 16, leaves: 24, nodes: 32, depth: 40, bytes: 48, sorts: 56,
  splits: 64,
};
export const jostle_object_filter = { sizeof: 16, category: 0, mask: 4, owner: 8, is_static: 12 };
export const jostle_query_layer = { sizeof: 8, category: 0, mask: 4 };
export const jostle_world_options = {
  sizeof: 48, struct_size: 0, common: 8, margin: 16, accept: 24, context: 28, layers: 32, layer_count: 40,
};
export const jostle_object_options = {
  sizeof: 48, struct_size: 0, filter: 8, margin: 16, disabled: 24, user_data: 32, count: 40,
};
export const jostle_id_pair = { sizeof: 16, a: 0, b: 8 };
export const jostle_ended_pair = { sizeof: 24, a: 0, b: 8, reason: 16, reserved: 20 };
export const jostle_world_stats = {
  sizeof: 200, struct_size: 0, objects: 8, resting: 16, active: 24, disabled: 32, refused: 40, commands: 48,
  dropped: 56, changed: 64, woken: 72, settled: 80, candidates: 88, false_positives: 96, listed: 104,
  began: 112, persisted: 120, ended: 128, bytes_reserved: 136, us_total: 144, us_apply: 152, us_active: 160,
  us_resting: 168, us_events: 176, us_index: 184, contested: 192,
};
export const jostle_shape_info = {
  sizeof: 56, dim: 0, type: 4, radius: 8, size: 16, offset: 40, context: 48,
};
export const jostle_contact_point_2f = { sizeof: 24, from_a: 0, from_b: 8, depth: 16, feature: 20 };
export const jostle_contact_2f = {
  sizeof: 76, pair: 0, part_a: 8, part_b: 12, normal: 16, count: 24, point: 28,
};
export const jostle_contact_point_3f = { sizeof: 32, from_a: 0, from_b: 12, depth: 24, feature: 28 };
export const jostle_contact_3f = {
  sizeof: 160, pair: 0, part_a: 8, part_b: 12, normal: 16, count: 28, point: 32,
};
export const jostle_contact_point_2d = { sizeof: 48, from_a: 0, from_b: 16, depth: 32, feature: 40 };
export const jostle_contact_2d = {
  sizeof: 136, pair: 0, part_a: 8, part_b: 12, normal: 16, count: 32, point: 40,
};
export const jostle_contact_point_3d = { sizeof: 64, from_a: 0, from_b: 24, depth: 48, feature: 56 };
export const jostle_contact_3d = {
  sizeof: 304, pair: 0, part_a: 8, part_b: 12, normal: 16, count: 40, point: 48,
};
export const jostle_pair_test_input = {
  sizeof: 128, shape_a: 0, shape_b: 56, pose_a: 112, pose_b: 116, margin: 120,
};
export const jostle_point_contact_2f = {
  sizeof: 48, pair: 0, part_a: 8, part_b: 12, normal: 16, from_a: 24, from_b: 32, depth: 40, feature: 44,
};
export const jostle_point_contact_3f = {
  sizeof: 60, pair: 0, part_a: 8, part_b: 12, normal: 16, from_a: 28, from_b: 40, depth: 52, feature: 56,
};
export const jostle_point_contact_2d = {
  sizeof: 80, pair: 0, part_a: 8, part_b: 12, normal: 16, from_a: 32, from_b: 48, depth: 64, feature: 72,
};
export const jostle_point_contact_3d = {
  sizeof: 104, pair: 0, part_a: 8, part_b: 12, normal: 16, from_a: 40, from_b: 64, depth: 88, feature: 96,
};
export const jostle_cast_hit_2f = {
  sizeof: 28, fraction: 0, normal: 4, point: 12, part: 20, moving_part: 24,
};
export const jostle_cast_hit_3f = {
  sizeof: 36, fraction: 0, normal: 4, point: 16, part: 28, moving_part: 32,
};
export const jostle_cast_hit_2d = {
  sizeof: 48, fraction: 0, normal: 8, point: 24, part: 40, moving_part: 44,
};
export const jostle_cast_hit_3d = {
  sizeof: 64, fraction: 0, normal: 8, point: 32, part: 56, moving_part: 60,
};
export const jostle_surface_parts = {
  sizeof: 56, triangles: 0, triangle_count: 8, edges: 16, edge_count: 24, points: 32, point_count: 40,
  vertices: 48,
};
export const jostle_surface_options = {
  sizeof: 40, struct_size: 0, thickness: 8, rest: 12, bodies: 16, accept_vertex_triangle: 20,
  accept_edge_edge: 24, context: 28, tolerance: 32,
};
export const jostle_near_parts_3f = {
  sizeof: 56, a: 0, b: 4, vertices: 8, weights: 24, normal: 40, distance: 52,
};
export const jostle_near_parts_3d = {
  sizeof: 88, a: 0, b: 4, vertices: 8, weights: 24, normal: 56, distance: 80,
};
export const jostle_part_impact_3f = { sizeof: 28, a: 0, b: 4, vertices: 8, time: 24 };
export const jostle_part_impact_3d = { sizeof: 32, a: 0, b: 4, vertices: 8, time: 24 };
export const jostle_crossing = { sizeof: 8, edge: 0, triangle: 4 };
export const jostle_near_surface = { sizeof: 64, vertex_triangle: 0, edge_edge: 32 };
export const jostle_moving_surface = { sizeof: 72, vertex_triangle: 0, edge_edge: 32, safe_step: 64 };
export const jostle_process_options = { sizeof: 24, struct_size: 0, executor: 8, block_items: 16 };
export const jostle_work = { sizeof: 8, slot: 0, block: 4 };

export const jostle_status = {
  0: "ok", 1: "nan_coordinate", 2: "inverted_box", 3: "too_many_objects", 4: "size_mismatch",
  5: "invalid_argument", 6: "stale_id", 7: "bad_snapshot", 8: "file_error", 100: "out_of_memory",
  101: "bad_handle", 102: "callback_failed", 103: "internal_error",
};
export const jostle_end_reason = { 0: "moved_apart", 1: "removed", 2: "disabled", 3: "filtered" };
export const jostle_shape_type = {
  0: "sphere", 1: "capsule", 2: "box", 3: "convex", 4: "half_space", 5: "mesh", 6: "height_field",
  7: "compound", 8: "rounded_box", 9: "rounded_hull", 10: "cylinder", 11: "cone", 12: "ellipsoid",
  16: "first_custom",
};
export const jostle_query_kind = {
  1: "ray", 2: "sweep", 3: "box", 4: "sphere", 5: "frustum", 6: "nearest", 7: "nearest_to_box",
  8: "shape_sweep", 9: "posed_shape", 10: "nearest_to_shape",
};
