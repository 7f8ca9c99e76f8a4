// SPDX-License-Identifier: MIT
#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include "bench/program_peers.hpp"
#include "grain_images.hpp"

namespace jostle_bench {
namespace {

using jostle::Vec3f;

/// A btDbvt of the balls, kept, in which each leaf is updated, as all have moved when a Verlet list is made
/// anew; and another one of the images, made anew. Each pair of leaves that touch is tested as balls.
class BulletGrains final : public NeighboursPeer
{
  public:
    const char* name() const noexcept override { return "bullet"; }
    void find(std::span<const Vec3f> centers, std::span<const float> radii, float period, float skin,
              std::vector<jostle::Pair>& pairs, std::vector<Vec3f>& shift) override
    {
        images_.build(centers, radii, period, skin);
        const bool first = leaves_.empty();
        for (std::size_t i = 0; i < centers.size(); ++i) {
            btDbvtVolume there = volume(images_.boxes[i]);
            if (first)
                leaves_.push_back(balls_.insert(there, reinterpret_cast<void*>(i)));
            else
                balls_.update(leaves_[i], there);
        }
        if (first) balls_.optimizeTopDown();
        beyond_.clear();
        for (std::size_t i = 0; i < images_.images.size(); ++i)
            beyond_.insert(volume(images_.images[i].box), reinterpret_cast<void*>(i));
        pairs.clear();
        shift.clear();
        const auto offer = [&](std::uint32_t a, std::uint32_t b, const Vec3f& by) {
            const Vec3f way = centers[b] + by - centers[a];
            const float reach = radii[a] + radii[b] + skin;
            if (jostle::dot(way, way) > reach * reach) return;
            pairs.push_back({a, b});
            shift.push_back(by);
        };
        collide(balls_, balls_, [&](std::uint32_t a, std::uint32_t b) { offer(a, b, {}); });
        collide(balls_, beyond_, [&](std::uint32_t a, std::uint32_t k) {
            offer(a, images_.images[k].ball, images_.images[k].shift);
        });
    }

  private:
    template <class Take>
    static void collide(btDbvt& one, btDbvt& other, const Take& take)
    {
        struct Taker final : btDbvt::ICollide
        {
            const Take& take;
            explicit Taker(const Take& each) : take(each) {}
            static std::uint32_t number(const btDbvtNode* leaf)
            {
                return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(leaf->data));
            }
            void Process(const btDbvtNode* a, const btDbvtNode* b) override { take(number(a), number(b)); }
        } taker(take);
        one.collideTTpersistentStack(one.m_root, other.m_root, taker); // as btDbvtBroadphase
    }
    static btDbvtVolume volume(const jostle::Aabb3f& box)
    {
        return btDbvtVolume::FromMM({box.lo[0], box.lo[1], box.lo[2]}, {box.hi[0], box.hi[1], box.hi[2]});
    }

    GrainImages images_;
    std::vector<btDbvtNode*> leaves_;
    btDbvt balls_, beyond_;
};

} // namespace

std::unique_ptr<NeighboursPeer> make_bullet_grains()
{
    return std::make_unique<BulletGrains>();
}

} // namespace jostle_bench
