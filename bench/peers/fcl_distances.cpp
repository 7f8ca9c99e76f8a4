// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <exception>

#include <fcl/narrowphase/distance.h>

#include "bench/distance_peers.hpp"
#include "fcl_shapes.hpp"

namespace jostle_bench {
namespace {

class FclDistances final : public DistancePeer
{
  public:
    const char* name() const noexcept override { return "fcl"; }
    const char* how() const noexcept override
    {
        return "FCL 0.7 distance<double> with points, and collide<double> for touching and, with contacts, "
               "depth; for distances its own solver for simple shapes, libccd for hulls and meshes; else "
               "libccd: each is the faster one there; for the least depth distance<double> with signed "
               "distances, to 1e-6";
    }
    bool has_touching(BodyKind, BodyKind) const noexcept override { return true; }
    bool has_distance(BodyKind, BodyKind, double) const noexcept override { return true; }
    bool has_depth(BodyKind, BodyKind) const noexcept override { return true; }
    void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
               std::span<const jostle::Pose3d> poses) override
    {
        pairs_ = pairs;
        geometry_.clear();
        transform_.clear();
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            // Bodies that share their points share what is made of them.
            const bool again = i > 0 && !shapes[i].points.empty() && same(shapes[i], shapes[i - 1]);
            geometry_.push_back(again ? geometry_.back() : fcl_shape(shapes[i]));
            const auto& q = poses[i].rotation;
            fcl::Transform3d transform = fcl::Transform3d::Identity();
            transform.linear() =
                fcl_turn(shapes[i].kind, fcl::Quaterniond(q[3], q[0], q[1], q[2]).normalized())
                    .toRotationMatrix();
            for (int d = 0; d < 3; ++d)
                transform.translation()[d] = poses[i].position[static_cast<std::size_t>(d)];
            transform_.push_back(transform);
            meshes_ = meshes_ || shapes[i].kind == BodyKind::mesh;
            libccd_ = libccd_ || shapes[i].kind == BodyKind::hull || shapes[i].kind == BodyKind::mesh;
        }
    }
    double distance(std::size_t pair, double) override
    {
        const auto [a, b] = pairs_[pair];
        fcl::DistanceRequestd request(true);
        request.gjk_solver_type = libccd_ ? fcl::GST_LIBCCD : fcl::GST_INDEP;
        fcl::DistanceResultd result;
        fcl::distance(geometry_[a].get(), transform_[a], geometry_[b].get(), transform_[b], request, result);
        return result.min_distance;
    }
    bool touching(std::size_t pair) override
    {
        const auto [a, b] = pairs_[pair];
        const fcl::CollisionRequestd request;
        fcl::CollisionResultd result;
        fcl::collide(geometry_[a].get(), transform_[a], geometry_[b].get(), transform_[b], request, result);
        return result.isCollision();
    }
    double depth(std::size_t pair) override
    {
        const auto [a, b] = pairs_[pair];
        fcl::CollisionRequestd request(meshes_ ? 1'000'000 : 1, true);
        request.gjk_solver_type = fcl::GST_LIBCCD;
        fcl::CollisionResultd result;
        fcl::collide(geometry_[a].get(), transform_[a], geometry_[b].get(), transform_[b], request, result);
        double deepest = 0;
        for (std::size_t i = 0; i < result.numContacts(); ++i)
            deepest = std::max(deepest, std::abs(result.getContact(i).penetration_depth)); // of either sign
        return deepest;
    }
    bool has_least_depth(BodyKind a, BodyKind b) const noexcept override
    {
        return a != BodyKind::mesh && b != BodyKind::mesh;
    }
    double least_depth(std::size_t pair) override
    {
        const auto [a, b] = pairs_[pair];
        fcl::DistanceRequestd request(true, true);
        request.gjk_solver_type = fcl::GST_LIBCCD; // its own solver has no signed distances
        fcl::DistanceResultd result;
        try {
            fcl::distance(geometry_[a].get(), transform_[a], geometry_[b].get(), transform_[b], request,
                          result);
        } catch (const std::exception&) { // a polytope that it can't expand
            return 0;
        }
        return std::max(0.0, -result.min_distance);
    }

  private:
    static bool same(const BodyShape& one, const BodyShape& other)
    {
        return one.kind == other.kind && one.points.data() == other.points.data();
    }

    std::span<const jostle::Pair> pairs_;
    std::vector<std::shared_ptr<fcl::CollisionGeometryd>> geometry_;
    std::vector<fcl::Transform3d> transform_;
    bool libccd_ = false, meshes_ = false;
};

} // namespace

std::unique_ptr<DistancePeer> make_fcl_distances()
{
    return std::make_unique<FclDistances>();
}

} // namespace jostle_bench
