// SPDX-License-Identifier: MIT
#include <box2d/b2_broad_phase.h>

#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

constexpr PeerInfo peer_info{
    "box2d",
    "Box2D 2.4 b2BroadPhase with a contact list as in b2ContactManager: MoveProxy for "
    "what moved, UpdatePairs, "
    "contacts dropped when the fat boxes part",
    1'000'000, false, true};

class Box2d final : public Peer<2>
{
  public:
    const PeerInfo& info() const noexcept override { return peer_info; }

    void start(Boxes<2> boxes, std::uint32_t) override
    {
        stop();
        broad_phase_ = std::make_unique<b2BroadPhase>();
        last_.assign(boxes.begin(), boxes.end());
        boxes_ = boxes;
        neighbours_.resize(boxes.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            proxies_.push_back(broad_phase_->CreateProxy(tight(boxes[i]), reinterpret_cast<void*>(i)));
        broad_phase_->UpdatePairs(this);
    }

    void frame(Boxes<2> boxes, std::span<const std::uint32_t> moved) override
    {
        boxes_ = boxes;
        for (const std::uint32_t i : moved) {
            // Box2D stretches the fat box of what moves along its displacement.
            const b2Vec2 displacement = centre(boxes[i]) - centre(last_[i]);
            broad_phase_->MoveProxy(proxies_[i], tight(boxes[i]), displacement);
            last_[i] = boxes[i];
        }
        broad_phase_->UpdatePairs(this);
        for (std::size_t i = 0; i < contacts_.size();) {
            const jostle::Pair contact = contacts_[i];
            if (broad_phase_->TestOverlap(proxies_[contact.a], proxies_[contact.b])) {
                ++i;
                continue;
            }
            forget(contact.a, contact.b);
            forget(contact.b, contact.a);
            contacts_[i] = contacts_.back();
            contacts_.pop_back();
        }
    }

    PeerResult result() const override
    {
        std::vector<jostle::Pair> pairs;
        for (const jostle::Pair& contact : contacts_)
            if (jostle::overlaps(boxes_[contact.a], boxes_[contact.b])) pairs.push_back(contact);
        return summarise(pairs);
    }

    void stop() override
    {
        broad_phase_.reset();
        proxies_.clear();
        contacts_.clear();
        neighbours_.clear();
        last_.clear();
    }

    /// Called by b2BroadPhase, also for pairs that it has reported before.
    void AddPair(void* x, void* y)
    {
        const auto a = static_cast<std::uint32_t>(reinterpret_cast<std::size_t>(x));
        const auto b = static_cast<std::uint32_t>(reinterpret_cast<std::size_t>(y));
        std::vector<std::uint32_t>& of_b = neighbours_[b];
        if (std::find(of_b.begin(), of_b.end(), a) != of_b.end()) return;
        of_b.push_back(a);
        neighbours_[a].push_back(b);
        contacts_.push_back({a, b});
    }

  private:
    static b2AABB tight(const jostle::Aabb2f& box)
    {
        b2AABB out;
        out.lowerBound.Set(box.lo[0], box.lo[1]);
        out.upperBound.Set(box.hi[0], box.hi[1]);
        return out;
    }
    static b2Vec2 centre(const jostle::Aabb2f& box)
    {
        return {0.5f * (box.lo[0] + box.hi[0]), 0.5f * (box.lo[1] + box.hi[1])};
    }
    void forget(std::uint32_t object, std::uint32_t neighbour)
    {
        std::vector<std::uint32_t>& list = neighbours_[object];
        *std::find(list.begin(), list.end(), neighbour) = list.back();
        list.pop_back();
    }

    Boxes<2> boxes_;
    std::unique_ptr<b2BroadPhase> broad_phase_;
    std::vector<int32> proxies_;
    std::vector<jostle::Aabb2f> last_;
    std::vector<jostle::Pair> contacts_;
    std::vector<std::vector<std::uint32_t>> neighbours_; // by object, as Box2D's contact edges
};

} // namespace

std::unique_ptr<Peer<2>> make_box2d()
{
    return std::make_unique<Box2d>();
}

} // namespace jostle_bench
