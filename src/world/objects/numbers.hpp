// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <type_traits>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Two kinds of numbers that the compiler keeps apart. In a Pair both are plain integers, and the code tells
// which it holds.

/// The position of an object in Objects: the first half of its ObjectId.
enum class Index : std::uint32_t
{
};
/// The position of an entry of an update's search in Entries.
enum class Entry : std::uint32_t
{
};

template <class Number>
[[nodiscard]] constexpr std::underlying_type_t<Number> raw(Number number) noexcept
{
    return static_cast<std::underlying_type_t<Number>>(number);
}

/// An array indexed by one kind of number.
template <class Number, class Value>
class Table
{
  public:
    explicit Table(std::pmr::memory_resource* memory) : values_(memory) {}

    [[nodiscard]] Value& operator[](Number number) noexcept { return values_[raw(number)]; }
    [[nodiscard]] const Value& operator[](Number number) const noexcept { return values_[raw(number)]; }
    [[nodiscard]] std::size_t size() const noexcept { return values_.size(); }
    void resize(std::size_t size) { values_.resize(size); }
    /// New elements get `value`.
    void grow(std::size_t size, const Value& value = {})
    {
        if (values_.size() < size) values_.resize(size, value);
    }
    void assign(std::size_t size, const Value& value) { values_.assign(size, value); }
    [[nodiscard]] std::pmr::vector<Value>& values() noexcept { return values_; }
    [[nodiscard]] const std::pmr::vector<Value>& values() const noexcept { return values_; }

  private:
    std::pmr::vector<Value> values_;
};

/// Makes room for `count` more, growing by at least half.
template <class Vector>
void reserve_more(Vector& vector, std::size_t count)
{
    const std::size_t wanted = vector.size() + count;
    if (wanted > vector.capacity())
        vector.reserve(std::max(wanted, vector.capacity() + vector.capacity() / 2));
}

} // namespace world
JOSTLE_NAMESPACE_END
