// SPDX-License-Identifier: MIT
// A World under random commands, against its twin.
#include "churn.hpp"

namespace world_tests {
namespace {

template <int Dim, class T>
void churn(std::uint64_t seed, double extent, std::size_t objects, int updates, bool callback, double margin,
           jostle::Executor& executor)
{
    jostle::WorldOptions options;
    options.executor = &executor;
    options.margin = margin;
    Churn<Dim, T> churn(seed, extent, callback, options);
    for (int update = 0; update < updates; ++update) {
        // Bursts, single commands, and times in which nothing happens, so that objects come to rest.
        const std::uint32_t commands =
            update == 0 ? static_cast<std::uint32_t>(2 * objects)
                        : (update % 40 < 20 ? churn.random.below(12) : 0) +
                              (update % 25 == 24 ? static_cast<std::uint32_t>(objects) : 0);
        if (callback && update % 16 == 15) churn.twin.salt = churn.random.next();
        for (std::uint32_t k = 0; k < commands; ++k)
            churn.operate(objects);
        ASSERT_TRUE(churn.update(update % 8 == 0)) << "seed " << seed << ", update " << update;
    }
    EXPECT_GT(churn.began, objects);
    EXPECT_GT(churn.persisted, objects);
    for (const std::uint64_t reason : churn.ended)
        EXPECT_GT(reason, 0u);
    EXPECT_GT(churn.world->stats().resting, 0u);
}

TEST(Twin, AgreesUnderRandomCommands)
{
    const std::unique_ptr<jostle::Executor> threads = jostle::make_thread_executor(3);
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        const bool callback = seed % 2 == 0;
        jostle::Executor& executor = seed % 3 == 0 ? *threads : jostle::serial_executor();
        churn<3, float>(seed, 7, 300, 120, callback, 0, executor);
        churn<2, float>(seed, 16, 250, 120, callback, 0.125, executor);
        churn<3, double>(seed, 4, 60, 200, callback, 0, executor);
        churn<2, double>(seed, 3, 12, 400, callback, 0, executor);
    }
}

} // namespace
} // namespace world_tests
