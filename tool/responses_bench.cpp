// SPDX-License-Identifier: MIT
// jostle bench responses: how evenly work on pairs is shared out, and what it costs to add up what it does.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench_run.hpp"
#include "commands.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/responses.hpp"
#include "numbers.hpp"
#include "pinned_threads.hpp"
#include "threads.hpp"
#include "tool/scenes/scenes.hpp"
#include "turns.hpp"

namespace jostle_tool {

namespace {

using jostle::Pair;
using jostle::Work;

struct Impulse
{
    float v[6] = {};
    Impulse& operator+=(const Impulse& other)
    {
        for (int k = 0; k < 6; ++k)
            v[k] += other.v[k];
        return *this;
    }
};

Impulse impulse_of(const Pair& pair)
{
    Impulse impulse;
    for (std::uint32_t k = 0; k < 6; ++k)
        impulse.v[k] = static_cast<float>((pair.a * 7 + pair.b * (k + 1)) % 1024) - 512; // exact in any order
    return impulse;
}

struct Row
{
    std::string part, system;
    std::uint32_t threads;
    double ms;
    std::uint64_t bytes; ///< of memory; 0 where it isn't the point
    double efficiency;   ///< of two threads or more against one; 0 for one
};

/// Work that takes about as long as `units` times 20 ns.
std::uint64_t toil(std::uint64_t seed, std::uint32_t units)
{
    std::uint64_t x = seed | 1;
    for (std::uint32_t i = 0; i < units * 16; ++i)
        x = (x ^ (x >> 29)) * 0xbf58476d1ce4e5b9u;
    return x;
}

/// One frame, from nothing to the sum per object: ours, a mutex per object, and atomics.
std::vector<Row> measure_responses(const BenchOptions& options, jostle::Executor& executor,
                                   std::uint32_t threads)
{
    const auto objects = static_cast<std::uint32_t>(options.count);
    const jostle_scenes::Scene<3, float> scene("uniform", objects);
    const jostle::PairBuffer pairs = jostle::find_pairs(scene.boxes());
    const jostle::ProcessOptions process{.executor = &executor};
    jostle::Responses<Impulse> responses(jostle::ResponsesOptions{.executor = &executor});
    std::span<const Impulse> sums;

    struct Locked
    {
        std::mutex mutex;
        Impulse sum;
    };
    struct Atomic
    {
        std::atomic<float> v[6];
    };
    std::vector<Locked> locked(objects);
    std::vector<Atomic> atomics(objects);
    const auto each_object = [&](auto&& work_on) {
        jostle::process_items(
            objects,
            [&](std::uint64_t begin, std::uint64_t end, Work) {
                for (std::uint64_t i = begin; i < end; ++i)
                    work_on(i);
            },
            process);
    };
    const auto ours = [&] {
        responses.start(objects, jostle::plan_work(pairs.size(), process));
        jostle::process_pairs(
            pairs,
            [&](const Pair& pair, Work work) {
                const Impulse impulse = impulse_of(pair);
                responses.add(work, pair.a, impulse);
                responses.add(work, pair.b, impulse);
            },
            process);
        sums = responses.merge();
    };
    const auto with_mutexes = [&] {
        each_object([&](std::size_t i) { locked[i].sum = {}; });
        jostle::process_pairs(
            pairs,
            [&](const Pair& pair, Work) {
                const Impulse impulse = impulse_of(pair);
                for (const std::uint32_t i : {pair.a, pair.b}) {
                    const std::lock_guard lock(locked[i].mutex);
                    locked[i].sum += impulse;
                }
            },
            process);
    };
    const auto with_atomics = [&] {
        each_object([&](std::size_t i) {
            for (std::atomic<float>& v : atomics[i].v)
                v.store(0, std::memory_order_relaxed);
        });
        jostle::process_pairs(
            pairs,
            [&](const Pair& pair, Work) {
                const Impulse impulse = impulse_of(pair);
                for (const std::uint32_t i : {pair.a, pair.b})
                    for (std::size_t k = 0; k < 6; ++k) {
                        std::atomic<float>& v = atomics[i].v[k];
                        float old = v.load(std::memory_order_relaxed);
                        while (!v.compare_exchange_weak(old, old + impulse.v[k], std::memory_order_relaxed))
                            ;
                    }
            },
            process);
    };
    const std::vector<double> ms = medians(options.frames, {ours, with_mutexes, with_atomics});
    for (std::uint32_t i = 0; i < objects; ++i)
        for (std::size_t k = 0; k < 6; ++k)
            if (sums[i].v[k] != locked[i].sum.v[k] || sums[i].v[k] != atomics[i].v[k])
                throw std::runtime_error("object " + std::to_string(i) + ": the three sums differ");
    return {{"responses", "jostle", threads, ms[0], responses.bytes_reserved(), 0},
            {"responses", "mutex per object", threads, ms[1], locked.size() * sizeof(Locked), 0},
            {"responses", "atomics", threads, ms[2], atomics.size() * sizeof(Atomic), 0}};
}

/// Undisturbed runs' median, each thread on a core of its own; runs in which the system took a core away
/// count only if there are no others.
double pinned_ms(PinnedThreads& threads, std::uint32_t frames,
                 const std::function<void(jostle::Executor&)>& work)
{
    std::vector<double> undisturbed, disturbed;
    for (std::uint32_t run = 0; run < 4 * frames && undisturbed.size() < frames; ++run) {
        threads.reset();
        if (threads.concurrency() == 1) // else it would run here, and not be timed
            threads.run(1, [&](std::uint32_t) { work(jostle::serial_executor()); });
        else
            work(threads);
        (threads.preemptions() == 0 ? undisturbed : disturbed).push_back(threads.ms());
    }
    return median(undisturbed.empty() ? disturbed : undisturbed);
}

/// The same work on one thread and on all.
std::vector<Row> measure_balance(const BenchOptions& options, std::uint32_t threads)
{
    PinnedThreads one(1), all(threads);
    std::vector<Pair> pairs(20'000);
    for (std::uint32_t i = 0; i < pairs.size(); ++i)
        pairs[i] = {i, i + 1};
    std::atomic<std::uint64_t> sink{0};
    const auto on_pairs = [&](auto cost) {
        return [&, cost](jostle::Executor& executor) {
            const jostle::ProcessOptions process{.executor = &executor};
            jostle::process_pairs(
                pairs,
                [&](const jostle::PairBatch& batch) {
                    std::uint64_t sum = 0;
                    for (const Pair& pair : batch.items)
                        sum += toil(pair.a, cost(pair.a));
                    sink.fetch_add(sum, std::memory_order_relaxed);
                },
                process);
        };
    };
    const auto on_all_pairs = [&](jostle::Executor& executor) {
        constexpr std::uint32_t objects = 1'000;
        jostle::process_items(objects,
                              [&](std::uint64_t a, std::uint64_t, jostle::Work) {
                                  std::uint64_t sum = 0;
                                  for (auto b = static_cast<std::uint32_t>(a) + 1; b < objects; ++b)
                                      sum += toil(b, 1);
                                  sink.fetch_add(sum, std::memory_order_relaxed);
                              },
                              {.executor = &executor, .block_items = 1});
    };
    const auto even = [](std::uint32_t) { return 20u; };
    // One pair in 64 costs a thousand times as much as the others; by chance, and all of them at the end.
    const auto mixed = [](std::uint32_t i) { return (i * 2654435761u) >> 26 == 0 ? 1000u : 1u; };
    const auto lumped = [](std::uint32_t i) { return i >= 20'000 - 312 ? 1000u : 1u; };
    const std::vector<std::pair<std::string, std::function<void(jostle::Executor&)>>> works = {
        {"pairs of one cost", on_pairs(even)},
        {"pairs of 1 : 1000", on_pairs(mixed)},
        {"1 : 1000, the dear ones last", on_pairs(lumped)},
        {"all pairs", on_all_pairs}};
    std::vector<Row> rows;
    for (const auto& [name, work] : works) {
        const double alone = pinned_ms(one, options.frames, work);
        const double together = threads == 1 ? alone : pinned_ms(all, options.frames, work);
        rows.push_back({"balance", name, 1, alone, 0, 0});
        rows.push_back({"balance", name, threads, together, 0, alone / together / threads});
    }
    return rows;
}

/// 0 is what doesn't apply to a row: null.
template <class Number>
JsonRow::Value if_known(Number number)
{
    return number == 0 ? JsonRow::Value(nullptr) : JsonRow::Value(number);
}

void run(const BenchOptions& options)
{
    BenchTable table(options);
    const Threads threads(options.threads.front());
    std::vector<Row> rows = measure_responses(options, threads.executor(), threads.count());
    const double ours = rows.front().ms;
    if (table.shown()) {
        std::printf("A frame of impulses (24 bytes) on both objects of each pair, %u objects, %u threads:\n",
                    static_cast<std::uint32_t>(options.count), threads.count());
        for (const Row& row : rows)
            std::printf("  %-30s %9.3f ms %10.1f MB %9.2f x jostle\n", row.system.c_str(), row.ms,
                        static_cast<double>(row.bytes) / 1e6, row.ms / ours);
        std::printf("Work shared out, one thread against %u; efficiency 1 is %u times as fast:\n",
                    threads.count(), threads.count());
        std::fflush(stdout);
    }
    for (const Row& row : measure_balance(options, threads.count()))
        rows.push_back(row);
    if (table.shown())
        for (std::size_t i = 3; i < rows.size(); i += 2)
            std::printf("  %-30s %9.3f ms %9.3f ms %9.2f efficiency\n", rows[i].system.c_str(), rows[i].ms,
                        rows[i + 1].ms, rows[i + 1].efficiency);
    for (const Row& row : rows)
        table.add({{"part", row.part},
                   {"system", row.system},
                   {"threads", row.threads},
                   {"median_ms", rounded(row.ms)},
                   {"bytes", if_known(row.bytes)},
                   {"efficiency", if_known(rounded(row.efficiency))}});
    table.finish();
}

constexpr const char* help =
    R"(Each frame computes a sum per object in three ways: Responses, a mutex per object, and a compare-and-swap
loop on each number. If the sums differ, the exit status is 1.

Examples:
  jostle bench responses
  jostle bench responses -n 1000000 --threads 2 --json -)";

} // namespace

void add_bench_responses_command(const Command& bench)
{
    const auto [command, options] =
        add_bench_part(bench, "responses", "Times work on pairs, with results added up per object", help, run,
                       {.count = 100'000, .frames = 15});
    command.number("-n", options.count, 1, 10'000'000, "N", "How many objects (100000)");
    command.number("--frames", options.frames, 1, 10'000, "F", "How many frames are counted (15)");
    command.threads(options.threads.front());
    add_rows_file_option(command, options.json);
}

} // namespace jostle_tool
