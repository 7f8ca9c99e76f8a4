// SPDX-License-Identifier: MIT
// What a visitor may do: ask again, throw, run on many threads; and what a visit costs. That visitors get the
// right objects in the right order is seen beside every other question, in twin.hpp.
#include <gtest/gtest.h>

#include "tests/global_new.hpp"
//
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <limits>
#include <memory_resource>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "jostle/box_index.hpp"
#include "tests/contract/error_of.hpp"
#include "twin.hpp"

namespace {

using namespace jostle;
using contract::refusal;

constexpr Ray3f along_x{{-1, 0.5f, 0.5f}, {1, 0, 0}};

/// Boxes side by side along x.
std::vector<Aabb3f> row(int count)
{
    std::vector<Aabb3f> boxes;
    for (int i = 0; i < count; ++i)
        boxes.push_back({{float(2 * i), 0, 0}, {float(2 * i + 1), 1, 1}});
    return boxes;
}

TEST(Visits, ClosestShapeMayLieInAFurtherBox)
{
    BoxIndex3f index;
    index.build(row(100));
    std::vector<std::uint32_t> seen;
    // Shapes fill the end of their boxes, and that of box 0 isn't met.
    const auto nearest_shape = [&](const Hit<float>& hit, float& bound) {
        EXPECT_EQ(bound, seen.size() < 2 ? std::numeric_limits<float>::infinity() : 3.75f);
        seen.push_back(hit.id);
        if (hit.id != 0) bound = std::min(bound, hit.at + 0.75f);
        return true;
    };
    EXPECT_TRUE(index.visit(along_x, nearest_shape));
    EXPECT_EQ(seen, (std::vector<std::uint32_t>{0, 1}));
    // As near as the bound still counts.
    seen.clear();
    EXPECT_TRUE(index.visit(along_x, [&](const Hit<float>& hit, float& bound) {
        seen.push_back(hit.id);
        bound = 5;
        return true;
    }));
    EXPECT_EQ(seen, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(Visits, NearestToABoxGoOutwardsAndEndWithTheirCount)
{
    BoxIndex3f index;
    index.build(row(100));
    const Aabb3f from{{20.5f, 0, 0}, {22.25f, 1, 1}};
    EXPECT_EQ(squared_distance(from, Aabb3f{{0, 3, 0}, {17.5f, 4, 1}}), 13.0f);
    std::vector<Hit<float>> seen;
    const auto collect = [&](const Hit<float>& hit, float&) { return seen.push_back(hit), true; };
    EXPECT_TRUE(index.visit(NearestToBox3f{from, 4}, collect));
    EXPECT_EQ(seen, (std::vector<Hit<float>>{{10, 0}, {11, 0}, {9, 2.25f}, {12, 3.0625f}}));
    seen.clear();
    EXPECT_TRUE(index.visit(NearestToBox3f{from, 0}, collect));
    EXPECT_TRUE(seen.empty());
    EXPECT_TRUE(index.visit(NearestToBox3f{from, 9, 1.5f}, collect));
    EXPECT_EQ(seen, (std::vector<Hit<float>>{{10, 0}, {11, 0}, {9, 2.25f}}));
}

TEST(Visits, RefuseWhatIsNoNumber)
{
    BoxIndex3f index;
    index.build(row(9));
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    inf = std::numeric_limits<float>::infinity();
    int calls = 0;
    EXPECT_EQ(refusal(ErrorCode::nan_coordinate,
                      [&] {
                          index.visit(along_x, [&](const Hit<float>& hit, float& bound) {
                              if (hit.id == 3) bound = nan;
                              return ++calls < 9;
                          });
                      }),
              "the visitor of object 3 has made the bound NaN; it must be a number");
    EXPECT_EQ(calls, 4);
    const auto none = [](const Hit<float>&, float&) { return ADD_FAILURE(), true; };
    EXPECT_EQ(
        refusal(ErrorCode::inverted_box, [&] { index.visit(NearestToBox3f{{{0, 0, 0}, {-1, 1, 1}}}, none); }),
        "nearest: lo.x = 0 is greater than hi.x = -1; swap them or drop the query");
    EXPECT_EQ(refusal(ErrorCode::invalid_argument,
                      [&] { index.visit(NearestToBox3f{{{0, 0, 0}, {1, inf, 1}}}, none); }),
              "nearest: box.hi.y is inf; it must be a finite number");
    EXPECT_EQ(refusal(ErrorCode::nan_coordinate, [&] { index.visit(Ray3f{{0, 0, 0}, {nan, 0, 0}}, none); }),
              "ray: direction.x is nan; it must be a finite number");
    EXPECT_TRUE(BoxIndex3f().visit(along_x, none));
    EXPECT_TRUE(BoxIndex3f().visit(Aabb3f{}, [](std::uint32_t) { return ADD_FAILURE(), true; }));
}

TEST(Visits, EndWithWhatTheVisitorThrows)
{
    BoxIndex3f index;
    index.build(row(100));
    const auto third = [](auto&&...) -> bool {
        static int calls = 0;
        if (++calls % 3 == 0) throw std::runtime_error("third");
        return true;
    };
    for (int round = 0; round < 5; ++round) {
        EXPECT_THROW(index.visit(along_x, third), std::runtime_error);
        EXPECT_THROW(index.visit(NearestToBox3f{row(1)[0], 9}, third), std::runtime_error);
        EXPECT_THROW(index.visit(Aabb3f{{0, 0, 0}, {99, 1, 1}}, third), std::runtime_error);
        EXPECT_EQ(index.count(along_x), 100u);
    }
}

/// Whatever changes an index, from inside a callback of a question: each is refused, and changes nothing.
void change_in_all_ways(BoxIndex3f& index)
{
    EXPECT_FALSE(index.visit(along_x, [](const Hit<float>&, float&) { return false; })) << "it may be asked";
    const std::vector<Aabb3f> boxes = row(100);
    const std::string expected = "this BoxIndex is answering a query, which runs this callback or was called "
                                 "by another thread; change "
                                 "it afterwards";
    const auto refuses = [&](auto&& change) {
        EXPECT_EQ(refusal(ErrorCode::invalid_argument, change), expected);
    };
    refuses([&] { index.build(boxes); });
    refuses([&] { index.build(std::vector<std::uint32_t>(100, 5), boxes); });
    refuses([&] { index.insert(500, boxes[0]); });
    refuses([&] { index.move(0, boxes[1]); });
    refuses([&] { index.erase(0); });
    refuses([&] { index.clear(); });
    refuses([&] { index.release_memory(); });
    EXPECT_EQ(index.count(along_x), 100u);
}

TEST(Visits, MayNotChangeTheIndex)
{
    BoxIndex3f index, other;
    index.build(row(100));
    other.build(row(100));
    std::atomic<int> calls{0};
    const auto misuse = [&] {
        ++calls;
        change_in_all_ways(index);
        return false;
    };
    const auto of_object = [&](std::uint32_t) { return misuse(); };
    const auto of_pair = [&](std::uint32_t, std::uint32_t) { return misuse(); };
    const auto of_hit = [&](const Hit<float>&, float&) { return misuse(); };
    const auto of_pair_hit = [&](const PairHit<float>&, float&) { return misuse(); };
    const std::vector<Aabb3f> some = row(3);
    EXPECT_FALSE(index.visit(along_x, of_hit));
    EXPECT_FALSE(index.visit(NearestToBox3f{row(1)[0], 9}, of_hit));
    EXPECT_FALSE(index.visit(some[0], of_object));
    EXPECT_FALSE(index.join(some, of_pair));
    EXPECT_FALSE(index.join(some, of_pair, std::vector<QueryFilter>(3)));
    EXPECT_FALSE(index.pairs(other, of_pair));
    EXPECT_FALSE(other.pairs(index, of_pair)) << "two are asked: neither may change";
    EXPECT_FALSE(index.closest_pairs(of_pair_hit));
    EXPECT_FALSE(other.closest_pairs(index, of_pair_hit));
    EXPECT_EQ(calls, 9);

    const auto elsewhere = [&](std::uint32_t) {
        std::thread([&] { change_in_all_ways(index); }).join();
        return false;
    };
    EXPECT_FALSE(index.visit(some[0], elsewhere)) << "nor may another thread change it meanwhile";

    calls = 0;
    QueryFilter filter;
    filter.accept = of_pair;
    std::vector<std::uint32_t> ids;
    std::pmr::vector<Pair> pairs;
    ResultLists<std::uint32_t> lists;
    index.all(some[0], ids, filter);
    EXPECT_FALSE(index.any(some[0], filter));
    index.all(std::vector<Aabb3f>(200, some[0]), lists, filter); // on several threads
    index.join(some, pairs, filter);
    EXPECT_GE(calls, 203);

    // Inside another index's question, and after all of them.
    other.visit(along_x, [&](const Hit<float>& hit, float&) {
        index.move(hit.id, row(100)[hit.id]);
        index.visit(some[0], of_object);
        return hit.id < 3;
    });
    const auto third = [](auto&&...) -> bool { throw std::runtime_error("third"); };
    EXPECT_THROW(index.visit(along_x, third), std::runtime_error);
    index.erase(0);
    EXPECT_EQ(index.size(), 99u);
}

/// In one place, so that nothing can be handed over before all is opened.
std::vector<Aabb3f> heap(std::size_t count)
{
    return std::vector<Aabb3f>(count, Aabb3f{{0, 0, 0}, {1, 1, 1}});
}

TEST(Visits, InsideVisitsAndOnManyThreads)
{
    constexpr std::uint32_t count = 3000;
    BoxIndex3f index;
    index.build(heap(count));
    const auto ask = [&](std::uint32_t stop) {
        std::uint32_t next = 0;
        bool good = true;
        const auto inner = [&] {
            std::uint32_t expected = 0;
            index.visit(Nearest3f{{2, 2, 2}, 50}, [&](const Hit<float>& hit, float&) {
                good &= hit.id == expected++ && hit.at == 3;
                return true;
            });
            good &= expected == 50;
        };
        index.visit(along_x, [&](const Hit<float>& hit, float&) {
            good &= hit.id == next++ && hit.at == 1;
            if (next % 512 == 1) inner();
            return next < stop;
        });
        return good && next == std::min(stop, count);
    };
    std::atomic<int> wrong{0};
    std::vector<std::thread> askers;
    for (std::uint32_t t = 0; t < 4; ++t)
        askers.emplace_back([&, t] {
            for (std::uint32_t k = 1; k < 10; ++k)
                wrong += !ask(t * k * k * 40 + 1);
        });
    for (std::thread& asker : askers)
        asker.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_TRUE(ask(count + 1));
    const std::uint64_t held = index.stats().bytes;
    index.release_memory();
    EXPECT_LT(index.stats().bytes, held);
    EXPECT_TRUE(ask(count + 1));
}

#if JOSTLE_OWN_NEW
TEST(Visits, AllocateNothing)
{
    BoxIndex3f index;
    index.build(heap(3000));
    std::uint64_t seen = 0;
    const auto visit_all = [&] {
        index.visit(along_x, [&](const Hit<float>&, float&) { return ++seen, true; });
        index.visit(Nearest3f{{2, 2, 2}, 4000}, [&](const Hit<float>&, float&) { return ++seen, true; });
        index.visit(Sphere3f{{0, 0, 0}, 1}, [&](std::uint32_t) { return ++seen, true; });
    };
    visit_all();
    const std::uint64_t before = global_new::calls;
    for (int round = 0; round < 3; ++round)
        visit_all();
    EXPECT_EQ(global_new::calls, before);
    EXPECT_EQ(seen, 4 * 3 * 3000u);

    // Where memory runs out, a visit is as if it hadn't been.
    BoxIndex3f starved;
    starved.build(heap(3000));
    for (std::uint64_t k = 0;; ++k) {
        ASSERT_LT(k, 100u);
        seen = 0;
        global_new::fail_at = global_new::calls + k;
        bool failed = false;
        try {
            starved.visit(along_x, [&](const Hit<float>&, float&) { return ++seen, true; });
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        global_new::fail_at = global_new::never;
        EXPECT_EQ(seen, failed ? 0u : 3000u);
        if (failed) continue;
        EXPECT_GT(k, 2u);
        break;
    }
}

TEST(Batches, TakeMemoryFromTheirListsResourceAlone)
{
    BoxIndex3f index({.executor = &serial_executor()});
    index.build(row(1000));
    const std::vector<Ray3f> rays(200, along_x);
    const auto run_one_by_one = [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t),
                                   void* context) {
        for (std::uint32_t i = 0; i < count; ++i)
            task(context, i);
    };
    CallbackExecutor four(4, nullptr, run_one_by_one);
    BoxIndex3f by_four({.executor = &four});
    by_four.build(row(1000));
    std::vector<std::byte> bytes(std::size_t{1} << 25);
    std::pmr::monotonic_buffer_resource own(bytes.data(), bytes.size(), std::pmr::null_memory_resource());
    ResultLists<Hit<float>> lists, lists_of_four(&own);
    index.all(rays, lists, {}, 9);
    by_four.all(rays, lists_of_four, {}, 9);
    const std::uint64_t before = global_new::calls;
    for (int round = 0; round < 3; ++round) {
        index.all(rays, lists, {}, 9); // in what the lists had before
        by_four.all(rays, lists_of_four, {}, 9);
    }
    EXPECT_EQ(global_new::calls, before);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(lists[i].size(), 9u);
        EXPECT_TRUE(std::ranges::equal(lists[i], lists_of_four[i]));
        EXPECT_TRUE(lists.more(i) && lists_of_four.more(i));
    }
}
#endif

// Regions have no order but the index's own: it is the same wherever it runs.
TEST(Visits, OfRegionsHaveOneOrderForAllInstructionSets)
{
    std::vector<std::vector<std::uint32_t>> orders;
    for (const InstructionSet set : supported_instruction_sets())
        for (const std::uint32_t threads : {1u, 3u}) {
            const auto executor = make_thread_executor(threads);
            IndexOptions options;
            options.executor = executor.get();
            options.instruction_set = set;
            twin::Twin<3, float> pair(twin::Kind::power_law, 5, options);
            pair.insert(20'000);
            pair.move(900);
            pair.erase(3000);
            std::vector<std::uint32_t> order;
            const std::vector<Plane3f> planes{{{1, 0.5f, 0}, -3}, {{-1, 0, 0.25f}, 20}};
            const auto collect = [&](std::uint32_t id) { return order.push_back(id), true; };
            pair.index.visit(Aabb3f{{3, 3, 3}, {25, 20, 22}}, collect);
            pair.index.visit(Sphere3f{{15, 10, 12}, 9}, collect);
            pair.index.visit(Frustum3f{planes}, collect);
            orders.push_back(order);
        }
    EXPECT_GT(orders[0].size(), 5000u);
    for (const auto& order : orders)
        EXPECT_EQ(order, orders[0]);
}

} // namespace
