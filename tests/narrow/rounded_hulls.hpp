// SPDX-License-Identifier: MIT
#pragma once

#include "narrow/math.hpp"
#include "tests/narrow/oracle.hpp"
#include "tests/narrow/random_pairs.hpp"

/// Convex shapes of which the definition is known to the oracle.
namespace rounded_hulls {

using namespace jostle;

/// A shape, and the points and radius that it is the rounded hull of.
struct Sample
{
    Shape3 shape;
    std::vector<narrow::Vec3> points;
    double radius = 0;
    std::unique_ptr<ConvexHull<3>> hull;
};

inline Sample make_sample(std::uint32_t kind, Random& random)
{
    Sample s;
    switch (kind) {
    case 0:
        s.radius = random.chance(0.2) ? 0 : random.uniform(0.1, 1);
        s.shape = Shape3::sphere(s.radius);
        s.points = {{}};
        break;
    case 1: {
        s.radius = random.chance(0.2) ? 0 : random.uniform(0.1, 1);
        const double half = random.chance(0.1) ? 0 : random.uniform(0.1, 1.5);
        s.shape = Shape3::capsule(half, s.radius);
        s.points = {{0, -half, 0}, {0, half, 0}};
        break;
    }
    case 2: {
        Vec<3, double> half;
        for (double& h : half)
            h = random.chance(0.1) ? 0 : random.chance(0.3) ? 1 : random.uniform(0.1, 1.5);
        s.shape = Shape3::box(half);
        for (int i = 0; i < 8; ++i)
            s.points.push_back(
                {i & 1 ? half[0] : -half[0], i & 2 ? half[1] : -half[1], i & 4 ? half[2] : -half[2]});
        break;
    }
    case 4: {
        Vec<3, double> half;
        for (double& h : half)
            h = random.chance(0.1) ? 0 : random.chance(0.3) ? 1 : random.uniform(0.1, 1.5);
        s.radius = random.chance(0.2) ? 0 : random.uniform(0.1, 1);
        s.shape = Shape3::rounded_box(half, s.radius);
        for (int i = 0; i < 8; ++i)
            s.points.push_back(
                {i & 1 ? half[0] : -half[0], i & 2 ? half[1] : -half[1], i & 4 ? half[2] : -half[2]});
        break;
    }
    default: {
        std::vector<Vec<3, double>> points;
        const std::uint32_t count = 1 + random.below(8), flat = random.below(8);
        for (std::uint32_t i = 0; i < count; ++i) {
            Vec<3, double> p;
            for (double& x : p)
                x = random.chance(0.3) ? std::round(random.uniform(-1, 1)) : random.uniform(-1, 1);
            if (flat == 0) p[1] = 0.25;
            if (flat == 1) p[0] = p[1] = 0.5;
            points.push_back(p);
            s.points.push_back({p[0], p[1], p[2]});
        }
        s.hull = std::make_unique<ConvexHull<3>>(points);
        s.shape = *s.hull;
        if (kind == 5) {
            s.radius = random.chance(0.2) ? 0 : random.uniform(0.1, 1);
            s.shape = Shape3::rounded_hull(*s.hull, s.radius);
        }
        break;
    }
    }
    return s;
}

inline std::vector<narrow::Vec3> placed(const Sample& s, const Pose3d& pose)
{
    const narrow::Mat3 r = narrow::rotation(pose);
    std::vector<narrow::Vec3> points;
    for (const narrow::Vec3& p : s.points)
        points.push_back(r * p + narrow::load(pose.position));
    return points;
}

} // namespace rounded_hulls
