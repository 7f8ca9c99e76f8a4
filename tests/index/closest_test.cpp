// SPDX-License-Identifier: MIT
// Pairs of the objects of one index or two: those that touch and the closest, against all pairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "jostle/box_index.hpp"
#include "twin.hpp"

namespace {

using namespace jostle;
using twin::Kind;
using twin::Twin;

/// All pairs as closest_pairs would have them: those at 0 first, then ascending.
template <int Dim, class T>
std::vector<PairHit<T>> all_pairs(const Twin<Dim, T>& one, const Twin<Dim, T>& other, T max_distance)
{
    std::vector<PairHit<T>> pairs;
    for (const auto& [a, box] : one.boxes())
        for (const auto& [b, target] : other.boxes()) {
            if (&one == &other && b <= a) continue;
            const T at = squared_distance(box, target);
            if (at <= max_distance * max_distance) pairs.push_back({a, b, at});
        }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

template <int Dim, class T>
void compare(const Twin<Dim, T>& one, const Twin<Dim, T>& other, T max_distance)
{
    const bool same = &one == &other;
    const auto closest = [&](typename BoxIndex<Dim, T>::ClosestVisitor visitor) {
        return same ? one.index.closest_pairs(visitor, max_distance)
                    : one.index.closest_pairs(other.index, visitor, max_distance);
    };
    std::vector<PairHit<T>> expected = all_pairs(one, other, max_distance), got;
    // At 0 in any order, behind that as expected; so many that the search begins several times.
    constexpr std::size_t most = 3000;
    const auto zeros = static_cast<std::size_t>(
        std::find_if(expected.begin(), expected.end(), [](const auto& hit) { return hit.at > 0; }) -
        expected.begin());
    const auto collect = [&](const PairHit<T>& hit, T&) {
        got.push_back(hit);
        return got.size() < zeros + most;
    };
    ASSERT_EQ(closest(collect), expected.size() < zeros + most);
    const std::vector<PairHit<T>> in_order = got;
    ASSERT_EQ(got.size(), std::min(expected.size(), zeros + most));
    std::sort(got.begin(), got.begin() + static_cast<std::ptrdiff_t>(zeros));
    ASSERT_TRUE(std::equal(got.begin(), got.end(), expected.begin()));
    const auto first =
        same ? one.index.closest_pair(max_distance) : one.index.closest_pair(other.index, max_distance);
    ASSERT_EQ(first.has_value(), !expected.empty());
    ASSERT_TRUE(!first || *first == in_order[0]);
    // The least of distances that the visitor alone knows, and nothing that is further than it.
    const auto real = [](const PairHit<T>& hit) {
        return PairHit<T>{hit.a, hit.b, hit.at + static_cast<T>((hit.a + 3 * hit.b) % 11) / 4};
    };
    const auto met = [](const PairHit<T>& hit) { return (hit.a ^ hit.b) % 5 != 0; };
    PairHit<T> least, found;
    const auto take = [&](const PairHit<T>& hit, PairHit<T>& best) {
        if (met(hit) && (best.a == Hit<T>::none || real(hit) < best)) best = real(hit);
    };
    for (const PairHit<T>& hit : expected)
        take(hit, least);
    bool too_far = false;
    const auto shrink = [&](const PairHit<T>& hit, T& bound) {
        too_far |= found.a != Hit<T>::none && hit.at > found.at;
        take(hit, found);
        if (found.a != Hit<T>::none) bound = found.at;
        return true;
    };
    ASSERT_TRUE(closest(shrink));
    ASSERT_EQ(found, least);
    ASSERT_FALSE(too_far);

    std::vector<std::pair<std::uint32_t, std::uint32_t>> touching, touched;
    for (const auto& [a, box] : one.boxes())
        for (const auto& [b, target] : other.boxes())
            if ((!same || a < b) && overlaps(box, target)) touching.push_back({a, b});
    const auto collect_touching = [&](std::uint32_t a, std::uint32_t b) {
        return touched.push_back({a, b}), true;
    };
    ASSERT_TRUE(same ? one.index.pairs(collect_touching) : one.index.pairs(other.index, collect_touching));
    const std::size_t stop = touching.size() / 2 + 1;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> some;
    const auto stops = [&](std::uint32_t a, std::uint32_t b) {
        some.push_back({a, b});
        return some.size() < stop;
    };
    ASSERT_EQ(same ? one.index.pairs(stops) : one.index.pairs(other.index, stops), touching.empty());
    ASSERT_TRUE(std::equal(some.begin(), some.end(), touched.begin()));
    std::sort(touching.begin(), touching.end());
    std::sort(touched.begin(), touched.end());
    ASSERT_EQ(touched, touching);
}

template <int Dim, class T>
void churn(Kind kind, std::uint64_t seed, std::uint32_t size, InstructionSet set)
{
    SCOPED_TRACE(std::string(twin::name(kind)) + " " + std::to_string(Dim) + (sizeof(T) == 4 ? "f " : "d ") +
                 name(set));
    IndexOptions options;
    options.instruction_set = set;
    Twin<Dim, T> one(kind, seed, options), other(kind, seed + 1000, options),
        small(kind, seed + 2000, options);
    constexpr T infinity = std::numeric_limits<T>::infinity();
    compare<Dim, T>(one, one, infinity);
    one.insert(1);
    small.insert(3);
    compare<Dim, T>(one, one, infinity);
    compare<Dim, T>(one, other, infinity);
    compare<Dim, T>(one, small, infinity);
    one.insert(size);
    other.insert(size / 2);
    for (int round = 0; round < 2; ++round) {
        compare<Dim, T>(one, one, infinity);
        compare<Dim, T>(one, other, infinity);
        compare<Dim, T>(other, one, infinity);
        compare<Dim, T>(one, small, 3);
        compare<Dim, T>(small, one, infinity);
        compare<Dim, T>(one, one, T(0.5));
        compare<Dim, T>(one, other, 0);
        one.erase(size / 3);
        one.move(size / 4);
        other.insert(size / 4);
    }
}

class ClosestPairs : public ::testing::TestWithParam<int>
{
};
TEST_P(ClosestPairs, AreAsDefined)
{
    const Kind kind = static_cast<Kind>(GetParam());
    std::uint64_t seed = 1;
    for (const InstructionSet set : supported_instruction_sets()) {
        churn<3, float>(kind, ++seed, 500, set);
        churn<2, float>(kind, ++seed, 300, set);
        churn<3, double>(kind, ++seed, 300, set);
        churn<2, double>(kind, ++seed, 250, set);
    }
}
INSTANTIATE_TEST_SUITE_P(Scenes, ClosestPairs, ::testing::Range(0, static_cast<int>(Kind::last) + 1),
                         [](const auto& each) {
                             return std::string(twin::name(static_cast<Kind>(each.param)));
                         });

TEST(Pairs, OfAnIndexWithItselfAreItsOwn)
{
    BoxIndex3f index;
    std::vector<Aabb3f> boxes;
    for (int i = 0; i < 100; ++i) {
        const auto x = static_cast<float>(i % 10), y = static_cast<float>(i / 10);
        boxes.push_back({{x, y, 0}, {x + 0.75f + 0.25f * static_cast<float>(i % 3), y + 0.5f, 0}});
    }
    index.build(boxes);
    std::vector<PairHit<float>> own, with_itself;
    const auto into = [](auto& pairs) {
        return [&pairs](std::uint32_t a, std::uint32_t b) { return pairs.push_back({a, b, 0}), true; };
    };
    index.pairs(into(own));
    index.pairs(index, into(with_itself));
    ASSERT_FALSE(own.empty());
    EXPECT_EQ(with_itself, own);
    const auto hits_into = [](auto& pairs) {
        return [&pairs](const PairHit<float>& hit, float&) { return pairs.push_back(hit), true; };
    };
    own.clear(), with_itself.clear();
    index.closest_pairs(hits_into(own), 1);
    index.closest_pairs(index, hits_into(with_itself), 1);
    EXPECT_GT(own.back().at, 0);
    EXPECT_EQ(with_itself, own);
    EXPECT_EQ(index.closest_pair(index), index.closest_pair());
    for (const PairHit<float>& hit : own)
        EXPECT_LT(hit.a, hit.b);
}

TEST(Pairs, AtInfinityAreWhatTheirDefinitionSays)
{
    constexpr float inf = std::numeric_limits<float>::infinity();
    const std::vector<Aabb3f> boxes{{{0, 0, 0}, {inf, 1, 1}},      {{inf, 0, 0}, {inf, 1, 1}},
                                    {{inf, 3, 0}, {inf, 4, 1}},    {{-inf, 3, 0}, {-1, 4, 1}},
                                    {{-inf, 7, 0}, {-inf, 7, 0}},  {{0, 0, 1e-30f}, {1, 1, 1}},
                                    {{-1, 0, -1}, {2, 1, -1e-30f}}};
    for (const InstructionSet set : supported_instruction_sets()) {
        IndexOptions options;
        options.instruction_set = set;
        BoxIndex3f index(options);
        index.build(boxes);
        std::vector<PairHit<float>> got, expected;
        EXPECT_TRUE(
            index.closest_pairs([&](const PairHit<float>& hit, float&) { return got.push_back(hit), true; }));
        for (std::uint32_t a = 0; a < boxes.size(); ++a)
            for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
                expected.push_back({a, b, squared_distance(boxes[a], boxes[b])});
        std::sort(got.begin(), got.end());
        std::sort(expected.begin(), expected.end());
        EXPECT_EQ(got, expected) << name(set);
    }
}

TEST(Pairs, OfOneOrderForAllInstructionSets)
{
    std::vector<std::vector<PairHit<float>>> orders;
    for (const InstructionSet set : supported_instruction_sets()) {
        IndexOptions options;
        options.instruction_set = set;
        Twin<3, float> one(Kind::power_law, 3, options);
        one.insert(5000);
        one.move(300);
        std::vector<PairHit<float>> order;
        one.index.closest_pairs([&](const PairHit<float>& hit, float&) {
            order.push_back(hit);
            return order.size() < 40'000;
        });
        one.index.pairs([&](std::uint32_t a, std::uint32_t b) { return order.push_back({a, b}), true; });
        orders.push_back(order);
    }
    EXPECT_GT(orders[0].size(), 40'000u);
    for (const auto& order : orders)
        EXPECT_EQ(order, orders[0]);
}

TEST(Pairs, EndWithWhatTheVisitorThrowsAndAskInside)
{
    BoxIndex2f index;
    std::vector<Aabb2f> row;
    for (int i = 0; i < 200; ++i)
        row.push_back({{float(2 * i), 0}, {float(2 * i + 1 + i % 2), 1}});
    index.build(row);
    int calls = 0;
    const auto fails = [&](auto&&...) -> bool {
        if (++calls % 150 == 0) throw std::runtime_error("enough");
        return true;
    };
    EXPECT_THROW(index.closest_pairs(fails), std::runtime_error);
    calls = 100;
    EXPECT_THROW(index.pairs(fails), std::runtime_error);
    std::size_t outer = 0, inner = 0;
    const auto count_inner = [&](const PairHit<float>& hit, float& bound) {
        if (outer > 110) bound = hit.at;
        if (outer++ % 64 == 0)
            index.closest_pairs([&](const PairHit<float>&, float&) { return ++inner, true; }, 1.5f);
        return true;
    };
    index.closest_pairs(count_inner);
    EXPECT_EQ(outer, 199u) << "99 that touch, and all that are as far as the first of the others";
    EXPECT_EQ(inner, 199u * 4);
    try {
        (void)index.closest_pair(-1);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(), "closest pairs: max_distance is -1; it must be 0 or more");
    }
}

} // namespace
