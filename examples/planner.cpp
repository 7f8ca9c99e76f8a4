// SPDX-License-Identifier: MIT
// A motion planner's queries: which configurations of an arm touch an obstacle or the arm itself, which pair
// touches first, and how far away the others are. The arm is made of capsules, then of meshes.
// Usage: planner [CONFIGURATIONS] [OBSTACLE'S RINGS]
#include <jostle/jostle.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <random>
#include <vector>

using jostle::Pair;
using jostle::Pose3f;
using jostle::Vec3f;

namespace {

constexpr std::uint32_t links = 6;
constexpr float half_length = 0.22f, thickness = 0.06f;

/// A closed surface, 4 rings^2 triangles: a ball of radius 1 with waves, stretched along y.
jostle::Mesh<3> surface(std::uint32_t rings, const Vec3f& size, float waves)
{
    std::vector<Vec3f> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    const std::uint32_t sectors = 2 * rings;
    for (std::uint32_t i = 0; i <= rings; ++i)
        for (std::uint32_t j = 0; j < sectors; ++j) {
            const float t = 3.14159265f * static_cast<float>(i) / static_cast<float>(rings);
            const float p = 3.14159265f * static_cast<float>(j) / static_cast<float>(rings);
            const float r = 1 + waves * std::sin(5 * t) * std::cos(7 * p);
            points.push_back({size[0] * r * std::sin(t) * std::cos(p), size[1] * r * std::cos(t),
                              size[2] * r * std::sin(t) * std::sin(p)});
        }
    for (std::uint32_t i = 0; i < rings; ++i)
        for (std::uint32_t j = 0; j < sectors; ++j) {
            const std::uint32_t k = (j + 1) % sectors, at = i * sectors, below = at + sectors;
            triangles.push_back({at + j, below + j, below + k});
            triangles.push_back({at + j, below + k, at + k});
        }
    return jostle::Mesh<3>(points, triangles);
}

/// Where the links are: each one continues the last, turned by a joint about its z or its y axis.
void place(const std::array<float, links>& angles, Pose3f* poses)
{
    Pose3f joint;
    for (std::uint32_t i = 0; i < links; ++i) {
        joint = joint * Pose3f::turned(i % 2 == 1 ? Vec3f{0, 0, 1} : Vec3f{0, 1, 0}, angles[i]);
        poses[i] = {joint.transform({0, half_length, 0}), joint.rotation};
        joint.position = joint.transform({0, 2 * half_length, 0});
    }
}

} // namespace

int main(int argc, char** argv)
{
    const std::size_t count = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 10'000;
    const std::uint32_t rings = argc > 2 ? static_cast<std::uint32_t>(std::atoi(argv[2])) : 112;
    std::mt19937 random(1);
    const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.0f; };
    const jostle::Mesh<3> rock = surface(rings, {0.7f, 1, 0.6f}, 0.1f);
    const jostle::Mesh<3> link =
        surface(std::min(rings, 22u), {thickness, half_length + thickness, thickness}, 0.02f);
    const std::vector<jostle::Shape3> obstacle{rock};
    const std::vector<Pose3f> obstacle_pose{{{1.4f, 0.8f, 0}, {0, 0, 0, 1}}};
    const std::vector<jostle::Aabb3f> obstacle_box{jostle::bounds(obstacle[0], obstacle_pose[0])};

    std::vector<Pose3f> poses(count * links); // of configuration i: from i * links on
    for (std::size_t i = 0; i < count; ++i) {
        std::array<float, links> angles;
        for (float& angle : angles)
            angle = (uniform() - 0.5f) * 6;
        place(angles, &poses[i * links]);
    }
    // Links that may not touch each other: all but neighbours. What isn't listed is allowed.
    std::vector<Pair> forbidden;
    for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t a = 0; a < links; ++a)
            for (std::uint32_t b = a + 2; b < links; ++b)
                forbidden.push_back({i * links + a, i * links + b});

    // The pairs of configuration i come one behind the other, from offsets[i] on.
    const auto offsets_of = [&](const std::vector<Pair>& pairs) {
        std::vector<std::uint64_t> offsets(count + 1);
        for (const Pair& pair : pairs)
            ++offsets[pair.a / links + 1];
        std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
        return offsets;
    };

    jostle::PairFinder pair_finder;
    jostle::ContactFinder3f finder;
    const auto plan = [&](const char* name, const jostle::Shape3& shape, float farthest) {
        const jostle::StridedView<jostle::Shape3> arm(&shape, poses.size(), 0); // each link has this shape
        std::vector<jostle::Aabb3f> boxes(poses.size());
        // A capsule around each link will do: the box of a posed mesh needs every point.
        const auto capsule = jostle::Shape3::capsule(double{half_length}, 1.1 * double{thickness});
        const jostle::StridedView<jostle::Shape3> around(&capsule, poses.size(), 0);
        jostle::bounds({around, poses}, boxes, farthest, jostle::default_executor());
        std::vector<Pair> near = pair_finder.find(boxes, obstacle_box).to_vector();
        std::sort(near.begin(), near.end());                // by configuration, from the arm's base on
        std::vector<std::uint64_t> hit(count), bent(count); // the first pair of each configuration
        finder.first_touching({arm, poses}, {obstacle, obstacle_pose}, near, offsets_of(near), hit);
        finder.first_touching({arm, poses}, forbidden, offsets_of(forbidden), bent);

        // The distances of free configurations, up to a limit.
        std::erase_if(near, [&](const Pair& pair) {
            return hit[pair.a / links] != jostle::no_pair || bent[pair.a / links] != jostle::no_pair;
        });
        std::vector<jostle::Distance3f> room(count);
        std::vector<std::uint64_t> nearest(count);
        finder.least_distances({arm, poses}, {obstacle, obstacle_pose}, near, offsets_of(near), farthest,
                               room, nearest);

        const auto any = [](std::uint64_t pair) { return pair != jostle::no_pair; };
        const auto touching = std::count_if(hit.begin(), hit.end(), any);
        const auto close = std::count_if(nearest.begin(), nearest.end(), any);
        std::printf("arm of %s: %td of %zu configurations touch the rock, %td themselves, %td are within "
                    "%.1f of it\n",
                    name, touching, count, std::count_if(bent.begin(), bent.end(), any), close,
                    static_cast<double>(farthest));
        return touching > 0 && touching < static_cast<std::ptrdiff_t>(count) && close > 0 &&
               std::all_of(room.begin(), room.end(), [](const auto& gap) { return gap.distance > 0; });
    };
    const bool good = plan("capsules", jostle::Shape3::capsule(double{half_length}, double{thickness}), 0.3f);
    return plan("meshes", link, 0.3f) && good ? 0 : 1;
}
