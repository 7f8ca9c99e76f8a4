// SPDX-License-Identifier: MIT
// The index of what is active: brought to where the objects are when somebody asks, by what has changed.
#include "world/kept/active_index.hpp"

#include <algorithm>
#include <utility>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/update/changes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
BoxIndex<Dim, T>* ActiveIndex<Dim, T>::of(const State<Dim, T>& state)
{
    if (state.active_count() == 0 && state.shown == nullptr) return nullptr;
    up_to_date_.ensure([&] { follow(state); });
    return &index_;
}

template <int Dim, class T>
void ActiveIndex<Dim, T>::note(std::span<const Index> changed,
                               std::span<const std::uint32_t> settling) noexcept
{
    constexpr std::size_t worth = 8; // one that is put elsewhere costs what so many cost that are looked at
    up_to_date_.forget();
    if (!knows_moved_) return;
    knows_moved_ = worth * (moved_.size() + changed.size() + settling.size()) <= index_.size();
    try {
        for (const Index index : knows_moved_ ? changed : changed.first(0))
            moved_.push_back(raw(index));
        if (knows_moved_) moved_.insert(moved_.end(), settling.begin(), settling.end());
    } catch (...) {
        knows_moved_ = false;
    }
}

template <int Dim, class T>
void ActiveIndex<Dim, T>::forget() noexcept
{
    up_to_date_.forget();
    knows_moved_ = false;
}

/// Whether queries find an object in this index.
template <int Dim, class T>
bool ActiveIndex<Dim, T>::is_here(const State<Dim, T>& state, Index index) const noexcept
{
    return state.is_shown(index) && !state.is_shown_resting(index) &&
           (!layer_ || counts(state.objects[index].filter(), *layer_));
}

/// Brings the index to where the objects are, from where they were when somebody asked last.
template <int Dim, class T>
void ActiveIndex<Dim, T>::follow(const State<Dim, T>& state)
{
    const bool knew = std::exchange(knows_moved_, false); // unless all succeeds
    if (knew)
        follow_moved(state);
    else
        follow_all(state);
    moved_.clear();
    knows_moved_ = true;
}

/// Where few have moved.
template <int Dim, class T>
void ActiveIndex<Dim, T>::follow_moved(const State<Dim, T>& state)
{
    std::sort(moved_.begin(), moved_.end());
    moved_.erase(std::unique(moved_.begin(), moved_.end()), moved_.end());
    gone_.clear();
    come_.clear();
    boxes_.clear();
    for (const std::uint32_t i : moved_) {
        if (index_.contains(i)) gone_.push_back(i);
        if (!is_here(state, Index{i})) continue;
        come_.push_back(i);
        boxes_.push_back(state.shown_box(Index{i}));
    }
    BoxIndexAccess::tree(index_).erase(gone_);
    if (!come_.empty()) BoxIndexAccess::tree(index_).insert(come_, boxes_);
}

template <int Dim, class T>
void ActiveIndex<Dim, T>::follow_all(const State<Dim, T>& state)
{
    using Box = Aabb<Dim, T>;
    const Box gone = nowhere_box<Dim, T>();
    const auto where = [&](std::span<const std::uint32_t> indices, Box* boxes) {
        const Box* now[index::page_capacity];
        for (std::size_t k = 0; k < indices.size(); ++k) {
            const Index index{indices[k]};
            now[k] = is_here(state, index) ? &state.shown_box(index) : &gone;
            jostle::prefetch(now[k]);
            jostle::prefetch(&now[k]->hi[Dim - 1]);
        }
        for (std::size_t k = 0; k < indices.size(); ++k)
            boxes[k] = *now[k];
    };
    const bool followed = BoxIndexAccess::tree(index_).follow(where);
    std::size_t count = state.active_count();
    if (layer_) {
        count = 0;
        state.each_active([&](Index index) { count += is_here(state, index); });
    }
    if (followed && state.shown == nullptr && index_.size() == count) return;
    come_.clear();
    boxes_.clear();
    const auto collect = [&](bool all) {
        const auto collect_one = [&](Index index) {
            if (!is_here(state, index) || (!all && index_.contains(raw(index)))) return;
            come_.push_back(raw(index));
            boxes_.push_back(state.shown_box(index));
        };
        state.each_active(collect_one);
        if (state.shown == nullptr) return;
        for (const Index index : state.shown->objects())
            if (state.objects[index].place() != Place::active) collect_one(index);
    };
    if (followed && count <= index_.size() + index_.size() / 3) {
        collect(false);
        BoxIndexAccess::tree(index_).insert(come_, boxes_);
    } else {
        come_.reserve(count);
        boxes_.reserve(count);
        collect(true);
        BoxIndexAccess::rebuild(index_, come_, boxes_);
    }
}

} // namespace world

#define JOSTLE_INSTANTIATE(Dim, T) template class world::ActiveIndex<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
