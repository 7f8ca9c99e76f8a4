// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/narrow/random_pairs.hpp"

// Ground, bodies and users' shapes that several tests use.

namespace narrow_samples {

using namespace jostle;

/// Bumpy ground, as a mesh and as a height field.
struct Terrain
{
    std::vector<Vec<3, double>> vertices;
    std::vector<Mesh<3>::Element> triangles;
    std::vector<double> heights;
    std::uint32_t columns, rows;

    Terrain(std::uint32_t x, std::uint32_t z, double bumps) : columns(x), rows(z)
    {
        Random random(7);
        for (std::uint32_t k = 0; k < z; ++k)
            for (std::uint32_t i = 0; i < x; ++i) {
                heights.push_back(random.uniform(-bumps, bumps));
                vertices.push_back({i * 1.0, heights.back(), k * 1.0});
            }
        for (std::uint32_t k = 0; k + 1 < z; ++k)
            for (std::uint32_t i = 0; i + 1 < x; ++i) { // as a height field's cells
                const std::uint32_t at = k * x + i;
                triangles.push_back({at, at + x + 1, at + 1});
                triangles.push_back({at, at + x, at + x + 1});
            }
    }
};

/// One body of each kind of shape that the fast ways know.
inline std::vector<Shape3> movers()
{
    static const ConvexHull<3> hull(std::vector<Vec<3, double>>{
        {0.4, 0, 0}, {-0.4, 0, 0}, {0, 0.4, 0}, {0, -0.4, 0}, {0, 0, 0.4}, {0, 0, -0.4}, {0.3, 0.3, 0.3}});
    return {Shape3::sphere(0.3), Shape3::capsule(0.3, 0.2), Shape3::box({0.3, 0.2, 0.4}), hull};
}

/// A ball, as a user would write one.
class Ball final : public CustomShape<3>
{
  public:
    explicit Ball(double radius) : radius_(radius) {}
    double radius() const noexcept override { return radius_; }
    Vec<3, double> support(const Vec<3, double>& d) const noexcept override
    {
        const double size = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        return {d[0] * radius_ / size, d[1] * radius_ / size, d[2] * radius_ / size};
    }

  private:
    double radius_;
};
/// The same in the plane.
class Disc final : public CustomShape<2>
{
  public:
    double radius() const noexcept override { return 0.5; }
    Vec<2, double> support(const Vec<2, double>& d) const noexcept override
    {
        const double size = std::sqrt(d[0] * d[0] + d[1] * d[1]);
        return {d[0] * 0.5 / size, d[1] * 0.5 / size};
    }
};

} // namespace narrow_samples
