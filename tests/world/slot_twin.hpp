// SPDX-License-Identifier: MIT
#pragma once

#include "churn.hpp"

namespace world_tests {

/// Slots by definition: the least that nobody had, in the order of began().
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

template <int Dim, class T>
testing::AssertionResult agree(const jostle::World<Dim, T>& world, const SlotTwin& twin, bool same_lists)
{
    const auto same = [](const auto& x, const auto& y) {
        return std::equal(x.begin(), x.end(), y.begin(), y.end());
    };
    if (same_lists && (!same(world.began_slots(), twin.began) || !same(world.ended_slots(), twin.ended)))
        return testing::AssertionFailure() << "slots of pairs that began or ended";
    const std::vector<Pair> changed = world.changed_pairs().to_vector();
    const std::span<const std::uint32_t> slots = world.changed_slots();
    if (slots.size() != changed.size())
        return testing::AssertionFailure() << slots.size() << " slots for " << changed.size() << " pairs";
    for (std::size_t k = 0; k < changed.size(); ++k)
        if (slots[k] != twin.of.at({changed[k].a, changed[k].b}))
            return testing::AssertionFailure() << "slot of the pair " << changed[k].a << ", " << changed[k].b;
    std::set<std::uint32_t> different;
    for (const auto& [pair, slot] : twin.of) {
        if (world.pair_slot(pair.first, pair.second) != slot ||
            world.pair_slot(pair.second, pair.first) != slot)
            return testing::AssertionFailure() << "slot of the pair " << pair.first << ", " << pair.second;
        different.insert(slot);
        if (slot >= world.pair_slots_end()) return testing::AssertionFailure() << "a slot behind the end";
    }
    if (different.size() != twin.of.size()) return testing::AssertionFailure() << "two pairs in one slot";
    const std::vector<Pair> all = world.pairs().to_vector();
    if (all.size() != twin.of.size()) return testing::AssertionFailure() << "other pairs than slots";
    return testing::AssertionSuccess();
}

} // namespace world_tests
