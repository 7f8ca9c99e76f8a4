// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/world.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

template <std::size_t Size>
using UnsignedOf =
    std::conditional_t<Size == 1, std::uint8_t,
                       std::conditional_t<Size == 2, std::uint16_t,
                                          std::conditional_t<Size == 4, std::uint32_t, std::uint64_t>>>;

/// Appends numbers to bytes, little-endian, so that ranks on different machines understand each other.
/// `Bytes` is a vector of std::byte.
template <class Bytes, class Number>
    requires std::is_arithmetic_v<Number>
void put(Bytes& bytes, Number number)
{
    UnsignedOf<sizeof number> bits;
    std::memcpy(&bits, &number, sizeof bits);
    std::array<std::byte, sizeof bits> little;
    for (std::size_t i = 0; i < sizeof bits; ++i)
        little[i] = static_cast<std::byte>(bits >> (8 * i));
    bytes.insert(bytes.end(), little.begin(), little.end());
}
template <class Bytes, int Dim, class T>
void put(Bytes& bytes, const Aabb<Dim, T>& box)
{
    for (int d = 0; d < Dim; ++d) {
        put(bytes, box.lo[d]);
        put(bytes, box.hi[d]);
    }
}
template <class Bytes>
void put(Bytes& bytes, const ObjectFilter& filter)
{
    put(bytes, filter.category);
    put(bytes, filter.mask);
    put(bytes, filter.owner);
    put(bytes, std::uint8_t{filter.is_static});
}

/// Takes the numbers out again, in the same order. Whoever reads checks `failed` where bytes may be missing.
class Reader
{
  public:
    explicit Reader(std::span<const std::byte> bytes) noexcept : rest_(bytes) {}

    [[nodiscard]] bool empty() const noexcept { return rest_.empty(); }
    [[nodiscard]] std::size_t left() const noexcept { return rest_.size(); }
    [[nodiscard]] bool failed() const noexcept { return failed_; }

    template <class Number>
        requires std::is_arithmetic_v<Number>
    [[nodiscard]] Number take() noexcept
    {
        UnsignedOf<sizeof(Number)> bits = 0;
        const std::span<const std::byte> from = bytes(sizeof bits);
        for (std::size_t i = 0; i < from.size(); ++i)
            bits = static_cast<decltype(bits)>(bits | (static_cast<decltype(bits)>(from[i]) << (8 * i)));
        Number number;
        std::memcpy(&number, &bits, sizeof number);
        return number;
    }
    template <int Dim, class T>
    [[nodiscard]] Aabb<Dim, T> box() noexcept
    {
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = take<T>();
            box.hi[d] = take<T>();
        }
        return box;
    }
    [[nodiscard]] ObjectFilter filter() noexcept
    {
        ObjectFilter filter;
        filter.category = take<std::uint32_t>();
        filter.mask = take<std::uint32_t>();
        filter.owner = take<std::uint32_t>();
        filter.is_static = take<std::uint8_t>() != 0;
        return filter;
    }
    [[nodiscard]] std::span<const std::byte> bytes(std::size_t count) noexcept
    {
        if (rest_.size() < count) {
            failed_ = true;
            rest_ = {};
            return {};
        }
        const std::span<const std::byte> first = rest_.first(count);
        rest_ = rest_.subspan(count);
        return first;
    }

  private:
    std::span<const std::byte> rest_;
    bool failed_ = false;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
