// SPDX-License-Identifier: MIT
// On which side of a line or plane a point is, exactly.
//
// Coordinates are multiples of 2^-201 below 2^60, so that no product of three differences loses a bit.
#pragma once

#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The relative error of a determinant of three differences, computed by cross and dot products, with respect
/// to the sum of its products' sizes: eight roundings of 2^-53 each, plus the error of that sum itself.
inline constexpr double determinant_rounding = 10 * 0x1p-53;

/// Above 0 where d is above the triangle a b c, seen from where that runs counterclockwise; 0 in its plane.
int side_of_plane(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Above 0 where c is left of the line from a to b; 0 on it.
int side_of_line(const Vec2& a, const Vec2& b, const Vec2& c);

/// The cross product of b - a and c - a, each coordinate right to its last bits: 0 only where a, b, c are in
/// one line.
Vec3 exact_cross(const Vec3& a, const Vec3& b, const Vec3& c);

} // namespace narrow
JOSTLE_NAMESPACE_END
