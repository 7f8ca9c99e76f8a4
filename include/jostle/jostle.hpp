// SPDX-License-Identifier: MIT
#pragma once

/// All of Jostle but chapter.hpp: the algorithms of the thesis chapter that it grew from, for study.
/// Each header can be included on its own, and brings what it needs.
///
/// | header                | what it is for                                                      | settled |
/// |-----------------------|---------------------------------------------------------------------|---------|
/// | find_pairs.hpp        | all pairs of touching boxes, of one set or of two                   | yes     |
/// | spatial_order.hpp     | neighbours in space made neighbours in memory                       | mostly  |
/// | periodic.hpp          | images, for pairs across the borders of periodic space              | mostly  |
/// | neighbors.hpp         | neighbor lists: points within a cutoff, in periodic cells           | mostly  |
/// | world.hpp             | objects that come, move, rest and go; begin and end events          | yes     |
/// | pair_slots.hpp        | numbers for pairs, to index arrays of your own                      | mostly  |
/// | query.hpp             | rays, sweeps, overlaps, nearest, views: what can be asked           | yes     |
/// | queries.hpp           | any, count, first, nearest, all, visit: the verbs of all queries    | yes     |
/// | box_index.hpp         | boxes that seldom change, and queries about them                    | yes     |
/// | shapes.hpp            | spheres, capsules, boxes, hulls, meshes, height fields, your own    | mostly  |
/// | objects.hpp           | shapes and poses of many objects, their boxes, and objects that move | mostly  |
/// | cast.hpp              | rays, and shapes that move, against shapes                          | mostly  |
/// | closed_mesh.hpp       | which points are inside of a mesh, and how far from its surface      | mostly  |
/// | contact.hpp           | contacts, distances and times of impact of shapes                   | mostly  |
/// | surface.hpp           | cloth and soft bodies: self-collision, impacts that are never late  | mostly  |
/// | shape_query.hpp       | the same verbs about the shapes of a world or index                 | mostly  |
/// | process.hpp           | work on pairs, balanced over the cores                              | yes     |
/// | responses.hpp         | results per object, added up by all cores without locks             | yes     |
/// | box.hpp, vec.hpp, pose.hpp | boxes, views of boxes in your own memory, vectors, poses       | yes     |
/// | pair_buffer.hpp, block_buffer.hpp, stats.hpp | what a search hands back                     | yes     |
/// | recorder.hpp          | your boxes written to a file, for `jostle compare`                  | yes     |
/// | error.hpp             | what bad data is answered with                                      | yes     |
/// | executor.hpp          | the threads that Jostle runs on                                     | yes     |
/// | function_ref.hpp      | references to callbacks                                             | yes     |
/// | version.hpp           | the version, and macros of the headers' own                         | yes     |
///
/// Settled: programs that use it will compile with 1.0. "Mostly": what is there stays; shapes and results may
/// gain members. Names in a namespace `detail` are nobody's to use. Before 1.0 the binary interface changes
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
