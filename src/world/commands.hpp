// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "jostle/world.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

enum class CommandKind : std::uint8_t
{
    remove,
    move,
    sweep,  // follows its move: the displacement, in box.lo
    resize, // the size, in box.lo
    filter,
    margin, // in box.lo[0]
    enable,
    disable,
};

template <int Dim, class T>
struct Command
{
    ObjectId id;
    std::uint32_t sequence;
    CommandKind kind;
    union
    {
        Aabb<Dim, T> box;
        ObjectFilter filter;
    };

    Command(ObjectId object, std::uint32_t order, CommandKind what) noexcept
        : id(object), sequence(order), kind(what), box{}
    {
    }
    Command(ObjectId object, std::uint32_t order, CommandKind what, const Aabb<Dim, T>& value) noexcept
        : id(object), sequence(order), kind(what), box(value)
    {
    }
    Command(ObjectId object, std::uint32_t order, const ObjectFilter& value) noexcept
        : id(object), sequence(order), kind(CommandKind::filter), filter(value)
    {
    }
};

template <int Dim, class T>
struct Addition
{
    ObjectId id;
    Aabb<Dim, T> box;
    ObjectOptions<T> options;
};

/// Room for `count` more, growing by half at least.
template <class Vector>
void reserve_more(Vector& vector, std::size_t count)
{
    const std::size_t wanted = vector.size() + count;
    if (wanted > vector.capacity())
        vector.reserve(std::max(wanted, vector.capacity() + vector.capacity() / 2));
}

/// What one thread queued. Its mutex is the thread's own but for the moment in which an update takes all.
template <int Dim, class T>
struct alignas(128) Lane
{
    explicit Lane(std::pmr::memory_resource* memory)
        : additions(memory), commands(memory), taken_additions(memory), taken_commands(memory)
    {
    }

    std::atomic<std::thread::id> owner{};
    std::mutex mutex; // guards the two that follow
    std::pmr::vector<Addition<Dim, T>> additions;
    std::pmr::vector<Command<Dim, T>> commands;

    // The update's own:
    std::pmr::vector<Addition<Dim, T>> taken_additions;
    std::pmr::vector<Command<Dim, T>> taken_commands;
    Lane* next = nullptr;
};

/// One lane for each thread that queues.
template <int Dim, class T>
class Queues
{
  public:
    explicit Queues(std::pmr::memory_resource* memory) : memory_(memory) {}
    Queues(const Queues&) = delete;
    Queues& operator=(const Queues&) = delete;
    ~Queues()
    {
        for (Lane<Dim, T>* lane = first(); lane != nullptr;) {
            Lane<Dim, T>* const next = lane->next;
            lane->~Lane();
            memory_->deallocate(lane, sizeof *lane, alignof(Lane<Dim, T>));
            lane = next;
        }
    }

    /// Calls body(lane) with the calling thread's lane locked.
    template <class Body>
    decltype(auto) with_own_lane(const Body& body)
    {
        const std::thread::id me = std::this_thread::get_id();
        for (;;) {
            Lane<Dim, T>& lane = lane_of(me);
            const std::lock_guard lock(lane.mutex);
            // An update may have taken the lane away because it hadn't been used for long.
            if (lane.owner.load(std::memory_order_relaxed) == me) return body(lane);
        }
    }

    /// Takes everything queued so far, in all lanes at the same moment: if one command was queued before
    /// another, whichever their threads, then the other isn't taken without it. What was taken and not
    /// forgotten stays in front. On failure nothing is taken.
    void take()
    {
        const std::lock_guard registration(mutex_);
        struct LockAll
        {
            Lane<Dim, T>* first;
            explicit LockAll(Lane<Dim, T>* f) : first(f)
            {
                for (Lane<Dim, T>* lane = first; lane != nullptr; lane = lane->next)
                    lane->mutex.lock();
            }
            ~LockAll()
            {
                for (Lane<Dim, T>* lane = first; lane != nullptr; lane = lane->next)
                    lane->mutex.unlock();
            }
        } const lock(first());
        for (Lane<Dim, T>* lane = first(); lane != nullptr; lane = lane->next) {
            make_room(lane->taken_additions, lane->additions);
            make_room(lane->taken_commands, lane->commands);
        }
        for (Lane<Dim, T>* lane = first(); lane != nullptr; lane = lane->next) {
            const bool idle = lane->additions.empty() && lane->commands.empty() &&
                              lane->taken_additions.empty() && lane->taken_commands.empty();
            if (idle) lane->owner.store({}, std::memory_order_relaxed); // for whoever comes first
            move_over(lane->taken_additions, lane->additions);
            move_over(lane->taken_commands, lane->commands);
        }
    }

    /// What was taken is done with.
    void forget() noexcept
    {
        for (Lane<Dim, T>* lane = first(); lane != nullptr; lane = lane->next) {
            lane->taken_additions.clear();
            lane->taken_commands.clear();
        }
    }

    [[nodiscard]] Lane<Dim, T>* first() const noexcept { return first_.load(std::memory_order_acquire); }

    [[nodiscard]] std::uint64_t bytes() const
    {
        const std::lock_guard registration(mutex_);
        std::uint64_t sum = 0;
        for (Lane<Dim, T>* lane = first(); lane != nullptr; lane = lane->next) {
            const std::lock_guard lock(lane->mutex);
            sum +=
                sizeof *lane +
                (lane->additions.capacity() + lane->taken_additions.capacity()) * sizeof(Addition<Dim, T>) +
                (lane->commands.capacity() + lane->taken_commands.capacity()) * sizeof(Command<Dim, T>);
        }
        return sum;
    }

  private:
    Lane<Dim, T>& lane_of(std::thread::id me)
    {
        for (Lane<Dim, T>* lane = first(); lane != nullptr; lane = lane->next)
            if (lane->owner.load(std::memory_order_relaxed) == me) return *lane;
        // New lanes wait for an update that is taking: it must not miss what was queued before it looked.
        const std::lock_guard registration(mutex_);
        for (Lane<Dim, T>* lane = first(); lane != nullptr; lane = lane->next)
            if (lane->owner.load(std::memory_order_relaxed) == std::thread::id()) {
                lane->owner.store(me, std::memory_order_relaxed);
                return *lane;
            }
        void* const memory = memory_->allocate(sizeof(Lane<Dim, T>), alignof(Lane<Dim, T>));
        auto* const lane = new (memory) Lane<Dim, T>(memory_);
        lane->owner.store(me, std::memory_order_relaxed);
        lane->next = first();
        first_.store(lane, std::memory_order_release);
        return *lane;
    }

    template <class Vector>
    static void make_room(Vector& taken, const Vector& queued)
    {
        if (!taken.empty()) taken.reserve(taken.size() + queued.size());
    }
    template <class Vector>
    static void move_over(Vector& taken, Vector& queued) noexcept
    {
        if (taken.empty()) {
            taken.swap(queued); // both keep their memory
        } else {
            taken.insert(taken.end(), queued.begin(), queued.end());
            queued.clear();
        }
    }

    std::pmr::memory_resource* memory_;
    mutable std::mutex mutex_; // held while lanes are given out, and while everything is taken
    std::atomic<Lane<Dim, T>*> first_{nullptr};
};

} // namespace world
JOSTLE_NAMESPACE_END
