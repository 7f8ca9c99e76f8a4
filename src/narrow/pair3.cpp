// SPDX-License-Identifier: MIT
#include "narrow/pair.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

bool is_convex(const Shape<3>& shape)
{
    return shape.type() <= ShapeTypes::convex || shape.custom() != nullptr;
}

} // namespace

template <>
void find_contacts(const Placed<3>& pair, double margin, FoundList<3>& found)
{
    if (!within_reach(pair, margin)) return;
    const ShapeType type_b = pair.b->type();
    if (is_convex(*pair.a)) {
        Core3 a;
        a.set(*pair.a, {pair.ra, {}});
        Found<3> one;
        if (type_b == ShapeTypes::half_space) {
            const Vec3 normal = pair.rb * load(pair.b->size());
            if (half_space_contact(a, normal, pair.b->offset() + dot(normal, pair.d), margin, one.manifold))
                found.push_back(one);
        } else if (is_convex(*pair.b)) {
            Core3 b;
            b.set(*pair.b, {pair.rb, pair.d});
            if (convex_contact(a, b, margin, one.manifold)) found.push_back(one);
        }
    }
}

template <>
void find_gap(const Placed<3>& pair, double enough, Gap<3>& gap)
{
    gap.distance = HUGE_VAL;
    const ShapeType type_b = pair.b->type();
    if (is_convex(*pair.a)) {
        Core3 a;
        a.set(*pair.a, {pair.ra, {}});
        if (type_b == ShapeTypes::half_space) {
            const Vec3 normal = pair.rb * load(pair.b->size());
            half_space_gap(a, normal, pair.b->offset() + dot(normal, pair.d), gap);
        } else if (is_convex(*pair.b)) {
            Core3 b;
            b.set(*pair.b, {pair.rb, pair.d});
            convex_gap(a, b, enough, gap);
        }
    }
    if (gap.distance > enough) gap.distance = HUGE_VAL;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
