// SPDX-License-Identifier: MIT
// Rays, moving shapes and distances against all shapes of a World or a BoxIndex, beside a loop over them.
#include "jostle/shape_query.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <numeric>
#include <optional>

#include "tests/narrow/random_pairs.hpp"

using namespace jostle;

namespace {

template <int Dim, class T>
Vec<Dim, T> random_vector(Random& random, double spread)
{
    Vec<Dim, T> v;
    for (T& x : v)
        x = static_cast<T>(random.chance(0.2) ? std::round(random.uniform(-spread, spread))
                                              : random.uniform(-spread, spread));
    return v;
}

/// Some of all shapes, many of them twice in the same place, in a World and in an index with ids of its own.
template <int Dim, class T>
struct Scene
{
    Scene(Random& random, double spread) : zoo(random, 2)
    {
        for (const Shape<Dim>& shape : zoo.shapes) {
            shapes.push_back(shape);
            poses.push_back(random_pose<Dim, T>(random, spread));
            if (random.chance(0.4)) {
                shapes.push_back(shapes[random.below(static_cast<std::uint32_t>(shapes.size()))]);
                poses.push_back(poses[random.below(static_cast<std::uint32_t>(poses.size()))]);
            }
        }
        boxes.resize(shapes.size());
        bounds({shapes, poses}, boxes);
        ids.resize(boxes.size());
        world.add(boxes, ids);
        world.update();
        // Descending, with gaps: no order that the index was filled in may show.
        for (std::size_t i = 0; i < boxes.size(); ++i)
            numbers.push_back(static_cast<std::uint32_t>(3 * (boxes.size() - i)));
        index.build(numbers, boxes);
    }
    [[nodiscard]] PosedShape<Dim, T> of_number(std::uint32_t id) const
    {
        const std::size_t i = boxes.size() - id / 3;
        return {shapes[i], poses[i]};
    }

    Zoo<Dim> zoo;
    std::vector<Shape<Dim>> shapes;
    std::vector<Pose<Dim, T>> poses;
    std::vector<Aabb<Dim, T>> boxes;
    std::vector<ObjectId> ids;
    std::vector<std::uint32_t> numbers;
    std::unique_ptr<Executor> threads = make_thread_executor(3);
    World<Dim, T> world{{.executor = threads.get()}};
    BoxIndex<Dim, T> index{{.executor = threads.get()}};
};

template <int Dim, class T>
std::optional<CastHit<Dim, T>> cast_one(const Ray<Dim, T>& ray, const Shape<Dim>& shape,
                                        const Pose<Dim, T>& pose)
{
    return ray_cast(shape, pose, ray);
}
template <int Dim, class T>
std::optional<CastHit<Dim, T>> cast_one(const ShapeSweep<Dim, T>& sweep, const Shape<Dim>& shape,
                                        const Pose<Dim, T>& pose)
{
    return shape_cast(sweep.shape, sweep.pose, sweep.displacement, shape, pose);
}

/// The definition: every shape, sorted by (fraction, id).
template <class Id, int Dim, class T, class Question>
std::vector<ShapeHit<Dim, T, Id>> loop(const Scene<Dim, T>& scene, const std::vector<Id>& ids,
                                       const Question& question)
{
    std::vector<ShapeHit<Dim, T, Id>> all;
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (const auto hit = cast_one(question, scene.shapes[i], scene.poses[i])) {
            all.emplace_back();
            static_cast<CastHit<Dim, T>&>(all.back()) = *hit;
            all.back().id = ids[i];
        }
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
        return a.fraction != b.fraction ? a.fraction < b.fraction : a.id < b.id;
    });
    return all;
}
template <class Hit>
bool same(const Hit& a, const Hit& b)
{
    return a.id == b.id && a.fraction == b.fraction && a.normal == b.normal && a.point == b.point &&
           a.part == b.part && a.moving_part == b.moving_part;
}
template <class Hits, class Expected>
bool same_lists(const Hits& hits, const Expected& expected)
{
    return std::equal(hits.begin(), hits.end(), expected.begin(), expected.end(),
                      [](const auto& a, const auto& b) { return same(a, b); });
}

template <int Dim, class T>
Ray<Dim, T> random_ray(Random& random)
{
    Ray<Dim, T> ray{random_vector<Dim, T>(random, 6), {}, std::numeric_limits<T>::infinity()};
    while (ray.direction == Vec<Dim, T>{})
        ray.direction = random.chance(0.6) ? random_vector<Dim, T>(random, 2) - ray.origin
                                           : random_vector<Dim, T>(random, 2);
    if (random.chance(0.4)) ray.max_fraction = static_cast<T>(random.uniform(0, 2));
    return ray;
}
template <int Dim, class T>
ShapeSweep<Dim, T> random_sweep(Random& random, const Zoo<Dim>& zoo)
{
    ShapeSweep<Dim, T> sweep{zoo.any(random), random_pose<Dim, T>(random, 6), {}};
    if (random.chance(0.9)) sweep.displacement = random_vector<Dim, T>(random, 6);
    return sweep;
}

std::uint32_t number_of(std::uint32_t id)
{
    return id;
}
std::uint32_t number_of(ObjectId id)
{
    return id.index;
}

std::size_t counted_hits, counted_misses, counted_ties;

/// One question to everything, in every form.
template <class Asked, class Id, int Dim, class T, class Question>
void ask_in_every_form(const Asked& asked, const PosedShapes<Dim, T>& objects, const Scene<Dim, T>& scene,
                       const std::vector<Id>& ids, const Question& question, std::uint64_t some)
{
    const auto all = loop(scene, ids, question);
    const auto first = asked.first(question, objects);
    ASSERT_EQ(first.has_value(), !all.empty());
    (first ? counted_hits : counted_misses) += 1;
    if (first) {
        ASSERT_TRUE(same(*first, all.front()));
    }
    if (all.size() > 1 && all[0].fraction == all[1].fraction) ++counted_ties;
    std::vector<ShapeHit<Dim, T, Id>> hits(3); // are forgotten
    ASSERT_FALSE(asked.all(question, objects, hits));
    ASSERT_TRUE(same_lists(hits, all));
    ASSERT_EQ(asked.all(question, objects, hits, {}, some), all.size() > some);
    ASSERT_TRUE(same_lists(hits, std::span(all).first(std::min<std::size_t>(some, all.size()))));

    ASSERT_EQ(asked.count(question, objects), all.size());
    ASSERT_EQ(asked.any(question, objects), !all.empty());

    // Handed over: all, as many as are wanted, and none beyond the one that is number `some`.
    hits.clear();
    ASSERT_TRUE(asked.visit(question, objects, [&](const auto& hit, T&) {
        hits.push_back(hit);
        return true;
    }));
    ASSERT_TRUE(same_lists(hits, all));
    hits.clear();
    ASSERT_EQ(asked.visit(question, objects,
                          [&](const auto& hit, T&) {
                              hits.push_back(hit);
                              return hits.size() <= some;
                          }),
              all.size() <= some);
    ASSERT_TRUE(same_lists(hits, std::span(all).first(std::min<std::size_t>(some + 1, all.size()))));
    hits.clear();
    ASSERT_TRUE(asked.visit(question, objects, [&](const auto& hit, T& bound) {
        hits.push_back(hit);
        if (hits.size() == some + 1) bound = hit.fraction;
        if (hits.size() > some + 1) bound = std::numeric_limits<T>::infinity(); // has no effect
        return true;
    }));
    std::size_t wanted = std::min<std::size_t>(some + 1, all.size());
    while (wanted < all.size() && all[wanted].fraction == all[wanted - 1].fraction)
        ++wanted;
    ASSERT_TRUE(same_lists(hits, std::span(all).first(wanted)));
}

template <int Dim, class T>
void equal_a_loop(std::uint64_t seed)
{
    Random random(seed);
    counted_hits = counted_misses = counted_ties = 0;
    for (int round = 0; round < 12; ++round) {
        const Scene<Dim, T> scene(random, round % 3 == 0 ? 2 : 5);
        const PosedShapes<Dim, T> by_index(scene.shapes, scene.poses);
        const auto of = [&](std::uint32_t id) { return scene.of_number(id); };
        const PosedShapes<Dim, T> by_function(of);
        for (int k = 0; k < 60; ++k) {
            SCOPED_TRACE(testing::Message() << "round " << round << " question " << k);
            const std::uint64_t some = random.below(4);
            const Ray<Dim, T> ray = random_ray<Dim, T>(random);
            const ShapeSweep<Dim, T> sweep = random_sweep<Dim, T>(random, scene.zoo);
            ask_in_every_form(scene.world, by_index, scene, scene.ids, ray, some);
            ask_in_every_form(scene.index, by_function, scene, scene.numbers, ray, some);
            ask_in_every_form(scene.world, by_index, scene, scene.ids, sweep, some);
            ask_in_every_form(scene.index, by_function, scene, scene.numbers, sweep, some);
            if (testing::Test::HasFatalFailure()) return;
        }
    }
    EXPECT_GT(counted_hits, 1000u);
    EXPECT_GT(counted_misses, 20u);
    EXPECT_GT(counted_ties, 100u);
}
TEST(ShapeQuery, EqualsALoopOverAllShapes)
{
    equal_a_loop<3, double>(1);
    equal_a_loop<3, float>(2);
}
TEST(ShapeQuery, EqualsALoopOverAllShapesInThePlane)
{
    equal_a_loop<2, double>(3);
    equal_a_loop<2, float>(4);
}

constexpr std::uint32_t everything = ~0u; // as a count

template <int Dim, class T>
void nearest_equals_a_loop(std::uint64_t seed)
{
    Random random(seed);
    std::size_t apart = 0, overlapping = 0, none = 0;
    for (int round = 0; round < 12; ++round) {
        const Scene<Dim, T> scene(random, round % 3 == 0 ? 2 : 8);
        for (int k = 0; k < 60; ++k) {
            SCOPED_TRACE(testing::Message() << "round " << round << " question " << k);
            NearestToShape<Dim, T> question{scene.zoo.any(random), random_pose<Dim, T>(random, 20),
                                            everything};
            if (random.chance(0.7)) question.shape = Shape<Dim>();
            if (random.chance(0.3)) question.max_distance = static_cast<T>(random.uniform(0, 1));
            if (random.chance(0.1)) question.max_distance = static_cast<T>(1e-30);
            ShapeDistance<Dim, T> best{};
            bool any = false;
            std::vector<std::pair<T, ObjectId>> all; // by distance, then id
            for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
                const auto found = distance(question.shape, question.pose, scene.shapes[i], scene.poses[i],
                                            question.max_distance);
                if (found) all.emplace_back(found->distance, scene.ids[i]);
                if (!found || (any && found->distance >= best.distance)) continue;
                static_cast<Distance<Dim, T>&>(best) = *found;
                best.id = scene.ids[i];
                any = true;
            }
            std::sort(all.begin(), all.end());
            const std::size_t count = all.size();
            std::vector<std::pair<T, ObjectId>> given;
            ASSERT_TRUE(scene.world.visit(question, {scene.shapes, scene.poses}, [&](const auto& found, T&) {
                given.emplace_back(found.distance, found.id);
                return true;
            }));
            ASSERT_EQ(given, all);
            const std::size_t few = std::min<std::size_t>(3, all.size());
            given.clear();
            ASSERT_EQ(scene.world.visit(question, {scene.shapes, scene.poses},
                                        [&](const auto& found, T&) {
                                            given.emplace_back(found.distance, found.id);
                                            return given.size() < 3;
                                        }),
                      all.size() < 3);
            ASSERT_TRUE(std::equal(given.begin(), given.end(), all.begin(),
                                   all.begin() + static_cast<std::ptrdiff_t>(few)));
            given.clear(); // those as near as the first, or nearer than half a unit beyond it
            ASSERT_TRUE(
                scene.world.visit(question, {scene.shapes, scene.poses}, [&](const auto& found, T& bound) {
                    bound = std::min(bound, all[0].first + T(0.5));
                    given.emplace_back(found.distance, found.id);
                    return true;
                }));
            std::erase_if(all, [&](const auto& one) { return one.first > best.distance + T(0.5); });
            ASSERT_EQ(given, all);
            const auto answer = scene.world.nearest(question, {scene.shapes, scene.poses});
            ASSERT_EQ(answer.has_value(), any);
            const auto of_index =
                scene.index.nearest(question, [&](std::uint32_t id) { return scene.of_number(id); });
            ASSERT_EQ(of_index.has_value(), any);
            question.count = 2;
            std::vector<ShapeDistance<Dim, T>> two(5); // are forgotten
            scene.world.nearest(question, {scene.shapes, scene.poses}, two);
            ASSERT_EQ(two.size(), std::min<std::size_t>(2, count));
            if (any) {
                ASSERT_EQ(two[0].id, best.id);
            }
            question.count = 0;
            ASSERT_FALSE(scene.world.nearest(question, {scene.shapes, scene.poses}));
            scene.world.nearest(question, {scene.shapes, scene.poses}, two);
            ASSERT_TRUE(two.empty());
            (!any ? none : best.distance > 0 ? apart : overlapping) += 1;
            if (!any) continue;
            ASSERT_EQ(answer->distance, best.distance);
            ASSERT_EQ(answer->id, best.id);
            ASSERT_EQ(answer->normal, best.normal);
            ASSERT_EQ(answer->from_a, best.from_a);
            ASSERT_EQ(answer->from_b, best.from_b);
            ASSERT_EQ(of_index->distance, best.distance);
        }
    }
    EXPECT_GT(apart, 60u);
    EXPECT_GT(overlapping, 50u);
    EXPECT_GT(none, 10u);
}
TEST(ShapeQuery, NearestIsThatOfALoop)
{
    nearest_equals_a_loop<3, double>(5);
    nearest_equals_a_loop<3, float>(6);
    nearest_equals_a_loop<2, double>(7);
    nearest_equals_a_loop<2, float>(8);
}

/// Batches on several threads, with filters of each question's own.
template <int Dim, class T, class Asked, class Filter, class Id>
void batches_equal_one_by_one(Random& random, const Scene<Dim, T>& scene, const Asked& asked,
                              const PosedShapes<Dim, T>& objects, const std::vector<Id>& ids)
{
    std::vector<Ray<Dim, T>> rays(150);
    std::vector<ShapeSweep<Dim, T>> sweeps(150);
    std::vector<NearestToShape<Dim, T>> near(150);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        rays[i] = random_ray<Dim, T>(random);
        sweeps[i] = random_sweep<Dim, T>(random, scene.zoo);
        near[i] = {scene.zoo.any(random), random_pose<Dim, T>(random, 9)};
    }
    std::vector<Filter> filters(rays.size());
    const auto odd = [](std::uint32_t question, auto id) { return (question + number_of(id)) % 2 == 1; };
    for (std::size_t i = 0; i < filters.size(); ++i) {
        filters[i].exclude = ids[i % ids.size()];
        if (i % 3 == 0) filters[i].accept = odd;
    }
    const auto check = [&](const auto& questions, const auto& wanted, const auto& given) {
        using Found = ShapeHit<Dim, T, Id>;
        std::vector<Found> first(questions.size());
        ResultLists<Found> lists;
        asked.first(questions, objects, first, given);
        asked.all(questions, objects, lists, given, 2);
        ASSERT_EQ(lists.size(), questions.size());
        std::size_t more = 0;
        for (std::size_t i = 0; i < questions.size(); ++i) {
            Filter filter = wanted(i);
            const auto numbered = [&](std::uint32_t, auto id) {
                return odd(static_cast<std::uint32_t>(i), id);
            };
            if (filter.accept) filter.accept = numbered;
            std::vector<Found> all;
            const bool has_more = asked.all(questions[i], objects, all, filter, 2);
            ASSERT_TRUE(same_lists(lists[i], all)) << i;
            ASSERT_EQ(lists.more(i), has_more);
            more += has_more ? 1 : 0;
            if (all.empty()) {
                ASSERT_EQ(first[i].fraction, std::numeric_limits<T>::infinity());
                ASSERT_EQ(first[i].id, (Hit<T, Id>::none));
            } else {
                ASSERT_TRUE(same(first[i], all.front())) << i;
            }
        }
        ASSERT_GT(more, 0u);
    };
    check(rays, [&](std::size_t i) { return filters[i]; }, filters);
    check(sweeps, [&](std::size_t i) { return filters[i]; }, filters);
    check(rays, [&](std::size_t) { return filters[3]; }, filters[3]);
    check(rays, [&](std::size_t) { return Filter{}; }, Filter{});
    std::vector<ShapeDistance<Dim, T, Id>> nearest(near.size());
    asked.nearest(near, objects, nearest, filters);
    for (std::size_t i = 0; i < near.size(); ++i) {
        Filter filter = filters[i];
        const auto numbered = [&](std::uint32_t, auto id) { return odd(static_cast<std::uint32_t>(i), id); };
        if (filter.accept) filter.accept = numbered;
        const auto one = asked.nearest(near[i], objects, filter);
        ASSERT_EQ(one.has_value(), nearest[i].distance < std::numeric_limits<T>::infinity());
        ASSERT_EQ(nearest[i].id, one ? one->id : (Hit<T, Id>::none));
        if (one) {
            ASSERT_EQ(nearest[i].distance, one->distance);
        }
    }
    for (auto& each : near)
        each.count = 3;
    ResultLists<ShapeDistance<Dim, T, Id>> lists;
    asked.nearest(near, objects, lists, filters[0]);
    for (std::size_t i = 0; i < near.size(); ++i) {
        Filter filter = filters[0];
        const auto numbered = [&](std::uint32_t, auto id) { return odd(static_cast<std::uint32_t>(i), id); };
        filter.accept = numbered;
        std::vector<ShapeDistance<Dim, T, Id>> three;
        asked.nearest(near[i], objects, three, filter);
        ASSERT_EQ(lists[i].size(), three.size());
        for (std::size_t k = 0; k < three.size(); ++k)
            ASSERT_EQ(lists[i][k].id, three[k].id);
    }
    asked.first(std::vector<Ray<Dim, T>>(), objects, std::span<ShapeHit<Dim, T, Id>>());
}
TEST(ShapeQuery, BatchesGiveWhatSingleQuestionsDo)
{
    Random random(9);
    for (int round = 0; round < 3; ++round) {
        const Scene<3, float> scene(random, 4);
        const auto of = [&](std::uint32_t id) { return scene.of_number(id); };
        batches_equal_one_by_one<3, float, World3f, ObjectQueryFilter>(
            random, scene, scene.world, {scene.shapes, scene.poses}, scene.ids);
        batches_equal_one_by_one<3, float, BoxIndex3f, QueryFilter>(random, scene, scene.index, of,
                                                                    scene.numbers);
    }
}

/// What touches a shape that stays, in every form, beside touching() of all.
template <int Dim, class T, class Asked, class Id>
void touched_equals_a_loop(Random& random, const Scene<Dim, T>& scene, const Asked& asked,
                           const PosedShapes<Dim, T>& objects, const std::vector<Id>& ids, std::size_t& found)
{
    std::vector<PosedShape<Dim, T>> questions;
    for (int k = 0; k < 40; ++k)
        questions.push_back({scene.zoo.any(random), random_pose<Dim, T>(random, 5)});
    ResultLists<Id> lists;
    std::vector<std::uint8_t> any(questions.size());
    std::vector<std::uint64_t> counts(questions.size());
    asked.all(questions, objects, lists, {}, 2);
    asked.any(questions, objects, any);
    asked.count(questions, objects, counts);
    for (std::size_t k = 0; k < questions.size(); ++k) {
        const PosedShape<Dim, T>& question = questions[k];
        std::vector<Id> expected;
        for (std::size_t i = 0; i < ids.size(); ++i)
            if (touching(question.shape, question.pose, scene.shapes[i], scene.poses[i]))
                expected.push_back(ids[i]);
        std::sort(expected.begin(), expected.end());
        found += expected.size();
        std::vector<Id> given(3); // are forgotten
        ASSERT_FALSE(asked.all(question, objects, given));
        ASSERT_EQ(given, expected);
        ASSERT_EQ(asked.count(question, objects), expected.size());
        ASSERT_EQ(asked.any(question, objects), !expected.empty());
        given.clear();
        ASSERT_TRUE(asked.visit(question, objects, [&](Id id) { return given.push_back(id), true; }));
        std::sort(given.begin(), given.end());
        ASSERT_EQ(given, expected);
        std::size_t calls = 0;
        ASSERT_EQ(asked.visit(question, objects, [&](Id) { return ++calls, false; }), expected.empty());
        ASSERT_EQ(calls, expected.empty() ? 0u : 1u) << "none after it has said stop";
        ASSERT_EQ(any[k] != 0, !expected.empty());
        ASSERT_EQ(counts[k], expected.size());
        ASSERT_EQ(lists.more(k), expected.size() > 2);
        expected.resize(std::min<std::size_t>(expected.size(), 2));
        ASSERT_TRUE(std::equal(lists[k].begin(), lists[k].end(), expected.begin(), expected.end()));
    }
}
template <int Dim, class T>
void touched_equals_a_loop(std::uint64_t seed)
{
    Random random(seed);
    std::size_t found = 0;
    for (int round = 0; round < 6; ++round) {
        const Scene<Dim, T> scene(random, 5);
        touched_equals_a_loop<Dim, T>(random, scene, scene.world, {scene.shapes, scene.poses}, scene.ids,
                                      found);
        const auto of = [&](std::uint32_t id) { return scene.of_number(id); };
        touched_equals_a_loop<Dim, T>(random, scene, scene.index, of, scene.numbers, found);
    }
    EXPECT_GT(found, 300u);
}
TEST(ShapeQuery, WhatTouchesAShapeIsThatOfALoop)
{
    touched_equals_a_loop<3, double>(12);
    touched_equals_a_loop<3, float>(13);
    touched_equals_a_loop<2, double>(14);
    touched_equals_a_loop<2, float>(15);
}

TEST(ShapeQuery, VisitorsMayNotMakeTheBoundNaN)
{
    World3d world;
    const std::vector<Shape3> shapes(1, Shape3::sphere(1));
    const std::vector<Pose3d> poses(1);
    const ObjectId id = world.add(bounds(shapes[0], poses[0]));
    world.update();
    const auto spoil = [](const auto&, double& bound) {
        bound = std::numeric_limits<double>::quiet_NaN();
        return true;
    };
    const auto expect = [&](const auto& ask) {
        try {
            ask();
            FAIL() << "it was accepted";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::nan_coordinate);
            EXPECT_EQ(error.index(), id.index);
        }
    };
    expect([&] { world.visit(Ray3d{{-5, 0, 0}, {1, 0, 0}}, {shapes, poses}, spoil); });
    expect([&] { world.visit(NearestToShape<3, double>{Shape3(), {}}, {shapes, poses}, spoil); });
}

/// Two that are equally near: the one of the greater id is visited first, because its box is larger, and
/// rounding often puts the other's box behind where its shape is.
TEST(ShapeQuery, WhatRoundingPutsBehindIsAskedToo)
{
    Random random(11);
    const std::vector<Shape3> shapes(2, Shape3::box({1, 1, 1}));
    std::size_t behind = 0;
    for (int k = 0; k < 2000; ++k) {
        const auto number = [&](double most) { return static_cast<float>(random.uniform(0, most)); };
        std::vector<Pose3f> poses(2);
        // A box of the user's own that fits to the last bit; those of bounds() are an ulp larger.
        const float x = std::round(1024 * (10 + number(100))) / 1024;
        poses[0].position = poses[1].position = {x, 0, 0};
        const std::vector<Aabb3f> boxes = {{{x - 1, -1, -1}, {x + 1, 1, 1}},
                                           {{x - 2, -2, -2}, {x + 2, 2, 2}}};
        BoxIndex3f index;
        index.build(boxes);
        const Ray3f ray{{number(5), 0, 0}, {0.1f + number(20), 0, 0}};
        const PosedShapes<3, float> objects(shapes, poses);
        const auto hit = index.first(ray, objects);
        ASSERT_TRUE(hit);
        ASSERT_EQ(hit->id, 0u);
        behind += *hit_fraction(ray, boxes[0]) > hit->fraction ? 1 : 0;
        std::vector<BoxIndex3f::FoundShape> hits;
        ASSERT_TRUE(index.all(ray, objects, hits, {}, 1));
        ASSERT_EQ(hits.front().id, 0u);
        Ray3f ends = ray;
        ends.max_fraction = hit->fraction;
        const bool in_reach = ray_cast(shapes[0], poses[0], ends).has_value(); // if that wasn't rounded down
        ASSERT_EQ(index.first(ends, objects).has_value(), in_reach);
        const ShapeSweep<3, float> sweep{Shape3(), {ray.origin}, {200, 0, 0}};
        const auto swept = index.first(sweep, objects);
        ASSERT_TRUE(swept);
        ASSERT_EQ(swept->id, 0u);
        const auto near = index.nearest(NearestToShape<3, float>{Shape3(), {ray.origin}}, objects);
        ASSERT_TRUE(near);
        ASSERT_EQ(near->id, 0u);
    }
    EXPECT_GT(behind, 200u);
}

/// Layers and owners are those of the world's other questions.
TEST(ShapeQuery, FiltersLeaveObjectsOut)
{
    World3d world;
    const std::vector<Shape3> shapes(3, Shape3::sphere(1));
    std::vector<Pose3d> poses(3);
    std::vector<ObjectId> ids;
    for (std::uint32_t i = 0; i < 3; ++i) {
        poses[i].position = {4.0 * (i + 1), 0, 0};
        ids.push_back(world.add(bounds(shapes[i], poses[i]), {.filter = {.category = 1U << i, .owner = i}}));
    }
    world.update();
    const Ray3d ray{{0, 0, 0}, {1, 0, 0}};
    const auto first = [&](const ObjectQueryFilter& filter) {
        const auto hit = world.first(ray, {shapes, poses}, filter);
        return hit ? hit->id : ObjectId{};
    };
    EXPECT_EQ(first({}), ids[0]);
    EXPECT_EQ(first({.mask = 4}), ids[2]);
    EXPECT_EQ(first({.owner = 0}), ids[1]);
    EXPECT_EQ(first({.mask = 3, .exclude = ids[0]}), ids[1]);
    EXPECT_EQ(first({.mask = 8}), ObjectId{});
    const auto last = world.nearest(NearestToShape<3, double>{Shape3(), {}}, {shapes, poses}, {.mask = 6});
    ASSERT_TRUE(last);
    EXPECT_EQ(last->id, ids[1]);
    EXPECT_EQ(last->distance, 7);
}

/// Boxes among which nothing is near, at the ends of the numbers, and without end.
TEST(ShapeQuery, FarAndWideShapes)
{
    Random random(10);
    for (const double unit : {1e-30, 1.0, 1e9, 1e25}) {
        std::vector<Shape3> shapes;
        std::vector<Pose3f> poses;
        for (int i = 0; i < 40; ++i) {
            shapes.push_back(i == 0   ? Shape3::half_space({0, 1, 0}, -10 * unit)
                             : i == 1 ? Shape3::box({900 * unit, 0, 900 * unit})
                                      : Shape3::sphere(unit * random.uniform(0, 1)));
            poses.push_back({random_vector<3, float>(random, 10) * static_cast<float>(unit)});
        }
        std::vector<Aabb3f> boxes(shapes.size());
        bounds({shapes, poses}, boxes);
        std::vector<ObjectId> ids(boxes.size());
        World3f world;
        world.add(boxes, ids);
        world.update();
        std::size_t hits = 0;
        for (int k = 0; k < 100; ++k) {
            Ray3f ray{random_vector<3, float>(random, 20) * static_cast<float>(unit),
                      random_vector<3, float>(random, 1) + Vec3f(0.01f, 0.02f, 0.03f)};
            const auto hit = world.first(ray, {shapes, poses});
            std::optional<CastHit3f> best;
            for (std::size_t i = 0; i < shapes.size(); ++i)
                if (const auto one = ray_cast(shapes[i], poses[i], ray))
                    if (!best || one->fraction < best->fraction) best = one;
            ASSERT_EQ(hit.has_value(), best.has_value());
            if (!hit) continue;
            ++hits;
            ASSERT_EQ(hit->fraction, best->fraction);
            ASSERT_EQ(hit->point, best->point);
        }
        EXPECT_GT(hits, 20u);
    }
}

TEST(ShapeQuery, RefusesWhatIsInvalid)
{
    const std::vector<Shape3> shapes(2, Shape3::sphere(1));
    std::vector<Pose3d> poses(2);
    poses[1].position = {8, 0, 0};
    std::vector<Aabb3d> boxes(2);
    bounds({shapes, poses}, boxes);
    BoxIndex3d index;
    index.build(boxes);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto message = [](const auto& ask) -> std::string {
        try {
            ask();
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing";
    };
    const auto has = [](const std::string& text, const char* part) {
        return text.find(part) != std::string::npos;
    };
    const PosedShapes<3, double> objects(shapes, poses);
    const auto cast = [&](const auto& question) {
        return message([&] { (void)index.first(question, objects); });
    };
    EXPECT_TRUE(has(cast(Ray3d{{nan, 0, 0}, {1, 0, 0}}), "a ray has origin nan"));
    EXPECT_TRUE(has(cast(Ray3d{{1e70, 0, 0}, {1, 0, 0}}), "within 1e60"));
    EXPECT_TRUE(has(cast(Ray3d{{0, 0, 0}, {0, 0, 0}}), "a ray has"));
    EXPECT_TRUE(has(cast(Ray3d{{0, 0, 0}, {1, 0, 0}, -1}), "max_fraction -1"));
    EXPECT_TRUE(has(cast(Ray3d{{0, 0, 0}, {1, 0, 0}, -1e-310}), "max_fraction"));
    EXPECT_TRUE(has(cast(ShapeSweep<3, double>{shapes[0], {{nan, 0, 0}}, {1, 0, 0}}), "a pose has"));
    EXPECT_TRUE(has(cast(ShapeSweep<3, double>{shapes[0], {}, {nan, 0, 0}}), "a displacement is nan"));
    EXPECT_TRUE(
        has(message([&] { (void)index.nearest(NearestToShape<3, double>{shapes[0], {}, 1, -1}, objects); }),
            "greatest distance is -1"));
    // The lowest of a batch is named.
    std::vector<Ray3d> rays(100, Ray3d{{-9, 0, 0}, {1, 0, 0}});
    rays[40].origin[1] = rays[90].origin[1] = nan;
    std::vector<BoxIndex3d::FoundShape> hits(100);
    EXPECT_TRUE(has(message([&] { index.first(rays, objects, hits); }), "query 40: a ray has"));
    ResultLists<BoxIndex3d::FoundShape> lists;
    EXPECT_TRUE(has(message([&] { index.all(rays, objects, lists); }), "query 40: a ray has"));
    rays.resize(40);
    EXPECT_TRUE(
        has(message([&] { index.first(rays, objects, hits); }), "40 queries and 100 places for answers"));
    hits.resize(40);
    EXPECT_TRUE(has(message([&] { index.first(rays, objects, hits, std::vector<QueryFilter>(3)); }),
                    "40 queries and 3 filters"));
    // What is met must be there, and valid; what isn't met isn't looked at.
    poses[1].position[0] = nan;
    const Ray3d away{{-9, 0, 0}, {-1, 0, 0}}, along{{-9, 0, 0}, {1, 0, 0}}, back{{20, 0, 0}, {-1, 0, 0}};
    EXPECT_EQ(cast(away), "nothing");
    EXPECT_EQ(cast(along), "nothing");
    EXPECT_TRUE(has(cast(back), "the pose of object 1 has position nan"));
    const std::vector<Shape3> one(1, Shape3::sphere(1));
    EXPECT_TRUE(has(message([&] { (void)index.first(back, {one, poses}); }),
                    "an object with the id 1, but there are 1 shapes and 2 poses"));
}

} // namespace
