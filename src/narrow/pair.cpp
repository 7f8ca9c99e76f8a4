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

namespace {

double size_of(const Vec3& angular)
{
    return length(angular);
}
double size_of(double angular)
{
    return std::abs(angular);
}
template <int Dim>
bool one_piece(const Shape<Dim>& shape)
{
    return shape.type() < ShapeTypes::mesh || shape.type() > ShapeTypes::compound;
}
/// How fast turning can move a shape's surface. A half-space can't turn: its far points would be infinitely
/// fast.
template <int Dim>
double rim_speed(const Shape<Dim>& shape, double turning)
{
    // A ball turns without moving its surface.
    return shape.type() == ShapeTypes::sphere || turning == 0 ? 0 : turning * ShapeAccess::reach(shape);
}

} // namespace

template <int Dim>
Hit<Dim> find_impact(const Moving<Dim>& pair, double tolerance)
{
    const double turning =
        rim_speed(*pair.start.a, size_of(pair.angular_a)) + rim_speed(*pair.start.b, size_of(pair.angular_b));
    const double sliding = length(pair.linear);
    const bool one = one_piece(*pair.start.a) && one_piece(*pair.start.b);
    Hit<Dim> hit;
    double time = 0;
    for (;;) {
        Placed<Dim> now = pair.start;
        now.d = pair.start.d + pair.linear * time;
        now.ra = turned(pair.start.ra, pair.angular_a * time);
        now.rb = turned(pair.start.rb, pair.angular_b * time);
        const double fastest = sliding + turning;
        find_gap(now, fastest * (1 - time) + tolerance, hit.gap);
        if (hit.gap.distance <= tolerance) {
            hit.time = time;
            hit.d = now.d;
            return hit;
        }
        // Along the normal of two convex shapes nothing comes nearer faster than this.
        const double closing = one ? std::max(0.0, -dot(pair.linear, hit.gap.normal)) + turning : fastest;
        const double step = (hit.gap.distance - 0.5 * tolerance) / closing;
        if (hit.gap.distance == HUGE_VAL || time >= 1 || !(step <= 1e300)) break;
        // The last look is at the end itself. A step that is lost in rounding is as small as time can be.
        const double next = time + step;
        time = next > 1 ? 1 : next > time ? next : std::nextafter(time, 2.0);
    }
    hit.time = HUGE_VAL;
    return hit;
}
template Hit<2> find_impact(const Moving<2>&, double);
template Hit<3> find_impact(const Moving<3>&, double);

} // namespace narrow
JOSTLE_NAMESPACE_END
