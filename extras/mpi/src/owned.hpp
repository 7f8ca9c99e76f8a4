// SPDX-License-Identifier: MIT
#pragma once

#include <memory_resource>
#include <span>
#include <vector>

#include "object.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// The objects of this rank as commands have made them, and of those that wait for an update, what they are
/// until then. So an update that is kept has nothing to copy, and one that fails nothing to put back.
///
/// In an update in which everything moves, most of the time goes by while memory is waited for. So what is
/// seldom there lies elsewhere, and an object's entry and what it was are 48 and 36 bytes in 3D float.
template <int Dim, Coordinate T>
class Owned
{
  public:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    using Box = Aabb<Dim, T>;
    using Object = mpi::Object<Dim, T>;
    using Details = mpi::Details<Dim, T>;
    struct Entry
    {
        std::uint64_t id;
        Box box;
        std::uint32_t details;               ///< where they lie
        std::uint32_t pending;               ///< where what it was lies, if that one is about it
        mutable std::uint32_t member = none; ///< where this rank's region had it last; see Region::hear
        bool exists;                         ///< false: it will be removed
    };
    /// What an object with a queued command is until the next update.
    struct Pending
    {
        std::uint32_t entry; ///< where the object lies among entries()
        std::uint32_t details;
        Box box;
        bool exists; ///< false: its addition is queued
    };

    explicit Owned(std::pmr::memory_resource* memory)
        : places_(memory), entries_(memory), pending_(memory), details_(1, Details{}, memory), free_(memory)
    {
    }

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
    [[nodiscard]] bool exists(const Entry& entry) const noexcept
    {
        return is_pending(entry) ? pending_[entry.pending].exists : entry.exists;
    }
    [[nodiscard]] Object now(const Entry& entry) const noexcept
    {
        return is_pending(entry) ? object(pending_[entry.pending]) : object(entry);
    }
    /// What it will be.
    [[nodiscard]] Object next(const Entry& entry) const noexcept { return object(entry); }
    /// And what it will touch.
    [[nodiscard]] Box bounds(const Entry& entry, T margin_of_world) const noexcept
    {
        if (entry.details == plain && margin_of_world == 0) return entry.box;
        return details_[entry.details].bounds(entry.box, margin_of_world);
    }
    /// Whether the object is enabled and stays so, and nothing but its bounds may change.
    [[nodiscard]] bool only_moves(const Pending& was, const Entry& entry) const noexcept
    {
        const Details &before = details_[was.details], &after = details_[entry.details];
        return was.exists && entry.exists && before.enabled && after.enabled &&
               (was.details == entry.details || before.filter == after.filter);
    }
    [[nodiscard]] std::span<const Entry> entries() const noexcept { return entries_; }
    [[nodiscard]] std::span<const Pending> pending() const noexcept { return pending_; }
    /// How many objects there will be.
    [[nodiscard]] std::size_t size() const noexcept { return entries_.size() - going_; }
    /// Another one after each update that changed something.
    [[nodiscard]] std::uint64_t version() const noexcept { return version_; }

    // Commands. One that finds no memory has no effect.

    /// Only for an id that has no entry, or one of an object that neither exists nor will.
    void add(std::uint64_t id, const Object& object)
    {
        make_room(pending_);
        const std::uint32_t details = keep_details(object.details);
        Entry& entry = entries_[enter(id, details)];
        if (!is_pending(entry)) {
            note(entry);
            ++going_;
        }
        take_details(entry, details);
        entry.box = object.box;
        entry.exists = true;
        --going_;
    }
    void remove(const Entry& entry)
    {
        change(entry).exists = false;
        ++going_;
    }
    void move(const Entry& entry, const Box& box, const Vec<Dim, T>& displacement)
    {
        if (entry.details != plain || displacement != Vec<Dim, T>{})
            change_details(entry, [&](Details& details) { details.displacement = displacement; });
        change(entry).box = box;
    }
    template <class Change>
    void change_details(const Entry& entry, const Change& how)
    {
        Details details = details_[entry.details];
        how(details);
        if (details == details_[entry.details]) return;
        Entry& own = change(entry);
        take_details(own, keep_details(details));
    }

    // An update: objects on their way here are entered, and then it is kept or undone.

    /// Not queued: an object that exists elsewhere. `Error` for one that is here.
    void receive(std::uint64_t id, const Object& object)
    {
        const std::size_t before = entries_.size();
        const std::uint32_t details = keep_details(object.details);
        Entry& entry = entries_[enter(id, details)];
        if (entries_.size() == before) {
            release(details);
            throw Error(ErrorCode::invalid_argument, "object " + std::to_string(id) + " is on two ranks", id);
        }
        entry.details = details;
        entry.box = object.box;
        entry.exists = true;
        ++arriving_;
    }
    /// What was queued is what is. Those of `departed` are gone.
    void keep(std::span<const std::uint64_t> departed) noexcept
    {
        version_ += arriving_ != 0 || !pending_.empty() || !departed.empty();
        if (details_change_)
            for (const Pending& was : pending_)
                if (was.details != entries_[was.entry].details) release(was.details);
        details_change_ = false;
        if (going_ != 0) erase_those_that_go();
        pending_.clear();
        for (const std::uint64_t id : departed)
            erase(id);
        // Few come and go in most updates, and to put all in order costs as much as looking many up.
        out_of_order_ += arriving_ + departed.size();
        arriving_ = 0;
        if (out_of_order_ * 16 > entries_.size()) put_in_order();
    }
    void undo() noexcept
    {
        for (; arriving_ != 0; --arriving_)
            erase(entries_.back().id);
    }

  private:
    static constexpr std::uint32_t plain = 0; ///< the details that most have

    [[nodiscard]] std::uint32_t place(const Entry& entry) const noexcept
    {
        return static_cast<std::uint32_t>(&entry - entries_.data());
    }
    [[nodiscard]] bool is_pending(const Entry& entry) const noexcept
    {
        return entry.pending < pending_.size() && pending_[entry.pending].entry == place(entry);
    }
    template <class EntryOrPending>
    [[nodiscard]] Object object(const EntryOrPending& of) const noexcept
    {
        return {of.box, details_[of.details]};
    }
    /// What is there is what it was.
    void note(Entry& entry)
    {
        entry.pending = static_cast<std::uint32_t>(pending_.size());
        pending_.push_back({place(entry), entry.details, entry.box, entry.exists});
    }
    /// The entry, to be changed.
    [[nodiscard]] Entry& change(const Entry& entry)
    {
        Entry& own = entries_[place(entry)];
        if (!is_pending(own)) note(own);
        return own;
    }
    /// The place of the entry with this id, which is made if there is none. If that fails, `details` are
    /// nobody's.
    std::uint32_t enter(std::uint64_t id, std::uint32_t details)
    {
        try {
            make_room(entries_);
            const auto [at, is_new] = places_.emplace(id, static_cast<std::uint32_t>(entries_.size()));
            if (is_new) entries_.push_back({id, {}, plain, none, none, false});
            return at->second;
        } catch (...) {
            release(details);
            throw;
        }
    }
    /// Where a copy lies.
    [[nodiscard]] std::uint32_t keep_details(const Details& details)
    {
        if (details == Details{}) return plain;
        if (free_.empty()) {
            make_room(details_);
            free_.reserve(details_.capacity());
            details_.push_back(details);
            return static_cast<std::uint32_t>(details_.size() - 1);
        }
        const std::uint32_t at = free_.back();
        free_.pop_back();
        details_[at] = details;
        return at;
    }
    void release(std::uint32_t details) noexcept
    {
        if (details != plain) free_.push_back(details);
    }
    /// Of an entry that is pending.
    void take_details(Entry& entry, std::uint32_t details) noexcept
    {
        if (entry.details != pending_[entry.pending].details) release(entry.details);
        entry.details = details;
        details_change_ = true;
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
                                          [&](const Pending& was) { return !entries_[was.entry].exists; });
        std::sort(pending_.begin(), going,
                  [](const Pending& a, const Pending& b) { return a.entry > b.entry; });
        for (auto was = pending_.begin(); was != going; ++was)
            erase(entries_[was->entry].id);
        going_ = 0;
    }
    void erase(std::uint64_t id) noexcept
    {
        const auto at = places_.find(id);
        const std::uint32_t place = at->second;
        places_.erase(at);
        release(entries_[place].details);
        if (place + 1 != entries_.size()) {
            entries_[place] = entries_.back();
            places_.find(entries_[place].id)->second = place;
        }
        entries_.pop_back();
    }

    Places places_;
    std::pmr::vector<Entry> entries_; // those on their way here are the last
    std::pmr::vector<Pending> pending_;
    std::pmr::vector<Details> details_;    // of each that has other ones, behind those that most have
    std::pmr::vector<std::uint32_t> free_; // places there; it has room for all
    bool details_change_ = false;          // of some that is pending
    mutable std::size_t next_ = 0;         // behind the one that was found last
    std::size_t going_ = 0;                // entries that will not exist
    std::size_t arriving_ = 0, out_of_order_ = 0;
    std::uint64_t version_ = 0;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
