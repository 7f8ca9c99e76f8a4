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
#include "world/objects/numbers.hpp"

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
    report,      // reports the object's pairs as new
    report_pair, // reports the pair with `other` as new
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
        ObjectId other;
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
    Command(ObjectId object, ObjectId partner) noexcept
        : id(object), sequence(0), kind(CommandKind::report_pair), other(partner)
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

/// The primitives for threads. The tests substitute others, with which they try every schedule:
/// schedules_test.cpp.
struct SystemThreads
{
    using Id = std::thread::id;
    using Mutex = std::mutex;
    template <class Value>
    using Atomic = std::atomic<Value>;
    static Id self() noexcept { return std::this_thread::get_id(); }
};

/// The commands queued by one thread. Only that thread locks its mutex, except when an update briefly locks
/// all queues.
template <int Dim, class T, class Threads = SystemThreads>
struct alignas(128) Queue
{
    Queue(std::uint32_t which, std::pmr::memory_resource* memory)
        : number(which), additions(memory), commands(memory), taken_additions(memory), taken_commands(memory)
    {
    }

    const std::uint32_t number; // from 1 up

    // Assigned only while Queues::mutex_ is held, and cleared only while `mutex` is held as well. Relaxed is
    // enough: a thread can't miss its own name, which it wrote itself, and a thread that still reads its name
    // after it was cleared learns so from `mutex`, which it locks before it reads again.
    typename Threads::template Atomic<typename Threads::Id> owner{};
    typename Threads::Mutex mutex; // guards the next two members
    std::pmr::vector<Addition<Dim, T>> additions;
    std::pmr::vector<Command<Dim, T>> commands;

    // Used only by the update:
    std::pmr::vector<Addition<Dim, T>> taken_additions;
    std::pmr::vector<Command<Dim, T>> taken_commands;
    std::size_t applied_additions = 0, applied_commands = 0; // how many of these, from the first on
    Queue* next = nullptr;
};

/// One queue for each thread that queues commands.
template <int Dim, class T, class Threads = SystemThreads>
class Queues
{
    using Queue = world::Queue<Dim, T, Threads>;
    using Id = typename Threads::Id;

  public:
    explicit Queues(std::pmr::memory_resource* memory) : memory_(memory) {}
    Queues(const Queues&) = delete;
    Queues& operator=(const Queues&) = delete;
    ~Queues()
    {
        for (Queue* queue = first(); queue != nullptr;) {
            Queue* const next = queue->next;
            queue->~Queue();
            memory_->deallocate(queue, sizeof *queue, alignof(Queue));
            queue = next;
        }
    }

    /// Calls body(queue) with the calling thread's queue locked.
    template <class Body>
    decltype(auto) with_own_queue(const Body& body)
    {
        const Id me = Threads::self();
        for (;;) {
            Queue& queue = queue_of(me);
            const std::lock_guard lock(queue.mutex);
            // An update may have taken the queue away because it was unused for long.
            if (queue.owner.load(std::memory_order_relaxed) == me) return body(queue);
        }
    }

    /// Takes everything queued so far, in all queues at the same moment: if one command was queued before
    /// another, on any threads, the second isn't taken without the first. What was taken before and not
    /// forgotten stays in front. On failure nothing is taken.
    void take()
    {
        const std::lock_guard registration(mutex_);
        struct LockAll
        {
            Queue* first;
            explicit LockAll(Queue* f) : first(f)
            {
                for (Queue* queue = first; queue != nullptr; queue = queue->next)
                    queue->mutex.lock();
            }
            ~LockAll()
            {
                for (Queue* queue = first; queue != nullptr; queue = queue->next)
                    queue->mutex.unlock();
            }
        } const lock(first());
        for (Queue* queue = first(); queue != nullptr; queue = queue->next) {
            make_room(queue->taken_additions, queue->additions);
            make_room(queue->taken_commands, queue->commands);
        }
        for (Queue* queue = first(); queue != nullptr; queue = queue->next) {
            const bool idle = queue->additions.empty() && queue->commands.empty() &&
                              queue->taken_additions.empty() && queue->taken_commands.empty();
            if (idle) queue->owner.store({}, std::memory_order_relaxed); // for the next thread without one
            move_over(queue->taken_additions, queue->additions);
            move_over(queue->taken_commands, queue->commands);
        }
    }

    /// Discards what was taken, which is done.
    void forget() noexcept
    {
        for (Queue* queue = first(); queue != nullptr; queue = queue->next) {
            queue->taken_additions.clear();
            queue->taken_commands.clear();
        }
        forget_applied();
    }
    /// Discards everything queued, taken or not.
    void discard() noexcept
    {
        const std::lock_guard registration(mutex_);
        for (Queue* queue = first(); queue != nullptr; queue = queue->next) {
            const std::lock_guard lock(queue->mutex);
            queue->additions.clear();
            queue->commands.clear();
        }
        forget();
    }
    /// Marks what was applied as undone, to be applied again.
    void forget_applied() noexcept
    {
        for (Queue* queue = first(); queue != nullptr; queue = queue->next)
            queue->applied_additions = queue->applied_commands = 0;
    }
    /// Whether anything taken is still to be applied.
    [[nodiscard]] bool any_to_apply() const noexcept
    {
        for (const Queue* queue = first(); queue != nullptr; queue = queue->next)
            if (queue->applied_additions != queue->taken_additions.size() ||
                queue->applied_commands != queue->taken_commands.size())
                return true;
        return false;
    }

    [[nodiscard]] Queue* first() noexcept { return first_.load(std::memory_order_acquire); }
    [[nodiscard]] const Queue* first() const noexcept { return first_.load(std::memory_order_acquire); }

  private:
    Queue& queue_of(Id me)
    {
        for (Queue* queue = first(); queue != nullptr; queue = queue->next)
            if (queue->owner.load(std::memory_order_relaxed) == me) return *queue;
        // New queues wait while an update takes commands: it must not miss what was queued before.
        const std::lock_guard registration(mutex_);
        for (Queue* queue = first(); queue != nullptr; queue = queue->next)
            if (queue->owner.load(std::memory_order_relaxed) == Id()) {
                queue->owner.store(me, std::memory_order_relaxed);
                return *queue;
            }
        void* const memory = memory_->allocate(sizeof(Queue), alignof(Queue));
        auto* const queue = new (memory) Queue(first() == nullptr ? 1 : first()->number + 1, memory_);
        queue->owner.store(me, std::memory_order_relaxed);
        queue->next = first();
        first_.store(queue, std::memory_order_release);
        return *queue;
    }

    template <class Vector>
    static void make_room(Vector& taken, const Vector& queued)
    {
        if (!taken.empty()) reserve_more(taken, queued.size());
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
    typename Threads::Mutex mutex_; // held while queues are assigned, and while everything is taken
    // Queues are inserted at the front and never removed. Release and acquire: a thread that finds a queue
    // finds it complete, `next` included. A thread that reads an older front misses only queues that others
    // made since; `take` and the making of queues hold mutex_.
    typename Threads::template Atomic<Queue*> first_{nullptr};
};

} // namespace world
JOSTLE_NAMESPACE_END
