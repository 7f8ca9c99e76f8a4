// SPDX-License-Identifier: MIT
// Boxes measured by a ruler: what the kernels find among them is what the boxes themselves say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "index/kernels/kernels.hpp"
#include "tests/index/twin.hpp"

namespace {

using namespace jostle;
using twin::Random;

template <class T>
class Listings : public testing::Test
{
};
using Coordinates = testing::Types<float, double>;
TYPED_TEST_SUITE(Listings, Coordinates);

TYPED_TEST(Listings, GreaterNumbersHaveNoSmallerMeasure)
{
    using T = TypeParam;
    constexpr T inf = std::numeric_limits<T>::infinity(), max = std::numeric_limits<T>::max(),
                least = std::numeric_limits<T>::denorm_min();
    std::vector<T> numbers{-inf,    -max, -max / 3, -1,     -least,  0,   least,
                           T(0.25), 1,    3,        T(1e9), max / 3, max, inf};
    Random random(1);
    for (int i = 0; i < 300; ++i)
        numbers.push_back(static_cast<T>(random.number(-4, 4)));
    std::sort(numbers.begin(), numbers.end());
    const T ends[] = {-inf, -max, -2, -least, 0, least, T(1.5), max, inf};
    for (const T lo : ends)
        for (const T hi : ends) {
            if (lo > hi) continue;
            const index::Ruler<2, T> ruler({{lo, 0}, {hi, 1}});
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                const int measure = ruler.measure(0, numbers[i]);
                EXPECT_EQ(measure < 0, numbers[i] < lo);
                EXPECT_EQ((measure > index::Ruler<2, T>::last), numbers[i] > hi);
                EXPECT_LE(i == 0 ? -1 : ruler.measure(0, numbers[i - 1]), measure)
                    << lo << ' ' << hi << ' ' << numbers[i];
            }
        }
}

/// Boxes with corners on a grid have many bounds in common with the boxes that ask.
template <int Dim, class T>
Aabb<Dim, T> box_in(Random& random, double lo, double hi, double step)
{
    Aabb<Dim, T> box;
    for (int d = 0; d < Dim; ++d) {
        double a = random.number(lo, hi), b = random.number(lo, hi);
        if (step > 0) a = std::round(a / step) * step, b = std::round(b / step) * step;
        box.lo[d] = static_cast<T>(std::min(a, b));
        box.hi[d] = static_cast<T>(std::max(a, b));
    }
    return box;
}

template <int Dim, class T>
void compare_lookups(InstructionSet set, double step)
{
    Random random(7);
    std::vector<Aabb<Dim, T>> boxes, askers;
    std::vector<index::Listing<Dim>> listings(300);
    std::vector<index::Lookup<Dim>> lookups;
    for (std::uint32_t l = 0; l < listings.size(); ++l)
        for (std::uint32_t lane = 0; lane < index::lanes; ++lane)
            listings[l].clear(lane);
    std::vector<Pair> expected;
    std::uint32_t next = 0;
    while (next + 4 < listings.size()) {
        Aabb<Dim, T> ruled;
        for (int d = 0; d < Dim; ++d) {
            ruled.lo[d] = -3;
            ruled.hi[d] = 3;
        }
        const Aabb<Dim, T> asker = box_in<Dim, T>(random, -3, 3, step);
        const index::Ruler<Dim, T> ruler(ruled);
        const auto number = static_cast<std::uint32_t>(askers.size());
        index::Lookup<Dim> lookup{&listings[next], 1 + random.below(4), number, {}, {}};
        for (int d = 0; d < Dim; ++d) {
            lookup.lo[d] = ruler.measure(d, asker.lo[d]);
            lookup.hi[d] = ruler.measure(d, asker.hi[d]);
        }
        const std::uint32_t count = random.below(lookup.count * index::lanes + 1);
        for (std::uint32_t k = 0; k < count; ++k) {
            const auto id = static_cast<std::uint32_t>(boxes.size());
            boxes.push_back(box_in<Dim, T>(random, -9, 9, step));
            listings[next + k / index::lanes].set(k % index::lanes, ruler, boxes.back(), id);
            if (overlaps(asker, boxes.back())) expected.push_back({number, id});
        }
        lookups.push_back(lookup);
        askers.push_back(asker);
        next += lookup.count;
    }
    std::vector<Pair> found(listings.size() * index::lanes);
    std::size_t doubts = 0;
    found.resize(index::kernels_for<Dim, T>(set).look_up(
        lookups.data(), lookups.size(),
        [&](std::uint32_t asker, std::uint32_t id) {
            ++doubts;
            return overlaps(askers[asker], boxes[id]);
        },
        found.data()));
    EXPECT_EQ(found, expected) << name(set) << ' ' << Dim << "D, step " << step;
    EXPECT_GT(expected.size(), 20u);
    EXPECT_GE(doubts, step > 0 ? 20u : 0u);
    EXPECT_LT(doubts, step > 0 ? boxes.size() : 20u);
}

TYPED_TEST(Listings, SayWhatTheBoxesSay)
{
    for (const InstructionSet set : supported_instruction_sets())
        for (const double step : {0.0, 0.5, 1.0}) {
            compare_lookups<2, TypeParam>(set, step);
            compare_lookups<3, TypeParam>(set, step);
        }
}

} // namespace
