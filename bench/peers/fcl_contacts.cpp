// SPDX-License-Identifier: MIT
#include "fcl_shapes.hpp"

namespace jostle_bench {
namespace {

class FclContacts final : public ContactPeer
{
  public:
    const char* name() const noexcept override { return "fcl"; }
    const char* how() const noexcept override
    {
        return "FCL 0.7 collide<double> with contacts, libccd as its solver; at most 4 contacts a pair, 64 "
               "with a mesh";
    }

    bool has(BodyKind) const noexcept override { return true; }
    void start(std::span<const BodyShape> shapes, std::span<const jostle::Pair> pairs,
               jostle::Executor& executor) override
    {
        executor_ = &executor;
        pairs_ = pairs;
        objects_.clear();
        kinds_.clear();
        for (const BodyShape& body : shapes) {
            objects_.push_back(std::make_unique<fcl::CollisionObjectd>(fcl_shape(body)));
            kinds_.push_back(body.kind);
        }
        counts_.assign(executor.concurrency(), {});
    }

    void move(std::span<const jostle::Pose3f> poses) override
    {
        for (std::size_t i = 0; i < poses.size(); ++i) {
            const auto& p = poses[i].position;
            const auto& q = poses[i].rotation;
            const fcl::Quaterniond rotation =
                fcl_turn(kinds_[i], fcl::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
            objects_[i]->setTransform(rotation, fcl::Vector3d(p[0], p[1], p[2]));
        }
    }

    void frame() override
    {
        executor_->run(static_cast<std::uint32_t>(counts_.size()), [&](std::uint32_t i) {
            ContactCounts counts;
            fcl::CollisionResultd result;
            const std::size_t first = pairs_.size() * i / counts_.size(),
                              last = pairs_.size() * (i + 1) / counts_.size();
            for (std::size_t k = first; k < last; ++k) {
                const jostle::Pair& pair = pairs_[k];
                const bool mesh = kinds_[pair.a] == BodyKind::mesh || kinds_[pair.b] == BodyKind::mesh;
                result.clear();
                const fcl::CollisionRequestd request(mesh ? 64 : 4, true);
                fcl::collide(objects_[pair.a].get(), objects_[pair.b].get(), request, result);
                counts.touching += result.isCollision() ? 1 : 0;
                counts.points += result.numContacts();
            }
            counts_[i] = counts;
        });
    }

    ContactCounts counts() const override
    {
        ContactCounts all;
        for (const ContactCounts& counts : counts_) {
            all.touching += counts.touching;
            all.points += counts.points;
        }
        return all;
    }

  private:
    jostle::Executor* executor_ = nullptr;
    std::span<const jostle::Pair> pairs_;
    std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
    std::vector<BodyKind> kinds_;
    std::vector<ContactCounts> counts_;
};

} // namespace

std::unique_ptr<ContactPeer> make_fcl_contacts()
{
    return std::make_unique<FclContacts>();
}

} // namespace jostle_bench
