// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <span>

#include "jostle/executor.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/version.hpp"

/// Work on pairs, or on anything that can be numbered, balanced over the cores however uneven it is:
/// contacts, responses, whatever follows from "these two boxes touch".
///
///     jostle::process_pairs(finder.find(boxes), [&](jostle::Pair pair) { collide(pair.a, pair.b); });
///     jostle::process_items(n, [&](std::uint64_t begin, std::uint64_t end, jostle::Work) { ... });
///
/// Work is cut into blocks of consecutive items. The cut depends only on the number of items, never on
/// threads, so results kept per block are the same on every machine (see responses.hpp). Tasks claim blocks
/// one after another, in ascending order; a claim costs one atomic addition.
///
/// Errors   an exception of a callback ends the work and leaves the call. If several blocks throw, that of
///          the lowest block leaves the call, for any number of threads. Blocks above it may or may not have
///          run.
/// Threads  callbacks run on several threads at a time. Those of one block run on one thread, one after
///          another.
/// Memory   nothing is allocated.

JOSTLE_NAMESPACE_BEGIN

/// Which piece of work a callback is called for.
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
    /// Items per block. 0 chooses 8 to 256, which gives some thousand blocks if there are enough items.
    /// Smaller blocks balance better, larger ones need fewer claims. Raised if there would be more than 2^32
    /// - 1 blocks.
    std::uint64_t block_items = 0;
    /// The number of the first block. If two pieces of work add to one Responses, the second starts at the
    /// number of blocks of the first. See plan_both.
    std::uint32_t first_block = 0;
};

/// How work is cut. All except `slots` depends only on the items and block_items.
struct WorkPlan
{
    std::uint64_t items = 0;
    std::uint64_t block_items = 1; ///< the last block may have fewer; 0 if the sizes of blocks differ
    std::uint32_t blocks = 0;
    std::uint32_t slots = 1; ///< min(executor's concurrency, blocks), at least 1
};

/// How process_items and process_pairs cut this many items if given the same options. The slots depend on the
/// executor.
[[nodiscard]] JOSTLE_API WorkPlan plan_work(std::uint64_t items, const ProcessOptions& options = {});

/// The plan for two pieces of work that add to one Responses, such as two buffers of contacts. Set the number
/// of blocks of the first as `first_block` in the second one's options, which are otherwise those of its
/// plan:
///
///     const WorkPlan first = plan_work(near.size(), options), second = plan_work(far.size(), options);
///     responses.start(objects, plan_both(first, second));
///     process_contacts(near, collide, options);
///     options.first_block = first.blocks;
///     process_contacts(far, collide, options);
///
/// Errors   `Error` for more than 2^32 - 1 blocks: give block_items.
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
    std::uint64_t first;         ///< the position of the first among all items
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

/// Calls process(pair, work) or process(pair) for every pair, or process(batch) for runs of pairs, whichever
/// `process` accepts.
///
/// Order    the pairs of a block come in the buffer's order, and blocks run at the same time. A block whose
///          pairs are in several pieces of memory comes as several batches, one after another.
template <ItemProcess<Pair> F>
void process_pairs(PairView pairs, F&& process, const ProcessOptions& options = {})
{
    detail::process_each<Pair>(pairs.blocks(), pairs.size(), process, options);
}

/// The same for contacts (contact.hpp), or for any buffer with blocks() and size().
template <class Buffer, ItemProcess<typename Buffer::value_type> F>
void process_contacts(const Buffer& contacts, F&& process, const ProcessOptions& options = {})
{
    detail::process_each<typename Buffer::value_type>(contacts.blocks(), contacts.size(), process, options);
}

JOSTLE_NAMESPACE_END
