// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "narrow/convex/core3.hpp"
#include "tests/narrow/random_pairs.hpp"

// What tests of smooth shapes know of them from their definitions.

namespace narrow_samples {

using namespace jostle;
using narrow::Vec3;

/// How far a shape reaches along a unit direction in its own axes, written from what it is.
inline double reach_of(const Shape3& shape, const Vec3& d)
{
    const auto size = shape.size();
    const double across = std::sqrt(d.x * d.x + d.z * d.z);
    switch (shape.type()) {
    case ShapeTypes::sphere:
        return shape.radius();
    case ShapeTypes::capsule:
        return size[1] * std::abs(d.y) + shape.radius();
    case ShapeTypes::box:
    case ShapeTypes::rounded_box:
        return size[0] * std::abs(d.x) + size[1] * std::abs(d.y) + size[2] * std::abs(d.z) + shape.radius();
    case ShapeTypes::cylinder:
        return size[1] * std::abs(d.y) + size[0] * across;
    case ShapeTypes::cone:
        return std::max(size[1] * d.y, size[0] * across - size[1] * d.y);
    case ShapeTypes::ellipsoid:
        return std::sqrt(size[0] * size[0] * d.x * d.x + size[1] * size[1] * d.y * d.y +
                         size[2] * size[2] * d.z * d.z);
    case ShapeTypes::convex: {
        const auto& hull = narrow::ShapeAccess::data<narrow::HullData<3>>(shape).polytope;
        double most = -HUGE_VAL;
        for (std::uint32_t i = 0; i < hull.vertices; ++i)
            most = std::max(most, dot(d, hull.vertex(i)));
        return most;
    }
    default:
        ADD_FAILURE();
        return 0;
    }
}

/// By how much unit direction n parts two shapes, or minus how much they overlap along it.
inline double parted_by(const Vec3& n, const Shape3& a, const Pose3d& pose_a, const Shape3& b,
                        const Pose3d& pose_b)
{
    const Vec3 d = narrow::load(pose_b.position) - narrow::load(pose_a.position);
    return dot(n, d) - reach_of(a, narrow::rotation(pose_a).back(n)) -
           reach_of(b, narrow::rotation(pose_b).back(-n));
}

/// A cylinder, cone or ellipsoid of which only the support function is known.
class Disguised final : public CustomShape<3>
{
  public:
    explicit Disguised(const Shape3& shape) : type_(shape.type()), size_(shape.size()) {}
    double radius() const noexcept override { return size_[0] + size_[1] + size_[2]; }
    Vec3d support(const Vec3d& d) const noexcept override
    {
        const double r = size_[0], h = size_[1], k = size_[2];
        if (type_ == ShapeTypes::ellipsoid) {
            const double scale = 1 / std::hypot(r * d[0], h * d[1], k * d[2]);
            return {r * r * d[0] * scale, h * h * d[1] * scale, k * k * d[2] * scale};
        }
        const double across = std::hypot(d[0], d[2]), scale = across > 0 ? r / across : 0;
        if (type_ == ShapeTypes::cone && 2 * h * d[1] > r * across) return {0, h, 0};
        const bool up = type_ == ShapeTypes::cylinder && d[1] >= 0;
        return {d[0] * scale, up ? h : -h, d[2] * scale};
    }

  private:
    ShapeType type_;
    Vec3d size_;
};

} // namespace narrow_samples
