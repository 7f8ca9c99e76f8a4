// SPDX-License-Identifier: MIT
// A World under all its commands, against the model that the tests have: updates, apply(), questions,
// margins, filters, user data, slots, snapshots, changes since a base, and views that follow.
#include "choices.hpp"
#include "tests/world/ahead.hpp"
#include "tests/world/same_objects.hpp"
#include "tests/world/slot_twin.hpp"
#include "tests/world/snapshots.hpp"

namespace {

using world_tests::Bytes;

template <class Result>
void demand(const Result& result)
{
    if (!result) fuzz::fail(result.message());
}

template <int Dim, class T>
class Session
{
    using World = jostle::World<Dim, T>;
    using Churn = world_tests::Churn<Dim, T, fuzz::Choices>;
    using Questions = world_tests::Questions<Dim, T>;
    struct Moment
    {
        Bytes whole, changes, slots;
        world_tests::Twin<Dim, T> twin;
        world_tests::SlotTwin slot_twin;
        std::map<std::uint32_t, std::uint64_t> data;
    };

  public:
    Session(fuzz::Input& in, const jostle::WorldOptions& options, double extent, bool callback)
        : in_(in), churn_(fuzz::Choices(in), extent, callback, options), view_(churn_.options)
    {
        churn_.twin.salt = callback ? 5 : 0;
    }

    void go()
    {
        for (int step = 0; step < 48 && in_.left() != 0; ++step)
            act(in_.below(16));
        update();
        fuzz::count_boxes(churn_.twin.things.size());
    }

  private:
    void act(std::uint32_t what)
    {
        if (what < 6) {
            for (std::uint32_t k = in_.below(what == 0 ? 48 : 6); k > 0; --k)
                churn_.operate(what == 1 ? 12 : 40), queued_ = true;
            return;
        }
        fuzz::count_boxes(churn_.twin.things.size());
        const std::uint64_t seed = in_.below(8);
        switch (what) {
        case 6:
            churn_.world->apply();
            demand(world_tests::shows(churn_, seed));
            return;
        case 7:
            set_user_data();
            return;
        case 8:
            restore_whole();
            return;
        case 9:
            base_ = churn_.world->save_base();
            fuzz::demand(base_ == churn_.world->save(), "a base is another snapshot");
            moments_.clear();
            return;
        case 10:
            keep_moment();
            return;
        case 11:
            go_back();
            return;
        case 12:
            view_.follow(*churn_.world);
            demand(world_tests::same_objects(view_, *churn_.world));
            if (!queued_) demand(Questions(churn_, view_, seed).agree());
            return;
        default:
            update();
            if (what == 13) demand(Questions(churn_, seed).agree());
        }
    }

    void update()
    {
        if (churn_.twin.has_callback && in_.below(8) == 7) churn_.twin.salt = in_.below(3);
        demand(churn_.update());
        queued_ = false;
        slot_twin_.update(churn_.twin);
        slots_.update(churn_.world->began(), churn_.world->ended());
        demand(world_tests::agree(slots_, slot_twin_, true));
        std::erase_if(data_, [&](const auto& each) {
            const auto thing = churn_.twin.things.find(each.first);
            return thing == churn_.twin.things.end() || thing->second.id != data_ids_[each.first];
        });
        for (const auto& [index, data] : data_)
            fuzz::demand(churn_.world->user_data(churn_.twin.things.at(index).id) == data, "other user data");
    }

    void set_user_data()
    {
        if (churn_.twin.things.empty()) return;
        const jostle::ObjectId id = churn_.any_thing().id;
        data_[id.index] = in_.below(4);
        data_ids_[id.index] = id;
        churn_.world->set_user_data(id, data_[id.index]);
    }

    /// The world goes on as one that was restored; what is queued would be forgotten.
    void restore_whole()
    {
        update();
        auto fresh = std::make_unique<World>(churn_.options);
        const Bytes saved = churn_.world->save();
        fresh->restore(saved);
        fuzz::demand(fresh->save() == saved, "a restored world saves other bytes");
        fuzz::demand(fresh->pairs().to_vector() == churn_.twin.all, "a restored world has other pairs");
        churn_.world = std::move(fresh);
        moments_.clear();
        base_.clear();
    }

    void keep_moment()
    {
        if (base_.empty()) return;
        update();
        Moment moment{churn_.world->save(), {}, slots_.save(), churn_.twin, slot_twin_, data_};
        churn_.world->save_changes(moment.changes);
        moments_.push_back(std::move(moment));
    }
    void go_back()
    {
        if (moments_.empty()) return;
        const Moment& moment = moments_[in_.below(static_cast<std::uint32_t>(moments_.size()))];
        churn_.world->restore_changes(moment.changes);
        fuzz::demand(churn_.world->save() == moment.whole, "restored changes make another world");
        fuzz::demand(churn_.world->pairs().to_vector() == moment.twin.all,
                     "restored changes have other pairs");
        Bytes again;
        churn_.world->save_changes(again);
        fuzz::demand(again == moment.changes, "the same changes are other bytes");
        churn_.twin = moment.twin;
        slot_twin_ = moment.slot_twin;
        slots_.restore(moment.slots);
        fuzz::demand(slots_.save() == moment.slots, "restored slots save other bytes");
        data_ = moment.data;
        queued_ = false;
    }

    fuzz::Input& in_;
    Churn churn_;
    World view_;
    jostle::PairSlots slots_;
    world_tests::SlotTwin slot_twin_;
    Bytes base_;
    std::vector<Moment> moments_;
    std::map<std::uint32_t, std::uint64_t> data_;
    std::map<std::uint32_t, jostle::ObjectId> data_ids_;
    bool queued_ = false; ///< the model is ahead of the last update
};

} // namespace

JOSTLE_FUZZ_TARGET(world)
{
    static const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    const bool callback = in.below(2) == 0;
    jostle::WorldOptions options;
    options.executor = in.below(16) == 15 ? threads.get() : &jostle::serial_executor();
    options.margin = in.below(4) == 0 ? 0.25 : 0;
    const double extent = 2 + in.below(8);
    if (in.below(2) == 0)
        Session<3, float>(in, options, extent, callback).go();
    else
        Session<2, double>(in, options, extent, callback).go();
}
