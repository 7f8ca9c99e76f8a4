// SPDX-License-Identifier: MIT
// One vertex and one triangle, or two edges, against the oracle.
#include "surfaces/parts.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "jostle/error.hpp"
#include "oracle.hpp"

namespace {

using jostle::Vec3d;
using Four = std::array<Vec3d, 4>;

/// Four places of some kind: anywhere; on few whole numbers, where much is equal, parallel or flat; far from
/// the origin; tiny or huge; nearly in one plane or line.
class Places
{
  public:
    explicit Places(std::uint32_t seed) : random_(seed) {}

    Four any()
    {
        Four four;
        const int kind = number(7);
        for (Vec3d& v : four)
            v = {coordinate(kind), coordinate(kind), coordinate(kind)};
        if (number(5) == 0) four[index()] = four[index()];
        if (kind == 4) // nearly in one plane
            for (Vec3d& v : four)
                v[2] *= 1e-9;
        if (kind == 5) // nearly in one line
            for (Vec3d& v : four)
                v[1] *= 1e-8, v[2] *= 1e-8;
        if (kind == 6) scale(four, std::ldexp(1.0, number(2) == 0 ? -190 : 180));
        return four;
    }
    /// From some places to others; also along with each other, and such that most don't move.
    std::pair<Four, Four> motion()
    {
        const Four from = any();
        Four to = any();
        switch (number(5)) {
        case 0:
            for (std::size_t k = 0; k < 4; ++k)
                to[k] = from[k] + to[0] * 0.25;
            to[index()] += Vec3d{real(), real(), real()};
            break;
        case 1: {
            const std::size_t one = index();
            for (std::size_t k = 0; k < 4; ++k)
                if (k != one) to[k] = from[k];
            break;
        }
        case 2:
            for (std::size_t k = 0; k < 4; ++k) // through each other: turned over
                to[k] = from[k] * -1.0;
            break;
        default:
            break;
        }
        return {from, to};
    }
    int number(int below) { return static_cast<int>(random_() % static_cast<std::uint32_t>(below)); }
    double real() { return std::uniform_real_distribution<>(-1, 1)(random_); }
    std::size_t index() { return static_cast<std::size_t>(number(4)); }

    static void scale(Four& four, double by)
    {
        for (Vec3d& v : four)
            v *= by;
    }

  private:
    double coordinate(int kind)
    {
        switch (kind) {
        case 0:
            return number(5) - 2;
        case 1:
            return number(3) - 1;
        case 2:
            return 1e6 + real() * 1e-6;
        default:
            return real();
        }
    }
    std::mt19937 random_;
};

double size_of(const Four& a, const Four& b)
{
    double size = 0;
    for (const Four& four : {a, b})
        for (std::size_t k = 0; k < 4; ++k)
            for (int d = 0; d < 3; ++d)
                size = std::max({size, std::abs(four[k][d] - four[0][d]), std::abs(four[k][d] - four[1][d])});
    return size;
}

std::optional<double> impact(bool edges, const Four& from, const Four& to, double distance)
{
    return edges ? jostle::edge_edge_impact(from, to, distance)
                 : jostle::vertex_triangle_impact(from, to, distance);
}

TEST(SurfaceParts, DistancesAreThoseOfAllFeatures)
{
    Places places(1);
    for (int round = 0; round < 50000; ++round) {
        const bool edges = round % 2 == 0;
        const Four at = places.any();
        const double size = size_of(at, at);
        const jostle::PartDistance found =
            edges ? jostle::edge_edge_distance(at) : jostle::vertex_triangle_distance(at);
        const double right = static_cast<double>(oracle::distance(edges, at));
        ASSERT_NEAR(found.distance, right, 1e-12 * size) << round;
        Vec3d way{}; // from the first part's point to the second's
        double first = 0, second = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            const bool of_first = k < (edges ? 2u : 1u);
            ASSERT_GE(found.weights[k], 0) << round;
            (of_first ? first : second) += found.weights[k];
            way += (at[k] - at[0]) * (of_first ? -found.weights[k] : found.weights[k]);
        }
        ASSERT_NEAR(first, 1, 1e-15) << round;
        ASSERT_NEAR(second, 1, 1e-15) << round;
        ASSERT_NEAR(length(way), found.distance, 1e-12 * size) << round;
        if (found.distance > 1e-6 * size) {
            ASSERT_NEAR(dot(way, found.normal), found.distance, 1e-9 * size) << round;
            ASSERT_NEAR(length(found.normal), 1, 1e-12) << round;
        }
    }
}

TEST(SurfaceParts, ImpactsAreNeverLateAndHardlyEarly)
{
    Places places(2);
    int impacts = 0, misses = 0, unproved = 0, early = 0;
    for (int round = 0; round < 5000; ++round) {
        const bool edges = round % 2 == 0;
        auto [from, to] = places.motion();
        const double size = size_of(from, to);
        const double distance = round % 3 == 0 ? size * 0.01 : 0;
        const std::optional<double> time = impact(edges, from, to, distance);
        const oracle::Moving moving(edges, from, to);
        if (!time) {
            ++misses;
            unproved += moving.apart(0, 1, distance) ? 0 : 1;
            continue;
        }
        ++impacts;
        ASSERT_GE(*time, 0);
        ASSERT_LE(*time, 1);
        // Up to a little before it, so that no direction need be exact to the last bit.
        if (*time > 0) unproved += moving.apart(0, oracle::Rational(*time * (1 - 1e-7)), distance) ? 0 : 1;
        const oracle::Point gap = oracle::shortest(edges, oracle::places(from, to, *time));
        const double left = static_cast<double>(std::sqrt(oracle::dot(gap, gap))) - distance;
        ASSERT_LE(left, 2e-6 * size) << round;
        if (left > 1e-12 * size) ++early;
    }
    EXPECT_GT(impacts, 1000);
    EXPECT_GT(misses, 1000);
    EXPECT_LE(unproved, 1); // with a gap of 2e-13, for which the oracle's directions aren't good enough
    EXPECT_LE(early, 10);   // of more than a thousand steps, with a gap of a millionth of the motion at most
}

/// Pairs that meet at a known time, whole numbers at a time of few bits, so that it is exact.
TEST(SurfaceParts, NoImpactIsMissedThatIsThereByConstruction)
{
    Places places(3);
    for (int round = 0; round < 50000; ++round) {
        const bool edges = round % 2 == 0;
        Four from, at;
        for (std::size_t k = 0; k < 4; ++k)
            for (int d = 0; d < 3; ++d) {
                from[k][d] = places.number(41) - 20;
                at[k][d] = 16 * (places.number(7) - 3);
            }
        // Bring them together: the first part's last vertex is moved onto a point of the second part, or so
        // that a point of the first edge is one of the second.
        const double part = places.number(9) / 8.0, other = places.number(9) / 8.0 * (1 - part);
        if (edges) {
            const Vec3d meet = at[2] * (1 - part) + at[3] * part;
            const bool middle = places.number(2) == 0;
            at[1] = middle ? meet * 2.0 - at[0] : meet;
        } else {
            at[0] = at[1] * (1 - part - other) + at[2] * part + at[3] * other;
        }
        const double time = std::ldexp(1.0, -places.number(5));
        Four to;
        for (std::size_t k = 0; k < 4; ++k)
            to[k] = from[k] + (at[k] - from[k]) / time;
        const double offset = std::ldexp(1.0, places.number(30)) * places.number(2);
        for (std::size_t k = 0; k < 4; ++k)
            for (int d = 0; d < 3; ++d)
                from[k][d] += offset, to[k][d] += offset;
        const std::optional<double> found = impact(edges, from, to, 0);
        ASSERT_TRUE(found.has_value()) << round;
        ASSERT_LE(*found, time) << round;
    }
}

TEST(SurfaceParts, ImpactsAtTheBeginningAndTheEnd)
{
    const Four touching{{{0.25, 0.25, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    Four apart = touching;
    apart[0][2] = 1;
    EXPECT_EQ(jostle::vertex_triangle_impact(touching, apart), 0.0);
    EXPECT_NEAR(jostle::vertex_triangle_impact(apart, touching).value(), 1, 1e-14);
    EXPECT_LE(jostle::vertex_triangle_impact(apart, touching).value(), 1);
    EXPECT_NEAR(jostle::vertex_triangle_impact(apart, touching, 0.25).value(), 0.75, 1e-14);
    EXPECT_EQ(jostle::vertex_triangle_impact(apart, apart), std::nullopt);
    EXPECT_EQ(jostle::vertex_triangle_impact(apart, apart, 1.0), 0.0);
    const Four all_in_one{};
    EXPECT_EQ(jostle::edge_edge_impact(all_in_one, all_in_one), 0.0);
}

/// Corners that are in one place at the end, where neither the nearest points' direction nor the polygon's
/// normal gets any further near it.
TEST(SurfaceParts, CornersThatMeetAtTheEndAreFoundThere)
{
    const std::pair<Four, Four> of_vertex[] = {
        {{{{1, 1, 1}, {1, 2, 2}, {3, 2, 0}, {3, 1, 2}}}, {{{2, 3, 2}, {3, 0, 3}, {1, 3, 1}, {2, 3, 2}}}},
        {{{{2, 0, 1}, {1, 1, 0}, {2, 0, 0}, {0, 2, 0}}}, {{{1, 1, 2}, {0, 2, 1}, {3, 1, 3}, {2, 0, 3}}}}};
    for (const auto& [from, to] : of_vertex)
        EXPECT_NEAR(jostle::vertex_triangle_impact(from, to).value(), 1, 1e-12);
    const std::pair<Four, Four> of_edges[] = {
        {{{{1, 1, 0}, {3, 1, 3}, {3, 2, 1}, {1, 0, 3}}}, {{{2, 3, 2}, {3, 2, 1}, {2, 3, 2}, {0, 1, 2}}}},
        {{{{0, 0, 0}, {1, 1, 2}, {1, 1, 1}, {0, 3, 2}}}, {{{0, 1, 0}, {0, 1, 2}, {2, 2, 2}, {0, 1, 2}}}},
        {{{{1, 1, 0}, {2, 0, 0}, {0, 1, 0}, {2, 0, 1}}}, {{{2, 3, 2}, {3, 2, 0}, {0, 1, 2}, {3, 2, 0}}}}};
    for (const auto& [from, to] : of_edges)
        EXPECT_NEAR(jostle::edge_edge_impact(from, to).value(), 1, 1e-12);
}

std::string refusal(const std::function<void()>& call, std::uint64_t index)
{
    try {
        call();
    } catch (const jostle::Error& error) {
        EXPECT_EQ(error.index(), index);
        return error.what();
    }
    return "";
}

TEST(SurfaceParts, ManyInACallAreThoseOneByOne)
{
    Places places(5);
    int impacts = 0, misses = 0;
    for (int round = 0; round < 300; ++round) {
        const bool edges = round % 2 == 0;
        const auto count = static_cast<std::size_t>(round < 20 ? round : places.number(200));
        std::vector<Four> from(count), to(count);
        for (std::size_t k = 0; k < count; ++k) {
            std::tie(from[k], to[k]) = places.motion();
            if (places.number(3) == 0) // most of a broad phase's candidates don't meet
                for (std::size_t v = edges ? 2 : 1; v < 4; ++v)
                    from[k][v] += Vec3d{9, 9, 9}, to[k][v] += Vec3d{9, 9, 9};
            if (places.number(50) == 0) from[k][places.index()] = {1e60, -1e60, places.real()};
        }
        const double distance = round % 3 == 0 ? 0.01 : 0;
        std::vector<double> times(count);
        std::vector<jostle::PartDistance> distances(count);
        (edges ? jostle::edge_edge_impacts : jostle::vertex_triangle_impacts)(from, to, times, distance,
                                                                              1e-6);
        (edges ? jostle::edge_edge_distances : jostle::vertex_triangle_distances)(from, distances);
        for (std::size_t k = 0; k < count; ++k) {
            const std::optional<double> time = impact(edges, from[k], to[k], distance);
            ASSERT_EQ(times[k], time.value_or(std::numeric_limits<double>::infinity())) << round << " " << k;
            ++(time ? impacts : misses);
            const jostle::PartDistance one =
                edges ? jostle::edge_edge_distance(from[k]) : jostle::vertex_triangle_distance(from[k]);
            ASSERT_EQ(distances[k].distance, one.distance);
            ASSERT_EQ(distances[k].weights, one.weights);
            ASSERT_EQ(distances[k].normal, one.normal);
        }
    }
    EXPECT_GT(impacts, 5000);
    EXPECT_GT(misses, 5000);
}

TEST(SurfaceParts, OfManyTheBadOneIsNamedAndThoseBeforeItAreAnswered)
{
    Places places(6);
    std::vector<Four> from(200), to(200);
    for (std::size_t k = 0; k < 200; ++k)
        std::tie(from[k], to[k]) = places.motion();
    std::vector<double> right(200), times(200, -1);
    jostle::edge_edge_impacts(from, to, right);
    for (const std::size_t bad : {0u, 1u, 64u, 130u}) {
        std::vector<Four> wrong = to;
        wrong[bad][3][1] = std::numeric_limits<double>::infinity();
        std::fill(times.begin(), times.end(), -1);
        const std::string message = refusal([&] { jostle::edge_edge_impacts(from, wrong, times); }, bad);
        EXPECT_NE(message.find("pair " + std::to_string(bad) + ": vertex 3 in `to`"), std::string::npos);
        for (std::size_t k = 0; k < 200; ++k)
            ASSERT_EQ(times[k], k < bad ? right[k] : -1) << bad << " " << k;
    }
    constexpr std::uint64_t none = jostle::Error::no_index;
    const std::span<const Four> less = std::span(to).first(199);
    std::vector<jostle::PartDistance> distances(200);
    EXPECT_NE(refusal([&] { jostle::edge_edge_impacts(from, less, times); }, none).find("199 pairs in `to`"),
              std::string::npos);
    EXPECT_NE(refusal([&] { jostle::vertex_triangle_impacts(less, less, times); }, none).find("for times"),
              std::string::npos);
    EXPECT_NE(refusal([&] { jostle::edge_edge_distances(less, distances); }, none).find("for results"),
              std::string::npos);
    EXPECT_NE(refusal([&] { jostle::edge_edge_impacts(from, to, times, -1); }, none).find("distance is -1"),
              std::string::npos);
    jostle::edge_edge_impacts({}, {}, {});
}

TEST(SurfaceParts, BadNumbersAreNamed)
{
    const Four good{{{0, 0, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    const auto message = [](const auto& call) -> std::string {
        try {
            call();
        } catch (const jostle::Error& error) {
            return error.what();
        }
        return "";
    };
    const double infinity = std::numeric_limits<double>::infinity(),
                 nan = std::numeric_limits<double>::quiet_NaN();
    Four bad = good;
    bad[2][1] = nan;
    EXPECT_NE(message([&] { (void)jostle::vertex_triangle_impact(good, bad); }).find("vertex 2 in `to`"),
              std::string::npos);
    EXPECT_NE(message([&] { (void)jostle::edge_edge_impact(bad, good); }).find("vertex 2 in `from`"),
              std::string::npos);
    EXPECT_NE(message([&] { (void)jostle::edge_edge_impact(good, good, -1); }).find("distance is -1"),
              std::string::npos);
    for (const double tolerance : {0.0, -1.0, nan, infinity})
        EXPECT_NE(
            message([&] { (void)jostle::edge_edge_impact(good, good, 0, tolerance); }).find("tolerance"),
            std::string::npos);
}

TEST(SurfaceParts, CrossingsAreExact)
{
    Places places(4);
    int crossing = 0;
    for (int round = 0; round < 20000; ++round) {
        const int range = 2 + places.number(4);
        std::array<Vec3d, 5> at;
        for (Vec3d& v : at)
            for (int d = 0; d < 3; ++d)
                v[d] = places.number(range);
        if (places.number(4) == 0)
            for (Vec3d& v : at)
                v[2] = 0;
        const bool right = oracle::crosses({at[0], at[1]}, {at[2], at[3], at[4]});
        const auto v = [&](std::size_t k) { return jostle::narrow::Vec3{at[k][0], at[k][1], at[k][2]}; };
        ASSERT_EQ(jostle::surfaces::crosses(v(0), v(1), {v(2), v(3), v(4)}), right) << round;
        crossing += right ? 1 : 0;
    }
    EXPECT_GT(crossing, 2000);
    EXPECT_LT(crossing, 18000);
}

} // namespace
