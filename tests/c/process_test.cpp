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

using CSums = CTwin;

template <class Number>
void check_sums(const jostle_options& options, jostle_number number, std::uint32_t objects_there,
                std::uint32_t width)
{
    SCOPED_TRACE("type " + std::to_string(number) + ", width " + std::to_string(width));
    jostle_error error{};
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
    std::vector<Number> sums(expected.size(), 9);
    OK(jostle_sum_by_object(number, width, objects.data(), values.data(), objects.size(), &options,
                            objects_there, sums.data(), &error));
    EXPECT_EQ(sums, expected);
}

TEST_F(CSums, OfEveryTypeAndWidthAddUp)
{
    OK(jostle_executor_threads(3, &executor, &error));
    auto options = options_of<jostle_options>();
    options.executor = executor;
    for (const std::uint32_t objects : {3u, 5000u}) // in a table of all, and in lists
        for (std::uint32_t width = 1; width <= 8; ++width) {
            check_sums<float>(options, JOSTLE_FLOAT, objects, width);
            check_sums<double>(options, JOSTLE_DOUBLE, objects, width);
            check_sums<std::int64_t>(options, JOSTLE_INT64, objects, width);
        }
}

TEST_F(CSums, TheLowestObjectThatIsntThereIsNamedAndNothingWritten)
{
    OK(jostle_executor_threads(3, &executor, &error));
    auto options = options_of<jostle_options>();
    options.executor = executor;
    std::vector<std::uint32_t> objects(10'000, 1);
    const std::vector<float> values(10'000, 1);
    std::vector<float> sums(2, 9);
    for (const std::size_t wrong : {9'999u, 7'000u, 4'321u}) {
        objects[wrong] = 2;
        EXPECT_EQ(jostle_sum_by_object(JOSTLE_FLOAT, 1, objects.data(), values.data(), objects.size(),
                                       &options, 2, sums.data(), &error),
                  JOSTLE_INVALID_ARGUMENT);
        EXPECT_EQ(std::string(error.message),
                  "objects[" + std::to_string(wrong) + "] is 2, and there are 2 objects");
        EXPECT_EQ(error.index, wrong);
        EXPECT_EQ(sums, std::vector<float>(2, 9));
    }
}

} // namespace
} // namespace c_twin
