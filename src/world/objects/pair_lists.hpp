// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/pair_buffer.hpp"
#include "jostle/world.hpp"
#include "world/objects/numbers.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The lists of pairs that an update makes. All ascend.
struct Lists
{
    explicit Lists(std::pmr::memory_resource* memory)
        : persisted(memory), others(memory), began(memory), ended(memory)
    {
    }
    // Together these two have all pairs that touch, whose filters agree, and of which one object was active
    // when they were made.
    PairBuffer persisted;
    std::pmr::vector<Pair> others; // began, refused, or neither of the two changed
    std::pmr::vector<ObjectPair> began;
    std::pmr::vector<EndedPair> ended;
    bool all_active = true; // no object has come to rest since
};

/// Pairs of indices as numbers with the same order.
using Key = std::uint64_t;
constexpr Key no_key = ~Key{0}; // greater than every pair

[[nodiscard]] inline Key key_of(const Pair& pair) noexcept
{
    return Key{pair.a} << 32 | pair.b;
}
[[nodiscard]] inline Pair pair_of(Key key) noexcept
{
    return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
}
[[nodiscard]] inline Pair pair_of(Index x, Index y) noexcept
{
    return {std::min(raw(x), raw(y)), std::max(raw(x), raw(y))};
}

/// Iterates over ascending pairs in blocks, from the first that isn't less than a given key.
class PairCursor
{
  public:
    Key key = no_key; // of the current pair; `no_key` at the end

    PairCursor(std::span<const std::span<const Pair>> blocks, Key from) noexcept
    {
        block_ = std::partition_point(blocks.data(), blocks.data() + blocks.size(),
                                      [from](const auto& block) { return key_of(block.back()) < from; });
        last_ = blocks.data() + blocks.size();
        if (block_ == last_) return;
        end_ = block_->data() + block_->size();
        at_ = std::partition_point(block_->data(), end_,
                                   [from](const Pair& pair) { return key_of(pair) < from; });
        key = key_of(*at_);
    }
    void next() noexcept { skip_to(at_ + 1); }

    /// The current pair, and the length of the contiguous run that begins there. At the end of all blocks it
    /// is a sentinel: a pair greater than any, with a run too long to be exhausted.
    [[nodiscard]] const Pair* at() const noexcept { return at_; }
    [[nodiscard]] std::uint64_t left() const noexcept
    {
        return key == no_key ? no_key : static_cast<std::uint64_t>(end_ - at_);
    }
    /// Advances to one of these, or past the last of them.
    void skip_to(const Pair* place) noexcept
    {
        at_ = place;
        if (at_ == end_) {
            if (++block_ == last_) {
                at_ = &none_;
                key = no_key;
                return;
            }
            at_ = block_->data();
            end_ = at_ + block_->size();
        }
        key = key_of(*at_);
    }

  private:
    static constexpr Pair none_ = {~std::uint32_t{0}, ~std::uint32_t{0}};
    const Pair* at_ = &none_;
    const Pair* end_ = nullptr;
    const std::span<const Pair>* block_ = nullptr;
    const std::span<const Pair>* last_ = nullptr;
};

} // namespace world
JOSTLE_NAMESPACE_END
