// SPDX-License-Identifier: MIT
// The order along space against the keys of an index: sorted by these, no box comes far from where it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "index/tree/key_order.hpp"
#include "jostle/executor.hpp"
#include "jostle/spatial_order.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/contract/scenes_for_tests.hpp"

namespace {

using namespace jostle;
using contract::refusal;

template <int Dim, class T>
std::vector<std::uint32_t> order_of(const std::vector<Aabb<Dim, T>>& boxes, const FinderOptions& options = {})
{
    std::vector<std::uint32_t> order(boxes.size());
    spatial_order(box_view(boxes), order, options);
    return order;
}

/// The order by whole keys, which no two boxes share: the class of size, the digits of the centre, the
/// position.
template <int Dim, class T>
std::vector<std::uint32_t> order_by_keys(const std::vector<Aabb<Dim, T>>& boxes)
{
    const auto frame = index::choose_frame(box_view(boxes));
    std::vector<index::Key<Dim>> keys;
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
        keys.push_back(index::key_of(frame, boxes[i], i));
    std::vector<std::uint32_t> order(boxes.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        if (a == b) return false;
        const int digit = index::first_difference(keys[a], keys[b]);
        return index::digit_of(keys[a], digit) < index::digit_of(keys[b], digit);
    });
    return order;
}

template <int Dim, class T>
void check_scenes(std::size_t n)
{
    const auto three = make_thread_executor(3);
    for (const contract::Scene scene : contract::all_scenes()) {
        SCOPED_TRACE(contract::name(scene));
        const std::vector<Aabb<Dim, T>> boxes = contract::make_scene<Dim, T>(scene, n, 7);
        const std::vector<std::uint32_t> order = order_of(boxes, {.executor = &serial_executor()});
        EXPECT_EQ(order, order_of(boxes, {.executor = three.get()}));
        const std::vector<std::uint32_t> right = order_by_keys(boxes);
        std::vector<std::size_t> place(boxes.size(), boxes.size());
        for (std::size_t k = 0; k < order.size(); ++k) {
            ASSERT_LT(order[k], boxes.size());
            ASSERT_EQ(place[order[k]], boxes.size()) << "box " << order[k] << " comes twice";
            place[order[k]] = k;
        }
        for (std::size_t k = 0; k < right.size(); ++k)
            ASSERT_LT(std::abs(static_cast<long>(place[right[k]]) - static_cast<long>(k)), 64)
                << "box " << right[k];
    }
}

TEST(SpatialOrder, IsThatOfWholeKeysButForAFewNeighbours)
{
    for (const std::size_t n : {std::size_t{1}, std::size_t{65}, std::size_t{3000}}) {
        check_scenes<2, float>(n);
        check_scenes<2, double>(n);
        check_scenes<3, float>(n);
        check_scenes<3, double>(n);
    }
    check_scenes<3, float>(40'000);
}

TEST(SpatialOrder, NeighboursComeNearEachOther)
{
    const std::vector<Aabb3f> boxes = contract::make_scene<3, float>(contract::Scene::uniform, 20'000, 1);
    const auto walk = [&](const std::vector<std::uint32_t>& order) {
        double length = 0;
        for (std::size_t k = 1; k < order.size(); ++k)
            for (int d = 0; d < 3; ++d)
                length += std::abs(boxes[order[k]].lo[d] - boxes[order[k - 1]].lo[d]);
        return length;
    };
    std::vector<std::uint32_t> as_given(boxes.size());
    std::iota(as_given.begin(), as_given.end(), 0u);
    EXPECT_LT(walk(order_of(boxes)), 0.15 * walk(as_given));
}

TEST(SpatialOrder, BoxesInOnePlaceKeepTheirOrder)
{
    const std::vector<Aabb3f> boxes(1000, {{1, 2, 3}, {2, 3, 4}});
    const std::vector<std::uint32_t> order = order_of(boxes);
    EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
    EXPECT_TRUE(order_of(std::vector<Aabb3f>{}).empty());
}

TEST(SpatialOrder, RefusesBadBoxesAndWritesNothing)
{
    std::vector<Aabb3f> boxes(5, {{0, 0, 0}, {1, 1, 1}});
    std::vector<std::uint32_t> order(5, 77), short_order(4);
    const auto sort = [&](std::vector<std::uint32_t>& to) {
        return [&] {
            spatial_order(box_view(boxes), to);
            return 0;
        };
    };
    EXPECT_EQ(refusal(ErrorCode::size_mismatch, sort(short_order)),
              "there are 5 boxes and room for 4 positions; give one for each");
    boxes[3].hi[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(refusal(ErrorCode::nan_coordinate, sort(order)).find("box 3"), std::string::npos);
    boxes[3].hi[1] = -1;
    EXPECT_NE(refusal(ErrorCode::inverted_box, sort(order)).find("box 3"), std::string::npos);
    EXPECT_EQ(order, std::vector<std::uint32_t>(5, 77));
}

TEST(ApplyOrder, PutsArraysOfAllKindsInOrder)
{
    const std::size_t n = 10'000;
    std::vector<std::uint32_t> order(n);
    for (std::uint32_t k = 0; k < n; ++k)
        order[k] = static_cast<std::uint32_t>((std::uint64_t{k} * 7919) % n);
    std::vector<std::uint32_t> numbers(n);
    std::iota(numbers.begin(), numbers.end(), 0u);
    std::vector<std::unique_ptr<std::string>> owned;
    for (std::size_t i = 0; i < n; ++i)
        owned.push_back(std::make_unique<std::string>(std::to_string(i)));
    std::vector<double> more(n + 5);
    std::iota(more.begin(), more.end(), 0.5);
    apply_order(order, numbers, owned, std::span(more).first(n));
    EXPECT_EQ(numbers, order);
    for (std::size_t k = 0; k < n; ++k) {
        ASSERT_EQ(*owned[k], std::to_string(order[k]));
        ASSERT_EQ(more[k], order[k] + 0.5);
    }
    EXPECT_EQ(more[n], static_cast<double>(n) + 0.5);
    std::array<int, 0> nothing{};
    apply_order({}, nothing);
    // On the executor that it is told, which here counts.
    struct Counting : Executor
    {
        [[nodiscard]] std::uint32_t concurrency() const noexcept override { return 2; }
        void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
        {
            ++runs;
            for (std::uint32_t i = 0; i < count; ++i)
                task(i);
        }
        int runs = 0;
    } counting;
    std::vector<std::uint32_t> many(20'000), backwards(20'000);
    for (std::uint32_t i = 0; i < 20'000; ++i)
        many[i] = i, backwards[i] = 19'999 - i;
    apply_order(counting, backwards, many);
    EXPECT_EQ(many, backwards);
    EXPECT_EQ(counting.runs, 2);
}

TEST(ApplyOrder, RefusesWhatIsNoOrderAndMovesNothing)
{
    std::vector<int> a{10, 11, 12}, b{20, 21};
    const auto apply = [&](std::vector<std::uint32_t> order, auto&... arrays) {
        return [&, order] {
            apply_order(order, arrays...);
            return 0;
        };
    };
    EXPECT_EQ(refusal(ErrorCode::size_mismatch, apply({2, 1, 0}, a, b)),
              "array 1 has 2 elements, and the order 3; give one for each");
    EXPECT_EQ(refusal(ErrorCode::invalid_argument, apply({2, 3, 0}, a)),
              "order[1] is 3, but there are 3 elements; it must have every position once");
    EXPECT_EQ(refusal(ErrorCode::invalid_argument, apply({2, 0, 2}, a)),
              "order[2] is 2, which came before; it must have every position once");
    EXPECT_EQ(a, (std::vector<int>{10, 11, 12}));
}

} // namespace
