// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "world/objects/pair_lists.hpp"
#include "world/objects/state.hpp"
#include "world/update/arena.hpp"
#include "world/update/candidates.hpp"
#include "world/update/entries.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The pairs that `accept` now refuses, and those that it no longer refuses.
class Refusals
{
  public:
    Refusals(KeySet& refused, Arena& arena)
        : refused_(refused),
          added_(arena.list<Key>("pairs that are refused now")),
          removed_(arena.list<Key>("pairs that are no longer refused"))
    {
    }
    /// Before.
    [[nodiscard]] bool has(Key key) const noexcept { return refused_.contains(key); }
    void add(Key key)
    {
        if (!has(key)) added_.push_back(key);
    }
    void remove(Key key) { removed_.push_back(key); }
    [[nodiscard]] std::span<const Key> added() const noexcept { return added_; }
    [[nodiscard]] std::span<const Key> removed() const noexcept { return removed_; }
    /// So that commit() can't fail.
    void make_room() { refused_.reserve(added_.size()); }
    void commit() noexcept
    {
        for (const Key key : added_)
            refused_.insert(key);
        for (const Key key : removed_)
            refused_.erase(key);
    }

  private:
    KeySet& refused_;
    std::pmr::vector<Key>& added_;
    std::pmr::vector<Key>& removed_;
};

/// The stage `judge` of an update: compares the pairs that touch now with those that did before, calls
/// `accept`, and fills `next`. `old_pairs` are those of objects that wake up, which `last` doesn't have.
/// `touching` is in the memory of `next.persisted`, where the pairs that persist stay.
template <int Dim, class T>
[[nodiscard]] Refusals judge(State<Dim, T>& state, const Changes<Dim, T>& changes,
                             const Entries<Dim, T>& entries, std::span<Pair> touching,
                             std::span<const Pair> old_pairs, const Lists& last, Lists& next, Arena& arena);

} // namespace world
JOSTLE_NAMESPACE_END
