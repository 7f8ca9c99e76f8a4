// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/block_buffer.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Two touching objects, by their positions in the input. Within one set a < b; between two sets a belongs
/// to the first and b to the second.
struct Pair
{
    std::uint32_t a;
    std::uint32_t b;
    friend constexpr bool operator==(const Pair&, const Pair&) = default;
    friend constexpr auto operator<=>(const Pair&, const Pair&) = default;
};

/// All pairs of one call. Blocks, and pairs inside them, come in the order that the filling call documents.
using PairBuffer = BlockBuffer<Pair>;

/// A read-only view of pairs: of a PairBuffer, or of an array, vector or span.
class PairView
{
  public:
    PairView(const PairBuffer& pairs) noexcept : blocks_(pairs.blocks()), size_(pairs.size()) {}
    template <class Container>
        requires std::convertible_to<const Container&, std::span<const Pair>>
    PairView(const Container& pairs) noexcept : array_(pairs), size_(array_.size())
    {
    }
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    [[nodiscard]] std::span<const std::span<const Pair>> blocks() const noexcept
    {
        return array_.empty() ? blocks_ : std::span(&array_, 1);
    }

  private:
    std::span<const Pair> array_;
    std::span<const std::span<const Pair>> blocks_;
    std::uint64_t size_;
};

/// The pairs of many scenes, with one array per scene. PairFinder::find_scenes returns it.
///
///     const jostle::ScenePairs& found = finder.find_scenes(boxes, offsets);
///     for (std::size_t scene = 0; scene < found.scenes(); ++scene)
///         for (jostle::Pair pair : found[scene]) ... // numbers of boxes within the scene
///
/// Lifetime  the arrays stay valid until the object is filled again, moved or destroyed.
/// Threads   const members from any number of threads.
class ScenePairs
{
  public:
    explicit ScenePairs(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : small_(memory), large_(memory), scenes_(memory)
    {
    }

    [[nodiscard]] std::size_t scenes() const noexcept { return scenes_.size(); }
    /// Returns the pairs of one scene. The number isn't checked.
    [[nodiscard]] std::span<const Pair> operator[](std::size_t scene) const noexcept
    {
        return scenes_[scene];
    }
    /// Returns the number of pairs in all scenes.
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }

  private:
    friend class SceneFinder; // the library fills it: src/pairs/scene_finder.hpp

    PairBuffer small_, large_; // memory alone: shared by scenes, and of single scenes
    std::vector<std::span<const Pair>, detail::MovingAllocator<std::span<const Pair>>> scenes_;
    std::uint64_t size_ = 0;
};

/// An order-independent fingerprint of a set of pairs: the sum modulo 2^64 over its pairs of the splitmix64
/// finaliser of (a << 32 | b). Two systems that agree on count and checksum found the same pairs. For the sum
/// over parts, add the parts' checksums.
[[nodiscard]] JOSTLE_API std::uint64_t pair_checksum(PairView pairs) noexcept;

JOSTLE_NAMESPACE_END
