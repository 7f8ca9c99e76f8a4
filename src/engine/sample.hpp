// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "engine/record.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// A few of the boxes for which a grid is to be chosen, as doubles on the user's axes.
struct Sample
{
    static constexpr std::size_t capacity = 2048;
    /// Bounds are clamped to this, so that sums and differences stay finite.
    static constexpr double unbounded = 1e300;
    std::size_t size = 0;
    double lo[3][capacity], hi[3][capacity];
    double work[capacity]; // of the tuner

    /// Sets one axis of the box that is added next.
    void add(int axis, double low, double high) noexcept
    {
        lo[axis][size] = std::clamp(low, -unbounded, unbounded);
        hi[axis][size] = std::clamp(high, -unbounded, unbounded);
    }
};

/// Draws a sample of the boxes of a call. Boxes that are NaN or inverted are skipped; the scatter reports
/// them.
template <int Dim, class T>
void sample_boxes(const Boxes<Dim, T>& boxes, Sample& sample);

/// Draws a sample of the boxes of records.
template <int Dim, class T>
void sample_records(const Boxes<Dim, T>& boxes, const Record* records, std::uint32_t count, Sample& sample);

} // namespace engine
JOSTLE_NAMESPACE_END
