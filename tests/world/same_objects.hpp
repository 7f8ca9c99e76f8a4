// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>

#include "questions.hpp"

namespace world_tests {

/// To the bit, as boxes may have NaN.
template <class Box>
bool same_bits(const Box& a, const Box& b)
{
    return std::memcmp(&a, &b, sizeof a) == 0;
}

/// Everything that can be asked about single objects, and all pairs.
template <int Dim, class T>
testing::AssertionResult same_objects(const jostle::World<Dim, T>& view, const jostle::World<Dim, T>& world)
{
    if (view.size() != world.size()) return testing::AssertionFailure() << view.size() << " objects";
    const std::uint32_t end = std::max(view.index_end(), world.index_end()) + 3;
    std::vector<ObjectId> touching_view, touching;
    for (std::uint32_t i = 0; i < end; ++i) {
        const ObjectId id = world.id(i);
        if (view.id(i) != id || view.contains(id) != world.contains(id))
            return testing::AssertionFailure() << "object " << i << " is here or there only";
        if (!world.contains(id)) continue;
        if (!same_bits(view.box(id), world.box(id)) || !same_bits(view.bounds(id), world.bounds(id)) ||
            view.filter(id) != world.filter(id) || view.enabled(id) != world.enabled(id) ||
            view.margin(id) != world.margin(id))
            return testing::AssertionFailure() << "object " << i << " is another one";
        view.touching(id, touching_view);
        world.touching(id, touching);
        if (touching_view != touching) return testing::AssertionFailure() << "who touches object " << i;
    }
    const auto bounds = view.bounds(), there = world.bounds();
    if (bounds.has_value() != there.has_value() || (bounds && !same_bits(*bounds, *there)))
        return testing::AssertionFailure() << "bounds of all";
    if (view.pairs().to_vector() != world.pairs().to_vector()) return testing::AssertionFailure() << "pairs";
    return testing::AssertionSuccess();
}

} // namespace world_tests
