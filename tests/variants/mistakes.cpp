// SPDX-License-Identifier: MIT
// Mistakes that users make. check_headers.cmake compiles one at a time, and looks in the compiler's message
// for the name that says what is wrong.
#include <jostle/jostle.hpp>

#include <vector>

using namespace jostle;

void make_mistake(const World2f& world, const std::vector<Vec2f>& points)
{
#if MISTAKE == 1 // the visitor returns nothing
    world.visit(Aabb2f(), [](ObjectId) {});
#elif MISTAKE == 2 // the lambda is gone before it is called
    const Filter filter{.accept = [](std::uint32_t a, std::uint32_t b) { return a < b; }};
#elif MISTAKE == 3 // so is the hull
    const Shape2 shape = ConvexHull2(points);
#elif MISTAKE == 4 // the ray has a dimension too many
    (void)world.first(Ray3f());
#endif
    (void)world, (void)points;
}
