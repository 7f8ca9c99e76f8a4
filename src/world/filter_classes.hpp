// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>

#include "world/objects.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Numbers the filters that are in use, so that one byte per object, and a bit per pair of bytes, says whether
/// two objects may pair: objects themselves are two cache misses. Scenes have few filters; what comes after
/// the first 255 shares the number `look`, which says nothing.
class FilterClasses
{
  public:
    static constexpr std::uint8_t look = 255;

    std::uint8_t of(const ObjectFilter& filter) noexcept
    {
        if (count_ != 0 && filters_[last_] == filter) return last_;
        for (std::uint32_t c = 0; c < count_; ++c)
            if (filters_[c] == filter) return last_ = static_cast<std::uint8_t>(c);
        if (count_ == look) return look;
        last_ = static_cast<std::uint8_t>(count_++);
        filters_[last_] = filter;
        for (std::uint32_t c = 0; c < count_; ++c)
            if (passes(filters_[c], filter)) {
                pass_[c][last_ / 64] |= std::uint64_t{1} << (last_ % 64);
                pass_[last_][c / 64] |= std::uint64_t{1} << (c % 64);
            }
        return last_;
    }
    /// Neither is `look`.
    [[nodiscard]] bool pass(std::uint8_t a, std::uint8_t b) const noexcept
    {
        return (pass_[a][b / 64] >> (b % 64) & 1) != 0;
    }

    /// Whatever the objects.
    [[nodiscard]] bool all_pass() const noexcept { return count_ == 0 || (count_ == 1 && pass(0, 0)); }

  private:
    std::array<ObjectFilter, look> filters_ = {};
    std::array<std::array<std::uint64_t, 4>, look> pass_ = {};
    std::uint32_t count_ = 0;
    std::uint8_t last_ = 0;
};

} // namespace world
JOSTLE_NAMESPACE_END
