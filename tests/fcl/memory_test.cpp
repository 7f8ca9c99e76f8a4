// SPDX-License-Identifier: MIT
// A manager that ran out of memory is unchanged.
#include <fcl/geometry/shape/sphere.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "jostle/fcl.hpp"
#include "tests/global_new.hpp"

#if JOSTLE_OWN_NEW
namespace {

using Object = fcl::CollisionObjectd;

/// Calls `call` with less and less memory, then with enough. After each failure calls `check`. Returns how
/// often it failed.
template <class Call, class Check>
std::uint64_t starve(const Call& call, const Check& check)
{
    for (std::uint64_t allowed = 0;; ++allowed) {
        bool failed = false;
        global_new::fail_at = global_new::calls + allowed;
        try {
            call();
        } catch (const std::bad_alloc&) {
            failed = true;
        }
        global_new::fail_at = global_new::never;
        if (!failed) return allowed;
        check();
    }
}

std::size_t pairs_of(jostle::fcl::Manager<double>& manager)
{
    std::size_t pairs = 0;
    manager.collide(&pairs, [](Object*, Object*, void* count) {
        ++*static_cast<std::size_t*>(count);
        return false;
    });
    return pairs;
}

TEST(ManagerMemory, FailedCallsLoseNoObject)
{
    constexpr std::size_t count = 300;
    const auto ball = std::make_shared<fcl::Sphered>(0.6);
    std::vector<std::unique_ptr<Object>> objects;
    for (std::size_t k = 0; k < count; ++k) // each touches those beside it
        objects.push_back(std::make_unique<Object>(ball, fcl::Matrix3d::Identity(),
                                                   fcl::Vector3d(static_cast<double>(k), 0, 0)));
    jostle::fcl::Manager<double> manager;
    std::uint64_t failures = 0;
    for (std::size_t k = 0; k < count; ++k) {
        failures +=
            starve([&] { manager.registerObject(objects[k].get()); }, [&] { EXPECT_EQ(manager.size(), k); });
        ASSERT_EQ(manager.size(), k + 1);
    }
    EXPECT_GT(failures, count);
    EXPECT_EQ(pairs_of(manager), count - 1);
    for (const std::size_t k : {10u, 20u, 30u}) { // few, so that they are noted one by one
        objects[k]->setTranslation(fcl::Vector3d(0, static_cast<double>(100 + k), 0));
        objects[k]->computeAABB();
        starve([&] { manager.update(objects[k].get()); }, [] {});
    }
    EXPECT_EQ(pairs_of(manager), count - 1 - 6);
}

TEST(ManagerMemory, SmallBatchesAreRegisteredWithoutMovingAllThatAreThere)
{
    constexpr std::size_t count = 2000;
    const auto ball = std::make_shared<fcl::Sphered>(0.6);
    std::vector<std::unique_ptr<Object>> objects;
    for (std::size_t k = 0; k < count; ++k)
        objects.push_back(std::make_unique<Object>(ball));
    jostle::fcl::Manager<double> manager;
    std::vector<Object*> batch(1);
    const std::uint64_t before = global_new::calls;
    for (const auto& object : objects) {
        batch[0] = object.get();
        manager.registerObjects(batch);
    }
    EXPECT_LT(global_new::calls - before, count + 100); // one for each in the map
    EXPECT_EQ(manager.size(), count);
}

} // namespace
#endif
