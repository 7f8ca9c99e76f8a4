// SPDX-License-Identifier: MIT
// Faces and sides that are parallel but for a millionth or a billionth of a radian, and as near to each
// other: of one that lies over another its lowest corner says what is right.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

/// That distance, touching and contacts say the same, to a billionth of the size.
template <int Dim>
void expect_agreement(const Shape<Dim>& a, const Pose<Dim, double>& pose_a, const Shape<Dim>& b,
                      const Pose<Dim, double>& pose_b, double right, double size)
{
    const double found = distance(a, pose_a, b, pose_b, HUGE_VAL)->distance;
    ASSERT_NEAR(found, right, 1e-9 * size);
    ASSERT_EQ(touching(a, pose_a, b, pose_b), found <= 0) << found << " for " << right;
    const auto met = contacts(a, pose_a, b, pose_b, 0.0);
    ASSERT_EQ(met.empty(), found > 0) << found << " for " << right;
    for (const auto& contact : met)
        ASSERT_NEAR(contact.point[0].depth, -right, 1e-9 * size);
}

/// How high a corner is once it is turned.
long double height(const Vec<3, double>& corner, const Pose3d& pose)
{
    const long double x = pose.rotation[0], y = pose.rotation[1], z = pose.rotation[2], w = pose.rotation[3];
    const long double scale = 2 / (x * x + y * y + z * z + w * w);
    return pose.position[1] + scale * (x * y + w * z) * corner[0] +
           (1 - scale * (x * x + z * z)) * corner[1] + scale * (y * z - w * x) * corner[2];
}
long double height(const Vec<2, double>& corner, const Pose2d& pose)
{
    const long double c = pose.rotation[0], s = pose.rotation[1];
    return pose.position[1] + (s * corner[0] + c * corner[1]) / std::sqrt(c * c + s * s);
}
void tilt(Random& random, double angle, Pose3d& pose)
{
    const double yaw = random.chance(0.3) ? 0 : random.uniform(-1.5, 1.5), way = random.uniform(0, 6.3);
    pose.rotation = {0.5 * angle * std::cos(way), std::sin(yaw), 0.5 * angle * std::sin(way), std::cos(yaw)};
}
void tilt(Random& random, double angle, Pose2d& pose)
{
    pose.rotation = {1, random.chance(0.5) ? angle : -angle};
}

/// Boxes and prisms on boxes and prisms that are wider.
template <int Dim>
void expect_right_distances(std::uint64_t seed, int rounds)
{
    Random random(seed);
    for (int round = 0; round < rounds; ++round) {
        const double low = random.uniform(0.2, 0.8);
        std::vector<Vec<Dim, double>> ground, body;
        for (std::uint32_t i = 0; i < 1u << Dim; ++i) {
            Vec<Dim, double> corner;
            for (std::uint32_t d = 0; d < Dim; ++d)
                corner[d] = ((i >> d & 1) != 0 ? 1 : -1) * (d == 1 ? low : 1.5);
            ground.push_back(corner);
        }
        Vec<Dim, double> half;
        for (double& h : half)
            h = random.uniform(0.2, 0.5);
        const std::uint32_t sides = Dim == 2 ? 2 : 3 + random.below(8);
        for (std::uint32_t i = 0; i < 2 * sides; ++i) {
            const double angle = 6.28318530717958648 * (i / 2) / sides;
            Vec<Dim, double> corner{};
            corner[0] = 0.5 * std::cos(angle);
            corner[Dim - 1] = 0.5 * std::sin(angle);
            corner[1] = (i % 2 != 0 ? 1 : -1) * half[1];
            body.push_back(corner);
        }
        const ConvexHull<Dim> ground_hull(ground), body_hull(body);
        Vec<Dim, double> wide;
        for (double& h : wide)
            h = 1.5;
        wide[1] = low;
        const bool is_box = random.chance(0.5);
        const Shape<Dim> a = random.chance(0.5) ? Shape<Dim>::box(wide) : Shape<Dim>(ground_hull),
                         b = is_box ? Shape<Dim>::box(half) : Shape<Dim>(body_hull);
        if (is_box)
            for (std::size_t i = 0; i < body.size(); ++i)
                for (std::uint32_t d = 0; d < Dim; ++d)
                    body[i][d] = ((i >> d & 1) != 0 ? 1 : -1) * half[d];
        const Pose<Dim, double> pose_a;
        Pose<Dim, double> pose_b;
        for (double& x : pose_b.position)
            x = random.chance(0.1) ? 0 : random.uniform(-0.6, 0.6);
        pose_b.position[1] = low + half[1] + random.uniform(-1e-8, 1e-8);
        tilt(random, std::pow(10, random.uniform(-9, -6)), pose_b);
        long double lowest = HUGE_VAL;
        for (const auto& corner : body)
            lowest = std::min(lowest, height(corner, pose_b));
        SCOPED_TRACE(testing::Message() << round << " types " << a.type() << " and " << b.type());
        expect_agreement(a, pose_a, b, pose_b, static_cast<double>(lowest - low),
                         std::hypot(1.5, low) + std::hypot(0.5, half[1]));
        if (testing::Test::HasFatalFailure()) return;
    }
}

TEST(NearlyParallelFaces, AreAsFarFromEachOtherAsTheirCorners)
{
    expect_right_distances<3>(51, 4000);
}

TEST(NearlyParallelSides, AreAsFarFromEachOtherAsTheirCorners)
{
    expect_right_distances<2>(52, 4000);
}

TEST(NearlyParallelFaces, OfTwoCubesThatPartlyCoverEachOther)
{
    const Shape3 cube = Shape3::box({0.5, 0.5, 0.5});
    Pose3d pose;
    pose.position = {0.25, 1 + 1e-8, 0.1};
    const double turn = 0.5e-8 / std::sqrt(2.0);
    pose.rotation = {turn, 0, turn, 1};
    EXPECT_NEAR(distance(cube, Pose3d{}, cube, pose, 1.0)->distance, 3.64e-9, 1e-11); // by separating axes
}

} // namespace
