// SPDX-License-Identifier: MIT
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>

#include <cmath>

#include "query_parts.hpp"

namespace jostle_bench {
namespace {

/// A geometry that is its box.
class BoxGeometry final : public fcl::CollisionGeometryd
{
  public:
    BoxGeometry(const jostle::Vec3f& lo, const jostle::Vec3f& hi)
    {
        aabb_local.min_ = {lo[0], lo[1], lo[2]};
        aabb_local.max_ = {hi[0], hi[1], hi[2]};
    }
    void computeLocalAABB() override {}
};

/// FCL's DynamicAABBTreeCollisionManager<double>. A sphere is asked for by the box around it.
class Fcl final : public QueryPeer
{
  public:
    const char* name() const noexcept override { return "fcl"; }
    bool answers(QueryKind kind) const noexcept override
    {
        return kind == QueryKind::box || kind == QueryKind::sphere || kind == QueryKind::nearest;
    }
    void build(Boxes3 boxes) override
    {
        boxes_ = boxes;
        std::vector<fcl::CollisionObjectd*> pointers;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            objects_.push_back(object(boxes[i].lo, boxes[i].hi));
            objects_.back()->setUserData(reinterpret_cast<void*>(i));
            pointers.push_back(objects_.back().get());
        }
        manager_.registerObjects(pointers);
        manager_.setup();
    }
    void ask(QueryKind kind, const Queries& queries, std::size_t i, Findings& found) const override
    {
        if (kind == QueryKind::nearest) {
            const jostle::Nearest<3, float>& query = queries.nearest[i];
            NearestSoFar nearest(query);
            Call call{this, &queries, kind, i, &found, &nearest};
            manager_.distance(object(query.point, query.point).get(), &call, distance);
            nearest.give(found);
            return;
        }
        float lo[3], hi[3];
        for (int d = 0; d < 3; ++d) {
            const jostle::Sphere<3, float>* const sphere =
                kind == QueryKind::sphere ? &queries.spheres[i] : nullptr;
            lo[d] =
                sphere != nullptr ? sphere->center[d] - sphere->radius * 1.000001f : queries.boxes[i].lo[d];
            hi[d] =
                sphere != nullptr ? sphere->center[d] + sphere->radius * 1.000001f : queries.boxes[i].hi[d];
        }
        Call call{this, &queries, kind, i, &found, nullptr};
        manager_.collide(object(lo, hi).get(), &call, touch);
    }

  private:
    struct Call
    {
        const Fcl* self;
        const Queries* queries;
        QueryKind kind;
        std::size_t i;
        Findings* found;
        NearestSoFar* nearest;
    };
    static std::unique_ptr<fcl::CollisionObjectd> object(const jostle::Vec3f& lo, const jostle::Vec3f& hi)
    {
        auto made = std::make_unique<fcl::CollisionObjectd>(std::make_shared<BoxGeometry>(lo, hi));
        made->setUserData(reinterpret_cast<void*>(~std::uintptr_t{0}));
        made->computeAABB();
        return made;
    }
    static std::uint32_t number(const fcl::CollisionObjectd* a, const fcl::CollisionObjectd* b)
    {
        const auto first = reinterpret_cast<std::uintptr_t>(a->getUserData());
        const auto second = reinterpret_cast<std::uintptr_t>(b->getUserData());
        return static_cast<std::uint32_t>(std::min(first, second));
    }
    static bool touch(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data)
    {
        const Call& call = *static_cast<const Call*>(data);
        const std::uint32_t id = number(a, b);
        const jostle::Aabb3f& box = call.self->boxes_[id];
        const bool touches = call.kind == QueryKind::sphere
                                 ? jostle::overlaps(call.queries->spheres[call.i], box)
                                 : jostle::overlaps(call.queries->boxes[call.i], box);
        if (touches) call.found->add(id);
        return false;
    }
    static bool distance(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data, double& limit)
    {
        const Call& call = *static_cast<const Call*>(data);
        call.nearest->offer(
            jostle::squared_distance(call.queries->nearest[call.i].point, call.self->boxes_[number(a, b)]));
        limit = std::sqrt(static_cast<double>(call.nearest->limit())) * 1.000001;
        return false;
    }

    Boxes3 boxes_;
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
    fcl::DynamicAABBTreeCollisionManagerd manager_;
};

} // namespace

std::unique_ptr<QueryPeer> make_fcl_queries()
{
    return std::make_unique<Fcl>();
}

} // namespace jostle_bench
