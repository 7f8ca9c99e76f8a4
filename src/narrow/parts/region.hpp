// SPDX-License-Identifier: MIT
// Selects the parts of a shape that come near enough to another shape to be tested.
#pragma once

#include <limits>

#include "narrow/math.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// How near parts must be to be tested: within `reach` of each other at some time while b moves for `time`.
template <int Dim>
struct Range
{
    double reach;
    V<Dim> linear = {};
    double time = 0;
    bool nearest_first = false; ///< the order of a compound's children; otherwise by their numbers
};
/// A box in a shape's local axes around the other shape, and its motion. If it doesn't move, it is also
/// within a ball.
template <int Dim>
struct Region
{
    double lo[Dim], hi[Dim];
    V<Dim> way = {};
    V<Dim> middle = {}; ///< of the ball
    double ball = HUGE_VAL;

    /// The box around its whole path.
    [[nodiscard]] Region swept(double time) const
    {
        Region all = *this;
        for (int d = 0; d < Dim; ++d) {
            all.lo[d] += std::min(0.0, way[d] * time);
            all.hi[d] += std::max(0.0, way[d] * time);
        }
        return all;
    }
    /// Whether a box from lo2 to hi2, `Dim` numbers each, comes within range.
    [[nodiscard]] bool meets(const double* lo2, const double* hi2, const Range<Dim>& range) const
    {
        if (range.time > 0) return meets_on_its_way(lo2, hi2, range);
        int apart = 0; // hard to predict, so no branches
        for (int d = 0; d < Dim; ++d)
            apart |= int{lo2[d] > hi[d] + range.reach} | int{lo[d] > hi2[d] + range.reach};
        return apart == 0;
    }
    /// Whether the ball comes within reach of such a box.
    [[nodiscard]] bool ball_meets(const double* lo2, const double* hi2, double reach) const
    {
        double square = 0;
        for (int d = 0; d < Dim; ++d) {
            const double along = std::max(0.0, std::max(lo2[d] - middle[d], middle[d] - hi2[d]));
            square += along * along;
        }
        return !(square > (ball + reach) * (ball + reach));
    }
    /// The distance of a box; negative if they overlap, by no more than that.
    [[nodiscard]] double gap(const double* lo2, const double* hi2) const
    {
        double most = -HUGE_VAL, square = 0;
        for (int d = 0; d < Dim; ++d) {
            const double along = std::max(lo2[d] - hi[d], lo[d] - hi2[d]);
            most = std::max(most, along);
            if (along > 0) square += along * along;
        }
        return most > 0 ? std::sqrt(square) : most;
    }
    /// Narrows [enter, leave] to the time for which it meets lo2 to hi2 along an axis.
    void clip(int d, double lo2, double hi2, double reach, double& enter, double& leave) const
    {
        const double w = way[d];
        if (w == 0) {
            if (lo2 > hi[d] + reach || lo[d] > hi2 + reach) leave = -HUGE_VAL;
            return;
        }
        const double first = (lo2 - reach - hi[d]) / w, last = (hi2 + reach - lo[d]) / w;
        enter = std::max(enter, w > 0 ? first : last);
        leave = std::min(leave, w > 0 ? last : first);
    }

  private:
    [[nodiscard]] bool meets_on_its_way(const double* lo2, const double* hi2, const Range<Dim>& range) const
    {
        double enter = 0, leave = range.time;
        for (int d = 0; d < Dim; ++d)
            clip(d, lo2[d], hi2[d], range.reach, enter, leave);
        return enter <= leave + 1e-12 * range.time; // rounding
    }
};
/// A ball's radius, and what the tests of parts call a touch: a gap of less than a billionth of their size.
template <class Vector>
double with_rounding(double ball, const Vector& middle)
{
    return ball + 4e-9 * (ball + length(middle));
}
/// As large as possible, but not infinite: a reach may be, and infinity minus infinity is NaN.
template <int Dim>
Region<Dim> everywhere()
{
    constexpr double far = std::numeric_limits<double>::max();
    Region<Dim> region;
    for (int d = 0; d < Dim; ++d)
        region.lo[d] = -far, region.hi[d] = far;
    return region;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
