// SPDX-License-Identifier: MIT
#include "narrow/parts/cast.hpp"

#include "narrow/parts/each_part.hpp"
#include "narrow/parts/motion.hpp"
#include "narrow/parts/nearest.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// Near a touch the steps converge quadratically; if shapes graze each other each step halves the rest.
constexpr int newton_steps = 100;

/// The first touch, no later than `until`, of b's part `number_b` with one of a's.
template <int Dim>
Touch<Dim> advance(const Placed<Dim>& pair, const V<Dim>& linear, double until, std::uint32_t number_a,
                   const Part<Dim>& a, std::uint32_t number_b)
{
    Touch<Dim> touch;
    V<Dim> normal;
    double time = 0;
    for (int step = 0;; ++step) {
        Gap<Dim> gap;
        with_part(*pair.b, number_b, *pair.kernels, Frame<Dim>{pair.rb, pair.d + linear * time},
                  [&](const Part<Dim>& b) { moving_gap(a, b, HUGE_VAL, gap); });
        if (gap.distance == HUGE_VAL) return touch; // two half-spaces
        const bool apart = gap.distance > 0;
        // If rounding leaves only an overlap, the direction of the gap before it is better.
        if (apart || step == 0) normal = gap.normal;
        double next = time;
        if (apart) {
            const double closing = -dot(linear, normal);
            if (!(closing > 0)) return touch;
            next = time + gap.distance / closing;
            if (!(next <= until)) return touch;
        }
        if (next > time && step < newton_steps) {
            time = next;
            continue;
        }
        touch = {time, normal, gap.on_a, number_a, number_b};
        return touch;
    }
}

} // namespace

template <int Dim>
Touch<Dim> find_first_touch(const Placed<Dim>& pair, const V<Dim>& linear)
{
    double size = length(pair.d) + length(linear);
    for (const Shape<Dim>* shape : {pair.a, pair.b})
        if (const double reach = ShapeAccess::reach(*shape); reach < HUGE_VAL) size += reach;
    Range<Dim> range{1e-14 * size, linear, 1};
    Touch<Dim> first;
    const auto look_at = [&](std::uint32_t number_a, const Part<Dim>& a, std::uint32_t number_b,
                             const Part<Dim>&) {
        if (first.time == 0) return;
        const Touch<Dim> touch = advance(pair, linear, range.time, number_a, a, number_b);
        if (!(touch.time < first.time)) return;
        first = touch;
        range.time = touch.time;
        if (touch.time == 0) range.reach = -HUGE_VAL; // nothing is within that, so the search ends
    };
    if constexpr (Dim == 3)
        if (has_mesh_tree(pair)) {
            Moving<3> moving;
            moving.start = pair;
            moving.linear = linear;
            moving.angular_a = moving.angular_b = {};
            for_each_approaching(pair, Flight<3>(moving, pair, 0), range, look_at);
            return first;
        }
    for_each_part_pair(pair, range, look_at);
    return first;
}
template Touch<2> find_first_touch(const Placed<2>&, const Vec2&);
template Touch<3> find_first_touch(const Placed<3>&, const Vec3&);

} // namespace narrow
JOSTLE_NAMESPACE_END
