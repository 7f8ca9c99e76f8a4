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

/// Numbers for pairs, as long as they touch: for arrays of what belongs to pairs, such as impulses to start
/// from. It is told what began and ended by every update of a World, from the first one on:
///
///     world.update();
///     slots.update(world.began(), world.ended());
///     impulses.resize(slots.end());
///
/// A pair keeps its number, its slot, from the update in which it begins to the one in which it ends, also
/// while it rests. A pair that begins gets the least that no pair had before the update, in the order of
/// began(): what a pair had that ends is given again from the next update on. A pair that began before and is
/// reported again keeps its own. Slots depend on these lists alone.
///
/// Cost      up to 57 bytes a pair, and some 80 ns for one that begins or ends; nothing for others. Nothing
///           is allocated while there are no more pairs than there once were.
/// Threads   any number may read at a time, but not during update() or restore().
/// Errors    `Error` that names the pair, and leaves the slots as they were.
class JOSTLE_API PairSlots
{
  public:
    static constexpr std::uint32_t no_slot = ~std::uint32_t{0};

    explicit PairSlots(std::pmr::memory_resource* memory = std::pmr::get_default_resource());
    /// What was moved from may only be assigned to or destroyed.
    PairSlots(PairSlots&&) noexcept;
    PairSlots& operator=(PairSlots&&) noexcept;
    ~PairSlots();

    /// Gives slots to pairs that begin, and takes back those of pairs that end. Both lists as World::began()
    /// and ended() have them: sorted, no pair twice or in both. A pair that ends must have begun, and of one
    /// that begins no older one with the same indices may still have a slot; else an update was left out,
    /// which is an `Error`.
    void update(std::span<const ObjectPair> began, std::span<const EndedPair> ended);

    /// began_slots()[k] is the slot of the k-th pair that the last update() was told began; ended_slots()[k]
    /// the one that the k-th that ended had. Valid until the next update().
    [[nodiscard]] std::span<const std::uint32_t> began_slots() const noexcept;
    [[nodiscard]] std::span<const std::uint32_t> ended_slots() const noexcept;
    /// Returns the slot of the pair with these indices, in either order; `no_slot` if the two don't touch.
    [[nodiscard]] std::uint32_t slot_of(std::uint32_t a, std::uint32_t b) const noexcept;
    /// Returns a number that every slot is less than.
    [[nodiscard]] std::uint32_t end() const noexcept;

    /// The pairs and their slots, to go back to together with the World: 16 bytes a slot, the same bytes on
    /// every machine. Not the lists of the last update.
    [[nodiscard]] std::vector<std::byte> save() const;
    /// Becomes what was saved. Bytes that are cut short, altered or something else are an `Error`.
    void restore(std::span<const std::byte> bytes);

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

JOSTLE_NAMESPACE_END
