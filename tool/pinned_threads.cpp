// SPDX-License-Identifier: MIT
#include "pinned_threads.hpp"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <thread>

#include "clock.hpp"

#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#endif

namespace jostle_tool {

namespace {

struct Cores
{
    std::vector<int> processors; // one of each core first, then their second threads, ...
    std::uint32_t count = 0;
};

#ifdef __linux__

// The processors that share a core, as the system lists them: the list names the core.
std::string siblings(int processor)
{
    std::ifstream file("/sys/devices/system/cpu/cpu" + std::to_string(processor) +
                       "/topology/thread_siblings_list");
    std::string list;
    if (!std::getline(file, list)) list = std::to_string(processor);
    return list;
}

Cores find_cores()
{
    // A set of this size holds every processor that Linux can be built for (8192).
    constexpr int most = 8192;
    std::vector<cpu_set_t> allowed(most / CPU_SETSIZE);
    const std::size_t bytes = allowed.size() * sizeof(cpu_set_t);
    Cores cores;
    if (sched_getaffinity(0, bytes, allowed.data()) != 0) return cores;
    std::map<std::string, int> seen; // core -> threads of it so far
    std::vector<std::pair<int, int>> by_turn;
    for (int processor = 0; processor < most; ++processor)
        if (CPU_ISSET_S(static_cast<std::size_t>(processor), bytes, allowed.data()))
            by_turn.push_back({seen[siblings(processor)]++, processor});
    std::sort(by_turn.begin(), by_turn.end());
    for (const auto& [turn, processor] : by_turn)
        cores.processors.push_back(processor);
    cores.count = static_cast<std::uint32_t>(seen.size());
    return cores;
}

void pin_this_thread(int processor)
{
    constexpr int most = 8192;
    std::vector<cpu_set_t> set(most / CPU_SETSIZE);
    const std::size_t bytes = set.size() * sizeof(cpu_set_t);
    CPU_ZERO_S(bytes, set.data());
    CPU_SET_S(static_cast<std::size_t>(processor), bytes, set.data());
    // Where a sandbox forbids it the system places the thread: mostly on another core just the same.
    pthread_setaffinity_np(pthread_self(), bytes, set.data());
}

std::uint64_t preemptions_of_this_thread()
{
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return static_cast<std::uint64_t>(usage.ru_nivcsw);
}

#else

Cores find_cores()
{
    return {};
}
void pin_this_thread(int) {}
std::uint64_t preemptions_of_this_thread()
{
    return 0;
}

#endif

} // namespace

std::uint32_t PinnedThreads::core_count()
{
    const std::uint32_t count = find_cores().count;
    return count != 0 ? count : std::max(1u, std::thread::hardware_concurrency());
}

PinnedThreads::PinnedThreads(std::uint32_t threads)
    : threads_(std::max(1u, threads)), processors_(find_cores().processors)
{
}

void PinnedThreads::run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task)
{
    if (count == 0) return;
    enum State
    {
        waiting,
        running,
        cancelled
    };
    std::atomic<State> state = waiting;
    std::atomic<std::uint32_t> ready = 0;
    struct alignas(64) Times // a line each: what is being measured must not be done here
    {
        Clock::time_point start, end;
        std::uint64_t preemptions;
    };
    std::vector<Times> times(count);

    std::vector<std::jthread> threads;
    try {
        threads.reserve(count);
        for (std::uint32_t i = 0; i < count; ++i)
            threads.emplace_back([&, i] {
                if (!processors_.empty()) pin_this_thread(processors_[i % processors_.size()]);
                ++ready;
                while (state == waiting) // not asleep: waking up takes longer than a small run
                    std::this_thread::yield();
                if (state == cancelled) return;
                const std::uint64_t before = preemptions_of_this_thread();
                times[i].start = Clock::now();
                task(i);
                times[i].end = Clock::now();
                times[i].preemptions = preemptions_of_this_thread() - before;
            });
    } catch (...) {
        state = cancelled; // the system has no more threads: let those go that started
        throw;
    }
    while (ready != count)
        std::this_thread::yield();
    state = running;
    threads.clear(); // joins

    auto start = times[0].start, end = times[0].end;
    for (const Times& t : times) {
        start = std::min(start, t.start);
        end = std::max(end, t.end);
        preemptions_ += t.preemptions;
    }
    ms_ += ms_between(start, end);
}

} // namespace jostle_tool
