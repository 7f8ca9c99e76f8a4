// SPDX-License-Identifier: MIT
#include "fcl_boxes.hpp"
#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

constexpr PeerInfo peer_info{
    "fcl",
    "FCL 0.7 DynamicAABBTreeCollisionManager<double> (double is what the packaged library holds): "
    "computeAABB for what moved, update, collide",
    1'000'000, false, true};

class Fcl final : public Peer<3>
{
  public:
    const PeerInfo& info() const noexcept override { return peer_info; }

    void start(Boxes<3> boxes, std::uint32_t) override
    {
        stop();
        boxes_ = boxes;
        manager_ = std::make_unique<fcl::DynamicAABBTreeCollisionManagerd>();
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            geometries_.push_back(std::make_shared<BoxGeometry>(boxes[i]));
            objects_.push_back(std::make_unique<fcl::CollisionObjectd>(geometries_.back()));
            objects_.back()->setUserData(reinterpret_cast<void*>(i));
            // The constructor asks the geometry to compute its box, which this one has already.
            objects_.back()->computeAABB();
            pointers_.push_back(objects_.back().get());
        }
        manager_->registerObjects(pointers_);
        manager_->setup();
    }

    void frame(Boxes<3> boxes, std::span<const std::uint32_t> moved) override
    {
        boxes_ = boxes;
        pairs_.clear();
        for (const std::uint32_t i : moved) {
            geometries_[i]->set(boxes[i]);
            objects_[i]->computeAABB();
        }
        if (moved.size() * 2 > boxes.size()) {
            manager_->update();
        } else if (!moved.empty()) {
            moved_pointers_.clear();
            for (const std::uint32_t i : moved)
                moved_pointers_.push_back(pointers_[i]);
            manager_->update(moved_pointers_);
        }
        manager_->collide(this, [](fcl::CollisionObjectd* x, fcl::CollisionObjectd* y, void* context) {
            auto& self = *static_cast<Fcl*>(context);
            const std::uint32_t a = index(x), b = index(y);
            if (jostle::overlaps(self.boxes_[a], self.boxes_[b])) self.pairs_.push_back({a, b});
            return false; // go on
        });
    }

    PeerResult result() const override { return summarise(pairs_); }

    void stop() override
    {
        manager_.reset();
        pointers_.clear();
        objects_.clear();
        geometries_.clear();
        pairs_.clear();
    }

  private:
    static std::uint32_t index(const fcl::CollisionObjectd* object)
    {
        return static_cast<std::uint32_t>(reinterpret_cast<std::size_t>(object->getUserData()));
    }

    Boxes<3> boxes_;
    std::vector<std::shared_ptr<BoxGeometry>> geometries_;
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
    std::vector<fcl::CollisionObjectd*> pointers_, moved_pointers_;
    std::unique_ptr<fcl::DynamicAABBTreeCollisionManagerd> manager_;
    std::vector<jostle::Pair> pairs_;
};

} // namespace

std::unique_ptr<Peer<3>> make_fcl()
{
    return std::make_unique<Fcl>();
}

} // namespace jostle_bench
