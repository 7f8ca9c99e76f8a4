// SPDX-License-Identifier: MIT
#include "world/update/changes.hpp"

#include <algorithm>

#include "base/instantiate.hpp"
#include "world/update/sort_keys.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// Finds what was kept of an object, if anything: by binary search in the sorted part, one by one in the
/// rest.
template <class Kept>
const Kept* find(const std::pmr::vector<Kept>& kept, std::size_t sorted, Index index) noexcept
{
    const Kept* const middle = kept.data() + sorted;
    const Kept* const end = kept.data() + kept.size();
    const Kept* const here =
        std::partition_point(kept.data(), middle, [index](const Kept& old) { return old.index < index; });
    if (here != middle && here->index == index) return here;
    return std::find_if(middle, end, [index](const Kept& old) { return old.index == index; });
}

} // namespace

template <int Dim, class T>
Changes<Dim, T>::Changes(State<Dim, T>& state, Arena& arena)
    : state_(&state),
      objects_(arena.list<Index>("changed objects")),
      old_filters_(arena.list<OldFilter>("filters of the last update")),
      old_reaches_(arena.list<OldReach>("reaches of the last update")),
      again_(arena.list<Key>("pairs to be reported again")),
      scratch_(arena.list<OldFilter>("filters of the last update, in another order"))
{
}

template <int Dim, class T>
ObjectFilter Changes<Dim, T>::old_filter(Index index) const noexcept
{
    const auto object = state_->objects[index];
    return object.has(flag::refiltered) ? find(old_filters_, sorted_filters_, index)->filter
                                        : object.filter();
}

template <int Dim, class T>
const Reach<Dim, T>* Changes<Dim, T>::old_reach(Index index) const noexcept
{
    const OldReach& old = *find(old_reaches_, sorted_reaches_, index);
    return old.had_reach ? &old.reach : nullptr;
}

template <int Dim, class T>
bool Changes<Dim, T>::is_again(const Pair& pair) const noexcept
{
    const Index a{pair.a}, b{pair.b};
    if (!state_->objects[a].has(flag::again) && !state_->objects[b].has(flag::again)) return false;
    const auto is_listed = [&](Index one, Index other) {
        return std::binary_search(again_.begin(), again_.end(), key_of(pair_of(one, other)));
    };
    return is_listed(a, b) || is_listed(a, everyone) || is_listed(b, everyone);
}

template <int Dim, class T>
bool Changes<Dim, T>::is_asked_again(const Pair& pair) const noexcept
{
    const auto is_asked = [&](std::uint32_t index) {
        return state_->options.accept != nullptr && state_->objects[Index{index}].has(flag::refiltered);
    };
    return is_asked(pair.a) || is_asked(pair.b) || is_again(pair);
}

template <int Dim, class T>
void Changes<Dim, T>::reset(Index index) noexcept
{
    const auto object = state_->objects[index];
    object.now() = object.before();
    object.set(flag::enabled, object.was_enabled());
    object.set(flag::alive, object.place() != Place::none);
    if (object.has(flag::refiltered)) object.set_filter(find(old_filters_, sorted_filters_, index)->filter);
    if (object.has(flag::reach_kept)) {
        const OldReach& old = *find(old_reaches_, sorted_reaches_, index);
        object.set(flag::has_reach, old.had_reach);
        state_->objects.reach(index) = old.reach;
    }
}

template <int Dim, class T>
void Changes<Dim, T>::sort_filters()
{
    sort_by_key(old_filters_, scratch_, [](const OldFilter& old) { return raw(old.index); });
    sorted_filters_ = old_filters_.size();
}

template <int Dim, class T>
void Changes<Dim, T>::sort_reaches() noexcept
{
    std::sort(old_reaches_.begin(), old_reaches_.end(),
              [](const OldReach& x, const OldReach& y) { return x.index < y.index; });
    sorted_reaches_ = old_reaches_.size();
}

template <int Dim, class T>
void Changes<Dim, T>::sort_again() noexcept
{
    std::sort(again_.begin(), again_.end());
}

template <int Dim, class T>
bool Changes<Dim, T>::is_unchanged(Index index) const noexcept
{
    const auto object = state_->objects[index];
    return object.place() != Place::none && object.has(flag::alive) &&
           object.has(flag::enabled) == object.was_enabled() && !object.has(flag::again) &&
           (!object.has(flag::refiltered) ||
            (state_->options.accept == nullptr && object.filter() == old_filter(index))) &&
           same(object.now(), object.before());
}

template <int Dim, class T>
void Changes<Dim, T>::close(Arena& arena)
{
    const Objects<Dim, T>& objects = state_->objects;
    sort_filters();
    sort_again();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < objects_.size(); ++i) {
        if (i + fetch_ahead < objects_.size()) objects.prefetch(objects_[i + fetch_ahead]);
        const Index index = objects_[i];
        if (!is_unchanged(index)) {
            objects_[kept++] = index;
            continue;
        }
        const auto object = state_->objects[index];
        object.now() = object.before(); // +0 and -0 are the same box, but not the same bits
        object.set(flag::transient, false);
    }
    objects_.resize(kept);
    sort_by_key(objects_, arena.list<Index>("changed objects, in another order"),
                [](Index index) { return raw(index); });
}

template <int Dim, class T>
void Changes<Dim, T>::undo() noexcept
{
    for (const Index index : objects_) {
        const auto object = state_->objects[index];
        if (!object.has(flag::written)) continue; // after a failure, the list may name arbitrary objects
        if (object.place() == Place::none) {
            object.set_state(0);
            continue;
        }
        object.now() = object.before();
        object.set(flag::alive);
        object.set(flag::enabled, object.was_enabled());
    }
    for (const OldFilter& old : old_filters_)
        if (state_->objects[old.index].state() != 0) state_->objects[old.index].set_filter(old.filter);
    for (const OldReach& old : old_reaches_) {
        const auto object = state_->objects[old.index];
        state_->objects.reach(old.index) = old.reach;
        if (object.state() != 0) object.set(flag::has_reach, old.had_reach);
    }
    for (const Index index : objects_)
        state_->objects[index].set(flag::transient, false);
}

#define JOSTLE_INSTANTIATE(Dim, T) template class Changes<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
