// SPDX-License-Identifier: MIT
// Views of a world: they answer as it did when they followed, whatever becomes of it.
#include <thread>

#include "events.hpp"
#include "same_objects.hpp"
#include "world/kept/change_log.hpp"

namespace world_tests {
namespace {

using jostle::Error;
using jostle::ErrorCode;

/// Notes ten of a hundred objects in each update, as updates do it: those that changed, then those that came
/// to rest.
template <class AfterEach>
void note_updates(jostle::world::ChangeLog& log, int updates, const AfterEach& after_each)
{
    for (int update = 0; update < updates; ++update) {
        std::vector<std::uint32_t> changed(10);
        for (std::uint32_t i = 0; i < 10; ++i)
            changed[i] = (static_cast<std::uint32_t>(update) * 10 + i) % 100;
        log.count_update();
        log.note(std::span(changed).first(1), 100);
        log.note(std::span(changed).subspan(1), 100);
        after_each(changed);
    }
}

// In a world in which ever others move the log is cut again and again.
TEST(ChangeLog, KeepsWhatWhoFollowsEveryUpdateNeeds)
{
    jostle::world::ChangeLog log(std::pmr::get_default_resource());
    jostle::world::ChangeLog::Position at, here;
    EXPECT_FALSE(log.since(at, here)) << "nobody has followed yet";
    at = here;
    note_updates(log, 2000, [&](const std::vector<std::uint32_t>& changed) {
        const auto found = log.since(at, here);
        ASSERT_TRUE(found);
        ASSERT_TRUE(std::equal(found->begin(), found->end(), changed.begin(), changed.end()));
        at = here;
    });
}

TEST(ChangeLog, KnowsWhenItDoesNotKnow)
{
    jostle::world::ChangeLog log(std::pmr::get_default_resource()), another(std::pmr::get_default_resource());
    jostle::world::ChangeLog::Position first, at, here;
    (void)log.since(first, first);
    at = first;
    note_updates(log, 500, [&](const auto&) {
        ASSERT_TRUE(log.since(at, here));
        at = here;
    });
    EXPECT_FALSE(log.since(first, here)) << "what came then is forgotten";
    EXPECT_FALSE(another.since(at, here)) << "another world's";
    note_updates(log, 70, [](const auto&) {});
    EXPECT_FALSE(log.since(at, here)) << "for so long nobody followed, and nothing was noted";
    at = here;
    EXPECT_TRUE(log.since(at, here));
    log.note(std::vector<std::uint32_t>(300), 100);
    EXPECT_FALSE(log.since(at, here)) << "more than is worth noting";
}

template <int Dim, class T>
void follow_a_churn(std::uint64_t seed, bool callback, jostle::WorldOptions options)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    Churn<Dim, T> churn(seed, 8, callback, options);
    churn.twin.salt = seed;
    options.executor = threads.get();
    // One follows now and then, one seldom, one follows the first.
    jostle::World<Dim, T> view(options), seldom(options), second(options);
    for (int k = 0; k < 300; ++k)
        churn.operate(200);
    std::optional<Questions<Dim, T>> kept; // what was asked when it had followed
    for (int update = 0; update < 160; ++update) {
        const std::uint32_t commands = update % 40 < 15 ? 0 : churn.random.below(update % 10 == 0 ? 150 : 12);
        for (std::uint32_t k = commands; k > 0; --k)
            churn.operate(200);
        if (churn.random.below(3) == 0) {
            churn.world->apply();
            if (churn.random.below(2) == 0) {
                view.follow(*churn.world);
                ASSERT_TRUE(same_objects(view, *churn.world)) << update;
            }
        }
        ASSERT_TRUE(churn.update(false)) << update;
        if (kept) {
            ASSERT_TRUE(kept->agree()) << update;
            kept.reset();
        }
        if (churn.random.below(3) != 0) {
            view.follow(*churn.world);
            ASSERT_TRUE(same_objects(view, *churn.world)) << update;
            second.follow(view);
            if (churn.random.below(2) == 0) kept.emplace(churn, second, seed);
            ASSERT_TRUE((Questions<Dim, T>(churn, view, seed).agree())) << update;
            ASSERT_TRUE(view.began().empty() && view.ended().empty() && view.persisted().empty());
        }
        if (update % 70 == 0) {
            seldom.follow(*churn.world);
            ASSERT_TRUE(same_objects(seldom, *churn.world)) << update;
            ASSERT_TRUE((Questions<Dim, T>(churn, seldom, seed).agree())) << update;
        }
        if (update == 100) { // another world in its place, with the same ids
            const std::vector<std::byte> now = churn.world->save();
            churn.world->clear();
            view.follow(*churn.world);
            ASSERT_TRUE(same_objects(view, *churn.world));
            ASSERT_EQ(view.size(), 0u);
            churn.world->restore(now);
            view.follow(*churn.world);
            ASSERT_TRUE(same_objects(view, *churn.world));
        }
    }
}

TEST(Follow, AViewAnswersAsTheWorldDid)
{
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        jostle::WorldOptions options;
        options.margin = seed == 2 ? 0.25 : 0;
        if (seed % 3 == 1) {
            follow_a_churn<3, double>(seed, seed % 2 == 0, options);
            follow_a_churn<2, float>(seed, seed % 2 == 1, options);
        } else {
            follow_a_churn<3, float>(seed, seed % 2 == 0, options);
            follow_a_churn<2, double>(seed, seed % 2 == 1, options);
        }
    }
}

// What the view knows of the few that changed must be enough: others rest, wake up, change their filter or
// only the box behind their bounds, and are removed.
TEST(Follow, OfManyThatRestOnlyTheChangedAreLookedAt)
{
    jostle::World3f world, view({.layers = {{.mask = 2}}});
    std::vector<ObjectId> ids(6000);
    for (std::size_t i = 0; i < ids.size(); ++i)
        ids[i] = world.add(cube_at(static_cast<float>(i % 80) * 1.5f, static_cast<float>(i / 80) * 1.5f),
                           {.filter = {.category = i % 8 == 0 ? 2u : 1u}});
    while (world.update(), world.stats().active != 0) {
    }
    view.follow(world);
    ASSERT_TRUE(same_objects(view, world));
    const auto count = [](const jostle::World3f& of) {
        jostle::ObjectQueryFilter filter;
        filter.mask = 2;
        return of.count(jostle::Aabb3f{{0, 0, 0}, {50, 50, 1}}, filter);
    };
    Random random(7);
    for (int update = 0; update < 60; ++update) {
        for (int k = 0; k < 10; ++k) {
            const ObjectId id = ids[random.below(5000)];
            if (!world.contains(id)) continue;
            switch (random.below(5)) {
            case 0:
                world.set_filter(id, {.category = 1u + random.below(2)});
                break;
            case 1: { // the same bounds, which come about in another way
                const jostle::Aabb3f box = world.box(id);
                world.move(id, {{box.lo[0] + 0.25f, box.lo[1] + 0.25f, box.lo[2] + 0.25f},
                                {box.hi[0] - 0.25f, box.hi[1] - 0.25f, box.hi[2] - 0.25f}});
                world.set_margin(id, world.margin(id) + 0.25f);
                break;
            }
            case 2:
                world.remove(id);
                break;
            case 3:
                world.set_enabled(id, random.below(2) == 0);
                break;
            default:
                world.move(id, cube_at(static_cast<float>(random.below(120)),
                                       static_cast<float>(random.below(120))));
            }
        }
        world.update();
        if (update % 3 != 0) continue;
        view.follow(world);
        ASSERT_TRUE(same_objects(view, world)) << update;
        ASSERT_EQ(count(view), count(world)) << update;
    }
}

// As a server does: the world goes on while others ask the view.
TEST(Follow, AskedByThreadsWhileTheWorldIsUpdated)
{
    jostle::World3f world, view;
    std::vector<ObjectId> ids(800);
    for (std::size_t i = 0; i < ids.size(); ++i)
        ids[i] = world.add(cube_at(static_cast<float>(i % 40) * 1.5f, static_cast<float>(i / 40) * 1.5f));
    world.update();
    for (int frame = 0; frame < 20; ++frame) {
        view.follow(world);
        const auto expected = world.count(jostle::Aabb3f{{5, 5, 0}, {20, 20, 1}});
        std::vector<ObjectId> hits;
        world.all(jostle::Aabb3f{{5, 5, 0}, {20, 20, 1}}, hits);
        std::vector<std::thread> askers;
        std::atomic<int> wrong{0};
        for (int thread = 0; thread < 3; ++thread)
            askers.emplace_back([&] {
                std::vector<ObjectId> found;
                for (int k = 0; k < 30; ++k) {
                    wrong += view.count(jostle::Aabb3f{{5, 5, 0}, {20, 20, 1}}) != expected;
                    view.all(jostle::Aabb3f{{5, 5, 0}, {20, 20, 1}}, found);
                    wrong += found != hits;
                }
            });
        for (std::size_t i = static_cast<std::size_t>(frame) % 3; i < ids.size(); i += 3)
            world.move(ids[i],
                       cube_at(static_cast<float>((i * 7 + static_cast<std::size_t>(frame)) % 60), 3));
        world.update();
        for (std::thread& asker : askers)
            asker.join();
        ASSERT_EQ(wrong, 0) << frame;
    }
}

template <class Call>
std::string error_of(const Call& call)
{
    try {
        call();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_argument);
        return error.what();
    }
    return {};
}

TEST(Follow, AViewTakesNoCommands)
{
    jostle::World3f world, view;
    const ObjectId id = world.add(cube_at(0, 0)), other = world.add(cube_at(0, 0));
    world.update();
    (void)view.add(cube_at(9, 9));
    view.update();
    view.follow(world);
    EXPECT_EQ(view.size(), 2u) << "what it had is forgotten";
    std::vector<ObjectId> ids = {id};
    std::vector<jostle::Aabb3f> boxes = {cube_at(1, 1)};
    std::vector<std::byte> bytes;
    const std::function<void()> calls[] = {[&] { (void)view.add(cube_at(0, 0)); },
                                           [&] { view.add(boxes, ids); },
                                           [&] { view.move(id, cube_at(1, 1)); },
                                           [&] { view.move(ids, boxes); },
                                           [&] { view.move(id, cube_at(1, 1), {1, 0, 0}); },
                                           [&] { view.resize(id, {1, 1, 1}); },
                                           [&] { view.remove(id); },
                                           [&] { view.remove(ids); },
                                           [&] { view.set_filter(id, {}); },
                                           [&] { view.set_margin(id, 1); },
                                           [&] { view.set_enabled(id, false); },
                                           [&] { view.report_again(id); },
                                           [&] { view.report_again(id, other); },
                                           [&] { view.set_user_data(id, 1); },
                                           [&] { (void)view.user_data(id); },
                                           [&] { view.update(); },
                                           [&] { view.update(ids, boxes); },
                                           [&] { view.apply(); },
                                           [&] { (void)view.save(); },
                                           [&] { (void)view.fork(); },
                                           [&] { (void)view.save_base(); },
                                           [&] { view.save_changes(bytes); },
                                           [&] { view.restore_changes(bytes); }};
    for (std::size_t k = 0; k < std::size(calls); ++k)
        EXPECT_NE(error_of(calls[k]), "") << k;
    EXPECT_NE(error_of([&] { view.update(); }).find("clear() or restore()"), std::string::npos);
    EXPECT_EQ(ids[0], id);
    EXPECT_TRUE(same_objects(view, world));
    EXPECT_NE(view.explain().find("A view of another world. 2 objects"), std::string::npos);
    view.restore(world.save());
    view.move(id, cube_at(5, 5));
    view.update();
    EXPECT_EQ(view.box(id).lo[0], 5);
    view.follow(world);
    view.clear();
    EXPECT_EQ(view.add(cube_at(0, 0)).index, 0u);
    view.update();
    EXPECT_EQ(view.size(), 1u);
}

TEST(Follow, NotItselfNorAWorldInItsUpdate)
{
    jostle::World3f view;
    EXPECT_NE(error_of([&] { view.follow(view); }).find("can't follow itself"), std::string::npos);
    jostle::World3f* asked = nullptr;
    std::string error;
    jostle::WorldOptions options;
    options.executor = &jostle::serial_executor();
    options.accept = [&](ObjectId, ObjectId) {
        error = error_of([&] { view.follow(*asked); });
        return true;
    };
    jostle::World3f world(options);
    asked = &world;
    (void)world.add(cube_at(0, 0));
    (void)world.add(cube_at(0, 0));
    world.update();
    EXPECT_NE(error.find("between two updates"), std::string::npos);
    EXPECT_EQ(view.size(), 0u);
    view.follow(world);
    EXPECT_EQ(view.size(), 2u);
    view.visit(jostle::Aabb3f{{0, 0, 0}, {9, 9, 9}}, [&](ObjectId) {
        error = error_of([&] { view.follow(world); });
        return true;
    });
    EXPECT_NE(error.find("is answering a query"), std::string::npos);
}

} // namespace
} // namespace world_tests
