// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/version.hpp"
#include "jostle/world.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Numbers pairs while they touch, to index arrays of per-pair data, such as impulses for warm starting. Tell
/// it what began and ended in every update of a World, from the first one on:
///
///     world.update();
///     slots.update(world.began(), world.ended());
///     impulses.resize(slots.end());
///
/// A pair keeps its number, its slot, from the update in which it begins to the one in which it ends, also
/// while it rests. Pairs that begin, in the order of began(), get the lowest slots that were free before the
/// update; a slot whose pair ends is free from the next update on. A pair that is reported again keeps its
/// slot. Slots depend only on these lists.
///
/// Cost      up to 57 bytes a pair, and some 80 ns for each that begins or ends; other pairs cost nothing.
///           Nothing is allocated while the number of pairs stays below its previous maximum.
/// Threads   any number of threads may read at a time, but not during update() or restore().
/// Errors    `Error` that names the pair. The slots are then unchanged.
class JOSTLE_API PairSlots
{
  public:
    static constexpr std::uint32_t no_slot = ~std::uint32_t{0};

    explicit PairSlots(std::pmr::memory_resource* memory = std::pmr::get_default_resource());
    /// A moved-from PairSlots may only be assigned to or destroyed.
    PairSlots(PairSlots&&) noexcept;
    PairSlots& operator=(PairSlots&&) noexcept;
    ~PairSlots();

    /// Gives slots to pairs that begin, and frees those of pairs that end. Both lists are as World::began()
    /// and ended() return them: sorted, with no pair twice or in both. It is an `Error`, which means that an
    /// update was left out, if a pair ends that hasn't begun, or a pair begins while an older one with the
    /// same indices has a slot.
    void update(std::span<const ObjectPair> began, std::span<const EndedPair> ended);

    /// began_slots()[k] is the slot of the k-th pair that began in the last update(), and ended_slots()[k]
    /// the former slot of the k-th that ended. Valid until the next update().
    [[nodiscard]] std::span<const std::uint32_t> began_slots() const noexcept;
    [[nodiscard]] std::span<const std::uint32_t> ended_slots() const noexcept;
    /// Returns the slot of the pair with these indices, in either order; `no_slot` if the two don't touch.
    [[nodiscard]] std::uint32_t slot_of(std::uint32_t a, std::uint32_t b) const noexcept;
    /// Returns a number greater than every slot.
    [[nodiscard]] std::uint32_t end() const noexcept;

    /// Saves the pairs and their slots, to be restored together with the World: 16 bytes a slot, the same
    /// bytes on every machine. The lists of the last update aren't saved.
    [[nodiscard]] std::vector<std::byte> save() const;
    /// Restores what was saved. Bytes that are truncated, altered or of another kind are an `Error`.
    void restore(std::span<const std::byte> bytes);

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

JOSTLE_NAMESPACE_END
