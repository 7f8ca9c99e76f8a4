// SPDX-License-Identifier: MIT
#include "world/kept/masked_indexes.hpp"

#include <algorithm>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// With fewer resting objects there is little to come by.
constexpr std::size_t worth_masking = 1024;
// To make an index takes about as long as one question per so many resting objects saves.
constexpr std::size_t objects_per_question = 64;
// The same of active objects; of a few it takes as long as so many questions save.
constexpr std::size_t active_per_question = 32, least_questions = 16;
// Updates until one that nobody asks about goes.
constexpr std::uint32_t patience = 64;

} // namespace

template <int Dim, class T>
auto MaskedIndexes<Dim, T>::find(std::uint32_t category, std::uint32_t mask) noexcept -> Masked*
{
    for (Masked& masked : all_)
        if (masked.is_named.load(std::memory_order_acquire) && masked.category_ == category &&
            masked.mask_ == mask)
            return &masked;
    return nullptr;
}

template <int Dim, class T>
auto MaskedIndexes<Dim, T>::of(const State<Dim, T>& state, std::uint32_t category, std::uint32_t mask,
                               std::uint64_t questions) -> const Masked*
{
    if (state.resting.size() < worth_masking) return nullptr;
    Masked* masked = find(category, mask);
    if (questions == 0)
        return masked != nullptr && masked->is_fresh.load(std::memory_order_acquire) ? masked : nullptr;
    if (masked == nullptr) {
        const std::lock_guard lock(mutex_);
        masked = find(category, mask);
        for (Masked& other : all_) {
            if (masked != nullptr) break;
            if (other.is_named.load(std::memory_order_relaxed)) continue;
            masked = &other;
            masked->category_ = category;
            masked->mask_ = mask;
            masked->asked_.store(0, std::memory_order_relaxed);
            masked->is_named.store(true, std::memory_order_release);
        }
        if (masked == nullptr) return nullptr; // all are taken by others
    }
    masked->unasked_.store(0, std::memory_order_relaxed);
    if (masked->is_fresh.load(std::memory_order_acquire)) {
        index_active(*masked, state, questions);
        return masked;
    }
    const std::uint64_t asked = masked->asked_.fetch_add(questions, std::memory_order_relaxed) + questions;
    if (asked < state.resting.size() / objects_per_question) return nullptr;
    if (state.shown != nullptr) return nullptr; // what rests may have other filters now
    {
        const std::lock_guard lock(mutex_);
        if (!masked->is_fresh.load(std::memory_order_relaxed)) {
            refresh(*masked, state);
            masked->is_fresh.store(true, std::memory_order_release);
        }
    }
    index_active(*masked, state, questions);
    return masked;
}

template <int Dim, class T>
void MaskedIndexes<Dim, T>::refresh(Masked& masked, const State<Dim, T>& state)
{
    const std::size_t resting = state.resting.size();
    if (masked.is_made_ && !masked.is_worth_it_) // there may be others by now
        masked.is_made_ =
            resting < masked.resting_ + masked.resting_ / 4 && masked.resting_ < resting + resting / 4;
    if (masked.is_made_ && masked.is_worth_it_ && 4 * masked.moved_.size() > resting) masked.is_made_ = false;
    if (!masked.is_made_)
        make(masked, state);
    else if (masked.is_worth_it_)
        follow(masked, state);
    masked.moved_.clear();
    masked.asked_active_.store(0, std::memory_order_relaxed);
    masked.of_active_ = state.active_count();
    masked.active_ = 0;
    masked.ids_active_.clear();
    state.each_active([&](Index index) {
        if (!counts(state.objects[index].filter(), masked.category_, masked.mask_)) return;
        if (2 * ++masked.active_ <= masked.of_active_) masked.ids_active_.push_back(raw(index));
    });
}

/// Puts the active objects that count into an index, if these questions, too, make it pay.
template <int Dim, class T>
void MaskedIndexes<Dim, T>::index_active(Masked& masked, const State<Dim, T>& state, std::uint64_t questions)
{
    if (masked.active_ == 0 || 2 * masked.active_ > masked.of_active_ || state.shown != nullptr ||
        masked.has_active_.load(std::memory_order_relaxed))
        return;
    const std::uint64_t asked =
        masked.asked_active_.fetch_add(questions, std::memory_order_relaxed) + questions;
    if (asked < least_questions + masked.of_active_ / active_per_question) return;
    const std::lock_guard lock(mutex_);
    if (masked.has_active_.load(std::memory_order_relaxed)) return;
    boxes_.clear();
    for (const std::uint32_t i : masked.ids_active_)
        boxes_.push_back(state.shown_box(Index{i}));
    if (!masked.index_of_active_) masked.index_of_active_.emplace(options_);
    BoxIndexAccess::rebuild(*masked.index_of_active_, masked.ids_active_, boxes_);
    masked.has_active_.store(true, std::memory_order_release);
}

template <int Dim, class T>
void MaskedIndexes<Dim, T>::make(Masked& masked, const State<Dim, T>& state)
{
    ids_.clear();
    boxes_.clear();
    masked.resting_ = state.resting.size();
    masked.is_worth_it_ = true;
    const std::uint32_t end = state.index_end();
    for (std::uint32_t i = 0; i < end && masked.is_worth_it_; ++i) {
        const auto object = state.objects[Index{i}];
        if (object.place() != Place::resting) continue;
        if (!counts(object.filter(), masked.category_, masked.mask_)) continue;
        ids_.push_back(i);
        boxes_.push_back(state.objects[Index{i}].last());
        masked.is_worth_it_ = 2 * ids_.size() <= masked.resting_;
    }
    if (masked.is_worth_it_) {
        masked.index_.emplace(options_);
        BoxIndexAccess::tree(*masked.index_).expect_to_come_back();
        BoxIndexAccess::rebuild(*masked.index_, ids_, boxes_);
    } else {
        masked.index_.reset();
    }
    masked.is_made_ = true;
}

template <int Dim, class T>
void MaskedIndexes<Dim, T>::follow(Masked& masked, const State<Dim, T>& state)
{
    auto& moved = masked.moved_;
    std::sort(moved.begin(), moved.end());
    moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
    std::pmr::vector<std::uint32_t> gone(options_.memory);
    ids_.clear();
    boxes_.clear();
    for (const std::uint32_t i : moved) {
        if (masked.index_->contains(i)) gone.push_back(i); // who is back may lie elsewhere
        const auto object = state.objects[Index{i}];
        if (object.place() != Place::resting) continue;
        if (!counts(object.filter(), masked.category_, masked.mask_)) continue;
        ids_.push_back(i);
        boxes_.push_back(state.objects[Index{i}].last());
    }
    masked.is_made_ = false; // unless all succeeds
    BoxIndexAccess::tree(*masked.index_).erase(gone);
    if (!ids_.empty()) BoxIndexAccess::tree(*masked.index_).insert(ids_, boxes_);
    masked.is_made_ = true;
}

template <int Dim, class T>
void MaskedIndexes<Dim, T>::note(std::span<const std::uint32_t> rested,
                                 std::span<const std::uint32_t> settling) noexcept
{
    for (Masked& masked : all_) {
        if (!masked.is_named.load(std::memory_order_relaxed)) continue;
        masked.is_fresh.store(false, std::memory_order_relaxed);
        masked.has_active_.store(false, std::memory_order_relaxed);
        if (masked.unasked_.fetch_add(1, std::memory_order_relaxed) == patience) {
            masked.is_named.store(false, std::memory_order_relaxed);
            masked.is_made_ = false;
            masked.index_.reset();
            masked.index_of_active_.reset();
            masked.moved_.clear();
            continue;
        }
        if (!masked.is_made_ || !masked.is_worth_it_) continue;
        try {
            masked.moved_.insert(masked.moved_.end(), rested.begin(), rested.end());
            masked.moved_.insert(masked.moved_.end(), settling.begin(), settling.end());
        } catch (...) {
            masked.is_made_ = false; // it is made anew
        }
    }
}

#define JOSTLE_INSTANTIATE(Dim, T) template class MaskedIndexes<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
