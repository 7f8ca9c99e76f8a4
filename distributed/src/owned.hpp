// SPDX-License-Identifier: MIT
#pragma once

#include <memory_resource>
#include <span>
#include <vector>

#include "object.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// The objects of this rank, and what is queued about them. Commands about one object are kept as what it
/// will be, so that a failed update has nothing to put back.
template <int Dim, Coordinate T>
class Owned
{
  public:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    struct Entry
    {
        std::uint64_t id;
        Object<Dim, T> now;
        bool exists;                         ///< false: its addition is queued, or it is on its way here
        std::uint32_t pending;               ///< where what it will be lies, or `none`
        mutable std::uint32_t member = none; ///< where this rank's region had it last; see Region::hear
    };
    struct Pending
    {
        std::uint32_t entry; ///< where the object lies among entries()
        Object<Dim, T> next;
        bool exists; ///< false: it will be removed
    };

    explicit Owned(std::pmr::memory_resource* memory) : places_(memory), entries_(memory), pending_(memory) {}

    [[nodiscard]] const Entry* find(std::uint64_t id) const noexcept
    {
        // Who goes through all objects mostly does so in their order.
        if (next_ >= entries_.size() || entries_[next_].id != id) {
            const auto at = places_.find(id);
            if (at == places_.end()) return nullptr;
            next_ = at->second;
        }
        return &entries_[next_++];
    }
    /// Whether it will exist.
    [[nodiscard]] bool will_exist(const Entry& entry) const noexcept
    {
        return entry.pending == none ? entry.exists : pending_[entry.pending].exists;
    }
    /// What it will be.
    [[nodiscard]] const Object<Dim, T>& next(const Entry& entry) const noexcept
    {
        return entry.pending == none ? entry.now : pending_[entry.pending].next;
    }
    [[nodiscard]] std::span<const Entry> entries() const noexcept { return entries_; }
    [[nodiscard]] std::span<const Pending> pending() const noexcept { return pending_; }
    /// Another one after each update that changed something.
    [[nodiscard]] std::uint64_t version() const noexcept { return version_; }

    /// Only for an id that has no entry, or one of an object that neither exists nor will.
    void add(std::uint64_t id, const Object<Dim, T>& object)
    {
        make_room(pending_);
        const std::uint32_t place = enter(id);
        Entry& entry = entries_[place];
        if (entry.pending == none) {
            entry.pending = static_cast<std::uint32_t>(pending_.size());
            pending_.push_back({place, object, true});
        } else
            pending_[entry.pending] = {place, object, true};
    }
    /// What the object with this entry will be, to be changed.
    [[nodiscard]] Pending& change(const Entry& entry)
    {
        const auto place = static_cast<std::uint32_t>(&entry - entries_.data());
        Entry& own = entries_[place];
        if (own.pending == none) {
            make_room(pending_);
            own.pending = static_cast<std::uint32_t>(pending_.size());
            pending_.push_back({place, own.now, true});
        }
        return pending_[own.pending];
    }

    // An update: objects on their way here are entered, and then it is kept or undone.

    /// Not queued: an object that exists elsewhere. `Error` for one that is here.
    void receive(std::uint64_t id, const Object<Dim, T>& object)
    {
        const std::size_t before = entries_.size();
        const std::uint32_t place = enter(id);
        if (entries_.size() == before)
            throw Error(ErrorCode::invalid_argument, "object " + std::to_string(id) + " is on two ranks", id);
        entries_[place].now = object;
        ++arriving_;
    }
    /// What was queued is what is. Those of `departed` are gone.
    void keep(std::span<const std::uint64_t> departed) noexcept
    {
        version_ += arriving_ != 0 || !pending_.empty() || !departed.empty();
        const std::size_t arrived = arriving_;
        for (std::size_t i = entries_.size() - arriving_; i < entries_.size(); ++i)
            entries_[i].exists = true;
        arriving_ = 0;
        bool some_go = false;
        for (const Pending& change : pending_) {
            some_go = some_go || !change.exists;
            Entry& entry = entries_[change.entry];
            entry.now = change.next;
            entry.exists = change.exists;
            entry.pending = none;
        }
        if (some_go) erase_those_that_go();
        for (const std::uint64_t id : departed)
            erase(id);
        pending_.clear();
        // Few come and go in most updates, and to put all in order costs as much as looking many up.
        out_of_order_ += arrived + departed.size();
        if (out_of_order_ * 16 > entries_.size()) put_in_order();
    }
    void undo() noexcept
    {
        for (; arriving_ != 0; --arriving_)
            erase(entries_.back().id);
    }

  private:
    /// The place of the entry with this id, which is made if there is none.
    std::uint32_t enter(std::uint64_t id)
    {
        make_room(entries_);
        const auto [at, is_new] = places_.emplace(id, static_cast<std::uint32_t>(entries_.size()));
        if (is_new) entries_.push_back({id, {}, false, none});
        return at->second;
    }
    /// So that who goes through the ids in order goes through memory in order.
    void put_in_order() noexcept
    {
        out_of_order_ = 0;
        std::sort(entries_.begin(), entries_.end(),
                  [](const Entry& a, const Entry& b) { return a.id < b.id; });
        for (std::size_t i = 0; i < entries_.size(); ++i)
            places_.find(entries_[i].id)->second = static_cast<std::uint32_t>(i);
    }
    void erase_those_that_go() noexcept
    {
        // From the last entry on, so that those that take the place of others aren't ones that go.
        const auto going = std::partition(pending_.begin(), pending_.end(),
                                          [](const Pending& change) { return !change.exists; });
        std::sort(pending_.begin(), going,
                  [](const Pending& a, const Pending& b) { return a.entry > b.entry; });
        for (auto change = pending_.begin(); change != going; ++change)
            erase(entries_[change->entry].id);
    }
    void erase(std::uint64_t id) noexcept
    {
        const auto at = places_.find(id);
        const std::uint32_t place = at->second;
        places_.erase(at);
        if (place + 1 != entries_.size()) {
            entries_[place] = entries_.back();
            places_.find(entries_[place].id)->second = place;
        }
        entries_.pop_back();
    }

    Places places_;
    std::pmr::vector<Entry> entries_; // those on their way here are the last
    std::pmr::vector<Pending> pending_;
    mutable std::size_t next_ = 0; // behind the one that was found last
    std::size_t arriving_ = 0, out_of_order_ = 0;
    std::uint64_t version_ = 0;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
