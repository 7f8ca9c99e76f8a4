// SPDX-License-Identifier: MIT
#pragma once

/// Includes all of Jostle except chapter.hpp, which has the algorithms of the thesis chapter that it grew out
/// of. Each header can also be included on its own.
///
/// | header            | what it is for                                                     | stable |
/// | ----------------- | ------------------------------------------------------------------ | ------ |
/// | find_pairs.hpp    | all pairs of touching boxes, of one set or of two                  | yes    |
/// | spatial_order.hpp | sorts arrays so that neighbours in space are neighbours in memory  | mostly |
/// | periodic.hpp      | images of boxes, for pairs across the borders of periodic space    | mostly |
/// | neighbors.hpp     | neighbor lists: points within a cutoff, in periodic cells          | mostly |
/// | world.hpp         | objects that come, move, rest and go, with begin and end events    | yes    |
/// | pair_slots.hpp    | numbers for pairs, to index your own arrays                        | mostly |
/// | query.hpp         | the queries: rays, sweeps, overlaps, nearest, frustums             | yes    |
/// | queries.hpp       | any, count, first, nearest, all, visit: the verbs of every query   | yes    |
/// | box_index.hpp     | queries about boxes that seldom change                             | yes    |
/// | shapes.hpp        | spheres, capsules, boxes, hulls, meshes, height fields, your own   | mostly |
/// | objects.hpp       | shapes and poses of many objects, their boxes, and moving objects  | mostly |
/// | cast.hpp          | rays and moving shapes against shapes                              | mostly |
/// | closed_mesh.hpp   | which points are inside a mesh, and how far from its surface       | mostly |
/// | contact.hpp       | contacts, distances and times of impact of shapes                  | mostly |
/// | surface.hpp       | cloth and soft bodies: self-collision, impacts that are never late | mostly |
/// | shape_query.hpp   | the same verbs for the shapes of a world or index                  | mostly |
/// | process.hpp       | work on pairs, balanced over the cores                             | yes    |
/// | responses.hpp     | results per object, added up by all cores without locks            | yes    |
/// | box.hpp, vec.hpp, pose.hpp | boxes, views of boxes in your own memory, vectors, poses  | yes    |
/// | pair_buffer.hpp, block_buffer.hpp, stats.hpp | results of a search                     | yes    |
/// | recorder.hpp      | your boxes written to a file, for `jostle compare`                 | yes    |
/// | error.hpp         | the exception type thrown for invalid input                        | yes    |
/// | executor.hpp      | the threads that Jostle runs on                                    | yes    |
/// | function_ref.hpp  | references to callbacks                                            | yes    |
/// | version.hpp       | the version, and macros that the headers use                       | yes    |
///
/// Stable: programs that use it will compile with 1.0. "Mostly": nothing will be removed, but shapes and
/// results may gain members. Namespaces called `detail` are private. Before 1.0 the binary interface changes
/// with every minor version.
#include "jostle/box.hpp"
#include "jostle/box_index.hpp"
#include "jostle/cast.hpp"
#include "jostle/closed_mesh.hpp"
#include "jostle/contact.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/neighbors.hpp"
#include "jostle/objects.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/pair_slots.hpp"
#include "jostle/periodic.hpp"
#include "jostle/pose.hpp"
#include "jostle/process.hpp"
#include "jostle/queries.hpp"
#include "jostle/query.hpp"
#include "jostle/recorder.hpp"
#include "jostle/responses.hpp"
#include "jostle/shape_query.hpp"
#include "jostle/shapes.hpp"
#include "jostle/spatial_order.hpp"
#include "jostle/stats.hpp"
#include "jostle/surface.hpp"
#include "jostle/vec.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"
