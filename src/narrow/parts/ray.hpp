// SPDX-License-Identifier: MIT
// Rays against shapes: closed forms in a shape's local axes, and trees for shapes with parts.
#pragma once

#include "narrow/kernels/kernels.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The points origin + t * way for 0 <= t <= most.
template <int Dim>
struct Line
{
    V<Dim> origin, way; ///< way is unit
    double most;        ///< may be infinite
};
/// Where a line first hits a shape.
template <int Dim>
struct Strike
{
    double at = HUGE_VAL; ///< infinite: nowhere
    V<Dim> normal;        ///< unit, never along the line
    std::uint32_t part = 0;
};

/// The line is relative to the shape's position.
template <int Dim>
Strike<Dim> find_strike(const Shape<Dim>& shape, const M<Dim>& turn, const Line<Dim>& line,
                        const Kernels& kernels);

} // namespace narrow
JOSTLE_NAMESPACE_END
