// SPDX-License-Identifier: MIT
// Views: worlds that have the objects of another world as queries see them, so that they can be queried while
// the other is updated. A view that follows again visits only what has changed since, if that was recorded.
#include <algorithm>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/kept/records.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// An object as queries see it: after apply(), where it will be.
template <int Dim, class T>
Record<Dim, T> shown_record(const State<Dim, T>& state, std::uint32_t end, std::uint32_t i) noexcept
{
    Record<Dim, T> record;
    if (i >= end) return record;
    const Index index{i};
    const auto object = state.objects[index];
    if (!object.has(flag::alive)) return record;
    Place place = recorded(object.place());
    if (object.has(flag::written)) place = object.is_there() ? Place::active : Place::disabled;
    record.generation = state.ids.generation(i);
    record.numbers = object.numbers();
    record.box = object.now();
    record.state = static_cast<std::uint32_t>(place) |
                   (object.state() & (flag::alive | flag::enabled | flag::is_static | flag::has_reach));
    if (record.has(flag::has_reach)) record.reach = state.objects.reach(index);
    return record;
}

/// One call of follow().
template <int Dim, class T>
class Follow
{
  public:
    using Implementation = typename World<Dim, T>::Implementation;

    Follow(Implementation& view, const Implementation& of)
        : view_(view), work_(*view.follows), state_(view.state), of_(of.state), log_(of.change_log)
    {
        work_.changed.clear();
        work_.gone.clear();
        work_.come.clear();
        work_.come_boxes.clear();
    }

    void run()
    {
        ChangeLog::Position here;
        const auto touched = log_.since(work_.position, here);
        const std::uint32_t end_then = state_.index_end(), end = of_.index_end();
        state_.make_room(end);
        state_.ids.make_room(end);
        state_.ids.set_end(std::max(end_then, end));
        if (touched) {
            auto& indices = work_.touched;
            indices.assign(touched->begin(), touched->end());
            std::sort(indices.begin(), indices.end());
            indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
            for (const std::uint32_t index : indices)
                follow(index, end);
        } else {
            for (std::uint32_t index = 0; index < std::max(end_then, end); ++index)
                follow(index, end);
        }
        state_.ids.set_end(end);
        list_active();
        BoxIndexAccess::tree(state_.resting).erase(work_.gone);
        BoxIndexAccess::tree(state_.resting).put(work_.come, work_.come_boxes);
        if (!state_.refused.empty() || !of_.refused.empty()) state_.refused = of_.refused;
        if (of_.shown != nullptr)
            state_.refused.erase_if([&](Key key) { return !is_shown_refused(of_, pair_of(key)); });

        view_.stats = describe(state_, view_.last_lists());
        view_.stats.bytes_reserved = view_.bytes();
        work_.position = here;
        view_.change_log.count_update();
        view_.note(work_.changed, {});
        view_.note_resting(work_.gone, work_.come);
    }

  private:
    void follow(std::uint32_t i, std::uint32_t end)
    {
        const Record<Dim, T> then = shown_record(state_,
                                                 static_cast<std::uint32_t>(state_.objects.capacity()), i),
                             now = shown_record(of_, end, i);
        if (same_record(then, now)) return;
        if (now.has(flag::has_reach)) state_.objects.make_room_for_reach(Index{i});
        work_.changed.push_back(Index{i});
        if (now.place() == Place::resting) {
            work_.come.push_back(i);
            work_.come_boxes.push_back(now.box);
        } else if (then.place() == Place::resting) {
            work_.gone.push_back(i);
        }
        Census census{state_.alive, state_.disabled, 0};
        census.remove(then);
        census.add(now);
        state_.alive = census.alive;
        state_.disabled = census.disabled;
        put_record(state_, Index{i}, now);
        state_.ids.set(i, now.generation);
    }
    void list_active()
    {
        auto& active = state_.active;
        active.clear();
        const auto list = [&](Index index) {
            if (state_.objects[index].place() == Place::active) active.push_back({index, 0});
        };
        of_.each_active(list);
        if (of_.shown != nullptr)
            for (const Index index : of_.shown->objects())
                list(index);
        const auto less = [](const auto& a, const auto& b) { return a.index < b.index; };
        const auto same = [](const auto& a, const auto& b) { return a.index == b.index; };
        if (!std::is_sorted(active.begin(), active.end(), less))
            std::sort(active.begin(), active.end(), less);
        active.erase(std::unique(active.begin(), active.end(), same), active.end());
    }

    Implementation& view_;
    Following<Dim, T>& work_;
    State<Dim, T>& state_;
    const State<Dim, T>& of_;
    const ChangeLog& log_;
};

/// Makes the view one without objects, which has followed no world.
template <int Dim, class T>
void empty_view(typename World<Dim, T>::Implementation& view) noexcept
{
    State<Dim, T>& state = view.state;
    for (std::uint32_t i = 0; i < state.index_end(); ++i) {
        state.objects[Index{i}].set_state(0);
        state.ids.set(i, 0);
    }
    state.active.clear();
    state.refused.clear();
    state.resting.clear();
    state.alive = state.disabled = 0;
    view.active_index.forget();
    for (const auto& layer : view.layers) {
        layer->active.forget();
        layer->resting.forget();
    }
    view.change_log.drop();
    view.follows->position = {};
    view.stats = describe(state, view.last_lists());
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::follow(const World& other)
{
    std::unique_ptr<Implementation> fresh; // in the end the old one, which must outlive its `call`
    const InUse call = implementation_->users.change();
    const Implementation& of = *other.implementation_;
    if (&of == implementation_.get())
        throw Error(ErrorCode::invalid_argument,
                    "a World can't follow itself; make another one that follows it");
    if (of.users.are_at_work())
        throw Error(
            ErrorCode::invalid_argument,
            "the World to be followed is in use by another call, such as update(); call follow() between "
            "two updates");
    if (!implementation_->follows) {
        fresh = std::make_unique<Implementation>(implementation_->state.options);
        fresh->follows.emplace(&fresh->memory);
        world::Follow<Dim, T>(*fresh, of).run();
        implementation_.swap(fresh);
        return;
    }
    try {
        world::Follow<Dim, T>(*implementation_, of).run();
    } catch (...) {
        world::empty_view<Dim, T>(*implementation_);
        throw;
    }
}

#define JOSTLE_INSTANTIATE(Dim, T) template JOSTLE_API void World<Dim, T>::follow(const World&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
