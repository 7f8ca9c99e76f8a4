// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "bench/contact_peers.hpp"
#include "jostle/shapes.hpp"
#include "tool/scenes/random.hpp"

/// What `jostle bench contacts`, `distances` and `plane` make bodies of.

namespace jostle_tool {

class RandomBodies : public jostle_scenes::Random
{
  public:
    using Random::Random;
    jostle::Vec<3, double> in_ball()
    {
        for (;;) {
            const jostle::Vec<3, double> p{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
            const double size = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
            if (size <= 1 && size > 1e-4) return p;
        }
    }
    jostle::Vec<3, double> direction()
    {
        const double y = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - y * y);
        return {r * std::cos(angle), y, r * std::sin(angle)};
    }
    template <class T>
    std::array<T, 4> rotation()
    {
        std::array<T, 4> q{};
        double size = 0;
        while (size < 0.01 || size > 1) {
            size = 0;
            for (T& x : q)
                x = static_cast<T>(uniform(-1, 1)), size += double{x} * x;
        }
        for (T& x : q)
            x = static_cast<T>(x / std::sqrt(size));
        return q;
    }
};

/// A body that its numbers say all of: no hull and no mesh.
inline jostle::Shape3 shape_of(const jostle_bench::BodyShape& body)
{
    using jostle::Shape3, jostle_bench::BodyKind;
    switch (body.kind) {
    case BodyKind::sphere:
        return Shape3::sphere(body.radius);
    case BodyKind::capsule:
        return Shape3::capsule(body.half_length, body.radius);
    case BodyKind::cylinder:
        return Shape3::cylinder(body.half_length, body.radius);
    case BodyKind::cone:
        return Shape3::cone(body.half_length, body.radius);
    case BodyKind::box:
        return Shape3::box(body.half);
    case BodyKind::ellipsoid:
        return Shape3::ellipsoid(body.half);
    default:
        return {};
    }
}

/// A closed surface of 4 rings^2 triangles: place(i, j) is the point of ring i, from pole to pole, in sector
/// j of 2 rings.
template <class Place>
void close_surface(std::uint32_t rings, const Place& place, std::vector<jostle::Vec<3, double>>& points,
                   std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    const std::uint32_t sectors = 2 * rings;
    for (std::uint32_t i = 0; i <= rings; ++i)
        for (std::uint32_t j = 0; j < sectors; ++j) {
            points.push_back(place(i, j));
            if (i == rings) continue;
            const std::uint32_t k = (j + 1) % sectors, at = i * sectors, below = at + sectors;
            triangles.push_back({at + j, below + j, below + k});
            triangles.push_back({at + j, below + k, at + k});
        }
}

/// The surface of a hull, for systems that take it as triangles of its vertices().
inline std::vector<std::array<std::uint32_t, 3>> triangles_of(const jostle::ConvexHull<3>& hull)
{
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::size_t f = 0; f < hull.face_count(); ++f) {
        const auto face = hull.face(f);
        for (std::size_t i = 2; i < face.size(); ++i)
            triangles.push_back({face[0], face[i - 1], face[i]});
    }
    return triangles;
}

} // namespace jostle_tool
