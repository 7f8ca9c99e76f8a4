// SPDX-License-Identifier: MIT
// Questions to worlds that change, against a walk over all objects.
#include <atomic>
#include <thread>

#include "questions.hpp"

namespace world_tests {
namespace {

template <int Dim, class T>
void ask(std::uint64_t seed, double extent, std::size_t objects)
{
    Churn<Dim, T> churn(seed, extent, false);
    for (std::size_t k = 0; k < 3 * objects; ++k)
        churn.operate(objects);
    std::uint64_t results = 0;
    for (int update = 0; update < 40; ++update) {
        ASSERT_TRUE(churn.update(false));
        Questions<Dim, T> questions(churn, seed * 1000 + static_cast<std::uint64_t>(update));
        ASSERT_TRUE(questions.agree()) << "seed " << seed << ", update " << update;
        results += questions.results;
        for (int k = 0; k < update % 4 * 5; ++k)
            churn.operate(objects);
    }
    EXPECT_GT(results, 2000u);
    EXPECT_GT(churn.world->stats().resting, 0u);
    EXPECT_GT(churn.world->stats().active, 0u);
}

TEST(Questions, AgreeWithAWalkOverAllObjects)
{
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        ask<3, float>(seed, 8, 200);
        ask<2, double>(seed, 12, 150);
    }
    ask<2, float>(4, 12, 150);
    ask<3, double>(4, 8, 200);
}

TEST(Questions, FromManyThreadsWhileCommandsAreQueued)
{
    Churn<3, float> churn(7, 10, false);
    for (int k = 0; k < 600; ++k)
        churn.operate(200);
    for (int round = 0; round < 5; ++round) {
        ASSERT_TRUE(churn.update(false));
        std::atomic<bool> stop{false};
        std::vector<std::thread> askers;
        std::atomic<int> wrong{0};
        for (std::uint64_t t = 0; t < 4; ++t)
            askers.emplace_back([&, t] {
                // The twin isn't read: it is about to know the commands of the next update.
                jostle::Ray<3, float> ray{{-5, 5, 5}, {1, 0.1f * static_cast<float>(t), 0}};
                const auto first = churn.world->first(ray);
                std::vector<ObjectHit<float>> all;
                while (!stop) {
                    (void)churn.world->all(ray, all);
                    if (churn.world->first(ray) != first || all.empty() || all[0] != first) ++wrong;
                }
            });
        for (int k = 0; k < 200; ++k)
            churn.operate(200);
        stop = true;
        for (std::thread& thread : askers)
            thread.join();
        EXPECT_EQ(wrong, 0);
    }
}

} // namespace
} // namespace world_tests
