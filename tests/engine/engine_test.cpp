// SPDX-License-Identifier: MIT
// What lies behind the interface: the parts of the engine, each against its definition. Whole searches are in
// tests/contract.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory_resource>
#include <vector>

#include "engine/brick_store.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/tuner.hpp"
#include "pairs/pair_finder_access.hpp"
#include "scenes/scenes.hpp"

using namespace jostle;

namespace {

TEST(Slices, BeyondTheEnginesNumbersTheAnswerIsTheSame)
{
    const jostle_scenes::Scene<3, float> scene("dense", 2'000);
    const auto boxes = box_view(scene.boxes());
    const auto half = boxes.subview(0, 700);
    const std::vector<Pair> self = find_pairs_brute_force(boxes);
    const std::vector<Pair> cross = find_pairs_brute_force(half, boxes);
    ASSERT_GT(self.size(), 1000u);
    for (const std::size_t slice : {1999u, 1000u, 333u, 100u}) {
        PairFinder finder;
        PairFinderAccess::search_in_slices_of(finder, slice);
        EXPECT_EQ(finder.find(boxes, {}, Order::sorted).to_vector(), self) << slice;
        EXPECT_EQ(finder.find(half, boxes, {}, Order::sorted).to_vector(), cross) << slice;
        EXPECT_EQ(finder.stats().pairs, cross.size());

        // Filters and errors speak of the objects as the caller numbers them.
        std::vector<std::uint32_t> owner(boxes.size());
        for (std::uint32_t i = 0; i < owner.size(); ++i)
            owner[i] = i % 7;
        Filter filter;
        filter.owner = std::span<const std::uint32_t>(owner);
        EXPECT_EQ(finder.find(boxes, filter, Order::sorted).to_vector(),
                  find_pairs_brute_force(boxes, filter));

        std::uint64_t blocks_seen = 0, pairs = 0;
        FinderOptions serial;
        serial.executor = &serial_executor();
        PairFinder streaming(serial);
        PairFinderAccess::search_in_slices_of(streaming, slice);
        EXPECT_TRUE(streaming.stream(boxes, [&](const PairChunk& chunk) {
            EXPECT_GE(chunk.block, blocks_seen);
            blocks_seen = chunk.block;
            pairs += chunk.pairs.size();
            return true;
        }));
        EXPECT_EQ(pairs, self.size());
    }
}

// Many use three dimensions with the third at rest: that must not leave every pair to the exact comparison.
TEST(Ties, AnUnusedAxisMakesNone)
{
    const jostle_scenes::Scene<2, float> scene("uniform", 2'000);
    for (const float z : {0.0F, -3.5F, 1e30F}) {
        for (const int unused : {0, 1, 2}) {
            std::vector<Aabb3f> boxes;
            for (const Aabb2f& box : scene.boxes()) {
                Aabb3f flat;
                for (int d = 0, from = 0; d < 3; ++d) {
                    flat.lo[d] = d == unused ? z : box.lo[from];
                    flat.hi[d] = d == unused ? z : box.hi[from];
                    from += d != unused;
                }
                boxes.push_back(flat);
            }
            // Some that the sample of boxes may not show: before, behind and through the plane.
            for (std::size_t i = 0; i < 12; ++i) {
                Aabb3f& box = boxes[i * 160];
                box.lo[unused] = i % 4 == 0   ? std::nextafter(z, -2e30F)
                                 : i % 4 == 1 ? std::nextafter(z, 2e30F)
                                              : z;
                box.hi[unused] = i % 4 == 0 ? (i % 8 == 0 ? z : box.lo[unused]) : std::nextafter(z, 2e30F);
            }
            const std::vector<Pair> expected = find_pairs_brute_force(box_view(boxes));
            for (const InstructionSet set : supported_instruction_sets()) {
                FinderOptions options;
                options.instruction_set = set;
                PairFinder finder(options);
                EXPECT_EQ(finder.find(boxes, {}, Order::sorted).to_vector(), expected);
                EXPECT_LT(finder.stats().ties, finder.stats().pairs / 10);
            }
        }
    }
}

TEST(Slices, TheLowestBadBoxIsNamed)
{
    std::vector<Aabb2d> boxes(500, Aabb2d{{0, 0}, {1, 1}});
    boxes[499].lo[0] = boxes[205].hi[1] = std::numeric_limits<double>::quiet_NaN();
    PairFinder finder;
    PairFinderAccess::search_in_slices_of(finder, 50);
    try {
        finder.stream(boxes, [](const PairChunk&) { return true; });
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.index(), 205u);
    }
}

// What the counts mean: tests that compare one instruction set's with another's don't see where all are
// wrong.
TEST(Counts, AreThoseThatOneCountsByHand)
{
    const Aabb2f box{{0, 0}, {1, 1}};
    std::vector<Aabb2f> boxes = {box};
    for (const InstructionSet set : supported_instruction_sets()) {
        FinderOptions options;
        options.instruction_set = set;
        PairFinder finder(options);
        const auto counts = [&] {
            (void)finder.find(boxes);
            const Stats& stats = finder.stats();
            return std::vector<std::uint64_t>{stats.objects,    stats.records, stats.bricks,
                                              stats.candidates, stats.ties,    stats.pairs};
        };
        // One box lies in one brick and meets nobody.
        boxes = {box};
        EXPECT_EQ(counts(), (std::vector<std::uint64_t>{1, 1, 1, 0, 0, 0})) << name(set);
        // Two rows share one step of 16 candidates; the quanta tell that the boxes overlap.
        boxes = {box, box};
        EXPECT_EQ(counts(), (std::vector<std::uint64_t>{2, 2, 1, 32, 0, 1})) << name(set);
        // Boxes that only touch leave it to the user's numbers.
        boxes = {box, {{1, 0}, {2, 1}}};
        EXPECT_EQ(counts(), (std::vector<std::uint64_t>{2, 2, 1, 32, 1, 1})) << name(set);
    }
}

TEST(BrickStore, GivesBackWhatWasAppendedInItsOrder)
{
    engine::BrickStore store(std::pmr::get_default_resource());
    for (const std::uint32_t bricks : {1u, 3u, 700u}) {
        std::vector<std::vector<std::uint32_t>> expected(bricks);
        store.clear(bricks);
        std::uint32_t state = 12345;
        for (std::uint32_t i = 0; i < 50'000; ++i) {
            state = state * 1664525 + 1013904223;
            const std::uint32_t brick = (state >> 8) % bricks / ((state >> 30) + 1);
            store.append(brick, {{i, i + 1, i + 2}, i});
            expected[brick].push_back(i);
        }
        store.close();
        for (std::uint32_t brick = 0; brick < bricks; ++brick) {
            ASSERT_EQ(store.size(brick), expected[brick].size());
            for (std::uint32_t k = 0; k < store.size(brick); ++k) {
                constexpr std::uint32_t chunk = engine::BrickStore::Chunk::capacity;
                ASSERT_EQ(store.chunk(brick, k / chunk)->record[k % chunk].object, expected[brick][k]);
            }
        }
    }
}

/// Every instruction set must turn boxes into the very same records.
template <int Dim, class T>
void compare_quantisation()
{
    const jostle_scenes::Scene<Dim, T> scene("powerlaw", engine::unit_size);
    auto sample = std::make_unique<engine::Sample>();
    for (std::size_t i = 0; i < engine::unit_size; ++i, ++sample->size)
        for (int d = 0; d < Dim; ++d)
            sample->add(d, static_cast<double>(scene.boxes()[i].lo[d]),
                        static_cast<double>(scene.boxes()[i].hi[d]));
    engine::Grid<T> grid =
        engine::tune<Dim, T>(*sample, 100'000).grid; // as if there were many: many small bricks
    ASSERT_GT(grid.bricks(), 8u);

    const auto quantised = [&](InstructionSet set) {
        auto unit = std::make_unique<engine::Unit<T>>();
        unit->count = engine::unit_size;
        for (std::uint32_t i = 0; i < engine::unit_size; ++i) {
            for (int d = 0; d < Dim; ++d) {
                unit->lo[d][i] = scene.boxes()[i].lo[d];
                unit->hi[d][i] = scene.boxes()[i].hi[d];
            }
            unit->object[i] = i | (i % 5 == 0 ? engine::copy_flag(1) : 0);
        }
        engine::kernels_for(set).quantise<Dim, T>()(grid, *unit);
        return unit;
    };
    const auto expected = quantised(InstructionSet::scalar);
    EXPECT_GT(expected->records, engine::unit_size);
    EXPECT_GT(expected->wide, 0u);
    EXPECT_FALSE(expected->bad);
    for (const InstructionSet set : supported_instruction_sets()) {
        const auto unit = quantised(set);
        ASSERT_EQ(unit->records, expected->records) << name(set);
        ASSERT_EQ(unit->wide, expected->wide) << name(set);
        for (std::uint32_t i = 0; i < unit->records; ++i) {
            ASSERT_EQ(unit->brick[i], expected->brick[i]) << name(set) << ' ' << i;
            for (int p = 0; p < 3; ++p)
                ASSERT_EQ(unit->record[i].axis[p], expected->record[i].axis[p]) << name(set) << ' ' << i;
            ASSERT_EQ(unit->record[i].object, expected->record[i].object) << name(set) << ' ' << i;
        }
    }
}

TEST(Quantise, IsTheSameOnEveryInstructionSet)
{
    compare_quantisation<2, float>();
    compare_quantisation<2, double>();
    compare_quantisation<3, float>();
    compare_quantisation<3, double>();
}

TEST(Tuner, GivesCrowdsBricksAndDegenerateAxesOne)
{
    auto sample = std::make_unique<engine::Sample>();
    for (std::size_t i = 0; i < 2000; ++i, ++sample->size) {
        const double x = static_cast<double>(i % 50), y = static_cast<double>(i / 50);
        sample->add(0, x, x + 0.5);
        sample->add(1, y, y + 0.5);
        sample->add(2, 7, 7);
    }
    const auto tuned = engine::tune<3, float>(*sample, 1'000'000);
    EXPECT_GT(tuned.grid.bricks(), 500u);
    for (int p = 0; p < 3; ++p)
        EXPECT_TRUE(tuned.grid.axis[p] != 2 || tuned.grid.cells[p] == 1);
    sample->size = 0;
    EXPECT_EQ((engine::tune<3, double>(*sample, 0).grid.bricks()), 1u);
}

TEST(Tuner, BoxesWithoutEndAndFarAwayDoNotStretchTheGrid)
{
    auto sample = std::make_unique<engine::Sample>();
    const double inf = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 1000; ++i, ++sample->size)
        for (int d = 0; d < 3; ++d) {
            const double at = i % 10 == 0 ? -inf
                              : i % 100 == 1
                                  ? 1e30
                                  : static_cast<double>((i * (7 + static_cast<std::size_t>(d) * 6)) % 100);
            sample->add(d, at, i % 10 == 0 ? inf : at + 1);
        }
    const auto tuned = engine::tune<3, double>(*sample, 100'000);
    for (int p = 0; p < 3; ++p) {
        EXPECT_GE(tuned.grid.origin[p], -50);
        EXPECT_LE(static_cast<double>(tuned.grid.cells[p]) * engine::quanta / tuned.grid.scale[p], 300);
    }
}

} // namespace
