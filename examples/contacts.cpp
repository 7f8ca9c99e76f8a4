// SPDX-License-Identifier: MIT
// From boxes to pairs to contacts: one frame of a simulation.
#include <jostle/jostle.hpp>

#include <cstdio>
#include <span>
#include <vector>

int main()
{
    const std::vector<jostle::Vec<3, float>> corners = {
        {-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}, {0, 2, 0}};
    const jostle::ConvexHull<3> pyramid(corners);
    const std::vector<jostle::Shape3> shapes = {
        jostle::Shape3::half_space({0, 1, 0}, 0), // the ground: all below y = 0
        jostle::Shape3::box({2, 0.5, 2}),
        jostle::Shape3::sphere(1),
        pyramid,
    };
    const std::vector<jostle::Pose3f> poses = {
        {{0, 0, 0}}, {{0, 0.49f, 0}}, {{5, 0.95f, 0}}, {{0, 0.98f, 0}}}; // the pyramid stands on the box

    // Broad phase: tight boxes, and the pairs that may touch.
    std::vector<jostle::Aabb3f> boxes(shapes.size());
    jostle::bounds({shapes, poses}, boxes);
    jostle::PairFinder pairs;

    // Narrow phase: where they touch. Keep both finders from frame to frame.
    jostle::ContactFinder3f contacts;
    unsigned points = 0;
    for (const auto& contact : contacts.find({shapes, poses}, pairs.find(boxes))) {
        std::printf("%u and %u touch, normal %.2f %.2f %.2f\n", contact.pair.a, contact.pair.b,
                    contact.normal[0], contact.normal[1], contact.normal[2]);
        for (unsigned i = 0; i < contact.count; ++i) {
            const auto& point = contact.point[i];
            const auto& origin = poses[contact.pair.a].position;
            std::printf("  at %.2f %.2f %.2f, %.3f deep\n", origin[0] + point.from_a[0],
                        origin[1] + point.from_a[1], origin[2] + point.from_a[2], point.depth);
        }
        points += contact.count;
    }
    return points == 4 + 1 + 4 ? 0 : 1; // the box on the ground, the sphere, the pyramid on the box
}
