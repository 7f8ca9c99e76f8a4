// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "target.hpp"
#include "tool/scenes/random.hpp"

namespace fuzz {

/// What a test draws at random, drawn from an input. Where the input ends, random numbers follow, the
/// same ones each time: a short input is a whole scene, and no loop waits for ever for a certain number.
class Choices
{
  public:
    Choices(Input& in) : in_(&in) {} // not explicit: stands where tests give a seed

    std::uint32_t below(std::uint32_t end)
    {
        if (end < 2) return 0;
        return ended() ? after_.below(end) : in_->below(end);
    }
    std::uint64_t next() { return ended() ? after_.next() : in_->number<std::uint64_t>(); }
    /// Uniform in [0, 1), a multiple of 2^-16.
    double uniform() { return (ended() ? after_.below(65536) : in_->number<std::uint16_t>()) * 0x1p-16; }
    double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
    double number(double lo, double hi) { return uniform(lo, hi); }
    bool chance(double p) { return uniform() < p; }
    /// As std::mt19937_64, for what takes that apart itself. Both ends of the number change with the
    /// input.
    std::uint64_t operator()()
    {
        return ended() ? after_.next() : in_->number<std::uint16_t>() * 0x0001000100010001u;
    }

    [[nodiscard]] bool ended() const { return in_->left() == 0; }

  private:
    Input* in_;
    jostle_scenes::Random after_{1};
};

} // namespace fuzz
