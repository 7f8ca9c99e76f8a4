// SPDX-License-Identifier: MIT
// Work over the processors: thesis, ch. 4, the intervals of Alg. 9, and Alg. 11.
#include <atomic>
#include <exception>
#include <mutex>

#include "base/run_tasks.hpp"
#include "jostle/chapter.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace chapter {

Interval work_interval(std::uint32_t processor, std::uint32_t processors, std::uint32_t objects) noexcept
{
    const std::uint32_t work_size = objects / processors;
    const std::uint32_t begin = processor * work_size;
    return {begin, processor == processors - 1 ? objects : begin + work_size};
}

void on_all_processors(Executor& executor,
                       FunctionRef<void(std::uint32_t processor, std::uint32_t processors)> work)
{
    const std::uint32_t processors = executor.concurrency();
    std::vector<std::exception_ptr> errors(processors);
    run_tasks(executor, processors, [&](std::uint32_t processor) {
        try {
            work(processor, processors);
        } catch (...) {
            errors[processor] = std::current_exception();
        }
    });
    for (const std::exception_ptr& error : errors)
        if (error) std::rethrow_exception(error);
}

void test_collisions(std::span<const Pair> close_pairs, Executor& executor,
                     FunctionRef<void(std::uint32_t processor, const Pair& pair)> test, Batching batching,
                     std::uint32_t batch)
{
    if (batch == 0) throw Error(ErrorCode::invalid_argument, "batch = 0; give at least 1 pair at a time");
    std::size_t taken = 0; // guarded by critical_section
    std::mutex critical_section;
    std::atomic<std::size_t> cursor{0};

    on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t) {
        if (batching == Batching::critical_section) {
            std::vector<Pair> thread_buffer;
            for (;;) {
                {
                    const std::lock_guard lock(critical_section);
                    const std::size_t n = std::min<std::size_t>(batch, close_pairs.size() - taken);
                    const std::span<const Pair> pairs = close_pairs.subspan(taken, n);
                    thread_buffer.assign(pairs.begin(), pairs.end());
                    taken += n;
                }
                if (thread_buffer.empty()) break;
                for (const Pair& pair : thread_buffer)
                    test(processor, pair); // ProcessDetailedCollisionDetection
            }
        } else {
            // Nothing writes closePairs by now, so a processor reads its batch in place. A processor stops
            // at its first claim past the end: too few for the cursor to wrap around.
            for (std::size_t begin;
                 (begin = cursor.fetch_add(batch, std::memory_order_relaxed)) < close_pairs.size();)
                for (const Pair& pair :
                     close_pairs.subspan(begin, std::min<std::size_t>(batch, close_pairs.size() - begin)))
                    test(processor, pair);
        }
    });
}

} // namespace chapter
JOSTLE_NAMESPACE_END
