// SPDX-License-Identifier: MIT
// Whole surfaces against every pair of their parts.
#include "jostle/surface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>

#include "jostle/error.hpp"
#include "oracle.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/contract/error_of.hpp"

namespace {

using contract::message_of;
using jostle::Surface;
using jostle::SurfaceFinder;
using jostle::SurfaceOptions;
using jostle::Vec;
using Key = std::pair<std::uint32_t, std::uint32_t>;

/// A sheet of n by n vertices, of which some triangles are left out, beside hair and loose points.
Surface sheet(std::uint32_t n, std::mt19937& random)
{
    std::vector<Surface::Triangle> triangles;
    for (std::uint32_t y = 0; y + 1 < n; ++y)
        for (std::uint32_t x = 0; x + 1 < n; ++x) {
            const std::uint32_t corner = y * n + x;
            if (random() % 8 != 0) triangles.push_back({corner, corner + 1, corner + n});
            if (random() % 8 != 0) triangles.push_back({corner + n + 1, corner + n, corner + 1});
        }
    const std::uint32_t first = n * n;
    const std::vector<Surface::Edge> hair{{first, first + 1}, {first + 1, first + 2}, {0, 1}};
    const std::vector<std::uint32_t> loose{first + 3, first + 4};
    return Surface(triangles, hair, loose, first + 6);
}

template <class T>
std::vector<Vec<3, T>> places(const Surface& surface, int kind, std::mt19937& random)
{
    const auto real = [&] { return std::uniform_real_distribution<T>(0, 1)(random); };
    std::vector<Vec<3, T>> at(surface.vertices());
    for (Vec<3, T>& v : at)
        for (int d = 0; d < 3; ++d)
            v[d] = kind == 0   ? real()
                   : kind == 1 ? static_cast<T>(random() % 4) / 4 // much of it in one place
                   : kind == 2 ? real() * (d == 2 ? T(1e-6) : T(1))
                   : kind == 3 ? T(1e6) + real()
                               : T(0);
    return at;
}

template <class T>
std::array<jostle::Vec3d, 4> four(const std::vector<Vec<3, T>>& at,
                                  const std::array<std::uint32_t, 4>& vertices)
{
    const auto one = [&](std::size_t k) { return jostle::Vec3d(at[vertices[k]]); };
    return {one(0), one(1), one(2), one(3)};
}

/// All pairs of parts without a vertex in common.
template <class Visit>
void each_pair(const Surface& surface, bool edges, const Visit& visit)
{
    const auto once = [](const std::array<std::uint32_t, 4>& v, std::size_t first) {
        for (std::size_t a = 0; a < first; ++a)
            for (std::size_t b = first; b < 4; ++b)
                if (v[a] == v[b]) return false;
        return true;
    };
    if (edges) {
        for (std::uint32_t a = 0; a < surface.edges().size(); ++a)
            for (std::uint32_t b = a + 1; b < surface.edges().size(); ++b) {
                const auto &p = surface.edges()[a], &q = surface.edges()[b];
                const std::array<std::uint32_t, 4> v{p[0], p[1], q[0], q[1]};
                if (once(v, 2)) visit(a, b, v);
            }
        return;
    }
    for (const std::uint32_t a : surface.points())
        for (std::uint32_t b = 0; b < surface.triangles().size(); ++b) {
            const auto& t = surface.triangles()[b];
            const std::array<std::uint32_t, 4> v{a, t[0], t[1], t[2]};
            if (once(v, 1)) visit(a, b, v);
        }
}

template <class T>
void near_is_that_of_all_pairs()
{
    std::mt19937 random(7);
    std::uint64_t found_pairs = 0;
    for (int round = 0; round < 22; ++round) {
        const Surface surface = sheet(3 + static_cast<std::uint32_t>(random() % 6), random);
        const std::vector<Vec<3, T>> at = places<T>(surface, round % 5, random);
        const T distance = round % 4 == 0 ? T(0) : T(0.1);
        SurfaceOptions<T> options;
        std::vector<T> thickness;
        std::vector<std::uint32_t> bodies;
        std::vector<Vec<3, T>> rest;
        if (round % 3 == 0) {
            for (std::size_t k = 0; k < at.size(); ++k)
                thickness.push_back(static_cast<T>(random() % 3) * T(0.03125));
            options.thickness = thickness;
        }
        if (round % 7 == 0) {
            for (std::size_t k = 0; k < at.size(); ++k)
                bodies.push_back(static_cast<std::uint32_t>(random() % 2));
            options.bodies = bodies;
        }
        if (round % 11 == 0) {
            rest = places<T>(surface, 0, random);
            options.rest = rest;
        }
        const auto odd = [](std::uint32_t a, std::uint32_t b) { return (a + b) % 2 == 1; };
        if (round % 5 == 0) options.accept_edge_edge = odd;
        SurfaceFinder<T> finder;
        const jostle::NearSurface<T>& near = finder.near(surface, at, distance, options);
        for (const bool edges : {false, true}) {
            std::map<Key, const jostle::NearParts<T>*> found;
            for (const jostle::NearParts<T>& pair : edges ? near.edge_edge : near.vertex_triangle)
                ASSERT_TRUE(found.emplace(Key{pair.a, pair.b}, &pair).second) << "twice";
            const auto thick = [&](std::span<const std::uint32_t> part) {
                T most = 0;
                for (const std::uint32_t v : part)
                    if (!thickness.empty()) most = std::max(most, thickness[v]);
                return double{most};
            };
            std::size_t right = 0;
            each_pair(
                surface, edges, [&](std::uint32_t a, std::uint32_t b, const std::array<std::uint32_t, 4>& v) {
                    const std::size_t first = edges ? 2 : 1;
                    const double reach = double{distance} + thick(std::span(v).first(first)) +
                                         thick(std::span(v).subspan(first));
                    const double gap = static_cast<double>(oracle::distance(edges, four(at, v)));
                    const bool left_out =
                        (!bodies.empty() && bodies[v[0]] == bodies[v[first]]) ||
                        (!rest.empty() &&
                         static_cast<double>(oracle::distance(edges, four(rest, v))) <= reach) ||
                        (edges && options.accept_edge_edge && !odd(a, b));
                    const auto entry = found.find({a, b});
                    if (gap <= reach - 1e-12 && !left_out) {
                        ASSERT_NE(entry, found.end()) << a << " " << b;
                    }
                    if (gap > reach + 1e-12 || left_out) {
                        ASSERT_EQ(entry, found.end()) << a << " " << b;
                    }
                    if (entry == found.end()) return;
                    ++right;
                    ASSERT_EQ(entry->second->vertices, v);
                    ASSERT_NEAR(entry->second->distance, gap, (std::is_same_v<T, float> ? 1e-7 : 1e-12));
                });
            ASSERT_EQ(right, found.size());
            found_pairs += right;
        }
    }
    EXPECT_GT(found_pairs, 3000u);
}
TEST(Surfaces, NearIsThatOfAllPairs)
{
    near_is_that_of_all_pairs<double>();
    near_is_that_of_all_pairs<float>();
}

template <class T>
void moving_is_that_of_all_pairs()
{
    std::mt19937 random(8);
    std::uint64_t impacts = 0;
    for (int round = 0; round < 12; ++round) {
        const Surface surface = sheet(3 + static_cast<std::uint32_t>(random() % 4), random);
        const std::vector<Vec<3, T>> from = places<T>(surface, round % 3, random);
        std::vector<Vec<3, T>> to = places<T>(surface, round % 2 == 0 ? 0 : round % 3, random);
        if (round % 2 == 0)
            for (std::size_t k = 0; k < to.size(); ++k)
                to[k] = from[k] + (to[k] - Vec<3, T>{T(0.5), T(0.5), T(0.5)}) * T(0.2);
        const T distance = round % 3 == 0 ? T(0.015625) : T(0);
        SurfaceFinder<T> finder;
        const jostle::MovingSurface<T>& moving = finder.moving(surface, from, to, distance);
        T least = 1;
        for (const bool edges : {false, true}) {
            std::map<Key, T> found;
            for (const jostle::PartImpact<T>& pair : edges ? moving.edge_edge : moving.vertex_triangle)
                ASSERT_TRUE(found.emplace(Key{pair.a, pair.b}, pair.time).second) << "twice";
            each_pair(
                surface, edges, [&](std::uint32_t a, std::uint32_t b, const std::array<std::uint32_t, 4>& v) {
                    const auto time =
                        edges ? jostle::edge_edge_impact(four(from, v), four(to, v), double{distance})
                              : jostle::vertex_triangle_impact(four(from, v), four(to, v), double{distance});
                    const auto entry = found.find({a, b});
                    ASSERT_EQ(time.has_value(), entry != found.end()) << a << " " << b;
                    if (!time) return;
                    ++impacts;
                    ASSERT_LE(double{entry->second}, *time);
                    ASSERT_NEAR(double{entry->second}, *time, 1e-7);
                    least = std::min(least, entry->second);
                });
        }
        ASSERT_EQ(moving.safe_step, least);
    }
    EXPECT_GT(impacts, 300u);
}
TEST(Surfaces, MovingIsThatOfAllPairs)
{
    moving_is_that_of_all_pairs<double>();
    moving_is_that_of_all_pairs<float>();
}

/// Four places that move straight, in small whole numbers and parts of them, and a time at which their pair
/// meets: anyhow; all in one plane; in one line; with an edge of no length; at corners; or so that it is a
/// point by then. Fast corners turn triangles over on the way.
struct Meeting
{
    std::array<jostle::Vec3d, 4> from, to;
    double time;
};
Meeting meeting(bool edges, std::mt19937& random)
{
    const auto whole = [&](int most) {
        return static_cast<double>(random() % static_cast<unsigned>(2 * most + 1)) - most;
    };
    const auto kind = random() % 6;
    const int speed = random() % 4 == 0 ? 16 : 3;
    std::array<jostle::Vec3d, 4> at, moves;
    for (std::size_t k = 0; k < 4; ++k)
        for (int d = 0; d < 3; ++d) {
            const bool flat = (kind == 1 && d == 2) || (kind == 2 && d != 0);
            at[k][d] = flat || kind == 5 ? 0 : 8 * whole(3);
            moves[k][d] = flat ? 0 : whole(speed);
        }
    if (kind == 3) at[3] = at[2], moves[3] = moves[2];
    const double part = kind == 4 ? double(random() % 2) : double(random() % 5) / 4,
                 other = kind == 4 ? 0 : double(random() % 3) / 2 * (1 - part);
    if (edges) {
        const jostle::Vec3d meet = at[2] * (1 - part) + at[3] * part;
        at[1] = random() % 2 == 0 ? meet : meet * 2.0 - at[0];
    } else {
        at[0] = at[1] * (1 - part - other) + at[2] * part + at[3] * other;
    }
    Meeting result;
    result.time = std::array{0.0, 0.25, 0.5, 1.0}[random() % 4];
    for (std::size_t k = 0; k < 4; ++k) {
        result.from[k] = at[k] - moves[k] * result.time;
        result.to[k] = at[k] + moves[k] * (1 - result.time);
    }
    return result;
}

/// Also far from the origin, where they move by 1e-6 at 1e6, and in denormal numbers; all exact.
TEST(Surfaces, MovingMissesNothingThatMeetsByConstruction)
{
    std::mt19937 random(14);
    for (const auto& [offset, scale] : {std::pair{0.0, 1.0}, {0x1p20, 0x1p-24}, {0.0, 0x1p-1070}})
        for (const bool edges : {false, true}) {
            constexpr std::uint32_t pairs = 300;
            std::vector<Surface::Triangle> triangles;
            std::vector<Surface::Edge> hair;
            std::vector<std::uint32_t> loose, bodies;
            std::vector<jostle::Vec3d> from, to;
            std::vector<Meeting> meetings;
            for (std::uint32_t pair = 0; pair < pairs; ++pair) {
                const std::uint32_t first = 4 * pair;
                if (edges) {
                    hair.push_back({first, first + 1});
                    hair.push_back({first + 2, first + 3});
                } else {
                    loose.push_back(first);
                    triangles.push_back({first + 1, first + 2, first + 3});
                }
                const Meeting& one = meetings.emplace_back(meeting(edges, random));
                const jostle::Vec3d place{256.0 * (pair % 20), 256.0 * (pair / 20), 0};
                for (std::size_t k = 0; k < 4; ++k)
                    for (const auto& [in, out] : {std::pair{&one.from, &from}, std::pair{&one.to, &to}})
                        out->push_back(((*in)[k] + place) * scale + jostle::Vec3d{offset, offset, offset});
            }
            SurfaceFinder<double> finder;
            const Surface surface(triangles, hair, loose);
            const auto& moving = finder.moving(surface, from, to);
            std::map<std::uint32_t, double> found; // by the pair that is meant; cells don't reach each other
            for (const auto& impact : edges ? moving.edge_edge : moving.vertex_triangle)
                if (edges ? impact.vertices[0] / 4 == impact.vertices[2] / 4
                          : impact.a / 4 == impact.vertices[1] / 4 && impact.a % 4 == 0)
                    found[impact.vertices[0] / 4] = impact.time;
            ASSERT_EQ(found.size(), pairs) << scale;
            for (std::uint32_t pair = 0; pair < pairs; ++pair) {
                const double time = found[pair];
                ASSERT_LE(time, meetings[pair].time) << scale << " " << pair;
                ASSERT_LE(moving.safe_step, time);
                const oracle::Point gap =
                    oracle::shortest(edges, oracle::places(meetings[pair].from, meetings[pair].to, time));
                ASSERT_LE(oracle::dot(gap, gap), 1e-8) << scale << " " << pair; // 1e-6 of about a hundred
            }
        }
}

TEST(Surfaces, CrossingsAreThoseOfAllPairs)
{
    std::mt19937 random(9);
    for (const double scale : {1.0, 0x1p90, 0x1p100, 0x1p-80}) {
        const Surface surface = sheet(6, random);
        std::vector<jostle::Vec3d> at(surface.vertices());
        for (jostle::Vec3d& v : at)
            for (int d = 0; d < 3; ++d)
                v[d] = double(random() % 6) * scale;
        if (scale > 1e29) { // refused: beyond what is promised
            SurfaceFinder<double> finder;
            EXPECT_NE(message_of([&] { finder.crossings(surface, at); }).find("vertex"), std::string::npos);
            continue;
        }
        std::set<jostle::Crossing> right;
        for (std::uint32_t e = 0; e < surface.edges().size(); ++e)
            for (std::uint32_t t = 0; t < surface.triangles().size(); ++t) {
                const auto& edge = surface.edges()[e];
                const auto& corner = surface.triangles()[t];
                if (std::find_first_of(corner.begin(), corner.end(), edge.begin(), edge.end()) !=
                    corner.end())
                    continue;
                if (oracle::crosses({at[edge[0]], at[edge[1]]},
                                    {at[corner[0]], at[corner[1]], at[corner[2]]}))
                    right.insert({e, t});
            }
        SurfaceFinder<double> finder;
        std::vector<std::uint32_t> bodies(at.size());
        for (std::size_t k = 0; k < bodies.size(); ++k)
            bodies[k] = static_cast<std::uint32_t>(k % 3);
        std::set<jostle::Crossing> of_two;
        for (const jostle::Crossing& one : right)
            if (bodies[surface.edges()[one.edge][0]] != bodies[surface.triangles()[one.triangle][0]])
                of_two.insert(one);
        const auto& between = finder.crossings(surface, at, {.bodies = bodies});
        EXPECT_EQ(std::set<jostle::Crossing>(between.begin(), between.end()), of_two);
        const auto& found = finder.crossings(surface, at);
        EXPECT_EQ(std::set<jostle::Crossing>(found.begin(), found.end()), right);
        EXPECT_EQ(found.size(), right.size());
        EXPECT_GT(right.size(), 100u);
    }
}

/// Everything a finder answers, in its order.
template <class T>
std::vector<double> all_answers(const Surface& surface, const std::vector<Vec<3, T>>& from,
                                const std::vector<Vec<3, T>>& to, const jostle::FinderOptions& options)
{
    std::vector<double> all;
    SurfaceFinder<T> finder(options);
    const auto& near = finder.near(surface, from, T(0.03));
    for (const auto* pairs : {&near.vertex_triangle, &near.edge_edge})
        for (const auto& pair : *pairs) {
            all.insert(all.end(), {double(pair.a), double(pair.b), double{pair.distance}});
            all.insert(all.end(), pair.weights.begin(), pair.weights.end());
        }
    const auto& moving = finder.moving(surface, from, to);
    all.push_back(double{moving.safe_step});
    for (const auto* pairs : {&moving.vertex_triangle, &moving.edge_edge})
        for (const auto& pair : *pairs)
            all.insert(all.end(), {double(pair.a), double(pair.b), double{pair.time}});
    for (const jostle::Crossing& crossing : finder.crossings(surface, from))
        all.insert(all.end(), {double(crossing.edge), double(crossing.triangle)});
    return all;
}
TEST(Surfaces, AnswersAreTheSameForAnyThreadsAndInstructionSet)
{
    std::mt19937 random(10);
    const Surface surface = sheet(25, random);
    const auto from = places<float>(surface, 0, random), other = places<float>(surface, 0, random);
    auto to = from;
    for (std::size_t k = 0; k < to.size(); ++k)
        to[k] += (other[k] - from[k]) * 0.05f;
    const std::vector<double> right =
        all_answers(surface, from, to, {.executor = &jostle::serial_executor()});
    EXPECT_GT(right.size(), 5000u);
    for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
        const auto threads = jostle::make_thread_executor(3);
        EXPECT_EQ(all_answers(surface, from, to, {.executor = threads.get(), .instruction_set = set}), right);
    }
}

TEST(Surfaces, ASteadyStepAllocatesNothing)
{
    std::mt19937 random(11);
    const Surface surface = sheet(16, random);
    auto from = places<double>(surface, 0, random);
    contract::CountingMemory memory;
    {
        SurfaceFinder<double> finder({.executor = &jostle::serial_executor(), .memory = &memory});
        std::uint64_t allocations = 0;
        for (int step = 0; step < 6; ++step) {
            if (step == 2) allocations = memory.allocations;
            auto to = from;
            for (jostle::Vec3d& v : to)
                v *= 1.0 + 1e-9 * step;
            finder.near(surface, from, 0.02);
            finder.moving(surface, from, to);
            finder.crossings(surface, from);
        }
        EXPECT_EQ(memory.allocations, allocations);
        const std::uint64_t bytes = memory.bytes;
        finder.release_memory();
        EXPECT_LT(memory.bytes, bytes / 10);
    }
    EXPECT_EQ(memory.bytes, 0u);
}

/// Beside results, a quarter of which is to spare: what the guide says.
TEST(Surfaces, MemoryForATriangleIsLimited)
{
    constexpr std::uint32_t side = 97, in_fold = 12; // a cloth in 8 folds, as in `jostle bench surfaces`
    std::mt19937 random(13);
    const auto aside = [&](double most) {
        return std::uniform_real_distribution<double>(-most, most)(random);
    };
    std::vector<Surface::Triangle> triangles;
    std::vector<jostle::Vec3d> at, to;
    for (std::uint32_t k = 0; k < side * side; ++k) {
        const std::uint32_t x = k % side, y = k / side, layer = x / in_fold, in = x % in_fold;
        at.push_back({layer % 2 == 0 ? in : double(in_fold - in), double(y), 0.2 * layer});
        for (int d = 0; d < 3; ++d)
            at[k][d] += aside(d == 2 ? 0.06 : 0.1);
        to.push_back(at[k] + jostle::Vec3d{aside(0.2), aside(0.2), aside(0.2)});
        if (x + 1 == side || y + 1 == side) continue;
        triangles.push_back({k, k + 1, k + side});
        triangles.push_back({k + 1, k + side + 1, k + side});
    }
    const Surface surface(triangles);
    const auto beside_results = [&](const auto& search) {
        contract::CountingMemory memory;
        SurfaceFinder<double> finder({.executor = &jostle::serial_executor(), .memory = &memory});
        const double results = search(finder) * 1.25;
        EXPECT_GT(results, double(triangles.size()));
        return (double(memory.peak) - results) / double(triangles.size());
    };
    const auto bytes = [](const auto& list) { return double(list.size() * sizeof(*list.begin())); };
    EXPECT_LT(beside_results([&](auto& finder) {
                  const auto& near = finder.near(surface, at, 0.2);
                  return bytes(near.vertex_triangle) + bytes(near.edge_edge);
              }),
              400);
    EXPECT_LT(beside_results([&](auto& finder) {
                  const auto& moving = finder.moving(surface, at, to);
                  return bytes(moving.vertex_triangle) + bytes(moving.edge_edge);
              }),
              400);
    EXPECT_LT(beside_results([&](auto& finder) { return bytes(finder.crossings(surface, to)); }), 400);
}

TEST(Surfaces, AnAllocationThatFailsLeavesAFinderThatWorks)
{
    std::mt19937 random(12);
    const Surface surface = sheet(8, random);
    const auto at = places<double>(surface, 0, random);
    SurfaceFinder<double> twin;
    const std::uint64_t right = twin.near(surface, at, 0.1).edge_edge.size();
    for (std::uint64_t failing = 0; failing < 100; ++failing) {
        contract::CountingMemory memory;
        memory.failing_allocation = failing;
        std::unique_ptr<SurfaceFinder<double>> finder;
        try {
            finder = std::make_unique<SurfaceFinder<double>>(
                jostle::FinderOptions{.executor = &jostle::serial_executor(), .memory = &memory});
            finder->near(surface, at, 0.1);
            break;
        } catch (const std::bad_alloc&) {
        }
        memory.failing_allocation = contract::CountingMemory::never;
        if (finder) {
            EXPECT_EQ(finder->near(surface, at, 0.1).edge_edge.size(), right) << failing;
        }
    }
}

TEST(Surfaces, TopologyHasEachEdgeOnce)
{
    const std::vector<Surface::Triangle> triangles{{0, 1, 2}, {2, 1, 3}, {2, 1, 0}};
    const std::vector<Surface::Edge> edges{{3, 1}, {5, 4}};
    const std::vector<std::uint32_t> points{7};
    const Surface surface(triangles, edges, points);
    EXPECT_EQ(surface.vertices(), 8u);
    const std::vector<Surface::Edge> right{{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}, {4, 5}};
    EXPECT_TRUE(std::equal(surface.edges().begin(), surface.edges().end(), right.begin(), right.end()));
    const std::vector<std::uint32_t> named{0, 1, 2, 3, 4, 5, 7};
    EXPECT_TRUE(std::equal(surface.points().begin(), surface.points().end(), named.begin(), named.end()));

    const auto refusal = [](const std::vector<Surface::Triangle>& t, const std::vector<Surface::Edge>& e,
                            const std::vector<std::uint32_t>& p,
                            std::size_t n) { return message_of([&] { const Surface made(t, e, p, n); }); };
    EXPECT_NE(refusal({{0, 1, 2}, {3, 4, 3}}, {}, {}, 0).find("triangle 1 has vertex 3 twice"),
              std::string::npos);
    EXPECT_NE(refusal({{0, 1, 2}}, {}, {}, 2).find("triangle 0 has vertex 2 of 2"), std::string::npos);
    EXPECT_NE(refusal({}, {{4, 4}}, {}, 0).find("edge 0 has vertex 4 twice"), std::string::npos);
    EXPECT_NE(refusal({}, {}, {9}, 3).find("point 0 has vertex 9 of 3"), std::string::npos);
    EXPECT_EQ(Surface().vertices(), 0u);
    SurfaceFinder<float> finder;
    EXPECT_TRUE(finder.near(Surface(), {}, 1).edge_edge.empty());
}

TEST(Surfaces, BadInputIsNamedAndLeavesNoResults)
{
    std::mt19937 random(13);
    const Surface surface = sheet(5, random);
    const auto good = places<float>(surface, 0, random);
    SurfaceFinder<float> finder;
    const auto& near = finder.near(surface, good, 0.5f);
    EXPECT_FALSE(near.edge_edge.empty());
    auto bad = good;
    bad[6][1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(message_of([&] { finder.near(surface, bad, 0.5f); }).find("vertex 6 of positions has nan"),
              std::string::npos);
    EXPECT_TRUE(near.edge_edge.empty());
    EXPECT_NE(message_of([&] { finder.moving(surface, good, bad); }).find("vertex 6 of positions to move to"),
              std::string::npos);
    EXPECT_NE(message_of([&] { finder.near(surface, good, -1.0f); }).find("distance is -1"),
              std::string::npos);
    bad.pop_back();
    EXPECT_NE(message_of([&] { finder.crossings(surface, bad); }).find("positions and"), std::string::npos);
    EXPECT_NE(message_of([&] { finder.moving(surface, good, {}); }).find("positions to move to"),
              std::string::npos);
    const std::vector<float> thin(good.size(), -0.5f);
    EXPECT_NE(
        message_of([&] { finder.near(surface, good, 0, {.thickness = thin}); }).find("thickness of vertex 0"),
        std::string::npos);
    EXPECT_FALSE(finder.near(surface, good, 0.5f).edge_edge.empty());
}

} // namespace
