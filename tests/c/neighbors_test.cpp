// SPDX-License-Identifier: MIT
// Neighbour lists in C.
#include <algorithm>
#include <string>
#include <vector>

#include "jostle/neighbors.hpp"
#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

using CNeighbors = CTwin;
using Point = jostle::Vec<3, float>;

std::vector<Point> random_points(Random& random, std::size_t count)
{
    std::vector<Point> points(count);
    for (Point& point : points)
        for (int d = 0; d < 3; ++d)
            point[d] = static_cast<float>(7 * random.unit() - 1);
    return points;
}

template <int Dim, class T>
void expect_same(const jostle_neighbor_list& list, const jostle::NeighborList<Dim, T>& twin)
{
    ASSERT_EQ(list.count, twin.neighbors.size());
    EXPECT_TRUE(std::equal(twin.offsets.begin(), twin.offsets.end(), list.offsets));
    EXPECT_TRUE(std::equal(twin.neighbors.begin(), twin.neighbors.end(), list.neighbors));
    EXPECT_EQ(list.shifts == nullptr, twin.shifts.empty());
    EXPECT_EQ(list.vectors == nullptr, twin.vectors.empty());
    EXPECT_EQ(list.distances == nullptr, twin.distances.empty());
    for (std::size_t k = 0; k < twin.shifts.size(); ++k)
        for (std::size_t d = 0; d < Dim; ++d)
            EXPECT_EQ(list.shifts[k * Dim + d], twin.shifts[k][d]);
    for (std::size_t k = 0; k < twin.vectors.size(); ++k)
        for (int d = 0; d < Dim; ++d)
            EXPECT_EQ(static_cast<const T*>(list.vectors)[k * Dim + static_cast<std::size_t>(d)],
                      twin.vectors[k][d]);
    EXPECT_TRUE(
        std::equal(twin.distances.begin(), twin.distances.end(), static_cast<const T*>(list.distances)));
    EXPECT_EQ(list.searched != 0, twin.searched);
}

TEST_F(CNeighbors, AreThoseOfCpp)
{
    Random random(1);
    const std::vector<Point> points = random_points(random, 200), others = random_points(random, 150);
    const float vectors[9] = {5, 0, 0, 2, 6, 0, 0, 0, 7};
    const std::int32_t repeats[3] = {1, 1, 0};
    const jostle::PeriodicCell<3, float> cell{{{5, 0, 0}, {2, 6, 0}, {0, 0, 7}}, {true, true, false}};
    jostle_neighbor_finder* handle = nullptr;
    OK(jostle_neighbor_finder_new(JOSTLE_3F, nullptr, &handle, &error));
    jostle::NeighborFinder<3, float> twin;
    jostle_neighbor_list list{};

    auto query = options_of<jostle_neighbor_query>();
    query.points = points.data(), query.count = points.size();
    query.cutoff = 1.25;
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    expect_same(list, twin.find(points, 1.25f, {}, {.shifts = false}));
    query.cells = vectors, query.repeats = repeats, query.cell_count = 1;
    query.half = query.shifts = query.vectors = query.distances = 1;
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    expect_same(list, twin.find(points, 1.25f, cell, {.half = true, .vectors = true, .distances = true}));
    query.skin = 0.5;
    for (int again = 0; again < 2; ++again) {
        OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
        expect_same(list, twin.find(points, 1.25f, cell,
                                    {.half = true, .vectors = true, .distances = true, .skin = 0.5}));
    }
    EXPECT_EQ(list.searched, 0);

    // In blocks.
    query.skin = 0;
    struct Told
    {
        std::vector<std::uint64_t> ends{0};
        std::vector<std::uint32_t> neighbors;
        std::vector<float> vectors;
        std::uint64_t calls = 0, wanted = 3;
    } told;
    const auto take = [](void* context, std::uint64_t first, std::uint64_t rows,
                         const jostle_neighbor_list* block) {
        Told& all = *static_cast<Told*>(context);
        EXPECT_EQ(first + 1, all.ends.size());
        EXPECT_EQ(block->offsets[rows], block->count);
        for (std::uint64_t k = 1; k <= rows; ++k)
            all.ends.push_back(all.neighbors.size() + block->offsets[k]);
        all.neighbors.insert(all.neighbors.end(), block->neighbors, block->neighbors + block->count);
        const auto* const vectors = static_cast<const float*>(block->vectors);
        all.vectors.insert(all.vectors.end(), vectors, vectors + 3 * block->count);
        return std::int32_t{++all.calls < all.wanted};
    };
    std::int32_t finished = 0;
    OK(jostle_neighbor_finder_stream(handle, &query, ~std::uint64_t{0}, take, &told, &finished, &error));
    EXPECT_EQ(finished, 1);
    EXPECT_EQ(told.calls, 1u);
    told = {};
    OK(jostle_neighbor_finder_stream(handle, &query, 90, take, &told, &finished, &error));
    EXPECT_EQ(finished, 0);
    const auto& all = twin.find(points, 1.25f, cell, {.half = true, .vectors = true});
    EXPECT_EQ(told.ends, std::vector<std::uint64_t>(all.offsets.begin(), all.offsets.end()));
    EXPECT_EQ(told.neighbors, std::vector<std::uint32_t>(all.neighbors.begin(), all.neighbors.end()));
    ASSERT_EQ(told.vectors.size(), 3 * all.vectors.size());
    for (std::size_t k = 0; k < told.vectors.size(); ++k)
        EXPECT_EQ(told.vectors[k], all.vectors[k / 3][static_cast<int>(k % 3)]);

    // Two sets, and cutoffs of points and of types.
    query.half = query.vectors = query.distances = 0;
    query.skin = query.cutoff = 0;
    query.others = others.data(), query.other_count = others.size();
    std::vector<float> radii(points.size()), radii_b(others.size());
    for (auto* each : {&radii, &radii_b})
        for (float& radius : *each)
            radius = static_cast<float>(random.unit());
    query.radii = radii.data(), query.radii_b = radii_b.data();
    jostle::NeighborCutoff<float> cutoff;
    cutoff.radii = radii, cutoff.radii_b = radii_b;
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    expect_same(list, twin.find(points, others, cutoff, cell));
    query.greater = 1, cutoff.greater = true;
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    expect_same(list, twin.find(points, others, cutoff, cell));
    query.radii = query.radii_b = nullptr, query.greater = 0;
    std::vector<std::uint32_t> types(points.size()), types_b(others.size());
    for (auto* each : {&types, &types_b})
        for (std::uint32_t& type : *each)
            type = random.below(2);
    const std::vector<float> table{1, 0.5f, 0.5f, 1.5f};
    query.types = types.data(), query.types_b = types_b.data();
    query.table = table.data(), query.type_count = 2;
    cutoff = {};
    cutoff.types = types, cutoff.types_b = types_b, cutoff.table = table;
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    expect_same(list, twin.find(points, others, cutoff, cell));

    // Many systems.
    query.others = nullptr, query.other_count = 0, query.types_b = nullptr;
    const std::vector<std::uint64_t> offsets{0, 120, 120, 200};
    query.offsets = offsets.data(), query.system_count = 3;
    cutoff.types_b = {};
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    expect_same(list, twin.find_systems(points, offsets, cutoff, std::vector{cell}));
    OK(jostle_release_memory(handle, &error));
    OK(jostle_free(handle, &error));
}

TEST_F(CNeighbors, RefuseWhatTheyCannotRead)
{
    jostle_neighbor_finder* handle = nullptr;
    OK(jostle_neighbor_finder_new(JOSTLE_2D, nullptr, &handle, &error));
    const double points[4] = {0, 0, 1, 0};
    jostle_neighbor_list list{};
    auto query = options_of<jostle_neighbor_query>();
    const auto refusal = [&] {
        EXPECT_NE(jostle_neighbor_finder_find(handle, &query, &list, &error), JOSTLE_OK);
        return std::string(error.message);
    };
    query.count = 2;
    EXPECT_EQ(refusal(), "points is NULL");
    query.points = points;
    query.cell_count = 1;
    EXPECT_EQ(refusal(), "cells is NULL");
    query.cells = points;
    EXPECT_EQ(refusal(), "repeats is NULL");
    query.cell_count = std::uint64_t{1} << 62;
    EXPECT_EQ(refusal(), "cell_count is 4611686018427387904: there aren't so many systems");
    query.cell_count = 0;
    query.type_count = std::uint64_t{1} << 40;
    EXPECT_EQ(refusal(), "type_count is 1099511627776: no table is so large");
    query.type_count = 0;
    query.cutoff = -1;
    EXPECT_EQ(refusal(), "the cutoff is -1; give a length");
    query.cutoff = 2;
    const std::uint64_t offsets[2] = {0, 1};
    query.offsets = offsets, query.system_count = 1;
    EXPECT_NE(refusal().find("offset"), std::string::npos);
    query.others = points;
    EXPECT_EQ(refusal(), "many systems have one set each, but others isn't NULL");
    query.others = nullptr, query.offsets = nullptr;
    const std::int32_t repeats[4] = {};
    const double cells[8] = {};
    query.cells = cells, query.repeats = repeats, query.cell_count = 2;
    EXPECT_EQ(refusal(), "there are 2 cells for one system; give one");
    const auto stop = [](void*, std::uint64_t, std::uint64_t, const jostle_neighbor_list*) {
        return std::int32_t{0};
    };
    std::int32_t finished = 1;
    const auto streamed = [&](std::uint64_t rows) {
        EXPECT_NE(jostle_neighbor_finder_stream(handle, &query, rows, stop, nullptr, &finished, &error),
                  JOSTLE_OK);
        return std::string(error.message);
    };
    EXPECT_EQ(streamed(1), "there are 2 cells for one system; give one");
    query.offsets = offsets;
    EXPECT_EQ(streamed(1), "a stream has one system, but offsets isn't NULL");
    query.offsets = nullptr, query.cell_count = 0;
    EXPECT_EQ(streamed(0), "a stream in blocks of 0 rows never ends; give 1 or more");
    OK(jostle_neighbor_finder_stream(handle, &query, 1, stop, nullptr, &finished, &error));
    EXPECT_EQ(finished, 0);
    OK(jostle_neighbor_finder_find(handle, &query, &list, &error));
    EXPECT_EQ(list.count, 2u);
    EXPECT_EQ(jostle_neighbor_finder_find(handle, nullptr, &list, &error), JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_neighbor_finder_find(handle, &query, nullptr, &error), JOSTLE_INVALID_ARGUMENT);
    OK(jostle_free(handle, &error));
    EXPECT_NE(jostle_neighbor_finder_find(handle, &query, &list, &error), JOSTLE_OK);
}

} // namespace
} // namespace c_twin
