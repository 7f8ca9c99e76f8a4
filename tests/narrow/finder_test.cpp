// SPDX-License-Identifier: MIT
// What ContactFinder takes and gives, whatever the shapes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "jostle/contact.hpp"
#include "random_pairs.hpp"

using namespace jostle;

namespace {

const float nan_f = std::numeric_limits<float>::quiet_NaN();

template <class Call>
Error error_of(Call call)
{
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    ADD_FAILURE() << "no error";
    return Error(ErrorCode::invalid_argument, "");
}

TEST(ContactFinder, LooksAtNoObjectThatNoPairNames)
{
    const std::vector<Shape3> shapes(1000, Shape3::sphere(1));
    std::vector<Pose3f> poses(1000);
    std::vector<Motion<3, float>> motions(1000);
    for (std::size_t i = 0; i < 1000; ++i)
        if (i != 7 && i != 500) {
            poses[i].position[1] = nan_f;
            motions[i].pose.position[1] = nan_f;
        }
    const std::vector<Pair> pairs = {{7, 500}};
    ContactFinder3f finder;
    std::uint8_t touch[1];
    Distance<3, float> distance[1];
    Impact<3, float> impact[1];
    EXPECT_EQ(finder.find(shapes, poses, pairs).size(), 1u);
    finder.touching(shapes, poses, pairs, touch);
    finder.distances(shapes, poses, pairs, 1, distance);
    finder.impacts(shapes, motions, pairs, 0.1f, impact);
    EXPECT_EQ(touch[0], 1);
    EXPECT_EQ(distance[0].distance, -2);
    EXPECT_EQ(impact[0].time, 0);
}

TEST(ContactFinder, NamesTheBadObjectOfTheFirstBadPair)
{
    const std::vector<Shape3> shapes(10, Shape3::sphere(1));
    std::vector<Pair> pairs(5000, Pair{1, 0});
    pairs[1200] = {8, 3}, pairs[3000] = {2, 9}, pairs[4000] = {0, 10};
    ContactFinder3f finder;
    std::vector<std::uint8_t> touch(pairs.size());
    std::vector<Distance<3, float>> distances(pairs.size());
    std::vector<Impact<3, float>> impacts(pairs.size());
    const auto refuses = [&](auto&& spoil, const char* pose, const char* motion) {
        std::vector<Pose3f> poses(10);
        spoil(poses[3]), spoil(poses[2]), spoil(poses[5]);
        std::vector<Motion<3, float>> motions(10);
        for (std::size_t i = 0; i < 10; ++i)
            motions[i].pose = poses[i];
        const Error errors[] = {
            error_of([&] { finder.find(shapes, poses, pairs); }),
            error_of([&] { finder.touching(shapes, poses, pairs, touch); }),
            error_of([&] { finder.distances(shapes, poses, pairs, 1, distances); }),
            error_of([&] { finder.impacts(shapes, motions, pairs, 0.1f, impacts); }),
        };
        for (const Error& error : errors) {
            EXPECT_EQ(error.index(), 3u);
            EXPECT_NE(std::string(error.what()).find(&error == &errors[3] ? motion : pose), std::string::npos)
                << error.what();
        }
        // As it was before.
        EXPECT_EQ(finder.find(shapes, std::vector<Pose3f>(10), std::span(pairs).first(3000)).size(), 3000u);
    };
    refuses([](Pose3f& pose) { pose.position[2] = nan_f; }, "object 3 has position 0 0 nan",
            "object 3 is not");
    refuses([](Pose3f& pose) { pose.rotation[0] = HUGE_VALF; }, "object 3 has position 0 0 0, rotation inf",
            "object 3 is not");
    refuses([](Pose3f& pose) { pose.rotation = {0, 0, 0, 0}; }, "rotation 0 0 0 0", "object 3 is not");
}

TEST(ContactFinder, TakesEveryPoseThatIsOne)
{
    const Shape3 ball = Shape3::sphere(1);
    const double big = std::numeric_limits<double>::max(), small = std::numeric_limits<double>::denorm_min();
    for (const double turn : {big, small, 1.0})
        for (const double at : {-1e60, 1e60, 0.0})
            EXPECT_TRUE(touching(ball, Pose3d{{at, at, at}, {turn, -turn, turn, turn}}, ball,
                                 Pose3d{{at, at, at}, {0, -turn, 0, 0}}));
    for (const Pose3d& bad :
         {Pose3d{{0, 1.1e60, 0}}, Pose3d{{0, 0, -HUGE_VAL}}, Pose3d{{}, {1, big, HUGE_VAL, 1}}})
        EXPECT_THROW((void)touching(ball, Pose3d{}, ball, bad), Error);
}

/// A user's test for two types leaves the others as they were: in the same bits.
TEST(ContactFinder, AsksAUsersTestForItsTypesOnly)
{
    Random random(3);
    const Zoo<3> zoo(random, 4);
    std::vector<Pose3f> poses;
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < zoo.shapes.size(); ++i) {
        poses.push_back(random.pose<float>(1));
        for (std::uint32_t k = 0; k < i; ++k)
            pairs.push_back(i % 3 == 0 ? Pair{i, k} : Pair{k, i});
    }
    ContactFinder3f plain, own;
    const PairTest<3> nothing{ShapeTypes::capsule, ShapeTypes::box,
                              [](void*, const PairTestInput<3>&, PairTest<3>::Emit) {}, nullptr};
    own.add_test(nothing);
    const auto expected = plain.find(zoo.shapes, poses, pairs).to_vector();
    const auto is_own = [&](const Contact<3, float>& contact) {
        const ShapeType a = zoo.shapes[contact.pair.a].type(), b = zoo.shapes[contact.pair.b].type();
        return std::min(a, b) == ShapeTypes::capsule && std::max(a, b) == ShapeTypes::box;
    };
    std::size_t next = 0, left_out = 0;
    for (const Contact<3, float>& contact : own.find(zoo.shapes, poses, pairs)) {
        while (next < expected.size() && is_own(expected[next]))
            ++next, ++left_out;
        ASSERT_LT(next, expected.size());
        ASSERT_EQ(contact.pair, expected[next].pair);
        ASSERT_EQ(contact.normal, expected[next].normal);
        ASSERT_EQ(contact.count, expected[next].count);
        for (std::uint32_t i = 0; i < contact.count; ++i)
            ASSERT_EQ(contact.point[i].from_a, expected[next].point[i].from_a);
        ++next;
    }
    EXPECT_GT(left_out, 3u);
    EXPECT_EQ(next, expected.size());
    for (const ShapeType type : {ShapeType{8}, ShapeType{15}}) {
        PairTest<3> bad = nothing;
        bad.type_b = type;
        EXPECT_NE(
            std::string(error_of([&] { own.add_test(bad); }).what()).find("type " + std::to_string(type)),
            std::string::npos);
    }
}

} // namespace
