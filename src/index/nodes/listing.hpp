// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>

#include "index/nodes/groups.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Measures coordinates in whole numbers along a box, -1 before it and `last` + 1 after it. A greater
/// coordinate never has a smaller measure: unless two measures are equal, they compare like the coordinates.
template <int Dim, class T>
class Ruler
{
  public:
    using Measure = std::int16_t;
    static constexpr Measure last = 32000;

    explicit Ruler(const Aabb<Dim, T>& box) noexcept : box_(box)
    {
        for (int d = 0; d < Dim; ++d) {
            factor_[d] = T(last) / (box.hi[d] - box.lo[d]);
            if (!(factor_[d] <= std::numeric_limits<T>::max())) factor_[d] = 0;
        }
    }
    [[nodiscard]] Measure measure(int d, T x) const noexcept
    {
        const T at = (x - box_.lo[d]) * factor_[d]; // NaN for some infinities, which are then all equal
        const auto within = static_cast<Measure>(at > 0 ? (at < T(last) ? at : T(last)) : T(0));
        return x < box_.lo[d] ? Measure(-1) : x > box_.hi[d] ? Measure(last + 1) : within;
    }

  private:
    Aabb<Dim, T> box_;
    T factor_[Dim];
};

/// Up to 16 objects and their measures by one ruler. Reading many of them takes half the memory traffic of
/// reading leaves. An empty lane touches nothing.
template <int Dim>
struct alignas(64) Listing
{
    std::int16_t lo[Dim][lanes];
    std::int16_t hi[Dim][lanes];
    std::uint32_t id[lanes];

    void clear(std::uint32_t lane) noexcept
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d][lane] = std::numeric_limits<std::int16_t>::max();
            hi[d][lane] = std::numeric_limits<std::int16_t>::min();
        }
        id[lane] = no_id;
    }
    template <class T>
    void set(std::uint32_t lane, const Ruler<Dim, T>& ruler, const Aabb<Dim, T>& box,
             std::uint32_t object) noexcept
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d][lane] = ruler.measure(d, box.lo[d]);
            hi[d][lane] = ruler.measure(d, box.hi[d]);
        }
        id[lane] = object;
    }
};

/// A box inside its ruler's, and the listings around it, one after another.
template <int Dim>
struct Lookup
{
    const Listing<Dim>* listings;
    std::uint32_t count;
    std::uint32_t asker;
    std::int16_t lo[Dim], hi[Dim];
};

} // namespace index
JOSTLE_NAMESPACE_END
