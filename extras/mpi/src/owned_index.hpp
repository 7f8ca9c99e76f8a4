// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>
#include <memory_resource>
#include <optional>
#include <vector>

#include "jostle/box_index.hpp"
#include "owned.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// This rank's objects that aren't disabled, for queries: made again for the first query after an update
/// that changed one. Its ids ascend as the objects' do, so that its order of answers is theirs.
template <int Dim, Coordinate T>
class OwnedIndex
{
  public:
    OwnedIndex(Executor* executor, std::pmr::memory_resource* memory)
        : index_({.executor = executor, .memory = memory}), objects_(memory)
    {
    }

    /// Calls ask(index, filter) with what a filter of the user's means there.
    template <class Ask>
    auto with(const Owned<Dim, T>& owned, T margin, const QueryFilter& given, const Ask& ask)
    {
        refresh(owned, margin);
        jostle::QueryFilter filter;
        const auto column = [&](std::uint32_t ObjectFilter::* field) {
            return objects_.empty() ? StridedView<std::uint32_t>()
                                    : StridedView<std::uint32_t>(&(objects_.front().filter.*field),
                                                                 objects_.size(), sizeof(Entry));
        };
        constexpr std::uint32_t any = ~std::uint32_t{0};
        if (given.category != any || given.mask != any) {
            filter.category = column(&ObjectFilter::category);
            filter.mask = column(&ObjectFilter::mask);
            filter.asker_category = given.category;
            filter.asker_mask = given.mask;
        }
        if (given.owner != Filter::no_owner) {
            filter.owner = column(&ObjectFilter::owner);
            filter.asker_owner = given.owner;
        }
        if (given.exclude) {
            const auto at =
                std::lower_bound(objects_.begin(), objects_.end(), *given.exclude,
                                 [](const Entry& each, std::uint64_t id) { return each.id < id; });
            if (at != objects_.end() && at->id == *given.exclude)
                filter.exclude = static_cast<std::uint32_t>(at - objects_.begin());
        }
        return ask(index_, filter);
    }
    [[nodiscard]] std::uint64_t id(std::uint32_t in_index) const noexcept { return objects_[in_index].id; }

  private:
    struct Entry
    {
        std::uint64_t id;
        ObjectFilter filter;
        Aabb<Dim, T> bounds;
    };
    void refresh(const Owned<Dim, T>& owned, T margin)
    {
        if (version_ == owned.version()) return;
        version_.reset();
        objects_.clear();
        for (const auto& each : owned.entries())
            if (owned.exists(each))
                if (const Object<Dim, T> now = owned.now(each); now.details.enabled)
                    objects_.push_back({each.id, now.details.filter, now.bounds(margin)});
        std::sort(objects_.begin(), objects_.end(),
                  [](const Entry& a, const Entry& b) { return a.id < b.id; });
        index_.build(objects_.empty() ? BoxView<Dim, T>()
                                      : BoxView<Dim, T>::strided(objects_.front().bounds.lo.data(),
                                                                 objects_.front().bounds.hi.data(),
                                                                 objects_.size(), sizeof(Entry)));
        version_ = owned.version();
    }

    BoxIndex<Dim, T> index_;
    std::pmr::vector<Entry> objects_;
    std::optional<std::uint64_t> version_;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
