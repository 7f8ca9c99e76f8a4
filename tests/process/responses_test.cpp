// SPDX-License-Identifier: MIT
// Responses against a plain loop: the same bits for any threads, any order and both forms.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <new>
#include <random>

#include "executors.hpp"
#include "jostle/responses.hpp"
#include "tests/contract/counting_memory.hpp"

namespace {

using jostle::Pair;
using jostle::ProcessOptions;
using jostle::ResponseForm;
using jostle::Responses;
using jostle::ResponsesOptions;
using jostle::Work;
using process_test::all_executors;

/// Sums that rounding reorders.
struct Impulse
{
    float x = 0, y = 0, z = 0;
    double turn = 0;
    Impulse& operator+=(const Impulse& other)
    {
        x += other.x;
        y += other.y;
        z += other.z;
        turn += other.turn;
        return *this;
    }
};

/// The user's own, of odd size and with a merge that isn't a sum: the deepest of all, and how many.
struct Deepest
{
    float depth = 0;
    std::uint32_t other = ~0u;
    std::uint16_t count = 0;
    friend bool operator==(const Deepest&, const Deepest&) = default;
};
struct KeepDeepest
{
    void operator()(Deepest& into, const Deepest& value) const
    {
        into.count = static_cast<std::uint16_t>(into.count + value.count);
        if (value.depth > into.depth) { // of equal ones the first: an order that must be kept
            into.depth = value.depth;
            into.other = value.other;
        }
    }
};

std::vector<Pair> random_pairs(std::uint32_t objects, std::size_t count, unsigned seed)
{
    std::mt19937 random(seed);
    std::vector<Pair> pairs;
    while (pairs.size() < count)
        pairs.push_back(
            {static_cast<std::uint32_t>(random() % objects), static_cast<std::uint32_t>(random() % objects)});
    return pairs;
}

/// Of one pair: -0, denormals, and sizes from 1e-30 to 1e30.
Impulse impulse_of(std::uint32_t object, std::uint32_t other)
{
    const std::uint32_t k = object * 2654435761u ^ other * 40503u;
    const float size = std::ldexp(1.0f + float(k % 1000) / 1000, int(k >> 8) % 200 - 100);
    return {k % 2 ? size : -size, float(k % 7) / 3, k % 5 ? 1e-42f : -0.0f, 1.0 / (1 + k % 977)};
}

/// What every Responses answers to.
template <class T, class Value, class Merge = jostle::AddUp>
std::vector<T> by_a_plain_loop(std::uint32_t objects, const std::vector<Pair>& pairs,
                               std::uint64_t block_items, Value value, Merge merge = {})
{
    std::vector<T> total(objects), block(objects);
    for (std::size_t begin = 0; begin < pairs.size(); begin += block_items) {
        std::fill(block.begin(), block.end(), T{});
        for (std::size_t k = begin; k < std::min<std::size_t>(pairs.size(), begin + block_items); ++k) {
            merge(block[pairs[k].a], value(pairs[k].a, pairs[k].b));
            merge(block[pairs[k].b], value(pairs[k].b, pairs[k].a));
        }
        for (std::uint32_t i = 0; i < objects; ++i)
            merge(total[i], block[i]);
    }
    return total;
}

template <class T>
bool same_bits(const T& x, const T& y)
{
    return x == y;
}
/// Of floating-point numbers also the sign of 0.
bool same_bits(const Impulse& x, const Impulse& y)
{
    const auto equal = [](auto a, auto b) { return a == b && std::signbit(a) == std::signbit(b); };
    return equal(x.x, y.x) && equal(x.y, y.y) && equal(x.z, y.z) && equal(x.turn, y.turn);
}

template <class T>
void expect_same_bits(std::span<const T> found, const std::vector<T>& truth, const std::string& where)
{
    ASSERT_EQ(found.size(), truth.size()) << where;
    for (std::size_t i = 0; i < truth.size(); ++i)
        ASSERT_TRUE(same_bits(found[i], truth[i])) << where << ", object " << i;
}

/// What merge(apply) hands out, object by object.
template <class T, class Merge>
std::vector<T> applied(Responses<T, Merge>& responses, std::uint32_t objects)
{
    std::vector<T> values(objects);
    std::vector<std::atomic<int>> times(objects);
    responses.merge([&](std::uint32_t first, std::span<const T> of) {
        for (std::size_t i = 0; i < of.size(); ++i) {
            values[first + i] = of[i];
            ++times[first + i];
        }
    });
    for (const auto& of_object : times)
        EXPECT_LE(of_object, 1);
    return values;
}

template <class T, class Merge, class Value>
void check(std::uint32_t objects, const std::vector<Pair>& pairs, Value value)
{
    for (const std::uint64_t block_items : {0u, 1u, 64u, 100'000u}) {
        std::vector<T> truth;
        for (const auto& [name, executor] : all_executors()) {
            ProcessOptions process;
            process.executor = executor.get();
            process.block_items = block_items;
            const jostle::WorkPlan plan = jostle::plan_work(pairs.size(), process);
            if (truth.empty()) truth = by_a_plain_loop<T>(objects, pairs, plan.block_items, value, Merge{});
            for (const ResponseForm form :
                 {ResponseForm::automatic, ResponseForm::dense, ResponseForm::sparse}) {
                if (form == ResponseForm::dense && std::uint64_t{plan.blocks} * objects > 1'000'000) continue;
                ResponsesOptions options;
                options.executor = executor.get();
                options.form = form;
                Responses<T, Merge> responses(options);
                for (int frame = 0; frame < 2; ++frame) { // the second starts from nothing again
                    responses.start(objects, plan);
                    jostle::process_pairs(
                        pairs,
                        [&](const Pair& pair, Work work) {
                            responses.add(work, pair.a, value(pair.a, pair.b));
                            responses.add(work, pair.b, value(pair.b, pair.a));
                        },
                        process);
                    const std::string where = name + ", form " + std::to_string(int(form)) + ", block " +
                                              std::to_string(block_items) + ", frame " +
                                              std::to_string(frame);
                    if (frame == 0) expect_same_bits(responses.merge(), truth, where);
                    for (int repeat = 0; repeat < 2; ++repeat)
                        expect_same_bits<T>(applied(responses, objects), truth, where + ", applied");
                    expect_same_bits(responses.merge(), truth, where + ", again");
                }
            }
        }
    }
}

TEST(Responses, EqualsAPlainLoop)
{
    for (const std::uint32_t objects : {1u, 2u, 1'500u}) {
        const std::vector<Pair> pairs = random_pairs(objects, 2'000, objects);
        check<Impulse, jostle::AddUp>(objects, pairs, impulse_of);
        check<std::uint64_t, jostle::AddUp>(objects, pairs,
                                            [](std::uint32_t, std::uint32_t) { return std::uint64_t{1}; });
        check<Deepest, KeepDeepest>(objects, pairs, [](std::uint32_t object, std::uint32_t other) {
            return Deepest{float((object + other) % 16), other, 1};
        });
    }
}

TEST(Responses, OfTwoBuffersAddUpAsIfTheyWereOne)
{
    constexpr std::uint32_t objects = 300, block_items = 64;
    const std::vector<Pair> first = random_pairs(objects, 10 * block_items, 1);
    const std::vector<Pair> second = random_pairs(objects, 1'234, 2);
    std::vector<Pair> both = first;
    both.insert(both.end(), second.begin(), second.end());
    const std::vector<Impulse> truth = by_a_plain_loop<Impulse>(objects, both, block_items, impulse_of);
    for (const auto& [name, executor] : all_executors()) {
        ProcessOptions process;
        process.executor = executor.get();
        process.block_items = block_items;
        ResponsesOptions options;
        options.executor = executor.get();
        Responses<Impulse> responses(options);
        const auto add = [&](const Pair& pair, Work work) {
            responses.add(work, pair.a, impulse_of(pair.a, pair.b));
            responses.add(work, pair.b, impulse_of(pair.b, pair.a));
        };
        const jostle::WorkPlan plan = jostle::plan_work(first.size(), process);
        responses.start(objects, jostle::plan_both(plan, jostle::plan_work(second.size(), process)));
        jostle::process_pairs(first, add, process);
        process.first_block = plan.blocks;
        jostle::process_pairs(second, add, process);
        expect_same_bits(responses.merge(), truth, name);
    }
}

TEST(Responses, OneObjectInAllPairsAndNoPairs)
{
    std::vector<Pair> star;
    for (std::uint32_t i = 1; i < 4'000; ++i)
        star.push_back({0, i});
    check<Impulse, jostle::AddUp>(4'000, star, impulse_of);
    check<Impulse, jostle::AddUp>(20'000, {}, impulse_of);
    check<Impulse, jostle::AddUp>(0, {}, impulse_of);
}

TEST(Responses, ManyObjectsFewResponses)
{
    constexpr std::uint32_t objects = 1'000'000; // bins of more than 512
    const auto executor = jostle::make_thread_executor(3);
    ResponsesOptions options;
    options.executor = executor.get();
    Responses<Impulse> responses(options);
    ProcessOptions process;
    process.executor = executor.get();
    for (unsigned frame = 0; frame < 3; ++frame) { // what one frame touched, the next must clear
        const std::vector<Pair> pairs = random_pairs(frame == 1 ? 100 : objects, 3'000, frame);
        const jostle::WorkPlan plan = jostle::plan_work(pairs.size(), process);
        responses.start(objects, plan);
        jostle::process_pairs(
            pairs,
            [&](const Pair& pair, Work work) {
                responses.add(work, pair.a, impulse_of(pair.a, pair.b));
                responses.add(work, pair.b, impulse_of(pair.b, pair.a));
            },
            process);
        EXPECT_EQ(responses.form(), ResponseForm::sparse);
        expect_same_bits(responses.merge(),
                         by_a_plain_loop<Impulse>(objects, pairs, plan.block_items, impulse_of), "");
    }
}

/// A scheduler that isn't ours: blocks go to slots by chance, and come in any order.
TEST(Responses, BlocksInAnyOrder)
{
    constexpr std::uint32_t objects = 2'000, slots = 4;
    const std::vector<Pair> pairs = random_pairs(objects, 10'000, 5);
    jostle::WorkPlan plan;
    plan.items = pairs.size();
    plan.block_items = 16;
    plan.blocks = static_cast<std::uint32_t>((pairs.size() + 15) / 16);
    plan.slots = slots;
    const auto truth = by_a_plain_loop<Impulse>(objects, pairs, 16, impulse_of);
    std::mt19937 random(1);
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse})
        for (int repeat = 0; repeat < 5; ++repeat) {
            ResponsesOptions options;
            options.form = form;
            Responses<Impulse> responses(options);
            responses.start(objects, plan);
            std::vector<std::uint32_t> blocks(plan.blocks);
            std::iota(blocks.begin(), blocks.end(), 0u);
            std::shuffle(blocks.begin(), blocks.end(), random);
            for (const std::uint32_t block : blocks) {
                const Work work{static_cast<std::uint32_t>(random() % slots), block};
                for (std::size_t k = block * 16; k < std::min<std::size_t>(pairs.size(), block * 16 + 16);
                     ++k) {
                    responses.add(work, pairs[k].a, impulse_of(pairs[k].a, pairs[k].b));
                    responses.add(work, pairs[k].b, impulse_of(pairs[k].b, pairs[k].a));
                }
            }
            const std::string where = "form " + std::to_string(int(form));
            expect_same_bits<Impulse>(applied(responses, objects), truth, where);
            expect_same_bits(responses.merge(), truth, where);
        }
}

/// Slots whose blocks ascend, as the library's own do, beside others whose blocks come in any order.
TEST(Responses, BlocksThatAscendInAllSlotsOrInSome)
{
    constexpr std::uint32_t objects = 600, slots = 3;
    const std::vector<Pair> pairs = random_pairs(objects, 6'000, 6);
    jostle::WorkPlan plan;
    plan.items = pairs.size();
    plan.block_items = 8;
    plan.blocks = static_cast<std::uint32_t>((pairs.size() + 7) / 8);
    plan.slots = slots;
    const auto truth = by_a_plain_loop<Impulse>(objects, pairs, 8, impulse_of);
    std::mt19937 random(2);
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse})
        for (std::uint32_t shuffled = 0; shuffled < 1u << slots; ++shuffled) {
            ResponsesOptions options;
            options.form = form;
            Responses<Impulse> responses(options);
            responses.start(objects, plan);
            std::vector<std::uint32_t> blocks_of[slots];
            for (std::uint32_t block = 0; block < plan.blocks; ++block)
                blocks_of[random() % slots].push_back(block);
            for (std::uint32_t slot = 0; slot < slots; ++slot) {
                if ((shuffled >> slot & 1) != 0)
                    std::shuffle(blocks_of[slot].begin(), blocks_of[slot].end(), random);
                for (const std::uint32_t block : blocks_of[slot])
                    for (std::size_t k = block * 8; k < std::min<std::size_t>(pairs.size(), block * 8 + 8);
                         ++k) {
                        responses.add({slot, block}, pairs[k].a, impulse_of(pairs[k].a, pairs[k].b));
                        responses.add({slot, block}, pairs[k].b, impulse_of(pairs[k].b, pairs[k].a));
                    }
            }
            expect_same_bits(responses.merge(), truth,
                             "form " + std::to_string(int(form)) + ", shuffled " + std::to_string(shuffled));
        }
}

TEST(Responses, LongBlocksInAnyOrder)
{
    // So many responses of one object that a block of them fills several pieces of memory.
    constexpr std::uint32_t objects = 2, blocks = 3, per_block = 500;
    std::vector<Pair> pairs;
    for (std::uint32_t k = 0; k < blocks * per_block; ++k)
        pairs.push_back({0, 1});
    std::uint32_t number = 0;
    const auto value = [&](std::uint32_t object, std::uint32_t) { return impulse_of(object, number++); };
    const auto truth = by_a_plain_loop<Impulse>(objects, pairs, per_block, value);
    jostle::WorkPlan plan;
    plan.items = pairs.size();
    plan.block_items = per_block;
    plan.blocks = blocks;
    ResponsesOptions options;
    options.form = ResponseForm::sparse;
    Responses<Impulse> responses(options);
    responses.start(objects, plan);
    for (const std::uint32_t block : {1u, 2u, 0u})
        for (std::uint32_t k = block * per_block; k < (block + 1) * per_block; ++k)
            for (const std::uint32_t object : {0u, 1u})
                responses.add({0, block}, object, impulse_of(object, 2 * k + object));
    expect_same_bits(responses.merge(), truth, "sparse");
}

TEST(Responses, UnevenBlocksOnEveryExecutor)
{
    constexpr std::uint32_t objects = 300;
    std::vector<Impulse> truth;
    for (const auto& [name, executor] : all_executors()) {
        const ProcessOptions process{.executor = executor.get(), .block_items = 1};
        ResponsesOptions options;
        options.executor = executor.get();
        Responses<Impulse> responses(options);
        responses.start(objects, jostle::plan_work(objects, process));
        jostle::process_items(
            objects,
            [&](std::uint64_t first, std::uint64_t, Work work) {
                const auto a = static_cast<std::uint32_t>(first);
                for (std::uint32_t b = a + 1; b < objects; ++b) {
                    responses.add(work, a, impulse_of(a, b));
                    responses.add(work, b, impulse_of(b, a));
                }
            },
            process);
        const auto merged = responses.merge();
        if (truth.empty()) truth.assign(merged.begin(), merged.end());
        expect_same_bits(merged, truth, name);
    }
}

TEST(Responses, AWrongNumberIsAnErrorThatNamesIt)
{
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse}) {
        ResponsesOptions options;
        options.form = form;
        Responses<int> responses(options);
        jostle::WorkPlan plan;
        plan.items = 10;
        plan.block_items = 5;
        plan.blocks = 2;
        const auto message = [&](Work work, std::uint32_t object) -> std::string {
            try {
                responses.add(work, object, 1);
            } catch (const jostle::Error& error) {
                EXPECT_EQ(error.code(), jostle::ErrorCode::invalid_argument);
                return error.what();
            }
            return "";
        };
        EXPECT_NE(message({0, 0}, 0).find("before start"), std::string::npos);
        EXPECT_TRUE(responses.merge().empty());
        responses.start(7, plan);
        EXPECT_EQ(message({0, 1}, 6), "");
        EXPECT_EQ(message({0, 0}, 7),
                  "add() to object 7, but start() was given 7 objects; give start() as many as there are");
        EXPECT_NE(message({0, 2}, 0).find("block 2, but start() was given 2 blocks; make its plan"),
                  std::string::npos);
        EXPECT_NE(message({1, 0}, 0).find("slot 1, but start() was given 1 slots; make its plan"),
                  std::string::npos);
        EXPECT_EQ(responses.merge()[6], 1);
        EXPECT_NE(message({0, 1}, 6).find("after merge"), std::string::npos);
        EXPECT_EQ(responses.merge()[6], 1);
        const auto merged = responses.merge();
        EXPECT_EQ(std::vector<int>(merged.begin(), merged.end()), (std::vector<int>{0, 0, 0, 0, 0, 0, 1}));
    }
}

/// A frame of `pairs` in which all slots work in turn, or `busy` does all of it.
template <class T>
std::span<const T> frame(Responses<T>& responses, std::uint32_t objects, const std::vector<Pair>& pairs,
                         std::uint32_t slots, std::uint32_t busy)
{
    jostle::WorkPlan plan = jostle::plan_work(pairs.size());
    plan.slots = slots;
    responses.start(objects, plan);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const auto block = static_cast<std::uint32_t>(k / plan.block_items);
        const Work work{busy < slots ? busy : block % slots, block};
        responses.add(work, pairs[k].a, impulse_of(pairs[k].a, pairs[k].b));
        responses.add(work, pairs[k].b, impulse_of(pairs[k].b, pairs[k].a));
    }
    return responses.merge();
}

TEST(ResponsesMemory, ASteadyFrameAllocatesNothingWhoeverWorks)
{
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse}) {
        contract::CountingMemory memory;
        {
            ResponsesOptions options;
            options.memory = &memory;
            options.form = form;
            Responses<Impulse> responses(options);
            const std::vector<Pair> pairs = random_pairs(20'000, 6'000, 1);
            std::uint64_t warm = 0;
            for (std::uint32_t k = 0; k < 40; ++k) {
                frame(responses, 20'000, pairs, 8, k < 2 ? 0 : k % 9);
                if (k == 1) warm = memory.allocations;
            }
            EXPECT_EQ(memory.allocations, warm);
            EXPECT_GE(responses.bytes_reserved(), 20'000 * sizeof(Impulse));
            EXPECT_LE(responses.bytes_reserved(), memory.bytes);
            responses.release_memory();
            EXPECT_EQ(responses.bytes_reserved(), 0u);
            frame(responses, 20'000, pairs, 8, 0);
        }
        EXPECT_EQ(memory.blocks, 0u);
    }
}

TEST(ResponsesMemory, TheSmallerFormIsChosen)
{
    Responses<Impulse> responses;
    jostle::WorkPlan plan;
    plan.items = 100'000;
    plan.block_items = 1'000;
    plan.blocks = 100;
    responses.start(100'000, plan);
    EXPECT_EQ(responses.form(), ResponseForm::sparse);
    responses.start(1'000, plan);
    EXPECT_EQ(responses.form(), ResponseForm::dense);
    responses.start(100'000, plan);
    EXPECT_EQ(responses.form(), ResponseForm::sparse);

    Responses<Impulse> all_pairs; // dense would want 2.4 GB
    all_pairs.start(10'000, jostle::plan_work(10'000, {.block_items = 1}));
    EXPECT_EQ(all_pairs.form(), ResponseForm::sparse);
    EXPECT_LT(all_pairs.bytes_reserved(), 10'000'000u);
}

TEST(ResponsesMemory, FailureAtAnyAllocationLosesNothingOfTheNextFrame)
{
    const std::vector<Pair> pairs = random_pairs(3'000, 3'000, 2);
    std::vector<Impulse> truth;
    {
        Responses<Impulse> responses;
        const auto merged = frame(responses, 3'000, pairs, 3, 1);
        truth.assign(merged.begin(), merged.end());
    }
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse}) {
        std::uint64_t failures = 0;
        for (bool failed = true; failed; failures += failed) {
            contract::CountingMemory memory;
            {
                ResponsesOptions options;
                options.memory = &memory;
                options.form = form;
                Responses<Impulse> responses(options);
                failed = false;
                try {
                    memory.failing_allocation = failures;
                    for (const std::uint32_t slots : {2u, 3u, 3u})
                        frame(responses, 3'000, pairs, slots, 1);
                } catch (const std::bad_alloc&) {
                    failed = true;
                }
                memory.failing_allocation = contract::CountingMemory::never;
                expect_same_bits(frame(responses, 3'000, pairs, 3, 0), truth, std::to_string(failures));
            }
            ASSERT_EQ(memory.blocks, 0u);
        }
        EXPECT_GE(failures, form == ResponseForm::dense ? 1u : 3u);
    }
}

TEST(ResponsesMemory, BehindAFailedStartNothingIsMerged)
{
    const std::vector<Pair> pairs = random_pairs(3'000, 3'000, 2);
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse})
        for (const bool merged_before : {true, false}) {
            contract::CountingMemory memory;
            ResponsesOptions options;
            options.memory = &memory;
            options.form = form;
            Responses<Impulse> responses(options);
            frame(responses, 3'000, pairs, 2, 1);
            jostle::WorkPlan plan;
            plan.items = plan.block_items = plan.blocks = plan.slots = 1;
            if (!merged_before) responses.start(3'000, plan);
            memory.failing_allocation = memory.allocations;
            EXPECT_THROW(responses.start(1'000'000, plan), std::bad_alloc);
            memory.failing_allocation = contract::CountingMemory::never;
            EXPECT_EQ(responses.merge().size(), 0u);
            responses.merge([](std::uint32_t first, std::span<const Impulse>) {
                ADD_FAILURE() << "values of objects from " << first << " on";
            });
            frame(responses, 3'000, pairs, 2, 1);
        }
}

TEST(ResponsesMemory, APlanBeyondAnyMemoryIsBadAlloc)
{
    constexpr std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
    jostle::WorkPlan beyond, fitting;
    beyond.items = beyond.blocks = most;
    fitting.items = fitting.block_items = fitting.blocks = 1;
    for (const std::uint32_t objects : {most, most / 2 + 1, 1u << 30}) { // the product wraps, to 0 and more
        contract::CountingMemory memory;
        ResponsesOptions options;
        options.memory = &memory;
        options.form = ResponseForm::dense;
        Responses<Impulse> responses(options);
        EXPECT_THROW(responses.start(objects, beyond), std::bad_alloc) << objects;
        EXPECT_EQ(memory.blocks, 0u) << "nobody was asked for memory";
        EXPECT_THROW(responses.add({0, 0}, 0, Impulse{}), jostle::Error);
        responses.start(3, fitting);
        responses.add({0, 0}, 2, {1, 2, 3, 4});
        EXPECT_EQ(responses.merge()[2].turn, 4);
    }
}

TEST(Responses, AMergeThatFailedLosesNothing)
{
    using process_test::FailingExecutor;
    const std::vector<Pair> pairs = random_pairs(3'000, 3'000, 7);
    std::vector<Impulse> truth;
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse})
        for (const auto fault : {FailingExecutor::Fault::leaves_one_out, FailingExecutor::Fault::runs_none,
                                 FailingExecutor::Fault::throws_an_int})
            for (const bool with_apply : {false, true}) {
                FailingExecutor executor;
                ResponsesOptions options;
                options.executor = &executor;
                options.form = form;
                Responses<Impulse> responses(options);
                if (truth.empty()) {
                    const auto merged = frame(responses, 3'000, pairs, 3, 1);
                    truth.assign(merged.begin(), merged.end());
                }
                const std::string where = "form " + std::to_string(int(form)) + ", fault " +
                                          std::to_string(int(fault)) + (with_apply ? ", applied" : "");
                for (int repeat = 0; repeat < 2; ++repeat) {
                    executor.fault = fault;
                    EXPECT_ANY_THROW(frame(responses, 3'000, pairs, 3, 1)) << where;
                    EXPECT_THROW(responses.add({0, 0}, 0, Impulse{}), jostle::Error)
                        << where << ": some may be merged already";
                    EXPECT_ANY_THROW((void)responses.merge()) << where;
                    executor.fault = FailingExecutor::Fault::none;
                    if (with_apply) expect_same_bits<Impulse>(applied(responses, 3'000), truth, where);
                    expect_same_bits(responses.merge(), truth, where);
                }
                // Nor does the next frame see anything of it.
                executor.fault = fault;
                EXPECT_ANY_THROW(frame(responses, 3'000, pairs, 3, 1)) << where;
                executor.fault = FailingExecutor::Fault::none;
                expect_same_bits(frame(responses, 3'000, {}, 3, 1), std::vector<Impulse>(3'000), where);
            }
}

TEST(Responses, StartForgetsWhatWasNotMerged)
{
    for (const ResponseForm form : {ResponseForm::dense, ResponseForm::sparse}) {
        ResponsesOptions options;
        options.form = form;
        Responses<int> responses(options);
        jostle::WorkPlan plan;
        plan.items = plan.blocks = 3;
        plan.slots = 2;
        for (int repeat = 0; repeat < 3; ++repeat) { // with nothing merged yet, and between two merges
            responses.start(2'000, plan);
            responses.add({0, 2}, 3, 10);
            responses.add({1, 1}, 1'999, 10);
            responses.start(2'000, plan);
            responses.add({1, 0}, 1'999, 1);
            responses.add({0, 2}, 4, 1);
            std::vector<int> expected(2'000);
            expected[1'999] = expected[4] = 1;
            const auto merged = responses.merge();
            EXPECT_EQ(std::vector<int>(merged.begin(), merged.end()), expected)
                << "form " << int(form) << ", repeat " << repeat;
        }
    }
}

TEST(ResponsesMemory, NothingIsAppliedBeforeWhatMayFailIsDone)
{
    constexpr std::uint32_t objects = 3'000; // of six bins
    std::vector<int> expected(objects);
    std::uint64_t failures = 0;
    for (bool failed = true; failed; failures += failed) {
        contract::CountingMemory memory;
        ResponsesOptions options;
        options.executor = &jostle::serial_executor();
        options.memory = &memory;
        options.form = ResponseForm::sparse;
        Responses<int> responses(options);
        jostle::WorkPlan plan;
        plan.items = plan.blocks = 4;
        responses.start(objects, plan);
        std::fill(expected.begin(), expected.end(), 0);
        for (const std::uint32_t block : {2u, 0u, 3u, 1u}) // out of order, so that merging wants memory
            for (std::uint32_t object = block; object < objects; object += 5) {
                responses.add({0, block}, object, int(object));
                expected[object] += int(object);
            }
        memory.failing_allocation = memory.allocations + failures;
        int calls = 0;
        failed = false;
        try {
            responses.merge([&](std::uint32_t, std::span<const int>) { ++calls; });
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        EXPECT_EQ(calls, failed ? 0 : 6) << "failing allocation " << failures;
        memory.failing_allocation = contract::CountingMemory::never;
        expect_same_bits<int>(applied(responses, objects), expected, "applied");
        expect_same_bits(responses.merge(), expected, "merged");
    }
    EXPECT_GE(failures, 12u) << "some for each bin";
}

// Which lines of memory were written: what cores share is a question of addresses.
struct Located
{
    static inline const Located* last = nullptr;
    char values[3] = {};
    Located& operator+=(const Located&)
    {
        last = this;
        return *this;
    }
};

TEST(ResponsesMemory, DenseBlocksNeverShareALine)
{
    ResponsesOptions options;
    options.form = ResponseForm::dense;
    Responses<Located> responses(options);
    jostle::WorkPlan plan;
    plan.items = plan.blocks = 8;
    responses.start(50, plan);
    std::uintptr_t last_line = 0;
    for (std::uint32_t block = 0; block < 8; ++block) {
        responses.add({0, block}, 0, {});
        EXPECT_GT(reinterpret_cast<std::uintptr_t>(Located::last) / 64, last_line);
        responses.add({0, block}, 49, {});
        last_line = reinterpret_cast<std::uintptr_t>(Located::last + 1) / 64;
    }
}

} // namespace
