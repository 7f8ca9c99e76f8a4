// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>

#include "world/objects/objects.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The number of a filter among the different ones in use.
enum class FilterClass : std::uint8_t
{
    look = 255 // unknown: look at the object
};

/// Numbers the filters that were ever used in a world, so that one byte per object, and one bit per pair of
/// bytes, tell whether two objects may pair; reading the objects would cost two cache misses. Scenes have few
/// filters; all after the first 255 share the number `look`.
class FilterClasses
{
  public:
    explicit FilterClasses(std::pmr::memory_resource* memory) : of_object_(memory) {}

    [[nodiscard]] FilterClass of(const ObjectFilter& filter) noexcept
    {
        if (count_ != 0 && filters_[last_] == filter) return FilterClass{last_};
        for (std::uint32_t c = 0; c < count_; ++c)
            if (filters_[c] == filter) return FilterClass{last_ = static_cast<std::uint8_t>(c)};
        if (count_ == most) return FilterClass::look;
        last_ = static_cast<std::uint8_t>(count_++);
        filters_[last_] = filter;
        pass_[last_] = {};
        for (std::uint32_t c = 0; c < count_; ++c)
            if (passes(filters_[c], filter)) {
                pass_[c][last_ / 64] |= std::uint64_t{1} << (last_ % 64);
                pass_[last_][c / 64] |= std::uint64_t{1} << (c % 64);
            }
        return FilterClass{last_};
    }
    /// Neither is `look`.
    [[nodiscard]] bool pass(FilterClass a, FilterClass b) const noexcept
    {
        return (pass_[raw(a)][raw(b) / 64] >> (raw(b) % 64) & 1) != 0;
    }
    /// Whatever the objects.
    [[nodiscard]] bool all_pass() const noexcept
    {
        return count_ == 0 || (count_ == 1 && pass(FilterClass{0}, FilterClass{0}));
    }

    /// The class of an object: that of its filter after the last update, if it existed then.
    [[nodiscard]] FilterClass& operator[](Index index) noexcept { return of_object_[index]; }
    [[nodiscard]] FilterClass operator[](Index index) const noexcept { return of_object_[index]; }
    void make_room(std::size_t objects) { of_object_.grow(objects); }

  private:
    static constexpr std::uint32_t most = 255;

    // For the first count_. The others aren't initialised, which would take a fifth of the time to make a
    // world.
    union
    {
        std::array<ObjectFilter, most> filters_;
    };
    std::array<std::array<std::uint64_t, 4>, most> pass_;
    std::uint32_t count_ = 0;
    std::uint8_t last_ = 0;
    Table<Index, FilterClass> of_object_;
};

} // namespace world
JOSTLE_NAMESPACE_END
