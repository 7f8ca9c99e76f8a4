// SPDX-License-Identifier: MIT
#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include "bench/program_peers.hpp"
#include "query_parts.hpp"
#include "touch_lists.hpp"

namespace jostle_bench {
namespace {

using jostle::Aabb3f;
using jostle::Pair;

/// A btDbvt each for players, zones and props, as Bullet's own broad phase has one for what moves and one for
/// what doesn't. Who touches whom is kept in a list per player.
class BulletServer final : public ServerPeer
{
  public:
    const char* name() const noexcept override { return "bullet"; }
    bool has_shots() const noexcept override { return true; }
    void start(std::span<const Aabb3f> players, std::span<const Aabb3f> zones,
               std::span<const Aabb3f> props) override
    {
        boxes_.clear();
        leaves_.clear();
        for (const Aabb3f& box : players)
            leaves_.push_back(insert(players_, box));
        for (const Aabb3f& box : zones)
            insert(zones_, box);
        for (const Aabb3f& box : props)
            insert(props_, box);
        for (btDbvt* tree : {&players_, &zones_, &props_})
            tree->optimizeTopDown();
        touching_.start(players.size());
        std::vector<std::uint32_t> all(players.size());
        for (std::uint32_t i = 0; i < all.size(); ++i)
            all[i] = i;
        std::vector<Pair> began, ended;
        compare(all, began, ended);
    }
    void move(std::span<const std::uint32_t> moved, std::span<const Aabb3f> boxes, std::vector<Pair>& began,
              std::vector<Pair>& ended) override
    {
        for (std::size_t i = 0; i < moved.size(); ++i) {
            boxes_[moved[i]] = boxes[i];
            btDbvtVolume there = volume(boxes[i]);
            players_.update(leaves_[moved[i]], there);
        }
        players_.optimizeIncremental(static_cast<int>(1 + moved.size() / 100)); // as btDbvtBroadphase
        began.clear();
        ended.clear();
        compare(moved, began, ended);
    }
    void sight(std::span<const jostle::Sphere3f> spheres, std::vector<std::size_t>& first,
               std::vector<std::uint32_t>& out) override
    {
        first.assign(1, 0);
        out.clear();
        for (const jostle::Sphere3f& sphere : spheres) {
            const jostle::Vec3f half{sphere.radius, sphere.radius, sphere.radius};
            collide(players_, {sphere.center - half, sphere.center + half}, [&](std::uint32_t id) {
                if (jostle::overlaps(sphere, boxes_[id])) out.push_back(id);
            });
            first.push_back(out.size());
        }
    }
    void shots(std::span<const jostle::Ray3f> rays, std::span<const std::uint32_t> shooters,
               std::span<jostle::Hit<float>> out) override
    {
        for (std::size_t i = 0; i < rays.size(); ++i) {
            FirstSoFar first;
            const auto take = [&](std::uint32_t id) {
                if (id >= leaves_.size() || id % 2 != shooters[i] % 2) first.offer(rays[i], id, boxes_[id]);
            };
            Taker<decltype(take)> taker{take};
            const auto& ray = rays[i];
            const btVector3 from(ray.origin[0], ray.origin[1], ray.origin[2]);
            const btVector3 way(ray.direction[0], ray.direction[1], ray.direction[2]);
            for (const btDbvt* tree : {&players_, &props_})
                btDbvt::rayTest(tree->m_root, from, from + way * ray.max_fraction, taker);
            out[i] = first.best;
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
    static btDbvtVolume volume(const Aabb3f& box)
    {
        return btDbvtVolume::FromMM({box.lo[0], box.lo[1], box.lo[2]}, {box.hi[0], box.hi[1], box.hi[2]});
    }
    btDbvtNode* insert(btDbvt& tree, const Aabb3f& box)
    {
        boxes_.push_back(box);
        return tree.insert(volume(box), reinterpret_cast<void*>(boxes_.size() - 1));
    }
    template <class Take>
    static void collide(btDbvt& tree, const Aabb3f& box, const Take& take)
    {
        Taker<Take> taker{take};
        tree.collideTV(tree.m_root, volume(box), taker);
    }
    /// Queries again what these players touch.
    void compare(std::span<const std::uint32_t> moved, std::vector<Pair>& began, std::vector<Pair>& ended)
    {
        for (const std::uint32_t a : moved) {
            now_.clear();
            for (btDbvt* tree : {&players_, &zones_, &props_})
                collide(*tree, boxes_[a], [&](std::uint32_t b) {
                    if (a != b && jostle::overlaps(boxes_[a], boxes_[b])) now_.push_back(b);
                });
            touching_.change(a, now_, began, ended);
        }
    }

    std::vector<Aabb3f> boxes_;
    std::vector<btDbvtNode*> leaves_; // of players
    TouchLists touching_;
    std::vector<std::uint32_t> now_;
    btDbvt players_, zones_, props_;
};

} // namespace

std::unique_ptr<ServerPeer> make_bullet_server()
{
    return std::make_unique<BulletServer>();
}

} // namespace jostle_bench
