// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "index/nodes/groups.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Objects that calls borrow and give back: each call has its own, also if it is nested in another or on
/// another thread.
template <class Item>
class Shelf
{
  public:
    explicit Shelf(std::pmr::memory_resource* memory) : memory_(memory), items_(memory) {}
    [[nodiscard]] std::unique_ptr<Item> take()
    {
        {
            const std::lock_guard lock(mutex_);
            if (!items_.empty()) {
                std::unique_ptr<Item> item = std::move(items_.back());
                items_.pop_back();
                return item;
            }
            // Has room for all borrowed objects, so that giving back allocates nothing.
            items_.reserve(++made_);
        }
        return std::make_unique<Item>(memory_);
    }
    void give(std::unique_ptr<Item> item) noexcept
    {
        if (item == nullptr) return;
        const std::lock_guard lock(mutex_);
        if (items_.size() < items_.capacity()) items_.push_back(std::move(item));
    }
    void release_memory() noexcept
    {
        const std::lock_guard lock(mutex_);
        items_.clear();
        items_.shrink_to_fit();
        made_ = 0;
    }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        const std::lock_guard lock(mutex_);
        std::uint64_t sum = items_.capacity() * sizeof(void*);
        for (const auto& item : items_)
            sum += sizeof(Item) + item->bytes();
        return sum;
    }

  private:
    mutable std::mutex mutex_;
    std::pmr::memory_resource* memory_;
    std::pmr::vector<std::unique_ptr<Item>> items_;
    std::size_t made_ = 0;
};

/// A node or a leaf that a search has opened, and the distances of the lanes that it hasn't visited yet.
template <int Dim, class T>
struct alignas(64) Opened
{
    T at[lanes]; // infinity for lanes not left
    Child<Dim, T> group;
    unsigned left;
};

/// The turn of the nearest lane of an opened group: of equally near ones, nodes and leaves come before
/// objects, since they may hold an object with a lesser id.
template <class T>
struct Turn
{
    T at;
    std::uint32_t rank; // 0, or an object's id + 1
    std::uint32_t opened;
    friend bool operator<(const Turn& a, const Turn& b) noexcept
    {
        return a.at < b.at || (a.at == b.at && a.rank < b.rank);
    }
};

/// What a queue needs beyond its own room.
template <int Dim, class T>
struct QueueMemory
{
    Buffer<Opened<Dim, T>> opened;
    Buffer<Turn<T>> turns;
    explicit QueueMemory(std::pmr::memory_resource* memory) : opened(memory), turns(memory) {}
    [[nodiscard]] std::uint64_t bytes() const noexcept { return opened.bytes() + turns.bytes(); }
};

template <int Dim, class T>
using QueueShelf = Shelf<QueueMemory<Dim, T>>;

/// A heap of what a search has opened, the nearest first. Most searches have all of it on their stack.
template <int Dim, class T>
class Queue
{
  public:
    explicit Queue(QueueShelf<Dim, T>& shelf) noexcept : shelf_(shelf) {}
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;
    ~Queue() { shelf_.give(std::move(memory_)); }

    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] const Turn<T>& first() const noexcept { return turns_[0]; }
    /// The group with the first turn; valid until the next call of `room`.
    [[nodiscard]] Opened<Dim, T>& opened() noexcept { return opened_[turns_[0].opened]; }

    /// Returns room for what is opened next: fill it in, then `add` it.
    [[nodiscard]] Opened<Dim, T>& room()
    {
        if (size_ == capacity_) grow();
        if (size_ == used_) turns_[used_].opened = used_, ++used_;
        return opened_[turns_[size_].opened];
    }
    void add(T at, std::uint32_t rank) noexcept
    {
        const Turn<T> turn{at, rank, turns_[size_].opened};
        std::uint32_t k = size_++;
        for (; k > 0 && turn < turns_[(k - 1) / 2]; k = (k - 1) / 2)
            turns_[k] = turns_[(k - 1) / 2];
        turns_[k] = turn;
    }
    /// Ends the first turn; its group has another one.
    void put_off(T at, std::uint32_t rank) noexcept { sink({at, rank, turns_[0].opened}); }
    /// Ends the first turn, which was its group's last.
    void remove() noexcept
    {
        const std::uint32_t unused = turns_[0].opened;
        const Turn<T> last = turns_[--size_];
        if (size_ != 0) sink(last);
        turns_[size_].opened = unused;
    }

  private:
    void sink(const Turn<T>& turn) noexcept
    {
        std::uint32_t k = 0;
        for (;;) {
            std::uint32_t below = 2 * k + 1;
            if (below >= size_) break;
            if (below + 1 < size_ && turns_[below + 1] < turns_[below]) ++below;
            if (!(turns_[below] < turn)) break;
            turns_[k] = turns_[below];
            k = below;
        }
        turns_[k] = turn;
    }
    void grow()
    {
        if (memory_ == nullptr) memory_ = shelf_.take();
        const std::size_t wanted = 2 * std::size_t{capacity_};
        if (opened_ == own_opened_) {
            std::copy_n(opened_, used_, memory_->opened.reserve(wanted));
            std::copy_n(turns_, used_, memory_->turns.reserve(wanted));
        } else {
            memory_->opened.grow(wanted, used_);
            memory_->turns.grow(wanted, used_);
        }
        opened_ = memory_->opened.data();
        turns_ = memory_->turns.data();
        capacity_ =
            static_cast<std::uint32_t>(std::min(memory_->opened.capacity(), memory_->turns.capacity()));
    }

    static constexpr std::uint32_t own_room = 32;
    QueueShelf<Dim, T>& shelf_;
    std::unique_ptr<QueueMemory<Dim, T>> memory_;
    union
    {
        Opened<Dim, T> own_opened_[own_room]; // not worth initialising
    };
    union
    {
        Turn<T> own_turns_[own_room];
    };
    Opened<Dim, T>* opened_ = own_opened_;
    Turn<T>* turns_ = own_turns_; // a heap; after it, the numbers of unused elements
    std::uint32_t size_ = 0, used_ = 0, capacity_ = own_room;
};

} // namespace index
JOSTLE_NAMESPACE_END
