// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <utility>
#include <vector>

#include "jostle/process.hpp"
#include "jostle/queries.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Fills the lists of a batch.
class ResultListsAccess
{
  public:
    /// Refills them: append(i, items) appends the results of query i, in order, and returns whether there are
    /// more. Each block of queries has a copy of it, which may keep working memory. If anything throws, there
    /// are no lists.
    template <class Item, class F>
    static void fill(ResultLists<Item>& lists, std::size_t queries, const ProcessOptions& options,
                     const F& append)
    {
        std::pmr::vector<Item> all(std::move(lists.items_)); // if anything below throws, the lists are empty
        lists.items_.clear();
        std::pmr::vector<std::uint8_t> cut(std::move(lists.more_));
        lists.more_.clear();
        lists.offsets_.assign(queries + 1, 0);
        cut.assign(queries, 0);
        const WorkPlan plan = plan_work(queries, options);
        struct Part
        {
            std::uint32_t slot;
            std::size_t begin;
        };
        std::pmr::vector<Part> parts(plan.slots == 1 ? 0 : plan.blocks, lists.found_.get_allocator());
        if (lists.found_.size() < plan.slots) lists.found_.resize(plan.slots);
        if (plan.slots == 1) lists.found_[0].swap(all); // there is nothing to put together
        for (auto& each : lists.found_)
            each.clear();
        process_items(
            queries,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                std::pmr::vector<Item> mine(std::move(lists.found_[work.slot])); // others write nearby
                if (!parts.empty()) parts[begin / plan.block_items] = {work.slot, mine.size()};
                F own = append;
                for (auto i = static_cast<std::size_t>(begin); i < end; ++i) {
                    const std::size_t before = mine.size();
                    cut[i] = own(i, mine);
                    lists.offsets_[i + 1] = mine.size() - before;
                }
                lists.found_[work.slot] = std::move(mine);
            },
            options);
        for (std::size_t i = 0; i < queries; ++i)
            lists.offsets_[i + 1] += lists.offsets_[i];
        if (plan.slots == 1) {
            lists.found_[0].swap(all);
        } else {
            all.resize(lists.offsets_[queries]);
            process_items(
                plan.blocks,
                [&](std::uint64_t begin, std::uint64_t end, Work) {
                    for (std::size_t block = begin; block < end; ++block) {
                        const std::size_t from = lists.offsets_[block * plan.block_items];
                        const std::size_t to =
                            lists.offsets_[std::min<std::size_t>(queries, (block + 1) * plan.block_items)];
                        std::copy_n(lists.found_[parts[block].slot].data() + parts[block].begin, to - from,
                                    all.data() + from);
                    }
                },
                {options.executor, 4});
        }
        lists.items_ = std::move(all);
        lists.more_ = std::move(cut);
    }
};

JOSTLE_NAMESPACE_END
