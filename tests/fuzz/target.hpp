// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "jostle/box.hpp"

/// What all targets share: a reader that makes structured input of bytes, a way to tell what an input stands
/// for, and counts of what was compared.
namespace fuzz {

class Input;

/// One thing to fuzz. `JOSTLE_FUZZ_TARGET(name) { ... }` defines it: the block gets `in`.
struct Target
{
    const char* name;
    void (*run)(Input& in);
};
/// The targets of this program: libFuzzer drives the first.
std::vector<Target>& targets();
struct Registration
{
    Registration(const char* name, void (*run)(Input&)) { targets().push_back({name, run}); }
};
#define JOSTLE_FUZZ_TARGET(name)                                                                             \
    static void run_##name(fuzz::Input& in);                                                                 \
    static const fuzz::Registration registration_##name(#name, run_##name);                                  \
    static void run_##name(fuzz::Input& in)

/// Runs a target on an input and counts that. Whatever leaves the target is a finding.
void execute(const Target& target, std::span<const std::uint8_t> bytes);

/// Says that the library's answer about so many boxes was compared with another one.
void count_boxes(std::uint64_t boxes);

/// Tells the whole input as a piece of C++, then what was found, and aborts.
[[noreturn]] void fail(const std::string& what);
inline void demand(bool good, const char* what)
{
    if (!good) fail(what);
}

/// Whether the input is being told: after a finding, or because JOSTLE_FUZZ_TELL is set in the environment,
/// for inputs that crash.
bool telling();
/// Prints a line of the piece of C++ that the input stands for. Build its text only if telling().
void tell(const std::string& line);

/// A number as C++ reads it back, to the last bit but for the payload of NaN.
template <class T>
std::string text(T number)
{
    constexpr bool is_float = std::is_same_v<T, float>;
    const std::string limits = is_float ? "std::numeric_limits<float>::" : "std::numeric_limits<double>::";
    if (std::isnan(number)) return limits + "quiet_NaN()";
    if (std::isinf(number)) return (number < 0 ? "-" : "") + limits + "infinity()";
    char hex[40];
    std::snprintf(hex, sizeof hex, "%a%s", static_cast<double>(number), is_float ? "f" : "");
    return hex;
}
template <int Dim, class T>
std::string text(const jostle::Vec<Dim, T>& numbers)
{
    std::string all = "{";
    for (const T number : numbers)
        all += (all.size() == 1 ? "" : ", ") + text(number);
    return all + "}";
}
template <int Dim, class T>
std::string text(const jostle::Aabb<Dim, T>& box)
{
    return "{" + text(box.lo) + ", " + text(box.hi) + "}";
}

/// Structured input from bytes. When they run out, all that is read is 0.
class Input
{
  public:
    explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes.data(), bytes.size()) {}

    [[nodiscard]] std::size_t left() { return bytes_.remaining_bytes(); }
    template <class N>
    N number()
    {
        return bytes_.ConsumeIntegral<N>();
    }
    /// Less than `end`.
    std::uint32_t below(std::uint32_t end)
    {
        return bytes_.ConsumeIntegralInRange<std::uint32_t>(0, end - 1);
    }
    bool one_in(std::uint32_t n) { return below(n) == n - 1; } // not of what has run out
    std::vector<std::uint8_t> some(std::size_t most) { return bytes_.ConsumeBytes<std::uint8_t>(most); }
    std::vector<std::uint8_t> rest() { return bytes_.ConsumeRemainingBytes<std::uint8_t>(); }

    /// Any number at all, often one that was read before, or its neighbour, or one that is hard to get right.
    template <class T>
    T coordinate()
    {
        using Limits = std::numeric_limits<T>;
        using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
        const auto earlier = [this] {
            return earlier_.empty()
                       ? T(1)
                       : static_cast<T>(earlier_[below(static_cast<std::uint32_t>(earlier_.size()))]);
        };
        const auto small = [this] { return static_cast<T>(number<std::int8_t>()); };
        T value{};
        switch (below(16)) {
        default:
            value = small();
            break;
        case 5:
            value = small() / 4;
            break;
        case 6:
            value = static_cast<T>(number<std::int32_t>()) / T(65536);
            break;
        case 7:
            value = earlier();
            break;
        case 8:
            value = std::nextafter(earlier(), number<bool>() ? Limits::infinity() : -Limits::infinity());
            break;
        case 9:
            value = T(1e9) + small();
            break;
        case 10:
            value = small() * Limits::denorm_min();
            break;
        case 11:
            value = std::ldexp(small(), number<std::int16_t>() % Limits::max_exponent);
            break;
        case 12:
            value = number<bool>() ? Limits::infinity() : -Limits::infinity();
            break;
        case 13:
            value = number<bool>() ? Limits::max() : Limits::lowest();
            break;
        case 14:
            value = small() * Limits::min();
            break;
        case 15:
            value = std::bit_cast<T>(number<Bits>());
            break;
        }
        if (earlier_.size() < 64) earlier_.push_back(static_cast<double>(value));
        return value;
    }
    template <class T>
    T finite()
    {
        const T value = coordinate<T>();
        return std::isfinite(value) ? value : T(0);
    }
    /// A valid box, or, if `bad`, also one with NaN or upside down.
    template <int Dim, class T>
    jostle::Aabb<Dim, T> box(bool bad = false)
    {
        jostle::Aabb<Dim, T> box;
        const std::uint32_t kind = below(8);
        for (int d = 0; d < Dim; ++d) {
            T lo = coordinate<T>(), hi = lo;
            if (kind < 4) hi = lo + static_cast<T>(number<std::uint8_t>()) / 4;
            if (kind >= 5) hi = coordinate<T>();
            if (!bad) {
                if (std::isnan(lo)) lo = 0;
                if (std::isnan(hi)) hi = lo;
                if (lo > hi) std::swap(lo, hi);
            }
            box.lo[d] = lo;
            box.hi[d] = hi;
        }
        return box;
    }

  private:
    FuzzedDataProvider bytes_;
    std::vector<double> earlier_;
};

/// Calls run.template operator()<Dim, T>() for the dimension and type that the first byte asks for.
template <class Run>
void with_kind(Input& in, const Run& run)
{
    switch (in.below(4)) {
    case 0:
        return run.template operator()<3, float>();
    case 1:
        return run.template operator()<2, float>();
    case 2:
        return run.template operator()<3, double>();
    default:
        return run.template operator()<2, double>();
    }
}

} // namespace fuzz
