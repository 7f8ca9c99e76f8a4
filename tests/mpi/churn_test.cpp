// SPDX-License-Identifier: MIT
// Everything at once: adds, moves, removals, filters, margins, on all ranks, against one World.
//   JOSTLE_CHURN   how many updates of each scene (40)
#include <cstdlib>

#include "scene.hpp"

namespace mpi_tests {
namespace {

using jostle::mpi::Rebalance;

int updates_wanted()
{
    const char* const text = std::getenv("JOSTLE_CHURN");
    return text == nullptr ? 40 : std::atoi(text);
}

template <int Dim, class T>
void churn(std::uint32_t threads, double extent, std::size_t objects, jostle::mpi::WorldOptions options)
{
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(threads);
    options.executor = executor.get();
    Scene<Dim, T> scene(threads, extent, options);
    const int updates = updates_wanted();
    for (int update = 0; update < updates; ++update) {
        const std::uint32_t burst = update % 16 == 1 ? static_cast<std::uint32_t>(objects)
                                    : update % 8 < 6 ? 100u
                                                     : scene.random.below(20);
        for (std::uint32_t k = 0; k < burst; ++k)
            scene.operate(objects);
        if (update % 8 == 5 && rank() == ranks() - 1) scene.world->request_rebalance();
        ASSERT_TRUE(scene.update()) << "update " << update;
    }
    const auto all = static_cast<std::uint64_t>(updates);
    EXPECT_GT(scene.began, all * 20);
    EXPECT_GT(scene.persisted, all * 20);
    for (const std::uint64_t reason : scene.ended)
        EXPECT_GT(reason, all / 2);
    if (ranks() == 1) return;
    EXPECT_GT(scene.ghosts, all);
    EXPECT_GT(scene.delivered, all);
    if (options.migrate)
        EXPECT_GT(scene.migrated, all);
    else
        EXPECT_EQ(scene.migrated, 0u);
}

TEST(Churn, Float3)
{
    churn<3, float>(1, 7, 300, {});
}
TEST(Churn, Float3TwoThreads)
{
    churn<3, float>(2, 9, 500, {.rebalance = Rebalance::on_request});
}
TEST(Churn, Double2)
{
    churn<2, double>(1, 16, 250, {.margin = 0.125});
}
TEST(Churn, Float2OfThoseWhoStay)
{
    churn<2, float>(2, 16, 250, {.migrate = false});
}
TEST(Churn, Double3OfThoseWhoStay)
{
    churn<3, double>(1, 7, 300, {.rebalance = Rebalance::on_request, .migrate = false});
}

} // namespace
} // namespace mpi_tests
