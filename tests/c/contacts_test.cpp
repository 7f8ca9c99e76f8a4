// SPDX-License-Identifier: MIT
// Shapes and contacts in C.
#include <cstring>
#include <limits>
#include <vector>

#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

jostle::Pose3f random_pose(Random& random, double range)
{
    jostle::Pose3f pose;
    for (int d = 0; d < 3; ++d)
        pose.position[d] = static_cast<float>(range * (random.unit() - 0.5));
    for (float& part : pose.rotation)
        part = static_cast<float>(random.unit() - 0.5);
    return pose;
}

/// The same shapes in C and in C++. No two of a shape's numbers are the same.
class CShapes : public CTwin
{
  protected:
    CShapes()
        : hull(std::vector<jostle::Vec<3, float>>{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {1, 2, 3}}),
          mesh(std::vector<jostle::Vec<3, float>>{{-2, 0, 1}, {2, 0, 1}, {0, 1, -3}, {0, 4, 0}},
               std::vector<jostle::Mesh<3>::Element>{{0, 1, 2}, {1, 3, 2}}),
          welded(std::vector<jostle::Vec<3, float>>{{-2, 0, 1}, {2, 0, 1}, {0, 1, -3}, {0, 4, 0}},
                 std::vector<jostle::Mesh<3>::Element>{{0, 1, 2}, {1, 3, 2}}, 4), // the second to the first
          field(jostle::HeightGrid<float>{heights, 3, 2, 0.5f, 2.0f, 4.0f}),
          compound(
              std::vector<jostle::Compound<3>::Child>{{jostle::Shape3::box({1, 0.5, 2}), {{1, 2, 3}}},
                                                      {jostle::Shape3(hull), {{-2, 0, 1}, {0, 0, 1, 1}}}})
    {
        EXPECT_EQ(jostle_shapes_new(3, &shapes, &error), JOSTLE_OK);
        EXPECT_EQ(jostle_shapes_new(3, &more_shapes, &error), JOSTLE_OK);
        const double half[] = {1, 0.5, 2}, normal[] = {1, 2, -2},
                     child_poses[] = {1, 2, 3, 0, 0, 0, 1, -2, 0, 1, 0, 0, 1, 1};
        const float points[] = {0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 1, 2, 3},
                    vertices[] = {-2, 0, 1, 2, 0, 1, 0, 1, -3, 0, 4, 0};
        const std::uint32_t elements[] = {0, 1, 2, 1, 3, 2};
        jostle_shape *box = nullptr, *of_points = nullptr;
        EXPECT_EQ(jostle_shape_box(3, half, 0, &box, &error), JOSTLE_OK);
        EXPECT_EQ(jostle_shape_hull(JOSTLE_3F, points, 5, 0, &of_points, &error), JOSTLE_OK);
        const jostle_shape* const children[] = {box, of_points};
        const auto keep = [&](const jostle::Shape3& shape, auto make) {
            jostle_shape* made = nullptr;
            EXPECT_EQ(make(&made), JOSTLE_OK) << error.message;
            EXPECT_EQ(jostle_shapes_add(shapes, made, 1, &error), JOSTLE_OK);
            jostle_shape_info info;
            EXPECT_EQ(jostle_shape_info_read(made, &info, &error), JOSTLE_OK);
            EXPECT_EQ(info.dim, 3);
            EXPECT_EQ(info.type, shape.type());
            EXPECT_EQ(info.radius, shape.radius());
            EXPECT_EQ(info.offset, shape.offset());
            for (int d = 0; d < 3; ++d)
                EXPECT_EQ(info.size[d], shape.size()[d]);
            twins.push_back(shape);
            jostle_free(made, nullptr);
        };
        keep(jostle::Shape3::sphere(0.75),
             [&](auto out) { return jostle_shape_sphere(3, 0.75, out, &error); });
        keep(jostle::Shape3::capsule(2, 0.25),
             [&](auto out) { return jostle_shape_capsule(3, 2, 0.25, out, &error); });
        keep(jostle::Shape3::box({1, 0.5, 2}),
             [&](auto out) { return jostle_shape_box(3, half, 0, out, &error); });
        keep(jostle::Shape3::half_space({1, 2, -2}, -0.5),
             [&](auto out) { return jostle_shape_half_space(3, normal, -0.5, out, &error); });
        keep(jostle::Shape3(hull),
             [&](auto out) { return jostle_shape_hull(JOSTLE_3F, points, 5, 0, out, &error); });
        keep(jostle::Shape3(mesh), [&](auto out) {
            return jostle_shape_mesh(JOSTLE_3F, vertices, 4, elements, 2, 0, out, &error);
        });
        keep(jostle::Shape3(welded), [&](auto out) {
            return jostle_shape_mesh(JOSTLE_3F, vertices, 4, elements, 2, 4, out, &error);
        });
        keep(jostle::Shape3(field), [&](auto out) {
            return jostle_shape_height_field(JOSTLE_3F, heights.data(), 3, 2, 0.5, 2, 4, out, &error);
        });
        keep(jostle::Shape3(compound),
             [&](auto out) { return jostle_shape_compound(3, children, child_poses, 2, out, &error); });
        EXPECT_EQ(jostle_free(box, &error), JOSTLE_OK); // the list keeps what it needs
        EXPECT_EQ(jostle_free(of_points, &error), JOSTLE_OK);
        // Many at once.
        const double radii[] = {0.5, 1.5}, lengths[] = {3, 4}, halves[] = {1, 2, 3, 4, 5, 6};
        EXPECT_EQ(jostle_shapes_add_spheres(more_shapes, radii, 2, &error), JOSTLE_OK);
        EXPECT_EQ(jostle_shapes_add_capsules(more_shapes, lengths, radii, 2, &error), JOSTLE_OK);
        EXPECT_EQ(jostle_shapes_add_boxes(more_shapes, halves, 2, &error), JOSTLE_OK);
        more_twins = {jostle::Shape3::sphere(0.5),     jostle::Shape3::sphere(1.5),
                      jostle::Shape3::capsule(3, 0.5), jostle::Shape3::capsule(4, 1.5),
                      jostle::Shape3::box({1, 2, 3}),  jostle::Shape3::box({4, 5, 6})};
        Random random(6);
        for (std::size_t i = 0; i < twins.size(); ++i)
            motions.push_back(random_motion(random));
        motions[3].angular = {}; // a half-space doesn't turn
        for (std::size_t i = 0; i < more_twins.size(); ++i)
            more_motions.push_back(random_motion(random));
        for (std::uint32_t a = 0; a < twins.size(); ++a) {
            for (std::uint32_t b = 0; b < more_twins.size(); ++b)
                pairs_of_two.push_back({a, b});
            for (std::uint32_t b = 0; b < twins.size(); ++b)
                if (a != b) pairs_of_one.push_back({a, b});
        }
    }
    static jostle::Motion<3, float> random_motion(Random& random)
    {
        jostle::Motion<3, float> motion;
        motion.pose = random_pose(random, 12);
        for (int d = 0; d < 3; ++d) {
            motion.linear[d] = static_cast<float>(20 * (random.unit() - 0.5));
            motion.angular[static_cast<std::size_t>(d)] = static_cast<float>(random.unit());
        }
        return motion;
    }
    static std::vector<jostle::Pose3f> poses_of(const std::vector<jostle::Motion<3, float>>& motions)
    {
        std::vector<jostle::Pose3f> poses;
        for (const auto& motion : motions)
            poses.push_back(motion.pose);
        return poses;
    }
    static jostle_blocks blocks_of(const Pairs& pairs, jostle_block& block)
    {
        block = {pairs.data(), pairs.size()};
        return {&block, 1, pairs.size(), sizeof(jostle_pair)};
    }
    template <class Item>
    static void expect_same_bytes(const std::vector<Item>& got, const std::vector<Item>& expected)
    {
        ASSERT_EQ(got.size(), expected.size());
        for (std::size_t i = 0; i < got.size(); ++i)
            EXPECT_EQ(std::memcmp(static_cast<const void*>(&got[i]), static_cast<const void*>(&expected[i]),
                                  sizeof(Item)),
                      0)
                << "of pair " << i;
    }

    std::vector<float> heights{0, 1, 2, -1, 0.5f, 3};
    jostle::ConvexHull<3> hull;
    jostle::Mesh<3> mesh, welded;
    jostle::HeightField field;
    jostle::Compound<3> compound;
    std::vector<jostle::Shape3> twins, more_twins;
    std::vector<jostle::Motion<3, float>> motions, more_motions;
    Pairs pairs_of_one, pairs_of_two;
};

TEST_F(CShapes, HaveTheBoundsOfTheirTwins)
{
    const auto check = [&](const jostle_shapes* list, const auto& expected, const auto& placed) {
        const std::vector<jostle::Pose3f> poses = poses_of(placed);
        const jostle_objects objects{list, values_of(poses)};
        for (const double margin : {0.0, 0.5}) {
            std::vector<Aabb3f> bounds(expected.size());
            OK(jostle_bounds(JOSTLE_3F, &objects, margin, nullptr, bounds.data(), &error));
            for (std::size_t i = 0; i < expected.size(); ++i) {
                const Aabb3f twin = jostle::bounds(expected[i], poses[i], static_cast<float>(margin));
                EXPECT_EQ(bounds[i].lo, twin.lo) << i;
                EXPECT_EQ(bounds[i].hi, twin.hi) << i;
            }
        }
    };
    check(shapes, twins, motions);
    check(more_shapes, more_twins, more_motions);
}

TEST_F(CShapes, CopiedFromOtherListsKeepWhatTheyPointTo)
{
    jostle_shapes* copied = nullptr;
    ASSERT_EQ(jostle_shapes_new(3, &copied, &error), JOSTLE_OK);
    const std::size_t count = twins.size();
    ASSERT_EQ(jostle_shapes_add_from(copied, more_shapes, 1, 2, &error), JOSTLE_OK); // they point to nothing
    ASSERT_EQ(jostle_shapes_add_from(copied, shapes, 3, count - 3, &error), JOSTLE_OK);
    ASSERT_EQ(jostle_shapes_add_from(copied, copied, 1, count - 2, &error), JOSTLE_OK);
    ASSERT_EQ(jostle_shapes_set(copied, 1, nullptr, &error), JOSTLE_INVALID_ARGUMENT);
    for (const std::uint64_t first : {std::uint64_t{3}, count, count + 1, UINT64_MAX}) {
        EXPECT_EQ(jostle_shapes_add_from(copied, shapes, first, count - 2, &error), JOSTLE_INVALID_ARGUMENT);
        EXPECT_NE(std::strstr(error.message, std::to_string(first).c_str()), nullptr) << error.message;
    }
    EXPECT_EQ(jostle_clear(shapes, &error),
              JOSTLE_OK); // their hulls and meshes are kept by the others

    std::vector<jostle::Shape3> expected(more_twins.begin() + 1, more_twins.begin() + 3);
    expected.insert(expected.end(), twins.begin() + 3, twins.end());
    const std::vector<jostle::Shape3> again(expected.begin() + 1,
                                            expected.begin() + std::ptrdiff_t(count) - 1);
    expected.insert(expected.end(), again.begin(), again.end());
    Random random(7);
    std::vector<jostle::Pose3f> poses;
    for (const jostle::Shape3& shape : expected) {
        poses.push_back(random_motion(random).pose);
        if (shape.type() == jostle::ShapeTypes::half_space) poses.back() = {};
    }
    std::vector<Aabb3f> bounds(expected.size()), expected_bounds(expected.size());
    const jostle_objects objects{copied, values_of(poses)};
    ASSERT_EQ(jostle_bounds(JOSTLE_3F, &objects, 0, nullptr, bounds.data(), &error), JOSTLE_OK)
        << error.message;
    jostle::bounds({expected, poses}, expected_bounds);
    expect_same_bytes(bounds, expected_bounds);
    EXPECT_EQ(jostle_free(copied, &error), JOSTLE_OK);
}

TEST_F(CShapes, RepeatForAWholeMultipleOfPoses)
{
    constexpr std::size_t times = 3;
    Random random(8);
    std::vector<jostle::Pose3f> poses;
    std::vector<jostle::Shape3> expected;
    for (std::size_t i = 0; i < times * twins.size(); ++i) {
        expected.push_back(twins[i % twins.size()]);
        poses.push_back(random_motion(random).pose);
        if (expected.back().type() == jostle::ShapeTypes::half_space) poses.back() = {};
    }
    std::vector<Aabb3f> bounds(poses.size()), expected_bounds(poses.size());
    jostle::bounds({expected, poses}, expected_bounds);
    const jostle_objects objects{shapes, values_of(poses)};
    const auto ask = [&](const jostle_objects& of) {
        return jostle_bounds(JOSTLE_3F, &of, 0, nullptr, bounds.data(), &error);
    };
    EXPECT_EQ(ask(objects), JOSTLE_SIZE_MISMATCH);
    OK(jostle_shapes_set_repeats(shapes, 1, &error));
    OK(ask(objects));
    expect_same_bytes(bounds, expected_bounds);
    jostle_objects fewer = objects;
    --fewer.poses.count;
    EXPECT_EQ(ask(fewer), JOSTLE_SIZE_MISMATCH) << "no whole multiple";
    OK(jostle_shapes_set_repeats(shapes, 0, &error));
    EXPECT_EQ(ask(objects), JOSTLE_SIZE_MISMATCH);
}

TEST_F(CShapes, MeetAsTheirTwinsDo)
{
    const std::vector<jostle::Pose3f> poses = poses_of(motions), more_poses = poses_of(more_motions);
    const jostle_objects one{shapes, values_of(poses)}, other{more_shapes, values_of(more_poses)},
        moving{shapes, values_of(motions)}, other_moving{more_shapes, values_of(more_motions)};
    OK(jostle_contact_finder_new(JOSTLE_3F, nullptr, &contact_finder, &error));
    jostle::ContactFinder3f twin;
    for (const bool two : {false, true}) {
        SCOPED_TRACE(two);
        const Pairs& pairs = two ? pairs_of_two : pairs_of_one;
        jostle_block block;
        const jostle_blocks given = blocks_of(pairs, block);
        for (const float margin : {0.0f, 1.0f}) {
            jostle_blocks found;
            OK(jostle_contact_finder_find(contact_finder, &one, two ? &other : nullptr, &given, margin,
                                          &found, &error));
            const auto& expected = two ? twin.find({twins, poses}, {more_twins, more_poses}, pairs, margin)
                                       : twin.find({twins, poses}, pairs, margin);
            const auto contacts = items_of<jostle::Contact<3, float>>(found);
            ASSERT_EQ(contacts.size(), expected.size());
            EXPECT_GT(contacts.size(), 5u);
            std::size_t i = 0;
            for (const jostle::Contact<3, float>& contact : expected) {
                EXPECT_EQ(contacts[i].pair, contact.pair);
                EXPECT_EQ(contacts[i].part_a, contact.part_a);
                EXPECT_EQ(contacts[i].part_b, contact.part_b);
                EXPECT_EQ(contacts[i].normal, contact.normal);
                ASSERT_EQ(contacts[i].count, contact.count);
                for (std::uint32_t k = 0; k < contact.count; ++k)
                    EXPECT_EQ(std::memcmp(&contacts[i].point[k], &contact.point[k], sizeof contact.point[k]),
                              0);
                ++i;
            }
        }
        std::vector<std::uint8_t> touching(pairs.size()), touching_twin(pairs.size());
        OK(jostle_contact_finder_touching(contact_finder, &one, two ? &other : nullptr, &given,
                                          touching.data(), &error));
        two ? twin.touching({twins, poses}, {more_twins, more_poses}, pairs, touching_twin)
            : twin.touching({twins, poses}, pairs, touching_twin);
        EXPECT_EQ(touching, touching_twin);
        for (const float most : {2.0f, std::numeric_limits<float>::infinity()}) {
            std::vector<jostle::Distance<3, float>> distances(pairs.size()), expected(pairs.size());
            OK(jostle_contact_finder_distances(contact_finder, &one, two ? &other : nullptr, &given, most,
                                               distances.data(), &error));
            two ? twin.distances({twins, poses}, {more_twins, more_poses}, pairs, most, expected)
                : twin.distances({twins, poses}, pairs, most, expected);
            expect_same_bytes(distances, expected);
        }
        for (const float tolerance : {0.001f, 0.5f}) {
            std::vector<jostle::Impact<3, float>> impacts(pairs.size()), expected(pairs.size());
            OK(jostle_contact_finder_impacts(contact_finder, &moving, two ? &other_moving : nullptr, &given,
                                             tolerance, impacts.data(), &error));
            two ? twin.impacts({twins, motions}, {more_twins, more_motions}, pairs, tolerance, expected)
                : twin.impacts({twins, motions}, pairs, tolerance, expected);
            expect_same_bytes(impacts, expected);
        }
    }
}

TEST_F(CShapes, OfOnePairMeetAsTheirTwinsDo)
{
    jostle_shape *box = nullptr, *capsule = nullptr;
    const double half[] = {1, 0.5, 2};
    OK(jostle_shape_box(3, half, 0, &box, &error));
    OK(jostle_shape_capsule(3, 2, 0.25, &capsule, &error));
    Random random(7);
    int touched = 0;
    for (int k = 0; k < 40; ++k) {
        const jostle::Motion<3, float> a = random_motion(random), b = random_motion(random);
        const jostle::Shape3 &shape_a = twins[2], &shape_b = twins[1];
        std::int32_t touching = -1;
        OK(jostle_touching(JOSTLE_3F, box, &a.pose, capsule, &b.pose, &touching, &error));
        EXPECT_EQ(touching, jostle::touching(shape_a, a.pose, shape_b, b.pose) ? 1 : 0);
        touched += touching;
        OK(jostle_contacts(JOSTLE_3F, box, &a.pose, capsule, &b.pose, 2, results, &error));
        jostle_blocks blocks;
        OK(jostle_results_blocks(results, &blocks, &error));
        const auto contacts = items_of<jostle::Contact<3, float>>(blocks);
        const auto expected = jostle::contacts(shape_a, a.pose, shape_b, b.pose, 2.0f);
        ASSERT_EQ(contacts.size(), expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i)
            EXPECT_EQ(contacts[i].normal, expected[i].normal);
        jostle::Distance<3, float> distance;
        OK(jostle_distance(JOSTLE_3F, box, &a.pose, capsule, &b.pose, 4, &distance, &error));
        const auto expected_distance = jostle::distance(shape_a, a.pose, shape_b, b.pose, 4.0f);
        EXPECT_EQ(distance.distance,
                  expected_distance ? expected_distance->distance : std::numeric_limits<float>::infinity());
        if (expected_distance) {
            EXPECT_EQ(distance.from_b, expected_distance->from_b);
        }
        jostle::Impact<3, float> impact;
        OK(jostle_time_of_impact(JOSTLE_3F, box, &a, capsule, &b, 0.25, &impact, &error));
        const auto expected_impact = jostle::time_of_impact(shape_a, a, shape_b, b, 0.25f);
        EXPECT_EQ(impact.time,
                  expected_impact ? expected_impact->time : std::numeric_limits<float>::infinity());
    }
    EXPECT_GT(touched, 0);
    OK(jostle_free(box, &error));
    OK(jostle_free(capsule, &error));
}

} // namespace
} // namespace c_twin
