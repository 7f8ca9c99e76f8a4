// SPDX-License-Identifier: MIT
// What the kernels say of pairs is true, the same for all instruction sets, and said of nearly all.
#include "surfaces/kernels/kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>

#include "oracle.hpp"

namespace {

using jostle::surfaces::PartBatch;
using Four = std::array<jostle::Vec3d, 4>;

std::uint64_t apart(jostle::InstructionSet set, bool edges, bool moves, const PartBatch& batch,
                    std::uint32_t count)
{
    const auto& kernels = jostle::surfaces::kernels_for(set);
    const auto& of_kind = edges ? kernels.edge_edge : kernels.vertex_triangle;
    const auto which = moves ? of_kind.moving_apart : of_kind.apart;
    return which(batch, count) & (count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1);
}

void put(jostle::surfaces::Row (&rows)[3][PartBatch::size], std::uint32_t k, const Four& at)
{
    jostle::surfaces::put_legs(rows, k, [&](std::size_t i) -> auto& { return at[i]; });
}

Four mix(const Four& from, const Four& to, double t)
{
    Four at;
    for (std::size_t k = 0; k < 4; ++k)
        at[k] = from[k] * (1 - t) + to[k] * t;
    return at;
}

/// Four vertices: anywhere, in a plane, in a line, on few places, nearly parallel, or thin.
Four vertices(std::mt19937& random)
{
    const auto kind = random() % 6;
    const auto real = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    Four at;
    for (jostle::Vec3d& v : at) {
        v = {real(), real(), real()};
        if (kind == 1) v[2] = 0.25;
        if (kind == 2) v = {v[0], 0.5 * v[0], 0.25 * v[0]};
        if (kind == 3) v = {double(random() % 2), double(random() % 2), double(random() % 3)};
        if (kind == 5) v[1] *= 1e-5;
    }
    if (kind == 4)
        at[3] =
            at[2] + (at[1] - at[0]) * (1 + 1e-6 * real()) + jostle::Vec3d{1e-6 * real(), 0, 1e-6 * real()};
    return at;
}

TEST(SurfaceKernels, WhatTheySayIsTrueAndTheyHardlyEverSayNothing)
{
    std::mt19937 random(21);
    const auto real = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
    std::uint64_t told = 0, all = 0;
    for (int round = 0; round < 1200; ++round) {
        const bool edges = round % 2 == 1, moves = round / 2 % 2 == 1;
        const double scale = std::ldexp(1.0, static_cast<int>(random() % 80) - 40);
        const std::uint32_t count = round % 5 == 0 ? 1 + static_cast<std::uint32_t>(random() % 64) : 64;
        PartBatch batch{};
        std::array<Four, 64> from, to;
        for (std::uint32_t k = 0; k < count; ++k) {
            from[k] = vertices(random);
            to[k] = mix(from[k], vertices(random), random() % 4 == 0 ? 1.0 : 0.1 * real());
            double least = 4;
            for (int step = 0; step <= (moves ? 8 : 0); ++step)
                least = std::min(
                    least, static_cast<double>(oracle::distance(edges, mix(from[k], to[k], step / 8.0))));
            // About as far as they are, so that it is hard to say; or anything.
            const double reach =
                random() % 2 == 0 ? least * (1 + std::ldexp(real() - 0.5, -static_cast<int>(random() % 24)))
                                  : real() * real();
            put(batch.from, k, from[k]);
            put(batch.to, k, to[k]);
            batch.reach[k] = static_cast<float>(reach);
        }
        for (auto* legs : {&batch.from, &batch.to})
            for (auto& rows : *legs)
                for (auto& row : rows)
                    for (float& number : row)
                        number *= static_cast<float>(scale);
        for (float& reach : batch.reach)
            reach *= static_cast<float>(scale);
        const std::uint64_t said = apart(jostle::InstructionSet::scalar, edges, moves, batch, count);
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
            ASSERT_EQ(apart(set, edges, moves, batch, count), said) << round;
        for (std::uint32_t k = 0; k < count; ++k) {
            const double reach = double{batch.reach[k]} / scale;
            const bool of_pair = (said >> k & 1) != 0;
            double least = static_cast<double>(oracle::distance(edges, from[k]));
            for (int step = 1; moves && step <= 64; ++step)
                least = std::min(
                    least, static_cast<double>(oracle::distance(edges, mix(from[k], to[k], step / 64.0))));
            if (of_pair) {
                ASSERT_GT(least, reach) << round << " " << k;
            }
            if (least > reach * 1.01 + 0.001) {
                ++all;
                told += of_pair ? 1 : 0;
            }
        }
    }
    EXPECT_GT(all, 20000u);
    EXPECT_GT(static_cast<double>(told), 0.95 * static_cast<double>(all)) << told << " of " << all;
}

TEST(SurfaceKernels, OfNumbersOutOfRangeTheySayNothing)
{
    constexpr float infinity = std::numeric_limits<float>::infinity(),
                    none = std::numeric_limits<float>::quiet_NaN();
    std::mt19937 random(22);
    for (const float scale : {1e-45f, 1e-30f, 1e-15f, 1e16f, 1e25f, 1e38f, infinity, none})
        for (const bool edges : {false, true})
            for (const bool moves : {false, true}) {
                PartBatch batch{};
                for (std::uint32_t k = 0; k < 64; ++k) {
                    put(batch.from, k, vertices(random));
                    put(batch.to, k, vertices(random));
                    batch.from[random() % 3][k][random() % 3] = 1;
                    batch.reach[k] = random() % 2 == 0 ? 0.0f : scale;
                }
                for (auto* legs : {&batch.from, &batch.to})
                    for (auto& rows : *legs)
                        for (auto& row : rows)
                            for (float& number : row)
                                number *= scale;
                for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
                    EXPECT_EQ(apart(set, edges, moves, batch, 64), 0u) << scale;
            }
}

/// An edge and a triangle: anywhere, or with an end, or the edge's way, hardly off the triangle's plane or
/// border.
std::array<jostle::Vec3d, 5> edge_and_triangle(std::mt19937& random, bool anywhere)
{
    const auto real = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    std::array<jostle::Vec3d, 5> at;
    for (jostle::Vec3d& v : at)
        v = {real(), real(), real()};
    if (anywhere) return at;
    const auto kind = 1 + random() % 3;
    // Of the triangle's plane, in it or on the border of the first two corners.
    const double s = 0.5 + 0.4 * real(), t = kind == 1 ? (1 - s) * (0.5 + 0.4 * real()) : 0;
    const jostle::Vec3d on = at[2] * (1 - s - t) + at[3] * s + at[4] * t;
    const double off = std::ldexp(real(), -static_cast<int>(random() % 40));
    const jostle::Vec3d to = on + jostle::Vec3d{off * real(), off * real(), off * real()};
    at[1] = kind == 3 ? to : at[0] + (to - at[0]) * 2;
    return at;
}

TEST(SurfaceKernels, EdgesThatTheySayCrossNothingDoNot)
{
    using jostle::surfaces::CrossingBatch;
    std::mt19937 random(25);
    std::uint64_t told = 0, uncrossed = 0, crossed = 0;
    for (int round = 0; round < 400; ++round) {
        const bool in_range = round % 8 != 0;
        const int power = in_range ? static_cast<int>(random() % 60) - 28 : round % 16 == 0 ? 40 : -40;
        const double scale = std::ldexp(1.0, power);
        const std::uint32_t count = round % 5 == 0 ? 1 + static_cast<std::uint32_t>(random() % 64) : 64;
        CrossingBatch batch{};
        std::array<std::array<jostle::Vec3d, 5>, 64> at;
        for (std::uint32_t k = 0; k < count; ++k) {
            at[k] = edge_and_triangle(random, k % 2 == 0);
            for (jostle::Vec3d& v : at[k])
                v = v * scale;
            jostle::surfaces::put_legs(batch.legs, k, [&](std::size_t i) -> auto& { return at[k][i]; });
        }
        const auto say = [&](jostle::InstructionSet set) {
            return jostle::surfaces::kernels_for(set).uncrossed(batch, count) &
                   (count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1);
        };
        const std::uint64_t said = say(jostle::InstructionSet::scalar);
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
            ASSERT_EQ(say(set), said) << round;
        if (!in_range) {
            ASSERT_EQ(said, 0u) << power;
        }
        for (std::uint32_t k = 0; k < count; ++k) {
            const bool crosses = oracle::crosses({at[k][0], at[k][1]}, {at[k][2], at[k][3], at[k][4]});
            if (crosses) {
                ASSERT_EQ(said >> k & 1, 0u) << round << " " << k;
            }
            if (!in_range || k % 2 != 0) continue;
            ++(crosses ? crossed : uncrossed);
            told += said >> k & 1;
        }
    }
    EXPECT_GT(crossed, 500u);
    EXPECT_GT(uncrossed, 5000u);
    EXPECT_GT(static_cast<double>(told), 0.99 * static_cast<double>(uncrossed))
        << told << " of " << uncrossed;
}

/// Places that reach from denormal to 1e60, among them equal ones and sides of no length.
Four any_size(std::mt19937& random)
{
    Four at = vertices(random);
    const double scale = random() % 3 == 0 ? std::ldexp(1.0, static_cast<int>(random() % 1230) - 1040) : 1;
    for (jostle::Vec3d& v : at)
        v *= scale;
    if (random() % 4 == 0) at[random() % 4] = at[random() % 4];
    if (random() % 8 == 0) at[random() % 4] = at[random() % 4] * (1 + 1e-160);
    if (random() % 8 == 0) at[random() % 4] = {1e-165, random() % 2 == 0 ? 1e-160 : 0, 0};
    return at;
}
jostle::surfaces::Four in_parts(const Four& at)
{
    jostle::surfaces::Four four;
    for (std::size_t k = 0; k < 4; ++k)
        four[k] = {at[k][0], at[k][1], at[k][2]};
    return four;
}
template <class Number>
std::string bits_of(const Number& number)
{
    return std::string(reinterpret_cast<const char*>(&number), sizeof number);
}

TEST(SurfaceKernels, DistancesAndImpactsAreThoseOfSinglePairsToTheBit)
{
    using jostle::surfaces::PlaceBatch;
    std::mt19937 random(23);
    const auto real = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
    std::uint64_t impacts = 0;
    for (int round = 0; round < 400; ++round) {
        const auto kind =
            round % 2 == 0 ? jostle::surfaces::Kind::vertex_triangle : jostle::surfaces::Kind::edge_edge;
        const std::uint32_t count = round % 3 == 0 ? 1 + static_cast<std::uint32_t>(random() % 64) : 64;
        const double tolerance = round % 5 == 0 ? 0.5 : 1e-6;
        PlaceBatch given{};
        std::array<Four, 64> from, to;
        for (std::uint32_t k = 0; k < count; ++k) {
            from[k] = any_size(random);
            to[k] = random() % 2 == 0 ? any_size(random) : mix(from[k], any_size(random), 0.2);
            if (random() % 8 == 0) to[k] = mix(from[k], to[k], 1e-9);
            given.reach[k] = random() % 2 == 0 ? 0 : real() * length(from[k][0] - from[k][2]);
            for (std::size_t i = 0; i < 12; ++i) {
                given.from[i][k] = from[k][i / 3][static_cast<int>(i % 3)];
                given.to[i][k] = to[k][i / 3][static_cast<int>(i % 3)];
            }
        }
        for (const jostle::InstructionSet set : jostle::supported_instruction_sets()) {
            const auto& kernels = jostle::surfaces::kernels_for(set).of(kind);
            jostle::surfaces::PartDistances distances;
            double times[PlaceBatch::size];
            PlaceBatch batch = given;
            kernels.distances(batch, count, distances);
            kernels.impacts(batch, count, tolerance, times);
            for (std::uint32_t k = 0; k < count; ++k) {
                const jostle::PartDistance distance = jostle::surfaces::distance_of(kind, in_parts(from[k]));
                ASSERT_EQ(bits_of(distances.of(k)), bits_of(distance)) << round << " " << k;
                ASSERT_TRUE(distance.distance >= 0 && length(distance.normal) < 1.1) << round << " " << k;
                const std::optional<double> time = jostle::surfaces::impact_of(
                    kind, in_parts(from[k]), in_parts(to[k]), given.reach[k], tolerance);
                ASSERT_EQ(times[k] <= 1, time.has_value()) << round << " " << k;
                if (!time) continue;
                ASSERT_EQ(bits_of(times[k]), bits_of(*time)) << round << " " << k;
                ++impacts;
            }
        }
    }
    EXPECT_GT(impacts, 10000u);
}

TEST(SurfaceKernels, OfTinyPairsTheySayWhatTheySayOfLargeOnes)
{
    std::mt19937 random(24);
    for (int round = 0; round < 4000; ++round) {
        const auto kind =
            round % 2 == 0 ? jostle::surfaces::Kind::vertex_triangle : jostle::surfaces::Kind::edge_edge;
        Four from = vertices(random), to = vertices(random), small_from = from, small_to = to;
        const double scale = std::ldexp(1.0, -100 - static_cast<int>(random() % 800));
        for (Four* four : {&small_from, &small_to})
            for (jostle::Vec3d& v : *four)
                v *= scale;
        const jostle::PartDistance large = jostle::surfaces::distance_of(kind, in_parts(from)),
                                   small = jostle::surfaces::distance_of(kind, in_parts(small_from));
        ASSERT_EQ(small.distance, large.distance * scale) << round;
        ASSERT_EQ(small.weights, large.weights) << round;
        ASSERT_EQ(small.normal, large.normal) << round;
        ASSERT_EQ(jostle::surfaces::impact_of(kind, in_parts(small_from), in_parts(small_to),
                                              scale * 0.01 * (round % 3), 1e-6),
                  jostle::surfaces::impact_of(kind, in_parts(from), in_parts(to), 0.01 * (round % 3), 1e-6))
            << round;
    }
}

} // namespace
