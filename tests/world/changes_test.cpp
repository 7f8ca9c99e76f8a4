// SPDX-License-Identifier: MIT
// What changed since a base: restored, it is to the byte what a whole snapshot is, and costs what differs.
#include "events.hpp"
#include "snapshots.hpp"

namespace world_tests {
namespace {

/// A moment to go back to: the slow twin has the whole snapshot.
template <int Dim, class T>
struct Moment
{
    Bytes whole, changes;
    Twin<Dim, T> twin;
    Random random;
};

template <int Dim, class T>
void set_some_data(Churn<Dim, T>& churn, jostle::World<Dim, T>& world, std::uint64_t data)
{
    if (churn.twin.things.empty()) return;
    world.set_user_data(churn.twin.things.begin()->second.id, data);
    world.set_user_data(churn.twin.things.rbegin()->second.id, data / 2);
}

template <int Dim, class T>
void go_back_and_forth(std::uint64_t seed, bool callback, jostle::WorldOptions options)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    Churn<Dim, T> churn(seed, 8, callback, options);
    churn.twin.salt = seed;
    for (int k = 0; k < 400; ++k)
        churn.operate(200);
    for (int update = 0; update < 20; ++update) {
        ASSERT_TRUE(churn.update(false));
        for (std::uint32_t k = churn.random.below(20); k > 0; --k)
            churn.operate(200);
    }
    if (seed % 2 == 0) { // else there is something queued
        ASSERT_TRUE(churn.update(false));
    }
    const Bytes base = churn.world->save_base();
    ASSERT_EQ(base, churn.world->save());
    options.executor = threads.get();
    Churn<Dim, T> replica(seed, 8, callback, options);
    replica.world->restore(base);
    ASSERT_EQ(replica.world->save_base(), base);
    if (seed % 2 != 0) {
        ASSERT_TRUE(churn.update(false));
    }

    std::vector<Moment<Dim, T>> moments;
    for (std::uint32_t round = 0; round < 12; ++round) {
        for (int update = 0; update < 8; ++update) {
            const std::uint32_t commands = update % 4 < 2 ? churn.random.below(30) : 0;
            for (std::uint32_t k = commands; k > 0; --k)
                churn.operate(200);
            ASSERT_TRUE(churn.update(update == 0)) << round << ' ' << update;
            if (churn.random.below(2) == 0) set_some_data(churn, *churn.world, churn.random.below(3));
            Moment<Dim, T> moment{churn.world->save(), {}, churn.twin, churn.random};
            churn.world->save_changes(moment.changes);
            moments.push_back(std::move(moment));
        }
        // To be forgotten.
        (void)churn.world->add(random_box<Dim, T>(churn.random, 8));
        if (round % 3 == 1) churn.world->apply();
        const Moment<Dim, T>& moment =
            moments[moments.size() - 1 - churn.random.below(std::min<std::uint32_t>(40, 8 * (round + 1)))];
        // There by its changes, and by the whole: then the same to the byte, whatever is done.
        Churn<Dim, T> whole(seed, 8, callback, options);
        whole.world->restore(moment.whole);
        churn.world->restore_changes(moment.changes);
        replica.world->restore_changes(moment.changes);
        for (Churn<Dim, T>* each : {&churn, &whole, &replica}) {
            each->twin = moment.twin;
            each->random = moment.random;
            ASSERT_EQ(each->world->save(), moment.whole) << round;
            ASSERT_TRUE(each->world->began().empty() && each->world->persisted().empty());
        }
        ASSERT_EQ(churn.world->pairs().to_vector(), whole.world->pairs().to_vector());
        ASSERT_EQ(churn.world->stats().resting, whole.world->stats().resting);
        Bytes again, of_replica;
        churn.world->save_changes(again);
        replica.world->save_changes(of_replica);
        ASSERT_EQ(again, moment.changes) << round;
        ASSERT_EQ(of_replica, moment.changes) << round;
        if (round % 2 == 0) {
            const auto questions = [&](const Churn<Dim, T>& each) {
                return Questions<Dim, T>(each, 1).agree();
            };
            ASSERT_TRUE(questions(churn));
        }
        for (int update = 0; update < 6; ++update) {
            const std::uint32_t commands = churn.random.below(update < 3 ? 20 : 2);
            (void)whole.random.below(2), (void)replica.random.below(2);
            for (std::uint32_t k = commands; k > 0; --k)
                churn.operate(200), whole.operate(200), replica.operate(200);
            ASSERT_TRUE(churn.update(false)) << round << ' ' << update;
            ASSERT_TRUE(whole.update(false)) << round << ' ' << update;
            ASSERT_TRUE(replica.update(false)) << round << ' ' << update;
            ASSERT_TRUE(same_results(*churn.world, *whole.world)) << round << ' ' << update;
            ASSERT_TRUE(same_results(*churn.world, *replica.world)) << round << ' ' << update;
        }
    }
    EXPECT_TRUE((Questions<Dim, T>(churn, 1).agree()));
    // The base itself: nothing differs, and it is what was saved.
    Churn<Dim, T> first(seed, 8, callback, options);
    first.world->restore(base);
    ASSERT_EQ(first.world->save_base(), base);
    Bytes nothing;
    first.world->save_changes(nothing);
    churn.world->restore_changes(nothing);
    EXPECT_EQ(churn.world->save(), base);
}

TEST(Changes, RestoredTheyAreWhatAWholeSnapshotIs)
{
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        jostle::WorldOptions options;
        options.margin = seed == 2 ? 0.25 : 0;
        if (seed % 3 == 1) { // without a callback and with one
            go_back_and_forth<3, double>(seed, seed % 2 == 0, options);
            go_back_and_forth<2, float>(seed, seed % 2 == 1, options);
        } else {
            go_back_and_forth<3, float>(seed, seed % 2 == 0, options);
            go_back_and_forth<2, double>(seed, seed % 2 == 1, options);
        }
    }
}

// 20,000 rest, 1,000 came to rest and move now and then: more than a world parks at a time.
TEST(Changes, CostWhatChangedNotWhatRests)
{
    jostle::World3f world;
    for (int i = 0; i < 20000; ++i)
        (void)world.add(cube_at(static_cast<float>(i % 200) * 3, static_cast<float>(i / 200) * 3));
    std::vector<ObjectId> movers(1500);
    for (std::size_t i = 0; i < movers.size(); ++i)
        movers[i] =
            world.add(cube_at(static_cast<float>(i % 150) * 4, 1000 + static_cast<float>(i / 150) * 4));
    while (world.update(), world.stats().active != 0) {
    }
    const Bytes base = world.save_base();
    Bytes changes;
    world.save_changes(changes);
    EXPECT_LT(changes.size(), 200u) << "nothing has changed";
    std::vector<Bytes> wholes, deltas;
    for (int frame = 0; frame < 20; ++frame) {
        for (std::size_t i = 0; i < (frame % 10 < 5 ? movers.size() : 3); ++i)
            world.move(movers[i], cube_at(static_cast<float>(i % 150) * 4 + 0.1f * static_cast<float>(frame),
                                          1000 + static_cast<float>(i / 150) * 4));
        world.update();
        world.save_changes(changes);
        EXPECT_LT(changes.size(), 200 + movers.size() * 60);
        wholes.push_back(world.save());
        deltas.push_back(changes);
    }
    EXPECT_GT(base.size(), 20000u * 40);
    for (std::size_t frame : {std::size_t{3}, std::size_t{17}, std::size_t{0}, std::size_t{19}}) {
        world.restore_changes(deltas[frame]);
        jostle::World3f whole;
        whole.restore(wholes[frame]);
        for (int update = 0; update < 30; ++update) {
            ASSERT_TRUE(same_results(world, whole)) << frame << ' ' << update;
            for (jostle::World3f* each : {&world, &whole}) {
                if (update == 3) each->move(movers[7], cube_at(0, 0));
                each->update();
            }
        }
    }
}

// What a layer remembers follows a world that goes back.
TEST(Changes, QuestionsWithAMaskSeeWhereTheWorldWent)
{
    jostle::World3f world({.layers = {{.mask = 2}}});
    std::vector<ObjectId> ids(6000);
    for (std::size_t i = 0; i < ids.size(); ++i) {
        jostle::ObjectOptions<float> options;
        options.filter.category = i % 8 == 0 ? 2u : 1u;
        ids[i] =
            world.add(cube_at(static_cast<float>(i % 100) * 2, static_cast<float>(i / 100) * 2), options);
    }
    while (world.update(), world.stats().active != 0) {
    }
    (void)world.save_base();
    Bytes start;
    world.save_changes(start);
    const auto count = [&] {
        jostle::ObjectQueryFilter filter;
        filter.mask = 2;
        return world.count(jostle::Aabb3f{{0, 0, 0}, {50, 50, 1}}, filter);
    };
    const std::uint64_t before = count();
    for (std::size_t i = 0; i < 160; i += 8)
        world.move(ids[i], cube_at(5000, 5000)); // two rows' worth of those that are asked about
    jostle::ObjectFilter other;
    other.category = 2;
    world.set_filter(ids[1], other);
    while (world.update(), world.stats().active != 0) {
    }
    const std::uint64_t meanwhile = count();
    EXPECT_NE(meanwhile, before);
    Bytes later;
    world.save_changes(later);
    for (int k = 0; k < 3; ++k) {
        world.restore_changes(start);
        EXPECT_EQ(count(), before);
        world.restore_changes(later);
        EXPECT_EQ(count(), meanwhile);
    }
}

/// A world with something of everything that differs, and the changes that say so.
struct Sample
{
    jostle::WorldOptions options;
    Bytes base, changes;
    std::unique_ptr<jostle::World3f> world;

    Sample()
    {
        options.accept = [](ObjectId, ObjectId b) { return b.index != 2 && b.index != 7; };
        world = std::make_unique<jostle::World3f>(options);
        std::vector<ObjectId> ids(7);
        world->add(std::vector<jostle::Aabb3f>(7, cube_at(0, 0)), ids);
        world->update();
        world->remove(ids[4]);
        world->remove(ids[5]);
        for (int k = 0; k < 5; ++k)
            world->update();
        base = world->save_base();
        world->set_margin(ids[1], 0.5f);
        world->set_enabled(ids[3], false);
        world->remove(ids[2]);
        world->set_user_data(ids[6], 77);
        for (int k = 0; k < 3; ++k)
            (void)world->add(cube_at(0.25f, 0));
        world->update();
        world->move(ids[0], cube_at(0, 0.5f));
        world->update();
        world->save_changes(changes);
        EXPECT_GT(world->stats().refused, 0u);
        EXPECT_GT(world->stats().active, 0u);
    }
};

ErrorCode error_of_restoring(jostle::World3f& world, const Bytes& bytes)
{
    return code_of("changes: ", [&] { world.restore_changes(bytes); });
}

TEST(Changes, EveryAlteredByteAndEveryCutIsRefused)
{
    Sample sample;
    const Bytes& good = sample.changes;
    jostle::World3f world(sample.options);
    world.restore(sample.base);
    ASSERT_EQ(world.save_base(), sample.base);
    const ObjectId a = world.id(0);
    world.move(a, cube_at(3, 3));
    world.update();
    world.move(a, cube_at(4, 4));
    world.apply();
    const Bytes own = world.save();
    expect_refused_when_altered(good, [&](const Bytes& bad) { return error_of_restoring(world, bad); });
    EXPECT_EQ(code_of("this is a whole snapshot", [&] { world.restore_changes(sample.base); }),
              ErrorCode::bad_snapshot);
    EXPECT_EQ(code_of("these are changes since a base", [&] { world.restore(good); }),
              ErrorCode::bad_snapshot);
    EXPECT_EQ(world.save(), own) << "refused changes change nothing";
    EXPECT_EQ(world.box(a).lo[0], 4) << "and what apply() shows stays";
    world.restore_changes(good);
    EXPECT_EQ(world.save(), sample.world->save());
}

TEST(Changes, OfAnotherBaseOrWithoutOneAreRefused)
{
    Sample sample;
    jostle::World3f without(sample.options);
    Bytes out;
    EXPECT_THROW(without.restore_changes(sample.changes), Error);
    EXPECT_THROW(without.save_changes(out), Error);
    without.restore(sample.base);
    EXPECT_THROW(without.restore_changes(sample.changes), Error) << "restored, but not said to be the base";
    const Bytes same = without.save_base();
    EXPECT_NO_THROW(without.restore_changes(sample.changes));
    jostle::World3f fork = without.fork();
    EXPECT_THROW(fork.save_changes(out), Error);

    const Bytes now = sample.world->save_base();
    EXPECT_EQ(error_of_restoring(*sample.world, sample.changes), ErrorCode::bad_snapshot) << "an older base";
    EXPECT_EQ(sample.world->save(), now);
    sample.world->clear();
    EXPECT_THROW(sample.world->save_changes(out), Error);
    jostle::World3d of_doubles;
    (void)of_doubles.save_base();
    EXPECT_THROW(of_doubles.restore_changes(sample.changes), Error);
}

TEST(Changes, WhoeverKnowsTheChecksumDoesNoHarmEither)
{
    Sample sample;
    const Bytes& good = sample.changes;
    Bytes resealed = good;
    seal(resealed);
    ASSERT_EQ(resealed, good);
    Random random(3);
    int refused = 0, taken = 0;
    for (int k = 0; k < 6000; ++k) {
        Bytes bad = good;
        for (std::uint32_t n = 1 + random.below(2); n > 0; --n)
            bad[48 + random.below(static_cast<std::uint32_t>(bad.size() - 48))] =
                static_cast<std::byte>(random.below(random.below(2) == 0 ? 256 : 8));
        seal(bad);
        jostle::World3f& world = *sample.world;
        const Bytes before = k % 50 == 0 ? world.save() : Bytes();
        try {
            world.restore_changes(bad);
        } catch (const Error&) {
            ++refused;
            if (k % 50 == 0) {
                ASSERT_EQ(world.save(), before);
            }
            continue;
        }
        ++taken; // another filter, or another box: whatever it says is possible
        for (std::uint32_t i = 0; i < world.index_end(); ++i)
            if (world.contains(world.id(i))) world.move(world.id(i), {{0, 0, 0}, {2, 2, 2}});
        (void)world.add({{0, 0, 0}, {1, 1, 1}});
        world.update();
        (void)world.pairs();
    }
    EXPECT_GT(refused, 1000);
    EXPECT_GT(taken, 1000);
    sample.world->restore_changes(good);
    jostle::World3f fresh(sample.options);
    fresh.restore(sample.base);
    (void)fresh.save_base();
    fresh.restore_changes(good);
    EXPECT_EQ(sample.world->save(), fresh.save()) << "none of it has left a trace";
}

// Their indices lie beyond all that the world has room for.
TEST(Changes, ForgetWhatIsQueuedWithUserData)
{
    jostle::World3f world;
    const ObjectId first = world.add(cube_at(0, 0));
    world.update();
    const Bytes base = world.save_base();
    Bytes changes;
    world.save_changes(changes);
    for (int i = 0; i < 3000; ++i)
        world.set_user_data(world.add(cube_at(0, 0), {.user_data = 1}), 2);
    Bytes meanwhile;
    world.save_changes(meanwhile);
    world.restore_changes(changes);
    EXPECT_EQ(world.save(), base);
    world.update();
    EXPECT_EQ(world.size(), 1u);
    EXPECT_TRUE(world.contains(first));
    EXPECT_EQ(world.user_data(world.add(cube_at(0, 0))), 0u);
}

// Another box with the same bounds, in the very update in which the object comes to rest.
TEST(Changes, KnowTheBoxOfWhoComesToRest)
{
    jostle::World2f world;
    const ObjectId id = world.add({{0, 0}, {1, 1}});
    world.update();
    world.move(id, {{0, 0}, {1, 1}}, {1, 0});
    for (int update = 0; update < 3; ++update)
        world.update();
    const Bytes base = world.save_base();
    Bytes then, now;
    world.save_changes(then);
    world.move(id, {{0, 0}, {2, 1}});
    world.update();
    ASSERT_EQ(world.stats().settled, 1u);
    world.save_changes(now);
    jostle::World2f other;
    other.restore(base);
    (void)other.save_base();
    other.restore_changes(now);
    EXPECT_EQ(other.box(id).hi[0], 2);
    EXPECT_EQ(other.save(), world.save());
    world.restore_changes(then);
    EXPECT_EQ(world.box(id).hi[0], 1);
    EXPECT_EQ(world.save(), base);
}

// A walker meets everybody, and `accept` is against each: nothing of it stays.
TEST(Changes, RefusedPairsThatArePastTakeNoMemory)
{
    jostle::WorldOptions options;
    options.accept = [](ObjectId, ObjectId) { return false; };
    jostle::World3f world(options);
    for (int i = 0; i < 300; ++i)
        (void)world.add(cube_at(static_cast<float>(3 * i), 0));
    const ObjectId walker = world.add(cube_at(0, 9));
    for (int update = 0; update < 4; ++update)
        world.update();
    (void)world.save_base();
    std::uint64_t early = 0;
    for (int i = 0; i < 300; ++i) {
        world.move(walker, cube_at(static_cast<float>(3 * i), 0));
        world.update();
        ASSERT_EQ(world.stats().refused, 1u);
        if (i == 30) early = world.stats().bytes_reserved;
    }
    EXPECT_LE(world.stats().bytes_reserved, early + 256);
}

// Objects that are queued have the free indices of the base, and lose them.
TEST(Changes, ForgetTheIdsOfWhatIsQueued)
{
    jostle::World3f world;
    const ObjectId gone = world.add(cube_at(0, 0));
    world.update();
    world.remove(gone);
    world.update();
    (void)world.save_base();
    Bytes changes;
    world.save_changes(changes);
    const ObjectId queued = world.add(cube_at(0, 0));
    ASSERT_EQ(queued.index, gone.index);
    EXPECT_NO_THROW(world.move(queued, cube_at(1, 1)));
    world.restore_changes(changes);
    EXPECT_THROW(world.move(queued, cube_at(1, 1)), Error);
    EXPECT_EQ(world.add(cube_at(0, 0)), queued) << "handed out again";
}

// Of pairs that are no longer refused it doesn't matter whether their objects are there.
TEST(Changes, ANumberThatStandsForNoPairIsRefused)
{
    jostle::World3f world({.accept = [](ObjectId, ObjectId) { return false; }});
    std::vector<ObjectId> ids(3);
    const std::vector<jostle::Aabb3f> boxes{cube_at(9, 9), cube_at(0, 0), cube_at(0, 0)};
    world.add(boxes, ids);
    world.update();
    (void)world.save_base();
    world.move(ids[1], cube_at(5, 5));
    world.update();
    Bytes changes;
    world.save_changes(changes);
    std::array<std::byte, 12> pair{}; // of objects 1 and 2, no longer refused
    pair[0] = std::byte{2};
    pair[4] = std::byte{1};
    const auto at = std::search(changes.begin(), changes.end(), pair.begin(), pair.end());
    ASSERT_NE(at, changes.end());
    std::fill_n(at, 8, std::byte{0xff});
    seal(changes);
    EXPECT_EQ(
        code_of("a refused pair names an object that isn't there", [&] { world.restore_changes(changes); }),
        ErrorCode::bad_snapshot);
}

std::uint64_t read(const Bytes& bytes, std::size_t at, std::size_t size)
{
    std::uint64_t number = 0;
    for (std::size_t k = 0; k < size; ++k)
        number |= std::uint64_t{static_cast<unsigned char>(bytes[at + k])} << (8 * k);
    return number;
}

/// Where the list of refused pairs begins, with its length: see save_changes.cpp.
std::size_t refused_in(const Bytes& changes)
{
    std::size_t at = 48 + 8;
    const std::uint64_t objects = read(changes, at, 8);
    at += 8;
    for (std::uint64_t k = 0; k < objects; ++k) {
        at += 8; // index and generation
        if (read(changes, at - 4, 4) == 0) continue;
        const std::uint64_t bits = read(changes, at, 4);
        at += 4 + ((bits & 1u << 7) != 0 ? 8 : 0) + 3 * 4 + sizeof(jostle::Aabb3f);
        at += (bits & 1u << 5) != 0 ? sizeof(jostle::Aabb3f) + 4 * sizeof(float) : 0;
    }
    at += 8;                             // free indices that are left
    for (int list = 0; list < 2; ++list) // those behind them, and active objects
        at += 8 + 8 * read(changes, at, 8);
    return at;
}

/// Without an entry of the list of refused pairs.
void drop_an_entry(Bytes& changes, Random& random)
{
    constexpr std::size_t entry = 12;
    const std::size_t at = refused_in(changes);
    const std::uint64_t count = read(changes, at, 8);
    if (count == 0) return;
    write(changes, at, count - 1);
    const std::size_t k = random.below(static_cast<std::uint32_t>(count));
    const auto first = changes.begin() + static_cast<std::ptrdiff_t>(at + 8 + entry * k);
    changes.erase(first, first + entry);
    seal_with_size(changes);
}

TEST(Changes, ARefusedPairOfAnObjectThatIsGoneIsRefused)
{
    jostle::World3f world({.accept = [](ObjectId, ObjectId) { return false; }});
    const std::vector<jostle::Aabb3f> boxes(2, cube_at(0, 0));
    std::vector<ObjectId> ids(2);
    world.add(boxes, ids);
    world.update();
    (void)world.save_base();
    Bytes none, changes;
    world.save_changes(none);
    world.remove(ids[1]);
    world.update();
    world.save_changes(changes);
    Random random(1);
    drop_an_entry(changes, random);
    for (const bool is_there : {false, true}) { // now
        if (is_there) world.restore_changes(none);
        const Bytes before = world.save();
        EXPECT_EQ(code_of("a refused pair names an object that isn't there",
                          [&] { world.restore_changes(changes); }),
                  ErrorCode::bad_snapshot);
        EXPECT_EQ(world.save(), before);
    }
}

/// A small world in which much touches, some of which is refused, with changes since a base.
struct Crowd
{
    jostle::World3f world;
    Bytes base;
    std::vector<Bytes> wholes, changes;

    explicit Crowd(Random& random)
        : world({.accept = [](ObjectId a, ObjectId b) { return (a.index + 3 * b.index) % 4 != 0; }})
    {
        for (int k = 0; k < 14; ++k)
            add(random);
        for (std::uint32_t k = 1 + random.below(5); k > 0; --k)
            world.update();
        base = world.save_base();
        for (int moment = 0; moment < 6; ++moment) {
            for (std::uint32_t k = random.below(4); k > 0; --k)
                command(random);
            world.update();
            wholes.push_back(world.save());
            world.save_changes(changes.emplace_back());
        }
    }
    void add(Random& random)
    {
        (void)world.add(
            cube_at(static_cast<float>(random.uniform(0, 3)), static_cast<float>(random.uniform(0, 3))));
    }
    void command(Random& random)
    {
        const ObjectId id = world.id(random.below(world.index_end()));
        if (!world.contains(id)) return add(random);
        if (random.below(2) == 0) return world.remove(id);
        world.move(id, cube_at(static_cast<float>(random.uniform(0, 3)), 0));
    }
};

// Whatever is taken is a world that can be saved, restored and forked.
TEST(Changes, ForgedOnesThatAreTakenAreOfAWholeWorld)
{
    int refused = 0, taken = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        Random random(seed);
        Crowd crowd(random);
        for (int k = 0; k < 60; ++k) {
            const std::size_t moment = random.below(6);
            Bytes forged = crowd.changes[moment];
            for (std::uint32_t n = 1 + random.below(2); n > 0; --n)
                drop_an_entry(forged, random);
            if (random.below(3) == 0) { // nothing has differed from the base so far
                crowd.world.restore(crowd.base);
                (void)crowd.world.save_base();
            }
            const Bytes before = crowd.world.save();
            try {
                crowd.world.restore_changes(forged);
                ++taken;
                ASSERT_EQ(crowd.world.fork().save(), crowd.world.save()) << seed << ' ' << k;
                crowd.world.update();
            } catch (const Error& error) {
                ASSERT_EQ(error.code(), ErrorCode::bad_snapshot) << seed << ' ' << k << ": " << error.what();
                ASSERT_EQ(crowd.world.save(), before) << seed << ' ' << k;
                ++refused;
            }
            if (k % 8 != 0) continue;
            crowd.world.restore_changes(crowd.changes[moment]);
            ASSERT_EQ(crowd.world.save(), crowd.wholes[moment]) << seed << ' ' << k;
        }
    }
    EXPECT_GT(refused, 300);
    EXPECT_GT(taken, 300);
}

// Those that are refused late, when all of them have been read.
TEST(Changes, ThatAreRefusedLeaveWhatApplyShows)
{
    Sample sample;
    Bytes longer = sample.changes;
    longer.resize(longer.size() + 8);
    seal_with_size(longer);
    const std::size_t size = sample.world->size();
    (void)sample.world->add(cube_at(0, 0));
    sample.world->apply();
    EXPECT_EQ(sample.world->size(), size + 1);
    EXPECT_EQ(error_of_restoring(*sample.world, longer), ErrorCode::bad_snapshot);
    EXPECT_EQ(sample.world->size(), size + 1);
}

} // namespace
} // namespace world_tests
