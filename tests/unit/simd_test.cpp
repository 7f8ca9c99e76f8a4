// SPDX-License-Identifier: MIT
// The vocabulary of the kernels says the same on every instruction set as plain C++ does.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/unit/simd_test.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_SIMD_TEST_ONCE
#define JOSTLE_SIMD_TEST_ONCE
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

/// Sixteen numbers each, which every instruction set has room for in one or several vectors, and what comes
/// out.
template <class T>
struct Numbers
{
    alignas(64) T a[16], b[16];
};
template <class T>
struct Said
{
    std::uint32_t size = 0;
    alignas(64) T sum[16], difference[16], product[16], quotient[16], least[16], greatest[16], chosen[16],
        size_of[16], root[16], numbered[16];
    unsigned less = 0, not_greater = 0, greater = 0, not_less = 0, both = 0, either = 0;
    std::vector<bool> any, all;
    std::vector<T> lowest, highest;
};

/// One instruction set's.
struct Words
{
    void (*floats)(const Numbers<float>&, Said<float>&);
    void (*doubles)(const Numbers<double>&, Said<double>&);
    unsigned (*below)(const std::int16_t*, const std::int16_t*);
    void (*fours)(const float* rows, float* sum, float* difference, float* columns);
    InstructionSet set;
};

} // namespace
JOSTLE_NAMESPACE_END
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"

template <class T>
HWY_ATTR void say(const Numbers<T>& numbers, Said<T>& said)
{
    said.size = Vec<T>::size;
    for (std::uint32_t k = 0; k < 16; k += Vec<T>::size) {
        const Vec<T> a = Vec<T>::load(numbers.a + k), b = Vec<T>::loadu(numbers.b + k);
        (a + b).store(said.sum + k);
        (a - b).storeu(said.difference + k);
        (a * b).store(said.product + k);
        (a / b).store(said.quotient + k);
        min(a, b).store(said.least + k);
        max(a, b).store(said.greatest + k);
        choose(a < b, a, Vec<T>(7)).store(said.chosen + k);
        abs(a).store(said.size_of + k);
        sqrt(abs(b)).store(said.root + k);
        Vec<T>::lane_numbers().store(said.numbered + k);
        said.less |= mask_bits(a < b) << k;
        said.not_greater |= mask_bits(a <= b) << k;
        said.greater |= mask_bits(a > b) << k;
        said.not_less |= mask_bits(a >= b) << k;
        said.both |= mask_bits((a < b) & (a < Vec<T>(0))) << k;
        said.either |= mask_bits((a < b) | (a < Vec<T>(0))) << k;
        said.any.push_back(any(a < b));
        said.all.push_back(all(a < b));
        said.lowest.push_back(min_lane(a));
        said.highest.push_back(max_lane(a));
    }
}

/// What integers are used for.
HWY_ATTR unsigned below(const std::int16_t* a, const std::int16_t* b)
{
    unsigned bits = 0;
    for (std::uint32_t k = 0; k < 16; k += Vec<std::int16_t>::size)
        bits |= mask_bits(Vec<std::int16_t>::load(a + k) < Vec<std::int16_t>::load(b + k)) << k;
    return bits;
}

/// Of four rows: the first and the second added and subtracted, and all of them transposed.
HWY_ATTR void fours(const float* rows, float* sum, float* difference, float* columns)
{
    Four m[4] = {Four::loadu(rows), Four::loadu(rows + 4), Four::loadu(rows + 8), Four::loadu(rows + 12)};
    (m[0] + m[1]).storeu(sum);
    (m[0] - m[1]).storeu(difference);
    transpose(m);
    for (int i = 0; i < 4; ++i)
        m[i].storeu(columns + 4 * i);
}

const Words& words()
{
    static constexpr Words table{say<float>, say<double>, below, fours, JOSTLE_SIMD_SET};
    return table;
}
} // namespace HWY_NAMESPACE
} // namespace
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace {

const Words& words_for([[maybe_unused]] InstructionSet set)
{
    JOSTLE_SIMD_RETURN(set, words());
}

template <class T>
void expect_plain_words(void (*say)(const Numbers<T>&, Said<T>&))
{
    Numbers<T> numbers;
    for (int k = 0; k < 16; ++k) {
        numbers.a[k] = T((k * 7) % 11 - 5) / T(3);
        numbers.b[k] = T((k * 5) % 13 - 6) / T(k % 2 == 0 ? 3 : 7) + T(0.125);
    }
    numbers.b[3] = numbers.a[3]; // equal
    numbers.a[9] = std::numeric_limits<T>::infinity();
    Said<T> said;
    say(numbers, said);
    ASSERT_GE(said.size, 1u);
    ASSERT_EQ(16 % said.size, 0u);
    for (std::uint32_t k = 0; k < 16; ++k) {
        SCOPED_TRACE(k);
        const T a = numbers.a[k], b = numbers.b[k];
        EXPECT_EQ(said.sum[k], a + b);
        EXPECT_EQ(said.difference[k], a - b);
        EXPECT_EQ(said.product[k], a * b);
        EXPECT_EQ(said.quotient[k], a / b);
        EXPECT_EQ(said.least[k], std::min(a, b));
        EXPECT_EQ(said.greatest[k], std::max(a, b));
        EXPECT_EQ(said.chosen[k], a < b ? a : T(7));
        EXPECT_EQ(said.size_of[k], std::abs(a));
        EXPECT_EQ(said.root[k], std::sqrt(std::abs(b)));
        EXPECT_EQ(said.numbered[k], T(k % said.size));
        EXPECT_EQ((said.less >> k) & 1, unsigned{a < b});
        EXPECT_EQ((said.not_greater >> k) & 1, unsigned{a <= b});
        EXPECT_EQ((said.greater >> k) & 1, unsigned{a > b});
        EXPECT_EQ((said.not_less >> k) & 1, unsigned{a >= b});
        EXPECT_EQ((said.both >> k) & 1, unsigned{a < b && a < 0});
        EXPECT_EQ((said.either >> k) & 1, unsigned{a < b || a < 0});
    }
    for (std::uint32_t v = 0; v < 16 / said.size; ++v) {
        const T *first = numbers.a + v * said.size, *last = first + said.size;
        const unsigned less = (said.less >> v * said.size) & ((1u << said.size) - 1);
        EXPECT_EQ(said.any[v], less != 0);
        EXPECT_EQ(said.all[v], less == (1u << said.size) - 1);
        EXPECT_EQ(said.lowest[v], *std::min_element(first, last));
        EXPECT_EQ(said.highest[v], *std::max_element(first, last));
    }
}

TEST(Simd, SaysTheSameOnEveryInstructionSet)
{
    for (const InstructionSet set : supported_instruction_sets()) {
        SCOPED_TRACE(name(set));
        const Words& words = words_for(set);
        EXPECT_EQ(words.set, set);
        expect_plain_words(words.floats);
        expect_plain_words(words.doubles);
        alignas(64) std::int16_t a[16], b[16];
        unsigned expected = 0;
        for (int k = 0; k < 16; ++k) {
            a[k] = static_cast<std::int16_t>(k * 4099 - 30000);
            b[k] = static_cast<std::int16_t>(k % 3 == 0 ? a[k] : k % 3 == 1 ? a[k] + 1 : a[k] - 1);
            expected |= unsigned{a[k] < b[k]} << k;
        }
        EXPECT_EQ(words.below(a, b), expected);
        float rows[16], sum[4], difference[4], columns[16];
        for (int k = 0; k < 16; ++k)
            rows[k] = static_cast<float>(k * k + 1) / 7;
        words.fours(rows, sum, difference, columns);
        for (int i = 0; i < 4; ++i) {
            EXPECT_EQ(sum[i], rows[i] + rows[4 + i]);
            EXPECT_EQ(difference[i], rows[i] - rows[4 + i]);
            for (int j = 0; j < 4; ++j)
                EXPECT_EQ(columns[4 * j + i], rows[4 * i + j]);
        }
    }
}

} // namespace
JOSTLE_NAMESPACE_END
#endif
