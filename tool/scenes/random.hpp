// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace jostle_scenes {

/// splitmix64: Steele, Lea, Flood, Fast splittable pseudorandom number generators (2014), fig. 16.
/// Not from <random>: its distributions differ between standard libraries.
class Random
{
  public:
    explicit Random(std::uint64_t seed) noexcept : state_(seed) {}
    /// A stream of its own for each (seed, object, purpose), so that what is drawn for one object doesn't
    /// depend on what was drawn for the others.
    Random(std::uint64_t seed, std::uint64_t object, std::uint64_t purpose) noexcept
        : state_(mix(mix(mix(seed) + object) + purpose))
    {
    }

    std::uint64_t next() noexcept { return mix(state_ += 0x9e3779b97f4a7c15u); }
    /// Uniform in [0, 1), a multiple of 2^-53.
    double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1p-53; }
    double uniform(double lo, double hi) noexcept { return lo + (hi - lo) * uniform(); }
    /// Uniform in [0, count), count < 2^32; uneven by at most 2^-32.
    std::uint32_t below(std::uint32_t count) noexcept
    {
        return static_cast<std::uint32_t>(((next() >> 32) * count) >> 32);
    }
    /// Near enough to a normal distribution (mean 0, deviation 1) and free of library maths: the sum of
    /// twelve uniforms. Never beyond 6.
    double normal() noexcept
    {
        double sum = -6;
        for (int i = 0; i < 12; ++i)
            sum += uniform();
        return sum;
    }

  private:
    static std::uint64_t mix(std::uint64_t z) noexcept
    {
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::uint64_t state_;
};

} // namespace jostle_scenes
