// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>

#include "bench/distance_peers.hpp"
#include "bullet_shapes.hpp"

namespace jostle_bench {
namespace {

class BulletDistances final : public DistancePeer
{
  public:
    const char* name() const noexcept override { return "bullet"; }
    const char* how() const noexcept override
    {
        return "Bullet btGjkPairDetector with btGjkEpaPenetrationDepthSolver, without margins; with "
               "a mesh for each triangle that btBvhTriangleMeshShape finds near";
    }
    // Of two meshes GImpact takes triangles to touch that lie behind each other's planes: with gaps of 2 cm
    // between bodies of 1 m it found some that touch.
    bool has_touching(BodyKind a, BodyKind b) const noexcept override
    {
        return a != BodyKind::ellipsoid && b != BodyKind::ellipsoid &&
               (a != BodyKind::mesh || b != BodyKind::mesh);
    }
    bool has_distance(BodyKind a, BodyKind b, double farthest) const noexcept override
    {
        return has_depth(a, b) || (has_touching(a, b) && std::isfinite(farthest));
    }
    bool has_depth(BodyKind a, BodyKind b) const noexcept override
    {
        return has_touching(a, b) && a != BodyKind::mesh && b != BodyKind::mesh;
    }
    void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
               std::span<const jostle::Pose3d> poses) override
    {
        pairs_ = pairs;
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            const BodyShape& body = shapes[i];
            // Bodies that share their points share what is made of them.
            const bool again = i > 0 && !body.points.empty() && body.kind == shapes[i - 1].kind &&
                               body.points.data() == shapes[i - 1].points.data();
            btCollisionShape* shape = again ? objects_.back()->getCollisionShape() : nullptr;
            if (shape == nullptr) {
                shape = shapes_.make(body);
                // Of spheres and capsules the margin is the radius.
                if (body.kind != BodyKind::sphere && body.kind != BodyKind::capsule) shape->setMargin(0);
            }
            const auto& p = poses[i].position;
            const auto& q = poses[i].rotation;
            const auto number = [](double x) { return static_cast<btScalar>(x); };
            objects_.push_back(std::make_unique<btCollisionObject>());
            objects_.back()->setCollisionShape(shape);
            objects_.back()->setWorldTransform(
                btTransform(btQuaternion(number(q[0]), number(q[1]), number(q[2]), number(q[3])).normalized(),
                            btVector3(number(p[0]), number(p[1]), number(p[2]))));
        }
    }
    double distance(std::size_t pair, double farthest) override { return least(pair, farthest, false); }
    bool touching(std::size_t pair) override { return least(pair, 0, true) <= 0; }
    double depth(std::size_t pair) override { return std::max(0.0, -least(pair, 0, false)); }

  private:
    /// The triangles of a mesh, one by one, none of which matters that is further away than the best so far.
    struct Triangles final : btTriangleCallback
    {
        BulletDistances& self;
        const btConvexShape& shape;
        btTransform pose; // in the mesh's frame
        btVector3 lo, hi;
        double best;
        bool any_will_do;
        Triangles(BulletDistances& of, const btConvexShape& body, const btTransform& in_mesh, double farthest,
                  bool any)
            : self(of), shape(body), pose(in_mesh), best(farthest), any_will_do(any)
        {
            const auto reach = static_cast<btScalar>(farthest);
            shape.getAabb(pose, lo, hi);
            lo -= btVector3(reach, reach, reach);
            hi += btVector3(reach, reach, reach);
        }
        void processTriangle(btVector3* corners, int, int) override
        {
            if ((any_will_do && found) || !TestTriangleAgainstAabb2(corners, lo, hi)) return;
            btTriangleShape triangle(corners[0], corners[1], corners[2]);
            triangle.setMargin(0);
            const double gap = self.gap(shape, pose, triangle, btTransform::getIdentity(), best);
            found = found || gap <= 0;
            best = std::min(best, gap);
        }
        bool found = false;
    };

    [[nodiscard]] const btConvexShape* convex(std::uint32_t i) const
    {
        const btCollisionShape* const shape = objects_[i]->getCollisionShape();
        return shape->isConvex() ? static_cast<const btConvexShape*>(shape) : nullptr;
    }
    double least(std::size_t pair, double farthest, bool any_will_do)
    {
        auto [a, b] = pairs_[pair];
        if (convex(a) == nullptr) std::swap(a, b);
        const btTransform &pose_a = objects_[a]->getWorldTransform(),
                          &pose_b = objects_[b]->getWorldTransform();
        if (convex(b) != nullptr) return gap(*convex(a), pose_a, *convex(b), pose_b, any_will_do ? 0 : open);
        Triangles triangles(*this, *convex(a), pose_b.inverseTimes(pose_a), farthest, any_will_do);
        static_cast<const btBvhTriangleMeshShape*>(objects_[b]->getCollisionShape())
            ->processAllTriangles(&triangles, triangles.lo, triangles.hi);
        return any_will_do && !triangles.found ? open : triangles.best;
    }
    double gap(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
               const btTransform& pose_b, double farthest)
    {
        btGjkPairDetector detector(&a, &b, &simplex_, &deep_);
        btGjkPairDetector::ClosestPointInput input;
        input.m_transformA = pose_a;
        input.m_transformB = pose_b;
        if (std::isfinite(farthest)) {
            const auto reach = static_cast<btScalar>(std::max(farthest, 0.0)) + a.getMargin() + b.getMargin();
            input.m_maximumDistanceSquared = reach * reach;
        }
        btPointCollector nearest;
        detector.getClosestPoints(input, nearest, nullptr);
        return nearest.m_hasResult ? double{nearest.m_distance} : open;
    }

    std::span<const jostle::Pair> pairs_;
    BulletShapes shapes_;
    std::vector<std::unique_ptr<btCollisionObject>> objects_;
    btVoronoiSimplexSolver simplex_;
    btGjkEpaPenetrationDepthSolver deep_;
};

} // namespace

std::unique_ptr<DistancePeer> make_bullet_distances()
{
    return std::make_unique<BulletDistances>();
}

} // namespace jostle_bench
