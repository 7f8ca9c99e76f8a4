// SPDX-License-Identifier: MIT
// Mistakes that users make. check_headers.cmake compiles one at a time, and looks in the compiler's message
// for the name that says what is wrong.
#include <jostle/jostle.hpp>

#include <vector>

using namespace jostle;

void make_mistake(const World2f& world, const std::vector<Vec2f>& points, const std::vector<Aabb2f>& boxes,
                  const std::vector<std::uint64_t>& offsets, const std::vector<Shape2>& shapes,
                  const std::vector<Pose2f>& poses, const std::vector<Pair>& pairs)
{
#if MISTAKE == 1 // the visitor returns nothing
    world.visit(Aabb2f(), [](ObjectId) {});
#elif MISTAKE == 2 // the lambda is gone before it is called
    const Filter filter{.accept = [](std::uint32_t a, std::uint32_t b) { return a < b; }};
#elif MISTAKE == 3 // so is the hull
    const Shape2 shape = ConvexHull2(points);
#elif MISTAKE == 4 // the ray has a dimension too many
    (void)world.first(Ray3f());
#elif MISTAKE == 5 // the finder is gone before its result is read
    for (const Pair pair : PairFinder().find(boxes))
        (void)pair;
#elif MISTAKE == 6 // the same of many scenes
    (void)PairFinder().find_scenes(boxes, offsets);
#elif MISTAKE == 7 // and of contacts
    const auto& contacts = ContactFinder2f().find({shapes, poses}, pairs);
#elif MISTAKE == 8
    const auto& contacts = ContactFinder2f().find_points({shapes, poses}, pairs);
#elif MISTAKE == 9 // and of neighbours
    const auto& list = NeighborFinder<2, float>().find(points, 1.0f);
#endif
    (void)world, (void)points, (void)boxes, (void)offsets, (void)shapes, (void)poses, (void)pairs;
}
