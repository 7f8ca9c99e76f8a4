// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstring>

#include "c_api/results.hpp"
#include "jostle/process.hpp"
#include "jostle/responses.hpp"

namespace jostle::c_api {
namespace {

/// Options of the caller's, and the executor for as long as the call lasts.
struct Processing
{
    explicit Processing(const jostle_process_options* given)
    {
        const jostle_process_options read = read_options(given, "jostle_process_options");
        executor = keep_executor(read.executor);
        options.executor = executor.get();
        options.block_items = read.block_items;
    }
    std::shared_ptr<Executor> executor;
    ProcessOptions options;
};

jostle_work work_to_c(const Work& work) noexcept
{
    return {work.slot, work.block};
}
/// `width` numbers of one response.
template <class Number, std::size_t Width>
struct Row
{
    Number numbers[Width];

    Row& operator+=(const Row& other)
    {
        for (std::size_t i = 0; i < Width; ++i)
            if constexpr (std::same_as<Number, std::int64_t>) // wraps around instead of overflowing
                numbers[i] = static_cast<std::int64_t>(static_cast<std::uint64_t>(numbers[i]) +
                                                       static_cast<std::uint64_t>(other.numbers[i]));
            else
                numbers[i] += other.numbers[i];
        return *this;
    }
};

/// What is to be added up.
struct Summands
{
    const std::uint32_t* objects;
    const void* values;
    std::uint64_t count;
    std::uint32_t object_count;
    void* sums;

    template <class Row>
    void add_up(const Kept& kept) const
    {
        wanted_array(objects, count, "objects");
        const auto* const from = wanted_array_of<unsigned char>(values, count * sizeof(Row), "values");
        auto* const to = wanted_array_of<unsigned char>(sums, object_count * sizeof(Row), "sums");
        Responses<Row> responses({.executor = kept.executor.get(), .memory = kept.resource()});
        const ProcessOptions options{.executor = kept.executor.get()};
        responses.start(object_count, plan_work(count, options));
        process_items(
            count,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                for (std::uint64_t i = begin; i < end; ++i) {
                    if (objects[i] >= object_count)
                        refuse("objects[" + std::to_string(i) + "] is " + std::to_string(objects[i]) +
                                   ", and there are " + std::to_string(object_count) + " objects",
                               JOSTLE_INVALID_ARGUMENT, i);
                    Row value;
                    std::memcpy(&value, from + i * sizeof value, sizeof value);
                    responses.add(work, objects[i], value);
                }
            },
            options);
        const std::span<const Row> merged = responses.merge();
        if (!merged.empty()) std::memcpy(to, merged.data(), merged.size_bytes());
    }
    template <class Number, std::size_t... Widths>
    void add_up_rows(std::uint32_t width, const Kept& kept, std::index_sequence<Widths...>) const
    {
        ((width == Widths + 1 ? add_up<Row<Number, Widths + 1>>(kept) : void()), ...);
    }
    template <class Number>
    void add_up_rows(std::uint32_t width, const Kept& kept) const
    {
        add_up_rows<Number>(width, kept, std::make_index_sequence<8>());
    }
};

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_process_items(uint64_t items, jostle_process_items_function process, void* context,
                                   const jostle_process_options* options, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(process, "process");
        const Processing how(options);
        process_items(
            items,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                agreed(process(context, begin, end, work_to_c(work)));
            },
            how.options);
    });
}
jostle_status jostle_process_blocks(const jostle_blocks* blocks, jostle_process_blocks_function process,
                                    void* context, const jostle_process_options* options, jostle_error* error)
{
    return guarded(error, [&] {
        const jostle_blocks& given = wanted_blocks(blocks, "blocks");
        wanted_function(process, "process");
        const Processing how(options);
        std::vector<std::uint64_t> ends; // of the blocks, counted from the first item
        ends.reserve(static_cast<std::size_t>(given.block_count));
        std::uint64_t end_of_block = 0;
        for (std::uint64_t i = 0; i < given.block_count; ++i)
            ends.push_back(end_of_block += given.blocks[i].count);
        process_items(
            given.count,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                auto block = static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), begin) -
                                                      ends.begin());
                while (begin < end) {
                    const std::uint64_t first = ends[block] - given.blocks[block].count;
                    const std::uint64_t last = std::min(end, ends[block]);
                    if (last > begin)
                        agreed(process(context,
                                       static_cast<const unsigned char*>(given.blocks[block].items) +
                                           (begin - first) * given.item_size,
                                       last - begin, begin, work_to_c(work)));
                    begin = last;
                    ++block;
                }
            },
            how.options);
    });
}
jostle_status jostle_sum_by_object(jostle_number number, uint32_t width, const uint32_t* objects,
                                   const void* values, uint64_t count, const jostle_options* options,
                                   uint32_t object_count, void* sums, jostle_error* error)
{
    return guarded(error, [&] {
        if (width < 1 || width > 8)
            refuse("the width is " + std::to_string(width) + ": a response is 1 to 8 numbers");
        const Summands summands{objects, values, count, object_count, sums};
        const Kept kept = keep(options);
        switch (number) {
        case JOSTLE_FLOAT:
            return summands.add_up_rows<float>(width, kept);
        case JOSTLE_DOUBLE:
            return summands.add_up_rows<double>(width, kept);
        case JOSTLE_INT64:
            return summands.add_up_rows<std::int64_t>(width, kept);
        default:
            refuse("number is " + std::to_string(number) +
                   ": it must be JOSTLE_FLOAT, JOSTLE_DOUBLE or JOSTLE_INT64");
        }
    });
}

} // extern "C"
