// SPDX-License-Identifier: MIT
// What ContactFinder takes and gives, whatever the shapes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include <array>

#include "jostle/jostle.hpp"
#include "random_pairs.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/contract/error_of.hpp"

using namespace jostle;
using contract::error_of;

namespace {

const float nan_f = std::numeric_limits<float>::quiet_NaN();

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
    EXPECT_EQ(finder.find({shapes, poses}, pairs).size(), 1u);
    finder.touching({shapes, poses}, pairs, touch);
    finder.distances({shapes, poses}, pairs, 1, distance);
    finder.impacts({shapes, motions}, pairs, 0.1f, impact);
    EXPECT_EQ(touch[0], 1);
    EXPECT_EQ(distance[0].distance, -2);
    EXPECT_EQ(impact[0].time, 0);
}

// Most of them are only checked while they are computed, type by type.
TEST(ContactFinder, NamesTheFirstBadPoseAmongDistancesOfAllTypes)
{
    const Shape3 types[] = {Shape3::capsule(1, 0.5), Shape3::box({1, 1, 1}), Shape3::sphere(1),
                            Shape3::cylinder(1, 0.5), Shape3::capsule(2, 0.5)};
    constexpr std::uint32_t n = 300;
    std::vector<Shape3> shapes;
    std::vector<Pose3f> poses(n);
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < n; ++i) {
        shapes.push_back(types[i % 5]);
        poses[i].position = {4 * float(i), 0, 0};
    }
    for (std::uint32_t i = 0; i + 7 < n; ++i)
        for (const std::uint32_t further : {1u, 2u, 3u, 5u, 7u})
            pairs.push_back(i % 2 == 0 ? Pair{i, i + further} : Pair{i + further, i});
    ContactFinder3f finder;
    std::vector<Distance<3, float>> out(pairs.size());
    const auto refuses = [&](auto&& spoil, const char* what) {
        for (std::uint32_t first = 150; first < 155; ++first) {
            std::vector<Pose3f> bad = poses;
            for (std::uint32_t i = first; i < n; ++i)
                spoil(bad[i]);
            const auto named = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& pair) {
                return pair.a >= first || pair.b >= first;
            });
            const std::uint32_t object = named->a >= first ? named->a : named->b;
            const Error error = error_of([&] { finder.distances({shapes, bad}, pairs, 1, out); });
            EXPECT_EQ(error.index(), object);
            EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
            // One alone.
            std::vector<Pose3f> one_bad = poses;
            spoil(one_bad[first]);
            const Error alone = error_of([&] { finder.distances({shapes, one_bad}, pairs, 1, out); });
            EXPECT_EQ(alone.index(), first);
            for (const Pair& pair : pairs) {
                if (pair.a != first && pair.b != first) continue;
                const std::span<const Pair> one(&pair, 1);
                EXPECT_THROW(finder.distances({shapes, one_bad}, one, 1, std::span(out).first(1)), Error);
            }
        }
    };
    refuses([](Pose3f& pose) { pose.position[1] = nan_f; }, "nan 0, rotation 0 0 0 1");
    refuses([](Pose3f& pose) { pose.position[2] = -HUGE_VALF; }, "0 -inf, rotation 0 0 0 1");
    refuses([](Pose3f& pose) { pose.rotation = {0, 0, 0, 0}; }, "rotation 0 0 0 0");
    for (std::size_t k = 0; k < 4; ++k) {
        refuses([k](Pose3f& pose) { pose.rotation[k] = nan_f; }, "nan");
        refuses([k](Pose3f& pose) { pose.rotation[k] = HUGE_VALF; }, "inf");
    }
    finder.distances({shapes, poses}, pairs, 100, out);
    // Of two sets, where that isn't an object and itself, and of one.
    std::vector<Pose3f> others = poses;
    for (Pose3f& pose : others)
        pose.position[1] = 5;
    pairs[40] = {1, 1};
    finder.distances({shapes, poses}, {shapes, others}, pairs, 100, out);
    EXPECT_EQ(out[40].distance, 3);
    EXPECT_NE(std::string(error_of([&] { finder.distances({shapes, poses}, pairs, 1, out); }).what())
                  .find("pair 40 is of object 1 and itself"),
              std::string::npos);
    poses[pairs[30].a].position[0] = nan_f;
    const Error before = error_of([&] { finder.distances({shapes, poses}, pairs, 1, out); });
    EXPECT_NE(std::string(before.what()).find("nan"), std::string::npos) << before.what();
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
    const auto refuses = [&](auto&& spoil, const char* what) {
        std::vector<Pose3f> poses(10);
        spoil(poses[3]), spoil(poses[2]), spoil(poses[5]);
        std::vector<Motion<3, float>> motions(10);
        for (std::size_t i = 0; i < 10; ++i)
            motions[i].pose = poses[i];
        const Error errors[] = {
            error_of([&] { finder.find({shapes, poses}, pairs); }),
            error_of([&] { finder.touching({shapes, poses}, pairs, touch); }),
            error_of([&] { finder.distances({shapes, poses}, pairs, 1, distances); }),
            error_of([&] { finder.impacts({shapes, motions}, pairs, 0.1f, impacts); }),
        };
        for (const Error& error : errors) {
            EXPECT_EQ(error.index(), 3u);
            EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
        }
        // As it was before.
        EXPECT_EQ(finder.find({shapes, std::vector<Pose3f>(10)}, std::span(pairs).first(3000)).size(), 3000u);
    };
    refuses([](Pose3f& pose) { pose.position[2] = nan_f; }, "object 3 has position 0 0 nan");
    refuses([](Pose3f& pose) { pose.rotation[0] = HUGE_VALF; }, "object 3 has position 0 0 0, rotation inf");
    refuses([](Pose3f& pose) { pose.rotation = {0, 0, 0, 0}; },
            "object 3 has position 0 0 0, rotation 0 0 0 0");
}

/// By its place among all pairs, however many pieces of memory they are in; and the object that isn't there.
TEST(ContactFinder, NamesThePairWhoseObjectIsMissing)
{
    Random random(5);
    const std::size_t count = 20'000;
    std::vector<Aabb3f> boxes;
    for (std::size_t i = 0; i < count; ++i) {
        const auto at = [&](double to) { return static_cast<float>(random.uniform(0, to)); };
        const float x = static_cast<float>(i) * 0.01f, y = at(2), z = at(2);
        boxes.push_back({{x, y, z}, {x + 1, y + 1, z + 1}});
    }
    const PairBuffer pairs = find_pairs(boxes);
    const std::vector<Pair> all = pairs.to_vector();
    ASSERT_GT(all.size(), 100'000u);
    ContactFinder3f finder;
    std::vector<std::uint8_t> touch(all.size());
    std::size_t latest = 0;
    for (const std::size_t there : {count - 1, count - 500, count / 2, std::size_t{1}}) {
        const std::vector<Shape3> shapes(there, Shape3::sphere(0.1));
        const std::vector<Pose3f> poses(there);
        const auto bad = std::find_if(all.begin(), all.end(),
                                      [&](const Pair& pair) { return pair.a >= there || pair.b >= there; });
        ASSERT_NE(bad, all.end());
        const auto number = static_cast<std::size_t>(bad - all.begin());
        latest = std::max(latest, number);
        const std::string name =
            "pair " + std::to_string(number) + " names objects " + std::to_string(bad->a);
        const Error errors[] = {error_of([&] { finder.find({shapes, poses}, pairs); }),
                                error_of([&] { finder.touching({shapes, poses}, pairs, touch); })};
        for (const Error& error : errors) {
            EXPECT_EQ(std::string(error.what()).find(name), 0u) << error.what() << ", expected " << name;
            EXPECT_EQ(error.index(), bad->a >= there ? bad->a : bad->b);
        }
    }
    EXPECT_GT(latest, 50'000u);
    const std::vector<Shape3> two(2);
    const std::vector<Pose3f> poses(2);
    const auto index = [&](Pair pair) {
        return error_of([&] { finder.find({two, poses}, std::vector<Pair>{{0, 1}, pair}); }).index();
    };
    EXPECT_EQ(index({7, 1}), 7u);
    EXPECT_EQ(index({1, 8}), 8u);
    EXPECT_EQ(index({9, 8}), 9u);
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
    const auto expected = plain.find({zoo.shapes, poses}, pairs).to_vector();
    const auto is_own = [&](const Contact<3, float>& contact) {
        const ShapeType a = zoo.shapes[contact.pair.a].type(), b = zoo.shapes[contact.pair.b].type();
        return std::min(a, b) == ShapeTypes::capsule && std::max(a, b) == ShapeTypes::box;
    };
    std::size_t next = 0, left_out = 0;
    for (const Contact<3, float>& contact : own.find({zoo.shapes, poses}, pairs)) {
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
    for (const ShapeType type : {ShapeTypes::end, ShapeType{15}}) {
        PairTest<3> bad = nothing;
        bad.type_b = type;
        EXPECT_NE(
            std::string(error_of([&] { own.add_test(bad); }).what()).find("type " + std::to_string(type)),
            std::string::npos);
    }
}

/// Bits of everything but which pair it is.
template <class ContactType>
bool same(const ContactType& x, const ContactType& y)
{
    bool equal = x.normal == y.normal && x.count == y.count && x.part_a == y.part_a && x.part_b == y.part_b;
    for (std::uint32_t i = 0; i < x.count; ++i)
        equal = equal && x.point[i].from_a == y.point[i].from_a && x.point[i].from_b == y.point[i].from_b &&
                x.point[i].depth == y.point[i].depth && x.point[i].feature == y.point[i].feature;
    return equal;
}

/// Every call with one set of objects, and with a split of it in two; with pairs in all kinds of memory.
TEST(ContactFinder, TwoSetsAnswerAsOneDoes)
{
    Random random(4);
    const Zoo<3> zoo(random, 12);
    std::vector<Pose3f> poses;
    std::vector<Motion<3, float>> motions;
    std::vector<Aabb3f> boxes;
    for (const Shape3& shape : zoo.shapes) {
        poses.push_back(random.pose<float>(2));
        motions.push_back({poses.back(), {1, 2, 3}, {}});
        boxes.push_back(bounds(shape, poses.back(), 0.5));
    }
    const std::size_t half = boxes.size() / 2;
    const auto first = [half](const auto& all) { return std::span(all).first(half); };
    const auto second = [half](const auto& all) { return std::span(all).subspan(half); };
    const PairBuffer pairs = find_pairs(first(boxes), second(boxes));
    ASSERT_GT(pairs.size(), 700u); // more than one block of work
    std::vector<Pair> joined;
    for (const Pair& pair : pairs)
        joined.push_back({pair.a, pair.b + static_cast<std::uint32_t>(half)});
    const std::pmr::vector<Pair> other(pairs.begin(), pairs.end());

    ContactFinder3f finder;
    const auto expected = finder.find({zoo.shapes, poses}, joined, 0.1f).to_vector();
    ASSERT_GT(expected.size(), 200u);
    for (const PairView view : {PairView(pairs), PairView(other)}) {
        const auto found =
            finder.find({first(zoo.shapes), first(poses)}, {second(zoo.shapes), second(poses)}, view, 0.1f)
                .to_vector();
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
            ASSERT_TRUE(same(found[i], expected[i])) << i;
            ASSERT_EQ(found[i].pair.b + half, expected[i].pair.b);
        }
    }
    std::vector<std::uint8_t> touch(pairs.size(), 2), touch2(pairs.size(), 3);
    finder.touching({zoo.shapes, poses}, joined, touch);
    finder.touching({first(zoo.shapes), first(poses)}, {second(zoo.shapes), second(poses)}, pairs, touch2);
    EXPECT_EQ(touch, touch2);
    std::vector<Distance<3, float>> distance(pairs.size()), distance2(pairs.size());
    finder.distances({zoo.shapes, poses}, joined, 9, distance);
    finder.distances({first(zoo.shapes), first(poses)}, {second(zoo.shapes), second(poses)}, pairs, 9,
                     distance2);
    for (auto& motion : motions) // half-spaces turn nothing, and nothing turns
        motion.linear[0] += random.chance(0.5) ? 1.0f : -1.0f;
    std::vector<Impact<3, float>> impact(pairs.size()), impact2(pairs.size());
    finder.impacts({zoo.shapes, motions}, joined, 0.01f, impact);
    finder.impacts({first(zoo.shapes), first(motions)}, {second(zoo.shapes), second(motions)}, other, 0.01f,
                   impact2);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        ASSERT_EQ(distance[i].distance, distance2[i].distance);
        ASSERT_EQ(impact[i].time, impact2[i].time);
        ASSERT_EQ(impact[i].from_b, impact2[i].from_b);
    }
    EXPECT_EQ(finder.find({zoo.shapes, poses}, std::vector<Pair>{}).size(), 0u);
    EXPECT_EQ(finder.find({zoo.shapes, poses}, PairBuffer()).size(), 0u);
    const Error error = error_of([&] {
        finder.find({first(zoo.shapes), first(poses)}, {second(zoo.shapes), first(poses).first(3)}, pairs);
    });
    EXPECT_EQ(error.code(), ErrorCode::size_mismatch);
}

/// Members of structs as they lie there, by a name of their own or in place.
TEST(ContactFinder, TakesObjectsFromMembersOfStructs)
{
    struct Body
    {
        Shape3 shape;
        Pose3f pose;
        Motion3f motion;
    };
    const Shape3 ball = Shape3::sphere(1);
    const std::vector<Body> bodies = {{ball, {}, {}}, {ball, {{1, 0, 0}}, {{{9, 0, 0}}, {-8, 0, 0}, {}}}};
    const std::span all(bodies);
    const std::vector<Pair> pairs = {{0, 1}};
    const Objects3f objects{{all, &Body::shape}, {all, &Body::pose}};
    ContactFinder3f finder;
    EXPECT_EQ(finder.find(objects, pairs).size(), 1u);
    EXPECT_EQ(finder.find_points(objects, objects, pairs).size(), 1u);
    EXPECT_EQ(finder.find({{all, &Body::shape}, {all, &Body::pose}}, pairs).size(), 1u);
    Impact3f impact[1];
    finder.impacts({{all, &Body::shape}, {all, &Body::motion}}, pairs, 0.001f, impact);
    EXPECT_NEAR(impact[0].time, 7.0f / 8, 0.001f);
    Aabb3f boxes[2];
    bounds(objects, boxes);
    EXPECT_EQ(boxes[1].lo, bounds(ball, bodies[1].pose).lo);
    EXPECT_THROW((void)finder.find(objects, std::vector<Pair>{{1, 1}}), Error) << "one set is no two";
}

/// Lengths of whatever type beside poses of any: they compile.
TEST(OnePair, TakesLengthsOfAnyType)
{
    const Shape3 ball = Shape3::sphere(1);
    const Pose3f here{}, there{{2.01f, 0, 0}};
    EXPECT_EQ(contacts(ball, here, ball, there, 0.25).size(), 1u);
    EXPECT_TRUE(distance(ball, Pose3d{}, ball, Pose3d{{9, 0, 0}}, INFINITY));
    EXPECT_TRUE(time_of_impact(ball, Motion<3, float>{here, {1, 0, 0}, {}}, ball,
                               Motion<3, float>{there, {}, {}}, 0.0078125));
    EXPECT_NEAR(bounds(ball, here, 0.5).lo[0], -1.5f, 1e-6);
    const std::array<Shape3, 2> shapes = {ball, ball};
    const Pose3f poses[] = {here, there};
    Aabb3f boxes[2], others[2];
    std::array<Aabb3f, 2> more;
    bounds({shapes, poses}, boxes, 1);
    bounds({shapes, poses}, more, 1.0);
    bounds({shapes, poses}, std::span(others), 1);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(boxes[i].hi[1], 2, 1e-6);
        EXPECT_NEAR(more[i].hi[1], 2, 1e-6);
        EXPECT_NEAR(others[i].hi[1], 2, 1e-6);
    }
}

// A batch of nothing but circles goes a way of its own, and so do two circles.
TEST(ContactFinder, CirclesAnswerAsTheGeneralWayDoes)
{
    Random random(9);
    std::vector<Shape2> circles;
    std::vector<Pose2d> poses;
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 300; ++i) {
        circles.push_back(Shape2::sphere(random.chance(0.1) ? 0 : random.uniform(0, 0.2)));
        poses.push_back(random.pose2<double>(1));
        if (random.chance(0.2)) poses.back().position[0] = 0.5; // beside or above each other
        for (std::uint32_t k = 0; k < i; ++k)
            pairs.push_back(random.chance(0.5) ? Pair{k, i} : Pair{i, k});
    }
    ContactFinder2d finder;
    std::size_t next = 0;
    const auto found = finder.find({circles, poses}, pairs, 0.01).to_vector();
    for (const Pair& pair : pairs) {
        const auto one = contacts(circles[pair.a], poses[pair.a], circles[pair.b], poses[pair.b], 0.01);
        const Vec2d way = poses[pair.b].position - poses[pair.a].position;
        const double gap = std::hypot(way[0], way[1]) - circles[pair.a].radius() - circles[pair.b].radius();
        ASSERT_EQ(one.size(), gap <= 0.01 ? 1u : 0u);
        if (one.empty()) continue;
        ASSERT_TRUE(next < found.size() && found[next].pair == pair && same(found[next], one[0]));
        ++next;
        const auto turned = contacts(circles[pair.b], poses[pair.b], circles[pair.a], poses[pair.a], 0.01);
        ASSERT_EQ(turned[0].normal, -one[0].normal);
        ASSERT_EQ(turned[0].point[0].from_a, one[0].point[0].from_b);
        ASSERT_NEAR(one[0].point[0].depth, -gap, 1e-14);
        ASSERT_NEAR(jostle::dot(one[0].normal, way), std::hypot(way[0], way[1]), 1e-14);
    }
    EXPECT_EQ(next, found.size());
    EXPECT_GT(next, 1000u);

    // In one place they are pushed apart along y, and touch where they are.
    const auto inside = contacts(Shape2::sphere(1), poses[0], Shape2::sphere(2), poses[0]);
    EXPECT_EQ(inside.at(0).normal, (Vec2d{0, 1}));
    EXPECT_EQ(inside[0].point[0].depth, 3);

    finder.add_test({ShapeTypes::sphere, ShapeTypes::sphere,
                     [](void*, const PairTestInput<2>&, PairTest<2>::Emit) {}, nullptr});
    EXPECT_TRUE(finder.find({circles, poses}, pairs).empty());
}

/// Contacts of this frame and the last, as warm starting wants them.
TEST(ContactFinder, GivesItsResultAwayForTheOneBefore)
{
    contract::CountingMemory memory;
    Random random(6);
    const std::vector<Shape3> shapes(300, Shape3::box({0.4, 0.5, 0.6}));
    std::vector<Pose3f> poses;
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 300; ++i) {
        poses.push_back(random.pose<float>(1.5));
        for (std::uint32_t k = 0; k < i; k += 5)
            pairs.push_back({k, i});
    }
    const auto executor = make_thread_executor(1);
    ContactOptions options;
    options.executor = executor.get(), options.memory = &memory;
    ContactFinder3f finder(options);
    ContactBuffer<3, float> now(&memory), last(&memory);
    std::uint64_t before = 0, matched = 0, points = 0;
    for (int frame = 0; frame < 12; ++frame) {
        if (frame == 6) before = memory.allocations;
        for (Pose3f& pose : poses)
            pose.position[0] += frame % 2 == 0 ? 0.001f : -0.001f;
        const auto expected = finder.find({shapes, poses}, pairs).to_vector();
        finder.take(now);
        ASSERT_EQ(now.size(), expected.size());
        // Both ascend by pair: one walk through both finds last frame's point of every point.
        auto old = last.begin();
        std::size_t next = 0;
        for (const Contact<3, float>& contact : now) {
            ASSERT_TRUE(same(contact, expected[next++]));
            const auto order = [](const Pair& pair) { return Pair{pair.b, pair.a}; };
            while (old != last.end() && order(old->pair) < order(contact.pair))
                ++old;
            points += contact.count;
            if (old == last.end() || old->pair != contact.pair) continue;
            for (std::uint32_t i = 0; i < contact.count; ++i)
                for (std::uint32_t k = 0; k < old->count; ++k)
                    matched += contact.point[i].feature == old->point[k].feature ? 1 : 0;
        }
        if (frame == 3 || frame == 7) { // nothing is left of what was taken, nor of what was given
            finder.take(last);
            EXPECT_TRUE(last.empty());
        }
        std::swap(now, last);
    }
    EXPECT_EQ(memory.allocations, before);
    EXPECT_GT(matched * 10, points * 8);
    EXPECT_GT(points, 10'000u);
    last.release();
    EXPECT_TRUE(finder.find({shapes, poses}, std::vector<Pair>{}).empty());
    finder.take(last);
    EXPECT_TRUE(last.empty());
    ContactBuffer<3, float>& self = now;
    now = std::move(self);
    EXPECT_FALSE(now.empty());
}

/// Of each contact the first point, to the bit; blocks of balls alone take a way of their own.
template <int Dim, class T>
void points_are_the_deepest_of_contacts(bool balls)
{
    Random random(71);
    const Zoo<Dim> zoo(random, 6);
    std::vector<Shape<Dim>> shapes;
    std::vector<Pose<Dim, T>> poses;
    for (int i = 0; i < 500; ++i) {
        shapes.push_back(balls ? Shape<Dim>::sphere(random.chance(0.1) ? 0 : random.uniform(0.1, 1))
                               : zoo.any(random));
        poses.push_back(random_pose<Dim, T>(random, random.chance(0.1) ? 0 : 2));
    }
    if (!balls)
        for (int i = 0; i < 300; ++i) // some blocks have nothing but balls
            shapes[static_cast<std::size_t>(i)] = Shape<Dim>::sphere(0.5);
    std::vector<Pair> pairs;
    for (std::uint32_t i = 0; i < 3000; ++i) {
        const std::uint32_t most = i < 1500 ? 300 : 500, a = random.below(most), b = random.below(most);
        if (a != b) pairs.push_back({a, b});
    }
    for (const T margin : {T(0), T(0.25)})
        for (const unsigned threads : {1u, 3u}) {
            const auto executor = make_thread_executor(threads);
            ContactOptions options;
            options.executor = executor.get();
            ContactFinder<Dim, T> finder(options);
            const auto whole = finder.find({shapes, poses}, pairs, margin).to_vector();
            const auto points = finder.find_points({shapes, poses}, pairs, margin).to_vector();
            ASSERT_EQ(whole.size(), points.size());
            EXPECT_GT(whole.size(), 100u);
            for (std::size_t i = 0; i < whole.size(); ++i) {
                ASSERT_EQ(whole[i].pair.a, points[i].pair.a);
                ASSERT_EQ(whole[i].pair.b, points[i].pair.b);
                ASSERT_EQ(whole[i].part_a, points[i].part_a);
                ASSERT_EQ(whole[i].part_b, points[i].part_b);
                ASSERT_EQ(whole[i].normal, points[i].normal);
                ASSERT_EQ(whole[i].point[0].from_a, points[i].from_a);
                ASSERT_EQ(whole[i].point[0].from_b, points[i].from_b);
                ASSERT_EQ(whole[i].point[0].depth, points[i].depth);
                ASSERT_EQ(whole[i].point[0].feature, points[i].feature);
                // The single pair's answer knows no blocks.
                const auto single = contacts(shapes[points[i].pair.a], poses[points[i].pair.a],
                                             shapes[points[i].pair.b], poses[points[i].pair.b], margin);
                ASSERT_FALSE(single.empty());
                const auto same = [&](const Contact<Dim, T>& one) {
                    return one.normal == points[i].normal && one.point[0].from_a == points[i].from_a &&
                           one.point[0].depth == points[i].depth;
                };
                ASSERT_TRUE(std::any_of(single.begin(), single.end(), same));
            }
            PointContactBuffer<Dim, T> taken;
            finder.take(taken);
            EXPECT_EQ(taken.size(), points.size());
        }
}

TEST(PointContacts, AreTheDeepestPointsOfContacts)
{
    points_are_the_deepest_of_contacts<3, float>(false);
    points_are_the_deepest_of_contacts<3, double>(false);
    points_are_the_deepest_of_contacts<2, float>(false);
    points_are_the_deepest_of_contacts<3, float>(true);
    points_are_the_deepest_of_contacts<3, double>(true);
    points_are_the_deepest_of_contacts<2, double>(true);
    EXPECT_EQ(sizeof(PointContact<3, float>), 60u);
}

} // namespace
