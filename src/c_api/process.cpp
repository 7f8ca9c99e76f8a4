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

jostle_work_plan plan_to_c(const WorkPlan& plan) noexcept
{
    return {plan.items, plan.block_items, plan.blocks, plan.slots};
}
jostle_work work_to_c(const Work& work) noexcept
{
    return {work.slot, work.block};
}
Schedule schedule_of(jostle_schedule schedule)
{
    switch (schedule) {
    case JOSTLE_DYNAMIC:
        return Schedule::dynamic;
    case JOSTLE_ZIGZAG:
        return Schedule::zigzag;
    case JOSTLE_EQUAL_BLOCKS:
        return Schedule::equal_blocks;
    default:
        refuse("there is no schedule " + std::to_string(schedule));
    }
}

/// Responses of any width and type.
class ResponsesContent : public Content
{
  public:
    virtual void start(std::uint32_t count, const WorkPlan& plan) = 0;
    virtual void add(Work work, std::uint64_t count, const std::uint32_t* of,
                     const unsigned char* values) = 0;
    virtual const void* merge(jostle_apply_function apply, void* context) = 0;
    [[nodiscard]] virtual ResponseForm form() const noexcept = 0;
    [[nodiscard]] virtual std::uint64_t bytes_reserved() const noexcept = 0;
    virtual void release_memory() noexcept = 0;

    Kept kept;
    std::uint32_t objects = 0;
    std::size_t value_size = 0;
};

template <class Number, std::size_t Width>
struct Row
{
    Number numbers[Width];
};

struct CallbackMerge
{
    jostle_merge_function merge;
    void* context;
    template <class Number, std::size_t Width>
    void operator()(Row<Number, Width>& into, const Row<Number, Width>& value) const
    {
        if (merge != nullptr)
            merge(context, into.numbers, value.numbers);
        else
            for (std::size_t i = 0; i < Width; ++i) {
                if constexpr (std::same_as<Number, std::int64_t>) // wraps around instead of overflowing
                    into.numbers[i] = static_cast<std::int64_t>(static_cast<std::uint64_t>(into.numbers[i]) +
                                                                static_cast<std::uint64_t>(value.numbers[i]));
                else
                    into.numbers[i] += value.numbers[i];
            }
    }
};

template <class Number, std::size_t Width>
class ResponsesOf final : public ResponsesContent
{
  public:
    using Value = Row<Number, Width>;

    ResponsesOf(Kept given, ResponseForm wanted_form, CallbackMerge merge)
        : responses_({given.executor.get(), given.resource(), wanted_form}, merge)
    {
        kept = std::move(given);
        value_size = sizeof(Value);
    }
    void start(std::uint32_t count, const WorkPlan& plan) override
    {
        objects = 0;
        responses_.start(count, plan);
        objects = count;
    }
    void add(Work work, std::uint64_t count, const std::uint32_t* of, const unsigned char* values) override
    {
        for (std::uint64_t i = 0; i < count; ++i) {
            Value value;
            std::memcpy(&value, values + i * sizeof value, sizeof value);
            responses_.add(work, of[i], value);
        }
    }
    const void* merge(jostle_apply_function apply, void* context) override
    {
        if (apply != nullptr)
            responses_.merge([&](std::uint32_t first, std::span<const Value> values) {
                apply(context, first, static_cast<std::uint32_t>(values.size()), values.data());
            });
        return responses_.merge().data();
    }
    [[nodiscard]] ResponseForm form() const noexcept override { return responses_.form(); }
    [[nodiscard]] std::uint64_t bytes_reserved() const noexcept override
    {
        return responses_.bytes_reserved();
    }
    void release_memory() noexcept override
    {
        responses_.release_memory();
        objects = 0;
    }

  private:
    Responses<Value, CallbackMerge> responses_;
};

template <class Number>
std::unique_ptr<ResponsesContent> responses_of(std::uint32_t width, Kept kept, ResponseForm form,
                                               CallbackMerge merge)
{
    switch (width) {
    case 1:
        return std::make_unique<ResponsesOf<Number, 1>>(std::move(kept), form, merge);
    case 2:
        return std::make_unique<ResponsesOf<Number, 2>>(std::move(kept), form, merge);
    case 3:
        return std::make_unique<ResponsesOf<Number, 3>>(std::move(kept), form, merge);
    case 4:
        return std::make_unique<ResponsesOf<Number, 4>>(std::move(kept), form, merge);
    case 5:
        return std::make_unique<ResponsesOf<Number, 5>>(std::move(kept), form, merge);
    case 6:
        return std::make_unique<ResponsesOf<Number, 6>>(std::move(kept), form, merge);
    case 7:
        return std::make_unique<ResponsesOf<Number, 7>>(std::move(kept), form, merge);
    case 8:
        return std::make_unique<ResponsesOf<Number, 8>>(std::move(kept), form, merge);
    default:
        refuse("the width is " + std::to_string(width) + ": a response is 1 to 8 numbers");
    }
}

void check_objects(const std::uint32_t* objects, std::uint64_t count, std::uint32_t end)
{
    wanted_array(objects, count, "objects");
    for (std::uint64_t i = 0; i < count; ++i)
        if (objects[i] >= end)
            refuse("objects[" + std::to_string(i) + "] is " + std::to_string(objects[i]) +
                       ", and there are " + std::to_string(end) + " objects",
                   JOSTLE_INVALID_ARGUMENT, i);
}

} // namespace

template <>
struct Behind<jostle_responses>
{
    using type = ResponsesContent;
    static constexpr std::uint64_t mark = 0x6a6f73746c650009U;
    static constexpr const char* name = "jostle_responses";
};

} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_plan_work(uint64_t items, const jostle_process_options* options, jostle_work_plan* plan,
                               jostle_error* error)
{
    return guarded(error, [&] {
        const Processing how(options);
        wanted(plan, "plan") = plan_to_c(plan_work(items, how.options));
    });
}
jostle_status jostle_plan_all_pairs(uint32_t objects, const jostle_process_options* options,
                                    jostle_work_plan* plan, jostle_error* error)
{
    return guarded(error, [&] {
        const Processing how(options);
        wanted(plan, "plan") = plan_to_c(plan_all_pairs(objects, how.options));
    });
}
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
jostle_status jostle_process_all_pairs(uint32_t objects, jostle_process_row_function process, void* context,
                                       const jostle_process_options* options, jostle_schedule schedule,
                                       jostle_error* error)
{
    return guarded(error, [&] {
        wanted_function(process, "process");
        const Processing how(options);
        process_all_pairs(
            objects,
            [&](const PairRow& row) {
                agreed(process(context, row.a, row.b_begin, row.b_end, work_to_c(row.work)));
            },
            how.options, schedule_of(schedule));
    });
}

// --- Responses ---

jostle_status jostle_responses_new(jostle_number number, uint32_t width,
                                   const jostle_responses_options* options, jostle_responses** out,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        const jostle_responses_options given = read_options(options, "jostle_responses_options");
        if (given.form < JOSTLE_AUTOMATIC || given.form > JOSTLE_SPARSE)
            refuse("there is no form " + std::to_string(given.form));
        const auto form = static_cast<ResponseForm>(given.form);
        const CallbackMerge merge{given.merge, given.context};
        Kept kept = keep(given.common);
        switch (number) {
        case JOSTLE_FLOAT:
            return hand_out(out, responses_of<float>(width, std::move(kept), form, merge));
        case JOSTLE_DOUBLE:
            return hand_out(out, responses_of<double>(width, std::move(kept), form, merge));
        case JOSTLE_INT64:
            return hand_out(out, responses_of<std::int64_t>(width, std::move(kept), form, merge));
        default:
            refuse("number is " + std::to_string(number) +
                   ": it must be JOSTLE_FLOAT, JOSTLE_DOUBLE or JOSTLE_INT64");
        }
    });
}
jostle_status jostle_responses_free(jostle_responses* responses, jostle_error* error)
{
    return guarded(error, [&] { release(responses); });
}
jostle_status jostle_responses_start(jostle_responses* responses, uint32_t objects,
                                     const jostle_work_plan* plan, jostle_error* error)
{
    return guarded(error, [&] {
        ResponsesContent& content = open(responses);
        const jostle_work_plan& given = wanted(plan, "plan");
        content.start(objects, {given.items, given.block_items, given.blocks, given.slots});
    });
}
jostle_status jostle_responses_add(jostle_responses* responses, jostle_work work, uint64_t count,
                                   const uint32_t* objects, const void* values, jostle_error* error)
{
    return guarded(error, [&] {
        ResponsesContent& content = open(responses);
        check_objects(objects, count, content.objects);
        content.add({work.slot, work.block}, count, objects,
                    wanted_array_of<unsigned char>(values, count * content.value_size, "values"));
    });
}
jostle_status jostle_responses_merge(jostle_responses* responses, jostle_apply_function apply, void* context,
                                     const void** values, uint64_t* count, jostle_error* error)
{
    return guarded(error, [&] {
        ResponsesContent& content = open(responses);
        wanted(values, "values");
        wanted(count, "count");
        *values = content.merge(apply, context);
        *count = content.objects;
    });
}
jostle_status jostle_responses_sum(jostle_responses* responses, uint32_t object_count,
                                   const uint32_t* objects, const void* values, uint64_t count,
                                   const void** sums, jostle_error* error)
{
    return guarded(error, [&] {
        ResponsesContent& content = open(responses);
        wanted(sums, "sums");
        check_objects(objects, count, object_count);
        const auto* const bytes =
            wanted_array_of<unsigned char>(values, count * content.value_size, "values");
        ProcessOptions options;
        options.executor = content.kept.executor.get();
        content.start(object_count, plan_work(count, options));
        process_items(
            count,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                content.add(work, end - begin, objects + begin, bytes + begin * content.value_size);
            },
            options);
        *sums = content.merge(nullptr, nullptr);
    });
}
jostle_status jostle_responses_form(const jostle_responses* responses, jostle_response_form* form,
                                    jostle_error* error)
{
    return guarded(error, [&] {
        const ResponsesContent& content = open(responses);
        wanted(form, "form") = static_cast<jostle_response_form>(content.form());
    });
}
jostle_status jostle_responses_bytes_reserved(const jostle_responses* responses, uint64_t* bytes,
                                              jostle_error* error)
{
    return guarded(error, [&] {
        const ResponsesContent& content = open(responses);
        wanted(bytes, "bytes") = content.bytes_reserved();
    });
}
jostle_status jostle_responses_release_memory(jostle_responses* responses, jostle_error* error)
{
    return guarded(error, [&] { open(responses).release_memory(); });
}

} // extern "C"
