// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "jostle/shapes.hpp"

namespace jostle_simulation {

/// Three numbers to calculate with; 12 bytes.
struct Vec3
{
    float x = 0, y = 0, z = 0;
};
inline Vec3 operator+(Vec3 a, Vec3 b)
{
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b)
{
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator*(float s, Vec3 a)
{
    return {s * a.x, s * a.y, s * a.z};
}
inline float dot(Vec3 a, Vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// What changes when bodies touch, and what resists it.
struct Body
{
    Vec3 linear;
    float inverse_mass; ///< 0: never moves
    Vec3 angular;
    float inverse_inertia; ///< about any axis
};

/// The first frame. Bodies that move come first, floor and walls after them.
struct World
{
    std::vector<jostle::Shape3> shapes;
    std::vector<jostle::Pose3f> poses;
    std::vector<Body> bodies;
    std::uint32_t moving = 0;
    std::uint32_t most_points = 4; ///< of a contact
    Vec3 gravity;
    std::vector<jostle::ConvexHull<3>> hulls; ///< what shapes point to
};

[[nodiscard]] World make_world(std::string_view scene, std::uint32_t bodies, std::uint64_t seed);

} // namespace jostle_simulation
