// SPDX-License-Identifier: MIT
#include "jostle/process.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <string>

#include "base/run_tasks.hpp"
#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace {

Executor& executor_of(const ProcessOptions& options)
{
    return options.executor == nullptr ? default_executor() : *options.executor;
}

std::uint32_t slots_for(std::uint32_t blocks, const ProcessOptions& options)
{
    return std::max(1u, std::min(executor_of(options).concurrency(), blocks));
}

/// A task for each of the plan's slots; a single one is run right here.
template <class Task>
void run_slots(const WorkPlan& plan, const ProcessOptions& options, const Task& task)
{
    if (plan.slots == 1)
        task(0);
    else
        run_tasks(executor_of(options), plan.slots, task);
}

/// What callbacks throw. Blocks up to the lowest one that throws all run, so that its exception is the one
/// that leaves, on any number of threads.
class Failure
{
  public:
    [[nodiscard]] bool allows(std::uint64_t block) const noexcept
    {
        return block < lowest_.load(std::memory_order_relaxed);
    }
    /// In a handler.
    void note(std::uint64_t block) noexcept
    {
        const std::lock_guard lock(mutex_);
        if (!allows(block)) return;
        lowest_.store(block, std::memory_order_relaxed);
        error_ = std::current_exception();
    }
    void rethrow() const
    {
        if (error_) std::rethrow_exception(error_);
    }

  private:
    std::atomic<std::uint64_t> lowest_{std::numeric_limits<std::uint64_t>::max()};
    std::mutex mutex_;
    std::exception_ptr error_;
};

/// On lines of its own: every claim writes it.
struct alignas(128) Cursor
{
    std::atomic<std::uint64_t> next{0};
};

/// make_task() gives each task a function of its own for (begin, end, work).
template <class MakeTask>
void run_blocks(const WorkPlan& plan, const ProcessOptions& options, MakeTask make_task)
{
    Cursor cursor;
    Failure failure;
    const auto task = [&](std::uint32_t slot) {
        auto work_on = make_task();
        for (std::uint64_t block;
             (block = cursor.next.fetch_add(1, std::memory_order_relaxed)) < plan.blocks &&
             failure.allows(block);) {
            const std::uint64_t begin = block * plan.block_items;
            const std::uint64_t end = begin + std::min(plan.block_items, plan.items - begin);
            try {
                work_on(begin, end, Work{slot, options.first_block + static_cast<std::uint32_t>(block)});
            } catch (...) {
                failure.note(block);
            }
        }
    };
    run_slots(plan, options, task);
    failure.rethrow();
}

constexpr std::uint64_t most_blocks = std::numeric_limits<std::uint32_t>::max();

/// Throws unless there are numbers for `first` blocks and `more` behind them.
void check_blocks(std::uint64_t first, std::uint64_t more)
{
    if (first + more <= most_blocks) return;
    throw Error(ErrorCode::invalid_argument, "there would be " + std::to_string(first) + " and " +
                                                 std::to_string(more) +
                                                 " blocks of work, more than 2^32 - 1; raise block_items");
}

} // namespace

WorkPlan plan_work(std::uint64_t items, const ProcessOptions& options)
{
    WorkPlan plan;
    plan.items = items;
    plan.block_items =
        options.block_items == 0 ? std::clamp<std::uint64_t>(items / 1024, 8, 256) : options.block_items;
    plan.block_items = std::max(plan.block_items, items / most_blocks + 1);
    plan.blocks =
        static_cast<std::uint32_t>(items / plan.block_items + (items % plan.block_items == 0 ? 0 : 1));
    check_blocks(options.first_block, plan.blocks);
    plan.slots = slots_for(plan.blocks, options);
    return plan;
}

WorkPlan plan_both(const WorkPlan& first, const WorkPlan& second)
{
    check_blocks(first.blocks, second.blocks);
    WorkPlan both;
    both.items = first.items + second.items;
    both.block_items = 0;
    both.blocks = first.blocks + second.blocks;
    both.slots = std::max(first.slots, second.slots);
    return both;
}

void process_items(std::uint64_t items, FunctionRef<void(std::uint64_t, std::uint64_t, Work)> work_on,
                   const ProcessOptions& options)
{
    if (!work_on)
        throw Error(ErrorCode::invalid_argument,
                    "process_items was given a FunctionRef to nothing; give a function");
    run_blocks(plan_work(items, options), options, [&] { return work_on; });
}

void detail::process_runs(
    std::uint64_t items, FunctionRef<std::uint64_t(std::size_t)> size_of_run,
    FunctionRef<void(std::size_t, std::uint64_t, std::uint64_t, std::uint64_t, Work)> process,
    const ProcessOptions& options)
{
    run_blocks(plan_work(items, options), options, [&] {
        // A task's blocks ascend, so it finds their items by walking on from where it was.
        return [&, run = std::size_t{0}, before = std::uint64_t{0}](std::uint64_t begin, std::uint64_t end,
                                                                    Work work) mutable {
            while (begin < end) {
                std::uint64_t size = size_of_run(run);
                for (; begin >= before + size; size = size_of_run(++run))
                    before += size;
                const std::uint64_t count = std::min(end, before + size) - begin;
                process(run, begin - before, begin, count, work);
                begin += count;
            }
        };
    });
}

JOSTLE_NAMESPACE_END
