// SPDX-License-Identifier: MIT
#include "region.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

namespace {

/// How many pairs before its turn an object's memory is asked for: partners lie anywhere.
constexpr std::size_t ahead = 16;
template <class Item>
void fetch(const std::pmr::vector<Item>& items, std::uint32_t index) noexcept
{
    __builtin_prefetch(items.data() + index); // of gcc and clang, which are what builds this part
}

} // namespace

template <int Dim, Coordinate T>
void Region<Dim, T>::recover()
{
    if (!stale_) return;
    std::pmr::vector<std::pair<Name, Member>> all(members_.get_allocator());
    all.reserve(places_.size());
    for (const auto& [id, index] : places_)
        all.emplace_back(names_[index], members_[index]);
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first.id < b.first.id; });
    jostle::World<Dim, T> world(options_);
    std::pmr::vector<Name> names(members_.get_allocator());
    std::pmr::vector<Member> members(members_.get_allocator());
    names.reserve(all.size());
    members.reserve(all.size());
    for (const auto& [name, member] : all) {
        names.push_back(name);
        members.push_back({world.add(member.state.bounds, {.filter = member.state.filter}), member.state});
    }
    world.update();
    touched_of_.assign(members.size(), none);
    names_.swap(names);
    members_.swap(members);
    for (std::size_t i = 0; i < names_.size(); ++i) // the indices of a new world ascend
        places_.find(names_[i].id)->second = static_cast<std::uint32_t>(i);
    world_ = std::move(world);
    stale_ = false;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::hear(Reader& from)
{
    std::uint32_t index = none;
    const Notice notice = Notice::read(from, [&](std::uint64_t id) {
        index = places_.find(id)->second;
        return std::tuple(names_[index].home, members_[index].state);
    });
    hear(notice, index);
}

template <int Dim, Coordinate T>
void Region<Dim, T>::hear(const Notice& notice, std::uint32_t& guess)
{
    heard_ = true;
    make_room(touched_);
    if (notice.enters) return entering_.push_back(notice);
    if (guess >= names_.size() || names_[guess].id != notice.id || members_[guess].local == ObjectId{})
        guess = places_.find(notice.id)->second;
    Member& member = members_[guess];
    if (notice.leaves)
        world_->remove(member.local);
    else {
        if (differ(notice.before.bounds, notice.now.bounds)) {
            moved_.push_back(member.local);
            moved_to_.push_back(notice.now.bounds);
        }
        if (notice.before.filter != notice.now.filter) world_->set_filter(member.local, notice.now.filter);
    }
    touched_of_[guess] = static_cast<std::uint32_t>(touched_.size());
    touched_.push_back({guess, names_[guess].home, false, notice.leaves, notice.before});
    names_[guess].home = notice.home;
    member.state = notice.now;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::enter(const Notice& notice)
{
    make_room(touched_);
    const ObjectId local = world_->add(notice.now.bounds, {.filter = notice.now.filter});
    if (members_.size() <= local.index) {
        touched_of_.resize(local.index + std::size_t{1}, none);
        names_.resize(local.index + std::size_t{1});
        members_.resize(local.index + std::size_t{1});
    }
    if (!places_.emplace(notice.id, local.index).second)
        throw Error(ErrorCode::invalid_argument,
                    "object " + std::to_string(notice.id) + " is added, and the scene has it already",
                    notice.id);
    names_[local.index] = {notice.id, notice.home};
    members_[local.index] = {local, notice.now};
    touched_of_[local.index] = static_cast<std::uint32_t>(touched_.size());
    touched_.push_back({local.index, notice.home, true, notice.leaves, notice.before});
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
                          PairListener<Dim, T>& listener)
{
    began_.clear();
    persisted_.clear();
    // The lower id first.
    const auto ordered = [&](std::uint32_t i, std::uint32_t j) {
        return names_[i].id < names_[j].id ? std::pair(i, j) : std::pair(j, i);
    };
    const auto reports_now = [&](std::uint32_t i, std::uint32_t j) {
        const Aabb<Dim, T>& bounds = members_[i].state.bounds;
        return now.is_inside(bounds) || reports(now, bounds, members_[j].state.bounds, names_[i].home);
    };
    const auto began = [&](std::uint32_t i, std::uint32_t j) {
        if (names_[i].home == rank_)
            began_.push_back({names_[i].id, names_[j].id, i, j});
        else
            listener.began(names_[i].home, pair(i, j));
    };
    const auto persisted = [&](std::uint32_t i, std::uint32_t j) {
        if (names_[i].home == rank_)
            persisted_.push_back({names_[i].id, names_[j].id, i, j});
        else
            listener.persisted(names_[i].home, pair(i, j));
    };
    for (const ObjectPair& found : world_->began()) {
        const auto [i, j] = ordered(found.a.index, found.b.index);
        if (!reports_now(i, j)) continue;
        // To this rank the pair may be new only because an object has come here.
        if (!touch(before(i), before(j)))
            began(i, j);
        else if (changed(i) || changed(j))
            persisted(i, j);
    }
    for (const std::span<const jostle::Pair> block : world_->persisted().blocks())
        for (std::size_t k = 0; k < block.size(); ++k) {
            fetch(names_, block[std::min(k + ahead, block.size() - 1)].b);
            const auto [i, j] = ordered(block[k].a, block[k].b);
            if (reports_now(i, j)) persisted(i, j);
        }
    for (const jostle::EndedPair& found : world_->ended()) {
        const auto [i, j] = ordered(found.a.index, found.b.index);
        const State<Dim, T>&a = members_[i].state, &b = members_[j].state;
        if (touch(a, b)) continue; // elsewhere
        if (reports(before_update, before(i).bounds, before(j).bounds, home_before(i)))
            listener.ended(names_[i].home, {names_[i].id, names_[j].id, why_ended(a, b)});
    }
}

template <int Dim, Coordinate T>
void Region<Dim, T>::sort()
{
    sort(began_);
    sort(persisted_);
}

/// Indices mostly ascend as ids do, so most pairs are in order: the others are taken out, sorted, put back.
template <int Dim, Coordinate T>
void Region<Dim, T>::sort(std::pmr::vector<Own>& pairs)
{
    constexpr std::size_t few = 64; // more than one object's pairs
    out_of_order_.clear();
    std::size_t kept = 0;
    for (const Own& pair : pairs) {
        if (kept == 0 || ascends(pairs[kept - 1], pair))
            pairs[kept++] = pair;
        else if (kept <= few || ascends(pairs[kept - 1 - few], pair)) { // the last ones came too early
            while (kept != 0 && !ascends(pairs[kept - 1], pair))
                out_of_order_.push_back(pairs[--kept]);
            pairs[kept++] = pair;
        } else
            out_of_order_.push_back(pair);
    }
    std::sort(out_of_order_.begin(), out_of_order_.end(), ascends<Own>);
    for (std::size_t to = pairs.size(), left = out_of_order_.size(); left != 0;)
        if (kept != 0 && ascends(out_of_order_[left - 1], pairs[kept - 1]))
            pairs[--to] = pairs[--kept];
        else
            pairs[--to] = out_of_order_[--left];
}

template <int Dim, Coordinate T>
void Region<Dim, T>::list(std::span<const Pair<Dim, T>> began_elsewhere,
                          std::span<const Pair<Dim, T>> persisted_elsewhere,
                          std::pmr::vector<Pair<Dim, T>>& began,
                          std::pmr::vector<Pair<Dim, T>>& persisted) const
{
    list(began_, began_elsewhere, began);
    list(persisted_, persisted_elsewhere, persisted);
}

template <int Dim, Coordinate T>
void Region<Dim, T>::list(const std::pmr::vector<Own>& own, std::span<const Pair<Dim, T>> elsewhere,
                          std::pmr::vector<Pair<Dim, T>>& to) const
{
    to.clear();
    to.reserve(own.size() + elsewhere.size());
    auto other = elsewhere.begin();
    for (std::size_t k = 0; k < own.size(); ++k) {
        const std::uint32_t next = own[std::min(k + ahead, own.size() - 1)].j;
        fetch(names_, next);
        fetch(members_, next);
        for (; other != elsewhere.end() && ascends({other->a, other->b, 0, 0}, own[k]); ++other)
            to.push_back(*other);
        to.push_back(pair(own[k].i, own[k].j));
    }
    to.insert(to.end(), other, elsewhere.end());
}

template <int Dim, Coordinate T>
void Region<Dim, T>::keep() noexcept
{
    for (const Touched& touched : touched_) {
        const Name& name = names_[touched.index];
        if (!touched.enters) ghosts_ -= touched.home_before != rank_;
        if (touched.leaves) {
            places_.erase(name.id);
            members_[touched.index].local = {};
        } else
            ghosts_ += name.home != rank_;
        touched_of_[touched.index] = none;
    }
    forget();
}

template <int Dim, Coordinate T>
void Region<Dim, T>::undo() noexcept
{
    for (const Touched& touched : touched_) {
        Member& member = members_[touched.index];
        if (touched.enters) {
            places_.erase(names_[touched.index].id);
            member.local = {};
        } else {
            names_[touched.index].home = touched.home_before;
            member.state = touched.before;
        }
        touched_of_[touched.index] = none;
    }
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
    heard_ = false;
}

template class Region<2, float>;
template class Region<2, double>;
template class Region<3, float>;
template class Region<3, double>;

} // namespace mpi
JOSTLE_NAMESPACE_END
