// SPDX-License-Identifier: MIT
// Pairs and queries in C.
#include <algorithm>
#include <cstring>
#include <vector>

#include "jostle/shape_query.hpp"
#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

using CPairs = CTwin;

TEST_F(CPairs, EveryColumnOfAFilterArrives)
{
    Random random(1);
    const std::vector<Aabb3f> a = random_boxes(random, 300, 5), b = random_boxes(random, 200, 5);
    const Columns of_a(random, a.size()), of_b(random, b.size());
    auto wish = options_of<jostle_filter>();
    of_a.give(wish);
    jostle::Filter filter;
    of_a.give_twin(filter);
    const jostle_boxes view_a = view(a), view_b = view(b);
    OK(jostle_finder_new(nullptr, &finder, &error));
    jostle_blocks found;
    OK(jostle_finder_find(finder, JOSTLE_3F, &view_a, nullptr, &wish, JOSTLE_SORTED, &found, &error));
    jostle::PairFinder twin;
    EXPECT_EQ(items_of<jostle::Pair>(found), twin.find(a, filter, jostle::Order::sorted).to_vector());

    wish.category_b = values_of(of_b.category);
    wish.mask_b = values_of(of_b.mask);
    wish.owner_b = values_of(of_b.owner);
    jostle::CrossFilter cross;
    cross.category_a = of_a.category;
    cross.mask_a = of_a.mask;
    cross.owner_a = of_a.owner;
    cross.category_b = of_b.category;
    cross.mask_b = of_b.mask;
    cross.owner_b = of_b.owner;
    OK(jostle_finder_find(finder, JOSTLE_3F, &view_a, &view_b, &wish, JOSTLE_SORTED, &found, &error));
    EXPECT_EQ(items_of<jostle::Pair>(found), twin.find(a, b, cross, jostle::Order::sorted).to_vector());
    EXPECT_GT(found.count, 20u);

    auto stats = options_of<jostle_stats>();
    OK(jostle_finder_stats(finder, &stats, &error));
    const jostle::Stats& expected = twin.stats();
    EXPECT_EQ(stats.objects, expected.objects);
    EXPECT_EQ(stats.pairs, expected.pairs);
    EXPECT_EQ(stats.records, expected.records);
    EXPECT_EQ(stats.candidates, expected.candidates);
    EXPECT_EQ(stats.ties, expected.ties);
    EXPECT_EQ(stats.bricks, expected.bricks);
    EXPECT_EQ(stats.nested_grids, expected.nested_grids);
    EXPECT_EQ(stats.bytes_reserved, expected.bytes_reserved);
    EXPECT_GE(stats.ms_total, stats.ms_tune + stats.ms_scatter + stats.ms_sweep + stats.ms_finish - 1e-3);

    // The order that is asked for.
    OK(jostle_finder_take(finder, JOSTLE_3F, &view_a, nullptr, nullptr, JOSTLE_SORTED, results, &error));
    EXPECT_EQ(pairs_of_results(), twin.find(a, {}, jostle::Order::sorted).to_vector());
    OK(jostle_find_pairs(JOSTLE_3F, &view_b, nullptr, nullptr, JOSTLE_SORTED, nullptr, results, &error));
    EXPECT_EQ(pairs_of_results(), twin.find(b, {}, jostle::Order::sorted).to_vector());
    EXPECT_EQ(jostle_finder_find(finder, JOSTLE_3F, &view_a, nullptr, &wish, JOSTLE_SORTED, &found, &error),
              JOSTLE_INVALID_ARGUMENT); // values for a second set, and there is none
}

TEST_F(CPairs, WhatIsSetOnAFilterOfImagesLosesNoRule)
{
    Random random(6);
    const std::vector<Aabb3f> boxes = random_boxes(random, 300, 5);
    const float period[3] = {5, 5, 0};
    jostle::PeriodicImages3f twin;
    twin.build(boxes, {period[0], period[1], period[2]});
    struct Seen
    {
        std::uint32_t originals;
        bool across;
    } seen{300, false};
    const jostle_boxes all = view(boxes);
    jostle_images* images = nullptr;
    OK(jostle_images_new(JOSTLE_3F, nullptr, &images, &error));
    OK(jostle_images_build(images, &all, period, &error));
    jostle_images_view shown;
    OK(jostle_images_view_read(images, &shown, &error));
    jostle_filter filter;
    OK(jostle_images_filter(images, nullptr, &filter, &error));
    filter.context = &seen;
    filter.accept = [](void* context, std::uint32_t a, std::uint32_t b) -> std::int32_t {
        auto& self = *static_cast<Seen*>(context);
        EXPECT_LT(a, self.originals);
        self.across |= b >= self.originals;
        return 1;
    };
    OK(jostle_find_pairs(JOSTLE_3F, &shown.boxes, nullptr, &filter, JOSTLE_SORTED, nullptr, results, &error));
    EXPECT_EQ(pairs_of_results(),
              jostle::find_pairs(twin.boxes(), twin.filter(), jostle::Order::sorted).to_vector());
    EXPECT_TRUE(seen.across);
    EXPECT_EQ(
        jostle_find_pairs(JOSTLE_3F, &all, &shown.boxes, &filter, JOSTLE_SORTED, nullptr, results, &error),
        JOSTLE_INVALID_ARGUMENT); // within one set only
    OK(jostle_free(images, &error));
}

TEST_F(CPairs, ABoxAroundAnIndex)
{
    Random random(5);
    const std::vector<Aabb3f> boxes = random_boxes(random, 300, 5);
    const jostle_boxes all = view(boxes);
    OK(jostle_index_new(JOSTLE_3F, nullptr, &index, &error));
    int32_t any = 1;
    Aabb3f bounds{};
    OK(jostle_query_bounds(index, &any, &bounds, &error));
    EXPECT_EQ(any, 0);
    OK(jostle_index_build(index, nullptr, &all, &error));
    OK(jostle_query_bounds(index, &any, &bounds, &error));
    EXPECT_EQ(any, 1);
    jostle::BoxIndex3f twin;
    twin.build(boxes);
    EXPECT_EQ(bounds.lo, twin.bounds()->lo);
    EXPECT_EQ(bounds.hi, twin.bounds()->hi);
    auto made_of = options_of<jostle_index_stats>();
    OK(jostle_index_stats_read(index, &made_of, &error));
    EXPECT_EQ(made_of.objects, 300u);
}

TEST_F(CPairs, ASinkIsToldBlockAndPart)
{
    Random random(2);
    const std::vector<Aabb3f> boxes = random_boxes(random, 20'000, 9);
    struct Chunk
    {
        std::uint64_t pairs, block, part;
        bool operator==(const Chunk&) const = default;
    };
    std::vector<Chunk> told, expected;
    const auto take = [](void* context, const jostle_pair*, std::uint64_t count, std::uint64_t block,
                         std::uint64_t part) {
        static_cast<std::vector<Chunk>*>(context)->push_back({count, block, part});
        return std::int32_t{1};
    };
    auto options = options_of<jostle_options>();
    OK(jostle_executor_serial(&executor, &error));
    options.executor = executor;
    OK(jostle_finder_new(&options, &finder, &error));
    const jostle_boxes all = view(boxes);
    std::int32_t finished = 0;
    OK(jostle_finder_stream(finder, JOSTLE_3F, &all, nullptr, nullptr, take, &told, &finished, &error));
    jostle::PairFinder twin({.executor = &jostle::serial_executor()});
    twin.stream(boxes, [&](const jostle::PairChunk& chunk) {
        expected.push_back({chunk.pairs.size(), chunk.block, chunk.part});
        return true;
    });
    EXPECT_EQ(told, expected);
    EXPECT_TRUE(std::any_of(told.begin(), told.end(), [](const Chunk& c) { return c.block != 0; }));
    EXPECT_TRUE(std::any_of(told.begin(), told.end(), [](const Chunk& c) { return c.part != 0; }));
}

using CIndex = CTwin;

TEST_F(CIndex, AFiltersColumnsAndAskerArrive)
{
    Random random(3);
    const std::vector<Aabb3f> boxes = random_boxes(random, 400, 3);
    const Columns columns(random, boxes.size());
    const jostle_boxes all = view(boxes);
    OK(jostle_index_new(JOSTLE_3F, nullptr, &index, &error));
    OK(jostle_index_build(index, nullptr, &all, &error));
    jostle::BoxIndex3f twin;
    twin.build(boxes);
    auto wish = options_of<jostle_query_filter>();
    columns.give(wish);
    jostle::QueryFilter filter;
    columns.give_twin(filter);
    std::uint64_t some = 0;
    for (int k = 0; k < 60; ++k) {
        const jostle_asker asker{1u << random.below(3), random.below(8),
                                 random.below(4) == 0 ? UINT32_MAX : random.below(3)};
        wish.asker = &asker;
        filter.asker_category = asker.category;
        filter.asker_mask = asker.mask;
        filter.asker_owner = asker.owner;
        const std::vector<Aabb3f> asked = random_boxes(random, 3, 3);
        std::uint64_t counts[3];
        const jostle_queries three = queries_of(JOSTLE_BOX, asked.data(), 3);
        OK(jostle_query_count(index, &three, nullptr, &wish, counts, &error));
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_EQ(counts[i], twin.count(asked[i], filter));
            some += counts[i];
        }
    }
    EXPECT_GT(some, 100u);
    auto stats = options_of<jostle_index_stats>();
    OK(jostle_index_stats_read(index, &stats, &error));
    const jostle::IndexStats expected = twin.stats();
    EXPECT_EQ(stats.objects, expected.objects);
    EXPECT_EQ(stats.pages, expected.pages);
    EXPECT_EQ(stats.leaves, expected.leaves);
    EXPECT_EQ(stats.nodes, expected.nodes);
    EXPECT_EQ(stats.depth, expected.depth);
    EXPECT_EQ(stats.bytes, expected.bytes);
    EXPECT_EQ(stats.sorts, expected.sorts);
    EXPECT_EQ(stats.splits, expected.splits);
}

TEST_F(CIndex, ListsSayTheirEnds)
{
    Random random(4);
    const std::vector<Aabb3f> boxes = random_boxes(random, 300, 4);
    const jostle_boxes all = view(boxes);
    OK(jostle_index_new(JOSTLE_3F, nullptr, &index, &error));
    OK(jostle_index_build(index, nullptr, &all, &error));
    jostle::BoxIndex3f twin;
    twin.build(boxes);
    for (const std::size_t queries : {0u, 1u, 2u, 7u})
        for (const std::uint64_t most : {std::uint64_t{0}, std::uint64_t{2}, UINT64_MAX}) {
            std::vector<jostle::Ray3f> rays;
            for (std::size_t i = 0; i < queries; ++i)
                rays.push_back(
                    {{-1, static_cast<float>(4 * random.unit()), static_cast<float>(4 * random.unit())},
                     {1, 0, 0.01f},
                     8});
            const jostle_queries given = queries_of(JOSTLE_RAY, rays.data(), queries);
            OK(jostle_query_all(index, &given, nullptr, nullptr, most, results, &error));
            jostle_lists lists;
            OK(jostle_results_lists(results, &lists, &error));
            ASSERT_EQ(lists.queries, queries);
            std::uint64_t at = 0;
            for (std::size_t i = 0; i < queries; ++i) {
                std::vector<jostle::Hit<float>> hits;
                const bool more = twin.all(rays[i], hits, {}, most);
                ASSERT_EQ(lists.first[i], at);
                ASSERT_EQ(lists.first[i + 1], at + hits.size());
                for (const jostle::Hit<float>& hit : hits) {
                    EXPECT_EQ(lists.ids[at], hit.id);
                    EXPECT_EQ(lists.at[at++], hit.at);
                }
                EXPECT_EQ(lists.more[i], more ? 1 : 0);
            }
            EXPECT_EQ(lists.count, at);
        }
}

/// Spheres, boxes and capsules, as C++'s and as C's.
struct ManyShapes
{
    std::vector<jostle::Shape3> cpp;
    std::vector<jostle::Pose3f> poses;
    jostle_shapes* c = nullptr;

    ManyShapes(Random& random, std::size_t count)
    {
        jostle_error error;
        EXPECT_EQ(jostle_shapes_new(3, &c, &error), JOSTLE_OK);
        for (std::size_t i = 0; i < count; ++i) {
            jostle_shape* one = nullptr;
            const double size = 0.1 + 0.3 * random.unit();
            const double half[] = {size, 0.2, 0.3};
            switch (random.below(3)) {
            case 0:
                cpp.push_back(jostle::Shape3::sphere(size));
                EXPECT_EQ(jostle_shape_sphere(3, size, &one, &error), JOSTLE_OK);
                break;
            case 1:
                cpp.push_back(jostle::Shape3::box({size, 0.2, 0.3}));
                EXPECT_EQ(jostle_shape_box(3, half, 0, &one, &error), JOSTLE_OK);
                break;
            default:
                cpp.push_back(jostle::Shape3::capsule(size, 0.1));
                EXPECT_EQ(jostle_shape_capsule(3, size, 0.1, &one, &error), JOSTLE_OK);
            }
            EXPECT_EQ(jostle_shapes_add(c, one, 1, &error), JOSTLE_OK);
            EXPECT_EQ(jostle_free(one, &error), JOSTLE_OK);
            poses.push_back({{static_cast<float>(4 * random.unit()), static_cast<float>(4 * random.unit()),
                              static_cast<float>(4 * random.unit())}});
        }
    }
    ManyShapes(const ManyShapes&) = delete;
    ManyShapes& operator=(const ManyShapes&) = delete;
    ~ManyShapes() { jostle_free(c, nullptr); }
    [[nodiscard]] jostle_objects objects() const
    {
        return {c, {poses.data(), poses.size(), sizeof(jostle::Pose3f)}};
    }
};

struct Handed
{
    std::vector<std::uint64_t> ids;
    std::vector<double> at;
};

/// All verbs of these queries about shapes, in C as in C++.
template <class Query>
void check_shapes(const jostle_index* index, const jostle::BoxIndex3f& twin, const ManyShapes& of,
                  const std::vector<Query>& queries, const jostle_queries& given, jostle_results* results)
{
    using Index = jostle::BoxIndex3f;
    constexpr bool is_nearest = std::same_as<Query, jostle::NearestToShape<3, float>>;
    constexpr bool is_cast = jostle::ShapeCastOf<Query, 3, float>;
    jostle_error error{};
    const std::size_t n = queries.size();
    const jostle_objects objects = of.objects();
    const jostle::Objects<3, float> shapes{of.cpp, of.poses};

    jostle::ResultLists<Index::ShapeAnswer<Query>> lists;
    if constexpr (is_nearest)
        twin.nearest(queries, shapes, lists);
    else
        twin.all(queries, shapes, lists);
    OK(jostle_query_all(index, &given, &objects, nullptr, UINT64_MAX, results, &error));
    jostle_lists found{};
    OK(jostle_results_lists(results, &found, &error));
    ASSERT_EQ(found.queries, n);
    ASSERT_EQ(found.count, lists.items().size());
    for (std::size_t k = 0; k < lists.items().size(); ++k) {
        const auto& item = lists.items()[k];
        if constexpr (is_nearest || is_cast) {
            EXPECT_EQ(found.ids[k], item.id);
            if constexpr (is_cast) {
                EXPECT_EQ(found.at[k], item.fraction);
            } else {
                EXPECT_EQ(found.at[k], item.distance);
            }
        } else {
            EXPECT_EQ(found.ids[k], item);
        }
    }
    for (std::size_t i = 0; i < n; ++i) {
        EXPECT_EQ(found.first[i], lists.offsets()[i]);
        jostle_queries one = given; // alone, to a visitor
        jostle_objects asker{};
        jostle_shapes* its_shape = nullptr;
        if (given.values.count != 0) {
            one.values.data = static_cast<const char*>(given.values.data) +
                              static_cast<std::int64_t>(i) * given.values.stride;
            one.values.count = 1;
        }
        if (given.shapes != nullptr) {
            OK(jostle_shapes_new(3, &its_shape, &error));
            OK(jostle_shapes_add_from(its_shape, given.shapes->shapes, i, 1, &error));
            asker = {its_shape,
                     {static_cast<const char*>(given.shapes->poses.data) + i * sizeof(jostle::Pose3f), 1,
                      sizeof(jostle::Pose3f)}};
            one.shapes = &asker;
        }
        Handed handed;
        const auto visit = [](void* context, std::uint64_t id, double at, const void* details,
                              double* bound) -> std::int32_t {
            auto& into = *static_cast<Handed*>(context);
            into.ids.push_back(id);
            into.at.push_back(at);
            EXPECT_EQ(details == nullptr, bound == nullptr);
            return 1;
        };
        std::int32_t finished = 0;
        OK(jostle_query_visit(index, &one, &objects, nullptr, visit, &handed, &finished, &error));
        EXPECT_EQ(finished, 1);
        std::vector<std::uint64_t> expected(found.ids + found.first[i], found.ids + found.first[i + 1]);
        if (found.at == nullptr) {
            std::sort(handed.ids.begin(), handed.ids.end());
        } else {
            EXPECT_EQ(handed.at, std::vector(found.at + found.first[i], found.at + found.first[i + 1]));
        }
        EXPECT_EQ(handed.ids, expected);
        jostle_free(its_shape, nullptr);
    }
    if constexpr (is_nearest || is_cast) {
        using Found = std::conditional_t<is_nearest, Index::FoundDistance, Index::FoundShape>;
        using Details = std::conditional_t<is_nearest, jostle::Distance<3, float>, jostle::CastHit3f>;
        std::vector<Found> first(n);
        std::vector<Details> details(n);
        std::vector<jostle_hit> hits(n);
        if constexpr (is_nearest)
            twin.nearest(queries, shapes, first);
        else
            twin.first(queries, shapes, first);
        OK(jostle_query_first(index, &given, &objects, nullptr, hits.data(), details.data(), &error));
        jostle_blocks blocks{};
        OK(jostle_results_blocks(results, &blocks, &error));
        const std::vector<Details> all = items_of<Details>(blocks);
        for (std::size_t i = 0; i < n; ++i) {
            EXPECT_EQ(hits[i].id, first[i].id == Found{}.id ? UINT64_MAX : first[i].id);
            const Details expected = first[i];
            EXPECT_EQ(std::memcmp(&details[i], &expected, sizeof expected), 0);
            if (found.first[i] != found.first[i + 1]) {
                EXPECT_EQ(std::memcmp(&all[found.first[i]], &expected, sizeof expected), 0);
            }
        }
    }
    if constexpr (!is_nearest) {
        std::vector<std::uint64_t> counts(n);
        std::vector<std::uint8_t> any(n);
        OK(jostle_query_count(index, &given, &objects, nullptr, counts.data(), &error));
        OK(jostle_query_any(index, &given, &objects, nullptr, any.data(), &error));
        for (std::size_t i = 0; i < n; ++i) {
            EXPECT_EQ(counts[i], found.first[i + 1] - found.first[i]);
            EXPECT_EQ(any[i], counts[i] != 0);
        }
    }
}

TEST_F(CIndex, ShapesAreAskedAboutAsInCpp)
{
    Random random(11);
    const ManyShapes of(random, 150), askers(random, 40);
    std::vector<Aabb3f> boxes(of.cpp.size());
    const jostle_objects objects = of.objects();
    OK(jostle_bounds(JOSTLE_3F, &objects, 0, nullptr, boxes.data(), &error));
    const jostle_boxes all = view(boxes);
    OK(jostle_index_new(JOSTLE_3F, nullptr, &index, &error));
    OK(jostle_index_build(index, nullptr, &all, &error));
    jostle::BoxIndex3f twin;
    twin.build(boxes);

    std::vector<jostle::Ray3f> rays;
    std::vector<jostle::ShapeSweep<3, float>> sweeps;
    std::vector<jostle::PosedShape<3, float>> posed;
    std::vector<jostle::NearestToShape<3, float>> nearest;
    std::vector<jostle::Vec3f> ways;
    std::vector<float> most;
    for (std::size_t i = 0; i < askers.cpp.size(); ++i) {
        const auto& pose = askers.poses[i];
        const auto some = [&] { return static_cast<float>(4 * random.unit() - 2); };
        ways.push_back({some(), some(), some()});
        most.push_back(0.2f + 0.2f * static_cast<float>(random.unit()));
        rays.push_back({pose.position, ways.back(), 1});
        sweeps.push_back({askers.cpp[i], pose, ways.back()});
        posed.push_back({askers.cpp[i], pose});
        nearest.push_back({askers.cpp[i], pose, 3, most.back()});
    }
    const jostle_objects asking = askers.objects();
    check_shapes(index, twin, of, rays, queries_of(JOSTLE_RAY, rays.data(), rays.size()), results);
    jostle_queries given = queries_of(JOSTLE_SHAPE_SWEEP, ways.data(), ways.size());
    given.shapes = &asking;
    check_shapes(index, twin, of, sweeps, given, results);
    given = {};
    given.kind = JOSTLE_POSED_SHAPE;
    given.shapes = &asking;
    check_shapes(index, twin, of, posed, given, results);
    given = queries_of(JOSTLE_NEAREST_TO_SHAPE, most.data(), most.size());
    given.shapes = &asking;
    given.nearest = 3;
    check_shapes(index, twin, of, nearest, given, results);
}

} // namespace
} // namespace c_twin
