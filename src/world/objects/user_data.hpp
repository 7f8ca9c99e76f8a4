// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <span>
#include <vector>

#include "jostle/world.hpp"
#include "world/objects/segments.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// The user data of each object: 64 bits, by index. Any thread may call any function at any time, except
/// those for updates. Takes no memory before data are set or removed.
class UserData
{
  public:
    explicit UserData(std::pmr::memory_resource* memory)
        : of_(memory), removed_(memory), removed_next_(memory), noted_(memory), note_of_(memory)
    {
    }

    void set(std::uint32_t index, std::uint64_t data)
    {
        std::atomic<std::uint64_t>* place = of_.find(index);
        if (notes_.load(std::memory_order_acquire)) {
            const std::lock_guard lock(mutex_);
            if (data == of(index)) return;
            prepare(index, data);
            put(index, data);
            return;
        }
        if (place == nullptr) {
            if (data == 0) return;
            const std::lock_guard lock(mutex_);
            make(index);
            place = of_.find(index);
        }
        place->store(data, std::memory_order_relaxed);
    }
    /// Sets the data of ids[i] to data_of(i), for all of these objects, or for none if it fails.
    template <class DataOf>
    void set(std::span<const ObjectId> ids, const DataOf& data_of)
    {
        const std::lock_guard lock(mutex_);
        for (std::size_t i = 0; i < ids.size(); ++i)
            if (data_of(i) != of(ids[i].index)) prepare(ids[i].index, data_of(i));
        for (std::size_t i = 0; i < ids.size(); ++i)
            put(ids[i].index, data_of(i));
    }
    [[nodiscard]] std::uint64_t of(std::uint32_t index) const noexcept
    {
        const std::atomic<std::uint64_t>* const place = of_.find(index);
        return place == nullptr ? 0 : place->load(std::memory_order_relaxed);
    }
    /// Whether anything was ever set.
    [[nodiscard]] bool any() const noexcept { return any_.load(std::memory_order_acquire); }

    // In an update: first the objects that it will remove, ascending by index, then that it has removed them.
    void begin_removal() noexcept { removed_next_.clear(); }
    void note_removal(ObjectId id) { removed_next_.push_back({id, of(id.index)}); }
    void end_removal() noexcept { removed_.swap(removed_next_); }
    /// The data of an object that the last update removed; null if it didn't.
    [[nodiscard]] const std::uint64_t* of_removed(ObjectId id) const noexcept
    {
        const auto at = std::partition_point(removed_.begin(), removed_.end(),
                                             [id](const Removed& each) { return each.id.index < id.index; });
        return at != removed_.end() && at->id == id ? &at->data : nullptr;
    }
    void forget_removed() noexcept { removed_.clear(); }

    // Once changes are to be recorded:

    struct Note
    {
        std::uint32_t index;
        std::uint64_t data; // the previous data
    };
    void begin_notes() noexcept
    {
        const std::lock_guard lock(mutex_);
        for (const Note& note : noted_)
            note_of_[note.index].store(0, std::memory_order_relaxed);
        noted_.clear();
        notes_.store(true, std::memory_order_release);
    }
    /// Appends the objects whose data may have changed to `indices`.
    template <class List>
    void list_noted(List& indices) const
    {
        const std::lock_guard lock(mutex_);
        for (const Note& note : noted_)
            indices.push_back(note.index);
    }
    [[nodiscard]] std::uint64_t then(std::uint32_t index) const
    {
        const std::lock_guard lock(mutex_);
        const std::atomic<std::uint32_t>* const note = note_of_.find(index);
        const std::uint32_t number = note == nullptr ? 0 : note->load(std::memory_order_relaxed);
        return number == 0 ? of(index) : noted_[number - 1].data;
    }
    /// So that put() can't fail.
    void expect(std::uint32_t index, std::uint64_t data)
    {
        const std::lock_guard lock(mutex_);
        if (data != of(index)) prepare(index, data);
    }
    void put(std::uint32_t index, std::uint64_t data) noexcept
    {
        if (data != of(index)) of_[index].store(data, std::memory_order_relaxed);
    }

  private:
    void make(std::uint32_t index)
    {
        of_.make(index);
        any_.store(true, std::memory_order_release);
    }
    void prepare(std::uint32_t index, std::uint64_t data)
    {
        if (data != 0) make(index);
        if (!notes_.load(std::memory_order_relaxed)) return;
        note_of_.make(index);
        if (note_of_[index].load(std::memory_order_relaxed) != 0) return;
        noted_.push_back({index, of(index)});
        note_of_[index].store(static_cast<std::uint32_t>(noted_.size()), std::memory_order_relaxed);
    }
    struct Removed
    {
        ObjectId id;
        std::uint64_t data;
    };
    Segments<std::uint64_t> of_;
    mutable std::mutex mutex_; // held while it grows or records changes
    std::atomic<bool> any_{false};
    std::pmr::vector<Removed> removed_, removed_next_;
    std::atomic<bool> notes_{false};
    std::pmr::vector<Note> noted_;
    Segments<std::uint32_t> note_of_; // by index: one more than its place among them; 0 for none
};

} // namespace world
JOSTLE_NAMESPACE_END
