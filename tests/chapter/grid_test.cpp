// SPDX-License-Identifier: MIT
// The hierarchical grid (Alg. 6 to 10) against the oracle.
#include <gtest/gtest.h>

#include "scene.hpp"

using namespace jostle;
using namespace chapter_test;

namespace {

template <class Type>
struct Kind;
template <int D, class C>
struct Kind<Aabb<D, C>>
{
    static constexpr int Dim = D;
    using T = C;
};

template <class Type>
class ChapterGrid : public testing::Test
{
};
using Types = testing::Types<Aabb2f, Aabb2d, Aabb3f, Aabb3d>;
TYPED_TEST_SUITE(ChapterGrid, Types);

/// find_pairs against the oracle, the same in the same order on 1, 2 and 7 processors; and grids with other
/// levels and buckets.
template <int Dim, class T>
void check(const Boxes<Dim, T>& boxes)
{
    const std::vector<Pair> truth = brute(boxes);
    const BoxView<Dim, T> view(boxes);
    const std::vector<Pair> found = chapter::find_pairs(view, serial_executor());
    ASSERT_EQ(sorted(found), truth);
    for (const std::uint32_t threads : {2u, 7u})
        ASSERT_EQ(chapter::find_pairs(view, *make_thread_executor(threads)), found);
    const std::vector<chapter::GridOptions<T>> all_options = {
        {{}, 1},
        {{1}, 64},
        {{T(0.3), 1, T(5.7), 100}, 7, chapter::Hash::as_printed},
        {chapter::choose_cell_sizes(view), 1000, chapter::Hash::as_printed},
    };
    for (const chapter::GridOptions<T>& options : all_options) {
        auto grid = grid_of(boxes, options);
        ASSERT_TRUE(grid.validate());
        ASSERT_EQ(sorted(grid.detect_proximity(serial_executor())), truth);
    }
}

TYPED_TEST(ChapterGrid, RandomScenes)
{
    constexpr int Dim = Kind<TypeParam>::Dim;
    using T = typename Kind<TypeParam>::T;
    std::size_t pairs = 0;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        Random random(seed);
        const Boxes<Dim, T> boxes = mixed_sizes<Dim, T>(random.below(250), std::exp2(random.uniform(0, 8)),
                                                        random.uniform(1, 60), seed);
        pairs += brute(boxes).size();
        ASSERT_NO_FATAL_FAILURE(check(boxes)) << "seed " << seed;
    }
    EXPECT_GT(pairs, 1000u);
}

// Coordinates on a coarse lattice: faces that touch, edges on cell borders, zero sizes, identical boxes.
TYPED_TEST(ChapterGrid, LatticeScenes)
{
    constexpr int Dim = Kind<TypeParam>::Dim;
    using T = typename Kind<TypeParam>::T;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        Random random(seed + 1000);
        Boxes<Dim, T> boxes(random.below(200));
        for (auto& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = T(random.below(16)) / 2 - 4;
                box.hi[d] = box.lo[d] + T(random.below(5)) / 2;
            }
        ASSERT_NO_FATAL_FAILURE(check(boxes)) << "seed " << seed;
    }
}

TYPED_TEST(ChapterGrid, HostileScenes)
{
    constexpr int Dim = Kind<TypeParam>::Dim;
    using T = typename Kind<TypeParam>::T;
    using Limits = std::numeric_limits<T>;
    constexpr T inf = Limits::infinity(), max = Limits::max();
    Random random(7);
    const auto all = [](T lo, T hi) {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = lo;
            box.hi[d] = hi;
        }
        return box;
    };

    check(Boxes<Dim, T>{});
    check(Boxes<Dim, T>{all(0, 0)});
    check(Boxes<Dim, T>(100, all(-1, 1)));   // identical
    check(Boxes<Dim, T>(100, all(3, 3)));    // identical points
    check(Boxes<Dim, T>(50, all(inf, inf))); // at infinity
    check(Boxes<Dim, T>(50, all(-inf, inf)));

    Boxes<Dim, T> strange = mixed_sizes<Dim, T>(100, 10, 20, 8);
    const std::vector<T> values = {
        -inf, -max,    T(-1e30), -1, -Limits::denorm_min(), T(-0.0), 0, Limits::denorm_min(), Limits::min(),
        1,    T(1e30), max,      inf};
    for (int i = 0; i < 150; ++i) {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            const T x = values[random.below(static_cast<std::uint32_t>(values.size()))];
            const T y = values[random.below(static_cast<std::uint32_t>(values.size()))];
            box.lo[d] = std::min(x, y);
            box.hi[d] = std::max(x, y);
        }
        strange.push_back(box);
    }
    check(strange);

    // Sizes 1 : 10,000, points and planes among them.
    Boxes<Dim, T> sizes = mixed_sizes<Dim, T>(300, 10'000, 5000, 9);
    for (std::uint32_t i = 0; i < 50; ++i) {
        const Aabb<Dim, T>& other = sizes[random.below(300)];
        Aabb<Dim, T> point = other;
        for (int d = 0; d < Dim; ++d)
            point.hi[d] = point.lo[d];
        sizes.push_back(point);
        Aabb<Dim, T> plane = all(-inf, inf);
        plane.lo[0] = plane.hi[0] = other.hi[0];
        if (i % 10 == 0) sizes.push_back(plane);
    }
    check(sizes);

    // Far from the origin, where neighbouring numbers are as far apart as cells or farther.
    for (const double centre : {1e9, -1e9, 1e15}) {
        Boxes<Dim, T> far;
        for (int i = 0; i < 150; ++i)
            far.push_back(random_box<Dim, T>(random, centre, centre + 100, 20));
        check(far);
    }
}

TYPED_TEST(ChapterGrid, AddMoveRemoveChurn)
{
    constexpr int Dim = Kind<TypeParam>::Dim;
    using T = typename Kind<TypeParam>::T;
    const auto executor = make_thread_executor(3);
    for (const std::uint32_t buckets : {1u, 16u, 1024u}) {
        Random random(buckets);
        chapter::Grid<Dim, T> grid({{1, 2, 4}, buckets});
        std::vector<std::uint32_t> there; // the objects' numbers
        Boxes<Dim, T> boxes;              // by number
        std::size_t pairs = 0;
        for (int round = 0; round < 60; ++round) {
            for (int step = 0; step < 20; ++step) {
                const std::uint32_t action = random.below(there.size() < 20 ? 1 : 4);
                const auto box =
                    random_box<Dim, T>(random, -8, 8, random.below(20) == 0 ? 12 : random.uniform(0, 4));
                if (action == 0) {
                    const std::uint32_t object = grid.add(box);
                    ASSERT_LE(object, boxes.size());
                    if (object == boxes.size())
                        boxes.push_back(box);
                    else
                        boxes[object] = box;
                    ASSERT_EQ(std::count(there.begin(), there.end(), object), 0);
                    there.push_back(object);
                } else {
                    const std::size_t k = random.below(static_cast<std::uint32_t>(there.size()));
                    if (action == 1) {
                        grid.remove(there[k]);
                        ASSERT_FALSE(grid.contains(there[k]));
                        there.erase(there.begin() + static_cast<std::ptrdiff_t>(k));
                    } else if (action == 2) {
                        grid.move(there[k], boxes[there[k]] = box);
                    } else { // a little, mostly within its cell
                        for (int d = 0; d < Dim; ++d) {
                            boxes[there[k]].lo[d] += T(0.1);
                            boxes[there[k]].hi[d] += T(0.1);
                        }
                        grid.move(there[k], boxes[there[k]]);
                    }
                }
            }
            ASSERT_TRUE(grid.validate());
            ASSERT_EQ(grid.size(), there.size());
            std::sort(there.begin(), there.end());
            Boxes<Dim, T> now;
            for (const std::uint32_t object : there)
                now.push_back(boxes[object]);
            std::vector<Pair> truth = brute(now);
            for (Pair& pair : truth)
                pair = {there[pair.a], there[pair.b]};
            ASSERT_EQ(sorted(grid.detect_proximity(*executor)), truth);
            pairs += truth.size();
        }
        EXPECT_GT(pairs, 100u);
    }
}

TEST(ChapterGridErrors, NameTheObjectAndLeaveTheGridAsItWas)
{
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    chapter::Grid<2, float> grid({{1, 2}});
    const Aabb2f good{{0, 0}, {1, 1}};
    grid.add(good);
    grid.add(good);
    const auto code_and_index = [](auto call) {
        try {
            call();
        } catch (const Error& error) {
            return std::pair{error.code(), error.index()};
        }
        return std::pair{ErrorCode{}, std::uint64_t{0}};
    };
    using Result = std::pair<ErrorCode, std::uint64_t>;
    EXPECT_EQ(code_and_index([&] { grid.add({{0, nan}, {1, 1}}); }), Result(ErrorCode::nan_coordinate, 2));
    EXPECT_EQ(code_and_index([&] { grid.add({{0, 2}, {1, 1}}); }), Result(ErrorCode::inverted_box, 2));
    EXPECT_EQ(code_and_index([&] { grid.move(1, {{0, 2}, {1, 1}}); }), Result(ErrorCode::inverted_box, 1));
    EXPECT_EQ(code_and_index([&] { grid.move(7, good); }), Result(ErrorCode::invalid_argument, 7));
    EXPECT_EQ(code_and_index([&] { grid.remove(2); }), Result(ErrorCode::invalid_argument, 2));
    EXPECT_EQ(code_and_index([&] { (void)grid.box(2); }), Result(ErrorCode::invalid_argument, 2));
    EXPECT_EQ(grid.size(), 2u);
    EXPECT_TRUE(grid.validate());
    EXPECT_EQ(grid.box(1).hi[1], 1);
    grid.remove(0);
    EXPECT_EQ(code_and_index([&] { grid.remove(0); }), Result(ErrorCode::invalid_argument, 0));
    EXPECT_EQ(grid.add(good), 0u); // the number is given out again

    const Boxes<2, float> bad = {good, good, {{nan, 0}, {0, 0}}, {{1, 0}, {0, 0}}};
    EXPECT_EQ(code_and_index([&] { (void)chapter::find_pairs(BoxView<2, float>(bad)); }),
              Result(ErrorCode::nan_coordinate, 2));

    using Options = chapter::GridOptions<float>;
    const float inf = std::numeric_limits<float>::infinity();
    for (const Options& options : {Options{{0}}, Options{{1, 1}}, Options{{2, 1}}, Options{{-1}},
                                   Options{{nan}}, Options{{1, inf}}, Options{{1}, 0}})
        EXPECT_THROW((chapter::Grid<2, float>(options)), Error);
}

// Sizes 1 : 10,000 must not make every object a candidate of every other, nor may zero sizes, faraway
// outliers or infinite boxes: the chosen levels keep the tests near the pairs.
TEST(ChapterCellSizes, KeepTheTestsNearThePairs)
{
    constexpr std::uint32_t n = 20'000;
    const float inf = std::numeric_limits<float>::infinity();
    Boxes<3, float> mixed, points, outliers;
    Random random(11);
    for (std::uint32_t i = 0; i < n; ++i) {
        const double size = std::min(10'000.0, std::pow(random.uniform(1e-6, 1), -1 / 1.6));
        mixed.push_back(random_box<3, float>(random, 0, 150, size));
        points.push_back(random_box<3, float>(random, 0, 1, 0));
        outliers.push_back(random_box<3, float>(random, 0, 30, 1));
    }
    outliers[0] = {{1e30f, 0, 0}, {1e30f, 1, 1}};
    outliers[1] = {{-inf, -inf, -inf}, {inf, inf, inf}};
    outliers[2] = {{5, 5, 5}, {5 + 1e-6f, 5, 5}};
    const auto check_tests = [](const Boxes<3, float>& boxes, double tests_per_object_and_pair) {
        chapter::GridOptions<float> options{chapter::choose_cell_sizes(BoxView<3, float>(boxes)), 2 * n};
        auto grid = grid_of(boxes, options);
        const std::uint64_t pairs = grid.detect_proximity(serial_executor()).size();
        EXPECT_LT(static_cast<double>(grid.stats().tests),
                  tests_per_object_and_pair * static_cast<double>(n + pairs));
        EXPECT_LT(grid.stats().cells, 300 * std::uint64_t{n});
        EXPECT_LE(options.cell_sizes.size(), 25u);
    };
    check_tests(mixed, 40);
    check_tests(points, 0.1);
    check_tests(outliers, 40);
}

TEST(ChapterCellSizes, AreTheLeastPowersOfTwoAboveTheBoxes)
{
    const Boxes<2, float> boxes = {{{0, 0}, {1.5f, 1}}, {{0, 0}, {0.25f, 5}}, {{9, 9}, {9.9f, 9}}};
    EXPECT_EQ(chapter::choose_cell_sizes(BoxView<2, float>(boxes)), (std::vector<float>{1, 2, 8}));
}

TEST(ChapterCellSizes, ABoxAsLargeAsACellLiesOnItsLevel)
{
    chapter::Grid<2, float> grid({{1, 2, 4}, 16});
    EXPECT_EQ(grid.level(grid.add({{0, 0}, {1, 0.5f}})), 0u);
    EXPECT_EQ(grid.level(grid.add({{0, 0}, {0.5f, 2}})), 1u);
    EXPECT_EQ(grid.level(grid.add({{0, 0}, {2.5f, 0}})), 2u);
    EXPECT_EQ(grid.level(grid.add({{0, 0}, {0, 4.5f}})), 3u);
}

TEST(ChapterStats, AreTheSumsOfAllProcessors)
{
    auto grid = grid_of(mixed_sizes<3, float>(300, 8, 8, 5), {{1, 2, 4, 8}});
    grid.detect_proximity(serial_executor());
    const chapter::GridStats alone = grid.stats();
    EXPECT_GT(alone.tests, 300u);
    grid.detect_proximity(*make_thread_executor(3));
    EXPECT_EQ(grid.stats().tests, alone.tests);
    EXPECT_EQ(grid.stats().visited, alone.visited);
    EXPECT_EQ(grid.stats().cells, alone.cells);
}

} // namespace
