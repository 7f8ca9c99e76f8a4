// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "world/pair_lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// A number for each pair that touches, from the update in which it begins to the one in which it ends; as
/// small as may be: the least that no pair has. Which pair has which depends on the pairs alone, in the order
/// of the lists of each update.
class PairSlots
{
  public:
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    explicit PairSlots(std::pmr::memory_resource* memory) : keys_(memory), free_(memory), table_(memory) {}

    [[nodiscard]] std::uint32_t of(Key key) const noexcept;
    /// More than any slot that was ever in use.
    [[nodiscard]] std::uint32_t end() const noexcept { return static_cast<std::uint32_t>(keys_.size()); }
    /// By slot; `no_key` where there is no pair.
    [[nodiscard]] std::span<const Key> keys() const noexcept { return keys_; }

    /// Room for so many more.
    void make_room(std::size_t began);
    /// Gives slots to pairs that begin, in their order, then takes back those of pairs that end: so that no
    /// pair gets what another has left in the same update. A pair that is reported again keeps its own.
    void change(Lists& lists) noexcept;

    /// As they were saved; false if a key is there twice. There are none yet.
    [[nodiscard]] bool restore(std::span<const Key> keys);
    /// For all these pairs, which ascend. There are none yet.
    void assign(const PairBuffer& pairs);

  private:
    [[nodiscard]] std::size_t place_of(Key key) const noexcept;
    [[nodiscard]] std::uint32_t add(Key key) noexcept;
    void put(Key key, std::uint32_t slot) noexcept;
    void remove(Key key, std::uint32_t slot) noexcept;

    std::pmr::vector<Key> keys_;           // by slot
    std::pmr::vector<std::uint32_t> free_; // a heap, the least in front; there is room for all
    // Open addressing: slots at the places of their keys, or behind; none where there is none. A power of
    // two, at most half of it in use.
    std::pmr::vector<std::uint32_t> table_;
    std::size_t used_ = 0;
};

} // namespace world
JOSTLE_NAMESPACE_END
