// SPDX-License-Identifier: MIT
#include "jostle/box.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

using namespace jostle;

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

TEST(Overlaps, TouchingCounts)
{
    constexpr Aabb2f unit{{0, 0}, {1, 1}};
    static_assert(overlaps(unit, unit));
    static_assert(overlaps(unit, Aabb2f{{1, 1}, {2, 2}})); // a corner
    static_assert(overlaps(unit, Aabb2f{{0.25f, 1}, {0.5f, 3}}));
    static_assert(!overlaps(unit, Aabb2f{{1.0000001f, 0}, {2, 1}}));
    static_assert(!overlaps(unit, Aabb2f{{0, -2}, {1, -0.0000001f}}));
    static_assert(overlaps(unit, Aabb2f{{-1, -1}, {2, 2}})); // around it
}

TEST(Overlaps, EveryAxisCanSeparate)
{
    const Aabb3d unit{{0, 0, 0}, {1, 1, 1}};
    for (int axis = 0; axis < 3; ++axis)
        for (const double shift : {-1.5, 1.5}) {
            Aabb3d other = unit;
            other.lo[axis] += shift, other.hi[axis] += shift;
            EXPECT_FALSE(overlaps(unit, other));
            EXPECT_FALSE(overlaps(other, unit));
        }
}

TEST(Contains, PointsAndBoxesOfTheClosedBox)
{
    constexpr Aabb2f unit{{0, 0}, {1, 1}};
    static_assert(contains(unit, Vec2f{0, 1}) && contains(unit, Vec2f{0.5f, 0.5f}));
    static_assert(!contains(unit, Vec2f{0.5f, 1.0000001f}) && !contains(unit, Vec2f{-0.0000001f, 0.5f}));
    static_assert(contains(unit, unit) && contains(unit, Aabb2f{{0.5f, 0}, {0.5f, 1}}));
    static_assert(!contains(unit, Aabb2f{{0, 0}, {1, 2}}) && !contains(unit, Aabb2f{{-1, 0}, {1, 1}}));
    static_assert(contains(Aabb2f{{-infinity, 0}, {infinity, 1}}, unit));
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(contains(unit, Vec2f{0.5f, nan}));
    EXPECT_FALSE(contains(unit, Aabb2f{{0, nan}, {1, 1}}));
    EXPECT_FALSE(contains(unit, Aabb2f{{0, 0}, {1, nan}}));
    EXPECT_FALSE(contains(Aabb2f{{0, nan}, {1, 1}}, Vec2f{0.5f, 0.5f}));
}

TEST(Boxes, Grow)
{
    constexpr Aabb2d a{{0, 1}, {2, 3}}, b{{1, -1}, {5, 2}};
    constexpr auto is = [](const Aabb2d& box, const Vec2d& lo, const Vec2d& hi) {
        return box.lo == lo && box.hi == hi;
    };
    static_assert(is(merged(a, b), {0, -1}, {5, 3}) && is(merged(b, a), {0, -1}, {5, 3}));
    static_assert(is(grown(a, 0.5), {-0.5, 0.5}, {2.5, 3.5}) && is(grown(a, -1), {1, 2}, {1, 2}));
    static_assert(is(swept(a, {3, -2}), {0, -1}, {5, 3}) && is(swept(a, {0, 0}), a.lo, a.hi));
    static_assert(center(a) == Vec2d{1, 2} && size(b) == Vec2d{4, 3});
    constexpr double most = std::numeric_limits<double>::max();
    static_assert(center(Aabb2d{{most, -most}, {most, most}}) == Vec2d{most, 0});
}

TEST(Boxes, RoundOutwardAndNoFurtherThanNeeded)
{
    constexpr double most = std::numeric_limits<float>::max(), everything = HUGE_VAL;
    constexpr double least = std::numeric_limits<float>::denorm_min();
    std::vector<double> numbers = {
        0,     -0.0, 1,    0.1,   1.0 / 3,    16777217,           1e-300,     least, least / 2,
        1e-40, most, 1e39, 1e300, most * 1.5, most * (1 + 1e-12), everything, 1e-46, 123456.789};
    for (std::size_t i = 0, n = numbers.size(); i < n; ++i)
        numbers.push_back(-numbers[i]);
    for (const double lo : numbers)
        for (const double hi : numbers) {
            const Aabb2f box = rounded_outward<float>(Aabb2d{{lo, 0}, {hi, 0}});
            ASSERT_LE(double{box.lo[0]}, lo) << lo;
            ASSERT_GE(double{box.hi[0]}, hi) << hi;
            if (box.lo[0] < infinity) { // the next float is beyond
                ASSERT_TRUE(double{box.lo[0]} == lo || double{std::nextafter(box.lo[0], infinity)} > lo)
                    << lo;
            }
            if (box.hi[0] > -infinity) {
                ASSERT_TRUE(double{box.hi[0]} == hi || double{std::nextafter(box.hi[0], -infinity)} < hi)
                    << hi;
            }
            if (std::isinf(lo)) {
                ASSERT_EQ(double{box.lo[0]}, lo);
            }
            if (std::isinf(hi)) {
                ASSERT_EQ(double{box.hi[0]}, hi);
            }
        }
    EXPECT_TRUE(std::isnan(rounded_outward<float>(Aabb2d{{std::nan(""), 0}, {0, 0}}).lo[0]));
    const Aabb2d same = rounded_outward<double>(Aabb2d{{0.1, -everything}, {1.0 / 3, 1e300}});
    EXPECT_EQ(same.lo, Vec2d(0.1, -everything));
    EXPECT_EQ(same.hi, Vec2d(1.0 / 3, 1e300));
    EXPECT_EQ(rounded_outward<double>(Aabb2f{{0.1f, 0}, {1, 1}}).lo[0], double{0.1f});
}

TEST(Overlaps, PointsInfinitiesAndZeros)
{
    const Aabb2f point{{1, 1}, {1, 1}}, everything{{-infinity, -infinity}, {infinity, infinity}};
    const Aabb2f at_infinity{{infinity, 0}, {infinity, 1}}, half_plane{{0, -infinity}, {infinity, infinity}};
    EXPECT_TRUE(overlaps(point, point));
    EXPECT_TRUE(overlaps(point, everything));
    EXPECT_TRUE(overlaps(at_infinity, half_plane));
    EXPECT_FALSE(overlaps(at_infinity, point));
    EXPECT_TRUE(overlaps(Aabb2f{{-1, -1}, {-0.0f, -0.0f}}, Aabb2f{{0.0f, 0.0f}, {1, 1}}));
}

/// What users have: a box somewhere inside a struct.
struct Body
{
    double mass;
    Aabb3f box;
    std::uint32_t group;
};

std::vector<Body> bodies(std::size_t n)
{
    std::vector<Body> all(n);
    for (std::size_t i = 0; i < n; ++i) {
        const auto x = static_cast<float>(i);
        all[i] = {x, {{x, x + 1, x + 2}, {x + 10, x + 11, x + 12}}, static_cast<std::uint32_t>(i * i)};
    }
    return all;
}

void expect_bodies(const BoxView<3, float>& view, std::size_t n, std::size_t first = 0, int step = 1)
{
    ASSERT_EQ(view.size(), n);
    EXPECT_EQ(view.empty(), n == 0);
    for (std::size_t i = 0; i < n; ++i) {
        const float x = static_cast<float>(first) + static_cast<float>(i) * static_cast<float>(step);
        const Aabb3f box = view[i];
        for (int d = 0; d < 3; ++d) {
            EXPECT_EQ(view.lo(d, i), x + static_cast<float>(d));
            EXPECT_EQ(view.hi(d, i), x + static_cast<float>(10 + d));
            EXPECT_EQ(box.lo[d], view.lo(d, i));
            EXPECT_EQ(box.hi[d], view.hi(d, i));
            EXPECT_EQ(*view.lo_pointer(d, i), view.lo(d, i));
            EXPECT_EQ(*view.hi_pointer(d, i), view.hi(d, i));
        }
    }
}

TEST(BoxView, OfBoxesInContainers)
{
    std::vector<Aabb3f> boxes;
    for (const Body& body : bodies(4))
        boxes.push_back(body.box);
    const std::array<Aabb3f, 4> array = {boxes[0], boxes[1], boxes[2], boxes[3]};
    expect_bodies(BoxView<3, float>(boxes), 4);
    expect_bodies(BoxView<3, float>(array), 4);
    expect_bodies(BoxView<3, float>(std::span(boxes)), 4);
    expect_bodies(BoxView(std::span<const Aabb3f>(boxes)), 4); // deduces <3, float>
    const BoxView<3, float> view(boxes);
    EXPECT_EQ(view.stride_bytes(), 24);
    EXPECT_EQ(view.lo_pointer(0), boxes[0].lo.data()); // in place
}

TEST(BoxView, InsideStructsForwardsAndBackwards)
{
    const std::vector<Body> all = bodies(5);
    const auto stride = static_cast<std::ptrdiff_t>(sizeof(Body));
    expect_bodies(BoxView<3, float>::strided(all[0].box.lo.data(), all[0].box.hi.data(), 5, stride), 5);
    expect_bodies(BoxView<3, float>::strided(all[4].box.lo.data(), all[4].box.hi.data(), 5, -stride), 5, 4,
                  -1);
    expect_bodies(BoxView<3, float>::strided(all[0].box.lo.data(), all[0].box.hi.data(), 3, 2 * stride), 3, 0,
                  2);
    const auto one_box_nine_times =
        BoxView<3, float>::strided(all[0].box.lo.data(), all[0].box.hi.data(), 9, 0);
    EXPECT_EQ(one_box_nine_times.hi(2, 8), 12);
}

TEST(BoxView, OneArrayPerCoordinate)
{
    std::array<std::vector<float>, 6> columns;
    for (const Body& body : bodies(6))
        for (std::size_t d = 0; d < 3; ++d) {
            columns[d].push_back(body.box.lo[d]);
            columns[3 + d].push_back(body.box.hi[d]);
        }
    expect_bodies(BoxView<3, float>::arrays({columns[0].data(), columns[1].data(), columns[2].data()},
                                            {columns[3].data(), columns[4].data(), columns[5].data()}, 6),
                  6);
}

TEST(BoxView, Subviews)
{
    const std::vector<Body> all = bodies(6);
    const auto view = BoxView<3, float>::strided(all[0].box.lo.data(), all[0].box.hi.data(), 6, sizeof(Body));
    expect_bodies(view.subview(2, 3), 3, 2);
    expect_bodies(view.subview(2, 3).subview(1, 2), 2, 3);
    expect_bodies(view.subview(6, 0), 0);
}

TEST(BoxView, OfNothing)
{
    expect_bodies(BoxView<3, float>(), 0);
    expect_bodies(BoxView<3, float>(std::vector<Aabb3f>()), 0);
    expect_bodies(BoxView<3, float>::strided(nullptr, nullptr, 0, 24), 0);
}

TEST(StridedView, MembersArraysAndStrides)
{
    const std::vector<Body> all = bodies(4);
    const StridedView<std::uint32_t> groups(std::span<const Body>(all), &Body::group);
    ASSERT_EQ(groups.size(), 4u);
    EXPECT_EQ(groups[3], 9u);
    EXPECT_EQ(&groups[1], &all[1].group); // in place
    std::vector<std::uint32_t> values(10);
    std::iota(values.begin(), values.end(), 0u);
    const StridedView<std::uint32_t> plain{std::span<const std::uint32_t>(values)};
    const StridedView<std::uint32_t> backwards(&values[9], 10, -4), every_third(values.data(), 4, 12);
    for (std::uint32_t i = 0; i < 10; ++i) {
        EXPECT_EQ(plain[i], i);
        EXPECT_EQ(backwards[i], 9 - i);
    }
    EXPECT_EQ(every_third[3], 9u);
    // What a program holds is seldom const.
    std::vector<Body> mine = bodies(4);
    std::vector<std::uint32_t> numbers = {7, 8, 9};
    StridedView<std::uint32_t> view = {std::span(mine), &Body::group};
    EXPECT_EQ(&view[1], &mine[1].group);
    view = numbers;
    EXPECT_EQ(view.size(), 3u);
    view = std::span(numbers).first(2);
    EXPECT_EQ(view.size(), 2u);
    EXPECT_EQ(view[1], 8u);
    EXPECT_TRUE(StridedView<std::uint32_t>().empty());
    EXPECT_TRUE(StridedView<std::uint32_t>(std::span<const Body>(), &Body::group).empty());
}

TEST(StridedView, Repeats)
{
    const std::vector<std::uint32_t> values = {4, 5, 6};
    const StridedView<std::uint32_t> view(values);
    const auto listed = [](const StridedView<std::uint32_t>& some) {
        std::vector<std::uint32_t> list;
        for (std::size_t i = 0; i < some.size(); ++i)
            list.push_back(some[i]);
        return list;
    };
    using List = std::vector<std::uint32_t>;
    EXPECT_EQ(listed(view.repeated(8)), (List{4, 5, 6, 4, 5, 6, 4, 5}));
    EXPECT_EQ(&view.repeated(8)[7], &values[1]); // in place
    EXPECT_EQ(listed(view.repeated(3)), values);
    EXPECT_EQ(listed(view.repeated(0)), List());
    const StridedView<std::uint32_t> backwards(&values[2], 3, -4);
    EXPECT_EQ(listed(backwards.repeated(4)), (List{6, 5, 4, 6}));
    // Of a part, and of what repeats already.
    EXPECT_EQ(listed(view.repeated(2).repeated(5)), (List{4, 5, 4, 5, 4}));
    EXPECT_EQ(listed(view.repeated(4).repeated(7)), (List{4, 5, 6, 4, 5, 6, 4}));
    EXPECT_EQ(StridedView<std::uint32_t>().repeated(3).size(), 0u);
    EXPECT_EQ(view.repeated(0).repeated(3).size(), 0u);
}

} // namespace
