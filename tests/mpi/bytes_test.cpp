// SPDX-License-Identifier: MIT
// What messages are made of comes out as it went in, to the bit.
#include "bytes.hpp"

#include <bit>
#include <limits>

#include "scene.hpp"

namespace mpi_tests {
namespace {

using Bytes = std::vector<std::byte>;
using jostle::Aabb;
using jostle::mpi::after_step;
using jostle::mpi::number_at;
using jostle::mpi::place_of;
using jostle::mpi::put_near;
using jostle::mpi::put_short;
using jostle::mpi::Reader;
using jostle::mpi::step_to;
using jostle::mpi::UnsignedOf;

TEST(Bytes, ShortNumbers)
{
    Bytes bytes;
    std::vector<std::uint64_t> numbers;
    std::size_t length = 0;
    for (unsigned bit = 0; bit < 64; ++bit)
        for (const std::uint64_t near : {~std::uint64_t{0}, std::uint64_t{0}, std::uint64_t{1}}) {
            const std::uint64_t number = (std::uint64_t{1} << bit) + near;
            numbers.push_back(number);
            put_short(bytes, number);
            for (std::uint64_t rest = number;; rest >>= 7) {
                ++length;
                if (rest < 128) break;
            }
            EXPECT_EQ(bytes.size(), length) << number;
        }
    Reader from(bytes);
    for (const std::uint64_t number : numbers)
        EXPECT_EQ(from.take_short(), number);
    EXPECT_TRUE(from.empty() && !from.failed());
    Reader cut(std::span<const std::byte>(bytes).first(bytes.size() - 1));
    for (std::size_t i = 0; i < numbers.size(); ++i)
        (void)cut.take_short();
    EXPECT_TRUE(cut.failed());
    const Bytes endless(20, std::byte{255});
    Reader past(endless);
    (void)past.take_short();
    EXPECT_EQ(past.left(), 10u);
}

TEST(Bytes, StepsGoBothWaysAndRoundTheEnd)
{
    EXPECT_EQ(step_to<std::uint32_t>(7, 7), 0u);
    EXPECT_EQ(step_to<std::uint32_t>(6, 7), 1u);
    EXPECT_EQ(step_to<std::uint32_t>(8, 7), 2u);
    EXPECT_EQ(step_to<std::uint64_t>(0, ~std::uint64_t{0}), 2u);
    Random random(1);
    for (int i = 0; i < 10000; ++i) {
        const std::uint64_t a = random.next() >> random.below(64), b = random.next() >> random.below(64);
        EXPECT_EQ(after_step(step_to(a, b), b), a);
        const auto c = static_cast<std::uint32_t>(a), d = static_cast<std::uint32_t>(b);
        EXPECT_EQ(after_step(step_to(c, d), d), c);
    }
}

/// Any bits that aren't NaN's, and often those of which rules are made.
template <class T>
T any_number(Random& random)
{
    constexpr T infinity = std::numeric_limits<T>::infinity();
    constexpr T odd[] = {T(0),
                         -T(0),
                         infinity,
                         -infinity,
                         std::numeric_limits<T>::max(),
                         -std::numeric_limits<T>::denorm_min(),
                         std::numeric_limits<T>::min(),
                         T(1),
                         T(-1)};
    const std::uint32_t kind = random.below(3);
    if (kind == 0) return odd[random.below(std::size(odd))];
    if (kind == 1) return static_cast<T>(random.uniform(-100, 100));
    const T number = std::bit_cast<T>(static_cast<UnsignedOf<sizeof(T)>>(random.next()));
    return number == number ? number : T(3);
}
template <int Dim, class T>
Aabb<Dim, T> any_box(Random& random)
{
    Aabb<Dim, T> box;
    for (int d = 0; d < Dim; ++d) {
        box.lo[d] = any_number<T>(random);
        box.hi[d] = any_number<T>(random);
        if (box.hi[d] < box.lo[d]) std::swap(box.lo[d], box.hi[d]);
    }
    return box;
}

template <int Dim, class T>
void check_boxes()
{
    using Bits = UnsignedOf<sizeof(T)>;
    Random random(Dim * sizeof(T));
    for (int i = 0; i < 10000; ++i) {
        const T x = any_number<T>(random), y = any_number<T>(random);
        EXPECT_EQ(std::bit_cast<Bits>(number_at<T>(place_of(x))), std::bit_cast<Bits>(x));
        EXPECT_TRUE(x == y || (x < y) == (place_of(x) < place_of(y)));
        const auto known = any_box<Dim, T>(random), box = any_box<Dim, T>(random);
        Aabb<Dim, T> theirs = known; // the same, with zeros of the other sign
        for (int d = 0; d < Dim; ++d) {
            if (theirs.lo[d] == 0) theirs.lo[d] = -theirs.lo[d];
            if (theirs.hi[d] == 0) theirs.hi[d] = -theirs.hi[d];
        }
        Bytes bytes;
        put_near(bytes, box, known);
        for (const Aabb<Dim, T>& each : {known, theirs}) {
            Reader from(bytes);
            const Aabb<Dim, T> read = from.box_near(each);
            EXPECT_TRUE(from.empty() && !from.failed());
            for (int d = 0; d < Dim; ++d) {
                EXPECT_EQ(std::bit_cast<Bits>(read.lo[d]), std::bit_cast<Bits>(box.lo[d]));
                EXPECT_EQ(std::bit_cast<Bits>(read.hi[d]), std::bit_cast<Bits>(box.hi[d]));
            }
        }
    }
}
TEST(Bytes, BoxesNearOthers)
{
    check_boxes<3, float>();
    check_boxes<3, double>();
    check_boxes<2, float>();
    check_boxes<2, double>();
}

TEST(Bytes, WhatHasMovedALittleIsShort)
{
    Random random(2);
    std::size_t all = 0, at_rest = 0;
    for (int i = 0; i < 1000; ++i) {
        const auto before = world_tests::random_box<3, float>(random, 50);
        auto now = before;
        for (int d = 0; d < 3; ++d) {
            const auto by = static_cast<float>(random.uniform(-0.05, 0.05));
            now.lo[d] += by;
            now.hi[d] += by;
        }
        Bytes bytes;
        put_near(bytes, now, before);
        all += bytes.size();
        bytes.clear();
        put_near(bytes, before, before);
        at_rest += bytes.size();
    }
    EXPECT_LT(all, 14'000u);
    EXPECT_LT(at_rest, 7'000u);
}

} // namespace
} // namespace mpi_tests
