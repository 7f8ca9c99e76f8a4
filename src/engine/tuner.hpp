// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/record.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// A few of the boxes that a grid is to be chosen for, as doubles on the user's axes.
struct Sample
{
    static constexpr std::size_t capacity = 2048;
    static constexpr double unbounded =
        1e300; // bounds are cut there, so that sums and differences stay finite
    std::size_t size = 0;
    double lo[3][capacity], hi[3][capacity];
    double work[capacity];

    void add(int axis, double low, double high) noexcept
    {
        lo[axis][size] = low < -unbounded ? -unbounded : low;
        hi[axis][size] = high > unbounded ? unbounded : high;
        if (hi[axis][size] < -unbounded) hi[axis][size] = -unbounded;
        if (lo[axis][size] > unbounded) lo[axis][size] = unbounded;
    }
};

/// How many boxes to look at: enough to know the densities, few enough to cost little beside a frame.
inline constexpr std::size_t sample_size(std::size_t boxes)
{
    const std::size_t wanted = boxes / 64 + 64;
    return wanted < boxes ? (wanted < Sample::capacity ? wanted : Sample::capacity)
                          : (boxes < 128 ? boxes : 128);
}

/// Which boxes to take as samples: one of each `samples`-th of all of them, picked by a hash, so that no
/// regular pattern in the user's array, such as every tenth box being a big one, stays hidden or counts too
/// often.
inline void choose_sample(std::uint32_t* chosen, std::size_t samples, std::size_t boxes)
{
    if (samples == 0) return;
    const auto step = static_cast<std::uint32_t>(boxes / samples),
               rest = static_cast<std::uint32_t>(boxes % samples);
    std::uint32_t begin = 0, excess = 0; // of the `samples`-ths of a box
    for (std::size_t k = 0; k < samples; ++k) {
        std::uint32_t size = step;
        if ((excess += rest) >= samples) {
            excess -= static_cast<std::uint32_t>(samples);
            ++size;
        }
        const std::uint64_t hash = (k + 1) * 0x9e3779b97f4a7c15u;
        chosen[k] = begin + static_cast<std::uint32_t>((hash >> 32) * size >> 32);
        begin += size;
    }
}

/// A grid and what the cost model expects of it, in model nanoseconds per box.
template <class T>
struct TunedGrid
{
    Grid<T> grid;
    double cost = 0;
};

/// Chooses a grid for `boxes` boxes of which `sample` was drawn. Deterministic: no library function whose
/// result may differ between machines.
template <int Dim, class T>
TunedGrid<T> tune(Sample& sample, std::size_t boxes);

/// The model cost per box of sweeping one brick whose rows have windows of `blocks` blocks each on average.
double sweep_cost(double blocks) noexcept;

} // namespace engine
JOSTLE_NAMESPACE_END
