// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

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
