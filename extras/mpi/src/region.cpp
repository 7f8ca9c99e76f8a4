// SPDX-License-Identifier: MIT
#include "region.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <tuple>
#include <utility>

#include "lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

namespace {

/// How many pairs before its turn an object's memory is asked for: partners lie anywhere.
constexpr std::size_t ahead = 16;

/// Sorts `others` and puts what item(other) says of each into a list, which is in order and stays so: from
/// behind, and few into long stretches.
template <class List, class Other, class IsBefore, class Item>
void merge_sorted(List& list, std::pmr::vector<Other>& others, const IsBefore& is_before, const Item& item)
{
    if (others.empty()) return;
    std::sort(others.begin(), others.end(), ascends<Other>);
    std::size_t left = list.size(), end = left + others.size();
    list.resize(end);
    const auto at = [&](std::size_t i) { return list.begin() + static_cast<std::ptrdiff_t>(i); };
    for (auto other = others.rbegin(); other != others.rend(); ++other) {
        std::size_t low = left, high = left; // those from `high` on are behind it
        for (std::size_t step = 1; low != 0 && !is_before(list[low - 1], *other); step *= 2) {
            high = low - 1;
            low -= std::min(low, step);
        }
        const auto split = static_cast<std::size_t>(
            std::partition_point(at(low), at(high),
                                 [&](const auto& each) { return is_before(each, *other); }) -
            list.begin());
        std::move_backward(at(split), at(left), at(end));
        end -= left - split + 1;
        left = split;
        list[end] = item(*other);
    }
}

} // namespace

template <int Dim, Coordinate T>
void Region<Dim, T>::recover(const Partition& partition)
{
    if (!stale_) return;
    const auto allocator = objects_.get_allocator();
    std::pmr::vector<std::uint32_t> from(allocator);
    from.reserve(places_.size());
    for (const auto& [id, index] : places_)
        from.push_back(index);
    std::sort(from.begin(), from.end(),
              [&](std::uint32_t i, std::uint32_t j) { return objects_[i].id < objects_[j].id; });
    jostle::World<Dim, T> world(options_);
    std::pmr::vector<Object> objects(allocator);
    std::pmr::vector<Member> members(allocator);
    objects.reserve(from.size());
    members.reserve(from.size());
    for (const std::uint32_t index : from) {
        objects.push_back(objects_[index]); // the indices of a new world ascend
        members.push_back(members_[index]);
        members.back().local = world.add(objects.back().bounds, {.filter = members.back().filter});
    }
    world.update();
    objects_.swap(objects);
    if (shown_.empty()) shown_.swap(objects); // else the lists are older than the last failure, too
    members_.swap(members);
    touched_of_.resize(members_.size()); // there are at least as many
    flags_.resize(members_.size());
    for (std::uint32_t i = 0; i < objects_.size(); ++i) {
        places_.find(objects_[i].id)->second = i;
        flags_[i] = here | in_order;
    }
    note_all_insides(partition);
    world_ = std::move(world);
    stale_ = false;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::hear(std::uint64_t id, Reader& from)
{
    std::uint32_t index = none;
    const Notice notice = Notice::read(from, id, [&] {
        index = places_.find(id)->second;
        return std::tuple(objects_[index].rank, state(index));
    });
    heard_ = true;
    if (notice.enters)
        entering_.push_back(notice);
    else
        hear(notice, index);
}

template <int Dim, Coordinate T>
void Region<Dim, T>::hear(const Notice& notice, std::uint32_t index)
{
    make_room(touched_);
    Member& member = members_[index];
    if (notice.leaves)
        world_->remove(member.local);
    else {
        if (differ(notice.before.bounds, notice.now.bounds))
            change_bounds(index, notice.before.bounds, notice.now.bounds);
        if (notice.before.filter != notice.now.filter) world_->set_filter(member.local, notice.now.filter);
    }
    touched_of_[index] = static_cast<std::uint32_t>(touched_.size());
    touched_.push_back({index, objects_[index].rank, false, notice.leaves, notice.before});
    objects_[index].rank = notice.home;
    objects_[index].bounds = notice.now.bounds;
    member.filter = notice.now.filter;
    member.presence = notice.now.presence;
    flags_[index] &= static_cast<std::uint8_t>(~inside);
}

template <int Dim, Coordinate T>
bool Region<Dim, T>::move_inside(std::uint64_t id, std::uint32_t& guess, const Aabb<Dim, T>& to)
{
    if (guess >= flags_.size() || (flags_[guess] & here) == 0 || objects_[guess].id != id) {
        const auto at = places_.find(id);
        if (at == places_.end()) return false;
        guess = at->second;
    }
    if ((flags_[guess] & inside) == 0) return false;
    heard_ = true;
    const Aabb<Dim, T> from = objects_[guess].bounds;
    if (!differ(from, to)) return true;
    touched_of_[guess] = static_cast<std::uint32_t>(moved_.size());
    change_bounds(guess, from, to);
    return true;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::change_bounds(std::uint32_t index, const Aabb<Dim, T>& from, const Aabb<Dim, T>& to)
{
    moved_from_.push_back(from);
    moved_to_.push_back(to);
    moved_.push_back(members_[index].local);
    objects_[index].bounds = to;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::enter(const Notice& notice)
{
    make_room(touched_);
    const ObjectId local = world_->add(notice.now.bounds, {.filter = notice.now.filter});
    if (flags_.size() <= local.index) {
        touched_of_.resize(local.index + std::size_t{1});
        objects_.resize(local.index + std::size_t{1});
        members_.resize(local.index + std::size_t{1});
        flags_.resize(local.index + std::size_t{1});
    }
    if (!places_.emplace(notice.id, local.index).second)
        throw Error(ErrorCode::invalid_argument,
                    "object " + std::to_string(notice.id) + " is added, and the scene has it already",
                    notice.id);
    const bool fits = fits_in_order(local.index, notice.id);
    objects_[local.index] = {notice.id, notice.now.bounds, notice.home};
    members_[local.index] = {local, notice.now.filter, notice.now.presence};
    flags_[local.index] = fits ? here | in_order : here;
    touched_of_[local.index] = static_cast<std::uint32_t>(touched_.size());
    touched_.push_back({local.index, notice.home, true, notice.leaves, notice.before});
}

/// Whether a new member has its place among those that are in order; false as well where none of these is
/// near.
template <int Dim, Coordinate T>
bool Region<Dim, T>::fits_in_order(std::uint32_t index, std::uint64_t id) const noexcept
{
    constexpr std::size_t near = 64;
    std::size_t before = index, behind = index + std::size_t{1};
    while (before != 0 && (flags_[before - 1] & in_order) == 0)
        if (index - --before == near) return false;
    while (behind != flags_.size() && (flags_[behind] & in_order) == 0)
        if (++behind - index == near) return false;
    return (before == 0 || objects_[before - 1].id < id) &&
           (behind == flags_.size() || id < objects_[behind].id);
}

template <int Dim, Coordinate T>
void Region<Dim, T>::note_inside(std::uint32_t index, const Partition& partition) noexcept
{
    const bool is = objects_[index].rank == rank_ && partition.is_inside(objects_[index].bounds);
    flags_[index] = static_cast<std::uint8_t>(is ? flags_[index] | inside : flags_[index] & ~inside);
}
template <int Dim, Coordinate T>
void Region<Dim, T>::note_all_insides(const Partition& partition) noexcept
{
    for (std::uint32_t i = 0; i < flags_.size(); ++i)
        if ((flags_[i] & here) != 0) note_inside(i, partition);
}
template <int Dim, Coordinate T>
void Region<Dim, T>::search()
{
    // In the order of their ids, so that pairs are found in about the order in which they are listed.
    std::sort(entering_.begin(), entering_.end(),
              [](const Notice& a, const Notice& b) { return a.id < b.id; });
    for (const Notice& notice : entering_)
        enter(notice);
    world_->update(moved_, moved_to_);
}

template <int Dim, Coordinate T>
bool Region<Dim, T>::reports(const Partition& partition, const Aabb<Dim, T>& a, const Aabb<Dim, T>& b,
                             int home_of_lower)
{
    Aabb<Dim, T> both;
    for (int d = 0; d < Dim; ++d) {
        both.lo[d] = std::max(a.lo[d], b.lo[d]);
        both.hi[d] = std::min(a.hi[d], b.hi[d]);
    }
    partition.touched(both, ranks_);
    const bool is_there = std::binary_search(ranks_.begin(), ranks_.end(), home_of_lower);
    return rank_ == (is_there ? home_of_lower : ranks_.front());
}

template <int Dim, Coordinate T>
void Region<Dim, T>::tell(const Partition& before_update, const Partition& now,
                          PairListener<Dim, T>& listener, Lists<Dim, T>& lists)
{
    began_.clear();
    persisted_.clear();
    // The lower id first.
    const auto ordered = [&](std::uint32_t i, std::uint32_t j) {
        return objects_[i].id < objects_[j].id ? std::pair(i, j) : std::pair(j, i);
    };
    const auto reports_now = [&](std::uint32_t i, std::uint32_t j) {
        const Aabb<Dim, T>& bounds = objects_[i].bounds;
        return now.is_inside(bounds) || reports(now, bounds, objects_[j].bounds, objects_[i].rank);
    };
    const auto other = [&](std::uint32_t i, std::uint32_t j) {
        return Other{objects_[i].id, objects_[j].id, {i, j}};
    };
    for (const ObjectPair& found : world_->began()) {
        if (both_are(plain, found.a.index, found.b.index)) { // both were here before
            lists.began.places.push_back({found.a.index, found.b.index});
            continue;
        }
        const auto [i, j] = ordered(found.a.index, found.b.index);
        if (!reports_now(i, j)) continue;
        // To this rank the pair may be new only because an object has come here.
        const bool touched = touch(before(i), before(j));
        if (touched && !changed(i) && !changed(j)) continue;
        if (const int home = objects_[i].rank; home != rank_)
            touched ? listener.persisted(home, pair(i, j)) : listener.began(home, pair(i, j));
        else if (touched) // the list of these begins below
            persisted_.push_back(other(i, j));
        else if (both_are(in_order, i, j))
            lists.began.places.push_back({i, j});
        else
            began_.push_back(other(i, j));
    }
    for (const std::span<const jostle::Pair> block : world_->persisted().blocks()) {
        const jostle::Pair *at = block.data(), *const end = at + block.size();
        while (at != end) {
            const jostle::Pair* const first = at;
            while (at != end && both_are(plain, at->a, at->b))
                ++at;
            lists.persisted.places.insert(lists.persisted.places.end(), first, at);
            for (; at != end && !both_are(plain, at->a, at->b); ++at) {
                const auto [i, j] = ordered(at->a, at->b);
                if (!reports_now(i, j)) continue;
                if (objects_[i].rank != rank_)
                    listener.persisted(objects_[i].rank, pair(i, j));
                else if (both_are(in_order, i, j))
                    lists.persisted.places.push_back({i, j});
                else
                    persisted_.push_back(other(i, j));
            }
        }
    }
    const std::span<const jostle::EndedPair> all_ended = world_->ended();
    for (std::size_t k = 0; k < all_ended.size(); ++k) {
        const jostle::EndedPair& found = all_ended[k];
        __builtin_prefetch(&objects_[all_ended[std::min(k + ahead, all_ended.size() - 1)].b.index].id);
        if (both_are(plain, found.a.index, found.b.index)) { // what ends otherwise is told by a notice
            lists.ended.push_back(
                {objects_[found.a.index].id, objects_[found.b.index].id, EndReason::moved_apart});
            continue;
        }
        const auto [i, j] = ordered(found.a.index, found.b.index);
        const State<Dim, T> a = state(i), b = state(j);
        if (touch(a, b)) continue; // elsewhere
        if (!reports(before_update, before(i).bounds, before(j).bounds, home_before(i))) continue;
        const EndedPair pair{objects_[i].id, objects_[j].id, why_ended(a, b)};
        if (objects_[i].rank != rank_)
            listener.ended(objects_[i].rank, pair);
        else
            (both_are(in_order, i, j) ? lists.ended : lists.ended_out_of_order).push_back(pair);
    }
}

template <int Dim, Coordinate T>
void Region<Dim, T>::put_in_order(Lists<Dim, T>& lists)
{
    merge(lists.began.places, began_);
    merge(lists.persisted.places, persisted_);
    merge_sorted(lists.ended, lists.ended_out_of_order, ascends<EndedPair>, std::identity());
    lists.ended_out_of_order.clear();
}

template <int Dim, Coordinate T>
void Region<Dim, T>::add_told(Lists<Dim, T>& lists)
{
    add_told(lists.began, began_);
    add_told(lists.persisted, persisted_);
    merge_sorted(lists.ended, lists.ended_out_of_order, ascends<EndedPair>, std::identity());
}
template <int Dim, Coordinate T>
void Region<Dim, T>::add_told(ListedPairs<Dim, T>& list, std::pmr::vector<Other>& others) const
{
    others.clear();
    others.reserve(list.told.size());
    for (const Pair<Dim, T>& pair : list.told)
        others.push_back(
            {pair.a, pair.b, {static_cast<std::uint32_t>(others.size()), PairList<Dim, T>::told}});
    merge(list.places, others);
}

template <int Dim, Coordinate T>
void Region<Dim, T>::merge(std::pmr::vector<jostle::Pair>& places, std::pmr::vector<Other>& others) const
{
    const auto is_before = [&](const jostle::Pair& place, const Other& other) {
        return ascends(Other{objects_[place.a].id, objects_[place.b].id, place}, other);
    };
    merge_sorted(places, others, is_before, [](const Other& other) { return other.place; });
}

template <int Dim, Coordinate T>
void Region<Dim, T>::keep(const Partition& now, bool divided) noexcept
{
    for (const Touched& touched : touched_) {
        const Object& object = objects_[touched.index];
        if (!touched.enters) ghosts_ -= touched.home_before != rank_;
        if (touched.leaves) {
            places_.erase(object.id);
            members_[touched.index].local = {};
            flags_[touched.index] = 0;
        } else {
            ghosts_ += object.rank != rank_;
            note_inside(touched.index, now);
        }
    }
    if (divided) note_all_insides(now);
    std::pmr::vector<Object>(shown_.get_allocator()).swap(shown_);
    forget();
}

template <int Dim, Coordinate T>
void Region<Dim, T>::undo(const Partition& before) noexcept
{
    for (std::size_t k = 0; k < moved_.size(); ++k)
        objects_[moved_[k].index].bounds = moved_from_[k];
    for (const Touched& touched : touched_) {
        Member& member = members_[touched.index];
        if (touched.enters) {
            places_.erase(objects_[touched.index].id);
            member.local = {};
            flags_[touched.index] = 0;
        } else {
            objects_[touched.index].rank = touched.home_before;
            objects_[touched.index].bounds = touched.before.bounds;
            member.filter = touched.before.filter;
            member.presence = touched.before.presence;
        }
    }
    note_all_insides(before);
    stale_ = stale_ || heard_;
    forget();
}

template <int Dim, Coordinate T>
void Region<Dim, T>::forget() noexcept
{
    touched_.clear();
    entering_.clear();
    moved_.clear();
    moved_to_.clear();
    moved_from_.clear();
    heard_ = false;
}

template class Region<2, float>;
template class Region<2, double>;
template class Region<3, float>;
template class Region<3, double>;

} // namespace mpi
JOSTLE_NAMESPACE_END
