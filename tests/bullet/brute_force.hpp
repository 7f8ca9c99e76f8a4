// SPDX-License-Identifier: MIT
#pragma once

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <btBulletCollisionCommon.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/query.hpp"

namespace jostle_bullet {

/// The adapter's slow twin: what its documentation says, every box against every other, without
/// jostle::World.
class BruteForce final : public btBroadphaseInterface
{
  public:
    using Box = jostle::Aabb<3, btScalar>;
    explicit BruteForce(btScalar slack = btScalar(0.05), btOverlappingPairCache* cache = nullptr)
        : slack_(slack), cache_(cache ? cache : &own_cache_)
    {
    }

    btBroadphaseProxy* createProxy(const btVector3& lo, const btVector3& hi, int, void* user, int group,
                                   int mask, btDispatcher* dispatcher) override
    {
        auto made = std::make_unique<Proxy>();
        Proxy& proxy = *made;
        proxies_.push_back(std::move(made));
        proxy.m_clientObject = user;
        proxy.m_collisionFilterGroup = group;
        proxy.m_collisionFilterMask = mask;
        proxy.m_uniqueId = ++last_id_;
        proxy.m_aabbMin = lo;
        proxy.m_aabbMax = hi;
        proxy.ghost = dispatcher && user && btGhostObject::upcast(static_cast<btCollisionObject*>(user));
        set(proxy, box(lo, hi, 0));
        return &proxy;
    }
    void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override
    {
        cache_->removeOverlappingPairsContainingProxy(proxy, dispatcher);
        std::erase_if(known_, [&](const auto& pair) {
            return pair.first == proxy->m_uniqueId || pair.second == proxy->m_uniqueId;
        });
        std::erase_if(proxies_, [&](const auto& other) { return other.get() == proxy; });
    }
    void setAabb(btBroadphaseProxy* given, const btVector3& lo, const btVector3& hi, btDispatcher*) override
    {
        auto& proxy = static_cast<Proxy&>(*given);
        bool unchanged = true;
        for (int d = 0; d < 3; ++d)
            if (lo[d] != proxy.m_aabbMin[d] || hi[d] != proxy.m_aabbMax[d]) unchanged = false;
        proxy.m_aabbMin = lo;
        proxy.m_aabbMax = hi;
        const Box& old = proxy.bounds;
        bool fits = true;
        for (int d = 0; d < 3; ++d)
            if (!(old.lo[d] <= lo[d] && hi[d] <= old.hi[d] && lo[d] - old.lo[d] <= 4 * slack_ &&
                  old.hi[d] - hi[d] <= 4 * slack_))
                fits = false;
        if (!fits && !unchanged) set(proxy, box(lo, hi, slack_));
    }
    void getAabb(btBroadphaseProxy* proxy, btVector3& lo, btVector3& hi) const override
    {
        lo = proxy->m_aabbMin;
        hi = proxy->m_aabbMax;
    }
    void rayTest(const btVector3& from, const btVector3& to, btBroadphaseRayCallback& callback,
                 const btVector3& lo = btVector3(0, 0, 0), const btVector3& hi = btVector3(0, 0, 0)) override
    {
        jostle::Sweep<3, btScalar> sweep{};
        bool moves = false;
        for (int d = 0; d < 3; ++d) {
            sweep.box.lo[d] = from[d] + lo[d];
            sweep.box.hi[d] = from[d] + hi[d];
            sweep.motion[d] = to[d] - from[d];
            if (!std::isfinite(sweep.motion[d]) || !(sweep.box.lo[d] <= sweep.box.hi[d])) return;
            if (!std::isfinite(sweep.box.lo[d]) || !std::isfinite(sweep.box.hi[d])) return;
            if (std::isfinite(1 / sweep.motion[d])) moves = true;
        }
        answer(callback, [&](const Box& bounds) -> std::optional<btScalar> {
            if (moves) return jostle::hit_fraction(sweep, bounds);
            if (jostle::overlaps(sweep.box, bounds)) return btScalar(0);
            return std::nullopt;
        });
    }
    void aabbTest(const btVector3& lo, const btVector3& hi, btBroadphaseAabbCallback& callback) override
    {
        const Box region = box(lo, hi, 0);
        answer(callback, [&](const Box& bounds) -> std::optional<btScalar> {
            if (jostle::overlaps(region, bounds)) return btScalar(0);
            return std::nullopt;
        });
    }
    void calculateOverlappingPairs(btDispatcher* dispatcher) override
    {
        for (const auto& [a, b] : std::set(known_))
            if (!jostle::overlaps(find(a)->bounds, find(b)->bounds)) {
                cache_->removeOverlappingPair(find(a), find(b), dispatcher);
                known_.erase({a, b});
            }
        offer();
    }
    btOverlappingPairCache* getOverlappingPairCache() override
    {
        offer();
        return cache_;
    }
    const btOverlappingPairCache* getOverlappingPairCache() const override { return cache_; }
    void getBroadphaseAabb(btVector3& lo, btVector3& hi) const override
    {
        lo = hi = btVector3(0, 0, 0);
        bool first = true;
        for (const auto& proxy : proxies_) {
            if (!(proxy->bounds.lo[0] <= proxy->bounds.hi[0])) continue;
            for (int d = 0; d < 3; ++d) {
                lo[d] = first ? proxy->bounds.lo[d] : std::min(lo[d], proxy->bounds.lo[d]);
                hi[d] = first ? proxy->bounds.hi[d] : std::max(hi[d], proxy->bounds.hi[d]);
            }
            first = false;
        }
    }
    void printStats() override {}

    [[nodiscard]] static Box bounds(const btBroadphaseProxy* proxy)
    {
        return static_cast<const Proxy*>(proxy)->bounds;
    }

  private:
    struct Proxy final : btBroadphaseProxy
    {
        Box bounds{};
        bool ghost = false, changed = false;
    };

    static Box box(const btVector3& lo, const btVector3& hi, btScalar by)
    {
        constexpr btScalar infinity = std::numeric_limits<btScalar>::infinity();
        Box made{};
        for (int d = 0; d < 3; ++d) {
            if (!(lo[d] <= hi[d])) return {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
            made.lo[d] = lo[d] - by;
            made.hi[d] = hi[d] + by;
        }
        return made;
    }
    /// All pairs that touch, one of which has new bounds.
    void offer()
    {
        for (const auto& a : proxies_)
            for (const auto& b : proxies_)
                if (a->m_uniqueId < b->m_uniqueId && (a->changed || b->changed) &&
                    jostle::overlaps(a->bounds, b->bounds)) {
                    cache_->addOverlappingPair(a.get(), b.get());
                    known_.insert({a->m_uniqueId, b->m_uniqueId});
                }
        for (const auto& proxy : proxies_)
            proxy->changed = false;
    }
    void set(Proxy& proxy, const Box& bounds)
    {
        proxy.bounds = bounds;
        proxy.changed = true;
        for (const auto& other : proxies_)
            if (other.get() != &proxy && (proxy.ghost || other->ghost) &&
                jostle::overlaps(other->bounds, bounds))
                if (cache_->addOverlappingPair(&proxy, other.get()))
                    known_.insert({std::min(proxy.m_uniqueId, other->m_uniqueId),
                                   std::max(proxy.m_uniqueId, other->m_uniqueId)});
    }
    Proxy* find(int id) const
    {
        return std::find_if(proxies_.begin(), proxies_.end(),
                            [&](const auto& proxy) { return proxy->m_uniqueId == id; })
            ->get();
    }
    template <class Test>
    void answer(btBroadphaseAabbCallback& callback, const Test& test)
    {
        std::vector<std::pair<btScalar, int>> found;
        for (const auto& proxy : proxies_)
            if (proxy->bounds.lo[0] <= proxy->bounds.hi[0])
                if (const auto fraction = test(proxy->bounds))
                    found.emplace_back(*fraction, proxy->m_uniqueId);
        std::sort(found.begin(), found.end());
        for (const auto& hit : found)
            callback.process(find(hit.second));
    }

    btScalar slack_;
    btHashedOverlappingPairCache own_cache_;
    btOverlappingPairCache* cache_;
    std::vector<std::unique_ptr<Proxy>> proxies_; // by age
    std::set<std::pair<int, int>> known_;         // of those whose bounds touched
    int last_id_ = 0;
};

} // namespace jostle_bullet
