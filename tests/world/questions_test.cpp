// SPDX-License-Identifier: MIT
// Questions to worlds that change, against a walk over all objects.
#include <atomic>
#include <thread>

#include "questions.hpp"

namespace world_tests {
namespace {

template <int Dim, class T>
void ask(std::uint64_t seed, double extent, std::size_t objects)
{
    Churn<Dim, T> churn(seed, extent, false);
    for (std::size_t k = 0; k < 3 * objects; ++k)
        churn.operate(objects);
    std::uint64_t results = 0, active = 0;
    for (int update = 0; update < 40; ++update) {
        ASSERT_TRUE(churn.update(false));
        active += churn.world->stats().active;
        Questions<Dim, T> questions(churn, seed * 1000 + static_cast<std::uint64_t>(update));
        ASSERT_TRUE(questions.agree()) << "seed " << seed << ", update " << update;
        results += questions.results;
        for (int k = 0; k < update % 4 * 5; ++k)
            churn.operate(objects);
    }
    EXPECT_GT(results, 2000u);
    EXPECT_GT(churn.world->stats().resting, 0u);
    EXPECT_GT(active, 0u);
}

TEST(Questions, AgreeWithAWalkOverAllObjects)
{
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        ask<3, float>(seed, 8, 200);
        ask<2, double>(seed, 12, 150);
    }
    ask<2, float>(4, 12, 150);
    ask<3, double>(4, 8, 200);
}

/// Many objects at rest, of which each mask leaves few; most masks are layers.
template <int Dim, class T>
void ask_masked(std::uint64_t seed, double extent, jostle::Executor& executor)
{
    constexpr std::size_t objects = 1500;
    constexpr std::uint32_t masks[][2] = {{~0u, 4}, {~0u, 2}, {4, ~0u}, {2, 6}, {~0u, 1}, {1, 4}};
    Churn<Dim, T> churn(
        seed, extent, false,
        {.executor = &executor, .layers = {{.mask = 4}, {.mask = 2}, {.category = 4}, {1, 4}}});
    churn.giants = false;
    for (std::size_t k = 0; k < 3 * objects; ++k)
        churn.operate(objects);
    for (int update = 0; update < 16; ++update)
        ASSERT_TRUE(churn.update(false));
    ASSERT_GT(churn.world->stats().resting, 1024u);
    std::uint64_t before = 0, with = 0, results = 0;
    for (int update = 0; update < 130; ++update) {
        // One mask at a time, then all by turns; then nobody asks for long.
        const bool all = update >= 24;
        if (update < 48 || update >= 126)
            for (std::uint32_t m = 0; m < (all ? std::size(masks) : 1); ++m) {
                const auto [category, mask] =
                    masks[all ? (m + static_cast<std::uint32_t>(update)) % std::size(masks)
                              : static_cast<std::uint32_t>(update) / 12];
                Questions<Dim, T> questions(churn, seed * 1000 + static_cast<std::uint64_t>(update));
                questions.only(category, mask);
                ASSERT_TRUE(questions.agree()) << "seed " << seed << ", update " << update << ", category "
                                               << category << ", mask " << mask;
                results += questions.results;
            }
        // Few, so that most stay at rest, and now and then as many as make it be built anew.
        for (int k = update % 10 == 9 ? 900 : 1 + update % 4 * 5; k > 0; --k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(false));
        if (update == 0) before = churn.world->stats().bytes_reserved;
        if (update == 47) with = churn.world->stats().bytes_reserved;
    }
    EXPECT_GT(with, before) << "there were indexes";
    EXPECT_GT(results, 2000u);
}

TEST(Questions, AboutFewByTheirMasks)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(7);
    ask_masked<3, float>(1, 16, jostle::serial_executor());
    ask_masked<2, double>(2, 50, *threads);
}

TEST(Questions, AboutFewOfManyThatMoveByTheirMasks)
{
    constexpr std::size_t objects = 4500;
    Churn<3, float> churn(11, 40, false, {.layers = {{.mask = 4}, {.mask = 2}, {.category = 4}}});
    churn.giants = false;
    for (std::size_t k = 0; k < 3 * objects; ++k)
        churn.operate(objects);
    std::uint64_t seed = 0;
    for (int update = 0; update < 64; ++update) {
        // First some that move and some that rest; then nobody speaks, and most come to rest.
        for (int k = 0; update < 9 && k < 1100; ++k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(false));
        if (update < 4) continue;
        if (update < 9) {
            ASSERT_GT(churn.world->stats().active, 1024u);
            ASSERT_GT(churn.world->stats().resting, 1024u);
        }
        for (const auto& [category, mask] : {std::pair{~0u, 4u}, {~0u, 2u}, {4u, ~0u}}) {
            Questions<3, float> questions(churn, ++seed);
            questions.only(category, mask);
            ASSERT_TRUE(questions.agree())
                << "update " << update << ", category " << category << ", mask " << mask;
        }
    }
    EXPECT_LT(churn.world->stats().active, 1024u);
}

// Of what moves a mask is about few, of what rests about most; and ahead of the update some lie elsewhere.
TEST(Questions, AboutFewOfThoseThatMoveAndMostOfThoseThatRest)
{
    jostle::World3f world({.layers = {{.mask = 2}}});
    std::vector<ObjectId> ids;
    const auto kind = [](std::size_t i) { return (i < 2000 ? i % 4 == 0 : i % 3 != 0) ? 2u : 1u; };
    const auto cube_of = [](std::size_t i, float by) {
        const float x = static_cast<float>(i % 50) + by, y = static_cast<float>(i / 50);
        return jostle::Aabb3f{{x, y, 0}, {x + 0.75f, y + 0.75f, 1}};
    };
    for (std::size_t i = 0; i < 5000; ++i) {
        jostle::ObjectOptions<float> with;
        with.filter.category = kind(i);
        ids.push_back(world.add(cube_of(i, 0), with));
    }
    std::vector<jostle::Aabb3f> regions;
    for (int k = 0; k < 100; ++k) {
        const auto x = static_cast<float>(k % 10 * 5), y = static_cast<float>(k / 10 * 10);
        regions.push_back({{x, y, 0}, {x + 7, y + 13, 1}});
    }
    const auto agree = [&] {
        jostle::ResultLists<ObjectId> found;
        world.all(regions, found, {.mask = 2});
        for (std::size_t k = 0; k < regions.size(); ++k) {
            std::vector<ObjectId> expected;
            for (std::size_t i = 0; i < ids.size(); ++i)
                if (kind(i) == 2 && overlaps(world.box(ids[i]), regions[k])) expected.push_back(ids[i]);
            if (!std::equal(found[k].begin(), found[k].end(), expected.begin(), expected.end())) return false;
        }
        return true;
    };
    for (int update = 0; update < 8; ++update) {
        for (std::size_t i = 0; i < 2000; ++i)
            world.move(ids[i], cube_of(i, static_cast<float>(update % 3)));
        world.update();
        if (update < 5) continue;
        ASSERT_GE(world.stats().active, 2000u);
        bool agrees[3] = {}; // whoever of them brings the layer up to date
        std::vector<std::thread> askers;
        for (bool& each : agrees)
            askers.emplace_back([&] { each = agree(); });
        for (std::thread& thread : askers)
            thread.join();
        ASSERT_TRUE(agrees[0] && agrees[1] && agrees[2]) << update;
        for (std::size_t i = 0; i < 5000; i += 7)
            world.move(ids[i], cube_of(i, 30));
        world.apply();
        ASSERT_TRUE(agree()) << update << ", ahead of the next one";
    }
}

TEST(Questions, AboutFewByTheirMasksFromManyThreadsAndInsideAccept)
{
    std::function<void()> in_accept = [] {};
    jostle::WorldOptions options;
    options.layers = {{.mask = 2}};
    options.accept = [&](ObjectId, ObjectId) {
        in_accept();
        return true;
    };
    jostle::World3f world(options);
    std::vector<ObjectId> few;
    for (int i = 0; i < 4000; ++i) {
        const auto x = static_cast<float>(3 * i);
        jostle::ObjectOptions<float> with;
        with.filter.category = i % 16 == 0 ? 2 : 1;
        const ObjectId id = world.add({{x, 0, 0}, {x + 1, 1, 1}}, with);
        if (i % 16 == 0) few.push_back(id);
    }
    for (int k = 0; k < 40; ++k)
        world.update();
    ASSERT_EQ(world.stats().resting, 4000u);
    const jostle::Aabb3f everywhere{{-1, -1, -1}, {12'000, 2, 2}};
    const jostle::ObjectQueryFilter wanted{.mask = 2};
    for (int round = 0; round < 12; ++round) {
        std::vector<std::thread> askers;
        std::atomic<int> wrong{0};
        for (int t = 0; t < 4; ++t)
            askers.emplace_back([&] {
                std::vector<ObjectId> found;
                for (int k = 0; k < 30; ++k) {
                    (void)world.all(everywhere, found, wanted);
                    wrong += found != few;
                }
            });
        for (std::thread& thread : askers)
            thread.join();
        EXPECT_EQ(wrong, 0) << round;
        // One more is wanted; and one moves onto the one before it.
        const ObjectId other = world.id(few[0].index + 1 + static_cast<std::uint32_t>(round) * 16);
        world.set_filter(other, {.category = 2});
        few.insert(std::upper_bound(few.begin(), few.end(), other), other);
        const ObjectId mover = few[few.size() - 2 - static_cast<std::size_t>(round)];
        jostle::Aabb3f box = world.box(mover);
        box.lo[0] -= 3;
        box.hi[0] -= 3;
        world.move(mover, box);
        int asked = 0;
        in_accept = [&] {
            std::vector<ObjectId> found;
            (void)world.all(everywhere, found, wanted);
            asked += found == few;
        };
        world.update();
        EXPECT_EQ(asked, 1) << round << ": by the filters that there are from now on";
        in_accept = [] {};
    }
}

/// All that is active has the category that is asked for, but some of it doesn't want the questions'.
TEST(Questions, ByMasksHeedTheObjectsMasksToo)
{
    jostle::World3f world({.layers = {{.category = 4, .mask = 2}}});
    jostle::ObjectOptions<float> with;
    const auto at = [](int i) {
        const auto x = static_cast<float>(3 * i);
        return jostle::Aabb3f{{x, 0, 0}, {x + 1, 1, 1}};
    };
    for (int i = 0; i < 2000; ++i) {
        with.filter.category = i % 100 == 0 ? 2 : 1;
        world.add(at(i), with);
    }
    for (int k = 0; k < 200 && world.stats().resting < 2000; ++k)
        world.update();
    ASSERT_EQ(world.stats().resting, 2000u);
    const jostle::Aabb3f everywhere{{-1, -1, -1}, {12'000, 9, 2}};
    const jostle::ObjectQueryFilter wanted{.category = 4, .mask = 2};
    std::vector<ObjectId> active;
    with.filter.category = 2;
    for (const std::uint32_t mask : {~0u, 4u, 1u, ~4u}) {
        with.filter.mask = mask;
        for (int i = 0; i < 3; ++i)
            active.push_back(world.add(at(static_cast<int>(active.size())), with));
        world.update();
        // Of the first mask's three all, of the second's, too, of the others none.
        const std::size_t counted = std::min<std::size_t>(active.size(), 6);
        for (int frame = 0; frame < 4; ++frame) {
            for (std::size_t i = 0; i < active.size(); ++i) {
                auto box = world.box(active[i]);
                box.lo[1] += frame % 2 == 0 ? 2.0f : -2.0f, box.hi[1] += frame % 2 == 0 ? 2.0f : -2.0f;
                world.move(active[i], box);
            }
            world.update();
            for (int k = 0; k < 60; ++k)
                ASSERT_EQ(world.count(everywhere, wanted), 20 + counted) << "mask " << mask << ", " << k;
        }
    }
}

TEST(Questions, CountThoseAtRestAndTheOthersTogether)
{
    jostle::World3f world;
    const ObjectId rests = world.add({{0, 0, 0}, {1, 1, 1}});
    for (int frame = 0; frame < 200; ++frame)
        world.update();
    ASSERT_EQ(world.stats().resting, 1u);
    for (int i = 1; i < 4; ++i) {
        const auto x = static_cast<float>(3 * i);
        (void)world.add({{x, 0, 0}, {x + 1, 1, 1}});
    }
    world.update();
    std::vector<jostle::Hit<float, jostle::ObjectId>> hits;
    world.nearest(jostle::Nearest3f{{0, 0, 0}, 10}, hits);
    ASSERT_EQ(hits.size(), 4u);
    EXPECT_EQ(hits[0].id, rests);
}

/// Filters that apply() shows count, also of what rests where it was, in every form of question.
TEST(Questions, ByALayerSeeFiltersAheadOfTheUpdate)
{
    jostle::World3f world({.layers = {{.mask = 2}}});
    std::vector<ObjectId> ids;
    for (int i = 0; i < 40; ++i) {
        const auto x = static_cast<float>(3 * i);
        ids.push_back(world.add({{x, 0, 0}, {x + 1, 1, 1}}, {.filter = {.category = i % 2 == 0 ? 2u : 1u}}));
    }
    while (world.update(), world.stats().active != 0) {
    }
    const jostle::ObjectQueryFilter wanted{.mask = 2};
    const jostle::Aabb3f everywhere{{-1, -1, -1}, {200, 2, 2}};
    for (const bool asked_before : {true, false}) {
        if (asked_before) {
            EXPECT_EQ(world.count(everywhere, wanted), 20u);
        }
        world.set_filter(ids[0], {.category = 1});
        world.set_filter(ids[1], {.category = 2});
        world.move(ids[4], {{-9, 0, 0}, {-8, 1, 1}});
        world.apply();
        std::vector<ObjectId> expected{ids[1], ids[2]}, found;
        for (std::size_t i = 6; i < 40; i += 2)
            expected.push_back(ids[i]);
        (void)world.all(everywhere, found, wanted);
        EXPECT_EQ(found, expected);
        found.clear();
        world.visit(
            jostle::Ray3f{{-1, 0.5f, 0.5f}, {1, 0, 0}},
            [&](const jostle::Hit<float, jostle::ObjectId>& hit, float&) {
                return found.push_back(hit.id), true;
            },
            wanted);
        EXPECT_EQ(found, expected);
        std::pmr::vector<jostle::Pair> joined;
        world.join(std::vector<jostle::Aabb3f>{everywhere}, joined, wanted);
        EXPECT_EQ(joined.size(), expected.size());
        world.set_filter(ids[0], {.category = 2});
        world.set_filter(ids[1], {.category = 1});
        world.move(ids[4], {{12, 0, 0}, {13, 1, 1}});
        while (world.update(), world.stats().active != 0) {
        }
    }
}

TEST(Questions, VisitorsAreWarnedAndGetOneOrder)
{
    jostle::World3f world({.layers = {{.mask = 2}}});
    std::vector<ObjectId> few;
    for (int i = 0; i < 4000; ++i) {
        const auto x = static_cast<float>(i * 37 % 4000);
        jostle::ObjectOptions<float> with;
        with.filter.category = i % 16 == 0 ? 2 : 1;
        const ObjectId id = world.add({{3 * x, 0, 0}, {3 * x + 1, 1, 1}}, with);
        if (i % 16 == 0) few.push_back(id);
    }
    for (int k = 0; k < 20; ++k)
        world.update();
    const jostle::Aabb3f everywhere{{-1, -1, -1}, {12'000, 2, 2}};
    const jostle::ObjectQueryFilter wanted{.mask = 2};
    std::vector<ObjectId> first, again, sorted;
    const auto visit = [&](std::vector<ObjectId>& order) {
        order.clear();
        world.visit(everywhere, [&](ObjectId id) { return order.push_back(id), true; }, wanted);
    };
    visit(first);
    (void)world.all(everywhere, sorted, wanted);
    visit(again);
    EXPECT_EQ(sorted, few);
    EXPECT_EQ(first, again);
    EXPECT_NE(first, few) << "an order of its own";
    // In it, commands may be queued and questions asked, but no update made.
    int calls = 0;
    const jostle::Ray3f along{{-1, 0.5f, 0.5f}, {1, 0, 0}};
    world.visit(along, [&](const jostle::Hit<float, jostle::ObjectId>& hit, float&) {
        EXPECT_THROW(world.update(), jostle::Error);
        world.remove(hit.id);
        EXPECT_EQ(world.first(along)->at, 1);
        return ++calls < 3;
    });
    world.visit(everywhere, [&](ObjectId) {
        EXPECT_THROW(world.update(), jostle::Error);
        return false;
    });
    world.update();
    EXPECT_EQ(world.size(), 3997u);
}

TEST(Questions, FromManyThreadsWhileCommandsAreQueued)
{
    Churn<3, float> churn(7, 10, false);
    for (int k = 0; k < 600; ++k)
        churn.operate(200);
    for (int round = 0; round < 5; ++round) {
        ASSERT_TRUE(churn.update(false));
        std::atomic<bool> stop{false};
        std::vector<std::thread> askers;
        std::atomic<int> wrong{0};
        for (std::uint64_t t = 0; t < 4; ++t)
            askers.emplace_back([&, t] {
                // The twin isn't read: it is about to know the commands of the next update.
                jostle::Ray<3, float> ray{{-5, 5, 5}, {1, 0.1f * static_cast<float>(t), 0}};
                const auto first = churn.world->first(ray);
                std::vector<Hit<float, ObjectId>> all;
                while (!stop) {
                    (void)churn.world->all(ray, all);
                    if (churn.world->first(ray) != first || all.empty() || all[0] != first) ++wrong;
                }
            });
        for (int k = 0; k < 200; ++k)
            churn.operate(200);
        stop = true;
        for (std::thread& thread : askers)
            thread.join();
        EXPECT_EQ(wrong, 0);
    }
}

} // namespace
} // namespace world_tests
