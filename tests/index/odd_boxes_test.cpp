// SPDX-License-Identifier: MIT
// An index that ignores odd boxes answers as one of the others' boxes does, and knows the odd ones by id.
// Joins that hand over pair by pair.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <map>
#include <new>

#include "jostle/box_index.hpp"
#include "tests/index/twin.hpp"
#include "tests/odd_box.hpp"

namespace {

using namespace jostle;

template <int Dim, class T>
Aabb<Dim, T> random_odd_box(twin::Random& random)
{
    Aabb<Dim, T> box = twin::random_box<Dim, T>(random, twin::Kind::uniform);
    make_odd(box, random.below(1000));
    return box;
}

/// Memory of which no more is given from a certain allocation on.
class ScarceMemory : public std::pmr::memory_resource
{
  public:
    long left = std::numeric_limits<long>::max();

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        if (left-- <= 0) throw std::bad_alloc();
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override
    {
        std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
    }
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override
    {
        return this == &other;
    }
};

template <int Dim, class T>
class Churn
{
  public:
    using Box = Aabb<Dim, T>;

    explicit Churn(std::uint64_t seed) : random_(seed), index_({.memory = &memory_, .ignore_odd_boxes = true})
    {
    }

    void step()
    {
        const std::uint32_t what = random_.below(20);
        std::vector<std::uint32_t> ids;
        std::vector<Box> boxes;
        if (what == 0) {
            now_.clear();
            const std::uint32_t count = random_.below(400);
            for (std::uint32_t i = 0; i < count; ++i)
                boxes.push_back(some_box());
            for (std::uint32_t i = 0; i < count; ++i)
                now_[random_.below(2) == 0 ? 2 * i : 2 * i + 1] = boxes[i];
            for (const auto& [id, box] : now_)
                ids.push_back(id);
            index_.build(ids, boxes);
        } else if (what < 8) {
            for (std::uint32_t k = random_.below(60); k > 0; --k) {
                const std::uint32_t id = random_.below(1000);
                if (now_.count(id) != 0) continue;
                ids.push_back(id);
                boxes.push_back(now_[id] = some_box());
            }
            index_.insert(ids, boxes);
        } else {
            std::map<std::uint32_t, Box> after = now_;
            const std::uint32_t share = 1 + random_.below(30); // about one of so many
            for (const auto& [id, box] : now_)
                if (random_.below(share) == 0) ids.push_back(id);
            for (std::size_t i = ids.size(); i > 1; --i)
                std::swap(ids[i - 1], ids[random_.below(static_cast<std::uint32_t>(i))]);
            for (const std::uint32_t id : ids)
                if (what < 12)
                    after.erase(id);
                else
                    boxes.push_back(after[id] = some_box());
            const auto change = [&] { what < 12 ? index_.erase(ids) : index_.move(ids, boxes); };
            memory_.left = random_.below(
                random_.below(2) == 0 ? 20 : 150); // perhaps too few allocations; then nothing changes
            try {
                change();
            } catch (const std::bad_alloc&) {
                ++failures;
                memory_.left = std::numeric_limits<long>::max();
                check();
                if (testing::Test::HasFatalFailure()) return;
                change();
            }
            memory_.left = std::numeric_limits<long>::max();
            now_ = after;
        }
        check();
    }

    std::size_t failures = 0, odd = 0;

  private:
    Box some_box()
    {
        return random_.below(4) == 0 ? random_odd_box<Dim, T>(random_)
                                     : twin::random_box<Dim, T>(random_, twin::Kind::uniform);
    }
    static bool is_odd(const Box& box)
    {
        for (int d = 0; d < Dim; ++d)
            if (!(box.lo[d] <= box.hi[d])) return true;
        return false;
    }

    void check()
    {
        BoxIndex<Dim, T> good; // of the valid ones alone
        std::vector<std::uint32_t> ids;
        std::vector<Box> boxes;
        std::optional<Box> hull;
        for (const auto& [id, box] : now_) {
            ASSERT_TRUE(index_.contains(id));
            const Box known = index_.box(id);
            ASSERT_EQ(std::memcmp(&known, &box, sizeof box), 0);
            if (is_odd(box)) continue;
            ids.push_back(id);
            boxes.push_back(box);
            if (!hull) hull = box;
            for (int d = 0; d < Dim; ++d) {
                hull->lo[d] = std::min(hull->lo[d], box.lo[d]);
                hull->hi[d] = std::max(hull->hi[d], box.hi[d]);
            }
        }
        good.build(ids, boxes);
        ASSERT_EQ(index_.size(), now_.size());
        ASSERT_EQ(index_.stats().objects, now_.size());
        ASSERT_EQ(index_.stats().odd, now_.size() - ids.size());
        for (const std::optional<Box>& bounds : {index_.bounds(), good.bounds()}) {
            ASSERT_EQ(bounds.has_value(), hull.has_value());
            ASSERT_TRUE(!hull || (bounds->lo == hull->lo && bounds->hi == hull->hi));
        }
        odd += now_.size() - ids.size();

        const T end = std::numeric_limits<T>::infinity();
        Vec<Dim, T> onward{};
        onward[0] = 1;
        Box all;
        std::fill(all.lo.begin(), all.lo.end(), -end);
        std::fill(all.hi.begin(), all.hi.end(), end);
        std::vector<std::uint32_t> found, expected;
        for (const Box& region : {all, some_box(), some_box()}) {
            index_.all(region, found);
            if (is_odd(region)) {
                ASSERT_TRUE(found.empty());
                ASSERT_FALSE(index_.any(region));
                ASSERT_EQ(index_.count(Sweep<Dim, T>{region, onward}), 0u);
                continue;
            }
            good.all(region, expected);
            ASSERT_EQ(found, expected);
            if (region.lo[0] == -end) continue;
            std::vector<Hit<T>> near, expected_near;
            index_.nearest(NearestToBox<Dim, T>{region, 9}, near);
            good.nearest(NearestToBox<Dim, T>{region, 9}, expected_near);
            ASSERT_EQ(near, expected_near);
            // A sweep that doesn't move is what touches the box.
            index_.all(Sweep<Dim, T>{region, {}}, near);
            ASSERT_EQ(near.size(), found.size());
            for (std::size_t i = 0; i < near.size(); ++i)
                ASSERT_EQ(near[i], (Hit<T>{found[i], 0}));
        }
        std::vector<Box> batch;
        for (int k = 0; k < 20; ++k)
            batch.push_back(some_box());
        std::pmr::vector<Pair> pairs, expected_pairs;
        index_.join(batch, pairs);
        for (std::uint32_t a = 0; a < batch.size(); ++a)
            for (const auto& [id, box] : now_)
                if (!is_odd(batch[a]) && !is_odd(box) && overlaps(batch[a], box))
                    expected_pairs.push_back({a, id});
        ASSERT_EQ(pairs, expected_pairs);
        pairs.clear();
        ASSERT_TRUE(index_.join(batch, [&](std::uint32_t a, std::uint32_t b) {
            pairs.push_back({a, b});
            return true;
        }));
        ASSERT_TRUE(std::is_sorted(pairs.begin(), pairs.end(),
                                   [](const Pair& x, const Pair& y) { return x.a < y.a; }));
        std::sort(pairs.begin(), pairs.end());
        ASSERT_EQ(pairs, expected_pairs);
    }

    ScarceMemory memory_;
    twin::Random random_;
    BoxIndex<Dim, T> index_;
    std::map<std::uint32_t, Box> now_;
};

template <int Dim, class T>
void churn(std::uint64_t seed)
{
    Churn<Dim, T> churn(seed);
    for (int k = 0; k < 600; ++k) {
        churn.step();
        if (testing::Test::HasFatalFailure()) FAIL() << "seed " << seed << ", step " << k;
    }
    EXPECT_GT(churn.failures, 30u);
    EXPECT_GT(churn.odd, 1000u);
}

TEST(OddBoxes, AreInTheIndexAndFoundByNothing)
{
    churn<3, float>(1);
    churn<2, double>(2);
    churn<3, double>(3);
    churn<2, float>(4);
}

/// At every allocation of a call in which most objects move, some leave the tree and some come into it.
TEST(OddBoxes, AMoveThatFailsAnywhereChangesNothing)
{
    twin::Random random(7);
    std::vector<Aabb3f> before, after;
    std::vector<std::uint32_t> ids;
    for (std::uint32_t i = 0; i < 2000; ++i) {
        ids.push_back(i);
        before.push_back(twin::random_box<3, float>(random, twin::Kind::uniform));
        after.push_back(twin::random_box<3, float>(random, twin::Kind::uniform));
        if (i % 10 < 2) make_odd(before.back(), i);
        if (i % 10 == 1 || i % 10 == 2) make_odd(after.back(), i);
    }
    const auto same = [](const Aabb3f& a, const Aabb3f& b) { return std::memcmp(&a, &b, sizeof a) == 0; };
    std::size_t failures = 0;
    for (bool done = false; !done; ++failures) {
        ScarceMemory memory;
        BoxIndex3f index({.memory = &memory, .ignore_odd_boxes = true});
        index.build(before);
        const Aabb3f all = *index.bounds();
        memory.left = static_cast<long>(failures);
        try {
            index.move(ids, after);
            done = true;
        } catch (const std::bad_alloc&) {
        }
        memory.left = std::numeric_limits<long>::max();
        const std::vector<Aabb3f>& now = done ? after : before;
        ASSERT_EQ(index.size(), 2000u);
        ASSERT_EQ(index.stats().odd, 400u);
        ASSERT_EQ(index.count(done ? *index.bounds() : all), 1600u) << failures;
        for (const std::uint32_t i : ids)
            ASSERT_TRUE(same(index.box(i), now[i])) << "object " << i << " after " << failures;
    }
    EXPECT_GT(failures, 20u);
}

TEST(OddBoxes, AreRefusedUnlessTheyAreToBeIgnored)
{
    twin::Random random(5);
    BoxIndex3f index;
    const std::vector<Aabb3f> boxes{{{0, 0, 0}, {1, 1, 1}}};
    index.build(boxes);
    EXPECT_TRUE(index.bounds());
    for (int k = 0; k < 20; ++k) {
        const std::vector<Aabb3f> odd{random_odd_box<3, float>(random)};
        const std::vector<std::uint32_t> id{7}, there{0};
        std::pmr::vector<Pair> pairs;
        EXPECT_THROW(index.build(odd), Error);
        EXPECT_THROW(index.insert(id, odd), Error);
        EXPECT_THROW(index.move(there, odd), Error);
        EXPECT_THROW(index.join(odd, pairs), Error);
        EXPECT_THROW(index.join(odd, [](std::uint32_t, std::uint32_t) { return true; }), Error);
        EXPECT_THROW((void)index.any(odd[0]), Error);
    }
    EXPECT_EQ(index.size(), 1u);
    index.clear();
    EXPECT_FALSE(index.bounds());
}

/// In every form, with a filter for all boxes and one for each.
TEST(Join, WithFilters)
{
    twin::Random random(6);
    std::vector<Aabb3f> boxes, batch;
    for (int i = 0; i < 2000; ++i)
        boxes.push_back(twin::random_box<3, float>(random, twin::Kind::lattice));
    for (int i = 0; i < 300; ++i)
        batch.push_back(twin::random_box<3, float>(random, twin::Kind::lattice));
    std::vector<std::uint32_t> owner(boxes.size());
    for (std::uint32_t& each : owner)
        each = random.below(3);
    BoxIndex3f index;
    index.build(boxes);
    std::vector<QueryFilter> filters(batch.size());
    for (std::uint32_t a = 0; a < batch.size(); ++a) {
        filters[a].owner = owner;
        filters[a].asker_owner = a % 3;
        filters[a].exclude = 11 * a % 2000;
    }
    const auto accept = [](std::uint32_t question, std::uint32_t id) { return (question + id) % 5 != 0; };
    filters[1].accept = accept;
    const auto expect = [&](const auto& given, const auto& wanted) {
        std::pmr::vector<Pair> expected, found(3), told;
        for (std::uint32_t a = 0; a < batch.size(); ++a)
            for (std::uint32_t b = 0; b < boxes.size(); ++b)
                if (overlaps(batch[a], boxes[b]) && wanted(a, b)) expected.push_back({a, b});
        EXPECT_GT(expected.size(), 500u);
        index.join(batch, found, given);
        EXPECT_EQ(found, expected);
        EXPECT_TRUE(index.join(
            batch,
            [&](std::uint32_t a, std::uint32_t b) {
                told.push_back({a, b});
                return true;
            },
            given));
        std::sort(told.begin(), told.end());
        EXPECT_EQ(told, expected);
        std::size_t calls = 0;
        EXPECT_FALSE(index.join(batch, [&](std::uint32_t, std::uint32_t) { return ++calls < 100; }, given));
        EXPECT_EQ(calls, 100u);
    };
    QueryFilter for_all;
    for_all.accept = accept;
    expect(for_all, accept);
    expect(filters, [&](std::uint32_t a, std::uint32_t b) {
        return owner[b] != a % 3 && b != 11 * a % 2000 && (a != 1 || accept(a, b));
    });
    std::pmr::vector<Pair> pairs(3);
    EXPECT_THROW(index.join(batch, pairs, std::span<const QueryFilter>(filters).first(7)), Error);
    EXPECT_TRUE(pairs.empty());
}

} // namespace
