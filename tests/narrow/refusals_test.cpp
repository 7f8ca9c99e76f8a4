// SPDX-License-Identifier: MIT
// What shapes and finders refuse, and what the error says.
#include <gtest/gtest.h>

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "tests/contract/error_of.hpp"
#include "tests/narrow/random_pairs.hpp"
#include "tests/narrow/samples.hpp"

using namespace jostle;
using namespace narrow_samples;
using contract::message_of;

namespace {

TEST(Errors, OfWhatIsZeroTooMuchOrInTheWrongPlace)
{
    const Pose3d here;
    Pose3d unturned;
    unturned.rotation = {0, 0, 0, 0};
    const Shape3 ball = Shape3::sphere(1);
    EXPECT_THROW((void)touching(ball, unturned, ball, here), Error);
    EXPECT_THROW((void)touching(ball, here, ball, unturned), Error);
    EXPECT_NO_THROW((void)touching(ball, here, ball, here));
    EXPECT_NE(message_of([&] {
                  (void)time_of_impact(ball, Motion<3, double>{}, ball, Motion<3, double>{}, 0.0);
              }).find("a length above 0"),
              std::string::npos);
    Motion<3, double> fast;
    fast.linear = {0, 2e60, 0};
    EXPECT_NE(message_of([&] {
                  (void)time_of_impact(ball, Motion<3, double>{}, ball, fast, 0.1);
              }).find("a motion has position 0 0 0, rotation 0 0 0 1, linear 0 2e+60 0, angular 0 0 0;"),
              std::string::npos);
    Motion<2, float> spinning;
    spinning.angular = {-2e9f};
    const std::vector<Shape2> circles(2, Shape2::sphere(1));
    const std::vector<Motion<2, float>> motions{{}, spinning};
    const std::vector<Pair> pair{{0, 1}};
    std::vector<Impact<2, float>> impacts(1);
    EXPECT_NE(message_of([&] {
                  ContactFinder2f().impacts({circles, motions}, pair, 0.1f, impacts);
              }).find("the motion of object 1 has position 0 0, rotation 1 0, linear 0 0, angular -2e+09;"),
              std::string::npos);

    const std::vector<double> heights(10, 1.0); // for 3 x 3
    EXPECT_THROW(HeightField(HeightGrid<double>{heights, 3, 3, 1, 1}), Error);
    EXPECT_THROW(HeightField(HeightGrid<double>{std::span(heights).first(8), 3, 3, 1, 1}), Error);
    EXPECT_NO_THROW(HeightField(HeightGrid<double>{std::span(heights).first(9), 3, 3, 1, 1}));

    const std::vector<Compound<3>::Child> one{{ball, here}};
    const Compound<3> inner(one);
    const std::vector<Compound<3>::Child> nested{{ball, here}, {Shape3(inner), here}};
    EXPECT_THROW(Compound<3>{nested}, Error);

    const Ball own(1);
    EXPECT_THROW((void)Shape3(own, ShapeTypes::half_space), Error);
    EXPECT_THROW((void)Shape3(own, ShapeTypes::first_custom - 1), Error);
    EXPECT_NO_THROW((void)Shape3(own, ShapeTypes::first_custom));

    const std::vector<Shape3> shapes(2);
    const std::vector<Pose3d> poses(2);
    for (const std::size_t size : {std::size_t{1}, std::size_t{3}}) {
        std::vector<Aabb<3, double>> out(size);
        EXPECT_THROW(bounds({shapes, poses}, out), Error) << size;
    }
}

TEST(Errors, OfNumbersThatShapesCantHave)
{
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinite = std::numeric_limits<double>::infinity();
    const auto says = [](const auto& call, const std::string& words) {
        const std::string message = message_of(call);
        EXPECT_NE(message.find(words), std::string::npos) << message << " doesn't say: " << words;
    };
    const std::vector<double> level(4, 1.0);
    EXPECT_NO_THROW(HeightField(HeightGrid<double>{level, 2, 2, 1, 1}));
    says([&] { HeightField(HeightGrid<double>{level, 4, 1, 1, 1}); }, "4 x 1 heights; give at least 2 x 2");
    says([&] { HeightField(HeightGrid<double>{level, 65'537, 32'769, 1, 1}); },
         "more than 2^32 - 1 triangles");
    says([&] { HeightField(HeightGrid<double>{level, 65'537, 32'768, 1, 1}); }, "was given 4 heights");
    if constexpr (sizeof(std::size_t) == 8) {
        // No machine need have as many: they are counted before any is read.
        using Element = Mesh<3>::Element;
        const std::vector<Vec<3, double>> corners(3);
        const Element element{0, 1, 2};
        const std::size_t most = 0xffff'ffffu / 3;
        says(
            [&] {
                Mesh<3>(std::span<const Vec<3, double>>(corners),
                        std::span<const Element>(&element, most + 1));
            },
            "a mesh of 1431655766 elements; give at most 1431655765");
    }
    for (const double wrong : {0.0, -1.0, nan, infinite, 1e61}) {
        says([&] { HeightField(HeightGrid<double>{level, 2, 2, wrong, 1}); }, "spacing is");
        says([&] { HeightField(HeightGrid<double>{level, 2, 2, 1, wrong}); }, "spacing is");
    }
    for (const double wrong : {-1e-9, nan, infinite}) {
        HeightGrid<double> grid{level, 2, 2, 1, 1};
        grid.thickness = wrong;
        says([&] { HeightField{grid}; }, "thickness is");
    }
    for (const double wrong : {nan, infinite, -2e60}) {
        std::vector<double> heights = level;
        heights[2] = wrong;
        says([&] { HeightField(HeightGrid<double>{heights, 2, 2, 1, 1}); }, "height 2 is");
        std::vector<Vec<3, double>> vertices(3);
        vertices[1][2] = wrong;
        says([&] { Mesh<3>(vertices, std::vector<Mesh<3>::Element>{{0, 1, 2}}); },
             "vertex 1 of a mesh has the coordinate");
        says([&] { (void)Shape3::half_space({0, 1, 0}, wrong); }, "offset is");
    }
    for (const double wrong : {nan, infinite})
        says([&] { (void)Shape3::half_space({0, wrong, 0}, 1); }, "normal is");

    says([] { Compound<3>(std::span<const Compound<3>::Child>()); }, "a compound without children");
    const Shape3 ball = Shape3::sphere(1);
    Pose3d poses[4];
    poses[0].position = {0, 2e60, 0};
    poses[1].position = {0, nan, 0};
    poses[2].rotation = {0, 0, 0, 0};
    poses[3].rotation = {0, infinite, 0, 1};
    for (const Pose3d& pose : poses) {
        const std::vector<Compound<3>::Child> children{{ball, Pose3d{}}, {ball, pose}};
        says([&] { Compound<3>{children}; }, "child 1 of a compound has no pose");
    }
    const HeightField field(HeightGrid<double>{level, 2, 2, 1, 1});
    const std::vector<Compound<3>::Child> with_field{{Shape3(field), Pose3d{}}};
    says([&] { Compound<3>{with_field}; }, "child 0 of a compound is a mesh, height field or compound");

    const std::vector<Shape3> shapes(2);
    const std::vector<Pair> pairs{{0, 1}, {1, 0}};
    std::vector<std::uint8_t> touch(1);
    ContactFinder3d finder;
    says([&] { finder.touching({shapes, std::vector<Pose3d>(2)}, pairs, touch); },
         "2 pairs and room for 1 answers");
    Motion<3, double> still, off;
    off.pose.position[1] = nan;
    EXPECT_THROW((void)time_of_impact(ball, still, ball, off, 0.1), Error);
    EXPECT_THROW((void)time_of_impact(ball, off, ball, still, 0.1), Error);
}

TEST(Errors, NameTheObjectAndTheValue)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(message_of([] { (void)Shape3::sphere(-1); }).find("-1"), std::string::npos);
    EXPECT_NE(
        message_of([] { (void)Mesh<3>(std::vector<Vec<3, double>>{{}}, {}); }).find("mesh without elements"),
        std::string::npos);
    for (const bool two_sets : {false, true}) {
        const std::string itself = message_of([two_sets] {
            const std::vector<Shape3> shapes(2);
            const std::vector<Pose3d> poses(2), other(2);
            const std::vector<Pair> pairs{{0, 1}, {1, 1}};
            ContactFinder3d finder;
            if (two_sets) {
                EXPECT_EQ(finder.find({shapes, poses}, {shapes, other}, pairs).size(), 2u);
            }
            finder.find({shapes, poses}, pairs);
        });
        EXPECT_NE(itself.find("pair 1 is of object 1 and itself"), std::string::npos) << itself;
    }
    EXPECT_NE(message_of([] { (void)Shape3::sphere(-1e-9); }).find("is -1e-09;"), std::string::npos);
    EXPECT_NE(message_of([] { (void)Shape3::box({1, 1e61, 1}); }).find("is 1e+61;"), std::string::npos);
    EXPECT_NE(message_of([] { (void)bounds(Shape3(), Pose3f{}, -5.0f); }).find("margin of bounds is -5;"),
              std::string::npos);
    EXPECT_NE(message_of([&] { (void)bounds(Shape2(), Pose2f{}, nan); }).find("nan"), std::string::npos);
    EXPECT_NE(message_of([] { (void)Shape3::half_space({0, 0, 0}, 1); }).find("normal"), std::string::npos);
    EXPECT_NE(message_of([] { ConvexHull<3>(std::vector<Vec<3, float>>{}); }).find("without points"),
              std::string::npos);
    EXPECT_NE(message_of([&] {
                  ConvexHull<3>(std::vector<Vec<3, float>>{{0, 0, 0}, {0, nan, 0}});
              }).find("point 1"),
              std::string::npos);
    EXPECT_NE(message_of([] {
                  Mesh<3>(std::vector<Vec<3, float>>{{0, 0, 0}}, std::vector<Mesh<3>::Element>{{0, 0, 1}});
              }).find("element 0"),
              std::string::npos);
    EXPECT_NE(message_of([] { HeightField(HeightGrid<float>{{}, 1, 5, 1, 1}); }).find("2 x 2"),
              std::string::npos);

    const std::vector<Shape3> shapes(3);
    std::vector<Pose3f> poses(3);
    const std::vector<Pair> pairs = {{0, 1}};
    ContactFinder3f finder;
    const std::vector<Pair> bad = {{0, 3}};
    EXPECT_NE(message_of([&] { finder.find({shapes, poses}, std::span<const Pair>(bad)); }).find("3"),
              std::string::npos);
    // Of several blocks of work the first bad pair, by its place among all.
    std::vector<Pair> many(5000, Pair{1, 0});
    many[3001] = {0, 7}, many[4000] = {8, 0};
    const std::vector<Shape3> two(2);
    poses.resize(2);
    std::vector<std::uint8_t> touch(many.size());
    const std::string first_bad = "pair 3001 names objects 0 and 7, but there are 2, numbered from 0";
    EXPECT_EQ(message_of([&] { finder.find({two, poses}, std::span<const Pair>(many)); }), first_bad);
    EXPECT_EQ(message_of([&] { finder.touching({two, poses}, many, touch); }), first_bad);
    poses.resize(3);
    EXPECT_NE(
        message_of([&] { finder.find({shapes, poses}, std::span<const Pair>(pairs), -1.0f); }).find("margin"),
        std::string::npos);
    poses.pop_back();
    EXPECT_NE(message_of([&] { finder.find({shapes, poses}, std::span<const Pair>(pairs)); }).find("2 poses"),
              std::string::npos);
    const Motion<3, float> turning{{}, {}, {1, 0, 0}};
    EXPECT_NE(message_of([&] {
                  (void)time_of_impact(Shape3::half_space({0, 1, 0}, 0), turning, Shape3(), turning, 0.1f);
              }).find("half-space"),
              std::string::npos);
}

} // namespace
