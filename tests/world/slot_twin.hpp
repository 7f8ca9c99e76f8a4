// SPDX-License-Identifier: MIT
#pragma once

#include "churn.hpp"
#include "jostle/pair_slots.hpp"

namespace world_tests {

/// Slots by definition: the least free ones, in the order of began().
class SlotTwin
{
  public:
    std::vector<std::uint32_t> began, ended;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> of;

    template <int Dim, class T>
    void update(const Twin<Dim, T>& twin)
    {
        began.clear();
        ended.clear();
        std::set<std::uint32_t> taken;
        for (const auto& [pair, slot] : of)
            taken.insert(slot);
        std::uint32_t next = 0;
        for (const ObjectPair& pair : twin.began) {
            const auto [at, is_new] = of.insert({{pair.a.index, pair.b.index}, 0});
            if (is_new) {
                while (!taken.insert(next).second)
                    ++next;
                at->second = next;
            }
            began.push_back(at->second);
        }
        for (const EndedPair& pair : twin.ended) {
            const auto at = of.find({pair.a.index, pair.b.index});
            ended.push_back(at->second);
            of.erase(at);
        }
    }
};

/// The twin has been told of an update that the slots have just been told of, or of all before.
inline testing::AssertionResult agree(const jostle::PairSlots& slots, const SlotTwin& twin, bool same_lists)
{
    const auto same = [](const auto& x, const auto& y) {
        return std::equal(x.begin(), x.end(), y.begin(), y.end());
    };
    if (same_lists && (!same(slots.began_slots(), twin.began) || !same(slots.ended_slots(), twin.ended)))
        return testing::AssertionFailure() << "slots of pairs that began or ended";
    std::set<std::uint32_t> different;
    for (const auto& [pair, slot] : twin.of) {
        if (slots.slot_of(pair.first, pair.second) != slot || slots.slot_of(pair.second, pair.first) != slot)
            return testing::AssertionFailure() << "slot of the pair " << pair.first << ", " << pair.second;
        different.insert(slot);
        if (slot >= slots.end()) return testing::AssertionFailure() << "a slot behind the end";
    }
    if (different.size() != twin.of.size()) return testing::AssertionFailure() << "two pairs in one slot";
    return testing::AssertionSuccess();
}

} // namespace world_tests
