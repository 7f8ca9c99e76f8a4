// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/find_pairs.hpp"
#include "world/objects/state.hpp"
#include "world/update/arena.hpp"
#include "world/update/entries.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The pairs of active objects that can come to touch while no object moves far: those whose padded boxes
/// touch. A padded box is bigger by the world's slack, and stays until the object's box leaves it. While all
/// stay inside, testing these pairs is the whole search. Only a cache, and one of boxes alone: it knows
/// neither filters nor which objects exist, so nothing that an update takes back makes it wrong.
template <int Dim, class T>
class NearPairs
{
  public:
    using Box = Aabb<Dim, T>;

    /// 0: there are none.
    NearPairs(T slack, std::pmr::memory_resource* memory)
        : slack_(slack),
          owners_(memory),
          padded_(memory),
          first_(memory),
          partners_(memory),
          slot_of_(memory),
          entry_(memory),
          now_(memory)
    {
    }

    /// Updates them to the entries. False: so many objects have left their padded boxes, now and before,
    /// that a new search is cheaper. `padded` becomes the number of objects that were padded again.
    [[nodiscard]] bool follow(const State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
                              std::uint64_t& padded, Arena& arena);

    // Valid after that. Padded objects have slots, which ascend with their indices.

    [[nodiscard]] std::uint32_t slots() const noexcept { return static_cast<std::uint32_t>(owners_.size()); }
    [[nodiscard]] Index index(std::uint32_t slot) const noexcept { return owners_[slot]; }
    /// Not less than any other if it isn't searched for in this update; then its box touches none.
    [[nodiscard]] Entry entry(std::uint32_t slot) const noexcept { return entry_[slot]; }
    [[nodiscard]] const Box& box(std::uint32_t slot) const noexcept { return now_[slot]; }
    /// The greater slots of those that are near, ascending; and how many the slots before have.
    [[nodiscard]] std::span<const std::uint32_t> partners(std::uint32_t slot) const noexcept
    {
        return {partners_.data() + first_[slot], partners_.data() + first_[slot + 1]};
    }
    [[nodiscard]] std::size_t partners_before(std::uint32_t slot) const noexcept { return first_[slot]; }

  private:
    static constexpr Entry nobody{~std::uint32_t{0}};

    [[nodiscard]] bool is_inside(const Entries<Dim, T>& entries, Entry entry) const noexcept;
    std::size_t place(const State<Dim, T>& state, const Entries<Dim, T>& entries, Arena& arena);
    struct Renewed;
    void renew(const State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder, Arena& arena);
    void pad(const Entries<Dim, T>& entries, Renewed& renewed) const;
    static std::span<const Pair> find_new(const State<Dim, T>& state, const Renewed& renewed,
                                          PairFinder& finder, Arena& arena);
    void merge(const Renewed& renewed, std::span<const Pair> pairs, std::pmr::vector<std::size_t>& first,
               std::pmr::vector<std::uint32_t>& partners) const;
    void forget() noexcept;

    const T slack_;
    std::pmr::vector<Index> owners_;           // of slots
    std::pmr::vector<Box> padded_;             // of slots
    std::pmr::vector<std::size_t> first_;      // of slots, and one more: where its partners begin
    std::pmr::vector<std::uint32_t> partners_; // slots
    Table<Index, std::uint32_t> slot_of_;      // right if that slot says so, too
    std::pmr::vector<Entry> entry_;            // of slots, in this update
    std::pmr::vector<Box> now_;                // of slots, in this update

    bool on_trial_ = false;                   // all were padded anew in the last update that looked
    std::uint32_t waits_ = 0, next_wait_ = 1; // updates before that is tried again
};

} // namespace world
JOSTLE_NAMESPACE_END
