// SPDX-License-Identifier: MIT
#include "jostle/periodic.hpp"

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/error.hpp"
#include "jostle/world.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/contract/harness.hpp"

namespace {

using contract::Boxes;
using contract::for_each_kind;
using contract::Random;
using jostle::Aabb;
using jostle::Filter;
using jostle::Pair;
using jostle::PeriodicImages;
using jostle::Vec;

// --- The definition: every box against every other, shifted by every number of periods ---

template <class T>
T sum_rounded(T a, T b, int direction)
{
    volatile T x = a, y = b;
    const int before = std::fegetround();
    std::fesetround(direction);
    volatile T sum = x + y;
    std::fesetround(before);
    return sum;
}

template <class T>
bool wall(T lo, T hi)
{
    return lo == -std::numeric_limits<T>::infinity() && hi == std::numeric_limits<T>::infinity();
}

template <int Dim, class T>
Aabb<Dim, T> shifted(Aabb<Dim, T> box, const Vec<Dim, T>& by)
{
    for (int d = 0; d < Dim; ++d)
        if (by[d] != 0 && !wall(box.lo[d], box.hi[d])) {
            box.lo[d] = sum_rounded(box.lo[d], by[d], FE_DOWNWARD);
            box.hi[d] = sum_rounded(box.hi[d], by[d], FE_UPWARD);
        }
    return box;
}

/// All shifts by up to `most` periods of which the first that isn't 0 is downwards.
template <int Dim, class T>
std::vector<Vec<Dim, T>> shifts_down(const Vec<Dim, T>& period, int most)
{
    std::vector<Vec<Dim, T>> all;
    const int last = Dim == 3 ? most : 0;
    for (int x = -most; x <= most; ++x)
        for (int y = -most; y <= most; ++y)
            for (int z = -last; z <= last; ++z) {
                const int k[] = {x, y, z};
                Vec<Dim, T> shift{};
                bool possible = true;
                int first = 0;
                for (int d = Dim - 1; d >= 0; --d) {
                    shift[d] = static_cast<T>(k[d]) * period[d];
                    if (k[d] != 0) first = k[d];
                    possible &= k[d] == 0 || period[d] > 0;
                }
                if (possible && first < 0) all.push_back(shift);
            }
    return all;
}

/// Two objects, and what the second is shifted by.
template <int Dim, class T>
using Meeting = std::tuple<std::uint32_t, std::uint32_t, Vec<Dim, T>>;

template <int Dim, class T, class Wanted>
std::vector<Meeting<Dim, T>> by_definition(const Boxes<Dim, T>& boxes, const Vec<Dim, T>& period,
                                           const Wanted& wanted)
{
    std::vector<Meeting<Dim, T>> all;
    const auto n = static_cast<std::uint32_t>(boxes.size());
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = i + 1; j < n; ++j)
            if (jostle::overlaps(boxes[i], boxes[j]) && wanted(i, j)) all.push_back({i, j, {}});
    for (const Vec<Dim, T>& shift : shifts_down(period, 2))
        for (std::uint32_t j = 0; j < n; ++j) {
            const Aabb<Dim, T> image = shifted(boxes[j], shift);
            for (std::uint32_t i = 0; i < n; ++i) {
                bool counts = i != j;
                for (int d = 0; d < Dim; ++d) // what is its own image isn't shifted
                    counts &= shift[d] == 0 ||
                              !(wall(boxes[i].lo[d], boxes[i].hi[d]) || wall(boxes[j].lo[d], boxes[j].hi[d]));
                if (counts && jostle::overlaps(boxes[i], image) && wanted(i, j)) all.push_back({i, j, shift});
            }
        }
    std::sort(all.begin(), all.end());
    return all;
}

template <int Dim, class T>
std::vector<Meeting<Dim, T>> found(PeriodicImages<Dim, T>& images, const Filter& filter = {})
{
    std::vector<Meeting<Dim, T>> all;
    for (const Pair pair : jostle::find_pairs(images.boxes(), images.filter(filter))) {
        EXPECT_LT(pair.a, images.originals());
        EXPECT_EQ(images.origin()[pair.a], pair.a);
        EXPECT_EQ(images.shift()[pair.a], (Vec<Dim, T>{}));
        all.push_back({images.origin()[pair.a], images.origin()[pair.b], images.shift()[pair.b]});
    }
    std::sort(all.begin(), all.end());
    return all;
}

// --- Scenes ---

enum class Places
{
    anywhere,
    lattice, ///< whole numbers: most pairs just touch
    borders, ///< at the ends of the period
    one,     ///< all in one place, at the border
    count
};

template <int Dim, class T>
struct Scene
{
    Boxes<Dim, T> boxes;
    Vec<Dim, T> period;
};

template <int Dim, class T>
Scene<Dim, T> make_scene(Random& random, std::size_t n)
{
    constexpr T lengths[] = {8, 1, static_cast<T>(0.1), 1000, static_cast<T>(1e-20), static_cast<T>(1e20)};
    Scene<Dim, T> scene;
    const auto places = static_cast<Places>(random.below(static_cast<std::uint32_t>(Places::count)));
    const bool walls = random.one_in(3), far = random.one_in(3), large = random.one_in(3);
    const T length = lengths[random.below(std::size(lengths))];
    Vec<Dim, T> start{};
    for (int d = 0; d < Dim; ++d) {
        scene.period[d] = random.one_in(4) ? T(0) : places == Places::lattice ? T(8) : length;
        // So far away that shifts are rounded.
        start[d] = far ? length * static_cast<T>(100003) * random.template unit<T>() : -length / 2;
        if (places == Places::lattice) start[d] = std::floor(start[d] / length);
    }
    for (std::size_t i = 0; i < n; ++i) {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            const T size = scene.period[d] > 0 ? scene.period[d] : length;
            T at = random.template unit<T>(), extent = random.template unit<T>() * (large ? T(0.99) : T(0.2));
            if (random.one_in(5)) extent = 0;
            if (places == Places::borders) at = random.one_in(2) ? at * T(0.1) : T(1) - at * T(0.1);
            if (places == Places::one) at = 0;
            box.lo[d] = start[d] + size * (at - extent / 4);
            box.hi[d] = box.lo[d] + size * (extent / 2);
            if (places == Places::lattice) {
                box.lo[d] = start[d] + random.template integer<T>(8);
                box.hi[d] = box.lo[d] + random.template integer<T>(4);
            }
            if (!(box.lo[d] <= box.hi[d])) box.hi[d] = box.lo[d];
            if (scene.period[d] > 0 && !(box.hi[d] - box.lo[d] < scene.period[d] / 2)) box.hi[d] = box.lo[d];
            if (walls && random.one_in(8)) {
                box.lo[d] = -std::numeric_limits<T>::infinity();
                box.hi[d] = std::numeric_limits<T>::infinity();
            }
        }
        scene.boxes.push_back(box);
    }
    return scene;
}

TEST(Periodic, FindsWhatTheDefinitionSays)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(1);
        PeriodicImages<Dim, T> images;
        std::size_t across = 0;
        for (int round = 0; round < 400; ++round) {
            const auto scene = make_scene<Dim, T>(random, 1 + random.below(60));
            images.build(scene.boxes, scene.period);
            const auto expected = by_definition(scene.boxes, scene.period, [](auto, auto) { return true; });
            ASSERT_EQ(found(images), expected) << contract::kind_name<Dim, T>() << " round " << round;
            for (const auto& [a, b, shift] : expected)
                across += shift != Vec<Dim, T>{};
        }
        EXPECT_GT(across, 5000u);
    });
}

/// An image that ends below the lowest box by less than a rounding reaches up to it.
TEST(Periodic, FindsWhatIsRoundedUpToTheLowestBox)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        PeriodicImages<Dim, T> images;
        for (int axis = 0; axis < Dim; ++axis)
            for (const T end : {T(1), std::nextafter(T(1), T(0)), T(0.9375)}) {
                Boxes<Dim, T> boxes(2);
                for (int d = 0; d < Dim; ++d)
                    boxes[0].lo[d] = boxes[1].lo[d] = 0, boxes[0].hi[d] = boxes[1].hi[d] = 1;
                boxes[0].lo[axis] = -1000, boxes[0].hi[axis] = -999;
                boxes[1].lo[axis] = T(0.5), boxes[1].hi[axis] = end;
                Vec<Dim, T> period{};
                period[axis] = 1001;
                images.build(boxes, period);
                const auto expected = by_definition(boxes, period, [](auto, auto) { return true; });
                ASSERT_EQ(found(images), expected) << contract::kind_name<Dim, T>() << ", axis " << axis;
                ASSERT_EQ(expected.size(), end > T(0.95) ? 1u : 0u);
            }
    });
}

TEST(Periodic, PassesFiltersOn)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(2);
        PeriodicImages<Dim, T> images;
        for (int round = 0; round < 200; ++round) {
            const auto scene = make_scene<Dim, T>(random, 40);
            std::vector<std::uint32_t> category, mask, owner;
            std::vector<std::array<std::uint32_t, 3>> vertices;
            for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
                category.push_back(random.below(4));
                mask.push_back(random.below(4));
                owner.push_back(random.one_in(3) ? Filter::no_owner : random.below(3));
                vertices.push_back({random.below(9), Filter::no_owner, 9 + random.below(9)});
            }
            const std::uint64_t salt = random.one_in(2) ? random.next() : 0;
            const auto accept = [&](std::uint32_t a, std::uint32_t b) {
                return contract::accepts(salt, std::min(a, b), std::max(a, b));
            };
            Filter filter;
            if (random.one_in(2)) filter.category = category, filter.mask = mask;
            if (random.one_in(2)) filter.owner = owner;
            if (random.one_in(2)) filter.vertices = vertices;
            if (salt != 0) filter.accept = accept;
            images.build(scene.boxes, scene.period);
            const auto expected = by_definition(scene.boxes, scene.period, [&](auto a, auto b) {
                if (!filter.category.empty() &&
                    ((category[a] & mask[b]) == 0 || (category[b] & mask[a]) == 0))
                    return false;
                if (!filter.owner.empty() && owner[a] == owner[b] && owner[a] != Filter::no_owner)
                    return false;
                for (const std::uint32_t vertex : vertices[a])
                    if (!filter.vertices.empty() && vertex != Filter::no_owner &&
                        std::count(vertices[b].begin(), vertices[b].end(), vertex) != 0)
                        return false;
                return accept(a, b);
            });
            ASSERT_EQ(found(images, filter), expected) << round;
        }
        const std::vector<std::uint32_t> few(39);
        EXPECT_THROW((void)images.filter({.owner = few}), jostle::Error);
        Filter ghosts;
        ghosts.ghosts = 1;
        EXPECT_THROW((void)images.filter(ghosts), jostle::Error);
    });
}

/// The rule is the search's own. A callback that is set on the filter sees the shift.
TEST(Periodic, WhateverIsSetOnItsFilterEachPairComesOnce)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(3);
        PeriodicImages<Dim, T> images;
        for (int round = 0; round < 60; ++round) {
            const auto scene = make_scene<Dim, T>(random, 1 + random.below(random.one_in(3) ? 300 : 60));
            images.build(scene.boxes, scene.period);
            const auto n = static_cast<std::uint32_t>(images.originals());
            const auto all = images.boxes();
            std::vector<std::uint32_t> owner(all.size());
            for (std::size_t i = 0; i < all.size(); ++i)
                owner[i] = images.origin()[i] % 5;
            std::atomic<bool> as_promised{true};
            const auto across = [&](std::uint32_t a, std::uint32_t b) {
                if (!(a < n && a < b)) as_promised = false;
                return b < n ? (a + b) % 2 == 0 : images.shift()[b] != Vec<Dim, T>{};
            };
            const bool by_owner = random.one_in(2);
            Filter filter = images.filter();
            filter.accept = across;
            if (by_owner) filter.owner = owner;
            std::vector<Meeting<Dim, T>> meetings;
            for (const Pair pair : jostle::find_pairs(all, filter))
                meetings.push_back({pair.a, images.origin()[pair.b], images.shift()[pair.b]});
            std::sort(meetings.begin(), meetings.end());
            std::vector<Meeting<Dim, T>> expected = by_definition(
                scene.boxes, scene.period, [&](auto a, auto b) { return !by_owner || a % 5 != b % 5; });
            std::erase_if(expected, [](const Meeting<Dim, T>& meeting) {
                const auto& [a, b, shift] = meeting;
                return shift == Vec<Dim, T>{} && (a + b) % 2 != 0;
            });
            ASSERT_EQ(meetings, expected) << contract::kind_name<Dim, T>() << " round " << round;
            ASSERT_TRUE(as_promised);
            ASSERT_EQ(jostle::find_pairs(all, filter, jostle::Order::sorted).to_vector(),
                      jostle::find_pairs_brute_force(jostle::BoxView<Dim, T>(all), filter));
        }
    });
}

TEST(Periodic, MakesTheImagesThatCanTouchSomethingInOrderOnAnyThreads)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        Random random(3);
        for (int round = 0; round < 4; ++round) {
            const auto scene = make_scene<Dim, T>(random, 20'000);
            Vec<Dim, T> lo, hi;
            for (int d = 0; d < Dim; ++d) {
                lo[d] = std::numeric_limits<T>::infinity();
                hi[d] = -lo[d];
                for (const auto& box : scene.boxes)
                    if (!wall(box.lo[d], box.hi[d])) {
                        lo[d] = std::min(lo[d], box.lo[d]);
                        hi[d] = std::max(hi[d], box.hi[d]);
                    }
            }
            std::vector<std::tuple<std::uint32_t, Vec<Dim, T>>> expected;
            for (std::uint32_t i = 0; i < scene.boxes.size(); ++i)
                for (const Vec<Dim, T>& shift : shifts_down(scene.period, 1)) {
                    const Aabb<Dim, T> image = shifted(scene.boxes[i], shift);
                    bool wanted = true;
                    for (int d = 0; d < Dim; ++d)
                        if (shift[d] != 0)
                            wanted &= !wall(image.lo[d], image.hi[d]) && image.lo[d] <= hi[d] &&
                                      lo[d] <= image.hi[d];
                    if (wanted) expected.push_back({i, shift});
                }
            std::sort(expected.begin(), expected.end());
            for (const contract::NamedExecutor& each : contract::all_executors()) {
                PeriodicImages<Dim, T> images({.executor = each.executor.get()});
                images.build(scene.boxes, scene.period);
                const std::size_t n = scene.boxes.size();
                ASSERT_EQ(images.originals(), n);
                ASSERT_EQ(images.boxes().size(), n + expected.size()) << each.name;
                std::vector<std::tuple<std::uint32_t, Vec<Dim, T>>> made;
                for (std::size_t i = n; i < images.boxes().size(); ++i) {
                    made.push_back({images.origin()[i], images.shift()[i]});
                    const auto image = shifted(scene.boxes[images.origin()[i]], images.shift()[i]);
                    ASSERT_TRUE(images.boxes()[i].lo == image.lo && images.boxes()[i].hi == image.hi);
                    if (i > n) {
                        ASSERT_LE(images.origin()[i - 1], images.origin()[i]);
                    }
                }
                std::sort(made.begin(), made.end());
                ASSERT_EQ(made, expected) << each.name;
                for (std::size_t i = 0; i < n; ++i)
                    ASSERT_TRUE(images.origin()[i] == i && images.shift()[i] == (Vec<Dim, T>{}) &&
                                images.boxes()[i].lo == scene.boxes[i].lo &&
                                images.boxes()[i].hi == scene.boxes[i].hi);
                PeriodicImages<Dim, T> alone({.executor = &jostle::serial_executor()});
                alone.build(scene.boxes, scene.period);
                ASSERT_TRUE(std::equal(alone.origin().begin(), alone.origin().end(), images.origin().begin(),
                                       images.origin().end()));
                ASSERT_TRUE(std::equal(alone.shift().begin(), alone.shift().end(), images.shift().begin()));
            }
        }
    });
}

/// The message and the number of what build() throws.
template <class Images, class Boxes, class Period>
std::string refusal(Images& images, const Boxes& boxes, const Period& period, std::uint64_t index)
{
    try {
        images.build(boxes, period);
    } catch (const jostle::Error& error) {
        EXPECT_EQ(error.index(), index) << error.what();
        return error.what();
    }
    return "nothing";
}

TEST(Periodic, BadInputIsAnErrorThatNamesTheBox)
{
    using jostle::Aabb2f;
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr auto none = jostle::Error::no_index;
    const std::vector<Aabb2f> good = {{{0, 0}, {1, 1}}, {{9.5f, 0}, {10.5f, 1}}, {{5, 5}, {6, 6}}};
    jostle::PeriodicImages<2, float> images;
    images.build(good, {10, 10});
    const auto with = [&](std::size_t i, const Aabb2f& box) {
        std::vector<Aabb2f> boxes = good;
        boxes[i] = box;
        return boxes;
    };
    const jostle::Vec2f period{10, 10};
    const auto has = [](const std::string& text, const char* part) {
        return ::testing::AssertionResult(text.find(part) != std::string::npos) << text;
    };
    EXPECT_TRUE(has(refusal(images, with(1, {{0, nan}, {1, 1}}), period, 1), "lo.y is NaN"));
    EXPECT_TRUE(has(refusal(images, with(2, {{2, 0}, {1, 1}}), period, 2), "greater than"));
    EXPECT_TRUE(has(refusal(images, with(0, {{0, 0}, {1, 5}}), period, 0), "shorter than half"));
    EXPECT_TRUE(has(refusal(images, with(0, {{0, 0}, {1, infinity}}), period, 0), "on y"));
    EXPECT_TRUE(has(refusal(images, with(1, {{-3e38f, 0}, {3e38f, 1}}), period, 1), "on x"));
    EXPECT_TRUE(has(refusal(images, with(1, {{18, 0}, {20, 1}}), period, 1), "two periods"));
    EXPECT_TRUE(has(refusal(images, with(2, {{-11, 0}, {-10, 1}}), period, 1), "up to 10.5"));
    EXPECT_TRUE(has(refusal(images, good, jostle::Vec2f{10, -1}, none), "along y is -1"));
    EXPECT_TRUE(has(refusal(images, good, jostle::Vec2f{nan, 10}, none), "along x is nan"));
    EXPECT_TRUE(has(refusal(images, good, jostle::Vec2f{infinity, 10}, none), "along x is inf"));
    const auto nowhere = jostle::BoxView<2, float>::strided(nullptr, nullptr, 3, sizeof(Aabb2f));
    EXPECT_EQ(contract::message_of([&] { images.build(nowhere, period); }),
              "a view of 3 boxes with a null pointer");
    // Of several the lowest, NaN or not.
    std::vector<Aabb2f> several(10'000, {{1, 1}, {2, 2}});
    several[9'000] = {{nan, 0}, {1, 1}};
    several[4'000] = {{0, 0}, {1, 6}};
    EXPECT_TRUE(has(refusal(images, several, period, 4'000), "box 4000"));
    // As they were.
    ASSERT_EQ(images.boxes().size(), 4u);
    EXPECT_EQ(images.origin()[3], 1u);
    EXPECT_EQ(images.shift()[3], (jostle::Vec2f{-10, 0}));
    EXPECT_EQ(found(images), (std::vector<Meeting<2, float>>{{0, 1, {-10, 0}}}));
    // What isn't periodic may be of any length and in any place; infinite both ways is good anywhere.
    EXPECT_EQ(refusal(images, with(1, {{18, 0}, {infinity, 1}}), jostle::Vec2f{0, 10}, none), "nothing");
    EXPECT_EQ(refusal(images, with(1, {{-infinity, 0}, {infinity, 1}}), period, none), "nothing");
    EXPECT_EQ(refusal(images, with(1, {{18, 0}, {19.5f, 1}}), period, none), "nothing");
    images.build(std::vector<Aabb2f>{}, period);
    EXPECT_TRUE(images.boxes().empty());
    EXPECT_TRUE(found(images).empty());
    std::pmr::memory_resource* const nothing = nullptr;
    EXPECT_THROW(jostle::PeriodicImages3f({.memory = nothing}), jostle::Error);
}

TEST(Periodic, ASteadySceneAllocatesNothingAndRunningOutOfMemoryLeavesNoBoxes)
{
    Random random(4);
    contract::CountingMemory memory;
    jostle::PeriodicImages3f images({.executor = &jostle::serial_executor(), .memory = &memory});
    std::vector<jostle::Aabb3f> boxes(30'000);
    for (auto& box : boxes)
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = random.unit<float>() * 10;
            box.hi[d] = box.lo[d] + 0.5f;
        }
    images.build(boxes, {10, 10, 0});
    (void)images.filter();
    EXPECT_GT(images.boxes().size(), boxes.size() + 1000);
    const auto allocations = memory.allocations;
    for (int i = 0; i < 3; ++i) {
        images.build(boxes, {10, 10, 0});
        (void)images.filter();
    }
    EXPECT_EQ(memory.allocations, allocations);
    boxes.resize(90'000, boxes.front());
    int failed = 0;
    for (std::uint64_t more = 0;; ++more) {
        jostle::PeriodicImages3f some({.executor = &jostle::serial_executor(), .memory = &memory});
        memory.failing_allocation = contract::CountingMemory::never;
        some.build(std::span<const jostle::Aabb3f>(boxes).first(1000), {10, 10, 0});
        memory.failing_allocation = memory.allocations + more;
        try {
            some.build(boxes, {10, 10, 0});
            break;
        } catch (const std::bad_alloc&) {
            ++failed;
            EXPECT_TRUE(some.originals() == (some.boxes().empty() ? 0u : 1000u)) << more;
            EXPECT_EQ(some.boxes().size(), some.origin().size());
            EXPECT_EQ(some.boxes().size(), some.shift().size());
        }
    }
    EXPECT_EQ(failed, 4);
    memory.failing_allocation = contract::CountingMemory::never;
    images.build(boxes, {10, 10, 0});
    EXPECT_EQ(images.originals(), boxes.size());
    jostle::PeriodicImages3f moved(std::move(images));
    EXPECT_EQ(moved.originals(), boxes.size());
}

/// Objects of a world that wander through periodic space, with images that follow them.
TEST(Periodic, ImagesFollowTheirOriginalsThroughAWorld)
{
    for_each_kind([](auto kind) {
        constexpr int Dim = decltype(kind)::dim;
        using T = typename decltype(kind)::Number;
        using Vector = Vec<Dim, T>;
        Random random(5);
        Vector period{};
        period[0] = 8;
        period[1] = Dim == 3 ? 4 : 0; // x alone in 2D
        Boxes<Dim, T> boxes(40);
        std::vector<Vector> speeds;
        for (auto& box : boxes) {
            Vector speed;
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = random.template integer<T>(64) / 16;
                box.hi[d] = box.lo[d] + random.template integer<T>(28) / 16;
                speed[d] = period[d] > 0 ? random.template integer<T>(17) / 16 - T(0.5) : T(0);
            }
            speeds.push_back(speed);
        }
        jostle::World<Dim, T> world;
        std::vector<jostle::ObjectId> ids(boxes.size());
        world.add(boxes, ids, {.filter = {.category = 1, .mask = 3}});
        PeriodicImages<Dim, T> images;
        std::map<std::pair<std::uint32_t, Vector>, jostle::ObjectId> followers;
        std::map<std::uint32_t, std::pair<std::uint32_t, Vector>> who; // by index in the world
        for (std::uint32_t i = 0; i < ids.size(); ++i)
            who[ids[i].index] = {i, {}};
        std::vector<Meeting<Dim, T>> known; // by the events alone
        std::size_t across = 0;
        for (int frame = 0; frame < 60; ++frame) {
            world.move(ids, boxes);
            images.build(boxes, period);
            auto before = std::exchange(followers, {});
            for (std::size_t i = images.originals(); i < images.boxes().size(); ++i) {
                const std::pair key{images.origin()[i], images.shift()[i]};
                if (const auto follower = before.extract(key)) {
                    world.move(follower.mapped(), images.boxes()[i]);
                    followers[key] = follower.mapped();
                } else {
                    followers[key] = world.add(images.boxes()[i], {.filter = {.category = 2, .mask = 1}});
                }
            }
            for (const auto& [key, gone] : before)
                world.remove(gone);
            world.update();
            const auto meeting = [&](jostle::ObjectId a, jostle::ObjectId b) {
                auto first = who.at(a.index), second = who.at(b.index);
                if (first.second != Vector{}) std::swap(first, second);
                EXPECT_EQ(first.second, Vector{}) << "two images";
                if (second.second == Vector{} && second.first < first.first) std::swap(first, second);
                return Meeting<Dim, T>{first.first, second.first, second.second};
            };
            for (const auto& ended : world.ended())
                ASSERT_EQ(std::erase(known, meeting(ended.a, ended.b)), 1u);
            for (const auto& [key, id] : followers)
                who[id.index] = key;
            for (const auto& began : world.began())
                known.push_back(meeting(began.a, began.b));
            std::sort(known.begin(), known.end());
            ASSERT_EQ(known, by_definition(boxes, period, [](auto, auto) { return true; })) << frame;
            for (const auto& [a, b, shift] : known)
                across += shift != Vector{};
            for (std::size_t i = 0; i < boxes.size(); ++i)
                for (int d = 0; d < Dim; ++d) {
                    T by = speeds[i][d];
                    if (period[d] > 0 && boxes[i].lo[d] + by >= period[d]) by -= period[d];
                    if (period[d] > 0 && boxes[i].lo[d] + by < 0) by += period[d];
                    boxes[i].lo[d] += by;
                    boxes[i].hi[d] += by;
                }
        }
        EXPECT_GT(across, 100u);
    });
}

} // namespace
