// SPDX-License-Identifier: MIT
// Everything at once: a world lives on while `accept` changes its mind, views follow it, updates fail, it
// goes back, takes another base, is restored in worlds with other options, and is asked together with another
// one. Whatever happens, it says what the twin says. How many objects there are, and how many are moved at a
// time, lies at and beside powers of two and the sizes of the world's blocks. JOSTLE_WHOLE   how many seeds
// (30); some thousand for a thorough run JOSTLE_WHOLE_SEED   the first of them (1): a failure names its seed
// and update
#include <cmath>
#include <cstdlib>

#include "ahead.hpp"
#include "jostle/find_pairs.hpp"
#include "same_objects.hpp"
#include "slot_twin.hpp"
#include "snapshots.hpp"
#include "tests/contract/counting_memory.hpp"

namespace world_tests {
namespace {

std::uint64_t number_in(const char* variable, std::uint64_t otherwise)
{
    const char* const text = std::getenv(variable);
    return text == nullptr ? otherwise : std::strtoull(text, nullptr, 0);
}

/// 0, 1, 2, or beside a power of two: those of the blocks are among them. Not more than `most`.
std::size_t any_count(Random& random, std::uint32_t most_bits, std::size_t most)
{
    if (random.below(8) == 0) return std::min<std::size_t>(random.below(3), most);
    const std::size_t power = std::size_t{1} << random.below(most_bits + 1);
    return std::min(power + random.below(3) - 1, most);
}

/// A moment to go back to.
template <int Dim, class T>
struct PastMoment
{
    Bytes whole, changes, slots;
    Twin<Dim, T> twin;
    SlotTwin slot_twin;
};

template <int Dim, class T>
class Whole
{
  public:
    using World = jostle::World<Dim, T>;
    using Box = Aabb<Dim, T>;

    Whole(std::uint64_t seed, std::size_t objects)
        : random_(seed, 5, 3),
          objects_(objects),
          threads_(jostle::make_thread_executor(3)),
          churn_(
              seed,
              std::max(3.0, (objects > 300 ? 1.2 : 1.6) * std::pow(static_cast<double>(objects), 1.0 / Dim)),
              seed % 4 != 0,
              {.executor = seed % 2 == 0 ? threads_.get() : &jostle::serial_executor(),
               .memory = &memory_,
               .margin = seed % 5 == 0 ? 0.25 : 0,
               .layers = {{.mask = 1}, {.mask = 2}, {.mask = 5}}}),
          view_(of_threads()),
          second_(of_threads()),
          other_(jostle::WorldOptions{})
    {
        churn_.giants = objects <= 300;
        churn_.twin.salt = random_.below(2) * seed;
        for (std::size_t k = 0; k < objects; ++k)
            churn_.add();
    }

    void live(int updates)
    {
        for (update_ = 0; update_ < updates && !testing::Test::HasFatalFailure(); ++update_) {
            command();
            if (one_in(3)) look_ahead();
            if (one_in(4)) fail();
            update();
            if (testing::Test::HasFatalFailure()) return;
            if (!one_in(3)) follow();
            if (one_in(3)) ask();
            if (one_in(3)) ask_two();
            keep_moment();
            if (one_in(5)) go_back();
            if (one_in(24)) live_elsewhere();
        }
    }

  private:
    static constexpr std::size_t block = 512; // of objects that one thread goes through

    bool one_in(std::uint32_t n) { return random_.below(n) == 0; }
    [[nodiscard]] World& world() { return *churn_.world; }
    [[nodiscard]] jostle::WorldOptions of_threads() const
    {
        jostle::WorldOptions options = churn_.options;
        options.memory = std::pmr::get_default_resource();
        options.executor = threads_.get();
        return options;
    }
    /// Only an `accept` is asked again for a filter.
    void forget_filters_if_nobody_asks()
    {
        if (!churn_.twin.has_callback) churn_.twin.filter_was_set.clear();
    }

    /// Most updates say little, some much; some objects go on and on meanwhile.
    void command()
    {
        if (one_in(6)) churn_.twin.salt = random_.below(2) * random_.next();
        const std::size_t commands = one_in(8)   ? any_count(random_, 6, objects_ + 2)
                                     : one_in(2) ? 0
                                                 : random_.below(5);
        for (std::size_t k = 0; k < commands; ++k)
            churn_.operate(objects_);
        if (one_in(10) && !churn_.twin.things.empty()) report_all_again();
        if (one_in(20)) movers_.clear();
        choose_moves();
        if (one_in(3)) queue_moves();
    }
    void report_all_again()
    {
        for (const auto& [index, thing] : churn_.twin.things) {
            churn_.say(thing.id, [id = thing.id](World& each) { each.report_again(id); });
            churn_.twin.again.insert(index);
        }
    }
    void choose_moves()
    {
        ids_.clear();
        boxes_.clear();
        auto& things = churn_.twin.things;
        if (things.empty()) return;
        const std::uint32_t end = things.rbegin()->first + 1;
        if (movers_.empty() && !one_in(3))
            for (std::size_t k = any_count(random_, 12, objects_ / 2 + 1); k > 0; --k)
                movers_[things.lower_bound(random_.below(end))->first] = random_.below(2) == 0 ? 1 : -1;
        for (auto& [index, way] : movers_)
            if (const auto at = things.find(index); at != things.end()) step(at->second, way);
        if (one_in(4)) { // others, to and fro, as many as there are now and then
            const std::size_t count = one_in(3) ? 2 * objects_ : any_count(random_, 12, objects_ + 1);
            for (std::size_t k = count; k > 0; --k)
                step(things.lower_bound(random_.below(end))->second, one_in(2) ? 1 : -1);
        }
        if (!one_in(3)) sort_moves();
        if (!one_in(3)) return;
        // In order but for one place, beside a block.
        const std::size_t most = ids_.size();
        if (most == 0) return;
        std::size_t behind = any_count(random_, 13, most);
        if (most > block && !one_in(3))
            behind = block * (1 + random_.below(static_cast<std::uint32_t>(most / block)));
        const auto first = static_cast<std::ptrdiff_t>(most - behind);
        std::rotate(ids_.begin(), ids_.begin() + first, ids_.end());
        std::rotate(boxes_.begin(), boxes_.begin() + first, boxes_.end());
    }
    void step(const typename Twin<Dim, T>::Thing& thing, int way)
    {
        Box box = thing.box;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] += static_cast<T>(0.07 * way * (d + 1));
            box.hi[d] += static_cast<T>(0.07 * way * (d + 1));
            if (!(box.lo[d] <= box.hi[d])) return; // infinite
            if (box.hi[d] < T(0) || box.lo[d] > static_cast<T>(churn_.extent)) return;
        }
        ids_.push_back(thing.id);
        boxes_.push_back(box);
    }
    void sort_moves()
    {
        std::vector<std::size_t> order(ids_.size());
        for (std::size_t k = 0; k < order.size(); ++k)
            order[k] = k;
        std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            return ids_[a].index != ids_[b].index ? ids_[a].index < ids_[b].index : a < b;
        });
        std::vector<ObjectId> ids;
        std::vector<Box> boxes;
        const bool twice = one_in(4), plain = one_in(2); // else those with a margin as well
        for (const std::size_t k : order) {
            if (!twice && !ids.empty() && ids.back() == ids_[k]) continue;
            if (plain && !churn_.twin.things.at(ids_[k].index).plain) continue;
            ids.push_back(ids_[k]);
            boxes.push_back(boxes_[k]);
        }
        ids_ = ids, boxes_ = boxes;
    }
    void tell_twin_moves()
    {
        for (std::size_t k = 0; k < ids_.size(); ++k) {
            const auto at = churn_.twin.things.find(ids_[k].index);
            if (at == churn_.twin.things.end() || at->second.id != ids_[k]) continue; // removed since
            at->second.box = boxes_[k];
            at->second.displacement = {};
        }
    }
    void queue_moves()
    {
        world().move(ids_, boxes_);
        for (const auto& other : churn_.beside)
            other->move(ids_, boxes_);
        tell_twin_moves();
        ids_.clear(), boxes_.clear();
    }

    void look_ahead()
    {
        world().apply();
        forget_filters_if_nobody_asks();
        ASSERT_TRUE(shows(churn_, random_.next())) << where();
        if (one_in(2)) {
            view_.follow(world());
            ASSERT_TRUE(same_objects(view_, world())) << where();
        }
        if (one_in(2)) ask_two();
        if (one_in(2)) churn_.operate(objects_);
    }

    void fail()
    {
        const Bytes before = world().save();
        const std::vector<Pair> persisted = world().persisted().to_vector();
        const bool by_memory = one_in(2);
        if (by_memory)
            memory_.failing_allocation = memory_.allocations + random_.below(4);
        else
            churn_.questions_until_refusal = random_.below(4);
        bool failed = false;
        try {
            world().update(ids_, boxes_);
        } catch (const std::bad_alloc&) {
            failed = true;
        } catch (const Refusal&) {
            failed = true;
        }
        memory_.failing_allocation = contract::CountingMemory::never;
        churn_.questions_until_refusal = churn_.never;
        is_updated_ = !failed;
        if (!failed) return;
        churn_.asked = 0;
        ASSERT_TRUE(world().save() == before) << where();
        ASSERT_EQ(world().persisted().to_vector(), persisted) << where();
        if (one_in(2)) return;
        view_.follow(world());
        // Where there was no memory for the moves, what apply() has shown is still there.
        ASSERT_TRUE(by_memory || same_objects(world(), world().fork())) << where();
        ASSERT_TRUE(same_objects(view_, world())) << where();
    }

    void update()
    {
        if (!is_updated_) churn_.asked = 0, world().update(ids_, boxes_);
        is_updated_ = false;
        tell_twin_moves();
        forget_filters_if_nobody_asks();
        ASSERT_TRUE(churn_.follow(objects_ < 600 || one_in(4))) << where();
        slot_twin_.update(churn_.twin);
        slots_.update(world().began(), world().ended());
        ASSERT_TRUE(world_tests::agree(slots_, slot_twin_, true)) << where();
        ASSERT_EQ(slot_twin_.of.size(), churn_.twin.all.size()) << where();
        for (const auto& other : churn_.beside) {
            other->update(ids_, boxes_);
            ASSERT_TRUE(same_results(world(), *other)) << where();
        }
        churn_.asked = 0;
        if (kept_) {
            ASSERT_TRUE(kept_->agree()) << where() << ", of the view";
        }
        kept_.reset();
    }

    void follow()
    {
        view_.follow(world());
        ASSERT_TRUE(same_objects(view_, world())) << where();
        if (one_in(2)) second_.follow(view_);
        if (one_in(2)) {
            second_.follow(view_);
            kept_.emplace(churn_, second_, random_.next());
        }
    }

    void ask()
    {
        ASSERT_TRUE((Questions<Dim, T>(churn_, random_.next()).agree())) << where();
        World& asked = one_in(2) ? view_ : world();
        if (&asked == &view_) view_.follow(world());
        // By one of the layers, or not.
        jostle::ObjectQueryFilter filter;
        filter.mask = 1u + random_.below(7);
        for (int k = 0; k < 60; ++k) {
            const Box box = random_box<Dim, T>(random_, churn_.extent);
            std::uint64_t expected = 0;
            if (k % 10 == 0)
                for (const auto& [index, thing] : churn_.twin.things)
                    expected += thing.enabled && (thing.filter.category & filter.mask) != 0 &&
                                thing.filter.mask != 0 && !Twin<Dim, T>::apart(box, thing.bounds());
            const std::uint64_t found = asked.count(box, filter);
            if (k % 10 == 0) {
                ASSERT_EQ(found, expected) << where();
            }
        }
    }

    /// Together with another world, which has objects as they were here once, and has moved some since.
    void ask_two()
    {
        if (churn_.twin.things.size() > 140) return;
        if (one_in(3) || others_.empty()) {
            other_.restore(world().save());
            others_.clear();
            for (std::uint32_t i = 0; i < other_.index_end(); ++i)
                if (const ObjectId id = other_.id(i); id != ObjectId{} && other_.enabled(id))
                    if (const Box box = other_.bounds(id); valid_box(box)) others_[i] = {id, box};
        }
        for (auto& [index, each] : others_)
            if (one_in(5)) {
                each.second = random_box<Dim, T>(random_, churn_.extent);
                other_.set_margin(each.first, 0);
                other_.move(each.first, each.second);
                if (world_margin() != 0) each.second = with_margin(each.second);
            }
        if (one_in(2))
            other_.apply();
        else
            other_.update();
        using Hit = jostle::PairHit<T, jostle::ObjectId>;
        std::map<std::pair<std::uint32_t, std::uint32_t>, T> expected, found;
        for (const auto& [index, thing] : churn_.twin.things)
            for (const auto& [at, each] : others_)
                if (thing.enabled)
                    if (const T far = jostle::squared_distance(thing.bounds(), each.second); far <= 1)
                        expected[{index, at}] = far;
        const auto collect = [&](const Hit& hit, T&) {
            return found[{hit.a.index, hit.b.index}] = hit.at, true;
        };
        ASSERT_TRUE(world().closest_pairs(other_, collect, 1));
        ASSERT_EQ(found, expected) << where();
        found.clear();
        const auto collect_turned = [&](const Hit& hit, T&) {
            return found[{hit.b.index, hit.a.index}] = hit.at, true;
        };
        ASSERT_TRUE(other_.closest_pairs(world(), collect_turned, 1));
        ASSERT_EQ(found, expected) << where();
    }
    [[nodiscard]] T world_margin() const { return static_cast<T>(churn_.options.margin); }
    [[nodiscard]] Box with_margin(Box box) const
    {
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] -= world_margin();
            box.hi[d] += world_margin();
        }
        return box;
    }
    static bool valid_box(const Box& box)
    {
        for (int d = 0; d < Dim; ++d)
            if (!(box.lo[d] <= box.hi[d])) return false;
        return true;
    }

    void keep_moment()
    {
        if (one_in(12) || !has_base_) {
            const Bytes base = world().save_base();
            ASSERT_TRUE(base == world().save()) << where();
            if (churn_.beside.empty() || one_in(2)) {
                jostle::WorldOptions options = of_threads();
                churn_.beside.clear();
                churn_.beside.push_back(std::make_unique<World>(options));
                churn_.beside[0]->restore(base);
            }
            ASSERT_TRUE(churn_.beside[0]->save_base() == base) << where();
            has_base_ = true;
            moments_.clear();
        }
        if (one_in(2) && !churn_.twin.things.empty()) {
            const ObjectId id = churn_.any_thing().id;
            const std::uint64_t data = random_.below(3);
            churn_.say(id, [id, data](World& each) { each.set_user_data(id, data); });
        }
        PastMoment<Dim, T> moment{world().save(), {}, slots_.save(), churn_.twin, slot_twin_};
        world().save_changes(moment.changes);
        Bytes of_other;
        churn_.beside[0]->save_changes(of_other);
        ASSERT_TRUE(of_other == moment.changes) << where();
        moments_.push_back(std::move(moment));
        if (moments_.size() > 12) moments_.erase(moments_.begin() + random_.below(6));
    }
    void go_back()
    {
        for (std::uint32_t k = random_.below(3); k > 0; --k) // to be forgotten
            churn_.operate(objects_);
        if (one_in(2)) (void)world().add(random_box<Dim, T>(random_, churn_.extent));
        if (one_in(2)) {
            world().apply();
            if (one_in(2)) view_.follow(world());
        }
        do {
            const auto& moment = moments_[random_.below(static_cast<std::uint32_t>(moments_.size()))];
            go_to(moment);
        } while (!testing::Test::HasFatalFailure() && one_in(3));
        kept_.reset();
        if (one_in(2)) follow();
    }
    void go_to(const PastMoment<Dim, T>& moment)
    {
        world().restore_changes(moment.changes);
        churn_.beside[0]->restore_changes(moment.changes);
        ASSERT_TRUE(world().save() == moment.whole) << where();
        ASSERT_TRUE(churn_.beside[0]->save() == moment.whole) << where();
        churn_.twin = moment.twin;
        slot_twin_ = moment.slot_twin;
        slots_.restore(moment.slots);
        ASSERT_TRUE(world_tests::agree(slots_, slot_twin_, false)) << where();
        churn_.beside.resize(1);
        if (one_in(2)) return;
        churn_.beside.push_back(std::make_unique<World>(of_threads())); // which has no past
        churn_.beside[1]->restore(moment.whole);
    }

    /// With or without `accept`; cleared and refilled now and then.
    void live_elsewhere()
    {
        const Bytes now = world().save();
        if (one_in(4)) {
            world().clear();
            view_.follow(world());
            ASSERT_EQ(view_.size(), 0u) << where();
        }
        jostle::WorldOptions& options = churn_.options;
        std::swap(options.accept, accept_elsewhere_);
        churn_.twin.has_callback = options.accept != nullptr;
        churn_.world = std::make_unique<World>(options);
        world().restore(now);
        ASSERT_TRUE(world().save() == now) << where();
        has_base_ = false;
        churn_.beside.clear();
        kept_.reset();
        follow();
    }

    [[nodiscard]] std::string where() const { return "update " + std::to_string(update_); }

    Random random_;
    std::size_t objects_;
    std::unique_ptr<jostle::Executor> threads_;
    contract::CountingMemory memory_;
    Churn<Dim, T> churn_; // beside its world lives one that was restored from the base
    std::function<bool(ObjectId, ObjectId)> accept_elsewhere_;
    jostle::PairSlots slots_;
    SlotTwin slot_twin_;
    World view_, second_;                   // the second one follows the first
    std::optional<Questions<Dim, T>> kept_; // what was asked when it had followed
    World other_;
    std::map<std::uint32_t, std::pair<ObjectId, Box>> others_;
    std::map<std::uint32_t, int> movers_;
    std::vector<ObjectId> ids_; // moves for update()
    std::vector<Box> boxes_;
    bool is_updated_ = false, has_base_ = false;
    std::vector<PastMoment<Dim, T>> moments_;
    int update_ = 0;
};

template <int Dim, class T>
void live(std::uint64_t seed)
{
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed, 1, 2);
    if (seed % 10 == 7) { // more than a block
        Whole<Dim, T> whole(seed, (std::size_t{512} << random.below(4)) + random.below(3) - 1);
        whole.live(24);
    } else {
        Whole<Dim, T> whole(seed, any_count(random, 8, 200));
        whole.live(50);
    }
}

TEST(Whole, EverythingAtOnceIsWhatTheTwinSays)
{
    const std::uint64_t first = number_in("JOSTLE_WHOLE_SEED", 1), seeds = number_in("JOSTLE_WHOLE", 30);
    for (std::uint64_t seed = first; seed < first + seeds && !HasFatalFailure(); ++seed) {
        if (seed % 3 == 0)
            live<2, double>(seed);
        else
            live<3, float>(seed);
    }
}

// Three thousand of forty thousand move on: more pairs than are sorted in one piece, and fewer than objects.
TEST(Whole, ManyThatMoveAmongManyMoreMeetWhatTheyTouch)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (jostle::Executor* executor : {&jostle::serial_executor(), threads.get()}) {
        jostle::World3f world({.executor = executor});
        Random random(7);
        std::vector<jostle::Aabb3f> boxes;
        for (int k = 0; k < 40'000; ++k)
            boxes.push_back(random_box<3, float>(random, 40, false));
        std::vector<ObjectId> ids(boxes.size()), moved_ids;
        world.add(boxes, ids);
        while (world.update(), world.stats().active != 0) {
        }
        std::vector<jostle::Aabb3f> moved;
        for (std::size_t k = 5; k < boxes.size(); k += 13)
            moved_ids.push_back(ids[k]);
        std::uint64_t listed = 0, pairs = 0;
        for (int update = 0; update < 12; ++update) {
            moved.clear();
            if (update == 7) // one twice from here on, last in a block and first in the next
                moved_ids.insert(moved_ids.begin() + 512, moved_ids[511]);
            for (const ObjectId id : moved_ids) {
                auto& box = boxes[id.index];
                box.lo[0] += 0.04f, box.hi[0] += 0.04f;
                moved.push_back(box);
            }
            world.update(moved_ids, moved);
            std::vector<Pair> expected;
            for (const Pair& pair : jostle::find_pairs(boxes).to_vector())
                if (pair.a % 13 == 5 || pair.b % 13 == 5) expected.push_back(pair);
            std::sort(expected.begin(), expected.end());
            ASSERT_TRUE(world.changed_pairs().to_vector() == expected) << update;
            listed += world.stats().listed;
            pairs = expected.size();
        }
        EXPECT_GT(listed, 1000u);
        EXPECT_GT(pairs, 4096u);
        EXPECT_LT(pairs, 40'000u);
    }
}

} // namespace
} // namespace world_tests
