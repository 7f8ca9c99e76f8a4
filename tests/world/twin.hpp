// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "jostle/world.hpp"
#include "tool/scenes/random.hpp"

/// What a World answers to, written to be obviously right: every box against all that begin before it ends
/// along x, and an explicit set of the pairs that there are.
namespace world_tests {

using jostle::Aabb;
using jostle::EndedPair;
using jostle::EndReason;
using jostle::ObjectFilter;
using jostle::ObjectId;
using jostle::ObjectPair;
using jostle::Pair;

/// Does the callback take this pair, while the rule is `salt`? 0: it takes all.
inline bool accepts(std::uint64_t salt, ObjectId a, ObjectId b)
{
    std::uint64_t x = salt ^ (std::uint64_t{a.index} << 32 | b.index) * 0x9e3779b97f4a7c15u;
    x ^= x >> 29;
    x *= 0xbf58476d1ce4e5b9u;
    x ^= x >> 32;
    return salt == 0 || x % 4 != 0;
}

template <int Dim, class T>
class Twin
{
  public:
    using Box = Aabb<Dim, T>;
    using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;
    struct Thing
    {
        ObjectId id;
        Box box;
        std::array<T, Dim> displacement{};
        T margin = 0;
        ObjectFilter filter;
        bool enabled = true;
        bool plain = true; ///< never had a margin or a displacement of its own

        Box bounds() const
        {
            Box result = box;
            for (int d = 0; d < Dim; ++d) {
                const T by = displacement[static_cast<std::size_t>(d)];
                result.lo[d] = std::min(box.lo[d], box.lo[d] + by) - margin;
                result.hi[d] = std::max(box.hi[d], box.hi[d] + by) + margin;
            }
            return result;
        }
    };
    std::map<std::uint32_t, Thing> things; ///< by index; what the next update will see
    std::uint64_t salt = 0;                ///< of the callback
    bool has_callback = false;
    std::set<std::uint32_t> filter_was_set; ///< since the last update
    std::set<std::uint32_t> again;          ///< objects to be reported again
    Pairs again_pairs;                      ///< and pairs, ...
    std::set<std::uint32_t> named_first;    ///< ... the first of whom counts as changed

    std::vector<ObjectPair> began;
    std::vector<EndedPair> ended;
    std::vector<Pair> persisted, all; ///< sorted
    std::size_t refused = 0, disabled = 0;
    std::uint64_t asked = 0; ///< how many questions the callback had to answer

    void update()
    {
        Pairs now, now_accepted;
        began.clear();
        ended.clear();
        persisted.clear();
        all.clear();
        asked = 0;
        struct Entry
        {
            Box bounds;
            const Thing* thing;
        };
        std::vector<Entry> entries;
        for (const auto& [index, thing] : things)
            if (thing.enabled) entries.push_back({thing.bounds(), &thing});
        std::sort(entries.begin(), entries.end(),
                  [](const Entry& a, const Entry& b) { return a.bounds.lo[0] < b.bounds.lo[0]; });
        for (auto a = entries.begin(); a != entries.end(); ++a)
            for (auto b = a + 1; b != entries.end() && b->bounds.lo[0] <= a->bounds.hi[0]; ++b)
                if (!apart(a->bounds, b->bounds) && agree(a->thing->filter, b->thing->filter))
                    now.insert(std::minmax(a->thing->id.index, b->thing->id.index));
        const auto is_again = [&](const auto& pair) {
            return again.count(pair.first) != 0 || again.count(pair.second) != 0 ||
                   again_pairs.count(pair) != 0;
        };
        const auto changed = [&](std::uint32_t i) {
            if (again.count(i) != 0 || named_first.count(i) != 0) return true;
            const auto old = last_.find(i);
            const auto is = things.find(i);
            if (old == last_.end() || is == things.end() || old->second.id != is->second.id) return true;
            const Box x = old->second.bounds(), y = is->second.bounds();
            for (int d = 0; d < Dim; ++d)
                if (x.lo[d] != y.lo[d] || x.hi[d] != y.hi[d]) return true;
            return old->second.filter != is->second.filter || old->second.enabled != is->second.enabled ||
                   (has_callback && filter_was_set.count(i) != 0);
        };
        for (const auto& pair : now) {
            const auto [i, j] = pair;
            const ObjectPair ids{things.at(i).id, things.at(j).id};
            // A pair of an object that has come in another's place is another pair.
            const bool same =
                touching_.count(pair) != 0 && last_.at(i).id == ids.a && last_.at(j).id == ids.b;
            const bool was_accepted = same && accepted_.count(pair) != 0;
            bool is_accepted = was_accepted;
            const bool tell = same && is_again(pair);
            if (!same || tell || filter_was_set.count(i) != 0 || filter_was_set.count(j) != 0) {
                is_accepted = !has_callback || accepts(salt, ids.a, ids.b);
                asked += has_callback;
            }
            if (is_accepted) {
                now_accepted.insert(pair);
                all.push_back({i, j});
                if (!was_accepted || tell)
                    began.push_back(ids);
                else if (changed(i) || changed(j))
                    persisted.push_back({i, j});
            }
        }
        for (const auto& pair : accepted_) {
            const auto [i, j] = pair;
            const Thing &a = last_.at(i), &b = last_.at(j);
            const auto is_a = things.find(i), is_b = things.find(j);
            const bool gone = is_a == things.end() || is_b == things.end() || is_a->second.id != a.id ||
                              is_b->second.id != b.id;
            if (!gone && now_accepted.count(pair) != 0) continue;
            EndReason reason = EndReason::filtered;
            if (gone)
                reason = EndReason::removed;
            else if (!is_a->second.enabled || !is_b->second.enabled)
                reason = EndReason::disabled;
            else if (apart(is_a->second.bounds(), is_b->second.bounds()))
                reason = EndReason::moved_apart;
            ended.push_back({a.id, b.id, reason});
        }
        refused = now.size() - now_accepted.size();
        disabled = static_cast<std::size_t>(std::count_if(
            things.begin(), things.end(), [](const auto& each) { return !each.second.enabled; }));
        touching_ = std::move(now);
        accepted_ = std::move(now_accepted);
        last_ = things;
        filter_was_set.clear();
        again.clear();
        again_pairs.clear();
        named_first.clear();
    }

    static bool apart(const Box& a, const Box& b)
    {
        for (int d = 0; d < Dim; ++d)
            if (a.hi[d] < b.lo[d] || b.hi[d] < a.lo[d]) return true;
        return false;
    }

  private:
    static bool agree(const ObjectFilter& a, const ObjectFilter& b)
    {
        if (a.is_static && b.is_static) return false;
        if ((a.category & b.mask) == 0 || (b.category & a.mask) == 0) return false;
        return a.owner != b.owner || a.owner == 0xffffffffu;
    }

    std::map<std::uint32_t, Thing> last_; // as of the last update
    Pairs touching_, accepted_;           // pairs as of the last update
};

/// Who touches whom and where all is, asked one by one.
template <int Dim, class T>
testing::AssertionResult agree_about_all(const jostle::World<Dim, T>& world, const Twin<Dim, T>& twin)
{
    std::vector<Pair> told;
    for (const std::size_t most : {twin.all.size() / 2 + 1, twin.all.size() + 1}) {
        told.clear();
        const bool all = world.pairs([&](ObjectId a, ObjectId b) {
            if (world.id(a.index) != a || world.id(b.index) != b) told.push_back({});
            told.push_back({a.index, b.index});
            return told.size() < most;
        });
        if (told.size() != std::min(most, twin.all.size()) || all != (told.size() < most) ||
            !std::equal(told.begin(), told.end(), twin.all.begin()))
            return testing::AssertionFailure() << "pairs one by one: " << told.size() << " of at most "
                                               << most << ", the twin has " << twin.all.size();
    }
    std::map<std::uint32_t, std::set<std::uint32_t>> partners;
    for (const Pair& pair : twin.all)
        partners[pair.a].insert(pair.b), partners[pair.b].insert(pair.a);
    std::optional<Aabb<Dim, T>> hull;
    std::vector<ObjectId> touching;
    for (const auto& [index, thing] : twin.things) {
        world.touching(thing.id, touching);
        std::vector<ObjectId> expected;
        for (const std::uint32_t other : partners[index])
            expected.push_back(twin.things.at(other).id);
        if (touching != expected)
            return testing::AssertionFailure() << "object " << index << " touches " << touching.size()
                                               << ", the twin's " << expected.size();
        std::vector<ObjectId> some;
        const bool all_told = world.touching(thing.id, [&](ObjectId other) {
            some.push_back(other);
            return some.size() < 3;
        });
        if (all_told != (expected.size() < 3) || some.size() != std::min<std::size_t>(3, expected.size()) ||
            !std::all_of(some.begin(), some.end(), [&](ObjectId other) {
                return std::binary_search(expected.begin(), expected.end(), other);
            }))
            return testing::AssertionFailure() << "who touches object " << index << ", one by one";
        if (!thing.enabled) continue;
        const Aabb<Dim, T> bounds = thing.bounds();
        if (!hull) hull = bounds;
        for (int d = 0; d < Dim; ++d) {
            hull->lo[d] = std::min(hull->lo[d], bounds.lo[d]);
            hull->hi[d] = std::max(hull->hi[d], bounds.hi[d]);
        }
    }
    const auto all = world.bounds();
    if (all.has_value() != hull.has_value() || (all && (all->lo != hull->lo || all->hi != hull->hi)))
        return testing::AssertionFailure() << "other bounds of all objects";
    return testing::AssertionSuccess();
}

/// The two have seen the same updates.
template <int Dim, class T>
testing::AssertionResult agree(const jostle::World<Dim, T>& world, const Twin<Dim, T>& twin,
                               bool with_pairs = true)
{
    const std::vector<ObjectPair> began(world.began().begin(), world.began().end());
    const std::vector<EndedPair> ended(world.ended().begin(), world.ended().end());
    if (began != twin.began)
        return testing::AssertionFailure()
               << "began: " << began.size() << " pairs, the twin has " << twin.began.size();
    if (ended != twin.ended)
        return testing::AssertionFailure()
               << "ended: " << ended.size() << " pairs, the twin has " << twin.ended.size();
    if (world.persisted().to_vector() != twin.persisted) // ascending
        return testing::AssertionFailure() << "persisted: " << world.persisted().size()
                                           << " pairs, the twin has " << twin.persisted.size();
    std::vector<Pair> changed = twin.persisted;
    for (const ObjectPair& pair : began)
        changed.push_back({pair.a.index, pair.b.index});
    std::sort(changed.begin(), changed.end());
    if (world.changed_pairs().to_vector() != changed || world.changed_pairs().size() != changed.size())
        return testing::AssertionFailure()
               << "changed: " << world.changed_pairs().size() << " pairs, the twin has " << changed.size();
    if (with_pairs && world.pairs().to_vector() != twin.all)
        return testing::AssertionFailure()
               << "pairs: " << world.pairs().size() << ", the twin has " << twin.all.size();
    if (with_pairs)
        if (const auto same = agree_about_all(world, twin); !same) return same;
    if (world.size() != twin.things.size())
        return testing::AssertionFailure()
               << "size: " << world.size() << ", the twin has " << twin.things.size();
    const jostle::WorldStats& stats = world.stats();
    if (stats.objects != world.size() || stats.disabled != twin.disabled || stats.refused != twin.refused ||
        stats.resting + stats.active + stats.disabled != stats.objects)
        return testing::AssertionFailure() << stats.resting << " resting, " << stats.active << " active and "
                                           << stats.disabled << " disabled of " << stats.objects
                                           << " objects, " << stats.refused << " pairs refused; the twin has "
                                           << twin.disabled << " disabled and " << twin.refused << " refused";
    if (stats.began != began.size() || stats.ended != ended.size() ||
        stats.persisted != twin.persisted.size())
        return testing::AssertionFailure() << "other numbers of pairs than there are";
    return testing::AssertionSuccess();
}

} // namespace world_tests
