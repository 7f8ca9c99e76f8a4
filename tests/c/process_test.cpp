// SPDX-License-Identifier: MIT
// Work and responses in C.
#include <algorithm>
#include <cstring>
#include <vector>

#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

using CProcess = CTwin;

struct Call
{
    std::uint64_t begin, end;
    std::uint32_t slot, block;
    bool operator==(const Call&) const = default;
};

TEST_F(CProcess, WorkIsCutAsCppCutsIt)
{
    OK(jostle_executor_serial(&executor, &error));
    auto options = options_of<jostle_process_options>();
    options.executor = executor;
    jostle::ProcessOptions twin_options{.executor = &jostle::serial_executor()};
    Pairs pairs(1000);
    for (std::uint32_t i = 0; i < 1000; ++i)
        pairs[i] = {i, i + 1};
    const jostle_block pieces[] = {{pairs.data(), 301}, {&pairs[301], 699}};
    const jostle_blocks blocks{pieces, 2, 1000, sizeof(jostle_pair)};
    for (const std::uint64_t block_items : {0u, 7u, 400u}) {
        options.block_items = twin_options.block_items = block_items;
        jostle_work_plan plan;
        OK(jostle_plan_work(1000, &options, &plan, &error));
        const jostle::WorkPlan expected_plan = jostle::plan_work(1000, twin_options);
        EXPECT_EQ(plan.items, expected_plan.items);
        EXPECT_EQ(plan.block_items, expected_plan.block_items);
        EXPECT_EQ(plan.blocks, expected_plan.blocks);
        EXPECT_EQ(plan.slots, expected_plan.slots);
        std::vector<Call> calls, expected;
        const auto note = [](void* context, std::uint64_t begin, std::uint64_t end, jostle_work work) {
            static_cast<std::vector<Call>*>(context)->push_back({begin, end, work.slot, work.block});
            return std::int32_t{0};
        };
        OK(jostle_process_items(1000, note, &calls, &options, &error));
        jostle::process_items(
            1000,
            [&](std::uint64_t begin, std::uint64_t end, jostle::Work work) {
                expected.push_back({begin, end, work.slot, work.block});
            },
            twin_options);
        EXPECT_EQ(calls, expected);

        // Items of blocks: each in its place.
        Pairs seen(1000);
        const auto take = [](void* context, const void* items, std::uint64_t count, std::uint64_t first,
                             jostle_work) {
            std::copy_n(static_cast<const jostle::Pair*>(items), count,
                        static_cast<jostle::Pair*>(context) + first);
            return std::int32_t{0};
        };
        OK(jostle_process_blocks(&blocks, take, seen.data(), &options, &error));
        EXPECT_EQ(seen, pairs);
    }
}

TEST_F(CProcess, EachScheduleIsTheOneAskedFor)
{
    auto options = options_of<jostle_process_options>();
    const auto run = [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* with) {
        for (std::uint32_t i = 0; i < count; ++i) // on one thread, as if there were three
            task(with, i);
        return std::int32_t{0};
    };
    OK(jostle_executor_callback(3, run, nullptr, &executor, &error));
    options.executor = executor;
    jostle::CallbackExecutor three(
        3, nullptr, [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t), void* with) {
            for (std::uint32_t i = 0; i < count; ++i)
                task(with, i);
        });
    const std::pair<jostle_schedule, jostle::Schedule> schedules[] = {
        {JOSTLE_DYNAMIC, jostle::Schedule::dynamic},
        {JOSTLE_ZIGZAG, jostle::Schedule::zigzag},
        {JOSTLE_EQUAL_BLOCKS, jostle::Schedule::equal_blocks}};
    for (const auto& [schedule, twin] : schedules) {
        std::vector<Call> calls, expected;
        const auto note = [](void* context, std::uint32_t a, std::uint32_t begin, std::uint32_t end,
                             jostle_work work) {
            EXPECT_EQ(work.block, a);
            static_cast<std::vector<Call>*>(context)->push_back({begin, end, work.slot, a});
            return std::int32_t{0};
        };
        OK(jostle_process_all_pairs(20, note, &calls, &options, schedule, &error));
        jostle::process_all_pairs(
            20,
            [&](const jostle::PairRow& row) {
                expected.push_back({row.b_begin, row.b_end, row.work.slot, row.a});
            },
            {.executor = &three}, twin);
        EXPECT_EQ(calls, expected);
    }
}

using CResponses = CTwin;

template <class Number>
void check_sums(jostle_responses*& responses, jostle_number number, jostle_response_form form,
                std::uint32_t width)
{
    SCOPED_TRACE("type " + std::to_string(number) + ", form " + std::to_string(form) + ", width " +
                 std::to_string(width));
    constexpr std::uint32_t objects_there = 5000; // so many are merged in several runs
    jostle_error error{};
    auto options = options_of<jostle_responses_options>();
    options.form = form;
    OK(jostle_responses_new(number, width, &options, &responses, &error));
    Random random(8);
    std::vector<std::uint32_t> objects;
    std::vector<Number> values, expected(std::size_t{objects_there} * width);
    for (int i = 0; i < 3000; ++i) {
        objects.push_back(random.below(objects_there));
        for (std::uint32_t k = 0; k < width; ++k) {
            values.push_back(static_cast<Number>(random.below(1000)));
            expected[objects.back() * width + k] += values.back();
        }
    }
    const void* sums = nullptr;
    OK(jostle_responses_sum(responses, objects_there, objects.data(), values.data(), objects.size(), &sums,
                            &error));
    EXPECT_EQ(std::memcmp(sums, expected.data(), expected.size() * sizeof(Number)), 0);
    jostle_response_form told = -1;
    OK(jostle_responses_form(responses, &told, &error));
    if (form != JOSTLE_AUTOMATIC) {
        EXPECT_EQ(told, form);
    }

    // Run by run, and what is left in the end.
    jostle_work_plan plan;
    OK(jostle_plan_work(1, nullptr, &plan, &error));
    OK(jostle_responses_start(responses, objects_there, &plan, &error));
    OK(jostle_responses_add(responses, {0, 0}, objects.size(), objects.data(), values.data(), &error));
    struct Applied
    {
        std::vector<Number> values;
        std::size_t width;
    } applied{std::vector<Number>(expected.size()), width};
    std::uint64_t count = 0;
    OK(jostle_responses_merge(
        responses,
        [](void* context, std::uint32_t first, std::uint32_t merged, const void* run) {
            auto& into = *static_cast<Applied*>(context);
            std::copy_n(static_cast<const Number*>(run), merged * into.width,
                        into.values.begin() + static_cast<std::ptrdiff_t>(first * into.width));
        },
        &applied, &sums, &count, &error));
    EXPECT_EQ(count, objects_there);
    EXPECT_EQ(applied.values, expected);
    EXPECT_EQ(std::memcmp(sums, expected.data(), expected.size() * sizeof(Number)), 0);
    OK(jostle_responses_free(responses, &error));
    responses = nullptr;
}

TEST_F(CResponses, OfEveryTypeAndWidthAddUp)
{
    for (const jostle_response_form form : {JOSTLE_AUTOMATIC, JOSTLE_DENSE, JOSTLE_SPARSE})
        for (std::uint32_t width = 1; width <= 8; ++width) {
            check_sums<float>(responses, JOSTLE_FLOAT, form, width);
            check_sums<double>(responses, JOSTLE_DOUBLE, form, width);
            check_sums<std::int64_t>(responses, JOSTLE_INT64, form, width);
        }
}

} // namespace
} // namespace c_twin
