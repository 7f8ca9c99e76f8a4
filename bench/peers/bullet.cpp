// SPDX-License-Identifier: MIT
#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

constexpr PeerInfo dbvt_info{
    "bullet",
    "Bullet btDbvtBroadphase, deferred collide: setAabb for what moved, calculateOverlappingPairs; its pair "
    "cache keeps pairs within the tree's margin",
    1'000'000, false, true};
constexpr PeerInfo sweep_info{"bullet-sap",
                              "Bullet bt32BitAxisSweep3 without its ray accelerator: setAabb for what moved, "
                              "calculateOverlappingPairs; inserting n objects costs O(n^2)",
                              10'000, false, true};

btVector3 low(const jostle::Aabb3f& box)
{
    return {box.lo[0], box.lo[1], box.lo[2]};
}
btVector3 high(const jostle::Aabb3f& box)
{
    return {box.hi[0], box.hi[1], box.hi[2]};
}

class Bullet : public Peer<3>
{
  public:
    void start(Boxes<3> boxes, std::uint32_t) override
    {
        stop();
        boxes_ = boxes;
        broadphase_ = make_broadphase(boxes);
        proxies_.reserve(boxes.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            proxies_.push_back(broadphase_->createProxy(
                low(boxes[i]), high(boxes[i]), 0, reinterpret_cast<void*>(i),
                btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter, nullptr));
    }

    void frame(Boxes<3> boxes, std::span<const std::uint32_t> moved) override
    {
        boxes_ = boxes;
        for (const std::uint32_t i : moved)
            broadphase_->setAabb(proxies_[i], low(boxes[i]), high(boxes[i]), nullptr);
        broadphase_->calculateOverlappingPairs(nullptr);
    }

    PeerResult result() const override
    {
        const btBroadphasePairArray& cached =
            broadphase_->getOverlappingPairCache()->getOverlappingPairArray();
        std::vector<jostle::Pair> pairs;
        for (int i = 0; i < cached.size(); ++i) {
            const std::uint32_t a = object(cached[i].m_pProxy0), b = object(cached[i].m_pProxy1);
            if (jostle::overlaps(boxes_[a], boxes_[b])) pairs.push_back({a, b});
        }
        return summarise(pairs);
    }

  protected:
    virtual std::unique_ptr<btBroadphaseInterface> make_broadphase(Boxes<3> boxes) const = 0;

    std::unique_ptr<btBroadphaseInterface> broadphase_;
    std::vector<btBroadphaseProxy*> proxies_;

  private:
    static std::uint32_t object(const btBroadphaseProxy* proxy)
    {
        return static_cast<std::uint32_t>(reinterpret_cast<std::size_t>(proxy->m_clientObject));
    }

    Boxes<3> boxes_;
};

class BulletTree final : public Bullet
{
  public:
    ~BulletTree() override { BulletTree::stop(); }
    const PeerInfo& info() const noexcept override { return dbvt_info; }
    void stop() override
    {
        broadphase_.reset();
        // destroyProxy searches all pairs, for each object; once the pair cache is gone, freeing is enough.
        for (btBroadphaseProxy* proxy : proxies_)
            btAlignedFree(proxy);
        proxies_.clear();
    }

  private:
    std::unique_ptr<btBroadphaseInterface> make_broadphase(Boxes<3>) const override
    {
        auto tree = std::make_unique<btDbvtBroadphase>();
        tree->m_deferedcollide = true;
        return tree;
    }
};

class BulletSweep final : public Bullet
{
  public:
    const PeerInfo& info() const noexcept override { return sweep_info; }
    void stop() override
    {
        broadphase_.reset(); // owns its proxies
        proxies_.clear();
    }

  private:
    // It wants the world's size in advance, as Bullet's users must know it. What leaves it is clamped to its
    // border: slower, not wrong.
    std::unique_ptr<btBroadphaseInterface> make_broadphase(Boxes<3> boxes) const override
    {
        const jostle::Aabb3f world = bounds_of(boxes);
        const btVector3 margin = (high(world) - low(world)) * 0.1f + btVector3(1, 1, 1);
        return std::make_unique<bt32BitAxisSweep3>(low(world) - margin, high(world) + margin,
                                                   static_cast<unsigned>(boxes.size()) + 2, nullptr, true);
    }
};

} // namespace

std::unique_ptr<Peer<3>> make_bullet()
{
    return std::make_unique<BulletTree>();
}
std::unique_ptr<Peer<3>> make_bullet_sap()
{
    return std::make_unique<BulletSweep>();
}

} // namespace jostle_bench
