// SPDX-License-Identifier: MIT
// Surfaces that bend in C.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "jostle/surface.hpp"
#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

using CSurfaces = CTwin;
using jostle::Surface;

template <class T>
using Points = std::vector<jostle::Vec<3, T>>;

/// Triangles, edges and points among 60 vertices, in no order.
struct Soup
{
    explicit Soup(Random& random)
    {
        for (std::uint32_t k = 0; k < 40; ++k) {
            const std::uint32_t first = random.below(48);
            triangles.push_back({first, first + 1 + random.below(4), first + 5 + random.below(4)});
        }
        edges = {{3, 57}, {56, 55}};
        points = {58};
    }
    [[nodiscard]] jostle_surface_parts parts() const
    {
        return {triangles[0].data(),
                triangles.size(),
                edges[0].data(),
                edges.size(),
                points.data(),
                points.size(),
                60};
    }
    std::vector<Surface::Triangle> triangles;
    std::vector<Surface::Edge> edges;
    std::vector<std::uint32_t> points;
};

template <class T>
Points<T> random_places(Random& random)
{
    Points<T> places(60);
    for (auto& place : places)
        for (int d = 0; d < 3; ++d)
            place[d] = static_cast<T>(2 * random.unit());
    return places;
}

/// The same items, byte for byte.
template <class Item>
void expect_same(const jostle_blocks& found, const jostle::BlockBuffer<Item>& twin)
{
    EXPECT_EQ(found.item_size, sizeof(Item));
    const std::vector<Item> items = items_of<Item>(found), wanted = twin.to_vector();
    ASSERT_EQ(items.size(), wanted.size());
    ASSERT_FALSE(items.empty());
    EXPECT_EQ(std::memcmp(items.data(), wanted.data(), items.size() * sizeof(Item)), 0);
}

template <class T>
void try_all_searches(jostle_space space)
{
    jostle_error error;
    Random random(7);
    const Soup soup(random);
    const Surface surface(soup.triangles, soup.edges, soup.points, 60);
    const Points<T> at = random_places<T>(random), to = random_places<T>(random);
    const jostle_surface_parts parts = soup.parts();
    jostle_surface* handle = nullptr;
    OK(jostle_surface_new(&parts, &handle, &error));
    jostle_surface_parts read{};
    OK(jostle_surface_parts_read(handle, &read, &error));
    EXPECT_EQ(read.vertices, 60u);
    ASSERT_EQ(read.triangle_count, surface.triangles().size());
    EXPECT_EQ(std::memcmp(read.triangles, surface.triangles().data(), 12 * read.triangle_count), 0);
    ASSERT_EQ(read.edge_count, surface.edges().size());
    EXPECT_EQ(std::memcmp(read.edges, surface.edges().data(), 8 * read.edge_count), 0);
    ASSERT_EQ(read.point_count, surface.points().size());
    EXPECT_TRUE(std::equal(read.points, read.points + read.point_count, surface.points().begin()));

    jostle_surface_finder* finder = nullptr;
    OK(jostle_surface_finder_new(space, nullptr, &finder, &error));
    jostle::SurfaceFinder<T> twin;
    // Plain, and then with everything that options have.
    std::vector<T> thickness(60);
    std::vector<std::uint32_t> bodies(60);
    for (std::size_t k = 0; k < 60; ++k)
        thickness[k] = static_cast<T>(random.unit() / 8), bodies[k] = random.below(3);
    const Points<T> rest = random_places<T>(random);
    const auto odd_vertex = [](void*, std::uint32_t a, std::uint32_t) { return std::int32_t(a % 2); };
    const auto low_edge = [](void* most, std::uint32_t, std::uint32_t b) {
        return std::int32_t{b < *static_cast<const std::uint32_t*>(most)};
    };
    std::uint32_t most = 60;
    auto options = options_of<jostle_surface_options>();
    jostle::SurfaceOptions<T> wish;
    const auto accept_vertex = [](std::uint32_t a, std::uint32_t) { return a % 2 != 0; };
    const auto accept_edge = [&](std::uint32_t, std::uint32_t b) { return b < most; };
    for (int step = 0; step < 5; ++step) {
        if (step == 1) options.thickness = thickness.data(), wish.thickness = thickness;
        if (step == 2) options.rest = rest.data(), wish.rest = rest;
        if (step == 3) options.bodies = bodies.data(), wish.bodies = bodies;
        if (step == 4) {
            options.accept_vertex_triangle = odd_vertex, options.accept_edge_edge = low_edge;
            options.context = &most;
            options.tolerance = wish.tolerance = 1e-3;
            wish.accept_vertex_triangle = accept_vertex, wish.accept_edge_edge = accept_edge;
        }
        const jostle_surface_options* const given = step == 0 ? nullptr : &options;
        jostle_near_surface near{};
        OK(jostle_surface_finder_near(finder, handle, at.data(), 60, 0.125, given, &near, &error));
        const auto& near_twin = twin.near(surface, at, T(0.125), wish);
        expect_same(near.vertex_triangle, near_twin.vertex_triangle);
        expect_same(near.edge_edge, near_twin.edge_edge);
        jostle_moving_surface moving{};
        OK(jostle_surface_finder_moving(finder, handle, at.data(), to.data(), 60, 0.0625, given, &moving,
                                        &error));
        const auto& moving_twin = twin.moving(surface, at, to, T(0.0625), wish);
        expect_same(moving.vertex_triangle, moving_twin.vertex_triangle);
        expect_same(moving.edge_edge, moving_twin.edge_edge);
        EXPECT_EQ(moving.safe_step, double{moving_twin.safe_step});
        jostle_blocks crossings{};
        OK(jostle_surface_finder_crossings(finder, handle, at.data(), 60, given, &crossings, &error));
        expect_same(crossings, twin.crossings(surface, at, wish));
    }
    OK(jostle_release_memory(finder, &error));
    OK(jostle_free(finder, &error));
    OK(jostle_free(handle, &error));
    EXPECT_EQ(jostle_surface_parts_read(handle, &read, &error), JOSTLE_BAD_HANDLE);
}

TEST_F(CSurfaces, AreThoseOfCpp)
{
    try_all_searches<float>(JOSTLE_3F);
    try_all_searches<double>(JOSTLE_3D);
}

TEST_F(CSurfaces, AnswerSingleQuestions)
{
    Random random(3);
    std::vector<std::array<jostle::Vec3d, 4>> from(200), to(200);
    for (auto* each : {&from, &to})
        for (auto& corners : *each)
            for (auto& corner : corners)
                for (int d = 0; d < 3; ++d)
                    corner[d] = random.unit();
    const double* const begin = from[0][0].data();
    const double* const end = to[0][0].data();
    std::vector<double> times(200);
    std::vector<jostle::PartDistance> distances(200);
    for (const jostle_part_kind kind : {JOSTLE_VERTEX_TRIANGLE, JOSTLE_EDGE_EDGE}) {
        const bool vertex = kind == JOSTLE_VERTEX_TRIANGLE;
        const auto impact = vertex ? jostle::vertex_triangle_impact : jostle::edge_edge_impact;
        const auto distance = vertex ? jostle::vertex_triangle_distance : jostle::edge_edge_distance;
        int found = 0;
        for (const double tolerance : {0.0, 1e-2}) {
            OK(jostle_part_impacts(kind, begin, end, 200, 0.03, tolerance, times.data(), &error));
            for (std::size_t k = 0; k < 200; ++k) {
                const auto twin = impact(from[k], to[k], 0.03, tolerance == 0 ? 1e-6 : tolerance);
                EXPECT_EQ(times[k], twin.value_or(std::numeric_limits<double>::infinity()));
                found += twin ? 1 : 0;
            }
        }
        EXPECT_GT(found, 20);
        EXPECT_LT(found, 380);
        OK(jostle_part_distances(kind, begin, 200, &distances[0].distance, &error));
        for (std::size_t k = 0; k < 200; ++k) {
            const jostle::PartDistance twin = distance(from[k]);
            EXPECT_EQ(std::memcmp(&distances[k], &twin, sizeof twin), 0);
        }
    }
    OK(jostle_part_impacts(JOSTLE_EDGE_EDGE, nullptr, nullptr, 0, 0, 0, nullptr, &error));
    OK(jostle_part_distances(JOSTLE_EDGE_EDGE, nullptr, 0, nullptr, &error));

    // What is wrong, and of which pair.
    const auto refusal = [&](jostle_part_kind kind, const double* first, double within, double tolerance) {
        EXPECT_EQ(jostle_part_impacts(kind, first, end, 3, within, tolerance, times.data(), &error),
                  JOSTLE_INVALID_ARGUMENT);
        return std::string(error.message);
    };
    EXPECT_EQ(refusal(0, begin, 0, 0), "there is no kind 0 of parts");
    EXPECT_EQ(refusal(JOSTLE_EDGE_EDGE, nullptr, 0, 0), "from is NULL");
    EXPECT_NE(refusal(JOSTLE_EDGE_EDGE, begin, -1, 0).find("distance"), std::string::npos);
    EXPECT_NE(refusal(JOSTLE_EDGE_EDGE, begin, 0, -1).find("tolerance"), std::string::npos);
    from[2][1][0] = std::numeric_limits<double>::quiet_NaN();
    times.assign(200, -1);
    EXPECT_NE(refusal(JOSTLE_EDGE_EDGE, begin, 0, 0), "");
    EXPECT_EQ(error.index, 2u);
    EXPECT_GE(times[1], 0);
    EXPECT_EQ(times[2], -1);
    EXPECT_EQ(jostle_part_impacts(JOSTLE_EDGE_EDGE, begin, end, 3, 0, 0, nullptr, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_part_distances(3, begin, 1, &distances[0].distance, &error), JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_part_distances(JOSTLE_EDGE_EDGE, begin, 1, nullptr, &error), JOSTLE_INVALID_ARGUMENT);
}

TEST_F(CSurfaces, RefuseWhatTheyCannotRead)
{
    jostle_surface* surface = nullptr;
    jostle_surface_parts parts{};
    const auto new_refusal = [&] {
        EXPECT_NE(jostle_surface_new(&parts, &surface, &error), JOSTLE_OK);
        EXPECT_EQ(surface, nullptr);
        return std::string(error.message);
    };
    const std::uint32_t triangles[6] = {0, 1, 2, 3, 4, 3};
    parts.triangle_count = 2;
    EXPECT_EQ(new_refusal(), "triangles is NULL");
    parts.triangles = triangles;
    EXPECT_NE(new_refusal().find("triangle 1 has vertex 3 twice"), std::string::npos);
    EXPECT_EQ(error.index, 1u);
    parts.triangle_count = 1;
    parts.edge_count = 1;
    EXPECT_EQ(new_refusal(), "edges is NULL");
    parts.edge_count = 0, parts.point_count = 1;
    EXPECT_EQ(new_refusal(), "points is NULL");
    parts.point_count = 0;
    EXPECT_EQ(jostle_surface_new(nullptr, &surface, &error), JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_surface_new(&parts, nullptr, &error), JOSTLE_INVALID_ARGUMENT);
    OK(jostle_surface_new(&parts, &surface, &error));
    EXPECT_EQ(jostle_surface_parts_read(surface, nullptr, &error), JOSTLE_INVALID_ARGUMENT);

    jostle_surface_finder* finder = nullptr;
    for (const jostle_space space : std::initializer_list<jostle_space>{JOSTLE_2F, JOSTLE_2D, 0, 5}) {
        EXPECT_EQ(jostle_surface_finder_new(space, nullptr, &finder, &error), JOSTLE_INVALID_ARGUMENT);
        EXPECT_EQ(std::string(error.message), "the space is " + std::to_string(space) +
                                                  ": surfaces bend in JOSTLE_3F (2) or JOSTLE_3D (4)");
    }
    OK(jostle_surface_finder_new(JOSTLE_3D, nullptr, &finder, &error));
    const double at[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    jostle_near_surface near{};
    jostle_moving_surface moving{};
    jostle_blocks crossings{};
    auto options = options_of<jostle_surface_options>();
    const auto refusal = [&](const double* positions, std::uint64_t count, double distance) {
        EXPECT_NE(
            jostle_surface_finder_near(finder, surface, positions, count, distance, &options, &near, &error),
            JOSTLE_OK);
        return std::string(error.message);
    };
    EXPECT_EQ(refusal(nullptr, 3, 1), "positions is NULL");
    EXPECT_NE(refusal(at, 2, 1).find("3 vertices"), std::string::npos);
    EXPECT_EQ(error.status, JOSTLE_SIZE_MISMATCH);
    EXPECT_NE(refusal(at, 3, -1).find("the distance is -1"), std::string::npos);
    options.tolerance = -1;
    EXPECT_NE(refusal(at, 3, 1).find("the tolerance is -1"), std::string::npos);
    options.tolerance = 0, options.struct_size = 1;
    EXPECT_NE(refusal(at, 3, 1).find("jostle_surface_options"), std::string::npos);
    EXPECT_EQ(jostle_surface_finder_near(finder, surface, at, 3, 1, nullptr, nullptr, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_surface_finder_moving(finder, surface, at, nullptr, 3, 1, nullptr, &moving, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(std::string(error.message), "to is NULL");
    EXPECT_EQ(jostle_surface_finder_moving(finder, surface, nullptr, at, 3, 1, nullptr, &moving, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(std::string(error.message), "from is NULL");
    EXPECT_EQ(jostle_surface_finder_moving(finder, surface, at, at, 3, 1, nullptr, nullptr, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_surface_finder_crossings(finder, surface, at, 3, nullptr, nullptr, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_surface_finder_crossings(finder, surface, nullptr, 3, nullptr, &crossings, &error),
              JOSTLE_INVALID_ARGUMENT);
    EXPECT_EQ(jostle_surface_finder_crossings(finder, nullptr, at, 3, nullptr, &crossings, &error),
              JOSTLE_INVALID_ARGUMENT);
    OK(jostle_surface_finder_near(finder, surface, at, 3, 1, nullptr, &near, &error));
    EXPECT_EQ(near.vertex_triangle.count, 0u);
    OK(jostle_surface_finder_moving(finder, surface, at, at, 3, 1, nullptr, &moving, &error));
    EXPECT_EQ(moving.safe_step, 1);
    OK(jostle_free(finder, &error));
    OK(jostle_free(surface, &error));
}

TEST_F(CSurfaces, EndWithTheNumberOfACallbackThatFailed)
{
    const std::uint32_t triangles[6] = {0, 1, 2, 3, 4, 5};
    const float at[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1};
    jostle_surface_parts parts{};
    parts.triangles = triangles, parts.triangle_count = 2;
    jostle_surface* surface = nullptr;
    OK(jostle_surface_new(&parts, &surface, &error));
    jostle_surface_finder* finder = nullptr;
    OK(jostle_surface_finder_new(JOSTLE_3F, nullptr, &finder, &error));
    auto options = options_of<jostle_surface_options>();
    options.context = finder;
    const auto fail = [](void*, std::uint32_t, std::uint32_t) { return std::int32_t{-42}; };
    // A callback can't free the finder that asks it.
    const auto free_it = [](void* context, std::uint32_t, std::uint32_t) {
        return jostle_free(context, nullptr) == JOSTLE_OK ? std::int32_t{-1} : std::int32_t{1};
    };
    jostle_near_surface near{};
    for (const auto member :
         {&jostle_surface_options::accept_vertex_triangle, &jostle_surface_options::accept_edge_edge}) {
        options.accept_vertex_triangle = options.accept_edge_edge = free_it;
        OK(jostle_surface_finder_near(finder, surface, at, 6, 2, &options, &near, &error));
        EXPECT_EQ(near.vertex_triangle.count, 6u);
        EXPECT_EQ(near.edge_edge.count, 9u);
        options.*member = fail;
        EXPECT_EQ(jostle_surface_finder_near(finder, surface, at, 6, 2, &options, &near, &error),
                  JOSTLE_CALLBACK_FAILED);
        EXPECT_EQ(error.callback_result, -42);
    }
    OK(jostle_free(finder, &error));
    OK(jostle_free(surface, &error));
}

} // namespace
} // namespace c_twin
