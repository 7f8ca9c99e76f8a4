// SPDX-License-Identifier: MIT
#include "narrow/pair.hpp"

#include "narrow/motion.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

int compare(double a, double b)
{
    return a < b ? -1 : a > b ? 1 : 0;
}
int compare(const Vec3& a, const Vec3& b)
{
    const int x = compare(a.x, b.x), y = compare(a.y, b.y);
    return x != 0 ? x : y != 0 ? y : compare(a.z, b.z);
}
int compare(const Vec2& a, const Vec2& b)
{
    const int x = compare(a.x, b.x);
    return x != 0 ? x : compare(a.y, b.y);
}
int compare(const Mat3& a, const Mat3& b)
{
    const int x = compare(a.x, b.x), y = compare(a.y, b.y);
    return x != 0 ? x : y != 0 ? y : compare(a.z, b.z);
}
int compare(const Mat2& a, const Mat2& b)
{
    return compare(Vec2{a.c, a.s}, Vec2{b.c, b.s});
}

template <int Dim>
int compare(const Shape<Dim>& a, const Shape<Dim>& b)
{
    if (const int c = compare(ShapeAccess::reach(a), ShapeAccess::reach(b)); c != 0) return c;
    if (const int c = compare(ShapeAccess::radius(a), ShapeAccess::radius(b)); c != 0) return c;
    return compare(load(ShapeAccess::size(a)), load(ShapeAccess::size(b)));
}

} // namespace

template <int Dim>
bool arrange(Placed<Dim>& pair)
{
    bool swap = pair.a->type() > pair.b->type();
    if (pair.a->type() == pair.b->type()) {
        int order = compare(V<Dim>{}, pair.d);
        if (order == 0) order = compare(pair.ra, pair.rb);
        if (order == 0) order = compare(*pair.a, *pair.b);
        swap = order > 0;
    }
    if (swap) {
        std::swap(pair.a, pair.b);
        std::swap(pair.ra, pair.rb);
        pair.d = -pair.d;
    }
    return swap;
}
template bool arrange(Placed<2>&);
template bool arrange(Placed<3>&);

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
        const Outlook<Dim> outlook = look_ahead(pair, now, tolerance, look);
        // Where rounding leaves nothing that parts them for certain, they can't be taken any further.
        const bool near = outlook.gap.distance <= tolerance || outlook.safe <= 0;
        if (near || (last && outlook.safe < 1 - time)) {
            hit.time = time;
            hit.d = now.d;
            hit.gap = outlook.gap;
            return hit;
        }
        if (last || time >= 1 || (outlook.safe == HUGE_VAL && look >= 1 - time)) break;
        // Who is far from everything looks far ahead, who is near only at what is near.
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
