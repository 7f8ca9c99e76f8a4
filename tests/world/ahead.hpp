// SPDX-License-Identifier: MIT
#pragma once

#include "questions.hpp"

namespace world_tests {

/// The twin as questions should see it: what `accept` is to be asked about, for the first time or again,
/// counts as if it said yes.
template <int Dim, class T>
Twin<Dim, T> ahead_of(Twin<Dim, T> twin)
{
    twin.has_callback = false;
    twin.update();
    return twin;
}

/// Numbers that are equal, or both none.
template <int Dim, class T>
bool same_numbers(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b)
{
    for (int d = 0; d < Dim; ++d)
        if (a.lo[d] != b.lo[d] || a.hi[d] != b.hi[d]) return false;
    return true;
}

/// The world, after apply(), shows what the next update will see.
template <int Dim, class T, class Source>
testing::AssertionResult shows(const Churn<Dim, T, Source>& churn, std::uint64_t seed,
                               std::uint64_t* results = nullptr)
{
    const jostle::World<Dim, T>& world = *churn.world;
    const Twin<Dim, T> twin = ahead_of(churn.twin);
    if (world.size() != twin.things.size())
        return testing::AssertionFailure() << world.size() << " objects, not " << twin.things.size();
    for (std::uint32_t i = 0; i < world.index_end(); ++i) {
        const auto thing = twin.things.find(i);
        if (world.id(i) != (thing == twin.things.end() ? ObjectId{} : thing->second.id))
            return testing::AssertionFailure() << "object " << i << " is there or isn't";
        if (thing == twin.things.end()) continue;
        const auto& [id, box, displacement, margin, filter, enabled, plain] = thing->second;
        const Aabb<Dim, T> bounds = thing->second.bounds();
        if (!world.contains(id) || !same_numbers(world.box(id), box) ||
            !same_numbers(world.bounds(id), bounds) || world.filter(id) != filter ||
            world.enabled(id) != enabled || world.margin(id) != margin)
            return testing::AssertionFailure() << "object " << i << " is another";
    }
    if (world.pairs().to_vector() != twin.all)
        return testing::AssertionFailure()
               << "pairs: " << world.pairs().size() << ", not " << twin.all.size();
    if (const auto same = agree_about_all(world, twin); !same) return same;
    Questions<Dim, T> questions(churn, seed);
    if (const auto same = questions.agree(); !same) return same;
    if (results != nullptr) *results += questions.results;
    return testing::AssertionSuccess();
}

} // namespace world_tests
