// SPDX-License-Identifier: MIT
// Templates of the public headers, put to use: check_headers.cmake looks at their warnings. Never run.
#include <vector>

#include "jostle/chapter.hpp"
#include "jostle/jostle.hpp"

template struct jostle::Aabb<2, double>;
template class jostle::BoxView<3, float>;
template class jostle::StridedView<std::uint32_t>;
template class jostle::BlockBuffer<jostle::Contact<3, float>>;
template class jostle::Responses<double>;
template class jostle::chapter::DenseResponses<double>;
template class jostle::chapter::SparseResponses<double>;

std::uint64_t use_headers(const std::vector<jostle::Aabb3f>& boxes);

std::uint64_t use_headers(const std::vector<jostle::Aabb3f>& boxes)
{
    jostle::PairFinder finder;
    const jostle::PairBuffer& pairs = finder.find(boxes);
    const auto none = [](const jostle::PairChunk&) { return true; };
    finder.stream(boxes, none);
    jostle::PairFinder().stream(boxes, boxes, none);
    std::uint64_t sum = jostle::find_pairs(boxes, boxes).size() + finder.take(boxes).to_vector().size();
    for (const jostle::Pair& pair : pairs)
        sum += pair.a;

    jostle::process_pairs(pairs, [](const jostle::PairBatch&) {});
    jostle::process_pairs(pairs, [](const jostle::Pair&, jostle::Work) {});
    jostle::process_items(10, [](std::uint64_t, std::uint64_t, jostle::Work) {});
    jostle::Responses<float> responses;
    responses.merge([](std::uint32_t, std::span<const float>) {});

    const jostle::Ray<3, float> ray{{0, 0, 0}, {1, 0, 0}};
    const jostle::Sphere<3, float> sphere{{0, 0, 0}, 1};
    const jostle::Plane<3, float> plane{{0, 1, 0}, 0};
    const jostle::Frustum<3, float> frustum{{&plane, 1}};
    for (const jostle::Aabb3f& box : boxes)
        sum += (jostle::hit_fraction(ray, box) ? 1u : 0u) + (jostle::overlaps(sphere, box) ? 1u : 0u) +
               (jostle::overlaps(frustum, box) ? 1u : 0u) + (jostle::overlaps(box, box) ? 1u : 0u);

    jostle::World<3, float> world;
    jostle::BoxIndex<3, float> index;
    jostle::ContactFinder3f contacts;
    const std::vector<jostle::Shape3> shapes;
    const std::vector<jostle::Pose3f> poses;
    // Queries in braces, with filters in braces, and of shapes.
    const jostle::Vec3f eye{};
    sum += index.first({eye, eye}) && world.first({eye, eye}, {.mask = 1}) && index.nearest({eye}) &&
           world.any({eye, eye}) && world.first({eye, eye}, {shapes, poses}, {.mask = 1});
    world.visit(ray, {shapes, poses}, [](const auto& hit, float&) { return hit.part == 0; });
    jostle::process_contacts(contacts.find({shapes, poses}, pairs), [](const jostle::Contact<3, float>&) {});
    return sum;
}
