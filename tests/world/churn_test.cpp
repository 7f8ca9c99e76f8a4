// SPDX-License-Identifier: MIT
// Everything at once for a long time: adds, moves, removals, filters, questions and updates, said
// by several threads, against the twin.
//   JOSTLE_CHURN   how many commands for each number of threads (20,000); a million for a thorough run
#include <cstdlib>
#include <thread>

#include "questions.hpp"

namespace world_tests {
namespace {

std::uint64_t commands_wanted()
{
    const char* const text = std::getenv("JOSTLE_CHURN");
    return text == nullptr ? 20'000 : std::strtoull(text, nullptr, 0);
}

template <int Dim, class T>
void churn(std::uint32_t threads_used, std::uint64_t commands, double extent, std::size_t objects)
{
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(threads_used);
    Churn<Dim, T> churn(threads_used, extent, true, {.executor = executor.get()});
    std::vector<std::vector<std::function<void()>>> said(threads_used);
    churn.dispatch = [&](ObjectId id, std::function<void()> call) {
        said[id.index % threads_used].push_back(std::move(call));
    };
    std::uint64_t most_bytes_early = 0, results = 0;
    for (std::uint64_t update = 0; churn.operations < commands; ++update) {
        const std::uint32_t burst = update % 64 == 0 ? static_cast<std::uint32_t>(objects)
                                    : update % 8 < 6 ? 150u
                                                     : churn.random.below(20);
        for (std::uint32_t k = 0; k < burst; ++k)
            churn.operate(objects);
        if (update % 16 == 15) churn.twin.salt = churn.random.next();
        std::vector<std::thread> threads;
        for (std::uint32_t t = 1; t < threads_used; ++t)
            threads.emplace_back([&, t] {
                for (const auto& call : said[t])
                    call();
            });
        for (const auto& call : said[0])
            call();
        for (std::thread& thread : threads)
            thread.join();
        for (auto& each : said)
            each.clear();
        ASSERT_TRUE(churn.update(update % 16 == 0)) << threads_used << " threads, update " << update;
        if (update % 8 == 0) {
            Questions<Dim, T> questions(churn, update);
            ASSERT_TRUE(questions.agree()) << threads_used << " threads, update " << update;
            results += questions.results;
        }
        if (update % 64 == 63) { // the bytes that make the rest exact are exact as well
            const std::vector<std::byte> saved = churn.world->save();
            jostle::World<Dim, T> other(churn.options);
            other.restore(saved);
            ASSERT_EQ(other.save(), saved);
        }
        const std::uint64_t bytes = churn.world->stats().bytes_reserved;
        if (churn.operations < commands / 2)
            most_bytes_early = std::max(most_bytes_early, bytes);
        else
            ASSERT_LT(bytes, 2 * most_bytes_early) << "memory that grows for ever";
    }
    EXPECT_GT(churn.began, commands / 20);
    EXPECT_GT(results, commands / 20);
    for (const std::uint64_t reason : churn.ended)
        EXPECT_GT(reason, commands / 1000);
}

TEST(Churn, OneThread)
{
    churn<3, float>(1, commands_wanted(), 7, 300);
}
TEST(Churn, TwoThreads)
{
    churn<2, double>(2, commands_wanted(), 16, 250);
}
TEST(Churn, SevenThreads)
{
    churn<3, float>(7, commands_wanted(), 7, 300);
}

} // namespace
} // namespace world_tests
