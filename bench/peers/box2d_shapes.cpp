// SPDX-License-Identifier: MIT
#include <algorithm>
#include <vector>

#include <box2d/b2_circle_shape.h>
#include <box2d/b2_collision.h>
#include <box2d/b2_distance.h>
#include <box2d/b2_edge_shape.h>
#include <box2d/b2_polygon_shape.h>

#include "bench/plane_peers.hpp"

namespace jostle_bench {
namespace {

using Kind = PlaneShape::Kind;

/// A capsule is an edge with a radius. Polygons have no skin.
class Box2dShape
{
  public:
    void set(const PlaneShape& shape)
    {
        const auto radius = static_cast<float>(shape.radius), half = static_cast<float>(shape.half_length);
        if (shape.kind == Kind::circle) {
            circle.m_radius = radius;
            any = &circle;
        } else if (shape.kind == Kind::capsule) {
            edge_.SetTwoSided({0, -half}, {0, half});
            edge_.m_radius = radius;
            any = &edge_;
        } else {
            std::vector<b2Vec2> corners;
            for (const auto& p : shape.corners)
                corners.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]));
            polygon.Set(corners.data(), static_cast<int32>(corners.size()));
            polygon.m_radius = 0;
            any = &polygon;
        }
    }
    b2CircleShape circle;
    b2PolygonShape polygon;
    const b2Shape* any = nullptr;

  private:
    b2EdgeShape edge_;
};

class Box2dShapes final : public PlanePeer
{
  public:
    const char* name() const noexcept override { return "box2d"; }
    const char* how() const noexcept override
    {
        return "Box2D 2.4: b2Distance without a cache, b2TestOverlap, b2CollideCircles, b2CollidePolygons; "
               "float";
    }
    bool has_distance(const PlaneShape& a, const PlaneShape& b) const noexcept override
    {
        const auto has = [](const PlaneShape& shape) {
            return shape.kind != Kind::ellipse && shape.corners.size() <= std::size_t{b2_maxPolygonVertices};
        };
        return has(a) && has(b);
    }
    bool has_contacts(const PlaneShape& a, const PlaneShape& b) const noexcept override
    {
        return has_distance(a, b) && a.kind == b.kind && a.kind != Kind::capsule;
    }
    void start(const PlaneShape& a, const PlaneShape& b, std::span<const jostle::Pose2d> poses_a,
               std::span<const jostle::Pose2d> poses_b) override
    {
        a_.set(a);
        b_.set(b);
        are_circles_ = a.kind == Kind::circle;
        const auto convert = [](std::span<const jostle::Pose2d> poses, std::vector<b2Transform>& out) {
            out.clear();
            for (const jostle::Pose2d& pose : poses) {
                b2Transform& transform = out.emplace_back();
                transform.p.Set(static_cast<float>(pose.position[0]), static_cast<float>(pose.position[1]));
                transform.q.c = static_cast<float>(pose.rotation[0]);
                transform.q.s = static_cast<float>(pose.rotation[1]);
            }
        };
        convert(poses_a, poses_a_);
        convert(poses_b, poses_b_);
    }
    double distance(std::size_t pair) override
    {
        b2DistanceInput input;
        input.proxyA.Set(a_.any, 0);
        input.proxyB.Set(b_.any, 0);
        input.transformA = poses_a_[pair];
        input.transformB = poses_b_[pair];
        input.useRadii = true;
        b2SimplexCache cache;
        cache.count = 0;
        b2DistanceOutput output;
        b2Distance(&output, &cache, &input);
        return double{output.distance};
    }
    bool touching(std::size_t pair) override
    {
        return b2TestOverlap(a_.any, 0, b_.any, 0, poses_a_[pair], poses_b_[pair]);
    }
    std::uint32_t contact_points(std::size_t pair) override
    {
        b2Manifold manifold;
        manifold.pointCount = 0;
        if (are_circles_)
            b2CollideCircles(&manifold, &a_.circle, poses_a_[pair], &b_.circle, poses_b_[pair]);
        else
            b2CollidePolygons(&manifold, &a_.polygon, poses_a_[pair], &b_.polygon, poses_b_[pair]);
        return static_cast<std::uint32_t>(manifold.pointCount);
    }

  private:
    Box2dShape a_, b_;
    bool are_circles_ = false;
    std::vector<b2Transform> poses_a_, poses_b_;
};

} // namespace

std::unique_ptr<PlanePeer> make_box2d_shapes()
{
    return std::make_unique<Box2dShapes>();
}

} // namespace jostle_bench
