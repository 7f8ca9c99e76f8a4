// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "world/objects/pair_lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// A number for each pair that touches, from the update in which it begins to the one in which it ends. It is
/// the least number that no pair has. The numbers depend on the pairs alone, in the order of the lists of
/// each update.
class PairSlots
{
  public:
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    explicit PairSlots(std::pmr::memory_resource* memory)
        : keys_(memory), free_(memory), table_(memory), noted_(memory), is_noted_(memory)
    {
    }

    [[nodiscard]] std::uint32_t of(Key key) const noexcept;
    /// Greater than every slot that was ever in use.
    [[nodiscard]] std::uint32_t end() const noexcept { return static_cast<std::uint32_t>(keys_.size()); }
    /// By slot; `no_key` where there is no pair.
    [[nodiscard]] std::span<const Key> keys() const noexcept { return keys_; }

    /// Room for so many more, and for so many in all.
    void make_room(std::size_t began, std::size_t end = 0);
    /// Gives slots to pairs that begin, in their order, then takes back those of pairs that end: so that no
    /// pair gets what another has left in the same update. A pair that is reported again keeps its own.
    void change(Lists& lists) noexcept;

    /// As they were saved; false if a key is there twice. There are none yet.
    [[nodiscard]] bool restore(std::span<const Key> keys);
    /// For all these pairs, which ascend. There are none yet.
    void assign(const PairBuffer& pairs);

    // For journals: records which slots were given and taken back since begin_notes().

    struct Note
    {
        std::uint32_t slot;
        Key key; // that it had; no_key if none, or if there was no such slot
    };
    /// First makes room for the notes of so many slots, or of all that exist; then notes are taken.
    void make_room_for_notes(std::size_t slots);
    void begin_notes() noexcept;
    /// In the order in which they were taken, each slot once.
    [[nodiscard]] std::span<const Note> notes() const noexcept { return noted_; }
    [[nodiscard]] std::uint32_t end_then() const noexcept { return end_then_; }
    /// Gives these keys to these slots, which include all noted ones; then so many slots remain. No key may
    /// occur twice, or belong to another slot. Call make_room(keys.size(), end) before.
    void go_back(std::span<const Note> keys, std::uint32_t end) noexcept;

  private:
    void note(std::uint32_t slot) noexcept
    {
        if (!takes_notes_ || is_noted_[slot] != 0) return;
        is_noted_[slot] = 1;
        noted_.push_back({slot, keys_[slot]}); // there is room
    }
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

    bool takes_notes_ = false;
    std::uint32_t end_then_ = 0;
    std::pmr::vector<Note> noted_;            // there is room for all slots there can be
    std::pmr::vector<std::uint8_t> is_noted_; // by slot, as many as there can be
};

} // namespace world
JOSTLE_NAMESPACE_END
