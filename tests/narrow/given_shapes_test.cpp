// SPDX-License-Identifier: MIT
// Hulls and meshes of whatever holds their points, and what can be read back.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/contact.hpp"
#include "random_pairs.hpp"

namespace {

using namespace jostle;

struct OwnPoint
{
    float x, y, z;
};
struct OwnVertex
{
    int color;
    OwnPoint at;
};
struct OwnTriangle
{
    int x, y, z;
};

template <int Dim, class T>
void expect_same_corners(const ConvexHull<Dim>& hull, const std::vector<Vec<Dim, T>>& points)
{
    const ConvexHull<Dim> expected(points);
    ASSERT_EQ(hull.vertices().size(), expected.vertices().size());
    for (std::size_t i = 0; i < expected.vertices().size(); ++i)
        ASSERT_EQ(hull.vertices()[i], expected.vertices()[i]);
    ASSERT_EQ(hull.face_count(), expected.face_count());
}

TEST(GivenShapes, OfPointsOfAnyKindAreThoseOfVec)
{
    Random random(3);
    std::vector<Vec3f> points;
    std::vector<OwnVertex> own;
    std::vector<std::array<float, 3>> arrays;
    std::vector<float> flat;
    for (int i = 0; i < 60; ++i) {
        Vec3f p;
        for (float& x : p) {
            x = static_cast<float>(std::round(random.uniform(-4, 4)) /
                                   10); // many in one plane, but for rounding
            flat.push_back(x);
        }
        points.push_back(p);
        own.push_back({i, {p[0], p[1], p[2]}});
        arrays.push_back({p[0], p[1], p[2]});
    }
    expect_same_corners(ConvexHull3(std::span(points)), points);
    expect_same_corners(ConvexHull3(StridedView<OwnPoint>(std::span(own), &OwnVertex::at)), points);
    expect_same_corners(ConvexHull3(arrays), points);
    expect_same_corners(ConvexHull3(flat), points);
    const std::vector<double> doubles(flat.begin(), flat.end());
    const std::vector<Vec3d> wide(points.begin(), points.end());
    expect_same_corners(ConvexHull3(doubles), wide);
    const Vec2f square[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const int whole[] = {0, 0, 1, 0, 1, 1, 0, 1};
    expect_same_corners(ConvexHull2(square), std::vector<Vec2f>(std::begin(square), std::end(square)));
    expect_same_corners(ConvexHull2(whole), std::vector<Vec2d>(std::begin(square), std::end(square)));
}

TEST(GivenShapes, MeshesOfNumbersAndIndicesAreThoseOfVec)
{
    const std::vector<Vec3f> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.5f}};
    const std::vector<float> flat = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0.5f};
    const std::vector<Mesh3::Element> elements = {{0, 1, 2}, {1, 3, 2}};
    const std::vector<std::uint16_t> indices = {0, 1, 2, 1, 3, 2};
    const std::vector<OwnTriangle> own = {{0, 1, 2}, {1, 3, 2}};
    const Mesh3 meshes[] = {{vertices, elements},
                            {vertices, {{0, 1, 2}, {1, 3, 2}}},
                            {flat, indices},
                            {vertices, own},
                            {std::span(flat), std::span(indices)}};
    for (const Mesh3& mesh : meshes) {
        const std::vector<Vec3d> expected(vertices.begin(), vertices.end());
        EXPECT_EQ(mesh.vertices(), expected);
        ASSERT_EQ(mesh.elements().size(), 2u);
        EXPECT_EQ(mesh.elements()[0], elements[0]);
        EXPECT_EQ(mesh.elements()[1], elements[1]);
    }
}

TEST(GivenShapes, RefuseNumbersThatAreNoWholePointsAndIndicesOutOfRange)
{
    const auto refusal = [](const auto& call) {
        try {
            call();
        } catch (const Error& error) {
            return error.code();
        }
        return ErrorCode{};
    };
    const std::vector<float> eight(8, 1.0f), nine = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    EXPECT_EQ(refusal([&] { (void)ConvexHull3(eight); }), ErrorCode::size_mismatch);
    EXPECT_EQ(refusal([&] { (void)Mesh3(nine, std::vector<std::uint32_t>{0, 1}); }),
              ErrorCode::size_mismatch);
    EXPECT_EQ(refusal([&] { (void)Mesh3(nine, std::vector<int>{0, 1, -1}); }), ErrorCode::invalid_argument);
    EXPECT_EQ(refusal([&] { (void)Mesh3(nine, std::vector<std::uint64_t>{0, 1, (1ULL << 32) + 2}); }),
              ErrorCode::invalid_argument);
    EXPECT_EQ(refusal([&] { (void)Mesh3(nine, std::vector<std::uint64_t>{0, 1, 2}); }), ErrorCode{});
    EXPECT_EQ(refusal([&] { (void)ConvexHull3(std::vector<double>{}); }), ErrorCode::invalid_argument);
}

TEST(GivenShapes, AreReadBackFromShapes)
{
    const std::vector<Vec3d> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.1, 0.1}};
    const ConvexHull3 hull(corners);
    const Mesh3 mesh(corners, {{0, 1, 2}, {3, 4, 1}});
    const std::vector<float> heights = {0, 1, 2, 0.5f, 0.25f, 4};
    const HeightField field(HeightGrid<float>{heights, 3, 2, 0.5f, 2, 7});
    const Compound<3>::Child children[] = {{Shape3::sphere(2), {{1, 2, 3}}}, {hull, {{}, {0, 0, 2, 0}}}};
    const Compound<3> compound(children);
    const ConvexHull2 flat(std::vector<Vec2d>{{0, 0}, {1, 0}, {0, 1}});

    EXPECT_EQ(Shape3(hull).hull()->vertices().data(), hull.vertices().data()) << "the same memory";
    EXPECT_EQ(Shape3::rounded_hull(hull, 0.5).hull()->face_count(), 4u);
    EXPECT_EQ(Shape2(flat).hull()->vertices().size(), 3u);
    EXPECT_EQ(Shape3(mesh).mesh()->vertices(), corners);
    EXPECT_EQ(Shape3(mesh).mesh()->elements()[1], (Mesh3::Element{3, 4, 1}));
    const auto read = Shape3(field).height_field();
    const HeightGrid<double> grid = read->grid();
    EXPECT_EQ(std::vector<double>(grid.heights.begin(), grid.heights.end()),
              std::vector<double>(heights.begin(), heights.end()));
    EXPECT_TRUE(grid.columns == 3 && grid.rows == 2 && grid.spacing_x == 0.5 && grid.spacing_z == 2 &&
                grid.thickness == 7);
    const auto parts = Shape3(compound).compound();
    ASSERT_EQ(parts->children().size(), 2u);
    EXPECT_EQ(parts->children()[0].pose.position, Vec3d(1, 2, 3));
    EXPECT_EQ(parts->children()[1].pose.rotation[2], 2) << "as given";
    EXPECT_EQ(parts->children()[1].shape.hull()->vertices().data(), hull.vertices().data());

    for (const Shape3& none : {Shape3(), Shape3::box({1, 1, 1}), Shape3::half_space({0, 1, 0}, 0)})
        EXPECT_FALSE(none.hull() || none.mesh() || none.height_field() || none.compound());
    EXPECT_FALSE(Shape3(hull).mesh() || Shape3(mesh).hull() || Shape3(field).mesh() ||
                 Shape2(flat).compound());
}

TEST(GivenShapes, WeldedMeshesNameTheFirstOfTheirVertices)
{
    const std::vector<Vec3f> vertices = {{0, 0, 0},      {1, 0, 0}, {0, 1, 0},
                                         {1, 0.001f, 0}, {0, 1, 0}, {1, 1, 0}};
    const Mesh3 mesh(vertices, {{0, 1, 2}, {3, 5, 4}}, 0.01);
    EXPECT_EQ(mesh.vertices()[3], Vec3d(vertices[3]));
    EXPECT_EQ(mesh.elements()[1], (Mesh3::Element{1, 5, 2}));
}

} // namespace
