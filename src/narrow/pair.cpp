// SPDX-License-Identifier: MIT
#include "narrow/pair.hpp"

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

} // namespace narrow
JOSTLE_NAMESPACE_END
