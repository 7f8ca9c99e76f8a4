// SPDX-License-Identifier: MIT
// What the kernels say of pairs is true, the same for all instruction sets, and said of nearly all.
#include "surfaces/kernels/kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "oracle.hpp"

namespace {

using jostle::surfaces::PartBatch;
using Four = std::array<jostle::Vec3d, 4>;

std::uint64_t apart(jostle::InstructionSet set, bool edges, bool moves, const PartBatch& batch,
                    std::uint32_t count)
{
    const auto& kernels = jostle::surfaces::kernels_for(set);
    const auto which = edges ? (moves ? kernels.moving_edge_edge : kernels.edge_edge)
                             : (moves ? kernels.moving_vertex_triangle : kernels.vertex_triangle);
    return which(batch, count) & (count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1);
}

void put(float (&columns)[9][PartBatch::size], std::uint32_t k, const Four& at)
{
    for (std::size_t i = 0; i < 9; ++i)
        columns[i][k] =
            static_cast<float>(at[i / 3 + 1][static_cast<int>(i % 3)] - at[0][static_cast<int>(i % 3)]);
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
        PartBatch batch;
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
        for (auto* columns : {&batch.from, &batch.to})
            for (auto& column : *columns)
                for (float& number : column)
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
                PartBatch batch;
                for (std::uint32_t k = 0; k < 64; ++k) {
                    put(batch.from, k, vertices(random));
                    put(batch.to, k, vertices(random));
                    batch.from[random() % 9][k] = 1;
                    batch.reach[k] = random() % 2 == 0 ? 0.0f : scale;
                }
                for (auto* columns : {&batch.from, &batch.to})
                    for (auto& column : *columns)
                        for (float& number : column)
                            number *= scale;
                for (const jostle::InstructionSet set : jostle::supported_instruction_sets())
                    EXPECT_EQ(apart(set, edges, moves, batch, 64), 0u) << scale;
            }
}

} // namespace
