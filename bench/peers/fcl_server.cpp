// SPDX-License-Identifier: MIT
#include "bench/program_peers.hpp"
#include "fcl_boxes.hpp"
#include "touch_lists.hpp"

namespace jostle_bench {
namespace {

using jostle::Aabb3f;
using jostle::Pair;

/// A DynamicAABBTreeCollisionManager each for players, zones and props, asked by `collide` with one object.
/// Who touches whom is kept in a list per player. FCL has no rays.
class FclServer final : public ServerPeer
{
  public:
    const char* name() const noexcept override { return "fcl"; }
    bool has_shots() const noexcept override { return false; }
    void start(std::span<const Aabb3f> players, std::span<const Aabb3f> zones,
               std::span<const Aabb3f> props) override
    {
        fill(players_, players);
        fill(zones_, zones);
        fill(props_, props);
        asked_.add({}, ~std::uint32_t{0});
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
        updated_.clear();
        for (std::size_t i = 0; i < moved.size(); ++i) {
            boxes_[moved[i]] = boxes[i];
            updated_.push_back(players_.set(moved[i], boxes[i]));
        }
        players_.manager.update(updated_);
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
            fcl::CollisionObjectd* const around = asked_.set(0, {sphere.center - half, sphere.center + half});
            collide(players_, around, [&](std::uint32_t id) {
                if (jostle::overlaps(sphere, boxes_[id])) out.push_back(id);
            });
            first.push_back(out.size());
        }
    }
    void shots(std::span<const jostle::Ray3f>, std::span<const std::uint32_t>,
               std::span<jostle::Hit<float>>) override
    {
    }

  private:
    void fill(FclBoxes& set, std::span<const Aabb3f> boxes)
    {
        std::vector<fcl::CollisionObjectd*> objects;
        for (const Aabb3f& box : boxes) {
            objects.push_back(set.add(box, static_cast<std::uint32_t>(boxes_.size())));
            boxes_.push_back(box);
        }
        set.manager.registerObjects(objects);
        set.manager.setup();
    }
    /// `take` gets the numbers of those whose boxes touch the object's, but not its own.
    template <class Take>
    static void collide(FclBoxes& set, fcl::CollisionObjectd* object, const Take& take)
    {
        const std::pair<const Take&, const fcl::CollisionObjectd*> context(take, object);
        set.manager.collide(object, const_cast<void*>(static_cast<const void*>(&context)),
                            [](fcl::CollisionObjectd* x, fcl::CollisionObjectd* y, void* data) {
                                const auto& [each, self] = *static_cast<decltype(&context)>(data);
                                each(FclBoxes::number(x == self ? y : x));
                                return false; // go on
                            });
    }
    /// Queries again what these players touch.
    void compare(std::span<const std::uint32_t> moved, std::vector<Pair>& began, std::vector<Pair>& ended)
    {
        for (const std::uint32_t a : moved) {
            now_.clear();
            for (FclBoxes* set : {&players_, &zones_, &props_})
                collide(*set, players_.object(a), [&](std::uint32_t b) {
                    if (a != b && jostle::overlaps(boxes_[a], boxes_[b])) now_.push_back(b);
                });
            touching_.change(a, now_, began, ended);
        }
    }

    std::vector<Aabb3f> boxes_;
    FclBoxes players_, zones_, props_, asked_;
    TouchLists touching_;
    std::vector<fcl::CollisionObjectd*> updated_;
    std::vector<std::uint32_t> now_;
};

} // namespace

std::unique_ptr<ServerPeer> make_fcl_server()
{
    return std::make_unique<FclServer>();
}

} // namespace jostle_bench
