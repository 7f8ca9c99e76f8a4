// SPDX-License-Identifier: MIT
#include "world/kept/layer.hpp"

#include <algorithm>
#include <utility>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/kept/records.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
Layer<Dim, T>::Layer(const QueryLayer& asker, const IndexOptions& options)
    : active(options, asker),
      asker_(asker),
      resting_(options),
      moved_(options.memory),
      gone_(options.memory),
      come_(options.memory),
      boxes_(options.memory)
{
    BoxIndexAccess::tree(resting_).expect_to_come_back();
}

template <int Dim, class T>
const BoxIndex<Dim, T>& Layer<Dim, T>::resting(const State<Dim, T>& state,
                                               const std::optional<Applied<Dim, T>>& applied)
{
    up_to_date_.ensure([&] { follow(state, applied); });
    return resting_;
}

template <int Dim, class T>
void Layer<Dim, T>::follow(const State<Dim, T>& state, const std::optional<Applied<Dim, T>>& applied)
{
    const bool knew = std::exchange(knows_moved_, false); // unless all succeeds
    gone_.clear();
    come_.clear();
    boxes_.clear();
    Past<Dim, T> past(state, applied);
    const auto look_at = [&](std::uint32_t i) {
        const Index index{i};
        if (state.objects[index].place() != Place::resting || !counts(past.filter(index), asker_)) return;
        come_.push_back(i);
        boxes_.push_back(past.box(index));
    };
    if (knew) {
        std::sort(moved_.begin(), moved_.end());
        moved_.erase(std::unique(moved_.begin(), moved_.end()), moved_.end());
        for (const std::uint32_t i : moved_) {
            if (resting_.contains(i)) gone_.push_back(i); // who is back may lie elsewhere
            look_at(i);
        }
        BoxIndexAccess::tree(resting_).erase(gone_);
        if (!come_.empty()) BoxIndexAccess::tree(resting_).insert(come_, boxes_);
    } else {
        const std::uint32_t end = state.index_end();
        for (std::uint32_t i = 0; i < end; ++i)
            look_at(i);
        BoxIndexAccess::rebuild(resting_, come_, boxes_);
    }
    moved_.clear();
    knows_moved_ = true;
}

template <int Dim, class T>
void Layer<Dim, T>::note_resting(std::span<const std::uint32_t> rested,
                                 std::span<const std::uint32_t> settling, std::size_t resting) noexcept
{
    up_to_date_.forget();
    if (!knows_moved_) return;
    knows_moved_ = 4 * (moved_.size() + rested.size() + settling.size()) <= resting;
    if (!knows_moved_) return;
    try {
        moved_.insert(moved_.end(), rested.begin(), rested.end());
        moved_.insert(moved_.end(), settling.begin(), settling.end());
    } catch (...) {
        knows_moved_ = false; // it is made anew
    }
}

template <int Dim, class T>
void Layer<Dim, T>::forget() noexcept
{
    active.forget();
    up_to_date_.forget();
    knows_moved_ = false;
}

#define JOSTLE_INSTANTIATE(Dim, T) template class Layer<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
