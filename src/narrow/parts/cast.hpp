// SPDX-License-Identifier: MIT
// A shape that moves without rotating, against another one. The distance of two convex parts is a convex
// function of the displacement, so Newton's steps along it never go too far.
// Source: van den Bergen, Ray Casting against General Convex Objects with Application to Continuous Collision
// Detection (2004).
#pragma once

#include "narrow/parts/pair.hpp"
#include "narrow/parts/part.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The first touch of a moving pair.
template <int Dim>
struct Touch
{
    double time = HUGE_VAL; ///< in [0, 1]; infinite if there is none
    V<Dim> normal;          ///< out of a, against b's motion
    V<Dim> on_a;            ///< from a's position
    std::uint32_t part_a = 0, part_b = 0;
};

/// At time t in [0, 1] b is at pair.d + t * linear from a. The pair isn't arranged: b is the one that moves.
template <int Dim>
Touch<Dim> find_first_touch(const Placed<Dim>& pair, const V<Dim>& linear);

} // namespace narrow
JOSTLE_NAMESPACE_END
