// SPDX-License-Identifier: MIT
// A world with slack says what one without says, and searches less.
#include "questions.hpp"

namespace world_tests {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Moves of all objects that hardly go anywhere, of one in `idle` none, among the commands of a churn.
template <int Dim, class T>
class Breathing
{
  public:
    Breathing(std::uint64_t seed, double extent, bool callback, jostle::WorldOptions options, double by)
        : churn_(seed, extent, callback, options), by_(by)
    {
        options.slack = 0;
        if (callback)
            options.accept = [this](ObjectId a, ObjectId b) { return accepts(churn_.twin.salt, a, b); };
        churn_.beside.push_back(std::make_unique<jostle::World<Dim, T>>(options));
    }
    Churn<Dim, T>& operator*() { return churn_; }

    void breathe(std::uint32_t idle)
    {
        for (auto& [index, thing] : churn_.twin.things) {
            if (churn_.random.below(idle) == 0) continue;
            const auto base = base_.find(thing.id);
            Aabb<Dim, T> box = base == base_.end() ? (base_[thing.id] = thing.box) : base->second;
            for (int d = 0; d < Dim; ++d) {
                const T by = static_cast<T>(churn_.random.uniform(-by_, by_));
                box.lo[d] += by;
                box.hi[d] += by;
            }
            thing.box = box;
            thing.displacement = {};
            churn_.say(thing.id, [id = thing.id, box](jostle::World<Dim, T>& each) { each.move(id, box); });
        }
    }
    /// From now on boxes breathe where they are.
    void settle() { base_.clear(); }
    /// The world with slack, the one without and the twin.
    testing::AssertionResult update(bool with_pairs)
    {
        if (const auto same = churn_.update(with_pairs); !same) return same;
        jostle::World<Dim, T>& plain = *churn_.beside.front();
        plain.update();
        if (with_pairs && plain.save() != churn_.world->save())
            return testing::AssertionFailure() << "another snapshot than without slack";
        const jostle::WorldStats &with = churn_.world->stats(), &without = plain.stats();
        padded += with.padded;
        changed += with.changed;
        if (with.resting != without.resting || with.changed != without.changed || without.padded != 0)
            return testing::AssertionFailure() << "other objects are at rest than without slack";
        return agree(plain, churn_.twin, false);
    }
    std::uint64_t padded = 0, changed = 0;

  private:
    Churn<Dim, T> churn_;
    double by_;
    std::map<ObjectId, Aabb<Dim, T>> base_;
};

template <int Dim, class T>
void breathe(std::uint64_t seed, double extent, std::size_t objects, bool callback, double slack,
             jostle::Executor& executor, double by = 0.02)
{
    Breathing<Dim, T> breathing(seed, extent, callback, {.executor = &executor, .slack = slack}, by);
    Churn<Dim, T>& churn = *breathing;
    for (int update = 0; update < 150; ++update) {
        // Some come, go or leap in some updates, many at once in a few; then all stop for a while.
        std::uint32_t commands = update == 0 ? static_cast<std::uint32_t>(3 * objects) : 0;
        if (update % 3 == 1) commands = churn.random.below(6);
        if (update % 50 == 49) commands = static_cast<std::uint32_t>(objects) / 2;
        if (callback && update % 16 == 15) churn.twin.salt = churn.random.next();
        for (std::uint32_t k = 0; k < commands; ++k)
            churn.operate(objects);
        if (update % 30 == 29) breathing.settle();
        if (update % 40 < 34) breathing.breathe(update % 20 < 10 ? 1000 : 4);
        ASSERT_TRUE(breathing.update(update % 8 == 0)) << "seed " << seed << ", update " << update;
    }
    if (slack == 0.125 && objects > 100) {
        EXPECT_GT(breathing.padded, objects / 2) << "nobody was ever padded";
        EXPECT_LT(breathing.padded, breathing.changed / 4) << "hardly anybody stays";
    }
}

TEST(Slack, SaysWhatAWorldWithoutItSays)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const bool callback = seed % 2 == 0;
        jostle::Executor& executor = seed > 2 ? *threads : jostle::serial_executor();
        for (const double slack : {0.125, 1e-3, 2.0, 1e30}) {
            breathe<3, float>(seed, 7, 250, callback, slack, executor);
            breathe<2, double>(seed, 12, 150, callback, slack, executor);
        }
        breathe<2, float>(seed, 2, 30, callback, 0.125, executor);        // about as few as are searched for
        breathe<3, double>(seed, 6, 150, callback, 0.01, executor, 0.02); // many leave, and come back
    }
}

TEST(Slack, SaysTheSameOfManyOnAllThreads)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    const auto run = [](jostle::Executor& executor, double slack) {
        jostle::World3f world({.executor = &executor, .slack = slack});
        Random random(5, 1, 1);
        std::vector<Aabb<3, float>> base(20'000);
        for (auto& box : base)
            box = random_box<3, float>(random, 30, false);
        std::vector<ObjectId> ids(base.size());
        world.add(std::span<const Aabb<3, float>>(base), ids);
        std::vector<std::vector<Pair>> told;
        std::vector<Aabb<3, float>> boxes = base;
        for (int update = 0; update < 12; ++update) {
            for (std::size_t i = 0; i < base.size(); ++i) {
                const bool leaps = update % 3 == 2 && random.below(500) == 0;
                for (int d = 0; d < 3; ++d) {
                    const auto by = static_cast<float>(random.uniform(-0.01, 0.01));
                    if (leaps) base[i].lo[d] += 1, base[i].hi[d] += 1;
                    boxes[i].lo[d] = base[i].lo[d] + by;
                    boxes[i].hi[d] = base[i].hi[d] + by;
                }
            }
            world.update(ids, std::span<const Aabb<3, float>>(boxes));
            EXPECT_LT(world.stats().padded, update < 3 ? base.size() + 1 : base.size() / 20) << update;
            told.push_back(world.changed_pairs().to_vector());
            EXPECT_GT(told.back().size(), base.size());
        }
        return told;
    };
    const auto expected = run(jostle::serial_executor(), 0);
    EXPECT_EQ(run(jostle::serial_executor(), 0.05), expected);
    EXPECT_EQ(run(*threads, 0.05), expected);
}

/// Where all move far in each update, it is tried again from time to time only.
TEST(Slack, HoldsBackWhereItDoesNotPay)
{
    Random random(2, 1, 1);
    std::vector<Aabb<3, float>> boxes(400);
    for (auto& box : boxes)
        box = random_box<3, float>(random, 8, false);
    jostle::World3f world({.executor = &jostle::serial_executor(), .slack = 0.01});
    std::vector<ObjectId> ids(boxes.size());
    world.add(std::span<const Aabb<3, float>>(boxes), ids);
    const auto move = [&](float by) {
        for (auto& box : boxes)
            box.lo[0] += by, box.hi[0] += by;
        world.update(ids, std::span<const Aabb<3, float>>(boxes));
        return world.stats().padded;
    };
    world.update();
    std::uint64_t padded = 0;
    for (int update = 0; update < 200; ++update)
        padded += move(0.5f);
    EXPECT_GE(padded, boxes.size());
    EXPECT_LT(padded, 12 * boxes.size());
    int tried = 0;
    for (int update = 0; update < 200; ++update)
        tried += move(update % 2 == 0 ? 1e-3f : -1e-3f) != 0;
    EXPECT_EQ(tried, 1) << "it isn't tried again, or doesn't last";
}

TEST(Slack, MustBeANumber)
{
    for (const double slack : {-1.0, infinity, std::numeric_limits<double>::quiet_NaN(), 1e300}) {
        try {
            jostle::World3f world({.slack = slack});
            ADD_FAILURE() << slack;
        } catch (const jostle::Error& error) {
            EXPECT_EQ(error.code(), jostle::ErrorCode::invalid_argument);
            EXPECT_NE(std::string(error.what()).find("slack "), std::string::npos) << error.what();
        }
    }
    EXPECT_NO_THROW(jostle::World3d({.slack = 1e300}));
}

} // namespace
} // namespace world_tests
