// SPDX-License-Identifier: MIT
#include "region.hpp"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

template <int Dim, Coordinate T>
void Region<Dim, T>::recover()
{
    if (!stale_) return;
    std::pmr::vector<Member> members(members_.get_allocator());
    members.reserve(places_.size());
    for (const auto& [id, index] : places_)
        members.push_back(members_[index]);
    std::sort(members.begin(), members.end(), [](const Member& a, const Member& b) { return a.id < b.id; });
    jostle::World<Dim, T> world(options_);
    for (Member& member : members)
        member.local = world.add(member.state.bounds, {.filter = member.state.filter});
    world.update();
    touched_of_.assign(members.size(), none);
    members_.swap(members);
    for (std::size_t i = 0; i < members_.size(); ++i) // the indices of a new world ascend
        places_.find(members_[i].id)->second = static_cast<std::uint32_t>(i);
    world_ = std::move(world);
    stale_ = false;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::hear(Reader& from)
{
    heard_ = true;
    const Notice notice = Notice::read(from, [&](std::uint64_t id) {
        const Member& member = members_[places_.find(id)->second];
        return std::tuple(member.home, member.state);
    });
    make_room(touched_);
    const auto touched = static_cast<std::uint32_t>(touched_.size());
    if (notice.enters) {
        const ObjectId local = world_->add(notice.now.bounds, {.filter = notice.now.filter});
        if (members_.size() <= local.index) {
            touched_of_.resize(local.index + std::size_t{1}, none);
            members_.resize(local.index + std::size_t{1});
        }
        if (!places_.emplace(notice.id, local.index).second)
            throw Error(ErrorCode::invalid_argument,
                        "object " + std::to_string(notice.id) + " is added, and the scene has it already",
                        notice.id);
        members_[local.index] = {notice.id, local, notice.home, notice.now};
        touched_.push_back({local.index, notice.home, true, notice.leaves, notice.before});
        touched_of_[local.index] = touched;
        return;
    }
    const std::uint32_t index = places_.find(notice.id)->second;
    Member& member = members_[index];
    if (notice.leaves)
        world_->remove(member.local);
    else {
        if (differ(notice.before.bounds, notice.now.bounds)) world_->move(member.local, notice.now.bounds);
        if (notice.before.filter != notice.now.filter) world_->set_filter(member.local, notice.now.filter);
    }
    touched_.push_back({index, member.home, false, notice.leaves, notice.before});
    touched_of_[index] = touched;
    member.home = notice.home;
    member.state = notice.now;
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
    // The lower id first.
    const auto ordered = [&](std::uint32_t i, std::uint32_t j) {
        return members_[i].id < members_[j].id ? std::pair(i, j) : std::pair(j, i);
    };
    for (const ObjectPair& found : world_->began()) {
        const auto [i, j] = ordered(found.a.index, found.b.index);
        const Member &a = members_[i], &b = members_[j];
        if (!reports(now, a.state.bounds, b.state.bounds, a.home)) continue;
        // To this rank the pair may be new only because an object has come here.
        if (!touch(before(i), before(j)))
            listener.began(a.home, pair(a, b));
        else if (changed(i) || changed(j))
            listener.persisted(a.home, pair(a, b));
    }
    for (const jostle::Pair found : world_->persisted()) {
        const auto [i, j] = ordered(found.a, found.b);
        const Member &a = members_[i], &b = members_[j];
        if (reports(now, a.state.bounds, b.state.bounds, a.home)) listener.persisted(a.home, pair(a, b));
    }
    for (const jostle::EndedPair& found : world_->ended()) {
        const auto [i, j] = ordered(found.a.index, found.b.index);
        const Member &a = members_[i], &b = members_[j];
        if (touch(a.state, b.state)) continue; // elsewhere
        if (reports(before_update, before(i).bounds, before(j).bounds, home_before(i)))
            listener.ended(a.home, {a.id, b.id, why_ended(a.state, b.state)});
    }
}

template <int Dim, Coordinate T>
void Region<Dim, T>::keep() noexcept
{
    for (const Touched& touched : touched_) {
        const Member& member = members_[touched.index];
        if (!touched.enters) ghosts_ -= touched.home_before != rank_;
        if (touched.leaves)
            places_.erase(member.id);
        else
            ghosts_ += member.home != rank_;
        touched_of_[touched.index] = none;
    }
    touched_.clear();
    heard_ = false;
}

template <int Dim, Coordinate T>
void Region<Dim, T>::undo() noexcept
{
    for (const Touched& touched : touched_) {
        Member& member = members_[touched.index];
        if (touched.enters)
            places_.erase(member.id);
        else {
            member.home = touched.home_before;
            member.state = touched.before;
        }
        touched_of_[touched.index] = none;
    }
    touched_.clear();
    stale_ = stale_ || heard_;
    heard_ = false;
}

template class Region<2, float>;
template class Region<2, double>;
template class Region<3, float>;
template class Region<3, double>;

} // namespace mpi
JOSTLE_NAMESPACE_END
