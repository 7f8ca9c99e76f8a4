// SPDX-License-Identifier: MIT
#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include "query_parts.hpp"

namespace jostle_bench {
namespace {

/// Bullet's btDbvt, optimised from the top down once. Its rays don't get shorter when they hit something.
class Bullet final : public QueryPeer
{
  public:
    const char* name() const noexcept override { return "bullet"; }
    bool answers(QueryKind kind) const noexcept override
    {
        return kind != QueryKind::sphere && kind != QueryKind::nearest;
    }
    void build(Boxes3 boxes) override
    {
        boxes_ = boxes;
        for (std::size_t i = 0; i < boxes.size(); ++i)
            tree_.insert(volume(boxes[i]), reinterpret_cast<void*>(i));
        tree_.optimizeTopDown();
    }
    void ask(QueryKind kind, const Queries& queries, std::size_t i, Findings& found) const override
    {
        if (kind == QueryKind::box) {
            const auto take = [&](std::uint32_t id) {
                if (jostle::overlaps(queries.boxes[i], boxes_[id])) found.add(id);
            };
            Taker<decltype(take)> taker{take};
            tree_.collideTV(tree_.m_root, volume(queries.boxes[i]), taker);
        } else if (kind == QueryKind::frustum) {
            const jostle::Frustum<3, float> frustum{queries.frustums[i]};
            btVector3 normals[6];
            btScalar offsets[6];
            for (int p = 0; p < 6; ++p) {
                const auto& plane = frustum.planes[static_cast<std::size_t>(p)];
                normals[p] = {plane.normal[0], plane.normal[1], plane.normal[2]};
                offsets[p] = plane.offset;
            }
            const auto take = [&](std::uint32_t id) {
                if (jostle::overlaps(frustum, boxes_[id])) found.add(id);
            };
            Taker<decltype(take)> taker{take};
            btDbvt::collideKDOP(tree_.m_root, normals, offsets, 6, taker);
        } else if (kind == QueryKind::sweep) {
            const jostle::Sweep<3, float>& sweep = queries.sweeps[i];
            FirstSoFar first;
            const auto take = [&](std::uint32_t id) { first.offer(sweep, id, boxes_[id]); };
            const btVector3 lo(sweep.box.lo[0], sweep.box.lo[1], sweep.box.lo[2]);
            const btVector3 hi(sweep.box.hi[0], sweep.box.hi[1], sweep.box.hi[2]);
            const btVector3 middle = (lo + hi) * 0.5f;
            cast(middle, sweep.motion, sweep.max_fraction, lo - middle, hi - middle, take);
            first.give(found);
        } else {
            const jostle::Ray<3, float>& ray = queries.rays[i];
            FirstSoFar first;
            const btVector3 origin(ray.origin[0], ray.origin[1], ray.origin[2]);
            const btVector3 none(0, 0, 0);
            if (kind == QueryKind::first) {
                const auto take = [&](std::uint32_t id) { first.offer(ray, id, boxes_[id]); };
                cast(origin, ray.direction, ray.max_fraction, none, none, take);
                first.give(found);
            } else {
                const auto take = [&](std::uint32_t id) {
                    if (jostle::hit_fraction(ray, boxes_[id])) found.add(id);
                };
                cast(origin, ray.direction, ray.max_fraction, none, none, take);
            }
        }
    }

  private:
    template <class Take>
    struct Taker final : btDbvt::ICollide
    {
        const Take& take;
        explicit Taker(const Take& each) : take(each) {}
        void Process(const btDbvtNode* leaf) override
        {
            take(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(leaf->data)));
        }
    };
    static btDbvtVolume volume(const jostle::Aabb3f& box)
    {
        return btDbvtVolume::FromMM({box.lo[0], box.lo[1], box.lo[2]}, {box.hi[0], box.hi[1], box.hi[2]});
    }
    template <class Take>
    void cast(const btVector3& from, const jostle::Vec3f& direction, float length, const btVector3& lo,
              const btVector3& hi, const Take& take) const
    {
        thread_local btAlignedObjectArray<const btDbvtNode*> stack;
        btVector3 inverse;
        unsigned signs[3];
        for (int d = 0; d < 3; ++d) {
            inverse[d] = direction[d] == 0 ? btScalar(BT_LARGE_FLOAT) : btScalar(1) / direction[d];
            signs[d] = inverse[d] < 0;
        }
        const btVector3 to = from + btVector3(direction[0], direction[1], direction[2]) * length;
        Taker<Take> taker{take};
        tree_.rayTestInternal(tree_.m_root, from, to, inverse, signs, length, lo, hi, stack, taker);
    }

    Boxes3 boxes_;
    btDbvt tree_;
};

} // namespace

std::unique_ptr<QueryPeer> make_bullet_queries()
{
    return std::make_unique<Bullet>();
}

} // namespace jostle_bench
