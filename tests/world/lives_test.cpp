// SPDX-License-Identifier: MIT
// Long lives. Most objects rest; a third moves on and on, each along one axis at a time; now and then
// something is added, removed or gets another filter. Updates fail in every way, and are tried again. Other
// worlds were restored from its snapshots or forked from it, and their updates never fail. All must agree
// with the twin.
//   JOSTLE_LIVES   how many seeds for each kind of world (1); a hundred for a thorough run
// A failure names seed and update: the test with that seed, up to that update, is the way to see it again.
#include <condition_variable>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <thread>

#include "questions.hpp"
#include "tests/contract/counting_memory.hpp"

namespace world_tests {
namespace {

std::uint64_t seeds_wanted()
{
    const char* const text = std::getenv("JOSTLE_LIVES");
    return text == nullptr ? 1 : std::strtoull(text, nullptr, 0);
}

/// Threads that live long: a World tells those who speak to it apart by thread. The first is the caller.
class Speakers
{
  public:
    explicit Speakers(std::uint32_t count) : said(count)
    {
        for (std::uint32_t t = 1; t < count; ++t)
            threads_.emplace_back([this, t] { listen(t); });
    }
    ~Speakers()
    {
        {
            const std::lock_guard lock(mutex_);
            round_ = ~0u;
        }
        changed_.notify_all();
        for (std::thread& thread : threads_)
            thread.join();
    }
    std::vector<std::vector<std::function<void()>>> said; ///< by thread

    /// Each says what is its own, all at the same time.
    void speak()
    {
        {
            const std::lock_guard lock(mutex_);
            speaking_ = threads_.size();
            ++round_;
        }
        changed_.notify_all();
        say(0);
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return speaking_ == 0; });
    }

  private:
    void say(std::uint32_t t)
    {
        for (const auto& call : said[t])
            call();
        said[t].clear();
    }
    void listen(std::uint32_t t)
    {
        for (std::uint32_t heard = 0;; ++heard) {
            {
                std::unique_lock lock(mutex_);
                changed_.wait(lock, [&] { return round_ != heard; });
                if (round_ == ~0u) return;
            }
            say(t);
            const std::lock_guard lock(mutex_);
            if (--speaking_ == 0) changed_.notify_all();
        }
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::uint32_t round_ = 0;
    std::size_t speaking_ = 0;
    std::vector<std::thread> threads_;
};

struct Strike
{
};

/// Another one, which throws when it is called for the `calls_until_strike`th time, before or after the work.
class StrikingExecutor final : public jostle::Executor
{
  public:
    static constexpr std::uint64_t never = ~std::uint64_t{0};
    std::atomic<std::uint64_t> calls_until_strike{never};
    bool does_the_work = true;

    explicit StrikingExecutor(jostle::Executor& other) : other_(other) {}
    std::uint32_t concurrency() const noexcept override { return other_.concurrency(); }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        const bool strikes = calls_until_strike != never && calls_until_strike-- == 0;
        if (!strikes || does_the_work) other_.run(count, task);
        if (strikes) throw Strike{};
    }

  private:
    jostle::Executor& other_;
};

/// What a world says of its last update, and what it is.
template <int Dim, class T>
struct Record
{
    std::vector<ObjectPair> began;
    std::vector<EndedPair> ended;
    std::vector<Pair> persisted;
    std::vector<std::byte> saved;

    explicit Record(const jostle::World<Dim, T>& world, bool with_snapshot = true)
        : began(world.began().begin(), world.began().end()),
          ended(world.ended().begin(), world.ended().end()),
          persisted(world.persisted().to_vector())
    {
        if (with_snapshot) saved = world.save();
    }
    /// In words, where the other differs.
    [[nodiscard]] std::string differences(const Record& other) const
    {
        std::string all;
        if (began != other.began) all += " began";
        if (ended != other.ended) all += " ended";
        if (persisted != other.persisted) all += " persisted";
        if (saved != other.saved) all += " snapshot";
        return all;
    }
};

struct Plan
{
    std::uint32_t threads = 1;
    std::size_t objects = 400;
    double extent = 8;
    int updates = 300, updates_between_failures = 3;
    bool callback = true, giants = true;
    double margin = 0;
};

template <int Dim, class T>
class Lives
{
  public:
    Lives(std::uint64_t seed, const Plan& plan)
        : plan_(plan),
          pool_(jostle::make_thread_executor(plan.threads)),
          executor_(*pool_),
          speakers_(plan.threads),
          churn_(seed, plan.extent, plan.callback,
                 {.executor = &executor_, .memory = &memory_, .margin = plan.margin})
    {
        churn_.giants = plan.giants;
        churn_.owners = 300;
        if (plan.threads > 1)
            churn_.dispatch = [this](ObjectId id, std::function<void()> call) {
                speakers_.said[id.index % plan_.threads].push_back(std::move(call));
            };
    }

    void live()
    {
        for (std::size_t k = 0; k < 2 * plan_.objects; ++k)
            churn_.operate(plan_.objects);
        for (update_ = 0; update_ < plan_.updates; ++update_) {
            command();
            fail_some();
            if (testing::Test::HasFatalFailure()) return;
            if (!updated_) {
                choose_moves(false);
                ASSERT_TRUE(try_update()) << "update " << update_;
            }
            if (testing::Test::HasFatalFailure()) return;
            if (update_ % 16 == 3 || update_ % 100 >= 90) ask();
            if (update_ % 24 == 20) renew_companions();
            if (testing::Test::HasFatalFailure()) return;
        }
        EXPECT_GT(met_resting_, 0u);
        EXPECT_GT(churn_.world->stats().resting, churn_.world->stats().active);
        for (const std::uint64_t reason : churn_.ended)
            EXPECT_TRUE(reason > 0 || plan_.updates < 100);
        EXPECT_GT(listed_, 20u);
        EXPECT_GT(failures_[by_box] + failures_[by_id], 0u);
        EXPECT_GT(failures_[by_memory], 0u);
        if (plan_.callback) {
            EXPECT_GT(failures_[by_accept], 0u);
        }
    }
    [[nodiscard]] std::uint64_t strikes() const { return failures_[by_executor]; }

  private:
    using Box = Aabb<Dim, T>;
    using World = jostle::World<Dim, T>;
    struct Mover
    {
        ObjectId id;
        int axis, left;
        T step;
    };
    enum Fault
    {
        by_nothing,
        by_accept,
        by_executor,
        by_memory,
        by_box,
        by_id,
        faults
    };

    Random& random() { return churn_.random; }
    bool is_there(ObjectId id) const
    {
        const auto thing = churn_.twin.things.find(id.index);
        return thing != churn_.twin.things.end() && thing->second.id == id;
    }

    /// What is queued for this update: some moves, and now and then something else.
    void command()
    {
        updated_ = false;
        const int phase = update_ % 100;
        const std::uint32_t others = update_ == 0 || phase >= 90 ? 0
                                     : phase == 64    ? static_cast<std::uint32_t>(plan_.objects / 4)
                                     : phase % 3 == 0 ? random().below(6)
                                                      : 0;
        for (std::uint32_t k = 0; k < others; ++k)
            churn_.operate(plan_.objects);
        if (plan_.callback && update_ % 16 == 15) churn_.twin.salt = random().next();
        turn_movers(phase);
        moving_ = phase < 90 || phase == 94; // now and then nobody moves, until all rest
        in_place_ = random().below(2) == 0;
        // Where nothing else is said, and what moves in place is boxes alone, a world takes a shorter way.
        plain_ = in_place_ && others == 0 && random().below(2) == 0;
        for (const Mover& mover : movers_) {
            if (!moving_ || plain_ || !is_there(mover.id) || goes_in_place(mover.id)) continue;
            auto& thing = churn_.twin.things.at(mover.id.index);
            thing.box = moved_on(mover);
            thing.displacement = {};
            churn_.say(mover.id, [id = mover.id, box = thing.box](World& each) { each.move(id, box); });
        }
        speak();
    }
    /// Each has a way of some seventy updates along one axis, then another, or rests.
    void turn_movers(int phase)
    {
        std::vector<Mover> kept;
        const bool most_stop = phase == 30 || phase == 70;
        std::uint32_t stopping = phase == 30 ? 40 : 80;
        for (Mover mover : movers_) {
            if (!is_there(mover.id)) continue;
            if (most_stop && stopping != 0 && stopping-- != 0) continue;
            if (--mover.left < 0) {
                if (random().below(3) == 0) continue;
                mover = set_out(mover.id);
            }
            kept.push_back(mover);
        }
        movers_ = kept;
        const std::size_t wanted = plan_.objects / 3;
        std::size_t starting = update_ == 4 || phase == 95 ? wanted : std::min<std::size_t>(wanted, 3);
        for (; update_ > 3 && starting != 0 && movers_.size() < wanted; --starting) {
            const ObjectId id = churn_.any_thing().id;
            const bool moves = std::any_of(movers_.begin(), movers_.end(),
                                           [id](const Mover& mover) { return mover.id == id; });
            if (!moves) movers_.push_back(set_out(id));
        }
    }
    Mover set_out(ObjectId id)
    {
        const T step = static_cast<T>(random().uniform(0.01, 0.08)) * (random().below(2) == 0 ? T(1) : T(-1));
        return {id, static_cast<int>(random().below(Dim)), static_cast<int>(40 + random().below(60)), step};
    }
    Box moved_on(const Mover& mover) const
    {
        Box box = churn_.twin.things.at(mover.id.index).box;
        box.lo[mover.axis] += mover.step;
        box.hi[mover.axis] += mover.step;
        return box;
    }
    /// Objects that the calling thread may move in the call of update() itself: where other threads speak of
    /// them too, it isn't said who wins.
    bool goes_in_place(ObjectId id) const
    {
        return in_place_ && id.index % plan_.threads == 0 &&
               (!plain_ || churn_.twin.things.at(id.index).plain);
    }

    /// The boxes for update(ids, boxes): those of the movers; with `wild`, some of resting objects, too.
    void choose_moves(bool wild)
    {
        std::map<std::uint32_t, Box> chosen;
        for (const Mover& mover : movers_)
            if (moving_ && is_there(mover.id) && goes_in_place(mover.id))
                chosen[mover.id.index] = moved_on(mover);
        for (std::uint32_t k = wild ? 1 + random().below(20) : 0; k > 0; --k)
            if (const ObjectId id = churn_.any_thing().id; id.index % plan_.threads == 0)
                chosen[id.index] = random_box<Dim, T>(random(), plan_.extent, plan_.giants);
        for (std::uint32_t k = in_place_ ? random().below(4) : 0; k > 0; --k) // some stay where they are
            if (const auto& thing = churn_.any_thing();
                goes_in_place(thing.id) && chosen.count(thing.id.index) == 0)
                chosen[thing.id.index] = thing.box;
        ids_.clear();
        boxes_.clear();
        for (const auto& [index, box] : chosen) {
            ids_.push_back(churn_.twin.things.at(index).id);
            boxes_.push_back(box);
        }
        if (wild && random().below(2) == 0) { // in no order
            std::reverse(ids_.begin(), ids_.end());
            std::reverse(boxes_.begin(), boxes_.end());
        }
    }

    /// Some updates that fail, with more commands after each.
    void fail_some()
    {
        const std::uint32_t attempts =
            update_ % plan_.updates_between_failures == 0 ? 1 + random().below(2) : 0;
        for (std::uint32_t attempt = 0; attempt < attempts && !updated_; ++attempt) {
            choose_moves(random().below(2) == 0);
            const auto fault = static_cast<Fault>(1 + random().below(faults - 1));
            switch (fault) {
            case by_accept:
                if (plan_.callback) churn_.questions_until_refusal = random().below(4);
                break;
            case by_executor:
                executor_.does_the_work = random().below(2) == 0;
                executor_.calls_until_strike = random().below(4);
                break;
            case by_memory:
                memory_.failing_allocation = memory_.allocations + random().below(4);
                break;
            case by_box:
                if (boxes_.empty()) continue;
                boxes_[random().below(static_cast<std::uint32_t>(boxes_.size()))].hi[Dim - 1] =
                    std::numeric_limits<T>::quiet_NaN();
                break;
            default:
                ids_.push_back({static_cast<std::uint32_t>(plan_.objects * 100), 1});
                boxes_.push_back(random_box<Dim, T>(random(), plan_.extent));
            }
            const bool fails = !try_update();
            if (testing::Test::HasFatalFailure()) return;
            failures_[fault] += fails;
            ASSERT_TRUE(fails || (fault != by_box && fault != by_id)) << "update " << update_;
            for (std::uint32_t k = updated_ ? 0 : random().below(6); k > 0; --k)
                churn_.operate(plan_.objects);
            speak();
        }
    }

    /// The world's update, and if it succeeds that of all others.
    bool try_update()
    {
        const bool may_fail = churn_.questions_until_refusal != churn_.never ||
                              executor_.calls_until_strike != StrikingExecutor::never ||
                              memory_.failing_allocation != contract::CountingMemory::never;
        const Record<Dim, T> before(*churn_.world);
        churn_.asked = 0;
        bool failed = false;
        try {
            if (ids_.empty())
                churn_.world->update();
            else
                churn_.world->update(ids_, boxes_);
        } catch (const Refusal&) {
            failed = true;
        } catch (const Strike&) {
            failed = true;
        } catch (const std::bad_alloc&) {
            failed = true;
        } catch (const jostle::Error&) { // a box, or an id
            failed = true;
        }
        churn_.questions_until_refusal = churn_.never;
        executor_.calls_until_strike = StrikingExecutor::never;
        memory_.failing_allocation = contract::CountingMemory::never;
        if (failed) {
            const std::string changes = before.differences(Record<Dim, T>(*churn_.world));
            check(changes.empty(), "a failed update changed" + changes);
            return false;
        }
        updated_ = true;
        if (may_fail)
            alike_ = false; // it may have gone without something, such as having objects come to rest
        for (std::size_t k = 0; k < ids_.size(); ++k) {
            auto& thing = churn_.twin.things.at(ids_[k].index);
            thing.box = boxes_[k];
            thing.displacement = {};
        }
        const std::uint64_t asked = churn_.asked;
        for (const auto& other : churn_.beside)
            other->update(ids_, boxes_);
        churn_.asked = asked; // which the others also are
        const testing::AssertionResult agrees = churn_.follow(update_ % 8 == 0);
        check(agrees, agrees.message());
        for (const auto& other : churn_.beside) {
            const std::string differences =
                Record<Dim, T>(*other, alike_).differences(Record<Dim, T>(*churn_.world, alike_));
            check(differences.empty(), "one that was restored or forked has other" + differences);
            const std::string counts = other_counts(other->stats(), churn_.world->stats());
            check(counts.empty(), "one that was restored or forked counts" + counts);
        }
        listed_ += churn_.world->stats().listed;
        met_resting_ += churn_.world->stats().resting != 0 ? churn_.world->stats().began : 0;
        return true;
    }

    /// In words, where they differ. How objects are found, and so what is looked at, may differ.
    std::string other_counts(const jostle::WorldStats& a, const jostle::WorldStats& b) const
    {
        std::ostringstream words;
        const auto compare = [&](const char* name, std::uint64_t x, std::uint64_t y) {
            if (x != y) words << " " << x << " " << name << ", not " << y << ";";
        };
        compare("changed", a.changed, b.changed);
        compare("refused", a.refused, b.refused);
        compare("began", a.began, b.began);
        compare("ended", a.ended, b.ended);
        compare("persisted", a.persisted, b.persisted);
        compare("disabled", a.disabled, b.disabled);
        if (alike_) {
            compare("settled", a.settled, b.settled);
            compare("woken", a.woken, b.woken);
        }
        return words.str();
    }

    void ask()
    {
        const auto seed = static_cast<std::uint64_t>(update_);
        check((Questions<Dim, T>(churn_, seed).agree()), "the world gives other answers");
        for (const auto& other : churn_.beside)
            check((Questions<Dim, T>(churn_, *other, seed).agree()), "a world beside it gives other answers");
    }

    /// One from a snapshot, one forked from it or from the world, in turn; now and then the world itself is
    /// restored to what it is.
    void renew_companions()
    {
        const std::vector<std::byte> saved = churn_.world->save();
        jostle::WorldOptions options = churn_.options;
        options.memory = std::pmr::get_default_resource();
        options.executor = update_ % 48 < 24 ? &jostle::serial_executor() : four_.get();
        auto restored = std::make_unique<World>(options);
        restored->restore(saved);
        auto forked = std::make_unique<World>(update_ % 48 < 24 ? churn_.world->fork() : restored->fork());
        check(restored->save() == saved && forked->save() == saved, "a snapshot isn't what it was taken of");
        churn_.beside.clear();
        churn_.beside.push_back(std::move(restored));
        churn_.beside.push_back(std::move(forked));
        if (update_ % 72 == 20) churn_.world->restore(saved);
        alike_ = true;
    }

    void speak()
    {
        if (churn_.dispatch) speakers_.speak();
    }
    void check(bool good, const std::string& what) { ASSERT_TRUE(good) << what << ", update " << update_; }

    Plan plan_;
    contract::CountingMemory memory_;
    std::unique_ptr<jostle::Executor> pool_, four_ = jostle::make_thread_executor(4);
    StrikingExecutor executor_;
    Speakers speakers_;
    Churn<Dim, T> churn_;
    std::vector<Mover> movers_;
    bool moving_ = true, in_place_ = false, plain_ = false, updated_ = false;
    bool alike_ = true; // the worlds beside have the same objects at rest
    int update_ = 0;
    std::vector<ObjectId> ids_; // for update(ids, boxes)
    std::vector<Box> boxes_;
    std::uint64_t failures_[faults] = {}, listed_ = 0, met_resting_ = 0;
};

template <int Dim, class T>
void live(const Plan& plan)
{
    for (std::uint64_t seed = 1; seed <= seeds_wanted() && !testing::Test::HasFatalFailure(); ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(plan.threads) + " threads");
        Lives<Dim, T>(seed, plan).live();
    }
}

TEST(Lives, In3DInFloat)
{
    live<3, float>({.threads = 1});
    live<3, float>({.threads = 4, .margin = 0.125});
}
TEST(Lives, In2DInFloat)
{
    live<2, float>({.threads = 2, .extent = 18});
    live<2, float>({.threads = 1, .extent = 18, .callback = false});
}
TEST(Lives, In3DInDouble)
{
    live<3, double>({.threads = 7});
    live<3, double>({.threads = 1, .callback = false});
}
TEST(Lives, In2DInDouble)
{
    live<2, double>({.threads = 4, .extent = 18});
}

/// So many that the executor's threads work.
TEST(Lives, OfTwentyThousand)
{
    Lives<3, float> lives(1, {.threads = 4,
                              .objects = 20'000,
                              .extent = 38,
                              .updates = 28,
                              .updates_between_failures = 1,
                              .giants = false});
    lives.live();
    EXPECT_GT(lives.strikes(), 0u);
}

} // namespace
} // namespace world_tests
