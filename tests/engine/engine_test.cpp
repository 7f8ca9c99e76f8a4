// SPDX-License-Identifier: MIT
// What lies behind the interface: the parts of the engine, each against its definition. Whole searches are in
// tests/contract.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory_resource>
#include <vector>

#include "engine/apart.hpp"
#include "engine/brick_store.hpp"
#include "engine/kernels/few.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/sort_brick.hpp"
#include "engine/tuner.hpp"
#include "jostle/periodic.hpp"
#include "pairs/pair_finder_access.hpp"
#include "tool/scenes/scenes.hpp"

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
    float period = 0;
    for (std::size_t i = 0; i < boxes.size(); ++i)
        period = std::max({period, boxes.hi(0, i), boxes.hi(1, i)});
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

        // Ghosts don't meet ghosts.
        for (const std::size_t ghosts : {1u, 333u, 1'000u, 1'900u, 2'000u}) {
            Filter of_ghosts;
            of_ghosts.ghosts = ghosts;
            EXPECT_EQ(finder.find(boxes, of_ghosts, Order::sorted).to_vector(),
                      find_pairs_brute_force(boxes, of_ghosts))
                << slice << ' ' << ghosts;
        }

        // Images don't meet images.
        PeriodicImages3f images;
        images.build(boxes, {period, period, 0});
        const BoxView<3, float> shifted(images.boxes());
        ASSERT_GT(shifted.size(), boxes.size() + 200);
        const std::vector<Pair> across = finder.find(shifted, images.filter(), Order::sorted).to_vector();
        EXPECT_EQ(across, find_pairs_brute_force(shifted, images.filter()));
        EXPECT_TRUE(
            std::all_of(across.begin(), across.end(), [&](Pair pair) { return pair.a < boxes.size(); }));

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
        // Few are tested each against each, without bricks.
        boxes = {box};
        EXPECT_EQ(counts(), (std::vector<std::uint64_t>{1, 0, 0, 0, 0, 0})) << name(set);
        boxes = {box, box, {{2, 2}, {3, 3}}};
        EXPECT_EQ(counts(), (std::vector<std::uint64_t>{3, 0, 0, 3, 0, 1})) << name(set);
        // All lie in one brick. Two rows share each step of 16 candidates, which begins at a multiple of 4.
        // The quanta tell that the boxes overlap.
        boxes.assign(130, box);
        std::uint64_t steps = 0;
        for (std::uint64_t row = 0; row < 130; row += 2)
            steps += (130 - (row + 1) / 4 * 4 + 15) / 16;
        EXPECT_EQ(counts(), (std::vector<std::uint64_t>{130, 130, 1, steps * 32, 0, 130 * 129 / 2}))
            << name(set);
        // Boxes that only touch leave it to the user's numbers.
        std::fill(boxes.begin() + 65, boxes.end(), Aabb2f{{1, 0}, {2, 1}});
        const std::vector<std::uint64_t> touching = counts();
        EXPECT_EQ(touching[4], 65u * 65u) << name(set);
        EXPECT_EQ(touching[5], 130u * 129u / 2) << name(set);
    }
}

/// Boxes of edge 1 in a cube of this edge.
std::vector<Aabb3f> boxes_within(std::size_t count, float edge, std::uint32_t state)
{
    std::vector<Aabb3f> boxes(count);
    for (Aabb3f& box : boxes)
        for (std::size_t d = 0; d < 3; ++d) {
            state = state * 1664525 + 1013904223;
            box.lo[d] = static_cast<float>(state >> 8) / 16777216.0f * edge;
            box.hi[d] = box.lo[d] + 1;
        }
    return boxes;
}

// Up to 16 boxes are tested against each of another set, part by part, whose pairs fill one chunk or several.
TEST(Few, AlsoMeetMany)
{
    for (const float edge : {1.0f, 30.0f})
        for (const std::size_t rows : {1u, 3u, 16u, 17u})
            for (const std::size_t columns : {126u, 128u, 129u, 500u, 6'000u}) {
                const std::vector<Aabb3f> a = boxes_within(rows, edge, 1), b = boxes_within(columns, edge, 2);
                std::vector<Pair> expected;
                for (std::uint32_t i = 0; i < rows; ++i)
                    for (std::uint32_t k = 0; k < columns; ++k)
                        if (overlaps(a[i], b[k])) expected.push_back({i, k});
                for (const InstructionSet set : supported_instruction_sets()) {
                    FinderOptions options;
                    options.instruction_set = set;
                    PairFinder finder(options);
                    EXPECT_EQ(finder.find(box_view(a), box_view(b), {}, Order::sorted).to_vector(), expected)
                        << name(set) << ": " << rows << " and " << columns;
                    const std::vector<Pair> found = finder.find(box_view(a), box_view(b)).to_vector();
                    std::vector<Pair> streamed;
                    std::uint64_t part = 0;
                    finder.stream(box_view(a), box_view(b), [&](const PairChunk& chunk) {
                        if (rows <= engine::few_rows) {
                            EXPECT_EQ(chunk.part, part++);
                            streamed.insert(streamed.end(), chunk.pairs.begin(), chunk.pairs.end());
                        }
                        return true;
                    });
                    if (rows <= engine::few_rows) {
                        EXPECT_EQ(streamed, found) << name(set) << ": " << rows << " and " << columns;
                    }
                }
            }
}

TEST(Few, WhereTheyMeetManyABadBoxIsNamedBeforeAnyPairIsTold)
{
    const std::vector<Aabb3f> a = boxes_within(16, 0.5f, 3);
    std::vector<Aabb3f> b = boxes_within(6'000, 0.5f, 4);
    b[5'900].lo[1] = std::numeric_limits<float>::quiet_NaN();
    PairFinder finder;
    std::uint64_t told = 0;
    try {
        finder.stream(box_view(a), box_view(b), [&](const PairChunk&) { return ++told != 0; });
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.index(), 5'900u);
    }
    EXPECT_EQ(told, 0u);
    EXPECT_THROW((void)finder.find(box_view(a), box_view(b)), Error);
    // A sink that has had enough.
    b[5'900] = b[0];
    EXPECT_FALSE(finder.stream(box_view(a), box_view(b), [&](const PairChunk&) { return ++told == 0; }));
    EXPECT_EQ(told, 1u);
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

/// Takes what a sweep finds, in the order in which a result would have it: ties where they are decided.
struct Ledger : engine::PairOutput
{
    std::vector<Pair> memory, tie_memory, all;
    bool stops = false; // at the first look for room

    Ledger() : memory(3 * engine::sweep_room), tie_memory(engine::tie_capacity)
    {
        next = memory.data();
        end = next + memory.size();
        ties = tie_memory.data();
        tie_count = 0;
        make_room = [](PairOutput& self) {
            auto& own = static_cast<Ledger&>(self);
            own.pass_pairs();
            if (own.tie_count > engine::tie_capacity - engine::sweep_room) own.pass_ties();
            return !own.stops;
        };
    }
    void pass_pairs()
    {
        all.insert(all.end(), memory.data(), next);
        next = memory.data();
    }
    void pass_ties()
    {
        for (std::uint32_t k = 0; k < tie_count; ++k)
            all.push_back({~ties[k].a, ~ties[k].b});
        tie_count = 0;
    }
    std::vector<Pair> close()
    {
        pass_pairs();
        pass_ties();
        return all;
    }
};

/// A brick of two sets, `of_b` in a thousand of the second, as dense as `length` quanta make it. Bounds are
/// multiples of `grain`: the coarser, the more ties.
void fill_brick(engine::BrickStore& store, std::uint32_t seed, std::uint32_t count, std::uint32_t of_b,
                std::uint32_t length, std::uint32_t grain)
{
    std::uint32_t state = seed;
    const auto random = [&](std::uint32_t below) {
        state = state * 1664525 + 1013904223;
        return (state >> 8) % below;
    };
    store.clear(1);
    for (std::uint32_t i = 0; i < count; ++i) {
        engine::Record record{};
        record.object = i | (random(1000) < of_b ? engine::side_b : engine::side_a);
        for (int d = 0; d < 3; ++d) {
            const bool copy = random(6) == 0;
            const auto lo = static_cast<std::int32_t>(copy ? 0 : random(engine::quanta / 2) / grain * grain);
            const auto hi = std::min(lo + static_cast<std::int32_t>(random(length) / grain * grain),
                                     static_cast<std::int32_t>(engine::quanta));
            record.axis[d] = engine::pack_axis(copy ? 0 : -(lo + 1), hi + 1);
            if (copy) record.object |= engine::copy_flag(d);
        }
        store.append(0, record);
    }
    store.close();
}

template <int Dim>
void compare_apart(std::uint32_t count, std::uint32_t of_b, std::uint32_t length, std::uint32_t grain,
                   std::uint64_t& found, std::uint64_t& ties)
{
    engine::Slot slot(std::pmr::get_default_resource());
    engine::BrickStore store(std::pmr::get_default_resource());
    fill_brick(store, count * 7 + of_b * 3 + length + grain, count, of_b, length, grain);
    const engine::BrickStore* const stores[] = {&store};
    (void)engine::sort_brick({stores, 1}, 0, count, slot);
    std::vector<Pair> expected;
    for (const InstructionSet set : supported_instruction_sets()) {
        const engine::Kernels& kernels = engine::kernels_for(set);
        const auto what = [&] {
            return std::string(name(set)) + ' ' + std::to_string(count) + " records, " +
                   std::to_string(of_b) + " in a thousand of b, grain " + std::to_string(grain);
        };
        std::vector<std::uint32_t> columns(std::size_t{engine::padded(count)} * engine::columns_per_record +
                                           16);
        auto* aligned = reinterpret_cast<std::uint32_t*>(
            (reinterpret_cast<std::uintptr_t>(columns.data()) + 63) / 64 * 64);
        engine::SortedBrick brick{count, aligned, slot.window_end.data()};
        kernels.arrange(slot.sorted.data(), brick);
        Ledger together;
        (void)kernels.sweep<Dim>()(brick, 0, count, together);
        if (expected.empty()) expected = together.close();
        for (const Pair& pair : expected)
            ties += pair.a > engine::index_mask && pair.b > engine::index_mask ? 1 : 0;
        found += expected.size();

        engine::Apart apart;
        ASSERT_TRUE(apart.make(slot.sorted.data(), slot.window_end.data(), count, kernels, slot)) << what();
        Ledger own;
        (void)apart.sweep<Dim>(kernels, 0, count, slot, own);
        EXPECT_TRUE(own.close() == expected) << what();

        // In parts, as several threads take it, each with working memory of its own.
        Ledger first, rest;
        engine::Slot other(std::pmr::get_default_resource());
        const std::uint32_t middle = count / 4 * 2;
        (void)apart.sweep<Dim>(kernels, 0, middle, other, first);
        (void)apart.sweep<Dim>(kernels, middle, count, other, rest);
        Ledger first_together, rest_together;
        (void)kernels.sweep<Dim>()(brick, 0, middle, first_together);
        (void)kernels.sweep<Dim>()(brick, middle, count, rest_together);
        EXPECT_TRUE(first.close() == first_together.close()) << what();
        EXPECT_TRUE(rest.close() == rest_together.close()) << what();

        // A sink that has enough is asked for nothing more.
        Ledger stopped;
        stopped.stops = true;
        (void)apart.sweep<Dim>(kernels, 0, count, slot, stopped);
        EXPECT_LE(stopped.all.size(), stopped.memory.size() + stopped.tie_memory.size());
    }
}

TEST(Apart, FindsTheSameInTheSameOrder)
{
    std::uint64_t found = 0, ties = 0;
    for (const auto& [count, of_b] :
         {std::pair{501u, 2u}, std::pair{2'501u, 2u}, std::pair{2'501u, 970u}, std::pair{3'002u, 110u}}) {
        for (const std::uint32_t grain : {1u, 512u, 4'096u}) {
            compare_apart<2>(count, of_b, engine::quanta, grain, found, ties);
            compare_apart<3>(count, of_b, engine::quanta, grain, found, ties);
        }
    }
    EXPECT_GT(found, 1'000'000u);
    EXPECT_GT(ties, 100'000u);
}

TEST(Apart, IsOfNoUseWhereMostOfAWindowIsOfTheOtherSet)
{
    engine::Slot slot(std::pmr::get_default_resource());
    engine::BrickStore store(std::pmr::get_default_resource());
    const engine::BrickStore* const stores[] = {&store};
    for (const auto& [count, of_b, length] :
         {std::array{3'000u, 500u, 16'384u}, std::array{3'000u, 20u, 64u}, std::array{40u, 20u, 16'384u}}) {
        fill_brick(store, 1, count, of_b, length, 1);
        (void)engine::sort_brick({stores, 1}, 0, count, slot);
        engine::Apart apart;
        EXPECT_FALSE(apart.make(slot.sorted.data(), slot.window_end.data(), count,
                                engine::kernels_for(InstructionSet::scalar), slot))
            << count << ' ' << of_b << ' ' << length;
    }
}

TEST(Sets, ABrickIsKnownToHoldWhatMayPair)
{
    for (const bool as_given : {true, false})
        for (const std::uint32_t a : {0u, 1u, 32u, 100u})
            for (const std::uint32_t b : {0u, 1u, 32u, 100u}) {
                engine::BrickStore store(std::pmr::get_default_resource()),
                    none(std::pmr::get_default_resource());
                store.clear(2);
                none.clear(2);
                for (std::uint32_t i = 0; i < a + b; ++i)
                    store.append(1, {{0, 0, 0}, i | (i < a ? engine::side_a : engine::side_b)});
                store.close();
                none.close();
                const engine::BrickStore* const stores[] = {&none, &store};
                EXPECT_EQ(engine::may_pair({stores, 2}, 1, as_given), a != 0 && b != 0) << a << ' ' << b;
                EXPECT_FALSE(engine::may_pair({stores, 2}, 0, as_given));
            }
    for (const bool as_given : {true, false})
        for (const std::uint32_t own : {0u, 1u, 32u}) { // one set, of which the last are ghosts
            engine::BrickStore store(std::pmr::get_default_resource());
            store.clear(1);
            for (std::uint32_t i = 0; i < 64; ++i)
                store.append(0, {{0, 0, 0}, i | (i < own ? 0 : engine::side_a)});
            store.close();
            const engine::BrickStore* const stores[] = {&store};
            EXPECT_EQ(engine::may_pair({stores, 1}, 0, as_given), own != 0) << own;
        }
    // In a nested grid, where records are sorted along an axis, any of them may be of the other set.
    engine::BrickStore store(std::pmr::get_default_resource());
    store.clear(1);
    for (std::uint32_t i = 0; i < 100; ++i)
        store.append(0, {{0, 0, 0}, i | (i != 50 ? engine::side_a : engine::side_b)});
    store.close();
    const engine::BrickStore* const stores[] = {&store};
    EXPECT_TRUE(engine::may_pair({stores, 1}, 0, false));
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
    // Without end on both sides, on one, on the other.
    for (const auto& [lo, hi] : {std::pair(-inf, inf), std::pair(-inf, 50.0), std::pair(50.0, inf)})
        for (const double far : {1e30, -1e30}) {
            for (sample->size = 0; sample->size < 1000; ++sample->size)
                for (std::size_t d = 0; d < 3; ++d) {
                    const std::size_t i = sample->size;
                    const double at = i % 100 == 1 ? far : static_cast<double>((i * (7 + d * 6)) % 100);
                    const bool endless = i % 10 == 0;
                    sample->add(static_cast<int>(d), endless ? lo : at, endless ? hi : at + 1);
                }
            const auto tuned = engine::tune<3, double>(*sample, 100'000);
            for (int p = 0; p < 3; ++p) {
                EXPECT_GE(tuned.grid.origin[p], -50);
                EXPECT_LE(static_cast<double>(tuned.grid.cells[p]) * engine::quanta / tuned.grid.scale[p],
                          300);
            }
        }
}

} // namespace
