// SPDX-License-Identifier: MIT
// Compiled once per instruction set: see simd/targets.hpp.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/kernels/few.cpp"
#include "simd/targets.hpp"

#ifndef JOSTLE_FEW_ONCE
#define JOSTLE_FEW_ONCE
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/box.hpp"
#include "engine/kernels/few.hpp"
#endif

HWY_BEFORE_NAMESPACE();
JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {
namespace HWY_NAMESPACE {
#include "simd/vec-inl.hpp"

/// Pads the columns to whole vectors with boxes that touch nothing. Returns false if a box is NaN or
/// inverted.
template <int Dim, class T>
HWY_ATTR bool pad_and_check(Unit<T>& unit)
{
    const std::uint32_t count = unit.count;
    if (count == 0) return true;
    const std::uint32_t whole = (count + Vec<T>::size - 1) / Vec<T>::size * Vec<T>::size;
    for (int d = 0; d < Dim; ++d) { // first with copies of the last box, which are valid if it is
        std::fill(unit.lo[d] + count, unit.lo[d] + whole, unit.lo[d][count - 1]);
        std::fill(unit.hi[d] + count, unit.hi[d] + whole, unit.hi[d][count - 1]);
    }
    Mask<T> good = Vec<T>::load(unit.lo[0]) <= Vec<T>::load(unit.hi[0]);
    for (int d = 0; d < Dim; ++d)
        for (std::uint32_t j = 0; j < whole; j += Vec<T>::size)
            good = good & (Vec<T>::load(unit.lo[d] + j) <= Vec<T>::load(unit.hi[d] + j));
    std::fill(unit.lo[0] + count, unit.lo[0] + whole, std::numeric_limits<T>::quiet_NaN());
    return all(good);
}

/// Writes the pairs of row a with the boxes first + k whose bits k are set. Most rows have up to four in 64
/// boxes: four are always written, without a branch.
inline Pair* write_pairs(std::uint32_t a, std::uint32_t first, std::uint64_t bits, Pair* out)
{
    Pair* const end = out + std::popcount(bits);
    do {
        for (int k = 0; k < 4; ++k) {
            *out++ = {a, first + static_cast<std::uint32_t>(std::countr_zero(bits))};
            bits &= bits - 1;
        }
    } while (out < end);
    return end;
}

template <int Dim, class T>
HWY_ATTR Pair* among_few(const BoxView<Dim, T>& rows, Unit<T>& unit, bool cross, Pair* out)
{
    constexpr std::uint32_t lanes = Vec<T>::size;
    if (!pad_and_check<Dim>(unit)) return nullptr;
    const auto row_count = static_cast<std::uint32_t>(rows.size());
    for (std::uint32_t a = 0; a < row_count; ++a) {
        const Aabb<Dim, T> row = rows[a];
        if (cross && !valid(row)) return nullptr; // otherwise the columns contain it
        Vec<T> lo[Dim], hi[Dim];
        for (int d = 0; d < Dim; ++d) {
            lo[d] = Vec<T>(row.lo[static_cast<std::size_t>(d)]);
            hi[d] = Vec<T>(row.hi[static_cast<std::size_t>(d)]);
        }
        const std::uint32_t first = cross ? 0 : a + 1;
        std::uint64_t wanted = ~std::uint64_t{0} << first % 64;
        for (std::uint32_t word = first / 64 * 64; word < unit.count; word += 64) {
            std::uint64_t bits = 0;
            const std::uint32_t end = std::min(word + 64, unit.count);
            for (std::uint32_t j = std::max(word, first / lanes * lanes); j < end; j += lanes) {
                Mask<T> touches =
                    (lo[0] <= Vec<T>::load(unit.hi[0] + j)) & (Vec<T>::load(unit.lo[0] + j) <= hi[0]);
                for (int d = 1; d < Dim; ++d)
                    touches = touches & (lo[d] <= Vec<T>::load(unit.hi[d] + j)) &
                              (Vec<T>::load(unit.lo[d] + j) <= hi[d]);
                bits |= std::uint64_t{mask_bits(touches)} << (j - word);
            }
            out = write_pairs(a, word, bits & wanted, out);
            wanted = ~std::uint64_t{0};
        }
    }
    return out;
}

template <int Dim, class T>
FindAmongFew<Dim, T> find_among_few()
{
    return among_few<Dim, T>;
}
} // namespace HWY_NAMESPACE
} // namespace
} // namespace engine
JOSTLE_NAMESPACE_END
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
JOSTLE_NAMESPACE_BEGIN
namespace engine {

template <int Dim, class T>
FindAmongFew<Dim, T> find_among_few_with([[maybe_unused]] InstructionSet set) noexcept
{
    JOSTLE_SIMD_RETURN(set, find_among_few<Dim, T>());
}

template FindAmongFew<2, float> find_among_few_with<2, float>(InstructionSet) noexcept;
template FindAmongFew<2, double> find_among_few_with<2, double>(InstructionSet) noexcept;
template FindAmongFew<3, float> find_among_few_with<3, float>(InstructionSet) noexcept;
template FindAmongFew<3, double> find_among_few_with<3, double>(InstructionSet) noexcept;

} // namespace engine
JOSTLE_NAMESPACE_END
#endif
