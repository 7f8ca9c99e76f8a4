// SPDX-License-Identifier: MIT
#include "narrow/parts/motion.hpp"

#include "narrow/parts/each_part.hpp"
#include "narrow/parts/nearest.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// The state of a moving pair, and what is known about its future.
template <int Dim>
struct Outlook
{
    Gap<Dim> gap;           ///< the least of parts that may come within the tolerance; infinite if none may
    double safe = HUGE_VAL; ///< the time for which nothing comes nearer than half the tolerance
};

// The fastest points are mostly not the nearest ones, so most of what may happen until a horizon this many
// times further ahead than the known safe time is safe. Looking ahead that far pays once this many steps
// weren't enough.
constexpr double further_ahead = 16;
constexpr int gentle_steps = 16;

/// The time for which two parts certainly stay further apart than half the tolerance. It tries to extend what
/// is known at once, up to `until`.
template <int Dim>
double safe_time(const Flight<Dim>& flight, const Part<Dim>& a, const Part<Dim>& b, const Gap<Dim>& gap,
                 double until)
{
    const auto along = [&](const V<Dim>& n) {
        double safe = flight.safe_time(spread_of(a, b, flight.a, n, 0), spread_of(b, a, flight.b, -n, 0), n);
        while (safe > 0 && safe < until) {
            const double horizon = std::min(further_ahead * safe, until);
            const double longer = flight.safe_time(spread_of(a, b, flight.a, n, horizon),
                                                   spread_of(b, a, flight.b, -n, horizon), n, horizon);
            if (!(longer > 2 * safe)) return std::max(safe, longer);
            safe = longer;
        }
        return safe;
    };
    double time = along(gap.normal);
    // A part that slides along an element of a surface may come nearer to its end, but not to its plane.
    for (const Part<Dim>* part : {&a, &b})
        if (part->surface != Surface::none && !a.half_space && !b.half_space && time < 1)
            time = std::max(time, along(part->normal * (dot(part->normal, gap.normal) > 0 ? 1.0 : -1.0)));
    return time;
}

/// Many parts of two distant meshes are safe for nearly equally long. A step may be a bit shorter than
/// possible, so parts that are safe for this share of the best time so far aren't tested.
constexpr double share = 0.75;

/// `now` is the present pair, after this many steps. Looks ahead for `time`.
template <int Dim>
Outlook<Dim> look_ahead(const Moving<Dim>& pair, const Placed<Dim>& now, double tolerance, double time,
                        int step)
{
    const Flight<Dim> flight(pair, now, tolerance);
    const bool looks_further = step >= gentle_steps && (flight.a.speed > 0 || flight.b.speed > 0);
    const bool by_tree = has_mesh_tree(now);
    Outlook<Dim> outlook;
    outlook.gap.distance = HUGE_VAL;
    const double sliding = length(flight.linear), rounding = 1e-14 * length(now.d);
    Range<Dim> range{0, flight.linear, 0};
    const auto shorten = [&](double to) {
        range.time = to;
        range.reach = flight.tolerance + flight.turn(to) + rounding;
    };
    shorten(time);
    const auto look_at = [&](std::uint32_t, const Part<Dim>& a, std::uint32_t, const Part<Dim>& b) {
        const double enough = range.reach + sliding * range.time;
        Gap<Dim> gap;
        moving_gap(a, b, enough, gap);
        if (!(gap.distance <= enough)) return; // not within that time
        if (gap.distance < outlook.gap.distance) outlook.gap = gap;
        const double safe = gap.distance <= flight.tolerance
                                ? 0
                                : safe_time(flight, a, b, gap, looks_further ? range.time : 0);
        outlook.safe = std::min(outlook.safe, by_tree ? share * safe : safe);
        if (outlook.safe < range.time) shorten(outlook.safe);
    };
    if constexpr (Dim == 3)
        if (by_tree) {
            for_each_approaching(now, flight, range, look_at);
            return outlook;
        }
    for_each_part_pair(now, range, look_at);
    return outlook;
}

} // namespace

template <int Dim>
Hit<Dim> find_impact(const Moving<Dim>& pair, double tolerance)
{
    Hit<Dim> hit;
    double time = 0, look = 1;
    for (int step = 0;; ++step) {
        Placed<Dim> now = pair.start;
        now.d = pair.start.d + pair.linear * time;
        now.ra = turned(pair.start.ra, pair.angular_a * time);
        now.rb = turned(pair.start.rb, pair.angular_b * time);
        const bool last = step == impact_steps;
        look = last ? 1 - time : std::min(look, 1 - time);
        const Outlook<Dim> outlook = look_ahead(pair, now, tolerance, look, step);
        // If rounding leaves no certain separation, they can't be advanced any further.
        const bool near = outlook.gap.distance <= tolerance || outlook.safe <= 0;
        if (near || (last && outlook.safe < 1 - time)) {
            hit.time = time;
            hit.d = now.d;
            hit.gap = outlook.gap;
            if constexpr (Dim == 3) // whose search ends with any that are near enough
                if (has_mesh_tree(now)) {
                    find_gap(now, std::max(0.0, outlook.gap.distance), hit.gap);
                    if (hit.gap.distance == HUGE_VAL) hit.gap = outlook.gap;
                }
            return hit;
        }
        if (last || time >= 1 || (outlook.safe == HUGE_VAL && look >= 1 - time)) break;
        // A pair far from everything looks far ahead, and a near one only at what is near.
        const double safe = std::min(outlook.safe, look), next = time + safe;
        look = 2 * safe;
        time = next >= 1 ? 1 : next > time ? next : std::nextafter(time, 2.0);
    }
    hit.time = HUGE_VAL;
    return hit;
}
template Hit<2> find_impact(const Moving<2>&, double);
template Hit<3> find_impact(const Moving<3>&, double);

} // namespace narrow
JOSTLE_NAMESPACE_END
