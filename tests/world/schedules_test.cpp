// SPDX-License-Identifier: MIT
// How commands come from the threads that give them to the update that takes them, in every schedule.
#include <gtest/gtest.h>

#include <array>
#include <memory_resource>
#include <string>
#include <vector>

#include "schedules.hpp"
#include "world/update/commands.hpp"

namespace world_tests {
namespace {

using jostle::ObjectId;
using jostle::world::Command;
using jostle::world::CommandKind;
using schedules::Explorer;
using schedules::Threads;
using Queues = jostle::world::Queues<3, float, Threads>;
using Queue = jostle::world::Queue<3, float, Threads>;

// The explorer itself: it finds what is wrong, and counts what can be counted by hand.

/// One thread shows another what it wrote.
template <std::memory_order Store, std::memory_order Load>
struct Message
{
    static constexpr std::uint32_t threads = 2;
    schedules::Atomic<int> data{0}, ready{0};
    int read = 1;

    void run(std::uint32_t thread)
    {
        if (thread == 0) {
            data.store(1, std::memory_order_relaxed);
            ready.store(1, Store);
        } else if (ready.load(Load) == 1) {
            read = data.load(std::memory_order_relaxed);
        }
    }
    [[nodiscard]] std::string wrong() const { return read == 1 ? "" : "the message came before its text"; }
};

TEST(Schedules, AMessageNeedsReleaseAndAcquire)
{
    using enum std::memory_order;
    EXPECT_EQ((Explorer().explore<Message<release, acquire>>()), "");
    EXPECT_NE((Explorer().explore<Message<relaxed, acquire>>()), "");
    EXPECT_NE((Explorer().explore<Message<release, relaxed>>()), "");
}

/// Two threads add one each, and read before they lock if `Early`.
template <bool Early>
struct Sum
{
    static constexpr std::uint32_t threads = 2;
    schedules::Mutex mutex;
    schedules::Atomic<int> sum{0};

    void run(std::uint32_t)
    {
        const int early = Early ? sum.load() : 0;
        const std::lock_guard lock(mutex);
        sum.store((Early ? early : sum.load()) + 1);
    }
    [[nodiscard]] std::string wrong() const { return sum.load() == 2 ? "" : "one was lost"; }
};

TEST(Schedules, AMutexKeepsOthersOut)
{
    EXPECT_EQ(Explorer().explore<Sum<false>>(), "");
    EXPECT_EQ(Explorer().explore<Sum<true>>(), "one was lost");
}

struct Crosswise
{
    static constexpr std::uint32_t threads = 2;
    std::array<schedules::Mutex, 2> mutexes;

    void run(std::uint32_t thread)
    {
        const std::lock_guard first(mutexes[thread]);
        const std::lock_guard second(mutexes[1 - thread]);
    }
    [[nodiscard]] std::string wrong() const { return ""; }
};

TEST(Schedules, ThreadsThatWaitForEachOtherAreFound)
{
    EXPECT_EQ(Explorer().explore<Crosswise>(), "threads wait for each other");
}

/// Two threads store twice each, to places of their own: 3 x 3 states, however they take turns.
struct Apart
{
    static constexpr std::uint32_t threads = 2;
    std::array<schedules::Atomic<int>, 2> places;

    void run(std::uint32_t thread)
    {
        places[thread].store(1);
        places[thread].store(2);
    }
    [[nodiscard]] std::string wrong() const { return ""; }
};

TEST(Schedules, StepsThatDontSeeEachOtherAreTriedInOneOrder)
{
    Explorer explorer;
    EXPECT_EQ(explorer.explore<Apart>(), "");
    EXPECT_EQ(explorer.states(), 8u); // the last one has no next step
}

// Queues.

struct Taken
{
    std::uint32_t thread, number, take;
};

/// Two threads give so many commands, and an update takes so many times; what is left is taken at the end.
/// With a handshake the second thread looks whether the first one has given a command, before it gives its
/// own.
template <std::uint32_t First, std::uint32_t Second, std::uint32_t Takes, bool Handshake = false>
struct HandOver
{
    static constexpr std::uint32_t threads = 3;
    Queues queues{std::pmr::new_delete_resource()};
    schedules::Atomic<int> first_is_given{0};
    bool second_knew = false, foreign = false;
    std::vector<Taken> taken;
    std::uint32_t takes = 0;

    void run(std::uint32_t thread)
    {
        if (thread == 2) {
            for (std::uint32_t k = 0; k < Takes; ++k)
                take();
            return;
        }
        if (Handshake && thread == 1) second_knew = first_is_given.load(std::memory_order_acquire) != 0;
        for (std::uint32_t k = 0; k < (thread == 0 ? First : Second); ++k) {
            queues.with_own_queue([&](Queue& queue) {
                foreign |= queue.owner.load() != Threads::self();
                queue.commands.push_back({ObjectId{thread, k}, 0, CommandKind::remove});
            });
            if (Handshake && thread == 0) first_is_given.store(1, std::memory_order_release);
        }
    }
    void take()
    {
        queues.take();
        for (Queue* queue = queues.first(); queue != nullptr; queue = queue->next)
            for (const Command<3, float>& command : queue->taken_commands)
                taken.push_back({command.id.index, command.id.generation, takes});
        queues.forget();
        ++takes;
    }
    [[nodiscard]] std::string wrong()
    {
        if (foreign) return "a thread was given a queue that isn't its own";
        take();
        std::uint32_t queue_count = 0;
        for (const Queue* queue = queues.first(); queue != nullptr; queue = queue->next)
            ++queue_count;
        if (queue_count > 2) return "there are more queues than threads with commands";
        std::array<std::uint32_t, 2> next{}, first_take{};
        for (const Taken& each : taken) {
            if (each.number != next[each.thread]++) return "commands were lost, taken twice or out of order";
            if (each.number == 0) first_take[each.thread] = each.take;
        }
        if (next != std::array{First, Second}) return "a command was lost";
        if (second_knew && first_take[0] > first_take[1])
            return "a command was taken without the one before it";
        return "";
    }
};

template <class Scenario>
void expect_good(std::uint64_t least_states)
{
    Explorer explorer;
    EXPECT_EQ(explorer.explore<Scenario>(), "");
    EXPECT_GT(explorer.states(), least_states); // fewer: something isn't tried any more
}

TEST(Schedules, NoCommandIsLostWhenItsQueueIsTakenAway)
{
    expect_good<HandOver<2, 0, 3>>(5000);
}
TEST(Schedules, NoCommandIsLostOrTakenTwice)
{
    expect_good<HandOver<2, 1, 1>>(40'000);
}
TEST(Schedules, NoCommandIsTakenWithoutWhatWasGivenBefore)
{
    expect_good<HandOver<1, 1, 1, true>>(20'000);
}

} // namespace
} // namespace world_tests
