// SPDX-License-Identifier: MIT
#include <algorithm>

#include "bench/program_peers.hpp"
#include "fcl_boxes.hpp"
#include "grain_images.hpp"

namespace jostle_bench {
namespace {

using jostle::Vec3f;

/// A DynamicAABBTreeCollisionManager of the balls, kept and updated as a whole, and another one of the
/// images, filled anew. Each pair whose boxes touch is tested as balls.
class FclGrains final : public NeighboursPeer
{
  public:
    const char* name() const noexcept override { return "fcl"; }
    void find(std::span<const Vec3f> centers, std::span<const float> radii, float period, float skin,
              std::vector<jostle::Pair>& pairs, std::vector<Vec3f>& shift) override
    {
        images_.build(centers, radii, period, skin);
        pairs.clear();
        shift.clear();
        objects_.clear();
        const bool first = balls_.size() == 0;
        for (std::uint32_t i = 0; i < centers.size(); ++i)
            objects_.push_back(first ? balls_.add(images_.boxes[i], i) : balls_.set(i, images_.boxes[i]));
        if (first) balls_.manager.registerObjects(objects_);
        balls_.manager.update();
        objects_.clear();
        for (std::uint32_t i = 0; i < images_.images.size(); ++i)
            objects_.push_back(i < beyond_.size() ? beyond_.set(i, images_.images[i].box)
                                                  : beyond_.add(images_.images[i].box, balls_end + i));
        beyond_.manager.clear();
        beyond_.manager.registerObjects(objects_);
        beyond_.manager.setup();
        const auto offer = [&](const fcl::CollisionObjectd* one, const fcl::CollisionObjectd* other) {
            const auto [a, far] = std::minmax({FclBoxes::number(one), FclBoxes::number(other)});
            const std::uint32_t b = far < balls_end ? far : images_.images[far - balls_end].ball;
            const Vec3f by = far < balls_end ? Vec3f{} : images_.images[far - balls_end].shift;
            const Vec3f way = centers[b] + by - centers[a];
            const float reach = radii[a] + radii[b] + skin;
            if (jostle::dot(way, way) > reach * reach) return;
            pairs.push_back({a, b});
            shift.push_back(by);
        };
        using Offer = decltype(offer);
        void* const data = const_cast<void*>(static_cast<const void*>(&offer));
        const auto each = [](fcl::CollisionObjectd* one, fcl::CollisionObjectd* other, void* context) {
            (*static_cast<Offer*>(context))(one, other);
            return false; // go on
        };
        balls_.manager.collide(data, each);
        if (!images_.images.empty()) balls_.manager.collide(&beyond_.manager, data, each);
    }

  private:
    static constexpr std::uint32_t balls_end = 1u << 31; ///< images are numbered from here on

    GrainImages images_;
    FclBoxes balls_, beyond_;
    std::vector<fcl::CollisionObjectd*> objects_;
};

} // namespace

std::unique_ptr<NeighboursPeer> make_fcl_grains()
{
    return std::make_unique<FclGrains>();
}

} // namespace jostle_bench
