// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <new>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// An array of atomic numbers that grows by segments which never move, so any thread may read and write
/// elements while another makes it grow.
template <class Number>
class Segments
{
  public:
    using Place = std::atomic<Number>;

    explicit Segments(std::pmr::memory_resource* memory) : memory_(memory) {}
    Segments(const Segments&) = delete;
    Segments& operator=(const Segments&) = delete;
    ~Segments()
    {
        for (std::uint32_t s = 0; s < segments; ++s)
            if (Place* segment = segment_[s].load(std::memory_order_relaxed))
                memory_->deallocate(segment, size_of(s) * sizeof(Place), alignof(Place));
    }

    /// The element of a place whose segment exists.
    [[nodiscard]] Place& operator[](std::uint32_t index) const noexcept
    {
        const std::uint32_t s = segment_of(index);
        return segment_[s].load(std::memory_order_acquire)[index - first_of(s)];
    }
    /// Null if the segment doesn't exist.
    [[nodiscard]] Place* find(std::uint32_t index) const noexcept
    {
        const std::uint32_t s = segment_of(index);
        Place* const segment = segment_[s].load(std::memory_order_acquire);
        return segment == nullptr ? nullptr : segment + (index - first_of(s));
    }
    /// Makes the segment of this place, filled with zeros, unless it exists. One thread at a time.
    void make(std::uint32_t index)
    {
        const std::uint32_t s = segment_of(index);
        if (segment_[s].load(std::memory_order_relaxed) != nullptr) return;
        auto* segment = static_cast<Place*>(memory_->allocate(size_of(s) * sizeof(Place), alignof(Place)));
        for (std::size_t i = 0; i < size_of(s); ++i)
            new (segment + i) Place(0);
        segment_[s].store(segment, std::memory_order_release);
    }
    /// Makes the segments of the first `count` places. One thread at a time.
    void grow(std::uint64_t count)
    {
        for (std::uint32_t s = 0; count != 0 && s <= segment_of(static_cast<std::uint32_t>(count - 1)); ++s)
            make(first_of(s));
    }

  private:
    static constexpr std::uint32_t first_bits = 6;
    static constexpr std::uint32_t segments = 32 - first_bits + 1;

    // Segment 0 has the first 2^first_bits places, and each further one as many as all before it.
    static std::uint32_t segment_of(std::uint32_t index) noexcept
    {
        return 32 - static_cast<std::uint32_t>(std::countl_zero(index >> first_bits));
    }
    static std::size_t size_of(std::uint32_t s) noexcept
    {
        return std::size_t{1} << (first_bits + (s == 0 ? 0 : s - 1));
    }
    static std::uint32_t first_of(std::uint32_t s) noexcept
    {
        return s == 0 ? 0 : static_cast<std::uint32_t>(size_of(s));
    }

    std::pmr::memory_resource* memory_;
    std::array<std::atomic<Place*>, segments> segment_ = {};
};

} // namespace world
JOSTLE_NAMESPACE_END
