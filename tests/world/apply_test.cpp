// SPDX-License-Identifier: MIT
// What apply() shows ahead of an update, and that the update doesn't notice.
#include <condition_variable>
#include <functional>
#include <memory_resource>
#include <mutex>
#include <thread>

#include "ahead.hpp"
#include "events.hpp"

namespace world_tests {
namespace {

template <int Dim, class T>
void churn_ahead(std::uint64_t seed, double extent, std::size_t objects, int updates,
                 jostle::Executor& executor)
{
    const bool callback = seed % 2 == 0;
    Churn<Dim, T> churn(seed, extent, callback, {.executor = &executor, .margin = seed % 3 == 0 ? 0.125 : 0});
    churn.beside.push_back(std::make_unique<jostle::World<Dim, T>>(churn.options)); // nobody calls apply()
    std::uint64_t results = 0;
    for (int update = 0; update < updates; ++update) {
        if (callback && update % 16 == 15) churn.twin.salt = churn.random.next();
        const std::vector<ObjectPair> began(churn.world->began().begin(), churn.world->began().end());
        for (std::uint32_t calls = churn.random.below(5); calls > 0; --calls) {
            const std::uint32_t burst = update == 0 || update % 25 == 24 ? static_cast<std::uint32_t>(objects)
                                        : update % 40 < 20               ? 6u
                                                                         : 0u;
            for (std::uint32_t k = burst == 0 ? 0 : churn.random.below(burst); k > 0; --k)
                churn.operate(objects);
            churn.world->apply();
            if (churn.random.below(3) == 0) continue; // nobody asks this time
            ASSERT_TRUE(shows(churn, seed * 1000 + static_cast<std::uint64_t>(update), &results))
                << "seed " << seed << ", before update " << update;
        }
        ASSERT_TRUE(
            std::equal(began.begin(), began.end(), churn.world->began().begin(), churn.world->began().end()));
        ASSERT_EQ(churn.world->save(), churn.beside[0]->save());
        for (std::uint32_t k = churn.random.below(3); k > 0; --k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(update % 8 == 0)) << "seed " << seed << ", update " << update;
        if (update % 8 == 0) {
            ASSERT_TRUE((Questions<Dim, T>(churn, static_cast<std::uint64_t>(update)).agree()));
        }
        churn.beside[0]->update();
        ASSERT_EQ(churn.world->save(), churn.beside[0]->save());
        ASSERT_EQ(churn.world->stats().commands, churn.beside[0]->stats().commands);
        ASSERT_EQ(churn.world->stats().dropped, churn.beside[0]->stats().dropped);
        ASSERT_EQ(churn.world->stats().changed, churn.beside[0]->stats().changed);
    }
    EXPECT_GT(results, 500u);
    EXPECT_GT(churn.began, objects);
    EXPECT_GT(churn.world->stats().resting, 0u);
}

TEST(Apply, ShowsWhatWillBeAndUpdatesDoNotNotice)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        churn_ahead<3, float>(seed, 7, 250, 100, *threads);
        churn_ahead<2, double>(seed, 16, 200, 60, jostle::serial_executor());
        churn_ahead<3, double>(seed + 3, 4, 40, 120, jostle::serial_executor());
        churn_ahead<2, float>(seed + 3, 3, 12, 200, *threads);
    }
}

/// A thread that does one thing after another, each while the caller waits.
class Speaker
{
  public:
    ~Speaker()
    {
        do_it({});
        thread_.join();
    }
    void say(std::function<void()> what) { do_it(std::move(what)); }

  private:
    void do_it(std::function<void()> what)
    {
        const bool ends = !what;
        std::unique_lock lock(mutex_);
        what_ = std::move(what);
        has_turn_ = true;
        changed_.notify_all();
        if (!ends) changed_.wait(lock, [&] { return !has_turn_; });
    }
    void run()
    {
        std::unique_lock lock(mutex_);
        while (true) {
            changed_.wait(lock, [&] { return has_turn_; });
            if (!what_) return;
            what_();
            has_turn_ = false;
            changed_.notify_all();
        }
    }
    std::mutex mutex_;
    std::condition_variable changed_;
    std::function<void()> what_;
    bool has_turn_ = false;
    std::thread thread_{[this] { run(); }};
};

// Several threads speak of the same objects, with and without sequences: who wins is found out of all that
// was said since the last update, whatever apply() has shown in between.
TEST(Apply, DoesNotChangeWhoWins)
{
    jostle::World3f plain, ahead;
    Speaker speakers_that_stay[2];
    std::vector<ObjectId> ids;
    Random random(5);
    for (int i = 0; i < 60; ++i) {
        const auto box = random_box<3, float>(random, 5, false);
        ids.push_back(plain.add(box));
        ASSERT_EQ(ahead.add(box), ids.back());
    }
    for (int round = 0; round < 60; ++round) {
        for (int part = 0; part < 3; ++part) {
            const std::uint32_t speakers = random.below(4);
            for (std::uint32_t t = 0; t < speakers; ++t) {
                const std::uint64_t seed = random.next();
                const auto speak = [&, seed] {
                    Random own(seed);
                    for (int k = 0; k < 12; ++k) {
                        const ObjectId id = ids[own.below(t % 2 == 0 ? 60 : 9)];
                        const std::uint32_t sequence = own.below(3) == 0 ? own.below(3) : 0;
                        const auto box = random_box<3, float>(own, 5, false);
                        const ObjectFilter filter = random_filter(own);
                        const float size[3] = {1, static_cast<float>(own.uniform(0, 2)), 1};
                        const std::uint32_t kind = own.below(8);
                        const bool on = own.below(4) != 0;
                        for (jostle::World3f* world : {&plain, &ahead})
                            try {
                                if (kind < 3) world->move(id, box, sequence);
                                if (kind == 3) world->resize(id, size, sequence);
                                if (kind == 4) world->set_filter(id, filter, sequence);
                                if (kind == 5) world->set_enabled(id, on, sequence);
                                if (kind == 6) world->move(id, box, {1, 0, -1}, sequence);
                                if (kind == 7 && k == 0 && round % 8 == 0) world->remove(id);
                            } catch (const jostle::Error& error) { // removed long ago, in both
                                EXPECT_EQ(error.code(), jostle::ErrorCode::stale_id);
                            }
                    }
                };
                // Some live for one sentence, and another may get their name; some speak again.
                if (t == 0 && random.below(2) == 0)
                    std::thread(speak).join();
                else
                    speakers_that_stay[random.below(2)].say(speak);
            }
            if (random.below(3) != 0) ahead.apply();
            if (random.below(3) == 0) {
                const auto box = random_box<3, float>(random, 5, false);
                const ObjectId fresh = plain.add(box);
                ASSERT_EQ(ahead.add(box), fresh);
                ids[random.below(60)] = fresh;
            }
        }
        ahead.apply();
        const std::size_t size = ahead.size();
        std::vector<jostle::Aabb3f> bounds;
        for (std::uint32_t i = 0; i < ahead.index_end(); ++i)
            if (ahead.contains(ahead.id(i))) bounds.push_back(ahead.bounds(ahead.id(i)));
        plain.update();
        ahead.update();
        ASSERT_EQ(size, plain.size()) << round;
        std::size_t k = 0;
        for (std::uint32_t i = 0; i < plain.index_end(); ++i)
            if (plain.contains(plain.id(i))) {
                ASSERT_EQ(bounds[k].lo, plain.bounds(plain.id(i)).lo) << round;
                ASSERT_EQ(bounds[k++].hi, plain.bounds(plain.id(i)).hi) << round;
            }
        ASSERT_EQ(plain.save(), ahead.save()) << round;
        ASSERT_TRUE(std::equal(plain.began().begin(), plain.began().end(), ahead.began().begin(),
                               ahead.began().end()));
        ASSERT_TRUE(std::equal(plain.ended().begin(), plain.ended().end(), ahead.ended().begin(),
                               ahead.ended().end()));
        ASSERT_EQ(plain.persisted().to_vector(), ahead.persisted().to_vector());
    }
}

/// An object is added while one thread speaks of others, is shown, and is spoken of by a second thread alone:
/// nobody contests it, so its snapshot is what it is without apply().
TEST(Apply, ANewObjectIsOfWhoSpeaksOfItFirst)
{
    Speaker one, other;
    jostle::World3f plain, ahead;
    const ObjectId id = plain.add(cube(0));
    ASSERT_EQ(ahead.add(cube(0)), id);
    plain.update();
    ahead.update();
    const auto say = [&](Speaker& speaker, const std::function<void(jostle::World3f&)>& command) {
        speaker.say([&] {
            command(plain);
            command(ahead);
        });
    };
    say(one, [&](jostle::World3f& world) { world.move(id, cube(1)); });
    const ObjectId fresh = plain.add(cube(5));
    ASSERT_EQ(ahead.add(cube(5)), fresh);
    ahead.apply();
    say(other, [&](jostle::World3f& world) { world.move(fresh, cube(6), {1, 0, 0}); });
    say(other, [&](jostle::World3f& world) { world.move(fresh, cube(7)); });
    plain.update();
    ahead.update();
    EXPECT_EQ(ahead.box(fresh).lo, cube(7).lo);
    EXPECT_EQ(plain.save(), ahead.save());
}

/// One of two who contested goes on speaking after apply(), and nobody else does: the other's word still
/// counts.
TEST(Apply, SettlesAgainWhatWasContestedBefore)
{
    Speaker one, other;
    jostle::World3f plain, ahead;
    const ObjectId id = plain.add(cube(0));
    ASSERT_EQ(ahead.add(cube(0)), id);
    plain.update();
    ahead.update();
    const auto set = [&](Speaker& speaker, float margin) {
        speaker.say([&] {
            plain.set_margin(id, margin);
            ahead.set_margin(id, margin);
        });
        ahead.apply();
    };
    set(one, 1);
    set(other, 5);
    EXPECT_EQ(ahead.margin(id), 5);
    set(one, 2);
    EXPECT_EQ(ahead.margin(id), 5) << "the greater one";
    set(one, 7);
    set(one, 3);
    EXPECT_EQ(ahead.margin(id), 5);
    plain.update();
    ahead.update();
    EXPECT_EQ(plain.margin(id), 5);
    EXPECT_EQ(ahead.margin(id), 5);
    EXPECT_EQ(plain.save(), ahead.save());
}

TEST(Apply, IsTakenBackByAnUpdateThatFails)
{
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Churn<3, float> churn(seed, 6, true);
        int failed = 0;
        for (int update = 0; update < 80; ++update) {
            for (int part = 0; part < 3; ++part) {
                for (std::uint32_t k = churn.random.below(20); k > 0; --k)
                    churn.operate(120);
                churn.world->apply();
            }
            ASSERT_TRUE(shows(churn, seed));
            for (std::uint32_t k = churn.random.below(5); k > 0; --k)
                churn.operate(120);
            const std::vector<std::byte> saved = churn.world->save();
            const std::size_t size_before = [&] {
                jostle::World3f before;
                before.restore(saved);
                return before.size();
            }();
            churn.questions_until_refusal = churn.random.below(12);
            try {
                churn.asked = 0;
                churn.world->update();
            } catch (const Refusal&) {
                ++failed;
                churn.questions_until_refusal = Churn<3, float>::never;
                ASSERT_EQ(churn.world->save(), saved);
                ASSERT_EQ(churn.world->size(), size_before) << "as the last update left it";
                if (update % 2 == 0) {
                    churn.world->apply();
                    ASSERT_TRUE(shows(churn, seed)) << "all of it is queued still";
                }
                churn.asked = 0;
                churn.world->update();
            }
            churn.questions_until_refusal = Churn<3, float>::never;
            ASSERT_TRUE(churn.follow(true)) << "seed " << seed << ", update " << update;
            ASSERT_TRUE((Questions<3, float>(churn, seed).agree()));
        }
        EXPECT_GT(failed, 10);
    }
}

/// Memory that fails at the n-th allocation.
class Scarce final : public std::pmr::memory_resource
{
  public:
    std::uint64_t left = ~std::uint64_t{0};

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        if (left-- == 0) throw std::bad_alloc();
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override
    {
        std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
    }
    [[nodiscard]] bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override
    {
        return this == &other;
    }
};

TEST(Apply, ThatRunsOutOfMemoryTakesAllBack)
{
    int failed = 0;
    for (std::uint64_t allowed = 0; allowed < 60; ++allowed) {
        Scarce memory;
        Churn<3, float> churn(3, 5, false, {.executor = &jostle::serial_executor(), .memory = &memory});
        for (int k = 0; k < 150; ++k)
            churn.operate(100);
        ASSERT_TRUE(churn.update());
        for (int k = 0; k < 20; ++k)
            churn.operate(100);
        churn.world->apply();
        ASSERT_TRUE(shows(churn, 1));
        for (int k = 0; k < 300; ++k)
            churn.operate(300);
        const std::vector<std::byte> saved = churn.world->save();
        memory.left = allowed;
        bool good = false;
        try {
            churn.world->apply();
            good = true;
        } catch (const std::bad_alloc&) {
            ++failed;
        }
        memory.left = ~std::uint64_t{0};
        ASSERT_EQ(churn.world->save(), saved);
        if (!good && allowed % 2 == 0) churn.world->apply();
        if (good || allowed % 2 == 0) {
            ASSERT_TRUE(shows(churn, 2)) << allowed;
        }
        ASSERT_TRUE(churn.update()) << allowed;
        ASSERT_TRUE((Questions<3, float>(churn, 3).agree())) << allowed;
    }
    EXPECT_GT(failed, 2);
}

TEST(Apply, ThatRunsOutOfMemoryKnowsItsObjectsTheNextTime)
{
    Scarce memory;
    jostle::World3f world({.executor = &jostle::serial_executor(), .memory = &memory});
    const auto box = [](int x) {
        return jostle::Aabb3f{{static_cast<float>(2 * x), 0, 0}, {static_cast<float>(2 * x + 1), 1, 1}};
    };
    std::vector<ObjectId> ids;
    for (int k = 0; k < 1000; ++k)
        ids.push_back(world.add(box(k)));
    world.update();
    for (int k = 0; k < 1000; ++k)
        world.move(ids[static_cast<std::size_t>(k)], box(k + 3000));
    world.apply();
    // One after the other, so that each list has to grow alone at some time.
    int failed = 0;
    for (int k = 1; k <= 3000; ++k) {
        const ObjectId late = world.add(box(-k));
        memory.left = 0;
        try {
            world.apply();
        } catch (const std::bad_alloc&) {
            ++failed;
        }
        memory.left = ~std::uint64_t{0};
        world.apply();
        ASSERT_EQ(world.size(), 1000u + static_cast<std::size_t>(k));
        std::vector<ObjectId> found;
        world.all(box(-k), found);
        ASSERT_EQ(found, std::vector{late});
    }
    EXPECT_GT(failed, 1);
}

TEST(Apply, BothFormsOfPairsAreTheLastUpdatesInsideAccept)
{
    jostle::World3f* asked = nullptr;
    std::size_t calls = 0;
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        std::vector<Pair> visited;
        asked->pairs([&](ObjectId a, ObjectId b) {
            visited.push_back({a.index, b.index});
            return true;
        });
        std::vector<Pair> listed = asked->pairs().to_vector();
        std::sort(visited.begin(), visited.end());
        std::sort(listed.begin(), listed.end());
        EXPECT_EQ(visited, listed);
        if (++calls == 2) {
            EXPECT_EQ(listed, (std::vector<Pair>{{0, 1}}));
        }
        return true;
    };
    jostle::World3f world(options);
    asked = &world;
    const auto box = [](float x) { return jostle::Aabb3f{{x, 0, 0}, {x + 1, 1, 1}}; };
    const ObjectId a = world.add(box(0));
    world.add(box(0.5f));
    const ObjectId c = world.add(box(10));
    world.update();
    world.move(a, box(20));
    world.move(c, box(0.75f));
    world.update();
    EXPECT_EQ(calls, 2u);
}

TEST(Apply, QuestionsWithMasksSkipWhatHasLeftTheirIndex)
{
    Churn<3, float> churn(2, 16, false);
    churn.giants = false;
    for (std::size_t k = 0; k < 4500; ++k)
        churn.operate(1500);
    for (int update = 0; update < 20; ++update)
        ASSERT_TRUE(churn.update(false));
    ASSERT_GT(churn.world->stats().resting, 1024u);
    for (int round = 0; round < 24; ++round) {
        for (int part = 0; part < 3; ++part) {
            Questions<3, float> questions(churn, static_cast<std::uint64_t>(round));
            questions.only(~0u, round < 12 ? 4 : 2);
            ASSERT_TRUE(questions.agree()) << round << ", " << part;
            for (int k = 0; k < 15; ++k)
                churn.operate(1500);
            churn.world->apply();
        }
        ASSERT_TRUE(churn.update(false));
    }
}

// What rests and is shown elsewhere is passed over one by one where it is little, and where it is much an
// index is made.
TEST(Apply, ShowsWhichPairsAreClosestWhetherFewOrManyHaveMoved)
{
    using Box = jostle::Aabb3f;
    Random random(29);
    const auto box_at_random = [&] {
        Box box;
        for (std::size_t d = 0; d < 3; ++d) {
            box.lo[d] = static_cast<float>(random.uniform(0, 40));
            box.hi[d] = box.lo[d] + static_cast<float>(random.uniform(0, 1));
        }
        return box;
    };
    struct Side
    {
        jostle::World3f world{{.executor = &jostle::serial_executor()}};
        std::vector<ObjectId> ids;
        std::vector<Box> boxes;
        std::vector<bool> shown;
    } sides[2];
    for (Side& side : sides) {
        for (int k = 0; k < 600; ++k) {
            side.boxes.push_back(box_at_random());
            side.ids.push_back(side.world.add(side.boxes.back()));
        }
        side.shown.assign(side.ids.size(), true);
        for (int k = 0; k < 4; ++k)
            side.world.update(); // until they rest
    }
    ASSERT_EQ(sides[0].world.stats().resting, 600u);
    using Hit = jostle::PairHit<float, jostle::ObjectId>;
    const auto agree = [&] {
        for (const int which : {0, 1, 2}) { // within each, and between the two
            const Side &ours = sides[which == 1 ? 1 : 0], &theirs = sides[which == 0 ? 0 : 1];
            std::vector<Hit> expected, found;
            for (std::size_t a = 0; a < ours.ids.size(); ++a)
                for (std::size_t b = which == 2 ? 0 : a + 1; b < theirs.ids.size(); ++b) {
                    const float at = jostle::squared_distance(ours.boxes[a], theirs.boxes[b]);
                    if (ours.shown[a] && theirs.shown[b] && at <= 4)
                        expected.push_back({ours.ids[a], theirs.ids[b], at});
                }
            const auto collect = [&](const Hit& hit, float&) { return found.push_back(hit), true; };
            ours.world.closest_pairs(theirs.world, collect, 2);
            const auto in_order = [](const Hit& a, const Hit& b) {
                return std::tie(a.at, a.a.index, a.b.index) < std::tie(b.at, b.a.index, b.b.index);
            };
            std::sort(expected.begin(), expected.end(), in_order);
            std::sort(found.begin(), found.end(), in_order);
            EXPECT_GT(expected.size(), 100u);
            EXPECT_TRUE(found == expected) << which << ": " << found.size() << " of " << expected.size();
        }
    };
    agree();
    for (const std::uint32_t moved : {1u, 20u, 300u}) { // of 600: an eighth are 75
        for (Side& side : sides)
            for (std::uint32_t k = 0; k < moved; ++k) {
                const std::uint32_t i = random.below(600);
                const std::uint32_t what = random.below(6);
                if (!side.shown[i]) continue;
                side.shown[i] = what > 1;
                if (what == 0) {
                    side.world.remove(side.ids[i]);
                } else if (what == 1) {
                    side.world.set_enabled(side.ids[i], false);
                } else {
                    side.boxes[i] = box_at_random();
                    side.world.move(side.ids[i], side.boxes[i]);
                }
            }
        sides[0].world.apply();
        sides[1].world.apply();
        agree();
    }
}

TEST(Apply, OfEverythingAtOnceAndOfNothing)
{
    Churn<2, float> churn(8, 12, false);
    churn.world->apply();
    EXPECT_EQ(churn.world->size(), 0u);
    EXPECT_FALSE(churn.world->bounds().has_value());
    for (int k = 0; k < 400; ++k)
        churn.operate(200);
    churn.world->apply();
    churn.world->apply();
    ASSERT_TRUE(shows(churn, 1)) << "before the first update";
    ASSERT_TRUE(churn.update());
    while (!churn.twin.things.empty())
        churn.remove();
    churn.world->apply();
    ASSERT_TRUE(shows(churn, 2));
    EXPECT_EQ(churn.world->size(), 0u);
    ASSERT_TRUE(churn.update());
}

TEST(Apply, BeginsAnewAfterRestoreAndClear)
{
    Churn<3, float> churn(9, 6, false);
    for (int k = 0; k < 300; ++k)
        churn.operate(150);
    ASSERT_TRUE(churn.update());
    const std::vector<std::byte> saved = churn.world->save();
    const Twin<3, float> then = churn.twin;
    for (int k = 0; k < 100; ++k)
        churn.operate(150);
    const std::vector<std::byte> before = churn.world->save();
    churn.world->apply();
    jostle::World3f fork = churn.world->fork();
    EXPECT_EQ(fork.save(), before) << "a fork is of the last update";
    churn.world->restore(saved);
    churn.twin = then;
    ASSERT_TRUE(shows(churn, 1)) << "what was applied is forgotten";
    for (int k = 0; k < 50; ++k)
        churn.operate(150);
    churn.world->apply();
    ASSERT_TRUE(shows(churn, 2));
    ASSERT_TRUE(churn.update());
    (void)churn.world->add({{0, 0, 0}, {1, 1, 1}});
    churn.world->apply();
    churn.world->clear();
    EXPECT_EQ(churn.world->size(), 0u);
    EXPECT_FALSE(churn.world->bounds().has_value());
}

TEST(Apply, MovesGivenToTheUpdateComeLast)
{
    jostle::World3f world;
    const auto cube = [](float x) { return jostle::Aabb3f{{x, 0, 0}, {x + 1, 1, 1}}; };
    std::vector<ObjectId> ids = {world.add(cube(0)), world.add(cube(10))};
    world.update();
    world.move(ids[0], cube(20));
    world.apply();
    EXPECT_EQ(world.box(ids[0]).lo[0], 20);
    world.update(ids, std::vector<jostle::Aabb3f>{cube(10.5f), cube(10)});
    EXPECT_EQ(world.box(ids[0]).lo[0], 10.5f);
    ASSERT_EQ(world.began().size(), 1u);
    world.move(ids[0], cube(20)); // there and back again
    world.apply();
    std::vector<ObjectId> found;
    world.touching(ids[1], found);
    EXPECT_TRUE(found.empty());
    world.move(ids[0], cube(10.5f));
    world.update();
    EXPECT_TRUE(world.began().empty() && world.ended().empty() && world.persisted().empty());
}

TEST(Apply, IsRefusedWhereAnUpdateIs)
{
    std::function<void()> in_accept = [] {};
    jostle::WorldOptions options;
    options.accept = [&](ObjectId, ObjectId) {
        in_accept();
        return true;
    };
    jostle::World3f world(options);
    const jostle::Aabb3f box{{0, 0, 0}, {1, 1, 1}};
    const ObjectId a = world.add(box);
    EXPECT_THROW((void)world.box(a), jostle::Error);
    world.apply();
    EXPECT_EQ(world.box(a).hi[0], 1);
    (void)world.add(box);
    int refused = 0;
    in_accept = [&] {
        try {
            world.apply();
        } catch (const jostle::Error&) {
            ++refused;
        }
    };
    world.update();
    const auto visit = [&](std::uint32_t, ObjectId) {
        in_accept();
        return true;
    };
    (void)world.any(box, {.accept = visit});
    EXPECT_GE(refused, 2) << "in the update and in the question";
    world.remove(a);
    world.apply();
    EXPECT_FALSE(world.contains(a));
    try {
        (void)world.box(a);
        ADD_FAILURE() << "it is gone";
    } catch (const jostle::Error& error) {
        EXPECT_EQ(error.code(), jostle::ErrorCode::stale_id);
        EXPECT_NE(std::string(error.what()).find("any more"), std::string::npos) << error.what();
    }
    world.move(a, box); // for nobody
    world.update();
    EXPECT_EQ(world.stats().dropped, 1u);
}

/// Whether the only two objects that may touch do so, as everything says that can be asked.
bool touch(const jostle::World3f& world, ObjectId a, ObjectId b)
{
    jostle::World3f view;
    view.follow(world);
    std::vector<ObjectId> others;
    const bool do_they = world.pairs().size() == 1;
    for (const jostle::World3f* const each : {&world, static_cast<const jostle::World3f*>(&view)}) {
        EXPECT_EQ(each->pairs().size(), do_they ? 1u : 0u);
        for (const ObjectId id : {a, b}) {
            each->touching(id, others);
            EXPECT_EQ(others.size(), do_they ? 1u : 0u);
        }
        EXPECT_EQ(each->closest_pair(0).has_value(), do_they);
    }
    return do_they;
}

// Refused pairs touch after apply() if `accept` is to be asked about them again, and only those.
TEST(Apply, RefusedPairsTouchIfTheyAreToBeAskedAboutAgain)
{
    constexpr int ways = 6, ways_to_be_asked = 4;
    for (int way = 0; way < ways; ++way) {
        bool takes = false;
        int asked = 0;
        jostle::World3f world({.accept = [&](ObjectId, ObjectId) { return ++asked, takes; }});
        const ObjectId a = world.add(cube(0)), b = world.add(cube(0)), far = world.add(cube(30));
        world.update();
        ASSERT_EQ(asked, 1);
        const bool is_asked = way < ways_to_be_asked;
        for (const bool answer : {false, true}) {
            EXPECT_FALSE(touch(world, a, b));
            if (way == 0) world.set_filter(a, {.category = answer ? 5u : 3u});
            if (way == 1) world.set_filter(b, {}); // as it was
            if (way == 2) world.report_again(b);
            if (way == 3) {
                world.report_again(b, far); // more than one, and not in order
                world.report_again(b, a);
            }
            if (way == 4) world.report_again(a, far);
            if (way == 5) {
                world.move(a, cube(9));
                world.apply();
                world.move(a, cube(0));
            }
            EXPECT_FALSE(touch(world, a, b)) << "it is queued only";
            world.apply();
            EXPECT_EQ(touch(world, a, b), is_asked) << way;
            takes = answer;
            asked = 0;
            world.update();
            EXPECT_EQ(asked, is_asked ? 1 : 0) << way;
            EXPECT_EQ(touch(world, a, b), is_asked && answer) << way;
        }
    }
}

} // namespace
} // namespace world_tests
