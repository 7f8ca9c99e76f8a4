// SPDX-License-Identifier: MIT
// Indexes that follow the objects: if few objects have changed, they are moved one by one; if more have, all
// are moved at once; if too many have, the index is rebuilt.
#include "world/kept/following_index.hpp"

#include <algorithm>
#include <utility>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
void FollowingIndex<Dim, T>::follow(const Where& where, const Each& each)
{
    const bool knew = std::exchange(knows_moved_, false); // unless everything succeeds
    gone_.clear();
    come_.clear();
    boxes_.clear();
    if (knew)
        follow_moved(where);
    else
        follow_all(where, each);
    moved_.clear();
    knows_moved_ = true;
}

template <int Dim, class T>
void FollowingIndex<Dim, T>::follow_moved(const Where& where)
{
    std::sort(moved_.begin(), moved_.end());
    moved_.erase(std::unique(moved_.begin(), moved_.end()), moved_.end());
    for (const std::uint32_t i : moved_) {
        const Aabb<Dim, T>* const now = where(Index{i});
        if (now != nullptr) {
            come_.push_back(i);
            boxes_.push_back(*now);
        } else if (index_.contains(i)) {
            gone_.push_back(i);
        }
    }
    BoxIndexAccess::tree(index_).erase(gone_);
    BoxIndexAccess::tree(index_).put(come_, boxes_);
}

template <int Dim, class T>
void FollowingIndex<Dim, T>::follow_all(const Where& where, const Each& each)
{
    using Box = Aabb<Dim, T>;
    const Box gone = nowhere_box<Dim, T>();
    const auto where_now = [&](std::span<const std::uint32_t> indices, Box* boxes) {
        const Box* now[index::page_capacity];
        for (std::size_t k = 0; k < indices.size(); ++k) {
            const Box* const here = where(Index{indices[k]});
            now[k] = here != nullptr ? here : &gone;
            jostle::prefetch(now[k]);
            jostle::prefetch(&now[k]->hi[Dim - 1]);
        }
        for (std::size_t k = 0; k < indices.size(); ++k)
            boxes[k] = *now[k];
    };
    const bool followed = BoxIndexAccess::tree(index_).follow(where_now);
    std::size_t count = 0;
    each([&](Index index) { count += where(index) != nullptr; });
    const bool any_here = followed && count <= index_.size() + index_.size() / 3;
    if (any_here && index_.size() == count) return;
    each([&](Index index) {
        const Box* const now = where(index);
        if (now == nullptr || (any_here && index_.contains(raw(index)))) return;
        come_.push_back(raw(index));
        boxes_.push_back(*now);
    });
    if (any_here)
        BoxIndexAccess::tree(index_).put(come_, boxes_);
    else
        BoxIndexAccess::rebuild(index_, come_, boxes_);
}

template <int Dim, class T>
const BoxIndex<Dim, T>* active_of(FollowingIndex<Dim, T>& index, const State<Dim, T>& state,
                                  const QueryLayer* layer)
{
    if (state.active_count() == 0 && state.shown == nullptr) return nullptr;
    const auto where = [&](Index i) -> const Aabb<Dim, T>* {
        const bool is_here = state.is_shown(i) && !state.is_shown_resting(i) &&
                             (layer == nullptr || counts(state.objects[i].filter(), *layer));
        return is_here ? &state.shown_box(i) : nullptr;
    };
    const auto each = [&](FunctionRef<void(Index)> visit) {
        state.each_active(visit);
        if (state.shown == nullptr) return;
        for (const Index i : state.shown->objects())
            if (recorded(state.objects[i].place()) != Place::active) visit(i);
    };
    return &index.of(where, each);
}

template <int Dim, class T>
const BoxIndex<Dim, T>& resting_of(Layer<Dim, T>& layer, const State<Dim, T>& state,
                                   const std::optional<Applied<Dim, T>>& applied)
{
    const auto where = [&](Index i) -> const Aabb<Dim, T>* {
        const auto object = state.objects[i];
        if (object.place() != Place::resting) return nullptr;
        const ObjectFilter filter = applied ? applied->changes.old_filter(i) : object.filter();
        return counts(filter, layer.asker) ? &object.last() : nullptr;
    };
    const auto each = [&](FunctionRef<void(Index)> visit) {
        const std::uint32_t end = state.index_end();
        for (std::uint32_t i = 0; i < end; ++i)
            visit(Index{i});
    };
    return layer.resting.of(where, each);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template class FollowingIndex<Dim, T>;                                                                   \
    template const BoxIndex<Dim, T>* active_of(FollowingIndex<Dim, T>&, const State<Dim, T>&,                \
                                               const QueryLayer*);                                           \
    template const BoxIndex<Dim, T>& resting_of(Layer<Dim, T>&, const State<Dim, T>&,                        \
                                                const std::optional<Applied<Dim, T>>&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
