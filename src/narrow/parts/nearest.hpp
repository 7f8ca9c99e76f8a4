// SPDX-License-Identifier: MIT
// Contacts, gaps, touching and impacts of two shapes, at least one of them a mesh: a search in the meshes'
// trees, nearest first, with a bound that shrinks as parts are found. Nothing is allocated, except for
// contacts if more than `most_near` pairs of parts are near.
// Source: Larsen, Gottschalk, Lin, Manocha, Fast Distance Queries with Rectangular Swept Sphere Volumes, ICRA
// 2000.
#pragma once

#include "jostle/function_ref.hpp"
#include "narrow/parts/pair.hpp"
#include "narrow/parts/part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Whether this search applies. Height fields are solid ground, which boxes around triangles don't contain.
template <int Dim>
bool has_mesh_tree(const Placed<Dim>& pair)
{
    if (Dim == 2) return false;
    const ShapeType a = pair.a->type(), b = pair.b->type();
    return (a == ShapeTypes::mesh || b == ShapeTypes::mesh) && a != ShapeTypes::height_field &&
           b != ShapeTypes::height_field;
}

/// With the numbers of both.
using VisitPartPair = void(std::uint32_t, const Part<3>&, std::uint32_t, const Part<3>&);

inline constexpr std::size_t most_near = 1024;
/// Visits the pairs of parts within `margin` of each other, and maybe others that nearly are. Those of a mesh
/// and one part, or of two meshes, come in ascending order of numbers.
void for_each_near(const Placed<3>& pair, double margin, FunctionRef<VisitPartPair> visit);
/// Like find_gap. Of equally near parts, those with the lowest numbers count: first by part_a.
void nearest_parts(const Placed<3>& pair, double enough, Gap<3>& best);
/// Like find_touch.
bool any_parts_touch(const Placed<3>& pair);
/// Visits pairs of parts until all others certainly stay further apart than half the tolerance for
/// `range.time` from now on. The visits may shorten that time.
void for_each_approaching(const Placed<3>& pair, const Flight<3>& flight, const Range<3>& range,
                          FunctionRef<VisitPartPair> visit);

} // namespace narrow
JOSTLE_NAMESPACE_END
