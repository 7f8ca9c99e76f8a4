// SPDX-License-Identifier: MIT
// A program's own job system runs Jostle's tasks; Jostle then starts no threads.
#include <jostle/jostle.hpp>

#include <atomic>
#include <cstdio>
#include <thread>
#include <vector>

// Instead of a real job system, which would keep its threads: here each call starts and joins them.
class HostExecutor final : public jostle::Executor
{
  public:
    std::uint32_t concurrency() const noexcept override { return 3; }

    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        tasks_run += count;
        std::vector<std::thread> threads;
        for (std::uint32_t i = 1; i < count; ++i)
            threads.emplace_back([=] { task(i); });
        if (count > 0) task(0); // the calling thread works, too
        for (std::thread& thread : threads)
            thread.join();
    }

    std::atomic<std::uint64_t> tasks_run{0};
};

int main()
{
    std::vector<jostle::Aabb2f> boxes; // a chessboard whose squares touch at edges and corners
    for (int i = 0; i < 100 * 100; ++i) {
        const float x = float(i % 100), y = float(i / 100);
        boxes.push_back({{x, y}, {x + 1, y + 1}});
    }
    HostExecutor host;
    jostle::FinderOptions options;
    options.executor = &host;
    const auto pairs = jostle::find_pairs(boxes, {}, jostle::Order::canonical, options);
    std::printf("%llu pairs from %llu tasks\n", static_cast<unsigned long long>(pairs.size()),
                static_cast<unsigned long long>(host.tasks_run));

    options.executor = &jostle::serial_executor(); // the same pairs in the same order
    const auto serial = jostle::find_pairs(boxes, {}, jostle::Order::canonical, options);
    const std::uint64_t expected = 2 * 99 * 100 + 2 * 99 * 99;
    return pairs.size() == expected && host.tasks_run > 0 && pairs.to_vector() == serial.to_vector() ? 0 : 1;
}
