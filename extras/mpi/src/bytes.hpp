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
/// Numbers of which those near to 0 take the fewest bytes: seven bits in each, the lowest first; all but the
/// last have the eighth. Put together here, since a vector grows by one byte no faster than by many.
template <std::size_t Most>
class ShortNumbers
{
  public:
    void add(std::uint64_t number) noexcept
    {
        for (; number >= 128; number >>= 7)
            bytes_[size_++] = static_cast<std::byte>(number | 128);
        bytes_[size_++] = static_cast<std::byte>(number);
    }
    template <class Bytes>
    void put_into(Bytes& bytes) const
    {
        bytes.insert(bytes.end(), bytes_.data(), bytes_.data() + size_);
    }

  private:
    std::array<std::byte, 10 * Most> bytes_;
    std::size_t size_ = 0;
};
template <class Bytes>
void put_short(Bytes& bytes, std::uint64_t number)
{
    ShortNumbers<1> one;
    one.add(number);
    one.put_into(bytes);
}
/// The way from one number to another, round the end where that is shorter: 0, -1, 1, -2, ... are 0, 1, 2, 3.
template <class Unsigned>
[[nodiscard]] constexpr Unsigned step_to(Unsigned number, Unsigned from) noexcept
{
    constexpr int sign = 8 * sizeof(Unsigned) - 1;
    const auto way = static_cast<Unsigned>(number - from);
    return static_cast<Unsigned>((way << 1) ^ (Unsigned{0} - (way >> sign)));
}
template <class Unsigned>
[[nodiscard]] constexpr Unsigned after_step(Unsigned step, Unsigned from) noexcept
{
    return static_cast<Unsigned>(from + ((step >> 1) ^ (Unsigned{0} - (step & 1))));
}

/// Floating-point numbers as unsigned ones in the same order: neighbours become neighbours.
template <class T>
[[nodiscard]] UnsignedOf<sizeof(T)> place_of(T number) noexcept
{
    UnsignedOf<sizeof(T)> bits;
    std::memcpy(&bits, &number, sizeof bits);
    constexpr auto sign = UnsignedOf<sizeof(T)>{1} << (8 * sizeof(T) - 1);
    return (bits & sign) != 0 ? ~bits : bits | sign;
}
template <class T>
[[nodiscard]] T number_at(UnsignedOf<sizeof(T)> place) noexcept
{
    constexpr auto sign = UnsignedOf<sizeof(T)>{1} << (8 * sizeof(T) - 1);
    const UnsignedOf<sizeof(T)> bits = (place & sign) != 0 ? place ^ sign : ~place;
    T number;
    std::memcpy(&number, &bits, sizeof number);
    return number;
}
/// Where the lower end of a box like `known` may be. Zeros have one sign there: those who know a box may have
/// it with different ones, since they are equal.
template <int Dim, class T>
[[nodiscard]] T likely_lo(const Aabb<Dim, T>& known, int d) noexcept
{
    return known.lo[d] + T(0);
}
/// And where its upper end, if it begins at lo. A NaN, of a box without end, would differ between processors.
template <int Dim, class T>
[[nodiscard]] T likely_hi(const Aabb<Dim, T>& known, int d, T lo) noexcept
{
    const T hi = lo + (known.hi[d] - known.lo[d]) + T(0);
    return hi == hi ? hi : T(0);
}
/// A box as its difference to one that the reader knows, to the bit, whatever the two are: in 3D float some
/// 13 bytes in place of 24 for one that has moved.
template <class Bytes, int Dim, class T>
void put_near(Bytes& bytes, const Aabb<Dim, T>& box, const Aabb<Dim, T>& known)
{
    ShortNumbers<2 * std::size_t{Dim}> steps;
    for (int d = 0; d < Dim; ++d) {
        steps.add(step_to(place_of(box.lo[d]), place_of(likely_lo(known, d))));
        steps.add(step_to(place_of(box.hi[d]), place_of(likely_hi(known, d, box.lo[d]))));
    }
    steps.put_into(bytes);
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

/// Takes the numbers out again, in the same order. Readers check `failed` where bytes may be missing.
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
    /// What put_short() wrote.
    [[nodiscard]] std::uint64_t take_short() noexcept
    {
        std::uint64_t number = 0;
        for (unsigned shift = 0; shift < 64; shift += 7) {
            const auto byte = take<std::uint8_t>();
            number |= std::uint64_t{byte & 127u} << shift;
            if (byte < 128) break;
        }
        return number;
    }
    /// What put_near() wrote.
    template <int Dim, class T>
    [[nodiscard]] Aabb<Dim, T> box_near(const Aabb<Dim, T>& known) noexcept
    {
        const auto take_near = [&](T likely) {
            const auto step = static_cast<UnsignedOf<sizeof(T)>>(take_short());
            return number_at<T>(after_step(step, place_of(likely)));
        };
        Aabb<Dim, T> box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = take_near(likely_lo(known, d));
            box.hi[d] = take_near(likely_hi(known, d, box.lo[d]));
        }
        return box;
    }
    /// The next id of a message, after put_short(step_to(id, last one)).
    [[nodiscard]] std::uint64_t take_id() noexcept { return id_ = after_step(take_short(), id_); }
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
    std::uint64_t id_ = 0; // the last one
    bool failed_ = false;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
