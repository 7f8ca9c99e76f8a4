// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <span>

#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/version.hpp"

/// Work on pairs, or on anything that can be numbered, shared out evenly over the cores however unevenly it
/// is spread: contacts, responses, whatever follows from "these two boxes touch".
///
///     jostle::process_pairs(finder.find(boxes), [&](jostle::Pair pair) { collide(pair.a, pair.b); });
///     jostle::process_items(n, [&](std::uint64_t begin, std::uint64_t end, jostle::Work) { ... });
///
/// Work is cut into blocks of consecutive items. How it is cut depends on the number of items alone, never on
/// threads, so that what is kept per block is the same on every machine (see responses.hpp). Tasks claim one
/// block after another, in ascending order; a claim costs one atomic addition.
///
/// Errors   an exception of a callback ends the work and leaves the call. If several blocks throw, it is the
///          exception of the lowest of them, whatever the number of threads. Blocks above it may or may not
///          have run.
/// Threads  callbacks run on several threads at a time. Those of one block run on one thread, one after
///          another.
/// Memory   nothing is allocated.

JOSTLE_NAMESPACE_BEGIN

/// Where a callback stands.
struct Work
{
    /// Selects scratch memory: tasks that run at the same time have different slots. Always below
    /// WorkPlan::slots. Results must not depend on it.
    std::uint32_t slot;
    /// The piece of work, numbered in the order of the items, from 0 (or ProcessOptions::first_block).
    /// Results may depend on it.
    std::uint32_t block;
};

struct ProcessOptions
{
    /// Null means default_executor().
    Executor* executor = nullptr;
    /// Items per block; 0 chooses 8 to 256, some thousand blocks where there are enough items. Fewer balance
    /// better, more cost fewer claims. Raised where there would be more than 2^32 - 1 blocks.
    std::uint64_t block_items = 0;
    /// The number of the first block: that of another piece of work's blocks, where both add to one
    /// Responses. See plan_both.
    std::uint32_t first_block = 0;
};

/// How work is cut. All but `slots` depends on the items and block_items alone.
struct WorkPlan
{
    std::uint64_t items = 0;
    std::uint64_t block_items = 1; ///< the last block may have fewer; 0 where blocks differ in how many
    std::uint32_t blocks = 0;
    std::uint32_t slots = 1; ///< min(executor's concurrency, blocks), at least 1
};

/// How process_items and process_pairs cut that many items, if they are given the same options: the slots are
/// those of the executor.
[[nodiscard]] JOSTLE_API WorkPlan plan_work(std::uint64_t items, const ProcessOptions& options = {});

/// The plan of two pieces of work that add to one Responses, such as two buffers of contacts. The second
/// piece's options have the first one's blocks as `first_block`, and are otherwise those of its plan:
///
///     const WorkPlan first = plan_work(near.size(), options), second = plan_work(far.size(), options);
///     responses.start(objects, plan_both(first, second));
///     process_contacts(near, collide, options);
///     options.first_block = first.blocks;
///     process_contacts(far, collide, options);
///
/// Errors   too many blocks: there are 2^32 - 1 numbers; give block_items.
[[nodiscard]] JOSTLE_API WorkPlan plan_both(const WorkPlan& first, const WorkPlan& second);

/// Calls work_on(begin, end, work) for each block [begin, end) of the items 0 to `items` - 1.
JOSTLE_API void process_items(std::uint64_t items,
                              FunctionRef<void(std::uint64_t begin, std::uint64_t end, Work work)> work_on,
                              const ProcessOptions& options = {});

/// A run of items of one block.
template <class Item>
struct Batch
{
    std::span<const Item> items; ///< never empty
    std::uint64_t first;         ///< the first one's place among all items
    Work work;
};
using PairBatch = Batch<Pair>;

template <class F, class Item>
concept ItemProcess = std::invocable<F&, const Batch<Item>&> || std::invocable<F&, const Item&, Work> ||
                      std::invocable<F&, const Item&>;

namespace detail {
/// Calls process(run, offset, first, count, work) for each part of a block that lies in one run.
JOSTLE_API void
process_runs(std::uint64_t items, FunctionRef<std::uint64_t(std::size_t run)> size_of_run,
             FunctionRef<void(std::size_t, std::uint64_t, std::uint64_t, std::uint64_t, Work)> process,
             const ProcessOptions& options);

template <class Item, class F>
void process_each(std::span<const std::span<const Item>> runs, std::uint64_t items, F& process,
                  const ProcessOptions& options)
{
    process_runs(
        items, [runs](std::size_t run) -> std::uint64_t { return runs[run].size(); },
        [runs, &process](std::size_t run, std::uint64_t offset, std::uint64_t first, std::uint64_t count,
                         Work work) {
            const std::span<const Item> some = runs[run].subspan(offset, count);
            if constexpr (std::invocable<F&, const Batch<Item>&>)
                process(Batch<Item>{some, first, work});
            else
                for (const Item& item : some)
                    if constexpr (std::invocable<F&, const Item&, Work>)
                        process(item, work);
                    else
                        process(item);
        },
        options);
}
} // namespace detail

/// Calls process(pair, work) or process(pair) for every pair, or process(batch) for runs of them, whichever
/// `process` takes.
///
/// Order    the pairs of a block in the buffer's order; blocks at the same time. A block whose pairs lie in
///          several pieces of memory comes as several batches, one after another.
template <ItemProcess<Pair> F>
void process_pairs(PairView pairs, F&& process, const ProcessOptions& options = {})
{
    detail::process_each<Pair>(pairs.blocks(), pairs.size(), process, options);
}

/// The same for contacts (contact.hpp), or whatever lies in a buffer with blocks() and size().
template <class Buffer, ItemProcess<typename Buffer::value_type> F>
void process_contacts(const Buffer& contacts, F&& process, const ProcessOptions& options = {})
{
    detail::process_each<typename Buffer::value_type>(contacts.blocks(), contacts.size(), process, options);
}

/// How the rows of process_all_pairs are shared out. All three call the same pairs in the same blocks.
enum class Schedule
{
    /// A task takes the next rows when it is done with its last: balanced whatever a pair costs.
    dynamic,
    /// Settled beforehand, long and short rows in turn: balanced if all pairs cost the same.
    /// Source   thesis, ch. 4, Alg. 14.
    zigzag,
    /// Settled beforehand, equal blocks of objects: the first gets most of the pairs, for comparison.
    /// Source   thesis, ch. 4, Alg. 13.
    equal_blocks,
};

/// One object and those of higher number: a block of process_all_pairs.
struct PairRow
{
    std::uint32_t a;
    std::uint32_t b_begin, b_end; ///< b runs from b_begin = a + 1 to b_end - 1
    Work work;                    ///< work.block is a, counted from the options' first_block
};

namespace detail {
JOSTLE_API void process_rows(std::uint32_t objects, FunctionRef<void(const PairRow&)> process,
                             const ProcessOptions& options, Schedule schedule);
}

/// How process_all_pairs cuts its work: one block for each object but the last, whatever block_items says.
[[nodiscard]] JOSTLE_API WorkPlan plan_all_pairs(std::uint32_t objects, const ProcessOptions& options = {});

/// Calls process(pair, work) for all n (n - 1) / 2 pairs a < b of n objects, or process(row) for the pairs of
/// one a. For tests without a broad phase, and as the chapter does it.
template <class F>
    requires std::invocable<F&, const PairRow&> || std::invocable<F&, const Pair&, Work>
void process_all_pairs(std::uint32_t objects, F&& process, const ProcessOptions& options = {},
                       Schedule schedule = Schedule::dynamic)
{
    if constexpr (std::invocable<F&, const PairRow&>) {
        detail::process_rows(objects, process, options, schedule);
    } else {
        const auto each = [&process](const PairRow& row) {
            for (std::uint32_t b = row.b_begin; b < row.b_end; ++b)
                process(Pair{row.a, b}, row.work);
        };
        detail::process_rows(objects, each, options, schedule);
    }
}

JOSTLE_NAMESPACE_END
